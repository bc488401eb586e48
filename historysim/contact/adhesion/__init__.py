"""One elastic contact of a sphere and a flat that adhere, after JKR, DMT and Maugis, and which of them holds when.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for
scalars. A normal load N [N] presses the surfaces together when it is positive and pulls when it is
negative; pull-off loads are negative. A contact has ``summit_radius`` R [m], ``contact_modulus`` E*
[Pa], ``work_of_adhesion`` W [J/m²] and ``equilibrium_separation`` z0 [m], all > 0; W may be 0 in
JKR and DMT, where the contact is then Hertz's. Maugis is solved for parameters λ from 1e-12 to
1e12.

In JKR adhesion acts inside the contact only, in DMT outside it only. In Maugis a constant
attraction σ0 acts outside it, 16 W/(9√3 z0), up to a gap of W/σ0. That holds for any Maugis
parameter λ, with DMT at λ → 0 and JKR at λ → ∞.

Every function raises `InputError` for a number that is not finite or out of its range, and
`LoadError` for a load beyond pull-off.

Johnson, Kendall and Roberts, *Proc. R. Soc. A* 324 (1971) 301-313; Derjaguin, Muller and Toporov,
*J. Colloid Interface Sci.* 53 (1975) 314-326; Maugis, *J. Colloid Interface Sci.* 150 (1992)
243-269; Tabor, *J. Colloid Interface Sci.* 58 (1977) 2-13; Johnson and Greenwood, *J. Colloid
Interface Sci.* 192 (1997) 326-333.
"""

import enum
import math
from collections.abc import Callable
from typing import NamedTuple, TypedDict, Unpack

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from historysim.basics.arguments import Floats, as_floats
from historysim.contact import hertz
from historysim.errors import InputError, LoadError

# λ/μ_T = 1.1570…: from σ0 = 16 W/(9√3 z0) and λ = σ0 (9R/(2πWE*²))^(1/3).
MAUGIS_OVER_TABOR: float = 16 / (9 * math.sqrt(3)) * (9 / (2 * math.pi)) ** (1 / 3)
# Maugis parameters between which all digits are found
LEAST_PARAMETER, GREATEST_PARAMETER = 1e-12, 1e12
# Maugis parameters below which `regime` takes DMT, and above which it takes JKR
DMT_BELOW, JKR_ABOVE = 0.1, 5.0
# the share that `regime` neglects: of adhesion in the load, of the elastic compression in z0
NEGLIGIBLE = 0.05


class Elastic(TypedDict):
    """Radius R [m], contact modulus E* [Pa] and work of adhesion W [J/m²] of a contact."""

    summit_radius: ArrayLike
    contact_modulus: ArrayLike
    work_of_adhesion: ArrayLike


class Adhesive(Elastic):
    """A contact with its equilibrium separation z0 [m]."""

    equilibrium_separation: ArrayLike


class _State(NamedTuple):
    """Contact radius and load, as A and P below or in SI."""

    radius: Floats
    load: Floats


