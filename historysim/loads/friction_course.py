"""Friction coefficient as a function of time or sliding distance: running-in, wear of a film."""

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
    "validator": attrs.validators.optional(
        each_at_least("place", -math.inf, "a finite number, in SI")
    ),
}


@attrs.frozen(kw_only=True)
class FrictionCourse:
    """Friction coefficient over time or distance: piecewise linear, constant beyond its end points.

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
    #: Distances along the tangential displacement, rising, both directions counting; it must be
    #: controlled throughout.
    distance: Annotated[tuple[float, ...], Quantity("m")] | None = attrs.field(**_OPTIONAL)
    #: Coefficients, as many as times or distances; straight in between. At each event the
    #: coefficient becomes that of its time or distance, and applies to later events.
    coefficient: Annotated[tuple[float, ...], Quantity("1")] = attrs.field(
        converter=as_numbers, validator=coefficients_within
    )

    def __attrs_post_init__(self) -> None:
        """Check that there are as many coefficients as times or distances, and that these rise."""
        check_one(time=self.time, distance=self.distance)
        over = "time" if self.distance is None else "distance"
        n_points, n_coefficients = (
            len(values) if isinstance(values, tuple) else 1
            for values in (self.points, self.coefficient)
        )
        if n_points != n_coefficients:
            raise InputError(
                f"{n_points} of {over} and {n_coefficients} of coefficient; expected as many of each"
            )
        for previous, following in pairwise(self.points):
            if following <= previous:
                raise InputError(
                    f"{over} {following:g} does not come after {previous:g}; expected rising values"
                )

    @property
    def points(self) -> tuple[float, ...]:
        """Times [s] or distances [m]."""
        return (self.time if self.distance is None else self.distance) or ()

    def at(self, points: "npt.ArrayLike") -> "Floats":
        """Return μ at times [s] or distances [m]."""
        import numpy as np

        return np.asarray(
            np.interp(np.asarray(points, dtype=np.float64), self.points, self.coefficient)
        )

    def along(self, events: Sequence[Event]) -> list[Event]:
        """Return the events in time order, with friction changes after event times at which the coefficient changes.

        Raises InputError: events that change friction themselves, or friction over distance without
        a controlled tangential displacement.
        """
        import numpy as np

        if any(event.changes_friction for event in events):
            raise InputError("friction changes in the loading, too; expected one of the two")
        time = np.array([event.time for event in events])
        friction = self.at(time if self.distance is None else _distance(events, time))
        combined: list[Event] = []
        present = np.nan
        for number, event in enumerate(events):
            combined.append(event)
            is_last = number + 1 == len(events) or events[number + 1].time > event.time
            if is_last and friction[number] != present:
                present = friction[number]
                combined.append(FrictionChange(event.time, float(present)))
        return combined


def check_one(**over: object) -> None:
    """Check that exactly one of several arguments is given; otherwise InputError."""
    names = [name for name, value in over.items() if value is not None]
    if len(names) != 1:
        problem = f"{' and '.join(names)} together" if names else f"neither {' nor '.join(over)}"
        raise InputError(f"{problem}; expected one of them")


def _distance(events: Sequence[Event], time: "Floats") -> "Floats":
    """Return the path length of the tangential displacement up to each event (event) [m]."""
    import numpy as np

    moves = [event for event in events if isinstance(event, TangentialDisplacement)]
    load = next(
        (e for e in events if isinstance(e, LoadEvent) and e.name == "tangential_load"), None
    )
    if not moves or load is not None:
        raise InputError(
            "friction over distance needs a controlled tangential displacement; control it, or give friction over time"
        )
    displacement = np.array([event.value for event in moves])
    # earlier motion is unknown if the record begins with a displacement; otherwise the contact starts
    # at 0
    start = displacement[0] if moves[0].time <= time[0] else 0.0
    total = np.cumsum(np.abs(np.diff(displacement, prepend=start)))
    clock = np.array([event.time for event in moves])
    if start == 0.0 and clock[0] > time[0]:
        clock, total = np.append(time[0], clock), np.append(0.0, total)
    # of several at one time the last one counts
    latest = np.append(np.diff(clock) > 0, True)
    return np.asarray(np.interp(time, clock[latest], total[latest]))
