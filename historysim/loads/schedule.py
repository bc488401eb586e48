"""From load events to straight paths: what is walked, in which order, and when a row is recorded."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.law import FrictionGoal, coulomb
from historysim.basics.arguments import Array, Booleans, Floats, Integers
from historysim.basics.limits import at_most, most
from historysim.errors import InputError
from historysim.loads.event_sequence import KINDS, SampledLoads, are_loads, check_sequence, is_planar, loads_of
from historysim.loads.events import (
    Event,
    FrictionRamp,
    LoadEvent,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
    components_of,
)
from historysim.memory.binding import DISPLACED, LOAD
from historysim.memory.paths import Goals, Paths, paths_to

if TYPE_CHECKING:
    from historysim.asperities.instrument import Instrument
    from historysim.asperities.state import State

Ramp = tuple[FrictionRamp, float]  # where friction is on its way to, and the fraction of the way left to go

CHANNELS = ("normal", "tangential", "friction")
COMPONENTS = components_of(
    (0.0, 0.0)
)  # the channels of both tangential directions, of which the second is behind `CHANNELS`
AT_WAYPOINT, BEYOND_LAST = -1, -2
PARTS = 6  # column of the parts of a path, behind the goals of two channels


@attrs.frozen
class Cursor:
    """Where a schedule stands at the end of one of its times, to be taken up again there.

    A channel that is on its way to a later waypoint, or held after its last, depends on an event that is still to come,
    or that may be appended: `heading` is what it goes to. Schedules of the same events that stand alike have replayed
    the same.
    """

    events: int  #: events that are done
    rows: int  #: rows recorded so far
    time: float  #: [s]
    #: (channel) Index of the event that each of `CHANNELS` is on its way to; ``AT_WAYPOINT`` where it stands at one of
    #: its waypoints or has not begun, ``BEYOND_LAST`` where it is held after its last. In two tangential directions
    #: the last one is that of y.
    heading: tuple[int, ...]


@attrs.frozen(eq=False)
class Start:
    """Where a replay begins: at the start, or where an earlier one of the same events stood."""

    state: "State"
    cursor: Cursor | None = None

    @property
    def rows(self) -> int:
        """Rows that are recorded before."""
        return self.cursor.rows if self.cursor else 0


@attrs.frozen
class Segment:
    """Paths between changes of friction or geometry, and the change that ends them."""

    paths: Paths  #: with targets in N and m
    event: Sequence[int]  #: index of an event that each path serves, the tangential one where there is one
    row_time: Floats  #: (row) Times of the rows that the paths record [s]
    change: Event | None = None  #: acts at the end of the last path
    change_event: int = -1  #: its index
    #: Where friction is on its way to on the one path, of which it goes the part ``ramp_part``.
    ramp: FrictionRamp | None = None
    ramp_part: float = 1.0
    cursor: Cursor | None = None  #: where the schedule stands at the end, if all events of a time are done there
    share: float = 1.0  #: part of its one path that is walked, where the schedule ends between two event times

    def friction_goal(self, count: int) -> FrictionGoal | None:
        """Return where the coefficients of so many asperities go on the path, if they do."""
        return None if self.ramp is None else FrictionGoal(coulomb(self.ramp.friction, count), self.ramp_part)


def segments(
    events: Sequence[Event],
    substeps: int = 1,
    most_rows: int | None = None,
    *,
    start: Cursor | None = None,
    until: float = math.inf,
) -> Iterator[Segment]:
    """Yield the segments of events, which stand in the order of their times.

    At each time both channels first go where their waypoints put them, on one straight path; the other events of that
    time follow in their order. One row is recorded at each time, and ``substeps`` - 1 more since the time before. No
    segment records many more rows than ``most_rows``. A schedule starts where an earlier one of the same events stood,
    and stops ``until`` a time [s], between two event times on the way to the later one, where it records a row.

    Raises InputError: what are no events, not in order, or none; substeps below 1.
    """
    if isinstance(events, SampledLoads) and start is None and until == math.inf:
        yield from _sampled(events, substeps, most_rows)
        return
    _check(events, substeps)
    yield from _Schedule(events, substeps, start).segments(math.inf if most_rows is None else most_rows, until)


class _Schedule:
    """All times of events as arrays: where both channels go, and which rows are recorded.

    Times at which only waypoints arrive are taken together. At the others, paths follow one by one: changes of friction
    or geometry, a channel's second waypoint, and friction on its way.
    """

    def __init__(self, events: Sequence[Event], substeps: int, start: Cursor | None) -> None:
        self.events, self.substeps, self.start = events, substeps, start
        self.channels = _channels(events)
        self.friction = self.channels[2]
        done = start.events if start else 0
        each = event_times(events)[done:]
        first = np.flatnonzero(np.diff(each, prepend=-math.inf))
        self.time = each[first]
        # events [first, end) are of each time
        self.first, self.end = done + first, done + np.append(first[1:], each.size)
        self.previous = np.append(start.time if start else math.nan, self.time[:-1])[: self.time.size]
        self.parts = np.where(np.isnan(self.previous), 1, substeps)
        self.rows = (start.rows if start else 0) + np.cumsum(self.parts)
        self.goals = [channel.goals(self.time, self.previous) for channel in self.channels]
        # at each time as many waypoints of channels, or changes, as there are in its events
        self.due = self.end - self.first
        if len(self.channels) > len(CHANNELS):
            both: Any = [np.column_stack(each) for each in zip(self.goals[1], self.goals.pop(), strict=True)]
            self.goals[1] = tuple(both)
            counts = [max(len(event.channels), 1) for event in events[done:]]
            self.due = np.add.reduceat(counts, first) if counts else self.due

    def segments(self, most_rows: float, until: float) -> Iterator[Segment]:
        """Yield what `segments` does."""
        arriving, served = self._arriving()
        ramps = self.friction.ramps(self.time)
        special = np.flatnonzero((arriving.sum(axis=0) < self.due) | ramps)
        count = int(np.searchsorted(self.time, until, side="right"))
        table, now, broken_at = _Table(), 0, self.start.rows if self.start else 0
        while now < count:
            full = int(np.searchsorted(self.rows, broken_at + most_rows)) + 1
            plain = int(special[np.searchsorted(special, now)]) if special.size and special[-1] >= now else count
            ends = min(full, plain, count)
            if ends > now:
                here = slice(now, ends)
                table.add(self._paths(here), served[here].tolist(), self._row_times(here), recorded=True)
            else:
                ends = now + 1
                yield from self._step_by_step(table, now, arriving[:, now], int(served[now]), ramp=bool(ramps[now]))
            now = ends
            if table.ramp is not None or self.rows[now - 1] - broken_at >= most_rows:
                yield table.segment(cursor=self.cursor(now))
                broken_at = int(self.rows[now - 1])
        if table.events:
            yield table.segment(cursor=self.cursor(now))
        if count < self.time.size and until > self.previous[count]:
            yield self._part_of_the_way(count, until)

    def cursor(self, done: int) -> Cursor | None:
        """Where the schedule stands when so many of its times are done."""
        if done == 0:
            return self.start
        return _cursor(int(self.end[done - 1]), int(self.rows[done - 1]), float(self.time[done - 1]), self.channels)

    def _arriving(self) -> tuple[Booleans, Integers]:
        """Return which channels arrive at a waypoint (channel, time), and the event that each path serves."""
        arriving, served = np.zeros((len(self.channels), self.time.size), dtype=np.bool_), self.first.copy()
        # of several that arrive at one time the last one is named
        for own in (2, 0, *range(len(CHANNELS), len(self.channels)), 1):
            channel = self.channels[own]
            if channel.numbers.size:
                at = np.minimum(np.searchsorted(channel.time, self.time), channel.time.size - 1)
                arriving[own] = channel.time[at] == self.time
                served = np.where(arriving[own], channel.numbers[at], served)
        return arriving, served

    def _paths(self, times: slice) -> list[Array]:
        """Return the columns of `_Table` of the paths to times; at the first time there is no way."""
        end, begin = self.time[times], self.previous[times]
        goals = [column[times] for goals in self.goals[:2] for column in goals]
        return [*goals, self.parts[times], np.where(np.isnan(begin), end, begin), end]

    def _row_times(self, times: slice, *, inner: bool = False) -> Floats:
        """Return the times of the rows on the way to times, and, unless those within are meant, there."""
        end, begin = self.time[times], self.previous[times]
        within = begin[:, None] + (end - begin)[:, None] * np.arange(1, self.substeps) / self.substeps
        rows: Floats = within if inner else np.column_stack([within, end])
        return rows[~np.isnan(rows)]

    def _step_by_step(
        self, table: "_Table", now: int, arriving: Booleans, served: int, *, ramp: bool
    ) -> Iterator[Segment]:
        """Add the paths at one time, of which the last is recorded; yield the segments that end in the midst of it."""
        time, here = float(self.time[now]), slice(now, now + 1)
        if ramp and table.events:
            yield table.segment(cursor=self.cursor(now))
        if ramp:
            table.ramp = self._ramp(now)
        names = (*CHANNELS, *COMPONENTS[1:])
        first = {
            (name, channel.at(time))
            for name, channel, comes in zip(names, self.channels, arriving, strict=False)
            if comes
        }
        left = []
        for number in range(int(self.first[now]), int(self.end[now])):
            event = self.events[number]
            channels = [name for name in event.channels if (name, number) not in first]
            if channels or not event.channels:
                left.append((number, event, channels))
        # changes act after all channels have arrived
        rest = _joint(left)
        table.add(self._paths(here), [served], self._row_times(here, inner=True), recorded=False)
        # control, target and fraction of both channels: where nothing jumps, a controlled load is restored on the path
        held = [
            (control[here].copy(), np.zeros_like(target[here]), np.zeros_like(part[here]))
            for control, target, part in self.goals[:2]
        ]
        for number, group in rest:
            if table.ramp is not None or not isinstance(group, dict):
                # a joint path ends a segment only where friction is on its way
                acts = not isinstance(group, dict | FrictionRamp)
                yield table.segment(*((group, number) if acts else ()))
            if isinstance(group, FrictionRamp):
                table.ramp = group, 1.0
            jumps = group if isinstance(group, dict) else {}
            goals = [tuple(column.copy() for column in goal) for goal in held]
            for name, event in jumps.items():
                goal = goals[name in COMPONENTS]
                where = ..., int(name == COMPONENTS[1])
                goal[0][where], goal[1][where], goal[2][where] = _control(type(event)), event.reached(name), 1.0
                held[name in COMPONENTS][0][where] = _control(type(event))
            path = [column for goal in goals for column in goal]
            path.append(np.ones(1, dtype=np.int64))
            table.add([*path, self.time[here], self.time[here]], [number], np.empty(0), recorded=False)
        table.record(time)

    def _ramp(self, now: int) -> Ramp | None:
        """Return where friction goes on the way to a time, by its first waypoint then or on the line to a later one."""
        if not self.friction.ramps(self.time[now : now + 1])[0]:
            return None
        ramp: Any = self.events[self.friction.at(float(self.time[now]))]
        return ramp, float(self.goals[2][2][now])

    def _part_of_the_way(self, now: int, until: float) -> Segment:
        """Return the way from one event time to the next, of which a share is walked: up to a time between the two."""
        table, here = _Table(), slice(now, now + 1)
        time, previous = float(self.time[now]), float(self.previous[now])
        table.ramp = self._ramp(now)
        path = self._paths(here)
        path[PARTS] = np.ones(1, dtype=np.int64)
        table.add(path, [int(self.first[now])], np.empty(0), recorded=False)
        table.record(until)
        return attrs.evolve(table.segment(), share=(until - previous) / (time - previous))


def _cursor(done: int, rows: int, time: float, channels: Sequence["_Channel"]) -> Cursor:
    return Cursor(done, rows, time, tuple(channel.heading(time) for channel in channels))


def cursor_at(events: Sequence[Event], count: int, substeps: int = 1) -> Cursor | None:
    """Return where a schedule stands when so many events are done; None if others have the time of the last one."""
    if not 0 < count <= len(events) or (count < len(events) and events[count].time == events[count - 1].time):
        return None
    return _cursor(count, row_count(events[:count], substeps), events[count - 1].time, _channels(events))


def fork_waypoints(
    events: Sequence[Event], time: float, state_at: Callable[[float], "State"], instrument: "Instrument"
) -> list[Event]:
    """Waypoints that complete the events up to a time [s], so that later events do not change the path up to it.

    A channel that is between two waypoints then, or held after its last, gets one at ``time``, and one at the last
    event time, since a path that is straight in the displacements is not straight in the loads. Friction also gets one
    at each time at which an event changes it. The waypoints are requests: a tangential load that the friction limit
    holds has the value that is asked for, and the value of friction does not include the change at its time.
    ``state_at`` gives the state at a time of the same events.
    """
    state_at = cache(state_at)
    times = np.unique(event_times(events))
    passed = int(np.searchsorted(times, time, side="right"))
    latest, following = float(times[passed - 1]), float(times[passed]) if passed < times.size else math.inf
    normal, along_x, friction, *along_y = (_bounds(events, channel, time, following) for channel in _channels(events))
    names = (CHANNELS[0], *COMPONENTS)
    loads = dict(zip(names, (normal, along_x, *along_y), strict=False))
    kinds = {normal.kind or NormalLoad, *(each.kind or TangentialLoad for each in (along_x, *along_y))}
    moved = not kinds.isdisjoint({NormalDisplacement, TangentialDisplacement})
    # a load beside a spring in parallel acts as a drive
    straight_in_displacements = moved or bool(instrument.parallel_stiffness)
    moments = {latest, time}
    if straight_in_displacements and TangentialLoad in kinds:
        moments.add(_last_saturated(state_at, latest, time))
    waypoints: list[Event] = []
    for name, bounds in loads.items():
        own: list[Any] = [
            _waypoint(
                bounds.kind, moment, state_at(moment), instrument, keeps_gap=straight_in_displacements
            ).of_channels({name})
            for moment in sorted(moments)
            if bounds.kind and moment > bounds.start(latest)
        ]
        held: Any = bounds.last and bounds.last.of_channels({name})
        if bounds.ahead is None and own and all(_is_same_waypoint(held, waypoint) for waypoint in own):
            own = [attrs.evolve(held, time=time)]
        waypoints += own
    waypoints = _pairs_joined(waypoints)
    waypoints += _friction_waypoints(events, friction, times, time, state_at)
    if latest < time and not waypoints:
        # a load that is still to begin starts at an event time
        waypoints.append(NormalLoad(time, 0.0))
    return waypoints


def _pairs_joined(waypoints: Sequence[Any]) -> list[Event]:
    """Return waypoints with those of x and y that are of one kind and time as one."""
    found: dict[Any, Any] = {}
    for event in waypoints:
        key = type(event), event.time
        other = found.setdefault(key, event)
        if other is not event:
            x, y = (b if a is None else a for a, b in zip(other.value, event.value, strict=True))
            found[key] = attrs.evolve(event, value=(x, y))
    return list(found.values())


@attrs.frozen
class _Bounds:
    """The waypoints of a channel before and after a time; None where there is none."""

    last: Any
    ahead: Any

    @property
    def kind(self) -> type[Event] | None:
        """How the channel is controlled at the time; None before its first move."""
        waypoint = self.ahead or self.last
        return None if waypoint is None else type(waypoint)

    def start(self, latest: float) -> float:
        """Return the time from which the channel is on its way, or held."""
        return latest if self.last is None else self.last.time


def _bounds(events: Sequence[Event], channel: "_Channel", time: float, following: float) -> _Bounds:
    passed = int(np.searchsorted(channel.time, time, side="right"))
    last = events[channel.numbers[passed - 1]] if passed else None
    ahead = events[channel.numbers[passed]] if passed < channel.time.size else None
    # a channel begins its first move at the event time before its first waypoint
    waits = last is None and ahead is not None and ahead.time > following
    return _Bounds(last, None if waits else ahead)


def _is_same_waypoint(held: LoadEvent, waypoint: Event) -> bool:
    """Whether a waypoint has the control and, to rounding, the value of one that is held."""
    if not isinstance(waypoint, LoadEvent) or type(held) is not type(waypoint):
        return False
    return all(np.isclose(waypoint.reached(name), held.reached(name), rtol=1e-12, atol=0.0) for name in held.channels)


def _waypoint(
    kind: type[Event] | None, time: float, state: "State", instrument: "Instrument", *, keeps_gap: bool
) -> LoadEvent:
    """Return the waypoint of a kind that a state is asked for; if ``keeps_gap``, that of an open gap is its size."""
    if kind is NormalDisplacement or (kind is NormalLoad and keeps_gap and state.normal_load == 0.0):
        return NormalDisplacement(time, state.approach)
    if kind is NormalLoad:
        return NormalLoad(time, state.normal_load)
    if kind is TangentialLoad:
        return TangentialLoad(time, instrument.drive_load(state.tangential_displacement, state.tangential_request))
    force: Any = state.tangential_load
    return TangentialDisplacement(time, instrument.drive_displacement(state.tangential_displacement, force))


def _last_saturated(state_at: Callable[[float], "State"], begin: float, end: float) -> float:
    """Return the time at which a path that begins at the friction limit leaves it; the beginning if it does not.

    From there on the path is straight in the displacements.
    """

    def saturated(time: float) -> bool:
        state = state_at(time)
        return bool(np.any(state.tangential_request != state.tangential_load))

    if not saturated(begin) or saturated(end):
        return begin
    while begin < (middle := 0.5 * (begin + end)) < end:
        begin, end = (middle, end) if saturated(middle) else (begin, middle)
    return begin


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
    found: list[Event] = []
    for moment in sorted({*changes, latest, time}):
        if not start < moment <= time:
            continue
        before = float(times[np.searchsorted(times, moment) - 1])
        friction = state_at(before).friction
        if isinstance(bounds.ahead, FrictionRamp):
            goal = coulomb(bounds.ahead.friction, friction.size)
            friction = friction + (goal - friction) * ((moment - before) / (bounds.ahead.time - before))
        found.append(FrictionRamp(moment, tuple(friction) if np.ptp(friction) else friction[0]))
    return found


def row_count(events: Sequence[Event], substeps: int = 1, until: float = math.inf) -> int:
    """Return the number of rows that `segments` records."""
    if isinstance(events, SampledLoads) and until == math.inf:
        return events.time.size
    _check(events, substeps)
    times = event_times(events)
    done = times[times <= until]
    between = 0 < done.size < times.size and until > done[-1]
    return (int(np.count_nonzero(np.diff(done))) * substeps + 1 if done.size else 0) + int(between)


def friction_changes(events: Sequence[Event]) -> list[Event]:
    """Return the events that change friction."""
    # what is no event is refused where their order is checked
    return [] if are_loads(events) else [one for one in events if getattr(one, "changes_friction", False)]


def changes_geometry(events: Sequence[Event]) -> bool:
    """Return whether an event changes heights or radii of summits."""
    return not are_loads(events) and any(getattr(event, "changes_geometry", False) for event in events)


def event_times(events: Sequence[Event]) -> Floats:
    """Return the times of events [s]."""
    loads = loads_of(events)
    if loads is not None:
        return loads.time
    return np.fromiter((event.time for event in events), dtype=float, count=len(events))


def _sampled(samples: SampledLoads, substeps: int, most_rows: int | None) -> Iterator[Segment]:
    """Yield segments of sampled loads, of so many samples each."""
    check_substeps(substeps)
    size = samples.time.size
    for first in range(0, size, most_rows or max(size, 1)):
        part = slice(first, min(first + (most_rows or size), size))
        time = samples.time[part]
        times = np.append(samples.time[max(first - 1, 0)], time[:-1]), time
        goals = Goals(LOAD, samples.normal_load[part]), Goals(DISPLACED, samples.tangential_displacement[part])
        yield Segment(paths_to(*goals, times=times), range(2 * first + 1, 2 * part.stop, 2), time)


def _check(events: Sequence[Event], substeps: int) -> None:
    check_sequence(events)
    if not events:
        raise InputError("there are no load events; expected at least one")
    check_substeps(substeps)
    if (steps := len(events) * substeps) > most("STEPS"):
        raise InputError(f"substeps is {substeps:,}, which makes {steps:,} steps; {at_most('STEPS')}")


def check_substeps(substeps: int) -> None:
    """Check a number of rows per interval: no whole number of 1 or more is an InputError."""
    if isinstance(substeps, bool) or not isinstance(substeps, int) or substeps < 1:
        raise InputError(f"substeps is {substeps!r}; expected a whole number of 1 or more")


def _joint(rest: list[tuple[int, Event, list[str]]]) -> list[tuple[int, Event | dict[str, LoadEvent]]]:
    """Gather events at one time, of some channels each, into joint paths: a channel's second event starts another."""
    groups: list[tuple[int, Event | dict[str, LoadEvent]]] = []
    for number, event, channels in rest:
        last = groups[-1][1] if groups else None
        if not isinstance(event, LoadEvent):
            groups.append((number, event))
        elif isinstance(last, dict) and not last.keys() & set(channels):
            last |= dict.fromkeys(channels, event)
        else:
            groups.append((number, dict.fromkeys(channels, event)))
    return groups


