"""Pictures of friction loops: those of a record, or a measured record and its model, one over the other."""

from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np

from historysim.basics.units import prefixed, quantity_text
from historysim.basics.wording import counted
from historysim.measured.loop_values import DIRECTIONS
from historysim.measured.loops import Loops
from historysim.results.plots.loop_trends import COLOURS, TRENDS, draw_trends
from historysim.results.plots.paper import PAGE, Drawn, Page, Place, paper
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.gridspec import SubplotSpec

    from historysim.basics.array_types import Integers


MOST_POINTS = 100_000
FAR = 2.0
"""How far the middle of a record is from zero, over its range, from which on axes are drawn from there."""


def plot_loops(
    loops: Loops,
    model: Loops | None = None,
    *,
    labels: tuple[str, str] = ("measured", "model"),
    title: str = "",
    **place: Unpack[Place],
) -> Drawn:
    """Draw friction loops over each other, with the means of what they say, and how that changes from loop to loop.

    At one normal load the loop of median energy is drawn stronger than the others, and at it the means of the first set
    are marked: the friction force of both directions, and the preliminary displacement and the stiffness of the forward
    branches. At several loads the loops have the colours of their loads. What the record has besides its loops, and
    branches that are left out of them, is grey.

    Parameters
    ----------
    loops : Loops
        From `historysim.loops`, or `historysim.results.analysis.friction_loops`.
    model : Loops, optional
        A second set, to compare.
    labels : (str, str)
        What the two sets are called, where there are two.
    title : str
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.
    """
    sets, offset = _near_zero([loops] if model is None else [loops, model])
    with paper(plot_loops, (PAGE, 117.0), place) as page:
        figure = page.several(1 + len(TRENDS))
        axes, places = _places(page, trends=len(loops) > 1)
        levels = int(loops.load_level.max()) + 1
        if levels > 1:
            _draw_levels(axes, sets, labels)
        else:
            _draw_loops(axes, sets, labels)
        if offset:
            axes.set_xlabel(f"{axes.get_xlabel()}, from {quantity_text(offset, 'm', 6)}")
        if places:
            columns = 2 if page.width < WIDE else 1
            draw_trends(figure, places, [each.to_dataset() for each in sets], columns=columns)
        page.legend(axes)
        page.heading(title)
    return page.drawn


WIDE, HIGH = 140.0, 85.0
"""Width and height from which on the trends stand beside the loops [mm]."""


def _places(page: Page, *, trends: bool) -> "tuple[Axes, list[SubplotSpec]]":
    """Return the axes of the loops, and places for as many trends as fit, beside or below them."""
    figure = page.figure
    if not trends:
        page.foot("no trends from loop to loop: there is one")
        return figure.add_subplot(), []
    if page.width >= WIDE and page.height >= HIGH:
        grid = figure.add_gridspec(len(TRENDS), 2, width_ratios=(1.75, 1))
        return figure.add_subplot(grid[:, 0]), [grid[row, 1] for row in range(len(TRENDS))]
    if page.height >= HIGH:
        grid = figure.add_gridspec(3, 2, height_ratios=(2.4, 1, 1))
        return figure.add_subplot(grid[0, :]), [grid[row, column] for row in (1, 2) for column in (0, 1)]
    page.left_out("loop by loop: friction, displacement, stiffness, energy")
    return figure.add_subplot(), []


def _near_zero(sets: list[Loops]) -> tuple[list[Loops], float]:
    """Return loops with displacements near zero, as those of a stage may not be, and what was taken off [m]."""
    moved = sets[0].trace.displacement
    middle = (float(moved.max()) + float(moved.min())) / 2
    if abs(middle) <= FAR * np.ptp(moved):
        return sets, 0.0
    near = [
        attrs.evolve(each, trace=attrs.evolve(each.trace, displacement=each.trace.displacement - middle))
        for each in sets
    ]
    return near, middle


