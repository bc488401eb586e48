import math
import warnings

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rough_maps import BOTH, EPS, NAN, PIXEL, WAVES, assert_same, maps, numbers, pixels, rough, sum_of_waves

from historysim.errors import InputError
from historysim.surfaces.statistics import SpectralMoments, autocorrelation, height_statistics, power_spectral_density


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


@given(maps(holes=False), pixels)
def test_density_of_a_periodic_map_adds_up_to_the_variance(z, pixel):
    density = power_spectral_density(z, pixel, periodic=True)
    cell = (2 * math.pi) ** 2 / np.prod(density.size)
    total = density.values.sum() * cell / (2 * math.pi) ** 2
    assert total == pytest.approx(height_statistics(z, pixel).rms_height ** 2, rel=64 * EPS)


def test_density_and_autocorrelation_are_transforms_of_each_other():
    z = rough((12, 10), seed=3)
    density = power_spectral_density(z, PIXEL, periodic=True)
    covariance = np.fft.fftshift(np.fft.ifft2(np.fft.ifftshift(density.values)).real) / (PIXEL[0] * PIXEL[1])
    found = autocorrelation(z, PIXEL, periodic=True)
    # of an even number of points the lag of half the length stands on both sides, in a transform once
    np.testing.assert_allclose(found.values[:-1, :-1] * np.nanvar(z), covariance, rtol=0, atol=1e-14 * np.var(z))
    np.testing.assert_array_equal(found.values[-1], found.values[0])


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
