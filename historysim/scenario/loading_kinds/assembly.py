"""``loading.file``: from the columns of a file to a `Measurement`: one clock, nothing missing, in SI, corrected."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.fields import POSITIVE, Time
from historysim.basics.limits import LARGEST, SIZE
from historysim.basics.units import quantity_text
from historysim.basics.wording import Notify, counted, shown, silent
from historysim.errors import InputError, at, misfit
from historysim.loads.events import ACROSS, LOAD_KINDS, Event
from historysim.measured import correction, reduction
from historysim.measured.reduction import Measurement, check_order
from historysim.scenario.loading_kinds import LOADINGS, Loading
from historysim.scenario.loading_kinds.measured import (
    Channel,
    Channels,
    DeadBand,
    ForceChannel,
    LengthChannel,
    LoadColumns,
    column_names,
    conditioned,
    hum_remark,
    last_digit,
)
from historysim.scenario.schema import NumbersFile, given
from historysim.tables import REFUSE_OR_DROP, Column, MissingValueError, Table
from historysim.tables.blocks import one_clock

MOST_SAMPLES = 10_000_000
MOST_LISTED = 12
FILE_REMARK, HUM_REMARK = "file", "hum"  # labels of remarks on how a file was read, and on hum in a channel
EACH = "each"  # of several runs in one file, each by itself
# the space keeps it apart from the keys of channels
_RUN = " run"
Remarks = list[tuple[str, str]]


def assembled(folder: Path, section: "MeasuredLoading") -> Measurement:
    """Return the measurement of a file, made ready by the keys of ``[loading]``."""
    remarks: Remarks = []
    clocked = _of_run(section, _on_one_clock(folder, section, remarks), remarks)
    with at("file"), _named(section.name):
        clocked = _within(section, clocked, remarks)
        clocked = _without_missing(section, clocked, remarks)
        _check_one_run(clocked)
        _check_sizes(clocked.time, clocked)
        _check_gaps(section.max_gap, clocked)
    if section.interval is not None:
        clocked = _evenly(section.name, section.interval, clocked)
        remarks.append(("resampled", f"every {quantity_text(section.interval, 's')}, {_samples(clocked.time.size)}"))
    values: dict[str, dict[str, Floats]] = {"columns": {}, "response": {}}
    removed: dict[str, Floats] = {}
    for (group, key), channel in section.channels.items():
        with at(group, key), _named(section.name):
            dead_band = getattr(section.dead_band, key, None) or 0.0
            in_si = _in_si(channel, clocked, (group, key), dead_band=dead_band, remarks=remarks, removed=removed)
            _check_sizes(in_si, clocked)
        values[group][key] = in_si
        if channel.sources:
            digit = last_digit(clocked.values[group, key], in_si)
            if hum := hum_remark(channel, key, clocked.time, in_si, digit):
                remarks.append((HUM_REMARK, hum))
    _close_free_play(section, values, remarks)
    measurement = Measurement(
        time=clocked.time,
        channels=values["columns"],
        response=values["response"],
        dead_band=given(section.dead_band),
        reduced=section.reduce,
        removed=removed,
        row=clocked.row,
    )
    if section.reduce:
        kept = measurement.kept().size
        remarks.append(("replayed", f"{kept:,} of {_samples(measurement.time.size)}: what is remembered"))
    return attrs.evolve(measurement, remarks=tuple(remarks))


@attrs.frozen(eq=False)
class _Clocked:
    """Raw columns on one clock, some of them with gaps; ``inside`` are the samples that lie within all clocks."""

    time: Floats
    values: Mapping[tuple[str, str], Floats]
    row: Integers | None
    inside: Booleans
    run: Floats

    def at(self, kept: Booleans) -> "_Clocked":
        values = {key: array[kept] for key, array in self.values.items()}
        row = None if self.row is None else self.row[kept]
        return _Clocked(self.time[kept], values, row, self.inside[kept], self.run[kept])

    def place(self, index: int) -> str:
        return Measurement(self.time, {}, row=self.row).place(index)


def _on_one_clock(folder: Path, section: "MeasuredLoading", remarks: Remarks) -> _Clocked:
    measured = {place: channel for place, channel in section.channels.items() if channel.sources}
    tables: dict[Column | None, Table] = {}
    # channels of one clock are read together; clocks may have samples of their own number
    for clock in dict.fromkeys([None, *(channel.time for channel in measured.values())]):
        together = {key: channel for (_, key), channel in measured.items() if channel.time == clock}
        tables[clock] = _read(folder, section, clock or section.columns.time, together)
    notices = dict.fromkeys(notice for table in tables.values() for notice in table.notices)
    remarks += [(FILE_REMARK, notice) for notice in notices]
    if section.columns.time is None:
        remarks.append(("clock", "no column for time: the number of the row, from 0 s"))
    main = tables[None]
    time = main.columns["time"]
    values, inside = {}, np.ones(time.size, dtype=np.bool_)
    for (group, key), channel in measured.items():
        own = tables[channel.time]
        column = channel.combined([own.columns[name] for name in column_names(key, channel)])
        if channel.time is not None or channel.shift != 0:
            with at(group, key, "shift" if channel.time is None else "time"), _named(section.name):
                column = _onto(time, own, column, channel.shift, section.max_gap)
            shifted = own.columns["time"] + channel.shift
            inside &= np.isnan(time) | ((time >= np.nanmin(shifted)) & (time <= np.nanmax(shifted)))
        values[group, key] = column
    return _Clocked(time, values, main.lines, inside, _run_of(main))


def _read(folder: Path, section: "MeasuredLoading", clock: Column | None, channels: Mapping[str, Channel]) -> Table:
    columns: dict[str, Column] = {} if clock is None else {"time": clock}
    units = {"time": "s"}
    if section.runs_by is not None and clock == section.columns.time:
        columns[_RUN], units[_RUN] = section.runs_by, "1"
    for key, channel in channels.items():
        for name, source in zip(column_names(key, channel), channel.sources, strict=True):
            columns[name], units[name] = source, channel.unit_in_si
    try:
        table = section.table(folder, columns, units, missing=section.missing == "drop")
    except MissingValueError as error:
        raise misfit(f'{error.args[0]}; missing = "drop" leaves out such samples', *error.place) from error
    if clock is None:
        rows = sum(part.rows for part in table.parts)
        return attrs.evolve(table, columns={**table.columns, "time": np.arange(rows, dtype=np.float64)})
    if len(table.parts) == 1:
        return table
    time, clock_notices = one_clock(table.columns["time"], table.parts)
    return attrs.evolve(table, columns={**table.columns, "time": time}, notices=(*table.notices, *clock_notices))


def _onto(time: Floats, own: Table, column: Floats, shift: float, max_gap: float | None) -> Floats:
    """Return a channel on the clock of the record instead of its own; NaN where it is not known."""
    known = np.flatnonzero(~np.isnan(own.columns["time"]))
    clock = own.columns["time"][known]
    if not known.size:
        raise InputError("the column has no times; expected one or more")
    check_order(clock, lambda index: own.place(int(known[index])), rising=True)
    wanted = np.where(np.isnan(time), clock[0], time)
    longest = math.inf if max_gap is None else max_gap
    return reduction.resample(clock, column[known], wanted, shift=shift, max_gap=longest)


@contextmanager
def _named(name: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise misfit(f"{name}: {error.args[0]}", *error.place) from error


def _samples(count: int) -> str:
    return counted(count, "sample", "samples")


def _within(section: "MeasuredLoading", clocked: _Clocked, remarks: Remarks) -> _Clocked:
    """Leave out samples before the start or after the end."""
    start = -math.inf if section.start is None else section.start
    end = math.inf if section.end is None else section.end
    outside = (clocked.time < start) | (clocked.time > end)
    if outside.all():
        first, last = clocked.time.min(), clocked.time.max()
        raise InputError(
            f"no sample between start and end; expected times within the record, from {first:.9g} s to {last:.9g} s"
        )
    if outside.any():
        remarks.append(("before the start or after the end", f"{_samples(int(np.count_nonzero(outside)))}, left out"))
    return clocked.at(~outside)


def _without_missing(section: "MeasuredLoading", clocked: _Clocked, remarks: Remarks) -> _Clocked:
    """Leave out samples outside of a channel's own clock, and with ``missing = "drop"`` those that miss a channel."""
    outside = int(np.count_nonzero(~clocked.inside))
    if outside:
        remarks.append(("outside the clocks of all channels", f"{_samples(outside)}, left out"))
        clocked = clocked.at(clocked.inside)
    whole = reduction.whole_samples(clocked.time, *clocked.values.values())
    if not whole.any():
        raise InputError("no sample has all channels; expected some, and clocks that overlap")
    missing = int(np.count_nonzero(~whole))
    if missing and section.missing == "refuse":
        place = clocked.place(int(np.flatnonzero(~whole)[0]))
        raise InputError(
            f"{_samples(missing)} within gaps of a channel's own clock, the first one at {place}; raise max_gap, or "
            'write missing = "drop" to leave such samples out'
        )
    if missing:
        remarks.append(("missing", f"{_samples(missing)}, left out"))
    return clocked.at(whole)


