"""Table 6.1: mean height and mean radius of the summits of random surfaces, over the autocorrelation length.

Rq = 1 µm, 512 × 512 points of 1 µm, exponential autocorrelation, 9-point rule. The source has mean heights of .60 and
.63 µm at 60 and 80 µm; they fall throughout, to about .42 and .37 µm there.
"""

# historysim gallery: example

import numpy as np
import xarray as xr

import historysim as hs

LENGTHS = (20e-6, 40e-6, 60e-6, 80e-6)
POINTS = 512


def calculated(seeds: int = 5) -> xr.Dataset:
    """Return mean summit height and radius [m], and the number of summits, over autocorrelation length [m] and seed."""
    values = np.empty((3, len(LENGTHS), seeds))
    for index, length in enumerate(LENGTHS):
        for seed in range(1, seeds + 1):
            surface = hs.random_surface(
                (POINTS, POINTS), pixel_size=1e-6, rms_height=1e-6, autocorrelation_length=length, seed=seed
            )
            summits = surface.summits(rule=9)
            values[:, index, seed - 1] = summits.height.mean(), summits.radius.mean(), summits.height.size
    dims = ("autocorrelation_length", "seed")
    return xr.Dataset(
        {
            "mean_summit_height": (dims, values[0], {"units": "m"}),
            "mean_summit_radius": (dims, values[1], {"units": "m"}),
            "summit_count": (dims, values[2], {"units": "1"}),
        },
        {
            "autocorrelation_length": ("autocorrelation_length", list(LENGTHS), {"units": "m"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


if __name__ == "__main__":
    print(calculated().mean("seed").to_dataframe())
