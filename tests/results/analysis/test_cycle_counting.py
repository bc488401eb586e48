"""Cycles: against the rainflow count, against the contact without the excursion, and against finer events."""

import itertools

import numpy as np
from golden import refused
from pairs import UNIT as PAIR
from pytest import approx, mark

import historysim as hs

HEIGHTS = [0.0, -2e-3, -4e-3, -30e-3]
FRICTION = 0.5
LOAD = 10e-3


def contact(friction=FRICTION):
    return hs.Ensemble(PAIR, HEIGHTS, 1.0, friction)


def held(load, displacements):
    """Return displacements at a constant normal load, which is applied first."""
    turns = (
        hs.TangentialDisplacement(1.0 + index, float(u)) for index, u in enumerate(displacements)
    )
    return [hs.NormalLoad(0.0, load), *turns]


def rainflow(values, *, starts_at_rest):
    """Return ranges of full and half cycles by ASTM E1049, section 5.4.4.

    A virgin contact remembers every amplitude around its start, as after a decaying oscillation:
    then a range with the starting point is half a cycle when the opposite of its end is passed.
    """
    turns = [values[0]]
    for previous, value, following in zip(values, values[1:], values[2:], strict=False):
        if (value - previous) * (following - value) < 0:
            turns.append(value)
    turns.append(values[-1])
    full, half, stack = [], [], []
    for turn in turns:
        stack.append(turn)
        while len(stack) >= 3:
            latest, previous = abs(stack[-1] - stack[-2]), abs(stack[-2] - stack[-3])
            holds_start = len(stack) == 3
            passed = latest >= previous
            if holds_start and starts_at_rest:
                passed = abs(stack[-1] - values[0]) >= abs(stack[-2] - values[0])
            if not passed:
                break
            if holds_start:
                half.append(previous)
                del stack[0]
            else:
                full.append(previous)
                del stack[-3:-1]
    return full, half + [abs(b - a) for a, b in itertools.pairwise(stack)]


def assert_counted(counted, full, half):
    ranges, closed = counted.tangential_displacement_range.values, counted.closed.values
    assert np.sort(ranges[closed]) == approx(np.sort(full), rel=1e-9)
    assert np.sort(ranges[~closed]) == approx(np.sort(half), rel=1e-9)


def assert_sum(counted, history):
    """Check that all energies sum to the total, by the largest number of terms of rounding."""
    total = float(history.total_dissipated_energy[-1])
    assert float(counted.dissipated_energy.sum()) == approx(total, rel=1e-12)
    assert counted.dissipated_energy.min() >= -1e-15 * total


@mark.parametrize("seed", range(12))
def test_in_partial_slip_cycles_are_those_of_rainflow(seed):
    ensemble = contact()
    reach = FRICTION * ensemble.approach_at(LOAD)
    displacement = np.random.default_rng(seed).uniform(-0.45, 0.45, 40) * reach
    history = hs.replay(ensemble, held(LOAD, displacement))
    counted = history.contact.cycles()
    assert_counted(counted, *rainflow([0.0, *displacement], starts_at_rest=True))
    assert_sum(counted, history)
    # at the closing moment a loop is where it started
    ended = counted.where(counted.closed, drop=True)
    for start, end in zip(
        ended.start_tangential_displacement.values, ended.end_time.values, strict=True
    ):
        assert np.interp(end, history.time, history.tangential_displacement) == approx(
            start, abs=1e-9 * reach
        )


@mark.parametrize("seed", range(6))
def test_where_every_stroke_slides_cycles_are_those_of_rainflow(seed):
    ensemble = contact()
    reach = FRICTION * ensemble.approach_at(LOAD)
    random = np.random.default_rng(seed)
    # every stroke is longer than twice the preliminary displacement, after which all springs slide
    displacement = np.cumsum(random.uniform(2.1, 9.0, 40) * reach * (-1) ** np.arange(40))
    history = hs.replay(ensemble, held(LOAD, displacement))
    counted = history.contact.cycles()
    assert_counted(counted, *rainflow([0.0, *displacement], starts_at_rest=False))
    assert_sum(counted, history)


def test_from_the_largest_amplitude_cycles_are_those_of_plain_rainflow():
    reach = FRICTION * contact().approach_at(LOAD)
    displacement = [0.9 * reach, *(np.random.default_rng(1).uniform(-0.9, 0.9, 60) * reach)]
    counted = hs.replay(contact(), held(LOAD, displacement)).contact.cycles()
    assert_counted(counted, *rainflow([0.0, *displacement], starts_at_rest=False))


def varying(seed, normal, tangential, count=30):
    """Return random events of both channels; some lift the contact off, some slide."""
    random = np.random.default_rng(seed)
    events = [normal(0.0, 0.02 if normal is hs.NormalLoad else 0.05)]
    for time in range(1, count):
        lifts = random.uniform() < 0.05
        loads = {hs.NormalLoad: 0.0 if lifts else random.uniform(4e-3, 20e-3)}
        loads[hs.NormalDisplacement] = -5e-3 if lifts else random.uniform(20e-3, 60e-3)
        loads[hs.TangentialDisplacement] = random.uniform(-20e-3, 20e-3)
        loads[hs.TangentialLoad] = random.uniform(-2e-3, 2e-3)
        events += [normal(float(time), loads[normal]), tangential(float(time), loads[tangential])]
    return events


