"""Write a history to a netCDF file, which appears under its name only when all rows stand in it."""

import contextlib
import errno
import os
import shutil
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import attrs
import numpy as np

from historysim.basics import system
from historysim.basics.array_types import Array
from historysim.basics.files import replacing
from historysim.basics.system import read_at, write_at
from historysim.memory.binding import TOTALS
from historysim.memory.rows import Rows
from historysim.recording import recorder
from historysim.recording.file_layout import FileLayout, RowPlace, file_layout
from historysim.recording.recorder import Recorder

if TYPE_CHECKING:
    import h5netcdf


@final
@attrs.define
class FileRecorder(Recorder):
    """Rows of one history, written to the file of a result while the next ones are computed.

    Each byte is written once, to the place where readers will look for it; what makes a result of the rows is written
    at the end. Of the rows of each variable a checksum (CRC-32) goes along, by which is found out whether they stand.
    """

    handle: int
    """Of a file that is open to read and write."""
    attributes: Mapping[str, Any]
    """Of the result."""
    beside: "Callable[[h5netcdf.File], None] | None" = None
    """Writes further groups into the file."""
    writers: int = 2
    """Threads that write."""
    _layout: FileLayout = attrs.field(init=False)
    _sums: list[int] = attrs.field(init=False)
    _held: int = attrs.field(default=0, init=False)
    _times: list[Array] = attrs.field(factory=list, init=False)
    _rows: Rows = attrs.field(init=False)
    _spare: Rows = attrs.field(init=False)
    _writers: ThreadPoolExecutor = attrs.field(init=False)
    _writing: list[Future[None]] = attrs.field(factory=list, init=False)

    def __attrs_post_init__(self) -> None:
        self._layout = file_layout(self, self.attributes, self.beside)
        self._sums = [0] * len(self._layout.places)
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
        return self._layout.size

    def check_room(self, folder: Path) -> None:
        """Check that a folder's disk has room for what is not written yet; an OSError where it has not."""
        needed, free = self.size - 512 * os.fstat(self.handle).st_blocks, shutil.disk_usage(folder).free
        if free < needed:
            raise OSError(
                errno.ENOSPC,
                f"No space left on device: the result needs {needed / 1e6:,.1f} MB more, and {free / 1e6:,.1f} MB are "
                "free; make room",
            )

    def rows_kept(self, known: Mapping[int, Collection[bytes]]) -> Mapping[int, bytes]:
        """Return up to which numbers of rows those in the file are what they were.

        Of the numbers in `known`, with what `flush` has returned there, those up to which nothing has changed.
        """
        kept: dict[int, bytes] = {}
        begun, sums = 0, [0] * len(self._sums)
        # what cannot be read does not stand
        with contextlib.suppress(OSError):
            for rows in sorted(rows for rows in known if rows <= self.steps):
                for first in range(begun, rows, self._most):
                    last = min(first + self._most, rows)
                    sums = [self._read(*each, first, last) for each in zip(self._layout.places, sums, strict=True)]
                begun, written = rows, _digest(sums)
                if written not in known[rows]:
                    break
                kept[rows] = written
        return kept

    def go_on(self, rows: int, written: bytes) -> None:
        """Go on after so many rows, one of the numbers that `rows_kept` has given, with what it has given for it."""
        self._sums = np.frombuffer(written, "<u4").tolist()
        self._filled = rows

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        if self._held and self._held + count > self._most:
            self._hand_over()
        if len(self._rows.totals) < count:
            self._rows = self.new_rows(max(count, self._most))
        return self._rows[self._held : self._held + count]

    def record(self, times: Array) -> None:
        """Record the rows that were given last, now filled, as those at these times [s]."""
        self._times.append(times)
        self._held += times.size
        self._filled += times.size

    def flush(self) -> bytes:
        """Write all rows so far to the disk; return a digest of them, by which `rows_kept` finds out whether they are.

        Rows that cannot be written are an OSError.
        """
        self._written()
        with _reported():
            # macOS has no other call than that which also writes when the file was changed
            getattr(os, "fdatasync", os.fsync)(self.handle)
        return _digest(self._sums)

    def finish(self) -> None:
        """Make a result of the rows, which are all there; an OSError where it cannot be written."""
        self._written()
        with _reported():
            for address, content in self._layout.content.items():
                _put(self.handle, memoryview(content), address)
            os.ftruncate(self.handle, self._layout.size)

    @property
    def _most(self) -> int:
        """Rows that are held, at most, before they are written."""
        return max(1, min(self.steps, recorder.CELLS_AT_ONCE // max(self.columns, len(TOTALS.names or ()))))

    def _hand_over(self) -> None:
        """Let the writers have what is held, and make the rows before the last ones free to be filled again."""
        self._wait()
        rows = self._rows[: self._held]
        values = [np.concatenate(self._times), *(values for _, values in self.projected(rows))]
        first = self._filled - self._held
        self._writing = [self._writers.submit(self._write, index, first, each) for index, each in enumerate(values)]
        self._rows, self._spare = self._spare, self._rows
        self._held, self._times = 0, []

    def _write(self, index: int, first: int, values: Array) -> None:
        """Write rows of one variable."""
        place = self._layout.places[index]
        if place.row_size:
            content = np.ascontiguousarray(values).data.cast("B")
            self._sums[index] = zlib.crc32(content, self._sums[index])
            _put(self.handle, content, place.begin + first * place.row_size)

    def _read(self, place: RowPlace, total: int, first: int, last: int) -> int:
        """Add rows of one variable, as they stand in the file, to a checksum."""
        begin, end = (place.begin + row * place.row_size for row in (first, last))
        return zlib.crc32(read_at(self.handle, end - begin, begin), total)

    def _wait(self) -> None:
        with _reported():
            for writing in self._writing:
                writing.result()
        self._writing = []

    def _written(self) -> None:
        if self._held:
            self._hand_over()
        self._wait()


def _digest(sums: Sequence[int]) -> bytes:
    return np.array(sums, "<u4").tobytes()


def _put(handle: int, content: memoryview, address: int) -> None:
    """Write all of a buffer."""
    done = 0
    while done < content.nbytes:
        done += write_at(handle, content[done:], address + done)


@contextlib.contextmanager
def _reported() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        message = f"the rows cannot be written ({error.strerror}); is the disk full?"
        raise OSError(error.errno or errno.EIO, message) from error


@contextlib.contextmanager
def recording(path: Path, recorder_of: Callable[[int], FileRecorder]) -> Iterator[FileRecorder]:
    """Record into a netCDF file with a recorder made for its handle; it replaces another one when all rows are there.

    Raises OSError: the folder cannot be written to, or the disk is full.
    """
    with replacing(path) as unfinished, opened(unfinished) as handle, recorder_of(handle) as target:
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
