"""Another geometry for asperities under a load: what they remember, in the order of the new gaps."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.grouping import ordered
from historysim.memory.friction import refresh_loads
from historysim.memory.groups import total_force
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    NORMAL,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Integers,
    Memory,
)
from historysim.memory.normal import load_at

Floats = npt.NDArray[np.float64]


@attrs.frozen(eq=False)
class Rearranged:
    """Contact, order and memory after the geometry has changed."""

    contact: Contact
    order: Integers
    memory: Memory


def rearranged(
    contact: Contact,
    order: Integers,
    memory: Memory,
    gap: Floats,
    weight: Floats,
    fresh: npt.NDArray[np.bool_],
) -> Rearranged:
    """Give asperities other gaps and weights at the present approach and displacement.

    Where one is fresh, its contact is new: nothing is remembered, its springs are not strained. All others keep the
    anchors of their springs, as far as these are still in contact. The present loads follow.

    Parameters
    ----------
    contact, order, memory
        What is there.
    gap, weight : array (position)
        New ones, in the order of ``contact``.
    fresh : array of bool (position)
    """
    members = np.diff(contact.first)
    before = np.repeat(np.arange(contact.friction.size), members)
    friction = np.repeat(contact.friction, members)
    # asperities of a group that are fresh together share what they remember from now on
    _, group = np.unique(2 * before + fresh, return_inverse=True)
    new, place = ordered(group, friction, gap, weight, order)
    leader = place[new.first[:-1]]
    approach, displacement = memory.now[APPROACH], memory.now[DISPLACEMENT]
    parent, touches = before[leader], gap[leader] < approach
    room = max(memory.vertices.shape[1], 2)
    vertices = np.zeros((parent.size, room, memory.vertices.shape[2]))
    vertices[:, : memory.vertices.shape[1]] = memory.vertices[parent]
    depth, steep = np.where(touches, memory.depth[parent], 0), memory.steep[parent] & touches
    for index in np.flatnonzero(fresh[leader]):
        vertices[index, :2] = 0.0
        vertices[index, :2, :NORMAL] = [
            [gap[leader[index]], displacement, 0.0, displacement],
            [approach, displacement, 0.0, displacement],
        ]
        depth[index], steep[index] = 2 if touches[index] else 0, False
    kept = Memory(vertices, depth, steep, memory.dissipated[place], memory.now.copy())
    refresh_loads(new, kept)
    kept.now[NORMAL_LOAD] = load_at(new.sorted_gap, new.sorted_weight, approach)[0]
    kept.now[TANGENTIAL_LOAD] = total_force(new, kept)
    return Rearranged(new, order[place], kept)
