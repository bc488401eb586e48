"""The traction memory of an ensemble: its exact update, superposition and energy, compiled.

By the method of dimensionality reduction a Hertz contact is a row of independent springs. A spring
is labelled by the approach ``a`` of the highest summit at which it first touches. With the tangential
displacement divided by θ = E*/(4G*), the whole history of all asperities that share one friction
coefficient is one function, the anchor ``w(a)`` of the springs, on labels up to the present approach
``d``. A spring's deflection is v = V - w, Coulomb's law says ``|v(a)| <= μ (d - a)``, and w is piecewise
linear. Its vertices are kept as a stack, the deepest first and the contact edge (d, V) last, so that
an event touches the outer end alone. The load of an asperity at approach a, with gap h below the
highest summit, is ``N(a) = k (a - h)^(3/2)``; P is the sum of N over a friction group, and

    T = Σ_j m_j [P(a_j) - P(a_{j-1})],   m_j = dw/da between vertices j-1 and j

holds for a group and, with N in the place of P, for each of its asperities (theory of Jäger and
Ciavarella; memory diagrams of Aleshin et al.). Slip sets m = ±μ from the edge to one slip front.

Everything here is dimensionless: lengths over the largest summit radius R0, loads over
(4/3) E* R0², k = √(R/R0), tangential displacements over θ R0. Tolerances are relative.

All compiled code stands in this one file because numba's cache looks at no other file when it
decides whether what it compiled is still good.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.int8]
Flags = npt.NDArray[np.bool_]

# columns of a vertex: label, anchor, slope dw/da towards the next deeper vertex, displacement at which it
# was made, load of the group at the label, tangential load of everything deeper
LABEL, ANCHOR, SLOPE, MADE_AT, NORMAL, TANGENTIAL = range(6)

# columns of Memory.now; request and limit are set where a ramp asks for more than friction can hold
APPROACH, DISPLACEMENT, NORMAL_LOAD, TANGENTIAL_LOAD, DISSIPATED, REQUEST, LIMIT = range(7)

LOAD, DISPLACED = 0, 1

SEPARATED, FULL_STICK, PARTIAL_SLIP, GROSS_SLIP = range(4)

# columns of Rows.totals
(
    ROW_NORMAL,
    ROW_TANGENTIAL,
    ROW_APPROACH,
    ROW_DISPLACEMENT,
    ROW_COUNT,
    ROW_AREA,
    ROW_STIFFNESS,
    ROW_DISSIPATED,
    ROW_SATURATED,
) = range(9)

EPSILON = float(np.finfo(np.float64).eps)
# two displacements or loads that rounding alone keeps apart; a closed loop is recognised by it
TIE = 32 * EPSILON
# rounding that a request at the friction limit may carry from its units
LIMIT_SLACK = 1e-12
MOST_CHORDS = 1 << 14


class Contact(NamedTuple):
    """What does not change while loads move: geometry and friction of all groups.

    Asperities stand in the order of their groups and, within a group, by ascending gap; groups by
    ascending smallest gap. ``sorted_gap`` and ``sorted_weight`` hold all asperities by ascending gap.
    """

    gap: Floats
    weight: Floats
    first: Integers
    friction: Floats
    sorted_gap: Floats
    sorted_weight: Floats


class Memory(NamedTuple):
    """What the contact remembers: vertex stacks (group, vertex, column), their depths, energies, present loads.

    ``steep`` marks groups whose polyline has slopes beyond μ.
    """

    vertices: Floats
    depth: Integers
    steep: Flags
    dissipated: Floats
    now: Floats


class Paths(NamedTuple):
    """Straight paths, one after the other: where each channel goes, and how many rows are recorded on the way.

    A channel goes ``fraction`` of the way from where it is to ``target``. ``parts`` equal parts are walked, the
    inner ones recorded from ``first_row`` on; ``recorded`` says whether the end is, too.
    """

    normal_control: Bytes
    normal_target: Floats
    normal_fraction: Floats
    tangential_control: Bytes
    tangential_target: Floats
    tangential_fraction: Floats
    parts: Integers
    recorded: Bytes
    first_row: Integers


class Rows(NamedTuple):
    """Recorded rows in SI units: totals (row, quantity), and per recorded asperity the projections (row, column)."""

    totals: Floats
    normal_load: Floats
    tangential_load: Floats
    contact_radius: Floats
    stick_radius: Floats
    slip_state: Bytes
    dissipated: Floats


class Units(NamedTuple):
    """Physical size of one dimensionless unit."""

    load: float
    length: float
    displacement: float
    energy: float
    radius: float
    area: float
    stiffness: float


# ---------------------------------------------------------------- normal load

_sums = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
_exact = njit(cache=True, error_model="numpy")


@_exact
def touching(gap: Floats, approach: float) -> int:
    """Count asperities, in ascending gap, whose gap is below the approach."""
    low, high = 0, gap.size
    if gap[high - 1] < approach:
        return high
    while low < high:
        middle = (low + high) // 2
        if gap[middle] < approach:
            low = middle + 1
        else:
            high = middle
    return low


@_sums
def load_and_slope(gap: Floats, weight: Floats, count: int, approach: float) -> tuple[float, float]:
    """P(a) and P'(a) of the first asperities, all of which touch."""
    load = 0.0
    slope = 0.0
    for i in range(count):
        depth = approach - gap[i]
        half_chord = weight[i] * math.sqrt(depth)
        load += half_chord * depth
        slope += half_chord
    return load, 1.5 * slope


@_exact
def group_load(contact: Contact, group: int, approach: float) -> tuple[float, float]:
    """P(a) and P'(a) of one friction group."""
    start, stop = contact.first[group], contact.first[group + 1]
    gap = contact.gap[start:stop]
    return load_and_slope(gap, contact.weight[start:stop], touching(gap, approach), approach)


