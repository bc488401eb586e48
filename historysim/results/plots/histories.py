"""Pictures of a recorded history: friction loop, path in the plane, loads, slip states and stiffness."""

from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import DIRECTION, Floats
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_any, check_recorded
from historysim.results.analysis.slips import slip_note
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Size
from historysim.results.plots.chart import Chart, Curve, Item, Map, Sheet, state_keys
from historysim.results.plots.first_loading import check_worn, wear_chart
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import (
    DASHED,
    DISPLACEMENT,
    INK,
    LOOP_AXES,
    STATE_COLOURS,
    Look,
    line_colours,
    thin_history,
)

# Panels and the letters of their charts.
PANELS = {"loop": "L", "loads": "N;T", "states": "S", "energy": "E", "wear": "W"}
LINE: Look = {"color": INK, "linewidth": 1.0}


@PICTURES.register
@attrs.frozen(kw_only=True)
class HistoryPicture(Picture):
    """The friction loop, the loads over time, and the slip state of each asperity.

    Attributes
    ----------
    panels
        Some of ``"loop"``, ``"loads"``, ``"states"``, ``"energy"`` and ``"wear"``, stacked in this
        order.
    """

    panels: tuple[str, ...] | None = None

    kind, own_figure, planar, headed = "history", True, True, True
    caption = "The friction loop, the loads over time, and the slip state of each asperity."
    order, needs = 1, "total_normal_load"
    caption_lines = ("peak normal load", "peak tangential load", "dissipated energy")

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Name the panels: a history of totals has no slip states, and its energy is drawn instead."""
        first_panel = "path in the plane" if DIRECTION in history.sizes else "friction loop"
        last_panel = (
            "slip state of each asperity" if "slip_state" in history else "dissipated energy"
        )
        return f"The {first_panel}, the loads over time, and the {last_panel}."

    def default_size(self, data: xr.Dataset) -> Size:
        """Return the size for the panels."""
        check_recorded(data)
        if self.panels is not None:
            return TWO_COLUMNS if "states" in self.panels else COLUMN, 70.0 * max(
                len(self.panels), 1
            )
        return TWO_COLUMNS, 130.0 + (30.0 if "worn_volume" in data else 0.0)

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Arrange the selected panels, or those that the history has."""
        has_states = "slip_state" in data and data.sizes.get("asperity", 0) > 0
        panels = [
            "loop",
            "loads",
            "states" if has_states else "energy",
            *(["wear"] if "worn_volume" in data else []),
        ]
        if data.sizes["step"] == 1:
            # one point has no course
            panels = ["states" if has_states else "loop"]
        wide = (
            "LN;LT;" + ";".join(2 * PANELS[name] for name in panels[2:])
            if len(panels) > 1
            else panels[0]
        )
        if self.panels is not None:
            panels = list(self.panels)
            if not panels or not {*panels} <= {*PANELS}:
                raise InputError(f"panels is {self.panels!r}; expected some of {', '.join(PANELS)}")
            wide = ""
        charts: dict[str, Chart] = {}
        thin = data if {*panels} <= {"states", "wear"} else thin_history(data)
        for name in panels:
            charts |= _panel(name, data, thin)
        if self.panels is not None:
            # requested panels are drawn as low as they can be read
            charts = {
                key: attrs.evolve(chart, height=min(chart.height, 20.0))
                for key, chart in charts.items()
            }
        narrow = ";".join(charts)
        note = "colour of the loop: time" if "loop" in panels else ""
        notices = (slip_note(data),) if "loop" in panels and self.panels is None else ()
        return Sheet(
            charts,
            wide=wide if len(charts) > 1 and wide else narrow,
            narrow=narrow,
            note=note,
            notices=notices,
        )


