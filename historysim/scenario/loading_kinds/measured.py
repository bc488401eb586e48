"""``loading.file``, a measured record: which column is which channel, and what is done to it before it is replayed."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Self

import attrs
from cattrs import Converter

from historysim.basics.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    Force,
    Frequencies,
    Frequency,
    Key,
    Length,
    Number,
    Quantity,
    Time,
)
from historysim.basics.places import misfit
from historysim.basics.wording import shown
from historysim.errors import InputError
from historysim.loads.events import LOAD_KINDS
from historysim.scenario.column_keys import NumbersFile
from historysim.scenario.schema import from_table, given
from historysim.tables import REFUSE_OR_DROP, Column

if TYPE_CHECKING:
    from historysim.basics.array_types import Floats

# ways to make one channel of several columns
COMBINED = ("sum", "mean", "difference")
# the label of remarks on how a file was read
FILE_REMARK = "file"
# the label of remarks on hum in a channel
HUM_REMARK = "hum"

Area = Annotated[float, Quantity("m2")]


@attrs.frozen(kw_only=True)
class Channel:
    """A column, or several, or a constant, and how it becomes a channel in SI: scale times it, plus the offset."""

    column: str | int | None = None
    """The column: a name, or its position from 1. A channel that is a text alone is this."""
    unit: str | None = None
    """Its unit; by default that of the file, or SI."""
    occurrence: int | None = None
    """Which of the columns with this name."""
    index: int | None = None
    """Which column of a matrix."""
    sum: tuple[Column, ...] | None = None
    """The sum of several columns, in place of one."""
    mean: tuple[Column, ...] | None = None
    """Their mean."""
    difference: tuple[Column, ...] | None = None
    """The first of two less the second."""
    scale: Number = 1.0
    """A factor on the column."""
    time: Column | None = None
    """The channel's own clock; it is interpolated onto that of the record."""
    shift: Time = 0.0
    """By how much that clock is behind: a sample at t was taken at t + shift."""
    median: int | None = attrs.field(
        default=None, validator=Key(lambda samples: samples >= 3 and samples % 2, "an odd number of samples, 3 or more")
    )
    """Running median of so many samples, odd: takes off spikes shorter than half of them, leaves turns."""
    notch: Frequencies | None = attrs.field(default=None, validator=POSITIVE)
    """Takes off what is at a frequency, or several. Needs an even clock."""
    low_pass: Frequency | None = attrs.field(default=None, validator=POSITIVE)
    """Takes off what is faster; half of the amplitude passes there. Rounds turns of a channel with the speed v by about
    v/(2πf). Needs an even clock."""
    centred: bool = False
    """Takes off the mean of the midpoints of its cycles."""
    drift_free: bool = False
    """Takes off the drift of the midpoints of its cycles (three or more)."""

    def __attrs_post_init__(self) -> None:
        """Check that it is a column or a constant."""
        keys = given(self)
        chosen = {key for key, value in keys.items() if value != attrs.fields_dict(type(self))[key].default}
        ways = [way for way in ("column", *COMBINED, "constant") if way in chosen]
        if len(ways) != 1:
            raise InputError(
                f"{' and '.join(ways)} together; expected one of them"
                if ways
                else "neither column nor constant; expected one of them, or several columns as sum, mean or difference"
            )
        if "constant" in chosen and len(chosen) > 1:
            raise misfit("belongs to a column; a constant has no other keys", min(chosen - {"constant"}))
        if self.scale == 0:
            raise misfit("0; expected another number, since nothing would be left of the channel", "scale")
        self._check_combined(ways[0], chosen)
        # a name, position or index that cannot be one is refused here, where it is known which channel it is of
        _ = self.sources

    def _check_combined(self, way: str, chosen: set[str]) -> None:
        if way not in COMBINED:
            return
        count = len(getattr(self, way))
        if count < 2 or (way == "difference" and count > 2):
            expected = (
                "two columns, of which the second is taken from the first" if way == "difference" else "two or more"
            )
            raise misfit(f"{count} given; expected {expected}", way)
        if alone := chosen & {"occurrence", "index"}:
            raise misfit(f"belongs to one column; give it to one of those in {way}", min(alone))

    @classmethod
    def from_toml(cls, value: object, converter: Converter) -> Self:
        """Return the channel of a table, or of the name of its column alone."""
        if isinstance(value, str):
            value = {"column": value}
        if not isinstance(value, dict):
            raise InputError(f"{shown(value)}; expected the name of a column, or a table as in {{ column = 1 }}")
        if "column" in value:
            Column(value["column"])
        made: Self = from_table(cls, value, converter)
        return made

    @property
    def notches(self) -> tuple[float, ...]:
        """The frequencies [Hz] that are taken off."""
        if self.notch is None:
            return ()
        return self.notch if isinstance(self.notch, tuple) else (self.notch,)

    @property
    def sources(self) -> tuple[Column, ...]:
        """The columns that it is made of; none for a constant. The unit of the channel is that of those without."""
        if self.column is not None:
            return (Column(self.column, self.unit, self.occurrence, self.index),)
        columns = self.sum or self.mean or self.difference or ()
        return tuple(column if column.unit else attrs.evolve(column, unit=self.unit) for column in columns)

    def combined(self, values: "Sequence[Floats]") -> "Floats":
        """Return what its columns make together, (row,)."""
        first, *others = values
        if self.difference:
            return first - others[0]
        total = first
        for other in others:
            total = total + other
        return total / len(values) if self.mean else total


