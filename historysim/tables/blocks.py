"""The tables that stand one below the other in a text, what stands between them, and what stands below the last.

Where a table ends is seen by what its lines look like: a line that begins with a word, or that has too few values and
is no number, ends it; a line that begins with a number, or has as many values as its rows and half of their numbers,
is a row, broken or not.
"""

import datetime as dt
import re
from collections.abc import Sequence

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.limits import at_most, most
from historysim.errors import InputError
from historysim.tables.columns import Format, Part, factor_or_none
from historysim.tables.head import SEARCHED, Head, Heading
from historysim.tables.lines import AT_ONCE, brief, fields, like_a_value

_KEPT = 30  # lines of what stands above a table that are kept
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

    begin: int  #: how many lines stand above what belongs to it: its preamble, its header, or its first row
    first: int
    last: int  #: first and last: the lines of its first and last row, counted from 1
    rows: int  #: how many rows it has, broken ones among them
    preamble: tuple[str, ...]  #: what stands above its header, and the first lines of it alone where there is much
    heading: Heading  #: its names and units, as far as they are found without being asked for
    row: tuple[str, ...]  #: the values of its first row

    @property
    def start(self) -> float | None:
        """The time at which it was started [s], if its preamble says so."""
        times = [time for time in map(start_time, self.preamble) if time is not None]
        return times[-1] if times else None

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


# -- clocks: times of day and dates in seconds, and one clock out of those of several tables --

DAY = 86400.0
_DATE = (
    r"(?:(?P<year>\d{4})-(?P<month>\d{2})-(?P<day>\d{2})|(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4}))(?:[T ]|, )\s*"
)
_FULL_CLOCK = re.compile(
    rf"(?:{_DATE})?(?P<hours>\d{{1,3}}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d)(?P<fraction>[.,]\d*)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?:Z|(?:UTC|GMT)?(?P<zone>[+-]\d{2}):?(?P<past>\d{2})?)?",
    re.ASCII,
)


def clock(text: str) -> float | None:
    """Return the seconds of a clock time, or None where a string is none.

    It is ``hh:mm:ss`` with or without a fraction, AM or PM, and an offset such as ``+02:00``, which is taken off; alone
    or behind a date ``yyyy-mm-dd`` or ``dd.mm.yyyy``. Two numbers
    alone may be hours and minutes or minutes and seconds, and a date with slashes begins with the day or the month:
    these are none.
    """
    match = _FULL_CLOCK.fullmatch(text.strip())
    if match is None:
        return None
    parts = match.groupdict(default="0")
    hours = int(parts["hours"])
    if match["half"]:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + 12 * (match["half"][0] in "Pp")
    seconds = 3600.0 * hours + 60.0 * int(parts["minutes"]) + float(parts["seconds"])
    offset = 3600.0 * abs(int(parts["zone"])) + 60.0 * int(parts["past"])
    seconds += offset if parts["zone"].startswith("-") else -offset
    seconds += float("0." + parts["fraction"][1:] + "0")
    year, month, day = (
        int(parts[long]) or int(parts[short]) for long, short in (("year", "y"), ("month", "m"), ("day", "d"))
    )
    if year:
        try:
            return seconds + DAY * dt.date(year, month, day).toordinal()
        except ValueError:
            return None
    return seconds


def from_the_first(times: Floats, start: float | None) -> tuple[Floats, float | None]:
    """Return seconds since the first row of a record, past midnight too, and when that row was.

    The times [s] are those of a clock, NaN where missing; the start is that of the record, where it is in a table
    before.
    """
    known = np.flatnonzero(np.isfinite(times))
    if not known.size:
        return times, start
    known_times = times[known]
    # a time of day that falls by more than half a day has passed midnight; with a date it would not fall
    passed = np.cumsum(np.append(0, np.diff(known_times) < -DAY / 2))
    start = float(known_times[0]) if start is None else start
    since = times.copy()
    since[known] = known_times - start + DAY * passed
    return since, start


def one_clock(time: Floats, parts: Sequence[Part]) -> tuple[Floats, list[str]]:
    """Return the times of joined tables [s] on the clock of the first, and what a user has to know of it.

    A table stays as it is if its clock goes on. If it starts again, the table begins when the file says that it was
    started, or else one sample after the end of the table before it. NaN where a time is missing.
    """
    joined = time.copy()
    begin, offset = 0, 0.0
    end = raw_end = None
    step = first_time = 0.0
    by_start: list[str] = []
    after: list[str] = []
    for part in parts:
        rows = slice(begin, begin + part.rows)
        begin += part.rows
        known = time[rows][~np.isnan(time[rows])]
        if not known.size:
            continue
        step = float(np.median(np.diff(known))) if known.size > 1 else step
        first_time = float(known[0]) if end is None else first_time
        if end is not None and raw_end is not None and known[0] < raw_end:
            started = _started(part, parts[0], first_time, float(known[0]), end - step / 2)
            if started is not None:
                # the last digit of a start time may be before the end
                offset = max(started, end - float(known[0]))
                by_start.append(part.label)
            else:
                offset = end + max(step, 0.0) - float(known[0])
                after.append(part.label)
        joined[rows] = time[rows] + offset if offset else time[rows]
        raw_end, end = float(known[-1]), float(known[-1]) + offset
    notices = []
    if by_start:
        notices.append(f"the clock starts again: {_few(by_start)} put at the start times of the file")
    if after:
        notices.append(
            f"the clock starts again, without a start time that fits: {_few(after)} put one sample after the end before"
        )
    return joined, notices


def _started(part: Part, first: Part, first_time: float, begins: float, least: float) -> float | None:
    """Return when a table was started, on the clock of the first: from its start on, or as the file's clock has it."""
    if part.start is None or first.start is None:
        return None
    of_file = abs(first_time - first.start) < abs(first_time)
    start = part.start if of_file else part.start - first.start
    return start if start + begins >= least else None


def _few(labels: Sequence[str]) -> str:
    return ", ".join(labels[:5]) + (", …" if len(labels) > 5 else "")
