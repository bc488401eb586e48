"""File types, and opening of results, sweeps and tables with checks before use."""

import abc
import contextlib
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from historysim.basics.arguments import DIRECTION
from historysim.basics.files import is_log, is_netcdf, is_zarr, path_state
from historysim.basics.hdf5 import check_named
from historysim.basics.registry import Registry
from historysim.errors import InputError
from historysim.recording.stored_units import declared_units, is_as_recorded, to_declared_units
from historysim.recording.variables import COORDINATES, VARIABLES
from historysim.results.history_view import MODULI, NEEDED, FileHistory, History

if TYPE_CHECKING:
    import xarray as xr

# Type of a netCDF file by its attribute ``content``; the modules that write them are slow to
# import.
KINDS: Mapping[str, str] = {
    "friction loops": "loops",
    "statistics of friction loops": "loops",
    "fretting report": "table",
    "friction over time or distance": "sliding",
    "sweep": "sweep",
    "table": "table",
    "history over time": "table",
    "reduced model": "table",
}

EXPECTED = "expected a result of historysim run (netCDF)"
CALLED: Mapping[str, str] = {
    "scenario": "a scenario",
    "log": "a log",
    "result": "a result of historysim run",
    "zarr": "a result of historysim run (zarr)",
    "loops": "a file of friction loops",
    "sliding": "a file of friction over time or distance",
    "sweep": "a sweep",
    "table": "a table",
    "height map": "a height map",
}


class FileKind(abc.ABC):
    """Another type of file that `show`, `plot` and `report` read.

    Its content has a method ``summary``, and functions registered with `make_figure` and
    `render_page`.
    """

    kind: ClassVar[str]  #: its name, also in messages

    @classmethod
    @abc.abstractmethod
    def is_one(cls, path: Path) -> bool:
        """Return whether a file, which exists, is of this kind."""

    @classmethod
    @abc.abstractmethod
    def read(cls, path: Path) -> Any:
        """Return the content of a file; InputError where it is damaged."""


# Further types of files, by their names.
FILES: Registry[type[FileKind]] = Registry(
    "historysim.files",
    "historysim.results.result_files:FileKind",
    "kind of file",
    # by its name: a module of a higher layer, imported when a file may be of its type
    "historysim.exchange.reduced.reduced_model",
)


def file_type(path: Path) -> str:
    """Return the type of a file, a key of `CALLED` or a name in `FILES`: by suffix, else by content."""
    if path.suffix == ".toml":
        return "scenario"
    if is_zarr(path):
        return "zarr"
    kinds = "a scenario, a result of historysim run, its log, friction loops, friction over time or distance, a sweep"
    _check_exists(path, f"expected {kinds}, a table, a reduced model, or a height map")
    if is_log(path):
        return "log"
    if is_netcdf(path):
        return _kind_of_netcdf(path)
    return next((name for name, kind in FILES.items() if kind.is_one(path)), "height map")


