"""Figs. 5.17, 5.21 and 5.26, elastic and with summits that yield: δ of each level, from a virgin surface and in a run.

Zirconia on glass, generated surfaces (β = 20 µm), the hardness of glass, Kogut and Etsion's law. At
the printed Rq of 24 nm nothing yields: both are as in Fig. 5.17, δ of a load has no memory. At 300
nm and 1 µm nearly all of the load rests on flattened summits, δ is far less, and the order of loads
counts: raised without release each level is that of a virgin surface; lowered, δ falls more than it
rose. "Constant when the load falls" (Fig. 5.26) is not what yielding gives. The source's own balls
have a few far higher summits: these yield, which no Gaussian surface of this Rq shows.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

ROUGHNESS = np.array([24e-9, 300e-9, 1e-6])
LOADS = np.array([50e-3, 70e-3, 90e-3])
RUNS = {
    "constant": [[load] for load in LOADS],
    "rises": [list(LOADS)],
    "falls": [list(LOADS[::-1])],
}
LAWS = {"elastic": None, "yielding": "kogut-etsion"}


def _levels(ensemble: hs.Ensemble, loads: list[float]) -> list[float]:
    history = hs.replay(
        ensemble, [hs.NormalLoad(float(time), load) for time, load in enumerate(loads)]
    )
    return [float(each) for each in history.contact.preliminary_displacement().values]


def calculated(seeds: int = 4) -> xr.Dataset:
    """Return δ [m] over roughness [m], law, run, normal load [N] and seed."""
    pair = hs.MaterialPair(hs.material("zirconia"), hs.material("float glass"))
    values = np.empty((ROUGHNESS.size, len(LAWS), len(RUNS), LOADS.size, seeds))
    for row, rms in enumerate(ROUGHNESS):
        for seed in range(1, seeds + 1):
            summits = hs.random_surface((256, 256), 1e-6, rms, 20e-6, seed=seed).summits(rule=9)
            for column, law in enumerate(LAWS.values()):
                ensemble = hs.Ensemble.from_summits(pair, summits, 0.17, yielding=law)
                for number, (name, runs) in enumerate(RUNS.items()):
                    found = [level for loads in runs for level in _levels(ensemble, loads)]
                    values[row, column, number, :, seed - 1] = (
                        found[::-1] if name == "falls" else found
                    )
    return xr.Dataset(
        {
            "preliminary_displacement": (
                ("rms_height", "law", "run", "normal_load", "seed"),
                values,
                {"units": "m"},
            )
        },
        {
            "rms_height": ("rms_height", ROUGHNESS, {"units": "m"}),
            "law": list(LAWS),
            "run": list(RUNS),
            "normal_load": ("normal_load", LOADS, {"units": "N"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return a figure for each order of loads, at the roughness at which summits yield most."""
    return [
        hs.plots.curve(
            found.isel(rms_height=-1).sel(run=run),
            quantity="preliminary_displacement",
            over="normal_load",
            each="law",
            from_zero=True,
            title=f"Fig. {number}, Rq 1 µm: preliminary displacement of each level, the load {word}",
        )
        for number, run, word in (
            ("5.17", "constant", "constant"),
            ("5.21", "rises", "rising without release"),
            ("5.26", "falls", "falling without release"),
        )
    ]


if __name__ == "__main__":
    result = calculated()
    mean = result.preliminary_displacement.mean("seed") * 1e9
    for rms in mean.rms_height.values:
        for law in LAWS:
            print(
                f"Rq {rms * 1e9:g} nm, {law}",
                mean.sel(rms_height=rms, law=law).to_pandas().round(2),
                sep="\n",
            )
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"fig_5_17_to_5_26_yielding_{number}.png")
