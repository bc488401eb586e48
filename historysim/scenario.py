"""A scenario: materials, surface, friction, loading and what to record, from one TOML file.

Numbers are SI; texts may carry units. Relative paths are relative to the scenario file. The sections
build the same objects that a program would: an ``Ensemble`` and a list of events.
"""

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import eq
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

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
from historysim.schema import (
    Force,
    Length,
    Lengths,
    Number,
    Numbers,
    Pressure,
    Quantity,
    SurfaceEnergy,
    Time,
    at,
    misfit,
    nearest,
    reported,
    schema_converter,
    shown,
    table,
    text,
)
from historysim.tables import Characters, Column, Format, Table, column_from_toml, read_table

if TYPE_CHECKING:
    from historysim.ensemble import Ensemble
    from historysim.materials import Material, MaterialPair

MOST_EVENTS = 10_000_000
MOST_STEPS = 100_000_000

LOADS: Mapping[str, type[LoadEvent]] = {
    "normal_load": NormalLoad,
    "normal_displacement": NormalDisplacement,
    "tangential_load": TangentialLoad,
    "tangential_displacement": TangentialDisplacement,
}
CHANGES: Mapping[str, Callable[[float, Any], Event]] = {**LOADS, "friction": FrictionChange}


def _given(section: Any) -> dict[str, Any]:
    """Give the keys of a section that stand in the file, with their values."""
    return {key: value for key, value in attrs.asdict(section, recurse=False).items() if value is not None}


# -- materials -------------------------------------------------------------------------------------


@attrs.frozen
class MaterialTable:
    """A material that is not built in."""

    name: str
    youngs_modulus: Pressure
    poissons_ratio: Number
    shear_modulus: Pressure | None = None
    surface_energy: SurfaceEnergy | None = None


MaterialEntry = str | MaterialTable


@attrs.frozen
class Materials:
    """``[materials]``: two materials, or the moduli of the pair."""

    first: MaterialEntry | None = None
    second: MaterialEntry | None = None
    contact_modulus: Pressure | None = None
    shear_modulus: Pressure | None = None

    def __attrs_post_init__(self) -> None:
        """Check that the pair is given in one way, and fully."""
        given = _given(self)
        if set(given) not in ({"first", "second"}, {"contact_modulus", "shear_modulus"}):
            raise InputError(
                f"{' and '.join(given) or 'nothing'} given; expected either first and second, or contact_modulus and "
                "shear_modulus"
            )

    def pair(self) -> "MaterialPair":
        """Build the material pair."""
        from historysim.materials import MaterialPair

        if self.contact_modulus is not None and self.shear_modulus is not None:
            with at("materials"):
                return MaterialPair.from_moduli(contact_modulus=self.contact_modulus, shear_modulus=self.shear_modulus)
        first, second = _material("first", self.first), _material("second", self.second)
        with at("materials"):
            return MaterialPair(first, second)


def _material(key: str, entry: MaterialEntry | None) -> "Material":
    from historysim.materials import Material, material

    with at("materials", key):
        if isinstance(entry, MaterialTable):
            return Material(**_given(entry))
        return material(str(entry))


# -- surfaces --------------------------------------------------------------------------------------


class Surface(Protocol):
    """``[surface]``: one class for each kind; a new kind is a new class in ``SURFACES``."""

    def summits(self, folder: Path) -> dict[str, Any]:
        """Give the arguments that the Ensemble takes from the surface, and ``friction`` if it has its own."""


@attrs.frozen
class Sphere:
    """One spherical asperity."""

    radius: Length

    def summits(self, folder: Path) -> dict[str, Any]:  # noqa: ARG002 - a sphere needs no file
        """Give one summit at height 0."""
        return {"summit_height": 0.0, "summit_radius": self.radius}


@attrs.frozen
class InlineSummits:
    """Summits written out in the scenario; a single radius stands for all."""

    height: Lengths
    radius: Lengths
    x: Lengths | None = None
    y: Lengths | None = None

    def summits(self, folder: Path) -> dict[str, Any]:  # noqa: ARG002 - they are in the scenario itself
        """Give the summits."""
        return {"summit_height": self.height, "summit_radius": self.radius, "x": self.x, "y": self.y}


@attrs.frozen
class SummitColumns:
    """Which column of the summit table holds what."""

    height: Column
    radius: Column
    x: Column | None = None
    y: Column | None = None
    friction: Column | None = None


@attrs.frozen(kw_only=True, slots=False)
class NumbersFile(Format):
    """A file of numbers, and how it is written."""

    file: str

    def table(self, folder: Path, columns: object, units: Mapping[str, str]) -> Table:
        """Read columns out of it."""
        return read_table(folder / self.file, _given(columns), units, self)


