"""The oracle itself, against closed forms and its own error bounds."""

import numpy as np
import pytest
from springs import Contact, SpringRow

UNIT = Contact.build(
    contact_modulus=1.0, shear_modulus=0.25, summit_height=0.0, summit_radius=1.0, friction=0.5
)
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
        moved.apply(
            ("load", LOAD),
            ("displacement", virgin_displacement(fraction) * LARGEST_SLIP),
            substeps=3,
        )
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
