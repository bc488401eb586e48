"""Branches of loops at one normal load: how much it moves on each, and which branches it leaves without values."""

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.wording import count_text
from historysim.measured.branches import Trace

PARTS = 10  # parts of a branch over which the normal load is averaged, so that its noise is no move
# quantile of the moves of the normal load on all branches that is the way of the test, and no step
USUAL_MOVES = 0.25
# share of a branch from its reversal, and at most a dead band, in which the displacement is at rest
AT_REST = 0.05


@attrs.frozen(eq=False)
class AtOneLoad:
    """Loops with at least one branch at constant normal load."""

    number: Integers  #: (loop) Which loop of the record each one is
    ends: Integers  #: (loop, 3) The samples at which each loop begins, turns back, and ends
    #: (loop, 2) Whether the first and the second branch of each loop have no values
    left_out: Booleans
    stepped: Booleans  #: (loop, 2) Whether they begin with a step of the load
    notes: tuple[str, ...] = ()  #: what was left out, and why


def at_one_load(
    trace: Trace,
    number: Integers,
    ends: Integers,
    lone: tuple[int, int] | None,
    *,
    dead_band: float,
    share: float,
) -> AtOneLoad:
    """Select the loops with a branch at constant load; `lone` are the ends of a whole branch after the last loop.

    A branch on which the load moves by more than the share, beyond what it moves on most branches,
    is at no one load.
    """
    none = np.zeros((number.size, 2), dtype=np.bool_)
    load = trace.normal_load
    # within the share on the whole record, and so on each branch
    if load is None or np.ptp(load) <= share * load.min():
        return AtOneLoad(number, ends, none, none)
    branches = [loop[branch : branch + 2] for loop in ends for branch in (0, 1)] + (
        [lone] if lone else []
    )
    moves = np.array(
        [_load_moves(trace, int(start), int(stop), dead_band) for start, stop in branches]
    )
    *of_loops, lone_move = np.split(moves, [2 * number.size])
    on_the_way, with_rest = np.moveaxis(of_loops[0].reshape(-1, 2, 2), -1, 0)
    usual_move = float(np.quantile(on_the_way, USUAL_MOVES))
    limit_of_move = share + usual_move
    moved = on_the_way > limit_of_move
    stepped = with_rest > limit_of_move
    limit = f"{100 * share:.3g} % (load_share)"
    notes = []
    if usual_move > share:
        notes.append(
            f"the normal load moves by {100 * usual_move:.3g} % of its greatest value or more on three branches of "
            f"four, over {limit}: those are not left out"
        )
    if not stepped.any():
        return AtOneLoad(number, ends, none, none, tuple(notes))
    if moved.any():
        low, high = (f"{100 * float(of(on_the_way[moved])):.3g} %" for of in (np.min, np.max))
        count = count_text(int(moved.sum()), "branch is", "branches are")
        by = low if low == high else f"{low} to {high}"
        notes.append(
            f"{count} left out, on which the normal load moves by {by} of its greatest value, over {limit}"
        )
    if begun := int((stepped & ~moved).sum()):
        notes.append(
            f"{count_text(begun, 'branch begins', 'branches begin')} with a step of the normal load of more than "
            f"{limit}: without preliminary displacement and stiffness"
        )
    if lone is not None and lone_move[0, 0] <= limit_of_move:
        number = np.append(number, number[-1] + 1)
        ends = np.vstack([ends, [*lone, trace.displacement.size - 1]])
        moved = np.vstack([moved, [False, True]])
        stepped = np.vstack([stepped, [lone_move[0, 1] > limit_of_move, True]])
    selected = ~moved.all(axis=1)
    return AtOneLoad(
        number[selected], ends[selected], moved[selected], stepped[selected], tuple(notes)
    )


def _load_moves(
    trace: Trace, start_sample: int, end_sample: int, dead_band: float
) -> tuple[float, float]:
    """Return the range of N over its largest value on the moving part of a branch, and including the rest before."""
    displacement = trace.displacement
    normal_load = trace.normal_load
    assert normal_load is not None  # noqa: S101 - its caller has looked
    start = displacement[start_sample]
    end = displacement[end_sample]
    near = min(dead_band, AT_REST * abs(end - start))
    rest_start = start_sample - _rest_length(displacement[:start_sample][::-1], start, near)
    move_start = start_sample + _rest_length(
        displacement[start_sample + 1 : end_sample], start, near
    )
    move_end = end_sample - _rest_length(displacement[move_start + 1 : end_sample][::-1], end, near)
    return _relative_range(normal_load[move_start : move_end + 1]), _relative_range(
        normal_load[rest_start : move_end + 1]
    )


def _rest_length(displacement: Floats, centre: float, near: float) -> int:
    """Return the number of samples up to the first one that is not near a displacement."""
    count = 64
    while True:
        far = np.abs(displacement[:count] - centre) > near
        if far.any():
            return int(far.argmax())
        if count >= displacement.size:
            return displacement.size
        count *= 8


def _relative_range(load: Floats) -> float:
    count = min(PARTS, load.size)
    begins = np.arange(count) * load.size // count
    means = np.add.reduceat(load, begins) / np.diff(begins, append=load.size)
    greatest = float(np.abs(means).max())
    return float(np.ptp(means)) / greatest if greatest > 0 else 0.0
