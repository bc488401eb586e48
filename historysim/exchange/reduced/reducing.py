"""`reduce`: approximation of a contact by few sliding springs, fitted to its virgin curve.

The bounds of their error are proven in README.md, "The bound".
"""

from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np

from historysim.asperities.integration import IntegratedBody
from historysim.asperities.state import State
from historysim.basics.arguments import ArrayLike, Floats, scalar
from historysim.basics.wording import Notify, silent
from historysim.errors import InputError
from historysim.exchange import CONSTANT, EVOLVES, Exportable, resolve_export
from historysim.exchange.reduced.reduced_model import ReducedModel, Scaling
from historysim.loads.event_sequence import is_planar
from historysim.replaying import Replay

STEEPER = 1e-9  # relative rise of a slope that is attributed to rounding
TABLE = 2048  # points of the tabulated curve for the placement of nodes; bounds use the exact curve
BISECTIONS = 60
PARTS = 32  # subdivisions of each chord for the energy bound


# cached properties need a __dict__, which slots exclude
@attrs.frozen(eq=False, slots=False)
class VirginCurve:
    """T(U) and dT/dU of a contact with constant properties, moved from rest at a normal load [N], by exact steps."""

    ensemble: IntegratedBody
    normal_load: float

    @cached_property
    def rest(self) -> State:
        """The unstrained state."""
        loaded = self.ensemble.advance(self.ensemble.initial_state(), normal_load=self.normal_load)
        # holding the approach is equivalent, since it is constant at a constant load
        return self.ensemble.advance(
            loaded, normal_displacement=loaded.approach, tangential_displacement=0.0
        )

    @cached_property
    def end(self) -> float:
        """Displacement at which gross slip starts [m]: max θ μ_i (d - h_i)."""
        reach = self.ensemble.friction * np.maximum(
            self.rest.approach - self.ensemble.first_touch, 0.0
        )
        return float(self.ensemble.displacement_ratio * reach.max())

    def evaluate(self, displacement: ArrayLike) -> tuple[Floats, Floats]:
        """Return tangential loads [N] and stiffnesses [N/m] at displacements ≥ 0 [m], in their shape."""
        displacements = np.asarray(displacement, dtype=np.float64)
        load, slope = np.empty(displacements.size), np.empty(displacements.size)
        stepper = self.ensemble.stepper(self.rest)
        for index in np.argsort(displacements, axis=None, kind="stable"):
            # a path without reversal is the virgin curve, for any number of steps
            stepper.step(tangential_displacement=float(displacements.flat[index]))
            load[index] = stepper.tangential_load
            slope[index] = stepper.save().stiffness(1)
        return load.reshape(displacements.shape), slope.reshape(displacements.shape)

    def check(self) -> None:
        """Raise InputError if springs in parallel cannot follow the curve, or if there is no friction."""
        if not self.end > 0.0:
            raise InputError(
                "friction is 0 everywhere; expected a contact that supports a tangential load"
            )
        _, slope = self.evaluate(np.linspace(0.0, self.end, 257))
        if (np.diff(slope) > STEEPER * slope[0]).any():
            raise InputError(
                "the virgin curve stiffens with displacement, unlike springs in parallel; expected a convex normal "
                "curve"
            )


class Placement(NamedTuple):
    """Nodes of the polyline (spring), ascending [m], the loads there [N], and bounds of load [N] and of energy [J]."""

    node: Floats
    load: Floats
    bound: float
    energy_bound: float


def place_nodes(curve: VirginCurve, elements: int) -> Placement:
    """Place the nodes of least bound on a curve for a number of springs."""
    node = _optimal_nodes(curve, elements)
    load, _ = curve.evaluate(node)
    return Placement(node, load, *bounds(curve, node))


