"""The command line. Only click is imported here, so that ``--help`` answers at once."""

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim._version import __version__
from historysim.errors import HistorySimError, InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.instrument import Instrument
    from historysim.measured.comparison import Comparison
    from historysim.measured.loops import Loops
    from historysim.measured.observation import Observation, Passage
    from historysim.measured.record import Record
    from historysim.scenario.scenario import Scenario
    from historysim.surfaces.heights import Surface

NOISE_SHARE = 0.05
"""Swings of a result's displacement, over its range, below which no loop is looked for."""

NETCDF_BEGINNINGS = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02", b"CDF\x05")


class NotPossible(click.ClickException):
    """What was asked for cannot be carried out."""

    exit_code = 1


class BadInput(click.ClickException):
    """What was given cannot be used."""

    exit_code = 2


class Interrupted(click.ClickException):
    """The user has stopped the program."""

    exit_code = 130


class Commands(click.Group):
    """Commands whose errors end as one message and an exit code."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise BadInput(str(error)) from error
        except HistorySimError as error:
            raise NotPossible(str(error)) from error
        except BrokenPipeError:
            raise
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            raise NotPossible(f"{place}{error.strerror or error}") from error
        except MemoryError as error:
            raise NotPossible("the memory does not suffice; record fewer asperities, or split the loads") from error
        except KeyboardInterrupt as error:
            raise Interrupted("interrupted") from error


path_type = click.Path(path_type=Path)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def main() -> None:
    """Replay load histories across rough frictional contacts, exactly."""


@main.command()
@click.argument("scenario", type=path_type)
@click.option("-o", "--output", type=path_type, help="The result (netCDF). [default: SCENARIO's name with .nc, here]")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the result, beside it.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing.")
@click.option("--resume", is_flag=True, help="Go on where an earlier run was ended, from its log.")
@click.option(
    "--snapshot-every",
    type=click.IntRange(1),
    metavar="STEPS",
    help="Steps that a crash costs at most. [default: some seconds of replay]",
)
@click.option("--compression", type=click.Choice(["none", "zlib", "zstd"]), default="none", show_default=True)
def run(
    scenario: Path,
    output: Path | None,
    with_picture: bool,
    quiet: bool,
    resume: bool,
    snapshot_every: int | None,
    compression: str,
) -> None:
    """Replay SCENARIO (TOML), or the log of a run, and write the history to a netCDF file.

    The log, NAME.history, stands beside the result from the beginning.
    """
    output = output or Path(f"{scenario.stem}.nc")
    _check_target(output, scenario)
    _check_target(output.with_suffix(".history"), *([] if scenario.suffix == ".history" else [scenario, output]))
    picture = output.with_suffix(".png")
    if with_picture:
        _check_target(picture, scenario, output)
    from historysim.results import analysis
    from historysim.scenario.run import run as carry_out

    with carry_out(
        scenario,
        output,
        progress=not quiet,
        resume=resume,
        snapshot_every=snapshot_every,
        compression=compression,
        tell=_notice,
    ) as history:
        if with_picture:
            _draw(history, picture)
        lines = [*analysis.summary(history), ("result", str(output))]
    if not quiet:
        _print_lines([*lines, ("picture", str(picture))] if with_picture else lines)


@main.command()
@click.argument("file", type=path_type)
@click.option("--log", type=path_type, help="The log of a result. [default: NAME.history beside it]")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing where all is well.")
def verify(file: Path, log: Path | None, quiet: bool) -> None:
    """Replay the log of a result, FILE, and compare every bit; or check FILE, a log, and its snapshots."""
    from historysim.log.verification import verify as check

    found = check(file, log, progress=not quiet, tell=_notice)
    told = "\n".join(f"  {difference.text}" for difference in found.differences)
    if not found:
        raise NotPossible(f"{file}: is not what its log gives:\n{told}")
    if _is_log(file):
        lines = [
            ("events", f"{found.events:,}, sound"),
            ("snapshots", f"{found.snapshots:,}, as replayed"),
            ("digest", found.digest),
        ]
    elif found.differences:
        lines = [(str(file), f"is what its log gives, up to rounding elsewhere:\n{told}")]
    else:
        lines = [(str(file), "is what its log gives, bit for bit")]
    if not quiet:
        _print_lines(lines)


@main.command()
@click.argument("log", type=path_type)
@click.option("--at", "moment", help='The time, as "12.5 s" or in s. [default: the end]')
@click.option("--asperity", type=int, help="Look at this asperity: its state, its reversal points.")
@click.option("-o", "--output", type=path_type, help="Write all asperities (netCDF); with --asperity a picture.")
def state(log: Path, moment: str | None, asperity: int | None, output: Path | None) -> None:
    """Say what the state was at a time in LOG (NAME.history)."""
    if output is not None:
        _check_target(output, log)
    from historysim.basics.units import quantity_text
    from historysim.log.event_log import EventLog

    with EventLog(log) as events:
        time = float("inf") if moment is None else _time(moment, "--at")
        found = events.state(at=time, tell=_notice)
        if asperity is not None:
            from historysim.results.plots.traction import reversal_table, summary, traction_picture

            one = events.ensemble.asperity(asperity, found)
            _print_lines(summary(one))
            _print_table(reversal_table(one))
            if output is not None:
                _save(traction_picture(one), output)
                click.echo(output)
            return
        _print_lines(
            [
                ("normal load", quantity_text(found.normal_load, "N")),
                ("tangential load", quantity_text(found.tangential_load, "N")),
                ("approach", quantity_text(found.approach, "m")),
                ("tangential displacement", quantity_text(found.tangential_displacement, "m")),
                ("dissipated energy", quantity_text(found.dissipated_energy, "J")),
                ("stored energy", quantity_text(found.stored_energy, "J")),
            ]
        )
        if output is not None:
            _written(events.state_dataset(at=time), output)


@main.command()
@click.argument("log", type=path_type)
@click.option("--at", "moment", required=True, help='The time, as "12.5 s" or in s.')
@click.option("-o", "--output", type=path_type, required=True, help="The new log.")
def fork(log: Path, moment: str, output: Path) -> None:
    """Copy the past of LOG (NAME.history) up to a time to a new log, for another future."""
    _check_target(output, log)
    from historysim.log.event_log import EventLog

    with EventLog(log) as events, events.fork(_time(moment, "--at"), output, tell=_notice) as made:
        click.echo(f"{output}: {len(made):,} events")


@main.command()
@click.argument("log", type=path_type)
@click.argument("table", type=path_type)
def append(log: Path, table: Path) -> None:
    """Append the events in TABLE (CSV) to LOG (NAME.history).

    The table has a header line: time, and one or more of normal_load, normal_displacement, tangential_load,
    tangential_displacement, friction. Numbers are SI, or carry units; an empty cell is no event.
    """
    from historysim.loads.event_table import read_events
    from historysim.log.event_log import EventLog

    with EventLog(log) as events:
        new = read_events(table)
        try:
            events.append(new)
        except InputError as error:
            raise InputError(f"{table}: {error}") from error
        click.echo(f"{log}: {len(new):,} events appended, {len(events):,} in all")


@main.command("log")
@click.argument("file", metavar="LOG", type=path_type)
@click.option("--kind", multiple=True, help="Only events of this kind: normal_load, friction, …; may come twice.")
@click.option("--from", "begin", help='Only from this time on, as "12.5 s" or in s.')
@click.option("--to", "end", help="Only up to this time.")
@click.option("--first", type=click.IntRange(0), help="Only so many, the first ones.")
@click.option("--last", type=click.IntRange(0), help="Only so many, the last ones.")
def list_log(
    file: Path, kind: tuple[str, ...], begin: str | None, end: str | None, first: int | None, last: int | None
) -> None:
    """List the events of LOG (NAME.history)."""
    from historysim.loads.event_table import KINDS, name_of, value_text
    from historysim.loads.events import time_text
    from historysim.log.event_log import EventLog

    for name in kind:
        if name not in KINDS:
            raise InputError(f"--kind {name}: expected one of {', '.join(KINDS)}")
    start, stop = _time(begin or "-inf", "--from"), _time(end or "inf", "--to")
    with EventLog(file) as log:
        chosen = [
            (number, event)
            for number, event in enumerate(log.events())
            if start <= event.time <= stop and (not kind or name_of(event) in kind)
        ]
    chosen = chosen[: len(chosen) if first is None else first]
    chosen = chosen if last is None else chosen[max(len(chosen) - last, 0) :]
    rows = [("event", "time", "kind", "value")]
    for number, event in chosen:
        name = name_of(event)
        unit = "" if name == "friction" else f" {KINDS[name][1]}"
        rows.append((str(number), time_text(event.time), name, f"{value_text(event)}{unit}"))
    _print_table(rows)


def _notice(text: str) -> None:
    click.echo(f"Note: {text}", err=True)


def _time(text: str, option: str) -> float:
    from historysim.basics.units import quantity

    try:
        return float(text)
    except ValueError:
        pass
    try:
        return quantity(text, "s")
    except InputError as error:
        raise InputError(f"{option}: {error}") from error


def _written(history: "xr.Dataset", output: Path) -> None:
    unfinished = output.with_name(f".{output.name}.{os.getpid()}.part")
    try:
        history.to_netcdf(unfinished)
        unfinished.replace(output)
    finally:
        unfinished.unlink(missing_ok=True)
    click.echo(output)


@main.command()
@click.argument("scenario", type=path_type)
def validate(scenario: Path) -> None:
    """Check SCENARIO (TOML) and the files that it names, without running it."""
    _print_lines(_scenario_lines(scenario))
    click.echo("valid")


def height_map_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that say what a height map leaves open."""
    for option in (
        click.option("--form", default="plane", show_default=True, help="What to take off a height map first."),
        click.option("--channel", help="Channel of a height map, by its number from 0 or its name."),
        click.option("--lateral-unit", help="Unit of its coordinates, if it has some without."),
        click.option("--height-unit", help="Unit of its heights, if it names none."),
        click.option("--pixel-size", multiple=True, help='As "0.5 µm", if it has none; twice for x and y.'),
    ):
        command = option(command)
    return command


