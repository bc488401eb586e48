"""From a table of a normal curve to what the memory replays: knots, between which the stiffness dP/da goes straight.

The load P is then a parabola between two knots, and convex wherever the stiffness rises: a flat punch is one knot, with
its stiffness there at once. A table that is convex is met exactly at its rows. One that noise makes otherwise gets the
convex curve that is nearest to it (a monotone regression of the stiffness), with as much noise as is given, or as the
differences of neighbouring rows show.
"""

import math
from typing import NamedTuple

import numpy as np

from historysim.basics.arguments import Floats

HALVINGS = 12  # rows below the first one of a table, each at half the approach of the next one
ROUNDING = 1e-9  # fall of the stiffness, relatively, that is taken for rounding of the table
MOST_ROWS = 600  # rows of a table that is met exactly; a longer one is a measurement
MOST_NODES = 120  # places where the stiffness of a measured curve may change its slope
# Tables with other noise that the uncertainty of a measured curve is taken from: the worst of them.
REPLICAS, SEED = 40, 1

LEFT_OUT = 3  # one of so many rows is kept to see what the others say of the error between rows
UNKNOWN = 0.25  # part of the triangle before the first row that a power of the approach may be off by there
# Misfit over the noise from which it is none, but a bend that the nodes of a measured curve cannot follow.
DEVIATIONS = 4.0


class Knots(NamedTuple):
    """A curve P(a) that rises and is convex: knots [m], and the stiffness there [N/m]."""

    label: Floats
    stiffness: Floats

    def loads(self, approach: Floats) -> Floats:
        """Return P at approaches [N]."""
        rise = np.append(0.0, np.cumsum(np.diff(self.label) * 0.5 * (self.stiffness[1:] + self.stiffness[:-1])))
        # a jump of the stiffness is two knots at one place
        bend = np.append(np.diff(self.stiffness) / np.maximum(np.diff(self.label), 1e-300), 0.0)
        index = np.clip(np.searchsorted(self.label, approach, side="left") - 1, 0, self.label.size - 1)
        x = np.clip(approach - self.label[index], 0.0, None)
        found: Floats = rise[index] + x * (self.stiffness[index] + 0.5 * bend[index] * x)
        return found


def hertzian(approach: Floats, load: Floats) -> float | None:
    """Return k of P = k a^(3/2) [N/m^1.5], which a table is to rounding; None where it is not."""
    constant = load / approach**1.5
    return float(constant[-1]) if np.ptp(constant) < ROUNDING * constant[-1] else None


def is_convex(approach: Floats, load: Floats) -> bool:
    """Return whether a table, which begins at first touch, is convex to rounding."""
    secant = np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0)
    return bool((np.diff(secant) >= -ROUNDING * secant[1:]).all())


def through(approach: Floats, load: Floats, stiffness: Floats | None = None) -> Knots:
    """Return the curve that meets a convex table at its rows.

    Between two rows there is one knot more, which is where the stiffnesses at the rows, and the load between them,
    want it (Schumaker 1983). Below the first row the load is a power of the approach.

    The stiffness dP/da just before rows [N/m] is NaN where it is not known, and P is then straight up to the first; by
    default it follows from three rows each.
    """
    from scipy.optimize import isotonic_regression

    if stiffness is None:
        below = 0.5 ** np.arange(HALVINGS, 0, -1)
        exponent = _first_exponent(approach, load)
        nodes = np.concatenate([approach[0] * below, approach])
        loads = np.concatenate([load[0] * below**exponent, load])
        slope = _slopes(nodes, loads)
    else:
        nodes, loads = approach, load
        unknown = np.isnan(stiffness)
        slope = np.where(unknown, _slopes(approach, load), stiffness) if unknown.any() else stiffness
    secant = np.diff(loads, prepend=0.0) / np.diff(nodes, prepend=0.0)
    # to rounding, or to what solutions leave, it rises
    secant = isotonic_regression(secant, weights=np.diff(nodes, prepend=0.0)).x
    above = np.append(secant[1:], np.inf)
    slope = np.append(max(2 * secant[0] - min(slope[0], above[0]), 0.0), np.clip(slope, secant, above))
    return _joined(np.append(0.0, nodes), secant, slope)


def _first_exponent(approach: Floats, load: Floats) -> float:
    """Return the power of the approach that the load is before the first row, by the three rows that follow."""
    x, y = np.log(approach[:3]), np.log(load[:3])
    slopes = np.diff(y) / np.diff(x)
    at_first = slopes[0] - (slopes[1] - slopes[0]) * (x[1] - x[0]) / (x[2] - x[0])
    steepest = (load[1] - load[0]) / (approach[1] - approach[0]) * approach[0] / load[0]
    return float(np.clip(at_first, 1.0, max(steepest, 1.0)))


def _slopes(approach: Floats, load: Floats) -> Floats:
    """Return dP/da at rows, by powers of the approach through three of them."""
    x, y = np.log(approach), np.log(load)
    width, rise = np.diff(x), np.diff(y) / np.diff(x)
    inner = (rise[:-1] * width[1:] + rise[1:] * width[:-1]) / (width[:-1] + width[1:])
    ends = rise[0] - (inner[0] - rise[0]), rise[-1] + (rise[-1] - inner[-1])
    exponent = np.concatenate([ends[:1], inner, ends[1:]])
    found: Floats = exponent * load / approach
    return found


