"""Picture of a recorded history: the friction loop, the loads over time, and what the asperities do."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.units import prefixed
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_recorded
from historysim.results.plots.along_path import draw_coloured, thinned
from historysim.results.plots.loop import draw_loop
from historysim.results.plots.paper import COLUMN, PAGE, Size, new_figure
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.slip_map import draw_slip_map
from historysim.results.plots.style import FAINT, INK, plain_title, scaled
from historysim.results.plots.worn_summits import check_worn, draw_wear

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANELS = ("loop", "loads", "states", "energy", "wear")


def plot_history(history: xr.Dataset, *, panels: Sequence[str] | None = None, size: Size | None = None) -> "Figure":
    """Draw the friction loop, the loads over time, and which asperities stick or slip.

    Parameters
    ----------
    history : xarray.Dataset
        A history. One without asperities gets its dissipated energy in place of the map of slip state; one whose
        asperities wear their worn volume, too. Long histories are thinned to what a page can show.
    panels : sequence of {"loop", "loads", "states", "energy", "wear"}, optional
        What to draw instead, in this order, one below the other.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide, or 90 mm with chosen panels, or of that size.

    Raises
    ------
    InputError
        Panels that there are not, or the states of a history without asperities.
    """
    thin = thinned(history)
    if panels is not None:
        return _chosen(history, thin, panels, size)
    rows = history.sizes.get("asperity", 0) if "slip_state" in history else 0
    map_height = 1.5 if rows == 0 else 0.45 + 1.65 * min(rows / 12, 1)
    worn = [1.3] if "worn_volume" in history else []
    with new_figure(size, (PAGE, 99.0 + 25.4 * (map_height + sum(worn)))) as figure:
        ratios = (1.1, 1.9, map_height, *worn)
        grid = figure.add_gridspec(len(ratios), 2, width_ratios=(1, 1), height_ratios=ratios)
        normal_axes = figure.add_subplot(grid[0, 1])
        draw_loop(figure.add_subplot(grid[:2, 0]), thin, "colour: time, as on the right")
        _draw_loads(normal_axes, figure.add_subplot(grid[1, 1], sharex=normal_axes), thin)
        last = figure.add_subplot(grid[2, :])
        if rows:
            draw_slip_map(last, history)
        else:
            _draw_energy(last, thin)
        if worn:
            draw_wear(figure.add_subplot(grid[3, :]), history)
        if title := history.attrs.get("title"):
            figure.suptitle(plain_title(str(title)), x=0.01, ha="left", fontsize=9.5)
    return figure


def _chosen(history: xr.Dataset, thin: xr.Dataset, panels: Sequence[str], size: Size | None) -> "Figure":
    """Draw chosen panels, one below the other."""
    unknown = [name for name in panels if name not in PANELS]
    if unknown or not panels or isinstance(panels, str):
        raise InputError(f"panels is {panels!r}; expected some of {', '.join(PANELS)}")
    if "states" in panels:
        check_recorded(history, "slip_state")
    if "wear" in panels:
        check_worn(history)
    draw: dict[str, Callable[[Axes], None]] = {
        "loop": lambda axes: draw_loop(axes, thin),
        "states": lambda axes: draw_slip_map(axes, history),
        "energy": lambda axes: _draw_energy(axes, thin),
        "wear": lambda axes: draw_wear(axes, history),
    }
    width = PAGE if "states" in panels else COLUMN
    with new_figure(size, (width, 70.0 * len(panels))) as figure:
        grid = figure.add_gridspec(len(panels), 1)
        for row, name in enumerate(panels):
            place = grid[row, 0]
            if name == "loads":
                parts = place.subgridspec(2, 1, height_ratios=(1, 1.6))
                normal = figure.add_subplot(parts[0])
                _draw_loads(normal, figure.add_subplot(parts[1], sharex=normal), thin)
            else:
                draw[name](figure.add_subplot(place))
    return figure


def _draw_loads(normal_axes: "Axes", tangential_axes: "Axes", thin: xr.Dataset) -> None:
    time, force, limit = (thin[name].values for name in ("time", "total_tangential_load", "friction_limit"))
    normal, normal_unit = scaled(thin["total_normal_load"].values, "N")
    normal_axes.plot(time, normal, color=INK, linewidth=1.0, rasterized=True)
    normal_axes.set(title="Loads", ylabel=f"normal load\n$N$ ({normal_unit})", ylim=(0, None))
    normal_axes.tick_params(labelbottom=False)

    factor, prefix = prefixed(max(np.abs(force).max(initial=0.0), limit.max(initial=0.0)))
    for sign, label in ((1, "friction limit"), (-1, None)):
        dashes: dict[str, Any] = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4, 2)), "rasterized": True}
        tangential_axes.plot(time, sign * limit * factor, label=label, **dashes)
    tangential_axes.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.0)
    draw_coloured(tangential_axes, time, force * factor, time)
    tangential_axes.margins(x=0.02)
    tangential_axes.set(xlabel="time (s)", ylabel=f"tangential load\n$T$ ({prefix}N)")


def _draw_energy(axes: "Axes", thin: xr.Dataset) -> None:
    energy, unit = scaled(thin["total_dissipated_energy"].values, "J")
    axes.plot(thin["time"].values, energy, color=INK, linewidth=1.0, rasterized=True)
    axes.margins(x=0.01)
    axes.set(title="Dissipated energy", xlabel="time (s)", ylabel=f"energy ({unit})", ylim=(0, None))


@PICTURES.register
@attrs.frozen(kw_only=True)
class HistoryPicture(Picture):
    """The friction loop, the loads over time, and the slip state of each asperity."""

    panels: tuple[str, ...] | None = None

    kind = "history"
    caption = "The friction loop, the loads over time, and the slip state of each asperity."
    place = 1
    totals = True

    def drawn(self, what: xr.Dataset, size: Size | None = None) -> "Figure":
        """Return a figure of it alone."""
        return plot_history(what, panels=self.panels, size=size)
