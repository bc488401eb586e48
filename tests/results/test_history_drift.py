"""Drift and positioning, by the source's definitions and numbers."""

import numpy as np
from golden import refused
from pytest import approx, mark, raises

import historysim as hs
from historysim.contact import drift as one_contact
from historysim.measured.branches import DEFAULT
from historysim.results import history_drift
from historysim.results.history_drift import disturbance_at_rest

PAIR = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
RADIUS = 0.5e-6
ONE = {"summit_radius": RADIUS}


@mark.parametrize("friction", [(0.5, 0.5), (0.5, 0.3), (0.3, 0.5)])
@mark.parametrize("loads", [(50e-3, 70e-3), (50e-3, 30e-3)])
def test_the_backward_branch_agrees_with_stepping_back(loads, friction):
    """Slides at 1 - 1e-9 of the limit; near it the load varies with the power 3/2 of what is left."""
    ensemble = hs.Ensemble(PAIR, 0.0, RADIUS, friction[0])
    state = ensemble.advance(
        ensemble.initial_state(), normal_load=loads[0], tangential_displacement=2e-6
    )
    # the rise comes first
    if friction[1] > friction[0]:
        state = ensemble.advance(state, friction=friction[1])
    state = ensemble.advance(
        state, normal_load=loads[1], tangential_displacement=2e-6, friction=friction[1]
    )
    first, second = (
        one_contact.preliminary_displacement(PAIR, normal_load=load, friction=each, **ONE)
        for load, each in zip(loads, friction, strict=True)
    )
    branch = float(one_contact.backward_branch(first, second))
    short, whole = (
        ensemble.advance(state, tangential_displacement=2e-6 - share * branch).tangential_load
        for share in (1 - 1e-6, 1.0)
    )
    assert whole == approx(-friction[1] * loads[1], rel=1e-12)
    assert short > whole * (1 - 1e-13)
    assert short == approx(whole, rel=1e-8)


def test_branch_drift_of_many_asperities_follows_the_last_to_slide():
    """By brute force over θ μ (δ1 + δ2): with unequal friction another asperity decides each branch."""
    generator = np.random.default_rng(3)
    heights, friction = generator.normal(0.0, 30e-9, 12), generator.uniform(0.1, 0.9, 12)
    ensemble = hs.Ensemble(PAIR, heights, RADIUS, friction)
    history = hs.replay(
        ensemble, [hs.NormalLoad(0.0, 20e-3), hs.NormalLoad(1.0, 45e-3)], record="all"
    )
    state = ensemble.advance(
        ensemble.initial_state(), normal_load=20e-3, tangential_displacement=2e-6
    )
    state = ensemble.advance(state, normal_load=45e-3, tangential_displacement=2e-6)
    first = history_drift._displacements(history, 0).max()
    for share, slides in ((1 - 1e-4, False), (1 + 1e-9, True)):
        branch = share * (2 * first + history_drift.branch_drift(history, 0, 1))
        back = ensemble.advance(state, tangential_displacement=2e-6 - branch)
        limit = float(np.sum(friction * history.normal_load.values[1]))
        assert (back.tangential_load == approx(-limit, rel=1e-12)) is slides


def test_drift_between_cycles_and_runs():
    ensemble = hs.Ensemble(PAIR, 0.0, RADIUS, 0.5)

    def run(loads):
        events = [hs.NormalLoad(0.0, loads[0])]
        for index, load in enumerate(loads):
            time = 5.0 * index
            events += [hs.NormalLoad(time, load), hs.TangentialDisplacement(time, 0.0)]
            targets = zip((1.0, 2.0, 3.0, 4.0), (1.5e-6, -1.5e-6, 1.5e-6, 0.0), strict=True)
            events += [hs.TangentialDisplacement(time + after, target) for after, target in targets]
            events += [hs.NormalLoad(time + 4.0, load)]
        return hs.replay(ensemble, events, substeps=50)

    both = run((20e-3, 40e-3))
    found = history_drift.cycle_drift(both)
    expected = 2 * float(
        one_contact.drift(PAIR, normal_load=(20e-3, 40e-3), friction=(0.5, 0.5), **ONE)
    )
    # a branch is taken to end where this share of the way between the friction forces is covered
    expected *= 1 - (1 - DEFAULT.reached) ** (2 / 3)
    assert found.dims == ("direction",)
    assert found.sel(direction="backward").item() == approx(expected, rel=0.01)
    with refused("loop 7"):
        history_drift.cycle_drift(both, 7)
    other = history_drift.run_drift(run((20e-3,)), both)
    assert other == approx(hs.analysis.drift(both, 0, -1), rel=1e-12)


