"""Motions with a contact in them: energy is balanced, trials leave nothing behind, and turning points are met."""

import numpy as np
import pytest
from golden import refused
from pairs import COMPLIANT as PAIR
from scipy import integrate

import historysim as hs
from historysim.coupling import solve_ivp

RNG = np.random.default_rng(5)
ENSEMBLE = hs.Ensemble(PAIR, RNG.normal(0, 40e-9, 20), RNG.uniform(10e-6, 40e-6, 20), 0.2)
MASS, SPEED = 0.1, 4e-5
PRESSED = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=0.2)


def place(_t, y):
    return {"tangential_displacement": y[0]}


def free(_t, y, contact):
    return [y[1], -contact.tangential_load / MASS]


def balance(found):
    kinetic = 0.5 * MASS * found.y[1, -1] ** 2
    return kinetic + found.state.stored_energy + found.dissipated_energy[-1] - 0.5 * MASS * SPEED**2


def leap_frog(duration, steps):
    """The places of a free mass, by a method that tries nothing."""
    stepper, pause = ENSEMBLE.stepper(PRESSED), duration / steps
    where, speed = 0.0, SPEED
    places = [0.0]
    for step in range(steps):
        # the first one is half a step, so that speeds are those between the places
        speed -= pause * (0.5 if step == 0 else 1.0) * stepper.tangential_load / MASS
        where += pause * speed
        stepper.step(tangential_displacement=where)
        places.append(where)
    return np.array(places)


@pytest.mark.parametrize("method", ["Radau", "LSODA", integrate.DOP853])
def test_a_free_mass_keeps_its_energy_and_remembers_its_turns_alone(method):
    found = solve_ivp(
        free,
        (0.0, 6e-3),
        [0.0, SPEED],
        ENSEMBLE,
        place,
        state=PRESSED,
        method=method,
        rtol=1e-7,
        atol=1e-16,
    )
    energy = 0.5 * MASS * SPEED**2
    assert abs(balance(found)) < 2e-4 * energy
    assert found.dissipated_energy[-1] > 0.02 * energy
    # it swings, and each of its turns is met
    moves = np.sign(np.diff(found.y[0]))
    assert found.turns == (moves[1:] * moves[:-1] < 0).sum() >= 3
    assert found.tangential_load[-1] == found.state.tangential_load


def test_it_is_the_motion_that_many_small_steps_give():
    found = solve_ivp(
        free, (0.0, 3e-3), [0.0, SPEED], ENSEMBLE, place, state=PRESSED, rtol=1e-9, atol=1e-18
    )
    errors = []
    for steps in (2000, 4000):
        places = leap_frog(3e-3, steps)
        errors.append(np.abs(places[-1] - found.y[0, -1]))
    largest = np.abs(found.y[0]).max()
    # the method of second order comes nearer as its steps are halved
    assert errors[1] < 0.35 * errors[0] or errors[1] < 1e-6 * largest
    assert errors[1] < 1e-4 * largest


def test_both_channels_may_move_and_the_state_given_is_left_alone():
    before = PRESSED.to_bytes()

    def both(t, y):
        return {"tangential_displacement": y[0], "normal_load": 0.2 + 0.05 * np.sin(2e3 * t)}

    found = solve_ivp(free, (0.0, 4e-3), [0.0, SPEED], ENSEMBLE, both, state=PRESSED)
    assert found.normal_load == pytest.approx(0.2 + 0.05 * np.sin(2e3 * found.t), rel=1e-12)
    assert PRESSED.to_bytes() == before
    # the load turns at its extremes, too
    extremes = (np.arange(2) + 0.5) * np.pi / 2e3
    assert np.abs(found.t[:, None] - extremes).min(axis=0).max() < 1e-3 / 2e3


def test_nonsense_is_refused():
    for t_span, where, options, message in (
        ((0.0, 1e-3), place, {"method": "Euler"}, "method is 'Euler'; expected one of RK23, RK45"),
        (1.0, place, {}, r"t_span is 1\.0; expected two times"),
        (
            (0.0, 1e-3),
            lambda _t, _y: 1.0,
            {},
            r"place returned 1\.0; expected targets of the contact",
        ),
        (
            (0.0, 1e-3),
            lambda _t, y: {"displacement": y[0]},
            {},
            "place returned 'displacement'; expected normal_load",
        ),
        (
            (0.0, 1e-3),
            place,
            {"rtoll": 1e-9},
            "'rtoll' is not an option of RK45; did you mean 'rtol'",
        ),
    ):
        with refused(message):
            solve_ivp(free, t_span, [0.0, SPEED], ENSEMBLE, where, **options)
    for y0, motion, message in (
        (
            [0.0, SPEED],
            lambda _t, y, _contact: [y[1]],
            r"motion returned \[4e-05\]; expected dy/dt of each of 2",
        ),
        (
            [0.0, SPEED],
            lambda _t, _y, _contact: None,
            "dy/dt of motion is None; expected numbers in SI",
        ),
        ([0.0, SPEED], lambda _t, _y, _contact: [0.0, np.nan], r"dy/dt of motion\[1\] is nan"),
        ([[0.0, SPEED]], free, "y0 has 2 dimensions; expected one"),
    ):
        with refused(message):
            solve_ivp(motion, (0.0, 1e-3), y0, ENSEMBLE, place, state=PRESSED)
    with pytest.raises(hs.FrictionLimitError):
        solve_ivp(
            free,
            (0.0, 1e-3),
            [0.0, SPEED],
            ENSEMBLE,
            lambda t, _y: {"tangential_load": 100 * t},
            state=PRESSED,
        )