def _optimal_nodes(curve: VirginCurve, elements: int) -> Floats:
    """Return the nodes of least bound on a table of the curve; the last node is its end."""
    from scipy.optimize import minimize

    # denser near the end, where the slope vanishes as a square root
    table = curve.end * np.sin(np.linspace(0.0, 0.5 * np.pi, TABLE))
    load, slope = curve.evaluate(table)
    slope = np.minimum.accumulate(slope)
    # equal parts of ∫ √|f''| are nearly optimal
    spread = np.append(0.0, np.cumsum(np.sqrt(-np.diff(slope) * np.diff(table))))
    start = np.interp(np.linspace(0.0, spread[-1], elements + 1), spread, table)
    widths = np.maximum(np.diff(start), 1e-9 * curve.end)

    def nodes(logarithms: Floats) -> Floats:
        weights = np.exp(logarithms - logarithms.max())
        node: Floats = np.append(0.0, np.cumsum(weights) / weights.sum()) * curve.end
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
        # dx_i/dlog w_k = (w_k if node i is above width k, else 0) - x_i w_k/total
        share = width / curve.end
        by_width = np.append(np.cumsum(by_node[::-1])[::-1], 0.0) * width - share * (
            by_node @ node[1:-1]
        )
        scale = 2.0 / ends[-1]
        return scale * float(error.sum()), scale * by_width

    if elements > 1:
        solution = minimize(
            sum_and_gradient, np.log(widths), jac=True, method="L-BFGS-B", options={"maxiter": 500}
        )
        if solution.fun < sum_and_gradient(np.log(widths))[0]:
            widths = np.diff(nodes(solution.x))
    node: Floats = np.cumsum(widths) * (curve.end / widths.sum())
    node[-1] = curve.end
    return node


def bounds(curve: VirginCurve, node: Floats) -> tuple[float, float]:
    """Return the bounds of load [N] and of closed-loop energy [J] for chords between 0 and the nodes of a curve."""
    ends, load, chord = _chords(curve, node)
    top = _find_tops(curve, ends, chord)
    top_load, _ = curve.evaluate(top)
    largest = np.maximum(top_load - load[:-1] - chord * (top - ends[:-1]), 0.0)
    return 2.0 * float(largest.sum()), _energy_bound(curve, ends, load, chord)


