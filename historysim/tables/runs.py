"""Lines of a text that look like the rows of a table."""

import re
from collections.abc import Iterable, Sequence

import attrs

from historysim.tables.lines import fields

_LIKE_A_NUMBER = re.compile(r"[+-]?(?:\d[\d.,]*|[.,]\d+)(?:e[+-]?\d+)?|[+-]?nan|na|null", re.IGNORECASE)


@attrs.frozen
class Line:
    """A line that is not blank."""

    number: int
    text: str
    is_comment: bool

    def fields(self, delimiter: str) -> list[str]:
        """Return its values, as `lines.fields` does."""
        return fields(self.text, delimiter)


def like_a_number(field: str) -> bool:
    """Return whether a value looks like a number, with any decimal sign, or says that it is missing."""
    return bool(_LIKE_A_NUMBER.fullmatch(field))


def longest_run(rows: Sequence[Line], delimiter: str, least: int = 2) -> list[Line]:
    """Return the most lines in a row that have equally many values, so many at least, some of them numbers."""
    longest = range(0)
    begin = width = 0
    for index, line in enumerate(rows):
        values = line.fields(delimiter)
        if len(values) < least or not any(map(like_a_number, values)):
            width = 0
            continue
        if len(values) != width:
            begin, width = index, len(values)
        if index + 1 - begin > len(longest):
            longest = range(begin, index + 1)
    return list(rows[longest.start : longest.stop])


def runs(rows: Sequence[Line], delimiter: str, least: int) -> Iterable[tuple[int, int]]:
    """Yield begin and end of lines in a row that have equally many values, and numbers at the same places."""
    begin = 0
    previous: list[bool | None] = []
    for index, line in enumerate(rows):
        values = line.fields(delimiter)
        looks = [like_a_number(value) if value else None for value in values]
        is_row = len(values) >= least and any(looks)
        is_alike = len(looks) == len(previous) and all(
            None in pair or pair[0] == pair[1] for pair in zip(looks, previous, strict=True)
        )
        if previous and not (is_row and is_alike):
            yield begin, index
            previous = []
        if is_row and not previous:
            begin, previous = index, looks
    if previous:
        yield begin, len(rows)


def numeric_places(run: Sequence[Line], delimiter: str) -> list[int]:
    """Return the places at which at least half of some lines of equally many values have numbers."""
    rows = [line.fields(delimiter) for line in run]
    return [
        place
        for place, column in enumerate(zip(*rows, strict=True))
        if 2 * sum(map(like_a_number, column)) >= len(rows)
    ]


def width_of(rows: Sequence[Line], delimiter: str, usual: int) -> int:
    """Return the number of columns, without blank ones that delimiters at the ends of the lines make."""
    values = [line.fields(delimiter) for line in rows]
    return max((len(without_blank_end(row)) for row in values if len(row) == usual), default=usual)


def without_blank_end(values: list[str]) -> list[str]:
    """Return values without blank ones at the end."""
    while values and not values[-1]:
        values = values[:-1]
    return values
