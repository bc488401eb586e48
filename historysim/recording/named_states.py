"""Names of states: waypoints that a scenario calls by a name, as a result tells them, and the steps that they are."""

import json
from collections.abc import Mapping
from typing import Any, Protocol

from historysim.basics.wording import nearest
from historysim.errors import InputError

ATTRIBUTE = "named_states"
"""The attribute of a result: a JSON object with the time [s] of each name."""


class Timed(Protocol):
    """As much of a history as is needed: attributes, sizes and the variable ``time``."""

    @property
    def attrs(self) -> Mapping[Any, Any]:
        """Attributes."""

    def __getitem__(self, name: str, /) -> Any:  # noqa: ANN401 - a variable of xarray, which commands import late
        """Return a variable."""


def written(times: Mapping[str, float]) -> dict[str, str]:
    """Return the attribute that tells names and times, nothing where there are none."""
    return {ATTRIBUTE: json.dumps(dict(times), ensure_ascii=False)} if times else {}


def named_states(history: Timed) -> dict[str, int]:
    """Return the step of each named state of a history, in the order of the scenario: the last one at its time."""
    import numpy as np

    times = json.loads(str(history.attrs.get(ATTRIBUTE, "{}")))
    rows = np.asarray(history["time"].values)
    steps = {}
    for name, time in times.items():
        near = np.flatnonzero(np.isclose(rows, time, rtol=1e-9, atol=1e-12))
        if near.size:
            steps[name] = int(near[-1])
    return steps


def step_of(history: Timed, state: int | str) -> int:
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


def state_label(history: Timed, step: int) -> str:
    """Return what a step is called: its name, or else its number and time."""
    for name, place in named_states(history).items():
        if place == step:
            return name
    return f"step {step}, {float(history['time'].values[step]):.4g} s"
