"""`Measurement`, a measured load sequence: clock, noise, reversals and reduction.

README.md of this folder, "Reduce a record", says what the reduction changes, and why it changes no
more.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, Integers, as_floats, scalar
from historysim.basics.library import lib, pointer
from historysim.basics.limits import LARGEST
from historysim.basics.units import duration_text, quantity_text, range_text
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.loads.event_sequence import KINDS, Events, Loads
from historysim.loads.events import ACROSS, LOAD_KINDS, Event, load_kind
from historysim.recording.stored_units import to_declared_units

if TYPE_CHECKING:
    import xarray as xr


# median of |x| over the standard deviation, of a normal distribution
MEDIAN_OF_NORMAL = 0.6744897501960817
FEWEST_SAMPLES = 32  # samples below which what looks like noise may be the strokes themselves
REVERSAL = 6.0  # least swing of a reversal by default, in deviations of the noise
DEAD_BAND_SHARE = 0.05  # least dead band of loops by default, over the range of the displacement
# deviations of the noise, and three times its usual steps, by which a spike exceeds both neighbours
SPIKE = 10.0
COUNTERS = (2**16, 2**24, 2**32)  # ranges of counters, in their last digits
# over the range of a channel, and of a last digit: what is rounding
ROUNDING_OF_STEP, WHOLE = 1e-9, 1e-2
# last digits that the least difference between two samples of a counter has at most
MOST_PARTS = 16
# steps between samples over the range of a counter, up to which its jumps are distinct
SMALL_STEP = 1 / 16
# size of the least force over the greatest one up to which a force may have lost its sign
NEAR_ZERO = 0.2
FEWEST_SPIKES = 3  # spikes below which a record has none that is worth a line
# share of the steps between samples of a record with strokes that are no spikes'
USUAL_STEPS = 0.98


def channel(name: str, values: ArrayLike, size: int | None = None) -> Floats:
    """Return the samples of one channel as floats; anything but a row of finite numbers is an InputError."""
    samples = np.asarray(values)
    if samples.dtype.kind == "f" and np.isnan(samples).any():
        raise InputError(
            f"{name} misses {np.isnan(samples).sum()} of {samples.size} samples (NaN); expected all of them: take the "
            "missing ones out of all channels first (see whole_samples)"
        )
    samples = np.ascontiguousarray(as_floats(name, samples))
    if samples.ndim != 1 or samples.size == 0:
        raise InputError(
            f"{name} is of shape {samples.shape}; expected the samples of one channel in a row"
        )
    if size is not None and samples.size != size:
        raise InputError(
            f"{name} has {samples.size} samples; expected {size}, as many as the other channels"
        )
    return samples


def history_channels(history: "xr.Dataset") -> tuple[Floats, Floats, Floats, Floats]:
    """Return time [s], U [m], T [N] and N [N] of a simulated history."""
    names = ("time", "tangential_displacement", "total_tangential_load", "total_normal_load")
    missing = [name for name in names if name not in history.variables]
    if missing:
        raise InputError(
            f"the Dataset has no {', '.join(missing)}; expected a history, as replay and run return it"
        )
    channels = to_declared_units(history[list(names)])
    time, displacement, tangential_load, normal_load = (
        np.asarray(channels[name].values) for name in names
    )
    return time, displacement, tangential_load, normal_load


def clock(time: ArrayLike, size: int | None = None) -> Floats:
    """Return the times of samples [s], which rise from each to the next."""
    samples = channel("time", time, size)
    check_order(samples, rising=True)
    return samples


def check_order(
    time: Floats, location: Callable[[int], str] = "time[{}]".format, *, rising: bool = False
) -> None:
    """Check that times [s] do not decrease, or that they rise; `place` names a sample in the message."""
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0 if rising else steps < 0)
    if back.size:
        index = int(back[0]) + 1
        expected = (
            "times that rise from sample to sample" if rising else "times that do not decrease"
        )
        raise InputError(
            f"{location(index)}: the time {time[index]:.9g} s comes after {time[index - 1]:.9g} s; expected {expected}"
        )


# -- noise -----------------------------------------------------------------------------------------


def deviation_by_median(values: Floats, variance: float = 1.0) -> float:
    """Return the standard deviation of normal values about 0 by their median size, over the root of a variance."""
    return float(np.median(np.abs(values))) / (MEDIAN_OF_NORMAL * math.sqrt(variance))


def estimate_white_noise(values: ArrayLike) -> float:
    """Return the standard deviation of white noise on a smooth record; 0 for fewer than three samples."""
    samples = as_floats("values", values)
    if samples.size < 3:
        return 0.0
    # a second difference adds up the variances 1 + 4 + 1; turning points do not count in a median
    white = deviation_by_median(np.diff(samples, 2), 6)
    if white > 0:
        return white
    steps = np.abs(np.diff(samples))
    if np.median(steps) == 0 and steps.any():
        # the last digit is mostly constant: its rounding is the noise
        return float(steps[steps > 0].min()) / math.sqrt(12)
    return 0.0


def noise_of_curve(values: Floats) -> float:
    """Return the standard deviation of white noise on a record of few samples; 0 for fewer than five.

    A curve has small fourth differences.
    """
    if values.size < 5:
        return 0.0
    return deviation_by_median(np.diff(values, 4), 70)


def estimated_noise(displacement: Floats, noise: float | None = None) -> float:
    """Return the noise of a displacement [m] where it is known, or enough samples show it; else 0."""
    if noise is not None:
        return noise
    return estimate_white_noise(displacement) if displacement.size >= FEWEST_SAMPLES else 0.0


def find_spikes(values: Floats, usual: float) -> Booleans:
    """Return which samples stand out from both neighbours; `usual` is the share of steps that are no spikes'."""
    result = np.zeros(values.size, dtype=np.bool_)
    if values.size < 3:
        return result
    steps = np.diff(values)
    up = steps[:-1]
    down = -steps[1:]
    heights = np.where(up * down > 0, np.minimum(np.abs(up), np.abs(down)), 0.0)
    threshold = max(
        SPIKE * estimate_white_noise(values), 3 * float(np.quantile(np.abs(steps), usual))
    )
    result[1:-1] = (heights > threshold) & (threshold > 0)
    return result


