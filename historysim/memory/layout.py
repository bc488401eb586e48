"""How a contact, and what it remembers, are laid out in arrays; it needs no compiler."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.int8]
Flags = npt.NDArray[np.bool_]

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
    """One friction group: views of its summits, of what its asperities dissipated, and of its vertex stack.

    ``start`` is its first asperity.
    """

    gap: Floats
    weight: Floats
    dissipated: Floats
    stack: Floats
    friction: float
    start: int


class Units(NamedTuple):
    """Physical size of one dimensionless unit."""

    load: float
    length: float
    displacement: float
    energy: float
    radius: float
    area: float
    stiffness: float
