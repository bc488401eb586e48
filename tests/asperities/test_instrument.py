"""An instrument in series: its drive, the contact behind its spring, and rows of springs behind one."""

import copy
import math

import numpy as np
import pytest
import xarray as xr
from histories import Move, follow, histories, random_contact, random_moves, to_events
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from springs import SpringRow

import historysim as hs
from historysim.asperities.instrument import RIGID, Instrument
from historysim.contact import hertz, mindlin

EPS = np.finfo(float).eps

MODULI = {"contact_modulus": 2.0, "shear_modulus": 0.3}
PAIR = hs.MaterialPair.from_moduli(**MODULI)
THETA = 2.0 / (4 * 0.3)
MU, LOAD = 0.4, 0.01
LIMIT = MU * LOAD
SPHERE = hs.Ensemble(PAIR, summit_height=0.0, summit_radius=1.5, friction=MU)

# lateral stiffness over that of a contact, friction limit over displacement at which it slides: UNAT's is about 0.4
RATIOS = (1e-6, 0.4, 1e6)


def scattered(count, several=False, seed=0):
    """Asperities of unequal height and radius, with one coefficient or three."""
    rng = np.random.default_rng(seed)
    contact = random_contact(rng, count)._replace(**MODULI)
    friction = rng.choice([0.25, 0.4, 0.55], count) if several else contact.friction
    return contact._replace(friction=friction)


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


def drive_rounding(contact, normal_load, history, stiffness):
    """Rounding of the drive [m]: its own, and with several coefficients, where U is sought, that of U."""
    limit, slide = scales(contact, normal_load)
    farthest = np.abs(history.tangential_displacement.values).max() + slide
    sought = 4 * limit / slide * farthest / stiffness if np.ptp(contact.friction) > 0 else 0.0
    return 8 * EPS * (np.abs(history.drive_displacement.values).max() + sought)


