"""The polyline as one asperity sees it."""

import numpy as np
import pytest

import historysim as hs

EPS = np.finfo(float).eps

PAIR = hs.MaterialPair.from_moduli(contact_modulus=3.0, shear_modulus=0.4)
THETA = 3.0 / (4 * 0.4)
MU, DEPTH = 0.3, 0.02
# both radii differ from the scale of length, which is the larger of them
ENSEMBLE = hs.Ensemble(PAIR, summit_height=[0.5, 0.494], summit_radius=[0.7, 1.9], friction=MU)


def memories(*shifts):
    """Memories of both asperities at one approach after displacements in units of θμδ."""
    state = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_displacement=DEPTH, tangential_displacement=0.0)
    for shift in shifts:
        state = ENSEMBLE.advance(state, tangential_displacement=shift * THETA * MU * DEPTH)
    return [ENSEMBLE.asperity(i, state).memory for i in range(2)]


def test_a_virgin_contact_has_its_edge_alone():
    for memory, radius, gap in zip(memories(), (0.7, 1.9), (0.0, 0.006), strict=True):
        assert memory.radius == pytest.approx([np.sqrt(radius * (DEPTH - gap))], rel=8 * EPS)
        assert not memory.slope.any()
        assert not memory.jump.any()


def test_both_asperities_see_the_same_vertices_each_with_its_own_radius():
    # slip of half the preliminary displacement reaches half the depth, a reversal by a fifth a tenth
    fronts = DEPTH * np.array([1.0, 0.9, 0.5])
    for memory, radius, gap in zip(memories(0.5, 0.3), (0.7, 1.9), (0.0, 0.006), strict=True):
        assert memory.radius == pytest.approx(np.sqrt(radius * (fronts - gap)), rel=1e-14)
        assert memory.slope == pytest.approx([-MU, MU, 0.0])
        assert memory.jump == pytest.approx([-MU, 2 * MU, -MU])
        assert memory.made_at == pytest.approx(np.array([0.3, 0.3, 0.5]) * THETA * MU * DEPTH, rel=8 * EPS)


def test_an_asperity_does_not_see_vertices_below_its_summit():
    # the front at a fifth of the depth lies below the second summit
    first, second = memories(0.8)
    assert first.radius == pytest.approx(np.sqrt(0.7 * DEPTH * np.array([1.0, 0.2])), rel=1e-14)
    assert second.radius == pytest.approx([np.sqrt(1.9 * (DEPTH - 0.006))], rel=1e-14)
    assert second.slope == pytest.approx([MU])


def test_what_is_asked_of_a_memory_is_a_copy():
    memory = memories(0.5)[0]
    before = [values.tobytes() for values in (memory.radius, memory.slope, memory.jump, memory.made_at)]
    for values in (memory.radius, memory.slope, memory.jump, memory.made_at):
        values[:] = 7.0
    assert [values.tobytes() for values in (memory.radius, memory.slope, memory.jump, memory.made_at)] == before


def test_no_contact_has_no_memory():
    memory = ENSEMBLE.asperity(0, ENSEMBLE.initial_state()).memory
    assert memory.radius.size == memory.slope.size == memory.jump.size == memory.made_at.size == 0
