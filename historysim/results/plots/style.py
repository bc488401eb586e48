"""What all pictures share: colours, lines, and numbers with a readable unit.

Colours are told apart by readers with any colour vision and in grey print: lightness rises from stick to slip.
"""

import re
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from historysim.basics.units import prefixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Floats = npt.NDArray[np.float64]

STATES = ("separated", "full stick", "partial slip", "gross slip")
STATE_COLOURS = ("#ffffff", "#12355b", "#d1603d", "#f3d180")
INK = "#222222"
FAINT = "#8a8a8a"
MARK = STATE_COLOURS[1]

STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "legend.frameon": False,
    "legend.fontsize": 7.5,
}


FEW_DECADES = 30.0
"""Greatest over smallest number of a logarithmic axis up to which 2 and 5 have ticks with numbers, too."""
WIDEST_NAME = 34
"""Characters of a name below a picture from which on there is one column of names."""


def scaled(values: Floats, unit: str) -> tuple[Floats, str]:
    """Return values times the factor of a readable SI prefix, and the unit with that prefix."""
    factor, prefix = prefixed(np.nanmax(np.abs(values), initial=0.0))
    return values * factor, prefix + unit


def by_factors(axis: Any) -> None:
    """Make an axis logarithmic, with plain numbers: 0.4, and not 4 × 10⁻¹."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    (axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale)("log")
    low, high = axis.get_data_interval()
    few = high < FEW_DECADES * low
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if few else (1,)))
    axis.set_minor_formatter("")
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def plain_title(title: str, width: int = 110, lines: int = 1) -> str:
    """Return a title on so many lines at most, that fit the width, with no mathematics between dollar signs."""
    # a number and its unit stay together
    whole = re.sub(r"(?<=\d) (?=[nµm]?[mN]\b|[kMG]?Pa\b)", "\N{NO-BREAK SPACE}", title)
    parts = textwrap.wrap(whole, width, max_lines=lines, placeholder=" …")
    return "\n".join(parts).replace("$", r"\$")


def legend_below(
    figure: "Figure | SubFigure", *axes: "Axes", extra: str = "", columns: int = 4, **options: Any
) -> None:
    """Name what is drawn in some axes below the figure, each name once, where no data can lie."""
    named: dict[str, Any] = {}
    for each in axes:
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    if extra:
        from matplotlib.lines import Line2D

        named[extra] = Line2D([], [], linestyle="")
    figure.legend(
        named.values(),
        named.keys(),
        loc="outside lower left",
        ncols=1 if max(map(len, named), default=0) > WIDEST_NAME else columns,
        columnspacing=2.0,
        handlelength=1.6,
        **options,
    )
