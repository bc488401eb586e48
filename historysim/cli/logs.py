"""Commands for logs: verify, state, log."""

import math
from pathlib import Path

import click

from historysim.basics.files import is_log, replacing
from historysim.basics.targets import PICTURE, RESULT, csv_table, signed_format
from historysim.cli import options
from historysim.cli.exit_codes import CommandError
from historysim.cli.output import check_outputs, notice, save, write_answer
from historysim.errors import InputError

# Printed totals of a state, by unit.
TOTALS = {
    "N": ("normal_load", "tangential_load"),
    "m": ("approach", "tangential_displacement"),
    "J": ("dissipated_energy", "stored_energy"),
}


@click.command()
@options.common("file")
@options.path_option("--log", help="The log of a result. [default: NAME.history next to it]")
@options.common("quiet", "json")
def verify(file: Path, log: Path | None) -> None:
    """Replay the log of FILE, a result or NAME.history, and compare.

    A result must be bit-identical to the replay of its log. A log is checked including its
    snapshots.
    """
    from historysim.log.verification import verify as check

    verification = check(file, log, progress=not options.has_flag("quiet"), notify=notice)
    differences = "\n".join(f"  {difference.text}" for difference in verification.differences)
    if not verification:
        raise CommandError(f"{file}: differs from the replay of its log:\n{differences}", code=1)
    lines = [(str(file), "is bit-identical to the replay of its log")]
    if is_log(file):
        lines = [
            ("events", f"{verification.events:,}, sound"),
            ("snapshots", f"{verification.snapshots:,}, as replayed"),
            ("digest", verification.digest),
        ]
    elif differences:
        lines = [
            (
                str(file),
                f"agrees with the replay of its log, up to rounding on another machine:\n{differences}",
            )
        ]
    write_answer(lines)


@click.command()
@options.common("log")
@options.quantity_option(
    "--at", "s", help='The time, as "12.5 s". [default: the end]', default=math.inf
)
@click.option("--asperity", type=int, help="Show this asperity: its state, its reversal points.")
@options.output_option("Write all asperities (netCDF); with --asperity a picture.")
@options.common("json", "force")
def state(log: Path, at: float, asperity: int | None, output: Path | None) -> None:
    """Show the state of the contact at a time in LOG (NAME.history)."""
    files = check_outputs([log], (output, RESULT if asperity is None else PICTURE))
    from historysim.basics.units import duration_text, quantity_text
    from historysim.log.event_log import EventLog

    with EventLog(log) as events:
        contact = events.state(at=at, notify=notice)
        end_time = events.events(len(events) - 1)[0].time if len(events) else math.inf
        if end_time < at < math.inf:
            notice(
                f"{log.name}: its last event is at {duration_text(end_time)}; this is the state after it"
            )
        if asperity is not None:
            from historysim.asperities.asperity import reversal_table, summary
            from historysim.asperities.asperity_set import require_asperities
            from historysim.results.plots.tractions import AsperityPicture

            selected = require_asperities(events.ensemble).asperity(asperity, contact)
            picture = AsperityPicture()
            outputs = [(path, lambda: save(picture.figure(selected), files[0])) for path in files]
            write_answer(summary(selected), [reversal_table(selected)], outputs=outputs)
            return

        def write() -> None:
            with replacing(files[0]) as unfinished:
                events.state_dataset(at=at).to_netcdf(unfinished)

        lines = [
            (name.replace("_", " "), quantity_text(getattr(contact, name), unit))
            for unit, names in TOTALS.items()
            for name in names
        ]
        outputs = [(path, write) for path in files]
        write_answer(lines, data=lambda: events.state_dataset(at=at), outputs=outputs)


WAYPOINTS = (
    csv_table("a table of waypoints", "time,normal_load", "time,normal_displacement"),
    signed_format("waypoints of historysim", ".toml", ".inp"),
)


@click.command()
@options.common("file")
@options.output_option(
    "The waypoints (.csv, .toml, or .inp: amplitude tables). [default: FILE's name with _short.csv]"
)
@options.common("json", "force")
def shorten(file: Path, output: Path | None) -> None:
    """Write the waypoints of FILE that its contact still remembers.

    FILE is a log, a result, or a scenario. The waypoints lead an untouched contact into the same
    state: as a table, as [loading] of a scenario, or as amplitude tables for finite elements.
    """
    output = output or file.with_name(f"{file.stem}_short.csv")
    files = check_outputs([file], (output, *WAYPOINTS))
    from historysim.studies.shortest import shortest, write_waypoints
    from historysim.verbs import open as open_any

    content = open_any(file)
    events = shortest(content)
    write_waypoints(events, output)
    write_answer([("waypoints", f"{len(events) // 2:,}")], files=files)


@click.command("log")
@options.common("log")
@click.option(
    "--kind",
    multiple=True,
    help="Only events of this kind: normal_load, friction, …; may be given several times.",
)
@options.quantity_option(
    "--from", "s", help='Only from this time on, as "12.5 s".', default=-math.inf
)
@options.quantity_option("--to", "s", help="Only up to this time.", default=math.inf)
@click.option(
    "--first", "head", type=click.IntRange(0), help="Only the first COUNT events.", metavar="COUNT"
)
@click.option(
    "--last", "tail", type=click.IntRange(0), help="Only the last COUNT events.", metavar="COUNT"
)
@options.common("json")
def list_log(
    log: Path, kind: tuple[str, ...], head: int | None, tail: int | None, **between: float
) -> None:
    """List the events of LOG (NAME.history)."""
    from historysim.loads.event_sequence import time_text
    from historysim.loads.events import EVENTS
    from historysim.log.event_log import EventLog

    for name in kind:
        if name not in EVENTS:
            raise InputError(
                f"--kind {name}: expected one of {', '.join(dict.fromkeys((*EVENTS.own(), *EVENTS)))}"
            )
    with EventLog(log) as events:
        chosen = [
            (number, event)
            for number, event in enumerate(events.events())
            if between["from"] <= event.time <= between["to"] and (not kind or event.name in kind)
        ][:head]
    chosen = chosen if tail is None else chosen[max(len(chosen) - tail, 0) :]
    rows = [("event", "time", "kind", "value")]
    for number, event in chosen:
        unit = "" if event.unit == "1" else f" {event.unit}"
        rows.append((str(number), time_text(event.time), event.name, f"{event.cell}{unit}"))
    write_answer(tables=[rows])
