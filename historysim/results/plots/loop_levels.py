"""Picture of what friction loops say over the normal load, with the scatter of the loops at each load."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.units import prefixed, quantity_text
from historysim.measured.loop_table import LoopTable
from historysim.results.plots.paper import PAGE, Size, new_figure
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, legend_below, plain_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

PANELS = "friction_force", "friction_coefficient", "preliminary_displacement", "dissipated_energy"
DIRECTIONS = (("forward", "^", STATE_COLOURS[1]), ("backward", "v", STATE_COLOURS[2]), ("both", "o", INK))
APART = 0.02
"""How far the marks of one load stand from each other, over the range of the loads."""


def plot_loop_levels(table: xr.Dataset, *, title: str = "", size: Size | None = None) -> "Figure":
    """Draw friction force, friction coefficient, preliminary displacement and energy over the normal load.

    Error bars are the standard deviation of one loop; lines are the laws that were fitted to the means at the loads.

    Parameters
    ----------
    table : xarray.Dataset
        From ``Loops.by_load().to_dataset()``, or the file that ``historysim loops --levels`` writes; with amplitudes in
        place of loads (``by_amplitude``) there are no laws.
    title : str
        A heading.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide.
    """
    with new_figure(size, (PAGE, 122.0)) as figure:
        grid = figure.subplots(2, 2, sharex=True)
        for axes, quantity in zip(grid.flat, PANELS, strict=True):
            _draw(axes, table, quantity)
        along = next(str(name) for name in ("level", "amplitude_class") if name in table.coords)
        _, prefix = prefixed(float(table[along].max()))
        for axes in grid[1]:
            axes.set_xlabel(f"{table[along].attrs['long_name']} ({prefix}{table[along].attrs['units']})")
        legend_below(figure, grid[0, 0], extra="bars: standard deviation of one loop")
        figure.suptitle(plain_title(title or str(table.attrs.get("title", ""))), x=0.01, ha="left", fontsize=9.5)
    return figure


def _draw(axes: "Axes", table: xr.Dataset, quantity: str) -> None:
    along = table[quantity].dims[0]
    load, load_prefix = table[along].values, prefixed(float(table[along].max()))[0]
    label, unit = (table[quantity].attrs[name] for name in ("long_name", "units"))
    factor, prefix = (1.0, "") if unit == "1" else prefixed(float(np.nanmax(table[quantity].values, initial=0.0)))
    width = APART * (np.ptp(load) or load.max()) * load_prefix
    for place, (direction, marker, colour) in enumerate(DIRECTIONS):
        if "direction" in table[quantity].dims:
            mean, scatter = (
                table[name].sel(direction=direction).values for name in (quantity, f"{quantity}_standard_deviation")
            )
        elif direction == "both":
            mean, scatter = (table[name].values for name in (quantity, f"{quantity}_standard_deviation"))
        else:
            continue
        style: dict[str, Any] = {"color": colour, "ms": 4, "mec": "white", "mew": 0.4, "elinewidth": 0.8, "capsize": 2}
        at = load * load_prefix + (place - 1) * width * ("direction" in table[quantity].dims)
        # one loop has a mean and no scatter
        axes.errorbar(at, mean * factor, np.nan_to_num(scatter) * factor, fmt=marker, label=direction, **style)
    _draw_law(axes, table, quantity, load_prefix, factor)
    symbol = {"1": "", "N m-1": f"{prefix}N/m"}.get(unit, f"{prefix}{unit}")
    axes.set_title(f"{label} ({symbol})" if symbol else label, fontsize=7.5, fontweight="normal")
    # from zero, so that heights compare
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), 1.1 * high)
    axes.margins(x=0.08)


def _draw_law(axes: "Axes", table: xr.Dataset, quantity: str, load_factor: float, factor: float) -> None:
    """Draw the law of a quantity, with its numbers at the upper end."""
    told = table.attrs
    along = table[quantity].dims[0]
    load = np.linspace(float(table[along].min()), float(table[along].max()), 60)
    if quantity == "friction_force" and "friction_line_slope" in told:
        law = told["friction_line_slope"] * load + told["friction_line_intercept"]
        offset = told["friction_line_intercept"]
        sign = "−" if offset < 0 else "+"
        text = f"$F$ = {told['friction_line_slope']:.3g} $N$ {sign} {quantity_text(abs(offset), 'N', 2)}"
    elif f"{quantity}_exponent" in told:
        law = told[f"{quantity}_factor"] * load ** told[f"{quantity}_exponent"]
        text = f"∝ $N^{{{told[f'{quantity}_exponent']:.2f}}}$"
    else:
        return
    axes.plot(load * load_factor, law * factor, color=FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0)
    axes.set_title(text, loc="right", color=FAINT, fontsize=7.5, fontweight="normal")


@figure_of.register(LoopTable)
def _of_levels(what: LoopTable, *, size: Size | None = None, **_: Any) -> "Figure":
    return plot_loop_levels(what.to_dataset(), size=size)
