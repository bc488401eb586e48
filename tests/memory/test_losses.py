"""What is lost piece by piece and worked out together is what each asperity loses on its own."""

import numpy as np
import pytest

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


def dissipated(height, radius, friction, approaches, displacements):
    """Energies (step, asperity) and their totals; approaches count from the level 0 of the heights."""
    ensemble = hs.Ensemble(PAIR, height, radius, friction)
    events = []
    for time, (approach, displacement) in enumerate(zip(approaches, displacements, strict=True)):
        events += [hs.NormalDisplacement(time, approach + height.max()), hs.TangentialDisplacement(time, displacement)]
    history = hs.replay(ensemble, events, record="all")
    return history.dissipated_energy.values, history.total_dissipated_energy.values


@pytest.mark.parametrize("count", [2, 300])
def test_each_asperity_loses_what_it_loses_alone(count):
    """Groups of one, which put off their losses, against contacts of one asperity, which have no group beside them."""
    rng = np.random.default_rng(3)
    height, radius = rng.uniform(-0.5, 0.0, count), rng.uniform(0.5, 2.0, count)
    friction = rng.uniform(0.1, 0.5, count)
    # a spiral, of which one long way wipes out everything; approached, withdrawn, lifted off, both at once, and held
    spiral = 0.3 * 0.9 ** np.arange(30) * (-1.0) ** np.arange(30)
    displacements = np.concatenate([[0.0], spiral, [0.5], rng.uniform(-0.3, 0.3, 20)])
    approaches = np.concatenate([np.full(32, 0.4), rng.choice([-0.05, 0.1, 0.3, 0.3, 0.6], 20)])
    energies, totals = dissipated(height, radius, friction, approaches, displacements)
    for i in {0, 1, count // 2, count - 1}:
        alone, _ = dissipated(height[[i]], radius[[i]], friction[[i]], approaches, displacements)
        np.testing.assert_allclose(energies[:, i], alone[:, 0], rtol=1e-12, atol=1e-14 * alone.max())
    np.testing.assert_allclose(totals, energies.sum(axis=1), rtol=1e-12)
    assert (np.diff(totals) >= 0.0).all()
