"""One group on one straight path in (d, V): the exact update of its polyline.

Since dw = m da and dT = m dP along the polyline, any r w + c T over r a + c P(a) is a polyline with the same
slopes m, within the same cone: a displacement (r = 1, c = 0), a load (r = 0, c = 1) and the displacement of a
drive behind a spring of compliance c (r = 1) all move the contact by one update.
"""

import math
from typing import NamedTuple

import numpy as np

from historysim.memory.compiled import inlined
from historysim.memory.fronts import note_front
from historysim.memory.layout import ANCHOR, LABEL, NORMAL, SLOPE, TANGENTIAL, Floats, Group
from historysim.memory.losses import Losses, slip_energy, withdrawal_energy
from historysim.memory.normal import label_at, load_at
from historysim.memory.stacks import put
from historysim.memory.tolerances import TIE


class Aim(NamedTuple):
    """Where the tangential channel goes: ``rigid`` V + ``compliance`` T = ``value``.

    A displacement has (1, 0), a load (0, 1), the displacement of a drive behind a spring (1, c).
    """

    value: float
    rigid: float
    compliance: float


@inlined
def to_displacement(displacement: float) -> Aim:
    """Go to a displacement."""
    return Aim(displacement, 1.0, 0.0)


@inlined
def to_load(force: float) -> Aim:
    """Go to a tangential load."""
    return Aim(force, 0.0, 1.0)


@inlined
def touch(group: Group, depth: int, d0: float, v0: float, d1: float, v1: float) -> int:
    """Start the empty stack of a group that first touches on a straight path from (d0, v0) to (d1, v1); its depth."""
    h = group.gap[0]
    anchor = v0 + (v1 - v0) * (h - d0) / (d1 - d0)
    put(group.stack, depth, h, anchor, 0.0, anchor, 0.0, 0.0)
    return depth + 1


@inlined
def edge_at(stack: Floats, depth: int, d: float, load: float) -> tuple[int, float, float, float, float]:
    """Where the polyline ends at approach d before any slip.

    Returns the index of its last segment, and label, anchor, normal and tangential load at the end.
    """
    top = depth - 1
    if d >= stack[top, LABEL]:
        return top, stack[top, LABEL], stack[top, ANCHOR], stack[top, NORMAL], stack[top, TANGENTIAL]
    while top > 1 and stack[top - 1, LABEL] >= d:
        top -= 1
    slope = stack[top, SLOPE]
    anchor = stack[top, ANCHOR] - slope * (stack[top, LABEL] - d)
    tangential = stack[top, TANGENTIAL] - slope * (stack[top, NORMAL] - load)
    return top, d, anchor, load, tangential


@inlined
def slip_front(
    stack: Floats,
    segment: int,
    x_edge: float,
    y_edge: float,
    x1: float,
    y1: float,
    friction: float,
    rigid: float,
    compliance: float,
) -> tuple[int, float, float, float]:
    """Walk from the edge inward to the slip front.

    The same walk serves every `Aim`: x is ``rigid`` times the label and ``compliance`` times the normal
    load, y the same of anchor and tangential load. Returns how many vertices are kept, x at the front, the
    direction of slip, and the slip at the front, which is 0 unless the whole contact slides. The front lies
    on the last vertex kept where x says so; vertices on the way are wiped out.
    """
    sign = 1.0 if y1 >= y_edge else -1.0
    tie = TIE * (abs(y1) + abs(y_edge) + friction * x1)
    x = x_edge
    slip = sign * (y1 - y_edge) - friction * (x1 - x_edge)
    met_vertex = x1 > x_edge and slip <= tie
    while segment > 0 and not met_vertex:
        slope = stack[segment, SLOPE]
        x_low = rigid * stack[segment - 1, LABEL] + compliance * stack[segment - 1, NORMAL]
        y_low = rigid * stack[segment - 1, ANCHOR] + compliance * stack[segment - 1, TANGENTIAL]
        slip_low = sign * (y1 - y_low) - friction * (x1 - x_low)
        if slip_low < -tie and slope != sign * friction:
            return segment, max(x - slip / (friction - sign * slope), x_low), sign, 0.0
        segment -= 1
        x, slip = x_low, slip_low
        met_vertex = slip <= tie
    if not met_vertex:
        return 0, x, sign, slip
    while segment > 0 and stack[segment, SLOPE] == sign * friction:
        segment -= 1
    return segment + 1, rigid * stack[segment, LABEL] + compliance * stack[segment, NORMAL], sign, 0.0


