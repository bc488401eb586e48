"""Polylines steeper than the cone, as a fall of μ leaves them: several zones may slip at once."""

import math

import numpy as np

from historysim.memory.compiled import compiled, inlined, short
from historysim.memory.energy import dissipate
from historysim.memory.layout import ANCHOR, LABEL, MADE_AT, NORMAL, SLOPE, TANGENTIAL, Floats, Group
from historysim.memory.lean import empty, uncounted
from historysim.memory.losses import Losses, withdrawal_energy
from historysim.memory.normal import load_at
from historysim.memory.polyline import edge_at
from historysim.memory.stacks import copy_vertices, put
from historysim.memory.tolerances import TIE


@short
def is_steep(stack: Floats, depth: int, friction: float) -> bool:
    """Whether a slope exceeds μ, as it may after a fall of μ; several zones may then slip at once."""
    steepest = 0.0
    for j in range(1, depth):
        steepest = max(steepest, abs(stack[j, SLOPE]))
    return steepest > friction


@compiled
def carried(group: Group, depth: int, d1: float, v1: float, load: float) -> Floats:
    """Polyline of a touching group carried straight to (d1, v1) before any slip: cut, or extended by new springs."""
    segment, edge, anchor, edge_load, edge_force = edge_at(group.stack, depth, d1, load)
    stack = empty((segment + 2, group.stack.shape[1]), np.float64)
    copy_vertices(group.stack, uncounted(stack), segment + 1)
    if d1 <= edge:
        put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
        return stack[: segment + 1]
    slope = (v1 - anchor) / (d1 - edge)
    put(stack, segment + 1, d1, v1, slope, v1, load, edge_force + slope * (load - edge_load))
    return stack


@short
def crossing(low: float, high: float, v_low: float, v_high: float, d: float, side: float) -> float:
    """Label where v, straight from v_low to v_high, crosses side·(d - a); ``high`` where that is not inside."""
    over_low, over_high = v_low - side * (d - low), v_high - side * (d - high)
    tie = TIE * (abs(v_low) + abs(side) * d)
    if over_low * over_high >= 0.0 or min(abs(over_low), abs(over_high)) <= tie:
        return high
    return low + (high - low) * over_low / (over_low - over_high)


@inlined
def mean_drag(limit: float, slip: float, moved: float, growth: float) -> float:
    """Return the mean deflection of a spring while it slips: it was moved straight, and its limit grew straight."""
    # slip of a spring that slips all the way
    whole = moved - growth
    return max(limit - 0.5 * growth * slip / whole, 0.0) if whole > 0.0 else limit


@compiled
def clip(
    group: Group,
    stack: Floats,
    d: float,
    displacement: float,
    friction: float,
    moved: float,
    rise: float,
    gain: float,
    dissipates: bool,
) -> tuple[Floats, float, float]:
    """Clip any polyline to the cone |v| ≤ μ (d - a): both sides may cut, anywhere.

    On the straight way to this cone the springs were moved by ``moved`` and the limit of spring a
    grew by rise + gain·(d - a), which is what their mean drag depends on. Returns the new stack, its
    stiffness dT/dV, and the energy dissipated, which where ``dissipates`` is added to the asperities
    of the group.
    """
    clipped = empty((3 * len(stack), stack.shape[1]), np.float64)
    copy_vertices(uncounted(stack), uncounted(clipped), min(len(stack), 1))
    limit = friction * (d - stack[0, LABEL])
    v = displacement - stack[0, ANCHOR]
    if abs(v) > limit:
        clipped[0, ANCHOR] = displacement - math.copysign(limit, v)
    count = 1
    stiffness, dissipated = 0.0, 0.0
    for j in range(1, len(stack)):
        slope, low, high = stack[j, SLOPE], stack[j - 1, LABEL], stack[j, LABEL]
        v_low, v_high = displacement - stack[j - 1, ANCHOR], displacement - stack[j, ANCHOR]
        lower = crossing(low, high, v_low, v_high, d, -friction)
        upper = crossing(low, high, v_low, v_high, d, friction)
        for piece in range(3):
            a = low if piece == 0 else min(lower, upper) if piece == 1 else max(lower, upper)
            b = high if piece == 2 else max(lower, upper) if piece == 1 else min(lower, upper)
            if b <= a:
                continue
            v_a, v_b = v_low - slope * (a - low), v_low - slope * (b - low)
            limit_a, limit_b = friction * (d - a), friction * (d - b)
            load = stack[j, NORMAL] if b == high else load_at(group.gap, group.weight, b)[0]
            made_at, new_slope, v = displacement, slope, v_b
            if abs(v_a + v_b) > limit_a + limit_b:
                side = math.copysign(1.0, v_a + v_b)
                new_slope, v = side * friction, side * limit_b
                if dissipates:
                    slip_a, slip_b = max(side * v_a - limit_a, 0.0), max(side * v_b - limit_b, 0.0)
                    drag_a = mean_drag(limit_a, slip_a, side * moved, rise + gain * (d - a))
                    drag_b = mean_drag(limit_b, slip_b, side * moved, rise + gain * (d - b))
                    dissipated += dissipate(group, a, b, slip_a, slip_b, drag_a, drag_b)
            else:
                stiffness += load_at(group.gap, group.weight, b)[1] - load_at(group.gap, group.weight, a)[1]
                if b == high:
                    made_at = stack[j, MADE_AT]
            if count > 1 and b - a <= TIE * d:
                # cut off by rounding alone
                new_slope = clipped[count - 1, SLOPE]
            if count > 1 and clipped[count - 1, SLOPE] == new_slope:
                count -= 1
            force = clipped[count - 1, TANGENTIAL] + new_slope * (load - clipped[count - 1, NORMAL])
            put(clipped, count, b, displacement - v, new_slope, made_at, load, force)
            count += 1
    return clipped[:count], stiffness, dissipated


@compiled
def move_steep_group(
    group: Group, losses: Losses, depth: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> tuple[int, float]:
    """Carry one touching group whose polyline is steeper than μ straight to (d1, v1); its depth, and the energy."""
    stack = carried(group, depth, d1, v1, load)
    friction = group.friction
    energy = 0.0
    if d1 < d0:
        energy = withdrawal_energy(group, losses, depth, len(stack) - 1, d0, v0, d1, v1)
    clipped, _, slipped = clip(group, stack, d1, v1, friction, v1 - v0, friction * (d1 - d0), 0.0, depth > 0)
    copy_vertices(uncounted(clipped), group.stack, len(clipped))
    return len(clipped), energy + slipped
