"""Canonical form of events: arrays in a log, and their digests."""

import hashlib
import itertools
import json
import struct
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from historysim.basics.arguments import Floats, workable
from historysim.errors import InputError, MissingPackageError
from historysim.loads.event_sequence import KINDS, Events, Loads, to_loads
from historysim.loads.events import (
    EVENTS,
    Event,
    FrictionChange,
    FrictionRamp,
    GeometryChange,
    LoadEvent,
    TangentialDisplacement,
    TangentialLoad,
)

ONE_COEFFICIENT, MANY_COEFFICIENTS, NAMED = 4, 5, 9
# Kinds stored as lists of numbers, tangential ones with two components; any other is `NAMED`, and its
# name is the first list.
LISTED: dict[int, type[Event]] = {
    6: FrictionChange,
    7: FrictionRamp,
    8: GeometryChange,
    10: TangentialLoad,
    11: TangentialDisplacement,
}
ABSENT, ALONE = -1, -2  # the length of a missing list, and of one number for all asperities
LINK = struct.Struct("<qqq")


class Columns(NamedTuple):
    """Events as bytes of little-endian arrays: a kind each (int8), a time and a value (float64).

    The value of an event with several numbers is how many it has in ``coefficients`` (float64).
    They are stored there in the order of events, each list after its length, `ABSENT` or `ALONE`.
    """

    kind: bytes
    time: bytes
    value: bytes
    coefficients: bytes


def to_columns(events: Sequence[Event]) -> Columns:
    """Convert validated events to columns."""
    loads = to_loads(events)
    if loads is not None:
        return Columns(loads.kind.tobytes(), _floats(loads.time), _floats(loads.value), b"")
    kinds, values, numbers = zip(*map(_row, events), strict=True) if events else ((), (), ())
    times = [event.time for event in events]
    return Columns(
        bytes(kinds), _floats(times), _floats(values), _floats([*itertools.chain(*numbers)])
    )


def _row(event: Event) -> tuple[int, float, Sequence[float]]:
    """Return kind, value and further numbers of an event."""
    if isinstance(event, LoadEvent) and not event.planar:
        return KINDS.index(type(event)), event.value, ()
    if type(event) is FrictionChange and event.asperities is None:
        if isinstance(event.friction, tuple):
            return MANY_COEFFICIENTS, len(event.friction), event.friction
        return ONE_COEFFICIENT, event.friction, ()
    code = next((code for code, kind in LISTED.items() if kind is type(event)), NAMED)
    numbers: list[float] = []
    for item in event.contents() if code != NAMED else [_name(event), *event.contents()]:
        # one coefficient for all is no list of one
        is_single = isinstance(item, float)
        count = ABSENT if item is None else ALONE if is_single else len(item)
        numbers += [float(count), *([item] if is_single else item or ())]
    return code, len(numbers), numbers


def from_columns(columns: Columns) -> Events:
    """Convert columns to events; InputError if they are not in the form of `to_columns`."""
    kinds = np.frombuffer(columns.kind, dtype=np.int8)
    if (
        any(len(column) != 8 * kinds.size for column in (columns.time, columns.value))
        or len(columns.coefficients) % 8
    ):
        raise InputError("holds columns of different lengths")
    times, values = (np.frombuffer(column, dtype="<f8") for column in (columns.time, columns.value))
    coefficients = np.frombuffer(columns.coefficients, dtype="<f8")
    if not all(np.isfinite(column).all() for column in (times, values, coefficients)):
        raise InputError("holds numbers that are infinite, or none")
    for name, column in (("a time", times), ("a value", values), ("a coefficient", coefficients)):
        workable(name, column)
    if (np.diff(times) < 0).any():
        raise InputError("holds times that fall")
    if kinds.size and not 0 <= kinds.min() <= kinds.max() <= max(LISTED):
        raise InputError(
            "holds a kind of event that this version does not know; a later version has written it"
        )
    is_load = kinds < ONE_COEFFICIENT
    if is_load.all():
        return Events(loads=Loads(kinds, times, values))
    events = np.empty(kinds.size, dtype=object)
    events[is_load] = list(Events(loads=Loads(kinds[is_load], times[is_load], values[is_load])))
    used = 0
    for index in np.flatnonzero(~is_load):
        kind, time, value = int(kinds[index]), float(times[index]), float(values[index])
        count = 0 if kind == ONE_COEFFICIENT else int(value)
        if not 0 <= count <= coefficients.size - used:
            raise InputError("holds an event with more numbers than are there")
        numbers = coefficients[used : used + count].tolist()
        used += count
        if kind in {ONE_COEFFICIENT, MANY_COEFFICIENTS}:
            events[index] = FrictionChange(
                time, value if kind == ONE_COEFFICIENT else tuple(numbers)
            )
        else:
            events[index] = _from_lists(kind, time, numbers)
    return Events(events)


