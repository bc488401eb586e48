"""Load events: what they take, what they refuse, and the order they stand in."""

import attrs
import numpy as np
from golden import check_messages, refused
from pairs import UNIT
from pytest import mark, raises

import historysim as hs
from historysim.loads.event_sequence import check_sequence, events_text
from historysim.loads.events import LoadEvent  # noqa: F401 - of the messages

LOADS = (hs.NormalLoad, hs.NormalDisplacement, hs.TangentialLoad, hs.TangentialDisplacement)
EVENTS = (*LOADS, hs.FrictionChange)

NOT_NUMBERS = [b"1", None, True, False, [0.1], (), {}, 1j, np.True_, 10**400]


@mark.parametrize("number", [np.float64(0.5), np.float32(0.5), np.array(0.5)])
@mark.parametrize("kind", EVENTS)
def test_numbers_of_numpy_become_plain_ones(kind, number):
    event = kind(number, number)
    assert event == kind(0.5, 0.5)
    assert {type(value) for value in attrs.astuple(event) if value is not None} == {float}


@mark.parametrize("number", [float("nan"), float("inf"), float("-inf"), np.nan])
@mark.parametrize("kind", EVENTS)
def test_numbers_that_are_not_finite_are_refused(kind, number):
    name = "friction" if kind is hs.FrictionChange else "value"
    with refused(rf"{kind.__name__}: time is .*expected a finite number"):
        kind(number, 0.1)
    with refused(rf"{kind.__name__}: {name} is .*expected a finite number"):
        kind(0.0, number)


@mark.parametrize("kind", EVENTS)
def test_what_is_not_a_number_is_refused(kind):
    for thing in NOT_NUMBERS:
        with refused(rf"{kind.__name__}: time .*expected a"):
            kind(thing, 0.1)
        if kind in LOADS:
            with refused(rf"{kind.__name__}: value .*expected a"):
                kind(0.0, thing)


@mark.parametrize(
    "kind, text, value",
    [
        (hs.NormalLoad, "50 mN", 0.05),
        (hs.TangentialLoad, "-20 gf", -0.196133),
        (hs.NormalDisplacement, "-3 nm", -3e-9),
        (hs.TangentialDisplacement, "1.5 µm", 1.5e-6),
    ],
)
def test_texts_have_the_units_of_the_event(kind, text, value):
    assert kind("2 min", text) == kind(120.0, value)
    with refused(r"'3 K': 'K' is not a unit of a (force|length)"):
        kind(0.0, "3 K")
    with refused(r"'1\.0' has no unit; expected a time"):
        kind("1.0", 0.0)


def test_the_new_summits_of_a_change_come_as_texts():
    change = hs.GeometryChange("1 ms", summit_height="-3 nm", summit_radius=["1 µm", 2e-6])
    assert change == hs.GeometryChange(1e-3, summit_height=-3e-9, summit_radius=(1e-6, 2e-6))


def test_a_normal_load_does_not_pull(tmp_path):
    ball = hs.Ensemble(UNIT, 0.0, 1.0, 0.2)
    events = [hs.NormalLoad(0.0, 1e-3), hs.NormalLoad(1.0, -1e-3)]
    with (
        refused("pulls on the contact"),
        hs.EventLog.create(tmp_path / "a.history", ball) as log,
    ):
        log.append(events)
    assert hs.NormalLoad(0.0, 0.0).value == 0.0
    for kind in (hs.NormalDisplacement, hs.TangentialLoad, hs.TangentialDisplacement):
        assert kind(-1.0, -2.0).value == -2.0


@mark.parametrize(
    "given, held",
    [
        (0.2, 0.2),
        (0, 0.0),
        ([0.1, 0.2], (0.1, 0.2)),
        ((0.1,), (0.1,)),
        (np.array([0.1, 0.2]), (0.1, 0.2)),
        (iter([0.1, 0.2]), (0.1, 0.2)),
    ],
)
def test_friction_is_one_coefficient_or_a_tuple_of_them(given, held):
    assert hs.FrictionChange(0.0, given).friction == held


def test_friction_that_is_no_coefficient_is_refused():
    nothing = ["0.2", b"1", None, True, 1j, 10**400, {}, [], ()]
    lists = [
        [0.1, None],
        [0.1, "0.2"],
        [0.1, True],
        [[0.1, 0.2]],
        np.array([[0.1, 0.2]]),
        np.array([True]),
    ]
    for friction in [*nothing, *lists, -0.1, [0.1, -0.1], [0.1, float("nan")], [float("inf")]]:
        with refused(r"FrictionChange: friction .*expected"):
            hs.FrictionChange(0.0, friction)


def test_a_decreasing_time_is_named_with_its_event_and_the_way_to_mend_it():
    events = [hs.NormalLoad(0.0, 1.0), hs.NormalLoad(2.5, 1.0), hs.FrictionChange(1.25, 0.1)]
    with raises(hs.InputError) as caught:
        check_sequence(events)
    message = str(caught.value)
    assert message.startswith("event 2 at t = 1.25 s: ")
    assert "t = 2.5 s" in message
    assert "expected times that do not decrease" in message
    mending = "sorted(events, key=lambda event: event.time)"
    assert mending in message
    check_sequence([])
    check_sequence(eval(mending, {"events": events}))  # noqa: S307 - the message says that this mends it


def test_events_say_how_many_they_are_and_how_long_they_last():
    assert (
        events_text([hs.NormalLoad(0.0, 1.0), hs.FrictionChange(90.0, 0.1)]) == "2 events over 90 s"
    )
    assert events_text([]) == "0 events"
    # a Replay shows itself before its events are checked
    assert events_text(["load"]) == "1 event"


def test_messages():
    check_messages(globals())
