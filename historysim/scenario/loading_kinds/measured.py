"""The channels of a measured record: which column is which, and how it is corrected before the replay."""

import functools
import operator
from collections.abc import Sequence
from typing import Annotated, Self

import attrs
import numpy as np
from cattrs import Converter

from historysim.basics.arguments import Floats
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
from historysim.basics.units import is_number, quantity_text
from historysim.basics.wording import shown
from historysim.errors import InputError, at, field_error
from historysim.loads.events import ACROSS, LOAD_KINDS
from historysim.measured import correction
from historysim.scenario.schema import from_table, given
from historysim.tables import Column
from historysim.tables.columns import fit_unit

# A larger swing is a turn of a channel and no hum: a share of the range of a displacement, or the greatest load.
HUM_DEAD_BAND = 0.2

COMBINED = ("sum", "mean", "difference")  # keys that make one channel of several columns

Area = Annotated[float, Quantity("m2")]


@attrs.frozen
class Term(Column):
    """A column of several that make one channel, and the factor that it has there."""

    #: A factor on it.
    scale: Number = attrs.field(
        default=1.0, validator=Key(lambda factor: is_number(factor) and factor != 0, "a number other than 0")
    )


@attrs.frozen(kw_only=True)
class Channel:
    """A column, or several, or a constant, and how it becomes a channel in SI: scale times it, plus the offset."""

    #: The column: a name, or its position from 1. A channel that is a text alone is this.
    column: str | int | None = None
    unit: str | None = None  #: its unit; by default that of the file, or SI
    occurrence: int | None = None  #: which of the columns with this name
    index: int | None = None  #: which column of a matrix
    #: The sum of several columns, in place of one; each may have a ``scale``.
    sum: tuple[Term, ...] | None = None
    mean: tuple[Term, ...] | None = None  #: their mean
    difference: tuple[Term, ...] | None = None  #: the first of two less the second
    #: Column of the retrace, on the displacements of the trace, as AFM files store them: it follows in reverse order.
    retrace: Column | None = None
    scale: Number = 1.0  #: A factor on the column
    time: Column | None = None  #: the channel's own clock; it is interpolated onto that of the record
    shift: Time = 0.0  #: by how much that clock is behind: a sample at t was taken at t + shift
    #: Running median of so many samples, odd: takes off spikes shorter than half of them, leaves turns.
    median: int | None = attrs.field(
        default=None, validator=Key(lambda samples: samples >= 3 and samples % 2, "an odd number of samples, 3 or more")
    )
    #: Takes off what is at a frequency, or several. Needs an even clock.
    notch: Frequencies | None = attrs.field(default=None, validator=POSITIVE)
    #: Takes off what is faster; half of the amplitude passes there. Rounds turns of a channel with the speed v by about
    #: v/(2πf). Needs an even clock.
    low_pass: Frequency | None = attrs.field(default=None, validator=POSITIVE)
    centred: bool = False  #: takes off the mean of the midpoints of its cycles
    drift_free: bool = False  #: takes off the drift of the midpoints of its cycles (three or more)

    @property
    def unit_in_si(self) -> str:
        """The SI unit of its columns."""
        raise NotImplementedError

    def __attrs_post_init__(self) -> None:
        """Check that it is a column or a constant, in units that fit."""
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
            raise field_error("belongs to a column; a constant has no other keys", min(chosen - {"constant"}))
        if self.scale == 0:
            raise field_error("0; expected another number, since nothing would be left of the channel", "scale")
        if ways[0] in COMBINED:
            self._check_combined(ways[0], chosen)
        if self.retrace is not None and (self.time is not None or self.shift):
            problem = "does not apply to a column with a retrace, which follows it in time"
            raise field_error(problem, "shift" if self.time is None else "time")
        # columns check their names, positions and indices
        _ = self.sources
        self._check_units()

    def _check_combined(self, way: str, chosen: set[str]) -> None:
        count = len(getattr(self, way))
        if count < 2 or (way == "difference" and count > 2):
            two = "two columns, of which the second is taken from the first"
            expected = two if way == "difference" else "two or more"
            raise field_error(f"{count} given; expected {expected}", way)
        if alone := chosen & {"occurrence", "index", "retrace"}:
            raise field_error(f"belongs to one column; give it to one of those in {way}", min(alone))

    def _check_units(self) -> None:
        units: dict[tuple[str | int, ...], str | None] = {("unit",): self.unit}
        for way in COMBINED:
            units |= {(way, index, "unit"): each.unit for index, each in enumerate(getattr(self, way) or ())}
        for name in ("time", "retrace"):
            if (column := getattr(self, name)) is not None:
                units[name, "unit"] = column.unit
        for key, unit in units.items():
            if unit is not None:
                with at(*key):
                    fit_unit(unit, ("s" if key[0] == "time" else self.unit_in_si,))

    @classmethod
    def from_toml(cls, value: object, converter: Converter) -> Self:
        """Return the channel of a table, or of the name of its column alone."""
        if isinstance(value, str):
            value = {"column": value}
        if not isinstance(value, dict):
            raise InputError(f"{shown(value)}; expected the name of a column, or a table as in {{ column = 1 }}")
        if "column" in value:
            Column(value["column"])
        return from_table(cls, value, converter)

    @property
    def sources(self) -> tuple[Column, ...]:
        """Its columns, the retrace last, none for a constant; those without a unit have the channel's."""
        if self.column is not None:
            own = Column(self.column, self.unit, self.occurrence, self.index)
            back = () if self.retrace is None else (self.retrace,)
            return own, *(column if column.unit else attrs.evolve(column, unit=self.unit) for column in back)
        columns = self.sum or self.mean or self.difference or ()
        return tuple(column if column.unit else attrs.evolve(column, unit=self.unit) for column in columns)

    def combined(self, values: Sequence[Floats]) -> Floats:
        """Return its columns, without the retrace, combined, (row,)."""
        terms = self.sum or self.mean or self.difference or ()
        values = [term.scale * each for term, each in zip(terms, values, strict=True)] if terms else values
        if self.difference:
            return values[0] - values[1]
        total = functools.reduce(operator.add, values)
        return total / len(values) if self.mean else total


