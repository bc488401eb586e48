"""Declarations of pictures: charts of curves, maps and notes with labelled axes, arranged on a sheet."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.results.plots.style import (
    FAINT,
    INK,
    LABEL_ABOVE,
    STATE_COLOURS,
    STATES,
    Look,
    line_colours,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Extent = tuple[float, float, float, float]  # ends of a map: left, right, bottom and top
MOST_COLOURS = 256  # pieces of one colour in a coloured line
MANY_POINTS = 2_000  # points from which on a line is embedded as pixels
SHIFT = 5.0  # distance of marks at one value from those of the next curve [pt]
MOVED = "marks at one value are set side by side"  # states it in the legend
ZERO: Look = {"color": FAINT, "linewidth": 0.4, "zorder": 0}


class Item(Protocol):
    """A part of a chart."""

    def draw(self, axes: "Axes") -> Any:
        """Draw it into axes."""


@attrs.frozen(eq=False)
class Curve:
    """A line or marks: x and y, a label for the legend, and properties of the line."""

    x: Any
    y: Any
    label: str = ""
    look: Look = attrs.field(factory=dict)
    hue: Any = None  #: values along the line that give its colour
    errors: Look = attrs.field(factory=dict)  #: ``xerr`` and ``yerr``, lengths of error bars
    shift: float = 0.0  #: distance to the right of its values [pt]
    colours: int = MOST_COLOURS  #: pieces of one colour at most where `hue` colours it

    def draw(self, axes: "Axes") -> Any:
        """Draw the line, or error bars."""
        if self.hue is not None:
            return self._draw_coloured(axes)
        look: Look = {
            "label": self.label or None,
            "rasterized": np.size(self.x) > MANY_POINTS,
        }
        look |= self.look
        if self.errors:
            look = Look(capsize=2, elinewidth=0.8) | self.errors | look
            artists: Iterable[Artist] = axes.errorbar(self.x, self.y, **look).get_children()
        else:
            artists = axes.plot(self.x, self.y, **look)
        if self.shift:
            from matplotlib.transforms import ScaledTranslation

            for artist in artists:
                right = ScaledTranslation(self.shift / 72, 0, axes.figure.dpi_scale_trans)
                artist.set_transform(axes.transData + right)
        return artists

    def _draw_coloured(self, axes: "Axes") -> Any:
        from matplotlib.collections import LineCollection

        points = np.column_stack([self.x, self.y])
        hue = np.asarray(self.hue)
        # one path for each pair of points would take longer than the replay
        ends = np.unique(np.linspace(0, hue.size - 1, self.colours + 1).astype(int))
        pieces = [points[start : stop + 1] for start, stop in itertools.pairwise(ends)]
        look = {
            "cmap": line_colours(),
            "linewidth": 1.0,
            "rasterized": True,
            "capstyle": "round",
        } | self.look
        limits = look.pop("clim", None)
        lines = LineCollection(pieces, array=hue[ends[1:]], **look)
        lines.set_clim(limits)
        axes.add_collection(lines)
        axes.autoscale_view()
        return lines


@attrs.frozen(eq=False)
class Map:
    """Values point by point (x, y), x to the right and y upwards, with a colour bar if it has a label."""

    values: Floats
    extent: Extent
    label: str = ""
    look: Look = attrs.field(factory=dict)
    extend: str = "neither"  #: ends of the colour bar beyond which values lie

    def draw(self, axes: "Axes") -> Any:
        """Draw the image and its colour bar, which is as high as the map."""
        look = {"origin": "lower", "extent": self.extent, "interpolation": "nearest"} | dict(
            self.look
        )
        image = axes.imshow(self.values.T, **look)
        axes.spines[["top", "right"]].set_visible(True)
        if self.label:
            bar = axes.inset_axes((1.03, 0, 0.045, 1))
            axes.figure.colorbar(image, cax=bar, extend=self.extend, label=self.label)
        return image


@attrs.frozen(eq=False)
class Note:
    """A string next to a point, at a distance [pt] from it."""

    text: str
    at: tuple[float, float]
    offset: tuple[float, float] = (4.0, 4.0)
    look: Look = attrs.field(factory=dict)

    def draw(self, axes: "Axes") -> Any:
        """Write the string, on the side to which the offset points."""
        x, y = self.offset
        look: Look = {"fontsize": 7.5, "zorder": 6, "textcoords": "offset points"}
        look |= {"ha": "left" if x > 0 else "right" if x < 0 else "center"}
        look |= {"va": "bottom" if y > 0 else "top" if y < 0 else "center"}
        return axes.annotate(self.text, self.at, self.offset, **look | self.look)


@attrs.frozen(eq=False)
class Shape:
    """Any other shape: the name of a method of matplotlib's axes and its arguments."""

    method: str
    arguments: tuple[Any, ...]
    look: Look = attrs.field(factory=dict)

    def draw(self, axes: "Axes") -> Any:
        """Call the method; limits include a line across the axes."""
        artist = getattr(axes, self.method)(*self.arguments, **self.look)
        if self.method in {"axhline", "axvline"}:
            axes.autoscale_view()
        return artist


