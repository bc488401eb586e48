"""Pictures of wear: the volume that asperities have lost, over time, or over the distance that they slid."""

from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.results.analysis.recorded import shape_of
from historysim.results.plots.along_path import kept_steps
from historysim.results.plots.line_styles import line_style
from historysim.results.plots.paper import COLUMN, Drawn, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import FAINT, INK, MARK, STATE_COLOURS, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 8
"""Asperities whose own volume is drawn: those that lose most."""


def check_worn(history: xr.Dataset) -> None:
    """Check that a history tells what its asperities lose.

    Raises
    ------
    InputError
        It does not.
    """
    if "worn_volume" not in history:
        raise InputError("the history has no worn_volume; expected one of a scenario with [wear], with its asperities")


def draw_wear(axes: "Axes", history: xr.Dataset, over: str = "time") -> None:
    """Draw the worn volume of all asperities, and of those that lose most, into axes."""
    kept = kept_steps(history.sizes["step"])
    worn = history["worn_volume"].isel(step=kept).values
    total = worn.sum(axis=1)
    # µm³ for those with a micrometre to wear: prefixes of cubes are read with the metre
    factor, unit = (1e27, "nm³") if total.max(initial=0.0) < 1e-21 else (1e18, "µm³")
    if over == "time":
        along, label = history["time"].values[kept], "time (s)"
    else:
        values, length = scaled(history["total_slid_distance"].values[kept], "m")
        along, label = values, f"distance that all slid ({length})"
    axes.plot(along, total * factor, color=INK, linewidth=1.3, label="all")
    most = np.argsort(-worn[-1], kind="stable")[: min(MOST, worn.shape[1])]
    most = most[worn[-1, most] > 0]
    if worn.shape[1] > 1:
        for number, column in enumerate(most):
            name = f"asperity {int(history['asperity'].values[column])}"
            axes.plot(along, worn[:, column] * factor, label=name, **line_style(number, most.size))
    axes.set(title="Wear", xlabel=label, ylabel=f"worn volume ({unit})", ylim=(0, None))
    axes.margins(x=0.01)


def plot_wear(history: xr.Dataset, **place: Unpack[Place]) -> Drawn:
    """Draw the volume that asperities lose: over time, over the distance slid, and the summits before and after.

    Parameters
    ----------
    history : xarray.Dataset
        A history of asperities that wear.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.

    Raises
    ------
    InputError
        Nothing wears.
    """
    check_worn(history)
    with paper(plot_wear, (2 * COLUMN, 75.0), place) as page:
        figure: Any = page.several()
        if page.width >= 140.0:
            left, right = figure.subplots(1, 2, width_ratios=(1.5, 1))
        elif page.height >= 100.0:
            left, right = figure.subplots(2, 1)
        else:
            left, right = figure.subplots(), None
            page.left_out("summits")
        draw_wear(left, history)
        page.legend(left)
        page.heading(str(history.attrs.get("title", "")))
        if right is not None:
            _draw_summits(right, history)
    return page.drawn


def _draw_summits(axes: "Axes", history: xr.Dataset) -> None:
    """Draw the summits before and after."""
    names = ("height", "radius")
    heights, radii = (np.stack([_summits(history, name, step) for step in (0, -1)]) for name in names)
    heights, unit = scaled(heights, "m")
    radii, radius_unit = scaled(radii, "m")
    for row, (marker, name, colour) in enumerate((("o", "before", MARK), ("s", "after", STATE_COLOURS[2]))):
        axes.plot(heights[row], radii[row], marker, ms=4, mfc="none", color=colour, label=name)
    axes.set(xlabel=f"summit height $z$ ({unit})", ylabel=f"summit radius $R$ ({radius_unit})")
    axes.set_title("Summits")
    axes.set_title("○ before  □ after", loc="right", color=FAINT, fontsize=7, fontweight="normal")


def _summits(history: xr.Dataset, name: str, step: int) -> Floats:
    found: Floats = shape_of(history, f"summit_{name}", step)
    return found


@PICTURES.register
@attrs.frozen(kw_only=True)
class WearPicture(Picture):
    """The volume that asperities lose, and their summits before and after."""

    kind = "wear"
    caption = "The volume that the asperities lose, and their summits before and after."
    place = 8

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether a report shows it: a history of asperities that wear."""
        return super().reported(history) and "worn_volume" in history

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_wear(what, **place)
