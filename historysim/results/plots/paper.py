"""What a picture is drawn on: a figure of a size in millimetres, a figure or axes of the caller, in one style."""

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, TypedDict

import attrs

from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.results.plots.style import FAINT, STYLE, plain_title

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Size = tuple[float, float]
"""Width and height [mm]."""

Drawn = Any
"""What a picture was drawn on: the new figure, or the figure or axes that were given."""

COLUMN, PAGE = 90.0, 180.0
"""Widths [mm] of one column and of both in a journal."""
MILLIMETRES_PER_INCH = 25.4
LEAST, MOST = 20.0, 2000.0


class Place(TypedDict, total=False):
    """Where a picture is drawn; every function that draws one takes these, and returns the figure or the axes.

    Attributes
    ----------
    size : (float, float)
        Width and height of a new figure [mm].
    figure : matplotlib.figure.Figure or SubFigure
        Draw into this one in place of a new one.
    ax : matplotlib.axes.Axes
        Draw into these axes: pictures that have one panel.
    """

    size: Size | None
    figure: Any
    ax: Any


@attrs.frozen(eq=False)
class Page:
    """What a picture is drawn on.

    Attributes
    ----------
    figure : Figure or SubFigure
    given : Axes, optional
        The axes of the caller, who wants one panel.
    width, height : float
        [mm]
    notes : list of str
        What is said at the foot.
    """

    figure: "Figure | SubFigure"
    given: "Axes | None"
    width: float
    height: float
    notes: list[str] = attrs.field(factory=list)

    @classmethod
    def of(cls, figure: "Figure | SubFigure", ax: "Axes | None" = None) -> "Page":
        """Return the page of a figure, or of a part of one, as large as it is."""
        width, height = (side / figure.dpi * MILLIMETRES_PER_INCH for side in (figure.bbox.width, figure.bbox.height))
        return cls(figure, ax, width, height)

    @property
    def drawn(self) -> Drawn:
        """What the function that draws returns."""
        return self.figure if self.given is None else self.given

    def axes(self) -> "Axes":
        """Return the axes of a picture with one panel."""
        return self.figure.add_subplot() if self.given is None else self.given

    def several(self, count: int = 2) -> "Figure | SubFigure":
        """Return the figure of a picture with several panels.

        Raises
        ------
        InputError
            Axes were given, which are one.
        """
        if self.given is not None:
            raise InputError(f"ax: this picture has {count} panels; expected figure= in place of ax=")
        return self.figure

    def heading(self, text: str, caption: str = "") -> None:
        """Write a title above the picture, on as many lines as it takes, and a caption below it."""
        size = 9.0 if self.width >= 120.0 else 8.0
        # beside a caption, a low picture has room for one line
        most = 1 if caption and self.height < 90.0 else 2
        lines = [plain_title(text, self.width * 0.97, size, lines=most)] if text else []
        lines += [plain_title(caption, self.width * 0.97, size, lines=4)] if caption else []
        if not lines:
            return
        if self.given is not None:
            room = self.given.get_window_extent().width / self.given.figure.dpi * MILLIMETRES_PER_INCH
            self.given.set_title(plain_title(text or caption, room, size, lines=3))
            return
        self.figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=size)

    def legend(
        self, *axes: "Axes", extra: str = "", handles: "Sequence[Artist]" = (), title: str | None = None
    ) -> None:
        """Name what is drawn in some axes below the picture, each name once, where no data can lie.

        There are as many columns as fit the width. In axes that were given names stand where most room is.
        """
        from matplotlib.lines import Line2D

        named: dict[str, Any] = {}
        for each in axes:
            for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
                named.setdefault(label, handle)
        named |= {str(handle.get_label()): handle for handle in handles}
        if extra:
            named[extra] = Line2D([], [], linestyle="")
        if not named:
            return
        if self.given is not None:
            self.given.legend(named.values(), named.keys(), loc="best", title=title)
            return
        place: dict[str, Any] = {"loc": "outside lower left", "columnspacing": 1.6, "handlelength": 1.8, "title": title}
        room = self.width * self.figure.dpi / MILLIMETRES_PER_INCH
        for size in (7.5, 7.0, 6.5, 6.0) if self.width >= 120.0 else (7.0, 6.5, 6.0):
            for columns in range(min(len(named), 6), 0, -1):
                legend = self.figure.legend(
                    named.values(), named.keys(), ncols=columns, fontsize=size, title_fontsize=size, **place
                )
                box = legend.get_window_extent()
                if box.width <= 0.95 * room and box.height <= HIGHEST_LEGEND * room * self.height / self.width:
                    for line in legend.legend_handles:
                        # samples are small, and their colour is to be seen
                        if isinstance(line, Line2D) and line.get_marker() == ".":
                            line.set_markersize(6.0)
                    return
                legend.remove()
        width = self.width * 0.8
        wrapped = [
            plain_title(name.replace(r"\$", "$"), width, 6.0, lines=4) if "$" not in name else name for name in named
        ]
        self.figure.legend(named.values(), wrapped, ncols=1, fontsize=6.0, title_fontsize=6.0, **place)

    def left_out(self, *names: str) -> None:
        """Say at the foot of the picture what does not fit its size, or has nothing to show."""
        if names:
            self.foot(f"left out at {self.width:.3g} × {self.height:.3g} mm: {', '.join(names)}")

    def part(self, figure: "SubFigure") -> "Page":
        """Return the page of a part of the figure, whose notes stand at the foot of the whole."""
        return attrs.evolve(Page.of(figure), notes=self.notes)

    def settle(self) -> None:
        """Lay out what was drawn so far, so that texts can be kept apart."""
        _whole(self.figure).draw_without_rendering()

    def foot(self, text: str) -> None:
        """Write a line at the foot of the picture, below what is named there."""
        self.notes.append(text)

    def finish(self) -> None:
        """Write the notes, once all else is there."""
        if not self.notes or self.given is not None:
            return
        shown = [plain_title(note, self.width * 0.97, NOTE, lines=3) for note in self.notes]
        engine: Any = self.figure.get_layout_engine()
        if self.figure.figure is not self.figure or not hasattr(engine, "execute"):
            self.figure.supxlabel("\n".join(shown), x=0.99, ha="right", fontsize=NOTE, color=FAINT)
            return
        inch = self.figure.dpi * self.height / MILLIMETRES_PER_INCH
        below = (1.3 * NOTE * sum(text.count("\n") + 1 for text in shown) + 2.0) / 72 * self.figure.dpi / inch
        names = 0.0
        for legend in self.figure.legends:
            # the layout makes room for names at the edge of the figure alone: these stand above the notes
            legend.set_bbox_to_anchor((0.0, below, 1.0, 1.0 - below))
            names = max(names, legend.get_window_extent().height / inch + 0.01)
        engine.set(rect=(0.0, below + names, 1.0, 1.0 - below - names))
        self.figure.text(
            0.99, below / 2, "\n".join(shown), ha="right", va="center", fontsize=NOTE, color=FAINT, in_layout=False
        )


