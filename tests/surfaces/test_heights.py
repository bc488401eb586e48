import math
from fractions import Fraction

import attrs
import numpy as np
import xarray as xr
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, mark, raises

from historysim.surfaces.heights import Surface

EPS = np.finfo(float).eps
NAN = math.nan

heights_with_gaps = npst.arrays(
    float,
    st.tuples(st.integers(1, 6), st.integers(1, 6)),
    elements=st.one_of(st.floats(-1, 1, width=32), st.just(NAN)),
).filter(lambda heights: np.isfinite(heights).any())


def rough(shape=(12, 9), seed=0, missing=0.0):
    rng = np.random.default_rng(seed)
    heights = rng.standard_normal(shape)
    return np.where(rng.random(shape) < missing, NAN, heights)


# --- what comes in
# ----------------------------------------------------------------------------------------------


@mark.parametrize(
    "heights",
    [
        [[1, 2, 3], [4, 5, 6]],
        np.array([[1, 2, 3], [4, 5, 6]], ">f4"),
        np.arange(12.0, 0, -1).reshape(4, 3)[1::2, ::-1][::-1] - [[0, 0, 0], [2, 2, 2]],
        xr.DataArray([[1, 2, 3], [4, 5, 6]]),
    ],
)
def test_any_array_of_numbers(heights):
    wanted = [[1, 2, 3], [4, 5, 6]]
    if not np.array_equal(heights, wanted):
        wanted = np.array(heights, float).tolist()
    surface = Surface(heights, (1e-6, 2e-6))
    assert surface.heights.dtype == np.float64
    assert surface.heights.tolist() == wanted
    assert surface.shape == (2, 3)
    assert not surface.missing.any()


def test_heights_cannot_be_changed_from_outside_or_inside():
    values = np.ones((3, 4))
    surface = Surface(values, 1e-6)
    values[0, 0] = 9
    assert surface.heights[0, 0] == 1
    assert values.flags.writeable
    for held in (
        surface,
        surface.mirrored(),
        surface + surface,
        surface.detrended("mean"),
        Surface(rough(), 1).scaled(1),
    ):
        with raises(ValueError, match="read-only"):
            held.heights[0, 0] = 5
    with raises(attrs.exceptions.FrozenInstanceError):
        surface.heights = values
    masked = np.ma.array(np.ones((2, 2)), mask=np.eye(2))
    held = Surface(masked, 1)
    masked[:] = 7
    assert_array_equal(held.heights, [[NAN, 1], [1, NAN]])


# --- form
# -------------------------------------------------------------------------------------------------------


# --- scaling
# ----------------------------------------------------------------------------------------------------


def squared_ratio(heights, wanted):
    """Give (Rq / wanted)², in exact fractions."""
    values = [Fraction(float(value)) for value in heights[np.isfinite(heights)]]
    mean = sum(values) / len(values)
    return float(sum((value - mean) ** 2 for value in values) / len(values) / Fraction(wanted) ** 2)


@mark.parametrize("wanted", [1e-160, 1e-9, 1e150])
@mark.parametrize("power", [-660, -20, 1000])
def test_scaled_to_an_rms_height_of_any_size(power, wanted):
    # small integers with a mean of exactly 0, times 1e-160, 1e-199, 1e-6, 1, 1e160 or 1e301 m
    integers = np.random.default_rng(8).integers(-9, 10, (10, 7)).astype(float)
    integers[0, 0] -= integers.sum()
    integers[3, 4] = NAN if integers[3, 4] == 0 else integers[3, 4]
    surface = Surface(2.0**power * integers, (1.0, 2.0), periodic=True)
    scaled = surface.scaled(wanted)
    # each of the 70 heights is rounded by a few EPS, and all by the same few
    assert squared_ratio(scaled.heights, wanted) == approx(1, rel=20 * EPS)
    assert (scaled.pixel_size, scaled.periodic) == (surface.pixel_size, True)
    # stretched, not bent
    factor = wanted / np.sqrt(np.nanmean(integers**2))
    assert_allclose(scaled.heights / wanted, integers * factor / wanted, rtol=20 * EPS)


# --- mirrors and sums
# -------------------------------------------------------------------------------------------


@given(heights_with_gaps, st.integers(0, 10**6))
def test_a_sum_of_maps_on_one_grid_is_exact(heights, seed):
    other = rough(heights.shape, seed, missing=0.2)
    assume(np.isfinite(heights + other).any())
    first, second = Surface(heights, (2.0, 3.0)), Surface(other, (2.0, 3.0))
    assert_array_equal((first + second).heights, heights + other)
    assert_array_equal((second + first).heights, heights + other)


