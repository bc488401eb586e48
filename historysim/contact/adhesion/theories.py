"""One adhesive contact of a sphere and a flat by JKR, DMT and Maugis; symbols, units and errors in the package.

Johnson, Kendall and Roberts, *Proc. R. Soc. A* 324 (1971) 301-313; Derjaguin, Muller and Toporov, *J. Colloid Interface
Sci.* 53 (1975) 314-326; Maugis, *J. Colloid Interface Sci.* 150 (1992) 243-269, with the attraction σ0 = 16 W/(9√3 z0)
up to a gap of W/σ0; Tabor, *J. Colloid Interface Sci.* 58 (1977) 2-13.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.contact import hertz
from historysim.contact.adhesion import dugdale
from historysim.errors import InputError, LoadError

MAUGIS_OVER_TABOR: float = 16 / (9 * math.sqrt(3)) * (9 / (2 * math.pi)) ** (1 / 3)
"""λ/μ_T = 1.1570…: from σ0 = 16 W/(9√3 z0) and λ = σ0 (9R/(2πWE*²))^(1/3)."""

Control = Literal["load", "displacement"]
"""What is controlled while a contact is pulled apart."""


class Units(NamedTuple):
    """SI units of the dimensionless radius A [m], load P [N] and approach Δ [m]."""

    length: Floats
    load: Floats
    approach: Floats


def units(summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike) -> Units:
    """Return the units (πWR²/K)^(1/3), πWR and (π²W²R/K²)^(1/3) of a contact, with K = 4 E*/3."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion)
    load = np.pi * work * radius
    length = np.cbrt(0.75 * load * radius / modulus)
    return Units(length, load, length**2 / radius)


def tabor_parameter(
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
) -> Floats:
    """Return the Tabor parameter μ_T [1]: (R W²/(E*² z0³))^(1/3), the elastic neck over the range of the attraction."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion)
    separation = checked("equilibrium_separation", equilibrium_separation, above=0)
    return np.cbrt(radius * (work / modulus) ** 2) / separation


def maugis_parameter(
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
) -> Floats:
    """Return the Maugis parameter λ [1]: σ0 (9R/(2πWE*²))^(1/3), which is 1.157 μ_T."""
    return MAUGIS_OVER_TABOR * tabor_parameter(
        summit_radius=summit_radius,
        contact_modulus=contact_modulus,
        work_of_adhesion=work_of_adhesion,
        equilibrium_separation=equilibrium_separation,
    )


def load_parameter(normal_load: ArrayLike, *, summit_radius: ArrayLike, work_of_adhesion: ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1], negative where the load pulls; W > 0."""
    work = checked("work_of_adhesion", work_of_adhesion, above=0)
    return checked("normal_load", normal_load) / (np.pi * work * checked("summit_radius", summit_radius, above=0))


