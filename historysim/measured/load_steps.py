"""Loops of a record in which the normal load steps: which of their branches are at one load.

A branch on which the normal load moves by more than a share belongs to no one load, and has no values. A loop of which
the other branch is at one load remains, and one without any is left out. What the load moves by on most branches, by a
tilt of the surface say, is the way of the test and no step: the share counts from the lower quartile of the moves. A
programme of few loops at each load ends in the middle of one; so
where the load steps, a whole branch behind the last loop counts as a loop with this branch alone.

A branch that begins with such a step, while the displacement rests at the reversal, slides at one load, and has its
friction. What leads to sliding is not of that load, since the contact remembers the other: it takes δ1 + δ2 after a
rise of the load from N1 to N2, and not 2 δ2. So it has neither preliminary displacement nor stiffness.
"""

import attrs
import numpy as np

from historysim.basics.array_types import Booleans, Floats, Integers
from historysim.basics.wording import counted

PARTS = 10
"""A branch is looked at in so many parts of as many samples, so that the noise of a load is no move."""
USUAL = 0.25
"""The quantile of the moves on all branches that is the way of the test."""
AT_REST = 0.05
"""What is nearer to a reversal than this share of the branch, and than the dead band, is at rest there."""


@attrs.frozen(eq=False)
class AtOneLoad:
    """Loops of which each has a branch at one load."""

    number: Integers
    """(loop) Which loop of the record each one is."""
    ends: Integers
    """(loop, 3)"""
    left_out: Booleans
    """(loop, 2) Whether the first and the second branch of each loop have no values."""
    stepped: Booleans
    """(loop, 2) Whether they begin with a step of the load."""
    told: tuple[str, ...]
    """What was left out, and why."""


def at_one_load(
    displacement: Floats,
    normal_load: Floats | None,
    number: Integers,
    ends: Integers,
    lone: tuple[int, int] | None,
    *,
    dead_band: float,
    share: float,
) -> AtOneLoad:
    """Return the loops that have a branch at one load.

    Parameters
    ----------
    displacement : array (sample)
        U [m].
    normal_load : array (sample) or None
        N [N]; without it nothing is left out.
    number : array of int (loop)
    ends : array of int (loop, 3)
        The samples at which each loop begins, turns back, and ends.
    lone : (int, int) or None
        The ends of a whole branch behind the last loop.
    dead_band : float
        The smallest swing of the displacement that counts as a reversal [m].
    share : float
        How much N may move on a branch, over its greatest value there and beyond what it moves on most branches.
    """
    none = np.zeros((number.size, 2), dtype=np.bool_)
    nothing = AtOneLoad(number, ends, none, none, ())
    if normal_load is None:
        return nothing
    branches = [loop[place : place + 2] for loop in ends for place in (0, 1)] + ([lone] if lone else [])
    moves = np.array([_moves(displacement, normal_load, int(a), int(b), dead_band) for a, b in branches])
    *of_loops, behind = np.split(moves, [2 * number.size])
    on_the_way, with_rest = np.moveaxis(of_loops[0].reshape(-1, 2, 2), -1, 0)
    everywhere = float(np.quantile(on_the_way, USUAL))
    most = share + everywhere
    moved, stepped = on_the_way > most, with_rest > most
    limit = f"{100 * share:.3g} % (load_share)"
    told_of = []
    if everywhere > share:
        told_of.append(
            f"the normal load moves by {100 * everywhere:.3g} % of its greatest value or more on three branches of "
            f"four, over {limit}: those are not left out"
        )
    if not stepped.any():
        return attrs.evolve(nothing, told=tuple(told_of))
    if moved.any():
        count, by = counted(int(moved.sum()), "branch is", "branches are"), _range(on_the_way[moved])
        told_of.append(f"{count} left out, on which the normal load moves by {by} of its greatest value, over {limit}")
    if begun := int((stepped & ~moved).sum()):
        told_of.append(
            f"{counted(begun, 'branch begins', 'branches begin')} with a step of the normal load of more than {limit}: "
            "without preliminary displacement and stiffness"
        )
    if lone is not None and behind[0, 0] <= most:
        number = np.append(number, number[-1] + 1)
        ends = np.vstack([ends, [*lone, displacement.size - 1]])
        moved, stepped = np.vstack([moved, [False, True]]), np.vstack([stepped, [behind[0, 1] > most, True]])
    kept = ~moved.all(axis=1)
    return AtOneLoad(number[kept], ends[kept], moved[kept], stepped[kept], tuple(told_of))


def _range(moves: Floats) -> str:
    low, high = (f"{100 * float(at(moves)):.3g} %" for at in (np.min, np.max))
    return low if low == high else f"{low} to {high}"


def _moves(displacement: Floats, normal_load: Floats, first: int, last: int, dead_band: float) -> tuple[float, float]:
    """Return the range of N over its greatest value, on the way of a branch and with the rest before it."""
    near = min(dead_band, AT_REST * abs(displacement[last] - displacement[first]))
    before, begin, end = first, first, last
    while before > 0 and abs(displacement[before - 1] - displacement[first]) <= near:
        before -= 1
    while begin < last - 1 and abs(displacement[begin + 1] - displacement[first]) <= near:
        begin += 1
    while end > begin + 1 and abs(displacement[end - 1] - displacement[last]) <= near:
        end -= 1
    return _move(normal_load[begin : end + 1]), _move(normal_load[before : end + 1])


def _move(load: Floats) -> float:
    parts = min(PARTS, load.size)
    begins = np.arange(parts) * load.size // parts
    means = np.add.reduceat(load, begins) / np.diff(begins, append=load.size)
    greatest = float(np.abs(means).max())
    return float(np.ptp(means)) / greatest if greatest > 0 else 0.0
