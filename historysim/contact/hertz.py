"""One elastic contact of a sphere and a flat under normal load, after Hertz.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for
scalars. Parameters are ``normal_load`` N ≥ 0 [N], which presses the surfaces together; ``approach``
δ [m], positive from first touch on, negative for a gap; ``summit_radius`` R > 0 [m];
``contact_modulus`` E* > 0 [Pa] of the pair; ``contact_radius`` a ≥ 0 [m], > 0 wherever N > 0; and
the distance ``r`` from the centre of the contact [m], of either sign. A number that is not finite
or out of its range, and a load on a contact radius of 0, raise `InputError`.

Hertz, *J. reine angew. Math.* 92 (1882) 156-171; Johnson, *Contact Mechanics* (1985), section 4.2.
"""

import numpy as np
from numpy.typing import ArrayLike

from historysim.basics.arguments import Floats, as_floats
from historysim.errors import InputError


def contact_radius(approach: ArrayLike, *, summit_radius: ArrayLike) -> Floats:
    """Return the contact radius a [m]: a² = R δ, and 0 where the surfaces are apart."""
    return np.sqrt(as_floats("summit_radius", summit_radius, above=0) * _depth(approach))


def normal_load(
    approach: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike
) -> Floats:
    """Return the normal load N [N]: N = (4/3) E* √R δ^(3/2), and 0 where the surfaces are apart."""
    radius = contact_radius(approach, summit_radius=summit_radius)
    # ∫ 2 E* √(R δ) dδ is two thirds of stiffness times approach
    return 2 / 3 * normal_stiffness(radius, contact_modulus=contact_modulus) * _depth(approach)


def approach(
    normal_load: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike
) -> Floats:
    """Return the approach δ [m] under a normal load: δ = (3 N / (4 E* √R))^(2/3)."""
    load = as_floats("normal_load", normal_load, least=0)
    radius = as_floats("summit_radius", summit_radius, above=0)
    modulus = as_floats("contact_modulus", contact_modulus, above=0)
    return np.cbrt(0.75 * load / (modulus * np.sqrt(radius))) ** 2


def mean_pressure(normal_load: ArrayLike, *, contact_radius: ArrayLike) -> Floats:
    """Return the mean pressure [Pa]: N / (π a²), and 0 where nothing touches (N = a = 0)."""
    load, radius = loaded_contact(normal_load, contact_radius)
    return load / (np.pi * radius**2)


def peak_pressure(normal_load: ArrayLike, *, contact_radius: ArrayLike) -> Floats:
    """Return the pressure in the centre [Pa]: 3 N / (2 π a²)."""
    return 1.5 * mean_pressure(normal_load, contact_radius=contact_radius)


def pressure_profile(r: ArrayLike, *, normal_load: ArrayLike, contact_radius: ArrayLike) -> Floats:
    """Return the pressure p(r) [Pa]: 3 N / (2 π a²) · √(1 - r²/a²), and 0 outside the contact."""
    load, radius = loaded_contact(normal_load, contact_radius)
    return 1.5 * load / (np.pi * radius**3) * half_chord(np.abs(as_floats("r", r)), radius)


def normal_stiffness(contact_radius: ArrayLike, *, contact_modulus: ArrayLike) -> Floats:
    """Return the normal stiffness dN/dδ [N/m]: 2 E* a."""
    radius = as_floats("contact_radius", contact_radius, least=0)
    return 2 * as_floats("contact_modulus", contact_modulus, above=0) * radius


def loaded_contact(normal_load: ArrayLike, contact_radius: ArrayLike) -> tuple[Floats, Floats]:
    """Return normal load [N] and contact radius [m] as floats, with a radius of 1 m where nothing touches.

    There the load is 0 and the contact radius cannot be divided by; any other radius gives the
    right pressure, 0.
    """
    load = as_floats("normal_load", normal_load, least=0)
    radius = as_floats("contact_radius", contact_radius, least=0)
    if np.any((load > 0) & (radius == 0)):
        raise InputError(
            "contact_radius is 0 m under a normal load; expected the contact radius of that load"
        )
    return load, radius + (radius == 0)


def half_chord(r: Floats, radius: ArrayLike) -> Floats:
    """Return √(radius² - r²) for r ≥ 0, and 0 for r ≥ radius, without loss of digits at the edge."""
    square: Floats = np.maximum(np.subtract(radius, r), 0) * np.add(radius, r)
    return np.sqrt(square)


def _depth(approach: ArrayLike) -> Floats:
    return np.maximum(as_floats("approach", approach), 0)
