"""Drift of one Hertzian contact: how far its preliminary displacement moves when load or friction change.

Parameters are ``normal_load`` N [N], ``tangential_load`` T [N], ``summit_radius`` R [m] and
``friction`` μ, numbers or arrays that broadcast; of load and friction a drift takes two, before and
after. Errors are those of `hertz`.
"""

import numpy as np
from numpy.typing import ArrayLike

from historysim.basics.arguments import Floats, as_floats
from historysim.contact import hertz
from historysim.contact.materials import MaterialPair


def preliminary_displacement(
    pair: MaterialPair, *, normal_load: ArrayLike, summit_radius: ArrayLike, friction: ArrayLike
) -> Floats:
    """Return the displacement at which one virgin contact slides, θ μ δ [m], with the approach δ ∝ N^(2/3) R^(-1/3)."""
    approach = hertz.approach(
        normal_load, summit_radius=summit_radius, contact_modulus=pair.contact_modulus
    )
    return pair.displacement_ratio * as_floats("friction", friction, least=0) * approach


def drift(
    pair: MaterialPair,
    *,
    normal_load: tuple[ArrayLike, ArrayLike],
    summit_radius: ArrayLike,
    friction: tuple[ArrayLike, ArrayLike],
) -> Floats:
    """Return the drift between two states of one contact, |δ_t,max,2 - δ_t,max,1| [m]."""
    before_change, after_change = _displacement_pair(pair, normal_load, summit_radius, friction)
    return np.abs(after_change - before_change)


def branch_drift(
    pair: MaterialPair,
    *,
    normal_load: tuple[ArrayLike, ArrayLike],
    summit_radius: ArrayLike,
    friction: tuple[ArrayLike, ArrayLike],
) -> Floats:
    """Return the branch drift of one contact [m]: the backward branch less the 2 δ1 that it should take, without sign.

    The contact slides forward at the first load, the load changes at a fixed displacement, and the
    contact comes back until it slides. Where of load and friction one rises and the other falls,
    the rise comes first. Where the load has risen the backward branch takes δ1 + δ2, where it has
    fallen 2 δ2. So it drifts by δ2 - δ1 upward, and by 2 (δ1 - δ2) downward (Winogrodzka's Fig.
    6.6, where the ratio of the numbers is reproduced).
    """
    forward, backward = _displacement_pair(pair, normal_load, summit_radius, friction)
    return np.abs(backward_branch(forward, backward) - 2 * forward)


def backward_branch(forward: Floats, backward: Floats) -> Floats:
    """Return the length of a backward branch [m]: what remains of the forward strain plus the new displacement."""
    return np.minimum(forward, backward) + backward


def _displacement_pair(
    pair: MaterialPair,
    normal_load: tuple[ArrayLike, ArrayLike],
    summit_radius: ArrayLike,
    friction: tuple[ArrayLike, ArrayLike],
) -> tuple[Floats, Floats]:
    before_change, after_change = (
        preliminary_displacement(
            pair, normal_load=load, summit_radius=summit_radius, friction=coefficient
        )
        for load, coefficient in zip(normal_load, friction, strict=True)
    )
    return before_change, after_change
