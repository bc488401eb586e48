"""A result as it is before any row stands in it: all that HDF5 writes by itself, and where the rows are to go.

The file is made in memory, where the room that HDF5 takes for rows is a hole. What is left are some kilobytes, which
are written last, around rows that stand: until then no reader takes the file for a result. It comes out the same each
time, so that nothing but rows has to be kept of a run that was ended.
"""

import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np
import numpy.typing as npt

from historysim.recording.fletcher import SIZE
from historysim.recording.recorder import Recorder, coordinates_of
from historysim.recording.variables import COORDINATES, Variable

if TYPE_CHECKING:
    import h5netcdf

Array = npt.NDArray[Any]

CHUNK_CELLS, ROWS_OF_A_CHUNK = 1 << 16, 1 << 8
MOST_CELLS_ACROSS = 1 << 21
"""Values of all chunks across a row: 16 MB, which the netCDF library keeps of a variable while it reads."""
PAGE = 1 << 12
SMALLEST_HOLE = 1 << 9


@attrs.frozen(eq=False)
class Place:
    """Where the rows of a variable go.

    Attributes
    ----------
    name : str
    dtype : numpy.dtype
    steps, columns : int
        Rows, and values of each.
    chunk : (int, int)
        Rows and columns of a chunk; at the ends of the variable some of them are not used.
    address : array (band, chunk across) of int
        Where each chunk begins in the file; its checksum stands behind it.
    """

    name: str
    dtype: np.dtype[Any]
    steps: int
    columns: int
    chunk: tuple[int, int]
    address: npt.NDArray[np.int64] = attrs.field(repr=False)

    @property
    def row_size(self) -> int:
        """Bytes of a row of a chunk."""
        return self.chunk[1] * self.dtype.itemsize

    @property
    def chunk_size(self) -> int:
        """Bytes of a chunk."""
        return self.chunk[0] * self.row_size


@attrs.frozen(eq=False)
class Skeleton:
    """A result without its rows.

    Attributes
    ----------
    size : int
        Bytes of the whole file.
    content : dict
        What stands in it beside the rows: bytes by where they begin.
    places : tuple of Place
        Of ``time`` and of all variables that have rows, in the order in which recorders give them.
    """

    size: int
    content: Mapping[int, bytes] = attrs.field(repr=False)
    places: tuple[Place, ...] = attrs.field(repr=False)


def skeleton(
    recorder: Recorder, attributes: Mapping[str, Any], beside: Callable[["h5netcdf.File"], None] | None = None
) -> Skeleton:
    """Return the result that a recorder is to fill.

    Parameters
    ----------
    recorder : Recorder
    attributes : dict
        Of the file; ``complete`` follows them.
    beside : callable, optional
        Writes further groups into the open file.
    """
    import h5netcdf

    image = _Image()
    with h5netcdf.File(image, "w") as file:
        put_attributes(file, attributes)
        file.dimensions["step"] = recorder.steps
        if recorder.asperities is not None:
            file.dimensions["asperity"] = recorder.columns
        fixed = coordinates_of(recorder.ensemble, recorder.asperities)
        along = (COORDINATES[0], *recorder.totals, *recorder.per_asperity)
        declared = [*(variable for variable, _ in fixed), *along]
        auxiliary = [variable for variable in declared if variable in COORDINATES and variable.name != "asperity"]
        for variable in declared:
            made = _declare(file, variable)
            put_attributes(made, variable.attributes)
            if variable not in COORDINATES:
                there = [one.name for one in auxiliary if one.dimensions[0] in variable.dimensions]
                put_attributes(made, {"coordinates": " ".join(there)})
        for variable, values in fixed:
            if values.size:
                file[variable.name][...] = values
        if beside is not None:
            beside(file)
        put_attributes(file, {"complete": np.int8(1)})
        places = tuple(_place(file, variable) for variable in along)
    return Skeleton(image.size, dict(_around(image, places)), places)


def put_attributes(holder: Any, attributes: Mapping[str, Any]) -> None:
    """Give a group or a variable attributes; texts as arrays of characters, which is what CF asks for."""
    import h5py

    for name, value in attributes.items():
        if isinstance(value, str):
            content = value.encode()
            kind = h5py.string_dtype("utf-8", max(len(content), 1))
            holder.attrs[name] = np.array(content, dtype=kind) if content else h5py.Empty("S1")
        else:
            # R and others know no integer attributes of 8 bytes
            small = isinstance(value, int) and abs(value) <= np.iinfo(np.int32).max
            holder.attrs[name] = np.int32(value) if small else value