def runs_of(folder: Path, section: "MeasuredLoading") -> dict[int, int]:
    """Return the runs of a file, in their order, and how many samples each has."""
    run = _on_one_clock(folder, section, []).run
    known = run[~np.isnan(run)]
    numbers, first, count = np.unique(known, return_index=True, return_counts=True)
    return {int(numbers[place]): int(count[place]) for place in np.argsort(first)}


def _run_of(table: Table) -> Floats:
    """Return the run of each row: by its column, or from 1 where the clock starts again; NaN if missing."""
    if _RUN in table.columns:
        return table.columns[_RUN]
    time = table.columns["time"]
    known = np.flatnonzero(~np.isnan(time))
    number = np.full(time.size, np.nan)
    number[known] = np.append(0, np.cumsum(np.diff(time[known]) < 0))[: known.size] + 1
    return number


def _of_run(section: "MeasuredLoading", clocked: _Clocked, remarks: Remarks) -> _Clocked:
    """Leave out all but the run of the scenario."""
    if section.run is None:
        return clocked
    runs = sorted({int(number) for number in clocked.run[~np.isnan(clocked.run)]})
    known = ", ".join(map(str, runs[:MOST_LISTED])) + (f", … {runs[-1]}" if len(runs) > MOST_LISTED else "")
    if section.run == EACH:
        expected = f'expected one of the runs {known}: "each" is for loops, sliding and fit'
        raise misfit(f'"each"; {expected}, and for Scenario.runs() in Python', "run")
    kept = clocked.run == section.run
    if not kept.any():
        raise misfit(f"there is no run {section.run}; expected one of {known}", "run")
    remarks.append(("run", f"{section.run}, one of {len(runs):,} runs, {_samples(int(kept.sum()))}"))
    return clocked.at(kept)


