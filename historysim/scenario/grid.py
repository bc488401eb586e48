"""Keys of a scenario with other values, or with several each (``[sweep]``), and the grid of points that those span."""

import copy
import itertools
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs

from historysim.basics.limits import at_most, most
from historysim.basics.wording import brief, nearest, shown
from historysim.errors import InputError, at, field_error, path_text
from historysim.scenario.schema import Place

SPACINGS = ("linear", "logarithmic")
_RANGE = ("from", "to", "count", "spacing")
_QUANTITY = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?![0-9.])\s*(.*)", re.DOTALL)
_STEP = re.compile(r"""\s*([A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')((?:\[[0-9]{1,9}\])*)\s*(\.|$)""")
Point = dict[str, Any]  # values of the swept keys: ``{"friction.coefficient": 0.3, "surface.seed": 7}``


def place_of(key: str) -> Place:
    """Return the place of a key, such as ``loading.waypoints[1].tangential_load`` or ``sweep.over."surface.seed"``."""
    place: list[str | int] = []
    end, more = 0, "."
    while more:
        step = _STEP.match(key, end)
        if step is None or (name := _unquoted(step[1])) is None:
            raise InputError(
                f'{key!r} is no key; expected names with "." between them, such as friction.coefficient or '
                "loading.waypoints[1].tangential_load, and in quotes, as in TOML, a name with a dot of its own: "
                "sweep.over.'surface.seed'"
            )
        place += [name, *map(int, re.findall("[0-9]+", step[2]))]
        end, more = step.end(), step[3]
    return tuple(place)


def _unquoted(name: str) -> str | None:
    """Return a name without its quotation marks; None where TOML has no such name."""
    try:
        return next(iter(tomllib.loads(f"{name} = 0")))
    except tomllib.TOMLDecodeError:
        return None


def with_values(document: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a document in which keys have other values; a table that is missing on the way is made.

    Raises InputError: a key with a place that is not there and cannot be made.
    """
    result = copy.deepcopy(dict(document))
    for key, value in values.items():
        _put(result, place_of(key), value)
    return result


def text_with_values(text: str, values: Mapping[str, Any]) -> str:
    """Return the TOML of a scenario with other values, comments and order kept; errors as for `with_values`."""
    import tomlkit

    expected = with_values(tomllib.loads(text), values)
    try:
        changed: Any = tomlkit.parse(text)
        for key, value in values.items():
            _put(changed, place_of(key), value)
        if tomllib.loads(tomlkit.dumps(changed)) == expected:
            return tomlkit.dumps(changed)
    except Exception:  # noqa: BLE001, S110 - tomlkit ends in many ways where tables stand in an unusual order
        pass
    # written anew, without comments
    return tomlkit.dumps(expected)


def _put(document: Any, place: Place, value: object) -> None:  # noqa: ANN401 - tables of TOML, or of tomlkit
    here = document
    for depth, step in enumerate(place):
        _check(here, place[:depth], step)
        if depth + 1 == len(place):
            with at(*place):
                here[step] = plain(value)
        elif isinstance(step, str) and step not in here:
            here[step] = {}
        here = here[step]


def plain(value: Any) -> Any:  # noqa: ANN401 - what TOML may hold
    """Return a value as TOML has it; one that a scenario cannot hold is an InputError."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, tuple | list | range):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if not isinstance(value, str | int | float):
        raise InputError(f"{value!r}; expected a number, a string, true or false, an array or a table")
    return value


def _check(here: object, above: Place, step: str | int) -> None:
    """Check that a step can be taken in what stands at a place."""
    where = path_text(above)
    if isinstance(step, int):
        if not isinstance(here, list):
            quoted = f"; a name that holds [{step}] itself stands in quotes" if isinstance(here, dict) else ""
            raise InputError(f"{where}: {shown(here)}; expected an array, to take [{step}] of it{quoted}")
        if step >= len(here):
            last = f"expected [0] to [{len(here) - 1}]" if here else "it is empty"
            raise InputError(f"{where}[{step}]: there is none; {last}")
    elif not isinstance(here, dict):
        raise InputError(f"{where}: {shown(here)}; expected a table, to have {step!r} in it")


@attrs.frozen
class Axis:
    """One dimension of a grid: a key with its values, or several keys that go through theirs together."""

    keys: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]  #: for each position the values of the keys, as a scenario would hold them

    @property
    def name(self) -> str:
        """The name of the dimension: that of its first key."""
        return variable_name(self.keys[0])


