"""Picture of a reduced model beside its contact."""

from typing import TYPE_CHECKING

import numpy as np

from historysim.exchange.exported import Exportable, exported
from historysim.exchange.reduced.reduced_model import ReducedModel
from historysim.exchange.reduced.virgin import VirginCurve
from historysim.results.plots.paper import COLUMN, Size, new_figure
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, scaled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 120
SPRINGS = STATE_COLOURS[2]
AMPLITUDE = 0.8
"""Of the loop, over the displacement at which everything slides."""


def plot_reduced(source: Exportable, model: ReducedModel, *, size: Size | None = None) -> "Figure":
    """Draw the virgin curve and a loop of a contact and of its reduced model, the band of the bound, and the springs.

    Parameters
    ----------
    source : Exportable
        What the model was made of.
    model : ReducedModel
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        Above, loads over the displacement at the normal load of the model; below, the force at which each spring slides
        over the displacement at which it does.

    Raises
    ------
    InputError
        The source cannot be used.
    """
    ensemble = exported(source).replay.ensemble
    curve = VirginCurve(ensemble, model.normal_load)
    out = AMPLITUDE * curve.end
    way = np.concatenate(
        [np.linspace(0, out, POINTS), np.linspace(out, -out, 2 * POINTS)[1:], np.linspace(-out, out, 2 * POINTS)[1:]]
    )
    exact = ensemble.advance_many(curve.rest, tangential_displacement=way)[1].tangential_load
    reduced, band = model.force(way), model.bound * model.friction_limit
    lengths, length_unit = scaled(np.append(way, curve.end), "m")
    loads, load_unit = scaled(np.concatenate([exact, reduced, exact - band, exact + band]), "N")
    exact, reduced, low, high = np.split(loads, 4)
    with new_figure(size, (COLUMN, 120.0)) as figure:
        upper, lower = figure.subplots(2, 1, height_ratios=(1.6, 1))
        upper.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
        upper.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
        # each branch by itself: a band is a function of the displacement there
        begin = 0
        for end in (POINTS, 3 * POINTS - 1, way.size):
            part = slice(max(begin - 1, 0), end)
            name = "bound" if begin == 0 else None
            upper.fill_between(
                lengths[part], low[part], high[part], color=FAINT, alpha=0.3, linewidth=0, label=name, zorder=1
            )
            begin = end
        upper.plot(lengths[:-1], exact, color=INK, linewidth=0.9, label="contact")
        upper.plot(lengths[:-1], reduced, color=SPRINGS, linewidth=0.7, linestyle="--", label=f"{len(model)} springs")
        upper.set_xlabel(f"tangential displacement $U$ ({length_unit})")
        upper.set_ylabel(f"tangential load $T$ ({load_unit})")
        upper.legend(frameon=False, fontsize="small", loc="upper left")
        slip, slip_unit = scaled(model.slip_displacement, "m")
        force, force_unit = scaled(model.limit, "N")
        lower.vlines(slip, 0, force, color=SPRINGS, linewidth=0.8)
        lower.plot(slip, force, "o", color=SPRINGS, markersize=2)
        lower.set_ylim(bottom=0)
        lower.set_xlim(left=0)
        lower.set_xlabel(f"slides at a displacement of ({slip_unit})")
        lower.set_ylabel(f"force at which a spring\nslides ({force_unit})")
    return figure
