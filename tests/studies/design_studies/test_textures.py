"""Textures by closed forms, by bisection on Hertz, and against the scenarios that say the same."""

from pathlib import Path

import numpy as np
import pytest
from hertz_sums import HARD, displacement

import historysim as hs

SCENARIOS = Path(__file__).parents[3] / "scenarios"
PAIR = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
studies = hs.design_studies


def test_equal_asperities_under_both_laws():
    """Theory 8: 13.26 nm self-similar, 6.63 nm with the radius kept, of 64 in place of one of 0.5 µm under 10 mN."""
    of_one = {"radius": "0.5 µm", "normal_load": "10 mN", "friction": 0.5}
    found = studies.equal_asperities(PAIR, pitch="2 µm", **of_one)
    count = np.array([1, 4, 16, 64])
    assert found.asperity_count.values.tolist() == count.tolist()
    similar, kept = (found.sel(surface_scaling=law) for law in ("self-similar", "curvature-invariant"))
    one = displacement(10e-3, 0.0, 0.5e-6, 0.5, HARD)
    np.testing.assert_allclose(similar.preliminary_displacement, one / np.sqrt(count), rtol=1e-9)
    np.testing.assert_allclose(kept.preliminary_displacement, one * count ** (-2 / 3), rtol=1e-9)
    np.testing.assert_allclose(similar.peak_contact_area, similar.peak_contact_area[0], rtol=1e-9)
    np.testing.assert_allclose(kept.peak_contact_area / kept.peak_contact_area[0], count ** (1 / 3), rtol=1e-9)
    scenario = hs.sweep(SCENARIOS / "17_equal_asperities.toml")
    for name, values in scenario.data_vars.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-13)
        assert found[name].attrs == values.attrs
    # one number, one law: no dimension
    alone = studies.equal_asperities(PAIR, pitch="2 µm", count=(8, 8), scaling="self-similar", **of_one)
    assert alone.preliminary_displacement.dims == ()
    assert alone.preliminary_displacement == similar.preliminary_displacement[-1]
    # it is a sweep like any other, also to be shown and drawn, and its scenario makes it again
    assert dict(hs.show(found))["cells"] == "8"
    assert hs.plot(found).axes[0].get_xlabel() == "number of asperities"


def test_the_scenario_of_a_study_makes_it_again(tmp_path):
    found = studies.one_large_asperity(
        PAIR, count=3, radius=1e-6, large_radius=["2 µm", 3e-6], normal_load=[1e-3, 2e-3], friction=0.2
    )
    (tmp_path / "s.toml").write_text(found.attrs["scenario"], encoding="utf-8")
    again = hs.sweep(tmp_path / "s.toml")
    assert found.identical(again.assign_attrs(title=found.attrs["title"]))


def test_tolerances_of_a_texture():
    """Without scatter by Hertz alone; with it summit by summit, and over the seeds as numpy says."""
    heights, seeds = [0, "1 nm", "10 nm"], [1, 2, 3]
    texture = {"count": (4, 6), "pitch": "50 µm", "radius": "100 µm", "normal_load": 1.0, "friction": 0.3}
    found = studies.texture_tolerances(PAIR, **texture, height_scatter=heights, radius_scatter=[0, 0.1], seeds=seeds)
    one = displacement(1.0 / 24, 0.0, 100e-6, 0.3, HARD)
    np.testing.assert_allclose(found.preliminary_displacement[0, 0], one, rtol=1e-9)
    for seed in seeds:
        drawn = {"height_scatter": 10e-9, "radius_scatter": 0.1, "seed": seed}
        summits = hs.textured_summits((4, 6), 50e-6, 100e-6, **drawn)
        cell = found.sel(surface_height_scatter=10e-9, surface_radius_scatter=0.1, surface_seed=seed)
        expected = displacement(1.0, summits.height, summits.radius, 0.3, HARD)
        assert cell.preliminary_displacement == pytest.approx(expected, rel=1e-8)
    values = found.preliminary_displacement.values
    np.testing.assert_allclose(found.preliminary_displacement_mean, values.mean(axis=-1), rtol=1e-13)
    deviation = found.preliminary_displacement_standard_deviation
    np.testing.assert_allclose(deviation, values.std(axis=-1, ddof=1), rtol=1e-12, atol=1e-24)
    middle = found.preliminary_displacement_quantile.sel(quantile=0.5)
    np.testing.assert_allclose(middle, np.median(values, axis=-1), rtol=1e-13)
    assert found.preliminary_displacement_mean.attrs["units"] == "m"


