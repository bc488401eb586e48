"""Friction loops that were written to a file, in a few lines."""

import numpy as np

import historysim as hs
from historysim.results import loop_summary

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)


def test_the_lines_are_the_means_of_the_loops():
    swings = [hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 9)]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-3, 0.2), [hs.NormalLoad(0.0, 0.1), *swings], substeps=100)
    found = hs.loops(history)
    lines = dict(loop_summary.summary(found.to_dataset()))
    assert lines["loops"] == "3"
    for row in found.rows()[1:]:
        if row[0] in lines and row[0] != "loops":
            assert lines[row[0]] == row[3]
    assert lines["friction coefficient"] == "0.2 ± 0"
    assert lines["content"] == "friction loops"


def test_a_quantity_that_no_loop_has_is_a_dash():
    dataset = hs.loops(
        hs.replay(
            hs.Ensemble(PAIR, 0.0, 1e-3, 0.2),
            [hs.NormalLoad(0.0, 0.1), *(hs.TangentialDisplacement(float(t), (-1) ** t * 1e-7) for t in range(1, 5))],
            substeps=100,
        )
    ).to_dataset()
    dataset["tangential_stiffness"][:] = np.nan
    assert dict(loop_summary.summary(dataset))["stiffness at reversal"] == "–"


def test_small_loops_do_not_count_in_means():
    """As in the loops themselves."""
    amplitudes = [1e-7, 1e-7, 1e-7, 1e-7, 1e-8, 1e-8, 1e-8, 1e-8]
    swings = [hs.TangentialDisplacement(1.0 + i, (-1) ** i * u) for i, u in enumerate(amplitudes)]
    found = hs.loops(
        hs.replay(hs.Ensemble(PAIR, 0.0, 1e-3, 0.2), [hs.NormalLoad(0.0, 0.1), *swings], substeps=100), dead_band=1e-9
    )
    lines = dict(loop_summary.summary(found.to_dataset()))
    assert lines["loops"] == f"{len(found)}, of which {found.large.sum()} are large enough for the means below"
    assert lines["friction force"] == found.text("friction_force", "N")
    assert lines["energy per loop"] == found.text("dissipated_energy", "J")
