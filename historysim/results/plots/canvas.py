"""Drawing target of a picture: a new figure of a size in millimetres, or a figure or axes of the caller."""

import itertools
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, TypedDict

import attrs

from historysim.basics.wording import listed
from historysim.errors import InputError
from historysim.results.plots.style import STYLE, name_prefix, plain

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.text import Annotation, Text

    from historysim.results.plots.printed import PrintedFigure

Size = tuple[float, float]  # width and height [mm]
FigureOrAxes = Any  # the new figure, or the figure or axes that were given

COLUMN, TWO_COLUMNS = 90.0, 180.0  # widths [mm] of one column and of both in a journal
WIDE = 140.0  # width from which on panels stand side by side [mm]
LEAST_SIDE, MOST_SIDE = 20.0, 2000.0  # sides of a figure [mm]
LEAST_PANEL = 13.0, 8.0  # width and height of the smallest panel that can be read [mm]
MOST_PANELS = 100  # more than a picture has
HIGHEST_LEGEND = 0.3  # share of the height that names below a picture may take
SMALL = 6.5  # size of the letters of labels that do not fit otherwise [pt]
ROUNDS = 4  # how often labels are fitted: on more lines they take more room, and panels less
MILLIMETRES_PER_INCH = 25.4
# Spaces at which no line is broken: before a unit, and beside an equals sign.
UNBROKEN = r"(?<=\d) (?=[nµm]?[mN]\b|[kMG]?Pa\b)|(?<==) (?=\S)|(?<=\w) (?==)|(?<=\$) (?=\()"
NO_BREAK = "\N{NO-BREAK SPACE}"
# A hyphen that stands for a minus sign, and that sign.
HYPHEN, MINUS = re.compile(r"(?<![\w.-])-(?=\.?\d)"), "\N{MINUS SIGN}"


class Place(TypedDict, total=False):
    """Drawing target: a new figure of a size [mm], a figure or a part of one, or axes for one panel."""

    size: Size | None
    figure: Any
    ax: Any


SIDES = {-1: ("right", "top"), 0: ("center", "center"), 1: ("left", "bottom")}
# Where a label may stand beside its point [pt], and how it is aligned there.
AROUND = [
    (x * far, y * far, SIDES[x][0], SIDES[y][1])
    for far in (4.0, 10.0)
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
]


