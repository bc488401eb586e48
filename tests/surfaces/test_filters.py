import math

import numpy as np
import pytest

from historysim.surfaces import filters as module
from historysim.surfaces.filters import gaussian_mean, outliers, spikes

PIXEL = 0.5e-6


def by_least_squares(heights, pixel_size, cutoff, weights=None):
    """The plane of weighted least squares around each point, one by one."""
    present = np.isfinite(heights)
    weights = np.ones(heights.shape) if weights is None else weights
    x, y = np.meshgrid(
        *(np.arange(n) * p for n, p in zip(heights.shape, pixel_size, strict=True)), indexing="ij"
    )
    result = np.full(heights.shape, np.nan)
    for i, j in np.argwhere(present):
        dx, dy = x - x[i, j], y - y[i, j]
        near = present & (np.abs(dx) <= cutoff) & (np.abs(dy) <= cutoff)
        weight = weights * np.exp(-(math.pi**2) / math.log(2) * (dx**2 + dy**2) / cutoff**2)
        root = np.sqrt(weight[near])
        terms = np.stack([np.ones(near.sum()), dx[near] / cutoff, dy[near] / cutoff], axis=1)
        result[i, j] = np.linalg.lstsq(terms * root[:, None], heights[near] * root, rcond=None)[0][
            0
        ]
    return result


def wave(length, points=400):
    return np.cos(2 * np.pi * np.arange(points) * PIXEL / length)[:, None] * np.ones(60)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 5.0])
def test_half_of_a_wave_passes_at_the_cut_off(ratio):
    # exp(-π (α λ/λ_w)²) = 2^-(λ/λ_w)²; what the weights beyond a cut-off would add is 7e-7 at most
    heights = wave(20e-6 * ratio)
    passed = gaussian_mean(heights, (PIXEL, PIXEL), 20e-6, periodic=True)
    assert np.allclose(passed, 2 ** -(ratio**-2) * heights, rtol=0, atol=2e-6)
    if ratio <= 2:
        middle = gaussian_mean(heights, (PIXEL, PIXEL), 20e-6)[200, 30]
        assert middle == pytest.approx(2 ** -(ratio**-2) * heights[200, 30], abs=2e-6)


def test_it_is_the_plane_of_least_squares_against_borders_and_missing_points():
    rng = np.random.default_rng(1)
    heights = rng.normal(size=(23, 17))
    heights[rng.random(heights.shape) < 0.3] = np.nan
    heights[:4, :4] = np.nan
    found = gaussian_mean(heights, (1.0, 2.0), 8.0)
    assert np.allclose(
        found, by_least_squares(heights, (1.0, 2.0), 8.0), rtol=0, atol=1e-12, equal_nan=True
    )


def test_the_robust_one_is_the_fixed_point_of_tukeys_weights():
    rng = np.random.default_rng(2)
    heights = rng.normal(size=(20, 18))
    heights[4, 5], heights[12:14, 3] = 50, -30
    found = gaussian_mean(heights, (1.0, 1.0), 10.0, robust=True)
    residual = heights - found
    bound = 4.4478 * np.median(np.abs(residual))
    weights = np.where(np.abs(residual) < bound, (1 - (residual / bound) ** 2) ** 2, 0)
    again = by_least_squares(heights, (1.0, 1.0), 10.0, weights)
    # settled to 1e-4 of the median residual, which is below 1
    assert np.allclose(again, found, rtol=0, atol=2e-3)


def test_a_periodic_map_is_filtered_as_one_tile_of_many():
    heights = np.random.default_rng(4).normal(size=(24, 30))
    tiled = gaussian_mean(np.tile(heights, (3, 3)), (1.0, 1.0), 9.0)[24:48, 30:60]
    assert np.allclose(
        gaussian_mean(heights, (1.0, 1.0), 9.0, periodic=True), tiled, rtol=0, atol=1e-12
    )


# --- points that are no heights ---


def test_the_median_around_a_point_agrees_with_its_neighbours():
    rng = np.random.default_rng(1)
    # more rows than one batch
    heights = rng.normal(size=(70, 9))
    heights[rng.random(heights.shape) < 0.4] = np.nan
    heights[10:20] = np.nan
    found = module._neighbour_median(heights)
    for i, j in np.ndindex(heights.shape):
        if not (2 <= i < 68 and 2 <= j < 7):
            continue
        around = heights[i - 2 : i + 3, j - 2 : j + 3].copy()
        around[2, 2] = np.nan
        expected = np.median(around[np.isfinite(around)]) if np.isfinite(around).any() else np.nan
        assert found[i, j] == expected or (np.isnan(found[i, j]) and np.isnan(expected))


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


def test_coarse_steps_and_flat_maps_do_not_make_all_points_outliers():
    heights = np.zeros((100, 100))
    assert not spikes(heights, 5).any()
    assert not outliers(heights, 5).any()
    heights[::7, ::7] = 1.0
    heights[50, 51] = 100.0
    assert np.argwhere(spikes(heights, 50)).tolist() == [[50, 51]]
