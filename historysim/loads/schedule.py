"""From load events to straight paths: what is walked, in which order, and when a row is recorded."""

import bisect
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.friction import FrictionGoal, coulomb
from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.loads.event_sequence import check_sequence
from historysim.loads.events import Event, FrictionRamp, LoadEvent, NormalDisplacement, TangentialDisplacement
from historysim.loads.samples import SampledLoads
from historysim.memory.binding import DISPLACED, LOAD
from historysim.memory.paths import STILL, Goals, Paths, paths_to

if TYPE_CHECKING:
    from historysim.asperities.state import EnsembleState

Goal = tuple[int, float, float]
"""Control of a channel, its target in N or m, and the fraction of the way left to go."""

Ramp = tuple[FrictionRamp, float]
"""Where friction is on its way to, and the fraction of the way left to go."""

CHANNELS = ("normal", "tangential", "friction")
AT_WAYPOINT, BEYOND_LAST = -1, -2


@attrs.frozen
class Cursor:
    """How far a schedule has come at the end of one of its times: where it can be taken up again.

    A channel on its way to a later waypoint is where that waypoint puts it, so what has been replayed may
    depend on an event that is still to come, and a channel beyond its last waypoint would have been elsewhere
    if it had one more. `heading` says so, and two schedules that stand alike have replayed the same.
    """

    events: int
    rows: int
    """events and rows: events that are done, and rows recorded so far."""
    time: float
    """The time at which it stands [s]."""
    passed: tuple[int, ...]
    """Waypoints that each of `CHANNELS` has passed."""
    control: tuple[int, ...]
    """How the load channels are controlled, and 0 for friction."""
    heading: tuple[int, ...]
    """Index of the event that each is on its way to; ``AT_WAYPOINT`` where it stands at one of its waypoints or has not
    begun, ``BEYOND_LAST`` where it is held after its last."""


@attrs.frozen(eq=False)
class Start:
    """Where a replay begins: at the beginning, or where an earlier one of the same events stood."""

    state: "EnsembleState"
    cursor: Cursor | None = None

    @property
    def rows(self) -> int:
        """Rows that are recorded before."""
        return self.cursor.rows if self.cursor else 0


