"""Drift of one Hertzian contact: how far its preliminary displacement moves when load or friction change."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.contact import hertz, mindlin

if TYPE_CHECKING:
    from historysim.contact.materials import MaterialPair


def preliminary_displacement(
    pair: "MaterialPair", *, normal_load: npt.ArrayLike, summit_radius: npt.ArrayLike, friction: npt.ArrayLike
) -> Floats:
    """Return the displacement at which one virgin contact slides, θ μ δ [m], with the approach δ ∝ N^(2/3) R^(-1/3).

    Parameters
    ----------
    pair : MaterialPair
    normal_load, summit_radius, friction : array_like
        N ≥ 0 [N], R > 0 [m], μ ≥ 0, of shapes that broadcast.

    Raises
    ------
    InputError
        An argument out of its range.
    """
    approach = hertz.approach(normal_load, summit_radius=summit_radius, contact_modulus=pair.contact_modulus)
    return pair.displacement_ratio * checked("friction", friction, least=0) * approach


def drift(
    pair: "MaterialPair",
    *,
    normal_load: tuple[npt.ArrayLike, npt.ArrayLike],
    summit_radius: npt.ArrayLike,
    friction: tuple[npt.ArrayLike, npt.ArrayLike],
) -> Floats:
    """Return the drift between two states of one contact, |δ_t,max,2 - δ_t,max,1| [m].

    Parameters
    ----------
    pair : MaterialPair
    normal_load, friction : pair of array_like
        Before and after.
    summit_radius : array_like

    Raises
    ------
    InputError
        As for `preliminary_displacement`.
    """
    first, second = _before_and_after(pair, normal_load, summit_radius, friction)
    return np.abs(second - first)


def branch_drift(
    pair: "MaterialPair",
    *,
    normal_load: tuple[npt.ArrayLike, npt.ArrayLike],
    summit_radius: npt.ArrayLike,
    friction: tuple[npt.ArrayLike, npt.ArrayLike],
) -> Floats:
    """Return the branch drift of one contact [m]: the backward branch less the 2 δ1 that it should take, without sign.

    The contact slides forward at the first load, the load changes at a fixed displacement, and the contact comes back
    until it slides. Where of load and friction one rises and the other falls, the rise comes first. Where the load has
    risen the backward branch takes δ1 + δ2, where it has fallen 2 δ2. So it drifts by δ2 - δ1 upward, and by
    2 (δ1 - δ2) downward (Winogrodzka's Fig. 6.6, of whose numbers the ratio is reproduced).

    Parameters
    ----------
    pair, normal_load, summit_radius, friction
        As for `drift`.

    Raises
    ------
    InputError
        As for `preliminary_displacement`.
    """
    first, second = _before_and_after(pair, normal_load, summit_radius, friction)
    return np.abs(backward_branch(first, second) - 2 * first)


def backward_branch(first: Floats, second: Floats) -> Floats:
    """Return the displacement of a backward branch [m]: the strain that is left of the forward one, and as far again.

    Parameters
    ----------
    first, second : array
        Preliminary displacements [m] when the contact slid forward, and when it slides backward.
    """
    return np.minimum(first, second) + second


def positioning_error(
    pair: "MaterialPair",
    *,
    tangential_load: npt.ArrayLike,
    normal_load: npt.ArrayLike,
    summit_radius: npt.ArrayLike,
    friction: npt.ArrayLike,
) -> Floats:
    """Return the displacement that is left when the tangential load of one contact goes there and back to 0 [m].

    From the virgin state at a constant normal load; .26 δ_t,max after a load at the friction limit, (2^(1/3) - 1).

    Parameters
    ----------
    pair : MaterialPair
    tangential_load : array_like
        The load at which it turns back [N], |T| ≤ μN.
    normal_load, summit_radius, friction : array_like
        N > 0 [N], R > 0 [m], μ ≥ 0.

    Raises
    ------
    InputError
        An argument out of its range, or |T| > μN.
    """
    approach = hertz.approach(normal_load, summit_radius=summit_radius, contact_modulus=pair.contact_modulus)
    return mindlin.displacement_after_reversal(
        0.0,
        reversal_load=tangential_load,
        normal_load=normal_load,
        contact_radius=hertz.contact_radius(approach, summit_radius=summit_radius),
        shear_modulus=pair.shear_modulus,
        friction=friction,
    )


def _before_and_after(
    pair: "MaterialPair",
    normal_load: tuple[npt.ArrayLike, npt.ArrayLike],
    summit_radius: npt.ArrayLike,
    friction: tuple[npt.ArrayLike, npt.ArrayLike],
) -> tuple[Floats, Floats]:
    first, second = (
        preliminary_displacement(pair, normal_load=load, summit_radius=summit_radius, friction=coefficient)
        for load, coefficient in zip(normal_load, friction, strict=True)
    )
    return first, second
