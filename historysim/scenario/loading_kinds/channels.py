"""Channels of a measured record: their columns, and their correction before the replay."""

import functools
import operator
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Self

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    Force,
    Frequencies,
    Frequency,
    Key,
    Length,
    Quantity,
    Time,
)
from historysim.basics.files import is_file_set
from historysim.basics.units import is_number, quantity, quantity_text
from historysim.basics.wording import format_value
from historysim.errors import InputError, error_path, field_error
from historysim.loads.events import ACROSS, LOAD_KINDS
from historysim.measured import correction
from historysim.scenario.loading_kinds import EACH, Loading
from historysim.scenario.schema import ImportedKind, NumbersFile, explicit_fields, from_table
from historysim.tables import REFUSE_OR_DROP, Column
from historysim.tables.columns import fit_unit

# Larger swings are reversals of a channel, not hum: fraction of the range of a displacement, or of
# the largest load.
HUM_DEAD_BAND = 0.2

COMBINED = ("sum", "mean", "difference")  # keys that combine several columns into one channel

Area = Annotated[float, Quantity("m2")]
AnyBlock = Annotated[Any, ImportedKind("historysim.scenario.loading_kinds.inline:WaypointBlock")]

# SI units of columns that a scale with a unit converts
_SIGNALS = ("V", "A", "rad", "m", "N", "Pa", "1")


def _split_scale(scale: float | str, unit: str) -> tuple[float, str]:
    """Return a scale in SI, and the SI unit of the values that it converts: V for ``"100 N/V"`` of a load."""
    if not isinstance(scale, str):
        return scale, unit
    for signal in _SIGNALS if re.search(r"/|\bper\b|-1|⁻¹", scale) else ():
        with suppress(InputError):
            return quantity(scale, f"{unit} / {signal}"), signal
    raise InputError(
        f"{format_value(scale)}; expected a number, or one with the unit of the channel over that of the column, as in "
        f"'2.5 m{unit}/V'"
    )


@attrs.frozen
class Term(Column):
    """One of several columns of a channel, with a factor."""

    #: Factor; with a unit, as in ``"100 N/V"``, from the unit of the column to that of the channel.
    scale: float | str = attrs.field(
        default=1.0,
        validator=Key(
            lambda factor: isinstance(factor, str) or (is_number(factor) and factor != 0),
            "a number other than 0",
        ),
    )


