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
Since dw = m da and dT = m dP along the polyline, any r w + c T over r a + c P(a) is a polyline with the
same slopes m, within the same cone: a displacement (r = 1, c = 0), a load (r = 0, c = 1) and the
displacement of a drive behind a spring of compliance c (r = 1) all move the contact by one update.

Everything here is dimensionless: lengths over the largest summit radius R0, loads over
(4/3) E* R0², k = √(R/R0), tangential displacements over θ R0. Tolerances are relative.

All compiled code stands in this one file because numba's cache looks at no other file when it
decides whether what it compiled is still good.
"""

import math
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.int8]
Flags = npt.NDArray[np.bool_]
Array = TypeVar("Array", bound=npt.NDArray[Any])

# columns of a vertex: label, anchor, slope dw/da towards the next deeper vertex, displacement at which it
# was made, load of the group at the label, tangential load of everything deeper
LABEL, ANCHOR, SLOPE, MADE_AT, NORMAL, TANGENTIAL = range(6)

# columns of Memory.now; request and limit are set where a ramp asks for more than friction can hold
APPROACH, DISPLACEMENT, NORMAL_LOAD, TANGENTIAL_LOAD, DISSIPATED, REQUEST, LIMIT = range(7)

LOAD, DISPLACED = 0, 1

# target and fraction of a channel that is held
STILL = (0.0, 0.0)

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
    ROW_LIMIT,
    ROW_SATURATED,
) = range(10)

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


class Group(NamedTuple):
    """One friction group: views of its summits, of what its asperities dissipated, and of its vertex stack."""

    gap: Floats
    weight: Floats
    dissipated: Floats
    stack: Floats
    friction: float


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


class Goals(NamedTuple):
    """Where one channel goes on each of several paths; a single entry stands for all of them.

    ``control`` is `LOAD` or `DISPLACED`, ``target`` in N or m, ``fraction`` as in `Paths`.
    """

    control: npt.ArrayLike
    target: npt.ArrayLike
    fraction: npt.ArrayLike = 1.0


def paths_to(normal: Goals, tangential: Goals, *, parts: npt.ArrayLike = 1, recorded: npt.ArrayLike = True) -> Paths:
    """Return the straight paths to the goals of both channels, whose rows follow one another from row 0 on.

    Parameters
    ----------
    normal, tangential : Goals
        A single entry of either stands for all paths.
    parts : array_like (path)
        Equal parts that are walked; the inner ends are recorded.
    recorded : array_like (path)
        Whether the end is recorded, too.
    """
    columns = np.broadcast_arrays(*(np.atleast_1d(entry) for entry in (*normal, *tangential, parts, recorded)))
    parts, recorded = columns[6].astype(np.int64), columns[7].astype(np.int8)
    rows = parts - 1 + recorded
    return Paths(
        normal_control=columns[0].astype(np.int8),
        normal_target=columns[1].astype(np.float64),
        normal_fraction=columns[2].astype(np.float64),
        tangential_control=columns[3].astype(np.int8),
        tangential_target=columns[4].astype(np.float64),
        tangential_fraction=columns[5].astype(np.float64),
        parts=parts,
        recorded=recorded,
        first_row=np.cumsum(rows) - rows,
    )


class Aim(NamedTuple):
    """Where the tangential channel goes: ``rigid`` V + ``compliance`` T = ``value``.

    A displacement has (1, 0), a load (0, 1), the displacement of a drive behind a spring (1, c).
    """

    value: float
    rigid: float
    compliance: float


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


# ---------------------------------------------------------------- compilation

_sums = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
_exact = njit(cache=True, error_model="numpy")
_inline = njit(error_model="numpy", inline="always")


if TYPE_CHECKING:

    def uncounted(array: Array, /) -> Array:
        """See below; numba's own type for it would hide that of the array."""

else:

    @intrinsic
    def uncounted(_context: Any, array: types.Array) -> Any:
        """View of an array that numba does not count references to; something else has to keep the array alive.

        Numba counts the references that a call takes with an atomic operation per array, which for small
        groups costs more than the physics.
        """

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            view = context.make_helper(builder, signature.args[0], value=arguments[0])
            view.meminfo = cgutils.get_null_value(view.meminfo.type)
            return view._getvalue()  # noqa: SLF001 - numba's own way to take the value out

        return array(array), generate


@_inline
def group_of(contact: Contact, memory: Memory, index: int) -> Group:
    """View of one group; contact and memory have to outlive it."""
    start, stop = contact.first[index], contact.first[index + 1]
    return Group(
        uncounted(contact.gap)[start:stop],
        uncounted(contact.weight)[start:stop],
        uncounted(memory.dissipated)[start:stop],
        uncounted(memory.vertices)[index],
        contact.friction[index],
    )


# ---------------------------------------------------------------- normal load


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


@_inline
def load_at(gap: Floats, weight: Floats, approach: float) -> tuple[float, float]:
    """P(a) and P'(a) of asperities in ascending gap."""
    return load_and_slope(gap, weight, touching(gap, approach), approach)


