"""How the loads at the end of a path change with where it ends: what an implicit integrator asks for.

Springs that slide lie on the cone, v = ±μ (d - a): they move with the approach alone. Springs that stick move with the
displacement alone, but for those that touched on the path: v = (V1 - V0) (d1 - a)/(d1 - d0) moves with both. The loads
are ∫ v N'' da, so that each part between labels a and b adds differences of P and P' at its ends. The derivatives are
those on the side of the path: where it turned around, those of the way on which it came last.
"""

from typing import NamedTuple

from historysim.memory.compiled import compiled
from historysim.memory.layout import APPROACH, DISPLACEMENT, LABEL, SLOPE, Contact, Memory
from historysim.memory.normal import load_at
from historysim.memory.slip import sliding_side
from historysim.memory.stacks import group_of


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


@compiled
def slopes(contact: Contact, memory: Memory, d0: float) -> Slopes:
    """Return the derivatives at the end of a straight path from approach d0, dimensionless.

    The path is straight in (d, V), or, of a single group, in (N, T). Without a path, from the present approach, they
    are those of the last one that slipped.
    """
    d1, v1 = memory.now[APPROACH], memory.now[DISPLACEMENT]
    tangential, coupling, normal = 0.0, 0.0, 0.0
    for index in range(contact.friction.size):
        depth = memory.depth[index]
        if depth == 0:
            break
        group = group_of(contact, memory, index)
        gap, weight, stack, friction = group.gap, group.weight, group.stack, group.friction
        load, outer = load_at(gap, weight, d1)
        normal += outer
        tangential += outer
        top = depth - 1
        if d1 > d0 and top > 0 and sliding_side(stack, depth, top, v1, friction) == 0.0:
            first = max(d0, gap[0])
            first_load, inner = load_at(gap, weight, first)
            way = d1 - d0
            rise = load - first_load
            tangential += (rise - (d1 - first) * inner) / way - (outer - inner)
            coupling += stack[top, SLOPE] * (outer - ((first - d0) * inner + rise) / way)
        for j in range(top, 0 if memory.steep[index] else max(top - 1, 0), -1):
            side = sliding_side(stack, depth, j, v1, friction)
            if side != 0.0:
                upper = load_at(gap, weight, stack[j, LABEL])[1]
                lower = load_at(gap, weight, stack[j - 1, LABEL])[1]
                tangential -= upper - lower
                coupling += side * friction * (upper - lower)
    return Slopes(tangential, coupling, normal)
