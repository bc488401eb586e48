"""From waypoints to paths and rows: the semantics of the loads, on paper and in replays."""

import itertools
from typing import NamedTuple

import numpy as np
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark, warns

import historysim as hs
from historysim.loads import schedule
from historysim.loads.events import FrictionChange, LoadEvent
from historysim.loads.forking import fork_waypoints
from historysim.loads.schedule import (
    AT_WAYPOINT,
    BEYOND_LAST,
    make_cursor,
    row_count,
)
from historysim.memory.binding import DISPLACED, LOAD
from historysim.memory.paths import blank_rows

HELD = (0.0, 0.0)

N, D = hs.NormalLoad, hs.NormalDisplacement
T, U = hs.TangentialLoad, hs.TangentialDisplacement
F = hs.FrictionChange


class Path(NamedTuple):
    normal: tuple
    tangential: tuple
    parts: int = 1
    recorded: bool = True


def read(segment):
    paths = segment.paths
    assert len(paths) == len(segment.event)
    return [
        Path(
            *(
                tuple(
                    np.ravel(path[f"{channel}_{name}"])[0].item()
                    for name in ("control", "target", "fraction")
                )
                for channel in ("normal", "tangential")
            ),
            int(path["parts"]),
            bool(path["recorded"]),
        )
        for path in paths
    ]


def single(events, **options):
    found = list(schedule.paths(events, **options))
    assert len(found) == 1
    assert (found[0].change, found[0].change_event) == (None, -1)
    return found[0]


@fixture
def ensemble():
    return hs.Ensemble(PAIR, [0.0, -0.01, -0.03], [1.0, 2.0, 0.5], 0.5)


def observed(history):
    names = ("total_normal_load", "separation", "total_tangential_load", "tangential_displacement")
    return np.array([history[name].values for name in (*names, "total_dissipated_energy")])


def by_hand(ensemble, states):
    rows = [
        (
            state.normal_load,
            ensemble.highest_summit - state.approach,
            state.tangential_load,
            state.tangential_displacement,
            state.dissipated_energy,
        )
        for state in states
    ]
    return np.array(rows).T


def check_replay(ensemble, events, moves, **options):
    """Compare a replay with moves of `advance`: a list for each row, of the moves up to it."""
    state, states = ensemble.initial_state(), []
    for row in moves:
        for move in row:
            state = ensemble.advance(state, **move)
        states.append(state)
    found = observed(hs.replay(ensemble, events, **options, hold=False))
    assert found == approx(by_hand(ensemble, states), rel=1e-12, abs=1e-15)


# -- joint paths and waypoints ---------------------------------------------------------------------


@mark.parametrize("events", [[N(3.0, 0.01), T(3.0, 0.002)], [T(3.0, 0.002), N(3.0, 0.01)]])
def test_events_of_both_channels_at_one_time_are_one_joint_path(events, ensemble):
    segment = single(events)
    assert read(segment) == [Path((LOAD, 0.01, 1.0), (LOAD, 0.002, 1.0))]
    assert segment.row_time.tolist() == [3.0]
    check_replay(ensemble, events, [[{"normal_load": 0.01, "tangential_load": 0.002}]])


def test_two_events_of_one_channel_at_one_time_are_two_paths_in_file_order(ensemble):
    events = [N(0.0, 0.01), U(0.0, 0.0), U(1.0, 0.02), U(1.0, -0.01)]
    segment = single(events)
    assert read(segment)[1:] == [
        Path((LOAD, 0.01, 1.0), (DISPLACED, 0.02, 1.0), recorded=False),
        Path((LOAD, *HELD), (DISPLACED, -0.01, 1.0)),
    ]
    assert segment.event == [1, 2, 3]
    assert segment.row_time.tolist() == [0.0, 1.0]
    start, there, back = (
        {"normal_load": 0.01},
        {"tangential_displacement": 0.02},
        {"tangential_displacement": -0.01},
    )
    check_replay(ensemble, events, [[start, {"tangential_displacement": 0.0}], [there, back]])
    turned = [*events[:2], events[3], events[2]]
    check_replay(ensemble, turned, [[start, {"tangential_displacement": 0.0}], [back, there]])
    assert not np.array_equal(
        observed(hs.replay(ensemble, events)), observed(hs.replay(ensemble, turned))
    )


