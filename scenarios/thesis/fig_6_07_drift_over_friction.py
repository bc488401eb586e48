"""Fig. 6.7: drift over the change of the friction coefficient: linear, and the same from any start.

By .1 to .25 from μ = .2, .7 and .9, and from .9 down. The radius is that of scenario 20; 10 mN
(given).
"""

# historysim gallery: example

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

CHANGES = np.array([0.0, 0.1, 0.15, 0.2, 0.25])
SCENARIO = Path(__file__).parents[1] / "20_radius_load_friction.toml"
SETTINGS = {f"loading.waypoints[{number}].normal_load": "10 mN" for number in (0, 2)}
STARTS = {
    "from 0.2": (0.2, 1),
    "from 0.7": (0.7, 1),
    "from 0.9": (0.9, 1),
    "from 0.9 down": (0.9, -1),
}


def calculated() -> xr.Dataset:
    """Return the drift [m] over start and change of μ."""
    scenario = hs.load(SCENARIO, SETTINGS)
    drift = []
    for start, sign in STARTS.values():
        coefficients = {"friction.coefficient": start + sign * CHANGES}
        table = hs.sweep(scenario, coefficients, outputs=["preliminary_displacement"])
        reach = table["preliminary_displacement"].values.ravel()
        drift.append(abs(reach - reach[0]))
    return xr.Dataset(
        {"drift": (("start", "change"), drift, {"units": "m", "long_name": "drift"})},
        {
            "start": list(STARTS),
            "change": (
                "change",
                CHANGES,
                {"long_name": r"difference of the coefficient $|\Delta\mu|$"},
            ),
        },
    )


def drawn(found: xr.Dataset) -> Figure:
    """Return the figure."""
    title = "Fig. 6.7: drift over the difference of the friction coefficient, alumina on zirconia, 10 mN"
    return hs.plots.curve(found, quantity="drift", over="change", each="start", title=title)


if __name__ == "__main__":
    result = calculated()
    print((result.drift.to_pandas().T * 1e9).round(2))
    drawn(result).savefig("fig_6_07_drift_over_friction.png")
