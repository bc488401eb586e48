"""Drawing target of a picture: a new figure of a size in millimetres, or a figure or axes of the caller."""

import itertools
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, TypedDict

import attrs

from historysim.basics.wording import join_words
from historysim.errors import InputError
from historysim.results.plots.chart import AROUND, Chart, Sheet
from historysim.results.plots.style import STYLE, Look, escape_math

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from historysim.results.plots.figure_output import PrintedFigure

Size = tuple[float, float]  # width and height [mm]
FigureOrAxes = Any  # the new figure, or the figure or axes that were given

COLUMN, TWO_COLUMNS = 90.0, 180.0  # widths [mm] of one column and of both in a journal
LEAST_SIDE, MOST_SIDE = 20.0, 2000.0  # sides of a figure [mm]
LEAST_PANEL = 13.0, 8.0  # width and height of the smallest panel that can be read [mm]
LABELS, LETTER = 10.0, 1.4  # height of the labels of a panel, width of a letter of the legend [mm]
MILLIMETRES_PER_INCH = 25.4
# A hyphen in place of a minus sign, and that sign.
HYPHEN, MINUS = re.compile(r"(?<![\w.-])-(?=\.?\d)"), "\N{MINUS SIGN}"


class Place(TypedDict, total=False):
    """Drawing target: a new figure of a size [mm], a figure or a part of one, or axes for one panel."""

    size: Size | None
    figure: Any
    ax: Any


