"""A result as it lies in its file, for the few lines that a run ends with: xarray would take longer than the run."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
import numpy.typing as npt

from historysim.basics.hdf5 import check_named
from historysim.errors import InputError
from historysim.results.readable import check_history

if TYPE_CHECKING:
    import netCDF4


@final
class RecordedFile:
    """As much of a Dataset as `results.analysis.recorded.Recorded` says, read from a file where it is asked for.

    Parameters
    ----------
    file : netCDF4.Dataset
        Open as long as it is asked.
    """

    def __init__(self, file: "netCDF4.Dataset") -> None:
        file.set_auto_maskandscale(False)
        self.attrs = {name: file.getncattr(name) for name in file.ncattrs()}
        self.encoding = {"source": file.filepath()}
        self.sizes = {name: len(dimension) for name, dimension in file.dimensions.items()}
        self._columns = {name: _VariableView(variable) for name, variable in file.variables.items()}

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __getitem__(self, name: str) -> "_VariableView":
        return self._columns[name]


@final
class _VariableView:
    def __init__(self, variable: Any, step: Any = ...) -> None:
        self._variable, self._step = variable, step

    @property
    def dims(self) -> tuple[str, ...]:
        gone = self._variable.dimensions[0] if isinstance(self._step, int | np.integer) else None
        return tuple(name for name in self._variable.dimensions if name != gone)

    @cached_property
    def values(self) -> npt.NDArray[Any]:
        return np.asarray(self._variable[self._step])

    def isel(self, *, step: Any) -> "_VariableView":
        return _VariableView(self._variable, step)


@contextmanager
def opened(path: Path) -> Iterator[RecordedFile]:
    """Open the result of a run, and close it when the block ends.

    Parameters
    ----------
    path : Path

    Yields
    ------
    RecordedFile

    Raises
    ------
    InputError
        The file is damaged, also where that is found as it is read.
    """
    import netCDF4

    check_named(path)
    with damage_told(path), netCDF4.Dataset(path) as file:
        recorded = RecordedFile(file)
        shapes = {name: (of.dimensions, of.dtype) for name, of in file.variables.items()}
        check_history(recorded.attrs, shapes, recorded.sizes.get("step", 0), path)
        yield recorded


@contextmanager
def damage_told(path: Path) -> Iterator[None]:
    """Turn what the netCDF library raises of a damaged file into one message.

    Raises
    ------
    InputError
        The file is damaged.
    """
    try:
        yield
    except (RuntimeError, AttributeError) as error:
        # the second is what the library raises where an attribute cannot be read
        if not str(error).startswith("NetCDF: "):
            raise
        raise InputError(f"{path}: is damaged ({error}); make it again") from error
