"""Clock columns: times of day and dates in seconds since the first row."""

import datetime as dt
import re

import numpy as np

from historysim.basics.arguments import Floats

DAY = 86400.0
_DATE = (
    r"(?:(?P<year>\d{4})-(?P<month>\d{2})-(?P<day>\d{2})"
    r"|(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<y>\d{4}))(?:[T ]|, )\s*"
)
_CLOCK = re.compile(
    rf"(?:{_DATE})?(?P<hours>\d{{1,3}}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d)(?P<fraction>[.,]\d*)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?:Z|(?:UTC|GMT)?(?P<zone>[+-]\d{2}):?(?P<past>\d{2})?)?",
    re.ASCII,
)


def clock_seconds(text: str) -> float | None:
    """Return a clock time in seconds (since midnight, or with a date since 1 January of year 1); None for other texts.

    The form is ``hh:mm:ss`` with or without a fraction, AM or PM, and an offset such as ``+02:00``,
    which is taken off; alone or after a date ``yyyy-mm-dd`` or ``dd.mm.yyyy``. Ambiguous forms give
    None: two numbers may be hours and minutes or minutes and seconds, and a date with slashes may
    begin with the day or the month.
    """
    match = _CLOCK.fullmatch(text.strip())
    if match is None:
        return None
    groups = match.groupdict(default="0")
    hours = int(groups["hours"])
    if match["half"]:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + 12 * (match["half"][0] in "Pp")
    seconds = 3600.0 * hours + 60.0 * int(groups["minutes"]) + float(groups["seconds"])
    offset = 3600.0 * abs(int(groups["zone"])) + 60.0 * int(groups["past"])
    seconds += offset if groups["zone"].startswith("-") else -offset
    seconds += float("0." + groups["fraction"][1:] + "0")
    year, month, day = (
        int(groups[long]) or int(groups[short])
        for long, short in (("year", "y"), ("month", "m"), ("day", "d"))
    )
    if year:
        try:
            return seconds + DAY * dt.date(year, month, day).toordinal()
        except ValueError:
            return None
    return seconds


def seconds_since_first(times: Floats) -> Floats:
    """Return the clock times of a column [s] as seconds since the first one; NaN where missing."""
    finite = np.flatnonzero(np.isfinite(times))
    # a time of day that falls by more than half a day has passed midnight; with a date it would not
    # fall
    midnights = np.cumsum(np.diff(times[finite], prepend=times[finite][:1]) < -DAY / 2)
    elapsed = times.copy()
    elapsed[finite] += DAY * midnights - (times[finite][0] if finite.size else 0.0)
    return elapsed
