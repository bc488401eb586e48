"""Commands that replay a scenario: run, validate, sweep, design."""

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

    from historysim.results.plots.printed import PrintedFigure
    from historysim.scenario.grid import Axis


@click.command()
@options.shared("scenario")
@options.output_option("The result (netCDF). [default: SCENARIO's name with .nc, here]")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the result, beside it, with .png.")
@options.path_option("--picture", help="Also draw the result to this file (PNG, PDF, SVG).")
@options.shared("quiet")
@click.option("--resume", is_flag=True, help="Go on where an earlier run stopped, from its log.")
@click.option(
    "--snapshot-every",
    type=click.IntRange(1),
    metavar="STEPS",
    help="Write a snapshot every STEPS steps. [default: some seconds of replay]",
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
    from historysim.scenario.run import source_of, write

    source, quiet = source_of(scenario, values), options.given("quiet")
    outputs = [Output(path, (PICTURE,)) for path in pictures]
    chosen = RunOptions(progress=not quiet, notify=notice, force=options.given("force"), **choices)
    write(source, output, chosen, *outputs)
    if quiet and not pictures:
        return
    from historysim.results.result_files import open_result

    with open_result(output) as history:
        drawn = _drawn(source, history) if pictures else None
        for path in pictures:
            save(drawn, path)
        if not quiet:
            from historysim.results.analysis.history_summary import summary

            files = [("result", str(output)), *(("picture", str(path)) for path in pictures)]
            write_answer([*summary(history), *files])


def _drawn(source: Any, history: "xr.Dataset") -> "PrintedFigure":
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
    from historysim.studies.sweep import sweep as carry_out
    from historysim.studies.sweep import sweep_of

    loaded = load(scenario, values)
    grid, _ = sweep_of(loaded)
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
    from historysim.studies.design import problem_of, summary

    loaded = load(scenario, values)
    problem, grid = problem_of(loaded)
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
