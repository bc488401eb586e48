"""Design studies as functions: each is what its scenario gives, and test_study_scenarios.py checks those."""

from pathlib import Path

import numpy as np
import pytest
from hertz_sums import HARD, displacement

import historysim as hs
from historysim.studies.design import summary

SCENARIOS = Path(__file__).parents[2] / "scenarios"
HARD_PAIR = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
SOFT_PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
STUDIES = hs.design_studies
LOADED = {"normal_load": "50 mN", "friction": 0.2, "pixel_size": "1 µm"}
TEXTURE = {"count": (16, 16), "pitch": "50 µm", "radius": "100 µm", "normal_load": 1.0, "friction": 0.3}
EQUAL = {"radius": "0.5 µm", "normal_load": "10 mN", "friction": 0.5, "pitch": "2 µm"}
LARGE = {"count": 64, "radius": "0.5 µm", "normal_load": "10 mN", "friction": 0.5}
FINISH = {"normal_load": ("50 mN", "90 mN"), "friction": 0.2, "autocorrelation_length": "20 µm", "drift": "2 nm"}
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


@pytest.mark.parametrize(("standing", "expected"), [("ground", [37.7, 92.6, 66.8]), ("level", [6.63, 6.62, 6.56])])
def test_one_large_asperity(standing, expected):
    """Theory 11, in nm."""
    radii = np.array([0.55e-6, 0.75e-6, 2e-6])
    found = STUDIES.one_large_asperity(HARD_PAIR, large_radius=radii, standing=standing, **LARGE)
    assert 1e9 * found.preliminary_displacement.values == pytest.approx(expected, rel=2e-3)
    if standing == "ground":
        np.testing.assert_allclose(found.surface_height_0, radii - 0.5e-6, rtol=1e-12)


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


def test_nominal_area():
    finish = {"rms_height": "24 nm", "autocorrelation_length": "20 µm", "seeds": {"from": 1, "count": 2}}
    found = STUDIES.nominal_area(SOFT_PAIR, shape=[(64, 64), (128, 64)], **finish, **LOADED)
    assert found.nominal_area.values == pytest.approx([64 * 64e-12, 128 * 64e-12], rel=1e-12)
    assert found.nominal_area.attrs["units"] == "m2"
    over = {"surface.shape": [[64, 64], [128, 64]], "surface.seed": [1, 2]}
    same(found, "22_nominal_area", over, outputs=["preliminary_displacement", "peak_contact_area"])
    assert hs.plot(found).axes[0].get_xlabel() == "nominal area (µm²)"


def test_the_finish_for_a_drift():
    found = STUDIES.finish_for_a_drift(SOFT_PAIR, shape=(64, 64), between=("5 nm", "200 nm"), seeds=[1, 2], **FINISH)
    given = {"surface.shape": [64, 64], "design.between": ["5 nm", "200 nm"], "design.over.surface.seed.count": 2}
    scenario = hs.design(hs.load(SCENARIOS / "23_finish_for_a_drift.toml", given))
    np.testing.assert_allclose(found.surface_rms_height, scenario.surface_rms_height, rtol=1e-8)


def test_the_texture_for_a_drift_is_that_of_hertz():
    """n equal asperities drift by θμ (9/(16 E*² n² R))^(1/3) (N2^(2/3) - N1^(2/3))."""
    texture = {"count": (4, 4), "pitch": "200 µm", "friction": 0.3, "normal_load": ("1 N", "1.4 N"), "drift": "5 nm"}
    found = STUDIES.texture_for_a_drift(HARD_PAIR, between=("10 µm", "10 mm"), **texture)
    of_one_metre = displacement(1.4 / 16, 0.0, 1.0, 0.3, HARD) - displacement(1.0 / 16, 0.0, 1.0, 0.3, HARD)
    assert found.surface_radius.values == pytest.approx([(of_one_metre / 5e-9) ** 3], rel=1e-7)
    assert dict(summary(found))["surface.radius"] == f"{1e6 * found.surface_radius.item():.4g} µm"


def test_the_scenario_of_a_study_makes_it_again(tmp_path):
    found = STUDIES.one_large_asperity(
        HARD_PAIR, count=3, radius=1e-6, large_radius=["2 µm", 3e-6], normal_load=[1e-3, 2e-3], friction=0.2
    )
    (tmp_path / "s.toml").write_text(found.attrs["scenario"], encoding="utf-8")
    again = hs.sweep(tmp_path / "s.toml")
    assert found.identical(again.assign_attrs(title=found.attrs["title"]))


WRONG = {
    "one_large_asperity": (
        LARGE | {"large_radius": 2e-6},
        [
            ({"standing": "grund"}, "one_large_asperity: standing is 'grund'; did you mean 'gro"),
            ({"count": 0}, "one_large_asperity: count is 0; expected a whole number of 1 or"),
            ({"radius": "1 N"}, "one_large_asperity.radius: '1 N': 'N' is not a unit of a len"),
            ({"large_radius": []}, "one_large_asperity.large_radius: no values; expected one"),
        ],
    ),
    "equal_asperities": (
        EQUAL,
        [
            ({"count": 4}, "^equal_asperities: surface.count: 4; expected an array"),
            ({"count": (0, 1)}, "equal_asperities: surface: count is"),
            ({"scaling": "similar"}, "equal_asperities: surface.scaling.*similar"),
            ({"friction": ["much"]}, "^equal_asperities: friction.coefficient: .*much"),
            ({"normal_load": []}, "no values; expected one or more"),
            ({"radius": None}, "^equal_asperities: surface.radius: None; expected a number"),
        ],
    ),
    "nominal_area": (
        LOADED | {"rms_height": 1e-8, "autocorrelation_length": 1e-5},
        [({"shape": shape}, "^nominal_area: surface.shape") for shape in (64, [], [(64, 64), 64])],
    ),
    "finish_for_a_drift": (
        FINISH,
        [
            ({"normal_load": "50 mN"}, "finish_for_a_drift: normal_load: '50 mN'; expected two values"),
            ({"between": (2e-9, 1e-9)}, "finish_for_a_drift: design.between: 2e-09 and 1e-09; expected the least"),
            ({"drift": "2 N"}, "finish_for_a_drift: design.target: '2 N': 'N' is not a unit of a length"),
            ({"seeds": []}, "finish_for_a_drift.seeds: no values; expected one or more"),
            ({"drift": "1 mm", "shape": (64, 64), "seeds": [1]}, "no value of surface.rms_height was found; drift is"),
        ],
    ),
}


@pytest.mark.parametrize(
    ("study", "given", "message"),
    [(study, given | wrong, message) for study, (given, cases) in WRONG.items() for wrong, message in cases],
)
def test_an_error_names_the_study_and_the_value(study, given, message):
    with pytest.raises(hs.InputError, match=message):
        getattr(STUDIES, study)(SOFT_PAIR, **given)


def test_a_pair_is_a_pair():
    with pytest.raises(hs.InputError, match="equal_asperities: pair is 'silicon'; expected a MaterialPair"):
        STUDIES.equal_asperities("silicon", **EQUAL)
