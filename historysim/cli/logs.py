"""Commands that ask a log: verify, state, fork, append, log."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.files import is_log, replacing
from historysim.basics.targets import LOG, PICTURE, RESULT, Output, check_outputs, unmarked
from historysim.basics.wording import counted
from historysim.cli.ending import NotPossible
from historysim.cli.options import force_option, json_option, path_type, quantity_option, text_options
from historysim.cli.output import Answer, notice, save, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.tables import Format


TABLE_OF_EVENTS = unmarked("a table that says who wrote it", ".csv")
"""Tables of events are written by hand, too."""


@click.command()
@click.argument("file", type=path_type)
@click.option("--log", type=path_type, help="The log of a result. [default: NAME.history beside it]")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing if all is well.")
@json_option
def verify(file: Path, log: Path | None, quiet: bool, as_json: bool) -> None:
    """Replay the log and check that the result is bit-identical.

    FILE is a result, whose log is replayed, or a log, which is checked with its snapshots.
    """
    from historysim.log.verification import verify as check

    verification = check(file, log, progress=not quiet, notify=notice)
    differences = "\n".join(f"  {difference.text}" for difference in verification.differences)
    if not verification:
        raise NotPossible(f"{file}: is not what its log gives:\n{differences}")
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
@click.argument("log", type=path_type)
@click.option("--at", "moment", help='The time, as "12.5 s" or in s. [default: the end]')
@click.option("--asperity", type=int, help="Show this asperity: its state, its reversal points.")
@click.option("-o", "--output", type=path_type, help="Write all asperities (netCDF); with --asperity a picture.")
@json_option
@force_option
def state(log: Path, moment: str | None, asperity: int | None, output: Path | None, as_json: bool, force: bool) -> None:
    """Show the state at a time in LOG (NAME.history)."""
    if output is not None:
        check_outputs([Output(output, (RESULT if asperity is None else PICTURE,))], [log], force=force)
    from historysim.basics.units import duration_text, quantity_text
    from historysim.log.event_log import EventLog

    with EventLog(log) as events:
        time = math.inf if moment is None else quantity_option("--at", moment, "s")
        ensemble_state = events.state(at=time, notify=notice)
        last = events.events(len(events) - 1)[0].time if len(events) else math.inf
        if last < time < math.inf:
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
                    events.state_dataset(at=time).to_netcdf(unfinished)
            answer = Answer(
                [
                    ("normal load", quantity_text(ensemble_state.normal_load, "N")),
                    ("tangential load", quantity_text(ensemble_state.tangential_load, "N")),
                    ("approach", quantity_text(ensemble_state.approach, "m")),
                    ("tangential displacement", quantity_text(ensemble_state.tangential_displacement, "m")),
                    ("dissipated energy", quantity_text(ensemble_state.dissipated_energy, "J")),
                    ("stored energy", quantity_text(ensemble_state.stored_energy, "J")),
                ],
                data=lambda: events.state_dataset(at=time),
            )
        write_answer(answer._replace(files=[] if output is None else [output]), as_json=as_json)


@click.command()
@click.argument("log", type=path_type)
@click.option("--at", "moment", required=True, help='The time, as "12.5 s" or in s.')
@click.option("-o", "--output", type=path_type, required=True, help="The new log.")
@force_option
def fork(log: Path, moment: str, output: Path, force: bool) -> None:
    """Copy the past of LOG (NAME.history) up to a time to a new log."""
    check_outputs([Output(output, (LOG,))], [log], force=force)
    from historysim.log.event_log import EventLog

    with EventLog(log) as events, events.fork(quantity_option("--at", moment, "s"), output, notify=notice) as made:
        click.echo(f"{output}: {counted(len(made), 'event', 'events')}")


@click.command()
@click.argument("log", type=path_type)
@click.argument("table", type=path_type)
@text_options
def append(log: Path, table: Path, layout: "Format") -> None:
    """Append the events in TABLE, a text, to LOG (NAME.history).

    The table has a header line: time, and one or more of normal_load, normal_displacement, tangential_load,
    tangential_displacement, friction. Numbers are SI, or have a unit beside them or beside the name of their column;
    where nothing stands, there is no event.
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
@click.argument("file", metavar="LOG", type=path_type)
@click.option(
    "--kind", multiple=True, help="Only events of this kind: normal_load, friction, …; may be given several times."
)
@click.option("--from", "begin", help='Only from this time on, as "12.5 s" or in s.')
@click.option("--to", "end", help="Only up to this time.")
@click.option("--first", type=click.IntRange(0), help="Only so many, the first ones.")
@click.option("--last", type=click.IntRange(0), help="Only so many, the last ones.")
@click.option("--csv", "table", type=path_type, help="Write them to this file instead, a table that append reads.")
@json_option
@force_option
def list_log(
    file: Path,
    kind: tuple[str, ...],
    begin: str | None,
    end: str | None,
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
    start, stop = quantity_option("--from", begin or "-inf", "s"), quantity_option("--to", end or "inf", "s")
    with EventLog(file) as log:
        chosen = [
            (number, event)
            for number, event in enumerate(log.events())
            if start <= event.time <= stop and (not kind or event.name in kind)
        ]
    chosen = chosen[: len(chosen) if first is None else first]
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