def _draw_loops(axes: "Axes", sets: list[Loops], labels: tuple[str, str]) -> None:
    """Draw the loops of one normal load, each set in its colour."""
    length, force = _frame(axes, sets)
    for each, colour, label in zip(sets, COLOURS, labels, strict=False):
        draw = _pen(axes, each, length, force)
        for start, end in each.left_out:
            draw(start, end, color=FAINT, linewidth=0.6, alpha=0.7, zorder=1)
        if each.left_out_branches.any() or np.any(np.diff(each.number) > 1):
            draw(each.ends[0, 0], each.ends[-1, 2], color=FAINT, linewidth=0.6, alpha=0.7, zorder=1)
            for start, end in _branches(each):
                draw(start, end, color=colour, linewidth=0.6, alpha=0.4, zorder=2)
        else:
            # loops follow each other, so that one line draws them all
            draw(each.ends[0, 0], each.ends[-1, 2], color=colour, linewidth=0.6, alpha=0.4, zorder=2)
        start, _, end = each.ends[_typical(each)]
        draw(start, end, color=colour, linewidth=1.3, zorder=3, label=_name(each, label if len(sets) > 1 else ""))
    _mark_means(axes, sets[0], length, force)


def _draw_levels(axes: "Axes", sets: list[Loops], labels: tuple[str, str]) -> None:
    """Draw the loops of several normal loads, each in the colour of its load; a second set is dashed."""
    import matplotlib as mpl

    length, force = _frame(axes, sets)
    loads = sets[0].by_load()
    # the light end is left out: it is lost on white paper
    colours = mpl.colormaps["viridis_r"](np.linspace(0.15, 1.0, len(loads)))
    for order, (each, label) in enumerate(zip(sets, labels, strict=False)):
        draw = _pen(axes, each, length, force)
        if order == 0:
            draw(0, each.trace.time.size - 1, color=FAINT, linewidth=0.5, alpha=0.6, zorder=1)
        for value, colour in zip(loads.value, colours, strict=True):
            load = np.nanmean(each.normal_load, axis=1)
            here = np.flatnonzero(np.abs(load - value) <= each.definitions.load_share * value)
            name = f"{quantity_text(float(value), 'N', 3)}, {counted(here.size, 'loop', 'loops')}"
            line: dict[str, Any] = {"color": colour, "linewidth": 1.0, "zorder": 2}
            if order:
                name = label.replace("$", r"\$")
                line = {"color": INK, "linewidth": 0.8, "zorder": 3, "linestyle": (0, (3, 1.5))}
            for place, (start, end) in enumerate(_branches(each, here)):
                named = place == 0 and not (order and value > loads.value[0])
                draw(start, end, label=name if named else None, **line)
    if len(sets) > 1:
        for colour, label in zip(COLOURS, labels, strict=True):
            plain = label.replace("$", r"\$")
            axes.plot([], [], "o", color=colour, ms=3.5, label=f"{plain}, on the right")


def _frame(axes: "Axes", sets: list[Loops]) -> tuple[float, float]:
    """Label the axes, and return what displacement and load are multiplied by."""
    length, length_prefix = prefixed(max(float(np.abs(each.trace.displacement).max()) for each in sets))
    force, force_prefix = prefixed(max(float(np.abs(each.trace.tangential_load).max()) for each in sets))
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.margins(0.05, 0.09)
    axes.set(
        title="Friction loops",
        xlabel=f"tangential displacement $U$ ({length_prefix}m)",
        ylabel=f"tangential load $T$ ({force_prefix}N)",
    )
    return length, force


