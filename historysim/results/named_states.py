"""The names that a scenario gives to states of its history: which step each is, and what a step is called."""

import json

import numpy as np

from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.recording.provenance import NAMED_STATES
from historysim.results.analysis.recorded import Recorded


def named_states(history: Recorded) -> dict[str, int]:
    """Return the step of each named state of a history, in the order of the scenario: the last one at its time."""
    times = json.loads(str(history.attrs.get(NAMED_STATES, "{}")))
    rows = np.asarray(history["time"].values)
    steps = {}
    for name, time in times.items():
        near = np.flatnonzero(np.isclose(rows, time, rtol=1e-9, atol=1e-12))
        if near.size:
            steps[name] = int(near[-1])
    return steps


def step_of(history: Recorded, state: int | str) -> int:
    """Return the step of a state by its name, or by its number, negative ones counted from the end.

    Raises InputError: a name that the history does not have, or a step beyond its ends.
    """
    if isinstance(state, str) and not state.removeprefix("-").isdecimal():
        known = named_states(history)
        if state not in known:
            hint = nearest(state, known) if known else "expected the number of a step, since no waypoint has a name"
            raise InputError(f"steps: {state!r} is no state of the history; {hint}")
        return known[state]
    steps, step = len(history["time"].values), int(state)
    if not -steps <= step < steps:
        raise InputError(f"step {step}: the history has {steps} steps; expected {-steps} to {steps - 1}")
    return step % steps


def state_label(history: Recorded, step: int) -> str:
    """Return what a step is called: its name, or else its number and time."""
    for name, place in named_states(history).items():
        if place == step:
            return name
    return f"step {step}, {float(history['time'].values[step]):.4g} s"
