"""The virgin curve of a contact, where springs are placed on it, and by how much they may be wrong.

The bounds are proven in README.md, "The bound".
"""

from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import EnsembleState
from historysim.basics.array_types import Floats
from historysim.errors import InputError

STEEPER = 1e-9
"""By how much, relatively, rounding may have a slope rise."""
TABLE = 2048
"""Points of the curve on which nodes are placed; the bound is then computed on the curve itself."""
BISECTIONS = 60
PARTS = 32
"""Parts of each piece on which its energy is bounded."""


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, slots=False)
class VirginCurve:
    """T(U) and dT/dU of a contact of constant properties, moved from rest at a normal load [N], by exact steps."""

    ensemble: Ensemble
    normal_load: float

    @cached_property
    def rest(self) -> EnsembleState:
        """The unstrained state."""
        loaded = self.ensemble.advance(self.ensemble.initial_state(), normal_load=self.normal_load)
        # the approach is held: at a constant load it does not change
        return self.ensemble.advance(loaded, normal_displacement=loaded.approach, tangential_displacement=0.0)

    @cached_property
    def end(self) -> float:
        """Displacement from which on everything slides [m]: max θ μ_i (d - h_i)."""
        gap = self.ensemble.highest_summit - self.ensemble.summit_height
        reach = self.ensemble.friction * np.maximum(self.rest.approach - gap, 0.0)
        return float(self.ensemble.pair.displacement_ratio * reach.max())

    def at(self, displacement: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return tangential loads [N] and stiffnesses [N/m] at displacements ≥ 0 [m], of one shape."""
        asked = np.asarray(displacement, dtype=np.float64)
        load, slope = np.empty(asked.size), np.empty(asked.size)
        stepper = self.ensemble.stepper(self.rest)
        for place in np.argsort(asked, axis=None, kind="stable"):
            # one way without a reversal is the virgin curve, in however many steps
            stepper.step(tangential_displacement=float(asked.flat[place]))
            load[place] = stepper.tangential_load
            slope[place] = stepper.save().stiffness(1)
        return load.reshape(asked.shape), slope.reshape(asked.shape)

    def check(self) -> None:
        """Check that springs in parallel can follow it: else, or where nothing slides, an InputError."""
        if not self.end > 0.0:
            raise InputError("friction is 0 everywhere; expected a contact that carries a tangential load")
        _, slope = self.at(np.linspace(0.0, self.end, 257))
        if (np.diff(slope) > STEEPER * slope[0]).any():
            raise InputError(
                "the virgin curve stiffens on the way, as no springs in parallel do; expected a normal curve that is "
                "convex throughout"
            )


class Placed(NamedTuple):
    """Nodes of the polyline (spring), ascending [m], the loads there [N], and bounds of load [N] and of energy [J]."""

    node: Floats
    load: Floats
    bound: float
    energy_bound: float


def placed(curve: VirginCurve, elements: int) -> Placed:
    """Return the nodes of least bound of a curve for a number of springs, with their bounds."""
    node = _least(curve, elements)
    load, _ = curve.at(node)
    return Placed(node, load, *bounds(curve, node))


def _least(curve: VirginCurve, elements: int) -> Floats:
    """Return nodes of the least bound on a table of the curve; the last one is its end."""
    from scipy.optimize import minimize

    # denser where the slope ends as a root
    table = curve.end * np.sin(np.linspace(0.0, 0.5 * np.pi, TABLE))
    load, slope = curve.at(table)
    slope = np.minimum.accumulate(slope)
    # equal parts of ∫ √|f''| are all but optimal
    spread = np.append(0.0, np.cumsum(np.sqrt(-np.diff(slope) * np.diff(table))))
    start = np.interp(np.linspace(0.0, spread[-1], elements + 1), spread, table)
    widths = np.maximum(np.diff(start), 1e-9 * curve.end)

    def nodes(logarithms: Floats) -> Floats:
        parts = np.exp(logarithms - logarithms.max())
        node: Floats = np.append(0.0, np.cumsum(parts) / parts.sum()) * curve.end
        return node

    def sum_and_gradient(logarithms: Floats) -> tuple[float, Floats]:
        node = nodes(logarithms)
        ends, slopes = np.interp(node, table, load), np.interp(node, table, slope)
        width = np.maximum(np.diff(node), 1e-300)
        chord = np.diff(ends) / width
        inside = np.interp(-chord, -slope, table)
        inside = np.clip(inside, node[:-1], node[1:])
        error = np.interp(inside, table, load) - ends[:-1] - chord * (inside - node[:-1])
        below = (chord - slopes[:-1]) * (node[1:] - inside) / width
        above = (chord - slopes[1:]) * (inside - node[:-1]) / width
        by_node = above[:-1] + below[1:]
        # dx_i/dlog w_k = (part of the width that is w_k and lies below i) - x_i w_k/total
        share = width / curve.end
        by_width = np.append(np.cumsum(by_node[::-1])[::-1], 0.0) * width - share * (by_node @ node[1:-1])
        scale = 2.0 / ends[-1]
        return scale * float(error.sum()), scale * by_width

    if elements > 1:
        found = minimize(sum_and_gradient, np.log(widths), jac=True, method="L-BFGS-B", options={"maxiter": 500})
        if found.fun < sum_and_gradient(np.log(widths))[0]:
            widths = np.diff(nodes(found.x))
    node: Floats = np.cumsum(widths) * (curve.end / widths.sum())
    node[-1] = curve.end
    return node


def bounds(curve: VirginCurve, node: Floats) -> tuple[float, float]:
    """Return the bounds of load [N] and of the energy of a closed loop [J] of chords between 0 and nodes of a curve."""
    ends, load, chord = _chords(curve, node)
    top = _tops(curve, ends, chord)
    found, _ = curve.at(top)
    largest = np.maximum(found - load[:-1] - chord * (top - ends[:-1]), 0.0)
    return 2.0 * float(largest.sum()), _energy_bound(curve, ends, load, chord)


def _chords(curve: VirginCurve, node: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the ends of chords, the loads there, and their slopes."""
    ends = np.append(0.0, node)
    load, _ = curve.at(ends)
    return ends, load, np.diff(load) / np.diff(ends)


def _tops(curve: VirginCurve, ends: Floats, chord: Floats) -> Floats:
    """Return where the curve is furthest above each chord: where its slope is the chord's."""
    low, high = ends[:-1].copy(), ends[1:].copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        steeper = curve.at(middle)[1] > chord
        low, high = np.where(steeper, middle, low), np.where(steeper, high, middle)
    return low


def _energy_bound(curve: VirginCurve, ends: Floats, load: Floats, chord: Floats) -> float:
    """Bound |8 ∫ e - 4 A e(A)|: on each part e is concave, so above its chord and below its tangents."""
    parts = np.linspace(0.0, 1.0, PARTS + 1)
    at = ends[:-1, None] + parts * np.diff(ends)[:, None]
    force, slope = curve.at(at)
    error = np.maximum(force - load[:-1, None] - chord[:, None] * (at - ends[:-1, None]), 0.0)
    slope = slope - chord[:, None]
    width = np.diff(at, axis=1)
    under = 0.5 * width * (error[:, :-1] + error[:, 1:])
    bend = np.maximum(slope[:, :-1] - slope[:, 1:], 0.0)
    over = under + width**2 * bend / 8.0
    least, most = (np.cumsum(each).reshape(each.shape) for each in (under, over))
    highest = np.maximum(error[:, :-1], error[:, 1:]) + width * bend / 4.0
    lowest = np.minimum(at[:, :-1] * error[:, :-1], at[:, 1:] * error[:, 1:])
    upper = 8.0 * most - 4.0 * lowest
    lower = 8.0 * (least - under) - 4.0 * at[:, 1:] * highest
    return float(max(upper.max(), -lower.min()))