@_exact
def label_at(gap: Floats, weight: Floats, total: float, guess: float, rigid: float, compliance: float) -> float:
    """Label a at which rigid·(a - h) + compliance·P(a), with the smallest gap h, is a total.

    Asperities stand in ascending gap. Newton on the power 2/3, bracketed.
    """
    low = gap[0]
    if total <= 0.0:
        return low
    # the deepest asperity alone would carry it here
    high = low + (total / (compliance * weight[0])) ** (2.0 / 3.0)
    if rigid > 0.0:
        high = min(high, low + total / rigid)
    elif gap.size == 1:
        return high
    approach = guess if low < guess <= high else high
    for _ in range(100):
        load, stiffness = load_at(gap, weight, approach)
        present, slope = rigid * (approach - gap[0]) + compliance * load, rigid + compliance * stiffness
        if present == total:
            return approach
        if present < total:
            low = approach
        else:
            high = approach
        step = 1.5 * present / slope * math.expm1(math.log1p((total - present) / present) * (2.0 / 3.0))
        following = approach + step
        if not low <= following <= high:
            following = 0.5 * (low + high)
            if following in (low, high):
                return following
        elif abs(step) <= 1e-10 * (following - gap[0]):
            # Newton squares the error, so this step was the last that matters
            return following
        approach = following
    return approach


@_exact
def approach_at(gap: Floats, weight: Floats, load: float, guess: float) -> float:
    """Approach at which asperities, in ascending gap, carry a load."""
    return label_at(gap, weight, load, guess, 0.0, 1.0)


# ---------------------------------------------------------------- energy


