import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from historysim.contact.greenwood_williamson import summit_contact
from historysim.contact.mindlin import preliminary_displacement
from historysim.errors import InputError
from historysim.surfaces.textured import split, split_contact, textured_summits

EPS = np.finfo(float).eps
SELF_SIMILAR, INVARIANT = "self-similar", "curvature-invariant"

R, E, G, LOAD, FRICTION = 2.5e-3, 43e9, 13e9, 50e-3, 0.2

counts = st.integers(1, 10**6)
loads = st.floats(1e-9, 1e3)
radii = st.floats(1e-7, 1e-1)
moduli = st.floats(1e6, 1e12)


def test_regular_array():
    made = textured_summits((2, 3), (10e-6, 20e-6), 5e-6)
    assert made.x == pytest.approx([0, 0, 0, 10e-6, 10e-6, 10e-6], rel=EPS)
    assert made.y == pytest.approx([0, 20e-6, 40e-6] * 2, rel=EPS)
    assert made.height.tolist() == [0] * 6
    assert made.radius.tolist() == [5e-6] * 6
    assert made.nominal_area == pytest.approx(20e-6 * 60e-6, rel=4 * EPS)
    # one summit per cell of the array
    assert made.density == pytest.approx(1 / (10e-6 * 20e-6), rel=4 * EPS)


def test_one_pitch_is_for_both_directions():
    one, two = textured_summits((4, 2), 3e-6, 1e-6), textured_summits((4, 2), (3e-6, 3e-6), 1e-6)
    np.testing.assert_array_equal(one.x, two.x)
    np.testing.assert_array_equal(one.y, two.y)
    assert one.nominal_area == two.nominal_area
    assert len(textured_summits((1, 1), 1e-6, 1e-6)) == 1


def test_scatter_has_the_deviations_asked_for():
    count = 250_000
    made = textured_summits((500, 500), 1e-6, 8e-6, height_scatter=3e-9, radius_scatter=0.2, seed=1)
    # 4 deviations of the estimates: of a mean 1/√n, of a deviation √((kurtosis - 1)/(4n)); the log-normal with 20 % has
    # the kurtosis 3.66 (its closed form in exp(s²) = 1.04)
    assert made.height.mean() == pytest.approx(0, abs=4 * 3e-9 / math.sqrt(count))
    assert made.height.std() == pytest.approx(3e-9, rel=4 * math.sqrt(0.5 / count))
    assert made.radius.mean() == pytest.approx(8e-6, rel=4 * 0.2 / math.sqrt(count))
    assert made.radius.std() == pytest.approx(0.2 * 8e-6, rel=4 * math.sqrt(2.66 / 4 / count))
    # skewness of the logarithm, which is Gaussian, scatters by √(6/n); that of the radii themselves would be 0.61
    logarithm = np.log(made.radius)
    standard = (logarithm - logarithm.mean()) / logarithm.std()
    assert np.mean(standard**3) == pytest.approx(0, abs=4 * math.sqrt(6 / count))
    assert abs(np.corrcoef(made.height, made.radius)[0, 1]) < 4 / math.sqrt(count)


def test_radii_with_much_scatter_are_positive():
    made = textured_summits((100, 100), 1e-6, 8e-6, radius_scatter=1.0, seed=2)
    assert made.radius.min() > 0
    assert made.height.tolist() == [0] * 10_000


def test_a_seed_makes_the_same_texture():
    def made(**scatter):
        return textured_summits((7, 5), 1e-6, 8e-6, **scatter)

    both = made(height_scatter=1e-9, radius_scatter=0.1, seed=3)
    again = made(height_scatter=1e-9, radius_scatter=0.1, seed=3)
    np.testing.assert_array_equal(both.height, again.height)
    np.testing.assert_array_equal(both.radius, again.radius)
    # either scatter is there by itself
    np.testing.assert_array_equal(made(height_scatter=1e-9, seed=3).height, both.height)
    np.testing.assert_array_equal(made(radius_scatter=0.1, seed=3).radius, both.radius)
    np.testing.assert_array_equal(made(height_scatter=1e-9, seed=3).radius, 8e-6)
    assert not np.any(made(height_scatter=1e-9, seed=4).height == both.height)
    # twice the scatter of the same draw
    np.testing.assert_allclose(made(height_scatter=2e-9, seed=3).height, 2 * both.height, rtol=EPS)


def test_radii_of_both_laws():
    assert split(R, [1, 4, 100], SELF_SIMILAR) == pytest.approx([R, R / 2, R / 10], rel=4 * EPS)
    assert split(R, [1, 4, 100], INVARIANT).tolist() == [R] * 3
    assert isinstance(split(R, 9, SELF_SIMILAR), float)


@given(loads, radii, counts, moduli)
def test_self_similar_splitting_keeps_area_and_pressure(load, radius, count, modulus):
    one = split_contact(load, radius, 1, SELF_SIMILAR, contact_modulus=modulus)
    many = split_contact(load, radius, count, SELF_SIMILAR, contact_modulus=modulus)
    assert many.normal_load * count == pytest.approx(load, rel=4 * EPS)
    # δ ~ (F/√R)^(2/3): n^(-2/3) of the load and n^(1/6) of the radius; n π R δ keeps
    assert many.approach / one.approach == pytest.approx(count**-0.5, rel=32 * EPS)
    assert many.contact_radius / one.contact_radius == pytest.approx(count**-0.5, rel=32 * EPS)
    assert many.contact_area == pytest.approx(one.contact_area, rel=32 * EPS)