@attrs.frozen(kw_only=True)
class SummitTable(NumbersFile):
    """Summits from a file."""

    columns: SummitColumns

    def summits(self, folder: Path) -> dict[str, Any]:
        """Read the summits."""
        units = {"height": "m", "radius": "m", "x": "m", "y": "m", "friction": "1"}
        with at("surface"):
            found = self.table(folder, self.columns, units).columns
        names = {"height": "summit_height", "radius": "summit_radius"}
        return {names.get(key, key): values for key, values in found.items()}


def _sphere_or_summits(entry: Mapping[str, Any]) -> type:
    return SummitTable if "file" in entry else InlineSummits


SURFACES: Mapping[str, Callable[[Mapping[str, Any]], type]] = {
    "sphere": lambda _: Sphere,
    "summits": _sphere_or_summits,
}


@attrs.frozen
class Friction:
    """``[friction]``: one coefficient, or one for each asperity."""

    coefficient: Numbers


# -- loading ---------------------------------------------------------------------------------------


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
        if len(_given(self)) == 1:
            raise InputError(f"only time; expected one or more of {', '.join(LOADS)}")


@attrs.frozen(kw_only=True)
class Measured(Loading, NumbersFile):
    """``loading.file``: a file in which every sample is a waypoint."""

    columns: LoadColumns

    def events(self, folder: Path) -> list[Event]:
        """Read the events."""
        units = {"time": "s"} | {key: kind.unit for key, kind in LOADS.items()}
        with at("loading"):
            found = self.table(folder, self.columns, units)
            times, *channels = (found.columns[key].tolist() for key in _given(self.columns))
            kinds = [LOADS[key] for key in _given(self.columns) if key != "time"]
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


# -- the whole -------------------------------------------------------------------------------------


RECORDS = ("touching", "all", "totals")


@attrs.frozen
class Record:
    """``[record]``: the asperities that are written out one by one."""

    asperities: str | tuple[int, ...] = "touching"


@attrs.frozen
class Sections:
    """A scenario file, section by section."""

    materials: Materials
    surface: Surface
    loading: AnyLoading
    friction: Friction | None = None
    record: Record = Record()
    title: str = ""


@attrs.frozen
class Scenario:
    """A scenario and the file that it came from.

    Attributes
    ----------
    path : Path
        The file.
    text : str
        What stands in the file (TOML).
    sections : Sections
        What that means.
    """

    path: Path
    text: str = attrs.field(repr=False)
    sections: Sections

    @property
    def title(self) -> str:
        """The title, empty if it has none."""
        return self.sections.title

    @property
    def substeps(self) -> int:
        """The number of steps that each stretch between two event times is divided into."""
        return self.sections.loading.substeps

    @property
    def saturate(self) -> bool:
        """Whether a tangential load beyond the limit is held at the limit."""
        return self.sections.loading.saturate

    @property
    def record(self) -> str | tuple[int, ...]:
        """The asperities to record: ``"touching"``, ``"all"``, ``"totals"`` or indices."""
        return self.sections.record.asperities

    def ensemble(self) -> "Ensemble":
        """Build the ensemble.

        Raises
        ------
        InputError
            Materials, summits or friction that cannot be used; the message names file and field.
        """
        from historysim.ensemble import Ensemble

        with reported(self.path.name):
            pair = self.sections.materials.pair()
            arguments = self.sections.surface.summits(self.path.parent)
            arguments = {"friction": self._friction("friction" in arguments)} | arguments
            with at("surface"):
                ensemble = Ensemble(pair, **arguments)
            self._check_record(len(ensemble))
        return ensemble

    def events(self) -> list[Event]:
        """Build the events, in time order.

        Raises
        ------
        InputError
            Loads that cannot be used; the message names file and field, or line and column.
        """
        with reported(self.path.name):
            events = self.sections.loading.events(self.path.parent)
            if not events:
                raise misfit("no waypoints; expected one or more", "loading")
            steps = len(events) * self.substeps
            if steps > MOST_STEPS:
                problem = f"{steps:,} steps; expected {MOST_STEPS:,} at most; use fewer substeps"
                raise misfit(problem, "loading", "substeps")
        return events

    def checked(self) -> "tuple[Ensemble, list[Event]]":
        """Build ensemble and events, and check the one against the other.

        Raises
        ------
        InputError
            As for either, or a change of friction with a wrong number of coefficients.
        """
        ensemble, events = self.ensemble(), self.events()
        for event in events:
            if isinstance(event, FrictionChange) and isinstance(event.friction, tuple):
                given, expected = len(event.friction), len(ensemble)
                if given not in {1, expected}:
                    raise InputError(
                        f"{self.path.name}: loading: friction at t = {event.time:g} s has {given} coefficients for "
                        f"{expected} asperities; expected one, or one per asperity"
                    )
        return ensemble, events

    def _friction(self, in_surface: bool) -> float | tuple[float, ...] | None:
        friction = self.sections.friction
        if in_surface == (friction is not None):
            problem = (
                "given both here and in surface.columns; expected one of them"
                if in_surface
                else "missing; expected [friction] with a coefficient, or surface.columns.friction"
            )
            raise misfit(problem, "friction")
        return friction.coefficient if friction else None

    def _check_record(self, count: int) -> None:
        if isinstance(self.record, str):
            return
        if not self.record or len(set(self.record)) < len(self.record):
            raise misfit("expected one or more indices, each of them once", "record", "asperities")
        for position, index in enumerate(self.record):
            if not 0 <= index < count:
                problem = f"{shown(index)}; expected an index from 0 to {count - 1}, since there are {count} asperities"
                raise misfit(problem, "record", "asperities", position)