@_sums
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

    Slip and drag (the mean spring deflection while it slipped) are linear in the label, so the
    integrand over x = √(a - h) is a polynomial of fourth degree and three Gauss points are exact;
    no term is negative.
    """
    width = high - low
    if width <= 0.0:
        return 0.0
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
        energy[i] += e
        total += e
    return total


@_exact
def stored_energy(contact: Contact, memory: Memory, energy: Floats) -> float:
    """Elastic tangential energy ½ ∫ v² N'' da, added per asperity to ``energy``; returns the sum."""
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


# ---------------------------------------------------------------- one group, one straight path in (d, V)


@_inline
def to_displacement(displacement: float) -> Aim:
    """Go to a displacement."""
    return Aim(displacement, 1.0, 0.0)


@_inline
def to_load(force: float) -> Aim:
    """Go to a tangential load."""
    return Aim(force, 0.0, 1.0)


@_inline
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
def copy_vertices(source: Floats, target: Floats, count: int) -> None:
    """Copy the first vertices of a stack."""
    for j in range(count):
        for column in range(source.shape[1]):
            target[j, column] = source[j, column]


@_inline
def touch(group: Group, depth: int, d0: float, v0: float, d1: float, v1: float) -> int:
    """Start the empty stack of a group that first touches on a straight path from (d0, v0) to (d1, v1); its depth."""
    h = group.gap[0]
    anchor = v0 + (v1 - v0) * (h - d0) / (d1 - d0)
    put(group.stack, depth, h, anchor, 0.0, anchor, 0.0, 0.0)
    return depth + 1


@_inline
def edge_at(stack: Floats, depth: int, d: float, load: float) -> tuple[int, float, float, float, float]:
    """Where the polyline ends at approach d before any slip.

    Returns the index of its last segment, and label, anchor, normal and tangential load at the end.
    """
    top = depth - 1
    if d >= stack[top, LABEL]:
        return top, stack[top, LABEL], stack[top, ANCHOR], stack[top, NORMAL], stack[top, TANGENTIAL]
    while top > 1 and stack[top - 1, LABEL] >= d:
        top -= 1
    slope = stack[top, SLOPE]
    anchor = stack[top, ANCHOR] - slope * (stack[top, LABEL] - d)
    tangential = stack[top, TANGENTIAL] - slope * (stack[top, NORMAL] - load)
    return top, d, anchor, load, tangential


@_inline
def slip_front(
    stack: Floats,
    segment: int,
    x_edge: float,
    y_edge: float,
    x1: float,
    y1: float,
    friction: float,
    rigid: float,
    compliance: float,
) -> tuple[int, float, float, float]:
    """Walk from the edge inward to the slip front.

    The same walk serves every `Aim`: x is ``rigid`` times the label and ``compliance`` times the normal
    load, y the same of anchor and tangential load. Returns how many vertices are kept, x at the front, the
    direction of slip, and the slip at the front, which is 0 unless the whole contact slides. The front lies
    on the last vertex kept where x says so; vertices on the way are wiped out.
    """
    sign = 1.0 if y1 >= y_edge else -1.0
    tie = TIE * (abs(y1) + abs(y_edge) + friction * x1)
    x = x_edge
    slip = sign * (y1 - y_edge) - friction * (x1 - x_edge)
    met_vertex = x1 > x_edge and slip <= tie
    while segment > 0 and not met_vertex:
        slope = stack[segment, SLOPE]
        x_low = rigid * stack[segment - 1, LABEL] + compliance * stack[segment - 1, NORMAL]
        y_low = rigid * stack[segment - 1, ANCHOR] + compliance * stack[segment - 1, TANGENTIAL]
        slip_low = sign * (y1 - y_low) - friction * (x1 - x_low)
        if slip_low < -tie and slope != sign * friction:
            return segment, max(x - slip / (friction - sign * slope), x_low), sign, 0.0
        segment -= 1
        x, slip = x_low, slip_low
        met_vertex = slip <= tie
    if not met_vertex:
        return 0, x, sign, slip
    while segment > 0 and stack[segment, SLOPE] == sign * friction:
        segment -= 1
    return segment + 1, rigid * stack[segment, LABEL] + compliance * stack[segment, NORMAL], sign, 0.0


@_exact
def one_way_withdrawal(group: Group, low: float, high: float, slip_low: float, slip_high: float, rate: float) -> float:
    """Energy of leaving springs that slip one way: the drag falls to 0 in proportion to the slip left."""
    sign = 1.0 if slip_low + slip_high > 0.0 else -1.0
    # slip per withdrawal; 0 where the springs ride along the limit
    ratio = group.friction - sign * rate
    if ratio <= 0.0:
        return 0.0
    drag = 0.5 * group.friction / ratio
    slip_low, slip_high = abs(slip_low), abs(slip_high)
    return spread(
        group.gap, group.weight, group.dissipated, low, high, slip_low, slip_high, drag * slip_low, drag * slip_high
    )


@_exact
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


@_inline
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
            total += spread(group.gap, group.weight, group.dissipated, low, high, slip, slip_high, drag, drag_high)
        low, slip, drag = high, slip_high, drag_high
    return total


@_inline
def slip_group(
    group: Group,
    depth: int,
    d0: float,
    v0: float,
    d1: float,
    load: float,
    aim: Aim,
    segment: int,
    edge: float,
    kept: int,
    x_front: float,
    sign: float,
    slip: float,
) -> tuple[int, float, float]:
    """Do what is left of `move_group` where springs slip, the front being found: energy, and the new outer end."""
    stack = group.stack
    goal, rigid, compliance = aim
    slope = sign * group.friction
    below = max(kept - 1, 0)
    front, front_anchor = stack[below, LABEL], stack[below, ANCHOR]
    front_load, front_force = stack[below, NORMAL], stack[below, TANGENTIAL]
    inner = kept > 0 and x_front != rigid * front + compliance * front_load
    inner_slope = 0.0
    if inner:
        inner_slope = stack[kept, SLOPE]
        label = x_front
        if compliance > 0.0:
            outer = edge if kept == segment else stack[kept, LABEL]
            total = x_front - rigid * group.gap[0]
            label = min(max(label_at(group.gap, group.weight, total, outer, rigid, compliance), front), outer)
        normal, stiffness = (x_front, np.inf) if rigid == 0.0 else load_at(group.gap, group.weight, label)
        front_anchor += inner_slope * (label - front)
        front_force += inner_slope * (normal - front_load)
        front, front_load = label, normal
        # measured from what was prescribed, so that rounding does not add up from loop to loop within one another;
        # the one that changes faster along the polyline takes it up
        y_front = goal - slope * (rigid * (d1 - front) + compliance * (load - front_load))
        if rigid >= compliance * stiffness:
            front_anchor = y_front - compliance * front_force
        else:
            front_force = (y_front - rigid * front_anchor) / compliance
    v1 = goal if compliance == 0.0 else front_anchor + slope * (d1 - front) + rigid * sign * slip
    energy = 0.0
    if d1 < d0:
        energy = withdrawal_energy(group, depth, segment, d0, v0, d1, v1)
    energy += slip_energy(group, d0, v0, d1, v1, segment, edge, kept, front, sign, slip)
    if kept == 0:
        put(stack, below, front, v1 - slope * (d1 - front), 0.0, v1, 0.0, 0.0)
        kept = 1
    elif inner:
        put(stack, kept, front, front_anchor, inner_slope, v1, front_load, front_force)
        kept += 1
    reached = goal if rigid == 0.0 else front_force + slope * (load - front_load)
    put(stack, kept, d1, v1, slope, v1, load, reached)
    return kept + 1, v1, energy


@_inline
def first_reach(group: Group, d0: float, v0: float, d1: float, load: float, aim: Aim) -> float:
    """Displacement that a group reaches which first touches on its straight path from (d0, v0) to approach d1.

    All its springs are strained alike, or all slide.
    """
    if aim.compliance == 0.0:
        return aim.value
    slope = (aim.value - aim.rigid * v0) / (aim.rigid * (d1 - d0) + aim.compliance * load)
    if aim.rigid > 0.0 and abs(slope) > group.friction:
        return aim.value - aim.compliance * math.copysign(group.friction * load, slope)
    return v0 + slope * (d1 - d0)


@_inline
def move_group(
    group: Group, depth: int, d0: float, v0: float, d1: float, load: float, aim: Aim
) -> tuple[int, float, float]:
    """Carry one group straight from (d0, v0) to approach d1 and to where it aims, exactly.

    The group touches at d1, where it carries ``load``; its stack has ``depth`` vertices, or none at d0
    where that is 0. Returns the depth, the displacement reached, and the energy dissipated.
    """
    stack, friction = group.stack, group.friction
    y1, rigid, compliance = aim
    if depth == 0:
        depth = touch(group, depth, d0, v0, d1, first_reach(group, d0, v0, d1, load, aim))
    segment, edge, anchor, edge_load, edge_force = edge_at(stack, depth, d1, load)
    x1, x_edge = rigid * d1 + compliance * load, rigid * edge + compliance * edge_load
    y_edge = rigid * anchor + compliance * edge_force
    change, hold = abs(y1 - y_edge), friction * (x1 - x_edge)
    tie = TIE * (abs(y1) + abs(y_edge) + friction * x1)
    # at the edge itself rounding is no reason to slip; new springs slip when they tie with the limit
    if y1 == y_edge or (change <= tie if hold == 0.0 else change < hold - tie):
        energy = 0.0
        slope = (y1 - y_edge) / (x1 - x_edge) if x1 > x_edge else 0.0
        v1 = y1 if compliance == 0.0 else anchor + slope * (d1 - edge)
        if d1 < d0:
            energy = withdrawal_energy(group, depth, segment, d0, v0, d1, v1)
            put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
            depth = segment + 1
        elif d1 > edge:
            top = segment if segment > 0 and stack[segment, SLOPE] == slope else segment + 1
            reached = y1 if rigid == 0.0 else edge_force + slope * (load - edge_load)
            put(stack, top, d1, v1, slope, v1, load, reached)
            depth = top + 1
        return depth, v1, energy
    kept, x_front, sign, slip = slip_front(stack, segment, x_edge, y_edge, x1, y1, friction, rigid, compliance)
    return slip_group(group, depth, d0, v0, d1, load, aim, segment, edge, kept, x_front, sign, slip)


@_inline
def force_of_group(
    group: Group, depth: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> tuple[float, float, float]:
    """Tangential force that `move_group` would reach, with its first and second derivative in v1.

    Nothing is changed, but for the first vertex of a group that does not touch yet.
    """
    stack, friction = group.stack, group.friction
    if depth == 0:
        depth = touch(group, depth, d0, v0, d1, v1)
    segment, edge, anchor, edge_load, edge_force = edge_at(stack, depth, d1, load)
    if d1 > edge and abs(v1 - anchor) <= friction * (d1 - edge):
        slope = (v1 - anchor) / (d1 - edge)
        return edge_force + slope * (load - edge_load), (load - edge_load) / (d1 - d0), 0.0
    if v1 == anchor:
        return edge_force, load_at(group.gap, group.weight, edge)[1], 0.0
    kept, front, sign, _ = slip_front(stack, segment, edge, anchor, d1, v1, friction, 1.0, 0.0)
    slope = sign * friction
    if kept == 0:
        return slope * load, 0.0, 0.0
    front_load, stiffness = load_at(group.gap, group.weight, front)
    force, curvature = stack[kept - 1, TANGENTIAL], 0.0
    if front != stack[kept - 1, LABEL]:
        inner_slope = stack[kept, SLOPE]
        force += inner_slope * (front_load - stack[kept - 1, NORMAL])
        # a single parabola through the foremost asperity stands for P'' here: only the speed depends on it
        curvature = 0.5 * stiffness / ((front - group.gap[0]) * (inner_slope - slope))
    return force + slope * (load - front_load), stiffness, curvature


# ---------------------------------------------------------------- polylines steeper than the cone


@_exact
def is_steep(stack: Floats, depth: int, friction: float) -> bool:
    """Whether a slope exceeds μ, as it may after a fall of μ; several zones may then slip at once."""
    steepest = 0.0
    for j in range(1, depth):
        steepest = max(steepest, abs(stack[j, SLOPE]))
    return steepest > friction


@_exact
def carried(group: Group, depth: int, d1: float, v1: float, load: float) -> Floats:
    """Polyline of a touching group carried straight to (d1, v1) before any slip: cut, or extended by new springs."""
    segment, edge, anchor, edge_load, edge_force = edge_at(group.stack, depth, d1, load)
    stack = np.empty((segment + 2, group.stack.shape[1]))
    copy_vertices(group.stack, stack, segment + 1)
    if d1 <= edge:
        put(stack, segment, d1, anchor, stack[segment, SLOPE], v1, load, edge_force)
        return stack[: segment + 1]
    slope = (v1 - anchor) / (d1 - edge)
    put(stack, segment + 1, d1, v1, slope, v1, load, edge_force + slope * (load - edge_load))
    return stack


@_exact
def crossing(low: float, high: float, v_low: float, v_high: float, d: float, side: float) -> float:
    """Label where v, straight from v_low to v_high, crosses side·(d - a); ``high`` where that is not inside."""
    over_low, over_high = v_low - side * (d - low), v_high - side * (d - high)
    tie = TIE * (abs(v_low) + abs(side) * d)
    if over_low * over_high >= 0.0 or min(abs(over_low), abs(over_high)) <= tie:
        return high
    return low + (high - low) * over_low / (over_low - over_high)


@_exact
def clip(
    group: Group,
    stack: Floats,
    d: float,
    displacement: float,
    friction: float,
    lag_down: float,
    lag_up: float,
    dissipates: bool,
) -> tuple[Floats, float, float]:
    """Clip any polyline to the cone |v| ≤ μ (d - a): both sides may cut, anywhere.

    The drag of a spring that slips by g is the limit less lag·g, with the lag of its direction.
    Returns the new stack, its stiffness dT/dV, and the energy dissipated, which where ``dissipates``
    is added to the asperities of the group.
    """
    clipped = np.empty((3 * len(stack), stack.shape[1]))
    copy_vertices(stack, clipped, min(len(stack), 1))
    limit = friction * (d - stack[0, LABEL])
    v = displacement - stack[0, ANCHOR]
    if abs(v) > limit:
        clipped[0, ANCHOR] = displacement - math.copysign(limit, v)
    count = 1
    stiffness, dissipated = 0.0, 0.0
    for j in range(1, len(stack)):
        slope, low, high = stack[j, SLOPE], stack[j - 1, LABEL], stack[j, LABEL]
        v_low, v_high = displacement - stack[j - 1, ANCHOR], displacement - stack[j, ANCHOR]
        lower = crossing(low, high, v_low, v_high, d, -friction)
        upper = crossing(low, high, v_low, v_high, d, friction)
        for piece in range(3):
            a = low if piece == 0 else min(lower, upper) if piece == 1 else max(lower, upper)
            b = high if piece == 2 else max(lower, upper) if piece == 1 else min(lower, upper)
            if b <= a:
                continue
            v_a, v_b = v_low - slope * (a - low), v_low - slope * (b - low)
            limit_a, limit_b = friction * (d - a), friction * (d - b)
            load = stack[j, NORMAL] if b == high else load_at(group.gap, group.weight, b)[0]
            made_at, new_slope, v = displacement, slope, v_b
            if abs(v_a + v_b) > limit_a + limit_b:
                side = math.copysign(1.0, v_a + v_b)
                new_slope, v = side * friction, side * limit_b
                if dissipates:
                    lag = lag_up if side > 0.0 else lag_down
                    slip_a, slip_b = max(side * v_a - limit_a, 0.0), max(side * v_b - limit_b, 0.0)
                    drag_a, drag_b = max(limit_a - lag * slip_a, 0.0), max(limit_b - lag * slip_b, 0.0)
                    dissipated += spread(
                        group.gap, group.weight, group.dissipated, a, b, slip_a, slip_b, drag_a, drag_b
                    )
            else:
                stiffness += load_at(group.gap, group.weight, b)[1] - load_at(group.gap, group.weight, a)[1]
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
    group: Group, depth: int, d0: float, v0: float, d1: float, v1: float, load: float
) -> tuple[int, float]:
    """Carry one touching group whose polyline is steeper than μ straight to (d1, v1); its depth, and the energy."""
    stack = carried(group, depth, d1, v1, load)
    friction = group.friction
    energy = 0.0
    if d1 < d0:
        energy = withdrawal_energy(group, depth, len(stack) - 1, d0, v0, d1, v1)
    up, down = (v1 - v0) - friction * (d1 - d0), (v0 - v1) - friction * (d1 - d0)
    lag_up = 0.5 * friction * (d1 - d0) / up if up > 0.0 else 0.0
    lag_down = 0.5 * friction * (d1 - d0) / down if down > 0.0 else 0.0
    clipped, _, slipped = clip(group, stack, d1, v1, friction, lag_down, lag_up, depth > 0)
    copy_vertices(clipped, group.stack, len(clipped))
    return len(clipped), energy + slipped


# ---------------------------------------------------------------- all groups


@_inline
def toward(present: float, target: float, fraction: float) -> float:
    """Point a fraction of the way from where a channel is to its target; the target itself at the end."""
    return target if fraction == 1.0 else present + fraction * (target - present)


@_exact
def deepest(memory: Memory) -> int:
    """Return the number of vertices of the deepest stack; the groups that touch are the first ones."""
    most = 0
    for index in range(memory.depth.size):
        if memory.depth[index] == 0:
            break
        most = max(most, memory.depth[index])
    return most


@_exact
def stacks_with_room(memory: Memory, room: int) -> Floats:
    """Copy the stacks to an array with room for so many vertices each."""
    vertices = np.empty((memory.vertices.shape[0], room, memory.vertices.shape[2]))
    for index in range(memory.depth.size):
        copy_vertices(memory.vertices[index], vertices[index], memory.depth[index])
    return vertices


@_exact
def grown(memory: Memory, room: int) -> Memory:
    """Return the memory with room for so many vertices in each stack; the other arrays are the same ones."""
    return Memory(stacks_with_room(memory, room), memory.depth, memory.steep, memory.dissipated, memory.now)


@_exact
def copied(memory: Memory) -> Memory:
    """Return an independent copy, with room for the next step."""
    vertices = stacks_with_room(memory, deepest(memory) + 2)
    return Memory(vertices, memory.depth.copy(), memory.steep.copy(), memory.dissipated.copy(), memory.now.copy())


@_exact
def friction_limit(contact: Contact, approach: float, load: float) -> float:
    """Σ μ P(a): the largest tangential load that the contact carries, where it carries the normal load ``load``."""
    if contact.friction.size == 1:
        return contact.friction[0] * load
    limit = 0.0
    for index in range(contact.friction.size):
        start, stop = contact.first[index], contact.first[index + 1]
        gap = uncounted(contact.gap)[start:stop]
        if gap[0] >= approach:
            break
        limit += contact.friction[index] * load_at(gap, uncounted(contact.weight)[start:stop], approach)[0]
    return limit


@_exact
def total_force(contact: Contact, memory: Memory) -> float:
    """Sum of the groups' tangential loads."""
    force = 0.0
    for index in range(contact.friction.size):
        if memory.depth[index] == 0:
            break
        force += memory.vertices[index, memory.depth[index] - 1, TANGENTIAL]
    return force


