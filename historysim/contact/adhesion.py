"""One elastic contact of a sphere and a flat that adhere, after JKR, DMT and Maugis, and which of them holds when.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for scalars. A normal
load N presses the surfaces together when it is positive and pulls when it is negative; pull-off loads are negative.
The approach δ is 0 where the undeformed surfaces touch. R is the summit radius, E* the contact modulus of the pair,
W the work of adhesion and z0 the equilibrium separation of the surfaces.

JKR lets adhesion act inside the contact only, DMT outside only. Maugis takes a constant attraction σ0 = 16 W/(9√3 z0)
(the greatest of a Lennard-Jones law) up to a gap of W/σ0, which reaches from the contact radius a to the radius c of
the adhesive zone; it holds for any Maugis parameter λ, with DMT at λ → 0 and JKR at λ → ∞. It is solved in

    A = a/(πWR²/K)^(1/3),   P = N/(πWR),   Δ = δ/(π²W²R/K²)^(1/3),   K = 4 E*/3,   m = c/a,   t = √(m² - 1),

    1 = (λA²/2) [t + (t² - 1) arctan t] + (4λ²A/3) [t arctan t - m + 1]
    P = A³ - λA² [t + m² arctan t]
    Δ = A² - (4/3) λA t

where A falls as t rises, so that t tells every equilibrium of one λ.

Johnson, Kendall and Roberts, *Proc. R. Soc. A* 324 (1971) 301-313; Derjaguin, Muller and Toporov, *J. Colloid
Interface Sci.* 53 (1975) 314-326; Tabor, *J. Colloid Interface Sci.* 58 (1977) 2-13; Maugis, *J. Colloid Interface
Sci.* 150 (1992) 243-269; Johnson and Greenwood, *J. Colloid Interface Sci.* 192 (1997) 326-333.
"""

import enum
import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Values, checked
from historysim.contact import hertz
from historysim.errors import InputError, LoadError

Control = Literal["load", "displacement"]

MAUGIS_OVER_TABOR: float = 16 / (9 * math.sqrt(3)) * (9 / (2 * math.pi)) ** (1 / 3)
"""λ/μ_T = 1.1570…: from σ0 = 16 W/(9√3 z0) and λ = σ0 (9R/(2πWE*²))^(1/3)."""

DMT_BELOW, JKR_ABOVE = 0.1, 5.0
"""The Maugis parameters below which DMT and above which JKR stand for Maugis, in `regime`."""

NEGLIGIBLE = 0.05
"""The share that counts as nothing in `regime`: of adhesion in the load, of the compression in the separation."""

_LAMBDA = 1e-12, 1e12
# so far below the adhesive zone of any λ allowed that a smaller contact has the same load and approach in all digits
_POINT = 1e-60


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


def work_of_adhesion(first: npt.ArrayLike, second: npt.ArrayLike, interfacial: npt.ArrayLike | None = None) -> Values:
    """Return the work of adhesion W [J/m²] of two surfaces: W = γ1 + γ2 - γ12, or 2√(γ1 γ2).

    Parameters
    ----------
    first, second : array_like
        Surface energies γ1, γ2 [J/m²], > 0.
    interfacial : array_like, optional
        Energy γ12 [J/m²] of the interface between them, ≥ 0 and less than γ1 + γ2 (Dupré). Where it is not known, the
        geometric mean of the works of cohesion 2γ1 and 2γ2 is taken, which is good for dispersion forces (Girifalco
        and Good, *J. Phys. Chem.* 61 (1957) 904-909, with Φ = 1). Both give 2γ for one material on itself.

    Raises
    ------
    InputError
        A number that is not finite or out of its range; an interface with more energy than the surfaces.
    """
    energies = checked("first", first, above=0), checked("second", second, above=0)
    if interfacial is None:
        return 2 * np.sqrt(energies[0] * energies[1])
    energy = checked("interfacial", interfacial, least=0)
    work = energies[0] + energies[1] - energy
    if np.any(work <= 0):
        raise InputError(
            f"interfacial is {interfacial!r} J/m² between surfaces of {first!r} and {second!r} J/m², which do not "
            "adhere; expected an interfacial energy less than the sum of the two"
        )
    return work


