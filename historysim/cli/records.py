"""Commands that read records of an instrument: columns, loops, sliding, compare, creep, fit."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.files import replacing
from historysim.basics.targets import FITTED, PICTURE, SUGGESTED
from historysim.basics.wording import shell_word
from historysim.cli import options
from historysim.cli.output import (
    TABLES_OF_FRETTING,
    TABLES_OF_LEVELS,
    TABLES_OF_LOOPS,
    TABLES_OF_SLIDING,
    check_outputs,
    notice,
    save,
    save_table,
    write_answer,
)
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from historysim.measured.fretting import Fretting
    from historysim.measured.loops import Loops
    from historysim.scenario.fit import Fit
    from historysim.scenario.record_search import Run
    from historysim.scenario.scenario import Scenario

    Rows = Sequence[tuple[str, ...]]
    Size = tuple[float, float] | None

FEWEST_OF_A_MAP = 16  # columns of numbers without names that may be heights

skip_option = click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")


@click.command()
@options.shared("file")
@options.output_option("Also write a whole scenario to start from to this file (.toml).")
@options.shared("json", *options.TEXT)
def columns(file: Path, output: Path | None, **text: Any) -> None:
    """Show the columns of FILE (numbers) and a [loading] to start from.

    Its blocks, its columns as a scenario names them, and a [loading] section.

    "?" marks what names and units do not show.
    """
    layout, files = options.layout_of(**text), check_outputs([file], (output, SUGGESTED))
    from historysim.scenario.suggestion import suggest_loading, suggest_scenario
    from historysim.tables import describe, summarise_text

    if file.suffix == ".toml":
        raise InputError(
            f"{file}: is a scenario; expected a file of numbers: historysim show {shell_word(file)} reads scenarios"
        )
    try:
        seen, blocks = summarise_text(file, layout)
        listings = describe(file, layout)
    except InputError as error:
        raise InputError(f"{error}; a height map is read by historysim show {shell_word(file)}") from error
    if len(listings) >= FEWEST_OF_A_MAP and all(each.column.startswith("{") for each in listings):
        notice(f"{len(listings)} columns without names; if this is a height map: historysim show {shell_word(file)}")
    if output is not None:
        with replacing(output) as unfinished:
            unfinished.write_text(suggest_scenario(file, output, listings, layout, blocks), encoding="utf-8")
    rows = [("column", "unit", "values", "first"), *((c.column, c.unit, c.values, c.first_value) for c in listings)]
    suggested = suggest_loading(file, listings, layout, blocks)
    if options.given("json"):
        write_answer([*(("note", line) for line in seen), ("scenario", suggested)], [rows], files)
        return
    click.echo("\n".join(seen), nl=bool(seen))
    write_answer(tables=[rows])
    click.echo("\n".join(["", suggested, *(f"\n{path}" for path in files)]))


@click.command()
@options.shared("file")
@skip_option
@options.quantity_option(
    "--dead-band",
    "m",
    help='Swings below which there is no reversal, as "5 nm". '
    "[default: the scenario's; else 5 % of the range, or six deviations of the noise]",
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
@click.option(
    "--plateau",
    nargs=2,
    type=float,
    metavar="START END",
    help="Sliding friction is the mean over this part of a stroke, from 0 to 1. [default: 0.75 1]",
)
@click.option(
    "--fretting",
    "with_fretting",
    is_flag=True,
    help="Report slip amplitude, energy friction, regime and compliances instead, over runs, too.",
)
@options.output_option("Also write all loops to this file (.nc, .csv), or draw them there.")
@options.path_option("--levels", help="Also write the table over the normal load (.nc, .csv), or draw it there.")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the loops: FILE's name with _loops.png, here.")
@options.path_option("--picture", help="Also draw the loops to this file (PNG, PDF, SVG).")
@options.shared("size")
@click.option("--model", "with_model", is_flag=True, help="Also draw the loops of the scenario's model, dashed.")
@options.shared("json", "force", "set")
def loops(
    file: Path,
    dead_band: float | None,
    load_share: float | None,
    amplitude_share: float | None,
    plateau: tuple[float, float] | None,
    with_fretting: bool,
    output: Path | None,
    levels: Path | None,
    with_picture: bool,
    picture: Path | None,
    size: "Size",
    with_model: bool,
    values: dict[str, Any],
    **skipped: int,
) -> None:
    """Evaluate the friction loops of FILE.

    FILE is a result, or a scenario with a measured record. At several normal loads a table has a row for each load.
    """
    beside = Path(f"{file.stem}_loops.png") if with_picture else None
    options.check_drawn(size, [beside, picture, output, levels])
    import attrs

    from historysim.measured.branches import DEFAULT
    from historysim.results.plots.found_loops import LoopLevelsPicture, MeasuredLoopsPicture
    from historysim.scenario.record_search import loop_rows
    from historysim.scenario.record_search import loops as find_loops

    shares = {"load_share": load_share, "amplitude_share": amplitude_share}
    shares |= {} if plateau is None else {"sliding_part": 1 - plateau[0], "sliding_end": plateau[1]}
    definitions = attrs.evolve(DEFAULT, **{name: share for name, share in shares.items() if share is not None})
    record = _record(file, values)
    files = check_outputs(
        options.files_read(record),
        (output, *(TABLES_OF_FRETTING if with_fretting else TABLES_OF_LOOPS), PICTURE),
        (levels, *TABLES_OF_LEVELS, PICTURE),
        (beside, PICTURE),
        (picture, PICTURE),
    )

    def find(what: "Scenario | Path") -> "Loops":
        return find_loops(what, dead_band=dead_band, definitions=definitions, **skipped)

    if with_fretting:
        _report_fretting(record, find, output, size, {levels, beside, picture, "--model" if with_model else None})
        return
    if _write_each(record, find, loop_rows, files):
        return
    evaluation = find(record)
    model = _model_loops(record, skipped["skip"]) if with_model else None
    title = _title(record)
    drawn = MeasuredLoopsPicture(model=model, title=title)
    by_load, measured = evaluation.by_load(), file.suffix == ".toml"
    if levels is not None and not len(by_load):
        raise InputError(f"{file}: the normal load was not measured; expected it for {levels}")
    if output is not None:
        all_loops = evaluation.to_dataset()
        save_table(all_loops, output, lambda _: drawn.figure(evaluation, {"size": size}), measured=measured)
    if levels is not None:
        by_level = LoopLevelsPicture(title=title)
        table = by_load.to_dataset()
        save_table(table, levels, lambda _: by_level.figure(table, {"size": size}), measured=measured)
    for path in (beside, picture):
        if path is not None:
            save(drawn.figure(evaluation, {"size": size}), path)
    tables, below = _loop_tables(evaluation)
    write_answer(evaluation.summary(), tables, files, data=evaluation.to_dataset, below=below)


def _report_fretting(
    record: "Scenario | Path",
    find: "Callable[[Scenario | Path], Loops]",
    output: Path | None,
    size: "Size",
    others: "set[Path | str | None]",
) -> None:
    """Print the fretting report of the loops of a record, or of each of its runs, and write it to a file."""
    from historysim.measured.fretting import by_load
    from historysim.results.plots.found_loops import FrettingPicture
    from historysim.scenario.record_search import fretting_of_runs, fretting_rows

    if given := sorted(str(each) for each in others if each is not None):
        raise InputError(f"{given[0]}: does not apply to --fretting; expected -o FILE for its table or picture")
    drawn, measured = FrettingPicture(title=_title(record)), not isinstance(record, Path)

    def write(report: "Fretting") -> list[Path]:
        if output is None:
            return []
        save_table(report.to_dataset(), output, lambda data: drawn.figure(data, {"size": size}), measured=measured)
        return [output]

    if _write_each(record, find, fretting_rows, write=lambda runs: write(fretting_of_runs(runs))):
        return
    evaluation = find(record)
    report, levels = evaluation.fretting, by_load(evaluation)
    tables: list[Rows] = [report.rows(), *([levels.rows()] if len(levels) > 1 else [])]
    write_answer(evaluation.summary(), tables, write(report), data=report.to_dataset)


def _loop_tables(evaluation: "Loops") -> "tuple[list[Rows], list[tuple[str, str]]]":
    """Return the tables over normal load and amplitude, and the lines that stand below them."""
    by_load, means = evaluation.by_load(), evaluation.rows()
    several_loads = len(by_load) > 1
    tables: list[Rows] = [by_load.rows() if several_loads else means]
    below = [(label, both) for label, *_, both in means if label.startswith(("largest", "loops"))]
    if not evaluation.large.all():
        (heading, *directions), *rows = evaluation.by_amplitude().rows()
        tables.insert(several_loads, [(f"{heading}, all loads" if several_loads else heading, *directions), *rows])
    return tables, below if several_loads else []


@click.command()
@options.shared("file")
@click.option("--over", type=click.Choice(["time", "distance"]), help="[default: distance, where it is known]")
@click.option("--windows", default=50, show_default=True, help="Windows of equal length that friction is averaged in.")
@options.output_option("Also write the windows to this file (.nc, .csv), or draw them there.")
@options.shared("size", "json", "force", "set")
def sliding(file: Path, output: Path | None, size: "Size", values: dict[str, Any], **choices: Any) -> None:
    """Evaluate friction in a unidirectional sliding record.

    Static peak, running-in and steady value. FILE is a result, or a scenario with a measured record.
    """
    from historysim.results.plots.record_pictures import SlidingPicture
    from historysim.scenario.record_search import sliding as find_sliding
    from historysim.scenario.record_search import sliding_rows

    options.check_drawn(size, [output])
    record = _record(file, values)
    files = check_outputs(options.files_read(record), (output, *TABLES_OF_SLIDING, PICTURE))

    def find(what: "Scenario | Path") -> Any:
        return find_sliding(what, **choices)

    if _write_each(record, find, sliding_rows, files):
        return
    found = find(record)
    if output is not None:
        picture = SlidingPicture(title=_title(record))
        measured = file.suffix == ".toml"
        save_table(found.to_dataset(), output, lambda _: picture.figure(found, {"size": size}), measured=measured)
    write_answer(found.summary(), files=files, data=found.to_dataset)


@click.command()
@options.shared("scenario")
@skip_option
@options.output_option("The picture. [default: SCENARIO's name with _comparison.png]")
@options.shared("size", "json", "force", "set")
def compare(scenario: Path, skip: int, output: Path | None, size: "Size", values: dict[str, Any]) -> None:
    """Compare the model of SCENARIO with its measured record.

    Time series, loops, and energy per loop.
    """
    output = output or Path(f"{scenario.stem}_comparison.png")
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import compare as compare_scenario
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)
    files = check_outputs(loaded.files, (output, PICTURE))
    comparison = compare_scenario(loaded, skip=skip)
    save(ComparisonPicture(title=loaded.title).figure(comparison, {"size": size}), output)
    write_answer(comparison.summary(), [comparison.rows()], files)


@click.command()
@options.shared("scenario")
@options.output_option("The picture. [default: SCENARIO's name with _creep.png]")
@options.shared("json", "force", "set")
def creep(scenario: Path, output: Path | None, values: dict[str, Any]) -> None:
    """Separate creep from memory in the holds of SCENARIO's record.

    Relaxation over log time, drift of the sensor, and the parts of the change in each hold.
    """
    output = output or Path(f"{scenario.stem}_creep.png")
    from historysim.results.plots.record_pictures import CreepPicture
    from historysim.scenario.fit import creep as found
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)
    files = check_outputs(loaded.files, (output, PICTURE))
    shown = found(loaded)
    save(CreepPicture(title=loaded.title).figure(shown), output)
    write_answer(shown.summary(), [shown.rows()], files)


@click.command()
@options.shared("scenario")
@options.output_option("The fitted scenario. [default: SCENARIO's name with _fitted.toml]")
@options.path_option("--picture", help="The picture (PNG, PDF, SVG). [default: the fitted scenario's with .png]")
@options.shared("size", "quiet", "json", "force", "set")
def fit(scenario: Path, output: Path | None, picture: Path | None, size: "Size", values: dict[str, Any]) -> None:
    """Fit parameters of SCENARIO to its measured record.

    [fit] names the parameters. Writes the fitted scenario and a picture.
    """
    output = output or Path(f"{scenario.stem}_fitted.toml")
    names = output, picture or output.with_suffix(".png")
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import fit as fit_scenario
    from historysim.scenario.record_search import fit_rows
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)

    def checked(output: Path, picture: Path) -> list[Path]:
        return check_outputs(loaded.files, (output, FITTED), (picture, PICTURE))

    def write(fitted: "Fit", output: Path, picture: Path) -> list[Path]:
        # both stand under their names, or neither
        with replacing(output) as unfinished:
            unfinished.write_text(fitted.scenario_text(output), encoding="utf-8")
            save(ComparisonPicture(title=loaded.title).figure(fitted.comparison, {"size": size}), picture)
        return [picture, output]

    def write_each(runs: "list[Run[Fit]]") -> list[Path]:
        each = [(run.result, [path.with_stem(f"{path.stem}_{run.number}") for path in names]) for run in runs]
        for _, paths in each:
            checked(*paths)
        return [path for fitted, paths in each if fitted is not None for path in write(fitted, *paths)]

    checked(*names)
    find = functools.partial(fit_scenario, progress=not options.given("quiet"))
    if not _write_each(loaded, find, fit_rows, write=write_each):
        fitted = find(loaded)
        files = write(fitted, *names)
        write_answer(fitted.summary(), [fitted.comparison.rows()], files)


def _record(file: Path, values: dict[str, Any]) -> "Scenario | Path":
    """Return a scenario with a measured record, or another file."""
    from historysim.scenario.scenario import load

    return load(file, values) if file.suffix == ".toml" else options.scenario_or_file(file, values)


def _title(record: "Scenario | Path") -> str:
    """Return the title of a scenario, or else the name of the file."""
    return record.name if isinstance(record, Path) else record.title or record.path.name


def _write_each(
    record: "Scenario | Path",
    find: "Callable[[Scenario], Any]",
    rows: "Callable[[list[Run[Any]]], Rows]",
    files: "Sequence[Path]" = (),
    write: "Callable[[list[Run[Any]]], Sequence[Path]]" = lambda _: (),
) -> bool:
    """Print a row for each run of a scenario's file, or why it cannot be used; return whether each is asked for."""
    if isinstance(record, Path) or record.run != "each":
        return False
    if files:
        raise InputError(f"{files[0]}: can be written for one run; expected its number, as --set loading.run=1")
    from historysim.scenario.record_search import each_run

    runs = each_run(record, find)
    problems = [(f"run {run.number}", run.problem) for run in runs if run.problem]
    write_answer(tables=[rows(runs)], files=write(runs), below=problems)
    return True


def _model_loops(record: "Scenario | Path", skip: int) -> "Loops | None":
    """Return the loops of the model along what was measured."""
    from historysim.scenario.fit import compare as compare_scenario

    if isinstance(record, Path):
        raise InputError(f"{record}: is no scenario (.toml) with a measured record; expected one for --model")
    return compare_scenario(record, skip=skip).model
