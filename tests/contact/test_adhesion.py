import math

import numpy as np
from adhesive import (
    ELASTIC,
    EPS,
    PULL,
    UNLOADED,
    E,
    R,
    Springs,
    W,
    contact,
    moduli,
    powers,
    radii,
    works,
)
from golden import check_messages
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pytest import approx, mark, raises

from historysim.contact import hertz
from historysim.contact.adhesion import (
    Regime,
    dmt_contact_radius,
    hertz_boundary,
    jkr_contact_radius,
    jkr_pull_off_load,
    maugis_contact_radius,
    maugis_parameter,
    maugis_pull_off_load,
    regime,
    rigid_boundary,
)
from historysim.contact.materials import work_of_adhesion
from historysim.errors import LoadError


def test_jkr_without_load_and_at_pull_off():
    assert jkr_contact_radius(0, **ELASTIC) == approx(UNLOADED, rel=8 * EPS)
    force = jkr_pull_off_load(summit_radius=R, work_of_adhesion=W)
    assert force == approx(-1.5 * PULL, rel=4 * EPS)
    scale = np.cbrt(9 * math.pi * W * R**2 / (8 * E))
    assert jkr_contact_radius(force, **ELASTIC) == approx(scale, rel=16 * EPS)


@mark.parametrize("parameter", [1e-3, 0.03, 0.3, 1, 3, 30, 300])
@mark.parametrize("share", [1, 2, 4])
def test_maugis_agrees_with_a_row_of_springs(parameter, share):
    arguments = contact(parameter)
    springs = Springs.of(share * UNLOADED, **arguments)
    # the gap is a difference of lengths of a²/R or c²/R, found to 1e-13 of them and known over its
    # range
    loss = 1e-12 * max(springs.zone**2 / R / springs.range, 1)
    found = maugis_contact_radius(springs.load, **arguments)
    assert found == approx(springs.a, rel=1e-9 + 10 * loss)


@mark.parametrize(
    "parameter, expected", [(0.1, 1.9506), (0.5, 1.7183), (1, 1.6007), (2, 1.5346), (5, 1.5064)]
)
def test_maugis_pull_off(parameter, expected):
    pull_off = maugis_pull_off_load(**contact(parameter)) / PULL
    # four places, where two of the five lie on the edge of rounding
    assert pull_off == approx(-expected, abs=0.6e-4)


def test_maugis_has_dmt_and_jkr_as_limits():
    # by hand from the zone of a → 0 for small λ: 2 - (16/3)(π/2 - 1)/√π λ^(3/2), with terms of λ³
    # left out
    for parameter in (1e-2, 1e-4, 1e-6):
        expected = 2 - 16 / 3 * (math.pi / 2 - 1) / math.sqrt(math.pi) * parameter**1.5
        assert -maugis_pull_off_load(**contact(parameter)) / PULL == approx(
            expected, abs=10 * parameter**3
        )
    # the zone is t² ~ 1/λ² wide, which is the measure of what JKR leaves out
    for parameter in (1e1, 1e3, 1e5):
        assert -maugis_pull_off_load(**contact(parameter)) / PULL == approx(1.5, abs=parameter**-2)
    for parameter, expected in ((1.1e-12, 2), (0.9e12, 1.5)):
        assert -maugis_pull_off_load(**contact(parameter)) / PULL == approx(expected, rel=1e-12)
    loads = np.array([-1.4, 0, 1, 100, 1e6]) * PULL
    assert_allclose(
        maugis_contact_radius(loads, **contact(1e5)),
        jkr_contact_radius(loads, **ELASTIC),
        rtol=1e-9,
    )
    loads = np.array([-1.9, 0, 1, 100]) * PULL
    # what DMT leaves out is of the order of λ
    assert_allclose(
        maugis_contact_radius(loads, **contact(1e-8)),
        dmt_contact_radius(loads, **ELASTIC),
        rtol=1e-7,
    )


def test_hertz_where_adhesion_is_a_twentieth_of_the_load():
    for parameter in (1e-3, 0.03, 0.4, 3, 100):
        arguments = contact(parameter)
        load = hertz_boundary(parameter) * PULL
        a = maugis_contact_radius(load, **arguments)
        assert 4 * E * a**3 / (3 * R) == approx(1.05 * load, rel=1e-11)
        assert regime(parameter, load / PULL * (1 + 1e-9)) is Regime.HERTZ
        assert regime(parameter, load / PULL * (1 - 1e-9)) is not Regime.HERTZ
    # DMT: 2 = 0.05 P; JKR: A³ - √6 A^(3/2) = P and A³ = 1.05 P
    assert_allclose(hertz_boundary([1e-12, 1e12]), [40, 2520], rtol=1e-6)
    assert np.all(np.diff(hertz_boundary(np.logspace(-3, 3, 61))) > 0)


