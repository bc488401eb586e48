import math

import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, UNLOADED, E, R, Springs, contact, moduli, powers, radii, works
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from historysim.contact import hertz
from historysim.contact.adhesion import (
    dmt_contact_radius,
    jkr_approach,
    jkr_contact_radius,
    jkr_normal_load,
    maugis_adhesive_zone_radius,
    maugis_approach,
    maugis_contact_radius,
    maugis_normal_load,
    maugis_pull_off_load,
)
from historysim.errors import LoadError


@pytest.mark.parametrize("parameter", [1e-3, 0.03, 0.3, 1, 3, 30, 300])
@pytest.mark.parametrize("share", [0.02, 0.5, 1, 4])
def test_maugis_agrees_with_a_row_of_springs(parameter, share):
    arguments = contact(parameter)
    a = share * UNLOADED
    springs = Springs.of(a, **arguments)
    # the gap is a difference of lengths of a²/R or c²/R, found to 1e-13 of them and known over its range
    loss = 1e-12 * max(springs.zone**2 / R / springs.range, 1)
    assert maugis_adhesive_zone_radius(a, **arguments) == pytest.approx(springs.zone, rel=1e-10 + loss)
    assert maugis_approach(a, **arguments) == pytest.approx(springs.approach, rel=1e-9 + 10 * loss)
    assert maugis_normal_load(a, **arguments) == pytest.approx(springs.load, rel=1e-9 + 10 * loss, abs=1e-9 * PULL)


@pytest.mark.parametrize(
    ("parameter", "expected"), [(0.1, 1.9506), (0.5, 1.7183), (1, 1.6007), (2, 1.5346), (5, 1.5064)]
)
def test_maugis_pull_off(parameter, expected):
    arguments = contact(parameter)
    pull_off = maugis_pull_off_load(**arguments) / PULL
    # four places, where two of the five lie on the edge of rounding
    assert pull_off == pytest.approx(-expected, abs=0.6e-4)
    least = minimize_scalar(
        lambda share: Springs.of(share * UNLOADED, **arguments).load / PULL, bounds=(0.01, 1), options={"xatol": 1e-5}
    )
    # a minimum found to 1e-5 of its place is good to 1e-9 in its value
    assert pull_off == pytest.approx(least.fun, rel=1e-8)


@pytest.mark.parametrize("parameter", [1, 2, 10])
def test_maugis_pull_off_under_displacement(parameter):
    arguments = contact(parameter)
    least = minimize_scalar(
        lambda share: Springs.of(share * UNLOADED, **arguments).approach * R / UNLOADED**2,
        bounds=(0.02, 1),
        options={"xatol": 1e-6},
    )
    expected = Springs.of(least.x * UNLOADED, **arguments).load
    # the place of a minimum is good to √EPS or so, and the load is not flat there
    assert maugis_pull_off_load(**arguments, control="displacement") == pytest.approx(expected, rel=1e-5)


def test_maugis_has_dmt_and_jkr_as_limits():
    # by hand from the zone of a → 0 for small λ: 2 - (16/3)(π/2 - 1)/√π λ^(3/2), with terms of λ³ left out
    for parameter in (1e-2, 1e-4, 1e-6):
        expected = 2 - 16 / 3 * (math.pi / 2 - 1) / math.sqrt(math.pi) * parameter**1.5
        assert -maugis_pull_off_load(**contact(parameter)) / PULL == pytest.approx(expected, abs=10 * parameter**3)
    # the zone is t² ~ 1/λ² wide, which is the measure of what JKR leaves out
    for parameter in (1e1, 1e3, 1e5):
        assert -maugis_pull_off_load(**contact(parameter)) / PULL == pytest.approx(1.5, abs=parameter**-2)
        held = maugis_pull_off_load(**contact(parameter), control="displacement")
        assert -held / PULL == pytest.approx(5 / 6, abs=parameter**-2)
    for parameter, expected in ((1.1e-12, 2), (0.9e12, 1.5)):
        assert -maugis_pull_off_load(**contact(parameter)) / PULL == pytest.approx(expected, rel=1e-12)
    loads = np.array([-1.4, 0, 1, 100, 1e6]) * PULL
    np.testing.assert_allclose(
        maugis_contact_radius(loads, **contact(1e5)), jkr_contact_radius(loads, **ELASTIC), rtol=1e-9
    )
    a = np.array([0.1, 1, 10]) * UNLOADED
    np.testing.assert_allclose(
        maugis_normal_load(a, **contact(1e5)), jkr_normal_load(a, **ELASTIC), rtol=1e-9, atol=1e-9 * PULL
    )
    np.testing.assert_allclose(maugis_approach(a, **contact(1e5)), jkr_approach(a, **ELASTIC), rtol=1e-9)
    loads = np.array([-1.9, 0, 1, 100]) * PULL
    # what DMT leaves out is of the order of λ
    np.testing.assert_allclose(
        maugis_contact_radius(loads, **contact(1e-8)), dmt_contact_radius(loads, **ELASTIC), rtol=1e-7
    )


