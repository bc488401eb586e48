"""Pictures of a history in two tangential directions: the path in the plane, and the load beside it."""

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import DIRECTION, Floats
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_any, check_recorded
from historysim.results.origin import named_states, state_label, step_of
from historysim.results.plots.canvas import TWO_COLUMNS, Canvas
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import (
    FAINT,
    INK,
    draw_coloured,
    line_colours,
    patches,
    scale_of,
    thinned,
    zero_lines,
)
from historysim.results.rebuilt import asperities_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# What can be drawn in the plane: its name and its unit.
OF_VECTORS = {
    "tangential_displacement": ("displacement $U", "m"),
    "total_tangential_load": ("tangential load $T", "N"),
    "drive_displacement": ("displacement of the drive $U", "m"),
}


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

    kind, size, alone, order, planar = "hodograph", (TWO_COLUMNS, 80.0), True, 2, True
    caption = "The path in the plane, and the tangential load along it; the colour is time."

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether the report of a history shows it."""
        return DIRECTION in history.sizes

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw both paths."""
        check_recorded(data, "tangential_displacement")
        _check_planar(data)
        path = "drive_displacement" if self.drive else "tangential_displacement"
        if path not in data:
            raise InputError("the history has no drive; expected one with an instrument, or drive = false")
        thin = thinned(data)
        left, right = canvas.two(("the path", "the tangential load"), 1.0)
        draw_path(left, thin, path)
        if right is not None:
            load, _ = draw_path(right, thin, "total_tangential_load")
            limit = float(thin["friction_limit"].values[-1]) * load
            circle = np.linspace(0, 2 * np.pi, 200)
            looks: dict[str, Any] = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4, 2))}
            right.plot(limit * np.cos(circle), limit * np.sin(circle), **looks)
        canvas.legend(left)
        canvas.heading(str(data.attrs.get("title", "")))