def count_of_spikes(values: Floats, usual: float) -> int:
    """Return how many samples stand out from both neighbours."""
    return int(np.count_nonzero(find_spikes(values, usual)))


def _find_digit(values: Floats) -> float:
    """Return the step that all differences of a channel are multiples of; 0 if none is clear."""
    levels = np.diff(np.unique(values))
    levels = levels[levels > ROUNDING_OF_STEP * np.ptp(values)]
    if not levels.size:
        return 0.0
    for divisor in range(1, MOST_PARTS + 1):
        digits = levels * divisor / levels.min()
        if (np.abs(digits - np.round(digits)) < WHOLE).all():
            return float(levels.min()) / divisor
    return 0.0


def jumps_of_counter(values: Floats) -> str:
    """Describe jumps of a channel by the range of a counter, and the remedy; empty if there are none."""
    if values.size < FEWEST_SAMPLES:
        return ""
    steps = np.abs(np.diff(values))
    largest = float(steps.max())
    # jumps are within 1/16 of one size and other steps below 1/16 of it, so none is in between;
    # the search for the last digit takes long
    if ((steps >= largest / 8) & (steps <= 7 / 8 * largest)).any():
        return ""
    if not (digit := _find_digit(values)):
        return ""
    steps /= digit
    for size in COUNTERS:
        jumps = steps > size / 2
        usual = float(steps[~jumps].max(initial=0.0))
        if (
            jumps.any()
            and usual < SMALL_STEP * size
            and (np.abs(steps[jumps] - size) <= usual + 1).all()
        ):
            count = count_text(int(jumps.sum()), "time", "times")
            unwrap = f"add {size:,} of them behind each fall, and take it off behind each rise, before it is read"
            return f"jumps by {size:,} of its last digits, {count}: it looks like a counter that wraps; {unwrap}"
    return ""


def sign_lost(load: Floats) -> str:
    """Return a note if a force is never negative but comes close to 0, with the remedy; else empty."""
    smallest = float(load.min())
    largest = float(load.max())
    if (
        smallest < -min(SPIKE * estimate_white_noise(load), NEAR_ZERO * largest)
        or smallest > NEAR_ZERO * largest
        or not largest > 0
    ):
        return ""
    return (
        "the force is never negative, forward and backward alike: it looks like a magnitude, |F|, of which no loops "
        "are made; give the column of the force with its sign, as the sensor reads it"
    )


