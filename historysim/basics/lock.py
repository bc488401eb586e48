"""The writer's lock of a log: one process writes, any number read."""

import errno
import fcntl
import os
from pathlib import Path


class WriterLock:
    """An advisory lock on the file itself, which the system gives back however the process ends.

    It stays with the file when that is renamed, and leaves nothing behind. SQLite locks a file only for the
    length of a transaction, and otherwise than this (POSIX record locks, not ``flock``), so readers do not meet it.

    Parameters
    ----------
    path : Path
        The file; it is made where there is none.

    Raises
    ------
    OSError
        Another writer has it, or the file cannot be opened to write.
    """

    def __init__(self, path: Path) -> None:
        while True:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # the file may have been renamed or replaced between the two calls
                same = path.exists() and os.path.samestat(os.fstat(handle), path.stat())
            except BlockingIOError:
                os.close(handle)
                message = "another process is writing it; wait until it is done, or end it (readers are not held up)"
                raise OSError(errno.EAGAIN, message, str(path)) from None
            except BaseException:
                os.close(handle)
                raise
            if same:
                break
            os.close(handle)
        self._handle: int | None = handle

    def release(self) -> None:
        """Give the lock back."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
