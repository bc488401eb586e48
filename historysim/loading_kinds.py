"""The kinds of ``[loading]`` in a scenario: waypoints, blocks of them, or a measured file, and the events they make."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import attrs
from cattrs import Converter

from historysim.errors import InputError
from historysim.events import (
    Event,
    FrictionChange,
    LoadEvent,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)
from historysim.schema import Force, Length, Numbers, Quantity, Time, at, given, misfit, shown, table
from historysim.tables import Column, NumbersFile

MOST_EVENTS = 10_000_000
MOST_STEPS = 100_000_000

LOADS: Mapping[str, type[LoadEvent]] = {
    "normal_load": NormalLoad,
    "normal_displacement": NormalDisplacement,
    "tangential_load": TangentialLoad,
    "tangential_displacement": TangentialDisplacement,
}
CHANGES: Mapping[str, Callable[[float, Any], Event]] = {**LOADS, "friction": FrictionChange}


def _one_of_each(self: object) -> None:
    for channel in ("normal", "tangential"):
        if all(getattr(self, f"{channel}_{kind}") is not None for kind in ("load", "displacement")):
            raise InputError(
                f"{channel}_load and {channel}_displacement together; expected one of them: the other is its answer"
            )


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
        _one_of_each(self)
        if not self.changes:
            raise InputError(f"nothing to reach; expected one or more of {', '.join(CHANGES)}")

    @property
    def changes(self) -> dict[str, Any]:
        """What is reached, by the name of its key."""
        return {key: value for key in CHANGES if (value := getattr(self, key)) is not None}


@attrs.define
class _Timeline:
    """Events in time order; knows where each channel stands."""

    now: float = 0.0
    events: list[Event] = attrs.Factory(list)
    standing: dict[str, LoadEvent] = attrs.Factory(dict)

    def reach(self, time: float, changes: Mapping[str, Any]) -> None:
        for key, value in changes.items():
            with at(key):
                event = CHANGES[key](time, value)
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
class Loading:
    """What every kind of loading has."""

    substeps: int = 1
    saturate: bool = False

    def __attrs_post_init__(self) -> None:
        """Check the substeps."""
        if not 1 <= self.substeps <= MOST_STEPS:
            raise misfit(f"{shown(self.substeps)}; expected an integer from 1 to {MOST_STEPS:,}", "substeps")


@attrs.frozen(kw_only=True)
class Waypoints(Loading):
    """``loading.waypoints``: what is reached, and when."""

    waypoints: tuple[Waypoint, ...]

    def events(self, folder: Path) -> list[Event]:  # noqa: ARG002 - they are in the scenario itself
        """Build the events."""
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
        _one_of_each(self)
        lengths = {key: len(value) for key in CHANGES if (value := getattr(self, key)) is not None}
        if not lengths or 0 in lengths.values() or len(set(lengths.values())) > 1:
            counted = ", ".join(f"{count} of {key}" for key, count in lengths.items())
            raise InputError(
                f"{counted or 'no'} values; expected arrays of one length, of one or more of {', '.join(CHANGES)}"
            )

    @property
    def turns(self) -> list[dict[str, Any]]:
        """What is reached in each turn."""
        keys = [key for key in CHANGES if getattr(self, key) is not None]
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
        """How many events it makes, not counting the few that hold the channels in place."""
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
        """Build the events."""
        count = sum(block.count() for block in self.blocks)
        if count > MOST_EVENTS:
            problem = f"{shown(count)} events; expected {MOST_EVENTS:,} at most; repeat less often"
            raise misfit(problem, "loading", "blocks")
        line = _Timeline()
        for index, block in enumerate(self.blocks):
            with at("loading", "blocks", index):
                block.extend(line)
        return line.events


@attrs.frozen
class LoadColumns:
    """Which column of a measured sequence holds what."""

    time: Column
    normal_load: Column | None = None
    normal_displacement: Column | None = None
    tangential_load: Column | None = None
    tangential_displacement: Column | None = None

    def __attrs_post_init__(self) -> None:
        """Check that there is a load."""
        _one_of_each(self)
        if len(given(self)) == 1:
            raise InputError(f"only time; expected one or more of {', '.join(LOADS)}")


@attrs.frozen(kw_only=True)
class Measured(NumbersFile, Loading):
    """``loading.file``: a file in which every sample is a waypoint."""

    columns: LoadColumns

    def events(self, folder: Path) -> list[Event]:
        """Read the events."""
        units = {"time": "s"} | {key: kind.unit for key, kind in LOADS.items()}
        with at("loading"):
            found = self.table(folder, given(self.columns), units)
            times, *channels = (found.columns[key].tolist() for key in given(self.columns))
            kinds = [LOADS[key] for key in given(self.columns) if key != "time"]
            events: list[Event] = []
            previous = times[0]
            for row, (time, *sample) in enumerate(zip(times, *channels, strict=True)):
                if time < previous:
                    problem = f"the time {time:g} s comes after {previous:g} s; expected times that do not decrease"
                    raise misfit(f"{self.file}: {found.place(row)}: {problem}", "file")
                previous = time
                try:
                    events.extend([kind(time, value) for kind, value in zip(kinds, sample, strict=True)])
                except InputError as error:
                    raise misfit(f"{self.file}: {found.place(row)}: {error}", "file") from error
        return events


AnyLoading = Waypoints | Blocks | Measured
LOADINGS: Mapping[str, type] = {"waypoints": Waypoints, "blocks": Blocks, "file": Measured}


def loading_from_toml(converter: Converter, value: object, _: object) -> AnyLoading:
    """Structure ``[loading]``.

    Raises
    ------
    InputError
        Not exactly one kind of loading, or keys that do not fit it.
    """
    entry = table(value)
    given = [key for key in LOADINGS if key in entry]
    if len(given) != 1:
        found = " and ".join(given) or ", ".join(repr(key) for key in entry) or "nothing"
        raise InputError(f"{found} given; expected exactly one of waypoints, blocks and file")
    loading: AnyLoading = converter.structure(entry, LOADINGS[given[0]])
    return loading
