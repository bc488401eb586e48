"""Table 6.1: mean and standard deviation of radii and heights of summits, over the autocorrelation length.

Rq = 1 µm, pixels of 1 µm, exponential autocorrelation, 9-point rule. Each surface is 256 × 256 points cut out of a
larger one, its heights as they fall: periodic maps, centred to zero mean, hide how far the mean
height of a piece scatters. All ten means of the source are those of one such surface each; of its
deviations only the 1.23 µm at 60 µm is not.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

LENGTHS = (10e-6, 20e-6, 40e-6, 60e-6, 80e-6)
SOURCE = {
    "mean_summit_radius": (0.83, 1.15, 1.64, 1.97, 2.29),
    "summit_radius_deviation": (0.38, 0.52, 0.76, 0.89, 1.09),
    "mean_summit_height": (0.94, 0.77, 0.54, 0.60, 0.63),
    "summit_height_deviation": (0.87, 0.91, 0.96, 1.23, 0.94),
}
"""As printed [µm]."""
WHOLE, PIECE = 512, 256


def calculated(seeds: int = 3) -> xr.Dataset:
    """Return what `SOURCE` has, in m, and the number of summits, over β and seed: four pieces of each of some maps."""
    values = np.empty((len(SOURCE) + 1, len(LENGTHS), 4 * seeds))
    for row, length in enumerate(LENGTHS):
        for number in range(4 * seeds):
            seed, piece = divmod(number, 4)
            surface = hs.random_surface((WHOLE, WHOLE), 1e-6, 1e-6, length, seed=seed + 1)
            x, y = (
                (part * PIECE * 1e-6, (part * PIECE + PIECE - 1) * 1e-6)
                for part in divmod(piece, 2)
            )
            summits = surface.cropped(x=x, y=y).summits(rule=9)
            radius, height = summits.radius, summits.height
            told = (
                radius.mean(),
                radius.std(ddof=1),
                height.mean(),
                height.std(ddof=1),
                height.size,
            )
            values[:, row, number] = told
    # each piece is a separate surface with a separate seed
    dims = ("autocorrelation_length", "seed")
    found = {name: (dims, own, {"units": "m"}) for name, own in zip(SOURCE, values, strict=False)}
    return xr.Dataset(
        found | {"summit_count": (dims, values[-1], {"units": "1"})},
        {
            "autocorrelation_length": ("autocorrelation_length", list(LENGTHS), {"units": "m"}),
            "seed": np.arange(4 * seeds),
        },
    )


def rows(found: xr.Dataset) -> list[list[str]]:
    """Return the table, in µm: what the source prints, and mean ± deviation of one surface here."""
    table = [
        [
            "β (µm)",
            *(f"{name.replace('_', ' ')}, {who}" for name in SOURCE for who in ("source", "here")),
        ]
    ]
    for row, length in enumerate(LENGTHS):
        line = [f"{length * 1e6:g}"]
        for name, printed in SOURCE.items():
            own = found[name].values[row] * 1e6
            line += [f"{printed[row]:.2f}", f"{own.mean():.2f} ± {own.std(ddof=1):.2f}"]
        table.append(line)
    return table


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return radius and height over β."""
    titles = {
        "mean_summit_radius": "mean summit radius",
        "mean_summit_height": "mean summit height",
    }
    return [
        hs.plots.curve(
            found,
            quantity=name,
            unit="µm",
            from_zero=True,
            title=f"Table 6.1: {text} over autocorrelation length",
        )
        for name, text in titles.items()
    ]


if __name__ == "__main__":
    result = calculated()
    for line in rows(result):
        print("  ".join(text.rjust(14) for text in line))
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"table_6_1_summits_{number}.png")
