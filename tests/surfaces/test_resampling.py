import math

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pytest import mark
from scipy.interpolate import CubicSpline

from historysim.surfaces.resampling import _interpolate_by_waves as by_waves
from historysim.surfaces.resampling import resample

EPS = np.finfo(float).eps
PX, PY = 2e-6, 0.7e-6


def onto_itself(heights, **how):
    how = {"pixel_size": (PX, PY), "periodic": False} | how
    pixel = how.pop("pixel_size")
    return resample(heights, pixel, **({"shape": heights.shape, "onto": pixel} | how))


def centred_positions(shape, pixel=(PX, PY)):
    x, y = ((np.arange(n) - (n - 1) / 2) * p for n, p in zip(shape, pixel, strict=True))
    return x[:, None], y[None, :]


def noise(shape, seed=0, missing=0.0):
    rng = np.random.default_rng(seed)
    heights = rng.standard_normal(shape)
    return np.where(rng.random(shape) < missing, math.nan, heights)


def moved(heights, steps):
    """Give a map moved by whole pixels along x and y: what was at 0 is at the step now, and NaN came in."""
    out = np.full(heights.shape, math.nan)
    for i, j in np.ndindex(heights.shape):
        a, b = i - steps[0], j - steps[1]
        if 0 <= a < heights.shape[0] and 0 <= b < heights.shape[1]:
            out[i, j] = heights[a, b]
    return out


# --- points that coincide
# ---------------------------------------------------------------------------------------


shapes = st.tuples(st.integers(2, 8), st.integers(2, 8))
steps = st.tuples(st.integers(-9, 9), st.integers(-9, 9))


@mark.parametrize("size", [3, 30])
@mark.parametrize("quarters", [-5, 1, 2])
def test_quarter_turns_from_x_towards_y_agree_with_numpy(quarters, size):
    # np.rot90 turns from the first axis towards the second one, and these are x and y
    heights = noise((size, size), missing=0.2)
    for periodic in (False, True):
        found = onto_itself(
            heights, pixel_size=(PX, PX), rotation=quarters * np.pi / 2, periodic=periodic
        )
        assert_array_equal(found, np.rot90(heights, quarters))


# --- between the points
# -----------------------------------------------------------------------------------------


def test_a_periodic_map_is_the_periodic_bicubic_spline():
    heights, (nx, ny), (a, b) = noise((9, 12)), (9, 12), (0.3, -2.6)
    along_x = CubicSpline(
        np.arange(nx + 1), np.vstack([heights, heights[:1]]), axis=0, bc_type="periodic"
    )
    half = along_x((np.arange(nx) - a) % nx)
    along_y = CubicSpline(
        np.arange(ny + 1), np.hstack([half, half[:, :1]]), axis=1, bc_type="periodic"
    )
    found = onto_itself(heights, shift=(a * PX, b * PY), periodic=True)
    assert_allclose(found, along_y((np.arange(ny) - b) % ny), rtol=0, atol=100 * EPS)


def plane(shape, pixel=(1.0, 1.0)):
    x, y = centred_positions(shape, pixel)
    return 3 + x - 2 * y


@mark.parametrize(
    "how, shape",
    [
        ({"shift": (0.5, 0.25)}, (2, 2)),
        ({"rotation": 0.3}, (3, 3)),
    ],
)
def test_a_plane_between_its_points_is_a_plane_up_to_the_border(how, shape):
    found = onto_itself(plane(shape), pixel_size=(1.0, 1.0), **how)
    x, y = centred_positions(shape, (1.0, 1.0))
    place = (x + 1j * y - complex(*how.get("shift", (0, 0)))) * np.exp(-1j * how.get("rotation", 0))
    wanted = 3 + place.real - 2 * place.imag
    here = np.isfinite(found)
    assert here.any()
    # to 1e-8 of the rise of a pixel, in case it is continued for 14 points or more beyond its
    # border (0.27^14 of it)
    assert_allclose(found[here], wanted[here], rtol=0, atol=2e-8)


# --- missing points
# ---------------------------------------------------------------------------------------------


@mark.parametrize("periodic", [False, True])
def test_heights_are_missing_where_one_of_the_points_around_is(periodic):
    heights = np.zeros((8, 9))
    heights[3, 4] = math.nan
    for shift, wanted in [
        ((0, 0), {(3, 4)}),
        ((1, -2), {(4, 2)}),
        ((0.5, 0), {(3, 4), (4, 4)}),
        ((0, 0.25), {(3, 4), (3, 5)}),
        ((0.1, -0.9), {(3, 3), (4, 3), (3, 4), (4, 4)}),
    ]:
        found = onto_itself(heights, shift=np.multiply(shift, (PX, PY)), periodic=periodic)
        gone = np.isnan(found)
        if not periodic:
            x, y = (np.arange(n) - move for n, move in zip(heights.shape, shift, strict=True))
            outside = ((x < 0) | (x > 7))[:, None] | ((y < 0) | (y > 8))[None, :]
            assert gone[outside].all()
            gone &= ~outside
        assert {(int(i), int(j)) for i, j in np.argwhere(gone)} == wanted


# --- small maps, profiles, errors
# -------------------------------------------------------------------------------


# --- whole pixels and Fourier series
# ----------------------------------------------------------------------------


@mark.parametrize("interpolation", ["spline", "fourier", "none"])
@given(seed=st.integers(0, 10**6), shape=shapes, steps=steps)
def test_whole_pixels_move_a_periodic_map_bit_for_bit_by_any_interpolation(
    interpolation, seed, shape, steps
):
    heights = noise(shape, seed)
    shift = steps[0] * PX, steps[1] * PY
    found = onto_itself(heights, shift=shift, periodic=True, interpolation=interpolation)
    assert_array_equal(found, np.roll(heights, steps, axis=(0, 1)))


@mark.parametrize("part, step", [(0.49, 0), (0.51, 1), (-2.45, -2)])
@mark.parametrize("periodic", [False, True])
def test_without_interpolation_a_map_moves_by_the_nearest_whole_pixel(part, step, periodic):
    heights = noise((9, 8), missing=0.1)
    found = onto_itself(
        heights, shift=(part * PX, -part * PY), periodic=periodic, interpolation="none"
    )
    expected = (
        np.roll(heights, (step, -step), axis=(0, 1)) if periodic else moved(heights, (step, -step))
    )
    assert_array_equal(found, expected)


# --- the Fourier series ---

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
                    wave = np.exp(2j * math.pi * p * x / nx)[:, None] * np.exp(
                        2j * math.pi * q * y / ny
                    )
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
    assert_allclose(by_waves(heights, x, y), expected.real, rtol=0, atol=1e-11)
