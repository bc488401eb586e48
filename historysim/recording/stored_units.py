"""Units that a file or a Dataset states for recorded variables: converted to the declared units, or an InputError."""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.units import conversion_factor, has_unit, to_si
from historysim.basics.wording import quote
from historysim.errors import InputError
from historysim.recording.variables import (
    BOUNDED,
    COORDINATES,
    SLIDE_TIME,
    known_variables,
    make_bounding_variables,
)

if TYPE_CHECKING:
    import xarray as xr

PLAIN = {"", "1"}  # declared units of flags and of plain numbers
_PACKING = ("scale_factor", "add_offset")


def declared_units() -> dict[str, str]:
    """Return the units of all recorded variables by name."""
    known = known_variables()
    bounds = [
        one
        for variable in known
        if variable.name in BOUNDED
        for one in make_bounding_variables(variable)
    ]
    return {
        variable.name: variable.units for variable in (*COORDINATES, SLIDE_TIME, *known, *bounds)
    }


def is_as_recorded(attributes: Mapping[str, Any], unit: str) -> bool:
    """Return whether the numbers of a variable in a file are in its declared unit, and not packed."""
    return attributes.get("units", "") == unit and not any(name in attributes for name in _PACKING)


def unit_factor(name: str, attributes: Mapping[Any, Any], unit: str) -> float:
    """Return the factor from the unit in the attributes of a variable to its declared unit.

    InputError: there is no unit, or it is unknown, of another dimension, or a date.
    """
    given = attributes.get("units", "")
    if given == unit or (unit in PLAIN and given in {*PLAIN, "dimensionless"}):
        return 1.0
    mend = f'expected {unit or "no unit"}: where the numbers are in it, history["{name}"].attrs["units"] = "{unit}"'
    if not isinstance(given, str) or not given.strip():
        stated = f"holds {quote(given)}" if "units" in attributes else "is missing"
        raise InputError(f"{name} of the history: its attribute units {stated}; {mend}")
    if " since " in given or "calendar" in attributes:
        raise _date_error(name, given)
    try:
        # pint writes "meter ** 2"
        return conversion_factor(re.sub(r"\s*\*\*\s*", "**", given.strip()), unit or "1")
    except InputError as error:
        raise InputError(f"{name} of the history: its attribute units: {error}; {mend}") from error


def to_declared_units(history: "xr.Dataset") -> "xr.Dataset":
    """Return a history with all recorded variables in their declared units; the same object if they have them already.

    Values are read when they are used. InputError as for `unit_factor`.
    """
    units = declared_units()
    names = [str(name) for name in history.variables if name in units]
    converted = {name: _convert(name, history.variables[name], units[name]) for name in names}
    changed = {
        name: variable
        for name, variable in converted.items()
        if variable is not history.variables[name]
    }
    if not changed:
        return history
    coordinates = {name: variable for name, variable in changed.items() if name in history.coords}
    data = {name: variable for name, variable in changed.items() if name not in coordinates}
    result = history.assign(data).assign_coords(coordinates)
    result.encoding = history.encoding
    return result


def _convert(name: str, variable: "xr.Variable", unit: str) -> "xr.Variable":
    """Return a variable in its declared unit; the same object if it is."""
    from xarray.conventions import decode_cf_variable

    attributes = {
        key: value for key, value in variable.attrs.items() if key not in {"calendar", "dtype"}
    }
    kind = variable.dtype.kind
    if kind == "M" or (kind == "O" and name == "time"):
        raise _date_error(name, str(variable.encoding.get("units", variable.dtype)))
    if kind == "m" and unit == "s":
        return variable.copy(data=variable.values / np.timedelta64(1, "s"))._replace(
            attrs=attributes | {"units": unit}
        )
    if (
        "units" not in variable.attrs
        and unit not in PLAIN
        and kind == "f"
        and has_unit(variable.data)
    ):
        return variable.copy(data=to_si(variable.data, unit))._replace(
            attrs=attributes | {"units": unit}
        )
    if kind not in "iuf" or is_as_recorded(variable.attrs, unit):
        return variable
    factor = unit_factor(name, variable.attrs, unit)
    if factor == 1:
        return variable
    # xarray multiplies when values are read
    raw = variable.copy(deep=False)
    raw.attrs, raw.encoding = attributes | {"units": unit, "scale_factor": factor}, {}
    decoded: xr.Variable = decode_cf_variable(name, raw, decode_times=False)
    decoded.encoding = {}
    return decoded


def _date_error(name: str, unit: str) -> InputError:
    return InputError(
        f"{name} of the history holds dates ({quote(unit)}); expected elapsed time in s: history.assign_coords("
        f'{name}=(history.{name} - history.{name}[0]) / numpy.timedelta64(1, "s")) if it starts at 0 s, with the '
        'attribute units = "s"'
    )