@inlined
def slip_group(
    group: Group,
    losses: Losses,
    depth: int,
    d0: float,
    v0: float,
    d1: float,
    load: float,
    aim: Aim,
    segment: int,
    edge: float,
    kept: int,
    x_front: float,
    sign: float,
    slip: float,
) -> tuple[int, float, float]:
    """Do what is left of `move_group` where springs slip, the front being found: energy, and the new outer end."""
    stack = group.stack
    goal, rigid, compliance = aim
    slope = sign * group.friction
    below = max(kept - 1, 0)
    front, front_anchor = stack[below, LABEL], stack[below, ANCHOR]
    front_load, front_force = stack[below, NORMAL], stack[below, TANGENTIAL]
    inner = kept > 0 and x_front != rigid * front + compliance * front_load
    inner_slope = 0.0
    if inner:
        inner_slope = stack[kept, SLOPE]
        label = x_front
        if compliance > 0.0:
            outer = edge if kept == segment else stack[kept, LABEL]
            total = x_front - rigid * group.gap[0]
            label = min(max(label_at(group.gap, group.weight, total, outer, rigid, compliance), front), outer)
        normal, stiffness = (x_front, np.inf) if rigid == 0.0 else load_at(group.gap, group.weight, label)
        front_anchor += inner_slope * (label - front)
        front_force += inner_slope * (normal - front_load)
        front, front_load = label, normal
        # measured from what was prescribed, so that rounding does not add up from loop to loop within one another;
        # the one that changes faster along the polyline takes it up
        y_front = goal - slope * (rigid * (d1 - front) + compliance * (load - front_load))
        if rigid >= compliance * stiffness:
            front_anchor = y_front - compliance * front_force
        else:
            front_force = (y_front - rigid * front_anchor) / compliance
    v1 = goal if compliance == 0.0 else front_anchor + slope * (d1 - front) + rigid * sign * slip
    energy = 0.0
    if d1 < d0:
        energy = withdrawal_energy(group, losses, depth, segment, d0, v0, d1, v1)
    energy += slip_energy(group, losses, d0, v0, d1, v1, segment, edge, kept, front, sign, slip)
    if kept == 0:
        put(stack, below, front, v1 - slope * (d1 - front), 0.0, v1, 0.0, 0.0)
        kept = 1
    elif inner:
        put(stack, kept, front, front_anchor, inner_slope, v1, front_load, front_force)
        kept += 1
    reached = goal if rigid == 0.0 else front_force + slope * (load - front_load)
    put(stack, kept, d1, v1, slope, v1, load, reached)
    return kept + 1, v1, energy


@inlined
def first_reach(group: Group, d0: float, v0: float, d1: float, load: float, aim: Aim) -> float:
    """Displacement that a group reaches which first touches on its straight path from (d0, v0) to approach d1.

    All its springs are strained alike, or all slide.
    """
    if aim.compliance == 0.0:
        return aim.value
    slope = (aim.value - aim.rigid * v0) / (aim.rigid * (d1 - d0) + aim.compliance * load)
    if aim.rigid > 0.0 and abs(slope) > group.friction:
        return aim.value - aim.compliance * math.copysign(group.friction * load, slope)
    return v0 + slope * (d1 - d0)


