"""Pictures of a recorded history: friction loop, loads, slip states, stiffness, wear and yielding."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import DIRECTION, Floats
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_any, check_recorded, shape_of
from historysim.results.analysis.slips import slip_note, slip_shares
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, WIDE, Canvas, Size
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.planar_pictures import draw_components, draw_path
from historysim.results.plots.style import (
    FAINT,
    INK,
    MARK,
    STATE_COLOURS,
    STATES,
    draw_coloured,
    kept_steps,
    label_loop,
    line_colours,
    line_style,
    patches,
    scale_of,
    scaled,
    swings,
    thinned,
    zero_lines,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS = ("loop", "loads", "states", "energy", "wear")
# Heights from which on the loads stand beside the loop, and wear stands below them [mm].
HIGH, HIGH_WITH_WEAR = 85.0, 135.0
# Room that each panel takes at least where they stand below one another [mm].
HEIGHTS = {"loop": 42.0, "loads": 42.0, "states": 34.0, "energy": 26.0, "wear": 30.0}
CALLED = {"loop": "friction loop", "loads": "loads", "states": "slip states", "energy": "energy", "wear": "wear"}


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

    kind, alone, planar = "history", True, True
    caption = "The friction loop, the loads over time, and the slip state of each asperity."
    order, needs, found = 1, "total_normal_load", ("peak normal load", "peak tangential load", "dissipated energy")

    @classmethod
    def caption_of(cls, history: xr.Dataset) -> str:
        """Return the caption; a history of totals alone has no slip states, and its energy is drawn."""
        first = "path in the plane" if DIRECTION in history.sizes else "friction loop"
        last = "slip state of each asperity" if "slip_state" in history else "dissipated energy"
        return f"The {first}, the loads over time, and the {last}."

    def size_of(self, data: xr.Dataset) -> Size:
        """Return the size of its panels."""
        check_recorded(data)
        if self.panels is not None:
            return TWO_COLUMNS if "states" in self.panels else COLUMN, 70.0 * max(len(self.panels), 1)
        return TWO_COLUMNS, 99.0 + 25.4 * sum(_lower_heights(data))

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw chosen panels, or those that the history has and the size allows."""
        thin = thinned(data)
        if self.panels is not None:
            _check_panels(data, self.panels)
            _draw_panels(canvas, data, thin, self.panels)
            return
        asperities = data.sizes.get("asperity", 0) if "slip_state" in data else 0
        shown = ["loop", "loads", "states" if asperities else "energy", *(["wear"] if "worn_volume" in data else [])]
        if thin.sizes["step"] == 1:
            # one point is no course
            shown = ["states"] if asperities else shown[:1]
        wide = canvas.width >= WIDE and canvas.height >= HIGH and len(shown) > 1
        first = shown if canvas.height >= HIGH_WITH_WEAR else shown[:3]
        room = len(first) if wide else _room(shown, canvas.height)
        fitting = shown[: len(canvas.fitting([CALLED[name] for name in shown], room))]
        _draw_panels(canvas, data, thin, fitting, wide=wide and len(fitting) > 1)
        if "loop" in fitting:
            canvas.notice(slip_note(data))
        canvas.heading(str(data.attrs.get("title", "")))


def _lower_heights(history: xr.Dataset) -> list[float]:
    """Return the heights of what stands below the loop, over that of the normal load."""
    rows = history.sizes.get("asperity", 0) if "slip_state" in history else 0
    return [1.5 if rows == 0 else 0.45 + 1.65 * min(rows / 12, 1), *([1.3] if "worn_volume" in history else [])]


def _room(panels: Sequence[str], height: float) -> int:
    """Return how many of some panels there is room for, below one another."""
    return sum(24.0 + each <= height for each in itertools.accumulate(HEIGHTS[name] for name in panels))


