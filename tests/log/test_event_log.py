"""`EventLog` against a plain replay of the same events in memory."""

import math
import sqlite3

import numpy as np
import xarray as xr
from golden import refused
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark, raises

import historysim as hs
from historysim.log import file as log_file
from historysim.log.result import add_snapshot, start_before
from historysim.recording.recorder import StateOnly

ENSEMBLE = hs.Ensemble(PAIR, [-0.03, 0.0, -0.5, -0.01, -0.04], [1.0, 2.0, 1.0, 0.5, 1.5], 0.5)
EVENTS = [
    hs.NormalLoad(0.0, 0.03),
    hs.TangentialLoad(0.0, 0.0),
    hs.TangentialLoad(1.0, 0.006),
    hs.NormalLoad(1.5, 0.025),
    hs.FrictionChange(2.0, [0.4, 0.45, 0.4, 0.5, 0.6]),
    hs.NormalLoad(2.5, 0.02),
    hs.TangentialDisplacement(3.0, -0.01),
    hs.NormalDisplacement(4.0, 0.04),
    hs.TangentialDisplacement(4.0, 0.02),
    hs.TangentialDisplacement(4.0, 0.01),
]


@fixture
def path(tmp_path):
    return tmp_path / "run.history"


def bits(state):
    """A state as bytes that are equal where every bit is."""
    return state.to_bytes()


def by_hand(ensemble, events, time, substeps=1, instrument=None):
    """The state at a time: all events are known, and the replay ends there."""
    return hs.Replay(
        ensemble, events, substeps=substeps, instrument=instrument or hs.Instrument(), hold=False
    ).state(until=time)


def snapshots_everywhere(log):
    """Put a snapshot at the current position of the schedule."""
    file = log._file
    content, head = file.sound(), file.head

    def keep(cursor, state):
        add_snapshot(file, content, cursor, state)

    job = head.replay(content.events)
    job.walk(job.recorder(StateOnly), most_rows=1, on_event=keep)


def test_a_log_replays_as_the_events_do(path):
    with hs.EventLog.create(path, ENSEMBLE, EVENTS[:4], substeps=3, hold=False) as log:
        log.append(EVENTS[4])
        log.append(EVENTS[5:])
        assert len(log) == len(EVENTS)
        assert log.events() == EVENTS
        assert log.events(2, 4) == EVENTS[2:4]
        xr.testing.assert_identical(
            log.replay(), hs.replay(ENSEMBLE, EVENTS, substeps=3, hold=False)
        )
        assert log.verify().whole
    with hs.EventLog(str(path)) as log:
        xr.testing.assert_identical(
            log.replay(record="all"),
            hs.replay(ENSEMBLE, EVENTS, substeps=3, record="all", hold=False),
        )
        assert log.settings["contact_modulus"] == 1.0
        assert log.verify().digest == log.digest


@mark.parametrize("until", [0.0, 1.5, 9.0])
def test_a_replay_until_an_event_has_the_rows_up_to_there_bit_for_bit(path, until):
    whole = hs.replay(ENSEMBLE, EVENTS, substeps=2, hold=False)
    with hs.EventLog.create(path, ENSEMBLE, EVENTS, substeps=2, hold=False) as log:
        part = log.replay(until=until)
    expected = whole.isel(step=slice(0, int((whole.time <= until).sum())))
    assert part.time.values.tolist() == expected.time.values.tolist()
    expected["slide_time"] = expected["slide_time"].where(expected["slide_time"] <= until)
    for name in part.data_vars:
        assert part[name].values.tobytes() == expected[name].values.tobytes(), name


def test_the_state_is_the_same_bits_from_any_snapshot(path):
    times = [*np.linspace(-0.5, 5.0, 23), *(event.time for event in EVENTS)]
    with hs.EventLog.create(path, ENSEMBLE, EVENTS, substeps=2, hold=False) as log:
        plain = [bits(log.state(at=time)) for time in times]
        assert plain == [bits(by_hand(ENSEMBLE, EVENTS, time, 2)) for time in times]
        snapshots_everywhere(log)
        told = []
        assert [bits(log.state(at=time, notify=told.append)) for time in times] == plain
        assert told == []
        content = log._file.sound()
        starts = [start_before(log._file, content, time).cursor for time in (0.5, 2.2, 99.0)]
        assert [start.time for start in starts] == [0.0, 2.0, 4.0]


