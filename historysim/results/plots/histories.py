"""Pictures of a recorded history: friction loop, path in the plane, loads, slip states and stiffness."""

import itertools
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import DIRECTION, Floats
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_any, check_recorded
from historysim.results.analysis.slips import slip_note, slipping_area
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, WIDE, Canvas, Size
from historysim.results.plots.first_loading import check_worn, draw_wear
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import (
    DASHED,
    INK,
    STATE_COLOURS,
    STATES,
    draw_coloured,
    label_loop,
    line_colours,
    patches,
    shown_steps,
    thinned,
    zero_lines,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes

# What panels are called, and the room that each takes at least where they stand below one another [mm].
PANELS = {
    "loop": ("friction loop", 42.0),
    "loads": ("loads", 42.0),
    "states": ("slip states", 34.0),
    "energy": ("energy", 26.0),
    "wear": ("wear", 30.0),
}
# Heights from which on the loads stand beside the loop, and wear stands below them [mm].
HIGH, HIGH_WITH_WEAR = 85.0, 135.0


@PICTURES.register
@attrs.frozen(kw_only=True)
class HistoryPicture(Picture):
    """The friction loop, the loads over time, and the slip state of each asperity.

    Attributes
    ----------
    panels
        Some of ``"loop"``, ``"loads"``, ``"states"``, ``"energy"`` and ``"wear"``, one below the other.
    """

    panels: tuple[str, ...] | None = None

    kind, own_figure, planar, headed = "history", True, True, True
    caption = "The friction loop, the loads over time, and the slip state of each asperity."
    order, needs, caption_lines = (
        1,
        "total_normal_load",
        ("peak normal load", "peak tangential load", "dissipated energy"),
    )

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Return the caption; a history of totals alone has no slip states, and its energy is drawn."""
        first_panel = "path in the plane" if DIRECTION in history.sizes else "friction loop"
        last_panel = "slip state of each asperity" if "slip_state" in history else "dissipated energy"
        return f"The {first_panel}, the loads over time, and the {last_panel}."

    def default_size(self, data: xr.Dataset) -> Size:
        """Return the size of its panels."""
        check_recorded(data)
        if self.panels is not None:
            return TWO_COLUMNS if "states" in self.panels else COLUMN, 70.0 * max(len(self.panels), 1)
        return TWO_COLUMNS, 99.0 + 25.4 * sum(_lower_heights(data))

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw chosen panels, or those that the history has and the size allows."""
        if self.panels is not None:
            self._check_panels(data)
            _draw_panels(canvas, data, list(self.panels))
            return
        asperities = data.sizes.get("asperity", 0) if "slip_state" in data else 0
        panels = ["loop", "loads", "states" if asperities else "energy", *(["wear"] if "worn_volume" in data else [])]
        if data.sizes["step"] == 1:
            # one point is no course
            panels = ["states"] if asperities else ["loop"]
        wide = canvas.width >= WIDE and canvas.height >= HIGH and len(panels) > 1
        if wide:
            room = len(panels) if canvas.height >= HIGH_WITH_WEAR else 3
        else:
            room = sum(24.0 + top <= canvas.height for top in itertools.accumulate(PANELS[name][1] for name in panels))
        fitting = panels[: len(canvas.fitting([PANELS[name][0] for name in panels], room))]
        _draw_panels(canvas, data, fitting, wide=wide and len(fitting) > 1)
        if "loop" in fitting:
            canvas.notice(slip_note(data))

    def _check_panels(self, data: xr.Dataset) -> None:
        panels = self.panels or ()
        if not panels or not {*panels} <= {*PANELS}:
            raise InputError(f"panels is {panels!r}; expected some of {', '.join(PANELS)}")
        if "states" in panels:
            check_recorded(data, "slip_state")
        if "wear" in panels:
            check_worn(data)


def _lower_heights(history: xr.Dataset) -> list[float]:
    """Return the heights of the panels below the loop, over the height of the normal-load panel."""
    rows = history.sizes.get("asperity", 0) if "slip_state" in history else 0
    return [1.5 if rows == 0 else 0.45 + 1.65 * min(rows / 12, 1), *([1.3] if "worn_volume" in history else [])]


def _draw_panels(canvas: Canvas, history: xr.Dataset, panels: list[str], *, wide: bool = False) -> None:
    """Draw panels one below the other, or loads next to the loop and the rest below, with their legends."""
    if wide:
        rows = [["loop", "normal"], ["loop", "tangential"], *([name, name] for name in panels[2:])]
        heights = [1.1, 1.9, *_lower_heights(history)[: len(panels) - 2]]
    else:
        subpanels = {name: ("normal", "tangential") if name == "loads" else (name,) for name in panels}
        rows = [[subpanel] for name in panels for subpanel in subpanels[name]]
        heights = [PANELS[name][1] / len(subpanels[name]) for name in panels for _ in subpanels[name]]
    if len(rows) == 1:
        axes = {rows[0][0]: canvas.axes()}
    else:
        figure = canvas.several(len(rows))
        axes = figure.subplot_mosaic(rows, height_ratios=heights)
    thin = thinned(history)
    for name, panel in axes.items():
        DRAWS[name](panel, history if name in {"states", "wear"} else thin)
    if "normal" in axes:
        axes["normal"].sharex(axes["tangential"])
    canvas.legend(
        handles=patches(STATE_COLOURS, STATES) if "states" in panels else (),
        extra="colour of the loop: time" if "loop" in panels else "",
    )


def _draw_normal_load(axes: "Axes", thin: xr.Dataset) -> None:
    axes.plot(thin["time"], thin["total_normal_load"], color=INK, linewidth=1.0, rasterized=True)
    axes.set(title="Loads", ylabel="normal load\n$N$ (N)", ylim=(0, None))
    axes.tick_params(labelbottom=False)


def _draw_tangential_load(axes: "Axes", thin: xr.Dataset) -> None:
    time, load, limit = (thin[name].values for name in ("time", "total_tangential_load", "friction_limit"))
    axes.plot(time, limit, label="friction limit", rasterized=True, **DASHED)
    axes.plot(time, -limit, rasterized=True, **DASHED)
    if load.ndim > 1:
        for component, label, dashes in zip(load.T, ("$T_x$", "$T_y$"), ("-", (0, (2, 1))), strict=True):
            axes.plot(time, component, color=INK, linestyle=dashes, linewidth=1.0, label=label, rasterized=True)
    else:
        draw_coloured(axes, time, load, time)
    axes.margins(x=0.02)
    axes.set(xlabel="time (s)", ylabel="tangential load\n$T$ (N)")


def _draw_energy(axes: "Axes", thin: xr.Dataset) -> None:
    axes.plot(thin["time"], thin["total_dissipated_energy"], color=INK, linewidth=1.0, rasterized=True)
    axes.margins(x=0.01)
    axes.set(title="Dissipated energy", xlabel="time (s)", ylabel="energy (J)", ylim=(0, None))


def _draw_loop(axes: "Axes", thin: xr.Dataset) -> None:
    """Draw the loop, or the path in the plane, of a thinned history, its colour time."""
    if DIRECTION in thin.sizes:
        _draw_path(axes, thin, "tangential_displacement")
        axes.set_title("Path in the plane")
        return
    label_loop(axes)
    _draw_course(axes, thin["tangential_displacement"].values, thin["total_tangential_load"].values, thin)
    axes.margins(0.06)
    axes.set_title("Friction loop")


def _draw_course(axes: "Axes", x: Floats, y: Floats, thin: xr.Dataset) -> None:
    """Draw a line in the colour of its time, and mark where it starts and ends."""
    draw_coloured(axes, x, y, thin["time"].values)
    for index, marker, name, shade in ((0, "o", "start", 0.0), (-1, "s", "end", 1.0)):
        looks: dict[str, Any] = {"mec": "white", "mew": 0.6, "ms": 5, "label": name, "zorder": 4, "linestyle": ""}
        axes.plot(x[index], y[index], marker=marker, color=line_colours()(shade), **looks)


# What can be drawn in the plane.
OF_VECTORS = {
    "tangential_displacement": "displacement $U_{}$ (m)",
    "total_tangential_load": "tangential load $T_{}$ (N)",
    "drive_displacement": "displacement of the drive $U_{}$ (m)",
}


def _draw_path(axes: "Axes", thin: xr.Dataset, name: str) -> None:
    """Draw a vector of a thinned history as it goes, from start to end."""
    zero_lines(axes)
    x, y = thin[name].values.T
    _draw_course(axes, x, y, thin)
    axes.set(xlabel=OF_VECTORS[name].format("x"), ylabel=OF_VECTORS[name].format("y"))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)


