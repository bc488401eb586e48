"""`EnsembleState`: where an ensemble is and what it remembers, a value that is never changed."""

from pathlib import Path
from typing import Any, NamedTuple, Self

import attrs
import numpy.typing as npt

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.files import replacing
from historysim.basics.library import lib
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.memory.binding import (
    Memory,
    friction_of_each,
    from_bytes,
    group_of_each,
    stack,
    to_bytes,
    untimed,
    view,
)


class Evolved(NamedTuple):
    """What has become of asperities since the start, beside what their tractions remember; arrays are (asperity)."""

    summit_height: Floats  #: present heights [m]
    summit_radius: Floats  #: present radii [m]
    slid_distance: Floats  #: ∫|dU| while the asperity slid as a whole [m]
    worn_volume: Floats  #: volume lost since the start [m³]
    waiting_volume: Floats  #: part of it that has not yet shaped the summit [m³]
    shaped_volume: Floats  #: part of it that has, since the summit was last a whole paraboloid [m³]
    given: Booleans  #: where an event has set the friction, in place of the law
    slid_together: float  #: ∫|dU| while all asperities in contact slid [m]
    erased_memories: float  #: number of contacts that a change of geometry has replaced, with their memory
    erased_energy: float  #: tangential elastic energy lost with them, or with what was worn [J]


class Yielded(NamedTuple):
    """How asperities have yielded since the start; arrays are (asperity)."""

    virgin_height: Floats  #: heights before they yielded [m]
    virgin_radius: Floats  #: radii before they yielded [m]
    summit_height: Floats  #: present heights [m]
    summit_radius: Floats  #: present radii [m]
    #: Largest load under which each yielded, up to which it is elastic now; 0 where it never has [N].
    yielding_load: Floats
    yielding_energy: Floats  #: energy that yielding has taken since the start [J], apart from what friction dissipates

    @property
    def yielded_depth(self) -> Floats:
        """By how much each summit has been flattened [m] (asperity)."""
        return self.virgin_height - self.summit_height


def _in_si(field: str, unit: str, text: str) -> float:
    """Return a property that reads a field of ``hs_memory``, which is dimensionless, in SI."""

    def read(holder: Any) -> float:
        memory = holder.memory
        return float(getattr(memory, field) * getattr(memory.contact.units, unit))

    return property(read, doc=text)  # type: ignore[return-value] # what it reads is a float


class WholeContact:
    """Totals of a memory in SI."""

    __slots__ = ()
    memory: Memory

    normal_load = _in_si("normal_load", "load", "Total normal load [N].")
    tangential_load = _in_si("tangential_load", "load", "Total tangential load [N].")
    approach = _in_si(
        "approach", "length", "Approach of the highest summit from first touch [m]; negative where nothing touches."
    )
    tangential_displacement = _in_si("displacement", "displacement", "Rigid tangential displacement U [m].")
    dissipated_energy = _in_si("dissipated", "energy", "Energy that friction has taken since the start [J].")