@_exact
def force_at(contact: Contact, memory: Memory, shares: Floats, d1: float, v1: float) -> tuple[float, float, float]:
    """Tangential load at the end of a straight path to (d1, v1), with its first and second derivative in v1."""
    d0, v0 = memory.now[APPROACH], memory.now[DISPLACEMENT]
    force, stiffness, curvature = 0.0, 0.0, 0.0
    for index in range(shares.size):
        group, depth = group_of(contact, memory, index), memory.depth[index]
        if memory.steep[index] and depth > 0:
            stack = carried(group, depth, d1, v1, shares[index])
            clipped, slope, _ = clip(group, stack, d1, v1, group.friction, 0.0, 0.0, depth < 0)
            part, bend = clipped[len(clipped) - 1, TANGENTIAL], 0.0
        else:
            part, slope, bend = force_of_group(group, depth, d0, v0, d1, v1, shares[index])
        force += part
        stiffness += slope
        curvature += bend
    return force, stiffness, curvature


@_exact
def group_loads(contact: Contact, approach: float) -> Floats:
    """Return the normal loads of the groups that touch, which are the first ones."""
    count = 0
    while count < contact.friction.size and contact.gap[contact.first[count]] < approach:
        count += 1
    loads = np.empty(count)
    for index in range(count):
        start, stop = contact.first[index], contact.first[index + 1]
        loads[index] = load_at(uncounted(contact.gap)[start:stop], uncounted(contact.weight)[start:stop], approach)[0]
    return loads