@PICTURES.register
@attrs.frozen(kw_only=True)
class HodographPicture(Picture):
    """The path in the plane, and the tangential load beside it, each as the vector goes; the colour is time.

    The dashed circle is the friction limit at the end, where the load is drawn.

    Attributes
    ----------
    drive
        Whether the path is that of the drive of the instrument, not of the contact.
    """

    drive: bool = False

    kind, size, own_figure, order, only_planar, headed = "hodograph", (TWO_COLUMNS, 80.0), True, 2, True, True
    caption = "The path in the plane, and the tangential load along it; the colour is time."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw both paths."""
        check_recorded(data, "tangential_displacement")
        path = "drive_displacement" if self.drive else "tangential_displacement"
        if path not in data:
            raise InputError("the history has no drive; expected one with an instrument, or drive = false")
        thin = thinned(data)
        path_axes, load_axes = canvas.two(("the path", "the tangential load"), 1.0)
        _draw_path(path_axes, thin, path)
        if load_axes is not None:
            _draw_path(load_axes, thin, "total_tangential_load")
            limit, angle = float(thin["friction_limit"][-1]), np.linspace(0, 2 * np.pi, 200)
            load_axes.plot(limit * np.cos(angle), limit * np.sin(angle), **DASHED)


COLOURS = {"time": "time (s)", "slip": "slipping share of the contact area"}  # what the colour of a loop may show
PIECES_OF_SLIP = 2_000  # pieces of a loop coloured by how much slips, which changes at once at a reversal


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopPicture(Picture):
    """The friction loop, coloured by the share of the contact area that slips.

    Attributes
    ----------
    colour
        ``"slip"``, or ``"time"``.
    """

    colour: str = "slip"

    kind, size, own_figure, order = "loop", (COLUMN, 75.0), True, 3
    caption_lines = ("preliminary displacement", "first to slide")
    caption = "The friction loop, coloured by the share of the contact area that slips."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the tangential load over the tangential displacement."""
        if self.colour not in COLOURS:
            raise InputError(f"colour is {self.colour!r}; expected 'slip' or 'time'")
        check_recorded(data, "tangential_displacement")
        thin = thinned(data)
        values = thin["time"].values
        if self.colour == "slip":
            values = slipping_area(data)[shown_steps(data)]
        axes = canvas.axes()
        label_loop(axes)
        x, y = thin["tangential_displacement"].values, thin["total_tangential_load"].values
        line = draw_coloured(axes, x, y, values, pieces=PIECES_OF_SLIP)
        if self.colour == "slip":
            line.set_clim(0, 1)
        axes.margins(0.06)
        canvas.figure.colorbar(line, ax=axes, location="top", aspect=40, pad=0.03, label=COLOURS[self.colour])
        canvas.notice(slip_note(data))