def span(start: tuple[float, float], stop: tuple[float, float], **look: Any) -> Shape:
    """Return an arrow with two heads between two points."""
    arrow = {
        "arrowstyle": "<|-|>",
        "color": INK,
        "linewidth": 0.8,
        "shrinkA": 0,
        "shrinkB": 0,
        "mutation_scale": 7,
    }
    return Shape("annotate", ("", start, stop), {"arrowprops": arrow, **look})


@attrs.frozen(eq=False, kw_only=True)
class Chart:
    """A pair of axes in SI units with its content; labels state quantity and unit, "load (N)"."""

    items: Sequence[Item]
    x: str = ""
    y: str = ""
    title: str = ""
    name: str = ""  #: in notices; by default the title
    height: float = 30.0  #: least height with its labels [mm]
    zero: str = ""  #: thin axes through zero: "x" (horizontal), "y" or "xy"
    log: str = ""  #: logarithmic axes
    integers: bool = False  #: whether x counts
    hue: str = ""  #: label of a colour bar above the chart for its coloured line
    margins: tuple[float, float] | None = None
    share: str = ""  #: charts of one name here share the x axis; with "map" both axes
    keys: "Sequence[Artist]" = ()  #: further entries of the legend
    axes: Look = attrs.field(factory=dict)  #: properties of the axes
    #: whether the y label is written above the axes, as if it is longer than they are
    label_above: bool = False
    separate_legend: bool = False  #: whether its legend is to the right of it

    def draw(self, axes: "Axes", room: float = 1000.0) -> None:
        """Draw the content and label the axes; a y label longer than the room [mm] is written above the axes."""
        if "x" in self.zero:
            axes.axhline(0, **ZERO)
        if "y" in self.zero:
            # limits do not extend to a remote zero
            from matplotlib.lines import Line2D

            axes.add_artist(Line2D([0, 0], [0, 1], transform=axes.get_xaxis_transform(), **ZERO))
        artists = [item.draw(axes) for item in self.items]
        if self.margins is not None:
            axes.margins(*self.margins)
        axes.set(**{"xlabel": self.x, "ylabel": self.y} | self.axes)
        small: Look = {"fontsize": 7, "fontweight": "normal"}
        axes.set_title(self.title, **small if "\n" in self.title else {})
        if self.log:
            from historysim.results.plots.ticks import set_log_scale

            for name in self.log:
                set_log_scale(axes.xaxis if name == "x" else axes.yaxis)
        if self.integers:
            from matplotlib.ticker import MaxNLocator

            axes.xaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))
        if self.hue:
            lines = next(item for item in reversed(artists) if hasattr(item, "get_array"))
            axes.figure.colorbar(
                lines, ax=axes, location="top", aspect=40, pad=0.03, label=self.hue
            )
        plain = self.y.replace(r"\mathrm", "").translate(dict.fromkeys(map(ord, "$\\{}")))
        letters = max(map(len, plain.split("\n")))
        if self.label_above or (LETTER * letters > room and not self.hue):
            axes.set_ylabel("")
            axes.set_title(self.y.replace("\n", " "), **LABEL_ABOVE)
        if self.separate_legend:
            axes.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5))


LETTER = 1.35  # width of a letter of a label [mm]


@attrs.frozen(eq=False)
class Sheet:
    """Charts by letters, and their arrangements, each as rows of these letters; the first one that fits is drawn."""

    charts: Mapping[str, Chart]
    wide: str = ""  #: rows, separated by ";", at a width of 140 mm or more; by default side by side
    narrow: str = ""  #: rows at a smaller width; by default one chart in each
    subtitle: str = ""
    notices: tuple[str, ...] = ()
    note: str = ""  #: an entry of the legend without a line
    legend_title: str | None = None
    #: whether the first chart can be drawn without the others into given axes
    first_alone: bool = False

    def arrange(self, width: float, height: float) -> list[str]:
        """Return the rows that fit a size [mm], from above; at least the first chart."""
        layouts = [self.narrow or ";".join(self.charts)]
        if width >= WIDE:
            layouts.insert(0, self.wide or "".join(self.charts))
        for rows in (layout.split(";") for layout in layouts):
            for count in range(len(rows), 0, -1):
                is_whole = not {*"".join(rows[:count])} & {*"".join(rows[count:])}
                if is_whole and AROUND + sum(map(self.row_height, rows[:count])) <= height:
                    return rows[:count]
        return [next(iter(self.charts))]

    def row_height(self, row: str) -> float:
        """Return the least height of a row [mm], from its lowest chart; the others span several rows."""
        return min(self.charts[key].height for key in row if key in self.charts)


WIDE = 140.0  # width from which on charts are side by side [mm]
AROUND = 22.0  # height of title and legend [mm]


def state_keys(
    colours: Sequence[str] = STATE_COLOURS, names: Sequence[str] = STATES
) -> "list[Artist]":
    """Return legend entries for colours, by default of the slip states."""
    from matplotlib.patches import Patch

    entries = zip(colours, names, strict=True)
    return [
        Patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=name)
        for colour, name in entries
    ]
