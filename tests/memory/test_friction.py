"""A change of friction: a jump is what many small falls are, and how far the springs then are from Coulomb's law."""

import math
from itertools import pairwise

import numpy as np
from golden import check_messages
from pairs import UNIT
from polylines import Polylines
from pytest import approx, mark, raises

import historysim as hs
from historysim.basics import limits
from historysim.loads.friction_course import FrictionCourse
from historysim.results import analysis

FRICTION = 0.5
LIMIT = FRICTION * 4 / 3
SPHERE = hs.Ensemble(UNIT, 0.0, 1.0, FRICTION)

# turning points of T/(μN), the factor by which μ then falls at a fixed displacement, and what
# T/(μN) becomes: of the rings, and of the springs
FALLS = [
    ((0.9, -0.3, 0.6), 0.8, 0.7371, 0.7371, 1.0),
    ((0.9, -0.6, 0.4), 0.5, 0.7181, 0.7182, 1.096),
    ((0.95, -0.4, 0.7, 0.3), 0.3, 0.8848, 0.8518, 1.94),
    ((0.9, 0.0), 0.1, 0.3216, 0.5479, 3.690),
]


def turned(turns, ensemble=SPHERE, limit=LIMIT):
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=1.0, tangential_load=0.0)
    for turn in turns:
        state = ensemble.advance(state, tangential_load=turn * limit)
    return state


def fallen(turns, factor):
    """The state after a fall of friction at a fixed displacement."""
    state = turned(turns)
    state = SPHERE.advance(state, tangential_displacement=state.tangential_displacement)
    return SPHERE.advance(state, friction=factor * FRICTION)


def rise_of_pressure(stiffness, touch, low, high, place):
    """∫ da/√(P'² - s²) by the midpoint rule in √(a - h), with h where P' = s; times a separate factor."""
    if high <= touch:
        return 0.0
    x = np.linspace(np.sqrt(max(low - touch, 0.0)), np.sqrt(high - touch), 2001)
    middle = 0.5 * (x[1:] + x[:-1])
    return float(
        np.sum(2 * middle * np.diff(x) / np.sqrt(stiffness(touch + middle**2) ** 2 - place**2))
    )


@mark.parametrize(
    "load, stiffness, touch",
    [
        (lambda a: 4 / 3 * a**1.5 * (1 + 1e-5 * a), lambda a: 2 * a**0.5, lambda s: (s / 2) ** 2),
        (lambda a: a**2, lambda a: 2 * a, lambda s: s / 2),
        (lambda a: a**1.25, lambda a: 1.25 * a**0.25, lambda s: (s / 1.25) ** 4),
    ],
)
@mark.parametrize("turns, factor, ratio", [(fall[0], fall[1], fall[-1]) for fall in FALLS[2:]])
def test_round_contacts_of_a_normal_curve_have_the_same_ratio(
    turns, factor, ratio, load, stiffness, touch
):
    approach = np.geomspace(1e-4, 1.01, 300)
    table = hs.Patches.from_normal_curves(UNIT, approach, load(approach), friction=FRICTION)
    state = turned(turns, table, FRICTION * load(1.0))
    events = [hs.NormalDisplacement(0.0, 1.0)]
    events += [
        hs.TangentialLoad(1.0 + k, turn * FRICTION * load(1.0)) for k, turn in enumerate(turns)
    ]
    events += [hs.TangentialDisplacement(8.0, state.tangential_displacement)]
    events += [hs.FrictionChange(9.0, factor * FRICTION)]
    history = hs.replay(table, events, record="totals")
    told = float(history.largest_traction_ratio[-1])
    if load(1.0) == approx(4 / 3, rel=1e-4):
        assert told == approx(ratio, rel=3e-3)
    state = table.advance(state, tangential_displacement=state.tangential_displacement)
    vertices = table.advance(state, friction=factor * FRICTION).vertices()
    ends, largest = vertices["label"] * state.memory.line.contact.units.length, 0.0
    # below each vertex, where the largest are
    for place in np.concatenate(
        [stiffness(end) * (1 - np.linspace(1e-4, 0.2, 20) ** 2) for end in ends[1:]]
    ):
        rises = np.array(
            [rise_of_pressure(stiffness, touch(place), *pair, place) for pair in pairwise(ends)]
        )
        here = abs(vertices["slope"][1:] @ rises) / (factor * FRICTION * rises.sum())
        largest = max(largest, here)
    assert told == approx(largest, rel=2e-3)


