"""Commands that read records of an instrument: columns, loops, sliding, compare, creep, fit."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.files import replacing
from historysim.basics.targets import FITTED, PICTURE, SUGGESTED, Output, check_outputs
from historysim.cli import options
from historysim.cli.output import (
    TABLES_OF_LEVELS,
    TABLES_OF_LOOPS,
    TABLES_OF_SLIDING,
    Answer,
    notice,
    save,
    save_table,
    write_answer,
)
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeGuard

    from historysim.measured.loops import Loops
    from historysim.results.plots.canvas import Place
    from historysim.scenario.fit import Fit
    from historysim.scenario.record_search import Run
    from historysim.scenario.scenario import Scenario
    from historysim.tables import Format

    Rows = Sequence[tuple[str, ...]]


FEWEST_OF_A_MAP = 16  # columns of numbers without names that may be heights


@click.command()
@options.file_argument
@options.output_option("Also write a whole scenario to start from to this file (.toml).")
@options.json_option
@options.text_options
def columns(file: Path, output: Path | None, as_json: bool, layout: "Format") -> None:
    """Show the columns of FILE (numbers) and a [loading] to start from.

    Its blocks, its columns as a scenario names them, and a [loading] section.

    "?" marks what names and units do not show.
    """
    if output is not None:
        check_outputs([Output(output, (SUGGESTED,))], [file])
    from historysim.scenario.suggestion import suggested_loading, suggested_scenario
    from historysim.tables import describe, what_is_seen

    if file.suffix == ".toml":
        raise InputError(f"{file}: is a scenario; expected a file of numbers: historysim show {file} reads scenarios")
    try:
        seen, blocks = what_is_seen(file, layout)
        listings = describe(file, layout)
    except InputError as error:
        raise InputError(f"{error}; a height map is read by historysim show {file}") from error
    if len(listings) >= FEWEST_OF_A_MAP and all(each.column.startswith("{") for each in listings):
        notice(f"{len(listings)} columns without names; if this is a height map: historysim show {file}")
    if output is not None:
        with replacing(output) as unfinished:
            unfinished.write_text(suggested_scenario(file, output, listings, layout, blocks), encoding="utf-8")
    rows = [("column", "unit", "values", "first"), *((c.column, c.unit, c.values, c.first) for c in listings)]
    suggested, files = suggested_loading(file, listings, layout, blocks), [] if output is None else [output]
    if as_json:
        write_answer(Answer([*(("note", line) for line in seen), ("scenario", suggested)], [rows], files), as_json=True)
        return
    click.echo("\n".join(seen), nl=bool(seen))
    write_answer(Answer(tables=[rows]))
    click.echo("\n".join(["", suggested, *(f"\n{path}" for path in files)]))


@click.command()
@options.file_argument
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option(
    "--dead-band",
    type=options.QuantityType("m"),
    help=(
        'Swings below which there is no reversal, as "5 nm". '
        "[default: the scenario's; else 5 % of the range, or six deviations of the noise]"
    ),
)
@click.option("--skip-per-level", default=0, help="Loops to leave out at the start of each series at one normal load.")
@click.option(
    "--load-share",
    type=float,
    help="Leave out branches on which the normal load moves by more than this share of its greatest value. "
    "[default: 0.1]",
)
@click.option(
    "--amplitude-share",
    type=float,
    help="Means are of the loops of this share of the largest amplitude or more. [default: 0.5]",
)
@options.output_option("Also write all loops to this file (.nc, .csv), or draw them there.")
@options.path_option("--levels", help="Also write the table over the normal load (.nc, .csv), or draw it there.")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the loops: FILE's name with _loops.png, here.")
@options.path_option("--picture", help="Also draw the loops to this file (PNG, PDF, SVG).")
@options.size_option
@click.option("--model", "with_model", is_flag=True, help="Also draw the loops of the scenario's model, dashed.")
@options.json_option
@options.force_option
@options.set_option
def loops(
    file: Path,
    dead_band: float | None,
    load_share: float | None,
    amplitude_share: float | None,
    output: Path | None,
    levels: Path | None,
    with_picture: bool,
    picture: Path | None,
    size: tuple[float, float] | None,
    with_model: bool,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
    **skipped: int,
) -> None:
    """Evaluate the friction loops of FILE.

    FILE is a result, or a scenario with a measured record. At several normal loads a table has a row for each load.
    """
    pictures = [path for path in (Path(f"{file.stem}_loops.png") if with_picture else None, picture) if path]
    options.check_drawn(size, [*pictures, output, levels])
    outputs = [
        *([Output(output, (*TABLES_OF_LOOPS, PICTURE))] if output else []),
        *([Output(levels, (*TABLES_OF_LEVELS, PICTURE))] if levels else []),
        *(Output(path, (PICTURE,)) for path in pictures),
    ]
    import attrs

    from historysim.measured.branches import DEFAULT
    from historysim.results.plots.found_loops import LoopLevelsPicture, MeasuredLoopsPicture
    from historysim.scenario.record_search import loop_rows
    from historysim.scenario.record_search import loops as find_loops

    shares = {"load_share": load_share, "amplitude_share": amplitude_share}
    definitions = attrs.evolve(DEFAULT, **{name: share for name, share in shares.items() if share is not None})
    record, measured = _record(file, values, outputs, force=force)

    def find(what: "Scenario | Path") -> "Loops":
        return find_loops(what, dead_band=dead_band, definitions=definitions, **skipped)

    if _is_each(record):
        _check_no_output(outputs)
        _write_runs(record, find, loop_rows, as_json=as_json)
        return
    evaluation = find(record)
    model = _model_loops(record, skipped["skip"]) if with_model else None
    drawn = MeasuredLoopsPicture(model=model, title=file.name)
    by_load = evaluation.by_load()
    if levels is not None and not len(by_load):
        raise InputError(f"{file}: the normal load was not measured; expected it for {levels}")
    place: Place = {"size": size}
    if output is not None:
        save_table(evaluation.to_dataset(), output, lambda _: drawn.figure(evaluation, place), measured=measured)
    if levels is not None:
        by_level = LoopLevelsPicture(title=file.name)
        save_table(by_load.to_dataset(), levels, lambda table: by_level.figure(table, place), measured=measured)
    for path in pictures:
        save(drawn.figure(evaluation, place), path)
    tables, below = _loop_tables(evaluation)
    files = [target.path for target in outputs]
    write_answer(Answer(evaluation.summary(), tables, files, evaluation.to_dataset, below), as_json=as_json)


def _loop_tables(evaluation: "Loops") -> "tuple[list[Rows], list[tuple[str, str]]]":
    """Return the tables over normal load and amplitude, and the lines that stand below them."""
    by_load = evaluation.by_load()
    several_loads = len(by_load) > 1
    tables: list[Rows] = [by_load.rows()]
    below = []
    if not several_loads:
        tables = [evaluation.rows()]
    else:
        below = [(label, both) for label, *_, both in evaluation.rows() if label.startswith(("largest", "loops"))]
    if not evaluation.large.all():
        (heading, *directions), *rows = evaluation.by_amplitude().rows()
        tables.insert(several_loads, [(f"{heading}, all loads" if several_loads else heading, *directions), *rows])
    return tables, below


@click.command()
@options.file_argument
@click.option("--over", type=click.Choice(["time", "distance"]), help="[default: distance, where it is known]")
@click.option("--windows", default=50, show_default=True, help="Windows of equal length that friction is averaged in.")
@options.output_option("Also write the windows to this file (.nc, .csv), or draw them there.")
@options.size_option
@options.json_option
@options.force_option
@options.set_option
def sliding(
    file: Path,
    output: Path | None,
    size: tuple[float, float] | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
    **choices: Any,
) -> None:
    """Evaluate friction in a unidirectional sliding record.

    Static peak, running-in and steady value. FILE is a result, or a scenario with a measured record.
    """
    from historysim.results.plots.record_pictures import SlidingPicture
    from historysim.scenario.record_search import sliding as find_sliding
    from historysim.scenario.record_search import sliding_rows

    options.check_drawn(size, [output])
    outputs = [] if output is None else [Output(output, (*TABLES_OF_SLIDING, PICTURE))]
    record, measured = _record(file, values, outputs, force=force)
    if _is_each(record):
        _check_no_output(outputs)
        _write_runs(record, lambda run: find_sliding(run, **choices), sliding_rows, as_json=as_json)
        return
    found = find_sliding(record, **choices)
    if output is not None:
        picture = SlidingPicture(title=file.name)
        save_table(found.to_dataset(), output, lambda _: picture.figure(found, {"size": size}), measured=measured)
    files = [target.path for target in outputs]
    write_answer(Answer(found.summary(), files=files, data=found.to_dataset), as_json=as_json)


@click.command()
@options.scenario_argument
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@options.output_option("The picture. [default: SCENARIO's name with _comparison.png]")
@options.size_option
@options.json_option
@options.force_option
@options.set_option
def compare(
    scenario: Path,
    skip: int,
    output: Path | None,
    size: tuple[float, float] | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Compare the model of SCENARIO with its measured record.

    Time series, loops, and energy per loop.
    """
    output = output or Path(f"{scenario.stem}_comparison.png")
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import compare as compare_scenario
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)
    check_outputs([Output(output, (PICTURE,))], loaded.files, force=force)
    comparison = compare_scenario(loaded, skip=skip)
    save(ComparisonPicture(title=loaded.title).figure(comparison, {"size": size}), output)
    write_answer(Answer(comparison.summary(), [comparison.rows()], [output]), as_json=as_json)


