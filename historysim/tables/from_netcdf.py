"""netCDF: variables by their paths, masked and scaled as their attributes say, with their units."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from historysim.basics.hdf5 import check_contained
from historysim.tables.arrays import Array, Contents, readable
from historysim.tables.columns import Format
from historysim.tables.readers import READERS, TableReader


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
                yield Contents(list(_arrays(dataset, "")))
