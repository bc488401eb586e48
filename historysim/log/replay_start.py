"""Where the replay of a log can begin: at its beginning, or at a snapshot that can be trusted."""

from collections.abc import Iterable, Iterator

from historysim.basics.notices import Teller, silent
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.loads.event_sequence import time_text
from historysim.loads.schedule import Start
from historysim.log.file import Content, LogFile
from historysim.log.snapshot import Snapshot, program, unpacked


def trusted_snapshots(file: LogFile, content: Content, tell: Teller = silent) -> Iterator[Start]:
    """Yield where the snapshots of a log let a replay begin, the latest first.

    `tell` is told which are passed over, and why; each reason once.
    """
    reasons: set[str] = set()
    for snapshot in file.snapshots(content):
        start = snapshot if isinstance(snapshot, str) else _start(file, content, snapshot)
        if isinstance(start, Start):
            yield start
        elif start not in reasons:
            tell(f"{file.path}: {start}; it is passed over")
            reasons.add(start)


def _start(file: LogFile, content: Content, snapshot: Snapshot) -> Start | str:
    """Return where a snapshot lets a replay begin, or why it does not."""
    cursor = snapshot.cursor
    name = f"the snapshot at t = {time_text(cursor.time)}"
    here = program(file.head.ensemble.packages)
    if snapshot.program != here:
        return f"a snapshot was made by {snapshot.program}; this is {here}"
    if schedule.cursor_at(content.events, cursor.events, file.head.substeps) != cursor:
        return f"{name} does not reckon with events that were appended since"
    try:
        return Start(unpacked(file.head.ensemble, snapshot.state), cursor)
    except InputError as error:
        return f"{name} {error}"


def start_before(
    file: LogFile, content: Content, time: float, tell: Teller = silent, *, rows: Iterable[int] | None = None
) -> Start:
    """Return the latest place up to a time [s] where a replay can begin; with rows, only after one of these."""
    allowed = None if rows is None else set(rows)
    for start in trusted_snapshots(file, content, tell):
        cursor = start.cursor
        if cursor and cursor.time <= time and (allowed is None or cursor.rows in allowed):
            return start
    return Start(file.head.ensemble.initial_state())
