"""What a file is, and the program's own netCDF files, opened."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Literal

import xarray as xr

from historysim.basics.file_kinds import is_log, is_netcdf
from historysim.basics.files import what_is_there
from historysim.basics.hdf5 import check_named
from historysim.errors import InputError
from historysim.measured.loop_table import CONTENT_OF_TABLE
from historysim.measured.loop_values import CONTENT
from historysim.measured.sliding import CONTENT_OF_COURSE
from historysim.results.analysis.time_series import CONTENT as TIME_SERIES
from historysim.results.netcdf_table import CONTENT as TABLE
from historysim.results.readable import check_history
from historysim.results.recorded_file import damage_told
from historysim.results.sweeps import CONTENT as SWEEP
from historysim.results.written_table import is_table

Kind = Literal["scenario", "log", "result", "loops", "sliding", "sweep", "table", "height map"]

KINDS: Mapping[str, Kind] = {
    CONTENT: "loops",
    CONTENT_OF_TABLE: "loops",
    CONTENT_OF_COURSE: "sliding",
    SWEEP: "sweep",
    TABLE: "table",
    TIME_SERIES: "table",
}
"""What a file is, by its attribute ``content``."""

CALLED: Mapping[Kind, str] = {
    "scenario": "a scenario",
    "log": "a log",
    "result": "a result of historysim run",
    "loops": "a file of friction loops",
    "sliding": "a file of friction over time or distance",
    "sweep": "a sweep",
    "table": "a table",
    "height map": "a height map",
}

READABLE = (
    "expected a scenario, a result of historysim run, its log, friction loops, friction over time or distance, a "
    "sweep, a table, or a height map"
)


def kind_of(path: Path) -> Kind:
    """Return what a file is: a scenario by its ending, the program's own files by their content, else a height map.

    Raises
    ------
    InputError
        There is no such file.
    """
    if path.suffix == ".toml":
        return "scenario"
    _check_there(path, READABLE)
    if is_log(path):
        return "log"
    if not is_netcdf(path):
        return "table" if is_table(path) else "height map"
    import netCDF4

    check_named(path)
    # height maps come as netCDF, too; what does not open is left to the reader of results, which says what is wrong
    with suppress(OSError, RuntimeError, AttributeError), netCDF4.Dataset(path) as file:
        told = {name: file.getncattr(name) for name in file.ncattrs()}
        if str(told.get("content")) in KINDS:
            return KINDS[str(told["content"])]
        if "historysim_version" not in told:
            return "height map"
    return "result"


@contextmanager
def open_result(path: Path) -> Iterator[xr.Dataset]:
    """Open the result of a run, and close it when the block ends.

    Parameters
    ----------
    path : Path

    Yields
    ------
    xarray.Dataset
        The history, read lazily.

    Raises
    ------
    InputError
        There is no such file, or it is no finished result, or damaged, also where that is found as it is read.
    """
    expected = "expected a result of historysim run (netCDF)"
    _check_there(path, expected)
    if not is_netcdf(path):
        raise InputError(f"{path}: is not a netCDF file; {expected}")
    with _opened(path) as history:
        if kind := KINDS.get(str(history.attrs.get("content", ""))):
            raise InputError(f"{path}: is {CALLED[kind]}; {expected}")
        if not history.attrs.get("complete"):
            raise InputError(f"{path}: is not a finished result of historysim run; run the scenario again")
        shapes = {str(name): (of.dims, of.dtype) for name, of in history.variables.items()}
        check_history(history.attrs, shapes, history.sizes.get("step", 0), path)
        yield history


def read_table(path: Path) -> xr.Dataset:
    """Read a sweep, or friction loops, a table of them, or friction over time or distance, as `to_dataset` gave it.

    Raises
    ------
    InputError
        The file is damaged.
    """
    with _opened(path) as found:
        return found.load()


def _check_there(path: Path, expected: str) -> None:
    if came := what_is_there(path):
        raise InputError(f"{path}: {came}; {expected}")


@contextmanager
def _opened(path: Path) -> Iterator[xr.Dataset]:
    check_named(path)
    try:
        found = xr.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, RuntimeError, AttributeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({error}); make it again") from error
    with found, damage_told(path):
        yield found
