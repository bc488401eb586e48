"""Friction loops of several histories, or of the cells of a sweep, in one picture, with marks."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats
from historysim.basics.fields import Quantity
from historysim.basics.units import newtons, quantity_text
from historysim.errors import InputError
from historysim.results import analysis
from historysim.results.analysis.preliminary import first_loading
from historysim.results.analysis.recorded import SLOPE, is_complete
from historysim.results.origin import dense
from historysim.results.plots.canvas import COLUMN, Canvas, Size
from historysim.results.plots.pictures import HISTORY, PICTURES, SWEEP, Panel, as_history_list
from historysim.results.plots.style import (
    FAINT,
    INK,
    LINES,
    MOST_LINES,
    SPAN,
    label_loop,
    line_style,
    zero_lines,
)
from historysim.results.plots.swept import cell_label, selected
from historysim.results.steps import named_states, resolve_step, state_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOOP = ("total_tangential_load", "tangential_displacement")  # what a loop is drawn of
END = "end of pre-sliding"  # the group of the marks of δ
MARK: dict[str, Any] = {"marker": "o", "ms": 3.6, "mfc": "white", "mew": 0.9, "linestyle": "", "zorder": 5}
# What the loads beside loops add to the width, alone and in the figure of a scenario [mm].
BESIDE_ALONE, BESIDE = 60.0, 50.0


def _newtons(loads: Sequence[float]) -> tuple[float, ...]:
    return tuple(map(newtons, loads))


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopsPicture(Panel):
    """Friction loops over one another: of histories, or of the cells of a sweep.

    Attributes
    ----------
    steps
        Names or numbers of states that are marked; by default all that have a name.
    first_loading
        Normal loads, of which the curves of first loading are drawn.
    work
        Shades the closed loop between ±δ. Of a sweep it needs ``preliminary_displacement`` among the outputs.
    drift
        Draws it between the δ of two loops; needs the same.
    delta
        Marks where each first begins to slide, and says how far that is; of a sweep it needs the same.
    drive
        Behind an instrument the loop of the drive, too.
    by_load
        Each normal load that is held in a colour of its own.
    loads
        Both loads along the named states, beside the loop.

    Examples
    --------
    [[picture]]
    kind = "loops"
    loads = true
    """

    steps: tuple[str | int, ...] | None = None
    first_loading: Annotated[tuple[float, ...], Quantity("N")] = attrs.field(default=(), converter=_newtons)
    work: bool = False
    drift: bool = False
    delta: bool = False
    drive: bool = False
    by_load: bool = False
    loads: bool = False

    kind, of, accepts_several, headed = "loops", (HISTORY, SWEEP), True, True

    @property
    def beside(self) -> float:
        """Width of the loads [mm]."""
        return BESIDE if self.loads else 0.0

    def default_size(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return a column, with room for the loads."""
        return COLUMN + (BESIDE_ALONE if self.loads else 0.0), 85.0

    def draw(self, canvas: Canvas, data: "xr.Dataset | Sequence[xr.Dataset]") -> None:
        """Draw the loops and their marks."""
        loops = self._cells(data)
        axes, load_axes = _panels(canvas) if self.loads else (canvas.axes(), None)
        label_loop(axes)
        smooth = [attrs.evolve(loop, rows=dense(loop.rows)) for loop in loops]
        for number, load in enumerate(self.first_loading):
            dashes: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (6, 2) if number == 0 else (1.5, 1.5))}
            name = f"first loading, {quantity_text(load, 'N')}"
            axes.plot(*first_loading(loops[0].rows, load), color=FAINT, label=name, zorder=1, **dashes)
        panels = [panel for loop in smooth for panel in (_by_load(loop) if self.by_load else [loop])]
        for number, loop in enumerate(panels):
            looks = line_style(number, len(panels))
            # of a load loops repeat, and lie on one another
            self._draw_loop(axes, loop, looks | ({"linestyle": "-"} if self.by_load else {}))
        # of more than two marks of δ the legend alone names them
        ends: list[Any] = [line for line in axes.get_lines() if line.get_gid() == END]
        for number, mark in enumerate(ends if len(ends) < 3 else []):
            symbol = r"$\delta$" if len(ends) == 1 else rf"$\delta_{number + 1}$"
            canvas.label(axes, symbol, (mark.get_xdata()[0], mark.get_ydata()[0]), fontsize=8)
        if self.drift:
            _mark_drift(canvas, axes, smooth)
        # on several loops letters lie on one another, unless they are asked for
        if len(smooth) == 1 or self.steps is not None:
            # numbers are those of recorded steps
            for loop in loops:
                _mark_states(canvas, axes, loop.rows, self.steps)
        axes.margins(0.07, 0.14)
        if load_axes is not None:
            _draw_loads(*load_axes, loops[0].rows)

    def _cells(self, subject: "xr.Dataset | Sequence[xr.Dataset]") -> "list[Cell]":
        """Return histories, or the cells of a sweep, as lines."""
        results = as_history_list(subject)
        cells: list[Cell] = []
        for result in results:
            for name in LOOP:
                if name not in result or "step" not in result[name].dims:
                    raise InputError(
                        f"there is no {name} along step; expected histories, or a sweep with {' and '.join(LOOP)} "
                        "among its outputs"
                    )
            cells += (
                [_history_cell(result)] if result[LOOP[0]].ndim == 1 else _sweep_cells(selected(result, self.where))
            )
        if not 1 <= len(cells) <= MOST_LINES:
            raise InputError(
                f"{len(cells)} lines in one picture; expected 1 to {MOST_LINES}: choose some (where), or sweep fewer"
            )
        names = [cell.label for cell in cells]
        if len(results) > 1 and len({*names}) < len(names):
            # results of one title are named by their files
            files = [Path(str(result.encoding.get("source", ""))).name for result in results]
            names = [name or f"result {number + 1}" for number, name in enumerate(files)]
        elif len(results) == len(cells) == 1:
            # one line alone needs no name
            names = [""]
        names = self.called_as(names, "lines")
        return [attrs.evolve(cell, label=name) for cell, name in zip(cells, names, strict=False)]

    def _draw_loop(self, axes: "Axes", loop: "Cell", style: dict[str, Any]) -> None:
        work = _shade(axes, loop, style["color"]) if self.work else ""
        load = loop.rows[LOOP[0]].values
        for row, displacement in enumerate(self._displacements(loop.rows)):
            looks = style | ({"linestyle": (0, (3, 1.5)), "linewidth": 0.9} if row else {})
            if row and not loop.label:
                looks["color"] = LINES[1][0]
            description = "displacement of the drive" if row else "contact" if self.drive else ""
            reach = _reach(loop, displacement, row) if self.delta else None
            far = "" if reach is None else rf"$\delta$ = {quantity_text(reach, 'm', 3)}"
            name = ", ".join(filter(None, (loop.label, work, description, far)))
            axes.plot(displacement, load, label=name or None, **looks)
            if reach is not None:
                axes.plot([reach], [load.max()], gid=END, color=style["color"], **MARK)

    def _displacements(self, rows: xr.Dataset) -> list[Floats]:
        """Return the displacements that a loop is drawn over: of the contact, and if asked for of the drive."""
        if self.drive and "drive_displacement" not in rows:
            raise InputError("drive: there is no drive_displacement; expected [instrument], and it among the outputs")
        return [rows[name].values for name in (LOOP[1], *(["drive_displacement"] if self.drive else []))]


