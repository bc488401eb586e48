import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from rough_maps import EPS, PIXEL, WAVES, maps, pixels, rough, sum_of_waves
from scipy import signal

from historysim.surfaces.statistics import power_spectral_density


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
