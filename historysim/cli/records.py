"""Commands that read records of an instrument: columns, loops, compare, fit."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.files import replacing
from historysim.basics.targets import FITTED, PICTURE, SUGGESTED, Output, check_outputs
from historysim.cli.options import (
    files_read,
    force_option,
    json_option,
    path_type,
    quantity_option,
    scenario_or_file,
    set_option,
    text_options,
)
from historysim.cli.output import (
    TABLES_OF_LEVELS,
    TABLES_OF_LOOPS,
    TABLES_OF_SLIDING,
    Answer,
    save,
    save_table,
    write_answer,
)
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeGuard

    from historysim.measured.loops import Loops
    from historysim.measured.sliding import Over
    from historysim.scenario.each_run import Run
    from historysim.scenario.fit import Fit
    from historysim.scenario.scenario import Scenario
    from historysim.tables import Format


@click.command()
@click.argument("file", type=path_type)
@click.option("-o", "--output", type=path_type, help="Also write a whole scenario to start from to this file (.toml).")
@json_option
@text_options
def columns(file: Path, output: Path | None, as_json: bool, layout: "Format") -> None:
    """Show what FILE, a file of numbers, holds.

    Its blocks, its columns as a scenario names them, and a [loading] section to start from.

    What the section cannot tell from names and units is marked "?".
    """
    if output is not None:
        check_outputs([Output(output, (SUGGESTED,))], [file])
    from historysim.scenario.suggestion import suggested_loading, suggested_scenario
    from historysim.tables import describe, what_is_seen

    seen, blocks = what_is_seen(file, layout)
    listings = describe(file, layout)
    if output is not None:
        with replacing(output) as unfinished:
            unfinished.write_text(suggested_scenario(file, output, listings, layout, blocks), encoding="utf-8")
    rows = [("column", "unit", "values", "first"), *((c.column, c.unit, c.values, c.first) for c in listings)]
    suggested, files = suggested_loading(file, listings, layout, blocks), [] if output is None else [output]
    if as_json:
        write_answer(Answer([*(("note", line) for line in seen), ("scenario", suggested)], [rows], files), as_json=True)
        return
    for line in seen:
        click.echo(line)
    write_answer(Answer(tables=[rows]))
    click.echo("\n".join(["", suggested, *(f"\n{path}" for path in files)]))


@click.command()
@click.argument("file", type=path_type)
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option(
    "--dead-band",
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
@click.option(
    "-o", "--output", type=path_type, help="Also write all loops to this file (.nc, .csv), or draw them there."
)
@click.option(
    "--levels", type=path_type, help="Also write the table over the normal load (.nc, .csv), or draw it there."
)
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the loops: FILE's name with _loops.png, here.")
@click.option("--picture", type=path_type, help="Also draw the loops to this file (PNG, PDF, SVG).")
@click.option("--model", "with_model", is_flag=True, help="Also draw the loops of the scenario's model, dashed.")
@json_option
@force_option
@set_option
def loops(
    file: Path,
    skip: int,
    dead_band: str | None,
    skip_per_level: int,
    load_share: float | None,
    amplitude_share: float | None,
    output: Path | None,
    levels: Path | None,
    with_picture: bool,
    picture: Path | None,
    with_model: bool,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Evaluate the friction loops of FILE.

    FILE is a result, or a scenario with a measured record. At several normal loads a table has a row for each load.
    """
    band = None if dead_band is None else quantity_option("--dead-band", dead_band, "m")
    named = Path(f"{file.stem}_loops.png") if with_picture else None
    pictures = [path for path in (named, picture) if path is not None]
    outputs = [
        *(Output(path, (*TABLES_OF_LOOPS, PICTURE)) for path in (output,) if path is not None),
        *(Output(path, (*TABLES_OF_LEVELS, PICTURE)) for path in (levels,) if path is not None),
        *(Output(path, (PICTURE,)) for path in pictures),
    ]
    from historysim.measured.branches import DEFAULT, Definitions
    from historysim.results.plots.found_loops import LoopLevelsPicture, MeasuredLoopsPicture
    from historysim.scenario.record_search import loops as find_loops
    from historysim.scenario.scenario import load

    definitions = Definitions(
        load_share=DEFAULT.load_share if load_share is None else load_share,
        amplitude_share=DEFAULT.amplitude_share if amplitude_share is None else amplitude_share,
    )
    measured = file.suffix == ".toml"
    record = load(file, values) if measured else scenario_or_file(file, values)
    check_outputs(outputs, files_read(record), force=force)
    options: dict[str, Any] = {
        "dead_band": band,
        "skip": skip,
        "skip_per_level": skip_per_level,
        "definitions": definitions,
    }
    if _is_each(record):
        _check_no_output(outputs)
        from historysim.scenario.each_run import each_run, loop_rows

        _tell_runs(each_run(record, lambda run: find_loops(run, **options)), loop_rows, as_json=as_json)
        return
    evaluation = find_loops(record, **options)
    model = _model_loops(record, skip) if with_model else None
    picture_of_loops = MeasuredLoopsPicture(model=model, title=file.name)
    by_load = evaluation.by_load()
    if levels is not None and not len(by_load):
        raise InputError(f"{file}: the normal load was not measured; expected it for {levels}")
    if output is not None:
        save_table(evaluation.to_dataset(), output, lambda _: picture_of_loops.figure(evaluation), measured=measured)
    if levels is not None:
        save_table(by_load.to_dataset(), levels, LoopLevelsPicture(title=file.name).figure, measured=measured)
    for path in pictures:
        save(picture_of_loops.figure(evaluation), path)
    several_loads = len(by_load) > 1
    tables: list[Sequence[tuple[str, ...]]] = [by_load.rows() if several_loads else evaluation.rows()]
    below: Sequence[tuple[str, str]] = ()
    if several_loads:
        below = [(label, both) for label, *_, both in evaluation.rows() if label.startswith(("largest", "loops"))]
    if not evaluation.large.all():
        (heading, *directions), *rows = evaluation.by_amplitude().rows()
        tables.insert(several_loads, [(f"{heading}, all loads" if several_loads else heading, *directions), *rows])
    files = [target.path for target in outputs]
    write_answer(Answer(evaluation.summary(), tables, files, evaluation.to_dataset, below), as_json=as_json)


