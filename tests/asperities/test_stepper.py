"""Stepping by hand: the bits of a replay, in place and not, and the derivatives of what it leads to."""

import math
import pickle
import warnings

import numpy as np
import positioning_stage
from golden import check_messages
from histories import random_contact, random_moves, to_events
from pairs import PLAIN as PAIR
from pairs import UNIT
from pytest import approx, mark, raises, warns

import historysim as hs
from historysim.basics.library import ffi, lib
from historysim.memory.binding import copy_state


def rough(count=8, friction=0.4, seed=3):
    rng = np.random.default_rng(seed)
    return hs.Ensemble(PAIR, rng.normal(0.0, 0.01, count), rng.lognormal(0.0, 0.4, count), friction)


def random_history(seed, several):
    rng = np.random.default_rng(seed)
    contact = random_contact(rng, 4, several)
    ensemble = hs.Ensemble(UNIT, contact.summit_height, contact.summit_radius, contact.friction)
    return ensemble, random_moves(rng, contact, 0.02, 15)


@mark.parametrize("several", [False, True])
@mark.parametrize("seed", range(3))
def test_a_stepper_and_a_state_have_the_bits_of_a_replay(seed, several):
    ensemble, moves = random_history(seed, several)
    replayed = hs.Replay(ensemble, to_events(moves), record="totals", saturate=True).state()
    state, stepper = ensemble.initial_state(), ensemble.stepper(saturate=True)
    for k, move in enumerate(moves):
        where = {
            f"normal_{move.normal_kind}": move.normal_value,
            f"tangential_{move.tangential_kind}": move.tangential_value,
        }
        before = state
        state = ensemble.advance(state, **where, saturate=True)
        if k % 3 == 1:
            stepper.restore(before)
        if k % 4 == 1:
            stepper = pickle.loads(pickle.dumps(stepper))
        stepper.step(**where)
        assert stepper.save() == state
    assert state == replayed
    for name in (
        "tangential_load",
        "normal_load",
        "approach",
        "tangential_displacement",
        "dissipated_energy",
    ):
        assert getattr(stepper, name) == getattr(state, name), name


@mark.parametrize("kind", ["yields", "yields, by strength", "wears", "slides"])
@mark.parametrize("seed", [1])
def test_a_stepper_of_asperities_that_evolve_has_the_bits_of_advance(kind, seed):
    rng = np.random.default_rng(seed)
    pair = hs.MaterialPair.from_moduli(contact_modulus=43e9, shear_modulus=9.2e9, hardness=5.5e9)
    height, radius = np.append(0.0, rng.uniform(-60e-9, 0, 4)), rng.uniform(0.5e-6, 2e-6, 5)
    options = {
        "yields": {"yielding": "kogut-etsion"},
        "yields, by strength": {"yielding": "thornton", "friction": hs.laws.ShearStrength(0.3e9)},
        "wears": {"wear": hs.wear.ArchardWear(coefficient=1e-4, hardness=6e9)},
        "slides": {"follow_sliding": True},
    }[kind]
    ensemble = hs.Ensemble(pair, height, radius, **({"friction": 0.2} | options))
    driven = (
        {"saturate": True, "instrument": hs.Instrument(1e6)}
        if seed == 1
        else {"saturate": seed == 2}
    )
    state, stepper = ensemble.initial_state(), ensemble.stepper(**driven)
    for k in range(8):
        where = {"normal_displacement": rng.uniform(0.05, 1) * 15e-9 * (k + 2)} if k % 3 else {}
        where |= {"normal_load": rng.uniform(0.2, 2) * 1e-3} if k % 3 == 0 else {}
        where |= (
            {"tangential_displacement": rng.uniform(-1, 1) * 40e-9}
            if k % 4
            else {"tangential_load": 1e-5}
        )
        before, state = state, ensemble.advance(state, **where, **driven)
        if k % 3 == 1:
            # a trial that yields farther, and is taken back
            stepper.step(normal_displacement=300e-9)
            stepper.restore(before)
        if k % 4 == 1:
            stepper = pickle.loads(pickle.dumps(stepper))
        stepper.step(**where)
        assert stepper.save() == state
        assert stepper.tangential_load == state.tangential_load
        assert stepper.dissipated_energy == state.dissipated_energy
    if "yields" in kind:
        assert np.count_nonzero(state.yielded.yielding_load) > 1


