"""A stage under a sampled controller; `tests/asperities/test_stepper.py` has its energy, and its bits in C."""

import numpy as np
import pytest

import historysim as hs
from historysim.coupling import controlled_stage

PAIR = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=8e9)
ENSEMBLE = hs.Ensemble(PAIR, [0.0, -20e-9, -40e-9], [10e-6, 20e-6, 15e-6], 0.2)
PRESSED = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=5e-3)
TIMING = {"mass": 0.01, "sample_time": 1e-4, "duration": 0.02}


def test_without_a_force_it_rests_and_far_below_the_limit_it_swings_as_its_stiffness_says():
    still = controlled_stage(ENSEMBLE, PRESSED, lambda _time, _place: 0.0, **TIMING)
    assert np.abs(still.place).max() == 0.0
    small = 1e-4 * 0.2 * 5e-3
    swung = controlled_stage(ENSEMBLE, PRESSED, lambda _time, _place: small, **TIMING, substeps=40)
    frequency = np.sqrt(PRESSED.stiffness(1) / 0.01)
    expected = small / PRESSED.stiffness(1) * (1 - np.cos(frequency * (swung.time + 1e-4)))
    # to first order in the share of the limit
    assert np.abs(swung.place - expected).max() < 1e-2 * expected.max()
    assert swung.work == pytest.approx(swung.kinetic + swung.stored + swung.dissipated, rel=1e-2)


def test_the_controller_is_asked_once_for_each_sample_with_where_the_stage_is():
    asked = []
    found = controlled_stage(ENSEMBLE, PRESSED, lambda time, place: asked.append((time, place)) or 1e-5, **TIMING)
    assert [time for time, _ in asked] == found.time.tolist()
    assert [place for _, place in asked] == [0.0, *found.place[:-1].tolist()]
    assert found.state.tangential_load == found.contact_force[-1]


def test_nonsense_is_refused():
    for wrong, message in (
        ({"mass": 0.0}, "mass is 0"),
        ({"substeps": 0}, "substeps is 0; expected a whole number of 1 or more"),
        ({"mass": 1e-9}, "are unstable for this mass on the contact; expected"),
    ):
        with pytest.raises(hs.InputError, match=message):
            controlled_stage(ENSEMBLE, PRESSED, lambda _time, _place: 0.0, **TIMING | wrong)
    with pytest.raises(hs.InputError, match="the force of the controller is nan"):
        controlled_stage(ENSEMBLE, PRESSED, lambda _time, _place: float("nan"), **TIMING)
