"""Pictures of first loading, wear and yielding: curves and theory, area laws, summits before and after."""

from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Booleans, Floats
from historysim.basics.units import range_text
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.interaction.areas import area_laws
from historysim.results.analysis.recorded import shape_in_step
from historysim.results.analysis.separation_load import pull_off
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS
from historysim.results.plots.chart import Chart, Curve, Item, Sheet
from historysim.results.plots.pictures import (
    PICTURES,
    SCENARIO,
    Panel,
    Picture,
    Titled,
)
from historysim.results.plots.style import (
    INK,
    LINES,
    MARK,
    STATE_COLOURS,
    Look,
    format_unit,
    line_style,
    select_steps,
)
from historysim.results.recompute import load_curve
from historysim.surfaces.heights import Surface

CURVES = {
    "normal_load": "normal load $N$",
    "contact_area": "contact area $A$",
    "normal_stiffness": r"stiffness $\mathrm{d}N/\mathrm{d}\delta$",
}
MOST_WORN = 8  # asperities with a separate line: those with the greatest wear
THEORY: Look = {"color": LINES[1][0], "linestyle": "--"}
BLUE: Look = {"color": LINES[0][0]}


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoadCurvePicture(Picture):
    """Normal load, contact area and normal stiffness over the approach, and Hertz or Greenwood and Williamson."""

    kind, size, own_figure, headed = "load-curve", (COLUMN, 140.0), True, True

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return a chart for each quantity."""
        curve = load_curve(data)
        charts = {}
        approach = curve["approach"].values
        for name in (name for name in CURVES if name in curve):
            items = [Curve(approach, curve[name].values, "this contact", BLUE)]
            if f"theory_{name}" in curve:
                items.append(
                    Curve(approach, curve[f"theory_{name}"].values, curve.attrs["theory"], THEORY)
                )
            charts[name[0].upper() if name != "normal_stiffness" else "S"] = Chart(
                items=items,
                name=str(curve[name].attrs["long_name"]),
                x=r"approach $\delta$ of the highest summit (m)",
                y=f"{CURVES[name]} ({format_unit(curve[name].attrs['units'])})",
                share="approach",
                axes={"xlim": (0, approach[-1]), "ylim": (0, None)},
            )
        return Sheet(charts, wide=";".join(charts))


@PICTURES.register
@attrs.frozen(kw_only=True)
class PullOffPicture(Panel):
    """Load from outside over the approach of a contact that attracts: the history, and all equilibria."""

    kind, headed = "pull-off", True

    def sheet(self, data: xr.Dataset) -> Chart:
        """Return the loads of the history, all equilibria, and the point of pull-off."""
        curve = pull_off(data)
        separation = data["separation"].values
        recorded = Curve(
            curve.attrs["highest_summit"] - separation,
            data["total_normal_load"].values,
            "history",
            BLUE,
        )
        back = Curve(curve["approach"].values, curve["normal_load"].values, "equilibria", THEORY)
        place, least = ([curve.attrs[name]] for name in ("pull_off_approach", "pull_off_load"))
        point = Curve(
            place, least, "pull-off", {"color": INK, "linestyle": "", "marker": "o", "ms": 5}
        )
        return Chart(
            items=[back, recorded, point],
            x=r"approach $\delta$ of the highest summit (m)",
            y="normal load from outside $N$ (N)",
            zero="y",
        )


@PICTURES.register
@attrs.frozen(kw_only=True)
class WearPicture(Picture):
    """The volume that asperities lose, and their summits before and after."""

    kind, size, own_figure, headed = "wear", (TWO_COLUMNS, 75.0), True, True
    caption = "The volume that the asperities lose, and their summits before and after."
    order, needs, caption_lines = 8, "worn_volume", ("worn volume",)

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return the volume over time, and the summits."""
        check_worn(data)
        summits = _summit_chart(data, slice(None), (MARK, STATE_COLOURS[2]), "Summits")
        return Sheet({"W": wear_chart(data), "S": summits}, wide="WWWSS")


def check_worn(history: xr.Dataset) -> None:
    """Check that a history records the wear of its asperities."""
    if "worn_volume" not in history:
        raise InputError(
            "the history has no worn_volume; expected one of a scenario with [wear], with its asperities"
        )


def wear_chart(history: xr.Dataset) -> Chart:
    """Return the worn volume of all asperities, and of those with the greatest wear, over time."""
    steps = select_steps(history)
    time = history["time"].values[steps]
    worn = history["worn_volume"].isel(step=steps).values
    items = [Curve(time, worn.sum(axis=1), "all", {"color": INK, "linewidth": 1.3})]
    selected = (
        np.argsort(-worn[-1], kind="stable")[:MOST_WORN]
        if worn.shape[1] > 1
        else np.empty(0, dtype=int)
    )
    selected = selected[worn[-1, selected] > 0]
    for number, column in enumerate(selected):
        name = f"asperity {int(history['asperity'][column])}"
        items.append(Curve(time, worn[:, column], name, line_style(number, selected.size)))
    labels: Look = {"title": "Wear", "x": "time (s)", "y": "worn volume (m³)"}
    return Chart(items=items, margins=(0.01, 0.05), axes={"ylim": (0, None)}, **labels)


