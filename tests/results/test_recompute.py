"""One asperity at any step of a history: what it remembers is walked again, or comes from the log."""

import numpy as np
import xarray as xr
from golden import refused
from pytest import approx, fixture, mark

import historysim as hs
from historysim.log.event_log import EventLog
from historysim.log.result import RunOptions, write_result
from historysim.recording.provenance import named_states_attribute
from historysim.results import recompute

E, G, MU = 40e9, 8e9, 0.2
PAIR = hs.MaterialPair.from_moduli(contact_modulus=E, shear_modulus=G)
LOAD, RADIUS = 1e-3, 1e-5
RNG = np.random.default_rng(3)
MANY = hs.Ensemble(
    PAIR, RNG.normal(0, 1e-7, 40), RADIUS * RNG.uniform(0.5, 2, 40), MU * RNG.uniform(0.5, 2, 40)
)
EVENTS = [
    hs.NormalLoad(0.0, 5 * LOAD),
    hs.TangentialLoad(1.0, 0.6 * LOAD),
    hs.NormalLoad(2.0, 7 * LOAD),
    hs.TangentialLoad(2.0, -0.5 * LOAD),
    hs.TangentialLoad(3.0, 0.3 * LOAD),
    hs.NormalLoad(4.0, 6 * LOAD),
]
# What happens at one time is one step, which does not show that there was more.
AT_ONCE = [
    hs.NormalLoad(0.0, LOAD),
    hs.TangentialLoad(1.0, 0.19 * LOAD),
    hs.TangentialLoad(1.0, 0.0),
]


@mark.parametrize("substeps", [1, 7])
def test_recomputed_asperities_equal_those_of_the_engine(substeps):
    job = hs.Replay(MANY, EVENTS, substeps=substeps, hold=False)
    history = job.dataset()
    for step in (substeps, 2 * substeps, -1):
        state = job.state(until=float(history.time[step]))
        for label in history.asperity.values[::5].tolist():
            found, expected = recompute.asperity(history, label, step), MANY.asperity(label, state)
            assert found.index == label
            assert found.slip_state == expected.slip_state
            radius = np.linspace(0, expected.contact_radius, 20)
            np.testing.assert_allclose(
                found.traction(radius),
                expected.traction(radius),
                atol=1e-3 * MU * expected.pressure(0.0),
            )
            assert found.reversal_points.size == expected.reversal_points.size
            assert found.tangential_load == approx(
                expected.tangential_load, abs=1e-6 * expected.normal_load
            )


@fixture
def result(tmp_path):
    """A result of which the steps do not hold all, with its log beside it."""
    path = tmp_path / "r.nc"
    with EventLog.create(
        tmp_path / "r.history", hs.Ensemble(PAIR, 0.0, RADIUS, MU), AT_ONCE
    ) as log:
        log.append([hs.TangentialLoad(2.0, 0.01 * LOAD)])
        write_result(log._file, path, RunOptions())
    return path


@mark.parametrize("log", ["its own", "another", "none"])
def test_where_the_steps_do_not_suffice_the_log_is_replayed(result, log):
    if log == "another":
        with EventLog(result.with_suffix(".history")) as beside:
            beside.append([hs.TangentialLoad(3.0, 0.0)])
    if log == "none":
        result.with_suffix(".history").unlink()
    with xr.open_dataset(result, decode_times=False) as history:
        points = recompute.reversal_points(history, 0, 1)
        a = np.cbrt(3 * LOAD * RADIUS / (4 * E))
        assert points["radius"].values == approx([a * np.cbrt(0.05)], rel=1e-9)


def test_without_its_events_it_is_refused(result):
    with xr.open_dataset(result, decode_times=False) as history:
        alone = history.load()
    del alone.encoding["source"]
    with refused("leave out part of its load history"):
        recompute.asperity(alone, 0, -1)


CHANGE = [
    hs.NormalLoad(0.0, LOAD),
    hs.TangentialLoad(1.0, 0.1 * LOAD),
    hs.FrictionChange(2.0, 0.15),
]


@mark.parametrize("events", [AT_ONCE, CHANGE], ids=["at once", "a change of friction"])
def test_incomplete_steps_need_their_replay(events):
    history = hs.replay(hs.Ensemble(PAIR, 0.0, RADIUS, MU), events)
    found = recompute.asperity(history, 0, -1)
    assert found.tangential_load == approx(history["tangential_load"].values[-1, 0], rel=1e-12)
    history.encoding.clear()
    with refused("leave out part of its load history"):
        recompute.asperity(history, 0, -1)


def test_an_asperity_is_found_by_step_time_or_name():
    job = hs.Replay(MANY, EVENTS, substeps=3, hold=False)
    history = job.dataset().assign_attrs(named_states_attribute({"turned": 2.0}))
    label = int(history.asperity[0])
    expected = history.contact.asperity(label, 6)
    for how in ({"step": "turned"}, {"state": "turned"}, {"time": 2.0}, {"time": "2000 ms"}):
        assert repr(history.contact.asperity(label, **how)) == repr(expected)
    assert repr(history.contact.asperity(label)) == repr(history.contact.asperity(label, -1))
    between = history.contact.asperity(label, time=2.1)
    assert between.tangential_load == MANY.asperity(label, job.state(until=2.1)).tangential_load
    history.encoding.clear()
    for how, message in {
        "time=2.1": r"no step is recorded then.*such as 2 s \(step 6\) or 2.33333 s",
        "time=9": "time 9: the history has 0 s to 4 s",
        "step=1, time=2.0": "step and time are given; expected one of",
        "state='turn'": "step 'turn' is not a named state of the history; expected turned",
    }.items():
        with refused(message):
            history.contact.asperity(label, **eval(f"dict({how})"))  # noqa: S307 - written above


def test_an_asperity_of_several_may_be_moved_on_alone():
    """One that is replayed alone from the steps of its history."""
    history = hs.replay(MANY, EVENTS, substeps=3, hold=False)
    label = int(history.asperity[0])
    found = history.contact.asperity(label)
    onward = found.advance(tangential_displacement=found.state.tangential_displacement + 1e-9)
    assert onward.index == label
    assert onward.tangential_load > found.tangential_load
