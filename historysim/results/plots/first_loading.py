"""Pictures of first loading, wear and yielding: curves beside theory, area laws, summits before and after."""

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Booleans, Floats
from historysim.basics.units import range_text
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.interaction.areas import area_laws
from historysim.results.analysis.recorded import shape_in_step
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Canvas
from historysim.results.plots.pictures import HISTORY, PICTURES, SCENARIO, Panel, Picture, Titled, as_history_list
from historysim.results.plots.style import (
    FAINT,
    INK,
    LINES,
    MARK,
    STATE_COLOURS,
    by_factors,
    format_unit,
    line_style,
    shown_steps,
)
from historysim.results.plots.surfaces import step_number
from historysim.results.rebuilt import load_curve, sliding_displacements
from historysim.surfaces.heights import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVES = {
    "normal_load": "normal load $N$",
    "contact_area": "contact area $A$",
    "normal_stiffness": r"stiffness $\mathrm{d}N/\mathrm{d}\delta$",
}
# Of what stands around the panels, and of a panel at least [mm]; those that have no room are left out.
AROUND, PANEL_HEIGHT = 25.0, 25.0
MOST_WORN = 8  # asperities with a line of their own: those that lose most
SHARES = np.linspace(0.0, 1.0, 201)
MOST_MARKED = 100  # asperities up to which each has a mark
THEORY: dict[str, Any] = {"color": LINES[1][0], "linestyle": "--"}


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoadCurvePicture(Picture):
    """Normal load, contact area and normal stiffness over the approach, beside Hertz or Greenwood and Williamson."""

    kind, size, own_figure, headed = "load-curve", (COLUMN, 140.0), True, True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw a panel for each, below one another."""
        curve = load_curve(data)
        names = [name for name in CURVES if name in curve]
        called = [str(curve[name].attrs["long_name"]) for name in names]
        fitting = canvas.fitting(called, int((canvas.height - AROUND) / PANEL_HEIGHT))
        figure = canvas.several()
        panels = figure.subplots(len(fitting), 1, sharex=True, squeeze=False)[:, 0]
        for axes, name in zip(panels, names, strict=False):
            axes.plot(curve["approach"], curve[name], color=LINES[0][0], label="this contact")
            if f"theory_{name}" in curve:
                axes.plot(curve["approach"], curve[f"theory_{name}"], label=curve.attrs["theory"], **THEORY)
            axes.set(ylabel=f"{CURVES[name]} ({format_unit(curve[name].attrs['units'])})", ylim=(0, None))
        panels[-1].set(xlabel=r"approach $\delta$ of the highest summit (m)", xlim=(0, curve["approach"][-1]))


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlidingOrderPicture(Panel):
    """Tangential displacement at which a share of the asperities in contact slides, beside theory.

    Of several histories, such as of several surfaces, their median and the range of 10 to 90 % of them, beside the mean
    of the theory.

    Attributes
    ----------
    step
        Number of a step, or ``"peak"`` (greatest normal load).
    """

    step: int | str = "peak"

    kind, of, accepts_several = "sliding-order", (HISTORY,), True

    def draw(self, canvas: Canvas, data: Any) -> None:
        """Draw a step for each asperity, Greenwood and Williamson's curve, and the line of equal asperities."""
        orders = [sliding_displacements(history, step_number(self.step, history)) for history in as_history_list(data)]
        if not all(order.sizes["rank"] for order in orders):
            raise InputError("nothing touches at that step; expected one at which asperities are in contact")
        axes, (colour, _, marker) = canvas.axes(), LINES[0]
        if len(orders) == 1:
            count = orders[0].sizes["rank"]
            share = 100 * np.arange(1, count + 1) / count
            looks: dict[str, Any] = {"marker": marker, "ms": 2.5} if count <= MOST_MARKED else {}
            looks |= {"drawstyle": "steps-post", "color": colour, "label": f"{count} asperities"}
            axes.plot(share, orders[0]["displacement"], **looks)
        else:
            curves = [_of_share(order["displacement"].values) for order in orders]
            low, middle, high = np.quantile(curves, (0.1, 0.5, 0.9), axis=0)
            axes.fill_between(100 * SHARES, low, high, color=colour, alpha=0.2, lw=0, label="10 to 90 % of them")
            axes.plot(100 * SHARES, middle, color=colour, label=f"median of {len(orders)} surfaces")
        if all("greenwood_williamson" in order for order in orders):
            theory = np.mean([_of_share(order["greenwood_williamson"].values) for order in orders], axis=0)
            axes.plot(100 * SHARES, theory, label="Greenwood and Williamson", **THEORY)
        equal = float(np.mean([order.attrs["equal_asperities"] for order in orders]))
        axes.axhline(equal, color=FAINT, linestyle=":", label="equal asperities", zorder=0)
        axes.set(xlabel="asperities in contact that slide (%)", ylabel="tangential displacement (m)")
        axes.set(xlim=(0, 100), ylim=(0, None))


