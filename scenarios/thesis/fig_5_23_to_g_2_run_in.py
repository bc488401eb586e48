"""Figs. 5.23, 6.15 to 6.17 and G.2, with maps that are run in: summits yield and wear, and are found anew.

Alumina on zirconia, generated maps (Rq 1.18 µm, the sum of the vacuum pair at 5 N and 100 m of
Table B.3, β = 20 µm, 128 × 128 points of 1 µm), μ = .3, eight passes of 10 mm under the load, Kogut
and Etsion's law with H = 12.5 GPa, Archard's with K = 1e-6; what is cut off is lost. The real maps
are not published; a contact is smaller than a pixel, so that a pass lowers the points of the
summits that it meets. What the passes do:

- δ is far less in the first pass than by Hertz, and less again in the last: the direction of Fig.
  5.23, "after the test less", not its two orders of magnitude;
- the radii of the summits that touch double, where G.2 has them fall with the distance;
- maps spread less, as the source claims of run-in surfaces. Most of it is the immediate effect of
  yielding.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs
from historysim.asperities.running_in import Pass, run_in

LOADS = np.array([1.0, 5.0])
RMS_HEIGHT, FRICTION, DISTANCE = 1.18e-6, 0.3, 10e-3
HARDNESS = 12.5e9


def _elastic(pair: hs.MaterialPair, surface: hs.Surface, load: float) -> float:
    ensemble = hs.Ensemble.from_summits(pair, surface.summits(rule=9), FRICTION)
    return float(pair.displacement_ratio * FRICTION * ensemble.approach_at(load))


def calculated(seeds: int = 6, passes: int = 8, points: int = 128) -> xr.Dataset:
    """Return δ and the median radius of the summits that touch [m] over load [N], pass and seed; elastic δ before."""
    pair = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
    wear = hs.wear.ArchardWear(coefficient=1e-6, hardness=HARDNESS)
    displacement, radius = np.empty((2, LOADS.size, passes, seeds))
    elastic = np.empty((LOADS.size, seeds))
    for row, load in enumerate(LOADS):
        for seed in range(1, seeds + 1):
            surface = hs.random_surface((points, points), 1e-6, RMS_HEIGHT, 20e-6, seed=seed)
            steps = [Pass(load, DISTANCE)] * passes
            _, records = run_in(
                surface, pair, steps, friction=FRICTION, yielding="kogut-etsion", wear=wear
            )
            elastic[row, seed - 1] = _elastic(pair, surface, load)
            for number, one in enumerate(records):
                displacement[row, number, seed - 1] = one.preliminary_displacement
                radius[row, number, seed - 1] = np.median(one.summits.radius[one.touching])
    dims = ("normal_load", "pass", "seed")
    return xr.Dataset(
        {
            "preliminary_displacement": (dims, displacement, {"units": "m"}),
            "touching_radius": (dims, radius, {"units": "m"}),
            "elastic_displacement": (("normal_load", "seed"), elastic, {"units": "m"}),
        },
        {
            "normal_load": ("normal_load", LOADS, {"units": "N"}),
            "pass": np.arange(1, passes + 1),
            "seed": np.arange(1, seeds + 1),
        },
    )


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return δ over the passes, and the summits of one map before and after."""
    pair = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
    surface = hs.random_surface((128, 128), 1e-6, RMS_HEIGHT, 20e-6, seed=1)
    after, _ = run_in(surface, pair, [Pass(5.0)] * 4, friction=FRICTION, yielding="kogut-etsion")
    return [
        hs.plots.curve(
            found.drop_vars("elastic_displacement"),
            quantity="preliminary_displacement",
            over="pass",
            each="normal_load",
            from_zero=True,
            title="Run in: preliminary displacement before each pass",
        ),
        hs.plots.summits(
            [each.summits(rule=9) for each in (surface, after)],
            labels=("as it comes", "after four passes of 5 N"),
            title="Fig. G.2, calculated: radius over height of the summits, before and after",
        ),
    ]


if __name__ == "__main__":
    result = calculated()
    for name in ("preliminary_displacement", "touching_radius"):
        mean, spread = result[name].mean("seed"), result[name].std("seed")
        print(
            name, (mean * 1e9).round(1).to_pandas(), (spread / mean).round(3).to_pandas(), sep="\n"
        )
    print("elastic", (result.elastic_displacement.mean("seed") * 1e9).round(1).values, "nm")
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"fig_5_23_to_g_2_run_in_{number}.png")
