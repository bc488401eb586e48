"""How sure an estimate is, from how it wanders along the record: loops scatter, are correlated, and drift.

Let each loop b move the estimate by h_b, and let it hold the share w_b of all that the record says of the parameter.
The partial sums S of h, less what their total takes of them, wander as the estimate does on its way through the record.
Their mean square, V = 2 ∫ S² dw, measures the long-run variance of the estimate, with all correlation from sample to
sample and from loop to loop, and no bandwidth to choose (Kiefer, Vogelsang and Bunzel, *Econometrica* 68 (2000)
695-714; it is the kernel estimate of Bartlett with a bandwidth of the whole record). As with Student's t, the price of
few degrees of freedom is a wider interval: estimate ± c √V has a c of 4.8 for many loops and 7.8 for four.

Where values of the loops lie on a line that rises or falls, beyond what scatter makes of it, the record drifts. The
estimate is then that of its middle, the line is told, and V is taken of what is left beside it.

`critical_value` has no table. V is a quadratic form h'Qh of normal h with variances ∝ w_b and, from loop to loop, a
correlation ρ^|b-b'|. With a the sum, or the slope, the miss of c √V has the chance P((a'h)² > c² h'Qh): aa' - c²Q has,
in the coordinates of independent numbers, one eigenvalue λ_0 above 0, and

    P(λ_0 Z_0² > Σ |λ_j| Z_j²) = (2/π) ∫_0^{π/2} Π_j (1 + |λ_j/λ_0| / cos²φ)^(-1/2) dφ,

from P(Z² > y) = (1/π) ∫_0^∞ exp(-y (1 + s)/2) / ((1 + s) √s) ds with s = tan²φ. ρ is that with which the ratio of what
is expected of products of neighbours to what is expected of squares is the measured one, and, since few loops hardly
tell it, one standard error √((1 - ρ²)/n) more. In simulations intervals of 95 % then hold the truth in 91 to 97 % for ρ
up to .64 and 8 to 48 loops; without it, down to 79 %.
"""

import math

import attrs
import numpy as np

from historysim.basics.array_types import Floats, Integers

FEWEST_LOOPS = 3
"""Loops below which their scatter says nothing of use."""
FEWEST_FOR_DRIFT = 6
"""Loops from which on a drift is told from scatter."""
MOST_PIECES = 48
"""Pieces that a record is divided into at most; with more of them nothing changes."""
SURE = 0.99
"""Confidence from which on a record is said to drift."""
_MOST_CORRELATED = 0.97
_ANGLES = (np.arange(256) + 0.5) / 256 * math.pi / 2


@attrs.frozen
class Wander:
    """How an estimate wanders along a record."""

    reach: float
    """Half width of its interval; of its value in the middle of the record, where that drifts."""
    rise: float
    rise_reach: float
    """rise and rise_reach: rise of the line through the values of all pieces, from the start to the end of the record,
    and the half width of its interval; NaN for too few pieces."""
    drifts: bool
    """Whether that line is no chance."""
    correlation: float
    """ρ, from piece to piece."""


def wander(moves: Floats, share: Floats, confidence: float) -> Wander:
    """Return how an estimate wanders along a record, and how sure that leaves it.

    Parameters
    ----------
    moves : array (piece)
        By how much each piece moves the estimate, in its unit; three pieces or more.
    share : array (piece)
        Of what the record says of the parameter, each more than 0; they add up to 1.
    confidence : float
        Between 0 and 1.
    """
    plain = TrendLine(share, trend=False)
    correlation = plain.correlation(moves)
    root = math.sqrt(plain.variance(moves))
    reach = root * plain.critical_value(plain.sum, correlation, confidence)
    if moves.size < FEWEST_FOR_DRIFT:
        return Wander(reach, math.nan, math.nan, drifts=False, correlation=correlation)
    line = TrendLine(share, trend=True)
    beside, root = line.correlation(moves), math.sqrt(line.variance(moves))
    rise = float(line.rise @ moves)
    drifts = abs(rise) > root * line.critical_value(line.rise, beside, SURE)
    rise_reach = root * line.critical_value(line.rise, beside, confidence)
    if drifts:
        reach, correlation = root * line.critical_value(line.sum, beside, confidence), beside
    return Wander(reach, rise, rise_reach, drifts=drifts, correlation=correlation)


