"""What changes along a history beside its loads and displacements, so that it is recorded at each step."""

from collections.abc import Sequence
from typing import Self

import attrs

from historysim.asperities.ensemble import Ensemble
from historysim.loads import schedule
from historysim.loads.events import Event


@attrs.frozen
class Changes:
    """What changes along a history.

    Attributes
    ----------
    friction : bool
        Whether the friction of any asperity does.
    friction_differs : bool
        Whether asperities have different friction at any time.
    """

    friction: bool = False
    friction_differs: bool = False

    @classmethod
    def of(cls, ensemble: Ensemble, events: Sequence[Event]) -> Self:
        """Return what changes in the history of these events."""
        coefficients = schedule.friction_changes(events)
        differs = ensemble.friction.min() < ensemble.friction.max() or any(
            isinstance(each, tuple) and min(each) < max(each) for each in coefficients
        )
        return cls(friction=bool(coefficients), friction_differs=bool(differs))


STEADY = Changes()
"""Nothing but loads and displacements."""
