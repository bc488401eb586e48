import math

import numpy as np
from golden import check_messages
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pytest import approx
from scipy.integrate import quad

from historysim.contact.hertz import (
    approach,
    contact_radius,
    mean_pressure,
    normal_load,
    peak_pressure,
    pressure_profile,
)

R, E = 2.5e-3, 43e9  # a ball on glass [m, Pa]
EPS = np.finfo(float).eps

lengths = st.floats(1e-12, 1e-3)
radii = st.floats(1e-7, 1e-1)
moduli = st.floats(1e3, 1e12)


@given(lengths, radii, moduli)
def test_approach_and_load_are_inverse(depth, radius, modulus):
    load = normal_load(depth, summit_radius=radius, contact_modulus=modulus)
    assert approach(load, summit_radius=radius, contact_modulus=modulus) == approx(
        depth, rel=16 * EPS
    )


@given(lengths, radii, moduli)
def test_load_in_terms_of_the_contact_radius(depth, radius, modulus):
    a = contact_radius(depth, summit_radius=radius)
    load = normal_load(depth, summit_radius=radius, contact_modulus=modulus)
    assert load == approx(4 * modulus * a**3 / (3 * radius), rel=16 * EPS)
    # A = π R δ, where the source's equation 2.16 prints another area
    assert load / mean_pressure(load, contact_radius=a) == approx(
        math.pi * radius * depth, rel=16 * EPS
    )


def test_pressure_carries_the_load_and_makes_the_approach():
    depth = 40e-9
    a = contact_radius(depth, summit_radius=R)
    load = normal_load(depth, summit_radius=R, contact_modulus=E)

    def pressure(r):
        return pressure_profile(r, normal_load=load, contact_radius=a)

    assert quad(lambda r: pressure(r) * 2 * math.pi * r, 0, a)[0] == approx(load, rel=1e-9)
    # Boussinesq: the centre sinks by (1/πE*) ∫ p/r dA = (2/E*) ∫ p dr
    assert 2 / E * quad(pressure, 0, a)[0] == approx(depth, rel=1e-9)


def test_pressure_profile_between_centre_and_edge():
    profile = pressure_profile([0, 0.6, -0.6, 1, 1.1, -5], normal_load=np.pi, contact_radius=1.0)
    assert_allclose(profile, [1.5, 1.2, 1.2, 0, 0, 0], rtol=8 * EPS)
    assert peak_pressure(np.pi, contact_radius=1.0) == 1.5


def test_scalars_give_scalars_and_arrays_broadcast():
    assert isinstance(normal_load(1e-9, summit_radius=R, contact_modulus=E), float)
    assert isinstance(pressure_profile(0, normal_load=1, contact_radius=1), float)
    depths = np.array([-1, 1, 4])[:, None] * 1e-9
    loads = normal_load(depths, summit_radius=[R, 4 * R], contact_modulus=E)
    assert loads.shape == (3, 2)
    assert_allclose(loads[2] / loads[1], 8, rtol=8 * EPS)
    assert_allclose(loads[1:, 1] / loads[1:, 0], 2, rtol=8 * EPS)
    assert mean_pressure([0, 1], contact_radius=[0, 1]).tolist() == [0, 1 / np.pi]


def test_messages():
    check_messages(globals())
