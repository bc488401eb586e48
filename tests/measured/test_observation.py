"""A measurement, and a model along its displacements: the replay without noise, no false reversals with it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pairs import STIFF as PAIR
from pytest import approx, mark

import historysim as hs
from historysim.measured.observation import FEWEST_MEANS, observe
from historysim.measured.reduction import Measurement, estimate_white_noise
from historysim.measured.response import compute_response

BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)
ROUGH = hs.Ensemble(PAIR, [0.0, -20e-9, -50e-9], [1e-3, 2e-3, 5e-4], 0.2)
SOFT = hs.Instrument(lateral_stiffness=5e5)


def record_of(moved, normal_load, load=None, dead_band=0.0):
    moved = np.asarray(moved, dtype=float)
    return Measurement(
        np.arange(float(moved.size)),
        {
            "tangential_displacement": moved,
            "normal_load": np.broadcast_to(normal_load, moved.shape).astype(float),
        },
        {"tangential_load": np.zeros(moved.size) if load is None else load},
        {"tangential_displacement": dead_band},
    )


def assert_as_replayed(ensemble, instrument, record):
    response = compute_response(ensemble, instrument, observe(record))
    history = hs.replay(ensemble, record.events(), instrument=instrument, record="totals")
    force = float(np.abs(history.total_tangential_load).max())
    assert_array_equal(response.displacement, record["tangential_displacement"])
    assert_allclose(
        response.tangential_load, history.total_tangential_load, rtol=0, atol=1e-12 * force
    )
    assert_allclose(response.friction_limit, 0.2 * record["normal_load"], rtol=1e-12)


loads_and_moves = st.lists(
    st.tuples(st.floats(1e-3, 0.1), st.floats(-2e-7, 2e-7)), min_size=2, max_size=30
)


@given(path=loads_and_moves, soft=st.booleans())
def test_free_of_noise_it_is_the_replay(path, soft):
    load, moved = np.array(path).T
    assert_as_replayed(ROUGH, SOFT if soft else hs.Instrument(), record_of(moved, load))


def test_noise_makes_no_reversals():
    """Full slip at the end of each branch: with noise of 3 nm the load stays there, and the replay falls off it."""
    random = np.random.default_rng(5)
    clean = 2e-7 * (np.abs((np.arange(961.0) / 80 + 3) % 4 - 2) - 1)
    noisy = record_of(clean + random.normal(0, 3e-9, clean.size), 0.05, dead_band=3e-8)
    exact = compute_response(BALL, SOFT, observe(record_of(clean, 0.05)))
    walked = compute_response(BALL, SOFT, observe(noisy))
    # a node can be off by some noise, and the load by that times the stiffness in series, for as
    # long as it is steep
    assert np.abs(walked.tangential_load - exact.tangential_load).max() < 5 * 5e5 * 3e-9
    sliding = np.abs(exact.tangential_load) > 0.2 * 0.05 * (1 - 1e-9)
    well_within = sliding & np.roll(sliding, 8) & np.roll(sliding, -8)
    assert well_within.sum() > 300
    assert_allclose(np.abs(walked.tangential_load[well_within]), 0.01, rtol=1e-9)
    replayed = hs.replay(
        BALL, noisy.events(), instrument=SOFT, record="totals"
    ).total_tangential_load.values
    assert np.abs(np.abs(replayed[well_within]) - 0.01).max() > 1e-4


def test_along_a_branch_displacements_are_passed_in_their_order():
    moved = np.array([0, 2, 1, 3, 5, 4, 6, 3, 4, 1, 2, -1.0]) * 1e-8
    observation = observe(record_of(moved, 0.05, dead_band=2.5e-8))
    assert observation.turns.tolist() == [0, 6, 11]
    response = compute_response(BALL, hs.Instrument(), observation)
    assert_allclose(response.displacement, moved, atol=1e-22)
    for branch, sign in ((slice(0, 7), 1), (slice(6, 12), -1)):
        order = np.argsort(sign * moved[branch])
        assert (np.diff(response.tangential_load[branch][order]) * sign >= 0).all()


def test_shifted_nodes_are_where_they_are_said_to_be():
    moved = np.array([0, 5, 10, 5, 0, -5, -10.0]) * 1e-8
    observation = observe(record_of(moved, 0.05), displacement_noise=1e-9)
    moved_to = moved.copy()
    moved_to[2] += 3e-9
    exact = compute_response(BALL, SOFT, observe(record_of(moved_to, 0.05)))
    assert_allclose(
        compute_response(BALL, SOFT, observation, [3e-9]).tangential_load,
        exact.tangential_load,
        rtol=1e-12,
    )


def test_the_stiffness_includes_contact_and_instrument():
    moved = np.array([0, 1e-12, 1e-6, 1.1e-6])
    stick = 8 * 2e10 * (3 * 0.05 * 1e-3 / (4 * 1e11)) ** (1 / 3)
    response = compute_response(BALL, SOFT, observe(record_of(moved, 0.05), displacement_noise=0.0))
    assert response.stiffness[1] == approx(1 / (1 / stick + 1 / 5e5), rel=1e-3)
    assert response.stiffness[3] == approx(0, abs=1e-6 * stick)


# -- observe ---------------------------------------------------------------------------------------


def test_noise_is_estimated_from_the_record():
    random = np.random.default_rng(0)
    smooth = 2e-7 * np.abs((np.arange(4000) / 100 + 3) % 4 - 2)
    # the median of 4000 sizes scatters by 1.3 %, and by more since second differences overlap
    assert estimate_white_noise(smooth + random.normal(0, 1e-9, smooth.size)) == approx(
        1e-9, rel=0.1
    )
    assert estimate_white_noise(smooth) < 1e-20
    assert estimate_white_noise([1.0, 2.0]) == 0


@mark.parametrize("skip, first", [(0, 0), (1, 9), (2, 17)])
def test_loops_are_skipped(skip, first):
    moved = np.concatenate([[0], np.tile([1, 2, 1, 0, -1, -2, -1, 0], 3)]) * 1e-8
    observation = observe(record_of(moved, 0.05), skip=skip)
    assert observation.turns[: 2 * skip + 2].tolist() == [0, 2, 6, 10, 14, 18][: 2 * skip + 2]
    assert observation.start_sample == (observation.turns[1 + 2 * skip] if skip else 0)
    assert observation.start_sample >= first


def test_averaging_keeps_turning_points_and_halves_the_noise_of_four_samples():
    random = np.random.default_rng(0)
    moved = 2e-7 * np.abs((np.arange(40_001) / 1000 + 3) % 4 - 2) + random.normal(0, 1e-9, 40_001)
    observation = observe(record_of(moved, 0.05, dead_band=2e-8))
    averaged = observation.average(10_001)
    assert_allclose(averaged.displacement[averaged.turns], moved[observation.turns], rtol=0)
    assert_allclose(averaged.displacement[averaged.nodes], moved[observation.nodes], rtol=0)
    assert averaged.time.size == approx(10_001, rel=0.01)
    assert (np.diff(averaged.time) > 0).all()
    # the first mean behind the first turning point, of three or four samples, by hand: they are a
    # second apart
    turn, mean = observation.turns[1], averaged.turns[1] + 1
    count = round(2 * (averaged.time[mean] - observation.time[turn]) - 1)
    assert count in (3, 4)
    assert averaged.displacement[mean] == approx(
        moved[turn + 1 : turn + 1 + count].mean(), rel=1e-12
    )
    assert averaged.displacement_noise == approx(0.5e-9, rel=0.1)
    assert averaged.reading_noise == observation.displacement_noise
    assert averaged.remarks[-1][1].endswith("turning points, and means of 4 between them")
    assert observation.average(40_001) is observation


def test_averaging_leaves_enough_of_short_branches():
    moved = 1e-8 * np.abs((np.arange(4001) + 30) % 40 - 20.0)
    observation = observe(record_of(moved, 0.05, dead_band=2e-8))
    # 19 samples between two turning points
    assert (np.diff(observation.average(100).turns)[1:-1] == FEWEST_MEANS + 1).all()


def test_spikes_of_the_displacement_are_no_turning_points():
    clean = 2e-7 * np.abs((np.arange(400) / 20 + 3) % 4 - 2)
    moved = clean.copy()
    moved[[45, 130, 290]] += 1e-7
    observation = observe(record_of(moved, 0.05, dead_band=2e-8))
    assert (
        observation.turns.tolist() == observe(record_of(clean, 0.05, dead_band=2e-8)).turns.tolist()
    )
    text = "3 of 400 readings of the displacement stand out from both neighbours: each is replaced by their mean"
    assert dict(observation.remarks)["spikes"] == text


def test_a_reduced_record_keeps_the_corners_of_both_channels():
    """The path turns a corner where the displacement does not turn: the normal load starts to rise there."""
    moved, load = np.array([0, 1, 2, 3, 4.0]), np.array([1, 1, 1, 2, 3.0])
    record = Measurement(
        np.arange(5.0), {"normal_load": load, "tangential_displacement": moved}, reduced=True
    )
    assert record.replayed_indices().tolist() == [0, 2, 4]
    alone = Measurement(np.arange(5.0), {"normal_load": load}, reduced=True)
    assert alone.replayed_indices().tolist() == [0, 4]
