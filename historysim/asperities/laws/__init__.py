"""Friction laws as values: the coefficient of each asperity, and the quantity on which it depends."""

from historysim.asperities.law import LAWS, FrictionLaw, Loaded
from historysim.asperities.laws.built_in import PowerLaw, ShearStrength, SlidFriction

__all__ = [
    "LAWS",
    "FrictionLaw",
    "Loaded",
    "PowerLaw",
    "ShearStrength",
    "SlidFriction",
    "register",
]

register = LAWS.register


def __dir__() -> list[str]:
    return sorted(__all__)
