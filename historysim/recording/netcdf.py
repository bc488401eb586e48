"""Write a history to a netCDF file, which gets its name when all rows are written.

Each variable is one contiguous piece, created before the first row. After the first
`FileRecorder.flush` only rows change in the file until ``complete`` is set: however the process
ends, the file opens and has the rows flushed so far.
"""

import contextlib
import errno
import math
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import attrs
import numpy as np

from historysim.basics.arguments import DIRECTION, Array
from historysim.basics.files import (
    WriterLock,
    own_file,
    path_to_write,
    publish,
    replacing,
    sync_file,
    write_errors,
    write_reason,
)
from historysim.basics.system import sync_folder
from historysim.memory.paths import Rows
from historysim.recording.provenance import find_bounds
from historysim.recording.recorder import (
    CELLS_AT_ONCE,
    FORGOTTEN,
    Recorder,
    asperity_coordinates,
)
from historysim.recording.variables import (
    COMPONENTS,
    COORDINATES,
    OF_DIRECTION,
    SLIDE_TIME,
    Variable,
)

if TYPE_CHECKING:
    import netCDF4

    from historysim.recording.unknown_past import Bounds

TIME = COORDINATES[0]
COMPRESSIONS: dict[str, dict[str, Any]] = {
    "none": {},
    "zlib": {"compression": "zlib", "complevel": 1, "shuffle": True},
    "zstd": {"compression": "zstd", "complevel": 3, "shuffle": True},
}
CHUNK_CELLS, ROWS_OF_A_CHUNK = 1 << 16, 1 << 8
# Values of all chunks across a row: 16 MB, which the netCDF library keeps of a variable while it
# reads.
MOST_CELLS_ACROSS = 1 << 21
CELLS_OF_TOTALS = 1 << 4  # values of a row of totals alone
_BEGINS = (bytes(8), b"\x89HDF\r\n\x1a\n")  # the first bytes of an unfinished file
# Files that could not be written: HDF5 may end the process when one is closed, so none ever is.
_unwritable: "list[netCDF4.Dataset]" = []


def put_attributes(
    holder: "netCDF4.Dataset | netCDF4.Variable[Any]", attributes: Mapping[str, Any]
) -> None:
    """Set attributes of a group or a variable; strings as character arrays, as CF requires."""
    for name, value in attributes.items():
        # R and others know no integer attributes of 8 bytes
        small = isinstance(value, int) and abs(value) <= np.iinfo(np.int32).max
        holder.setncattr(
            name, value.encode() if isinstance(value, str) else np.int32(value) if small else value
        )


def put_variable(
    group: "netCDF4.Dataset",
    name: str,
    dimensions: tuple[str, ...],
    values: Array,
    attributes: Mapping[str, Any],
    *,
    fill_value: float | bool = False,
) -> None:
    """Write a variable, compressed and with checksums, and create missing dimensions."""
    for dimension, size in zip(dimensions, values.shape, strict=True):
        if dimension not in group.dimensions:
            group.createDimension(dimension, size)
    packing: dict[str, Any] = (
        {"compression": "zlib", "shuffle": True, "fletcher32": True} if values.size else {}
    )
    variable = group.createVariable(
        name, values.dtype, dimensions, fill_value=fill_value, **packing
    )
    put_attributes(variable, attributes)
    if values.size:
        variable[...] = values


