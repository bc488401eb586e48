"""A change of the friction coefficients at rest.

Where a coefficient falls, springs beyond the new limit slip. Under a tangential load, or behind an instrument,
the displacement follows while it falls, so that a jump is what many small falls are: the coefficients go straight from
the old values to the new ones. Where friction no longer holds the load, everything slides and the displacement stays.
"""

import numpy as np

from historysim.memory.clipping import carried, clip, is_steep
from historysim.memory.compiled import compiled, entry, short
from historysim.memory.energy import stored_energy
from historysim.memory.fronts import no_fronts
from historysim.memory.groups import friction_limit, largest_friction, total_force
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    LABEL,
    NORMAL,
    NORMAL_LOAD,
    SLOPE,
    TANGENTIAL,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Memory,
)
from historysim.memory.lean import counted, empty, given_back, keep, lean, uncounted
from historysim.memory.normal import load_at
from historysim.memory.polyline import Aim, to_displacement
from historysim.memory.search import found_displacement
from historysim.memory.stacks import copy_vertices, duplicated, fill, group_of, grown

MOST_PARTS = 1 << 10


@entry
def change_friction(contact: Contact, memory: Memory, friction: Floats, aim: Aim, tolerance: float) -> Memory:
    """Replace the groups' friction coefficients while the tangential channel holds what it aims at.

    A load beyond the new limit stays with the memory as what is asked for.
    """
    given, contact, memory, friction = memory, lean(contact), counted(lean(memory)), lean(friction)
    now = memory.now
    slips = False
    for index in range(friction.size):
        if memory.depth[index] > 0:
            slips = slips or friction[index] < contact.friction[index]
            memory.steep[index] = is_steep(memory.vertices[index], memory.depth[index], friction[index])
    if not slips:
        return given
    held, force = 1.0, now[TANGENTIAL_LOAD]
    if aim.rigid == 0.0:
        before = friction_limit(contact, now[APPROACH], now[NORMAL_LOAD])
        after = friction_limit(with_coefficients(contact, friction), now[APPROACH], now[NORMAL_LOAD])
        if abs(force) > after:
            held = min(max((before - abs(force)) / (before - after), 0.0), 1.0)
    start, there = contact, empty(friction.size, np.float64)
    if aim.compliance > 0.0 and held > 0.0:
        mix(contact.friction, friction, held, there)
        start = with_coefficients(contact, uncounted(there))
        memory = fall_in_parts(contact, memory, start.friction, aim, tolerance)
    if aim.compliance == 0.0 or held < 1.0:
        memory = fall(start, memory, friction, to_displacement(memory.now[DISPLACEMENT]))
    for index in range(friction.size):
        memory.steep[index] = is_steep(memory.vertices[index], memory.depth[index], friction[index])
    memory.now[TANGENTIAL_LOAD] = force if aim.rigid == 0.0 else total_force(contact, memory)
    keep(there)
    return given_back(memory, given)


@short
def mix(first: Floats, last: Floats, share: float, target: Floats) -> None:
    """Fill in coefficients a share of the way from the first to the last."""
    for index in range(first.size):
        target[index] = first[index] + share * (last[index] - first[index])


@short
def with_coefficients(contact: Contact, friction: Floats) -> Contact:
    """Return the contact with other coefficients."""
    return Contact(contact.gap, contact.weight, contact.first, friction, contact.sorted_gap, contact.sorted_weight)


@compiled
def fall_in_parts(contact: Contact, memory: Memory, friction: Floats, aim: Aim, tolerance: float) -> Memory:
    """Change the coefficients in equal parts, more of them each time, until it makes no difference.

    What is dissipated is the work of the tangential load, less what is stored, which is exact; the parts say how
    the asperities share it.
    """
    now, first = memory.now, contact.friction
    unused = empty(memory.dissipated.size, np.float64)
    fill(unused, 0.0)
    before, lost = stored_energy(contact, memory, unused), now[DISSIPATED]
    reach = largest_friction(contact) * (now[APPROACH] - contact.sorted_gap[0])
    parts, reached = 4, np.inf
    low, high = empty(first.size, np.float64), empty(first.size, np.float64)
    while True:
        fine = duplicated(memory)
        for k in range(parts):
            mix(first, friction, k / parts, low)
            mix(first, friction, (k + 1) / parts, high)
            fine = fall(with_coefficients(contact, uncounted(low)), fine, uncounted(high), aim)
        moved = fine.now[DISPLACEMENT] - now[DISPLACEMENT]
        work = 0.5 * (now[TANGENTIAL_LOAD] + total_force(contact, fine)) * moved
        balance = work + before - stored_energy(contact, fine, unused)
        told = fine.now[DISSIPATED] - lost
        settled = abs(fine.now[DISPLACEMENT] - reached) <= tolerance * reach
        if parts >= MOST_PARTS or (settled and abs(told - balance) <= 1e-3 * told + tolerance * tolerance * before):
            break
        reached = fine.now[DISPLACEMENT]
        parts *= 2
    keep(low)
    keep(high)
    share = max(balance, 0.0) / told if told > 0.0 else 1.0
    for i in range(memory.dissipated.size):
        fine.dissipated[i] = memory.dissipated[i] + share * (fine.dissipated[i] - memory.dissipated[i])
    fine.now[DISSIPATED] = lost + share * told
    return fine


@compiled
def fall(contact: Contact, memory: Memory, friction: Floats, aim: Aim) -> Memory:
    """Change the coefficients, and the displacement to where it aims, straight together."""
    now = memory.now
    d, v0 = now[APPROACH], now[DISPLACEMENT]
    after = with_coefficients(contact, friction)
    # the very loads that the edges have
    touching = 0
    while touching < memory.depth.size and memory.depth[touching] > 0:
        touching += 1
    shares = empty(touching, np.float64)
    for index in range(touching):
        shares[index] = memory.vertices[index, memory.depth[index] - 1, NORMAL]
    v1 = aim.value
    if aim.compliance > 0.0:
        # any cone may cut any polyline
        fill(memory.steep, True)
        v1 = found_displacement(after, memory, shares, no_fronts(shares.size), d, aim)
    for index in range(shares.size):
        depth, gain = memory.depth[index], friction[index] - contact.friction[index]
        if v1 == v0 and gain >= 0.0:
            continue
        group = group_of(after, memory, index)
        stack = carried(group, depth, d, v1, shares[index])
        clipped, _, energy = clip(group, stack, d, v1, friction[index], v1 - v0, 0.0, gain, depth > 0)
        now[DISSIPATED] += energy
        if len(clipped) > memory.vertices.shape[1]:
            memory = grown(memory, 2 * len(clipped))
        copy_vertices(uncounted(clipped), uncounted(memory.vertices)[index], len(clipped))
        memory.depth[index] = len(clipped)
    now[DISPLACEMENT] = v1
    now[TANGENTIAL_LOAD] = total_force(after, memory)
    return memory


@entry
def refresh_loads(contact: Contact, memory: Memory) -> None:
    """Recompute the loads kept with the vertices, after groups have been split."""
    contact, memory = lean(contact), lean(memory)
    for index in range(contact.friction.size):
        group = group_of(contact, memory, index)
        for j in range(memory.depth[index]):
            group.stack[j, NORMAL] = load_at(group.gap, group.weight, group.stack[j, LABEL])[0]
            force = 0.0
            if j > 0:
                rise = group.stack[j, NORMAL] - group.stack[j - 1, NORMAL]
                force = group.stack[j - 1, TANGENTIAL] + group.stack[j, SLOPE] * rise
            group.stack[j, TANGENTIAL] = force