@attrs.frozen(kw_only=True)
class Channel:
    """One or several columns, or a constant, and their conversion to a channel in SI: scale × value + offset."""

    #: The column: a name, or its position from 1. A plain string as the channel is this key.
    column: str | int | None = None
    unit: str | None = None  #: unit; by default as in the file, or SI
    occurrence: int | None = None  #: number of the column among those with this name
    index: int | None = None  #: column of a matrix
    #: Sum of several columns, instead of one column; each may have a ``scale``.
    sum: tuple[Term, ...] | None = None
    mean: tuple[Term, ...] | None = None  #: mean of several columns
    difference: tuple[Term, ...] | None = None  #: first minus second of two columns
    #: Column of the retrace at the displacements of the trace, as in AFM files; it is appended in
    #: reverse order.
    retrace: Column | None = None
    #: Factor on the column; with a unit, as in ``"100 N/V"``, from the unit of the column to that
    #: of the channel.
    scale: float | str = 1.0
    #: separate clock of the channel, which is interpolated onto the clock of the record
    time: Column | None = None
    shift: Time = 0.0  #: delay of that clock: a sample at t was measured at t + shift
    #: Running median over this odd number of samples: removes spikes shorter than half of it, keeps
    #: reversals.
    median: int | None = attrs.field(
        default=None,
        validator=Key(
            lambda samples: samples >= 3 and samples % 2, "an odd number of samples, 3 or more"
        ),
    )
    #: Removes one frequency, or several. Needs a uniform clock.
    notch: Frequencies | None = attrs.field(default=None, validator=POSITIVE)
    #: Removes higher frequencies; half of the amplitude passes at this one. Rounds reversals of a
    #: channel of speed v by about v/(2πf). Needs a uniform clock.
    low_pass: Frequency | None = attrs.field(default=None, validator=POSITIVE)
    centred: bool = False  #: subtracts the mean of the midpoints of its cycles
    drift_free: bool = False  #: subtracts the drift of the midpoints of its cycles (three or more)

    @property
    def scaled_unit(self) -> str:
        """SI unit of its columns times their scale."""
        raise NotImplementedError

    @property
    def factor(self) -> float:
        """Factor on the column, in SI."""
        return _split_scale(self.scale, self.scaled_unit)[0]

    @property
    def units_in_si(self) -> tuple[str, ...]:
        """SI units of its sources."""
        unit = _split_scale(self.scale, self.scaled_unit)[1]
        return tuple(
            _split_scale(getattr(source, "scale", 1.0), unit)[1] for source in self.sources
        )

    def __attrs_post_init__(self) -> None:
        """Check that it is either columns or a constant, in suitable units."""
        keys = explicit_fields(self)
        chosen = {
            key
            for key, value in keys.items()
            if value != attrs.fields_dict(type(self))[key].default
        }
        sources = [name for name in ("column", *COMBINED, "constant") if name in chosen]
        if len(sources) != 1:
            raise InputError(
                f"{' and '.join(sources)} together; expected one of them"
                if sources
                else "neither column nor constant; expected one of them, or several columns as sum, mean or difference"
            )
        if "constant" in chosen and len(chosen) > 1:
            raise field_error(
                "belongs to a column; a constant has no other keys", min(chosen - {"constant"})
            )
        with error_path("scale"):
            if self.factor == 0:
                raise InputError("0, which would erase the channel; expected another number")
        if sources[0] in COMBINED:
            self._check_combined(sources[0], chosen)
        if self.retrace is not None and (self.time is not None or self.shift):
            problem = "does not apply to a column with a retrace, which follows it in time"
            raise field_error(problem, "shift" if self.time is None else "time")
        # construction of the columns checks their names, positions and indices
        _ = self.sources
        self._check_units()

    def _check_combined(self, key: str, chosen: set[str]) -> None:
        count = len(getattr(self, key))
        if count < 2 or (key == "difference" and count > 2):
            two = "two columns, the second of which is subtracted from the first"
            expected = two if key == "difference" else "two or more"
            raise field_error(f"{count} given; expected {expected}", key)
        if single_column_keys := chosen & {"occurrence", "index", "retrace"}:
            raise field_error(
                f"belongs to one column; give it to one of those in {key}", min(single_column_keys)
            )

    def _check_units(self) -> None:
        unit = _split_scale(self.scale, self.scaled_unit)[1]
        columns: list[tuple[tuple[str | int, ...], Any]] = [
            ((group, index), term)
            for group in COMBINED
            for index, term in enumerate(getattr(self, group) or ())
        ]
        for path, column in (
            [*columns, (("retrace",), self.retrace)] if columns or self.retrace else [((), self)]
        ):
            if column is None:
                continue
            with error_path(*path, "scale"):
                scale = getattr(column, "scale", 1.0) if path else 1.0
                column_unit = _split_scale(scale, unit)[1]
            if stated := column.unit or self.unit:
                with error_path(*(path if column.unit else ()), "unit"):
                    fit_unit(stated, (column_unit,))
        if self.time is not None and self.time.unit is not None:
            with error_path("time", "unit"):
                fit_unit(self.time.unit, ("s",))

    @classmethod
    def from_toml(cls, value: object) -> Self:
        """Structure a channel from a table, or from the name of its column."""
        if isinstance(value, str):
            value = {"column": value}
        if not isinstance(value, dict):
            raise InputError(
                f"{format_value(value)}; expected the name of a column, or a table as in {{ column = 1 }}"
            )
        if "column" in value:
            Column(value["column"])
        return from_table(cls, value)

    @property
    def sources(self) -> tuple[Column, ...]:
        """Its columns, the retrace last, with the unit of the channel if they have none; empty for a constant."""
        if self.column is not None:
            column = Column(self.column, self.unit, self.occurrence, self.index)
            back = () if self.retrace is None else (self.retrace,)
            return column, *(
                term if term.unit else attrs.evolve(term, unit=self.unit) for term in back
            )
        columns = self.sum or self.mean or self.difference or ()
        return tuple(
            column if column.unit else attrs.evolve(column, unit=self.unit) for column in columns
        )

    def combine(self, values: Sequence[Floats]) -> Floats:
        """Combine its columns, without the retrace, (row,)."""
        terms = self.sum or self.mean or self.difference or ()
        unit = _split_scale(self.scale, self.scaled_unit)[1]
        factors = [_split_scale(term.scale, unit)[0] for term in terms]
        values = (
            [factor * column for factor, column in zip(factors, values, strict=True)]
            if terms
            else values
        )
        if self.difference:
            return values[0] - values[1]
        total = functools.reduce(operator.add, values)
        return total / len(values) if self.mean else total