def loop_dead_band(
    displacement: ArrayLike, explicit: float | None = None, noise: float | None = None
) -> float:
    """Return the dead band of loops [m]: the one given, else 5 % of the range, or six deviations of the noise."""
    if explicit is not None:
        return scalar("dead_band", explicit, least=0)
    samples = channel("displacement", displacement)
    return max(DEAD_BAND_SHARE * float(np.ptp(samples)), REVERSAL * estimated_noise(samples, noise))


def check_moves(displacement: ArrayLike, dead_band: float | None = None) -> None:
    """Check that a displacement has strokes; with a given dead band, or few samples, any stroke will do."""
    samples = channel("displacement", displacement)
    noise = estimated_noise(samples)
    length = float(np.ptp(samples))
    if samples.size < FEWEST_SAMPLES or (
        length > 0 and (dead_band is not None or length > 2 * REVERSAL * noise)
    ):
        return
    of_noise = f", {length / noise:.2g} deviations of its noise of {noise:.3g} m" if noise else ""
    raise InputError(
        f"the tangential displacement rests: it moves by {length:.3g} m{of_noise}; expected strokes, which friction "
        "loops and fits need: `historysim sliding` reads a record that slides one way, with --over time where the "
        "displacement is not known, and dead_band sets the smallest stroke"
    )


# -- reversals -------------------------------------------------------------------------------------


def turning_points(values: ArrayLike, dead_band: float = 0.0) -> Integers:
    """Return the samples at which a channel truly reverses, ascending, with the first and the last sample.

    A sample is a turning point if it is the extreme since the turning point before it, and the
    channel then comes back from it by the dead band or more, in its unit; of equal extremes the
    first one counts. Near either end of the record one extreme more may stand, with a smaller
    swing, so that no amplitude is cut off.
    """
    samples = channel("values", values)
    turns = np.empty(samples.size, dtype=np.int64)
    count = lib.hs_turning_points(
        samples.size, pointer(samples), scalar("dead_band", dead_band, least=0), pointer(turns)
    )
    return turns[:count].copy()


def reversals(values: ArrayLike, dead_band: float = 0.0) -> Integers:
    """Return the turning points with a swing of the dead band or more on both sides."""
    turns = turning_points(values, dead_band)
    swings = np.abs(np.diff(np.asarray(values, dtype=np.float64)[turns]))
    wide = (swings > 0) & (swings >= dead_band)
    return turns[1:-1][wide[1:] & wide[:-1]]


def kept_points(
    tangential: ArrayLike,
    normal_load: ArrayLike | None = None,
    *,
    dead_band: float = 0.0,
    normal_dead_band: float = 0.0,
) -> Integers:
    """Return the samples that the joint path of the tangential channel and the normal load needs.

    These are the turning points of both channels, and between them the sample farthest from the
    straight path between its kept neighbours, as long as the path misses it by more than the dead
    bands (Douglas and Peucker, *Cartographica* 10 (1973) 112-122). Every sample then is within both
    dead bands of the path between its neighbours.
    """
    indices = turning_points(tangential, dead_band)
    if normal_load is None:
        return indices
    samples = channel("tangential", tangential)
    normal = channel("normal_load", normal_load, samples.size)
    indices = np.union1d(indices, turning_points(normal, normal_dead_band))
    needed = np.zeros(samples.size, dtype=np.bool_)
    needed[indices] = True
    waiting = np.empty(2 * samples.size + 2, dtype=np.int64)
    lib.hs_keep_path(
        pointer(samples),
        pointer(normal),
        float(dead_band),
        float(normal_dead_band),
        indices.size,
        pointer(indices),
        pointer(needed),
        pointer(waiting),
    )
    return np.flatnonzero(needed)


def follow_turns(values: Floats, turns: Integers) -> Floats:
    """Return a channel that is monotone between turning points: the extreme reached by each sample."""
    result = values.copy()
    for start, stop in itertools.pairwise(turns):
        samples = slice(start, stop + 1)
        # not beyond the end, and never back
        if values[stop] >= values[start]:
            result[samples] = np.maximum.accumulate(np.minimum(values[samples], values[stop]))
        else:
            result[samples] = np.minimum.accumulate(np.maximum(values[samples], values[stop]))
    return result


# -- one clock -------------------------------------------------------------------------------------


def whole_samples(*channels: Floats) -> Booleans:
    """Return which samples miss no channel (sample)."""
    return np.asarray(~np.isnan(np.stack(channels)).any(axis=0))