@main.command()
@click.argument("file", type=path_type)
@height_map_options
def show(file: Path, **height_map: Any) -> None:
    """Say in a few lines what FILE holds: a scenario, a result, a log, or a height map."""
    kind = _kind(file)
    if kind == "scenario":
        _print_lines(_scenario_lines(file))
        return
    if kind == "log":
        _print_lines(_log_lines(file))
        return
    if kind == "height map":
        from historysim.surfaces.summary import summary

        _print_lines([*summary(_height_map(file, **height_map)), ("form taken off", height_map["form"])])
        return
    from historysim.results import analysis

    with _opened(file) as history:
        _print_lines(analysis.summary(history))
        click.echo()
        one_line = {key: str(value) for key, value in history.attrs.items() if "\n" not in str(value).strip()}
        _print_lines(one_line.items())


@main.command()
@click.argument("file", type=path_type)
@click.option("-o", "--output", type=path_type, help="The picture (PNG, PDF, SVG). [default: FILE's name with .png]")
@click.option("--step", help="Draw the surface of a result at this step, or at the peak normal load: a number or peak.")
@click.option("--adhesion", is_flag=True, help="Draw the adhesion map with asperities of a scenario.")
@height_map_options
def plot(file: Path, output: Path | None, step: str | None, adhesion: bool, **height_map: Any) -> None:
    """Draw FILE.

    A result: the friction loop, the loads, and the slip state of the asperities; with --step the surface, its summits
    in contact coloured by their slip state. A scenario or a height map: the surface with its summits.
    """
    kind = _kind(file)
    if adhesion:
        if kind != "scenario":
            raise InputError(f"--adhesion: {file} is a {kind}; expected a scenario with [adhesion]")
        output = output or Path(f"{file.stem}_adhesion.png")
        _check_target(output, file)
        _save(_adhesion_map(file), output)
        click.echo(output)
        return
    if step is not None and kind != "result":
        raise InputError(f"--step {step}: {file} is a {kind}; expected a result of historysim run, which has steps")
    if output is None:
        beside = file if kind == "result" else Path(file.name)
        output = beside.with_name(f"{file.stem}_surface.png" if step or kind != "result" else f"{file.stem}.png")
    _check_target(output, file)
    if kind == "log":
        raise InputError(f"{file}: is a log; expected its result; historysim run {file} makes it again")
    from historysim.results.plots.surface import surface_picture

    if kind == "scenario":
        _save(surface_picture(_scenario_surface(file)), output)
    elif kind == "height map":
        surface = _height_map(file, **height_map)
        _save(surface_picture(_map_surface(surface, file.name)), output)
    else:
        with _opened(file) as history:
            if step is None:
                _draw(history, output)
            else:
                _save(surface_picture(_result_surface(file, history), history, _step(step, history)), output)
    click.echo(output)


