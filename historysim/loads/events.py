"""Load events: waypoints of load channels, and instantaneous changes of friction or geometry."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self

import attrs

from historysim.basics.fields import Force, Length, Numbers, Quantity, QuantityFields
from historysim.basics.limits import MOST_FRICTION, SIZE, is_workable
from historysim.basics.registry import Registry
from historysim.basics.units import (
    as_float,
    convert_each,
    is_number,
    metres,
    newtons,
    seconds,
    to_si,
)
from historysim.basics.wording import count_text
from historysim.errors import InputError

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


# -- fields of events: conversion and checks
# ------------------------------------------------------------


def _fits(value: Any) -> bool:
    return is_number(value) and is_workable(value)


def _field_error(
    event: Any, name: str, value: Any, expected: str, *, is_limited: bool = False
) -> InputError:
    """Error of a field; `expected` names the largest value itself if it `is_limited`."""
    when = f" at t = {event.time:g} s" if name != "time" and _fits(event.time) else ""
    if not is_limited and is_number(value) and math.isfinite(value) and not is_workable(value):
        expected = f"{SIZE}, in SI"
    return InputError(f"{type(event).__name__}: {name} is {value!r}{when}; expected {expected}")


def _finite(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    if not _fits(value):
        raise _field_error(event, attribute.name, value, "a finite number, in SI")


def _check_one_or_two(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    if not isinstance(value, tuple):
        _finite(event, attribute, value)
    elif (
        len(value) != 2
        or not all(component is None or _fits(component) for component in value)
        or value == (None, None)
    ):
        expected = "a finite number, or two, in x and y, in SI; None in one of them leaves that component open"
        raise _field_error(event, attribute.name, value, expected)


def as_numbers(value: float | Iterable[float]) -> float | tuple[float, ...]:
    """Convert one number or several to floats; other values are returned unchanged, for the validator to refuse."""
    argument: Any = value
    single = isinstance(argument, str | bytes | Mapping) or getattr(argument, "ndim", 1) == 0
    return (
        tuple(map(as_float, argument))
        if isinstance(argument, Iterable) and not single
        else as_float(argument)
    )


def _as_lengths(value: float | Iterable[float] | None) -> tuple[float, ...] | None:
    """Convert lengths with or without units to metres."""
    lengths = None if value is None else as_numbers(to_si(value, "m"))
    return lengths if isinstance(lengths, tuple | None) else (lengths,)


def _as_indices(value: int | Iterable[int] | None) -> tuple[int, ...] | None:
    """Convert indices of asperities to a tuple; None means all asperities."""
    if value is None or isinstance(value, str | bytes | Mapping):
        return value  # type: ignore[return-value] # refused by the check
    indices = tuple(value) if isinstance(value, Iterable) else (value,)
    are_integers = (
        is_number(index) and not isinstance(index, bool) and index == int(index)
        for index in indices
    )
    return tuple(map(int, indices)) if all(are_integers) else indices


def each_at_least(
    noun: str, minimum: float, expected: str, *, maximum: float = math.inf
) -> Callable[[object, "attrs.Attribute[Any]", Any], None]:
    """Return a validator of one number or a tuple of them, each between a minimum and a maximum."""

    def check(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        if value == ():
            raise InputError(
                f"{type(event).__name__}: {attribute.name} is empty; expected one {noun}, or one each"
            )
        for number in value if isinstance(value, tuple) else (value,):
            if not (_fits(number) and minimum <= number <= maximum):
                raise _field_error(
                    event, attribute.name, number, expected, is_limited=maximum < math.inf
                )

    return check


def _indices(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    are_indices = isinstance(value, tuple) and all(
        type(index) is int and index >= 0 for index in value
    )
    if value is not None and not (are_indices and value and len(set(value)) == len(value)):
        expected = "indices of asperities, 0 or more, each once"
        raise InputError(
            f"{type(event).__name__}: {attribute.name} is {value!r}; expected {expected}"
        )


_COEFFICIENT = f"a finite number of 0 or more, {MOST_FRICTION:g} at most (the contact sticks as with any larger one)"
coefficients_within = each_at_least("coefficient", 0.0, _COEFFICIENT, maximum=MOST_FRICTION)
_lengths = attrs.validators.optional(each_at_least("length", -math.inf, "a finite number, in m"))


# -- the base class
# ---------------------------------------------------------------------------------------


class Event(QuantityFields):
    """Base class of events: a waypoint of a channel, or an instantaneous change, at a time.

    A kind is an attrs class with ``time`` as its first field. The others are numbers, tuples of
    them, or None, as a log stores them.
    """

    __slots__ = ()

    name: ClassVar[str]  #: its name in scenarios and logs
    unit: ClassVar[str] = "1"  #: of its numbers
    channel: ClassVar[str | None] = None  #: of a waypoint: "normal", "tangential" or "friction"
    #: The fields except time in their order in a log; by default the order of declaration.
    order: ClassVar[tuple[str, ...]] = ()
    noun: ClassVar[str] = "number"  #: name of one of its numbers in messages
    changes_friction: ClassVar[bool] = False
    #: whether it changes the geometry, which is then recorded at each step
    changes_geometry: ClassVar[bool] = False

    time: float

    @property
    def differs(self) -> bool:
        """True if asperities have different friction after this event alone."""
        return self.changes_friction

    @property
    def needs(self) -> tuple[str, ...]:
        """Features of a body that it requires, such as "friction change"; see `historysim.asperities.body`."""
        return ("friction change",) * self.changes_friction + (
            "geometry change",
        ) * self.changes_geometry

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of this waypoint; in two tangential directions x and y are separate channels."""
        return () if self.channel is None else (self.channel,)

    @classmethod
    def fields(cls) -> tuple[str, ...]:
        """Return the names of the fields except time, in their order in a log."""
        event_class: Any = cls
        return cls.order or tuple(field.name for field in attrs.fields(event_class)[1:])

    def contents(self) -> list[Any]:
        """Return the values of the fields except time: numbers, tuples of numbers, or None."""
        return [getattr(self, name) for name in self.fields()]

    @classmethod
    def from_contents(cls, time: float, contents: Sequence[Any]) -> Self:
        """Make an event at a time from `contents`; missing trailing values are left open."""
        event_class: Any = cls
        if len(contents) > len(cls.fields()):
            raise InputError(
                f"{cls.name} has {len(contents)} lists of numbers; expected {len(cls.fields())} at most"
            )
        event: Self = event_class(time, **dict(zip(cls.fields(), contents, strict=False)))
        return event

    @property
    def cell(self) -> str:
        """Its numbers as ``historysim log`` lists them: ``"0 2: 1e-9 2e-9 | 1e-6"``, with all digits."""
        chosen = getattr(self, "asperities", None)
        front = "" if chosen is None else f"{' '.join(map(str, chosen))}: "
        return front + " | ".join(_numbers_text(getattr(self, name)) for name in self._lists())

    @classmethod
    def _lists(cls) -> list[str]:
        return [name for name in cls.fields() if name != "asperities"]

    def problem(self, count: int) -> str:
        """Return a message if the event does not fit an ensemble of ``count`` asperities; empty if it fits."""
        chosen: Any = getattr(self, "asperities", None)
        if chosen is not None and max(chosen) >= count:
            return f"asperity {max(chosen)} does not exist; expected indices from 0 to {count - 1}"
        expected = count if chosen is None else len(chosen)
        for name in self._lists():
            values = getattr(self, name)
            if (
                self.noun != "number"
                and isinstance(values, tuple)
                and len(values) not in {1, expected}
            ):
                return (
                    f"{name} has shape ({len(values)},); expected one {self.noun}, or one for each of "
                    f"{count_text(expected, 'asperity', 'asperities')}"
                )
        return ""

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the `State` after an instantaneous change; not called for waypoints.

        Events do not import ensembles, so that logs and results are read without the engine.
        """
        raise NotImplementedError(
            f"{type(self).__name__} has no act; expected a method that returns the state after it"
        )


def _differ(friction: float | tuple[float, ...]) -> bool:
    return isinstance(friction, tuple) and min(friction) < max(friction)


def _numbers_text(numbers: float | tuple[float, ...] | None) -> str:
    """Format numbers; a list of one is in brackets."""
    if not isinstance(numbers, tuple):
        return "" if numbers is None else repr(numbers)
    text = " ".join(map(repr, numbers))
    return text if len(numbers) > 1 else f"[{text}]"


# All kinds of events by their names.
EVENTS: Registry[type[Event]] = Registry(
    "historysim.events", "historysim.loads.events:Event", "event", "historysim.loads", label="name"
)
register = EVENTS.register


@attrs.frozen
class LoadEvent(Event):
    """Waypoint of a load channel at a time [s]: a load [N] or a displacement [m]."""

    time: float = attrs.field(converter=seconds, validator=_finite)
    value: float = attrs.field(converter=as_float, validator=_finite)

    channel: ClassVar[str]

    @property
    def planar(self) -> bool:
        """True if the value has two components, in x and y."""
        return False

    def channel_value(self, channel: str) -> float:  # noqa: ARG002 - it has one
        """Return the value of one of the `channels` [N] or [m]."""
        return float(self.value)

    def restrict(self, channels: Collection[str]) -> Self:  # noqa: ARG002 - it has one
        """Return the event as a waypoint of some of its `channels` only."""
        return self


@EVENTS.register
@attrs.frozen
class NormalLoad(LoadEvent):
    """The total normal load [N] reached at a time; 0 lifts the surface off.

    A contact with attraction may be pulled, with a negative load.

    Examples
    --------
    >>> hs.NormalLoad(0.0, 50e-3)
    NormalLoad(time=0.0, value=0.05)
    """

    value: Force = attrs.field(converter=newtons, validator=_finite)
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

    value: Length = attrs.field(converter=metres, validator=_finite)
    name = "normal_displacement"
    channel = "normal"
    unit = "m"


Components = tuple[float | None, float | None]  # in x and y
ForceOrPair = Annotated[float | Components, Quantity("N", components=("x", "y"))]
LengthOrPair = Annotated[float | Components, Quantity("m", components=("x", "y"))]
# ends the name of a channel, or of its column, that is the second tangential component
ACROSS = "_y"


def _newtons(value: float | Sequence[float | None]) -> Any:
    return convert_each(lambda component: None if component is None else newtons(component), value)


def _metres(value: float | Sequence[float | None]) -> Any:
    return convert_each(lambda component: None if component is None else metres(component), value)


def tangential_channels(value: Any) -> tuple[str, ...]:
    """Return the channels of the value of a tangential waypoint."""
    channel = TangentialEvent.channel
    if not isinstance(value, tuple):
        return (channel,)
    return tuple(
        name
        for name, component in zip((channel, channel + ACROSS), value, strict=False)
        if component is not None
    )


@attrs.frozen
class TangentialEvent(LoadEvent):
    """Waypoint of the tangential channel: one number, or two, in x and y.

    Each component is a channel by itself: None in a pair leaves one to other waypoints, of a load
    or a displacement.
    """

    value: Any
    channel = "tangential"

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of this waypoint: "tangential" is the channel of x, or of a single direction."""
        return tangential_channels(self.value)

    def channel_value(self, channel: str) -> float:
        """Return the value of one of the `channels` [N] or [m]."""
        return float(self.value[channel.endswith(ACROSS)] if self.planar else self.value)

    def restrict(self, channels: Collection[str]) -> Self:
        """Return the event as a waypoint of some of its `channels` only."""
        if not self.planar:
            return self
        x, y = (
            component if name in channels else None
            for name, component in zip(_COMPONENTS, self.value, strict=True)
        )
        return attrs.evolve(self, value=(x, y))

    def contents(self) -> list[Any]:
        """Return the value, or both components separately if one is open."""
        return [*self.value] if self.planar and None in self.value else [self.value]

    @classmethod
    def from_contents(cls, time: float, contents: Sequence[Any]) -> Self:
        """Make an event at a time from `contents`."""
        event_class: Any = cls
        event: Self = (
            event_class(time, tuple(contents))
            if len(contents) == 2
            else super().from_contents(time, contents)
        )
        return event

    @property
    def planar(self) -> bool:
        """True if the value has two components, in x and y."""
        return isinstance(self.value, tuple)

    @property
    def cell(self) -> str:
        """Its numbers as ``historysim log`` lists them: ``"1e-08"``, or in two directions ``"[1e-08 5e-09]"``."""
        return f"[{' '.join(map(repr, self.value))}]" if self.planar else repr(self.value)


