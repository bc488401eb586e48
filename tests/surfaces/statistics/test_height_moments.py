import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rough_maps import BOTH, EPS, NAN, PIXEL, Points, assert_same, maps, numbers, pixels, rough
from scipy.stats import chi2

from historysim.surfaces.statistics import height_statistics


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


@given(maps(), pixels, st.booleans(), st.sampled_from([2.0**-7, 2.0**5]), st.sampled_from([2.0**-3, 2.0**6]))
def test_scaling_of_heights_and_lengths(z, pixel, periodic, tall, wide):
    first = height_statistics(z, pixel, periodic=periodic)
    second = height_statistics(tall * z, wide * np.array(pixel), periodic=periodic)
    slope, curvature = tall / wide, tall / wide**2
    factors = [tall] * 4 + [1, 1, slope, curvature, 1, 1, tall**2, slope**2, curvature**2, 1]
    # powers of two leave no rounding
    np.testing.assert_allclose(numbers(second), numbers(first) * factors, rtol=4 * EPS)


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