def _channels(events: Sequence[Event]) -> list["_Channel"]:
    """Return the channels with their waypoints, in the order of `CHANNELS`, and in two directions that of y."""
    loads = loads_of(events)
    channels = []
    if loads is not None:
        where, control = _CHANNEL_OF[loads.kind], _CONTROL_OF[loads.kind]
        for number in range(len(CHANNELS)):
            own = np.flatnonzero(where == number)
            channels.append(_Channel(own, loads.time[own], loads.value[own], control[own]))
        return channels
    time, control = event_times(events), np.array([_control(type(event)) for event in events])
    for name in (*CHANNELS, *COMPONENTS[1:]) if is_planar(events) else CHANNELS:
        of_channel = [(number, event) for number, event in enumerate(events) if name in event.channels]
        own = np.array([number for number, _ in of_channel], dtype=np.int64)
        values = [event.reached(name) if isinstance(event, LoadEvent) else 0.0 for _, event in of_channel]
        channels.append(_Channel(own, time[own], np.array(values, dtype=float), control[own]))
    return channels


def load_waypoints(events: Sequence[Event]) -> dict[str, "_Channel"]:
    """Return the waypoints of each load channel, by its name; tangential y only if events have two directions."""
    normal, along_x, _, *along_y = _channels(events)
    return dict(zip((CHANNELS[0], *COMPONENTS), (normal, along_x, *along_y), strict=False))