@given(st.floats(-4, -1.01), st.floats(-1.9, 39), radii, moduli, works)
def test_rigid_where_the_compression_is_a_twentieth_of_the_separation(
    power, share, radius, modulus, work
):
    arguments = contact(10**power, radius, modulus, work)
    load = (share + 2) * math.pi * work * radius
    compression = hertz.approach(load, summit_radius=radius, contact_modulus=modulus)
    rigid = compression / (0.05 * arguments["equilibrium_separation"])
    expected = Regime.RIGID if rigid < 1 else Regime.DMT
    if abs(rigid - 1) > 1e-9:
        assert regime(10**power, share) is expected
        assert (share < rigid_boundary(10**power)) == (rigid < 1)
    # at the boundary itself; the load is a difference from 2, which costs some digits at large λ
    load = (rigid_boundary(10**power) + 2) * math.pi * work * radius
    compression = hertz.approach(load, summit_radius=radius, contact_modulus=modulus)
    assert compression / arguments["equilibrium_separation"] == approx(0.05, rel=1e-11)


@mark.parametrize(
    "parameter, load, expected",
    [
        (1e-3, 1, Regime.RIGID),
        (1e-3, 41, Regime.HERTZ),
        (0.05, 1, Regime.DMT),
        (0.1, 0, Regime.MAUGIS),
        (5, 0, Regime.MAUGIS),
        (1e6, 2519, Regime.JKR),
        (1e6, 2521, Regime.HERTZ),
    ],
)
def test_regimes(parameter, load, expected):
    assert regime(parameter, load) is expected
    assert regime(np.array([parameter]), [load]).tolist() == [expected]


@given(powers, radii, moduli, works)
def test_maugis_parameter_follows_its_definition(power, radius, modulus, work):
    assert maugis_parameter(**contact(10**power, radius, modulus, work)) == approx(
        10**power, rel=32 * EPS
    )


def test_work_of_adhesion():
    # silicon on float glass
    assert work_of_adhesion(44.1e-3, 83.4e-3) == approx(2e-3 * math.sqrt(44.1 * 83.4), rel=4 * EPS)
    assert work_of_adhesion(44.1e-3, 83.4e-3, 20e-3) == approx(107.5e-3, rel=4 * EPS)
    assert work_of_adhesion(0.05, 0.05) == approx(0.1, rel=4 * EPS)
    assert work_of_adhesion(0.05, 0.05, 0) == approx(0.1, rel=4 * EPS)
    assert_allclose(work_of_adhesion([1, 4], 9), [6, 12], rtol=4 * EPS)


def test_scalars_give_scalars_and_arrays_broadcast():
    arguments = contact(1.0)
    for value in (
        maugis_contact_radius(0, **arguments),
        maugis_pull_off_load(**arguments),
        jkr_contact_radius(0, **ELASTIC),
        dmt_contact_radius(0, **ELASTIC),
        work_of_adhesion(1, 1),
        hertz_boundary(1),
    ):
        assert isinstance(value, float)
    assert np.all(np.diff(maugis_pull_off_load(**contact(np.logspace(-3, 3, 61)))) > 0)
    several = contact(np.array([0.1, 1, 10]))
    loads = np.array([-1, 0, 5, 80])[:, None] * PULL
    together = maugis_contact_radius(loads, **several)
    assert together.shape == (4, 3)
    one = [
        [maugis_contact_radius(load, **contact(parameter)) for parameter in (0.1, 1, 10)]
        for load in loads[:, 0]
    ]
    assert_allclose(together, one, rtol=16 * EPS)
    one = [maugis_pull_off_load(**contact(parameter)) for parameter in (0.1, 1, 10)]
    assert_allclose(maugis_pull_off_load(**several), one, rtol=16 * EPS)


@mark.parametrize("radius, share", [(jkr_contact_radius, -1.501), (dmt_contact_radius, -2.001)])
def test_loads_beyond_pull_off(radius, share):
    with raises(LoadError, match=r"normal_load of -\S+ N pulls harder .* pull-off load of -\S+ N"):
        radius([0, share * PULL], **ELASTIC)
    # rounding of the pull-off load itself is forgiven
    assert np.isfinite(radius(round(share, 1) * PULL * (1 + 4 * EPS), **ELASTIC))


def test_messages():
    check_messages(globals())
