"""Walk paths one after the other, and record their rows."""

from typing import NamedTuple

import numpy as np

from historysim.memory.compiled import compiled, entry, short
from historysim.memory.groups import approach_for, group_loads
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    EXCESS,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Integers,
    Memory,
    Units,
)
from historysim.memory.lean import counted, empty, given_back, lean
from historysim.memory.limit import MOST_PIECES, Course, cut, follow, meets_limit, overload
from historysim.memory.move import move
from historysim.memory.normal import load_at
from historysim.memory.paths import LOAD, Paths
from historysim.memory.pending import Pending
from historysim.memory.polyline import Aim, to_displacement, to_load
from historysim.memory.projection import record_row
from historysim.memory.ramp import ramp, toward
from historysim.memory.rows import Columns, Rows, Scratch
from historysim.memory.search import displacement_at
from historysim.memory.tolerances import LIMIT_SLACK


class Path(NamedTuple):
    """One straight path, dimensionless: how each channel is controlled, its target, and the fraction of the way."""

    normal_control: int
    normal_target: float
    normal_fraction: float
    tangential_control: int
    tangential_target: float
    tangential_fraction: float


class Journey(NamedTuple):
    """What one path asks for, found before it is walked: where it goes, and how.

    ``meets`` where a load meets the friction limit on the way; the course is then cut into ``pieces``. Displacements
    in between are straight from ``displacements``' first to its second.
    """

    course: Course
    aim: Aim
    meets: bool
    pieces: int
    displacements: tuple[float, float]


@short
def destination(
    contact: Contact, memory: Memory, path: Path, compliance: float, request: float
) -> tuple[float, float, Aim]:
    """Where a path goes: approach, normal load, and the aim of the tangential channel, which now asks for a request."""
    now = memory.now
    if path.normal_control == LOAD:
        load = toward(now[NORMAL_LOAD], path.normal_target, path.normal_fraction)
        d = approach_for(contact, memory, load)
    else:
        d = toward(now[APPROACH], path.normal_target, path.normal_fraction)
        load = now[NORMAL_LOAD] if d == now[APPROACH] else load_at(contact.sorted_gap, contact.sorted_weight, d)[0]
    target, fraction = path.tangential_target, path.tangential_fraction
    if path.tangential_control == LOAD:
        return d, load, to_load(toward(request, target, fraction))
    present = now[DISPLACEMENT] + compliance * now[TANGENTIAL_LOAD]
    return d, load, Aim(toward(present, target, fraction), 1.0, compliance)


@short
def hold(memory: Memory, request: float) -> bool:
    """Note what a load at the friction limit asks for beyond it, and return whether that is more than rounding."""
    now = memory.now
    excess = request - now[TANGENTIAL_LOAD]
    held = bool(abs(excess) > LIMIT_SLACK * abs(now[TANGENTIAL_LOAD]))
    if held:
        now[EXCESS] = excess
    return held


@compiled
def planned(
    contact: Contact,
    memory: Memory,
    path: Path,
    ends: Floats,
    sides: Integers,
    saturate: bool,
    compliance: float,
    direct: bool,
) -> tuple[Journey, bool, float, float]:
    """Plan one path, which is ``direct`` where nothing is recorded on its way; the memory is only read.

    Returns also whether it is refused, as it asks for more than the friction limit, with the request and the limit.
    Shares and sides of the pieces of a course that is cut are written to ``ends`` and ``sides``.
    """
    now = memory.now
    load0, d0, v0 = now[NORMAL_LOAD], now[APPROACH], now[DISPLACEMENT]
    force0 = now[TANGENTIAL_LOAD] + (now[EXCESS] if saturate else 0.0)
    d1, load, aim = destination(contact, memory, path, compliance, force0)
    request, by_force = aim.value, aim.rigid == 0.0
    loads = path.normal_control == LOAD and by_force
    start = max(d0, contact.sorted_gap[0]) if loads and load > 0.0 else d0
    course = Course(loads, (start, d1), (load0, load), (force0, request))
    meets = by_force and meets_limit(contact, course)
    pieces = cut(contact, course, ends, sides) if meets else 0
    asked, limit, refused = 0.0, 0.0, False
    if meets and not saturate:
        asked, limit = overload(contact, course, ends[:pieces], sides[:pieces])
        refused = abs(asked) > limit * (1.0 + LIMIT_SLACK)
    v1 = aim.value
    if aim.compliance > 0.0 and not (loads or meets or refused or direct):
        v1 = displacement_at(contact, memory, group_loads(contact, d1), d1, aim)
    return Journey(course, aim, meets, pieces, (v0, v1)), refused, asked, limit


