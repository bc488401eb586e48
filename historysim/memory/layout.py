"""How a contact, and what it remembers, are laid out in arrays."""

from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from historysim.memory.compiled import compiled, inlined, short
from historysim.memory.lean import counted, duplicate, empty, given_back, lean, uncounted

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.int8]
Flags = npt.NDArray[np.bool_]

Array = TypeVar("Array", Floats, Integers, Flags)

# columns of a vertex: label, anchor, slope dw/da towards the next deeper vertex, displacement at which it
# was made, load of the group at the label, tangential load of everything deeper
LABEL, ANCHOR, SLOPE, MADE_AT, NORMAL, TANGENTIAL = range(6)

# columns of Memory.now; the excess is what a held tangential load asks for beyond the friction limit, with its sign
APPROACH, DISPLACEMENT, NORMAL_LOAD, TANGENTIAL_LOAD, DISSIPATED, EXCESS = range(6)


class Contact(NamedTuple):
    """What does not change while loads move: geometry and friction of all groups.

    Asperities stand in the order of their groups and, within a group, by ascending gap; groups by
    ascending smallest gap. ``sorted_gap`` and ``sorted_weight`` hold all asperities by ascending gap.
    """

    gap: Floats
    weight: Floats
    first: Integers
    friction: Floats
    sorted_gap: Floats
    sorted_weight: Floats


class Memory(NamedTuple):
    """What the contact remembers: vertex stacks (group, vertex, column), their depths, energies, present loads.

    ``steep`` marks groups whose polyline has slopes beyond μ.
    """

    vertices: Floats
    depth: Integers
    steep: Flags
    dissipated: Floats
    now: Floats


class Group(NamedTuple):
    """One friction group: views of its summits, of what its asperities dissipated, and of its vertex stack."""

    gap: Floats
    weight: Floats
    dissipated: Floats
    stack: Floats
    friction: float


class Units(NamedTuple):
    """Physical size of one dimensionless unit."""

    load: float
    length: float
    displacement: float
    energy: float
    radius: float
    area: float
    stiffness: float


@inlined
def group_of(contact: Contact, memory: Memory, index: int) -> Group:
    """View of one group; contact and memory have to outlive it."""
    start, stop = contact.first[index], contact.first[index + 1]
    return Group(
        uncounted(contact.gap)[start:stop],
        uncounted(contact.weight)[start:stop],
        uncounted(memory.dissipated)[start:stop],
        uncounted(memory.vertices)[index],
        contact.friction[index],
    )


@inlined
def put(
    stack: Floats,
    index: int,
    label: float,
    anchor: float,
    slope: float,
    made_at: float,
    normal: float,
    tangential: float,
) -> None:
    """Write one vertex."""
    stack[index, LABEL] = label
    stack[index, ANCHOR] = anchor
    stack[index, SLOPE] = slope
    stack[index, MADE_AT] = made_at
    stack[index, NORMAL] = normal
    stack[index, TANGENTIAL] = tangential


@short
def copy_vertices(source: Floats, target: Floats, count: int) -> None:
    """Copy the first vertices of a stack."""
    for j in range(count):
        for column in range(source.shape[1]):
            target[j, column] = source[j, column]


@short
def deepest(memory: Memory) -> int:
    """Return the number of vertices of the deepest stack; the groups that touch are the first ones."""
    most = 0
    for index in range(memory.depth.size):
        if memory.depth[index] == 0:
            break
        most = max(most, memory.depth[index])
    return most


@short
def any_steep(memory: Memory) -> bool:
    """Return whether a group's polyline has slopes beyond μ."""
    found = False
    for index in range(memory.steep.size):
        found = found or memory.steep[index]
    return found


@short
def stacks_of_capacity(memory: Memory, capacity: int) -> Floats:
    """Copy the stacks to an array that holds so many vertices each."""
    vertices = empty((memory.vertices.shape[0], capacity, memory.vertices.shape[2]), np.float64)
    for index in range(memory.depth.size):
        copy_vertices(memory.vertices[index], vertices[index], memory.depth[index])
    return vertices


@short
def grown(memory: Memory, capacity: int) -> Memory:
    """Return the memory with stacks that hold so many vertices each; the other arrays are the same ones."""
    return Memory(stacks_of_capacity(memory, capacity), memory.depth, memory.steep, memory.dissipated, memory.now)


@short
def copied(memory: Memory) -> Memory:
    """Return an independent copy, which the next step fits into."""
    return given_back(duplicated(counted(lean(memory))), memory)


@compiled
def duplicated(memory: Memory) -> Memory:
    """Do what `copied` does, for compiled functions alone."""
    return Memory(
        stacks_of_capacity(memory, deepest(memory) + 2),
        duplicate(memory.depth),
        duplicate(memory.steep),
        duplicate(memory.dissipated),
        duplicate(memory.now),
    )


@short
def fill(array: Array, value: float) -> None:
    """Set all items of an array with one axis."""
    for i in range(array.size):
        array[i] = value


@short
def copy_items(source: Array, target: Array) -> None:
    """Copy all items of an array with one axis."""
    for i in range(target.size):
        target[i] = source[i]
