"""One elastic contact of a sphere and a flat that adhere, after JKR, DMT and Maugis, and which of them holds when.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for scalars. A normal
load N [N] presses the surfaces together when it is positive and pulls when it is negative; pull-off loads are negative.
The approach δ [m] is 0 where the undeformed surfaces touch. A contact has ``summit_radius`` R [m], ``contact_modulus``
E* [Pa], ``work_of_adhesion`` W [J/m²] and ``equilibrium_separation`` z0 [m], all > 0; W may be 0 in JKR and DMT, where
the contact is then Hertz's. Contact radii a [m] are ≥ 0. Maugis is solved for parameters λ from 1e-12 to 1e12.

In JKR adhesion acts inside the contact only, in DMT outside it only. In Maugis a constant attraction σ0 acts outside
it, 16 W/(9√3 z0), up to a gap of W/σ0. That holds for any Maugis parameter λ, with DMT at λ → 0 and JKR at λ → ∞.

Every function raises `InputError` for a number that is not finite or out of its range, and `LoadError` for a load
beyond pull-off.

Johnson, Kendall and Roberts, *Proc. R. Soc. A* 324 (1971) 301-313; Derjaguin, Muller and Toporov, *J. Colloid Interface
Sci.* 53 (1975) 314-326; Maugis, *J. Colloid Interface Sci.* 150 (1992) 243-269; Tabor, *J. Colloid Interface Sci.* 58
(1977) 2-13; Johnson and Greenwood, *J. Colloid Interface Sci.* 192 (1997) 326-333.
"""

import enum
import math
from collections.abc import Callable
from typing import Literal, NamedTuple, TypedDict, Unpack

import attrs
import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from historysim.basics.arguments import Booleans, Floats, checked, scalar
from historysim.contact import hertz
from historysim.errors import InputError, LoadError

# λ/μ_T = 1.1570…: from σ0 = 16 W/(9√3 z0) and λ = σ0 (9R/(2πWE*²))^(1/3).
MAUGIS_OVER_TABOR: float = 16 / (9 * math.sqrt(3)) * (9 / (2 * math.pi)) ** (1 / 3)
LEAST_PARAMETER, GREATEST_PARAMETER = 1e-12, 1e12  # Maugis parameters between which all digits are found
# A contact radius A so small for every λ allowed that a smaller one has the same load and approach in all digits.
SMALLEST_RADIUS = 1e-60
DMT_BELOW, JKR_ABOVE = 0.1, 5.0  # Maugis parameters below which `regime` takes DMT, and above which it takes JKR
NEGLIGIBLE = 0.05  # the share that `regime` neglects: of adhesion in the load, of the elastic compression in z0

Control = Literal["load", "displacement"]  # what is controlled while a contact is pulled apart


class Elastic(TypedDict):
    """Radius R [m], contact modulus E* [Pa] and work of adhesion W [J/m²] of a contact."""

    summit_radius: ArrayLike
    contact_modulus: ArrayLike
    work_of_adhesion: ArrayLike


class Adhesive(Elastic):
    """A contact with its equilibrium separation z0 [m]."""

    equilibrium_separation: ArrayLike


class _State(NamedTuple):
    """Contact radius, load and approach, as A, P and Δ below or in SI."""

    radius: Floats
    load: Floats
    approach: Floats