def _of_share(displacement: Any) -> Any:
    """Return at which displacement shares of the asperities slide: straight between the k-th and the next."""
    count = len(displacement)
    return np.interp(SHARES, (np.arange(count) + 0.5) / count, displacement)


@PICTURES.register
@attrs.frozen(kw_only=True)
class WearPicture(Picture):
    """The volume that asperities lose, and their summits before and after."""

    kind, size, own_figure, headed = "wear", (TWO_COLUMNS, 75.0), True, True
    caption = "The volume that the asperities lose, and their summits before and after."
    order, needs, caption_lines = 8, "worn_volume", ("worn volume",)

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw the volume over time, and the summits."""
        check_worn(data)
        wear_axes, summit_axes = canvas.two(("wear", "summits"), 1.5)
        draw_wear(wear_axes, data)
        if summit_axes is not None:
            _draw_summits(summit_axes, data, slice(None), (MARK, STATE_COLOURS[2]))


def check_worn(history: xr.Dataset) -> None:
    """Check that a history records the wear of its asperities."""
    if "worn_volume" not in history:
        raise InputError("the history has no worn_volume; expected one of a scenario with [wear], with its asperities")


def draw_wear(axes: "Axes", history: xr.Dataset) -> None:
    """Draw the worn volume of all asperities, and of those that lose most, over time."""
    steps = shown_steps(history)
    time, worn = history["time"].values[steps], history["worn_volume"].isel(step=steps).values
    axes.plot(time, worn.sum(axis=1), color=INK, linewidth=1.3, label="all")
    if worn.shape[1] > 1:
        selected = np.argsort(-worn[-1], kind="stable")[:MOST_WORN]
        selected = selected[worn[-1, selected] > 0]
        for number, column in enumerate(selected):
            name = f"asperity {int(history['asperity'][column])}"
            axes.plot(time, worn[:, column], label=name, **line_style(number, selected.size))
    axes.set(title="Wear", xlabel="time (s)", ylabel="worn volume (m³)", ylim=(0, None))
    axes.margins(x=0.01)


def _draw_summits(axes: "Axes", history: xr.Dataset, which: Any, colours: tuple[str, str]) -> None:
    """Draw radii over heights of some summits, at the start and at the end."""
    virgin = [history[f"summit_{name}"].values[which] for name in ("height", "radius")]
    worn = [shape_in_step(history, f"summit_{name}", -1)[which] for name in ("height", "radius")]
    heights, radii = np.stack([virgin, worn], axis=1)
    if colours[0] == colours[1]:
        axes.plot(heights, radii, "-", color="0.75", linewidth=0.6)
    for row, (marker, colour, name) in enumerate(zip("os", colours, ("before", "after"), strict=True)):
        axes.plot(heights[row], radii[row], marker, ms=4, mfc="none", color=colour, label=name)
    if np.ptp(radii) <= 1e-12 * radii.max(initial=0.0):
        axes.set_ylim(0, 2 * radii.max(initial=0.0) or 1.0)
    axes.set(title="Summits", xlabel="summit height $z$ (m)", ylabel="summit radius $R$ (m)")


@PICTURES.register
@attrs.frozen(kw_only=True)
class YieldingPicture(Picture):
    """The curve of first loading and unloading, and the summits that yielded, before and after."""

    kind, size, own_figure, headed = "yielding", (TWO_COLUMNS, 75.0), True, True
    caption = "First loading and unloading, and the summits that yielded, before and after."
    order, needs = 7, "yielded_depth"

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
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
        steps = shown_steps(data)
        approach = data["summit_height"].values.max() - data["separation"].values[steps]
        load = data["total_normal_load"].values[steps]
        yields = np.diff(data["total_yielding_energy"].values[steps]) > 0
        load_axes, summit_axes = canvas.two(("first loading", "summits that yielded"), 1.3)
        thick: dict[str, Any] = {"linewidth": 1.8, "color": INK, "label": "summits yield"}
        thin: dict[str, Any] = {"linewidth": 0.9, "color": "0.45", "linestyle": (0, (4, 2)), "label": "elastic"}
        for chosen, looks in ((yields, thick), (~yields, thin)):
            if chosen.any():
                # a piece from each step to the next, and a gap behind it
                x, y = (np.where(chosen, [values[:-1], values[1:]], np.nan) for values in (approach, load))
                x, y = (np.pad(values, ((0, 1), (0, 0)), constant_values=np.nan) for values in (x, y))
                load_axes.plot(x.T.ravel(), y.T.ravel(), **looks)
        load_axes.set(xlabel="approach of the highest summit (m)", ylabel="normal load $N$ (N)")
        load_axes.set_title("First loading, unloading")
        if summit_axes is not None:
            _draw_summits(summit_axes, data, data["yielding_load"].isel(step=-1).values > 0, (INK, INK))
            summit_axes.set_title("Summits that yielded")


@attrs.frozen(eq=False)
class PressedMap:
    """A height map, the pair of materials, the loads at which its contact area is drawn [N], and a hardness [Pa]."""

    surface: Surface
    pair: MaterialPair
    normal_load: Floats
    hardness: float | None


@PICTURES.register
@attrs.frozen(kw_only=True)
class AreaLawsPicture(Titled):
    """Real contact area of a map over the normal load by the laws in use, bold where each holds, within 20 %.

    The laws stand beside the summits of the map and its fully interacting solution; `hs.area_laws` has the numbers.
    Loads go up to the greatest of the scenario.

    Attributes
    ----------
    whole_map
        Solve the whole map, which takes seconds to minutes. Without it no law is said to hold.
    """

    whole_map: bool = True

    kind, of, size, own_figure = "area-laws", (PressedMap, SCENARIO), (1.4 * COLUMN, 105.0), True

    def draw(self, canvas: Canvas, data: PressedMap) -> None:
        """Draw a line for each law."""
        laws = area_laws(data.surface, data.pair, data.normal_load, hardness=data.hardness, whole_map=self.whole_map)
        load, area = laws["normal_load"].values, laws["real_contact_area"].values
        axes = canvas.axes()
        for number, law in enumerate(str(name) for name in laws["law"].values):
            looks = line_style(number, laws.sizes["law"])
            if law == "whole map":
                looks |= {"color": INK, "linestyle": "-", "linewidth": 2.0}
            holds = laws["holds"].values[number] if "holds" in laws else np.ones(load.size, dtype=bool)
            label = law
            if "holds" in laws and law != "whole map":
                label += f": {_ranges(load, holds)}"
            axes.plot(load, area[number], **looks | {"alpha": 0.45, "linewidth": 0.8})
            axes.plot(load, np.where(holds, area[number], np.nan), label=label, **looks)
        axes.set(xlabel="normal load (N)", ylabel="real contact area (m²)")
        by_factors(axes.xaxis)
        by_factors(axes.yaxis)
        caption = "Bold and named: where within 20 % of the whole map; Bowden–Tabor: pressures beyond hardness."
        canvas.caption = caption if "holds" in laws else ""


def _ranges(load: Floats, holds: Booleans) -> str:
    """Return the loads between which a law holds."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]))).reshape(-1, 2)
    return " and ".join(range_text(float(load[start]), float(load[stop - 1]), "N") for start, stop in ends) or "nowhere"
