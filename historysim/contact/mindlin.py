"""One Hertz contact under a constant normal load and a tangential load that changes, after Cattaneo and Mindlin.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for
scalars.

Parameters are ``normal_load`` N [N], ``tangential_load`` T [N], ``contact_radius`` a [m],
``friction`` μ [1], ``shear_modulus`` G* [Pa] of the pair (k_t = 8 G* a), and a distance ``r`` from
the centre [m], of either sign. Tangential load T and displacement δ_t count positive in one and the
same direction; the traction τ [Pa] is the one that carries T, positive along it. A reversal load T*
is the signed load at which the load turned back from virgin loading, or at the other end of a loop
between T* and -T*. q = c/a = (1 - |T|/(μN))^(1/3) is the stick radius over the contact radius.

Every function raises `InputError` for an argument that is not finite or out of its range (N ≥ 0, μ
≥ 0, a > 0 wherever N > 0, G* > 0), for a tangential load beyond the limit μN, at which the contact
slides, and for |T| > |T*|, where the reversal is forgotten and the virgin curve holds; an excess of
a few roundings counts as the limit.

Cattaneo, *Rend. Accad. Naz. Lincei* 27 (1938); Mindlin, *J. Appl. Mech.* 16 (1949) 259-268; Mindlin
and Deresiewicz, *J. Appl. Mech.* 20 (1953) 327-344; Johnson, *Contact Mechanics* (1985), sections
7.2 and 7.4. The use for pre-sliding follows Winogrodzka, *Pre-sliding behaviour of multi asperity
ceramic contacts*, University of Twente.
"""

from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from historysim.basics.arguments import Floats, as_floats
from historysim.contact.hertz import half_chord, loaded_contact
from historysim.errors import InputError


class Slipping(TypedDict):
    """Normal load N [N], contact radius a [m] and friction μ [1] of a contact."""

    normal_load: ArrayLike
    contact_radius: ArrayLike
    friction: ArrayLike


class Contact(Slipping):
    """A contact with the shear modulus G* [Pa] of the pair."""

    shear_modulus: ArrayLike


def stick_radius(tangential_load: ArrayLike, **contact: Unpack[Slipping]) -> Floats:
    """Return the stick radius c [m] on virgin loading: c = a (1 - |T|/(μN))^(1/3).

    It is a at T = 0 and 0 in full slip; also 0 where the limit μN is 0.
    """
    return _utilisation(tangential_load, **contact)[3] * _radius(**contact)


def counter_slip_radius(
    tangential_load: ArrayLike, *, reversal_load: ArrayLike, **contact: Unpack[Slipping]
) -> Floats:
    """Return the radius b [m] that slip has reached after a reversal: b = a (1 - |T* - T|/(2μN))^(1/3)."""
    _, half = _since_reversal(tangential_load, reversal_load)
    _utilisation(reversal_load, "reversal_load", **contact)
    return stick_radius(half, **contact)


def preliminary_displacement(*, shear_modulus: ArrayLike, **contact: Unpack[Slipping]) -> Floats:
    """Return the displacement at which full slip begins [m]: δ_t,max = 3 μN / (16 a G*).

    It equals θ μ δ, with the approach δ and the displacement ratio θ = E*/(4 G*) of the pair.
    """
    return 3 * _utilisation(0.0, **contact)[1] / (16 * _radius(**contact) * _modulus(shear_modulus))


def tangential_displacement(
    tangential_load: ArrayLike, *, shear_modulus: ArrayLike, **contact: Unpack[Slipping]
) -> Floats:
    """Return the tangential displacement on virgin loading [m], odd in T.

    δ_t = (3μN)/(16 a G*) · [1 - (1 - T/(μN))^(2/3)] for T ≥ 0, evaluated as
    3T/(16 a G*) · (1 + q)/(1 + q + q²).
    """
    radius = _radius(**contact)
    load, _, _, q = _utilisation(tangential_load, **contact)
    # the form with 1 - q² in it would lose its digits near T = 0
    return 3 * load / (16 * radius * _modulus(shear_modulus)) * (1 + q) / (1 + q + q**2)


def displacement_after_reversal(
    tangential_load: ArrayLike, *, reversal_load: ArrayLike, **contact: Unpack[Contact]
) -> Floats:
    """Return the tangential displacement after the load has turned back at T* [m].

    For T* > 0 this is unloading, δ = (3μN)/(16 a G*) · [2 (1 - (T* - T)/(2μN))^(2/3) - (1 -
    T*/(μN))^(2/3) - 1]; for T* < 0 reloading, its mirror image δ(T; T*) = -δ(-T; -T*). Both are the
    virgin curve δ_t scaled by two and hung at the reversal point (Masing): δ = δ_t(T*) + 2 δ_t((T -
    T*)/2). Winogrodzka's Eq. 2.13; her Eqs. A.2 and A.3 print T and T* exchanged in the last term.
    """
    turned, half = _since_reversal(tangential_load, reversal_load)
    return tangential_displacement(turned, **contact) + 2 * tangential_displacement(half, **contact)


def tangential_stiffness(radius: ArrayLike, *, shear_modulus: ArrayLike) -> Floats:
    """Return the tangential stiffness dT/dδ_t [N/m]: 8 G* times the radius [m] of the circle that sticks.

    That is a, for the initial stiffness and immediately after a reversal (k_t = 8 G* a;
    Winogrodzka, Eq. 4.3), `stick_radius` along virgin loading, and `counter_slip_radius` after a
    reversal.
    """
    return 8 * _modulus(shear_modulus) * as_floats("radius", radius, least=0)