def _draw_panels(
    canvas: Canvas, history: xr.Dataset, thin: xr.Dataset, panels: Sequence[str], *, wide: bool = False
) -> None:
    """Draw panels one below the other, or the loads beside the loop and the others below, and name what is in them."""
    if wide:
        rows: Any = [["loop", "normal"], ["loop", "tangential"], *([name, name] for name in panels[2:])]
        heights = [1.1, 1.9, *_lower_heights(history)[: len(panels) - 2]]
    else:
        parts = {name: ("normal", "tangential") if name == "loads" else (name,) for name in panels}
        rows = [[part] for name in panels for part in parts[name]]
        heights = [HEIGHTS[name] / len(parts[name]) for name in panels for _ in parts[name]]
    if len(rows) == 1:
        axes = {rows[0][0]: canvas.axes()}
    else:
        axes = canvas.several(len(rows)).subplot_mosaic(rows, height_ratios=heights)
    for name, each in axes.items():
        DRAWS[name](each, history, thin)
    if "normal" in axes:
        axes["normal"].sharex(axes["tangential"])
    canvas.legend(
        *axes.values(),
        handles=patches(STATE_COLOURS, STATES) if "states" in panels else (),
        extra="colour of the loop: time" if "loop" in panels else "",
    )


def _check_panels(history: xr.Dataset, panels: Sequence[str]) -> None:
    unknown = [name for name in panels if name not in PANELS]
    if unknown or not panels or isinstance(panels, str):
        raise InputError(f"panels is {panels!r}; expected some of {', '.join(PANELS)}")
    if "states" in panels:
        check_recorded(history, "slip_state")
    if "wear" in panels:
        check_worn(history)


def _draw_normal_load(axes: "Axes", thin: xr.Dataset) -> None:
    load, unit = scaled(thin["total_normal_load"].values, "N")
    axes.plot(thin["time"].values, load, color=INK, linewidth=1.0, rasterized=True)
    axes.set(title="Loads", ylabel=f"normal load\n$N$ ({unit})", ylim=(0, None))
    axes.tick_params(labelbottom=False)


def _draw_tangential_load(axes: "Axes", thin: xr.Dataset) -> None:
    time, load, limit = (thin[name].values for name in ("time", "total_tangential_load", "friction_limit"))
    factor, unit = scale_of("N", load, limit)
    for sign, label in ((1, "friction limit"), (-1, None)):
        dashes: dict[str, Any] = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4, 2)), "rasterized": True}
        axes.plot(time, sign * limit * factor, label=label, **dashes)
    if load.ndim > 1:
        draw_components(axes, thin, factor)
    else:
        draw_coloured(axes, time, load * factor, time)
    axes.margins(x=0.02)
    axes.set(xlabel="time (s)", ylabel=f"tangential load\n$T$ ({unit})")


def _draw_energy(axes: "Axes", thin: xr.Dataset) -> None:
    energy, unit = scaled(thin["total_dissipated_energy"].values, "J")
    axes.plot(thin["time"].values, energy, color=INK, linewidth=1.0, rasterized=True)
    axes.margins(x=0.01)
    axes.set(title="Dissipated energy", xlabel="time (s)", ylabel=f"energy ({unit})", ylim=(0, None))


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

    kind, size, alone, order = "loop", (COLUMN, 75.0), True, 3
    found = ("preliminary displacement", "first to slide")
    caption = "The friction loop, coloured by the share of the contact area that slips."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the tangential load over the tangential displacement."""
        if self.colour not in COLOURS:
            raise InputError(f"colour is {self.colour!r}; expected 'slip' or 'time'")
        check_recorded(data, "tangential_displacement")
        thin = thinned(data)
        values = thin["time"].values
        if self.colour == "slip":
            values = slip_shares(data)["slipping_area"].values[kept_steps(data.sizes["step"])]
        axes = canvas.axes()
        x, y = _loop_of(axes, thin)
        line = draw_coloured(axes, x, y, values, pieces=PIECES_OF_SLIP)
        if self.colour == "slip":
            line.set_clim(0, 1)
        axes.margins(0.06)
        canvas.figure.colorbar(line, ax=axes, location="top", aspect=40, pad=0.03, label=COLOURS[self.colour])
        canvas.notice(slip_note(data))


def _draw_loop(axes: "Axes", thin: xr.Dataset) -> None:
    """Draw the loop of a thinned history into axes, its colour time, with arrows and marks at start and end."""
    if DIRECTION in thin.sizes:
        draw_path(axes, thin)
        axes.set_title("Path in the plane")
        return
    time = thin["time"].values
    displacement, force = _loop_of(axes, thin)
    draw_coloured(axes, displacement, force, time)
    _draw_arrows(axes, displacement, force, time)
    for index, marker, name, shade in ((0, "o", "start", 0.0), (-1, "s", "end", 1.0)):
        looks: dict[str, Any] = {"mec": "white", "mew": 0.6, "ms": 5, "label": name, "zorder": 4, "linestyle": ""}
        axes.plot(displacement[index], force[index], marker=marker, color=line_colours()(shade), **looks)
    axes.margins(0.06)
    axes.set_title("Friction loop")


def _loop_of(axes: "Axes", thin: xr.Dataset) -> tuple[Floats, Floats]:
    """Label axes of a loop, and return displacement and load in their units."""
    displacement, load = thin["tangential_displacement"].values, thin["total_tangential_load"].values
    length, force = label_loop(axes, [displacement], [load])
    return displacement * length, load * force


def _draw_arrows(axes: "Axes", x: Floats, y: Floats, time: Floats) -> None:
    """Mark the direction in the middle of the last swing each way."""
    for start, end in list(swings(x))[-2:]:
        middle = start + int(np.abs(x[start : end + 1] - (x[start] + x[end]) / 2).argmin())
        behind = max(middle - max((end - start) // 50, 1), start)
        colour = line_colours()((time[middle] - time[0]) / max(time[-1] - time[0], 1e-300))
        arrow = {"arrowstyle": "-|>", "color": colour, "mutation_scale": 11, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", xy=(x[middle], y[middle]), xytext=(x[behind], y[behind]), arrowprops=arrow)


MOST_COLUMNS, MOST_ROWS = 2_000, 1_000  # steps and asperities that a map of slip states shows


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipMapPicture(Picture):
    """The slip state of each asperity at each step, the highest asperity on top."""

    kind, size, alone, planar = "slip-map", (TWO_COLUMNS, 75.0), True, True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the map; of a large history every so many-th step and asperity."""
        check_recorded(data, "slip_state")
        check_any(data)
        _draw_slip_map(canvas.axes(), data)
        canvas.legend(handles=patches(STATE_COLOURS, STATES))
        canvas.heading(str(data.attrs.get("title", "")))


