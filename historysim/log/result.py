"""The result of a log: its rows go to their place in a netCDF file; snapshots in the log say which of them stand."""

import logging
import math
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from historysim.basics.files import replacing
from historysim.basics.hdf5 import check_contained
from historysim.basics.notices import Teller, silent
from historysim.errors import InputError, LoadError
from historysim.loads.event_sequence import time_text
from historysim.loads.schedule import Cursor, Start
from historysim.log import embedded_log
from historysim.log.database import ENDING
from historysim.log.file import Content, LogFile
from historysim.log.header import LogHeader
from historysim.log.replay_start import start_before
from historysim.log.snapshot import Snapshot
from historysim.recording import surface_group
from historysim.recording.compression import compress
from historysim.recording.netcdf import FileRecorder
from historysim.recording.unfinished import Unfinished

if TYPE_CHECKING:
    import h5netcdf

    from historysim.asperities.state import EnsembleState

logger = logging.getLogger(__name__)

LARGE = 200e6
"""Bytes of a result from which its size is told beforehand."""
SNAPSHOT_CELLS, MOST_SNAPSHOT_ROWS = 1 << 26, 1 << 16
"""Asperities times rows between snapshots by default, and the most rows: some seconds of replay."""


def log_beside(output: Path) -> Path:
    """Return the place of the log that belongs to a result.

    Raises InputError: it would be the result itself, or there is no name.
    """
    if not output.name:
        raise InputError(f"{output}: is a folder; expected the name of a file to write")
    beside = output.with_suffix(ENDING)
    if beside == output:
        raise InputError(f"{output}: is the name of a log; expected another ending for the result, such as .nc")
    return beside


def write_result(
    file: LogFile,
    output: Path,
    *,
    progress: bool = False,
    resume: bool = False,
    snapshot_every: int | None = None,
    compression: str = "none",
    threads: int | None = None,
    tell: Teller = silent,
) -> None:
    """Replay a log into a result, which appears under its name when it is complete.

    Parameters
    ----------
    file : LogFile
        Open to write: snapshots of the state are put beside its events.
    output : Path
    progress, resume, snapshot_every, compression, threads, tell
        See `historysim.run`.

    Raises
    ------
    InputError
        The log is damaged, or holds no events.
    LoadError
        A load that the contact cannot carry; the message names the event.
    OSError
        ``output`` cannot be written, or another process is writing it.
    """
    head, content = file.head, file.sound()
    if not content.events:
        raise InputError(f"{file.path}: holds no events yet; expected at least one: historysim append adds them")
    job = head.replay(content.events, threads)
    steps, tip = job.steps(), content.links[-1]
    unfinished = Unfinished(output)
    keep = False
    logger.info("%s: %d asperities, %d events, %d steps", file.path, len(head.ensemble), len(content.events), steps)
    try:
        if resume and _is_result_of(output, tip):
            return
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        options: dict[str, Any] = {
            "handle": unfinished.handle,
            "attributes": job.attributes() | head.attributes | digest_attribute(tip) | {"date_created": now},
            "beside": partial(_write_beside, head=head, content=content),
            "writers": job.threads,
        }
        if not resume:
            unfinished.forget()
        with job.recorder(FileRecorder, **options) as target:
            start = _start(file, content, target, tell) if resume else Start(head.ensemble.initial_state())
            last = start.rows
            keep = last > 0
            target.check_room(output.parent)
            if target.size > LARGE and compression == "none":
                tell(_size_notice(output, target))
            every = snapshot_every or max(1, min(MOST_SNAPSHOT_ROWS, SNAPSHOT_CELLS // len(head.ensemble)))

            def snapshot(cursor: Cursor, state: "EnsembleState") -> None:
                nonlocal last, keep
                if cursor.rows - last < every or cursor.rows == steps:
                    return
                # first the rows, then the snapshot that says that they stand
                written = target.flush()
                ahead = max(cursor.events, *(index + 1 for index in cursor.heading))
                batches = content.batches_for(ahead)
                file.add_snapshot(
                    Snapshot.of(cursor, batches, content.links[batches], state, written, packages=job.ensemble.packages)
                )
                logger.debug("%s: snapshot after %d of %d steps", file.path, cursor.rows, steps)
                last, keep = cursor.rows, True

            job.walk(target, start=start, most_rows=every, progress=progress, after=snapshot)
            target.finish()
        _publish(unfinished, output, compression)
        keep = False
    except (LoadError, InputError):
        keep = False
        raise
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, f"{error.strerror}; then go on with --resume", str(output)) from error
    finally:
        unfinished.close(keep=keep)


def _publish(unfinished: Unfinished, output: Path, compression: str) -> None:
    """Put a finished result in its place."""
    if compression == "none":
        unfinished.publish()
    else:
        with replacing(output) as smaller:
            compress(unfinished.path, smaller, compression)
    logger.info("%s: written, %d bytes", output, output.stat().st_size)


def _start(file: LogFile, content: Content, target: FileRecorder, tell: Teller) -> Start:
    """Return the last snapshot before which all rows stand, or the beginning, and let the recorder go on from there."""
    known: dict[int, set[bytes]] = {}
    for snapshot in file.snapshots(content):
        if not isinstance(snapshot, str) and snapshot.written:
            known.setdefault(snapshot.cursor.rows, set()).add(snapshot.written)
    kept = target.rows_kept(known)
    start = start_before(file, content, math.inf, tell, rows=kept)
    if start.cursor is None:
        tell(f"{file.path}: has no snapshot whose rows are there; the replay starts at the beginning")
    else:
        tell(f"{file.path}: going on from t = {time_text(start.cursor.time)}, after {start.rows:,} rows")
        target.go_on(start.rows, kept[start.rows])
    return start


def _size_notice(output: Path, target: FileRecorder) -> str:
    """Return how large a result will be, and what makes it smaller."""
    own = "" if target.asperities is None else f" and {target.columns:,} asperities"
    fewer = "" if target.asperities is None else 'fewer asperities (record.asperities, "totals" for none), '
    return (
        f"{output}: will take {target.size / 1e6:,.0f} MB, for {target.steps:,} steps{own}; {fewer}fewer substeps or "
        "--compression make it smaller"
    )


def _write_beside(file: "h5netcdf.File", head: LogHeader, content: Content) -> None:
    """Write what stands beside the rows: the surface, and what the result is made from."""
    if head.surface:
        surface_group.write(file, head.surface, head.settings["surface_attributes"])
    embedded_log.write(file, head, content)


def digest_attribute(link: bytes) -> dict[str, str]:
    """Return the attributes of a result that say which log it belongs to, by the last link of its chain."""
    digest = f"sha256:{link.hex()}"
    return {"log_digest": digest, "id": digest}


def _is_result_of(output: Path, tip: bytes) -> bool:
    """Tell whether a complete result of a log, as it is now, is there already."""
    import netCDF4

    try:
        check_contained(output)
        with netCDF4.Dataset(output) as file:
            attributes = {name: file.getncattr(name) for name in ("log_digest", "complete") if name in file.ncattrs()}
    except (OSError, RuntimeError, AttributeError, InputError):
        return False
    return attributes.get("log_digest") == digest_attribute(tip)["log_digest"] and bool(attributes.get("complete"))