def _by_load(loop: "Cell") -> "list[Cell]":
    """Return a line for each normal load that is held, with gaps elsewhere."""
    if "total_normal_load" not in loop.rows:
        raise InputError("by_load: there is no total_normal_load; expected a history, or it among the outputs")
    loads = loop.rows["total_normal_load"].values
    held = np.isclose(loads[1:], loads[:-1], rtol=1e-6)
    levels = dict.fromkeys(float(f"{load:.6g}") for load in loads[1:][held])
    return [
        attrs.evolve(
            loop,
            rows=loop.rows.where(xr.DataArray(np.isclose(loads, load, rtol=1e-5), dims="step")),
            label=", ".join(filter(None, (loop.label, f"$N$ = {quantity_text(load, 'N')}"))),
        )
        for load in levels
    ]


def _reach(loop: "Cell", displacement: Floats, row: int) -> float:
    """Return the displacement at which a line first slides: δ, for the drive plus the spring deflection [m]."""
    if loop.reach is None:
        raise InputError("delta: expected preliminary_displacement among the outputs")
    top = int(np.argmax(loop.rows[LOOP[0]].values))
    return loop.reach + (float(displacement[top] - loop.rows[LOOP[1]].values[top]) if row else 0.0)


def _panels(canvas: Canvas) -> "tuple[Axes, tuple[Axes, Axes] | None]":
    """Return the axes of the loop, and axes of normal and tangential load next to or below it if they fit."""
    figure = canvas.several(3)
    if len(canvas.fitting(("loop", "loads"), 2 if max(canvas.width, canvas.height) >= 110.0 else 1)) == 1:
        return figure.add_subplot(), None
    if canvas.width >= 110.0:
        axes = figure.subplot_mosaic("LN;LT", width_ratios=(1.7, 1))
    else:
        axes = figure.subplot_mosaic("L;N;T", height_ratios=(2.4, 1, 1))
    axes["N"].sharex(axes["T"])
    return axes["L"], (axes["N"], axes["T"])


