"""The file of a log: SQLite, in which events are only ever appended, batch by batch, each chained to the one before.

The journal is SQLite's rollback journal, not its write-ahead log: between transactions a log is one file that can be
copied, mailed and read from a read-only folder, where a write-ahead log would need two more files and the right to
write them. Its price, that a reader waits while a batch is committed, is small, since batches are few and large. With
``synchronous=EXTRA`` (which is FULL, and the folder too) a committed batch outlives a loss of power as well.
"""

import errno
import functools
import itertools
import json
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Self
from urllib.parse import quote

import attrs
import numpy as np

from historysim.basics.array_types import Floats
from historysim.basics.file_kinds import is_log, told_kind
from historysim.basics.files import check_replaceable, sync_folder
from historysim.basics.lock import WriterLock
from historysim.errors import InputError, MissingPackageError
from historysim.loads.event_sequence import check_sequence, time_text
from historysim.loads.events import Event
from historysim.log import canonical
from historysim.log.header import LogHeader, head_from
from historysim.log.snapshot import Snapshot, snapshot_from

ENDING = ".history"
MOST_EVENTS_OF_A_BATCH = 1 << 16
SHORTEST_LIMIT = 1_000_000
"""Bytes that a value of a log may have in any case; no value is longer than twice the file besides."""
PATIENCE = 60.0
"""Seconds that a reader or writer waits for the other's transaction."""

REFUSALS = {
    sqlite3.SQLITE_FULL: (errno.ENOSPC, "No space left on device; what the log holds stands; make room, then go on"),
    sqlite3.SQLITE_IOERR: (errno.EIO, "the log cannot be read or written; is the disk full or gone?"),
    sqlite3.SQLITE_READONLY: (errno.EACCES, "the log, or its folder, is read-only"),
    sqlite3.SQLITE_CANTOPEN: (errno.EACCES, "the log cannot be opened; may its folder be written to?"),
    sqlite3.SQLITE_PERM: (errno.EACCES, "Permission denied"),
    sqlite3.SQLITE_BUSY: (errno.EAGAIN, "another process holds the log; try again when it is done"),
    sqlite3.SQLITE_LOCKED: (errno.EAGAIN, "another process holds the log; try again when it is done"),
    sqlite3.SQLITE_NOMEM: (errno.ENOMEM, "the memory does not suffice"),
}

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


@attrs.frozen
class Content:
    """What stands in a log, as far as the chain holds.

    Attributes
    ----------
    events : list of events
    links : list of bytes
        Of the head, and after each batch.
    ends : list of int
        Number of events up to each link.
    problem : str
        What is wrong after these events; empty where nothing is.
    """

    events: list[Event] = attrs.field(repr=False)
    links: list[bytes] = attrs.field(repr=False)
    ends: list[int] = attrs.field(repr=False)
    problem: str = ""

    def batches_for(self, count: int) -> int:
        """Count the batches in which so many events stand."""
        return int(np.searchsorted(self.ends, count))


