"""Load events: facts about what the load channels have reached, and when.

Loads are waypoints, as in an amplitude table: an event says what its channel has reached at its
time, and a channel runs straight between its own waypoints.
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import attrs

from historysim.basics.registry import Registry
from historysim.basics.units import as_float, metres, newtons, seconds
from historysim.errors import InputError
from historysim.loads.event_contents import (
    Number,
    as_coefficients,
    as_indices,
    as_lengths,
    chosen_in,
    chosen_text,
    coefficients_in,
    differ,
    finite,
    lists_misfit,
    not_negative,
    numbers_in,
    numbers_text,
    valid_coefficients,
    valid_indices,
    valid_lengths,
)

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
        return " | ".join(map(numbers_text, self.contents()))

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        return cls.of(time, [numbers_in(part, number) for part in text.split("|")])

    def misfit(self, count: int) -> str:
        """Return what does not fit an ensemble of so many asperities, with what is expected; empty if it does."""
        del count
        return ""

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:  # noqa: ANN401 - as it says
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

    time: float = attrs.field(converter=seconds, validator=finite)
    value: float = attrs.field(converter=as_float, validator=finite)

    channel: ClassVar[str]

    def contents(self) -> list[Any]:
        """Return the value."""
        return [self.value]

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        return cls(time, number(text))


@EVENTS.register
@attrs.frozen
class NormalLoad(LoadEvent):
    """The total normal load [N] reached at a time; 0 lifts the surface off.

    Examples
    --------
    >>> hs.NormalLoad(0.0, 50e-3)
    NormalLoad(time=0.0, value=0.05)
    """

    value: float = attrs.field(converter=newtons, validator=not_negative)
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

    value: float = attrs.field(converter=metres, validator=finite)
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

    value: float = attrs.field(converter=newtons, validator=finite)
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

    value: float = attrs.field(converter=metres, validator=finite)
    name = "tangential_displacement"
    channel = "tangential"
    unit = "m"


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

    time: float = attrs.field(converter=seconds, validator=finite)
    friction: float | tuple[float, ...] = attrs.field(converter=as_coefficients, validator=valid_coefficients)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=as_indices, validator=valid_indices)

    name = "friction"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it, as far as it alone tells."""
        return self.asperities is not None or differ(self.friction)

    def contents(self) -> list[Any]:
        """Return the coefficients, and for which asperities; for all of them the coefficients alone."""
        return [self.friction] if self.asperities is None else [self.friction, self.asperities]

    @property
    def cell(self) -> str:
        """What it says, in a table of events."""
        return f"{chosen_text(self.asperities)}{numbers_text(self.friction)}"

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        chosen, coefficients = chosen_in(text)
        return cls(time, coefficients_in(coefficients, number), chosen)

    def misfit(self, count: int) -> str:
        """Return what does not fit so many asperities."""
        return lists_misfit(count, self.asperities, {"friction": self.friction}, "coefficient")

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:  # noqa: ANN401 - see `Event.act`
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

    time: float = attrs.field(converter=seconds, validator=finite)
    friction: float | tuple[float, ...] = attrs.field(converter=as_coefficients, validator=valid_coefficients)

    name = "friction_ramp"
    channel = "friction"
    changes_friction = True

    @property
    def differs(self) -> bool:
        """Whether asperities have different friction after it."""
        return differ(self.friction)

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        return cls(time, coefficients_in(text, number))

    def misfit(self, count: int) -> str:
        """Return what does not fit so many asperities."""
        return lists_misfit(count, None, {"friction": self.friction}, "coefficient")


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

    time: float = attrs.field(converter=seconds, validator=finite)
    summit_height: tuple[float, ...] | None = attrs.field(default=None, converter=as_lengths, validator=valid_lengths)
    summit_radius: tuple[float, ...] | None = attrs.field(default=None, converter=as_lengths, validator=valid_lengths)
    asperities: tuple[int, ...] | None = attrs.field(default=None, converter=as_indices, validator=valid_indices)

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
        return f"{chosen_text(self.asperities)}{heights} | {radii}"

    @classmethod
    def from_cell(cls, time: float, text: str, number: Number) -> Self:
        """Return the event that `cell` told."""
        chosen, lengths = chosen_in(text)
        heights, _, radii = lengths.partition("|")
        height, radius = (tuple(map(number, each.split())) or None for each in (heights, radii))
        return cls(time, height, radius, chosen)

    def misfit(self, count: int) -> str:
        """Return what does not fit so many asperities."""
        lists = {"summit_height": self.summit_height, "summit_radius": self.summit_radius}
        return lists_misfit(count, self.asperities, lists, "length")

    def act(self, ensemble: Any, state: Any, *, saturate: bool, instrument: Any) -> Any:  # noqa: ANN401 - see `Event.act`
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
