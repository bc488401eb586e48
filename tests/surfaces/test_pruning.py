import numpy as np
import pytest
from scipy import ndimage

import historysim as hs
from historysim.surfaces.pruning import prominences

EIGHT = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))
FOUR = ((1, 0), (-1, 0), (0, 1), (0, -1))


def by_levels(heights, point, structure):
    """The prominence of one top, by cutting the map at every level below it."""
    top = heights[point]
    for level in np.unique(heights[heights <= top])[::-1]:
        labels, _ = ndimage.label(heights >= level, structure)
        if heights[labels == labels[point]].max() > top:
            return top - level
    return np.inf


@pytest.mark.parametrize("offsets", [EIGHT, FOUR])
def test_prominence_is_the_drop_to_the_level_at_which_a_higher_top_joins(offsets):
    rng = np.random.default_rng(1)
    structure = np.ones((3, 3)) if offsets == EIGHT else ndimage.generate_binary_structure(2, 1)
    for _ in range(5):
        heights = ndimage.gaussian_filter(rng.normal(size=(20, 24)), 1)
        heights[rng.random(heights.shape) < 0.1] = np.nan
        found = prominences(heights, offsets)
        filled = np.where(np.isnan(heights), -np.inf, heights)
        assert (found > 0).any()
        for point in map(tuple, np.argwhere(found > 0)):
            # a piece of its own, which no way leaves, has no higher one to join
            level = np.where(np.isnan(heights), np.nan, heights)
            labels, _ = ndimage.label(np.isfinite(level), structure)
            own = np.where(labels == labels[point], filled, -np.inf)
            finite = np.where(np.isfinite(own), own, np.nan)
            expected = by_levels(np.nan_to_num(finite, nan=-1e9), point, structure)
            expected = np.inf if expected > 1e6 else expected
            assert found[point] == expected


def test_a_periodic_map_has_no_border():
    heights = ndimage.gaussian_filter(np.random.default_rng(2).normal(size=(32, 32)), 1.5, mode="wrap")
    found = prominences(heights, EIGHT, periodic=True)
    moved = prominences(np.roll(heights, (5, 11), (0, 1)), EIGHT, periodic=True)
    assert np.array_equal(np.roll(found, (5, 11), (0, 1)), moved)
    assert np.isinf(found).sum() == 1


@pytest.mark.parametrize("rule", [5, 9])
def test_pruned_summits_are_those_prominent_enough(rule):
    surface = hs.random_surface((64, 64), 1e-6, 1e-6, 10e-6, seed=1)
    every = surface.summits(rule)
    assert np.array_equal(surface.summits(rule, prominence=1e-30).height, every.height)
    counts = [len(surface.summits(rule, prominence=p)) for p in (0.1e-6, 0.5e-6, 2e-6, 1.0)]
    assert len(every) > counts[0] > counts[1] > counts[2] >= counts[3] == 1
    kept = surface.summits(rule, prominence=0.5e-6)
    assert set(zip(kept.x, kept.y, strict=True)) < set(zip(every.x, every.y, strict=True))


def test_a_plateau_is_as_prominent_as_its_top():
    heights = np.zeros((9, 12))
    heights[3:5, 3:5] = 2.0
    heights[3:6, 8] = 3.0
    assert sorted(hs.Surface(heights, 1.0).summits(9, prominence=1.9).height) == [2.0, 3.0]
    assert hs.Surface(heights, 1.0).summits(9, prominence=2.1).height.tolist() == [3.0]


def test_a_profile_is_pruned_along_its_length():
    profile = np.array([0, 3, 1, 2, 0.5, 4, 0])
    assert hs.Surface(profile, 1.0).summits(3, prominence=1.5).height.tolist() == [3.0, 4.0]
    assert hs.Surface(profile[None], 1.0).summits(3, prominence=1.5).height.tolist() == [3.0, 4.0]


def test_a_prominence_is_a_length():
    with pytest.raises(hs.InputError, match="prominence is -1"):
        hs.Surface(np.zeros((5, 5)), 1.0).summits(9, prominence=-1.0)