RINGS = (0.15, 0.38, 0.61, 0.8, 0.94)  # radii of the rings that have arrows, over the contact radius
MOST_CIRCLES, CIRCLES = 12, 6
SLIPPING, STICKING = "#c9c9c9", "#ffffff"


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipAnnulusPicture(Picture):
    """The tractions over the contact of an asperity at several steps, as arrows; where it slips is grey.

    From the middle to the dashed circle it sticks; the annulus around that slips in the direction of its traction,
    which is the friction limit. Arrows are in scale with one another, and circles, too.

    Attributes
    ----------
    asperity
        Which; by default the one that carries most.
    steps
        Up to 12 states, by name or number; by default all that have a name, or else 6 after the first move.
    """

    asperity: int | None = None
    steps: tuple[int | str, ...] | None = None

    kind, size, alone, order, planar = "slip-annulus", (TWO_COLUMNS, 125.0), True, 5, True
    needs = "stick_radius"
    caption = "Tractions over the contact of the asperity that carries most; where it slips is grey."

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether the report of a history shows it."""
        return DIRECTION in history.sizes and super().reported(history)

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw a circle for each step."""
        _check_planar(data)
        check_recorded(data, "slip_state", "normal_load", "contact_radius")
        check_any(data)
        steps = self._chosen(data)
        label = self.asperity
        if label is None:
            label = int(data["asperity"].values[data["normal_load"].isel(step=steps).values.max(axis=0).argmax()])
        found = asperities_at(data, label, steps)
        edge = max(each.contact_radius for each in found)
        if edge == 0:
            raise InputError(f"asperity {label} does not touch at any of the steps; expected one at which it does")
        length, unit = scale_of("m", edge)
        rings = [_ring_arrows(each) for each in found]
        most = max(float(np.hypot(*arrows[:, 2:].T).max(initial=0.0)) for arrows in rings)
        stress, stress_unit = scale_of("Pa", most)
        figure: Any = canvas.several(len(steps))
        rows = max(1, round((len(steps) * canvas.height / canvas.width) ** 0.5))
        columns = -(-len(steps) // rows)
        if figure.figure is figure and figure.get_layout_engine() is not None:
            # circles keep their shape, and stand close
            figure.set_layout_engine("compressed")
        grid = figure.subplots(-(-len(steps) // columns), columns, sharex=True, sharey=True, squeeze=False)
        for axes, one, arrows, step in zip(grid.flat, found, rings, steps, strict=False):
            _draw_circles(axes, one, length)
            x, y, tx, ty = arrows.T
            # the longest arrow is as long as rings stand apart
            looks = {"angles": "xy", "scale_units": "xy", "scale": (most or 1.0) / (0.25 * edge * length)}
            axes.quiver(
                x * length, y * length, tx, ty, color=INK, pivot="mid", width=0.006, minlength=0.3, zorder=3, **looks
            )
            axes.set_title(state_label(data, step))
            axes.set_aspect("equal")
        for axes in grid.flat[len(steps) :]:
            axes.set_visible(False)
        reach = 1.08 * edge * length
        grid[0, 0].set(xlim=(-reach, reach), ylim=(-reach, reach))
        for axes in grid[-1]:
            axes.set_xlabel(f"$x$ ({unit})")
        for axes in grid[:, 0]:
            axes.set_ylabel(f"$y$ ({unit})")
        canvas.legend(
            extra=f"longest arrow: {most * stress:.3g} {stress_unit}",
            handles=patches((STICKING, SLIPPING), ("sticks", "slips")),
        )
        title = str(data.attrs.get("title", ""))
        canvas.heading(f"{title}: asperity {label}" if title else f"Asperity {label}")

    def _chosen(self, data: xr.Dataset) -> list[int]:
        if self.steps is not None and not 0 < len(self.steps) <= MOST_CIRCLES:
            raise InputError(f"steps has {len(self.steps)}; expected 1 to {MOST_CIRCLES}")
        if self.steps is not None:
            return [step_of(data, each) for each in self.steps]
        named = list(named_states(data).values())
        if 0 < len(named) <= MOST_CIRCLES:
            return named
        moved = np.flatnonzero(data["total_tangential_load"].values.any(axis=1))
        first = int(moved[0]) if moved.size else 0
        return [int(each) for each in np.unique(np.linspace(first, data.sizes["step"] - 1, CIRCLES + 1)[1:].round())]


def _ring_arrows(one: Any) -> Floats:
    """Return places [m] and tractions [Pa] on the rings of an asperity (arrow, 4)."""
    if one.contact_radius == 0:
        return np.empty((0, 4))
    found = []
    for share, traction in zip(RINGS, one.traction(np.array(RINGS) * one.contact_radius), strict=True):
        around = np.arange(max(1, round(16 * share))) / max(1, round(16 * share)) * 2 * np.pi
        at = share * one.contact_radius * np.stack([np.cos(around), np.sin(around)], axis=1)
        found.append(np.column_stack([at, np.broadcast_to(traction, at.shape)]))
    return np.concatenate(found)


def _draw_circles(axes: "Axes", one: Any, length: float) -> None:
    """Draw the contact of an asperity, and what sticks of it."""
    from matplotlib.patches import Circle

    if one.contact_radius > 0:
        axes.add_patch(Circle((0, 0), one.contact_radius * length, facecolor=SLIPPING, edgecolor=INK, linewidth=0.9))
    if one.stick_radius > 0:
        looks: dict[str, Any] = {"facecolor": STICKING, "edgecolor": INK, "linewidth": 0.7, "linestyle": (0, (3, 2))}
        axes.add_patch(Circle((0, 0), one.stick_radius * length, **looks))


def _check_planar(data: xr.Dataset) -> None:
    if DIRECTION not in data.sizes:
        raise InputError(
            "the history has one tangential direction; expected loads or displacements in x and y, such as "
            'tangential_displacement = ["10 nm", "5 nm"]'
        )


def draw_path(axes: "Axes", thin: xr.Dataset, name: str = "tangential_displacement") -> tuple[float, str]:
    """Draw a vector of a thinned history as it goes, from start to end; return its scale and its unit."""
    text, si = OF_VECTORS[name]
    x, y = thin[name].values.T
    time = thin["time"].values
    factor, unit = scale_of(si, x, y)
    zero_lines(axes)
    draw_coloured(axes, x * factor, y * factor, time)
    for index, marker, label, shade in ((0, "o", "start", 0.0), (-1, "s", "end", 1.0)):
        looks: dict[str, Any] = {"mec": "white", "mew": 0.6, "ms": 5, "label": label, "zorder": 4, "linestyle": ""}
        axes.plot(x[index] * factor, y[index] * factor, marker=marker, color=line_colours()(shade), **looks)
    axes.set(xlabel=f"{text}_x$ ({unit})", ylabel=f"{text}_y$ ({unit})")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)
    return factor, unit


def draw_components(axes: "Axes", thin: xr.Dataset, factor: float) -> None:
    """Draw both components of the tangential load over time."""
    time, load = thin["time"].values, thin["total_tangential_load"].values * factor
    for each, (label, style) in enumerate((("$T_x$", "-"), ("$T_y$", (0, (2, 1))))):
        axes.plot(time, load[:, each], color=INK, linestyle=style, linewidth=1.0, label=label, rasterized=True)