@_exact
def next_guess(
    v: float, missing: float, stiffness: float, curvature: float, low: float, high: float, stride: float
) -> float:
    """Newton's step from v, corrected for curvature (Halley), inside the bracket and no longer than a stride."""
    step = missing / stiffness if stiffness > 0.0 else np.inf
    bend = 0.5 * curvature * step / stiffness if stiffness > 0.0 else np.inf
    if abs(bend) < 0.25:
        step /= 1.0 + bend
    following = v + step
    if not low < following < high:
        following = 0.5 * (low + high)
    if not abs(following - v) <= stride:
        following = v + math.copysign(stride, missing)
    return following


@_exact
def displacement_at(contact: Contact, memory: Memory, shares: Floats, d1: float, aim: Aim) -> float:
    """Displacement at which a straight path in (d, V) to approach d1 ends where it aims.

    Where nothing touches at d1, a load leaves V at the anchor of the last spring to leave, which is one of the
    highest summit. A load at the friction limit is met by the least displacement, to rounding, at which all groups
    slide; a request beyond the limit is noted in ``memory.now``.
    """
    now = memory.now
    goal, rigid, compliance = aim
    if shares.size == 0 and rigid > 0.0:
        return goal
    if shares.size == 0:
        return memory.vertices[0, 0, ANCHOR] if memory.depth[0] > 0 else now[DISPLACEMENT]
    limit = 0.0
    for index in range(shares.size):
        limit += contact.friction[index] * shares[index]
    reach, stride = contact.friction.max() * d1, np.inf
    if rigid == 0.0:
        if abs(goal) > limit * (1.0 + LIMIT_SLACK):
            now[REQUEST], now[LIMIT] = goal, limit
        goal = min(max(goal, -limit), limit)
        # what slides has no stiffness to tell how far
        stride = reach
    scale = rigid * abs(goal) + compliance * limit
    accuracy = 4.0 * EPSILON * scale
    low, high = -np.inf, np.inf
    v = now[DISPLACEMENT]
    if d1 == now[APPROACH] and abs(goal - rigid * v - compliance * total_force(contact, memory)) <= TIE * scale:
        # held: rounding is no reason to move
        return v
    change = goal - rigid * v - compliance * now[TANGENTIAL_LOAD]
    if change != 0.0:
        # a little on the way, so that the first stiffness is that of the direction in which it goes
        v += math.copysign(1e-9 * reach, change)
    for _ in range(200):
        force, stiffness, curvature = force_at(contact, memory, shares, d1, v)
        missing = goal - rigid * v - compliance * force
        if abs(missing) <= accuracy:
            return v
        if missing > 0.0:
            low = v
        else:
            high = v
        slope, bend = rigid + compliance * stiffness, compliance * curvature
        following = next_guess(v, missing, slope, bend, low, high, stride)
        if following in (low, high, v):
            return v
        v = following
    return v