def tabor_parameter(*, equilibrium_separation: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the Tabor parameter μ_T [1]: (R W²/(E*² z0³))^(1/3), the elastic neck over the range of the attraction."""
    radius, modulus, work = _elastic(**contact)
    as_floats("work_of_adhesion", work, above=0)
    separation = as_floats("equilibrium_separation", equilibrium_separation, above=0)
    return np.cbrt(radius * (work / modulus) ** 2) / separation


def maugis_parameter(**contact: Unpack[Adhesive]) -> Floats:
    """Return the Maugis parameter λ [1]: σ0 (9R/(2πWE*²))^(1/3), which is 1.157 μ_T."""
    parameter: Floats = MAUGIS_OVER_TABOR * tabor_parameter(**contact)
    return parameter


def load_parameter(
    normal_load: ArrayLike, *, summit_radius: ArrayLike, work_of_adhesion: ArrayLike
) -> Floats:
    """Return the load parameter N/(πWR) [1], negative where the load pulls; W > 0."""
    work = as_floats("work_of_adhesion", work_of_adhesion, above=0)
    return as_floats("normal_load", normal_load) / (
        np.pi * work * as_floats("summit_radius", summit_radius, above=0)
    )


def jkr_contact_radius(normal_load: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the contact radius a [m] of JKR that is stable under a load N ≥ -1.5 πWR; Hertz at W = 0.

    a³ = (3R/(4E*)) (N + 3πWR + √(6πWRN + (3πWR)²)).
    """
    radius, modulus, work = _elastic(**contact)
    pull_off = jkr_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = _clip_to_pull_off("normal_load", normal_load, pull_off, "N")
    # as a product the root is exactly 0 at pull-off
    root = np.sqrt(-4 * pull_off * (load - pull_off))
    return np.cbrt(0.75 * radius / modulus * (load - 2 * pull_off + root))


def jkr_pull_off_load(*, summit_radius: ArrayLike, work_of_adhesion: ArrayLike) -> Floats:
    """Return the normal load N [N], ≤ 0, at which a JKR contact comes apart: -(3/2) πWR."""
    work = as_floats("work_of_adhesion", work_of_adhesion, least=0)
    return -3 / 2 * np.pi * work * as_floats("summit_radius", summit_radius, above=0)


def dmt_contact_radius(normal_load: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the contact radius a [m] of DMT: Hertz under N + 2πWR, N ≥ -2πWR."""
    radius, modulus, work = _elastic(**contact)
    pull_off = dmt_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = _clip_to_pull_off("normal_load", normal_load, pull_off, "N") - pull_off
    depth = hertz.approach(load, summit_radius=radius, contact_modulus=modulus)
    return hertz.contact_radius(depth, summit_radius=radius)


def dmt_pull_off_load(*, summit_radius: ArrayLike, work_of_adhesion: ArrayLike) -> Floats:
    """Return the normal load N [N], ≤ 0, at which a DMT contact comes apart: -2πWR."""
    work = as_floats("work_of_adhesion", work_of_adhesion, least=0)
    return -2 * np.pi * work * as_floats("summit_radius", summit_radius, above=0)


def maugis_contact_radius(normal_load: ArrayLike, **contact: Unpack[Adhesive]) -> Floats:
    """Return the contact radius a [m] of Maugis that is stable under a load no less than `maugis_pull_off_load`."""
    unit, own = _units_and_parameter(**contact)
    load, parameter = np.broadcast_arrays(as_floats("normal_load", normal_load) / unit.load, own)
    turn = _load_turn(parameter)
    least = _state_at(turn, parameter).load
    _clip_to_pull_off("normal_load", normal_load, least * unit.load, "N")
    # no less than the load found at the turn, which rounding may have put above the load asked for
    target = np.maximum(load, least)
    t = _crossing(lambda t: _state_at(t, parameter).load - target, turn)
    return _radius_at(t, parameter) * unit.radius


def maugis_pull_off_load(**contact: Unpack[Adhesive]) -> Floats:
    """Return the normal load N [N] at which a Maugis contact comes apart: -2πWR (λ → 0) to -1.5πWR (λ → ∞)."""
    unit, parameter = _units_and_parameter(**contact)
    return _state_at(_load_turn(parameter), parameter).load * unit.load


def _clip_to_pull_off(name: str, load: ArrayLike, pull_off: ArrayLike, unit: str) -> Floats:
    """Return a load as floats; one a few roundings below the pull-off load is put on it, one below is a LoadError."""
    asked, limit = np.broadcast_arrays(as_floats(name, load), pull_off)
    beyond = asked < limit * (1 + 16 * np.finfo(np.float64).eps)
    if beyond.any():
        raise LoadError(
            f"{name} of {asked[beyond][0]:.9g} {unit} pulls harder than the contact can carry, so there is no "
            f"equilibrium; expected no less than the pull-off load of {limit[beyond][0]:.9g} {unit}"
        )
    carried: Floats = np.maximum(asked, limit)
    return carried


def _elastic(
    summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Return R, E* and W as floats."""
    return (
        as_floats("summit_radius", summit_radius, above=0),
        as_floats("contact_modulus", contact_modulus, above=0),
        as_floats("work_of_adhesion", work_of_adhesion, least=0),
    )


def _units(**contact: Unpack[Elastic]) -> _State:
    """Return the units (πWR²/K)^(1/3) [m] and πWR [N] of A and P, with K = 4 E*/3; W > 0."""
    radius, modulus, work = _elastic(**contact)
    load = np.pi * as_floats("work_of_adhesion", work, above=0) * radius
    return _State(np.cbrt(0.75 * load * radius / modulus), load)


def _units_and_parameter(**contact: Unpack[Adhesive]) -> tuple[_State, Floats]:
    elastic = {name: contact[name] for name in Elastic.__annotations__}  # type: ignore[literal-required]
    return _units(**elastic), _solvable(maugis_parameter(**contact))


# -- Maugis's equations
# ------------------------------------------------------------------------------
#
#     A = a/(πWR²/K)^(1/3),   P = N/(πWR),   K = 4 E*/3
#
# With m = c/a and t = √(m² - 1),
#
#     1 = (λA²/2) [t + (t² - 1) arctan t] + (4λ²A/3) [t arctan t - m + 1]
#     P = A³ - λA² [t + m² arctan t]
#
# A falls as t rises, so that t > 0 names each equilibrium of one λ once.


def _solvable(maugis_parameter: ArrayLike) -> Floats:
    """Return λ as floats, within the range that is solved for."""
    parameter = as_floats("maugis_parameter", maugis_parameter, above=0)
    beyond = (parameter < LEAST_PARAMETER) | (parameter > GREATEST_PARAMETER)
    if beyond.any():
        raise InputError(
            f"the Maugis parameter is {parameter[beyond][0]:g}; expected one between {LEAST_PARAMETER:g} and "
            f"{GREATEST_PARAMETER:g}: check the units of radius, modulus, work of adhesion and equilibrium separation"
        )
    return parameter


def _radius_at(t: Floats, parameter: Floats) -> Floats:
    """Return A, the positive root of the first equation, which is quadratic in A."""
    bending, neck = _brackets(t)
    half = 4 / 3 * parameter**2 * neck
    return 2 / (half + np.sqrt(half**2 + 2 * parameter * bending))


def _state_at(t: Floats, parameter: Floats) -> _State:
    """Return A and P."""
    radius = _radius_at(t, parameter)
    pull = parameter * radius**2 * (t + (1 + t**2) * np.arctan(t))
    return _State(radius, radius**3 - pull)


def _load_turn(parameter: Floats) -> Floats:
    """Return t at the least load."""
    return _crossing(lambda t: _load_slope(t, parameter), 1 / parameter + parameter**-1.5)


def _crossing(falling: Callable[[Floats], Floats], start: Floats) -> Floats:
    """Return the t > 0 at which a falling function passes 0, element by element, to all digits."""
    low = np.asarray(start)
    high = low
    while np.any(above := falling(low) <= 0):
        low, high = np.where(above, low / 8, low), np.where(above, low, high)
    while np.any(below := falling(high) > 0):
        low, high = np.where(below, high, low), np.where(below, high * 8, high)
    for _ in range(56):  # 8/2^56 is half a rounding
        middle = (low + high) / 2
        positive = falling(middle) > 0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    result: Floats = (low + high) / 2
    return result


def _brackets(t: Floats) -> tuple[Floats, Floats]:
    """Return t + (t² - 1) arctan t and t arctan t - m + 1, the brackets of the first equation."""
    # where t is small and digits of t - arctan t are lost, the second bracket or the Hertz load
    # outweighs it
    angle = np.arctan(t)
    return t - angle + t**2 * angle, t * angle - t**2 / (1 + np.hypot(1, t))


def _load_slope(t: Floats, parameter: Floats) -> Floats:
    """Return dP/dA along the curve, by the total differentials of the equations."""
    # the differences of large numbers in them cancel in closed form, which leaves Hertz's slope
    # less positive terms
    radius, angle, square = _radius_at(t, parameter), np.arctan(t), 1 + t**2
    bending, neck = parameter * radius, 4 / 3 * parameter**2
    v = angle - t / square
    w = t**2 / (square * (1 + np.sqrt(square)))
    both = 2 * bending * t * (angle + t / square) + 2 * neck * (angle - w * t)
    slope: Floats = (
        3 * radius**2
        - 4 * bending * (bending * (v + 2 * t * angle**2) + neck * (w + angle**2)) / both
    )
    return slope


# -- the adhesion map
# -------------------------------------------------------------------------------


class Regime(enum.StrEnum):
    """A zone of the adhesion map, and the theory that holds in it."""

    HERTZ = "hertz"
    DMT = "dmt"
    MAUGIS = "maugis"
    JKR = "jkr"
    RIGID = "rigid"

    @property
    def label(self) -> str:
        """The name as it is written: ``"Hertz"``, ``"JKR"``."""
        return self.value.upper() if self in {Regime.DMT, Regime.JKR} else self.value.capitalize()


def regime(
    maugis_parameter: ArrayLike, load_parameter: ArrayLike
) -> Regime | npt.NDArray[np.object_]:
    """Return the zone of a contact in the adhesion map, a `Regime` for scalars.

    The map of Johnson and Greenwood (1997) is used, in their coordinates and with their limit of 5
    %. The zone is the first of these that holds:

    - Hertz, above `hertz_boundary`: adhesion is at most 5 % of the load. This includes contacts
      that are rigid, too, since Hertz gives their contact radius.
    - JKR for λ > 5, and Maugis for λ ≥ 0.1. At these conventional limits the pull-off load of
      Maugis differs by 0.4 % from JKR and by 2.5 % from DMT.
    - rigid (Bradley) below `rigid_boundary`: the elastic compression is less than 5 % of z0.
    - DMT for the rest.

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], between 1e-12 and 1e12.
    load_parameter : array_like
        N/(πWR) [1], negative where it pulls, and not below the pull-off load: -2 for λ < 0.1,
        the value of Maugis beyond.
    """
    parameter = _solvable(maugis_parameter)
    pull_off = np.where(
        parameter < DMT_BELOW, -2.0, _state_at(_load_turn(parameter), parameter).load
    )
    load = _clip_to_pull_off("load_parameter", load_parameter, pull_off, "πWR")
    # the first condition that holds
    zone = np.select(
        [
            load >= hertz_boundary(parameter),
            parameter > JKR_ABOVE,
            parameter >= DMT_BELOW,
            load < rigid_boundary(parameter),
        ],
        [0, 3, 2, 4],
        default=1,
    )
    regimes: Regime | npt.NDArray[np.object_] = np.array(list(Regime), dtype=object)[zone]
    return regimes


def hertz_boundary(maugis_parameter: ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] from which on adhesion is at most 5 % of the load.

    Adhesion is the Hertz load 4E*a³/(3R) at the contact radius, less N. The boundary, found with
    Maugis, is 40 for λ → 0 (DMT, with an adhesion of 2πWR) and 2520 for λ → ∞ (JKR).
    """
    parameter = _solvable(maugis_parameter)

    def excess(t: Floats) -> Floats:
        state = _state_at(t, parameter)
        # A³ is the Hertz load at the contact radius
        return (1 + NEGLIGIBLE) * state.load - state.radius**3

    return _state_at(_crossing(excess, _load_turn(parameter)), parameter).load


def rigid_boundary(maugis_parameter: ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] below which the elastic compression is less than 5 % of z0; λ > 0.

    The compression is the Hertz approach under N + 2πWR, with Bradley's attraction of rigid
    spheres. Over z0 it is (9√3 π/32) λ (N/(πWR) + 2)^(2/3), so that λ > 0.0206 leaves only loads
    that pull.
    """
    unit_over_separation = (
        9 * math.sqrt(3) * math.pi / 32 * as_floats("maugis_parameter", maugis_parameter, above=0)
    )
    return (NEGLIGIBLE / unit_over_separation) ** 1.5 - 2
