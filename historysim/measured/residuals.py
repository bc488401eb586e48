"""Residuals of a model along an observation, and their distribution over positions and branches."""

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.measured.observation import Observation
from historysim.measured.response import ModelResponse

POSITION_BINS = 40  # position bins of a branch
SLIDES = 0.95  # load of the model over its friction limit above which the contact counts as sliding


@attrs.frozen(eq=False)
class Residuals:
    """Residuals of a model along measured loops, and their distribution."""

    rms: float  #: root of the mean square [N]
    largest: float  #: the largest load that was measured [N]
    at_reversals: float
    #: at_reversals and along_sliding: fractions of the sum of squares that recur in all loops, in
    #: stick or partial slip of the model, and in sliding.
    along_sliding: float
    between_branches: float  #: fraction due to a constant offset of each branch
    #: (direction, bin) Fraction of the distance from one turning point to the next [1]
    position: Floats
    #: (direction, bin) Mean of measured less model load over all branches of a direction [N]; NaN
    #: in empty bins.
    mean: Floats

    def text(self) -> str:
        """Describe the size of the residuals and their distribution."""
        shares = {
            "the same in all loops before sliding": self.at_reversals,
            "the same in all loops during sliding": self.along_sliding,
            "offsets of branches": self.between_branches,
            "noise": 1 - self.at_reversals - self.along_sliding - self.between_branches,
        }
        ranked = sorted(shares.items(), key=lambda item: -item[1])
        breakdown = ", ".join(
            f"{100 * share:.0f} % {where}" for where, share in ranked if share >= 0.01
        )
        return f"rms residual {100 * self.rms / self.largest:.2g} % of the largest load; of its square {breakdown}"


def compute_residuals(
    observation: Observation, response: ModelResponse, compared: Integers | None = None
) -> Residuals:
    """Compute the residuals of a model at the samples compared, and their distribution.

    The position of a sample is its fraction of the distance from one turning point to the next.
    Residuals are split into their mean at a position over all branches of a direction, the mean of
    the rest over each branch, and the remainder; the three sums of squares add up.
    """
    samples = (
        np.arange(observation.start_sample, observation.time.size) if compared is None else compared
    )
    turns = observation.turns
    branch = _find_branches(turns, samples)
    cell = assign_position_bins(observation, samples)
    residual = (observation.tangential_load - response.tangential_load)[samples]
    mean = _means(cell, residual, 2 * POSITION_BINS)
    common = np.nan_to_num(mean)[cell]
    branch_offset = np.nan_to_num(_means(branch, residual - common, turns.size - 1))[branch]
    limit = response.friction_limit[samples]
    slides = np.abs(response.contact_load[samples]) >= SLIDES * limit
    total = float(residual @ residual) or 1.0
    positions = np.tile((np.arange(POSITION_BINS) + 0.5) / POSITION_BINS, (2, 1))
    return Residuals(
        rms=float(np.sqrt(np.mean(residual**2))),
        largest=float(np.abs(observation.tangential_load[samples]).max(initial=0.0)) or 1.0,
        at_reversals=float(np.sum(common[~slides] ** 2)) / total,
        along_sliding=float(np.sum(common[slides] ** 2)) / total,
        between_branches=float(branch_offset @ branch_offset) / total,
        position=positions,
        mean=mean.reshape(2, POSITION_BINS),
    )


def assign_position_bins(observation: Observation, samples: Integers) -> Integers:
    """Return the position bin of samples on their branches, falling branches after rising ones."""
    turns = observation.turns
    displacement = observation.displacement
    branch = _find_branches(turns, samples)
    start = displacement[turns[branch]]
    stroke = displacement[turns[branch + 1]] - displacement[turns[branch]]
    fraction = np.divide(
        displacement[samples] - start, stroke, out=np.zeros(samples.size), where=stroke != 0
    )
    falls = (stroke < 0).astype(np.int64)
    bins: Integers = falls * POSITION_BINS + np.clip(
        (fraction * POSITION_BINS).astype(np.int64), 0, POSITION_BINS - 1
    )
    return bins


def _find_branches(turns: Integers, samples: Integers) -> Integers:
    branch: Integers = np.clip(np.searchsorted(turns, samples, side="right") - 1, 0, turns.size - 2)
    return branch


def _means(group: Integers, values: Floats, count: int) -> Floats:
    """Compute the mean of values in each group, NaN in empty ones."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.bincount(group, values, count) / np.bincount(group, minlength=count))