def resample(
    time: Floats, values: Floats, onto: Floats, *, shift: float = 0.0, max_gap: float = math.inf
) -> Floats:
    """Return a channel at other times [s], straight between its samples.

    NaN where nothing is known: outside of its clock, which lags by the shift [s], next to missing
    samples, and in gaps longer than max_gap [s].
    """
    times = clock(time) + shift
    result = np.interp(onto, times, values, left=math.nan, right=math.nan)
    earlier = np.clip(np.searchsorted(times, onto, side="right") - 1, 0, times.size - 1)
    right = np.minimum(earlier + 1, times.size - 1)
    bridged = (times[right] - times[earlier] <= max_gap) | (onto == times[earlier])
    return np.where(bridged, result, math.nan)


TANGENTIAL = ("tangential_displacement", "tangential_load")
# times more reversals than beyond the dead band, from which on noise is taken for their cause
MANY_MORE = 5
NORMAL = ("normal_load", "normal_displacement")


@attrs.frozen(eq=False)
class Measurement:
    """A measured load sequence."""

    time: Floats  #: (sample) Times, which do not decrease [s]
    #: (sample) What is replayed [N or m], by the names of the load channels
    channels: Mapping[str, Floats]
    response: Mapping[str, Floats] = attrs.field(
        factory=dict
    )  #: (sample) Channels measured in addition, to compare with
    #: The smallest swing of a channel that is no noise [N or m]; a channel that is not named has no
    #: noise where it is replayed, and the dead band of its loops by default (see
    #: `reduction.loop_dead_band`).
    dead_band: Mapping[str, float] = attrs.field(factory=dict)
    #: Whether only the samples are replayed that the contact remembers (see
    #: `reduction.kept_points`).
    reduced: bool = False
    #: lines of (label, text): what was done to the samples on the way here
    remarks: tuple[tuple[str, str], ...] = ()
    #: (sample) What filters removed the channels that have one [N or m]; they were that plus what
    #: they are.
    removed: Mapping[str, Floats] = attrs.field(factory=dict)
    row: Integers | None = None  #: (sample) Where each sample stood in its file, for messages
    #: Offset added to the readings of each displacement [m]: that of the scenario, or minus the
    #: first reading.
    offset: Mapping[str, float] = attrs.field(factory=dict)
    #: Whether the tangential displacement has a zero other than its first sample: the contact is
    #: pressed there first.
    starts_displaced: bool = False

    def __repr__(self) -> str:
        count = count_text(self.time.size, "sample", "samples")
        length = duration_text(float(np.ptp(self.time)))
        channels = [
            f"{name} {range_text(float(values.min()), float(values.max()), load_kind(name).unit)}"
            for name, values in {**self.channels, **self.response}.items()
        ]
        return f"<Measurement: {', '.join([f'{count} over {length}', *channels])}>"

    def __getitem__(self, name: str) -> Floats:
        """Return a channel, replayed or measured in addition; one that was not measured is an InputError."""
        if (values := self.get(name)) is None:
            raise InputError(
                f"the record has no {name}; expected a column for it, in loading.columns or loading.response"
            )
        return values

    def get(self, name: str) -> Floats | None:
        """Return a channel, or None where it was not measured."""
        return self.channels.get(name, self.response.get(name))

    @property
    def planar(self) -> bool:
        """True if there are two tangential directions."""
        return any(name.endswith(ACROSS) for name in self.channels)

    @property
    def vectors(self) -> Mapping[str, Floats]:
        """The replayed channels, (sample), or (sample, 2) where there is a component along y."""
        across = {
            name: self.channels.get(name + ACROSS)
            for name in self.channels
            if not name.endswith(ACROSS)
        }
        return {
            name: self.channels[name]
            if second is None
            else np.column_stack([self.channels[name], second])
            for name, second in across.items()
        }

    def without_spring(self, stiffness: float) -> "Measurement":
        """Subtract the load of a spring in parallel [N/m]: T - k_p U."""
        name = "tangential_load"
        moved = self.get("tangential_displacement")
        if not stiffness or moved is None or self.get(name) is None:
            return self
        remark = "tangential load: spring in parallel taken off", quantity_text(stiffness, "N/m")
        changed = self._replace_channel(name, self[name] - stiffness * moved)
        return attrs.evolve(changed, remarks=(*self.remarks, remark))

    def add_displacement_offset(self, offset: float) -> "Measurement":
        """Add an offset to the tangential displacement [m]."""
        name = "tangential_displacement"
        if not offset or self.get(name) is None:
            return self
        return self._replace_channel(name, self[name] + offset)

    def _replace_channel(self, name: str, values: Floats) -> "Measurement":
        """Return the record with other values of a channel."""
        if name in self.channels:
            return attrs.evolve(self, channels={**self.channels, name: values})
        return attrs.evolve(self, response={**self.response, name: values})

    def replayed_indices(self) -> Integers:
        """Return the indices of the replayed samples."""
        if not self.reduced:
            return np.arange(self.time.size)
        tangential = next((name for name in TANGENTIAL if name in self.channels), None)
        normal = next((name for name in NORMAL if name in self.channels), None)
        first = tangential or normal
        assert first is not None  # noqa: S101 - a measurement has a channel
        return kept_points(
            self.channels[first],
            None if normal is None or first == normal else self.channels[normal],
            dead_band=self.dead_band.get(first, 0.0),
            normal_dead_band=self.dead_band.get(normal or "", 0.0),
        )

    def false_reversals(self) -> str | None:
        """Return a note that noise makes reversals which are replayed, with the dead bands; None where it does not."""
        name = next((name for name in TANGENTIAL if name in self.channels), None)
        if name is None or self.planar:
            return None
        # a dead band below six deviations of the noise leaves reversals of noise
        bands = {
            channel: max(
                loop_dead_band(values, self.dead_band.get(channel)),
                REVERSAL * estimated_noise(values),
            )
            for channel, values in self.channels.items()
        }
        values = self.channels[name]
        replayed = self.replayed_indices()
        if np.ptp(values) <= 2 * REVERSAL * estimated_noise(values):
            # it rests (see `check_moves`): a dead band would leave nothing
            return None
        true = reversals(values, bands[name]).size
        all_of_them = reversals(values[replayed]).size
        if all_of_them < MANY_MORE * (true + 1):
            return None
        units = {channel: LOAD_KINDS[channel].unit for channel in bands}
        keys = ", ".join(
            f'{channel} = "{quantity_text(band, units[channel], 3)}"'
            for channel, band in bands.items()
            if estimated_noise(self.channels[channel]) > 0
        )
        within = f"those within the dead band of each channel, [loading.dead_band] {keys}"
        remedy = f"reduce = true leaves out {within}"
        if self.reduced:
            remedy = f"reduce = true still replays {replayed.size:,} of {values.size:,} samples; it leaves out {within}"
        return (
            f"the {name.replace('_', ' ')} turns {all_of_them:,} times, by {bands[name]:.3g} {units[name]} or "
            f"more {true:,} times; all of them are replayed, those of noise too, so that slip states flicker: {remedy}"
        )

    def events(self) -> Sequence[Event]:
        """Return the events: one per replayed channel and replayed sample."""
        check_order(self.time, self.place)
        if "normal_load" in self.channels:
            self.check_pressed()
        samples = self.replayed_indices()
        kinds = [LOAD_KINDS[name] for name in self.vectors]
        times = self.time[samples]
        numbers = [values[samples].astype(float) for values in self.vectors.values()]
        if not self.planar and all(
            (np.abs(column) <= LARGEST).all() for column in (times, *numbers)
        ):
            # what each event would check is checked of all of them
            codes = np.array([KINDS.index(kind) for kind in kinds], dtype=np.int8)
            columns = (
                np.tile(codes, times.size),
                np.repeat(times, codes.size),
                np.column_stack(numbers).ravel(),
            )
            return Events(loads=Loads(*columns))
        events: list[Event] = []
        for index, time, *sample in zip(
            *map(np.ndarray.tolist, (samples, times, *numbers)), strict=True
        ):
            try:
                events.extend(
                    [kind(time, value) for kind, value in zip(kinds, sample, strict=True)]
                )
            except InputError as error:
                raise InputError(f"{self.place(index)}: {error}") from error
        return events

    def check_pressed(self) -> None:
        """Check that the normal load never pulls; the message names the first place in the file."""
        load = self["normal_load"]
        pulls = np.flatnonzero(load < 0)
        if pulls.size:
            raise InputError(
                f"{self.place(int(pulls[0]))}: a normal load of {load[pulls[0]]:.6g} N pulls on the contact; expected "
                "0 N or more: write scale = -1 where pressing counts negative, or negative_as_zero = true"
            )

    def place(self, sample: int) -> str:
        """Return the location of a sample in its file."""
        if self.row is None:
            return f"the sample at t = {self.time[sample]:.9g} s"
        return f"line {self.row[sample]}"
