import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import johnsonsb, johnsonsu, norm

from historysim.errors import InputError
from historysim.surfaces.random import MOST_KURTOSIS, Translation, translation

Z = np.linspace(-4, 4, 33)

PAIRS = [
    (0, 1.2),
    (0, 99),
    (1, 2.3),
    (-1, 5),
    (2, 5.5),
    (6, 70),
]


def distribution(fitted):
    # γ and δ of the distributions that scipy has, from κ = e^(2γ/δ) of SU and κ = e^(-γ/δ) of SB
    delta = 1 / fitted.sharpness
    gamma = delta * math.log(fitted.kappa) * (-1 if fitted.bounded else 0.5)
    return (johnsonsb if fitted.bounded else johnsonsu)(-gamma if fitted.mirrored else gamma, delta)


def quadrature_moments(fitted):
    # of the quantiles, with points where the bounded ones are steep
    law = distribution(fitted)
    steep = norm.ppf(law.cdf(0.5)) if fitted.bounded else 0.0

    def mean(function):
        return quad(
            lambda z: function(float(law.ppf(norm.cdf(z)))) * norm.pdf(z), -8.2, 8.2, points=[steep], limit=500
        )[0]

    centre = mean(lambda x: x)
    second, third, fourth = (mean(lambda x, n=n: (x - centre) ** n) for n in (2, 3, 4))
    return third / second**1.5, fourth / second**2


