"""Commands that read or extend a log: verify, state, fork, append, log."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.files import is_log, replacing
from historysim.basics.targets import LOG, PICTURE, RESULT, Output, check_outputs, unmarked
from historysim.basics.wording import counted
from historysim.cli import options
from historysim.cli.ending import Ended
from historysim.cli.output import Answer, notice, save, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.tables import Format


TABLE_OF_EVENTS = unmarked("a table that says who wrote it", ".csv")  # tables of events are written by hand, too
# What is shown of a state, by units.
TOTALS = {
    "N": ("normal_load", "tangential_load"),
    "m": ("approach", "tangential_displacement"),
    "J": ("dissipated_energy", "stored_energy"),
}


@click.command()
@options.file_argument
@options.path_option("--log", help="The log of a result. [default: NAME.history beside it]")
@options.quiet_option
@options.json_option
def verify(file: Path, log: Path | None, quiet: bool, as_json: bool) -> None:
    """Replay the log and check that the result is bit-identical.

    FILE is a result, or a log, which is checked with its snapshots.
    """
    from historysim.log.verification import verify as check

    verification = check(file, log, progress=not quiet, notify=notice)
    differences = "\n".join(f"  {difference.text}" for difference in verification.differences)
    if not verification:
        raise Ended(f"{file}: is not what its log gives:\n{differences}", code=1)
    if is_log(file):
        lines = [
            ("events", f"{verification.events:,}, sound"),
            ("snapshots", f"{verification.snapshots:,}, as replayed"),
            ("digest", verification.digest),
        ]
    elif verification.differences:
        lines = [(str(file), f"is what its log gives, up to rounding elsewhere:\n{differences}")]
    else:
        lines = [(str(file), "is what its log gives, bit for bit")]
    if not quiet:
        write_answer(Answer(lines), as_json=as_json)


@click.command()
@options.log_argument
@click.option(
    "--at", type=options.QuantityType("s"), default=math.inf, help='The time, as "12.5 s". [default: the end]'
)
@click.option("--asperity", type=int, help="Show this asperity: its state, its reversal points.")
@options.output_option("Write all asperities (netCDF); with --asperity a picture.")
@options.json_option
@options.force_option
def state(log: Path, at: float, asperity: int | None, output: Path | None, as_json: bool, force: bool) -> None:
    """Show the state of the contact at a time in LOG (NAME.history)."""
    if output is not None:
        check_outputs([Output(output, (RESULT if asperity is None else PICTURE,))], [log], force=force)
    from historysim.basics.units import duration_text, quantity_text
    from historysim.log.event_log import EventLog

    with EventLog(log) as events:
        ensemble_state = events.state(at=at, notify=notice)
        last = events.events(len(events) - 1)[0].time if len(events) else math.inf
        if last < at < math.inf:
            notice(f"{log.name}: its last event is at {duration_text(last)}; this is the state that it left")
        if asperity is not None:
            from historysim.asperities.asperity import reversal_table, summary
            from historysim.results.plots.tractions import AsperityPicture

            one = events.ensemble.asperity(asperity, ensemble_state)
            if output is not None:
                save(AsperityPicture().figure(one), output)
            answer = Answer(summary(one), [reversal_table(one)])
        else:
            if output is not None:
                with replacing(output) as unfinished:
                    events.state_dataset(at=at).to_netcdf(unfinished)
            lines = [
                (name.replace("_", " "), quantity_text(getattr(ensemble_state, name), unit))
                for unit, names in TOTALS.items()
                for name in names
            ]
            answer = Answer(lines, data=lambda: events.state_dataset(at=at))
        write_answer(answer._replace(files=[] if output is None else [output]), as_json=as_json)


@click.command()
@options.log_argument
@click.option("--at", type=options.QuantityType("s"), required=True, help='The time, as "12.5 s".')
@options.output_option("The new log.", required=True)
@options.force_option
def fork(log: Path, at: float, output: Path, force: bool) -> None:
    """Copy the past of LOG (NAME.history) up to a time to a new log."""
    check_outputs([Output(output, (LOG,))], [log], force=force)
    from historysim.log.event_log import EventLog

    with EventLog(log) as events, events.fork(at, output, notify=notice) as made:
        click.echo(f"{output}: {counted(len(made), 'event', 'events')}")


@click.command()
@options.log_argument
@click.argument("table", type=options.path_type)
@options.text_options
def append(log: Path, table: Path, layout: "Format") -> None:
    """Append the events in TABLE (CSV) to LOG (NAME.history).

    The table has a header line: time, and one or more of normal_load, normal_displacement, tangential_load,
    tangential_displacement, friction. Numbers are SI, or have a unit beside them or beside the name of their column;
    an empty cell is no event.
    """
    from historysim.loads.event_table import read_events
    from historysim.log.event_log import EventLog

    with EventLog(log) as events:
        new = read_events(table, layout)
        try:
            events.append(new)
        except InputError as error:
            raise InputError(f"{table}: {error}") from error
        click.echo(f"{log}: {counted(len(new), 'event', 'events')} appended, {len(events):,} in all")


@click.command("log")
@click.argument("file", metavar="LOG", type=options.path_type)
@click.option(
    "--kind", multiple=True, help="Only events of this kind: normal_load, friction, …; may be given several times."
)
@click.option(
    "--from", "begin", type=options.QuantityType("s"), default=-math.inf, help='Only from this time on, as "12.5 s".'
)
@click.option("--to", "end", type=options.QuantityType("s"), default=math.inf, help="Only up to this time.")
@click.option("--first", type=click.IntRange(0), help="Only the first COUNT events.", metavar="COUNT")
@click.option("--last", type=click.IntRange(0), help="Only the last COUNT events.", metavar="COUNT")
@options.path_option("--csv", "table", help="Write them to this file instead, a table that append reads.")
@options.json_option
@options.force_option
def list_log(
    file: Path,
    kind: tuple[str, ...],
    begin: float,
    end: float,
    first: int | None,
    last: int | None,
    table: Path | None,
    as_json: bool,
    force: bool,
) -> None:
    """List the events of LOG (NAME.history)."""
    if table is not None:
        check_outputs([Output(table, (TABLE_OF_EVENTS,))], [file], force=force)
    from historysim.loads.event_sequence import time_text
    from historysim.loads.event_table import write_events
    from historysim.loads.events import EVENTS
    from historysim.log.event_log import EventLog

    for name in kind:
        if name not in EVENTS:
            raise InputError(f"--kind {name}: expected one of {', '.join(dict.fromkeys((*EVENTS.own(), *EVENTS)))}")
    with EventLog(file) as log:
        chosen = [
            (number, event)
            for number, event in enumerate(log.events())
            if begin <= event.time <= end and (not kind or event.name in kind)
        ]
    chosen = chosen[:first]
    chosen = chosen if last is None else chosen[max(len(chosen) - last, 0) :]
    if table is not None:
        write_events(table, [event for _, event in chosen])
        click.echo(f"{table}: {counted(len(chosen), 'event', 'events')}")
        return
    rows = [("event", "time", "kind", "value")]
    for number, event in chosen:
        unit = "" if event.unit == "1" else f" {event.unit}"
        rows.append((str(number), time_text(event.time), event.name, f"{event.cell}{unit}"))
    write_answer(Answer(tables=[rows]), as_json=as_json)
