import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal, assert_array_less
from pytest import approx, mark, skip
from records_shared import SHARED
from scipy.integrate import trapezoid
from scipy.io import loadmat

from historysim.contact.greenwood_williamson import summit_contact
from historysim.surfaces.distribution import (
    Gaussian,
    Tabulated,
    drawn_summits,
    quantile_summits,
    textured_summits,
)

MEASURED = SHARED / "brake_reuss" / "brb_surface_data.mat"

EPS = np.finfo(float).eps

TWO_HILLS = Tabulated([0, 1, 2, 5, 6, 7], [0, 3, 0, 0, 3, 0])


def probability_below(height, table, density):
    """Integral of a table from its start, by trapezia of cells cut at the height."""
    table, density = np.asarray(table, float), np.asarray(density, float)
    ends = np.minimum(table[1:], np.maximum(height, table[:-1]))
    at_ends = np.array(
        [np.interp(end, table[i : i + 2], density[i : i + 2]) for i, end in enumerate(ends)]
    )
    return np.sum((ends - table[:-1]) * (density[:-1] + at_ends) / 2) / trapezoid(density, table)


@st.composite
def tables(draw):
    widths = draw(st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=8))
    start = draw(st.floats(-1e3, 1e3))
    density = draw(
        st.lists(
            st.just(0.0) | st.floats(1e-3, 1e3), min_size=len(widths) + 1, max_size=len(widths) + 1
        )
    )
    assume(any(density))
    return start + np.concatenate([[0], np.cumsum(widths)]), np.array(density)


def test_quantiles_of_gaussian_heights():
    # 1.959963984540054 and 3.090232306167813 are the tabled quantiles of the standard normal
    # distribution
    heights = Gaussian(2e-6, mean=1e-6).quantile([0.025, 0.5, 0.975, 0.999])
    assert_allclose(
        heights,
        1e-6 + 2e-6 * np.array([-1.959963984540054, 0, 1.959963984540054, 3.090232306167813]),
        rtol=8 * EPS,
    )
    assert isinstance(Gaussian(1.0).quantile(0.3), float)


@given(tables(), st.lists(st.floats(0, 1), min_size=1, max_size=5))
def test_the_probability_below_a_quantile_is_its_own(table, probabilities):
    made = Tabulated(*table)
    heights = made.quantile(probabilities)
    assert heights.shape == (len(probabilities),)
    # a rounding of the height, up to 1e4 of them in m, makes peak density times that; the sums
    # round as often as they have cells
    size = np.abs(table[0]).max()
    tolerance = 4 * EPS * size * made.density.max() + 40 * EPS
    for height, probability in zip(heights, probabilities, strict=True):
        assert made.height[0] <= height <= made.height[-1]
        assert probability_below(height, *table) == approx(probability, rel=0, abs=tolerance)


def moments_of_the_table(table):
    """Mean and deviation by the trapezoidal rule."""
    z = np.linspace(table.height[0], table.height[-1], 100_001)
    density = np.interp(z, table.height, table.density)
    mean = trapezoid(z * density, z)
    return mean, math.sqrt(trapezoid((z - mean) ** 2 * density, z))


@mark.parametrize("heights", [Gaussian(2.0, mean=-7.0), TWO_HILLS], ids=repr)
def test_ensembles_have_the_moments_of_their_distribution(heights):
    count = 40_000
    mean, deviation = (
        (-7.0, 2.0) if isinstance(heights, Gaussian) else moments_of_the_table(heights)
    )
    exact = quantile_summits(heights, 1.0, summit_density=count, nominal_area=1.0)
    # midpoint rule: less than the range of the function over the count; z² ranges over 40 σ² at
    # most
    assert exact.height.mean() == approx(mean, abs=10 * deviation / count)
    assert exact.height.std() == approx(deviation, abs=40 * deviation / count)
    drawn = drawn_summits(heights, 1.0, summit_density=count, nominal_area=1.0, seed=11)
    # 4 deviations of the means; the fourth moment is at most 3 σ⁴ (Gaussian)
    assert drawn.height.mean() == approx(mean, abs=4 * deviation / math.sqrt(count))
    assert drawn.height.std() == approx(deviation, abs=4 * deviation / math.sqrt(2 * count))


