"""Texts of a figure that fit its size: labels and titles that are longer than their axes are broken, then shortened."""

import re
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from historysim.results.plots.style import FAINT, broken

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

LEAST_PANEL = 13.0, 8.0
"""Width and height of the smallest panel that can be read [mm]."""
ROUNDS = 4
POINTS_PER_INCH, MILLIMETRES_PER_INCH = 72.0, 25.4
APART = 6.0
"""Distance of two texts beside one another [pt]."""
SMALL = 6.5
"""Size of letters of what does not fit otherwise [pt]."""


def fit(figure: "Figure") -> tuple[float, float] | None:
    """Break and shorten texts of a figure that do not fit their axes; return what size it needs if it is too small.

    Returns
    -------
    (float, float) or None
        About the least width and height [mm]; None where each panel can be read.
    """
    panels = list(_panels(figure))
    for _ in range(ROUNDS):
        # titles on more lines take more room
        if not _laid_out(figure):
            return _size_laid_out(figure)
        # every panel is asked, also where one before it has changed
        if not sum(_fit_panel(axes) for axes in panels):
            break
    missing = [0.0, 0.0]
    inch = figure.dpi / MILLIMETRES_PER_INCH
    for axes in panels:
        box = axes.get_window_extent()
        lacks = [least - side / inch for least, side in zip(LEAST_PANEL, (box.width, box.height), strict=True)]
        if axes.get_aspect() != "auto":
            # what has the shape of a map is as small as its room in one direction alone
            lacks = [min(lacks)] * 2
        missing = [max(before, now) for before, now in zip(missing, lacks, strict=True)]
    if max(missing) <= 0:
        return None
    # what one panel lacks, each row and column of panels lacks
    rows, columns = _rows_and_columns(panels)
    width, height = (side * MILLIMETRES_PER_INCH for side in figure.get_size_inches())
    return width + max(missing[0], 0) * columns, height + max(missing[1], 0) * rows


def _laid_out(figure: "Figure") -> bool:
    """Lay out a figure, and return whether there is room for its panels."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        if engine := figure.get_layout_engine():
            engine.execute(figure)
            for axes in figure.axes:
                axes.apply_aspect()
    return not any("not applied" in str(each.message) for each in told)


def _size_laid_out(figure: "Figure") -> tuple[float, float]:
    """Return about the least width and height [mm] at which there is room for the panels, by trying."""
    size = figure.get_size_inches()
    wanted = size
    while not _laid_out(figure) and wanted.max() < LARGEST:
        wanted = wanted + STEP / MILLIMETRES_PER_INCH
        figure.set_size_inches(*wanted)
    figure.set_size_inches(*size)
    width, height = wanted * MILLIMETRES_PER_INCH
    return max(width, LEAST_FIGURE[0]), max(height, LEAST_FIGURE[1])


STEP, LARGEST, LEAST_FIGURE = 10.0, 20.0, (70.0, 55.0)
"""Steps of a size that is tried [mm], the largest one [inch], and what is asked for at least [mm]."""


def _panels(figure: "Figure | SubFigure") -> Iterator["Axes"]:
    for axes in figure.axes:
        if axes.get_label() != "<colorbar>" and axes.get_visible():
            yield axes


def _rows_and_columns(panels: "list[Axes]") -> tuple[int, int]:
    boxes = [axes.get_position() for axes in panels]
    return tuple(len({round(low, 1) for low in lows}) for lows in ([b.y0 for b in boxes], [b.x0 for b in boxes]))  # type: ignore[return-value] # two


def _fit_panel(axes: "Axes") -> bool:
    """Break or shorten one text of each kind that is too long; return whether there was one."""
    box, point = axes.get_window_extent(), axes.figure.dpi / POINTS_PER_INCH
    changed = False
    for axis, room in ((axes.xaxis, box.width), (axes.yaxis, box.height)):
        label = axis.label
        extent = label.get_window_extent()
        length = extent.width if axis is axes.xaxis else extent.height
        if label.get_text() and length > room + 2 * APART * point:
            changed |= _shortened(label)
    # a map is narrower than its place
    paper = axes.figure.bbox
    place = paper.x0 + axes.get_position(original=True).x1 * paper.width
    return changed | _fit_titles(axes, max(place - box.x0, box.width))


def _shortened(label: Any) -> bool:
    """Take the next shorter form of a label: on two lines, its symbol and unit alone, in smaller letters."""
    text = label.get_text()
    # the symbol and its unit, or the last word, stand on the second line
    if "\n" not in text and (
        found := re.fullmatch(r"(.*?\S) (\$[^$]*\$ \(.*\)|\S+ \(.*\)|\(.*\)|\$[^$]*\$|\S+)", text)
    ):
        label.set_text(f"{found[1]}\n{found[2]}")
        return True
    if found := re.search(r"\$[^$]*\$( \([^()]*\))?$", text):
        if found[0] != text:
            label.set_text(found[0])
            return True
    elif text.count("\n") == 1 and " " in text.split("\n")[0]:
        first, rest = text.split("\n")
        label.set_text("\n".join([*first.rsplit(" ", 1), rest]))
        return True
    if label.get_fontsize() > SMALL:
        label.set_fontsize(SMALL)
        return True
    return False


def _fit_titles(axes: "Axes", room: float) -> bool:
    """Set the note on the right of a title below it where both do not fit, and break a title that is too long."""
    title, middle, note = (_title(axes, place) for place in ("left", "center", "right"))
    point = axes.figure.dpi / POINTS_PER_INCH
    length = title.get_window_extent().width if title.get_text() else 0.0
    beside = note.get_window_extent().width if note.get_text() else 0.0
    if title.get_text() and beside and length + beside + APART * point > room:
        told = note.get_text().replace("\n", ", ")
        size = note.get_fontsize()
        lines = broken(told, room / point, size)
        axes.set_title("", loc="right")
        axes.annotate(
            "\n".join(lines),
            (0, 1),
            (0, 4),
            xycoords="axes fraction",
            textcoords="offset points",
            fontsize=size,
            color=FAINT,
        )
        kept = title.get_fontsize(), title.get_fontweight()
        axes.set_title(title.get_text(), pad=6 + 1.25 * size * len(lines), fontsize=kept[0], fontweight=kept[1])
        return True
    for each in (title, middle):
        if not each.get_text() or each.get_window_extent().width <= room + APART * point:
            continue
        size, bold, before = each.get_fontsize(), each.get_fontweight() == "bold", each.get_text().split("\n")
        lines = [part for line in before for part in broken(line, room / point, size, bold=bold)]
        if len(lines) > len(before):
            each.set_text("\n".join(lines))
            return True
        if each.get_fontsize() > SMALL:
            each.set_fontsize(SMALL)
            return True
    return False


def _title(axes: Any, place: str) -> Any:
    return {"left": axes._left_title, "center": axes.title, "right": axes._right_title}[place]  # noqa: SLF001 - no other way
