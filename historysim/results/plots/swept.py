"""Picture of a quantity over what was swept, with its spread over the rest, such as seeds."""

import math
from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.units import prefixed
from historysim.errors import InputError
from historysim.results.plots.paper import COLUMN, Size, new_figure
from historysim.results.plots.style import INK, STATE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

SPREADS = ("deviation", "quantiles", "none")
QUANTILES = (0.1, 0.9)
WIDE = 30.0
"""Greatest over smallest number of an axis, from which on it may be logarithmic."""
OF_A_SCENARIO = " of the scenario"
"""How the name of a swept key ends."""
MOST_LINES = 6
LINES = (
    (STATE_COLOURS[1], "-", "o"),
    (STATE_COLOURS[2], "--", "s"),
    ("#4aa8e0", "-.", "^"),
    ("#7a7a7a", ":", "D"),
    ("#b08a1e", (0, (5, 1, 1, 1, 1, 1)), "v"),
    (INK, (0, (1, 2)), "P"),
)
"""Colour, dashes and marker of each line: told apart in grey print, too."""


def plot_swept(
    sweep: xr.Dataset,
    quantity: str,
    over: str | None = None,
    *,
    each: str | None = None,
    spread: str = "deviation",
    size: Size | None = None,
) -> "Figure":
    """Draw a quantity of a sweep over a swept one.

    Parameters
    ----------
    sweep : xarray.Dataset
        From `historysim.sweep`, or any Dataset whose ``quantity`` has only dimensions that were swept.
    quantity : str
        The variable to draw.
    over : str, optional
        The dimension along the axis; by default the first with numbers that are not those of seeds, or else the
        longest. Where its values repeat, or are those of seeds, points are not joined.
    each : str, optional
        A dimension whose members are lines of their own; by default the next one, where it has at most 6.
    spread : {"deviation", "quantiles", "none"}
        Over all other dimensions, such as seeds, the mean is drawn with error bars of one standard deviation, or the
        median with a band from the 10 to the 90 % quantile, or the mean alone.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 90 mm wide, or of that size.

    Raises
    ------
    InputError
        Names that the sweep does not have, a quantity that is no number, more lines than can be told apart, or another
        spread.
    """
    values, over, each = _chosen(sweep, quantity, over, each)
    if spread not in SPREADS:
        raise InputError(f"spread is {spread!r}; expected one of {', '.join(SPREADS)}")
    rest = [name for name in values.dims if name not in {over, each}]
    along, label, ticks = _axis(sweep, over)
    # as they were written they may go to and fro
    ascending = np.argsort(along, kind="stable")
    along = along[ascending]
    joined = "seed" not in over and bool((np.diff(along) > 0).all())
    factor, unit = _unit(values)
    members: list[Any] = [None] if each is None else list(range(sweep.sizes[each]))
    with new_figure(size, (COLUMN, 70.0)) as figure:
        axes = figure.add_subplot()
        for member, line in zip(members, LINES, strict=False):
            part = values if member is None else values.isel({each: member})
            order = [over, *rest]
            numbers = part.transpose(*order).values.reshape(along.size, -1)[ascending] * factor
            label_of_it = "" if member is None else _member(sweep, str(each), member)
            _draw(axes, along, numbers, spread, line if joined else (line[0], "none", line[2]), label_of_it)
        if ticks:
            axes.set_xticks(along, ticks)
        elif _spaced_by_factors(along):
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter("{x:g}")
        axes.set(xlabel=label, ylabel=f"{quantity.replace('_', ' ')}{unit}")
        axes.margins(0.06, 0.08)
        if each is not None:
            # beside the axes: inside, it might lie on a line
            figure.legend(title=_name(sweep, str(each)), loc="outside lower center", ncols=min(len(members), 3))
        axes.set_title(_caption(sweep, values, rest, spread), fontsize=7, fontweight="normal")
    return figure


def _chosen(
    sweep: xr.Dataset, quantity: str, over: str | None, each: str | None
) -> tuple[xr.DataArray, str, str | None]:
    if quantity not in sweep.data_vars or sweep[quantity].dtype.kind not in "fiu" or not sweep[quantity].dims:
        known = [str(name) for name, values in sweep.data_vars.items() if values.dtype.kind in "fiu" and values.dims]
        raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(known)}")
    values = sweep[quantity]
    # seeds repeat, and are no quantity to draw over
    free = [str(name) for name in values.dims if "seed" not in str(name)]
    if over is None:
        names = [name for name in free if name != each] or [str(name) for name in values.dims if name != each]
        over = next((name for name in names if _numbers(sweep, name)), None)
        over = over or max(names, key=lambda name: sweep.sizes[name], default="")
    for name in filter(None, (over, each)):
        if name not in values.dims:
            raise InputError(
                f"{quantity} does not go over {name!r}; expected one of {', '.join(map(str, values.dims))}"
            )
    if over == each:
        raise InputError(f"each is {each!r}, which is on the axis already; expected another dimension")
    if each is None:
        each = next((name for name in free if name != over and 1 < sweep.sizes[name] <= MOST_LINES), None)
    elif sweep.sizes[each] > MOST_LINES:
        raise InputError(f"each is {each!r} with {sweep.sizes[each]} members; expected at most {MOST_LINES} lines")
    return values, over, each


