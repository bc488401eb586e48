"""From the memory to recorded rows: it is only read."""

import math

import numpy as np

from historysim.memory.compiled import compiled, entry, fused, reordered, short
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    LABEL,
    NORMAL,
    NORMAL_LOAD,
    SLOPE,
    TANGENTIAL_LOAD,
    Bytes,
    Contact,
    Floats,
    Group,
    Integers,
    Memory,
    Units,
)
from historysim.memory.lean import lean, uncounted
from historysim.memory.normal import touching
from historysim.memory.pending import Pending, set_aside
from historysim.memory.rows import (
    FULL_STICK,
    GROSS_SLIP,
    PARTIAL_SLIP,
    ROW_APPROACH,
    ROW_AREA,
    ROW_COUNT,
    ROW_DISPLACEMENT,
    ROW_DISSIPATED,
    ROW_LIMIT,
    ROW_NORMAL,
    ROW_SATURATED,
    ROW_STIFFNESS,
    ROW_TANGENTIAL,
    ROW_TRACTION_RATIO,
    SEPARATED,
    Columns,
    Rows,
    Scratch,
)
from historysim.memory.slip import largest_traction_ratio, slip_zones, sticking_stiffness
from historysim.memory.stacks import fill, group_of


@reordered
def real_area(gap: Floats, weight: Floats, count: int, approach: float) -> float:
    """Σ k² (a - h), the real contact area over π."""
    area = 0.0
    for i in range(count):
        area += weight[i] * weight[i] * (approach - gap[i])
    return area


@compiled
def record_totals(contact: Contact, memory: Memory, totals: Floats, units: Units, saturated: bool) -> None:
    """Project the state onto one row of totals, but for those that `record_sums` writes down."""
    now = memory.now
    limit, traction_ratio = 0.0, 1.0
    for index in range(contact.friction.size):
        if memory.depth[index] == 0:
            break
        group = group_of(contact, memory, index)
        if memory.steep[index]:
            largest = largest_traction_ratio(group.stack, memory.depth[index], group.friction)
            traction_ratio = max(traction_ratio, largest)
        limit += group.friction * group.stack[memory.depth[index] - 1, NORMAL]
    totals[ROW_NORMAL] = now[NORMAL_LOAD] * units.load
    totals[ROW_TANGENTIAL] = now[TANGENTIAL_LOAD] * units.load
    totals[ROW_APPROACH] = now[APPROACH] * units.length
    totals[ROW_DISPLACEMENT] = now[DISPLACEMENT] * units.displacement
    totals[ROW_DISSIPATED] = now[DISSIPATED] * units.energy
    totals[ROW_LIMIT] = limit * units.load
    totals[ROW_SATURATED] = 1.0 if saturated else 0.0
    totals[ROW_TRACTION_RATIO] = traction_ratio


@short
def record_sums(contact: Contact, memory: Memory, totals: Floats, units: Units) -> None:
    """Write down the totals of one row that are sums over all asperities, which the walk does not need."""
    approach = memory.now[APPROACH]
    count = touching(contact.sorted_gap, approach)
    totals[ROW_COUNT] = count
    totals[ROW_AREA] = real_area(contact.sorted_gap, contact.sorted_weight, count, approach) * units.area
    totals[ROW_STIFFNESS] = sticking_stiffness(contact, memory, 0.0) * units.stiffness


@reordered
def superpose(gap: Floats, weight: Floats, label: float, jump: float, force: Floats) -> None:
    """Add jump·N(label) to the tangential force of asperities in ascending gap."""
    for i in range(touching(gap, label)):
        depth = label - gap[i]
        force[i] += jump * weight[i] * depth * math.sqrt(depth)


@short
def inner_forces(group: Group, depth: int, force: Floats) -> None:
    """Fill in the share of their tangential loads that the inner vertices of their group give its asperities."""
    stack = group.stack
    fill(force, 0.0)
    for j in range(1, depth - 1):
        superpose(group.gap, group.weight, stack[j, LABEL], stack[j, SLOPE] - stack[j + 1, SLOPE], force)


@short
def in_units(value: float, unit: float, touches: bool) -> float:
    """Return a value in a unit, which is rounded once more, and 0 where an asperity does not touch."""
    return value * unit if touches else 0.0


@fused
def project(
    gap: Floats,
    weight: Floats,
    approach: float,
    boundary: float,
    outermost: float,
    friction: float,
    slope: float,
    units: Units,
    force: Floats,
    normal: Floats,
    radius: Floats,
    stick: Floats,
    state: Bytes,
) -> None:
    """Fill in loads, radii and slip state of asperities in any order.

    The slip annulus at the edge ends at the label ``boundary``; the outermost spring that slides has ``outermost``.
    ``force`` holds the share of the tangential load that the inner vertices have, dimensionless, and gets that of the
    edge, whose slope is given; rounding does not carry it beyond the limit.
    """
    for i in range(force.size):
        touches = gap[i] < approach
        own = max(approach - gap[i], 0.0)
        x = math.sqrt(own)
        load = x * own * weight[i]
        limit = friction * abs(load)
        share = min(max(force[i] + slope * load, -limit), limit)
        slip = PARTIAL_SLIP if boundary > gap[i] else GROSS_SLIP
        slip = slip if outermost > gap[i] else FULL_STICK
        force[i] = in_units(share, units.load, touches)
        normal[i] = in_units(load, units.load, touches)
        radius[i] = in_units(weight[i] * x, units.radius, touches)
        stick[i] = in_units(weight[i] * math.sqrt(max(boundary - gap[i], 0.0)), units.radius, touches)
        state[i] = np.int8(slip if touches else SEPARATED)


