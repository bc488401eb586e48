"""Intervals from how an estimate wanders: against simulation, closed forms, and a published limit."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from historysim.measured.scatter import critical_value, pieces, wandering


@pytest.mark.parametrize("share", [np.full(4, 0.25), np.array([0.05, 0.2, 0.1, 0.3, 0.15, 0.2])])
def test_five_of_a_hundred_independent_pieces_are_outside(share):
    random = np.random.default_rng(0)
    moves = random.normal(size=(20_000, share.size)) * np.sqrt(share)
    reach = critical_value(share, 0.95)
    outside = np.mean([abs(move.sum()) > reach * np.sqrt(wandering(move, share)) for move in moves])
    # five standard errors of a share of 20 000
    assert outside == pytest.approx(0.05, abs=5 * np.sqrt(0.05 * 0.95 / 20_000))


def test_two_pieces_have_the_quantile_of_cauchy():
    """With two pieces V is (h_1 - h_2)²/6, and the ratio of two normal numbers is Cauchy's."""
    expected = np.tan(0.95 * np.pi / 2) * np.sqrt(6)
    # the quadrature meets a pole near its end, since the quantile is large
    assert critical_value(np.array([0.5, 0.5]), 0.95) == pytest.approx(expected, rel=1e-3)


def test_many_pieces_tend_to_the_limit_of_kiefer_vogelsang_and_bunzel():
    """Their table, with V = ∫ S² in place of twice that: 6.81 at 97.5 %; simulated by them to some 0.5 %."""
    assert critical_value(np.full(150, 1 / 150), 0.95) == pytest.approx(6.811 / np.sqrt(2), rel=0.02)


def test_a_straight_drift_has_the_variance_of_its_closed_form():
    """The value drifts by D from end to end: S is D (r² - r)/2, and V is D²/60."""
    share = np.full(1000, 1e-3)
    moves = share * (np.cumsum(share) - share / 2 - 0.5)
    assert wandering(moves, share) == pytest.approx(1 / 60, rel=1e-5)
    # half a record each: the two means are as far apart as the drift of one half, and both intervals overlap
    assert 2 * critical_value(np.full(24, 1 / 24), 0.95) * np.sqrt(1 / 60) > 1


def test_what_does_not_wander_has_no_variance():
    share = np.array([0.2, 0.5, 0.3])
    assert wandering(0.7 * share, share) == pytest.approx(0, abs=1e-30)
    assert_allclose(wandering(3 * share + [1, -1, 0], share), wandering(np.array([1.0, -1, 0]), share))


def test_pieces_are_whole_loops():
    assert_array_equal(pieces(np.array([0, 5, 10, 15, 20]), 21), [0, 10, 21])
    # the branch behind the last loop belongs to it
    assert_array_equal(pieces(np.array([0, 5, 10, 15, 20, 24]), 25), [0, 10, 25])
    assert_array_equal(pieces(np.array([0, 5]), 6), [0, 6])
    assert pieces(np.arange(0, 4001, 2), 4001).size <= 50
