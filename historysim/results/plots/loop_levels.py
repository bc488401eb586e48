"""Picture of what friction loops say over the normal load, with the scatter of the loops at each load."""

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import xarray as xr

from historysim.basics.units import prefixed, quantity_text
from historysim.measured.loop_table import LoopTable
from historysim.results.plots.paper import PAGE, Drawn, Place, paper
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LOWEST = 85.0
"""Height from which on there are two rows [mm]."""
PANELS = "friction_force", "friction_coefficient", "preliminary_displacement", "dissipated_energy"
DIRECTIONS = (("forward", "^", STATE_COLOURS[1]), ("backward", "v", STATE_COLOURS[2]), ("both", "o", INK))
APART = 0.02
"""How far the marks of one load stand from each other, over the range of the loads."""


def plot_loop_levels(table: xr.Dataset, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw friction force, friction coefficient, preliminary displacement and energy over the normal load.

    Error bars are the standard deviation of one loop; lines are the laws that were fitted to the means at the loads.

    Parameters
    ----------
    table : xarray.Dataset
        From ``Loops.by_load().to_dataset()``, or the file that ``historysim loops --levels`` writes; with amplitudes in
        place of loads (``by_amplitude``) there are no laws.
    title : str
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.
    """
    with paper(plot_loop_levels, (PAGE, 122.0), place) as page:
        # side by side they are flat, and there is room for one row
        rows = 1 if page.height < LOWEST else 2
        shown = PANELS if rows == 2 else (PANELS[0], PANELS[2])
        grid: Any = page.several(len(PANELS)).subplots(rows, 2, sharex=True, squeeze=False)
        for axes, quantity in zip(grid.flat, shown, strict=True):
            _draw(axes, table, quantity)
        page.left_out(*(quantity.replace("_", " ") for quantity in PANELS if quantity not in shown))
        along = next(str(name) for name in ("level", "amplitude_class") if name in table.coords)
        _, prefix = prefixed(float(table[along].max()))
        for axes in grid[-1]:
            axes.set_xlabel(f"{table[along].attrs['long_name']} ({prefix}{table[along].attrs['units']})")
        page.legend(grid[0, 0], extra="bars: standard deviation of one loop")
        page.heading(title or str(table.attrs.get("title", "")))
    return page.drawn


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
        text = f"$F$ = {told['friction_line_slope']:.3g} $N$ {sign} {quantity_text(abs(offset), 'N', 3)}"
    elif f"{quantity}_exponent" in told:
        law = told[f"{quantity}_factor"] * load ** told[f"{quantity}_exponent"]
        text = f"∝ $N^{{{told[f'{quantity}_exponent']:.2f}}}$"
    else:
        return
    axes.plot(load * load_factor, law * factor, color=FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0)
    axes.set_title(text, loc="right", color=FAINT, fontsize=7.5, fontweight="normal")


@figure_of.register(LoopTable)
def _of_levels(what: LoopTable, *, place: Place, **_: Any) -> Drawn:
    return plot_loop_levels(what.to_dataset(), **place)