@click.command()
@click.argument("file", type=path_type)
@click.option("--over", type=click.Choice(["time", "distance"]), help="[default: distance, where it is known]")
@click.option("--windows", default=50, show_default=True, help="Windows of equal length that friction is averaged in.")
@click.option(
    "-o", "--output", type=path_type, help="Also write the windows to this file (.nc, .csv), or draw them there."
)
@json_option
@force_option
@set_option
def sliding(
    file: Path,
    over: "Over | None",
    windows: int,
    output: Path | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Evaluate friction in a unidirectional sliding record.

    Static peak, running-in and steady value. FILE is a result, or a scenario with a measured record.
    """
    from historysim.results.plots.record_pictures import SlidingPicture
    from historysim.scenario.record_search import sliding as find_sliding
    from historysim.scenario.scenario import load

    measured = file.suffix == ".toml"
    record = load(file, values) if measured else scenario_or_file(file, values)
    outputs = [] if output is None else [Output(output, (*TABLES_OF_SLIDING, PICTURE))]
    check_outputs(outputs, files_read(record), force=force)
    if _is_each(record):
        _check_no_output(outputs)
        from historysim.scenario.each_run import each_run, sliding_rows

        runs = each_run(record, lambda run: find_sliding(run, over=over, windows=windows))
        _tell_runs(runs, sliding_rows, as_json=as_json)
        return
    evaluation = find_sliding(record, over=over, windows=windows)
    if output is not None:
        save_table(
            evaluation.to_dataset(),
            output,
            lambda _: SlidingPicture(title=file.name).figure(evaluation),
            measured=measured,
        )
    write_answer(
        Answer(evaluation.summary(), files=[target.path for target in outputs], data=evaluation.to_dataset),
        as_json=as_json,
    )


@click.command()
@click.argument("scenario", type=path_type)
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option("-o", "--output", type=path_type, help="The picture. [default: SCENARIO's name with _comparison.png]")
@json_option
@force_option
@set_option
def compare(scenario: Path, skip: int, output: Path | None, as_json: bool, force: bool, values: dict[str, Any]) -> None:
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
    save(ComparisonPicture(title=loaded.title).figure(comparison), output)
    write_answer(Answer(comparison.summary(), [comparison.rows()], [output]), as_json=as_json)


@click.command()
@click.argument("scenario", type=path_type)
@click.option(
    "-o", "--output", type=path_type, help="The fitted scenario. [default: SCENARIO's name with _fitted.toml]"
)
@click.option(
    "--picture", type=path_type, help="The picture (PNG, PDF, SVG). [default: the fitted scenario's with .png]"
)
@json_option
@force_option
@set_option
def fit(
    scenario: Path,
    output: Path | None,
    picture: Path | None,
    as_json: bool,
    force: bool,
    values: dict[str, Any],
) -> None:
    """Fit parameters of SCENARIO to its measured record, as [fit] says.

    Writes the fitted scenario and a picture.
    """
    output = output or Path(f"{scenario.stem}_fitted.toml")
    picture = picture or output.with_suffix(".png")
    from historysim.results.plots.record_pictures import ComparisonPicture
    from historysim.scenario.fit import fit as fit_scenario
    from historysim.scenario.scenario import load

    loaded = load(scenario, values)
    check_outputs([Output(output, (FITTED,)), Output(picture, (PICTURE,))], loaded.files, force=force)

    def write(fitted: "Fit", output: Path, picture: Path) -> None:
        # both stand under their names, or neither
        with replacing(output) as unfinished:
            unfinished.write_text(fitted.scenario_text(output), encoding="utf-8")
            save(ComparisonPicture(title=loaded.title).figure(fitted.comparison), picture)

    if _is_each(loaded):
        from historysim.scenario.each_run import each_run, fit_rows

        runs = each_run(loaded, lambda run: fit_scenario(run, progress=True))
        named = {
            run.number: [path.with_stem(f"{path.stem}_{run.number}") for path in (output, picture)] for run in runs
        }
        several = [place for one, two in named.values() for place in (Output(one, (FITTED,)), Output(two, (PICTURE,)))]
        check_outputs(several, loaded.files, force=force)
        for run in runs:
            if run.result is not None:
                write(run.result, *named[run.number])
        files = [path for run in runs if run.result is not None for path in reversed(named[run.number])]
        _tell_runs(runs, fit_rows, files, as_json=as_json)
        return
    fitted = fit_scenario(loaded, progress=True)
    write(fitted, output, picture)
    write_answer(Answer(fitted.summary(), [fitted.comparison.rows()], [picture, output]), as_json=as_json)


def _is_each(record: "Scenario | Path") -> "TypeGuard[Scenario]":
    """Return whether each run of a scenario's file is asked for."""
    return not isinstance(record, Path) and record.run == "each"


def _check_no_output(outputs: list[Output]) -> None:
    if outputs:
        raise InputError(
            f"{outputs[0].path}: holds what one run has; expected the number of one, as --set loading.run=1"
        )


def _tell_runs(
    runs: "list[Run[Any]]",
    rows: "Callable[[list[Run[Any]]], list[tuple[str, ...]]]",
    files: "Sequence[Path]" = (),
    *,
    as_json: bool,
) -> None:
    problems = [(f"run {run.number}", run.problem) for run in runs if run.problem]
    if as_json:
        write_answer(Answer(problems, [rows(runs)], files), as_json=True)
        return
    write_answer(Answer(tables=[rows(runs)]))
    write_answer(Answer(problems, files=files))


def _model_loops(record: "Scenario | Path", skip: int) -> "Loops | None":
    """Return the loops of the model along what was measured."""
    from historysim.scenario.fit import compare as compare_scenario

    if isinstance(record, Path):
        raise InputError(f"{record}: is no scenario (.toml) with a measured record; expected one for --model")
    return compare_scenario(record, skip=skip).model
