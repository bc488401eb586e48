"""The tables that stand one below the other in a text, what stands between them, and what stands below the last.

Where a table ends is seen by what its lines look like: a line that begins with a word, or that has too few values and
is no number, ends it; a line that begins with a number, or has as many values as its rows and half of their numbers,
is a row, broken or not.
"""

import re
from collections.abc import Sequence

import attrs

from historysim.basics.limits import at_most, most
from historysim.errors import InputError
from historysim.tables.columns import Format
from historysim.tables.head import SEARCHED, Head, Heading
from historysim.tables.lines import AT_ONCE, brief, fields, like_a_value

_KEPT = 30  # lines of what stands above a table that are kept
_NO_NUMBERS = re.compile(r"[^\d.,;|\t+\-eE \r\n]")


@attrs.frozen
class Block:
    """One table of a text."""

    begin: int  #: how many lines stand above what belongs to it: its preamble, its header, or its first row
    first: int
    last: int  #: first and last: the lines of its first and last row, counted from 1
    rows: int  #: how many rows it has, broken ones among them
    preamble: tuple[str, ...]  #: what stands above its header, and the first lines of it alone where there is much
    heading: Heading  #: its names and units, as far as they are found without being asked for
    row: tuple[str, ...]  #: the values of its first row

    def described(self) -> tuple[str, str]:
        """Return its names with units, and the values of its first row."""
        names = ", ".join(map(self.heading.title, range(self.heading.width)))
        return names, ", ".join(brief(field)[1:-1] for field in self.row)


@attrs.frozen
class _Look:
    """What a row of a table looks like: its number of values, and where numbers stand."""

    delimiter: str
    width: int
    numeric: tuple[int, ...]
    comment: str

    def is_passed_over(self, line: str) -> bool:
        return not line.strip() or bool(self.comment and line.lstrip().startswith(self.comment))

    def are_rows(self, lines: Sequence[str]) -> bool:
        """Return whether it is plain at a glance that all lines are rows: nothing but full rows of numbers."""
        if _NO_NUMBERS.search("".join(lines)):
            return False
        if self.delimiter == " ":
            return all(len(line.split()) == self.width for line in lines)
        return all(line.count(self.delimiter) == self.width - 1 and line.strip() for line in lines)

    def is_row(self, row: Sequence[str]) -> bool:
        if len(row) < self.width or any(row[self.width :]):
            return False
        values = [row[place] for place in self.numeric]
        return any(values) and all(not value or value == "-" or like_a_value(value) for value in values)

    def is_broken_row(self, row: Sequence[str], *, apart: bool) -> bool:
        """Return whether a line that is no row is meant as one; not where a blank line stands above it."""
        filled = [field for field in row if field]
        if not filled:
            return True
        if like_a_value(filled[0]) and self.numeric[0] == 0:
            return True
        numbers = sum(like_a_value(row[place]) for place in self.numeric if place < len(row))
        return not apart and len(row) == self.width and numbers > 0 and 2 * numbers >= len(self.numeric)


def survey(text: Sequence[str], layout: Format) -> tuple[list[Block], list[str]]:
    """Return the tables of a text, and what stands below the last one; none, or too many, are an InputError."""
    blocks: list[Block] = []
    below: list[str] = []
    passed = begin = 0
    layout = attrs.evolve(layout, header=layout.header if layout.header == 0 else None)
    while passed < len(text):
        found = _next_table(text, layout, passed)
        if found is None:
            # what the last half of the lines begins is seen with those behind them
            searched = SEARCHED if passed + SEARCHED > len(text) else SEARCHED // 2
            below += _filled(text[passed : passed + searched])
            passed += searched
            continue
        heading, look, row = found
        if heading.width > most("COLUMNS"):
            raise InputError(f"has {heading.width:,} columns; {at_most('COLUMNS')}")
        layout = attrs.evolve(layout, delimiter=look.delimiter)
        below += _filled(text[passed : heading.above])
        first, last, rows, passed = _pass_rows(text, heading.above, look)
        if not first:
            below += _filled(text[heading.above : passed])
            continue
        if len(blocks) >= most("BLOCKS"):
            raise InputError(f"has {len(blocks) + 1:,} blocks or more; {at_most('BLOCKS')}")
        preamble = below[: len(below) - bool(heading.names) - bool(heading.brackets)]
        blocks.append(Block(begin, first, last, rows, tuple(preamble[:_KEPT]), heading, row))
        below, begin = [], last
    if not blocks:
        seen = f"the first line is {brief(below[0])}" if below else "it is empty"
        raise InputError(f"has no rows of numbers; expected one line for each sample; {seen}")
    return blocks, below


def _filled(lines: Sequence[str]) -> list[str]:
    return [line.strip() for line in lines if line.strip()]


def _next_table(text: Sequence[str], layout: Format, passed: int) -> tuple[Heading, _Look, tuple[str, ...]] | None:
    """Return heading, look and first row of the first table behind so many lines."""
    try:
        table = Head.of(text, layout, passed).first_table()
    except InputError:
        return None
    if table is None:
        return None
    heading, row = table
    numeric = tuple(place for place, field in enumerate(row) if place < heading.width and like_a_value(field))
    return heading, _Look(heading.delimiter, heading.width, numeric, layout.comment), tuple(row[: heading.width])


def _pass_rows(text: Sequence[str], above: int, look: _Look) -> tuple[int, int, int, int]:
    """Return the lines of the first and the last row of a table, how many rows it has, and what line it ends at.

    Broken rows are among them; a table without rows ends at its first line.
    """
    first = last = rows = 0
    apart = False
    for begin in range(above, len(text), AT_ONCE):
        lines = text[begin : begin + AT_ONCE]
        if look.are_rows(lines):
            first, last, rows, apart = first or begin + 1, begin + len(lines), rows + len(lines), False
            continue
        for line_number, line in enumerate(lines, begin + 1):
            if look.is_passed_over(line):
                apart = apart or not line.strip()
                continue
            values = fields(line, look.delimiter)
            if not look.is_row(values) and not look.is_broken_row(values, apart=apart):
                return first, last, rows, last or above + 1
            first, last, rows, apart = first or line_number, line_number, rows + 1, False
    return first, last, rows, len(text)
