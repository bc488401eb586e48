"""`reduce`: the contact of a scenario as few springs that slide, with a proven bound."""

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.basics.notices import Notify, silent
from historysim.errors import InputError
from historysim.exchange.exported import CONSTANT, EVOLVES, Exportable, exported
from historysim.exchange.reduced.placing import VirginCurve, placed
from historysim.exchange.reduced.reduced_model import ReducedModel
from historysim.exchange.reduced.springs import Scaling
from historysim.replaying import Replay

MOST_ELEMENTS = 1000
ROWS = 33
"""Normal loads in the table of a model for varying loads, beside 0."""
LEAST_PART = 1e-3
"""The smallest of them, over the largest."""
POINTS = 161
"""Points of the virgin curve that a model keeps."""
RANDOM_HISTORIES, RANDOM_STEPS = 10, 100
SEED = 1
SAME = 1e-9
"""Relative difference of normal loads that are one."""


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
