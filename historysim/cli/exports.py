"""Commands that take a contact into other programs: fmu, reduce."""

from pathlib import Path
from typing import Any

import click

from historysim.basics.targets import PICTURE, Output, check_outputs
from historysim.cli.options import force_option, json_option, path_type, quantity_option, set_option
from historysim.cli.output import Answer, notice, save, write_answer


@click.command()
@click.argument("scenario", type=path_type)
@click.option("-o", "--output", type=path_type, help="The unit (.fmu). [default: SCENARIO's name with .fmu, here]")
@click.option("--at", "moment", help='Start from the state at this time, as "12.5 s". [default: nothing has touched]')
@click.option(
    "--normal",
    type=click.Choice(["load", "displacement"]),
    default="load",
    show_default=True,
    help="The input that controls the normal direction.",
)
@click.option(
    "--tangential",
    type=click.Choice(["load", "displacement"]),
    default="displacement",
    show_default=True,
    help="The input that controls the tangential direction.",
)
@click.option(
    "--saturate/--refuse",
    default=None,
    help="Hold a tangential load beyond the friction limit, or refuse the step. [default: as SCENARIO says]",
)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of the standard.")
@click.option(
    "--platforms",
    metavar="NAME,NAME",
    help="Platforms to compile for, such as x86_64-linux,x86_64-windows; those other than this one need ziglang. "
    "[default: this one]",
)
@json_option
@force_option
@set_option
def fmu(
    scenario: Path,
    output: Path | None,
    moment: str | None,
    normal: str,
    tangential: str,
    saturate: bool | None,
    fmi: str,
    platforms: str | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Write the contact of SCENARIO (TOML), of a log or of a result as a unit of co-simulation (FMU)."""
    output = output or Path(f"{scenario.stem}.fmu")
    at = None if moment is None else quantity_option("--at", moment, "s")
    from historysim.scenario.run import source_of

    source = source_of(scenario, values)
    from historysim.exchange.fmu.unit_file import write_fmu

    write_fmu(
        source,
        output,
        at=at,
        normal=normal,
        tangential=tangential,
        saturate=saturate,
        fmi=int(fmi),
        platforms=None if platforms is None else [name.strip() for name in platforms.split(",")],
        force=force,
        progress=True,
        notify=notice,
    )
    write_answer(Answer(files=[output]), as_json=as_json)


@click.command()
@click.argument("scenario", type=path_type)
@click.option(
    "-e", "--elements", type=click.IntRange(1, 1000), default=32, show_default=True, help="Number of springs."
)
@click.option(
    "--normal-load", "load", help='The normal load at which the springs are placed, as "50 mN". [default: the largest]'
)
@click.option(
    "-o",
    "--output",
    "outputs",
    type=path_type,
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
@click.option("--picture", type=path_type, help="Draw model and contact to this file (PNG, PDF, SVG).")
@json_option
@force_option
@set_option
def reduce(
    scenario: Path,
    elements: int,
    load: str | None,
    outputs: tuple[Path, ...],
    form: str | None,
    picture: Path | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Reduce the contact of SCENARIO (TOML), of a log or of a result to few springs that slide, with a bound."""
    normal_load = None if load is None else quantity_option("--normal-load", load, "N")
    from historysim.scenario.run import source_of

    source = source_of(scenario, values)
    from historysim.exchange.reduced.model_files import form_of, output_of
    from historysim.exchange.reduced.reducing import reduce as carry_out

    forms = {path: form_of(path, form if path.suffix.lower() == ".py" else None) for path in outputs}
    targets = [output_of(path, form) for path, form in forms.items()]
    if picture is not None:
        targets.append(Output(picture, (PICTURE,)))
    check_outputs(targets, source.files, force=force)
    model = carry_out(source, elements=elements, normal_load=normal_load, notify=notice)
    for path, name in forms.items():
        model.write(path, form=name, force=force)
    if picture is not None:
        from historysim.exchange.reduced.reduced_picture import ReducedPicture

        save(ReducedPicture().figure(model), picture)
    files = [*outputs, *([] if picture is None else [picture])]
    write_answer(Answer(model.summary(), files=files, data=model.dataset), as_json=as_json)
