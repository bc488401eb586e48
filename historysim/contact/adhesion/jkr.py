"""A contact that adheres inside the contact only, after Johnson, Kendall and Roberts.

Johnson, Kendall and Roberts, *Proc. R. Soc. A* 324 (1971) 301-313.
"""

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.contact.adhesion.contact_units import State
from historysim.contact.adhesion.parameters import elastic
from historysim.contact.adhesion.pull_off import Control, carried, is_load


def jkr_contact_radius(
    normal_load: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Floats:
    """Return the contact radius a [m] of JKR that is stable under a load.

    a³ = (3R/(4E*)) (N + 3πWR + √(6πWRN + (3πWR)²)).

    Parameters
    ----------
    normal_load : array_like
        N [N], ≥ -1.5 πWR.
    summit_radius : array_like
        R [m], > 0.
    contact_modulus : array_like
        E* [Pa], > 0.
    work_of_adhesion : array_like
        W [J/m²], ≥ 0; Hertz at 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    LoadError
        A load beyond pull-off.
    """
    radius, modulus, work = elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    pull_off = jkr_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = carried("normal_load", normal_load, pull_off, "N")
    root = np.sqrt(-4 * pull_off * (load - pull_off))
    return np.cbrt(0.75 * radius / modulus * (load - 2 * pull_off + root))


def jkr_normal_load(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Floats:
    """Return the normal load N [N] of JKR: 4E*a³/(3R) - √(8πWE*a³), on the unstable part too.

    Parameters
    ----------
    contact_radius : array_like
        a [m], ≥ 0.
    summit_radius, contact_modulus, work_of_adhesion : array_like
        R [m], E* [Pa], W [J/m²], as in `jkr_contact_radius`.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    radius, modulus, work = elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - np.sqrt(8 * np.pi * work * modulus * a) * a


def jkr_approach(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Floats:
    """Return the approach δ [m] of JKR: a²/R - √(2πWa/E*). Arguments and errors as in `jkr_normal_load`."""
    radius, modulus, work = elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return a**2 / radius - np.sqrt(2 * np.pi * work * a / modulus)


def jkr_pull_off_load(
    *, summit_radius: npt.ArrayLike, work_of_adhesion: npt.ArrayLike, control: Control = "load"
) -> Floats:
    """Return the normal load N [N], ≤ 0, at which a JKR contact that is pulled apart becomes unstable.

    -(3/2) πWR where the load is controlled; -(5/6) πWR, further down the curve, where the displacement is.

    Parameters
    ----------
    summit_radius : array_like
        R [m], > 0.
    work_of_adhesion : array_like
        W [J/m²], ≥ 0.
    control : {"load", "displacement"}
        What is controlled.

    Raises
    ------
    InputError
        A number that is not finite or out of its range, or another control.
    """
    work = checked("work_of_adhesion", work_of_adhesion, least=0)
    share = 3 / 2 if is_load(control) else 5 / 6
    return -share * np.pi * work * checked("summit_radius", summit_radius, above=0)


def curve(top: Floats, steps: Floats) -> State:
    """Return the equilibria up to a load P: at these shares of the greatest contact radius, and at both turns."""
    radius = np.cbrt(top + 3 + np.sqrt(6 * top + 9)) * steps
    radius = np.union1d(radius, np.cbrt([1 / 6, 3 / 2]))
    return State(radius, radius**3 - np.sqrt(6 * radius) * radius, radius**2 - 2 / 3 * np.sqrt(6 * radius))
