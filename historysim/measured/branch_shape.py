"""Shapes of branches: level by friction, rising by a spring in parallel, or elliptic by a damper.

Each is judged by the median over the branches of a direction, so that no single one decides.
"""

import itertools
import math
from collections.abc import Iterator

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.measured.branches import Branch, Trace
from historysim.measured.reduction import estimate_white_noise

BINS = 20  # places of a branch, evenly over its displacement
MOST_LOOPS = 48  # loops that are looked at, evenly along the record
FEWEST_OF_BRANCH = 10  # samples of a branch below which it has no shape
CLEAR = 3.0  # standard errors within which slopes are alike, and beyond which they are not
LEVEL = 0.05  # rise of the last quarter over the friction force up to which a branch is level
# Of a spring in parallel: how much slopes of both quarters and both directions may differ; and the
# least slope at the beginning over that behind it.
ALIKE, STEEPER = 0.1, 4.0
ELLIPSE, STRAIGHT = (
    0.04,
    0.05,
)  # deviation of half height and middle from ellipse and line, over the largest half height
# Exponents of energy and load over amplitude that are those of a spring with a damper, and how far
# apart they may be.
SQUARE, PROPORTIONAL, AS_POWER = 2.0, 1.0, 0.1
# Of branches that rise again: least rise at their end over the load of the level part, and in a
# record with such branches that of others; largest tilt of the level part over its load; and its
# fewest bins.
HOOK, OTHER_HOOK, TILT, FEWEST_LEVEL = 0.1, 0.02, 0.03, 3


