"""The C library as the other rooms call it: who owns a memory, what its numbers are, and what it raises."""

import threading
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from historysim.basics.arguments import Array, Floats, Integers
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.errors import FrictionLimitError, InputError

LOAD: int = lib.HS_LOAD
DISPLACED: int = lib.HS_DISPLACED

# Relative difference of two displacements or loads that rounding alone keeps apart.
TIE = 32 * float(np.finfo(np.float64).eps)

_KINDS = {"double": "f8", "int64_t": "i8", "int32_t": "i4", "int8_t": "i1", "uint8_t": "u1"}


def dtype_of(struct: str) -> np.dtype[Any]:
    """Return a structured type of numpy with the fields of a struct of numbers."""
    fields = dict(ffi.typeof(struct).fields)
    return np.dtype(
        {
            "names": list(fields),
            "formats": [_format_of(field.type) for field in fields.values()],
            "offsets": [field.offset for field in fields.values()],
            "itemsize": ffi.sizeof(struct),
        }
    )


def _format_of(kind: Any) -> Any:
    return (_KINDS[kind.item.cname], kind.length) if kind.kind == "array" else _KINDS[kind.cname]


PATH, PLANAR_PATH = dtype_of("hs_path"), dtype_of("hs_planar_path")
TOTALS, VERTEX = dtype_of("hs_totals"), dtype_of("hs_vertex")


# ``hs_memory``, what the library remembers of a contact; see the header for what stands in it.
Memory = Any


class Slopes(NamedTuple):
    """Derivatives of the loads at the end of a path in where it ends [N/m], its start being what it is."""

    tangential: float  #: ∂T/∂U at a held approach
    coupling: float  #: ∂T/∂d at a held displacement, with the approach d
    normal: float  #: ∂N/∂d


def new_contact(
    height: Floats,
    radius: Floats,
    stiffness: Floats | None,
    group: Integers | None,
    contact_modulus: float,
    displacement_ratio: float,
    watched: Floats | None = None,
) -> Any:
    """Return a contact of summits, or of knots with a stiffness; see ``hs_contact_new``, ``hs_contact_watch``."""
    knots = ffi.NULL if stiffness is None else pointer(stiffness)
    groups = ffi.NULL if group is None else pointer(group)
    made = lib.hs_contact_new(
        height.size, pointer(height), pointer(radius), knots, groups, contact_modulus, displacement_ratio
    )
    contact = owned(made, lib.hs_contact_free)
    if watched is not None:
        check(lib.hs_contact_watch(contact, watched.size, pointer(watched)))
    return contact


def check_belongs(memory: Any, like: Any) -> None:
    """Check that a memory belongs to the contact, the friction and the laws of another one."""
    if not lib.hs_belongs(memory, like):
        mine, other = _asperities_of(memory), _asperities_of(like)
        more = "" if mine != other else ", with other summits, friction or laws"
        raise InputError(f"the state is of {mine}; expected one of this ensemble's, of {other}{more}")


def _asperities_of(memory: Any) -> str:
    """Say of which asperities a memory is, as far as it knows."""
    contact, units = memory.contact, memory.contact.units
    modulus = 0.75 * units.load / units.length**2
    moduli = modulus, 0.25 * modulus * units.length / units.displacement
    noun = ("element", "elements of normal curves") if contact.load else ("asperity", "asperities")
    yields = " that yield" if memory.evolved and memory.evolved.virgin_height else ""
    contact_modulus, shear_modulus = (quantity_text(each, "Pa") for each in moduli)
    radius = "" if contact.load else f", radii up to {quantity_text(units.length, 'm')}"
    return f"{counted(contact.count, *noun)}{yields} with E* = {contact_modulus}, G* = {shear_modulus}{radius}"


def owned(made: Any, free: Any = lib.hs_memory_free) -> Any:
    """Return what the library has made, a memory for one, which ends with the object that is returned."""
    if not made:
        raise MemoryError("there is not enough memory for the contacts and what they remember")
    return ffi.gc(made, free)


def owned_planar(made: Any) -> Any:
    """Return a memory of two directions that ends with the object that is returned."""
    return owned(made, lib.hs_planar_free)


def copied(memory: Any) -> Any:
    """Return an independent copy."""
    return owned(lib.hs_memory_copy(memory))


def drive(tolerance: float, compliance: float, saturate: bool, threads: int = 1, *, heeds: bool = True) -> Any:
    """Return how a contact is driven; see ``hs_drive``. One that ``heeds`` stops a walk at a signal."""
    return ffi.new("hs_drive *", (tolerance, compliance, saturate, threads, _HEARS if heeds else ffi.NULL))


_heard = threading.local()


def _hear(_kind: object, error: BaseException, _trace: object) -> None:
    _heard.error = error


# on its way into Python the interpreter runs the handlers of signals, and what they raise ends the walk
_HEARS = ffi.callback("int(void *)", lambda _: 0, error=1, onerror=_hear)


def check(status: int, refusal: Any = None) -> None:
    """Raise what a status says."""
    if status == lib.HS_INTERRUPTED:
        raise vars(_heard).pop("error", KeyboardInterrupt())
    if status == lib.HS_BEYOND_LIMIT:
        raise FrictionLimitError(refusal.request, refusal.limit, refusal.path)
    if status == lib.HS_OUT_OF_MEMORY:
        raise MemoryError("there is not enough memory for what the asperities remember")
    if status == lib.HS_FOREIGN:
        raise InputError("an asperity does not exist, or a memory is of other ones; expected those of one ensemble")
    if status != lib.HS_OK:
        raise RuntimeError(f"the memory's library returned {status}")


def advanced(memory: Any, normal: int, end: float, tangential: int, goal: float, driven: Any) -> Any:
    """Return a new memory after one straight path: how each channel is controlled, and its target in N or m, or NaN."""
    after = _advance(memory, normal, end, tangential, goal, driven, _NOTHING)
    if not after:
        if "error" in vars(_heard):
            check(lib.HS_INTERRUPTED)
        refusal = ffi.new("hs_refusal *")
        _advance(memory, normal, end, tangential, goal, driven, refusal)
        check(refusal.status, refusal)
    return _ended_by(after, _free)


# what a tight loop need not look up
_advance, _free, _ended_by, _NOTHING = lib.hs_advance, lib.hs_memory_free, ffi.gc, ffi.NULL


def group_of_each(memory: Any) -> Integers:
    """Return the friction group of each asperity (asperity)."""
    contact = memory.contact
    found = np.empty(contact.count, dtype=np.int64)
    order, first = view(contact.order, contact.count), view(contact.first, contact.groups + 1)
    found[order] = np.repeat(np.arange(contact.groups), np.diff(first))
    return found


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
    return view(memory.vertices + group * memory.capacity, memory.depth[group]).copy()


def to_bytes(memory: Any) -> bytes:
    """Return a memory as bytes, with its contact."""
    size = lib.hs_memory_size(memory)
    content = bytearray(size)
    check(lib.hs_memory_write(memory, ffi.from_buffer(content), size))
    return bytes(content)


def from_bytes(content: bytes, like: Any = None) -> Any:
    """Return the memory that bytes are of; which belongs where another one does, and shares its contact."""
    made, why = ffi.new("hs_memory **"), ffi.new("const char **")
    status = lib.hs_memory_read(ffi.from_buffer(content), len(content), like or ffi.NULL, made, why)
    if status == lib.HS_FOREIGN:
        check_belongs(from_bytes(content), like)
    if status != lib.HS_OK:
        raise InputError(f"{ffi.string(why[0]).decode()}; expected a state that was saved whole")
    return owned(made[0])
