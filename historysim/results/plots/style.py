"""Style shared by all pictures: colours, lines, thinning, and numbers with a readable unit.

Colours differ for readers with any colour vision and in grey print: lightness rises from stick to
slip.
"""

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.arguments import ArrayLike, Floats, Integers
from historysim.basics.units import choose_prefix

if TYPE_CHECKING:
    import xarray as xr

# properties of artists of matplotlib, or options of charts
Look = dict[str, Any]

STATES = ("separated", "full stick", "partial slip", "gross slip")
STATE_COLOURS = ("#ffffff", "#12355b", "#d1603d", "#f3d180")
INK = "#222222"
# notes and thin lines: contrast 5.1 to 1 on white
FAINT = "#6e6e6e"
MARK = STATE_COLOURS[1]
# quantities with a sign: 0 is white
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
    "figure.constrained_layout.h_pad": 0.06,
    "legend.fontsize": 7.5,
}

# Colour, dashes and marker of each line of a picture: they differ in grey print, too.
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
MOST_LINES = 12
# a limit, or a law
DASHED: Look = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4, 2))}

# SI units that have a readable prefix in labels.
WITH_PREFIX = {"m", "m²", "m³", "N", "N/m", "J", "J/m²", "Pa"}
LOOP_NUMBER = "loop, counted from 0"  # label of an axis of loops, counted as in the tables
# labels of a friction loop
DISPLACEMENT, LOAD = "tangential displacement $U$ (m)", "tangential load $T$ (N)"
# a y label above its axes, in place of the title
LABEL_ABOVE: Look = {"loc": "left", "fontsize": 7, "fontweight": "normal", "wrap": True}
LOOP_AXES: Look = {"x": DISPLACEMENT, "y": LOAD, "zero": "xy"}
MOST_EDGED = 60  # loops up to which there is room for the edge of each mark
MOST_POINTS = 100_000  # points of a line: more than a picture can show


def choose_scale(unit: str, *values: ArrayLike) -> tuple[float, str]:
    """Return the factor of a readable SI prefix for the greatest of some values, and the unit with that prefix."""
    text = format_unit(unit)
    if text not in WITH_PREFIX:
        return 1.0, text
    finite_values = (array[np.isfinite(array)] for array in map(np.asarray, values))
    greatest = max(float(np.abs(array).max(initial=0.0)) for array in finite_values)
    # the prefix of an area is squared with the metre
    order = {"m²": 2, "m³": 3}.get(text, 1)
    factor, prefix = choose_prefix(greatest ** (1 / order))
    return factor**order, prefix + text


def format_unit(unit: str) -> str:
    """Return a unit as it is printed: ``"N m-1"`` as N/m, ``"m2"`` as m², and ``"1"`` as nothing."""
    numerator, *denominators = "" if unit == "1" else unit, *unit.split()[1:]
    if denominators and all("-" in factor for factor in denominators):
        products = "·".join(factor.replace("-1", "").replace("-", "") for factor in denominators)
        numerator = f"{unit.split(maxsplit=1)[0]}/{products}"
    return numerator.translate(str.maketrans("23", "²³"))


def escape_math(text: str) -> str:
    """Return a string that matplotlib does not read as mathematics."""
    return text.replace("$", r"\$")


def line_style(number: int, count: int) -> Look:
    """Return colour, dashes and width of one line of several.

    Up to eight lines have separate colours and dashes; the colours of more, such as steps of a
    load, range from light to dark.
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

    # the light end is left out: it is lost on white
    return ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.08, 1.0, 256)))


# Channels of a history whose extremes a thinned line keeps.
_KEPT_CHANNELS = (
    "total_tangential_load",
    "tangential_displacement",
    "total_normal_load",
    "separation",
)


def thin_history(history: "xr.Dataset") -> "xr.Dataset":
    """Return the totals at the steps that a picture can show: the extremes of loads and displacements."""
    totals = [
        name
        for name, variable in history.data_vars.items()
        if variable.dims[:1] == ("step",) and "asperity" not in variable.dims
    ]
    steps = select_steps(history)

    def take_steps(values: "xr.DataArray") -> "xr.DataArray":
        # a file is read as a whole: netCDF reads scattered rows one by one
        return (values if values.chunks else values.compute()).isel(step=steps)

    return history[totals].map(take_steps, keep_attrs=True).load()


def select_steps(history: "xr.Dataset") -> Integers:
    """Return the steps that a picture can show: all, or those at the extremes of loads and displacements."""
    size = history.sizes["step"]
    if size <= MOST_POINTS:
        return np.arange(size)
    channels = [
        history[name].values.reshape(size, -1).T for name in _KEPT_CHANNELS if name in history
    ]
    return thin_samples(size, [column for channel in channels for column in channel], MOST_POINTS)


def thin_samples(size: int, channels: Sequence[Floats], max_samples: int) -> Integers:
    """Return the samples at which channels have the least and the greatest value of each of many equal pieces.

    At most so many samples, the first and the last one among them; all of them if they are no more.
    A stride would leave out what recurs in each period of a record.
    """
    if size <= max_samples:
        return np.arange(size)
    pieces = max((max_samples - 2) // (2 * max(len(channels), 1)), 1)
    starts = np.arange(pieces) * size // pieces
    indices = [np.array([0, size - 1])]
    for channel in channels:
        for values in (channel, -channel):
            filled = np.where(np.isnan(values), np.inf, values)
            minima = np.repeat(np.minimum.reduceat(filled, starts), np.diff(starts, append=size))
            hits = np.flatnonzero(filled == minima)
            # the first of equal ones in each piece
            indices.append(hits[np.searchsorted(hits, starts)])
    return np.unique(np.concatenate(indices))
