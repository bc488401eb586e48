"""A friction coefficient that changes with time or with the sliding distance: running-in, wear of a film."""

from collections.abc import Sequence
from typing import Literal

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Floats, checked
from historysim.errors import InputError
from historysim.loads.events import Event, FrictionChange, LoadEvent, TangentialDisplacement

Over = Literal["time", "distance"]


def _places(values: npt.ArrayLike) -> Floats:
    return checked("place", values)


def _coefficients(values: npt.ArrayLike) -> Floats:
    return checked("coefficient", values, least=0)


@attrs.frozen(eq=False)
class FrictionCourse:
    """A friction coefficient over time or distance, straight between its points, and as at its ends beyond them.

    Places are times [s] or distances [m], rising: the path length of the tangential displacement, both ways counting.
    The coefficients μ ≥ 0 are those of all asperities. Anything else is an InputError.
    """

    over: Over
    place: Floats = attrs.field(converter=_places)
    coefficient: Floats = attrs.field(converter=_coefficients)

    def __attrs_post_init__(self) -> None:
        """Check that the two belong together."""
        if self.over not in {"time", "distance"}:
            raise InputError(f"over is {self.over!r}; expected 'time' or 'distance'")
        if self.place.ndim != 1 or self.place.size == 0 or self.place.shape != self.coefficient.shape:
            raise InputError(
                f"{self.over} has shape {self.place.shape} and coefficient {self.coefficient.shape}; expected two "
                "lists of one length"
            )
        back = np.flatnonzero(np.diff(self.place) <= 0)
        if back.size:
            after = float(self.place[back[0] + 1])
            raise InputError(
                f"{self.over} {after:g} does not come after {self.place[back[0]]:g}; expected rising values"
            )

    def at(self, place: npt.ArrayLike) -> Floats:
        """Return μ at times [s] or distances [m]."""
        return np.asarray(np.interp(np.asarray(place, dtype=np.float64), self.place, self.coefficient))

    def along(self, events: Sequence[Event]) -> list[Event]:
        """Return the events in time order, with a change of friction behind each event time at which it changes.

        Raises InputError: events that change friction themselves, or friction over distance without a controlled
        tangential displacement.
        """
        if any(event.changes_friction for event in events):
            raise InputError("friction changes in the loading, too; expected one of the two")
        time = np.array([event.time for event in events])
        friction = self.at(time if self.over == "time" else _distance(events, time))
        together: list[Event] = []
        present = np.nan
        for number, event in enumerate(events):
            together.append(event)
            last = number + 1 == len(events) or events[number + 1].time > event.time
            if last and friction[number] != present:
                present = friction[number]
                together.append(FrictionChange(event.time, float(present)))
        return together


def _distance(events: Sequence[Event], time: Floats) -> Floats:
    """Return the path length of the tangential displacement up to each event (event) [m]."""
    moves = [event for event in events if isinstance(event, TangentialDisplacement)]
    other = next((e for e in events if isinstance(e, LoadEvent) and e.name == "tangential_load"), None)
    if not moves or other is not None:
        raise InputError(
            "friction over distance needs a controlled tangential displacement; control it, or give friction over time"
        )
    way = np.array([event.value for event in moves])
    # what was moved before is not known where the record begins with it; else the contact comes from 0
    begins = way[0] if moves[0].time <= time[0] else 0.0
    total = np.cumsum(np.abs(np.diff(way, prepend=begins)))
    clock = np.array([event.time for event in moves])
    if begins == 0.0 and clock[0] > time[0]:
        clock, total = np.append(time[0], clock), np.append(0.0, total)
    # of several at one time the last one counts
    latest = np.append(np.diff(clock) > 0, True)
    return np.asarray(np.interp(time, clock[latest], total[latest]))