def load(path: str | os.PathLike[str]) -> Scenario:
    """Read a scenario.

    Parameters
    ----------
    path : path-like
        A TOML file.

    Returns
    -------
    Scenario
        The scenario; its ``ensemble()`` and ``events()`` build what ``replay`` takes.

    Raises
    ------
    InputError
        A file that cannot be read or is not TOML, or fields that cannot be used: one line for each, with
        the path to it.
    """
    path = Path(path)
    with reported(path.name or str(path)):
        source = _source(path)
        try:
            document = tomllib.loads(source)
        except (ValueError, RecursionError) as error:
            raise InputError(f"is not TOML: {error}") from error
        if not document:
            raise InputError("is empty; expected at least [materials], [surface], [friction] and [loading]")
        sections = _converter().structure(document, Sections)
    return Scenario(path, source, sections)


def _converter() -> Converter:
    converter = schema_converter()
    for kind, hook in (
        (MaterialEntry | None, _material_entry),
        (Column, _column),
        (Characters, _characters),
        (Characters | None, _characters),
        (Surface, _surface),
        (AnyLoading, _loading),
        (str | tuple[int, ...], _record),
    ):
        converter.register_structure_hook_func(partial(eq, kind), partial(hook, converter))
    return converter


def _material_entry(converter: Converter, value: object, _: object) -> MaterialEntry:
    return converter.structure(value, MaterialTable) if isinstance(value, dict) else text(value)


def _column(_: Converter, value: object, __: object) -> Column:
    return column_from_toml(value)


def _characters(_: Converter, value: object, __: object) -> str:
    if not isinstance(value, str):
        raise InputError(f"{shown(value)}; expected a text")
    return value


def _surface(converter: Converter, value: object, _: object) -> Surface:
    entry = dict(table(value))
    if "kind" not in entry:
        raise misfit(f"missing; expected one of {', '.join(SURFACES)}", "kind")
    kind = entry.pop("kind")
    if not isinstance(kind, str) or kind not in SURFACES:
        raise misfit(f"{shown(kind)}; {nearest(str(kind), SURFACES)}", "kind")
    surface: Surface = converter.structure(entry, SURFACES[kind](entry))
    return surface


def _loading(converter: Converter, value: object, _: object) -> AnyLoading:
    entry = table(value)
    given = [key for key in LOADINGS if key in entry]
    if len(given) != 1:
        found = " and ".join(given) or ", ".join(repr(key) for key in entry) or "nothing"
        raise InputError(f"{found} given; expected exactly one of waypoints, blocks and file")
    loading: AnyLoading = converter.structure(entry, LOADINGS[given[0]])
    return loading


def _record(converter: Converter, value: object, _: object) -> str | tuple[int, ...]:
    if isinstance(value, list):
        return converter.structure(value, tuple[int, ...])
    if not isinstance(value, str) or value not in RECORDS:
        words = ", ".join(f'"{word}"' for word in RECORDS)
        raise InputError(f"{shown(value)}; expected {words} or an array of indices")
    return value


def _source(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(
            f"there is no such file in {path.absolute().parent}; expected a scenario file (TOML)"
        ) from None
    except IsADirectoryError:
        raise InputError("is a folder; expected a scenario file (TOML)") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"is not UTF-8 text ({error.reason} at byte {error.start}); expected TOML") from error
    except ValueError as error:
        raise InputError(f"cannot be a path: {error}") from error
