"""Replaying from end to end."""

import numpy as np
import xarray as xr
from golden import refused
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark, raises

import historysim as hs
from historysim.recording.recorder import DatasetRecorder

HEIGHTS = [-0.03, 0.0, -0.5, -0.01, -0.04]
RADII = [1.0, 2.0, 1.0, 0.5, 1.5]
EVENTS = [
    hs.NormalLoad(0.0, 0.03),
    hs.TangentialLoad(0.0, 0.0),
    hs.TangentialLoad(1.0, 0.006),
    hs.NormalLoad(2.0, 0.02),
    hs.TangentialDisplacement(2.0, -0.01),
    hs.FrictionChange(2.5, [0.2, 0.3, 0.4, 0.5, 0.6]),
    hs.NormalDisplacement(3.0, 0.04),
    hs.TangentialDisplacement(3.0, 0.02),
]


@fixture
def ensemble():
    return hs.Ensemble(PAIR, HEIGHTS, RADII, 0.5)


# -- a replay is a value ---------------------------------------------------------------------------


def bits(history):
    return {name: history[name].values.tobytes() for name in history.variables}


def test_a_replay_gives_the_same_bits_as_often_as_it_is_asked(ensemble, tmp_path):
    job = hs.Replay(ensemble, EVENTS, substeps=3, record="all", hold=False)
    once = job.dataset()
    assert (
        bits(once)
        == bits(job.dataset())
        == bits(hs.replay(ensemble, EVENTS, substeps=3, record="all", hold=False))
    )
    job.write(tmp_path / "out.nc")
    with xr.open_dataset(tmp_path / "out.nc", decode_times=False) as written:
        assert bits(written) == bits(once)
        assert written.attrs == once.attrs
    with raises(AttributeError):
        job.substeps = 4


def test_a_replay_has_the_state_at_any_time(ensemble):
    job = hs.Replay(ensemble, EVENTS, hold=False)
    history = job.dataset()
    for step, time in enumerate(history.time.values.tolist()):
        state = job.state(until=time)
        assert state.normal_load == float(history.total_normal_load[step])
        assert state.tangential_displacement == float(history.tangential_displacement[step])
    assert job.state(until=-1.0).normal_load == 0.0
    assert job.state().dissipated_energy == float(history.total_dissipated_energy[-1])


def test_a_part_of_a_replay_ends_between_two_events(ensemble):
    job = hs.Replay(ensemble, EVENTS, substeps=2, hold=False)
    whole, part = job.dataset(), job.dataset(until=0.25)
    assert part.time.values.tolist() == [0.0, 0.25]
    assert (
        part.isel(step=0).normal_load.values.tobytes()
        == whole.isel(step=0).normal_load.values.tobytes()
    )


# -- events and what is recorded of them
# ------------------------------------------------------------


def test_totals_are_the_same_bits_whatever_is_recorded(ensemble):
    everything = hs.replay(ensemble, EVENTS, substeps=3, record="all", hold=False)
    for record in ("touching", "totals", [2], [0, 4]):
        history = hs.replay(ensemble, EVENTS, substeps=3, record=record, hold=False)
        totals = [name for name, values in everything.data_vars.items() if values.dims == ("step",)]
        assert len(totals) >= 9
        for name in totals:
            assert history[name].values.tobytes() == everything[name].values.tobytes(), name


def test_totals_alone_do_not_look_for_sliding_times():
    """On paths on which asperities evolve, the search costs many times the path; no total depends on it."""
    ensemble = hs.Ensemble(
        PAIR, HEIGHTS, RADII, 0.3, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=1.0)
    )
    events = [
        hs.NormalDisplacement(0.0, 0.06),
        hs.TangentialDisplacement(1.0, 0.03),
        hs.TangentialDisplacement(2.0, -0.03),
    ]
    everything, totals = (
        hs.Replay(ensemble, events, record=record) for record in ("all", "totals")
    )
    assert np.isfinite(everything.dataset().slide_time).any()
    recorder = totals.recorder(DatasetRecorder)
    assert np.isnan(ensemble.slide_time(totals.walk(recorder))).all()
    assert np.isfinite(ensemble.slide_time(totals.state())).any()
    alone, whole = totals.dataset(), everything.dataset()
    for name in ("total_tangential_load", "total_dissipated_energy"):
        assert alone[name].values.tobytes() == whole[name].values.tobytes()


# -- rows ------------------------------------------------------------------------------------------


@mark.parametrize("substeps", [0, -3, 1.5, "2", None, True])
def test_substeps_that_are_no_count_are_refused(ensemble, substeps):
    with refused(r"substeps is .*expected a whole number of 1 or more"):
        hs.replay(ensemble, EVENTS, substeps=substeps, hold=False)


# -- loads that cannot be carried ------------------------------------------------------------------


def long_history(last):
    return [
        hs.NormalLoad(0.0, 0.01),
        *(hs.TangentialLoad(time / 3, 0.001) for time in range(1, 37)),
        last,
    ]


def test_an_error_names_the_event(ensemble):
    with raises(hs.LoadError) as caught:
        hs.replay(ensemble, long_history(hs.TangentialLoad(12.5, 0.02)))
    message = str(caught.value)
    assert message.startswith(
        "event 37 at t = 12.5 s: a tangential load of 0.02 N is beyond the friction limit of 0.005 N"
    )
    assert "`saturate`" in message