def _check_one_run(clocked: _Clocked) -> None:
    try:
        check_order(clocked.time, clocked.place)
    except InputError as error:
        starts = int((np.diff(clocked.time) < 0).sum())
        raise InputError(
            f"{error}; if these are {starts + 1:,} runs, run = 1 to {starts + 1} in [loading] takes one of them, "
            'and run = "each" all, for loops, sliding and fit'
        ) from error


def _check_sizes(values: Floats, clocked: _Clocked) -> None:
    """Check numbers in SI, one for each sample."""
    beyond = np.flatnonzero(np.abs(values) > LARGEST)
    if beyond.size:
        raise InputError(f"{clocked.place(int(beyond[0]))}: {values[beyond[0]]:g}; expected {SIZE}, in SI")


def _check_gaps(max_gap: float | None, clocked: _Clocked) -> None:
    if max_gap is None:
        return
    wide = np.flatnonzero(np.diff(clocked.time) > max_gap)
    if wide.size:
        after = int(wide[0]) + 1
        length = clocked.time[after] - clocked.time[after - 1]
        raise InputError(
            f"{counted(wide.size, 'gap', 'gaps')} longer than max_gap, the first one of "
            f"{quantity_text(length, 's')} before {clocked.place(after)}; split the record there, or raise max_gap"
        )


def _evenly(name: str, interval: float, clocked: _Clocked) -> _Clocked:
    duration = float(clocked.time[-1] - clocked.time[0])
    # a division may go beyond the largest float
    if not duration < MOST_SAMPLES * interval:
        problem = f"{interval:g} s makes more than {MOST_SAMPLES:,} samples out of {duration:g} s"
        raise misfit(f"{problem}; expected a longer one", "interval")
    with at("interval"), _named(name):
        check_order(clocked.time, clocked.place, rising=True)
    count = math.floor(duration / interval * (1 + 1e-12)) + 1
    time = np.minimum(clocked.time[0] + interval * np.arange(count), clocked.time[-1])
    values = {key: reduction.resample(clocked.time, array, time) for key, array in clocked.values.items()}
    return _Clocked(time, values, None, np.ones(count, dtype=np.bool_), np.ones(count))