@final
@attrs.define
class FileRecorder(Recorder):
    """Rows of one history, written to the file of a result.

    Errors of the netCDF library are passed on; `write_errors` around the block explains them.
    """

    path: Path  #: the file; an existing file is replaced unless the recorder continues it
    attributes: Mapping[str, Any]  #: of the result
    #: writes further groups into the file
    write_groups: "Callable[[netCDF4.Dataset], None] | None" = None
    go_on: int = 0  #: number of rows in the file to continue
    #: Compression of the rows; an unfinished compressed file cannot be continued.
    compression: str = "none"
    bounds: "Bounds | None" = None  #: of an unknown past, computed and written after the rows
    _file: "netCDF4.Dataset" = attrs.field(init=False)
    _times: Array = attrs.field(init=False)
    _held: int = attrs.field(default=0, init=False)  #: rows that are not written yet

    def __attrs_post_init__(self) -> None:
        import netCDF4

        self.rows, self._filled, self._times = self.new_rows(0), self.go_on, np.empty(0)
        if self.compression == "none":
            existing_steps = self.path.stat() if self.path.exists() else None
            check_room(self.path.parent, self.size - 512 * getattr(existing_steps, "st_blocks", 0))
        self._file = netCDF4.Dataset(self.path, "a" if self.go_on else "w", format="NETCDF4")
        self._file.set_fill_off()
        if not self.go_on:
            self._declare()
        self._file.set_auto_maskandscale(False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file if it is not finished."""
        if self._file.isopen():
            # the error that ends the block is the one to report
            with contextlib.suppress(RuntimeError):
                self._close()

    @property
    def size(self) -> int:
        """Bytes of all rows."""
        sizes = {"step": self.steps, "asperity": self.columns, DIRECTION: len(COMPONENTS)}
        return sum(
            np.dtype(variable.dtype).itemsize
            * math.prod(sizes[name] for name in variable.dimensions)
            for variable in self._along_steps
        )

    @property
    def _along_steps(self) -> tuple[Variable, ...]:
        """Variables with a value at each step."""
        bounds = () if self.bounds is None else self.bounds.variables
        return (TIME, *self.totals, *self.per_asperity, *bounds)

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        if self._held + count > self._times.size:
            self._put_held()
            cells = max(self.columns, CELLS_OF_TOTALS)
            size = max(count, min(self.steps, max(self.rows_at_once, CELLS_AT_ONCE // cells)))
            if size > self._times.size:
                self.rows, self._times = self.new_rows(size), np.empty(size)
        return self.rows[self._held : self._held + count]

    def record(self, times: Array) -> None:
        """Record the filled rows as the rows at these times [s]."""
        self._times[self._held : self._held + times.size] = times
        self._held += times.size
        self._filled += times.size

    def flush(self) -> None:
        """Write all rows so far to the disk."""
        self._put_held()
        self._file.sync()
        sync_file(self.path)

    def finish(self, *, progress: bool = False) -> None:
        """Write bounds of an unknown past, mark the file as complete and close it; all rows are recorded."""
        self._put_held()
        if self.bounds is not None:
            for where, rows in self.bounds.blocks(progress=progress):
                self._write(where, rows)
            self._file.setncattr(FORGOTTEN, np.float64(self.bounds.forgotten_time))
        if self.slide_time is not None and self.slide_time.size:
            self._file[SLIDE_TIME.name][...] = self.slide_time
        self._file.setncattr("complete", np.int8(1))
        self._close()

    def _close(self) -> None:
        try:
            # a full disk is an error here; in close() HDF5 may end the process
            self._file.sync()
            self._file.close()
        except RuntimeError:
            # a reference that stays keeps netCDF4 from closing it
            _unwritable.append(self._file)
            raise

    def copy_rows(self, source: Path) -> None:
        """Copy all rows from a finished file of the same history."""
        import netCDF4

        with netCDF4.Dataset(source) as dataset:
            dataset.set_auto_maskandscale(False)
            if self.columns:
                self.slide_time = dataset[SLIDE_TIME.name][...]
            for variable in self._along_steps:
                target = self._file[variable.name]
                at_once = (
                    target.shape[0] if target.chunking() == "contiguous" else target.chunking()[0]
                )
                for start in range(0, self.steps, at_once):
                    target[start : start + at_once] = dataset[variable.name][
                        start : start + at_once
                    ]
            if self.bounds is not None:
                self._file.setncattr(FORGOTTEN, dataset.getncattr(FORGOTTEN))
                self.bounds = None

    def _declare(self) -> None:
        """Create all variables, and write the ones that do not vary along the rows."""
        file = self._file
        put_attributes(file, self.attributes)
        # created first, so that only one byte changes at the end
        file.setncattr("complete", np.int8(0))
        if self.bounds is not None:
            file.setncattr(FORGOTTEN, np.float64(math.nan))
        file.createDimension("step", self.steps)
        if self.asperities is not None:
            file.createDimension("asperity", self.columns)
        if self.changes.planar:
            file.createDimension(DIRECTION, len(COMPONENTS))
            # CF has no strings of variable length
            file.createDimension(f"{DIRECTION}_length", 1)
            created = file.createVariable(
                DIRECTION, "S1", (DIRECTION, f"{DIRECTION}_length"), fill_value=False
            )
            put_attributes(created, {"long_name": OF_DIRECTION, "_Encoding": "utf-8"})
            created[...] = np.array(COMPONENTS, "S1")
        # created now, so that only the bytes of values known at the end change then
        once = [] if self.asperities is None else [(SLIDE_TIME, np.full(self.columns, np.nan))]
        fixed = asperity_coordinates(self.ensemble, self.asperities)
        coordinates = [*(variable for variable, _ in fixed), TIME]
        coordinates_on_asperity = (variable for variable, _ in fixed)
        at_end = (variable for variable, _ in once)
        for variable_to_make in (*coordinates_on_asperity, *self._along_steps, *at_end):
            self._make(variable_to_make, coordinates)
        for variable, values in [*fixed, *once]:
            if values.size:
                file[variable.name][...] = values
        if self.write_groups is not None:
            self.write_groups(file)

    def _make(self, variable: Variable, coordinates: Sequence[Variable]) -> None:
        shape = [len(self._file.dimensions[name]) for name in variable.dimensions]
        stored: dict[str, Any] = {"contiguous": True} if math.prod(shape) else {}
        if stored and (options := COMPRESSIONS[self.compression]):
            chunks = (*chunk_shape(shape[0], math.prod(shape[1:2])), *shape[2:])[: len(shape)]
            # by its checksums every reader finds out whether a chunk is still whole
            stored = {"chunksizes": chunks, "fletcher32": True, **options}
        variable_in_file = self._file.createVariable(
            variable.name, variable.dtype, variable.dimensions, fill_value=False, **stored
        )
        put_attributes(variable_in_file, variable.attributes)
        if variable not in coordinates:
            auxiliary = [
                coordinate.name
                for coordinate in coordinates
                if coordinate.dimensions[0] in variable.dimensions
            ]
            put_attributes(
                variable_in_file,
                {"coordinates": " ".join(name for name in auxiliary if name != "asperity")},
            )

    def _put_held(self) -> None:
        if not self._held:
            return
        where = slice(self._filled - self._held, self._filled)
        self._file["time"][where] = self._times[: self._held]
        self._write(where, self.project(self.rows[: self._held]))
        self._held = 0

    def _write(self, where: slice, rows: Sequence[tuple[Variable, Array]]) -> None:
        for variable, values in rows:
            if values.size:
                self._file[variable.name][where] = values


class Unfinished:
    """Hidden file next to a result, written by a single writer until the result is complete.

    When the block ends it is removed, unless an error ends it and rows are `saved_rows`.

    Raises OSError: the file cannot be made, or another process uses it.
    """

    saved_rows = 0  #: rows with which a resume can go on

    def __init__(self, output: Path) -> None:
        self.path, self.output = output.with_name(f".{output.name}.unfinished"), output
        try:
            # not a lock on the file itself, which would keep readers from opening the result
            self._lock = WriterLock(output.with_name(f".{output.name}.lock"), make=True)
            try:
                self._make()
            except OSError:
                self._lock.remove()
                raise
        except OSError as error:
            busy = isinstance(error, BlockingIOError)
            reason = "another process is writing this result" if busy else write_reason(error)
            raise OSError(error.errno, reason, str(output)) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None or not self.saved_rows:
            self.path.unlink(missing_ok=True)
        self._lock.remove()

    def _make(self) -> None:
        with write_errors(self.output, self.path):
            os.close(own_file(self.path, begins=_BEGINS))
            # snapshots will refer to its rows
            sync_folder(self.path.parent)

    def renew(self) -> None:
        """Replace it by an empty file: a damaged file that HDF5 failed to open is neither closed nor reused."""
        self.path.unlink()
        self._make()

    def publish(self) -> None:
        """Rename it to the result: first its bytes reach the disk, then its name."""
        publish(self.path, self.output)


def check_room(folder: Path, needed: int) -> None:
    """Check that the disk of a folder has enough free space [bytes]; otherwise OSError."""
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(
            errno.ENOSPC,
            f"the disk is full: the result needs {needed / 1e6:,.1f} MB more, and {free / 1e6:,.1f} MB are free; "
            "make room",
        )


def chunk_shape(steps: int, columns: int) -> tuple[int, int]:
    """Return rows and columns of a chunk, such that one row or one column of the file is read from few chunks."""
    rows = min(steps, max(1, min(ROWS_OF_A_CHUNK, MOST_CELLS_ACROSS // columns)))
    across = min(columns, CHUNK_CELLS // rows)
    return _even(steps, max(rows, CHUNK_CELLS // across)), _even(columns, across)


def _even(count: int, maximum: int) -> int:
    """Return the size of nearly equal pieces, with little unused space in the last one."""
    size = -(-count // -(-count // maximum))
    return min(
        range(max((size + 1) // 2, size - 16), size + 1), key=lambda size: (-count % size, -size)
    )


def write_replay(job: Any, path: str | Path, *, progress: bool = False) -> None:  # noqa: ANN401 - a `Replay`
    """Replay into a netCDF file, which appears when it is complete."""
    options: dict[str, Any] = {"attributes": job.attributes(), "bounds": find_bounds(job)}
    with (
        replacing(path_to_write(path, ".nc")) as file,
        job.recorder(FileRecorder, path=file, **options) as target,
    ):
        job.walk(target, progress=progress)
        target.finish(progress=progress)
