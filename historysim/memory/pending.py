"""What a row needs of the memory, set aside until its asperities are projected, while the walk goes on.

Rows do not depend on one another: whoever has this projects them in any order, on any thread, to the same bits.
"""

from typing import NamedTuple

import numpy as np

from historysim.memory.compiled import short
from historysim.memory.layout import TANGENTIAL, Flags, Floats, Integers, Memory
from historysim.memory.rows import OF_EACH
from historysim.memory.stacks import copy_vertices, deepest

VERTEX = TANGENTIAL + 1


class Pending(NamedTuple):
    """The memory as it was at each of some rows, but for the energies, which are recorded at once.

    Attributes
    ----------
    waits : array (row)
        Whether the row is to be projected still; rows of which more would have to be kept than is recorded do not wait.
    vertices : array (row, group, vertex, column)
    depth, steep : array (row, group)
    now : array (row, column)
    """

    waits: Flags
    vertices: Floats
    depth: Integers
    steep: Flags
    now: Floats


def room_for(rows: int, groups: int, columns: int) -> Pending:
    """Return room for the memory of rows of so many groups and recorded asperities, no more than the rows take."""
    capacity = columns * OF_EACH // (VERTEX * groups)
    return Pending(
        waits=np.zeros(rows, dtype=np.bool_),
        vertices=np.empty((rows, groups, capacity, VERTEX)),
        depth=np.empty((rows, groups), dtype=np.int64),
        steep=np.empty((rows, groups), dtype=np.bool_),
        now=np.empty((rows, 6)),
    )


NO_ROOM = room_for(0, 1, 0)
"""For a walk that projects each row itself."""


@short
def set_aside(memory: Memory, pending: Pending, row: int) -> bool:
    """Keep the memory as it is at a row, and return whether there was room for it."""
    if row >= pending.waits.size or deepest(memory) > pending.vertices.shape[2]:
        return False
    pending.waits[row] = True
    for index in range(memory.depth.size):
        pending.depth[row, index] = memory.depth[index]
        pending.steep[row, index] = memory.steep[index]
        copy_vertices(memory.vertices[index], pending.vertices[row, index], memory.depth[index])
    for column in range(memory.now.size):
        pending.now[row, column] = memory.now[column]
    return True
