"""What a surface does between rest and sliding at the normal load of a step: displacements and work, in closed form.

At constant normal load the virgin curve of the surface is T = F(u) = Σ μ_i N_i [1 - (1 - u/(θ μ_i δ_i))₊^(3/2)]
(Cattaneo; Mindlin), and a branch from one sliding direction to the other is that curve doubled (Masing).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.results.analysis.recorded import (
    CHANGING_HEIGHT,
    check_all_recorded,
    check_recorded,
    displacement_ratio,
    present_friction,
    shape_of,
)

if TYPE_CHECKING:
    import xarray as xr


DISPLACEMENTS = {
    "virgin": "from rest until the last asperity slides",
    "reversal_to_slip": "from a reversal out of sliding until all slides the other way",
    "zero_load_to_slip": "from zero load on that branch until all slides",
    "residual": "what is left at zero load, after loading from rest until all slides",
}


@attrs.frozen
class _Virgin:
    """The virgin curve at one separation: of each asperity in contact its limit μN [N] and its own θμδ [m]."""

    limit: Floats
    reach: Floats

    def displacement(self, load: float) -> float:
        """Return u at which F(u) is a load [N] of no more than half the limit: Newton, which comes from below."""
        u = 0.0
        for _ in range(100):
            left = np.sqrt(np.clip(1 - u / self.reach, 0.0, None))
            missing = load - float((self.limit * (1 - left**3)).sum())
            step = missing / float((1.5 * self.limit / self.reach * left).sum())
            # F is concave, so that its tangents lie above it and no step leads beyond
            if u + step <= u:
                break
            u += step
        return u


def preliminary_displacements(history: "xr.Dataset") -> "xr.Dataset":
    """Return the preliminary displacement of the surface under each definition, at the normal load of each step.

    Parameters
    ----------
    history : xarray.Dataset
        As for `preliminary_displacement`.

    Returns
    -------
    xarray.Dataset
        Along ``step`` [m], 0 where nothing touches:

        - ``virgin``: from rest until the last asperity slides, δ = max_i θ μ_i δ_i: `preliminary_displacement`.
        - ``reversal_to_slip``: from a reversal out of sliding until all slides the other way, 2 δ.
        - ``zero_load_to_slip``: on that branch, from T = 0 on; 2^(1/3) δ on a sphere.
        - ``residual``: what is left at T = 0, after loading from rest to δ; (2^(1/3) - 1) δ on a sphere.

    Raises
    ------
    InputError
        A history without some or all of the asperities, or of patches.
    """
    import xarray as xr

    def displacements(virgin: _Virgin) -> tuple[float, ...]:
        reach = float(virgin.reach.max())
        # the branch is the virgin curve doubled: zero load is at half the limit of that
        half = virgin.displacement(0.5 * float(virgin.limit.sum()))
        return reach, 2 * reach, 2 * (reach - half), reach - 2 * half

    values = _of_each_load(history, displacements, len(DISPLACEMENTS))
    return xr.Dataset(
        {
            name: ("step", column, {"units": "m", "long_name": text})
            for (name, text), column in zip(DISPLACEMENTS.items(), values.T, strict=True)
        },
        coords={"time": history["time"]},
    )


def first_loading(history: "xr.Dataset", normal_load: float, points: int = 101) -> tuple[Floats, Floats]:
    """Return the curve of first loading at a normal load, from rest until the last asperity slides.

    Parameters
    ----------
    history : xarray.Dataset
        As for `preliminary_displacement`; the asperities are those of its first step, with the friction that they have
        there. A load that more asperities would carry than are recorded needs ``record = "all"``.
    normal_load : float
        N [N], > 0.
    points : int
        Of the curve.

    Returns
    -------
    displacement, load : array (points,)
        u [m] and F(u) [N].

    Raises
    ------
    InputError
        As for `preliminary_displacement`, or a load that is no number greater than 0.
    """
    wanted = scalar("normal_load", normal_load, above=0)
    check_recorded(history, "summit_radius")
    check_all_recorded(history)
    ratio, modulus = displacement_ratio(history), float(history.attrs["contact_modulus"])
    height, radius = (shape_of(history, f"summit_{name}", 0) for name in ("height", "radius"))
    coefficient = np.broadcast_to(present_friction(history).of(0), height.shape)

    def loads(depth: float) -> Floats:
        total_load: Floats = 4 / 3 * modulus * np.sqrt(radius) * np.maximum(height - height.max() + depth, 0) ** 1.5
        return total_load

    depth = _root(lambda depth: float(loads(depth).sum()), wanted)
    virgin = _Virgin(coefficient * loads(depth), ratio * coefficient * np.maximum(height - height.max() + depth, 0))
    holds = virgin.limit > 0
    # dense where the curve bends most, at its end
    u = float(virgin.reach.max(initial=0.0)) * (1 - np.linspace(1, 0, points) ** 2)
    left = np.sqrt(np.clip(1 - u[:, np.newaxis] / virgin.reach[holds], 0.0, None))
    return u, (virgin.limit[holds] * (1 - left**3)).sum(axis=1)


def _root(load_at: Callable[[float], float], wanted: float) -> float:
    """Return the approach at which a load that rises from 0 is reached: bisection."""
    low, high = 0.0, 1e-12
    while load_at(high) < wanted:
        low, high = high, 2 * high
    while (middle := (low + high) / 2) not in {low, high}:
        low, high = (middle, high) if load_at(middle) < wanted else (low, middle)
    return high


def presliding_work(history: "xr.Dataset") -> "xr.DataArray":
    """Return the mechanical work of pre-sliding at the normal load of each step: the area of the closed loop ±δ.

    The loop turns where the last asperity slides, at the preliminary displacement δ, so that it has no flat parts. Its
    area is 8 ∫ F du - 4 δ F(δ) = Σ μ_i N_i (4 δ - 3.2 θ μ_i δ_i); 0.8 μ N δ of one asperity.

    Parameters
    ----------
    history : xarray.Dataset
        As for `preliminary_displacement`.

    Returns
    -------
    xarray.DataArray
        W [J] along ``step``; 0 where nothing touches.

    Raises
    ------
    InputError
        A history without some or all of the asperities, or of patches.
    """
    import xarray as xr

    def work(virgin: _Virgin) -> tuple[float]:
        return (float((virgin.limit * (4 * virgin.reach.max() - 3.2 * virgin.reach)).sum()),)

    return xr.DataArray(
        _of_each_load(history, work, 1)[:, 0],
        dims="step",
        coords={"time": history["time"]},
        name="presliding_work",
        attrs={"units": "J", "long_name": "mechanical work of pre-sliding, closed loop between ±δ"},
    )


def _of_each_load(history: "xr.Dataset", of_curve: Callable[[_Virgin], tuple[float, ...]], count: int) -> Floats:
    """Return what is found of the virgin curve of each step (step, count); 0 where nothing with friction touches."""
    check_recorded(history, "summit_radius")
    check_all_recorded(history)
    ratio, modulus = displacement_ratio(history), float(history.attrs["contact_modulus"])
    changing = CHANGING_HEIGHT in history
    separation, friction = history["separation"].values, present_friction(history)
    known: dict[bytes, tuple[float, ...]] = {}
    values = np.zeros((separation.size, count))
    for step, distance in enumerate(separation):
        coefficient = friction.of(step)
        height, radius = (shape_of(history, f"summit_{name}", step) for name in ("height", "radius"))
        # steps of one separation and one friction have one curve
        key = distance.tobytes() + (coefficient.tobytes() if friction.changes else b"")
        key += height.tobytes() + radius.tobytes() if changing else b""
        if key not in known:
            holds = (height > distance) & (coefficient > 0)
            approach, own = height[holds] - distance, np.broadcast_to(coefficient, height.shape)[holds]
            load = 4 / 3 * modulus * np.sqrt(radius[holds]) * approach**1.5
            known[key] = of_curve(_Virgin(own * load, ratio * own * approach)) if holds.any() else (0.0,) * count
        values[step] = known[key]
    return values
