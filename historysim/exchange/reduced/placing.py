"""Where springs are placed, and by how much they may be wrong.

At a held normal load a contact is a sum of stops, T = ∫ E_r[U] dμ(r), and so are springs that slide in parallel.
E_r, the force of a spring of stiffness 1 that slides at the deflection r, changes with r by at most |dr|, whatever the
history. With e(U), the virgin curve of the contact less that of the springs, integration by parts gives
ΔT = ∫ e'(r) dE_r, so that

    |ΔT| ≤ ∫ |e'(r)| dr        for every history, nested reversals and all.

It is sharp: a spiral of reversals has dE_r/dr = ±1 with the sign of e' throughout (`worst_history`). A closed loop of
amplitude A takes W(A) = 8 ∫ T dU - 4 A T(A), with integrals from 0 to A of the virgin curve; a history takes the sum
over its closed loops (rainflow), each of which is therefore off by at most max |8 ∫ e dU - 4 A e(A)|.

Springs whose virgin curve is a polyline of chords of the contact's have its friction limit, and e is never negative.
Between two nodes e rises and falls once, so that ∫ |e'| there is twice its maximum, at the displacement where the
stiffness is the chord's. Nodes are placed for the least sum of these.
"""

from typing import NamedTuple

import numpy as np

from historysim.basics.array_types import Floats
from historysim.exchange.reduced.virgin import VirginCurve

TABLE = 2048
"""Points of the curve on which nodes are placed; the bound is then computed on the curve itself."""
BISECTIONS = 60
PARTS = 32
"""Parts of each piece on which its energy is bounded."""


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
    """Return nodes of the least bound on a table of the curve, whose last one is its end."""
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


def worst_history(curve: VirginCurve, node: Floats) -> Floats:
    """Return displacements of reversals, from rest, at whose end the error is as large as the bound [m].

    The error of the virgin curve rises and falls once between two nodes. The spiral turns so that dE_r/dr is 1 where it
    rises and -1 where it falls.
    """
    ends, _, chord = _chords(curve, node)
    turns = np.sort(np.concatenate([node, _tops(curve, ends, chord)]))[::-1]
    # E_r falls with r below the outermost turn: the spring that is nearest to sliding has slid back
    place, side, reached = -turns[0], 1.0, [-turns[0]]
    for turn in turns[1:]:
        place += side * 2.0 * turn
        reached.append(place)
        side = -side
    return np.array(reached)
