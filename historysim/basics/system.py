"""What systems do differently, in one place: no other module asks for a call that only some of them have.

===================== ========================================== ==================================================
what                  POSIX (Linux, macOS)                       Windows
===================== ========================================== ==================================================
lock of a whole file  ``flock``, beside which it can be read     a byte far beyond the end of the file
lock of one byte      record locks (``lockf``)                   ``msvcrt.locking``
names in a folder     ``fsync`` of the folder                    on the disk with the file, says NTFS' journal
links                 ``O_NOFOLLOW``                             making one needs a right that users do not have
FIFOs                 ``O_NONBLOCK``                             not among files
replacing, removing   also of a file that is open                refused while a program holds it open
a process that is     a signal of number 0 reaches it            its open files cannot be removed
processors            those that the process may use             all, or ``process_cpu_count``
===================== ========================================== ==================================================

Any of them gives locks back and closes files however a process ends.
"""

import contextlib
import errno
import functools
import hashlib
import importlib
import os
import platform
import threading
import time
from pathlib import Path
from typing import Any

fcntl: Any
try:
    import fcntl
except ImportError:
    fcntl = None

OWN = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
"""Flags to open a file as bytes, and for this process alone."""
NO_LINK = OWN | getattr(os, "O_NOFOLLOW", 0)
"""Flags to open a file so, and under its very name."""
NO_WAIT = getattr(os, "O_NONBLOCK", 0)
"""A flag to open what may be a FIFO, which would wait for a writer otherwise."""
REPLACES_OPEN_FILES = os.name == "posix"
"""Whether a file can be renamed and replaced while it is open."""

_ONE_PLACE = threading.Lock()
_FAR = 1 << 43
"""A byte that no file has, and disks can still tell."""
_HELD = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}
_NO_LOCKS = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP}


def read_at(handle: int, count: int, place: int) -> bytes:
    """Return bytes of an open file from a place on."""
    if hasattr(os, "pread"):
        return os.pread(handle, count, place)
    with _ONE_PLACE:
        os.lseek(handle, place, os.SEEK_SET)
        return os.read(handle, count)


def write_at(handle: int, content: memoryview, place: int) -> int:
    """Write bytes to an open file from a place on; return how many of them were."""
    if hasattr(os, "pwrite"):
        return os.pwrite(handle, content, place)
    # Windows has one place for all threads; those that write take turns there
    with _ONE_PLACE:
        os.lseek(handle, place, os.SEEK_SET)
        return os.write(handle, content)


def lock_file(handle: int) -> bool:
    """Lock an open file for one writer; False where another has it.

    Raises
    ------
    OSError
        The system refuses for another reason, such as a disk without locks.
    """
    if fcntl is None:
        return _lock_on_windows(handle, _FAR, wait=False)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def lock_byte(handle: int, byte: int, *, wait: bool) -> bool:
    """Lock one byte of an open file, which need not be there; False where another process has it.

    Where the disk knows no locks, everybody gets it.

    Raises
    ------
    OSError
        The system refuses for another reason.
    """
    try:
        if fcntl is None:
            return _lock_on_windows(handle, byte, wait=wait)
        fcntl.lockf(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB), 1, byte)
    except OSError as error:
        if error.errno in _HELD:
            return False
        if error.errno not in _NO_LOCKS:
            raise
    return True


def _lock_on_windows(handle: int, byte: int, *, wait: bool) -> bool:
    msvcrt: Any = importlib.import_module("msvcrt")
    while True:
        os.lseek(handle, byte if byte == _FAR else byte % _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            if error.errno not in _HELD:
                raise
            if not wait:
                return False
            # its own waiting ends with an error after ten seconds
            time.sleep(0.05)
        else:
            return True


def sync_folder(path: Path) -> None:
    """Write the names in a folder to the disk, where the system does not do so by itself.

    Raises
    ------
    OSError
        There is none, or the disk refuses.
    """
    if not hasattr(os, "O_DIRECTORY"):
        if not path.is_dir():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def user(found: os.stat_result) -> int:
    """Return the number of the user who runs this process; of whom owns a file, where users have none."""
    return os.geteuid() if hasattr(os, "geteuid") else found.st_uid


@functools.cache
def host() -> str:
    """Return eight digits that tell this machine, and this space of its processes, from others on the same disk."""
    told = platform.node()
    with contextlib.suppress(OSError):
        told += str(os.stat("/proc/self/ns/pid").st_ino)  # noqa: PTH116 - no file of anybody's
    return hashlib.sha256(told.encode("utf-8", "surrogateescape")).hexdigest()[:8]


def is_running(process: int) -> bool:
    """Return whether there is a process of a number; False where the system guards open files by itself."""
    if os.name != "posix":
        # a signal would end it there, and what it holds open is not removed anyway
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
