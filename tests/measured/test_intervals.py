"""Intervals from how an estimate wanders: against simulation, closed forms, and a published limit."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, mark, param
from scipy import stats

from historysim.measured.intervals import (
    TrendLine,
    compute_half_width,
    compute_mean_wander,
    compute_student_half_width,
    compute_wander,
    split_into_pieces,
)

EVEN = np.full(16, 1 / 16)


def drawn(random, share, correlation=0.0):
    covariance = np.power(
        correlation, np.abs(np.subtract.outer(np.arange(share.size), np.arange(share.size)))
    )
    return np.linalg.cholesky(covariance) @ random.normal(size=share.size) * np.sqrt(share)


@mark.parametrize(
    "share, trend, correlation",
    [
        (np.full(4, 0.25), False, 0.6),
        (np.array([0.05, 0.2, 0.1, 0.3, 0.15, 0.2]), True, 0.6),
        (np.array([0.05, 0.2, 0.1, 0.3, 0.15, 0.2]), False, 0.0),
    ],
)
def test_five_of_a_hundred_records_are_outside(share, trend, correlation):
    """With the correlation known."""
    random = np.random.default_rng(0)
    line = TrendLine(share, trend=trend)
    for of in (line.sum, line.rise)[: 1 + trend]:
        reach = line.critical_value(of, correlation, 0.95)
        moves = [drawn(random, share, correlation) for _ in range(2_000)]
        outside = np.mean([abs(of @ move) > reach * np.sqrt(line.variance(move)) for move in moves])
        # five standard errors of a share of 2 000
        assert outside == approx(0.05, abs=5 * np.sqrt(0.05 * 0.95 / 2_000))


def test_two_pieces_have_the_quantile_of_cauchy():
    """With two pieces V is (h_1 - h_2)²/6, and the ratio of two normal numbers is Cauchy's."""
    expected = np.tan(0.95 * np.pi / 2) * np.sqrt(6)
    line = TrendLine(np.array([0.5, 0.5]), trend=False)
    # the quadrature meets a pole near its end, since the quantile is large
    assert line.critical_value(line.sum, 0.0, 0.95) == approx(expected, rel=1e-3)


def test_many_pieces_tend_to_the_limit_of_kiefer_vogelsang_and_bunzel():
    """Their table, with V = ∫ S² in place of twice that: 6.81 at 97.5 %; simulated by them to some 0.5 %."""
    line = TrendLine(np.full(150, 1 / 150), trend=False)
    assert line.critical_value(line.sum, 0.0, 0.95) == approx(6.811 / np.sqrt(2), rel=0.02)


def test_a_straight_drift_has_the_variance_of_its_closed_form():
    """The value drifts by D from end to end: S is D (r² - r)/2, and V is D²/60."""
    share = np.full(300, 1 / 300)
    moves = share * (np.cumsum(share) - share / 2 - 0.5)
    assert TrendLine(share, trend=False).variance(moves) == approx(1 / 60, rel=1e-4)
    line = TrendLine(share, trend=True)
    assert line.variance(moves) == approx(0, abs=1e-20)
    assert line.rise @ moves == approx(1)


def test_constant_pieces_have_no_variance():
    share = np.array([0.2, 0.5, 0.3])
    line = TrendLine(share, trend=False)
    assert line.variance(0.7 * share) == approx(0, abs=1e-15)
    assert_allclose(line.variance(3 * share + [1, -1, 0]), line.variance(np.array([1.0, -1, 0])))
    assert compute_wander(np.zeros(16), EVEN, 0.95).reach == 0
    assert compute_mean_wander(np.array([1.0, 2.0]), 0.95) is None


def test_intervals_hold_the_truth_with_unknown_correlation():
    random = np.random.default_rng(1)
    held = [
        abs(moves.sum()) <= compute_wander(moves, EVEN, 0.95).reach
        for moves in (drawn(random, EVEN, 0.7) for _ in range(100))
    ]
    # two standard errors of 100 below what thousands showed
    assert 0.87 - 2 * np.sqrt(0.08 / 100) <= np.mean(held)