def traction(r: ArrayLike, *, tangential_load: ArrayLike, **contact: Unpack[Slipping]) -> Floats:
    """Return the traction τ(r) on virgin loading [Pa], odd in T, and 0 outside the contact.

    τ(r) = (3μN)/(2πa³) · [√(a² - r²) - √(c² - r²)] for T ≥ 0, the second root only for r < c. Its
    integral over the contact is T, and |τ| ≤ μ p(r).
    """
    radius = _radius(**contact)
    load, limit, f, q = _utilisation(tangential_load, **contact)
    distance = np.abs(as_floats("r", r))
    outer, inner = half_chord(distance, radius), half_chord(distance, q * radius)
    # √(a² - r²) - √(c² - r²) loses digits near T = 0; a² - c² over their sum does not
    one_less_square = f * (1 + q) / (1 + q + q**2)
    sum_of_roots = np.where(inner > 0, outer + inner, 1)
    roots = np.where(inner > 0, radius**2 * one_less_square / sum_of_roots, outer)
    return np.sign(load) * (1.5 * limit / (np.pi * radius**3)) * roots


def traction_after_reversal(
    r: ArrayLike,
    *,
    tangential_load: ArrayLike,
    reversal_load: ArrayLike,
    **contact: Unpack[Slipping],
) -> Floats:
    """Return the traction τ(r) after the load has turned back at T* [Pa], and 0 outside the contact.

    For T* > 0, τ(r) = -(3μN)/(2πa³) · [√(a² - r²) - 2√(b² - r²) + √(c² - r²)], each root only
    inside its radius, with the stick radius c at T* and the radius b of `counter_slip_radius`; the
    mirror image for T* < 0. It is the virgin traction of T* plus twice the virgin traction of (T - T*)/2. Its
    integral over the contact is T, and |τ| ≤ μ p(r).
    """
    turned, half = _since_reversal(tangential_load, reversal_load)
    return traction(r, tangential_load=turned, **contact) + 2 * traction(
        r, tangential_load=half, **contact
    )


def dissipated_energy_per_loop(
    amplitude: ArrayLike, *, shear_modulus: ArrayLike, **contact: Unpack[Slipping]
) -> Floats:
    """Return the energy dissipated in one closed loop between T* and -T* [J], ≥ 0.

    ΔW = 9μ²N²/(10 a G*) · {1 - (1-f)^(5/3) - (5f/6)[1 + (1-f)^(2/3)]} with f = T*/(μN), evaluated as
    3μ²N²/(20 a G*) · (1-q)³ (1 + 3q + q²): the same polynomial in q = (1-f)^(1/3) with its triple
    root at q = 1 taken out, so that it keeps all digits for small f, where ΔW → T*³/(36 a G* μN).
    """
    _, limit, f, q = _utilisation(
        as_floats("amplitude", amplitude, least=0), "amplitude", **contact
    )
    one_less_q = f / (1 + q + q**2)
    return (
        0.15
        * limit**2
        / (_radius(**contact) * _modulus(shear_modulus))
        * one_less_q**3
        * (1 + 3 * q + q**2)
    )


def _utilisation(
    tangential_load: ArrayLike, name: str = "tangential_load", **contact: Unpack[Slipping]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return T, μN, f = |T|/(μN) and q = (1 - f)^(1/3); f = q = 0 where μN = 0: such a contact slides freely."""
    load = as_floats(name, tangential_load)
    limit = as_floats("friction", contact["friction"], least=0) * as_floats(
        "normal_load", contact["normal_load"], least=0
    )
    size = _within(
        name,
        load,
        limit,
        "the limit friction × normal_load",
        "the contact slides beyond it: reduce the load",
    )
    divisor = limit + (limit == 0)
    # limit - size is exact near the limit, where 1 - f would have lost its digits
    return load, limit, size / divisor, np.cbrt((limit - size) / divisor)


def _since_reversal(tangential_load: ArrayLike, reversal_load: ArrayLike) -> tuple[Floats, Floats]:
    """Return T* and (T - T*)/2."""
    turned = as_floats("reversal_load", reversal_load)
    load = as_floats("tangential_load", tangential_load)
    advice = (
        "the contact has forgotten the reversal beyond it: use the functions for virgin loading"
    )
    _within("tangential_load", load, np.abs(turned), "the reversal load", advice)
    return turned, (load - turned) / 2


def _within(name: str, values: Floats, limit: Floats, limit_name: str, advice: str) -> Floats:
    """Return |values|, no larger than the limit, which a few roundings may have moved."""
    size, bound = np.broadcast_arrays(np.abs(values), limit)
    beyond = size > bound * (1 + 8 * np.finfo(np.float64).eps)
    if beyond.any():
        raise InputError(
            f"{name} of {size[beyond][0]:.9g} N exceeds {limit_name} = {bound[beyond][0]:.9g} N; {advice}"
        )
    within: Floats = np.minimum(size, bound)
    return within


def _radius(normal_load: ArrayLike, contact_radius: ArrayLike, **_: ArrayLike) -> Floats:
    return loaded_contact(normal_load, contact_radius)[1]


def _modulus(shear_modulus: ArrayLike) -> Floats:
    return as_floats("shear_modulus", shear_modulus, above=0)
