"""What a model leaves of a record, and where: faults of one kind each are put into one place."""

import itertools

import attrs
import numpy as np
import pytest
import synthetic

import historysim as hs
from historysim.measured.comparison import Comparison, observe, passed, residuals_of

RECORD = synthetic.measured("ball", 0, loads=(0.05,), loops=8, rate=20)
ENSEMBLE, INSTRUMENT = synthetic.model("ball")(synthetic.TRUTHS["ball"])


def left_of(load, friction=0.2):
    record = attrs.evolve(RECORD, response={"tangential_load": load})
    observation = observe(record)
    ball, drive = synthetic.model("ball")({**synthetic.TRUTHS["ball"], "friction": friction})
    return residuals_of(observation, passed(ball, drive, observation))


def test_shares_add_up():
    left = left_of(RECORD["tangential_load"] + np.random.default_rng(0).normal(0, 1e-3, RECORD.time.size))
    assert left.at_reversals + left.along_sliding + left.between_branches < 0.2
    assert "of its square 98 % noise" in left.text()
    assert left.mean.shape == left.place.shape == (2, 40)


def test_a_wrong_coefficient_is_left_along_sliding():
    left = left_of(RECORD["tangential_load"], friction=0.18)
    assert left.along_sliding > 0.5
    assert left.rms == pytest.approx(1e-3, rel=0.3)
    # measured less model, over both directions
    assert np.nanmean(left.mean[0, -10:]) == pytest.approx(1e-3, rel=0.05)
    assert np.nanmean(left.mean[1, -10:]) == pytest.approx(-1e-3, rel=0.05)


def test_friction_that_differs_is_left_from_branch_to_branch():
    load = RECORD["tangential_load"].copy()
    turns = observe(RECORD).turns
    for number, (start, end) in enumerate(itertools.pairwise(turns)):
        load[start:end] *= 1 + 0.1 * (-1) ** (number // 2)
    left = left_of(load)
    assert left.between_branches > 0.3
    assert left.between_branches > max(left.along_sliding, left.at_reversals)


def test_a_compliance_in_series_is_told_with_its_stiffness():
    observation = observe(RECORD)
    state = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=0.05)
    stiff = state.tangential_stiffness
    rigid = Comparison.of(observation, passed(ENSEMBLE, hs.Instrument(), observation), hs.Instrument(), stiff)
    (note,) = rigid.notes
    assert "looks like a compliance in series of 3" in note
    assert 'with [instrument] lateral_stiffness = "3' in note
    found = float(note.partition("in series of ")[2].partition(" kN/m")[0]) * 1e3
    assert found == pytest.approx(synthetic.STIFFNESS, rel=0.15)
    true = Comparison.of(observation, passed(ENSEMBLE, INSTRUMENT, observation), INSTRUMENT, stiff)
    assert true.notes == ()
