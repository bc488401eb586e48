"""The preliminary displacement of a surface, the asperity that decides it, and the work between rest and sliding.

Closed forms: README of `historysim.contact`. A branch from one sliding direction to the other is
the virgin curve T = F(u) = Σ μ_i N_i [1 - (1 - u/(θ μ_i δ_i))₊^(3/2)] (Cattaneo; Mindlin), doubled
(Masing).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Self

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers, scalar
from historysim.contact import hertz
from historysim.results.analysis.recorded import (
    CHANGING_HEIGHT,
    check_all_recorded,
    check_recorded,
    describe,
    displacement_ratio,
    present_friction,
    shape_in_step,
    step_blocks,
)
from historysim.results.history_view import History
from historysim.results.queries import query
from historysim.results.steps import resolve_step

if TYPE_CHECKING:
    import xarray as xr

DISPLACEMENTS = {
    "virgin": "from rest until the last asperity slides",
    "reversal_to_slip": "from a reversal out of sliding until all slides the other way",
    "zero_load_to_slip": "from zero load on that branch until all slides",
    "residual": "what is left at zero load, after loading from rest until all slides",
}


@query(per_step=True, planar=True)
def preliminary_displacement(history: "xr.Dataset") -> "xr.DataArray":
    """Return the preliminary displacement [m]: the tangential displacement at which the last asperity of all slides.

    δ_t,max = max_i θ μ_i δ_i with θ = E*/(4 G*) and the approach δ_i = z_i - d, for one-way loading
    from the virgin state at the present normal load and friction (Mindlin 1949). Along ``step``; 0
    where nothing touches. InputError: a history without some or all of the asperities that touch.
    """
    greatest = capacity(history).displacement
    return _along_steps(
        history,
        greatest,
        "preliminary_displacement",
        "preliminary displacement of the surface",
        "m",
    )


@query(per_step=True, planar=True)
def critical_asperity(history: "xr.Dataset") -> "xr.DataArray":
    """Return the label of the asperity that slides last, with the greatest μ_i δ_i, at each step; -1 without contact.

    InputError: as for `preliminary_displacement`.
    """
    limit = capacity(history)
    labels = np.where(limit.displacement > 0, limit.asperity, -1)
    return _along_steps(history, labels, "critical_asperity", "asperity that is the last to slide")


@query(unit="m")
def drift(history: "xr.Dataset", first: int | str, second: int | str) -> float:
    """Return the change of the preliminary displacement between two steps, |δ_t,max,2 - δ_t,max,1| [m].

    Steps are positions, where negative ones count from the end, or names of states. InputError: a
    step that the history does not have, or as for `preliminary_displacement`.
    """
    first_position, second_position = (resolve_step(step, history) for step in (first, second))
    greatest = capacity(history).displacement
    return float(abs(greatest[second_position] - greatest[first_position]))


@query(per_step=True, table="time,virgin", planar=True, earlier="preliminary_displacements")
def branch_displacements(history: "xr.Dataset") -> "xr.Dataset":
    """Return the preliminary displacement of the surface under each definition, at the normal load of each step [m].

    Along ``step``, 0 where nothing touches:

    - ``virgin``: from rest until the last asperity slides, δ = max_i θ μ_i δ_i:
      `preliminary_displacement`.
    - ``reversal_to_slip``: from a reversal out of sliding until all slides the other way, 2 δ.
    - ``zero_load_to_slip``: on that branch, from T = 0 on; 2^(1/3) δ on a sphere.
    - ``residual``: the displacement at T = 0, after loading from rest to δ; (2^(1/3) - 1) δ on a
      sphere.

    InputError: a history without some or all of the asperities that touch, or of patches.
    """
    import xarray as xr

    def displacements(virgin: _Virgin) -> tuple[float, ...]:
        reach = float(virgin.reach.max())
        # the branch is the virgin curve doubled: zero load is at half the limit of that
        half = virgin.displacement(0.5 * float(virgin.limit.sum()))
        return reach, 2 * reach, 2 * (reach - half), reach - 2 * half

    values = _evaluate_each_load(history, displacements, len(DISPLACEMENTS))
    columns = zip(DISPLACEMENTS.items(), values.T, strict=True)
    variables = {name: describe("step", column, text, "m") for (name, text), column in columns}
    return xr.Dataset(variables, {"time": history["time"]})


@query(per_step=True, planar=True)
def presliding_work(history: "xr.Dataset") -> "xr.DataArray":
    """Return the mechanical work of pre-sliding at the normal load of each step [J]: the area of the closed loop ±δ.

    The loop turns where the last asperity slides, at the preliminary displacement δ, so it has no
    flat parts. Its area is 8 ∫ F du - 4 δ F(δ) = Σ μ_i N_i (4 δ - 3.2 θ μ_i δ_i); 0.8 μ N δ of one
    asperity. Along ``step``; 0 where nothing touches. InputError: as for `branch_displacements`.
    """

    def work(virgin: _Virgin) -> tuple[float]:
        return (float((virgin.limit * (4 * virgin.reach.max() - 3.2 * virgin.reach)).sum()),)

    values = _evaluate_each_load(history, work, 1)[:, 0]
    text = "mechanical work of pre-sliding, closed loop between ±δ"
    return _along_steps(history, values, "presliding_work", text, "J")


def _along_steps(
    history: "xr.Dataset", values: Floats | Integers, name: str, text: str, unit: str = ""
) -> "xr.DataArray":
    import xarray as xr

    return xr.Dataset({name: describe("step", values, text, unit)}, {"time": history["time"]})[name]


class Capacity(NamedTuple):
    """Greatest θ μ_i δ_i of each step [m], 0 where nothing touches, and its asperity."""

    displacement: Floats
    asperity: Integers  #: its label; of no meaning where nothing touches
    friction: Floats  #: its coefficient


def capacity(history: History) -> Capacity:
    """Return the asperity that slides last at each step, and its displacement."""
    check_all_recorded(history)
    friction = present_friction(history)
    ratio = displacement_ratio(history)
    separation = history["separation"].values
    labels = history["asperity"].values
    result = Capacity(
        np.zeros(separation.size), np.full(separation.size, -1), np.zeros(separation.size)
    )
    steady = not friction.changes and CHANGING_HEIGHT not in history
    columns = _leading(history, friction.at(0)) if steady else np.arange(labels.size)
    if not columns.size:
        return result
    for rows in step_blocks(history, columns.size):
        height = shape_in_step(history, "summit_height", rows)[..., columns]
        coefficient = np.broadcast_to(friction.at(rows), (separation[rows].size, labels.size))[
            :, columns
        ]
        reach = ratio * coefficient * (height - separation[rows, np.newaxis])
        critical = reach.argmax(axis=1)
        result.asperity[rows] = labels[columns[critical]]
        result.friction[rows] = coefficient[np.arange(critical.size), critical]
        result.displacement[rows] = np.maximum(reach.max(axis=1), 0.0)
    return result


def _leading(history: History, friction: Floats) -> Integers:
    """Return the few asperities one of which slides last at any approach, where neither friction nor shape changes."""
    height = history["summit_height"].values
    # none that never touches, or is no higher than another one with more friction
    touching = np.flatnonzero(height > history["separation"].values.min(initial=np.inf))
    order = touching[np.lexsort((-friction[touching], -height[touching]))]
    return order[friction[order] > np.maximum.accumulate(np.append(-1.0, friction[order]))[:-1]]


@attrs.frozen
class _Virgin:
    """Virgin curve at one separation: friction limit μN [N] and θμδ [m] of each asperity in contact."""

    limit: Floats
    reach: Floats

    def displacement(self, load: float) -> float:
        """Solve F(u) = load [N] for loads up to half the limit, by Newton iterations from below."""
        u = 0.0
        for _ in range(100):
            stuck = np.sqrt(np.clip(1 - u / self.reach, 0.0, None))
            missing = load - float((self.limit * (1 - stuck**3)).sum())
            step = missing / float((1.5 * self.limit / self.reach * stuck).sum())
            # F is concave, so that its tangents lie above it and no step leads beyond
            if u + step <= u:
                break
            u += step
        return u

    @classmethod
    def from_history(cls, history: History, step: int, separation: float) -> Self:
        """Return the virgin curve for the asperities of a step, with their friction at the step."""
        height, radius = (
            shape_in_step(history, f"summit_{name}", step) for name in ("height", "radius")
        )
        coefficient = np.broadcast_to(present_friction(history).at(step), height.shape)
        holds = (height > separation) & (coefficient > 0)
        approach = height[holds] - separation
        friction = coefficient[holds]
        modulus = float(history.attrs["contact_modulus"])
        load = 4 / 3 * modulus * np.sqrt(radius[holds]) * approach**1.5
        return cls(friction * load, displacement_ratio(history) * friction * approach)


def first_loading(history: History, normal_load: float, points: int = 101) -> tuple[Floats, Floats]:
    """Return u [m] and F(u) [N] of first loading at a normal load [N], from rest until the last asperity slides.

    The asperities are those of the first step, with the friction that they have there; a load that
    more asperities would carry than are recorded needs ``record = "all"``.
    """
    from scipy import optimize

    target_load = scalar("normal_load", normal_load, above=0)
    check_recorded(history, "summit_radius")
    check_all_recorded(history)
    height, radius = (shape_in_step(history, f"summit_{name}", 0) for name in ("height", "radius"))
    modulus = float(history.attrs["contact_modulus"])
    highest = int(height.argmax())

    def missing(depth: float) -> float:
        loads = (
            4
            / 3
            * modulus
            * np.sqrt(radius)
            * np.maximum(height - height[highest] + depth, 0) ** 1.5
        )
        return float(loads.sum()) - target_load

    # alone the highest one would be pressed most
    upper_approach = float(
        hertz.approach(2 * target_load, summit_radius=radius[highest], contact_modulus=modulus)
    )
    depth = optimize.brentq(missing, 0.0, upper_approach, xtol=1e-300, rtol=1e-15)
    virgin = _Virgin.from_history(history, 0, height[highest] - depth)
    # dense where the curve bends most, at its end
    u = float(virgin.reach.max(initial=0.0)) * (1 - np.linspace(1, 0, points) ** 2)
    stuck = np.sqrt(np.clip(1 - u[:, np.newaxis] / virgin.reach, 0.0, None))
    return u, (virgin.limit * (1 - stuck**3)).sum(axis=1)


def _evaluate_each_load(
    history: History, of_curve: Callable[[_Virgin], tuple[float, ...]], count: int
) -> Floats:
    """Evaluate a function of the virgin curve at each step (step, count); 0 without frictional contact."""
    check_recorded(history, "summit_radius")
    check_all_recorded(history)
    separation = history["separation"].values
    changes = present_friction(history).changes
    # steps of one separation have one curve, where neither friction nor shape changes
    steady = not changes and CHANGING_HEIGHT not in history
    _, indices, inverse = np.unique(separation, return_index=True, return_inverse=True)
    chosen = indices if steady else np.arange(separation.size)
    values = np.zeros((chosen.size, count))
    for row, step in enumerate(chosen):
        virgin = _Virgin.from_history(history, int(step), separation[step])
        if virgin.limit.size:
            values[row] = of_curve(virgin)
    return values[inverse] if steady else values
