"""The ensemble: load balance, and a state that is a value."""

import gc
import hashlib
import math
import weakref

import numpy as np
from golden import check_messages
from histories import random_contact, random_moves, to_events
from pairs import PLAIN as PAIR
from pairs import UNIT
from pytest import approx, mark, raises
from scipy.optimize import brentq

import historysim as hs
from historysim.errors import FrictionLimitError

EPS = np.finfo(float).eps


def hertz_loads(ensemble, approach):
    """Loads of all asperities at an approach of the highest summit."""
    depth = approach - (ensemble.summit_height.max() - ensemble.summit_height)
    factor = 4 / 3 * ensemble.pair.contact_modulus * np.sqrt(ensemble.summit_radius)
    return factor * np.clip(depth, 0, None) ** 1.5


def pressed(ensemble, *normal_loads):
    state = ensemble.initial_state()
    for normal_load in normal_loads:
        state = ensemble.advance(state, normal_load=normal_load)
    return state


def fingerprint(state):
    """Digest of every byte that a state holds."""
    return hashlib.sha256(state.to_bytes()).hexdigest()


def rough(count, seed=0, **options):
    rng = np.random.default_rng(seed)
    friction = options.pop("friction", 0.4)
    return hs.Ensemble(
        PAIR, rng.normal(0.0, 0.01, count), rng.lognormal(0.0, 0.4, count), friction, **options
    )


# -- load balance ----------------------------------------------------------------------------------


@mark.parametrize("count", [2, 7, 300])
def test_the_approach_is_the_root_of_the_summed_hertz_loads(count):
    ensemble = rough(count)
    for normal_load in np.geomspace(1e-6, 1e3, 12):
        upper = (3 * normal_load / (8 * math.sqrt(ensemble.summit_radius.min()))) ** (2 / 3)
        root = brentq(
            lambda approach, load=normal_load: hertz_loads(ensemble, approach).sum() - load,
            0.0,
            2 * upper,
            xtol=1e-300,
            rtol=4 * EPS,
        )
        # a rounding of a sum of loads, and of gaps that are measured from the highest summit
        assert pressed(ensemble, normal_load).approach == approx(root, rel=1e-13)
        assert ensemble.approach_at(normal_load) == approx(root, rel=1e-13)


def test_an_ensemble_iterates_over_its_asperities_in_the_initial_state():
    ensemble = rough(5)
    state = ensemble.initial_state()
    assert list(ensemble) == [ensemble.asperity(index, state) for index in range(5)]
    assert [asperity.summit_radius for asperity in ensemble] == ensemble.summit_radius.tolist()


def test_an_asperity_far_below_has_no_effect():
    rng = np.random.default_rng(5)
    height, radius = rng.normal(0.0, 0.01, 6), rng.lognormal(0.0, 0.3, 6)
    few = hs.Ensemble(PAIR, height, radius, 0.4)
    # the unit of length is the largest radius, so that an absurd small one keeps every bit
    more = hs.Ensemble(
        PAIR, [*height[:3], -1e9, *height[3:]], [*radius[:3], 1e-200, *radius[3:]], 0.4
    )
    contact = random_contact(rng, 1)._replace(contact_modulus=2.0, shear_modulus=0.3)
    events = to_events(random_moves(rng, contact, 0.02))
    without = hs.replay(few, events, record="all", saturate=True)
    record = [0, 1, 2, 4, 5, 6]
    extended = hs.replay(more, events, record=record, saturate=True)
    for name in without.data_vars:
        np.testing.assert_array_equal(without[name].values, extended[name].values, err_msg=name)


def test_without_friction_nothing_holds():
    ensemble = rough(8, friction=0.0)
    state = ensemble.advance(pressed(ensemble, 0.3), tangential_displacement=0.05)
    assert state.tangential_load == state.dissipated_energy == state.stored_energy == 0
    mixed = rough(8, friction=np.where(np.arange(8) % 2, 0.0, 0.4))
    state = mixed.advance(pressed(mixed, 0.3), tangential_displacement=10.0)
    forces = np.array([mixed.asperity(i, state).tangential_load for i in range(8)])
    loads = np.array([mixed.asperity(i, state).normal_load for i in range(8)])
    assert forces == approx(mixed.friction * loads, rel=4 * EPS)


# -- a state is a value ----------------------------------------------------------------------------


