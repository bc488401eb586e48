"""All friction groups together on one straight path in (d, V)."""

from historysim.memory.clipping import is_steep, move_steep_group
from historysim.memory.compiled import compiled, entry, short
from historysim.memory.groups import friction_limit, shares_at, total_force
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    NORMAL_LOAD,
    TANGENTIAL,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Memory,
)
from historysim.memory.lean import counted, given_back, keep, lean, uncounted
from historysim.memory.losses import is_nearly_full, no_losses, settle, withdrawal_energy
from historysim.memory.polyline import Aim, move_group, to_displacement
from historysim.memory.search import displacement_at
from historysim.memory.stacks import any_steep, deepest, fetch_group, group_of, grown

# how many times softer than the contact an instrument is for which rounding of the load would be felt at its drive
MUCH_SOFTER = 1e6


@entry
def move(contact: Contact, memory: Memory, d1: float, load: float, aim: Aim) -> Memory:
    """Carry all groups straight in (d, V) to approach d1, where they carry ``load``, and to where they aim.

    A tangential load has to be within the friction limit.
    """
    given, contact, memory = memory, lean(contact), counted(lean(memory))
    memory, shares = with_room(memory), shares_at(contact, d1, load)
    direct = aim.compliance == 0.0 or (shares.size > 0 and is_alone(contact, memory))
    path = aim if direct else to_displacement(displacement_at(contact, memory, shares, d1, aim))
    carry(contact, memory, shares, d1, load, aim, path)
    return given_back(memory, given)


@short
def is_alone(contact: Contact, memory: Memory) -> bool:
    """Return whether there is one group, which any aim moves by one update."""
    return bool(contact.friction.size == 1 and not memory.steep[0])


@short
def with_room(memory: Memory) -> Memory:
    """Return the memory with stacks that the next path fits into."""
    # a front and an edge; a polyline steeper than μ may be cut in every segment
    deep = deepest(uncounted(memory))
    needed = 3 * deep + 6 if any_steep(memory) else deep + 2
    return grown(memory, 2 * needed) if needed > memory.vertices.shape[1] else memory


@compiled
def carry(contact: Contact, memory: Memory, shares: Floats, d1: float, load: float, aim: Aim, path: Aim) -> None:
    """Do what `move` does in place, the loads of the groups at d1 and the aim of each path in (d, V) being known."""
    memory, put_off = uncounted(memory), no_losses(contact.friction.size)
    now, losses = memory.now, uncounted(put_off)
    d0, v0, v1 = now[APPROACH], now[DISPLACEMENT], path.value
    still = d1 == d0 and v1 == v0 and path.compliance == 0.0
    force = total_force(contact, memory) if still else 0.0
    for index in range(contact.friction.size):
        depth = memory.depth[index]
        if still or (index >= shares.size and depth == 0):
            break
        fetch_group(memory, index)
        group = group_of(contact, memory, index)
        if index >= shares.size:
            energy = withdrawal_energy(group, losses, depth, 1, d0, v0, d1, v1)
            memory.depth[index] = 0
            memory.steep[index] = False
        else:
            if memory.steep[index]:
                depth, energy = move_steep_group(group, losses, depth, d0, v0, d1, v1, shares[index])
                memory.steep[index] = is_steep(group.stack, depth, group.friction)
            else:
                depth, v1, energy = move_group(group, losses, depth, d0, v0, d1, shares[index], path)
            memory.depth[index] = depth
            force += group.stack[depth - 1, TANGENTIAL]
        now[DISSIPATED] += energy
        if is_nearly_full(losses):
            settle(losses, memory)
    settle(losses, memory)
    keep(put_off)
    now[APPROACH] = d1
    now[DISPLACEMENT] = v1
    now[NORMAL_LOAD] = load
    now[TANGENTIAL_LOAD] = aim.value if aim.rigid == 0.0 else force
    if aim.rigid > 0.0 and aim.compliance * load > MUCH_SOFTER * d1 > 0.0:
        # the drive of so soft an instrument tells the load better than the sum over the springs does, unless the
        # contact has slid so far that its displacement is rounded by more than it can be strained
        limit = friction_limit(contact, d1, load)
        now[TANGENTIAL_LOAD] = min(max((aim.value - aim.rigid * v1) / aim.compliance, -limit), limit)
