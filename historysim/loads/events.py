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
    """The total normal load [N] reached at a time; 0 lifts the surface off."""

    value: float = attrs.field(converter=as_float, validator=_not_negative)
    name = "normal_load"
    channel = "normal"
    unit = "N"


@attrs.frozen
class NormalDisplacement(LoadEvent):
    """The approach of the highest summit from first touch [m]; negative values are a gap."""

    name = "normal_displacement"
    channel = "normal"
    unit = "m"


@attrs.frozen
class TangentialLoad(LoadEvent):
    """The total tangential load [N] reached at a time."""

    name = "tangential_load"
    channel = "tangential"
    unit = "N"


@attrs.frozen
class TangentialDisplacement(LoadEvent):
    """The rigid tangential displacement U [m] reached at a time, or with an `Instrument` that of its drive."""

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

    Raises
    ------
    InputError
        A time or coefficient that is not a finite number, or a negative coefficient.
    """

    time: float = attrs.field(converter=as_float, validator=_finite)
    friction: float | tuple[float, ...] = attrs.field(converter=_coefficients, validator=_valid_coefficients)

    name: ClassVar[str] = "friction"
    unit: ClassVar[str] = "1"


Event = LoadEvent | FrictionChange

# a log stores the place of a kind in this order, so that a new one comes last
LOAD_KINDS: Mapping[str, type[LoadEvent]] = {
    kind.name: kind for kind in (NormalLoad, NormalDisplacement, TangentialLoad, TangentialDisplacement)
}
"""The kinds of events that a load channel reaches something with, by their names."""

EVENT_KINDS: Mapping[str, type[Event]] = {**LOAD_KINDS, FrictionChange.name: FrictionChange}
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
    if not events or not all(isinstance(event, LoadEvent | FrictionChange) for event in (events[0], events[-1])):
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
        if not isinstance(event, LoadEvent | FrictionChange) or type(event) is LoadEvent:
            raise InputError(
                f"event {index}: {event!r} is not a load event; expected NormalLoad, NormalDisplacement, "
                "TangentialLoad, TangentialDisplacement or FrictionChange"
            )
        if event.time < previous:
            raise InputError(
                f"event {index} at t = {time_text(event.time)}: comes after an event at t = {time_text(previous)}; "
                "expected times that do not decrease; sort the events by time (sorted(events, key=lambda event: "
                "event.time) keeps the order of those at one time)"
            )
        previous = event.time


def digest(events: Iterable[Event]) -> str:
    """Return the SHA-256 of events, over a form that covers kind, order and every bit of the numbers."""
    total = hashlib.sha256()
    for event in events:
        value = event.friction if isinstance(event, FrictionChange) else event.value
        numbers = [number.hex() for number in value] if isinstance(value, tuple) else value.hex()
        total.update(json.dumps([type(event).__name__, event.time.hex(), numbers]).encode() + b"\n")
    return total.hexdigest()