@main.command()
@click.argument("file", type=path_type)
@click.option("--delimiter", help="What stands between two values of a text. [default: found]")
@click.option("--decimal", default=".", show_default=True, help="The decimal sign of a text.")
@click.option("--header", type=int, help="The line of a text that names the columns. [default: found]")
@click.option("--encoding", default="utf-8", show_default=True, help="The encoding of a text.")
def columns(file: Path, delimiter: str | None, decimal: str, header: int | None, encoding: str) -> None:
    """List the columns of FILE, a file of numbers, as a scenario names them."""
    from historysim.scenario.schema import reported
    from historysim.tables import Format, describe

    with reported("columns"):
        layout = Format(delimiter=delimiter, decimal=decimal, header=header, encoding=encoding)
    found = describe(file, layout)
    _print_table([("column", "unit", "values", "first"), *((c.column, c.unit, c.values, c.first) for c in found)])


@main.command()
@click.argument("file", type=path_type)
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option(
    "--dead-band",
    help="Swings below which there is no reversal, as \"5 nm\". [default: the scenario's; 5 % of a result's range]",
)
@click.option("-o", "--output", type=path_type, help="Also write all loops to this file (netCDF).")
def loops(file: Path, skip: int, dead_band: str | None, output: Path | None) -> None:
    """Say what the friction loops of FILE are like: of a scenario's measured record, or of a result."""
    from historysim.basics.units import quantity

    try:
        band = None if dead_band is None else quantity(dead_band, "m")
    except InputError as error:
        raise InputError(f"--dead-band: {error}") from error
    if output is not None:
        _check_target(output, file)
    kind = _kind(file)
    if kind == "height map":
        raise InputError(f"{file}: is no scenario (.toml) and no result of historysim run; expected one of them")
    if kind == "result":
        from historysim.results import analysis

        with _opened(file) as history:
            displacement = history["tangential_displacement"].values
            band = NOISE_SHARE * float(displacement.max() - displacement.min()) if band is None else band
            found = analysis.friction_loops(history, dead_band=band, skip=skip)
    else:
        from historysim.measured.loops import find_loops

        loaded, record = _measured(file, *([] if output is None else [output]))
        band = record.dead_band["tangential_displacement"] if band is None else band
        with _reported(loaded):
            found = find_loops(
                record.time,
                record["tangential_displacement"],
                record["tangential_load"],
                record.get("normal_load"),
                dead_band=band,
                skip=skip,
            )
        _print_lines(record.remarks)
    if output is not None:
        with _finished(output) as unfinished:
            found.to_dataset().to_netcdf(unfinished)
    _print_lines(_sequence_lines(found, band))
    _print_table(found.rows())
    if output is not None:
        click.echo(output)


