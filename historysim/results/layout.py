"""The layout of a history: its variables by name, along ``step`` and ``asperity`` in this order.

Users of xarray join, cut, transpose and rename histories. `standard_layout` undoes what can be
undone by the names of variables and dimensions, and reports the rest, so that queries and pictures
deal with one layout only.
"""

import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from historysim.basics.arguments import DIRECTION
from historysim.errors import InputError
from historysim.recording.stored_units import to_declared_units
from historysim.recording.variables import COORDINATES, SLIDE_TIME, Variable, known_variables
from historysim.results.history_view import MODULI

if TYPE_CHECKING:
    import xarray as xr

# coordinates that remain if one step or asperity is selected
_LABELS = {"step": "time", "asperity": "asperity"}
_COORDINATES = frozenset(variable.name for variable in COORDINATES)
_SINGLE_PRECISION = np.dtype(np.float32).itemsize


def is_dataset(data: object) -> "TypeGuard[xr.Dataset]":
    """Return True for a Dataset; pictures of records do not need xarray, which takes long to import."""
    xarray = sys.modules.get("xarray")
    return xarray is not None and isinstance(data, xarray.Dataset)


def is_history(data: object) -> bool:
    """Return whether an object is a Dataset with the loads of a history, and not a sweep or a table of such loads."""
    return (
        is_dataset(data) and "total_normal_load" in data.variables and "content" not in data.attrs
    )


def selected_axes(history: "xr.Dataset") -> tuple[str, ...]:
    """Return the axes, ``step`` or ``asperity``, of which one member was selected, so that they are not dimensions."""
    scalars = {axis: label for axis, label in _LABELS.items() if axis not in history.dims}
    variables = history.variables
    return tuple(
        axis for axis, label in scalars.items() if label in variables and not variables[label].dims
    )


def standard_layout(history: "xr.Dataset") -> "xr.Dataset":
    """Return a history with its declared dimensions, types and coordinates; the same object if it has them already.

    Undone are ``transpose``, ``swap_dims``, ``reset_coords`` and ``set_coords``, the selection of
    one step or asperity, the repetition of constants by `xarray.concat`, and flags and counts that
    became floating-point numbers.

    Raises
    ------
    InputError
        A history with missing variables, attributes, labels or values, with renamed dimensions,
        with steps that are not in the order of time, or with numbers of too few bits.
    """
    _check_complete(history)
    result = _with_axes(to_declared_units(history))
    selected = selected_axes(result)
    declarations = _declarations()
    variables = {
        str(name): _as_declared(variable, declarations[str(name)], selected)
        if name in declarations
        else variable
        for name, variable in result.variables.items()
    }
    foreign = {name for name in result.coords if name not in declarations}
    coordinates = foreign | (_COORDINATES & variables.keys())
    if coordinates != {*result.coords} or any(
        variables[str(name)] is not declared_variable
        for name, declared_variable in result.variables.items()
    ):
        data = {name: variable for name, variable in variables.items() if name not in coordinates}
        result = type(history)(
            data, {name: variables[str(name)] for name in coordinates}, history.attrs
        )
    if result is not history:
        # where it comes from
        result.encoding = history.encoding
    _check_order(result)
    return result


def _declarations() -> Mapping[str, Sequence[Variable]]:
    declarations: dict[str, list[Variable]] = {}
    for variable in (*COORDINATES, SLIDE_TIME, *known_variables()):
        declarations.setdefault(variable.name, []).append(variable)
    return declarations


def _check_complete(history: "xr.Dataset") -> None:
    """Check that a history has the variables and attributes that every history has."""
    if not is_history(history):
        raise InputError(
            "this Dataset is not a history; expected one from historysim, with all its variables"
        )
    if "time" not in history.variables:
        raise _missing_variables(["time"])
    for name in MODULI:
        value = history.attrs.get(name)
        if not (isinstance(value, float | int | np.number) and math.isfinite(value) and value > 0):
            raise InputError(
                f"the history has no attribute {name}; expected those of the original history: "
                "history.assign_attrs(original.attrs), or xarray.set_options(keep_attrs=True) before"
            )


@contextmanager
def report_missing_variables(*histories: object) -> Iterator[None]:
    """Raise InputError instead of the KeyError of a declared variable that one of the histories does not have."""
    try:
        yield
    except KeyError as error:
        # queries and pictures need a few variables each, so the error itself tells which one is
        # missing
        names = {name for name in _declarations() if f"'{name}'" in str(error)}
        for history in histories:
            if is_dataset(history) and (missing := names - history.variables.keys()):
                raise _missing_variables(missing) from error
        raise


def _missing_variables(names: Iterable[str]) -> InputError:
    return InputError(
        f"the history has no variable {', '.join(sorted(names))}; expected a Dataset from historysim, with all its "
        "variables"
    )