def of_values(values: Floats, confidence: float) -> Wander | None:
    """Return how a mean of values (piece) that count alike wanders; None for fewer than three."""
    if values.size < FEWEST_LOOPS:
        return None
    # many loops are taken together, so many in each piece
    together = -(-values.size // MOST_PIECES)
    values = values[: values.size // together * together].reshape(-1, together).mean(axis=1)
    count = values.size
    return wander((values - values.mean()) / count, np.full(count, 1 / count), confidence)


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


class TrendLine:
    """The mean of pieces of some shares, or the line through them, as matrices that act on the moves of the pieces."""

    def __init__(self, share: Floats, *, trend: bool) -> None:
        count = share.size
        place = np.cumsum(share) - share / 2
        place = place - share @ place
        basis = np.column_stack([np.ones(count), place])[:, : 2 if trend else 1]
        weighted = share[:, None] * basis
        self._share, self._root = share, np.sqrt(share)
        self._beside = np.eye(count) - weighted @ np.linalg.solve(basis.T @ weighted, basis.T)
        ends = np.cumsum(self._beside, axis=0)
        starts = np.vstack([np.zeros(count), ends[:-1]])
        # 2 ∫ S² dw: the mean of a square between two ends of a straight line, s² + s e + e² = (s² + e² + (s + e)²)/2
        each = np.vstack([starts, ends, starts + ends]) * np.sqrt(np.tile(share, 3) / 3)[:, None]
        self._form = each.T @ each
        self._apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
        self.sum = np.ones(count)
        self.rise = place / (share @ place**2)

    def variance(self, moves: Floats) -> float:
        """Return V = 2 ∫ S² dw."""
        return max(float(moves @ self._form @ moves), 0.0)

    def correlation(self, moves: Floats) -> float:
        """Return ρ from piece to piece, with a standard error more, 0 or more."""
        from scipy.optimize import brentq

        left = self._beside @ moves / self._root
        squares = float(left @ left)
        if squares <= (1e-12 * np.abs(moves).max(initial=0.0)) ** 2:
            return 0.0
        measured = float(left[1:] @ left[:-1]) / squares

        def too_little(correlation: float) -> float:
            expected = self._beside @ self._covariance(correlation) @ self._beside.T / np.outer(self._root, self._root)
            return float(np.trace(expected[1:, :-1]) / np.trace(expected)) - measured

        if too_little(_MOST_CORRELATED) <= 0:
            return _MOST_CORRELATED
        none = too_little(0.0)
        estimate = -none if none >= 0 else float(brentq(too_little, 0, _MOST_CORRELATED, xtol=1e-3))
        error = math.sqrt(max(1 - estimate**2, 0.0) / moves.size)
        return min(max(estimate + error, 0.0), _MOST_CORRELATED)

    def critical_value(self, of: Floats, correlation: float, confidence: float) -> float:
        """Return how many √V the interval of a sum of the moves, each times a number (piece), reaches on both sides."""
        from scipy.optimize import brentq

        independent = np.linalg.cholesky(self._covariance(correlation))
        along, form = independent.T @ of, independent.T @ self._form @ independent
        outside = 1 - confidence

        def too_many(logarithm: float) -> float:
            sizes = np.linalg.eigvalsh(np.outer(along, along) - math.exp(2 * logarithm) * form)
            # far out the largest eigenvalue is lost in rounding, and so is the chance
            ratios = np.maximum(-sizes[:-1], 0.0) / max(sizes[-1], 1e-12 * -sizes[0], 1e-300)
            inside = np.log1p(ratios[:, None] / np.cos(_ANGLES) ** 2)
            return float(np.mean(np.exp(-inside.sum(axis=0) / 2))) - outside

        return math.exp(float(brentq(too_many, math.log(1e-2), math.log(1e6), xtol=1e-4)))

    def _covariance(self, correlation: float) -> Floats:
        covariance: Floats = np.power(correlation, self._apart) * np.outer(self._root, self._root)
        return covariance
