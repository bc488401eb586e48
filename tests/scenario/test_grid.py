"""Keys of a scenario with other values, and the grid of a sweep: its points, their order, and what is refused."""

import itertools
import tomllib

import numpy as np
from golden import refused
from pytest import approx, mark

import historysim as hs
from historysim.scenario.grid import build_grid, expand, path_of_key, text_with_values, with_values

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = "50 mN" }, { after = 1, tangential_load = "8 mN" }]
"""


def test_keys_are_crossed_and_the_last_varies_fastest():
    grid = build_grid({"a.b": [1, 2], "c": np.array([0.5, 1.5, 2.5])})
    expected = [{"a.b": b, "c": c} for b, c in itertools.product([1, 2], [0.5, 1.5, 2.5])]
    assert list(grid.points()) == expected
    assert grid.shape == (2, 3)
    assert [axis.name for axis in grid.axes] == ["a_b", "c"]


def test_keys_go_together():
    grid = build_grid({"x": [1, 2], "y": [5, 6, 7], "z": [3, 4]}, together=[["z", "x"]])
    assert [axis.keys for axis in grid.axes] == [("z", "x"), ("y",)]
    assert [(point["z"], point["x"], point["y"]) for point in grid.points()] == [
        (z, x, y) for (z, x), y in itertools.product([(3, 1), (4, 2)], [5, 6, 7])
    ]


def test_tables_are_keys_with_dots():
    nested = build_grid(
        {
            "surface": {"seed": {"from": 1, "count": 2}, "count": [[4, 4], [8, 8]]},
            "friction.coefficient": [1],
        }
    )
    assert next(nested.points()) == {
        "surface.seed": 1,
        "surface.count": [4, 4],
        "friction.coefficient": 1,
    }


@mark.parametrize(
    "given, values",
    [
        ([1, "2 nm", [3, 4]], [1, "2 nm", [3, 4]]),
        (range(3), [0, 1, 2]),
        ({"from": 3, "count": 4}, [3, 4, 5, 6]),
        ({"from": 0, "to": 1, "count": 5}, [0.0, 0.25, 0.5, 0.75, 1.0]),
        ({"from": "1 nm", "to": "2 nm", "count": 3}, ["1.0 nm", "1.5 nm", "2.0 nm"]),
        ({"from": 1, "to": 100, "count": 3, "spacing": "logarithmic"}, [1.0, 10.0, 100.0]),
        ({"from": -8, "to": -2, "count": 3, "spacing": "logarithmic"}, [-8.0, -4.0, -2.0]),
    ],
)
def test_values_are_lists_and_ranges(given, values):
    assert expand(given) == values


def test_a_scenario_has_a_sweep(tmp_path):
    path = tmp_path / "s.toml"
    sweep = '[sweep]\ntogether = [["materials.first", "friction.coefficient"]]\n[sweep.over]\n'
    keys = 'materials.first = ["silicon", "silica"]\nfriction.coefficient = [0.1, 0.2]\nsurface.radius = ["1 mm"]\n'
    path.write_text(SCENARIO + sweep + keys, encoding="utf-8")
    assert hs.load(path).sections.sweep.grid().shape == (2, 1)


# -- keys with other values ------------------------------------------------------------------------


BALL = """\
# one ball
title = "a ball"   # its name

[friction]
coefficient = 0.2 # measured

[loading]
waypoints = [
    { time = 0, normal_load = "50 mN" }, # pressed
    { time = 1, tangential_load = "8 mN" },
]

[materials]
first = "silicon"
second = "float glass"

