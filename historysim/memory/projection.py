"""From the memory to recorded rows: it is only read."""

import math

import numpy as np

from historysim.memory.compiled import compiled, entry, reordered, short
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    LABEL,
    NORMAL,
    NORMAL_LOAD,
    SLOPE,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
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
    Rows,
)
from historysim.memory.slip import largest_traction_ratio, slip_zones, sticking_stiffness
from historysim.memory.stacks import group_of


@reordered
def real_area(gap: Floats, weight: Floats, count: int, approach: float) -> float:
    """Σ k² (a - h), the real contact area over π."""
    area = 0.0
    for i in range(count):
        area += weight[i] * weight[i] * (approach - gap[i])
    return area


@compiled
def record_totals(contact: Contact, memory: Memory, totals: Floats, units: Units, saturated: bool) -> None:
    """Project the state onto one row of totals."""
    now = memory.now
    approach = now[APPROACH]
    count = touching(contact.sorted_gap, approach)
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
    totals[ROW_APPROACH] = approach * units.length
    totals[ROW_DISPLACEMENT] = now[DISPLACEMENT] * units.displacement
    totals[ROW_COUNT] = count
    totals[ROW_AREA] = real_area(contact.sorted_gap, contact.sorted_weight, count, approach) * units.area
    totals[ROW_STIFFNESS] = sticking_stiffness(contact, memory, 0.0) * units.stiffness
    totals[ROW_DISSIPATED] = now[DISSIPATED] * units.energy
    totals[ROW_LIMIT] = limit * units.load
    totals[ROW_SATURATED] = 1.0 if saturated else 0.0
    totals[ROW_TRACTION_RATIO] = traction_ratio


@reordered
def superpose(gap: Floats, weight: Floats, label: float, jump: float, force: Floats) -> None:
    """Add jump·N(label) to the tangential force of asperities in ascending gap."""
    for i in range(touching(gap, label)):
        depth = label - gap[i]
        force[i] += jump * weight[i] * depth * math.sqrt(depth)


@reordered
def project(
    gap: Floats,
    weight: Floats,
    approach: float,
    boundary: float,
    outermost: float,
    friction: float,
    slope: float,
    force: Floats,
    normal: Floats,
    radius: Floats,
    stick: Floats,
    state: Floats,
) -> None:
    """Fill in loads, radii and slip state of touching asperities.

    The slip annulus at the edge ends at the label ``boundary``; the outermost spring that slides has ``outermost``.
    ``force`` holds the share of the tangential load that the inner vertices have, and gets that of the edge,
    whose slope is given; rounding does not carry it beyond the limit.
    """
    for i in range(force.size):
        own = approach - gap[i]
        x = math.sqrt(own)
        load = weight[i] * own * x
        limit = friction * abs(load)
        slip = 1.0 * PARTIAL_SLIP if boundary > gap[i] else 1.0 * GROSS_SLIP
        force[i] = min(max(force[i] + slope * load, -limit), limit)
        normal[i] = load
        radius[i] = weight[i] * x
        stick[i] = weight[i] * math.sqrt(max(boundary - gap[i], 0.0))
        state[i] = slip if outermost > gap[i] else 1.0 * FULL_STICK


@short
def record_energies(memory: Memory, rows: Rows, row: int, columns: Integers, units: Units) -> None:
    """Write down what each recorded asperity has dissipated."""
    for c in range(columns.size):
        rows.dissipated[row, c] = memory.dissipated[columns[c]] * units.energy


@entry
def record_asperities(
    contact: Contact, memory: Memory, rows: Rows, row: int, columns: Integers, units: Units, work: Floats
) -> None:
    """Project the state onto one row of per-asperity variables, but for the energies.

    ``work`` (5, asperity) is scratch.
    """
    contact, memory, rows = lean(contact), uncounted(lean(memory)), lean(rows)
    columns, work = lean(columns), lean(work)
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
        displacement = memory.now[DISPLACEMENT]
        boundary, outermost = slip_zones(stack, depth, displacement, group.friction, memory.steep[index])
        project(
            gap,
            weight,
            approach,
            boundary,
            outermost,
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
        touches = contact.gap[i] < approach
        rows.tangential_load[row, c] = work[0, i] * units.load if touches else 0.0
        rows.normal_load[row, c] = work[1, i] * units.load if touches else 0.0
        rows.contact_radius[row, c] = work[2, i] * units.radius if touches else 0.0
        rows.stick_radius[row, c] = work[3, i] * units.radius if touches else 0.0
        rows.slip_state[row, c] = np.int8(work[4, i]) if touches else SEPARATED


@entry
def record_row(
    contact: Contact,
    memory: Memory,
    rows: Rows,
    row: int,
    pending: Pending,
    columns: Integers,
    units: Units,
    saturated: bool,
    work: Floats,
) -> None:
    """Project the state onto one row, or leave its asperities for later where there is room for what that takes."""
    contact, memory, rows, pending = lean(contact), uncounted(lean(memory)), lean(rows), lean(pending)
    columns, work = lean(columns), lean(work)
    record_totals(contact, memory, rows.totals[row], units, saturated)
    if columns.size > 0:
        record_energies(memory, rows, row, columns, units)
        if not set_aside(memory, pending, row):
            record_asperities(contact, memory, rows, row, columns, units, work)


@entry
def record_pending(
    contact: Contact, pending: Pending, rows: Rows, columns: Integers, units: Units, work: Floats
) -> None:
    """Project the asperities of all rows that were left for later."""
    contact, pending, rows, columns, work = lean(contact), lean(pending), lean(rows), lean(columns), lean(work)
    for row in range(pending.waits.size):
        if pending.waits[row]:
            # the energies are in the rows already, so that any array will do for them
            memory = Memory(pending.vertices[row], pending.depth[row], pending.steep[row], work[0], pending.now[row])
            record_asperities(contact, memory, rows, row, columns, units, work)