@settings(max_examples=60)
@given(powers, st.floats(0, 1e4), radii, moduli, works)
def test_maugis_load_and_contact_radius_are_inverse(power, excess, radius, modulus, work):
    arguments = contact(10**power, radius, modulus, work)
    unit = math.pi * work * radius
    pull_off = maugis_pull_off_load(**arguments)
    assert -2 < pull_off / unit < -1.5
    load = pull_off + excess * unit
    a = maugis_contact_radius(load, **arguments)
    # load and radius are known to some roundings of their terms A³ and P, which the load moves by 1.5 A³/P at most
    assert maugis_normal_load(a, **arguments) == pytest.approx(load, rel=0, abs=1e-13 * (abs(load) + 10 * unit))
    assert maugis_adhesive_zone_radius(a, **arguments) > a
    assert a > hertz.contact_radius(
        hertz.approach(max(load, 0), summit_radius=radius, contact_modulus=modulus), summit_radius=radius
    )


@settings(max_examples=30)
@given(powers, radii, moduli, works)
def test_maugis_has_one_equilibrium_family_in_units_of_its_own(power, radius, modulus, work):
    arguments, plain = contact(10**power, radius, modulus, work), contact(10**power, 1.0, 0.75, 1 / math.pi)
    length = (math.pi * work * radius**2 / (4 / 3 * modulus)) ** (1 / 3)
    sizes = np.array([0.2, 1, 5])
    for function, unit in (
        (maugis_normal_load, math.pi * work * radius),
        (maugis_approach, length**2 / radius),
        (maugis_adhesive_zone_radius, length),
    ):
        own, other = function(sizes * length, **arguments) / unit, function(sizes, **plain)
        # inputs are rounded on the way; a load or an approach near its zero is known to the size of its terms only
        np.testing.assert_allclose(own, other, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("parameter", [1e-3, 0.1, 0.9, 0.95, 1, 5, 100, 1e3])
def test_maugis_load_and_approach_have_one_minimum_each(parameter):
    arguments = contact(parameter)
    a = np.geomspace(1e-6, 10, 3000) * UNLOADED
    for values, unit, control in (
        (maugis_normal_load(a, **arguments), PULL, "load"),
        (maugis_approach(a, **arguments), UNLOADED**2 / R, "displacement"),
    ):
        moves = np.diff(values)
        # steps below some roundings tell no direction
        signs = np.sign(moves[np.abs(moves) > 64 * EPS * max(unit, np.abs(values[0]))])
        assert np.count_nonzero(np.diff(signs)) <= 1
        assert signs[-1] == 1
        if control == "load":
            # a grid of 1.0054 in ratio misses the least load by its square, at most
            assert maugis_pull_off_load(**arguments) == pytest.approx(values.min(), rel=1e-4)
    zones = maugis_adhesive_zone_radius(a, **arguments)
    assert np.all(zones > a)
    assert np.all(np.diff(zones / a) < 0)


def test_maugis_pull_off_rises_from_dmt_to_jkr():
    arguments = contact(np.logspace(-3, 3, 61))
    assert np.all(np.diff(maugis_pull_off_load(**arguments)) > 0)


def test_a_point_contact_is_where_the_gap_closes():
    for parameter in (1e-3, 0.5, 1, 100):
        arguments = contact(parameter)
        zone = maugis_adhesive_zone_radius(0, **arguments)
        springs = Springs(0, zone, **arguments)
        assert maugis_normal_load(0, **arguments) == pytest.approx(springs.load, rel=1e-9)
        # the middle sinks by 2σ0c/E under a uniform pull, and touches: its gap is 0 of terms as large as W/σ0 + c²/R
        assert maugis_approach(0, **arguments) == pytest.approx(
            springs.approach, abs=1e-9 * (springs.range + zone**2 / R)
        )
        assert maugis_approach(0, **arguments) == pytest.approx(-2 * springs.stress * zone / E, rel=1e-9)


def test_maugis_at_and_beyond_pull_off():
    arguments = contact(np.logspace(-3, 3, 13))
    pull_off = maugis_pull_off_load(**arguments)
    a = maugis_contact_radius(pull_off, **arguments)
    np.testing.assert_allclose(maugis_normal_load(a, **arguments), pull_off, rtol=1e-13)
    with pytest.raises(LoadError, match="pulls harder than the contact can carry"):
        maugis_contact_radius(pull_off * (1 + 1e-12), **arguments)
