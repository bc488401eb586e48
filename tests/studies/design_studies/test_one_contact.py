"""One contact by Hertz and Mindlin, and against the scenario that says the same."""

from pathlib import Path

import numpy as np
import pytest
from hertz_sums import HARD, displacement

import historysim as hs

SCENARIOS = Path(__file__).parents[3] / "scenarios"
PAIR = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))


def test_change_of_radius_load_and_friction():
    """Theory 11: from 50 mN to 70 mN the branch drifts by 78.0 nm, to 30 mN by 179.0 nm (R = 0.5 µm, μ = 0.5)."""
    radius = {"from": "0.5 µm", "to": "50 µm", "count": 3, "spacing": "logarithmic"}
    later = ["30 mN", "50 mN", "70 mN"]
    found = hs.design_studies.radius_load_friction(
        PAIR, radius=radius, normal_load="50 mN", friction=[0.1, 0.2, 0.5], later_load=later
    )
    R, mu, N = np.meshgrid([0.5e-6, 5e-6, 50e-6], [0.1, 0.2, 0.5], [30e-3, 50e-3, 70e-3], indexing="ij")

    def one(load):
        return displacement(1.0, 0.0, 1.0, 1.0, HARD) * mu * load ** (2 / 3) * R ** (-1 / 3)

    np.testing.assert_allclose(found.preliminary_displacement, np.maximum(one(N), one(50e-3)), rtol=1e-9)
    np.testing.assert_allclose(found.drift, abs(one(N) - one(50e-3)), rtol=1e-8, atol=1e-18)
    sharp = found.branch_drift.isel(surface_radius=0, friction_coefficient=2)
    assert 1e9 * sharp.values == pytest.approx([179.0, 0, 78.0], abs=0.2)
    scenario = hs.sweep(SCENARIOS / "20_radius_load_friction.toml")
    for name in ("preliminary_displacement", "drift", "branch_drift"):
        # the scenario moves to and fro between the loads, which moves the last digits of displacements
        np.testing.assert_allclose(found[name], scenario[name], rtol=1e-12, atol=1e-20)


def test_without_a_later_load_nothing_drifts():
    pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25, hardness=2.0, yield_stress=1.0)
    found = hs.design_studies.radius_load_friction(pair, radius=1.0, normal_load=[0.01, 0.02], friction=0.5)
    assert list(found.data_vars) == ["preliminary_displacement"]
    expected = 0.5 * (9 / 16 * np.array([0.01, 0.02]) ** 2) ** (1 / 3)
    np.testing.assert_allclose(found.preliminary_displacement, expected, rtol=1e-12)
    assert "yield_stress = 1.0" in found.attrs["scenario"]
