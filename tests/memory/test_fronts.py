"""Fronts that are noted during a search give the loads that walks along the polylines give."""

import numpy as np
import pytest

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


def replay(ensemble, approaches, kind, targets, stiffness=np.inf):
    events = []
    for time, (approach, target) in enumerate(zip(approaches, targets, strict=True)):
        events += [hs.NormalDisplacement(time, approach), kind(time, target)]
    return hs.replay(ensemble, events, record="totals", instrument=hs.Instrument(stiffness))


@pytest.mark.parametrize("stiffness", [np.inf, 1.0])
@pytest.mark.parametrize("shared", [0.0, 0.3])
def test_a_displacement_that_was_searched_leads_to_the_load(shared, stiffness):
    """A path to a displacement asks for no search, and so for no fronts."""
    rng = np.random.default_rng(7)
    height = rng.uniform(-0.5, 0.0, 40)
    friction = np.where(rng.random(40) < shared, 0.3, rng.uniform(0.1, 0.5, 40))
    ensemble = hs.Ensemble(PAIR, height - height.max(), rng.uniform(0.5, 2.0, 40), friction)
    # one asperity alone, some of them, all; approached and withdrawn, held, and to where fronts have been
    approaches = rng.choice([0.01, 0.3, 0.8, 0.8, 0.8, 1.0], 100)
    parts = rng.choice([-0.5, -0.2, 0.0, 0.3, 0.6, 1.0 - 1e-12], 100) + 1e-3 * rng.integers(-1, 1, 100)
    limits = replay(ensemble, approaches, hs.TangentialDisplacement, np.zeros(100)).friction_limit
    searched = replay(ensemble, approaches, hs.TangentialLoad, parts * limits.values)
    if np.isfinite(stiffness):
        drive = searched.tangential_displacement + searched.total_tangential_load / stiffness
        searched = replay(ensemble, approaches, hs.TangentialDisplacement, drive.values, stiffness)
    told = replay(ensemble, approaches, hs.TangentialDisplacement, searched.tangential_displacement.values)
    error = told.total_tangential_load - searched.total_tangential_load
    assert np.abs(error).max() < 1e-13 * limits.max()
    lost = told.total_dissipated_energy - searched.total_dissipated_energy
    assert np.abs(lost).max() < 1e-13 * searched.total_dissipated_energy[-1]
