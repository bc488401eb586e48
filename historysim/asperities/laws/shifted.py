"""Coulomb's law on the load and the pull of adhesion together."""

from typing import Any

import attrs

from historysim.asperities.laws.friction_law import LAWS, FrictionLaw
from historysim.basics.fields import Number, SurfaceEnergy, at_least
from historysim.basics.units import as_float, joules_per_area


@LAWS.register
@attrs.frozen
class ShiftedLoad(FrictionLaw):
    """Coulomb's law on the load and the pull of adhesion together: T_max = μ (N + 2πWR).

    Derjaguin's friction law with the pull of Derjaguin, Muller and Toporov (1975), which acts outside the contact and
    adds to the load. The contact area and the approach stay those of Hertz at N: the pull is taken for the limit alone.

    Parameters
    ----------
    coefficient : float
        μ ≥ 0.
    work_of_adhesion : float
        W ≥ 0 [J/m²].

    Raises
    ------
    InputError
        A number out of its range.

    Examples
    --------
    [friction]
    law = "shifted load"
    coefficient = 0.2
    work_of_adhesion = "50 mJ/m2"
    """

    coefficient: Number = attrs.field(converter=as_float, validator=at_least(0.0))
    work_of_adhesion: SurfaceEnergy = attrs.field(converter=joules_per_area, validator=at_least(0.0))

    kind = "shifted load"
    same_bits = True
    depends_on = "own"

    def core(self) -> dict[str, Any]:
        """Return the fields of ``hs_law`` that say what it is."""
        return super().core() | {
            "kind": "HS_SHIFTED_LOAD",
            "coefficient": self.coefficient,
            "work_of_adhesion": self.work_of_adhesion,
        }

    @property
    def text(self) -> str:
        """Say in a line what it is."""
        return (
            f"Coulomb {self.coefficient:g} on the load and the DMT pull 2πWR together, W = {self.work_of_adhesion:g} "
            "J/m²; areas as Hertz's"
        )