@_exact
def total_load(contact: Contact, approach: float) -> tuple[float, float]:
    """P(a) and P'(a) of all asperities."""
    count = touching(contact.sorted_gap, approach)
    return load_and_slope(contact.sorted_gap, contact.sorted_weight, count, approach)


@_exact
def approach_at(gap: Floats, weight: Floats, load: float, guess: float) -> float:
    """Approach at which asperities, in ascending gap, carry a load: Newton on P^(2/3), bracketed."""
    low = gap[0]
    if load <= 0.0:
        return low
    # the deepest asperity alone would carry it here
    high = low + (load / weight[0]) ** (2.0 / 3.0)
    if gap.size == 1:
        return high
    approach = guess if low < guess <= high else high
    for _ in range(100):
        present, slope = load_and_slope(gap, weight, touching(gap, approach), approach)
        if present == load:
            return approach
        if present < load:
            low = approach
        else:
            high = approach
        step = 1.5 * present / slope * math.expm1(math.log1p((load - present) / present) * (2.0 / 3.0))
        following = approach + step
        if not low <= following <= high:
            following = 0.5 * (low + high)
        elif abs(step) <= 1e-10 * (following - gap[0]):
            # Newton squares the error, so this step was the last that matters
            return following
        if following in (low, high):
            return following
        approach = following
    return approach


# ---------------------------------------------------------------- energy


@_sums
def spread(
    contact: Contact,
    group: int,
    energy: Floats,
    low: float,
    high: float,
    slip_low: float,
    slip_high: float,
    drag_low: float,
    drag_high: float,
) -> float:
    """Add to each asperity of a group the energy ∫ slip·drag·N'' da over labels from low to high; return the sum.

    Slip and drag (the mean spring deflection while it slipped) are linear in the label, so the
    integrand over x = √(a - h) is a polynomial of fourth degree and three Gauss points are exact;
    no term is negative.
    """
    width = high - low
    if width <= 0.0:
        return 0.0
    start, stop = contact.first[group], contact.first[group + 1]
    gap, weight, share = contact.gap[start:stop], contact.weight[start:stop], energy[start:stop]
    slip_slope = (slip_high - slip_low) / width
    drag_slope = (drag_high - drag_low) / width
    node = math.sqrt(0.6)
    total = 0.0
    for i in range(touching(gap, high)):
        h = gap[i]
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
        e = weight[i] * length * q * (1.5 / 18.0)
        share[i] += e
        total += e
    return total


@_exact
def stored_energy(contact: Contact, memory: Memory, energy: Floats) -> float:
    """Elastic tangential energy ½ ∫ v² N'' da, added per asperity to ``energy``; returns the sum."""
    displacement = memory.now[DISPLACEMENT]
    total = 0.0
    for group in range(contact.friction.size):
        for j in range(1, memory.depth[group]):
            below, above = memory.vertices[group, j - 1], memory.vertices[group, j]
            v_low, v_high = displacement - below[ANCHOR], displacement - above[ANCHOR]
            total += spread(
                contact, group, energy, below[LABEL], above[LABEL], v_low, v_high, 0.5 * v_low, 0.5 * v_high
            )
    return total


# ---------------------------------------------------------------- one group, one straight path in (d, V)


