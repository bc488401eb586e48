"""Picture of the friction loop of a history, its colour time or the share of the contact that slips."""

from typing import TYPE_CHECKING, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_recorded
from historysim.results.analysis.shares import slip_shares
from historysim.results.plots.along_path import draw_coloured, kept_steps, line_colours, swings, thinned
from historysim.results.plots.paper import COLUMN, Drawn, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import FAINT, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes


TOLD = {"time": "time (s)", "slip": "slipping share of the contact area"}
PIECES = 2_000
"""Of a loop whose colour tells how much slips, which changes at once where the displacement turns round."""


def plot_loop(history: xr.Dataset, colour: str = "slip", **place: Unpack[Place]) -> Drawn:
    """Draw the friction loop: the tangential load over the tangential displacement.

    Parameters
    ----------
    history : xarray.Dataset
        A history. Long ones are thinned to what a page can show.
    colour : {"slip", "time"}
        What the colour of the line tells: the share of the contact area that slips, or time.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide.

    Raises
    ------
    InputError
        Another colour, or a history without asperities where it shall tell what slips.
    """
    if colour not in TOLD:
        raise InputError(f"colour is {colour!r}; expected 'slip' or 'time'")
    check_recorded(history, "tangential_displacement")
    thin = thinned(history)
    values = thin["time"].values
    if colour == "slip":
        values = slip_shares(history)["slipping_area"].values[kept_steps(history.sizes["step"])]
    with paper(plot_loop, (COLUMN, 75.0), place) as page:
        axes = page.axes()
        x, y = _place(axes, thin)
        line = draw_coloured(axes, x, y, values, pieces=PIECES)
        if colour == "slip":
            line.set_clim(0, 1)
        axes.margins(0.06)
        bar = page.figure.colorbar(line, ax=axes, location="top", aspect=40, pad=0.03)
        bar.set_label(TOLD[colour])
        bar.outline.set_linewidth(0.4)
    return page.drawn


def draw_loop(axes: "Axes", thin: xr.Dataset, told: str = "colour: time") -> None:
    """Draw the loop of a thinned history into axes, its colour time, with arrows and marks at start and end."""
    time = thin["time"].values
    displacement, force = _place(axes, thin)
    draw_coloured(axes, displacement, force, time)
    _draw_arrows(axes, displacement, force, time)
    for index, marker, name in ((0, "o", "start"), (-1, "s", "end")):
        colour = line_colours()(0.0 if name == "start" else 1.0)
        axes.plot(
            displacement[index], force[index], marker, color=colour, mec="white", mew=0.6, ms=5, label=name, zorder=4
        )
    axes.margins(0.06)
    axes.set_title("Friction loop")
    axes.set_title(f"{told}\n● start  ■ end", loc="right", color=FAINT, fontsize=7, fontweight="normal")


def _place(axes: "Axes", thin: xr.Dataset) -> tuple[Floats, Floats]:
    """Label axes of a loop, and return displacement and load in their units."""
    displacement, unit = scaled(thin["tangential_displacement"].values, "m")
    force, force_unit = scaled(thin["total_tangential_load"].values, "N")
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.set(xlabel=f"tangential displacement $U$ ({unit})", ylabel=f"tangential load $T$ ({force_unit})")
    return displacement, force


def _draw_arrows(axes: "Axes", x: Floats, y: Floats, time: Floats) -> None:
    """Mark the direction in the middle of the last swing each way."""
    for start, end in list(swings(x))[-2:]:
        middle = start + int(np.abs(x[start : end + 1] - (x[start] + x[end]) / 2).argmin())
        behind = max(middle - max((end - start) // 50, 1), start)
        colour = line_colours()((time[middle] - time[0]) / max(time[-1] - time[0], 1e-300))
        axes.annotate(
            "",
            xy=(x[middle], y[middle]),
            xytext=(x[behind], y[behind]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 11, "shrinkA": 0, "shrinkB": 0},
        )


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopPicture(Picture):
    """The friction loop, coloured by the share of the contact area that slips."""

    kind = "loop"
    caption = "The friction loop, coloured by the share of the contact area that slips."
    place = 3

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_loop(what, **place)
