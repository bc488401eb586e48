"""Write a history to a netCDF file, which appears under its name only when all rows stand in it."""

import contextlib
import errno
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics import system
from historysim.basics.files import replacing
from historysim.memory.rows import TOTALS_OF_ROW, Rows
from historysim.recording import recorder
from historysim.recording.changes import STEADY, Changes
from historysim.recording.recorder import Recorder
from historysim.recording.row_file import RowFile
from historysim.recording.skeleton import skeleton

if TYPE_CHECKING:
    import h5netcdf

Array = npt.NDArray[Any]


@final
@attrs.define
class FileRecorder(Recorder):
    """Rows of one history, written to the file of a result while the next ones are computed.

    Every variable has checksums (Fletcher-32), which the netCDF library checks on reading.

    Parameters
    ----------
    handle : int
        Of a file that is open to read and write.
    attributes : dict
        Of the result.
    beside : callable, optional
        Writes further groups into the file.
    writers : int
        Threads that write.

    Raises
    ------
    OSError
        The disk has no room for the result.
    """

    handle: int
    attributes: Mapping[str, Any]
    beside: "Callable[[h5netcdf.File], None] | None" = None
    writers: int = 2
    _file: RowFile = attrs.field(init=False)
    _held: int = attrs.field(default=0, init=False)
    _times: list[Array] = attrs.field(factory=list, init=False)
    _rows: Rows = attrs.field(init=False)
    _spare: Rows = attrs.field(init=False)
    _writers: ThreadPoolExecutor = attrs.field(init=False)
    _writing: list[Future[None]] = attrs.field(factory=list, init=False)

    def __attrs_post_init__(self) -> None:
        self._file = RowFile(self.handle, skeleton(self, self.attributes, self.beside))
        self._rows, self._spare = self.new_rows(0), self.new_rows(0)
        self._writers = ThreadPoolExecutor(self.writers, thread_name_prefix="writer")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Wait until nothing is written any more."""
        self._writers.shutdown(cancel_futures=True)

    @property
    def size(self) -> int:
        """Bytes of the whole result."""
        return self._file.size

    def check_room(self, folder: Path) -> None:
        """Check that a folder's disk has room for what is not written yet.

        Raises
        ------
        OSError
            It has not.
        """
        needed, free = self._file.missing, shutil.disk_usage(folder).free
        if free < needed:
            raise OSError(
                errno.ENOSPC,
                f"No space left on device: the result needs {needed / 1e6:,.1f} MB more, and {free / 1e6:,.1f} MB are "
                "free; make room",
            )

    def standing(self, known: Mapping[int, Iterable[bytes]]) -> Mapping[int, object]:
        """Return where the rows of an earlier run, of which `flush` has told, still stand; see `RowFile.standing`."""
        return self._file.standing(known)

    def go_on(self, rows: int, standing: Mapping[int, Any]) -> None:
        """Go on after so many rows, one of the numbers that `standing` has given."""
        self._file.strips = standing[rows]
        self._filled = rows

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        most = max(1, min(self.steps, recorder.CELLS_AT_ONCE // max(self.columns, TOTALS_OF_ROW)))
        if self._held and self._held + count > most:
            self._hand_over()
        if len(self._rows.totals) < count:
            self._rows = self.new_rows(max(count, most))
        return Rows._make(array[self._held : self._held + count] for array in self._rows)

    def record(self, times: Array) -> None:
        """Record the rows that were given last, now filled, as those at these times [s]."""
        self._times.append(times)
        self._held += times.size
        self._filled += times.size

    def flush(self) -> bytes:
        """Write all rows so far to the disk; return a digest of them, by which `standing` finds out whether they are.

        Raises
        ------
        OSError
            They cannot be written.
        """
        self._written()
        with _reported():
            return self._file.sync()

    def finish(self) -> None:
        """Make a result of the rows.

        Raises
        ------
        OSError
            It cannot be written.
        """
        self._written()
        with _reported():
            self._file.finish()

    def _hand_over(self) -> None:
        """Let the writers have what is held, and make the rows before the last ones free to be filled again."""
        self._wait()
        rows = Rows._make(array[: self._held] for array in self._rows)
        values = [np.concatenate(self._times), *(values for _, values in self.projected(rows))]
        self._writing = [
            self._writers.submit(strip.write, each) for strip, each in zip(self._file.strips, values, strict=True)
        ]
        self._rows, self._spare = self._spare, self._rows
        self._held, self._times = 0, []

    def _wait(self) -> None:
        with _reported():
            for writing in self._writing:
                writing.result()
        self._writing = []

    def _written(self) -> None:
        if self._held:
            self._hand_over()
        self._wait()


@contextlib.contextmanager
def _reported() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        message = f"the rows cannot be written ({error.strerror}); is the disk full?"
        raise OSError(error.errno or errno.EIO, message) from error


@contextlib.contextmanager
def recording(
    path: Path,
    ensemble: Ensemble,
    asperities: npt.NDArray[np.int64] | None,
    steps: int,
    attributes: Mapping[str, Any],
    instrument: Instrument = RIGID,
    *,
    changes: Changes = STEADY,
    writers: int = 2,
) -> Iterator[FileRecorder]:
    """Record into a netCDF file, which appears under its name only when all rows stand in it.

    Parameters
    ----------
    path : Path
        An existing file is replaced, at the end.
    ensemble, asperities, steps, attributes, instrument, changes, writers
        See `FileRecorder`.

    Raises
    ------
    OSError
        The folder cannot be written to, or the disk is full.
    """
    with replacing(path) as unfinished, opened(unfinished) as handle:
        place = (ensemble, asperities, steps)
        with FileRecorder(
            *place, handle, attributes, instrument=instrument, changes=changes, writers=writers
        ) as target:
            target.check_room(path.parent)
            yield target
            target.finish()


@contextlib.contextmanager
def opened(path: Path) -> Iterator[int]:
    """Open a file that is there, to read and write, and close it when the block ends."""
    handle = os.open(path, os.O_RDWR | system.OWN)
    try:
        yield handle
    finally:
        os.close(handle)
