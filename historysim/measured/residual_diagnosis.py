"""Diagnosis of residuals: which instrument fault, each with the key that corrects it, they resemble.

README.md of this folder, "What a misfit looks like", describes the test; tests/README.md has its
false alarms.
"""

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.measured import intervals

SURE = 0.999  # confidence above which an effect is significant
# least fraction of the squares common to all branches that a reported fault explains
EXPLAINS = 0.6
AS_GOOD = 0.05  # excess of that fraction over other values of friction or stiffness
LEAST = 0.01  # change of the load over its largest value, up to which an effect is not reported
# Least lag over the standard deviation of a turning point: a turn is read from the outermost
# sample.
OVER_NOISE = 3.0
FEWEST_BRANCHES, FEWEST_OF_BRANCH = 4, 12
MOST_BRANCHES, MOST_OF_BRANCH = 48, 200  # branches, and samples of each, that are evaluated
POSITION_BINS, PIECES = 40, 8  # position bins of a branch, and pieces of it with a speed each
BEFORE_END = 0.85  # fraction of the samples of a branch that is evaluated
SIZES = np.geomspace(0.003, 0.5, 12)  # trial sizes of a fault, over the largest one


@attrs.frozen(eq=False)
class BranchSamples:
    """Branch in its own direction, samples in the order of their displacement from the reversal."""

    sign: float
    moved: Floats
    speed: Floats
    load: Floats
    model: Floats
    slope: Floats

    @classmethod
    def from_channels(
        cls, time: Floats, displacement: Floats, load: Floats, model: Floats, slope: Floats
    ) -> "BranchSamples":
        """Build the branch from its channels, which are in the order of time."""
        sign = 1.0 if displacement[-1] > displacement[0] else -1.0
        moved = sign * (displacement - displacement[0])
        ends = np.linspace(0, moved.size - 1, PIECES + 1).astype(np.int64)
        speeds = np.diff(moved[ends]) / np.maximum(np.diff(time[ends]), 1e-300)
        speed = np.append(np.repeat(speeds, np.diff(ends)), speeds[-1])
        # a load that leads the displacement falls before the end
        order = np.argsort(moved, kind="stable")[: int(BEFORE_END * moved.size)]
        order = order[:: -(-order.size // MOST_OF_BRANCH)]
        return cls(
            sign, *(values[order] for values in (moved, speed, sign * load, sign * model, slope))
        )

    @property
    def position_bin(self) -> Integers:
        """Position bin of each sample; bins of the other direction follow."""
        position_bin: Integers = np.clip(
            (self.moved / self.moved[-1] * POSITION_BINS).astype(np.int64), 0, POSITION_BINS - 1
        )
        return position_bin + POSITION_BINS * int(self.sign < 0)


def _no_effect(branch: BranchSamples) -> Floats:
    return np.zeros(branch.moved.size)


@attrs.frozen
class Fault:
    """Effect of a fault of size 1 on a branch."""

    #: Unit of its size, and a note; empty for another value of a parameter, which is not a fault.
    text: str = ""
    lag: Callable[[BranchSamples], Floats] = _no_effect  #: displacement by which the load lags [m]
    added_load: Callable[[BranchSamples], Floats] = _no_effect  #: load that is added [N]
    two_sided: bool = False  #: whether its size may be negative

    def largest(self, branch: BranchSamples) -> float:
        """Return the size that shifts a branch by its whole stroke, or adds as much as its largest load."""
        lag, added_load = (
            float(np.abs(effect(branch)).max()) for effect in (self.lag, self.added_load)
        )
        return min(
            branch.moved[-1] / lag if lag else np.inf,
            float(np.abs(branch.load).max()) / (added_load or np.inf) or np.inf,
        )


FAULTS = {
    "lag": Fault(
        's: the load is behind the displacement by {size}, or {way}: try shift = "-{size}" at the tangential load',
        lag=lambda branch: branch.speed,
    ),
    "play": Fault(
        'm: the displacement continues by {size} at zero load: try free_play = "{size}" at the displacement',
        lag=lambda branch: (branch.load > 0).astype(float),
    ),
    "parallel": Fault(
        "N/m: the load rises along each stroke by {size}, in both directions, as with a guide, a flexure or a cable "
        'in parallel with the contact: try parallel_stiffness = "{size}" in [instrument], or fit it',
        added_load=lambda branch: branch.moved,
    ),
    "sloping": Fault(
        "N/m: friction varies with the position, by {size}, up on one branch and down on the next, as with a normal "
        "load that changes along the stroke: give its column as normal_load, and not a constant",
        added_load=lambda branch: branch.sign * branch.moved,
        two_sided=True,
    ),
    "other friction": Fault(lag=lambda branch: branch.moved, two_sided=True),
    "other stiffness": Fault(lag=lambda branch: branch.model - branch.model[0], two_sided=True),
}


@attrs.frozen
class Effect:
    """Estimated effect of a fault on a record."""

    size: float
    sure: bool
    explained: float  #: fraction of the squares common to all branches that it explains
    change: float  #: largest change of the load over the largest load


def project_residuals(
    fault: Fault, branches: Sequence[BranchSamples], size: float
) -> tuple[Floats, Floats]:
    """Compute model less load for a fault of a size, and the derivative by it, both less nuisance parameters.

    Both are (branch, sample), with zeros behind the last sample of a branch, which change nothing.
    """
    most_samples = max(branch.moved.size for branch in branches)
    names = "one", "moved", "load", "model", "slope", "lag", "added_load"
    table = np.zeros((len(names), len(branches), most_samples))
    for row, branch in enumerate(branches):
        lag = fault.lag(branch)
        position = branch.moved - size * lag
        table[:, row, : position.size] = (
            np.ones(position.size),
            branch.moved,
            branch.load,
            np.interp(position, branch.moved, branch.model),
            np.interp(position, branch.moved, branch.slope),
            lag,
            fault.added_load(branch),
        )
    one, moved, load, model, slope, lags, added_loads = table
    nuisance = np.stack(
        [one, model - moved * slope, moved * slope, slope * (model - model[:, :1])], axis=-1
    )
    scale = np.maximum(np.linalg.norm(nuisance, axis=1, keepdims=True), 1e-300)
    basis = np.linalg.qr(nuisance / scale)[0]
    columns = np.stack([model + size * added_loads - load, added_loads - slope * lags], axis=-1)
    columns -= basis @ (basis.transpose(0, 2, 1) @ columns)
    return columns[..., 0], columns[..., 1]


def diagnose_residuals(branches: Sequence[BranchSamples], place_deviation: float) -> list[str]:
    """Return a note on the fault that explains most of the residuals, with the key that corrects it; or none.

    `place_deviation` is the standard deviation of the turning points [m].
    """
    if len(branches) < FEWEST_BRANCHES:
        return []
    # pairs of one forward and one backward branch
    chosen = np.linspace(0, len(branches), MOST_BRANCHES // 2, endpoint=False).astype(int) // 2 * 2
    if len(branches) > MOST_BRANCHES:
        branches = [
            branches[pair_start + offset]
            for pair_start in chosen
            for offset in (0, 1)
            if pair_start + offset < len(branches)
        ]
    speed = float(np.median(np.concatenate([branch.speed for branch in branches])))
    effects = {name: estimate_effect(fault, branches) for name, fault in FAULTS.items()}
    explained_by_parameters = max(
        effects[name].explained for name, fault in FAULTS.items() if not fault.text
    )
    name, best = max(effects.items(), key=lambda item: item[1].explained if item[1].sure else -1.0)
    unit, _, text = FAULTS[name].text.partition(": ")
    if (
        not text
        or not best.sure
        or best.change < LEAST
        or best.explained < max(EXPLAINS, explained_by_parameters + AS_GOOD)
    ):
        return []
    if name == "lag" and best.size * speed < OVER_NOISE * place_deviation:
        return []
    description = text.format(
        size=quantity_text(abs(best.size), unit, 3),
        way=quantity_text(abs(best.size) * speed, "m", 3),
    )
    return [
        f"{100 * best.explained:.0f} % of the residual common to all loops looks like this: {description}"
    ]


def estimate_effect(fault: Fault, branches: Sequence[BranchSamples]) -> Effect:
    """Estimate the size of a fault in some branches by least squares, and whether it is significant."""
    from scipy.optimize import minimize_scalar

    def sum_squares(size: float) -> float:
        residuals, _ = project_residuals(fault, branches, size)
        return float(np.sum(residuals**2))

    unfitted, rates = project_residuals(fault, branches, 0.0)
    # the scale: a size that shifts some branch by its whole stroke, or adds as much as its largest
    # load
    unit = min(fault.largest(branch) for branch in branches)
    if fault.lag is _no_effect:
        # the residual is linear in the size
        limit = SIZES[-1] * unit
        size = float(
            np.clip(
                -np.sum(rates * unfitted) / (np.sum(rates**2) or 1.0),
                -limit if fault.two_sided else 0.0,
                limit,
            )
        )
    else:
        tried = unit * np.concatenate([-SIZES[::-1] if fault.two_sided else [], [0.0], SIZES])
        best = min(max(int(np.argmin([sum_squares(size) for size in tried])), 1), tried.size - 2)
        around = tried[[best - 1, best + 1]]
        size = float(minimize_scalar(sum_squares, bounds=around, options={"xatol": 1e-4 * unit}).x)
    residuals, slopes = project_residuals(fault, branches, size)
    share = np.sum(slopes**2, axis=1)
    squares = float(share.sum()) or 1.0
    share /= squares
    moves = np.sum(slopes * residuals, axis=1) / squares
    reach = intervals.compute_wander(
        moves - share * moves.sum(), np.maximum(share, 1e-9), SURE
    ).reach
    in_branch = np.arange(residuals.shape[1]) < [[branch.moved.size] for branch in branches]
    position_bin = np.concatenate([branch.position_bin for branch in branches])
    count = np.maximum(np.bincount(position_bin, minlength=2 * POSITION_BINS), 1)
    squares_unfitted, squares_fitted = (
        float(np.sum(np.bincount(position_bin, values[in_branch], 2 * POSITION_BINS) ** 2 / count))
        for values in (unfitted, residuals)
    )
    largest = max(float(np.abs(branch.load).max()) for branch in branches)
    return Effect(
        size,
        sure=abs(size) > reach,
        explained=1 - squares_fitted / squares_unfitted if squares_unfitted > 0 else 0.0,
        change=float(np.abs(size * slopes).max()) / largest,
    )
