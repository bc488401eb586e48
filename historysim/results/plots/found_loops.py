"""Pictures of friction loops that were found: the loops, their values from loop to loop, and over their loads."""

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.measured.fretting import TRANSITION_A, TRANSITION_B, Fretting
from historysim.measured.loop_table import LoopStatistics, LoopTable
from historysim.measured.loop_values import DIRECTIONS
from historysim.measured.loops import Loops
from historysim.results.plots.canvas import TWO_COLUMNS, WIDE, Canvas
from historysim.results.plots.pictures import PICTURES, Titled
from historysim.results.plots.style import (
    DASHED,
    FAINT,
    INK,
    LOOP_NUMBER,
    MOST_EDGED,
    MOST_TICKS,
    MOVED,
    SPAN,
    STATE_COLOURS,
    format_unit,
    label_loop,
    plain,
    scale_of,
    set_side_by_side,
)
from historysim.results.tables import of_mean

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

COLOURS, MARKERS = STATE_COLOURS[1:3], "^v"
TRENDS = "friction_force", "preliminary_displacement", "tangential_stiffness", "dissipated_energy"
LEVELS = "friction_force", "preliminary_displacement", "friction_coefficient", "dissipated_energy"
HIGH = 85.0  # height from which on there is room for a second row of panels [mm]


@PICTURES.register
@attrs.frozen(kw_only=True)
class MeasuredLoopsPicture(Titled):
    """Friction loops that were found, over one another, with their means, and how these change from loop to loop.

    At one normal load, of the loops that the means are of, the one of median energy is drawn stronger than the others,
    and at it the means of the first set are marked: the friction force of both directions, and the preliminary
    displacement and the stiffness of the forward branches. At several loads the loops have the colours of their loads.
    What the record has besides its loops, and branches that are left out of them, is grey.

    Attributes
    ----------
    model
        A second set, to compare.
    labels
        What the two sets are called.
    """

    model: Loops | None = None
    labels: tuple[str, ...] = ("measured", "model")

    kind, of, size, own_figure = "measured-loops", (Loops,), (TWO_COLUMNS, 117.0), True

    def draw(self, canvas: Canvas, data: Loops) -> None:
        """Draw the loops, and the trends beside or below them."""
        sets = [data] if self.model is None else [data, self.model]
        canvas.several(1 + len(TRENDS))
        axes, *trends = _panels(canvas, trends=len(data) > 1)
        if int(data.load_level.max()) > 0:
            _draw_levels(axes, sets, self.labels, trends=bool(trends))
        else:
            _draw_loops(canvas, axes, sets, self.labels)
        if trends:
            _draw_trends(trends, [loops.to_dataset() for loops in sets], 2 if canvas.width < WIDE else 1)
        canvas.legend(axes, handles=_direction_handles() if trends else (), extra=MOVED if trends else "")


def _panels(canvas: Canvas, *, trends: bool) -> "list[Axes]":
    """Return the axes of the loops, and of the trends beside or below them, where they fit."""
    rows: Any = [["loops"]]
    ratios: dict[str, Any] = {}
    if not trends:
        canvas.notice("no trends from loop to loop: there is one")
    elif len(canvas.fitting(("loops", "how they change from loop to loop"), 1 if canvas.height < HIGH else 2)) == 1:
        pass
    elif canvas.width >= WIDE:
        rows, ratios = [["loops", name] for name in TRENDS], {"width_ratios": (1.75, 1)}
    else:
        rows, ratios = [["loops", "loops"], TRENDS[:2], TRENDS[2:]], {"height_ratios": (2.4, 1, 1)}
    axes = canvas.figure.subplot_mosaic(rows, **ratios)
    return [axes[name] for name in ("loops", *TRENDS) if name in axes]


