"""The instants at which asperities first slide: closed forms, and the recorded rows of a thousand times finer steps."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import historysim as hs
from historysim.results import analysis, sliding_order

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
moments = st.lists(st.tuples(st.none() | normal, st.none() | tangential, st.none() | friction), min_size=2, max_size=6)


def first_rows(history):
    """The first row at which each asperity slides; -1 for never."""
    return analysis.first_slips(history)["slide_step"].values


def test_at_a_held_approach_each_slides_at_its_preliminary_displacement():
    events = [hs.NormalDisplacement(0.0, DEPTH), hs.TangentialDisplacement(2.0, 100e-9)]
    found = hs.replay(ENSEMBLE, events, record="all").contact.first_slips()
    expected = 2 * THETA * FRICTION * (HEIGHTS + DEPTH) / 100e-9
    assert found["slide_time"].values[:4] == pytest.approx(expected[:4], rel=1e-12)
    assert found["slide_rank"].values.tolist() == [*np.argsort(np.argsort(expected[:4])).tolist(), -1]
    assert np.isnan(found["slide_time"].values[4])
    assert found["slide_step"].values.tolist() == [1, 1, 1, 1, -1]
    assert found["slide_time"].attrs["instants"] == "exact"


def test_under_two_loads_the_last_slides_at_the_friction_limit():
    """Of two alike but for their heights the lower one slides where the load is Σ over both of Mindlin's T(U)."""
    heights, radius, load = np.array([0.0, -30e-9]), 10e-6, 2e-3
    ensemble = hs.Ensemble(PAIR, heights, radius, MU)
    events = [hs.NormalLoad(0.0, load), hs.TangentialLoad(1.0, MU * load)]
    found = hs.replay(ensemble, events).contact.first_slips()["slide_time"].values
    depth = ensemble.approach_at(load) + heights
    own = 4 / 3 * E * np.sqrt(radius) * depth**1.5
    high = MU * own[0] * (1 - (1 - depth[1] / depth[0]) ** 1.5)
    # the friction limit is met where the displacement is known to the power of 2/3 of rounding
    assert found == pytest.approx([1.0, (high + MU * own[1]) / (MU * load)], abs=1e-9)


def test_an_asperity_that_touches_while_the_contact_slides_does_so_at_once():
    events = [hs.NormalDisplacement(0.0, 10e-9), hs.TangentialDisplacement(1.0, 50e-9)]
    more = [hs.NormalDisplacement(1.0, 10e-9), hs.NormalDisplacement(2.0, 50e-9), hs.TangentialDisplacement(2.0, 90e-9)]
    times = hs.replay(ENSEMBLE, [*events, *more], record="all").contact.first_slips()["slide_time"].values
    assert times[1:3] == pytest.approx([1.25, 1.625], rel=1e-12)


def test_what_is_lifted_off_under_a_load_slides_before_and_what_was_not_strained_does_not():
    up = hs.NormalDisplacement(2.0, -1e-9)
    strained = [hs.NormalDisplacement(0.0, 50e-9), hs.TangentialDisplacement(1.0, 5e-9), up]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-5, MU), [*strained, hs.TangentialDisplacement(2.0, 5e-9)])
    assert (history.slip_state.values != GROSS).all()
    # δ falls from 50 nm by 51 nm in two seconds; it slides where θμδ is 5 nm
    assert history.contact.first_slips()["slide_time"].values == pytest.approx(2 * (50 - 5 / (THETA * MU)) / 51)
    bare = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-5, MU), [hs.NormalDisplacement(1.0, 50e-9), up])
    assert bare.contact.slides_first().size == 0


def test_a_fall_of_friction_makes_asperities_slide_at_its_time():
    events = [hs.NormalDisplacement(0.0, DEPTH), hs.TangentialDisplacement(1.0, 15e-9), hs.FrictionChange(1.5, 0.15)]
    times = hs.replay(ENSEMBLE, events, record="all").contact.first_slips()["slide_time"].values
    before = THETA * FRICTION * (HEIGHTS + DEPTH)
    after = THETA * 0.15 * (HEIGHTS + DEPTH)
    expected = np.where(before < 15e-9, before / 15e-9, np.where(after < 15e-9, 1.5, np.nan))
    expected[4] = np.nan
    np.testing.assert_allclose(times, expected, rtol=1e-12)


def test_after_a_fall_of_friction_the_slip_front_comes_to_the_middle_late():
    """Springs further out stick that touched later, when the one in the middle has met its limit."""
    events = [hs.NormalLoad(0.0, 0.01), hs.FrictionChange(0.0, 0.375), hs.TangentialLoad(1.0, 4e-3)]
    events += [hs.NormalDisplacement(2.0, 120e-9), hs.FrictionChange(2.0, 0.25), hs.NormalLoad(3.0, 0.01)]
    fine = hs.replay(ENSEMBLE, events, substeps=FINE, saturate=True, record="all")
    seen = fine.time.values[first_rows(fine)[:4]]
    found = sliding_order.slide_times(fine)[:4]
    assert ((found <= seen) & (found >= seen - 1 / FINE)).all()


