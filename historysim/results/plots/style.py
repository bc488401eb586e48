"""Style shared by all pictures: colours, lines, thinning, and numbers with a readable unit.

Colours differ for readers with any colour vision and in grey print: lightness rises from stick to slip.
"""

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from historysim.basics.arguments import ArrayLike, Floats, Integers
from historysim.basics.units import choose_prefix

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.image import AxesImage
    from matplotlib.patches import Patch


Extent = tuple[float, float, float, float]  # ends of an image: left, right, bottom and top

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
DASHED: dict[str, Any] = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4, 2))}  # a limit, or a law

# An arrow from one end to another.
SPAN = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}

# SI units that have a readable prefix in labels.
WITH_PREFIX = {"m", "m²", "m³", "N", "N/m", "J", "J/m²", "Pa"}
LOOP_NUMBER = "loop, counted from 0"  # label of an axis of loops, as `number` and the tables count them
MOST_EDGED = 60  # loops up to which there is room for the edge of each mark
MOST_TICKS = 5  # intervals of such an axis: numbers of many loops are wide
MOST_POINTS = 100_000  # points of a line: more than a picture can show
APART = 5.0  # how far marks with error bars stand from those of the next line [pt]
MOVED = "marks at one value are set side by side"  # says so in the legend
MOST_PIECES = 256  # pieces of one colour in a coloured line
# Greatest over smallest number of a logarithmic axis up to which 2 and 5 have ticks with numbers, too.
FEW_DECADES = 30.0


def scale_of(unit: str, *values: ArrayLike) -> tuple[float, str]:
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


def split_label(label: str) -> tuple[str, str]:
    """Return the quantity and the unit of a label, "load (N)"."""
    match = re.fullmatch(r"(.*?) ?\(([^()]*)\)", label, re.DOTALL)
    return (match[1], match[2]) if match else (label, "")


# Of the formatters of axes whose label has a prefix: the SI unit, and the end of the label with that prefix.
_PREFIXED: "WeakKeyDictionary[Any, tuple[str, str]]" = WeakKeyDictionary()


def name_prefix(axis: Any, ends: tuple[float, float] | None = None) -> None:
    """Choose a unit prefix for an axis labelled in SI units, "load (N)"; the common factor goes into the label.

    Axes that share limits share the formatter of their ticks, and so the prefix: it is chosen for all of them, also
    where one of them has got its prefix before. It is that of the ends of these axes, or of others that are given.
    """
    from matplotlib.ticker import ScalarFormatter

    group, formatter = _sharing(axis), axis.get_major_formatter()
    seen = formatter in _PREFIXED or any(member.offsetText.get_visible() for member in group)
    for member in group:
        member.offsetText.set_visible(False)
    labels = {member: _si_label(member) for member in group}
    unit = labels[axis][1]
    if not isinstance(formatter, ScalarFormatter) or not (unit in WITH_PREFIX or seen):
        return
    if formatter in _PREFIXED:
        # as of a new axis
        formatter.set_useOffset(True)
        formatter.set_scientific(True)
    formatter.format_ticks(axis.get_majorticklocs())
    if not any(label.get_visible() for member in group for label in member.get_ticklabels()):
        return
    offset = float(formatter.offset)
    far = axis.get_view_interval() - offset
    if unit in WITH_PREFIX:
        factor, ticks = scale_of(unit, far if ends is None or offset else ends)
        power = -round(math.log10(factor))
    elif formatter.get_offset():
        power = 3 * math.floor(math.log10(np.abs(far).max()) / 3)
        ticks = f"$10^{{{power}}}$ {unit}".rstrip() if power else unit
    else:
        return
    suffix = f" ({ticks})" if ticks else ""
    if offset:
        factor, its_unit = scale_of(unit, offset)
        suffix += f", from {factor * offset:.10g} {its_unit}".rstrip()
        # as many ticks as there may be in another size, they keep what the label says
        formatter.set_useOffset(offset)
    formatter.set_scientific(bool(power))
    formatter.set_powerlimits((power, power))
    _set_prefix(formatter, labels, unit, suffix)


def _sharing(axis: Any) -> list[Any]:
    """Return the axes (x or y) that have the limits of one, itself among them."""
    shared = axis.axes.get_shared_x_axes() if axis.axis_name == "x" else axis.axes.get_shared_y_axes()
    return [getattr(axes, f"{axis.axis_name}axis") for axes in shared.get_siblings(axis.axes)]


def _si_label(axis: Any) -> tuple[str, str]:
    """Return the quantity and the SI unit of an axis, also of one whose label has a prefix already."""
    text = axis.get_label_text()
    unit, suffix = _PREFIXED.get(axis.get_major_formatter(), ("", ""))
    has_suffix = suffix and f" {text}".endswith(suffix)
    return (f" {text}".removesuffix(suffix).strip(), unit) if has_suffix else split_label(text)


def _set_prefix(formatter: Any, labels: dict[Any, tuple[str, str]], unit: str, suffix: str) -> None:
    """Let the labels of all axes that share a formatter and a unit end alike."""
    _PREFIXED[formatter] = unit, suffix
    for axis, (quantity, own_unit) in labels.items():
        if own_unit == unit and axis.get_label_text():
            axis.set_label_text(f"{quantity}{suffix}".strip())


