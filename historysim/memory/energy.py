"""The energy of springs between two labels: what they hold, and what they lose where they slip."""

import math

from historysim.memory.compiled import entry, inlined, reordered
from historysim.memory.layout import ANCHOR, DISPLACEMENT, LABEL, Contact, Floats, Group, Memory
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
