"""The writer's lock of a log: one process writes, any number read."""

import errno
import os
from contextlib import suppress
from pathlib import Path

from historysim.basics import system
from historysim.basics.files import own_file


class WriterLock:
    """An advisory lock on the file itself, which the system releases however the process ends.

    It stays with the file when that is renamed, and leaves nothing behind. SQLite locks otherwise (POSIX record locks,
    not ``flock``), so readers do not meet it. With `make`, the file is made where there is none; see `own_file`.

    Raises OSError: another writer has it, or the file cannot be opened to write.
    """

    _handle: int | None

    def __init__(self, path: Path, *, make: bool = False, begins: tuple[bytes, ...] = ()) -> None:
        while True:
            handle = own_file(path, begins=begins) if make else os.open(path, os.O_RDWR | system.OWN)
            try:
                free = system.lock_file(handle)
                # the file may have been renamed or replaced between the two calls
                same = free and path.exists() and os.path.samestat(os.fstat(handle), path.stat())
            except BaseException:
                os.close(handle)
                raise
            if not free:
                os.close(handle)
                message = "another process is writing it; wait until it is done, or end it (readers are not held up)"
                raise OSError(errno.EAGAIN, message, str(path))
            if same:
                break
            os.close(handle)
        self._path, self._handle = path, handle

    def moved(self, path: Path) -> "WriterLock":
        """Give the locked file another name, in place of another file, and return its lock."""
        if system.REPLACES_OPEN_FILES:
            self._path.replace(path)
            return self
        self.release()
        self._path.replace(path)
        return WriterLock(path)

    def remove(self) -> None:
        """Remove the file, and give the lock back."""
        if system.REPLACES_OPEN_FILES:
            self._path.unlink(missing_ok=True)
            self.release()
            return
        self.release()
        with suppress(OSError):
            # another process may have taken it
            self._path.unlink(missing_ok=True)

    def release(self) -> None:
        """Give the lock back."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