KINDS = [
    (hs.NormalLoad, hs.TangentialDisplacement, {}),
    (hs.NormalDisplacement, hs.TangentialDisplacement, {}),
    (hs.NormalLoad, hs.TangentialLoad, {"saturate": True}),
    (hs.NormalDisplacement, hs.TangentialLoad, {"saturate": True}),
    (hs.NormalLoad, hs.TangentialDisplacement, {"instrument": hs.Instrument(0.3)}),
]


@mark.parametrize("normal, tangential, options", KINDS)
@mark.parametrize("seed", range(4))
def test_a_closed_loop_leaves_the_contact_as_if_it_had_not_happened(
    seed, normal, tangential, options
):
    ensemble = contact()
    job = hs.Replay(ensemble, varying(seed, normal, tangential), **options)
    history = job.dataset()
    counted = history.contact.cycles()
    assert_sum(counted, history)
    scale = float(abs(history.total_tangential_load).max())
    for row in np.flatnonzero(counted.closed.values):
        start, end = (
            job.state(until=float(counted[name][row])) for name in ("start_time", "end_time")
        )
        without = ensemble.advance(
            start,
            normal_displacement=end.approach,
            tangential_displacement=end.tangential_displacement,
        )
        assert without.tangential_load == approx(end.tangential_load, abs=1e-8 * scale)
        for further in (30e-3, -30e-3):
            moved = [
                ensemble.advance(state, tangential_displacement=further) for state in (without, end)
            ]
            assert moved[0].tangential_load == approx(moved[1].tangential_load, abs=1e-8 * scale)
        # what was dissipated in its time is its energy and that of the rows within it
        within = (counted.start_time >= counted.start_time[row]) & (
            counted.end_time <= counted.end_time[row]
        )
        dissipated = end.dissipated_energy - start.dissipated_energy
        total = float(counted.dissipated_energy.where(within).sum())
        assert total == approx(dissipated, abs=1e-9 * float(history.total_dissipated_energy[-1]))


@mark.parametrize("asperity", [None, 0, 1])
@mark.parametrize("seed", range(3))
def test_finer_events_have_the_same_cycles(seed, asperity):
    """A path in displacements, cut into parts that are events of their own, has the same fronts."""
    events = varying(seed, hs.NormalDisplacement, hs.TangentialDisplacement)
    times = np.unique([event.time for event in events])
    finer = np.append(
        np.unique([times[:-1] + share * np.diff(times) for share in (0.0, 0.3, 0.6)]), times[-1]
    )
    cut = []
    for kind in (hs.NormalDisplacement, hs.TangentialDisplacement):
        points = [(event.time, event.value) for event in events if isinstance(event, kind)]
        points = points if points[0][0] == 0.0 else [(0.0, 0.0), *points]
        values = np.interp(finer, *zip(*points, strict=True))
        cut += [kind(time, value) for time, value in zip(finer, values, strict=True)]
    cut.sort(key=lambda event: event.time)
    coarse, fine = (hs.replay(contact(), each, record="all") for each in (events, cut))
    first, second = (history.contact.cycles(asperity) for history in (coarse, fine))
    closed = [counted.where(counted.closed, drop=True) for counted in (first, second)]
    ended, energies = (
        [np.sort(each[name].values) for each in closed]
        for name in ("end_time", "dissipated_energy")
    )
    assert ended[1] == approx(ended[0], rel=1e-8)
    smallest = 1e-12 * float(coarse.total_dissipated_energy[-1])
    assert energies[1] == approx(energies[0], rel=1e-6, abs=smallest)


@mark.parametrize("normal, tangential, options", KINDS)
def test_asperities_with_their_own_coefficients_have_their_own_cycles(normal, tangential, options):
    ensemble = contact(friction=[0.5, 0.3, 0.5, 0.2])
    history = hs.replay(ensemble, varying(7, normal, tangential), record="all", **options)
    for asperity in range(4):
        counted = history.contact.cycles(asperity)
        total = float(history.dissipated_energy.sel(asperity=asperity)[-1])
        assert float(counted.dissipated_energy.sum()) == approx(total, rel=1e-12)
        assert (np.diff(counted.start_time) >= 0).all()


def evaluation(events, friction=FRICTION, heights=HEIGHTS, **options):
    return hs.replay(hs.Ensemble(PAIR, heights, 1.0, friction, **options), events)


SLIDE = held(LOAD, [1e-3, -1e-3])
REFUSED = {
    "two tangential directions": lambda: evaluation(
        [hs.NormalLoad(0.0, LOAD), hs.TangentialDisplacement(1.0, (1e-3, 1e-3))]
    ),
    "asperity=": lambda: evaluation(SLIDE, friction=[0.5, 0.3, 0.5, 0.2]),
    "an event changes": lambda: evaluation([*SLIDE, hs.FrictionChange(3.0, 0.2)]),
    "law of wear": lambda: evaluation(
        SLIDE, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=1.0)
    ),
    "law of friction": lambda: evaluation(SLIDE, friction=hs.laws.ShearStrength(0.1)),
    "law of yielding": lambda: evaluation(SLIDE, yielding=hs.yielding.KogutEtsion(hardness=1.0)),
    "need the load events": lambda: evaluation(SLIDE).copy().drop_encoding(),
}


@mark.parametrize("reason", REFUSED)
def test_what_has_no_cycles_is_refused_with_the_reason(reason):
    with refused(reason):
        REFUSED[reason]().contact.cycles()


@mark.parametrize("asperity", [4, -1, "0", 1.5, True])
def test_an_asperity_that_does_not_exist_is_refused(asperity):
    with refused("expected a label from 0 to 3"):
        evaluation(SLIDE).contact.cycles(asperity)
