"""Rows of a run that is under way, in closed files beside its result.

A netCDF file that is open when the process dies cannot be trusted, and one that is opened again to go on is open. So
rows are kept in files that are written once, whole, and put together when all are there: after a crash, what was
written stands, and only what came after the last snapshot is computed again. Projecting all rows from the log again
would save the space that they take, and cost the whole run.
"""

import errno
import shutil
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.files import replacing, sync_folder
from historysim.basics.lock import WriterLock
from historysim.errors import InputError
from historysim.memory.rows import TOTALS_OF_ROW, Rows
from historysim.recording import recorder

Array = npt.NDArray[Any]

DAMAGE = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, RuntimeError, tokenize.TokenError)
"""What reading a damaged NPZ file may raise."""


class Parts:
    """The folder with the parts of one result.

    Parameters
    ----------
    output : Path
        The result; the folder is a hidden one beside it.
    key : bytes
        Digest of the log that is replayed; parts of another are not taken for its own.
    columns : int
        Recorded asperities.

    Raises
    ------
    OSError
        The folder cannot be made, or another process uses it.
    """

    def __init__(self, output: Path, key: bytes, columns: int) -> None:
        self.folder = output.with_name(f".{output.name}.parts")
        self.unfinished = self.folder / "result.nc"
        self._key, self._columns = np.frombuffer(key, dtype=np.uint8), columns
        try:
            self.folder.mkdir(exist_ok=True)
            # a snapshot will say that rows stand in it
            sync_folder(self.folder.parent)
            self._lock = WriterLock(self.folder / "lock")
        except BlockingIOError as error:
            raise OSError(error.errno, "another process is writing this result", str(output)) from error
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(output)) from error

    def close(self, *, keep: bool) -> None:
        """Leave the folder, and remove it unless it is kept for a resume."""
        if not keep:
            shutil.rmtree(self.folder, ignore_errors=True)
        self._lock.release()

    def write(self, first: int, times: Array, rows: Rows) -> None:
        """Write rows, of which the first has a number, to a file that is there whole or not at all."""
        path = self._path(first)
        try:
            with replacing(path, path.with_suffix(".part")) as unfinished, unfinished.open("wb") as stream:
                np.savez(stream, key=self._key, first=first, times=times, **rows._asdict())
        except OSError as error:
            message = f"the rows cannot be written ({error.strerror}); is the disk full? then go on with --resume"
            raise OSError(error.errno or errno.EIO, message, str(self.folder)) from error

    def read(self, first: int) -> tuple[Array, Rows]:
        """Read the rows from one on.

        Raises
        ------
        InputError
            There is no such part, or it is damaged or of another log.
        """
        try:
            # np.load leaves a file open that is no archive, where it has opened it itself
            with self._path(first).open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                if not np.array_equal(file["key"], self._key) or file["first"] != first:
                    raise InputError(f"{self._path(first)}: belongs to another log, or elsewhere")
                times = file["times"]
                rows = Rows._make(file[name] for name in Rows._fields)
        except DAMAGE as error:
            raise InputError(f"{self._path(first)}: is missing or damaged ({error})") from error
        if rows.totals.shape != (times.size, TOTALS_OF_ROW) or rows.normal_load.shape != (times.size, self._columns):
            raise InputError(f"{self._path(first)}: holds other rows than expected")
        return times, rows

    def ends(self) -> list[int]:
        """Numbers of rows after which one of the parts that follow one another from the beginning ends; 0 first."""
        found = [0]
        while self._path(found[-1]).exists():
            if not (count := self._intact(found[-1])):
                break
            found.append(found[-1] + count)
        return found

    def _intact(self, first: int) -> int:
        """Count the rows of a part; 0 where it is damaged or of another log."""
        try:
            # reading checks the CRC of every array
            times, _ = self.read(first)
        except InputError:
            return 0
        return int(times.size)

    def forget(self, first: int) -> None:
        """Remove what begins with a row or later, and what is unfinished."""
        for path in self.folder.iterdir():
            number = path.stem if path.suffix == ".npz" else ""
            if path.name != "lock" and not (number.isdecimal() and int(number) < first):
                path.unlink()

    def check_space(self, output: Path) -> None:
        """Check that a result of all parts has space on the disk: HDF5 may crash where it meets the end of it.

        Raises
        ------
        OSError
            It has not.
        """
        needed = sum(path.stat().st_size for path in self.folder.glob("*.npz"))
        if shutil.disk_usage(self.folder).free < needed:
            message = f"No space left on device: the result needs {needed / 1e6:,.0f} MB; then go on with --resume"
            raise OSError(errno.ENOSPC, message, str(output))

    def all(self, steps: int) -> Iterator[tuple[Array, Rows]]:
        """Read all parts, in order."""
        first = 0
        while first < steps:
            times, rows = self.read(first)
            yield times, rows
            first += times.size

    def _path(self, first: int) -> Path:
        return self.folder / f"{first:012d}.npz"


@final
@attrs.define
class PartRecorder(recorder.Recorder):
    """Rows of one history, gathered into parts.

    Parameters
    ----------
    parts : Parts
    written : int
        Rows that stand in them already.
    """

    parts: Parts
    written: int
    _gathered: list[tuple[Array, Rows]] = attrs.field(factory=list, init=False)
    _rows: Rows = attrs.field(init=False)

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        if self._gathered and (self._filled + count) * max(self.columns, 1) > recorder.CELLS_AT_ONCE:
            self.flush()
        self._rows = self.new_rows(count)
        return self._rows

    def record(self, times: Array) -> None:
        """Record the rows that were given last, now filled, as those at these times [s]."""
        if times.size:
            self._gathered.append((times, self._rows))
            self._filled += times.size

    def flush(self) -> None:
        """Write what is gathered."""
        if not self._gathered:
            return
        times = np.concatenate([times for times, _ in self._gathered])
        each = zip(*(rows for _, rows in self._gathered), strict=True)
        rows = self._gathered[0][1] if len(self._gathered) == 1 else Rows._make(map(np.concatenate, each))
        self.parts.write(self.written, times, rows)
        self.written += times.size
        self._gathered, self._filled = [], 0