_COMPONENTS = tangential_channels((0.0, 0.0))


@EVENTS.register
@attrs.frozen
class TangentialLoad(TangentialEvent):
    """The total tangential load [N] reached at a time: one number, or a pair, in x and y.

    None in a pair leaves that component to other waypoints.

    Examples
    --------
    >>> hs.TangentialLoad(1.0, 5e-3)
    TangentialLoad(time=1.0, value=0.005)
    >>> hs.TangentialLoad(1.0, ("3 mN", "4 mN"))
    TangentialLoad(time=1.0, value=(0.003, 0.004))
    """

    value: ForceOrPair = attrs.field(converter=_newtons, validator=_check_one_or_two)
    name = "tangential_load"
    unit = "N"


@EVENTS.register
@attrs.frozen
class TangentialDisplacement(TangentialEvent):
    """Rigid tangential displacement U [m] at a time; with an `Instrument` the displacement of its drive.

    It is one number, or a pair, in x and y; None in a pair leaves that component to other
    waypoints.

    Examples
    --------
    >>> hs.TangentialDisplacement(1.0, 10e-9)
    TangentialDisplacement(time=1.0, value=1e-08)
    >>> hs.TangentialDisplacement(1.0, (10e-9, 5e-9))
    TangentialDisplacement(time=1.0, value=(1e-08, 5e-09))

    A stage that is driven in x under a dead weight in y:

    >>> hs.TangentialDisplacement(1.0, (10e-9, None))
    TangentialDisplacement(time=1.0, value=(1e-08, None))
    >>> hs.TangentialLoad(1.0, (None, 5e-3))
    TangentialLoad(time=1.0, value=(None, 0.005))
    """

    value: LengthOrPair = attrs.field(converter=_metres, validator=_check_one_or_two)
    name = "tangential_displacement"
    unit = "m"


@EVENTS.register
@attrs.frozen
class FrictionChange(Event):
    """A new friction coefficient from a time on.

    It acts immediately, after the load channels have arrived at that time. Springs that the new,
    lower limit cannot hold slip; under load control the tangential displacement then jumps to
    restore the load. A rise changes nothing until the next load. A negative coefficient is an
    InputError.

    Parameters
    ----------
    time : float
        Time [s].
    friction : float or sequence of float
        One coefficient for all asperities, or one for each, in the order of the ensemble.
    asperities : sequence of int, optional
        Indices of the affected asperities; all by default.

    Examples
    --------
    >>> hs.FrictionChange(2.0, 0.15)
    FrictionChange(time=2.0, friction=0.15, asperities=None)
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    friction: Numbers = attrs.field(converter=as_numbers, validator=coefficients_within)
    asperities: tuple[int, ...] | None = attrs.field(
        default=None, converter=_as_indices, validator=_indices
    )

    name = "friction"
    noun = "coefficient"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """True if asperities have different friction after this event alone."""
        return self.asperities is not None or _differ(self.friction)

    @property
    def needs(self) -> tuple[str, ...]:
        """Features of a body that it requires."""
        return ("friction change" if self.asperities is None else "friction change of some",)

    def contents(self) -> list[Any]:
        """Return the coefficients, and the indices of asperities unless the event is for all of them."""
        return [self.friction] if self.asperities is None else [self.friction, self.asperities]

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the state after the change; errors as for `Ensemble.with_friction`."""
        del saturate
        # patches share one coefficient, so that none of them can be selected
        chosen = {} if self.asperities is None else {"asperities": self.asperities}
        return ensemble.with_friction(state, self.friction, instrument=instrument, **chosen)


@EVENTS.register
@attrs.frozen
class FrictionRamp(Event):
    """Waypoint of the friction coefficient, which is linear in time between its waypoints.

    Friction ramps from its value at the previous waypoint, or for the first waypoint at the
    previous event time. Rows of a table μ(t) are such events. A negative coefficient is an
    InputError.

    Parameters
    ----------
    time : float
        Time [s].
    friction : float or sequence of float
        One coefficient for all asperities, or one for each, in the order of the ensemble.
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    friction: Numbers = attrs.field(converter=as_numbers, validator=coefficients_within)

    name = "friction_ramp"
    noun = "coefficient"
    channel = "friction"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """True if asperities have different friction after this event."""
        return _differ(self.friction)

    @property
    def needs(self) -> tuple[str, ...]:
        """Features of a body that it requires."""
        return ("friction ramp",)


OneOrMore = Annotated[tuple[float, ...], Quantity("m", alone=True)]


@EVENTS.register
@attrs.frozen
class GeometryChange(Event):
    """New summit heights or radii from a time on; each changed summit is a new contact without traction memory.

    It acts immediately, after the load channels have arrived at that time. Then each channel
    returns to its value: controlled loads are restored. Asperities whose height and radius do not
    change keep their traction memory. InputError if neither heights nor radii are given.
    """

    time: float = attrs.field(converter=seconds, validator=_finite)  #: [s]
    #: New heights over the datum of the ensemble [m], one for all asperities or one each; by
    #: default they stay.
    summit_height: OneOrMore | None = attrs.field(
        default=None, converter=_as_lengths, validator=_lengths
    )
    #: New radii [m], likewise.
    summit_radius: OneOrMore | None = attrs.field(
        default=None, converter=_as_lengths, validator=_lengths
    )
    #: Indices of the affected asperities; all by default, as when the whole surface is replaced.
    asperities: tuple[int, ...] | None = attrs.field(
        default=None, converter=_as_indices, validator=_indices
    )

    name = "geometry"
    unit = "m"
    noun = "length"
    order = ("asperities", "summit_height", "summit_radius")
    changes_geometry = True

    def __attrs_post_init__(self) -> None:
        """Check that heights or radii are given, and radii are positive."""
        if self.summit_height is None and self.summit_radius is None:
            raise InputError(
                "GeometryChange: neither summit_height nor summit_radius; expected one of them, or both"
            )
        if self.summit_radius is not None and min(self.summit_radius) <= 0:
            raise InputError(
                f"GeometryChange: summit_radius is {min(self.summit_radius):g}; expected more than 0 m"
            )

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the state after the change; errors as for `Ensemble.with_geometry`."""
        return ensemble.with_geometry(
            state,
            summit_height=self.summit_height,
            summit_radius=self.summit_radius,
            asperities=self.asperities,
            saturate=saturate,
            instrument=instrument,
        )


# Waypoints of the load channels by name.
LOAD_KINDS: Mapping[str, type[LoadEvent]] = {
    name: kind for name, kind in EVENTS.own().items() if issubclass(kind, LoadEvent)
}


def load_kind(channel: str) -> type[LoadEvent]:
    """Return the event class of a channel or of its second component."""
    return LOAD_KINDS[channel.removesuffix(ACROSS)]
