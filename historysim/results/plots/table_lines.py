"""Picture of a table that was written to a file: its columns over the first one, those of one unit in one panel."""

from typing import Any, Unpack

import numpy as np

from historysim.basics.units import prefixed
from historysim.errors import InputError
from historysim.results.plots.line_styles import line_style
from historysim.results.plots.paper import PAGE, Drawn, Place, paper
from historysim.results.plots.pictures import figure_of
from historysim.results.written_table import WrittenTable

MOST_PANELS, MOST_LINES = 4, 6


def plot_table(table: WrittenTable, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw the columns of a table over its first column of numbers.

    Parameters
    ----------
    table : WrittenTable
        From `historysim.open`.
    title : str
        A heading; by default the name of the file.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.

    Raises
    ------
    InputError
        A table with fewer than two columns of numbers.
    """
    numbers = {str(name): each for name, each in table.columns.items() if each.dtype.kind in "fiu"}
    if len(numbers) < 2 or not table.columns.sizes["row"]:
        raise InputError(f"{table.name}: has no two columns of numbers, so that there is nothing to draw; show says it")
    (first, over), *others = numbers.items()
    by_unit: dict[str, list[str]] = {}
    for name, each in others:
        by_unit.setdefault(str(each.attrs.get("units", "1")), []).append(name)
    panels = list(by_unit.items())[:MOST_PANELS]
    with paper(plot_table, (PAGE, 30.0 + 45.0 * len(panels)), place) as page:
        if len(panels) == 1:
            all_axes = [page.axes()]
        else:
            all_axes = list(page.several(len(panels)).subplots(len(panels), 1, sharex=True))
        at, under = _scaled(over.values, str(over.attrs.get("units", "1")))
        left_out = [name for _, names in list(by_unit.items())[MOST_PANELS:] for name in names]
        for axes, (unit, names) in zip(all_axes, panels, strict=True):
            left_out += names[MOST_LINES:]
            largest = np.concatenate([numbers[name].values for name in names[:MOST_LINES]])
            factor, prefix = _prefixed(largest, unit)
            for place_of, name in enumerate(names[:MOST_LINES]):
                axes.plot(
                    at, numbers[name].values * factor, label=name.replace("_", " "), **line_style(place_of, MOST_LINES)
                )
            label = names[0].replace("_", " ") if len(names) == 1 else "value"
            axes.set_ylabel(f"{label} ({prefix}{unit})" if unit != "1" else label)
        all_axes[-1].set_xlabel(f"{first.replace('_', ' ')}{under}")
        if len(panels) == 1:
            page.legend(*all_axes)
        else:
            # lines of two panels look alike
            for axes in all_axes:
                axes.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
        page.left_out(*(name.replace("_", " ") for name in left_out))
        page.heading(title or table.name)
    return page.drawn


def _scaled(values: Any, unit: str) -> tuple[Any, str]:
    factor, prefix = _prefixed(values, unit)
    return values * factor, "" if unit == "1" else f" ({prefix}{unit})"


def _prefixed(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor and the prefix for a column; units of several factors, powers and seconds have none."""
    known = np.abs(values[np.isfinite(values)])
    if unit not in {"N", "m", "J", "Pa"} or not known.size:
        return 1.0, ""
    return prefixed(float(known.max()))


@figure_of.register(WrittenTable)
def _of_table(what: WrittenTable, *, title: str = "", place: Place, **_: Any) -> Drawn:
    return plot_table(what, title=title, **place)
