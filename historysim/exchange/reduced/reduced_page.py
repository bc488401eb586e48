"""The report of a reduced model."""

from historysim.basics.units import quantity_text
from historysim.exchange.reduced.reduced_picture import plot_reduced
from historysim.exchange.reduced.springs import Springs
from historysim.results.report.page import Section, page, paragraph, picture, table

UNITS = ("N/m", "N", "m")
NO_BREAK = "\u00a0"
CAPTION = (
    "The virgin curve and a loop of the contact and of its springs at the normal load of the model, the band in which "
    "the springs are for every history there, and the force at which each spring slides."
)


def reduced_page(model: Springs) -> str:
    """Return a reduced model as one HTML page that fetches nothing."""
    rows = [
        (str(number), *(quantity_text(*each).replace(" ", NO_BREAK) for each in zip(row, UNITS, strict=True)))
        for number, row in enumerate(zip(model.stiffness, model.limit, model.slip_displacement, strict=True), start=1)
    ]
    told = "At a constant normal load the bounds hold for every history, nested reversals and all."
    warned = "Where the normal load varies no bound is known; the errors that were found are no bounds."
    return page(
        model.title or "Reduced model",
        [
            Section("Summary", (table(model.summary()),)),
            Section("Validity", (paragraph(told), *([] if model.scaling is None else [paragraph(warned, "warning")]))),
            Section("Picture", (picture(plot_reduced(model), CAPTION),)),
            Section("Springs", (table(rows, ("spring", "stiffness", "limit", "slip displacement")),)),
        ],
    )
