"""Fig. 6.5: drift over the relative change of radius, ΔR = (R₂ - R₁)/R₁.

R₁ is .1 µm times 1, 10 and 100; 10 mN, μ = .5 (given). Forward with R₁, back with R₂ (from .1 to 3
µm times the factor): the drift is the difference of the preliminary displacements. The source has
less than 20 nm at × 100.
"""

# historysim gallery: example

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

FACTORS = (1, 10, 100)
CHANGES = np.array([0.0, 0.5, 1, 2, 4, 6, 9, 14, 19, 24, 29])
LEAST = 0.1e-6
SCENARIO = Path(__file__).parents[1] / "20_radius_load_friction.toml"
SETTINGS = {f"loading.waypoints[{number}].normal_load": "10 mN" for number in (0, 2)}


def calculated() -> xr.Dataset:
    """Return the drift [m] over factor and relative change of the radius."""
    scenario = hs.load(SCENARIO, SETTINGS)
    drift = []
    for factor in FACTORS:
        radii = {"surface.radius": LEAST * factor * (1 + CHANGES)}
        table = hs.sweep(scenario, radii, outputs=["preliminary_displacement"])
        reach = table["preliminary_displacement"].values.ravel()
        drift.append(abs(reach - reach[0]))
    return xr.Dataset(
        {"drift": (("start", "change"), drift, {"units": "m", "long_name": "drift"})},
        {
            "start": [f"$R_1$ = {LEAST * factor * 1e6:g} µm" for factor in FACTORS],
            "change": (
                "change",
                CHANGES,
                {"long_name": r"relative change of the radius $\Delta R$"},
            ),
        },
    )


def drawn(found: xr.Dataset) -> Figure:
    """Return the figure."""
    title = "Fig. 6.5: drift over relative change of radius, alumina on zirconia, 10 mN"
    return hs.plots.curve(
        found, quantity="drift", over="change", each="start", logarithmic=False, title=title
    )


if __name__ == "__main__":
    result = calculated()
    print((result.drift.to_pandas().T * 1e9).round(1))
    drawn(result).savefig("fig_6_05_drift_over_radius.png")
