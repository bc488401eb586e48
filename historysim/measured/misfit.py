"""What a model leaves of measured loops, and where: at reversals, along sliding, or from branch to branch.

Let each sample be at a place of its branch, its share of the way from one turning point to the next. What is left of
the load, e, is split in turn into the mean of e at that place over all branches of a direction, the mean of the rest
over each branch, and what is left of both. Their squares add up to those of e.
"""

import attrs
import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.measured.observation import ModelResponse, Observation

PLACES = 40
"""Places that a branch is divided into."""
SLIDES = 0.95
"""Load of the model over its friction limit from which on it is along sliding."""


@attrs.frozen(eq=False)
class Residuals:
    """What a model leaves of measured loops."""

    rms: float
    """Root of the mean square [N]."""
    largest: float
    """The largest load that was measured [N]."""
    at_reversals: float
    along_sliding: float
    """at_reversals and along_sliding: shares of the squares that are alike in all loops, where the model sticks or
    slips in part, and where it slides."""
    between_branches: float
    """Share that is a branch's own, all along it."""
    place: Floats
    """(direction, place) Share of the way from one turning point to the next [1]."""
    mean: Floats
    """(direction, place) Measured less model load there, over all branches that rise and all that fall [N]; NaN where
    no sample is."""

    @property
    def rest(self) -> float:
        """The share of the squares that is none of these."""
        return max(1 - self.at_reversals - self.along_sliding - self.between_branches, 0.0)

    def text(self) -> str:
        """Return how much is left, and by what."""
        shares = {
            "alike in all loops where the contact sticks or slips in part": self.at_reversals,
            "alike in all loops along sliding": self.along_sliding,
            "from branch to branch": self.between_branches,
            "from sample to sample": self.rest,
        }
        parts = sorted(shares.items(), key=lambda item: -item[1])
        of = ", ".join(f"{100 * share:.0f} % {where}" for where, share in parts if share >= 0.01)
        return f"the model leaves {100 * self.rms / self.largest:.2g} % of the largest load; of its squares {of}"


def what_is_left(observation: Observation, response: ModelResponse, compared: Integers | None = None) -> Residuals:
    """Return what a model leaves of what was measured, and where.

    Parameters
    ----------
    observation : Observation
    response : ModelResponse
    compared : array of int, optional
        The samples that count; by default all that are compared.
    """
    samples = np.arange(observation.first, observation.time.size) if compared is None else compared
    turns, moved = observation.turns, observation.displacement
    branch = np.clip(np.searchsorted(turns, samples, side="right") - 1, 0, turns.size - 2)
    start, way = moved[turns[branch]], moved[turns[branch + 1]] - moved[turns[branch]]
    share = np.divide(moved[samples] - start, way, out=np.zeros(samples.size), where=way != 0)
    falls = (way < 0).astype(np.int64)
    cell = falls * PLACES + np.clip((share * PLACES).astype(np.int64), 0, PLACES - 1)
    off = (observation.tangential_load - response.tangential_load)[samples]
    mean = _means(cell, off, 2 * PLACES)
    alike = np.nan_to_num(mean)[cell]
    own = np.nan_to_num(_means(branch, off - alike, turns.size - 1))[branch]
    limit = response.friction_limit[samples]
    slides = np.abs(response.tangential_load[samples]) >= SLIDES * limit
    total = float(off @ off) or 1.0
    places = np.tile((np.arange(PLACES) + 0.5) / PLACES, (2, 1))
    return Residuals(
        rms=float(np.sqrt(np.mean(off**2))),
        largest=float(np.abs(observation.tangential_load[samples]).max(initial=0.0)) or 1.0,
        at_reversals=float(np.sum(alike[~slides] ** 2)) / total,
        along_sliding=float(np.sum(alike[slides] ** 2)) / total,
        between_branches=float(own @ own) / total,
        place=places,
        mean=mean.reshape(2, PLACES),
    )


def _means(group: Integers, values: Floats, count: int) -> Floats:
    """Return the mean of values in each group, NaN in those without."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.bincount(group, values, count) / np.bincount(group, minlength=count))