@attrs.define(eq=False)
class Canvas:
    """Drawing target of a picture: a figure, or the axes of the caller, and its sides [mm]."""

    figure: "Figure | SubFigure"
    given: "Axes | None"
    width: float
    height: float
    most: int = MOST_PANELS  #: panels that there is room for
    panels: int = 1  #: panels that are drawn
    notices: list[str] = attrs.field(factory=list)  #: what is to be known of the picture, and does not stand in it
    labels: "list[Annotation]" = attrs.field(factory=list)
    caption: str = ""  #: stands below the title
    beside_others: bool = False
    named: bool = False  #: whether it has a legend
    before: "Sequence[Axes]" = ()  #: axes of the figure that are not of this picture

    @classmethod
    def of(cls, figure: "Figure | SubFigure", ax: "Axes | None" = None) -> "Canvas":
        """Return the canvas of a figure, or of a part of one, as large as it is."""
        width, height = (side / figure.dpi * MILLIMETRES_PER_INCH for side in (figure.bbox.width, figure.bbox.height))
        return cls(figure, ax, width, height, before=[] if ax else list(figure.axes))

    def axes(self) -> "Axes":
        """Return the axes of a picture with one panel."""
        return self.figure.add_subplot() if self.given is None else self.given

    def several(self, count: int = 2) -> Any:
        """Return the figure of a picture with several panels; InputError where axes were given, which are one."""
        if self.given is not None:
            raise InputError(f"ax: this picture has {count} panels; expected figure= in place of ax=")
        return self.figure

    def fitting(self, panels: Sequence[str], room: int | None = None) -> list[str]:
        """Return the first of some panels, as many as there is room for, one at least; a notice names the others."""
        count = max(min(len(panels) if room is None else room, self.most), 1)
        if omitted := [name for name in panels[count:] if name]:
            self.notices.append(f"at {self.width:.3g} × {self.height:.3g} mm there is no room for {listed(omitted)}")
        self.panels = min(count, len(panels))
        return list(panels[:count])

    def two(self, panels: tuple[str, str], ratio: float, *, stacked: float = 1.0) -> "tuple[Axes, Axes | None]":
        """Return two axes, side by side or one below the other, or the axes of the first panel alone.

        `ratio` is the width over that of the second side by side, `stacked` the height over it below one another.
        """
        figure, wide = self.several(), self.width >= WIDE
        if len(self.fitting(panels, 2 if wide or self.height >= 100.0 else 1)) == 1:
            return figure.subplots(), None
        if wide:
            return tuple(figure.subplots(1, 2, width_ratios=(ratio, 1)))
        return tuple(figure.subplots(2, 1, height_ratios=(stacked, 1)))

    def maps(self, count: int, rows: int) -> Any:
        """Return a grid of axes for some maps of one place (row, column), which keep their shape and stand close."""
        figure = self.several(count)
        if figure.figure is figure and figure.get_layout_engine() is not None:
            figure.set_layout_engine("compressed")
        columns = -(-count // rows)
        grid = figure.subplots(-(-count // columns), columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid[-1]:
            axes.set_xlabel("$x$ (m)")
        for axes in grid[:, 0]:
            axes.set_ylabel("$y$ (m)")
        return grid

    def heading(self, text: str, caption: str = "") -> None:
        """Write a title above the picture, on as many lines as it takes, and a caption below it."""
        size = 9.0 if self.width >= 120.0 else 8.0
        if self.given is not None:
            room = self.given.get_window_extent().width / self.given.figure.dpi * MILLIMETRES_PER_INCH
            if text or caption:
                self.given.set_title(plain(break_text(text or caption, room, size, 3)))
            return
        # beside a caption, a low picture has room for one line
        max_lines = {text: 1 if caption and self.height < 90.0 else 2, caption: 4}
        if lines := [break_text(line, self.width * 0.97, size, max_lines[line]) for line in (text, caption) if line]:
            weight = "bold" if self.beside_others else "normal"
            self.figure.suptitle(plain("\n".join(lines)), x=0.01, ha="left", fontsize=size, fontweight=weight)

    def legend(
        self, *axes: "Axes", extra: str = "", handles: "Sequence[Artist]" = (), title: str | None = None
    ) -> None:
        """Draw the legend of all axes, or of some, below the picture: each label once, clear of the data.

        There are as many columns as fit the width. In axes that were given names stand where most room is. A picture
        has one legend: once it is made, this does nothing.
        """
        from matplotlib.lines import Line2D

        every = (
            [axes_ for axes_ in self.figure.axes if axes_ not in self.before] if self.given is None else [self.given]
        )
        named: dict[str, Any] = {}
        for panel in axes or every:
            for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
                named.setdefault(label, handle)
        named |= {str(handle.get_label()): handle for handle in handles}
        if extra:
            named[extra] = Line2D([], [], linestyle="")
        if self.named or not named:
            return
        self.named = True
        if self.given is not None:
            self.given.legend(named.values(), named.keys(), loc="best", title=title)
            return
        looks: dict[str, Any] = {"loc": "outside lower left", "columnspacing": 1.6, "handlelength": 1.8, "title": title}
        large = 7.5 if self.width >= 120.0 else 7.0
        for size, columns in itertools.product((large, large - 1), range(min(len(named), 6), 0, -1)):
            looks |= {"fontsize": size, "title_fontsize": size, "ncols": columns}
            legend = self.figure.legend(named.values(), named.keys(), **looks)
            box, figure_box = legend.get_window_extent(), self.figure.bbox
            if box.width <= 0.95 * figure_box.width and box.height <= HIGHEST_LEGEND * figure_box.height:
                for line in legend.legend_handles:
                    # samples are small, and their colour is to be seen
                    if isinstance(line, Line2D) and line.get_marker() == ".":
                        line.set_markersize(6.0)
                return
            legend.remove()
        names = [name if "$" in name else break_text(name, self.width * 0.8, 6.0, 4) for name in named]
        self.figure.legend(named.values(), names, **looks)

    def label(self, axes: "Axes", text: str, at: tuple[float, float], **looks: Any) -> None:
        """Write a string beside a point, where it lies on no line; to the right where it may stand anywhere."""
        looks.setdefault("fontsize", 7.5)
        self.labels.append(axes.annotate(text, at, AROUND[0][:2], textcoords="offset points", zorder=6, **looks))

    def notice(self, text: str) -> None:
        """Say something of the picture that does not stand in it."""
        if text and text not in self.notices:
            self.notices.append(text)

    def part(self, figure: "SubFigure") -> "Canvas":
        """Return the canvas of a part of the figure, with the notices and labels of the whole."""
        canvas = Canvas.of(figure)
        canvas.notices, canvas.labels, canvas.beside_others = self.notices, self.labels, True
        return canvas

    def finish(self) -> bool:
        """Name prefixes and fit labels to the size, once all else is there; return whether all panels can be read."""
        from matplotlib.text import Text

        target: Any = self.given or self.figure
        name_prefixes(target, self.before)
        for text in target.findobj(Text):
            if HYPHEN.search(text.get_text()):
                text.set_text(HYPHEN.sub(MINUS, text.get_text()))
        figure: Any = self.figure
        # what was given is laid out by whoever gave it
        fits = figure.figure is not figure or self.given is not None or bool(self.before) or _fit(figure)
        _place(self.labels)
        return fits


def name_prefixes(target: "Figure | SubFigure | Axes", without: "Sequence[Axes]" = ()) -> None:
    """Use readable unit prefixes on axes labelled in SI units."""
    from matplotlib.axes import Axes

    for axes in target.findobj(Axes):
        if axes not in without:
            # the two lengths of a map have one unit
            ends = (
                max(axes.get_xlim(), axes.get_ylim(), key=lambda limits: abs(limits[1] - limits[0]))
                if axes.get_aspect() == 1
                else None
            )
            name_prefix(axes.xaxis, ends)
            name_prefix(axes.yaxis, ends)


def draw_on_target(place: Place, default: Size, draw: Callable[[Canvas], None]) -> FigureOrAxes:
    """Draw on a target in the common style; with fewer panels if they are too small.

    Raises InputError: two places, what is no width and height from 20 to 2000 mm, or too small a size for one panel.
    """
    size, figure, ax = (place.get(name) for name in Place.__annotations__)
    if sum(item is not None for item in (size, figure, ax)) > 1:
        raise InputError("size, figure, ax: expected one of them: a figure and axes have a size of their own")
    for name, value, method, kind in (("figure", figure, "add_subplot", "figure"), ("ax", ax, "get_xaxis", "axes")):
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
        canvas = Canvas.of(target, ax)  # type: ignore[arg-type] # likewise
        draw(canvas)
        canvas.finish()
    return canvas.given or canvas.figure


def _draw_new_figure(size: Size | None, default: Size, draw: Callable[[Canvas], None]) -> "Figure":
    """Return a new figure with all panels, or as many as can be read."""
    max_panels = MOST_PANELS
    while True:
        with new_figure(size, default) as figure:
            canvas = Canvas.of(figure)
            canvas.most = max_panels
            draw(canvas)
            fits = canvas.finish()
        if fits or canvas.panels == 1:
            break
        max_panels = canvas.panels - 1
    if not fits and size is not None:
        raise InputError(
            f"size is {size[0]:g} × {size[1]:g} mm, in which a panel of this picture would be too small to be read; "
            "expected a larger size, or fewer panels or lines"
        )
    figure.notices = tuple(canvas.notices)
    return figure


@contextmanager
def new_figure(size: Size | None, default: Size) -> "Iterator[PrintedFigure]":
    """Yield an empty figure in the common style; InputError if the size is invalid."""
    from historysim.basics.arguments import checked
    from historysim.results.plots.printed import PrintedFigure

    sides = checked("size", default if size is None else size, above=0)
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


def break_text(text: str, width: float, size: float, lines: int) -> str:
    """Return a string on so many lines at most that fit a width [mm] in letters of a size [pt]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    def text_width(line: str) -> float:
        points = text_to_path.get_text_width_height_descent(line, FontProperties(size=size), ismath=False)[0]
        return float(points) / 72 * MILLIMETRES_PER_INCH

    joined = " ".join(text.split())
    broken_lines, columns = [joined], len(joined)
    while columns > 8 and max(map(text_width, broken_lines)) > width:
        columns = min(columns - 1, int(1.5 * len(joined) * width / text_width(joined)))
        broken_lines = _wrap(joined, columns, max_lines=lines, placeholder=" …")
    return "\n".join(broken_lines)


def _wrap(text: str, columns: int, **options: Any) -> list[str]:
    """Return the lines of a string, none broken in a formula, before a unit, or at a hyphen."""
    protected = re.sub(
        r"\$[^$]*\$", lambda formula: formula[0].replace(" ", NO_BREAK), re.sub(UNBROKEN, NO_BREAK, text)
    )
    lines = textwrap.wrap(protected, columns, break_on_hyphens=False, **options)
    return [line.replace(NO_BREAK, " ") for line in lines]


def _fit(figure: "Figure") -> bool:
    """Break and shorten labels and titles that are longer than their axes; return whether all panels can be read."""
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>" and axes.get_visible()]
    for _ in range(ROUNDS):
        if not _lay_out(figure):
            return False
        # every panel is asked, also where one before it has changed
        if not sum([_fit_panel(axes) for axes in panels]):
            break
    return all(_readable(axes) for axes in panels)


def _place(labels: "Sequence[Annotation]") -> None:
    """Move labels to where they lie on no line and on no other label."""
    taken: list[Any] = []
    for label in labels:
        axes: Any = label.axes
        paths = [line.get_path().transformed(line.get_transform()) for line in axes.lines]

        def place_box(side: tuple[float, float, str, str], label: Any = label) -> Any:
            label.xyann = side[:2]
            label.set(ha=side[2], va=side[3])
            return label.get_window_extent().padded(1.0)

        def count_crossings(side: tuple[float, float, str, str], axes: Any = axes, paths: Any = paths) -> int:
            box = place_box(side)
            lines = sum(bool(path.intersects_bbox(box, filled=False)) for path in paths)
            inside = axes.bbox.contains(*box.min) and axes.bbox.contains(*box.max)
            return lines + sum(bool(box.overlaps(box_taken)) for box_taken in taken) + (0 if inside else 2)

        taken.append(place_box(min(AROUND, key=count_crossings)))


def _lay_out(figure: "Figure") -> bool:
    """Lay out a figure, and return whether there is room for its panels."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if engine := figure.get_layout_engine():
            engine.execute(figure)
            for axes in figure.axes:
                axes.apply_aspect()
    return not any("not applied" in str(warning.message) for warning in caught)


def _readable(axes: "Axes") -> bool:
    box, inch = axes.get_window_extent(), axes.figure.dpi / MILLIMETRES_PER_INCH
    fits = [side / inch >= minimum for side, minimum in zip((box.width, box.height), LEAST_PANEL, strict=True)]
    # what has the shape of a map is as small as its room in one direction alone
    return all(fits) if axes.get_aspect() == "auto" else any(fits)


def _fit_panel(axes: "Axes") -> bool:
    """Shorten each label and the title where it is too long; return whether one was."""
    from matplotlib.text import Text

    box, apart = axes.get_window_extent(), axes.figure.dpi / 12
    # a title may reach over the room beside a map, which is narrower than its room
    figure_box = axes.figure.bbox
    right = figure_box.x0 + axes.get_position(original=True).x1 * figure_box.width
    rooms = [
        (axes.xaxis.label, axes.xaxis.label.get_window_extent().width, box.width + 2 * apart),
        (axes.yaxis.label, axes.yaxis.label.get_window_extent().height, box.height + 2 * apart),
    ]
    title_room = min(max(right - box.x0, box.width) + apart, figure_box.x1 - box.x0)
    named = {axes.get_title(), axes.get_title(loc="left")}
    titles = [child for child in axes.get_children() if isinstance(child, Text) and child.get_text() in named]
    rooms += [(title, title.get_window_extent().width, title_room) for title in titles]
    short = [_shorten(text, room / length) for text, length, room in rooms if text.get_text() and length > room]
    return any(short)


def _shorten(text: "Text", room: float) -> bool:
    """Take the next shorter form of a string: on two lines, its symbol and unit alone, in smaller letters."""
    original = text.get_text()
    symbol = re.search(r"\$[^$]*\$ \([^()]*\)$", original)
    columns = max(int(0.95 * max(map(len, original.split("\n"))) * room), 8)
    lines = [piece for line in original.split("\n") for piece in _wrap(line, columns, break_long_words=False)]
    if len(lines) == 2 and "\n" not in original:
        text.set_text("\n".join(lines))
    elif symbol and symbol[0] != original:
        text.set_text(symbol[0])
    elif float(text.get_fontsize()) > SMALL:
        text.set_fontsize(SMALL)
    elif "\n".join(lines) != original:
        text.set_text("\n".join(lines))
    else:
        return False
    return True