def _sequence_lines(loops: "Loops", dead_band: float) -> list[tuple[str, str]]:
    """Say what range pairs the displacement has, and, at several loads, how friction goes with the load."""
    import numpy as np

    from historysim.basics.units import quantity_text
    from historysim.measured.fitting import power_law
    from historysim.measured.range_pairs import range_pairs

    pairs = range_pairs(loops.record.displacement, dead_band=dead_band)
    closed = pairs.range[pairs.count == 1]
    largest = f", up to {quantity_text(float(closed.max()), 'm')}" if closed.size else ""
    lines = [("range pairs", f"{closed.size:,} closed{largest}; {pairs.range.size - closed.size:,} half cycles")]
    load, friction = loops.normal_load.mean(axis=1), loops.friction_coefficient.mean(axis=1)
    known = (load > 0) & (friction > 0)
    load, friction = load[known], friction[known]
    # over one load there is nothing to tell
    if load.size >= 3 and np.ptp(load) > 0.05 * load.max():
        law = power_law(load, friction)
        interval = f"95 %: {law.exponent_low:+.3f} to {law.exponent_high:+.3f}"
        lines.append(("friction over load", f"coefficient goes with the power {law.exponent:+.3f} of N ({interval})"))
    return lines


@main.command()
@click.argument("scenario", type=path_type)
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option("-o", "--output", type=path_type, help="The picture. [default: SCENARIO's name with _comparison.png]")
def compare(scenario: Path, skip: int, output: Path | None) -> None:
    """Set the model of SCENARIO beside what was measured: time series, loops, energy per loop."""
    output = output or Path(f"{scenario.stem}_comparison.png")
    _check_target(output, scenario)
    from historysim.measured.observation import observe, passed

    loaded, record = _measured(scenario, output)
    with _reported(loaded):
        observation = observe(record, skip=skip)
    passage = passed(loaded.ensemble(), loaded.instrument, observation)
    comparison = _compared(record, observation, passage, skip, loaded.instrument)
    _save(_comparison_picture(comparison, loaded), output)
    _print_lines([*record.remarks, *comparison.summary()])
    _print_table(comparison.rows())
    click.echo(output)


