import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import historysim as hs
from historysim.contact.hertz import (
    approach,
    contact_radius,
    effective_radius,
    mean_pressure,
    normal_load,
    normal_stiffness,
    peak_pressure,
    pressure_profile,
    shared_approach,
)
from historysim.contact.materials import MaterialPair, material
from historysim.errors import InputError

R, E = 2.5e-3, 43e9  # a ball on glass [m, Pa]
EPS = np.finfo(float).eps

lengths = st.floats(1e-12, 1e-3)
radii = st.floats(1e-7, 1e-1)
moduli = st.floats(1e3, 1e12)


def test_unit_contact():
    assert normal_load(1.0, summit_radius=1.0, contact_modulus=1.0) == pytest.approx(4 / 3, rel=4 * EPS)
    assert contact_radius(4.0, summit_radius=9.0) == 6.0
    assert mean_pressure(np.pi, contact_radius=1.0) == 1.0
    assert normal_stiffness(3.0, contact_modulus=2.0) == 12.0


def test_radius_of_silicon_on_glass():
    # by hand: a³ = 3 N R/(4 E*) with E* of Table B.1; 10 mN on a ball of 2.5 mm
    modulus = MaterialPair(material("silicon"), material("float glass")).contact_modulus
    depth = approach(10e-3, summit_radius=R, contact_modulus=modulus)
    assert contact_radius(depth, summit_radius=R) == pytest.approx(
        (0.75 * 2.5e-5 / 43.050430504e9) ** (1 / 3), rel=1e-10
    )


@given(lengths, radii, moduli)
def test_approach_and_load_are_inverse(depth, radius, modulus):
    load = normal_load(depth, summit_radius=radius, contact_modulus=modulus)
    assert approach(load, summit_radius=radius, contact_modulus=modulus) == pytest.approx(depth, rel=16 * EPS)


@given(lengths, radii, moduli)
def test_load_in_terms_of_the_contact_radius(depth, radius, modulus):
    a = contact_radius(depth, summit_radius=radius)
    load = normal_load(depth, summit_radius=radius, contact_modulus=modulus)
    assert load == pytest.approx(4 * modulus * a**3 / (3 * radius), rel=16 * EPS)
    # A = π R δ, where the source's equation 2.16 prints another area
    assert load / mean_pressure(load, contact_radius=a) == pytest.approx(math.pi * radius * depth, rel=16 * EPS)


def test_pressure_carries_the_load_and_makes_the_approach():
    depth = 40e-9
    a = contact_radius(depth, summit_radius=R)
    load = normal_load(depth, summit_radius=R, contact_modulus=E)

    def pressure(r):
        return pressure_profile(r, normal_load=load, contact_radius=a)

    assert quad(lambda r: pressure(r) * 2 * math.pi * r, 0, a)[0] == pytest.approx(load, rel=1e-9)
    # Boussinesq: the centre sinks by (1/πE*) ∫ p/r dA = (2/E*) ∫ p dr
    assert 2 / E * quad(pressure, 0, a)[0] == pytest.approx(depth, rel=1e-9)


def test_pressure_profile_between_centre_and_edge():
    profile = pressure_profile([0, 0.6, -0.6, 1, 1.1, -5], normal_load=np.pi, contact_radius=1.0)
    np.testing.assert_allclose(profile, [1.5, 1.2, 1.2, 0, 0, 0], rtol=8 * EPS)
    assert peak_pressure(np.pi, contact_radius=1.0) == 1.5


def test_normal_stiffness_is_the_slope_of_the_load():
    depth, step = 40e-9, 4e-13
    loads = normal_load(depth + np.array([-step, step]), summit_radius=R, contact_modulus=E)
    stiffness = normal_stiffness(contact_radius(depth, summit_radius=R), contact_modulus=E)
    # central difference: truncation (step/δ)²/24 = 4e-12, rounding EPS δ/step = 2e-11
    assert (loads[1] - loads[0]) / (2 * step) == pytest.approx(stiffness, rel=1e-10)


def test_no_contact():
    assert normal_load(-1e-9, summit_radius=R, contact_modulus=E) == 0
    assert contact_radius(-1e-9, summit_radius=R) == 0
    assert approach(0, summit_radius=R, contact_modulus=E) == 0
    assert mean_pressure(0, contact_radius=0) == 0
    assert pressure_profile(0.5, normal_load=0, contact_radius=0) == 0


