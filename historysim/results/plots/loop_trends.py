"""Picture of how friction loops change from one to the next."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import xarray as xr

from historysim.basics.units import prefixed
from historysim.measured.statistics import LoopStatistics
from historysim.results.loop_summary import of_mean
from historysim.results.plots.paper import PAGE, Drawn, Place, paper
from historysim.results.plots.style import FAINT, STATE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.gridspec import SubplotSpec

COLOURS = STATE_COLOURS[1], STATE_COLOURS[2]
MARKERS = "^", "v"
TRENDS = "friction_force", "preliminary_displacement", "tangential_stiffness", "dissipated_energy"


def plot_loop_trends(loops: xr.Dataset, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw friction force, preliminary displacement, stiffness and energy of each loop, with their means at one load.

    Parameters
    ----------
    loops : xarray.Dataset
        From `Loops.to_dataset`, or the file that ``historysim loops -o`` writes.
    title : str
        A heading; by default that of the loops.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.
    """
    with paper(plot_loop_trends, (PAGE, 97.0), place) as page:
        figure = page.several(len(TRENDS))
        grid = figure.add_gridspec(2, 2)
        draw_trends(figure, [grid[row, column] for row in range(2) for column in range(2)], [loops], columns=2)
        page.heading(title or str(loops.attrs.get("title", "")))
    return page.drawn


def draw_trends(
    figure: "Figure | SubFigure", places: Sequence["SubplotSpec"], sets: Sequence[xr.Dataset], *, columns: int = 1
) -> None:
    """Draw each of the `TRENDS` in its place, of one set of loops or of several in their colours."""
    first = None
    for number, (quantity, place) in enumerate(zip(TRENDS, places, strict=True)):
        first = axes = figure.add_subplot(place, sharex=first)
        _draw_trend(axes, sets, quantity)
        lowest = number >= len(TRENDS) - columns
        axes.tick_params(labelbottom=lowest)
        if lowest:
            axes.set_xlabel("loop, counted from 0")
        if number == 0:
            axes.set_title("▲ forward  ▼ backward", loc="right", color=FAINT, fontsize=7, fontweight="normal")


def _draw_trend(axes: "Axes", sets: Sequence[xr.Dataset], quantity: str) -> None:
    from matplotlib.ticker import MaxNLocator

    values = [loops[quantity].values.reshape(loops.sizes["loop"], -1) for loops in sets]
    finite = np.concatenate([each[np.isfinite(each)] for each in values])
    factor, prefix = prefixed(float(np.abs(finite).max(initial=0.0)))
    for loops, value, colour in zip(sets, values, COLOURS, strict=False):
        # one marker for each direction, or a dot for the whole loop
        markers = MARKERS if value.shape[1] == len(MARKERS) else ("o",)
        for column, marker in zip(value.T, markers, strict=True):
            line: dict[str, Any] = {"color": colour, "ms": 3.5, "mec": "white", "mew": 0.4, "clip_on": False}
            axes.plot(loops["loop"].values, column * factor, marker, **line)
        # a mean over several loads says nothing
        if "load_level" not in loops or np.unique(loops["load_level"].values).size == 1:
            axes.axhline(
                LoopStatistics.of(of_mean(loops, quantity)).mean * factor, color=colour, linewidth=0.7, zorder=0
            )
    axes.margins(x=0.08)
    if finite.size:
        low, high = finite.min() * factor, finite.max() * factor
        # a scatter of less than a tenth is not to fill the panel
        room = max(0.2 * (high - low), 0.1 * max(abs(low), abs(high))) or 1.0
        axes.set_ylim(low - room, high + room)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    label, unit = (sets[0][quantity].attrs[name] for name in ("long_name", "units"))
    symbol = {"N m-1": f"{prefix}N/m"}.get(unit, f"{prefix}{unit}")
    axes.set_title(f"{label} ({symbol})", fontsize=7.5, fontweight="normal")
