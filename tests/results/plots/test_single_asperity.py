"""The traction that one asperity remembers: what stands in its picture. That it looks well was seen by eye."""

import numpy as np

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)


def asperity(*displacements):
    state = BALL.advance(BALL.initial_state(), normal_load=0.1)
    for displacement in displacements:
        state = BALL.advance(state, tangential_displacement=displacement)
    return BALL.asperity(0, state)


def test_the_traction_stays_within_friction_times_pressure():
    one = asperity(1e-8, -5e-9)
    (axes,) = hs.plots.asperity(one).axes
    above, below, traction, *dots = axes.get_lines()
    assert (np.abs(traction.get_ydata()) <= above.get_ydata() * (1 + 1e-9) + 1e-12).all()
    np.testing.assert_array_equal(below.get_ydata(), -above.get_ydata())
    assert len(dots) == len(one.reversal_points)
    assert axes.get_xlabel() == "radius (µm)"
    assert axes.get_title(loc="left") == "asperity 0, partial slip"


def test_an_asperity_that_does_not_touch_is_drawn_too():
    apart = BALL.asperity(0, BALL.initial_state())
    (axes,) = hs.plots.asperity(apart).axes
    assert axes.get_title(loc="left") == "asperity 0, separated"
    assert not axes.get_lines()[2].get_ydata().any()
