"""The design studies among the scenarios: their numbers against closed forms and against bisection on Hertz's law."""

from pathlib import Path

import numpy as np
from hertz_sums import HARD, SOFT, approaches, displacement
from numpy.testing import assert_allclose
from pytest import approx

import historysim as hs

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def swept(name, **values):
    return hs.sweep(hs.load(SCENARIOS / f"{name}.toml", values))


def test_17_equal_asperities_under_both_laws():
    found = swept("17_equal_asperities")
    count = np.array([1, 4, 16, 64])
    one = displacement(10e-3, 0.0, 0.5e-6, 0.5, HARD)
    similar, kept = found.preliminary_displacement
    assert_allclose(similar, one / np.sqrt(count), rtol=1e-9)
    assert_allclose(kept, one * count ** (-2 / 3), rtol=1e-9)
    # theory 8: n = 64 displaces 6.63 nm with the radius kept, against 13.26 nm
    assert 1e9 * similar[-1] == approx(13.26, abs=0.005)
    assert 1e9 * kept[-1] == approx(6.63, abs=0.005)
    area = found.peak_contact_area
    assert_allclose(area[0], area[0, 0], rtol=1e-9)
    assert_allclose(area[1], area.values[0, 0] * count ** (1 / 3), rtol=1e-9)


def test_18_tolerances_of_a_texture():
    found = swept("18_texture_tolerances", **{"sweep.over.surface.seed.count": 5})
    for scatter in (1e-9, 100e-9):
        summits = hs.textured_summits(
            (16, 16), 50e-6, 100e-6, height_scatter=scatter, radius_scatter=0.1, seed=3
        )
        expected = displacement(1.0, summits.height, summits.radius, 0.3, HARD)
        cell = found.sel(surface_height_scatter=scatter, surface_radius_scatter=0.1, surface_seed=3)
        assert cell.preliminary_displacement == approx(expected, rel=1e-8)
    spread = hs.sweep_statistics(found)
    mean, deviation = (
        spread.preliminary_displacement_mean,
        spread.preliminary_displacement_standard_deviation,
    )
    assert 1e9 * mean[0, 0] == approx(5.81, abs=0.005)
    # theory 11 has one draw of each
    draws = 1e-9 * np.array([6.85, 15.5, 62.7])
    assert (abs(mean[1:, 0] - draws) < 3 * deviation[1:, 0]).all()
    assert (abs(mean[:, 1] / mean[:, 0] - 1) < 0.01).all()


def test_19_one_large_asperity():
    found = swept("19_one_large_asperity").preliminary_displacement
    assert found.sizes == {"surface_radius_0": 5, "surface_height_0": 4}
    for (radius, height), value in np.ndenumerate(found):
        heights, radii = np.zeros(64), np.full(64, 0.5e-6)
        heights[0], radii[0] = found.surface_height_0[height], found.surface_radius_0[radius]
        assert value == approx(displacement(10e-3, heights, radii, 0.5, HARD), rel=1e-8)
    # equal ones; a large one at their level; half balls on one ground
    expected = {
        (0.5, 0): 6.63,
        (2, 0): 6.56,
        (0.55, 0.05): 37.7,
        (0.75, 0.25): 92.6,
        (2, 1.5): 66.8,
    }
    for (radius, height), value in expected.items():
        one = found.sel(
            surface_radius_0=1e-6 * radius, surface_height_0=1e-6 * height, method="nearest"
        )
        assert 1e9 * one == approx(value, rel=2e-3)