@attrs.frozen
class Segment:
    """Paths between changes of friction or geometry, and the change that ends them."""

    paths: Paths
    """With targets in N and m."""
    event: Sequence[int]
    """Index of an event that each path serves, the tangential one where there is one."""
    row_time: Floats
    """(row) Times of the rows that the paths record [s]."""
    change: Event | None = None
    """Acts at the end of the last path."""
    change_event: int = -1
    """Its index."""
    ramp: FrictionRamp | None = None
    """Where friction is on its way to on the one path, of which it goes the part ``ramp_part``."""
    ramp_part: float = 1.0
    cursor: Cursor | None = None
    """Where the schedule stands at the end, unless that is in the midst of a time or between two."""
    share: float = 1.0
    """How much of its one path is walked, where the schedule ends between two event times; otherwise 1."""

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
    """Schedule events, which stand in the order of their times.

    At each distinct time both channels first arrive where their waypoints put them, on one joint
    straight path; what else the events at that time say follows in their order. One row is
    recorded per distinct time, and ``substeps`` - 1 more at equal intervals since the time before.

    Parameters
    ----------
    events : sequence of events
    substeps : int
        Rows per interval of time, 1 or more.
    most_rows : int, optional
        Break segments so that none records many more rows than this.
    start : Cursor, optional
        Where an earlier schedule of the same events stood; the beginning by default.
    until : float
        Stop at this time [s]. Between two event times, the last segment is the way to the later one, of which a share
        is walked, and records a row there.

    Raises
    ------
    InputError
        Events that are not events, not in order, or none; substeps below 1.
    """
    if isinstance(events, SampledLoads) and start is None and until == math.inf:
        yield _sampled(events, substeps)
        return
    _check(events, substeps)
    channels = normal, tangential, friction = _channels(events, start)
    arriving_channels = ("friction", "normal", "tangential") if friction.waypoints else ("normal", "tangential")
    done, rows, previous = (start.events, start.rows, start.time) if start else (0, 0, None)
    cursor, broken_at = start, rows
    table = _Table()
    numbered_events = enumerate(itertools.islice(events, done, None), done)
    for time, numbered in itertools.groupby(numbered_events, key=lambda pair: pair[1].time):
        if time > until:
            if previous is None or until <= previous:
                break
            if table.paths:
                yield table.segment(cursor=cursor or _cursor(done, rows, previous, channels))
            yield _part_of_the_way(channels, previous, time, until, done)
            return
        present = list(numbered)
        arriving = [_first(present, name) for name in arriving_channels]
        # changes act after all channels have arrived
        rest = _joint([pair for pair in present if pair not in arriving])
        served = next((pair[0] for pair in reversed(arriving) if pair), present[0][0])
        inner = _inner_times(previous, time, substeps)
        ramp = friction.ramp(time, previous)
        if ramp is not None and table.paths:
            yield table.segment(cursor=cursor)
            table = _Table()
        table.ramp = ramp
        table.add(normal.arrive(time, previous), tangential.arrive(time, previous), served, inner)
        for number, group in rest:
            if table.ramp is not None or not isinstance(group, dict):
                yield table.segment(*_change(number, group))
                table = _Table()
            if isinstance(group, dict):
                table.add(normal.jump(group), tangential.jump(group), number)
            else:
                table.ramp = friction.jump_to(group) if isinstance(group, FrictionRamp) else None
                # the path on which a controlled load is restored
                table.add(normal.stay(), tangential.stay(), number)
        table.record(time)
        previous, done, rows = time, done + len(present), rows + 1 + len(inner)
        # where friction is on its way, the segment that ends here is given when friction has moved on
        cursor = _cursor(done, rows, time, channels) if friction.waypoints else None
        # changes of friction break segments too, but in the midst of a time
        if table.ramp is not None or (most_rows is not None and rows - broken_at >= most_rows):
            yield table.segment(cursor=cursor or _cursor(done, rows, time, channels))
            table, broken_at = _Table(), rows
    if table.paths:
        yield table.segment(cursor=cursor or _cursor(done, rows, previous, channels))


def _part_of_the_way(
    channels: tuple["_Channel", "_Channel", "_Channel"], previous: float, time: float, until: float, event: int
) -> Segment:
    """Return the way from one event time to the next, of which a share is walked: up to a time between the two."""
    normal, tangential, friction = channels
    table = _Table()
    table.ramp = friction.ramp(time, previous)
    table.add(normal.arrive(time, previous), tangential.arrive(time, previous), event)
    table.record(until)
    return attrs.evolve(table.segment(), share=(until - previous) / (time - previous))


def _cursor(done: int, rows: int, time: float | None, channels: Sequence["_Channel"]) -> Cursor | None:
    """Where a schedule stands now that a time is done, if one is."""
    if time is None:
        return None
    return Cursor(
        events=done,
        rows=rows,
        time=time,
        passed=tuple(channel.passed for channel in channels),
        control=tuple(channel.control for channel in channels),
        heading=tuple(channel.heading(time) for channel in channels),
    )


def cursor_at(events: Sequence[Event], count: int, substeps: int = 1) -> Cursor | None:
    """Where a schedule stands when so many events are done; None in the midst of a time.

    Parameters
    ----------
    events : sequence of events
        In order.
    count : int
        Events that are done, one or more.
    substeps : int
        Rows per interval of time.
    """
    if not 0 < count <= len(events) or (count < len(events) and events[count].time == events[count - 1].time):
        return None
    time = events[count - 1].time
    channels = _channels(events, done=count)
    return Cursor(
        events=count,
        rows=row_count(events[:count], substeps),
        time=time,
        passed=tuple(channel.passed for channel in channels),
        control=tuple(channel.last_control(time) for channel in channels),
        heading=tuple(channel.heading(time) for channel in channels),
    )