def _summit_chart(history: xr.Dataset, which: Any, colours: tuple[str, str], title: str) -> Chart:
    """Return radii over heights of some summits, at the start and at the end."""
    virgin = [history[f"summit_{name}"].values[which] for name in ("height", "radius")]
    worn = [shape_in_step(history, f"summit_{name}", -1)[which] for name in ("height", "radius")]
    heights, radii = np.stack([virgin, worn], axis=1)
    joined = colours[0] == colours[1]
    items = (
        [Curve(heights, radii, "", {"color": "0.75", "linewidth": 0.6})]
        if joined and radii.size
        else []
    )
    for row, (marker, colour, name) in enumerate(
        zip("os", colours, ("before", "after"), strict=True)
    ):
        look = {"marker": marker, "linestyle": "", "ms": 4, "mfc": "none", "color": colour}
        items.append(Curve(heights[row], radii[row], name, look))
    greatest = radii.max(initial=0.0)
    axes = {"ylim": (0, 2 * greatest or 1.0)} if np.ptp(radii) <= 1e-12 * greatest else {}
    return Chart(
        items=items, title=title, x="summit height $z$ (m)", y="summit radius $R$ (m)", axes=axes
    )


@PICTURES.register
@attrs.frozen(kw_only=True)
class YieldingPicture(Picture):
    """The curve of first loading and unloading, and the summits that yielded, before and after."""

    kind, size, own_figure, headed = "yielding", (TWO_COLUMNS, 75.0), True, True
    caption = "First loading and unloading, and the summits that yielded, before and after."
    order, needs = 7, "yielded_depth"

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Return the caption with the number of summits that yielded."""
        yielded = history["yielding_load"].isel(step=-1).values > 0
        return f"{cls.caption.removesuffix('.')}: {np.count_nonzero(yielded)} of {yielded.size} asperities."

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return the normal load over the approach, where summits yield and where they do not, and the summits."""
        if "yielded_depth" not in data:
            raise InputError(
                "the history has no yielded_depth; expected one of a scenario with surface.yielding, "
                "with its asperities"
            )
        steps = select_steps(data)
        items = []
        course = [
            data["summit_height"].values.max() - data["separation"].values,
            data["total_normal_load"].values,
        ]
        yields = np.diff(data["total_yielding_energy"].values[steps]) > 0
        thick = {"linewidth": 1.8, "color": INK}
        thin = {"linewidth": 0.9, "color": "0.45", "linestyle": (0, (4, 2))}
        for chosen, look, name in ((yields, thick, "summits yield"), (~yields, thin, "elastic")):
            if chosen.any():
                # a piece from each step to the next, and a gap behind it
                pieces = (
                    np.where(chosen, [values[steps][:-1], values[steps][1:]], np.nan)
                    for values in course
                )
                x, y = (
                    np.pad(values, ((0, 1), (0, 0)), constant_values=np.nan).T.ravel()
                    for values in pieces
                )
                items.append(Curve(x, y, name, look))
        labels: Look = {"title": "First loading, unloading", "y": "normal load $N$ (N)"}
        load = Chart(items=items, x="approach of the highest summit (m)", **labels)
        yielded = data["yielding_load"].isel(step=-1).values > 0
        return Sheet(
            {"L": load, "S": _summit_chart(data, yielded, (INK, INK), "Summits that yielded")},
            wide="LLLLSSS",
        )


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

    The laws are compared with the summits of the map and its fully interacting solution;
    `hs.area_laws` returns the numbers. Loads range up to the greatest of the scenario.

    Attributes
    ----------
    whole_map
        Solve the whole map, which takes seconds to minutes. Without it no law is said to hold.
    """

    whole_map: bool = True

    kind, of, size, own_figure = "area-laws", (PressedMap, SCENARIO), (1.4 * COLUMN, 105.0), True

    def sheet(self, data: PressedMap) -> Sheet:
        """Return a line for each law."""
        laws = area_laws(
            data.surface,
            data.pair,
            data.normal_load,
            hardness=data.hardness,
            whole_map=self.whole_map,
        )
        load = laws["normal_load"].values
        area = laws["real_contact_area"].values
        items = list[Item]()
        for number, law in enumerate(str(name) for name in laws["law"].values):
            look = line_style(number, laws.sizes["law"])
            label = law
            holds = (
                laws["holds"].values[number] if "holds" in laws else np.ones(load.size, dtype=bool)
            )
            if law == "whole map":
                look |= {"color": INK, "linestyle": "-", "linewidth": 2.0}
            elif "holds" in laws:
                label += f": {_ranges(load, holds)}"
            items.append(Curve(load, area[number], "", look | {"alpha": 0.45, "linewidth": 0.8}))
            items.append(Curve(load, np.where(holds, area[number], np.nan), label, look))
        chart = Chart(items=items, x="normal load (N)", y="real contact area (m²)", log="xy")
        caption = "Bold and named: where within 20 % of the whole map; Bowden–Tabor: pressures beyond hardness."
        return Sheet({"A": chart}, subtitle=caption if "holds" in laws else "")


def _ranges(load: Floats, holds: Booleans) -> str:
    """Return the loads between which a law holds."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]))).reshape(-1, 2)
    return (
        " and ".join(
            range_text(float(load[start]), float(load[stop - 1]), "N") for start, stop in ends
        )
        or "nowhere"
    )
