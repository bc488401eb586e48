"""Sequences of events, as objects or arrays: order, duration and digest."""

import hashlib
import itertools
import json
import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple, Self, overload

import numpy as np

from historysim.basics.arguments import Array, Floats, workable
from historysim.basics.units import duration_text
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.loads.events import (
    EVENTS,
    LOAD_KINDS,
    Event,
    LoadEvent,
    NormalLoad,
    TangentialDisplacement,
    TangentialEvent,
)

# What a load channel reaches something with, in the order of their numbers in arrays and in logs.
KINDS = tuple(LOAD_KINDS.values())
LINES_AT_ONCE = 1 << 16  # lines of a digest that are in memory together
_CODE = {kind: number for number, kind in enumerate(KINDS)}
_TANGENTIAL = [number for number, kind in enumerate(KINDS) if kind.channel == "tangential"]


class Loads(NamedTuple):
    """Load events (of `KINDS`) as arrays (event): number of the kind (int8), time [s], value."""

    kind: Array
    time: Floats
    value: Floats

    def part(self, where: slice) -> Self:
        """Return a slice of the events."""
        return type(self)(*(column[where] for column in self))


class Events(Sequence[Event]):
    """Events in the given order, as objects, or as arrays if all are loads; each form is made from the other on demand.

    ``loads`` are numbers that are checked already, in place of events.
    """

    def __init__(self, events: Iterable[Event] = (), *, loads: Loads | None = None) -> None:
        if loads is None:
            self._objects = tuple(events)
        else:
            self.loads = loads

    @cached_property
    def loads(self) -> Loads | None:
        """All events as arrays; None if one is not a load, or has two tangential components."""
        try:
            kind = np.fromiter(
                map(_CODE.__getitem__, map(type, self._objects)), dtype=np.int8, count=len(self)
            )
            time, value = (
                np.fromiter(map(attrgetter(name), self._objects), dtype=float, count=len(self))
                for name in ("time", "value")
            )
        except (KeyError, ValueError):
            # a pair is no number of an array
            return None
        return Loads(kind, time, value)

    @cached_property
    def _objects(self) -> tuple[Event, ...]:
        loads = self.loads
        assert loads is not None  # noqa: S101 - it has one or the other
        return tuple(_make_events(loads))

    def __len__(self) -> int:
        """Return the number of events."""
        if "_objects" in vars(self):
            return len(self._objects)
        loads = self.loads
        assert loads is not None  # noqa: S101 - as above
        return loads.time.size

    def __iter__(self) -> Iterator[Event]:
        return iter(self._objects)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> "Events": ...
    def __getitem__(self, index: int | slice) -> "Event | Events":
        """Return an event, or the events of a slice."""
        # objects are not converted for a few of them
        loads = vars(self).get("loads") if "_objects" in vars(self) else self.loads
        if isinstance(index, slice):
            return (
                Events(self._objects[index]) if loads is None else Events(loads=loads.part(index))
            )
        if "_objects" in vars(self) or loads is None:
            return self._objects[index]
        index = range(len(self))[index]
        return _make_events(loads.part(slice(index, index + 1)))[0]

    @classmethod
    def join(cls, sequences: Iterable[Self]) -> Self:
        """Concatenate several sequences of events."""
        sequences = list(sequences)
        loads = [sequence.loads for sequence in sequences if sequence.loads is not None]
        if len(loads) == len(sequences) > 0:
            return cls(loads=Loads(*map(np.concatenate, zip(*loads, strict=True))))
        return cls(itertools.chain.from_iterable(sequences))

    def __eq__(self, other: object) -> bool:
        """Return True if another sequence has the same events."""
        return isinstance(other, Sequence) and len(self) == len(other) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment] # as of any sequence that can be long

    def __repr__(self) -> str:
        return repr(list(self))


