"""Conditioning of measured channels: what is taken off because it is hum, noise or a spike, and the hum that is found.

Nothing here is done by itself, as with corrections. All filters have zero phase: they run forth and back, so that
displacement and load stay in step, and each acts twice. At its two ends a channel is continued by its own point
reflection (the odd extension of `scipy.signal.filtfilt`), over a length in which the filter has died away; there the
result stands on that guess.

What they cost: a low-pass rounds every turn of the channel, by about v/(2π f) of a channel that turns at a speed v; a
notch rings beside a turn, with that size times its relative width, for some Q/(π f); a median leaves edges and turns
where they are, and takes off what is shorter than half its window.
"""

import itertools
import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.measured.correction import Correction
from historysim.measured.reduction import channel, clock, reversals

QUALITY = 30.0
"""Frequency of a notch over the width at which it lets half of the power pass, once."""
ORDER = 2
"""Order of the Butterworth low-pass, which runs twice: half of the amplitude passes at its frequency."""
EVEN = 0.01
"""Largest difference of sample intervals, over their median, up to which a clock is even."""
FALSE_ALARM = 1e-4
"""Chance that noise alone is taken for hum, in one channel."""
WORTH = 0.1
"""Share of what is left of a channel between its turns that a line holds at least, to be told as hum."""
_LEAST_PIECE, _LONGEST_PIECE, _DETREND = 128, 8192, 5
# bins that a line spreads over to either side, and how far beside it the noise is looked for
_LOBE, _ASIDE = 3, 12
_ROUNDING = 1e-9


@attrs.frozen
class Hum:
    """A line in the spectrum of a channel, between its turns."""

    frequency: float
    """As the samples show it: beyond half of the sampling rate it is folded back below it [Hz]."""
    amplitude: float
    """In the unit of the channel."""


def running_median(values: npt.ArrayLike, samples: int) -> Correction:
    """Return a channel as the running median of an odd number of samples: spikes of less than half of them are gone.

    Beyond its ends the channel is taken as mirrored.

    Parameters
    ----------
    values : array_like (sample)
    samples : int
        Odd, 3 or more, and no more than there are.

    Raises
    ------
    InputError
        Missing or infinite samples, or another number.
    """
    from scipy.ndimage import median_filter

    given = channel("values", values)
    width = scalar("samples", samples)
    if width % 2 != 1 or not 3 <= width <= given.size:
        raise InputError(f"samples is {width:g}; expected an odd number of samples from 3 to {given.size:,}")
    return _kept(given, median_filter(given, int(width), mode="mirror"))


def notch(time: npt.ArrayLike, values: npt.ArrayLike, frequency: float, *, quality: float = QUALITY) -> Correction:
    """Return a channel less what it has at one frequency, such as mains hum.

    Parameters
    ----------
    time : array_like (sample)
        Evenly spaced [s].
    values : array_like (sample)
    frequency : float
        [Hz], below half of the sampling rate.
    quality : float
        The frequency over the width of the notch.

    Raises
    ------
    InputError
        Missing or infinite samples, a clock that is not even, too few samples, or a frequency out of range.
    """
    from scipy import signal

    given = channel("values", values)
    rate = sampling_rate(time, given.size)
    at = _below_half(frequency, rate)
    b, a = signal.iirnotch(at, scalar("quality", quality, above=0), fs=rate)
    return _kept(given, signal.filtfilt(b, a, given, padlen=_padding(given.size, 3 * quality / (math.pi * at) * rate)))


def low_pass(time: npt.ArrayLike, values: npt.ArrayLike, frequency: float) -> Correction:
    """Return a channel less what is faster than a frequency: a Butterworth filter, forth and back.

    Parameters
    ----------
    time : array_like (sample)
        Evenly spaced [s].
    values : array_like (sample)
    frequency : float
        At which half of the amplitude passes [Hz], below half of the sampling rate.

    Raises
    ------
    InputError
        Missing or infinite samples, a clock that is not even, too few samples, or a frequency out of range.
    """
    from scipy import signal

    given = channel("values", values)
    rate = sampling_rate(time, given.size)
    at = _below_half(frequency, rate)
    sections = signal.butter(ORDER, at, fs=rate, output="sos")
    return _kept(given, signal.sosfiltfilt(sections, given, padlen=_padding(given.size, 3 / at * rate)))


