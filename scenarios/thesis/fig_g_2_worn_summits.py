"""Fig. G.2 a to d: radius over height of the summits of worn maps.

Ball and plate, 100 and 1000 m, each at 1 and 5 N, in ambient and vacuum. The measured maps are not
published. Assumed: one generated surface (β = 20 µm, 256 × 256 points of 1 µm), scaled to the Rq of
Table B.3, so that radii go as 1/Rq. Rq alone would halve the plate's radii from 1 to 5 N at 1000 m
in ambient, where the text lets zirconia's radii rise with the load: the maps themselves are needed.
`kind = "measured"` reads real ones.
"""

# historysim gallery: example

from functools import cache

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

CASES = ("1 N ambient", "1 N vacuum", "5 N ambient", "5 N vacuum")
PANELS = {
    "a  alumina ball, 100 m": (0.68, 0.15, 0.73, 0.21),
    "b  alumina ball, 1000 m": (0.42, 0.37, 0.48, 0.54),
    "c  zirconia plate, 100 m": (0.67, 1.10, 0.67, 1.16),
    "d  zirconia plate, 1000 m": (0.89, 1.18, 1.84, 1.40),
}
"""Rq [µm] of Table B.3."""


@cache
def _summits(rms: float) -> hs.Summits:
    return hs.random_surface((256, 256), 1e-6, rms * 1e-6, 20e-6, seed=1).summits(rule=9)


def calculated() -> xr.Dataset:
    """Return mean radius and height [m] of the summits over panel and case."""
    means = [
        [(each.radius.mean(), each.height.mean()) for each in map(_summits, row)]
        for row in PANELS.values()
    ]
    values = np.array(means)
    dims = ("panel", "case")
    return xr.Dataset(
        {
            "mean_summit_radius": (dims, values[..., 0], {"units": "m"}),
            "mean_summit_height": (dims, values[..., 1], {"units": "m"}),
        },
        {"panel": list(PANELS), "case": list(CASES)},
    )


def drawn(found: xr.Dataset) -> list[Figure]:  # noqa: ARG001 - the clouds, and not their means
    """Return the four panels."""
    return [
        hs.plots.summits(
            [_summits(rms) for rms in row], labels=CASES, apart=True, title=f"Fig. G.2 {name}"
        )
        for name, row in PANELS.items()
    ]


if __name__ == "__main__":
    result = calculated()
    print((result.mean_summit_radius.to_pandas() * 1e6).round(2))
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"fig_g_2_worn_summits_{number}.png")
