"""`EnsembleState`: where an ensemble is and what it remembers, a value that is never changed."""

import math
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from historysim._version import __version__
from historysim.asperities.evolved import Evolved
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.memory.energy import stored_energy
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Memory,
    Units,
)
from historysim.memory.normal import load_and_slope, touching
from historysim.memory.paths import LOAD
from historysim.memory.slip import sticking_stiffness
from historysim.memory.stepping import Arrays

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

FORMAT = 1
"""Of files of states: a program reads those up to its own."""

BLOCK = 32
"""Vertices in a block of the deep end of a memory; of the outer end two to three blocks are together."""


class Deeper(NamedTuple):
    """The deep end of a vertex stack in blocks, which states share: the outermost block, and what is deeper."""

    vertices: Floats
    below: "Deeper | None"


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, repr=False, slots=False)
class EnsembleState:
    """The state of an ensemble: a value, never changed once made.

    States are equal where all their bits are: geometry, friction, memory, loads, and how the channels were controlled.

    Parameters
    ----------
    contact : Contact
        Geometry and present friction, in the order of the friction groups.
    order : array (asperity)
        The ensemble's index of each asperity in that order.
    memory : Memory
        What the asperities remember, and the present loads, dimensionless.
    units : Units
    normal_control, tangential_control : int
        How each channel was last controlled (`LOAD` or `DISPLACED`), which is how it is
        held until it is told to move.
    deeper : Deeper, optional
        The deep end of the only vertex stack, of which ``memory`` then holds the outer end alone. States of a deep
        memory share it, so that a step does not copy it.
    evolved : Evolved, optional
        Present geometry, slid distances and wear, where asperities evolve.
    """

    contact: Contact
    order: Integers
    _given: Memory | Arrays = attrs.field(alias="memory")
    units: Units
    normal_control: int = LOAD
    tangential_control: int = LOAD
    _deeper: Deeper | None = attrs.field(default=None, alias="deeper")
    evolved: Evolved | None = None

    def __repr__(self) -> str:
        told = [
            f"normal load {quantity_text(self.normal_load, 'N')}",
            f"tangential load {quantity_text(self.tangential_load, 'N')}",
            f"approach {quantity_text(self.approach, 'm')}",
            f"tangential displacement {quantity_text(self.tangential_displacement, 'm')}",
        ]
        return f"<EnsembleState: {', '.join(told)}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, EnsembleState):
            return NotImplemented
        mine, others = self.content, other.content
        alike = self.units == other.units and mine.keys() == others.keys()
        return alike and all(mine[name].tobytes() == others[name].tobytes() for name in mine)

    def __hash__(self) -> int:
        return hash(self._now.tobytes())

    def __reduce__(self) -> tuple[Any, ...]:
        kept = (self.contact, self.order, self.memory, self.units, self.normal_control, self.tangential_control)
        return EnsembleState, (*kept, None, self.evolved)

    @cached_property
    def memory(self) -> Memory:
        """What the asperities remember, and the present loads, dimensionless."""
        arrays = self._given if self._deeper is None else joined(self._given, self._deeper, math.inf)[0]
        return Memory(*arrays)

    @cached_property
    def outer(self) -> tuple[Arrays, Deeper | None]:
        """The memory as a step takes it: without the deep end of a single stack, and that end."""
        return split(tuple(self._given), self._deeper)

    @property
    def _now(self) -> Floats:
        now: Floats = self._given[4]
        return now

    @property
    def normal_load(self) -> float:
        """Total normal load [N]."""
        return float(self._now[NORMAL_LOAD]) * self.units.load

    @property
    def tangential_load(self) -> float:
        """Total tangential load [N]."""
        return float(self._now[TANGENTIAL_LOAD]) * self.units.load

    @property
    def approach(self) -> float:
        """Approach of the highest summit from first touch [m]; negative where nothing touches."""
        return float(self._now[APPROACH]) * self.units.length

    @property
    def tangential_displacement(self) -> float:
        """Rigid tangential displacement U [m]."""
        return float(self._now[DISPLACEMENT]) * self.units.displacement

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start, all asperities [J]."""
        return float(self._now[DISSIPATED]) * self.units.energy

    @property
    def friction(self) -> Floats:
        """Present friction coefficient of each asperity (asperity)."""
        coefficients = np.empty(self.order.size)
        coefficients[self.order] = np.repeat(self.contact.friction, np.diff(self.contact.first))
        return coefficients

    @property
    def contact_count(self) -> int:
        """Number of asperities that touch; of patches of normal curves, of the elements that carry them."""
        return int(touching(self.contact.sorted_gap, self._now[APPROACH]))

    @property
    def normal_stiffness(self) -> float:
        """dN/dd, with the approach d [N/m]; the same whichever way it goes on."""
        return self._edge_slope() * self.units.load / self.units.length

    @property
    def tangential_stiffness(self) -> float:
        """Tangential stiffness of the springs that stick now [N/m], as recorded; see `stiffness` for a next move."""
        return sticking_stiffness(self.contact, self.memory, 0.0) * self.units.stiffness

    @property
    def slip_share(self) -> float:
        """Share of the contact that slides, 1 - Σ c/Σ a, with stick radii c and contact radii a; 0 without contact."""
        whole = self._edge_slope()
        return 1.0 - sticking_stiffness(self.contact, self.memory, 0.0) / whole if whole > 0.0 else 0.0

    def stiffness(self, direction: int) -> float:
        """Return dT/dU at a fixed approach when the displacement goes on in a direction [N/m].

        Springs that slide in that direction take no part; those that slide the other way stick again.

        Parameters
        ----------
        direction : int
            1 for a growing displacement, -1 for a falling one.

        Raises
        ------
        InputError
            Another direction.
        """
        if isinstance(direction, bool) or direction not in {1, -1}:
            raise InputError(f"direction is {direction!r}; expected 1 (the displacement grows) or -1 (it falls)")
        return sticking_stiffness(self.contact, self.memory, float(direction)) * self.units.stiffness

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy that all asperities hold [J]."""
        unused = np.zeros(self.order.size)
        return stored_energy(self.contact, self.memory, unused) * self.units.energy

    def save(self, path: str | Path) -> None:
        """Write the state to a file (NPZ), with its geometry and the version; `Ensemble.load_state` reads it.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        with Path(path).open("wb") as file:
            np.savez(file, **self.content | {"format": np.array(FORMAT), "program": np.array(__version__)})  # type: ignore[arg-type] # of arrays

    @property
    def content(self) -> dict[str, npt.NDArray[Any]]:
        """What the state consists of, by name: geometry, friction, memory and controls.

        Of the vertex stacks only what is filled is told: the room above is not part of the state.
        """
        memory, contact = self.memory, self.contact
        filled = np.arange(memory.vertices.shape[1]) < memory.depth[:, np.newaxis]
        return {
            "gap": contact.gap,
            "weight": contact.weight,
            "order": self.order,
            "first": contact.first,
            "friction": contact.friction,
            "vertices": memory.vertices[filled],
            "depth": memory.depth,
            "steep": memory.steep,
            "dissipated": memory.dissipated,
            "now": memory.now,
            "control": np.array([self.normal_control, self.tangential_control]),
            **({} if self.evolved is None else self.evolved.content),
        }

    def _edge_slope(self) -> float:
        """Slope of the normal load in the approach, dimensionless."""
        gap, weight, approach = self.contact.sorted_gap, self.contact.sorted_weight, self._now[APPROACH]
        return load_and_slope(gap, weight, touching(gap, approach), approach)[1]


def split(arrays: Arrays, deeper: Deeper | None) -> tuple[Arrays, Deeper | None]:
    """Return the outer end of a single vertex stack, and the deep end in blocks.

    Several stacks, and one that is steeper than μ and may be cut anywhere, are left whole.
    """
    vertices, depth, steep, dissipated, now = arrays
    if depth.size > 1 or depth[0] <= 3 * BLOCK or steep[0]:
        return arrays, deeper
    count = int(depth[0])
    blocks = count // BLOCK - 2
    for block in range(blocks):
        deeper = Deeper(vertices[0, block * BLOCK : (block + 1) * BLOCK].copy(), deeper)
    kept = blocks * BLOCK
    return (vertices[:, kept:count], np.array([count - kept]), steep, dissipated, now), deeper


def joined(arrays: Arrays | Memory, deeper: Deeper, least: float) -> tuple[Arrays, Deeper | None]:
    """Return the outer end with so many deeper vertices, or all that there are, and what is deeper still."""
    vertices, depth, steep, dissipated, now = arrays
    below: Deeper | None = deeper
    parts, count = [vertices[0, : int(depth[0])]], 0
    while below is not None and count < least:
        parts.append(below.vertices)
        count += len(below.vertices)
        below = below.below
    together = np.concatenate(parts[::-1])
    return (together[np.newaxis], np.array([len(together)]), steep, dissipated, now), below
