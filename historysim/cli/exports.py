"""Commands that take a contact into other programs: fmu, reduce."""

from pathlib import Path
from typing import Any

import click

from historysim.basics.targets import PICTURE, Output, check_outputs
from historysim.cli import options
from historysim.cli.output import Answer, notice, save, write_answer

CONTROLS = click.Choice(["load", "displacement"])


@click.command()
@options.scenario_argument
@options.output_option("The unit (.fmu). [default: SCENARIO's name with .fmu, here]")
@click.option(
    "--at",
    type=options.QuantityType("s"),
    help='Start from the state at this time, as "12.5 s". [default: nothing has touched]',
)
@click.option(
    "--normal", type=CONTROLS, default="load", show_default=True, help="The input that controls the normal direction."
)
@click.option(
    "--tangential",
    type=CONTROLS,
    default="displacement",
    show_default=True,
    help="The input that controls the tangential direction.",
)
@click.option(
    "--saturate/--refuse",
    default=None,
    help="Hold a tangential load beyond the friction limit, or refuse the step. [default: as SCENARIO says]",
)
@click.option(
    "--directions",
    type=click.IntRange(1, 2),
    help="Tangential directions; two have inputs and outputs in x and y. [default: as SCENARIO has]",
)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of the standard.")
@click.option(
    "--platforms",
    metavar="NAME,NAME",
    help="Platforms to compile for, such as x86_64-linux,x86_64-windows; those other than this one need ziglang. "
    "[default: this one]",
)
@options.quiet_option
@options.json_option
@options.force_option
@options.set_option
def fmu(
    scenario: Path,
    output: Path | None,
    fmi: str,
    platforms: str | None,
    quiet: bool,
    as_json: bool,
    values: dict[str, Any],
    **choices: Any,
) -> None:
    """Write the contact of a scenario as a unit for co-simulation (FMU).

    SCENARIO (TOML) may also be a log or a result.
    """
    output = output or Path(f"{scenario.stem}.fmu")
    from historysim.scenario.run import source_of

    source = source_of(scenario, values)
    from historysim.exchange.fmu.unit_file import write_fmu

    names = None if platforms is None else [name.strip() for name in platforms.split(",")]
    write_fmu(source, output, fmi=int(fmi), platforms=names, progress=not quiet, notify=notice, **choices)
    if not quiet:
        write_answer(Answer(files=[output]), as_json=as_json)


@click.command()
@options.scenario_argument
@click.option(
    "-e", "--elements", type=click.IntRange(1, 1000), default=32, show_default=True, help="Number of springs."
)
@click.option(
    "--normal-load",
    type=options.QuantityType("N"),
    help='The normal load at which the springs are placed, as "50 mN". [default: the largest]',
)
@options.path_option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    help="The model: .json, .csv, .mo (Modelica), .m (MATLAB), .tcl (OpenSees), .py (see --for); may be given several "
    "times.",
)
@click.option(
    "--for",
    "form",
    help="The program that a .py is for: openseespy, pyharm or tmdsimpy. [default: openseespy]",
    type=click.Choice(["openseespy", "pyharm", "tmdsimpy"]),
)
@options.path_option("--picture", help="Draw model and contact to this file (PNG, PDF, SVG).")
@options.size_option
@options.json_option
@options.force_option
@options.set_option
def reduce(
    scenario: Path,
    elements: int,
    normal_load: float | None,
    outputs: tuple[Path, ...],
    form: str | None,
    picture: Path | None,
    size: tuple[float, float] | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Reduce the contact of a scenario to a few sliding springs.

    SCENARIO (TOML) may also be a log or a result. The answer bounds the error of the tangential load.
    """
    from historysim.scenario.run import source_of

    source = source_of(scenario, values)
    from historysim.exchange.reduced.reduced_model import form_of, output_of
    from historysim.exchange.reduced.reducing import reduce as carry_out

    forms = {path: form_of(path, form if path.suffix.lower() == ".py" else None) for path in outputs}
    options.check_drawn(size, [picture])
    targets = [output_of(path, form) for path, form in forms.items()]
    if picture is not None:
        targets.append(Output(picture, (PICTURE,)))
    check_outputs(targets, source.files, force=force)
    model = carry_out(source, elements=elements, normal_load=normal_load, notify=notice)
    for path, name in forms.items():
        model.write(path, form=name, force=force)
    if picture is not None:
        from historysim.exchange.reduced.reduced_model import ReducedPicture

        save(ReducedPicture().figure(model, {"size": size}), picture)
    files = [*outputs, *([] if picture is None else [picture])]
    write_answer(Answer(model.summary(), files=files, data=model.dataset), as_json=as_json)