class LogFile:
    """A log on disk.

    Parameters
    ----------
    path : Path
        An existing log.
    write : bool
        Take the writer's lock at once.

    Raises
    ------
    InputError
        There is no such file, or it is no log, or its head is damaged.
    OSError
        It cannot be opened, or another process is writing it.
    """

    def __init__(self, path: Path, *, write: bool = False, lock: WriterLock | None = None) -> None:
        self.path = path
        if not is_log(path) and (came := told_kind(path)):
            raise InputError(f"{path}: {came}; expected the log of a run (NAME{ENDING})")
        self._lock = lock or (WriterLock(path) if write else None)
        self._connection: sqlite3.Connection | None = None
        try:
            self._connection = self._connected()
            self.head = self._head()
            self._content: Content | None = None
            self._version = 0
        except BaseException:
            self.close()
            raise

    @classmethod
    def create(cls, path: Path, head: LogHeader, events: Sequence[Event] = ()) -> Self:
        """Make a log, which appears under its name, in place of one that is there, when all its events stand in it.

        The one who makes it holds the writer's lock.

        Raises
        ------
        InputError
            Events that cannot be used.
        OSError
            It cannot be written, or another process is writing one of this name.
        """
        checked_events(head, events)
        check_replaceable(path)
        unfinished = path.with_name(f".{path.name}.part")
        try:
            lock = WriterLock(unfinished, make=True)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from None
        try:
            if path.exists():
                # whoever writes the old one must be done before it is replaced
                WriterLock(path).release()
            os.truncate(unfinished, 0)
            unfinished.with_name(f"{unfinished.name}-journal").unlink(missing_ok=True)
            with reported(path):
                connection = _connect(unfinished, "rw")
                try:
                    # a crash before it has its name leaves nothing behind that anybody asks for
                    connection.execute("PRAGMA journal_mode = MEMORY")
                    connection.execute("BEGIN IMMEDIATE")
                    for statement in _statements(SCHEMA):
                        connection.execute(statement)
                    _put_head(connection, head)
                    connection.execute("COMMIT")
                    for _ in _put_events(connection, [head.link], [0], events):
                        pass
                finally:
                    connection.close()
            _settle(path)
            lock = lock.moved(path)
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
        """Close the file, and give the writer's lock back."""
        # closing any handle of a file drops the record locks that SQLite has on it, so its own comes first
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    # -- reading -----------------------------------------------------------------------------------

    def read(self) -> Content:
        """Read what stands in the log now, as far as the chain holds."""
        with reported(self.path), self._reading() as connection:
            # what this connection has written itself does not count
            version = connection.execute("PRAGMA data_version").fetchone()[0]
            if self._content is None or version != self._version:
                _check_schema(connection, self.path)
                content = _read(connection, self.head)
                if not content.problem and _is_cut(connection, self.path):
                    content = attrs.evolve(content, problem="the file was cut")
                if not content.problem and (found := _unsound(connection)):
                    content = attrs.evolve(content, problem=f"SQLite finds: {found}")
                self._content, self._version = content, version
        return self._content

    def sound(self) -> Content:
        """Return all of the log; a chain that is broken somewhere is an InputError."""
        content = self.read()
        if content.problem:
            count = len(content.events)
            until = f"; those before, up to t = {time_text(content.events[-1].time)}, are sound" if count else ""
            raise InputError(
                f"{self.path}: is damaged: {content.problem}, so event {count:,} and what follows cannot be "
                f"trusted{until}: historysim fork copies what is sound to a new log"
            )
        return content

    def snapshots(self, content: Content) -> Iterator[Snapshot | str]:
        """Give the snapshots of this log, the latest first, and in the place of those that cannot be trusted why."""
        try:
            with reported(self.path), self._reading() as connection:
                numbers = [row[0] for row in connection.execute("SELECT number FROM snapshot ORDER BY events DESC")]
        except InputError as error:
            yield f"the snapshots cannot be read ({error})"
            return
        for number in numbers:
            yield self._snapshot(number, content)

    def _snapshot(self, number: int, content: Content) -> Snapshot | str:
        name = f"snapshot {number}"
        try:
            with reported(self.path), self._reading() as connection:
                about, link, state, digest = connection.execute(
                    "SELECT about, link, state, digest FROM snapshot WHERE number = ?", (number,)
                ).fetchone()
            snapshot = snapshot_from(about, link, state)
            whole = snapshot.digest == digest
        except (InputError, ValueError, KeyError, TypeError, AttributeError) as error:
            return f"{name} is damaged ({error})"
        if not whole:
            return f"{name} is damaged: it does not match its digest"
        if not 0 < snapshot.batches < len(content.links) or content.links[snapshot.batches] != link:
            return f"{name} is of another log"
        return snapshot

    # -- writing -----------------------------------------------------------------------------------

    def lock(self) -> None:
        """Take the writer's lock, if this is not the writer yet; an OSError where it is not to be had."""
        if self._lock is None:
            self._lock = WriterLock(self.path)

    def append(self, events: Sequence[Event]) -> None:
        """Append events, in batches of one transaction each.

        Raises
        ------
        InputError
            Events that cannot be used, or the log is damaged.
        OSError
            Another process is writing it, or the disk is full; the batches before stand.
        """
        self.lock()
        content = self.sound()
        events = list(events)
        checked_events(self.head, events, content.events)
        with reported(self.path):
            for batch in _put_events(self._open, content.links, content.ends, events):
                content.events.extend(batch)

    def add_snapshot(self, snapshot: Snapshot) -> None:
        """Put a snapshot beside the events."""
        self.lock()
        row = (snapshot.cursor.events, snapshot.text, snapshot.link, snapshot.state, snapshot.digest)
        with reported(self.path), _transaction(self._open):
            self._open.execute("INSERT INTO snapshot (events, about, link, state, digest) VALUES (?, ?, ?, ?, ?)", row)

    # -- the connection ----------------------------------------------------------------------------

    @property
    def _open(self) -> sqlite3.Connection:
        if self._connection is None:
            raise InputError(f"{self.path}: the log is closed; open it again")
        return self._connection

    def _connected(self) -> sqlite3.Connection:
        with reported(self.path):
            # a reader, too, has to be able to undo what a writer that died has left half done
            mode = "rw" if os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK) else "ro"
            return _connect(self.path, mode)

    @contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        """One view of the file, whatever a writer does meanwhile."""
        connection = self._open
        # no value is longer than the file that it stands in; what is written may be
        longest = max(SHORTEST_LIMIT, 2 * self.path.stat().st_size)
        before = connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, longest)
        connection.execute("BEGIN")
        try:
            yield connection
        finally:
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, before)
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")

    def _head(self) -> LogHeader:
        with reported(self.path), self._reading() as connection:
            _check_schema(connection, self.path)
            row = connection.execute("SELECT settings FROM head").fetchone()
            first = connection.execute("SELECT link FROM chain WHERE number = 0").fetchone()
            if row is None or first is None:
                raise InputError(f"{self.path}: is damaged: it has no head; restore it from a copy, or run again")
            try:
                rows = connection.execute("SELECT name, shape, content FROM array")
                arrays = {name: _array(shape, content) for name, shape, content in rows}
                head = head_from(row[0], arrays)
                whole = head.link == first[0]
                if whole:
                    head.check()
            except InputError as error:
                raise type(error)(f"{self.path}: {error}") from error
            except (ValueError, TypeError, KeyError, OverflowError, AttributeError, RecursionError) as error:
                raise InputError(f"{self.path}: is damaged: its head cannot be read ({error})") from error
        if not whole:
            raise InputError(
                f"{self.path}: is damaged: its head (scenario, seeds, asperities) does not match its digest; restore "
                "it from a copy, or run the scenario again"
            )
        return head