@_exact
def edge_at(
    contact: Contact, memory: Memory, group: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> tuple[int, float, float, float, float]:
    """Where the polyline ends before any slip: index of its last segment, label, anchor, normal, tangential load."""
    stack = memory.vertices[group]
    top = memory.depth[group] - 1
    if top < 0:
        h = contact.gap[contact.first[group]]
        return 0, h, v0 + (v1 - v0) * (h - d0) / (d1 - d0), 0.0, 0.0
    if d1 >= d0:
        return top, stack[top, LABEL], stack[top, ANCHOR], stack[top, NORMAL], stack[top, TANGENTIAL]
    while top > 1 and stack[top - 1, LABEL] >= d1:
        top -= 1
    slope = stack[top, SLOPE]
    anchor = stack[top, ANCHOR] - slope * (stack[top, LABEL] - d1)
    tangential = stack[top, TANGENTIAL] - slope * (stack[top, NORMAL] - load)
    return top, d1, anchor, load, tangential


@_exact
def slip_front(
    stack: Floats,
    segment: int,
    x_edge: float,
    y_edge: float,
    x1: float,
    y1: float,
    friction: float,
    x_column: int,
    y_column: int,
) -> tuple[int, float, float, float]:
    """Walk from the edge inward to the slip front.

    The same walk serves displacements, with (label, anchor) as (x, y), and loads, with (normal,
    tangential load). Returns how many vertices are kept, x at the front, the direction of slip,
    and the slip at the front, which is 0 unless the whole contact slides. The front lies on the last
    vertex kept where x says so; vertices on the way are wiped out.
    """
    sign = 1.0 if y1 >= y_edge else -1.0
    tie = TIE * (abs(y1) + abs(y_edge) + friction * x1)
    x = x_edge
    slip = sign * (y1 - y_edge) - friction * (x1 - x_edge)
    met_vertex = x1 > x_edge and slip <= tie
    while segment > 0 and not met_vertex:
        slope = stack[segment, SLOPE]
        x_low = stack[segment - 1, x_column]
        slip_low = sign * (y1 - stack[segment - 1, y_column]) - friction * (x1 - x_low)
        if slip_low < -tie and slope != sign * friction:
            return segment, max(x - slip / (friction - sign * slope), x_low), sign, 0.0
        segment -= 1
        x, slip = x_low, slip_low
        met_vertex = slip <= tie
    if not met_vertex:
        return 0, x, sign, slip
    while segment > 0 and stack[segment, SLOPE] == sign * friction:
        segment -= 1
    return segment + 1, stack[segment, x_column] if segment > 0 else stack[0, x_column], sign, 0.0


@_exact
def put(
    stack: Floats,
    index: int,
    label: float,
    anchor: float,
    slope: float,
    made_at: float,
    normal: float,
    tangential: float,
) -> None:
    """Write one vertex."""
    stack[index, LABEL] = label
    stack[index, ANCHOR] = anchor
    stack[index, SLOPE] = slope
    stack[index, MADE_AT] = made_at
    stack[index, NORMAL] = normal
    stack[index, TANGENTIAL] = tangential


@_exact
def withdrawal_energy(
    contact: Contact, memory: Memory, group: int, d0: float, v0: float, d1: float, v1: float, segment: int
) -> float:
    """Energy of the springs that leave contact between approaches d0 and d1 < d0, while V goes from v0 to v1.

    Spring a leaves at V(a) = v0 + (a - d0) ΔV/Δd. It slips, if at all, one way: that of V(a) - w(a).
    """
    stack = memory.vertices[group]
    friction = contact.friction[group]
    rate = (v1 - v0) / (d1 - d0)
    total = 0.0
    high, slip_high = d0, 0.0
    for j in range(memory.depth[group] - 1, segment - 1, -1):
        low = max(stack[j - 1, LABEL], d1)
        change = rate - stack[j, SLOPE]
        slip_low = slip_high - change * (high - low)
        if slip_high * slip_low < 0.0:
            middle = max(low, high - slip_high / change)
            total += one_way_withdrawal(contact, memory, group, middle, high, 0.0, slip_high, rate, friction)
            total += one_way_withdrawal(contact, memory, group, low, middle, slip_low, 0.0, rate, friction)
        elif slip_high != 0.0 or slip_low != 0.0:
            total += one_way_withdrawal(contact, memory, group, low, high, slip_low, slip_high, rate, friction)
        high, slip_high = low, slip_low
    return total


@_exact
def one_way_withdrawal(
    contact: Contact,
    memory: Memory,
    group: int,
    low: float,
    high: float,
    slip_low: float,
    slip_high: float,
    rate: float,
    friction: float,
) -> float:
    """Energy of leaving springs that slip one way: the drag falls to 0 in proportion to the slip left."""
    sign = 1.0 if slip_low + slip_high > 0.0 else -1.0
    # slip per withdrawal; 0 where the springs ride along the limit
    ratio = friction - sign * rate
    if ratio <= 0.0:
        return 0.0
    drag = 0.5 * friction / ratio
    slip_low, slip_high = abs(slip_low), abs(slip_high)
    return spread(contact, group, memory.dissipated, low, high, slip_low, slip_high, drag * slip_low, drag * slip_high)


@_exact
def slip_energy(
    contact: Contact,
    memory: Memory,
    group: int,
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
    stack = memory.vertices[group]
    friction = contact.friction[group]
    whole = sign * (v1 - v0) - friction * (d1 - d0)
    lag = 0.5 * (d1 - d0) / whole if whole > 0.0 else 0.0
    total = 0.0
    low = front
    drag = friction * max(d1 - low - lag * slip, 0.0)
    for j in range(max(kept, 1), segment + 1):
        high = edge if j == segment else stack[j, LABEL]
        slip_high = slip + (friction - sign * stack[j, SLOPE]) * (high - low)
        drag_high = friction * max(d1 - high - lag * slip_high, 0.0)
        total += spread(contact, group, memory.dissipated, low, high, slip, slip_high, drag, drag_high)
        low, slip, drag = high, slip_high, drag_high
    if d1 > edge:
        total += spread(contact, group, memory.dissipated, edge, d1, slip, 0.0, drag, 0.0)
    return total


@_exact
def move_group(
    contact: Contact,
    memory: Memory,
    group: int,
    d0: float,
    v0: float,
    d1: float,
    v1: float,
    load: float,
    force: float,
) -> float:
    """Carry one group from (d0, v0) to approach d1, exactly: to a tangential force, or where that is NaN to v1.

    ``load`` is P(d1). Returns the displacement reached.
    """
    force_controlled = not math.isnan(force)
    stack = memory.vertices[group]
    friction = contact.friction[group]
    h = contact.gap[contact.first[group]]
    if d1 <= h:
        if memory.depth[group] > 0:
            memory.now[DISSIPATED] += withdrawal_energy(contact, memory, group, d0, v0, d1, v1, 1)
            memory.depth[group] = 0
            memory.steep[group] = False
        return v1
    if memory.steep[group]:
        move_steep_group(contact, memory, group, d0, v0, d1, v1, load)
        return v1
    if memory.depth[group] == 0 and force_controlled:
        # from nothing, a force proportional to the load strains all springs alike
        v1 = v0 + force / load * (d1 - d0)
        force_controlled, force = False, math.nan
    segment, edge, anchor, edge_load, edge_force = edge_at(contact, memory, group, d0, v0, d1, v1, load)
    if memory.depth[group] == 0:
        put(stack, 0, h, anchor, 0.0, anchor, 0.0, 0.0)
    if force_controlled:
        x1, y1, x_edge, y_edge = load, force, edge_load, edge_force
    else:
        x1, y1, x_edge, y_edge = d1, v1, edge, anchor
    excess = abs(y1 - y_edge) - friction * (x1 - x_edge)
    if y1 == y_edge or excess < -TIE * (abs(y1) + abs(y_edge) + friction * x1):
        slope = (y1 - y_edge) / (x1 - x_edge) if x1 > x_edge else 0.0
        if force_controlled:
            v1 = anchor + slope * (d1 - edge)
        if d1 < d0:
            memory.now[DISSIPATED] += withdrawal_energy(contact, memory, group, d0, v0, d1, v1, segment)
            put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
            memory.depth[group] = segment + 1
        elif d1 > edge:
            top = segment if segment > 0 and stack[segment, SLOPE] == slope else segment + 1
            reached = force if force_controlled else edge_force + slope * (load - edge_load)
            put(stack, top, d1, v1, slope, v1, load, reached)
            memory.depth[group] = top + 1
        return v1
    return slip_group(contact, memory, group, d0, v0, d1, v1, load, force, segment, edge, x_edge, y_edge, x1, y1)


@_exact
def slip_group(
    contact: Contact,
    memory: Memory,
    group: int,
    d0: float,
    v0: float,
    d1: float,
    v1: float,
    load: float,
    force: float,
    segment: int,
    edge: float,
    x_edge: float,
    y_edge: float,
    x1: float,
    y1: float,
) -> float:
    """Do the part of `move_group` where springs slip: find the front, account for the energy, rewrite the outer end."""
    stack = memory.vertices[group]
    friction = contact.friction[group]
    force_controlled = not math.isnan(force)
    x_column, y_column = (NORMAL, TANGENTIAL) if force_controlled else (LABEL, ANCHOR)
    kept, x_front, sign, slip = slip_front(stack, segment, x_edge, y_edge, x1, y1, friction, x_column, y_column)
    slope = sign * friction
    inner = kept > 0 and x_front != stack[kept - 1, x_column]
    front, front_load, front_force, front_anchor = stack[0, LABEL], 0.0, 0.0, 0.0
    if inner:
        if force_controlled:
            front_load = x_front
            start, stop = contact.first[group], contact.first[group + 1]
            guess = edge if kept == segment else stack[kept, LABEL]
            front = approach_at(contact.gap[start:stop], contact.weight[start:stop], front_load, guess)
            front = min(max(front, stack[kept - 1, LABEL]), guess)
        else:
            front = x_front
            front_load = group_load(contact, group, front)[0]
        strain = front - stack[kept - 1, LABEL]
        front_anchor = stack[kept - 1, ANCHOR] + stack[kept, SLOPE] * strain
        front_force = stack[kept - 1, TANGENTIAL] + stack[kept, SLOPE] * (front_load - stack[kept - 1, NORMAL])
    elif kept > 0:
        front, front_anchor = stack[kept - 1, LABEL], stack[kept - 1, ANCHOR]
        front_load, front_force = stack[kept - 1, NORMAL], stack[kept - 1, TANGENTIAL]
    if force_controlled:
        v1 = front_anchor + slope * (d1 - front)
    if d1 < d0:
        memory.now[DISSIPATED] += withdrawal_energy(contact, memory, group, d0, v0, d1, v1, segment)
    memory.now[DISSIPATED] += slip_energy(
        contact, memory, group, d0, v0, d1, v1, segment, edge, kept, front, sign, slip
    )
    if kept == 0:
        put(stack, 0, front, v1 - slope * (d1 - front), 0.0, v1, 0.0, 0.0)
        kept = 1
    elif inner:
        if not force_controlled:
            front_anchor = v1 - slope * (d1 - front)
        put(stack, kept, front, front_anchor, stack[kept, SLOPE], v1, front_load, front_force)
        kept += 1
    reached = force if force_controlled else front_force + slope * (load - front_load)
    put(stack, kept, d1, v1, slope, v1, load, reached)
    memory.depth[group] = kept + 1
    return v1


@_exact
def is_steep(stack: Floats, friction: float) -> bool:
    """Whether a slope exceeds μ, as it may after a fall of μ; several zones may then slip at once."""
    steepest = 0.0
    for j in range(1, len(stack)):
        steepest = max(steepest, abs(stack[j, SLOPE]))
    return steepest > friction


@_exact
def carried(
    contact: Contact, memory: Memory, group: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> Floats:
    """Polyline of one group carried straight to (d1, v1) before any slip: cut, or extended by new springs."""
    segment, edge, anchor, edge_load, edge_force = edge_at(contact, memory, group, d0, v0, d1, v1, load)
    stack = np.empty((segment + 2, memory.vertices.shape[2]))
    if memory.depth[group] == 0:
        put(stack, segment, edge, anchor, 0.0, anchor, 0.0, 0.0)
    else:
        stack[: segment + 1] = memory.vertices[group, : segment + 1]
    if d1 <= edge:
        put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
        return stack[: segment + 1]
    slope = (v1 - anchor) / (d1 - edge)
    put(stack, segment + 1, d1, v1, slope, v1, load, edge_force + slope * (load - edge_load))
    return stack


@_exact
def clip(
    contact: Contact,
    group: int,
    stack: Floats,
    d: float,
    displacement: float,
    friction: float,
    lag_down: float,
    lag_up: float,
    energy: Floats,
) -> tuple[Floats, float, float]:
    """Clip any polyline to the cone |v| ≤ μ (d - a): both sides may cut, anywhere.

    The drag of a spring that slips by g is the limit less lag·g, with the lag of its direction.
    Returns the new stack, its stiffness dT/dV, and the energy dissipated, which is spread over
    ``energy`` where that is not empty.
    """
    clipped = np.empty((3 * len(stack), stack.shape[1]))
    label = stack[0, LABEL]
    limit = friction * (d - label)
    v = min(max(displacement - stack[0, ANCHOR], -limit), limit)
    put(clipped, 0, label, displacement - v, 0.0, stack[0, MADE_AT], stack[0, NORMAL], 0.0)
    count = 1
    stiffness, dissipated = 0.0, 0.0
    tie = TIE * d
    breaks = np.empty(4)
    for j in range(1, len(stack)):
        slope, low, high = stack[j, SLOPE], stack[j - 1, LABEL], stack[j, LABEL]
        v_low = displacement - stack[j - 1, ANCHOR]
        breaks[:] = high
        breaks[0] = low
        for side in (-1.0, 1.0):
            relative = side * friction - slope
            if relative != 0.0:
                crossing = low + (side * friction * (d - low) - v_low) / relative
                if low + tie < crossing < high - tie:
                    breaks[1 if side < 0.0 else 2] = crossing
        if breaks[1] > breaks[2]:
            breaks[1], breaks[2] = breaks[2], breaks[1]
        for piece in range(3):
            a, b = breaks[piece], breaks[piece + 1]
            if b <= a:
                continue
            v_a, v_b = v_low - slope * (a - low), v_low - slope * (b - low)
            limit_a, limit_b = friction * (d - a), friction * (d - b)
            load = stack[j, NORMAL] if b == high else group_load(contact, group, b)[0]
            made_at, new_slope, v = displacement, slope, v_b
            if abs(v_a + v_b) > limit_a + limit_b:
                side = 1.0 if v_a + v_b > 0.0 else -1.0
                new_slope, v = side * friction, side * limit_b
                if energy.size > 0:
                    lag = lag_up if side > 0.0 else lag_down
                    slip_a, slip_b = max(side * v_a - limit_a, 0.0), max(side * v_b - limit_b, 0.0)
                    drag_a, drag_b = max(limit_a - lag * slip_a, 0.0), max(limit_b - lag * slip_b, 0.0)
                    dissipated += spread(contact, group, energy, a, b, slip_a, slip_b, drag_a, drag_b)
            else:
                stiffness += group_load(contact, group, b)[1] - group_load(contact, group, a)[1]
                if b == high:
                    made_at = stack[j, MADE_AT]
            if count > 1 and clipped[count - 1, SLOPE] == new_slope:
                count -= 1
            force = clipped[count - 1, TANGENTIAL] + new_slope * (load - clipped[count - 1, NORMAL])
            put(clipped, count, b, displacement - v, new_slope, made_at, load, force)
            count += 1
    return clipped[:count], stiffness, dissipated


@_exact
def move_steep_group(
    contact: Contact, memory: Memory, group: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> None:
    """Carry one group whose polyline has slopes beyond μ straight from (d0, v0) to (d1, v1)."""
    stack = carried(contact, memory, group, d0, v0, d1, v1, load)
    friction = contact.friction[group]
    if d1 < d0:
        segment = len(stack) - 1
        memory.now[DISSIPATED] += withdrawal_energy(contact, memory, group, d0, v0, d1, v1, segment)
    up, down = (v1 - v0) - friction * (d1 - d0), (v0 - v1) - friction * (d1 - d0)
    lag_up = 0.5 * friction * (d1 - d0) / up if up > 0.0 else 0.0
    lag_down = 0.5 * friction * (d1 - d0) / down if down > 0.0 else 0.0
    clipped, _, energy = clip(contact, group, stack, d1, v1, friction, lag_down, lag_up, memory.dissipated)
    memory.now[DISSIPATED] += energy
    memory.vertices[group, : len(clipped)] = clipped
    memory.depth[group] = len(clipped)
    memory.steep[group] = is_steep(clipped, friction)


@_exact
def force_of_group(
    contact: Contact, memory: Memory, group: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> tuple[float, float]:
    """Tangential force, and its slope in v1, that `move_group` would reach; nothing is changed."""
    stack = memory.vertices[group]
    friction = contact.friction[group]
    if memory.steep[group]:
        reached = carried(contact, memory, group, d0, v0, d1, v1, load)
        clipped, stiffness, _ = clip(contact, group, reached, d1, v1, friction, 0.0, 0.0, np.empty(0))
        return clipped[len(clipped) - 1, TANGENTIAL], stiffness
    segment, edge, anchor, edge_load, edge_force = edge_at(contact, memory, group, d0, v0, d1, v1, load)
    if abs(v1 - anchor) <= friction * (d1 - edge):
        if d1 > edge:
            strain = (v1 - anchor) / (d1 - edge)
            return edge_force + strain * (load - edge_load), (load - edge_load) / (d1 - d0)
        return edge_force, group_load(contact, group, d1)[1]
    if memory.depth[group] == 0:
        return math.copysign(friction * load, v1 - anchor), 0.0
    kept, front, sign, _ = slip_front(stack, segment, edge, anchor, d1, v1, friction, LABEL, ANCHOR)
    if kept == 0:
        return sign * friction * load, 0.0
    front_load, stiffness = group_load(contact, group, front)
    front_force = stack[kept - 1, TANGENTIAL]
    if front != stack[kept - 1, LABEL]:
        front_force += stack[kept, SLOPE] * (front_load - stack[kept - 1, NORMAL])
    return front_force + sign * friction * (load - front_load), stiffness


# ---------------------------------------------------------------- all groups


@_exact
def toward(present: float, target: float, fraction: float) -> float:
    """Point a fraction of the way from where a channel is to its target; the target itself at the end."""
    return target if fraction == 1.0 else present + fraction * (target - present)


@_exact
def deepest(memory: Memory) -> int:
    """Return the number of vertices of the deepest stack."""
    most = 0
    for group in range(memory.depth.size):
        most = max(most, memory.depth[group])
    return most


@_exact
def with_room(memory: Memory, room: int, whole: bool) -> Memory:
    """Copy the stacks to arrays with other room, and where ``whole`` everything else too."""
    vertices = np.empty((memory.vertices.shape[0], room, memory.vertices.shape[2]))
    for group in range(memory.depth.size):
        for j in range(memory.depth[group]):
            for column in range(memory.vertices.shape[2]):
                vertices[group, j, column] = memory.vertices[group, j, column]
    if not whole:
        return Memory(vertices, memory.depth, memory.steep, memory.dissipated, memory.now)
    return Memory(vertices, memory.depth.copy(), memory.steep.copy(), memory.dissipated.copy(), memory.now.copy())


@_exact
def friction_limit(contact: Contact, approach: float, load: float) -> float:
    """Σ μ P(a): the largest tangential load that the contact carries, where it carries the normal load ``load``."""
    if contact.friction.size == 1:
        return contact.friction[0] * load
    limit = 0.0
    for group in range(contact.friction.size):
        if contact.gap[contact.first[group]] >= approach:
            break
        limit += contact.friction[group] * group_load(contact, group, approach)[0]
    return limit


@_exact
def total_force(contact: Contact, memory: Memory) -> float:
    """Sum of the groups' tangential loads."""
    force = 0.0
    for group in range(contact.friction.size):
        if memory.depth[group] > 0:
            force += memory.vertices[group, memory.depth[group] - 1, TANGENTIAL]
    return force


@_exact
def force_at(contact: Contact, memory: Memory, shares: Floats, d1: float, v1: float) -> tuple[float, float]:
    """Tangential load and its slope in v1 at the end of a straight path to (d1, v1)."""
    d0, v0 = memory.now[APPROACH], memory.now[DISPLACEMENT]
    force, stiffness = 0.0, 0.0
    for group in range(contact.friction.size):
        if contact.gap[contact.first[group]] >= d1:
            break
        part, slope = force_of_group(contact, memory, group, d0, v0, d1, v1, shares[group])
        force += part
        stiffness += slope
    return force, stiffness


@_exact
def displacement_at(contact: Contact, memory: Memory, d1: float, force: float) -> float:
    """Displacement at which a straight path in (d, V) to approach d1 ends with a tangential load: bracketed Newton.

    At the friction limit: the least displacement, to rounding, at which all groups slide. A request
    beyond the limit is noted in ``memory.now``.
    """
    v0 = memory.now[DISPLACEMENT]
    shares = np.zeros(contact.friction.size)
    for group in range(contact.friction.size):
        if contact.gap[contact.first[group]] >= d1:
            break
        shares[group] = group_load(contact, group, d1)[0]
    limit = (contact.friction * shares).sum()
    if abs(force) > limit * (1.0 + LIMIT_SLACK):
        memory.now[REQUEST], memory.now[LIMIT] = force, limit
    force = min(max(force, -limit), limit)
    accuracy = 4.0 * EPSILON * limit
    low, high = -np.inf, np.inf
    v = v0
    stride = contact.friction.max() * d1
    for _ in range(200):
        present, stiffness = force_at(contact, memory, shares, d1, v)
        if abs(present - force) <= accuracy:
            return v
        if present < force:
            low = v
        else:
            high = v
        following = v + (force - present) / stiffness if stiffness > 0.0 else np.inf
        if not low < following < high:
            following = 0.5 * (low + high)
        if not abs(following - v) <= stride:
            following = v + math.copysign(stride, force - present)
        if following in (low, high, v):
            return v
        v = following
    return v


@_exact
def move(contact: Contact, memory: Memory, d1: float, v1: float, load: float, force: float) -> Memory:
    """Carry all groups straight in (d, V) to approach d1, where they carry ``load``.

    They go to a tangential force within the friction limit or, where that is NaN, to displacement v1.
    """
    room = memory.vertices.shape[1]
    # a front and an edge; a polyline with slopes beyond μ may be cut in every segment
    needed = 3 * deepest(memory) + 6 if memory.steep.any() else deepest(memory) + 2
    if needed > room:
        memory = with_room(memory, 2 * needed, room < 0)
    now, groups = memory.now, contact.friction.size
    d0, v0 = now[APPROACH], now[DISPLACEMENT]
    if not math.isnan(force):
        if d1 <= 0.0:
            # the highest summit is the last to leave, and its last spring sits at its anchor when the load has gone
            v1 = memory.vertices[0, 0, ANCHOR] if memory.depth[0] > 0 else v0
        elif groups > 1 or memory.steep[0]:
            v1 = displacement_at(contact, memory, d1, force)
    by_force = groups == 1 and d1 > 0.0 and not memory.steep[0] and not math.isnan(force)
    for group in range(groups):
        if contact.gap[contact.first[group]] >= max(d0, d1):
            break
        share = load if groups == 1 else group_load(contact, group, d1)[0]
        reached = move_group(contact, memory, group, d0, v0, d1, v1, share, force if by_force else math.nan)
        if by_force:
            v1 = reached
    now[APPROACH] = d1
    now[DISPLACEMENT] = v1
    now[NORMAL_LOAD] = load
    now[TANGENTIAL_LOAD] = total_force(contact, memory) if math.isnan(force) else force
    return memory


@_exact
def approach_for(contact: Contact, memory: Memory, load: float) -> float:
    """Approach at which all asperities carry a normal load; the very bits of a label met before where they tie."""
    present = memory.now[APPROACH]
    if load == memory.now[NORMAL_LOAD]:
        return present
    if load <= 0.0:
        return min(present, 0.0)
    approach = approach_at(contact.sorted_gap, contact.sorted_weight, load, present)
    for j in range(memory.depth[0] - 1, 0, -1):
        label = memory.vertices[0, j, LABEL]
        if abs(label - approach) <= 4.0 * EPSILON * approach:
            return label
        if label < approach:
            break
    return approach


@_exact
def ramp(contact: Contact, memory: Memory, load: float, force: float, tolerance: float) -> Memory:
    """Carry all groups along the straight ramp in (N, T) to (load, force).

    One straight path in (d, V) ends in the exact state where there is one friction group, and its
    energy is exact where N is constant or nothing slips. Otherwise the ramp is walked in chords whose
    ends lie on it, twice as many each time, until the energy, extrapolated, and with several groups
    the displacement too, change by less than ``tolerance`` (relative to what the ramp dissipates, and
    to the displacement at which the contact slides).
    """
    now = memory.now
    if now[APPROACH] < 0.0 and load > 0.0:
        now[APPROACH] = 0.0
    load0, force0, dissipated0 = now[NORMAL_LOAD], now[TANGENTIAL_LOAD], now[DISSIPATED]
    sticks = abs(force - force0) <= contact.friction.min() * (load - load0)
    # a chord's error is a small multiple of the square of the relative change
    small = ((load - load0) / max(load, load0)) ** 2 <= tolerance if load != load0 else True
    # then the state does not depend on the chords
    single = contact.friction.size == 1 and not memory.steep[0]
    whole, coarse = memory, memory
    energy = 0.0
    chords = np.int64(1)
    while True:
        fine = memory if small or sticks else with_room(memory, deepest(memory) + 2, chords > 0)
        for k in range(1, chords + 1):
            step_load, step_force = toward(load0, load, k / chords), toward(force0, force, k / chords)
            d1 = approach_for(contact, fine, step_load)
            fine = move(contact, fine, d1, fine.now[DISPLACEMENT], step_load, step_force)
        if small or sticks:
            return fine
        if chords == 1:
            whole = fine
        else:
            extrapolated = (4.0 * fine.now[DISSIPATED] - coarse.now[DISSIPATED]) / 3.0
            drift = abs(fine.now[DISPLACEMENT] - coarse.now[DISPLACEMENT])
            reach = contact.friction.max() * max(now[APPROACH], fine.now[APPROACH])
            settled = abs(extrapolated - energy) <= tolerance * (extrapolated - dissipated0)
            if chords == MOST_CHORDS or (settled and (single or drift <= tolerance * reach)):
                break
            energy = extrapolated
        coarse = fine
        chords *= 2
    kept = whole if single else fine
    for i in range(memory.dissipated.size):
        extrapolated = (4.0 * fine.dissipated[i] - coarse.dissipated[i]) / 3.0
        kept.dissipated[i] = max(extrapolated, memory.dissipated[i])
    kept.now[DISSIPATED] = max((4.0 * fine.now[DISSIPATED] - coarse.now[DISSIPATED]) / 3.0, dissipated0)
    return kept


# ---------------------------------------------------------------- a change of friction


@_exact
def change_friction(contact: Contact, memory: Memory, friction: Floats) -> Memory:
    """Replace the groups' friction coefficients at rest; springs that the new limit cannot hold slip.

    The elastic energy that they lose is dissipated.
    """
    now = memory.now
    d, v = now[APPROACH], now[DISPLACEMENT]
    for group in range(friction.size):
        depth = memory.depth[group]
        if depth == 0:
            continue
        if friction[group] < contact.friction[group]:
            stack = memory.vertices[group, :depth]
            # |v| falls to the limit straight, so the mean drag is half-way between
            clipped, _, energy = clip(contact, group, stack, d, v, friction[group], -0.5, -0.5, memory.dissipated)
            now[DISSIPATED] += energy
            if len(clipped) > memory.vertices.shape[1]:
                memory = with_room(memory, 2 * len(clipped), len(clipped) < 0)
            memory.vertices[group, : len(clipped)] = clipped
            memory.depth[group] = len(clipped)
        memory.steep[group] = is_steep(memory.vertices[group, : memory.depth[group]], friction[group])
    now[TANGENTIAL_LOAD] = total_force(contact, memory)
    return memory


@_exact
def refresh_loads(contact: Contact, memory: Memory) -> None:
    """Recompute the loads kept with the vertices, after groups have been split."""
    for group in range(contact.friction.size):
        stack = memory.vertices[group]
        stack[0, NORMAL] = group_load(contact, group, stack[0, LABEL])[0]
        stack[0, TANGENTIAL] = 0.0
        for j in range(1, memory.depth[group]):
            stack[j, NORMAL] = group_load(contact, group, stack[j, LABEL])[0]
            rise = stack[j, NORMAL] - stack[j - 1, NORMAL]
            stack[j, TANGENTIAL] = stack[j - 1, TANGENTIAL] + stack[j, SLOPE] * rise


# ---------------------------------------------------------------- projections


@_exact
def stick_boundary(contact: Contact, memory: Memory, group: int) -> float:
    """Label where the slip annulus ends: the edge where nothing slips."""
    stack = memory.vertices[group]
    top = memory.depth[group] - 1
    if abs(stack[top, SLOPE]) == contact.friction[group]:
        return stack[top - 1, LABEL]
    return stack[top, LABEL]


@_sums
def nominal_area(gap: Floats, weight: Floats, count: int, approach: float) -> float:
    """Σ k² (a - h), the contact area over π."""
    area = 0.0
    for i in range(count):
        area += weight[i] * weight[i] * (approach - gap[i])
    return area


@_exact
def record_totals(contact: Contact, memory: Memory, totals: Floats, units: Units, saturated: bool) -> None:
    """Project the state onto one row of totals."""
    now = memory.now
    approach = now[APPROACH]
    count = touching(contact.sorted_gap, approach)
    stiffness = 0.0
    for group in range(contact.friction.size):
        if contact.gap[contact.first[group]] >= approach:
            break
        stiffness += group_load(contact, group, stick_boundary(contact, memory, group))[1]
    totals[ROW_NORMAL] = now[NORMAL_LOAD] * units.load
    totals[ROW_TANGENTIAL] = now[TANGENTIAL_LOAD] * units.load
    totals[ROW_APPROACH] = approach * units.length
    totals[ROW_DISPLACEMENT] = now[DISPLACEMENT] * units.displacement
    totals[ROW_COUNT] = count
    totals[ROW_AREA] = nominal_area(contact.sorted_gap, contact.sorted_weight, count, approach) * units.area
    totals[ROW_STIFFNESS] = stiffness * units.stiffness
    totals[ROW_DISSIPATED] = now[DISSIPATED] * units.energy
    totals[ROW_SATURATED] = 1.0 if saturated else 0.0


@_sums
def superpose(gap: Floats, weight: Floats, count: int, label: float, jump: float, force: Floats) -> None:
    """Add jump·N(label) to the tangential force of the first asperities, which all touch at the label."""
    for i in range(count):
        depth = label - gap[i]
        force[i] += jump * weight[i] * depth * math.sqrt(depth)


@_exact
def record_asperities(
    contact: Contact, memory: Memory, rows: Rows, row: int, columns: Integers, units: Units, work: Floats
) -> None:
    """Project the state onto one row of per-asperity variables; those that do not touch are left as they are."""
    approach = memory.now[APPROACH]
    for group in range(contact.friction.size):
        start, stop = contact.first[group], contact.first[group + 1]
        if contact.gap[start] >= approach:
            break
        gap, weight, column = contact.gap[start:stop], contact.weight[start:stop], columns[start:stop]
        stack, force = memory.vertices[group], work[start:stop]
        top = memory.depth[group] - 1
        force[:] = 0.0
        for j in range(1, top + 1):
            jump = stack[j, SLOPE] - (stack[j + 1, SLOPE] if j < top else 0.0)
            superpose(gap, weight, touching(gap, stack[j, LABEL]), stack[j, LABEL], jump, force)
        boundary = stick_boundary(contact, memory, group)
        friction = contact.friction[group]
        for i in range(touching(gap, approach)):
            c = column[i]
            if c < 0:
                continue
            depth = approach - gap[i]
            x = math.sqrt(depth)
            load = weight[i] * depth * x
            limit = friction * load
            x_stick = math.sqrt(max(boundary - gap[i], 0.0))
            rows.normal_load[row, c] = load * units.load
            rows.tangential_load[row, c] = min(max(force[i], -limit), limit) * units.load
            rows.contact_radius[row, c] = weight[i] * x * units.radius
            rows.stick_radius[row, c] = weight[i] * x_stick * units.radius
            state = PARTIAL_SLIP if boundary > gap[i] else GROSS_SLIP
            rows.slip_state[row, c] = FULL_STICK if boundary == approach else state
    for i in range(columns.size):
        if columns[i] >= 0:
            rows.dissipated[row, columns[i]] = memory.dissipated[i] * units.energy


# ---------------------------------------------------------------- paths


@_exact
def replay(
    contact: Contact,
    memory: Memory,
    paths: Paths,
    rows: Rows,
    columns: Integers,
    units: Units,
    saturate: bool,
    tolerance: float,
) -> tuple[Memory, int, float, float]:
    """Walk paths one after the other and record their rows; ``columns`` gives each asperity's column, or -1.

    Returns the memory, and the path that asks for more than the friction limit with the request and
    the limit (dimensionless); the memory is then of no use. The path is -1 where all could be walked.
    """
    asperities = rows.normal_load.shape[1] > 0
    work = np.zeros(contact.gap.size if asperities else 0)
    for p in range(paths.parts.size):
        now = memory.now
        parts = paths.parts[p]
        by_load, by_force = paths.normal_control[p] == LOAD, paths.tangential_control[p] == LOAD
        load0, force0, d0, v0 = now[NORMAL_LOAD], now[TANGENTIAL_LOAD], now[APPROACH], now[DISPLACEMENT]
        if by_load:
            load = toward(load0, paths.normal_target[p], paths.normal_fraction[p])
            d1 = approach_for(contact, memory, load)
        else:
            d1 = toward(d0, paths.normal_target[p], paths.normal_fraction[p])
            load = total_load(contact, d1)[0]
        saturated = False
        v1, force = v0, math.nan
        if by_force:
            request = toward(force0, paths.tangential_target[p], paths.tangential_fraction[p])
            limit = friction_limit(contact, d1, load)
            saturated = abs(request) > limit * (1.0 + LIMIT_SLACK)
            if saturated and not saturate:
                return memory, p, request, limit
            force = min(max(request, -limit), limit)
            if parts > 1 and not by_load:
                v1 = displacement_at(contact, memory, d1, force)
        else:
            v1 = toward(v0, paths.tangential_target[p], paths.tangential_fraction[p])
        for part in range(1, parts + 1):
            share = part / parts
            if by_load and by_force:
                memory = ramp(contact, memory, toward(load0, load, share), toward(force0, force, share), tolerance)
                if memory.now[LIMIT] > 0.0 and not saturate:
                    return memory, p, memory.now[REQUEST], memory.now[LIMIT]
                memory.now[LIMIT] = 0.0
            else:
                d, v = toward(d0, d1, share), toward(v0, v1, share)
                step_load = load if d == d1 else total_load(contact, d)[0]
                memory = move(contact, memory, d, v, step_load, force if part == parts else math.nan)
            if part < parts or paths.recorded[p]:
                row = paths.first_row[p] + part - 1
                record_totals(contact, memory, rows.totals[row], units, saturated and part == parts)
                if asperities:
                    record_asperities(contact, memory, rows, row, columns, units, work)
    return memory, -1, 0.0, 0.0