@attrs.frozen(kw_only=True)
class ForceChannel(Channel):
    """A load, or a pressure times an area."""

    constant: Force | None = None  #: constant value instead of a column
    offset: Force = 0.0  #: added after the scale
    #: area that converts a pressure to a load
    area: Area | None = attrs.field(default=None, validator=POSITIVE)
    #: ``"normal_load"`` for a column of friction coefficients: they are multiplied by it, before
    #: all corrections.
    times: str | None = attrs.field(
        default=None,
        validator=Key(lambda channel: channel == "normal_load", 'the channel "normal_load"'),
    )
    negative_as_zero: bool = False  #: replaces negative values by 0

    @property
    def scaled_unit(self) -> str:
        """SI unit of its columns times their scale: force, pressure with ``area``, or coefficient with ``times``."""
        if self.times:
            return "1"
        return "Pa" if self.area else "N"

    def __attrs_post_init__(self) -> None:
        """Check that it is converted to a load in at most one way."""
        super().__attrs_post_init__()
        if self.times and self.area:
            raise field_error(
                "converts a pressure to a load, and times converts a coefficient; expected one of them",
                "area",
            )


@attrs.frozen(kw_only=True)
class LengthChannel(Channel):
    """A displacement."""

    constant: Length | None = None  #: constant value instead of a column
    #: Added after the scale. By default, unless ``centred``, a tangential displacement starts at 0,
    #: since the zero of a stage is arbitrary; no offset is added if it starts at 0 within its
    #: noise. 0 keeps the readings. With an offset, 0 included, the contact is pressed at
    #: displacement 0 before it is moved to the first sample. ``displacement_offset`` in ``[fit]``
    #: fits it.
    offset: Length | None = None
    #: width of the play of the sensor
    backlash: Length = attrs.field(default=0.0, validator=NOT_NEGATIVE)
    #: Width of a clearance in the path of the tangential load.
    free_play: Length = attrs.field(default=0.0, validator=NOT_NEGATIVE)
    #: load that closes the clearance
    closing_load: Force = attrs.field(default=0.0, validator=NOT_NEGATIVE)

    @property
    def scaled_unit(self) -> str:
        """SI unit of a length."""
        return "m"

    def __attrs_post_init__(self) -> None:
        """Check that a closing load is given with a clearance."""
        super().__attrs_post_init__()
        if self.closing_load and not self.free_play:
            raise field_error(
                "needs free_play; expected the width of the clearance as well", "closing_load"
            )


@attrs.frozen(kw_only=True)
class Channels:
    """Columns of each channel."""

    normal_load: ForceChannel | None = None  #: of the normal load
    normal_displacement: LengthChannel | None = None  #: of the approach
    tangential_load: ForceChannel | None = None  #: of the tangential load
    tangential_displacement: LengthChannel | None = None  #: of the tangential displacement

    def __attrs_post_init__(self) -> None:
        """Check the channels against each other."""
        if self.normal_load and self.normal_load.times:
            raise field_error(
                "is the normal load itself; expected it at tangential_load", "normal_load", "times"
            )
        if self.normal_load and (self.normal_load.constant or 0) < 0:
            raise field_error(
                f"{self.normal_load.constant:g} N; expected 0 N or more", "normal_load", "constant"
            )
        if self.normal_displacement and self.normal_displacement.free_play:
            problem = "is a clearance in the path of the tangential load; expected at tangential_displacement"
            raise field_error(problem, "normal_displacement", "free_play")


@attrs.frozen(kw_only=True)
class LoadColumns(Channels):
    """``loading.columns``: replayed channels; without time, the row number is the time in s, from 0."""

    #: With two tangential directions the load along y; ``tangential_load`` is the load along x.
    tangential_load_y: ForceChannel | None = None
    #: With two tangential directions the displacement along y; ``tangential_displacement`` is along
    #: x.
    tangential_displacement_y: LengthChannel | None = None
    #: column of the time; without it rows are 1 s apart, and only their order matters
    time: Column | None = None

    def __attrs_post_init__(self) -> None:
        """Check that there is a load."""
        super().__attrs_post_init__()
        for along in ("tangential_load", "tangential_displacement"):
            if getattr(self, along + ACROSS) is not None and getattr(self, along) is None:
                raise field_error(
                    f"is the component along y; expected {along}, the component along x, as well",
                    along + ACROSS,
                )
        for channel in ("normal", "tangential"):
            if all(
                getattr(self, f"{channel}_{kind}") is not None for kind in ("load", "displacement")
            ):
                both = f"{channel}_load and {channel}_displacement together"
                raise InputError(f"{both}; expected one of them: the other follows from it")
        if not any(getattr(self, key) for key in LOAD_KINDS):
            raise InputError(
                f"{'only time' if self.time else 'nothing'}; expected one or more of {', '.join(LOAD_KINDS)}"
            )


