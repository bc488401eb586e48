import math

import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, UNLOADED, E, R, Springs, W, contact, moduli, powers, radii, works
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize, minimize_scalar

from historysim.contact import hertz
from historysim.contact.adhesion import (
    Regime,
    branch,
    dmt_approach,
    dmt_contact_radius,
    dmt_normal_load,
    dmt_pull_off_load,
    hertz_boundary,
    jkr_approach,
    jkr_contact_radius,
    jkr_normal_load,
    jkr_pull_off_load,
    maugis_adhesive_zone_radius,
    maugis_approach,
    maugis_contact_radius,
    maugis_normal_load,
    maugis_parameter,
    maugis_pull_off_load,
    regime,
    rigid_boundary,
)
from historysim.contact.materials import work_of_adhesion
from historysim.errors import InputError, LoadError


def jkr_energy(a, approach):
    """Elastic energy of a sphere pressed in by δ over a circle of radius a, less the energy of adhesion."""
    return E * (approach**2 * a - 2 * approach * a**3 / (3 * R) + a**5 / (5 * R**2)) - math.pi * W * a**2


def jkr_least(approach):
    # the least energy beyond its maximum at a small radius: a > 0.35 of the unloaded one
    return minimize_scalar(
        lambda a: jkr_energy(a * UNLOADED, approach) / (PULL * 1e-9), bounds=(0.5, 6), options={"xatol": 1e-12}
    )


@pytest.mark.parametrize("depth", [-0.5, 0.0, 1.0, 7.0])
def test_jkr_is_the_least_energy_at_an_approach(depth):
    approach = depth * UNLOADED**2 / (3 * R)
    a = jkr_least(approach).x * UNLOADED
    # a minimum is found to about √EPS of the radius
    assert jkr_approach(a, **ELASTIC) == pytest.approx(approach, rel=1e-6, abs=1e-6 * UNLOADED**2 / R)
    step = 1e-3 * UNLOADED**2 / R
    force = (jkr_least(approach + step).fun - jkr_least(approach - step).fun) * PULL * 1e-9 / (2 * step)
    # the slope of the energy: the difference is good to (step/δ)² and to EPS over the step
    assert jkr_normal_load(a, **ELASTIC) == pytest.approx(force, rel=1e-5, abs=1e-5 * PULL)


@pytest.mark.parametrize("share", [-1.4, -1, 0, 1, 30])
def test_jkr_is_the_least_energy_under_a_load(share):
    depth = UNLOADED**2 / R

    def potential(state):
        a, approach = state[0] * UNLOADED, state[1] * depth
        return (jkr_energy(a, approach) - share * PULL * approach) / (PULL * depth)

    # near enough: a start too far out is over the barrier, and comes apart
    start = [1.5, 2.0] if share >= 0 else [0.85, 0.2]
    least = minimize(potential, start, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15})
    a = jkr_contact_radius(share * PULL, **ELASTIC)
    # a minimum is found to about √EPS times its flatness, which grows towards pull-off
    assert a == pytest.approx(least.x[0] * UNLOADED, rel=1e-6)
    assert jkr_approach(a, **ELASTIC) == pytest.approx(least.x[1] * depth, rel=1e-5)


def test_jkr_without_load_and_at_its_pull_off_points():
    assert jkr_contact_radius(0, **ELASTIC) == pytest.approx(UNLOADED, rel=8 * EPS)
    assert jkr_approach(UNLOADED, **ELASTIC) == pytest.approx(UNLOADED**2 / (3 * R), rel=16 * EPS)
    force = jkr_pull_off_load(summit_radius=R, work_of_adhesion=W)
    assert force == pytest.approx(-1.5 * PULL, rel=4 * EPS)
    held = jkr_pull_off_load(summit_radius=R, work_of_adhesion=W, control="displacement")
    assert held == pytest.approx(-5 / 6 * PULL, rel=4 * EPS)
    scale = np.cbrt(9 * math.pi * W * R**2 / (8 * E))
    assert jkr_contact_radius(force, **ELASTIC) == pytest.approx(scale, rel=16 * EPS)
    a = np.linspace(0, 2 * UNLOADED, 200_001)
    # a grid of n points misses a minimum by (1/n)² of what stands around it
    assert jkr_normal_load(a, **ELASTIC).min() == pytest.approx(force, rel=1e-9)
    at_least_approach = a[jkr_approach(a, **ELASTIC).argmin()]
    assert jkr_normal_load(at_least_approach, **ELASTIC) == pytest.approx(held, rel=1e-4)


