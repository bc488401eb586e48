"""The result of a log: its rows go to their place in a netCDF file; snapshots in the log say which of them stand.

A snapshot is a state beside the events, from which a replay can begin: a shortcut, never a truth.
"""

import hashlib
import json
import logging
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim._version import __version__
from historysim.basics.fields import one_of
from historysim.basics.files import replacing, write_errors
from historysim.basics.hdf5 import check_contained
from historysim.basics.system import resolve_threads
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError, LoadError
from historysim.loads.event_sequence import time_text
from historysim.loads.schedule import Cursor, Start, cursor_at
from historysim.log import embedded_log
from historysim.log.file import ENDING, Content, LogFile
from historysim.recording import surface_group
from historysim.recording.netcdf import COMPRESSIONS, FileRecorder, Unfinished

if TYPE_CHECKING:
    import netCDF4

    from historysim.asperities.state import State

logger = logging.getLogger(__name__)

LARGE = 200e6  # bytes of a result from which its size is announced
# Asperities times rows between snapshots by default, and the most rows: some seconds of replay.
SNAPSHOT_CELLS, MOST_SNAPSHOT_ROWS = 1 << 26, 1 << 16


def log_beside(output: Path) -> Path:
    """Return the place of the log of a result; an InputError where that is the result itself, or there is no name."""
    if not output.name:
        raise InputError(f"{output}: is a folder; expected the name of a file to write")
    beside = output.with_suffix(ENDING)
    if beside == output:
        raise InputError(f"{output}: is the name of a log; expected another ending for the result, such as .nc")
    return beside


def _check_interval(_: object, __: "attrs.Attribute[int | None]", value: int | None) -> None:
    if value is not None and not (isinstance(value, int) and value >= 1):
        raise InputError(f"snapshot_every is {value!r}; expected a whole number of 1 or more")


@attrs.frozen
class RunOptions:
    """How a history is replayed and written: the options of `historysim.run`."""

    progress: bool = False
    resume: bool = False
    snapshot_every: int | None = attrs.field(default=None, validator=_check_interval)
    compression: str = attrs.field(default="none", validator=one_of(*COMPRESSIONS))
    threads: int | None = attrs.field(default=None, converter=resolve_threads)
    force: bool = False
    notify: Notify = silent


