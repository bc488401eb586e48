"""The file of a log: an append-only SQLite database of batches of events, each chained to the previous one.

The journal is SQLite's rollback journal, not its write-ahead log: between transactions a log is one
file that can be copied, mailed and read from a read-only folder. The price, that a reader waits
while a batch is committed, is small, since batches are few and large. With ``synchronous=EXTRA`` a
committed batch outlives a loss of power as well.
"""

import errno
import functools
import json
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, Self
from urllib.parse import quote

import attrs
import numpy as np

from historysim.basics.files import (
    SQLITE,
    WriterLock,
    beginning,
    check_replaceable,
    is_log,
    kind_text,
    write_errors,
    write_reason,
)
from historysim.basics.system import fork_lock, sync_folder
from historysim.errors import InputError, MissingPackageError
from historysim.loads.event_sequence import (
    Events,
    check_components,
    check_pressing,
    check_sequence,
    components,
    time_text,
    to_loads,
)
from historysim.loads.events import Event
from historysim.log import canonical
from historysim.log.header import LogHeader, parse_head

ENDING = ".history"
MOST_EVENTS_OF_A_BATCH = 1 << 16
PATIENCE = 60.0  # seconds that a reader or writer waits for the other's transaction
_EXPECTED = (
    f"expected the log of a run (NAME{ENDING}); restore it from a copy, or run the scenario again"
)

