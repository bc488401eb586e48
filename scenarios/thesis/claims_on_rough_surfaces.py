"""Claims of the source on rough surfaces that no figure shows: area and friction, adhesion, load or friction, size.

Silicon on glass, μ = .2, generated surfaces (β = 20 µm, 9-point rule), 50 mN where no load is said.
Assumed: with a constant shear strength the friction force is τ₀ A, so that μ varies as A/N.

- The contact area is proportional to the load, and μ constant (2.3, 4.4.1, 5.5.1): the power of the
  area over the load.
- Adhesion does not matter on rough contacts (2.2.2, 7): what could pull, 1.5πWR of each asperity in
  contact (JKR).
- Load matters more than friction (6.2.1, 7): what 10 % more load does to δ, which 10 % more
  friction raises by 10 %.
- A larger nominal area is better predicted (6.2.2, 7): the relative deviation of δ between surfaces
  of one size.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

ROUGHNESS = np.array([24e-9, 0.1e-6, 1e-6])
LOADS = np.array([10e-3, 50e-3, 55e-3, 90e-3])
SIDES = np.array([64, 128, 256])
"""Points, and µm, along a side of a surface."""
MIDDLE = 1
"""Which load is 50 mN."""


def _ensembles(side: int, seed: int) -> list[hs.Ensemble]:
    """Return a surface at each roughness: heights go as Rq, radii as its inverse."""
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    summits = hs.random_surface((side, side), 1e-6, 1e-6, 20e-6, seed=seed).summits(rule=9)
    scale = ROUGHNESS / 1e-6
    return [
        hs.Ensemble(pair, summits.height * each, summits.radius / each, friction=0.2)
        for each in scale
    ]


def _numbers(ensemble: hs.Ensemble) -> tuple[list[float], list[float], float]:
    """Return δ [m] and contact area [m²] at each load, and the share of 50 mN with which adhesion could pull."""
    depth = np.array([ensemble.approach_at(load) for load in LOADS])
    approach = np.maximum(
        ensemble.summit_height - ensemble.summit_height.max() + depth[:, np.newaxis], 0.0
    )
    area = np.pi * (ensemble.summit_radius * approach).sum(axis=1)
    radii = ensemble.summit_radius[approach[MIDDLE] > 0]
    pull = 1.5 * np.pi * ensemble.pair.work_of_adhesion * radii.sum() / LOADS[MIDDLE]
    return list(ensemble.pair.displacement_ratio * 0.2 * depth), list(area), float(pull)


def calculated(seeds: int = 10, sizes: int = 40) -> xr.Dataset:
    """Return δ [m], area [m²] and adhesion over Rq, load and seed, and δ at 50 mN over side, Rq and surface."""
    found = [[_numbers(each) for each in _ensembles(256, seed)] for seed in range(1, seeds + 1)]
    reach, area, pull = (
        np.array([[one[part] for one in row] for row in found]) for part in range(3)
    )
    by_size = np.empty((SIDES.size, ROUGHNESS.size, sizes))
    for row, side in enumerate(SIDES):
        for seed in range(sizes):
            by_size[row, :, seed] = [
                _numbers(each)[0][MIDDLE] for each in _ensembles(int(side), seed + 1)
            ]
    dims = ("seed", "rms_height", "normal_load")
    return xr.Dataset(
        {
            "preliminary_displacement": (dims, reach, {"units": "m"}),
            "contact_area": (dims, area, {"units": "m2"}),
            "adhesion": (dims[:2], pull, {"units": "1"}),
            "displacement_of_size": (("side", "rms_height", "surface"), by_size, {"units": "m"}),
        },
        {
            "rms_height": ("rms_height", ROUGHNESS, {"units": "m"}),
            "normal_load": ("normal_load", LOADS, {"units": "N"}),
            "side": ("side", SIDES * 1e-6, {"units": "m", "long_name": "side of the surface"}),
        },
    )


def rows(found: xr.Dataset) -> list[list[str]]:
    """Return what the claims are about, over Rq, means of the surfaces."""
    area = found.contact_area.mean("seed")
    exponent = np.log(area[:, -1] / area[:, 0]) / np.log(LOADS[-1] / LOADS[0])
    friction = (area[:, -1] / LOADS[-1]) / (area[:, MIDDLE] / LOADS[MIDDLE]) - 1
    reach = found.preliminary_displacement.mean("seed")
    more = reach[:, MIDDLE + 1] / reach[:, MIDDLE] - 1
    sizes = found.displacement_of_size
    spread = sizes.std("surface", ddof=1) / sizes.mean("surface")
    names = ("24 nm", "0.1 µm", "1 µm")
    return [
        ["Rq", *names],
        [
            "power of the area over the load, 10 to 90 mN",
            *(f"{each:.3f}" for each in exponent.values),
        ],
        ["change of μ from 50 to 90 mN", *(f"{100 * each:.1f} %" for each in friction.values)],
        [
            "adhesion over the load",
            *(f"{100 * each:.2g} %" for each in found.adhesion.mean("seed").values),
        ],
        ["change of δ with 10 % more load", *(f"{100 * each:.1f} %" for each in more.values)],
        *(
            [f"relative deviation of δ, side of {side} µm", *(f"{each:.3f}" for each in own)]
            for side, own in zip(SIDES, spread.values, strict=True)
        ),
    ]


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return the area over the load, and δ over the side of the surface."""
    first = hs.plots.curve(
        found.isel(normal_load=[0, 1, 3]).transpose("rms_height", "normal_load", ...),
        quantity="contact_area",
        over="normal_load",
        each="rms_height",
        logarithmic=True,
        fit="power",
        title="Claim: the contact area is proportional to the load",
    )
    sizes = found[["displacement_of_size"]].rename(
        surface="seed", displacement_of_size="preliminary_displacement"
    )
    looks = {
        "over": "side",
        "each": "rms_height",
        "title": "Claim: a larger nominal area varies less",
    }
    return [
        first,
        hs.plots.curve(sizes, quantity="preliminary_displacement", from_zero=True, **looks),
    ]


if __name__ == "__main__":
    result = calculated()
    for line in rows(result):
        print("  ".join(text.ljust(46 if number == 0 else 9) for number, text in enumerate(line)))
    for number, figure in enumerate(drawn(result), 1):
        figure.savefig(f"claims_on_rough_surfaces_{number}.png")
