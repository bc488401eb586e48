import numpy as np
import pytest

import historysim as hs
from historysim.surfaces.detached import detached_summits


@pytest.mark.parametrize("count", [1, 2, 10])
def test_summits_far_above_all_others_are_counted(count):
    height = np.random.default_rng(count).normal(0, 1, 10_000)
    height[:count] = 20 + np.arange(count)
    assert detached_summits(height) == count
    assert detached_summits(height * 1e-9 + 1e-3) == count


def test_more_than_a_handful_are_no_outliers():
    height = np.random.default_rng(1).normal(0, 1, 10_000)
    height[:11] = 20
    assert detached_summits(height) == 0


@pytest.mark.parametrize("draw", ["normal", "exponential", "uniform", "gumbel"])
def test_nothing_stands_apart_in_heights_drawn_by_chance(draw):
    rng = np.random.default_rng(1)
    # the chance of one in all is below 300 · 10 · 1e-6
    for size in (111, 1000, 10_000):
        assert [detached_summits(getattr(rng, draw)(size=size)) for _ in range(100)] == [0] * 100


def test_a_random_surface_has_none():
    for seed in range(8):
        for length in (5e-6, 20e-6, 80e-6):
            surface = hs.random_surface((256, 256), 1e-6, 1e-6, length, seed=seed)
            assert detached_summits(surface.summits(9).height) == 0


def test_few_summits_and_equal_heights_have_no_outliers():
    assert detached_summits([1.0] * 110) == 0
    assert detached_summits([1.0] * 1000) == 0
    assert detached_summits([5.0] + [1.0] * 100) == 0
    # but one above a thousand of one height is one
    assert detached_summits([5.0] + [1.0] * 1000) == 1
