"""An instrument in series: its drive, the contact behind its spring, and rows of springs behind one."""

import math

import numpy as np
import xarray as xr
from golden import check_messages, refused
from histories import histories, random_contact
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, mark
from scipy.optimize import brentq

import historysim as hs
from historysim.asperities.instrument import RIGID, Instrument
from historysim.contact import hertz, mindlin

EPS = np.finfo(float).eps

MODULI = {"contact_modulus": 2.0, "shear_modulus": 0.3}
PAIR = hs.MaterialPair.from_moduli(**MODULI)
MU, LOAD = 0.4, 0.01
LIMIT = MU * LOAD
SPHERE = hs.Ensemble(PAIR, summit_height=0.0, summit_radius=1.5, friction=MU)

# lateral stiffness over that of a contact, friction limit over displacement at which it slides:
# UNAT's is about 0.4
RATIOS = (1e-6, 0.4, 1e6)


def scattered(count):
    """Asperities of unequal height and radius, with three coefficients."""
    rng = np.random.default_rng(0)
    return random_contact(rng, count)._replace(
        **MODULI, friction=rng.choice([0.25, 0.4, 0.55], count)
    )


def ensemble_of(contact):
    return hs.Ensemble(PAIR, contact.summit_height, contact.summit_radius, contact.friction)


def scales(contact, normal_load):
    """Friction limit [N], and displacement at which the last asperity slides [m]."""
    approach = contact.approach(normal_load)
    return contact.limit(approach), contact.compliance_ratio * contact.friction.max() * approach


def instrument_for(contact, normal_load, ratio):
    """An instrument, and the drive's displacement at which the contact slides [m]."""
    limit, slide = scales(contact, normal_load)
    stiffness = ratio * limit / slide
    return Instrument(stiffness), slide + limit / stiffness


def driven(*targets, instrument, state=None, ensemble=SPHERE):
    """State after paths to (normal load, drive displacement), one after the other."""
    state = ensemble.initial_state() if state is None else state
    for normal_load, displacement in targets:
        state = ensemble.advance(
            state,
            normal_load=normal_load,
            tangential_displacement=displacement,
            instrument=instrument,
        )
    return state


def sphere(normal_load=LOAD, friction=MU):
    """Arguments of the closed forms for the sphere."""
    depth = hertz.approach(normal_load, summit_radius=1.5, contact_modulus=2.0)
    radius = hertz.contact_radius(depth, summit_radius=1.5)
    return {"normal_load": normal_load, "contact_radius": radius, "friction": friction}


SLIDE = float(mindlin.preliminary_displacement(**sphere(), shear_modulus=0.3))


def virgin_load(drive, stiffness, **contact):
    """Tangential load of the virgin sphere behind a spring: Cattaneo and Mindlin, solved for T."""
    contact = contact or sphere()
    limit = contact["friction"] * contact["normal_load"]

    def excess(load):
        return (
            float(mindlin.tangential_displacement(load, **contact, shear_modulus=0.3))
            + load / stiffness
            - drive
        )

    return brentq(excess, -limit, limit, xtol=1e-300, rtol=4 * EPS)


# -- the instrument --------------------------------------------------------------------------------


def test_an_invalid_instrument_is_refused():
    state, message = SPHERE.initial_state(), r"^instrument is 334000.0; expected an Instrument"
    for state_ in (state, SPHERE.advance(state, tangential_displacement=0.0)):
        with refused(message):
            SPHERE.with_friction(state_, 0.2, instrument=3.34e5)


@given(histories())
def test_a_rigid_instrument_is_none_to_the_bit(drawn):
    bare, rigid = (
        drawn.replay(saturate=True, instrument=each) for each in (RIGID, Instrument(math.inf))
    )
    xr.testing.assert_identical(rigid, bare)
    assert "drive_displacement" not in bare
    assert "lateral_stiffness" not in bare.attrs


# -- one sphere, closed forms ----------------------------------------------------------------------