# SQLite errors that the system causes; all others mean a damaged file.
_REFUSALS = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_IOERR: errno.EIO,
    sqlite3.SQLITE_NOMEM: errno.ENOMEM,
    **dict.fromkeys(
        (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM), errno.EACCES
    ),
    **dict.fromkeys((sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED), errno.EAGAIN),
}
# signatures of an active and of a finished journal
_JOURNAL = (b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", b"\0")

TABLES = ("head", "array", "batch", "chain")
SCHEMA = """
CREATE TABLE head (id INTEGER PRIMARY KEY CHECK (id = 1), settings TEXT NOT NULL);
CREATE TABLE array (name TEXT PRIMARY KEY, shape TEXT NOT NULL, content BLOB NOT NULL);
CREATE TABLE batch (
    number INTEGER PRIMARY KEY, first INTEGER NOT NULL,
    kind BLOB NOT NULL, time BLOB NOT NULL, value BLOB NOT NULL, coefficients BLOB NOT NULL
);
CREATE TABLE chain (number INTEGER PRIMARY KEY, events INTEGER NOT NULL, link BLOB NOT NULL);
CREATE TABLE snapshot (
    number INTEGER PRIMARY KEY, events INTEGER NOT NULL, about TEXT NOT NULL,
    link BLOB NOT NULL, state BLOB NOT NULL, digest BLOB NOT NULL
);
""" + "".join(
    f"CREATE TRIGGER no_{verb.lower()}_of_{table} BEFORE {verb} ON {table} "
    "BEGIN SELECT RAISE(ABORT, 'a log is only ever appended to'); END;\n"
    for table in TABLES
    for verb in ("UPDATE", "DELETE")
)
_OBJECTS = "SELECT type || ' ' || name, coalesce(sql, '') FROM sqlite_master"


@attrs.frozen
class Content:
    """Contents of a log up to the first broken link of the chain."""

    events: Events = attrs.field(repr=False)
    links: list[bytes] = attrs.field(repr=False)  #: of the head, and after each batch
    ends: list[int] = attrs.field(repr=False)  #: number of events up to each link
    problem: str = ""  #: problem after these events; empty if there is none

    def content_at_digest(self, digest: str) -> "Content | None":
        """Return the content up to the batch whose link has this digest; None if there is no such batch."""
        for number, (link, event_count) in enumerate(zip(self.links, self.ends, strict=True)):
            if event_count and link.hex() == digest:
                return Content(
                    self.events[:event_count], self.links[: number + 1], self.ends[: number + 1]
                )
        return None


class LogFile:
    """A log on disk; with `write` it holds the writer's lock. A known `head` is compared, not read again.

    InputError: the file does not exist, is not a log, is damaged, or has another head. OSError: it
    cannot be opened, or is being written.
    """

    def __init__(
        self,
        path: Path,
        *,
        write: bool = False,
        lock: WriterLock | None = None,
        head: LogHeader | None = None,
    ) -> None:
        self.path = path
        if not is_log(path) and (problem := kind_text(path)):
            raise InputError(f"{path}: {problem}; expected the log of a run (NAME{ENDING})")
        self._lock = lock or (WriterLock(path) if write else None)
        self._connection: sqlite3.Connection | None = None
        self._content: Content | None = None
        self._version = 0
        try:
            # a reader, too, must be able to roll back the incomplete transaction of a dead writer
            mode = "rw" if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK) else "ro"
            with sqlite_errors(path):
                self._connection = connect(path, mode)
            with self._reading() as connection:
                _check_schema(connection, path)
                self.head = (
                    _read_head(connection, path)
                    if head is None
                    else _same_head(connection, path, head)
                )
        except BaseException:
            self.close()
            raise

    @classmethod
    def create(cls, path: Path, head: LogHeader, events: Sequence[Event] = ()) -> Self:
        """Create a log and take the writer's lock; it appears under its name when all its events are written.

        InputError: events that cannot be used. OSError: it cannot be written, or one of this name
        is being written.
        """
        checked_events(head, events)
        check_replaceable(path)
        unfinished = path.with_name(f".{path.name}.part")
        try:
            lock = WriterLock(unfinished, make=True, begins=(SQLITE,))
        except OSError as error:
            raise OSError(error.errno, write_reason(error), str(path)) from None
        try:
            if path.exists():
                # another writer of the old log must finish before it is replaced
                WriterLock(path).release()
            os.truncate(unfinished, 0)
            _check_journal(unfinished).unlink(missing_ok=True)
            with (
                write_errors(path, unfinished),
                sqlite_errors(path),
                closing(connect(unfinished, "rw")) as connection,
            ):
                # after a crash before the rename nothing refers to this file
                connection.execute("PRAGMA journal_mode = MEMORY")
                connection.executescript(f"BEGIN IMMEDIATE; {SCHEMA}")
                _put_head(connection, head)
                connection.execute("COMMIT")
                for _ in _put_events(connection, [head.link], [0], events):
                    pass
            settle(path)
            lock = lock.rename(path)
            with write_errors(path, unfinished):
                sync_folder(path.parent)
            return cls(path, lock=lock)
        except BaseException:
            lock.release()
            unfinished.unlink(missing_ok=True)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file and release the writer's lock."""
        # closing any handle of a file drops the record locks that SQLite has on it, so SQLite
        # closes first
        if self._connection is not None:
            with fork_lock:
                self._connection.close()
            self._connection = None
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    # -- reading -----------------------------------------------------------------------------------

    def read(self) -> Content:
        """Read the current contents of the log, up to the first broken link of the chain."""
        with self._reading() as connection:
            # data_version ignores writes of this connection
            version = _pragma(connection, "data_version")
            if self._content is None or version != self._version:
                _check_schema(connection, self.path)
                content = _read(connection, self.head)
                # SQLite checks only the pages that it reads
                full_size = _pragma(connection, "page_count") * _pragma(connection, "page_size")
                if not content.problem and self.path.stat().st_size < full_size:
                    content = attrs.evolve(content, problem="the file was cut")
                self._content, self._version = content, version
        return self._content

    def sound(self) -> Content:
        """Return the contents of the log; InputError if the chain is broken."""
        content = self.read()
        if content.problem:
            count = len(content.events)
            until = (
                f"; those before, up to t = {time_text(content.events[-1].time)}, are sound"
                if count
                else ""
            )
            raise InputError(
                f"{self.path}: is damaged: {content.problem}, so event {count:,} and later ones cannot be "
                f"trusted{until}: EventLog.fork copies the sound events to a new log"
            )
        return content

    def rows(self, query: str, *values: int) -> list[tuple[Any, ...]]:
        """Return the rows of a query on the log; InputError if it is damaged."""
        with self._reading() as connection:
            return connection.execute(query, values).fetchall()

    @contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        """Open a read transaction: a consistent view of the file while another process writes."""
        with sqlite_errors(self.path):
            self._open.execute("BEGIN")
            try:
                yield self._open
            finally:
                with suppress(sqlite3.Error):
                    self._open.execute("ROLLBACK")

    @property
    def _open(self) -> sqlite3.Connection:
        if self._connection is None:
            raise InputError(f"{self.path}: the log is closed; open it again")
        return self._connection

    # -- writing -----------------------------------------------------------------------------------

    def append(self, events: Sequence[Event]) -> None:
        """Append events in batches of one transaction each; if one fails, the batches before it remain.

        InputError: unusable events, or damage. OSError: another process writes the log, or the disk
        is full.
        """
        self._become_writer()
        content = self.sound()
        events = Events(events) if not isinstance(events, Events) else events
        checked_events(self.head, events, content.events)
        with sqlite_errors(self.path):
            for batch in _put_events(self._open, content.links, content.ends, events):
                self._content = content = attrs.evolve(
                    content, events=Events.join([content.events, batch])
                )

    def insert(self, query: str, values: tuple[int | str | bytes, ...]) -> None:
        """Insert an auxiliary record (a snapshot) in one transaction."""
        self._become_writer()
        with sqlite_errors(self.path), _transaction(self._open):
            self._open.execute(query, values)

    def _become_writer(self) -> None:
        if self._lock is None:
            self._lock = WriterLock(self.path)


