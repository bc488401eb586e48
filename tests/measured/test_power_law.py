"""Power laws of friction over load whose exponents are known, and by another way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from historysim.errors import InputError
from historysim.measured.power_law import power_law


@pytest.mark.parametrize("exponent", [-1 / 3, 0.0])
def test_an_exact_power_law(exponent):
    load = np.array([0.05, 0.07, 0.09, 0.2])
    found = power_law(load, 0.12 * load**exponent)
    assert found.exponent == pytest.approx(exponent, abs=1e-12)
    assert found.factor == pytest.approx(0.12, rel=1e-12)
    assert found.exponent_high - found.exponent_low < 1e-6


@given(
    coefficients=st.lists(st.floats(0.05, 1.0), min_size=3, max_size=12),
    first=st.floats(1e-3, 1.0),
)
def test_a_power_law_by_another_way(coefficients, first):
    load = first * 1.5 ** np.arange(len(coefficients))
    (slope, intercept), covariance = np.polyfit(np.log(load), np.log(coefficients), 1, cov="unscaled")
    residual = np.log(coefficients) - slope * np.log(load) - intercept
    freedom = len(coefficients) - 2
    error = np.sqrt(covariance[0, 0] * (residual @ residual) / freedom)
    low, high = stats.t.interval(0.95, freedom, loc=slope, scale=max(error, 1e-300))
    found = power_law(load, coefficients)
    assert_allclose([found.exponent, found.exponent_low, found.exponent_high], [slope, low, high], rtol=1e-6, atol=1e-6)
    assert found.factor == pytest.approx(np.exp(intercept), rel=1e-9)


def test_power_laws_hold_the_truth_in_95_of_100():
    random = np.random.default_rng(8)
    load = np.array([0.05, 0.06, 0.07, 0.08, 0.09])
    held = 0
    for _ in range(400):
        found = power_law(load, 0.1 * load ** (-1 / 3) * np.exp(random.normal(0, 0.02, load.size)))
        held += found.exponent_low <= -1 / 3 <= found.exponent_high
    # four standard deviations of a binomial count
    assert abs(held - 380) < 4 * np.sqrt(400 * 0.95 * 0.05)


@pytest.mark.parametrize(
    ("load", "friction", "said"),
    [
        ([1, 2], [0.1, 0.2], "expected two lists of one length ≥ 3"),
        ([1, 2, 3], [0.1, 0.2], "expected two lists of one length ≥ 3"),
        ([1, 1, 1], [0.1, 0.2, 0.1], "normal_load is 1 N throughout; expected several loads"),
        ([1, 2, 0], [0.1, 0.2, 0.1], "normal_load"),
        ([1, 2, 3], [0.1, 0.2, -0.1], "friction"),
        ([1, 2, np.nan], [0.1, 0.2, 0.1], "normal_load"),
        ([[1, 2, 3]], [[0.1, 0.2, 0.1]], "expected two lists of one length ≥ 3"),
    ],
)
def test_what_is_no_power_law(load, friction, said):
    with pytest.raises(InputError, match=said):
        power_law(load, friction)
