"""Files that are there, and files that are on the disk whole or not at all."""

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path, unfinished: Path | None = None) -> Iterator[Path]:
    """Yield the name of an empty file that takes the place of another when the block ends without an error.

    Until then the other stays as it is; where the block ends with an error, it stays for good, and the new file is
    removed. The new one is on the disk before it gets its name, and its name before this returns.

    Parameters
    ----------
    path : Path
        The file to write; it need not exist.
    unfinished : Path, optional
        What it is called until then, on the same disk; by default a hidden name of its own beside it.

    Yields
    ------
    Path
        The file to write to instead. It has the permissions that the umask gives.

    Raises
    ------
    OSError
        It cannot be written. The error names `path`, never the other name.
    """
    beside = unfinished or path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        os.close(os.open(beside, os.O_CREAT | os.O_WRONLY | os.O_TRUNC | os.O_CLOEXEC, 0o666))
        yield beside
        sync_file(beside)
        beside.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        # the block may read other files, whose errors stay as they are
        if error.filename not in {None, beside, str(beside), os.fsencode(beside)}:
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        beside.unlink(missing_ok=True)


def is_file(path: Path) -> bool:
    """Return whether there is a file of this name; False for a name that the system does not take."""
    return _is(path.is_file)


def is_folder(path: Path) -> bool:
    """Return whether there is a folder of this name; False for a name that the system does not take."""
    return _is(path.is_dir)


def _is(question: Callable[[], bool]) -> bool:
    try:
        return question()
    except (OSError, ValueError):
        return False


def sync_file(path: Path) -> None:
    """Write what a file holds to the disk (fsync)."""
    _sync(path)


def sync_folder(path: Path) -> None:
    """Write the names in a folder to the disk (fsync): files that were made, renamed or removed there."""
    _sync(path)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
