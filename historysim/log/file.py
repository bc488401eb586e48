"""The file of a log: SQLite, in which events are only ever appended, batch by batch, each chained to the one before.

The journal is SQLite's rollback journal, not its write-ahead log: between transactions a log is one file that can be
copied, mailed and read from a read-only folder. The price, that a reader waits while a batch is committed, is small,
since batches are few and large. With ``synchronous=EXTRA`` a committed batch outlives a loss of power as well.
"""

import json
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, Self

import attrs
import numpy as np

from historysim.basics.files import SQLITE, WriterLock, check_replaceable, is_log, kind_text, sync_folder
from historysim.errors import InputError, MissingPackageError
from historysim.loads.event_sequence import Events, check_components, check_sequence, components, loads_of, time_text
from historysim.loads.events import Event
from historysim.log import canonical
from historysim.log.database import (
    ENDING,
    SCHEMA,
    check_journal,
    check_schema,
    connect,
    is_cut,
    refusal,
    reported,
    settle,
    transaction,
)
from historysim.log.header import LogHeader, head_from

MOST_EVENTS_OF_A_BATCH = 1 << 16
# Bytes that a value of a log may have in any case; no value is longer than twice the file besides.
SHORTEST_LIMIT = 1_000_000


@attrs.frozen
class Content:
    """What stands in a log, as far as the chain holds."""

    events: Events = attrs.field(repr=False)
    links: list[bytes] = attrs.field(repr=False)  #: of the head, and after each batch
    ends: list[int] = attrs.field(repr=False)  #: number of events up to each link
    problem: str = ""  #: what is wrong after these events; empty where nothing is

    def batches_for(self, count: int) -> int:
        """Count the batches in which so many events stand."""
        return int(np.searchsorted(self.ends, count))


class LogFile:
    """A log on disk; with `write` the writer's lock is taken at once.

    Raises
    ------
    InputError
        There is no such file, or it is no log, or its head is damaged.
    OSError
        It cannot be opened, or another process is writing it.
    """

    def __init__(self, path: Path, *, write: bool = False, lock: WriterLock | None = None) -> None:
        self.path = path
        if not is_log(path) and (problem := kind_text(path)):
            raise InputError(f"{path}: {problem}; expected the log of a run (NAME{ENDING})")
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
        """Make a log and take the writer's lock; it appears under its name when all its events stand in it.

        Raises InputError: events that cannot be used. OSError: it cannot be written, or another process is writing one
        of this name.
        """
        checked_events(head, events)
        check_replaceable(path)
        unfinished = path.with_name(f".{path.name}.part")
        try:
            lock = WriterLock(unfinished, make=True, begins=(SQLITE,))
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from None
        try:
            if path.exists():
                # whoever writes the old one must be done before it is replaced
                WriterLock(path).release()
            os.truncate(unfinished, 0)
            check_journal(unfinished).unlink(missing_ok=True)
            with reported(path), closing(connect(unfinished, "rw")) as connection:
                # a crash before it has its name leaves nothing behind that anybody asks for
                connection.execute("PRAGMA journal_mode = MEMORY")
                connection.executescript(f"BEGIN IMMEDIATE; {SCHEMA}")
                _put_head(connection, head)
                connection.execute("COMMIT")
                list(_put_events(connection, [head.link], [0], events))
            settle(path)
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
                check_schema(connection, self.path)
                content = _read(connection, self.head)
                if not content.problem and is_cut(connection, self.path):
                    content = attrs.evolve(content, problem="the file was cut")
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

    def rows(self, query: str, *values: int) -> list[tuple[Any, ...]]:
        """Return what a query finds in the log; damage is an InputError."""
        with reported(self.path), self._reading() as connection:
            return connection.execute(query, values).fetchall()

    # -- writing -----------------------------------------------------------------------------------

    def lock(self) -> None:
        """Take the writer's lock, if this is not the writer yet; an OSError where it is not to be had."""
        if self._lock is None:
            self._lock = WriterLock(self.path)

    def append(self, events: Sequence[Event]) -> None:
        """Append events, in batches of one transaction each.

        Raises InputError: events that cannot be used, or the log is damaged. OSError: another process is writing it, or
        the disk is full; the batches before stand.
        """
        self.lock()
        content = self.sound()
        events = Events(events) if not isinstance(events, Events) else events
        checked_events(self.head, events, content.events)
        with reported(self.path):
            for batch in _put_events(self._open, content.links, content.ends, events):
                self._content = content = attrs.evolve(content, events=Events.joined([content.events, batch]))

    def insert(self, query: str, values: tuple[int | str | bytes, ...]) -> None:
        """Put something beside the events into the log, in a transaction."""
        self.lock()
        with reported(self.path), transaction(self._open):
            self._open.execute(query, values)

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
            return connect(self.path, mode)

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
            check_schema(connection, self.path)
            row = connection.execute("SELECT settings FROM head").fetchone()
            first = connection.execute("SELECT link FROM chain WHERE number = 0").fetchone()
            if row is None or first is None:
                raise InputError(f"{self.path}: is damaged: it has no head; restore it from a copy, or run again")
            try:
                arrays = {
                    name: np.frombuffer(content, dtype="<f8").reshape(json.loads(shape))
                    for name, shape, content in connection.execute("SELECT name, shape, content FROM array")
                }
                head = head_from(row[0], arrays, link=first[0])
            except InputError as error:
                raise type(error)(f"{self.path}: {error}") from error
            except (ValueError, TypeError, KeyError, OverflowError, AttributeError, RecursionError) as error:
                raise InputError(
                    f"{self.path}: is damaged: its head cannot be read ({error}); restore it from a copy, or run the "
                    "scenario again"
                ) from error
        return head