class SampledLoads(Events):
    """Events of a record: at each sample a normal load and a tangential displacement, in this order.

    They are replayed like single events, but each sample is a separate step, even if times repeat.
    Arrays are (sample): times, which do not decrease [s], normal loads of 0 or more [N], and
    displacements [m], those of the drive where there is an instrument. A number beyond the sizes
    that are computed with is an InputError.
    """

    def __init__(self, time: Floats, normal_load: Floats, tangential_displacement: Floats) -> None:
        columns = {
            "time": time,
            "normal_load": normal_load,
            "tangential_displacement": tangential_displacement,
        }
        for name, values in columns.items():
            workable(name, values)
        self.time, self.normal_load, self.tangential_displacement = (
            time,
            normal_load,
            tangential_displacement,
        )

    @cached_property
    def loads(self) -> Loads:
        """Both events of each sample as arrays, which a replay does not need."""
        kinds = np.array([_CODE[NormalLoad], _CODE[TangentialDisplacement]], dtype=np.int8)
        values = np.column_stack([self.normal_load, self.tangential_displacement])
        return Loads(np.tile(kinds, self.time.size), np.repeat(self.time, 2), values.ravel())

    def __len__(self) -> int:
        """Return the number of events."""
        return 2 * self.time.size


def to_loads(events: Sequence[Event]) -> Loads | None:
    """Convert events to arrays; None if one is not a load in one direction."""
    if isinstance(events, Events):
        return events.loads
    return Events(events).loads if isinstance(events, list | tuple) else None


def are_loads(events: Sequence[Event]) -> bool:
    """Return True if all events are loads or displacements in one tangential direction."""
    return isinstance(events, SampledLoads) or to_loads(events) is not None


def is_planar(events: Sequence[Event]) -> bool:
    """Return True if events move the contact in two tangential directions."""
    return components(events) == {2}


def components(events: Sequence[Event]) -> set[int]:
    """Return the numbers of components of tangential waypoints: 1, 2, both, or none."""
    if isinstance(events, SampledLoads):
        return {1}
    loads = to_loads(events)
    if loads is not None:
        return {1} if np.isin(loads.kind, _TANGENTIAL).any() else set()
    return {2 if event.planar else 1 for event in events if isinstance(event, TangentialEvent)}


def channel_values(events: Sequence[Event], kind: type[LoadEvent]) -> Floats:
    """Return the values of all events of one type in SI units (event), or (event, 2) in two directions.

    An open component of a pair is NaN, and the second one of a number among pairs.
    """
    loads = to_loads(events)
    if loads is None:
        given: list[Any] = [event.value for event in events if isinstance(event, kind)]
        if any(np.ndim(value) for value in given):
            given = [value if np.ndim(value) else (value, math.nan) for value in given]
        return np.array(given, dtype=float)
    values: Floats = loads.value[loads.kind == _CODE[kind]]
    return values


def check_pressing(events: Sequence[Event]) -> None:
    """Check that no normal load pulls; otherwise InputError."""
    if not channel_values(events, NormalLoad).min(initial=0.0) < 0.0:
        return
    for index, event in enumerate(events):
        if isinstance(event, NormalLoad) and event.value < 0.0:
            problem = InputError(
                f"a normal load of {event.value:g} N pulls on the contact; expected a load of 0 N (lift-off) or more, "
                "or an ensemble with attraction"
            )
            raise InputError.for_event(index, time_text(event.time), problem)


def _make_events(loads: Loads) -> list[Event]:
    """Make events from validated numbers, without validating them again."""
    events = [object.__new__(KINDS[kind]) for kind in loads.kind.tolist()]
    # slots of a frozen class are set by their descriptors, which all kinds have of their own
    for code in np.unique(loads.kind).tolist():
        where = np.flatnonzero(loads.kind == code).tolist()
        events_of_kind = [events[index] for index in where]
        for name in ("time", "value"):
            setter: Any = getattr(KINDS[code], name)
            deque(
                map(setter.__set__, events_of_kind, getattr(loads, name)[where].tolist()), maxlen=0
            )
    return list(events)


def time_text(time: float) -> str:
    """Write a time with as many digits as distinguish it from any other: ``"12.5 s"``."""
    return f"{repr(float(time)).removesuffix('.0')} s"


def as_events(argument: Iterable[Event]) -> Sequence[Event]:
    """Convert an argument to a sequence of events, unchecked; InputError if it is not iterable."""
    events: Any = argument
    if not isinstance(events, Iterable):
        raise InputError(f"events is {argument!r}; expected a list of load events")
    return events if isinstance(events, Events) else Events(events)


def events_text(events: Sequence[Event]) -> str:
    """Describe number and duration of events: ``"2,000 events over 198 s"``."""
    return f"{count_text(len(events), 'event', 'events')}{over_text(events)}"


