"""The database of a log: how SQLite is opened, what may stand in it, and what its errors mean."""

import errno
import functools
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from urllib.parse import quote

from historysim.basics.files import beginning, sync_folder
from historysim.errors import InputError

ENDING = ".history"
PATIENCE = 60.0  # seconds that a reader or writer waits for the other's transaction
_EXPECTED = f"expected the log of a run (NAME{ENDING}); restore it from a copy, or run the scenario again"

_HELD = errno.EAGAIN, "another process holds the log; try again when it is done"
_REFUSALS = {
    sqlite3.SQLITE_FULL: (errno.ENOSPC, "No space left on device; what the log holds stands; make room, then go on"),
    sqlite3.SQLITE_IOERR: (errno.EIO, "the log cannot be read or written; is the disk full or gone?"),
    sqlite3.SQLITE_READONLY: (errno.EACCES, "the log, or its folder, is read-only"),
    sqlite3.SQLITE_CANTOPEN: (errno.EACCES, "the log cannot be opened; may its folder be written to?"),
    sqlite3.SQLITE_PERM: (errno.EACCES, "Permission denied"),
    **dict.fromkeys((sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED), _HELD),
    sqlite3.SQLITE_NOMEM: (errno.ENOMEM, "the memory does not suffice"),
}

_JOURNAL = (b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", b"\0")  # what a journal begins with, and one that SQLite has done with

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


@contextmanager
def reported(path: Path) -> Iterator[None]:
    """Turn errors of SQLite into what they are: an OSError of the system, or an InputError of a damaged file."""
    try:
        yield
    except (sqlite3.Error, UnicodeDecodeError) as error:
        if refused := refusal(error):
            raise OSError(*refused, str(path)) from error
        raise InputError(f"{path}: is no log, or damaged ({error}); {_EXPECTED}") from error


def refusal(error: Exception) -> tuple[int, str] | None:
    """Return number and text of what the system has refused; None where the file itself is at fault."""
    return _REFUSALS.get(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF)


def connect(path: Path, mode: str) -> sqlite3.Connection:
    """Open a log, as "ro" or "rw", so that nothing in it is carried out."""
    check_journal(path)
    address = f"file:{quote(str(path.absolute()))}?mode={mode}"
    connection = sqlite3.connect(address, uri=True, timeout=PATIENCE, isolation_level=None)
    try:
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


def check_journal(path: Path) -> Path:
    """Return the journal of a log; an InputError where it is no journal, since SQLite would remove it."""
    journal = path.with_name(f"{path.name}-journal")
    if (first := beginning(journal)) and not first.startswith(_JOURNAL):
        raise InputError(f"{journal}: holds something else than a journal of SQLite; move it away")
    return journal


_OBJECTS = "SELECT type || ' ' || name, coalesce(sql, '') FROM sqlite_master"


@functools.cache
def _schema() -> frozenset[tuple[str, ...]]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        return frozenset(connection.execute(_OBJECTS).fetchall())


def check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file that holds more than a log: SQLite would carry out a view, or a trigger, of somebody else's."""
    objects = set(connection.execute(f"{_OBJECTS} LIMIT {len(_schema()) + 1}").fetchall())
    strange = [f"holds {name}" for name, _ in sorted(objects - _schema())]
    # a log that has lost a trigger is still a log
    missing = [f"has no table {name}" for name in TABLES if f"table {name}" not in dict(objects)]
    if problems := [*strange[:3], *missing]:
        raise InputError(f"{path}: is no log, or damaged: it {' and '.join(problems)}; {_EXPECTED}")


def settle(path: Path) -> None:
    """Undo what a writer that died has left half done in a log that is about to be replaced.

    Otherwise SQLite would take its journal for one of the new file, and the old file would be damaged without it.
    """
    journal = check_journal(path)
    if not journal.exists():
        return
    if path.exists():
        with suppress(InputError), reported(path), closing(connect(path, "rw")) as connection:
            connection.execute("SELECT name FROM sqlite_master").fetchall()
    # it stays where the old file is no log, or gone
    journal.unlink(missing_ok=True)
    sync_folder(path.parent)


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Commit what is executed inside, all or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        # SQLite may have rolled back on its own, where the disk is full
        with suppress(sqlite3.Error):
            connection.execute("ROLLBACK")
        raise


def is_cut(connection: sqlite3.Connection, path: Path) -> bool:
    """Return whether the file is shorter than its header says; SQLite itself looks at what is asked for alone."""
    pages, size = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("page_count", "page_size"))
    return bool(path.stat().st_size < pages * size)