@main.command()
@click.argument("scenario", type=path_type)
@click.option(
    "-o", "--output", type=path_type, help="The fitted scenario. [default: SCENARIO's name with _fitted.toml]"
)
def fit(scenario: Path, output: Path | None) -> None:
    """Fit parameters of SCENARIO, as its [fit] says, to what was measured; write the fitted scenario and a picture."""
    output = output or Path(f"{scenario.stem}_fitted.toml")
    if output.suffix != ".toml":
        raise InputError(f"{output}: {output.suffix or 'no'} ending; expected .toml, since it is a scenario")
    picture = output.with_suffix(".png")
    _check_target(output, scenario)
    _check_target(picture, scenario)
    from historysim.measured import fitting
    from historysim.measured.observation import observe
    from historysim.scenario import fit as scenario_fit

    loaded, record = _measured(scenario, output, picture)
    section, model, start = scenario_fit.model_of(loaded)
    with _reported(loaded):
        observation = observe(
            record, skip=section.skip, displacement_noise=section.displacement_noise, load_noise=section.load_noise
        )
        found = fitting.fit(model, start, observation)
    comparison = _compared(record, observation, found.passage, section.skip, model(found.values)[1])
    text = scenario_fit.fitted_text(loaded, found, output)
    with _finished(output) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
        _save(_comparison_picture(comparison, loaded), picture)
    _print_lines([*record.remarks, *found.summary(), *comparison.summary()])
    _print_table(comparison.rows())
    click.echo(picture)
    click.echo(output)


def _measured(path: Path, *targets: Path) -> "tuple[Scenario, Record]":
    """Load a scenario and the record that it replays, which none of the targets may overwrite."""
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    record = loaded.measured()
    for target in targets:
        _check_target(target, path.parent / loaded.sections.loading.file)  # type: ignore[union-attr] # it is measured
    return loaded, record


@contextmanager
def _reported(loaded: "Scenario") -> Iterator[None]:
    """Name the scenario, where its record is not what it is taken for."""
    from historysim.scenario.schema import at, reported

    with reported(loaded.path.name), at("loading"):
        yield


