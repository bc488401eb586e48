"""The oracle itself, against closed forms and its own error bounds."""

import copy

import numpy as np
import pytest
from histories import random_contact
from springs import Contact, SpringRow

UNIT = Contact.build(contact_modulus=1.0, shear_modulus=0.25, summit_height=0.0, summit_radius=1.0, friction=0.5)
LOAD = 0.01
LARGEST_SLIP = UNIT.compliance_ratio * 0.5 * UNIT.approach(LOAD)


def loaded(springs, normal_load=LOAD, contact=UNIT, largest_load=0.02):
    row = SpringRow(contact, contact.approach(largest_load), springs)
    row.apply(("load", normal_load), ("load", 0.0), substeps=1)
    return row


def virgin_displacement(fraction):
    """Cattaneo–Mindlin, in units of the preliminary displacement."""
    return 1 - (1 - fraction) ** (2 / 3)


def virgin_errors(springs):
    """Errors of T and c (given U) and of U (given T) over virgin loading, relative to μN, a and δ_t,max."""
    errors = []
    for fraction in np.linspace(0.02, 0.97, 60):
        moved, pulled = loaded(springs), loaded(springs)
        moved.apply(("load", LOAD), ("displacement", virgin_displacement(fraction) * LARGEST_SLIP), substeps=3)
        pulled.apply(("load", LOAD), ("load", fraction * 0.5 * LOAD), substeps=3)
        errors.append(
            (
                moved.total_tangential_load / (0.5 * LOAD) - fraction,
                pulled.tangential_displacement / LARGEST_SLIP - virgin_displacement(fraction),
                moved.stick_radius[0] / moved.contact_radius[0] - (1 - fraction) ** (1 / 3),
            )
        )
    return np.abs(errors).max(axis=0)


def test_virgin_loading_converges_to_cattaneo_mindlin_with_second_order():
    springs = np.array([100, 200, 400, 800, 1600])
    errors = np.array([virgin_errors(count) for count in springs])
    orders = -np.polyfit(np.log(springs), np.log(errors[:, :2]), 1)[0]
    assert orders == pytest.approx([2.0, 2.0], abs=0.25)
    assert np.all(errors[:, :2] * springs[:, np.newaxis] ** 2 < [1.0, 1.5])
    assert np.all(errors[:, 2] < 1e-9)


def test_energy_of_a_falling_normal_load_needs_the_path_while_the_state_does_not():
    rows = {substeps: loaded(2000, 0.02) for substeps in (1, 10, 20, 40, 640)}
    for substeps, row in rows.items():
        row.apply(("load", 0.02), ("load", 0.004), substeps=1)
        row.apply(("load", 0.012), ("load", 0.004), substeps)
        assert row.tangential_displacement == pytest.approx(rows[1].tangential_displacement, rel=1e-11)
    exact = rows[640].dissipated_energy[0]
    errors = {substeps: row.dissipated_energy[0] / exact - 1 for substeps, row in rows.items()}
    assert errors[1] > 1e-3
    assert errors[10] / errors[20] == pytest.approx(4.0, rel=0.1)
    assert errors[20] / errors[40] == pytest.approx(4.0, rel=0.1)


def test_the_work_of_the_tangential_load_is_stored_or_dissipated():
    rng = np.random.default_rng(2)
    contact = random_contact(rng, 4, several_coefficients=True)
    row = SpringRow(contact, 0.03, 300)
    work = 0.0
    for _ in range(6):
        approach, displacement = rng.uniform(-0.003, 0.03), rng.uniform(-0.012, 0.012)
        path = np.linspace((row.approach, row.tangential_displacement), (approach, displacement), 801)
        loads = [row.total_tangential_load]
        for here in path[1:]:
            row.apply(("displacement", here[0]), ("displacement", here[1]), substeps=1)
            loads.append(row.total_tangential_load)
        work += np.trapezoid(loads, path[:, 1])
    assert row.elastic_energy.sum() + row.dissipated_energy.sum() == pytest.approx(work, rel=1e-5)


def test_a_straight_path_ends_at_the_requested_tangential_load():
    rng = np.random.default_rng(3)
    contact = random_contact(rng, 6, several_coefficients=True)
    row = SpringRow(contact, 0.03, 200)
    for approach, share in zip(rng.uniform(0.003, 0.03, 10), rng.uniform(-0.95, 0.95, 10), strict=True):
        before = copy.deepcopy(row)
        target = share * contact.limit(approach)
        row.apply(("displacement", approach), ("load", target), substeps=50)
        assert row.total_tangential_load == pytest.approx(target, abs=1e-11 * contact.limit(0.03))
        before.apply(("displacement", approach), ("displacement", row.tangential_displacement), substeps=1)
        assert before.tangential_load == pytest.approx(row.tangential_load, abs=1e-11 * contact.limit(0.03))