@click.command()
@options.scenario_argument
@options.output_option("The picture. [default: SCENARIO's name with _creep.png]")
@options.json_option
@options.force_option
@options.set_option
def creep(scenario: Path, output: Path | None, as_json: bool, force: bool, values: dict[str, Any]) -> None:
    """Separate creep from memory in the holds of SCENARIO's record.

    Relaxation over log time, drift of the sensor, and the parts of the change in each hold.
    """
    output = output or Path(f"{scenario.stem}_creep.png")
    from historysim.results.plots.record_pictures import CreepPicture
    from historysim.scenario.fit import creep as found
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)
    check_outputs([Output(output, (PICTURE,))], loaded.files, force=force)
    shown = found(loaded)
    save(CreepPicture(title=loaded.title).figure(shown), output)
    write_answer(Answer(shown.summary(), [shown.rows()], [output]), as_json=as_json)


@click.command()
@options.scenario_argument
@options.output_option("The fitted scenario. [default: SCENARIO's name with _fitted.toml]")
@options.path_option("--picture", help="The picture (PNG, PDF, SVG). [default: the fitted scenario's with .png]")
@options.size_option
@options.quiet_option
@options.json_option
@options.force_option
@options.set_option
def fit(
    scenario: Path,
    output: Path | None,
    picture: Path | None,
    size: tuple[float, float] | None,
    quiet: bool,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Fit parameters of SCENARIO to its measured record.

    [fit] names the parameters. Writes the fitted scenario and a picture.
    """
    output = output or Path(f"{scenario.stem}_fitted.toml")
    picture = picture or output.with_suffix(".png")
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import fit as fit_scenario
    from historysim.scenario.record_search import fit_rows
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)

    def check(output: Path, picture: Path) -> None:
        check_outputs([Output(output, (FITTED,)), Output(picture, (PICTURE,))], loaded.files, force=force)

    def write(fitted: "Fit", output: Path, picture: Path) -> list[Path]:
        # both stand under their names, or neither
        with replacing(output) as unfinished:
            unfinished.write_text(fitted.scenario_text(output), encoding="utf-8")
            save(ComparisonPicture(title=loaded.title).figure(fitted.comparison, {"size": size}), picture)
        return [picture, output]

    def of_run(number: int) -> list[Path]:
        return [path.with_stem(f"{path.stem}_{number}") for path in (output, picture)]

    check(output, picture)
    if _is_each(loaded):

        def written(runs: "list[Run[Fit]]") -> list[Path]:
            for run in runs:
                check(*of_run(run.number))
            return [path for run in runs if run.result is not None for path in write(run.result, *of_run(run.number))]

        find = functools.partial(fit_scenario, progress=not quiet)
        _write_runs(loaded, find, fit_rows, written, as_json=as_json, quiet=quiet)
        return
    fitted = fit_scenario(loaded, progress=not quiet)
    files = write(fitted, output, picture)
    if not quiet:
        write_answer(Answer(fitted.summary(), [fitted.comparison.rows()], files), as_json=as_json)


def _record(
    file: Path, values: dict[str, Any], outputs: list[Output], *, force: bool
) -> "tuple[Scenario | Path, bool]":
    """Return a scenario with a measured record, or a file, and whether it is the former; checks the outputs."""
    from historysim.scenario.scenario import load

    measured = file.suffix == ".toml"
    record = load(file, values) if measured else options.scenario_or_file(file, values)
    check_outputs(outputs, options.files_read(record), force=force)
    return record, measured


def _is_each(record: "Scenario | Path") -> "TypeGuard[Scenario]":
    """Return whether each run of a scenario's file is asked for."""
    return not isinstance(record, Path) and record.run == "each"


def _check_no_output(outputs: list[Output]) -> None:
    if outputs:
        raise InputError(f"{outputs[0].path}: can be written for one run; expected its number, as --set loading.run=1")


def _write_runs(
    scenario: "Scenario",
    find: "Callable[[Scenario], Any]",
    rows: "Callable[[list[Run[Any]]], Rows]",
    write: "Callable[[list[Run[Any]]], Sequence[Path]]" = lambda _: (),
    *,
    as_json: bool,
    quiet: bool = False,
) -> None:
    """Print a table with a row for each run of a scenario's file, and why others cannot be used."""
    from historysim.scenario.record_search import each_run

    runs = each_run(scenario, find)
    files = write(runs)
    problems = [(f"run {run.number}", run.problem) for run in runs if run.problem]
    if not quiet:
        write_answer(Answer(tables=[rows(runs)], files=files, below=problems), as_json=as_json)


def _model_loops(record: "Scenario | Path", skip: int) -> "Loops | None":
    """Return the loops of the model along what was measured."""
    from historysim.scenario.fit import compare as compare_scenario

    if isinstance(record, Path):
        raise InputError(f"{record}: is no scenario (.toml) with a measured record; expected one for --model")
    return compare_scenario(record, skip=skip).model