@mark.parametrize("count", [3, 5, 9])
def test_few_loops_have_students_interval(count):
    random = np.random.default_rng(3)
    for values in random.normal(2, 0.1, (20, count)):
        wander = compute_mean_wander(values, 0.95)
        low, high = stats.t.interval(0.95, count - 1, values.mean(), stats.sem(values))
        assert wander.drifts or wander.reach == approx((high - low) / 2)
    # correlated neighbours of a few loops once had fourteen standard deviations
    rising = np.array([1.0, 1.1, 1.2, 1.3, 1.4])
    assert compute_mean_wander(rising, 0.95).reach < 1.5 * rising.std(ddof=1)
    line = np.arange(count) + random.normal(0, 0.01, count)
    if count == 9:
        assert compute_mean_wander(line, 0.95).drifts
        assert compute_mean_wander(line, 0.95).reach < 0.03


def test_a_drift_is_recognised():
    random = np.random.default_rng(2)
    place = (np.arange(16) + 0.5) / 16 - 0.5
    values = 3 + 2 * place + random.normal(0, 0.1, 16)
    found = compute_mean_wander(values, 0.95)
    assert found.drifts
    assert abs(found.rise - 2) < found.rise_reach < 0.5
    # the mean is as sure as the scatter about the line leaves it
    assert found.reach < 0.3
    assert sum(compute_mean_wander(random.normal(size=16), 0.95).drifts for _ in range(100)) <= 5


def test_pieces_are_whole_loops():
    assert_array_equal(split_into_pieces(np.array([0, 5, 10, 15, 20]), 21), [0, 10, 21])
    # the branch behind the last loop belongs to it
    assert_array_equal(split_into_pieces(np.array([0, 5, 10, 15, 20, 24]), 25), [0, 10, 25])
    assert_array_equal(split_into_pieces(np.array([0, 5]), 6), [0, 6])
    assert split_into_pieces(np.arange(0, 4001, 2), 4001).size <= 50


@mark.parametrize("count, correlation, least", [(8, 0.0, 0.93), (32, 0.6, 0.89)])
def test_a_reach_holds_and_is_hardly_wider_than_the_scatter(count, correlation, least):
    """Known noise, or scatter four times as great of which the noise says nothing; an offset does no harm."""
    random = np.random.default_rng(4)
    share = np.full(count, 1 / count)
    offset = np.where(np.arange(count) % 2, -1.0, 1.0) * share
    for times in (1.0, 4.0):
        sums, reaches = [], []
        for _ in range(100):
            moves = times * drawn(random, share, correlation)
            sums.append(moves.sum())
            left = moves - share * moves.sum() + 20 * offset
            reaches.append(compute_half_width(left, share, 1.0, 0.95, sides=True))
        held = np.mean(np.abs(sums) <= reaches)
        # two standard errors of 100
        assert held >= least - 2 * np.sqrt(0.06 / 100)
        assert np.mean(reaches) < (2.2 if count == 8 else 1.5) * 1.96 * np.std(sums)


def test_the_reach_of_independent_pieces_equals_students():
    """Where 48 pieces tell that nothing is correlated, what is averaged over adds little to Student's interval."""
    random = np.random.default_rng(5)
    share = np.full(48, 1 / 48)
    found, expected = [], []
    for _ in range(40):
        moves = random.normal(size=48) / np.sqrt(48)
        moves -= moves.mean()
        found.append(compute_half_width(moves, share, 0.0, 0.95))
        expected.append(stats.t.ppf(0.975, 47) * np.sqrt(48 / 47 * moves @ moves))
    assert 0.95 < np.mean(found) / np.mean(expected) < 1.4
    assert compute_half_width(np.zeros(48), share, 1.0, 0.95) == 0


@mark.parametrize(
    "records, pieces",
    [
        (1_000, 3),
        (1_000, 10),
        *(param(20_000, n, marks=mark.slow) for n in (3, 4, 5, 10)),
    ],
)
@mark.parametrize("even", [True, False])
def test_few_independent_pieces_hold_the_truth(records, pieces, even):
    """The estimate is the mean of pieces weighted by their information, and pieces scatter in proportion to it."""
    random = np.random.default_rng(pieces)
    share = (
        np.full(pieces, 1 / pieces)
        if even
        else (1 + np.arange(pieces)) / (1 + np.arange(pieces)).sum()
    )
    values = random.normal(size=(records, pieces)) / np.sqrt(share)
    estimates = values @ share
    moves = share * (values - estimates[:, None])
    reaches = np.array([compute_student_half_width(move, share, 0.95) for move in moves])
    held = np.mean(np.abs(estimates) <= reaches)
    # with even pieces the interval is Student's; five standard errors of the count
    assert held == approx(0.95, abs=5 * np.sqrt(0.05 * 0.95 / records) + (0.0 if even else 0.015))
