"""Load events: facts about what the load channels have reached, and when.

Loads are waypoints, as in an amplitude table: an event says what its channel has reached at its
time, and a channel runs straight between its own waypoints.
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Self

import attrs

from historysim.basics.registry import Registry
from historysim.basics.units import as_float, duration_text, in_si, is_number, metres, newtons, seconds
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.tables.lines import brief

__all__ = [
    "Event",
    "FrictionChange",
    "FrictionRamp",
    "GeometryChange",
    "NormalDisplacement",
    "NormalLoad",
    "TangentialDisplacement",
    "TangentialLoad",
    "register",
]


def __dir__() -> list[str]:
    return sorted(__all__)


def _finite(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    if not (is_number(value) and math.isfinite(value)):
        raise InputError(f"{type(event).__name__}: {attribute.name} is {value!r}; expected a finite number, in SI")


Number = Callable[[str], float]
"""What reads a number of a table, with its unit, in SI."""


class Event:
    """A fact with a time: a waypoint of a channel, or a change that acts at once.

    A kind is an attrs class with ``time`` as its first field. What it has beside the time is numbers, tuples of
    them, or None, as `contents` gives them: so it stands in a log, and in a table of events.
    """

    __slots__ = ()

    name: ClassVar[str]
    """Its name in scenarios, tables and logs."""
    unit: ClassVar[str] = "1"
    """Of the numbers in a table."""
    channel: ClassVar[str | None] = None
    """Of a waypoint: "normal", "tangential" or "friction"."""
    changes_friction: ClassVar[bool] = False
    changes_geometry: ClassVar[bool] = False
    """What it changes, so that it is recorded at each step."""

    time: float

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it, as far as it alone tells."""
        return self.changes_friction

    def contents(self) -> list[Any]:
        """Return what it says beside its time: numbers, tuples of them, or None for what it leaves open."""
        own: Any = type(self)
        return [getattr(self, field.name) for field in attrs.fields(own)[1:]]

    @classmethod
    def of(cls, time: float, contents: Sequence[Any]) -> Self:
        """Return the event at a time that says what `contents` gave."""
        made: Any = cls
        event: Self = made(time, *contents)
        return event

    @property
    def cell(self) -> str:
        """What it says, in a table of events: with as many digits as tell it from any other."""
        return " | ".join(map(_numbers_text, self.contents()))

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        return cls.of(time, [_numbers(part, number) for part in text.split("|")])

    def misfit(self, count: int) -> str:
        """Return what does not fit an ensemble of so many asperities, with what is expected; empty if it does."""
        del count
        return ""

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the `EnsembleState` of an `Ensemble` behind an `Instrument` after a change; of waypoints nothing acts.

        Facts do not import what they act on, so that whoever reads a log or a result needs no engine.
        """
        raise NotImplementedError(
            f"{type(self).__name__} has no act; expected a method that returns the state after it"
        )


EVENTS: Registry[type[Event]] = Registry(
    "historysim.events", "historysim.loads.events:Event", "event", "historysim.loads.events", label="name"
)
"""All kinds of events by their names."""
register = EVENTS.register


def _numbers_text(told: Any) -> str:
    if told is None:
        return ""
    if not isinstance(told, tuple):
        return repr(told)
    text = " ".join(map(repr, told))
    return text if len(told) > 1 else f"[{text}]"


def _numbers(text: str, number: Number) -> float | tuple[float, ...] | None:
    text = text.strip()
    bare = text.removeprefix("[").removesuffix("]")
    numbers = tuple(map(number, bare.split()))
    if not numbers:
        return None
    return numbers[0] if len(numbers) == 1 and bare == text else numbers


def _some(text: str, number: Number) -> float | tuple[float, ...]:
    found = _numbers(text, number)
    return () if found is None else found


def _chosen(text: str) -> tuple[tuple[int, ...] | None, str]:
    """Return the indices in front of a colon, and what stands behind it."""
    chosen, _, told = text.rpartition(":")
    for each in chosen.split():
        if not each.isdecimal():
            raise InputError(f"{brief(each)}; expected the index of an asperity, 0 or more")
    return tuple(map(int, chosen.split())) or None, told


def _whose(asperities: tuple[int, ...] | None) -> str:
    return "" if asperities is None else f"{' '.join(map(str, asperities))}: "


def _lists_misfit(count: int, chosen: tuple[int, ...] | None, lists: Mapping[str, Any], noun: str) -> str:
    """Return what of lists for chosen asperities, or for all, does not fit so many of them."""
    if chosen is not None and max(chosen) >= count:
        return f"asperity {max(chosen)} does not exist; expected indices from 0 to {count - 1}"
    whose = count if chosen is None else len(chosen)
    for name, values in lists.items():
        if isinstance(values, tuple) and len(values) not in {1, whose}:
            return (
                f"{name} has shape ({len(values)},); expected one {noun}, or one for each of "
                f"{counted(whose, 'asperity', 'asperities')}"
            )
    return ""


@attrs.frozen
class LoadEvent(Event):
    """What one load channel has reached at a time.

    Parameters
    ----------
    time : float
        Time [s].
    value : float
        The load [N] or displacement [m] reached at that time.

    Raises
    ------
    InputError
        A time or value that is not a finite number.
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    value: float = attrs.field(converter=as_float, validator=_finite)

    channel: ClassVar[str]

    def contents(self) -> list[Any]:
        """Return the value."""
        return [self.value]

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        return cls(time, number(text))


