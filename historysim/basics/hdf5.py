"""Safe reading of foreign HDF5 and netCDF files: a separate process reads them first, since damage may end or block it.

HDF5 ends the process at some damaged indices of chunks, and netCDF at groups that hold themselves;
a damaged heap of attributes is read without end. What ends well in the other process is safe to
open in this one.
"""

import contextlib
import functools
import importlib
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from historysim.basics.files import is_netcdf
from historysim.basics.limits import at_most, check_unpacked, describe_variable, most
from historysim.basics.system import ends_well
from historysim.errors import InputError

MOST_EMPTY = 1 << 26  # bytes that a dataset may claim whatever the size of its file
# bytes that a dataset may claim for each of its file; compressing equal numbers gives some 10,000
MOST_RATIO = 100_000

# Least chunks of a node of an index, and most values that are read of a variable.
_CHUNKS_OF_A_NODE, _MOST_TOUCHED = 32, 1000


def check_contained(path: Path, *, by_h5py: bool = False) -> None:
    """Check that a netCDF or HDF5 file can be read; any other file is left to its reader.

    Reading that has no end, or ends the process, a dataset larger than its file, and other files
    are InputErrors.
    """
    if not is_netcdf(path):
        return
    # here, so that a copy of this process has it
    importlib.import_module("h5py" if by_h5py else "netCDF4")
    status = path.stat()
    if not _ends_well(
        path.absolute(),
        by_h5py,
        status.st_ino,
        status.st_size,
        status.st_mtime_ns,
        status.st_ctime_ns,
    ):
        raise InputError(
            "is damaged: a process that reads it ends by a signal, or not within "
            f"{_seconds(status.st_size)} s ({describe_variable('HDF5_SECONDS')}); make it again, or restore it from a "
            "copy"
        )
    visit = _visit_by_h5py if by_h5py else _visit_by_netcdf4
    try:
        visit(path, lambda *_: None)
    except RecursionError as error:
        raise InputError(f"has groups within groups; {at_most('HDF5_DEPTH')}") from error
    except (OSError, RuntimeError, AttributeError, KeyError):
        # its reader says why it cannot be opened
        return


def check_named(path: Path) -> None:
    """Check a file as `check_contained` does, and name it in the error."""
    try:
        check_contained(path)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


@functools.lru_cache(maxsize=1000)
def _ends_well(path: Path, by_h5py: bool, _inode: int, size: int, *_times: int) -> bool:
    return ends_well(read_by_h5py if by_h5py else read_by_netcdf4, path, _seconds(size))


def _seconds(size: int) -> int:
    return most("HDF5_SECONDS") + min(2 * size // 1_000_000, 60)


def read_by_netcdf4(path: Path) -> None:
    """Read all parts of a file that may make the netCDF library fail; exceptions are passed on."""
    _visit_by_netcdf4(path, _read)


def read_by_h5py(path: Path) -> None:
    """Read all parts of a file that may make h5py fail; exceptions are passed on."""
    _visit_by_h5py(path, _read)


def _read(
    names: Iterable[str], attribute: Callable[[str], Any], dataset: Any = None, chunks: Any = None
) -> None:
    for name in names:
        with contextlib.suppress(Exception):
            attribute(name)
    if dataset is not None:
        with contextlib.suppress(Exception):
            _touch(dataset, chunks)


def _visit_by_netcdf4(path: Path, read: Callable[..., None]) -> None:
    """Read all groups of a file, each when the sizes of its variables are checked."""
    import netCDF4

    size = path.stat().st_size
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        waiting: list[Any] = [file]
        while waiting:
            group = waiting.pop()
            _check_depth(group.path)
            waiting.extend(group.groups.values())
            for name, variable in group.variables.items():
                item_size, chunks = getattr(variable.dtype, "itemsize", 1), variable.chunking()
                if isinstance(chunks, list) and any((variable.filters() or {}).values()):
                    # a chunk is unpacked whole
                    check_unpacked(math.prod(chunks) * item_size, size)
                claimed = math.prod(variable.shape) * item_size
                if claimed > MOST_EMPTY and claimed > MOST_RATIO * size:
                    raise InputError(
                        f"{name!r} claims {claimed:,} bytes in a file of {size:,}; expected what it claims: it is "
                        "damaged, or was never written"
                    )
            read(group.ncattrs(), group.getncattr)
            for variable in group.variables.values():
                read(variable.ncattrs(), variable.getncattr, variable, variable.chunking())


def _visit_by_h5py(path: Path, read: Callable[..., None]) -> None:
    """Read all groups and datasets of a file, each when it is checked; h5py follows no link to another file."""
    import h5py

    size = path.stat().st_size

    def visit(name: str | bytes, item: Any) -> None:
        if isinstance(name, bytes):
            raise InputError(
                f"has an object with the name {name!r}; expected names in UTF-8: it is damaged"
            )
        _check_depth(name)
        dataset = item if isinstance(item, h5py.Dataset) else None
        if dataset is not None:
            if item.is_virtual or item.external:
                raise InputError(
                    f"{item.name!r} is stored in other files; expected a self-contained file: h5repack copies all of it"
                )
            if item.chunks and item.id.get_create_plist().get_nfilters():
                check_unpacked(math.prod(item.chunks) * item.dtype.itemsize, size)
        read(item.attrs, item.attrs.__getitem__, dataset, getattr(dataset, "chunks", None))

    with h5py.File(path, "r", locking=False) as file:
        read(file.attrs, file.attrs.__getitem__)
        file.visititems(visit)


def _check_depth(path: str) -> None:
    if path.count("/") > most("HDF5_DEPTH"):
        raise InputError(
            f"has groups within groups, {path.count('/')} deep or more; {at_most('HDF5_DEPTH')}"
        )


def _touch(variable: Any, chunks: Any) -> None:
    """Read a value of each node of the index of a variable's chunks, or one value where it has no index."""
    import numpy as np

    sizes = np.array(chunks if isinstance(chunks, list | tuple) else variable.shape, np.int64)
    counts = -(-np.array(variable.shape, np.int64) // sizes)
    total = math.prod(map(int, counts))
    for number in range(0, total, max(_CHUNKS_OF_A_NODE, total // _MOST_TOUCHED)):
        with contextlib.suppress(Exception):
            variable[tuple(np.unravel_index(number, counts) * sizes)]
