"""``[loading]`` written out in the scenario: waypoints and blocks of waypoints."""

import abc
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self, cast

import attrs

from historysim.basics.fields import NOT_NEGATIVE, Time
from historysim.basics.wording import Notify, format_value, silent
from historysim.errors import InputError, error_path, field_error, path_text
from historysim.loads.events import EVENTS, LOAD_KINDS, Event, TangentialEvent, tangential_channels
from historysim.loads.holding import Timeline, find_ramp
from historysim.scenario.loading_kinds import LOADINGS, Loading
from historysim.scenario.schema import with_kinds

# by the names of events: their fields without the time, or the event
Changes = dict[str, "Event | tuple[Any, ...]"]
Place = tuple[str | int, ...]
MOST_EVENTS = 10_000_000


@attrs.frozen
class Waypoint:
    """Values of channels at a time, or at a time after the previous waypoint, and changes of friction or geometry then.

    Examples
    --------
    [loading]
    hold = true
    waypoints = [
        { time = 0, normal_load = "50 mN" },
        { after = "1 s", tangential_load = "3 mN", name = "K" },
    ]
    """

    event_keys: ClassVar = ("changes", EVENTS)

    time: Time | None = None  #: time; or ``after``
    #: time since the previous waypoint
    after: Time | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    asperities: tuple[int, ...] | None = None  #: asperities whose friction changes; by default all
    name: str | None = None  #: label of the state, for pictures and ``--step``
    changes: Changes = attrs.Factory(dict)

    def __attrs_post_init__(self) -> None:
        """Check that it has one time and at least one value."""
        if (self.time is None) == (self.after is None):
            problem = "neither time nor after" if self.time is None else "both time and after"
            raise InputError(
                f"{problem}; expected either the time itself, or the time after the previous waypoint"
            )
        _check_channels(self.changes)
        if self.asperities is not None and "friction" not in self.changes:
            raise field_error(
                "given without friction; expected both, or asperities in geometry", "asperities"
            )
        if not self.changes:
            raise InputError(f"no value; expected one or more of {', '.join(EVENTS.own())}")

    @classmethod
    def from_toml(cls, value: object) -> Self:
        """Structure a waypoint from a table, whose other keys are names of events."""
        waypoint = with_kinds(cls, value)
        change = waypoint.changes.get("friction")
        if waypoint.asperities is not None and isinstance(change, tuple):
            waypoint = attrs.evolve(
                waypoint, changes={**waypoint.changes, "friction": (*change, waypoint.asperities)}
            )
        return waypoint


def _check_channels(changes: Mapping[str, Any]) -> None:
    """Check that each channel is controlled once; InputError for a load and a displacement of one channel."""
    controlled: dict[str, str] = {}
    for key, change in changes.items():
        kind = EVENTS[key]
        channels: tuple[str, ...] = () if kind.channel is None else (kind.channel,)
        if isinstance(change, Event):
            channels = change.channels
        elif issubclass(kind, TangentialEvent):
            channels = tangential_channels(change[0])
        for channel in channels:
            if (earlier := controlled.setdefault(channel, key)) != key:
                hint = (
                    ", or each in another direction, as { x = … } and { y = … }"
                    if kind.channel == "tangential"
                    else ""
                )
                raise InputError(
                    f"{earlier} and {key} together; expected one of them{hint}: the other follows from it"
                )


@attrs.define
class LocatedTimeline(Timeline):
    """Events of a scenario in time order, with their keys in the scenario."""

    #: Whether channels keep their values at waypoints that do not set them; None if the scenario
    #: does not state it.
    holds: bool | None = None
    now: float = 0.0  #: time of the last waypoint [s]
    locations: list[Place] = attrs.Factory(list)  #: key of each event

    def reach(self, time: float, changes: Changes, *path: str | int) -> None:
        """Append an event for each change at a time."""
        for key, change in changes.items():
            with error_path(key):
                timed = (
                    attrs.evolve(cast("Any", change), time=time)
                    if isinstance(change, Event)
                    else None
                )
                event = EVENTS[key].from_contents(time, change) if timed is None else timed  # type: ignore[arg-type] # fields
            self.append(event)
        self.now = time
        if self.holds:
            self.hold(time)
        self._append_locations(path)

    def hold_channels(self, *path: str | int) -> None:
        """Hold all channels until the last waypoint."""
        self.hold(self.now)
        self._append_locations(path)

    def _append_locations(self, path: Place) -> None:
        self.locations += [path] * (len(self.events) - len(self.locations))

    def warn_of_ramp(self, notify: Notify) -> None:
        """Notify of a channel that ramps through waypoints that do not set it, unless ``hold`` is stated."""
        if self.holds is None and (ramp := find_ramp(self.events)) is not None:
            location = path_text(self.locations[ramp.passed])
            notify(ramp.notice(location, "loading.hold = true", "hold = false"))


