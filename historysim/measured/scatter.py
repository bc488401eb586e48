"""How sure an estimate is, from how it wanders along the record: loops scatter, are correlated, and drift.

README.md of this folder, "How intervals are found", has the statistics and their sources.
"""

import math

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers

FEWEST_LOOPS = 3  # loops below which their scatter is not used
FEWEST_FOR_DRIFT = 6  # loops from which on a drift is distinguished from scatter
MOST_PIECES = 48  # pieces that a record is divided into at most; with more of them nothing changes
SURE = 0.99  # confidence from which on a record drifts
_MOST_CORRELATED = 0.97
_ANGLES = (np.arange(256) + 0.5) / 256 * math.pi / 2
_CORRELATIONS = np.linspace(0, 0.95, 20)
_DECADES_OF_SCATTER = 3
# how much likelier than scatter beyond noise it is beforehand that noise is all
_ODDS_OF_NOISE = 3.0


@attrs.frozen
class Wander:
    """How an estimate wanders along a record."""

    reach: float  #: half width of its interval; of its value in the middle of the record, where that drifts
    rise: float
    #: rise and rise_reach: rise of the line through the values of all pieces, from the start to the end of the record,
    #: and the half width of its interval; NaN for too few pieces.
    rise_reach: float
    drifts: bool  #: whether that line is no chance
    correlation: float  #: ρ, from piece to piece


def wander(moves: Floats, share: Floats, confidence: float) -> Wander:
    """Return how an estimate wanders along a record, and how sure that leaves it.

    Moves (piece) are what each of three or more pieces moves the estimate by, in its unit; shares (piece), which add up
    to 1, are of what the record knows of it.
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


def reach(
    moves: Floats, share: Floats, noise: float, confidence: float, *, sides: bool = False, line: bool = False
) -> float:
    """Return the half width of the interval of an estimate, by what pieces of a record move it by.

    The noise is the standard deviation of the estimate, were all that is left noise. Sides: pieces are branches, in
    turn forward and backward, that may differ, so that an offset of the load does no harm. Line: the record drifts.
    """
    from scipy import optimize, stats

    root, place = np.sqrt(share), np.cumsum(share) - share / 2
    turn = np.where(np.arange(share.size) % 2, -1.0, 1.0)
    fitted = np.column_stack(
        [root, *([root * turn] if sides else []), *([root * (place - share @ place)] if line else [])]
    )
    beside = np.linalg.qr(fitted, mode="complete")[0][:, fitted.shape[1] :]
    left = beside.T @ (moves / root)
    count, squares = left.size, float(left @ left)
    if squares <= (1e-12 * np.abs(moves).max(initial=0.0)) ** 2:
        return 0.0
    apart = np.abs(np.subtract.outer(np.arange(share.size), np.arange(share.size)))
    prior = np.log((1 - _CORRELATIONS) / (1 - _CORRELATIONS).sum() / (_DECADES_OF_SCATTER * math.log(10)))
    prior += math.lgamma(count / 2) - math.log(2) - count / 2 * math.log(math.pi)
    # logarithm of the weight, centre, deviation, degrees of freedom
    cases = []
    if noise > 0:
        over = min(math.sqrt(squares) / noise, 1e100)
        evidence = math.log(_ODDS_OF_NOISE) - count * math.log(noise) - (count * math.log(2 * math.pi) + over**2) / 2
        cases = [(evidence, 0.0, noise, 1e9)]
    for likely, correlation in zip(prior, _CORRELATIONS, strict=True):
        covariance = np.power(correlation, apart)
        lower = np.linalg.cholesky(beside.T @ covariance @ beside)
        of_left, of_root = np.linalg.solve(lower, np.column_stack([left, beside.T @ covariance @ root])).T
        sum_of = float(of_left @ of_left)
        evidence = likely - np.log(np.diag(lower)).sum() - count / 2 * math.log(sum_of)
        variance = max(float(root @ covariance @ root - of_root @ of_root), 0.0) * sum_of / count
        cases.append((evidence, float(of_root @ of_left), math.sqrt(variance), count))
    weight, centre, deviation, freedom = np.array(cases).T
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()

    def inside(width: float) -> float:
        ends = (stats.t.cdf((end - centre) / deviation, freedom) for end in (width, -width))
        return float(weight @ np.subtract(*ends)) - confidence

    most = float((np.abs(centre) + deviation).max())
    while inside(most) < 0:
        most *= 2
    return float(optimize.brentq(inside, 0.0, most, rtol=1e-6))


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
    """Return the first sample of each piece of a record, of one loop or several, and at last its size.

    Turns are those that are compared, with the first and the last sample.
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

        largest = math.log(1e6)
        if too_many(largest) > 0:
            # one piece holds nearly all that the record knows, so the others show no scatter
            return math.inf
        return math.exp(float(brentq(too_many, math.log(1e-2), largest, xtol=1e-4)))

    def _covariance(self, correlation: float) -> Floats:
        covariance: Floats = np.power(correlation, self._apart) * np.outer(self._root, self._root)
        return covariance
