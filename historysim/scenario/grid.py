"""``[sweep]``: keys of a scenario with several values each, and the grid of points that they span."""

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from historysim.basics.limits import at_most, most
from historysim.basics.places import at, misfit
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError
from historysim.scenario.overriding import place_of, plain

SPACINGS = ("linear", "logarithmic")
_RANGE = ("from", "to", "count", "spacing")
_QUANTITY = re.compile(r"\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*(.*)", re.DOTALL)

Point = dict[str, Any]
"""Values of the swept keys: ``{"friction.coefficient": 0.3, "surface.seed": 7}``."""


@attrs.frozen
class Axis:
    """One dimension of a grid: a key with its values, or several keys that go through theirs together."""

    keys: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]
    """For each position the values of the keys, as a scenario would hold them."""

    @property
    def name(self) -> str:
        """The name of the dimension: that of its first key."""
        return variable_name(self.keys[0])


@attrs.frozen
class Grid:
    """The points of a sweep: all combinations of positions on its axes."""

    axes: tuple[Axis, ...]
    """The last one varies fastest."""

    def __len__(self) -> int:
        """Return the number of points."""
        return math.prod(self.shape)

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of positions on each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    def points(self) -> Iterator[Point]:
        """Yield the points, in the order of an array of the grid's shape."""
        for values in itertools.product(*(axis.values for axis in self.axes)):
            yield _point(self.axes, values)


def _point(axes: Sequence[Axis], values: Sequence[Sequence[Any]]) -> Point:
    return {
        key: value for axis, own in zip(axes, values, strict=True) for key, value in zip(axis.keys, own, strict=True)
    }


def variable_name(key: str) -> str:
    """Return the name of a key as netCDF takes it: ``"loading_waypoints_1_tangential_load"``."""
    return re.sub(r"[^A-Za-z0-9]+", "_", key).strip("_")


def grid_of(over: Mapping[str, Any], together: Sequence[Sequence[str]] = ()) -> Grid:
    """Return the grid that keys and their values span.

    Parameters
    ----------
    over : dict
        By key an array of values, or a range: ``{"from": "1 nm", "to": "10 nm", "count": 4}``, both ends included,
        [``"spacing": "logarithmic"``]; without ``to`` whole numbers that follow one another, such as seeds. A table of
        tables is the same as a key with dots.
    together : sequence of sequence of str
        Keys that go through their values together, as one dimension; any other two are crossed.

    Raises
    ------
    InputError
        No keys, no values, a range that is none, or keys of one dimension with different numbers of values; each with
        its place.
    """
    with at("over"):
        values: dict[str, Any] = {}
        for key, value in _flat(over):
            if key in values:
                raise InputError(f"{key} appears twice, with quotes and without; expected its values once")
            values[key] = value
        if not values:
            raise InputError("no keys; expected one or more, such as friction.coefficient = [0.1, 0.2]")
        expanded: dict[str, list[Any]] = {}
        for key, value in values.items():
            with at(*place_of(key)):
                expanded[key] = expand(value)
    axes = tuple(_axes(expanded, together))
    grid = Grid(axes)
    if len(grid) > most("POINTS"):
        raise misfit(f"{len(grid):,} points; {at_most('POINTS')}", "over")
    names = [variable_name(key) for key in expanded]
    if doubled := {name for name in names if names.count(name) > 1}:
        raise misfit(f"two keys would be called {min(doubled)}; expected keys that differ in their letters", "over")
    return grid


def expand(value: object) -> list[Any]:
    """Return the values of an array or of a range, as `grid_of` has them.

    Raises InputError: neither, or a range that is none.
    """
    if isinstance(value, Mapping):
        return _range(value)
    if isinstance(value, str) or not isinstance(value := plain(value), list):
        raise InputError(f"{shown(value)}; expected an array of values, or a range such as {{ from = 1, count = 20 }}")
    if not value:
        raise InputError("no values; expected one or more")
    return value


def _flat(over: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield keys with dots; a table is a range where it says from where, else it holds further keys."""
    for name, value in over.items():
        key = f"{above}.{name}" if above else str(name)
        if isinstance(value, Mapping) and "from" not in value:
            yield from _flat(value, key)
        else:
            yield key, value


def _axes(values: Mapping[str, list[Any]], together: Sequence[Sequence[str]]) -> Iterator[Axis]:
    groups: dict[str, tuple[str, ...]] = {key: (key,) for key in values}
    for index, keys in enumerate(together):
        with at("together", index):
            _check_group(keys, values, groups)
        groups |= dict.fromkeys(keys, tuple(keys))
    for keys in dict.fromkeys(groups.values()):
        yield Axis(keys, tuple(zip(*(values[key] for key in keys), strict=True)))


def _check_group(keys: Sequence[str], values: Mapping[str, list[Any]], groups: Mapping[str, tuple[str, ...]]) -> None:
    """Check that keys can go through their values together."""
    if len(keys) < 2 or len(set(keys)) < len(keys):
        raise InputError("expected two or more keys, each of them once")
    for key in keys:
        if key not in values:
            raise InputError(f"{key!r} has no values in over; {nearest(key, values)}")
        if len(groups[key]) > 1:
            raise InputError(f"{key!r} stands in another group already; expected it in one")
    counts = {key: len(values[key]) for key in keys}
    if len(set(counts.values())) > 1:
        numbers = ", ".join(f"{count} of {key}" for key, count in counts.items())
        raise InputError(f"{numbers}; expected as many values of one as of the other")


def _range(entry: Mapping[str, Any]) -> list[Any]:
    for key in entry:
        if key not in _RANGE:
            raise misfit(f"unknown key; {nearest(key, _RANGE)}", key)
    count = entry.get("count")
    if "from" not in entry or not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError("expected a range with from and count (1 or more), and usually to")
    if count > most("POINTS"):
        raise misfit(f"{shown(count)}; {at_most('POINTS')}", "count")
    first = entry["from"]
    if "to" not in entry:
        if not isinstance(first, int) or isinstance(first, bool) or "spacing" in entry:
            raise InputError("a range without to counts whole numbers; expected to, or a whole number as from")
        return list(range(first, first + count))
    spacing = entry.get("spacing", SPACINGS[0])
    if spacing not in SPACINGS:
        raise misfit(f"{shown(spacing)}; {nearest(str(spacing), SPACINGS)}", "spacing")
    (low, unit), (high, other) = _number(first), _number(entry["to"])
    if unit != other:
        raise misfit(f"in {other or 'no unit'}, and from in {unit or 'none'}; expected one unit for both", "to")
    if count < 2:
        raise misfit(f"{count}; expected 2 or more, from and to among them", "count")
    if spacing == "logarithmic":
        if not low * high > 0:
            raise InputError("a logarithmic range has from and to of one sign, neither of them 0")
        numbers = np.geomspace(low, high, count)
    else:
        numbers = np.linspace(low, high, count)
    return [f"{value!r} {unit}" if unit else value for value in numbers.tolist()]


def _number(value: object) -> tuple[float, str]:
    """Return a number and its unit."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        number, unit = float(value), ""
    elif isinstance(value, str) and (match := _QUANTITY.fullmatch(value)):
        try:
            number, unit = float(match[1]), match[2].strip()
        except ValueError:
            raise InputError(f"{shown(value)}; expected a number, or a text with a unit") from None
    else:
        raise InputError(f"{shown(value)}; expected a number, or a text with a unit")
    if not math.isfinite(number):
        raise InputError(f"{shown(value)}; expected a finite number")
    return number, unit