def checked_events(head: LogHeader, events: Sequence[Event], earlier: Sequence[Event] = ()) -> None:
    """Check that events may follow the earlier ones of a log; otherwise InputError."""
    check_sequence(events)
    if events and earlier and events[0].time < earlier[-1].time:
        raise InputError(
            f"event 0 at t = {time_text(events[0].time)}: comes before the last event of the log, at t = "
            f"{time_text(earlier[-1].time)}; expected later ones: the events of a log do not change; EventLog.fork "
            "copies the events up to a time to a new log"
        )
    check_components(components(earlier) | components(events))
    if not head.ensemble.attracts:
        check_pressing(events)
    count = len(head.ensemble)
    # loads fit any number of asperities
    for index, event in enumerate(events if to_loads(events) is None else ()):
        if problem := event.problem(count):
            raise InputError(f"event {index} at t = {time_text(event.time)}: {problem}")


def chain_links(head: LogHeader, events: Sequence[Event]) -> list[bytes]:
    """Return the links of the log that `LogFile.create` would write."""
    return [
        head.link,
        *(link for *_, link in canonical.chain(head.link, events, _ends(0, len(events)))),
    ]


def _ends(start: int, count: int) -> list[int]:
    """Return the bounds of the batches of ``count`` events after the first ``start`` ones."""
    return [*range(start, start + count, MOST_EVENTS_OF_A_BATCH), start + count]


# -- the tables ------------------------------------------------------------------------------------


def _put_head(connection: sqlite3.Connection, head: LogHeader) -> None:
    connection.execute("INSERT INTO head VALUES (1, ?)", (head.text,))
    for name, values in sorted(head.arrays.items()):
        connection.execute(
            "INSERT INTO array VALUES (?, ?, ?)", (name, json.dumps(values.shape), values.tobytes())
        )
    connection.execute("INSERT INTO chain VALUES (0, 0, ?)", (head.link,))


def _read_head(connection: sqlite3.Connection, path: Path) -> LogHeader:
    try:
        (settings,) = connection.execute("SELECT settings FROM head").fetchone()
        (link,) = connection.execute("SELECT link FROM chain WHERE number = 0").fetchone()
        arrays = {
            name: np.frombuffer(content, dtype="<f8").reshape(json.loads(shape))
            for name, shape, content in connection.execute("SELECT name, shape, content FROM array")
        }
        return parse_head(settings, arrays, link=link)
    except InputError as error:
        raise type(error)(f"{path}: {error}") from error
    except (
        ValueError,
        TypeError,
        KeyError,
        OverflowError,
        AttributeError,
        RecursionError,
    ) as error:
        raise InputError(
            f"{path}: is damaged: its head cannot be read ({error}); {_EXPECTED}"
        ) from error


def _same_head(connection: sqlite3.Connection, path: Path, head: LogHeader) -> LogHeader:
    """Return a known head if the log has the same one; otherwise InputError."""
    if connection.execute("SELECT link FROM chain WHERE number = 0").fetchone() != (head.link,):
        raise InputError(f"{path}: is another log than before; it was replaced")
    return head


def _put_events(
    connection: sqlite3.Connection, links: list[bytes], ends: list[int], events: Sequence[Event]
) -> Iterator[Events]:
    """Append events and their links; yield each batch when it is committed."""
    events = events if isinstance(events, Events) else Events(events)
    offset, bounds = ends[-1], _ends(ends[-1], len(events))
    for start, stop, columns, link in canonical.chain(links[-1], events, bounds):
        number = len(links)
        with _transaction(connection):
            connection.execute(
                "INSERT INTO batch VALUES (?, ?, ?, ?, ?, ?)", (number, start, *columns)
            )
            connection.execute("INSERT INTO chain VALUES (?, ?, ?)", (number, stop, link))
        links.append(link)
        ends.append(stop)
        yield events[start - offset : stop - offset]