def _draw_loops(canvas: Canvas, axes: "Axes", sets: list[Loops], labels: Sequence[str]) -> None:
    """Draw the loops of one normal load, each set in its colour."""
    _frame(axes)
    for loops, colour, label in zip(sets, COLOURS, labels, strict=False):
        draw = functools.partial(_draw_part, axes, loops)
        for start, stop in loops.left_out:
            draw(start, stop, color=FAINT, linewidth=0.6, alpha=0.7, zorder=1)
        if loops.left_out_branches.any() or np.any(np.diff(loops.number) > 1):
            draw(loops.ends[0, 0], loops.ends[-1, 2], color=FAINT, linewidth=0.6, alpha=0.7, zorder=1)
        for start, stop in _branches(loops):
            draw(start, stop, color=colour, linewidth=0.6, alpha=0.4, zorder=2)
        start, _, stop = loops.ends[_typical(loops)]
        count = counted(len(loops), "loop", "loops")
        name = f"{plain(label)}, {count}" if len(sets) > 1 else count
        draw(start, stop, color=colour, linewidth=1.3, zorder=3, label=name)
    _mark_means(canvas, axes, sets[0])


def _draw_levels(axes: "Axes", sets: list[Loops], labels: Sequence[str], *, trends: bool) -> None:
    """Draw the loops of several normal loads, each in the colour of its load; a second set is dashed."""
    import matplotlib as mpl

    _frame(axes)
    loads = sets[0].by_load()
    # the light end is left out: it is lost on white
    colours = mpl.colormaps["viridis_r"](np.linspace(0.15, 1.0, len(loads)))
    for order, (loops, label) in enumerate(zip(sets, labels, strict=False)):
        draw = functools.partial(_draw_part, axes, loops)
        if order == 0:
            draw(0, loops.trace.time.size - 1, color=FAINT, linewidth=0.5, alpha=0.6, zorder=1)
        for value, colour in zip(loads.value, colours, strict=True):
            load = np.nanmean(loops.normal_load, axis=1)
            selected = np.flatnonzero(np.abs(load - value) <= loops.definitions.load_share * value)
            name = f"{quantity_text(float(value), 'N', 3)}, {counted(selected.size, 'loop', 'loops')}"
            line: dict[str, Any] = {"color": colour, "linewidth": 1.0, "zorder": 2}
            if order:
                name = plain(label)
                line = {"color": INK, "linewidth": 0.8, "zorder": 3, "linestyle": (0, (3, 1.5))}
            for number, (start, stop) in enumerate(_branches(loops, selected)):
                named = number == 0 and not (order and value > loads.value[0])
                draw(start, stop, label=name if named else None, **line)
    if trends and len(sets) > 1:
        for colour, label in zip(COLOURS, labels, strict=True):
            axes.plot([], [], "o", color=colour, ms=3.5, label=f"{plain(label)}, on the right")


def _frame(axes: "Axes") -> None:
    label_loop(axes)
    axes.margins(0.05, 0.09)
    axes.set_title("Friction loops")


def _draw_part(axes: "Axes", loops: Loops, start: int, stop: int, **line: Any) -> None:
    """Draw a record from one sample to another."""
    x, y = (values[start : stop + 1] for values in (loops.trace.displacement, loops.trace.tangential_load))
    axes.plot(x, y, rasterized=True, solid_joinstyle="round", **line)


def _branches(loops: Loops, which: Integers | None = None) -> list[list[int]]:
    """Return the ends of the branches that are not left out, joined where they follow each other."""
    pieces: list[list[int]] = []
    for loop in range(len(loops)) if which is None else which:
        ends = loops.ends[loop]
        for start, stop in ((ends[0], ends[1]), (ends[1], ends[2])):
            backward = int(loops.trace.displacement[stop] < loops.trace.displacement[start])
            if loops.left_out_branches[loop, backward] or start == stop:
                continue
            if pieces and pieces[-1][1] == start:
                pieces[-1][1] = int(stop)
            else:
                pieces.append([int(start), int(stop)])
    return pieces