@_exact
def move(contact: Contact, memory: Memory, d1: float, load: float, aim: Aim) -> Memory:
    """Carry all groups straight in (d, V) to approach d1, where they carry ``load``, and to where they aim.

    A tangential load has to be within the friction limit.
    """
    room = memory.vertices.shape[1]
    # a front and an edge; a polyline steeper than μ may be cut in every segment
    needed = 3 * deepest(memory) + 6 if memory.steep.any() else deepest(memory) + 2
    if needed > room:
        memory = grown(memory, 2 * needed)
    now, groups = memory.now, contact.friction.size
    d0, v0 = now[APPROACH], now[DISPLACEMENT]
    shares = group_loads(contact, d1) if groups > 1 else np.full(1 if d1 > 0.0 else 0, load)
    alone = groups == 1 and shares.size > 0 and not memory.steep[0]
    path = aim if alone or aim.compliance == 0.0 else to_displacement(displacement_at(contact, memory, shares, d1, aim))
    v1 = path.value
    still = d1 == d0 and v1 == v0 and path.compliance == 0.0
    for index in range(groups):
        depth = memory.depth[index]
        if still or (index >= shares.size and depth == 0):
            break
        group = group_of(contact, memory, index)
        if index >= shares.size:
            energy = withdrawal_energy(group, depth, 1, d0, v0, d1, v1)
            memory.depth[index] = 0
            memory.steep[index] = False
        elif memory.steep[index]:
            memory.depth[index], energy = move_steep_group(group, depth, d0, v0, d1, v1, shares[index])
            memory.steep[index] = is_steep(group.stack, memory.depth[index], group.friction)
        else:
            memory.depth[index], v1, energy = move_group(group, depth, d0, v0, d1, shares[index], path)
        now[DISSIPATED] += energy
    now[APPROACH] = d1
    now[DISPLACEMENT] = v1
    now[NORMAL_LOAD] = load
    now[TANGENTIAL_LOAD] = aim.value if aim.rigid == 0.0 else total_force(contact, memory)
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


