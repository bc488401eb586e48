"""Figs. 6.9 and 6.10: preliminary displacement over the mean summit radius, for each β and each Rq.

Bars along x are mean ± standard deviation of the radii; along y the displacement with all radii one
deviation smaller and larger, heights as they are (6.2.2). Alumina on zirconia, 50 mN, μ = .5 (given
for 6.10, assumed for 6.9). Fig. 6.9: β of 10 to 80 µm at Rq = 1 µm; bars are longer at short β, but
relatively the same. Fig. 6.10: Rq of .1 to 5 µm at β = 20 µm; δ rises with Rq, against one sentence
of 6.2.2.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import historysim as hs

LENGTHS = (10e-6, 20e-6, 40e-6, 60e-6, 80e-6)
ROUGHNESSES = (0.1e-6, 0.2e-6, 0.5e-6, 1e-6, 2e-6, 5e-6)
LOAD, FRICTION = 50e-3, 0.5
RADII = ("all radii the mean; bars: one deviation less, and more", "radii as they are")


def calculated(seeds: int = 8, points: int = 512) -> xr.Dataset:
    """Return radii and displacements [m], ``a_…`` of Fig. 6.9 over β, ``b_…`` of Fig. 6.10 over Rq, both over seeds.

    ``displacement``, ``low`` and ``high`` go over ``radii``, too: all of them the mean, with what
    one deviation more and less of it gives, or as they are.
    """
    pair = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
    a, b = (np.empty((6, 2, len(values), seeds)) for values in (LENGTHS, ROUGHNESSES))
    for seed in range(1, seeds + 1):
        for row, length in enumerate(LENGTHS):
            surface = hs.random_surface((points, points), 1e-6, 1e-6, length, seed=seed)
            a[:, :, row, seed - 1] = _numbers(pair, surface.summits(rule=9))
        for row, rms in enumerate(ROUGHNESSES):
            surface = hs.random_surface((256, 256), 1e-6, rms, 20e-6, seed=seed)
            b[:, :, row, seed - 1] = _numbers(pair, surface.summits(rule=9))
    names = ("mean_summit_radius", "radius_low", "radius_high", "displacement", "low", "high")
    called = {
        "mean_summit_radius": r"mean summit radius $\bar R$",
        "displacement": r"preliminary displacement $\delta$",
    }
    found = {
        f"{figure}_{name}": (
            ("radii", dim, "seed"),
            own,
            {"units": "m", "long_name": called.get(name, name)},
        )
        for figure, dim, values in (("a", "autocorrelation_length", a), ("b", "rms_height", b))
        for name, own in zip(names, values, strict=True)
    }
    return xr.Dataset(
        found,
        {
            "autocorrelation_length": ("autocorrelation_length", list(LENGTHS), {"units": "m"}),
            "rms_height": ("rms_height", list(ROUGHNESSES), {"units": "m"}),
            "radii": list(RADII),
            "seed": np.arange(1, seeds + 1),
        },
    )


def _numbers(pair: hs.MaterialPair, summits: hs.Summits) -> list[tuple[float, float]]:
    """Return a radius and its ends, δ and its ends: with all radii alike, and with them as they are."""
    mean, deviation = summits.radius.mean(), summits.radius.std(ddof=1)

    def displacement(radius: object) -> float:
        ensemble = hs.Ensemble(pair, summits.height, summit_radius=radius, friction=FRICTION)
        return float(pair.displacement_ratio * FRICTION * ensemble.approach_at(LOAD))

    real = displacement(summits.radius)
    # larger radii carry the load with less approach
    low, middle, high = (displacement(mean + sign * deviation) for sign in (1, 0, -1))
    return [
        (mean, mean),
        (mean - deviation, mean),
        (mean + deviation, mean),
        (middle, real),
        (low, real),
        (high, real),
    ]


def _name_points(axes: Axes, found: xr.Dataset, own: str) -> None:
    """Write β, or Rq, above the points of the real radii."""
    values, symbol = (LENGTHS, "β") if own == "a" else (ROUGHNESSES, "Rq")
    real = found.isel(radii=1).mean("seed")
    points = zip(
        real[f"{own}_mean_summit_radius"].values,
        real[f"{own}_displacement"].values,
        values,
        strict=True,
    )
    for number, (radius, displacement, value) in enumerate(points):
        name = f"{symbol} = {value * 1e6:g} µm" if number == 0 else f"{value * 1e6:g}"
        axes.annotate(
            name, (radius * 1e6, displacement * 1e9), (4, 5), textcoords="offset points", fontsize=7
        )


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return both figures."""
    titles = {
        "a": "Fig. 6.9: preliminary displacement over mean summit radius for β of 10 to 80 µm, Rq 1 µm, 50 mN",
        "b": "Fig. 6.10: preliminary displacement over mean summit radius for Rq of 0.1 to 5 µm, β 20 µm, 50 mN",
    }
    figures = []
    for own, title in titles.items():
        ends = {
            "x": (f"{own}_radius_low", f"{own}_radius_high"),
            "y": (f"{own}_low", f"{own}_high"),
        }
        names = {"quantity": f"{own}_displacement", "over": f"{own}_mean_summit_radius"}
        looks = {"unit": "nm", "over_unit": "µm"}
        figure = hs.plots.curve(found, **names, each="radii", ends=ends, title=title, **looks)
        _name_points(figure.axes[0], found, own)
        figures.append(figure)
    return figures


if __name__ == "__main__":
    result = calculated()
    made = result.mean("seed") * 1e9
    for own in "ab":
        names = [str(name) for name in made.data_vars if str(name).startswith(own)]
        print(made[names].to_dataframe().round(1).to_string())
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"fig_6_09_and_6_10_mean_radius_{number}.png")
