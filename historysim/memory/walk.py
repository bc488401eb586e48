"""Walk paths one after the other, and record their rows."""

import numpy as np

from historysim.memory.compiled import compiled
from historysim.memory.groups import approach_for, friction_limit, group_loads
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    LIMIT,
    NORMAL_LOAD,
    REQUEST,
    TANGENTIAL_LOAD,
    Contact,
    Integers,
    Memory,
    Units,
)
from historysim.memory.move import move
from historysim.memory.normal import load_at
from historysim.memory.paths import LOAD, Paths
from historysim.memory.polyline import Aim, to_displacement, to_load
from historysim.memory.projection import record_asperities, record_totals
from historysim.memory.ramp import ramp, ramp_part, toward
from historysim.memory.rows import Rows
from historysim.memory.search import displacement_at
from historysim.memory.tolerances import LIMIT_SLACK


@compiled
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


@compiled
def walk_paths(
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
