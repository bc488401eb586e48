"""Corrections of measured channels, none of them done by itself: backlash, free play, drift, offset, noise, hum.

All filters have zero phase: they run forth and back, so that displacement and load stay in step. At
its two ends a channel is continued by its own point reflection, over a length in which the filter
dies away.
"""

import itertools
import math

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.measured.reduction import channel, clock, follow_turns, reversals, turning_points

QUALITY = 30.0  # frequency of a notch over the width at which it lets half of the power pass, once
# order of the Butterworth low-pass, which runs twice: half of the amplitude passes at its frequency
ORDER = 2
# largest difference of sample intervals, over their median, up to which a clock is even
EVEN = 0.01
FALSE_ALARM = 1e-4  # chance that noise alone is taken for hum, in one channel
# least fraction of the power between turns, after the polynomial, of a line that is reported as hum
LEAST_HUM = 0.1
# samples of a piece of the spectrum, and the degree of the polynomial that is taken off it
_LEAST_PIECE, _LONGEST_PIECE, _DEGREE = 128, 8192, 5
# bins that a line spreads over to either side, and distance within which the noise is estimated
_LOBE, _ASIDE = 3, 12
_ROUNDING = 1e-9

# -- the instrument --------------------------------------------------------------------------------


@attrs.frozen
class Estimate:
    """A number that was estimated from the cycles of a channel."""

    value: float
    standard_error: float  #: NaN where there are too few cycles


def offset_of_cycles(values: Floats, *, dead_band: float) -> Estimate:
    """Return the zero offset of a channel that swings evenly about zero: the mean of the midpoints of its cycles.

    The midpoint of a cycle is half way between its maximum and its minimum, two successive
    reversals.
    """
    _, middle = _midpoints(np.arange(float(values.size)), values, dead_band, fewest=1)
    error = middle.std(ddof=1) / math.sqrt(middle.size) if middle.size > 1 else math.nan
    return Estimate(float(middle.mean()), float(error))


def drift_of_cycles(time: Floats, values: Floats, *, dead_band: float) -> Estimate:
    """Return the linear drift of a channel [its unit/s]: the slope of the line through the midpoints of its cycles."""
    from scipy.stats import linregress

    line = linregress(*_midpoints(clock(time, values.size), values, dead_band, fewest=3))
    return Estimate(float(line.slope), float(line.stderr))


