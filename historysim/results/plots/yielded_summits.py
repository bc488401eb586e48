"""Pictures of yielding: the curve of first loading and unloading, and the summits before and after."""

from typing import Any, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.errors import InputError
from historysim.results.analysis.recorded import shape_of
from historysim.results.plots.along_path import kept_steps
from historysim.results.plots.paper import COLUMN, Drawn, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import FAINT, INK, scaled


def plot_yielding(history: xr.Dataset, **place: Unpack[Place]) -> Drawn:
    """Draw the normal load over the approach, where summits yield and where they do not, and radii over heights.

    Parameters
    ----------
    history : xarray.Dataset
        A history of summits that may yield, with its asperities. What lies before its first step is not drawn.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.

    Raises
    ------
    InputError
        Nothing can yield, or no asperity is recorded.
    """
    if "yielded_depth" not in history:
        raise InputError(
            "the history has no yielded_depth; expected one of a scenario whose surface has yielding, "
            "with its asperities"
        )
    kept = kept_steps(history.sizes["step"])
    approach = history["summit_height"].values.max() - history["separation"].values[kept]
    load, spent = history["total_normal_load"].values[kept], history["total_yielding_energy"].values[kept]
    yields = np.diff(spent) > 0
    lengths, length_unit = scaled(approach, "m")
    loads, load_unit = scaled(load, "N")
    with paper(plot_yielding, (2 * COLUMN, 75.0), place) as page:
        figure: Any = page.several()
        if page.width >= 140.0:
            left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
        elif page.height >= 100.0:
            left, right = figure.subplots(2, 1)
        else:
            left, right = figure.subplots(), None
            page.left_out("summits that yielded")
        for chosen, style, name in (
            (yields, {"linewidth": 1.8, "color": INK}, "summits yield"),
            (~yields, {"linewidth": 0.9, "color": "0.45", "linestyle": (0, (4, 2))}, "elastic"),
        ):
            x, y = (np.where(chosen, [each[:-1], each[1:]], np.nan) for each in (lengths, loads))
            gap = np.full(chosen.size, np.nan)
            left.plot(np.stack([*x, gap]).T.ravel(), np.stack([*y, gap]).T.ravel(), label=name, **style)
        left.set(xlabel=f"approach of the highest summit ({length_unit})", ylabel=f"normal load $N$ ({load_unit})")
        left.set_title("First loading, unloading")
        page.legend(left)
        page.heading(str(history.attrs.get("title", "")))
        if right is not None:
            _draw_summits(right, history)
    return page.drawn


def _draw_summits(axes: Any, history: xr.Dataset) -> None:
    """Draw the summits that yielded, before and after."""
    yielded = history["yielding_load"].isel(step=-1).values > 0
    before = [history[f"summit_{name}"].values[yielded] for name in ("height", "radius")]
    after = [shape_of(history, f"summit_{name}", -1)[yielded] for name in ("height", "radius")]
    heights, unit = scaled(np.stack([before[0], after[0]]), "m")
    radii, radius_unit = scaled(np.stack([before[1], after[1]]), "m")
    axes.plot(heights, radii, "-", color="0.75", linewidth=0.6)
    for row, marker in enumerate("os"):
        axes.plot(heights[row], radii[row], marker, ms=4, mfc="none", color=INK)
    axes.set(xlabel=f"summit height $z$ ({unit})", ylabel=f"summit radius $R$ ({radius_unit})")
    axes.set_title("Summits that yielded")
    axes.set_title("○ before  □ after", loc="right", color=FAINT, fontsize=7, fontweight="normal")


@PICTURES.register
@attrs.frozen(kw_only=True)
class YieldingPicture(Picture):
    """The curve of first loading and unloading, and the summits that yielded, before and after."""

    kind = "yielding"
    caption = "First loading and unloading, and the summits that yielded, before and after."
    place = 7

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether a report shows it: a history of summits that may yield."""
        return super().reported(history) and "yielded_depth" in history

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_yielding(what, **place)
