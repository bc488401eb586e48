"""A sequence of events: whether it is in order, how long it lasts, and its digest."""

import hashlib
import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

from historysim.basics.units import duration_text
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.loads.events import EVENT_KINDS, Event, LoadEvent


def time_text(time: float) -> str:
    """Write a time with as many digits as tell it from any other: ``"12.5 s"``."""
    return f"{repr(float(time)).removesuffix('.0')} s"


def as_events(given: Iterable[Event]) -> Sequence[Event]:
    """Return an argument that is a sequence of events; what it holds is checked by `check_sequence`.

    Raises InputError: what cannot be one.
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

    Raises InputError: a thing that is not an event, or a time before the one of the event in front of it.
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


def _hex(value: object) -> object:
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