@attrs.frozen(kw_only=True)
class ForceChannel(Channel):
    """A load; from a pressure by the area that it acts on."""

    constant: Force | None = None
    """The same value throughout, in place of a column."""
    offset: Force = 0.0
    """Added after the scale."""
    area: Area | None = attrs.field(default=None, validator=POSITIVE)
    """Area that makes a load of a pressure."""
    negative_as_zero: bool = False
    """What is below 0 is 0."""


@attrs.frozen(kw_only=True)
class LengthChannel(Channel):
    """A displacement."""

    constant: Length | None = None
    """The same value throughout, in place of a column."""
    offset: Length = 0.0
    """Added after the scale."""
    backlash: Length = attrs.field(default=0.0, validator=NOT_NEGATIVE)
    """Width of the play of what measures it."""
    free_play: Length = attrs.field(default=0.0, validator=NOT_NEGATIVE)
    """Width of a clearance in the path of the tangential load."""
    closing_load: Force = attrs.field(default=0.0, validator=NOT_NEGATIVE)
    """Load that closes the clearance."""

    def __attrs_post_init__(self) -> None:
        """Check that a closing load has a clearance to close."""
        super().__attrs_post_init__()
        if self.closing_load and not self.free_play:
            raise misfit("goes with free_play; expected the width of the clearance, too", "closing_load")


@attrs.frozen(kw_only=True)
class Channels:
    """What was measured of each channel."""

    normal_load: ForceChannel | None = None
    """Of the normal load."""
    normal_displacement: LengthChannel | None = None
    """Of the approach."""
    tangential_load: ForceChannel | None = None
    """Of the tangential load."""
    tangential_displacement: LengthChannel | None = None
    """Of the tangential displacement."""

    def __attrs_post_init__(self) -> None:
        """Check what one channel alone does not show."""
        if self.normal_load and (self.normal_load.constant or 0) < 0:
            raise misfit(f"{self.normal_load.constant:g} N; expected 0 N or more", "normal_load", "constant")
        if self.normal_displacement and self.normal_displacement.free_play:
            problem = "is a clearance in the path of the tangential load; expected at tangential_displacement"
            raise misfit(problem, "normal_displacement", "free_play")


@attrs.frozen(kw_only=True)
class LoadColumns(Channels):
    """``loading.columns``: what is replayed; without time, the number of the row is the clock, from 0 s."""

    time: Column | None = None
    """Column of the time; without it rows are 1 s apart, and only their order counts."""

    def __attrs_post_init__(self) -> None:
        """Check that there is a load."""
        super().__attrs_post_init__()
        for channel in ("normal", "tangential"):
            if all(getattr(self, f"{channel}_{kind}") is not None for kind in ("load", "displacement")):
                both = f"{channel}_load and {channel}_displacement together"
                raise InputError(f"{both}; expected one of them: the other follows from it")
        if not any(getattr(self, key) for key in LOAD_KINDS):
            raise InputError(
                f"{'only time' if self.time else 'nothing'}; expected one or more of {', '.join(LOAD_KINDS)}"
            )


@attrs.frozen(kw_only=True)
class DeadBand:
    """``loading.dead_band``: swings of a channel below which are noise and no reversals."""

    normal_load: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    """Of the normal load."""
    normal_displacement: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    """Of the approach."""
    tangential_load: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    """Of the tangential load."""
    tangential_displacement: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    """Of the tangential displacement."""