@mark.parametrize(
    "events, named",
    [
        (
            [
                hs.NormalLoad(0.0, 0.01),
                hs.TangentialLoad(1.0, 0.004),
                hs.NormalLoad(1.0, 0.01),
                hs.NormalLoad(2.0, 0.001),
            ],
            3,
        ),
        ([hs.NormalLoad(0.0, 0.01), hs.TangentialLoad(1.0, 0.004), hs.FrictionChange(2.0, 0.1)], 2),
        (
            [
                hs.NormalLoad(0.0, 0.01),
                hs.TangentialLoad(2.0, 0.001),
                hs.TangentialLoad(2.0, 0.006),
            ],
            2,
        ),
        ([hs.TangentialLoad(2.0, 0.001)], 0),
        ([hs.FrictionChange(0.0, 0.2), hs.NormalLoad(0.0, 0.01), hs.TangentialLoad(2.0, 0.003)], 2),
    ],
)
@mark.parametrize("substeps", [1, 3])
def test_the_event_that_asks_too_much_is_the_one_that_is_named(ensemble, events, named, substeps):
    with raises(
        hs.LoadError, match=rf"^event {named} at t = 2 s: a tangential load of 0\.00\d N is beyond"
    ):
        hs.replay(ensemble, events, substeps=substeps)


@mark.parametrize("friction", [[0.1, 0.2], [0.1] * 6])
@mark.parametrize("saturate", [False, True])
def test_a_wrong_number_of_coefficients_names_the_event(ensemble, friction, saturate):
    events = [
        hs.NormalLoad(0.0, 0.01),
        hs.FrictionChange(12.5, friction),
        hs.NormalLoad(13.0, 0.02),
    ]
    with refused(r"^event 1 at t = 12\.5 s: friction .*expected one coefficient.* 5 asper"):
        hs.replay(ensemble, events, saturate=saturate, hold=False)


def test_saturate_holds_the_load_at_the_limit_and_says_so(ensemble):
    events = [
        hs.NormalLoad(0.0, 0.01),
        *(
            hs.TangentialLoad(time, load)
            for time, load in ((1.0, 0.002), (2.0, 0.02), (3.0, 0.0), (4.0, -1.0))
        ),
        hs.NormalLoad(4.0, 0.01),
        hs.NormalLoad(5.0, 0.02),
    ]
    history = hs.replay(ensemble, events, saturate=True)
    loads = [0.0, 0.002, 0.005, 0.0, -0.005, -0.01]
    assert history.total_tangential_load.values == approx(loads, rel=1e-12, abs=1e-17)
    assert history.saturated.values.tolist() == [0, 0, 1, 0, 1, 1]
    sliding = history.slip_state.isel(step=[2, 4, 5])
    assert set(np.unique(sliding)) <= {hs.SlipState.SEPARATED, hs.SlipState.GROSS_SLIP}
    assert (history.stick_radius.isel(step=[2, 4, 5]) == 0.0).all()
    assert (np.abs(history.total_tangential_load) <= history.friction_limit * (1 + 1e-12)).all()


def test_a_history_within_the_limit_is_the_same_with_saturate(ensemble):
    xr.testing.assert_identical(
        hs.replay(ensemble, EVENTS, saturate=True, hold=False),
        hs.replay(ensemble, EVENTS, hold=False),
    )


def test_saturate_holds_the_load_where_friction_falls_and_says_so(ensemble):
    events = [hs.NormalLoad(0.0, 0.01), hs.TangentialLoad(1.0, 0.004), hs.FrictionChange(2.0, 0.1)]
    history = hs.replay(ensemble, [*events, hs.NormalLoad(3.0, 0.01)], saturate=True)
    assert history.total_tangential_load.values == approx([0.0, 0.004, 0.001, 0.001], rel=1e-12)
    assert history.saturated.values.tolist() == [0, 0, 1, 1]


def test_every_row_of_a_path_that_starts_and_ends_at_the_limit_is_flagged(ensemble):
    events = [hs.NormalLoad(0.0, 0.01), hs.TangentialLoad(1.0, 0.02), hs.TangentialLoad(2.0, 0.03)]
    history = hs.replay(ensemble, events, substeps=4, saturate=True)
    assert history.total_tangential_load.values[4:] == approx([0.005] * 5, rel=1e-12)
    assert history.saturated.values[4:].tolist() == [1] * 5


# -- bad input -------------------------------------------------------------------------------------


def test_no_events_are_an_error(ensemble):
    for record in ("touching", "all", "totals", [0]):
        with refused(r"there are no load events; expected at least one"):
            hs.replay(ensemble, [], record=record)


@mark.parametrize("events", [None, 3, hs.NormalLoad(0.0, 0.01)], ids=repr)
def test_what_is_not_a_sequence_of_events_is_an_input_error(ensemble, events):
    with refused(r"expected .*events"):
        hs.replay(ensemble, events)


def test_decreasing_times_are_an_error_before_anything_is_replayed(ensemble):
    events = [hs.TangentialLoad(1.0, 99.0), hs.NormalLoad(0.5, 0.01)]
    with refused(r"^event 1 at t = 0\.5 s: comes after an event at t = 1 s"):
        hs.replay(ensemble, events)


def test_a_replay_says_what_it_is_and_not_each_event():
    events = [hs.NormalLoad(float(time), 1e-3) for time in range(1000)]
    text = repr(hs.Replay(hs.Ensemble(PAIR, 0.0, 1.0, 0.2), events))
    assert "events=1,000 events over 16.65 min" in text
    assert "NormalLoad" not in text