def test_scalars_give_scalars_and_arrays_broadcast():
    assert isinstance(normal_load(1e-9, summit_radius=R, contact_modulus=E), float)
    assert isinstance(pressure_profile(0, normal_load=1, contact_radius=1), float)
    depths = np.array([-1, 1, 4])[:, None] * 1e-9
    loads = normal_load(depths, summit_radius=[R, 4 * R], contact_modulus=E)
    assert loads.shape == (3, 2)
    np.testing.assert_allclose(loads[2] / loads[1], 8, rtol=8 * EPS)
    np.testing.assert_allclose(loads[1:, 1] / loads[1:, 0], 2, rtol=8 * EPS)
    assert mean_pressure([0, 1], contact_radius=[0, 1]).tolist() == [0, 1 / np.pi]


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [(1, 1, 0.5), (2.5e-3, math.inf, 2.5e-3), (1, -2, 2), ([1, 2], 2, [2 / 3, 1])],
)
def test_effective_radius(first, second, expected):
    np.testing.assert_allclose(effective_radius(first, second), expected, rtol=4 * EPS)


@pytest.mark.parametrize(("first", "second"), [(0, 1), (math.inf, math.inf), (1, -0.5), (math.nan, 1), (1, -1)])
def test_radii_that_touch_at_no_point(first, second):
    with pytest.raises(InputError, match="do not touch at a point"):
        effective_radius(first, second)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: contact_radius(1, summit_radius=0), "summit_radius is 0; expected a finite number greater than 0"),
        (lambda: contact_radius(math.nan, summit_radius=1), "approach is nan; expected a finite number, in SI"),
        (lambda: contact_radius("a lot", summit_radius=1), "approach is 'a lot'; expected numbers in SI"),
        (lambda: normal_load(1, summit_radius=1, contact_modulus=-1), "contact_modulus is -1"),
        (lambda: approach([1, -2], summit_radius=1, contact_modulus=1), r"normal_load\[1\] is -2; .* of 0 or more"),
        (lambda: approach(1, summit_radius=math.inf, contact_modulus=1), "summit_radius is inf"),
        (lambda: mean_pressure(1, contact_radius=0), "contact_radius is 0 m under a normal load"),
        (lambda: normal_stiffness(-1, contact_modulus=1), "contact_radius is -1"),
    ],
)
def test_arguments_out_of_range(call, message):
    with pytest.raises(InputError, match=message):
        call()


@pytest.mark.parametrize("count", [1, 2, 300])
def test_a_shared_approach_carries_the_load(count):
    """It is that of the memory, which finds it otherwise, and the loads of the spheres are as Hertz has them."""
    rng = np.random.default_rng(count)
    pair = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=12e9)
    for _ in range(20):
        ensemble = hs.Ensemble(pair, rng.normal(0, 1e-7, count), rng.lognormal(-12, 1, count), 0.2)
        contact = {"summit_radius": ensemble.summit_radius, "contact_modulus": pair.contact_modulus}
        load = 10 ** rng.uniform(-12, 2)
        found = shared_approach(load, gap=ensemble.first_touch, **contact)
        # a relative rounding of each load is one of 2/3 of it of the approach; Newton stops at a few of them
        assert found == pytest.approx(ensemble.approach_at(load), rel=1e-13)
        assert normal_load(found - ensemble.first_touch, **contact).sum() == pytest.approx(load, rel=1e-13)


def test_the_least_and_the_largest_loads_have_an_approach():
    one = {"gap": [0.0, 1.0], "summit_radius": 1e-6, "contact_modulus": 1e11}
    assert shared_approach(0.0, **one) == 0.0
    assert 0 <= shared_approach(5e-324, **one) < 1e-200
    assert shared_approach(1e300, **one) == pytest.approx((1e300 / (8 / 3 * 1e8)) ** (2 / 3), rel=1e-13)
    assert 0 < shared_approach(1e308, **one) < np.inf
    with pytest.raises(InputError, match="load"):
        shared_approach(-1.0, **one)
    with pytest.raises(InputError, match="gap"):
        shared_approach(1.0, **one | {"gap": [-1.0, 0.0]})