def test_the_middle_of_a_punch_has_the_ratio_of_its_loads():
    table = hs.Patches.from_normal_curves(
        UNIT, [0.25, 0.5, 0.75, 1.0], [0.5, 1.0, 1.5, 2.0], friction=FRICTION
    )
    events = [hs.NormalLoad(0.0, 1.8), hs.TangentialLoad(1.0, 0.8), hs.TangentialLoad(2.0, 0.2)]
    events += [hs.TangentialDisplacement(3.0, 0.1), hs.FrictionChange(4.0, 0.2)]
    history = hs.replay(table, events)
    assert history.largest_traction_ratio.values == approx(1.0)
    assert "traction" not in dict(analysis.summary(history))
    curve = np.linspace(0.0, 1.0, 40)[1:]
    round_one = hs.Patches.from_normal_curves(UNIT, curve, curve**2, friction=FRICTION)
    events = [
        hs.NormalDisplacement(0.0, 1.0),
        hs.TangentialDisplacement(1.0, 0.45),
        hs.TangentialDisplacement(2.0, 0.0),
    ]
    told = dict(analysis.summary(hs.replay(round_one, [*events, hs.FrictionChange(3.0, 0.1)])))
    assert told["traction"].endswith("Coulomb's law, if the contact were round")


def test_without_a_change_of_friction_no_ratio_is_recorded():
    assert "largest_traction_ratio" not in hs.replay(SPHERE, [hs.NormalLoad(0.0, 1.0)])


@mark.parametrize("turns, factor", [(fall[0], fall[1]) for fall in FALLS[1:3]])
@mark.parametrize("direction", [1, -1])
def test_stiffness_is_the_slope_on_the_requested_side(turns, factor, direction):
    for state in (turned(turns), fallen(turns, factor)):
        step = 1e-7 * direction
        moved = SPHERE.advance(state, tangential_displacement=state.tangential_displacement + step)
        slope = (moved.tangential_load - state.tangential_load) / step
        assert state.stiffness(direction) == approx(slope, rel=1e-5)


def test_a_disc_that_slides_inside_is_partial_slip_and_takes_no_part_in_the_stiffness():
    # the springs that touch later are not strained, so that the edge sticks when friction falls
    events = [
        hs.NormalDisplacement(0.0, 0.5),
        hs.TangentialDisplacement(0.0, 0.0),
        hs.TangentialDisplacement(1.0, 0.2),
    ]
    events += [
        hs.NormalDisplacement(1.0, 0.5),
        hs.NormalDisplacement(2.0, 1.0),
        hs.FrictionChange(3.0, 0.1 * FRICTION),
    ]
    history = hs.replay(SPHERE, events)
    row, state = history.isel(step=-1), hs.Replay(SPHERE, events).state()
    assert row.slip_state == hs.SlipState.PARTIAL_SLIP
    assert row.stick_radius == row.contact_radius
    moved = SPHERE.advance(state, tangential_displacement=state.tangential_displacement + 1e-8)
    slope = (moved.tangential_load - state.tangential_load) / 1e-8
    assert slope < 1.5
    assert row.tangential_stiffness == approx(slope, rel=1e-5)
    assert state.stiffness(1) == approx(slope, rel=1e-5)
    # 8 G* a
    assert state.stiffness(-1) == approx(2.0, rel=1e-12)


