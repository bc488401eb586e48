"""Table 6.2: preliminary displacement and drift along 1000 m at 5 N, with the measured coefficients of friction.

The alumina and the zirconia of Table B.3 at 5 N and 1000 m in ambient, as one surface of their sum,
1.887 µm; β = 20 µm is assumed. δ is proportional to μ. The printed δ grows by the same for each
metre whatever μ; only its last value is of the order that the model has, and its .74 has the
smallest, where the text says the largest.
"""

# historysim gallery: example

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

DISTANCE = (50, 100, 200, 400, 600, 700, 800, 1000)
FRICTION = (0.74, 0.69, 0.58, 0.59, 0.56, 0.59, 0.56, 0.55)
SUM = "1.887 µm"
"""Rq of ball and plate together."""
PRINTED = (0.14, 0.27, 0.55, 1.11, 1.66, 1.94, 2.22, 2.78)
PRINTED_DRIFT = (0.13, 0.56, 0.28, 0.56)
"""Of the first and second row, the third and fourth, … [µm]."""


def calculated(seeds: int = 20) -> xr.Dataset:
    """Return δ [m] over the distance and seed, and the coefficients."""
    settings = {"surface.rms_height": SUM, "friction.coefficient": 1.0}
    scenario = hs.load(Path(__file__).with_name("fig_6_16_worn_pairs_5_N.toml"), settings)
    over = {"surface.seed": range(1, seeds + 1)}
    found = hs.sweep(scenario, over, outputs=["preliminary_displacement"])
    # proportional to μ, whatever the surface
    values = np.outer(FRICTION, found.preliminary_displacement.values)
    return xr.Dataset(
        {
            "preliminary_displacement": (("distance", "seed"), values, {"units": "m"}),
            "friction": ("distance", list(FRICTION)),
        },
        {
            "distance": ("distance", list(DISTANCE), {"long_name": "distance (m)"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


def rows(found: xr.Dataset) -> list[list[str]]:
    """Return the table, in µm."""
    own = found.preliminary_displacement * 1e6
    mean, deviation = own.mean("seed").values, own.std("seed", ddof=1).values
    table = [
        [
            "distance (m)",
            "μ",
            "δ, source",
            "δ, here",
            "drift of the pair, source",
            "drift of the pair, here",
        ]
    ]
    for row, (distance, friction, printed) in enumerate(
        zip(DISTANCE, FRICTION, PRINTED, strict=True)
    ):
        line = [
            str(distance),
            f"{friction}",
            f"{printed:.2f}",
            f"{mean[row]:.2f} ± {deviation[row]:.2f}",
        ]
        pair = (
            [f"{PRINTED_DRIFT[row // 2]:.2f}", f"{abs(mean[row + 1] - mean[row]):.2f}"]
            if row % 2 == 0
            else ["", ""]
        )
        table.append(line + pair)
    return [*table, ["first to last", "", "", "", "", f"{abs(mean[-1] - mean[0]):.2f}"]]


def drawn(found: xr.Dataset) -> Figure:
    """Return δ over the distance."""
    title = "Table 6.2: preliminary displacement along a run with measured friction, 5 N"
    looks = {"logarithmic": False, "from_zero": True, "title": title}
    return hs.plots.curve(found, quantity="preliminary_displacement", over="distance", **looks)


if __name__ == "__main__":
    result = calculated()
    for line in rows(result):
        print("  ".join(text.rjust(16) for text in line))
    drawn(result).savefig("table_6_2_friction_along_a_run.png")
