"""Find the tables (blocks) of a text, their preambles, and the lines below the last table.

The form of its lines decides where a table ends. A line that begins with a word, or that has too
few values and does not begin with a number, ends it. A line that begins with a number, or that has
as many values as the rows and at least half of their numbers, is a row, possibly a broken one.
"""

import re
from collections.abc import Sequence

import attrs

from historysim.basics.limits import at_most, most
from historysim.errors import InputError
from historysim.tables.columns import Format
from historysim.tables.head import SEARCHED, Head, Heading
from historysim.tables.lines import BATCH_LINES, brief, fields, like_a_value

_MOST_PREAMBLE_LINES = 30  # number of lines above a table that are kept
_NO_NUMBERS = re.compile(r"[^\d.,;|\t+\-eE \r\n]")


@attrs.frozen
class Block:
    """One table of a text."""

    start: int  #: number of lines of the text above the preamble, the header or the first row
    first_line: int  #: line number of the first row, counted from 1
    last_line: int  #: line number of the last row
    rows: int  #: number of rows, including broken ones
    preamble: tuple[str, ...]  #: lines above the header, limited to the first 30
    heading: Heading  #: names and units that can be found without knowing the requested columns
    row: tuple[str, ...]  #: values of the first row

    def describe(self) -> tuple[str, str]:
        """Return the column names with units, and the values of the first row."""
        names = ", ".join(map(self.heading.title, range(self.heading.width)))
        return names, ", ".join(brief(field)[1:-1] for field in self.row)


@attrs.frozen
class _RowPattern:
    """Form of a table row: number of values and positions of the numeric ones."""

    delimiter: str
    width: int
    numeric: tuple[int, ...]  #: indices of the values that are numbers
    comment: str

    def is_skipped(self, line: str) -> bool:
        return not line.strip() or bool(self.comment and line.lstrip().startswith(self.comment))

    def are_rows(self, lines: Sequence[str]) -> bool:
        """Return True if all lines are complete rows of plain numbers (fast check)."""
        if _NO_NUMBERS.search("".join(lines)):
            return False
        if self.delimiter == " ":
            return all(len(line.split()) == self.width for line in lines)
        return all(line.count(self.delimiter) == self.width - 1 and line.strip() for line in lines)

    def is_row(self, row: Sequence[str]) -> bool:
        if len(row) < self.width or any(row[self.width :]):
            return False
        values = [row[index] for index in self.numeric]
        return any(values) and all(
            not value or value == "-" or like_a_value(value) for value in values
        )

    def is_broken_row(self, row: Sequence[str], *, after_blank: bool) -> bool:
        """Return True if a line that does not match is a broken row; after a blank line it must begin with a number."""
        filled = [field for field in row if field]
        if not filled:
            return True
        if like_a_value(filled[0]) and self.numeric[0] == 0:
            return True
        numbers = sum(like_a_value(row[index]) for index in self.numeric if index < len(row))
        return (
            not after_blank
            and len(row) == self.width
            and numbers > 0
            and 2 * numbers >= len(self.numeric)
        )


def survey(text: Sequence[str], layout: Format) -> tuple[list[Block], list[str]]:
    """Return the tables of a text, and the lines below the last one; InputError if there is none, or too many."""
    blocks: list[Block] = []
    rest: list[str] = []
    position = start = 0
    layout = attrs.evolve(layout, header=layout.header if layout.header == 0 else None)
    while position < len(text):
        table = _next_table(text, layout, position)
        if table is None:
            # the second half is searched again, since a table may begin there
            searched = SEARCHED if position + SEARCHED > len(text) else SEARCHED // 2
            rest += _strip_lines(text[position : position + searched])
            position += searched
            continue
        heading, pattern, row = table
        if heading.width > most("COLUMNS"):
            raise InputError(f"has {heading.width:,} columns; {at_most('COLUMNS')}")
        layout = attrs.evolve(layout, delimiter=pattern.delimiter)
        rest += _strip_lines(text[position : heading.lines_above])
        first_line, last_line, rows, position = _pass_rows(text, heading.lines_above, pattern)
        if not first_line:
            rest += _strip_lines(text[heading.lines_above : position])
            continue
        if len(blocks) >= most("BLOCKS"):
            raise InputError(f"has {len(blocks) + 1:,} blocks or more; {at_most('BLOCKS')}")
        preamble = rest[: len(rest) - bool(heading.names) - bool(heading.brackets)]
        blocks.append(
            Block(
                start,
                first_line,
                last_line,
                rows,
                tuple(preamble[:_MOST_PREAMBLE_LINES]),
                heading,
                row,
            )
        )
        rest, start = [], last_line
    if not blocks:
        seen = f"the first line is {brief(rest[0])}" if rest else "it is empty"
        raise InputError(f"has no rows of numbers; expected one line for each sample; {seen}")
    return blocks, rest


def _strip_lines(lines: Sequence[str]) -> list[str]:
    return [line.strip() for line in lines if line.strip()]


def _next_table(
    text: Sequence[str], layout: Format, position: int
) -> tuple[Heading, _RowPattern, tuple[str, ...]] | None:
    """Return heading, row pattern and first row of the next table after a number of lines; None if there is none."""
    try:
        table = Head.from_lines(text, layout, position).first_table()
    except InputError:
        return None
    if table is None:
        return None
    heading, row = table
    numeric = tuple(
        index for index, field in enumerate(row) if index < heading.width and like_a_value(field)
    )
    return (
        heading,
        _RowPattern(heading.delimiter, heading.width, numeric, layout.comment),
        tuple(row[: heading.width]),
    )


def _pass_rows(
    text: Sequence[str], lines_above: int, pattern: _RowPattern
) -> tuple[int, int, int, int]:
    """Return the line numbers of the first and the last row of a table, its number of rows, and the line of its end.

    Broken rows count. A table without rows ends at its first line.
    """
    first_line = last_line = rows = 0
    after_blank = False
    for start in range(lines_above, len(text), BATCH_LINES):
        lines = text[start : start + BATCH_LINES]
        if pattern.are_rows(lines):
            first_line = first_line or start + 1
            last_line = start + len(lines)
            rows = rows + len(lines)
            after_blank = False
            continue
        for line_number, line in enumerate(lines, start + 1):
            if pattern.is_skipped(line):
                after_blank = after_blank or not line.strip()
                continue
            values = fields(line, pattern.delimiter)
            if not pattern.is_row(values) and not pattern.is_broken_row(
                values, after_blank=after_blank
            ):
                return first_line, last_line, rows, last_line or lines_above + 1
            first_line = first_line or line_number
            last_line = line_number
            rows = rows + 1
            after_blank = False
    return first_line, last_line, rows, len(text)
