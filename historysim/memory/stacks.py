"""Views and copies of what a contact remembers: of a group, of vertex stacks, of arrays."""

from typing import TypeVar

import numpy as np

from historysim.memory.compiled import compiled, inlined, short
from historysim.memory.layout import (
    ANCHOR,
    LABEL,
    MADE_AT,
    NORMAL,
    SLOPE,
    TANGENTIAL,
    Contact,
    Flags,
    Floats,
    Group,
    Integers,
    Memory,
)
from historysim.memory.lean import counted, duplicate, empty, fetch, given_back, lean, uncounted

Array = TypeVar("Array", Floats, Integers, Flags)


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
        start,
    )


# how many groups before it is walked a stack is asked for
AHEAD = 16


@inlined
def fetch_group(memory: Memory, index: int) -> None:
    """Have the three outermost vertices of a stack brought near, which is walked soon after that of another group."""
    ahead = index + AHEAD
    if ahead < memory.depth.size:
        depth = memory.depth[ahead]
        if depth > 2:
            # an item of each line of 64 bytes that they stand in
            fetch(memory.vertices, ahead, depth - 3, LABEL)
            fetch(memory.vertices, ahead, depth - 2, ANCHOR)
            fetch(memory.vertices, ahead, depth - 1, ANCHOR)
            fetch(memory.vertices, ahead, depth - 1, TANGENTIAL)


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
    old, new = uncounted(memory.vertices), uncounted(vertices)
    for index in range(memory.depth.size):
        copy_vertices(old[index], new[index], memory.depth[index])
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
        stacks_of_capacity(memory, deepest(uncounted(memory)) + 2),
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
