"""Running-in of friction: the exponential approach to a steady value that the windows of a record show."""

import math
import warnings
from collections.abc import Callable, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Floats
from historysim.measured.intervals import student_factor
from historysim.measured.loop_table import CONFIDENCE
from historysim.measured.reduction import (
    deviation_by_median,
)

Decay = Callable[[Floats], Floats]
FEWEST_WINDOWS = 6
# Chances below which an exponential describes windows better than a constant, or than a line, by no
# accident.
CHANCE_OF_CONSTANT, CHANCE_OF_LINE = 1e-3, 1e-2
# Correlation of neighbouring windows, times the root of their number, from which on they stray
# together.
MOST_TOGETHER = 2.5
MOST_ALONE = 6.0  # deviations from which on a window strays alone
# deviation of the residuals over the height of the running-in, up to which no structure of it
# matters
FINE = 0.01
# Squares of the scatter that another decay leaves less, from which on it describes the windows
# better.
CLEARLY_BETTER = 8.0
# Windows below which a length in which friction doubles is that in which the contact or the rig
# bends.
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
    #: Whether the record covers two lengths or more; else the steady value is beyond the measured
    #: range.
    settled: bool = attrs.field(converter=bool)

    def at(self, place: ArrayLike) -> Floats:
        """Return μ at times [s] or distances [m]."""
        distance = np.asarray(place, dtype=np.float64) - self.origin
        return _curve(distance, self.steady, self.start, self.length)


def select_approach(
    along: Floats, friction: Floats, edges: Floats, starts: Sequence[float]
) -> Approach | str:
    """Return the running-in from the first of the places from which there is one, or why there is none."""
    tries = [_fit_approach(along, friction, edges, start) for start in starts]
    return next((result for result in tries if isinstance(result, Approach)), tries[0])


def _fit_approach(along: Floats, friction: Floats, edges: Floats, origin: float) -> Approach | str:
    """Return the running-in that the windows behind a place [s or m] show, or why they show none."""
    from scipy import optimize

    edges = edges[edges >= origin]
    if edges.size <= FEWEST_WINDOWS:
        return f"fewer than {FEWEST_WINDOWS} windows lie behind its start; use more windows"
    behind = along >= edges[0]
    unit = float(np.abs(friction[behind]).max())
    if unit == 0:
        return "the friction is 0"
    distance = along[behind] - origin
    values = friction[behind] / unit
    edges = edges - origin
    centres = (edges[1:] + edges[:-1]) / 2
    length = float(edges[-1])
    bounds = float(centres[1] - centres[0]), 100 * length
    # no start that fits all records: the best of a scan of lengths is taken
    lengths = np.geomspace(*bounds, _LENGTHS)
    means = _middle_means(distance, values, edges)
    for again in (True, False):
        _, guess = _least(_EXPONENTIAL, centres, means, lengths)
        try:
            with warnings.catch_warnings():
                # where there is no decay, its length has no covariance
                warnings.simplefilter("ignore", optimize.OptimizeWarning)
                estimates, covariance = optimize.curve_fit(
                    _curve,
                    centres,
                    means,
                    p0=guess,
                    bounds=([-np.inf, -np.inf, bounds[0]], [np.inf, np.inf, bounds[1]]),
                    x_scale=[1.0, 1.0, guess[2]],
                )
        except RuntimeError:
            return "no exponential describes the windows"
        if again:
            # what curves inside a window is taken off before its mean
            means = _curve(centres, *estimates) + _middle_means(
                distance, values - _curve(distance, *estimates), edges
            )
    residuals = means - _curve(centres, *estimates)
    square = max(
        float(residuals @ residuals), residuals.size * (8 * float(np.finfo(np.float64).eps)) ** 2
    )
    neighbours = float(residuals[1:] @ residuals[:-1]) / square
    correlation = float(np.clip(neighbours + 3 / residuals.size, 0.0, _MOST_CORRELATED))
    wider = (1 + correlation) / (1 - correlation)
    reach = student_factor(residuals.size - 3, CONFIDENCE) * np.sqrt(np.diag(covariance) * wider)
    bounds_of_estimates = np.stack([estimates, estimates - reach, estimates + reach], axis=1)
    bounds_of_estimates[2, 1] = max(bounds_of_estimates[2, 1], 0.0)
    bounds_of_estimates[:2] *= unit
    names = [
        f"{name}{suffix}"
        for name in ("steady", "start", "length")
        for suffix in ("", "_low", "_high")
    ]
    numbers = dict(zip(names, bounds_of_estimates.ravel().tolist(), strict=True))
    approach = Approach(origin=origin, settled=2 * float(estimates[2]) <= length, **numbers)
    scatter = square / (residuals.size - 3) * wider
    return (
        _find_simpler_form(centres, means, lengths, square, scatter)
        or _structure(approach, unit * residuals, neighbours, bounds[0])
        or approach
    )


