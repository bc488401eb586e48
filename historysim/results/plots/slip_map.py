"""Picture of the slip state of each asperity along the path."""

from typing import TYPE_CHECKING

import attrs
import numpy as np
import xarray as xr

from historysim.results.analysis.recorded import check_any, check_recorded
from historysim.results.plots.along_path import mark_steps_and_times
from historysim.results.plots.paper import PAGE, Size, new_figure
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import INK, STATE_COLOURS, STATES, plain_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 2_000
MOST_ROWS = 1_000


def plot_slip_map(history: xr.Dataset, *, size: Size | None = None) -> "Figure":
    """Draw the slip state of each asperity at each step, the highest asperity on top.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities. Of a large one every so many-th step and asperity is drawn.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide, or of that size.

    Raises
    ------
    InputError
        A history without asperities.
    """
    check_recorded(history, "slip_state")
    check_any(history)
    with new_figure(size, (PAGE, 75.0)) as figure:
        draw_slip_map(figure.add_subplot(), history)
        if title := history.attrs.get("title"):
            figure.suptitle(plain_title(str(title)), x=0.01, ha="left", fontsize=9.5)
    return figure


def draw_slip_map(axes: "Axes", history: xr.Dataset) -> None:
    """Draw the slip state of each asperity at each step into axes, with a legend above them."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

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
    axes.legend(
        handles=[
            Patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=name)
            for colour, name in zip(STATE_COLOURS, STATES, strict=True)
        ],
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=4,
        borderaxespad=0.2,
        handlelength=1.2,
        columnspacing=1.2,
    )


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipMapPicture(Picture):
    """The slip state of each asperity at each step."""

    kind = "slip-map"

    def drawn(self, what: xr.Dataset, size: Size | None = None) -> "Figure":
        """Return a figure of it alone."""
        return plot_slip_map(what, size=size)