def test_what_is_appended_may_say_how_a_channel_came_there(path):
    """The tangential channel is held at 1 s until a later waypoint draws a straight line to it."""
    first = [hs.NormalLoad(0.0, 0.03), hs.TangentialLoad(1.0, 0.004), hs.NormalLoad(2.0, 0.025)]
    with hs.EventLog.create(path, ENSEMBLE, first, hold=False) as log:
        snapshots_everywhere(log)
        assert log.state(at=2.0).tangential_load == approx(0.004)
        log.append(hs.TangentialLoad(3.0, 0.008))
        told = []
        state = log.state(at=2.0, notify=told.append)
        assert state.tangential_load == approx(0.006)
        assert bits(state) == bits(by_hand(ENSEMBLE, log.events(), 2.0))
        assert any("was made before events were appended" in line for line in told)
        log.append([hs.TangentialLoad(3.0, 0.007)])
        assert bits(log.state()) == bits(by_hand(ENSEMBLE, log.events(), math.inf))


def test_a_snapshot_of_another_version_is_passed_over(path, monkeypatch):
    with hs.EventLog.create(path, ENSEMBLE, EVENTS, hold=False) as log:
        monkeypatch.setattr("historysim.log.result.__version__", "0.0.9")
        snapshots_everywhere(log)
        monkeypatch.undo()
        told = []
        assert bits(log.state(notify=told.append)) == bits(by_hand(ENSEMBLE, EVENTS, math.inf))
        assert len(told) == 1
        assert "was made by historysim 0.0.9" in told[0]
        assert "passed over" in told[0]


# -- forks -----------------------------------------------------------------------------------------


@mark.parametrize("at", [0.0, 0.4, 1.25, 2.0, 2.7, 7.0])
def test_a_fork_has_the_same_past_and_another_future(path, tmp_path, at):
    with (
        hs.EventLog.create(path, ENSEMBLE, EVENTS, hold=False) as log,
        log.fork(at, tmp_path / "fork.history") as fork,
    ):
        past = [event for event in EVENTS if event.time <= at]
        assert fork.events()[: len(past)] == past
        assert {event.time for event in fork.events()[len(past) :]} <= {past[-1].time, at}
        fork.append([hs.NormalLoad(8.0, 0.01), hs.TangentialLoad(8.0, 0.002)])
        for time in (0.0, 0.3, 1.0, 1.2, 2.0, 2.6, 3.0, 4.0, 7.0):
            if time <= at:
                one, other = fork.state(at=time), log.state(at=time)
                for name in (
                    "normal_load",
                    "tangential_load",
                    "tangential_displacement",
                    "dissipated_energy",
                ):
                    assert getattr(one, name) == approx(
                        getattr(other, name), rel=1e-7, abs=1e-13
                    ), (time, name)
        assert fork.state().tangential_load == approx(0.002)
    with hs.EventLog(path) as log:
        assert log.events() == EVENTS


def test_a_fork_needs_a_past_and_a_name_of_its_own(path, tmp_path):
    with hs.EventLog.create(path, ENSEMBLE, EVENTS, hold=False) as log:
        with refused(r"has no event up to t = -1 s; .* at t = 0 s"):
            log.fork(-1.0, tmp_path / "fork.history")
        with refused("is the log itself"):
            log.fork(1.0, path)


def test_a_fork_of_a_damaged_log_has_what_is_sound(path, tmp_path, monkeypatch):
    monkeypatch.setattr(log_file, "MOST_EVENTS_OF_A_BATCH", 3)
    hs.EventLog.create(path, ENSEMBLE, EVENTS, hold=False).close()
    connection = sqlite3.connect(path)
    connection.execute("DROP TRIGGER no_update_of_batch")
    connection.execute("UPDATE batch SET value = zeroblob(24) WHERE number = 3")
    connection.commit()
    connection.close()
    told = []
    with hs.EventLog(path) as log:
        verdict = log.verify()
        assert (verdict.events, verdict.whole) == (6, False)
        with refused(r"those before, up to t = 2\.5 s, are sound: EventLog.fork"):
            log.replay()
        with refused(r"is sound up to t = 2\.5 s only"):
            log.fork(3.0, tmp_path / "fork.history", notify=told.append)
        with log.fork(2.0, tmp_path / "fork.history", notify=told.append) as fork:
            assert fork.events()[:5] == EVENTS[:5]
    assert "the 6 events before are sound" in told[0]


def test_times_that_are_none_are_refused(path):
    with hs.EventLog.create(path, ENSEMBLE, EVENTS, hold=False) as log:
        for wrong in (math.nan, "noon", None):
            with raises(hs.InputError):
                log.state(at=wrong)
        with refused(r"has no event up to t = -1 s"):
            log.replay(until=-1.0)


