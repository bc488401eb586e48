"""How friction loops change from one to the next: what stands in their picture. That it looks well was seen by eye."""

import numpy as np
import pytest

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)


@pytest.fixture(scope="module")
def found():
    swings = [hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 9)]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-3, 0.2), [hs.NormalLoad(0.0, 0.1), *swings], substeps=100)
    return hs.loops(history)


def test_each_loop_is_a_mark_for_each_direction_and_one_for_its_energy(found):
    figure = hs.plots.loop_trends(found.to_dataset())
    force, *_, energy = figure.axes
    assert force.get_title(loc="left") == "friction force (mN)"
    forward, backward, mean = force.get_lines()
    np.testing.assert_allclose(forward.get_ydata(), 1e3 * found.friction_force[:, 0])
    np.testing.assert_allclose(backward.get_ydata(), 1e3 * found.friction_force[:, 1])
    assert mean.get_ydata()[0] == pytest.approx(1e3 * found.statistics("friction_force").mean)
    marks, _ = energy.get_lines()
    np.testing.assert_allclose(marks.get_ydata(), 1e9 * found.dissipated_energy)
    assert figure.get_suptitle() == "3 friction loops"
    assert hs.plots.loop_trends(found.to_dataset(), title="of $5").get_suptitle() == r"of \$5"