@mark.parametrize("ratio", RATIOS)
@mark.parametrize("share", [1e-6, 0.1, -0.5, 0.9, 0.999])
def test_virgin_loading_is_cattaneo_mindlin_behind_a_spring(ratio, share):
    stiffness = ratio * LIMIT / SLIDE
    drive = share * (SLIDE + LIMIT / stiffness)
    state = driven(
        (LOAD, drive), instrument=Instrument(stiffness), state=driven((LOAD, 0.0), instrument=RIGID)
    )
    load = virgin_load(drive, stiffness)
    # near the limit the contact is soft, and the closed form loses what is missing to it
    assert state.tangential_load == approx(load, rel=1e-13)
    contact = mindlin.tangential_displacement(load, **sphere(), shear_modulus=0.3)
    assert state.tangential_displacement == approx(float(contact), rel=1e-11)
    stick = mindlin.stick_radius(load, **sphere())
    assert SPHERE.asperity(0, state).stick_radius == approx(float(stick), rel=1e-9)


@mark.parametrize("ratio", RATIOS)
@mark.parametrize("sign", [1, -1])
@mark.parametrize("first", [(), ((LOAD, 0.0),)])
def test_beyond_the_limit_the_contact_slides_behind_the_bent_instrument(ratio, sign, first):
    instrument = Instrument(ratio * LIMIT / SLIDE)
    for times in (1.01, 3.0, 1e6):
        drive = sign * times * (SLIDE + LIMIT / instrument.lateral_stiffness)
        state = driven(*first, (LOAD, drive), instrument=instrument)
        assert state.tangential_load == approx(sign * LIMIT, rel=4 * EPS)
        bent = sign * LIMIT / instrument.lateral_stiffness
        assert state.tangential_displacement == approx(drive - bent, abs=4 * EPS * abs(drive))
        assert SPHERE.asperity(0, state).slip_state is hs.SlipState.GROSS_SLIP
        assert SPHERE.asperity(0, state).stick_radius == 0


@mark.parametrize("ratio", RATIOS)
def test_while_the_drive_is_held_the_contact_creeps_as_the_normal_load_falls(ratio):
    # the springs that still stick have never slipped, so that the state stays the virgin one at its
    # normal load
    stiffness = ratio * LIMIT / SLIDE
    drive = 0.6 * (SLIDE + LIMIT / stiffness)
    normal = np.linspace(1.0, 0.05, 20) * LOAD
    events = [
        hs.NormalLoad(0.0, LOAD),
        hs.NormalLoad(1.0, LOAD),
        hs.TangentialDisplacement(1.0, drive),
    ]
    events += [hs.NormalLoad(k + 2.0, value) for k, value in enumerate(normal[1:])]
    history = hs.replay(SPHERE, events, instrument=Instrument(stiffness)).isel(step=slice(1, None))
    sliding = history.slip_state.values[:, 0] == hs.SlipState.GROSS_SLIP
    loads = history.total_tangential_load.values
    for slides, load, held in zip(sliding, normal, loads, strict=True):
        expected = MU * load if slides else virgin_load(drive, stiffness, **sphere(load))
        assert held == approx(expected, rel=1e-12)
    assert np.all(np.diff(loads) < 0)
    assert np.all(np.diff(history.tangential_displacement.values) > 0)
    assert history.drive_displacement.values == approx(np.full(20, drive), rel=4 * EPS)
    assert np.all(np.diff(history.total_dissipated_energy.values) > 0)
    assert sliding[-1]
    assert not sliding[0]


@mark.parametrize("ratio", RATIOS)
@mark.parametrize("lift", [{"normal_load": 0.0}, {"normal_displacement": -0.01}])
def test_lift_off_lets_the_instrument_spring_back(ratio, lift):
    instrument = Instrument(ratio * LIMIT / SLIDE)
    drive = 0.7 * (SLIDE + LIMIT / instrument.lateral_stiffness)
    state = driven((LOAD, 0.0), (LOAD, drive), instrument=instrument)
    lifted = SPHERE.advance(state, **lift, instrument=instrument)
    assert lifted.tangential_load == 0
    assert lifted.tangential_displacement == approx(drive, rel=4 * EPS)
    touched = SPHERE.advance(lifted, normal_load=LOAD, instrument=instrument)
    assert abs(touched.tangential_load) <= 1e-15 * LIMIT
    assert touched.tangential_displacement == approx(drive, rel=4 * EPS)