def over_text(events: Sequence[Event]) -> str:
    """Describe the duration of events, to follow their number: ``" over 198 s"``; empty if unknown."""
    # a Replay shows itself before its events are checked
    if not events or not all(isinstance(event, Event) for event in (events[0], events[-1])):
        return ""
    return f" over {duration_text(events[-1].time - events[0].time)}"


def check_sequence(events: Sequence[Event]) -> None:
    """Check that all items are events and times do not decrease; otherwise InputError."""
    loads = to_loads(events)
    if loads is not None and (loads.time[1:] >= loads.time[:-1]).all():
        return
    previous = -math.inf
    for index, event in enumerate(events):
        if not isinstance(event, Event) or type(event) is LoadEvent:
            raise InputError(
                f"event {index}: {event!r} is not a load event; expected "
                f"{', '.join(kind.__name__ for kind in EVENTS.own().values())}"
            )
        if event.time < previous:
            raise InputError(
                f"event {index} at t = {time_text(event.time)}: comes after an event at t = {time_text(previous)}; "
                "expected times that do not decrease; sort the events by time (sorted(events, key=lambda event: "
                "event.time) keeps the order of those at one time)"
            )
        previous = event.time
    check_components(components(events))


def check_components(counts: set[int]) -> None:
    """Check that all tangential waypoints have one component, or all have two; otherwise InputError."""
    if len(counts) > 1:
        raise InputError(
            "some tangential loads or displacements are one number and some are two; expected two in each, in x and y, "
            "such as (5e-9, 0.0)"
        )


def _hex(value: object) -> object:
    if isinstance(value, tuple):
        return [_hex(item) for item in value]
    return value.hex() if isinstance(value, float) else value


def digest(events: Iterable[Event]) -> str:
    """Return the SHA-256 of events: of their types, order and every bit of their numbers."""
    total = hashlib.sha256()
    loads = to_loads(events) if isinstance(events, Sequence) else None
    if loads is None:
        for event in events:
            line = json.dumps(
                [type(event).__name__, event.time.hex(), *map(_hex, event.contents())]
            )
            total.update(line.encode() + b"\n")
        return total.hexdigest()
    names = _characters(f'["{kind.__name__}", "' for kind in KINDS)
    between, line_end = _characters(['", "']), _characters(['"]\n'])
    for start in range(0, loads.time.size, LINES_AT_ONCE):
        # the same lines as from JSON, as arrays
        block = loads.part(slice(start, start + LINES_AT_ONCE))
        zeros = np.zeros(block.time.size, dtype=np.intp)
        lines = np.hstack(
            [
                names[block.kind],
                *_hexes(block.time),
                between[zeros],
                *_hexes(block.value),
                line_end[zeros],
            ]
        )
        total.update(lines[lines != 0].tobytes())
    return total.hexdigest()


def _characters(texts: Iterable[str]) -> Array:
    """Return ASCII strings as arrays of characters (string, character), padded with 0."""
    table = np.array([text.encode() for text in texts])
    return table.view(np.uint8).reshape(table.size, -1)


def _hexes(values: Floats) -> tuple[Array, Array, Array]:
    """Return `float.hex` of finite numbers as characters: in front of 13 digits, the digits, and the exponent."""
    bits = np.ascontiguousarray(values, dtype=">f8").view(">u8").astype(np.uint64)
    digits = (
        np.frombuffer(bits.astype(">u8").tobytes().hex().encode(), np.uint8)
        .reshape(-1, 16)[:, 3:]
        .copy()
    )
    zero = values == 0
    digits[zero, 1:] = 0
    # sign and biased exponent, and a flag of zeros, which have one digit and the exponent 0
    powers, where = np.unique((bits >> np.uint64(52)) + zero * np.uint64(4096), return_inverse=True)
    exponents = [(power >> 11 & 1, power & 2047, power >> 12) for power in powers.tolist()]
    front = _characters(f"{'-' * sign}0x{int(biased > 0)}." for sign, biased, _ in exponents)
    back = _characters(
        f"p{0 if is_zero else max(biased, 1) - 1023:+d}" for _, biased, is_zero in exponents
    )
    return front[where], digits, back[where]
