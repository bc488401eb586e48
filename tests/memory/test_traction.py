"""The polyline as one asperity sees it."""

import numpy as np
from pytest import approx

import historysim as hs

EPS = np.finfo(float).eps

PAIR = hs.MaterialPair.from_moduli(contact_modulus=3.0, shear_modulus=0.4)
THETA = 3.0 / (4 * 0.4)
MU, DEPTH = 0.3, 0.02
# both radii differ from the scale of length, which is the larger of them
ENSEMBLE = hs.Ensemble(PAIR, summit_height=[0.5, 0.494], summit_radius=[0.7, 1.9], friction=MU)


def state_after(*shifts):
    """The state at one approach after displacements in units of θμδ."""
    state = ENSEMBLE.advance(
        ENSEMBLE.initial_state(), normal_displacement=DEPTH, tangential_displacement=0.0
    )
    for shift in shifts:
        state = ENSEMBLE.advance(state, tangential_displacement=shift * THETA * MU * DEPTH)
    return state


def superpositions(state):
    """Radii and weights of both asperities."""
    return [ENSEMBLE.asperity(i, state).superposition for i in range(2)]


def test_both_asperities_see_the_same_vertices_each_with_its_own_radius():
    # slip of half the preliminary displacement reaches half the depth, a reversal by a fifth a
    # tenth
    fronts = DEPTH * np.array([1.0, 0.9, 0.5])
    state = state_after(0.5, 0.3)
    for (radius, weight), own, gap in zip(
        superpositions(state), (0.7, 1.9), (0.0, 0.006), strict=True
    ):
        assert radius == approx(np.sqrt(own * (fronts - gap)), rel=1e-14)
        assert weight == approx([-MU, 2 * MU, -MU])
    made_at = state.vertices()["made_at"][:0:-1] * state.memory.line.contact.units.displacement
    assert made_at == approx(np.array([0.3, 0.3, 0.5]) * THETA * MU * DEPTH, rel=8 * EPS)


def test_an_asperity_does_not_see_vertices_below_its_summit():
    # the front at a fifth of the depth is below the second summit
    (first, _), (second, weight) = superpositions(state_after(0.8))
    assert first == approx(np.sqrt(0.7 * DEPTH * np.array([1.0, 0.2])), rel=1e-14)
    assert second == approx([np.sqrt(1.9 * (DEPTH - 0.006))], rel=1e-14)
    assert weight == approx([MU])


def test_the_superposition_is_a_copy():
    asperity = ENSEMBLE.asperity(0, state_after(0.5))
    before = [values.tobytes() for values in asperity.superposition]
    for values in asperity.superposition:
        values[:] = 7.0
    assert [values.tobytes() for values in asperity.superposition] == before
