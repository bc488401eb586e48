"""Picture of the tangential load over the displacement, with the stiffness below it."""

from typing import TYPE_CHECKING

import attrs
import xarray as xr

from historysim.results.analysis.recorded import check_recorded
from historysim.results.plots.along_path import draw_coloured, thinned
from historysim.results.plots.paper import COLUMN, Size, new_figure
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import FAINT, scaled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_stiffness(history: xr.Dataset, *, size: Size | None = None) -> "Figure":
    """Draw the tangential load over the tangential displacement, and below it the tangential stiffness.

    Parameters
    ----------
    history : xarray.Dataset
        A history. Long ones are thinned to what a page can show.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 90 mm wide, or of that size; the colour tells time in both panels.

    Raises
    ------
    InputError
        What is no history.
    """
    check_recorded(history, "tangential_stiffness")
    thin = thinned(history)
    displacement, length_unit = scaled(thin["tangential_displacement"].values, "m")
    time = thin["time"].values
    with new_figure(size, (COLUMN, 110.0)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.3, 1))
        for axes, name, label, unit in (
            (upper, "total_tangential_load", "tangential load $T$", "N"),
            (lower, "tangential_stiffness", r"stiffness $\mathrm{d}T/\mathrm{d}U$", "N/m"),
        ):
            values, known = scaled(thin[name].values, unit)
            axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
            line = draw_coloured(axes, displacement, values, time)
            axes.margins(0.04, 0.06)
            axes.set_ylabel(f"{label} ({known})")
        upper.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
        lower.set_xlabel(f"tangential displacement $U$ ({length_unit})")
        bar = figure.colorbar(line, ax=[upper, lower], location="top", aspect=40, pad=0.02)
        bar.set_label("time (s)")
        bar.outline.set_linewidth(0.4)
    return figure


@PICTURES.register
@attrs.frozen(kw_only=True)
class StiffnessPicture(Picture):
    """The tangential load over the displacement, and the tangential stiffness."""

    kind = "stiffness"
    caption = "The tangential load over the displacement, and the tangential stiffness."
    place = 4
    totals = True

    def drawn(self, what: xr.Dataset, size: Size | None = None) -> "Figure":
        """Return a figure of it alone."""
        return plot_stiffness(what, size=size)
