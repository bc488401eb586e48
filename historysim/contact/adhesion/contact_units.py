"""Contact radius A, load P and approach Δ in units of the contact, in which its elastic constants drop out.

    A = a/(πWR²/K)^(1/3),   P = N/(πWR),   Δ = δ/(π²W²R/K²)^(1/3),   K = 4 E*/3

In these units JKR is one curve, DMT another, and Maugis one curve for each Maugis parameter λ.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats
from historysim.contact.adhesion.parameters import elastic


class State(NamedTuple):
    """A, P and Δ."""

    radius: Floats
    load: Floats
    approach: Floats


class Units(NamedTuple):
    """The units of A, P and Δ in SI."""

    length: Floats
    load: Floats
    approach: Floats


def units(summit_radius: npt.ArrayLike, contact_modulus: npt.ArrayLike, work_of_adhesion: npt.ArrayLike) -> Units:
    """Return the units of A [m], P [N] and Δ [m] of a contact.

    Raises
    ------
    InputError
        A number that is not finite or not positive.
    """
    radius, modulus, work = elastic(summit_radius, contact_modulus, work_of_adhesion)
    load = np.pi * work * radius
    length = np.cbrt(0.75 * load * radius / modulus)
    return Units(length, load, length**2 / radius)