def test_there_and_back_leaves_a_quarter_of_the_preliminary_displacement():
    ensemble = hs.Ensemble(PAIR, 0.0, RADIUS, 0.5)
    limit = 0.5 * 50e-3
    events = [hs.NormalLoad(0.0, 50e-3), hs.TangentialLoad(1.0, limit), hs.TangentialLoad(2.0, 0.0)]
    history = hs.replay(ensemble, events)
    whole = one_contact.preliminary_displacement(PAIR, normal_load=50e-3, friction=0.5, **ONE)
    left = history_drift.positioning_error(history)
    assert left == approx((2 ** (1 / 3) - 1) * float(whole), rel=1e-9)
    part = hs.replay(ensemble, [events[0], hs.TangentialLoad(1.0, 0.3 * limit), events[2]])
    # Masing at T = 0 after a load T*: virgin displacement there, less twice that of half of it
    f = np.array([0.3, 0.15])
    virgin = float(whole) * (1 - (1 - f) ** (2 / 3))
    assert history_drift.positioning_error(part) == approx(virgin[0] - 2 * virgin[1], rel=1e-9)
    with refused("there and back"):
        history_drift.positioning_error(history, 0, 1)
    with refused("step 9"):
        history_drift.positioning_error(history, 0, 9)


def test_a_controller_sees_a_falling_load_and_no_rising_one():
    """Virgin (N1, T), N falls: virgin (N2, T) at a held load, and virgin (N2, U) at a held displacement."""
    ensemble = hs.Ensemble(PAIR, 0.0, RADIUS, 0.5)
    state = ensemble.advance(ensemble.initial_state(), normal_load=50e-3)
    state = ensemble.advance(state, tangential_load=12e-3)
    rising = disturbance_at_rest(ensemble, state, 80e-3)
    assert abs(rising.tangential_load) < 1e-12 * 12e-3
    assert abs(rising.tangential_displacement) < 1e-12 * state.tangential_displacement
    falling = disturbance_at_rest(ensemble, state, 30e-3)
    virgin = ensemble.advance(ensemble.initial_state(), normal_load=30e-3)
    pushed = (
        ensemble.advance(virgin, tangential_load=12e-3).tangential_displacement
        - state.tangential_displacement
    )
    held = (
        ensemble.advance(
            virgin, tangential_displacement=state.tangential_displacement
        ).tangential_load
        - 12e-3
    )
    assert falling.tangential_displacement == approx(pushed, rel=1e-9)
    assert falling.tangential_load == approx(held, rel=1e-9)
    assert held < 0 < pushed
    soft = disturbance_at_rest(ensemble, state, 30e-3, instrument=hs.Instrument(3.34e5))
    assert held < soft.tangential_load < 0
    with raises(hs.FrictionLimitError):
        disturbance_at_rest(ensemble, state, 20e-3)


def test_the_apparent_shift_is_read_off_a_history():
    loads = [(50e-3, 0.0), (50e-3, 12e-3), (30e-3, 12e-3)]
    each = [
        (hs.NormalLoad(float(at), n), hs.TangentialLoad(float(at), t))
        for at, (n, t) in enumerate(loads)
    ]
    events = [*(event for both in each for event in both), hs.NormalLoad(3.0, 60e-3)]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, RADIUS, 0.5), events)
    seen = history_drift.apparent_shift(history)
    assert seen.step.values.tolist() == [2, 3]
    assert seen.normal_load.values == approx([-20e-3, 30e-3])
    assert seen.tangential_load.values.tolist() == [0.0, 0.0]
    displacement = history.tangential_displacement.values
    assert seen.tangential_displacement.values == approx([displacement[2] - displacement[1], 0.0])


def test_drift_follows_other_summits():
    """The present heights and radii count: one of two that are left is lower by 10 nm, and blunter."""
    heights, radii = np.array([0.0, -5e-9]), np.array([0.5e-6, 0.5e-6])
    events = [hs.NormalDisplacement(0.0, 20e-9), hs.GeometryChange(1.0, -10e-9, 1e-6, [0])]
    history = hs.replay(hs.Ensemble(PAIR, heights, radii, 0.5), events)
    ratio = PAIR.displacement_ratio
    found = hs.analysis.preliminary_displacement(history).values
    assert found == approx([ratio * 0.5 * 20e-9, ratio * 0.5 * 15e-9], rel=1e-9)
    assert hs.analysis.critical_asperity(history).values.tolist() == [0, 1]
    assert history_drift.branch_drift(history, 0, 1) == approx(2 * ratio * 0.5 * 5e-9, rel=1e-9)
    assert dict(hs.analysis.summary(history))["asperities touched"] == "2 of 2"
