"""Load events: facts about what the load channels have reached, and when.

Loads are waypoints, as in an amplitude table: an event says what its channel has reached at its
time, and a channel runs straight between its own waypoints.
"""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import attrs

from historysim.basics.units import as_float, duration_text, is_number
from historysim.basics.wording import counted
from historysim.errors import InputError

__all__ = [
    "FrictionChange",
    "FrictionRamp",
    "GeometryChange",
    "NormalDisplacement",
    "NormalLoad",
    "TangentialDisplacement",
    "TangentialLoad",
]


def __dir__() -> list[str]:
    return sorted(__all__)


def _finite(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    if not (is_number(value) and math.isfinite(value)):
        raise InputError(f"{type(event).__name__}: {attribute.name} is {value!r}; expected a finite number, in SI")


@attrs.frozen
class LoadEvent:
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

    time: float = attrs.field(converter=as_float, validator=_finite)
    value: float = attrs.field(converter=as_float, validator=_finite)

    name: ClassVar[str]
    channel: ClassVar[str]
    unit: ClassVar[str]


def _not_negative(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    _finite(event, attribute, value)
    if value < 0:
        raise InputError(
            f"{type(event).__name__}: a normal load of {value:g} N pulls on the contact; "
            "expected a load of 0 N (lift-off) or more, since the contact does not adhere"
        )


@attrs.frozen
class NormalLoad(LoadEvent):
    """The total normal load [N] reached at a time; 0 lifts the surface off.

    Examples
    --------
    >>> hs.NormalLoad(0.0, 50e-3)
    NormalLoad(time=0.0, value=0.05)
    """

    value: float = attrs.field(converter=as_float, validator=_not_negative)
    name = "normal_load"
    channel = "normal"
    unit = "N"


@attrs.frozen
class NormalDisplacement(LoadEvent):
    """The approach of the highest summit from first touch [m]; negative values are a gap.

    Examples
    --------
    >>> hs.NormalDisplacement(0.0, 20e-9)
    NormalDisplacement(time=0.0, value=2e-08)
    """

    name = "normal_displacement"
    channel = "normal"
    unit = "m"


@attrs.frozen
class TangentialLoad(LoadEvent):
    """The total tangential load [N] reached at a time.

    Examples
    --------
    >>> hs.TangentialLoad(1.0, 5e-3)
    TangentialLoad(time=1.0, value=0.005)
    """

    name = "tangential_load"
    channel = "tangential"
    unit = "N"


@attrs.frozen
class TangentialDisplacement(LoadEvent):
    """The rigid tangential displacement U [m] reached at a time, or with an `Instrument` that of its drive.

    Examples
    --------
    >>> hs.TangentialDisplacement(1.0, 10e-9)
    TangentialDisplacement(time=1.0, value=1e-08)
    """

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
    lengths = _coefficients(value)
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


@attrs.frozen
class FrictionChange:
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

    time: float = attrs.field(converter=as_float, validator=_finite)
    friction: float | tuple[float, ...] = attrs.field(converter=_coefficients, validator=_valid_coefficients)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=_indices, validator=_valid_indices)

    name: ClassVar[str] = "friction"
    unit: ClassVar[str] = "1"

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it, as far as it alone tells."""
        return self.asperities is not None or _differ(self.friction)


@attrs.frozen
class FrictionRamp:
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

    time: float = attrs.field(converter=as_float, validator=_finite)
    friction: float | tuple[float, ...] = attrs.field(converter=_coefficients, validator=_valid_coefficients)

    name: ClassVar[str] = "friction_ramp"
    unit: ClassVar[str] = "1"
    channel: ClassVar[str] = "friction"

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it."""
        return _differ(self.friction)


@attrs.frozen
class GeometryChange:
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

    time: float = attrs.field(converter=as_float, validator=_finite)
    summit_height: tuple[float, ...] | None = attrs.field(default=None, converter=_lengths, validator=_valid_lengths)
    summit_radius: tuple[float, ...] | None = attrs.field(default=None, converter=_lengths, validator=_valid_lengths)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=_indices, validator=_valid_indices)

    name: ClassVar[str] = "geometry"
    unit: ClassVar[str] = "m"

    def __attrs_post_init__(self) -> None:
        """Check that something changes, to something that a summit can have."""
        if self.summit_height is None and self.summit_radius is None:
            raise InputError("GeometryChange: neither summit_height nor summit_radius; expected one of them, or both")
        if self.summit_radius is not None and min(self.summit_radius) <= 0:
            raise InputError(f"GeometryChange: summit_radius is {min(self.summit_radius):g}; expected more than 0 m")


Event = LoadEvent | FrictionChange | FrictionRamp | GeometryChange

# a log stores the place of a kind in this order, so that a new one comes last
LOAD_KINDS: Mapping[str, type[LoadEvent]] = {
    kind.name: kind for kind in (NormalLoad, NormalDisplacement, TangentialLoad, TangentialDisplacement)
}
"""The kinds of events that a load channel reaches something with, by their names."""

EVENT_KINDS: Mapping[str, type[Event]] = {
    **LOAD_KINDS,
    **{kind.name: kind for kind in (FrictionChange, FrictionRamp, GeometryChange)},
}
"""All kinds of events, by their names in tables, scenarios and lists."""


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
                f"event {index}: {event!r} is not a load event; expected NormalLoad, NormalDisplacement, "
                "TangentialLoad, TangentialDisplacement, FrictionChange, FrictionRamp or GeometryChange"
            )
        if event.time < previous:
            raise InputError(
                f"event {index} at t = {time_text(event.time)}: comes after an event at t = {time_text(previous)}; "
                "expected times that do not decrease; sort the events by time (sorted(events, key=lambda event: "
                "event.time) keeps the order of those at one time)"
            )
        previous = event.time


def contents(event: Event) -> list[Any]:
    """Return what an event says beside its time: numbers, tuples of them, or None for what it leaves open.

    Of a change of friction for all asperities the coefficients alone, as they always were.
    """
    if isinstance(event, LoadEvent):
        return [event.value]
    if isinstance(event, GeometryChange):
        return [event.asperities, event.summit_height, event.summit_radius]
    some = isinstance(event, FrictionChange) and event.asperities is not None
    return [event.friction, event.asperities] if some else [event.friction]  # type: ignore[union-attr]


def misfit(event: Event, count: int) -> str:
    """Return what of an event does not fit an ensemble of so many asperities, with what is expected; empty if it does.

    Parameters
    ----------
    event : Event
    count : int
        Number of asperities.
    """
    if isinstance(event, LoadEvent):
        return ""
    chosen = None if isinstance(event, FrictionRamp) else event.asperities
    if chosen is not None and max(chosen) >= count:
        return f"asperity {max(chosen)} does not exist; expected indices from 0 to {count - 1}"
    whose = count if chosen is None else len(chosen)
    lists = [event.friction] if not isinstance(event, GeometryChange) else [event.summit_height, event.summit_radius]
    names = ["summit_height", "summit_radius"] if isinstance(event, GeometryChange) else ["friction"]
    for name, values in zip(names, lists, strict=True):
        if isinstance(values, tuple) and len(values) not in {1, whose}:
            noun = "coefficient" if name == "friction" else "length"
            return (
                f"{name} has shape ({len(values)},); expected one {noun}, or one for each of "
                f"{counted(whose, 'asperity', 'asperities')}"
            )
    return ""


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
            line = json.dumps([type(event).__name__, event.time.hex(), *map(_hex, contents(event))])
        total.update(line.encode() + b"\n")
    return total.hexdigest()
