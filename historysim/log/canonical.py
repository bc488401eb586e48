"""The canonical form of events: the arrays that stand in a log, and the digests over them."""

import hashlib
import json
import struct
from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.loads.events import (
    LOAD_KINDS,
    Event,
    FrictionChange,
    FrictionRamp,
    GeometryChange,
    LoadEvent,
    contents,
)

KINDS = tuple(LOAD_KINDS.values())
ONE_COEFFICIENT, MANY_COEFFICIENTS, FRICTION_OF_SOME, FRICTION_RAMP, GEOMETRY = range(len(KINDS), len(KINDS) + 5)
ABSENT, ALONE = -1, -2
"""In the place of the length of a list: for one that is not given, and for a number that stands for all asperities."""
LINK = struct.Struct("<qqq")


class Columns(NamedTuple):
    """Events as bytes of little-endian arrays: a kind each (int8), a time and a value (float64).

    A change of friction for each asperity has the number of its coefficients as value; they stand, one change after
    the other, in ``coefficients`` (float64). So do the numbers of other events, list by list: how many there are,
    `ABSENT` or `ALONE`, and then those.
    """

    kind: bytes
    time: bytes
    value: bytes
    coefficients: bytes


def columns_of(events: Sequence[Event]) -> Columns:
    """Return events, which have been checked, in columns."""
    code = {kind: number for number, kind in enumerate(KINDS)}
    kinds = bytearray()
    values: list[float] = []
    coefficients: list[float] = []
    for event in events:
        if isinstance(event, LoadEvent):
            kinds.append(code[type(event)])
            values.append(event.value)
        elif isinstance(event, FrictionRamp | GeometryChange) or event.asperities is not None:
            kinds.append(_LISTED[type(event)])
            numbers = _listed(event)
            values.append(float(len(numbers)))
            coefficients += numbers
        elif isinstance(event.friction, tuple):
            kinds.append(MANY_COEFFICIENTS)
            values.append(float(len(event.friction)))
            coefficients += event.friction
        else:
            kinds.append(ONE_COEFFICIENT)
            values.append(event.friction)
    time = np.fromiter((event.time for event in events), dtype="<f8", count=len(events))
    return Columns(bytes(kinds), time.tobytes(), _floats(values), _floats(coefficients))


def events_of(columns: Columns) -> list[Event]:
    """Return the events that stand in columns; columns that `columns_of` does not make are an InputError."""
    kinds = np.frombuffer(columns.kind, dtype=np.int8)
    if any(len(column) != 8 * kinds.size for column in (columns.time, columns.value)) or len(columns.coefficients) % 8:
        raise InputError("holds columns of different lengths")
    times, values = (np.frombuffer(column, dtype="<f8") for column in (columns.time, columns.value))
    coefficients = np.frombuffer(columns.coefficients, dtype="<f8")
    if not all(np.isfinite(column).all() for column in (times, values, coefficients)):
        raise InputError("holds numbers that are infinite, or none")
    if (np.diff(times) < 0).any():
        raise InputError("holds times that fall")
    if kinds.size and not 0 <= kinds.min() <= kinds.max() <= GEOMETRY:
        raise InputError("holds a kind of event that this version does not know; a later version has written it")
    found = np.empty(kinds.size, dtype=object)
    for code, kind in enumerate(KINDS):
        where = np.flatnonzero(kinds == code)
        found[where] = _made(kind, times[where].tolist(), values[where].tolist())
    used = 0
    for index in np.flatnonzero(kinds >= ONE_COEFFICIENT):
        time, count = float(times[index]), 0 if kinds[index] == ONE_COEFFICIENT else int(values[index])
        if not 0 <= count <= coefficients.size - used:
            raise InputError("holds an event with more numbers than are there")
        numbers = coefficients[used : used + count].tolist()
        used += count
        if kinds[index] == ONE_COEFFICIENT:
            found[index] = FrictionChange(time, float(values[index]))
        elif kinds[index] == MANY_COEFFICIENTS:
            found[index] = FrictionChange(time, tuple(numbers))
        else:
            found[index] = _from_lists(int(kinds[index]), time, numbers)
    return list(found)


_LISTED = {FrictionChange: FRICTION_OF_SOME, FrictionRamp: FRICTION_RAMP, GeometryChange: GEOMETRY}


def _listed(event: FrictionChange | FrictionRamp | GeometryChange) -> list[float]:
    """Return what an event says as lists of numbers, one after the other, each with how many there are."""
    numbers: list[float] = []
    for told in contents(event):
        # one coefficient for all is no list of one
        values = (told,) if isinstance(told, float) else told or ()
        count = ABSENT if told is None else ALONE if isinstance(told, float) else len(values)
        numbers += [float(count), *values]
    return numbers


def _from_lists(kind: int, time: float, numbers: list[float]) -> Event:
    """Return the event that `_listed` told; numbers that it does not make are an InputError."""
    lists: list[Any] = []
    place = 0
    while place < len(numbers):
        count, place = int(numbers[place]), place + 1
        values = tuple(numbers[place : place + (1 if count == ALONE else max(count, 0))])
        lists.append(None if count == ABSENT else values[0] if count == ALONE else values)
        place += len(values)
    if len(lists) != {FRICTION_OF_SOME: 2, FRICTION_RAMP: 1, GEOMETRY: 3}[kind]:
        raise InputError("holds an event with other numbers than it has")
    if kind == GEOMETRY:
        return GeometryChange(time, asperities=lists[0], summit_height=lists[1], summit_radius=lists[2])
    return FrictionRamp(time, lists[0]) if kind == FRICTION_RAMP else FrictionChange(time, lists[0], lists[1])


def _made(kind: type[LoadEvent], times: list[float], values: list[float]) -> list[LoadEvent]:
    """Make events of numbers that were checked when they came in: a million in the time of a tenth of them."""
    events = [object.__new__(kind) for _ in times]
    setters: dict[str, Any] = {field.name: getattr(kind, field.name).__set__ for field in attrs.fields(kind)}
    deque(map(setters["time"], events, times), maxlen=0)
    deque(map(setters["value"], events, values), maxlen=0)
    return events


def _floats(values: list[float]) -> bytes:
    return np.array(values, dtype="<f8").tobytes()


def link(before: bytes, first: int, columns: Columns) -> bytes:
    """Return the SHA-256 of a batch behind so many events, chained to the link before it, first that of the head."""
    total = hashlib.sha256(before + LINK.pack(first, len(columns.kind), len(columns.coefficients)))
    for column in columns:
        total.update(column)
    return total.digest()


def array_digest(arrays: Iterable[tuple[str, Floats]], text: str) -> bytes:
    """SHA-256 of a text, and of named arrays with their shapes, as little-endian float64."""
    total = hashlib.sha256(hashlib.sha256(text.encode()).digest())
    for name, array in arrays:
        total.update(json.dumps([name, array.shape]).encode())
        total.update(array.astype("<f8", copy=False).tobytes())
    return total.digest()
