import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from historysim.surfaces.interpolation import by_waves

EPS = np.finfo(float).eps
sizes = st.integers(1, 9)


def summed(heights, x, y):
    """The Fourier series wave by wave; a shortest wave of two pixels is shared between both its signs."""
    nx, ny = heights.shape
    transform = np.fft.fft2(heights) / heights.size
    total = np.zeros((x.size, y.size), dtype=complex)
    for i in range(nx):
        for j in range(ny):
            along_x = [i - nx, i] if 2 * i == nx else [i - nx if 2 * i > nx else i]
            along_y = [j - ny, j] if 2 * j == ny else [j - ny if 2 * j > ny else j]
            for p in along_x:
                for q in along_y:
                    wave = np.exp(2j * math.pi * p * x / nx)[:, None] * np.exp(2j * math.pi * q * y / ny)
                    total += transform[i, j] * wave / (len(along_x) * len(along_y))
    return total


@example(6, 6, 27528)
@given(sizes, sizes, st.integers(0, 10**6))
def test_a_map_between_its_points_is_the_sum_of_its_waves(nx, ny, seed):
    rng = np.random.default_rng(seed)
    heights, x, y = rng.normal(size=(nx, ny)), rng.uniform(-20, 20, 5), rng.uniform(-20, 20, 3)
    expected = summed(heights, x, y)
    assert np.abs(expected.imag).max() < 1e-12
    # phases of 20 turns keep 1e-14 of a turn, in each of at most 81 waves
    np.testing.assert_allclose(by_waves(heights, x, y), expected.real, rtol=0, atol=1e-11)


@given(sizes, sizes, st.integers(0, 10**6), st.integers(-30, 30), st.integers(-30, 30))
def test_at_its_points_a_map_is_itself_bit_for_bit(nx, ny, seed, i, j):
    heights = np.random.default_rng(seed).normal(size=(nx, ny))
    found = by_waves(heights, np.arange(nx) + float(i), np.arange(ny) + float(j))
    np.testing.assert_array_equal(found, np.roll(heights, (-i, -j), axis=(0, 1)))


@pytest.mark.parametrize("step", [1e-12, 1e-6])
def test_beside_its_points_a_map_keeps_its_digits(step):
    index = np.arange(64.0)
    heights = np.sin(2 * math.pi * 5 * index / 64)[:, None]
    slope = 2 * math.pi * 5 / 64 * np.cos(2 * math.pi * 5 * index / 64)
    found = by_waves(heights, index + step, np.zeros(1))[:, 0] - heights[:, 0]
    # the index itself is known to half a rounding of 64
    np.testing.assert_allclose(found, slope * step, rtol=0, atol=step**2 + 64 * EPS)


@pytest.mark.parametrize("part", [0.1, 0.25, 0.5, 0.7])
def test_of_the_shortest_wave_the_cosine_is_left(part):
    index = np.arange(16.0)
    shortest = np.where(index % 2 == 0, 1.0, -1.0)[:, None]
    found = by_waves(shortest, index + part, np.zeros(1))
    np.testing.assert_allclose(found, math.cos(math.pi * part) * shortest, rtol=0, atol=32 * EPS)


@pytest.mark.parametrize("count", [15, 16])
def test_all_waves_but_the_shortest_keep_their_amplitude(count):
    index = np.arange(float(count))
    for turns in range((count + 1) // 2):
        phase = 2 * math.pi * turns * index / count
        found = by_waves(np.cos(phase)[:, None], index + 0.5, np.zeros(1))[:, 0]
        np.testing.assert_allclose(found, np.cos(phase + math.pi * turns / count), rtol=0, atol=64 * EPS)