def test_many_paths_at_once_are_as_many_single_ones():
    ensemble = rough()
    start = ensemble.advance(ensemble.initial_state(), normal_load=0.3)
    way = 0.01 * np.sin(np.arange(9.0))
    state, totals = ensemble.advance_many(start, normal_load=0.3, tangential_displacement=way)
    single = start
    for k, displacement in enumerate(way):
        single = ensemble.advance(single, normal_load=0.3, tangential_displacement=displacement)
        for name in totals._fields:
            assert getattr(totals, name)[k] == getattr(single, name), name
    assert state == single


def test_a_step_that_is_refused_changes_nothing():
    ensemble = rough()
    stepper = ensemble.stepper(
        ensemble.advance(ensemble.initial_state(), normal_load=0.3, tangential_load=0.05)
    )
    before = stepper.save()
    for wrong in (
        {"tangential_load": np.inf},
        {"normal_load": -1.0},
        {"normal_load": 0.1, "normal_displacement": 0.1},
    ):
        with raises(hs.InputError, match="_load"):
            stepper.step(**wrong)
    assert stepper.save() == before
    stepper.step(tangential_load=np.float32(0.0625))
    assert stepper.tangential_load == approx(0.0625, rel=1e-15)


def test_a_refused_goal_is_forgotten_by_the_next_step():
    ensemble = rough()
    state = ensemble.advance(ensemble.initial_state(), normal_load=0.3, tangential_load=0.05)
    stepper = ensemble.stepper(state)
    stepper.step(tangential_displacement=0.01)
    assert stepper.save() == ensemble.advance(state, tangential_displacement=0.01)
    stepper.step()
    assert stepper.save() == ensemble.advance(ensemble.advance(state, tangential_displacement=0.01))


@mark.parametrize("turned", [False, True])
def test_a_channel_without_a_target_is_held_as_it_was_controlled_whatever_the_caller_says(turned):
    ensemble = rough()
    state = ensemble.advance(ensemble.initial_state(), normal_load=0.3, tangential_load=0.02)
    if turned:
        state = ensemble.advance(state, tangential_load=(0.02, 0.01))
    memory, drive = (
        copy_state(state.memory),
        ensemble._make_drive(False, hs.Instrument(), directions=1 + turned),
    )
    held = lib.HS_DISPLACED, math.nan, lib.HS_DISPLACED, math.nan
    assert lib.hs_step(memory, *held, drive, ffi.NULL) == lib.HS_OK
    after = hs.State(memory)
    assert memory.line.normal_control == lib.HS_LOAD
    assert after.tangential_control == ((lib.HS_LOAD, lib.HS_LOAD) if turned else lib.HS_LOAD)
    assert after == ensemble.advance(state)


def test_a_stepper_of_a_normal_curve_stays_on_it():
    approach = np.linspace(0, 1e-6, 30)
    ensemble = hs.Patches.from_normal_curves(PAIR, approach, 1e3 * approach**1.5)
    stepper = ensemble.stepper()
    stepper.step(normal_displacement=5e-7, tangential_displacement=1e-8)
    assert stepper.save() == ensemble.advance(
        ensemble.initial_state(), normal_displacement=5e-7, tangential_displacement=1e-8
    )
    with raises(hs.LoadError, match="beyond the normal curve"):
        ensemble.advance(stepper.save(), normal_displacement=2e-6)


def richardson(function, step):
    """Derivative at 0 by central differences, extrapolated; the best of the table by its own error estimate."""
    table, best, error = [], None, np.inf
    for _ in range(7):
        row = [(function(step) - function(-step)) / (2 * step)]
        for k, former in enumerate(table[-1] if table else []):
            row.append(row[k] + (row[k] - former) / (4.0 ** (k + 1) - 1))
            spread = max(abs(row[k + 1] - row[k]), abs(row[k + 1] - former))
            if spread < error:
                best, error = row[k + 1], spread
        table.append(row)
        step /= 2
    return best


ENDS = {
    "sticks while it approaches": (0.031, 0.0042),
    "slips while it approaches": (0.031, 0.012),
    "slips back while it approaches": (0.0305, -0.009),
    "slips at a held approach": (0.03, 0.008),
    "turns": (0.03, 0.001),
    "slips while it withdraws": (0.027, 0.006),
    "withdraws and turns": (0.0285, 0.002),
    "slides": (0.03, 0.2),
    "first touches": (0.004, 0.0005),
}


