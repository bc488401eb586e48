"""One path at a time, in place: what a loop steps with, in compiled code or in Python.

`step` is what compiled functions of other programs call: it needs no Python, and gives the bits of a replay. Of a path
that is refused it changes nothing.
"""

from typing import Any, NamedTuple

import numpy as np

from historysim.memory.compiled import compiled, entry, short
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Integers,
    Memory,
    Units,
)
from historysim.memory.lean import counted, empty, given_back, lean, uncounted
from historysim.memory.limit import MOST_PIECES
from historysim.memory.paths import LEAST_APPROACH, LEAST_LOAD, LOAD
from historysim.memory.slopes import Slopes, slopes
from historysim.memory.stacks import copied, copy_items, copy_vertices, deepest
from historysim.memory.walk import Path, planned, walk_on

Arrays = tuple[Any, ...]
"""What a named tuple holds, without its names: compiled code is handed a plain tuple in a tenth of the time."""


class Body(NamedTuple):
    """A contact that compiled code steps: what it is, what it remembers, and how it is driven.

    ``control`` says how the normal and the tangential channel were controlled last. ``tolerance`` and ``saturate`` are
    as in `Ensemble`; ``compliance`` is that of an instrument, dimensionless.
    """

    contact: Contact
    memory: Memory
    units: Units
    control: Integers
    tolerance: float
    compliance: float
    saturate: bool


@short
def with_memory(body: Body, memory: Memory) -> Body:
    """Return a body with another memory."""
    return Body(body.contact, memory, body.units, body.control, body.tolerance, body.compliance, body.saturate)


@short
def path_to(
    units: Units, normal_control: int, normal_target: float, tangential_control: int, tangential_target: float
) -> Path:
    """Return the path to targets in N and m; not a number holds a channel."""
    held = np.isnan(normal_target)
    by_load = normal_control == LOAD
    target = 0.0 if held else normal_target / (units.load if by_load else units.length)
    if abs(target) < (LEAST_LOAD if by_load else LEAST_APPROACH):
        target = 0.0
    fraction = 0.0 if held else 1.0
    if np.isnan(tangential_target):
        return Path(normal_control, target, fraction, tangential_control, 0.0, 0.0)
    unit = units.load if tangential_control == LOAD else units.displacement
    return Path(normal_control, target, fraction, tangential_control, tangential_target / unit, 1.0)


@compiled
def walk_path(
    contact: Contact, memory: Memory, path: Path, saturate: bool, tolerance: float, compliance: float
) -> tuple[Memory, bool, float, float]:
    """Walk one path; return also whether it is refused, with the request and the limit (see `planned`)."""
    ends, sides = empty(MOST_PIECES, np.float64), empty(MOST_PIECES, np.int64)
    journey, refused, asked, limit = planned(contact, memory, path, ends, sides, saturate, compliance, True)
    if not refused:
        memory, _ = walk_on(contact, memory, journey, ends, sides, 0.0, 1.0, tolerance)
    return memory, refused, asked, limit


@entry
def step(
    body: Body, normal_control: int, normal_target: float, tangential_control: int, tangential_target: float
) -> tuple[Body, bool]:
    """Carry a body along one straight path, in place.

    Parameters
    ----------
    body : Body
        Its arrays are changed, unless the path is refused.
    normal_control, tangential_control : int
        `LOAD` or `DISPLACED`.
    normal_target, tangential_target : float
        Where the channels go [N] or [m]; not a number holds a channel.

    Returns
    -------
    Body
        To go on with: of the same arrays, or of larger ones where the memory has grown.
    bool
        Whether the path was refused, since its tangential load is beyond the friction limit.
    """
    contact, memory = lean(body.contact), counted(lean(body.memory))
    path = path_to(body.units, normal_control, normal_target, tangential_control, tangential_target)
    memory, refused, _, _ = walk_path(contact, memory, path, body.saturate, body.tolerance, body.compliance)
    if not refused:
        body.control[0], body.control[1] = normal_control, tangential_control
    return with_memory(body, given_back(memory, body.memory)), refused


@short
def forked(body: Body) -> Body:
    """Return an independent copy, such as for a trial; the geometry is shared."""
    return Body(
        body.contact,
        copied(body.memory),
        body.units,
        body.control.copy(),
        body.tolerance,
        body.compliance,
        body.saturate,
    )


@short
def end_slopes(body: Body, start: float) -> Slopes:
    """Return the derivatives of the loads at the end of the last path, which began at an approach [m]; see `slopes`."""
    found = slopes(lean(body.contact), lean(body.memory), start / body.units.length)
    return in_si(found, body.units)


@short
def in_si(found: Slopes, units: Units) -> Slopes:
    """Return derivatives in N/m."""
    stiffness = units.load / units.length
    return Slopes(found.tangential * units.stiffness, found.coupling * stiffness, found.normal * stiffness)


@short
def normal_load(body: Body) -> float:
    """Total normal load [N]."""
    return body.memory.now[NORMAL_LOAD] * body.units.load


@short
def tangential_load(body: Body) -> float:
    """Total tangential load [N]."""
    return body.memory.now[TANGENTIAL_LOAD] * body.units.load


@short
def approach(body: Body) -> float:
    """Approach of the highest summit from first touch [m]."""
    return body.memory.now[APPROACH] * body.units.length


@short
def tangential_displacement(body: Body) -> float:
    """Rigid tangential displacement U [m]."""
    return body.memory.now[DISPLACEMENT] * body.units.displacement


@entry
def step_arrays(
    contact: Arrays,
    arrays: Arrays,
    units: Arrays,
    normal_control: int,
    normal_target: float,
    tangential_control: int,
    tangential_target: float,
    saturate: bool,
    tolerance: float,
    compliance: float,
) -> tuple[bool, float, float, Arrays | None]:
    """Do what `step` does, for a caller in Python, to whom plain tuples are dear and named ones dearer.

    Returns whether the path is refused with the request and the limit (dimensionless), and new arrays where those
    given were too small for the result.
    """
    here, memory, scale = Contact(*lean(contact)), Memory(*counted(lean(arrays))), Units(*units)
    path = path_to(scale, normal_control, normal_target, tangential_control, tangential_target)
    after, refused, asked, limit = walk_path(here, memory, path, saturate, tolerance, compliance)
    if deepest(uncounted(after)) > memory.vertices.shape[1]:
        larger = (after.vertices, after.depth, after.steep, after.dissipated, after.now)
        return refused, asked, limit, given_back(larger, arrays)
    # what is another array was made on the way, such as by a ramp that is walked several times
    if after.vertices is not memory.vertices:
        found, own = uncounted(after.vertices), uncounted(memory.vertices)
        for index in range(after.depth.size):
            copy_vertices(found[index], own[index], after.depth[index])
    if after.depth is not memory.depth:
        copy_items(after.depth, memory.depth)
    if after.steep is not memory.steep:
        copy_items(after.steep, memory.steep)
    if after.dissipated is not memory.dissipated:
        copy_items(after.dissipated, memory.dissipated)
    if after.now is not memory.now:
        copy_items(after.now, memory.now)
    return refused, asked, limit, None


@entry
def slopes_of_arrays(
    contact: Arrays,
    arrays: Arrays,
    units: Arrays,
    d0: float,
) -> tuple[float, float, float]:
    """Do what `end_slopes` does, for a caller in Python; the path began at the dimensionless approach ``d0``."""
    found = in_si(slopes(Contact(*lean(contact)), Memory(*lean(arrays)), d0), Units(*units))
    return found.tangential, found.coupling, found.normal
