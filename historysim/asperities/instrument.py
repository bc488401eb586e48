"""Instrument in series with the contact, and ring resolution (plain data, no engine import)."""

import math
from typing import TYPE_CHECKING, Any, TypeVar

import attrs

from historysim.basics.fields import Force, Length, Stiffness, Stiffnesses, at_least
from historysim.basics.limits import LARGEST, SMALLEST, is_workable
from historysim.basics.units import convert_each, is_number, metres, newtons, newtons_per_metre
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from historysim.basics.arguments import Floats

Values = TypeVar("Values", float, "Floats")
MOST_RINGS = 1000  # of the library: ``HS_MOST_RINGS``


def _check_stiffness(_: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    components = value if isinstance(value, tuple) and len(value) == 2 else (value,)
    if not all(
        is_number(k) and k > 0 and (is_workable(k, SMALLEST) or k == math.inf) for k in components
    ):
        raise InputError(
            f"Instrument: {attribute.name} is {value!r}; expected a number greater than 0, from {SMALLEST:g} to "
            f"{LARGEST:g} or infinite, in N/m, or two, in x and y"
        )


def _check_zero_or_workable(_: object, attribute: "attrs.Attribute[Any]", value: float) -> None:
    if value and not is_workable(value, SMALLEST):
        raise InputError(
            f"Instrument: {attribute.name} is {value!r}; expected 0, or a number from {SMALLEST:g} to {LARGEST:g} N/m"
        )


def _newtons_per_metre(value: "float | Sequence[float]") -> Any:
    return convert_each(newtons_per_metre, value)


@attrs.frozen
class Instrument:
    """A tribometer, which measures the displacement of its drive (or sensor), not of the contact.

    Its lateral stiffness k_s is in series with the contact, so that the measured displacement is U
    + T/k_s: the displacement of the contact plus the deflection of the instrument under the
    tangential load. Its parallel stiffness k_p, of a flexure or a guide that holds the drive, adds
    a load proportional to the displacement of the drive: the measured load is T + k_p (U + T/k_s).
    The instrument is elastic, without memory; the state of an ensemble does not contain it.

    Parameters
    ----------
    lateral_stiffness : float or pair of float
        k_s [N/m], > 0; in two tangential directions one value for both, or values in x and y.
        Infinite by default: the displacement of the drive is that of the contact.
    parallel_stiffness : float
        k_p [N/m], ≥ 0: a spring in parallel with contact and lateral stiffness, relaxed where the
        drive is at 0; in two tangential directions the same in both. Tangential loads of events are
        measured loads, which include it.
    displacement_resolution, load_resolution : float
        Smallest tangential displacement [m] and load [N] that it resolves, ≥ 0; 0 if unknown. They
        do not change results: values below them are reported.

    Raises
    ------
    InputError
        A lateral stiffness that is not a positive number, infinite or from 1e-60 to 1e60 N/m; a
        parallel stiffness or a resolution that is not a finite number, 0 or more.
    """

    lateral_stiffness: Stiffnesses = attrs.field(
        default=math.inf, converter=_newtons_per_metre, validator=_check_stiffness
    )
    displacement_resolution: Length = attrs.field(
        default=0.0, converter=metres, validator=at_least(0.0)
    )
    load_resolution: Force = attrs.field(default=0.0, converter=newtons, validator=at_least(0.0))
    parallel_stiffness: Stiffness = attrs.field(
        default=0.0,
        kw_only=True,
        converter=newtons_per_metre,
        validator=[at_least(0.0), _check_zero_or_workable],
    )

    @property
    def rigid(self) -> bool:
        """True if the drive and the contact have the same displacement."""
        return self.compliances == (0.0, 0.0)

    @property
    def load_control_equivalent(self) -> "Instrument":
        """Equivalent instrument for a controlled load T_m, as a drive at T_m/k_p: 1/k_s + 1/k_p in series.

        From T + k_p (U + T/k_s) = T_m follows U + T (1/k_s + 1/k_p) = T_m/k_p. It needs a parallel
        stiffness > 0.
        """
        x, y = (
            1.0 / (compliance + 1.0 / self.parallel_stiffness) for compliance in self.compliances
        )
        return Instrument((x, y) if isinstance(self.lateral_stiffness, tuple) else x)

    @property
    def compliances(self) -> tuple[float, float]:
        """1/k_s in x and y [m/N]."""
        k = self.lateral_stiffness
        x, y = k if isinstance(k, tuple) else (k, k)
        return 1.0 / x, 1.0 / y

    @property
    def stiffness(self) -> float:
        """k_s if it is one number [N/m]; InputError for a pair."""
        if isinstance(self.lateral_stiffness, tuple):
            raise InputError(
                f"lateral_stiffness is {self.lateral_stiffness}, and the loads have one tangential direction; expected "
                "one number, or loads in x and y"
            )
        return self.lateral_stiffness

    def directional_compliances(self, directions: int) -> tuple[float, float]:
        """Return 1/k_s in x and y of a contact in one or two directions [m/N]; InputError for a pair in one."""
        return self.compliances if directions == 2 else (1.0 / self.stiffness, 0.0)

    def drive_displacement(
        self, tangential_displacement: Values, tangential_load: Values
    ) -> Values:
        """Return the displacement of the drive, U + T/k_s [m]; U [m] and T [N] of the contact have the same shape.

        In two directions the shape is (…, 2).
        """
        deflection: Any = tangential_load / self.lateral_stiffness  # type: ignore[operator] # an array over a tuple
        driven: Values = tangential_displacement + deflection
        return driven

    def drive_load(self, tangential_displacement: Values, tangential_load: Values) -> Values:
        """Return the load that moves the drive, T + k_p (U + T/k_s) [N], of the same shape."""
        if not self.parallel_stiffness:
            return tangential_load
        parallel_load: Any = self.parallel_stiffness * self.drive_displacement(
            tangential_displacement, tangential_load
        )
        total: Values = tangential_load + parallel_load
        return total


RIGID = Instrument()


def as_instrument(instrument: Instrument) -> Instrument:
    """Return the argument if it is an `Instrument`, else raise InputError."""
    value: Any = instrument
    if not isinstance(value, Instrument):
        raise InputError(
            f"instrument is {instrument!r}; expected an Instrument, such as Instrument(lateral_stiffness=3e5)"
        )
    return instrument


def _check_count(_: Any, field: "attrs.Attribute[int]", value: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MOST_RINGS:
        raise InputError(
            f"{field.name} is {value!r}; expected a whole number from 1 to {MOST_RINGS}"
        )


def _check_fraction(_: Any, field: "attrs.Attribute[float]", value: float) -> None:
    if not (is_number(value) and 0 < value < 1):
        raise InputError(
            f"{field.name} is {value!r}; expected a number between 0 and 1, such as 1e-3"
        )


@attrs.frozen
class Rings:
    """Resolution of asperities that move in two tangential directions.

    Along one line the memory is exact for any resolution. After the first turn, asperities share
    rings of traction (theory page, `contact/README.md`, "Two tangential directions").

    Parameters
    ----------
    height_classes : int
        Classes of asperities by height, each with separate rings, fixed at the first turn. The page
        of the memory (`memory/README.md`, "Two directions") has the errors.
    rings : int
        Rings of a class, from the edge of contact to the middle of its highest summit.
    tolerance : float
        Relative to the friction limit for the tangential load, and to the energy of a step for its
        energy: the length of steps is chosen so that both errors are within it.

    Raises
    ------
    InputError
        A count that is not a whole number from 1 to 1000, or a tolerance that is not between 0 and
        1.
    """

    height_classes: int = attrs.field(default=8, validator=_check_count)
    rings: int = attrs.field(default=30, validator=_check_count)
    tolerance: float = attrs.field(default=1e-3, validator=_check_fraction)


RINGS = Rings()
