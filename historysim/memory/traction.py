"""`TractionMemory`: what one asperity remembers, the part of its friction group's polyline that it sees."""

from functools import cached_property
from typing import Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.memory.energy import stored_energy
from historysim.memory.layout import ANCHOR, APPROACH, LABEL, MADE_AT, SLOPE, Contact, Memory, Units
from historysim.memory.projection import record_asperities
from historysim.memory.rows import Rows, blank_rows, columns_of, scratch_for
from historysim.memory.slip import sticking_stiffness
from historysim.memory.tolerances import TIE

Floats = npt.NDArray[np.float64]

THE_ONE = np.zeros(1, dtype=np.int64)


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, slots=False)
class TractionMemory:
    """One asperity by itself, under the polyline of its friction group; what it answers is in SI units.

    The polyline is the anchor of the springs over the label of the springs, the approach of the
    highest summit at which a spring first touched. An asperity sees the labels above its own gap.

    Parameters
    ----------
    contact : Contact
        The contact of this asperity alone.
    memory : Memory
        The same as if its group were this asperity; views of what the ensemble's state holds.
    units : Units
        Physical size of their units.
    """

    contact: Contact = attrs.field(repr=False)
    memory: Memory = attrs.field(repr=False)
    units: Units = attrs.field(repr=False)

    @classmethod
    def of(cls, contact: Contact, memory: Memory, units: Units, position: int) -> Self:
        """Return what the asperity at a position of a contact remembers."""
        index = int(np.searchsorted(contact.first, position, side="right")) - 1
        own, group = slice(position, position + 1), slice(index, index + 1)
        gap, weight = contact.gap[own], contact.weight[own]
        ends = np.arange(2)
        return cls(
            Contact(gap, weight, ends, contact.friction[group], sorted_gap=gap, sorted_weight=weight),
            Memory(
                vertices=memory.vertices[group],
                depth=memory.depth[group],
                steep=memory.steep[group],
                dissipated=memory.dissipated[own],
                now=memory.now,
            ),
            units,
        )

    @property
    def friction(self) -> float:
        """Coulomb coefficient."""
        return float(self.contact.friction[0])

    @property
    def approach(self) -> float:
        """Own approach δ [m]; negative where it does not touch."""
        return float(self.memory.now[APPROACH] - self.contact.gap[0]) * self.units.length

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start [J]."""
        return float(self.memory.dissipated[0]) * self.units.energy

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy [J]."""
        return float(stored_energy(self.contact, self.memory, np.zeros(1))) * self.units.energy

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of the springs that stick [N/m]."""
        return float(sticking_stiffness(self.contact, self.memory, 0.0)) * self.units.stiffness

    @cached_property
    def recorded(self) -> Rows:
        """The row that a recorder would write of this asperity."""
        rows = blank_rows(1, 1)
        columns = columns_of(self.contact, THE_ONE)
        record_asperities(self.contact, self.memory, rows, 0, columns, self.units, scratch_for(1))
        rows.dissipated[...] = self.dissipated_energy
        return rows

    @property
    def radius(self) -> Floats:
        """Radii of the vertices, from the contact edge inward [m]: √(R (a_j - gap))."""
        return self._radius(self._seen())

    @property
    def slope(self) -> Floats:
        """Slope dw/da of the anchors between each vertex and the next one inward, edge first; ±μ where springs slip."""
        return self._seen()[::-1, SLOPE].copy()

    @property
    def jump(self) -> Floats:
        """Weight of each vertex in the superposition of Hertz solutions, edge first: its slope less the one outside."""
        return np.diff(self.slope, prepend=0.0)

    @property
    def made_at(self) -> Floats:
        """Tangential displacement at which each vertex was made, edge first [m]."""
        return self._seen()[::-1, MADE_AT] * self.units.displacement

    @property
    def reversals(self) -> tuple[Floats, Floats]:
        """Slip fronts that a reversal left behind, edge first: their radii, and the displacements of the reversals [m].

        At a slip front the springs were at the friction limit when it was made, at a former edge they were not
        strained. It is left behind when the displacement, as the vertices outside remember it, then went the other way.
        """
        seen = self._seen()
        stack = self._stack()[max(self.memory.depth[0] - len(seen) - 1, 0) :]
        if len(seen) == 0:
            stack = seen
        made_at = stack[:, MADE_AT]
        tie = TIE * np.abs(made_at).max(initial=0.0)
        steps = np.diff(made_at, append=made_at[-1:])
        turns = np.flatnonzero(np.abs(steps) > tie)
        # of each vertex, the first step outside it that is more than rounding
        following = np.searchsorted(turns, np.arange(len(stack)))
        onward = np.append(steps[turns], 0.0)[following]
        strain = made_at - stack[:, ANCHOR]
        left = stack[(np.abs(strain) > tie) & (onward * strain < 0.0)]
        return self._radius(left), left[::-1, MADE_AT] * self.units.displacement

    def _stack(self) -> Floats:
        return self.memory.vertices[0, : self.memory.depth[0]]

    def _seen(self) -> Floats:
        stack = self._stack()
        return stack[stack[:, LABEL] > self.contact.gap[0]]

    def _radius(self, vertices: Floats) -> Floats:
        depth = np.maximum(vertices[::-1, LABEL] - self.contact.gap[0], 0.0)
        return self.contact.weight[0] * np.sqrt(depth) * self.units.radius
