"""How friction runs in: the exponential that the windows of a record show, or why they show none.

README.md of this folder, "Sliding one way", says what decides.
"""

import math
import warnings
from collections.abc import Callable, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Floats
from historysim.measured.loop_table import CONFIDENCE
from historysim.measured.reduction import MEDIAN_OF_NORMAL

Decay = Callable[[Floats], Floats]

FEWEST_WINDOWS = 6
# Chances below which an exponential describes windows better than a constant, or than a line, by no accident.
CHANCE_OF_CONSTANT, CHANCE_OF_LINE = 1e-3, 1e-2
# Correlation of neighbouring windows, times the root of their number, from which on they stray together.
MOST_TOGETHER = 2.5
MOST_ALONE = 6.0  # deviations from which on a window strays alone
FINE = 0.01  # deviation of what is left over the height of the running-in, up to which no structure of it matters
# Squares of the scatter that another decay leaves less, from which on it describes the windows better.
CLEARLY_BETTER = 8.0
# Windows below which a length in which friction doubles is that in which the contact or the rig bends.
SHORT_START = 3.0
_MOST_CORRELATED = 0.97
_LENGTHS = 60


@attrs.frozen
class Approach:
    """μ(s) = steady + (start - steady) exp(-s/length), with intervals of 95 % confidence."""

    steady: float
    steady_low: float
    steady_high: float
    start: float  #: at the place of `origin` [1]
    start_low: float
    start_high: float
    length: float  #: A time [s] or a distance [m]
    length_low: float
    length_high: float
    origin: float  #: where s = 0: the static peak, or where sliding begins [s or m]
    #: Whether the record goes on for two lengths or more; else the steady value lies beyond what was measured.
    settled: bool = attrs.field(converter=bool)

    def at(self, place: ArrayLike) -> Floats:
        """Return μ at times [s] or distances [m]."""
        way = np.asarray(place, dtype=np.float64) - self.origin
        return _curve(way, self.steady, self.start, self.length)


def approach(along: Floats, friction: Floats, edges: Floats, starts: Sequence[float]) -> Approach | str:
    """Return the running-in from the first of the places from which there is one, or why there is none."""
    tries = [_approach_from(along, friction, edges, start) for start in starts]
    return next((found for found in tries if isinstance(found, Approach)), tries[0])


def _approach_from(along: Floats, friction: Floats, edges: Floats, origin: float) -> Approach | str:
    """Return the running-in that the windows behind a place [s or m] show, or why they show none."""
    from scipy import optimize, stats

    edges = edges[edges >= origin]
    if edges.size <= FEWEST_WINDOWS:
        return f"fewer than {FEWEST_WINDOWS} windows lie behind its start; use more windows"
    behind = along >= edges[0]
    unit = float(np.abs(friction[behind]).max())
    if unit == 0:
        return "the friction is 0"
    way, values, edges = along[behind] - origin, friction[behind] / unit, edges - origin
    place, whole = (edges[1:] + edges[:-1]) / 2, float(edges[-1])
    bounds = float(place[1] - place[0]), 100 * whole
    # no start that fits all records: the best of a scan of lengths is taken
    lengths = np.geomspace(*bounds, _LENGTHS)
    means = _middle_means(way, values, edges)
    for again in (True, False):
        _, guess = _least(_EXPONENTIAL, place, means, lengths)
        try:
            with warnings.catch_warnings():
                # where there is no decay, its length has no covariance
                warnings.simplefilter("ignore", optimize.OptimizeWarning)
                estimates, covariance = optimize.curve_fit(
                    _curve,
                    place,
                    means,
                    p0=guess,
                    bounds=([-np.inf, -np.inf, bounds[0]], [np.inf, np.inf, bounds[1]]),
                    x_scale=[1.0, 1.0, guess[2]],
                )
        except RuntimeError:
            return "no exponential describes the windows"
        if again:
            # what curves inside a window is taken off before its mean
            means = _curve(place, *estimates) + _middle_means(way, values - _curve(way, *estimates), edges)
    left = means - _curve(place, *estimates)
    square = max(float(left @ left), left.size * (8 * float(np.finfo(np.float64).eps)) ** 2)
    neighbours = float(left[1:] @ left[:-1]) / square
    correlation = float(np.clip(neighbours + 3 / left.size, 0.0, _MOST_CORRELATED))
    wider = (1 + correlation) / (1 - correlation)
    reach = float(stats.t.ppf((1 + CONFIDENCE) / 2, left.size - 3)) * np.sqrt(np.diag(covariance) * wider)
    each = np.stack([estimates, estimates - reach, estimates + reach], axis=1)
    each[2, 1] = max(each[2, 1], 0.0)
    each[:2] *= unit
    names = [f"{name}{end}" for name in ("steady", "start", "length") for end in ("", "_low", "_high")]
    numbers = dict(zip(names, each.ravel().tolist(), strict=True))
    found = Approach(origin=origin, settled=2 * float(estimates[2]) <= whole, **numbers)
    scatter = square / (left.size - 3) * wider
    return (
        _what_is_as_good(place, means, lengths, square, scatter)
        or _structure(found, unit * left, neighbours, bounds[0])
        or found
    )


