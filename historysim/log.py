"""The event log: what a history was made from."""

import hashlib
import json
from collections.abc import Iterable

from historysim.events import Event, FrictionChange


def digest(events: Iterable[Event]) -> str:
    """SHA-256 of a sequence of events, over a canonical form that covers kind, order and every bit of the numbers."""
    total = hashlib.sha256()
    for event in events:
        value = event.friction if isinstance(event, FrictionChange) else event.value
        numbers = [number.hex() for number in value] if isinstance(value, tuple) else value.hex()
        total.update(json.dumps([type(event).__name__, event.time.hex(), numbers]).encode() + b"\n")
    return total.hexdigest()
