"""Polylines steeper than the cone, as a fall of μ leaves them: several zones may slip at once."""

import math

import numpy as np

from historysim.memory.compiled import compiled
from historysim.memory.energy import spread, withdrawal_energy
from historysim.memory.layout import (
    ANCHOR,
    LABEL,
    MADE_AT,
    NORMAL,
    SLOPE,
    TANGENTIAL,
    Floats,
    Group,
    copy_vertices,
    put,
)
from historysim.memory.normal import load_at
from historysim.memory.polyline import edge_at
from historysim.memory.tolerances import TIE


@compiled
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
    stack = np.empty((segment + 2, group.stack.shape[1]))
    copy_vertices(group.stack, stack, segment + 1)
    if d1 <= edge:
        put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
        return stack[: segment + 1]
    slope = (v1 - anchor) / (d1 - edge)
    put(stack, segment + 1, d1, v1, slope, v1, load, edge_force + slope * (load - edge_load))
    return stack


@compiled
def crossing(low: float, high: float, v_low: float, v_high: float, d: float, side: float) -> float:
    """Label where v, straight from v_low to v_high, crosses side·(d - a); ``high`` where that is not inside."""
    over_low, over_high = v_low - side * (d - low), v_high - side * (d - high)
    tie = TIE * (abs(v_low) + abs(side) * d)
    if over_low * over_high >= 0.0 or min(abs(over_low), abs(over_high)) <= tie:
        return high
    return low + (high - low) * over_low / (over_low - over_high)


@compiled
def clip(
    group: Group,
    stack: Floats,
    d: float,
    displacement: float,
    friction: float,
    lag_down: float,
    lag_up: float,
    dissipates: bool,
) -> tuple[Floats, float, float]:
    """Clip any polyline to the cone |v| ≤ μ (d - a): both sides may cut, anywhere.

    The drag of a spring that slips by g is the limit less lag·g, with the lag of its direction.
    Returns the new stack, its stiffness dT/dV, and the energy dissipated, which where ``dissipates``
    is added to the asperities of the group.
    """
    clipped = np.empty((3 * len(stack), stack.shape[1]))
    copy_vertices(stack, clipped, min(len(stack), 1))
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
                    lag = lag_up if side > 0.0 else lag_down
                    slip_a, slip_b = max(side * v_a - limit_a, 0.0), max(side * v_b - limit_b, 0.0)
                    drag_a, drag_b = max(limit_a - lag * slip_a, 0.0), max(limit_b - lag * slip_b, 0.0)
                    dissipated += spread(
                        group.gap, group.weight, group.dissipated, a, b, slip_a, slip_b, drag_a, drag_b
                    )
            else:
                stiffness += load_at(group.gap, group.weight, b)[1] - load_at(group.gap, group.weight, a)[1]
                if b == high:
                    made_at = stack[j, MADE_AT]
            if count > 1 and clipped[count - 1, SLOPE] == new_slope:
                count -= 1
            force = clipped[count - 1, TANGENTIAL] + new_slope * (load - clipped[count - 1, NORMAL])
            put(clipped, count, b, displacement - v, new_slope, made_at, load, force)
            count += 1
    return clipped[:count], stiffness, dissipated


@compiled
def move_steep_group(
    group: Group, depth: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> tuple[int, float]:
    """Carry one touching group whose polyline is steeper than μ straight to (d1, v1); its depth, and the energy."""
    stack = carried(group, depth, d1, v1, load)
    friction = group.friction
    energy = 0.0
    if d1 < d0:
        energy = withdrawal_energy(group, depth, len(stack) - 1, d0, v0, d1, v1)
    up, down = (v1 - v0) - friction * (d1 - d0), (v0 - v1) - friction * (d1 - d0)
    lag_up = 0.5 * friction * (d1 - d0) / up if up > 0.0 else 0.0
    lag_down = 0.5 * friction * (d1 - d0) / down if down > 0.0 else 0.0
    clipped, _, slipped = clip(group, stack, d1, v1, friction, lag_down, lag_up, depth > 0)
    copy_vertices(clipped, group.stack, len(clipped))
    return len(clipped), energy + slipped