def _compared(
    record: "Record", observation: "Observation", passage: "Passage", skip: int, instrument: "Instrument"
) -> "Comparison":
    from historysim.measured.comparison import compare as compared

    dead_band = record.dead_band["tangential_displacement"]
    return compared(observation, passage, dead_band=dead_band, skip=skip, instrument=instrument)


def _comparison_picture(comparison: "Comparison", loaded: "Scenario") -> "Figure":
    from historysim.results.plots.comparison import comparison_picture

    return comparison_picture(comparison, loaded.title)


def _print_table(rows: Sequence[tuple[str, ...]]) -> None:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        click.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


def _check_target(path: Path, *sources: Path) -> None:
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected the name of a file to write")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")
    if any(
        path.absolute() == source.absolute() or (path.exists() and source.exists() and path.samefile(source))
        for source in sources
    ):
        raise InputError(f"{path}: would overwrite what it is made from; choose another name")


def _scenario_lines(path: Path) -> list[tuple[str, str]]:
    from historysim.basics.units import duration_text
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    ensemble, events = loaded.checked()
    duration = duration_text(events[-1].time - events[0].time)
    return [
        ("title", " ".join(loaded.title.split()) or path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,} over {duration}"),
        ("substeps", str(loaded.substeps)),
        ("recorded asperities", loaded.record if isinstance(loaded.record, str) else f"{len(loaded.record):,} chosen"),
        *_adhesion_lines(loaded.adhering(ensemble, events)),
    ]


def _adhesion_lines(contact: "AdheringAsperities | None") -> list[tuple[str, str]]:
    if contact is None:
        return []
    zones = list(contact.regime)
    counts = ", ".join(f"{zones.count(zone):,} {zone.label}" for zone in dict.fromkeys(zones))
    share = -contact.pull_off_load.sum() / contact.normal_load.sum()
    return [
        ("adhesion regimes", f"{counts}, where the asperities are pressed most"),
        ("adhesion left out", f"pull-off {100 * share:.2g} % of the normal load at most"),
    ]


def _log_lines(path: Path) -> list[tuple[str, str]]:
    from historysim.basics.units import duration_text
    from historysim.log.event_log import EventLog

    with EventLog(path) as log:
        events, settings = log.events(), log.settings
        duration = f" over {duration_text(events[-1].time - events[0].time)}" if events else ""
        return [
            ("title", settings["title"] or path.stem),
            ("asperities", f"{len(log.ensemble):,}"),
            ("events", f"{len(events):,}{duration}"),
            ("substeps", str(settings["substeps"])),
            ("made with", f"historysim {settings['historysim_version']}, {settings['made_with']}"),
            ("digest", log.digest),
        ]


def _kind(path: Path) -> str:
    """Tell a scenario, a result and a height map apart."""
    if path.suffix == ".toml":
        return "scenario"
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected a scenario, a result of historysim run, or a height map")
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file; expected a scenario, a result of historysim run, or a height map"
        )
    if _is_log(path):
        return "log"
    if not _is_netcdf(path):
        return "height map"
    import netCDF4

    # maps come as netCDF too; a file that does not open is left to the reader of results, which says what is wrong
    with suppress(OSError, RuntimeError), netCDF4.Dataset(path) as file:
        if "historysim_version" not in file.ncattrs():
            return "height map"
    return "result"


def _height_map(
    path: Path,
    *,
    pixel_size: tuple[str, ...],
    height_unit: str | None,
    lateral_unit: str | None,
    channel: str | None,
    form: str,
) -> "Surface":
    from historysim.basics.arguments import representable
    from historysim.surfaces.reading import read_surface

    if len(pixel_size) > 2:
        raise InputError(f"--pixel-size came {len(pixel_size)} times; expected it once, or twice for x and y")
    try:
        surface = read_surface(
            path,
            pixel_size=(pixel_size[0], pixel_size[-1]) if pixel_size else None,
            height_unit=height_unit,
            lateral_unit=lateral_unit,
            channel=int(channel) if channel is not None and channel.isdecimal() else channel,
        )
    except InputError as error:
        raise InputError(
            f"{error} (read as a height map: neither named .toml nor a result of historysim run)"
        ) from error
    with representable():
        return surface.detrended(form)


