"""What all friction groups carry together, and at which approach they carry it."""

import math

import numpy as np

from historysim.memory.compiled import reordered, short
from historysim.memory.layout import APPROACH, LABEL, NORMAL_LOAD, TANGENTIAL, Contact, Floats, Memory
from historysim.memory.lean import empty, uncounted
from historysim.memory.normal import approach_at, load_at, touching
from historysim.memory.tolerances import EPSILON


@reordered
def limit_and_slopes_of_ones(
    gap: Floats, weight: Floats, friction: Floats, count: int, approach: float
) -> tuple[float, float, float]:
    """Do what `limit_and_slopes` does where each group is of one asperity, the first of which touch."""
    limit, limit_slope, load_slope = 0.0, 0.0, 0.0
    for i in range(count):
        depth = approach - gap[i]
        half_chord = weight[i] * math.sqrt(depth)
        limit += friction[i] * half_chord * depth
        limit_slope += friction[i] * half_chord
        load_slope += half_chord
    return limit, 1.5 * limit_slope, 1.5 * load_slope


@short
def friction_limit(contact: Contact, approach: float, load: float) -> float:
    """Σ μ P(a): the largest tangential load that the contact carries, where it carries the normal load ``load``."""
    if contact.friction.size == 1:
        return contact.friction[0] * load
    return limit_and_slopes(contact, approach)[0]


@short
def limit_and_slopes(contact: Contact, approach: float) -> tuple[float, float, float]:
    """Return the friction limit at an approach, and the slopes in the approach of the limit and of the normal load."""
    if 1 < contact.friction.size == contact.gap.size:
        count = touching(contact.gap, approach)
        return limit_and_slopes_of_ones(contact.gap, contact.weight, contact.friction, count, approach)
    limit, limit_slope, load_slope = 0.0, 0.0, 0.0
    for index in range(contact.friction.size):
        start, stop = contact.first[index], contact.first[index + 1]
        gap = uncounted(contact.gap)[start:stop]
        if gap[0] >= approach:
            break
        load, slope = load_at(gap, uncounted(contact.weight)[start:stop], approach)
        limit += contact.friction[index] * load
        limit_slope += contact.friction[index] * slope
        load_slope += slope
    return limit, limit_slope, load_slope


@short
def total_force(contact: Contact, memory: Memory) -> float:
    """Sum of the groups' tangential loads."""
    force = 0.0
    for index in range(contact.friction.size):
        if memory.depth[index] == 0:
            break
        force += memory.vertices[index, memory.depth[index] - 1, TANGENTIAL]
    return force


@reordered
def loads_of_ones(gap: Floats, weight: Floats, approach: float, loads: Floats) -> None:
    """Write the loads of touching asperities."""
    for i in range(loads.size):
        depth = approach - gap[i]
        loads[i] = weight[i] * math.sqrt(depth) * depth


@short
def least_friction(contact: Contact) -> float:
    """Return the smallest friction coefficient."""
    least = contact.friction[0]
    for index in range(1, contact.friction.size):
        least = min(least, contact.friction[index])
    return least


@short
def largest_friction(contact: Contact) -> float:
    """Return the largest friction coefficient."""
    largest = contact.friction[0]
    for index in range(1, contact.friction.size):
        largest = max(largest, contact.friction[index])
    return largest


@short
def group_loads(contact: Contact, approach: float) -> Floats:
    """Return the normal loads of the groups that touch, which are the first ones."""
    if contact.friction.size == contact.gap.size:
        loads = empty(touching(contact.gap, approach), np.float64)
        loads_of_ones(contact.gap, contact.weight, approach, loads)
        return loads
    count = 0
    while count < contact.friction.size and contact.gap[contact.first[count]] < approach:
        count += 1
    loads = empty(count, np.float64)
    for index in range(count):
        start, stop = contact.first[index], contact.first[index + 1]
        loads[index] = load_at(uncounted(contact.gap)[start:stop], uncounted(contact.weight)[start:stop], approach)[0]
    return loads


@short
def shares_at(contact: Contact, approach: float, load: float) -> Floats:
    """Return the normal loads of the groups that touch at an approach, where they carry ``load`` together."""
    if contact.friction.size > 1:
        return group_loads(contact, approach)
    shares = empty(1 if approach > contact.sorted_gap[0] else 0, np.float64)
    if shares.size > 0:
        shares[0] = load
    return shares


@short
def approach_for(contact: Contact, memory: Memory, load: float) -> float:
    """Approach at which all asperities carry a normal load; the very bits of a label met before where they tie."""
    present = memory.now[APPROACH]
    if load == memory.now[NORMAL_LOAD]:
        return present
    if load <= 0.0:
        return min(present, contact.sorted_gap[0])
    approach = approach_at(contact.sorted_gap, contact.sorted_weight, load, present)
    for j in range(memory.depth[0] - 1, 0, -1):
        label = memory.vertices[0, j, LABEL]
        if abs(label - approach) <= 4.0 * EPSILON * approach:
            return label
        if label < approach:
            break
    return approach
