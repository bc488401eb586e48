"""The database of a log: how SQLite is opened, what may stand in it, and what its errors mean."""

import errno
import functools
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from urllib.parse import quote

from historysim.basics.files import sync_folder
from historysim.errors import InputError

ENDING = ".history"
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


@contextmanager
def reported(path: Path) -> Iterator[None]:
    """Say what SQLite has met as what it is: the system's refusal, or a damaged file."""
    try:
        yield
    except (sqlite3.Error, UnicodeDecodeError) as error:
        if refused := refusal(error):
            raise OSError(*refused, str(path)) from error
        raise InputError(
            f"{path}: is no log, or damaged ({error}); expected the log of a run (NAME{ENDING}); restore it from a "
            "copy, or run the scenario again"
        ) from error


def refusal(error: Exception) -> tuple[int, str] | None:
    """Say what the system has refused, with its number; None where the file itself is at fault."""
    return REFUSALS.get(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF)


def connect(path: Path, mode: str) -> sqlite3.Connection:
    """Open a log, as "ro" or "rw"; nothing that stands in it is carried out."""
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


@functools.cache
def _schema() -> frozenset[tuple[str, ...]]:
    """Return what a log holds, as SQLite tells it."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        return frozenset(connection.execute(_TOLD).fetchall())


_TOLD = "SELECT type, name, tbl_name, coalesce(sql, '') FROM sqlite_master"


def check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file that holds more than a log: a view, or a trigger of another's, would be carried out."""
    objects = set(connection.execute(f"{_TOLD} LIMIT {len(_schema()) + 1}").fetchall())
    strange = sorted(f"{kind} {name}" for kind, name, *_ in objects - _schema())
    missing = sorted(set(TABLES) - {name for _, name, *_ in objects})
    # what a log has lost, such as a trigger, cannot do anything
    if strange or missing:
        problems = [f"holds {', '.join(strange[:3])}, other than a log does"] if strange else []
        problems += [f"has no table {', '.join(missing[:3])}"] if missing else []
        raise InputError(
            f"{path}: is no log, or damaged: it {' and '.join(problems)}; expected the log of a run (NAME{ENDING}); "
            "restore it from a copy, or run the scenario again"
        )


def unsound(connection: sqlite3.Connection) -> str:
    """Return what SQLite finds wrong with the pages of a file; empty where nothing is."""
    report = connection.execute("PRAGMA quick_check(1)").fetchone()
    return "" if report is None or report[0] == "ok" else str(report[0]).replace("\n", " ")


def settle(path: Path) -> None:
    """Undo what a writer that died has left half done in a log that is about to be replaced.

    SQLite would take its journal for one of the new file. Without it, the old file would be damaged.
    """
    journal = path.with_name(f"{path.name}-journal")
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
    """Tell whether the file is shorter than it says: SQLite does not, as long as what is asked for is there."""
    pages, size = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("page_count", "page_size"))
    return bool(path.stat().st_size < pages * size)
