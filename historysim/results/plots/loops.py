"""Pictures of friction loops: those of a record, or a measured record and its model, one over the other."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from historysim.basics.units import prefixed, quantity_text
from historysim.measured.loops import DIRECTIONS, Loops
from historysim.results.plots.loop_trends import COLOURS, TRENDS, draw_trends
from historysim.results.plots.style import FAINT, INK, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

MOST_POINTS = 100_000


def plot_loops(
    loops: Loops, model: Loops | None = None, *, labels: tuple[str, str] = ("measured", "model"), title: str = ""
) -> "Figure":
    """Draw friction loops over each other, with the means of what they say, and how that changes from loop to loop.

    The loop of median energy is drawn stronger than the others, and at it the means of the first set are marked: the
    friction force of both directions, and the preliminary displacement and the stiffness of the forward branches. What
    the record has besides its loops is grey.

    Parameters
    ----------
    loops : Loops
        From `historysim.find_loops`, or `historysim.results.analysis.friction_loops`.
    model : Loops, optional
        A second set, to compare.
    labels : (str, str)
        What the two sets are called, where there are two.
    title : str
        A heading.

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    sets = [loops] if model is None else [loops, model]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.1, 4.6), layout="constrained")
        grid = figure.add_gridspec(len(TRENDS), 2, width_ratios=(1.75, 1))
        _draw_loops(figure.add_subplot(grid[:, 0]), sets, labels)
        draw_trends(figure, [grid[row, 1] for row in range(len(TRENDS))], [each.to_dataset() for each in sets])
        figure.legend(loc="outside lower left", ncols=3, columnspacing=2.0)
        if title:
            figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left", fontsize=9.5)
    return figure


def _draw_loops(axes: "Axes", sets: list[Loops], labels: tuple[str, str]) -> None:
    length, length_prefix = prefixed(max(float(np.abs(each.trace.displacement).max()) for each in sets))
    force, force_prefix = prefixed(max(float(np.abs(each.trace.tangential_load).max()) for each in sets))
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
    for each, colour, label in zip(sets, COLOURS, labels, strict=False):
        record, typical = each.trace, _typical(each)
        stride = -(-record.time.size // MOST_POINTS)

        def draw(start: int, end: int, stride: int = stride, record: Any = record, **line: Any) -> None:
            part = np.union1d(np.arange(start, end + 1, stride), end)
            x, y = record.displacement[part] * length, record.tangential_load[part] * force
            axes.plot(x, y, rasterized=True, solid_joinstyle="round", **line)

        for start, end in each.left_out:
            draw(start, end, color=FAINT, linewidth=0.6, alpha=0.7, zorder=1)
        # loops follow each other, so that one line draws them all
        draw(each.ends[0, 0], each.ends[-1, 2], color=colour, linewidth=0.6, alpha=0.4, zorder=2)
        start, _, end = each.ends[typical]
        draw(start, end, color=colour, linewidth=1.3, zorder=3, label=_name(each, label if len(sets) > 1 else ""))
    _mark_means(axes, sets[0], length, force)
    axes.margins(0.05, 0.09)
    axes.set(
        title="Friction loops",
        xlabel=f"tangential displacement $U$ ({length_prefix}m)",
        ylabel=f"tangential load $T$ ({force_prefix}N)",
    )


def _name(loops: Loops, label: str) -> str:
    # matplotlib takes what stands between dollar signs for mathematics
    plain = label.replace("$", r"\$")
    count = f"{len(loops):,} loop{'s' if len(loops) > 1 else ''}"
    return f"{plain}, {count}" if plain else count


def _mark_means(axes: "Axes", loops: Loops, length: float, force: float) -> None:
    """Mark the means of the first set, at the forward branch of its typical loop and at both of its plateaus."""
    start, turn, end = loops.ends[_typical(loops)]
    u, f = loops.trace.displacement * length, loops.trace.tangential_load * force
    low, high = (start, turn) if u[start] < u[turn] else (turn, end)
    left, right, bottom = u[low], u[high], f[low]
    line: dict[str, Any] = {"color": INK, "linewidth": 0.9, "zorder": 4}

    forward, backward = (loops.statistics("friction_force", direction).mean for direction in DIRECTIONS)
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