def checked_events(head: LogHeader, events: Sequence[Event], before: Sequence[Event] = ()) -> None:
    """Check that events may follow others in a log.

    What is no event, a time before the one in front, or coefficients of another number of asperities is an InputError.
    """
    check_sequence(events)
    if events and before and events[0].time < before[-1].time:
        raise InputError(
            f"event 0 at t = {time_text(events[0].time)}: comes before the last event of the log, at t = "
            f"{time_text(before[-1].time)}; expected later ones: what a log holds does not change; historysim fork "
            "copies the past up to a time, for another future"
        )
    count = len(head.ensemble)
    for index, event in enumerate(events):
        if problem := event.misfit(count):
            raise InputError(f"event {index} at t = {time_text(event.time)}: {problem}")


def links_of(head: LogHeader, events: Sequence[Event]) -> list[bytes]:
    """Return the links of the log that `LogFile.create` makes, without making it."""
    links = [head.link]
    for first in range(0, len(events), MOST_EVENTS_OF_A_BATCH):
        columns = canonical.columns_of(events[first : first + MOST_EVENTS_OF_A_BATCH])
        links.append(canonical.link(links[-1], first, columns))
    return links


@contextmanager
def reported(path: Path) -> Iterator[None]:
    """Say what SQLite has met as what it is: the system's refusal, or a damaged file."""
    try:
        yield
    except (sqlite3.Error, UnicodeDecodeError) as error:
        if refused := _refusal(error):
            raise OSError(*refused, str(path)) from error
        raise InputError(
            f"{path}: is no log, or damaged ({error}); expected the log of a run (NAME{ENDING}); restore it from a "
            "copy, or run the scenario again"
        ) from error


def _refusal(error: Exception) -> tuple[int, str] | None:
    """Say what the system has refused, with its number; None where the file itself is at fault."""
    return REFUSALS.get(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF)


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    address = f"file:{quote(str(path.absolute()))}?mode={mode}"
    connection = sqlite3.connect(address, uri=True, timeout=PATIENCE, isolation_level=None)
    try:
        # a log may come from anywhere: nothing in it is carried out
        connection.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        if hasattr(connection, "setconfig"):
            # Python 3.12 and later
            connection.setconfig(getattr(sqlite3, "SQLITE_DBCONFIG_DEFENSIVE"), True)  # noqa: B009 - not in 3.11
        for setting in ("synchronous = EXTRA", "cell_size_check = ON", "trusted_schema = OFF", "mmap_size = 0"):
            connection.execute(f"PRAGMA {setting}")
    except BaseException:
        connection.close()
        raise
    return connection


@functools.cache
def _schema() -> frozenset[tuple[str, ...]]:
    """Return what a log holds, as SQLite tells it."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        return frozenset(connection.execute(_TOLD).fetchall())


_TOLD = "SELECT type, name, tbl_name, coalesce(sql, '') FROM sqlite_master"


def _check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file that holds more than a log: a view, or a trigger of another's, would be carried out."""
    found = set(connection.execute(f"{_TOLD} LIMIT {len(_schema()) + 1}").fetchall())
    strange = sorted(f"{kind} {name}" for kind, name, *_ in found - _schema())
    missing = sorted(set(TABLES) - {name for _, name, *_ in found})
    # what a log has lost, such as a trigger, cannot do anything
    if strange or missing:
        told = [f"holds {', '.join(strange[:3])}, other than a log does"] if strange else []
        told += [f"has no table {', '.join(missing[:3])}"] if missing else []
        raise InputError(
            f"{path}: is no log, or damaged: it {' and '.join(told)}; expected the log of a run (NAME{ENDING}); "
            "restore it from a copy, or run the scenario again"
        )