def label_loop(axes: "Axes") -> None:
    """Label the axes of friction loops [m, N]."""
    zero_lines(axes)
    axes.set(xlabel="tangential displacement $U$ (m)", ylabel="tangential load $T$ (N)")


def draw_image(axes: "Axes", values: Floats, extent: Extent, **colours: Any) -> "AxesImage":
    """Draw values point by point (x, y), x to the right and y upwards."""
    return axes.imshow(values.T, origin="lower", extent=extent, interpolation="nearest", **colours)


def note_instead(axes: "Axes", text: str) -> None:
    """Write in empty axes why nothing is drawn there."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=FAINT)
    axes.set(xticks=[], yticks=[])


def patches(colours: Iterable[str], names: Iterable[str]) -> "list[Patch]":
    """Return legend handles for colours."""
    from matplotlib.patches import Patch

    entries = zip(colours, names, strict=True)
    return [Patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=name) for colour, name in entries]


def by_factors(axis: Any) -> None:
    """Make an axis, once its data are drawn, logarithmic, with plain numbers: 0.4, and not 4 × 10⁻¹."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    labels = {member: _si_label(member) for member in _sharing(axis)}
    (axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale)("log")
    ends = np.array([member.get_data_interval() for member in labels])
    ends = ends[np.isfinite(ends).all(axis=1)]
    low, high = float(ends[:, 0].min()), float(ends[:, 1].max())
    unit = labels[axis][1]
    factor, ticks = scale_of(unit, high)
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < FEW_DECADES * low else (1,)))
    axis.set_minor_formatter("")
    formatter = FuncFormatter(lambda value, _: f"{value * factor:g}")
    axis.set_major_formatter(formatter)
    if unit in WITH_PREFIX:
        _set_prefix(formatter, labels, unit, f" ({ticks})")


def zero_lines(axes: "Axes", *, vertical: bool = True) -> None:
    """Draw thin lines where the load, and the displacement, is 0; to one far off, as of a stage, no axis reaches."""
    from matplotlib.lines import Line2D

    thin: dict[str, Any] = {"color": FAINT, "linewidth": 0.4, "zorder": 0}
    axes.axhline(0, **thin)
    if vertical:
        axes.add_artist(Line2D([0, 0], [0, 1], transform=axes.get_xaxis_transform(), **thin))


def set_side_by_side(artists: "Iterable[Artist]", number: int, count: int, apart: float = APART) -> None:
    """Move one of several lines with marks at the same places sideways; the legend has to say so (`MOVED`)."""
    from matplotlib.transforms import ScaledTranslation

    for artist in artists:
        axes: Any = artist.axes
        shift = ScaledTranslation(apart * (number - (count - 1) / 2) / 72, 0, axes.figure.dpi_scale_trans)
        artist.set_transform(axes.transData + shift)


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

    # the light end is left out: it is lost on white
    return ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.08, 1.0, MOST_PIECES)))


def draw_coloured(axes: "Axes", x: Floats, y: Floats, values: Floats, *, pieces: int = MOST_PIECES) -> "LineCollection":
    """Draw a line coloured by values along it, in no more than so many pieces of one colour."""
    from matplotlib.collections import LineCollection

    points = np.column_stack([x, y])
    # a path for each pair of points would take longer than the replay
    ends = np.unique(np.linspace(0, values.size - 1, pieces + 1).astype(int))
    segments = [points[start : stop + 1] for start, stop in itertools.pairwise(ends)]
    lines = LineCollection(segments, array=values[ends[1:]], cmap=line_colours(), linewidth=1.0, rasterized=True)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    axes.autoscale_view()
    return lines


# Channels of a history whose extremes a thinned line keeps.
_KEPT_CHANNELS = ("total_tangential_load", "tangential_displacement", "total_normal_load", "separation")


def thinned(history: "xr.Dataset") -> "xr.Dataset":
    """Return the totals at the steps that a picture can show: the extremes of loads and displacements."""
    of_all = [
        name
        for name, variable in history.data_vars.items()
        if variable.dims[:1] == ("step",) and "asperity" not in variable.dims
    ]
    return history[of_all].isel(step=shown_steps(history)).load()


def shown_steps(history: "xr.Dataset") -> Integers:
    """Return the steps that a picture can show: all, or those at the extremes of loads and displacements."""
    size = history.sizes["step"]
    if size <= MOST_POINTS:
        return np.arange(size)
    channels = [history[name].values.reshape(size, -1).T for name in _KEPT_CHANNELS if name in history]
    return kept_samples(size, [column for channel in channels for column in channel], MOST_POINTS)


def kept_samples(size: int, channels: Sequence[Floats], max_samples: int) -> Integers:
    """Return the samples at which channels have the least and the greatest value of each of many equal pieces.

    At most so many samples, the first and the last one among them; all of them if they are no more. A stride would
    leave out what recurs in each period of a record.
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