def _control(kind: type[Event]) -> int:
    return DISPLACED if kind in {NormalDisplacement, TangentialDisplacement} else LOAD


# Of each of `KINDS` the number of its channel, and its control.
_CHANNEL_OF = np.array([CHANNELS.index(kind.channel) for kind in KINDS])
_CONTROL_OF = np.array([_control(kind) for kind in KINDS])


@attrs.frozen(eq=False)
class _Channel:
    """One channel's waypoints, in the order of time; arrays are (waypoint)."""

    numbers: Integers  #: their indices among the events
    time: Floats
    value: Floats
    control: Integers

    def goals(self, time: Floats, previous: Floats) -> tuple[Integers, Floats, Floats]:
        """Return where the channel goes on the way to times: its control, target, and the part of the way left to go.

        It arrives at its first waypoint of a time, or is on the line to a later one; it is unloaded before its first
        one, and stays after its last.
        """
        last = self.time.size - 1
        none = np.zeros(time.size)
        if last < 0:
            return np.full(time.size, LOAD), none, np.zeros(time.size)
        at = np.searchsorted(self.time, time)
        next_one = np.minimum(at, last)
        goes = self.time[next_one]
        arrives = (at > last) | (goes == time)
        left = np.divide(time - previous, goes - previous, out=np.ones(time.size), where=~arrives)
        waits = (at == 0) & ~arrives
        return (
            np.where(waits, LOAD, self.control[next_one]),
            np.where(waits, none, self.value[next_one]),
            np.where(waits, 0.0, left),
        )

    def at(self, time: float) -> int:
        """Return the number of the event that is its first waypoint at a time or later."""
        return int(self.numbers[np.searchsorted(self.time, time)])

    def ramps(self, time: Floats) -> Booleans:
        """Return at which times friction has been on its way."""
        at = np.searchsorted(self.time, time)
        arrives = np.isin(time, self.time)
        ramps: Booleans = (at < self.time.size) & ((at > 0) | arrives)
        return ramps

    def heading(self, time: float) -> int:
        """Return what `Cursor.heading` has when a time is done."""
        passed = int(np.searchsorted(self.time, time, side="right"))
        if passed == 0 or self.time[passed - 1] == time:
            return AT_WAYPOINT
        return BEYOND_LAST if passed == self.time.size else int(self.numbers[passed])


