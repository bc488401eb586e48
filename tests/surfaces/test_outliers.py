import numpy as np
import pytest

from historysim.surfaces import outliers as module
from historysim.surfaces.outliers import outliers, spikes


def test_the_median_around_a_point_is_that_of_its_neighbours():
    rng = np.random.default_rng(1)
    # more rows than are taken at once
    heights = rng.normal(size=(70, 9))
    heights[rng.random(heights.shape) < 0.4] = np.nan
    heights[10:20] = np.nan
    found = module._median_around(heights)
    for i, j in np.ndindex(heights.shape):
        if not (2 <= i < 68 and 2 <= j < 7):
            continue
        around = heights[i - 2 : i + 3, j - 2 : j + 3].copy()
        around[2, 2] = np.nan
        expected = np.median(around[np.isfinite(around)]) if np.isfinite(around).any() else np.nan
        assert found[i, j] == expected or (np.isnan(found[i, j]) and np.isnan(expected))


def test_a_slope_goes_on_beyond_the_border():
    x, y = np.meshgrid(np.arange(20.0), np.arange(15.0), indexing="ij")
    assert np.allclose(module._median_around(3 * x - y), 3 * x - y, rtol=0, atol=1e-12)


def test_spikes_and_no_other_points_are_found():
    rng = np.random.default_rng(2)
    x = np.arange(200)
    # slopes and steps of the form are no spikes
    heights = 1e-7 * np.sin(x / 30)[:, None] + rng.normal(0, 1e-9, (200, 200))
    planted = np.zeros(heights.shape, dtype=bool)
    planted[[0, 10, 50, 51, 120], [0, 10, 60, 60, 199]] = True
    heights[planted] += 100e-9
    assert np.array_equal(spikes(heights, 20), planted)
    assert np.array_equal(spikes(-heights, 20), planted)


def test_gaussian_heights_have_as_many_as_they_should():
    heights = np.random.default_rng(3).normal(5, 2, (500, 500))
    # 250 000 × 0.0027, and four times the square root of that
    assert outliers(heights, 3).sum() == pytest.approx(675, abs=104)
    assert outliers(heights, 7).sum() == 0


def test_coarse_steps_and_flat_maps_do_not_make_all_points_outliers():
    heights = np.zeros((100, 100))
    assert not spikes(heights, 5).any()
    assert not outliers(heights, 5).any()
    heights[::7, ::7] = 1.0
    heights[50, 51] = 100.0
    assert np.argwhere(spikes(heights, 50)).tolist() == [[50, 51]]


def test_missing_points_are_none():
    heights = np.random.default_rng(4).normal(size=(50, 50))
    heights[20:30] = np.nan
    assert not (spikes(heights, 1) & np.isnan(heights)).any()
    assert not (outliers(heights, 1) & np.isnan(heights)).any()