# -- the drive's history is the contact's, sheared -------------------------------------------------


@given(histories(steep=[False], compliance=True))
def test_the_drives_history_is_the_contacts_sheared(drawn):
    drawn = drawn.straight()
    history = drawn.replay()
    solved = history.tangential_displacement.values
    moves = [
        move._replace(tangential_kind="displacement", tangential_value=float(place))
        for move, place in zip(drawn.moves, solved, strict=True)
    ]
    bare = drawn._replace(moves=moves, stiffness=math.inf).replay()
    # the contact slides far behind a soft instrument, and U has no more digits than that leaves
    rounding = drawn.limit * (1e-13 + 16 * EPS * np.abs(solved).max() / drawn.slide)
    way = drawn.slide + np.abs(np.diff(solved)).sum()
    for name in (
        "total_tangential_load",
        "tangential_load",
        "total_dissipated_energy",
        "dissipated_energy",
    ):
        tolerance = rounding * (way if "energy" in name else 1.0)
        assert history[name].values == approx(bare[name].values, abs=tolerance), name
    assert np.array_equal(history.separation.values, bare.separation.values)


# -- rows of springs behind one spring -------------------------------------------------------------


@given(histories(compliance=True, extremes=True), st.floats(-55, 59))
def test_the_drive_arrives_behind_any_instrument(drawn, exponent):
    ratio, stiffness = drawn.limit / drawn.slide, 10**exponent
    drawn = drawn.behind(stiffness)
    history = drawn.replay(saturate=True)
    numbers = history.drop_vars("slide_time").variables.values()
    assert all(np.isfinite(values.values.astype(float)).all() for values in numbers)
    # rounding of a displacement that rests under a load
    lost = np.diff(history.total_dissipated_energy.values)
    assert np.all(lost >= -(np.finfo(float).eps ** 2) * drawn.limit * drawn.slide)
    assert np.all(np.abs(history.total_tangential_load) <= history.friction_limit * (1 + 1e-12))
    # U is sought to a rounding, which moves the drive as many times as far as the contact is
    # stiffer
    farthest = np.abs(history.tangential_displacement.values).max() + drawn.slide
    rounding = (
        8
        * EPS
        * (np.abs(history.drive_displacement.values).max() + 4 * ratio * farthest / stiffness)
    )
    rows = iter(history.drive_displacement.values)
    for move in drawn.moves:
        for found in [next(rows) for _ in range(1 if move.friction is None else 2)]:
            if move.tangential_kind == "displacement":
                assert found == approx(move.tangential_value, abs=rounding)


# -- several coefficients --------------------------------------------------------------------------


def test_ramps_of_both_loads_do_not_feel_the_instrument_and_drives_start_where_they_end():
    contact = scattered(6)
    ensemble = ensemble_of(contact)
    instrument, reach = instrument_for(contact, 0.12, 0.4)
    limit, _ = scales(contact, 0.12)
    events = [
        hs.NormalLoad(0.0, 0.12),
        hs.TangentialLoad(1.0, 0.5 * limit),
        hs.NormalLoad(1.0, 0.09),
    ]
    bare = hs.replay(ensemble, events, substeps=3)
    behind = hs.replay(ensemble, events, substeps=3, instrument=instrument)
    xr.testing.assert_equal(behind.drop_vars("drive_displacement"), bare)
    halfway = [*events, hs.NormalLoad(2.0, 0.09), hs.TangentialDisplacement(3.0, reach)]
    history = hs.replay(ensemble, halfway, instrument=instrument, hold=False)
    start = behind.drive_displacement.values[-1]
    assert history.drive_displacement.values[-2:] == approx([(start + reach) / 2, reach], rel=1e-14)


# -- a spring in parallel
# ---------------------------------------------------------------------------

ROUGH = hs.Ensemble(
    hs.MaterialPair(hs.material("silicon"), hs.material("float glass")),
    np.random.default_rng(0).normal(0.0, 60e-9, 40),
    20e-6,
    friction=0.2,
)


