"""`TractionMemory`: what one asperity remembers, the part of its friction group's polyline that it sees."""

from functools import cached_property
from typing import Any, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats
from historysim.basics.library import lib
from historysim.memory.binding import TIE, check, owned, view
from historysim.memory.rows import Rows, blank_rows

THE_ONE = np.zeros(1, dtype=np.int64)


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, slots=False)
class TractionMemory:
    """One asperity by itself, under the polyline of its friction group; what it answers is in SI units.

    The polyline is the anchor of the springs over the label of the springs, the approach of the
    highest summit at which a spring first touched. An asperity sees the labels above its own gap.

    Parameters
    ----------
    memory : hs_memory
        Of this asperity alone, with what its group remembers.
    """

    memory: Any = attrs.field(repr=False)

    @classmethod
    def of(cls, memory: Any, index: int) -> Self:
        """Return what one asperity remembers of a memory."""
        return cls(owned(lib.hs_memory_of_one(memory, index)))

    @property
    def friction(self) -> float:
        """Coulomb coefficient."""
        return float(self.memory.friction[0])

    @property
    def approach(self) -> float:
        """Own approach δ [m]; negative where it does not touch."""
        return float((self.memory.approach - self._gap) * self._units.length)

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start [J]."""
        return float(self.memory.each[0] * self._units.energy)

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy [J]."""
        return float(lib.hs_stored_energy(self.memory))

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of the springs that stick [N/m]."""
        return float(lib.hs_stiffness(self.memory, 0))

    @cached_property
    def recorded(self) -> Rows:
        """The row that a recorder would write of this asperity."""
        rows = blank_rows(1, 1)
        check(lib.hs_read(self.memory, rows.as_struct(THE_ONE), 0))
        return rows

    @property
    def radius(self) -> Floats:
        """Radii of the vertices, from the contact edge inward [m]: √(R (a_j - gap))."""
        return self._radius(self._seen())

    @property
    def slope(self) -> Floats:
        """Slope dw/da of the anchors between each vertex and the next one inward, edge first; ±μ where springs slip."""
        return self._seen()["slope"][::-1].copy()

    @property
    def jump(self) -> Floats:
        """Weight of each vertex in the superposition of Hertz solutions, edge first: its slope less the one outside."""
        return np.diff(self.slope, prepend=0.0)

    @property
    def made_at(self) -> Floats:
        """Tangential displacement at which each vertex was made, edge first [m]."""
        made_at: Floats = self._seen()["made_at"][::-1] * self._units.displacement
        return made_at

    @property
    def reversals(self) -> tuple[Floats, Floats]:
        """Slip fronts that a reversal left behind, edge first: their radii, and the displacements of the reversals [m].

        At a slip front the springs were at the friction limit when it was made, at a former edge they were not
        strained. It is left behind when the displacement, as the vertices outside remember it, then went the other way.
        """
        seen = self._seen()
        stack = self._stack()[max(len(self._stack()) - len(seen) - 1, 0) :]
        if len(seen) == 0:
            stack = seen
        made_at = stack["made_at"]
        tie = TIE * np.abs(made_at).max(initial=0.0)
        steps = np.diff(made_at, append=made_at[-1:])
        turns = np.flatnonzero(np.abs(steps) > tie)
        # of each vertex, the first step outside it that is more than rounding
        following = np.searchsorted(turns, np.arange(len(stack)))
        onward = np.append(steps[turns], 0.0)[following]
        strain = made_at - stack["anchor"]
        left = stack[(np.abs(strain) > tie) & (onward * strain < 0.0)]
        return self._radius(left), left["made_at"][::-1] * self._units.displacement

    @property
    def _units(self) -> Any:
        return self.memory.contact.units

    @property
    def _gap(self) -> float:
        return float(self.memory.contact.gap[0])

    def _stack(self) -> npt.NDArray[Any]:
        return view(self.memory.vertices, self.memory.depth[0])

    def _seen(self) -> npt.NDArray[Any]:
        vertices = self._stack()
        return vertices[vertices["label"] > self._gap]

    def _radius(self, vertices: npt.NDArray[Any]) -> Floats:
        depth: Floats = np.maximum(vertices["label"][::-1] - self._gap, 0.0)
        radius: Floats = self.memory.contact.weight[0] * np.sqrt(depth) * self._units.radius
        return radius
