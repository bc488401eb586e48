"""Picture of the stress below an asperity: a section along the tangential load."""

from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.results.analysis.peak_stresses import (
    MEASURES,
    TEXTS,
    find_peak,
    history_poissons_ratio,
)
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.canvas import COLUMN
from historysim.results.plots.chart import Chart, Curve, Item, Map, Sheet
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import DIVERGING, INK
from historysim.results.recompute import replay_asperities
from historysim.results.steps import resolve_step, state_label

POINTS = (201, 121)  # of the section, along and below the surface
ASSUMED_RATIO = 0.3  # of a pair of moduli, whose materials are unknown; the picture states it
REACH, DEPTH = 1.5, 1.2  # of the section, in contact radii
MARK: Any = {"color": INK, "linestyle": "", "markersize": 5, "clip_on": False, "zorder": 5}


@PICTURES.register
@attrs.frozen(kw_only=True)
class StressPicture(Picture):
    """The stress below an asperity at a step, in the section through its middle along the tangential load.

    Attributes
    ----------
    asperity
        Its label; by default the one that carries most.
    step
        By name or number; by default the one whose slipping fraction is nearest to half.
    measure
        ``"tensile"``, the largest principal stress, or ``"von_mises"``.
    poissons_ratio
        Of the body; by default of the second material, or 0.3 where that is unknown, as the picture
        then states.
    """

    asperity: int | None = None
    step: int | str | None = None
    measure: str = "tensile"
    poissons_ratio: float | str | None = None

    kind, size, own_figure = "stress", (COLUMN, 72.0), True

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return the section, with the edge of the contact, the stick zone and the largest stress."""
        if self.measure not in MEASURES:
            raise InputError(f"measure is {self.measure!r}; expected one of {', '.join(MEASURES)}")
        step = representative_step(data) if self.step is None else resolve_step(self.step, data)
        label = self.asperity
        if label is None:
            label = int(
                data["asperity"].values[data["normal_load"].isel(step=step).values.argmax()]
            )
        (contact,) = replay_asperities(data, label, [step])
        radius = contact.contact_radius
        if radius == 0.0:
            raise InputError(
                f"asperity {label} does not touch at step {step}; expected a step at which it does"
            )
        x = radius * np.linspace(-REACH, REACH, POINTS[0])
        z = radius * np.linspace(0.0, DEPTH, POINTS[1])
        ratio = history_poissons_ratio(data, self.poissons_ratio)
        remark = (
            f", ν = {ratio:g}"
            if isinstance(ratio, float)
            else f", ν = {ASSUMED_RATIO:g} assumed: set poissons_ratio"
        )
        ratio = ASSUMED_RATIO if ratio is None else ratio
        tensor = contact.stress(x[:, np.newaxis], 0.0, z, poissons_ratio=ratio)
        stress = MEASURES[self.measure](tensor)
        peak, peak_x, peak_z = find_peak(contact, self.measure, ratio)
        signed = self.measure == "tensile"
        look = {
            "cmap": DIVERGING if signed else "viridis",
            "vmin": -peak if signed else 0.0,
            "vmax": peak,
        }
        extent = float(x[0]), float(x[-1]), float(z[-1]), 0.0
        name = TEXTS[self.measure].partition(",")[0]
        section = Map(
            stress,
            extent,
            f"{name} (Pa)",
            look | {"origin": "upper"},
            "min" if signed else "neither",
        )
        items: list[Item] = [
            section,
            Curve([-radius, radius], [0.0, 0.0], "edge of the contact", MARK | {"marker": "|"}),
            Curve(
                [peak_x],
                [peak_z],
                f"largest: {quantity_text(peak, 'Pa', 3)}",
                MARK | {"marker": "o", "mfc": "none"},
            ),
        ]
        if 0.0 < contact.stick_radius < radius:
            ends = [-contact.stick_radius, contact.stick_radius]
            items.insert(
                2,
                Curve(
                    ends,
                    [0.0, 0.0],
                    "edge of the stick zone",
                    MARK | {"marker": "v", "mfc": "none"},
                ),
            )
        limits = {"xlim": (x[0], x[-1]), "ylim": (z[-1], 0.0)}
        chart = Chart(items=items, x="$x$ (m)", y="depth $z$ (m)", axes=limits, share="map")
        return Sheet({"S": chart}, subtitle=f"Asperity {label}, {state_label(data, step)}{remark}")
