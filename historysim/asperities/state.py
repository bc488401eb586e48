"""`State` of an ensemble: an immutable value that holds its loads and its memory."""

import importlib
from pathlib import Path
from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.instrument import Rings
from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.files import replacing
from historysim.basics.library import lib
from historysim.basics.units import quantity_text
from historysim.memory import binding
from historysim.memory.binding import Memory

# What a state is shown by, with units.
SHOWN = {
    "normal_load": "N",
    "tangential_load": "N",
    "approach": "m",
    "tangential_displacement": "m",
}


class SavedState:
    """Base class of states: representation, and comparison, pickling and saving by their bytes."""

    __slots__ = ()

    def __repr__(self) -> str:
        texts = [
            f"{name.replace('_', ' ')} {quantity_text(getattr(self, name), unit)}"
            for name, unit in SHOWN.items()
        ]
        return f"<{type(self).__name__}: {', '.join(texts)}>"

    def __eq__(self, other: object) -> bool:
        return self._bits() == other._bits() if isinstance(other, type(self)) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._bits())

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).from_bytes, (self.to_bytes(),)

    @classmethod
    def from_bytes(cls, content: bytes, like: Any = None) -> Self:
        """Read a state from bytes of `to_bytes`; InputError if damaged, or of another ensemble than ``like``."""
        raise NotImplementedError

    def to_bytes(self) -> bytes:
        """Serialise the state; the bytes are portable between machines of equal byte order."""
        raise NotImplementedError

    @property
    def tangential_request(self) -> Any:
        """Requested tangential load [N]; beyond the friction limit if `saturate` holds the load at the limit."""
        return self.tangential_load + self._excess  # type: ignore[attr-defined] # of every state

    _excess: Any = 0.0  # of the request beyond the tangential load [N]

    def _bits(self) -> bytes:
        return self.to_bytes()

    def save(self, path: str | Path) -> None:
        """Write the state to a file, with its geometry; `load_state` of its ensemble reads it."""
        with replacing(Path(path)) as unfinished:
            unfinished.write_bytes(self.to_bytes())


class Evolved(NamedTuple):
    """Evolution of asperities since the start, in addition to their traction memory; arrays are (asperity)."""

    summit_height: Floats  #: present heights [m]
    summit_radius: Floats  #: present radii [m]
    slid_distance: Floats  #: ∫|dU| while the asperity slid as a whole [m]
    worn_volume: Floats  #: volume lost since the start [m³]
    waiting_volume: Floats  #: part of it that has not yet shaped the summit [m³]
    shaped_volume: Floats  #: part of it that has, since the summit was last a whole paraboloid [m³]
    friction_overridden: Booleans  #: True where an event has set the friction, in place of the law
    slid_together: float  #: ∫|dU| while all asperities in contact slid [m]
    #: number of contacts that a change of geometry has replaced, with their memory
    erased_memories: float
    erased_energy: float  #: tangential elastic energy lost with them, or with what was worn [J]


class Yielded(NamedTuple):
    """Yielding of asperities since the start; arrays are (asperity)."""

    virgin_height: Floats  #: heights before they yielded [m]
    virgin_radius: Floats  #: radii before they yielded [m]
    summit_height: Floats  #: present heights [m]
    summit_radius: Floats  #: present radii [m]
    #: Largest load under which each yielded, up to which it is elastic now; 0 where it never has
    #: [N].
    yielding_load: Floats
    #: energy that yielding has taken since the start [J], apart from what friction dissipates
    yielding_energy: Floats

    @property
    def yielded_depth(self) -> Floats:
        """Reduction of the height of each summit by yielding [m] (asperity)."""
        return self.virgin_height - self.summit_height


def _si_property(field: str, unit: str, text: str) -> float:
    """Return a property that converts a dimensionless field of the line of ``hs_state`` to SI."""

    def read(holder: Any) -> float:
        memory = holder.memory  # which owns its line, and which a stepper may replace meanwhile
        line = memory.line
        return float(getattr(line, field) * getattr(line.contact.units, unit))

    return property(read, doc=text)  # type: ignore[return-value] # what it reads is a float


