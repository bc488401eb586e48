"""Clocks: times of day and dates in seconds, and one clock out of those of several tables."""

import datetime as dt
import re
from collections.abc import Sequence

import numpy as np

from historysim.basics.array_types import Floats
from historysim.tables.columns import Part

DAY = 86400.0
_DATE = (
    r"(?:(?P<year>\d{4})-(?P<month>\d{2})-(?P<day>\d{2})|(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4}))(?:[T ]|, )\s*"
)
_CLOCK = re.compile(
    rf"(?:{_DATE})?(?P<hours>\d{{1,3}}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d)(?P<fraction>[.,]\d*)?Z?", re.ASCII
)


def clock(text: str) -> float | None:
    """Return the seconds of a clock time, or None where a string is none.

    It is ``hh:mm:ss`` with or without a fraction, alone or behind a date ``yyyy-mm-dd`` or ``dd.mm.yyyy``. Two numbers
    alone may be hours and minutes or minutes and seconds, and a date with slashes begins with the day or the month:
    these are none.
    """
    match = _CLOCK.fullmatch(text.strip())
    if match is None:
        return None
    parts = match.groupdict(default="0")
    seconds = 3600.0 * int(parts["hours"]) + 60.0 * int(parts["minutes"]) + float(parts["seconds"])
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
