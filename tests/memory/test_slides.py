"""The instants at which asperities first slide: closed forms, recorded rows of 200 times finer steps, and states."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, mark, raises

import historysim as hs

E, G, MU = 40e9, 8e9, 0.2
PAIR = hs.MaterialPair.from_moduli(contact_modulus=E, shear_modulus=G)
THETA = E / (4 * G)
HEIGHTS = np.array([0.0, -20e-9, -35e-9, -60e-9, -1e-6])
RADII = np.array([10e-6, 30e-6, 15e-6, 40e-6, 10e-6])
FRICTION = np.array([0.2, 0.12, 0.25, 0.2, 0.2])
DEPTH = 100e-9
ENSEMBLE = hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION)
GROSS, SEPARATED = 3, 0
FINE = 200

share = st.floats(-1, 1).map(lambda value: round(value, 3))
normal = st.one_of(
    share.map(lambda value: (hs.NormalLoad, 0.01 + 0.01 * value)),
    share.map(lambda value: (hs.NormalDisplacement, (50 + 70 * value) * 1e-9)),
)
tangential = st.one_of(
    share.map(lambda value: (hs.TangentialLoad, 4e-3 * value)),
    share.map(lambda value: (hs.TangentialDisplacement, 40e-9 * value)),
)
friction = st.floats(0.05, 0.4).map(lambda value: (hs.FrictionChange, round(value, 3)))
moments = st.lists(
    st.tuples(st.none() | normal, st.none() | tangential, st.none() | friction),
    min_size=2,
    max_size=6,
)


def first_rows(history):
    """The first row at which each asperity slides; -1 for never."""
    slides = history["slip_state"].values == GROSS
    return np.where(slides.any(axis=0), slides.argmax(axis=0), -1)


def test_at_a_held_approach_each_slides_at_its_preliminary_displacement():
    events = [hs.NormalDisplacement(0.0, DEPTH), hs.TangentialDisplacement(2.0, 100e-9)]
    found = hs.replay(ENSEMBLE, events, record="all").contact.slip_onset()
    expected = 2 * THETA * FRICTION * (HEIGHTS + DEPTH) / 100e-9
    assert found["slide_time"].values[:4] == approx(expected[:4], rel=1e-12)
    assert found["slide_rank"].values.tolist() == [
        *np.argsort(np.argsort(expected[:4])).tolist(),
        -1,
    ]
    assert np.isnan(found["slide_time"].values[4])
    assert found["slide_step"].values.tolist() == [1, 1, 1, 1, -1]


def test_an_asperity_that_touches_while_the_contact_slides_does_so_at_once():
    events = [hs.NormalDisplacement(0.0, 10e-9), hs.TangentialDisplacement(1.0, 50e-9)]
    more = [
        hs.NormalDisplacement(1.0, 10e-9),
        hs.NormalDisplacement(2.0, 50e-9),
        hs.TangentialDisplacement(2.0, 90e-9),
    ]
    times = (
        hs.replay(ENSEMBLE, [*events, *more], record="all")
        .contact.slip_onset()["slide_time"]
        .values
    )
    assert times[1:3] == approx([1.25, 1.625], rel=1e-12)


def test_a_loaded_asperity_slides_before_lift_off_and_an_unloaded_one_does_not():
    up = hs.NormalDisplacement(2.0, -1e-9)
    strained = [hs.NormalDisplacement(0.0, 50e-9), hs.TangentialDisplacement(1.0, 5e-9), up]
    history = hs.replay(
        hs.Ensemble(PAIR, 0.0, 1e-5, MU),
        [*strained, hs.TangentialDisplacement(2.0, 5e-9)],
        hold=False,
    )
    assert (history.slip_state.values != GROSS).all()
    # δ falls from 50 nm by 51 nm in two seconds; it slides where θμδ is 5 nm
    assert history.contact.slip_onset()["slide_time"].values == approx(
        2 * (50 - 5 / (THETA * MU)) / 51
    )
    bare = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-5, MU), [hs.NormalDisplacement(1.0, 50e-9), up])
    assert bare.contact.slides_first().size == 0


def test_a_fall_of_friction_makes_asperities_slide_at_its_time():
    events = [
        hs.NormalDisplacement(0.0, DEPTH),
        hs.TangentialDisplacement(1.0, 15e-9),
        hs.FrictionChange(1.5, 0.15),
    ]
    times = hs.replay(ENSEMBLE, events, record="all").contact.slip_onset()["slide_time"].values
    before = THETA * FRICTION * (HEIGHTS + DEPTH)
    after = THETA * 0.15 * (HEIGHTS + DEPTH)
    expected = np.where(before < 15e-9, before / 15e-9, np.where(after < 15e-9, 1.5, np.nan))
    expected[4] = np.nan
    assert_allclose(times, expected, rtol=1e-12)


@settings(deadline=None)
@given(
    moments=moments,
    saturate=st.booleans(),
    alike=st.booleans(),
    stiffness=st.none() | st.floats(1e5, 1e7),
)
def test_each_instant_lies_between_the_fine_rows_where_it_begins(
    moments, saturate, alike, stiffness
):
    """Rows that are 200 times finer bracket each instant, whatever is controlled; their own answer is the same."""
    events = [
        kind(float(time), value)
        for time, one in enumerate(moments)
        for kind, value in filter(None, one)
    ]
    if not events:
        return
    ensemble = hs.Ensemble(PAIR, HEIGHTS, RADII, MU if alike else FRICTION)
    given = {"saturate": saturate, "record": "all"}
    if stiffness is not None:
        given["instrument"] = hs.Instrument(lateral_stiffness=stiffness)
    try:
        # unlike hs.replay it does not warn where nothing touches
        fine = hs.Replay(ensemble, events, substeps=FINE, **given, hold=False).dataset()
    except hs.LoadError:
        return
    found = fine["slide_time"].values
    coarse = hs.Replay(ensemble, events, **given, hold=False).dataset()["slide_time"].values
    assert_allclose(found, coarse, rtol=0, atol=1e-6)
    time, states = fine.time.values, fine.slip_state.values
    for moment, seen, state in zip(found, first_rows(fine), states.T, strict=True):
        if np.isnan(moment):
            assert seen == -1
            continue
        row = np.searchsorted(time, moment * (1 - 1e-12))
        slides = state[row : row + 2] == GROSS
        # it is lost again before the next row, or moved back by another event at the same time
        unseen = (
            state[row] == SEPARATED
            or np.abs(moment - [event.time for event in events]).min() < 1e-9
        )
        assert slides.any() or unseen
        if seen != -1:
            assert moment <= time[seen] + 1e-9


EVOLVING = {
    "alike": ({}, MU),
    "one coefficient each": ({}, FRICTION),
    "law": ({}, hs.laws.PowerLaw(0.2, reference_load=3e-3, exponent=-0.2)),
    "wear": ({"wear": hs.wear.ArchardWear(coefficient=1e-3, hardness=6e9)}, MU),
    "yielding": ({"yielding": hs.yielding.Thornton(hardness=2e9, poissons_ratio=0.3)}, MU),
}
LOADED = [hs.NormalLoad(0.0, 8e-3), hs.NormalLoad(1.0, 10e-3), hs.TangentialLoad(1.0, 1.9e-3)]
DRIVEN = [
    hs.NormalDisplacement(0.0, 80e-9),
    hs.NormalDisplacement(1.0, DEPTH),
    hs.TangentialDisplacement(1.0, 40e-9),
]


@mark.parametrize("events", [LOADED, DRIVEN], ids=["loads", "displacements"])
@mark.parametrize("kind", EVOLVING)
def test_states_of_replays_that_end_just_before_and_after_agree(kind, events):
    more, friction = EVOLVING[kind]
    job = hs.Replay(
        hs.Ensemble(PAIR, HEIGHTS, RADII, friction, **more), events, saturate=True, record="all"
    )
    found = job.dataset()["slide_time"].values
    rows = first_rows(
        hs.Replay(job.ensemble, events, substeps=20, saturate=True, record="all").dataset()
    )
    assert (rows[:4] > 0).any()
    assert np.isnan(found[rows == -1]).all()
    accuracy = 1e-5 if job.ensemble.evolves else 1e-6
    for one in np.flatnonzero(rows > 0):
        assert (rows[one] - 1) / 20 - accuracy <= found[one] <= rows[one] / 20 + accuracy
        before, after = (
            job.ensemble.asperity(one, job.state(until=found[one] + shift)).slip_state
            for shift in (-accuracy, accuracy)
        )
        assert before != GROSS
        # at the end of the record no state follows
        assert after == GROSS or found[one] + accuracy > 1.0


def test_patches_slide_where_the_stick_zone_ends_at_their_first_touch():
    approach = np.linspace(10e-9, 100e-9, 10)
    depth = np.maximum(approach[:, None] + [0.0, -20e-9, -45e-9], 0.0)
    load = 4 / 3 * E * np.sqrt([1e-5, 3e-5, 2e-5]) * depth**1.5
    ensemble = hs.Patches.from_normal_curves(PAIR, approach, load, friction=MU)
    events = [
        hs.NormalDisplacement(0.0, 90e-9),
        hs.TangentialDisplacement(1.0, 1.1 * THETA * MU * 90e-9),
    ]
    history = hs.replay(ensemble, events, substeps=FINE)
    first = ensemble.first_touch
    assert history["slide_time"].values == approx((90e-9 - first) / (1.1 * 90e-9), rel=1e-12)
    seen = history.time.values[first_rows(history)]
    assert (
        (history["slide_time"].values <= seen) & (seen < history["slide_time"].values + 1 / FINE)
    ).all()
    ramp = [
        hs.NormalLoad(0.0, 0.01),
        hs.NormalLoad(1.0, 0.012),
        hs.TangentialLoad(1.0, 0.99 * MU * 0.012),
    ]
    history = hs.replay(ensemble, ramp, substeps=FINE)
    slid = ~np.isnan(history["slide_time"].values)
    seen = history.time.values[first_rows(history)]
    assert slid.sum() == 2
    assert (
        (seen - 1 / FINE < history["slide_time"].values) & (history["slide_time"].values <= seen)
    )[slid].all()


def test_a_change_of_friction_or_of_geometry_slides_at_its_time_and_a_state_keeps_it():
    events = [
        *LOADED[:1],
        hs.TangentialLoad(1.0, 1e-3),
        hs.GeometryChange(1.5, summit_height=-1e-7, asperities=(0,)),
    ]
    job = hs.Replay(
        ENSEMBLE, [*events, hs.NormalLoad(2.0, 9e-3)], saturate=True, record="all", hold=False
    )
    state = job.state(until=1.2)
    again = hs.State.from_bytes(state.to_bytes(), ENSEMBLE.initial_state())
    assert_array_equal(ENSEMBLE.slide_time(again), ENSEMBLE.slide_time(state))
    assert np.isfinite(job.dataset()["slide_time"].values).any()
    # by hand there are no times, and states are equal without them
    moved = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=8e-3)
    moved = ENSEMBLE.advance(moved, tangential_load=1e-3)
    assert moved == hs.Replay(ENSEMBLE, events[:2], record="all").state()
    assert np.isnan(ENSEMBLE.slide_time(moved)).all()


def test_queries_of_results_without_instants_are_refused():
    history = hs.replay(ENSEMBLE, DRIVEN).drop_vars("slide_time")
    for question in (history.contact.slides_first, history.contact.slip_onset):
        with raises(hs.InputError, match="no slide_time"):
            question()
    assert "first to slide" not in dict(history.contact.summary())


@mark.parametrize("substeps", [1, 2, 7])
@mark.parametrize("options", [{}, {"wear": hs.wear.ArchardWear(coefficient=1e-4, hardness=5e9)}])
def test_without_friction_an_asperity_slides_from_contact_on(options, substeps):
    """The definition is that of rows: all springs are at their friction limit, which is 0."""
    ensemble = hs.Ensemble(PAIR, HEIGHTS, RADII, [0.0, 0.0, 0.25, 0.2, 0.0], **options)
    events = [
        hs.NormalDisplacement(0.0, 10e-9),
        hs.NormalDisplacement(10.0, 30e-9),
        hs.TangentialDisplacement(11.0, 1e-10),
    ]
    history = hs.replay(ensemble, events, substeps=substeps)
    found = history["slide_time"].values
    assert found == approx([0.0, 5.0, np.nan, np.nan, np.nan][: found.size], nan_ok=True, abs=1e-9)
    rows = first_rows(history)
    assert rows[0] == 0
    assert rows[1] >= 0
    assert (rows[2:] == -1).all()
    times = history["time"].values
    assert times[rows[1] - 1] <= 5.0 <= times[rows[1]]
