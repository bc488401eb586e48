"""Commands for measured records: columns, loops, sliding, compare, creep, fit."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.files import replacing
from historysim.basics.targets import FITTED, PICTURE, SUGGESTED
from historysim.basics.wording import TERMINAL, count_text, shell_word
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
    split_outputs,
    write_answer,
    write_outputs,
)
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import xarray as xr

    from historysim.cli.output import Outputs
    from historysim.measured.comparison import Comparison
    from historysim.measured.creep import Creep
    from historysim.measured.fretting import Fretting
    from historysim.measured.loops import Loops
    from historysim.scenario.fit import Fit
    from historysim.scenario.runs import Runs
    from historysim.scenario.scenario import Scenario

    Rows = Sequence[tuple[str, ...]]
    Size = tuple[float, float] | None

FEWEST_OF_A_MAP = 16  # least number of unnamed columns that suggests a height map

skip_option = click.option(
    "--skip", default=0, show_default=True, help="Loops at the start to leave out."
)


@click.command()
@click.argument("sources", metavar="FILE", type=options.path_type, nargs=-1, required=True)
@options.output_option("Also write a suggested scenario to this file (.toml).")
@options.common("json", *options.TEXT_FORMAT)
def columns(sources: tuple[Path, ...], output: Path | None, **layout_options: Any) -> None:
    """Show the columns of FILE (numbers) and suggest a [loading].

    Lists its blocks, its columns as in a scenario, and a [loading] section, in which "?" marks
    unknown values. Of a folder, a pattern or several files, each a run, the columns of the first
    one.
    """
    from historysim.tables.readers import list_files

    paths = [path for source in sources for path in list_files(source)]
    file, runs = paths[0], [] if paths == [*sources[:1]] else sources
    layout, files = options.text_format(**layout_options), check_outputs(paths, (output, SUGGESTED))
    from historysim.tables import describe, summarise_text
    from historysim.tables.suggestion import suggest_loading, suggest_scenario

    if file.suffix == ".toml":
        raise InputError(
            f"{file}: is a scenario; expected a file of numbers: historysim show {shell_word(file)} reads scenarios"
        )
    try:
        notes, blocks = summarise_text(file, layout)
        if runs:
            notes = [
                f"{count_text(len(paths), 'file', 'files')}, each a run; columns of {file.name}",
                *notes,
            ]
        listings = describe(file, layout)
    except InputError as error:
        raise InputError(
            f"{error}; a height map is read by historysim show {shell_word(file)}"
        ) from error
    if len(listings) >= FEWEST_OF_A_MAP and all(
        listing.column.startswith("{") for listing in listings
    ):
        notice(
            f"{len(listings)} columns without names; if this is a height map: historysim show {shell_word(file)}"
        )

    def write(output: Path) -> None:
        with replacing(output) as unfinished:
            text = suggest_scenario(file, output, listings, layout, blocks, files=runs)
            unfinished.write_text(text, encoding="utf-8")

    outputs = [(path, functools.partial(write, path)) for path in files]
    rows = [
        ("column", "unit", "values", "first"),
        *((c.column, c.unit, c.values, c.first_value) for c in listings),
    ]
    suggested = suggest_loading(file, listings, layout, blocks, files=runs)
    if options.has_flag("json"):
        write_answer(
            [*(("note", line) for line in notes), ("scenario", suggested)], [rows], outputs=outputs
        )
        return
    click.echo("\n".join(notes), nl=bool(notes))
    write_answer(tables=[rows])
    click.echo("\n".join(["", suggested, *([""] if outputs else [])]))
    write_outputs(outputs, named=True)


@click.command()
@options.common("file")
@options.from_function("studies.record_search:loops", "skip", "dead_band", "skip_per_level")
@click.option(
    "--load-share",
    type=float,
    help="Leave out branches on which the normal load varies by more than this fraction of its largest value. "
    "[default: 0.1]",
)
@click.option(
    "--amplitude-share",
    type=float,
    help="Least amplitude of loops in means, over the largest one. [default: 0.5]",
)
@click.option(
    "--plateau",
    nargs=2,
    type=float,
    metavar="START END",
    help="Sliding friction is the mean over this part of a stroke, from 0 to 1. [default: 0.75 1]",
)
@options.flag(
    "--fretting",
    "with_fretting",
    help="Report slip amplitude, energy friction, regime and compliances instead, also over runs.",
)
@options.outputs_option("Also write all loops to this file (.nc, .csv).")
@options.path_option(
    "--levels", help="Also write the table over the normal load (.nc, .csv), or draw it there."
)
@options.common("size")
@options.flag("--model", "with_model", help="Also draw the loops of the scenario's model, dashed.")
@options.common("json", "force", "set")
def loops(
    file: Path,
    dead_band: float | None,
    load_share: float | None,
    amplitude_share: float | None,
    plateau: tuple[float, float] | None,
    with_fretting: bool,
    outputs: tuple[Path, ...],
    levels: Path | None,
    size: "Size",
    with_model: bool,
    values: dict[str, Any],
    **skipped: int,
) -> None:
    """Evaluate the friction loops of FILE.

    FILE is a result, or a scenario with a measured record. With several normal loads a table has a
    row for each.
    """
    options.check_size(size, [*outputs, levels])
    import attrs

    from historysim.measured.branches import DEFAULT
    from historysim.results.plots.loop_pictures import LoopLevelsPicture, MeasuredLoopsPicture
    from historysim.studies.record_search import loop_rows
    from historysim.studies.record_search import loops as find_loops

    shares = {"load_share": load_share, "amplitude_share": amplitude_share}
    shares |= {} if plateau is None else {"sliding_part": 1 - plateau[0], "sliding_end": plateau[1]}
    definitions = attrs.evolve(
        DEFAULT, **{name: share for name, share in shares.items() if share is not None}
    )
    record = _record(file, values)
    tables_of_loops = TABLES_OF_FRETTING if with_fretting else TABLES_OF_LOOPS
    files = check_outputs(
        options.list_inputs(record),
        *((path, *tables_of_loops, PICTURE) for path in outputs),
        (levels, *TABLES_OF_LEVELS, PICTURE),
    )

    def find(source: "Scenario | Path") -> "Loops":
        return find_loops(source, dead_band=dead_band, definitions=definitions, **skipped)

    if with_fretting:
        _report_fretting(record, find, outputs, size, {levels, "--model" if with_model else None})
        return
    if _write_each(record, find, loop_rows, files):
        return
    evaluation = find(record)
    model = _model_loops(record, skipped["skip"]) if with_model else None
    title = _title(record)
    loops_picture = MeasuredLoopsPicture(model=model, title=title)
    by_load, measured = evaluation.by_load(), file.suffix == ".toml"
    if levels is not None and not len(by_load):
        raise InputError(f"{file}: the normal load was not measured; expected it for {levels}")

    def write(path: Path) -> None:
        if path == levels:
            table, by_level = by_load.to_dataset(), LoopLevelsPicture(title=title)
            save_table(
                table, path, lambda _: by_level.figure(table, {"size": size}), measured=measured
            )
        else:
            save_table(
                evaluation.to_dataset(),
                path,
                lambda _: loops_picture.figure(evaluation, {"size": size}),
                measured=measured,
            )

    tables, below = _loop_tables(evaluation)
    writers = [(path, functools.partial(write, path)) for path in files]
    write_answer(
        evaluation.summary(), tables, data=evaluation.to_dataset, below=below, outputs=writers
    )


def _report_fretting(
    record: "Scenario | Path",
    find: "Callable[[Scenario | Path], Loops]",
    outputs: "Sequence[Path]",
    size: "Size",
    unsupported: "set[Path | str | None]",
) -> None:
    """Print the fretting report of the loops of a record, or of each of its runs, and write it to a file."""
    from historysim.measured.fretting import by_load
    from historysim.results.plots.loop_pictures import FrettingPicture
    from historysim.studies.record_search import fretting_of_runs, fretting_rows

    if requested := sorted(str(option) for option in unsupported if option is not None):
        raise InputError(
            f"{requested[0]}: does not apply to --fretting; expected -o FILE for its table or picture"
        )
    fretting_picture, measured = FrettingPicture(title=_title(record)), not isinstance(record, Path)

    def write(report: "Fretting") -> "Outputs":
        def picture(data: "xr.Dataset") -> Any:
            return fretting_picture.figure(data, {"size": size})

        table = report.to_dataset()
        return [
            (path, functools.partial(save_table, table, path, picture, measured=measured))
            for path in outputs
        ]

    if _write_each(
        record,
        find,
        fretting_rows,
        write=lambda runs: write(fretting_of_runs(runs)),
        width=TERMINAL,
    ):
        return
    evaluation = find(record)
    report, levels = evaluation.fretting, by_load(evaluation)
    tables: list[Rows] = [report.rows(), *([levels.rows()] if len(levels) > 1 else [])]
    write_answer(
        evaluation.summary(), tables, data=report.to_dataset, outputs=write(report), width=TERMINAL
    )


def _loop_tables(evaluation: "Loops") -> "tuple[list[Rows], list[tuple[str, str]]]":
    """Return the tables over normal load and amplitude, and the lines below them."""
    by_load, means = evaluation.by_load(), evaluation.rows()
    several_loads = len(by_load) > 1
    tables: list[Rows] = [by_load.rows() if several_loads else means]
    below = [(label, both) for label, *_, both in means if label.startswith(("largest", "loops"))]
    if not evaluation.large.all():
        (heading, *directions), *rows = evaluation.by_amplitude().rows()
        tables.insert(
            several_loads,
            [(f"{heading}, all loads" if several_loads else heading, *directions), *rows],
        )
    return tables, below if several_loads else []


@click.command()
@options.common("file")
@options.from_function("studies.record_search:sliding", "over", "windows")
@options.output_option("Also write the windows to this file (.nc, .csv), or draw them there.")
@options.common("size", "json", "force", "set")
def sliding(
    file: Path, output: Path | None, size: "Size", values: dict[str, Any], **choices: Any
) -> None:
    """Evaluate friction in a unidirectional sliding record.

    Static peak, running-in and steady value. FILE is a result, or a scenario with a measured
    record.
    """
    from historysim.results.plots.record_pictures import SlidingPicture
    from historysim.studies.record_search import sliding as find_sliding
    from historysim.studies.record_search import sliding_rows

    options.check_size(size, [output])
    record = _record(file, values)
    files = check_outputs(options.list_inputs(record), (output, *TABLES_OF_SLIDING, PICTURE))

    def find(source: "Scenario | Path") -> Any:
        return find_sliding(source, **choices)

    if _write_each(record, find, sliding_rows, files):
        return
    friction = find(record)
    picture, measured = SlidingPicture(title=_title(record)), file.suffix == ".toml"

    def write(path: Path) -> None:
        save_table(
            friction.to_dataset(),
            path,
            lambda _: picture.figure(friction, {"size": size}),
            measured=measured,
        )

    outputs = [(path, functools.partial(write, path)) for path in files]
    write_answer(friction.summary(), data=friction.to_dataset, outputs=outputs)


@click.command()
@options.common("scenario")
@skip_option
@options.output_option("The picture. [default: SCENARIO's name with _comparison.png]")
@options.common("size", "json", "force", "set")
def compare(
    scenario: Path, skip: int, output: Path | None, size: "Size", values: dict[str, Any]
) -> None:
    """Compare the model of SCENARIO with its measured record.

    Time series, loops, and energy per loop.
    """
    output = output or Path(f"{scenario.stem}_comparison.png")
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import compare as compare_scenario
    from historysim.scenario.scenario import load
    from historysim.studies.record_search import comparison_rows

    loaded, picture = load(scenario, values), output
    check_outputs(loaded.files, (output, PICTURE))

    def draw(comparison: "Comparison", path: Path) -> None:
        save(ComparisonPicture(title=loaded.title).figure(comparison, {"size": size}), path)

    def find(run: "Scenario") -> "Comparison":
        return compare_scenario(run, skip=skip)

    if not _write_each(
        loaded, find, comparison_rows, write=lambda runs: _draw_each(loaded, runs, picture, draw)
    ):
        comparison = find(loaded)
        outputs = [(picture, functools.partial(draw, comparison, picture))]
        write_answer(comparison.summary(), [comparison.rows()], outputs=outputs)


@click.command()
@options.common("scenario")
@options.output_option("The picture. [default: SCENARIO's name with _creep.png]")
@options.common("json", "force", "set")
def creep(scenario: Path, output: Path | None, values: dict[str, Any]) -> None:
    """Separate creep from memory in the holds of SCENARIO's record.

    Relaxation over log time, drift of the sensor, and contributions to the change in each hold.
    """
    output = output or Path(f"{scenario.stem}_creep.png")
    from historysim.results.plots.record_pictures import CreepPicture
    from historysim.scenario.fit import creep as separate_creep
    from historysim.scenario.scenario import load
    from historysim.studies.record_search import creep_rows

    loaded, picture = load(scenario, values), output
    check_outputs(loaded.files, (output, PICTURE))

    def draw(evaluation: "Creep", path: Path) -> None:
        save(CreepPicture(title=loaded.title).figure(evaluation), path)

    if not _write_each(
        loaded,
        separate_creep,
        creep_rows,
        write=lambda runs: _draw_each(loaded, runs, picture, draw),
    ):
        evaluation = separate_creep(loaded)
        outputs = [(picture, functools.partial(draw, evaluation, picture))]
        write_answer(evaluation.summary(), [evaluation.rows()], outputs=outputs)


@click.command()
@options.common("scenario")
@options.outputs_option(
    "The fitted scenario (.toml).", "SCENARIO's name with _fitted.toml and .png"
)
@options.common("size", "quiet", "json", "force", "set")
def fit(scenario: Path, outputs: tuple[Path, ...], size: "Size", values: dict[str, Any]) -> None:
    """Fit parameters of SCENARIO to its measured record.

    [fit] names the parameters. Writes the fitted scenario and a picture.
    """
    output, pictures = split_outputs(outputs, Path(f"{scenario.stem}_fitted.toml"))
    names = [output, *(pictures or [output.with_suffix(".png")])]
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import fit as fit_scenario
    from historysim.scenario.scenario import load
    from historysim.studies.record_search import fit_rows

    loaded = load(scenario, values)

    def check(output: Path, *pictures: Path) -> list[Path]:
        drawn = ((picture, PICTURE) for picture in pictures)
        return check_outputs(loaded.files, (output, FITTED), *drawn)

    def list_outputs(fitted: "Fit", output: Path, *pictures: Path) -> "Outputs":
        def draw(picture: Path) -> None:
            save(
                ComparisonPicture(title=loaded.title).figure(fitted.comparison, {"size": size}),
                picture,
            )

        # the scenario, which is small and holds the result, comes first
        drawings = [(picture, functools.partial(draw, picture)) for picture in pictures]
        return [(output, lambda: fitted.write(output)), *drawings]

    def write_each(runs: "Runs[Fit]") -> "Outputs":
        results = [
            (run.result, [path.with_stem(f"{path.stem}_{run.number}") for path in names])
            for run in runs
        ]
        for _, paths in results:
            check(*paths)
        return [
            each
            for fitted, paths in results
            if fitted is not None
            for each in list_outputs(fitted, *paths)
        ]

    check(*names)
    find = functools.partial(fit_scenario, progress=not options.has_flag("quiet"))
    if not _write_each(loaded, find, fit_rows, write=write_each):
        fitted = find(loaded)
        write_answer(
            fitted.summary(), [fitted.comparison.rows()], outputs=list_outputs(fitted, *names)
        )


def _record(file: Path, values: dict[str, Any]) -> "Scenario | Path":
    """Return a scenario with a measured record, or another file."""
    from historysim.scenario.scenario import load

    return load(file, values) if file.suffix == ".toml" else options.load_if_changed(file, values)


def _title(record: "Scenario | Path") -> str:
    """Return the title of a scenario, or the name of the file."""
    return record.name if isinstance(record, Path) else record.title or record.path.name


def _write_each(
    record: "Scenario | Path",
    find: "Callable[[Scenario], Any]",
    rows: "Callable[[Runs[Any]], Rows]",
    files: "Sequence[Path]" = (),
    write: "Callable[[Runs[Any]], Outputs]" = lambda _: (),
    width: int = 0,
) -> bool:
    """Print a row, or a problem, for each run of a scenario's file; return False unless all runs are requested."""
    if isinstance(record, Path) or record.run != "each":
        return False
    if files:
        raise InputError(
            f"{files[0]}: can only be written for one run; expected its number, as --set loading.run=1"
        )
    from historysim.scenario.runs import each_run

    runs = each_run(record, find)
    problems = [(f"run {run.number}", run.problem) for run in runs if run.problem]
    write_answer(tables=[rows(runs)], below=problems, outputs=write(runs), width=width)
    return True


def _draw_each(
    scenario: "Scenario", runs: "Runs[Any]", picture: Path, draw: "Callable[[Any, Path], None]"
) -> "Outputs":
    """Return the picture of each run, with the number of the run in its name."""
    paths = {number: picture.with_stem(f"{picture.stem}_{number}") for number in runs.results}
    check_outputs(scenario.files, *((path, PICTURE) for path in paths.values()))
    return [
        (path, functools.partial(draw, runs.results[number], path))
        for number, path in paths.items()
    ]


def _model_loops(record: "Scenario | Path", skip: int) -> "Loops | None":
    """Return the loops of the model for a measured record."""
    from historysim.scenario.fit import compare as compare_scenario

    if isinstance(record, Path):
        raise InputError(
            f"{record}: is not a scenario (.toml) with a measured record; expected one for --model"
        )
    return compare_scenario(record, skip=skip).model