def _read(connection: sqlite3.Connection, head: LogHeader) -> Content:
    links, ends, batches = [head.link], [0], [Events()]

    def content(problem: str = "") -> Content:
        return Content(Events.join(batches), links, ends, problem)

    number = 0
    try:
        # both tables are read: each shows where the other has lost its end
        chain = connection.execute(
            "SELECT number, events, link FROM chain ORDER BY number"
        ).fetchall()
        rows = connection.execute(
            "SELECT number, first, kind, time, value, coefficients FROM batch ORDER BY number"
        )
        for number, (*position, kind, time, value, coefficients) in enumerate(rows, start=1):
            columns = canonical.Columns(kind, time, value, coefficients)
            stop, link = ends[-1] + len(kind), canonical.link(links[-1], ends[-1], columns)
            if position != [number, ends[-1]] or chain[number : number + 1] != [
                (number, stop, link)
            ]:
                return content(f"batch {number} does not match its digest")
            events = canonical.from_columns(columns)
            if len(batches[-1]) and len(events) and events[0].time < batches[-1][-1].time:
                return content(f"batch {number} begins before the end of the previous batch")
            batches.append(events)
            links.append(link)
            ends.append(stop)
    except MissingPackageError as error:
        raise MissingPackageError(f"batch {number + 1} {error}") from error
    except (sqlite3.Error, InputError, ValueError, TypeError, OverflowError) as error:
        if _refusal(error):
            raise
        return content(f"batch {number + 1} cannot be read ({error})")
    if len(chain) > len(links):
        return content(
            f"{len(chain) - len(links)} of {len(chain) - 1} batches are missing at the end"
        )
    return content()


# -- SQLite ----------------------------------------------------------------------------------------


@contextmanager
def sqlite_errors(path: Path) -> Iterator[None]:
    """Turn errors of SQLite into OSError (refused by the system) or InputError (damaged file); a fork waits."""
    try:
        with fork_lock:
            yield
    except (sqlite3.Error, UnicodeDecodeError) as error:
        if number := _refusal(error):
            mend = "the log is intact; make room, allow writing, or wait for the other process; then continue"
            reason = write_reason(OSError(number, os.strerror(number)))
            raise OSError(number, f"{reason} ({error}); {mend}", str(path)) from error
        raise InputError(f"{path}: is not a log, or is damaged ({error}); {_EXPECTED}") from error


def _refusal(error: Exception) -> int | None:
    """Return the system error number behind an SQLite error; None if the file itself is damaged."""
    return _REFUSALS.get(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF)


def connect(path: Path, mode: str) -> sqlite3.Connection:
    """Open a log ("ro" or "rw") so that no code stored in it is executed."""
    _check_journal(path)
    address = f"file:{quote(str(path.absolute()))}?mode={mode}"
    connection = sqlite3.connect(address, uri=True, timeout=PATIENCE, isolation_level=None)
    try:
        connection.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        if hasattr(connection, "setconfig"):
            # Python 3.12 and later
            connection.setconfig(getattr(sqlite3, "SQLITE_DBCONFIG_DEFENSIVE"), True)  # noqa: B009 - not in 3.11
        for setting in (
            "synchronous = EXTRA",
            "cell_size_check = ON",
            "trusted_schema = OFF",
            "mmap_size = 0",
        ):
            connection.execute(f"PRAGMA {setting}")
    except BaseException:
        connection.close()
        raise
    return connection


def _pragma(connection: sqlite3.Connection, name: str) -> int:
    return int(connection.execute(f"PRAGMA {name}").fetchone()[0])


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Commit the statements executed in the block, all or none."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        # SQLite may have rolled back already, e.g. on a full disk
        with suppress(sqlite3.Error):
            connection.execute("ROLLBACK")
        raise


def _check_journal(path: Path) -> Path:
    """Return the path of the journal of a log; InputError if it is another file, which SQLite would delete."""
    journal = path.with_name(f"{path.name}-journal")
    if (signature := beginning(journal)) and not signature.startswith(_JOURNAL):
        raise InputError(f"{journal}: is not an SQLite journal; move it away")
    return journal


@functools.cache
def _schema() -> frozenset[tuple[str, ...]]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        return frozenset(connection.execute(_OBJECTS).fetchall())


def _check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file with other database objects: SQLite would execute foreign views and triggers."""
    objects = set(connection.execute(f"{_OBJECTS} LIMIT {len(_schema()) + 1}").fetchall())
    strange = [f"holds {name}" for name, _ in sorted(objects - _schema())]
    # a log that has lost a trigger is still a log
    missing = [f"has no table {name}" for name in TABLES if f"table {name}" not in dict(objects)]
    if problems := [*strange[:3], *missing]:
        raise InputError(
            f"{path}: is not a log, or is damaged: it {' and '.join(problems)}; {_EXPECTED}"
        )


def settle(path: Path) -> None:
    """Roll back the incomplete transaction of a dead writer in a log that will be replaced.

    Otherwise SQLite would take its journal for one of the new file, and the old file would be
    damaged without it.
    """
    journal = _check_journal(path)
    if not journal.exists():
        return
    if path.exists():
        with suppress(InputError), sqlite_errors(path), closing(connect(path, "rw")) as connection:
            connection.execute("SELECT name FROM sqlite_master").fetchall()
    # SQLite leaves the journal if the old file is not a log or is missing
    journal.unlink(missing_ok=True)
    sync_folder(path.parent)
