"""The friction laws of this package."""

from collections.abc import Iterable
from typing import Annotated, Any

import attrs
import numpy as np

from historysim.asperities.law import LAWS, FrictionLaw
from historysim.basics.arguments import Floats, as_floats
from historysim.basics.fields import (
    Force,
    Number,
    Pressure,
    Quantity,
    SurfaceEnergy,
    at_least,
    choice,
)
from historysim.basics.units import as_float, joules_per_area, newtons, pascals, quantity_text
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError


@LAWS.register
@attrs.frozen
class PowerLaw(FrictionLaw):
    """Friction that varies as a power of the load, μ = μ_ref (N/N_ref)^n.

    Parameters
    ----------
    coefficient : float
        μ_ref ≥ 0.
    reference_load : float
        N_ref > 0 [N].
    exponent : float
        n > -1, so that the friction force vanishes with the load.
    load : {"own", "total"}
        The load of the asperity, or of the surface. With the total load all asperities keep one
        coefficient, as a tribometer measures it (Winogrodzka's Chapter 4).

    Examples
    --------
    [friction]
    law = "power"
    coefficient = 0.2
    reference_load = "10 mN"
    exponent = -0.2
    """

    coefficient: Number = attrs.field(converter=as_float, validator=at_least(0.0))
    reference_load: Force = attrs.field(converter=newtons, validator=at_least(0.0, above=True))
    exponent: Number = attrs.field(converter=as_float, validator=at_least(-1.0, above=True))
    load: str = attrs.field(default="own", validator=choice("own", "total"))

    kind, library_kind = "power", "HS_POWER_LAW"

    @property
    def same_bits(self) -> bool:  # type: ignore[override]
        """True if results are bit-identical on all machines; powers come from the C library of the machine."""
        return self.exponent == 0

    @property
    def depends_on(self) -> str:  # type: ignore[override]
        """Quantity on which friction depends."""
        return "nothing" if self.exponent == 0 else self.load

    def at_start(self, count: int) -> Floats:
        """Return the coefficients at the start, which are known only without an exponent."""
        return np.full(count, 0.0 if self.exponent else self.coefficient)

    @property
    def text(self) -> str:
        """The law in a line."""
        load = "the load of each asperity" if self.load == "own" else "the total load"
        reference = quantity_text(self.reference_load, "N")
        return f"power law: {self.coefficient:g} (N/{reference})^{self.exponent:g} in {load}, as is chosen here"


@LAWS.register
@attrs.frozen
class ShearStrength(FrictionLaw):
    """Friction of a constant interfacial shear strength τ0 on the contact area of each asperity: T_max = τ0 A.

    Bowden and Tabor (1950). On a sphere in Hertz contact μ varies as N^(-1/3). The tractions
    remain limited by Coulomb's law with that coefficient, μ p: the strength limits the asperity as
    a whole and not each point.

    Parameters
    ----------
    shear_strength : float
        τ0 ≥ 0 [Pa].
    area : {"hertz", "jkr"}
        Area at the normal load: of Hertz, or of Johnson, Kendall and Roberts (1971) with a work of
        adhesion. The contact itself remains Hertzian: only the limit uses JKR.
    work_of_adhesion : float, optional
        W ≥ 0 [J/m²], for "jkr"; at 0 the area is the Hertzian one.

    Examples
    --------
    [friction]
    law = "shear strength"
    shear_strength = "11.4 MPa"
    """

    shear_strength: Pressure = attrs.field(converter=pascals, validator=at_least(0.0))
    area: str = attrs.field(default="hertz", validator=choice("hertz", "jkr"))
    work_of_adhesion: SurfaceEnergy | None = attrs.field(
        default=None,
        converter=attrs.converters.optional(joules_per_area),
        validator=attrs.validators.optional(at_least(0.0)),
    )

    kind, library_kind = "shear strength", "HS_SHEAR_STRENGTH"
    same_bits, depends_on = True, "own"

    def __attrs_post_init__(self) -> None:
        """Check that a work of adhesion is given exactly if the area needs it."""
        if (self.area == "jkr") != (self.work_of_adhesion is not None):
            value = "missing" if self.area == "jkr" else f"{self.work_of_adhesion:g} J/m²"
            expected = (
                "that of the pair, for the JKR area"
                if self.area == "jkr"
                else "none, or area = 'jkr'"
            )
            raise InputError(f"ShearStrength: work_of_adhesion is {value}; expected {expected}")

    @property
    def text(self) -> str:
        """The law in a line."""
        strength = quantity_text(self.shear_strength, "Pa")
        area = (
            "Hertz area"
            if self.area == "hertz"
            else f"JKR area, W = {self.work_of_adhesion:g} J/m²"
        )
        return f"Bowden-Tabor: shear strength {strength} on the {area} of each asperity; tractions as Coulomb's"


def _numbers(values: Any, name: str = "coefficient") -> tuple[float, ...]:
    if not isinstance(values, Iterable) or isinstance(values, str):
        raise InputError(f"{values!r} is not a column of a table; expected a list of numbers")
    return tuple(as_floats(name, list(values)).tolist())


def _lengths(values: Any) -> tuple[float, ...]:
    return _numbers(values, "distance")


@LAWS.register
@attrs.frozen
class SlidFriction(FrictionLaw):
    """Friction that changes with the distance slid by each asperity, straight between a table's rows from 0 on.

    Parameters
    ----------
    distance : sequence of float (row)
        Slid distances [m], ascending, the first 0.
    coefficient : sequence of float (row)
        μ ≥ 0 there; beyond the last row it stays.

    Examples
    --------
    [friction]
    law = "slid distance"
    distance = ["0 m", "1 µm"]
    coefficient = [0.2, 0.1]
    """

    distance: Annotated[tuple[float, ...], Quantity("m")] = attrs.field(converter=_lengths)
    coefficient: Annotated[tuple[float, ...], Quantity("1")] = attrs.field(converter=_numbers)

    kind, library_kind = "slid distance", "HS_SLID_TABLE"
    same_bits, depends_on = True, "slid"

    def __attrs_post_init__(self) -> None:
        """Check the table."""
        rows = len(self.distance)
        if rows != len(self.coefficient) or rows < 2:
            raise InputError(
                f"SlidFriction: {rows} distances, {len(self.coefficient)} coefficients; expected as many, two or more"
            )
        if self.distance[0] != 0 or min(np.diff(self.distance)) <= 0:
            raise InputError(
                "SlidFriction: distance does not rise from 0; expected ascending distances, the first 0"
            )
        if min(self.coefficient) < 0:
            raise InputError(
                f"SlidFriction: coefficient is {min(self.coefficient):g}; expected 0 or more"
            )

    def at_start(self, count: int) -> Floats:
        """Return the coefficients before anything has slid (asperity)."""
        return np.full(count, self.coefficient[0])

    def steepest_rise(self) -> float:
        """Return the largest increase of friction with slid distance [1/m]."""
        return float((np.diff(self.coefficient) / np.diff(self.distance)).max())

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_law``."""
        table = {
            "rows": len(self.distance),
            "distance": self.distance,
            "coefficients": self.coefficient,
        }
        return super().core(pair) | table

    @property
    def text(self) -> str:
        """The law in a line."""
        start, stop = self.coefficient[0], self.coefficient[-1]
        return f"Coulomb from {start:g} to {stop:g} over the distance slid by each asperity, from a table"
