"""Records in which the normal load steps: which branches are at one load, and what is said of the others."""

from itertools import pairwise

import numpy as np
from numpy.testing import assert_allclose
from pytest import mark, raises

import historysim as hs
from historysim.measured.loop_values import NoLoopError
from historysim.measured.loops import loops_of_channels

PART = 40


def record(turns, loads, *, noise=0.0, seed=1):
    """Go straight from turn to turn; `loads` maps the place of a turn to the normal load from there on."""
    u = np.concatenate(
        [np.linspace(a, b, PART, endpoint=False) for a, b in pairwise(turns)] + [turns[-1:]]
    )
    normal = np.empty(u.size)
    for place, load in loads.items():
        normal[round(place * PART) :] = load
    normal *= 1 + noise * np.random.default_rng(seed).normal(size=u.size)
    return np.arange(float(u.size)), u, 0.2 * normal * np.sign(np.diff(u, prepend=-1)), normal


def programme(loads, loops=2):
    """Loops from 0 to 0 at each load, which steps at 0."""
    turns = [0.0] + len(loads) * loops * [1.0, -1.0, 0.0]
    return record(turns, {3 * loops * place: load for place, load in enumerate(loads)})


def test_each_load_of_a_programme_has_its_loops():
    found = loops_of_channels(*programme([1.0, 2.0, 4.0]))
    assert found.number.tolist() == [0, 1, 2, 3, 4, 5]
    assert found.load_level.tolist() == [0, 0, 1, 1, 2, 2]
    # each second loop has lost the branch on which the load steps, and the last one what the record
    # does not have
    lost = np.array([[False, False], [True, False]] * 3)
    assert found.left_out_branches.tolist() == lost.tolist()
    for values in (found.friction_force, found.normal_load):
        assert np.isnan(values).tolist() == lost.tolist()
    assert np.isnan(found.dissipated_energy).tolist() == lost.any(axis=1).tolist()
    assert_allclose(found.amplitude, 1.0)
    assert found.exclusions == (
        "2 branches are left out, on which the normal load moves by 50 % of its greatest value, over 10 % (load_share)",
    )
    table = found.by_load()
    assert_allclose(table.value, [1, 2, 4])
    assert [each.count for each in table.statistics("friction_force", "forward")] == [1, 1, 1]
    assert [each.count for each in table.statistics("friction_force", "backward")] == [2, 2, 2]
    assert_allclose(table.means("friction_force"), [0.2, 0.4, 0.8])


def test_load_changes_common_to_most_branches_are_accepted():
    time, u, load, normal = record([0.0, *(1.0, -1.0) * 8, 0.0], {0: 1.0}, noise=0.02)
    found = loops_of_channels(time, u, load, normal * (1 + 0.1 * u))
    assert len(found) == 7
    assert not found.left_out_branches.any()
    (note,) = found.exclusions
    assert note.startswith("the normal load moves by 1")
    assert note.endswith(
        "on three branches of four, over 10 % (load_share): those are not left out"
    )
    # less of it is not worth telling, and a step counts in addition to it, too
    assert loops_of_channels(time, u, load, normal * (1 + 0.03 * u)).exclusions == ()
    stepped = np.where(np.arange(u.size) < 6.5 * PART, 1.0, 1.5)
    found = loops_of_channels(time, u, load * stepped, normal * stepped * (1 + 0.1 * u))
    # and what is behind the last loop counts alone
    assert np.argwhere(found.left_out_branches).tolist() == [[2, 0], [7, 0]]
    assert found.exclusions[1].startswith(
        "1 branch is left out, on which the normal load moves by 4"
    )


def test_a_loop_without_any_branch_at_one_load_is_left_out():
    found = loops_of_channels(
        *record([0.0, 1, -1, 1, -1, 1, -1, 1, 0], {0: 1.0, 3.5: 1.5, 4.5: 2.0})
    )
    assert found.number.tolist() == [0, 2]
    assert found.exclusions[0].startswith(
        "2 branches are left out, on which the normal load moves by 25 % to 33.3 %"
    )


@mark.parametrize("rise", [1.3, 0.7])
def test_a_step_at_rest_leaves_the_friction(rise):
    """The step belongs to the branch behind it, in front of which the displacement rests."""
    u = np.concatenate(
        [np.linspace(0, 1, 40), np.linspace(1, -1, 80), -np.ones(20), np.linspace(-1, 1, 80)[1:]]
    )
    u = np.concatenate([u, np.linspace(1, -1, 80)[1:], np.linspace(-1, 0, 40)[1:]])
    normal = np.where(np.arange(u.size) < 130, 1.0, rise)
    found = loops_of_channels(
        np.arange(float(u.size)), u, 0.2 * normal * np.sign(np.gradient(u) + 1e-9), normal
    )
    assert found.stepped_branches[0].tolist() == [True, False]
    assert not found.left_out_branches[0].any()
    assert_allclose(found.normal_load[0], [rise, 1.0])
    assert np.isnan(found.preliminary_displacement[0]).tolist() == [True, False]
    assert np.isnan(found.dissipated_energy[0])


def test_first_loops_of_each_load_are_left_out_on_request():
    channels = programme([1.0, 2.0], loops=3)
    found = loops_of_channels(*channels, skip_per_level=1)
    assert found.number.tolist() == [1, 2, 4, 5]
    assert found.exclusions[-1] == "the first 1 loop is left out at each load, 2 in all"
    # at one load it is what skip is
    one = record([0.0, 1, -1, 1, -1, 1, 0], {0: 1.0})
    assert loops_of_channels(*one, skip_per_level=1).number.tolist() == [1]
    with raises(
        NoLoopError,
        match="no series of loops at one normal load has more than the 3 that are to be",
    ):
        loops_of_channels(*channels, skip_per_level=3)
    with raises(hs.InputError, match=r"skip_per_level is 0\.5"):
        loops_of_channels(*channels, skip_per_level=0.5)
