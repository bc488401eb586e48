"""Many contacts of one asperity each, which share nothing: a straight path in (d, V) of every one, exactly.

It is the update of `polyline` where P(a) = a^(3/2) is a closed form, so that one contact takes no longer than to read
and to write what it remembers. Vertices of all contacts stand in one array (vertex, column), each contact's one after
another from its place on; a contact that has no room left moves to the end. Labels and anchors are in m, loads in
units of (4/3) E* √R. A contact that does not touch has no vertex; where it is stands in the place of its first.
"""

import math
from typing import NamedTuple

from historysim.memory.compiled import compiled, entry, inlined
from historysim.memory.layout import Floats, Integers
from historysim.memory.tolerances import TIE

# columns of a vertex: label, anchor, slope towards the next deeper one, tangential load of everything deeper
LABEL, ANCHOR, SLOPE, FORCE = range(4)


class Singles(NamedTuple):
    """What single contacts remember.

    Attributes
    ----------
    vertices : array (vertex, column)
    place : array (contact)
        Where the vertices of a contact begin.
    depth, room : array (contact)
        Vertices that a contact has, and that it has room for.
    used : array (1,)
        Vertices that are given away.
    """

    vertices: Floats
    place: Integers
    depth: Integers
    room: Integers
    used: Integers


@inlined
def load_of(label: float) -> float:
    """Return the normal load P(a) of one asperity."""
    return label * math.sqrt(label)


@inlined
def write(vertices: Floats, at: int, label: float, anchor: float, slope: float, force: float) -> None:
    """Write one vertex."""
    vertices[at, LABEL] = label
    vertices[at, ANCHOR] = anchor
    vertices[at, SLOPE] = slope
    vertices[at, FORCE] = force


@compiled
def relocated(singles: Singles, i: int) -> bool:
    """Give a contact twice its room at the end of the array, if that has it."""
    twice, used = 2 * singles.room[i], singles.used[0]
    if used + twice > len(singles.vertices):
        return False
    start = singles.place[i]
    for j in range(max(singles.depth[i], 1)):
        for column in range(4):
            singles.vertices[used + j, column] = singles.vertices[start + j, column]
    singles.place[i], singles.room[i] = used, twice
    singles.used[0] = used + twice
    return True


@inlined
def outer_end(vertices: Floats, start: int, top: int, d1: float, load: float) -> tuple[int, float, float, float]:
    """Where the polyline ends at approach d1 before any slip: its last segment, and label, anchor and load there."""
    edge, anchor, force = vertices[start + top, LABEL], vertices[start + top, ANCHOR], vertices[start + top, FORCE]
    if d1 < edge:
        while top > 1 and vertices[start + top - 1, LABEL] >= d1:
            top -= 1
        edge, slope = vertices[start + top, LABEL], vertices[start + top, SLOPE]
        anchor = vertices[start + top, ANCHOR] - slope * (edge - d1)
        force = vertices[start + top, FORCE] - slope * (load_of(edge) - load)
        edge = d1
    return top, edge, anchor, force


@inlined
def stuck(
    vertices: Floats,
    start: int,
    count: int,
    top: int,
    edge: float,
    anchor: float,
    force: float,
    d1: float,
    v1: float,
    load: float,
) -> tuple[int, float]:
    """End a path on which everything sticks: vertices that are left, and the tangential load."""
    if d1 < vertices[start + count - 1, LABEL]:
        write(vertices, start + top, d1, anchor, vertices[start + top, SLOPE], force)
        count = top + 1
    elif d1 > edge:
        slope = (v1 - anchor) / (d1 - edge)
        force += slope * (load - load_of(edge))
        if top == 0 or vertices[start + top, SLOPE] != slope:
            top += 1
        write(vertices, start + top, d1, v1, slope, force)
        count = top + 1
    return count, force