def _from_lists(code: int, time: float, numbers: list[float]) -> Event:
    """Make an event from the numbers of `_row`; InputError for other numbers."""
    lists: list[Any] = []
    position = 0
    while position < len(numbers):
        count, position = int(numbers[position]), position + 1
        values = tuple(numbers[position : position + (1 if count == ALONE else max(count, 0))])
        lists.append(None if count == ABSENT else values[0] if count == ALONE else values)
        position += len(values)
    kind = LISTED[code] if code != NAMED else _kind_by_name(lists.pop(0) if lists else None)
    try:
        return kind.from_contents(time, lists)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"holds an event {kind.name!r} with other numbers than it has ({error})"
        ) from error


def _name(event: Event) -> tuple[float, ...]:
    """Return the name of an event and of its package as numbers (their bytes).

    Raises InputError: the name is not known, so that the event could not be read again.
    """
    if EVENTS.get(event.name) is not type(event):
        raise InputError(
            f"the event {event.name!r} cannot be written down: {type(event).__name__} is not known by that name; "
            f"expected a class below @register, or one that its package declares in {EVENTS.group}"
        )
    return tuple(map(float, f"{event.name}\0{EVENTS.provider(type(event)) or ''}".encode()))


def _kind_by_name(numbers: float | tuple[float, ...] | None) -> type[Event]:
    if not isinstance(numbers, tuple):
        raise InputError("holds an event without a name")
    try:
        name, _, package = bytes(map(int, numbers)).decode().partition("\0")
    except ValueError as error:
        raise InputError("holds an event with a name that is no string") from error
    if name not in EVENTS:
        raise MissingPackageError(
            f"holds an event {name!r} of {package}, which is not there; install that package, or where it is a module "
            "of your own, import it first"
        )
    return EVENTS[name]


def _floats(values: Sequence[float] | Floats) -> bytes:
    return np.array(values, dtype="<f8").tobytes()


def link(previous: bytes, start: int, columns: Columns) -> bytes:
    """Return the SHA-256 of a batch after ``start`` events, chained to the previous link (first that in the head)."""
    total = hashlib.sha256(
        previous + LINK.pack(start, len(columns.kind), len(columns.coefficients))
    )
    for column in columns:
        total.update(column)
    return total.digest()


def array_digest(arrays: Iterable[tuple[str, Floats]], text: str) -> bytes:
    """Return the SHA-256 of a string, and of named arrays with their shapes, as little-endian float64."""
    total = hashlib.sha256(hashlib.sha256(text.encode()).digest())
    for name, array in arrays:
        total.update(json.dumps([name, array.shape]).encode())
        total.update(array.astype("<f8", copy=False).tobytes())
    return total.digest()


def chain(
    previous: bytes, events: Sequence[Event], ends: Sequence[int]
) -> Iterator[tuple[int, int, Columns, bytes]]:
    """Yield batches of events: number of events before and after each, its columns and its link.

    The first of the ``ends`` is the number of events before all of them, after the link
    ``previous``.
    """
    for start, stop in itertools.pairwise(ends):
        columns = to_columns(events[start - ends[0] : stop - ends[0]])
        previous = link(previous, start, columns)
        yield start, stop, columns, previous
