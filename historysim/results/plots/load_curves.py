"""Curves of first loading beside theory: over the approach, and the displacement over how many asperities slide."""

from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.errors import InputError
from historysim.results.plots.canvas import COLUMN, Canvas
from historysim.results.plots.pictures import HISTORY, PICTURES, Panel, Picture, several_of
from historysim.results.plots.style import FAINT, LINES, scale_of, scaled
from historysim.results.plots.surfaces import step_number
from historysim.results.plots.swept import readable
from historysim.results.rebuilt import load_curve, sliding_order

PANELS = {
    "normal_load": "normal load $N$",
    "contact_area": "contact area $A$",
    "normal_stiffness": r"stiffness $\mathrm{d}N/\mathrm{d}\delta$",
}
# Of what stands around the panels, and of a panel at least [mm]; those that have no room are left out.
AROUND, PANEL_HEIGHT = 25.0, 25.0


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


SHARES = np.linspace(0.0, 1.0, 201)


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

    kind, of, several = "sliding-order", (HISTORY,), True

    def draw(self, canvas: Canvas, data: Any) -> None:
        """Draw a step for each asperity, Greenwood and Williamson's curve, and the line of equal asperities."""
        histories = several_of(data)
        orders = [sliding_order(each, step_number(self.step, each)) for each in histories]
        if not all(order.sizes["rank"] for order in orders):
            raise InputError("nothing touches at that step; expected one at which asperities are in contact")
        curves = np.array([_of_share(order["displacement"].values) for order in orders])
        factor, unit = scale_of("m", curves)
        axes, (colour, _, marker) = canvas.axes(), LINES[0]
        if len(orders) == 1:
            count = orders[0].sizes["rank"]
            share = 100 * np.arange(1, count + 1) / count
            looks: dict[str, Any] = {"marker": marker, "ms": 2.5} if count <= MOST_MARKED else {}
            values = orders[0]["displacement"].values * factor
            axes.plot(share, values, drawstyle="steps-post", color=colour, label=f"{count} asperities", **looks)
        else:
            low, middle, high = np.quantile(curves * factor, (0.1, 0.5, 0.9), axis=0)
            axes.fill_between(100 * SHARES, low, high, color=colour, alpha=0.2, lw=0, label="10 to 90 % of them")
            axes.plot(100 * SHARES, middle, color=colour, label=f"median of {len(orders)} surfaces")
        if all("greenwood_williamson" in order for order in orders):
            theory = [_of_share(order["greenwood_williamson"].values) for order in orders]
            looks = {"color": LINES[1][0], "linestyle": "--", "label": "Greenwood and Williamson"}
            axes.plot(100 * SHARES, np.mean(theory, axis=0) * factor, **looks)
        equal = float(np.mean([order.attrs["equal_asperities"] for order in orders])) * factor
        axes.axhline(equal, color=FAINT, linestyle=":", label="equal asperities", zorder=0)
        axes.set(xlabel="asperities in contact that slide (%)", ylabel=f"tangential displacement ({unit})")
        axes.set_ylim(bottom=0)
        axes.set_xlim(0, 100)
        canvas.legend(axes)
        canvas.title(axes, self.title)


MOST_MARKED = 100  # asperities up to which each has a mark


def _of_share(displacement: Any) -> Any:
    """Return at which displacement shares of the asperities slide: straight between the k-th and the next."""
    count = len(displacement)
    return np.interp(SHARES, (np.arange(count) + 0.5) / count, displacement)
