"""Waypoints at which later events branch off from a history, so that they do not change the paths before."""

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.law import coulomb
from historysim.basics.arguments import Floats
from historysim.loads.events import (
    Event,
    FrictionRamp,
    LoadEvent,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)
from historysim.loads.schedule import CHANNELS, COMPONENTS, LoadChannel, event_times, list_channels

if TYPE_CHECKING:
    from historysim.asperities.instrument import Instrument
    from historysim.asperities.state import State


def fork_waypoints(
    events: Sequence[Event],
    time: float,
    state_at: Callable[[float], "State"],
    instrument: "Instrument",
) -> list[Event]:
    """Return waypoints that complete the events up to a time [s], so that later events do not change the path up to it.

    A channel that is between two waypoints then, or held after its last, gets one at ``time``, and
    one at the last event time, since a path that is straight in the displacements is not straight
    in the loads. Friction also gets one at each time at which an event changes it. The waypoints
    are requests: a tangential load that the friction limit holds has the requested value,
    and the value of friction does not include the change at its time. ``state_at`` gives the state
    at a time of the same events.
    """
    state_at = cache(state_at)
    times = np.unique(event_times(events))
    passed = int(np.searchsorted(times, time, side="right"))
    latest, following = (
        float(times[passed - 1]),
        float(times[passed]) if passed < times.size else math.inf,
    )
    normal, along_x, friction, *along_y = (
        _bounds(events, channel, time, following) for channel in list_channels(events)
    )
    names = (CHANNELS[0], *COMPONENTS)
    loads = dict(zip(names, (normal, along_x, *along_y), strict=False))
    kinds = {
        normal.kind or NormalLoad,
        *(bounds.kind or TangentialLoad for bounds in (along_x, *along_y)),
    }
    moved = not kinds.isdisjoint({NormalDisplacement, TangentialDisplacement})
    # a load with a spring in parallel acts as a drive
    straight_in_displacements = moved or bool(instrument.parallel_stiffness)
    moments = {latest, time}
    if straight_in_displacements and TangentialLoad in kinds:
        moments.add(_end_of_saturation(state_at, latest, time))
    waypoints: list[Event] = []
    for name, bounds in loads.items():
        of_channel: list[Any] = [
            _waypoint(
                bounds.kind,
                moment,
                state_at(moment),
                instrument,
                keeps_gap=straight_in_displacements,
            ).restrict({name})
            for moment in sorted(moments)
            if bounds.kind and moment > bounds.start(latest)
        ]
        held: Any = bounds.previous and bounds.previous.restrict({name})
        if (
            bounds.ahead is None
            and of_channel
            and all(_is_same_waypoint(held, waypoint) for waypoint in of_channel)
        ):
            of_channel = [attrs.evolve(held, time=time)]
        waypoints += of_channel
    waypoints = _join_pairs(waypoints)
    waypoints += _friction_waypoints(events, friction, times, time, state_at)
    if latest < time and not waypoints:
        # a load that is still to begin starts at an event time
        waypoints.append(NormalLoad(time, 0.0))
    return waypoints


def _join_pairs(waypoints: Sequence[Any]) -> list[Event]:
    """Join the x and y waypoints of one type and time."""
    joined: dict[Any, Any] = {}
    for event in waypoints:
        key = type(event), event.time
        partner = joined.setdefault(key, event)
        if partner is not event:
            x, y = (b if a is None else a for a, b in zip(partner.value, event.value, strict=True))
            joined[key] = attrs.evolve(event, value=(x, y))
    return list(joined.values())


@attrs.frozen
class _Bounds:
    """Waypoints of a channel before and after a time; None if there is none."""

    previous: Any
    ahead: Any

    @property
    def kind(self) -> type[Event] | None:
        """Event class, and so control, of the channel at the time; None before its first move."""
        waypoint = self.ahead or self.previous
        return None if waypoint is None else type(waypoint)

    def start(self, latest: float) -> float:
        """Return the time from which the channel moves or is held."""
        return latest if self.previous is None else self.previous.time


def _bounds(
    events: Sequence[Event], channel: "LoadChannel", time: float, following: float
) -> _Bounds:
    passed = int(np.searchsorted(channel.time, time, side="right"))
    previous = events[channel.numbers[passed - 1]] if passed else None
    ahead = events[channel.numbers[passed]] if passed < channel.time.size else None
    # a channel begins its first move at the event time before its first waypoint
    waits = previous is None and ahead is not None and ahead.time > following
    return _Bounds(previous, None if waits else ahead)


def _is_same_waypoint(held: LoadEvent, waypoint: Event) -> bool:
    """Return True if a waypoint has the control and, to rounding, the value of the held one."""
    if not isinstance(waypoint, LoadEvent) or type(held) is not type(waypoint):
        return False
    return all(
        np.isclose(waypoint.channel_value(name), held.channel_value(name), rtol=1e-12, atol=0.0)
        for name in held.channels
    )


def _waypoint(
    kind: type[Event] | None,
    time: float,
    state: "State",
    instrument: "Instrument",
    *,
    keeps_gap: bool,
) -> LoadEvent:
    """Return the waypoint (of an event class) that requests a state; ``keeps_gap`` holds an open gap by its size."""
    if kind is NormalDisplacement or (
        kind is NormalLoad and keeps_gap and state.normal_load == 0.0
    ):
        return NormalDisplacement(time, state.approach)
    if kind is NormalLoad:
        return NormalLoad(time, state.normal_load)
    if kind is TangentialLoad:
        return TangentialLoad(
            time, instrument.drive_load(state.tangential_displacement, state.tangential_request)
        )
    force: Any = state.tangential_load
    return TangentialDisplacement(
        time, instrument.drive_displacement(state.tangential_displacement, force)
    )


def _end_of_saturation(state_at: Callable[[float], "State"], start: float, stop: float) -> float:
    """Return the time at which a path from the friction limit leaves it; ``start`` if it never does.

    From there on the path is straight in the displacements.
    """

    def is_saturated(time: float) -> bool:
        state = state_at(time)
        return bool(np.any(state.tangential_request != state.tangential_load))

    if not is_saturated(start) or is_saturated(stop):
        return start
    while start < (middle := 0.5 * (start + stop)) < stop:
        start, stop = (middle, stop) if is_saturated(middle) else (start, middle)
    return start


def _friction_waypoints(
    events: Sequence[Event],
    bounds: _Bounds,
    times: Floats,
    time: float,
    state_at: Callable[[float], "State"],
) -> list[Event]:
    if bounds.kind is None:
        return []
    latest = float(times[np.searchsorted(times, time, side="right") - 1])
    start = bounds.start(latest)
    changes = {event.time for event in events if event.changes_friction and event.channel is None}
    waypoints: list[Event] = []
    for moment in sorted({*changes, latest, time}):
        if not start < moment <= time:
            continue
        previous_time = float(times[np.searchsorted(times, moment) - 1])
        friction = state_at(previous_time).friction
        if isinstance(bounds.ahead, FrictionRamp):
            goal = coulomb(bounds.ahead.friction, friction.size)
            friction = friction + (goal - friction) * (
                (moment - previous_time) / (bounds.ahead.time - previous_time)
            )
        waypoints.append(FrictionRamp(moment, tuple(friction) if np.ptp(friction) else friction[0]))
    return waypoints
