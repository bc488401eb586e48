"""Fig. 6.6 b: branch drift over the change of the normal load.

From 50 mN up to 100 and down to 1, from 100 mN up to 150 and down to 50. R = .5 µm, μ = .5 (told). At ± 20 mN 78.0
and 179.0 nm, from 100 mN 63.6 and 136.1: a falling load drifts 2.3 times as much, and a higher load at the start
less, as the source says. Its 60 and 140 nm are those of R = 1 µm (61.9, 142.1), as if the diameter had been used.
"""

# historysim gallery: example

from pathlib import Path

import numpy as np
import xarray as xr

import historysim as hs

FIRST = (50e-3, 100e-3)
ENDS = {"up": (50e-3, 50e-3), "down": (-49e-3, -50e-3)}


def calculated(radius: str = "0.5 µm", count: int = 11) -> xr.Dataset:
    """Return the branch drift [m] over direction, load at the start [N] and amount of its change [N]."""
    path = Path(__file__).with_name("fig_6_06_branch_drift.toml")
    share = np.linspace(0, 1, count)
    shares = np.unique(np.append(share, [0.4, 20 / 49]))
    drift, change = np.empty((2, len(FIRST), shares.size)), np.empty((2, len(FIRST), shares.size))
    for row, ends in enumerate(ENDS.values()):
        for column, (first, end) in enumerate(zip(FIRST, ends, strict=True)):
            settings = {"surface.radius": radius, "loading.waypoints[0].normal_load": first, "loading.substeps": 1}
            loads = [first + end * part for part in shares]
            over = {"loading.waypoints[2].normal_load": loads}
            drift[row, column] = hs.sweep(hs.load(path, settings), over, outputs=["branch_drift"]).branch_drift
            change[row, column] = end * shares
    lines = [f"from {first * 1e3:g} mN {name}" for name in ENDS for first in FIRST]
    size = len(lines), shares.size
    return xr.Dataset(
        {
            "drift": (("line", "point"), drift.reshape(size), {"units": "m", "long_name": "branch drift"}),
            "change": (
                ("line", "point"),
                np.abs(change).reshape(size),
                {"units": "N", "long_name": r"difference of the normal load $|\Delta N|$"},
            ),
        },
        {"line": lines},
    )


def drawn(found: xr.Dataset) -> object:
    """Return the figure."""
    title = "Fig. 6.6 b: drift over the difference of the normal load, alumina on zirconia"
    return hs.plots.curve(found, quantity="drift", over="change", each="line", title=title)


if __name__ == "__main__":
    made = calculated()
    for line in range(made.sizes["line"]):
        print(str(made.line.values[line]))
        for row in zip(made.change.values[line] * 1e3, made.drift.values[line] * 1e9, strict=True):
            print("  {:6.1f} mN {:7.1f} nm".format(*row))
