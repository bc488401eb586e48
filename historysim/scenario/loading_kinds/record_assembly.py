"""From the columns of a file to a `Measurement`: one clock, complete, in SI, corrected."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.limits import LARGEST, SIZE
from historysim.basics.units import quantity_text, uncertain_text
from historysim.basics.wording import count_text
from historysim.errors import InputError, error_path, field_error
from historysim.measured import correction, reduction
from historysim.measured.reduction import Measurement, check_order
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.loading_kinds.channels import (
    Channel,
    ForceChannel,
    LengthChannel,
    RecordKeys,
    column_names,
    factor_channel,
    filter_channel,
    hum_remark,
    last_digit,
)
from historysim.scenario.schema import explicit_fields
from historysim.tables import Column, MissingValueError, Table
from historysim.tables.run_column import find_run_column

MOST_SAMPLES = 10_000_000
MOST_LISTED = 12
# labels of remarks on the reading of a file, and on hum in a channel
FILE_REMARK, HUM_REMARK = "file", "hum"
# first sample of a tangential displacement over its range, above which a notice is given
CLEAR_OF_ZERO = 0.05
# the space distinguishes them from the keys of channels
_RUN, RETRACE = " run", " retrace"


def assemble_measurement(folder: Path, section: RecordKeys) -> Measurement:
    """Read and condition the measurement of a file by the keys of ``[loading]``."""
    return condition_record(_read_record(folder, section))


def condition_record(record: "RawRecord") -> Measurement:
    """Condition a record by the keys of its ``[loading]``; the record is not changed."""
    section = record.section
    record = attrs.evolve(record, remarks=[*record.remarks], removed={}, offset={})
    record.append_retrace()
    with error_path("file"), _file_named(section.name):
        record.take_window()
        record.leave_out_missing()
        record.check_order_and_gaps()
    if section.interval is not None:
        with error_path("interval"), _file_named(section.name):
            record.resample(section.interval)
    converted: dict[str, dict[str, Floats]] = {"columns": {}, "response": {}}
    # columns of coefficients come after the load that multiplies them
    for (group, key), channel in sorted(
        section.channels.items(), key=lambda item: factor_channel(item[1]) is not None
    ):
        with error_path(group, key), _file_named(section.name):
            factor = {**converted["response"], **converted["columns"]}.get(
                factor_channel(channel) or ""
            )
            converted[group][key] = record.convert_channel(
                channel, group, key, 1.0 if factor is None else factor
            )
    record.close_free_play(converted)
    measurement = Measurement(
        time=record.time,
        channels=converted["columns"],
        response=converted["response"],
        dead_band=explicit_fields(section.dead_band),
        reduced=section.reduce,
        removed=record.removed,
        row=record.row,
        offset=record.offset,
        starts_displaced=getattr(section.columns.tangential_displacement, "offset", None)
        is not None,
    )
    if section.reduce:
        replayed = measurement.replayed_indices().size
        record.remark(
            "replayed",
            f"{replayed:,} of {_samples(measurement.time.size)}, which the contact remembers",
        )
    return attrs.evolve(measurement, remarks=tuple(record.remarks))


def _read_record(folder: Path, section: RecordKeys) -> "RawRecord":
    """Read the record of a file, or its run; InputError if there is no such run, or all runs are selected."""
    run = section.chosen_run(folder)
    if run is None:
        return _align_clocks(folder, section)
    runs = read_runs(folder, section)
    if run in runs:
        return runs[int(run)]
    numbers = [*runs]
    listed_runs = ", ".join(map(str, numbers[:MOST_LISTED]))
    if len(numbers) > MOST_LISTED:
        listed_runs += f", … {numbers[-1]}"
    if run == EACH:
        expected = (
            f"expected one of the runs {listed_runs}: these are separate records, not a single one"
        )
        raise field_error(f'"each"; {expected}', "run")
    raise field_error(f"there is no run {run}; expected one of {listed_runs}", "run")


def read_runs(folder: Path, section: RecordKeys) -> "dict[int, RawRecord]":
    """Read the runs of a record, by number in their order; every file is read once.

    Without ``runs_by`` each of several files is a run, or several runs if its clock starts again.
    """
    paths = section.paths(folder)
    one_file_per_run = section.runs_by is None and len(paths) > 1
    if one_file_per_run:
        records = [
            _align_clocks(folder, attrs.evolve(section, file=str(path.absolute())))
            for path in paths
        ]
    else:
        records = [_align_clocks(folder, section)]
    runs: dict[int, RawRecord] = {}
    for record in records:
        counted = len(runs)
        for number, rows in _find_run_rows(record.run):
            if len(paths) > 1 and not one_file_per_run and (np.diff(rows) > 1).any():
                problem = f"run {number} is in separate parts of {len(paths)} files"
                raise field_error(
                    f"{problem}; expected one part: leave runs_by out, and each file is a run",
                    "runs_by",
                )
            runs[number + (counted if one_file_per_run else 0)] = record.take(rows)
    for number, run in runs.items():
        named = f"{number} ({run.section.name})" if one_file_per_run else f"{number}"
        run.remark("run", f"{named}, one of {len(runs):,} runs, {_samples(run.time.size)}")
    return runs


def _find_run_rows(run: Floats) -> list[tuple[int, Integers]]:
    """Return the number and the rows of each run, in the order of their first rows."""
    numbered = np.flatnonzero(~np.isnan(run))
    order = numbered[np.argsort(run[numbered], kind="stable")]
    parts = np.split(order, np.flatnonzero(np.diff(run[order])) + 1) if order.size else []
    return [(int(run[rows[0]]), rows) for rows in sorted(parts, key=lambda rows: int(rows[0]))]


def _align_clocks(folder: Path, section: RecordKeys) -> "RawRecord":
    """Read the columns of a file, grouped by clock, because clocks may have different numbers of samples."""
    measured = {path: channel for path, channel in section.channels.items() if channel.sources}
    tables: dict[Column | None, Table] = {}
    for clock in dict.fromkeys([None, *(channel.time for channel in measured.values())]):
        together = {key: channel for (_, key), channel in measured.items() if channel.time == clock}
        tables[clock] = _read(folder, section, clock or section.columns.time, together)
    notices = dict.fromkeys(notice for table in tables.values() for notice in table.notices)
    main = tables[None]
    time = main.columns["time"]
    inside = np.ones(time.size, dtype=np.bool_) if main.inside is None else main.inside.copy()
    values, first_readings = {}, {}
    for (group, key), channel in measured.items():
        on_clock = tables[channel.time]
        raw = [on_clock.columns[name] for name in column_names(key, channel)]
        if channel.retrace is not None:
            values[group, key + RETRACE] = raw.pop()
        column = channel.combine(raw)
        first_readings[group, key] = _first_reading(column)
        if channel.time is not None or channel.shift != 0:
            with (
                error_path(group, key, "shift" if channel.time is None else "time"),
                _file_named(section.name),
            ):
                column = _resample_onto_clock(
                    time, on_clock, column, channel.shift, section.max_gap
                )
            shifted = on_clock.columns["time"] + channel.shift
            inside &= np.isnan(time) | ((time >= np.nanmin(shifted)) & (time <= np.nanmax(shifted)))
        values[group, key] = column
    remarks = [(FILE_REMARK, notice) for notice in notices]
    record = RawRecord(
        section, time, values, first_readings, main.lines, inside, _number_runs(main), remarks
    )
    paths = section.paths(folder)
    if section.runs_by is None and len(paths) == 1:
        record.remark_runs(paths[0])
    if section.rate is not None:
        record.remark("clock", f"{quantity_text(section.rate, 'Hz')}, from 0 s")
    elif section.columns.time is None and main.time is None:
        record.remark("clock", "no column for time: the row number, from 0 s")
    return record


def _first_reading(column: Floats) -> float:
    """Return the first reading of a column; NaN if there is none."""
    finite = column[~np.isnan(column)]
    return float(finite[0]) if finite.size else math.nan


def _read(
    folder: Path, section: RecordKeys, clock: Column | None, channels: Mapping[str, Channel]
) -> Table:
    columns: dict[str, Column] = {} if clock is None else {"time": clock}
    units = {"time": "s"}
    if section.runs_by is not None and clock == section.columns.time:
        columns[_RUN], units[_RUN] = section.runs_by, "1"
    for key, channel in channels.items():
        for name, source, unit in zip(
            column_names(key, channel), channel.sources, channel.units_in_si, strict=True
        ):
            columns[name], units[name] = source, unit
    try:
        table = section.table(
            folder, columns, units, missing=section.missing == "drop", by_time=True
        )
    except MissingValueError as error:
        try:
            read = section.table(folder, columns, units, missing=True, by_time=True)
            count = int(np.count_nonzero(~reduction.whole_samples(*read.columns.values())))
            left_out = f"{count:,} of {_samples(sum(read.file_rows))}"
        except InputError:
            # another value is not a number
            left_out = "such samples"
        raise field_error(
            f'{error.args[0]}; missing = "drop" leaves out {left_out}', *error.place
        ) from error
    if clock is None and table.time is not None and section.rate is None:
        return attrs.evolve(table, columns={**table.columns, "time": table.time})
    if clock is None:
        time = np.arange(sum(table.file_rows), dtype=np.float64) / (section.rate or 1.0)
        return attrs.evolve(table, columns={**table.columns, "time": time})
    if len(table.file_rows) == 1:
        return table
    time, count = _continue_clock(table.columns["time"], table.file_rows)
    restarted = (
        f"the clock starts again in {count_text(count, 'file', 'files')}, "
        "joined one sample after the previous file"
    )
    notices = (*table.notices, restarted) if count else table.notices
    return attrs.evolve(table, columns={**table.columns, "time": time}, notices=notices)


def _continue_clock(time: Floats, file_rows: Sequence[int]) -> tuple[Floats, int]:
    """Return the times of joined files [s] on one clock, and the number of files whose clock starts again.

    Such a file starts one sample (its median interval) after the end of the previous file.
    """
    continued = time.copy()
    previous_end, raw_end, step, offset, restarts = -math.inf, -math.inf, 0.0, 0.0, 0
    for times in np.split(continued, np.cumsum(file_rows)[:-1]):
        finite = times[~np.isnan(times)]
        if not finite.size:
            continue
        step = max(float(np.median(np.diff(finite))), 0.0) if finite.size > 1 else step
        if finite[0] < raw_end:
            offset = previous_end + step - finite[0]
            restarts += 1
        raw_end = finite[-1]
        previous_end = raw_end + offset
        np.add(times, offset, out=times)
    return continued, restarts


def _resample_onto_clock(
    time: Floats, table: Table, column: Floats, shift: float, max_gap: float | None
) -> Floats:
    """Resample a channel from its separate clock onto the clock of the record; NaN outside its samples."""
    timed_rows = np.flatnonzero(~np.isnan(table.columns["time"]))
    clock = table.columns["time"][timed_rows]
    if not timed_rows.size:
        raise InputError("the column has no times; expected one or more")
    check_order(clock, lambda index: table.place(int(timed_rows[index])), rising=True)
    target_times = np.where(np.isnan(time), clock[0], time)
    longest = math.inf if max_gap is None else max_gap
    return reduction.resample(clock, column[timed_rows], target_times, shift=shift, max_gap=longest)


def _number_runs(table: Table) -> Floats:
    """Return the run number of each row: from its column, or counted at restarts of the clock; NaN if missing."""
    if _RUN in table.columns:
        return table.columns[_RUN]
    time = table.columns["time"]
    timed_rows = np.flatnonzero(~np.isnan(time))
    number = np.full(time.size, np.nan)
    number[timed_rows] = (
        np.append(0, np.cumsum(np.diff(time[timed_rows]) < 0))[: timed_rows.size] + 1
    )
    return number


@contextmanager
def _file_named(name: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise field_error(f"{name}: {error.args[0]}", *error.place) from error


def _samples(count: int) -> str:
    return count_text(count, "sample", "samples")


@attrs.define(eq=False)
class RawRecord:
    """Columns of a file on one clock, during their conversion to a measurement."""

    section: RecordKeys
    time: Floats
    values: dict[tuple[str, str], Floats]  #: raw values, possibly with gaps
    #: first reading of each, before samples are left out
    first_readings: dict[tuple[str, str], float]
    row: Integers | None
    inside: Booleans  #: samples within the range of all clocks
    run: Floats
    remarks: list[tuple[str, str]]
    removed: dict[str, Floats] = attrs.Factory(dict)  #: parts of channels removed by filters
    #: offset added to the readings of each displacement [m]
    offset: dict[str, float] = attrs.Factory(dict)

    def remark(self, label: str, text: str) -> None:
        """Add a line of (label, text)."""
        self.remarks.append((label, text))

    def remark_runs(self, path: Path) -> None:
        """Remark on a column that numbers runs, which are joined unless ``runs_by`` names it."""
        columns = [
            source
            for channel in self.section.channels.values()
            if channel.time is None
            for source in channel.sources
        ]
        runs = find_run_column(path, self.section, columns)
        if runs is not None:
            text = (
                f"column {runs.name!r} has the numbers {runs.runs_text}, and these runs are joined; if they are "
                f'separate records, add runs_by = "{runs.name}" and run = "each", or one of the numbers'
            )
            self.remark(FILE_REMARK, text)

    def take(self, rows: Integers) -> "RawRecord":
        """Return the record of some rows."""
        part = attrs.evolve(self, remarks=[*self.remarks])
        part.keep(rows)
        part.first_readings = {path: _first_reading(column) for path, column in part.values.items()}
        return part

    def keep(self, mask: Booleans | Integers) -> None:
        """Leave out all other samples."""
        self.values = {key: array[mask] for key, array in self.values.items()}
        self.row = None if self.row is None else self.row[mask]
        self.time, self.inside, self.run = self.time[mask], self.inside[mask], self.run[mask]

    def place(self, index: int) -> str:
        """Return the location of a sample in its file."""
        return Measurement(self.time, {}, row=self.row).place(index)

    def check_order(self, *, rising: bool = False) -> None:
        """Check that times do not decrease, or that they rise."""
        check_order(self.time, self.place)
        if not rising:
            return
        try:
            check_order(self.time, self.place, rising=True)
        except InputError as error:
            remedy = correction.rate_remedy(self.time)
            raise InputError(f"{error}; if the clock was rounded, {remedy}") from error

    def check_sizes(self, values: Floats) -> None:
        """Check that the values are workable in SI."""
        beyond = np.flatnonzero(np.abs(values) > LARGEST)
        if beyond.size:
            raise InputError(
                f"{self.place(int(beyond[0]))}: {values[beyond[0]]:g}; expected {SIZE}, in SI"
            )

    def append_retrace(self) -> None:
        """Append the retrace in reverse order; channels without a retrace repeat their trace backwards."""
        if not any(key.endswith(RETRACE) for _, key in self.values):
            return
        traces = {
            path: column for path, column in self.values.items() if not path[1].endswith(RETRACE)
        }
        self.values = {
            (group, key): np.append(column, self.values.get((group, key + RETRACE), column)[::-1])
            for (group, key), column in traces.items()
        }
        step = float(np.nanmedian(np.diff(self.time))) if self.time.size > 1 else 1.0
        end_time = float(np.nanmax(self.time))
        self.remark("retrace", f"{_samples(self.time.size)} after the trace, in reverse order")
        self.time = np.append(self.time, end_time + step + (end_time - self.time[::-1]))
        self.row = None if self.row is None else np.append(self.row, self.row[::-1])
        self.inside = np.append(self.inside, self.inside[::-1])
        self.run = np.append(self.run, self.run[::-1])

    def take_window(self) -> None:
        """Leave out samples before the start or after the end."""
        start_time = -math.inf if self.section.start is None else self.section.start
        end_time = math.inf if self.section.end is None else self.section.end
        outside = (self.time < start_time) | (self.time > end_time)
        if outside.all():
            within = f"expected times within the record, from {self.time.min():.9g} s to {self.time.max():.9g} s"
            raise InputError(f"no sample between start and end; {within}")
        if outside.any():
            self.remark(
                "before the start or after the end", f"{_samples(int(outside.sum()))}, left out"
            )
        self.keep(~outside)

    def leave_out_missing(self) -> None:
        """Leave out samples outside the clock of a channel and, with ``missing = "drop"``, incomplete samples."""
        if outside := int(np.count_nonzero(~self.inside)):
            self.remark("outside the clocks of all channels", f"{_samples(outside)}, left out")
            self.keep(self.inside)
        complete = reduction.whole_samples(self.time, *self.values.values())
        if not complete.any():
            raise InputError("no sample has all channels; expected some, and clocks that overlap")
        missing = int(np.count_nonzero(~complete))
        if missing and self.section.missing == "refuse":
            location = self.place(int(np.flatnonzero(~complete)[0]))
            raise InputError(
                f"{_samples(missing)} within gaps of a channel's separate clock, the first one at {location}; raise "
                'max_gap, or write missing = "drop" to leave such samples out'
            )
        if missing:
            self.remark("missing", f"{_samples(missing)}, left out")
        self.keep(complete)

    def check_order_and_gaps(self) -> None:
        """Check that the clock does not run backwards and has no gap above ``max_gap``."""
        try:
            self.check_order()
        except InputError as error:
            starts = int((np.diff(self.time) < 0).sum())
            raise InputError(
                f"{error}; if these are {starts + 1:,} runs, run = 1 to {starts + 1} in [loading] selects one of them, "
                'and run = "each" all'
            ) from error
        self.check_sizes(self.time)
        self.remark_repeated_times()
        longest = math.inf if self.section.max_gap is None else self.section.max_gap
        wide = np.flatnonzero(np.diff(self.time) > longest)
        if wide.size:
            index = int(wide[0]) + 1
            length = quantity_text(self.time[index] - self.time[index - 1], "s")
            raise InputError(
                f"{count_text(wide.size, 'gap', 'gaps')} longer than max_gap, the first one of {length} before "
                f"{self.place(index)}; split the record there, or raise max_gap"
            )

    def remark_repeated_times(self) -> None:
        """Remark on samples that share a time: all are replayed, and only the last of each time is recorded."""
        repeated = int(np.count_nonzero(np.diff(self.time) == 0))
        if repeated:
            index = int(np.flatnonzero(np.diff(self.time) == 0)[0]) + 1
            text = (
                f"{repeated:,} of {_samples(self.time.size)} have the time of the sample before, the first one at "
                f"{self.place(index)}: all are replayed in their order, and the last one at each time is recorded; if "
                f"the clock was rounded, {correction.rate_remedy(self.time)}"
            )
            self.remark(FILE_REMARK, text)

    def resample(self, interval: float) -> None:
        """Resample all channels at uniform times by linear interpolation."""
        duration = float(self.time[-1] - self.time[0])
        # a division might overflow
        if not duration < MOST_SAMPLES * interval:
            problem = (
                f"{interval:g} s makes more than {MOST_SAMPLES:,} samples out of {duration:g} s"
            )
            raise InputError(f"{problem}; expected a longer one")
        self.check_order(rising=True)
        count = math.floor(duration / interval * (1 + 1e-12)) + 1
        time = np.minimum(self.time[0] + interval * np.arange(count), self.time[-1])
        self.values = {
            key: reduction.resample(self.time, array, time) for key, array in self.values.items()
        }
        self.time, self.row = time, None
        self.remark("resampled", f"every {quantity_text(interval, 's')}, {_samples(count)}")

    def convert_channel(
        self, channel: Channel, group: str, key: str, factor: Floats | float
    ) -> Floats:
        """Return a channel times a factor in SI, filtered, corrected and checked for size."""
        constant = getattr(channel, "constant", None)
        if constant is not None:
            return np.full(self.time.size, constant)
        raw = self.values[group, key]
        offset = getattr(channel, "offset", None)
        values = channel.factor * (getattr(channel, "area", None) or 1.0) * raw * factor + (
            offset or 0.0
        )
        values = self.correct(channel, key, values)
        if isinstance(channel, LengthChannel):
            self.offset[key] = offset or 0.0
            if offset is None and not channel.centred:
                values = self.from_zero(
                    key, values, channel.factor * self.first_readings[group, key]
                )
        self.check_sizes(values)
        if jumps := reduction.jumps_of_counter(raw):
            self.remark(FILE_REMARK, f"{key.replace('_', ' ')}: {jumps}")
        if hum := hum_remark(channel, key, self.time, values, last_digit(raw, values)):
            self.remark(HUM_REMARK, hum)
        return values

    def from_zero(self, key: str, values: Floats, first_reading: float) -> Floats:
        """Return a displacement [m] relative to its first reading, the zero of its stage."""
        name = key.replace("_", " ")
        if abs(first_reading) <= reduction.REVERSAL * reduction.estimated_noise(values):
            return values
        if key.startswith("tangential"):
            clear = abs(first_reading) > CLEAR_OF_ZERO * float(np.ptp(values))
            first_text = quantity_text(first_reading, "m")
            text = f"its first sample, {first_text}, is its zero; offset = 0 leaves the readings unchanged"
            self.remark(
                FILE_REMARK if clear else f"{name}: zero", f"{name}: {text}" if clear else text
            )
            self.offset[key] = -first_reading
            return values - first_reading
        if first_reading > 0:
            reading = quantity_text(-first_reading, "m", 9)
            raise InputError(
                f"the {name} starts at {quantity_text(first_reading, 'm')}, in contact before the record starts: it is "
                "the approach from first touch, but the zero of a stage is arbitrary; expected the negative reading at "
                f'first touch as offset, as in offset = "{reading}" if the first sample is that, or offset = 0 if '
                "the readings are approaches"
            )
        return values

    def correct(self, channel: Channel, key: str, values: Floats) -> Floats:
        """Apply the corrections of a channel in the order of its keys."""
        name, unit = key.replace("_", " "), "m" if isinstance(channel, LengthChannel) else "N"
        given_band = getattr(self.section.dead_band, key, None)
        dead_band = given_band or 0.0
        # cycles caused by noise have no midpoints
        of_cycles = reduction.loop_dead_band(values) if given_band is None else given_band
        if (channel.median, channel.notch, channel.low_pass) != (None, None, None):
            unfiltered, values = values, filter_channel(channel, self.time, values)
            removed = self.removed[key] = unfiltered - values
            rms = quantity_text(float(np.sqrt(np.mean(removed**2))), unit, 3)
            largest = quantity_text(float(np.abs(removed).max()), unit, 3)
            self.remark(f"{name}: filters removed", f"{rms} rms, {largest} at most")
        if isinstance(channel, LengthChannel) and channel.backlash:
            with error_path("backlash"):
                self.check_order(rising=True)
                values = correction.remove_backlash(
                    self.time, values, channel.backlash, dead_band=dead_band
                )
            self.remark(f"{name}: backlash removed", quantity_text(channel.backlash, "m"))
        if channel.drift_free:
            with error_path("drift_free"):
                self.check_order(rising=True)
                drift = correction.drift_of_cycles(self.time, values, dead_band=of_cycles)
            values = values - drift.value * (self.time - self.time[0])
            self.remark(
                f"{name}: drift removed",
                uncertain_text(drift.value, drift.standard_error, f"{unit}/s"),
            )
        if channel.centred:
            with error_path("centred"):
                offset = correction.offset_of_cycles(values, dead_band=of_cycles)
            values = values - offset.value
            self.remark(
                f"{name}: offset removed", uncertain_text(offset.value, offset.standard_error, unit)
            )
        if isinstance(channel, ForceChannel) and channel.negative_as_zero:
            self.remark(
                f"{name}: negative, replaced by 0", _samples(int(np.count_nonzero(values < 0)))
            )
            values = np.maximum(values, 0.0)
        return values

    def close_free_play(self, converted: dict[str, dict[str, Floats]]) -> None:
        """Subtract a clearance in the load path, which opens at small loads, from the tangential displacement."""
        name = "tangential_displacement"
        for (group, key), channel in self.section.channels.items():
            if key == name and isinstance(channel, LengthChannel) and channel.free_play:
                load = {**converted["response"], **converted["columns"]}["tangential_load"]
                width, closing = channel.free_play, channel.closing_load
                converted[group][key] = correction.remove_free_play(
                    converted[group][key], load, width, closing_load=closing
                )
                self.remark("tangential displacement: free play removed", quantity_text(width, "m"))
