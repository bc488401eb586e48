"""`reduce`: the contact of a scenario as few springs that slide, placed on its virgin curve.

The bounds of their error are proven in README.md, "The bound".
"""

from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import EnsembleState
from historysim.basics.arguments import ArrayLike, Floats, scalar
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError
from historysim.exchange import CONSTANT, EVOLVES, Exportable, exported
from historysim.exchange.reduced.reduced_model import ReducedModel, Scaling
from historysim.loads.event_sequence import is_planar
from historysim.replaying import Replay

STEEPER = 1e-9  # by how much, relatively, rounding may have a slope rise
TABLE = 2048  # points of the curve on which nodes are placed; the bound is then computed on the curve itself
BISECTIONS = 60
PARTS = 32  # parts of each piece on which its energy is bounded


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

    def at(self, displacement: ArrayLike) -> tuple[Floats, Floats]:
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


MOST_ELEMENTS = 1000
ROWS = 33  # normal loads in the table of a model for varying loads, beside 0
LEAST_PART = 1e-3  # the smallest of them, over the largest
POINTS = 161  # points of the virgin curve that a model keeps
RANDOM_HISTORIES, RANDOM_STEPS = 10, 100
SEED = 1
SAME = 1e-9  # relative difference of normal loads that are one


def reduce(
    source: Exportable, *, elements: int = 32, normal_load: float | None = None, notify: Notify = silent
) -> ReducedModel:
    """Return springs in parallel that slide (Jenkins, Maxwell slip, discrete Iwan) in place of a contact.

    They are placed for the least bound of their error at a normal load, which holds for every history at that load
    (proven in the README of `historysim.exchange`). The springs are those of the contact itself: an instrument in
    series stays a part of the other program. Where the scenario varies the normal load, a table says how the springs go
    with it, and the errors are measured, on the scenario's own history and on random ones; nothing is proven there.

    Parameters
    ----------
    source : Exportable
        A scenario or its file, a log, a result, or a replay.
    elements : int
        Number of springs, 1 to 1000.
    normal_load : float, optional
        Normal load at which they are placed [N], > 0; by default the largest at which the contact is moved.
    notify : callable, optional
        Takes notices for the user.

    Raises
    ------
    InputError
        The source cannot be used, its asperities evolve, it has no friction, or an argument out of range.
    LoadError
        A load of the scenario that the contact cannot carry.
    """
    if not isinstance(elements, int) or isinstance(elements, bool) or not 1 <= elements <= MOST_ELEMENTS:
        raise InputError(f"elements is {elements!r}; expected a whole number from 1 to {MOST_ELEMENTS}")
    found = exported(source, notify)
    if is_planar(found.replay.events):
        raise InputError("springs that slide have one tangential direction; expected events with one, not two")
    ensemble = found.replay.ensemble
    changes = found.replay.changes
    if changes.friction or changes.evolve:
        raise InputError(f"{EVOLVES}, which springs of a fixed limit do not follow; {CONSTANT}")
    loads, displacement, forces = _own_history(found.replay)
    moved = loads[np.append(False, np.diff(displacement) != 0.0)]
    moved = moved[moved > 0.0]
    if normal_load is None and not moved.size:
        raise InputError(
            "the scenario never moves its contact tangentially under a load; expected normal_load, at which springs "
            "are placed (--normal-load)"
        )
    load = float(moved.max()) if normal_load is None else scalar("normal_load", normal_load, above=0.0)
    curve = VirginCurve(ensemble, load)
    curve.check()
    node, at_node, bound, energy_bound = placed(curve, elements)
    stiffness, limit = _springs(node, at_node)
    # denser where the curve is steep and bends
    points = curve.end * np.linspace(0.0, 1.0, POINTS) ** 2
    model = ReducedModel(
        normal_load=load,
        stiffness=stiffness,
        limit=limit,
        bound=bound / float(at_node[-1]),
        energy_bound=energy_bound,
        virgin_displacement=points,
        virgin_load=curve.at(points)[0],
        title=found.title or found.name,
    )
    # the first row is reached by one joint path from where nothing touches
    if (moved.size and np.ptp(moved) > SAME * moved.max()) or displacement[0] != 0.0:
        most = max(load, float(loads.max()))
        model = attrs.evolve(model, scaling=_scaling(ensemble, node / curve.end, most))
    least = float(moved.min()) if moved.size else load
    return attrs.evolve(model, errors=_errors(model, ensemble, least, (loads, displacement, forces)))


