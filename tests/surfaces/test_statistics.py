import itertools
import math
import warnings
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import signal
from scipy.stats import chi2

from historysim.errors import InputError
from historysim.surfaces.statistics import (
    Autocorrelation,
    SpectralMoments,
    autocorrelation,
    height_statistics,
    power_spectral_density,
)

EPS = np.finfo(float).eps
NAN = math.nan
PIXEL = (2e-6, 3e-6)
BOTH = pytest.mark.parametrize("periodic", [False, True])

shapes = st.tuples(st.integers(1, 5), st.integers(1, 5))
pixels = st.tuples(st.integers(1, 9), st.integers(1, 9)).map(lambda pair: (pair[0] * 1e-7, pair[1] * 1e-7))


@st.composite
def maps(draw, holes=True, shape=shapes):
    # whole nanometres on a step of up to a metre, so that no difference of two heights underflows
    nx, ny = draw(shape)
    steps = st.integers(-1000, 1000) | st.just(NAN) if holes else st.integers(-1000, 1000)
    values = draw(st.lists(steps, min_size=nx * ny, max_size=nx * ny))
    z = np.array(values, dtype=float).reshape(nx, ny) * 1e-9 + draw(st.sampled_from([0.0, -1e-6, 1.0]))
    assume(not np.isnan(z).all())
    return z


def rough(shape, seed=0, holes=0.0):
    rng = np.random.default_rng(seed)
    z = 1e-7 * rng.normal(size=shape) + 3e-7
    z[rng.random(shape) < holes] = NAN
    return z


def numbers(statistics):
    names = ("mean", "rms_height", "mean_deviation", "height_range", "skewness", "kurtosis", "rms_slope")
    names += ("rms_curvature", "bandwidth", "missing_fraction")
    moments = [getattr(statistics.moments, name) for name in ("m0", "m2", "m4", "alpha")]
    return np.array([getattr(statistics, name) for name in names] + moments)


def assert_same(first, second, rtol):
    np.testing.assert_allclose(numbers(first), numbers(second), rtol=rtol)


# ---- by loops over points, in rational arithmetic, which rounds nothing


class Points:
    """Heights as fractions by (i, j), with the neighbours of a periodic surface; absent points are None."""

    def __init__(self, z, periodic):
        self.shape, self.periodic = z.shape, periodic
        self.z = {index: None if np.isnan(value) else Fraction(float(value)) for index, value in np.ndenumerate(z)}
        present = [value for value in self.z.values() if value is not None]
        self.mean = sum(present) / len(present)
        self.deviations = [value - self.mean for value in present]

    def at(self, i, j):
        if self.periodic:
            return self.z[i % self.shape[0], j % self.shape[1]]
        return self.z.get((i, j))

    def difference(self, i, j, axis, order):
        steps = {1: (0, 1), 2: (-1, 0, 1)}[order]
        values = [self.at(i + step, j) if axis == 0 else self.at(i, j + step) for step in steps]
        if None in values:
            return None
        return values[0] - values[1] if order == 1 else values[0] - 2 * values[1] + values[2]

    def differences(self, axis, order):
        return [self.difference(i, j, axis, order) for i, j in self.z]


def root_mean_square(values):
    return math.sqrt(float(sum(value**2 for value in values) / len(values))) if values else NAN


def brute_differences(points, pixel, order):
    axes = [axis for axis in (0, 1) if points.shape[axis] > 1]
    scale = [Fraction(p) ** order for p in pixel]
    columns = [points.differences(axis, order) for axis in axes]
    squares = [
        root_mean_square([value / scale[axis] for value in column if value is not None]) ** 2
        for axis, column in zip(axes, columns, strict=True)
    ]
    means = [
        sum(abs(value) / scale[axis] for axis, value in zip(axes, row, strict=True)) / len(axes)
        for row in zip(*columns, strict=True)
        if None not in row
    ]
    return root_mean_square(means), sum(squares) / len(axes) if axes else NAN


@settings(max_examples=150)
@given(maps(), pixels, st.booleans())
def test_statistics_against_loops_over_the_points(z, pixel, periodic):
    points = Points(z, periodic)
    count = len(points.deviations)
    rms = root_mean_square(points.deviations)
    found = height_statistics(z, pixel, periodic=periodic)
    # about 25 roundings in a row, of the heights about the mean; the mean itself is as good as its datum
    rtol = 64 * EPS
    assert found.mean == pytest.approx(float(points.mean), rel=4 * EPS, abs=64 * EPS * 1e-6)
    assert found.rms_height == pytest.approx(rms, rel=rtol)
    assert found.mean_deviation == pytest.approx(float(sum(map(abs, points.deviations)) / count), rel=rtol)
    spread = max(points.deviations) - min(points.deviations)
    assert found.height_range == pytest.approx(float(spread), rel=rtol)
    assert found.missing_fraction == pytest.approx(1 - count / z.size, abs=EPS)
    for name, power in (("skewness", 3), ("kurtosis", 4)):
        exact = float(sum(value**power for value in points.deviations) / count) / rms**power if rms else NAN
        # a skewness of 0 is the difference of two sums of the order of the kurtosis, at most the number of points
        assert getattr(found, name) == pytest.approx(exact, rel=rtol, abs=rtol * 25, nan_ok=True)
    # second differences add four heights up to half a spread from their middle, 4 EPS of it for 0 in the end
    atol = 8 * EPS * float(max(abs(value) for value in points.z.values() if value is not None))
    for order, average, moment in ((1, "rms_slope", "m2"), (2, "rms_curvature", "m4")):
        exact, square = brute_differences(points, pixel, order)
        floor = atol / min(pixel) ** order
        assert getattr(found, average) == pytest.approx(exact, rel=rtol, abs=floor, nan_ok=True)
        assert math.sqrt(getattr(found.moments, moment)) == pytest.approx(
            math.sqrt(square), rel=rtol, abs=floor, nan_ok=True
        )


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


