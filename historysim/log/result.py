"""Write the result of a log to a netCDF file; snapshots in the log record which rows are written.

A snapshot is a state from which a replay can start. It saves time, and is never needed.
"""

import hashlib
import json
import sys
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim._version import __version__
from historysim.basics.fields import choice
from historysim.basics.files import replacing, write_errors
from historysim.basics.hdf5 import check_contained
from historysim.basics.system import log_message, resolve_threads
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError, LoadError
from historysim.loads.event_sequence import time_text
from historysim.loads.schedule import Cursor, Start, make_cursor
from historysim.log import embedded_log
from historysim.log.file import ENDING, Content, LogFile
from historysim.recording import surface_group
from historysim.recording.netcdf import COMPRESSIONS, FileRecorder, Unfinished
from historysim.recording.provenance import find_bounds
from historysim.replaying import Replay

if TYPE_CHECKING:
    import netCDF4

    from historysim.asperities.state import State


LARGE = 200e6  # bytes of a result from which its size is announced
# Asperities times rows between snapshots by default, and the most rows: some seconds of replay.
SNAPSHOT_CELLS, MOST_SNAPSHOT_ROWS = 1 << 26, 1 << 16
SNAPSHOT_BYTES = 1 << 30  # of all snapshots of a run by default; larger states are further apart


def log_path_for(output: Path) -> Path:
    """Return the log path of a result; InputError if both are the same, or the result has no file name."""
    if not output.name:
        raise InputError(f"{output}: is a folder; expected the name of a file to write")
    log_path = output.with_suffix(ENDING)
    if log_path == output:
        raise InputError(
            f"{output}: is the name of a log; expected another ending for the result, such as .nc"
        )
    return log_path


def _check_interval(_: object, __: "attrs.Attribute[int | None]", value: int | None) -> None:
    if value is not None and not (isinstance(value, int) and value >= 1):
        raise InputError(f"snapshot_every is {value!r}; expected a whole number of 1 or more")


@attrs.frozen
class RunOptions:
    """Options of `historysim.run` that control replay and output."""

    progress: bool = False
    resume: bool = False
    snapshot_every: int | None = attrs.field(default=None, validator=_check_interval)
    compression: str = attrs.field(default="none", validator=choice(*COMPRESSIONS))
    threads: int | None = attrs.field(default=None, converter=resolve_threads)
    force: bool = False
    notify: Notify = silent
    record: str | None = attrs.field(
        default=None, validator=attrs.validators.optional(choice("totals"))
    )
    cluster: str | None = None

    def apply_record(self, job: Replay) -> Replay:
        """Return the replay with the variables that the options select for recording."""
        return job if self.record is None else attrs.evolve(job, record=self.record)


