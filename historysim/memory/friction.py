"""A change of the friction coefficients at rest."""

from historysim.memory.clipping import clip, is_steep
from historysim.memory.compiled import compiled
from historysim.memory.groups import total_force
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    LABEL,
    NORMAL,
    SLOPE,
    TANGENTIAL,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Memory,
    copy_vertices,
    group_of,
    grown,
)
from historysim.memory.normal import load_at


@compiled
def change_friction(contact: Contact, memory: Memory, friction: Floats) -> Memory:
    """Replace the groups' friction coefficients at rest; springs that the new limit cannot hold slip.

    The elastic energy that they lose is dissipated.
    """
    now = memory.now
    d, v = now[APPROACH], now[DISPLACEMENT]
    for index in range(friction.size):
        depth = memory.depth[index]
        if depth == 0:
            continue
        if friction[index] < contact.friction[index]:
            group, stack = group_of(contact, memory, index), memory.vertices[index, :depth]
            # |v| falls to the limit straight, so the mean drag is half-way between
            clipped, _, energy = clip(group, stack, d, v, friction[index], -0.5, -0.5, depth > 0)
            now[DISSIPATED] += energy
            depth = len(clipped)
            if depth > memory.vertices.shape[1]:
                memory = grown(memory, 2 * depth)
            copy_vertices(clipped, memory.vertices[index], depth)
            memory.depth[index] = depth
        memory.steep[index] = is_steep(memory.vertices[index], depth, friction[index])
    now[TANGENTIAL_LOAD] = total_force(contact, memory)
    return memory


@compiled
def refresh_loads(contact: Contact, memory: Memory) -> None:
    """Recompute the loads kept with the vertices, after groups have been split."""
    for index in range(contact.friction.size):
        group = group_of(contact, memory, index)
        for j in range(memory.depth[index]):
            group.stack[j, NORMAL] = load_at(group.gap, group.weight, group.stack[j, LABEL])[0]
            force = 0.0
            if j > 0:
                rise = group.stack[j, NORMAL] - group.stack[j - 1, NORMAL]
                force = group.stack[j - 1, TANGENTIAL] + group.stack[j, SLOPE] * rise
            group.stack[j, TANGENTIAL] = force