@pytest.mark.parametrize(("skewness", "kurtosis"), [pair for pair in PAIRS if pair[1] > 3 + 1.9 * pair[0] ** 2])
def test_unbounded_heights_have_the_moments_of_scipy(skewness, kurtosis):
    fitted = translation(skewness, kurtosis)
    assert not fitted.bounded
    # closed forms in scipy, whose rounding grows with the cancelled powers of e^(1/δ²)
    assert distribution(fitted).stats("sk") == pytest.approx((skewness, kurtosis - 3), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize(
    ("skewness", "kurtosis"),
    [pair for pair in PAIRS if pair[1] < 3 + 1.7 * pair[0] ** 2],
)
def test_bounded_heights_have_the_moments_of_a_quadrature(skewness, kurtosis):
    fitted = translation(skewness, kurtosis)
    assert fitted.bounded
    # norm.cdf leaves 1e-16 of the upper tail, and quad promises 1.5e-8
    assert quadrature_moments(fitted) == pytest.approx((skewness, kurtosis), rel=2e-7, abs=2e-7)


@pytest.mark.parametrize(("sharpness", "sign"), [(0.05, -1), (0.4, 1), (0.9, -1)])
def test_the_log_normal_lies_between_both_families(sharpness, sign):
    w = math.exp(sharpness**2)
    skewness, kurtosis = sign * (w + 2) * math.sqrt(w - 1), w**4 + 2 * w**3 + 3 * w**2 - 3
    for off in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        below, above = translation(skewness, kurtosis * (1 - off)), translation(skewness, kurtosis * (1 + off))
        assert below.bounded
        assert not above.bounded
        assert below.moments() == pytest.approx((skewness, kurtosis * (1 - off)), abs=1e-9 * kurtosis)
        assert above.moments() == pytest.approx((skewness, kurtosis * (1 + off)), abs=1e-9 * kurtosis)
    for off in (-1e-12, 0, 1e-12):
        fitted = translation(skewness, kurtosis * (1 + off))
        assert fitted.sharpness == pytest.approx(sharpness, rel=1e-6)
        # κ is the order of 1e-12 over the excess, some 10 /δ² of it
        np.testing.assert_allclose(fitted(Z), sign * np.expm1(sign * sharpness * Z), rtol=1e-6)
        assert fitted.moments() == pytest.approx((skewness, kurtosis), abs=1e-9 * kurtosis)


@pytest.mark.parametrize(("skewness", "kurtosis"), PAIRS)
def test_translations_are_quantiles_of_scipy_up_to_scale_and_origin(skewness, kurtosis):
    fitted = translation(skewness, kurtosis)
    quantiles = distribution(fitted).ppf(norm.cdf(Z))
    translated = fitted(Z)
    slope = np.ptp(quantiles) / np.ptp(translated)
    # norm.cdf keeps 1e-16 of 1, which is 1e-12 of the tail beyond 4
    np.testing.assert_allclose(
        slope * (translated - translated[0]), quantiles - quantiles[0], rtol=0, atol=1e-9 * np.ptp(quantiles)
    )
    assert slope > 0


@given(st.floats(-1, 1), st.floats(-13, -3), st.floats(-13, -3), st.sampled_from([-1, 1]))
@example(1.0, -200.0, -200.0, 1)
def test_next_to_gaussian_heights_translations_are_next_to_lines(mantissa, order, excess_order, sign):
    skewness, kurtosis = mantissa * 10**order, 3 + sign * 10**excess_order
    fitted = translation(skewness, kurtosis)
    if fitted is None:
        assert (skewness, kurtosis) == (0, 3)
        return
    assert fitted.moments() == pytest.approx((skewness, kurtosis), abs=3e-9)
    slope = fitted.sharpness * (1 / (1 + fitted.kappa) if fitted.bounded else 1 + fitted.kappa)
    # e^y - 1 = y (1 + y/2 + …), and no other translation is bent more
    np.testing.assert_allclose(fitted(Z), slope * Z, rtol=3 * fitted.sharpness)


@given(st.floats(-12, 12), st.floats(0, 110))
def test_any_skewness_and_kurtosis_are_met_or_refused(skewness, kurtosis):
    try:
        fitted = translation(skewness, kurtosis)
    except InputError:
        # two levels of chances p and 1 - p lie on the limit, and the sharpest slope between is 5 % above it
        assert kurtosis < 1.07 * (skewness**2 + 1) + 0.06 or kurtosis > MOST_KURTOSIS
        return
    assert skewness**2 + 1 < kurtosis <= MOST_KURTOSIS
    if fitted is not None:
        assert fitted.moments() == pytest.approx((skewness, kurtosis), abs=1e-9 * kurtosis)
        assert np.all(np.diff(fitted(Z)) > 0)


@pytest.mark.parametrize("fitted", [Translation(False, 0.7, 0.0), Translation(True, 0.7, 0.0, mirrored=True)])
def test_correlation_of_log_normal_heights(fitted):
    rho = np.linspace(-1, 1, 41)
    translated, normal = fitted.correlations()
    # E exp(s (z1 + z2)) = exp(s² (1 + ρ)); the spline's error is below (π/8192)⁴
    expected = np.expm1(0.49 * rho) / np.expm1(0.49)
    np.testing.assert_allclose(translated(rho), expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(normal(expected[20:]), rho[20:], rtol=0, atol=1e-12)


def test_correlation_of_bounded_heights():
    fitted = translation(-1, 2.9)
    law = distribution(fitted)
    # independent normals mixed to a correlation ρ; the rule converges as exp(-2π² δ / step), 1e-9 for 1/δ = 5.7
    u = np.arange(-8, 8, 0.05)
    weights = np.outer(norm.pdf(u), norm.pdf(u)) * 0.05**2
    translated, normal = fitted.correlations()
    for rho in (-0.6, 0.99):
        mixed = rho * u[:, None] + math.sqrt(1 - rho**2) * u
        values = (law.ppf(norm.cdf(u)) - law.mean()) / law.std()
        others = (law.ppf(norm.cdf(mixed)) - law.mean()) / law.std()
        expected = np.sum(weights * values[:, None] * others)
        assert translated(rho) == pytest.approx(expected, abs=1e-7)
        if rho > 0:
            assert normal(expected) == pytest.approx(rho, abs=1e-7)