@given(loads, radii, counts, moduli)
def test_curvature_invariant_splitting_spreads_the_area(load, radius, count, modulus):
    one = split_contact(load, radius, 1, INVARIANT, contact_modulus=modulus)
    many = split_contact(load, radius, count, INVARIANT, contact_modulus=modulus)
    assert many.normal_load * count == pytest.approx(load, rel=4 * EPS)
    assert many.approach / one.approach == pytest.approx(count ** (-2 / 3), rel=32 * EPS)
    assert many.contact_radius / one.contact_radius == pytest.approx(count ** (-1 / 3), rel=32 * EPS)
    assert many.contact_area / one.contact_area == pytest.approx(count ** (1 / 3), rel=32 * EPS)


@pytest.mark.parametrize(("law", "power"), [(SELF_SIMILAR, -1 / 2), (INVARIANT, -2 / 3)])
def test_preliminary_displacement_goes_with_the_approach(law, power):
    many = split_contact(LOAD, R, [1, 4, 25, 900], law, contact_modulus=E)
    displacement = preliminary_displacement(
        normal_load=many.normal_load, contact_radius=many.contact_radius, shear_modulus=G, friction=FRICTION
    )
    np.testing.assert_allclose(displacement / displacement[0], np.array([1.0, 4, 25, 900]) ** power, rtol=32 * EPS)
    np.testing.assert_allclose(displacement, E / (4 * G) * FRICTION * many.approach, rtol=32 * EPS)


@pytest.mark.parametrize("law", [SELF_SIMILAR, INVARIANT])
def test_a_texture_of_split_asperities_carries_the_load(law):
    # found with no help of the closed form: the separation where the sum over all summits is the load
    made = textured_summits((6, 4), 100e-6, split(R, 24, law))

    def total(depth):
        return summit_contact(made.height, made.radius, -depth, contact_modulus=E)

    depth = brentq(lambda depth: total(depth).normal_load - LOAD, 0, 1e-6, xtol=1e-20)
    expected = split_contact(LOAD, R, 24, law, contact_modulus=E)
    # brentq stops at 4 EPS of the depth
    assert depth == pytest.approx(expected.approach, rel=32 * EPS)
    assert total(depth).contact_area == pytest.approx(expected.contact_area, rel=64 * EPS)


def test_splitting_of_arrays_broadcasts():
    made = split_contact(np.array([[1.0], [2.0]]), [R, 2 * R, R], [1, 2, 3], SELF_SIMILAR, contact_modulus=E)
    assert made.approach.shape == made.contact_area.shape == (2, 3)
    lone = split_contact(2.0, 2 * R, 2, SELF_SIMILAR, contact_modulus=E)
    assert made.approach[1, 1] == pytest.approx(lone.approach, rel=4 * EPS)
    assert isinstance(lone.contact_area, float)
    assert split_contact(0, R, 3, SELF_SIMILAR, contact_modulus=E).contact_area == 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: textured_summits((2, 2), 1, 1, height_scatter=1.0), "without a seed; expected a whole number as seed"),
        (lambda: textured_summits((2, 2), 1, 1, radius_scatter=0.1), "without a seed"),
        (lambda: textured_summits((2, 2), 1, 1, radius_scatter=0.1, seed=-1), "seed is -1"),
        (lambda: textured_summits((2, 2), 1, 1, radius_scatter=20, seed=1), "radius_scatter is 20; expected 0 to 1"),
        (lambda: textured_summits((2, 2), 1, 1, radius_scatter=-0.1, seed=1), "radius_scatter is -0.1"),
        (lambda: textured_summits((2, 2), 1, 1, height_scatter=-1e-9, seed=1), "height_scatter is -1e-09"),
        (lambda: textured_summits(4, 1, 1), r"count is 4; expected two whole numbers \(nx, ny\)"),
        (lambda: textured_summits((2, 2, 2), 1, 1), "expected two whole numbers"),
        (lambda: textured_summits((2, 2.5), 1, 1), "expected two whole numbers"),
        (lambda: textured_summits((0, 2), 1, 1), r"count is \(0, 2\); expected 1 or more each way"),
        (lambda: textured_summits((10**4, 10**4), 1, 1), "at most 50,000,000 in all"),
        (lambda: textured_summits((2, 2), 0, 1), "pitch is 0"),
        (lambda: textured_summits((2, 2), (1, 2, 3), 1), r"pitch has shape \(3,\); expected one number, or one for x"),
        (lambda: textured_summits((2, 2), 1, -1), "radius is -1"),
        (lambda: split(1, 2, "fractal"), "law is 'fractal'; expected one of 'self-similar', 'curvature-invariant'"),
        (lambda: split(1, [1, 2.5], SELF_SIMILAR), r"count is \[1, 2.5\]; expected whole numbers"),
        (lambda: split(1, 0, SELF_SIMILAR), "count is 0; expected a finite number of 1 or more"),
        (lambda: split(0, 1, SELF_SIMILAR), "radius is 0"),
        (lambda: split_contact(-1, 1, 1, SELF_SIMILAR, contact_modulus=1), "normal_load is -1"),
        (lambda: split_contact(1, 1, 1, SELF_SIMILAR, contact_modulus=0), "contact_modulus is 0"),
    ],
)
def test_arguments_out_of_range(call, message):
    with pytest.raises(InputError, match=message):
        call()
