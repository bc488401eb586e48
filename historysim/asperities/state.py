"""`EnsembleState`: where an ensemble is and what it remembers, a value that is never changed."""

from pathlib import Path
from typing import Any, NamedTuple, Self

import attrs
import numpy.typing as npt

from historysim.basics.array_types import Booleans, Floats, Integers
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
    """What has become of asperities since the start, beside what their tractions remember.

    Attributes
    ----------
    summit_height, summit_radius : array (asperity)
        Present ones [m].
    slid_distance : array (asperity)
        ∫|dU| while the asperity slid as a whole [m].
    worn_volume : array (asperity)
        Volume lost since the start [m³].
    waiting_volume : array (asperity)
        What of it has not yet shaped the summit [m³].
    shaped_volume : array (asperity)
        What has, since the summit was last a whole paraboloid [m³].
    given : array of bool (asperity)
        Whose friction an event has given, in place of the law.
    slid_together : float
        ∫|dU| while all asperities in contact slid [m].
    erased_memories : float
        Contacts of which a change of geometry has erased the memory.
    erased_energy : float
        Tangential elastic energy that went with it, or with what was worn [J].
    """

    summit_height: Floats
    summit_radius: Floats
    slid_distance: Floats
    worn_volume: Floats
    waiting_volume: Floats
    shaped_volume: Floats
    given: Booleans
    slid_together: float
    erased_memories: float
    erased_energy: float


class Yielded(NamedTuple):
    """How asperities have yielded since the start.

    Attributes
    ----------
    virgin_height, virgin_radius : array (asperity)
        Summits before they yielded [m].
    summit_height, summit_radius : array (asperity)
        Present ones [m].
    yielded_depth : array (asperity)
        By which the summit has been flattened [m].
    yielding_load : array (asperity)
        Largest load under which it yielded, up to which it is elastic now; 0 where it never has [N].
    yielding_energy : array (asperity)
        That yielding has taken since the start [J]: apart from what friction dissipates.
    """

    virgin_height: Floats
    virgin_radius: Floats
    summit_height: Floats
    summit_radius: Floats
    yielded_depth: Floats
    yielding_load: Floats
    yielding_energy: Floats


class WholeContact:
    """Totals of a memory in SI units."""

    __slots__ = ()
    memory: Memory

    @property
    def normal_load(self) -> float:
        """Total normal load [N]."""
        memory = self.memory
        return float(memory.normal_load * memory.contact.units.load)

    @property
    def tangential_load(self) -> float:
        """Total tangential load [N]."""
        memory = self.memory
        return float(memory.tangential_load * memory.contact.units.load)

    @property
    def approach(self) -> float:
        """Approach of the highest summit from first touch [m]; negative where nothing touches."""
        memory = self.memory
        return float(memory.approach * memory.contact.units.length)

    @property
    def tangential_displacement(self) -> float:
        """Rigid tangential displacement U [m]."""
        memory = self.memory
        return float(memory.displacement * memory.contact.units.displacement)

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start, all asperities [J]."""
        memory = self.memory
        return float(memory.dissipated * memory.contact.units.energy)


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
        return _from_bytes, (self.to_bytes(),)

    @classmethod
    def from_bytes(cls, content: bytes, like: "EnsembleState | None" = None) -> Self:
        """Return the state that `to_bytes` has made bytes of.

        Raises
        ------
        InputError
            Bytes that are damaged or of something else, or, where another state is given, of another ensemble.
        """
        start = None if like is None else like.memory
        return cls(from_bytes(content, start), start)

    def to_bytes(self) -> bytes:
        """Return all of it as bytes, which any machine with the same order of bytes reads."""
        return to_bytes(self.memory)

    def save(self, path: str | Path) -> None:
        """Write the state to a file, with its geometry; `Ensemble.load_state` reads it.

        Raises
        ------
        OSError
            The file cannot be written.
        """
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
        found = self.memory.evolved
        if not found:
            return None
        count = self.memory.contact.count
        arrays: dict[str, Any] = {name: getattr(found, name) for name in Evolved._fields}
        for name in Evolved._fields[:7]:
            arrays[name] = view(arrays[name], count).copy()
        return Evolved(**arrays | {"given": arrays["given"].astype(bool)})

    @property
    def yielded(self) -> Yielded | None:
        """How asperities have yielded; None where they do not."""
        found = self.memory.evolved
        if not found or not found.virgin_height:
            return None
        arrays = {
            name: view(getattr(found, name), self.memory.contact.count).copy()
            for name in Yielded._fields
            if name != "yielded_depth"
        }
        return Yielded(**arrays, yielded_depth=arrays["virgin_height"] - arrays["summit_height"])

    def vertices(self, group: int = 0) -> npt.NDArray[Any]:
        """Return the vertices of a group's polyline, dimensionless, the deepest first; see ``hs_vertex``."""
        return stack(self.memory, group)


_fields: Any = EnsembleState
_set_memory, _set_like = _fields.memory.__set__, _fields.like.__set__


def _from_bytes(content: bytes) -> EnsembleState:
    """Return the state that was pickled."""
    return EnsembleState.from_bytes(content)
