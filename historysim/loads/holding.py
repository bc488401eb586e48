"""Held channels: waypoints that keep a channel at its value, and notices of channels that ramp through other events."""

import warnings
from collections.abc import Sequence
from itertools import groupby
from operator import attrgetter

import attrs
import numpy as np

from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.errors import InputError, RampWarning
from historysim.loads import schedule
from historysim.loads.event_sequence import Events, SampledLoads, check_sequence, time_text
from historysim.loads.events import Event, LoadEvent


@attrs.define
class Timeline:
    """Events in time order, with the last waypoint of each load channel."""

    events: list[Event] = attrs.Factory(list)
    last: dict[str, LoadEvent] = attrs.Factory(dict)  #: last waypoint of each channel

    def append(self, event: Event) -> None:
        """Append an event."""
        self.events.append(event)
        if isinstance(event, LoadEvent):
            self.last.update(dict.fromkeys(event.channels, event))

    def hold(self, time: float) -> None:
        """Append a waypoint at a time [s] for each channel that has none there, with the value of its last one."""
        for event in dict.fromkeys(self.last.values()):
            if event.time < time:
                channels = [name for name in event.channels if self.last[name] == event]
                self.append(attrs.evolve(event.restrict(channels), time=time))


@attrs.frozen
class LoadRamp:
    """Ramp of a load channel between two of its waypoints, with events at times in between that do not set it."""

    start: LoadEvent
    end: LoadEvent
    passed: int  #: index of the first event in between
    others: int  #: number of further ramps of this type among the events

    def notice(self, location: str, hold: str, ramp: str) -> str:
        """Format a notice about the event in between; `hold` and `ramp` are the settings to choose from."""
        more = (
            f", and so in {count_text(self.others, 'other place', 'other places')}"
            if self.others
            else ""
        )
        return (
            f"{location}: {self.start.name} is not set here and ramps from {_text(self.start)} to {_text(self.end)}"
            f"{more}; set {hold} to hold it, or {ramp} if the ramp is intended"
        )


def _text(event: LoadEvent) -> str:
    values = [quantity_text(event.channel_value(channel), event.unit) for channel in event.channels]
    return f"{', '.join(values)} at {event.time:g} s"


def find_ramp(events: Sequence[Event]) -> LoadRamp | None:
    """Find the first load channel that changes between two waypoints while events in between do not set it.

    ``events`` are in the order of their times. The first ramp is the one that ends first; None if
    there is no ramp.
    """
    if isinstance(events, SampledLoads) or not events:
        # each sample sets both channels
        return None
    times = np.append(schedule.event_times(events), np.inf)
    found = []
    for name, channel in schedule.load_waypoints(events).items():
        passed = np.searchsorted(times, channel.time[:-1], side="right")
        changes = (np.diff(channel.value) != 0) | (np.diff(channel.control) != 0)
        at = np.flatnonzero(changes & (times[passed] < channel.time[1:]))
        found += (
            [(channel.numbers[at + 1], channel.numbers[at], passed[at], name)] if at.size else []
        )
    if not found:
        return None
    ends, starts, passed, name = min(found, key=lambda ramps: int(ramps[0][0]))
    start, end = (events[int(numbers[0])] for numbers in (starts, ends))
    assert isinstance(start, LoadEvent)  # noqa: S101 - a waypoint of a load channel
    assert isinstance(end, LoadEvent)  # noqa: S101
    others = sum(ramps[0].size for ramps in found) - 1
    return LoadRamp(start.restrict([name]), end.restrict([name]), int(passed[0]), others)


def apply_hold(events: Sequence[Event], hold: bool | None, *, stacklevel: int) -> Sequence[Event]:
    """Return events in which, if `hold` is true, each channel keeps its value at the times of other events.

    If `hold` is None, channels ramp between their waypoints, with a RampWarning if one ramps
    through other events; if it is False, such ramps are intended. InputError for another `hold`,
    and for unordered events that are to be held.
    """
    if hold is not None and not isinstance(hold, bool):
        raise InputError(f"hold is {hold!r}; expected True, False or None")
    if hold:
        check_sequence(events)
        return events if isinstance(events, SampledLoads) else _held(events)
    if hold is None and (ramp := _ramp_in_order(events)) is not None:
        when = time_text(events[ramp.passed].time)
        notice = ramp.notice(f"event {ramp.passed} at t = {when}", "hold=True", "hold=False")
        warnings.warn(notice, RampWarning, stacklevel=stacklevel)
    return events


def _held(events: Sequence[Event]) -> Events:
    timeline = Timeline()
    for time, group in groupby(events, key=attrgetter("time")):
        for event in group:
            timeline.append(event)
        timeline.hold(time)
    return Events(timeline.events)


def _ramp_in_order(events: Sequence[Event]) -> LoadRamp | None:
    try:
        check_sequence(events)
    except InputError:
        # reported when the events are replayed
        return None
    return find_ramp(events)