def test_dmt_is_hertz_under_a_greater_load():
    loads = np.array([-2, -1, 0, 5]) * PULL
    a = dmt_contact_radius(loads, **ELASTIC)
    np.testing.assert_allclose(a**3, 0.75 * R * (loads + 2 * PULL) / E, rtol=16 * EPS, atol=0)
    np.testing.assert_allclose(dmt_normal_load(a, **ELASTIC), loads, atol=16 * EPS * PULL, rtol=8 * EPS)
    np.testing.assert_allclose(dmt_approach(a, summit_radius=R), a**2 / R, rtol=4 * EPS)
    assert dmt_pull_off_load(summit_radius=R, work_of_adhesion=W) == pytest.approx(-2 * PULL, rel=4 * EPS)


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


def test_branch_of_jkr_is_stable_where_its_energy_is_least():
    curve = branch("jkr", **ELASTIC, max_load=3 * PULL)
    a, approach = curve.contact_radius, curve.approach
    np.testing.assert_allclose(curve.normal_load, jkr_normal_load(a, **ELASTIC), atol=64 * EPS * PULL)
    np.testing.assert_allclose(approach, jkr_approach(a, **ELASTIC), atol=64 * EPS * UNLOADED**2 / R)
    assert a[0] == approach[0] == curve.normal_load[0] == 0
    assert curve.normal_load[-1] == pytest.approx(3 * PULL, rel=1e-13)
    # second derivatives of the energy; scaled, and the ends of stability themselves left out
    depth = approach - a**2 / R
    bend = -4 * E * a * depth / R - 2 * math.pi * W
    cross, stiff = 2 * E * depth, 2 * E * a
    definite = (stiff * bend - cross**2) / (E * W)
    clear = np.abs(bend) > 1e-9 * W
    assert clear.sum() >= a.size - 1
    assert ((bend > 0) == curve.stable_under_displacement)[clear].all()
    clear = np.abs(definite) > 1e-9 * a[-1]
    assert clear[1:].sum() >= a.size - 2
    assert ((definite > 0) == curve.stable_under_load)[clear].all()


def test_branch_of_jkr_jumps_where_theory_says():
    curve = branch(Regime.JKR, **ELASTIC, max_load=PULL, points=57)
    depth = np.cbrt(math.pi**2 * W**2 * R / (4 / 3 * E) ** 2)
    force, held, first = curve.pull_off_under_load, curve.pull_off_under_displacement, curve.jump_in
    assert force.normal_load == pytest.approx(-1.5 * PULL, rel=1e-14)
    assert force.contact_radius == pytest.approx(jkr_contact_radius(-1.5 * PULL, **ELASTIC), rel=1e-14)
    assert force.approach == pytest.approx(-((1 / 12) ** (1 / 3)) * depth, rel=1e-13)
    assert held.normal_load == pytest.approx(-5 / 6 * PULL, rel=1e-13)
    assert held.approach == pytest.approx(-((3 / 4) ** (1 / 3)) * depth, rel=1e-13)
    assert (first.approach, first.normal_load, first.contact_radius) == (0, 0, 0)
    for point, stable in ((force, curve.stable_under_load), (held, curve.stable_under_displacement)):
        assert curve.contact_radius[stable][0] == point.contact_radius
        assert stable[stable.argmax() :].all()


@pytest.mark.parametrize("model", ["dmt", "hertz"])
def test_branches_that_are_stable_throughout(model):
    curve = branch(model, **ELASTIC, max_load=5 * PULL, points=9)
    pull = 2 * PULL if model == "dmt" else 0
    np.testing.assert_allclose(
        curve.normal_load,
        hertz.normal_load(curve.approach, summit_radius=R, contact_modulus=E) - pull,
        atol=32 * EPS * PULL,
    )
    np.testing.assert_allclose(curve.contact_radius**2, R * curve.approach, rtol=32 * EPS)
    assert curve.normal_load[-1] == pytest.approx(5 * PULL, rel=1e-14)
    assert curve.normal_load.size == 9
    assert curve.stable_under_load.all()
    assert curve.stable_under_displacement.all()
    assert curve.pull_off_under_load == curve.pull_off_under_displacement
    assert curve.pull_off_under_load.normal_load == pytest.approx(-pull, rel=1e-14)
    assert curve.jump_in.normal_load == curve.jump_in.approach == 0