@settings(max_examples=40, deadline=None)
@given(moments=moments, saturate=st.booleans(), alike=st.booleans(), stiffness=st.none() | st.floats(1e5, 1e7))
def test_each_instant_lies_between_the_fine_rows_where_it_begins(moments, saturate, alike, stiffness):
    """Rows that are 200 times finer bracket each instant, whatever is controlled; their own answer is the same."""
    events = [kind(float(time), value) for time, one in enumerate(moments) for kind, value in filter(None, one)]
    if not events:
        return
    ensemble = hs.Ensemble(PAIR, HEIGHTS, RADII, MU if alike else FRICTION)
    given = {"saturate": saturate, "record": "all"}
    if stiffness is not None:
        given["instrument"] = hs.Instrument(lateral_stiffness=stiffness)
    try:
        fine = hs.replay(ensemble, events, substeps=FINE, **given)
    except hs.LoadError:
        return
    found = sliding_order.slide_times(fine)
    coarse = sliding_order.slide_times(hs.replay(ensemble, events, **given))
    np.testing.assert_array_equal(found, coarse)
    time, states = fine.time.values, fine.slip_state.values
    # a load that is held at the limit may turn the contact round within a piece of a path
    slack = 1 / sliding_order.PIECES_HELD if saturate else 0.0
    for moment, seen, state in zip(found, first_rows(fine), states.T, strict=True):
        if np.isnan(moment):
            assert seen == -1
            continue
        row = np.searchsorted(time, moment * (1 - 1e-12))
        slides = state[row : row + 2 + round(FINE * slack)] == GROSS
        # it is lost again before the next row, or moved back by another event at the same time
        unseen = state[row] == SEPARATED or moment in {event.time for event in events}
        assert slides.any() or unseen
        if seen != -1:
            assert moment <= time[seen] + slack


def test_a_file_and_a_history_in_memory_say_the_same(tmp_path):
    scenario = tmp_path / "s.toml"
    scenario.write_text(
        '[materials]\nfirst = "silicon"\nsecond = "float glass"\n[friction]\ncoefficient = 0.2\n'
        '[surface]\nkind = "summits"\nheight = [0.0, "-20 nm"]\nradius = "10 µm"\n'
        '[[loading.waypoints]]\ntime = 0.0\nnormal_load = "5 mN"\n'
        '[[loading.waypoints]]\ntime = 1.0\ntangential_load = "1 mN"\n',
        encoding="utf-8",
    )
    memory = hs.run(scenario)
    with hs.run(scenario, tmp_path / "s.nc") as file:
        xr.testing.assert_equal(file.contact.first_slips(), memory.contact.first_slips())
        told = dict(file.contact.summary())["slides first"]
    first = memory.contact.first_slips()["slide_time"].values[1]
    assert told == f"asperity 1 at {first:.6g} s; asperity 0 last at 1 s"
    assert dict(hs.show(tmp_path / "s.nc"))["slides first"] == told


def test_where_the_instants_are_not_known_the_recorded_steps_answer():
    events = [hs.NormalDisplacement(0.0, DEPTH), hs.TangentialDisplacement(2.0, 100e-9)]
    history = hs.replay(ENSEMBLE, events, substeps=5, record="all")
    copied = xr.Dataset(history.data_vars, history.coords, history.attrs)
    worn = hs.Ensemble(PAIR, HEIGHTS, RADII, MU, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=6e9))
    for unknown in (copied, history.isel(step=slice(1, None)), hs.replay(worn, events, substeps=5)):
        assert sliding_order.slide_times(unknown) is None
        found = unknown.contact.first_slips()
        assert found["slide_time"].attrs["instants"] == "recorded step"
        xr.testing.assert_identical(found, analysis.first_slips(unknown))


def test_what_slides_after_the_end_of_a_part_is_left_out():
    events = [hs.NormalDisplacement(0.0, DEPTH), hs.TangentialDisplacement(2.0, 100e-9)]
    history = hs.replay(ENSEMBLE, events, substeps=10, record="all")
    times = history.contact.first_slips()["slide_time"].values
    part = history.isel(step=slice(0, 4)).contact.first_slips()["slide_time"].values
    np.testing.assert_array_equal(part, np.where(times <= history.time.values[3], times, np.nan))
    with pytest.raises(hs.InputError, match="no slip_state"):
        sliding_order.slide_times(hs.replay(ENSEMBLE, events, record="totals"))