def _tangential(field: str, unit: str, text: str) -> Any:
    """Return a property that reads a tangential quantity in SI: a number, or a vector in two directions."""
    return property(lambda holder: binding.tangential(holder.memory, field, unit), doc=text)


class WholeContact:
    """Totals of a memory in SI; tangential ones are vectors (direction) in two tangential directions."""

    __slots__ = ()
    memory: Memory

    normal_load = _si_property("normal_load", "load", "Total normal load [N].")
    tangential_load = _tangential("tangential_load", "load", "Total tangential load [N].")
    approach = _si_property(
        "approach",
        "length",
        "Approach of the highest summit from first touch [m]; negative where nothing touches.",
    )
    tangential_displacement = _tangential(
        "displacement", "displacement", "Rigid tangential displacement U [m]."
    )
    dissipated_energy = _si_property(
        "dissipated", "energy", "Energy that friction has taken since the start [J]."
    )
    _excess = _tangential("excess", "load", "Request beyond the tangential load [N].")

    @property
    def friction(self) -> Floats:
        """Present friction coefficient of each asperity (asperity)."""
        memory = self.memory
        return binding.view(memory.line.friction, memory.line.contact.groups)[
            binding.group_of_each(memory)
        ]


@attrs.frozen(eq=False, repr=False, init=False)
class State(WholeContact, SavedState):
    """State of an ensemble: an immutable value.

    In one tangential direction, which is x, tangential quantities are numbers. `Ensemble.advance`
    moves a state in two from the first pair of targets on; then they are vectors in x and y. States
    are equal where all their bits are: geometry, friction, memory, loads, and how the channels were
    controlled; when asperities have slid is no part of that. They can be pickled.
    """

    memory: Memory  #: ``hs_state`` of the library
    #: the start of the ensemble that it is known to be of, if it moves and evolves alike
    _like: Memory | None

    def __init__(self, memory: "Memory", like: "Memory | None" = None) -> None:
        # in two thirds of the time of what attrs writes
        _set_memory(self, memory)
        _set_like(self, like)

    @classmethod
    def from_bytes(cls, content: bytes, like: Any = None) -> Self:
        """Read the state from the result of `to_bytes`; see `SavedState`."""
        start = None if like is None else like.memory
        memory = binding.from_bytes(content, start)
        return cls(
            memory, start if start is not None and binding.moves_like(memory, start) else None
        )

    def to_bytes(self) -> bytes:
        """Serialise the state."""
        return binding.to_bytes(self.memory)

    def _bits(self) -> bytes:
        memory = self.memory
        if memory.line.slides or memory.line.scaled:
            memory = binding.copy_state(memory)
            lib.hs_forget_slides(memory)
        return binding.to_bytes(memory)

    @property
    def directions(self) -> int:
        """Number of tangential directions in which it moves, 1 or 2."""
        return binding.count_directions(self.memory)

    @property
    def group(self) -> Integers:
        """Group number of each asperity (asperity); asperities of a group share one memory."""
        return binding.group_of_each(self.memory)

    @property
    def contact_count(self) -> int:
        """Number of asperities that touch; of patches of normal curves, of the elements that carry them."""
        return int(lib.hs_contact_count(self.memory))

    @property
    def normal_stiffness(self) -> float:
        """dN/dd, with the approach d [N/m]; the same for loading and unloading."""
        return float(lib.hs_normal_stiffness(self.memory))

    @property
    def tangential_stiffness(self) -> Any:
        """Tangential stiffness of the springs that stick now [N/m], as recorded; see `stiffness` for a next move.

        In two directions a matrix (direction, direction).
        """
        return binding.sticking_stiffness(self.memory)

    @property
    def slip_share(self) -> float:
        """Sliding fraction of the contact, 1 - Σ c/Σ a, with stick radii c and contact radii a; 0 without contact."""
        units = self.memory.line.contact.units
        total = self.normal_stiffness * units.length / units.load
        # springs that stick are as stiff in each direction
        sticking = float(np.ravel(self.tangential_stiffness)[0])
        return 1.0 - sticking / units.stiffness / total if total > 0.0 else 0.0

    def stiffness(self, direction: Any = None) -> Any:
        """Return dT/dU at a fixed approach for a displacement that continues in a direction [N/m].

        Springs that slide in that direction do not contribute; springs that slide in the opposite
        direction stick again. The direction is 1 for a growing displacement, -1 for a falling one. In two
        directions it is a pair of any length, by default (0, 0), for the springs that stick now;
        the result is a matrix (direction, direction). Another direction raises InputError.
        """
        return binding.stiffness(self.memory, direction)

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy of all asperities [J]."""
        return float(lib.hs_stored_energy(self.memory))

    @property
    def evolved(self) -> Evolved | None:
        """Evolution of the asperities; None if they do not evolve."""
        return Evolved(**self._evolved_fields(Evolved)) if self.memory.line.evolved else None

    @property
    def yielded(self) -> Yielded | None:
        """Yielding of the asperities; None if they do not yield."""
        evolved = self.memory.line.evolved
        return (
            Yielded(**self._evolved_fields(Yielded)) if evolved and evolved.virgin_height else None
        )

    def _evolved_fields(self, kind: type[NamedTuple]) -> dict[str, Any]:
        """Read the fields of ``hs_evolved`` that a tuple declares, arrays as copies."""
        evolved, count = self.memory.line.evolved, self.memory.line.contact.count
        values: dict[str, Any] = {name: getattr(evolved, name) for name in kind._fields}
        for name, value in values.items():
            if not isinstance(value, float):
                values[name] = binding.view(value, count).astype(
                    bool if name == "friction_overridden" else float
                )
        return values

    def vertices(self, group: int = 0) -> npt.NDArray[Any]:
        """Return the vertices of a group's polyline, dimensionless, the deepest first; see ``hs_vertex``."""
        return binding.stack(self.memory, group)

    def shortest_history(self) -> "list[Any]":
        """Return events that lead an untouched contact into this state, with the same future.

        The memory itself is the shortest history: the contact is pressed along the remembered
        polyline, from vertex to vertex, with a rising approach and without slip or dissipation.
        Events have displacements of the contact, without an instrument, at the times 0, 1, 2, …
        [s]. Each channel ends under its last control, except that a contact that slides as
        a whole ends at its displacement.

        Raises
        ------
        InputError
            Two tangential directions, several friction coefficients (see `historysim.shortest`),
            contacts that evolve, or friction that has fallen.
        """
        # events are declared in a package below this one
        events: list[Any] = importlib.import_module("historysim.loads.retracing").shortest_history(
            self
        )
        return events

    def on_line(self, displacement: Floats) -> Floats:
        """Convert dimensionless displacements along the line of motion to positions [m], (…, direction) in two."""
        return binding.positions_along_line(self.memory, displacement)

    @property
    def rings(self) -> Rings | None:
        """Resolution of its asperities in two directions; None in one."""
        plane = self.memory.plane
        return Rings(plane.height_classes, plane.rings, plane.tolerance) if plane else None

    @property
    def tangential_control(self) -> int | tuple[int, int]:
        """Last control of the tangential channel, `LOAD` or `DISPLACED`; a pair for x and y in two directions."""
        return binding.tangential_control(self.memory)

    @property
    def _turned(self) -> bool:
        """True if the contact has left the line along which it first moved, so that rings hold its tractions."""
        plane = self.memory.plane
        return bool(plane and plane.body)


_fields: Any = State
_set_memory, _set_like = _fields.memory.__set__, _fields._like.__set__


def friction_at_start(state: State) -> float | None:
    """Return the friction of the first asperity at the start of the ensemble; None if that is not known."""
    start = state._like
    return None if start is None else float(start.line.friction[0])
