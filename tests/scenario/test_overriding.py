"""Keys of a scenario with other values, in what is read and in the text that is kept."""

import tomllib

import numpy as np
import pytest

import historysim as hs
from historysim.scenario.grid import place_of, text_with_values, with_values

SCENARIO = """\
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


@pytest.mark.parametrize(
    ("key", "place"),
    [
        ("title", ("title",)),
        ("friction.coefficient", ("friction", "coefficient")),
        ("loading.waypoints[12].after", ("loading", "waypoints", 12, "after")),
        ("a[0][1]", ("a", 0, 1)),
        ('sweep.over."surface.seed"', ("sweep", "over", "surface.seed")),
        ("sweep.over.'loading.waypoints[1].time'[3]", ("sweep", "over", "loading.waypoints[1].time", 3)),
        (r'"a\"b" . "\u00e4".c', ('a"b', "ä", "c")),
    ],
)
def test_a_key_is_written_as_in_messages(key, place):
    assert place_of(key) == place


NO_KEYS = (
    *("", ".", "a.", "a b", "a[x]", "a[-1]", "[0]", "a[0]b", "a[1", "ä", "a b.c"),
    *('a."b', "a.'b", 'a."b"c', r'"\x"', 'a"b"', '"a" "b"', "'a\n'"),
)


@pytest.mark.parametrize("key", NO_KEYS)
def test_what_is_no_key_is_refused(key):
    with pytest.raises(hs.InputError, match="is no key; expected names"):
        place_of(key)


def test_a_document_gets_other_values_and_stays_as_it_is():
    before = {"a": {"b": [1, {"c": 2}]}, "d": 3}
    after = with_values(before, {"a.b[1].c": 5, "e.f": np.float64(0.5), "a.b[0]": (1, np.int64(2))})
    assert after == {"a": {"b": [[1, 2], {"c": 5}]}, "d": 3, "e": {"f": 0.5}}
    assert type(after["e"]["f"]) is float
    assert before == {"a": {"b": [1, {"c": 2}]}, "d": 3}


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("title.x", "title: 'a ball'; expected a table, to have 'x' in it"),
        ("loading.waypoints[2].time", r"loading.waypoints\[2\]: there is none; expected \[0\] to \[1\]"),
        ("friction[0]", r"friction: a table; expected an array, to take \[0\] of it"),
    ],
)
def test_a_place_that_is_not_there_is_named(key, message):
    with pytest.raises(hs.InputError, match=message):
        text_with_values(SCENARIO, {key: 1})


def test_a_key_with_a_dot_of_its_own_is_quoted():
    """As TOML has it: the values of ``[sweep.over]`` stand under such keys."""
    text = SCENARIO + '[sweep.over]\n"surface.radius" = [1e-3]  # one\n"loading.waypoints[1].time" = [1, 2]\n'
    values = {'sweep.over."surface.radius"': [2e-3], "sweep.over.'loading.waypoints[1].time'[0]": 3}
    changed = text_with_values(text, values)
    assert tomllib.loads(changed)["sweep"]["over"] == {"surface.radius": [2e-3], "loading.waypoints[1].time": [3, 2]}
    assert "# one" in changed
    with pytest.raises(hs.InputError, match=r"sweep\.over\.surface\.radius: a table; .*\[0\] itself stands in quotes"):
        text_with_values(text, {"sweep.over.surface.radius[0]": [1e-3]})
    with pytest.raises(hs.InputError, match=r"sweep\.over\.'surface\.radius': an array; expected a table"):
        text_with_values(text, {"sweep.over.'surface.radius'.x": 1})


def test_the_text_keeps_its_comments_and_means_the_same():
    values = {
        "friction.coefficient": 0.3,
        "loading.waypoints[1].tangential_load": "5 mN",
        "instrument.lateral_stiffness": 3e5,
        "record.asperities": "totals",
    }
    text = text_with_values(SCENARIO, values)
    assert tomllib.loads(text) == with_values(tomllib.loads(SCENARIO), values)
    assert text.startswith("# one ball\n")
    assert "# pressed" in text


AWKWARD = (
    "a = 1\n[b.c]\nx = 1\n[d]\ny = 2\n[b]\nz = 3\n",
    "[[a]]\nx = 1\n[[a.b]]\ny = 1\n[[a]]\nx = 2\n",
    'a.b = 1\na.c = "#"\nd = { e = [1, 2] }\n',
    "a = [\n 1, # one\n 2,\n]\n",
)


@pytest.mark.parametrize("source", AWKWARD)
@pytest.mark.parametrize("values", [{"b.z": 4}, {"b.c.x": 9}, {"a": 5}, {"a[1]": 5}, {"d.e": {"f": 1}}, {"new.one": 1}])
def test_any_text_means_what_is_asked_for(source, values):
    try:
        expected = with_values(tomllib.loads(source), values)
    except hs.InputError:
        return
    assert tomllib.loads(text_with_values(source, values)) == expected


def test_a_scenario_with_other_values(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    changed = hs.load(path, {"friction.coefficient": 0.3, "surface.radius": "1 mm"})
    assert changed.sections.friction.coefficient == 0.3
    assert changed.ensemble().summit_radius == pytest.approx([1e-3])
    written = tmp_path / "changed.toml"
    written.write_text(changed.text, encoding="utf-8")
    history = hs.run(changed)
    assert history.attrs["scenario"] == changed.text
    assert history.identical(hs.run(written))
    assert not history.identical(hs.run(path))
    with pytest.raises(hs.InputError, match=r"friction\.coefficent: unknown key; did you mean 'coefficient'"):
        hs.load(path, {"friction.coefficent": 0.3})