def sampling_rate(time: npt.ArrayLike, size: int | None = None) -> float:
    """Return the sampling rate of an even clock [Hz]; times that do not rise, or are not even, are an InputError."""
    times = clock(time, size)
    steps = np.diff(times)
    if not steps.size:
        raise InputError("one sample has no sampling rate; expected more of them")
    middle = float(np.median(steps))
    worst = int(np.abs(steps - middle).argmax())
    if abs(steps[worst] - middle) > EVEN * middle:
        raise InputError(
            f"samples are {steps[worst]:.6g} s apart after {times[worst]:.9g} s, and {middle:.6g} s elsewhere; filters "
            "by frequency need an even clock: resample first (interval)"
        )
    return steps.size / float(times[-1] - times[0])


def find_hum(time: npt.ArrayLike, values: npt.ArrayLike, *, dead_band: float) -> tuple[Hum, ...]:
    """Return the periodic hum in a channel, the strongest first: lines that stand out of the spectrum of its noise.

    The spectrum is the mean over pieces of the branches between turns, each less a polynomial, so that the loops
    themselves leave no lines. Of such a mean over k pieces noise exceeds its median as Gamma's law says.

    Parameters
    ----------
    time : array_like (sample)
        [s]; where it is not even, or does not rise, nothing is found.
    values : array_like (sample)
    dead_band : float
        The smallest swing that is a reversal, in the unit of the channel.

    Raises
    ------
    InputError
        Missing or infinite samples.
    """
    given = channel("values", values)
    try:
        rate = sampling_rate(time, given.size)
    except InputError:
        return ()
    turns = np.concatenate([[0], reversals(given, dead_band), [given.size]])
    length = min(int(np.median(np.diff(turns)) * 0.8), _LONGEST_PIECE)
    if length < _LEAST_PIECE:
        return ()
    starts = [
        start
        for first, last in itertools.pairwise(turns.tolist())
        # the middle of a branch, in as many pieces as it has room for
        for start in range(first + (last - first - length) % length // 2, last - length + 1, length)
    ]
    pieces = np.stack([given[start : start + length] for start in starts])
    along = np.linspace(-1, 1, length)
    basis = np.linalg.qr(np.vander(along, _DETREND + 1))[0]
    window = np.hanning(length + 1)[:-1]
    spectrum = np.abs(np.fft.rfft((pieces - pieces @ basis @ basis.T) * window, axis=1)) ** 2
    # white noise of variance 1 has the mean 1; a line spreads over the lobe of the window alone
    power = spectrum[:, 2 * _DETREND : -1].mean(axis=0) / np.sum(window**2)
    lines = []
    for place in (1 + np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] > power[2:]))).tolist():
        if not _ASIDE <= place < power.size - 1:
            continue
        before, after = power[place - _ASIDE : place - _LOBE], power[place + _LOBE + 1 :][:_ASIDE]
        # on a slope the higher side counts, lest the bend of a branch be taken for a line
        floor = max(float(np.median(side)) for side in (before, after) if side.size)
        squared = 4 * float(np.sum(power[place - _LOBE : place + _LOBE + 1] - floor)) / length
        is_worth = squared / 2 > WORTH * 2 * float(power.sum()) / length
        if is_worth and squared > (_ROUNDING * np.ptp(given)) ** 2 and power[place] > floor * _most(power, len(pieces)):
            at = (2 * _DETREND + _between(power, place)) * rate / length
            lines.append(Hum(float(at), math.sqrt(squared)))
    return tuple(sorted(lines, key=lambda each: -each.amplitude))


def _most(power: Floats, pieces: int) -> float:
    """Return what a mean of the power of noise over so many pieces reaches by chance, over its median."""
    # scipy takes a quarter of a second to import, which most records do without: hardly a line is worth telling
    from scipy.special import gammainccinv, gammaincinv

    return float(gammainccinv(pieces, FALSE_ALARM / power.size) / gammaincinv(pieces, 0.5))


def _kept(given: Floats, left: Floats) -> Correction:
    return Correction(left, given - left)


def _below_half(frequency: float, rate: float) -> float:
    at = scalar("frequency", frequency, above=0)
    if at >= rate / 2:
        folded = abs(at - rate * round(at / rate))
        seen = f", where the samples show it at {folded:.4g} Hz" if folded > 0 else ""
        raise InputError(
            f"{at:g} Hz is beyond half of the sampling rate of {rate:.6g} Hz{seen}; expected a frequency below that"
        )
    return at


def _padding(size: int, samples: float) -> int:
    if size < 3:
        raise InputError(f"{size} samples; expected more of them for a filter")
    return min(math.ceil(samples), size - 1)


def _between(power: Floats, place: int) -> float:
    """Return the place of a peak between bins, by the parabola through three logarithms."""
    low, middle, high = np.log(np.maximum(power[place - 1 : place + 2], 1e-300))
    return place + float((low - high) / (low - 2 * middle + high)) / 2
