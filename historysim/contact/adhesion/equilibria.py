"""All equilibria of one contact by one of the theories, and the adhesion map: which theory holds for a contact.

Johnson and Greenwood, *J. Colloid Interface Sci.* 192 (1997) 326-333.
"""

import enum
import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Booleans, Floats
from historysim.basics.frozen_arrays import FrozenArrays
from historysim.contact.adhesion import dugdale
from historysim.contact.adhesion.dugdale import State
from historysim.contact.adhesion.theories import carried, maugis_parameter, units
from historysim.errors import InputError

DMT_BELOW, JKR_ABOVE = 0.1, 5.0
"""The Maugis parameters below which `regime` takes DMT, and above which it takes JKR, for Maugis."""

NEGLIGIBLE = 0.05
"""The share that `regime` neglects: of adhesion in the load, of the elastic compression in z0."""


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


def _read_only(values: Floats) -> Floats:
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy


@attrs.frozen(eq=False, getstate_setstate=False)
class Branch(FrozenArrays):
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
    approach: Floats = attrs.field(converter=_read_only)
    normal_load: Floats = attrs.field(converter=_read_only)
    contact_radius: Floats = attrs.field(converter=_read_only)

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

    Raises
    ------
    InputError
        Another model, a number that is not finite or out of its range, an array, or Maugis without z0.

    Notes
    -----
    Maugis begins before contact, where the surfaces come within the range W/σ0 of the attraction. Over a circle of
    radius c they then attract each other, N = -πc²σ0 and δ = c²/(2R) - 4σ0c/(πE*) - W/σ0, until their middle touches
    (the uniform pressure of Johnson, *Contact Mechanics* (1985), section 3.4). JKR has no range: its curve begins at
    N = δ = 0. DMT begins at contact with the whole attraction and does not say how this fades across the gap, so
    that both its pull-off points are where contact is lost.
    """
    theory = _theory(model)
    radius, modulus = _single("summit_radius", summit_radius), _single("contact_modulus", contact_modulus)
    work, top = _single("work_of_adhesion", work_of_adhesion), _single("max_load", max_load)
    if isinstance(points, bool) or not isinstance(points, int | np.integer) or points < 2:
        raise InputError(f"points is {points!r}; expected an integer of 2 or more")
    unit, steps = units(radius, modulus, work), np.linspace(0, 1, points) ** 2
    if theory is Regime.MAUGIS:
        if equilibrium_separation is None:
            raise InputError("equilibrium_separation is missing; expected z0 [m] of the surfaces: Maugis needs it")
        parameter = maugis_parameter(
            summit_radius=radius,
            contact_modulus=modulus,
            work_of_adhesion=work,
            equilibrium_separation=_single("equilibrium_separation", equilibrium_separation),
        )
        curve = dugdale.curve(dugdale.solvable(parameter), top / unit.load, steps)
    else:
        curve = _CLOSED_FORMS[theory](top / unit.load, steps)
    return Branch(theory, curve.approach * unit.approach, curve.load * unit.load, curve.radius * unit.length)


def _hertz_curve(top: Floats, steps: Floats) -> State:
    radius = np.cbrt(top) * steps
    return State(radius, radius**3, radius**2)


def _dmt_curve(top: Floats, steps: Floats) -> State:
    radius = np.cbrt(top + 2) * steps
    return State(radius, radius**3 - 2, radius**2)


def _jkr_curve(top: Floats, steps: Floats) -> State:
    radius = np.cbrt(top + 3 + np.sqrt(6 * top + 9)) * steps
    # both turns, of the load and of the approach
    radius = np.union1d(radius, np.cbrt([1 / 6, 3 / 2]))
    return State(radius, radius**3 - np.sqrt(6 * radius) * radius, radius**2 - 2 / 3 * np.sqrt(6 * radius))


_CLOSED_FORMS = {Regime.HERTZ: _hertz_curve, Regime.DMT: _dmt_curve, Regime.JKR: _jkr_curve}


def _theory(model: Regime | str) -> Regime:
    expected = f"expected one of {', '.join(sorted(map(str, [*_CLOSED_FORMS, Regime.MAUGIS])))}"
    try:
        theory = Regime(model)
    except ValueError:
        raise InputError(f"model is {model!r}; {expected}") from None
    if theory is Regime.RIGID:
        raise InputError(f"model is {theory!r}, where spheres do not deform in contact; {expected}")
    return theory


def _single(name: str, value: npt.ArrayLike) -> Floats:
    number = checked(name, value, above=0)
    if number.ndim:
        raise InputError(f"{name} is an array; expected one number: a branch is that of one contact")
    return number


def regime(maugis_parameter: npt.ArrayLike, load_parameter: npt.ArrayLike) -> Regime | npt.NDArray[np.object_]:
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
    parameter = dugdale.solvable(maugis_parameter)
    pull_off = np.where(parameter < DMT_BELOW, -2.0, dugdale.state_at(dugdale.load_turn(parameter), parameter).load)
    load = carried("load_parameter", load_parameter, pull_off, "πWR")
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


def hertz_boundary(maugis_parameter: npt.ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] from which on adhesion is at most 5 % of the load.

    Adhesion is the Hertz load 4E*a³/(3R) at the contact radius, less N. The boundary, found with Maugis, is 40 for
    λ → 0 (DMT, with an adhesion of 2πWR) and 2520 for λ → ∞ (JKR).
    """
    parameter = dugdale.solvable(maugis_parameter)

    def excess(t: Floats) -> Floats:
        state = dugdale.state_at(t, parameter)
        return (1 + NEGLIGIBLE) * state.load - state.radius**3

    return dugdale.state_at(dugdale.crossing(excess, dugdale.load_turn(parameter)), parameter).load


def rigid_boundary(maugis_parameter: npt.ArrayLike) -> Floats:
    """Return the load parameter N/(πWR) [1] below which the elastic compression is less than 5 % of z0; λ > 0.

    The compression is the Hertz approach under N + 2πWR, with Bradley's attraction of rigid spheres. Over z0 it is
    (9√3 π/32) λ (N/(πWR) + 2)^(2/3), so that λ > 0.0206 leaves only loads that pull.
    """
    unit_over_separation = 9 * math.sqrt(3) * math.pi / 32 * checked("maugis_parameter", maugis_parameter, above=0)
    return (NEGLIGIBLE / unit_over_separation) ** 1.5 - 2