[surface]
kind = "sphere"
radius = "2.5 mm"
"""


@mark.parametrize(
    "key, place",
    [
        ("title", ("title",)),
        ("friction.coefficient", ("friction", "coefficient")),
        ("loading.waypoints[12].after", ("loading", "waypoints", 12, "after")),
        ("a[0][1]", ("a", 0, 1)),
        ('sweep.over."surface.seed"', ("sweep", "over", "surface.seed")),
        (
            "sweep.over.'loading.waypoints[1].time'[3]",
            ("sweep", "over", "loading.waypoints[1].time", 3),
        ),
        (r'"a\"b" . "\u00e4".c', ('a"b', "ä", "c")),
    ],
)
def test_a_key_is_written_as_in_messages(key, place):
    assert path_of_key(key) == place


NO_KEYS = (
    *("", ".", "a.", "a b", "a[x]", "a[-1]", "[0]", "a[0]b", "a[1", "ä", "a b.c"),
    *('a."b', "a.'b", 'a."b"c', r'"\x"', 'a"b"', '"a" "b"', "'a\n'"),
)


@mark.parametrize("key", NO_KEYS)
def test_an_invalid_key_is_refused(key):
    with refused("is not a key; expected names"):
        path_of_key(key)


def test_a_document_gets_other_values_and_stays_as_it_is():
    before = {"a": {"b": [1, {"c": 2}]}, "d": 3}
    after = with_values(before, {"a.b[1].c": 5, "e.f": np.float64(0.5), "a.b[0]": (1, np.int64(2))})
    assert after == {"a": {"b": [[1, 2], {"c": 5}]}, "d": 3, "e": {"f": 0.5}}
    assert type(after["e"]["f"]) is float
    assert before == {"a": {"b": [1, {"c": 2}]}, "d": 3}


def test_a_key_with_a_dot_of_its_own_is_quoted():
    """As TOML has it: the values of ``[sweep.over]`` stand under such keys."""
    text = (
        BALL
        + '[sweep.over]\n"surface.radius" = [1e-3]  # one\n"loading.waypoints[1].time" = [1, 2]\n'
    )
    values = {'sweep.over."surface.radius"': [2e-3], "sweep.over.'loading.waypoints[1].time'[0]": 3}
    changed = text_with_values(text, values)
    assert tomllib.loads(changed)["sweep"]["over"] == {
        "surface.radius": [2e-3],
        "loading.waypoints[1].time": [3, 2],
    }
    assert "# one" in changed
    with refused(r"sweep\.over\.surface\.radius: a table; .*\[0\] itself needs quotes"):
        text_with_values(text, {"sweep.over.surface.radius[0]": [1e-3]})
    with refused(r"sweep\.over\.'surface\.radius': an array; expected a table"):
        text_with_values(text, {"sweep.over.'surface.radius'.x": 1})


def test_the_text_keeps_its_comments_and_means_the_same():
    values = {
        "friction.coefficient": 0.3,
        "loading.waypoints[1].tangential_load": "5 mN",
        "instrument.lateral_stiffness": 3e5,
        "record.asperities": "totals",
    }
    text = text_with_values(BALL, values)
    assert tomllib.loads(text) == with_values(tomllib.loads(BALL), values)
    assert text.startswith("# one ball\n")
    assert "# pressed" in text


AWKWARD = (
    "a = 1\n[b.c]\nx = 1\n[d]\ny = 2\n[b]\nz = 3\n",
    "[[a]]\nx = 1\n[[a.b]]\ny = 1\n[[a]]\nx = 2\n",
    'a.b = 1\na.c = "#"\nd = { e = [1, 2] }\n',
    "a = [\n 1, # one\n 2,\n]\n",
)


@mark.parametrize("source", AWKWARD)
@mark.parametrize(
    "values", [{"b.z": 4}, {"b.c.x": 9}, {"a": 5}, {"a[1]": 5}, {"d.e": {"f": 1}}, {"new.one": 1}]
)
def test_any_text_means_what_is_asked_for(source, values):
    try:
        expected = with_values(tomllib.loads(source), values)
    except hs.InputError:
        return
    assert tomllib.loads(text_with_values(source, values)) == expected


def test_a_scenario_with_other_values(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(BALL, encoding="utf-8")
    changed = hs.load(path, {"friction.coefficient": 0.3, "surface.radius": "1 mm"})
    assert changed.sections.friction.coefficient == 0.3
    assert changed.ensemble().summit_radius == approx([1e-3])
    written = tmp_path / "changed.toml"
    written.write_text(changed.text, encoding="utf-8")
    history = hs.run(changed)
    assert history.attrs["scenario"] == changed.text
    assert history.identical(hs.run(written))
    assert not history.identical(hs.run(path))
    with refused(r"friction\.coefficent: unknown key; did you mean 'coefficient'"):
        hs.load(path, {"friction.coefficent": 0.3})