class _Table:
    """Paths of one segment, as they are scheduled."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin another segment."""
        self.columns: list[Sequence[Array]] = []
        self.events: list[int] = []
        self.recorded: list[bool] = []
        self.row_times: list[Floats] = []
        self.ramp: Ramp | None = None

    def add(self, columns: Sequence[Array], events: Sequence[int], row_times: Floats, *, recorded: bool) -> None:
        """Add paths: goals of both channels, parts, times at their ends, their events, and the times of their rows."""
        self.columns.append(columns)
        self.events.extend(events)
        self.recorded.extend([recorded] * len(events))
        self.row_times.append(row_times)

    def record(self, time: float) -> None:
        """Record the end of the last path."""
        self.recorded[-1] = True
        self.row_times.append(np.array([time]))

    def segment(self, change: Event | None = None, change_event: int = -1, cursor: Cursor | None = None) -> Segment:
        """Return the segment of the paths so far, and begin another one."""
        columns = [np.concatenate(column) for column in zip(*self.columns, strict=True)]
        goals = Goals(*columns[:3]), Goals(*columns[3:PARTS])
        paths = paths_to(*goals, parts=columns[PARTS], recorded=self.recorded, times=(columns[-2], columns[-1]))
        ramp, part = self.ramp or (None, 1.0)
        times, events = np.concatenate(self.row_times), self.events
        self.clear()
        return Segment(paths, events, times, change, change_event, ramp, part, cursor)
