"""Attraction laws: the constant force that pulls a touching asperity."""

import math
from typing import Annotated

import attrs

from historysim.asperities import attracting  # noqa: F401 - the ensemble of these laws
from historysim.asperities.law import ATTRACTIONS, Attraction
from historysim.basics.arguments import Floats, scalar
from historysim.basics.fields import Quantity, SurfaceEnergy, at_least
from historysim.basics.units import quantity_text
from historysim.errors import InputError

__all__ = ["DMT", "JKR", "Attraction", "Meniscus", "register"]


def __dir__() -> list[str]:
    return sorted(__all__)


register = ATTRACTIONS.register


@register
@attrs.frozen
class DMT(Attraction):
    """Attraction around the contact, of Derjaguin, Muller and Toporov: F = 2πRW.

    Examples
    --------
    [attraction]
    law = "dmt"
    work_of_adhesion = "50 mJ/m2"
    """

    work_of_adhesion: SurfaceEnergy = attrs.field(validator=at_least(0.0))  #: work of adhesion W

    kind = "dmt"

    def forces(self, summit_radius: Floats) -> Floats:
        """Return 2πRW [N] (asperity)."""
        return 2.0 * math.pi * self.work_of_adhesion * summit_radius

    @property
    def text(self) -> str:
        """One-line description."""
        return f"DMT, 2πRW with W = {quantity_text(self.work_of_adhesion, 'J m-2')}"


@register
@attrs.frozen
class Meniscus(Attraction):
    """A saturated meniscus of a liquid around each contact: F = 2πRγ(cos θ1 + cos θ2).

    Examples
    --------
    [attraction]
    law = "meniscus"
    surface_tension = "72 mJ/m2"
    contact_angles = ["30 deg", "60 deg"]
    """

    #: surface tension γ of the liquid
    surface_tension: SurfaceEnergy = attrs.field(validator=at_least(0.0))
    #: contact angles on both materials [rad]
    contact_angles: tuple[Annotated[float, Quantity("rad")], ...] = attrs.field(converter=tuple)

    kind = "meniscus"

    def __attrs_post_init__(self) -> None:
        """Check that there are two angles, and that the liquid attracts."""
        angles = self.contact_angles
        if len(angles) != 2 or not all(
            0.0 <= scalar("contact_angles", angle) <= math.pi for angle in angles
        ):
            raise InputError(
                f"contact_angles is {angles!r}; expected two angles from 0 to π, in rad"
            )
        if self._cosines < 0.0:
            raise InputError(
                f"contact_angles is {angles!r}; expected angles with cos θ1 + cos θ2 ≥ 0, which attract"
            )

    @property
    def _cosines(self) -> float:
        return math.cos(self.contact_angles[0]) + math.cos(self.contact_angles[1])

    def forces(self, summit_radius: Floats) -> Floats:
        """Return 2πRγ(cos θ1 + cos θ2) [N] (asperity)."""
        return 2.0 * math.pi * self.surface_tension * self._cosines * summit_radius

    @property
    def text(self) -> str:
        """One-line description."""
        tension = quantity_text(self.surface_tension, "J m-2")
        return f"meniscus, 2πRγ(cos θ1 + cos θ2) with γ = {tension}, cosines {self._cosines:.4g}"


@register
@attrs.frozen
class JKR(Attraction):
    """Attraction inside the contact, of Johnson, Kendall and Roberts: refused.

    Beyond full stick its theory is disputed (Savkoor and Briggs; Johnson 1997; Popov). Its normal
    contact is in `hs.contact.adhesion`.
    """

    work_of_adhesion: SurfaceEnergy = 0.0  #: work of adhesion W

    kind = "jkr"

    def __attrs_post_init__(self) -> None:
        """Refuse."""
        raise InputError(
            "JKR with a tangential load is not modelled: beyond full stick its theory is disputed, and its neck at a "
            "negative approach has no place in the memory; expected DMT or Meniscus, or hs.contact.adhesion for the "
            "normal contact alone"
        )

    @property
    def text(self) -> str:
        """One-line description."""
        return "JKR"