@pytest.mark.parametrize("standing", ["ground", "level"])
def test_one_large_asperity(standing):
    """Theory 11: on one ground 37.7, 92.6 and 66.8 nm with 0.55, 0.75 and 2 µm; at one level 6.63 to 6.56 nm."""
    radii = np.array([0.55e-6, 0.75e-6, 2e-6])
    found = studies.one_large_asperity(
        PAIR, count=64, radius="0.5 µm", large_radius=radii, normal_load="10 mN", friction=0.5, standing=standing
    ).preliminary_displacement
    for radius, value in zip(radii, found.values, strict=True):
        heights, others = np.zeros(64), np.full(64, 0.5e-6)
        heights[0], others[0] = radius - 0.5e-6 if standing == "ground" else 0.0, radius
        assert value == pytest.approx(displacement(10e-3, heights, others, 0.5, HARD), rel=1e-8)
    told = [37.7, 92.6, 66.8] if standing == "ground" else [6.63, 6.62, 6.56]
    assert 1e9 * found.values == pytest.approx(told, rel=2e-3)
    # the last stands alone
    if standing == "ground":
        assert found[2] == pytest.approx(displacement(10e-3, 0.0, 2e-6, 0.5, HARD), rel=1e-9)
        np.testing.assert_allclose(found.surface_height_0, radii - 0.5e-6, rtol=1e-12)


ONE = {"count": 4, "radius": 1e-6, "large_radius": 2e-6, "normal_load": 1e-3, "friction": 0.2}
EQUAL = {"radius": 1e-6, "normal_load": 1e-3, "friction": 0.2, "pitch": 1e-5}


@pytest.mark.parametrize(
    ("study", "given", "message"),
    [
        (
            "one_large_asperity",
            ONE | {"standing": "grund"},
            "one_large_asperity: standing is 'grund'; did you mean 'gro",
        ),
        ("one_large_asperity", ONE | {"count": 0}, "one_large_asperity: count is 0; expected a whole number of 1 or"),
        ("one_large_asperity", ONE | {"radius": "1 N"}, "one_large_asperity.radius: '1 N': 'N' is not a unit of a len"),
        ("one_large_asperity", ONE | {"large_radius": []}, "one_large_asperity.large_radius: no values; expected one"),
        ("equal_asperities", EQUAL | {"count": 4}, r"equal_asperities: count is 4; expected \(nx, ny\), or several"),
        ("equal_asperities", EQUAL | {"count": (0, 1)}, "equal_asperities: surface: count is"),
        ("equal_asperities", EQUAL | {"scaling": "similar"}, "equal_asperities: surface.scaling.*similar"),
        ("equal_asperities", EQUAL | {"friction": ["much"]}, "^equal_asperities: friction.coefficient: .*much"),
        ("equal_asperities", EQUAL | {"normal_load": []}, "no values; expected one or more"),
        ("equal_asperities", EQUAL | {"radius": None}, "^equal_asperities: surface.radius: None; expected a number"),
    ],
)
def test_what_cannot_be_used_is_told(study, given, message):
    with pytest.raises(hs.InputError, match=message):
        getattr(studies, study)(PAIR, **given)


def test_a_pair_is_a_pair():
    with pytest.raises(hs.InputError, match="equal_asperities: pair is 'silicon'; expected a MaterialPair"):
        studies.equal_asperities("silicon", **EQUAL)
