"""Sums over many asperities by clusters, compared with direct sums in extended precision."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, mark

import historysim as hs
from historysim.basics.library import lib

PAIR = hs.MaterialPair.from_moduli(contact_modulus=5e10, shear_modulus=1e10)
COUNT = 20_000
TOP = 2e-7  # largest gap [m]
RANDOM = np.random.default_rng(11)
GAPS = {
    "uniform": RANDOM.uniform(0.0, TOP, COUNT),
    "tail of a Gaussian": np.minimum(RANDOM.exponential(0.1 * TOP, COUNT), TOP),
    "plateaus": RANDOM.integers(0, 5, COUNT) * (TOP / 4),
    "geometric": TOP * 10.0 ** RANDOM.uniform(-12.0, 0.0, COUNT),
    "two narrow peaks": np.where(RANDOM.random(COUNT) < 0.5, 0.0, 0.5 * TOP)
    + 1e-9 * TOP * RANDOM.random(COUNT),
}
RADIUS = RANDOM.uniform(0.5e-6, 2e-6, COUNT)


def powers(gap, approach, exponent):
    """Σ R^(1/2) (a - h)^exponent over the asperities that touch, in extended precision."""
    depth = np.maximum(np.longdouble(approach) - gap.astype(np.longdouble), 0)
    touching = depth > 0
    return np.sum(
        np.sqrt(RADIUS[touching].astype(np.longdouble)) * depth[touching] ** np.longdouble(exponent)
    )


@mark.parametrize("name", GAPS)
def test_loads_are_those_of_direct_sums(name):
    height = -GAPS[name]
    gap = height.max() - height
    ensemble = hs.Ensemble(PAIR, height, RADIUS, 0.2)
    assert ensemble.initial_state().memory.line.contact.clusters
    for approach in (1e-4 * TOP, 0.03 * TOP, 0.25 * TOP, 0.6 * TOP, TOP, 3.0 * TOP):
        state = ensemble.advance(ensemble.initial_state(), normal_displacement=approach)
        contact = state.memory.line.contact
        load = float(4 / 3 * PAIR.contact_modulus * powers(gap, approach, 1.5))
        slope = float(2 * PAIR.contact_modulus * powers(gap, approach, 0.5))
        area = float(np.pi * np.sum(RADIUS * np.maximum(approach - gap, 0.0)))
        # the gaps that the core computes are rounded as a height is
        assert state.normal_load == approx(load, rel=1e-13)
        assert state.normal_stiffness == approx(slope, rel=1e-12)
        assert lib.hs_approach_at(contact, state.normal_load) == approx(approach, rel=1e-13)
        totals = hs.replay(ensemble, [hs.NormalDisplacement(0.0, approach)], record="totals")
        assert float(totals.real_contact_area[-1]) == approx(area, rel=1e-12)


@mark.parametrize("name", GAPS)
def test_stored_energies_are_those_of_direct_sums(name):
    """θ μ² [Q(d) - Q(f) - (d - f) P(f)] after a first displacement: Q = ∫P da, and f is the label of the slip front."""
    ensemble = hs.Ensemble(PAIR, -GAPS[name], RADIUS, 0.2)
    gap, theta = GAPS[name] - GAPS[name].min(), PAIR.contact_modulus / (4 * PAIR.shear_modulus)
    held = ensemble.advance(ensemble.initial_state(), normal_displacement=TOP)
    for slipped in (0.01, 0.3, 0.8):
        front = (1 - slipped) * TOP
        state = ensemble.advance(held, tangential_displacement=theta * 0.2 * slipped * TOP)
        integrals = powers(gap, TOP, 2.5) - powers(gap, front, 2.5)
        energy = (
            4
            / 3
            * PAIR.contact_modulus
            * (0.4 * integrals - slipped * TOP * powers(gap, front, 1.5))
        )
        assert state.stored_energy == approx(theta * 0.2**2 * float(energy), rel=1e-11)
        tangential = (
            0.2 * 4 / 3 * PAIR.contact_modulus * (powers(gap, TOP, 1.5) - powers(gap, front, 1.5))
        )
        assert state.tangential_load == approx(float(tangential), rel=1e-12)


def test_groups_with_and_without_clusters_sum_up():
    """A large group begins amid a block of 256; a small one has no clusters."""
    gap, friction = GAPS["uniform"], np.where(np.arange(COUNT) < 300, 0.1, 0.3)
    ensemble = hs.Ensemble(PAIR, -gap, RADIUS, friction)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=0.5 * TOP)
    line = state.memory.line
    assert line.contact.groups == 2
    assert line.contact.clusters != line.contact.sorted_clusters
    state = ensemble.advance(state, tangential_displacement=1e-6)
    depth = np.maximum(np.longdouble(0.5 * TOP) - (gap - gap.min()), 0)
    limit = (
        np.sum(friction * np.sqrt(RADIUS.astype(np.longdouble)) * depth**1.5)
        * 4
        / 3
        * PAIR.contact_modulus
    )
    assert state.tangential_load == approx(float(limit), rel=1e-12)


def test_summits_that_wear_have_clusters_of_their_present_shape():
    height = -GAPS["uniform"]
    wear = hs.wear.ArchardWear(coefficient=1e-3, hardness=5e9)
    ensemble = hs.Ensemble(PAIR, height, RADIUS, 0.2, wear=wear)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=0.02 * TOP)
    state = ensemble.advance(state, tangential_displacement=2e-8)
    worn = state.evolved
    assert np.count_nonzero(worn.worn_volume) > 10
    approach = np.longdouble(state.memory.line.approach * state.memory.line.contact.units.length)
    depth = np.maximum(approach - (height.max() - worn.summit_height.astype(np.longdouble)), 0)
    load = (
        4
        / 3
        * PAIR.contact_modulus
        * np.sum(np.sqrt(worn.summit_radius.astype(np.longdouble)) * depth**1.5)
    )
    assert state.normal_load == approx(float(load), rel=1e-12)


def strokes(seed, count=40):
    """Slides, loops within loops, and approaches that grow, fall and lift off; displacements alone."""
    random = np.random.default_rng(seed)
    reach = PAIR.contact_modulus / (4 * PAIR.shear_modulus) * 0.3 * TOP
    events = [hs.NormalDisplacement(0.0, TOP)]
    for time in range(1, count):
        if time % 5 == 0:
            approach = TOP * random.choice([-0.1, 0.02, 0.4, 0.9, 1.3])
            events.append(hs.NormalDisplacement(time, approach))
        if time % 5 or time % 2:
            scale = random.choice([0.01, 0.3, 2.0])
            events.append(
                hs.TangentialDisplacement(time, scale * reach * random.uniform(-1.0, 1.0))
            )
    return events


@mark.parametrize("own", [False, True])
@mark.parametrize("name", GAPS)
def test_energies_of_asperities_are_those_of_few(name, own):
    """Energies of few asperities are added to each, those of many to proxies of clusters."""
    friction = RANDOM.uniform(0.05, 0.5, COUNT) if own else np.full(COUNT, 0.2)
    height = GAPS[name].min() - GAPS[name]
    # own coefficients have clusters at constant approach alone
    events = strokes(3)[: 5 if own else None]
    ensemble = hs.Ensemble(PAIR, height, RADIUS, friction)
    every = hs.replay(ensemble, events, record="all", hold=True)
    chosen = np.append(int(np.argmax(height)), RANDOM.choice(COUNT, 200, replace=False))
    few = hs.Ensemble(PAIR, height[chosen], RADIUS[chosen], friction[chosen])
    wanted = hs.replay(few, events, record="all", hold=True).dissipated_energy.values
    found = every.dissipated_energy.values
    assert np.abs(found[:, chosen] - wanted).max() < 1e-13 * wanted.max()
    total = every.total_dissipated_energy.values
    assert_allclose(found.sum(axis=1), total, rtol=1e-12, atol=1e-12 * total[-1])
    some = hs.replay(ensemble, events, record=np.unique(chosen).tolist(), hold=True)
    assert_array_equal(some.dissipated_energy, found[:, np.unique(chosen)])


def test_energies_of_clusters_do_not_depend_on_reading():
    ensemble = hs.Ensemble(PAIR, -GAPS["uniform"], RADIUS, 0.2)
    events = strokes(4, 12)
    job = hs.Replay(ensemble, events, record="totals", hold=True)
    whole, state = job.state(), ensemble.initial_state()
    for time in range(12):
        goals = {
            f"{event.channel}_displacement": event.value for event in events if event.time == time
        }
        state = hs.State.from_bytes(state.to_bytes(), ensemble.initial_state())
        state = ensemble.advance(state, **goals)
        ensemble.asperities(state), ensemble.with_friction(state, 0.1), ensemble.enter_plane(state)
    assert state == whole == hs.Replay(ensemble, events, record="all", hold=True).state()


def test_a_fall_of_friction_and_a_turn_take_over_the_energies_of_clusters():
    height = GAPS["uniform"].min() - GAPS["uniform"]
    events = [*strokes(4, 12), hs.FrictionChange(12.5, 0.15), hs.TangentialDisplacement(13.0, 1e-8)]
    chosen = np.append(int(np.argmax(height)), RANDOM.choice(COUNT, 50, replace=False))
    few = hs.Ensemble(PAIR, height[chosen], RADIUS[chosen], 0.2)
    wanted, found = (
        hs.replay(contact, events, record="all", hold=True).dissipated_energy.values[-1]
        for contact in (few, hs.Ensemble(PAIR, height, RADIUS, 0.2))
    )
    assert np.abs(found[chosen] - wanted).max() < 1e-12 * wanted.max()
    planar = [
        hs.TangentialDisplacement(e.time, (e.value, 0.0))
        if isinstance(e, hs.TangentialDisplacement)
        else e
        for e in events[:-2]
    ]
    turned = [*planar, hs.TangentialDisplacement(13.0, (planar[-1].value[0], 1e-12))]
    rows = hs.replay(hs.Ensemble(PAIR, height, RADIUS, 0.2), turned, record="all", hold=True)
    energies = rows.dissipated_energy.values
    assert_allclose(energies[-1], energies[-2], rtol=1e-3, atol=1e-6 * energies.max())


@mark.parametrize("name", GAPS)
def test_energies_of_ramps_are_those_of_half_as_many(name):
    """Two equal halves under twice the loads, of which one half has no clusters."""
    some = slice(0, 16_000)
    height, radius = GAPS[name][some].min() - GAPS[name][some], RADIUS[some]
    random = np.random.default_rng(8)
    half = hs.Ensemble(PAIR, height, radius, 0.2)
    load = half.advance(half.initial_state(), normal_displacement=0.6 * TOP).normal_load
    ends = random.uniform((0.0, -0.19), (2.0, 0.19), (12, 2)) * load
    ends[8] = 0.0

    def ramps(factor):
        return [
            event
            for time, (normal, share) in enumerate(factor * ends)
            for event in (
                hs.NormalLoad(time, float(normal)),
                hs.TangentialLoad(time, float(share * normal / (factor * load))),
            )
        ]

    whole = hs.Ensemble(PAIR, np.tile(height, 2), np.tile(radius, 2), 0.2)
    assert whole.initial_state().memory.line.far_energy
    assert not half.initial_state().memory.line.far_energy
    wanted, found = (
        hs.replay(contact, ramps(factor), record="all")
        for contact, factor in ((half, 1.0), (whole, 2.0))
    )
    energy = found.dissipated_energy.values
    largest = wanted.dissipated_energy.values.max()
    for side in (energy[:, :16_000], energy[:, 16_000:]):
        assert np.abs(side - wanted.dissipated_energy.values).max() < 1e-9 * largest
    total = found.total_dissipated_energy.values
    assert_allclose(energy.sum(axis=1), total, rtol=1e-11, atol=1e-11 * total[-1])
    assert_allclose(total, 2.0 * wanted.total_dissipated_energy, rtol=1e-9)
