"""The inverse by closed forms and by bisection on Hertz, and against the scenario that says the same."""

from pathlib import Path

import numpy as np
import pytest
from hertz_sums import HARD, SOFT, displacement

import historysim as hs
from historysim.studies.design import summary

SCENARIOS = Path(__file__).parents[3] / "scenarios"
HARD_PAIR = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
SOFT_PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
FINISH = {"normal_load": ("50 mN", "90 mN"), "friction": 0.2, "autocorrelation_length": "20 µm", "drift": "2 nm"}
TEXTURE = {"count": (4, 4), "pitch": "200 µm", "friction": 0.3, "normal_load": ("1 N", "1.4 N"), "drift": "5 nm"}


def test_the_texture_for_a_drift_is_that_of_hertz():
    """n equal asperities drift by θμ (9/(16 E*² n² R))^(1/3) (N2^(2/3) - N1^(2/3))."""
    found = hs.design_studies.texture_for_a_drift(HARD_PAIR, between=("10 µm", "10 mm"), **TEXTURE)
    of_one_metre = displacement(1.4 / 16, 0.0, 1.0, 0.3, HARD) - displacement(1.0 / 16, 0.0, 1.0, 0.3, HARD)
    assert found.surface_radius.values == pytest.approx([(of_one_metre / 5e-9) ** 3], rel=1e-7)
    assert dict(summary(found))["surface.radius"] == f"{1e6 * found.surface_radius.item():.4g} µm"


def test_the_finish_for_a_drift():
    found = hs.design_studies.finish_for_a_drift(
        SOFT_PAIR, shape=(64, 64), between=("5 nm", "200 nm"), seeds=[1, 2], **FINISH
    )
    for seed, value in zip((1, 2), found.surface_rms_height.values, strict=True):
        summits = hs.random_surface((64, 64), 1e-6, value, 20e-6, seed=seed).summits(rule=9)
        first, second = (displacement(load, summits.height, summits.radius, 0.2, SOFT) for load in (50e-3, 90e-3))
        assert second - first == pytest.approx(2e-9, rel=1e-5)
    scenario = hs.load(
        SCENARIOS / "23_finish_for_a_drift.toml",
        {"surface.shape": [64, 64], "design.between": ["5 nm", "200 nm"], "design.over.surface.seed.count": 2},
    )
    np.testing.assert_allclose(found.surface_rms_height, hs.design(scenario).surface_rms_height, rtol=1e-8)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"normal_load": "50 mN"}, "finish_for_a_drift.normal_load: '50 mN'; expected two values"),
        ({"between": (1, 2, 3)}, r"finish_for_a_drift.between: \(1, 2, 3\); expected two values"),
        ({"between": (2e-9, 1e-9)}, "finish_for_a_drift: design.between: 2e-09 and 1e-09; expected the least"),
        ({"drift": "2 N"}, "finish_for_a_drift: design.target: '2 N': 'N' is not a unit of a length"),
        ({"seeds": []}, "finish_for_a_drift.seeds: no values; expected one or more"),
        ({"friction": "much"}, "finish_for_a_drift: friction.coefficient: .*much"),
        ({"drift": "1 mm", "shape": (64, 64), "seeds": [1]}, "no value of surface.rms_height was found; drift is from"),
    ],
)
def test_what_cannot_be_sought_is_told(given, message):
    with pytest.raises(hs.InputError, match=message):
        hs.design_studies.finish_for_a_drift(SOFT_PAIR, **(FINISH | given))
