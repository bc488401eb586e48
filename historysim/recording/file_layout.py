"""A result as it is before any row stands in it: all that HDF5 writes by itself, and where the rows are to go.

Each variable is in one piece. The file is made in memory, where the room for rows is a hole; what is left are some
kilobytes, which are written last, around rows that stand: until then no reader takes the file for a result, and HDF5,
which may end the process where a disk refuses its bytes, never meets one. It comes out the same each time, so that
nothing but rows has to be kept of a run that was ended.
"""

import io
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np

from historysim.recording.recorder import Recorder, coordinates_of
from historysim.recording.variables import COORDINATES, Variable

if TYPE_CHECKING:
    import h5netcdf
    import h5py
    from _typeshed import ReadableBuffer, WriteableBuffer

PAGE = 1 << 12


@attrs.frozen
class RowPlace:
    """Where the rows of a variable go, one behind the other."""

    begin: int
    """Where the first one begins in the file."""
    row_size: int
    """Bytes of a row."""
    end: int
    """Where the last one ends."""


@attrs.frozen(eq=False)
class FileLayout:
    """A result without its rows."""

    size: int
    """Bytes of the whole file."""
    content: Mapping[int, bytes] = attrs.field(repr=False)
    """What stands in it beside the rows: bytes by where they begin."""
    places: tuple[RowPlace, ...] = attrs.field(repr=False)
    """Of ``time`` and of all variables that have rows, in the order in which recorders give them."""


def file_layout(
    recorder: Recorder, attributes: Mapping[str, Any], beside: Callable[["h5netcdf.File"], None] | None = None
) -> FileLayout:
    """Return the result that a recorder is to fill, with attributes, and ``complete`` behind them.

    `beside` writes further groups into the open file.
    """
    import h5netcdf
    import h5py

    image = _Image()
    along = (COORDINATES[0], *recorder.totals, *recorder.per_asperity)
    with h5netcdf.File(image, "w") as file:
        put_attributes(file, attributes)
        file.dimensions["step"] = recorder.steps
        if recorder.asperities is not None:
            file.dimensions["asperity"] = recorder.columns
        fixed = coordinates_of(recorder.ensemble, recorder.asperities)
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
    with h5py.File(image, "r") as whole:
        places = tuple(_place(whole[variable.name]) for variable in along)
    return FileLayout(image.size, dict(_around(image, places)), places)


def put_attributes(holder: "h5netcdf.File | h5netcdf.Group | h5netcdf.Variable", attributes: Mapping[str, Any]) -> None:
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


def _declare(file: "h5netcdf.File", variable: Variable) -> "h5netcdf.Variable":
    """Make a variable, and take all its room at once, without filling it."""
    from h5py import h5d, h5p

    plan = h5p.create(h5p.DATASET_CREATE)
    plan.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5d.FILL_TIME_NEVER)
    return file.create_variable(variable.name, variable.dimensions, variable.dtype, dcpl=plan)


def _place(dataset: "h5py.Dataset") -> RowPlace:
    """Ask HDF5 where a variable stands; one that holds nothing has no place."""
    begin = dataset.id.get_offset() or 0
    size = dataset.nbytes if begin else 0
    return RowPlace(begin, size // dataset.shape[0], begin + size)


def _around(image: "_Image", places: Iterable[RowPlace]) -> Iterator[tuple[int, bytes]]:
    """Yield what stands around rows, and where."""
    done = 0
    for begin, end in sorted([*((place.begin, place.end) for place in places), (image.size, image.size)]):
        if done < begin:
            image.seek(done)
            yield done, image.read(begin - done)
        done = max(done, end)


@final
class _Image(io.RawIOBase):
    """A file in memory that has pages only where something was written."""

    def __init__(self) -> None:
        self.size = 0
        self._at = 0
        self._pages: dict[int, bytearray] = {}

    def readable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self.size}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def truncate(self, size: int | None = None) -> int:
        self.size = self._at if size is None else size
        return self.size

    def readinto(self, buffer: "WriteableBuffer") -> int:
        view = memoryview(buffer).cast("B")[: max(0, self.size - self._at)]
        for page, inside, outside in self._parts(len(view)):
            view[outside] = self._pages.get(page, bytes(PAGE))[inside]
        return len(view)

    def write(self, content: "ReadableBuffer") -> int:
        view = memoryview(content).cast("B")
        for page, inside, outside in self._parts(len(view)):
            self._pages.setdefault(page, bytearray(PAGE))[inside] = view[outside]
        self.size = max(self.size, self._at)
        return len(view)

    def _parts(self, count: int) -> Iterator[tuple[int, slice, slice]]:
        """Go on by so many bytes; yield the page of each part of them, where in it, and where among them."""
        done = 0
        while done < count:
            page, first = divmod(self._at, PAGE)
            length = min(PAGE - first, count - done)
            yield page, slice(first, first + length), slice(done, done + length)
            done += length
            self._at += length