@attrs.frozen
class Grid:
    """The points of a sweep: all combinations of positions on its axes."""

    axes: tuple[Axis, ...]  #: the last one varies fastest

    def __len__(self) -> int:
        """Return the number of points."""
        return math.prod(self.shape)

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of positions on each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def dims(self) -> tuple[str, ...]:
        """The names of the axes."""
        return tuple(axis.name for axis in self.axes)

    def points(self) -> Iterator[Point]:
        """Yield the points, in the order of an array of the grid's shape."""
        for values in itertools.product(*(axis.values for axis in self.axes)):
            yield self._point(values)

    def ends(self) -> dict[int, Point]:
        """Return the first and the last point, by their numbers."""
        return {end % len(self): self._point([axis.values[end] for axis in self.axes]) for end in (0, -1)}

    def _point(self, values: Sequence[Sequence[Any]]) -> Point:
        keys = [key for axis in self.axes for key in axis.keys]
        return dict(zip(keys, itertools.chain.from_iterable(values), strict=True))


def variable_name(key: str) -> str:
    """Return the name of a key in netCDF: ``"loading_waypoints_1_tangential_load"``."""
    return re.sub(r"[^A-Za-z0-9]+", "_", key).strip("_")


def grid_of(over: Mapping[str, Any], together: Sequence[Sequence[str]] = ()) -> Grid:
    """Return the grid that keys and their values span; what spans none is an InputError with its place.

    Parameters
    ----------
    over : dict
        By key an array of values, or a range: ``{"from": "1 nm", "to": "10 nm", "count": 4}``, both ends included,
        [``"spacing": "logarithmic"``]; without ``to`` whole numbers that follow one another, such as seeds. A table of
        tables is the same as a key with dots.
    together : sequence of sequence of str
        Keys that go through their values together, as one dimension; any other two are crossed.
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
        raise field_error(f"{len(grid):,} points; {at_most('POINTS')}", "over")
    names = [variable_name(key) for key in expanded]
    if doubled := {name for name in names if names.count(name) > 1}:
        raise field_error(
            f"two keys would be called {min(doubled)}; expected keys that differ in their letters", "over"
        )
    return grid


def expand(value: object) -> list[Any]:
    """Return the values of an array or of a range, as `grid_of` has them; anything else is an InputError."""
    if isinstance(value, Mapping):
        return _range(value)
    if isinstance(value, str) or not isinstance(value := plain(value), list):
        raise InputError(f"{shown(value)}; expected an array of values, or a range such as {{ from = 1, count = 20 }}")
    if not value:
        raise InputError("no values; expected one or more")
    return value


def _flat(over: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield keys with dots; a table with ``from`` is a range, any other holds further keys."""
    if not isinstance(over, Mapping):
        raise InputError(f"{brief(over)}; expected keys with values, as {{'friction.coefficient': [0.1, 0.2]}}")
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
            raise field_error(f"unknown key; {nearest(key, _RANGE)}", key)
    count = entry.get("count")
    if "from" not in entry or not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError("expected a range with from and count (1 or more), and usually to")
    if count > most("POINTS"):
        raise field_error(f"{shown(count)}; {at_most('POINTS')}", "count")
    first = entry["from"]
    if "to" not in entry:
        if not isinstance(first, int) or isinstance(first, bool) or "spacing" in entry:
            raise InputError("a range without to counts whole numbers; expected to, or a whole number as from")
        return list(range(first, first + count))
    spacing = entry.get("spacing", SPACINGS[0])
    if spacing not in SPACINGS:
        raise field_error(f"{shown(spacing)}; {nearest(str(spacing), SPACINGS)}", "spacing")
    (low, unit), (high, other) = _number(first), _number(entry["to"])
    if unit != other:
        raise field_error(f"in {other or 'no unit'}, and from in {unit or 'none'}; expected one unit for both", "to")
    if count < 2:
        raise field_error(f"{count}; expected 2 or more, from and to among them", "count")
    if spacing == "logarithmic" and not low * high > 0:
        raise InputError("a logarithmic range has from and to of one sign, neither of them 0")
    import numpy as np

    numbers = (np.geomspace if spacing == "logarithmic" else np.linspace)(low, high, count)
    return [f"{value!r} {unit}" if unit else value for value in numbers.tolist()]


def _number(value: object) -> tuple[float, str]:
    """Return a number and its unit."""
    match = None if isinstance(value, bool) else _QUANTITY.fullmatch(str(value))
    if match is None:
        raise InputError(f"{shown(value)}; expected a number, or a string with a unit")
    number, unit = float(match[1]), match[2].strip()
    if not math.isfinite(number):
        raise InputError(f"{shown(value)}; expected a finite number")
    return number, unit