def _close_free_play(section: "MeasuredLoading", values: dict[str, dict[str, Floats]], remarks: Remarks) -> None:
    """Take a clearance in the path of the load, which opens at small loads, off the tangential displacement."""
    name = "tangential_displacement"
    for (group, key), channel in section.channels.items():
        if key == name and channel.free_play:  # type: ignore[attr-defined] # of a length
            load = {**values["response"], **values["columns"]}["tangential_load"]
            width, closing = channel.free_play, channel.closing_load  # type: ignore[attr-defined]
            values[group][name] = correction.remove_free_play(values[group][name], load, width, closing_load=closing)
            remarks.append(("tangential displacement: free play taken off", quantity_text(width, "m")))


def _in_si(
    channel: Channel,
    clocked: _Clocked,
    key: tuple[str, str],
    *,
    dead_band: float,
    remarks: Remarks,
    removed: dict[str, Floats],
) -> Floats:
    """Return a channel in SI, conditioned and corrected; what conditioning took off goes to ``removed``."""
    constant = getattr(channel, "constant", None)
    if constant is not None:
        return np.full(clocked.time.size, constant)
    scale = channel.scale * (getattr(channel, "area", None) or 1.0)
    values = scale * clocked.values[key] + getattr(channel, "offset", 0.0)
    name, unit = key[1].replace("_", " "), "m" if isinstance(channel, LengthChannel) else "N"
    if (channel.median, channel.notch, channel.low_pass) != (None, None, None):
        before, values = values, conditioned(channel, clocked.time, values)
        off = removed[key[1]] = before - values
        rms = quantity_text(float(np.sqrt(np.mean(off**2))), unit, 3)
        most = quantity_text(float(np.abs(off).max()), unit, 3)
        remarks.append((f"{name}: conditioning took off", f"{rms} rms, {most} at most"))
    if isinstance(channel, LengthChannel) and channel.backlash:
        with at("backlash"):
            check_order(clocked.time, clocked.place, rising=True)
            values = correction.remove_backlash(clocked.time, values, channel.backlash, dead_band=dead_band)
        remarks.append((f"{name}: backlash taken up", quantity_text(channel.backlash, "m")))
    if channel.drift_free:
        with at("drift_free"):
            check_order(clocked.time, clocked.place, rising=True)
            drift = correction.drift_of_cycles(clocked.time, values, dead_band=dead_band)
        values = values - drift.value * (clocked.time - clocked.time[0])
        error = quantity_text(drift.standard_error, unit)
        remarks.append((f"{name}: drift taken off", f"{quantity_text(drift.value, unit)}/s ± {error}/s"))
    if channel.centred:
        with at("centred"):
            offset = correction.offset_of_cycles(values, dead_band=dead_band)
        values = values - offset.value
        error = "" if math.isnan(offset.standard_error) else f" ± {quantity_text(offset.standard_error, unit)}"
        remarks.append((f"{name}: offset taken off", f"{quantity_text(offset.value, unit)}{error}"))
    if isinstance(channel, ForceChannel) and channel.negative_as_zero:
        negative = int(np.count_nonzero(values < 0))
        values = np.maximum(values, 0.0)
        remarks.append((f"{name}: negative, taken as 0", _samples(negative)))
    return values