def write_result(file: LogFile, output: Path, options: RunOptions) -> None:
    """Replay a log, open to write, into a result, which appears under its name when it is complete.

    Snapshots of the state are put beside the events of the log. An OSError and a KeyboardInterrupt say what is kept.
    """
    head, content = file.head, file.sound()
    if not content.events:
        raise InputError(f"{file.path}: holds no events yet; expected at least one: EventLog.append adds them")
    job, link = head.replay(content.events, options.threads), digest_attribute(content.links[-1])
    logger.info("%s: %r", file.path, job)

    def write_beside(into: "netCDF4.Dataset") -> None:
        if head.surface:
            surface_group.write(into, head.surface, head.settings["surface_attributes"])
        embedded_log.write(into, head, content)

    with (
        Unfinished(output) as unfinished,
        _explained(file.path, unfinished, job.steps()),
        write_errors(output, unfinished.path),
    ):
        start, written = Start(head.ensemble.initial_state()), ""
        if options.resume:
            if _is_result_of(output, link):
                return
            written = _name_of(unfinished.path, link)
            start = _last_snapshot(file, content, written, options.notify)
            if not start.rows:
                unfinished.renew()
        unfinished.kept = start.rows
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        attributes = job.attributes() | head.attributes | link | {"date_created": now}
        made = partial(job.recorder, FileRecorder, attributes=attributes, beside=write_beside)
        with made(path=unfinished.path, go_on=start.rows) as target:
            if target.size > LARGE and options.compression == "none":
                options.notify(_size_notice(output, target))
            every = options.snapshot_every or max(1, min(MOST_SNAPSHOT_ROWS, SNAPSHOT_CELLS // len(head.ensemble)))
            rows = written if start.rows else f"{unfinished.path.name} {now}"

            def after(cursor: Cursor, state: "State") -> None:
                if cursor.rows - unfinished.kept < every or cursor.rows == target.steps:
                    return
                # first the rows, then the snapshot that says that they stand
                target.flush()
                add_snapshot(file, content, cursor, state, rows)
                logger.debug("%s: snapshot after %d of %d steps", file.path, cursor.rows, target.steps)
                unfinished.kept = cursor.rows

            job.walk(target, start=start, most_rows=every, progress=options.progress, after=after)
            target.finish()
        if options.compression == "none":
            unfinished.publish()
        else:
            with replacing(output) as smaller, made(path=smaller, compression=options.compression) as target:
                target.copy_rows(unfinished.path)
                target.finish()
        logger.info("%s: written, %d bytes", output, output.stat().st_size)


@contextmanager
def _explained(log: Path, unfinished: Unfinished, steps: int) -> Iterator[None]:
    """Say of what ends a replay what is kept, and how to go on."""
    try:
        yield
    except (LoadError, InputError):
        # going on would end in the same way
        unfinished.kept = 0
        raise
    except KeyboardInterrupt as error:
        kept = unfinished.kept
        rows = f"the first {kept:,} of {steps:,} steps" if kept else f"none of {steps:,} steps yet"
        raise KeyboardInterrupt(
            f"interrupted; {log} keeps the events and {rows}; the same run with --resume (resume=True) goes on there"
        ) from error
    except OSError as error:
        if error.filename not in {None, str(unfinished.output)}:
            raise
        message = f"{(error.strerror or '').removesuffix('; make room')}; make room, then go on with --resume"
        raise OSError(error.errno, message, str(unfinished.output)) from error


def _name_of(unfinished: Path, link: Mapping[str, str]) -> str:
    """Return what snapshots call the rows of an unfinished file; empty where it is none of this log."""
    made = _attribute_of(unfinished, link, "date_created")
    return f"{unfinished.name} {made}" if made else ""


def _is_result_of(output: Path, link: Mapping[str, str]) -> bool:
    """Return whether a complete result of a log, as it is now, is there already."""
    with suppress(InputError):
        check_contained(output)
        return bool(_attribute_of(output, link, "complete"))
    return False


def _attribute_of(path: Path, link: Mapping[str, str], name: str) -> Any:  # noqa: ANN401 - as it stands there
    """Return an attribute of a netCDF file of a log; None where it is of another one, or cannot be read."""
    import netCDF4

    with suppress(OSError, RuntimeError, AttributeError), netCDF4.Dataset(path) as file:
        return file.getncattr(name) if file.getncattr("log_digest") == link["log_digest"] else None
    return None


def _size_notice(output: Path, target: FileRecorder) -> str:
    """Return how large a result will be, and what makes it smaller."""
    own = "" if target.asperities is None else f" and {target.columns:,} asperities"
    fewer = "" if target.asperities is None else 'fewer asperities (record.asperities, "totals" for none), '
    return (
        f"{output}: will take {target.size / 1e6:,.0f} MB, for {target.steps:,} steps{own}; {fewer}fewer substeps or "
        "--compression make it smaller"
    )


def digest_attribute(link: bytes) -> dict[str, str]:
    """Return the attributes of a result that say which log it belongs to, by the last link of its chain."""
    digest = f"sha256:{link.hex()}"
    return {"log_digest": digest, "id": digest}


# -- snapshots -------------------------------------------------------------------------------------


def add_snapshot(file: LogFile, content: Content, cursor: Cursor, state: "State", written: str = "") -> None:
    """Put the state where a replay stands beside the events of a log; ``written`` names the file with the rows before.

    It depends on all batches with events that are done or ahead, so the link of the last of them stands with it.
    """
    batches = bisect_left(content.ends, max(cursor.events, *(index + 1 for index in cursor.heading)))
    about = attrs.asdict(cursor) | {"batches": batches, "program": program(file.head.ensemble.packages)}
    text = json.dumps(about | ({"written": written} if written else {}))
    link, kept = content.links[batches], state.to_bytes()
    row = (cursor.events, text, link, kept, _digest(text, link, kept))
    file.insert("INSERT INTO snapshot (events, about, link, state, digest) VALUES (?, ?, ?, ?, ?)", row)


def snapshots(
    file: LogFile, content: Content, notify: Notify = silent, *, written: str | None = None
) -> Iterator[Start]:
    """Yield where the snapshots of a log let a replay begin, the latest first.

    With `written`, only those with their rows in the file of that name. `notify` gets each reason to pass some over.
    """
    reasons: set[str] = set()
    # one at a time, since states may be large, and each may be damaged
    for (number,) in _numbers(file, notify):
        try:
            ((text, link, state, digest),) = file.rows(
                "SELECT about, link, state, digest FROM snapshot WHERE number = ?", number
            )
            about = json.loads(text) if _digest(text, link, state) == digest else None
            if about is not None and written not in {None, about.get("written", "")}:
                continue
            start = _start(file, content, about, link, state)
        except (InputError, ValueError, KeyError, TypeError, AttributeError) as error:
            start = f"is damaged ({error})"
        if isinstance(start, Start):
            yield start
        elif start not in reasons:
            notify(f"{file.path}: a snapshot {start}; it is passed over")
            reasons.add(start)


def _numbers(file: LogFile, notify: Notify) -> list[tuple[int]]:
    try:
        return file.rows("SELECT number FROM snapshot ORDER BY events DESC")
    except InputError as error:
        notify(f"the snapshots cannot be read ({error})")
        return []


def _start(file: LogFile, content: Content, about: dict[str, Any] | None, link: bytes, state: bytes) -> Start | str:
    """Return where a snapshot lets a replay begin, or why it does not."""
    if about is None:
        return "is damaged (it does not match its digest)"
    here, ensemble = program(file.head.ensemble.packages), file.head.ensemble
    if not 0 < about["batches"] < len(content.links) or content.links[about["batches"]] != link:
        return "is of another log"
    if about["program"] != here:
        return f"was made by {about['program']}; this is {here}"
    cursor = Cursor(about["events"], about["rows"], about["time"], tuple(about["heading"]))
    if cursor_at(content.events, cursor.events, file.head.substeps) != cursor:
        return f"at t = {time_text(cursor.time)} was made before events were appended"
    return Start(ensemble.state_from(state), cursor)


def start_before(file: LogFile, content: Content, time: float, notify: Notify = silent) -> Start:
    """Return the latest place up to a time [s] where a replay can begin."""
    found = (start for start in snapshots(file, content, notify) if start.cursor and start.cursor.time <= time)
    return next(found, None) or Start(file.head.ensemble.initial_state())


def _last_snapshot(file: LogFile, content: Content, written: str, notify: Notify) -> Start:
    """Return the last snapshot with its rows in the unfinished file of this name, or the beginning."""
    start = next(snapshots(file, content, notify, written=written), None) if written else None
    if start is None or start.cursor is None:
        notify(f"{file.path}: has no snapshot with its rows; the replay starts at the beginning")
        return Start(file.head.ensemble.initial_state())
    notify(f"{file.path}: going on from t = {time_text(start.cursor.time)}, after {start.rows:,} rows")
    return start


def program(packages: Iterable[str] = ()) -> str:
    """Return what computes states here: another version may give other bits; another machine does not."""
    return ", ".join((f"historysim {__version__}", *packages))


def _digest(text: str, link: bytes, state: bytes) -> bytes:
    return hashlib.sha256(link + hashlib.sha256(text.encode()).digest() + state).digest()