@inlined
def move_group(
    group: Group, losses: Losses, depth: int, d0: float, v0: float, d1: float, load: float, aim: Aim
) -> tuple[int, float, float]:
    """Carry one group straight from (d0, v0) to approach d1 and to where it aims, exactly.

    The group touches at d1, where it carries ``load``; its stack has ``depth`` vertices, or none at d0
    where that is 0. Returns the depth, the displacement reached, and the energy dissipated as far as it is not put off.
    """
    stack, friction = group.stack, group.friction
    y1, rigid, compliance = aim
    if depth == 0:
        depth = touch(group, depth, d0, v0, d1, first_reach(group, d0, v0, d1, load, aim))
    segment, edge, anchor, edge_load, edge_force = edge_at(stack, depth, d1, load)
    x1, x_edge = rigid * d1 + compliance * load, rigid * edge + compliance * edge_load
    y_edge = rigid * anchor + compliance * edge_force
    change, hold = abs(y1 - y_edge), friction * (x1 - x_edge)
    tie = TIE * (abs(y1) + abs(y_edge) + friction * x1)
    # at the edge itself rounding is no reason to slip; new springs slip when they tie with the limit
    if y1 == y_edge or (change <= tie if hold == 0.0 else change < hold - tie):
        energy = 0.0
        slope = (y1 - y_edge) / (x1 - x_edge) if x1 > x_edge else 0.0
        v1 = y1 if compliance == 0.0 else anchor + slope * (d1 - edge)
        if d1 < d0:
            energy = withdrawal_energy(group, losses, depth, segment, d0, v0, d1, v1)
            put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
            depth = segment + 1
        elif d1 > edge:
            top = segment if segment > 0 and stack[segment, SLOPE] == slope else segment + 1
            reached = y1 if rigid == 0.0 else edge_force + slope * (load - edge_load)
            put(stack, top, d1, v1, slope, v1, load, reached)
            depth = top + 1
        return depth, v1, energy
    kept, x_front, sign, slip = slip_front(stack, segment, x_edge, y_edge, x1, y1, friction, rigid, compliance)
    return slip_group(group, losses, depth, d0, v0, d1, load, aim, segment, edge, kept, x_front, sign, slip)


@inlined
def force_of_group(
    group: Group, depth: int, d0: float, v0: float, d1: float, v1: float, load: float, fronts: Floats, index: int
) -> tuple[float, float, float]:
    """Tangential force that `move_group` would reach, with its first and second derivative in v1.

    Nothing is changed, but for the first vertex of a group that does not touch yet. A slip front that can be is
    noted instead, and gives the force from then on (see `fronts`).
    """
    stack, friction = group.stack, group.friction
    if depth == 0:
        depth = touch(group, depth, d0, v0, d1, v1)
    segment, edge, anchor, edge_load, edge_force = edge_at(stack, depth, d1, load)
    if d1 > edge and abs(v1 - anchor) <= friction * (d1 - edge):
        slope = (v1 - anchor) / (d1 - edge)
        return edge_force + slope * (load - edge_load), (load - edge_load) / (d1 - d0), 0.0
    if v1 == anchor:
        return edge_force, load_at(group.gap, group.weight, edge)[1], 0.0
    kept, front, sign, _ = slip_front(stack, segment, edge, anchor, d1, v1, friction, 1.0, 0.0)
    if note_front(fronts, index, group, depth, kept, sign):
        return 0.0, 0.0, 0.0
    slope = sign * friction
    if kept == 0:
        return slope * load, 0.0, 0.0
    front_load, stiffness = load_at(group.gap, group.weight, front)
    force, curvature = stack[kept - 1, TANGENTIAL], 0.0
    if front != stack[kept - 1, LABEL]:
        inner_slope = stack[kept, SLOPE]
        force += inner_slope * (front_load - stack[kept - 1, NORMAL])
        # a single parabola through the foremost asperity stands for P'' here: only the speed depends on it
        curvature = 0.5 * stiffness / ((front - group.gap[0]) * (inner_slope - slope))
    return force + slope * (load - front_load), stiffness, curvature
