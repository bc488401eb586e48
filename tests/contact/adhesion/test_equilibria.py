import math

import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, UNLOADED, E, R, Springs, W, contact

from historysim.contact import hertz
from historysim.contact.adhesion import (
    Regime,
    branch,
    jkr_approach,
    jkr_contact_radius,
    jkr_normal_load,
    maugis_approach,
    maugis_normal_load,
    maugis_pull_off_load,
)


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


def test_a_branch_cannot_be_written_to():
    curve = branch("dmt", **ELASTIC, max_load=PULL)
    with pytest.raises(ValueError, match="read-only"):
        curve.approach[0] = 1
    with pytest.raises(AttributeError):
        curve.model = Regime.JKR
