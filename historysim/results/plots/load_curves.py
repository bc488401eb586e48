"""Normal load, real contact area and normal stiffness over the approach, beside Hertz, or Greenwood and Williamson."""

from typing import Any

import attrs
import xarray as xr

from historysim.results.plots.canvas import COLUMN, Canvas
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import LINES, scaled
from historysim.results.plots.swept import readable
from historysim.results.rebuilt import load_curve

PANELS = {
    "normal_load": "normal load $N$",
    "contact_area": "contact area $A$",
    "normal_stiffness": r"stiffness $\mathrm{d}N/\mathrm{d}\delta$",
}
AROUND, PANEL_HEIGHT = 25.0, 25.0
"""Of what stands around the panels, and of a panel at least [mm]; those that have no room are left out."""


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoadCurvePicture(Picture):
    """Normal load, contact area and normal stiffness over the approach, beside Hertz or Greenwood and Williamson."""

    kind, size, alone = "load-curve", (COLUMN, 140.0), True

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw a panel for each, below one another."""
        curve = load_curve(data)
        names = [name for name in PANELS if name in curve]
        called = [str(curve[name].attrs["long_name"]) for name in names]
        shown = canvas.fitting(called, int((canvas.height - AROUND) / PANEL_HEIGHT))
        figure: Any = canvas.several()
        panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        along, length = scaled(curve["approach"].values, "m")
        for axes, name in zip(panels, names, strict=False):
            beside = f"theory_{name}"
            factor, unit = readable(curve[name])
            axes.plot(along, curve[name].values * factor, color=LINES[0][0], label="this contact")
            if beside in curve:
                looks = {"color": LINES[1][0], "linestyle": "--", "label": curve.attrs["theory"]}
                axes.plot(along, curve[beside].values * factor, **looks)
            axes.set_ylabel(f"{PANELS[name]} ({unit})")
            axes.set_ylim(bottom=0)
        panels[-1].set_xlabel(rf"approach $\delta$ of the highest summit ({length})")
        panels[-1].set_xlim(0, along[-1])
        canvas.legend(panels[0])
        canvas.heading(str(curve.attrs["title"]))