def _joined(nodes: Floats, secant: Floats, slope: Floats) -> Knots:
    """Return knots with these stiffnesses at nodes and loads that rise as the secants say."""
    low, high, width = slope[:-1], slope[1:], np.diff(nodes)
    middle = 2 * secant - 0.5 * (low + high)
    # where the middle is no place for the knot: the stiffness there is that of one end
    late, early = middle < low, middle > high
    part = np.full(width.size, 0.5)
    rise = np.where(high > low, high - low, 1.0)
    part[late] = 1 - 2 * ((secant - low) / rise)[late]
    part[early] = 2 * ((high - secant) / rise)[early]
    # a jump is one at one place, to the bit
    part = np.where(part < ROUNDING, 0.0, np.where(part > 1 - ROUNDING, 1.0, part))
    middle = np.clip(np.where(late, low, np.where(early, high, middle)), low, high)
    inner = np.where(part == 1.0, nodes[1:], nodes[:-1] + part * width)
    label = np.column_stack([nodes[:-1], inner]).ravel()
    stiffness = np.column_stack([low, middle]).ravel()
    label, stiffness = np.append(label, nodes[-1]), np.append(stiffness, slope[-1])
    # knots that nothing happens at
    kept = np.append(True, (np.diff(label) > 0) | (np.diff(stiffness) > 0))
    return Knots(label[kept], np.maximum.accumulate(stiffness[kept]))


def estimated_noise(approach: Floats, load: Floats) -> Floats:
    """Return the standard deviation of the noise of each row [N] that differences of neighbouring rows show.

    A part of it is the same everywhere, the other in proportion to the load (Gasser, Sroka and Jennen-Steinmetz 1986).
    """
    from scipy.optimize import nnls

    a, p = np.append(0.0, approach), np.append(0.0, load)
    part = (a[2:] - a[1:-1]) / (a[2:] - a[:-2])
    square = (p[1:-1] - part * p[:-2] - (1 - part) * p[2:]) ** 2 / (1 + part**2 + (1 - part) ** 2)
    terms = np.column_stack([np.ones(square.size), (p[1:-1] / p.max()) ** 2])
    variance = np.full(square.size, square.mean() or 1e-300)
    for _ in range(5):
        found = nnls(terms / variance[:, None], square / variance)[0]
        variance = np.maximum(terms @ found, 1e-6 * square.mean() + 1e-300)
    noise: Floats = np.sqrt(np.maximum(found[0] + found[1] * (load / p.max()) ** 2, 1e-6 * square.mean()))
    return noise


class Regression:
    """Convex curves nearest to noisy tables of the same approaches [m], with deviations of the loads > 0 [N] (row)."""

    def __init__(self, approach: Floats, noise: Floats) -> None:
        count = min(MOST_NODES, 2 * approach.size)
        even = np.quantile(approach, np.linspace(0, 1, count - count // 4))
        first = even[0] * 0.5 ** np.arange(count // 4, -1, -1)
        self.nodes = np.unique(np.concatenate([[0.0], first, even]))
        width = np.diff(self.nodes)
        x = np.clip(approach[:, None] - self.nodes[:-1], 0.0, None)
        # a stiffness that rises from 0 to 1 between two nodes, and one that is there from first touch on
        ramps = np.where(x < width, 0.5 * x**2 / width, x - 0.5 * width)
        self._basis = np.column_stack([approach, ramps])
        self._approach, self._noise = approach, noise
        self._columns, self._triangle = np.linalg.qr(self._basis / noise[:, None])
        self._size = np.linalg.norm(self._triangle, axis=0)

    def of(self, load: Floats) -> Knots:
        """Return the curve of loads (row) [N]."""
        from scipy.optimize import nnls

        wanted = self._columns.T @ (load / self._noise)
        steps = nnls(self._triangle / self._size, wanted, maxiter=100 * self._size.size)[0] / self._size
        return Knots(self.nodes, np.cumsum(steps))

    def error(self, load: Floats) -> float:
        """Return what the curve of loads (row) may be off by [N].

        That is the worst of `REPLICAS` tables with other noise, the error between rows, and what is beyond the noise.
        """
        curve = self.of(load)
        at_nodes, at_rows, rng = curve.loads(self.nodes), curve.loads(self._approach), np.random.default_rng(SEED)
        tables = at_rows + self._noise * rng.normal(size=(REPLICAS, load.size))
        drawn = [float(np.abs(self.of(table).loads(self.nodes) - at_nodes).max()) for table in tables]
        beyond = float(np.max(np.abs(at_rows - load) - DEVIATIONS * self._noise, initial=0.0))
        # the noise of few rows is not well known either
        spread = max(drawn) * (1.0 + 2.0 / math.sqrt(load.size))
        return spread + float(_triangles(self._approach, at_rows).max()) + beyond


def error_between(approach: Floats, load: Floats, *, straight: bool = False) -> float:
    """Return the largest error between the rows of a convex table [N].

    Up to the first row the load may be known to be straight.
    """
    # every third row is kept, in turn, and the differences at the others are taken; between all rows they are smaller.
    # No convex curve through the rows differs by more than the triangles between their secants let it
    height = _triangles(approach, load)
    height[0] *= not straight
    if approach.size < LEFT_OUT * LEFT_OUT:
        return float(height.max())
    # one row alone shows the first touch
    found = float(height[0]) * UNKNOWN
    for start in range(LEFT_OUT):
        kept = np.zeros(approach.size, dtype=bool)
        kept[start::LEFT_OUT] = kept[-1] = True
        left_out = through(approach[kept], load[kept]).loads(approach[~kept])
        found = max(found, float(np.abs(left_out - load[~kept]).max()))
    return min(found, float(height.max()))


def _triangles(approach: Floats, load: Floats) -> Floats:
    """Return how high the triangles are in which a convex curve through rows lies, one before each row [N]."""
    width, secant = np.diff(approach, prepend=0.0), np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0)
    before, after = np.append(0.0, secant[:-1]), np.append(secant[1:], np.inf)
    below = (secant - before) * width
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.where(after > before, below * (after - secant) / (after - before), 0.0)
    height[-1] = below[-1]
    return height
