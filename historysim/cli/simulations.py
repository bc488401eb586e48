"""Commands for scenarios: run, validate, sweep, design, fmu, reduce."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.targets import PICTURE, Output, OutputFormat, csv_table, netcdf
from historysim.cli import options
from historysim.cli.output import (
    check_outputs,
    notice,
    save,
    split_outputs,
    write_answer,
    write_outputs,
)
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import xarray as xr

    from historysim.cli.output import Outputs
    from historysim.scenario.grid import Axis
    from historysim.scenario.run import Source


@click.command()
@options.common("scenario")
@options.outputs_option(
    "The result (netCDF, or a zarr store: .zarr).", "SCENARIO's name with .nc, here"
)
@options.flag("--plot", "with_picture", help="Also draw the result, next to it, with .png.")
@options.common("quiet")
@options.from_function(
    "scenario.run:run", "resume", "snapshot_every", "record", "cluster", "compression", "threads"
)
@options.common("json", "force", "set")
def run(
    scenario: Path,
    values: dict[str, Any],
    outputs: tuple[Path, ...],
    with_picture: bool,
    **choices: Any,
) -> None:
    """Replay SCENARIO (TOML) and write the history (netCDF).

    SCENARIO may also be the log or the result of a run, which is then recomputed.

    The log, NAME.history, is written next to the result.
    """
    output, pictures = split_outputs(outputs, Path(f"{scenario.stem}.nc"))
    if with_picture:
        pictures.insert(0, output.with_suffix(".png"))
    from historysim.log.result import RunOptions
    from historysim.scenario.run import open_source, run_each, write

    source, quiet = open_source(scenario, values), options.has_flag("quiet")
    run_options = RunOptions(
        progress=not quiet, notify=notice, force=options.has_flag("force"), **choices
    )
    from historysim.results.result_files import open_file_history, open_result

    def replay(
        source: "Source", target: Path | None, pictures: "Sequence[Path]"
    ) -> "tuple[Path, Outputs]":
        target = target or output
        write(source, target, run_options, *(Output(path, (PICTURE,)) for path in pictures))
        return target, [(path, functools.partial(draw, source, target, path)) for path in pictures]

    def draw(source: "Source", result: Path, path: Path) -> None:
        with open_result(result, exclusive=True) as history:
            save(_draw_result(source, history), path)

    def replay_run(source: "Source", target: Path | None) -> "tuple[Path, Outputs]":
        number = (target or output).stem.rpartition("_")[2]
        return replay(
            source, target, [path.with_stem(f"{path.stem}_{number}") for path in pictures]
        )

    if source.each_run is not None:
        runs = run_each(source, output, replay_run)
        results = runs.results.values()
        problems = [(f"run {run.number}", run.problem) for run in runs if run.problem]
        drawn = [picture for _, pictures in results for picture in pictures]
        write_answer(files=[path for path, _ in results], below=problems, outputs=drawn)
        return
    _, drawings = replay(source, output, pictures)
    if not quiet:
        from historysim.results.analysis.history_summary import summary_lines

        files = [("result", str(output)), *(("picture", str(path)) for path in pictures)]
        with open_file_history(output, exclusive=True) as view:
            write_answer([*summary_lines(view), *files])
    write_outputs(drawings)


def _draw_result(source: Any, history: "xr.Dataset") -> Any:
    """Draw a result, with the files of its scenario where that is known."""
    from historysim.scenario.figure import draw_scenario_figure, drawable
    from historysim.verbs import plot

    if pictures := drawable(history):
        return draw_scenario_figure(history, pictures, scenario=getattr(source, "scenario", None))
    return plot(history)


@click.command()
@options.common("scenario", "json", "set")
def validate(scenario: Path, values: dict[str, Any]) -> None:
    """Check SCENARIO (TOML) and the files that it names."""
    from historysim.studies.validation import validate as check

    write_answer(check(scenario, values))
    if not options.has_flag("json"):
        click.echo("valid")


@click.command()
@options.common("scenario")
@options.output_option("The table (.nc or .csv). [default: SCENARIO's name with .nc, here]")
@options.path_option(
    "--store", help="Folder that keeps completed cells. [default: NAME.cells next to the table]"
)
@options.common("workers", "quiet", "json", "force", "set")
def sweep(
    scenario: Path, output: Path | None, store: Path | None, workers: int, values: dict[str, Any]
) -> None:
    """Replay SCENARIO (TOML) at all points of its [sweep].

    The outputs are written to one file.

    An interrupted sweep resumes. A cell that cannot be computed is reported and left empty.
    """
    output = output or Path(f"{scenario.stem}.nc")
    store = store or output.with_suffix(".cells")
    if store.exists() and not store.is_dir():
        raise InputError(
            f"{store}: is a file; expected a folder for the cells, or the name of a new one"
        )
    from historysim.results.tables import sweep_summary, write_sweep
    from historysim.scenario.scenario import load
    from historysim.studies import sweep as verb

    loaded = load(scenario, values)
    grid, _ = verb.read_sweep(loaded)
    check_outputs(loaded.files, (output, *_tables_over(grid.axes)))
    table = verb.sweep(
        loaded, store=store, workers=workers, progress=not options.has_flag("quiet"), notify=notice
    )
    files = [("cells kept in", str(store)), ("result", str(output))]
    write_answer([*sweep_summary(table), *files], data=lambda: table)
    write_sweep(table, output)


@click.command()
@options.common("scenario")
@options.output_option("Also write the results of all points to this file (.nc or .csv).")
@options.common("workers", "quiet", "json", "force", "set")
def design(scenario: Path, output: Path | None, workers: int, values: dict[str, Any]) -> None:
    """Find the value of a key that gives a wanted output.

    [design] of SCENARIO (TOML) names the key, its range, and the output.
    """
    from historysim.results.tables import write_sweep
    from historysim.scenario.scenario import load
    from historysim.studies import design as verb

    loaded = load(scenario, values)
    problem, grid = verb.read_problem(loaded)
    written = check_outputs(loaded.files, (output, *_tables_over(grid.axes, problem.key)))
    table = verb.design(
        loaded, workers=workers, progress=not options.has_flag("quiet"), notify=notice
    )
    write_answer(
        [*verb.summary(table), *(("result", str(path)) for path in written)], data=lambda: table
    )
    for path in written:
        write_sweep(table, path)


def _tables_over(axes: "Iterable[Axis]", *further_keys: str) -> tuple[OutputFormat, ...]:
    """Return the formats of a table with a row for each point of some axes, and columns of further keys."""
    from historysim.scenario.grid import variable_name

    keys = [
        variable_name(key) for key in (*(key for axis in axes for key in axis.keys), *further_keys)
    ]
    return netcdf("a sweep", "sweep"), csv_table("a sweep over the same keys", *keys)


@click.command()
@options.common("scenario")
@options.output_option("The unit (.fmu). [default: SCENARIO's name with .fmu, here]")
@options.from_function("exchange.fmu.unit_file:write_fmu", "at", "normal", "tangential")
@click.option(
    "--saturate/--refuse",
    default=None,
    help="Hold a tangential load at the friction limit, or refuse the step. [default: as in SCENARIO]",
)
@options.from_function(
    "exchange.fmu.unit_file:write_fmu",
    "directions",
    "fmi",
    "platforms",
    platforms={"metavar": "NAME,NAME"},
)
@options.common("quiet", "json", "force", "set")
def fmu(
    scenario: Path,
    output: Path | None,
    platforms: str | None,
    values: dict[str, Any],
    **choices: Any,
) -> None:
    """Write the contact of a scenario as a unit for co-simulation (FMU).

    SCENARIO (TOML) may also be a log or a result.
    """
    output = output or Path(f"{scenario.stem}.fmu")
    from historysim.scenario.run import open_source

    source = open_source(scenario, values)
    from historysim.exchange.fmu.unit_file import write_fmu

    choices |= {
        "platforms": platforms and [name.strip() for name in platforms.split(",")],
        "notify": notice,
    }
    choices |= {"force": options.has_flag("force"), "progress": not options.has_flag("quiet")}
    write_fmu(source, output, **choices)
    write_answer(files=[output])


@click.command()
@options.common("scenario")
@options.from_function(
    "exchange.reduced.reducing:reduce", "elements", "normal_load", elements={"short": ["-e"]}
)
@options.outputs_option("The model: .json or .nc.")
@options.common("size", "json", "force", "set")
def reduce(
    scenario: Path,
    outputs: tuple[Path, ...],
    size: tuple[float, float] | None,
    values: dict[str, Any],
    **choices: Any,
) -> None:
    """Reduce the contact of a scenario to a few sliding springs.

    SCENARIO (TOML) may also be a log or a result. The answer bounds the error of the tangential
    load.
    """
    from historysim.scenario.run import open_source

    source = open_source(scenario, values)
    from historysim.exchange.reduced.reduced_model import MODEL_FORMATS, ReducedPicture
    from historysim.exchange.reduced.reducing import reduce as reduce_contact

    options.check_size(size, outputs)
    check_outputs(source.files, *((path, *MODEL_FORMATS, PICTURE) for path in outputs))
    model = reduce_contact(source, notify=notice, **choices)

    def write(path: Path) -> None:
        if path.suffix.lower() in PICTURE.endings:
            save(ReducedPicture().figure(model, {"size": size}), path)
        else:
            model.write(path, force=options.has_flag("force"))

    to_write = [(path, functools.partial(write, path)) for path in outputs]
    write_answer(model.summary(), data=model.dataset, outputs=to_write)
