"""Time bases of channels: start and interval of evenly sampled arrays, and their join by time."""

import contextlib
import datetime as dt
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats
from historysim.basics.units import quantity, quantity_text
from historysim.errors import InputError

# Names of settings, in lower case, of LabVIEW (wf_) and of other programs.
INTERVALS = (
    "wf_increment", "dt", "delta_t", "increment", "interval", "sample_interval", "sampling_interval", "sample_period",
    "sampling_period",
)  # fmt: skip
RATES = (
    "sample_rate",
    "sampling_rate",
    "samplerate",
    "rate",
    "fs",
    "sampling_frequency",
    "sample_frequency",
)
OFFSETS = ("wf_start_offset", "t0", "start", "start_offset", "time_offset")
DATES = ("wf_start_time", "start_time", "timestamp")
NAMES = frozenset((*INTERVALS, *RATES, *OFFSETS, *DATES))
ALIKE = 1e-3  # difference between two time bases, over the interval, up to which they are the same
MOST_NAMED = 6  # time bases in a message


@attrs.frozen
class TimeBase:
    """Times of an evenly sampled channel: start + interval × sample."""

    start: float  #: [s], since the date if there is one
    interval: float  #: [s]
    date: np.datetime64 | None = None

    @classmethod
    def from_settings(cls, settings: Mapping[str, object]) -> "TimeBase | None":
        """Read the time base from settings by their names in lower case; None without an interval or a rate."""
        interval = _first_number(settings, INTERVALS, "s")
        rate = _first_number(settings, RATES, "Hz")
        if not interval and rate:
            interval = 1 / rate
        if not interval or not interval > 0:
            return None
        start = _first_number(settings, OFFSETS, "s") or 0.0
        date = None
        for name in DATES:
            value = settings.get(name)
            if (number := _number(value, "s")) is not None:
                start += number
            elif date is None:
                date = _date(value)
        return cls(start, interval, date)

    def times(self, count: int, origin: "TimeBase") -> Floats:
        """Return the times of samples [s] since the date of another time base."""
        return np.asarray(
            self.start_after(origin) + origin.start + self.interval * np.arange(count), np.float64
        )

    def start_after(self, other: "TimeBase") -> float:
        """Return the start relative to that of another time base [s]; NaN if only one of them has a date."""
        if (self.date is None) != (other.date is None):
            return float("nan")
        dates = 0.0
        if self.date is not None and other.date is not None:
            # both in ns
            dates = 1e-9 * float((self.date - other.date).astype(np.int64))
        return dates + self.start - other.start

    def is_same(self, other: "TimeBase", count: int) -> bool:
        """Return whether both have the same times at so many samples, within a small fraction of the interval."""
        largest = ALIKE * min(self.interval, other.interval)
        start = abs(self.start_after(other))
        return start <= largest and abs(self.interval - other.interval) * count <= largest

    def text(self) -> str:
        """Describe start and interval."""
        start = quantity_text(self.start, "s", 9)
        if self.date is not None:
            start = (
                str(self.date + np.timedelta64(round(self.start * 1e9), "ns"))
                .rstrip("0")
                .rstrip(".")
            )
        return f"starts at {start}, a sample each {quantity_text(self.interval, 's', 9)}"


def _number(value: object, unit: str) -> float | None:
    """Return a number, or a string of a number or a quantity, in a unit; None for another value."""
    if isinstance(value, str):
        with contextlib.suppress(ValueError):
            return float(value)
        with contextlib.suppress(InputError):
            return float(quantity(value, unit))
        return None
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return None
    return float(value) if np.isfinite(value) else None


def _first_number(settings: Mapping[str, object], names: Sequence[str], unit: str) -> float | None:
    numbers = (_number(settings.get(name), unit) for name in names)
    return next((number for number in numbers if number is not None), None)


def _date(value: object) -> np.datetime64 | None:
    """Return a date in ns of a datetime, or of a string in ISO 8601; None for another value."""
    if isinstance(value, dt.datetime):
        value = value.isoformat()
    if isinstance(value, str):
        with contextlib.suppress(ValueError):
            date = dt.datetime.fromisoformat(value.strip())
            value = np.datetime64(
                date.astimezone(dt.UTC).replace(tzinfo=None) if date.tzinfo else date
            )
    return (
        value.astype("datetime64[ns]")
        if isinstance(value, np.datetime64) and not np.isnat(value)
        else None
    )


@attrs.frozen(eq=False)
class TimedColumn:
    """A column and its time base, None if it is unknown."""

    name: str
    values: Floats
    base: TimeBase | None


@attrs.frozen(eq=False)
class JoinedColumns:
    """Columns on one time base."""

    values: list[Floats]  #: of each column, NaN outside its times
    inside: Booleans  #: (row) rows within the times of all columns
    time: Floats  #: (row) [s]
    notice: str


def differing_bases(columns: Sequence[TimedColumn]) -> bool:
    """Return whether the time bases of columns differ."""
    known = [column for column in columns if column.base is not None]
    longest = max((len(column.values) for column in known), default=0)
    return any(
        not column.base.is_same(known[0].base, longest)
        for column in known[1:]
        if column.base and known[0].base
    )


def describe_bases(columns: Sequence[TimedColumn]) -> str:
    """Describe the time bases of columns, for messages."""
    texts = [
        f"{column.name} {column.base.text() if column.base else 'has no start and interval'}"
        for column in columns
    ]
    return "; ".join(texts[:MOST_NAMED]) + ("; …" if len(texts) > MOST_NAMED else "")


def join_by_time(columns: Sequence[TimedColumn]) -> JoinedColumns:
    """Interpolate columns onto the times of the first one; InputError if a time base is unknown, or none overlap."""
    first = columns[0].base
    starts = [
        column.base.start_after(first) if column.base and first else float("nan")
        for column in columns
    ]
    if first is None or np.isnan(starts).any():
        raise InputError(
            f"columns with different times: {describe_bases(columns)}; expected start and interval of each, or a "
            "separate column for the time of each channel, as time in its table"
        )
    time = first.times(len(columns[0].values), first)
    values = []
    inside = np.ones(time.size, dtype=np.bool_)
    for column in columns:
        base = column.base
        assert base is not None  # noqa: S101 - checked above
        times = base.times(len(column.values), first)
        # rounding of times must not leave out the last sample
        slack = ALIKE * base.interval
        covered = (time >= times[0] - slack) & (time <= times[-1] + slack)
        values.append(np.where(covered, np.interp(time, times, column.values), np.nan))
        inside &= covered
    if not inside.any():
        raise InputError(
            f"columns without a common time: {describe_bases(columns)}; expected times that overlap"
        )
    common = f"{int(inside.sum()):,} of {time.size:,} samples are in all of them"
    notice = f"different times: {describe_bases(columns)}; joined by time onto {columns[0].name}, {common}"
    return JoinedColumns(values, inside, time, notice)
