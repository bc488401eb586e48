"""Convert load events to straight paths, with the times of the recorded rows."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.law import FrictionGoal, coulomb
from historysim.basics.arguments import Array, Booleans, Floats, Integers
from historysim.basics.limits import at_most, most
from historysim.errors import InputError
from historysim.loads.event_sequence import (
    KINDS,
    SampledLoads,
    are_loads,
    check_sequence,
    is_planar,
    to_loads,
)
from historysim.loads.events import (
    Event,
    FrictionRamp,
    LoadEvent,
    NormalDisplacement,
    TangentialDisplacement,
    tangential_channels,
)
from historysim.memory.binding import DISPLACED, LOAD
from historysim.memory.paths import Goals, Paths, drop_slide_times, straight_paths

if TYPE_CHECKING:
    from historysim.asperities.state import State

# target of a friction ramp, and its remaining fraction
Ramp = tuple[FrictionRamp, float]

CHANNELS = ("normal", "tangential", "friction")
COMPONENTS = tangential_channels(
    (0.0, 0.0)
)  # channels of both tangential directions; the second follows `CHANNELS`
AT_WAYPOINT, BEYOND_LAST = -1, -2
PARTS = 6  # column of the parts of a path, after the goals of two channels


@attrs.frozen
class Cursor:
    """Position of a schedule at the end of one of its event times, from which it can be resumed.

    A channel that is between waypoints, or held after its last one, depends on a later event, or on
    one that may be appended: `heading` is the waypoint that it moves to. Schedules of the same
    events with equal cursors have replayed the same paths.
    """

    events: int  #: events that are done
    rows: int  #: rows recorded so far
    time: float  #: [s]
    #: (channel) Index of the event that each of `CHANNELS` moves to; ``AT_WAYPOINT`` if it is at a
    #: waypoint or has not begun, ``BEYOND_LAST`` if it is held after its last waypoint. In two
    #: tangential directions y is the last channel.
    heading: tuple[int, ...]


@attrs.frozen(eq=False)
class Start:
    """Start of a replay: the initial state, or the state and cursor of an earlier replay of the same events."""

    state: "State"
    cursor: Cursor | None = None

    @property
    def rows(self) -> int:
        """Number of rows recorded before."""
        return self.cursor.rows if self.cursor else 0


@attrs.frozen
class PathBlock:
    """Paths between two changes of friction or geometry, and the change at their end."""

    paths: Paths  #: with targets in N and m
    #: index of an event of each path, the tangential one if there is one
    event: Sequence[int]
    row_time: Floats  #: (row) Times of the rows that the paths record [s]
    change: Event | None = None  #: acts at the end of the last path
    change_event: int = -1  #: its index
    #: Friction ramp on the single path, which covers the fraction ``ramp_part`` of the remaining
    #: ramp.
    ramp: FrictionRamp | None = None
    ramp_part: float = 1.0
    cursor: Cursor | None = None  #: cursor at the end, if all events of a time are done there
    #: fraction of the single path to replay, if the schedule ends between two event times
    share: float = 1.0

    def friction_options(self, count: int) -> dict[str, FrictionGoal]:
        """Return the goal of a friction ramp for ``count`` asperities as ``friction``; empty without a ramp."""
        if self.ramp is None:
            return {}
        return {"friction": FrictionGoal(coulomb(self.ramp.friction, count), self.ramp_part)}


def paths(
    events: Sequence[Event],
    substeps: int = 1,
    most_rows: int | None = None,
    *,
    start: Cursor | None = None,
    until: float = math.inf,
    slide_times: bool = True,
) -> Iterator[PathBlock]:
    """Yield the straight paths of events in blocks, in the order of their times.

    At each time both channels first reach their waypoints on one straight path; the other events of
    that time follow in their order. One row is recorded at each time, and ``substeps`` - 1 more in
    the interval before it. No block records many more rows than ``most_rows``. A schedule starts at
    the cursor of an earlier one of the same events, and stops at the time ``until`` [s], also
    between two event times, where it records a row. Without ``slide_times`` the paths do not
    determine when asperities slide.

    Raises InputError: items that are not events, not in order, or none; substeps below 1.
    """
    if not slide_times:
        for block in paths(events, substeps, most_rows, start=start, until=until):
            yield attrs.evolve(block, paths=drop_slide_times(block.paths))
        return
    if isinstance(events, SampledLoads) and start is None and until == math.inf:
        yield from _sampled_blocks(events, substeps, most_rows)
        return
    _check(events, substeps)
    yield from _Schedule(events, substeps, start).blocks(
        math.inf if most_rows is None else most_rows, until
    )


class _Schedule:
    """All event times as arrays, with goals of both channels and recorded rows.

    Times at which only waypoints arrive are taken together. At the others, paths follow one by one:
    changes of friction or geometry, a channel's second waypoint, and friction on its way.
    """

    def __init__(self, events: Sequence[Event], substeps: int, start: Cursor | None) -> None:
        self.events, self.substeps, self.start = events, substeps, start
        self.channels = list_channels(events)
        self.friction = self.channels[2]
        done = start.events if start else 0
        times = event_times(events)[done:]
        first_indices = np.flatnonzero(np.diff(times, prepend=-math.inf))
        self.time = times[first_indices]
        # events [first, end) are of each time
        self.first, self.end = done + first_indices, done + np.append(first_indices[1:], times.size)
        self.previous = np.append(start.time if start else math.nan, self.time[:-1])[
            : self.time.size
        ]
        self.parts = np.where(np.isnan(self.previous), 1, substeps)
        self.rows = (start.rows if start else 0) + np.cumsum(self.parts)
        self.goals = [channel.goals(self.time, self.previous) for channel in self.channels]
        # at each time as many waypoints of channels, or changes, as there are in its events
        self.due = self.end - self.first
        if len(self.channels) > len(CHANNELS):
            both: Any = [
                np.column_stack(event_times)
                for event_times in zip(self.goals[1], self.goals.pop(), strict=True)
            ]
            self.goals[1] = tuple(both)
            counts = [max(len(event.channels), 1) for event in events[done:]]
            self.due = np.add.reduceat(counts, first_indices) if counts else self.due

    def blocks(self, most_rows: float, until: float) -> Iterator[PathBlock]:
        """Yield the blocks, see `paths`."""
        arriving, served = self._arriving()
        ramps = self.friction.ramps(self.time)
        special = np.flatnonzero((arriving.sum(axis=0) < self.due) | ramps)
        count = int(np.searchsorted(self.time, until, side="right"))
        table, index, broken_at = _Table(), 0, self.start.rows if self.start else 0
        while index < count:
            full = int(np.searchsorted(self.rows, broken_at + most_rows)) + 1
            plain = (
                int(special[np.searchsorted(special, index)])
                if special.size and special[-1] >= index
                else count
            )
            ends = min(full, plain, count)
            if ends > index:
                times = slice(index, ends)
                table.add(
                    self._paths(times),
                    served[times].tolist(),
                    self._row_times(times),
                    recorded=True,
                )
            else:
                ends = index + 1
                yield from self._step_by_step(
                    table, index, arriving[:, index], int(served[index]), ramp=bool(ramps[index])
                )
            index = ends
            if table.ramp is not None or self.rows[index - 1] - broken_at >= most_rows:
                yield table.block(cursor=self.cursor(index))
                broken_at = int(self.rows[index - 1])
        if table.events:
            yield table.block(cursor=self.cursor(index))
        if count < self.time.size and until > self.previous[count]:
            yield self._partial_block(count, until)

    def cursor(self, done: int) -> Cursor | None:
        """Return the cursor after a number of event times."""
        if done == 0:
            return self.start
        return _cursor(
            int(self.end[done - 1]),
            int(self.rows[done - 1]),
            float(self.time[done - 1]),
            self.channels,
        )

    def _arriving(self) -> tuple[Booleans, Integers]:
        """Return the channels that arrive at a waypoint (channel, time), and the event that each path serves."""
        arriving, served = (
            np.zeros((len(self.channels), self.time.size), dtype=np.bool_),
            self.first.copy(),
        )
        # of several that arrive at one time the last one is named
        for number in (2, 0, *range(len(CHANNELS), len(self.channels)), 1):
            channel = self.channels[number]
            if channel.numbers.size:
                at = np.minimum(np.searchsorted(channel.time, self.time), channel.time.size - 1)
                arriving[number] = channel.time[at] == self.time
                served = np.where(arriving[number], channel.numbers[at], served)
        return arriving, served

    def _paths(self, times: slice) -> list[Array]:
        """Return the columns of `_Table` of the paths to event times; the path to the first time has no length."""
        ends, starts = self.time[times], self.previous[times]
        goals = [column[times] for goals in self.goals[:2] for column in goals]
        return [*goals, self.parts[times], np.where(np.isnan(starts), ends, starts), ends]

    def _row_times(self, times: slice, *, inner: bool = False) -> Floats:
        """Return the times of the rows on the paths to event times, with the ends unless ``inner``."""
        ends, starts = self.time[times], self.previous[times]
        within = (
            starts[:, None] + (ends - starts)[:, None] * np.arange(1, self.substeps) / self.substeps
        )
        rows: Floats = within if inner else np.column_stack([within, ends])
        return rows[~np.isnan(rows)]

    def _step_by_step(
        self, table: "_Table", index: int, arriving: Booleans, served: int, *, ramp: bool
    ) -> Iterator[PathBlock]:
        """Add the paths at one event time, of which the last is recorded; yield the blocks that end between them."""
        time, times = float(self.time[index]), slice(index, index + 1)
        if ramp and table.events:
            yield table.block(cursor=self.cursor(index))
        if ramp:
            table.ramp = self._ramp(index)
        names = (*CHANNELS, *COMPONENTS[1:])
        arrived = {
            (name, channel.at(time))
            for name, channel, comes in zip(names, self.channels, arriving, strict=False)
            if comes
        }
        remaining = []
        for number in range(int(self.first[index]), int(self.end[index])):
            event = self.events[number]
            channels = [name for name in event.channels if (name, number) not in arrived]
            if channels or not event.channels:
                remaining.append((number, event, channels))
        # changes act after all channels have arrived
        steps = _joint_paths(remaining)
        table.add(self._paths(times), [served], self._row_times(times, inner=True), recorded=False)
        # control, target and fraction of both channels: where nothing jumps, a controlled load is
        # restored on the path
        held = [
            (control[times].copy(), np.zeros_like(target[times]), np.zeros_like(fraction[times]))
            for control, target, fraction in self.goals[:2]
        ]
        for number, group in steps:
            if table.ramp is not None or not isinstance(group, dict):
                # a joint path ends a block only where friction is on its way
                acts = not isinstance(group, dict | FrictionRamp)
                yield table.block(*((group, number) if acts else ()))
            if isinstance(group, FrictionRamp):
                table.ramp = group, 1.0
            jumps = group if isinstance(group, dict) else {}
            goals = [tuple(column.copy() for column in goal) for goal in held]
            for name, event in jumps.items():
                goal = goals[name in COMPONENTS]
                where = ..., int(name == COMPONENTS[1])
                goal[0][where], goal[1][where], goal[2][where] = (
                    _control(type(event)),
                    event.channel_value(name),
                    1.0,
                )
                held[name in COMPONENTS][0][where] = _control(type(event))
            path = [column for goal in goals for column in goal]
            path.append(np.ones(1, dtype=np.int64))
            table.add(
                [*path, self.time[times], self.time[times]], [number], np.empty(0), recorded=False
            )
        table.record(time)

    def _ramp(self, index: int) -> Ramp | None:
        """Return the friction ramp on the path to an event time; None if friction is constant."""
        if not self.friction.ramps(self.time[index : index + 1])[0]:
            return None
        ramp: Any = self.events[self.friction.at(float(self.time[index]))]
        return ramp, float(self.goals[2][2][index])

    def _partial_block(self, index: int, until: float) -> PathBlock:
        """Return the path to the next event time, with the fraction up to a time between the two."""
        table, times = _Table(), slice(index, index + 1)
        time, previous = float(self.time[index]), float(self.previous[index])
        table.ramp = self._ramp(index)
        path = self._paths(times)
        path[PARTS] = np.ones(1, dtype=np.int64)
        table.add(path, [int(self.first[index])], np.empty(0), recorded=False)
        table.record(until)
        return attrs.evolve(table.block(), share=(until - previous) / (time - previous))


def _cursor(done: int, rows: int, time: float, channels: Sequence["LoadChannel"]) -> Cursor:
    return Cursor(done, rows, time, tuple(channel.heading(time) for channel in channels))


def make_cursor(events: Sequence[Event], count: int, substeps: int = 1) -> Cursor | None:
    """Return the cursor of a schedule after a number of events; None if others have the time of the last one."""
    if not 0 < count <= len(events) or (
        count < len(events) and events[count].time == events[count - 1].time
    ):
        return None
    return _cursor(
        count, row_count(events[:count], substeps), events[count - 1].time, list_channels(events)
    )


def row_count(events: Sequence[Event], substeps: int = 1, until: float = math.inf) -> int:
    """Return the number of rows recorded by `paths`."""
    if isinstance(events, SampledLoads) and until == math.inf:
        return events.time.size
    _check(events, substeps)
    times = event_times(events)
    done = times[times <= until]
    between = 0 < done.size < times.size and until > done[-1]
    return (int(np.count_nonzero(np.diff(done))) * substeps + 1 if done.size else 0) + int(between)


def friction_changes(events: Sequence[Event]) -> list[Event]:
    """Return the events that change friction."""
    # items that are not events are refused by the check of their order
    return (
        []
        if are_loads(events)
        else [event for event in events if getattr(event, "changes_friction", False)]
    )


def changes_geometry(events: Sequence[Event]) -> bool:
    """Return True if an event changes heights or radii of summits."""
    return not are_loads(events) and any(
        getattr(event, "changes_geometry", False) for event in events
    )


def event_times(events: Sequence[Event]) -> Floats:
    """Return the times of events [s]."""
    loads = to_loads(events)
    if loads is not None:
        return loads.time
    return np.fromiter((event.time for event in events), dtype=float, count=len(events))


def _sampled_blocks(
    samples: SampledLoads, substeps: int, most_rows: int | None
) -> Iterator[PathBlock]:
    """Yield blocks of sampled loads, each of at most ``most_rows`` samples."""
    check_substeps(substeps)
    size = samples.time.size
    for start in range(0, size, most_rows or max(size, 1)):
        part = slice(start, min(start + (most_rows or size), size))
        time = samples.time[part]
        times = np.append(samples.time[max(start - 1, 0)], time[:-1]), time
        goals = (
            Goals(LOAD, samples.normal_load[part]),
            Goals(DISPLACED, samples.tangential_displacement[part]),
        )
        yield PathBlock(
            straight_paths(*goals, times=times), range(2 * start + 1, 2 * part.stop, 2), time
        )


def _check(events: Sequence[Event], substeps: int) -> None:
    check_sequence(events)
    if not events:
        raise InputError("there are no load events; expected at least one")
    check_substeps(substeps)
    if (steps := len(events) * substeps) > most("STEPS"):
        raise InputError(
            f"substeps is {substeps:,}, which makes {steps:,} steps; {at_most('STEPS')}"
        )


def check_substeps(substeps: int) -> None:
    """Check that the number of rows per interval is an integer of 1 or more; otherwise InputError."""
    if isinstance(substeps, bool) or not isinstance(substeps, int) or substeps < 1:
        raise InputError(f"substeps is {substeps!r}; expected a whole number of 1 or more")


def _joint_paths(
    rest: list[tuple[int, Event, list[str]]],
) -> list[tuple[int, Event | dict[str, LoadEvent]]]:
    """Group events at one time into joint paths; a second event of a channel starts another path."""
    groups: list[tuple[int, Event | dict[str, LoadEvent]]] = []
    for number, event, channels in rest:
        previous = groups[-1][1] if groups else None
        if not isinstance(event, LoadEvent):
            groups.append((number, event))
        elif isinstance(previous, dict) and not previous.keys() & set(channels):
            previous |= dict.fromkeys(channels, event)
        else:
            groups.append((number, dict.fromkeys(channels, event)))
    return groups


def list_channels(events: Sequence[Event]) -> list["LoadChannel"]:
    """Return the channels with their waypoints, in the order of `CHANNELS`; in two directions y is last."""
    loads = to_loads(events)
    channels = []
    if loads is not None:
        where, control = _CHANNEL_OF[loads.kind], _CONTROL_OF[loads.kind]
        for number in range(len(CHANNELS)):
            indices = np.flatnonzero(where == number)
            channels.append(
                LoadChannel(indices, loads.time[indices], loads.value[indices], control[indices])
            )
        return channels
    time, control = event_times(events), np.array([_control(type(event)) for event in events])
    for name in (*CHANNELS, *COMPONENTS[1:]) if is_planar(events) else CHANNELS:
        of_channel = [
            (number, event) for number, event in enumerate(events) if name in event.channels
        ]
        indices = np.array([number for number, _ in of_channel], dtype=np.int64)
        values = [
            event.channel_value(name) if isinstance(event, LoadEvent) else 0.0
            for _, event in of_channel
        ]
        channels.append(
            LoadChannel(indices, time[indices], np.array(values, dtype=float), control[indices])
        )
    return channels


def load_waypoints(events: Sequence[Event]) -> dict[str, "LoadChannel"]:
    """Return the waypoints of each load channel, by its name; tangential y only if events have two directions."""
    normal, along_x, _, *along_y = list_channels(events)
    return dict(zip((CHANNELS[0], *COMPONENTS), (normal, along_x, *along_y), strict=False))


def _control(kind: type[Event]) -> int:
    return DISPLACED if kind in {NormalDisplacement, TangentialDisplacement} else LOAD


# Of each of `KINDS` the number of its channel, and its control.
_CHANNEL_OF = np.array([CHANNELS.index(kind.channel) for kind in KINDS])
_CONTROL_OF = np.array([_control(kind) for kind in KINDS])


@attrs.frozen(eq=False)
class LoadChannel:
    """Waypoints of one channel in the order of time; arrays are (waypoint)."""

    numbers: Integers  #: their indices among the events
    time: Floats
    value: Floats
    control: Integers

    def goals(self, time: Floats, previous: Floats) -> tuple[Integers, Floats, Floats]:
        """Return control, target and remaining fraction of the channel on the paths to event times.

        It arrives at its first waypoint of a time, or is on the line to a later one; it is unloaded
        before its first one, and stays after its last.
        """
        last_index = self.time.size - 1
        none = np.zeros(time.size)
        if last_index < 0:
            return np.full(time.size, LOAD), none, np.zeros(time.size)
        at = np.searchsorted(self.time, time)
        next_index = np.minimum(at, last_index)
        target_time = self.time[next_index]
        arrives = (at > last_index) | (target_time == time)
        remaining = np.divide(
            time - previous, target_time - previous, out=np.ones(time.size), where=~arrives
        )
        waits = (at == 0) & ~arrives
        return (
            np.where(waits, LOAD, self.control[next_index]),
            np.where(waits, none, self.value[next_index]),
            np.where(waits, 0.0, remaining),
        )

    def at(self, time: float) -> int:
        """Return the index of the event that is the first waypoint at a time or later."""
        return int(self.numbers[np.searchsorted(self.time, time)])

    def ramps(self, time: Floats) -> Booleans:
        """Return the times at which friction has ramped."""
        at = np.searchsorted(self.time, time)
        arrives = np.isin(time, self.time)
        ramps: Booleans = (at < self.time.size) & ((at > 0) | arrives)
        return ramps

    def heading(self, time: float) -> int:
        """Return `Cursor.heading` of the channel after a time."""
        passed = int(np.searchsorted(self.time, time, side="right"))
        if passed == 0 or self.time[passed - 1] == time:
            return AT_WAYPOINT
        return BEYOND_LAST if passed == self.time.size else int(self.numbers[passed])


class _Table:
    """Paths of one block that is being scheduled."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin another block."""
        self.columns: list[Sequence[Array]] = []
        self.events: list[int] = []
        self.recorded: list[bool] = []
        self.row_times: list[Floats] = []
        self.ramp: Ramp | None = None

    def add(
        self, columns: Sequence[Array], events: Sequence[int], row_times: Floats, *, recorded: bool
    ) -> None:
        """Add paths: goals of both channels, parts, times at their ends, their events, and the times of their rows."""
        self.columns.append(columns)
        self.events.extend(events)
        self.recorded.extend([recorded] * len(events))
        self.row_times.append(row_times)

    def record(self, time: float) -> None:
        """Record the end of the last path."""
        self.recorded[-1] = True
        self.row_times.append(np.array([time]))

    def block(
        self, change: Event | None = None, change_event: int = -1, cursor: Cursor | None = None
    ) -> PathBlock:
        """Return the block of the paths so far, and start another one."""
        columns = [np.concatenate(column) for column in zip(*self.columns, strict=True)]
        goals = Goals(*columns[:3]), Goals(*columns[3:PARTS])
        paths = straight_paths(
            *goals, parts=columns[PARTS], recorded=self.recorded, times=(columns[-2], columns[-1])
        )
        ramp, ramp_part = self.ramp or (None, 1.0)
        times, events = np.concatenate(self.row_times), self.events
        self.clear()
        return PathBlock(paths, events, times, change, change_event, ramp, ramp_part, cursor)