@settings(max_examples=100)
@given(maps(holes=False), pixels)
def test_density_of_a_periodic_map_against_the_sum_of_its_definition(z, pixel):
    density = power_spectral_density(z, pixel, periodic=True)
    size = np.multiply(z.shape, pixel)
    deviation = z - z.flat[0]
    deviation -= deviation.mean()
    x, y = (np.arange(n) * p for n, p in zip(z.shape, pixel, strict=True))
    for (i, q_x), (j, q_y) in itertools.product(enumerate(density.q_x), enumerate(density.q_y)):
        wave = np.exp(-1j * (q_x * x[:, None] + q_y * y[None, :]))
        exact = abs((deviation * wave).sum() * pixel[0] * pixel[1]) ** 2 / size.prod()
        # the sum of up to 25 heights is good to 25 EPS of the greatest, and phases of up to 5 π to 5 π EPS
        floor = pixel[0] * pixel[1] / z.size * (z.size * 64 * EPS * np.abs(deviation).max()) ** 2
        assert density.values[i, j] == pytest.approx(exact, rel=1e-9, abs=1e3 * floor)
    for q, n, length in ((density.q_x, z.shape[0], size[0]), (density.q_y, z.shape[1], size[1])):
        np.testing.assert_allclose(q, 2 * np.pi * np.arange(-(n // 2), (n + 1) // 2) / length, rtol=4 * EPS)


# ---- closed forms of waves


def test_wave_along_x():
    # the waves of the differences are 2 sin(π/n) and 4 sin²(π/n) as high as the wave; |cos| is met midway of its zeros
    n, amplitude = 16, 2e-7
    z = amplitude * np.sin(2 * np.pi * np.arange(n) / n)[:, None] + np.zeros(6)
    step = 2 * np.sin(np.pi / n) / PIXEL[0]
    found = height_statistics(z + 1e-6, PIXEL, periodic=True)
    # a height of 1e-6 is good to EPS/2 of itself, a second difference of 0.15 · 2e-7 to some 100 EPS
    rtol = 200 * EPS
    assert found.mean == pytest.approx(1e-6, rel=rtol)
    assert found.rms_height == pytest.approx(amplitude / math.sqrt(2), rel=rtol)
    assert found.mean_deviation == pytest.approx(amplitude * 2 / n / math.tan(math.pi / n), rel=rtol)
    assert found.height_range == pytest.approx(2 * amplitude, rel=rtol)
    assert found.skewness == pytest.approx(0, abs=rtol)
    assert found.kurtosis == pytest.approx(1.5, rel=rtol)
    assert found.rms_slope == pytest.approx(step * amplitude / math.sqrt(2) / 2, rel=rtol)
    assert found.rms_curvature == pytest.approx(step**2 * amplitude / math.sqrt(2) / 2, rel=rtol)
    assert found.moments.m0 == pytest.approx(amplitude**2 / 2, rel=rtol)
    assert found.moments.m2 == pytest.approx((step * amplitude) ** 2 / 4, rel=rtol)
    assert found.moments.m4 == pytest.approx((step**2 * amplitude) ** 2 / 4, rel=rtol)
    assert found.bandwidth == pytest.approx(4, rel=4 * rtol)
    assert found.moments.alpha == pytest.approx(2, rel=4 * rtol)
    assert found.missing_fraction == 0


def test_egg_box():
    # s_x and s_y are independent of each other: ⟨(s_x+s_y)²⟩/4 = (m2 + ⟨s_x⟩⟨s_y⟩)/2 for equal ones
    n, amplitude = 24, 1e-7
    wave = np.sin(2 * np.pi * np.arange(n) / n)
    found = height_statistics(amplitude * (wave[:, None] + wave[None, :]), 1e-6, periodic=True)
    height, step = amplitude / math.sqrt(2), 2 * math.sin(math.pi / n) / 1e-6
    between, at = 2 / (n * math.sin(math.pi / n)), 2 / (n * math.tan(math.pi / n))
    rtol = 200 * EPS
    assert found.rms_height == pytest.approx(math.sqrt(2) * height, rel=rtol)
    assert found.moments.m2 == pytest.approx((step * height) ** 2, rel=rtol)
    assert found.moments.m4 == pytest.approx((step**2 * height) ** 2, rel=rtol)
    assert found.rms_slope == pytest.approx(step * amplitude * math.sqrt((0.5 + between**2) / 2), rel=rtol)
    assert found.rms_curvature == pytest.approx(step**2 * amplitude * math.sqrt((0.5 + at**2) / 2), rel=rtol)


WAVES = {(1, 0): 3e-8, (2, 3): 5e-8, (3, -2): 2e-8, (0, 5): 4e-8}


def sum_of_waves(shape, seed=5):
    i, j = np.indices(shape)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(WAVES))
    return sum(
        height * np.cos(2 * np.pi * (k * i / shape[0] + m * j / shape[1]) + phase)
        for ((k, m), height), phase in zip(WAVES.items(), phases, strict=True)
    )


@pytest.mark.parametrize("shape", [(16, 15), (17, 12)])
def test_sum_of_waves(shape):
    # each wave holds half its height squared in the variance, shared by q and -q
    z = sum_of_waves(shape)
    size = np.multiply(shape, PIXEL)
    variance = sum(height**2 for height in WAVES.values()) / 2
    density = power_spectral_density(z, PIXEL, periodic=True)
    expected = np.zeros(shape)
    for (k, m), height in WAVES.items():
        for sign in (1, -1):
            expected[shape[0] // 2 + sign * k, shape[1] // 2 + sign * m] = height**2 / 4 * size.prod()
    # roundings of the waves, some EPS of 1.4e-7, leave the square of that over N for 0
    np.testing.assert_allclose(density.values, expected, rtol=1e-12, atol=1e-24 * expected.max())
    correlation = autocorrelation(z, PIXEL, periodic=True)
    lag_x, lag_y = np.meshgrid(correlation.lags_x, correlation.lags_y, indexing="ij")
    exact = sum(
        height**2 / 2 * np.cos(2 * np.pi * (k * lag_x / size[0] + m * lag_y / size[1]))
        for (k, m), height in WAVES.items()
    )
    np.testing.assert_allclose(correlation.values, exact / variance, rtol=0, atol=1e-13)


# ---- power spectral density


@given(maps(holes=False), pixels)
def test_density_of_a_periodic_map_adds_up_to_the_variance(z, pixel):
    density = power_spectral_density(z, pixel, periodic=True)
    cell = (2 * math.pi) ** 2 / np.prod(density.size)
    total = density.values.sum() * cell / (2 * math.pi) ** 2
    assert total == pytest.approx(height_statistics(z, pixel).rms_height ** 2, rel=64 * EPS)


def test_density_of_any_other_map_adds_up_to_the_weighted_square():
    z = rough((12, 9), seed=2)
    i, j = np.indices(z.shape)
    terms = np.stack([np.ones(z.size), i.ravel(), j.ravel()], axis=1)
    left = z - (terms @ np.linalg.lstsq(terms, z.ravel(), rcond=None)[0]).reshape(z.shape)
    weight = np.outer(*(signal.windows.cosine(n) ** 2 for n in z.shape))
    density = power_spectral_density(z, PIXEL)
    expected = np.sum((weight * left) ** 2) / np.sum(weight**2)
    assert density.values.sum() / np.prod(density.size) == pytest.approx(expected, rel=1e-12)
    # and at each wavevector by the transform of numpy
    wave = np.fft.fftshift(np.abs(np.fft.fft2(weight * left)) ** 2) / np.sum(weight**2) * PIXEL[0] * PIXEL[1]
    np.testing.assert_allclose(density.values, wave, rtol=1e-9, atol=1e-14 * wave.max())


def test_tilt_does_not_show_in_the_density_of_a_map_that_is_not_periodic():
    z = rough((10, 8))
    i, j = np.indices(z.shape)
    plain, tilted = (power_spectral_density(each, PIXEL).values for each in (z, z + 1e-7 * i - 2e-7 * j + 1e-6))
    # tilted heights of 2e-6 are good to 2e-22 and stand over a roughness of 1e-7
    np.testing.assert_allclose(tilted, plain, rtol=0, atol=1e-13 * plain.max())


def test_density_and_autocorrelation_are_transforms_of_each_other():
    z = rough((12, 10), seed=3)
    density = power_spectral_density(z, PIXEL, periodic=True)
    covariance = np.fft.fftshift(np.fft.ifft2(np.fft.ifftshift(density.values)).real) / (PIXEL[0] * PIXEL[1])
    found = autocorrelation(z, PIXEL, periodic=True)
    # of an even number of points the lag of half the length stands on both sides, in a transform once
    np.testing.assert_allclose(found.values[:-1, :-1] * np.nanvar(z), covariance, rtol=0, atol=1e-14 * np.var(z))
    np.testing.assert_array_equal(found.values[-1], found.values[0])


@pytest.mark.parametrize("shape", [(7, 6), (8, 5)])
def test_density_along_an_axis_is_the_mean_of_the_profiles(shape):
    z = rough(shape, seed=4)
    density = power_spectral_density(z, PIXEL, periodic=True)
    deviation = z - z.mean()
    for axis, (q, values) in enumerate((density.along_x(), density.along_y())):
        profiles = np.abs(np.fft.rfft(deviation, axis=axis)) ** 2 * PIXEL[axis] / shape[axis]
        np.testing.assert_allclose(values, profiles.mean(axis=1 - axis), rtol=1e-12)
        np.testing.assert_allclose(q, 2 * np.pi * np.fft.rfftfreq(shape[axis], PIXEL[axis]), rtol=4 * EPS, strict=True)
        assert not np.signbit(q).any()


def test_density_of_a_profile():
    z = rough((11, 1), seed=6)
    for periodic in (True, False):
        along = power_spectral_density(z, PIXEL, periodic=periodic)
        across = power_spectral_density(z.T, PIXEL[::-1], periodic=periodic)
        np.testing.assert_allclose(along.along_x(), across.along_y(), rtol=1e-12)
        # the width of the profile does not count in m³
        wide = power_spectral_density(z, (PIXEL[0], 1.0), periodic=periodic)
        np.testing.assert_allclose(along.along_x(), wide.along_x(), rtol=1e-12)
    q, values = power_spectral_density(z, PIXEL, periodic=True).along_x()
    # an odd number of points: all wavevectors but 0 have both signs
    assert (2 * values.sum() - values[0]) * q[1] / (2 * math.pi) == pytest.approx(z.var(), rel=1e-12)


def test_density_of_white_noise_is_flat():
    n = 256
    z = rough((n, n), seed=8)
    # C is exponentially distributed about σ² p_x p_y, so that the mean of a ring of k pairs of q and -q scatters by
    # 1/√k; the window, which ties each q to its neighbours, makes it (mean w⁴/(mean w²)²) = (35/18)² as many
    level = 1e-14 * PIXEL[0] * PIXEL[1]
    for periodic, spread in ((True, 1.0), (False, 35 / 18)):
        density = power_spectral_density(z, PIXEL, periodic=periodic)
        q, values = density.radial(spacing="linear", bins=20)
        radius = np.hypot(density.q_x[:, None], density.q_y)
        edges = np.linspace(2 * np.pi / (n * PIXEL[1]), np.pi / PIXEL[1], 21)
        counts = np.histogram(radius, edges)[0]
        assert len(q) == 20
        assert np.all(np.abs(values / level - 1) < 5 * spread / np.sqrt(counts / 2))
        # far too narrow for a window power that is left out, 9/64
        assert np.abs(values[5:] / level - 1).max() < 0.2


def test_rings_of_the_density():
    z = sum_of_waves((32, 32))
    density = power_spectral_density(z, 1e-6, periodic=True)
    unit = 2 * np.pi / 32e-6
    q, values = density.radial(spacing="linear")
    assert len(q) == 15
    grid = [(k, m) for k in range(-16, 16) for m in range(-16, 16)]
    for ring, (mean, value) in enumerate(zip(q, values, strict=True), start=1):
        members = [
            (k, m) for k, m in grid if ring <= math.hypot(k, m) < ring + 1 or (ring == 15 and k * k + m * m == 256)
        ]
        assert mean == pytest.approx(unit * sum(math.hypot(*member) for member in members) / len(members), rel=1e-12)
        heights = [WAVES.get(member, WAVES.get((-member[0], -member[1]), 0)) for member in members]
        expected = sum(height**2 for height in heights) / 4 * (32e-6) ** 2 / len(members)
        assert value == pytest.approx(expected, rel=1e-12, abs=1e-20 * density.values.max())
    q, values = density.radial()
    # 12 rings in the 1.2 decades from 1 to 16: that from 1.26 to 1.59 holds the four waves (±1, ±1), the next none
    assert len(q) == 11
    assert q[:2] == pytest.approx([unit, math.sqrt(2) * unit], rel=1e-12)
    assert values[0] == pytest.approx(WAVES[1, 0] ** 2 / 8 * (32e-6) ** 2, rel=1e-12)
    assert len(density.radial(bins=3)[0]) == len(density.radial(bins=np.int64(3))[0]) == 3


def test_rings_of_a_map_with_different_pixels_and_lengths():
    density = power_spectral_density(rough((12, 40)), (4e-6, 1e-6), periodic=True)
    q, values = density.radial(bins=1)
    radius = np.hypot(density.q_x[:, None], density.q_y)
    inside = (radius > 0) & (radius <= np.pi / 4e-6 * (1 + 1e-6))
    inside &= radius >= 2 * np.pi / 48e-6 * (1 - 1e-6)
    assert (q[0], values[0]) == pytest.approx((radius[inside].mean(), density.values[inside].mean()), rel=1e-12)


# ---- autocorrelation


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


# ---- Gaussian surfaces


def test_summits_of_a_gaussian_surface_against_drawn_hessians():
    # Kac and Rice: summits per area = p(no gradient) · E[|det H|; H negative definite], and means over the summits are
    # weighted by |det H|. The gradient is independent of height and Hessian, with p = 1/(2π m2) at 0. Covariances:
    # ⟨z²⟩ = m0, ⟨z z_xx⟩ = -m2, ⟨z_xx²⟩ = m4, ⟨z_xx z_yy⟩ = ⟨z_xy²⟩ = m4/3
    m0, m2, m4, count = 2.0, 3.0, 11.0, 2_000_000
    moments = SpectralMoments(m0, m2, m4)
    assert moments.alpha == pytest.approx(22 / 9, rel=4 * EPS)
    covariance = [[m0, -m2, -m2, 0], [-m2, m4, m4 / 3, 0], [-m2, m4 / 3, m4, 0], [0, 0, 0, m4 / 3]]
    z, xx, yy, xy = np.linalg.cholesky(covariance) @ np.random.default_rng(16).normal(size=(4, count))
    determinant = xx * yy - xy**2
    weight = np.where((determinant > 0) & (xx < 0), determinant, 0)
    for found, sample in (
        (moments.summit_density * 2 * math.pi * m2, weight),
        (0, weight * (z - moments.mean_summit_height)),
        (0, weight * (-(xx + yy) / 2 - moments.mean_summit_curvature)),
    ):
        error = sample.std() / math.sqrt(count)
        assert found == pytest.approx(sample.mean(), abs=5 * error)
        assert error < 0.003 * weight.mean() * max(moments.mean_summit_height, 1)


def gaussian_surface(n, length, rng):
    """Draw a periodic isotropic Gaussian surface with ρ = exp(-(r/length)²), r and length in points, and Rq = 1."""
    q = 2 * np.pi * np.fft.fftfreq(n)
    filtered = np.exp(-((length * np.hypot(q[:, None], q)) ** 2) / 8)
    z = np.fft.ifft2(np.fft.fft2(rng.normal(size=(n, n))) * filtered).real
    return z / math.sqrt(np.mean(filtered**2))


def test_moments_and_bandwidth_of_an_isotropic_gaussian_surface():
    # expanded at lag 0, ρ = exp(-(r/l)²) gives m2 = 2/l², m4 = 12/l⁴, α = 3. ψ/α follows from E|XY| of two normal
    # numbers with a correlation of 0 (slopes) and 1/3 (curvatures)
    length, rng = 16, np.random.default_rng(17)
    found = [height_statistics(gaussian_surface(1024, length, rng), 1.0, periodic=True) for _ in range(8)]
    slope = (1 + 2 / math.pi) / 2
    curvature = (1 + 2 / math.pi * (math.sqrt(8) + math.asin(1 / 3)) / 3) / 2
    ratio = curvature / slope**2
    assert ratio == pytest.approx(1.2487, abs=5e-5)
    # differences over a point miss m4/(12 m2) = 1/(2 l²) of m2, and m6/(6 m4) = 5/(3 l²) of m4
    missed = 3 / length**2
    for values, exact in (
        ([each.rms_height**2 for each in found], 1),
        ([each.skewness for each in found], 0),
        ([each.kurtosis for each in found], 3),
        ([each.mean_deviation for each in found], math.sqrt(2 / math.pi)),
        ([each.moments.m2 * length**2 for each in found], 2),
        ([each.moments.m4 * length**4 for each in found], 12),
        ([each.moments.alpha for each in found], 3),
        ([each.bandwidth / each.moments.alpha for each in found], ratio),
        ([each.rms_slope**2 / each.moments.m2 for each in found], slope),
        ([each.rms_curvature**2 / each.moments.m4 for each in found], curvature),
    ):
        error = np.std(values, ddof=1) / math.sqrt(len(values))
        # 6 estimated errors of 8 surfaces are as rare as 4 known ones
        assert np.mean(values) == pytest.approx(exact, abs=6 * error + missed * exact)
        assert error < 0.02 * max(exact, 1)


def test_scatter_of_the_variance_of_white_noise():
    # n Rq²/σ² is distributed as χ² with n - 1 degrees of freedom
    z = rough((300, 200), seed=18)
    low, high = chi2.ppf([1e-6, 1 - 1e-6], z.size - 1)
    assert low < z.size * height_statistics(z, PIXEL).rms_height ** 2 / 1e-14 < high


# ---- symmetries


@given(maps(), pixels, st.booleans(), st.sampled_from([2.0**-7, 2.0**5]), st.sampled_from([2.0**-3, 2.0**6]))
def test_scaling_of_heights_and_lengths(z, pixel, periodic, tall, wide):
    first = height_statistics(z, pixel, periodic=periodic)
    second = height_statistics(tall * z, wide * np.array(pixel), periodic=periodic)
    slope, curvature = tall / wide, tall / wide**2
    factors = [tall] * 4 + [1, 1, slope, curvature, 1, 1, tall**2, slope**2, curvature**2, 1]
    # powers of two leave no rounding
    np.testing.assert_allclose(numbers(second), numbers(first) * factors, rtol=4 * EPS)


def test_scaling_of_the_functions():
    z = rough((8, 6))
    for periodic in (True, False):
        first, second = (power_spectral_density(k * z, (k * 2e-6, k * 2e-6), periodic=periodic) for k in (1.0, 4.0))
        np.testing.assert_allclose(second.values, 4**4 * first.values, rtol=1e-12, atol=1e-12 * second.values.max())
        np.testing.assert_allclose(second.q_x, first.q_x / 4, rtol=4 * EPS)
        first, second = (autocorrelation(k * z, (k * 2e-6, k * 3e-6), periodic=periodic) for k in (1.0, 4.0))
        np.testing.assert_allclose(second.values, first.values, rtol=0, atol=64 * EPS)
        assert second.length("y", 0.3) == pytest.approx(4 * first.length("y", 0.3), rel=1e-12)
        # whose squares are below the least number
        np.testing.assert_allclose(
            autocorrelation(1e-200 * z, 1.0, periodic=periodic).values, first.values, rtol=0, atol=64 * EPS
        )


@BOTH
def test_transposition_exchanges_x_and_y(periodic):
    z = rough((9, 12), holes=0.1)
    turned = {"heights": z.T, "pixel_size": PIXEL[::-1], "periodic": periodic}
    # sums in another order, of which that of the skewness cancels but for some thousandths
    assert_same(height_statistics(z, PIXEL, periodic=periodic), height_statistics(**turned), 1e-12)
    first, second = autocorrelation(z, PIXEL, periodic=periodic), autocorrelation(**turned)
    np.testing.assert_allclose(first.values, second.values.T, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(first.lags_x, second.lags_y)
    assert first.lay == pytest.approx(1 / second.lay, rel=1e-11)
    z = rough((9, 12))
    turned["heights"] = z.T
    first, second = power_spectral_density(z, PIXEL, periodic=periodic), power_spectral_density(**turned)
    np.testing.assert_allclose(first.values, second.values.T, rtol=0, atol=1e-13 * first.values.max())
    np.testing.assert_array_equal(first.q_x, second.q_y)
    np.testing.assert_allclose(first.along_x(), second.along_y(), rtol=1e-11)
    np.testing.assert_allclose(first.radial(), second.radial(), rtol=1e-11)


@BOTH
def test_half_a_turn_changes_nothing(periodic):
    z = rough((9, 12))
    first, second = (height_statistics(each, PIXEL, periodic=periodic) for each in (z, z[::-1, ::-1]))
    # but the rms slope, and ψ with it: s joins the neighbours towards +x and +y
    np.testing.assert_allclose(np.delete(numbers(second), [6, 8]), np.delete(numbers(first), [6, 8]), rtol=1e-12)
    for function in (autocorrelation, power_spectral_density):
        first, second = (function(each, PIXEL, periodic=periodic).values for each in (z, z[::-1, ::-1]))
        np.testing.assert_allclose(second, first, rtol=0, atol=1e-13 * first.max())


def test_values_at_opposite_lags_and_wavevectors_are_equal():
    values = autocorrelation(rough((8, 9), holes=0.2), PIXEL).values
    np.testing.assert_allclose(values, values[::-1, ::-1], rtol=0, atol=1e-13)
    values = power_spectral_density(rough((8, 9)), PIXEL).values[1:]
    np.testing.assert_allclose(values, values[::-1, ::-1], rtol=0, atol=1e-13 * values.max())


@given(maps(shape=st.tuples(st.integers(2, 5), st.integers(2, 5))), st.tuples(*[st.integers(0, 4)] * 2))
def test_shift_of_a_periodic_map_changes_nothing(z, shift):
    assume(np.nanmax(z) > np.nanmin(z))
    first, second = (height_statistics(each, PIXEL, periodic=True) for each in (z, np.roll(z, shift, (0, 1))))
    # sums in another order, of which those of the mean and the skewness may cancel to 0
    index = [0, 4]
    np.testing.assert_allclose(np.delete(numbers(second), index), np.delete(numbers(first), index), rtol=256 * EPS)
    assert second.mean == pytest.approx(first.mean, rel=4 * EPS, abs=64 * EPS * 1e-6)
    assert second.skewness == pytest.approx(first.skewness, rel=64 * EPS, abs=64 * EPS * 25)
    first, second = (autocorrelation(each, PIXEL, periodic=True) for each in (z, np.roll(z, shift, (0, 1))))
    np.testing.assert_allclose(second.values, first.values, rtol=0, atol=25 * 16 * EPS)


@given(maps(), pixels)
def test_missing_points_around_a_map_do_not_count(z, pixel):
    assume(1 not in z.shape)
    framed = np.pad(z, ((2, 1), (0, 3)), constant_values=NAN)
    first, second = height_statistics(z, pixel), height_statistics(framed, pixel)
    assert second.missing_fraction == pytest.approx(1 - np.isfinite(z).sum() / framed.size, abs=EPS)
    index = [0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12]
    np.testing.assert_array_equal(numbers(second)[index], numbers(first)[index])
    assume(first.rms_height > 0)
    first, second = autocorrelation(z, pixel), autocorrelation(framed, pixel)
    near = tuple(
        slice(b.size // 2 - a.size // 2, b.size // 2 + a.size // 2 + 1)
        for a, b in ((first.lags_x, second.lags_x), (first.lags_y, second.lags_y))
    )
    np.testing.assert_allclose(second.values[near], first.values, rtol=0, atol=25 * 16 * EPS)


def test_small_roughness_on_a_great_height():
    z = rough((20, 20)) - 3e-7
    low, high = height_statistics(z, PIXEL), height_statistics(z + 1, PIXEL)
    # heights near 1 are good to EPS/2, differences to 2 EPS, of 1e-7
    index = [1, 2, 3, 6, 7]
    np.testing.assert_allclose(numbers(high)[index], numbers(low)[index], rtol=4 * EPS / 1e-7)
    assert high.mean == pytest.approx(1 + low.mean, rel=EPS)
    first, second = (autocorrelation(each, PIXEL).values for each in (z, z + 1))
    np.testing.assert_allclose(second, first, rtol=0, atol=4 * EPS / 1e-7)


# ---- the least maps


@BOTH
@pytest.mark.parametrize("height", [0.0, 0.1, -1e-9])
def test_constant_height(periodic, height):
    z = np.full((7, 5), height)
    z[2, 3] = NAN
    found = height_statistics(z, PIXEL, periodic=periodic)
    assert found.mean == height
    assert numbers(found)[[1, 2, 3, 6, 7, 10, 11, 12]].tolist() == [0] * 8
    assert np.isnan(numbers(found)[[4, 5, 8, 13]]).all()
    moments = found.moments
    assert math.isnan(moments.summit_density)
    assert math.isnan(moments.mean_summit_height)
    assert moments.mean_summit_curvature == 0
    assert not power_spectral_density(np.full((7, 5), 0.1), PIXEL, periodic=True).values.any()
    with pytest.raises(InputError, match="all heights are equal; expected a rough surface"):
        autocorrelation(z, PIXEL, periodic=periodic)


def test_one_point():
    found = height_statistics([[2e-6]], PIXEL)
    assert (found.mean, found.rms_height) == (2e-6, 0)
    assert np.isnan(numbers(found)[[4, 5, 6, 7, 8, 11, 12, 13]]).all()
    assert power_spectral_density([[2e-6]], PIXEL, periodic=True).values.tolist() == [[0]]


def test_two_points():
    for z, pixel in (([[1.0], [4.0]], (2.0, 9.0)), ([[1.0, 4.0]], (9.0, 2.0))):
        found = height_statistics(z, pixel)
        assert (found.mean, found.rms_height, found.mean_deviation, found.height_range) == (2.5, 1.5, 1.5, 3)
        assert (found.rms_slope, found.moments.m2) == (1.5, 2.25)
        assert math.isnan(found.rms_curvature)
        assert math.isnan(found.bandwidth)
        assert math.isnan(found.moments.alpha)
        # each of the two has the other on both sides
        assert height_statistics(z, pixel, periodic=True).rms_curvature == 1.5


@BOTH
def test_a_profile_has_differences_along_its_long_axis_only(periodic):
    z = rough((30, 1))
    along = height_statistics(z, PIXEL, periodic=periodic)
    assert_same(along, height_statistics(z.T, PIXEL[::-1], periodic=periodic), 16 * EPS)
    around = np.concatenate([z[-1:], z, z[:1]]) if periodic else z
    steps, bends = np.diff(around[1 if periodic else 0 :, 0]) / PIXEL[0], np.diff(around[:, 0], 2) / PIXEL[0] ** 2
    assert along.rms_slope == pytest.approx(math.sqrt(np.mean(steps**2)), rel=1e-12)
    assert along.rms_curvature == pytest.approx(math.sqrt(np.mean(bends**2)), rel=1e-12)
    assert along.moments.m4 == pytest.approx(np.mean(bends**2), rel=1e-12)
    assert along.bandwidth == pytest.approx(along.moments.alpha, rel=1e-12)


def test_a_tilted_plane():
    i, j = np.indices((6, 7))
    found = height_statistics(8.0 * i - 6.0 * j, (4.0, 2.0))
    assert found.rms_slope == 2.5
    assert found.moments.m2 == (2**2 + 3**2) / 2
    assert found.rms_curvature == found.moments.m4 == found.bandwidth == found.moments.alpha == 0


def test_differences_that_have_no_partner_along_the_other_axis():
    z = [[1.0, NAN], [3.0, NAN]]
    found = height_statistics(z, 1.0)
    assert math.isnan(found.rms_slope)
    assert math.isnan(found.moments.m2)
    found = height_statistics([[1.0, NAN], [3.0, 5.0]], 1.0)
    assert math.isnan(found.rms_slope)
    assert found.moments.m2 == 4


# ---- input and output


def test_results_cannot_be_written_to_and_arguments_are_not():
    z = rough((6, 6), holes=0.1)
    z.flags.writeable = False
    correlation = autocorrelation(z, PIXEL)
    height_statistics(z, PIXEL)
    full = rough((6, 6))
    before = full.copy()
    density = power_spectral_density(full, PIXEL)
    np.testing.assert_array_equal(full, before)
    for array in (correlation.lags_x, correlation.lags_y, correlation.values, density.q_x, density.q_y, density.values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert all(type(value) is float for value in (height_statistics(z, PIXEL).mean, correlation.lay))


def test_lists_whole_numbers_and_one_pixel_size_will_do():
    heights = [[1, 2, 4], [0, 3, 5]]
    for function in (height_statistics, autocorrelation, power_spectral_density):
        first, second = function(heights, 2), function(np.array(heights, dtype=float), (2.0, 2.0))
        if function is height_statistics:
            assert numbers(first)[0] == numbers(second)[0] == 2.5
        else:
            np.testing.assert_array_equal(first.values, second.values)


@pytest.mark.parametrize("function", [height_statistics, autocorrelation, power_spectral_density])
@pytest.mark.parametrize(
    ("heights", "pixel", "message"),
    [
        (np.full((3, 2), NAN), 1.0, "all heights are missing; expected some"),
        ([1.0, 2.0], 1.0, r"heights have shape \(2,\); expected \(nx, ny\)"),
        (np.zeros((0, 3)), 1.0, r"heights have shape \(0, 3\)"),
        ([[1.0, math.inf]], 1.0, "some heights are infinite; expected finite ones"),
        ("map.csv", 1.0, "heights are not numbers; expected an array"),
        ([[1.0, 2.0]], 0.0, "pixel_size is 0; expected a finite number greater than 0"),
        ([[1.0, 2.0]], (1.0, NAN), r"pixel_size\[1\] is nan"),
        ([[1.0, 2.0]], (1.0, 2.0, 3.0), r"pixel_size has shape \(3,\); expected one number, or one for x"),
    ],
)
def test_maps_that_are_none(function, heights, pixel, message):
    with pytest.raises(InputError, match=message):
        function(heights, pixel)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: power_spectral_density([[1.0, NAN, 2.0, NAN]], 1.0, periodic=True),
            "2 of 4 heights are missing; .* fill them, or crop",
        ),
        (lambda: power_spectral_density([[1.0]], 1.0), "1 points for a form, plane"),
        (lambda: power_spectral_density([[1.0, 2.0]], 1.0).radial(), "a profile has no directions .* along_y"),
        (
            lambda: power_spectral_density(np.eye(4), 1.0).radial(spacing="quadratic"),
            "spacing is 'quadratic'; expected",
        ),
        (lambda: power_spectral_density(np.eye(4), 1.0).radial(0), "bins is 0; expected a finite number of 1 or more"),
        (lambda: power_spectral_density(np.eye(4), 1.0).radial(2.5), "bins is 2.5; expected a whole number of rings"),
        (lambda: autocorrelation(np.eye(4), 1.0).length("z"), "axis is 'z'; expected 'x' or 'y'"),
        (lambda: autocorrelation(np.eye(4), 1.0).length("x", 1.0), "level is 1; expected less than 1"),
        (
            lambda: autocorrelation(np.eye(4), 1.0).length("x", -2),
            "level is -2; expected a finite number of -1 or more",
        ),
        (lambda: autocorrelation(np.eye(4), 1.0).length("x", NAN), "level is nan"),
        (lambda: SpectralMoments(1, -1, 1), "SpectralMoments: m2 is -1.0; expected a finite number of 0 or more"),
        (lambda: SpectralMoments(1, 1, math.inf), "SpectralMoments: m4 is inf"),
        (lambda: SpectralMoments("1", 1, 1), "SpectralMoments: m0 is '1'"),
    ],
)
def test_arguments_out_of_range(call, message):
    with pytest.raises(InputError, match=message):
        call()


# ---- another library


@pytest.fixture(scope="module")
def topography():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("SurfaceTopography").Topography


def test_conventions_of_surface_topography(topography):
    z, pixel = sum_of_waves((24, 20)) + rough((24, 20), seed=19), (2e-6, 3e-6)
    found = height_statistics(z, pixel, periodic=True)
    density = power_spectral_density(z, pixel, periodic=True)
    size = density.size
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other = topography(z - z.mean(), size, periodic=True)
        turned = topography((z - z.mean()).T, size[::-1], periodic=True)
        heights, gradient = other.rms_height_from_area(), other.rms_gradient()
        slopes = [each.rms_slope_from_profile() for each in (other, turned)]
        curvatures = [each.rms_curvature_from_profile() for each in (other, turned)]
        _, _, values = other.power_spectrum_from_area(return_map=True, reliable=False)
    assert found.rms_height == pytest.approx(heights, rel=1e-12)
    assert found.moments.m2 == pytest.approx(gradient**2 / 2, rel=1e-12)
    assert found.moments.m2 == pytest.approx(np.mean(np.square(slopes)), rel=1e-12)
    assert found.moments.m4 == pytest.approx(np.mean(np.square(curvatures)), rel=1e-12)
    np.testing.assert_allclose(density.values, np.fft.fftshift(values), rtol=1e-9, atol=1e-14 * density.values.max())


def test_autocorrelation_of_surface_topography(topography):
    # its height difference autocorrelation is ⟨(z(x) - z(x + lag))²⟩/2 = Rq² (1 - ρ), averaged along the profiles
    z = rough((24, 20), seed=20)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other = topography(z, np.multiply(z.shape, PIXEL), periodic=True)
        lags, differences = other.autocorrelation_from_profile(reliable=False, resampling_method=None)
    found, values = autocorrelation(z, PIXEL, periodic=True).along_x()
    np.testing.assert_allclose(found[: lags.size], lags, rtol=1e-12)
    np.testing.assert_allclose(z.var() * (1 - values[: lags.size]), differences, rtol=1e-9, atol=1e-13 * z.var())


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
