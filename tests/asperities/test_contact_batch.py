"""Independent contacts, in batches: each is that of an ensemble of one asperity."""

import numpy as np
from golden import check_messages
from numpy.testing import assert_array_equal
from pairs import PLAIN as PAIR
from pytest import approx, mark, raises

import historysim as hs

THETA = 2.0 / 1.2


def random_walk(rng, count, steps):
    """Approaches and displacements of contacts that come and go, slip, stick, turn and return to where they were."""
    approach = rng.uniform(-0.02, 0.1, (steps, count))
    displacement = THETA * 0.4 * 0.1 * rng.uniform(-1.5, 1.5, (steps, count))
    held = rng.random((steps, count))
    for k in range(1, steps):
        approach[k] = np.where(held[k] < 0.4, approach[k - 1], approach[k])
        back = rng.integers(0, k, count)
        displacement[k] = np.where(
            held[k] > 0.7, displacement[back, np.arange(count)], displacement[k]
        )
    return approach, displacement


@mark.parametrize("seed", range(2))
def test_each_contact_is_an_ensemble_of_one_asperity(seed):
    rng = np.random.default_rng(seed)
    count, steps = 12, 60
    radius, friction = rng.uniform(0.5, 2.0, count), rng.uniform(0.2, 0.6, count)
    approach, displacement = random_walk(rng, count, steps)
    batch = hs.ContactBatch(PAIR, radius, friction, count)
    loads = np.empty((2, steps, count))
    for k in range(steps):
        batch.step(approach[k], displacement[k])
        loads[:, k] = batch.normal_load, batch.tangential_load
    for i in range(count):
        single = hs.Ensemble(PAIR, 0.0, radius[i], friction[i])
        state = single.initial_state()
        for k in range(steps):
            state = single.advance(
                state,
                normal_displacement=approach[k, i],
                tangential_displacement=displacement[k, i],
            )
            assert loads[0, k, i] == approx(state.normal_load, rel=1e-13)
            # rounding of the displacements, with the greatest stiffness
            assert loads[1, k, i] == approx(
                state.tangential_load, abs=1e-13 * 4 * radius.max() * 0.1**1.5
            )


def test_a_deep_memory_finds_room():
    turns = 300
    batch = hs.ContactBatch(PAIR, 1.0, 0.4, 3)
    single = hs.Ensemble(PAIR, 0.0, 1.0, 0.4)
    way = 0.03 * (-1.0) ** np.arange(turns) * (1 - np.arange(turns) / (turns + 5))
    state = single.advance(single.initial_state(), normal_displacement=0.1)
    # the first and the last rest, the middle one remembers
    batch.step(np.full(3, 0.1), np.zeros(3))
    for displacement in way:
        batch.step(np.full(3, 0.1), np.array([0.0, displacement, 0.0]))
    state, _ = single.advance_many(state, tangential_displacement=way)
    assert batch.tangential_load[1] == approx(state.tangential_load, rel=1e-11)
    assert len(state.vertices()) > turns
    for displacement in (way[-41], way[-141]):
        batch.step(np.full(3, 0.1), np.array([0.0, displacement, 0.0]))
        state = single.advance(state, tangential_displacement=displacement)
        assert batch.tangential_load[1] == approx(state.tangential_load, rel=1e-11)
    assert batch.tangential_load[0] == batch.tangential_load[2] == 0
    assert "3 touch" in repr(batch)


def test_a_batch_is_saved_restored_and_made_new():
    batch = hs.ContactBatch(PAIR, 1.0, [0.3, 0.4], 2)
    batch.step([0.1, 0.1], [0.01, 0.02])
    kept, loads = batch.save(), batch.tangential_load.copy()
    batch.step([0.12, 0.1], [-0.05, 0.05])
    assert np.all(batch.tangential_load != loads)
    batch.restore(kept)
    assert_array_equal(batch.tangential_load, loads)
    batch.step([0.1, 0.1], [0.01, 0.02])
    assert_array_equal(batch.tangential_load, loads)
    assert_array_equal(kept.tangential_load, loads)
    batch.forget(1)
    assert (batch.tangential_load[1], batch.normal_load[1]) == (0, 0)
    assert batch.tangential_load[0] == loads[0]
    new = hs.ContactBatch(PAIR, 1.0, [0.3, 0.4], 2)
    for one in (batch, new):
        one.step([0.1, 0.1], [0.01, 0.03])
    assert batch.tangential_load[1] == new.tangential_load[1]


def test_arrays_that_the_library_takes_as_they_are_and_others_give_the_same_bits():
    approach, displacement = random_walk(np.random.default_rng(5), 6, 2)
    loads = []
    for form in (
        np.ascontiguousarray,
        lambda row: np.repeat(row, 2)[::2],
        np.ndarray.tolist,
        lambda row: row.astype("O"),
    ):
        batch = hs.ContactBatch(PAIR, 1.0, 0.4, 6)
        for k in range(2):
            batch.step(form(approach[k]), form(displacement[k]))
        loads.append((batch.normal_load.tolist(), batch.tangential_load.tolist()))
        saved = batch.save()
        saved.step(np.zeros(6), np.zeros(6))
        assert (batch.normal_load.tolist(), batch.tangential_load.tolist()) == loads[-1]
        saved.restore(batch)
        assert saved.normal_load.tolist() == loads[-1][0]
        with raises(hs.InputError, match=r"tangential_displacement\[1\] is nan"):
            batch.step(approach[0], np.array([0.0, np.nan, 0, 0, 0, 0]))
    assert all(each == loads[0] for each in loads)


def test_messages():
    check_messages(globals())