# -- a machine of random use -----------------------------------------------------------------------

LOADS = st.floats(0.001, 0.03)
MOVES = st.one_of(
    st.tuples(st.just(hs.NormalLoad), LOADS),
    st.tuples(st.just(hs.NormalDisplacement), st.floats(-0.01, 0.05)),
    st.tuples(st.just(hs.TangentialDisplacement), st.floats(-0.02, 0.02)),
    st.tuples(st.just(hs.FrictionChange), st.floats(0.2, 0.6)),
    st.tuples(st.just(hs.FrictionChange), st.lists(st.floats(0.2, 0.6), min_size=5, max_size=5)),
)


class Use(RuleBasedStateMachine):
    """Append, snapshot, crash, resume, fork and export in any order, against a list of the same events."""

    @initialize()
    def begin(self):
        import tempfile
        from pathlib import Path

        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / "log.history"
        self.output = Path(self.folder.name) / "out.nc"
        self.batch = log_file.MOST_EVENTS_OF_A_BATCH
        log_file.MOST_EVENTS_OF_A_BATCH = 3
        self.log = hs.EventLog.create(self.path, ENSEMBLE, substeps=2)
        self.events, self.forks = [], 0

    @rule(
        moves=st.lists(
            st.tuples(st.floats(0.0, 2.0).map(lambda step: round(step, 1)), MOVES),
            min_size=1,
            max_size=5,
        )
    )
    def append(self, moves):
        time, new = self.events[-1].time if self.events else 0.0, []
        for step, (kind, value) in moves:
            time += step
            new.append(kind(time, value))
        self.log.append(new)
        self.events += new

    @precondition(lambda self: self.events)
    @rule()
    def snapshot(self):
        snapshots_everywhere(self.log)

    @rule()
    def crash_and_resume(self):
        self.log.close()
        self.log = hs.EventLog(self.path)

    @precondition(lambda self: self.events)
    @rule(every=st.integers(1, 5))
    def export(self, every):
        self.log.close()
        with hs.run(self.path, self.output, resume=True, snapshot_every=every) as found:
            # unlike hs.replay it does not warn where nothing touches
            expected = hs.Replay(ENSEMBLE, self.events, substeps=2, hold=False).dataset()
            for name in expected.variables:
                assert found[name].values.tobytes() == expected[name].values.tobytes(), name
        self.log = hs.EventLog(self.path)

    @precondition(lambda self: self.events)
    @rule(share=st.floats(0.0, 1.1))
    def fork(self, share):
        first, last = self.events[0].time, self.events[-1].time
        at = first + share * (last - first)
        self.forks += 1
        path = self.path.with_name(f"fork{self.forks}.history")
        fork = self.log.fork(at, path)
        past = [event for event in self.events if event.time <= at]
        assert fork.events()[: len(past)] == past
        assert len(fork) - len(past) <= 4
        self.log.close()
        self.log, self.path, self.events = fork, path, fork.events()

    @invariant()
    def the_log_is_the_list(self):
        if not hasattr(self, "log"):
            return
        assert self.log.events() == self.events
        assert self.log.verify().whole
        if self.events:
            first, last = self.events[0].time, self.events[-1].time
            for time in (first, (first + last) / 2, last):
                assert bits(self.log.state(at=time)) == bits(
                    by_hand(ENSEMBLE, self.events, time, 2)
                )

    def teardown(self):
        if hasattr(self, "log"):
            self.log.close()
            log_file.MOST_EVENTS_OF_A_BATCH = self.batch
            self.folder.cleanup()


TestUse = Use.TestCase
TestUse.settings = settings(max_examples=5, stateful_step_count=12, deadline=None)


def test_a_log_has_a_repr_and_a_summary(path):
    with hs.EventLog.create(path, ENSEMBLE, [hs.NormalLoad(0.0, 0.03)]) as log:
        log.append(hs.TangentialLoad(2.0, 0.004))
        count = f"{len(ENSEMBLE)} {'asperity' if len(ENSEMBLE) == 1 else 'asperities'}"
        assert repr(log) == f"<EventLog {path}: 2 events over 2 s, {count}>"
        assert dict(log.summary())["events"] == "2 over 2 s"
    with hs.EventLog.create(path, ENSEMBLE) as log:
        assert repr(log) == f"<EventLog {path}: 0 events, {count}>"