@attrs.frozen(kw_only=True)
class DeadBand:
    """``loading.dead_band``: swings of a channel up to this size are noise, not reversals."""

    #: of the normal load
    normal_load: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    #: of the approach
    normal_displacement: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    #: of the tangential load
    tangential_load: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    #: Of the tangential displacement.
    tangential_displacement: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)


def factor_channel(channel: Channel) -> str | None:
    """Return the channel that multiplies a column of coefficients; None for a load or a displacement."""
    return getattr(channel, "times", None)


def column_names(key: str, channel: Channel) -> list[str]:
    """Return the names of the columns of a channel in a table."""
    is_numbered = len(channel.sources) > 1
    return [
        f"{key} {index}" if is_numbered else key for index in range(1, len(channel.sources) + 1)
    ]


def last_digit(raw: Floats, values: Floats) -> float:
    """Return the resolution of a channel printed or sampled with few digits, in its SI unit; otherwise about 0."""
    range_of_raw = np.ptp(raw)
    steps = np.diff(np.unique(raw))
    # smaller steps are the rounding of binary numbers
    steps = steps[steps > 1e-9 * range_of_raw]
    return float(steps.min() / range_of_raw * np.ptp(values)) if steps.size else 0.0


def hum_remark(
    channel: Channel, key: str, time: Floats, values: Floats, digit: float
) -> str | None:
    """Return a remark on the remaining hum of a channel and its remedy; None if it is below the resolution."""
    unit = "m" if isinstance(channel, LengthChannel) else "N"
    size = float(np.ptp(values)) if unit == "m" else float(np.abs(values).max())
    hums = [
        hum
        for hum in correction.find_hum(time, values, dead_band=HUM_DEAD_BAND * size)
        if hum.amplitude > digit
    ]
    if not hums:
        return None
    lines = ", ".join(
        f"{quantity_text(hum.amplitude, unit, 3)} at {hum.frequency:.4g} Hz" for hum in hums[:3]
    )
    notches = ", ".join(f"{hum.frequency:.4g}" for hum in hums[:3])
    fraction = f"{100 * hums[0].amplitude / np.ptp(values):.2g} % of its range"
    remedy = f"notch = {f'[{notches}]' if len(hums) > 1 else notches} at this channel removes it"
    return f"{key.replace('_', ' ')}: {lines}, up to {fraction}; {remedy}"


def filter_channel(channel: Channel, time: Floats, values: Floats) -> Floats:
    """Filter a channel by its median, its notches and its low-pass, in this order."""
    if channel.median is not None:
        with error_path("median"):
            values = correction.running_median(values, channel.median)
    for frequency in np.atleast_1d([] if channel.notch is None else channel.notch).tolist():
        with error_path("notch"):
            values = correction.notch(time, values, frequency)
    if channel.low_pass is not None:
        with error_path("low_pass"):
            values = correction.low_pass(time, values, channel.low_pass)
    return values