def _midpoints(
    time: Floats, values: Floats, dead_band: float, fewest: int
) -> tuple[Floats, Floats]:
    """Return the mean times and the midpoints of successive cycles."""
    turns = reversals(values, dead_band)
    cycles = turns[: turns.size // 2 * 2].reshape(-1, 2)
    if len(cycles) < fewest:
        raise InputError(
            f"the channel has {len(cycles)} cycles at a dead band of {dead_band:g}; expected {fewest} or more: lower "
            "dead_band"
        )
    return time[cycles].mean(axis=1), values[cycles].mean(axis=1)


def remove_backlash(
    time: Floats, displacement: Floats, width: float, *, dead_band: float = 0.0
) -> Floats:
    """Remove the backlash of the measuring system from a displacement [m].

    After a reversal the reading rests until the backlash is taken up: it is the play, of half the
    width to either side, of the displacement. This inverse of the play assumes that

    - while the reading moves, the displacement is half the width ahead of it;
    - while the reading rests at a reversal, within half the dead band, the displacement moves
      evenly in time;
    - at the start the backlash is taken up in the direction of the first swing, and at the end in
      that of the last one.
    """
    half = width / 2
    turns = turning_points(displacement, dead_band)
    swings = np.diff(displacement[turns])
    near = follow_turns(displacement, turns)
    ahead = [(time[0], half * float(np.sign(swings[:1]).sum()))]
    for previous, turn, following, swing in zip(
        turns[:-2], turns[1:-1], turns[2:], swings[1:], strict=True
    ):
        if abs(swing) < dead_band or swing == 0:
            continue
        resting = previous + np.flatnonzero(
            np.abs(near[previous : following + 1] - displacement[turn]) <= dead_band / 2
        )
        direction = math.copysign(half, swing)
        ahead += [(max(time[resting[0]], ahead[-1][0]), -direction), (time[resting[-1]], direction)]
    at, amount = np.array(ahead).T
    return np.asarray(displacement + np.interp(time, at, amount))


def remove_free_play(
    displacement: Floats, load: Floats, width: float, *, closing_load: float = 0.0
) -> Floats:
    """Remove a clearance in the load path, between drive and contact, from a displacement [m].

    The clearance has no mass: it is open by half its width [m] to the side to which it is loaded,
    and closes in proportion to the load up to the closing load [N]. With 0 N it is crossed where
    the load changes its sign.
    """
    side = np.clip(load / closing_load, -1.0, 1.0) if closing_load > 0 else np.sign(load)
    return displacement - width / 2 * side


# -- filters ---------------------------------------------------------------------------------------


def running_median(values: Floats, samples: int) -> Floats:
    """Return the running median of an odd number of samples, which leaves turns where they are.

    Spikes of less than half of the samples are gone. Beyond its ends the channel is taken as
    mirrored.
    """
    from scipy.ndimage import median_filter

    if samples % 2 != 1 or not 3 <= samples <= values.size:
        raise InputError(
            f"samples is {samples:g}; expected an odd number of samples from 3 to {values.size:,}"
        )
    return np.asarray(median_filter(values, int(samples), mode="mirror"))


def notch(time: Floats, values: Floats, frequency: float, *, quality: float = QUALITY) -> Floats:
    """Remove one frequency [Hz], such as mains hum, from a channel.

    Near a turn of a channel that moves at a speed v it rings by about v/(2πf) over the quality.
    """
    from scipy import signal

    rate = sampling_rate(time)
    at = _below_half(frequency, rate)
    b, a = signal.iirnotch(at, quality, fs=rate)
    padding = _padding(values.size, 3 * quality / (math.pi * at) * rate)
    return np.asarray(signal.filtfilt(b, a, values, padlen=padding))


def low_pass(time: Floats, values: Floats, frequency: float) -> Floats:
    """Remove frequencies above a limit [Hz] by a Butterworth filter in both directions.

    It rounds every turn of a channel that moves at a speed v, by about v/(2πf).
    """
    from scipy import signal

    rate = sampling_rate(time)
    at = _below_half(frequency, rate)
    sections = signal.butter(ORDER, at, fs=rate, output="sos")
    return np.asarray(
        signal.sosfiltfilt(sections, values, padlen=_padding(values.size, 3 / at * rate))
    )


def sampling_rate(time: Floats) -> float:
    """Return the sampling rate of an even clock [Hz]."""
    times = channel("time", time)
    steps = np.diff(times)
    if not steps.size:
        raise InputError("one sample has no sampling rate; expected more of them")
    middle = float(np.median(steps))
    worst = int(np.abs(steps - middle).argmax())
    if not middle > 0 or abs(steps[worst] - middle) > EVEN * middle:
        raise InputError(
            f"samples are {steps[worst]:.6g} s apart after {times[worst]:.9g} s, and {middle:.6g} s elsewhere; filters "
            f"by frequency need an even clock: if the clock was rounded, {rate_remedy(times)}; else resample first "
            "(interval)"
        )
    return steps.size / float(times[-1] - times[0])


def rate_remedy(time: Floats) -> str:
    """Text that names the key ``rate``, with the mean sampling rate of a record [Hz] as its value."""
    duration = float(np.ptp(time))
    example = (
        f', as in rate = "{quantity_text((time.size - 1) / duration, "Hz", 4)}"'
        if duration > 0
        else ""
    )
    return f"give the constant sampling rate in place of the time column{example}"


def _below_half(frequency: float, rate: float) -> float:
    if frequency >= rate / 2:
        folded = abs(frequency - rate * round(frequency / rate))
        seen = f", where the samples show it at {folded:.4g} Hz" if folded > 0 else ""
        raise InputError(
            f"{frequency:g} Hz is beyond half of the sampling rate of {rate:.6g} Hz{seen}; expected a frequency below "
            "that"
        )
    return frequency


def _padding(size: int, samples: float) -> int:
    if size < 3:
        raise InputError(f"{size} samples; expected more of them for a filter")
    return min(math.ceil(samples), size - 1)


# -- hum -------------------------------------------------------------------------------------------


@attrs.frozen
class Hum:
    """A line in the spectrum of a channel, between its turns."""

    #: as the samples show it: beyond half of the sampling rate it is folded back below it [Hz]
    frequency: float
    amplitude: float  #: in the unit of the channel


def find_hum(time: Floats, values: Floats, *, dead_band: float) -> tuple[Hum, ...]:
    """Return the periodic hum in a channel, the strongest first; none where the clock is not even.

    The spectrum is the mean over pieces of the branches between turns, each less a polynomial, so
    that the loops themselves leave no lines. The mean of the noise over k pieces exceeds its median
    as Gamma's law says.
    """
    try:
        rate = sampling_rate(time)
    except InputError:
        return ()
    pieces = _between_turns(values, dead_band)
    if not len(pieces):
        return ()
    length = pieces.shape[1]
    basis = np.linalg.qr(np.vander(np.linspace(-1, 1, length), _DEGREE + 1))[0]
    window = np.hanning(length + 1)[:-1]
    spectrum = np.abs(np.fft.rfft((pieces - pieces @ basis @ basis.T) * window, axis=1)) ** 2
    # white noise of variance 1 has the mean 1; a line spreads over the lobe of the window alone
    power = spectrum[:, 2 * _DEGREE : -1].mean(axis=0) / np.sum(window**2)
    lines = []
    threshold = LEAST_HUM * float(power.sum())
    for peak in _peaks_above(power, threshold):
        lower = power[peak - _ASIDE : peak - _LOBE]
        right = power[peak + _LOBE + 1 :][:_ASIDE]
        # on a slope the higher side counts, lest the bend of a branch be taken for a line
        floor = max(float(np.median(side)) for side in (lower, right) if side.size)
        squared = 4 * float(np.sum(power[peak - _LOBE : peak + _LOBE + 1] - floor)) / length
        is_worth = squared / 2 > 2 * threshold / length
        if (
            is_worth
            and squared > (_ROUNDING * np.ptp(values)) ** 2
            and power[peak] > floor * _noise_limit(power, len(pieces))
        ):
            at = (2 * _DEGREE + _between_bins(power, peak)) * rate / length
            lines.append(Hum(float(at), math.sqrt(squared)))
    return tuple(sorted(lines, key=lambda hum: -hum.amplitude))


def _peaks_above(power: Floats, threshold: float) -> list[int]:
    """Return the bins of peaks whose lobe, noise included, holds more than a least power."""
    peaks = 1 + np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] > power[2:]))
    peaks = peaks[(peaks >= _ASIDE) & (peaks < power.size - 1)]
    # the last lobes are cut off at the end of the spectrum; sums in another order differ in
    # rounding
    lobes = np.lib.stride_tricks.sliding_window_view(np.pad(power, _LOBE), 2 * _LOBE + 1)[
        peaks
    ].sum(axis=1)
    bins: list[int] = peaks[lobes > (1 - 1e-9) * threshold].tolist()
    return bins