@short
def record_energies(memory: Memory, rows: Rows, row: int, columns: Columns, units: Units) -> None:
    """Write down what each recorded asperity has dissipated."""
    for c in range(columns.place.size):
        rows.dissipated[row, c] = memory.dissipated[columns.place[c]] * units.energy


@short
def in_columns(force: Floats, place: Integers, target: Floats) -> None:
    """Fill in forces of asperities in the order of the columns; those that stand behind the last have none."""
    for c in range(place.size):
        target[c] = force[place[c]] if place[c] < force.size else 0.0


@entry
def record_asperities(
    contact: Contact, memory: Memory, rows: Rows, row: int, columns: Columns, units: Units, work: Scratch
) -> None:
    """Project the state onto one row of per-asperity variables, but for the energies.

    Several groups are projected one by one, and then put in the order of the columns. One alone is projected in that
    order, straight into the row, which takes half as long.
    """
    contact, memory, rows = lean(contact), uncounted(lean(memory)), lean(rows)
    columns, work = lean(columns), lean(work)
    approach, numbers, state = memory.now[APPROACH], work.numbers, work.state
    alone = contact.friction.size == 1
    for index in range(contact.friction.size):
        depth, start = memory.depth[index], contact.first[index]
        if depth == 0:
            break
        group = group_of(contact, memory, index)
        gap, weight, stack, end = group.gap, group.weight, group.stack, start + touching(group.gap, approach)
        force, normal = numbers[0, start:end], numbers[1, start:end]
        radius, stick, slip = numbers[2, start:end], numbers[3, start:end], state[start:end]
        inner_forces(group, depth, force)
        if alone:
            reached = touching(gap, stack[max(depth - 2, 0), LABEL])
            in_columns(force[0:reached], columns.place, rows.tangential_load[row])
            gap, weight = columns.gap, columns.weight
            force, normal = rows.tangential_load[row], rows.normal_load[row]
            radius, stick, slip = rows.contact_radius[row], rows.stick_radius[row], rows.slip_state[row]
        displacement = memory.now[DISPLACEMENT]
        boundary, outermost = slip_zones(stack, depth, displacement, group.friction, memory.steep[index])
        slope = stack[depth - 1, SLOPE]
        project(
            gap,
            weight,
            approach,
            boundary,
            outermost,
            group.friction,
            slope,
            units,
            force,
            normal,
            radius,
            stick,
            slip,
        )
    if alone and memory.depth[0] > 0:
        return
    for c in range(columns.place.size):
        i = columns.place[c]
        touches = columns.gap[c] < approach
        rows.tangential_load[row, c] = numbers[0, i] if touches else 0.0
        rows.normal_load[row, c] = numbers[1, i] if touches else 0.0
        rows.contact_radius[row, c] = numbers[2, i] if touches else 0.0
        rows.stick_radius[row, c] = numbers[3, i] if touches else 0.0
        rows.slip_state[row, c] = state[i] if touches else SEPARATED


@entry
def record_row(
    contact: Contact,
    memory: Memory,
    rows: Rows,
    row: int,
    pending: Pending,
    columns: Columns,
    units: Units,
    saturated: bool,
    work: Scratch,
) -> None:
    """Project the state onto one row, or leave most of that for later where there is room for what it takes."""
    contact, memory, rows, pending = lean(contact), uncounted(lean(memory)), lean(rows), lean(pending)
    columns, work = lean(columns), lean(work)
    record_totals(contact, memory, rows.totals[row], units, saturated)
    record_energies(memory, rows, row, columns, units)
    if not set_aside(memory, pending, row):
        record_sums(contact, memory, rows.totals[row], units)
        if columns.place.size > 0:
            record_asperities(contact, memory, rows, row, columns, units, work)


@entry
def record_pending(
    contact: Contact, pending: Pending, rows: Rows, columns: Columns, units: Units, work: Scratch
) -> None:
    """Project what was left for later of all rows."""
    contact, pending, rows, columns, work = lean(contact), lean(pending), lean(rows), lean(columns), lean(work)
    for row in range(pending.waits.size):
        if pending.waits[row]:
            # the energies are in the rows already, so that any array will do for them
            unused, now = work.numbers[0], pending.now[row]
            memory = Memory(pending.vertices[row], pending.depth[row], pending.steep[row], unused, now)
            record_sums(contact, memory, rows.totals[row], units)
            record_asperities(contact, memory, rows, row, columns, units, work)
