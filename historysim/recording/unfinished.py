"""The file of a result that is not finished: hidden, beside the result, and of one writer."""

import os
import shutil
from pathlib import Path

from historysim.basics.files import own_file, sync_file, sync_folder
from historysim.basics.lock import WriterLock


class Unfinished:
    """The file that a result is written to until it is complete.

    Parameters
    ----------
    output : Path
        The result.

    Raises
    ------
    OSError
        The file cannot be made, or another process uses it.
    """

    def __init__(self, output: Path) -> None:
        self.path, self._output = output.with_name(f".{output.name}.unfinished"), output
        # not a lock on the file itself, which would keep readers from opening the result
        self._lock_path = output.with_name(f".{output.name}.lock")
        try:
            self._lock = WriterLock(self._lock_path, make=True)
        except BlockingIOError as error:
            raise OSError(error.errno, "another process is writing this result", str(output)) from error
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(output)) from error
        try:
            self.handle = own_file(self.path)
            # a snapshot will say that rows stand in it
            sync_folder(self.path.parent)
        except OSError as error:
            self._release()
            raise OSError(error.errno, error.strerror, str(output)) from error
        # where earlier versions kept rows, which no snapshot of this one knows of
        shutil.rmtree(output.with_name(f".{output.name}.parts"), ignore_errors=True)

    def forget(self) -> None:
        """Forget what an earlier run has written."""
        os.truncate(self.path, 0)

    def publish(self) -> None:
        """Give it the name of the result, when its bytes are on the disk; the name then is, too."""
        sync_file(self.path)
        self.path.replace(self._output)
        sync_folder(self._output.parent)

    def close(self, *, keep: bool) -> None:
        """Leave it, and remove it unless it is kept for a resume."""
        os.close(self.handle)
        if not keep:
            self.path.unlink(missing_ok=True)
        self._release()

    def _release(self) -> None:
        self._lock.remove()
