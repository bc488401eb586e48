"""The displacement that all groups share, where the path says what they carry together."""

import math

import numpy as np

from historysim.memory.clipping import carried, clip
from historysim.memory.compiled import compiled, short
from historysim.memory.fronts import LEAST, OFF, force_on_fronts, forget_front, no_fronts, note_front
from historysim.memory.groups import largest_friction, total_force
from historysim.memory.layout import (
    ANCHOR,
    APPROACH,
    DISPLACEMENT,
    LABEL,
    SLOPE,
    TANGENTIAL,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Memory,
)
from historysim.memory.lean import uncounted
from historysim.memory.polyline import Aim, force_of_group
from historysim.memory.stacks import fetch_group, group_of
from historysim.memory.tolerances import EPSILON, TIE


@compiled
def force_at(
    contact: Contact, memory: Memory, shares: Floats, fronts: Floats, d1: float, v1: float
) -> tuple[float, float, float]:
    """Tangential load at the end of a straight path to (d1, v1), with its first and second derivative in v1.

    Fronts are looked up, or found and noted (see `fronts`).
    """
    memory, fronts = uncounted(memory), uncounted(fronts)
    d0, v0 = memory.now[APPROACH], memory.now[DISPLACEMENT]
    off = fronts[OFF, : shares.size]
    force, stiffness, curvature, misses = force_on_fronts(fronts, off, shares, d1, v1)
    if not misses:
        return force, stiffness, curvature
    force, stiffness, curvature = 0.0, 0.0, 0.0
    for index in range(shares.size):
        if off[index] == 0.0:
            continue
        fetch_group(memory, index)
        forget_front(fronts, index)
        group, depth = group_of(contact, memory, index), memory.depth[index]
        if memory.steep[index] and depth > 0:
            stack = carried(group, depth, d1, v1, shares[index])
            clipped, slope, _ = clip(group, stack, d1, v1, group.friction, 0.0, 0.0, 0.0, depth < 0)
            part, bend = clipped[len(clipped) - 1, TANGENTIAL], 0.0
        else:
            part, slope, bend = force_of_group(group, depth, d0, v0, d1, v1, shares[index], fronts, index)
        force += part
        stiffness += slope
        curvature += bend
    part, slope, bend, _ = force_on_fronts(fronts, off, shares, d1, v1)
    return force + part, stiffness + slope, curvature + bend


@short
def guess_fronts(contact: Contact, memory: Memory, shares: Floats, fronts: Floats, sign: float) -> None:
    """Note the first segment of each polyline on which slip of a sign may end, which for small paths it does.

    It is the outermost, or, where that lies on the cone of this side already, the one below.
    """
    memory, fronts = uncounted(memory), uncounted(fronts)
    for index in range(shares.size):
        fetch_group(memory, index)
        depth = memory.depth[index]
        if depth > 1 and fronts[LEAST, index] == np.inf and not memory.steep[index]:
            group = group_of(contact, memory, index)
            slides = group.stack[depth - 1, SLOPE] == sign * group.friction
            note_front(fronts, index, group, depth, depth - 2 if slides else depth - 1, sign)


@short
def sliding_displacement(contact: Contact, memory: Memory, shares: Floats, d1: float, side: float) -> float:
    """Displacement nearest to the present one at which, on a straight path to approach d1, every spring slides."""
    d0, v0 = memory.now[APPROACH], memory.now[DISPLACEMENT]
    reach = -np.inf
    for index in range(shares.size):
        friction = contact.friction[index]
        if d1 > d0:
            reach = max(reach, side * v0 + friction * (d1 - d0))
        for j in range(memory.depth[index]):
            label = memory.vertices[index, j, LABEL]
            if label > d1 or (j > 0 and not memory.steep[index]):
                break
            reach = max(reach, side * memory.vertices[index, j, ANCHOR] + friction * (d1 - label))
    return side * reach


