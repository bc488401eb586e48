"""Friction laws as values: what the coefficient of each asperity is, and what it depends on."""

from collections.abc import Mapping
from typing import Any

from historysim.asperities.friction import LAWS, FrictionLaw, Loaded
from historysim.asperities.laws.built_in import DrawnFriction, PowerLaw, ShearStrength, ShiftedLoad, SlidFriction

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
    """Return the law of `FrictionLaw.settings`; errors as for `FrictionLaw.from_settings`."""
    return FrictionLaw.from_settings(settings)