@attrs.define
class _Spacing:
    """Rows between snapshots: the chosen number, or one that limits the total size of the snapshots of a run."""

    chosen: int | None
    steps: int  #: of the run
    rows: int = attrs.field(init=False)

    @classmethod
    def from_options(cls, options: RunOptions, job: Replay) -> "_Spacing":
        """Return the spacing at the start of a run."""
        spacing = cls(options.snapshot_every, job.steps())
        spacing.rows = spacing.chosen or max(
            1, min(MOST_SNAPSHOT_ROWS, SNAPSHOT_CELLS // len(job.ensemble))
        )
        return spacing

    def widen(self, size: int) -> None:
        """Consider the size of a snapshot [bytes]."""
        if self.chosen is None:
            self.rows = max(self.rows, -(-size * self.steps // SNAPSHOT_BYTES))


def write_result(file: LogFile, output: Path, options: RunOptions) -> None:
    """Replay a log, open for writing, into a result, which gets its name when it is complete.

    Snapshots of the state are inserted into the log. An OSError or a KeyboardInterrupt states the
    saved rows.
    """
    head, content = file.head, file.sound()
    if not content.events:
        raise InputError(
            f"{file.path}: holds no events yet; expected at least one: EventLog.append adds them"
        )
    job = options.apply_record(head.replay(content.events, options.threads))
    link = digest_attribute(content.links[-1])
    log_message(__name__, "info", "%s: %r", file.path, job)

    def write_groups(into: "netCDF4.Dataset") -> None:
        if head.surface:
            surface_group.write(into, head.surface, head.settings["surface_attributes"])
        embedded_log.write(into, head, content)

    with (
        Unfinished(output) as unfinished,
        _explain_interruption(file.path, unfinished, job.steps()),
        write_errors(output, unfinished.path),
    ):
        start, written = Start(head.ensemble.initial_state()), ""
        if options.resume:
            if _is_result_of(output, link, job):
                return
            written = _identify_unfinished(unfinished.path, link, job)
            start = _last_snapshot(file, content, written, options.notify)
            if not start.rows:
                unfinished.renew()
        unfinished.saved_rows = start.rows
        date_created = current_time_text()
        attributes = job.attributes() | head.attributes | link | {"date_created": date_created}
        make_recorder = partial(
            job.recorder,
            FileRecorder,
            attributes=attributes,
            write_groups=write_groups,
            bounds=find_bounds(job),
        )
        with make_recorder(path=unfinished.path, go_on=start.rows) as target:
            if target.size > LARGE and options.compression == "none":
                options.notify(_size_notice(output, target))
            spacing = _Spacing.from_options(options, job)
            at_once = spacing.rows
            rows = written if start.rows else f"{unfinished.path.name} {date_created}"

            def save_snapshot(cursor: Cursor, state: "State") -> None:
                if (
                    cursor.rows - unfinished.saved_rows < spacing.rows
                    or cursor.rows == target.steps
                ):
                    return
                # rows before the snapshot, which states that they are on the disk
                target.flush()
                spacing.widen(add_snapshot(file, content, cursor, state, rows))
                log_message(
                    __name__,
                    "debug",
                    "%s: snapshot after %d of %d steps",
                    file.path,
                    cursor.rows,
                    target.steps,
                )
                unfinished.saved_rows = cursor.rows

            job.walk(
                target,
                start=start,
                most_rows=at_once,
                progress=options.progress,
                on_event=save_snapshot,
            )
            target.finish(progress=options.progress)
        if options.compression == "none":
            unfinished.publish()
        else:
            with (
                replacing(output) as smaller,
                make_recorder(path=smaller, compression=options.compression) as target,
            ):
                target.copy_rows(unfinished.path)
                target.finish()
        log_message(__name__, "info", "%s: written, %d bytes", output, output.stat().st_size)


def current_time_text() -> str:
    """Return the current time in the format of result attributes."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


@contextmanager
def _explain_interruption(log: Path, unfinished: Unfinished, steps: int) -> Iterator[None]:
    """Add the saved rows and the option to resume to the error that ends a replay."""
    try:
        yield
    except (LoadError, InputError):
        # a resumed run would fail in the same way
        unfinished.saved_rows = 0
        raise
    except KeyboardInterrupt as error:
        saved = unfinished.saved_rows
        rows = (
            f"the first {saved:,} of {steps:,} steps" if saved else f"none of {steps:,} steps yet"
        )
        raise KeyboardInterrupt(
            f"interrupted; {log} keeps the events and {rows}; the same run with --resume (resume=True) continues "
            "from there"
        ) from error
    except OSError as error:
        if error.filename not in {None, str(unfinished.output)}:
            raise
        message = f"{(error.strerror or '').removesuffix('; make room')}; make room, then continue with --resume"
        raise OSError(error.errno, message, str(unfinished.output)) from error


def _identify_unfinished(unfinished: Path, link: Mapping[str, str], job: Replay) -> str:
    """Return the label of an unfinished file in snapshots; empty if the file belongs to another log."""
    date_created = _read_attribute(unfinished, link, job, "date_created")
    return f"{unfinished.name} {date_created}" if date_created else ""


def _is_result_of(output: Path, link: Mapping[str, str], job: Replay) -> bool:
    """Return whether a complete result of the current log exists already."""
    with suppress(InputError):
        check_contained(output)
        return bool(_read_attribute(output, link, job, "complete"))
    return False


def _read_attribute(path: Path, link: Mapping[str, str], job: Replay, name: str) -> Any:  # noqa: ANN401 - of any type
    """Return an attribute of a netCDF file; None if it is of another log or selection, or cannot be read."""
    import netCDF4

    with suppress(OSError, RuntimeError, AttributeError), netCDF4.Dataset(path) as file:
        has_asperities = "asperity" in file.dimensions
        if file.getncattr("log_digest") == link["log_digest"] and has_asperities == (
            job.asperities is not None
        ):
            return file.getncattr(name)
    return None


def _size_notice(output: Path, target: FileRecorder) -> str:
    """Return the notice on the size of a large result and the options that reduce it."""
    asperity_text = "" if target.asperities is None else f" and {target.columns:,} asperities"
    fewer = (
        ""
        if target.asperities is None
        else 'fewer asperities (record.asperities, "totals" for none), '
    )
    return (
        f"{output}: will take {target.size / 1e6:,.0f} MB, for {target.steps:,} steps{asperity_text}; {fewer}fewer "
        "substeps or --compression make it smaller"
    )


def digest_attribute(link: bytes) -> dict[str, str]:
    """Return the attributes of a result that identify its log by the last link of its chain."""
    digest = f"sha256:{link.hex()}"
    return {"log_digest": digest, "id": digest}


# -- snapshots -------------------------------------------------------------------------------------


def add_snapshot(
    file: LogFile, content: Content, cursor: Cursor, state: "State", written: str = ""
) -> int:
    """Insert the state at a place of a replay into its log, and return its size in bytes.

    ``written`` names the file with the rows before.
    It depends on all batches with events that are done or in progress, so it stores the link of the
    last of them.
    """
    batches = bisect_left(
        content.ends, max(cursor.events, *(index + 1 for index in cursor.heading))
    )
    about = attrs.asdict(cursor) | {
        "batches": batches,
        "program": program(file.head.ensemble.packages),
    }
    text = json.dumps(about | ({"written": written} if written else {}))
    link, retained = content.links[batches], state.to_bytes()
    row = (cursor.events, text, link, retained, _digest(text, link, retained))
    file.insert(
        "INSERT INTO snapshot (events, about, link, state, digest) VALUES (?, ?, ?, ?, ?)", row
    )
    return len(retained)


def snapshots(
    file: LogFile,
    content: Content,
    notify: Notify = silent,
    *,
    written: str | None = None,
    events: range | None = None,
) -> Iterator[Start]:
    """Yield the starts of a replay that snapshots of a log provide, latest first.

    `written` selects snapshots whose rows are in the file of that name, `events` snapshots after
    these numbers of events. `notify` gets each reason to pass some over.
    """
    reasons: set[str] = set()
    # one query for each, since states may be large, and any may be damaged
    for (number,) in _numbers(file, notify, events):
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


def _numbers(file: LogFile, notify: Notify, events: range | None) -> list[tuple[int]]:
    first_events, end_events = (
        (events.start, events.stop) if events is not None else (0, sys.maxsize)
    )
    try:
        return file.rows(
            "SELECT number FROM snapshot WHERE events >= ? AND events < ? ORDER BY events DESC",
            first_events,
            end_events,
        )
    except InputError as error:
        notify(f"the snapshots cannot be read ({error})")
        return []


def _start(
    file: LogFile, content: Content, about: dict[str, Any] | None, link: bytes, state: bytes
) -> Start | str:
    """Return the start of a replay from a snapshot, or the reason why it cannot be used."""
    if about is None:
        return "is damaged (it does not match its digest)"
    this_program, ensemble = program(file.head.ensemble.packages), file.head.ensemble
    if not 0 < about["batches"] < len(content.links) or content.links[about["batches"]] != link:
        return "is of another log"
    if about["program"] != this_program:
        return f"was made by {about['program']}; this is {this_program}"
    cursor = Cursor(about["events"], about["rows"], about["time"], tuple(about["heading"]))
    if make_cursor(content.events, cursor.events, file.head.substeps) != cursor:
        return f"at t = {time_text(cursor.time)} was made before events were appended"
    return Start(ensemble.state_from_bytes(state), cursor)


def start_before(
    file: LogFile,
    content: Content,
    time: float,
    notify: Notify = silent,
    *,
    latest: Start | None = None,
) -> Start:
    """Return the latest start of a replay up to a time [s]: a snapshot, or the known start `latest`."""
    first_events = (
        latest.cursor.events + 1 if latest is not None and latest.cursor is not None else 1
    )
    done = bisect_right(content.events, time, key=attrgetter("time"))
    candidates = snapshots(file, content, notify, events=range(first_events, done + 1))
    start = next(
        (start for start in candidates if start.cursor and start.cursor.time <= time), latest
    )
    return start or Start(file.head.ensemble.initial_state())


def _last_snapshot(file: LogFile, content: Content, written: str, notify: Notify) -> Start:
    """Return the last snapshot with its rows in the unfinished file of this name, or the beginning."""
    start = next(snapshots(file, content, notify, written=written), None) if written else None
    if start is None or start.cursor is None:
        notify(f"{file.path}: has no snapshot with its rows; the replay starts at the beginning")
        return Start(file.head.ensemble.initial_state())
    notify(
        f"{file.path}: continuing from t = {time_text(start.cursor.time)}, after {start.rows:,} rows"
    )
    return start


def program(packages: Iterable[str] = ()) -> str:
    """Return the versions that determine the bits of states; the machine has no influence."""
    return ", ".join((f"historysim {__version__}", *packages))


def _digest(text: str, link: bytes, state: bytes) -> bytes:
    return hashlib.sha256(link + hashlib.sha256(text.encode()).digest() + state).digest()