@attrs.frozen(eq=False)
class BranchShape:
    """Loads of branches of one direction over their displacement from the reversal, in that direction."""

    moved: Floats  #: (branch, bin) [m]
    load: Floats  #: (branch, bin) [N]

    @property
    def median(self) -> Floats:
        """Load of the middle branch (bin) [N]."""
        return np.asarray(np.median(self.load, axis=0))

    @property
    def force(self) -> float:
        """Mean load over the last quarter [N]."""
        return float(self.median[3 * BINS // 4 :].mean())

    def slope(self, start: int, stop: int) -> tuple[float, float]:
        """Return the slope between two bins [N/m] and its standard error, by scatter for a single branch."""
        u = self.moved[:, start:stop]
        f = self.load[:, start:stop]
        across = u - u.mean(axis=1, keepdims=True)
        slopes = (across * f).sum(axis=1) / (across**2).sum(axis=1)
        residuals = f - f.mean(axis=1, keepdims=True) - slopes[:, None] * across
        errors = np.sqrt(
            (residuals**2).sum(axis=1) / max(stop - start - 2, 1) / (across**2).sum(axis=1)
        )
        scatter = float(slopes.std(ddof=1)) if slopes.size > 1 else 0.0
        return float(np.median(slopes)), max(scatter, float(np.median(errors))) / math.sqrt(
            slopes.size
        )

    @property
    def is_level(self) -> bool:
        """True if the last quarter rises or falls by little beyond doubt, as in sliding."""
        slope, error = self.slope(3 * BINS // 4, BINS - 1)
        length = float(np.median(self.moved[:, -1])) / 4
        return self.force > 0 and (abs(slope) + CLEAR * error) * length < LEVEL * self.force


def average_branches(trace: Trace, ends: Integers) -> tuple[BranchShape, BranchShape] | None:
    """Average the forward and the backward branches of loops; None if samples are too few."""
    chosen = np.unique(np.linspace(0, len(ends) - 1, min(len(ends), MOST_LOOPS)).astype(np.int64))
    sides: tuple[list[tuple[Floats, Floats]], list[tuple[Floats, Floats]]] = [], []
    for backward, moved, load in _branches(trace, ends[chosen]):
        sides[backward].append((moved, load))
    if not (sides[0] and sides[1]):
        return None
    forward, back = (BranchShape(*map(np.array, zip(*side, strict=True))) for side in sides)
    return forward, back


def _branches(trace: Trace, ends: Integers) -> Iterator[tuple[bool, Floats, Floats]]:
    """Yield direction (True for backward), displacements and loads (bin) of each branch."""
    for start, stop in itertools.chain.from_iterable(map(itertools.pairwise, ends.tolist())):
        if stop - start + 1 >= FEWEST_OF_BRANCH:
            branch = Branch.from_trace(trace, start, stop)
            stroke = branch.moved[-1]
            yield (
                branch.sign < 0,
                (np.arange(BINS) + 0.5) / BINS * stroke,
                _bin_means(branch.moved / stroke, branch.load, BINS),
            )


def _bin_means(fraction: Floats, values: Floats, size: int) -> Floats:
    """Return the mean of values in each bin of the displacement (bin), straight between bins with samples."""
    bins = np.clip((fraction * size).astype(np.int64), 0, size - 1)
    count = np.bincount(bins, minlength=size)
    filled = count > 0
    positions, means = (
        np.bincount(bins, channel, size)[filled] / count[filled] for channel in (fraction, values)
    )
    return np.interp((np.arange(size) + 0.5) / size, positions, means)


def are_level(trace: Trace, ends: Integers) -> bool:
    """Return True if the branches of loops end level in both directions beyond doubt."""
    both = average_branches(trace, ends) if len(ends) else None
    return both is not None and all(shape.is_level for shape in both)


def find_parallel_stiffness(trace: Trace, ends: Integers) -> float:
    """Return the stiffness of a spring in parallel with the contact [N/m]; NaN if branches show none.

    Their second half is straight and rises alike in both directions, and their beginning is much
    steeper: a contact that comes to slide bends all the way.
    """
    both = average_branches(trace, ends) if len(ends) else None
    if both is None:
        return math.nan
    slopes = [
        shape.slope(start, stop)
        for shape in both
        for start, stop in ((BINS // 2, 3 * BINS // 4), (15, BINS - 1))
    ]
    middle = float(np.mean([slope for slope, _ in slopes]))
    rises = middle * float(np.median(both[0].moved[:, -1])) / 4 > LEVEL * abs(both[0].force)
    alike = all(
        abs(slope - middle) <= ALIKE * middle and CLEAR * error <= 2 * ALIKE * middle
        for slope, error in slopes
    )
    if not (rises and alike):
        return math.nan
    for shape in both:
        steepest = float(
            np.max(
                (shape.median[2:] - shape.median[:-2])
                / np.median(shape.moved[:, 2:] - shape.moved[:, :-2])
            )
        )
        if steepest < STEEPER * middle:
            return math.nan
    return middle


def find_level_parts(trace: Trace, ends: Integers) -> Floats:
    """Return where branches are level before their load rises again at a stop (loop, branch, 2).

    Begin and end are fractions of the displacement; NaN for branches that do not rise again, which
    are all where a single one of many does.
    """
    parts = np.full((len(ends), 2, 2), math.nan)
    chosen = np.unique(np.linspace(0, len(ends) - 1, min(len(ends), MOST_LOOPS)).astype(np.int64))
    rises = np.zeros((len(ends), 2))
    for loops in (chosen, np.setdiff1d(np.arange(len(ends)), chosen)):
        for loop, branch in itertools.product(loops.tolist(), (0, 1)):
            *part, rises[loop, branch] = _level_part(
                trace, *ends[loop, branch : branch + 2].tolist()
            )
            parts[loop, branch] = part
        if (rises > HOOK).sum() < min(len(ends), 2):
            return np.full_like(parts, math.nan)
    parts[rises <= OTHER_HOOK] = math.nan
    return parts


def _level_part(trace: Trace, start: int, stop: int) -> tuple[float, float, float]:
    """Return begin and end of the widest level part of a branch, and the rise behind it over its load; 0 if unclear."""
    nothing = math.nan, math.nan, 0.0
    if stop - start + 1 < FEWEST_OF_BRANCH:
        return nothing
    branch = Branch.from_trace(trace, start, stop)
    load = branch.load
    fraction = branch.moved / branch.moved[-1]
    bins = BINS if fraction.size < 4 * BINS else 2 * BINS
    relative = np.ones(bins)
    if branch.normal_load is not None and (branch.normal_load > 0).all():
        # friction that follows the normal load is no stop
        relative = _bin_means(fraction, branch.normal_load, bins)
        relative /= relative.mean()
    loads = _bin_means(fraction, load, bins) / relative
    last = np.sort(load[fraction >= 1 - 1 / BINS])
    # without its greatest sample, which may be a spike
    end = float((last[:-1] if last.size > 2 else last).mean()) / relative[-1]
    noise = estimate_white_noise(loads)
    for width in range(bins - 2, FEWEST_LEVEL - 1, -1):
        windows = np.lib.stride_tricks.sliding_window_view(loads[1:-1], width)
        position = np.arange(width) - (width - 1) / 2
        means = windows.mean(axis=1)
        slopes = windows @ position / (position @ position)
        level = (means > 0) & (np.abs(slopes) * (width - 1) < TILT * means)
        if not level.any():
            continue
        first = int(np.argmin(np.where(level, np.abs(slopes), math.inf)))
        mean = float(means[first])
        slope = float(slopes[first])
        residuals = windows[first] - mean - slope * position
        scatter = max(math.sqrt(float(residuals @ residuals) / (width - 2)), noise)
        distance = bins - 2 - first - (width - 1) / 2
        rise = end - mean - max(slope, 0.0) * distance
        error = scatter * math.sqrt(1 + 1 / width + distance**2 / float(position @ position))
        return (
            (first + 1) / bins,
            (first + 1 + width) / bins,
            rise / mean if rise > CLEAR * error else 0.0,
        )
    return nothing


def is_ellipse(trace: Trace, ends: Integers) -> bool:
    """Return True if loops are ellipses: branches fall before they end, and are highest in the middle."""
    both = average_branches(trace, ends)
    if both is None:
        return False
    forward = both[0].median
    back = both[1].median[::-1]
    height = (forward + back) / 2
    middle = (forward - back) / 2
    position = (2 * np.arange(BINS) + 1) / BINS - 1
    arc = np.sqrt(1 - position**2)
    greatest = float(height @ arc / (arc @ arc))
    height_error = height - greatest * arc
    middle_error = middle - np.polyval(np.polyfit(position, middle, 1), position)
    if greatest <= 0:
        return False
    return bool(
        np.sqrt(np.mean(height_error**2)) < ELLIPSE * greatest
        and np.sqrt(np.mean(middle_error**2)) < STRAIGHT * greatest
    )


def has_quadratic_energy(amplitude: Floats, load: Floats, energy: Floats) -> bool:
    """Return True if energy is proportional to amplitude squared, and load to amplitude, for three or more."""
    if amplitude.size < 3 or not (energy > 0).all() or not (load > 0).all():
        return False
    steps = np.diff(np.log(amplitude))
    squares, proportions = (np.diff(np.log(values)) / steps for values in (energy, load))
    return bool(
        (np.abs(squares - SQUARE) < AS_POWER).all()
        and (np.abs(proportions - PROPORTIONAL) < AS_POWER / 2).all()
    )
