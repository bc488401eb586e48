import numpy as np
import pytest

from historysim.surfaces.heights import Surface
from historysim.surfaces.random import random_surface
from historysim.surfaces.smoothing import smoothing_notice


def rough(seed=1, autocorrelation="exponential", shape=(128, 128), pixel=1e-6):
    return random_surface(shape, pixel, 1e-7, 2e-5, seed=seed, autocorrelation=autocorrelation)


@pytest.mark.parametrize(("move", "share"), [({"shift": (0.5e-6, -3.5e-6)}, 32), ({"rotation": 0.3}, 17)])
def test_the_share_of_the_curvature_that_splines_take(move, share):
    other = rough(2)
    level = Surface(np.zeros(other.shape), other.pixel_size, periodic=True)
    taken = 1 - level.combined(other, **move).statistics().rms_curvature / other.statistics().rms_curvature
    assert 100 * taken == pytest.approx(share, abs=1.5)
    assert f"which takes {100 * taken:.2g} % of its rms curvature" in smoothing_notice(rough(), other, **move)


def test_nothing_is_said_where_nothing_is_taken():
    assert smoothing_notice(rough(), rough(2)) is None
    assert smoothing_notice(rough(), rough(2), shift=(3e-6, -2e-6)) is None
    # every other point of a map with pixels half as wide, between which nothing is interpolated
    assert smoothing_notice(rough(shape=(65, 65), pixel=2e-6), rough(2, shape=(129, 129))) is None
    # a Gaussian autocorrelation has no waves short enough
    assert smoothing_notice(rough(), rough(2, "gaussian"), shift=(0.5e-6, 0.5e-6)) is None


def test_other_pixels_are_told_without_a_number():
    told = smoothing_notice(rough(), rough(2, pixel=1.3e-6))
    assert "takes what is shorter than some four of its pixels: fewer summits, of larger radii" in told


@pytest.mark.parametrize(
    ("periodic", "rotation", "remedy"),
    [
        (True, 0.0, "; interpolation 'fourier' takes nothing"),
        (False, 0.0, "interpolation 'none', by whole pixels of one size, takes nothing"),
        (True, 0.2, "; without a rotation interpolation 'fourier' takes nothing"),
    ],
)
def test_the_remedy_is_one_that_the_surface_allows(periodic, rotation, remedy):
    other = Surface(rough(2).heights, 1e-6, periodic=periodic)
    assert smoothing_notice(rough(), other, shift=(0.5e-6, 0), rotation=rotation).endswith(remedy)


def test_a_map_with_missing_points_is_compared_where_it_has_points():
    heights = np.array(rough(2).heights)
    heights[40:60, 30] = np.nan
    other = Surface(heights, 1e-6)
    assert "3" in smoothing_notice(rough(), other, shift=(0.5e-6, 0.5e-6)).partition("takes ")[2][:2]