def _pen(axes: "Axes", loops: Loops, length: float, force: float) -> "Callable[..., None]":
    """Return what draws a record from sample to sample, with no more points than a page can show."""
    record = loops.trace
    stride = -(-record.time.size // MOST_POINTS)

    def draw(start: int, end: int, **line: Any) -> None:
        part = np.union1d(np.arange(start, end + 1, stride), end)
        x, y = record.displacement[part] * length, record.tangential_load[part] * force
        axes.plot(x, y, rasterized=True, solid_joinstyle="round", **line)

    return draw


def _branches(loops: Loops, which: "Integers | None" = None) -> list[list[int]]:
    """Return the ends of the branches that are not left out, joined where they follow each other."""
    pieces: list[list[int]] = []
    for loop in range(len(loops)) if which is None else which:
        ends = loops.ends[loop]
        for first, last in ((ends[0], ends[1]), (ends[1], ends[2])):
            backward = int(loops.trace.displacement[last] < loops.trace.displacement[first])
            if loops.left_out_branches[loop, backward] or first == last:
                continue
            if pieces and pieces[-1][1] == first:
                pieces[-1][1] = int(last)
            else:
                pieces.append([int(first), int(last)])
    return pieces


def _name(loops: Loops, label: str) -> str:
    # matplotlib takes what stands between dollar signs for mathematics
    plain = label.replace("$", r"\$")
    count = counted(len(loops), "loop", "loops")
    return f"{plain}, {count}" if plain else count


def _mark_means(axes: "Axes", loops: Loops, length: float, force: float) -> None:
    """Mark the means of the first set, at the forward branch of its typical loop and at both of its plateaus."""
    start, turn, end = loops.ends[_typical(loops)]
    u, f = loops.trace.displacement * length, loops.trace.tangential_load * force
    low, high = (start, turn) if u[start] < u[turn] else (turn, end)
    left, right, bottom = u[low], u[high], f[low]
    line: dict[str, Any] = {"color": INK, "linewidth": 0.9, "zorder": 4}

    forward, backward = (loops.statistics("friction_force", direction).mean for direction in DIRECTIONS)
    if not np.isfinite([forward, backward]).all():
        # without sliding there is no friction force to mark
        return
    top = forward * force
    axes.plot([left, right], [top, top], linestyle=(0, (4, 2)), label="means", **line)
    axes.plot([left, right], [-backward * force] * 2, linestyle=(0, (4, 2)), **line)
    _label(axes, quantity_text(forward, "N", 3), (right, top), (0, 3), ha="right", va="bottom")
    _label(axes, quantity_text(backward, "N", 3), (left, -backward * force), (0, -3), ha="left", va="top")

    way = loops.statistics("preliminary_displacement", "forward").mean
    if np.isfinite(way):
        middle, reached = bottom + 0.3 * (top - bottom), left + way * length
        arrow = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
        axes.annotate("", xy=(left, middle), xytext=(reached, middle), arrowprops=arrow, zorder=4)
        axes.plot([reached, reached], [middle, top], color=INK, linewidth=0.5, linestyle=(0, (1, 2)), zorder=4)
        _label(axes, quantity_text(way, "m", 3), (reached, middle), (3, 0), ha="left", va="center")
    stiffness = loops.statistics("tangential_stiffness", "forward").mean
    if np.isfinite(stiffness):
        rise = 0.6 * (top - bottom)
        at = left + rise / (stiffness * force / length), bottom + rise
        axes.plot([left, at[0]], [bottom, at[1]], **line)
        _label(axes, quantity_text(stiffness, "N/m", 3), at, (3, 0), ha="left", va="center")


def _label(axes: "Axes", text: str, at: tuple[float, float], offset: tuple[float, float], **place: Any) -> None:
    """Write a text some points off a place, on white, since it may lie on noise."""
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.8}
    axes.annotate(
        text, xy=at, xytext=offset, textcoords="offset points", fontsize=7.5, color=INK, zorder=5, bbox=box, **place
    )


def _typical(loops: Loops) -> int:
    """Return the loop of median energy."""
    return int(np.argsort(loops.dissipated_energy)[(len(loops) - 1) // 2])


@figure_of.register(Loops)
def _of_loops(what: Loops, *, place: Place, **_: Any) -> Drawn:
    return plot_loops(what, **place)
