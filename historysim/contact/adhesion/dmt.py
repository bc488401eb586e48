"""A contact that adheres outside the contact only, after Derjaguin, Muller and Toporov: Hertz under a greater load.

Derjaguin, Muller and Toporov, *J. Colloid Interface Sci.* 53 (1975) 314-326.
"""

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.contact import hertz
from historysim.contact.adhesion.contact_units import State
from historysim.contact.adhesion.parameters import elastic
from historysim.contact.adhesion.pull_off import carried


def dmt_contact_radius(
    normal_load: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Floats:
    """Return the contact radius a [m] of DMT: Hertz under N + 2πWR.

    Parameters
    ----------
    normal_load : array_like
        N [N], ≥ -2πWR.
    summit_radius, contact_modulus, work_of_adhesion : array_like
        R [m], E* [Pa], W [J/m²], as in `jkr_contact_radius`.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    LoadError
        A load beyond pull-off.
    """
    pull_off = dmt_pull_off_load(summit_radius=summit_radius, work_of_adhesion=work_of_adhesion)
    load = carried("normal_load", normal_load, pull_off, "N") - pull_off
    depth = hertz.approach(load, summit_radius=summit_radius, contact_modulus=contact_modulus)
    return hertz.contact_radius(depth, summit_radius=summit_radius)


def dmt_normal_load(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Floats:
    """Return the normal load N [N] of DMT: 4E*a³/(3R) - 2πWR. Arguments and errors as in `jkr_normal_load`."""
    radius, modulus, work = elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - 2 * np.pi * work * radius


def dmt_approach(contact_radius: npt.ArrayLike, *, summit_radius: npt.ArrayLike) -> Floats:
    """Return the approach δ [m] of DMT, which is that of Hertz: a²/R.

    Parameters
    ----------
    contact_radius : array_like
        a [m], ≥ 0.
    summit_radius : array_like
        R [m], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    return checked("contact_radius", contact_radius, least=0) ** 2 / checked("summit_radius", summit_radius, above=0)


def dmt_pull_off_load(*, summit_radius: npt.ArrayLike, work_of_adhesion: npt.ArrayLike) -> Floats:
    """Return the normal load N [N], ≤ 0, at which a DMT contact comes apart: -2πWR.

    Parameters
    ----------
    summit_radius : array_like
        R [m], > 0.
    work_of_adhesion : array_like
        W [J/m²], ≥ 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    work = checked("work_of_adhesion", work_of_adhesion, least=0)
    return -2 * np.pi * work * checked("summit_radius", summit_radius, above=0)


def curve(top: Floats, steps: Floats) -> State:
    """Return the equilibria up to a load P, at these shares of the greatest contact radius."""
    radius = np.cbrt(top + 2) * steps
    return State(radius, radius**3 - 2, radius**2)
