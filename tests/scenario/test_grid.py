"""The grid of a sweep: which points it has, in which order, and what it refuses."""

import itertools

import numpy as np
import pytest

import historysim as hs
from historysim.scenario.grid import expand, grid_of

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
    grid = grid_of({"a.b": [1, 2], "c": np.array([0.5, 1.5, 2.5])})
    expected = [{"a.b": b, "c": c} for b, c in itertools.product([1, 2], [0.5, 1.5, 2.5])]
    assert list(grid.points()) == expected
    assert grid.shape == (2, 3)
    assert [axis.name for axis in grid.axes] == ["a_b", "c"]


def test_keys_go_together():
    grid = grid_of({"x": [1, 2], "y": [5, 6, 7], "z": [3, 4]}, together=[["z", "x"]])
    assert [axis.keys for axis in grid.axes] == [("z", "x"), ("y",)]
    assert [(point["z"], point["x"], point["y"]) for point in grid.points()] == [
        (z, x, y) for (z, x), y in itertools.product([(3, 1), (4, 2)], [5, 6, 7])
    ]


def test_tables_are_keys_with_dots():
    nested = grid_of(
        {"surface": {"seed": {"from": 1, "count": 2}, "count": [[4, 4], [8, 8]]}, "friction.coefficient": [1]}
    )
    assert next(nested.points()) == {"surface.seed": 1, "surface.count": [4, 4], "friction.coefficient": 1}


@pytest.mark.parametrize(
    ("given", "values"),
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


@pytest.mark.parametrize(
    ("over", "together", "message"),
    [
        ({}, [], "over: no keys; expected one or more"),
        ({"a": 1}, [], "over.a: 1; expected an array of values, or a range"),
        ({"a": {"from": 1, "cuont": 2}}, [], "over.a.cuont: unknown key; did you mean 'count'"),
        ({"a": {"from": 1.5, "count": 2}}, [], "over.a: a range without to counts whole numbers"),
        ({"a": {"from": "1 nm", "to": "2 µm", "count": 2}}, [], "over.a.to: in µm, and from in nm; expected one unit"),
        ({"a": {"from": 0, "to": 2, "count": 2, "spacing": "logarithmic"}}, [], "over.a: a logarithmic range has"),
        ({"a": [1], "b": [2]}, [["a", "c"]], r"together\[0\]: 'c' has no values in over"),
        ({"a": [1], "b": [2], "c": [3]}, [["a", "b"], ["b", "c"]], r"together\[1\]: 'b' stands in another group"),
        ({"a.b": [1], "a_b": [2]}, [], "over: two keys would be called a_b"),
        ({"a": range(2000), "b": range(2000)}, [], "over: 4,000,000 points; expected 1,000,000 at most"),
    ],
)
def test_what_is_no_grid_is_refused(over, together, message):
    with pytest.raises(hs.InputError, match=message):
        grid_of(over, together)


def test_a_scenario_has_a_sweep(tmp_path):
    path = tmp_path / "s.toml"
    sweep = '[sweep]\ntogether = [["materials.first", "friction.coefficient"]]\n[sweep.over]\n'
    keys = 'materials.first = ["silicon", "silica"]\nfriction.coefficient = [0.1, 0.2]\nsurface.radius = ["1 mm"]\n'
    path.write_text(SCENARIO + sweep + keys, encoding="utf-8")
    assert hs.load(path).sections.sweep.grid().shape == (2, 1)
    path.write_text(SCENARIO + sweep + 'materials.first = ["silicon"]\n', encoding="utf-8")
    with pytest.raises(hs.InputError, match=r"s.toml: sweep.together\[0\]: 'friction.coefficient' has no values"):
        hs.load(path)
    path.write_text(SCENARIO + "[sweep]\nover = 3\n", encoding="utf-8")
    with pytest.raises(hs.InputError, match=r"sweep.over: 3; expected a table"):
        hs.load(path)
