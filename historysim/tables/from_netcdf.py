"""netCDF: variables by their paths, masked and scaled as their attributes say, with their units."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from historysim.basics.hdf5 import check_contained
from historysim.errors import InputError
from historysim.tables.arrays import Array, Contents, Selection, readable
from historysim.tables.columns import Format
from historysim.tables.readers import READERS, TableReader

_CLASSIC = (b"CDF\x01", b"CDF\x02")
_CDF5 = b"CDF\x05"


def _arrays(group: Any, above: str) -> Iterator[Array]:
    for name, variable in group.variables.items():
        if isinstance(variable.dtype, np.dtype):
            yield Array(above + name, variable.shape, _reader(variable), _unit(getattr(variable, "units", "")))
    for name, inner in group.groups.items():
        yield from _arrays(inner, f"{above}{name}/")


def _reader(variable: Any) -> Any:
    return lambda selection: variable[selection]


def _unit(unit: object) -> str:
    """Return a unit without the date that a time is counted from."""
    if isinstance(unit, bytes):
        unit = unit.decode("utf-8", "replace")
    return unit.partition(" since ")[0] if isinstance(unit, str) else ""


def _classic(path: Path) -> Contents:
    """Read a file of the classic formats through scipy: the netCDF library ends the process at some damaged ones."""
    from scipy.io import netcdf_file

    with netcdf_file(path, mmap=False, maskandscale=True) as file:
        return Contents(
            [
                Array(name, variable.shape, _classic_reader(variable), _unit(getattr(variable, "units", "")))
                for name, variable in file.variables.items()
            ]
        )


def _classic_reader(variable: Any) -> Any:
    """Return what reads a variable, and masks what scipy does not: values never written, or out of the valid range."""
    from netCDF4 import default_fillvals

    stored = variable.data
    least, most = getattr(variable, "valid_range", (-np.inf, np.inf))
    least, most = getattr(variable, "valid_min", least), getattr(variable, "valid_max", most)
    never_written = default_fillvals.get(stored.dtype.str[1:])

    def read(selection: Selection) -> Any:
        values = variable[selection]
        raw = stored[selection]
        if raw.dtype.kind not in "if":
            return values
        wrong = (raw < least) | (raw > most) | (raw == raw.dtype.type(never_written))
        return np.ma.masked_where(wrong, values)

    return read


@READERS.register
class NetCDFReader(TableReader):
    """netCDF."""

    kind, endings = "netcdf", (".nc", ".nc4", ".cdf")

    @contextmanager
    def opened(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Yield what a netCDF file holds; a damaged file, or another, is an InputError."""
        with path.open("rb") as stream:
            beginning = stream.read(4)
        if beginning == _CDF5:
            raise InputError("is netCDF of 64-bit data (CDF-5); convert it with nccopy -k nc4")
        with readable("netCDF"):
            if beginning in _CLASSIC:
                yield _classic(path)
                return
            import netCDF4

            check_contained(path)
            with netCDF4.Dataset(path) as dataset:
                yield Contents(list(_arrays(dataset, "")))
