"""What a misfit looks like: each fault is put into a record, below what its loops show, and found with its size."""

from itertools import pairwise

import attrs
import numpy as np
import synthetic
from pytest import approx, mark

from historysim.measured.comparison import Comparison
from historysim.measured.observation import observe
from historysim.measured.residuals import compute_residuals
from historysim.measured.response import compute_response

SOUND = attrs.evolve(synthetic.measured("ball", 0, loads=(0.05,), loops=6, rate=20), dead_band={})
LOAD, MOVED = SOUND["tangential_load"], SOUND["tangential_displacement"]


def notes(load=LOAD, moved=MOVED, record=SOUND, **others):
    changed = attrs.evolve(
        record,
        channels={**record.channels, "tangential_displacement": moved},
        response={"tangential_load": load},
    )
    observation = observe(changed)
    model = synthetic.model("ball")({**synthetic.TRUTHS["ball"], **others})
    return Comparison(observation, compute_response(*model, observation)).notes


@mark.parametrize("others", [{"friction": 0.26}, {"lateral_stiffness": 5e5}])
def test_another_parameter_is_not_a_fault(others):
    assert notes(**others) == ()


# -- where it is left ------------------------------------------------------------------------------

RECORD = synthetic.measured("ball", 0, loads=(0.05,), loops=8, rate=20)


def left_of(load, friction=0.2):
    record = attrs.evolve(RECORD, response={"tangential_load": load})
    observation = observe(record)
    ball, drive = synthetic.model("ball")({**synthetic.TRUTHS["ball"], "friction": friction})
    return compute_residuals(observation, compute_response(ball, drive, observation))


def test_a_wrong_coefficient_is_left_along_sliding():
    left = left_of(RECORD["tangential_load"], friction=0.18)
    assert left.along_sliding > 0.5
    assert left.rms == approx(1e-3, rel=0.3)
    # measured less model, over both directions
    assert np.nanmean(left.mean[0, -10:]) == approx(1e-3, rel=0.05)
    assert np.nanmean(left.mean[1, -10:]) == approx(-1e-3, rel=0.05)


def test_friction_that_differs_is_left_from_branch_to_branch():
    load = RECORD["tangential_load"].copy()
    turns = observe(RECORD).turns
    for number, (start, end) in enumerate(pairwise(turns)):
        load[start:end] *= 1 + 0.1 * (-1) ** (number // 2)
    left = left_of(load)
    assert left.between_branches > 0.3
    assert left.between_branches > max(left.along_sliding, left.at_reversals)
