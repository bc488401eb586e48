"""Clocks that are written as times of day or as dates, and the seconds that they tell."""

import datetime as dt
import re

import numpy as np

from historysim.basics.array_types import Floats

DAY = 86400.0
_DATE = (
    r"(?:(?P<year>\d{4})-(?P<month>\d{2})-(?P<day>\d{2})|(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4}))(?:[T ]|, )\s*"
)
_CLOCK = re.compile(
    rf"(?:{_DATE})?(?P<hours>\d{{1,3}}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d)(?P<fraction>[.,]\d*)?Z?", re.ASCII
)


def clock(text: str) -> float | None:
    """Return the seconds that a clock tells, or None where a text is none.

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
