"""Friction that goes with a power of the load."""

from typing import Any

import attrs
import numpy as np

from historysim.asperities.laws.friction_law import LAWS, FrictionLaw
from historysim.basics.array_types import Floats
from historysim.basics.fields import Force, Number, at_least, one_of
from historysim.basics.units import as_float, newtons, quantity_text


@LAWS.register
@attrs.frozen
class PowerLaw(FrictionLaw):
    """Friction that goes with a power of the load, μ = μ_ref (N/N_ref)^n.

    Parameters
    ----------
    coefficient : float
        μ_ref ≥ 0.
    reference_load : float
        N_ref > 0 [N].
    exponent : float
        n > -1, so that the friction force vanishes with the load.
    load : {"own", "total"}
        The load of the asperity, or of the surface. With the total load all asperities keep one coefficient, as a
        tribometer measures it (Winogrodzka's Chapter 4).

    Raises
    ------
    InputError
        A number out of its range, or another word.

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
    load: str = attrs.field(default="own", validator=one_of("own", "total"))

    kind = "power"

    @property
    def same_bits(self) -> bool:  # type: ignore[override]
        """Whether it has the same bits on every machine: powers are those of the machine's C library."""
        return self.exponent == 0

    @property
    def depends_on(self) -> str:  # type: ignore[override]
        """What it depends on."""
        return "nothing" if self.exponent == 0 else self.load

    def at_start(self, count: int) -> Floats:
        """Return the coefficients before anything has happened: without an exponent they are there already."""
        return np.full(count, 0.0 if self.exponent else self.coefficient)

    def core(self) -> dict[str, Any]:
        """Return the fields of ``hs_law`` that say what it is."""
        return super().core() | {
            "kind": "HS_POWER_LAW",
            "coefficient": self.coefficient,
            "reference_load": self.reference_load,
            "exponent": self.exponent,
        }

    @property
    def text(self) -> str:
        """Say in a line what it is."""
        whose = "the load of each asperity" if self.load == "own" else "the total load"
        reference = quantity_text(self.reference_load, "N")
        return f"power law: {self.coefficient:g} (N/{reference})^{self.exponent:g} in {whose}, as is chosen here"
