"""Binding of the C library: ownership of states, their numbers, one or two tangential directions, and errors."""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from historysim.basics.arguments import Array, Floats, Integers
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.units import is_number, quantity_text
from historysim.basics.wording import count_text
from historysim.errors import FrictionLimitError, InputError

LOAD: int = lib.HS_LOAD
DISPLACED: int = lib.HS_DISPLACED
# control of a tangential component that is held as it was controlled last
AS_BEFORE: int = lib.HS_HELD

# Relative difference of two displacements or loads that rounding alone keeps apart.
TIE = 32 * float(np.finfo(np.float64).eps)

NEEDS_PAIR = "the state has two tangential directions; expected two numbers, in x and y, not one"
_KINDS = {"double": "f8", "int64_t": "i8", "int32_t": "i4", "int8_t": "i1", "uint8_t": "u1"}


def numpy_dtype(struct: str) -> np.dtype[Any]:
    """Return a structured type of numpy with the fields of a struct of numbers."""
    fields = dict(ffi.typeof(struct).fields)
    return np.dtype(
        {
            "names": list(fields),
            "formats": [_format_code(field.type) for field in fields.values()],
            "offsets": [field.offset for field in fields.values()],
            "itemsize": ffi.sizeof(struct),
        }
    )


def _format_code(kind: Any) -> Any:
    return (_KINDS[kind.item.cname], kind.length) if kind.kind == "array" else _KINDS[kind.cname]


PATH, TOTALS, VERTEX = numpy_dtype("hs_path"), numpy_dtype("hs_totals"), numpy_dtype("hs_vertex")


# ``hs_state``, what a contact remembers, with its memory along one ``line``; its fields are
# described in the header.
Memory = Any


class Slopes(NamedTuple):
    """Derivatives of the loads at the end of a path with respect to its end, at a fixed start [N/m]."""

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
    struct = lib.hs_contact_new(
        height.size,
        pointer(height),
        pointer(radius),
        knots,
        groups,
        contact_modulus,
        displacement_ratio,
    )
    contact = take_ownership(struct, lib.hs_contact_free)
    if watched is not None:
        check(lib.hs_contact_watch(contact, watched.size, pointer(watched)))
    return contact


def check_belongs(memory: Any, like: Any) -> None:
    """Check that a memory belongs to the contact, the friction and the laws of another one."""
    if not lib.hs_belongs(memory, like):
        mine, expected = _describe_asperities(memory), _describe_asperities(like)
        more = "" if mine != expected else ", with other summits, friction or laws"
        raise InputError(
            f"the state is of {mine}; expected one of this ensemble's, of {expected}{more}"
        )


def _describe_asperities(memory: Any) -> str:
    """Describe the asperities of a memory for messages."""
    line, contact, units = memory.line, memory.line.contact, memory.line.contact.units
    modulus = 0.75 * units.load / units.length**2
    moduli = modulus, 0.25 * modulus * units.length / units.displacement
    noun = ("element", "elements of normal curves") if contact.load else ("asperity", "asperities")
    yields = " that yield" if line.evolved and line.evolved.virgin_height else ""
    contact_modulus, shear_modulus = (quantity_text(value, "Pa") for value in moduli)
    radius = "" if contact.load else f", radii up to {quantity_text(units.length, 'm')}"
    return f"{count_text(contact.count, *noun)}{yields} with E* = {contact_modulus}, G* = {shear_modulus}{radius}"


def take_ownership(struct: Any, free: Any = lib.hs_state_free) -> Any:
    """Take ownership of a struct that the library has allocated, by default a state."""
    if not struct:
        raise MemoryError("there is not enough memory for the contacts and what they remember")
    return ffi.gc(struct, free)


def copy_state(memory: Any) -> Any:
    """Return an independent copy."""
    return take_ownership(lib.hs_state_copy(memory))


def drive(
    tolerance: float,
    compliances: tuple[float, float],
    saturate: bool,
    threads: int = 1,
    *,
    heeds: bool = True,
) -> Any:
    """Return how a contact is driven; see ``hs_drive``. One that ``heeds`` stops an integration at a signal."""
    return ffi.new(
        "hs_drive *", (tolerance, compliances, saturate, threads, _HEARS if heeds else ffi.NULL)
    )