@pytest.mark.parametrize("parameter", [0.01, 0.5, 0.93, 0.95, 3, 100])
def test_branch_of_maugis(parameter):
    arguments = contact(parameter)
    curve = branch("maugis", **arguments, max_load=4 * PULL)
    a, touch = curve.contact_radius, curve.contact_radius > 0
    np.testing.assert_allclose(maugis_normal_load(a[touch], **arguments), curve.normal_load[touch], atol=1e-12 * PULL)
    np.testing.assert_allclose(
        maugis_approach(a[touch], **arguments), curve.approach[touch], atol=1e-12 * abs(curve.approach).max()
    )
    assert np.all(np.diff(a[touch]) > 0)
    assert curve.normal_load[-1] == pytest.approx(4 * PULL, rel=1e-13)
    assert curve.jump_in.approach == pytest.approx(-Springs(0, 1e-9, **arguments).range, rel=1e-14)
    for point, control in ((curve.pull_off_under_load, "load"), (curve.pull_off_under_displacement, "displacement")):
        assert point.normal_load == pytest.approx(maugis_pull_off_load(**arguments, control=control), rel=1e-9)
    # load and approach fall to their minimum and rise after it
    for values, stable in (
        (curve.normal_load, curve.stable_under_load),
        (curve.approach, curve.stable_under_displacement),
    ):
        assert not stable[0]
        assert np.all((np.diff(values) > 0) == stable[:-1])
    # what is stable under load is so under displacement
    assert not np.any(curve.stable_under_load & ~curve.stable_under_displacement)


@pytest.mark.parametrize("parameter", [0.05, 0.8, 2])
def test_surfaces_across_a_gap_agree_with_a_row_of_springs(parameter):
    arguments = contact(parameter)
    curve = branch("maugis", **arguments, max_load=PULL, points=12)
    apart = (curve.contact_radius == 0) & (curve.normal_load < 0)
    assert apart.sum() >= 11
    stress = Springs(0, 1e-9, **arguments).stress
    for approach, load in zip(curve.approach[apart], curve.normal_load[apart], strict=True):
        springs = Springs(0, math.sqrt(-load / (math.pi * stress)), **arguments)
        assert approach == pytest.approx(springs.approach, rel=1e-10)
        # open in the middle, or just closed
        assert -approach - 2 * stress * springs.zone / E > -1e-12 * springs.range


def test_pull_off_under_displacement_leaves_contact_at_small_parameters():
    for parameter, touching in ((0.9, False), (0.937, False), (0.939, True), (1, True)):
        point = branch("maugis", **contact(parameter), max_load=PULL).pull_off_under_displacement
        assert (point.contact_radius > 0) == touching
    held = maugis_pull_off_load(**contact(np.array([0.1, 0.93784, 0.93785])), control="displacement") / PULL
    assert held[0] == pytest.approx(-32 / (9 * math.pi) * 1e-3, rel=1e-13)
    # either side of the change, λ³ moves the load by 3e-5
    assert held[1] == pytest.approx(held[2], rel=1e-3)


@pytest.mark.parametrize("parameter", [0.2, 0.8, 3])
def test_the_work_done_along_a_branch_is_the_energy_stored(parameter):
    # along equilibria dU = N dδ, from nothing where the surfaces first attract each other
    arguments = contact(parameter)
    curve = branch("maugis", **arguments, max_load=2 * PULL, points=3000)
    work = np.concatenate(
        [[0], np.cumsum(np.diff(curve.approach) * (curve.normal_load[1:] + curve.normal_load[:-1]) / 2)]
    )
    scale = PULL * np.ptp(curve.approach)
    for index in (4000, 5000, curve.approach.size - 1):
        springs = Springs.of(curve.contact_radius[index], **arguments)
        # trapezoids of 3000 points are good to 1e-6
        assert work[index] == pytest.approx(springs.energy, abs=3e-6 * scale)


def test_hertz_where_adhesion_is_a_twentieth_of_the_load():
    for parameter in (1e-3, 0.03, 0.4, 3, 100):
        arguments = contact(parameter)
        load = hertz_boundary(parameter) * PULL
        a = maugis_contact_radius(load, **arguments)
        assert 4 * E * a**3 / (3 * R) == pytest.approx(1.05 * load, rel=1e-11)
        assert regime(parameter, load / PULL * (1 + 1e-9)) is Regime.HERTZ
        assert regime(parameter, load / PULL * (1 - 1e-9)) is not Regime.HERTZ
    # DMT: 2 = 0.05 P; JKR: A³ - √6 A^(3/2) = P and A³ = 1.05 P
    np.testing.assert_allclose(hertz_boundary([1e-12, 1e12]), [40, 2520], rtol=1e-6)
    assert np.all(np.diff(hertz_boundary(np.logspace(-3, 3, 61))) > 0)


@given(st.floats(-4, -1.01), st.floats(-1.9, 39), radii, moduli, works)
def test_rigid_where_the_compression_is_a_twentieth_of_the_separation(power, share, radius, modulus, work):
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
    assert compression / arguments["equilibrium_separation"] == pytest.approx(0.05, rel=1e-11)


