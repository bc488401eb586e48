"""From load events to straight paths: what is walked, in which order, and when a row is recorded."""

import itertools
from collections.abc import Iterator, Sequence

import attrs
import numpy as np
import numpy.typing as npt

from historysim.errors import InputError
from historysim.events import (
    Event,
    FrictionChange,
    LoadEvent,
    NormalDisplacement,
    TangentialDisplacement,
    check_sequence,
)
from historysim.memory import kernel

Goal = tuple[int, float, float]
"""Control of a channel, its target in N or m, and the fraction of the way left to go."""


@attrs.frozen
class Stretch:
    """Paths between changes of friction, and the change that ends them.

    Attributes
    ----------
    paths : kernel.Paths
        With targets in N and m.
    event : list (path)
        Index of an event that each path serves, the tangential one where there is one.
    row_time : array (row)
        Times of the rows that the paths record [s].
    friction : FrictionChange, optional
        Acts at the end of the last path.
    friction_event : int
        Its index.
    """

    paths: kernel.Paths
    event: list[int]
    row_time: npt.NDArray[np.float64]
    friction: FrictionChange | None = None
    friction_event: int = -1


def stretches(events: Sequence[Event], substeps: int = 1, most_rows: int | None = None) -> Iterator[Stretch]:
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
        Break stretches so that none records many more rows than this.

    Raises
    ------
    InputError
        Events that are not events, not in order, or none; substeps below 1.
    """
    check_sequence(events)
    if not events:
        raise InputError("there are no load events; expected at least one")
    if isinstance(substeps, bool) or not isinstance(substeps, int) or substeps < 1:
        raise InputError(f"substeps is {substeps!r}; expected a whole number of 1 or more")
    normal, tangential = _Channel(events, "normal"), _Channel(events, "tangential")
    table = _Table()
    previous = None
    for time, numbered in itertools.groupby(enumerate(events), key=lambda pair: pair[1].time):
        present = list(numbered)
        arriving = [_first(present, "normal"), _first(present, "tangential")]
        # a change of friction acts after both channels have arrived
        rest = _joint([pair for pair in present if pair not in arriving])
        served = next((pair[0] for pair in reversed(arriving) if pair), present[0][0])
        inner: list[float] = (
            [] if previous is None else [previous + (time - previous) * k / substeps for k in range(1, substeps)]
        )
        table.add(normal.arrive(time, previous), tangential.arrive(time, previous), served, inner)
        for number, group in rest:
            if isinstance(group, FrictionChange):
                yield table.stretch(group, number)
                table = _Table()
                # the path on which a controlled load is restored
                table.add(normal.stay(), tangential.stay(), number)
            else:
                table.add(normal.jump(group), tangential.jump(group), number)
        table.record(time)
        if most_rows is not None and len(table.row_times) >= most_rows:
            yield table.stretch()
            table = _Table()
        previous = time
    if table.paths:
        yield table.stretch()


def _first(present: list[tuple[int, Event]], channel: str) -> tuple[int, Event] | None:
    return next((pair for pair in present if isinstance(pair[1], LoadEvent) and pair[1].channel == channel), None)


def _joint(rest: list[tuple[int, Event]]) -> list[tuple[int, FrictionChange | dict[str, LoadEvent]]]:
    """Gather events at one time into joint paths: a channel's second event starts another."""
    groups: list[tuple[int, FrictionChange | dict[str, LoadEvent]]] = []
    for number, event in rest:
        last = groups[-1][1] if groups else None
        if isinstance(event, FrictionChange):
            groups.append((number, event))
        elif isinstance(last, dict) and event.channel not in last:
            last[event.channel] = event
        else:
            groups.append((number, {event.channel: event}))
    return groups


class _Channel:
    """One channel's waypoints, and which of them it has passed."""

    def __init__(self, events: Sequence[Event], name: str) -> None:
        self.name = name
        self.waypoints = [event for event in events if isinstance(event, LoadEvent) and event.channel == name]
        self.passed = 0
        self.control = kernel.LOAD

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

    def stay(self) -> Goal:
        """Hold what the channel has reached, as it was controlled on the way there; unloaded before it started."""
        return self.control, *kernel.STILL


def _control(event: LoadEvent) -> int:
    return kernel.DISPLACED if isinstance(event, NormalDisplacement | TangentialDisplacement) else kernel.LOAD


class _Table:
    """Paths of one stretch, as they are scheduled."""

    def __init__(self) -> None:
        self.paths: list[tuple[float, ...]] = []
        self.events: list[int] = []
        self.first_rows: list[int] = []
        self.recorded: list[bool] = []
        self.row_times: list[float] = []

    def add(self, normal: Goal, tangential: Goal, event: int, inner_times: Sequence[float] = ()) -> None:
        self.paths.append((*normal, *tangential, len(inner_times) + 1))
        self.events.append(event)
        self.first_rows.append(len(self.row_times))
        self.recorded.append(False)
        self.row_times.extend(inner_times)

    def record(self, time: float) -> None:
        """Record the end of the last path."""
        self.recorded[-1] = True
        self.row_times.append(time)

    def stretch(self, friction: FrictionChange | None = None, friction_event: int = -1) -> Stretch:
        columns = [np.array(column) for column in zip(*self.paths, strict=True)]
        paths = kernel.Paths(
            normal_control=columns[0].astype(np.int8),
            normal_target=columns[1],
            normal_fraction=columns[2],
            tangential_control=columns[3].astype(np.int8),
            tangential_target=columns[4],
            tangential_fraction=columns[5],
            parts=columns[6].astype(np.int64),
            recorded=np.array(self.recorded, dtype=np.int8),
            first_row=np.array(self.first_rows, dtype=np.int64),
        )
        return Stretch(paths, self.events, np.array(self.row_times), friction, friction_event)