def _mark_means(canvas: Canvas, axes: "Axes", loops: Loops) -> None:
    """Mark the means of the first set, at the forward branch of its typical loop and at both of its plateaus."""
    start, turn, stop = loops.ends[_typical(loops)]
    u, f = loops.trace.displacement, loops.trace.tangential_load
    low, high = (start, turn) if u[start] < u[turn] else (turn, stop)
    lower, upper, bottom = u[low], u[high], f[low]
    line: dict[str, Any] = {"color": INK, "linewidth": 0.9, "zorder": 4}

    top, backward = (loops.statistics("friction_force", direction).mean for direction in DIRECTIONS)
    if not np.isfinite([top, backward]).all():
        # without sliding there is no friction force to mark
        return
    axes.plot([lower, upper], [top, top], linestyle=(0, (4, 2)), label="means", **line)
    axes.plot([lower, upper], [-backward, -backward], linestyle=(0, (4, 2)), **line)
    canvas.label(axes, quantity_text(top, "N", 3), (upper, top))
    canvas.label(axes, quantity_text(backward, "N", 3), (lower, -backward))

    displacement = loops.statistics("preliminary_displacement", "forward").mean
    if np.isfinite(displacement):
        middle, reached = bottom + 0.3 * (top - bottom), lower + displacement
        axes.annotate("", xy=(lower, middle), xytext=(reached, middle), arrowprops=SPAN, zorder=4)
        axes.plot([lower, reached], [middle, middle], color=INK, linewidth=0.8, zorder=4)
        axes.plot([reached, reached], [middle, top], color=INK, linewidth=0.5, linestyle=(0, (1, 2)), zorder=4)
        canvas.label(axes, quantity_text(displacement, "m", 3), (reached, middle))
    stiffness = loops.statistics("tangential_stiffness", "forward").mean
    if np.isfinite(stiffness):
        rise = loops.definitions.initial_part * (top - bottom)
        # through the middle of what it was fitted to, and on to where it is seen
        fitted = slice(low, low + max(int((f[low:] >= bottom + rise).argmax()), 1))
        x, y = u[fitted].mean(), f[fitted].mean()
        ends = np.array([bottom, bottom + 0.6 * (top - bottom)])
        axes.plot(x + (ends - y) / stiffness, ends, **line)
        canvas.label(axes, quantity_text(stiffness, "N/m", 3), (x + (ends[1] - y) / stiffness, ends[1]))


