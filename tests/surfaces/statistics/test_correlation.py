import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rough_maps import EPS, NAN, PIXEL, Points, maps, pixels, rough
from scipy import signal

from historysim.surfaces.statistics import Autocorrelation, autocorrelation


def brute_autocorrelation(points, lag):
    products = []
    for i, j in points.z:
        first, second = points.z[i, j], points.at(i + lag[0], j + lag[1])
        if first is not None and second is not None:
            products.append((first - points.mean) * (second - points.mean))
    return sum(products) / len(products) if products else NAN


@settings(max_examples=100)
@given(maps(), pixels, st.booleans())
def test_autocorrelation_against_loops_over_the_pairs(z, pixel, periodic):
    points = Points(z, periodic)
    assume(any(points.deviations))
    found = autocorrelation(z, pixel, periodic=periodic)
    steps = [range(-(n // 2), n // 2 + 1) for n in z.shape]
    np.testing.assert_allclose(found.lags_x, np.array(steps[0]) * pixel[0], rtol=2 * EPS)
    np.testing.assert_allclose(found.lags_y, np.array(steps[1]) * pixel[1], rtol=2 * EPS)
    variance = brute_autocorrelation(points, (0, 0))
    exact = [[float(brute_autocorrelation(points, (i, j)) / variance) for j in steps[1]] for i in steps[0]]
    # a transform of at most 8 × 8 keeps each sum to a few EPS of the greatest one, that of up to 25 pairs, of which
    # the least frequent lag has one
    np.testing.assert_allclose(found.values, exact, rtol=0, atol=25 * 16 * EPS)
    assert found.values[z.shape[0] // 2, z.shape[1] // 2] == 1


def scatter_of_autocorrelation(rho, phis, pairs):
    # Bartlett: var ρ_k = Σ_v (ρ_v² + ρ_{v+k} ρ_{v-k} - 4 ρ_k ρ_v ρ_{v-k} + 2 ρ_v² ρ_k²)/n, after Cauchy-Schwarz at most
    # 2 (1 + ρ_k)² Σ ρ_v²/n; Σ ρ_v² = (1 + φ²)/(1 - φ²) of each recursion
    squares = math.prod((1 + phi**2) / (1 - phi**2) for phi in phis)
    return (1 + rho) * np.sqrt(2 * squares / pairs)


def bounds_of_length(level, phi, scatter):
    # where ρ = φ^k, five times the scatter off, meets the level; a chord meets it up to |ln φ|/8 of a step later
    low, high = (math.log(level + sign * 5 * scatter) / math.log(phi) for sign in (1, -1))
    assert (high - low) * -math.log(phi) < 0.4
    return low, high - math.log(phi) / 8


@pytest.mark.parametrize("holes", [0, 0.2])
def test_autocorrelation_of_an_exponential_profile(holes):
    phi, n, pixel = 0.8, 2**21, 1e-6
    rng = np.random.default_rng(11)
    z = signal.lfilter([1], [1, -phi], rng.normal(size=n + 500))[500:, None]
    z[rng.random(z.shape) < holes] = NAN
    found = autocorrelation(z, pixel)
    pairs = (1 - holes) ** 2 * n
    lags, values = found.along_x()
    k = np.arange(60)
    np.testing.assert_allclose(lags[:60], k * pixel, rtol=2 * EPS)
    assert np.all(np.abs(values[:60] - phi**k) < 5 * scatter_of_autocorrelation(phi**k, [phi], pairs))
    for level in (0.1, 1 / math.e):
        low, high = bounds_of_length(level, phi, scatter_of_autocorrelation(level, [phi], pairs))
        assert low < found.length("x", level) / pixel < high
    assert found.length("x") == found.length("x", 0.1)
    assert math.isnan(found.length("y"))
    assert math.isnan(found.lay)


def test_lay_is_the_ratio_of_the_autocorrelation_lengths():
    # separable: ρ = φ_x^i φ_y^j, which falls to 0.1 in 10.3 and 4.5 points
    phis, n = (0.8, 0.6), 1500
    z = np.random.default_rng(13).normal(size=(n + 100, n + 100))
    for axis, phi in enumerate(phis):
        z = signal.lfilter([1], [1, -phi], z, axis=axis)
    found = autocorrelation(z[100:, 100:], PIXEL)
    scatter = scatter_of_autocorrelation(0.1, phis, n * n)
    (low_x, high_x), (low_y, high_y) = (bounds_of_length(0.1, phi, scatter) for phi in phis)
    assert low_x < found.length("x") / PIXEL[0] < high_x
    assert low_y < found.length("y") / PIXEL[1] < high_y
    assert found.lay == found.length("x") / found.length("y")


def test_white_noise_is_not_correlated():
    z = rough((200, 300), seed=14, holes=0.1)
    for periodic in (True, False):
        found = autocorrelation(z, PIXEL, periodic=periodic)
        # at least a quarter of 0.9² of the pairs at all lags, and the greatest of 30 000 normal numbers is below 5
        limit = 5 / math.sqrt(z.size * 0.81 * (1 if periodic else 0.25))
        values = found.values.copy()
        values[100, 150] = 0
        assert np.abs(values).max() < limit
        assert found.lay == pytest.approx(PIXEL[0] / PIXEL[1], rel=5 * limit)


def test_length_is_interpolated_between_the_lags_around_it():
    lags = np.arange(-3, 4) * 2.0
    values = np.array([[0.3, 0.05, 0.5, 1.0, 0.5, 0.05, 0.3]])
    found = Autocorrelation(np.zeros(1), lags, values)
    assert found.length("y", 0.1) == pytest.approx(2 + 2 * (0.5 - 0.1) / 0.45, rel=4 * EPS)
    assert found.length("y", 0.5) == 2
    assert found.length("y", 0.75) == 1
    assert found.length("y", 0.05) == 4
    assert math.isnan(found.length("y", 0.04))
    assert math.isnan(found.length("x"))
    np.testing.assert_array_equal(found.along_x(), [[0], [1]])
    # over a lag without pairs, straight on to the next one
    gap = Autocorrelation(lags, np.zeros(1), np.array([[0.2, NAN, 0.6, 1, 0.6, NAN, 0.2]]).T)
    assert gap.length("x", 0.4) == pytest.approx(4, rel=4 * EPS)


def test_rings_of_the_autocorrelation():
    z = rough((9, 6), seed=15)
    z[4:] = NAN
    found = autocorrelation(z, (1.0, 2.0))
    lags, values = found.radial()
    rings = [[] for _ in range(5)]
    for i, j in np.ndindex(found.values.shape):
        lag = math.hypot(found.lags_x[i], found.lags_y[j])
        if lag < 4.5 and not math.isnan(found.values[i, j]):
            rings[round(lag)].append((lag, found.values[i, j]))
    np.testing.assert_allclose(np.transpose([lags, values]), [np.mean(ring, axis=0) for ring in rings], rtol=64 * EPS)
    assert (lags[0], values[0]) == (0, 1)
    # four rows that are present have no pair four rows apart
    assert np.isnan(found.values[0]).all()
    assert np.isnan(found.values[-1]).all()
    assert not np.isnan(found.values[1:-1]).any()


def test_rings_of_a_profile_are_its_lags():
    found = autocorrelation(rough((8, 1)), PIXEL)
    np.testing.assert_allclose(found.radial(), found.along_x(), rtol=8 * EPS)


@pytest.mark.slow
def test_a_map_of_two_thousand_points_squared():
    # at a few lags, by slices
    z = rough((2048, 2048), seed=21, holes=0.05)
    found = autocorrelation(z, PIXEL)
    deviation = z - np.nanmean(z)
    for i, j in ((0, 1), (1, 0), (-7, 5), (1024, -1024), (300, 900)):
        rows, columns = (slice(max(k, 0), n + min(k, 0)) for k, n in ((i, 2048), (j, 2048)))
        back = tuple(slice(max(-k, 0), n + min(-k, 0)) for k, n in ((i, 2048), (j, 2048)))
        product = np.nanmean(deviation[rows, columns] * deviation[back])
        # sums of 4e6 products of either sign are good to √(4e6) EPS or better, over a quarter of them
        assert found.values[1024 + i, 1024 + j] == pytest.approx(product / np.nanvar(z), abs=1e-11)