def row_count(events: Sequence[Event], substeps: int = 1, until: float = math.inf) -> int:
    """Return the number of rows that `segments` records; parameters and errors as there."""
    if isinstance(events, SampledLoads) and until == math.inf:
        return events.time.size
    _check(events, substeps)
    times = np.fromiter((event.time for event in events), dtype=float, count=len(events))
    done = times[times <= until]
    between = 0 < done.size < times.size and until > done[-1]
    return (int(np.count_nonzero(np.diff(done))) * substeps + 1 if done.size else 0) + int(between)


def friction_changes(events: Sequence[Event]) -> list[Event]:
    """Return the events that change friction."""
    # a fit asks this of the same samples a thousand times, and they hold loads alone
    if isinstance(events, SampledLoads):
        return []
    # what is no event is told where their order is checked
    return [event for event in events if getattr(event, "changes_friction", False)]


def changes_geometry(events: Sequence[Event]) -> bool:
    """Return whether an event changes heights or radii of summits."""
    return not isinstance(events, SampledLoads) and any(getattr(event, "changes_geometry", False) for event in events)


def _sampled(loads: SampledLoads, substeps: int) -> Segment:
    """Return the segment of sampled loads, which are walked in one piece."""
    check_substeps(substeps)
    count = loads.time.size
    paths = paths_to(Goals(LOAD, loads.normal_load), Goals(DISPLACED, loads.tangential_displacement))
    return Segment(paths, range(1, 2 * count, 2), loads.time)


def _check(events: Sequence[Event], substeps: int) -> None:
    check_sequence(events)
    if not events:
        raise InputError("there are no load events; expected at least one")
    check_substeps(substeps)


def check_substeps(substeps: int) -> None:
    """Check a number of rows per interval.

    Raises InputError: no whole number of 1 or more.
    """
    if isinstance(substeps, bool) or not isinstance(substeps, int) or substeps < 1:
        raise InputError(f"substeps is {substeps!r}; expected a whole number of 1 or more")


def _first(present: list[tuple[int, Event]], channel: str) -> tuple[int, Event] | None:
    for pair in present:
        if getattr(pair[1], "channel", None) == channel:
            return pair
    return None


def _joint(rest: list[tuple[int, Event]]) -> list[tuple[int, Event | dict[str, LoadEvent]]]:
    """Gather events at one time into joint paths: a channel's second event starts another."""
    groups: list[tuple[int, Event | dict[str, LoadEvent]]] = []
    for number, event in rest:
        last = groups[-1][1] if groups else None
        if not isinstance(event, LoadEvent):
            groups.append((number, event))
        elif isinstance(last, dict) and event.channel not in last:
            last[event.channel] = event
        else:
            groups.append((number, {event.channel: event}))
    return groups


def _inner_times(previous: float | None, time: float, substeps: int) -> list[float]:
    if previous is None:
        return []
    return [previous + (time - previous) * k / substeps for k in range(1, substeps)]


def _change(number: int, group: Event | dict[str, LoadEvent]) -> tuple[Event | None, int]:
    """Return the change that ends a segment, and its number; None where the next path starts another one only."""
    return (None, -1) if isinstance(group, dict | FrictionRamp) else (group, number)


def _channels(
    events: Sequence[Event], start: Cursor | None = None, *, done: int | None = None
) -> tuple["_Channel", "_Channel", "_Channel"]:
    """Return the channels with their waypoints, in the order of `CHANNELS`."""
    by_channel: dict[str, tuple[list[int], list[Any]]] = {name: ([], []) for name in CHANNELS}
    for number, event in enumerate(events):
        channel = getattr(event, "channel", None)
        if channel is not None:
            numbers, waypoints = by_channel[channel]
            numbers.append(number)
            waypoints.append(event)
    normal, tangential, friction = (_Channel(name, *own, start, done) for name, own in by_channel.items())
    return normal, tangential, friction