HIGHEST_LEGEND = 0.3
"""Share of the height that names below a picture may take."""
NOTE = 6.0
"""Size of the letters at the foot [pt]."""


@contextmanager
def paper(draws: Callable[..., Any], default: Size, place: "Mapping[str, Any] | Place") -> Iterator[Page]:
    """Yield what a picture is drawn on, in the style of all pictures; at the end its texts are fitted to its size.

    Parameters
    ----------
    draws : callable
        The function that draws, whose options are told where one is misspelt.
    default : (float, float)
        Width and height of a new figure where none is said [mm].
    place : Place
        What the caller of that function said.

    Raises
    ------
    InputError
        An option that the function does not take, two places, what is no width and height from 20 to 2000 mm, or a
        size in which a panel would be too small.
    """
    own = [name for name, kind in inspect.signature(draws).parameters.items() if kind.kind is not kind.VAR_KEYWORD]
    known = [*own, *Place.__annotations__]
    for name in place:
        if name not in known:
            raise InputError(f"{draws.__name__} takes no {name!r}; {nearest(name, known)}")
    size: Any = place.get("size")
    figure: Any = place.get("figure")
    ax: Any = place.get("ax")
    if sum(each is not None for each in (size, figure, ax)) > 1:
        raise InputError("size, figure, ax: expected one of them: a figure and axes have a size of their own")
    _check_kind("figure", figure, "add_subplot")
    _check_kind("ax", ax, "get_xaxis")
    if figure is None and ax is None:
        with new_figure(size, default) as made:
            page = Page.of(made)
            yield page
            page.finish()
        return
    drawn_in = ax.figure if figure is None else figure
    whole = _whole(drawn_in)
    if ax is None and not whole.axes and whole.get_layout_engine() is None:
        whole.set_layout_engine("constrained")
    with in_style():
        page = Page.of(drawn_in, ax)
        yield page
        page.finish()


def _whole(figure: Any) -> Any:
    """Return the figure that a part of one, or of a part, belongs to."""
    while figure.figure is not figure:
        figure = figure.figure
    return figure


def _check_kind(name: str, given: Any, method: str) -> None:
    if given is not None and not hasattr(given, method):
        kind = "axes" if name == "ax" else "figure"
        raise InputError(
            f"{name} is a {type(given).__name__}; expected {kind} of matplotlib, such as plt.subplots() gives"
        )


@contextmanager
def new_figure(size: Size | None, default: Size) -> Iterator["Figure"]:
    """Yield an empty figure, to be drawn in the style of all pictures; at the end its texts are fitted to its size.

    Parameters
    ----------
    size : (float, float), optional
        Width and height [mm].
    default : (float, float)
        What stands for None.

    Raises
    ------
    InputError
        What is no width and height from 20 to 2000 mm, or a size in which a panel would be too small.
    """
    from historysim.basics.arguments import checked
    from historysim.results.plots.printed import PrintedFigure
    from historysim.results.plots.text_fitting import fit

    given = default if size is None else size
    sides = checked("size", given, above=0)
    if sides.shape != (2,) or not LEAST <= min(sides) <= max(sides) <= MOST:
        raise InputError(f"size is {size!r}; expected width and height from {LEAST:.0f} to {MOST:.0f} mm, as (90, 70)")
    with in_style():
        figure = PrintedFigure(figsize=tuple(sides / MILLIMETRES_PER_INCH), layout="constrained")
        yield figure
        if (least := fit(figure)) and size is not None:
            width, height = (math.ceil(side / 5) * 5 for side in least)
            raise InputError(
                f"size is {sides[0]:g} × {sides[1]:g} mm, in which a panel of this picture would be too small to be "
                f"read; expected about {width} × {height} mm at least, or fewer panels or lines"
            )


def in_style() -> AbstractContextManager[None]:
    """Return a context in which what is drawn has the style of all pictures."""
    import matplotlib as mpl

    return mpl.rc_context(STYLE)