@mark.parametrize("series", [np.inf, 3e5])
def test_a_controlled_load_agrees_with_contact_and_parallel_spring(series):
    """The drive displacement at which both add up to the load is found without knowing the one solved for."""
    parallel, alone = hs.Instrument(series, parallel_stiffness=2e5), hs.Instrument(series)
    pressed = ROUGH.advance(ROUGH.initial_state(), normal_load=0.05)
    state = reference = pressed
    # beyond the friction limit of 10 mN, too
    for load in (8e-3, -3e-3, 30e-3, -40e-3, 5e-3):
        state = ROUGH.advance(state, tangential_load=load, instrument=parallel)

        def excess(drive, before=reference, load=load):
            after = ROUGH.advance(before, tangential_displacement=drive, instrument=alone)
            return after.tangential_load + 2e5 * drive - load

        drive = brentq(excess, -1e-6, 1e-6, xtol=1e-20, rtol=1e-14)
        reference = ROUGH.advance(reference, tangential_displacement=drive, instrument=alone)
        assert state.tangential_load == approx(reference.tangential_load, rel=1e-12, abs=1e-15)
        assert parallel.drive_load(state.tangential_displacement, state.tangential_load) == approx(
            load, rel=1e-12
        )
    # a load that is not named is held, whatever the normal load and friction do
    for held in (
        ROUGH.advance(state, normal_load=0.03, instrument=parallel),
        ROUGH.with_friction(state, 0.01, instrument=parallel),
    ):
        assert parallel.drive_load(held.tangential_displacement, held.tangential_load) == approx(
            5e-3, rel=1e-12
        )
    stepper = ROUGH.stepper(pressed, instrument=parallel)
    for load in (8e-3, -3e-3):
        stepper.step(tangential_load=load)
    twice = ROUGH.advance(pressed, tangential_load=8e-3, instrument=parallel)
    assert (
        stepper.tangential_load
        == ROUGH.advance(twice, tangential_load=-3e-3, instrument=parallel).tangential_load
    )


def test_a_parallel_spring_does_not_change_a_driven_contact(tmp_path):
    events = [
        hs.NormalLoad(0, 0.05),
        hs.TangentialDisplacement(1, 5e-8),
        hs.TangentialDisplacement(2, -5e-8),
    ]
    parallel = hs.Instrument(3e5, parallel_stiffness=2e5)
    alone, both = (
        hs.replay(ROUGH, events, substeps=5, instrument=each)
        for each in (hs.Instrument(3e5), parallel)
    )
    assert np.array_equal(alone.total_tangential_load, both.total_tangential_load)
    np.testing.assert_allclose(
        both.drive_load, both.total_tangential_load + 2e5 * both.drive_displacement, rtol=1e-15
    )
    assert "drive_load" not in alone
    assert both.attrs["parallel_stiffness"] == 2e5
    pushed = [hs.NormalLoad(0, 0.05), hs.TangentialLoad(1, 30e-3), hs.TangentialLoad(2, -8e-3)]
    job = hs.Replay(ROUGH, pushed, instrument=parallel)
    assert float(job.dataset().drive_load[-1]) == approx(-8e-3, rel=1e-12)
    with hs.EventLog.create(tmp_path / "a.history", ROUGH, instrument=parallel) as log:
        log.append(pushed)
        assert log.instrument == parallel
        assert np.array_equal(
            log.replay().total_tangential_load, job.dataset().total_tangential_load
        )
    with refused("parallel_stiffness, which a unit of co-simulation does not have"):
        hs.write_fmu(job, tmp_path / "a.fmu")


def test_in_two_directions_the_spring_acts_in_both():
    pushed = [
        hs.NormalLoad(0, 0.05),
        hs.TangentialLoad(1, (8e-3, 0.0)),
        hs.TangentialLoad(2, (-8e-3, 30e-3)),
    ]
    history = hs.replay(ROUGH, pushed, instrument=hs.Instrument(3e5, parallel_stiffness=2e5))
    np.testing.assert_allclose(history.drive_load[1:], [(8e-3, 0.0), (-8e-3, 30e-3)], atol=1e-14)


def test_messages():
    check_messages(globals())
