"""Convex curves through, or near, the rows of a table: knots with a stiffness, and their error."""

import math
from typing import NamedTuple

import numpy as np

from historysim.basics.arguments import Floats

HALVINGS = 12  # rows added before the first row of a table, each at half the approach of the next
# relative rounding error: of a decrease of the stiffness, of a path beyond the table
ROUNDING = 1e-9
# largest number of approaches at which the stiffness of a measured curve may change its slope
MOST_NODES = 120
# Number of tables with simulated noise, the worst of which gives the uncertainty of a measured
# curve.
REPLICAS, SEED = 40, 1
# one of this number of rows is retained when the error between rows is estimated by
# cross-validation
LEFT_OUT = 3
UNKNOWN = 0.25  # error of a power law before the first row, relative to the triangle that bounds it
# Residual over the noise above which it is a bend that the nodes of a measured curve cannot follow.
DEVIATIONS = 4.0


class Knots(NamedTuple):
    """A rising convex curve P(a): knots [m], and the stiffness there [N/m]."""

    label: Floats
    stiffness: Floats

    def loads(self, approach: Floats) -> Floats:
        """Return P at approaches [N]."""
        rise = np.append(
            0.0, np.cumsum(np.diff(self.label) * 0.5 * (self.stiffness[1:] + self.stiffness[:-1]))
        )
        # a jump of the stiffness is two knots at one approach
        bend = np.append(np.diff(self.stiffness) / np.maximum(np.diff(self.label), 1e-300), 0.0)
        index = np.clip(
            np.searchsorted(self.label, approach, side="left") - 1, 0, self.label.size - 1
        )
        x = np.clip(approach - self.label[index], 0.0, None)
        load: Floats = rise[index] + x * (self.stiffness[index] + 0.5 * bend[index] * x)
        return load


def hertz_constant(approach: Floats, load: Floats) -> float | None:
    """Return k of P = k a^(3/2) [N/m^1.5] if a table follows it to rounding, else None."""
    constant = load / approach**1.5
    return float(constant[-1]) if np.ptp(constant) < ROUNDING * constant[-1] else None


def is_convex(approach: Floats, load: Floats) -> bool:
    """Return True if a table, which begins at first touch, is convex to rounding."""
    secant = np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0)
    return bool((np.diff(secant) >= -ROUNDING * secant[1:]).all())


