"""The names of states: which step each is, and what a step is called."""

import pytest
import xarray as xr

from historysim.errors import InputError
from historysim.recording.provenance import named_states_attribute
from historysim.results.origin import named_states, state_label, step_of


def history(**times):
    return xr.Dataset({"time": ("step", [0.0, 1.0, 1.0, 2.0])}, attrs=named_states_attribute(times))


def test_the_last_step_at_a_time_is_the_state():
    found = history(O=0.0, K=1.0, never=5.0)
    assert named_states(found) == {"O": 0, "K": 2}
    assert [step_of(found, state) for state in ("K", "0", 3, -1, "-2")] == [2, 0, 3, 3, 2]
    assert [state_label(found, step) for step in (2, 3)] == ["K", "step 3, 2 s"]
    assert named_states_attribute({}) == named_states(history()) == {}


@pytest.mark.parametrize(
    ("state", "message"),
    [("L", "'L' is no state of the history; .*K"), (4, "step 4: the history has 4 steps"), ("-5", "step -5")],
)
def test_what_is_no_state_is_told(state, message):
    with pytest.raises(InputError, match=message):
        step_of(history(K=1.0), state)
    with pytest.raises(InputError, match="no waypoint has a name"):
        step_of(history(), "K")
