"""A contact that adheres within a range of the attraction, after Maugis.

The attraction is constant, σ0 = 16 W/(9√3 z0) (the greatest of a Lennard-Jones law), up to a gap of W/σ0, which
reaches from the contact radius a to the radius c of the adhesive zone.

Maugis, *J. Colloid Interface Sci.* 150 (1992) 243-269; Johnson and Greenwood, *J. Colloid Interface Sci.* 192 (1997)
326-333.
"""

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.contact.adhesion import dugdale
from historysim.contact.adhesion.contact_units import Units, units
from historysim.contact.adhesion.parameters import maugis_parameter
from historysim.contact.adhesion.pull_off import Control, carried, is_load


def maugis_contact_radius(
    normal_load: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Floats:
    """Return the contact radius a [m] of Maugis that is stable under a load.

    Parameters
    ----------
    normal_load : array_like
        N [N], no less than `maugis_pull_off_load`.
    summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation : array_like
        R [m], E* [Pa], W [J/m²], z0 [m], all > 0, with a Maugis parameter between 1e-12 and 1e12.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    LoadError
        A load beyond pull-off.
    """
    unit, own = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    load, parameter = np.broadcast_arrays(checked("normal_load", normal_load) / unit.load, own)
    turn = dugdale.load_turn(parameter)
    carried("normal_load", normal_load, dugdale.state_at(turn, parameter).load * unit.load, "N")
    # no less than the load found at the turn, which rounding may have put above the load asked for
    target = np.maximum(load, dugdale.state_at(turn, parameter).load)
    t = dugdale.crossing(lambda t: dugdale.state_at(t, parameter).load - target, turn)
    return dugdale.radius_at(t, parameter) * unit.length


def maugis_normal_load(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Floats:
    """Return the normal load N [N] of Maugis, on the unstable part too.

    Parameters
    ----------
    contact_radius : array_like
        a [m], ≥ 0; 0 is the first touch of surfaces that attract each other across the gap around it.
    summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation : array_like
        R [m], E* [Pa], W [J/m²], z0 [m], as in `maugis_contact_radius`.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    return dugdale.state_at(_t_at(contact_radius, unit, parameter), parameter).load * unit.load


def maugis_approach(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Floats:
    """Return the approach δ [m] of Maugis, on the unstable part too. Arguments and errors as in `maugis_normal_load`.

    δ = a²/R - 2σ0√(c² - a²)/E*, with the radius c of the adhesive zone.
    """
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    return dugdale.state_at(_t_at(contact_radius, unit, parameter), parameter).approach * unit.approach


def maugis_adhesive_zone_radius(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Floats:
    """Return the outer radius c [m] of Maugis's adhesive zone, > a. Arguments and errors as in `maugis_normal_load`."""
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    t = _t_at(contact_radius, unit, parameter)
    return np.hypot(1, t) * dugdale.radius_at(t, parameter) * unit.length


def maugis_pull_off_load(
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
    control: Control = "load",
) -> Floats:
    """Return the normal load N [N], < 0, at which a Maugis contact that is pulled apart becomes unstable.

    Where the load is controlled it is the least load of the curve, between -2πWR (λ → 0) and -1.5πWR (λ → ∞).

    Where the displacement is controlled it is the load at the least approach: -(5/6) πWR for λ → ∞, -0.93 πWR at
    λ = 0.938. For smaller λ that point lies beyond contact, since the surfaces part and still attract each other
    across a gap as in `branch`; the load there, -(32/(9π)) λ³ πWR, goes to 0.

    Parameters
    ----------
    summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation : array_like
        R [m], E* [Pa], W [J/m²], z0 [m], as in `maugis_contact_radius`.
    control : {"load", "displacement"}
        What is controlled.

    Raises
    ------
    InputError
        A number that is not finite or out of its range, or another control.
    """
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    if is_load(control):
        return dugdale.state_at(dugdale.load_turn(parameter), parameter).load * unit.load
    fold = dugdale.gap_fold(parameter)
    in_gap = fold < dugdale.first_touch(parameter)
    # the contact part of a curve that folds in the gap has no turn: any λ beyond stands in for it
    stand_in = np.where(in_gap, 1.0, parameter)
    in_contact = dugdale.state_at(dugdale.approach_turn(stand_in), stand_in).load
    return np.where(in_gap, dugdale.gap_at(fold, parameter)[0], in_contact)[()] * unit.load


def _units_and_parameter(
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> tuple[Units, Floats]:
    """Return the units of A, P and Δ, and λ."""
    parameter = maugis_parameter(
        summit_radius=summit_radius,
        contact_modulus=contact_modulus,
        work_of_adhesion=work_of_adhesion,
        equilibrium_separation=equilibrium_separation,
    )
    return units(summit_radius, contact_modulus, work_of_adhesion), dugdale.solvable(parameter)


def _t_at(contact_radius: npt.ArrayLike, unit: Units, parameter: Floats) -> Floats:
    """Return t at a contact radius [m]."""
    radius = checked("contact_radius", contact_radius, least=0) / unit.length
    return dugdale.t_at(np.maximum(radius, dugdale.POINT), parameter)
