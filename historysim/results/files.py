"""What a file is, and results of a run that are opened."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Literal

import xarray as xr

from historysim.basics.file_kinds import is_log, is_netcdf
from historysim.errors import InputError

Kind = Literal["scenario", "log", "result", "height map"]


def kind_of(path: Path) -> Kind:
    """Return what a file is: a scenario by its ending, a log and a result by what stands in them, else a height map.

    Raises
    ------
    InputError
        There is no such file.
    """
    if path.suffix == ".toml":
        return "scenario"
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected a scenario, a result of historysim run, or a height map")
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file; expected a scenario, a result of historysim run, or a height map"
        )
    if is_log(path):
        return "log"
    if not is_netcdf(path):
        return "height map"
    import netCDF4

    # maps come as netCDF too; a file that does not open is left to the reader of results, which says what is wrong
    with suppress(OSError, RuntimeError), netCDF4.Dataset(path) as file:
        if "historysim_version" not in file.ncattrs():
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
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected a scenario, a result of historysim run, or a height map")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected a result of historysim run (netCDF)")
    if not is_netcdf(path):
        raise InputError(f"{path}: is not a netCDF file; expected a result of historysim run")
    try:
        history = xr.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({error}); run the scenario again") from error
    with history:
        if not history.attrs.get("complete"):
            raise InputError(f"{path}: is not a finished result of historysim run; run the scenario again")
        try:
            yield history
        except RuntimeError as error:
            if not str(error).startswith("NetCDF: "):
                raise
            raise InputError(f"{path}: is damaged ({error}); run the scenario again") from error