@attrs.define(eq=False)
class Canvas:
    """Drawing target of a picture: a figure, or the axes of the caller, and its sides [mm]."""

    figure: "Figure | SubFigure"
    target_axes: "Axes | None"
    width: float
    height: float
    #: remarks on the picture that are not written into it
    notices: list[str] = attrs.field(factory=list)
    caption: str = ""  #: a line below the title
    is_part: bool = False  #: whether there are other pictures in the figure
    has_legend: bool = False
    existing_axes: "Sequence[Axes]" = ()  #: axes of the figure that do not belong to this picture

    @classmethod
    def from_figure(cls, figure: "Figure | SubFigure", ax: "Axes | None" = None) -> "Canvas":
        """Return the canvas of a figure, or of a part of one, as large as it is."""
        width, height = (
            side / figure.dpi * MILLIMETRES_PER_INCH
            for side in (figure.bbox.width, figure.bbox.height)
        )
        return cls(figure, ax, width, height, existing_axes=[] if ax else list(figure.axes))

    def axes(self) -> "Axes":
        """Return the axes of a picture with one panel."""
        return self.figure.add_subplot() if self.target_axes is None else self.target_axes

    def draw(self, sheet: "Sheet | Chart") -> None:
        """Draw charts in the arrangement that fits; a notice names those that do not fit."""
        if isinstance(sheet, Chart):
            sheet = Sheet({"A": sheet})
        charts = sheet.charts
        if self.target_axes is not None and len(charts) > 1 and not sheet.first_alone:
            raise InputError(
                f"ax: this picture has {len(charts)} panels; expected figure= in place of ax="
            )
        rows = [next(iter(charts))] if self.target_axes else sheet.arrange(self.width, self.height)
        panels = self._subplots(sheet, rows)
        rooms = [sheet.row_height(row) for row in rows]
        rooms = [(self.height - AROUND) * room / sum(rooms) - LABELS for room in rooms]
        for key, axes in panels.items():
            room = sum(room for row, room in zip(rows, rooms, strict=True) if key in row)
            charts[key].draw(axes, room + LABELS * (sum(key in row for row in rows) - 1))
        shares = {key: chart.share for key, chart in charts.items()} | {".": ""}
        for upper, lower in itertools.pairwise(rows):
            for key, below in zip(upper, lower, strict=False):
                if key != below and shares[key] and shares[key] == shares[below]:
                    panels[key].tick_params(labelbottom=False)
                    panels[key].set_xlabel("")
        for left, right in (pair for row in rows for pair in itertools.pairwise(row)):
            if left != right and shares[left] == shares[right] == "map":
                panels[right].tick_params(labelleft=False)
                panels[right].set_ylabel("")
        omitted = dict.fromkeys(
            chart.name or chart.title.lower() for key, chart in charts.items() if key not in panels
        )
        if omitted and self.target_axes is None:
            self.notice(
                f"at {self.width:.3g} × {self.height:.3g} mm there is no room for {join_words([*omitted])}"
            )
        for notice in sheet.notices:
            self.notice(notice)
        self.caption = self.caption or sheet.subtitle
        keys = [entry for key in panels for entry in charts[key].keys]
        self.legend(note=sheet.note, handles=keys, title=sheet.legend_title)

    def _subplots(self, sheet: Sheet, rows: Sequence[str]) -> "dict[str, Axes]":
        """Create the axes of a sheet, with shared limits."""
        if len({*"".join(rows)}) == 1:
            return {rows[0][0]: self.axes()}
        figure: Any = self.figure
        maps = [chart for chart in sheet.charts.values() if chart.share == "map"]
        if maps and figure.figure is figure and figure.get_layout_engine() is not None:
            figure.set_layout_engine("compressed")
        panels = figure.subplot_mosaic(
            ";".join(rows), height_ratios=[sheet.row_height(row) for row in rows]
        )
        groups: dict[str, Axes] = {}
        for key, axes in panels.items():
            if not (share := sheet.charts[key].share):
                continue
            first = groups.setdefault(share, axes)
            if first is not axes:
                axes.sharex(first)
                if share == "map":
                    axes.sharey(first)
        return dict(panels)

    def heading(self, text: str, caption: str = "") -> None:
        """Write a title above the picture, on two lines at most, and a caption below it."""
        letters = int(2 * self.width / LETTER)
        text = textwrap.shorten(text, letters).replace(" [...]", " …")
        caption = re.sub(" +", " ", caption)
        lines = escape_math("\n".join(filter(None, (text, caption))))
        if self.target_axes is not None:
            if lines:
                self.target_axes.set_title(escape_math(text or caption), wrap=True)
        elif lines:
            look = {
                "fontsize": 9.0 if self.width >= 120.0 else 8.0,
                "fontweight": "bold" if self.is_part else "normal",
            }
            self.figure.suptitle(lines, x=0.01, ha="left", wrap=True, **look)

    def legend(
        self, *, note: str = "", handles: "Sequence[Artist]" = (), title: str | None = None
    ) -> None:
        """Draw the legend of all axes below the picture, each label once; in given axes where there is most room.

        A picture has one legend: once it is drawn, this does nothing.
        """
        from matplotlib.lines import Line2D

        panels = [
            axes
            for axes in self.figure.axes
            if axes not in self.existing_axes and axes.get_legend() is None
        ]
        entries: Look = {}
        for axes in panels if self.target_axes is None else [self.target_axes]:
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                entries.setdefault(label, handle)
        entries |= {str(handle.get_label()): handle for handle in handles}
        if note:
            entries[note] = Line2D([], [], linestyle="")
        if self.has_legend or not entries:
            return
        self.has_legend = True
        if self.target_axes is not None:
            self.target_axes.legend(entries.values(), entries.keys(), loc="best", title=title)
            return
        letters = int(self.width / LETTER) - 6
        names = [name if "$" in name else textwrap.fill(name, letters) for name in entries]
        look: Look = {
            "columnspacing": 1.6,
            "handlelength": 1.8,
            "title": title,
            "fontsize": 7.0,
        }
        for columns in range(min(len(entries), 6), 0, -1):
            look |= {"ncols": columns, "title_fontsize": 7.0}
            legend = self.figure.legend(entries.values(), names, loc="outside lower left", **look)
            if columns == 1 or legend.get_window_extent().width <= 0.95 * self.figure.bbox.width:
                break
            legend.remove()
        for line in legend.legend_handles:
            # samples are small dots, and their colour is to be seen
            if isinstance(line, Line2D) and line.get_marker() == ".":
                line.set_markersize(6.0)

    def notice(self, text: str) -> None:
        """Add a remark on the picture that is not written into it."""
        if text and text not in self.notices:
            self.notices.append(text)

    def part(self, figure: "SubFigure") -> "Canvas":
        """Return the canvas of a part of the figure, with the notices of the whole."""
        canvas = Canvas.from_figure(figure)
        canvas.notices = self.notices
        canvas.is_part = True
        return canvas

    def finish(self) -> bool:
        """Choose unit prefixes and lay a new figure out; return whether all panels can be read."""
        from matplotlib.text import Text

        target: Any = self.target_axes or self.figure
        set_prefixes(target, self.existing_axes)
        for text in target.findobj(Text):
            if HYPHEN.search(text.get_text()):
                text.set_text(HYPHEN.sub(MINUS, text.get_text()))
        figure: Any = self.figure
        # a figure or axes of the caller are laid out by the caller
        return (
            figure.figure is not figure
            or self.target_axes is not None
            or bool(self.existing_axes)
            or _fits(figure)
        )


