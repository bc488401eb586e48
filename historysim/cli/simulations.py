"""Commands that replay a scenario: run, validate, sweep, design."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.targets import PICTURE, Output, check_outputs
from historysim.cli import options
from historysim.cli.output import TABLE_OF_SWEEP, Answer, csv_of_sweep, notice, save, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from historysim.scenario.grid import Axis


@click.command()
@options.scenario_argument
@options.output_option("The result (netCDF). [default: SCENARIO's name with .nc, here]")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the result, beside it, with .png.")
@options.path_option("--picture", help="Also draw the result to this file (PNG, PDF, SVG).")
@options.quiet_option
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
@options.json_option
@options.force_option
@options.set_option
def run(
    scenario: Path,
    values: dict[str, Any],
    output: Path | None,
    with_picture: bool,
    picture: Path | None,
    quiet: bool,
    as_json: bool,
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

    source = source_of(scenario, values)
    outputs = [Output(path, (PICTURE,)) for path in pictures]
    write(source, output, RunOptions(progress=not quiet, notify=notice, **choices), *outputs)
    if pictures:
        from historysim.results.result_files import open_result
        from historysim.scenario.figure import drawable
        from historysim.verbs import plot

        with open_result(output) as history:
            # what is drawn of the surface alone needs no result
            own = getattr(source, "scenario", None)
            drawn = plot(history if own is None or drawable(history) or not drawable(own) else own)
            for path in pictures:
                save(drawn, path)
    if not quiet:
        from historysim.results.analysis.history_summary import summary
        from historysim.results.result_files import open_recorded

        with open_recorded(output, own=True) as recorded:
            lines = summary(recorded)
        files = [("result", str(output)), *(("picture", str(path)) for path in pictures)]
        write_answer(Answer([*lines, *files]), as_json=as_json)


@click.command()
@options.scenario_argument
@options.json_option
@options.set_option
def validate(scenario: Path, as_json: bool, values: dict[str, Any]) -> None:
    """Check SCENARIO (TOML) and the files that it names."""
    from historysim.studies.validation import validate as validated

    write_answer(Answer(validated(scenario, values)), as_json=as_json)
    if not as_json:
        click.echo("valid")


@click.command()
@options.scenario_argument
@options.output_option("The table (.nc or .csv). [default: SCENARIO's name with .nc, here]")
@options.path_option("--store", help="The folder in which cells are kept as they end. [default: NAME.cells beside it]")
@options.workers_option
@options.quiet_option
@options.json_option
@options.force_option
@options.set_option
def sweep(
    scenario: Path,
    output: Path | None,
    store: Path | None,
    workers: int,
    quiet: bool,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
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
    check_outputs([_table_over(output, grid.axes)], loaded.files, force=force)
    table = carry_out(loaded, store=store, workers=workers, progress=not quiet, notify=notice)
    write_sweep(table, output)
    if not quiet:
        files = [("cells kept in", str(store)), ("result", str(output))]
        write_answer(Answer([*sweep_summary(table), *files], data=lambda: table), as_json=as_json)


@click.command()
@options.scenario_argument
@options.output_option("Also write what was found at each point to this file (.nc or .csv).")
@options.workers_option
@options.quiet_option
@options.json_option
@options.force_option
@options.set_option
def design(
    scenario: Path,
    output: Path | None,
    workers: int,
    quiet: bool,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Find the value of a key that gives a wanted output.

    [design] of SCENARIO (TOML) names the key, its range, and the output.
    """
    from historysim.results.tables import write_sweep
    from historysim.scenario.scenario import load
    from historysim.studies.design import design as carry_out
    from historysim.studies.design import problem_of, summary

    loaded = load(scenario, values)
    if output is not None:
        problem, grid = problem_of(loaded)
        check_outputs([_table_over(output, grid.axes, problem.key)], loaded.files, force=force)
    table = carry_out(loaded, workers=workers, progress=not quiet, notify=notice)
    if output is not None:
        write_sweep(table, output)
    if not quiet:
        files = [("result", str(output))] if output else []
        write_answer(Answer([*summary(table), *files], data=lambda: table), as_json=as_json)


def _table_over(output: Path, axes: "Iterable[Axis]", *others: str) -> Output:
    """Return a table with a row for each point of some axes, and columns of other keys."""
    keys = [key for axis in axes for key in axis.keys]
    return Output(output, (TABLE_OF_SWEEP, csv_of_sweep([*keys, *others])))