class _Channel:
    """One channel's waypoints with their numbers among the events, and which of them it has passed."""

    def __init__(
        self, name: str, numbers: list[int], waypoints: list[Any], start: Cursor | None, done: int | None
    ) -> None:
        self.name, self.numbers, self.waypoints = name, numbers, waypoints
        self.passed = 0
        self.control = LOAD
        if start is not None:
            own = CHANNELS.index(name)
            self.passed, self.control = start.passed[own], start.control[own]
        elif done is not None:
            self.passed = bisect.bisect_left(self.numbers, done)

    def arrive(self, time: float, previous: float | None) -> Goal:
        """Where the channel is at a time, by its first waypoint then or on the straight line to a later one."""
        if self.passed == len(self.waypoints):
            return (self.control, self.waypoints[-1].value, 1.0) if self.passed else self.stay()
        waypoint = self.waypoints[self.passed]
        if waypoint.time == time:
            return self.jump({self.name: waypoint})
        if self.passed == 0 or previous is None:
            return self.stay()
        self.control = _control(waypoint)
        return self.control, waypoint.value, (time - previous) / (waypoint.time - previous)

    def jump(self, group: dict[str, LoadEvent]) -> Goal:
        """Go to the channel's waypoint in a joint path, if it has one there."""
        if self.name not in group:
            return self.stay()
        self.passed += 1
        self.control = _control(group[self.name])
        return self.control, group[self.name].value, 1.0

    def ramp(self, time: float, previous: float | None) -> Ramp | None:
        """Where friction goes on the way to a time, by its first waypoint then or on the line to a later one."""
        if self.passed == len(self.waypoints):
            return None
        waypoint = self.waypoints[self.passed]
        if waypoint.time == time:
            return self.jump_to(waypoint)
        if self.passed == 0 or previous is None:
            return None
        return waypoint, (time - previous) / (waypoint.time - previous)

    def jump_to(self, waypoint: FrictionRamp) -> Ramp:
        """Go to the next waypoint of friction."""
        self.passed += 1
        return waypoint, 1.0

    def heading(self, time: float) -> int:
        """Index of the event that it is on its way to at a time that is done, or what `Cursor` has in its place."""
        if self.passed == 0 or self.waypoints[self.passed - 1].time == time:
            return AT_WAYPOINT
        return BEYOND_LAST if self.passed == len(self.waypoints) else self.numbers[self.passed]

    def last_control(self, time: float) -> int:
        """How it was controlled on the way to a time that is done."""
        if self.passed == 0:
            return LOAD
        if self.name == "friction":
            return LOAD
        under_way = self.heading(time) >= 0
        return _control(self.waypoints[self.passed if under_way else self.passed - 1])

    def stay(self) -> Goal:
        """Hold what the channel has reached, as it was controlled on the way there; unloaded before it started."""
        return self.control, *STILL


def _control(event: LoadEvent) -> int:
    return DISPLACED if isinstance(event, NormalDisplacement | TangentialDisplacement) else LOAD


class _Table:
    """Paths of one segment, as they are scheduled."""

    def __init__(self) -> None:
        self.paths: list[tuple[float, ...]] = []
        self.events: list[int] = []
        self.recorded: list[bool] = []
        self.ramp: Ramp | None = None
        self.row_times: list[float] = []

    def add(self, normal: Goal, tangential: Goal, event: int, inner_times: Sequence[float] = ()) -> None:
        self.paths.append((*normal, *tangential, len(inner_times) + 1))
        self.events.append(event)
        self.recorded.append(False)
        self.row_times.extend(inner_times)

    def record(self, time: float) -> None:
        """Record the end of the last path."""
        self.recorded[-1] = True
        self.row_times.append(time)

    def segment(
        self,
        change: Event | None = None,
        change_event: int = -1,
        cursor: Cursor | None = None,
    ) -> Segment:
        columns = [np.array(column) for column in zip(*self.paths, strict=True)]
        paths = paths_to(Goals(*columns[:3]), Goals(*columns[3:6]), parts=columns[6], recorded=self.recorded)
        ramp, part = self.ramp or (None, 1.0)
        return Segment(paths, self.events, np.array(self.row_times), change, change_event, ramp, part, cursor)
