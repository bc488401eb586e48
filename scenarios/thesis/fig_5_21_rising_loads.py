"""Fig. 5.21: preliminary displacement of each level of a run whose load rises without release.

The runs are those of the scenario of the same name (50, 70, 90 mN). δ of a load has no memory: whatever came before,
it is that of Fig. 5.17, .9 and .8 nm more at 90 than at 50 mN.
"""

from pathlib import Path

import numpy as np
import xarray as xr

import historysim as hs
from historysim.results import analysis

BALLS = {"ZrO₂": ("zirconia", "24 nm", 0.17), "Al₂O₃": ("alumina", "21 nm", 0.16)}
LOADS = np.array([50e-3, 70e-3, 90e-3])


def calculated(seeds: int = 4) -> xr.Dataset:
    """Return δ [m] at the end of each level, over ball, normal load [N] and seed."""
    path = Path(__file__).with_suffix(".toml")
    values = np.empty((len(BALLS), LOADS.size, seeds))
    for row, (material, roughness, friction) in enumerate(BALLS.values()):
        for seed in range(1, seeds + 1):
            settings = {"materials.first": material, "surface.rms_height": roughness, "surface.seed": seed}
            history = hs.run(hs.load(path, settings | {"friction.coefficient": friction, "loading.substeps": 1}))
            found = analysis.preliminary_displacement(history).values
            for column, load in enumerate(LOADS):
                values[row, column, seed - 1] = found[np.isclose(history.total_normal_load, load)][-1]
    told = {"units": "m", "long_name": r"preliminary displacement $\delta$"}
    return xr.Dataset(
        {"preliminary_displacement": (("ball", "normal_load", "seed"), values, told)},
        {
            "ball": list(BALLS),
            "normal_load": ("normal_load", LOADS, {"units": "N"}),
            "seed": np.arange(1, seeds + 1),
        },
    )


def drawn(found: xr.Dataset) -> object:
    """Return the figure."""
    title = "Fig. 5.21: preliminary displacement of each level, the load rises without release"
    return hs.plot_swept(found, "preliminary_displacement", "normal_load", each="ball", title=title)


if __name__ == "__main__":
    print(calculated().preliminary_displacement.mean("seed").to_pandas())