def _panel(name: str, history: xr.Dataset, thin: xr.Dataset) -> dict[str, Chart]:
    """Return the charts of a panel by their letters; ``thin`` is `thin_history` of the history."""
    if name == "states":
        check_recorded(history, "slip_state")
        check_any(history)
        return {"S": _slip_map(history)}
    if name == "wear":
        check_worn(history)
        return {"W": wear_chart(history)}
    time = thin["time"].values
    if name == "energy":
        line = Curve(time, thin["total_dissipated_energy"].values, look=LINE)
        labels: Look = {"title": "Dissipated energy", "x": "time (s)", "y": "energy (J)"}
        return {"E": Chart(items=[line], margins=(0.01, 0.05), axes={"ylim": (0, None)}, **labels)}
    if name == "loads":
        return _load_charts(thin)
    if DIRECTION in thin.sizes:
        return {"L": _path(thin, "tangential_displacement", title="Path in the plane", height=42.0)}
    course = _course(
        thin["tangential_displacement"].values, thin["total_tangential_load"].values, time
    )
    return {
        "L": Chart(
            items=course, title="Friction loop", height=42.0, margins=(0.06, 0.06), **LOOP_AXES
        )
    }


def _load_charts(thin: xr.Dataset) -> dict[str, Chart]:
    time, load, limit = (
        thin[name].values for name in ("time", "total_tangential_load", "friction_limit")
    )
    items: list[Item] = [
        Curve(time, limit, "friction limit", DASHED),
        Curve(time, -limit, "", DASHED),
    ]
    if load.ndim > 1:
        for component, label, dashes in zip(
            load.T, ("$T_x$", "$T_y$"), ("-", (0, (2, 1))), strict=True
        ):
            items.append(Curve(time, component, label, LINE | {"linestyle": dashes}))
    else:
        items.append(Curve(time, load, hue=time))
    normal = Curve(time, thin["total_normal_load"].values, look=LINE)
    labels: Look = {"title": "Loads", "name": "loads", "y": "normal load\n$N$ (N)"}
    return {
        "N": Chart(items=[normal], height=22.0, share="time", axes={"ylim": (0, None)}, **labels),
        "T": Chart(items=items, name="loads", height=28.0, share="time", margins=(0.02, 0.05),
                   x="time (s)", y="tangential load\n$T$ (N)"),
    }  # fmt: skip


def _course(x: Floats, y: Floats, time: Floats) -> list[Item]:
    """Return a line in the colour of its time, with its start and end marked."""
    items: list[Item] = [Curve(x, y, hue=time)]
    for index, marker, name, shade in ((0, "o", "start", 0.0), (-1, "s", "end", 1.0)):
        look: Look = {
            "mec": "white",
            "mew": 0.6,
            "ms": 5,
            "zorder": 4,
            "linestyle": "",
            "marker": marker,
        }
        items.append(Curve([x[index]], [y[index]], name, look | {"color": line_colours()(shade)}))
    return items


# Labels of the vectors that can be drawn in the plane.
VECTORS = {
    "tangential_displacement": "displacement $U_{}$ (m)",
    "total_tangential_load": "tangential load $T_{}$ (N)",
    "drive_displacement": "displacement of the drive $U_{}$ (m)",
}


def _path(thin: xr.Dataset, vector: str, extra: tuple[Item, ...] = (), **options: Any) -> Chart:
    """Return the course of a vector in the plane, from start to end."""
    x, y = thin[vector].values.T
    course = _course(x, y, thin["time"].values)
    labels: Look = {axis: VECTORS[vector].format(axis) for axis in "xy"}
    equal = {"aspect": "equal", "adjustable": "datalim"}
    return Chart(
        items=[*extra, *course], zero="xy", margins=(0.08, 0.08), axes=equal, **labels, **options
    )


