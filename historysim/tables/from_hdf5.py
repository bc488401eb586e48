"""HDF5 and netCDF: arrays by their paths, with units from their attributes.

HDF5 is read by h5py: netCDF4 opens many such files, too, but refuses a whole file for one dangling link or one dataset
without a space, and ends the process at a group that holds itself.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.hdf5 import check_contained
from historysim.errors import InputError
from historysim.tables.arrays import Array, Contents, Selection, readable
from historysim.tables.columns import Format
from historysim.tables.readers import READERS, TableReader

if TYPE_CHECKING:
    import h5py


@contextmanager
def datasets(path: Path, kind: str) -> "Iterator[dict[str, h5py.Dataset]]":
    """Yield all datasets of a file by their paths; a damaged file, or another, is an InputError."""
    try:
        import h5py
    except ImportError as error:
        raise InputError('is read by h5py, which is not installed; pip install "historysim[hdf5]"') from error

    check_contained(path, by_h5py=True)
    with readable(kind), h5py.File(path, "r") as file:
        by_path: dict[str, h5py.Dataset] = {}

        def add(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset):
                by_path[name] = item

        file.visititems(add)
        yield by_path


def attribute(dataset: "h5py.Dataset", name: str) -> str:
    """Return a text among the attributes, empty if there is none."""
    value = dataset.attrs.get(name, "")
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size == 1 else ""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""


def _arrays(name: str, dataset: "h5py.Dataset") -> Iterator[Array]:
    if dataset.shape is None:
        return
    unit = attribute(dataset, "units") or attribute(dataset, "unit")
    if dataset.dtype.names is None:
        yield Array(name, dataset.shape, lambda selection: _read(dataset, selection), unit)
        return
    for field in dataset.dtype.names:
        yield Array(f"{name}/{field}", dataset.shape, _field(dataset, field))


def _field(dataset: "h5py.Dataset", field: str) -> Any:
    return lambda selection: dataset.fields(field)[selection]


def _read(dataset: "h5py.Dataset", selection: Selection) -> Any:
    for name in ("scale_factor", "add_offset"):
        if name in dataset.attrs:
            raise InputError(
                f"{dataset.name!r} has the attribute {name}; name the file .nc, so that it is read as netCDF"
            )
    values = dataset[selection]
    fill = dataset.attrs.get("_FillValue")
    return values if fill is None else np.ma.masked_equal(values, np.ravel(fill)[0])


@READERS.register
class Hdf5Reader(TableReader):
    """HDF5."""

    kind, endings = "hdf5", (".h5", ".hdf5", ".hdf")

    @contextmanager
    def opened(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Yield what an HDF5 file holds; a damaged file, or another, is an InputError."""
        with datasets(path, "HDF5") as by_path, readable("HDF5"):
            yield Contents([array for name, dataset in by_path.items() for array in _arrays(name, dataset)])


def _variables(group: Any, above: str) -> Iterator[Array]:
    for name, variable in group.variables.items():
        if isinstance(variable.dtype, np.dtype):
            yield Array(above + name, variable.shape, variable.__getitem__, _unit(getattr(variable, "units", "")))
    for name, inner in group.groups.items():
        yield from _variables(inner, f"{above}{name}/")


def _unit(unit: object) -> str:
    """Return a unit without the date that a time is counted from."""
    if isinstance(unit, bytes):
        unit = unit.decode("utf-8", "replace")
    return unit.partition(" since ")[0] if isinstance(unit, str) else ""


@READERS.register
class NetCDFReader(TableReader):
    """netCDF."""

    kind, endings = "netcdf", (".nc", ".nc4", ".cdf")

    @contextmanager
    def opened(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Yield what a netCDF file holds; a damaged file, or another, is an InputError."""
        with readable("netCDF"):
            import netCDF4

            check_contained(path)
            with netCDF4.Dataset(path) as dataset:
                yield Contents(list(_variables(dataset, "")))