def test_20_change_of_radius_load_and_friction():
    found = swept("20_radius_load_friction")
    R, mu, N = np.meshgrid(
        found.surface_radius, [0.1, 0.2, 0.5], [30e-3, 50e-3, 70e-3], indexing="ij"
    )

    def one(load):
        return HARD[0] / (4 * HARD[1]) * mu * (9 * load**2 / (16 * HARD[0] ** 2 * R)) ** (1 / 3)

    before, after = one(50e-3), one(N)
    assert_allclose(found.drift, abs(after - before), rtol=1e-9, atol=1e-18)
    # theory 11: where the load rises it takes δ1 + δ2, where it falls 2 δ2, in place of 2 δ1
    branch = np.where(N > 50e-3, after - before, 2 * (before - after))
    assert_allclose(found.branch_drift, branch, rtol=1e-9, atol=1e-18)
    sharp = found.isel(surface_radius=0, friction_coefficient=2)
    assert 1e9 * sharp.branch_drift.values == approx([179.0, 0, 78.0], abs=0.2)
    along = hs.drift_along(found, "friction_coefficient")
    assert_allclose(along[:, 1], found.preliminary_displacement[:, 0], rtol=1e-9)


def test_21_roughness_over_rms_height_and_autocorrelation_length():
    few = {
        "seed.count": 3,
        "rms_height": ["1 µm", "5 µm"],
        "autocorrelation_length": ["5 µm", "80 µm"],
    }
    found = swept(
        "21_roughness", **{f"sweep.over.surface.{key}": value for key, value in few.items()}
    )
    surface = hs.random_surface((256, 256), 1e-6, 1e-6, 5e-6, seed=2)
    summits = surface.summits(rule=9)
    approach = approaches(50e-3, summits.height, summits.radius, SOFT[0])
    load = 4 / 3 * SOFT[0] * np.sqrt(summits.radius) * approach**1.5
    own = SOFT[0] / (4 * SOFT[1]) * 0.2 * approach
    cell = found.sel(surface_rms_height=1e-6, surface_autocorrelation_length=5e-6, surface_seed=2)
    assert cell.preliminary_displacement == approx(own.max(), rel=1e-8)
    assert cell.presliding_work == approx(
        (0.2 * load * (4 * own.max() - 3.2 * own)).sum(), rel=1e-7
    )
    mean = found.mean("surface_seed")
    # theory 8 and 11: displacement and work rise with the rms height
    assert (mean.preliminary_displacement.diff("surface_rms_height") > 0).all()
    assert (mean.presliding_work.diff("surface_rms_height") > 0).all()
    shortest, longest = mean.presliding_work.isel(surface_autocorrelation_length=[0, -1]).T
    assert (shortest > longest).all()


def test_22_nominal_area():
    found = swept("22_nominal_area", **{"sweep.over.surface.seed.count": 3})
    assert found.surface_shape.values.tolist() == [
        "[64, 64]",
        "[128, 128]",
        "[256, 256]",
        "[512, 512]",
    ]
    assert (found.peak_contact_count.mean("surface_seed").diff("surface_shape") > 0).all()
    area = found.peak_contact_area.mean("surface_seed")
    assert area[-1] / area[0] == approx(1.16, abs=0.15)
    summits = hs.random_surface((64, 64), 1e-6, 24e-9, 20e-6, seed=2).summits(rule=9)
    expected = displacement(50e-3, summits.height, summits.radius, 0.2, SOFT)
    assert found.preliminary_displacement.sel(surface_seed=2)[0] == approx(expected, rel=1e-8)


def test_23_the_finish_for_a_drift():
    found = hs.design(
        hs.load(SCENARIOS / "23_finish_for_a_drift.toml", {"design.over.surface.seed.count": 2})
    )
    for seed in (1, 2):
        value = float(found.surface_rms_height.sel(surface_seed=seed))
        summits = hs.random_surface((128, 128), 1e-6, value, 20e-6, seed=seed).summits(rule=9)
        at_rest, pressed = (
            displacement(load, summits.height, summits.radius, 0.2, SOFT) for load in (50e-3, 90e-3)
        )
        assert pressed - at_rest == approx(2e-9, rel=1e-5)
    assert 1e9 * found.surface_rms_height.values == approx([33.3, 37.4], abs=0.1)
