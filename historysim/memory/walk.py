"""Walk paths one after the other, and record their rows."""

import numpy as np

from historysim.memory.compiled import compiled
from historysim.memory.groups import approach_for, group_loads
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    EXCESS,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Integers,
    Memory,
    Units,
)
from historysim.memory.limit import MOST_PIECES, Course, cut, follow, meets_limit, overload
from historysim.memory.move import move
from historysim.memory.normal import load_at
from historysim.memory.paths import LOAD, Paths
from historysim.memory.polyline import Aim, to_displacement, to_load
from historysim.memory.projection import record_row
from historysim.memory.ramp import ramp, toward
from historysim.memory.rows import Rows
from historysim.memory.search import displacement_at
from historysim.memory.tolerances import LIMIT_SLACK


@compiled
def destination(
    contact: Contact, memory: Memory, paths: Paths, p: int, compliance: float, request: float
) -> tuple[float, float, Aim]:
    """Where a path goes: approach, normal load, and the aim of the tangential channel, which now asks for a request."""
    now = memory.now
    if paths.normal_control[p] == LOAD:
        load = toward(now[NORMAL_LOAD], paths.normal_target[p], paths.normal_fraction[p])
        d = approach_for(contact, memory, load)
    else:
        d = toward(now[APPROACH], paths.normal_target[p], paths.normal_fraction[p])
        load = load_at(contact.sorted_gap, contact.sorted_weight, d)[0]
    target, fraction = paths.tangential_target[p], paths.tangential_fraction[p]
    if paths.tangential_control[p] == LOAD:
        return d, load, to_load(toward(request, target, fraction))
    present = now[DISPLACEMENT] + compliance * now[TANGENTIAL_LOAD]
    return d, load, Aim(toward(present, target, fraction), 1.0, compliance)


@compiled
def hold(memory: Memory, request: float) -> bool:
    """Note what a load at the friction limit asks for beyond it, and return whether that is more than rounding."""
    now = memory.now
    excess = request - now[TANGENTIAL_LOAD]
    held = bool(abs(excess) > LIMIT_SLACK * abs(now[TANGENTIAL_LOAD]))
    if held:
        now[EXCESS] = excess
    return held


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
    until: float,
) -> tuple[Memory, int, float, float]:
    """Walk paths one after the other and record their rows; ``columns`` gives each column's asperity.

    Displacements of the tangential channel are those of a drive behind a spring of a compliance; with 0, the
    contact's. Of each path the share ``until`` is walked. Returns the memory, and the path that asks for more than
    the friction limit with the request and the limit (dimensionless); the memory is then of no use. The path is -1
    where all could be walked.
    """
    work = np.zeros((5, contact.gap.size if columns.size > 0 else 0))
    ends, sides = np.ones(MOST_PIECES), np.zeros(MOST_PIECES, dtype=np.int64)
    flag = False
    for p in range(paths.parts.size):
        now = memory.now
        parts = paths.parts[p]
        load0, d0, v0 = now[NORMAL_LOAD], now[APPROACH], now[DISPLACEMENT]
        force0 = now[TANGENTIAL_LOAD] + (now[EXCESS] if saturate else 0.0)
        d1, load, aim = destination(contact, memory, paths, p, compliance, force0)
        request, by_force = aim.value, aim.rigid == 0.0
        loads = paths.normal_control[p] == LOAD and by_force
        course = Course(loads, (max(d0, 0.0) if loads and load > 0.0 else d0, d1), (load0, load), (force0, request))
        meets = by_force and meets_limit(contact, course)
        pieces = cut(contact, course, ends, sides) if meets else 0
        if meets and not saturate:
            asked, limit = overload(contact, course, ends[:pieces], sides[:pieces])
            if abs(asked) > limit * (1.0 + LIMIT_SLACK):
                return memory, p, asked, limit
        v1 = aim.value
        if aim.compliance > 0.0 and not (loads or meets or (parts == 1 and until == 1.0)):
            v1 = displacement_at(contact, memory, group_loads(contact, d1), d1, aim)
        before = 0.0
        for part in range(1, parts + 1):
            share = until * (part / parts)
            side = 0
            if meets:
                memory, side = follow(contact, memory, course, ends[:pieces], sides[:pieces], before, share, tolerance)
            elif loads:
                memory = ramp(contact, memory, toward(load0, load, share), toward(force0, request, share), tolerance)
            else:
                d = toward(d0, d1, share)
                step_load = load if d == d1 else load_at(contact.sorted_gap, contact.sorted_weight, d)[0]
                step = aim if share == 1.0 else to_displacement(toward(v0, v1, share))
                memory = move(contact, memory, d, step_load, step)
            before = share
            memory.now[EXCESS] = 0.0
            held = side != 0 and hold(memory, toward(force0, request, share))
            # several paths may lead to one row
            flag = flag or held
            if part < parts or paths.recorded[p]:
                row = paths.first_row[p] + part - 1
                record_row(contact, memory, rows, row, columns, units, flag, work)
                flag = False
    return memory, -1, 0.0, 0.0
