"""A friction coefficient that changes with time or with the sliding distance: running-in, wear of a film."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

import attrs

from historysim.basics.fields import Quantity
from historysim.errors import InputError
from historysim.loads.events import (
    Event,
    FrictionChange,
    LoadEvent,
    TangentialDisplacement,
    as_numbers,
    coefficients_within,
    each_at_least,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from historysim.basics.arguments import Floats

_OPTIONAL: dict[str, Any] = {
    "default": None,
    "converter": attrs.converters.optional(as_numbers),
    "validator": attrs.validators.optional(each_at_least("place", -math.inf, "a finite number, in SI")),
}


@attrs.frozen(kw_only=True)
class FrictionCourse:
    """A coefficient over time or distance, straight between its points, and as at its ends beyond them.

    Examples
    --------
    [friction]
    coefficient = 0.5

    [friction.course]
    distance = ["0 m", "1 mm", "20 mm"]
    coefficient = [0.5, 0.35, 0.3]
    """

    #: Times of the coefficients, rising; or ``distance``.
    time: Annotated[tuple[float, ...], Quantity("s")] | None = attrs.field(**_OPTIONAL)
    #: Way of the tangential displacement, rising, both directions counting; it must be controlled throughout.
    distance: Annotated[tuple[float, ...], Quantity("m")] | None = attrs.field(**_OPTIONAL)
    #: Coefficients, as many as times or distances; straight in between. At each event the coefficient becomes that of
    #: its time or distance, and acts on what comes behind it.
    coefficient: Annotated[tuple[float, ...], Quantity("1")] = attrs.field(
        converter=as_numbers, validator=coefficients_within
    )

    def __attrs_post_init__(self) -> None:
        """Check that the coefficients go with one thing, which rises."""
        check_one(time=self.time, distance=self.distance)
        over = "time" if self.distance is None else "distance"
        places, coefficients = (len(each) if isinstance(each, tuple) else 1 for each in (self.place, self.coefficient))
        if places != coefficients:
            raise InputError(f"{places} of {over} and {coefficients} of coefficient; expected as many of each")
        for before, after in pairwise(self.place):
            if after <= before:
                raise InputError(f"{over} {after:g} does not come after {before:g}; expected rising values")

    @property
    def place(self) -> tuple[float, ...]:
        """Times [s] or distances [m]."""
        return (self.time if self.distance is None else self.distance) or ()

    def at(self, place: "npt.ArrayLike") -> "Floats":
        """Return μ at times [s] or distances [m]."""
        import numpy as np

        return np.asarray(np.interp(np.asarray(place, dtype=np.float64), self.place, self.coefficient))

    def along(self, events: Sequence[Event]) -> list[Event]:
        """Return the events in time order, with a change of friction behind each event time at which it changes.

        Raises InputError: events that change friction themselves, or friction over distance without a controlled
        tangential displacement.
        """
        import numpy as np

        if any(event.changes_friction for event in events):
            raise InputError("friction changes in the loading, too; expected one of the two")
        time = np.array([event.time for event in events])
        friction = self.at(time if self.distance is None else _distance(events, time))
        together: list[Event] = []
        present = np.nan
        for number, event in enumerate(events):
            together.append(event)
            last = number + 1 == len(events) or events[number + 1].time > event.time
            if last and friction[number] != present:
                present = friction[number]
                together.append(FrictionChange(event.time, float(present)))
        return together


def check_one(**over: object) -> None:
    """Check that one thing alone is given, with which the coefficient goes; else it is an InputError."""
    given = [name for name, value in over.items() if value is not None]
    if len(given) != 1:
        problem = f"{' and '.join(given)} together" if given else f"neither {' nor '.join(over)}"
        raise InputError(f"{problem}; expected one of them")


def _distance(events: Sequence[Event], time: "Floats") -> "Floats":
    """Return the path length of the tangential displacement up to each event (event) [m]."""
    import numpy as np

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
