"""Design studies as functions: each is what its scenario gives, and test_study_scenarios.py checks those."""

from pathlib import Path

import numpy as np
import pytest

import historysim as hs

SCENARIOS = Path(__file__).parents[2] / "scenarios"
HARD_PAIR = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
SOFT_PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
STUDIES = hs.design_studies
LOADED = {"normal_load": "50 mN", "friction": 0.2, "pixel_size": "1 µm"}
TEXTURE = {"count": (16, 16), "pitch": "50 µm", "radius": "100 µm", "normal_load": 1.0, "friction": 0.3}
EQUAL = {"radius": "0.5 µm", "normal_load": "10 mN", "friction": 0.5, "pitch": "2 µm"}
SCATTER = {"height_scatter": [0, "10 nm"], "radius_scatter": [0, 0.1], "seeds": [1, 2]}
RADII = {"from": "0.5 µm", "to": "50 µm", "count": 3, "spacing": "logarithmic"}
ROUGH = {"rms_height": ["1 µm"], "autocorrelation_length": ["20 µm"], "seeds": [1, 2]}


def same(found, scenario, over, rtol=1e-12, **options):
    """A study has the numbers of its scenario, but for rounding on the way to and fro between the loads."""
    expected = hs.sweep(SCENARIOS / f"{scenario}.toml", over, **options)
    for name, values in expected.data_vars.items():
        np.testing.assert_allclose(found[name], values, rtol=rtol, atol=1e-20)
        assert found[name].attrs == values.attrs


def test_equal_asperities():
    found = STUDIES.equal_asperities(HARD_PAIR, **EQUAL)
    same(found, "17_equal_asperities", None)
    assert found.asperity_count.values.tolist() == [1, 4, 16, 64]
    # one number, one law: no dimension
    alone = STUDIES.equal_asperities(HARD_PAIR, count=(8, 8), scaling="self-similar", **EQUAL)
    assert alone.preliminary_displacement.dims == ()
    assert alone.preliminary_displacement == found.preliminary_displacement.sel(surface_scaling="self-similar")[-1]
    # it is a sweep like any other, also to be shown and drawn
    assert dict(hs.show(found))["cells"] == "8"
    assert hs.plot(found).axes[0].get_xlabel() == "number of asperities"


def test_texture_tolerances():
    found = STUDIES.texture_tolerances(HARD_PAIR, **TEXTURE, **SCATTER)
    over = {"surface.height_scatter": [0, "10 nm"], "surface.radius_scatter": [0, 0.1], "surface.seed": [1, 2]}
    same(found, "18_texture_tolerances", over, outputs=["preliminary_displacement", "peak_contact_count"])
    values = found.preliminary_displacement.values
    np.testing.assert_allclose(found.preliminary_displacement_mean, values.mean(axis=-1), rtol=1e-13)


def test_radius_load_and_friction():
    found = STUDIES.radius_load_friction(
        HARD_PAIR, radius=RADII, normal_load="50 mN", friction=[0.1, 0.2, 0.5], later_load=["30 mN", "50 mN", "70 mN"]
    )
    same(found, "20_radius_load_friction", None, outputs=["preliminary_displacement", "drift", "branch_drift"])
    pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25, hardness=2.0, yield_stress=1.0)
    found = STUDIES.radius_load_friction(pair, radius=1.0, normal_load=[0.01, 0.02], friction=0.5)
    assert list(found.data_vars) == ["preliminary_displacement"]
    expected = 0.5 * (9 / 16 * np.array([0.01, 0.02]) ** 2) ** (1 / 3)
    np.testing.assert_allclose(found.preliminary_displacement, expected, rtol=1e-12)
    assert "yield_stress = 1.0" in found.attrs["scenario"]


def test_roughness():
    found = STUDIES.roughness(SOFT_PAIR, **ROUGH, **LOADED)
    over = {"surface.rms_height": ["1 µm"], "surface.autocorrelation_length": ["20 µm"], "surface.seed": [1, 2]}
    same(found, "21_roughness", over, outputs=["preliminary_displacement", "presliding_work"])
    assert found.preliminary_displacement_quantile.sizes["quantile"] == 5


def test_the_scenario_of_a_study_makes_it_again(tmp_path):
    load = [1e-3, 2e-3]
    found = STUDIES.radius_load_friction(HARD_PAIR, radius=["2 µm", 3e-6], normal_load=load, friction=0.2)
    (tmp_path / "s.toml").write_text(found.attrs["scenario"], encoding="utf-8")
    again = hs.sweep(tmp_path / "s.toml")
    assert found.identical(again.assign_attrs(title=found.attrs["title"]))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"count": 4}, "^equal_asperities: surface.count: 4; expected an array"),
        ({"friction": ["much"]}, "^equal_asperities: friction.coefficient: .*much"),
        ({"normal_load": []}, "no values; expected one or more"),
    ],
)
def test_an_error_names_the_study_and_the_value(given, message):
    with pytest.raises(hs.InputError, match=message):
        STUDIES.equal_asperities(SOFT_PAIR, **EQUAL | given)


def test_a_pair_is_a_pair():
    with pytest.raises(hs.InputError, match="equal_asperities: pair is 'silicon'; expected a MaterialPair"):
        STUDIES.equal_asperities("silicon", **EQUAL)
