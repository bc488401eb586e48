"""Friction loops of several histories, or of the cells of a sweep, in one picture, with what is marked on them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np
import xarray as xr

from historysim.basics.array_types import Floats
from historysim.basics.units import newtons, prefixed, quantity_text
from historysim.errors import InputError
from historysim.recording.named_states import named_states, state_label, step_of
from historysim.results.analysis.presliding import first_loading
from historysim.results.dense import dense
from historysim.results.plots.line_styles import LINES, line_style
from historysim.results.plots.paper import COLUMN, Drawn, Page, Place, paper
from historysim.results.plots.style import FAINT, INK
from historysim.results.plots.swept_cells import Cell, cells_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LOOP = ("total_tangential_load", "tangential_displacement")
"""What a loop is drawn of."""
MARK: dict[str, Any] = {"marker": "o", "ms": 3.6, "mfc": "white", "mew": 0.9, "linestyle": "", "zorder": 5}


def _newtons(loads: Sequence[float]) -> tuple[float, ...]:
    return tuple(map(newtons, loads))


@attrs.frozen(kw_only=True)
class LoopMarks:
    """What is drawn on friction loops, beside the loops.

    Attributes
    ----------
    steps : sequence of str or int, optional
        States that are marked, by name or step; by default all named ones.
    first_loading : sequence of float
        Normal loads [N] whose curves of first loading are drawn as thin lines, of the first loop's contact.
    work : bool
        The closed loop between ±δ is shaded: its area is the work of pre-sliding.
    drift : bool
        The preliminary displacements of the first two loops are marked, and the drift between them.
    drive : bool
        Behind an instrument, the loop over the displacement of its drive, too.
    loads : bool
        Normal and tangential load along the named states beside the loop.
    """

    steps: Sequence[str | int] | None = None
    first_loading: Sequence[float] = attrs.field(default=(), converter=_newtons)
    work: bool = False
    drift: bool = False
    drive: bool = False
    loads: bool = False


def plot_together(
    loops: xr.Dataset | Sequence[xr.Dataset],
    labels: Sequence[str] = (),
    *,
    where: Mapping[str, Any] | None = None,
    marks: LoopMarks | None = None,
    title: str = "",
    **place: Unpack[Place],
) -> Drawn:
    """Draw the friction loops of several histories, or of the cells of a sweep, over one another.

    Parameters
    ----------
    loops : xarray.Dataset or sequence of them
        A history or several; or a sweep whose outputs are ``total_tangential_load`` and ``tangential_displacement``.
    labels : sequence of str, optional
        What the loops are called; by default the swept value, or the titles.
    where : dict, optional
        Of a sweep, only the cells with these values of swept keys: ``{"materials.first": "silicon"}``.
    marks : LoopMarks, optional
        What is drawn beside the loops.
    title : str, optional
        A heading; by default the title of the first.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide, 150 mm with the loads.

    Raises
    ------
    InputError
        No loops, more than 12, labels that do not fit them, or marks that the data do not tell.
    """
    marks = marks or LoopMarks()
    found = cells_of(loops, LOOP, labels, where)
    # of several each has its title below
    heading = title or (str(loops.attrs.get("title", "")) if isinstance(loops, xr.Dataset) else "")
    with paper(plot_together, (COLUMN + (60.0 if marks.loads else 0.0), 85.0), place) as page:
        draw_together(page, found, marks)
        page.heading(heading)
    return page.drawn


def draw_together(page: Page, loops: Sequence[Cell], marks: LoopMarks, title: str = "") -> None:
    """Draw loops on a page."""
    axes, beside = _panels(page) if marks.loads else (page.axes(), None)
    smooth = [attrs.evolve(loop, rows=dense(loop.rows)) for loop in loops]
    length, unit = _scale([row for loop in smooth for row in _displacements(loop.rows, marks)], "m")
    force, force_unit = _scale([loop.rows[LOOP[0]].values for loop in smooth], "N")
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
    for number, load in enumerate(marks.first_loading):
        u, t = first_loading(loops[0].rows, load)
        name = f"first loading, {quantity_text(load, 'N')}"
        dashes = (0, (6, 2) if number == 0 else (1.5, 1.5))
        axes.plot(u * length, t * force, color=FAINT, linewidth=0.9, linestyle=dashes, label=name, zorder=1)
    for number, loop in enumerate(smooth):
        style = line_style(number, len(smooth))
        told = _shade(axes, loop, length, force, style["color"]) if marks.work else ""
        for row, own in enumerate(_displacements(loop.rows, marks)):
            drive = {"linestyle": (0, (3, 1.5)), "linewidth": 0.9} if row else {}
            name = _named(loop.label, told, "displacement of the drive" if row else "contact" if marks.drive else "")
            axes.plot(own * length, loop.rows[LOOP[0]].values * force, label=name or None, **(style | drive))
    if marks.drift:
        _mark_drift(axes, smooth, length, force)
    # on several loops letters lie on one another, unless they are asked for
    if len(smooth) == 1 or marks.steps is not None:
        # numbers are those of recorded steps
        _mark_states(axes, loops, marks, length, force)
    axes.margins(0.07, 0.14)
    axes.set(xlabel=f"tangential displacement $U$ ({unit})", ylabel=f"tangential load $T$ ({force_unit})")
    if title:
        axes.set_title(title)
    if beside is not None:
        _draw_loads(*beside, loops[0].rows)
    elif marks.loads:
        page.left_out("loads")
    if axes.get_legend_handles_labels()[1]:
        page.legend(axes)


def _panels(page: Page) -> "tuple[Axes, tuple[Axes, Axes] | None]":
    """Return the axes of the loop, and those of the normal and the tangential load beside or below it, if they fit."""
    figure = page.several(3)
    if page.width >= 110.0:
        grid = figure.add_gridspec(2, 2, width_ratios=(1.7, 1))
        loop, upper, lower = grid[:, 0], grid[0, 1], grid[1, 1]
    elif page.height >= 110.0:
        grid = figure.add_gridspec(3, 1, height_ratios=(2.4, 1, 1))
        loop, upper, lower = grid[0, 0], grid[1, 0], grid[2, 0]
    else:
        return figure.add_subplot(), None
    axes, normal = figure.add_subplot(loop), figure.add_subplot(upper)
    return axes, (normal, figure.add_subplot(lower, sharex=normal))


def _named(*parts: str) -> str:
    return ", ".join(filter(None, parts))


def _displacements(rows: xr.Dataset, marks: LoopMarks) -> list[Floats]:
    """Return the displacements that a loop is drawn over: of the contact, and of the drive where that is asked for."""
    found = [rows[LOOP[1]].values]
    if marks.drive:
        if "drive_displacement" not in rows:
            raise InputError("drive: there is no drive_displacement; expected [instrument], and it among the outputs")
        found.append(rows["drive_displacement"].values)
    return found


def _scale(values: Sequence[Floats], unit: str) -> tuple[float, str]:
    factor, prefix = prefixed(max(float(np.abs(each).max(initial=0.0)) for each in values))
    return factor, prefix + unit


def _mark_states(axes: "Axes", loops: Sequence[Cell], marks: LoopMarks, length: float, force: float) -> None:
    """Mark states on loops, each with its name outside of the loop."""
    for loop in loops:
        rows = loop.rows
        chosen = list(named_states(rows)) if marks.steps is None else list(marks.steps)
        for state in chosen:
            step = step_of(rows, state)
            u, t = float(rows[LOOP[1]][step]) * length, float(rows[LOOP[0]][step]) * force
            axes.plot([u], [t], color=INK, **MARK)
            # on the way down a state lies on the lower right of the loop, on the way up on the upper left
            right = float(rows[LOOP[1]][max(step - 1, 0)]) * length > u
            axes.annotate(
                state_label(rows, step) if isinstance(state, str) else str(state),
                (u, t),
                xytext=(5 if right else -5, -5 if right else 5),
                textcoords="offset points",
                ha="left" if right else "right",
                va="top" if right else "bottom",
                fontsize=8,
                fontstyle="italic",
                zorder=6,
            )


def _branch(loop: Cell) -> tuple[Floats, Floats, float]:
    """Return the last branch from sliding to sliding: displacement from its reversal, load, and δ.

    Raises
    ------
    InputError
        The loop has no such branch, or δ is not known.
    """
    u, t = loop.rows[LOOP[1]].values, loop.rows[LOOP[0]].values
    if loop.reach is None:
        raise InputError("the preliminary displacement of the loops is not known; expected it among the outputs")
    top = np.abs(t).max()
    slides = np.abs(t) > top * (1 - 1e-9)
    starts = np.flatnonzero(slides[:-1] & ~slides[1:])
    if not starts.size:
        raise InputError("no loop turns round out of sliding; expected a larger amplitude of the displacement")
    # the first reversal: at it the contact slides forward
    first = int(starts[0])
    ends = np.flatnonzero(slides[first + 1 :])
    last = first + 1 + int(ends[0]) if ends.size else t.size - 1
    way, sign = np.abs(u[first : last + 1] - u[first]), np.sign(t[first])
    load = t[first : last + 1] * sign
    inside = way < 2 * loop.reach
    return np.append(way[inside], 2 * loop.reach), np.append(load[inside], -top), loop.reach


def _shade(axes: "Axes", loop: Cell, length: float, force: float, colour: Any) -> str:
    """Fill the closed loop between ±δ, which turns where sliding begins, and return its area, the work, as a text."""
    way, load, reach = _branch(loop)
    upper = (reach - way) * length
    u, t = np.concatenate([upper, -upper]), np.concatenate([load, -load]) * force
    axes.fill(u, t, color=colour, alpha=0.22, linewidth=0, zorder=0.5)
    # what is drawn has corners: where the work is known it is told as it is
    work = loop.work or abs(2 * float(np.trapezoid(load, way)))
    return f"$W$ = {quantity_text(work, 'J', 3)}"


def _mark_drift(axes: "Axes", loops: Sequence[Cell], length: float, force: float) -> None:
    """Mark where the first two loops begin to slide in first loading, and the drift between them."""
    if len(loops) < 2 or any(loop.reach is None for loop in loops[:2]):
        raise InputError("drift: expected two loops with their preliminary displacement among the outputs")
    places = [(float(loop.reach or 0.0), float(loop.rows[LOOP[0]].values.max())) for loop in loops[:2]]
    low = -0.32 * max(top for _, top in places)
    for number, (reach, top) in enumerate(places):
        axes.plot([reach * length] * 2, [top * force, low * force], color=INK, linewidth=0.6, linestyle=":")
        axes.plot([reach * length], [top * force], color=INK, **MARK)
        axes.annotate(
            rf"$\delta_{number + 1}$",
            (reach * length, top * force),
            xytext=(-3 if reach == min(place[0] for place in places) else 3, 4),
            textcoords="offset points",
            ha="right" if reach == min(place[0] for place in places) else "left",
        )
    first, second = (reach * length for reach, _ in places)
    arrow = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
    axes.annotate("", xy=(first, low * force), xytext=(second, low * force), arrowprops=arrow)
    drift = abs(places[1][0] - places[0][0])
    axes.annotate(
        f"drift {quantity_text(drift, 'm', 3)}",
        (max(first, second), low * force),
        xytext=(4, 0),
        textcoords="offset points",
        va="center",
        fontsize=7.5,
        zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.8},
    )


def _draw_loads(upper: "Axes", lower: "Axes", rows: xr.Dataset) -> None:
    """Draw normal and tangential load along the steps, the named ones as ticks."""
    if "total_normal_load" not in rows:
        raise InputError("loads: there is no total_normal_load; expected a history, or it among the outputs")
    names = named_states(rows)
    time = rows["time"].values
    for axes, name, symbol in ((upper, "total_normal_load", "N"), (lower, "total_tangential_load", "T")):
        values = rows[name].values
        factor, unit = _scale([values], "N")
        axes.plot(time, values * factor, color=LINES[0][0], linewidth=1.1)
        if symbol == "T":
            axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
        axes.set_ylabel(f"${symbol}$ ({unit})")
        axes.set_ylim(min(0.0, 1.1 * float(values.min()) * factor), 1.15 * float(values.max()) * factor)
        for step in names.values():
            axes.plot([time[step]], [values[step] * factor], color=INK, **(MARK | {"ms": 2.8}))
    upper.tick_params(labelbottom=False)
    if names:
        lower.set_xticks([time[step] for step in names.values()], list(names))
        lower.set_xlabel("state")
    else:
        lower.set_xlabel("time (s)")
