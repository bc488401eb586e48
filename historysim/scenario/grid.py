"""Replacement of values in a scenario, and the grid of points spanned by keys with several values (``[sweep]``)."""

import copy
import itertools
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs

from historysim.basics.limits import at_most, most
from historysim.basics.wording import brief, format_value, nearest
from historysim.errors import InputError, error_path, field_error, path_text
from historysim.scenario.schema import Place

SPACINGS = ("linear", "logarithmic")
_RANGE = ("from", "to", "count", "spacing")
_QUANTITY = re.compile(
    r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?![0-9.])\s*(.*)", re.DOTALL
)
_STEP = re.compile(
    r"""\s*([A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')((?:\[[0-9]{1,9}\])*)\s*(\.|$)"""
)
# values of the swept keys: ``{"friction.coefficient": 0.3, "surface.seed": 7}``
Point = dict[str, Any]


def path_of_key(key: str) -> Place:
    """Parse a key into its path, such as ``loading.waypoints[1].tangential_load`` or ``sweep.over."surface.seed"``."""
    path: list[str | int] = []
    position, more = 0, "."
    while more:
        step = _STEP.match(key, position)
        if step is None or (name := _unquote(step[1])) is None:
            raise InputError(
                f'{key!r} is not a key; expected names with "." between them, such as friction.coefficient or '
                "loading.waypoints[1].tangential_load, and quotes, as in TOML, around a name that contains a dot: "
                "sweep.over.'surface.seed'"
            )
        path += [name, *map(int, re.findall("[0-9]+", step[2]))]
        position, more = step.end(), step[3]
    return tuple(path)


def _unquote(name: str) -> str | None:
    """Return a name without its quotation marks; None if it is not a key of TOML."""
    try:
        return next(iter(tomllib.loads(f"{name} = 0")))
    except tomllib.TOMLDecodeError:
        return None