def _unsound(connection: sqlite3.Connection) -> str:
    """Return what SQLite finds wrong with the pages of a file; empty where nothing is."""
    found = connection.execute("PRAGMA quick_check(1)").fetchone()
    return "" if found is None or found[0] == "ok" else str(found[0]).replace("\n", " ")


def _settle(path: Path) -> None:
    """Undo what a writer that died has left half done in a log that is about to be replaced.

    SQLite would take its journal for one of the new file. Without it, the old file would be damaged.
    """
    journal = path.with_name(f"{path.name}-journal")
    if not journal.exists():
        return
    if path.exists():
        with suppress(InputError), reported(path), closing(_connect(path, "rw")) as connection:
            connection.execute("SELECT name FROM sqlite_master").fetchall()
    # it stays where the old file is no log, or gone
    journal.unlink(missing_ok=True)
    sync_folder(path.parent)


def _statements(script: str) -> Iterator[str]:
    """Split a script into statements: all at once, they would end the transaction that they stand in."""
    statement = ""
    for line in script.splitlines():
        statement += f"{line}\n"
        if sqlite3.complete_statement(statement):
            yield statement
            statement = ""


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        # SQLite may have rolled back on its own, where the disk is full
        with suppress(sqlite3.Error):
            connection.execute("ROLLBACK")
        raise


def _put_head(connection: sqlite3.Connection, head: LogHeader) -> None:
    connection.execute("INSERT INTO head VALUES (1, ?)", (head.text,))
    for name, values in sorted(head.arrays.items()):
        connection.execute("INSERT INTO array VALUES (?, ?, ?)", (name, json.dumps(values.shape), values.tobytes()))
    connection.execute("INSERT INTO chain VALUES (0, 0, ?)", (head.link,))


def _put_events(
    connection: sqlite3.Connection, links: list[bytes], ends: list[int], events: Sequence[Event]
) -> Iterator[list[Event]]:
    """Append events, and their links to those that are there; give them back batch by batch, when they stand."""
    for start in range(0, len(events), MOST_EVENTS_OF_A_BATCH):
        batch = list(itertools.islice(events, start, start + MOST_EVENTS_OF_A_BATCH))
        columns = canonical.columns_of(batch)
        number, first = len(links), ends[-1]
        link = canonical.link(links[-1], first, columns)
        with _transaction(connection):
            connection.execute("INSERT INTO batch VALUES (?, ?, ?, ?, ?, ?)", (number, first, *columns))
            connection.execute("INSERT INTO chain VALUES (?, ?, ?)", (number, first + len(batch), link))
        links.append(link)
        ends.append(first + len(batch))
        yield batch


def _read(connection: sqlite3.Connection, head: LogHeader) -> Content:
    content = Content([], [head.link], [0])

    def broken(problem: str) -> Content:
        return attrs.evolve(content, problem=problem)

    number = 0
    try:
        # both tables are read, so that one that has lost its end is told by the other
        chain = connection.execute("SELECT number, events, link FROM chain ORDER BY number").fetchall()
        rows = connection.execute("SELECT number, first, kind, time, value, coefficients FROM batch ORDER BY number")
        for number, row in enumerate(rows, start=1):
            columns = canonical.Columns(*row[2:])
            if not all(isinstance(column, bytes) for column in columns) or row[:2] != (number, content.ends[-1]):
                return broken(f"batch {number} does not follow the one before")
            link = canonical.link(content.links[-1], content.ends[-1], columns)
            if number >= len(chain) or chain[number] != (number, content.ends[-1] + len(columns.kind), link):
                return broken(f"batch {number} does not match its digest")
            events = canonical.events_of(columns)
            if content.events and events and events[0].time < content.events[-1].time:
                return broken(f"batch {number} begins before the end of the one in front")
            content.events.extend(events)
            content.links.append(link)
            content.ends.append(len(content.events))
    except MissingPackageError as error:
        raise MissingPackageError(f"batch {number + 1} {error}") from error
    except (sqlite3.Error, InputError, ValueError, TypeError, OverflowError) as error:
        if isinstance(error, sqlite3.Error) and _refusal(error):
            raise
        return broken(f"batch {number + 1} cannot be read ({error})")
    if len(chain) > len(content.links):
        return broken(f"{len(chain) - len(content.links)} of {len(chain) - 1} batches are missing at the end")
    return content


def _is_cut(connection: sqlite3.Connection, path: Path) -> bool:
    """Tell whether the file is shorter than it says: SQLite does not, as long as what is asked for is there."""
    pages, size = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("page_count", "page_size"))
    return bool(path.stat().st_size < pages * size)


def _array(shape: str, content: bytes) -> Floats:
    return np.frombuffer(content, dtype="<f8").reshape(json.loads(shape))