def jkr_contact_radius(
    normal_load: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> Floats:
    """Return the contact radius a [m] of JKR that is stable under a load N ≥ -1.5 πWR; Hertz at W = 0.

    a³ = (3R/(4E*)) (N + 3πWR + √(6πWRN + (3πWR)²)).
    """
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    pull_off = jkr_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = carried("normal_load", normal_load, pull_off, "N")
    root = np.sqrt(-4 * pull_off * (load - pull_off))
    return np.cbrt(0.75 * radius / modulus * (load - 2 * pull_off + root))


def jkr_normal_load(
    contact_radius: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> Floats:
    """Return the normal load N [N] of JKR: 4E*a³/(3R) - √(8πWE*a³), on the unstable part too."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - np.sqrt(8 * np.pi * work * modulus * a) * a


def jkr_approach(
    contact_radius: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> Floats:
    """Return the approach δ [m] of JKR: a²/R - √(2πWa/E*), on the unstable part too."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return a**2 / radius - np.sqrt(2 * np.pi * work * a / modulus)


def jkr_pull_off_load(*, summit_radius: ArrayLike, work_of_adhesion: ArrayLike, control: Control = "load") -> Floats:
    """Return the normal load N [N], ≤ 0, at which a JKR contact that is pulled apart becomes unstable.

    -(3/2) πWR where the load is controlled; -(5/6) πWR, further down the curve, where the displacement is.
    """
    work = checked("work_of_adhesion", work_of_adhesion, least=0)
    share = 3 / 2 if _is_load(control) else 5 / 6
    return -share * np.pi * work * checked("summit_radius", summit_radius, above=0)


def dmt_contact_radius(
    normal_load: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> Floats:
    """Return the contact radius a [m] of DMT: Hertz under N + 2πWR, N ≥ -2πWR."""
    pull_off = dmt_pull_off_load(summit_radius=summit_radius, work_of_adhesion=work_of_adhesion)
    load = carried("normal_load", normal_load, pull_off, "N") - pull_off
    depth = hertz.approach(load, summit_radius=summit_radius, contact_modulus=contact_modulus)
    return hertz.contact_radius(depth, summit_radius=summit_radius)


def dmt_normal_load(
    contact_radius: ArrayLike, *, summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> Floats:
    """Return the normal load N [N] of DMT: 4E*a³/(3R) - 2πWR."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - 2 * np.pi * work * radius


def dmt_approach(contact_radius: ArrayLike, *, summit_radius: ArrayLike) -> Floats:
    """Return the approach δ [m] of DMT, which is that of Hertz: a²/R."""
    return checked("contact_radius", contact_radius, least=0) ** 2 / checked("summit_radius", summit_radius, above=0)


def dmt_pull_off_load(*, summit_radius: ArrayLike, work_of_adhesion: ArrayLike) -> Floats:
    """Return the normal load N [N], ≤ 0, at which a DMT contact comes apart: -2πWR."""
    work = checked("work_of_adhesion", work_of_adhesion, least=0)
    return -2 * np.pi * work * checked("summit_radius", summit_radius, above=0)


def maugis_contact_radius(
    normal_load: ArrayLike,
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
) -> Floats:
    """Return the contact radius a [m] of Maugis that is stable under a load no less than `maugis_pull_off_load`."""
    unit, own = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    load, parameter = np.broadcast_arrays(checked("normal_load", normal_load) / unit.load, own)
    turn = dugdale.load_turn(parameter)
    least = dugdale.state_at(turn, parameter).load
    carried("normal_load", normal_load, least * unit.load, "N")
    # no less than the load found at the turn, which rounding may have put above the load asked for
    target = np.maximum(load, least)
    t = dugdale.crossing(lambda t: dugdale.state_at(t, parameter).load - target, turn)
    return dugdale.radius_at(t, parameter) * unit.length


def maugis_normal_load(
    contact_radius: ArrayLike,
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
) -> Floats:
    """Return the normal load N [N] of Maugis, on the unstable part too.

    At a = 0 surfaces that attract each other across the gap around first touch.
    """
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    return dugdale.state_at(_t_at(contact_radius, unit, parameter), parameter).load * unit.load


def maugis_approach(
    contact_radius: ArrayLike,
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
) -> Floats:
    """Return the approach δ [m] of Maugis, on the unstable part too: a²/R - 2σ0√(c² - a²)/E*."""
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    return dugdale.state_at(_t_at(contact_radius, unit, parameter), parameter).approach * unit.approach


def maugis_adhesive_zone_radius(
    contact_radius: ArrayLike,
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
) -> Floats:
    """Return the outer radius c [m] of Maugis's adhesive zone, > a."""
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    t = _t_at(contact_radius, unit, parameter)
    return np.hypot(1, t) * dugdale.radius_at(t, parameter) * unit.length


def maugis_pull_off_load(
    *,
    summit_radius: ArrayLike,
    contact_modulus: ArrayLike,
    work_of_adhesion: ArrayLike,
    equilibrium_separation: ArrayLike,
    control: Control = "load",
) -> Floats:
    """Return the normal load N [N], < 0, at which a Maugis contact that is pulled apart becomes unstable.

    Where the load is controlled it is the least load of the curve, between -2πWR (λ → 0) and -1.5πWR (λ → ∞).

    Where the displacement is controlled it is the load at the least approach: -(5/6) πWR for λ → ∞, -0.93 πWR at
    λ = 0.938. For smaller λ that point lies beyond contact, since the surfaces part and still attract each other
    across a gap as in `branch`; the load there, -(32/(9π)) λ³ πWR, goes to 0.
    """
    unit, parameter = _units_and_parameter(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    if _is_load(control):
        return dugdale.state_at(dugdale.load_turn(parameter), parameter).load * unit.load
    fold = dugdale.gap_fold(parameter)
    in_gap = fold < dugdale.first_touch(parameter)
    # the contact part of a curve that folds in the gap has no turn: any λ beyond stands in for it
    stand_in = np.where(in_gap, 1.0, parameter)
    in_contact = dugdale.state_at(dugdale.approach_turn(stand_in), stand_in).load
    return np.where(in_gap, dugdale.gap_at(fold, parameter)[0], in_contact)[()] * unit.load


def carried(name: str, load: ArrayLike, pull_off: ArrayLike, unit: str) -> Floats:
    """Return a load as floats; one a few roundings below the pull-off load is put on it, one below is a LoadError."""
    asked, limit = np.broadcast_arrays(checked(name, load), pull_off)
    beyond = asked < limit * (1 + 16 * np.finfo(np.float64).eps)
    if beyond.any():
        raise LoadError(
            f"{name} of {asked[beyond][0]:.9g} {unit} pulls harder than the contact can carry, so there is no "
            f"equilibrium; expected no less than the pull-off load of {limit[beyond][0]:.9g} {unit}"
        )
    carried: Floats = np.maximum(asked, limit)
    return carried


def _is_load(control: Control) -> bool:
    if control not in {"load", "displacement"}:
        raise InputError(f"control is {control!r}; expected 'load' or 'displacement'")
    return control == "load"


def _elastic(
    summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike, *, may_be_zero: bool = False
) -> tuple[Floats, Floats, Floats]:
    """Return R, E* and W as floats; W may be 0 on request."""
    return (
        checked("summit_radius", summit_radius, above=0),
        checked("contact_modulus", contact_modulus, above=0),
        checked("work_of_adhesion", work_of_adhesion, **({"least": 0} if may_be_zero else {"above": 0})),
    )


def _units_and_parameter(
    summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike, separation: ArrayLike
) -> tuple[Units, Floats]:
    parameter = maugis_parameter(
        summit_radius=summit_radius,
        contact_modulus=contact_modulus,
        work_of_adhesion=work_of_adhesion,
        equilibrium_separation=separation,
    )
    return units(summit_radius, contact_modulus, work_of_adhesion), dugdale.solvable(parameter)


def _t_at(contact_radius: ArrayLike, unit: Units, parameter: Floats) -> Floats:
    radius = checked("contact_radius", contact_radius, least=0) / unit.length
    return dugdale.t_at(np.maximum(radius, dugdale.SMALLEST_RADIUS), parameter)
