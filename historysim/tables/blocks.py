"""The tables that stand one below the other in a text, what stands between them, and what stands below the last.

Where a table ends is seen by what its lines look like: a line that begins with a word, or that has too few values and
is no number, ends it; a line that begins with a number, or has as many values as its rows and half of their numbers,
is a row, broken or not.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import islice

import attrs

from historysim.basics.limits import at_most, most
from historysim.errors import InputError
from historysim.tables.columns import Format, factor_or_none
from historysim.tables.head import SEARCHED, Head, Heading
from historysim.tables.lines import AT_ONCE, brief, fields, like_a_number

# so many lines of what stands above a table are kept
_KEPT = 30
_NO_NUMBERS = re.compile(r"[^\d.,;|\t+\-eE \r\n]")
_START = re.compile(
    r"^\W*(?:(?:block|step|segment|cycle|test)\W+)?start(?:ed|ing|s)?(?:[\s_]*(?:time|at))?"
    r"\s*(?:[\[(](?P<bracket>[^\])]+)[\])])?\s*[=:;,\t ]\s*(?P<value>.+?)\W*$",
    re.IGNORECASE,
)
_CLOCK = re.compile(r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]+)?(\d{1,3}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?")
_TIME = re.compile(r"([+-]?\d+(?:[.,]\d*)?(?:e[+-]?\d+)?)\s*[\[(]?([a-zµ]*)[\])]?", re.IGNORECASE)


@attrs.frozen
class Block:
    """One table of a text."""

    begin: int
    """The line at which what belongs to it begins, counted from 1: its preamble, header, or first row."""
    first: int
    last: int
    """first and last: the lines of its first and last row."""
    rows: int
    """How many rows it has, broken ones among them."""
    preamble: tuple[str, ...]
    """What stands above its header, and the first lines of it alone where there is much."""
    heading: Heading
    """Its names and units, as far as they are found without being asked for."""
    row: tuple[str, ...]
    """The values of its first row."""

    @property
    def start(self) -> float | None:
        """The time at which it was started [s], if its preamble says so."""
        times = [time for time in map(start_time, self.preamble) if time is not None]
        return times[-1] if times else None


@attrs.frozen
class Survey:
    """All tables of a text."""

    blocks: tuple[Block, ...]
    """The tables, in order."""
    footer: tuple[str, ...] = ()
    """What stands below the last one."""


class _Lines:
    """The lines of a text, some of which may be looked at before they are taken."""

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = iter(lines)
        self._waiting: list[str] = []
        self.passed = 0

    def peek(self, count: int) -> list[str]:
        self._waiting += islice(self._lines, max(count - len(self._waiting), 0))
        return self._waiting[:count]

    def take(self, count: int) -> list[str]:
        taken = self.peek(count)
        self._waiting = self._waiting[count:]
        self.passed += len(taken)
        return taken


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
        return any(values) and all(not value or value == "-" or like_a_number(value) for value in values)

    def is_broken_row(self, row: Sequence[str], *, apart: bool) -> bool:
        """Return whether a line that is no row is meant as one; not where a blank line stands above it."""
        filled = [field for field in row if field]
        if not filled:
            return True
        if like_a_number(filled[0]) and self.numeric[0] == 0:
            return True
        numbers = sum(like_a_number(row[place]) for place in self.numeric if place < len(row))
        return not apart and len(row) == self.width and numbers > 0 and 2 * numbers >= len(self.numeric)


def survey(lines: Iterable[str], layout: Format) -> Survey:
    """Return the tables of a text, written as far as known in a format; none, or too many, are an InputError."""
    text = _Lines(lines)
    blocks: list[Block] = []
    below: list[str] = []
    begin = 1
    delimiter = layout.delimiter
    while window := text.peek(SEARCHED):
        known = attrs.evolve(layout, delimiter=delimiter, header=layout.header if layout.header == 0 else None)
        next_table = _next_table(window, known, text.passed)
        if next_table is None:
            if len(window) < SEARCHED:
                below += [line.strip() for line in text.take(len(window)) if line.strip()]
                break
            below += [line.strip() for line in text.take(SEARCHED // 2) if line.strip()]
            continue
        heading, look, row = next_table
        delimiter = look.delimiter
        preamble = [line.strip() for line in text.take(heading.above - text.passed) if line.strip()]
        preamble = [*below, *preamble]
        below = []
        first, last, rows = _pass_rows(text, look)
        if not first:
            below = [*preamble, *(line.strip() for line in text.take(1))]
            continue
        names = 1 if heading.names else 0
        above = tuple(preamble[: len(preamble) - names - (1 if heading.brackets else 0)])
        if len(blocks) >= most("BLOCKS"):
            raise InputError(f"has {len(blocks) + 1:,} blocks or more; {at_most('BLOCKS')}")
        blocks.append(Block(begin, first, last, rows, above[:_KEPT], heading, row))
        begin = last + 1
    if not blocks:
        first = next((f"; the first line is {brief(line)}" for line in below if line), "; it is empty")
        raise InputError(f"has no rows of numbers; expected one line for each sample{first}")
    return Survey(tuple(blocks), tuple(below))


def start_time(line: str) -> float | None:
    """Return the time [s] that a line such as ``Start time = 2.5 s`` or ``Started at 10:32:05`` has, or None."""
    match = _START.match(line.strip())
    if match is None:
        return None
    value = match["value"].strip()
    if clock := _CLOCK.fullmatch(value):
        hours, minutes, seconds = clock.groups()
        return int(hours) * 3600.0 + int(minutes) * 60.0 + float((seconds or "0").replace(",", "."))
    if time := _TIME.fullmatch(value):
        factor = factor_or_none(time[2] or match["bracket"] or "s", "s")
        return None if factor is None else float(time[1].replace(",", ".")) * factor
    return None


def _next_table(window: list[str], layout: Format, passed: int) -> tuple[Heading, _Look, tuple[str, ...]] | None:
    """Return heading, look and first row of the first table among some lines."""
    try:
        head = Head.of(window, layout, passed)
    except InputError:
        return None
    table = head.first_table()
    if table is None:
        return None
    heading, row = table
    numeric = tuple(place for place, field in enumerate(row) if place < heading.width and like_a_number(field))
    return heading, _Look(heading.delimiter, heading.width, numeric, layout.comment), tuple(row[: heading.width])


def _pass_rows(text: _Lines, look: _Look) -> tuple[int, int, int]:
    """Take the rows of a table, broken ones among them; return the lines of the first and the last, and how many."""
    first = last = rows = 0
    apart = False
    while lines := text.peek(AT_ONCE):
        if look.are_rows(lines):
            first = first or text.passed + 1
            text.take(len(lines))
            rows += len(lines)
            last, apart = text.passed, False
            continue
        for line_number, line in enumerate(lines, text.passed + 1):
            if look.is_passed_over(line):
                apart = apart or not line.strip()
                continue
            values = fields(line, look.delimiter)
            if not look.is_row(values) and not look.is_broken_row(values, apart=apart):
                text.take(max(last - text.passed, 0))
                return first, last, rows
            first, last, rows, apart = first or line_number, line_number, rows + 1, False
        text.take(len(lines))
    return first, last, rows