def _kind_of_netcdf(path: Path) -> str:
    import netCDF4

    check_named(path)
    # height maps are netCDF, too; the reader of results reports why a file cannot be opened
    with contextlib.suppress(OSError, RuntimeError, AttributeError), netCDF4.Dataset(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
        if str(attributes.get("content")) in KINDS:
            return KINDS[str(attributes["content"])]
        if "historysim_version" not in attributes:
            return "height map"
    return "result"


def open_history(path: Path, *, exclusive: bool = False) -> "xr.Dataset":
    """Open the result of a run, read lazily; its ``close()`` closes the file.

    xarray also closes files that were left open. The Dataset must not be held open by a suspended
    generator: the garbage collector would end it at any allocation, and wait for a lock of xarray
    that the same thread may hold.

    Parameters
    ----------
    path : Path
        The file.
    exclusive : bool
        Whether this process has just written it, so that no other process checks it first.

    Raises
    ------
    InputError
        The file does not exist, is not a finished result, or is damaged.
    """
    _check_netcdf(path)
    history = _open_netcdf(path, exclusive=exclusive)
    try:
        with report_damage(path):
            _check_history(history, path)
            return _to_declared_units(history, path)
    except BaseException:
        history.close()
        raise


def open_zarr_history(path: Path) -> "xr.Dataset":
    """Open the result of a run in a zarr store, read lazily.

    InputError: zarr is not installed, or the store is not a finished result, or is damaged.
    """
    from historysim.log.zarr_result import open_store

    history = open_store(path)
    _check_history(history, path)
    return _to_declared_units(history, path)


def _to_declared_units(history: "xr.Dataset", path: Path) -> "xr.Dataset":
    """Return an open history in the declared units, with which its file is closed as well."""
    try:
        converted = to_declared_units(history)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if converted is not history:
        converted.set_close(history.close)
    return converted


@contextlib.contextmanager
def open_result(path: Path, *, exclusive: bool = False) -> Iterator["xr.Dataset"]:
    """Open the result of a run, and close it when the block ends; also damage found while reading is an InputError.

    Parameters and errors as for `open_history`. The result may be a zarr store, or a log, whose
    history is computed when it is read.
    """
    with _open_checked(path, exclusive=exclusive) as history, report_damage(path):
        yield history


def _open_checked(path: Path, *, exclusive: bool) -> "xr.Dataset":
    if is_zarr(path):
        return open_zarr_history(path)
    if is_log(path):
        from historysim.log.lazy_history import open_lazily

        return open_lazily(path)
    return open_history(path, exclusive=exclusive)


@contextlib.contextmanager
def open_file_history(path: Path, *, exclusive: bool = False) -> Iterator[History]:
    """Open the result of a run for a summary, a netCDF file without xarray, and close it when the block ends.

    Parameters and errors as for `open_history`; damage found while reading is an InputError as
    well.
    """
    if is_zarr(path):
        with open_zarr_history(path) as stored:
            yield stored
        return
    _check_netcdf(path)
    if not exclusive:
        check_named(path)
    with contextlib.ExitStack() as files:
        try:
            history = files.enter_context(FileHistory.open(path))
        except (OSError, RuntimeError, AttributeError) as error:
            raise _damage_error(path, error) from error
        files.enter_context(report_damage(path))
        _check_history(history, path)
        if all(
            is_as_recorded(history[name].attrs, unit)
            for name, unit in declared_units().items()
            if name in history
        ):
            yield history
            return
    with open_result(path, exclusive=True) as converted:
        yield converted


def read_table(path: Path) -> "xr.Dataset":
    """Read a sweep, friction loops, a table of them, or friction over time or distance, as it was written."""
    with _open_netcdf(path) as dataset, report_damage(path):
        return dataset.load()


def _check_exists(path: Path, expected: str) -> None:
    if problem := path_state(path):
        raise InputError(f"{path}: {problem}; {expected}")


def _check_netcdf(path: Path) -> None:
    _check_exists(path, EXPECTED)
    if not is_netcdf(path):
        raise InputError(f"{path}: is not a netCDF file; {EXPECTED}")


def _damage_error(path: Path, error: Exception) -> InputError:
    return InputError(f"{path}: is damaged ({error}); make it again")


def _open_netcdf(path: Path, *, exclusive: bool = False) -> "xr.Dataset":
    import xarray as xr

    if not exclusive:
        check_named(path)
    try:
        # elapsed time in s is not a date
        return xr.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, RuntimeError, AttributeError, ValueError) as error:
        raise _damage_error(path, error) from error


@contextlib.contextmanager
def report_damage(path: Path) -> Iterator[None]:
    """Report errors of the netCDF library inside the block as InputError: the file is damaged."""
    try:
        yield
    except (OSError, RuntimeError, AttributeError) as error:
        # AttributeError if an attribute cannot be read
        text = error.strerror if isinstance(error, OSError) else str(error)
        if not str(text).startswith("NetCDF: "):
            raise
        raise _damage_error(path, error) from error


STRINGS = (
    *(
        "content",
        "date_created",
        "event_digest",
        "friction_law",
        "historysim_version",
        "history",
        "id",
        "license",
    ),
    *("log_digest", "made_with", "scenario", "source", "summary", "title", "validity", "wear_law"),
)
KNOWN = {variable.name: variable for variable in (*COORDINATES, *VARIABLES)}


def _check_history(history: History, path: Path) -> None:
    """Check that a file is a finished result, with attributes and variables as this program writes them."""
    if kind := KINDS.get(str(history.attrs.get("content", ""))):
        raise InputError(f"{path}: is {CALLED[kind]}; {EXPECTED}")
    if not history.attrs.get("complete"):
        raise InputError(
            f"{path}: is not a finished result of historysim run; run the scenario again"
        )
    if problem := next(_wrong(history), ""):
        raise InputError(
            f"{path}: is not a result of historysim run, or damaged: {problem}; run the scenario again"
        )


def _wrong(history: History) -> Iterator[str]:
    """Yield faults of the attributes and variables of a result."""
    for name in STRINGS:
        if not isinstance(history.attrs.get(name, ""), str):
            yield f"its attribute {name} is not a string"
    for name in MODULI:
        value = history.attrs.get(name)
        if not (isinstance(value, float | int | np.number) and math.isfinite(value) and value > 0):
            yield f"its attribute {name} is not a positive number"
    findings = None
    with contextlib.suppress(ValueError, RecursionError):
        findings = json.loads(history.attrs.get("validity", "[]"))
    if not isinstance(findings, list):
        yield "its attribute validity is not a list in JSON"
    for name in sorted(NEEDED - history.variables.keys()):
        yield f"it has no variable {name}"
    for name in [name for name in KNOWN if name in history.variables]:
        variable = history.variables[name]
        if variable.dtype.kind not in "iuf":
            yield f"its variable {name} holds no numbers"
        dimensions = tuple(name_ for name_ in variable.dims if name_ != DIRECTION)
        if dimensions != KNOWN[name].dimensions and name != "present_friction":
            yield f"its variable {name} varies along {', '.join(map(str, variable.dims)) or 'nothing'}"
    if "asperity" in history.sizes and "asperity" not in history.variables:
        yield "it has no labels of its asperities"
    if not history.sizes.get("step"):
        yield "it has no steps"
