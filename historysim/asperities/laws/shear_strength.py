"""Friction of a constant interfacial shear strength on the contact area (Bowden and Tabor)."""

from typing import Any

import attrs

from historysim.asperities.laws.friction_law import LAWS, FrictionLaw
from historysim.basics.fields import Pressure, SurfaceEnergy, at_least, one_of
from historysim.basics.units import joules_per_area, pascals, quantity_text
from historysim.errors import InputError


@LAWS.register
@attrs.frozen
class ShearStrength(FrictionLaw):
    """Friction of a constant interfacial shear strength τ0 on the contact area of each asperity: T_max = τ0 A.

    Bowden and Tabor (1950). On a sphere in Hertz contact μ goes with N^(-1/3). The tractions themselves stay those
    of Coulomb's law with that coefficient, μ p: the strength limits the asperity as a whole and not each point.

    Parameters
    ----------
    shear_strength : float
        τ0 ≥ 0 [Pa].
    area : {"hertz", "jkr"}
        Area at the normal load: of Hertz, or of Johnson, Kendall and Roberts (1971) with a work of adhesion. The
        contact itself stays that of Hertz: JKR is taken for the limit alone.
    work_of_adhesion : float, optional
        W ≥ 0 [J/m²], for "jkr"; at 0 its area is that of Hertz.

    Raises
    ------
    InputError
        A number out of its range, another word, or a work of adhesion that is missing or not asked for.

    Examples
    --------
    [friction]
    law = "shear strength"
    shear_strength = "11.4 MPa"
    """

    shear_strength: Pressure = attrs.field(converter=pascals, validator=at_least(0.0))
    area: str = attrs.field(default="hertz", validator=one_of("hertz", "jkr"))
    work_of_adhesion: SurfaceEnergy | None = attrs.field(
        default=None,
        converter=attrs.converters.optional(joules_per_area),
        validator=attrs.validators.optional(at_least(0.0)),
    )

    kind = "shear strength"
    same_bits = True
    depends_on = "own"

    def __attrs_post_init__(self) -> None:
        """Check that the work of adhesion is there where it is needed."""
        if (self.area == "jkr") != (self.work_of_adhesion is not None):
            came = "missing" if self.area == "jkr" else f"{self.work_of_adhesion:g} J/m²"
            wanted = "that of the pair, for the JKR area" if self.area == "jkr" else "none, or area = 'jkr'"
            raise InputError(f"ShearStrength: work_of_adhesion is {came}; expected {wanted}")

    def core(self) -> dict[str, Any]:
        """Return the fields of ``hs_law`` that say what it is."""
        return super().core() | {
            "kind": "HS_SHEAR_STRENGTH",
            "shear_strength": self.shear_strength,
            "work_of_adhesion": self.work_of_adhesion or 0.0,
        }

    @property
    def text(self) -> str:
        """Say in a line what it is."""
        strength = quantity_text(self.shear_strength, "Pa")
        area = "Hertz area" if self.area == "hertz" else f"JKR area, W = {self.work_of_adhesion:g} J/m²"
        return f"Bowden-Tabor: shear strength {strength} on the {area} of each asperity; tractions as Coulomb's"