def chunk_shape(steps: int, columns: int) -> tuple[int, int]:
    """Return how many rows and columns a chunk has.

    Few enough of both that one row of all columns, and one column of all rows, are each read without reading much
    else.
    """
    rows = min(steps, max(1, min(ROWS_OF_A_CHUNK, MOST_CELLS_ACROSS // columns)))
    across = min(columns, CHUNK_CELLS // rows)
    rows = min(steps, max(rows, CHUNK_CELLS // across))
    # all of about the same size, so that little room is lost at the ends
    return _even(steps, rows), _even(columns, across)


def _even(count: int, most: int) -> int:
    size = -(-count // -(-count // most))
    return min(range(max((size + 1) // 2, size - 16), size + 1), key=lambda size: (-count % size, -size))


def _declare(file: "h5netcdf.File", variable: Variable) -> Any:
    """Make a variable, and take all its room at once."""
    from h5py import h5d, h5p

    sizes = [file.dimensions[name].size for name in variable.dimensions]
    if 0 in sizes:
        # nothing to sum up, and HDF5 has no chunks of nothing
        return file.create_variable(variable.name, variable.dimensions, variable.dtype)
    whole = chunk_shape(sizes[0], math.prod(sizes[1:]))
    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5d.FILL_TIME_ALLOC)
    options: dict[str, Any] = {"chunks": whole[: len(sizes)], "fletcher32": True, "dcpl": plan}
    return file.create_variable(variable.name, variable.dimensions, variable.dtype, **options)


def _place(file: "h5netcdf.File", variable: Variable) -> Place:
    """Ask HDF5 where the chunks of a variable are."""
    # h5netcdf has no interface to chunks of its own
    dataset = file._h5file[variable.name]  # noqa: SLF001 - see above
    steps, columns = dataset.shape[0], math.prod(dataset.shape[1:])
    chunk = (*(dataset.chunks or (1,)), 1)[:2]
    address = np.zeros((-(-steps // chunk[0]), -(-columns // chunk[1])), dtype=np.int64)
    if address.size:

        def found(stored: Any) -> None:
            if stored.size != math.prod(chunk) * dataset.dtype.itemsize + SIZE or stored.filter_mask:
                raise RuntimeError(f"HDF5 stores a chunk of {variable.name} otherwise than it was asked to")
            band, across = (*stored.chunk_offset, 0)[:2]
            address[band // chunk[0], across // chunk[1]] = stored.byte_offset

        dataset.id.chunk_iter(found)
    if not address.all():
        raise RuntimeError(f"HDF5 has left chunks of {variable.name} without a place")
    return Place(variable.name, dataset.dtype, steps, columns, chunk, address)


def _around(image: "_Image", places: Iterable[Place]) -> Iterator[tuple[int, bytes]]:
    """Yield what stands around the chunks of rows, and where."""
    extents = [(place.address.ravel(), place.chunk_size + SIZE) for place in places]
    begin = np.concatenate([address for address, _ in extents])
    end = np.concatenate([address + size for address, size in extents])
    order = np.argsort(begin)
    starts, stops = np.append(0, end[order]), np.append(begin[order], image.size)
    for gap in np.flatnonzero(starts < stops):
        image.seek(int(starts[gap]))
        yield int(starts[gap]), image.read(int(stops[gap] - starts[gap]))


@final
class _Image(io.RawIOBase):
    """A file in memory that has pages only where something else than zeros was written."""

    def __init__(self) -> None:
        self.size = 0
        self._at = 0
        self._pages: dict[int, bytearray] = {}

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self.size}[whence]
        return self._at

    def truncate(self, size: int | None = None) -> int:
        self.size = self._at if size is None else size
        return self.size

    def readinto(self, buffer: Any) -> int:
        view = memoryview(buffer).cast("B")[: max(0, self.size - self._at)]
        for begin, page, where in self._parts(len(view)):
            found = self._pages.get(page)
            view[begin : begin + where.stop - where.start] = found[where] if found else bytes(where.stop - where.start)
        self._at += len(view)
        return len(view)

    def write(self, content: Any) -> int:
        view = memoryview(content).cast("B")
        count = len(view)
        if count >= SMALLEST_HOLE and not np.frombuffer(view, np.uint8).any():
            # behind the last page there are zeros anyway
            count = max(0, min(count, (max(self._pages, default=-1) + 1) * PAGE - self._at))
        for begin, page, where in self._parts(count):
            self._pages.setdefault(page, bytearray(PAGE))[where] = view[begin : begin + where.stop - where.start]
        self._at += len(view)
        self.size = max(self.size, self._at)
        return len(view)

    def _parts(self, count: int) -> "list[tuple[int, int, slice]]":
        """Cut so many bytes from here on at the ends of pages: where each part begins, its page, and where in that."""
        parts, done = [], 0
        while done < count:
            page, first = divmod(self._at + done, PAGE)
            length = min(PAGE - first, count - done)
            parts.append((done, page, slice(first, first + length)))
            done += length
        return parts
