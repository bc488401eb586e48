"""Figs. 6.9 and 6.10: preliminary displacement over the mean summit radius, for each β and each Rq.

Bars along x are mean ± standard deviation of the radii; along y the displacement with all radii one deviation smaller
and larger, heights as they are (6.2.2). Alumina on zirconia, 50 mN, μ = .5 (told for 6.10, assumed for 6.9). Fig.
6.9: β of 10 to 80 µm at Rq = 1 µm; bars are 28 nm long at 10 µm and 20 at 80 to either side, but relatively the same,
.14. Fig. 6.10: Rq of .1 to 5 µm at β = 20 µm; δ rises with Rq, against one sentence of 6.2.2.
"""

import numpy as np
import xarray as xr

import historysim as hs

LENGTHS = (10e-6, 20e-6, 40e-6, 60e-6, 80e-6)
ROUGHNESSES = (0.1e-6, 0.2e-6, 0.5e-6, 1e-6, 2e-6, 5e-6)
LOAD, FRICTION = 50e-3, 0.5
NAMES = ("mean_radius", "radius_low", "radius_high", "displacement", "low", "middle", "high")


def calculated(seeds: int = 8, points: int = 512) -> xr.Dataset:
    """Return radii and displacements [m], ``a_…`` of Fig. 6.9 over β, ``b_…`` of Fig. 6.10 over Rq, both over seeds."""
    pair = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
    a = np.empty((len(NAMES), len(LENGTHS), seeds))
    b = np.empty((len(NAMES), len(ROUGHNESSES), seeds))
    for seed in range(1, seeds + 1):
        for row, length in enumerate(LENGTHS):
            surface = hs.random_surface((points, points), 1e-6, 1e-6, length, seed=seed)
            a[:, row, seed - 1] = _numbers(pair, surface.summits(rule=9))
        for row, rms in enumerate(ROUGHNESSES):
            surface = hs.random_surface((256, 256), 1e-6, rms, 20e-6, seed=seed)
            b[:, row, seed - 1] = _numbers(pair, surface.summits(rule=9))
    found = {}
    for figure, dim, values in (("a", "autocorrelation_length", a), ("b", "rms_height", b)):
        for name, own in zip(NAMES, values, strict=True):
            found[f"{figure}_{name}"] = ((dim, "seed"), own, {"units": "m", "long_name": _called(name)})
    return xr.Dataset(
        found,
        {
            "autocorrelation_length": ("autocorrelation_length", list(LENGTHS), {"units": "m"}),
            "rms_height": ("rms_height", list(ROUGHNESSES), {"units": "m"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


def _called(name: str) -> str:
    return {"mean_radius": r"mean summit radius $\bar R$", "displacement": r"preliminary displacement $\delta$"}.get(
        name, name
    )


def _numbers(pair: hs.MaterialPair, summits: hs.Summits) -> tuple[float, ...]:
    """Return what `NAMES` says; δ also with all radii the mean, or one deviation off."""
    mean, deviation = summits.radius.mean(), summits.radius.std(ddof=1)
    low, high = mean - deviation, mean + deviation

    def displacement(radius: object) -> float:
        ensemble = hs.Ensemble(pair, summits.height, summit_radius=radius, friction=FRICTION)
        return float(pair.displacement_ratio * FRICTION * ensemble.approach_at(LOAD))

    # larger radii carry the load with less approach
    return mean, low, high, displacement(summits.radius), displacement(high), displacement(mean), displacement(low)


def drawn(found: xr.Dataset) -> list[object]:
    """Return both figures."""
    titles = {
        "a": "Fig. 6.9: preliminary displacement over mean summit radius for β of 10 to 80 µm, Rq 1 µm, 50 mN",
        "b": "Fig. 6.10: preliminary displacement over mean summit radius for Rq of 0.1 to 5 µm, β 20 µm, 50 mN",
    }
    figures = []
    for own, title in titles.items():
        ends = {"x": (f"{own}_radius_low", f"{own}_radius_high"), "y": (f"{own}_low", f"{own}_high")}
        # the bars stand around what the mean radius gives
        chosen = hs.plot_swept(found, f"{own}_middle", f"{own}_mean_radius", ends=ends, title=title)
        (axes,) = chosen.axes
        axes.set_ylabel("preliminary displacement $\\delta$ (nm)")
        real = found[[f"{own}_mean_radius", f"{own}_displacement"]].mean("seed") * 1e9
        along = real[f"{own}_mean_radius"] * 1e-3
        axes.plot(along, real[f"{own}_displacement"], "s", color="#d1603d", ms=4, label="radii as they are")
        axes.plot([], [], "o-", color="#12355b", ms=3.5, label="all radii the mean; bars ± standard deviation")
        axes.legend(loc="upper right")
        figures.append(chosen)
    return figures


if __name__ == "__main__":
    made = calculated().mean("seed") * 1e9
    for own in "ab":
        print(made[[f"{own}_{name}" for name in NAMES]].to_dataframe().round(1).to_string())
