"""Friction over time and distance: events by hand, and what the contact then carries."""

import numpy as np
from golden import check_messages
from numpy.testing import assert_allclose
from pairs import STIFF as PAIR
from pytest import approx, mark, raises
from records import BALL as SCENARIO
from records import scenario_text, write_columns

import historysim as hs
from historysim.loads.friction_course import FrictionCourse

BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.5)


def moves(*values, start=1.0):
    return [hs.TangentialDisplacement(start + i, value) for i, value in enumerate(values)]


def changes(events):
    return [
        (event.time, event.friction) for event in events if isinstance(event, hs.FrictionChange)
    ]


def test_over_time_it_agrees_with_each_event():
    events = [hs.NormalLoad(0.0, 1.0), *moves(1e-6, 2e-6, 3e-6)]
    found = FrictionCourse(time=[1.0, 3.0], coefficient=[0.4, 0.2]).along(events)
    assert changes(found) == [(0.0, 0.4), (2.0, approx(0.3)), (3.0, approx(0.2))]
    assert [event for event in found if not isinstance(event, hs.FrictionChange)] == events
    # behind what is reached at its time
    assert isinstance(found[1], hs.FrictionChange)


def test_over_distance_both_ways_count():
    events = [hs.NormalLoad(0.0, 1.0), *moves(1e-6, -1e-6, 2e-6)]
    course = FrictionCourse(distance=[0.0, 10e-6], coefficient=[0.0, 1.0])
    assert_allclose([mu for _, mu in changes(course.along(events))], [0.0, 0.1, 0.3, 0.6])
    # a record that begins with its displacement has no way before it, and a step between counts by
    # its share
    record = [
        hs.NormalLoad(1.0, 1.0),
        *moves(5e-6, 7e-6),
        hs.NormalLoad(2.5, 1.0),
        hs.TangentialDisplacement(3.0, 9e-6),
    ]
    assert_allclose([mu for _, mu in changes(course.along(record))], [0.0, 0.2, 0.3, 0.4])


def test_where_nothing_changes_there_is_no_event():
    events = [hs.NormalLoad(0.0, 1.0), *moves(1e-6, 2e-6, 3e-6)]
    assert changes(FrictionCourse(time=[0.0], coefficient=[0.3]).along(events)) == [(0.0, 0.3)]


def test_the_contact_slides_at_the_friction_of_the_place():
    """Far beyond the preliminary displacement, T = μ(s) N at each event."""
    way = np.linspace(0, 1e-3, 41)[1:]
    events = [hs.NormalLoad(0.0, 1.0), *moves(*way.tolist())]
    course = FrictionCourse(distance=[0.0, 0.5e-3], coefficient=[0.5, 0.2])
    history = hs.replay(BALL, course.along(events))
    load = history.total_tangential_load.values[1:]
    # on the way to an event friction is that of the event before
    before = np.append(0.5, course.at(way[:-1]))
    assert_allclose(load, np.minimum(before, course.at(way)), rtol=1e-9)


# -- as a section of a scenario --------------------------------------------------------------------


LOADING = """
[loading]
waypoints = [
    { time = 0, normal_load = "1 N" },
    { time = 1, tangential_displacement = "1 mm" },
    { time = 2, tangential_displacement = "2 mm" },
]
"""


def events(tmp_path, course, loading=LOADING):
    (tmp_path / "s.toml").write_text(SCENARIO + course + loading, encoding="utf-8")
    return hs.load(tmp_path / "s.toml").events()


def frictions(found):
    return [event.friction for event in found if isinstance(event, hs.FrictionChange)]


def test_a_course_is_written_out_or_comes_from_a_file(tmp_path):
    written = '[friction.course]\ndistance = ["0 mm", "2 mm"]\ncoefficient = [0.4, 0.2]\n'
    assert_allclose(frictions(events(tmp_path, written)), [0.4, 0.3, 0.2])
    write_columns(tmp_path / "mu.csv", s=[0, 2e-3], mu=[0.4, 0.2])
    file = '[friction.course]\nfile = "mu.csv"\ncolumns = { distance = "s", coefficient = "mu" }\n'
    assert frictions(events(tmp_path, file)) == frictions(events(tmp_path, written))
    over_time = "[friction.course]\ntime = [0, 2]\ncoefficient = [0.4, 0.2]\n"
    assert_allclose(frictions(events(tmp_path, over_time)), [0.4, 0.3, 0.2])
    history = hs.run(tmp_path / "s.toml")
    assert_allclose(history.total_tangential_load.values, [0, 0.3, 0.2], rtol=1e-9)


@mark.parametrize("call", [hs.compare, hs.fit])
def test_a_record_is_compared_with_one_coefficient(tmp_path, call):
    turns = np.array([0, 100, -100, 100, -100])
    write_columns(tmp_path / "m.csv", t=np.arange(5), N=np.ones(5), u=turns, T=0.2 * np.sign(turns))
    course = "[friction.course]\ntime = [0]\ncoefficient = [0.3]\n"
    text = scenario_text(
        response={"tangential_load": '"T"'}, more=f'{course}[fit]\nparameters = ["friction"]\n'
    )
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    with raises(
        hs.InputError,
        match=r"s\.toml: friction\.course: comparison and fit use one constant coefficient",
    ):
        call(tmp_path / "s.toml")


def test_messages():
    check_messages(globals())
