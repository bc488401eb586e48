"""Channels that are held, or ramp through the events of others, in Python as in scenarios."""

import warnings

import attrs
import numpy as np
from golden import check_messages
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pairs import COMPLIANT as PAIR
from pytest import approx, mark, warns

import historysim as hs
from historysim.errors import RampWarning
from historysim.loads.event_sequence import SampledLoads
from historysim.loads.holding import find_ramp

BALL = hs.Ensemble(PAIR, summit_height=0.0, summit_radius=1e-3, friction=0.3)
# the normal load falls from 50 to 45 mN while the tangential load rises
RAMP = [
    hs.NormalLoad(0.0, 50e-3),
    hs.TangentialLoad(1.0, 5e-3),
    hs.NormalLoad(2.0, 45e-3),
    hs.TangentialLoad(3.0, 2e-3),
]
HELD = [
    hs.NormalLoad(0.0, 50e-3),
    hs.TangentialLoad(1.0, 5e-3),
    hs.NormalLoad(1.0, 50e-3),
    hs.NormalLoad(2.0, 45e-3),
    hs.TangentialLoad(2.0, 5e-3),
    hs.TangentialLoad(3.0, 2e-3),
    hs.NormalLoad(3.0, 45e-3),
]
NOTICE = (
    "event 1 at t = 1 s: normal_load is not set here and ramps from 50 mN at 0 s to 45 mN at 2 s, and so in 1 other "
    "place; set hold=True to hold it, or hold=False if the ramp is intended"
)


@mark.parametrize("entry", ["replay", "Replay", "EventLog.create"])
def test_every_entry_warns_of_a_ramp_at_its_caller_unless_hold_is_given(tmp_path, entry):
    def enter(**options):
        if entry == "replay":
            return hs.replay(BALL, RAMP, **options).total_normal_load.values
        if entry == "Replay":
            return hs.Replay(BALL, RAMP, **options).dataset().total_normal_load.values
        with hs.EventLog.create(tmp_path / "a.history", BALL, iter(RAMP), **options) as log:
            assert log.events() == (HELD if options.get("hold") else RAMP)
            return log.replay().total_normal_load.values

    with warns(RampWarning) as caught:
        ramped = enter()
    assert [str(one.message) for one in caught] == [NOTICE]
    assert caught[0].filename == __file__
    assert_allclose(ramped, [50e-3, 47.5e-3, 45e-3, 45e-3], rtol=1e-12)
    assert_array_equal(enter(hold=False), ramped)
    assert_array_equal(enter(hold=True), [50e-3, 50e-3, 45e-3, 45e-3])


