"""The shortest history of a state: events that lead an untouched contact into it."""

import numpy as np

from historysim.asperities.state import State, friction_at_start
from historysim.basics.arguments import Array
from historysim.errors import InputError
from historysim.loads.events import (
    Event,
    FrictionChange,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)
from historysim.memory.binding import LOAD

TWO_DIRECTIONS = (
    "the contact has moved in two tangential directions, where it remembers a field of tractions and no finite list of "
    "loads; expected motion along one line"
)
EVOLVES = (
    "friction or geometry change with the load history, and the memory does not hold how they came to be; expected "
    "constant coefficients, without wear and yielding"
)


def shortest_history(state: State) -> list[Event]:
    """Return events that lead an untouched contact into a state; see `State.shortest_history`."""
    memory = state.memory
    line = memory.line
    if memory.plane:
        raise InputError(f"shortest history: {TWO_DIRECTIONS}")
    if line.evolved:
        raise InputError(f"shortest history: {EVOLVES}")
    if line.contact.groups > 1:
        raise InputError(
            f"the asperities have {line.contact.groups:,} different friction coefficients, so that no common path "
            "leads to what each remembers; expected one coefficient, or hs.shortest, which selects waypoints"
        )
    friction = float(line.friction[0])
    vertices: Array = state.vertices() if line.depth[0] else np.empty(0)
    if vertices.size and (abs(vertices["slope"]) > friction).any():
        raise InputError(
            "friction has fallen, and springs are strained beyond what it holds while they touch; expected a state "
            "with constant friction, or one that has slid since"
        )
    events = _friction_event(state, friction)
    if not vertices.size:
        return events + _gap_events(state)

    units = line.contact.units
    label, anchor = vertices["label"] * units.length, vertices["anchor"] * units.displacement
    start = float(anchor[0])
    if start != 0.0:
        events.append(TangentialDisplacement(0.0, start))
    for index in range(1, vertices.size - 1):
        time = float(index)
        events += [
            NormalDisplacement(time, float(label[index])),
            TangentialDisplacement(time, float(anchor[index])),
        ]
    return events + _last_waypoints(state, vertices, float(vertices.size - 1))


def _gap_events(state: State) -> list[Event]:
    """Return the events that lead to a gap."""
    events: list[Event] = []
    if state.approach != 0.0:
        events.append(NormalDisplacement(0.0, state.approach))
    if state.tangential_displacement != 0.0:
        events.append(TangentialDisplacement(0.0, state.tangential_displacement))
    return events


def _friction_event(state: State, friction: float) -> list[Event]:
    """Return the change of friction before the first touch, if there was one."""
    is_unchanged = friction_at_start(state) in {None, friction}
    return [] if is_unchanged else [FrictionChange(0.0, friction)]


def _last_waypoints(state: State, vertices: Array, time: float) -> list[Event]:
    """Return the waypoints of the edge, which leave each channel under its last control."""
    line = state.memory.line
    normal: list[Event] = [NormalDisplacement(time, state.approach)]
    if line.normal_control == LOAD:
        # with attraction several approaches carry one load
        place = normal if hasattr(state, "attraction") else []
        normal = [*place, NormalLoad(time, state.normal_load)]
    # while all springs slide the load does not determine the displacement
    slides = vertices.size == 2 and abs(vertices["slope"][-1]) == line.friction[0]
    tangential: Event = TangentialDisplacement(time, state.tangential_displacement)
    if line.tangential_control == LOAD and not slides and line.excess == 0.0:
        tangential = TangentialLoad(time, state.tangential_load)
    return [*normal, tangential]
