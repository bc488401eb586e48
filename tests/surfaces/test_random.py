import math

import numpy as np
import scipy.fft
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pytest import approx, mark, warns

from historysim.errors import UnlikelyValueWarning
from historysim.surfaces.random import _periodic_autocorrelation, _spectrum, random_surface

EPS = np.finfo(float).eps


def prescribed(shape, lengths, kind="exponential"):
    # ρ summed over images one by one, as it is written, with lengths in pixels; none along a side
    # of one pixel
    total = np.zeros(shape)
    i, j = np.ogrid[: shape[0], : shape[1]]
    reach = [
        0 if n == 1 else 3 + math.ceil(16 * length / n)
        for n, length in zip(shape, lengths, strict=True)
    ]
    for mx in range(-reach[0], reach[0] + 1):
        for my in range(-reach[1], reach[1] + 1):
            square = ((i - mx * shape[0]) / lengths[0]) ** 2 + (
                (j - my * shape[1]) / lengths[1]
            ) ** 2
            total += np.exp(-2.3 * (square if kind == "gaussian" else np.sqrt(square)))
    return total / total[0, 0]


def make(shape, lengths, seed, kind="exponential"):
    return random_surface(shape, 1.0, 1.0, lengths, seed=seed, autocorrelation=kind).heights


def whole(quadrant, shape):
    i, j = (np.minimum(np.arange(n), n - np.arange(n)) for n in shape)
    return quadrant[np.ix_(i, j)]


@mark.parametrize("kind", ["exponential", "gaussian"])
@mark.parametrize(
    "shape, lengths",
    [((9, 14), (4.5, 1.0)), ((64, 63), (1.5, 31.5)), ((50, 1), (25, 1))],
)
def test_heights_are_white_noise_filtered_for_the_autocorrelation(shape, lengths, kind):
    noise = np.random.Generator(np.random.PCG64(7)).standard_normal(shape)
    spectrum = np.maximum(np.fft.fft2(prescribed(shape, lengths, kind)).real, 0)
    expected = np.fft.ifft2(np.fft.fft2(noise) * np.sqrt(spectrum)).real
    expected -= expected.mean()
    # rounding errors of the spectrum, some EPS of its sum, come under the root
    assert_allclose(make(shape, lengths, 7, kind), expected / expected.std(), rtol=0, atol=1e-6)


@mark.parametrize("kind", ["exponential", "gaussian"])
@mark.parametrize(
    "shape, lengths",
    [((64, 64), (32.0, 3.0)), ((1, 31), (1.0, 9.0)), ((2, 3), (1, 1.5))],
)
def test_autocorrelation_is_summed_over_all_images(shape, lengths, kind):
    quadrant = _periodic_autocorrelation(shape, lengths, kind)
    # some hundred images beyond 14 lengths are left out, each less than exp(-2.3 × 14) = 1e-14
    assert_allclose(whole(quadrant, shape), prescribed(shape, lengths, kind), rtol=0, atol=1e-12)


def test_spectrum_of_profiles_in_closed_form():
    n, length = 500, 40.0
    k = 2 * np.pi * np.arange(n // 2 + 1) / n
    # exponential: a geometric series; its smallest value is a/2 = 0.03
    a = 2.3 / length
    geometric = math.sinh(a) / (math.cosh(a) - np.cos(k))
    made = _spectrum(_periodic_autocorrelation((n, 1), (length, 1), "exponential"), (n, 1))[:, 0]
    assert_allclose(made / made[0], geometric / geometric[0], rtol=1e-10)
    # Gaussian: a Gaussian, to rounding errors of its sum √(π/2.3) β = 47
    made = _spectrum(_periodic_autocorrelation((n, 1), (length, 1), "gaussian"), (n, 1))[:, 0]
    assert_allclose(made / made[0], np.exp(-(k**2) * length**2 / 9.2), rtol=0, atol=1e-13)


def test_smooth_surfaces_are_not_roughened_by_rounding():
    # ρ'''' = 12 (2.3/β²)², of which a sample of two lengths has its share of order 1; the rounding
    # of the spectrum would add a second difference of √6 √(EPS √(Σ ρ²)) = 5e-7 where this one is
    # 7e-9
    n, length = 2**16, 2.0**15
    expected = math.sqrt(12) * 2.3 / length**2
    for seed in range(3):
        heights = make((n, 1), length, seed, "gaussian")[:, 0]
        second = np.roll(heights, 1) - 2 * heights + np.roll(heights, -1)
        assert 0.1 * expected < second.std() < 3 * expected


@mark.filterwarnings("ignore::historysim.errors.UnlikelyValueWarning")
@given(
    st.tuples(st.integers(2, 40), st.integers(2, 40)),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.floats(1e-9, 1e3),
    st.tuples(st.floats(1e-9, 1e3), st.floats(1e-9, 1e3)),
    st.sampled_from(["exponential", "gaussian"]),
    st.integers(0, 2**70),
)
def test_rms_height_is_exact_and_the_mean_zero(
    shape, fractions, rms_height, pixel_size, kind, seed
):
    pixels = [1 + fraction * (n / 2 - 1) for fraction, n in zip(fractions, shape, strict=True)]
    lengths = tuple(length * size for length, size in zip(pixels, pixel_size, strict=True))
    surface = random_surface(
        shape, pixel_size, rms_height, lengths, seed=seed, autocorrelation=kind
    )
    heights = surface.heights
    assert heights.shape == surface.shape == shape
    assert surface.pixel_size == pixel_size
    square = math.fsum((heights**2).ravel()) / heights.size
    assert math.sqrt(square) == approx(rms_height, rel=8 * EPS)
    # heights within some 5 Rq are off by EPS each, and so is their mean when it is taken off
    assert abs(math.fsum(heights.ravel())) / heights.size <= 8 * EPS * rms_height


def test_seeds_reproduce_bit_for_bit_whatever_the_number_of_threads():
    first = make((150, 131), 9.0, 5)
    assert np.array_equal(make((150, 131), 9.0, np.int64(5)), first)
    for workers in (2, 3):
        with scipy.fft.set_workers(workers):
            assert np.array_equal(make((150, 131), 9.0, 5), first)
    other = make((150, 131), 9.0, 6)
    # two independent surfaces correlate as 1/√(points / Σ ρ²)
    assert abs(np.mean(first * other)) < 5 * math.sqrt(0.3 * 81 / first.size)


def test_a_surface_that_is_far_higher_than_wide_has_a_warning():
    with warns(
        UnlikelyValueWarning,
        match="rms_height is 30 m on an autocorrelation length of 5 µm, .* in m",
    ):
        random_surface(16, 1e-6, 30, (5e-6, 8e-6), seed=1)
    # a model without dimension is none; warnings are errors here
    random_surface(16, 1, 30, 5, seed=1)
