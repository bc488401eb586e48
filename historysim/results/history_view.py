"""Histories as summaries see them: a Dataset of xarray, or the file of a result read with netCDF4 alone.

Importing xarray takes longer than a small run, so that `run` and `show` summarise a result through
a `FileHistory`.
"""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

import attrs

from historysim.basics.arguments import Array
from historysim.recording.variables import Changes, recorded_variables

if TYPE_CHECKING:
    import netCDF4
    import numpy as np

MODULI = ("contact_modulus", "shear_modulus")  # attributes of every history
#: Variables of every history; a contact that is given by its loads alone has no area.
NEEDED = frozenset(
    {"time", *(variable.name for variable in recorded_variables(Changes(areas=False))[0])}
)


class History(Protocol):
    """Part of the interface of `xarray.Dataset` that summaries use; `FileHistory` has it as well."""

    @property
    def attrs(self) -> Mapping[Any, Any]:
        """Attributes by name."""

    @property
    def sizes(self) -> Mapping[Any, int]:
        """Lengths of the dimensions by name."""

    @property
    def variables(self) -> Mapping[Any, Any]:
        """Variables by name."""

    def __contains__(self, name: object, /) -> bool: ...

    def __getitem__(self, name: str, /) -> Any: ...  # a DataArray or a `FileVariable`


@attrs.frozen(eq=False)
class FileVariable:
    """Variable of a netCDF file; each request for its values reads them."""

    source: "netCDF4.Variable[Any]"
    steps: int | slice = slice(None)  #: selected along ``step``, the first dimension

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions."""
        names: tuple[str, ...] = self.source.dimensions
        return names if isinstance(self.steps, slice) else names[1:]

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.dims)

    @property
    def dtype(self) -> "np.dtype[Any]":
        """Type of the values; strings have the type of objects, as in a Dataset."""
        import numpy as np

        return np.dtype(object if self.source.dtype is str else self.source.dtype)

    @property
    def attrs(self) -> dict[str, Any]:
        """Attributes by name."""
        return {name: self.source.getncattr(name) for name in self.source.ncattrs()}

    @property
    def values(self) -> Array:
        """Values as an array."""
        values: Array = self.source[self.steps]
        return values

    def isel(self, *, step: int | slice) -> Self:
        """Select steps by position."""
        return type(self)(self.source, step)


@attrs.frozen(eq=False)
class FileHistory:
    """Open file of a result."""

    attrs: Mapping[str, Any]
    sizes: Mapping[str, int]
    variables: Mapping[str, FileVariable]

    @classmethod
    @contextmanager
    def open(cls, path: Path) -> Iterator[Self]:
        """Open a file, and close it when the block ends; errors of the netCDF library are passed on."""
        import netCDF4

        with netCDF4.Dataset(path) as file:
            # numbers as stored: no result has packed or masked values
            file.set_auto_maskandscale(False)
            yield cls(
                {name: file.getncattr(name) for name in file.ncattrs()},
                {name: dimension.size for name, dimension in file.dimensions.items()},
                {name: FileVariable(variable) for name, variable in file.variables.items()},
            )

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> FileVariable:
        return self.variables[name]


def is_dataset(value: object) -> bool:
    """Return whether an object is an `xarray.Dataset`, without importing xarray: before that there is no Dataset."""
    xarray = sys.modules.get("xarray")
    return xarray is not None and isinstance(value, xarray.Dataset)
