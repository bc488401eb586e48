"""All equilibria of one contact by one of the theories, from first attraction to the greatest load."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Booleans, Floats
from historysim.basics.frozen_arrays import FrozenArrays
from historysim.contact.adhesion import dmt, dugdale, jkr
from historysim.contact.adhesion.contact_units import State, units
from historysim.contact.adhesion.parameters import maugis_parameter
from historysim.contact.adhesion.regimes import Regime
from historysim.errors import InputError


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
    theory = _model(model)
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


_CLOSED_FORMS = {Regime.HERTZ: _hertz_curve, Regime.DMT: dmt.curve, Regime.JKR: jkr.curve}


def _model(model: Regime | str) -> Regime:
    expected = f"expected one of {', '.join(sorted(map(str, [*_CLOSED_FORMS, Regime.MAUGIS])))}"
    try:
        theory = Regime(model)
    except ValueError:
        raise InputError(f"model is {model!r}; {expected}") from None
    if theory is Regime.RIGID:
        raise InputError(f"model is {theory!r}, whose spheres do not deform in contact; {expected}")
    return theory


def _single(name: str, value: npt.ArrayLike) -> Floats:
    number = checked(name, value, above=0)
    if number.ndim:
        raise InputError(f"{name} is an array; expected one number: a branch is that of one contact")
    return number