@attrs.frozen(kw_only=True)
class InlineLoading(Loading):
    """Base class of loadings written out in the scenario."""

    hold: bool | None = None  #: whether a channel is held at waypoints that do not set it

    @classmethod
    def hint_for_key(cls, key: str) -> str:
        """Suggest a waypoint for the key of a channel; empty for other keys."""
        return (
            f"expected it in a waypoint, as {{ time = 0, {key} = … }}" if key in LOAD_KINDS else ""
        )

    @abc.abstractmethod
    def timeline(self) -> LocatedTimeline:
        """Build the events with their locations."""

    def events(self, folder: Path, notify: Notify = silent) -> list[Event]:  # noqa: ARG002 - no file needed
        """Build the events; ``notify`` receives a notice of a channel that ramps through waypoints without it."""
        line = self.timeline()
        line.warn_of_ramp(notify)
        return line.events

    def place(self, folder: Path, index: int) -> str:  # noqa: ARG002 - as for `events`
        """Return the key of the waypoint of an event."""
        return path_text(self.timeline().locations[index])


@LOADINGS.register
@attrs.frozen(kw_only=True)
class Waypoints(InlineLoading):
    """``loading.waypoints``: values of channels at given times."""

    kind = "waypoints"

    waypoints: tuple[Waypoint, ...]  #: values at given times, as below

    def __attrs_post_init__(self) -> None:
        """Check that names differ."""
        super().__attrs_post_init__()
        names = [waypoint.name for waypoint in self.waypoints]
        for index, name in enumerate(names):
            if name is not None and name in names[:index]:
                raise field_error(
                    f"{format_value(name)} is used before; expected a unique name",
                    "waypoints",
                    index,
                    "name",
                )

    @property
    def names(self) -> dict[str, float]:
        """The times [s] of waypoints that have a name."""
        time, times = 0.0, dict[str, float]()
        for waypoint in self.waypoints:
            time = time + (waypoint.after or 0.0) if waypoint.time is None else waypoint.time
            if waypoint.name is not None:
                times[waypoint.name] = time
        return times

    def timeline(self) -> LocatedTimeline:
        """Build the events with their locations."""
        line = LocatedTimeline(holds=self.hold)
        for index, waypoint in enumerate(self.waypoints):
            with error_path("loading", "waypoints", index):
                time = line.now + waypoint.after if waypoint.time is None else waypoint.time  # type: ignore[operator]
                if line.events and time < line.now:
                    raise field_error(
                        f"{time:g} s comes after {line.now:g} s; expected times that do not decrease",
                        "time",
                    )
                line.reach(time, waypoint.changes, "loading", "waypoints", index)
        return line


@attrs.frozen
class Each:
    """Arrays of values to reach in sequence, by the keys of a waypoint with one value, such as ``normal_load``.

    The waypoints of the block run at each value.
    """

    event_keys: ClassVar = ("values", EVENTS)

    after: Time = attrs.field(validator=NOT_NEGATIVE)  #: time to reach each value
    values: Mapping[str, tuple[Any, ...]] = attrs.Factory(dict)

    def __attrs_post_init__(self) -> None:
        """Check that there are values, and as many for each key."""
        for values in zip(*self.values.values(), strict=False):
            _check_channels({key: (value,) for key, value in zip(self.values, values, strict=True)})
        lengths = {key: len(value) for key, value in self.values.items()}
        if not lengths or 0 in lengths.values() or len(set(lengths.values())) > 1:
            counts = ", ".join(f"{count} of {key}" for key, count in lengths.items())
            names = ", ".join(
                name
                for name, kind in EVENTS.own().items()
                if len(attrs.fields(cast("Any", kind))) < 4
            )
            raise InputError(
                f"{counts or 'no'} values; expected arrays of one length, of one or more of {names}"
            )

    @classmethod
    def from_toml(cls, value: object) -> Self:
        """Structure the values from a table, whose other keys are names of events."""
        return with_kinds(cls, value, in_turn=True)

    @property
    def turns(self) -> list[Changes]:
        """Values of each turn."""
        return [
            {key: (values[turn],) for key, values in self.values.items()}
            for turn in range(self.count)
        ]

    @property
    def count(self) -> int:
        """Number of values."""
        return len(next(iter(self.values.values())))


