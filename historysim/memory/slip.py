"""Which springs of a group slide, and how far its tractions are from Coulomb's law at every point.

Springs slide where the polyline lies on the cone. After a fall of μ that leaves slopes beyond it, this may be an
inner disc while the edge sticks; otherwise it is an annulus from the edge inward.
"""

import math

import numpy as np

from historysim.memory.compiled import compiled, entry, inlined, short
from historysim.memory.layout import ANCHOR, DISPLACEMENT, LABEL, SLOPE, Contact, Floats, Memory
from historysim.memory.lean import lean, uncounted
from historysim.memory.normal import load_at
from historysim.memory.stacks import group_of
from historysim.memory.tolerances import TIE

# places in each segment at which the tractions are looked at, before the largest is refined
SAMPLES = 16


@inlined
def sliding_side(stack: Floats, depth: int, j: int, displacement: float, friction: float) -> float:
    """Return the side of the cone on which the springs of segment j slide, 1 or -1; 0 where they stick."""
    slope = stack[j, SLOPE]
    if abs(slope) != friction:
        return 0.0
    side = math.copysign(1.0, slope)
    reach = stack[depth - 1, LABEL] - stack[j, LABEL]
    over = side * (displacement - stack[j, ANCHOR]) - friction * reach
    return side if abs(over) <= TIE * (abs(displacement) + abs(stack[j, ANCHOR]) + friction * reach) else 0.0


@short
def slip_zones(stack: Floats, depth: int, displacement: float, friction: float, steep: bool) -> tuple[float, float]:
    """Return the label where the slip annulus at the edge ends, and the outermost label of any spring that slides.

    The first is the edge where the edge sticks, the second minus infinity where nothing slides.
    """
    top, edge = depth - 1, stack[depth - 1, LABEL]
    if sliding_side(stack, depth, top, displacement, friction) != 0.0:
        return stack[top - 1, LABEL], edge
    if steep:
        for j in range(top - 1, 0, -1):
            if sliding_side(stack, depth, j, displacement, friction) != 0.0:
                return edge, stack[j, LABEL]
    return edge, -np.inf


@entry
def sticking_stiffness(contact: Contact, memory: Memory, direction: float) -> float:
    """Return dT/dV at a fixed approach when the displacement goes on in a direction, 1 or -1.

    With 0 it is that of the springs that stick now, without those that slide either way.
    """
    contact, memory = lean(contact), uncounted(lean(memory))
    displacement = memory.now[DISPLACEMENT]
    stiffness = 0.0
    for index in range(contact.friction.size):
        depth = memory.depth[index]
        if depth == 0:
            break
        group = group_of(contact, memory, index)
        stack, everywhere = group.stack, direction == 0.0 or group.friction == 0.0
        # an annulus at the edge, and inner discs where the polyline is steep
        side = sliding_side(stack, depth, depth - 1, displacement, group.friction)
        outer = depth - 2 if side != 0.0 and (everywhere or side == direction) else depth - 1
        stiffness += load_at(group.gap, group.weight, stack[outer, LABEL])[1]
        for j in range(depth - 2 if memory.steep[index] else 0, 0, -1):
            side = sliding_side(stack, depth, j, displacement, group.friction)
            if side != 0.0 and (everywhere or side == direction):
                upper = load_at(group.gap, group.weight, stack[j, LABEL])[1]
                stiffness -= upper - load_at(group.gap, group.weight, stack[j - 1, LABEL])[1]
    return stiffness


@short
def traction_ratio(stack: Floats, depth: int, friction: float, label: float) -> float:
    """Return |τ|/(μ p) at the radius of a label: the same on all asperities of a group that have it."""
    total = 0.0
    for j in range(depth - 1, 0, -1):
        high = stack[j, LABEL]
        if high <= label:
            break
        low = max(stack[j - 1, LABEL], label)
        total += stack[j, SLOPE] * (math.sqrt(high - label) - math.sqrt(low - label))
    return abs(total) / (friction * math.sqrt(stack[depth - 1, LABEL] - label))


@compiled
def largest_traction_ratio(stack: Floats, depth: int, friction: float) -> float:
    """Return the largest |τ|/(μ p) of a group, found to about 1e-4."""
    if depth < 2 or friction == 0.0:
        return 0.0
    largest = abs(stack[depth - 1, SLOPE]) / friction
    for j in range(1, depth):
        # below a vertex tractions change with the root of the distance to it
        high, width = stack[j, LABEL], math.sqrt(stack[j, LABEL] - stack[j - 1, LABEL])
        best, at_best = 0.0, 0
        for i in range(1, SAMPLES + 1):
            here = traction_ratio(stack, depth, friction, high - (width * i / SAMPLES) ** 2)
            if here > best:
                best, at_best = here, i
        low_x, high_x = width * max(at_best - 1, 0.01) / SAMPLES, width * min(at_best + 1, SAMPLES) / SAMPLES
        for _ in range(12):
            third = (high_x - low_x) / 3.0
            left = traction_ratio(stack, depth, friction, high - (low_x + third) ** 2)
            right = traction_ratio(stack, depth, friction, high - (high_x - third) ** 2)
            best = max(best, left, right)
            if left < right:
                low_x += third
            else:
                high_x -= third
        largest = max(largest, best)
    return largest