_heard = threading.local()


def _hear(_kind: object, error: BaseException, _trace: object) -> None:
    _heard.error = error


# on its way into Python the interpreter runs the handlers of signals, and what they raise ends the
# walk
_HEARS = ffi.callback("int(void *)", lambda _: 0, error=1, onerror=_hear)


def check(status: int, refusal: Any = None) -> None:
    """Raise the error of a status."""
    if status == lib.HS_INTERRUPTED:
        raise vars(_heard).pop("error", KeyboardInterrupt())
    if status == lib.HS_BEYOND_LIMIT:
        raise FrictionLimitError(refusal.request, refusal.limit, refusal.path)
    if status == lib.HS_OUT_OF_MEMORY:
        raise MemoryError("there is not enough memory for what the asperities remember")
    if status == lib.HS_FOREIGN:
        raise InputError(
            "an asperity does not exist, or a memory is of other ones; expected those of one ensemble"
        )
    if status != lib.HS_OK:
        raise RuntimeError(f"the memory's library returned {status}")


def new_stepper() -> tuple[Any, Any]:
    """Return an ``hs_stepper`` with channels held, and a writable view of its doubles, from the goals on."""
    stepper = ffi.new("hs_stepper *")
    numbers = memoryview(ffi.buffer(stepper))[ffi.offsetof("hs_stepper", "normal") :].cast("d")
    for goal in range(6):
        numbers[goal] = _NAN
    return stepper, numbers


def advance_state(
    memory: Any, normal: int, end: float, tangential: int, goal: float, driven: Any
) -> Any:
    """Return a new memory after one straight path along x: how each channel is controlled, and its target, or NaN."""
    end_state = _advance(memory, normal, end, tangential, goal, driven, _NOTHING)
    if not end_state:
        _raise_refusal(_advance, memory, normal, end, tangential, goal, driven)
    return _ended_by(end_state, _free)


def advanced_in_plane(
    memory: Any, normal: int, end: float, tangential: Any, goal: Any, driven: Any
) -> Any:
    """Return a new memory after one straight path in a plane: controls and targets of x and y, NaN if held."""
    controls = tangential if tangential.__class__ is tuple else (tangential, tangential)
    x, y = goal if goal.__class__ is tuple else (_NAN, _NAN)
    if goal.__class__ is not tuple and goal == goal:  # noqa: PLR0124
        raise InputError(NEEDS_PAIR)
    # of NaN, which holds a channel, each comparison is false
    targets = x if x == x else 0.0, y if y == y else 0.0  # noqa: PLR0124
    fractions = x == x, y == y  # noqa: PLR0124
    presses = end == end  # noqa: PLR0124
    fields = (
        end if presses else 0.0,
        presses,
        targets,
        fractions,
        1,
        0,
        normal,
        controls,
        0,
        _NAN,
        _NAN,
    )
    path = _new(_PATH, fields)
    end_state = _advance_along(memory, path, driven, _NOTHING)
    if not end_state:
        _raise_refusal(_advance_along, memory, path, driven)
    return _ended_by(end_state, _free)


def _raise_refusal(function: Any, *path: Any) -> None:
    """Raise the error of a path that was refused, which is tried once more to learn why."""
    if "error" in vars(_heard):
        check(lib.HS_INTERRUPTED)
    refusal = ffi.new("hs_refusal *")
    function(*path, refusal)
    check(refusal.status, refusal)


# what a tight loop need not look up
_advance, _advance_along, _free = lib.hs_advance, lib.hs_advance_along, lib.hs_state_free
_ended_by, _new, _PATH, _NOTHING = ffi.gc, ffi.new, ffi.typeof("hs_path *"), ffi.NULL
_NAN = float("nan")


def group_of_each(memory: Any) -> Integers:
    """Return the friction group of each asperity (asperity)."""
    contact = memory.line.contact
    groups = np.empty(contact.count, dtype=np.int64)
    order, group_starts = (
        view(contact.order, contact.count),
        view(contact.first, contact.groups + 1),
    )
    groups[order] = np.repeat(np.arange(contact.groups), np.diff(group_starts))
    return groups