@attrs.frozen(eq=False)
class Cell:
    """One line: its rows along ``step``, its label, and δ [m] and W [J] if they are known."""

    rows: xr.Dataset
    label: str = ""
    reach: float | None = None
    work: float | None = None


def _history_cell(history: xr.Dataset) -> Cell:
    label = str(history.attrs.get("title", ""))
    if not is_complete(history) or SLOPE in history:
        return Cell(history, label)
    peak = history.isel(step=[int(history["total_normal_load"].values.argmax())])
    reach, work = analysis.preliminary_displacement(peak), analysis.presliding_work(peak)
    return Cell(history, label, float(reach[0]), float(work[0]))


def _sweep_cells(sweep: xr.Dataset) -> list[Cell]:
    dims = [str(dim) for dim in sweep[LOOP[0]].dims if dim != "step"]
    varied = [dim for dim in dims if sweep.sizes[dim] > 1]
    cells = []
    for members in itertools.product(*(range(sweep.sizes[dim]) for dim in dims)):
        at = dict(zip(dims, members, strict=True))
        rows = sweep.isel(at)
        row_data = rows[[key for key in rows.data_vars if rows[key].dims == ("step",)]]
        # cells of fewer steps end with NaN, and those that have failed are nothing else
        valid = np.isfinite(row_data[LOOP[0]].values)
        if not valid.any():
            continue
        row_data = row_data.isel(step=valid)
        reach, work = (
            float(rows[key]) if key in rows else None for key in ("preliminary_displacement", "presliding_work")
        )
        cells.append(Cell(row_data, ", ".join(cell_label(sweep, dim, at[dim]) for dim in varied), reach, work))
    return cells


def _mark_states(canvas: Canvas, axes: "Axes", rows: xr.Dataset, steps: Sequence[str | int] | None) -> None:
    """Mark states on a loop, each with its name."""
    for state in named_states(rows) if steps is None else steps:
        step = resolve_step(state, rows)
        at = float(rows[LOOP[1]][step]), float(rows[LOOP[0]][step])
        axes.plot(*at, color=INK, **MARK)
        label = state_label(rows, step) if isinstance(state, str) else str(state)
        canvas.label(axes, label, at, fontsize=8, fontstyle="italic")


