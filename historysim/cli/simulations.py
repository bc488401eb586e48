"""Commands that take a scenario: run, validate, sweep, design, fmu, reduce."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.targets import PICTURE, Output, OutputFormat, csv_table, netcdf
from historysim.cli import options
from historysim.cli.output import check_outputs, notice, save, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

    import xarray as xr

    from historysim.scenario.grid import Axis


@click.command()
@options.shared("scenario")
@options.output_option("The result (netCDF, or a zarr store: .zarr). [default: SCENARIO's name with .nc, here]")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the result, beside it, with .png.")
@options.path_option("--picture", help="Also draw the result to this file (PNG, PDF, SVG).")
@options.shared("quiet")
@click.option("--resume", is_flag=True, help="Go on where an earlier run stopped, from its log.")
@click.option(
    "--snapshot-every",
    type=click.IntRange(1),
    metavar="STEPS",
    help="Write a snapshot every STEPS steps. [default: some seconds of replay, and 1 GB of snapshots at most]",
)
@click.option(
    "--record",
    type=click.Choice(["totals"]),
    help="Write the log, snapshots and totals alone; variables of asperities are computed later, when they are read.",
)
@click.option(
    "--cluster", metavar="ADDRESS", help="Compute a zarr store on a dask cluster: the address of its scheduler."
)
@click.option("--compression", type=click.Choice(["none", "zlib", "zstd"]), default="none", show_default=True)
@click.option(
    "--threads",
    type=click.IntRange(1),
    help="Threads that record many asperities; the result is the same. [default: one for each processor, up to 4]",
)
@options.shared("json", "force", "set")
def run(
    scenario: Path,
    values: dict[str, Any],
    output: Path | None,
    with_picture: bool,
    picture: Path | None,
    **choices: Any,
) -> None:
    """Replay SCENARIO (TOML) and write the history (netCDF).

    SCENARIO may also be the log or the result of a run, which is then made again.

    The log, NAME.history, stands beside the result from the beginning.
    """
    output = output or Path(f"{scenario.stem}.nc")
    pictures = [path for path in (output.with_suffix(".png") if with_picture else None, picture) if path is not None]
    from historysim.log.result import RunOptions
    from historysim.scenario.run import open_source, write

    source, quiet = open_source(scenario, values), options.given("quiet")
    outputs = [Output(path, (PICTURE,)) for path in pictures]
    chosen = RunOptions(progress=not quiet, notify=notice, force=options.given("force"), **choices)
    write(source, output, chosen, *outputs)
    from historysim.results.result_files import open_file_history, open_result

    if pictures:
        with open_result(output, exclusive=True) as history:
            drawn = _drawn(source, history)
            for path in pictures:
                save(drawn, path)
    if not quiet:
        from historysim.results.analysis.history_summary import summary_lines

        files = [("result", str(output)), *(("picture", str(path)) for path in pictures)]
        with open_file_history(output, exclusive=True) as summarised:
            write_answer([*summary_lines(summarised), *files])


def _drawn(source: Any, history: "xr.Dataset") -> Any:
    """Draw a result, or its scenario where what is drawn is of the surface alone."""
    from historysim.scenario.figure import drawable
    from historysim.verbs import plot

    own = getattr(source, "scenario", None)
    return plot(history if own is None or drawable(history) or not drawable(own) else own)


@click.command()
@options.shared("scenario", "json", "set")
def validate(scenario: Path, values: dict[str, Any]) -> None:
    """Check SCENARIO (TOML) and the files that it names."""
    from historysim.studies.validation import validate as validated

    write_answer(validated(scenario, values))
    if not options.given("json"):
        click.echo("valid")


@click.command()
@options.shared("scenario")
@options.output_option("The table (.nc or .csv). [default: SCENARIO's name with .nc, here]")
@options.path_option("--store", help="The folder in which cells are kept as they end. [default: NAME.cells beside it]")
@options.shared("workers", "quiet", "json", "force", "set")
def sweep(scenario: Path, output: Path | None, store: Path | None, workers: int, values: dict[str, Any]) -> None:
    """Replay SCENARIO (TOML) at all points of its [sweep].

    The outputs go to one file.

    A sweep that was interrupted goes on where it stopped. A cell that cannot be computed is reported and left empty.
    """
    output = output or Path(f"{scenario.stem}.nc")
    store = store or output.with_suffix(".cells")
    if store.exists() and not store.is_dir():
        raise InputError(f"{store}: is a file; expected a folder for the cells, or the name of a new one")
    from historysim.results.tables import sweep_summary, write_sweep
    from historysim.scenario.scenario import load
    from historysim.studies.sweep import read_sweep
    from historysim.studies.sweep import sweep as carry_out

    loaded = load(scenario, values)
    grid, _ = read_sweep(loaded)
    check_outputs(loaded.files, (output, *_tables_over(grid.axes)))
    table = carry_out(loaded, store=store, workers=workers, progress=not options.given("quiet"), notify=notice)
    write_sweep(table, output)
    files = [("cells kept in", str(store)), ("result", str(output))]
    write_answer([*sweep_summary(table), *files], data=lambda: table)


@click.command()
@options.shared("scenario")
@options.output_option("Also write what was found at each point to this file (.nc or .csv).")
@options.shared("workers", "quiet", "json", "force", "set")
def design(scenario: Path, output: Path | None, workers: int, values: dict[str, Any]) -> None:
    """Find the value of a key that gives a wanted output.

    [design] of SCENARIO (TOML) names the key, its range, and the output.
    """
    from historysim.results.tables import write_sweep
    from historysim.scenario.scenario import load
    from historysim.studies.design import design as carry_out
    from historysim.studies.design import read_problem, summary

    loaded = load(scenario, values)
    problem, grid = read_problem(loaded)
    written = check_outputs(loaded.files, (output, *_tables_over(grid.axes, problem.key)))
    table = carry_out(loaded, workers=workers, progress=not options.given("quiet"), notify=notice)
    for path in written:
        write_sweep(table, path)
    write_answer([*summary(table), *(("result", str(path)) for path in written)], data=lambda: table)


def _tables_over(axes: "Iterable[Axis]", *others: str) -> tuple[OutputFormat, ...]:
    """Return the forms of a table with a row for each point of some axes, and columns of other keys."""
    from historysim.scenario.grid import variable_name

    keys = [variable_name(key) for key in (*(key for axis in axes for key in axis.keys), *others)]
    return netcdf("a sweep", "sweep"), csv_table("a sweep over the same keys", *keys)


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
    from historysim.scenario.run import open_source

    source = open_source(scenario, values)
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
    help="The model: .json, .mo (Modelica), .tcl (OpenSees) or .py (OpenSeesPy); may be given several times.",
)
@options.path_option("--picture", help="Draw model and contact to this file (PNG, PDF, SVG).")
@options.shared("size", "json", "force", "set")
def reduce(
    scenario: Path,
    outputs: tuple[Path, ...],
    picture: Path | None,
    size: tuple[float, float] | None,
    values: dict[str, Any],
    **choices: Any,
) -> None:
    """Reduce the contact of a scenario to a few sliding springs.

    SCENARIO (TOML) may also be a log or a result. The answer bounds the error of the tangential load.
    """
    from historysim.scenario.run import open_source

    source = open_source(scenario, values)
    from historysim.exchange.reduced.model_texts import select_format
    from historysim.exchange.reduced.reduced_model import ReducedPicture
    from historysim.exchange.reduced.reducing import reduce as carry_out

    options.check_drawn(size, [picture])
    written = [(path, select_format(path)) for path in outputs]
    files = check_outputs(source.files, *written, (picture, PICTURE))
    model = carry_out(source, notify=notice, **choices)
    for path in outputs:
        model.write(path, force=options.given("force"))
    if picture is not None:
        save(ReducedPicture().figure(model, {"size": size}), picture)
    write_answer(model.summary(), files=files, data=model.dataset)