def fill(struct: Any, values: Mapping[str, Any]) -> list[Any]:
    """Fill in fields of a struct: names of constants, numbers, arrays; return the arrays it points to."""
    arrays = []
    for name, value in values.items():
        if isinstance(value, tuple | np.ndarray):
            arrays.append(np.ascontiguousarray(value, dtype=np.float64))
            setattr(struct, name, pointer(arrays[-1]))
        else:
            setattr(struct, name, ffi.integer_const(value) if isinstance(value, str) else value)
    return arrays


def view(numbers: Any, count: int) -> Array:
    """Return numbers of the library as an array that does not own them."""
    kind = ffi.typeof(numbers).item
    dtype = VERTEX if kind.kind == "struct" else np.dtype(_KINDS[kind.cname])
    return np.frombuffer(ffi.buffer(numbers, count * ffi.sizeof(kind)), dtype=dtype)


def stack(memory: Any, group: int = 0) -> Array:
    """Return a copy of the vertices of a group, the deepest first, with the fields of ``hs_vertex``."""
    memory = with_groups(memory)  # owns the vertices
    line = memory.line
    return view(line.vertices + group * line.capacity, line.depth[group]).copy()


def with_groups(memory: Any) -> Any:
    """Return a memory whose groups hold their vertices: the same one, or a copy of one that is scaled."""
    if not memory.line.scaled:
        return memory
    copy = copy_state(memory)
    check(lib.hs_restore_groups(copy))
    return copy


def to_bytes(memory: Any) -> bytes:
    """Return a memory as bytes, with its contact."""
    size = lib.hs_state_size(memory)
    content = bytearray(size)
    check(lib.hs_state_write(memory, ffi.from_buffer(content), size))
    return bytes(content)


def from_bytes(content: bytes, like: Any = None) -> Any:
    """Return the memory that bytes are of; which belongs where another one does, and shares its contact."""
    state, problem = ffi.new("hs_state **"), ffi.new("const char **")
    status = lib.hs_state_read(
        ffi.from_buffer(content), len(content), like or ffi.NULL, state, problem
    )
    if status == lib.HS_FOREIGN:
        check_belongs(from_bytes(content), like)
    if status != lib.HS_OK:
        raise InputError(
            f"{ffi.string(problem[0]).decode()}; expected a state that was saved whole"
        )
    return take_ownership(state[0])


# ---- one tangential direction, or two
# -------------------------------------------------------------------------------


def count_directions(memory: Any) -> int:
    """Return the number of tangential directions in which a memory moves."""
    return 2 if memory.plane else 1


def moves_like(memory: Any, other: Any) -> bool:
    """Whether two states have the same number of tangential directions, and both evolve or neither does."""
    layout, other_layout = ((bool(each.plane), bool(each.line.evolved)) for each in (memory, other))
    return layout == other_layout


def check_one_direction(memory: Any) -> None:
    """Check that a memory moves in one tangential direction."""
    if memory.plane:
        raise InputError(
            "the state has two tangential directions; expected a state with one, or `advance`"
        )


def check_in_plane(paths: Array) -> Array:
    """Return paths for a state of two directions; a tangential channel that is one number for both has to be held."""
    is_scalar = paths["tangential_control"][:, 1] == AS_BEFORE
    if not is_scalar.any():
        return paths
    if (is_scalar & (paths["tangential_fraction"][:, 0] > 0.0)).any():
        raise InputError(NEEDS_PAIR)
    paths_in_plane = paths.copy()
    paths_in_plane["tangential_control"][is_scalar] = AS_BEFORE
    return paths_in_plane


def are_in_plane(paths: Array) -> bool:
    """Whether the tangential targets of paths are pairs, in x and y."""
    return bool((paths["tangential_control"][:, 1] != AS_BEFORE).any())


def by_load(paths: Array) -> Array:
    """Return whether x and y are controlled by load on each path (path, 2); in one direction both as x."""
    control = paths["tangential_control"]
    both = np.where(control == AS_BEFORE, control[:, :1], control)
    is_by_load: Array = both == LOAD
    return is_by_load