def _between_turns(values: Floats, dead_band: float) -> Floats:
    """Return pieces of one length from the middle of the branches, (piece, sample); none where branches are short."""
    turns = np.concatenate([[0], reversals(values, dead_band), [values.size]])
    length = min(int(np.median(np.diff(turns)) * 0.8), _LONGEST_PIECE)
    if length < _LEAST_PIECE:
        return np.empty((0, 0))
    starts = [
        start
        for begin_sample, end_sample in itertools.pairwise(turns.tolist())
        # in as many pieces as the branch has room for
        for start in range(
            begin_sample + (end_sample - begin_sample - length) % length // 2,
            end_sample - length + 1,
            length,
        )
    ]
    return np.stack([values[start : start + length] for start in starts])


def _noise_limit(power: Floats, pieces: int) -> float:
    """Return the largest mean of the noise power of some pieces by chance, over its median."""
    # scipy takes a quarter of a second to import, which most records do without: hardly a line is
    # worth reporting
    from scipy.special import gammainccinv, gammaincinv

    return float(gammainccinv(pieces, FALSE_ALARM / power.size) / gammaincinv(pieces, 0.5))


def _between_bins(power: Floats, peak: int) -> float:
    """Return the place of a peak between bins, by the parabola through three logarithms."""
    low, middle, high = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-300))
    return peak + float((low - high) / (low - 2 * middle + high)) / 2
