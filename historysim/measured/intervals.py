"""Confidence intervals of an estimate from its variation along the record: scatter, correlation and drift.

README.md of this folder, "How intervals are found", has the statistics and their sources.
"""

import math
from collections.abc import Callable

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers

FEWEST_LOOPS = 3  # fewest loops whose scatter is used
FEWEST_FOR_DRIFT = 6  # fewest loops that distinguish drift from scatter
# Pieces up to which their scatter is so uncertain that Student's interval is the least; the mean of
# fewer loops has it.
FEW_PIECES = 10
MOST_PIECES = 48  # largest number of pieces of a record; more pieces change nothing
SURE = 0.99  # confidence above which a record drifts
_MOST_CORRELATED = 0.97
_SQUARED_COSINES = np.cos((np.arange(256) + 0.5) / 256 * math.pi / 2) ** 2
_MOST_ROOTS = 1e6  # largest critical value
_CORRELATIONS = np.linspace(0, 0.95, 20)
_DECADES_OF_SCATTER = 3
# prior odds of noise alone against scatter beyond noise
_ODDS_OF_NOISE = 3.0


@attrs.frozen
class Wander:
    """Variation of an estimate along a record."""

    reach: float  #: half width of its interval; if the record drifts, of the value in its middle
    rise: float
    #: rise and rise_reach: rise of the line through the values of all pieces, from the start to the
    #: end of the record, and the half width of its interval; NaN for too few pieces.
    rise_reach: float
    drifts: bool  #: whether the rise is significant
    correlation: float  #: ρ between neighbouring pieces


def compute_wander(moves: Floats, share: Floats, confidence: float) -> Wander:
    """Measure the variation of an estimate along a record, and the half width of its interval.

    `moves` (piece) are the influence values of three or more pieces: the change of the estimate by
    each, in its unit. `share` (piece) are their fractions of the information on it, which add up to
    1.
    """
    plain = TrendLine(share, trend=False)
    correlation = plain.correlation(moves)
    root = math.sqrt(plain.variance(moves))
    reach = root * plain.critical_value(plain.sum, correlation, confidence)
    if moves.size < FEWEST_FOR_DRIFT:
        return Wander(reach, math.nan, math.nan, drifts=False, correlation=correlation)
    line = TrendLine(share, trend=True)
    line_correlation = line.correlation(moves)
    root = math.sqrt(line.variance(moves))
    rise = float(line.rise @ moves)
    chance = line.tail_probability(line.rise, line_correlation)
    least_root = max(root, abs(rise) / _MOST_ROOTS)
    drifts = rise != 0 and chance(math.log(abs(rise) / least_root)) < 1 - SURE
    rise_reach = root * line.critical_value(line.rise, line_correlation, confidence)
    if drifts:
        reach = root * line.critical_value(line.sum, line_correlation, confidence)
        correlation = line_correlation
    return Wander(reach, rise, rise_reach, drifts=drifts, correlation=correlation)


