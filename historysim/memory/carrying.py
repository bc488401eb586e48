"""Paths on which friction changes, too: all groups straight in (d, V, μ), and where their springs are anchored."""

import numpy as np

from historysim.memory.clipping import carried, clip, is_steep
from historysim.memory.compiled import entry
from historysim.memory.friction import with_coefficients
from historysim.memory.fronts import no_fronts
from historysim.memory.groups import group_loads, total_force
from historysim.memory.layout import (
    ANCHOR,
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    LABEL,
    NORMAL_LOAD,
    SLOPE,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Memory,
)
from historysim.memory.lean import counted, empty, given_back, keep, lean, uncounted
from historysim.memory.losses import is_nearly_full, no_losses, settle, withdrawal_energy
from historysim.memory.polyline import Aim, move_group, to_displacement
from historysim.memory.search import displacement_at, found_displacement
from historysim.memory.stacks import copy_vertices, deepest, fill, group_of, grown


@entry
def carry(contact: Contact, memory: Memory, d1: float, load: float, friction: Floats, aim: Aim) -> Memory:
    """Carry all groups straight in (d, V) to approach d1, where they carry ``load``, and to where they aim.

    The groups' coefficients go straight to ``friction`` on the way, so that the limit of each spring does; with it the
    energy is that of `clip`. A tangential load has to be within the friction limit at the end.
    """
    given, contact, memory, friction = memory, lean(contact), counted(lean(memory)), lean(friction)
    needed = 3 * deepest(uncounted(memory)) + 6
    if needed > memory.vertices.shape[1]:
        memory = grown(memory, 2 * needed)
    now, after = memory.now, with_coefficients(contact, friction)
    d0, v0 = now[APPROACH], now[DISPLACEMENT]
    shares = group_loads(after, d1)
    # any cone may cut any polyline
    fill(memory.steep, True)
    v1 = aim.value
    if shares.size == 0:
        v1 = displacement_at(after, memory, shares, d1, aim)
    elif aim.compliance > 0.0:
        v1 = found_displacement(after, memory, shares, no_fronts(shares.size), d1, aim)
    put_off = no_losses(friction.size)
    losses = uncounted(put_off)
    for index in range(friction.size):
        depth, energy = memory.depth[index], 0.0
        if index >= shares.size and depth == 0:
            break
        group = group_of(after, memory, index)
        if index >= shares.size:
            energy = withdrawal_energy(group, losses, depth, 1, d0, v0, d1, v1)
            memory.depth[index] = 0
        elif depth == 0:
            memory.depth[index], _, energy = move_group(
                group, losses, 0, d0, v0, d1, shares[index], to_displacement(v1)
            )
        else:
            stack = carried(group, depth, d1, v1, shares[index])
            if d1 < d0:
                energy = withdrawal_energy(group, losses, depth, len(stack) - 1, d0, v0, d1, v1)
            before = contact.friction[index]
            rise, gain = before * (d1 - d0), friction[index] - before
            clipped, _, slipped = clip(group, stack, d1, v1, friction[index], v1 - v0, rise, gain, depth > 0)
            copy_vertices(uncounted(clipped), group.stack, len(clipped))
            memory.depth[index] = len(clipped)
            energy += slipped
        now[DISSIPATED] += energy
        if is_nearly_full(losses):
            settle(losses, uncounted(memory))
    settle(losses, uncounted(memory))
    keep(put_off)
    for index in range(friction.size):
        memory.steep[index] = is_steep(memory.vertices[index], memory.depth[index], friction[index])
    now[APPROACH] = d1
    now[DISPLACEMENT] = v1
    now[NORMAL_LOAD] = load
    now[TANGENTIAL_LOAD] = aim.value if aim.rigid == 0.0 else total_force(after, memory)
    return given_back(memory, given)


@entry
def innermost_anchors(contact: Contact, memory: Memory) -> Floats:
    """Return the anchor of the innermost spring of each asperity, which slips last; NaN where it does not touch."""
    gaps, contact, memory = contact.gap, lean(contact), lean(memory)
    found = empty(gaps.size, np.float64)
    fill(found, np.nan)
    for index in range(contact.friction.size):
        depth, stack = memory.depth[index], memory.vertices[index]
        j = 0
        for i in range(contact.first[index], contact.first[index + 1]):
            if depth == 0 or contact.gap[i] >= stack[depth - 1, LABEL]:
                break
            while stack[j, LABEL] < contact.gap[i]:
                j += 1
            found[i] = stack[j, ANCHOR] - stack[j, SLOPE] * (stack[j, LABEL] - contact.gap[i])
    return given_back(found, gaps)