@attrs.frozen(kw_only=True)
class RecordKeys(NumbersFile, Loading):
    """Keys of ``[loading]`` with a measured record."""

    #: replayed columns: ``time``, and a load or displacement of one channel or both, as below
    columns: LoadColumns
    #: Waypoints before the record, such as conditioning loops; the record starts one sample after
    #: them.
    blocks: tuple[AnyBlock, ...] = ()
    #: measured response, to compare with; the same keys
    response: Channels = attrs.Factory(Channels)
    #: Of several runs: the number of the run, from 1, counted at restarts of the clock and, without
    #: ``runs_by``, at each of several files; or its value in ``runs_by``; or ``"each"``, by default
    #: for a folder or a pattern: each run is evaluated by itself.
    run: int | str | None = None
    runs_by: Column | None = None  #: column with the number of the run
    #: Constant sampling rate, instead of a column for time: rows are 1/rate apart.
    rate: Frequency | None = attrs.field(default=None, validator=POSITIVE)
    start: Time | None = None  #: samples before this time are left out
    end: Time | None = None  #: samples after this time are left out
    #: ``"refuse"``, or ``"drop"``: incomplete samples are left out and counted.
    missing: str = attrs.field(default="refuse", validator=REFUSE_OR_DROP)
    #: A longer time between samples is an error
    max_gap: Time | None = attrs.field(default=None, validator=POSITIVE)
    #: Resamples the record at this interval by linear interpolation.
    interval: Time | None = attrs.field(default=None, validator=POSITIVE)
    #: For each channel the swing below which there is no reversal. Used by ``loops``, ``compare``,
    #: ``fit``, and by ``run`` with ``reduce``.
    dead_band: DeadBand = attrs.Factory(DeadBand)
    #: replays only the samples that the contact remembers, using the dead bands
    reduce: bool = False

    @classmethod
    def hint_for_key(cls, key: str) -> str:
        """Suggest a column or a constant for the key of a channel; empty for other keys."""
        return (
            f"expected columns.{key} = {{ constant = … }}, or a column of the file"
            if key in LOAD_KINDS
            else ""
        )

    def __attrs_post_init__(self) -> None:
        """Check the keys against each other."""
        Loading.__attrs_post_init__(self)
        is_number = isinstance(self.run, int) and (self.run >= 1 or self.runs_by is not None)
        if self.run not in {None, EACH} and not is_number:
            raise field_error(
                f'{format_value(self.run)}; expected the number of a run, from 1, or "each"', "run"
            )
        if self.runs_by is not None and self.run is None:
            raise field_error(
                'missing; expected the value of runs_by that is the run, or "each"', "run"
            )
        if self.rate is not None and self.columns.time is not None:
            raise field_error(
                "together with columns.time; expected one of them: rate if the clock was rounded",
                "rate",
            )
        if self.rate is not None and self.broken == "drop":
            raise field_error(
                'counts rows, and broken = "drop" would leave some out; expected one of them',
                "rate",
            )
        if self.start is not None and self.end is not None and self.end < self.start:
            raise field_error(
                f"{self.end:g} s, before the start at {self.start:g} s; expected a later time",
                "end",
            )
        replayed, names = explicit_fields(self.columns), [key for _, key in self.channels]
        if self.reduce and any(key.endswith(ACROSS) for key in replayed):
            raise field_error(
                "supports one tangential direction only; expected reduce = false", "reduce"
            )
        for key in explicit_fields(self.response).keys() & replayed.keys():
            problem = "is replayed by columns already; expected another measured channel"
            raise field_error(problem, "response", key)
        for key in LOAD_KINDS:
            if getattr(self.dead_band, key) is not None and key not in names:
                raise field_error(
                    "has no effect, since neither columns nor response has this channel",
                    "dead_band",
                    key,
                )
        self._check_channels(names)

    def _check_channels(self, names: list[str]) -> None:
        """Check that the record has the channels and times that the keys of each channel need."""
        for path, channel in self.channels.items():
            if getattr(channel, "free_play", 0) and "tangential_load" not in names:
                problem = "needs the tangential load, which closes the clearance; expected a column for it"
                raise field_error(problem, *path, "free_play")
            if (factor := factor_channel(channel)) and factor not in names:
                problem = "was not measured; expected a column or a constant for normal_load"
                raise field_error(problem, *path, "times")
            for needs in ("time", "shift", "notch", "low_pass"):
                if self.columns.time is None and self.rate is None and getattr(channel, needs):
                    problem = (
                        "needs the times of the record; expected a column for loading.columns.time, or a constant "
                        'sampling rate, as in loading.rate = "5 kHz"'
                    )
                    raise field_error(problem, *path, needs)
        if self.columns.time is None and not any(
            channel.sources for channel in self.channels.values()
        ):
            raise field_error("only constants, and no time; expected a column", "columns")

    def chosen_run(self, folder: Path) -> int | str | None:
        """Return the run to read, with the default of a folder or a pattern; paths are relative to the folder."""
        if self.run is None and any(is_file_set(folder / file) for file in self.files):
            return EACH
        return self.run

    @property
    def channels(self) -> dict[tuple[str, str], Channel]:
        """Its channels, replayed ones first, by their paths: ``("columns", "normal_load")``."""
        return {
            (group, key): channel
            for group in ("columns", "response")
            for key, channel in explicit_fields(getattr(self, group)).items()
            if isinstance(channel, Channel)
        }