# ---------------------------------------------------------------- a change of friction


@_exact
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


@_exact
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


# ---------------------------------------------------------------- projections


@_inline
def stick_boundary(stack: Floats, depth: int, friction: float) -> float:
    """Label where the slip annulus ends: the edge where nothing slips."""
    slips = abs(stack[depth - 1, SLOPE]) == friction
    return stack[depth - 2, LABEL] if slips else stack[depth - 1, LABEL]


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
    stiffness, limit = 0.0, 0.0
    for index in range(contact.friction.size):
        if memory.depth[index] == 0:
            break
        group = group_of(contact, memory, index)
        boundary = stick_boundary(group.stack, memory.depth[index], group.friction)
        stiffness += load_at(group.gap, group.weight, boundary)[1]
        limit += group.friction * group.stack[memory.depth[index] - 1, NORMAL]
    totals[ROW_NORMAL] = now[NORMAL_LOAD] * units.load
    totals[ROW_TANGENTIAL] = now[TANGENTIAL_LOAD] * units.load
    totals[ROW_APPROACH] = approach * units.length
    totals[ROW_DISPLACEMENT] = now[DISPLACEMENT] * units.displacement
    totals[ROW_COUNT] = count
    totals[ROW_AREA] = nominal_area(contact.sorted_gap, contact.sorted_weight, count, approach) * units.area
    totals[ROW_STIFFNESS] = stiffness * units.stiffness
    totals[ROW_DISSIPATED] = now[DISSIPATED] * units.energy
    totals[ROW_LIMIT] = limit * units.load
    totals[ROW_SATURATED] = 1.0 if saturated else 0.0


@_sums
def superpose(gap: Floats, weight: Floats, label: float, jump: float, force: Floats) -> None:
    """Add jump·N(label) to the tangential force of asperities in ascending gap."""
    for i in range(touching(gap, label)):
        depth = label - gap[i]
        force[i] += jump * weight[i] * depth * math.sqrt(depth)


@_sums
def project(
    gap: Floats,
    weight: Floats,
    approach: float,
    boundary: float,
    friction: float,
    slope: float,
    force: Floats,
    normal: Floats,
    radius: Floats,
    stick: Floats,
    state: Floats,
) -> None:
    """Fill in loads, radii and slip state of touching asperities.

    ``force`` holds the share of the tangential load that the inner vertices have, and gets that of the edge,
    whose slope is given; rounding does not carry it beyond the limit.
    """
    for i in range(force.size):
        own = approach - gap[i]
        x = math.sqrt(own)
        load = weight[i] * own * x
        limit = friction * load
        slip = 1.0 * PARTIAL_SLIP if boundary > gap[i] else 1.0 * GROSS_SLIP
        force[i] = min(max(force[i] + slope * load, -limit), limit)
        normal[i] = load
        radius[i] = weight[i] * x
        stick[i] = weight[i] * math.sqrt(max(boundary - gap[i], 0.0))
        state[i] = 1.0 * FULL_STICK if boundary == approach else slip


@_exact
def record_asperities(
    contact: Contact, memory: Memory, rows: Rows, row: int, columns: Integers, units: Units, work: Floats
) -> None:
    """Project the state onto one row of per-asperity variables."""
    approach = memory.now[APPROACH]
    for index in range(contact.friction.size):
        depth, start = memory.depth[index], contact.first[index]
        if depth == 0:
            break
        group = group_of(contact, memory, index)
        gap, weight, stack, view = group.gap, group.weight, group.stack, uncounted(work)
        end = start + touching(gap, approach)
        force = view[0, start:end]
        for i in range(force.size):
            force[i] = 0.0
        for j in range(1, depth - 1):
            superpose(gap, weight, stack[j, LABEL], stack[j, SLOPE] - stack[j + 1, SLOPE], force)
        boundary = stick_boundary(stack, depth, group.friction)
        project(
            gap,
            weight,
            approach,
            boundary,
            group.friction,
            stack[depth - 1, SLOPE],
            force,
            view[1, start:end],
            view[2, start:end],
            view[3, start:end],
            view[4, start:end],
        )
    for c in range(columns.size):
        i = columns[c]
        rows.dissipated[row, c] = memory.dissipated[i] * units.energy
        touches = contact.gap[i] < approach
        rows.tangential_load[row, c] = work[0, i] * units.load if touches else 0.0
        rows.normal_load[row, c] = work[1, i] * units.load if touches else 0.0
        rows.contact_radius[row, c] = work[2, i] * units.radius if touches else 0.0
        rows.stick_radius[row, c] = work[3, i] * units.radius if touches else 0.0
        rows.slip_state[row, c] = np.int8(work[4, i]) if touches else SEPARATED