@short
def next_guess(
    v: float, missing: float, stiffness: float, curvature: float, low: float, high: float, stride: float
) -> float:
    """Newton's step from v, corrected for curvature (Halley), inside the bracket and no longer than a stride."""
    step = missing / stiffness if stiffness > 0.0 else np.inf
    bend = 0.5 * curvature * step / stiffness if stiffness > 0.0 else np.inf
    if abs(bend) < 0.25:
        step /= 1.0 + bend
    following = v + step
    if not low < following < high:
        following = 0.5 * (low + high)
    if not abs(following - v) <= stride:
        following = v + math.copysign(stride, missing)
    return following


@compiled
def displacement_at(contact: Contact, memory: Memory, shares: Floats, d1: float, aim: Aim) -> float:
    """Displacement at which a straight path in (d, V) to approach d1 ends where it aims.

    Where nothing touches at d1, a load leaves V at the anchor of the last spring to leave, which is one of the
    highest summit.
    """
    return displacement_with(contact, memory, shares, no_fronts(shares.size), d1, aim)


@compiled
def displacement_with(contact: Contact, memory: Memory, shares: Floats, fronts: Floats, d1: float, aim: Aim) -> float:
    """Do what `displacement_at` does, and leave the fronts that were met in their table."""
    now = memory.now
    goal, rigid, compliance = aim
    if shares.size == 0 and rigid > 0.0:
        return goal
    if shares.size == 0:
        return memory.vertices[0, 0, ANCHOR] if memory.depth[0] > 0 else now[DISPLACEMENT]
    if d1 == now[APPROACH]:
        v = now[DISPLACEMENT]
        missing = goal - rigid * v - compliance * total_force(contact, uncounted(memory))
        if abs(missing) <= TIE * (rigid * abs(goal) + compliance * limit_of(contact, shares)):
            # held: rounding is no reason to move
            return v
    return found_displacement(contact, memory, shares, fronts, d1, aim)


@short
def limit_of(contact: Contact, shares: Floats) -> float:
    """Friction limit of the groups that touch, which carry these normal loads."""
    limit = 0.0
    for index in range(shares.size):
        limit += contact.friction[index] * shares[index]
    return limit


@compiled
def found_displacement(contact: Contact, memory: Memory, shares: Floats, fronts: Floats, d1: float, aim: Aim) -> float:
    """`displacement_at` where something touches at d1, whatever the contact carries now.

    A load at the friction limit is met by the displacement at which the last spring begins to slide.
    """
    now = memory.now
    goal, rigid, compliance = aim
    limit = limit_of(contact, shares)
    reach, stride = largest_friction(contact) * (d1 - contact.sorted_gap[0]), np.inf
    if rigid == 0.0:
        if abs(goal) >= (1.0 - TIE) * limit:
            return sliding_displacement(contact, memory, shares, d1, math.copysign(1.0, goal))
        # what slides has no stiffness to tell how far
        stride = reach
    accuracy = 4.0 * EPSILON * (rigid * abs(goal) + compliance * limit)
    low, high = -np.inf, np.inf
    v = now[DISPLACEMENT]
    change = goal - rigid * v - compliance * now[TANGENTIAL_LOAD]
    if change != 0.0:
        # a little on the way, so that the first stiffness is that of the direction in which it goes
        v += math.copysign(1e-9 * reach, change)
    # so near the start springs that touched on the way all stick, and no front is met yet
    unmet = 1 if d1 > now[APPROACH] else 0
    for turn in range(200):
        if turn == unmet:
            guess_fronts(contact, memory, shares, fronts, math.copysign(1.0, change))
        force, stiffness, curvature = force_at(contact, memory, shares, fronts, d1, v)
        missing = goal - rigid * v - compliance * force
        if abs(missing) <= accuracy:
            return v
        if missing > 0.0:
            low = v
        else:
            high = v
        slope, bend = rigid + compliance * stiffness, compliance * curvature
        following = next_guess(v, missing, slope, bend, low, high, stride)
        if following in (low, high, v):
            return v
        v = following
    return v
