"""Picture of a recorded history: the friction loop, the loads over time, and what the asperities do."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.basics.units import prefixed
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_recorded
from historysim.results.plots.along_path import draw_coloured, thinned
from historysim.results.plots.loop import draw_loop
from historysim.results.plots.paper import COLUMN, PAGE, Drawn, Page, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.slip_map import draw_slip_map, state_handles
from historysim.results.plots.style import FAINT, INK, scaled
from historysim.results.plots.worn_summits import check_worn, draw_wear

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS = ("loop", "loads", "states", "energy", "wear")


def plot_history(history: xr.Dataset, *, panels: Sequence[str] | None = None, **place: Unpack[Place]) -> Drawn:
    """Draw the friction loop, the loads over time, and which asperities stick or slip.

    Parameters
    ----------
    history : xarray.Dataset
        A history. One without asperities gets its dissipated energy in place of the map of slip state; one whose
        asperities wear their worn volume, too. Long histories are thinned to what a page can show.
    panels : sequence of {"loop", "loads", "states", "energy", "wear"}, optional
        What to draw instead, in this order, one below the other.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide, or 90 mm with chosen panels.

    Raises
    ------
    InputError
        Panels that there are not, or the states of a history without asperities.
    """
    thin = thinned(history)
    if panels is not None:
        _check_panels(history, panels)
        width = PAGE if "states" in panels else COLUMN
        with paper(plot_history, (width, 70.0 * len(panels)), place) as page:
            _draw_chosen(page, history, thin, panels)
        return page.drawn
    rows = history.sizes.get("asperity", 0) if "slip_state" in history else 0
    map_height = 1.5 if rows == 0 else 0.45 + 1.65 * min(rows / 12, 1)
    worn = [1.3] if "worn_volume" in history else []
    with paper(plot_history, (PAGE, 99.0 + 25.4 * (map_height + sum(worn))), place) as page:
        shown = ["loop", "loads", "states" if rows else "energy", *(["wear"] if worn else [])]
        if thin.sizes["step"] == 1:
            # one point is no course
            shown = ["states"] if rows else shown[:1]
        if page.width < WIDE or page.height < HIGH or len(shown) == 1:
            fitting = _fitting(shown, page.height)
            _draw_chosen(page, history, thin, fitting)
            page.left_out(*(CALLED[name] for name in shown if name not in fitting))
        else:
            page.several(len(shown) + 1)
            if worn and page.height < HIGH_WITH_WEAR:
                page.left_out(CALLED[shown.pop()])
                worn = []
            _draw_wide(page, history, thin, shown, (1.1, 1.9, map_height, *worn))
        page.heading(str(history.attrs.get("title", "")))
    return page.drawn


WIDE, HIGH, HIGH_WITH_WEAR = 140.0, 85.0, 135.0
"""Width and height from which on the loads stand beside the loop; height from which on wear stands below [mm]."""
HEIGHTS = {"loop": 42.0, "loads": 42.0, "states": 34.0, "energy": 26.0, "wear": 30.0}
"""Room that each panel takes at least where they stand below one another [mm]."""
CALLED = {"loop": "friction loop", "loads": "loads", "states": "slip states", "energy": "energy", "wear": "wear"}


def _fitting(panels: Sequence[str], height: float) -> list[str]:
    """Return the first panels for which there is room, one at least."""
    room = height - 24.0
    found = [panels[0]]
    room -= HEIGHTS[panels[0]]
    for name in panels[1:]:
        room -= HEIGHTS[name]
        if room >= 0:
            found.append(name)
    return found


def _draw_wide(
    page: Page, history: xr.Dataset, thin: xr.Dataset, panels: Sequence[str], heights: Sequence[float]
) -> None:
    """Draw the loads beside the loop, and the others below."""
    figure = page.figure
    grid = figure.add_gridspec(len(heights), 2, width_ratios=(1, 1), height_ratios=heights)
    normal_axes = figure.add_subplot(grid[0, 1])
    loop = figure.add_subplot(grid[:2, 0])
    draw_loop(loop, thin, "colour: time, as on the right")
    _draw_loads(normal_axes, figure.add_subplot(grid[1, 1], sharex=normal_axes), thin)
    last = figure.add_subplot(grid[2, :])
    if "states" in panels:
        draw_slip_map(last, history)
    else:
        _draw_energy(last, thin)
    if "wear" in panels:
        draw_wear(figure.add_subplot(grid[3, :]), history)
    page.legend(
        *(axes for axes in figure.axes if axes is not loop), handles=state_handles() if "states" in panels else ()
    )


def _check_panels(history: xr.Dataset, panels: Sequence[str]) -> None:
    unknown = [name for name in panels if name not in PANELS]
    if unknown or not panels or isinstance(panels, str):
        raise InputError(f"panels is {panels!r}; expected some of {', '.join(PANELS)}")
    if "states" in panels:
        check_recorded(history, "slip_state")
    if "wear" in panels:
        check_worn(history)


def _draw_chosen(page: Page, history: xr.Dataset, thin: xr.Dataset, panels: Sequence[str]) -> None:
    """Draw panels, one below the other."""
    draw: dict[str, Callable[[Axes], None]] = {
        "loop": lambda axes: draw_loop(axes, thin),
        "states": lambda axes: draw_slip_map(axes, history),
        "energy": lambda axes: _draw_energy(axes, thin),
        "wear": lambda axes: draw_wear(axes, history),
    }
    if len(panels) == 1 and panels[0] in draw:
        drawn = [page.axes()]
        draw[panels[0]](drawn[0])
    else:
        figure = page.several(len(panels) + panels.count("loads"))
        grid = figure.add_gridspec(len(panels), 1, height_ratios=[HEIGHTS[name] for name in panels])
        for row, name in enumerate(panels):
            if name == "loads":
                parts = grid[row, 0].subgridspec(2, 1, height_ratios=(1, 1.3))
                normal = figure.add_subplot(parts[0])
                _draw_loads(normal, figure.add_subplot(parts[1], sharex=normal), thin)
            else:
                draw[name](figure.add_subplot(grid[row, 0]))
        drawn = figure.axes
    # of the loop, its start and end are named above it
    named = [axes for axes in drawn if axes.get_title(loc="left") != "Friction loop"]
    page.legend(*named, handles=state_handles() if "states" in panels else ())


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
    """The friction loop, the loads over time, and the slip state of each asperity.

    Attributes
    ----------
    panels
        Some of ``"loop"``, ``"loads"``, ``"states"``, ``"energy"`` and ``"wear"``, one below the other.
    """

    panels: tuple[str, ...] | None = None

    kind = "history"
    caption = "The friction loop, the loads over time, and the slip state of each asperity."
    place = 1
    totals = True

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_history(what, panels=self.panels, **place)