def _not_negative(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    _finite(event, attribute, value)
    if value < 0:
        raise InputError(
            f"{type(event).__name__}: a normal load of {value:g} N pulls on the contact; "
            "expected a load of 0 N (lift-off) or more, since the contact does not adhere"
        )


@EVENTS.register
@attrs.frozen
class NormalLoad(LoadEvent):
    """The total normal load [N] reached at a time; 0 lifts the surface off.

    Examples
    --------
    >>> hs.NormalLoad(0.0, 50e-3)
    NormalLoad(time=0.0, value=0.05)
    """

    value: float = attrs.field(converter=newtons, validator=_not_negative)
    name = "normal_load"
    channel = "normal"
    unit = "N"


@EVENTS.register
@attrs.frozen
class NormalDisplacement(LoadEvent):
    """The approach of the highest summit from first touch [m]; negative values are a gap.

    Examples
    --------
    >>> hs.NormalDisplacement(0.0, 20e-9)
    NormalDisplacement(time=0.0, value=2e-08)
    """

    value: float = attrs.field(converter=metres, validator=_finite)
    name = "normal_displacement"
    channel = "normal"
    unit = "m"


@EVENTS.register
@attrs.frozen
class TangentialLoad(LoadEvent):
    """The total tangential load [N] reached at a time.

    Examples
    --------
    >>> hs.TangentialLoad(1.0, 5e-3)
    TangentialLoad(time=1.0, value=0.005)
    """

    value: float = attrs.field(converter=newtons, validator=_finite)
    name = "tangential_load"
    channel = "tangential"
    unit = "N"


@EVENTS.register
@attrs.frozen
class TangentialDisplacement(LoadEvent):
    """The rigid tangential displacement U [m] reached at a time, or with an `Instrument` that of its drive.

    Examples
    --------
    >>> hs.TangentialDisplacement(1.0, 10e-9)
    TangentialDisplacement(time=1.0, value=1e-08)
    """

    value: float = attrs.field(converter=metres, validator=_finite)
    name = "tangential_displacement"
    channel = "tangential"
    unit = "m"


def _coefficients(value: float | Iterable[float]) -> float | tuple[float, ...]:
    came: Any = value
    single = isinstance(came, str | bytes | Mapping) or getattr(came, "ndim", 1) == 0
    return tuple(map(as_float, came)) if isinstance(came, Iterable) and not single else as_float(came)


def _valid_coefficients(event: object, attribute: "attrs.Attribute[float]", value: float | tuple[float, ...]) -> None:
    coefficients = value if isinstance(value, tuple) else (value,)
    if not coefficients:
        raise InputError(f"{type(event).__name__}: {attribute.name} is empty; expected one coefficient, or one each")
    for coefficient in coefficients:
        if not (is_number(coefficient) and math.isfinite(coefficient) and coefficient >= 0):
            raise InputError(
                f"{type(event).__name__}: {attribute.name} is {coefficient!r}; expected a finite number of 0 or more"
            )


def _differ(value: float | tuple[float, ...]) -> bool:
    return isinstance(value, tuple) and min(value) < max(value)


def _lengths(value: float | Iterable[float] | None) -> tuple[float, ...] | None:
    if value is None:
        return None
    lengths = _coefficients(in_si(value, "m"))
    return lengths if isinstance(lengths, tuple) else (lengths,)


def _valid_lengths(event: object, attribute: "attrs.Attribute[Any]", value: tuple[float, ...] | None) -> None:
    if value == ():
        raise InputError(f"{type(event).__name__}: {attribute.name} is empty; expected one length, or one each, in m")
    for length in value or ():
        if not (is_number(length) and math.isfinite(length)):
            raise InputError(f"{type(event).__name__}: {attribute.name} is {length!r}; expected a finite number, in m")


def _indices(value: int | Iterable[int] | None) -> tuple[int, ...] | None:
    came: Any = value
    # what holds no indices is refused afterwards
    given: Any = came if came is None or isinstance(came, str | bytes | Mapping) else (came,)
    indices: tuple[int, ...] | None = tuple(came) if isinstance(came, Iterable) and given is not came else given
    return indices


def _valid_indices(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    if value is None:
        return
    whole = isinstance(value, tuple) and all(
        is_number(index) and index == int(index) and index >= 0 and not isinstance(index, bool) for index in value
    )
    if not whole or not value or len(set(value)) < len(value):
        raise InputError(
            f"{type(event).__name__}: {attribute.name} is {value!r}; expected indices of asperities, "
            "0 or more, each once"
        )
    object.__setattr__(event, attribute.name, tuple(int(index) for index in value))


@EVENTS.register
@attrs.frozen
class FrictionChange(Event):
    """A new friction coefficient from a time on.

    It acts at once, after the load channels have arrived at that time. Springs that the new, lower
    limit cannot hold slip; under load control the tangential displacement then jumps to restore the
    load. A rise changes nothing until the next load.

    Parameters
    ----------
    time : float
        Time [s].
    friction : float or sequence of float
        One coefficient for all asperities, or one per asperity in the order of the ensemble.
    asperities : sequence of int, optional
        Indices of those that it is for; all by default.

    Raises
    ------
    InputError
        A time or coefficient that is not a finite number, a negative coefficient, or what are no indices.

    Examples
    --------
    >>> hs.FrictionChange(2.0, 0.15)
    FrictionChange(time=2.0, friction=0.15, asperities=None)
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    friction: float | tuple[float, ...] = attrs.field(converter=_coefficients, validator=_valid_coefficients)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=_indices, validator=_valid_indices)

    name = "friction"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it, as far as it alone tells."""
        return self.asperities is not None or _differ(self.friction)

    def contents(self) -> list[Any]:
        """Return the coefficients, and for which asperities; for all of them the coefficients alone."""
        return [self.friction] if self.asperities is None else [self.friction, self.asperities]

    @property
    def cell(self) -> str:
        """What it says, in a table of events."""
        return f"{_whose(self.asperities)}{_numbers_text(self.friction)}"

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        chosen, told = _chosen(text)
        return cls(time, _some(told, number), chosen)

    def misfit(self, count: int) -> str:
        """Return what does not fit so many asperities."""
        return _lists_misfit(count, self.asperities, {"friction": self.friction}, "coefficient")

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the state after it; errors as for `Ensemble.with_friction`."""
        del saturate
        return ensemble.with_friction(state, self.friction, asperities=self.asperities, instrument=instrument)


@EVENTS.register
@attrs.frozen
class FrictionRamp(Event):
    """The friction coefficient reached at a time: a waypoint of friction, which runs straight between its waypoints.

    Friction goes there from where it stands at the waypoint before, or at the event time before where it is the first.
    Rows of a table μ(t) are such events.

    Parameters
    ----------
    time : float
        Time [s].
    friction : float or sequence of float
        One coefficient for all asperities, or one per asperity in the order of the ensemble.

    Raises
    ------
    InputError
        A time or coefficient that is not a finite number, or a negative coefficient.
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    friction: float | tuple[float, ...] = attrs.field(converter=_coefficients, validator=_valid_coefficients)

    name = "friction_ramp"
    channel = "friction"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it."""
        return _differ(self.friction)

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        return cls(time, _some(text, number))

    def misfit(self, count: int) -> str:
        """Return what does not fit so many asperities."""
        return _lists_misfit(count, None, {"friction": self.friction}, "coefficient")


@EVENTS.register
@attrs.frozen
class GeometryChange(Event):
    """Other summits from a time on: each that changes is a new contact, and what it remembered is erased.

    It acts at once, after the load channels have arrived at that time. Then each channel goes back to where it was:
    controlled loads are restored. Asperities that get the height and radius that they have remember.

    Parameters
    ----------
    time : float
        Time [s].
    summit_height, summit_radius : float or sequence of float, optional
        New ones [m], one for all asperities or one each; heights over the datum of the ensemble. What is not given
        stays.
    asperities : sequence of int, optional
        Indices of those that they are for; all by default, as when the whole surface is replaced.

    Raises
    ------
    InputError
        Neither heights nor radii, numbers out of range, or what are no indices.
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    summit_height: tuple[float, ...] | None = attrs.field(default=None, converter=_lengths, validator=_valid_lengths)
    summit_radius: tuple[float, ...] | None = attrs.field(default=None, converter=_lengths, validator=_valid_lengths)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=_indices, validator=_valid_indices)

    name = "geometry"
    unit = "m"
    changes_geometry = True

    def __attrs_post_init__(self) -> None:
        """Check that something changes, to something that a summit can have."""
        if self.summit_height is None and self.summit_radius is None:
            raise InputError("GeometryChange: neither summit_height nor summit_radius; expected one of them, or both")
        if self.summit_radius is not None and min(self.summit_radius) <= 0:
            raise InputError(f"GeometryChange: summit_radius is {min(self.summit_radius):g}; expected more than 0 m")

    def contents(self) -> list[Any]:
        """Return for which asperities it is, the heights and the radii."""
        return [self.asperities, self.summit_height, self.summit_radius]

    @classmethod
    def of(cls, time: float, contents: Sequence[Any]) -> Self:
        """Return the event at a time that says what `contents` gave."""
        asperities, height, radius = contents
        return cls(time, height, radius, asperities)

    @property
    def cell(self) -> str:
        """What it says, in a table of events."""
        heights, radii = (" ".join(map(repr, each or ())) for each in (self.summit_height, self.summit_radius))
        return f"{_whose(self.asperities)}{heights} | {radii}"

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        chosen, told = _chosen(text)
        heights, _, radii = told.partition("|")
        height, radius = (tuple(map(number, each.split())) or None for each in (heights, radii))
        return cls(time, height, radius, chosen)

    def misfit(self, count: int) -> str:
        """Return what does not fit so many asperities."""
        lists = {"summit_height": self.summit_height, "summit_radius": self.summit_radius}
        return _lists_misfit(count, self.asperities, lists, "length")

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the state after it; errors as for `Ensemble.with_geometry`."""
        new: dict[str, Any] = {"summit_height": self.summit_height, "summit_radius": self.summit_radius}
        place: dict[str, Any] = {"asperities": self.asperities, "instrument": instrument}
        return ensemble.with_geometry(state, saturate=saturate, **new, **place)


EVENT_KINDS: Mapping[str, type[Event]] = EVENTS.own()
"""The kinds of events of this package, by their names in tables, scenarios and lists."""

LOAD_KINDS: Mapping[str, type[LoadEvent]] = {
    name: kind for name, kind in EVENT_KINDS.items() if issubclass(kind, LoadEvent)
}
"""Those that a load channel reaches something with."""


def time_text(time: float) -> str:
    """Write a time with as many digits as tell it from any other: ``"12.5 s"``."""
    return f"{repr(float(time)).removesuffix('.0')} s"


def as_events(given: Iterable[Event]) -> Sequence[Event]:
    """Return an argument that is a sequence of events; what it holds is checked by `check_sequence`.

    Raises
    ------
    InputError
        It cannot be one.
    """
    came: Any = given
    if not isinstance(came, Iterable):
        raise InputError(f"events is {given!r}; expected a list of load events")
    return given if isinstance(given, Sequence) else list(given)


def events_text(events: Sequence[Event]) -> str:
    """Return how many events there are and how long they last: ``"2,000 events over 198 s"``."""
    return f"{counted(len(events), 'event', 'events')}{over_text(events)}"


def over_text(events: Sequence[Event]) -> str:
    """Return how long events last, to stand behind their number: ``" over 198 s"``; nothing where that is not known."""
    # a Replay shows itself before its events are checked
    if not events or not all(isinstance(event, Event) for event in (events[0], events[-1])):
        return ""
    return f" over {duration_text(events[-1].time - events[0].time)}"


def check_sequence(events: Sequence[Event]) -> None:
    """Check a sequence of events before any of it is applied.

    Raises
    ------
    InputError
        A thing that is not an event, or a time before the one of the event in front of it.
    """
    previous = -math.inf
    for index, event in enumerate(events):
        if not isinstance(event, Event) or type(event) is LoadEvent:
            raise InputError(
                f"event {index}: {event!r} is not a load event; expected "
                f"{', '.join(kind.__name__ for kind in EVENT_KINDS.values())}"
            )
        if event.time < previous:
            raise InputError(
                f"event {index} at t = {time_text(event.time)}: comes after an event at t = {time_text(previous)}; "
                "expected times that do not decrease; sort the events by time (sorted(events, key=lambda event: "
                "event.time) keeps the order of those at one time)"
            )
        previous = event.time


def _hex(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_hex(each) for each in value]
    return value.hex() if isinstance(value, float) else value


def digest(events: Iterable[Event]) -> str:
    """Return the SHA-256 of events, over a form that covers kind, order and every bit of the numbers."""
    total = hashlib.sha256()
    for event in events:
        if isinstance(event, LoadEvent):
            # what JSON makes of it, in a fifth of the time
            line = f'["{type(event).__name__}", "{event.time.hex()}", "{event.value.hex()}"]'
        else:
            line = json.dumps([type(event).__name__, event.time.hex(), *map(_hex, event.contents())])
        total.update(line.encode() + b"\n")
    return total.hexdigest()
