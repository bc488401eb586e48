"""Figs. 5.21 and 5.26: preliminary displacement of each level of a run without release, zirconia and alumina on glass.

The runs are those of fig_5_19_rising_loads.toml (50, 70, 90 mN) and fig_5_24_falling_loads.toml
(90, 70, 50 mN). δ of a load has no memory: whatever was before, it is that of Fig. 5.17.
"""

# historysim gallery: example

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

RUNS = {"rises": "fig_5_19_rising_loads.toml", "falls": "fig_5_24_falling_loads.toml"}
BALLS = {"ZrO₂": ("zirconia", "24 nm", 0.17), "Al₂O₃": ("alumina", "21 nm", 0.16)}
LOADS = np.array([50e-3, 70e-3, 90e-3])


def calculated(seeds: int = 4) -> xr.Dataset:
    """Return δ [m] at the end of each level, over run, ball, normal load [N] and seed."""
    values = np.empty((len(RUNS), len(BALLS), LOADS.size, seeds))
    for run, file in enumerate(RUNS.values()):
        for row, (material, roughness, friction) in enumerate(BALLS.values()):
            for seed in range(1, seeds + 1):
                settings = {
                    "materials.first": material,
                    "surface.rms_height": roughness,
                    "surface.seed": seed,
                }
                settings |= {"friction.coefficient": friction, "loading.substeps": 1}
                history = hs.run(hs.load(Path(__file__).with_name(file), settings))
                found = hs.analysis.preliminary_displacement(history).values
                ends = [found[np.isclose(history.total_normal_load, load)][-1] for load in LOADS]
                values[run, row, :, seed - 1] = ends
    return xr.Dataset(
        {
            "preliminary_displacement": (
                ("run", "ball", "normal_load", "seed"),
                values,
                {"units": "m"},
            )
        },
        {
            "run": list(RUNS),
            "ball": list(BALLS),
            "normal_load": ("normal_load", LOADS, {"units": "N"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return both figures."""
    return [
        hs.plots.curve(
            found.sel(run=run),
            quantity="preliminary_displacement",
            over="normal_load",
            each="ball",
            from_zero=True,
            title=f"Fig. {number}: preliminary displacement of each level, the load {run} without release",
        )
        for number, run in (("5.21", "rises"), ("5.26", "falls"))
    ]


if __name__ == "__main__":
    result = calculated()
    for run, own in result.preliminary_displacement.mean("seed").groupby("run", squeeze=False):
        print(run, (own.squeeze("run").to_pandas() * 1e9).round(2), sep="\n")
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"fig_5_21_and_5_26_levels_{number}.png")