def test_a_sum_is_on_the_grid_of_the_first_with_the_centres_together():
    coarse, fine = Surface(np.zeros((3, 3)), 2.0), Surface(rough((9, 9)), 1.0)
    total = coarse + fine
    assert_array_equal(total.heights, fine.heights[2:7:2, 2:7:2])
    assert total.pixel_size == (2.0, 2.0)
    back = fine + coarse
    assert back.shape == (9, 9)
    # the coarse map reaches 2 m from the centre, the fine one 4 m
    assert_array_equal(np.isfinite(back.heights), np.pad(np.ones((5, 5), bool), 2))


def test_shift_and_rotation_move_the_other_surface():
    plain = Surface(np.zeros((5, 5)), 1.0)
    peak = np.zeros((5, 5))
    peak[3, 2] = 1  # one step along x from the centre
    other = Surface(peak, 1.0)

    def top(**how):
        heights = plain.combined(other, **how).heights
        return tuple(int(i) for i in np.unravel_index(np.nanargmax(heights), heights.shape))

    assert top() == (3, 2)
    assert top(shift=(1, 0)) == (4, 2)
    assert top(shift=(0, -2)) == (3, 0)
    # a quarter from x towards y
    assert top(rotation=np.pi / 2) == (2, 3)
    assert top(rotation=-np.pi / 2) == (2, 1)
    assert top(rotation=np.pi) == (1, 2)
    # turned about its own centre first, and moved then
    assert top(rotation=np.pi / 2, shift=(1, 0)) == (3, 3)


@mark.parametrize(
    "first, second, how, repeats",
    [
        ((True, 4, 1.0), (True, 8, 0.5), {}, True),
        ((False, 4, 1.0), (True, 4, 1.0), {}, False),
        ((True, 4, 1.0), (True, 4, 1.0), {"rotation": 0.1}, False),
    ],
)
def test_a_sum_repeats_where_both_do_with_the_same_lengths(first, second, how, repeats):
    surfaces = [Surface(rough((n, n)), pixel, periodic) for periodic, n, pixel in (first, second)]
    assert surfaces[0].combined(surfaces[1], **how).periodic is repeats


# --- hard cases combined
# -----------------------------------------------------------------------------------------


def test_a_cropped_surface_has_the_points_between_two_positions():
    heights = np.arange(42.0).reshape(6, 7)
    surface = Surface(heights, (0.1e-6, 0.2e-6), periodic=True)
    # 0.3e-6 is no multiple of 0.1e-6 to the last bit
    cropped = surface.cropped(x=(0.1e-6, 0.3e-6), y=(0.39e-6, 1e-6))
    assert np.array_equal(cropped.heights, heights[1:4, 2:6])
    assert not cropped.periodic
    assert surface.cropped().periodic
    assert np.array_equal(surface.cropped(y=(0, 1)).heights, heights)


def test_a_surface_on_finer_and_coarser_points_is_the_same_wave():
    def wave(points, pixel):
        x = (np.arange(points) - (points - 1) / 2) * pixel
        return np.sin(2 * np.pi * x / 16)[:, None] * np.ones(12)

    # cubic splines of a wave of 16 points
    for periodic in (False, True):
        surface = Surface(wave(64, 1.0), 1.0, periodic)
        finer = surface.at_resolution((0.5, 1.0))
        assert (finer.shape, finer.pixel_size, finer.periodic) == ((128, 12), (0.5, 1.0), periodic)
        there = ~finer.missing
        assert there[2:-2].all()
        assert np.abs((finer.heights - wave(128, 0.5))[there]).max() < 2e-3
    coarser = Surface(wave(64, 1.0), 1.0, periodic=True).at_resolution((2.1, 1.0))
    assert coarser.shape == (30, 12)
    assert coarser.size == approx((64, 12))


# --- on a ball
# --------------------------------------------------------------------------------------------------


def test_roughness_on_a_ball_is_the_sum_of_both():
    flat = Surface(rough((9, 6)), (1e-3, 2e-3), periodic=True)
    ball = flat.on_ball(0.05)
    x, y = 1e-3 * (np.arange(9) - 4.0), 2e-3 * (np.arange(6) - 2.5)
    form = np.array([[math.sqrt(0.05**2 - a**2 - b**2) - 0.05 for b in y] for a in x])
    assert ball.heights == approx(flat.heights + form, abs=1e-12)
    assert not ball.periodic
    # what is taken off again is the ball
    assert Surface(np.zeros((9, 6)), (1e-3, 2e-3)).on_ball(0.05).form("sphere").radius == approx(
        0.05, rel=1e-9
    )