@mark.parametrize("friction", [0.4, "each"])
@mark.parametrize("end", ENDS)
def test_the_derivatives_at_the_end_agree_with_differences(friction, end):
    ensemble = rough(5, friction if friction == 0.4 else np.linspace(0.3, 0.5, 5))
    state = ensemble.initial_state()
    if end == "first touches":
        state = ensemble.advance(state, normal_displacement=-0.001)
    else:
        for place in ((0.03, 0.0), (0.03, 0.006), (0.03, -0.002), (0.03, 0.004)):
            state = ensemble.advance(
                state, normal_displacement=place[0], tangential_displacement=place[1]
            )
    approach, displacement = ENDS[end]

    def reached(d, u):
        return ensemble.advance(
            state, normal_displacement=approach + d, tangential_displacement=displacement + u
        )

    stepper = ensemble.stepper(state)
    stepper.step(normal_displacement=approach, tangential_displacement=displacement)
    found = stepper.slopes()
    scale = stepper.save().normal_stiffness
    assert found.tangential == approx(
        richardson(lambda u: reached(0, u).tangential_load, 1e-4), rel=1e-9, abs=1e-10 * scale
    )
    if approach != 0.03:
        # at a held approach the derivative differs from one side to the other
        assert found.coupling == approx(
            richardson(lambda d: reached(d, 0).tangential_load, 1e-4), rel=1e-9, abs=1e-10 * scale
        )
    assert found.normal == approx(richardson(lambda d: reached(d, 0).normal_load, 1e-4), rel=1e-9)


def test_the_derivative_after_friction_has_fallen_agrees_with_differences():
    ensemble = rough(5)
    state = ensemble.advance(
        ensemble.initial_state(), normal_displacement=0.03, tangential_displacement=0.008
    )
    state = ensemble.advance(state, tangential_displacement=0.003, friction=0.15)
    assert state.memory.line.steep[0] == 1
    stepper = ensemble.stepper(state)
    stepper.step(normal_displacement=0.0295, tangential_displacement=0.0022)

    def load(d, u):
        return ensemble.advance(
            state, normal_displacement=0.0295 + d, tangential_displacement=0.0022 + u
        ).tangential_load

    found = stepper.slopes()
    assert found.tangential == approx(richardson(lambda u: load(0, u), 2e-5), rel=1e-9)
    assert found.coupling == approx(richardson(lambda d: load(d, 0), 2e-5), rel=1e-9)


@mark.skipif(not positioning_stage.hatch_build.compiler(), reason="needs a C compiler")
def test_a_loop_in_c_that_steps_by_address_has_the_same_bits():
    ensemble = positioning_stage.rough_contact(50)
    motion = positioning_stage.controlled(ensemble, duration=0.3)
    same, _ = positioning_stage.controlled_in_c(ensemble, duration=0.3)
    for computed, by_c in zip(motion, same, strict=True):
        np.testing.assert_array_equal(computed, by_c)


def test_a_stepper_that_is_moved_back_and_forth_says_so_once():
    ensemble = rough()
    stepper = ensemble.stepper(ensemble.advance(ensemble.initial_state(), normal_load=0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for k in range(40):
            stepper.step(tangential_displacement=0.01 * math.sin(k))
        kept = stepper.save()
        for k in range(10):
            stepper.step(tangential_displacement=0.001 * (-1) ** k)
            stepper.restore(kept)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for k in range(10):
            stepper.step(tangential_displacement=0.001 * (-1) ** k)
    (warned,) = caught
    assert "went back and forth in each of the last 4 steps" in str(warned.message)
    assert warned.filename == __file__


def test_a_stepper_that_knows_its_times_warns_of_a_second_move_at_one():
    ensemble = rough()
    stepper = ensemble.stepper(ensemble.advance(ensemble.initial_state(), normal_load=0.3))
    stepper.step(tangential_displacement=0.001, time=0.1)
    kept = stepper.save()
    stepper.step(tangential_displacement=0.002, time=0.2)
    with warns(UserWarning, match=r"was moved to t = 0\.15 s when it had been at 0\.2 s: where"):
        stepper.step(tangential_displacement=0.0015, time=0.15)
    stepper.restore(kept)
    stepper.step(tangential_displacement=0.0015, time=0.15)


def test_messages():
    check_messages(globals())