def test_a_channel_is_unloaded_before_its_first_event(ensemble):
    events = [U(-1.0, 0.5), N(0.0, 0.0), N(1.0, 0.01), T(3.0, 0.002)]
    found = read(single(events[1:]))
    assert [path.tangential for path in found] == [(LOAD, *HELD), (LOAD, *HELD), (LOAD, 0.002, 1.0)]
    history = hs.replay(ensemble, events[1:], substeps=4)
    loads = history.total_tangential_load.values
    assert loads[: 1 + 4].tolist() == [0.0] * 5
    assert loads[5:] == approx([0.0005, 0.001, 0.0015, 0.002], rel=1e-12)
    assert read(single(events[:1]))[0].normal == (LOAD, *HELD)
    with warns(UserWarning, match="nothing ever touches"):
        before = hs.replay(ensemble, events[:1], record="totals")
    assert before.total_normal_load.values.tolist() == [0.0]
    assert before.contact_count.values.tolist() == [0]


# -- rows ------------------------------------------------------------------------------------------


@mark.parametrize("substeps", [1, 3])
def test_there_is_one_row_per_distinct_time_and_the_rest_of_the_substeps_between(substeps):
    events = [
        N(1.0, 0.01),
        T(1.0, 0.0),
        N(1.0, 0.02),
        T(2.0, 0.001),
        F(2.0, 0.4),
        T(2.0, 0.002),
        N(10.0, 0.03),
    ]
    found = list(schedule.paths(events, substeps))
    times = [
        1.0,
        *np.linspace(1.0, 2.0, substeps + 1)[1:],
        *np.linspace(2.0, 10.0, substeps + 1)[1:],
    ]
    assert np.concatenate([segment.row_time for segment in found]) == approx(times, rel=1e-15)
    for segment in found:
        rows = [
            segment.paths["first_row"][index] + row
            for index, path in enumerate(read(segment))
            for row in range(path.parts - 1 + path.recorded)
        ]
        assert rows == list(range(segment.row_time.size))


# -- changes of friction ---------------------------------------------------------------------------


def test_a_change_of_friction_ends_a_stretch():
    events = [N(0.0, 0.02), T(1.0, 0.002), F(1.0, 0.3), T(2.0, 0.004), F(3.0, [0.2, 0.3, 0.4])]
    found = list(schedule.paths(events))
    assert [segment.change for segment in found] == [events[2], events[4], None]
    assert [segment.change_event for segment in found] == [2, 4, -1]
    assert [segment.row_time.tolist() for segment in found] == [[0.0], [1.0, 2.0], [3.0]]
    arrival = Path((LOAD, 0.02, 1.0), (LOAD, 0.002, 1.0), recorded=False)
    assert read(found[0])[-1] == arrival
    assert read(found[1])[0] == Path((LOAD, *HELD), (LOAD, *HELD))


# -- long and random histories ---------------------------------------------------------------------