def with_values(document: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a document with replaced values; missing tables are added.

    Raises InputError: a key whose parent does not exist and cannot be added.
    """
    result = copy.deepcopy(dict(document))
    for key, value in values.items():
        _put(result, path_of_key(key), value)
    return result


def text_with_values(text: str, values: Mapping[str, Any]) -> str:
    """Replace values in the TOML text of a scenario, keeping comments and order; errors as for `with_values`."""
    import tomlkit

    expected = with_values(tomllib.loads(text), values)
    try:
        changed: Any = tomlkit.parse(text)
        for key, value in values.items():
            _put(changed, path_of_key(key), value)
        if tomllib.loads(tomlkit.dumps(changed)) == expected:
            return tomlkit.dumps(changed)
    except Exception:  # noqa: BLE001, S110 - tomlkit fails in many ways if tables are in an unusual order
        pass
    # rewritten without comments
    return tomlkit.dumps(expected)


def _put(document: Any, path: Place, value: object) -> None:  # noqa: ANN401 - tables of TOML, or of tomlkit
    container = document
    for depth, step in enumerate(path):
        _check(container, path[:depth], step)
        if depth + 1 == len(path):
            with error_path(*path):
                container[step] = plain(value)
        elif isinstance(step, str) and step not in container:
            container[step] = {}
        container = container[step]


def plain(value: Any) -> Any:  # noqa: ANN401 - any TOML value
    """Convert a value to a TOML type; InputError if a scenario cannot hold it."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, tuple | list | range):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if not isinstance(value, str | int | float):
        raise InputError(
            f"{value!r}; expected a number, a string, true or false, an array or a table"
        )
    return value


def _check(container: object, parent_path: Place, step: str | int) -> None:
    """Check that a container has an entry for the next step of a path."""
    where = path_text(parent_path)
    if isinstance(step, int):
        if not isinstance(container, list):
            quoted = (
                f"; a name that contains [{step}] itself needs quotes"
                if isinstance(container, dict)
                else ""
            )
            raise InputError(
                f"{where}: {format_value(container)}; expected an array, for [{step}]{quoted}"
            )
        if step >= len(container):
            expected = f"expected [0] to [{len(container) - 1}]" if container else "it is empty"
            raise InputError(f"{where}[{step}]: does not exist; {expected}")
    elif not isinstance(container, dict):
        raise InputError(f"{where}: {format_value(container)}; expected a table, for {step!r}")


@attrs.frozen
class Axis:
    """One dimension of a grid: a key with its values, or several keys whose values vary together."""

    keys: tuple[str, ...]
    #: for each position the values of the keys, as in a scenario
    values: tuple[tuple[Any, ...], ...]

    @property
    def name(self) -> str:
        """Name of the dimension, from its first key."""
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
        """Number of positions on each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the axes."""
        return tuple(axis.name for axis in self.axes)

    def points(self) -> Iterator[Point]:
        """Yield the points, in the order of an array of the grid's shape."""
        for values in itertools.product(*(axis.values for axis in self.axes)):
            yield self._point(values)

    def ends(self) -> dict[int, Point]:
        """Return the first and the last point by their numbers."""
        return {
            position % len(self): self._point([axis.values[position] for axis in self.axes])
            for position in (0, -1)
        }

    def _point(self, values: Sequence[Sequence[Any]]) -> Point:
        keys = [key for axis in self.axes for key in axis.keys]
        return dict(zip(keys, itertools.chain.from_iterable(values), strict=True))


def variable_name(key: str) -> str:
    """Return the name of a key in netCDF: ``"loading_waypoints_1_tangential_load"``."""
    return re.sub(r"[^A-Za-z0-9]+", "_", key).strip("_")


def build_grid(over: Mapping[str, Any], together: Sequence[Sequence[str]] = ()) -> Grid:
    """Build the grid spanned by keys and their values; InputError with the key that is wrong.

    Parameters
    ----------
    over : dict
        By key an array of values, or a range: ``{"from": "1 nm", "to": "10 nm", "count": 4}``, both
        ends included, [``"spacing": "logarithmic"``]; without ``to`` consecutive whole numbers,
        such as seeds. Nested tables are equivalent to keys with dots.
    together : sequence of sequence of str
        Keys whose values vary together, as one dimension; all other keys are combined with each
        other.
    """
    with error_path("over"):
        values: dict[str, Any] = {}
        for key, value in _flat(over):
            if key in values:
                raise InputError(
                    f"{key} appears twice, with quotes and without; expected its values once"
                )
            values[key] = value
        if not values:
            raise InputError(
                "no keys; expected one or more, such as friction.coefficient = [0.1, 0.2]"
            )
        expanded: dict[str, list[Any]] = {}
        for key, value in values.items():
            with error_path(*path_of_key(key)):
                expanded[key] = expand(value)
    axes = tuple(_axes(expanded, together))
    grid = Grid(axes)
    if len(grid) > most("POINTS"):
        raise field_error(f"{len(grid):,} points; {at_most('POINTS')}", "over")
    names = [variable_name(key) for key in expanded]
    if doubled := {name for name in names if names.count(name) > 1}:
        raise field_error(
            f"two keys have the variable name {min(doubled)}; expected keys that differ in their letters",
            "over",
        )
    return grid


def expand(value: object) -> list[Any]:
    """Return the values of an array or of a range, as for `build_grid`; InputError for any other value."""
    if isinstance(value, Mapping):
        return _range(value)
    if isinstance(value, str) or not isinstance(value := plain(value), list):
        raise InputError(
            f"{format_value(value)}; expected an array of values, or a range such as {{ from = 1, count = 20 }}"
        )
    if not value:
        raise InputError("no values; expected one or more")
    return value


def _flat(over: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield keys with dots; a table with ``from`` is a range, any other table holds further keys."""
    if not isinstance(over, Mapping):
        raise InputError(
            f"{brief(over)}; expected keys with values, as {{'friction.coefficient': [0.1, 0.2]}}"
        )
    for name, value in over.items():
        key = f"{prefix}.{name}" if prefix else str(name)
        if isinstance(value, Mapping) and "from" not in value:
            yield from _flat(value, key)
        else:
            yield key, value


def _axes(values: Mapping[str, list[Any]], together: Sequence[Sequence[str]]) -> Iterator[Axis]:
    groups: dict[str, tuple[str, ...]] = {key: (key,) for key in values}
    for index, keys in enumerate(together):
        with error_path("together", index):
            _check_group(keys, values, groups)
        groups |= dict.fromkeys(keys, tuple(keys))
    for keys in dict.fromkeys(groups.values()):
        yield Axis(keys, tuple(zip(*(values[key] for key in keys), strict=True)))


def _check_group(
    keys: Sequence[str], values: Mapping[str, list[Any]], groups: Mapping[str, tuple[str, ...]]
) -> None:
    """Check that the values of keys can vary together."""
    if len(keys) < 2 or len(set(keys)) < len(keys):
        raise InputError("expected two or more keys, each of them once")
    for key in keys:
        if key not in values:
            raise InputError(f"{key!r} has no values in over; {nearest(key, values)}")
        if len(groups[key]) > 1:
            raise InputError(f"{key!r} is in another group as well; expected it in one")
    counts = {key: len(values[key]) for key in keys}
    if len(set(counts.values())) > 1:
        numbers = ", ".join(f"{count} of {key}" for key, count in counts.items())
        raise InputError(f"{numbers}; expected the same number of values for each key")


def _range(entry: Mapping[str, Any]) -> list[Any]:
    for key in entry:
        if key not in _RANGE:
            raise field_error(f"unknown key; {nearest(key, _RANGE)}", key)
    count = entry.get("count")
    if "from" not in entry or not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError("expected a range with from and count (1 or more), and usually to")
    if count > most("POINTS"):
        raise field_error(f"{format_value(count)}; {at_most('POINTS')}", "count")
    start = entry["from"]
    if "to" not in entry:
        if not isinstance(start, int) or isinstance(start, bool) or "spacing" in entry:
            raise InputError(
                "a range without to counts whole numbers; expected to, or a whole number as from"
            )
        return list(range(start, start + count))
    spacing = entry.get("spacing", SPACINGS[0])
    if spacing not in SPACINGS:
        raise field_error(f"{format_value(spacing)}; {nearest(str(spacing), SPACINGS)}", "spacing")
    (low, unit), (high, end_unit) = _number(start), _number(entry["to"])
    if unit != end_unit:
        raise field_error(
            f"in {end_unit or 'no unit'}, and from in {unit or 'none'}; expected one unit for both",
            "to",
        )
    if count < 2:
        raise field_error(f"{count}; expected 2 or more, including from and to", "count")
    if spacing == "logarithmic" and not low * high > 0:
        raise InputError(
            "expected from and to of one sign, neither of them 0, for a logarithmic range"
        )
    import numpy as np

    numbers = (np.geomspace if spacing == "logarithmic" else np.linspace)(low, high, count)
    return [f"{value!r} {unit}" if unit else value for value in numbers.tolist()]


def _number(value: object) -> tuple[float, str]:
    """Return a number and its unit."""
    match = None if isinstance(value, bool) else _QUANTITY.fullmatch(str(value))
    if match is None:
        raise InputError(f"{format_value(value)}; expected a number, or a string with a unit")
    number, unit = float(match[1]), match[2].strip()
    if not math.isfinite(number):
        raise InputError(f"{format_value(value)}; expected a finite number")
    return number, unit