def _springs(node: Floats, load: Floats) -> tuple[Floats, Floats]:
    """Return stiffnesses and limits of springs that have a polyline through 0 and nodes as virgin curve."""
    chord = np.diff(np.append(0.0, load)) / np.diff(np.append(0.0, node))
    stiffness = np.maximum(-np.diff(np.append(chord, 0.0)), 0.0)
    return stiffness, stiffness * node


def _own_history(job: Replay) -> tuple[Floats, Floats, Floats]:
    """Return normal load, displacement of the contact and tangential load at each step of a replay."""
    history = attrs.evolve(job, record="totals").dataset()
    names = "total_normal_load", "tangential_displacement", "total_tangential_load"
    loads, displacement, forces = (history[name].values for name in names)
    return loads, displacement, forces


def _scaling(ensemble: Ensemble, part: Floats, most: float) -> Scaling:
    """Return springs at many normal loads, their nodes at the same parts of the way to sliding."""
    loads = most * np.geomspace(LEAST_PART, 1.0, ROWS)
    rows = [(np.zeros(part.size), np.zeros(part.size))]
    for load in loads:
        curve = VirginCurve(ensemble, float(load))
        node = part * curve.end
        rows.append(_springs(node, curve.at(node)[0]))
    stiffness, limit = (np.array(each) for each in zip(*rows, strict=True))
    return Scaling(np.append(0.0, loads), stiffness, limit)


def _errors(
    model: ReducedModel, ensemble: Ensemble, least: float, history: tuple[Floats, Floats, Floats]
) -> dict[str, float]:
    """Return the largest errors on the scenario's own history and on random ones, over the largest friction limit."""
    loads, displacement, forces = history
    scale = _largest_limit(ensemble, max(float(loads.max()), model.normal_load))
    found = {}
    varies = model.scaling is not None
    if varies or abs(float(loads.max()) - model.normal_load) <= SAME * model.normal_load:
        own = model.force(displacement, loads) if varies else model.force(displacement)
        found["own history"] = float(np.abs(own - forces).max() / scale)
    rng = np.random.default_rng(SEED)
    worst = 0.0
    for _ in range(RANDOM_HISTORIES):
        load, way, exact = _random_history(model, ensemble, least, rng)
        worst = max(worst, float(np.abs(model.force(way, load if varies else None) - exact).max()) / scale)
    found[f"{RANDOM_HISTORIES} random histories"] = worst
    return found


def _largest_limit(ensemble: Ensemble, load: float) -> float:
    curve = VirginCurve(ensemble, load)
    return float(curve.at(curve.end)[0])


def _random_history(
    model: ReducedModel, ensemble: Ensemble, least: float, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Return normal loads, from a least one on, displacements, and exact tangential loads of a random history."""
    curve = VirginCurve(ensemble, model.normal_load)
    reach = curve.end * rng.uniform(0.3, 1.5)
    way = rng.uniform(-reach, reach, RANDOM_STEPS)
    if model.scaling is None:
        _, totals = ensemble.advance_many(curve.rest, tangential_displacement=way)
        return np.full(way.size, model.normal_load), way, totals.tangential_load
    most = float(model.scaling.normal_load[-1])
    load = np.append(model.normal_load, rng.uniform(least, most, RANDOM_STEPS - 1))
    _, totals = ensemble.advance_many(curve.rest, normal_load=load, tangential_displacement=way)
    return load, way, totals.tangential_load