def driven(*targets, instrument, state=None, ensemble=SPHERE):
    """State after paths to (normal load, drive displacement), one after the other."""
    state = ensemble.initial_state() if state is None else state
    for normal_load, displacement in targets:
        state = ensemble.advance(
            state, normal_load=normal_load, tangential_displacement=displacement, instrument=instrument
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
        return float(mindlin.tangential_displacement(load, **contact, shear_modulus=0.3)) + load / stiffness - drive

    return brentq(excess, -limit, limit, xtol=1e-300, rtol=4 * EPS)


# -- the instrument --------------------------------------------------------------------------------


def test_the_drive_moves_the_contact_and_bends_the_instrument():
    instrument = Instrument(lateral_stiffness=334e-3 / 1e-6)
    assert instrument.drive_displacement(20e-9, 10e-3) == pytest.approx(20e-9 + 10e-3 / 3.34e5, rel=2 * EPS)
    both = instrument.drive_displacement(np.array([0.0, 1e-9]), np.array([3.34e-3, 0.0]))
    assert both == pytest.approx([10e-9, 1e-9], rel=2 * EPS)
    assert not instrument.rigid
    assert Instrument().rigid
    assert Instrument() == RIGID
    assert Instrument().drive_displacement(20e-9, 10e-3) == 20e-9


@pytest.mark.parametrize("stiffness", [-3.0, math.nan, 1e-200, True, [3.0]], ids=repr)
def test_a_stiffness_that_is_none_is_refused(stiffness):
    with pytest.raises(hs.InputError, match=r"^Instrument: lateral_stiffness is .*; expected a number greater than 0"):
        Instrument(stiffness)


def test_an_invalid_instrument_is_refused():
    state, message = SPHERE.initial_state(), r"^instrument is 334000.0; expected an Instrument"
    with pytest.raises(hs.InputError, match=message):
        hs.replay(SPHERE, [hs.NormalLoad(0.0, LOAD)], instrument=3.34e5)
    with pytest.raises(hs.InputError, match=message):
        SPHERE.advance(state, normal_load=LOAD, instrument=3.34e5)
    for state_ in (state, SPHERE.advance(state, tangential_displacement=0.0)):
        with pytest.raises(hs.InputError, match=message):
            SPHERE.with_friction(state_, 0.2, instrument=3.34e5)


@pytest.mark.parametrize("several", [False, True])
def test_a_rigid_instrument_is_none_to_the_bit(several):
    for seed in range(2):
        contact = scattered(7, several, seed)
        moves = random_moves(np.random.default_rng(seed), contact, 0.14, friction_changes=True)
        events, ensemble = to_events(moves), ensemble_of(contact)
        bare = hs.replay(ensemble, events, record="all", substeps=2, saturate=True)
        rigid = hs.replay(ensemble, events, record="all", substeps=2, saturate=True, instrument=Instrument(math.inf))
        xr.testing.assert_identical(rigid, bare)
        assert "drive_displacement" not in bare
        assert "lateral_stiffness" not in bare.attrs


# -- one sphere, closed forms ----------------------------------------------------------------------


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("share", [1e-6, 0.1, -0.5, 0.9, 0.999])
def test_virgin_loading_is_cattaneo_mindlin_behind_a_spring(ratio, share):
    stiffness = ratio * LIMIT / SLIDE
    drive = share * (SLIDE + LIMIT / stiffness)
    state = driven((LOAD, drive), instrument=Instrument(stiffness), state=driven((LOAD, 0.0), instrument=RIGID))
    load = virgin_load(drive, stiffness)
    # near the limit the contact is soft, and the closed form loses what is missing to it
    assert state.tangential_load == pytest.approx(load, rel=1e-13)
    contact = mindlin.tangential_displacement(load, **sphere(), shear_modulus=0.3)
    assert state.tangential_displacement == pytest.approx(float(contact), rel=1e-11)
    stick = mindlin.stick_radius(load, **sphere())
    assert SPHERE.asperity(0, state).stick_radius == pytest.approx(float(stick), rel=1e-9)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("turn", [0.3, 0.9])
def test_unloading_is_the_closed_form_sheared_by_the_instrument(ratio, turn):
    instrument = Instrument(ratio * LIMIT / SLIDE)
    reversal = virgin_load(turn * (SLIDE + LIMIT / instrument.lateral_stiffness), instrument.lateral_stiffness)
    for load in np.linspace(0.95, -0.95, 7) * reversal:
        contact = float(
            mindlin.displacement_after_reversal(load, reversal_load=reversal, **sphere(), shear_modulus=0.3)
        )
        top = turn * (SLIDE + LIMIT / instrument.lateral_stiffness)
        drive = instrument.drive_displacement(contact, load)
        state = driven((LOAD, top), (LOAD, drive), instrument=instrument, state=driven((LOAD, 0.0), instrument=RIGID))
        assert state.tangential_load == pytest.approx(load, abs=1e-13 * LIMIT)
        assert state.tangential_displacement == pytest.approx(contact, abs=1e-13 * SLIDE)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("first", [(), ((LOAD, 0.0),)])
def test_beyond_the_limit_the_contact_slides_behind_the_bent_instrument(ratio, sign, first):
    instrument = Instrument(ratio * LIMIT / SLIDE)
    for times in (1.01, 3.0, 1e6):
        drive = sign * times * (SLIDE + LIMIT / instrument.lateral_stiffness)
        state = driven(*first, (LOAD, drive), instrument=instrument)
        assert state.tangential_load == pytest.approx(sign * LIMIT, rel=4 * EPS)
        bent = sign * LIMIT / instrument.lateral_stiffness
        assert state.tangential_displacement == pytest.approx(drive - bent, abs=4 * EPS * abs(drive))
        assert SPHERE.asperity(0, state).slip_state is hs.SlipState.GROSS_SLIP
        assert SPHERE.asperity(0, state).stick_radius == 0


@pytest.mark.parametrize("ratio", RATIOS)
def test_while_the_drive_is_held_the_contact_creeps_as_the_normal_load_falls(ratio):
    # the springs that still stick have never slipped, so that the state stays the virgin one at its normal load
    stiffness = ratio * LIMIT / SLIDE
    drive = 0.6 * (SLIDE + LIMIT / stiffness)
    normal = np.linspace(1.0, 0.05, 20) * LOAD
    events = [hs.NormalLoad(0.0, LOAD), hs.NormalLoad(1.0, LOAD), hs.TangentialDisplacement(1.0, drive)]
    events += [hs.NormalLoad(k + 2.0, value) for k, value in enumerate(normal[1:])]
    history = hs.replay(SPHERE, events, instrument=Instrument(stiffness)).isel(step=slice(1, None))
    sliding = history.slip_state.values[:, 0] == hs.SlipState.GROSS_SLIP
    loads = history.total_tangential_load.values
    for slides, load, held in zip(sliding, normal, loads, strict=True):
        expected = MU * load if slides else virgin_load(drive, stiffness, **sphere(load))
        assert held == pytest.approx(expected, rel=1e-12)
    assert np.all(np.diff(loads) < 0)
    assert np.all(np.diff(history.tangential_displacement.values) > 0)
    assert history.drive_displacement.values == pytest.approx(np.full(20, drive), rel=4 * EPS)
    assert np.all(np.diff(history.total_dissipated_energy.values) > 0)
    assert sliding[-1]
    assert not sliding[0]


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("lift", [{"normal_load": 0.0}, {"normal_displacement": -0.01}])
def test_lift_off_lets_the_instrument_spring_back(ratio, lift):
    instrument = Instrument(ratio * LIMIT / SLIDE)
    drive = 0.7 * (SLIDE + LIMIT / instrument.lateral_stiffness)
    state = driven((LOAD, 0.0), (LOAD, drive), instrument=instrument)
    lifted = SPHERE.advance(state, **lift, instrument=instrument)
    assert lifted.tangential_load == 0
    assert lifted.tangential_displacement == pytest.approx(drive, rel=4 * EPS)
    touched = SPHERE.advance(lifted, normal_load=LOAD, instrument=instrument)
    assert abs(touched.tangential_load) <= 1e-15 * LIMIT
    assert touched.tangential_displacement == pytest.approx(drive, rel=4 * EPS)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("share", [0.2, -0.9, 0.999, 1.001, -40.0])
def test_from_first_touch_on_the_way_all_springs_are_strained_alike_or_slide(ratio, share):
    # T = β N below friction slips nowhere: U = β θ δ
    stiffness = ratio * LIMIT / SLIDE
    drive = share * (SLIDE + LIMIT / stiffness)
    state = driven((LOAD, drive), instrument=Instrument(stiffness))
    held = min(max(share, -1.0), 1.0)
    assert state.tangential_load == pytest.approx(held * LIMIT, rel=1e-14)
    assert state.tangential_displacement == pytest.approx(drive - held * LIMIT / stiffness, abs=1e-14 * abs(drive))
    assert (state.dissipated_energy == 0) == (abs(share) < 1)


# -- the drive's history is the contact's, sheared -------------------------------------------------


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize(("count", "several"), [(1, False), (12, False), (12, True)])
def test_the_drives_history_is_the_contacts_sheared(count, several, ratio):
    contact = scattered(count, several, seed=count)
    ensemble, largest = ensemble_of(contact), 0.02 * count
    instrument, reach = instrument_for(contact, largest, ratio)
    rng = np.random.default_rng(3)
    drive = reach * rng.uniform(-1.2, 1.2, 60)
    normal = largest * np.where(np.arange(60) % 3, 0.6, rng.uniform(0.0, 1.0, 60))
    normal[40] = 0.0
    events = [
        event
        for time in range(60)
        for event in (hs.NormalLoad(time, normal[time]), hs.TangentialDisplacement(time, drive[time]))
    ]
    history = hs.replay(ensemble, events, record="all", instrument=instrument)
    rounding = drive_rounding(contact, largest, history, instrument.lateral_stiffness)
    assert history.drive_displacement.values == pytest.approx(drive, abs=rounding)
    solved = history.tangential_displacement.values
    replayed = [
        event
        for time in range(60)
        for event in (hs.NormalLoad(time, normal[time]), hs.TangentialDisplacement(time, solved[time]))
    ]
    bare = hs.replay(ensemble, replayed, record="all")
    limit, slide = scales(contact, largest)
    # the contact slides far behind a soft instrument, and U has no more digits than that leaves
    rounding = limit * (1e-13 + 16 * EPS * np.abs(solved).max() / slide)
    for name in ("total_tangential_load", "tangential_load"):
        assert history[name].values == pytest.approx(bare[name].values, abs=rounding), name
    way = slide + np.abs(np.diff(solved)).sum()
    for name in ("total_dissipated_energy", "dissipated_energy"):
        assert history[name].values == pytest.approx(bare[name].values, abs=rounding * way), name
    assert np.array_equal(history.separation.values, bare.separation.values)


@pytest.mark.parametrize("several", [False, True])
def test_a_mirrored_history_is_mirrored_bit_for_bit(several):
    contact = scattered(5, several)
    instrument, reach = instrument_for(contact, 0.1, 0.4)
    rng = np.random.default_rng(1)
    targets = list(zip(rng.uniform(0.0, 0.1, 20), rng.uniform(-reach, reach, 20), strict=True))
    ensemble = ensemble_of(contact)
    state = driven(*targets, instrument=instrument, ensemble=ensemble)
    mirrored = driven(*((load, -drive) for load, drive in targets), instrument=instrument, ensemble=ensemble)
    assert mirrored.tangential_load == -state.tangential_load
    assert mirrored.tangential_displacement == -state.tangential_displacement
    assert mirrored.dissipated_energy == state.dissipated_energy


# -- energy ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.05, 0.4, 5.0])
@pytest.mark.parametrize("several", [False, True])
def test_the_work_of_the_drive_is_stored_or_dissipated_and_the_instrument_keeps_none_of_it(several, ratio):
    contact = scattered(5, several)
    ensemble, normal_load = ensemble_of(contact), 0.1
    instrument, reach = instrument_for(contact, normal_load, ratio)
    limit, slide = scales(contact, normal_load)
    loop = [0.1, 0.5, -1.3, 0.2, -0.4, 0.7]
    path = reach * np.array([0.0, *loop, *loop])
    state = ensemble.advance(ensemble.initial_state(), normal_load=normal_load, instrument=instrument)
    events = [hs.NormalLoad(0.0, normal_load)]
    for time, drive in enumerate(path):
        events.append(hs.TangentialDisplacement(time, drive))
        state = ensemble.advance(state, tangential_displacement=drive, instrument=instrument)
    work = []
    for substeps in (1000, 2000):
        history = hs.replay(ensemble, events, substeps=substeps, record="totals", instrument=instrument)
        load, drive = history.total_tangential_load.values, history.drive_displacement.values
        parts = np.diff(drive) * (load[1:] + load[:-1]) / 2
        work.append(np.array([parts.sum(), parts[len(loop) * substeps :].sum()]))
    error = np.abs(work[1] - work[0]) + 1e-12 * limit * slide
    # all that was stored when the second loop began is stored again at its end
    spent = history.total_dissipated_energy.values
    bent = state.tangential_load**2 / (2 * instrument.lateral_stiffness)
    expected = [state.dissipated_energy + state.stored_energy + bent, spent[-1] - spent[len(loop) * substeps]]
    assert np.all(np.abs(work[1] - expected) <= error)
    assert np.all(error <= 1e-5 * work[1])


# -- rows of springs behind one spring -------------------------------------------------------------


class DrivenRow(SpringRow):
    """Springs behind one more: where a displacement is prescribed it is the drive's, and U is sought by bisection."""

    def __init__(self, *arguments, lateral_stiffness):
        super().__init__(*arguments)
        self.lateral_stiffness = lateral_stiffness
        self.drive = None

    def apply(self, normal, tangential, substeps=400):
        self.drive = None
        if tangential[0] == "load":
            # sub-steps matter on ramps of both loads alone
            super().apply(normal, tangential, substeps if normal[0] == "load" else 1)
            return
        self.drive = tangential[1]
        end = normal[1] if normal[0] == "displacement" else self._approach_at(normal[1])

        def excess(displacement):
            trial = copy.deepcopy(self)
            SpringRow.apply(trial, ("displacement", end), ("displacement", displacement), 1)
            return displacement + trial.total_tangential_load / self.lateral_stiffness - self.drive

        bent = 1.01 * self.contact.limit(max(end, 0.0)) / self.lateral_stiffness
        displacement = self.drive
        if bent > 0:
            displacement = brentq(excess, self.drive - bent, self.drive + bent, xtol=1e-15 * bent, rtol=4 * EPS)
        super().apply(("displacement", end), ("displacement", displacement), 1)

    def friction_change(self, friction, missing=None):
        if self.drive is not None:

            def missing(displacement, load):
                return displacement + load / self.lateral_stiffness - self.drive

        super().friction_change(friction, missing)


def rows_of(contact, moves, largest_load, stiffness, springs, substeps):
    """What rows of springs record after each distinct time: T, U and W."""
    row = DrivenRow(contact, contact.approach(largest_load) * (1 + 1e-12), springs, lateral_stiffness=stiffness)
    rows = [
        (now.total_tangential_load, now.tangential_displacement, now.dissipated_energy.sum())
        for now in follow(row, moves, substeps)
    ]
    return np.array(rows).T


def straight_paths(contact, moves):
    """With several coefficients a ramp of both loads bends: walk straight in (approach, U) instead."""
    if np.ptp(contact.friction) == 0:
        return moves
    return [
        move._replace(normal_kind="displacement", normal_value=float(contact.approach(move.normal_value)))
        if move.normal_kind == move.tangential_kind == "load"
        else move
        for move in moves
    ]


def assert_agrees_with_springs(contact, moves, largest_load, ratio, springs=200, substeps=40, loss=3):
    """T, U and W, within the error of the springs' grid and what other sub-steps change."""
    limit, slide = scales(contact, largest_load)
    instrument, reach = instrument_for(contact, largest_load, ratio)
    moves = [
        move._replace(tangential_value=move.tangential_value * reach / slide)
        if move.tangential_kind == "displacement"
        else move
        for move in straight_paths(contact, moves)
    ]
    stiffness = instrument.lateral_stiffness
    coarse, fine = (
        rows_of(contact, moves, largest_load, stiffness, springs, count) for count in (substeps, 3 * substeps + 1)
    )
    doubt = 2 * np.abs(coarse - fine).max(axis=1)
    load, displacement, energy = fine
    history = hs.replay(ensemble_of(contact), to_events(moves), record="totals", instrument=instrument)
    stronger = max([1.0, *(max(move.friction) / contact.friction.max() for move in moves if move.friction)])
    limit, slide = stronger * limit, stronger * slide
    grid = (3 if any(move.friction for move in moves) else 1) / springs**2 + 1e-6
    assert np.abs(history.total_tangential_load.values - load).max() <= grid * limit + doubt[0]
    # an error of the load moves the contact as far as it bends the instrument
    moved = 2 * grid * slide + grid * limit / stiffness
    assert np.abs(history.tangential_displacement.values - displacement).max() <= moved + doubt[1]
    spent = energy.max() + 0.01 * limit * (slide + limit / stiffness)
    assert np.abs(history.total_dissipated_energy.values - energy).max() <= loss * grid * spent + doubt[2]
    asked = [(row, move) for row, move in rows_at_arrival(moves) if move.tangential_kind == "displacement"]
    # the contact's displacement is sought to a rounding, which moves the drive as many times as far as it is stiffer
    farthest = np.abs(history.tangential_displacement.values).max() + slide
    rounding = 16 * EPS * reach * stronger + EPS * 4 * limit / slide * farthest / stiffness
    for row, move in asked:
        found = history.drive_displacement.values[row]
        assert found == pytest.approx(move.tangential_value, abs=rounding)


def rows_at_arrival(moves):
    """The rows that a history of `to_events` records of each move."""
    row = -1
    for move in moves:
        for _ in range(1 if move.friction is None else 2):
            row += 1
            yield row, move


@pytest.mark.parametrize("friction_changes", [False, True])
@pytest.mark.parametrize(("count", "several"), [(1, False), (8, False), (8, True)])
def test_random_histories_agree_with_rows_of_springs_behind_a_spring(count, several, friction_changes):
    for seed in range(2):
        contact = scattered(count, several, seed)
        rng = np.random.default_rng(seed)
        moves = random_moves(rng, contact, 0.02 * count, friction_changes=friction_changes)
        ratio = 10 ** rng.uniform(-1.5, 1.5)
        assert_agrees_with_springs(contact, moves, 0.02 * count, ratio)


THREE = scattered(3, several=True, seed=5)._replace(friction=np.array([0.25, 0.4, 0.55]))


# slid by many times what it can be strained, the contact's displacement is rounded by more than the drive
FAR = [
    Move("load", 0.0234375, "displacement", 0.041936162245268055, friction=(0.1875, 0.3373239811729815, 0.721875)),
    Move("displacement", 0.028044488826153586, "load", 0.0, friction=None),
]


@settings(max_examples=3, deadline=None)
@example(FAR, -1.4375)
@given(histories(THREE, 0.06, friction_changes=True), st.floats(-1.5, 1.5))
def test_drawn_histories_of_three_asperities_and_coefficients(moves, exponent):
    assert_agrees_with_springs(THREE, moves, 0.06, 10**exponent, loss=15)


@settings(max_examples=12, deadline=None)
@given(histories(THREE, 0.06, friction_changes=True), st.floats(-55, 59))
def test_the_drive_arrives_behind_any_instrument(moves, exponent):
    stiffness = 10**exponent
    limit, slide = scales(THREE, 0.06)
    moves = [
        move._replace(tangential_value=move.tangential_value * (1 + limit / slide / stiffness))
        if move.tangential_kind == "displacement"
        else move
        for move in moves
    ]
    history = hs.replay(
        ensemble_of(THREE), to_events(moves), record="all", saturate=True, instrument=Instrument(stiffness)
    )
    numbers = history.drop_vars("slide_time").variables.values()
    assert all(np.isfinite(values.values.astype(float)).all() for values in numbers)
    assert np.all(np.diff(history.total_dissipated_energy.values) >= 0)
    assert np.all(np.abs(history.total_tangential_load) <= history.friction_limit * (1 + 1e-12))
    rounding = drive_rounding(THREE, 0.06, history, stiffness)
    for row, move in rows_at_arrival(moves):
        if move.tangential_kind == "displacement":
            found = history.drive_displacement.values[row]
            assert found == pytest.approx(move.tangential_value, abs=rounding)


# -- several coefficients --------------------------------------------------------------------------


def test_ramps_of_both_loads_do_not_feel_the_instrument_and_drives_start_where_they_end():
    contact = scattered(6, several=True)
    ensemble = ensemble_of(contact)
    instrument, reach = instrument_for(contact, 0.12, 0.4)
    limit, _ = scales(contact, 0.12)
    events = [hs.NormalLoad(0.0, 0.12), hs.TangentialLoad(1.0, 0.5 * limit), hs.NormalLoad(1.0, 0.09)]
    bare = hs.replay(ensemble, events, substeps=3)
    behind = hs.replay(ensemble, events, substeps=3, instrument=instrument)
    xr.testing.assert_equal(behind.drop_vars("drive_displacement"), bare)
    halfway = [*events, hs.NormalLoad(2.0, 0.09), hs.TangentialDisplacement(3.0, reach)]
    history = hs.replay(ensemble, halfway, instrument=instrument, hold=False)
    start = behind.drive_displacement.values[-1]
    assert history.drive_displacement.values[-2:] == pytest.approx([(start + reach) / 2, reach], rel=1e-14)


# -- changes of friction ---------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("factor", [0.9, 0.6, 0.2])
def test_where_friction_falls_the_contact_slips_on_and_the_drive_stays(ratio, factor):
    stiffness = ratio * LIMIT / SLIDE
    drive = 0.8 * (SLIDE + LIMIT / stiffness)
    instrument = Instrument(stiffness)
    events = [hs.NormalLoad(0.0, LOAD), hs.TangentialDisplacement(1.0, drive), hs.FrictionChange(2.0, factor * MU)]
    history = hs.replay(SPHERE, events, instrument=instrument)
    slides = history.slip_state.values[-1, 0] == hs.SlipState.GROSS_SLIP
    weaker = sphere(friction=factor * MU)
    expected = factor * LIMIT if slides else virgin_load(drive, stiffness, **weaker)
    assert history.total_tangential_load.values[-1] == pytest.approx(expected, rel=1e-12)
    assert history.drive_displacement.values[1:] == pytest.approx([drive, drive], rel=4 * EPS)
    assert np.diff(history.tangential_displacement.values)[-1] > 0
    assert np.diff(history.total_dissipated_energy.values)[-1] > 0


# -- paths and steps -------------------------------------------------------------------------------


@pytest.mark.parametrize("several", [False, True])
def test_substeps_are_rows_on_the_straight_path_of_the_contact(several):
    contact = scattered(6, several)
    ensemble = ensemble_of(contact)
    instrument, reach = instrument_for(contact, 0.12, 0.4)
    events = [hs.NormalDisplacement(0.0, contact.approach(0.12)), hs.TangentialDisplacement(0.0, 0.0)]
    for time, (normal_load, drive) in enumerate([(0.12, 0.8), (0.05, 0.3), (0.1, -0.9), (0.1, 2.0)]):
        approach = float(contact.approach(normal_load))
        events += [hs.NormalDisplacement(time + 1.0, approach), hs.TangentialDisplacement(time + 1.0, drive * reach)]
    coarse = hs.replay(ensemble, events, instrument=instrument)
    fine = hs.replay(ensemble, events, substeps=5, instrument=instrument)
    for name in ("total_tangential_load", "tangential_displacement", "drive_displacement", "total_dissipated_energy"):
        expected = coarse[name].values
        found = fine[name].values[::5]
        assert found == pytest.approx(expected, abs=1e-12 * np.abs(expected).max()), name
    for name in ("separation", "tangential_displacement"):
        expected = np.interp(fine.time.values, coarse.time.values, coarse[name].values)
        assert fine[name].values == pytest.approx(expected, abs=1e-13 * reach), name
    between = np.interp(fine.time.values, coarse.time.values, coarse.drive_displacement.values)
    assert np.abs(fine.drive_displacement.values - between).max() > 1e-3 * reach


# -- a spring in parallel ---------------------------------------------------------------------------

ROUGH = hs.Ensemble(
    hs.MaterialPair(hs.material("silicon"), hs.material("float glass")),
    np.random.default_rng(0).normal(0.0, 60e-9, 40),
    20e-6,
    friction=0.2,
)


@pytest.mark.parametrize("series", [np.inf, 3e5])
def test_a_controlled_load_agrees_with_contact_and_parallel_spring(series):
    """The drive displacement at which both add up to the load is found without knowing the one solved for."""
    beside, alone = hs.Instrument(series, parallel_stiffness=2e5), hs.Instrument(series)
    pressed = ROUGH.advance(ROUGH.initial_state(), normal_load=0.05)
    state = reference = pressed
    # beyond the friction limit of 10 mN, too
    for load in (8e-3, -3e-3, 30e-3, -40e-3, 5e-3):
        state = ROUGH.advance(state, tangential_load=load, instrument=beside)

        def excess(drive, before=reference, load=load):
            after = ROUGH.advance(before, tangential_displacement=drive, instrument=alone)
            return after.tangential_load + 2e5 * drive - load

        drive = brentq(excess, -1e-6, 1e-6, xtol=1e-20, rtol=1e-14)
        reference = ROUGH.advance(reference, tangential_displacement=drive, instrument=alone)
        assert state.tangential_load == pytest.approx(reference.tangential_load, rel=1e-12, abs=1e-15)
        assert beside.drive_load(state.tangential_displacement, state.tangential_load) == pytest.approx(load, rel=1e-12)
    # a load that is not named is held, whatever the normal load and friction do
    for held in (
        ROUGH.advance(state, normal_load=0.03, instrument=beside),
        ROUGH.with_friction(state, 0.01, instrument=beside),
    ):
        assert beside.drive_load(held.tangential_displacement, held.tangential_load) == pytest.approx(5e-3, rel=1e-12)
    stepper = ROUGH.stepper(pressed, instrument=beside)
    for load in (8e-3, -3e-3):
        stepper.step(tangential_load=load)
    twice = ROUGH.advance(pressed, tangential_load=8e-3, instrument=beside)
    assert stepper.tangential_load == ROUGH.advance(twice, tangential_load=-3e-3, instrument=beside).tangential_load


def test_a_parallel_spring_does_not_change_a_driven_contact(tmp_path):
    events = [hs.NormalLoad(0, 0.05), hs.TangentialDisplacement(1, 5e-8), hs.TangentialDisplacement(2, -5e-8)]
    beside = hs.Instrument(3e5, parallel_stiffness=2e5)
    alone, both = (hs.replay(ROUGH, events, substeps=5, instrument=each) for each in (hs.Instrument(3e5), beside))
    assert np.array_equal(alone.total_tangential_load, both.total_tangential_load)
    np.testing.assert_allclose(both.drive_load, both.total_tangential_load + 2e5 * both.drive_displacement, rtol=1e-15)
    assert "drive_load" not in alone
    assert both.attrs["parallel_stiffness"] == 2e5
    pushed = [hs.NormalLoad(0, 0.05), hs.TangentialLoad(1, 30e-3), hs.TangentialLoad(2, -8e-3)]
    job = hs.Replay(ROUGH, pushed, instrument=beside)
    assert float(job.dataset().drive_load[-1]) == pytest.approx(-8e-3, rel=1e-12)
    with hs.EventLog.create(tmp_path / "a.history", ROUGH, instrument=beside) as log:
        log.append(pushed)
        assert log.instrument == beside
        assert np.array_equal(log.replay().total_tangential_load, job.dataset().total_tangential_load)
    with pytest.raises(hs.InputError, match="parallel_stiffness, which a unit of co-simulation does not have"):
        hs.write_fmu(job, tmp_path / "a.fmu")


def test_in_two_directions_the_spring_acts_in_both():
    pushed = [hs.NormalLoad(0, 0.05), hs.TangentialLoad(1, (8e-3, 0.0)), hs.TangentialLoad(2, (-8e-3, 30e-3))]
    history = hs.replay(ROUGH, pushed, instrument=hs.Instrument(3e5, parallel_stiffness=2e5))
    np.testing.assert_allclose(history.drive_load[1:], [(8e-3, 0.0), (-8e-3, 30e-3)], atol=1e-14)


@pytest.mark.parametrize("value", [-1.0, np.inf, np.nan, 1e-80])
def test_what_is_no_parallel_stiffness_is_refused(value):
    with pytest.raises(hs.InputError, match="parallel_stiffness"):
        hs.Instrument(parallel_stiffness=value)
