"""Random surfaces summit by summit, their spread by numpy, and against the scenarios that say the same."""

from pathlib import Path

import numpy as np
import pytest
from hertz_sums import SOFT, approaches, displacement

import historysim as hs

SCENARIOS = Path(__file__).parents[3] / "scenarios"
PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
LOADED = {"normal_load": "50 mN", "friction": 0.2, "pixel_size": "1 µm"}
STUDY = hs.design_studies


def test_roughness_and_what_is_chance():
    lengths = ["5 µm", "10 µm"]
    found = STUDY.roughness(
        PAIR, rms_height=["0.1 µm", 1e-6], autocorrelation_length=lengths, shape=(64, 64), seeds=range(4), **LOADED
    )
    assert dict(found.sizes) == {
        "surface_rms_height": 2,
        "surface_autocorrelation_length": 2,
        "surface_seed": 4,
        "quantile": 5,
    }
    summits = hs.random_surface((64, 64), 1e-6, 1e-6, 10e-6, seed=3).summits(rule=9)
    approach = approaches(50e-3, summits.height, summits.radius, SOFT[0])
    load = 4 / 3 * SOFT[0] * np.sqrt(summits.radius) * approach**1.5
    own = SOFT[0] / (4 * SOFT[1]) * 0.2 * approach
    cell = found.isel(surface_rms_height=1, surface_autocorrelation_length=1, surface_seed=3)
    assert cell.preliminary_displacement == pytest.approx(own.max(), rel=1e-8)
    assert cell.presliding_work == pytest.approx((0.2 * load * (4 * own.max() - 3.2 * own)).sum(), rel=1e-7)
    assert cell.peak_contact_area == pytest.approx((np.pi * summits.radius * approach).sum(), rel=1e-8)
    for name, unit in (("preliminary_displacement", "m"), ("presliding_work", "J"), ("peak_contact_area", "m2")):
        values = found[name].values
        np.testing.assert_allclose(found[f"{name}_mean"], values.mean(axis=-1), rtol=1e-13)
        np.testing.assert_allclose(found[f"{name}_standard_deviation"], values.std(axis=-1, ddof=1), rtol=1e-11)
        shares = found["quantile"].values
        expected = np.moveaxis(np.quantile(values, shares, axis=-1), 0, -1)
        np.testing.assert_allclose(found[f"{name}_quantile"], expected, rtol=1e-13)
        assert found[f"{name}_quantile"].attrs["units"] == unit
    # theory 8 and 11: displacement and work rise with the rms height
    assert (found.preliminary_displacement_mean.diff("surface_rms_height") > 0).all()
    assert (found.presliding_work_mean.diff("surface_rms_height") > 0).all()


def test_roughness_is_what_the_scenario_gives():
    chosen = {"rms_height": ["1 µm"], "autocorrelation_length": ["20 µm"], "seeds": [1, 2]}
    found = STUDY.roughness(PAIR, **chosen, **LOADED)
    over = {"surface.rms_height": ["1 µm"], "surface.autocorrelation_length": ["20 µm"], "surface.seed": [1, 2]}
    scenario = hs.sweep(SCENARIOS / "21_roughness.toml", over, outputs=["preliminary_displacement", "presliding_work"])
    for name, values in scenario.data_vars.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-12)


def test_nominal_area():
    shapes, seeds = [(64, 64), (128, 64)], {"from": 1, "count": 2}
    finish = {"rms_height": "24 nm", "autocorrelation_length": "20 µm"}
    found = STUDY.nominal_area(PAIR, shape=shapes, seeds=seeds, **finish, **LOADED)
    assert found.nominal_area.values == pytest.approx([64 * 64e-12, 128 * 64e-12], rel=1e-12)
    assert found.nominal_area.attrs["units"] == "m2"
    for index, shape in enumerate(shapes):
        summits = hs.random_surface(shape, 1e-6, 24e-9, 20e-6, seed=2).summits(rule=9)
        expected = displacement(50e-3, summits.height, summits.radius, 0.2, SOFT)
        assert found.preliminary_displacement.sel(surface_seed=2)[index] == pytest.approx(expected, rel=1e-8)
    over = {"surface.shape": [[64, 64]], "surface.seed": [1, 2]}
    scenario = hs.sweep(SCENARIOS / "22_nominal_area.toml", over)
    np.testing.assert_allclose(found.peak_contact_area[:1], scenario.peak_contact_area, rtol=1e-12)
    np.testing.assert_array_equal(found.peak_contact_count[:1], scenario.peak_contact_count)
    assert hs.plot(found).axes[0].get_xlabel() == "nominal area (µm²)"


@pytest.mark.parametrize("shape", [(64, 64), 64, []])
def test_one_shape_is_no_study_of_the_area(shape):
    with pytest.raises(hs.InputError, match=r"nominal_area: shape is .*; expected several \(nx, ny\)"):
        STUDY.nominal_area(PAIR, shape=shape, rms_height=1e-8, autocorrelation_length=1e-5, **LOADED)
