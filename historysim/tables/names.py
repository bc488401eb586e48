"""The names in a header: where one ends, and which of them is meant."""

import re
from collections.abc import Sequence

from historysim.tables.column_units import split_unit

_WIDE = re.compile(r"\t+|\s{2,}")
BRACKETED = re.compile(r"\(.*\)|\[.*\]")


def namings(line: str, fields: Sequence[str], delimiter: str) -> list[list[str]]:
    """Return the ways to read the names of a line: its values, and where white space delimits them, names with blanks.

    These are what stands between tabs or two blanks, words with the unit behind them, and all words up to a unit.
    """
    ways = [list(fields)]
    if delimiter == " " and len(fields) > 1:
        ways.append([name.strip() for name in _WIDE.split(line.strip())])
        ways.append(_with_units(fields))
        ways.append(_up_to_units(fields))
    return [way for index, way in enumerate(ways) if way not in ways[:index]]


def places_of(name: str, names: Sequence[str], brackets: Sequence[str] = ()) -> list[int]:
    """Return where a name stands: as a whole, or else without the unit behind it, which may be in a line below."""
    exact = [place for place, known in enumerate(names) if known == name]
    if exact or not name:
        return exact
    stem, unit = split_unit(name)
    places = []
    for place, known in enumerate(names):
        below = split_unit(brackets[place])[1] if place < len(brackets) else None
        if split_unit(known)[0] == name or (unit is not None and (known, below) == (stem, unit)):
            places.append(place)
    return places


def _with_units(words: Sequence[str]) -> list[str]:
    names: list[str] = []
    for word in words:
        if names and BRACKETED.fullmatch(word):
            names[-1] += f" {word}"
        else:
            names.append(word)
    return names


def _up_to_units(words: Sequence[str]) -> list[str]:
    names: list[str] = []
    is_open = False
    for word in words:
        if is_open:
            names[-1] += f" {word}"
        else:
            names.append(word)
        is_open = not re.search(r"[)\]]$", word)
    return names