def random_events(generator, count=25):
    """Waypoints at coinciding times, with kinds that switch, loads within the limit, and changes of friction."""
    events = []
    for time in np.sort(generator.integers(0, count // 2, count)).astype(float):
        kind = generator.choice([N, D, T, U, F], p=[0.3, 0.15, 0.2, 0.3, 0.05])
        low, high = {
            N: (0.02, 0.04),
            D: (0.06, 0.1),
            T: (-0.001, 0.001),
            U: (-0.004, 0.004),
            F: (0.3, 0.5),
        }[kind]
        events.append(kind(time, generator.uniform(low, high)))
    return [N(-1.0, 0.03), U(-1.0, 0.0), *events]


class Reference:
    """Waypoints as the design has them, channel by channel."""

    def __init__(self, events, channel):
        self.names = {
            N: "normal_load",
            D: "normal_displacement",
            T: "tangential_load",
            U: "tangential_displacement",
        }
        self.waypoints = [
            event for event in events if isinstance(event, LoadEvent) and event.channel == channel
        ]
        self.passed = 0
        self.begin = None

    def reached(self, state, event):
        kind = type(event)
        return {
            N: state.normal_load,
            D: state.approach,
            T: state.tangential_load,
            U: state.tangential_displacement,
        }[kind]

    def at(self, time, state):
        """Where the channel is when it arrives at a time."""
        if self.passed == len(self.waypoints):
            return {self.names[type(self.waypoints[-1])]: self.waypoints[-1].value}
        event, before = self.waypoints[self.passed], self.waypoints[self.passed - 1]
        if event.time == time:
            return self.jump()
        if self.begin is None:
            self.begin = self.reached(state, event)
        share = (time - before.time) / (event.time - before.time)
        return {self.names[type(event)]: self.begin + share * (event.value - self.begin)}

    def jump(self):
        event = self.waypoints[self.passed]
        self.passed += 1
        self.begin = None
        return {self.names[type(event)]: event.value}


def reference_states(ensemble, events):
    channels = {name: Reference(events, name) for name in ("normal", "tangential")}
    state = ensemble.initial_state()
    for time, group in itertools.groupby(events, key=lambda event: event.time):
        present = list(group)
        targets = {}
        for name, channel in channels.items():
            first = next(
                (event for event in present if getattr(event, "channel", None) == name), None
            )
            targets |= channel.at(time, state)
            present = [event for event in present if event is not first]
        state = ensemble.advance(state, **targets)
        for event in present:
            if isinstance(event, FrictionChange):
                state = ensemble.advance(state, friction=event.friction)
            else:
                state = ensemble.advance(state, **channels[event.channel].jump())
        yield state


def one_at_a_time(events):
    """Leave out what would join two further events at one time into one path."""
    kept = []
    for _, group in itertools.groupby(events, key=lambda event: event.time):
        further = {"normal": 0, "tangential": 0}
        for event in group:
            if isinstance(event, LoadEvent):
                other = "tangential" if event.channel == "normal" else "normal"
                if further[event.channel] and further[other] > 1:
                    continue
                further[event.channel] += 1
            kept.append(event)
    return kept


@mark.parametrize("seed", range(4))
def test_random_waypoints_are_replayed_as_they_read(ensemble, seed):
    events = one_at_a_time(random_events(np.random.default_rng(seed)))
    expected = by_hand(ensemble, reference_states(ensemble, events))
    found = observed(hs.replay(ensemble, events, hold=False))
    assert found == approx(expected, rel=1e-9, abs=1e-13)


def test_breaking_stretches_changes_no_bit(ensemble):
    events = random_events(np.random.default_rng(4), 60)
    ends = []
    for most_rows in (None, 1, 4):
        state, totals = ensemble.initial_state(), []
        for segment in schedule.paths(events, 2, most_rows):
            rows = blank_rows(segment.row_time.size, None)
            state = ensemble.advance_along(state, segment.paths, rows=rows)
            if segment.change is not None:
                state = ensemble.with_friction(state, segment.change.friction)
            totals.append(rows.totals)
        ends.append([np.concatenate(totals).tobytes(), state.to_bytes()])
    assert ends[0] == ends[1] == ends[2]


def test_stretches_break_between_times_however_often_friction_changes():
    events = [hs.NormalLoad(0.0, 0.01)]
    for time in range(1, 60):
        events += [
            hs.TangentialLoad(time, 1e-4 * (time % 3)),
            hs.FrictionChange(time, 0.5 + 0.001 * (time % 2)),
        ]
    plan = list(schedule.paths(events, 2, 10))
    stood = [segment.cursor for segment in plan if segment.cursor]
    assert len(stood) > 10
    assert max(b.rows - a.rows for a, b in itertools.pairwise(stood)) < 10 + 2
    assert [make_cursor(events, cursor.events, 2) for cursor in stood] == stood


def test_a_schedule_is_taken_up_where_it_stood():
    events = [
        hs.NormalLoad(0.0, 0.03),
        hs.TangentialLoad(0.5, 0.001),
        hs.FrictionChange(1.0, 0.4),
        hs.NormalLoad(1.0, 0.02),
        hs.NormalLoad(1.5, 0.025),
        hs.NormalDisplacement(2.0, 0.02),
        hs.TangentialDisplacement(3.0, 0.01),
        hs.NormalLoad(4.0, 0.01),
    ]
    plan = list(schedule.paths(events, 3, 1))
    rows = []
    for number, segment in enumerate(plan):
        rows.append(segment.row_time.tolist())
        if segment.cursor:
            again = list(schedule.paths(events, 3, 1, start=segment.cursor))
            assert [one.row_time.tolist() for one in again] == [
                one.row_time.tolist() for one in plan[number + 1 :]
            ]
            for one, other in zip(again, plan[number + 1 :], strict=True):
                assert np.array_equal(one.paths, other.paths)
                assert (one.cursor, one.event) == (other.cursor, other.event)
            assert make_cursor(events, segment.cursor.events, 3) == segment.cursor
            assert (
                segment.cursor.rows
                == sum(map(len, rows))
                == row_count(events, 3, segment.cursor.time)
            )


def test_there_is_no_standing_in_the_midst_of_a_time():
    events = [hs.NormalLoad(0.0, 0.01), hs.TangentialLoad(0.0, 0.0), hs.NormalLoad(1.0, 0.02)]
    assert make_cursor(events, 1) is None
    assert make_cursor(events, 0) is None
    assert make_cursor(events, 4) is None
    assert make_cursor(events, 2).heading == (AT_WAYPOINT, AT_WAYPOINT, AT_WAYPOINT)
    assert make_cursor(events, 3).heading == (AT_WAYPOINT, BEYOND_LAST, AT_WAYPOINT)


# -- forks
# -----------------------------------------------------------------------------------------------------


def random_fork_events(rng, *, amplitude, friction, planar):
    """Return eight events of both channels and all controls, and of friction, at times from 0 to 10 s."""

    def tangential(size):
        return tuple(size * rng.uniform(-1, 1, 2)) if planar else size * rng.uniform(-1, 1)

    makers = [
        lambda time: N(time, 0.006 * rng.uniform(0.1, 1.5)),
        lambda time: D(time, 0.02 * rng.uniform(-0.1, 1.5)),
        lambda time: T(time, tangential(amplitude * 0.003)),
        lambda time: T(time, tangential(amplitude * 0.003)),
        lambda time: U(time, tangential(0.015)),
        lambda time: F(time, rng.uniform(0.3, 0.8)),
        lambda time: hs.FrictionRamp(time, rng.uniform(0.3, 0.8)),
    ]
    makers = makers if friction == "ramps" else makers[:6] if friction == "changes" else makers[:5]
    begun = [N(0.0, 0.006)] if rng.random() < 0.7 else []
    times = np.sort(np.round(rng.uniform(0, 10, 8), 1))
    return begun + [makers[rng.integers(len(makers))](float(time)) for time in times]


def check_fork(ensemble, events, time, earlier, tolerance, instrument):
    """Compare the past of events with that of a fork, also once other events follow it; return whether it had one."""

    def state(events, time):
        return hs.Replay(ensemble, events, saturate=True, instrument=instrument, hold=False).state(
            time
        )

    original = hs.Replay(ensemble, events, saturate=True, instrument=instrument, hold=False)
    past = [event for event in events if event.time <= time]
    fork = sorted(
        past + fork_waypoints(events, time, original.state, instrument),
        key=lambda event: event.time,
    )
    planar = any(
        isinstance(event, hs.loads.events.TangentialEvent) and event.planar for event in events
    )
    more = [N(20.0, 0.003), U(20.0, (0.0, 0.0) if planar else 0.0)]
    more += [] if planar else [hs.FrictionRamp(20.0, 0.1)]
    for moment in (earlier, time):
        expected = state(events, moment)
        for forked in (state(fork, moment), state(fork + more, moment)):
            assert forked.approach == approx(expected.approach, abs=0.02 * tolerance)
            assert forked.tangential_load == approx(expected.tangential_load, abs=0.003 * tolerance)
            assert forked.tangential_displacement == approx(
                expected.tangential_displacement, abs=0.01 * tolerance
            )
            assert forked.dissipated_energy == approx(
                expected.dissipated_energy, rel=tolerance, abs=1e-7 * tolerance
            )


FORKED = {
    # saturated loads, mixed control and an instrument, exact: to rounding
    "exact": ({}, {"amplitude": 1.5, "friction": "changes", "planar": False}, 1e-8, 16),
    # two ramps of both loads in place of one: the energy of each is refined until it is settled
    "own coefficients": (
        {"friction": [0.5, 0.4, 0.6]},
        {"amplitude": 1.5, "friction": "none", "planar": False},
        1e-4,
        12,
    ),
    # chords settle to 1e-4 in loads and displacements, and to 1e-3 in energy
    "friction ramps": ({}, {"amplitude": 0.4, "friction": "ramps", "planar": False}, 2e-3, 8),
    "wear": (
        {"wear": hs.wear.EnergyWear(volume_per_energy=1e-3)},
        {"amplitude": 0.4, "friction": "none", "planar": False},
        5e-3,
        3,
    ),
    "two directions": ({}, {"amplitude": 0.7, "friction": "none", "planar": True}, 1e-2, 2),
}


@mark.parametrize("kind", FORKED)
def test_a_fork_reproduces_the_past_of_a_random_history(kind):
    options, how, tolerance, count = FORKED[kind]
    ensemble = hs.Ensemble(
        PAIR, [0.0, -0.01, -0.03], [1.0, 2.0, 0.5], **({"friction": 0.5} | options)
    )
    done = 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        events = random_fork_events(rng, **how)
        instrument = hs.Instrument(lateral_stiffness=0.05) if seed % 2 else hs.Instrument()
        begin, end = events[0].time, events[-1].time
        time = float(
            rng.choice([rng.uniform(begin, end + 1), events[rng.integers(len(events))].time])
        )
        try:
            check_fork(
                ensemble, events, time, float(rng.uniform(begin, time)), tolerance, instrument
            )
        except hs.LoadError:
            continue
        except AssertionError as error:
            raise AssertionError(f"seed {seed}, fork at {time}: {events}") from error
        done += 1
    assert done >= count / 2


def test_a_fork_writes_the_request_of_a_saturated_load(ensemble):
    events = [N(0.0, 0.006), T(0.0, 0.0), N(1.0, 0.001), T(1.0, 0.0025)]
    job = hs.Replay(ensemble, events, saturate=True)
    assert job.state(0.9).tangential_load == approx(0.5 * 0.0015)
    normal, tangential = fork_waypoints(events, 0.9, job.state, job.instrument)
    assert (normal.value, tangential.value) == (approx(0.0015), approx(0.9 * 0.0025))


def test_a_fork_keeps_the_waypoints_of_friction(ensemble):
    events = [
        N(0.0, 0.006),
        hs.FrictionRamp(0.0, 0.5),
        hs.FrictionRamp(1.0, 0.4),
        U(2.0, 0.01),
        F(2.0, 0.2),
    ]
    events += [F(3.0, 0.3), hs.FrictionRamp(5.0, 0.5)]
    state = hs.Replay(ensemble, events).state
    found = [
        event
        for event in fork_waypoints(events, 4.0, state, hs.Instrument())
        if event.name == "friction_ramp"
    ]
    # on its way from 0.4 at 1 s to 0.5 at 5 s, changed to 0.2 at 2 s and to 0.3 at 3 s
    expected = [(2.0, 0.425), (3.0, 0.2 + 0.3 / 3), (4.0, 0.4)]
    assert [(event.time, event.friction) for event in found] == [
        (t, approx(mu)) for t, mu in expected
    ]
    held = fork_waypoints(events[:5], 2.0, state, hs.Instrument())
    assert held == [N(2.0, 0.006), hs.FrictionRamp(2.0, 0.4)]


def test_a_fork_holds_a_drive_where_it_is(ensemble):
    # between two events the path is straight in approach and displacement, and the drive is off its
    # waypoint
    instrument = hs.Instrument(lateral_stiffness=0.05)
    events = [N(0.0, 0.006), U(1.0, -0.06), N(1.0, 0.006), N(2.0, 0.001)]
    job = hs.Replay(ensemble, events, instrument=instrument)
    state = job.state(1.6)
    (found,) = (
        event
        for event in fork_waypoints(events, 1.6, job.state, instrument)
        if isinstance(event, U)
    )
    assert (
        found.value
        == instrument.drive_displacement(state.tangential_displacement, state.tangential_load)
        != -0.06
    )
    # at an event time it is at its waypoint
    assert fork_waypoints(events[:3], 2.0, job.state, instrument)[-1] == U(2.0, -0.06)


def test_a_fork_before_the_loads_lets_them_begin_later(ensemble):
    events = [F(0.0, 0.3), N(5.0, 0.006)]
    state = hs.Replay(ensemble, events[:1]).state
    assert fork_waypoints(events[:1], 1.0, state, hs.Instrument()) == [N(1.0, 0.0)]


def test_a_fork_has_the_time_at_which_a_load_leaves_the_friction_limit(ensemble):
    events = [D(0.0, 0.01), T(0.0, 0.003), D(1.0, 0.03), T(1.0, 0.001)]
    check_fork(ensemble, events, 0.9, 0.5, 1e-8, hs.Instrument())
