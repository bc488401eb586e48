"""Design studies: what a texture, a contact or a finish does to the preliminary displacement, and which one is wanted.

Each is one call that makes a scenario and sweeps over it. The attribute ``scenario`` of what comes back holds it, so
that ``historysim sweep`` or ``historysim design`` makes the same again. Quantities are in SI, or texts with a unit
(``"50 mN"``); where there may be several, an array of them, or a range as in ``[sweep.over]``, becomes a dimension.
"""

from historysim.studies.design_studies.inverse import finish_for_a_drift, texture_for_a_drift
from historysim.studies.design_studies.one_contact import radius_load_friction
from historysim.studies.design_studies.roughness import nominal_area, roughness
from historysim.studies.design_studies.textures import equal_asperities, one_large_asperity, texture_tolerances

__all__ = [
    "equal_asperities",
    "finish_for_a_drift",
    "nominal_area",
    "one_large_asperity",
    "radius_load_friction",
    "roughness",
    "texture_for_a_drift",
    "texture_tolerances",
]


def __dir__() -> list[str]:
    return sorted(__all__)
