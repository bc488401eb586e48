"""Picture and report of a reduced model beside its contact."""

from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import quantity_text
from historysim.exchange.reduced.springs import Springs
from historysim.results.plots.canvas import COLUMN, Canvas
from historysim.results.plots.pictures import Picture
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, scaled, zero_lines
from historysim.results.report.page import Section, page, paragraph, picture, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SPRINGS = STATE_COLOURS[2]
NO_BREAK = "\u00a0"
CAPTION = (
    "The virgin curve and a loop of the contact and of its springs at the normal load of the model, the band in which "
    "the springs are for every history there, and the force at which each spring slides."
)
AMPLITUDE = 0.8
"""Of the loop, over the displacement at which everything slides."""


@attrs.frozen(kw_only=True)
class ReducedPicture(Picture):
    """The virgin curve and a loop of a contact and of its reduced model, the band of the bound, and the springs.

    Loads stand over the displacement at the normal load of the model; below them the force at which each spring slides
    over the displacement at which it does.
    """

    kind, of, size, alone = "reduced", (Springs,), (COLUMN, 120.0), True

    def draw(self, canvas: Canvas, data: Springs) -> None:
        """Draw both, or the loop alone."""
        loop, spectrum = canvas.two(("loop", "springs"), 1.5, stacked=1.6)
        _draw_loop(loop, data)
        canvas.legend(loop)
        canvas.heading(data.title, f"at a normal load of {quantity_text(data.normal_load, 'N')}")
        if spectrum is not None:
            _draw_springs(spectrum, data)


def _branches(model: Springs) -> tuple[list[Floats], list[Floats]]:
    """Return displacements [m] and loads [N] of the contact on the virgin curve and on both branches of a loop."""
    within = model.virgin_displacement <= AMPLITUDE * model.virgin_displacement[-1]
    way, load = model.virgin_displacement[within], model.virgin_load[within]
    # at a constant normal load a branch is the virgin curve, twice as large (Masing)
    return [way, way[-1] - 2 * way, 2 * way - way[-1]], [load, load[-1] - 2 * load, 2 * load - load[-1]]


def _draw_loop(axes: "Axes", model: Springs) -> None:
    ways, exact = _branches(model)
    reduced, band = model.force(np.concatenate(ways)), model.bound * model.friction_limit
    along, length_unit = scaled(np.concatenate(ways), "m")
    loads, load_unit = scaled(np.stack([np.concatenate(exact), reduced, np.full(reduced.size, band)]), "N")
    zero_lines(axes)
    # each branch by itself: a band is a function of the displacement there
    for part, name in zip(np.split(np.arange(along.size), 3), ("bound", None, None), strict=True):
        low, high = loads[0, part] - loads[2, part], loads[0, part] + loads[2, part]
        axes.fill_between(along[part], low, high, color=FAINT, alpha=0.3, linewidth=0, label=name, zorder=1)
    axes.plot(along, loads[0], color=INK, linewidth=0.9, label="contact")
    axes.plot(along, loads[1], color=SPRINGS, linewidth=0.7, linestyle="--", label=f"{len(model)} springs")
    axes.set(xlabel=f"tangential displacement $U$ ({length_unit})", ylabel=f"tangential load $T$ ({load_unit})")


def _draw_springs(axes: "Axes", model: Springs) -> None:
    slip, slip_unit = scaled(model.slip_displacement, "m")
    force, force_unit = scaled(model.limit, "N")
    axes.vlines(slip, 0, force, color=SPRINGS, linewidth=0.8)
    axes.plot(slip, force, "o", color=SPRINGS, markersize=2)
    axes.set(xlabel=f"slip displacement of a spring ({slip_unit})", ylabel=f"its limit ({force_unit})")
    axes.set_ylim(bottom=0)
    axes.set_xlim(left=0)


def reduced_page(model: Springs) -> str:
    """Return a reduced model as one HTML page that fetches nothing."""
    columns = ((model.stiffness, "N/m"), (model.limit, "N"), (model.slip_displacement, "m"))
    texts = [[quantity_text(value, unit).replace(" ", NO_BREAK) for value in values] for values, unit in columns]
    rows = [(str(number), *row) for number, row in enumerate(zip(*texts, strict=True), start=1)]
    bounded = "At a constant normal load the bounds hold for every history, nested reversals and all."
    unbounded = "Where the normal load varies no bound is known; the errors that were found are no bounds."
    warning = [] if model.scaling is None else [paragraph(unbounded, "warning")]
    return page(
        model.title or "Reduced model",
        [
            Section("Summary", (table(model.summary()),)),
            Section("Validity", (paragraph(bounded), *warning)),
            Section("Picture", (picture(ReducedPicture().figure(model), CAPTION),)),
            Section("Springs", (table(rows, ("spring", "stiffness", "limit", "slip displacement")),)),
        ],
    )