@compiled
def walk_on(
    contact: Contact,
    memory: Memory,
    journey: Journey,
    ends: Floats,
    sides: Integers,
    before: float,
    share: float,
    tolerance: float,
) -> tuple[Memory, bool]:
    """Walk a planned path from one share to another; return also whether a load is held at the limit there."""
    course, aim, side = journey.course, journey.aim, 0
    if journey.meets:
        pieces = journey.pieces
        memory, side = follow(contact, memory, course, ends[:pieces], sides[:pieces], before, share, tolerance)
    elif course.both:
        load = toward(course.loads[0], course.loads[1], share)
        memory = ramp(contact, memory, load, toward(course.forces[0], course.forces[1], share), tolerance)
    else:
        d = toward(course.approaches[0], course.approaches[1], share)
        arrives = d == course.approaches[1]
        load = course.loads[1] if arrives else load_at(contact.sorted_gap, contact.sorted_weight, d)[0]
        displacement = toward(journey.displacements[0], journey.displacements[1], share)
        memory = move(contact, memory, d, load, aim if share == 1.0 else to_displacement(displacement))
    memory.now[EXCESS] = 0.0
    return memory, side != 0 and hold(memory, toward(course.forces[0], course.forces[1], share))


@entry
def walk_paths(
    contact: Contact,
    memory: Memory,
    paths: Paths,
    rows: Rows,
    pending: Pending,
    columns: Columns,
    units: Units,
    work: Scratch,
    saturate: bool,
    tolerance: float,
    compliance: float,
    until: float,
) -> tuple[Memory, int, float, float]:
    """Walk paths one after the other and record their rows.

    Asperities of rows that find room in ``pending`` are left for `record_pending`; ``work`` is scratch.
    Displacements of the tangential channel are those of a drive behind a spring of a compliance; with 0, the
    contact's. Of each path the share ``until`` is walked. Returns the memory, and the path that asks for more than
    the friction limit with the request and the limit (dimensionless); the memory is then of no use. The path is -1
    where all could be walked.
    """
    given, contact, memory = memory, lean(contact), counted(lean(memory))
    paths, rows, pending, columns, work = lean(paths), lean(rows), lean(pending), lean(columns), lean(work)
    ends, sides = empty(MOST_PIECES, np.float64), empty(MOST_PIECES, np.int64)
    flag = False
    for p in range(paths.parts.size):
        parts = paths.parts[p]
        path = Path(
            int(paths.normal_control[p]),
            paths.normal_target[p],
            paths.normal_fraction[p],
            int(paths.tangential_control[p]),
            paths.tangential_target[p],
            paths.tangential_fraction[p],
        )
        direct = bool(parts == 1 and until == 1.0)
        journey, refused, asked, limit = planned(contact, memory, path, ends, sides, saturate, compliance, direct)
        if refused:
            return given_back(memory, given), p, asked, limit
        before = 0.0
        for part in range(1, parts + 1):
            share = until * (part / parts)
            memory, held = walk_on(contact, memory, journey, ends, sides, before, share, tolerance)
            before = share
            # several paths may lead to one row
            flag = flag or held
            if part < parts or paths.recorded[p]:
                row = paths.first_row[p] + part - 1
                record_row(contact, memory, rows, row, pending, columns, units, flag, work)
                flag = False
    return given_back(memory, given), -1, 0.0, 0.0