def test_a_seed_draws_the_same_summits():
    def drawn(seed, heights=TWO_HILLS):
        return drawn_summits(heights, 1.0, summit_density=50, nominal_area=1.0, seed=seed)

    one, again, other = drawn(5), drawn(np.int64(5)), drawn(6)
    for name in ("height", "x", "y"):
        assert_array_equal(getattr(one, name), getattr(again, name))
        assert not np.any(getattr(one, name) == getattr(other, name))
    # the same ranks and places with other heights
    assert_array_equal(np.argsort(one.height), np.argsort(drawn(5, Gaussian(1.0)).height))
    assert_array_equal(one.x, drawn(5, Gaussian(1.0)).x)


# --- regular arrays ---


def test_regular_array():
    made = textured_summits((2, 3), (10e-6, 20e-6), 5e-6)
    assert made.x == approx([0, 0, 0, 10e-6, 10e-6, 10e-6], rel=EPS)
    assert made.y == approx([0, 20e-6, 40e-6] * 2, rel=EPS)
    assert made.height.tolist() == [0] * 6
    assert made.radius.tolist() == [5e-6] * 6
    assert made.nominal_area == approx(20e-6 * 60e-6, rel=4 * EPS)
    # one summit per cell of the array
    assert made.density == approx(1 / (10e-6 * 20e-6), rel=4 * EPS)


def test_scatter_has_the_deviations_asked_for():
    count = 250_000
    made = textured_summits((500, 500), 1e-6, 8e-6, height_scatter=3e-9, radius_scatter=0.2, seed=1)
    # 4 deviations of the estimates: of a mean 1/√n, of a deviation √((kurtosis - 1)/(4n)); the
    # log-normal with 20 % has the kurtosis 3.66 (its closed form in exp(s²) = 1.04)
    assert made.height.mean() == approx(0, abs=4 * 3e-9 / math.sqrt(count))
    assert made.height.std() == approx(3e-9, rel=4 * math.sqrt(0.5 / count))
    assert made.radius.mean() == approx(8e-6, rel=4 * 0.2 / math.sqrt(count))
    assert made.radius.std() == approx(0.2 * 8e-6, rel=4 * math.sqrt(2.66 / 4 / count))
    # skewness of the logarithm, which is Gaussian, scatters by √(6/n); that of the radii themselves
    # would be 0.61
    logarithm = np.log(made.radius)
    standard = (logarithm - logarithm.mean()) / logarithm.std()
    assert np.mean(standard**3) == approx(0, abs=4 * math.sqrt(6 / count))
    assert abs(np.corrcoef(made.height, made.radius)[0, 1]) < 4 / math.sqrt(count)


# --- seeds ---


def test_summits_of_a_measured_joint():
    if not MEASURED.exists():
        skip(f"the measured surface {MEASURED.name} is not here")
    found = loadmat(MEASURED)
    radius, per_area, largest = (
        float(found[name].item()) for name in ("Re", "area_density", "z_max")
    )
    gap, density = found["normzinterp"].ravel(), found["pzinterp"].ravel()
    assert (radius, per_area, largest) == approx((1.365e-3, 1.371e6, 28e-6), rel=2e-3)

    made = Tabulated.from_gaps(largest * gap, density)
    assert made.height[[0, -1]].tolist() == [-largest, 0]
    # the source has a density per gap over its largest, and a kernel estimate that ends within the
    # table
    assert trapezoid(density, gap) == approx(1, abs=1e-4)
    assert_allclose(made.density[::-1], density / largest, rtol=1e-4)

    area = 0.05
    summits = quantile_summits(made, radius, summit_density=per_area, nominal_area=area)
    assert len(summits) == round(per_area * area)
    assert summits.height.max() < 0

    # the pressure as the source integrates it, over gaps, with the normal displacement as approach:
    # Porter and Brake, Mech. Syst. Signal Process. 192 (2023) 110210, elastic range
    modulus, approach = 192.31e9 / 2 / (1 - 0.3**2), np.array([4e-6, 10e-6])
    fine = np.linspace(0, 1, 100_001)
    depth = np.maximum(approach[:, None] - largest * fine, 0)
    one = 4 / 3 * modulus * math.sqrt(radius) * depth**1.5
    pressure = per_area * trapezoid(np.interp(fine, gap, density) * one, fine)
    carried = summit_contact(summits.height, radius, -approach, contact_modulus=modulus).normal_load
    # midpoint rule for a load that falls with rank: at most half the largest load over the count,
    # and 1e-4 of norm
    largest_load = 4 / 3 * modulus * math.sqrt(radius) * approach**1.5
    assert_array_less(
        np.abs(carried / area - pressure), 1e-4 * pressure + largest_load / (2 * area)
    )
