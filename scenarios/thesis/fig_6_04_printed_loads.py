"""Fig. 6.4 with the loads of each contact as they are printed: F/n² with R/√n, and F/√n with R.

They do not add up to F: F/n² leaves F/n in all, F/√n makes it √n F. If n is the number on a side
("about 64 contacts" is n = 8), F/n² does add up and is the F/n of fig_6_04_texture.toml at n²
contacts; F/√n never does. Only so the texture that keeps R moves more.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

COUNTS = (1, 4, 6, 8, 12, 16, 36, 64)
LAWS = {"self-similar: R/√n, F/n²": (-0.5, -2.0), "curvature-invariant: R, F/√n": (0.0, -0.5)}
RADIUS, LOAD, FRICTION = 0.5e-6, 10e-3, 0.5


def calculated() -> xr.Dataset:
    """Return δ [m] over law and number of contacts."""
    pair = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
    values = np.empty((len(LAWS), len(COUNTS)))
    for row, (of_radius, of_load) in enumerate(LAWS.values()):
        for column, count in enumerate(COUNTS):
            # n equal ones: one of them tells all
            one = hs.Ensemble(pair, 0.0, RADIUS * count**of_radius, friction=FRICTION)
            approach = one.approach_at(LOAD * count**of_load)
            values[row, column] = pair.displacement_ratio * FRICTION * approach
    return xr.Dataset(
        {"preliminary_displacement": (("law", "count"), values, {"units": "m"})},
        {"law": list(LAWS), "count": ("count", list(COUNTS))},
    )


def drawn(found: xr.Dataset) -> Figure:
    """Return the figure."""
    title = "Fig. 6.4 with the printed loads: preliminary displacement over the number of contacts"
    looks = {"logarithmic": False, "from_zero": True, "title": title}
    return hs.plots.curve(
        found, quantity="preliminary_displacement", over="count", each="law", **looks
    )


if __name__ == "__main__":
    result = calculated()
    print(result.preliminary_displacement.to_pandas().T)
    drawn(result).savefig("fig_6_04_printed_loads.png")