def _chords(curve: VirginCurve, node: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the ends of chords, the loads there, and their slopes."""
    ends = np.append(0.0, node)
    load, _ = curve.evaluate(ends)
    return ends, load, np.diff(load) / np.diff(ends)


def _find_tops(curve: VirginCurve, ends: Floats, chord: Floats) -> Floats:
    """Return the displacements at which the curve is furthest above each chord, where the slopes are equal."""
    low, high = ends[:-1].copy(), ends[1:].copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        steeper = curve.evaluate(middle)[1] > chord
        low, high = np.where(steeper, middle, low), np.where(steeper, high, middle)
    return low


def _energy_bound(curve: VirginCurve, ends: Floats, load: Floats, chord: Floats) -> float:
    """Bound |8 ∫ e - 4 A e(A)|: in each subdivision e is concave, so above its chord and below its tangents."""
    fractions = np.linspace(0.0, 1.0, PARTS + 1)
    displacement = ends[:-1, None] + fractions * np.diff(ends)[:, None]
    force, slope = curve.evaluate(displacement)
    error = np.maximum(
        force - load[:-1, None] - chord[:, None] * (displacement - ends[:-1, None]), 0.0
    )
    slope = slope - chord[:, None]
    width = np.diff(displacement, axis=1)
    under = 0.5 * width * (error[:, :-1] + error[:, 1:])
    bend = np.maximum(slope[:, :-1] - slope[:, 1:], 0.0)
    over = under + width**2 * bend / 8.0
    integral_below, integral_above = (
        np.cumsum(areas).reshape(areas.shape) for areas in (under, over)
    )
    highest = np.maximum(error[:, :-1], error[:, 1:]) + width * bend / 4.0
    lowest = np.minimum(displacement[:, :-1] * error[:, :-1], displacement[:, 1:] * error[:, 1:])
    upper = 8.0 * integral_above - 4.0 * lowest
    lower = 8.0 * (integral_below - under) - 4.0 * displacement[:, 1:] * highest
    return float(max(upper.max(), -lower.min()))


MOST_ELEMENTS = 1000
ROWS = 33  # normal loads, in addition to 0, in the table of a model for varying loads
LEAST_PART = 1e-3  # smallest over largest of these normal loads
POINTS = 161  # stored points of the virgin curve
RANDOM_HISTORIES, RANDOM_STEPS = 10, 100
SEED = 1
SAME = 1e-9  # relative tolerance for equal normal loads


def reduce(
    source: Exportable,
    *,
    elements: int = 32,
    normal_load: float | None = None,
    notify: Notify = silent,
) -> ReducedModel:
    """Approximate a contact by sliding springs in parallel (Jenkins, Maxwell slip, discrete Iwan).

    The springs minimise the error bound at a normal load, which holds for every history at that
    load (proven in the README of `historysim.exchange`). They represent the contact only: an
    instrument in series has to be modelled by the other program. If the scenario varies the normal
    load, the springs are tabulated over it, and the errors are measured on the history of the
    scenario and on random histories, without a proven bound.

    Parameters
    ----------
    source : Exportable
        A scenario or its file, a log, a result, or a replay.
    elements : int
        Number of springs, 1 to 1000.
    normal_load : float, optional
        Normal load of the model [N], > 0; by default the largest load at which the contact is
        moved.
    notify : callable, optional
        Receives notices for the user.

    Raises
    ------
    InputError
        If the source cannot be used, its asperities evolve, it has no friction, or an argument is
        out of range.
    LoadError
        If the contact cannot support a load of the scenario.
    """
    if (
        not isinstance(elements, int)
        or isinstance(elements, bool)
        or not 1 <= elements <= MOST_ELEMENTS
    ):
        raise InputError(
            f"elements is {elements!r}; expected a whole number from 1 to {MOST_ELEMENTS}"
        )
    resolved = resolve_export(source, notify)
    if is_planar(resolved.replay.events):
        raise InputError("sliding springs have one tangential direction; the events have two")
    ensemble = resolved.ensemble
    changes = resolved.replay.changes
    if changes.friction or changes.evolve:
        raise InputError(
            f"{EVOLVES}, which springs with a constant limit cannot represent; {CONSTANT}"
        )
    loads, displacement, forces = _replay_history(resolved.replay)
    moved = loads[np.append(False, np.diff(displacement) != 0.0)]
    moved = moved[moved > 0.0]
    if normal_load is None and not moved.size:
        raise InputError(
            "the scenario never moves its contact tangentially under a load; expected normal_load of the model "
            "(--normal-load)"
        )
    load = (
        float(moved.max()) if normal_load is None else scalar("normal_load", normal_load, above=0.0)
    )
    curve = VirginCurve(ensemble, load)
    curve.check()
    node, at_node, bound, energy_bound = place_nodes(curve, elements)
    stiffness, limit = _springs(node, at_node)
    # denser near 0, where the curve is steep and curved
    points = curve.end * np.linspace(0.0, 1.0, POINTS) ** 2
    model = ReducedModel(
        normal_load=load,
        stiffness=stiffness,
        limit=limit,
        bound=bound / float(at_node[-1]),
        energy_bound=energy_bound,
        virgin_displacement=points,
        virgin_load=curve.evaluate(points)[0],
        title=resolved.title or resolved.name,
    )
    # the first row is reached by a joint path from the state without contact
    if (moved.size and np.ptp(moved) > SAME * moved.max()) or displacement[0] != 0.0:
        largest_load = max(load, float(loads.max()))
        model = attrs.evolve(
            model, scaling=_tabulate_springs(ensemble, node / curve.end, largest_load)
        )
    smallest_load = float(moved.min()) if moved.size else load
    return attrs.evolve(
        model, errors=_measure_errors(model, ensemble, smallest_load, (loads, displacement, forces))
    )


def _springs(node: Floats, load: Floats) -> tuple[Floats, Floats]:
    """Return stiffnesses and limits of the springs whose virgin curve is a polyline through 0 and the nodes."""
    chord = np.diff(np.append(0.0, load)) / np.diff(np.append(0.0, node))
    stiffness = np.maximum(-np.diff(np.append(chord, 0.0)), 0.0)
    return stiffness, stiffness * node


def _replay_history(job: Replay) -> tuple[Floats, Floats, Floats]:
    """Replay a history and return normal load, displacement of the contact and tangential load at each step."""
    history = attrs.evolve(job, record="totals").dataset()
    names = "total_normal_load", "tangential_displacement", "total_tangential_load"
    loads, displacement, forces = (history[name].values for name in names)
    return loads, displacement, forces


def _tabulate_springs(ensemble: IntegratedBody, fraction: Floats, largest_load: float) -> Scaling:
    """Tabulate springs over the normal load, with nodes at constant fractions of the gross-slip displacement."""
    loads = largest_load * np.geomspace(LEAST_PART, 1.0, ROWS)
    rows = [(np.zeros(fraction.size), np.zeros(fraction.size))]
    for load in loads:
        curve = VirginCurve(ensemble, float(load))
        node = fraction * curve.end
        rows.append(_springs(node, curve.evaluate(node)[0]))
    stiffness, limit = (np.array(column) for column in zip(*rows, strict=True))
    return Scaling(np.append(0.0, loads), stiffness, limit)


def _measure_errors(
    model: ReducedModel,
    ensemble: IntegratedBody,
    smallest_load: float,
    history: tuple[Floats, Floats, Floats],
) -> dict[str, float]:
    """Return the largest errors on the history of the scenario and on random histories, over the friction limit."""
    loads, displacement, forces = history
    scale = _largest_limit(ensemble, max(float(loads.max()), model.normal_load))
    errors = {}
    varies = model.scaling is not None
    if varies or abs(float(loads.max()) - model.normal_load) <= SAME * model.normal_load:
        reduced_forces = model.force(displacement, loads) if varies else model.force(displacement)
        errors["own history"] = float(np.abs(reduced_forces - forces).max() / scale)
    rng = np.random.default_rng(SEED)
    worst = 0.0
    for _ in range(RANDOM_HISTORIES):
        load, path, exact = _random_history(model, ensemble, smallest_load, rng)
        worst = max(
            worst, float(np.abs(model.force(path, load if varies else None) - exact).max()) / scale
        )
    errors[f"{RANDOM_HISTORIES} random histories"] = worst
    return errors


def _largest_limit(ensemble: IntegratedBody, load: float) -> float:
    curve = VirginCurve(ensemble, load)
    return float(curve.evaluate(curve.end)[0])


def _random_history(
    model: ReducedModel, ensemble: IntegratedBody, smallest_load: float, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Return normal loads ≥ `smallest_load`, displacements and exact tangential loads of a random history."""
    curve = VirginCurve(ensemble, model.normal_load)
    reach = curve.end * rng.uniform(0.3, 1.5)
    path = rng.uniform(-reach, reach, RANDOM_STEPS)
    if model.scaling is None:
        _, totals = ensemble.advance_many(curve.rest, tangential_displacement=path)
        return np.full(path.size, model.normal_load), path, totals.tangential_load
    largest_load = float(model.scaling.normal_load[-1])
    load = np.append(model.normal_load, rng.uniform(smallest_load, largest_load, RANDOM_STEPS - 1))
    _, totals = ensemble.advance_many(curve.rest, normal_load=load, tangential_displacement=path)
    return load, path, totals.tangential_load