# ---------------------------------------------------------------- paths


@_exact
def destination(contact: Contact, memory: Memory, paths: Paths, p: int, compliance: float) -> tuple[float, float, Aim]:
    """Where a path goes: approach, normal load, and the aim of the tangential channel."""
    now = memory.now
    if paths.normal_control[p] == LOAD:
        load = toward(now[NORMAL_LOAD], paths.normal_target[p], paths.normal_fraction[p])
        d = approach_for(contact, memory, load)
    else:
        d = toward(now[APPROACH], paths.normal_target[p], paths.normal_fraction[p])
        load = load_at(contact.sorted_gap, contact.sorted_weight, d)[0]
    target, fraction = paths.tangential_target[p], paths.tangential_fraction[p]
    if paths.tangential_control[p] == LOAD:
        return d, load, to_load(toward(now[TANGENTIAL_LOAD], target, fraction))
    present = now[DISPLACEMENT] + compliance * now[TANGENTIAL_LOAD]
    return d, load, Aim(toward(present, target, fraction), 1.0, compliance)


@_exact
def ramp_part(
    contact: Contact,
    memory: Memory,
    loads: tuple[float, float],
    forces: tuple[float, float],
    limits: tuple[float, float],
    before: float,
    share: float,
    tolerance: float,
) -> tuple[Memory, bool]:
    """Walk from one share of a straight path in both loads to another, holding the tangential load within the limit.

    Loads, tangential loads asked for and friction limits are those at both ends of the whole path.
    Returns whether the load is held at the limit at the end.
    """
    aim, limit = toward(forces[0], forces[1], share), toward(limits[0], limits[1], share)
    held = abs(aim) > limit * (1.0 + LIMIT_SLACK)
    if held:
        sign = math.copysign(1.0, forces[1])
        short, over = sign * forces[0] - limits[0], sign * forces[1] - limits[1]
        bend = short / (short - over) if short < 0.0 < over else 0.0
        if before < bend < share:
            met = toward(forces[0], forces[1], bend)
            memory = ramp(contact, memory, toward(loads[0], loads[1], bend), met, tolerance)
    aim = min(max(aim, -limit), limit)
    return ramp(contact, memory, toward(loads[0], loads[1], share), aim, tolerance), held


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
    compliance: float,
) -> tuple[Memory, int, float, float]:
    """Walk paths one after the other and record their rows; ``columns`` gives each column's asperity.

    Displacements of the tangential channel are those of a drive behind a spring of a compliance; with 0, the
    contact's. Returns the memory, and the path that asks for more than the friction limit with the request and
    the limit (dimensionless); the memory is then of no use. The path is -1 where all could be walked.
    """
    work = np.zeros((5, contact.gap.size if columns.size > 0 else 0))
    flag = False
    for p in range(paths.parts.size):
        now = memory.now
        parts = paths.parts[p]
        load0, force0, d0, v0 = now[NORMAL_LOAD], now[TANGENTIAL_LOAD], now[APPROACH], now[DISPLACEMENT]
        d1, load, aim = destination(contact, memory, paths, p, compliance)
        request, by_force = aim.value, aim.rigid == 0.0
        limit0 = friction_limit(contact, d0, load0) if by_force and saturate else np.inf
        limit = friction_limit(contact, d1, load) if by_force else np.inf
        held = by_force and abs(request) > limit * (1.0 + LIMIT_SLACK)
        if held and not saturate:
            return memory, p, request, limit
        force = min(max(request, -limit), limit)
        if by_force:
            aim = to_load(force)
        loads = paths.normal_control[p] == LOAD and by_force
        v1 = aim.value
        if aim.compliance > 0.0 and parts > 1 and not loads:
            v1 = displacement_at(contact, memory, group_loads(contact, d1), d1, aim)
        for part in range(1, parts + 1):
            share = part / parts
            held_now = held and part == parts
            if loads and saturate:
                before, ends = (part - 1) / parts, (limit0, limit)
                memory, held_now = ramp_part(
                    contact, memory, (load0, load), (force0, request), ends, before, share, tolerance
                )
            elif loads:
                memory = ramp(contact, memory, toward(load0, load, share), toward(force0, force, share), tolerance)
            else:
                d = toward(d0, d1, share)
                step_load = load if d == d1 else load_at(contact.sorted_gap, contact.sorted_weight, d)[0]
                step = aim if part == parts else to_displacement(toward(v0, v1, share))
                memory = move(contact, memory, d, step_load, step)
            if memory.now[LIMIT] > 0.0 and not saturate:
                return memory, p, memory.now[REQUEST], memory.now[LIMIT]
            memory.now[LIMIT] = 0.0
            # several paths may lead to one row
            flag = flag or held_now
            if part < parts or paths.recorded[p]:
                row = paths.first_row[p] + part - 1
                record_totals(contact, memory, rows.totals[row], units, flag)
                flag = False
                if columns.size > 0:
                    record_asperities(contact, memory, rows, row, columns, units, work)
    return memory, -1, 0.0, 0.0
