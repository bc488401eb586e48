"""One asperity in a few lines."""

from historysim.asperities.asperity import Asperity
from historysim.basics.units import quantity_text


def summary(asperity: Asperity) -> list[tuple[str, str]]:
    """Return in a few lines how an asperity stands."""
    return [
        ("asperity", str(asperity.index)),
        ("slip state", asperity.slip_state.name.lower().replace("_", " ")),
        ("normal load", quantity_text(asperity.normal_load, "N")),
        ("tangential load", quantity_text(asperity.tangential_load, "N")),
        ("contact radius", quantity_text(asperity.contact_radius, "m")),
        ("stick radius", quantity_text(asperity.stick_radius, "m")),
        ("dissipated energy", quantity_text(asperity.dissipated_energy, "J")),
    ]


def reversal_table(asperity: Asperity) -> list[tuple[str, str, str]]:
    """Return a table of texts, under a heading: the reversal points that are remembered, from the edge inward."""
    rows = [("reversal point", "radius", "turned at displacement")]
    for number, point in enumerate(asperity.reversal_points):
        rows.append((str(number), quantity_text(point.radius, "m"), quantity_text(point.displacement, "m")))
    return rows
