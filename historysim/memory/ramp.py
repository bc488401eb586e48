"""Straight ramps in (N, T), walked in straight paths in (d, V)."""

import numpy as np

from historysim.memory.compiled import compiled, short
from historysim.memory.fronts import no_fronts
from historysim.memory.groups import approach_for, group_loads, largest_friction, least_friction
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Memory,
)
from historysim.memory.lean import duplicate
from historysim.memory.move import carry, is_alone, move, with_room
from historysim.memory.normal import load_at
from historysim.memory.polyline import to_displacement, to_load
from historysim.memory.search import displacement_with, force_at
from historysim.memory.stacks import duplicated

MOST_CHORDS = 1 << 14

# part by which the changes from one count of chords to the next may miss the order of the error
DISORDER = 0.15


@short
def toward(present: float, target: float, fraction: float) -> float:
    """Point a fraction of the way from where a channel is to its target; the target itself at the end."""
    return target if fraction == 1.0 else present + fraction * (target - present)


# nodes and weights of Gauss's quadrature on (0, 1)
NODES = (0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319)
WEIGHTS = (0.11846344252809454, 0.2393143352496832, 0.28444444444444444, 0.2393143352496832, 0.11846344252809454)
FEW_SUMMITS, FEW_PANELS = 100, 6


@compiled
def extra_work(
    contact: Contact, memory: Memory, fronts: Floats, d1: float, v1: float, load: float, force: float
) -> float:
    """Work that the way of the loads takes beyond that of a chord, to (d1, v1) where they are ``load`` and ``force``.

    The way of the loads is straight in (N, T) and not in (d, V). Both lead from one state to the other, so what it
    dissipates more is the work of the tangential load that it has more at each displacement. To first order in the
    change of N that load is the one at its approach.
    """
    now = memory.now
    rate = (load - now[NORMAL_LOAD]) / (force - now[TANGENTIAL_LOAD])
    # a front that passes a summit bends the way; of one summit it does not, and of many each bends it little
    panels = FEW_PANELS if 1 < contact.gap.size <= FEW_SUMMITS else 1
    more = 0.0
    for k in range(panels * len(NODES)):
        share = (k // len(NODES) + NODES[k % len(NODES)]) / panels
        d = toward(now[APPROACH], d1, share)
        v = toward(now[DISPLACEMENT], v1, share)
        reached = force_at(contact, memory, group_loads(contact, d), fronts, d, v)[0]
        carried, slope = load_at(contact.sorted_gap, contact.sorted_weight, d)
        d += (now[NORMAL_LOAD] + rate * (reached - now[TANGENTIAL_LOAD]) - carried) / slope
        raised = force_at(contact, memory, group_loads(contact, d), fronts, d, v)[0]
        more += WEIGHTS[k % len(NODES)] / panels * (raised - reached)
    return more * (v1 - now[DISPLACEMENT])


@compiled
def corrected_chord(contact: Contact, memory: Memory, load: float, force: float) -> Memory:
    """Carry all groups along one chord to (load, force), and correct its energy for the way of the loads."""
    aim, d1 = to_load(force), approach_for(contact, memory, load)
    fronts, dissipated, before = no_fronts(contact.friction.size), duplicate(memory.dissipated), memory.now[DISSIPATED]
    if is_alone(contact, memory):
        start = duplicated(memory)
        memory = move(contact, memory, d1, load, aim)
        more = extra_work(contact, start, fronts, d1, memory.now[DISPLACEMENT], load, force)
    else:
        memory, shares = with_room(memory), group_loads(contact, d1)
        v1 = displacement_with(contact, memory, shares, fronts, d1, aim)
        more = extra_work(contact, memory, fronts, d1, v1, load, force)
        carry(contact, memory, shares, d1, load, aim, to_displacement(v1))
    lost = memory.now[DISSIPATED] - before
    if lost > 0.0:
        share = max(1.0 + more / lost, 0.0)
        for i in range(dissipated.size):
            memory.dissipated[i] = dissipated[i] + share * (memory.dissipated[i] - dissipated[i])
        memory.now[DISSIPATED] = before + share * lost
    return memory


@compiled
def ramp(contact: Contact, memory: Memory, load: float, force: float, tolerance: float) -> Memory:
    """Carry all groups along the straight ramp in (N, T) to (load, force).

    One straight path in (d, V) ends in the exact state where there is one friction group, and its
    energy is exact where N is constant or nothing slips. Where N changes little, the energy of that
    one chord is corrected for what the ramp departs from it. Otherwise the ramp is walked in chords whose
    ends lie on it, more of them each time, until the energy, extrapolated, and with several groups
    the displacement too, change by less than ``tolerance`` (relative to what the ramp dissipates, and
    to the displacement at which the contact slides).
    """
    now = memory.now
    if now[APPROACH] < contact.sorted_gap[0] and load > 0.0:
        now[APPROACH] = contact.sorted_gap[0]
    load0, force0, dissipated0 = now[NORMAL_LOAD], now[TANGENTIAL_LOAD], now[DISSIPATED]
    sticks = bool(abs(force - force0) <= least_friction(contact) * (load - load0))
    # the error of a corrected chord is a small multiple of the square of the relative change
    small = ((load - load0) / max(load, load0)) ** 2 <= tolerance if load != load0 else True
    # then the state does not depend on the chords
    single = contact.friction.size == 1 and not memory.steep[0]
    # with several groups the error falls in steps, as groups slip earlier or later
    ratio = 2 if single else 3
    weight = 1.0 / (ratio * ratio - 1.0)
    corrects = bool(small and load != load0 and abs(force - force0) > largest_friction(contact) * abs(load - load0))
    if corrects and not sticks:
        return corrected_chord(contact, memory, load, force)
    whole, coarse = memory, memory
    energy, last_change, fell, agreed = 0.0, 0.0, True, 0
    chords = np.int64(1)
    while True:
        fine = memory if small or sticks else duplicated(memory)
        for k in range(1, chords + 1):
            step_load, step_force = toward(load0, load, k / chords), toward(force0, force, k / chords)
            d1 = approach_for(contact, fine, step_load)
            fine = move(contact, fine, d1, step_load, to_load(step_force))
        if small or sticks:
            return fine
        if chords == 1:
            whole = fine
        else:
            extrapolated = fine.now[DISSIPATED] + weight * (fine.now[DISSIPATED] - coarse.now[DISSIPATED])
            drift = abs(fine.now[DISPLACEMENT] - coarse.now[DISPLACEMENT])
            reach = largest_friction(contact) * (max(now[APPROACH], fine.now[APPROACH]) - contact.sorted_gap[0])
            change = abs(fine.now[DISSIPATED] - coarse.now[DISSIPATED])
            settled = abs(extrapolated - energy) <= tolerance * (extrapolated - dissipated0)
            # while the changes do not fall by ratio², as they have to, two extrapolations may agree by chance
            falls = abs(last_change - ratio * ratio * change) <= DISORDER * last_change or chords == ratio
            needed = 1 if single and falls and fell else 2
            last_change, fell = change, falls
            agreed = agreed + 1 if settled and (single or drift <= tolerance * reach) else 0
            if agreed >= needed or chords > MOST_CHORDS:
                break
            energy = extrapolated
        coarse = fine
        chords *= ratio
    kept = whole if single else fine
    for i in range(memory.dissipated.size):
        extrapolated = fine.dissipated[i] + weight * (fine.dissipated[i] - coarse.dissipated[i])
        kept.dissipated[i] = max(extrapolated, memory.dissipated[i])
    extrapolated = fine.now[DISSIPATED] + weight * (fine.now[DISSIPATED] - coarse.now[DISSIPATED])
    kept.now[DISSIPATED] = max(extrapolated, dissipated0)
    return kept
