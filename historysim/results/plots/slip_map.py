"""Picture of the slip state of each asperity along the path."""

from typing import TYPE_CHECKING, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.results.analysis.recorded import check_any, check_recorded
from historysim.results.plots.along_path import mark_steps_and_times
from historysim.results.plots.paper import PAGE, Drawn, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import INK, STATE_COLOURS, STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

MOST_COLUMNS = 2_000
MOST_ROWS = 1_000


def plot_slip_map(history: xr.Dataset, **place: Unpack[Place]) -> Drawn:
    """Draw the slip state of each asperity at each step, the highest asperity on top.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities. Of a large one every so many-th step and asperity is drawn.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.

    Raises
    ------
    InputError
        A history without asperities.
    """
    check_recorded(history, "slip_state")
    check_any(history)
    with paper(plot_slip_map, (PAGE, 75.0), place) as page:
        draw_slip_map(page.axes(), history)
        page.legend(handles=state_handles())
        page.heading(str(history.attrs.get("title", "")))
    return page.drawn


def draw_slip_map(axes: "Axes", history: xr.Dataset) -> None:
    """Draw the slip state of each asperity at each step into axes."""
    from matplotlib.colors import ListedColormap

    steps, count = history.sizes["step"], history.sizes["asperity"]
    step_stride, row_stride = -(-steps // MOST_COLUMNS), -(-count // MOST_ROWS)
    by_height = np.argsort(-history["summit_height"].values, kind="stable")[::row_stride]
    states = history["slip_state"].isel(step=slice(None, None, step_stride)).values[:, by_height].T
    axes.imshow(
        states,
        cmap=ListedColormap(list(STATE_COLOURS)),
        vmin=-0.5,
        vmax=3.5,
        aspect="auto",
        interpolation="nearest",
        extent=(-0.5, steps - 0.5, count + 0.5, 0.5),
    )
    axes.spines[["top", "right"]].set_visible(True)
    if count <= 12:
        labels = history["asperity"].values[by_height]
        axes.set_yticks(range(1, count + 1, row_stride), [str(label) for label in labels])
        axes.set_ylabel("asperity")
    else:
        axes.set_ylabel("asperities by height,\nhighest on top")
    mark_steps_and_times(axes, history)
    axes.set_title("Slip state")


def state_handles() -> "list[Patch]":
    """Return what a legend shows of the colours of the slip states."""
    from matplotlib.patches import Patch

    states = zip(STATE_COLOURS, STATES, strict=True)
    return [Patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=name) for colour, name in states]


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipMapPicture(Picture):
    """The slip state of each asperity at each step."""

    kind = "slip-map"

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_slip_map(what, **place)