def interpolate_convex(approach: Floats, load: Floats, stiffness: Floats | None = None) -> Knots:
    """Interpolate a convex table exactly, with one additional knot between two rows (Schumaker 1983).

    Stiffnesses dP/da just before rows [N/m] are NaN where unknown; P is then straight up to the
    first row. By default they are estimated from three rows each, and the load is a power of the
    approach before the first row.
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
        slope = (
            np.where(unknown, _slopes(approach, load), stiffness) if unknown.any() else stiffness
        )
    secant = np.diff(loads, prepend=0.0) / np.diff(nodes, prepend=0.0)
    # it rises, apart from rounding or the residual of a numerical solution
    secant = isotonic_regression(secant, weights=np.diff(nodes, prepend=0.0)).x
    above = np.append(secant[1:], np.inf)
    slope = np.append(
        max(2 * secant[0] - min(slope[0], above[0]), 0.0), np.clip(slope, secant, above)
    )
    return _insert_knots(np.append(0.0, nodes), secant, slope)


def _first_exponent(approach: Floats, load: Floats) -> float:
    """Estimate the exponent of P ∝ a^n before the first row from the three rows that follow."""
    x, y = np.log(approach[:3]), np.log(load[:3])
    slopes = np.diff(y) / np.diff(x)
    at_first = slopes[0] - (slopes[1] - slopes[0]) * (x[1] - x[0]) / (x[2] - x[0])
    steepest = (load[1] - load[0]) / (approach[1] - approach[0]) * approach[0] / load[0]
    return float(np.clip(at_first, 1.0, max(steepest, 1.0)))


def _slopes(approach: Floats, load: Floats) -> Floats:
    """Estimate dP/da at rows, by power laws through three neighbouring rows."""
    x, y = np.log(approach), np.log(load)
    width, rise = np.diff(x), np.diff(y) / np.diff(x)
    inner = (rise[:-1] * width[1:] + rise[1:] * width[:-1]) / (width[:-1] + width[1:])
    ends = rise[0] - (inner[0] - rise[0]), rise[-1] + (rise[-1] - inner[-1])
    exponent = np.concatenate([ends[:1], inner, ends[1:]])
    slope: Floats = exponent * load / approach
    return slope


def _insert_knots(nodes: Floats, secant: Floats, slope: Floats) -> Knots:
    """Insert a knot between each two nodes so that stiffnesses at nodes and secants between them are met."""
    low, high, width = slope[:-1], slope[1:], np.diff(nodes)
    middle = 2 * secant - 0.5 * (low + high)
    # where a knot in the middle is impossible: the stiffness at the knot equals that at one end
    is_late, is_early = middle < low, middle > high
    position = np.full(width.size, 0.5)
    rise = np.where(high > low, high - low, 1.0)
    position[is_late] = 1 - 2 * ((secant - low) / rise)[is_late]
    position[is_early] = 2 * ((high - secant) / rise)[is_early]
    # snap a jump to one approach, to the bit
    position = np.where(position < ROUNDING, 0.0, np.where(position > 1 - ROUNDING, 1.0, position))
    middle = np.clip(np.where(is_late, low, np.where(is_early, high, middle)), low, high)
    inner = np.where(position == 1.0, nodes[1:], nodes[:-1] + position * width)
    label = np.column_stack([nodes[:-1], inner]).ravel()
    stiffness = np.column_stack([low, middle]).ravel()
    label, stiffness = np.append(label, nodes[-1]), np.append(stiffness, slope[-1])
    # drop knots that duplicate the previous one
    distinct = np.append(True, (np.diff(label) > 0) | (np.diff(stiffness) > 0))
    return Knots(label[distinct], np.maximum.accumulate(stiffness[distinct]))


def estimate_noise(approach: Floats, load: Floats) -> Floats:
    """Estimate the standard deviation of the noise of each row [N] from differences of neighbouring rows.

    One part of it is constant, the other proportional to the load (Gasser, Sroka and
    Jennen-Steinmetz 1986).
    """
    from scipy.optimize import nnls

    a, p = np.append(0.0, approach), np.append(0.0, load)
    weight = (a[2:] - a[1:-1]) / (a[2:] - a[:-2])
    square = (p[1:-1] - weight * p[:-2] - (1 - weight) * p[2:]) ** 2 / (
        1 + weight**2 + (1 - weight) ** 2
    )
    terms = np.column_stack([np.ones(square.size), (p[1:-1] / p.max()) ** 2])
    variance = np.full(square.size, square.mean() or 1e-300)
    for _ in range(5):
        coefficients = nnls(terms / variance[:, None], square / variance)[0]
        variance = np.maximum(terms @ coefficients, 1e-6 * square.mean() + 1e-300)
    noise: Floats = np.sqrt(
        np.maximum(coefficients[0] + coefficients[1] * (load / p.max()) ** 2, 1e-6 * square.mean())
    )
    return noise


class Regression:
    """Nearest convex curves to noisy tables with rows at the same approaches [m]; ``noise`` > 0 in N (row)."""

    def __init__(self, approach: Floats, noise: Floats) -> None:
        count = min(MOST_NODES, 2 * approach.size)
        even = np.quantile(approach, np.linspace(0, 1, count - count // 4))
        refined = even[0] * 0.5 ** np.arange(count // 4, -1, -1)
        self.nodes = np.unique(np.concatenate([[0.0], refined, even]))
        width = np.diff(self.nodes)
        x = np.clip(approach[:, None] - self.nodes[:-1], 0.0, None)
        # loads of stiffnesses that rise from 0 to 1 between two nodes, and of a constant stiffness
        # from first touch
        ramps = np.where(x < width, 0.5 * x**2 / width, x - 0.5 * width)
        self._basis = np.column_stack([approach, ramps])
        self._approach, self._noise = approach, noise
        self._columns, self._triangle = np.linalg.qr(self._basis / noise[:, None])
        self._size = np.linalg.norm(self._triangle, axis=0)

    def fit(self, load: Floats) -> Knots:
        """Fit the nearest convex curve to loads (row) [N]."""
        from scipy.optimize import nnls

        projected = self._columns.T @ (load / self._noise)
        steps = (
            nnls(self._triangle / self._size, projected, maxiter=100 * self._size.size)[0]
            / self._size
        )
        return Knots(self.nodes, np.cumsum(steps))

    def error(self, load: Floats) -> float:
        """Estimate the error of the curve fitted to loads (row) [N].

        It is the largest deviation in `REPLICAS` tables with simulated noise, plus the error
        between rows, plus the residual beyond the noise.
        """
        curve = self.fit(load)
        at_nodes, at_rows, rng = (
            curve.loads(self.nodes),
            curve.loads(self._approach),
            np.random.default_rng(SEED),
        )
        tables = at_rows + self._noise * rng.normal(size=(REPLICAS, load.size))
        deviations = [
            float(np.abs(self.fit(table).loads(self.nodes) - at_nodes).max()) for table in tables
        ]
        beyond = float(np.max(np.abs(at_rows - load) - DEVIATIONS * self._noise, initial=0.0))
        # the noise estimated from few rows is itself uncertain
        spread = max(deviations) * (1.0 + 2.0 / math.sqrt(load.size))
        return spread + float(_triangle_heights(self._approach, at_rows).max()) + beyond


def error_between_rows(approach: Floats, load: Floats, *, straight: bool = False) -> float:
    """Estimate the largest error between the rows of a convex table [N].

    ``straight``: the load is known to be straight up to the first row.
    """
    # cross-validation: every third row is retained, in turn, and the differences at the other rows
    # are an upper estimate; no convex curve through the rows differs by more than the triangles
    # between their secants
    height = _triangle_heights(approach, load)
    height[0] *= not straight
    if approach.size < LEFT_OUT * LEFT_OUT:
        return float(height.max())
    # only one row constrains the curve at first touch
    largest = float(height[0]) * UNKNOWN
    for start in range(LEFT_OUT):
        retained = np.zeros(approach.size, dtype=bool)
        retained[start::LEFT_OUT] = retained[-1] = True
        left_out = interpolate_convex(approach[retained], load[retained]).loads(approach[~retained])
        largest = max(largest, float(np.abs(left_out - load[~retained]).max()))
    return min(largest, float(height.max()))


def _triangle_heights(approach: Floats, load: Floats) -> Floats:
    """Return the heights of the triangles that bound a convex curve through rows, one before each row [N]."""
    width, secant = (
        np.diff(approach, prepend=0.0),
        np.diff(load, prepend=0.0) / np.diff(approach, prepend=0.0),
    )
    previous, following = np.append(0.0, secant[:-1]), np.append(secant[1:], np.inf)
    below = (secant - previous) * width
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.where(
            following > previous, below * (following - secant) / (following - previous), 0.0
        )
    height[-1] = below[-1]
    return height