def _middle_means(along: Floats, values: Floats, edges: Floats) -> Floats:
    """Return the mean of the middle half of the values in each window (window), which spikes do not pull.

    Each sample counts by its way along the place; a window without samples lies between its neighbours.
    """
    count = edges.size - 1
    window = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, count - 1)
    # the way that a sample stands for; one that rests stands for none
    weight = np.diff(along, prepend=along[0]) + np.diff(along, append=along[-1])
    order = np.lexsort((values, window))
    weight, window, values = weight[order], window[order], values[order]
    whole = np.bincount(window, weight, count)
    upper = np.cumsum(weight) - np.append(0.0, np.cumsum(whole))[window]
    part = np.minimum(upper, 0.75 * whole[window]) - np.maximum(upper - weight, 0.25 * whole[window])
    part = np.maximum(part, 0.0)
    held = np.bincount(window, part, count)
    known = held > 0
    middle = np.arange(count)
    return np.interp(middle, middle[known], np.bincount(window, part * values, count)[known] / held[known])


def _curve(way: Floats, steady: float, start: float, length: float) -> Floats:
    return np.asarray(steady + (start - steady) * np.exp(-way / length))


# decays over the way in lengths: the exponential, and two slower ones
_EXPONENTIAL: Decay = lambda way: np.exp(-way)  # noqa: E731 - a row of forms
_SLOWER: tuple[Decay, ...] = (lambda way: 1 / (1 + 10 * way), lambda way: np.exp(-np.sqrt(way)))


def _least(decay_of: Decay, place: Floats, means: Floats, lengths: Floats) -> tuple[float, tuple[float, float, float]]:
    """Return the least sum of squares beside a decay, and steady value, start and length of it."""
    # each line through the means over a decay, by its slope and its end at no decay
    decay = decay_of(place / lengths[:, None])
    across, up = decay - decay.mean(axis=1, keepdims=True), means - means.mean()
    slope = across @ up / np.sum(across**2, axis=1)
    squares = np.sum((up - slope[:, None] * across) ** 2, axis=1)
    best = int(squares.argmin())
    steady = float(means.mean() - slope[best] * decay[best].mean())
    return float(squares[best]), (steady, steady + float(slope[best]), float(lengths[best]))


def _what_is_as_good(place: Floats, means: Floats, lengths: Floats, square: float, scatter: float) -> str:
    """Return which simpler or other form describes the windows as well; nothing where none does."""
    from scipy import stats

    free = means.size - 3
    constant, line = (float(np.sum((means - np.polyval(np.polyfit(place, means, n), place)) ** 2)) for n in (0, 1))
    if stats.f.sf((constant - square) / 2 / scatter, 2, free) > CHANCE_OF_CONSTANT:
        return "an exponential describes the windows no better than a constant"
    if stats.f.sf((line - square) / scatter, 1, free) > CHANCE_OF_LINE:
        return "an exponential describes the windows no better than a straight line, which has no steady value"
    others = min(_least(decay, place, means, lengths)[0] for decay in _SLOWER)
    if square - others > CLEARLY_BETTER * scatter:
        return "a slower decay, 1/(1 + s/L) or exp(-√(s/L)), describes the windows better; it has another steady value"
    return ""


def _structure(found: Approach, left: Floats, neighbours: float, width: float) -> str:
    """Return why what is left beside an exponential has structure; nothing where it has none."""
    height, deviation = abs(found.start - found.steady), math.sqrt(float(left @ left) / left.size)
    if deviation > FINE * height:
        if neighbours * math.sqrt(left.size) > MOST_TOGETHER:
            share = f"{100 * deviation / height:.2g} % of its height"
            return f"neighbouring windows stray from an exponential together, by {share}"
        sizes = np.abs(left)
        if sizes.max() > MOST_ALONE * float(np.median(sizes)) / MEDIAN_OF_NORMAL:
            return f"a single window strays from an exponential by {sizes.max():.2g}: a picture (-o mu.png) shows it"
    if not math.isfinite(found.length_high):
        return "the windows do not determine its length"
    if found.start_low < 0 or (found.start < found.steady / 2 and found.length < SHORT_START * width):
        return "friction comes from 0 at its start, where contact and rig bend; cut the start of the record"
    return ""
