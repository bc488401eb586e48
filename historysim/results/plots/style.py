"""What all pictures share: colours, lines, and numbers with a readable unit.

Colours are told apart by readers with any colour vision and in grey print: lightness rises from stick to slip.
"""

import re
from typing import TYPE_CHECKING, Any

from historysim.basics.units import prefixed

if TYPE_CHECKING:
    from historysim.basics.array_types import Floats

STATES = ("separated", "full stick", "partial slip", "gross slip")
STATE_COLOURS = ("#ffffff", "#12355b", "#d1603d", "#f3d180")
INK = "#222222"
FAINT = "#6e6e6e"
"""Of notes and thin lines: on white its contrast is 5.1 to 1."""
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
DIVERGING = "RdBu_r"
"""Colours of quantities with a sign: 0 is white, in the middle."""


def scaled(values: "Floats", unit: str) -> "tuple[Floats, str]":
    """Return values times the factor of a readable SI prefix, and the unit with that prefix."""
    import numpy as np

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


def plain_title(title: str, width: float, size: float, lines: int = 1) -> str:
    """Return a title on so many lines at most that fit a width, with no mathematics between dollar signs.

    Parameters
    ----------
    title : str
    width : float
        [mm]
    size : float
        Of the letters [pt].
    lines : int
    """
    # a number and its unit stay together
    whole = re.sub(UNBROKEN, "\N{NO-BREAK SPACE}", " ".join(title.split()))
    found = broken(whole.replace("$", r"\$"), width * POINTS_PER_MILLIMETRE, size)
    if len(found) > lines:
        last = found[lines - 1]
        while " " in last and width_of(f"{last} …", size) > width * POINTS_PER_MILLIMETRE:
            last = last.rsplit(" ", 1)[0]
        found = [*found[: lines - 1], f"{last} …"]
    return "\n".join(found).replace("\N{NO-BREAK SPACE}", " ")


UNBROKEN = r"(?<=\d) (?=[nµm]?[mN]\b|[kMG]?Pa\b)|(?<==) (?=\S)|(?<=\w) (?==)"
"""Spaces at which no line is broken: before a unit, and beside an equals sign."""
POINTS_PER_MILLIMETRE = 72 / 25.4


def width_of(line: str, size: float, *, bold: bool = False) -> float:
    """Return the width of a line [pt] in letters of a size [pt]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    letters = FontProperties(size=size, weight="bold" if bold else "normal")
    measured: float = text_to_path.get_text_width_height_descent(line, letters, ismath=False)[0]
    return measured


def broken(text: str, width: float, size: float, *, bold: bool = False) -> list[str]:
    """Return the lines of a text that is broken at spaces so that each fits a width, as far as words do.

    Parameters
    ----------
    text : str
    width, size : float
        Of a line, and of the letters [pt].
    bold : bool
    """
    lines: list[str] = []
    for word in text.split(" "):
        if lines and width_of(f"{lines[-1]} {word}", size, bold=bold) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines
