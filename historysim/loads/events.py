"""Load events: what a channel has reached at a time (waypoints, as in an amplitude table), and what changes at once."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self

import attrs

from historysim.basics.fields import Force, Length, Numbers, Quantity
from historysim.basics.limits import MOST_FRICTION, SIZE, is_workable
from historysim.basics.registry import Registry
from historysim.basics.units import as_float, convert_each, in_si, is_number, metres, newtons, seconds
from historysim.basics.wording import counted
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


# -- fields of events: conversion and checks ------------------------------------------------------------


def _fits(value: Any) -> bool:
    return is_number(value) and is_workable(value)


def _field_error(event: Any, name: str, value: Any, expected: str, *, is_limited: bool = False) -> InputError:
    """Error of a field; `expected` names the largest value itself if it `is_limited`."""
    when = f" at t = {event.time:g} s" if name != "time" and _fits(event.time) else ""
    if not is_limited and is_number(value) and math.isfinite(value) and not is_workable(value):
        expected = f"{SIZE}, in SI"
    return InputError(f"{type(event).__name__}: {name} is {value!r}{when}; expected {expected}")


def _finite(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    if not _fits(value):
        raise _field_error(event, attribute.name, value, "a finite number, in SI")


def _not_negative(event: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    _finite(event, attribute, value)
    if value < 0:
        raise InputError(
            f"{type(event).__name__}: a normal load of {value:g} N pulls on the contact; "
            "expected a load of 0 N (lift-off) or more, since the contact does not adhere"
        )


def _one_or_two(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    if not isinstance(value, tuple):
        _finite(event, attribute, value)
    elif len(value) != 2 or not all(each is None or _fits(each) for each in value) or value == (None, None):
        expected = "a finite number, or two, in x and y, in SI; None in one of them leaves that component open"
        raise _field_error(event, attribute.name, value, expected)


def as_numbers(value: float | Iterable[float]) -> float | tuple[float, ...]:
    """Return one number, or several, as floats; what is neither as it is, to be refused by the check."""
    given: Any = value
    single = isinstance(given, str | bytes | Mapping) or getattr(given, "ndim", 1) == 0
    return tuple(map(as_float, given)) if isinstance(given, Iterable) and not single else as_float(given)


def _as_lengths(value: float | Iterable[float] | None) -> tuple[float, ...] | None:
    """Return lengths with or without units [m]."""
    lengths = None if value is None else as_numbers(in_si(value, "m"))
    return lengths if isinstance(lengths, tuple | None) else (lengths,)


def _as_indices(value: int | Iterable[int] | None) -> tuple[int, ...] | None:
    """Return indices of asperities; None stands for all of them."""
    if value is None or isinstance(value, str | bytes | Mapping):
        return value  # type: ignore[return-value] # refused by the check
    given = tuple(value) if isinstance(value, Iterable) else (value,)
    whole = (is_number(index) and not isinstance(index, bool) and index == int(index) for index in given)
    return tuple(map(int, given)) if all(whole) else given


def each_at_least(
    noun: str, least: float, expected: str, *, most: float = math.inf
) -> Callable[[object, "attrs.Attribute[Any]", Any], None]:
    """Return a validator of one number or a tuple of them, each between two others."""

    def check(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        if value == ():
            raise InputError(f"{type(event).__name__}: {attribute.name} is empty; expected one {noun}, or one each")
        for number in value if isinstance(value, tuple) else (value,):
            if not (_fits(number) and least <= number <= most):
                raise _field_error(event, attribute.name, number, expected, is_limited=most < math.inf)

    return check


def _indices(event: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    known = isinstance(value, tuple) and all(type(index) is int and index >= 0 for index in value)
    if value is not None and not (known and value and len(set(value)) == len(value)):
        expected = "indices of asperities, 0 or more, each once"
        raise InputError(f"{type(event).__name__}: {attribute.name} is {value!r}; expected {expected}")


_COEFFICIENT = f"a finite number of 0 or more, {MOST_FRICTION:g} at most (the contact sticks as with any larger one)"
coefficients_within = each_at_least("coefficient", 0.0, _COEFFICIENT, most=MOST_FRICTION)
_lengths = attrs.validators.optional(each_at_least("length", -math.inf, "a finite number, in m"))


# -- the base class ---------------------------------------------------------------------------------------


class Event:
    """A fact with a time: a waypoint of a channel, or a change that acts at once.

    A kind is an attrs class with ``time`` as its first field. The others are numbers, tuples of them, or None, as a log
    stores them.
    """

    __slots__ = ()

    name: ClassVar[str]  #: its name in scenarios and logs
    unit: ClassVar[str] = "1"  #: of its numbers
    channel: ClassVar[str | None] = None  #: of a waypoint: "normal", "tangential" or "friction"
    #: The fields beside the time in their order in a log; by default as they are declared.
    order: ClassVar[tuple[str, ...]] = ()
    noun: ClassVar[str] = "number"  #: what a message calls one of its numbers
    changes_friction: ClassVar[bool] = False
    changes_geometry: ClassVar[bool] = False  #: what it changes, so that it is recorded at each step

    time: float

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it, as far as it alone decides."""
        return self.changes_friction

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of which it is a waypoint; in two tangential directions x and y are one each."""
        return () if self.channel is None else (self.channel,)

    @classmethod
    def fields(cls) -> tuple[str, ...]:
        """Return the names of its fields beside the time, in their order in a log."""
        own: Any = cls
        return cls.order or tuple(field.name for field in attrs.fields(own)[1:])

    def contents(self) -> list[Any]:
        """Return its fields beside the time: numbers, tuples of them, or None for what is left open."""
        return [getattr(self, name) for name in self.fields()]

    @classmethod
    def of(cls, time: float, contents: Sequence[Any]) -> Self:
        """Return the event at a time with these `contents`; fewer leave the last ones open."""
        made: Any = cls
        if len(contents) > len(cls.fields()):
            raise InputError(f"{cls.name} has {len(contents)} lists of numbers; expected {len(cls.fields())} at most")
        event: Self = made(time, **dict(zip(cls.fields(), contents, strict=False)))
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
        """Return what does not fit an ensemble of so many asperities, and what is expected; empty if it fits."""
        chosen: Any = getattr(self, "asperities", None)
        if chosen is not None and max(chosen) >= count:
            return f"asperity {max(chosen)} does not exist; expected indices from 0 to {count - 1}"
        most = count if chosen is None else len(chosen)
        for name in self._lists():
            values = getattr(self, name)
            if self.noun != "number" and isinstance(values, tuple) and len(values) not in {1, most}:
                return (
                    f"{name} has shape ({len(values)},); expected one {self.noun}, or one for each of "
                    f"{counted(most, 'asperity', 'asperities')}"
                )
        return ""

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the `State` of an `Ensemble` behind an `Instrument` after a change; of waypoints nothing acts.

        Facts do not import what they act on, so that whoever reads a log or a result needs no engine.
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
    """What one load channel has reached at a time [s]: a load [N] or a displacement [m], a finite number."""

    time: float = attrs.field(converter=seconds, validator=_finite)
    value: float = attrs.field(converter=as_float, validator=_finite)

    channel: ClassVar[str]

    @property
    def planar(self) -> bool:
        """Whether it has two components, in x and y."""
        return False

    def reached(self, channel: str) -> float:  # noqa: ARG002 - it has one
        """Return what one of its `channels` has reached [N] or [m]."""
        return float(self.value)

    def of_channels(self, channels: Collection[str]) -> Self:  # noqa: ARG002 - it has one
        """Return it as a waypoint of some of its `channels` alone."""
        return self


@EVENTS.register
@attrs.frozen
class NormalLoad(LoadEvent):
    """The total normal load [N] reached at a time; 0 lifts the surface off.

    Examples
    --------
    >>> hs.NormalLoad(0.0, 50e-3)
    NormalLoad(time=0.0, value=0.05)
    """

    value: Force = attrs.field(converter=newtons, validator=_not_negative)
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
ACROSS = "_y"  # ends the name of a channel, or of its column, that is the second tangential component


def _newtons(value: float | Sequence[float | None]) -> Any:
    return convert_each(lambda each: None if each is None else newtons(each), value)


def _metres(value: float | Sequence[float | None]) -> Any:
    return convert_each(lambda each: None if each is None else metres(each), value)


def components_of(value: Any) -> tuple[str, ...]:
    """Return the channels that the value of a tangential waypoint belongs to."""
    channel = TangentialEvent.channel
    if not isinstance(value, tuple):
        return (channel,)
    return tuple(name for name, each in zip((channel, channel + ACROSS), value, strict=False) if each is not None)


@attrs.frozen
class TangentialEvent(LoadEvent):
    """A waypoint of the tangential channel: one number, or two, in x and y.

    Each component is a channel by itself: None in a pair leaves one to other waypoints, of a load or a displacement.
    """

    value: Any
    channel = "tangential"

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of which it is a waypoint: "tangential" is that of x, or of one direction."""
        return components_of(self.value)

    def reached(self, channel: str) -> float:
        """Return what one of its `channels` has reached [N] or [m]."""
        return float(self.value[channel.endswith(ACROSS)] if self.planar else self.value)

    def of_channels(self, channels: Collection[str]) -> Self:
        """Return it as a waypoint of some of its `channels` alone."""
        if not self.planar:
            return self
        x, y = (each if name in channels else None for name, each in zip(_COMPONENTS, self.value, strict=True))
        return attrs.evolve(self, value=(x, y))

    def contents(self) -> list[Any]:
        """Return its value, or each component by itself where one is open."""
        return [*self.value] if self.planar and None in self.value else [self.value]

    @classmethod
    def of(cls, time: float, contents: Sequence[Any]) -> Self:
        """Return the event at a time with these `contents`."""
        made: Any = cls
        event: Self = made(time, tuple(contents)) if len(contents) == 2 else super().of(time, contents)
        return event

    @property
    def planar(self) -> bool:
        """Whether it has two components, in x and y."""
        return isinstance(self.value, tuple)

    @property
    def cell(self) -> str:
        """Its numbers as ``historysim log`` lists them: ``"1e-08"``, or in two directions ``"[1e-08 5e-09]"``."""
        return f"[{' '.join(map(repr, self.value))}]" if self.planar else repr(self.value)


_COMPONENTS = components_of((0.0, 0.0))


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

    value: ForceOrPair = attrs.field(converter=_newtons, validator=_one_or_two)
    name = "tangential_load"
    unit = "N"


@EVENTS.register
@attrs.frozen
class TangentialDisplacement(TangentialEvent):
    """The rigid tangential displacement U [m] reached at a time, or with an `Instrument` that of its drive.

    It is one number, or a pair, in x and y; None in a pair leaves that component to other waypoints.

    Examples
    --------
    >>> hs.TangentialDisplacement(1.0, 10e-9)
    TangentialDisplacement(time=1.0, value=1e-08)
    >>> hs.TangentialDisplacement(1.0, (10e-9, 5e-9))
    TangentialDisplacement(time=1.0, value=(1e-08, 5e-09))

    A stage that is driven in x under a dead weight in y:

    >>> [hs.TangentialLoad(1.0, (None, 5e-3)), hs.TangentialDisplacement(2.0, (10e-9, None))]
    [TangentialLoad(time=1.0, value=(None, 0.005)), TangentialDisplacement(time=2.0, value=(1e-08, None))]
    """

    value: LengthOrPair = attrs.field(converter=_metres, validator=_one_or_two)
    name = "tangential_displacement"
    unit = "m"


@EVENTS.register
@attrs.frozen
class FrictionChange(Event):
    """A new friction coefficient from a time on.

    It acts at once, after the load channels have arrived at that time. Springs that the new, lower
    limit cannot hold slip; under load control the tangential displacement then jumps to restore the
    load. A rise changes nothing until the next load. A negative coefficient is an InputError.

    Parameters
    ----------
    time : float
        Time [s].
    friction : float or sequence of float
        One coefficient for all asperities, or one for each, in the order of the ensemble.
    asperities : sequence of int, optional
        Indices of those that it is for; all by default.

    Examples
    --------
    >>> hs.FrictionChange(2.0, 0.15)
    FrictionChange(time=2.0, friction=0.15, asperities=None)
    """

    time: float = attrs.field(converter=seconds, validator=_finite)
    friction: Numbers = attrs.field(converter=as_numbers, validator=coefficients_within)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=_as_indices, validator=_indices)

    name = "friction"
    noun = "coefficient"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it, as far as it alone decides."""
        return self.asperities is not None or _differ(self.friction)

    def contents(self) -> list[Any]:
        """Return the coefficients, and for which asperities; for all of them the coefficients alone."""
        return [self.friction] if self.asperities is None else [self.friction, self.asperities]

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the state after it; errors as for `Ensemble.with_friction`."""
        del saturate
        return ensemble.with_friction(state, self.friction, asperities=self.asperities, instrument=instrument)


@EVENTS.register
@attrs.frozen
class FrictionRamp(Event):
    """The friction coefficient reached at a time: a waypoint of friction, which runs straight between its waypoints.

    Friction goes there from where it stands at the waypoint before, or at the event time before where it is the first.
    Rows of a table μ(t) are such events. A negative coefficient is an InputError.

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
        """Whether asperities have different friction after it."""
        return _differ(self.friction)


OneOrMore = Annotated[tuple[float, ...], Quantity("m", alone=True)]


@EVENTS.register
@attrs.frozen
class GeometryChange(Event):
    """Other summits from a time on: each that changes is a new contact, and what it remembered is erased.

    It acts at once, after the load channels have arrived at that time. Then each channel goes back to where it was:
    controlled loads are restored. Asperities that get the height and radius that they have remember. Neither heights
    nor radii are an InputError.
    """

    time: float = attrs.field(converter=seconds, validator=_finite)  #: [s]
    #: New heights over the datum of the ensemble [m], one for all asperities or one each; by default they stay.
    summit_height: OneOrMore | None = attrs.field(default=None, converter=_as_lengths, validator=_lengths)
    #: New radii [m], likewise.
    summit_radius: OneOrMore | None = attrs.field(default=None, converter=_as_lengths, validator=_lengths)
    #: Indices of those that they are for; all by default, as when the whole surface is replaced.
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=_as_indices, validator=_indices)

    name = "geometry"
    unit = "m"
    noun = "length"
    order = ("asperities", "summit_height", "summit_radius")
    changes_geometry = True

    def __attrs_post_init__(self) -> None:
        """Check that something changes, to something that a summit can have."""
        if self.summit_height is None and self.summit_radius is None:
            raise InputError("GeometryChange: neither summit_height nor summit_radius; expected one of them, or both")
        if self.summit_radius is not None and min(self.summit_radius) <= 0:
            raise InputError(f"GeometryChange: summit_radius is {min(self.summit_radius):g}; expected more than 0 m")

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:
        """Return the state after it; errors as for `Ensemble.with_geometry`."""
        return ensemble.with_geometry(
            state,
            summit_height=self.summit_height,
            summit_radius=self.summit_radius,
            asperities=self.asperities,
            saturate=saturate,
            instrument=instrument,
        )


# Those that a load channel reaches something with; how it is controlled is a matter of the core.
LOAD_KINDS: Mapping[str, type[LoadEvent]] = {
    name: kind for name, kind in EVENTS.own().items() if issubclass(kind, LoadEvent)
}


def load_kind(channel: str) -> type[LoadEvent]:
    """Return the kind of event that a column of a channel, or of its second component, is of."""
    return LOAD_KINDS[channel.removesuffix(ACROSS)]
