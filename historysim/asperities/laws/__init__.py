"""Friction laws as values: what each asperity's coefficient is, of what it depends on, and what is chosen there."""

from collections.abc import Mapping
from typing import Any

from historysim.asperities.laws.drawn import DrawnFriction
from historysim.asperities.laws.friction_law import LAWS, FrictionLaw, Loaded
from historysim.asperities.laws.power import PowerLaw
from historysim.asperities.laws.shear_strength import ShearStrength
from historysim.asperities.laws.shifted import ShiftedLoad
from historysim.asperities.laws.slid import SlidFriction

__all__ = [
    "LAWS",
    "DrawnFriction",
    "FrictionLaw",
    "Loaded",
    "PowerLaw",
    "ShearStrength",
    "ShiftedLoad",
    "SlidFriction",
    "law_from",
    "register",
]

register = LAWS.register


def __dir__() -> list[str]:
    return sorted(__all__)


def law_from(settings: Mapping[str, Any]) -> FrictionLaw:
    """Return the law that `FrictionLaw.settings` told.

    Raises
    ------
    InputError
        A name that no law has, a law of a package that is not there, or numbers that it cannot have.
    """
    return FrictionLaw.from_settings(settings)