def checked_events(head: LogHeader, events: Sequence[Event], before: Sequence[Event] = ()) -> None:
    """Check that events may follow others in a log; else it is an InputError."""
    check_sequence(events)
    if events and before and events[0].time < before[-1].time:
        raise InputError(
            f"event 0 at t = {time_text(events[0].time)}: comes before the last event of the log, at t = "
            f"{time_text(before[-1].time)}; expected later ones: what a log holds does not change; historysim fork "
            "copies the past up to a time, for another future"
        )
    check_components(components(before) | components(events))
    count = len(head.ensemble)
    # loads fit any number of asperities
    for index, event in enumerate(events if loads_of(events) is None else ()):
        if problem := event.problem(count):
            raise InputError(f"event {index} at t = {time_text(event.time)}: {problem}")


def links_of(head: LogHeader, events: Sequence[Event]) -> list[bytes]:
    """Return the links of the log that `LogFile.create` makes, without making it."""
    links = [head.link]
    for first in range(0, len(events), MOST_EVENTS_OF_A_BATCH):
        columns = canonical.columns_of(events[first : first + MOST_EVENTS_OF_A_BATCH])
        links.append(canonical.link(links[-1], first, columns))
    return links


def _put_head(connection: sqlite3.Connection, head: LogHeader) -> None:
    connection.execute("INSERT INTO head VALUES (1, ?)", (head.text,))
    for name, values in sorted(head.arrays.items()):
        connection.execute("INSERT INTO array VALUES (?, ?, ?)", (name, json.dumps(values.shape), values.tobytes()))
    connection.execute("INSERT INTO chain VALUES (0, 0, ?)", (head.link,))


def _put_events(
    connection: sqlite3.Connection, links: list[bytes], ends: list[int], events: Sequence[Event]
) -> Iterator[Events]:
    """Append events, and their links to those that are there; yield them batch by batch, when they stand."""
    events = events if isinstance(events, Events) else Events(events)
    for start in range(0, len(events), MOST_EVENTS_OF_A_BATCH):
        batch = events[start : start + MOST_EVENTS_OF_A_BATCH]
        columns = canonical.columns_of(batch)
        number, first = len(links), ends[-1]
        link = canonical.link(links[-1], first, columns)
        with transaction(connection):
            connection.execute("INSERT INTO batch VALUES (?, ?, ?, ?, ?, ?)", (number, first, *columns))
            connection.execute("INSERT INTO chain VALUES (?, ?, ?)", (number, first + len(batch), link))
        links.append(link)
        ends.append(first + len(batch))
        yield batch


def _read(connection: sqlite3.Connection, head: LogHeader) -> Content:
    links, ends, batches = [head.link], [0], [Events()]

    def content(problem: str = "") -> Content:
        return Content(Events.joined(batches), links, ends, problem)

    number = 0
    try:
        # both tables are read: each shows where the other has lost its end
        chain = connection.execute("SELECT number, events, link FROM chain ORDER BY number").fetchall()
        rows = connection.execute("SELECT number, first, kind, time, value, coefficients FROM batch ORDER BY number")
        for number, row in enumerate(rows, start=1):
            columns = canonical.Columns(*row[2:])
            if not all(isinstance(column, bytes) for column in columns) or row[:2] != (number, ends[-1]):
                return content(f"batch {number} does not follow the one before")
            link = canonical.link(links[-1], ends[-1], columns)
            if number >= len(chain) or chain[number] != (number, ends[-1] + len(columns.kind), link):
                return content(f"batch {number} does not match its digest")
            events = canonical.events_of(columns)
            if len(batches[-1]) and len(events) and events[0].time < batches[-1][-1].time:
                return content(f"batch {number} begins before the end of the one in front")
            batches.append(events)
            links.append(link)
            ends.append(ends[-1] + len(events))
    except MissingPackageError as error:
        raise MissingPackageError(f"batch {number + 1} {error}") from error
    except (sqlite3.Error, InputError, ValueError, TypeError, OverflowError) as error:
        if isinstance(error, sqlite3.Error) and refusal(error):
            raise
        return content(f"batch {number + 1} cannot be read ({error})")
    if len(chain) > len(links):
        return content(f"{len(chain) - len(links)} of {len(chain) - 1} batches are missing at the end")
    return content()
