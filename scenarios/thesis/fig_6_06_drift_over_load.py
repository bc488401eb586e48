"""Fig. 6.6: (a) the sequence of the normal load, (b) branch drift over its change.

From 50 mN up to 100 and down to 1, from 100 mN by 50 mN up and down. R = .5 µm, μ = .5 (given). A
falling load drifts more, and a higher load at the start less, as the source says. Its numbers are
those of R = 1 µm, as if the diameter had been used. Assumed: the steps of the sequence.
"""

# historysim gallery: example

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

FIRST = (50e-3, 100e-3)
ENDS = {"up": (50e-3, 50e-3), "down": (-49e-3, -50e-3)}


def calculated(radius: str = "0.5 µm", count: int = 11) -> xr.Dataset:
    """Return the branch drift, and |δ₂ - δ₁| of Eq. 6.1 [m], over lines and points, with the change of the load [N]."""
    path = Path(__file__).with_name("fig_6_06_loops.toml")
    share = np.linspace(0, 1, count)
    shares = np.unique(np.append(share, [0.4, 20 / 49]))
    drift, difference, change = np.empty((3, 2, len(FIRST), shares.size))
    for row, ends in enumerate(ENDS.values()):
        for column, (first, end) in enumerate(zip(FIRST, ends, strict=True)):
            settings = {
                "surface.radius": radius,
                "loading.waypoints[0].normal_load": first,
                "loading.substeps": 1,
            }
            loads = [first + end * part for part in shares]
            over = {"loading.waypoints[2].normal_load": loads}
            found = hs.sweep(hs.load(path, settings), over, outputs=["branch_drift", "drift"])
            drift[row, column], difference[row, column] = found.branch_drift, found.drift
            change[row, column] = end * shares
    lines = [f"from {first * 1e3:g} mN {name}" for name in ENDS for first in FIRST]
    size = len(lines), shares.size
    return xr.Dataset(
        {
            "drift": (
                ("line", "point"),
                drift.reshape(size),
                {"units": "m", "long_name": "branch drift"},
            ),
            "difference": (
                ("line", "point"),
                difference.reshape(size),
                {"units": "m", "long_name": "Eq. 6.1"},
            ),
            "change": (
                ("line", "point"),
                np.abs(change).reshape(size),
                {"units": "N", "long_name": r"difference of the normal load $|\Delta N|$"},
            ),
        },
        {"line": lines},
    )


def _sequence() -> Figure:
    """Return the loads of the strokes, there and back by turns: the sequence."""
    figure = Figure(figsize=(5.2, 3.6), layout="constrained")
    axes = figure.add_subplot()
    for first, *ends in zip(FIRST, *ENDS.values(), strict=True):
        for end in ends:
            loads = np.round(np.linspace(first, first + end, 6) * 1e3, 1)
            style, way = ("-", "up") if end > 0 else ("--", "down")
            axes.step(
                np.arange(7),
                [*loads, loads[-1]],
                style,
                where="post",
                label=f"from {first * 1e3:g} mN {way}",
            )
    axes.set_xticks(np.arange(6) + 0.5, ["there", "back"] * 3)
    axes.set(ylim=(0, None), xlabel="stroke", ylabel="normal load $N$ (mN)")
    axes.set_title("Fig. 6.6 a: sequence of the normal load, rising and falling", fontsize=9)
    axes.legend(frameon=False, fontsize=8)
    return figure


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return both figures: (a) the sequence, (b) the drift."""
    title = "Fig. 6.6 b: drift over the difference of the normal load, alumina on zirconia"
    return [
        _sequence(),
        hs.plots.curve(
            found, quantity="drift", over="change", each="line", from_zero=True, title=title
        ),
    ]


if __name__ == "__main__":
    made = calculated()
    for line in range(made.sizes["line"]):
        print(str(made.line.values[line]))
        for row in zip(made.change.values[line] * 1e3, made.drift.values[line] * 1e9, strict=True):
            print("  {:6.1f} mN {:7.1f} nm".format(*row))
    for number, figure in enumerate(drawn(made), 1):
        figure.savefig(f"fig_6_06_drift_over_load_{number}.png")