def tabor_parameter(*, equilibrium_separation: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the Tabor parameter μ_T [1]: (R W²/(E*² z0³))^(1/3), the elastic neck over the range of the attraction."""
    radius, modulus, work = _elastic(**contact)
    checked("work_of_adhesion", work, above=0)
    separation = checked("equilibrium_separation", equilibrium_separation, above=0)
    return np.cbrt(radius * (work / modulus) ** 2) / separation


def maugis_parameter(**contact: Unpack[Adhesive]) -> Floats:
    """Return the Maugis parameter λ [1]: σ0 (9R/(2πWE*²))^(1/3), which is 1.157 μ_T."""
    parameter: Floats = MAUGIS_OVER_TABOR * tabor_parameter(**contact)
    return parameter


def load_parameter(normal_load: ArrayLike, *, summit_radius: ArrayLike, work_of_adhesion: ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1], negative where the load pulls; W > 0."""
    work = checked("work_of_adhesion", work_of_adhesion, above=0)
    return checked("normal_load", normal_load) / (np.pi * work * checked("summit_radius", summit_radius, above=0))


def jkr_contact_radius(normal_load: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the contact radius a [m] of JKR that is stable under a load N ≥ -1.5 πWR; Hertz at W = 0.

    a³ = (3R/(4E*)) (N + 3πWR + √(6πWRN + (3πWR)²)).
    """
    radius, modulus, work = _elastic(**contact)
    pull_off = jkr_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = _carried("normal_load", normal_load, pull_off, "N")
    # as a product the root is exactly 0 at pull-off
    root = np.sqrt(-4 * pull_off * (load - pull_off))
    return np.cbrt(0.75 * radius / modulus * (load - 2 * pull_off + root))


def jkr_normal_load(contact_radius: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the normal load N [N] of JKR: 4E*a³/(3R) - √(8πWE*a³), on the unstable part too."""
    radius, modulus, work = _elastic(**contact)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - np.sqrt(8 * np.pi * work * modulus * a) * a


def jkr_approach(contact_radius: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the approach δ [m] of JKR: a²/R - √(2πWa/E*), on the unstable part too."""
    radius, modulus, work = _elastic(**contact)
    a = checked("contact_radius", contact_radius, least=0)
    return a**2 / radius - np.sqrt(2 * np.pi * work * a / modulus)


def jkr_pull_off_load(*, summit_radius: ArrayLike, work_of_adhesion: ArrayLike, control: Control = "load") -> Floats:
    """Return the normal load N [N], ≤ 0, at which a JKR contact that is pulled apart becomes unstable.

    -(3/2) πWR where the load is controlled; -(5/6) πWR, further down the curve, where the displacement is.
    """
    work = checked("work_of_adhesion", work_of_adhesion, least=0)
    share = 3 / 2 if _is_load(control) else 5 / 6
    return -share * np.pi * work * checked("summit_radius", summit_radius, above=0)


def dmt_contact_radius(normal_load: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the contact radius a [m] of DMT: Hertz under N + 2πWR, N ≥ -2πWR."""
    radius, modulus, work = _elastic(**contact)
    pull_off = dmt_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = _carried("normal_load", normal_load, pull_off, "N") - pull_off
    depth = hertz.approach(load, summit_radius=radius, contact_modulus=modulus)
    return hertz.contact_radius(depth, summit_radius=radius)


def dmt_normal_load(contact_radius: ArrayLike, **contact: Unpack[Elastic]) -> Floats:
    """Return the normal load N [N] of DMT: 4E*a³/(3R) - 2πWR."""
    radius, modulus, work = _elastic(**contact)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - 2 * np.pi * work * radius


def dmt_approach(contact_radius: ArrayLike, *, summit_radius: ArrayLike) -> Floats:
    """Return the approach δ [m] of DMT, equal to the Hertz approach: a²/R."""
    return checked("contact_radius", contact_radius, least=0) ** 2 / checked("summit_radius", summit_radius, above=0)


def dmt_pull_off_load(*, summit_radius: ArrayLike, work_of_adhesion: ArrayLike) -> Floats:
    """Return the normal load N [N], ≤ 0, at which a DMT contact comes apart: -2πWR."""
    work = checked("work_of_adhesion", work_of_adhesion, least=0)
    return -2 * np.pi * work * checked("summit_radius", summit_radius, above=0)


def maugis_contact_radius(normal_load: ArrayLike, **contact: Unpack[Adhesive]) -> Floats:
    """Return the contact radius a [m] of Maugis that is stable under a load no less than `maugis_pull_off_load`."""
    unit, own = _units_and_parameter(**contact)
    load, parameter = np.broadcast_arrays(checked("normal_load", normal_load) / unit.load, own)
    turn = _load_turn(parameter)
    least = _state_at(turn, parameter).load
    _carried("normal_load", normal_load, least * unit.load, "N")
    # no less than the load found at the turn, which rounding may have put above the load asked for
    target = np.maximum(load, least)
    t = _crossing(lambda t: _state_at(t, parameter).load - target, turn)
    return _radius_at(t, parameter) * unit.radius


def maugis_normal_load(contact_radius: ArrayLike, **contact: Unpack[Adhesive]) -> Floats:
    """Return the normal load N [N] of Maugis, on the unstable part too.

    At a = 0 surfaces that attract each other across the gap around first touch.
    """
    t, parameter, unit = _at_radius(contact_radius, **contact)
    return _state_at(t, parameter).load * unit.load


def maugis_approach(contact_radius: ArrayLike, **contact: Unpack[Adhesive]) -> Floats:
    """Return the approach δ [m] of Maugis, on the unstable part too: a²/R - 2σ0√(c² - a²)/E*."""
    t, parameter, unit = _at_radius(contact_radius, **contact)
    return _state_at(t, parameter).approach * unit.approach


def maugis_adhesive_zone_radius(contact_radius: ArrayLike, **contact: Unpack[Adhesive]) -> Floats:
    """Return the outer radius c [m] of the adhesive zone, > a."""
    t, parameter, unit = _at_radius(contact_radius, **contact)
    return np.hypot(1, t) * _radius_at(t, parameter) * unit.radius


def maugis_pull_off_load(*, control: Control = "load", **contact: Unpack[Adhesive]) -> Floats:
    """Return the normal load N [N], < 0, at which a Maugis contact that is pulled apart becomes unstable.

    Where the load is controlled it is the least load of the curve, between -2πWR (λ → 0) and -1.5πWR (λ → ∞).

    Where the displacement is controlled it is the load at the least approach: -(5/6) πWR for λ → ∞, -0.93 πWR at
    λ = 0.938. For smaller λ that point lies beyond contact, since the surfaces part and still attract each other
    across a gap as in `branch`; the load there, -(32/(9π)) λ³ πWR, goes to 0.
    """
    unit, parameter = _units_and_parameter(**contact)
    if _is_load(control):
        return _state_at(_load_turn(parameter), parameter).load * unit.load
    fold = _gap_fold(parameter)
    in_gap = fold < _first_touch(parameter)
    # the contact part of a curve that folds in the gap has no turn: any λ beyond stands in for it
    stand_in = np.where(in_gap, 1.0, parameter)
    in_contact = _state_at(_approach_turn(stand_in), stand_in).load
    return np.where(in_gap, _gap_at(fold, parameter)[0], in_contact)[()] * unit.load


def _carried(name: str, load: ArrayLike, pull_off: ArrayLike, unit: str) -> Floats:
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
    summit_radius: ArrayLike, contact_modulus: ArrayLike, work_of_adhesion: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Return R, E* and W as floats."""
    return (
        checked("summit_radius", summit_radius, above=0),
        checked("contact_modulus", contact_modulus, above=0),
        checked("work_of_adhesion", work_of_adhesion, least=0),
    )


def _units(**contact: Unpack[Elastic]) -> _State:
    """Return the units (πWR²/K)^(1/3) [m], πWR [N] and (π²W²R/K²)^(1/3) [m] of A, P and Δ, with K = 4 E*/3; W > 0."""
    radius, modulus, work = _elastic(**contact)
    load = np.pi * checked("work_of_adhesion", work, above=0) * radius
    length = np.cbrt(0.75 * load * radius / modulus)
    return _State(length, load, length**2 / radius)


def _units_and_parameter(**contact: Unpack[Adhesive]) -> tuple[_State, Floats]:
    elastic = {name: contact[name] for name in Elastic.__annotations__}  # type: ignore[literal-required]
    return _units(**elastic), _solvable(maugis_parameter(**contact))


def _at_radius(contact_radius: ArrayLike, **contact: Unpack[Adhesive]) -> tuple[Floats, Floats, _State]:
    """Return t at a contact radius [m], λ and the units."""
    unit, parameter = _units_and_parameter(**contact)
    radius = checked("contact_radius", contact_radius, least=0) / unit.radius
    return _t_at(np.maximum(radius, SMALLEST_RADIUS), parameter), parameter, unit


# -- Maugis's equations ------------------------------------------------------------------------------
#
#     A = a/(πWR²/K)^(1/3),   P = N/(πWR),   Δ = δ/(π²W²R/K²)^(1/3),   K = 4 E*/3
#
# With m = c/a and t = √(m² - 1),
#
#     1 = (λA²/2) [t + (t² - 1) arctan t] + (4λ²A/3) [t arctan t - m + 1]
#     P = A³ - λA² [t + m² arctan t]
#     Δ = A² - (4/3) λA t
#
# A falls as t rises, so that t > 0 names each equilibrium of one λ once.


def _solvable(maugis_parameter: ArrayLike) -> Floats:
    """Return λ as floats, within the range that is solved for."""
    parameter = checked("maugis_parameter", maugis_parameter, above=0)
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
    """Return A, P and Δ."""
    radius = _radius_at(t, parameter)
    pull = parameter * radius**2 * (t + (1 + t**2) * np.arctan(t))
    return _State(radius, radius**3 - pull, radius**2 - 4 / 3 * parameter * radius * t)


def _t_at(radius: Floats, parameter: Floats) -> Floats:
    """Return t at a contact radius A."""
    return _crossing(lambda t: _radius_at(t, parameter) - radius, 1 / (parameter * radius**1.5))


def _load_turn(parameter: Floats) -> Floats:
    """Return t at the least load."""
    return _crossing(lambda t: _slopes(t, parameter)[0], 1 / parameter + parameter**-1.5)


def _approach_turn(parameter: Floats) -> Floats:
    """Return t at the least approach, where this is reached in contact."""
    return _crossing(lambda t: _slopes(t, parameter)[1], 1 / parameter)


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


def _gap_at(zone: Floats, parameter: Floats) -> tuple[Floats, Floats]:
    """Return P and Δ of surfaces that attract each other across a gap, over a circle of radius c in units of A."""
    # a uniform pressure over a circle (Johnson, section 3.4)
    load = -np.pi / 2 * parameter * zone**2
    return load, zone**2 / 2 - 8 / (3 * np.pi) * parameter * zone - 2 / (np.pi * parameter)


def _gap_fold(parameter: Floats) -> Floats:
    """Return the radius in `_gap_at` at which the approach is least."""
    return 8 / (3 * np.pi) * parameter


def _first_touch(parameter: Floats) -> Floats:
    """Return the radius in `_gap_at` at which the gap closes in the middle: Maugis's c for a → 0."""
    half = 4 / 3 * parameter**2 * (np.pi / 2 - 1)
    return 2 / (half + np.sqrt(half**2 + np.pi * parameter))


def _curve(parameter: Floats, top: Floats, steps: Floats) -> _State:
    """Return all equilibria of one λ up to a load P, at these shares of the greatest contact radius."""
    touch, fold, turn = _first_touch(parameter), _gap_fold(parameter), _load_turn(parameter)
    folds_in_gap = fold < touch
    turns = turn if folds_in_gap else np.array([turn, _approach_turn(parameter)])
    last = _crossing(lambda t: _state_at(t, parameter).load - top, turn)
    # the ends are `last` itself, and the point contact at t = ∞
    inner = _t_at(_radius_at(last, parameter) * steps[1:-1], parameter)
    contact = _state_at(np.sort(np.hstack([last, inner, turns]))[::-1], parameter)
    zone = np.union1d(touch * np.linspace(0, 1, steps.size), fold if folds_in_gap else touch)
    load, approach = _gap_at(zone, parameter)
    return _State(
        np.concatenate([np.zeros_like(zone), contact.radius]),
        np.concatenate([load, contact.load]),
        np.concatenate([approach, contact.approach]),
    )


def _brackets(t: Floats) -> tuple[Floats, Floats]:
    """Return t + (t² - 1) arctan t and t arctan t - m + 1, the brackets of the first equation."""
    # where t is small and digits of t - arctan t are lost, the second bracket or the Hertz load outweighs it
    angle = np.arctan(t)
    return t - angle + t**2 * angle, t * angle - t**2 / (1 + np.hypot(1, t))


def _slopes(t: Floats, parameter: Floats) -> tuple[Floats, Floats]:
    """Return dP/dA and dΔ/dA along the curve, by the total differentials of the equations."""
    # the differences of large numbers in them cancel in closed form, which leaves Hertz's slope less positive terms
    radius, angle, square = _radius_at(t, parameter), np.arctan(t), 1 + t**2
    bending, neck = parameter * radius, 4 / 3 * parameter**2
    v = angle - t / square
    w = t**2 / (square * (1 + np.sqrt(square)))
    both = 2 * bending * t * (angle + t / square) + 2 * neck * (angle - w * t)
    load = 3 * radius**2 - 4 * bending * (bending * (v + 2 * t * angle**2) + neck * (w + angle**2)) / both
    approach = 2 * radius - 8 / 3 * parameter * (bending * v + neck * w) / both
    return load, approach


# -- all equilibria of one contact ------------------------------------------------------------------


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


@attrs.frozen
class Point:
    """A point on an equilibrium curve: approach δ [m], normal load N [N] and contact radius a [m]."""

    approach: float
    normal_load: float
    contact_radius: float


@attrs.frozen(eq=False)
class Branch:
    """The equilibria of one contact, in order from first attraction to the greatest load.

    Along the curve both load and approach fall to one minimum, at different points, and rise after it. From its
    minimum on the curve is stable under control of that quantity; a contact that is pulled apart jumps there.
    """

    model: Regime  #: the theory
    approach: Floats  #: (point) δ [m]
    normal_load: Floats  #: (point) N [N]
    contact_radius: Floats  #: (point) a [m], 0 where surfaces attract each other across a gap

    @property
    def stable_under_load(self) -> Booleans:
        """Which points are stable where the load is controlled; the pull-off point is the first."""
        return np.arange(self.normal_load.size) >= self.normal_load.argmin()

    @property
    def stable_under_displacement(self) -> Booleans:
        """Which points are stable where the displacement is controlled; the pull-off point is the first."""
        return np.arange(self.approach.size) >= self.approach.argmin()

    @property
    def pull_off_under_load(self) -> Point:
        """The last stable point of a contact that is pulled apart by its load: the least load."""
        return self._point(int(self.normal_load.argmin()))

    @property
    def pull_off_under_displacement(self) -> Point:
        """The last stable point of a contact that is pulled apart by displacement: the least approach."""
        return self._point(int(self.approach.argmin()))

    @property
    def jump_in(self) -> Point:
        """The last point of surfaces that approach each other unloaded, before they attract."""
        return Point(float(self.approach[0]), 0.0, 0.0)

    def _point(self, index: int) -> Point:
        return Point(float(self.approach[index]), float(self.normal_load[index]), float(self.contact_radius[index]))


def branch(
    model: Regime | str,
    *,
    summit_radius: float,
    contact_modulus: float,
    work_of_adhesion: float,
    max_load: float,
    equilibrium_separation: float | None = None,
    points: int = 400,
) -> Branch:
    """Return all equilibria of one contact up to a load.

    Parameters
    ----------
    model : Regime or str
        ``"jkr"``, ``"dmt"``, ``"maugis"``, or ``"hertz"`` for a contact without adhesion.
    summit_radius, contact_modulus, work_of_adhesion : float
        R [m], E* [Pa], W [J/m²], > 0. Hertz does not use W.
    max_load : float
        The greatest N [N], > 0.
    equilibrium_separation : float, optional
        z0 [m], > 0; only Maugis uses it, and needs it.
    points : int
        Contact radii from 0 to that of the greatest load, evenly spaced in √a, ≥ 2. The pull-off points are added,
        and for Maugis as many points again across the gap.

    Notes
    -----
    Maugis begins before contact, where the surfaces come within the range W/σ0 of the attraction. Over a circle of
    radius c they then attract each other, N = -πc²σ0 and δ = c²/(2R) - 4σ0c/(πE*) - W/σ0, until their middle touches
    (the uniform pressure of Johnson, *Contact Mechanics* (1985), section 3.4). JKR has no range: its curve begins at
    N = δ = 0. DMT begins at contact with the whole attraction and does not say how this fades across the gap, so
    that both its pull-off points are where contact is lost.
    """
    radius, modulus, work, top = (
        scalar(name, value, above=0)
        for name, value in (
            ("summit_radius", summit_radius),
            ("contact_modulus", contact_modulus),
            ("work_of_adhesion", work_of_adhesion),
            ("max_load", max_load),
        )
    )
    theories = [str(each) for each in Regime if each is not Regime.RIGID]
    if model not in theories:
        raise InputError(f"model is {str(model)!r}; expected one of {', '.join(sorted(theories))}")
    if isinstance(points, bool) or not isinstance(points, int | np.integer) or points < 2:
        raise InputError(f"points is {points!r}; expected an integer of 2 or more")
    unit = _units(summit_radius=radius, contact_modulus=modulus, work_of_adhesion=work)
    # even in √a: the curve bends most at small radii, where both pull-off points lie
    steps = np.linspace(0, 1, points) ** 2
    theory, most = Regime(model), top / unit.load
    if theory is Regime.MAUGIS:
        if equilibrium_separation is None:
            raise InputError("equilibrium_separation is missing; expected z0 [m] of the surfaces: Maugis needs it")
        parameter = maugis_parameter(
            summit_radius=radius,
            contact_modulus=modulus,
            work_of_adhesion=work,
            equilibrium_separation=scalar("equilibrium_separation", equilibrium_separation, above=0),
        )
        curve = _curve(_solvable(parameter), most, steps)
    else:
        curve = _closed_curve(theory, most, steps)
    return Branch(theory, curve.approach * unit.approach, curve.load * unit.load, curve.radius * unit.radius)


def _closed_curve(theory: Regime, top: Floats, steps: Floats) -> _State:
    """Return all equilibria of a theory without λ up to a load P, at these shares of the greatest contact radius."""
    if theory is Regime.JKR:
        # both turns, of the load and of the approach
        radius = np.union1d(np.cbrt(top + 3 + np.sqrt(6 * top + 9)) * steps, np.cbrt([1 / 6, 3 / 2]))
        return _State(radius, radius**3 - np.sqrt(6 * radius) * radius, radius**2 - 2 / 3 * np.sqrt(6 * radius))
    pull = 2 if theory is Regime.DMT else 0
    radius = np.cbrt(top + pull) * steps
    return _State(radius, radius**3 - pull, radius**2)


def regime(maugis_parameter: ArrayLike, load_parameter: ArrayLike) -> Regime | npt.NDArray[np.object_]:
    """Return the zone of the adhesion map in which a contact lies, a `Regime` for scalars.

    The map is that of Johnson and Greenwood (1997), in their coordinates and with their limit of 5 %. The zone is the
    first of these that holds:

    - Hertz, above `hertz_boundary`: adhesion is at most 5 % of the load. This includes contacts that are rigid, too,
      since Hertz gives their contact radius.
    - JKR for λ > 5, and Maugis for λ ≥ 0.1. At these limits, which are commonly quoted and a choice, the pull-off load
      of Maugis differs by 0.4 % from that of JKR and by 2.5 % from that of DMT.
    - rigid (Bradley) below `rigid_boundary`: the elastic compression is less than 5 % of z0.
    - DMT for the rest.

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], between 1e-12 and 1e12.
    load_parameter : array_like
        N/(πWR) [1], negative where it pulls, and no less than the pull-off load: -2 for λ < 0.1, that of Maugis
        beyond.
    """
    parameter = _solvable(maugis_parameter)
    pull_off = np.where(parameter < DMT_BELOW, -2.0, _state_at(_load_turn(parameter), parameter).load)
    load = _carried("load_parameter", load_parameter, pull_off, "πWR")
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

    Adhesion is the Hertz load 4E*a³/(3R) at the contact radius, less N. The boundary, found with Maugis, is 40 for
    λ → 0 (DMT, with an adhesion of 2πWR) and 2520 for λ → ∞ (JKR).
    """
    parameter = _solvable(maugis_parameter)

    def excess(t: Floats) -> Floats:
        state = _state_at(t, parameter)
        # A³ is the Hertz load at the contact radius
        return (1 + NEGLIGIBLE) * state.load - state.radius**3

    return _state_at(_crossing(excess, _load_turn(parameter)), parameter).load


def rigid_boundary(maugis_parameter: ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] below which the elastic compression is less than 5 % of z0; λ > 0.

    The compression is the Hertz approach under N + 2πWR, with Bradley's attraction of rigid spheres. Over z0 it is
    (9√3 π/32) λ (N/(πWR) + 2)^(2/3), so that λ > 0.0206 leaves only loads that pull.
    """
    unit_over_separation = 9 * math.sqrt(3) * math.pi / 32 * checked("maugis_parameter", maugis_parameter, above=0)
    return (NEGLIGIBLE / unit_over_separation) ** 1.5 - 2