@attrs.frozen
class WaypointBlock:
    """Waypoints to repeat, optionally at each of several values.

    Examples
    --------
    [[loading.blocks]]
    each = { after = "2 s", normal_load = ["50 mN", "70 mN"] }
    repeat = 4
    waypoints = [
        { after = "4 s", tangential_displacement = "100 nm" },
        { after = "8 s", tangential_displacement = "-100 nm" },
        { after = "4 s", tangential_displacement = 0 },
    ]
    """

    #: Waypoints with ``after``. A channel that the block does not set is held.
    waypoints: tuple[Waypoint, ...]
    repeat: int = 1  #: number of repetitions
    #: values to reach first, in sequence, as below; the waypoints run at each of them
    each: Each | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it can be repeated."""
        if not self.waypoints:
            raise field_error("none; expected one or more", "waypoints")
        for index, waypoint in enumerate(self.waypoints):
            with error_path("waypoints", index):
                if waypoint.after is None:
                    raise field_error(
                        "the time of a block follows from the blocks before it; expected after instead",
                        "time",
                    )
                if waypoint.name is not None:
                    raise field_error(
                        "a block may run several times; expected names only in loading.waypoints",
                        "name",
                    )
        if self.repeat < 1:
            raise field_error(
                f"{format_value(self.repeat)}; expected an integer of 1 or more", "repeat"
            )

    def count(self) -> int:
        """Return its number of events, without the few that hold channels."""
        turns = self.each.count if self.each else 1
        return turns * (1 + self.repeat * sum(len(waypoint.changes) for waypoint in self.waypoints))

    def extend(self, line: LocatedTimeline, *path: str | int) -> None:
        """Append the events of the block, with its path in the scenario."""
        run = [(waypoint.after or 0.0, waypoint.changes) for waypoint in self.waypoints]
        for turn in self.each.turns if self.each else [{}]:
            # a channel without an event here would ramp to its next waypoint during all loops
            line.hold_channels(*path)
            if self.each:
                with error_path("each"):
                    line.reach(line.now + self.each.after, turn, *path, "each")
                line.hold_channels(*path, "each")
            for _ in range(self.repeat):
                for index, (after, changes) in enumerate(run):
                    with error_path("waypoints", index):
                        line.reach(line.now + after, changes, *path, "waypoints", index)


@LOADINGS.register
@attrs.frozen(kw_only=True)
class Blocks(InlineLoading):
    """``[[loading.blocks]]``: blocks of waypoints, in sequence."""

    kind = "blocks"

    blocks: tuple[WaypointBlock, ...]  #: blocks of waypoints, in sequence, as below

    def timeline(self) -> LocatedTimeline:
        """Build the events with their locations."""
        return build_timeline(self.blocks, hold=self.hold)


def build_timeline(blocks: Sequence[WaypointBlock], *, hold: bool | None = None) -> LocatedTimeline:
    """Build the events of blocks with their locations; InputError if there are too many."""
    count = sum(block.count() for block in blocks)
    if count > MOST_EVENTS:
        problem = (
            f"{format_value(count)} events; expected {MOST_EVENTS:,} at most; repeat less often"
        )
        raise field_error(problem, "loading", "blocks")
    line = LocatedTimeline(holds=hold)
    for index, block in enumerate(blocks):
        with error_path("loading", "blocks", index):
            block.extend(line, "loading", "blocks", index)
    return line
