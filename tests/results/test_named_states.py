"""Names of states: the step of each, and the label of a step."""

import numpy as np
import pytest
import xarray as xr
from golden import refused
from pairs import COMPLIANT

import historysim as hs
from historysim.recording.provenance import named_states_attribute
from historysim.results.steps import named_states, resolve_step, state_label


def history(**times):
    return xr.Dataset({"time": ("step", [0.0, 1.0, 1.0, 2.0])}, attrs=named_states_attribute(times))


def test_the_last_step_at_a_time_is_the_state():
    found = history(O=0.0, K=1.0, never=5.0)
    assert named_states(found) == {"O": 0, "K": 2}
    assert [resolve_step(state, found) for state in ("K", "0", 3, -1, "-2")] == [2, 0, 3, 3, 2]
    assert [state_label(found, step) for step in (2, 3)] == ["K", "step 3, 2 s"]
    assert named_states_attribute({}) == named_states(history()) == {}


ENSEMBLE = hs.Ensemble(COMPLIANT, [0.0, -1e-8], 1e-5, 0.2)
EVENTS = [
    hs.NormalLoad(0.0, 1e-3),
    hs.TangentialDisplacement(1.0, 3e-9),
    hs.TangentialDisplacement(2.0, -1e-9),
    hs.TangentialLoad(3.0, 0.0),
]
UNKNOWN = "step 'hold' is not a named state of the history; expected pressed, held, back"
NAMES = {"pressed": 0.0, "held": 1.0, "back": 2.0}
HISTORY = hs.replay(ENSEMBLE, EVENTS, substeps=3).assign_attrs(named_states_attribute(NAMES))
QUERIES = {
    "asperity": lambda contact, step: repr(contact.asperity(1, step)),
    "reversal_points": lambda contact, step: contact.reversal_points(1, step).displacement.values,
    "profiles": lambda contact, step: contact.profiles(1, step).traction.values,
    "profiles of several": lambda contact, step: contact.profiles(1, [step, 0]).traction.values,
    "drift": lambda contact, step: contact.drift(0, step),
    "branch_drift": lambda contact, step: contact.branch_drift(step, 0),
    "run_drift": lambda contact, step: contact.run_drift(HISTORY, step),
}


@pytest.mark.parametrize("query", QUERIES)
def test_a_name_is_a_step_in_every_query(query):
    for name, step in named_states(HISTORY).items():
        np.testing.assert_array_equal(
            QUERIES[query](HISTORY.contact, name), QUERIES[query](HISTORY.contact, step)
        )
    with refused(UNKNOWN):
        QUERIES[query](HISTORY.contact, "hold")


def test_a_name_is_a_step_in_pictures():
    hs.plot(HISTORY, picture="traction", steps=["held"])
    with refused(UNKNOWN):
        hs.plot(HISTORY, picture="traction", steps=["hold"])
