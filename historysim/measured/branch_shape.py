"""Shapes of branches: level as of friction, straight and rising as beside a spring, or elliptic as of a damper.

Each is judged by the median over the branches of a direction, so that no single one decides.
"""

import itertools
import math
from collections.abc import Iterator

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.measured.branches import Trace

BINS = 20  # places of a branch, evenly over its displacement
MOST_LOOPS = 48  # loops that are looked at, evenly along the record
FEWEST_OF_BRANCH = 10  # samples of a branch below which it has no shape
CLEAR = 3.0  # standard errors within which slopes are alike, and beyond which they are not
LEVEL = 0.05  # rise of the last quarter over the friction force up to which a branch is level
# Of a spring in parallel: how much slopes of both quarters and both directions may differ; and the least slope at the
# beginning over that behind it.
ALIKE, STEEPER = 0.1, 4.0
ELLIPSE, STRAIGHT = (
    0.04,
    0.05,
)  # deviation of half height and middle from ellipse and line, over the largest half height
# Exponents of energy and load over amplitude that are those of a spring with a damper, and how far apart they may be.
SQUARE, PROPORTIONAL, AS_POWER = 2.0, 1.0, 0.1


@attrs.frozen(eq=False)
class BranchShape:
    """The loads of branches of one direction over their displacement from the reversal, both in their own direction."""

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

    def slope(self, first: int, last: int) -> tuple[float, float]:
        """Return the slope between two bins [N/m], and its standard error; of a single branch that of its scatter."""
        u, f = self.moved[:, first:last], self.load[:, first:last]
        across = u - u.mean(axis=1, keepdims=True)
        slopes = (across * f).sum(axis=1) / (across**2).sum(axis=1)
        left = f - f.mean(axis=1, keepdims=True) - slopes[:, None] * across
        own = np.sqrt((left**2).sum(axis=1) / max(last - first - 2, 1) / (across**2).sum(axis=1))
        scatter = float(slopes.std(ddof=1)) if slopes.size > 1 else 0.0
        return float(np.median(slopes)), max(scatter, float(np.median(own))) / math.sqrt(slopes.size)

    @property
    def is_level(self) -> bool:
        """Whether its last quarter surely rises and falls by little, as where a contact slides."""
        slope, error = self.slope(3 * BINS // 4, BINS - 1)
        length = float(np.median(self.moved[:, -1])) / 4
        return self.force > 0 and (abs(slope) + CLEAR * error) * length < LEVEL * self.force


def shapes(trace: Trace, ends: Integers) -> tuple[BranchShape, BranchShape] | None:
    """Return the shapes of the forward and the backward branches of loops; None where they have too few samples."""
    chosen = np.unique(np.linspace(0, len(ends) - 1, min(len(ends), MOST_LOOPS)).astype(np.int64))
    sides: tuple[list[tuple[Floats, Floats]], list[tuple[Floats, Floats]]] = [], []
    for backward, moved, load in _branches(trace, ends[chosen]):
        sides[backward].append((moved, load))
    if not (sides[0] and sides[1]):
        return None
    forward, back = (BranchShape(*map(np.array, zip(*side, strict=True))) for side in sides)
    return forward, back


def _branches(trace: Trace, ends: Integers) -> Iterator[tuple[bool, Floats, Floats]]:
    """Yield whether a branch leads backward, its displacements and its loads (bin)."""
    middles = (np.arange(BINS) + 0.5) / BINS
    for first, last in itertools.chain.from_iterable(map(itertools.pairwise, ends.tolist())):
        part = slice(first, last + 1)
        way = trace.displacement[last] - trace.displacement[first]
        share, load = (trace.displacement[part] - trace.displacement[first]) / way, trace.tangential_load[part]
        own = -load if way < 0 else load
        number = np.clip((share * BINS).astype(np.int64), 0, BINS - 1)
        count = np.bincount(number, minlength=BINS)
        if share.size < FEWEST_OF_BRANCH:
            continue
        known = count > 0
        places, loads = (np.bincount(number, values, BINS)[known] / count[known] for values in (share, own))
        yield bool(way < 0), middles * abs(way), np.interp(middles, places, loads)


def are_level(trace: Trace, ends: Integers) -> bool:
    """Return whether the branches of loops surely end level in both directions."""
    both = shapes(trace, ends) if len(ends) else None
    return both is not None and all(each.is_level for each in both)


def parallel_stiffness(trace: Trace, ends: Integers) -> float:
    """Return the stiffness of a spring beside the contact that branches show [N/m]; NaN where they show none.

    Their second half is straight and rises alike in both directions, and their beginning is much steeper: a contact
    that comes to slide bends all the way.
    """
    both = shapes(trace, ends) if len(ends) else None
    if both is None:
        return math.nan
    slopes = [each.slope(first, last) for each in both for first, last in ((BINS // 2, 3 * BINS // 4), (15, BINS - 1))]
    middle = float(np.mean([slope for slope, _ in slopes]))
    rises = middle * float(np.median(both[0].moved[:, -1])) / 4 > LEVEL * abs(both[0].force)
    alike = all(
        abs(slope - middle) <= ALIKE * middle and CLEAR * error <= 2 * ALIKE * middle for slope, error in slopes
    )
    if not (rises and alike):
        return math.nan
    for each in both:
        steepest = float(
            np.max((each.median[2:] - each.median[:-2]) / np.median(each.moved[:, 2:] - each.moved[:, :-2]))
        )
        if steepest < STEEPER * middle:
            return math.nan
    return middle


def is_ellipse(trace: Trace, ends: Integers) -> bool:
    """Return whether loops are ellipses: their branches fall before they end, and are highest in the middle."""
    both = shapes(trace, ends)
    if both is None:
        return False
    forward, back = both[0].median, both[1].median[::-1]
    height, middle = (forward + back) / 2, (forward - back) / 2
    place = (2 * np.arange(BINS) + 1) / BINS - 1
    arc = np.sqrt(1 - place**2)
    greatest = float(height @ arc / (arc @ arc))
    off = height - greatest * arc
    bent = middle - np.polyval(np.polyfit(place, middle, 1), place)
    if greatest <= 0:
        return False
    return bool(np.sqrt(np.mean(off**2)) < ELLIPSE * greatest and np.sqrt(np.mean(bent**2)) < STRAIGHT * greatest)


def goes_with_the_square(amplitude: Floats, load: Floats, energy: Floats) -> bool:
    """Return whether energies go with the square of amplitudes, and loads with these, from each of three or more on."""
    if amplitude.size < 3 or not (energy > 0).all() or not (load > 0).all():
        return False
    way = np.diff(np.log(amplitude))
    squares, proportions = (np.diff(np.log(each)) / way for each in (energy, load))
    return bool(
        (np.abs(squares - SQUARE) < AS_POWER).all() and (np.abs(proportions - PROPORTIONAL) < AS_POWER / 2).all()
    )