def _typical(loops: Loops) -> int:
    """Return the loop of median energy among those that the means are of."""
    energy = np.where(loops.large, loops.dissipated_energy, np.nan)
    evaluated = int(np.isfinite(energy).sum()) or len(loops)
    return int(np.argsort(energy, kind="stable")[(evaluated - 1) // 2])


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopTrendsPicture(Titled):
    """Friction force, preliminary displacement, stiffness and energy of each loop, with their means at one load."""

    kind, of, size, own_figure, headed = "loop-trends", (), (TWO_COLUMNS, 97.0), True, True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the Dataset of `Loops.to_dataset`."""
        grid = canvas.several(len(TRENDS)).subplots(2, 2)
        _draw_trends(grid.ravel(), [data], 2)
        canvas.legend(handles=_direction_handles(), extra=MOVED)


def _direction_handles() -> "list[Artist]":
    from matplotlib.lines import Line2D

    looks: dict[str, Any] = {"linestyle": "", "color": INK, "ms": 3.5}
    return [
        Line2D([], [], marker=marker, label=name, **looks) for marker, name in zip(MARKERS, DIRECTIONS, strict=True)
    ]


def _draw_trends(panels: "Sequence[Axes]", sets: Sequence[xr.Dataset], columns: int) -> None:
    """Draw each of the `TRENDS` in its axes, of one set of loops or of several in their colours."""
    for number, (quantity, axes) in enumerate(zip(TRENDS, panels, strict=True)):
        _draw_trend(axes, sets, quantity)
        if number:
            axes.sharex(panels[0])
        lowest = number >= len(TRENDS) - columns
        axes.tick_params(labelbottom=lowest)
        if lowest:
            axes.set_xlabel(LOOP_NUMBER)


def _draw_trend(axes: "Axes", sets: Sequence[xr.Dataset], quantity: str) -> None:
    from matplotlib.ticker import MaxNLocator

    values = [loops[quantity].values.reshape(loops.sizes["loop"], -1) for loops in sets]
    finite = np.concatenate([array[np.isfinite(array)] for array in values])
    label, unit = (sets[0][quantity].attrs[name] for name in ("long_name", "units"))
    factor, symbol = scale_of(unit, finite)
    position = -1
    for loops, value, colour in zip(sets, values, COLOURS, strict=False):
        # one marker for each direction, or a dot for the whole loop
        markers = MARKERS if value.shape[1] == len(MARKERS) else ("o",)
        for column, marker in zip(value.T, markers, strict=True):
            line: dict[str, Any] = {"color": colour, "ms": 3.5, "mec": "white", "mew": 0.4, "clip_on": False}
            if len(value) > MOST_EDGED:
                line |= {"ms": 1.8, "mew": 0, "rasterized": True}
            marks = axes.plot(loops["loop"].values, column * factor, marker, **line)
            set_side_by_side(marks, position := position + 1, len(sets) * value.shape[1])
        # a mean over several loads says nothing
        if "load_level" not in loops or np.unique(loops["load_level"].values).size == 1:
            axes.axhline(
                LoopStatistics.from_values(of_mean(loops, quantity)).mean * factor,
                color=colour,
                linewidth=0.7,
                zorder=0,
            )
    axes.margins(x=0.08)
    if finite.size:
        low, high = finite.min() * factor, finite.max() * factor
        # a scatter of less than a tenth is not to fill the panel
        room = max(0.2 * (high - low), 0.1 * max(abs(low), abs(high))) or 1.0
        axes.set_ylim(low - room, high + room)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=MOST_TICKS, integer=True))
    axes.set_title(f"{label} ({symbol})", fontsize=7.5, fontweight="normal")


# quantities of a fretting report that are drawn, and their values at the transition to gross slip
FRETTING = {
    "energy_friction_coefficient": None,
    "slip_amplitude": None,
    "energy_ratio": TRANSITION_A,
    "system_free_ratio": TRANSITION_B,
}
DECADES = 100.0  # range of the numbers of runs from which on their axis is logarithmic


@PICTURES.register
@attrs.frozen(kw_only=True)
class FrettingPicture(Titled):
    """Energy friction coefficient, slip amplitude and energy ratios A and B of fretting cycles.

    Lines are the transition from partial slip to gross slip.
    """

    kind, of, size, own_figure, headed = "fretting", (Fretting,), (TWO_COLUMNS, 97.0), True, True

    def draw(self, canvas: Canvas, data: Fretting | xr.Dataset) -> None:
        """Draw a fretting report, or a Dataset of loops or a report."""
        table = data.to_dataset() if isinstance(data, Fretting) else data
        along = "run" if "run" in table.dims else "loop"
        number = table[along].values
        grid = canvas.several(len(FRETTING)).subplots(2, 2, sharex=True)
        for axes, (name, transition) in zip(grid.flat, FRETTING.items(), strict=True):
            factor, symbol = scale_of(table[name].attrs["units"], table[name].values)
            marks: dict[str, Any] = {"color": COLOURS[0], "ms": 3.5, "clip_on": False}
            axes.plot(number, table[name].values * factor, "o", **marks)
            if transition is not None:
                axes.axhline(transition, zorder=0, label="transition to gross slip", **DASHED)
            label = table[name].attrs["long_name"]
            axes.set_title(f"{label} ({symbol})" if symbol else label, fontsize=7.5, fontweight="normal")
            axes.set_ylim(0.0, 1.15 * axes.get_ylim()[1])
            axes.margins(x=0.08)
        if number.min() > 0 and number.max() >= DECADES * number.min():
            grid[0, 0].set_xscale("log")
        for axes in grid[-1]:
            axes.set_xlabel(LOOP_NUMBER if along == "loop" else "run")
        canvas.legend(grid[1, 0])
        if not self.title:
            canvas.heading(str(table.attrs.get("title", "")))


BESIDE = (("forward", "^", STATE_COLOURS[1]), ("backward", "v", STATE_COLOURS[2]), ("both", "o", INK))


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopLevelsPicture(Titled):
    """Friction force, coefficient, preliminary displacement and energy over the normal load, or the amplitude.

    Error bars are the standard deviation of one loop; lines are the laws that were fitted to the means at the loads.
    """

    kind, of, size, own_figure, headed = "loop-levels", (LoopTable,), (TWO_COLUMNS, 122.0), True, True

    def draw(self, canvas: Canvas, data: LoopTable | xr.Dataset) -> None:
        """Draw a table of loops, or the Dataset of its `to_dataset`."""
        table = data.to_dataset() if isinstance(data, LoopTable) else data
        # side by side they are flat, and there is room for one row
        rows = 1 if canvas.height < HIGH or canvas.most < len(LEVELS) else 2
        names = [name.replace("_", " ") for name in LEVELS]
        chosen = LEVELS[: len(canvas.fitting(names, 2 * rows))]
        grid = canvas.several(len(LEVELS)).subplots(rows, 2, sharex=True, squeeze=False)
        for axes, quantity in zip(grid.flat, chosen, strict=True):
            _draw_level(axes, table, quantity)
        along = table[next(name for name in ("level", "amplitude_class") if name in table.coords)]
        for axes in grid[-1]:
            axes.set_xlabel(f"{along.attrs['long_name']} ({format_unit(along.attrs['units'])})")
        canvas.legend(extra=f"bars: standard deviation of one loop; {MOVED}")
        if not self.title:
            canvas.heading(str(table.attrs.get("title", "")))


def _draw_level(axes: "Axes", table: xr.Dataset, quantity: str) -> None:
    values = table[quantity]
    factor, unit = scale_of(values.attrs["units"], values.values)
    by_direction = "direction" in values.dims
    for number, (direction, marker, colour) in enumerate(BESIDE if by_direction else BESIDE[-1:]):
        level_table = table.sel(direction=direction) if by_direction else table
        mean, scatter = (level_table[name].values * factor for name in (quantity, f"{quantity}_standard_deviation"))
        style: dict[str, Any] = {"color": colour, "ms": 4, "mec": "white", "mew": 0.4, "elinewidth": 0.8, "capsize": 2}
        # one loop has a mean and no scatter
        at = table[values.dims[0]].values
        bars = axes.errorbar(at, mean, np.nan_to_num(scatter), fmt=marker, label=direction, **style)
        if by_direction:
            set_side_by_side(bars.get_children(), number, len(BESIDE))
    law = _draw_law(axes, table, quantity, factor)
    title = f"{values.attrs['long_name']} ({unit})" if unit else values.attrs["long_name"]
    axes.set_title("\n".join(filter(None, [title, law])), fontsize=7.5, fontweight="normal")
    # from zero, so that heights compare
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), 1.1 * high)
    axes.margins(x=0.08)


def _draw_law(axes: "Axes", table: xr.Dataset, quantity: str, factor: float) -> str:
    """Draw the law of a quantity, if it has one, and return it."""
    attributes = table.attrs
    along = table[quantity].dims[0]
    load = np.linspace(float(table[along].min()), float(table[along].max()), 60)
    if quantity == "friction_force" and "friction_line_slope" in attributes:
        slope, offset = attributes["friction_line_slope"], attributes["friction_line_intercept"]
        law = slope * load + offset
        text = f"$F$ = {slope:.3g} $N$ {'−' if offset < 0 else '+'} {quantity_text(abs(offset), 'N', 3)}"
    elif f"{quantity}_exponent" in attributes:
        exponent = attributes[f"{quantity}_exponent"]
        law = attributes[f"{quantity}_factor"] * load**exponent
        text = f"∝ $N^{{{exponent:.2f}}}$"
    else:
        return ""
    axes.plot(load, law * factor, zorder=0, **DASHED)
    return text