def test_a_jump_of_friction_under_a_load_equals_many_small_falls():
    turns, factor, friction = (0.9, -0.3), 0.35, np.array([0.5, 0.4])
    ensemble, limit = (
        hs.Ensemble(UNIT, np.zeros(friction.size), 1.0, friction),
        friction.sum() * 4 / 3,
    )
    start = turned(turns, ensemble, limit)
    jumped = ensemble.advance(start, friction=factor * friction)
    oracle = Polylines(np.zeros(friction.size), 1.0, friction)
    for turn in (0.0, *turns):
        oracle.to(("displacement", 1.0), ("load", turn * limit), steps=1)
    lost = oracle.dissipated
    oracle.change_friction([factor] * friction.size, steps=200)
    assert jumped.tangential_load == approx(start.tangential_load, abs=1e-14)
    assert jumped.tangential_displacement == approx(oracle.displacement, abs=1e-5)
    spent = jumped.dissipated_energy - start.dissipated_energy
    assert spent == approx(oracle.dissipated - lost, rel=1e-4)
    work = start.tangential_load * (jumped.tangential_displacement - start.tangential_displacement)
    assert work == approx(spent + jumped.stored_energy - start.stored_energy, abs=1e-10 * spent)
    shares = sum(ensemble.asperity(i, jumped).dissipated_energy for i in range(friction.size))
    assert shares == approx(jumped.dissipated_energy, rel=1e-12)


def test_where_friction_no_longer_holds_a_load_the_contact_slides_from_where_it_fails():
    start = turned((0.6,))
    held = SPHERE.advance(start, friction=0.5 * FRICTION, saturate=True)
    # everything slides once μN is T, as in virgin loading to the limit
    assert held.tangential_displacement == approx(0.6 * FRICTION, rel=1e-9)
    assert held.tangential_load == approx(0.5 * LIMIT)
    again = SPHERE.advance(held, friction=FRICTION, saturate=True)
    assert again.tangential_load == approx(0.6 * LIMIT)


@mark.parametrize("motion", [1.0, 1e-3, 1e-5])
@mark.parametrize("law", [limits.MOST_FRICTION, hs.laws.ShearStrength(1e30)])
def test_the_largest_coefficient_is_full_stick(motion, law):
    # T = 8 G* a U of a contact that does not slip; the slip zone, U/(μδ) wide, takes a quarter of that share off
    ensemble = hs.Ensemble(UNIT, 0.0, 1.0, law)
    state = ensemble.advance(ensemble.initial_state(), normal_load=0.01)
    displacement = motion * state.approach
    stick = 8 * 0.25 * math.sqrt(state.approach) * displacement
    state = ensemble.advance(state, tangential_displacement=displacement)
    assert state.tangential_load == approx(stick, rel=3e-5 * motion + 1e-6)
    assert ensemble.advance(state, tangential_displacement=0.0).tangential_load == approx(
        0.0, abs=stick * (1e-4 * motion + 1e-6)
    )


def test_larger_coefficients_are_refused_wherever_they_are_given():
    ensemble = hs.Ensemble(UNIT, [0.0, -0.1], 1.0, 0.2)
    state = ensemble.initial_state()
    curves, rows = hs.Patches.from_normal_curves, np.linspace(0.1, 1.0, 8)
    large = 1.01 * limits.MOST_FRICTION
    for give in (
        lambda: hs.Ensemble(UNIT, 0.0, 1.0, large),
        lambda: hs.Ensemble(UNIT, [0.0, -0.1], 1.0, [0.2, large]),
        lambda: hs.ContactBatch(UNIT, radius=1.0, friction=large, count=2),
        lambda: curves(UNIT, rows, rows[:, None] ** 1.5, friction=large),
        lambda: hs.FrictionChange(0.0, large),
        lambda: hs.FrictionRamp(0.0, (0.2, large)),
        lambda: FrictionCourse(time=[0.0, 1.0], coefficient=[0.2, large]),
        lambda: ensemble.advance(state, friction=large),
    ):
        with raises(hs.InputError, match="10000 at most"):
            give()


def test_the_library_takes_larger_coefficients_for_the_largest():
    # as a law of the caller's or a factor of an FMU may make them
    from historysim.basics.library import ffi, lib

    ensemble = hs.Ensemble(UNIT, 0.0, 1.0, 0.2)
    memory = lib.hs_state_new(
        ensemble.initial_state().memory.line.contact, ffi.new("double *", 1e20)
    )
    assert memory.line.friction[0] == limits.MOST_FRICTION
    lib.hs_state_free(memory)


def test_messages():
    check_messages(globals())
