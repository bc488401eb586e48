"""A reduced model in a few lines."""

from historysim.basics.units import quantity_text
from historysim.exchange.reduced.reduced_model import ReducedModel


def summary(model: ReducedModel) -> list[tuple[str, str]]:
    """Return labels with what belongs to them."""
    limit = model.friction_limit
    bound = f"{model.bound:.3g} of the friction limit ({quantity_text(model.bound * limit, 'N')})"
    lines = [
        ("springs", str(len(model))),
        ("normal load", quantity_text(model.normal_load, "N")),
        ("friction limit", quantity_text(limit, "N")),
        ("stiffness at rest", quantity_text(float(model.stiffness.sum()), "N/m")),
        ("slides as a whole from", quantity_text(float(model.slip_displacement[-1]), "m")),
        ("bound of the tangential load", f"{bound}, for every history at that normal load"),
        ("bound of the energy of a loop", quantity_text(model.energy_bound, "J")),
        *((f"found on {name}", f"{value:.3g} of the largest friction limit") for name, value in model.errors.items()),
    ]
    if model.scaling is not None:
        lines.append(("normal load varies", "springs go with it by a table; the errors found there are no bounds"))
    return lines
