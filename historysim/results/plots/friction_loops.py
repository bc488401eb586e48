"""Friction loops of several histories, or of the cells of a sweep, in one picture, with marks."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats
from historysim.basics.fields import Quantity
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.results import analysis
from historysim.results.analysis.preliminary import first_loading
from historysim.results.analysis.recorded import SLOPE, check_recorded, is_complete
from historysim.results.analysis.slips import slip_note, slipping_area
from historysim.results.plots.canvas import COLUMN, Size
from historysim.results.plots.chart import Chart, Curve, Item, Note, Shape, Sheet, span
from historysim.results.plots.pictures import HISTORY, PICTURES, SWEEP, Panel, as_history_list
from historysim.results.plots.style import (
    FAINT,
    INK,
    LINES,
    LOOP_AXES,
    MOST_LINES,
    Look,
    line_style,
    select_steps,
    thin_history,
)
from historysim.results.plots.swept import cell_label, select_cells
from historysim.results.source import refine
from historysim.results.steps import named_states, resolve_step, state_label

LOOP = ("total_tangential_load", "tangential_displacement")  # variables of a loop
# quantities shown by colour
COLOURS = {"time": "time (s)", "slip": "slipping fraction of the contact area"}
END = "end of pre-sliding"  # the group of the marks of δ
MARK: Look = {
    "marker": "o",
    "ms": 3.6,
    "mfc": "white",
    "mew": 0.9,
    "linestyle": "",
    "zorder": 5,
}
# Extra width of the loads next to loops, alone and in the figure of a scenario [mm].
LOADS_ALONE, LOADS_IN_FIGURE = 60.0, 50.0


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
        Shades the closed loop between ±δ. Of a sweep it needs ``preliminary_displacement`` among
        the outputs.
    drift
        Draws it between the δ of two loops; needs the same.
    delta
        Marks the first sliding of each loop and its displacement; of a sweep it needs the same.
    drive
        Behind an instrument the loop of the drive, too.
    by_load
        Each constant normal load in a separate colour.
    loads
        Both loads along the named states, next to the loop.
    colour
        Of one history: its loop in the colour of the slipping fraction of the contact area,
        ``"slip"``, or of ``"time"``.

    Examples
    --------
    [[picture]]
    kind = "loops"
    loads = true
    """

    steps: tuple[str | int, ...] | None = None
    first_loading: Annotated[tuple[float, ...], Quantity("N")] = ()
    work: bool = False
    drift: bool = False
    delta: bool = False
    drive: bool = False
    by_load: bool = False
    loads: bool = False
    colour: str = ""

    kind, of, accepts_several, headed = "loops", (HISTORY, SWEEP), True, True
    order, report_options = 3, {"colour": "slip"}
    caption_lines = ("preliminary displacement", "first to slide")
    caption = "The friction loop, coloured by the fraction of the contact area that slips."

    @property
    def extra_width(self) -> float:
        """Width of the loads [mm]."""
        return LOADS_IN_FIGURE if self.loads else 0.0

    def default_size(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return a column, with room for the loads."""
        return COLUMN + (LOADS_ALONE if self.loads else 0.0), 85.0

    def sheet(self, data: "xr.Dataset | Sequence[xr.Dataset]") -> Sheet:
        """Return the loops and their marks."""
        if self.colour:
            return self._draw_sheet_by_slip(data)
        loops = self._cells(data)
        smooth = [attrs.evolve(loop, rows=refine(loop.rows)) for loop in loops]
        items = _band_of_pasts(loops[0].rows) if len(loops) == 1 else []
        for number, load in enumerate(self.first_loading):
            dashes = {
                "color": FAINT,
                "linewidth": 0.9,
                "linestyle": (0, (1.5, 1.5) if number else (6, 2)),
                "zorder": 1,
            }
            name = f"first loading, {quantity_text(load, 'N')}"
            items.append(Curve(*first_loading(loops[0].rows, load), name, dashes))
        lines = [line for loop in smooth for line in (_by_load(loop) if self.by_load else [loop])]
        ends: list[tuple[float, float]] = []
        for number, loop in enumerate(lines):
            # loops of one load repeat and hide each other
            look = line_style(number, len(lines)) | ({"linestyle": "-"} if self.by_load else {})
            items += self._loop(loop, look, ends)
        # with more than two marks of δ the legend alone names them
        for number, end in enumerate(ends if len(ends) < 3 else []):
            symbol = r"$\delta$" if len(ends) == 1 else rf"$\delta_{number + 1}$"
            items.append(Note(symbol, end, look={"fontsize": 8}))
        if self.drift:
            items += _drift(smooth)
        # letters of several loops hide each other, unless they are selected
        if len(smooth) == 1 or self.steps is not None:
            # numbers are those of recorded steps
            items += [item for loop in loops for item in _states(loop.rows, self.steps)]
        charts = {
            "L": Chart(items=items, name="loop", height=42.0, margins=(0.1, 0.14), **LOOP_AXES)
        }
        if self.loads:
            charts |= _load_charts(loops[0].rows)
        return Sheet(charts, wide="LLLNN;LLLTT" if self.loads else "")

    def _draw_sheet_by_slip(self, data: "xr.Dataset | Sequence[xr.Dataset]") -> Sheet:
        """Return the loop of one history in the colour of its slipping area or of time."""
        if self.colour not in COLOURS:
            raise InputError(f"colour is {self.colour!r}; expected 'slip' or 'time'")
        history, *others = as_history_list(data)
        if others or history.attrs.get("content") == SWEEP:
            raise InputError("colour: applies to the loop of one history; expected one result")
        check_recorded(history, LOOP[1])
        thin = thin_history(history)
        slips = self.colour == "slip"
        hue = slipping_area(history)[select_steps(history)] if slips else thin["time"].values
        line = Curve(
            thin[LOOP[1]].values,
            thin[LOOP[0]].values,
            look={"clim": (0, 1) if slips else None},
            hue=hue,
            # the slipping fraction jumps at a reversal
            colours=2_000,
        )
        chart = Chart(
            items=[*_band_of_pasts(thin), line],
            hue=COLOURS[self.colour],
            margins=(0.06, 0.06),
            **LOOP_AXES,
        )
        return Sheet({"L": chart}, notices=(slip_note(history),))

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
                [_history_cell(result)]
                if result[LOOP[0]].ndim == 1
                else _sweep_cells(select_cells(result, self.where))
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
        names = self.resolve_labels(names, "lines")
        return [attrs.evolve(cell, label=name) for cell, name in zip(cells, names, strict=False)]

    def _loop(self, loop: "Cell", style: Look, ends: list[tuple[float, float]]) -> list[Item]:
        """Return a loop over the contact and the drive, with its δ, which is added to `ends`."""
        area, work = _shade(loop, style["color"]) if self.work else ([], "")
        items = area
        load = loop.rows[LOOP[0]].values
        for row, displacement in enumerate(self._displacements(loop.rows)):
            look = style | ({"linestyle": (0, (3, 1.5)), "linewidth": 0.9} if row else {})
            if row and not loop.label:
                look["color"] = LINES[1][0]
            description = "displacement of the drive" if row else "contact" if self.drive else ""
            reach = _reach(loop, displacement, row) if self.delta else None
            delta = "" if reach is None else rf"$\delta$ = {quantity_text(reach, 'm', 3)}"
            name = ", ".join(filter(None, (loop.label, work, description, delta)))
            items.append(Curve(displacement, load, name, look))
            if reach is not None:
                ends.append((reach, float(load.max())))
                items.append(
                    Curve([reach], [load.max()], "", MARK | {"gid": END, "color": style["color"]})
                )
        return items

    def _displacements(self, rows: xr.Dataset) -> list[Floats]:
        """Return the displacements that a loop is drawn over: of the contact, and if asked for of the drive."""
        if self.drive and "drive_displacement" not in rows:
            raise InputError(
                "drive: there is no drive_displacement; expected [instrument], and it among the outputs"
            )
        return [
            rows[name].values for name in (LOOP[1], *(["drive_displacement"] if self.drive else []))
        ]


def _band_of_pasts(thin: xr.Dataset) -> list[Item]:
    """Return the band between the bounds of an unknown past, of loads or of displacements; empty if it is known."""
    displacement, load = (thin[name].values for name in reversed(LOOP))
    look: Look = {
        "color": FAINT,
        "alpha": 0.3,
        "linewidth": 0,
        "label": "bounds of all pasts",
        "zorder": 1,
    }
    items: list[Item] = []
    for name, along, method in (
        ("total_tangential_load", displacement, "fill_between"),
        ("tangential_displacement", load, "fill_betweenx"),
    ):
        if f"{name}_lower" not in thin:
            continue
        lower = thin[f"{name}_lower"].values
        upper = thin[f"{name}_upper"].values
        if (lower < upper).any():
            items.append(Shape(method, (along, lower, upper), look))
            look = {**look, "label": None}
    return items


def _by_load(loop: "Cell") -> "list[Cell]":
    """Return a line for each normal load that is held, with gaps elsewhere."""
    if "total_normal_load" not in loop.rows:
        raise InputError(
            "by_load: there is no total_normal_load; expected a history, or it among the outputs"
        )
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
    reach = analysis.preliminary_displacement(peak)
    work = analysis.presliding_work(peak)
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
            float(rows[key]) if key in rows else None
            for key in ("preliminary_displacement", "presliding_work")
        )
        cells.append(
            Cell(
                row_data, ", ".join(cell_label(sweep, dim, at[dim]) for dim in varied), reach, work
            )
        )
    return cells


def _states(rows: xr.Dataset, steps: Sequence[str | int] | None) -> list[Item]:
    """Return marks of states on a loop with their names, on the outer side of the loop."""
    items: list[Item] = []
    middle = 0.5 * (float(rows[LOOP[1]].min()) + float(rows[LOOP[1]].max()))
    for state in named_states(rows) if steps is None else steps:
        step = resolve_step(state, rows)
        at = float(rows[LOOP[1]][step]), float(rows[LOOP[0]][step])
        label = state_label(rows, step) if isinstance(state, str) else str(state)
        items.append(Curve([at[0]], [at[1]], "", MARK | {"color": INK}))
        side = (5.0, 0.0) if at[0] > middle else (-5.0, 0.0)
        items.append(Note(label, at, side, {"fontsize": 8, "fontstyle": "italic"}))
    return items


def _branch(loop: Cell) -> tuple[Floats, Floats, float]:
    """Return the first branch from sliding to sliding: displacement from its reversal [m], load [N], and δ [m]."""
    u = loop.rows[LOOP[1]].values
    t = loop.rows[LOOP[0]].values
    if loop.reach is None:
        raise InputError(
            "the preliminary displacement of the loops is not known; expected it among the outputs"
        )
    top = np.abs(t).max()
    slides = np.abs(t) > top * (1 - 1e-9)
    starts = np.flatnonzero(slides[:-1] & ~slides[1:])
    if not starts.size:
        raise InputError(
            "no loop turns round out of sliding; expected a larger amplitude of the displacement"
        )
    # the first reversal: at it the contact slides forward
    start = int(starts[0])
    ends = np.flatnonzero(slides[start + 1 :])
    stop = start + 1 + int(ends[0]) if ends.size else t.size - 1
    distance = np.abs(u[start : stop + 1] - u[start])
    sign = np.sign(t[start])
    load = t[start : stop + 1] * sign
    inside = distance < 2 * loop.reach
    return np.append(distance[inside], 2 * loop.reach), np.append(load[inside], -top), loop.reach


def _shade(loop: Cell, colour: Any) -> tuple[list[Item], str]:
    """Return the closed loop between ±δ, which reverses at the start of sliding, and its area, the work."""
    distance, load, reach = _branch(loop)
    u = np.concatenate([reach - distance, distance - reach])
    t = np.concatenate([load, -load])
    # the drawn loop has corners: the exact work is stated where it is known
    work = loop.work or abs(2 * float(np.trapezoid(load, distance)))
    fill = Shape("fill", (u, t), {"color": colour, "alpha": 0.22, "linewidth": 0, "zorder": 0.5})
    return [fill], f"$W$ = {quantity_text(work, 'J', 3)}"


def _drift(loops: Sequence[Cell]) -> list[Item]:
    """Return the marks of the first sliding of two loops in first loading, and the drift between them."""
    if len(loops) < 2 or any(loop.reach is None for loop in loops[:2]):
        raise InputError(
            "drift: expected two loops with their preliminary displacement among the outputs"
        )
    ends = [
        (float(loop.reach or 0.0), float(loop.rows[LOOP[0]].values.max())) for loop in loops[:2]
    ]
    low = -0.32 * max(top for _, top in ends)
    items = list[Item]()
    for number, (reach, top) in enumerate(ends):
        items.append(
            Curve([reach] * 2, [top, low], "", {"color": INK, "linewidth": 0.6, "linestyle": ":"})
        )
        items.append(Curve([reach], [top], "", MARK | {"color": INK}))
        items.append(Note(rf"$\delta_{number + 1}$", (reach, top), (4, 4) if number else (-4, 4)))
    (reach_1, _), (reach_2, _) = ends
    text = f"drift {quantity_text(abs(reach_2 - reach_1), 'm', 3)}"
    return [
        *items,
        span((reach_1, low), (reach_2, low)),
        Note(text, (max(reach_1, reach_2), low), (6, 0)),
    ]


def _load_charts(rows: xr.Dataset) -> dict[str, Chart]:
    """Return normal and tangential load along the steps, the named ones as ticks."""
    if "total_normal_load" not in rows:
        raise InputError(
            "loads: there is no total_normal_load; expected a history, or it among the outputs"
        )
    names = named_states(rows)
    time = rows["time"].values
    charts = {}
    steps = list(names.values())
    for letter, name, text in (
        ("N", "total_normal_load", "normal load"),
        ("T", LOOP[0], "tangential load"),
    ):
        values = rows[name].values
        line = Curve(time, values, "", {"color": LINES[0][0], "linewidth": 1.1})
        marks = Curve(time[steps], values[steps], "", MARK | {"color": INK, "ms": 2.8})
        axes: Look = {"ylim": (min(0.0, 1.1 * values.min()), 1.15 * values.max())}
        axes |= {"xticks": time[steps], "xticklabels": list(names)} if names else {}
        label: Look = {
            "x": "state" if names else "time (s)",
            "y": f"${letter}$ (N)",
            "name": text,
        }
        charts[letter] = Chart(
            items=[line, marks], zero="x", share="time", height=23.0, axes=axes, **label
        )
    return charts
