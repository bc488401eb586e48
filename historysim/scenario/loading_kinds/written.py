"""``[loading]`` that is written out in the scenario: waypoints, and blocks of them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import attrs

from historysim.basics.places import at, misfit
from historysim.basics.wording import shown
from historysim.errors import InputError
from historysim.loads.events import EVENT_KINDS, Event, LoadEvent
from historysim.scenario.loading_kinds.base import Loading, one_of_each
from historysim.scenario.schema import Force, Length, Numbers, Quantity, Time

MOST_EVENTS = 10_000_000


@attrs.frozen
class Waypoint:
    """What the channels have reached at a time, or some time after the waypoint before it."""

    time: Time | None = None
    after: Time | None = None
    normal_load: Force | None = None
    normal_displacement: Length | None = None
    tangential_load: Force | None = None
    tangential_displacement: Length | None = None
    friction: Numbers | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it has one time, and something to reach."""
        if (self.time is None) == (self.after is None):
            given = "neither time nor after" if self.time is None else "both time and after"
            raise InputError(f"{given}; expected either the time itself, or the time after the waypoint before it")
        if self.after is not None and self.after < 0:
            raise misfit(f"{self.after:g} s; expected 0 s or more", "after")
        one_of_each(self)
        if not self.changes:
            raise InputError(f"nothing to reach; expected one or more of {', '.join(EVENT_KINDS)}")

    @property
    def changes(self) -> dict[str, Any]:
        """What is reached, by the name of its key."""
        return {key: value for key in EVENT_KINDS if (value := getattr(self, key)) is not None}


@attrs.define
class _Timeline:
    """Events in time order; knows where each channel stands."""

    now: float = 0.0
    events: list[Event] = attrs.Factory(list)
    standing: dict[str, LoadEvent] = attrs.Factory(dict)

    def reach(self, time: float, changes: Mapping[str, Any]) -> None:
        for key, value in changes.items():
            with at(key):
                event = EVENT_KINDS[key](time, value)
            self.events.append(event)
            if isinstance(event, LoadEvent):
                self.standing[event.channel] = event
        self.now = time

    def hold(self) -> None:
        """Let every channel stay where it stands until now."""
        for channel, event in self.standing.items():
            if event.time < self.now:
                held = attrs.evolve(event, time=self.now)
                self.events.append(held)
                self.standing[channel] = held


@attrs.frozen(kw_only=True)
class Waypoints(Loading):
    """``loading.waypoints``: what is reached, and when."""

    waypoints: tuple[Waypoint, ...]

    def events(self, folder: Path) -> list[Event]:  # noqa: ARG002 - they are in the scenario itself
        """Return the events."""
        line = _Timeline()
        for index, waypoint in enumerate(self.waypoints):
            with at("loading", "waypoints", index):
                time = line.now + waypoint.after if waypoint.time is None else waypoint.time  # type: ignore[operator]
                if line.events and time < line.now:
                    raise misfit(f"{time:g} s comes after {line.now:g} s; expected times that do not decrease", "time")
                line.reach(time, waypoint.changes)
        return line.events


@attrs.frozen
class Each:
    """Values to reach in turn; the waypoints of the block run at each of them."""

    after: Time
    normal_load: Annotated[tuple[float, ...], Quantity("N")] | None = None
    normal_displacement: Annotated[tuple[float, ...], Quantity("m")] | None = None
    tangential_load: Annotated[tuple[float, ...], Quantity("N")] | None = None
    tangential_displacement: Annotated[tuple[float, ...], Quantity("m")] | None = None
    friction: Annotated[tuple[float, ...], Quantity("1")] | None = None

    def __attrs_post_init__(self) -> None:
        """Check that there are values, as many of one as of the other."""
        if self.after < 0:
            raise misfit(f"{self.after:g} s; expected 0 s or more", "after")
        one_of_each(self)
        lengths = {key: len(value) for key in EVENT_KINDS if (value := getattr(self, key)) is not None}
        if not lengths or 0 in lengths.values() or len(set(lengths.values())) > 1:
            counted = ", ".join(f"{count} of {key}" for key, count in lengths.items())
            raise InputError(
                f"{counted or 'no'} values; expected arrays of one length, of one or more of {', '.join(EVENT_KINDS)}"
            )

    @property
    def turns(self) -> list[dict[str, Any]]:
        """What is reached in each turn."""
        keys = [key for key in EVENT_KINDS if getattr(self, key) is not None]
        return [
            dict(zip(keys, values, strict=True)) for values in zip(*(getattr(self, key) for key in keys), strict=True)
        ]


@attrs.frozen
class Block:
    """Waypoints to run, some number of times, at each of some values."""

    waypoints: tuple[Waypoint, ...]
    repeat: int = 1
    each: Each | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it can be run more than once."""
        if not self.waypoints:
            raise misfit("none; expected one or more", "waypoints")
        for index, waypoint in enumerate(self.waypoints):
            if waypoint.after is None:
                problem = "a block runs at its place among the others; expected after instead"
                raise misfit(problem, "waypoints", index, "time")
        if self.repeat < 1:
            raise misfit(f"{shown(self.repeat)}; expected an integer of 1 or more", "repeat")

    def count(self) -> int:
        """Return how many events it makes, not counting the few that hold the channels in place."""
        return len(self.turns) * (1 + self.repeat * sum(len(waypoint.changes) for waypoint in self.waypoints))

    @property
    def turns(self) -> Sequence[dict[str, Any]]:
        """What is reached before each run of the repeated waypoints."""
        return self.each.turns if self.each else [{}]

    def extend(self, line: _Timeline) -> None:
        """Append the block's events.

        Channels that the block does not name stay where they stand: without an event at its beginning
        they would run straight from their last waypoint to their next one, across all the loops.
        """
        run = [(waypoint.after or 0.0, waypoint.changes) for waypoint in self.waypoints]
        for turn in self.turns:
            line.hold()
            if self.each:
                with at("each"):
                    line.reach(line.now + self.each.after, turn)
                line.hold()
            for _ in range(self.repeat):
                for index, (after, changes) in enumerate(run):
                    with at("waypoints", index):
                        line.reach(line.now + after, changes)


@attrs.frozen(kw_only=True)
class Blocks(Loading):
    """``[[loading.blocks]]``: runs of waypoints, one after the other."""

    blocks: tuple[Block, ...]

    def events(self, folder: Path) -> list[Event]:  # noqa: ARG002 - they are in the scenario itself
        """Return the events."""
        count = sum(block.count() for block in self.blocks)
        if count > MOST_EVENTS:
            problem = f"{shown(count)} events; expected {MOST_EVENTS:,} at most; repeat less often"
            raise misfit(problem, "loading", "blocks")
        line = _Timeline()
        for index, block in enumerate(self.blocks):
            with at("loading", "blocks", index):
                block.extend(line)
        return line.events
