"""The C library as the other rooms call it: who owns a memory, what its numbers are, and what it raises."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from historysim.basics.array_types import Array, Floats, Integers
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import FrictionLimitError, InputError

LOAD: int = lib.HS_LOAD
DISPLACED: int = lib.HS_DISPLACED
SEPARATED, FULL_STICK, PARTIAL_SLIP, GROSS_SLIP = (
    lib.HS_SEPARATED,
    lib.HS_FULL_STICK,
    lib.HS_PARTIAL_SLIP,
    lib.HS_GROSS_SLIP,
)

TIE = 32 * float(np.finfo(np.float64).eps)
"""Relative difference of two displacements or loads that rounding alone keeps apart."""

_KINDS = {"double": "f8", "int64_t": "i8", "int32_t": "i4", "int8_t": "i1", "uint8_t": "u1"}


def dtype_of(struct: str) -> np.dtype[Any]:
    """Return a structured type of numpy with the fields of a struct of numbers."""
    fields = dict(ffi.typeof(struct).fields)
    return np.dtype(
        {
            "names": list(fields),
            "formats": [_KINDS[field.type.cname] for field in fields.values()],
            "offsets": [field.offset for field in fields.values()],
            "itemsize": ffi.sizeof(struct),
        }
    )


PATH, TOTALS, VERTEX = dtype_of("hs_path"), dtype_of("hs_totals"), dtype_of("hs_vertex")


class Memory(Protocol):
    """``hs_memory``, what the library remembers of a contact; see the header for what stands in it."""

    contact: Any
    approach: float
    displacement: float
    normal_load: float
    tangential_load: float
    dissipated: float
    excess: float
    friction: Any
    each: Any
    depth: Any
    steep: Any
    vertices: Any
    capacity: int
    deep: Any
    evolved: Any
    known_label: float
    known_slope: float
    normal_control: int
    tangential_control: int


class Slopes(NamedTuple):
    """Derivatives of the loads at the end of a path in where it ends, its start being what it is.

    Attributes
    ----------
    tangential : float
        ∂T/∂U at a held approach [N/m].
    coupling : float
        ∂T/∂d at a held displacement [N/m], with the approach d.
    normal : float
        ∂N/∂d [N/m].
    """

    tangential: float
    coupling: float
    normal: float


def new_contact(
    height: Floats,
    radius: Floats,
    stiffness: Floats | None,
    group: Integers | None,
    contact_modulus: float,
    displacement_ratio: float,
) -> Any:
    """Return a contact of summits, or of knots with a stiffness; see ``hs_contact_new``."""
    knots = ffi.NULL if stiffness is None else pointer(stiffness)
    groups = ffi.NULL if group is None else pointer(group)
    made = lib.hs_contact_new(
        height.size, pointer(height), pointer(radius), knots, groups, contact_modulus, displacement_ratio
    )
    return ffi.gc(_there(made), lib.hs_contact_free)


def new_memory(contact: Any, friction: Floats) -> Any:
    """Return the memory of a contact that nothing has happened to, with a coefficient for each asperity."""
    return owned(lib.hs_memory_new(contact, pointer(friction)))


def owned(memory: Any) -> Any:
    """Return a memory that ends with the object that is returned."""
    return ffi.gc(_there(memory), lib.hs_memory_free)


def copied(memory: Any) -> Any:
    """Return an independent copy."""
    return owned(lib.hs_memory_copy(memory))


def _there(made: Any) -> Any:
    if not made:
        raise MemoryError("there is not enough memory for the asperities and what they remember")
    return made


def drive(tolerance: float, compliance: float, saturate: bool, threads: int = 1) -> Any:
    """Return how a contact is driven; see ``hs_drive``."""
    return ffi.new("hs_drive *", (tolerance, compliance, saturate, threads))


def check(status: int, refusal: Any = None) -> None:
    """Raise what a status says.

    Raises
    ------
    FrictionLimitError
        |T| > Σ μ N, with the position of the path.
    MemoryError
    """
    if status == lib.HS_BEYOND_LIMIT:
        raise FrictionLimitError(refusal.request, refusal.limit, refusal.path)
    if status == lib.HS_OUT_OF_MEMORY:
        raise MemoryError("there is not enough memory for what the asperities remember")
    if status != lib.HS_OK:
        raise RuntimeError(f"the memory's library returned {status}")


def advanced(memory: Any, normal: tuple[int, float], tangential: tuple[int, float], driven: Any) -> Any:
    """Return a new memory after one straight path to targets in N or m; not a number holds a channel.

    Raises
    ------
    FrictionLimitError
        |T| > Σ μ N.
    """
    after = lib.hs_advance(memory, *normal, *tangential, driven, ffi.NULL)
    if not after:
        refusal = ffi.new("hs_refusal *")
        lib.hs_advance(memory, *normal, *tangential, driven, refusal)
        check(refusal.status, refusal)
    return ffi.gc(after, lib.hs_memory_free)


def group_of_each(memory: Any) -> Integers:
    """Return the friction group of each asperity (asperity)."""
    contact = memory.contact
    found = np.empty(contact.count, dtype=np.int64)
    order, first = view(contact.order, contact.count), view(contact.first, contact.groups + 1)
    found[order] = np.repeat(np.arange(contact.groups), np.diff(first))
    return found


def friction_of_each(memory: Any) -> Floats:
    """Return the present coefficient of each asperity (asperity)."""
    return view(memory.friction, memory.contact.groups)[group_of_each(memory)]


def fill(struct: Any, values: Mapping[str, Any]) -> list[Any]:
    """Fill in fields of a struct: names of constants, numbers, and arrays; return what has to outlive the struct."""
    kept = []
    for name, value in values.items():
        if isinstance(value, tuple | np.ndarray):
            kept.append(np.ascontiguousarray(value, dtype=np.float64))
            setattr(struct, name, pointer(kept[-1]))
        else:
            setattr(struct, name, ffi.integer_const(value) if isinstance(value, str) else value)
    return kept


def view(numbers: Any, count: int) -> Array:
    """Return numbers of the library as an array, which what owns them has to outlive."""
    kind = ffi.typeof(numbers).item
    dtype = VERTEX if kind.kind == "struct" else np.dtype(_KINDS[kind.cname])
    return np.frombuffer(ffi.buffer(numbers, count * ffi.sizeof(kind)), dtype=dtype)


def stack(memory: Any, group: int = 0) -> Array:
    """Return a copy of the vertices of a group, the deepest first, with the fields of ``hs_vertex``."""
    if memory.deep:
        memory = copied(memory)
        check(lib.hs_memory_join(memory))
    return view(memory.vertices + group * memory.capacity, memory.depth[group]).copy()


def to_bytes(memory: Any) -> bytes:
    """Return a memory as bytes, with its contact."""
    size = lib.hs_memory_size(memory)
    content = bytearray(size)
    check(lib.hs_memory_write(memory, ffi.from_buffer(content), size))
    return bytes(content)


def from_bytes(content: bytes, like: Any = None) -> Any:
    """Return the memory that bytes are of; it shares the contact of another one where that is the same.

    Raises
    ------
    InputError
        Bytes that are damaged, or of something else.
    """
    made, why = ffi.new("hs_memory **"), ffi.new("const char **")
    contact = ffi.NULL if like is None else like.contact
    if lib.hs_memory_read(ffi.from_buffer(content), len(content), contact, made, why) != lib.HS_OK:
        raise InputError(f"{ffi.string(why[0]).decode()}; expected a state that was saved whole")
    return owned(made[0])