@PICTURES.register
@attrs.frozen(kw_only=True)
class HodographPicture(Picture):
    """The path in the plane and the tangential load next to it; the colour is time.

    The dashed circle is the friction limit at the end, where the load is drawn.

    Attributes
    ----------
    drive
        Whether the path is that of the drive of the instrument, not of the contact.
    """

    drive: bool = False

    kind, size, own_figure, order, only_planar, headed = (
        "hodograph",
        (TWO_COLUMNS, 80.0),
        True,
        2,
        True,
        True,
    )
    in_one_direction = "loops"
    caption = "The path in the plane, and the tangential load along it; the colour is time."

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return both paths."""
        check_recorded(data, "tangential_displacement")
        path = "drive_displacement" if self.drive else "tangential_displacement"
        if path not in data:
            raise InputError(
                "the history has no drive; expected one with an instrument, or drive = false"
            )
        thin = thin_history(data)
        angle = np.linspace(0, 2 * np.pi, 200)
        limit = float(thin["friction_limit"][-1])
        circle = Curve(limit * np.cos(angle), limit * np.sin(angle), "", DASHED)
        load = _path(
            thin, "total_tangential_load", (circle,), name="the tangential load", height=44.0
        )
        return Sheet({"P": _path(thin, path, name="the path", height=44.0), "T": load})


MOST_COLUMNS, MOST_ROWS = 2_000, 1_000  # steps and asperities that a map of slip states shows
MOST_LABELLED = 12  # asperities up to which each has its label


def _slip_map(history: xr.Dataset) -> Chart:
    from matplotlib.colors import ListedColormap
    from matplotlib.ticker import MaxNLocator

    steps = history.sizes["step"]
    count = history.sizes["asperity"]
    step_stride, row_stride = -(-steps // MOST_COLUMNS), -(-count // MOST_ROWS)
    by_height = np.argsort(-history["summit_height"].values, kind="stable")[::row_stride]
    recorded = history["slip_state"].isel(step=slice(None, None, step_stride))
    # whole rows of a file are read faster than scattered columns
    states = (
        recorded.values[:, by_height]
        if "source" in recorded.encoding
        else recorded.isel(asperity=by_height).values
    )
    look = {
        "cmap": ListedColormap(list(STATE_COLOURS)),
        "vmin": -0.5,
        "vmax": 3.5,
        "aspect": "auto",
        "origin": "upper",
    }
    ticks = [
        int(tick)
        for tick in MaxNLocator(8, integer=True).tick_values(0, steps - 1)
        if 0 <= tick < steps
    ]
    axes: Look = {
        "xticks": ticks,
        "xticklabels": [f"{k}\n{history['time'].values[k]:.4g}" for k in ticks],
    }
    if few := count <= MOST_LABELLED:
        axes |= {
            "yticks": range(1, count + 1, row_stride),
            "yticklabels": history["asperity"].values[by_height],
        }
    return Chart(
        items=[Map(states, (-0.5, steps - 0.5, count + 0.5, 0.5), look=look)],
        title="Slip state",
        x="step, and below it time (s)",
        y="asperity" if few else "asperities by height,\nhighest on top",
        name="slip states",
        height=34.0,
        keys=state_keys(),
        axes=axes,
    )


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

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return both charts."""
        check_recorded(data, "tangential_stiffness")
        thin = thin_history(data)
        displacement = thin["tangential_displacement"].values
        time = thin["time"].values
        load, stiffness = (
            Curve(displacement, thin[name].values, hue=time)
            for name in ("total_tangential_load", "tangential_stiffness")
        )
        options: Look = {
            "margins": (0.04, 0.06),
            "share": "displacement",
            "x": DISPLACEMENT,
        }
        upper = Chart(
            items=[load],
            y="tangential load\n$T$ (N)",
            hue="time (s)",
            zero="xy",
            height=28.0,
            **options,
        )
        label = "stiffness\n" + r"$\mathrm{d}T/\mathrm{d}U$ (N/m)"
        lower = Chart(
            items=[stiffness], y=label, zero="x", name="stiffness", height=20.0, **options
        )
        return Sheet({"L": upper, "S": lower}, wide="L;S")