def _with_axes(history: "xr.Dataset") -> "xr.Dataset":
    """Return a history along ``step`` and ``asperity``, which may have been swapped for coordinates."""
    if "time" in history.xindexes and history["time"].dims == ("step",):
        # the index of a lazy history, with which xarray cannot rename the coordinate
        history = history.drop_indexes("time")
    swapped: dict[str, str] = {}
    for axis, label in _LABELS.items():
        lost = (
            axis not in history.dims
            and label in history.variables
            and len(history.variables[label].dims) == 1
        )
        if lost:
            dimension = str(history.variables[label].dims[0])
            if dimension not in history.coords:
                raise _name_error(dimension, axis)
            swapped[dimension] = axis
    result = history.swap_dims(swapped) if swapped else history
    if "asperity" in result.dims and "asperity" not in result.variables:
        raise InputError(
            "the history has no labels of its asperities; expected those of the original history: "
            "history.assign_coords(asperity=original.asperity)"
        )
    if not result.sizes.get("step", 1):
        raise InputError("the history has no steps; expected one or more")
    return result


def _name_error(dimension: str, axis: str) -> InputError:
    return InputError(
        f'the history varies along {dimension}, not {axis}; expected history.rename({dimension}="{axis}")'
    )


def _as_declared(
    variable: "xr.Variable", declarations: Sequence[Variable], selected: Sequence[str]
) -> "xr.Variable":
    """Return a variable with the dimensions and the type that it is declared with."""
    # friction is declared along the steps, and along the asperities, too, if these differ
    declared = max(
        declarations, key=lambda declaration: len({*declaration.dimensions} & {*variable.dims})
    )
    undeclared = [
        str(dimension)
        for dimension in variable.dims
        if dimension not in {*declared.dimensions, DIRECTION}
    ]
    missing = [axis for axis in declared.dimensions if axis not in {*variable.dims, *selected}]
    if len(undeclared) == len(missing) == 1:
        raise _name_error(undeclared[0], missing[0])
    for dimension in undeclared:
        variable = _without(variable, dimension, declared.name)
    for axis in declared.dimensions:
        if axis in selected and axis not in variable.dims:
            variable = variable.set_dims({axis: 1, **variable.sizes})  # type: ignore[no-untyped-call] # of xarray
    if missing:
        along = ", ".join(map(str, variable.dims)) or "nothing"
        raise InputError(
            f"{declared.name} of the history varies along {along}; expected {' and '.join(missing)}, too"
        )
    order = (*declared.dimensions, *([DIRECTION] if DIRECTION in variable.dims else []))
    return _with_type(variable if variable.dims == order else variable.transpose(*order), declared)


def _without(variable: "xr.Variable", dimension: str, name: str) -> "xr.Variable":
    """Return a variable without a dimension along which it is constant, as `xarray.concat` repeats it."""
    start = variable.isel({dimension: 0}) if variable.size else variable
    missing = variable.isnull()
    if bool((missing != start.isnull()).any()):
        raise InputError(
            f"{name} of the history has missing values along {dimension}; expected recorded values alone, as "
            "history.sel and history.isel select them, unlike history.where"
        )
    if not variable.size or not bool(((variable == start) | missing).all()):
        raise InputError(
            f"{name} of the history differs along {dimension}; expected parts of one history, or one of several "
            f"histories: history.isel({dimension}=0)"
        )
    return start


def _with_type(variable: "xr.Variable", declared: Variable) -> "xr.Variable":
    """Convert a variable to its declared type; InputError if a flag or count is missing."""
    kind = variable.dtype.kind
    size = variable.dtype.itemsize
    is_integer = np.dtype(declared.dtype).kind == "i"
    if not (kind == "f" and size >= _SINGLE_PRECISION) and not (is_integer and kind in "iu"):
        raise InputError(
            f"{declared.name} of the history holds {variable.dtype}; expected {declared.dtype}, as it was recorded"
        )
    if not is_integer or kind != "f":
        return variable
    values = variable.values
    if not (np.isfinite(values).all() and (values == np.rint(values)).all()):
        raise InputError(
            f"{declared.name} of the history has missing or interpolated values; expected recorded steps and "
            "asperities, selected with isel or sel"
        )
    return type(variable)(variable.dims, values.astype(declared.dtype), variable.attrs)


def _check_order(history: "xr.Dataset") -> None:
    """Check that times do not decrease and labels of asperities differ."""
    time = history.variables["time"].values
    if not np.isfinite(time).all():
        raise InputError(
            "the history has steps without a time; expected recorded steps, selected with isel"
        )
    if falls := np.flatnonzero(np.diff(time) < 0).tolist():
        raise InputError(
            f"time decreases after step {falls[0]} of the history; expected each step once, in the order of time: "
            'history.sortby("time") of parts that do not overlap'
        )
    labels = history.variables["asperity"].values if "asperity" in history.dims else np.zeros(0)
    if np.unique(labels).size < labels.size:
        raise InputError(
            "asperities of the history have the same label; expected each asperity once"
        )