def set_prefixes(target: "Figure | SubFigure | Axes", without: "Sequence[Axes]" = ()) -> None:
    """Use readable unit prefixes on axes labelled in SI units."""
    from matplotlib.axes import Axes

    from historysim.results.plots.ticks import set_prefix

    for axes in target.findobj(Axes):
        if axes not in without:
            set_prefix(axes.xaxis)
            set_prefix(axes.yaxis)


def draw_on_target(place: Place, default: Size, draw: Callable[[Canvas], None]) -> FigureOrAxes:
    """Draw on a target in the common style.

    Raises InputError: two targets, no width and height from 20 to 2000 mm, or a size too small for
    one panel.
    """
    size, figure, ax = (place.get(name) for name in Place.__annotations__)
    if sum(item is not None for item in (size, figure, ax)) > 1:
        raise InputError(
            "size, figure, ax: expected one of them: a figure and axes have a size of their own"
        )
    for name, value, method, kind in (
        ("figure", figure, "add_subplot", "figure"),
        ("ax", ax, "get_xaxis", "axes"),
    ):
        if value is not None and not hasattr(value, method):
            raise InputError(
                f"{name} is a {type(value).__name__}; expected {kind} of matplotlib, such as plt.subplots() gives"
            )
    if figure is None and ax is None:
        return _draw_new_figure(size, default, draw)  # type: ignore[arg-type] # checked there
    target: Any = ax.figure if ax is not None else figure  # type: ignore[attr-defined] # axes, as checked above
    if ax is None and not target.figure.axes and target.figure.get_layout_engine() is None:
        target.figure.set_layout_engine("constrained")
    with plot_style():
        canvas = Canvas.from_figure(target, ax)  # type: ignore[arg-type] # likewise
        draw(canvas)
        canvas.finish()
    return canvas.target_axes or canvas.figure


def _draw_new_figure(size: Size | None, default: Size, draw: Callable[[Canvas], None]) -> "Figure":
    with new_figure(size, default) as figure:
        canvas = Canvas.from_figure(figure)
        draw(canvas)
        if not canvas.finish() and size is not None:
            raise InputError(
                f"size is {size[0]:g} × {size[1]:g} mm, in which a panel of this picture would be too small to be "
                "read; expected a larger size, or fewer panels or lines"
            )
    figure.notices = tuple(canvas.notices)
    return figure


@contextmanager
def new_figure(size: Size | None, default: Size) -> "Iterator[PrintedFigure]":
    """Yield an empty figure in the common style; InputError if the size is invalid."""
    from historysim.basics.arguments import as_floats
    from historysim.results.plots.figure_output import PrintedFigure

    sides = as_floats("size", default if size is None else size, above=0)
    if sides.shape != (2,) or not LEAST_SIDE <= min(sides) <= max(sides) <= MOST_SIDE:
        raise InputError(
            f"size is {size!r}; expected width and height from {LEAST_SIDE:.0f} to {MOST_SIDE:.0f} mm, as (90, 70)"
        )
    with plot_style():
        yield PrintedFigure(figsize=tuple(sides / MILLIMETRES_PER_INCH), layout="constrained")


def plot_style() -> AbstractContextManager[None]:
    """Return a context that applies the common style of pictures."""
    import matplotlib as mpl

    return mpl.rc_context(STYLE)


def _fits(figure: "Figure") -> bool:
    """Lay out a figure and return whether all of its panels can be read."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        # the layout alone: nothing is drawn before the figure is saved
        if (layout := figure.get_layout_engine()) is not None:
            layout.execute(figure)
            figure.stale = False
    if any("not applied" in str(warning.message) for warning in caught):
        return False
    inch = figure.dpi / MILLIMETRES_PER_INCH
    for axes in figure.axes:
        box = axes.get_window_extent()
        fits = [
            side / inch >= minimum
            for side, minimum in zip((box.width, box.height), LEAST_PANEL, strict=True)
        ]
        # a map keeps its shape, and is small in one direction
        if axes.get_label() != "<colorbar>" and not (
            all(fits) if axes.get_aspect() == "auto" else any(fits)
        ):
            return False
    return True
