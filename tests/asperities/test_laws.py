"""Friction and wear laws: the source's numbers, closed forms, limits, and what is refused."""

import numpy as np
from golden import check_messages
from pairs import GLASS
from pairs import UNIT as PAIR
from pytest import approx, mark, raises

import historysim as hs
from historysim.asperities.laws import PowerLaw, ShearStrength, SlidFriction  # noqa: F401 - of the messages
from historysim.asperities.wear import ArchardWear, EnergyWear, WearLaw  # noqa: F401 - of the messages

BALL = 2.5e-3


def loaded(ensemble, load):
    return ensemble.advance(ensemble.initial_state(), normal_load=load)


def test_without_work_of_adhesion_the_area_of_jkr_agrees_with_hertz():
    """So that work of adhesion may be swept from 0 on; the area grows with it from there."""
    laws = [
        ShearStrength(11.37e6),
        *(ShearStrength(11.37e6, "jkr", work) for work in (0.0, 1e-12, 0.1)),
    ]
    hertz, none, hardly, some = (
        loaded(hs.Ensemble(GLASS, 0.0, BALL, law), 10e-3).friction[0] for law in laws
    )
    assert none == approx(hertz, rel=1e-14)
    # a³ grows by √(6πWR/N) of itself to first order
    root = np.sqrt(6 * np.pi * 1e-12 * BALL / 10e-3)
    assert hardly / none - 1 == approx(2 / 3 * root, rel=root)
    assert some > 1.1 * none


def moves(ensemble, state):
    state = ensemble.advance(state, normal_load=0.01, tangential_load=0.002)
    state = ensemble.advance(state, normal_load=0.02, tangential_load=-0.003)
    return ensemble.advance(state, normal_load=0.02, tangential_displacement=0.01)


def test_equal_coefficients_one_by_one_are_one_coefficient():
    heights = [0.0, -0.01, -0.02]
    one, each = hs.Ensemble(PAIR, heights, 1.0, 0.5), hs.Ensemble(PAIR, heights, 1.0, [0.5] * 3)
    law = hs.Ensemble(PAIR, heights, 1.0, PowerLaw(0.5, 0.01, 0.0))
    states = [moves(ensemble, ensemble.initial_state()) for ensemble in (one, each, law)]
    assert states[0] == states[1]
    # but for what each belongs to, and the checksum
    plain, by_law = (states[each].to_bytes() for each in (0, 2))
    assert plain[:64] + plain[72:-8] == by_law[:64] + by_law[72:-8]
    events = [hs.NormalLoad(0.0, 0.01), hs.TangentialDisplacement(1.0, 0.01)]
    change = hs.FrictionChange(0.5, [0.5] * 2, [0, 2])
    assert hs.Replay(one, events).state() == hs.Replay(one, [events[0], change, events[1]]).state()


def test_energy_is_balanced_where_geometry_changes():
    """∫ T dU = stored + dissipated + erased, for a change of geometry at a held displacement."""
    ensemble = hs.Ensemble(PAIR, [0.0, -0.01], [1.0, 0.8], 0.5)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=0.03)
    state = ensemble.advance(state, tangential_displacement=0.008)
    work = state.stored_energy + state.dissipated_energy
    new = ensemble.with_geometry(state, summit_height=-0.005, asperities=[0])
    assert new.stored_energy + new.dissipated_energy + new.evolved.erased_energy == approx(
        work, rel=1e-12
    )
    assert (new.evolved.erased_memories, new.approach) == (1, state.approach)


def test_friction_between_waypoints_agrees_with_many_small_falls():
    """A ramp of friction at a held displacement, and with the load: chords against many changes at rest."""
    ensemble = hs.Ensemble(PAIR, [0.0, -0.01], [1.0, 0.8], 0.5)
    events = [
        hs.NormalLoad(0.0, 0.01),
        hs.TangentialDisplacement(1.0, 0.006),
        hs.NormalLoad(1.0, 0.01),
    ]
    ramp = [
        *events,
        hs.FrictionRamp(1.0, 0.5),
        hs.FrictionRamp(2.0, 0.2),
        hs.TangentialDisplacement(2.0, 0.012),
    ]
    found = hs.replay(ensemble, ramp, substeps=4)
    assert found.present_friction.values[-5:] == approx([0.5, 0.425, 0.35, 0.275, 0.2])
    ends = []
    for count in (100, 200):
        small = list(events)
        for k in range(1, count + 1):
            time = 1 + k / count
            small.append(hs.TangentialDisplacement(time, 0.006 + 0.006 * k / count))
            small.append(hs.FrictionChange(time, 0.5 - 0.3 * k / count))
        ends.append(hs.replay(ensemble, small).isel(step=-1))
    for name in ("total_tangential_load", "total_dissipated_energy"):
        coarse, fine = (float(end[name]) for end in ends)
        assert float(found[name][-1]) == approx(
            2 * fine - coarse, abs=abs(fine - coarse) + 1e-6 * fine
        )


def test_a_load_beyond_what_falling_friction_holds_is_refused_or_held():
    ensemble = hs.Ensemble(PAIR, 0.0, 1.0, ShearStrength(0.05))
    state = loaded(ensemble, 0.005)
    limit = state.friction[0] * 0.005
    state = ensemble.advance(state, tangential_load=0.9 * limit)
    # τ0 A falls with the load
    with raises(hs.FrictionLimitError):
        ensemble.advance(state, normal_load=0.001)
    held = ensemble.advance(state, normal_load=0.001, saturate=True)
    assert held.tangential_load == approx(held.friction[0] * 0.001, rel=1e-9)
    back = ensemble.advance(held, normal_load=0.005, saturate=True)
    assert back.tangential_load == approx(0.9 * limit, rel=1e-6)


@mark.parametrize("substeps", [1, 10])
@mark.parametrize(
    "options", [{"follow_sliding": True}, {"wear": ArchardWear(coefficient=1e-30, hardness=1.0)}]
)
def test_the_distance_slid_by_all_does_not_depend_on_the_substeps(options, substeps):
    # the second summit touches midway, and slides immediately; the first has slid since 1/21 of the
    # path
    ensemble = hs.Ensemble(PAIR, [0.0, -0.01], 1.0, 0.25, **options)
    events = [
        hs.NormalDisplacement(0.0, 0.002),
        hs.TangentialDisplacement(0.0, 0.0),
        hs.NormalDisplacement(1.0, 0.02),
        hs.TangentialDisplacement(1.0, 3 * 0.25 * 0.02),
    ]
    history = hs.replay(ensemble, events, substeps=substeps, record="all")
    total = history.total_slid_distance.values[-1]
    assert total == approx(0.25 * 0.02 * 3 * (1 - 1 / 21), rel=1e-9)
    assert total == approx(history.slid_distance.values[-1, 0], rel=1e-9)


@mark.parametrize("substeps", [1, 7])
def test_what_slides_in_turn_does_not_slide_together(substeps):
    ensemble = hs.Ensemble(PAIR, [0.0, -0.002, -0.012], 1.0, [0.1, 0.1, 0.4], follow_sliding=True)
    events = [hs.NormalDisplacement(0.0, 0.02), hs.TangentialDisplacement(0.0, 0.0)]
    # moved by 0.005 the softest slides last where its limit is the largest: 0.4 (0.02 - 0.012) =
    # 0.0032 from the start
    events.append(hs.TangentialDisplacement(1.0, 0.005))
    history = hs.replay(ensemble, events, substeps=substeps, record="all")
    assert history.total_slid_distance.values[-1] == approx(0.005 - 0.0032, rel=1e-9)


def test_messages():
    check_messages(globals())