def enter_plane(memory: Any, height_classes: int, rings: int, tolerance: float) -> Any:
    """Return a copy of a memory that moves in two tangential directions from now on."""
    if memory.line.evolved:
        raise InputError(
            "the state follows how its asperities change, which supports one tangential direction only; expected one "
            "number, not a pair"
        )
    state = copy_state(memory)
    check(lib.hs_state_enter_plane(state, height_classes, rings, tolerance))
    return state


def tangential(memory: Any, name: str, unit: str) -> Any:
    """Return a tangential quantity in SI: a number, or a vector (direction) of a memory in a plane."""
    line, plane = memory.line, memory.plane
    scale = getattr(line.contact.units, unit)
    if not plane:
        return float(getattr(line, name) * scale)
    vector = getattr(plane, name)
    return np.array([vector.x * scale, vector.y * scale])


def tangential_control(memory: Any) -> int | tuple[int, int]:
    """Return how the tangential channel was controlled last, or its components x and y."""
    plane = memory.plane
    if not plane:
        control: int = memory.line.tangential_control
        return control
    x, y = plane.tangential_control
    return x, y


@contextmanager
def temporary_control(memory: Any, control: int) -> Iterator[None]:
    """Control the tangential channel of a memory otherwise for a while."""
    line, plane = memory.line, memory.plane
    controls = line.tangential_control, tangential_control(memory)
    set_tangential_control(memory, control)
    try:
        yield
    finally:
        line.tangential_control = controls[0]
        if plane:
            plane.tangential_control = controls[1]


def set_tangential_control(memory: Any, control: int) -> None:
    """Set how the tangential channel is controlled, in each direction."""
    memory.line.tangential_control = control
    if memory.plane:
        memory.plane.tangential_control = [control, control]


def positions_along_line(memory: Any, displacement: Floats) -> Floats:
    """Return positions [m] of dimensionless displacements along the line of motion: numbers, or vectors in a plane."""
    scale, plane = memory.line.contact.units.displacement, memory.plane
    if not plane:
        along: Floats = displacement * scale
        return along
    axes = (plane.origin.x, plane.direction.x), (plane.origin.y, plane.direction.y)
    return np.stack(
        [scale * (origin + component * displacement) for origin, component in axes], axis=-1
    )


def stiffness(memory: Any, direction: Any) -> Any:
    """Return dT/dU for a displacement that continues in a direction, ±1 [N/m]; of a pair in a plane, a matrix."""
    if not memory.plane:
        if isinstance(direction, bool) or direction not in {1, -1}:
            raise InputError(
                f"direction is {direction!r}; expected 1 (the displacement grows) or -1 (it falls)"
            )
        return float(lib.hs_stiffness(memory, direction))
    towards = (0.0, 0.0) if direction is None else direction
    pair = isinstance(towards, tuple | list | np.ndarray) and len(towards) == 2
    if not pair or not all(is_number(each) and np.isfinite(each) for each in towards):
        raise InputError(f"direction is {direction!r}; expected two numbers, in x and y")
    matrix = np.empty((2, 2))
    check(lib.hs_stiffness_matrix(memory, ffi.new("double[2]", [*towards]), pointer(matrix)))
    return matrix


def sticking_stiffness(memory: Any) -> Any:
    """Return dT/dU of the springs that stick now [N/m]; in a plane a matrix."""
    return stiffness(memory, None) if memory.plane else float(lib.hs_stiffness(memory, 0))


def nodes(memory: Any, asperity: int) -> Floats | None:
    """Return label and deflection in x and y of each node of an asperity's rings (node, 3), the edge first.

    They are dimensionless; None in one direction.
    """
    if not memory.plane:
        return None
    rows = np.zeros((max(lib.hs_nodes(memory, asperity, 0, ffi.NULL), 0), 3))
    if lib.hs_nodes(memory, asperity, len(rows), pointer(rows)) != len(rows):
        raise MemoryError("there is not enough memory for the nodes of an asperity")
    return rows
