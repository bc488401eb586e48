"""[friction.course]: written out and from a file, and what does not go with it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from records import BALL, scenario_text, write_columns

import historysim as hs

LOADING = """
[loading]
waypoints = [
    { time = 0, normal_load = "1 N" },
    { time = 1, tangential_displacement = "1 mm" },
    { time = 2, tangential_displacement = "2 mm" },
]
"""


def events(tmp_path, course, loading=LOADING):
    (tmp_path / "s.toml").write_text(BALL + course + loading, encoding="utf-8")
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


@pytest.mark.parametrize(
    ("course", "said"),
    [
        ("coefficient = [0.1]", "friction.course: neither time nor distance; expected one of them"),
        ("time = [0, 1]\ncoefficient = [0.1]", "friction.course: 2 of time and 1 of coefficient"),
        ('file = "mu.csv"\ncolumns = { coefficient = "mu" }', "friction.course.columns: neither time nor distance"),
        (
            'file = "mu.csv"\ncolumns = { time = "t", coefficient = "mu" }',
            "friction.course.file: mu.csv: time 0 does not",
        ),
    ],
)
def test_bad_input_is_explained(tmp_path, course, said):
    write_columns(tmp_path / "mu.csv", t=[0, 0], mu=[0.4, 0.2])
    with pytest.raises(hs.InputError, match=said):
        events(tmp_path, f"[friction.course]\n{course}\n")


@pytest.mark.parametrize("call", [hs.compare, hs.fit])
def test_a_record_is_compared_with_one_coefficient(tmp_path, call):
    turns = np.array([0, 100, -100, 100, -100])
    write_columns(tmp_path / "m.csv", t=np.arange(5), N=np.ones(5), u=turns, T=0.2 * np.sign(turns))
    course = "[friction.course]\ntime = [0]\ncoefficient = [0.3]\n"
    text = scenario_text(response={"tangential_load": '"T"'}, more=f'{course}[fit]\nparameters = ["friction"]\n')
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    with pytest.raises(
        hs.InputError, match=r"s\.toml: friction\.course: a record is compared with, and fitted by, one"
    ):
        call(tmp_path / "s.toml")
