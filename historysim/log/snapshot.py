"""Snapshots: states beside the events of a log, from which a replay can begin: a shortcut, never a truth."""

import hashlib
import json
from collections.abc import Iterable, Iterator
from typing import Self

import attrs

from historysim._version import __version__
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError
from historysim.loads.event_sequence import time_text
from historysim.loads.schedule import Cursor, Start, cursor_at
from historysim.log.file import Content, LogFile


@attrs.frozen
class Snapshot:
    """A state and where in the log it stands."""

    cursor: Cursor  #: events that are done, rows that are recorded, and what the channels are on their way to
    batches: int  #: batches of the log that the state depends on, the one with the events ahead included
    link: bytes  #: link of the last of them
    program: str  #: versions that computed the state
    state: bytes = attrs.field(repr=False)  #: see `EnsembleState.to_bytes`
    written: str = ""  #: which file has the rows before it; empty where none are written

    @property
    def row(self) -> tuple[int, str, bytes, bytes, bytes]:
        """As it stands in the log: events, the rest as JSON, link, state, and the SHA-256 of these."""
        about = attrs.asdict(self.cursor) | {"batches": self.batches, "program": self.program}
        text = json.dumps(about | ({"written": self.written} if self.written else {}))
        return self.cursor.events, text, self.link, self.state, _digest(text, self.link, self.state)

    @classmethod
    def from_row(cls, text: str, link: bytes, state: bytes, digest: bytes) -> Self:
        """Return what stands in a log; what is damaged is a ValueError, KeyError, TypeError or AttributeError."""
        if _digest(text, link, state) != digest:
            raise ValueError("it does not match its digest")
        about = json.loads(text)
        cursor = Cursor(about["events"], about["rows"], about["time"], tuple(about["heading"]))
        return cls(cursor, about["batches"], link, about["program"], state, about.get("written", ""))


def program(packages: Iterable[str] = ()) -> str:
    """Return what computes states here: another version may give other bits; another machine does not."""
    return ", ".join((f"historysim {__version__}", *packages))


def add_snapshot(file: LogFile, snapshot: Snapshot) -> None:
    """Put a snapshot beside the events of a log."""
    file.insert("INSERT INTO snapshot (events, about, link, state, digest) VALUES (?, ?, ?, ?, ?)", snapshot.row)


def snapshots(file: LogFile, content: Content) -> Iterator[Snapshot | str]:
    """Yield the snapshots of a log, the latest first, and in the place of those that cannot be trusted why."""
    try:
        numbers = file.rows("SELECT number FROM snapshot ORDER BY events DESC")
    except InputError as error:
        yield f"the snapshots cannot be read ({error})"
        return
    for (number,) in numbers:
        # one at a time, since states may be large, and each may be damaged
        try:
            row = file.rows("SELECT about, link, state, digest FROM snapshot WHERE number = ?", number)[0]
            snapshot = Snapshot.from_row(*row)
            of_this = 0 < snapshot.batches < len(content.links) and content.links[snapshot.batches] == snapshot.link
            yield snapshot if of_this else f"snapshot {number} is of another log"
        except (InputError, ValueError, KeyError, TypeError, AttributeError) as error:
            yield f"snapshot {number} is damaged ({error})"


def trusted_snapshots(
    file: LogFile, content: Content, notify: Notify = silent, *, written: str | None = None
) -> Iterator[Start]:
    """Yield where the snapshots of a log let a replay begin, the latest first.

    With `written`, only those with their rows in the file of that name. `notify` gets each reason to pass some over.
    """
    reasons: set[str] = set()
    for snapshot in snapshots(file, content):
        if isinstance(snapshot, Snapshot) and written not in {None, snapshot.written}:
            continue
        start = snapshot if isinstance(snapshot, str) else _start(file, content, snapshot)
        if isinstance(start, Start):
            yield start
        elif start not in reasons:
            notify(f"{file.path}: {start}; it is passed over")
            reasons.add(start)


def start_before(
    file: LogFile, content: Content, time: float, notify: Notify = silent, *, written: str | None = None
) -> Start:
    """Return the latest place up to a time [s] where a replay can begin; `written` as for `trusted_snapshots`."""
    starts = trusted_snapshots(file, content, notify, written=written)
    of_snapshot = (start for start in starts if start.cursor and start.cursor.time <= time)
    return next(of_snapshot, None) or Start(file.head.ensemble.initial_state())


def _start(file: LogFile, content: Content, snapshot: Snapshot) -> Start | str:
    """Return where a snapshot lets a replay begin, or why it does not."""
    cursor, here = snapshot.cursor, program(file.head.ensemble.packages)
    if snapshot.program != here:
        return f"a snapshot was made by {snapshot.program}; this is {here}"
    if cursor_at(content.events, cursor.events, file.head.substeps) != cursor:
        return f"the snapshot at t = {time_text(cursor.time)} was made before events were appended"
    try:
        return Start(file.head.ensemble.state_from(snapshot.state), cursor)
    except InputError as error:
        return f"a snapshot cannot be used ({error})"


def _digest(text: str, link: bytes, state: bytes) -> bytes:
    return hashlib.sha256(link + hashlib.sha256(text.encode()).digest() + state).digest()