def test_channels_that_are_not_named_are_held_as_they_were_controlled():
    ensemble = rough(10)
    by_load = ensemble.advance(pressed(ensemble, 0.3), tangential_load=0.05)
    raised = ensemble.advance(by_load, normal_load=0.2)
    assert raised.tangential_load == approx(0.05, rel=4 * EPS)
    assert raised.tangential_displacement != by_load.tangential_displacement
    sheared = ensemble.advance(by_load, tangential_load=0.02)
    assert sheared.normal_load == by_load.normal_load
    by_displacement = ensemble.advance(
        ensemble.initial_state(), normal_displacement=0.02, tangential_displacement=0.004
    )
    lowered = ensemble.advance(by_displacement, normal_displacement=0.015)
    assert lowered.tangential_displacement == by_displacement.tangential_displacement
    assert lowered.tangential_load != by_displacement.tangential_load
    turned = ensemble.advance(by_displacement, tangential_displacement=0.001)
    assert turned.approach == by_displacement.approach
    assert fingerprint(ensemble.advance(turned)) == fingerprint(turned)


# -- beyond the limit ------------------------------------------------------------------------------


@mark.parametrize("friction", [0.4, np.linspace(0.2, 0.6, 10)])
@mark.parametrize("sign", [1, -1])
def test_a_request_beyond_the_limit_is_refused_or_held_at_it(friction, sign):
    ensemble = rough(10, friction=friction)
    state = pressed(ensemble, 0.3)
    limit = float(ensemble.friction @ hertz_loads(ensemble, state.approach))
    with raises(FrictionLimitError, match="beyond the friction limit") as caught:
        ensemble.advance(state, tangential_load=sign * 1.01 * limit)
    assert caught.value.request == approx(sign * 1.01 * limit, rel=4 * EPS)
    assert caught.value.limit == approx(limit, rel=1e-13)
    held = ensemble.advance(state, tangential_load=sign * 1.01 * limit, saturate=True)
    assert held.tangential_load == approx(sign * limit, rel=1e-13)
    # near the limit the stick radius varies with the cube root of what is missing, here a rounding
    # of the load
    slack = 1e-4 if np.ndim(friction) else 0.0
    for asperity in (ensemble.asperity(i, held) for i in range(10)):
        assert asperity.stick_radius <= slack * asperity.contact_radius
    at_limit = ensemble.advance(state, tangential_load=sign * limit * (1 - 4 * EPS))
    assert at_limit.tangential_load == approx(sign * limit, rel=1e-13)


# -- parameters ------------------------------------------------------------------------------------


def test_parameters_are_copied_and_frozen():
    height = np.array([0.0, 0.1])
    ensemble = hs.Ensemble(PAIR, height, 1.0, 0.3)
    height[0] = 9.0
    assert ensemble.summit_height[0] == 0.0
    for name in ("summit_height", "summit_radius", "friction"):
        with raises(ValueError, match="read-only"):
            getattr(ensemble, name)[0] = 1.0
        with raises(AttributeError):
            setattr(ensemble, name, 1.0)


# -- what they say of themselves -------------------------------------------------------------------


def test_an_ensemble_has_a_repr():
    one = hs.Ensemble(PAIR, 0.0, 2e-6, 0.3)
    assert (
        repr(one) == "<Ensemble: 1 asperity, summit height 0 m, summit radius 2 µm, friction 0.3>"
    )
    several = hs.Ensemble(PAIR, [0.0, 3e-8], [1e-6, 2e-3], [0.2, 0.25])
    assert repr(several) == (
        "<Ensemble: 2 asperities, summit height 0 m to 30 nm, summit radius 1 µm to 2 mm, friction 0.2 to 0.25>"
    )


@mark.parametrize("tiny", [9.347990849696351e-257, 1e-160])
def test_an_approach_whose_load_no_float_holds_is_no_contact(tiny):
    ensemble = hs.Ensemble(UNIT, [0.0, -0.01], 1.0, 0.5)
    events = [
        hs.NormalDisplacement(0.0, tiny),
        hs.TangentialDisplacement(1.0, 0.0),
        hs.TangentialDisplacement(2.0, tiny),
    ]
    history = hs.replay(ensemble, [*events, hs.NormalLoad(3.0, 0.01)], substeps=2, hold=False)
    numbers = history.drop_vars("slide_time").variables.values()
    assert all(np.isfinite(values.values.astype(float)).all() for values in numbers)
    assert history.contact_count.values[0] == 0
    assert ensemble.advance(ensemble.initial_state(), normal_load=1e-300).approach == 0.0


def test_an_ensemble_is_gone_when_nobody_has_it():
    """Those who make one after the other, as fits do, must not wait for the collector to have the memory back."""
    ensemble = hs.Ensemble(PAIR, [0.0, -1e-9], 1e-5, 0.2)
    ensemble.advance(ensemble.initial_state(), normal_displacement=ensemble.approach_at(1e-9))
    there = weakref.ref(ensemble)
    gc.disable()
    try:
        del ensemble
        assert there() is None
    finally:
        gc.enable()


def test_messages():
    check_messages(globals())
