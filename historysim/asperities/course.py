"""Where the channels of evolving asperities are along one path, and the contact that they act on."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.evolved import Evolved
from historysim.memory.groups import approach_for
from historysim.memory.layout import Contact, Integers, Memory
from historysim.memory.normal import load_at
from historysim.memory.polyline import Aim

Floats = npt.NDArray[np.float64]


@attrs.frozen(eq=False)
class Present:
    """The contact at one moment, in the order of its groups, and what has become of its asperities."""

    contact: Contact
    order: Integers
    memory: Memory
    evolved: Evolved

    @property
    def friction(self) -> Floats:
        """Coefficient of each asperity (asperity)."""
        found = np.empty(self.order.size)
        found[self.order] = np.repeat(self.contact.friction, np.diff(self.contact.first))
        return found


@attrs.frozen(eq=False)
class Course:
    """Where the channels are at each share of one path: what they are at its ends, dimensionless.

    Of two loads both run straight. Otherwise the approach does, as the contact at the start has it; where wear has
    changed that, a normal load keeps the values that it had then.
    """

    start: Present
    by_load: bool
    by_force: bool
    approach: tuple[float, float]
    normal_load: tuple[float, float]
    tangential: tuple[float, float]
    compliance: float
    friction: tuple[Floats, Floats] | None

    def normal(self, present: Present, share: float) -> tuple[float, float]:
        """Return approach and normal load at a share."""
        contact, first = present.contact, self.start.contact
        same = contact.sorted_gap is first.sorted_gap
        if self.by_load and self.by_force:
            load = toward(self.normal_load, share)
            return approach_for(contact, present.memory, load), load
        approach = toward(self.approach, share)
        if self.by_load and share == 1.0:
            load = self.normal_load[1]
        else:
            load = load_at(first.sorted_gap, first.sorted_weight, approach)[0]
        if same:
            return approach, load
        if self.by_load:
            return approach_for(contact, present.memory, load), load
        return approach, load_at(contact.sorted_gap, contact.sorted_weight, approach)[0]

    def aim(self, share: float) -> Aim:
        """Return where the tangential channel goes."""
        value = toward(self.tangential, share)
        return Aim(value, 0.0, 1.0) if self.by_force else Aim(value, 1.0, self.compliance)


def toward(ends: tuple[float, float], share: float) -> float:
    """Return what is at a share of the way between two ends."""
    return ends[1] if share == 1.0 else ends[0] + share * (ends[1] - ends[0])
