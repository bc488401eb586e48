"""A plugin of pytest that hides what Windows does not have: ``PYTHONPATH=tests/support pytest -p hidden tests/log``.

``fcntl`` cannot be imported, and calls and flags that POSIX alone has are gone from ``os``. In the
place of ``msvcrt`` is a module with its locks: of bytes of an open file, which belong to that
handle. What it cannot show: files that cannot be renamed or removed while they are open, other
names and paths, and HDF5 and SQLite as they are built there.
"""

import errno
import fcntl
import os
import struct
import subprocess  # noqa: F401 - it takes this for Windows where it finds msvcrt
import sys
import types

_set, _lock_type, _command = fcntl.fcntl, fcntl.F_WRLCK, fcntl.F_OFD_SETLK


def locking(handle: int, _: int, size: int) -> None:
    """Lock bytes from the file position, for this handle alone."""
    flock = struct.pack("hhqqi", _lock_type, os.SEEK_CUR, 0, size, 0)
    try:
        _set(handle, _command, flock)
    except OSError as error:
        raise OSError(errno.EACCES, os.strerror(errno.EACCES)) from error


msvcrt = types.ModuleType("msvcrt")
msvcrt.locking, msvcrt.LK_NBLCK = locking, 2  # type: ignore[attr-defined]
HIDDEN = (
    "O_NOFOLLOW",
    "O_DIRECTORY",
    "O_NONBLOCK",
    "O_CLOEXEC",
    "sched_getaffinity",
    "geteuid",
    "fdatasync",
)


def hide() -> None:
    """Hide it, before anything of historysim is imported."""
    sys.modules["fcntl"] = None  # type: ignore[assignment]
    sys.modules["msvcrt"] = msvcrt
    for name in HIDDEN:
        if hasattr(os, name):
            delattr(os, name)


hide()