def test_a_scenario_holds_the_same_events(tmp_path):
    """Of a change of friction, too, and of waypoints at one time."""
    waypoints = (
        '{ time = 0, normal_load = "50 mN" }, { time = 1, tangential_load = "5 mN" }, { time = 2, friction = 0.4 }, '
        '{ time = 3, normal_load = "45 mN", tangential_load = "4 mN" }, { time = 4, tangential_load = "2 mN" }'
    )
    head = '[materials]\nfirst = "silicon"\nsecond = "silica"\n[surface]\nkind = "sphere"\nradius = "1 mm"\n'
    text = f"{head}[friction]\ncoefficient = 0.3\n[loading]\nwaypoints = [{waypoints}]\n"
    for hold, name in ((None, "open.toml"), (True, "held.toml")):
        stated = "" if hold is None else "hold = true\n"
        (tmp_path / name).write_text(
            text.replace("[loading]\n", f"[loading]\n{stated}"), encoding="utf-8"
        )
    told = []
    events = hs.load(tmp_path / "open.toml").events(told.append)
    assert told[0].startswith(
        "loading.waypoints[1]: normal_load is not set here and ramps from 50 mN at 0 s to 45 mN"
    )
    assert list(hs.Replay(BALL, events, hold=True).events) == list(
        hs.load(tmp_path / "held.toml").events()
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hs.load(tmp_path / "open.toml").replay()


@mark.parametrize(
    "events",
    [
        # it is back where it was; it is set at the same time; nothing is after it; nothing is
        # between; it is a record
        [hs.NormalLoad(0, 1.0), hs.TangentialLoad(1, 0.1), hs.NormalLoad(2, 1.0)],
        [hs.NormalLoad(0, 1.0), hs.TangentialLoad(1, 0.1), hs.NormalLoad(1, 2.0)],
        [
            hs.NormalLoad(0, 1.0),
            hs.TangentialLoad(1, 0.1),
            hs.TangentialLoad(1, 0.2),
            hs.NormalLoad(1, 2.0),
        ],
        [
            hs.NormalLoad(0, 1.0),
            hs.NormalLoad(0, 2.0),
            hs.TangentialLoad(1, 0.1),
            hs.TangentialLoad(2, 0.2),
        ],
        [
            hs.NormalLoad(0, 1.0),
            hs.TangentialLoad(0, 0.1),
            hs.NormalLoad(2, 2.0),
            hs.TangentialLoad(2, 0.3),
        ],
        [
            hs.TangentialLoad(0, (0.0, 0.0)),
            hs.TangentialLoad(1, (0.1, None)),
            hs.TangentialLoad(1, (None, 0.2)),
        ],
        SampledLoads(np.arange(3.0), np.array([1.0, 2.0, 3.0]), np.array([0.0, 1e-9, -1e-9])),
        [hs.NormalLoad(1, 1.0), "event"],
        [hs.NormalLoad(1, 1.0), hs.TangentialLoad(0, 0.1), hs.NormalLoad(-1, 2.0)],
    ],
)
def test_what_is_set_or_stays_gets_no_notice(events):
    hs.Replay(BALL, events)


@mark.parametrize(
    "events, said",
    [
        (
            [hs.NormalLoad(0, 1.0), hs.FrictionChange(1, 0.2), hs.NormalLoad(2, 2.0)],
            "event 1 at t = 1 s: normal_load is not set here and ramps from 1 N at 0 s to 2 N at 2 s; set",
        ),
        (
            [hs.NormalLoad(0, 1.0), hs.TangentialLoad(1, 0.1), hs.NormalDisplacement(2, 1e-9)],
            "ramps from 1 N at 0 s to 1 nm at 2 s",
        ),
        (
            [
                hs.TangentialLoad(0, (0.1, 0.1)),
                hs.TangentialLoad(1, (0.2, None)),
                hs.TangentialLoad(2, (0.3, 0.3)),
            ],
            "event 1 at t = 1 s: tangential_load is not set here and ramps from 100 mN at 0 s to 300 mN at 2 s; set",
        ),
    ],
)
def test_changes_of_friction_control_and_direction_are_passed_too(events, said):
    with warns(RampWarning) as caught:
        hs.Replay(BALL, events)
    assert said in str(caught[0].message)


def test_both_directions_are_held():
    events = [
        hs.NormalLoad(0, 50e-3),
        hs.TangentialDisplacement(1, (2e-9, 1e-9)),
        hs.TangentialDisplacement(2, (4e-9, None)),
        hs.TangentialDisplacement(3, (4e-9, 3e-9)),
    ]
    job = hs.Replay(BALL, events, hold=True)
    y = hs.TangentialDisplacement(2, (None, 1e-9))
    assert y in list(job.events)
    displacement = job.dataset().tangential_displacement.values
    assert_allclose(
        displacement, [[0, 0], [2e-9, 1e-9], [4e-9, 1e-9], [4e-9, 3e-9]], rtol=1e-9, atol=1e-18
    )


def test_a_copy_of_a_replay_neither_warns_nor_holds_again():
    job = hs.Replay(BALL, RAMP, hold=True)
    again = attrs.evolve(job, substeps=3)
    assert list(again.events) == list(job.events) == HELD
    assert list(hs.Replay(BALL, job.events, hold=True).events) == HELD


def test_a_log_resumes_and_verifies_with_held_channels(tmp_path):
    with hs.EventLog.create(tmp_path / "a.history", BALL, RAMP, hold=True) as log:
        log.append(hs.TangentialLoad(4.0, -2e-3))
        held = log.replay()
    with hs.EventLog(tmp_path / "a.history") as log:
        assert log.replay().identical(held)
        assert log.state(at=1.5).normal_load == approx(47.5e-3)  # from 1 s to 2 s
        assert log.state(at=0.5).normal_load == approx(50e-3)


@st.composite
def sequences(draw):
    times = sorted(draw(st.lists(st.integers(0, 5), min_size=1, max_size=8)))
    kinds = st.sampled_from([hs.NormalLoad, hs.TangentialLoad, hs.TangentialDisplacement])
    return [draw(kinds)(float(time), draw(st.sampled_from([0.0, 1.0]))) for time in times]


@given(sequences())
def test_the_first_ramp_agrees_with_a_direct_search(events):
    """A ramp: two consecutive waypoints that differ, and an event at a time strictly between."""
    found = []
    for last, end in enumerate(events):
        earlier = [event for event in events[:last] if event.channel == end.channel]
        if not earlier or (type(earlier[-1]), earlier[-1].value) == (type(end), end.value):
            continue
        between = [k for k, event in enumerate(events) if earlier[-1].time < event.time < end.time]
        found += [(earlier[-1], end, between[0])] if between else []
    ramp = find_ramp(events)
    if not found:
        assert ramp is None
    else:
        assert (ramp.start, ramp.end, ramp.passed, ramp.others) == (*found[0], len(found) - 1)
        assert find_ramp(hs.Replay(BALL, events, hold=True).events) is None


def test_messages():
    check_messages(globals())