def compute_half_width(
    moves: Floats,
    share: Floats,
    noise: float,
    confidence: float,
    *,
    sides: bool = False,
    line: bool = False,
) -> float:
    """Compute the half width of the interval of an estimate from its influence values, averaged over noise models.

    `noise` is the standard deviation of the estimate if residuals are noise alone. With `sides` the
    pieces are branches, alternately forward and backward, which may differ by an offset of the
    load; with `line` the record drifts.
    """
    from scipy import special
    from scipy.optimize import brentq

    root = np.sqrt(share)
    position = np.cumsum(share) - share / 2
    turn = np.where(np.arange(share.size) % 2, -1.0, 1.0)
    fitted = np.column_stack(
        [
            root,
            *([root * turn] if sides else []),
            *([root * (position - share @ position)] if line else []),
        ]
    )
    complement = np.linalg.qr(fitted, mode="complete")[0][:, fitted.shape[1] :]
    residuals = complement.T @ (moves / root)
    count = residuals.size
    squares = float(residuals @ residuals)
    if squares <= (1e-12 * np.abs(moves).max(initial=0.0)) ** 2:
        return 0.0
    lag = np.abs(np.subtract.outer(np.arange(share.size), np.arange(share.size)))
    prior = np.log(
        (1 - _CORRELATIONS) / (1 - _CORRELATIONS).sum() / (_DECADES_OF_SCATTER * math.log(10))
    )
    prior += math.lgamma(count / 2) - math.log(2) - count / 2 * math.log(math.pi)
    # logarithm of the weight, centre, deviation, degrees of freedom
    cases = []
    if noise > 0:
        noise_ratio = min(math.sqrt(squares) / noise, 1e100)
        evidence = (
            math.log(_ODDS_OF_NOISE)
            - count * math.log(noise)
            - (count * math.log(2 * math.pi) + noise_ratio**2) / 2
        )
        cases = [(evidence, 0.0, noise, 1e9)]
    for log_prior, correlation in zip(prior, _CORRELATIONS, strict=True):
        covariance = np.power(correlation, lag)
        lower = np.linalg.cholesky(complement.T @ covariance @ complement)
        white_residuals, white_root = np.linalg.solve(
            lower, np.column_stack([residuals, complement.T @ covariance @ root])
        ).T
        white_squares = float(white_residuals @ white_residuals)
        evidence = log_prior - np.log(np.diag(lower)).sum() - count / 2 * math.log(white_squares)
        variance = (
            max(float(root @ covariance @ root - white_root @ white_root), 0.0)
            * white_squares
            / count
        )
        cases.append((evidence, float(white_root @ white_residuals), math.sqrt(variance), count))
    weight, centre, deviation, freedom = np.array(cases).T
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()

    def inside(width: float) -> float:
        probabilities = (
            special.stdtr(freedom, (bound - centre) / deviation) for bound in (width, -width)
        )
        return float(weight @ np.subtract(*probabilities)) - confidence

    upper = float((np.abs(centre) + deviation).max())
    while inside(upper) < 0:
        upper *= 2
    return float(brentq(inside, 0.0, upper, rtol=1e-6))


def student_factor(freedom: float, confidence: float) -> float:
    """Half width of Student's interval over the standard error, for some degrees of freedom."""
    # scipy.stats takes a second to import, and has the same function
    from scipy.special import stdtrit

    return float(stdtrit(freedom, (1 + confidence) / 2))


def compute_student_half_width(moves: Floats, share: Floats, confidence: float) -> float:
    """Compute the half width of Student's interval of an estimate from its influence values, for independent pieces."""
    # a piece is part of the mean that it is compared with
    variance = float(np.sum(moves**2 / np.maximum(1 - share, 1 / (2 * share.size))))
    return student_factor(share.size - 1, confidence) * math.sqrt(variance)


