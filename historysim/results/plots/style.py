"""What all pictures share: colours, lines, thinning, and numbers with a readable unit.

Colours differ for readers with any colour vision and in grey print: lightness rises from stick to slip.
"""

import itertools
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.basics.units import prefixed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection

STATES = ("separated", "full stick", "partial slip", "gross slip")
STATE_COLOURS = ("#ffffff", "#12355b", "#d1603d", "#f3d180")
INK = "#222222"
# of notes and thin lines: on white its contrast is 5.1 to 1
FAINT = "#6e6e6e"
MARK = STATE_COLOURS[1]
# of quantities with a sign: 0 is white, in the middle
DIVERGING = "RdBu_r"

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

LINES = (
    (STATE_COLOURS[1], "-", "o"),
    (STATE_COLOURS[2], "--", "s"),
    ("#4aa8e0", "-.", "^"),
    ("#7a7a7a", ":", "D"),
    ("#b08a1e", (0, (5, 1, 1, 1, 1, 1)), "v"),
    (INK, (0, (1, 2)), "P"),
    ("#6a3d9a", (0, (6, 2)), "X"),
    ("#33864f", (0, (3, 1, 1, 1)), "*"),
)
"""Colour, dashes and marker of each line of a picture: they differ in grey print, too."""
MOST_LINES = 12

MOST_POINTS = 100_000
"""Points of a line: more than a page can show."""
MOST_PIECES = 256
"""Pieces of one colour in a coloured line."""
FEW_DECADES = 30.0
"""Greatest over smallest number of a logarithmic axis up to which 2 and 5 have ticks with numbers, too."""


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


def zero_lines(axes: "Axes", *, vertical: bool = True) -> None:
    """Draw thin lines where the load, and the displacement, is 0."""
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    if vertical:
        axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)


def plain(text: str) -> str:
    """Return a string that matplotlib does not read as mathematics."""
    return text.replace("$", r"\$")


def line_style(number: int, count: int) -> dict[str, Any]:
    """Return colour, dashes and width of one of some lines without markers.

    Up to eight have colours and dashes of their own; of more, such as the steps of a load, the colours go from light
    to dark.
    """
    if count <= len(LINES):
        colour, dashes, _ = LINES[number]
        return {"color": colour, "linestyle": dashes, "linewidth": 1.1}
    return {"color": line_colours()(number / max(count - 1, 1)), "linestyle": "-", "linewidth": 1.1}


@cache
def line_colours() -> Any:
    """Return the colours of lines, from light to dark."""
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    # the light end is left out: it is lost on white paper
    return ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.08, 1.0, MOST_PIECES)))


def draw_coloured(axes: "Axes", x: Floats, y: Floats, values: Floats, *, pieces: int = MOST_PIECES) -> "LineCollection":
    """Draw a line coloured by values along it, in no more than so many pieces of one colour."""
    from matplotlib.collections import LineCollection

    points = np.column_stack([x, y])
    # a path for each pair of points would take longer than the replay
    ends = np.unique(np.linspace(0, values.size - 1, pieces + 1).astype(int))
    parts = [points[start : end + 1] for start, end in itertools.pairwise(ends)]
    lines = LineCollection(parts, array=values[ends[1:]], cmap=line_colours(), linewidth=1.0, rasterized=True)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    axes.autoscale_view()
    return lines


def thinned(history: "xr.Dataset") -> "xr.Dataset":
    """Return the totals at every n-th step and the last one: no more than a page can show."""
    totals = history[[name for name, variable in history.data_vars.items() if variable.dims == ("step",)]].load()
    return totals.isel(step=kept_steps(history.sizes["step"]))


def kept_steps(steps: int) -> Integers:
    """Return every n-th of a number of steps and the last one: no more than a page can show."""
    return np.union1d(np.arange(0, steps, -(-steps // MOST_POINTS)), steps - 1)


def swings(x: Floats) -> Iterator[tuple[int, int]]:
    """Yield the ends of each swing; a change of direction counts when it exceeds a tenth of the range."""
    threshold = np.ptp(x) / 10
    start = turn = 0
    for index, value in enumerate(x):
        if (value - x[turn]) * (x[turn] - x[start]) >= 0:
            turn = index
        elif abs(value - x[turn]) > threshold:
            yield start, turn
            start, turn = turn, index
    if threshold > 0:
        yield start, turn