@attrs.frozen(kw_only=True)
class ForceChannel(Channel):
    """A load; from a pressure by the area that it acts on."""

    constant: Force | None = None  #: the same value throughout, in place of a column
    offset: Force = 0.0  #: added after the scale
    area: Area | None = attrs.field(default=None, validator=POSITIVE)  #: area that makes a load of a pressure
    #: ``"normal_load"`` for a column of friction coefficients: they are multiplied by it, before all corrections.
    times: str | None = attrs.field(
        default=None, validator=Key(lambda channel: channel == "normal_load", 'the channel "normal_load"')
    )
    negative_as_zero: bool = False  #: what is below 0 is 0

    @property
    def unit_in_si(self) -> str:
        """The SI unit of its columns: of a force, a pressure with ``area``, or a coefficient with ``times``."""
        if self.times:
            return "1"
        return "Pa" if self.area else "N"

    def __attrs_post_init__(self) -> None:
        """Check that it is made a load of in one way."""
        super().__attrs_post_init__()
        if self.times and self.area:
            raise field_error(
                "makes a load of a pressure, and times one of a coefficient; expected one of them", "area"
            )


@attrs.frozen(kw_only=True)
class LengthChannel(Channel):
    """A displacement."""

    constant: Length | None = None  #: the same value throughout, in place of a column
    #: Added after the scale. By default, unless ``centred``, the one with which a tangential displacement begins at 0,
    #: since a stage has a zero of its own; none where it does so within its noise. 0 takes the readings as they are.
    #: With another offset the contact is pressed at displacement 0 before it is moved to the first sample.
    #: ``displacement_offset`` in ``[fit]`` fits it.
    offset: Length | None = None
    backlash: Length = attrs.field(default=0.0, validator=NOT_NEGATIVE)  #: width of the play of what measures it
    #: Width of a clearance in the path of the tangential load.
    free_play: Length = attrs.field(default=0.0, validator=NOT_NEGATIVE)
    closing_load: Force = attrs.field(default=0.0, validator=NOT_NEGATIVE)  #: load that closes the clearance

    @property
    def unit_in_si(self) -> str:
        """That of a length."""
        return "m"

    def __attrs_post_init__(self) -> None:
        """Check that a closing load has a clearance to close."""
        super().__attrs_post_init__()
        if self.closing_load and not self.free_play:
            raise field_error("goes with free_play; expected the width of the clearance, too", "closing_load")


@attrs.frozen(kw_only=True)
class Channels:
    """What was measured of each channel."""

    normal_load: ForceChannel | None = None  #: of the normal load
    normal_displacement: LengthChannel | None = None  #: of the approach
    tangential_load: ForceChannel | None = None  #: of the tangential load
    tangential_displacement: LengthChannel | None = None  #: of the tangential displacement

    def __attrs_post_init__(self) -> None:
        """Check what one channel alone does not show."""
        if self.normal_load and self.normal_load.times:
            raise field_error("is the normal load itself; expected it at tangential_load", "normal_load", "times")
        if self.normal_load and (self.normal_load.constant or 0) < 0:
            raise field_error(f"{self.normal_load.constant:g} N; expected 0 N or more", "normal_load", "constant")
        if self.normal_displacement and self.normal_displacement.free_play:
            problem = "is a clearance in the path of the tangential load; expected at tangential_displacement"
            raise field_error(problem, "normal_displacement", "free_play")


@attrs.frozen(kw_only=True)
class LoadColumns(Channels):
    """``loading.columns``: what is replayed; without time, the number of the row is the clock, from 0 s."""

    #: In two tangential directions the load along y, where ``tangential_load`` is that along x.
    tangential_load_y: ForceChannel | None = None
    #: In two tangential directions the displacement along y, where ``tangential_displacement`` is that along x.
    tangential_displacement_y: LengthChannel | None = None
    time: Column | None = None  #: column of the time; without it rows are 1 s apart, and only their order counts

    def __attrs_post_init__(self) -> None:
        """Check that there is a load."""
        super().__attrs_post_init__()
        for along in ("tangential_load", "tangential_displacement"):
            if getattr(self, along + ACROSS) is not None and getattr(self, along) is None:
                raise field_error(
                    f"is the component along y; expected {along}, too, which is that along x", along + ACROSS
                )
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

    normal_load: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)  #: of the normal load
    normal_displacement: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)  #: of the approach
    tangential_load: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)  #: of the tangential load
    #: Of the tangential displacement.
    tangential_displacement: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)


def column_names(key: str, channel: Channel) -> list[str]:
    """Return the names of the columns of a channel in a table."""
    several = len(channel.sources) > 1
    return [f"{key} {index}" if several else key for index in range(1, len(channel.sources) + 1)]


def last_digit(raw: Floats, values: Floats) -> float:
    """Return the last digit of a channel that was printed or sampled with few of them, in its SI unit; else about 0."""
    range_of_raw = np.ptp(raw)
    steps = np.diff(np.unique(raw))
    # smaller steps are the rounding of binary numbers
    steps = steps[steps > 1e-9 * range_of_raw]
    return float(steps.min() / range_of_raw * np.ptp(values)) if steps.size else 0.0


def hum_remark(channel: Channel, key: str, time: Floats, values: Floats, digit: float) -> str | None:
    """Return a remark on the hum that is left in a channel, and what takes it off; None within the last digit."""
    unit = "m" if isinstance(channel, LengthChannel) else "N"
    size = float(np.ptp(values)) if unit == "m" else float(np.abs(values).max())
    hums = [hum for hum in correction.find_hum(time, values, dead_band=HUM_DEAD_BAND * size) if hum.amplitude > digit]
    if not hums:
        return None
    lines = ", ".join(f"{quantity_text(hum.amplitude, unit, 3)} at {hum.frequency:.4g} Hz" for hum in hums[:3])
    notches = ", ".join(f"{hum.frequency:.4g}" for hum in hums[:3])
    share = f"{100 * hums[0].amplitude / np.ptp(values):.2g} % of its range"
    mend = f"notch = {f'[{notches}]' if len(hums) > 1 else notches} at this channel removes it"
    return f"{key.replace('_', ' ')}: {lines}, up to {share}; {mend}"


def conditioned(channel: Channel, time: Floats, values: Floats) -> Floats:
    """Return a channel after its median, its notches and its low-pass, in this order."""
    if channel.median is not None:
        with at("median"):
            values = correction.running_median(values, channel.median)
    for frequency in np.atleast_1d([] if channel.notch is None else channel.notch).tolist():
        with at("notch"):
            values = correction.notch(time, values, frequency)
    if channel.low_pass is not None:
        with at("low_pass"):
            values = correction.low_pass(time, values, channel.low_pass)
    return values
