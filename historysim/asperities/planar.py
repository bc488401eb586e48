"""Two tangential directions: what a state of them is, and how finely rings carry it."""

from pathlib import Path
from typing import Any, Self

import attrs
import numpy as np

from historysim.asperities.instrument import Instrument, as_instrument
from historysim.basics.arguments import Floats
from historysim.basics.files import replacing
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.units import is_number, quantity_text
from historysim.errors import InputError
from historysim.memory.binding import Memory, check, friction_of_each

HELD = (np.nan, np.nan)
"""Targets of a tangential channel that is held."""


def _from_1(_: Any, field: "attrs.Attribute[int]", value: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= lib.HS_MOST_RINGS:
        raise InputError(f"{field.name} is {value!r}; expected a whole number from 1 to {lib.HS_MOST_RINGS}")


def _below_1(_: Any, field: "attrs.Attribute[float]", value: float) -> None:
    if not (is_number(value) and 0 < value < 1):
        raise InputError(f"{field.name} is {value!r}; expected a number between 0 and 1, such as 1e-3")


@attrs.frozen
class Rings:
    """How finely asperities are resolved that move in two tangential directions.

    Along one line the memory is exact whatever they say. From the first turn on, asperities share rings of traction
    (theory page, `contact/README.md`, "Two tangential directions").

    Parameters
    ----------
    height_classes : int
        Classes of asperities by height, each with rings of its own: 1 is quick, 8 are within 1e-3 of μN.
    rings : int
        Rings of a class, from the edge of contact to the middle of its highest summit.
    tolerance : float
        Of the tangential load over the friction limit, and of the energy of a step, which is halved until it is
        settled.

    Raises
    ------
    InputError
        A number that is not a whole one from 1 to 1000, or a tolerance that is not between 0 and 1.
    """

    height_classes: int = attrs.field(default=8, validator=_from_1)
    rings: int = attrs.field(default=30, validator=_from_1)
    tolerance: float = attrs.field(default=1e-3, validator=_below_1)


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
        (tx, ty), (ux, uy) = self.tangential_load, self.tangential_displacement
        parts = [
            f"normal load {quantity_text(self.normal_load, 'N')}",
            f"tangential load ({quantity_text(tx, 'N')}, {quantity_text(ty, 'N')})",
            f"approach {quantity_text(self.approach, 'm')}",
            f"tangential displacement ({quantity_text(ux, 'm')}, {quantity_text(uy, 'm')})",
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


def in_plane(memory: Memory, rings: Rings) -> Any:
    """Return the memory of two directions of one of one direction, which is x."""
    return _owned(lib.hs_planar_new(memory, rings.height_classes, rings.rings, rings.tolerance))


def _compliance(instrument: Instrument) -> Any:
    return ffi.new("double[2]", [1.0 / as_instrument(instrument).lateral_stiffness] * 2)


def with_planar_friction(memory: Any, friction: Floats, driven: Any, instrument: Instrument) -> Any:
    """Return a new memory with other coefficients (asperity) from now on."""
    after = _owned(lib.hs_planar_copy(memory))
    status = lib.hs_planar_set_friction(after, pointer(friction), _compliance(instrument), driven)
    if status == lib.HS_FOREIGN:
        raise InputError(
            "friction differs between asperities that share rings of traction; expected one coefficient for those that "
            "had one at the start"
        )
    check(status)
    return after


def planar_step(
    memory: Any, normal: tuple[int, float], tangential: tuple[int, Any], driven: Any, instrument: Instrument
) -> Any:
    """Return a new memory after one straight path: how channels are controlled, and their targets in N or m, or NaN."""
    after = _owned(lib.hs_planar_copy(memory))
    targets = tangential[1] if isinstance(tangential[1], tuple) else HELD
    held = np.isnan(normal[1]), np.isnan(targets[0])
    path = ffi.new("hs_planar_path *")
    path.normal_control, path.tangential_control, path.parts = normal[0], tangential[0], 1
    path.normal_target, path.normal_fraction = (0.0, 0.0) if held[0] else (normal[1], 1.0)
    path.tangential_target, path.tangential_fraction = ((0.0, 0.0), 0.0) if held[1] else (targets, 1.0)
    path.begin = path.end = np.nan
    refusal = ffi.new("hs_refusal *")
    check(lib.hs_planar_walk(after, path, 1, ffi.NULL, _compliance(instrument), driven, refusal), refusal)
    return after