def _numbers(sweep: xr.Dataset, name: Hashable) -> bool:
    return name not in sweep.coords or sweep[name].dtype.kind in "fiu"


def _axis(sweep: xr.Dataset, over: str) -> tuple[Floats, str, list[str]]:
    """Return where the members of a dimension stand on the axis, its label, and their names where they are texts."""
    label = _name(sweep, over)
    if over in sweep.coords and _numbers(sweep, over):
        factor, unit = _unit(sweep[over])
        return sweep[over].values * factor, f"{label}{unit}", []
    names = [str(value) for value in sweep[over].values] if over in sweep.coords else []
    return np.arange(sweep.sizes[over], dtype=np.float64), label, names


def _name(sweep: xr.Dataset, dimension: str) -> str:
    """Return what a dimension is called in a picture: of a key of a scenario the last part, or two if that is short."""
    if dimension not in sweep.coords:
        return dimension.replace("_", " ")
    told = str(sweep[dimension].attrs.get("long_name", ""))
    key = told.removesuffix(OF_A_SCENARIO) if told.endswith(OF_A_SCENARIO) else dimension
    *before, last = key.split(".")
    if before and "_" not in last and "[" not in before[-1]:
        last = f"{before[-1]} {last}"
    return last.replace("_", " ")


def _spaced_by_factors(along: Floats) -> bool:
    """Return whether numbers span so much, and so evenly by their factors, that a linear axis would crowd them."""
    if along.size < 3 or not (along > 0).all() or along.max() < WIDE * along.min():
        return False
    factors = np.diff(np.log(np.sort(along)))
    return bool(factors.max() < 4 * max(factors.min(), 1e-12))


def _unit(values: xr.DataArray) -> tuple[float, str]:
    """Return the factor of a readable prefix, and the unit in brackets."""
    unit = str(values.attrs.get("units", ""))
    if unit in {"", "1"}:
        return 1.0, ""
    greatest = float(np.nanmax(np.abs(values.values), initial=0.0))
    if unit == "m2":
        # the prefix is squared with the metre
        factor, prefix = prefixed(math.sqrt(greatest))
        return factor**2, f" ({prefix}m²)"
    # other prefixes of squares and cubes would be misread; behind the first part of a unit they do not count
    if any(character.isdigit() for character in unit.split(maxsplit=1)[0]):
        return 1.0, f" ({unit.replace('2', '²').replace('3', '³')})"
    factor, prefix = prefixed(greatest)
    return factor, f" ({prefix}{unit.replace(' m-1', '/m')})"


def _member(sweep: xr.Dataset, each: str, member: int) -> str:
    if each not in sweep.coords:
        return str(member)
    value = sweep[each].values[member]
    if not _numbers(sweep, each):
        return str(value)
    factor, unit = _unit(sweep[each])
    return f"{value * factor:.4g}{unit.replace('(', '').replace(')', '')}"


def _draw(axes: "Axes", along: Floats, numbers: Floats, spread: str, line: tuple[Any, ...], label: str) -> None:
    colour, dashes, marker = line
    looks: dict[str, Any] = {"color": colour, "linestyle": dashes, "marker": marker, "ms": 3.5, "linewidth": 1.0}
    # cells that have failed are gaps
    there = np.isfinite(numbers).any(axis=1)
    along, numbers = along[there], numbers[there]
    if not along.size:
        return
    if spread == "quantiles" and numbers.shape[1] > 1:
        low, middle, high = np.nanquantile(numbers, [QUANTILES[0], 0.5, QUANTILES[1]], axis=1)
        axes.fill_between(along, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(along, middle, label=label, **looks)
        return
    mean = np.nanmean(numbers, axis=1)
    count = np.isfinite(numbers).sum(axis=1)
    deviation = None
    if spread == "deviation" and (count > 1).any():
        # of one cell there is no deviation
        square = np.nansum((numbers - mean[:, np.newaxis]) ** 2, axis=1)
        deviation = np.where(count > 1, np.sqrt(square / np.maximum(count - 1, 1)), np.nan)
    axes.errorbar(along, mean, yerr=deviation, capsize=2, elinewidth=0.8, label=label, **looks)


def _caption(sweep: xr.Dataset, values: xr.DataArray, rest: list[Hashable], spread: str) -> str:
    cells = int(np.prod([values.sizes[name] for name in rest]))
    if cells == 1 or not rest:
        return ""
    over = ", ".join(_name(sweep, str(name)) for name in rest)
    told = {
        "deviation": "mean ± standard deviation",
        "quantiles": f"median, {100 * QUANTILES[0]:.0f} to {100 * QUANTILES[1]:.0f} %",
        "none": "mean",
    }
    return f"{told[spread]} over {cells} cells ({over})"
