"""All groups on one path: each moves as it does alone, loses what it loses alone, and they share one displacement."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from pairs import UNIT as PAIR
from pytest import mark, raises

import historysim as hs
from historysim.basics.library import ffi, lib
from historysim.memory.binding import check, copy_state, drive, stack, take_ownership, view

SMALL = hs.MaterialPair.from_moduli(contact_modulus=5e10, shear_modulus=1e10)
DRIVE = drive(1e-6, (0.0, 0.0), False)


def replay(ensemble, approaches, kind, targets, stiffness=np.inf, record="totals"):
    events = []
    for time, (approach, target) in enumerate(zip(approaches, targets, strict=True)):
        events += [hs.NormalDisplacement(time, approach), kind(time, target)]
    return hs.replay(ensemble, events, record=record, instrument=hs.Instrument(stiffness))


def move(memory, *goals):
    check(
        lib.hs_step(memory, lib.HS_DISPLACED, goals[0], lib.HS_DISPLACED, goals[1], DRIVE, ffi.NULL)
    )


@mark.parametrize("seed", [0])
def test_groups_of_one_asperity_have_the_bits_of_each_alone(seed):
    """Groups of one asperity are moved by a shorter update than a group that is alone, which has the general one."""
    random = np.random.default_rng(seed)
    height, radius = random.uniform(-50e-9, 0.0, 20), random.uniform(1e-6, 2e-6, 20)
    friction = random.choice([0.0, 0.2, 0.3, 0.45], 20) + 1e-3 * np.arange(20)
    # without friction on the highest summit the contact is never scaled
    height[0], friction[0] = 0.0, 0.0
    memory = copy_state(hs.Ensemble(SMALL, height, radius, friction).initial_state().memory)
    line = memory.line
    assert line.contact.groups == 20
    alone = [take_ownership(lib.hs_state_of_one(memory, i)) for i in view(line.contact.order, 20)]
    approach, met = 40e-9, [0.0]
    ratio = line.contact.units.displacement / line.contact.units.length
    for _ in range(300):
        # held, grown, withdrawn, lifted off; loops within loops, the same places again, slides of
        # all, the limit
        before, approach = (
            approach,
            random.choice([approach] * 4 + [random.uniform(-5e-9, 60e-9), approach + 1e-10]),
        )
        ways = [random.uniform(-9e-9, 9e-9), random.uniform(-3e-8, 3e-8), met[-1] + 1e-16]
        ways += [
            met[-1] + sign * random.choice(friction) * (approach - before) * ratio
            for sign in (-1.0, 1.0)
        ]
        met.append(random.choice([*met[-4:], *ways]))
        move(memory, approach, met[-1])
        for group, one in enumerate(alone):
            move(one, approach, met[-1])
            assert stack(one).tobytes() == stack(memory, group).tobytes()
    lost = np.array([one.line.dissipated_each[0] for one in alone])
    assert np.count_nonzero(lost) >= 19
    # energies are worked out several at a time, by a reciprocal in place of a quotient
    assert_allclose(view(line.dissipated_each, 20), lost, rtol=1e-13)


@mark.parametrize("stiffness", [np.inf, 1.0])
@mark.parametrize("shared", [0.0, 0.3])
def test_replaying_a_computed_displacement_gives_the_load(shared, stiffness):
    """A path to a displacement asks for no search, and so for no fronts."""
    rng = np.random.default_rng(7)
    height = rng.uniform(-0.5, 0.0, 40)
    friction = np.where(rng.random(40) < shared, 0.3, rng.uniform(0.1, 0.5, 40))
    ensemble = hs.Ensemble(PAIR, height - height.max(), rng.uniform(0.5, 2.0, 40), friction)
    # one asperity alone, some of them, all; approached and withdrawn, held, and to where fronts
    # have been
    approaches = rng.choice([0.01, 0.3, 0.8, 0.8, 0.8, 1.0], 100)
    parts = rng.choice([-0.5, -0.2, 0.0, 0.3, 0.6, 1.0 - 1e-12], 100) + 1e-3 * rng.integers(
        -1, 1, 100
    )
    limits = replay(ensemble, approaches, hs.TangentialDisplacement, np.zeros(100)).friction_limit
    searched = replay(ensemble, approaches, hs.TangentialLoad, parts * limits.values)
    if np.isfinite(stiffness):
        drive = searched.tangential_displacement + searched.total_tangential_load / stiffness
        searched = replay(ensemble, approaches, hs.TangentialDisplacement, drive.values, stiffness)
    told = replay(
        ensemble, approaches, hs.TangentialDisplacement, searched.tangential_displacement.values
    )
    error = told.total_tangential_load - searched.total_tangential_load
    assert np.abs(error).max() < 1e-13 * limits.max()
    lost = told.total_dissipated_energy - searched.total_dissipated_energy
    assert np.abs(lost).max() < 1e-13 * searched.total_dissipated_energy[-1]


ROUGH = np.random.default_rng(5)
OWN = hs.Ensemble(
    SMALL,
    np.append(0.0, ROUGH.uniform(-50e-9, 0.0, 29)),
    ROUGH.uniform(1e-6, 2e-6, 30),
    ROUGH.uniform(0.05, 0.9, 30),
)


def own_events(seed, count=60):
    """Slides of all and loops within loops at constant approaches, most of which follow a slide of all."""
    random = np.random.default_rng(seed)
    events = [hs.NormalDisplacement(0.0, 40e-9)]
    for time in range(1, count):
        reach = 6e-8 if time % 10 == 9 else random.choice([3e-9, 3e-8])
        slide = hs.TangentialDisplacement(time, random.uniform(0.5, 1.0) * reach * (-1) ** time)
        press = hs.NormalDisplacement(time, random.uniform(20e-9, 60e-9))
        events.append(press if time % 10 == 0 else slide)
    return events


@mark.parametrize("seed", [0, 1])
def test_own_coefficients_at_constant_approach_are_those_of_each_alone(seed):
    """At a constant approach the contact is one group of friction 1, as each alone is not."""
    events = own_events(seed)
    found = hs.replay(OWN, events, record="all", hold=True)
    alone = [
        hs.replay(hs.Ensemble(SMALL, h, r, mu), lowered(events, -h), record="all", hold=True)
        for h, r, mu in zip(OWN.summit_height, OWN.summit_radius, OWN.friction, strict=True)
    ]
    # pressed without strain, slid, pressed while strained
    scaled = [
        bool(hs.Replay(OWN, events[:k], hold=True).state().memory.line.scaled) for k in (1, 2, 11)
    ]
    assert scaled == [True, True, False]
    for name in ("tangential_load", "stick_radius", "dissipated_energy", "normal_load"):
        wanted = np.stack([each[name].values[:, 0] for each in alone], axis=1)
        assert np.abs(found[name].values - wanted).max() < 1e-12 * np.abs(wanted).max(), name
    assert_array_equal(
        found.slip_state, np.stack([each.slip_state.values[:, 0] for each in alone], axis=1)
    )
    total = sum(each.total_tangential_load.values for each in alone)
    assert np.abs(found.total_tangential_load.values - total).max() < 1e-13 * np.abs(total).max()
    slid = np.array([each.slide_time.values[0] for each in alone])
    assert_allclose(found.slide_time, slid, rtol=1e-9)


def lowered(events, gap):
    return [
        hs.NormalDisplacement(event.time, event.value - gap)
        if isinstance(event, hs.NormalDisplacement)
        else event
        for event in events
    ]


@mark.filterwarnings("ignore:the stepper went back")
def test_a_scaled_contact_has_the_same_bits_however_it_is_read():
    """Recorded variables, readings, copies and bytes on the way change no bit later, nor does a refused step."""
    events = own_events(2, 30)
    whole = hs.Replay(OWN, events, record="totals", hold=True).state()
    assert hs.Replay(OWN, events, record="all", hold=True).state() == whole
    stepper, state = OWN.stepper(), OWN.initial_state()
    for event in events:
        name = "normal" if isinstance(event, hs.NormalDisplacement) else "tangential"
        goal = {f"{name}_displacement": event.value}
        with raises(hs.FrictionLimitError):
            stepper.step(normal_load=1e-3, tangential_load=2e-3)
        stepper.step(**goal)
        state = OWN.advance(hs.State.from_bytes(state.to_bytes(), OWN.initial_state()), **goal)
        state.vertices(3), OWN.asperity(2, state), OWN.with_friction(state, 0.3)
        state.stiffness(1), state.stored_energy, OWN.enter_plane(state)
        assert stepper.save() == state
    assert state == whole
    assert whole.memory.line.scaled


@mark.parametrize("change", ["friction", "plane", "geometry"])
def test_a_scaled_contact_goes_on_as_its_groups(change):
    """A change that needs the groups gives what it gives without a scaled contact, to rounding."""
    ends = []
    for least in (2e-12, 5e-13):  # the second is too small to be scaled, and neither carries a load
        coefficients = np.append(least, OWN.friction[1:])
        ensemble = hs.Ensemble(SMALL, OWN.summit_height, OWN.summit_radius, coefficients)
        events = [
            hs.NormalDisplacement(0.0, 40e-9),
            hs.TangentialDisplacement(1.0, 2e-8),
            hs.TangentialDisplacement(2.0, 1e-8),
        ]
        state = hs.Replay(ensemble, events).state()
        assert bool(state.memory.line.scaled) == (least > 1e-12)
        if change == "friction":
            state = ensemble.with_friction(state, np.append(0.0, 0.5 * coefficients[1:]))
        elif change == "plane":
            state = ensemble.advance(state, tangential_displacement=(1e-8, 5e-9))
        else:
            evolving = hs.Ensemble(
                SMALL, OWN.summit_height, OWN.summit_radius, coefficients, follow_sliding=True
            )
            later = hs.TangentialDisplacement(3.0, -1e-8)
            fresh = hs.GeometryChange(2.5, summit_height=-1e-8, asperities=(4,))
            state = hs.Replay(evolving, [*events, fresh, later], hold=False).state()
        ends.append(np.append(state.tangential_load, state.stored_energy / state.normal_load))
    assert_allclose(ends[0], ends[1], rtol=1e-11)