def _branch(loop: Cell) -> tuple[Floats, Floats, float]:
    """Return the first branch from sliding to sliding: displacement from its reversal [m], load [N], and δ [m]."""
    u, t = loop.rows[LOOP[1]].values, loop.rows[LOOP[0]].values
    if loop.reach is None:
        raise InputError("the preliminary displacement of the loops is not known; expected it among the outputs")
    top = np.abs(t).max()
    slides = np.abs(t) > top * (1 - 1e-9)
    starts = np.flatnonzero(slides[:-1] & ~slides[1:])
    if not starts.size:
        raise InputError("no loop turns round out of sliding; expected a larger amplitude of the displacement")
    # the first reversal: at it the contact slides forward
    start = int(starts[0])
    ends = np.flatnonzero(slides[start + 1 :])
    stop = start + 1 + int(ends[0]) if ends.size else t.size - 1
    distance, sign = np.abs(u[start : stop + 1] - u[start]), np.sign(t[start])
    load = t[start : stop + 1] * sign
    inside = distance < 2 * loop.reach
    return np.append(distance[inside], 2 * loop.reach), np.append(load[inside], -top), loop.reach


def _shade(axes: "Axes", loop: Cell, colour: Any) -> str:
    """Fill the closed loop between ±δ, which turns where sliding begins, and return its area, the work, as a text."""
    distance, load, reach = _branch(loop)
    u, t = np.concatenate([reach - distance, distance - reach]), np.concatenate([load, -load])
    axes.fill(u, t, color=colour, alpha=0.22, linewidth=0, zorder=0.5)
    # what is drawn has corners: the exact work is written where it is known
    work = loop.work or abs(2 * float(np.trapezoid(load, distance)))
    return f"$W$ = {quantity_text(work, 'J', 3)}"


def _mark_drift(canvas: Canvas, axes: "Axes", loops: Sequence[Cell]) -> None:
    """Mark where the first two loops begin to slide in first loading, and the drift between them."""
    if len(loops) < 2 or any(loop.reach is None for loop in loops[:2]):
        raise InputError("drift: expected two loops with their preliminary displacement among the outputs")
    ends = [(float(loop.reach or 0.0), float(loop.rows[LOOP[0]].values.max())) for loop in loops[:2]]
    low = -0.32 * max(top for _, top in ends)
    for number, (reach, top) in enumerate(ends):
        axes.plot([reach] * 2, [top, low], color=INK, linewidth=0.6, linestyle=":")
        axes.plot([reach], [top], color=INK, **MARK)
        canvas.label(axes, rf"$\delta_{number + 1}$", (reach, top))
    (reach_1, _), (reach_2, _) = ends
    axes.annotate("", xy=(reach_1, low), xytext=(reach_2, low), arrowprops=SPAN)
    canvas.label(axes, f"drift {quantity_text(abs(reach_2 - reach_1), 'm', 3)}", ((reach_1 + reach_2) / 2, low))


def _draw_loads(upper: "Axes", lower: "Axes", rows: xr.Dataset) -> None:
    """Draw normal and tangential load along the steps, the named ones as ticks."""
    if "total_normal_load" not in rows:
        raise InputError("loads: there is no total_normal_load; expected a history, or it among the outputs")
    names, time = named_states(rows), rows["time"].values
    for axes, name, symbol in ((upper, "total_normal_load", "N"), (lower, "total_tangential_load", "T")):
        values = rows[name].values
        axes.plot(time, values, color=LINES[0][0], linewidth=1.1)
        zero_lines(axes, vertical=False)
        axes.set(ylabel=f"${symbol}$ (N)", ylim=(min(0.0, 1.1 * values.min()), 1.15 * values.max()))
        steps = list(names.values())
        axes.plot(time[steps], values[steps], color=INK, **(MARK | {"ms": 2.8}))
    upper.tick_params(labelbottom=False)
    if names:
        lower.set_xticks(time[list(names.values())], list(names))
    lower.set_xlabel("state" if names else "time (s)")
