"""Files that are there, and files that are on the disk whole or not at all."""

import errno
import os
import re
import secrets
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from historysim.basics import system
from historysim.errors import InputError

_UNFINISHED = re.compile(r"\.(?P<host>[0-9a-f]{8})-(?P<process>[0-9]+)-[0-9a-f]{16}\.part")
"""What is added to the name of a file while it is written: who writes it, and what nobody can guess."""


@contextmanager
def replacing(path: Path, ending: str = "") -> Iterator[Path]:
    """Yield the name of an empty file that takes the place of another when the block ends without an error.

    Until then the other stays as it is; where the block ends with an error, it stays for good, and the new file is
    removed. The new one is on the disk before it gets its name, and its name before this returns. What processes that
    were killed have left of the same target is removed.

    Parameters
    ----------
    path : Path
        The file to write; it need not exist.
    ending : str
        The ending of the name until then, for those who look at it.

    Yields
    ------
    Path
        The file to write to instead, beside the other, hidden, of a name that cannot be guessed. It has the permissions
        that the umask gives.

    Raises
    ------
    InputError
        What stands there is no regular file: a link, a device, a FIFO.
    OSError
        It cannot be written. The error names `path`, never the other name.
    """
    check_replaceable(path)
    tidy(path)
    token = f"{system.host()}-{os.getpid()}-{secrets.token_hex(8)}"
    beside = path.with_name(f".{path.name}.{token}.part{ending}")
    try:
        os.close(os.open(beside, os.O_CREAT | os.O_EXCL | os.O_WRONLY | system.NO_LINK, 0o666))
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


def tidy(path: Path) -> None:
    """Remove what processes of this machine that are gone have left unfinished of a target."""
    with suppress(OSError):
        for other in os.scandir(path.parent):
            told = _UNFINISHED.match(other.name, len(path.name) + 1)
            if told is None or not other.name.startswith(f".{path.name}.") or told["host"] != system.host():
                continue
            with suppress(OSError):
                if is_own(other.stat(follow_symlinks=False)) and not system.is_running(int(told["process"])):
                    os.unlink(other.path)  # noqa: PTH108 - of an entry


def check_replaceable(path: Path) -> None:
    """Check that what stands under a name, if anything, is a regular file, which may be replaced.

    Raises
    ------
    InputError
        A folder, a link, a device, a FIFO or a socket.
    """
    if path.is_symlink():
        raise InputError(f"{path}: is a link; expected the name of a file to write, such as that to which it leads")
    try:
        mode = path.lstat().st_mode
    except (OSError, ValueError):
        return
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise InputError(f"{path}: is {_called(mode)}; expected the name of a file to write")


def own_file(path: Path, *, shared: bool = False) -> int:
    """Open a file of a known name to read and write, and make it where there is none.

    What stands there has to be one's own: others may put links and files under names that they can guess.

    Parameters
    ----------
    path : Path
    shared : bool
        It may be somebody else's, too: nothing is written to it.

    Returns
    -------
    int
        Its handle.

    Raises
    ------
    OSError
        It cannot be opened, or is a link, no regular file, or of somebody else.
    """
    flags = os.O_RDWR | os.O_CREAT | system.NO_LINK | system.NO_WAIT
    try:
        handle = os.open(path, flags, 0o666)
    except OSError as error:
        if path.is_symlink():
            message = f"{path.name} is a link, which is not followed, since others may have put it there; remove it"
            raise OSError(error.errno, message, str(path)) from None
        raise
    found = os.fstat(handle)
    if not (is_own(found) or (shared and stat.S_ISREG(found.st_mode))):
        os.close(handle)
        raise PermissionError(errno.EPERM, f"{path.name} is not a regular file of yours alone; remove it", str(path))
    return handle


def is_own(found: os.stat_result) -> bool:
    """Return whether a file is regular, one's own, and called by no other name."""
    return stat.S_ISREG(found.st_mode) and found.st_nlink == 1 and found.st_uid == system.user(found)


def is_file(path: Path) -> bool:
    """Return whether there is a file of this name; False for a name that the system does not take."""
    return _is(path.is_file)


def what_is_there(path: Path) -> str:
    """Return why a name is none of a regular file, such as ``"is a folder"``; empty where it is one."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return "there is no such file"
    return "" if stat.S_ISREG(mode) else f"is {_called(mode)}"


def _called(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a FIFO" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"


def _is(question: Callable[[], bool]) -> bool:
    try:
        return question()
    except (OSError, ValueError):
        return False


def sync_file(path: Path) -> None:
    """Write what a file holds to the disk (fsync)."""
    handle = os.open(path, os.O_RDWR | system.NO_LINK)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_folder(path: Path) -> None:
    """Write the names in a folder to the disk (fsync): files that were made, renamed or removed there."""
    system.sync_folder(path)
