"""What springs lose that slip on a straight path in (d, V).

A piece of it is what one asperity, or a group of several, loses between two labels, between which slip and drag are
linear. Pieces of asperities that are groups of their own are put off until there are many, for each is a chain of
roots and quotients that wait for one another, and several pieces at a time take no longer than one.
"""

from typing import NamedTuple

import numpy as np

from historysim.memory.compiled import compiled, inlined, reordered
from historysim.memory.energy import part_of_one, spread
from historysim.memory.layout import DISSIPATED, LABEL, SLOPE, Floats, Group, Integers, Memory
from historysim.memory.lean import empty

# rows of the table of pieces, which has a column for each: which asperity it is of, its gap and weight, the labels,
# slip and drag there, and the energy once it is known
ROWS_OF_PIECES = 10
WHOSE, GAP, WEIGHT, LOW, HIGH, SLIP_LOW, SLIP_HIGH, DRAG_LOW, DRAG_HIGH, ENERGY = range(ROWS_OF_PIECES)

MOST_PIECES_PUT_OFF = 128
"""What fits into the fastest memory."""


class Losses(NamedTuple):
    """Pieces that were put off: the table, and how many there are."""

    pieces: Floats
    number: Integers


@inlined
def no_losses(groups: int) -> Losses:
    """Return the table before any piece is put off, for a contact of so many groups; for one alone it has no room."""
    room = min(groups, MOST_PIECES_PUT_OFF) if groups > 1 else 0
    count = empty(1, np.int64)
    count[0] = 0
    return Losses(empty((ROWS_OF_PIECES, room), np.float64), count)


@inlined
def lose(
    group: Group,
    losses: Losses,
    low: float,
    high: float,
    slip_low: float,
    slip_high: float,
    drag_low: float,
    drag_high: float,
) -> float:
    """Spread over a group what it loses between two labels, and return that; or put it off, and return 0."""
    count = losses.number[0]
    if group.gap.size > 1 or count == losses.pieces.shape[1]:
        return spread(group.gap, group.weight, group.dissipated, low, high, slip_low, slip_high, drag_low, drag_high)
    if low < high > group.gap[0]:
        losses.pieces[GAP, count] = group.gap[0]
        losses.pieces[WEIGHT, count] = group.weight[0]
        losses.pieces[LOW, count] = low
        losses.pieces[HIGH, count] = high
        losses.pieces[SLIP_LOW, count] = slip_low
        losses.pieces[SLIP_HIGH, count] = slip_high
        losses.pieces[DRAG_LOW, count] = drag_low
        losses.pieces[DRAG_HIGH, count] = drag_high
        losses.pieces[WHOSE, count] = group.start
        losses.number[0] = count + 1
    return 0.0


@reordered
def work_out(pieces: Floats, energies: Floats) -> float:
    """Write the energy of each piece; return the sum."""
    total = 0.0
    for p in range(energies.size):
        low, slip, drag = pieces[LOW, p], pieces[SLIP_LOW, p], pieces[DRAG_LOW, p]
        rate = 1.0 / (pieces[HIGH, p] - low)
        slip_slope, drag_slope = (pieces[SLIP_HIGH, p] - slip) * rate, (pieces[DRAG_HIGH, p] - drag) * rate
        e = part_of_one(pieces[GAP, p], pieces[WEIGHT, p], low, pieces[HIGH, p], slip, slip_slope, drag, drag_slope)
        energies[p] = e
        total += e
    return total


@compiled
def settle(losses: Losses, memory: Memory) -> None:
    """Add what was put off to what the asperities, and all together, have dissipated."""
    energies = losses.pieces[ENERGY, : losses.number[0]]
    memory.now[DISSIPATED] += work_out(losses.pieces, energies)
    for p in range(energies.size):
        memory.dissipated[int(losses.pieces[WHOSE, p])] += energies[p]
    losses.number[0] = 0


@inlined
def is_nearly_full(losses: Losses) -> bool:
    """Return whether it is time to settle."""
    return bool(2 * losses.number[0] > losses.pieces.shape[1])


@inlined
def one_way_withdrawal(
    group: Group, losses: Losses, low: float, high: float, slip_low: float, slip_high: float, rate: float
) -> float:
    """Energy of leaving springs that slip one way: the drag falls to 0 in proportion to the slip left."""
    sign = 1.0 if slip_low + slip_high > 0.0 else -1.0
    # slip per withdrawal; 0 where the springs ride along the limit
    ratio = group.friction - sign * rate
    if ratio <= 0.0:
        return 0.0
    drag = 0.5 * group.friction / ratio
    slip_low, slip_high = abs(slip_low), abs(slip_high)
    return lose(group, losses, low, high, slip_low, slip_high, drag * slip_low, drag * slip_high)


@compiled
def withdrawal_energy(
    group: Group, losses: Losses, depth: int, segment: int, d0: float, v0: float, d1: float, v1: float
) -> float:
    """Energy of the springs that leave contact between approaches d0 and d1 < d0, while V goes from v0 to v1.

    Spring a leaves at V(a) = v0 + (a - d0) ΔV/Δd. It slips, if at all, one way: that of V(a) - w(a).
    """
    rate = (v1 - v0) / (d1 - d0)
    total = 0.0
    high, slip_high = d0, 0.0
    j = depth - 1
    while j >= segment:
        low = max(group.stack[j - 1, LABEL], d1)
        change = rate - group.stack[j, SLOPE]
        slip_low = slip_high - change * (high - low)
        turns = slip_high * slip_low < 0.0
        if turns:
            # first up to where the springs slip the other way
            low, slip_low = max(low, high - slip_high / change), 0.0
        if slip_high != 0.0 or slip_low != 0.0:
            total += one_way_withdrawal(group, losses, low, high, slip_low, slip_high, rate)
        high, slip_high = low, slip_low
        if not turns:
            j -= 1
    return total


@inlined
def slip_energy(
    group: Group,
    losses: Losses,
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
            total += lose(group, losses, low, high, slip, slip_high, drag, drag_high)
        low, slip, drag = high, slip_high, drag_high
    return total