MOST_COLUMNS, MOST_ROWS = 2_000, 1_000  # steps and asperities that a map of slip states shows


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipMapPicture(Picture):
    """The slip state of each asperity at each step, the highest asperity on top."""

    kind, size, own_figure, planar, headed = "slip-map", (TWO_COLUMNS, 75.0), True, True, True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the map; of a large history every so many-th step and asperity."""
        check_recorded(data, "slip_state")
        check_any(data)
        _draw_slip_map(canvas.axes(), data)
        canvas.legend(handles=patches(STATE_COLOURS, STATES))


def _draw_slip_map(axes: "Axes", history: xr.Dataset) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    steps, count = history.sizes["step"], history.sizes["asperity"]
    step_stride, row_stride = -(-steps // MOST_COLUMNS), -(-count // MOST_ROWS)
    by_height = np.argsort(-history["summit_height"].values, kind="stable")[::row_stride]
    drawn_states = history["slip_state"].isel(step=slice(None, None, step_stride))
    # of a file whole rows are read faster than scattered columns
    from_file = "source" in drawn_states.encoding
    states = (drawn_states.values[:, by_height] if from_file else drawn_states.isel(asperity=by_height).values).T
    looks: dict[str, Any] = {"cmap": ListedColormap(list(STATE_COLOURS)), "vmin": -0.5, "vmax": 3.5}
    extent = (-0.5, steps - 0.5, count + 0.5, 0.5)
    axes.imshow(states, aspect="auto", interpolation="nearest", extent=extent, **looks)
    axes.spines[["top", "right"]].set_visible(True)
    if count <= 12:
        labels = history["asperity"].values[by_height]
        axes.set_yticks(range(1, count + 1, row_stride), [str(label) for label in labels])
        axes.set_ylabel("asperity")
    else:
        axes.set_ylabel("asperities by height,\nhighest on top")
    time = history["time"].values

    def named(step: float, _: int) -> str:
        return f"{step:.0f}\n{time[int(step)]:.4g}" if 0 <= step < steps else ""

    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.xaxis.set_major_formatter(FuncFormatter(named))
    axes.set(title="Slip state", xlabel="step, and below it time (s)")


@PICTURES.register
@attrs.frozen(kw_only=True)
class StiffnessPicture(Picture):
    """The tangential load over the displacement, and the tangential stiffness below it; the colour is time."""

    kind, size, own_figure = "stiffness", (COLUMN, 110.0), True
    caption = "The tangential load over the displacement, and the tangential stiffness."
    order, needs = 4, "total_normal_load"

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Return the caption with the greatest stiffness."""
        greatest = float(np.nanmax(history["tangential_stiffness"].values, initial=0.0))
        return f"{cls.caption.removesuffix('.')}, up to {quantity_text(greatest, 'N/m', 3)}."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw both."""
        check_recorded(data, "tangential_stiffness")
        thin = thinned(data)
        figure = canvas.several()
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.3, 1))
        for axes, name in ((upper, "total_tangential_load"), (lower, "tangential_stiffness")):
            zero_lines(axes, vertical=axes is upper)
            line = draw_coloured(axes, thin["tangential_displacement"].values, thin[name].values, thin["time"].values)
            axes.margins(0.04, 0.06)
        upper.set_ylabel("tangential load $T$ (N)")
        lower.set(xlabel="tangential displacement $U$ (m)", ylabel=r"stiffness $\mathrm{d}T/\mathrm{d}U$ (N/m)")
        figure.colorbar(line, ax=[upper, lower], location="top", aspect=40, pad=0.02, label="time (s)")


# What draws a panel of the history picture, of the history or of its thinned totals.
DRAWS: "dict[str, Callable[[Axes, xr.Dataset], None]]" = {
    "loop": _draw_loop,
    "normal": _draw_normal_load,
    "tangential": _draw_tangential_load,
    "states": _draw_slip_map,
    "energy": _draw_energy,
    "wear": draw_wear,
}
