"""Straight ramps in (N, T), walked in straight paths in (d, V)."""

import numpy as np

from historysim.memory.compiled import compiled, inlined
from historysim.memory.groups import approach_for
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Memory,
    copied,
)
from historysim.memory.move import move
from historysim.memory.polyline import to_load

MOST_CHORDS = 1 << 14


@inlined
def toward(present: float, target: float, fraction: float) -> float:
    """Point a fraction of the way from where a channel is to its target; the target itself at the end."""
    return target if fraction == 1.0 else present + fraction * (target - present)


@compiled
def ramp(contact: Contact, memory: Memory, load: float, force: float, tolerance: float) -> Memory:
    """Carry all groups along the straight ramp in (N, T) to (load, force).

    One straight path in (d, V) ends in the exact state where there is one friction group, and its
    energy is exact where N is constant or nothing slips. Otherwise the ramp is walked in chords whose
    ends lie on it, more of them each time, until the energy, extrapolated, and with several groups
    the displacement too, change by less than ``tolerance`` (relative to what the ramp dissipates, and
    to the displacement at which the contact slides).
    """
    now = memory.now
    if now[APPROACH] < 0.0 and load > 0.0:
        now[APPROACH] = 0.0
    load0, force0, dissipated0 = now[NORMAL_LOAD], now[TANGENTIAL_LOAD], now[DISSIPATED]
    sticks = bool(abs(force - force0) <= contact.friction.min() * (load - load0))
    # a chord's error is a small multiple of the square of the relative change
    small = ((load - load0) / max(load, load0)) ** 2 <= tolerance if load != load0 else True
    # then the state does not depend on the chords
    single = contact.friction.size == 1 and not memory.steep[0]
    # with several groups the error falls in steps, as groups slip earlier or later: two halvings may agree by chance
    ratio, agreements = (2, 1) if single else (3, 2)
    weight = 1.0 / (ratio * ratio - 1.0)
    whole, coarse = memory, memory
    energy, agreed = 0.0, 0
    chords = np.int64(1)
    while True:
        fine = memory if small or sticks else copied(memory)
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
            reach = contact.friction.max() * max(now[APPROACH], fine.now[APPROACH])
            settled = abs(extrapolated - energy) <= tolerance * (extrapolated - dissipated0)
            agreed = agreed + 1 if settled and (single or drift <= tolerance * reach) else 0
            if agreed == agreements or chords > MOST_CHORDS:
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