def _draw_slip_map(axes: "Axes", history: xr.Dataset) -> None:
    from matplotlib.colors import ListedColormap

    steps, count = history.sizes["step"], history.sizes["asperity"]
    step_stride, row_stride = -(-steps // MOST_COLUMNS), -(-count // MOST_ROWS)
    by_height = np.argsort(-history["summit_height"].values, kind="stable")[::row_stride]
    states = history["slip_state"].isel(step=slice(None, None, step_stride)).values[:, by_height].T
    axes.imshow(
        states,
        cmap=ListedColormap(list(STATE_COLOURS)),
        vmin=-0.5,
        vmax=3.5,
        aspect="auto",
        interpolation="nearest",
        extent=(-0.5, steps - 0.5, count + 0.5, 0.5),
    )
    axes.spines[["top", "right"]].set_visible(True)
    if count <= 12:
        labels = history["asperity"].values[by_height]
        axes.set_yticks(range(1, count + 1, row_stride), [str(label) for label in labels])
        axes.set_ylabel("asperity")
    else:
        axes.set_ylabel("asperities by height,\nhighest on top")
    _mark_steps_and_times(axes, history)
    axes.set_title("Slip state")


TIME_TICKS = 7  # most ticks of the axis of time below that of the steps


def _mark_steps_and_times(axes: "Axes", history: xr.Dataset) -> None:
    """Label an axis of steps, and draw an axis of their times 13 pt below it, with round times."""
    from matplotlib.ticker import MaxNLocator

    time = history["time"].values
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if time.size < 2:
        axes.set_xlabel(f"step, at {time[0]:.4g} s")
        return
    below = axes.secondary_xaxis("bottom")
    below.spines["bottom"].set_position(("outward", 13.0))
    below.spines["bottom"].set_visible(False)
    below.tick_params(length=0)
    ticks = list(_round_times(time))
    below.set_xticks(np.interp(ticks, time, np.arange(time.size)), [f"{tick:.6g}" for tick in ticks])
    below.set_xlabel("step, and below it time (s)")


def _round_times(time: Floats) -> Iterator[float]:
    """Yield round times that are apart on an axis of steps: where the clock jumps, fewer of them."""
    from matplotlib.ticker import MaxNLocator

    last = -np.inf
    for tick in MaxNLocator(TIME_TICKS).tick_values(time[0], time[-1]):
        at = float(np.interp(tick, time, np.arange(time.size)))
        if time[0] <= tick <= time[-1] and at - last >= (time.size - 1) / (TIME_TICKS + 1):
            last = at
            yield float(tick)


@PICTURES.register
@attrs.frozen(kw_only=True)
class StiffnessPicture(Picture):
    """The tangential load over the displacement, and the tangential stiffness below it; the colour is time."""

    kind, size, alone = "stiffness", (COLUMN, 110.0), True
    caption = "The tangential load over the displacement, and the tangential stiffness."
    order, needs = 4, "total_normal_load"

    @classmethod
    def caption_of(cls, history: xr.Dataset) -> str:
        """Return the caption with the greatest stiffness."""
        greatest = float(np.nanmax(history["tangential_stiffness"].values, initial=0.0))
        return f"{cls.caption.removesuffix('.')}, up to {quantity_text(greatest, 'N/m', 3)}."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw both."""
        check_recorded(data, "tangential_stiffness")
        thin = thinned(data)
        displacement, length_unit = scaled(thin["tangential_displacement"].values, "m")
        figure: Any = canvas.several()
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.3, 1))
        for axes, name, label, unit in (
            (upper, "total_tangential_load", "tangential load $T$", "N"),
            (lower, "tangential_stiffness", r"stiffness $\mathrm{d}T/\mathrm{d}U$", "N/m"),
        ):
            values, known = scaled(thin[name].values, unit)
            zero_lines(axes, vertical=axes is upper)
            line = draw_coloured(axes, displacement, values, thin["time"].values)
            axes.margins(0.04, 0.06)
            axes.set_ylabel(f"{label} ({known})")
        lower.set_xlabel(f"tangential displacement $U$ ({length_unit})")
        figure.colorbar(line, ax=[upper, lower], location="top", aspect=40, pad=0.02, label="time (s)")


MOST_WORN = 8  # asperities with a line of their own: those that lose most


@PICTURES.register
@attrs.frozen(kw_only=True)
class WearPicture(Picture):
    """The volume that asperities lose, and their summits before and after."""

    kind, size, alone = "wear", (TWO_COLUMNS, 75.0), True
    caption = "The volume that the asperities lose, and their summits before and after."
    order, needs, found = 8, "worn_volume", ("worn volume",)

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the volume over time, and the summits."""
        check_worn(data)
        left, right = canvas.two(("wear", "summits"), 1.5)
        _draw_wear(left, data)
        every = np.ones(data.sizes["asperity"], dtype=bool)
        _finish_beside(canvas, left, right, data, every, "Summits", (MARK, STATE_COLOURS[2]))


def _finish_beside(
    canvas: Canvas,
    left: "Axes",
    right: "Axes | None",
    history: xr.Dataset,
    which: Any,
    title: str,
    colours: tuple[str, str],
) -> None:
    """Draw summits on the right, if there is room, and name what both panels show."""
    if right is not None:
        _draw_summits(right, history, which, colours)
        right.set_title(title)
    canvas.legend(*(left, right) if right is not None else (left,))
    canvas.heading(str(history.attrs.get("title", "")))


def check_worn(history: xr.Dataset) -> None:
    """Check that a history holds what its asperities lose."""
    if "worn_volume" not in history:
        raise InputError("the history has no worn_volume; expected one of a scenario with [wear], with its asperities")


def _draw_wear(axes: "Axes", history: xr.Dataset) -> None:
    """Draw the worn volume of all asperities, and of those that lose most, over time."""
    kept = kept_steps(history.sizes["step"])
    time, worn = history["time"].values[kept], history["worn_volume"].isel(step=kept).values
    total = worn.sum(axis=1)
    # µm³ for those with a micrometre to wear: prefixes of cubes are read with the metre
    factor, unit = (1e27, "nm³") if total.max(initial=0.0) < 1e-21 else (1e18, "µm³")
    axes.plot(time, total * factor, color=INK, linewidth=1.3, label="all")
    most = np.argsort(-worn[-1], kind="stable")[: min(MOST_WORN, worn.shape[1])]
    most = most[worn[-1, most] > 0]
    if worn.shape[1] > 1:
        for number, column in enumerate(most):
            name = f"asperity {int(history['asperity'].values[column])}"
            axes.plot(time, worn[:, column] * factor, label=name, **line_style(number, most.size))
    axes.set(title="Wear", xlabel="time (s)", ylabel=f"worn volume ({unit})", ylim=(0, None))
    axes.margins(x=0.01)


def _draw_summits(axes: "Axes", history: xr.Dataset, which: Any, colours: tuple[str, str]) -> None:
    """Draw radii over heights of some summits, at the start and at the end."""
    before = [history[f"summit_{name}"].values[which] for name in SHAPE]
    after = [shape_of(history, f"summit_{name}", -1)[which] for name in SHAPE]
    found = [np.stack(each) for each in zip(before, after, strict=True)]
    (heights, unit), (radii, radius_unit) = (scaled(each, "m") for each in found)
    if colours[0] == colours[1]:
        axes.plot(heights, radii, "-", color="0.75", linewidth=0.6)
    for row, (marker, colour, name) in enumerate(zip("os", colours, ("before", "after"), strict=True)):
        axes.plot(heights[row], radii[row], marker, ms=4, mfc="none", color=colour, label=name)
    if np.ptp(radii) <= 1e-12 * radii.max(initial=0.0):
        axes.set_ylim(0, 2 * radii.max(initial=1.0))
    axes.set(xlabel=f"summit height $z$ ({unit})", ylabel=f"summit radius $R$ ({radius_unit})")


SHAPE = ("height", "radius")


@PICTURES.register
@attrs.frozen(kw_only=True)
class YieldingPicture(Picture):
    """The curve of first loading and unloading, and the summits that yielded, before and after."""

    kind, size, alone = "yielding", (TWO_COLUMNS, 75.0), True
    caption = "First loading and unloading, and the summits that yielded, before and after."
    order, needs = 7, "yielded_depth"

    @classmethod
    def caption_of(cls, history: xr.Dataset) -> str:
        """Return the caption with how many summits yielded."""
        yielded = history["yielding_load"].isel(step=-1).values > 0
        return f"{cls.caption.removesuffix('.')}: {np.count_nonzero(yielded)} of {yielded.size} asperities."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the normal load over the approach, where summits yield and where they do not, and the summits."""
        if "yielded_depth" not in data:
            raise InputError(
                "the history has no yielded_depth; expected one of a scenario with surface.yielding, "
                "with its asperities"
            )
        kept = kept_steps(data.sizes["step"])
        approach = data["summit_height"].values.max() - data["separation"].values[kept]
        lengths, length_unit = scaled(approach, "m")
        loads, load_unit = scaled(data["total_normal_load"].values[kept], "N")
        yields = np.diff(data["total_yielding_energy"].values[kept]) > 0
        left, right = canvas.two(("first loading", "summits that yielded"), 1.3)
        thick: dict[str, Any] = {"linewidth": 1.8, "color": INK, "label": "summits yield"}
        thin: dict[str, Any] = {"linewidth": 0.9, "color": "0.45", "linestyle": (0, (4, 2)), "label": "elastic"}
        for chosen, looks in ((yields, thick), (~yields, thin)):
            if not chosen.any():
                continue
            x, y = (np.where(chosen, [each[:-1], each[1:]], np.nan) for each in (lengths, loads))
            gap = np.full(chosen.size, np.nan)
            left.plot(np.stack([*x, gap]).T.ravel(), np.stack([*y, gap]).T.ravel(), **looks)
        left.set(xlabel=f"approach of the highest summit ({length_unit})", ylabel=f"normal load $N$ ({load_unit})")
        left.set_title("First loading, unloading")
        yielded = data["yielding_load"].isel(step=-1).values > 0
        _finish_beside(canvas, left, right, data, yielded, "Summits that yielded", (INK, INK))


# What draws a panel of the history picture, of the history and of its thinned totals.
DRAWS: "dict[str, Callable[[Axes, xr.Dataset, xr.Dataset], None]]" = {
    "loop": lambda axes, _, thin: _draw_loop(axes, thin),
    "normal": lambda axes, _, thin: _draw_normal_load(axes, thin),
    "tangential": lambda axes, _, thin: _draw_tangential_load(axes, thin),
    "states": lambda axes, history, _: _draw_slip_map(axes, history),
    "energy": lambda axes, _, thin: _draw_energy(axes, thin),
    "wear": lambda axes, history, _: _draw_wear(axes, history),
}