def _map_surface(surface: "Surface", title: str) -> "xr.Dataset":
    from historysim.basics.arguments import representable
    from historysim.recording import surface_group

    with representable():
        summits = surface.summits(3 if 1 in surface.shape else 9)
    return surface_group.dataset(summits, surface).assign_attrs(title=title)


def _scenario_surface(path: Path) -> "xr.Dataset":
    from historysim.recording import surface_group
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    ground = loaded.ground()
    return surface_group.dataset(ground.summits, ground.surface).assign_attrs(title=loaded.title or path.stem)


def _adhesion_map(path: Path) -> "Figure":
    from historysim.results.plots.adhesion import adhesion_map
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    ensemble, events = loaded.checked()
    contact = loaded.adhering(ensemble, events)
    if contact is None:
        raise InputError(f"{path}: has no [adhesion], or nothing touches; expected both to draw the adhesion map")
    ranks = {"greatest load": 0, "median load": contact.asperity.size // 2, "least load": contact.asperity.size - 1}
    marked = {rank: name for name, rank in reversed(ranks.items())}
    return adhesion_map(
        {
            f"asperity {contact.asperity[rank]}, {name}": (
                float(contact.maugis_parameter[rank]),
                float(contact.load_parameter[rank]),
            )
            for rank, name in sorted(marked.items())
        }
    )


def _result_surface(path: Path, history: "xr.Dataset") -> "xr.Dataset":
    import xarray as xr

    from historysim.recording.surface_group import GROUP
    from historysim.results.plots.surface import surface_of

    try:
        return xr.load_dataset(path, engine="netcdf4", group=GROUP)
    except (OSError, KeyError):
        return surface_of(history)


def _step(text: str, history: "xr.Dataset") -> int:
    if text == "peak":
        return int(history["total_normal_load"].values.argmax())
    try:
        return int(text)
    except ValueError:
        raise InputError(f"--step {text}: expected a number from 0 to {history.sizes['step'] - 1}, or peak") from None


def _print_lines(lines: Iterable[tuple[str, str]]) -> None:
    lines = list(lines)
    width = max((len(label) for label, _ in lines), default=0) + 2
    for label, value in lines:
        click.echo(f"{label:<{width}}{value}")


def _is_log(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(16) == b"SQLite format 3\x00"
    except (OSError, ValueError):
        return False


def _is_netcdf(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(8).startswith(NETCDF_BEGINNINGS)
    except (OSError, ValueError):
        return False


@contextmanager
def _opened(path: Path) -> Iterator["xr.Dataset"]:
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected a scenario, a result of historysim run, or a height map")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected a result of historysim run (netCDF)")
    if not _is_netcdf(path):
        raise InputError(f"{path}: is not a netCDF file; expected a result of historysim run")
    import xarray as xr

    try:
        history = xr.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({error}); run the scenario again") from error
    with history:
        if not history.attrs.get("complete"):
            raise InputError(f"{path}: is not a finished result of historysim run; run the scenario again")
        try:
            yield history
        except RuntimeError as error:
            if not str(error).startswith("NetCDF: "):
                raise
            raise InputError(f"{path}: is damaged ({error}); run the scenario again") from error


def _draw(history: "xr.Dataset", picture: Path) -> None:
    from historysim.results.plots.history import overview

    _save(overview(history), picture)


def _save(figure: "Figure", picture: Path) -> None:
    known = figure.canvas.get_supported_filetypes()
    kind = picture.suffix.removeprefix(".").lower()
    if kind not in known:
        raise InputError(f"{picture}: {kind or 'no'} ending; expected one of {', '.join(sorted(known))}")
    with _finished(picture) as unfinished, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(unfinished, format=kind, dpi=200)


@contextmanager
def _finished(path: Path) -> Iterator[Path]:
    """Give the name of a file beside this one, which takes its place as soon as it is written, and only then."""
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
