"""The channels of a measured record: which column is which, and how it is corrected before the replay."""

import functools
import operator
from typing import TYPE_CHECKING, Annotated, Self

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
from historysim.basics.wording import shown
from historysim.errors import InputError, misfit
from historysim.loads.events import LOAD_KINDS
from historysim.scenario.schema import from_table, given
from historysim.tables import Column

if TYPE_CHECKING:
    from collections.abc import Sequence

    from historysim.basics.arguments import Floats

COMBINED = ("sum", "mean", "difference")
"""Keys that make one channel of several columns."""

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
        # columns check their names, positions and indices; here the channel is known
        _ = self.sources

    def _check_combined(self, way: str, chosen: set[str]) -> None:
        if way not in COMBINED:
            return
        count = len(getattr(self, way))
        if count < 2 or (way == "difference" and count > 2):
            two = "two columns, of which the second is taken from the first"
            expected = two if way == "difference" else "two or more"
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
        return self.notch if isinstance(self.notch, tuple) else () if self.notch is None else (self.notch,)

    @property
    def sources(self) -> tuple[Column, ...]:
        """Its columns, none for a constant; those without a unit have the channel's."""
        if self.column is not None:
            return (Column(self.column, self.unit, self.occurrence, self.index),)
        columns = self.sum or self.mean or self.difference or ()
        return tuple(column if column.unit else attrs.evolve(column, unit=self.unit) for column in columns)

    def combined(self, values: "Sequence[Floats]") -> "Floats":
        """Return its columns combined, (row,)."""
        if self.difference:
            return values[0] - values[1]
        total = functools.reduce(operator.add, values)
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