# of several runs in one file, each by itself
EACH = "each"


# a kind of loading inherits this beside another section, and two bases with slots do not mix
@attrs.frozen(kw_only=True, slots=False)
class MeasuredFile(NumbersFile):
    """A file with a record, and how it is read.

    Examples
    --------
    [loading]
    file = "measured.csv"
    reduce = true

    [loading.columns]
    time = "t"
    normal_load = { column = "Fn", unit = "mN" }
    tangential_displacement = { column = "x", unit = "nm", centred = true }

    [loading.response]
    tangential_load = { column = "Ft", unit = "mN" }

    [loading.dead_band]
    tangential_displacement = "10 nm"
    """

    columns: LoadColumns
    """What is replayed: ``time``, and a load or displacement of one channel or both, as below."""
    response: Channels = Channels()
    """What was measured beside it, to compare with; the same keys."""
    run: int | str | None = None
    """Of a file with several runs: the number of the one that is read, from 1, by where the clock starts again; or its
    value in ``runs_by``; or ``"each"``, for ``loops``, ``sliding`` and ``fit``."""
    runs_by: Column | None = None
    """Column that tells the runs apart."""
    start: Time | None = None
    """Samples before this time are left out."""
    end: Time | None = None
    """Samples after this time are left out."""
    missing: str = attrs.field(default="refuse", validator=REFUSE_OR_DROP)
    """``"refuse"``, or ``"drop"``: samples that miss a value are left out, and counted."""
    max_gap: Time | None = attrs.field(default=None, validator=POSITIVE)
    """A longer time between samples is an error."""
    interval: Time | None = attrs.field(default=None, validator=POSITIVE)
    """Samples evenly spaced by this time instead, straight between the measured ones."""
    dead_band: DeadBand = DeadBand()
    """For each channel the swing below which there is no reversal. Acts in loops, ``compare``, ``fit``, and in ``run``
    with ``reduce``."""
    reduce: bool = False
    """Replays only the samples that the contact remembers, by the dead bands."""

    def __attrs_post_init__(self) -> None:
        """Check what the types leave open."""
        is_number = isinstance(self.run, int) and not isinstance(self.run, bool)
        is_counted = isinstance(self.run, int) and (self.run >= 1 or self.runs_by is not None)
        if self.run not in {None, EACH} and not (is_number and is_counted):
            raise misfit(f'{shown(self.run)}; expected the number of a run, from 1, or "each"', "run")
        if self.runs_by is not None and self.run is None:
            raise misfit('missing; expected the value of runs_by that is the run, or "each"', "run")
        if self.start is not None and self.end is not None and self.end < self.start:
            raise misfit(f"{self.end:g} s, before the start at {self.start:g} s; expected a later time", "end")
        channels = given(self.columns)
        for key, channel in given(self.response).items():
            if key in channels:
                raise misfit(
                    "is replayed already, by columns; expected a channel that was measured beside it", "response", key
                )
            channels[key] = channel
        self._check_free_play(channels)
        self._check_clock(channels)
        for key in LOAD_KINDS:
            if getattr(self.dead_band, key) and key not in channels:
                raise misfit("has no effect, since neither columns nor response has this channel", "dead_band", key)

    def _check_clock(self, channels: Mapping[str, Any]) -> None:
        if self.columns.time is not None:
            return
        for key, channel in channels.items():
            needing = {
                "time": channel.time is not None,
                "shift": channel.shift != 0,
                "notch": channel.notch is not None,
                "low_pass": channel.low_pass is not None,
            }
            for needs, asked in needing.items():
                if asked:
                    group = "columns" if getattr(self.columns, key) else "response"
                    problem = "needs the times of the record; expected a column for loading.columns.time"
                    raise misfit(problem, group, key, needs)
        if not any(channel.sources for channel in channels.values()):
            raise misfit("constants alone, and no time; expected a column", "columns")

    def _check_free_play(self, channels: Mapping[str, Any]) -> None:
        moved = channels.get("tangential_displacement")
        if moved is not None and moved.free_play and "tangential_load" not in channels:
            group = "columns" if self.columns.tangential_displacement else "response"
            problem = "needs the tangential load, which tells where the clearance is open; expected a column for it"
            raise misfit(problem, group, "tangential_displacement", "free_play")