@pytest.mark.parametrize(
    ("parameter", "load", "expected"),
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


@pytest.mark.parametrize(("parameter", "load"), [(0.01, -2.01), (1, -1.61), (1e3, -1.501)])
def test_no_regime_beyond_pull_off(parameter, load):
    with pytest.raises(LoadError, match=r"load_parameter of .* πWR pulls harder .* pull-off load of -\d"):
        regime(parameter, load)


@given(powers, radii, moduli, works)
def test_maugis_parameter_follows_its_definition(power, radius, modulus, work):
    assert maugis_parameter(**contact(10**power, radius, modulus, work)) == pytest.approx(10**power, rel=32 * EPS)


def test_work_of_adhesion():
    # silicon on float glass
    assert work_of_adhesion(44.1e-3, 83.4e-3) == pytest.approx(2e-3 * math.sqrt(44.1 * 83.4), rel=4 * EPS)
    assert work_of_adhesion(44.1e-3, 83.4e-3, 20e-3) == pytest.approx(107.5e-3, rel=4 * EPS)
    assert work_of_adhesion(0.05, 0.05) == pytest.approx(0.1, rel=4 * EPS)
    assert work_of_adhesion(0.05, 0.05, 0) == pytest.approx(0.1, rel=4 * EPS)
    np.testing.assert_allclose(work_of_adhesion([1, 4], 9), [6, 12], rtol=4 * EPS)
    with pytest.raises(InputError, match="which do not adhere; expected an interfacial energy less than"):
        work_of_adhesion(0.02, 0.03, 0.06)


def test_scalars_give_scalars_and_arrays_broadcast():
    arguments = contact(1.0)
    for value in (
        maugis_contact_radius(0, **arguments),
        maugis_approach(1e-8, **arguments),
        maugis_pull_off_load(**arguments),
        maugis_pull_off_load(**arguments, control="displacement"),
        maugis_pull_off_load(**contact(0.1), control="displacement"),
        jkr_contact_radius(0, **ELASTIC),
        dmt_normal_load(0, **ELASTIC),
        work_of_adhesion(1, 1),
        hertz_boundary(1),
    ):
        assert isinstance(value, float)
    assert np.all(np.diff(maugis_pull_off_load(**contact(np.logspace(-3, 3, 61)))) > 0)
    several = contact(np.array([0.1, 1, 10]))
    loads = np.array([-1, 0, 5, 80])[:, None] * PULL
    together = maugis_contact_radius(loads, **several)
    assert together.shape == (4, 3)
    one = [[maugis_contact_radius(load, **contact(parameter)) for parameter in (0.1, 1, 10)] for load in loads[:, 0]]
    np.testing.assert_allclose(together, one, rtol=16 * EPS)
    held = maugis_pull_off_load(**several, control="displacement")
    one = [maugis_pull_off_load(**contact(parameter), control="displacement") for parameter in (0.1, 1, 10)]
    np.testing.assert_allclose(held, one, rtol=16 * EPS)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: jkr_contact_radius(0, **{**ELASTIC, "summit_radius": 0}), "summit_radius is 0; expected .* greater"),
        (lambda: jkr_approach(-1, **ELASTIC), "contact_radius is -1; expected a finite number of 0 or more"),
        (lambda: maugis_pull_off_load(**contact(1), control="x"), "control is 'x'; expected 'load' or 'displacement'"),
        (lambda: hertz_boundary([1, 1e-13]), "Maugis parameter is 1e-13; expected one between 1e-12 and 1e.12"),
        (lambda: branch("jrk", **ELASTIC, max_load=1), "model is 'jrk'; expected one of dmt, hertz, jkr, maugis"),
        (lambda: branch("jkr", **ELASTIC, max_load=1, points=1), "points is 1; expected an integer of 2 or more"),
        (lambda: branch("maugis", **ELASTIC, max_load=1), "equilibrium_separation is missing; expected z0"),
    ],
)
def test_arguments_out_of_range(call, message):
    with pytest.raises(InputError, match=message):
        call()


@pytest.mark.parametrize(("radius", "share"), [(jkr_contact_radius, -1.501), (dmt_contact_radius, -2.001)])
def test_loads_beyond_pull_off(radius, share):
    with pytest.raises(LoadError, match=r"normal_load of -\S+ N pulls harder .* pull-off load of -\S+ N"):
        radius([0, share * PULL], **ELASTIC)
    # rounding of the pull-off load itself is forgiven
    assert np.isfinite(radius(round(share, 1) * PULL * (1 + 4 * EPS), **ELASTIC))