def compute_mean_wander(values: Floats, confidence: float) -> Wander | None:
    """Measure the variation of a mean of equally weighted values (piece); None for fewer than three."""
    if values.size < FEWEST_LOOPS:
        return None
    # many loops are grouped into pieces of equal size
    piece_size = -(-values.size // MOST_PIECES)
    values = values[: values.size // piece_size * piece_size].reshape(-1, piece_size).mean(axis=1)
    count = values.size
    wander = compute_wander((values - values.mean()) / count, np.full(count, 1 / count), confidence)
    if count >= FEW_PIECES:
        return wander
    # so few do not show a correlation: Student's interval, of the mean or of the middle of the line
    place = np.arange(count) if wander.drifts else np.zeros(count)
    residuals = values - np.polyval(np.polyfit(place, values, int(wander.drifts)), place)
    freedom = count - 1 - int(wander.drifts)
    error = math.sqrt(float(residuals @ residuals) / freedom / count)
    return attrs.evolve(wander, reach=student_factor(freedom, confidence) * error)


def split_into_pieces(turns: Integers, size: int) -> Integers:
    """Return the first sample of each piece of a record, each of one or more loops, and the record's size.

    `turns` are the turning points compared, with the first and the last sample.
    """
    starts = turns[:-1:2]
    # samples after the last whole loop belong to it
    starts = starts[:-1] if starts.size > 1 and turns.size % 2 == 0 else starts
    stride = -(-starts.size // MOST_PIECES)
    return np.append(starts[: starts.size // stride * stride : stride], size)


class TrendLine:
    """Weighted mean of pieces, or line through them, as matrices that act on the influence values of the pieces."""

    def __init__(self, share: Floats, *, trend: bool) -> None:
        count = share.size
        position = np.cumsum(share) - share / 2
        position = position - share @ position
        basis = np.column_stack([np.ones(count), position])[:, : 2 if trend else 1]
        weighted = share[:, None] * basis
        self._share = share
        self._root = np.sqrt(share)
        self._detrend = np.eye(count) - weighted @ np.linalg.solve(basis.T @ weighted, basis.T)
        ends = np.cumsum(self._detrend, axis=0)
        starts = np.vstack([np.zeros(count), ends[:-1]])
        # 2 ∫ S² dw: the mean of a square between two ends of a straight line, s² + s e + e² = (s² +
        # e² + (s + e)²)/2
        factors = np.vstack([starts, ends, starts + ends]) * np.sqrt(np.tile(share, 3) / 3)[:, None]
        self._form = factors.T @ factors
        self._lag = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
        self.sum = np.ones(count)
        self.rise = position / (share @ position**2)

    def variance(self, moves: Floats) -> float:
        """Return V = 2 ∫ S² dw."""
        return max(float(moves @ self._form @ moves), 0.0)

    def correlation(self, moves: Floats) -> float:
        """Estimate ρ between neighbouring pieces plus one standard error, 0 or more."""
        from scipy.optimize import brentq

        residuals = self._detrend @ moves / self._root
        squares = float(residuals @ residuals)
        if squares <= (1e-12 * np.abs(moves).max(initial=0.0)) ** 2:
            return 0.0
        measured = float(residuals[1:] @ residuals[:-1]) / squares

        def excess_correlation(correlation: float) -> float:
            expected = (
                self._detrend
                @ self._covariance(correlation)
                @ self._detrend.T
                / np.outer(self._root, self._root)
            )
            return float(np.trace(expected[1:, :-1]) / np.trace(expected)) - measured

        if excess_correlation(_MOST_CORRELATED) <= 0:
            return _MOST_CORRELATED
        at_zero = excess_correlation(0.0)
        estimate = (
            -at_zero
            if at_zero >= 0
            else float(brentq(excess_correlation, 0, _MOST_CORRELATED, xtol=1e-3))
        )
        error = math.sqrt(max(1 - estimate**2, 0.0) / moves.size)
        return min(max(estimate + error, 0.0), _MOST_CORRELATED)

    def critical_value(self, weights: Floats, correlation: float, confidence: float) -> float:
        """Compute c such that ± c √V is the interval of a weighted sum of the influence values (piece)."""
        from scipy.optimize import brentq

        tail = self.tail_probability(weights, correlation)
        outside = 1 - confidence
        largest = math.log(_MOST_ROOTS)
        if tail(largest) > outside:
            # one piece has nearly all the information, so the others show no scatter
            return math.inf
        bracket = math.log(1e-2), largest
        return math.exp(float(brentq(lambda at: tail(at) - outside, *bracket, xtol=1e-4)))

    def tail_probability(self, weights: Floats, correlation: float) -> Callable[[float], float]:
        """Return the probability that a weighted sum of influence values exceeds c √V, as a function of log c."""
        independent = np.linalg.cholesky(self._covariance(correlation))
        along = independent.T @ weights
        form = independent.T @ self._form @ independent
        squared = np.outer(along, along)

        def probability(logarithm: float) -> float:
            sizes = np.linalg.eigvalsh(squared - math.exp(2 * logarithm) * form)
            # in the tail the largest eigenvalue is lost in rounding, and the probability with it
            ratios = np.maximum(-sizes[:-1], 0.0) / max(sizes[-1], 1e-12 * -sizes[0], 1e-300)
            # a product beyond the largest float is a probability of 0
            with np.errstate(over="ignore"):
                return float(
                    np.mean(np.prod(1 + ratios[:, None] / _SQUARED_COSINES, axis=0) ** -0.5)
                )

        return probability

    def _covariance(self, correlation: float) -> Floats:
        covariance: Floats = np.power(correlation, self._lag) * np.outer(self._root, self._root)
        return covariance