def tabor_parameter(
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Values:
    """Return the Tabor parameter μ_T [1]: (R W²/(E*² z0³))^(1/3), the elastic neck over the range of the attraction.

    Parameters
    ----------
    summit_radius : array_like
        R [m], > 0.
    contact_modulus : array_like
        E* [Pa], > 0.
    work_of_adhesion : array_like
        W [J/m²], > 0.
    equilibrium_separation : array_like
        z0 [m], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion)
    separation = checked("equilibrium_separation", equilibrium_separation, above=0)
    return np.cbrt(radius * (work / modulus) ** 2) / separation


def maugis_parameter(
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Values:
    """Return the Maugis parameter λ [1]: σ0 (9R/(2πWE*²))^(1/3) with σ0 = 16 W/(9√3 z0), which is 1.157 μ_T.

    Arguments and errors as in `tabor_parameter`.
    """
    return MAUGIS_OVER_TABOR * tabor_parameter(
        summit_radius=summit_radius,
        contact_modulus=contact_modulus,
        work_of_adhesion=work_of_adhesion,
        equilibrium_separation=equilibrium_separation,
    )


def load_parameter(
    normal_load: npt.ArrayLike, *, summit_radius: npt.ArrayLike, work_of_adhesion: npt.ArrayLike
) -> Values:
    """Return the load parameter [1]: N/(πWR).

    Parameters
    ----------
    normal_load : array_like
        N [N], negative where it pulls.
    summit_radius : array_like
        R [m], > 0.
    work_of_adhesion : array_like
        W [J/m²], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    work = checked("work_of_adhesion", work_of_adhesion, above=0)
    return checked("normal_load", normal_load) / (np.pi * work * checked("summit_radius", summit_radius, above=0))


def jkr_contact_radius(
    normal_load: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Values:
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
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    pull_off = jkr_pull_off_load(summit_radius=radius, work_of_adhesion=work)
    load = _carried("normal_load", normal_load, pull_off, "N")
    root = np.sqrt(-4 * pull_off * (load - pull_off))
    return np.cbrt(0.75 * radius / modulus * (load - 2 * pull_off + root))


def jkr_normal_load(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Values:
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
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - np.sqrt(8 * np.pi * work * modulus * a) * a


def jkr_approach(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Values:
    """Return the approach δ [m] of JKR: a²/R - √(2πWa/E*). Arguments and errors as in `jkr_normal_load`."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return a**2 / radius - np.sqrt(2 * np.pi * work * a / modulus)


def jkr_pull_off_load(
    *, summit_radius: npt.ArrayLike, work_of_adhesion: npt.ArrayLike, control: Control = "load"
) -> Values:
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
    share = 3 / 2 if _is_load(control) else 5 / 6
    return -share * np.pi * work * checked("summit_radius", summit_radius, above=0)


def dmt_contact_radius(
    normal_load: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Values:
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
    load = _carried("normal_load", normal_load, pull_off, "N") - pull_off
    depth = hertz.approach(load, summit_radius=summit_radius, contact_modulus=contact_modulus)
    return hertz.contact_radius(depth, summit_radius=summit_radius)


def dmt_normal_load(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
) -> Values:
    """Return the normal load N [N] of DMT: 4E*a³/(3R) - 2πWR. Arguments and errors as in `jkr_normal_load`."""
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion, may_be_zero=True)
    a = checked("contact_radius", contact_radius, least=0)
    return 4 / 3 * modulus * a**3 / radius - 2 * np.pi * work * radius


def dmt_approach(contact_radius: npt.ArrayLike, *, summit_radius: npt.ArrayLike) -> Values:
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


def dmt_pull_off_load(*, summit_radius: npt.ArrayLike, work_of_adhesion: npt.ArrayLike) -> Values:
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


def maugis_contact_radius(
    normal_load: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Values:
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
    scale = _scale(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    load, parameter = np.broadcast_arrays(checked("normal_load", normal_load) / scale.load, scale.parameter)
    turn = _load_turn(parameter)
    _carried("normal_load", normal_load, _state(turn, parameter).load * scale.load, "N")
    # no less than the load found at the turn, which rounding may have put above the load asked for
    target = np.maximum(load, _state(turn, parameter).load)
    t = _crossing(lambda t: _state(t, parameter).load - target, turn)
    return _radius(t, parameter) * scale.length


def maugis_normal_load(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Values:
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
    scale = _scale(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    return _state_at(contact_radius, scale)[1].load * scale.load


def maugis_approach(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Values:
    """Return the approach δ [m] of Maugis, on the unstable part too. Arguments and errors as in `maugis_normal_load`.

    δ = a²/R - 2σ0√(c² - a²)/E*, with the radius c of the adhesive zone.
    """
    scale = _scale(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    return _state_at(contact_radius, scale)[1].approach * scale.approach


def maugis_adhesive_zone_radius(
    contact_radius: npt.ArrayLike,
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> Values:
    """Return the outer radius c [m] of Maugis's adhesive zone, > a. Arguments and errors as in `maugis_normal_load`."""
    scale = _scale(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    t, state = _state_at(contact_radius, scale)
    return np.hypot(1, t) * state.radius * scale.length


def maugis_pull_off_load(
    *,
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
    control: Control = "load",
) -> Values:
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
    scale = _scale(summit_radius, contact_modulus, work_of_adhesion, equilibrium_separation)
    if _is_load(control):
        return _state(_load_turn(scale.parameter), scale.parameter).load * scale.load
    fold = _gap_fold(scale.parameter)
    in_gap = fold < _first_touch(scale.parameter)
    # the contact part of a curve that folds in the gap has no turn: any λ beyond stands in for it
    stand_in = np.where(in_gap, 1.0, scale.parameter)
    in_contact = _state(_approach_turn(stand_in), stand_in).load
    return np.where(in_gap, _gap(fold, scale.parameter)[0], in_contact)[()] * scale.load


def regime(maugis_parameter: npt.ArrayLike, load_parameter: npt.ArrayLike) -> Regime | npt.NDArray[np.object_]:
    """Return the zone of the adhesion map in which a contact lies.

    The map is after Johnson and Greenwood (1997), in their coordinates and with their measure of 5 %. The first of
    these that holds:

    - Hertz, above `hertz_boundary`: adhesion is at most 5 % of the load.
    - JKR for λ > 5, and Maugis for λ ≥ 0.1. At these limits the pull-off load of Maugis differs by 0.4 % from that
      of JKR and by 2.5 % from that of DMT.
    - rigid (Bradley) below `rigid_boundary`: the elastic compression is less than 5 % of z0.
    - DMT for the rest.

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], between 1e-12 and 1e12.
    load_parameter : array_like
        N/(πWR) [1], negative where it pulls, and no less than the pull-off load: -2 for λ < 0.1, that of Maugis
        beyond.

    Returns
    -------
    Regime or array of Regime
        A member for scalars.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    LoadError
        A load beyond pull-off.

    Notes
    -----
    The two fixed values of λ, the same at every load, are those commonly quoted for the limits of DMT and JKR, and a
    choice. So is the order: a contact that is both rigid and dominated by its load is called Hertz, which gives its
    contact radius.
    """
    parameter = _parameter(maugis_parameter)
    pull_off = np.where(parameter < DMT_BELOW, -2.0, _state(_load_turn(parameter), parameter).load)
    load = _carried("load_parameter", load_parameter, pull_off, "πWR")
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
    found: Regime | npt.NDArray[np.object_] = np.array(list(Regime), dtype=object)[zone]
    return found


def hertz_boundary(maugis_parameter: npt.ArrayLike) -> Values:
    """Return the load parameter N/(πWR) [1] from which on adhesion is at most 5 % of the load.

    Adhesion is what the Hertz load 4E*a³/(3R) of the contact radius exceeds N by. Solved with Maugis, it is 40 for
    λ → 0 (DMT, 2πWR) and 2520 for λ → ∞ (JKR).

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], between 1e-12 and 1e12.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    parameter = _parameter(maugis_parameter)

    def excess(t: Values) -> Values:
        state = _state(t, parameter)
        return (1 + NEGLIGIBLE) * state.load - state.radius**3

    return _state(_crossing(excess, _load_turn(parameter)), parameter).load


def rigid_boundary(maugis_parameter: npt.ArrayLike) -> Values:
    """Return the load parameter N/(πWR) [1] below which the elastic compression is less than 5 % of z0.

    The compression is the Hertz approach under N + 2πWR, Bradley's attraction of rigid spheres. Over z0 it is
    (9√3 π/32) λ (N/(πWR) + 2)^(2/3), so that λ > 0.0206 leaves only loads that pull.

    Parameters
    ----------
    maugis_parameter : array_like
        λ [1], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """
    unit_over_separation = 9 * math.sqrt(3) * math.pi / 32 * checked("maugis_parameter", maugis_parameter, above=0)
    return (NEGLIGIBLE / unit_over_separation) ** 1.5 - 2


@attrs.frozen
class Point:
    """A point on an equilibrium curve.

    Attributes
    ----------
    approach : float
        δ [m].
    normal_load : float
        N [N].
    contact_radius : float
        a [m].
    """

    approach: float
    normal_load: float
    contact_radius: float


def _read_only(values: Values) -> Values:
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy


@attrs.frozen(eq=False)
class Branch:
    """The equilibria of one contact, in order from first attraction to the greatest load.

    Along the curve both load and approach fall to one minimum, at different points, and rise after it. From its
    minimum on the curve is stable under control of that quantity; a contact that is pulled apart jumps there.

    Attributes
    ----------
    model : Regime
        The theory.
    approach, normal_load, contact_radius : numpy.ndarray
        δ [m], N [N], a [m], one value per point; read-only. The contact radius is 0 at points where surfaces attract
        each other across a gap.
    """

    model: Regime
    approach: Values = attrs.field(converter=_read_only)
    normal_load: Values = attrs.field(converter=_read_only)
    contact_radius: Values = attrs.field(converter=_read_only)

    @property
    def stable_under_load(self) -> npt.NDArray[np.bool_]:
        """Which points are stable where the load is controlled; the pull-off point is the first."""
        return np.arange(self.normal_load.size) >= self.normal_load.argmin()

    @property
    def stable_under_displacement(self) -> npt.NDArray[np.bool_]:
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
    summit_radius : float
        R [m], > 0.
    contact_modulus : float
        E* [Pa], > 0.
    work_of_adhesion : float
        W [J/m²], > 0. Hertz does not use it.
    max_load : float
        The greatest N [N], > 0.
    equilibrium_separation : float, optional
        z0 [m], > 0; only Maugis uses it, and needs it.
    points : int
        Contact radii from 0 to that of the greatest load, evenly spaced in √a, ≥ 2. The pull-off points come on top,
        and for Maugis as many points across the gap.

    Raises
    ------
    InputError
        Another model, a number that is not finite or out of its range, an array, or Maugis without z0.

    Notes
    -----
    Maugis begins before contact, where the surfaces come within the range W/σ0 of the attraction. Over a circle of
    radius c they then attract each other, N = -πc²σ0 and δ = c²/(2R) - 4σ0c/(πE*) - W/σ0, until their middle touches
    (the uniform pressure of Johnson, *Contact Mechanics* (1985), section 3.4). JKR has no range: its curve begins at
    N = δ = 0. That of DMT begins at contact, with the whole attraction; how this fades across the gap it does not
    tell, so that both pull-off points are the one at which contact is lost.
    """
    theory = _model(model)
    radius, modulus = _single("summit_radius", summit_radius), _single("contact_modulus", contact_modulus)
    work, top = _single("work_of_adhesion", work_of_adhesion), _single("max_load", max_load)
    if isinstance(points, bool) or not isinstance(points, int | np.integer) or points < 2:
        raise InputError(f"points is {points!r}; expected an integer of 2 or more")
    unit, steps = _units(radius, modulus, work), np.linspace(0, 1, points) ** 2
    if theory is Regime.MAUGIS:
        if equilibrium_separation is None:
            raise InputError("equilibrium_separation is missing; expected z0 [m] of the surfaces: Maugis needs it")
        scale = _scale(radius, modulus, work, _single("equilibrium_separation", equilibrium_separation))
        curve = _maugis_curve(scale.parameter, top / unit.load, steps)
    else:
        curve = _CLOSED_FORMS[theory](top / unit.load, steps)
    return Branch(theory, curve.approach * unit.approach, curve.load * unit.load, curve.radius * unit.length)


class _State(NamedTuple):
    """A, P and Δ."""

    radius: Values
    load: Values
    approach: Values


class _Units(NamedTuple):
    """The units of A, P and Δ in SI."""

    length: Values
    load: Values
    approach: Values


class _Scale(NamedTuple):
    """The units of A, P and Δ in SI, and λ."""

    length: Values
    load: Values
    approach: Values
    parameter: Values


def _units(summit_radius: npt.ArrayLike, contact_modulus: npt.ArrayLike, work_of_adhesion: npt.ArrayLike) -> _Units:
    radius, modulus, work = _elastic(summit_radius, contact_modulus, work_of_adhesion)
    load = np.pi * work * radius
    length = np.cbrt(0.75 * load * radius / modulus)
    return _Units(length, load, length**2 / radius)


def _scale(
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    equilibrium_separation: npt.ArrayLike,
) -> _Scale:
    parameter = maugis_parameter(
        summit_radius=summit_radius,
        contact_modulus=contact_modulus,
        work_of_adhesion=work_of_adhesion,
        equilibrium_separation=equilibrium_separation,
    )
    return _Scale(*_units(summit_radius, contact_modulus, work_of_adhesion), _parameter(parameter))


def _radius(t: Values, parameter: Values) -> Values:
    """Return A, the positive root of the first of Maugis's equations, which is quadratic in A."""
    bending, neck = _energies(t)
    half = 4 / 3 * parameter**2 * neck
    return 2 / (half + np.sqrt(half**2 + 2 * parameter * bending))


def _state(t: Values, parameter: Values) -> _State:
    radius = _radius(t, parameter)
    pull = parameter * radius**2 * (t + (1 + t**2) * np.arctan(t))
    return _State(radius, radius**3 - pull, radius**2 - 4 / 3 * parameter * radius * t)


def _state_at(contact_radius: npt.ArrayLike, scale: _Scale) -> tuple[Values, _State]:
    """Return t and the state at a contact radius [m]."""
    radius = np.maximum(checked("contact_radius", contact_radius, least=0) / scale.length, _POINT)
    t = _zone(radius, scale.parameter)
    return t, _state(t, scale.parameter)


def _zone(radius: Values, parameter: Values) -> Values:
    """Return t at A."""
    return _crossing(lambda t: _radius(t, parameter) - radius, 1 / (parameter * radius**1.5))


def _energies(t: Values) -> tuple[Values, Values]:
    """Return t + (t² - 1) arctan t and t arctan t - m + 1, the brackets of Maugis's first equation."""
    # where t is small and digits of t - arctan t are lost, the second bracket or the Hertz load outweighs it
    angle = np.arctan(t)
    return t - angle + t**2 * angle, t * angle - t**2 / (1 + np.hypot(1, t))


def _slopes(t: Values, parameter: Values) -> tuple[Values, Values]:
    """Return dP/dA and dΔ/dA along the curve.

    They follow from the total differentials of Maugis's equations. The differences of large numbers in them cancel
    in closed form, which leaves the slope of Hertz less positive terms.
    """
    radius, angle, square = _radius(t, parameter), np.arctan(t), 1 + t**2
    bending, neck = parameter * radius, 4 / 3 * parameter**2
    v = angle - t / square
    w = t**2 / (square * (1 + np.sqrt(square)))
    both = 2 * bending * t * (angle + t / square) + 2 * neck * (angle - w * t)
    load = 3 * radius**2 - 4 * bending * (bending * (v + 2 * t * angle**2) + neck * (w + angle**2)) / both
    approach = 2 * radius - 8 / 3 * parameter * (bending * v + neck * w) / both
    return load, approach


def _load_turn(parameter: Values) -> Values:
    """Return t at the least load."""
    return _crossing(lambda t: _slopes(t, parameter)[0], 1 / parameter + parameter**-1.5)


def _approach_turn(parameter: Values) -> Values:
    """Return t at the least approach, where this is reached in contact."""
    return _crossing(lambda t: _slopes(t, parameter)[1], 1 / parameter)


def _crossing(falling: Callable[[Values], Values], start: Values) -> Values:
    """Return the t > 0 at which a function turns from positive to negative, element by element, to all digits."""
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
    result: Values = (low + high) / 2
    return result


def _gap(zone: Values, parameter: Values) -> tuple[Values, Values]:
    """Return P and Δ of surfaces that attract each other across a gap, over a circle of radius c/(πWR²/K)^(1/3)."""
    load = -np.pi / 2 * parameter * zone**2
    return load, zone**2 / 2 - 8 / (3 * np.pi) * parameter * zone - 2 / (np.pi * parameter)


def _gap_fold(parameter: Values) -> Values:
    """Return the radius in `_gap` at the least approach."""
    return 8 / (3 * np.pi) * parameter


def _first_touch(parameter: Values) -> Values:
    """Return the radius in `_gap` at which the gap closes in the middle: Maugis's c for a → 0."""
    half = 4 / 3 * parameter**2 * (np.pi / 2 - 1)
    return 2 / (half + np.sqrt(half**2 + np.pi * parameter))


def _hertz_curve(top: Values, steps: Values) -> _State:
    radius = np.cbrt(top) * steps
    return _State(radius, radius**3, radius**2)


def _dmt_curve(top: Values, steps: Values) -> _State:
    radius = np.cbrt(top + 2) * steps
    return _State(radius, radius**3 - 2, radius**2)


def _jkr_curve(top: Values, steps: Values) -> _State:
    radius = np.cbrt(top + 3 + np.sqrt(6 * top + 9)) * steps
    radius = np.union1d(radius, np.cbrt([1 / 6, 3 / 2]))
    return _State(radius, radius**3 - np.sqrt(6 * radius) * radius, radius**2 - 2 / 3 * np.sqrt(6 * radius))


_CLOSED_FORMS = {Regime.HERTZ: _hertz_curve, Regime.DMT: _dmt_curve, Regime.JKR: _jkr_curve}


def _maugis_curve(parameter: Values, top: Values, steps: Values) -> _State:
    touch, fold, turn = _first_touch(parameter), _gap_fold(parameter), _load_turn(parameter)
    folds_in_gap = fold < touch
    turns = turn if folds_in_gap else np.array([turn, _approach_turn(parameter)])
    last = _crossing(lambda t: _state(t, parameter).load - top, turn)
    inner = _zone(_radius(last, parameter) * steps[1:-1], parameter)
    contact = _state(np.sort(np.hstack([last, inner, turns]))[::-1], parameter)
    zone = np.union1d(touch * np.linspace(0, 1, steps.size), fold if folds_in_gap else touch)
    load, approach = _gap(zone, parameter)
    return _State(
        np.concatenate([np.zeros_like(zone), contact.radius]),
        np.concatenate([load, contact.load]),
        np.concatenate([approach, contact.approach]),
    )


def _elastic(
    summit_radius: npt.ArrayLike,
    contact_modulus: npt.ArrayLike,
    work_of_adhesion: npt.ArrayLike,
    *,
    may_be_zero: bool = False,
) -> tuple[Values, Values, Values]:
    """Return R, E* and W as floats."""
    return (
        checked("summit_radius", summit_radius, above=0),
        checked("contact_modulus", contact_modulus, above=0),
        checked("work_of_adhesion", work_of_adhesion, **({"least": 0} if may_be_zero else {"above": 0})),
    )


def _parameter(maugis_parameter: npt.ArrayLike) -> Values:
    """Return λ as floats, within what is solved for."""
    parameter = checked("maugis_parameter", maugis_parameter, above=0)
    beyond = (parameter < _LAMBDA[0]) | (parameter > _LAMBDA[1])
    if beyond.any():
        raise InputError(
            f"the Maugis parameter is {parameter[beyond][0]:g}; expected one between {_LAMBDA[0]:g} and "
            f"{_LAMBDA[1]:g}: check the units of radius, modulus, work of adhesion and equilibrium separation"
        )
    return parameter


def _carried(name: str, load: npt.ArrayLike, pull_off: Values, unit: str) -> Values:
    """Return a load as floats, no less than the pull-off load, which a few roundings may have moved."""
    asked, limit = np.broadcast_arrays(checked(name, load), pull_off)
    beyond = asked < limit * (1 + 16 * np.finfo(np.float64).eps)
    if beyond.any():
        raise LoadError(
            f"{name} of {asked[beyond][0]:.9g} {unit} pulls harder than the contact can carry, so there is no "
            f"equilibrium; expected no less than the pull-off load of {limit[beyond][0]:.9g} {unit}"
        )
    carried: Values = np.maximum(asked, limit)
    return carried


def _is_load(control: Control) -> bool:
    if control not in {"load", "displacement"}:
        raise InputError(f"control is {control!r}; expected 'load' or 'displacement'")
    return control == "load"


def _model(model: Regime | str) -> Regime:
    expected = f"expected one of {', '.join(sorted(map(str, [*_CLOSED_FORMS, Regime.MAUGIS])))}"
    try:
        theory = Regime(model)
    except ValueError:
        raise InputError(f"model is {model!r}; {expected}") from None
    if theory is Regime.RIGID:
        raise InputError(f"model is {theory!r}, whose spheres do not deform in contact; {expected}")
    return theory


def _single(name: str, value: npt.ArrayLike) -> Values:
    number = checked(name, value, above=0)
    if number.ndim:
        raise InputError(f"{name} is an array; expected one number: a branch is that of one contact")
    return number
