"""Table G.1: rms slope, rms curvature and bandwidth of generated surfaces, over the autocorrelation length.

Rq = 1 µm, 256 × 256 points of 1 µm. Assumed: that this table shows generated surfaces. Slopes are those between
neighbouring points: for an autocorrelation ρ their mean square along x is 2 Rq² (1 - ρ(p))/p² at the pixel size p.
"""

# historysim gallery: example

import numpy as np
import xarray as xr

import historysim as hs

KINDS = ("exponential", "gaussian")
LENGTHS = (10e-6, 20e-6, 40e-6)
POINTS = 256


def calculated(seeds: int = 5) -> xr.Dataset:
    """Return rms slope along x or y [1], rms curvature [1/m] and bandwidth [1] over kind, length [m] and seed."""
    values = np.empty((3, len(KINDS), len(LENGTHS), seeds))
    for row, kind in enumerate(KINDS):
        for index, length in enumerate(LENGTHS):
            for seed in range(1, seeds + 1):
                surface = hs.random_surface(
                    (POINTS, POINTS),
                    pixel_size=1e-6,
                    rms_height=1e-6,
                    autocorrelation_length=length,
                    seed=seed,
                    autocorrelation=kind,
                )
                found = surface.statistics()
                slope = np.sqrt(found.moments.m2)
                values[:, row, index, seed - 1] = slope, found.rms_curvature, found.bandwidth
    dims = ("autocorrelation", "autocorrelation_length", "seed")
    return xr.Dataset(
        {
            "rms_slope": (dims, values[0], {"units": "1"}),
            "rms_curvature": (dims, values[1], {"units": "m-1"}),
            "bandwidth": (dims, values[2], {"units": "1"}),
        },
        {
            "autocorrelation": list(KINDS),
            "autocorrelation_length": ("autocorrelation_length", list(LENGTHS), {"units": "m"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


if __name__ == "__main__":
    print(calculated().mean("seed").to_dataframe())
