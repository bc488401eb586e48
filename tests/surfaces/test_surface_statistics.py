import math
import warnings
from fractions import Fraction

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pytest import approx, fixture, importorskip
from rough_maps import (
    EPS,
    NAN,
    Points,
    autocorrelation,
    height_statistics,
    maps,
    pixels,
    rough,
    sum_of_waves,
)

from historysim.surfaces.surface_statistics import Autocorrelation

# --- heights, slopes, curvatures ---


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


@given(maps(), pixels, st.booleans())
def test_statistics_against_loops_over_the_points(z, pixel, periodic):
    points = Points(z, periodic)
    count = len(points.deviations)
    rms = root_mean_square(points.deviations)
    found = height_statistics(z, pixel, periodic=periodic)
    # about 25 roundings in a row, of the heights about the mean; the mean itself is as good as its
    # datum
    rtol = 64 * EPS
    assert found.mean == approx(float(points.mean), rel=4 * EPS, abs=64 * EPS * 1e-6)
    assert found.rms_height == approx(rms, rel=rtol)
    assert found.mean_deviation == approx(float(sum(map(abs, points.deviations)) / count), rel=rtol)
    spread = max(points.deviations) - min(points.deviations)
    assert found.height_range == approx(float(spread), rel=rtol)
    assert found.missing_fraction == approx(1 - count / z.size, abs=EPS)
    for name, power in (("skewness", 3), ("kurtosis", 4)):
        exact = (
            float(sum(value**power for value in points.deviations) / count) / rms**power
            if rms
            else NAN
        )
        # a skewness of 0 is the difference of two sums of the order of the kurtosis, at most the
        # number of points
        assert getattr(found, name) == approx(exact, rel=rtol, abs=rtol * 25, nan_ok=True)
    # second differences add four heights up to half a spread from their middle, 4 EPS of it for 0
    # in the end
    atol = 8 * EPS * float(max(abs(value) for value in points.z.values() if value is not None))
    for order, average, moment in ((1, "rms_slope", "m2"), (2, "rms_curvature", "m4")):
        exact, square = brute_differences(points, pixel, order)
        floor = atol / min(pixel) ** order
        assert getattr(found, average) == approx(exact, rel=rtol, abs=floor, nan_ok=True)
        assert math.sqrt(getattr(found.moments, moment)) == approx(
            math.sqrt(square), rel=rtol, abs=floor, nan_ok=True
        )


# --- autocorrelation ---


def brute_autocorrelation(points, lag):
    products = []
    for i, j in points.z:
        first, second = points.z[i, j], points.at(i + lag[0], j + lag[1])
        if first is not None and second is not None:
            products.append((first - points.mean) * (second - points.mean))
    return sum(products) / len(products) if products else NAN


@given(maps(), pixels, st.booleans())
def test_autocorrelation_against_loops_over_the_pairs(z, pixel, periodic):
    points = Points(z, periodic)
    assume(any(points.deviations))
    found = autocorrelation(z, pixel, periodic=periodic)
    steps = [range(-(n // 2), n // 2 + 1) for n in z.shape]
    assert_allclose(found.lags_x, np.array(steps[0]) * pixel[0], rtol=2 * EPS)
    assert_allclose(found.lags_y, np.array(steps[1]) * pixel[1], rtol=2 * EPS)
    variance = brute_autocorrelation(points, (0, 0))
    exact = [
        [float(brute_autocorrelation(points, (i, j)) / variance) for j in steps[1]]
        for i in steps[0]
    ]
    # a transform of at most 8 × 8 keeps each sum to a few EPS of the greatest one, that of up to 25
    # pairs, of which the least frequent lag has one
    assert_allclose(found.values, exact, rtol=0, atol=25 * 16 * EPS)
    assert found.values[z.shape[0] // 2, z.shape[1] // 2] == 1


def test_length_is_interpolated_between_the_lags_around_it():
    lags = np.arange(-3, 4) * 2.0
    values = np.array([[0.3, 0.05, 0.5, 1.0, 0.5, 0.05, 0.3]])
    found = Autocorrelation(np.zeros(1), lags, values)
    assert found.length("y", 0.1) == approx(2 + 2 * (0.5 - 0.1) / 0.45, rel=4 * EPS)
    assert found.length("y", 0.5) == 2
    assert found.length("y", 0.75) == 1
    assert found.length("y", 0.05) == 4
    assert math.isnan(found.length("y", 0.04))
    assert math.isnan(found.length("x"))
    # over a lag without pairs, straight on to the next one
    gap = Autocorrelation(lags, np.zeros(1), np.array([[0.2, NAN, 0.6, 1, 0.6, NAN, 0.2]]).T)
    assert gap.length("x", 0.4) == approx(4, rel=4 * EPS)


# --- both ---


@fixture(scope="module")
def topography():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importorskip("SurfaceTopography").Topography


def test_conventions_of_surface_topography(topography):
    z, pixel = sum_of_waves((24, 20)) + rough((24, 20), seed=19), (2e-6, 3e-6)
    found = height_statistics(z, pixel, periodic=True)
    size = np.multiply(z.shape, pixel)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other = topography(z - z.mean(), size, periodic=True)
        turned = topography((z - z.mean()).T, size[::-1], periodic=True)
        heights, gradient = other.rms_height_from_area(), other.rms_gradient()
        slopes = [each.rms_slope_from_profile() for each in (other, turned)]
        curvatures = [each.rms_curvature_from_profile() for each in (other, turned)]
    assert found.rms_height == approx(heights, rel=1e-12)
    assert found.moments.m2 == approx(gradient**2 / 2, rel=1e-12)
    assert found.moments.m2 == approx(np.mean(np.square(slopes)), rel=1e-12)
    assert found.moments.m4 == approx(np.mean(np.square(curvatures)), rel=1e-12)
