"""A result, smaller: a copy of the whole one, since nobody knows before how much room a compressed row takes."""

import errno
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from historysim.errors import InputError

if TYPE_CHECKING:
    import netCDF4

COMPRESSIONS: dict[str, dict[str, Any]] = {
    "none": {},
    "zlib": {"compression": "zlib", "complevel": 1, "shuffle": True},
    "zstd": {"compression": "zstd", "complevel": 3, "shuffle": True},
}


CHUNK_CELLS, ROWS_OF_A_CHUNK = 1 << 16, 1 << 8
MOST_CELLS_ACROSS = 1 << 21
"""Values of all chunks across a row: 16 MB, which the netCDF library keeps of a variable while it reads."""


def check_compression(compression: str) -> None:
    """Refuse a way of compression that is unknown."""
    if compression not in COMPRESSIONS:
        raise InputError(f"compression is {compression!r}; expected one of {', '.join(COMPRESSIONS)}")


def compress(source: Path, target: Path, compression: str) -> None:
    """Copy a result, and compress its variables; what is compressed already is copied as it is.

    A copy that cannot be written is an OSError.
    """
    import netCDF4

    try:
        with netCDF4.Dataset(source) as given, netCDF4.Dataset(target, "w", format="NETCDF4") as made:
            _copy(given, made, COMPRESSIONS[compression])
    except RuntimeError as error:
        # the only type of error that the netCDF library has for whatever the system refuses
        if not str(error).startswith("NetCDF: "):
            raise
        message = f"the compressed result cannot be written ({error}); is the disk full?"
        raise OSError(errno.EIO, message) from error


def _copy(given: "netCDF4.Dataset", made: "netCDF4.Dataset", way: dict[str, Any]) -> None:
    attributes = {name: given.getncattr(name) for name in given.ncattrs()}
    complete = attributes.pop("complete", None)
    made.setncatts(_as_characters(attributes))
    for name, dimension in given.dimensions.items():
        made.createDimension(name, len(dimension))
    for name, variable in given.variables.items():
        own_attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
        stored, fill = _storage(variable, way), own_attributes.pop("_FillValue", False)
        copied = made.createVariable(name, variable.dtype, variable.dimensions, fill_value=fill, **stored)
        copied.setncatts(_as_characters(own_attributes))
        for each in (variable, copied):
            each.set_auto_maskandscale(False)
        rows = stored["chunksizes"][0] if stored else 1
        for first in range(0, variable.shape[0], rows):
            copied[first : first + rows] = variable[first : first + rows]
    for name, group in given.groups.items():
        _copy(group, made.createGroup(name), way)
    if complete is not None:
        made.setncattr("complete", complete)


def _as_characters(attributes: dict[str, Any]) -> dict[str, Any]:
    """Return attributes whose texts become arrays of characters, also where they are not ASCII, as in the original."""
    return {name: value.encode() if isinstance(value, str) else value for name, value in attributes.items()}


def _storage(variable: "netCDF4.Variable[Any]", way: dict[str, Any]) -> dict[str, Any]:
    """Return how the copy of a variable is kept; what holds nothing has no chunks."""
    chunks, filters = variable.chunking(), variable.filters()
    if chunks != "contiguous":
        own = {"compression": "zlib", "complevel": filters["complevel"]} if filters["zlib"] else way
        return {"chunksizes": chunks, "fletcher32": filters["fletcher32"], **own}
    if not variable.size:
        return {}
    shape = chunk_shape(variable.shape[0], math.prod(variable.shape[1:]))[: variable.ndim]
    # by its checksums every reader finds out whether a chunk is still whole
    return {"chunksizes": shape, "fletcher32": True, **way}


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