@attrs.frozen(eq=False, repr=False, init=False)
class EnsembleState(WholeContact):
    """The state of an ensemble: a value, never changed once made.

    States are equal where all their bits are: geometry, friction, memory, loads, and how the channels were controlled;
    when asperities have slid is no part of that. They can be pickled.

    Parameters
    ----------
    memory : hs_memory
        Of the library.
    like : hs_memory, optional
        The start of the ensemble that it is known to be of.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ensemble = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
    >>> state = ensemble.advance(ensemble.initial_state(), normal_load=50e-3)
    >>> print(f"{state.tangential_stiffness:.4g} N/m")
    9.573e+05 N/m
    >>> state == ensemble.initial_state()
    False
    """

    memory: Memory
    like: Memory | None

    def __init__(self, memory: Memory, like: Memory | None = None) -> None:
        # in two thirds of the time of what attrs writes
        _set_memory(self, memory)
        _set_like(self, like)

    def __repr__(self) -> str:
        parts = [
            f"normal load {quantity_text(self.normal_load, 'N')}",
            f"tangential load {quantity_text(self.tangential_load, 'N')}",
            f"approach {quantity_text(self.approach, 'm')}",
            f"tangential displacement {quantity_text(self.tangential_displacement, 'm')}",
        ]
        return f"<EnsembleState: {', '.join(parts)}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, EnsembleState):
            return NotImplemented
        return to_bytes(untimed(self.memory)) == to_bytes(untimed(other.memory))

    def __hash__(self) -> int:
        return hash((self.normal_load, self.tangential_load, self.approach, self.tangential_displacement))

    def __reduce__(self) -> tuple[Any, ...]:
        return EnsembleState.from_bytes, (self.to_bytes(),)

    @classmethod
    def from_bytes(cls, content: bytes, like: "EnsembleState | None" = None) -> Self:
        """Return the state of `to_bytes`; InputError for damaged bytes, or another ensemble than that of ``like``."""
        start = None if like is None else like.memory
        return cls(from_bytes(content, start), start)

    def to_bytes(self) -> bytes:
        """Return all of it as bytes, which any machine with the same order of bytes reads."""
        return to_bytes(self.memory)

    def save(self, path: str | Path) -> None:
        """Write the state to a file, with its geometry; `Ensemble.load_state` reads it."""
        with replacing(Path(path)) as unfinished:
            unfinished.write_bytes(self.to_bytes())

    @property
    def friction(self) -> Floats:
        """Present friction coefficient of each asperity (asperity)."""
        return friction_of_each(self.memory)

    @property
    def group(self) -> Integers:
        """Number of the group of each asperity (asperity); those of one group share what they remember."""
        return group_of_each(self.memory)

    @property
    def contact_count(self) -> int:
        """Number of asperities that touch; of patches of normal curves, of the elements that carry them."""
        return int(lib.hs_contact_count(self.memory))

    @property
    def normal_stiffness(self) -> float:
        """dN/dd, with the approach d [N/m]; the same whichever way it goes on."""
        return float(lib.hs_normal_stiffness(self.memory))

    @property
    def tangential_stiffness(self) -> float:
        """Tangential stiffness of the springs that stick now [N/m], as recorded; see `stiffness` for a next move."""
        return float(lib.hs_stiffness(self.memory, 0))

    @property
    def slip_share(self) -> float:
        """Share of the contact that slides, 1 - Σ c/Σ a, with stick radii c and contact radii a; 0 without contact."""
        units = self.memory.contact.units
        whole = self.normal_stiffness * units.length / units.load
        return 1.0 - self.tangential_stiffness / units.stiffness / whole if whole > 0.0 else 0.0

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
        return float(lib.hs_stiffness(self.memory, int(direction)))

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy that all asperities hold [J]."""
        return float(lib.hs_stored_energy(self.memory))

    @property
    def evolved(self) -> Evolved | None:
        """What has become of asperities that evolve; None where they do not."""
        return Evolved(**self._of_each(Evolved)) if self.memory.evolved else None

    @property
    def yielded(self) -> Yielded | None:
        """How asperities have yielded; None where they do not."""
        found = self.memory.evolved
        return Yielded(**self._of_each(Yielded)) if found and found.virgin_height else None

    def _of_each(self, kind: type[NamedTuple]) -> dict[str, Any]:
        """Return the fields of ``hs_evolved`` that a tuple has, arrays as copies."""
        found, count = self.memory.evolved, self.memory.contact.count
        values: dict[str, Any] = {name: getattr(found, name) for name in kind._fields}
        for name, value in values.items():
            if not isinstance(value, float):
                values[name] = view(value, count).astype(bool if name == "given" else float)
        return values

    def vertices(self, group: int = 0) -> npt.NDArray[Any]:
        """Return the vertices of a group's polyline, dimensionless, the deepest first; see ``hs_vertex``."""
        return stack(self.memory, group)


_fields: Any = EnsembleState
_set_memory, _set_like = _fields.memory.__set__, _fields.like.__set__
