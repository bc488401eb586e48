"""How sure an estimate is, from how it wanders along the record: loops scatter, and what is left of them drifts.

Let each loop b move the estimate by h_b, and let it hold the share w_b of all that the record says of the parameter.
The partial sums S of h, less what their total takes of them, wander as the estimate does on its way through the record.
Their mean square, V = 2 ∫ S² dw, measures the long-run variance of the estimate, with all correlation from sample to
sample and from loop to loop, and no bandwidth to choose (Kiefer, Vogelsang and Bunzel, *Econometrica* 68 (2000)
695-714; it is the kernel estimate of Bartlett with a bandwidth of the whole record). The price is a wider interval:
estimate ± c √V has a c of 4.8 for many loops and 7.8 for four.

`critical_value` has no table. Of normal h_b with variances ∝ w_b, V is Σ λ_j Z_j² and independent of the estimate Z:

    P(Z² > c² V) = (2/π) ∫_0^{π/2} Π_j (1 + c² λ_j / cos²φ)^(-1/2) dφ,

from P(Z² > y) = (1/π) ∫_0^∞ exp(-y (1 + s)/2) / ((1 + s) √s) ds with s = tan²φ.
"""

import math

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

FEWEST_LOOPS = 3
"""Loops below which their scatter says nothing of use."""
MOST_PIECES = 48
"""Pieces that a record is divided into at most; with more of them nothing changes."""
_ANGLES = (np.arange(256) + 0.5) / 256 * math.pi / 2


def pieces(turns: Integers, size: int) -> Integers:
    """Return where a record is divided: at every second turning point, so that each piece is a loop or several.

    Parameters
    ----------
    turns : array of int (turn)
        Samples of the turning points that are compared, with the first and the last sample.
    size : int
        Number of samples.

    Returns
    -------
    array of int (piece + 1)
        The first sample of each piece, and at last `size`.
    """
    starts = turns[:-1:2]
    # what is left behind the last whole loop belongs to it
    starts = starts[:-1] if starts.size > 1 and turns.size % 2 == 0 else starts
    stride = -(-starts.size // MOST_PIECES)
    return np.append(starts[: starts.size // stride * stride : stride], size)


def wandering(moves: Floats, share: Floats) -> float:
    """Return V = 2 ∫ S² dw, the variance of an estimate by how it wanders.

    Parameters
    ----------
    moves : array (piece)
        By how much each piece moves the estimate, in its unit.
    share : array (piece)
        Of what the record says of the parameter; they add up to 1.
    """
    ends = np.cumsum(moves - share * moves.sum())
    starts = np.append(0.0, ends[:-1])
    # the mean of a square between two ends of a straight line
    return 2 * float(share @ (starts**2 + starts * ends + ends**2)) / 3


def critical_value(share: Floats, confidence: float) -> float:
    """Return how many √V the interval reaches on both sides, where the pieces scatter independently.

    Parameters
    ----------
    share : array (piece)
        As in `wandering`; three pieces or more.
    confidence : float
        Between 0 and 1.
    """
    from scipy.optimize import brentq

    sizes = _sizes(share)
    outside = 1 - confidence

    def too_many(logarithm: float) -> float:
        inside = np.log1p(math.exp(2 * logarithm) * sizes[:, None] / np.cos(_ANGLES) ** 2)
        return float(np.mean(np.exp(-inside.sum(axis=0) / 2))) - outside

    return math.exp(float(brentq(too_many, math.log(1e-2), math.log(1e6))))


def _sizes(share: Floats) -> Floats:
    """Return the λ of V = Σ λ_j Z_j² for moves of variance `share`."""
    count = share.size
    spread = np.sqrt(share)
    # S at the ends of the pieces, as a matrix that acts on independent numbers of variance 1
    ends = np.tril(np.ones((count, count))) * spread - np.outer(np.cumsum(share), spread)
    starts = np.vstack([np.zeros(count), ends[:-1]])
    # as in `wandering`: s² + s e + e² is half of s² + e² + (s + e)²
    each = np.vstack([starts, ends, starts + ends]) * np.sqrt(np.tile(share, 3) / 3)[:, None]
    sizes = np.linalg.svd(each, compute_uv=False) ** 2
    return np.asarray(sizes[sizes > 1e-12 * sizes.max()], dtype=np.float64)