def _middle_means(along: Floats, values: Floats, edges: Floats) -> Floats:
    """Return the mean of the middle half of the values in each window (window), which spikes do not pull.

    Each sample counts by its way along the place; a window without samples is interpolated.
    """
    count = edges.size - 1
    window = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, count - 1)
    # the distance that a sample represents; a sample at rest represents none
    weight = np.diff(along, prepend=along[0]) + np.diff(along, append=along[-1])
    order = np.lexsort((values, window))
    weight = weight[order]
    window = window[order]
    values = values[order]
    total = np.bincount(window, weight, count)
    upper = np.cumsum(weight) - np.append(0.0, np.cumsum(total))[window]
    inside = np.minimum(upper, 0.75 * total[window]) - np.maximum(
        upper - weight, 0.25 * total[window]
    )
    inside = np.maximum(inside, 0.0)
    held = np.bincount(window, inside, count)
    filled = held > 0
    middle = np.arange(count)
    return np.interp(
        middle, middle[filled], np.bincount(window, inside * values, count)[filled] / held[filled]
    )


def _curve(distance: Floats, steady: float, start: float, length: float) -> Floats:
    return np.asarray(steady + (start - steady) * np.exp(-distance / length))


# decays over the way in lengths: the exponential, and two slower ones
_EXPONENTIAL: Decay = lambda distance: np.exp(-distance)  # noqa: E731 - a row of forms
_SLOWER: tuple[Decay, ...] = (
    lambda distance: 1 / (1 + 10 * distance),
    lambda distance: np.exp(-np.sqrt(distance)),
)


def _least(
    decay_of: Decay, centres: Floats, means: Floats, lengths: Floats
) -> tuple[float, tuple[float, float, float]]:
    """Fit a decay: return the least sum of squares, and the steady value, start and length of the decay."""
    # each line through the means over a decay, by its slope and its end at no decay
    decay = decay_of(centres / lengths[:, None])
    across = decay - decay.mean(axis=1, keepdims=True)
    up = means - means.mean()
    slope = across @ up / np.sum(across**2, axis=1)
    squares = np.sum((up - slope[:, None] * across) ** 2, axis=1)
    best = int(squares.argmin())
    steady = float(means.mean() - slope[best] * decay[best].mean())
    return float(squares[best]), (steady, steady + float(slope[best]), float(lengths[best]))


def _find_simpler_form(
    centres: Floats, means: Floats, lengths: Floats, square: float, scatter: float
) -> str:
    """Return which simpler or other form describes the windows as well; nothing where none does."""
    from scipy.special import fdtrc

    free = means.size - 3
    constant, line = (
        float(np.sum((means - np.polyval(np.polyfit(centres, means, n), centres)) ** 2))
        for n in (0, 1)
    )
    if fdtrc(2, free, max(constant - square, 0.0) / 2 / scatter) > CHANCE_OF_CONSTANT:
        return "an exponential describes the windows no better than a constant"
    if fdtrc(1, free, max(line - square, 0.0) / scatter) > CHANCE_OF_LINE:
        return "an exponential describes the windows no better than a straight line, which has no steady value"
    slower = min(_least(decay, centres, means, lengths)[0] for decay in _SLOWER)
    if square - slower > CLEARLY_BETTER * scatter:
        return "a slower decay, 1/(1 + s/L) or exp(-√(s/L)), describes the windows better; it has another steady value"
    return ""


def _structure(approach: Approach, residuals: Floats, neighbours: float, width: float) -> str:
    """Return a description of structure in the residuals of an exponential; empty if there is none."""
    height = abs(approach.start - approach.steady)
    deviation = math.sqrt(float(residuals @ residuals) / residuals.size)
    if deviation > FINE * height:
        if neighbours * math.sqrt(residuals.size) > MOST_TOGETHER:
            share = f"{100 * deviation / height:.2g} % of its height"
            return f"neighbouring windows stray from an exponential together, by {share}"
        sizes = np.abs(residuals)
        if sizes.max() > MOST_ALONE * deviation_by_median(residuals):
            return f"a single window strays from an exponential by {sizes.max():.2g}: a picture (-o mu.png) shows it"
    if not math.isfinite(approach.length_high):
        return "the windows do not determine its length"
    if approach.start_low < 0 or (
        approach.start < approach.steady / 2 and approach.length < SHORT_START * width
    ):
        return "friction comes from 0 at its start, where contact and rig bend; cut the start of the record"
    return ""
