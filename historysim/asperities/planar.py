"""Two tangential directions: what a state of them is, and how finely rings carry it."""

from pathlib import Path
from typing import Any, Self

import attrs
import numpy as np

from historysim.asperities.instrument import Instrument, as_instrument
from historysim.asperities.rings import Rings
from historysim.basics.arguments import Floats
from historysim.basics.files import replacing
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.units import is_number, quantity_text
from historysim.errors import InputError
from historysim.memory.binding import Memory, check, friction_of_each
from historysim.memory.paths import Paths


def _vector(name: str, unit: str, doc: str) -> Any:
    def value(state: "PlanarState") -> Floats:
        found, scale = getattr(state.memory, name), getattr(state.memory.line.contact.units, unit)
        return np.array([found.x * scale, found.y * scale])

    return property(value, doc=doc)


def _number(name: str, unit: str, doc: str) -> Any:
    def value(state: "PlanarState") -> float:
        line = state.memory.line
        return float(getattr(line, name) * getattr(line.contact.units, unit))

    return property(value, doc=doc)


@attrs.frozen(eq=False, repr=False)
class PlanarState:
    """The state of an ensemble that moves in two tangential directions: a value, never changed once made.

    `Ensemble.advance` makes it of a state of one direction, which is x, where a target has two components. States are
    equal where all their bits are. They can be pickled.

    Parameters
    ----------
    memory : hs_planar
        Of the library.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ensemble = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
    >>> state = ensemble.advance(ensemble.initial_state(), normal_load=50e-3)
    >>> state = ensemble.advance(state, tangential_displacement=(5e-9, 0.0))
    >>> state = ensemble.advance(state, tangential_displacement=(5e-9, 5e-9))
    >>> tx, ty = state.tangential_load
    >>> print(f"{tx * 1e3:.3f} mN along x, {ty * 1e3:.3f} mN along y")
    4.067 mN along x, 4.277 mN along y
    """

    memory: Any

    like = None

    def __repr__(self) -> str:
        parts = [
            f"normal load {quantity_text(self.normal_load, 'N')}",
            f"tangential load {quantity_text(self.tangential_load, 'N')}",
            f"approach {quantity_text(self.approach, 'm')}",
            f"tangential displacement {quantity_text(self.tangential_displacement, 'm')}",
        ]
        return f"<PlanarState: {', '.join(parts)}>"

    def __eq__(self, other: object) -> bool:
        return self.to_bytes() == other.to_bytes() if isinstance(other, PlanarState) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.normal_load, *self.tangential_load, *self.tangential_displacement))

    def __reduce__(self) -> tuple[Any, ...]:
        return PlanarState.from_bytes, (self.to_bytes(),)

    @property
    def turned(self) -> bool:
        """Whether the contact has left the line along which it first moved, so that rings carry it."""
        return bool(self.memory.body)

    tangential_load = _vector("tangential_load", "load", "Tangential load (direction) [N].")
    tangential_displacement = _vector("displacement", "displacement", "Rigid displacement U (direction) [m].")

    normal_load = _number("normal_load", "load", "Total normal load [N].")
    approach = _number(
        "approach", "length", "Approach of the highest summit from first touch [m]; negative where nothing touches."
    )
    dissipated_energy = _number("dissipated", "energy", "Energy that friction has taken since the start [J].")

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy that all asperities hold [J]."""
        return float(lib.hs_planar_stored_energy(self.memory))

    @property
    def friction(self) -> Floats:
        """Present friction coefficient of each asperity (asperity)."""
        return friction_of_each(self.memory.line)

    def stiffness(self, direction: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Return dT/dU at a fixed approach when the displacement goes on in a direction [N/m] (direction, direction).

        Parameters
        ----------
        direction : pair of float
            Of any length; (0, 0) stands for the springs that stick now.

        Raises
        ------
        InputError
            Another direction.
        """
        towards = pair_of("direction", direction)
        found = ffi.new("double[4]")
        check(lib.hs_planar_stiffness(self.memory, ffi.new("double[2]", towards), found))
        return np.array(list(found)).reshape(2, 2)

    @classmethod
    def from_bytes(cls, content: bytes, like: "PlanarState | None" = None) -> Self:
        """Return the state of `to_bytes`; InputError for damaged bytes, or another ensemble than that of ``like``."""
        made, why = ffi.new("hs_planar **"), ffi.new("const char **")
        start = ffi.NULL if like is None else like.memory
        status = lib.hs_planar_from(ffi.from_buffer(content), len(content), start, made, why)
        if status != lib.HS_OK:
            raise InputError(f"{ffi.string(why[0]).decode()}; expected a state that was saved whole")
        return cls(_owned(made[0]))

    def to_bytes(self) -> bytes:
        """Return all of it as bytes, which any machine with the same order of bytes reads."""
        content = bytearray(lib.hs_planar_size(self.memory))
        check(lib.hs_planar_write(self.memory, ffi.from_buffer(content), len(content)))
        return bytes(content)

    def save(self, path: str | Path) -> None:
        """Write the state to a file, with its geometry; `Ensemble.load_state` reads it."""
        with replacing(Path(path)) as unfinished:
            unfinished.write_bytes(self.to_bytes())


