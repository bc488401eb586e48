"""Picture of a reduced model beside its contact."""

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from historysim.basics.array_types import Floats
from historysim.basics.units import quantity_text
from historysim.exchange.reduced.springs import Springs
from historysim.results.plots.paper import COLUMN, Drawn, Place, paper
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SPRINGS = STATE_COLOURS[2]
AMPLITUDE = 0.8
"""Of the loop, over the displacement at which everything slides."""


def plot_reduced(model: Springs, **place: Unpack[Place]) -> Drawn:
    """Draw the virgin curve and a loop of a contact and of its reduced model, the band of the bound, and the springs.

    Parameters
    ----------
    model : Springs
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide: above, loads over the displacement at the normal load of the model;
        below, the force at which each spring slides over the displacement at which it does.
    """
    with paper(plot_reduced, (COLUMN, 120.0), place) as page:
        figure: Any = page.several()
        if page.width >= 140.0:
            loop, spectrum = figure.subplots(1, 2, width_ratios=(1.5, 1))
        elif page.height >= 100.0:
            loop, spectrum = figure.subplots(2, 1, height_ratios=(1.6, 1))
        else:
            loop, spectrum = figure.subplots(), None
            page.left_out("springs")
        _draw_loop(loop, model)
        page.legend(loop)
        page.heading(model.title, f"at a normal load of {quantity_text(model.normal_load, 'N')}")
        if spectrum is not None:
            _draw_springs(spectrum, model)
    return page.drawn


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
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
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
