"""The result of a log: its rows go to their place in a netCDF file; snapshots in the log say which of them stand."""

import logging
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs

from historysim.basics.files import replacing
from historysim.basics.hdf5 import check_contained
from historysim.basics.system import threads_of
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError, LoadError
from historysim.loads.event_sequence import time_text
from historysim.loads.schedule import Cursor, Start
from historysim.log import embedded_log
from historysim.log.database import ENDING
from historysim.log.file import Content, LogFile
from historysim.log.header import LogHeader
from historysim.log.snapshot import Snapshot, add_snapshot, program, start_before
from historysim.recording import surface_group
from historysim.recording.netcdf import FileRecorder, Unfinished, check_compression

if TYPE_CHECKING:
    import netCDF4

    from historysim.asperities.state import EnsembleState

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
    compression: str = attrs.field(default="none", validator=lambda *each: check_compression(each[-1]))
    threads: int | None = attrs.field(default=None, converter=threads_of)
    force: bool = False
    notify: Notify = silent


def write_result(file: LogFile, output: Path, options: RunOptions) -> None:
    """Replay a log, open to write, into a result, which appears under its name when it is complete.

    Snapshots of the state are put beside the events of the log.

    Raises
    ------
    InputError, LoadError
        The log is damaged, or holds no events; a load that the contact cannot carry.
    OSError, KeyboardInterrupt
        ``output`` cannot be written; the user has stopped it. The message says what is kept.
    """
    head, content, notify = file.head, file.sound(), options.notify
    if not content.events:
        raise InputError(f"{file.path}: holds no events yet; expected at least one: historysim append adds them")
    job, link = head.replay(content.events, options.threads), digest_attribute(content.links[-1])
    logger.info("%s: %r", file.path, job)
    with Unfinished(output) as unfinished, _explained(file.path, unfinished, job.steps()):
        if options.resume and _is_result_of(output, link):
            return
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        written = _name_of(unfinished.path, link) if options.resume else ""
        start = _start(file, content, written, notify) if options.resume else Start(head.ensemble.initial_state())
        unfinished.kept = start.rows
        if options.resume and not start.rows:
            unfinished.renew()
        made = partial(
            job.recorder,
            FileRecorder,
            attributes=job.attributes() | head.attributes | link | {"date_created": now},
            beside=partial(_write_beside, head=head, content=content),
        )
        with made(path=unfinished.path, go_on=start.rows) as target:
            if target.size > LARGE and options.compression == "none":
                notify(_size_notice(output, target))
            every = options.snapshot_every or max(1, min(MOST_SNAPSHOT_ROWS, SNAPSHOT_CELLS // len(head.ensemble)))
            rows = written if start.rows else f"{unfinished.path.name} {now}"
            after = _Snapshots(file, content, target, unfinished, rows, every)
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
        if error.filename is not None:
            raise
        message = f"{error.strerror}; then go on with --resume"
        raise OSError(error.errno, message, str(unfinished.output)) from error


@final
@attrs.define
class _Snapshots:
    """Puts a snapshot into the log now and then."""

    file: LogFile
    content: Content
    target: FileRecorder
    unfinished: Unfinished
    written: str  #: what the rows before a snapshot are called
    every: int  #: rows between two of them

    def __call__(self, cursor: Cursor, state: "EnsembleState") -> None:
        if cursor.rows - self.unfinished.kept < self.every or cursor.rows == self.target.steps:
            return
        # first the rows, then the snapshot that says that they stand
        self.target.flush()
        ahead = self.content.batches_for(max(cursor.events, *(index + 1 for index in cursor.heading)))
        link, here = self.content.links[ahead], program(self.target.ensemble.packages)
        add_snapshot(self.file, Snapshot(cursor, ahead, link, here, state.to_bytes(), self.written))
        logger.debug("%s: snapshot after %d of %d steps", self.file.path, cursor.rows, self.target.steps)
        self.unfinished.kept = cursor.rows


def _name_of(unfinished: Path, link: Mapping[str, str]) -> str:
    """Return what snapshots call the rows of an unfinished file; empty where it is none of this log."""
    found = _attributes(unfinished, "log_digest", "date_created")
    return f"{unfinished.name} {found['date_created']}" if found.get("log_digest") == link["log_digest"] else ""


def _is_result_of(output: Path, link: Mapping[str, str]) -> bool:
    """Return whether a complete result of a log, as it is now, is there already."""
    with suppress(InputError):
        check_contained(output)
        found = _attributes(output, "log_digest", "complete")
        return found.get("log_digest") == link["log_digest"] and bool(found["complete"])
    return False


def _attributes(path: Path, *names: str) -> dict[str, Any]:
    """Return these attributes of a netCDF file; none where one of them cannot be read."""
    import netCDF4

    try:
        with netCDF4.Dataset(path) as file:
            return {name: file.getncattr(name) for name in names}
    except (OSError, RuntimeError, AttributeError):
        return {}


def _start(file: LogFile, content: Content, written: str, notify: Notify) -> Start:
    """Return the last snapshot with its rows in the unfinished file of this name, or the beginning."""
    start = start_before(file, content, math.inf, notify, written=written) if written else None
    if start is None or start.cursor is None:
        notify(f"{file.path}: has no snapshot with its rows; the replay starts at the beginning")
        return Start(file.head.ensemble.initial_state())
    notify(f"{file.path}: going on from t = {time_text(start.cursor.time)}, after {start.rows:,} rows")
    return start


def _size_notice(output: Path, target: FileRecorder) -> str:
    """Return how large a result will be, and what makes it smaller."""
    own = "" if target.asperities is None else f" and {target.columns:,} asperities"
    fewer = "" if target.asperities is None else 'fewer asperities (record.asperities, "totals" for none), '
    return (
        f"{output}: will take {target.size / 1e6:,.0f} MB, for {target.steps:,} steps{own}; {fewer}fewer substeps or "
        "--compression make it smaller"
    )


def _write_beside(file: "netCDF4.Dataset", head: LogHeader, content: Content) -> None:
    """Write what stands beside the rows: the surface, and what the result is made from."""
    if head.surface:
        surface_group.write(file, head.surface, head.settings["surface_attributes"])
    embedded_log.write(file, head, content)


def digest_attribute(link: bytes) -> dict[str, str]:
    """Return the attributes of a result that say which log it belongs to, by the last link of its chain."""
    digest = f"sha256:{link.hex()}"
    return {"log_digest": digest, "id": digest}
