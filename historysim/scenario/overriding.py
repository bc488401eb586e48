"""Keys of a scenario with other values: in what is read, and in the text that a result keeps."""

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from historysim.basics.places import at
from historysim.basics.wording import shown
from historysim.errors import InputError, path_text

Place = tuple[str | int, ...]

_STEP = re.compile(r"""\s*([A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')((?:\[[0-9]{1,9}\])*)\s*(\.|$)""")


def place_of(key: str) -> Place:
    """Return the place that a key names, as messages write it: ``"loading.waypoints[1].tangential_load"``.

    A name that holds more than letters, digits, ``_`` and ``-`` is quoted as in TOML: ``sweep.over."surface.seed"``.

    Raises InputError: a text that is no such key.
    """
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
    """Return a name without its quotation marks; None where it is none of TOML."""
    try:
        return next(iter(tomllib.loads(f"{name} = 0")))
    except tomllib.TOMLDecodeError:
        return None


def with_values(document: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document in which keys have other values; the one that is given stays as it is.

    Parameters
    ----------
    document : dict
        What stands in a TOML file.
    values : dict
        Values by key: ``{"friction.coefficient": 0.3}``. A table that is missing on the way is made.

    Raises
    ------
    InputError
        A key whose place is not there and cannot be made.
    """
    result: Any = dict(document)
    for key, value in values.items():
        place = place_of(key)
        here = result
        for depth, (step, following) in enumerate(zip(place, (*place[1:], None), strict=True)):
            _check(here, place[:depth], step)
            if following is None:
                with at(*place):
                    here[step] = plain(value)
                continue
            within = here[step] if isinstance(step, int) else here.get(step, {})
            # copied on the way down: the rest is shared with what was given
            here[step] = within.copy() if isinstance(within, dict | list) else within
            here = here[step]
    return dict(result)


def text_with_values(text: str, values: Mapping[str, Any]) -> str:
    """Return the text of a scenario with other values, comments and order kept; parameters and errors as above."""
    import tomlkit

    expected = with_values(tomllib.loads(text), values)
    try:
        changed = _edited(text, values)
        if tomllib.loads(changed) == expected:
            return changed
    except Exception:  # noqa: BLE001, S110 - tomlkit ends in many ways where tables stand in an unusual order
        pass
    # written anew, without comments
    return tomlkit.dumps(expected)


def _edited(text: str, values: Mapping[str, Any]) -> str:
    """Return a text with other values in their places; where it means something else in the end, the caller sees it."""
    import tomlkit

    document: Any = tomlkit.parse(text)
    for key, value in values.items():
        *above, last = place_of(key)
        here = document
        for step in above:
            if isinstance(step, str) and step not in here:
                here[step] = {}
            here = here[step]
        here[last] = plain(value)
    return tomlkit.dumps(document)


def plain(value: Any) -> Any:  # noqa: ANN401 - what TOML may hold
    """Return a value as TOML has it: numbers and arrays of numpy, tuples and ranges become its own.

    Raises InputError: a value that a scenario cannot hold.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, tuple | list | range):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if not isinstance(value, str | int | float):
        raise InputError(f"{value!r}; expected a number, a text, true or false, an array or a table")
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
