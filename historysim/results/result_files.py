"""Files of this program: what a file is, and results, sweeps and tables opened, checked before anything is asked."""

import abc
import contextlib
import json
import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, final

import numpy as np

from historysim.basics.arguments import DIRECTION, Array
from historysim.basics.files import is_log, is_netcdf, what_is_there
from historysim.basics.hdf5 import check_named
from historysim.basics.registry import Registry
from historysim.errors import InputError
from historysim.recording.variables import COORDINATES, VARIABLES, Changes, recorded

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

# What a netCDF file is, by its attribute ``content``; the modules that write it are heavy to import.
KINDS: Mapping[str, str] = {
    "friction loops": "loops",
    "statistics of friction loops": "loops",
    "friction over time or distance": "sliding",
    "sweep": "sweep",
    "table": "table",
    "history over time": "table",
}

CALLED: Mapping[str, str] = {
    "scenario": "a scenario",
    "log": "a log",
    "result": "a result of historysim run",
    "loops": "a file of friction loops",
    "sliding": "a file of friction over time or distance",
    "sweep": "a sweep",
    "table": "a table",
    "height map": "a height map",
}


class FileKind(abc.ABC):
    """Another kind of file that `show`, `plot` and `report` read.

    Its content has a method ``summary``, and is registered with `figure_of` and `page_of`.
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


# The kinds of files beside those of `CALLED`, by their names.
FILES: Registry[type[FileKind]] = Registry(
    "historysim.files",
    "historysim.results.result_files:FileKind",
    "kind of file",
    # by its name: a room below this one, imported where a file may be one
    "historysim.exchange.reduced.reduced_model",
)


def kind_of(path: Path) -> str:
    """Return what a file is, a key of `CALLED` or a name in `FILES`: a scenario by its ending, else by its content."""
    if path.suffix == ".toml":
        return "scenario"
    kinds = "a scenario, a result of historysim run, its log, friction loops, friction over time or distance, a sweep"
    _check_exists(path, f"expected {kinds}, a table, a reduced model, or a height map")
    if is_log(path):
        return "log"
    if is_netcdf(path):
        return _kind_of_netcdf(path)
    if path.suffix.lower() == ".csv":
        from historysim.results.tables import is_table

        if is_table(path):
            return "table"
    return next((name for name, kind in FILES.items() if kind.is_one(path)), "height map")


def _kind_of_netcdf(path: Path) -> str:
    import netCDF4

    check_named(path)
    # height maps are netCDF, too; what does not open is left to the reader of results, which says what is wrong
    with contextlib.suppress(OSError, RuntimeError, AttributeError), netCDF4.Dataset(path) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
        if str(attributes.get("content")) in KINDS:
            return KINDS[str(attributes["content"])]
        if "historysim_version" not in attributes:
            return "height map"
    return "result"


@contextlib.contextmanager
def open_result(path: Path) -> "Iterator[xr.Dataset]":
    """Open the result of a run, read lazily, and close it when the block ends.

    An InputError says that there is no such file, or it is no finished result, or damaged, also where that is found as
    it is read.
    """
    expected = "expected a result of historysim run (netCDF)"
    _check_exists(path, expected)
    if not is_netcdf(path):
        raise InputError(f"{path}: is not a netCDF file; {expected}")
    with _opened(path) as history:
        if kind := KINDS.get(str(history.attrs.get("content", ""))):
            raise InputError(f"{path}: is {CALLED[kind]}; {expected}")
        layout = {str(name): (of.dims, of.dtype) for name, of in history.variables.items()}
        _check_history(history.attrs, layout, history.sizes.get("step", 0), path)
        yield history


def read_table(path: Path) -> "xr.Dataset":
    """Read a sweep, friction loops, a table of them, or friction over time or distance, as it was written."""
    with _opened(path) as found:
        return found.load()


def _check_exists(path: Path, expected: str) -> None:
    if found := what_is_there(path):
        raise InputError(f"{path}: {found}; {expected}")


@contextlib.contextmanager
def _opened(path: Path) -> "Iterator[xr.Dataset]":
    import xarray as xr

    check_named(path)
    try:
        # elapsed time in s is no date
        found = xr.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, RuntimeError, AttributeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({error}); make it again") from error
    with found, _damage_reported(path):
        yield found


@contextlib.contextmanager
def _damage_reported(path: Path) -> Iterator[None]:
    """Turn what the netCDF library raises for a damaged file into an InputError."""
    try:
        yield
    except (OSError, RuntimeError, AttributeError) as error:
        # AttributeError where an attribute cannot be read, OSError where a file does not open
        text = error.strerror if isinstance(error, OSError) else str(error)
        if not str(text).startswith("NetCDF: "):
            raise
        raise InputError(f"{path}: is damaged ({error}); make it again") from error


@final
class RecordedFile:
    """A result in its file, as far as `results.analysis.recorded.Recorded`, for the summary that a run ends with.

    Importing xarray would take longer than the run.
    """

    def __init__(self, file: "netCDF4.Dataset") -> None:
        file.set_auto_maskandscale(False)
        self.attrs = {name: file.getncattr(name) for name in file.ncattrs()}
        self.encoding = {"source": file.filepath()}
        self.sizes = {name: len(dimension) for name, dimension in file.dimensions.items()}
        self._variables = {name: _VariableInFile(variable) for name, variable in file.variables.items()}

    def __contains__(self, name: object) -> bool:
        return name in self._variables

    def __getitem__(self, name: str) -> "_VariableInFile":
        return self._variables[name]


@final
class _VariableInFile:
    def __init__(self, variable: Any, step: Any = ...) -> None:
        self._variable, self._step = variable, step

    @property
    def dims(self) -> tuple[str, ...]:
        gone = self._variable.dimensions[0] if isinstance(self._step, int | np.integer) else None
        return tuple(name for name in self._variable.dimensions if name != gone)

    @cached_property
    def values(self) -> Array:
        return np.asarray(self._variable[self._step])

    def isel(self, *, step: Any) -> "_VariableInFile":
        return _VariableInFile(self._variable, step)


@contextlib.contextmanager
def open_recorded(path: Path, *, own: bool = False) -> Iterator[RecordedFile]:
    """Open a result without xarray, and close it when the block ends; InputError where it is damaged.

    What this process has just written (`own`) is not looked at by another process first.
    """
    import netCDF4

    if not own:
        check_named(path)
    with _damage_reported(path), netCDF4.Dataset(path) as file:
        recorded = RecordedFile(file)
        layout = {name: (of.dimensions, of.dtype) for name, of in file.variables.items()}
        _check_history(recorded.attrs, layout, recorded.sizes.get("step", 0), path)
        yield recorded


STRINGS = (
    *("content", "date_created", "event_digest", "friction_law", "historysim_version", "history", "id", "license"),
    *("log_digest", "made_with", "scenario", "source", "summary", "title", "validity", "wear_law"),
)
MODULI = ("contact_modulus", "shear_modulus")
KNOWN = {variable.name: variable for variable in (*COORDINATES, *VARIABLES)}
# variables that every result has; a contact that is given by its loads alone has no area
NEEDED = {"time", *(variable.name for variable in recorded(Changes(areas=False))[0])}

Layout = Mapping[str, tuple[tuple[Any, ...], Any]]  # the dimensions and the type of each variable


def _check_history(attributes: Mapping[Any, Any], found: Layout, steps: int, path: Path) -> None:
    """Check that a result is finished, and that attributes and variables are of the kind that this program writes."""
    if not attributes.get("complete"):
        raise InputError(f"{path}: is not a finished result of historysim run; run the scenario again")
    problems = [*_wrong_attributes(attributes), *_wrong_variables(found), *([] if steps else ["it has no steps"])]
    if problems:
        raise InputError(f"{path}: is no result of historysim run, or damaged: {problems[0]}; run the scenario again")


def _wrong_attributes(attributes: Mapping[Any, Any]) -> Iterator[str]:
    for name in STRINGS:
        if name in attributes and not isinstance(attributes[name], str):
            yield f"its attribute {name} is no string"
    for name in MODULI:
        value = attributes.get(name)
        if not (isinstance(value, float | int | np.number) and math.isfinite(value) and value > 0):
            yield f"its attribute {name} is no positive number"
    findings = None
    with contextlib.suppress(ValueError, RecursionError, TypeError):
        findings = json.loads(attributes.get("validity", "[]"))
    if not isinstance(findings, list):
        yield "its attribute validity is no list in JSON"


def _wrong_variables(found: Layout) -> Iterator[str]:
    for name in sorted(NEEDED - found.keys()):
        yield f"it has no variable {name}"
    for name, (dimensions, dtype) in found.items():
        if name in KNOWN and getattr(dtype, "kind", "") not in "iuf":
            yield f"its variable {name} holds no numbers"
        own = tuple(each for each in dimensions if each != DIRECTION)
        if name in KNOWN and own != KNOWN[name].dimensions and name != "present_friction":
            yield f"its variable {name} goes along {', '.join(map(str, dimensions)) or 'nothing'}"
    if any("asperity" in dimensions for dimensions, _ in found.values()) and "asperity" not in found:
        yield "it has no labels of its asperities"
