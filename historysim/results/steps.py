"""Steps of a history by number or by the name that its scenario gives to a state."""

import json
import re

import numpy as np

from historysim.basics.arguments import NAMED_STATES
from historysim.basics.wording import join_words
from historysim.errors import InputError
from historysim.results.history_view import History

NUMBER = re.compile(r"-?\d+")


def named_states(history: History) -> dict[str, int]:
    """Return the step of each named state of a history, in the order of the scenario: the last one at its time."""
    steps = {name: find_step(history, time) for name, time in _named_times(history).items()}
    return {name: step for name, step in steps.items() if step is not None}


def _named_times(history: History) -> dict[str, float]:
    """Return the time of each named state of the scenario [s], also of states that a part of a history leaves out."""
    times: dict[str, float] = json.loads(str(history.attrs.get(NAMED_STATES, "{}")))
    return times


def find_step(history: History, time: float) -> int | None:
    """Return the last step recorded at a time [s]; None if there is none."""
    near = np.flatnonzero(
        np.isclose(np.asarray(history["time"].values), time, rtol=1e-9, atol=1e-12)
    )
    return int(near[-1]) if near.size else None


def resolve_step(step: object, history: History) -> int:
    """Return a step of a history as a number from 0.

    The step is a number, where negative ones count from the end, also as a string, or the name of a
    state. InputError for another one.
    """
    if isinstance(step, str) and not NUMBER.fullmatch(step):
        states = named_states(history)
        if step in states:
            return states[step]
        times = _named_times(history)
        if step in times:
            raise InputError(
                f"step {step!r}: the history has no step at its time, {times[step]:g} s"
            )
        expected = (
            f"{join_words(states)}, or a number"
            if states
            else "a number, since no waypoint has a name"
        )
        raise InputError(f"step {step!r} is not a named state of the history; expected {expected}")
    steps = len(history["time"].values)
    is_number = isinstance(step, int | np.integer | str) and not isinstance(step, bool)
    if not is_number or not -steps <= int(step) < steps:  # type: ignore[call-overload] # it is a number
        raise InputError(
            f"step {step}: the history has {steps} steps; expected {-steps} to {steps - 1}"
        )
    return int(step) % steps  # type: ignore[call-overload,no-any-return] # as above


def state_label(history: History, step: int) -> str:
    """Return the label of a step: its name, or else its number and time."""
    for name, position in named_states(history).items():
        if position == step:
            return name
    return f"step {step}, {float(history['time'].values[step]):.4g} s"
