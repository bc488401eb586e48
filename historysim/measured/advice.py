"""What a misfit looks like: of the faults that a key mends, the one that a model leaves in a record.

README.md of this folder, "What a misfit looks like", has the test; tests/README.md how often noise alone gets a note.
"""

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.measured import scatter

SURE = 0.999  # confidence from which on an effect is no chance
EXPLAINS = 0.6  # share of the squares that branches have in common, from which on what takes it off has a note
AS_GOOD = 0.05  # what a fault explains more than other values of friction or stiffness would
LEAST = 0.01  # change of the load over its largest value, up to which an effect has no note
# Deviations of the place of a turn that a length is more than: a turn is read off at the outermost sample.
OVER_NOISE = 3.0
FEWEST_BRANCHES, FEWEST_OF_BRANCH = 4, 12
MOST_BRANCHES, MOST_OF_BRANCH = 48, 200  # branches, and samples of one, that are looked at
PLACES, PIECES = 40, 8  # places of a branch, and pieces of it with a speed
BEFORE_END = 0.85  # share of the samples of a branch that is looked at
SIZES = np.geomspace(0.003, 0.5, 12)  # sizes of a fault that are tried, over the largest one


@attrs.frozen(eq=False)
class BranchSamples:
    """A branch in its own direction, its samples in the order of their displacement from the reversal."""

    sign: float
    moved: Floats
    speed: Floats
    load: Floats
    model: Floats
    slope: Floats

    @classmethod
    def of(cls, time: Floats, displacement: Floats, load: Floats, model: Floats, slope: Floats) -> "BranchSamples":
        """Return the samples of a branch, in the order of time, as they are compared."""
        sign = 1.0 if displacement[-1] > displacement[0] else -1.0
        moved = sign * (displacement - displacement[0])
        ends = np.linspace(0, moved.size - 1, PIECES + 1).astype(np.int64)
        speeds = np.diff(moved[ends]) / np.maximum(np.diff(time[ends]), 1e-300)
        speed = np.append(np.repeat(speeds, np.diff(ends)), speeds[-1])
        # a load that is ahead falls before the end
        order = np.argsort(moved, kind="stable")[: int(BEFORE_END * moved.size)]
        order = order[:: -(-order.size // MOST_OF_BRANCH)]
        return cls(sign, *(each[order] for each in (moved, speed, sign * load, sign * model, slope)))

    @property
    def place(self) -> Integers:
        """Number of the place of each sample, those of the other direction behind."""
        place: Integers = np.clip((self.moved / self.moved[-1] * PLACES).astype(np.int64), 0, PLACES - 1)
        return place + PLACES * int(self.sign < 0)

    def left(self, fault: "Fault", size: float) -> tuple[Floats, Floats]:
        """Return the model with so much of a fault less the load, and its slope over the size, beside other values."""
        behind, added = fault.behind(self), fault.added(self)
        at = self.moved - size * behind
        model, slope = (np.interp(at, self.moved, each) for each in (self.model, self.slope))
        beside = np.column_stack(
            [np.ones(at.size), model - self.moved * slope, self.moved * slope, slope * (model - model[0])]
        )
        basis = np.linalg.qr(beside / np.maximum(np.linalg.norm(beside, axis=0), 1e-300))[0]
        both = np.column_stack([model + size * added - self.load, added - slope * behind])
        both -= basis @ (basis.T @ both)
        return both[:, 0], both[:, 1]


def _none(branch: BranchSamples) -> Floats:
    return np.zeros(branch.moved.size)


@attrs.frozen
class Fault:
    """What a fault of size 1 does to a branch."""

    #: The unit of its size, and a note; nothing of what is another value of a parameter, and no fault.
    text: str = ""
    behind: Callable[[BranchSamples], Floats] = _none  #: by how much displacement the load is behind [m]
    added: Callable[[BranchSamples], Floats] = _none  #: load that is added [N]
    either_way: bool = False  #: whether its size may be below 0

    def largest(self, branch: BranchSamples) -> float:
        """Return the size of it that moves a branch by its whole stroke, or adds as much as its largest load."""
        behind, added = (float(np.abs(of(branch)).max()) for of in (self.behind, self.added))
        return min(
            branch.moved[-1] / behind if behind else np.inf,
            float(np.abs(branch.load).max()) / (added or np.inf) or np.inf,
        )


FAULTS = {
    "lag": Fault(
        's: the load is behind the displacement by {size}, or {way}: try shift = "-{size}" at the tangential load',
        behind=lambda branch: branch.speed,
    ),
    "play": Fault(
        'm: the displacement goes on by {size} at zero load: try free_play = "{size}" at the displacement',
        behind=lambda branch: (branch.load > 0).astype(float),
    ),
    "beside": Fault(
        "N/m: the load rises along each stroke by {size}, in both directions, as with a guide, a flexure or a cable "
        'beside the contact: try parallel_stiffness = "{size}" in [instrument], or fit it',
        added=lambda branch: branch.moved,
    ),
    "sloping": Fault(
        "N/m: friction goes with the position, by {size}, up on one branch and down on the next, as with a normal load "
        "that changes along the stroke: give its column as normal_load, and not a constant",
        added=lambda branch: branch.sign * branch.moved,
        either_way=True,
    ),
    "other friction": Fault(behind=lambda branch: branch.moved, either_way=True),
    "other stiffness": Fault(behind=lambda branch: branch.model - branch.model[0], either_way=True),
}


@attrs.frozen
class Effect:
    """How much of a fault is in a record."""

    size: float
    sure: bool
    explained: float  #: share of the squares in common that it takes off
    change: float  #: of the load over its largest value


def advice(branches: Sequence[BranchSamples], place_deviation: float) -> list[str]:
    """Return a note on the fault that explains most of what a model leaves, with the key that mends it; or none.

    The deviation [m] is that of the places of turns.
    """
    if len(branches) < FEWEST_BRANCHES:
        return []
    # in pairs of both directions
    chosen = np.linspace(0, len(branches), MOST_BRANCHES // 2, endpoint=False).astype(int) // 2 * 2
    if len(branches) > MOST_BRANCHES:
        branches = [branches[first + other] for first in chosen for other in (0, 1) if first + other < len(branches)]
    speed = float(np.median(np.concatenate([branch.speed for branch in branches])))
    effects = {name: effect_of(fault, branches) for name, fault in FAULTS.items()}
    beside = max(effects[name].explained for name, fault in FAULTS.items() if not fault.text)
    name, best = max(effects.items(), key=lambda item: item[1].explained if item[1].sure else -1.0)
    unit, _, text = FAULTS[name].text.partition(": ")
    if not text or not best.sure or best.change < LEAST or best.explained < max(EXPLAINS, beside + AS_GOOD):
        return []
    if name == "lag" and best.size * speed < OVER_NOISE * place_deviation:
        return []
    seen = text.format(size=quantity_text(abs(best.size), unit, 3), way=quantity_text(abs(best.size) * speed, "m", 3))
    return [f"of what the model leaves alike in all loops, {100 * best.explained:.0f} % looks like this: {seen}"]


def effect_of(fault: Fault, branches: Sequence[BranchSamples]) -> Effect:
    """Return how much of a fault is in some branches, by least squares, and how sure it is."""
    from scipy.optimize import minimize_scalar

    def squares_of(size: float) -> float:
        return sum(float(left @ left) for left, _ in (branch.left(fault, size) for branch in branches))

    before, rates = (
        np.concatenate(parts) for parts in zip(*(branch.left(fault, 0.0) for branch in branches), strict=True)
    )
    # of one for which the contact is moved by some of the stroke, or the load changes by some of it
    unit = min(fault.largest(branch) for branch in branches)
    if fault.behind is _none:
        # the residual is linear in the size
        most = SIZES[-1] * unit
        size = float(np.clip(-(rates @ before) / ((rates @ rates) or 1.0), -most if fault.either_way else 0.0, most))
    else:
        tried = unit * np.concatenate([-SIZES[::-1] if fault.either_way else [], [0.0], SIZES])
        best = min(max(int(np.argmin([squares_of(size) for size in tried])), 1), tried.size - 2)
        size = float(minimize_scalar(squares_of, bounds=tried[[best - 1, best + 1]], options={"xatol": 1e-4 * unit}).x)
    each = [branch.left(fault, size) for branch in branches]
    left, slope = (np.concatenate(parts) for parts in zip(*each, strict=True))
    squares = float(slope @ slope) or 1.0
    share = np.array([slope @ slope for _, slope in each]) / squares
    moves = np.array([slope @ left for left, slope in each]) / squares
    reach = scatter.wander(moves - share * moves.sum(), np.maximum(share, 1e-9), SURE).reach
    place = np.concatenate([branch.place for branch in branches])
    count = np.maximum(np.bincount(place, minlength=2 * PLACES), 1)
    first, last = (float(np.sum(np.bincount(place, values, 2 * PLACES) ** 2 / count)) for values in (before, left))
    largest = max(float(np.abs(branch.load).max()) for branch in branches)
    return Effect(
        size,
        sure=abs(size) > reach,
        explained=1 - last / first if first > 0 else 0.0,
        change=float(np.abs(size * slope).max()) / largest,
    )
