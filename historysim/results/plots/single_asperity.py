"""Picture of the traction that one asperity remembers."""

from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.asperities.asperity import Asperity
from historysim.results.plots.paper import COLUMN, Size, new_figure
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, legend_below, scaled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 801


def plot_asperity(asperity: Asperity, *, size: Size | None = None) -> "Figure":
    """Draw the tangential traction of an asperity over the radius, within ± friction times the pressure.

    Parameters
    ----------
    asperity : Asperity
        From `Ensemble.asperity`.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 90 mm wide; radii of the reversal points are dotted.
    """
    extent = 1.1 * asperity.contact_radius or 1.0
    radius = np.linspace(0.0, extent, POINTS)
    limit = asperity.friction * asperity.pressure(radius)
    traction = asperity.traction(radius)
    lengths, length_unit = scaled(radius, "m")
    stresses, stress_unit = scaled(np.concatenate([traction, limit, -limit]), "Pa")
    traction, above, below = np.split(stresses, 3)
    with new_figure(size, (COLUMN, 66.0)) as figure:
        axes = figure.add_subplot()
        axes.plot(lengths, above, color=FAINT, linewidth=0.8, linestyle="--", label="± friction × pressure")
        axes.plot(lengths, below, color=FAINT, linewidth=0.8, linestyle="--")
        axes.plot(lengths, traction, color=STATE_COLOURS[1], linewidth=1.2, label="traction")
        for place in asperity.reversal_points.radius:
            axes.axvline(place * lengths[-1] / extent, color=INK, linewidth=0.5, linestyle=":")
        axes.set_xlim(0.0, lengths[-1])
        axes.set_xlabel(f"radius ({length_unit})")
        axes.set_ylabel(f"tangential traction ({stress_unit})")
        axes.set_title(f"asperity {asperity.index}, {asperity.slip_state.name.lower().replace('_', ' ')}")
        legend_below(figure, axes)
    return figure


@figure_of.register(Asperity)
def _of_asperity(what: Asperity, *, size: Size | None = None, **_: Any) -> "Figure":
    return plot_asperity(what, size=size)