@LOADINGS.register
@attrs.frozen(kw_only=True)
class MeasuredLoading(NumbersFile, Loading):
    """``loading.file``: a record, of which every sample, or with ``reduce`` every turning point, is a waypoint.

    Examples
    --------
    [loading]
    file = "data/unat_loops.csv"
    reduce = true

    [loading.columns]
    time = "time_s"
    normal_load = { column = "normal_load_mN", unit = "mN" }
    tangential_displacement = { column = "displacement_nm", unit = "nm", centred = true }

    [loading.response]
    tangential_load = { column = "tangential_load_mN", unit = "mN" }

    [loading.dead_band]
    tangential_displacement = "10 nm"
    """

    kind = "file"
    also_called = ("measured", "record", "csv")

    columns: LoadColumns  #: what is replayed: ``time``, and a load or displacement of one channel or both, as below
    response: Channels = attrs.Factory(Channels)  #: what was measured beside it, to compare with; the same keys
    #: Of a file with several runs: the number of the one that is read, from 1, by where the clock starts again; or its
    #: value in ``runs_by``; or ``"each"``, for ``loops``, ``sliding`` and ``fit``.
    run: int | str | None = None
    runs_by: Column | None = None  #: column with the number of the run
    start: Time | None = None  #: samples before this time are left out
    end: Time | None = None  #: samples after this time are left out
    #: ``"refuse"``, or ``"drop"``: samples that miss a value are left out, and counted.
    missing: str = attrs.field(default="refuse", validator=REFUSE_OR_DROP)
    max_gap: Time | None = attrs.field(default=None, validator=POSITIVE)  #: A longer time between samples is an error
    #: Samples evenly spaced by this time instead, straight between the measured ones.
    interval: Time | None = attrs.field(default=None, validator=POSITIVE)
    #: For each channel the swing below which there is no reversal. Acts in loops, ``compare``, ``fit``, and in ``run``
    #: with ``reduce``.
    dead_band: DeadBand = attrs.Factory(DeadBand)
    reduce: bool = False  #: replays only the samples that the contact remembers, by the dead bands

    @classmethod
    def meant(cls, key: str) -> str:
        """Return what to write in place of an unknown key: a channel is a column, or a constant."""
        return f"expected columns.{key} = {{ constant = … }}, or a column of the file" if key in LOAD_KINDS else ""

    def __attrs_post_init__(self) -> None:
        """Check what the types leave open."""
        Loading.__attrs_post_init__(self)
        is_number = isinstance(self.run, int) and (self.run >= 1 or self.runs_by is not None)
        if self.run not in {None, EACH} and not is_number:
            raise misfit(f'{shown(self.run)}; expected the number of a run, from 1, or "each"', "run")
        if self.runs_by is not None and self.run is None:
            raise misfit('missing; expected the value of runs_by that is the run, or "each"', "run")
        if self.start is not None and self.end is not None and self.end < self.start:
            raise misfit(f"{self.end:g} s, before the start at {self.start:g} s; expected a later time", "end")
        replayed, names = given(self.columns), [key for _, key in self.channels]
        if self.reduce and any(key.endswith(ACROSS) for key in replayed):
            raise misfit("goes with one tangential direction; expected reduce = false", "reduce")
        for key in given(self.response).keys() & replayed.keys():
            problem = "is replayed already, by columns; expected a channel that was measured beside it"
            raise misfit(problem, "response", key)
        for key in LOAD_KINDS:
            if getattr(self.dead_band, key) and key not in names:
                raise misfit("has no effect, since neither columns nor response has this channel", "dead_band", key)
        self._check_channels(names)

    def _check_channels(self, names: list[str]) -> None:
        """Check that each channel has what its keys need beside it."""
        for place, channel in self.channels.items():
            if getattr(channel, "free_play", 0) and "tangential_load" not in names:
                problem = "needs the tangential load, at which the clearance opens; expected a column for it"
                raise misfit(problem, *place, "free_play")
            for needs in ("time", "shift", "notch", "low_pass"):
                if self.columns.time is None and getattr(channel, needs):
                    problem = "needs the times of the record; expected a column for loading.columns.time"
                    raise misfit(problem, *place, needs)
        if self.columns.time is None and not any(channel.sources for channel in self.channels.values()):
            raise misfit("constants alone, and no time; expected a column", "columns")

    @property
    def channels(self) -> dict[tuple[str, str], Channel]:
        """Its channels, those that are replayed first, by their places: ``("columns", "normal_load")``."""
        return {
            (group, key): channel
            for group in ("columns", "response")
            for key, channel in given(getattr(self, group)).items()
            if isinstance(channel, Channel)
        }

    def measurement(self, folder: Path) -> Measurement:
        """Return what was measured; a file that cannot be read, or made ready, is an InputError."""
        with at("loading"):
            return assembled(folder, self)

    def place(self, folder: Path, index: int) -> str:
        """Return the line of the file that has an event."""
        measurement = self.measurement(folder)
        sample = int(measurement.kept()[index // len(measurement.vectors)])
        return f"loading.file: {self.name}: {measurement.place(sample)}"

    def events(self, folder: Path, notify: Notify = silent) -> Sequence[Event]:
        """Return the events of the file; ``notify`` takes remarks on how it was read, and on noise."""
        measurement = self.measurement(folder)
        for label, notice in measurement.remarks:
            if label in {FILE_REMARK, HUM_REMARK}:
                notify(f"{self.name}: {notice}")
        if noise := measurement.false_reversals():
            notify(f"{self.name}: {noise}")
        with at("loading", "file"):
            try:
                return measurement.events()
            except InputError as error:
                raise InputError(f"{self.name}: {error}") from error
