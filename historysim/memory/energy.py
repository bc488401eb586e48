"""The energy that the springs hold, and that they lose where they slip."""

import math

from historysim.memory.compiled import compiled, entry, inlined, reordered
from historysim.memory.layout import ANCHOR, DISPLACEMENT, LABEL, SLOPE, Contact, Floats, Group, Memory
from historysim.memory.lean import lean, uncounted
from historysim.memory.normal import touching


@reordered
def part_of_one(
    h: float,
    k: float,
    low: float,
    high: float,
    slip_low: float,
    slip_slope: float,
    drag_low: float,
    drag_slope: float,
) -> float:
    """∫ slip·drag·N'' da of one asperity of gap h and weight k over labels from low to high > h.

    Slip and drag are linear in the label, so the integrand over x = √(a - h) is a polynomial of fourth degree and
    three Gauss points are exact; no term is negative.
    """
    node = math.sqrt(0.6)
    base = max(h, low)
    x_low = math.sqrt(base - h)
    x_high = math.sqrt(high - h)
    length = (high - base) / (x_high + x_low)
    middle = 0.5 * (x_high + x_low)
    offset = 0.5 * length * node
    x = middle - offset
    s = base - low + (x - x_low) * (x + x_low)
    q = 5.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s)
    s = base - low + (middle - x_low) * (middle + x_low)
    q += 8.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s)
    x = middle + offset
    s = base - low + (x - x_low) * (x + x_low)
    q += 5.0 * (slip_low + slip_slope * s) * (drag_low + drag_slope * s)
    return k * length * q * (1.5 / 18.0)


@reordered
def spread(
    gap: Floats,
    weight: Floats,
    energy: Floats,
    low: float,
    high: float,
    slip_low: float,
    slip_high: float,
    drag_low: float,
    drag_high: float,
) -> float:
    """Add to each asperity the energy ∫ slip·drag·N'' da over labels from low to high; return the sum.

    Slip and drag (the mean spring deflection while it slipped) are linear in the label.
    """
    width = high - low
    if width <= 0.0:
        return 0.0
    slip_slope = (slip_high - slip_low) / width
    drag_slope = (drag_high - drag_low) / width
    total = 0.0
    for i in range(touching(gap, high)):
        e = part_of_one(gap[i], weight[i], low, high, slip_low, slip_slope, drag_low, drag_slope)
        energy[i] += e
        total += e
    return total


@inlined
def dissipate(
    group: Group, low: float, high: float, slip_low: float, slip_high: float, drag_low: float, drag_high: float
) -> float:
    """`spread` over a group what it dissipates; return the sum."""
    gap, weight, dissipated = group.gap, group.weight, group.dissipated
    if gap.size > 1:
        return spread(gap, weight, dissipated, low, high, slip_low, slip_high, drag_low, drag_high)
    if high <= low or high <= gap[0]:
        return 0.0
    slip_slope, drag_slope = (slip_high - slip_low) / (high - low), (drag_high - drag_low) / (high - low)
    e = part_of_one(gap[0], weight[0], low, high, slip_low, slip_slope, drag_low, drag_slope)
    dissipated[0] += e
    return e


@entry
def stored_energy(contact: Contact, memory: Memory, energy: Floats) -> float:
    """Elastic tangential energy ½ ∫ v² N'' da, added per asperity to ``energy``; returns the sum."""
    contact, memory, energy = lean(contact), uncounted(lean(memory)), lean(energy)
    displacement = memory.now[DISPLACEMENT]
    total = 0.0
    for index in range(contact.friction.size):
        start, stop = contact.first[index], contact.first[index + 1]
        gap, weight, share = contact.gap[start:stop], contact.weight[start:stop], energy[start:stop]
        stack = memory.vertices[index]
        for j in range(1, memory.depth[index]):
            low, high = stack[j - 1, LABEL], stack[j, LABEL]
            v_low, v_high = displacement - stack[j - 1, ANCHOR], displacement - stack[j, ANCHOR]
            total += spread(gap, weight, share, low, high, v_low, v_high, 0.5 * v_low, 0.5 * v_high)
    return total


@inlined
def one_way_withdrawal(group: Group, low: float, high: float, slip_low: float, slip_high: float, rate: float) -> float:
    """Energy of leaving springs that slip one way: the drag falls to 0 in proportion to the slip left."""
    sign = 1.0 if slip_low + slip_high > 0.0 else -1.0
    # slip per withdrawal; 0 where the springs ride along the limit
    ratio = group.friction - sign * rate
    if ratio <= 0.0:
        return 0.0
    drag = 0.5 * group.friction / ratio
    slip_low, slip_high = abs(slip_low), abs(slip_high)
    return dissipate(group, low, high, slip_low, slip_high, drag * slip_low, drag * slip_high)


@compiled
def withdrawal_energy(group: Group, depth: int, segment: int, d0: float, v0: float, d1: float, v1: float) -> float:
    """Energy of the springs that leave contact between approaches d0 and d1 < d0, while V goes from v0 to v1.

    Spring a leaves at V(a) = v0 + (a - d0) ΔV/Δd. It slips, if at all, one way: that of V(a) - w(a).
    """
    rate = (v1 - v0) / (d1 - d0)
    total = 0.0
    high, slip_high = d0, 0.0
    for j in range(depth - 1, segment - 1, -1):
        low = max(group.stack[j - 1, LABEL], d1)
        change = rate - group.stack[j, SLOPE]
        slip_low = slip_high - change * (high - low)
        middle = high
        if slip_high * slip_low < 0.0:
            middle = max(low, high - slip_high / change)
            total += one_way_withdrawal(group, middle, high, 0.0, slip_high, rate)
            slip_high = 0.0
        if slip_high != 0.0 or slip_low != 0.0:
            total += one_way_withdrawal(group, low, middle, slip_low, slip_high, rate)
        high, slip_high = low, slip_low
    return total


@inlined
def slip_energy(
    group: Group,
    d0: float,
    v0: float,
    d1: float,
    v1: float,
    segment: int,
    edge: float,
    kept: int,
    front: float,
    sign: float,
    slip: float,
) -> float:
    """Energy of the springs between the slip front and the edge d1 that slipped on a straight path in (d, V).

    While spring a slips by g, ending at approach d1, its mean deflection is μ (d1 - a - g Δd/(2 g_tot)),
    where g_tot is the slip of a spring that slips all the way.
    """
    friction = group.friction
    whole = sign * (v1 - v0) - friction * (d1 - d0)
    lag = 0.5 * (d1 - d0) / whole if whole > 0.0 else 0.0
    total = 0.0
    low = front
    drag = friction * max(d1 - low - lag * slip, 0.0)
    # the last turn is for the springs that touched on the way and slipped at once
    for j in range(max(kept, 1), segment + 2):
        if j > segment:
            high, slip_high, drag_high = d1, 0.0, 0.0
        else:
            high = edge if j == segment else group.stack[j, LABEL]
            slip_high = slip + (friction - sign * group.stack[j, SLOPE]) * (high - low)
            drag_high = friction * max(d1 - high - lag * slip_high, 0.0)
        if high > low:
            total += dissipate(group, low, high, slip, slip_high, drag, drag_high)
        low, slip, drag = high, slip_high, drag_high
    return total