@inlined
def slipped(
    vertices: Floats,
    start: int,
    top: int,
    edge: float,
    anchor: float,
    mu: float,
    d1: float,
    v1: float,
    load: float,
    tie: float,
) -> tuple[int, float]:
    """End a path on which springs slip up to a front (see `polyline.slip_front`): as `stuck`."""
    sign = 1.0 if v1 >= anchor else -1.0
    slope = sign * mu
    slip = sign * (v1 - anchor) - mu * (d1 - edge)
    front, inside = edge, False
    met = d1 > edge and slip <= tie
    while top > 0 and not (met or inside):
        inner, low = vertices[start + top, SLOPE], vertices[start + top - 1, LABEL]
        slip_low = sign * (v1 - vertices[start + top - 1, ANCHOR]) - mu * (d1 - low)
        if slip_low < -tie and inner != slope:
            front = max(front - slip / (mu - sign * inner), low)
            inside = True
        else:
            top -= 1
            front, slip = low, slip_low
            met = slip <= tie
    if inside:
        low, inner = vertices[start + top - 1, LABEL], vertices[start + top, SLOPE]
        force = vertices[start + top - 1, FORCE]
        if front != low:
            force += inner * (load_of(front) - load_of(low))
            write(vertices, start + top, front, v1 - slope * (d1 - front), inner, force)
            top += 1
    elif met:
        while top > 0 and vertices[start + top, SLOPE] == slope:
            top -= 1
        front, force = vertices[start + top, LABEL], vertices[start + top, FORCE]
        top += 1
    else:
        # all of it slides
        write(vertices, start, 0.0, v1 - slope * d1, 0.0, 0.0)
        front, force, top = 0.0, 0.0, 1
    force += slope * (load - load_of(front))
    write(vertices, start + top, d1, v1, slope, force)
    return top + 1, force


@entry
def step_singles(
    singles: Singles,
    friction: Floats,
    scale: Floats,
    ratio: float,
    approach: Floats,
    displacement: Floats,
    normal: Floats,
    tangential: Floats,
    first: int,
) -> int:
    """Carry contacts from the first one on straight to their approaches and displacements, and tell their loads.

    ``friction`` and ``scale``, the unit of the load [N/m^1.5], have one entry for all contacts or one for each;
    ``ratio`` is θ, that of U to V. Returns the contact that there is no room for, or their number.
    """
    vertices, place, depth, room = singles.vertices, singles.place, singles.depth, singles.room
    one_friction, one_scale = friction.size == 1, scale.size == 1
    for i in range(first, place.size):
        d1, v1 = approach[i], displacement[i] / ratio
        count, start = depth[i], place[i]
        if d1 <= 0.0:
            vertices[start, LABEL], vertices[start, ANCHOR] = d1, v1
            depth[i], normal[i], tangential[i] = 0, 0.0, 0.0
            continue
        if count + 2 > room[i]:
            if not relocated(singles, i):
                return i
            start = place[i]
        mu, unit = friction[0 if one_friction else i], scale[0 if one_scale else i]
        load = load_of(d1)
        if count == 0:
            d0, v0 = vertices[start, LABEL], vertices[start, ANCHOR]
            write(vertices, start, 0.0, v0 - (v1 - v0) * d0 / (d1 - d0), 0.0, 0.0)
            count = 1
        top, edge, anchor, force = outer_end(vertices, start, count - 1, d1, load)
        change, hold = abs(v1 - anchor), mu * (d1 - edge)
        tie = TIE * (abs(v1) + abs(anchor) + mu * d1)
        # as in `polyline.move_group`
        if v1 == anchor or (change <= tie if hold == 0.0 else change < hold - tie):
            count, force = stuck(vertices, start, count, top, edge, anchor, force, d1, v1, load)
        else:
            count, force = slipped(vertices, start, top, edge, anchor, mu, d1, v1, load, tie)
        depth[i] = count
        normal[i], tangential[i] = unit * load, unit * force
    return place.size
