"""Pictures of a history in two tangential directions: the path in the plane, and the load beside it."""

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import DIRECTION
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_recorded
from historysim.results.plots.canvas import TWO_COLUMNS, Canvas
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import FAINT, INK, draw_coloured, line_colours, scale_of, thinned, zero_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OF_VECTORS = {
    "tangential_displacement": ("displacement $U", "m"),
    "total_tangential_load": ("tangential load $T", "N"),
    "drive_displacement": ("displacement of the drive $U", "m"),
}
"""What can be drawn in the plane: its name and its unit."""


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
        if DIRECTION not in data.sizes:
            raise InputError(
                "the history has one tangential direction; expected loads or displacements in x and y, such as "
                'tangential_displacement = ["10 nm", "5 nm"]'
            )
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
