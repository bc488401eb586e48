"""What changes along a history beside its loads and displacements, so that it is recorded at each step."""

from collections.abc import Sequence
from typing import Self

import attrs

from historysim.asperities.ensemble import Ensemble
from historysim.loads import schedule
from historysim.loads.events import Event


@attrs.frozen
class Changes:
    """What changes along a history."""

    friction: bool = False
    """Whether the friction of any asperity does."""
    friction_differs: bool = False
    """Whether asperities have different friction at any time."""
    sliding: bool = False
    """Whether it is followed how far asperities slide."""
    wear: bool = False
    yielding: bool = False
    geometry: bool = False
    """wear, yielding and geometry: whether asperities wear, whether they yield, and whether heights or radii change
    otherwise."""

    @classmethod
    def of(cls, ensemble: Ensemble, events: Sequence[Event]) -> Self:
        """Return what changes in the history of these events."""
        law, wears = ensemble.law, ensemble.wear is not None
        ruled = law is not None and law.depends_on != "nothing"
        each = ruled and law is not None and law.depends_on != "total" and len(ensemble) > 1
        changes = schedule.friction_changes(events)
        return cls(
            friction=bool(changes) or ruled,
            friction_differs=bool(
                each or ensemble.friction.min() < ensemble.friction.max() or any(change.differs for change in changes)
            ),
            sliding=ensemble.slides,
            wear=wears,
            yielding=ensemble.yielding is not None,
            geometry=wears or schedule.changes_geometry(events),
        )

    @property
    def evolve(self) -> bool:
        """Whether asperities evolve beside their friction."""
        return self.sliding or self.wear or self.yielding or self.geometry


STEADY = Changes()
"""Nothing but loads and displacements."""