def nodes_of(memory: Any, asperity: int) -> Floats:
    """Return the nodes that carry an asperity (node, 3): label and deflection in x and y, the edge first."""
    count = lib.hs_planar_nodes(memory, asperity, 0, ffi.NULL)
    nodes = np.zeros((max(count, 0), 3))
    if count < 0 or lib.hs_planar_nodes(memory, asperity, count, pointer(nodes)) != count:
        raise MemoryError("there is not enough memory for the nodes of an asperity")
    return nodes


def _owned(memory: Any) -> Any:
    if not memory:
        raise MemoryError("there is not enough memory for the asperities and what they remember")
    return ffi.gc(memory, lib.hs_planar_free)


def pair_of(name: str, values: Any) -> tuple[float, float]:
    """Return the components in x and y of a vector."""
    found = tuple(values)
    if len(found) != 2 or not all(is_number(each) and np.isfinite(each) for each in found):
        raise InputError(f"{name} is {values!r}; expected two numbers, in x and y")
    return float(found[0]), float(found[1])


def is_planar(content: bytes) -> bool:
    """Return whether bytes are of a `PlanarState`."""
    return content.startswith(b"hsplanar")


def planar_memory(memory: Memory, rings: Rings) -> Any:
    """Return the memory of two directions of one of one direction, which is x."""
    return _owned(lib.hs_planar_new(memory, rings.height_classes, rings.rings, rings.tolerance))


def compliances(instrument: Instrument) -> Any:
    """Return by how much an instrument yields in x and y [m/N], for the library."""
    return ffi.new("double[2]", as_instrument(instrument).compliances)


def with_planar_friction(memory: Any, friction: Floats, driven: Any, yields: Any) -> Any:
    """Return a new memory with other coefficients (asperity) from now on."""
    after = _owned(lib.hs_planar_copy(memory))
    status = lib.hs_planar_set_friction(after, pointer(friction), yields, driven)
    if status == lib.HS_FOREIGN:
        raise InputError(
            "friction differs between asperities that share rings of traction; expected one coefficient for those that "
            "had one at the start"
        )
    check(status)
    return after


def walked(memory: Any, paths: Paths, written: Any, driven: Any, yields: Any, until: float = 1.0) -> Any:  # noqa: PLR0917
    """Return a new memory after straight paths, up to a share of each; rows are written, or ``ffi.NULL``."""
    after, refusal = _owned(lib.hs_planar_copy(memory)), ffi.new("hs_refusal *")
    path = ffi.cast("hs_planar_path *", ffi.from_buffer(paths))
    status = lib.hs_planar_walk(after, path, paths.size, written, yields, driven, until, refusal)
    check(status, refusal)
    return after
