"""Commands that take a contact into other programs: fmu, reduce."""

from pathlib import Path
from typing import Any

import click

from historysim.basics.targets import PICTURE
from historysim.cli import options
from historysim.cli.output import check_outputs, notice, save, write_answer

CONTROLS = click.Choice(["load", "displacement"])


def _control(direction: str, default: str) -> Any:
    text = f"The input that controls the {direction} direction."
    return click.option(f"--{direction}", type=CONTROLS, default=default, show_default=True, help=text)


@click.command()
@options.shared("scenario")
@options.output_option("The unit (.fmu). [default: SCENARIO's name with .fmu, here]")
@options.quantity_option(
    "--at", "s", help='Start from the state at this time, as "12.5 s". [default: nothing has touched]'
)
@_control("normal", "load")
@_control("tangential", "displacement")
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
@options.shared("quiet", "json", "force", "set")
def fmu(
    scenario: Path, output: Path | None, fmi: str, platforms: str | None, values: dict[str, Any], **choices: Any
) -> None:
    """Write the contact of a scenario as a unit for co-simulation (FMU).

    SCENARIO (TOML) may also be a log or a result.
    """
    output = output or Path(f"{scenario.stem}.fmu")
    from historysim.scenario.run import source_of

    source = source_of(scenario, values)
    from historysim.exchange.fmu.unit_file import write_fmu

    choices |= {"fmi": int(fmi), "platforms": platforms and [name.strip() for name in platforms.split(",")]}
    choices |= {"force": options.given("force"), "progress": not options.given("quiet"), "notify": notice}
    write_fmu(source, output, **choices)
    write_answer(files=[output])


@click.command()
@options.shared("scenario")
@click.option(
    "-e", "--elements", type=click.IntRange(1, 1000), default=32, show_default=True, help="Number of springs."
)
@options.quantity_option(
    "--normal-load", "N", help='The normal load at which the springs are placed, as "50 mN". [default: the largest]'
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
@options.shared("size", "json", "force", "set")
def reduce(
    scenario: Path,
    outputs: tuple[Path, ...],
    form: str | None,
    picture: Path | None,
    size: tuple[float, float] | None,
    values: dict[str, Any],
    **choices: Any,
) -> None:
    """Reduce the contact of a scenario to a few sliding springs.

    SCENARIO (TOML) may also be a log or a result. The answer bounds the error of the tangential load.
    """
    from historysim.scenario.run import source_of

    source = source_of(scenario, values)
    from historysim.exchange.reduced.model_texts import form_of, format_of
    from historysim.exchange.reduced.reduced_model import ReducedPicture
    from historysim.exchange.reduced.reducing import reduce as carry_out

    forms = {path: form_of(path, form if path.suffix.lower() == ".py" else None) for path in outputs}
    options.check_drawn(size, [picture])
    written = [(path, format_of(name)) for path, name in forms.items()]
    files = check_outputs(source.files, *written, (picture, PICTURE))
    model = carry_out(source, notify=notice, **choices)
    for path, name in forms.items():
        model.write(path, form=name, force=options.given("force"))
    if picture is not None:
        save(ReducedPicture().figure(model, {"size": size}), picture)
    write_answer(model.summary(), files=files, data=model.dataset)
