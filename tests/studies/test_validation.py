"""`validate` walks the loads: what it calls valid can be run, and an event that cannot is named with its position."""

import json
import re

from click.testing import CliRunner
from pytest import fixture, mark, raises

import historysim as hs
from historysim.cli import main

BALL = """
title = "a ball"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
"""
PRESSED = '{ time = 0, normal_load = "50 mN" }'
PUSHED = f'{PRESSED}, {{ after = 1, tangential_load = "8 mN" }}'
BLOCK = (
    '[[loading.blocks]]\nwaypoints = [{ after = 0, normal_load = "50 mN" }]\n[[loading.blocks]]\n'
)
TURNS = """
each = { after = 1, normal_load = ["90 mN", "50 mN"] }
repeat = 3
waypoints = [
    { after = 1, tangential_load = "5 mN" },
    { after = 1, tangential_load = "-18 mN" },
    { after = 1, tangential_load = 0 },
]
"""
DEEP = '{ time = 0, normal_displacement = "200 nm" }, { time = 1, tangential_load = "8 mN" }'
REFUSED = {
    "beyond the limit": (
        f'waypoints = [{PRESSED}, {{ time = 1, tangential_load = "18 mN" }}]',
        "waypoints[1]: event 1",
    ),
    "held while friction falls": (
        f'hold = true\nwaypoints = [{PUSHED}, {{ after = 1, friction = 0.1 }}, {{ after = 1, normal_load = "70 mN" }}]',
        "waypoints[2]: event 3",
    ),
    "other summits": (
        f'waypoints = [{DEEP}, {{ time = 2, geometry = {{ summit_radius = "1 nm" }} }}]',
        "waypoints[2]: event 2",
    ),
    "a turn of a block": (f"{BLOCK}{TURNS}", "blocks[1].waypoints[1]: event 15"),
    "a line of a file": (
        'file = "loads.csv"\ncolumns = { time = "t", normal_load = "N", tangential_load = "T" }',
        "file: loads.csv: line 4: event 5",
    ),
}


@fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "loads.csv").write_text(
        "t,N,T\n0,0.05,0\n1,0.05,0.008\n2,0.05,0.018\n", encoding="utf-8"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def scenario(folder, loading, more=""):
    path = folder / "s.toml"
    path.write_text(f"{BALL}[loading]\n{loading}\n{more}", encoding="utf-8")
    return path


@mark.parametrize("loading, place", REFUSED.values(), ids=REFUSED)
def test_an_excessive_load_is_named_with_its_path(folder, loading, place):
    path = scenario(folder, loading)
    for ask in (hs.validate, hs.run):
        with raises(
            hs.LoadError, match=rf"^s\.toml: loading\.{re.escape(place)} at t = .*friction limit of"
        ):
            ask(path)
    hs.validate(path, {"loading.saturate": True})
    assert CliRunner().invoke(main, ["validate", "s.toml"]).exit_code == 1


def test_a_course_of_friction_is_named(folder):
    course = "[friction.course]\ntime = [0, 1, 2]\ncoefficient = [0.2, 0.2, 0.05]"
    path = scenario(
        folder, f'waypoints = [{PUSHED}, {{ time = 2, normal_load = "60 mN" }}]', course
    )
    for ask in (hs.validate, hs.run):
        with raises(
            hs.LoadError, match=r"^s\.toml: (friction\.course|loading\.waypoints\[2\]): event \d at"
        ):
            ask(path)


@mark.parametrize("more", ["[instrument]\nlateral_stiffness = 1e5", "[record]\nsliding = true"])
def test_what_can_be_carried_is_valid_whatever_it_is_recorded_with(folder, more):
    loading = (
        f'substeps = 50\nwaypoints = [{PRESSED}, {{ time = 1, tangential_displacement = "90 nm" }}]'
    )
    path = scenario(folder, loading, more)
    assert "note" not in dict(hs.validate(path))
    hs.run(path)


def test_long_loads_are_walked_as_far_as_the_time_goes(folder, monkeypatch):
    block = (
        f"[[loading.blocks]]\nwaypoints = [{PRESSED.replace('time', 'after')}]\n[[loading.blocks]]\nrepeat = 3000\n"
        'waypoints = [{ after = 1, tangential_load = "8 mN" }, { after = 1, tangential_load = "-8 mN" }]\n'
        '[[loading.blocks]]\nwaypoints = [{ after = 1, tangential_load = "18 mN" }]'
    )
    path = scenario(folder, block)
    with raises(
        hs.LoadError, match=r"loading\.blocks\[2\]\.waypoints\[0\]: event 6\d\d\d at t = 6001 s"
    ):
        hs.validate(path)
    monkeypatch.setattr(
        "historysim.scenario.scenario_summary.monotonic", iter(range(0, 100, 2)).__next__
    )
    notes = [text for label, text in hs.validate(path) if label == "note"]
    assert len(notes) == 1
    assert notes[0].startswith("the loads were checked up to t = 511 s within 3 s; the environment")


def test_the_ends_of_a_sweep_are_walked(folder):
    over = '[sweep.over]\n"friction.coefficient" = [0.1, 0.2, 0.3]'
    path = scenario(folder, f"waypoints = [{PUSHED}]", over)
    warnings = [text for label, text in hs.validate(path) if label == "warning"]
    assert len(warnings) == 1
    place = "s.toml: loading.waypoints[1]: event 1 at t = 1 s: "
    assert warnings[0].startswith(
        f"cell 0 of the sweep (friction.coefficient = 0.1) stays empty: {place}"
    )
    assert dict(json.loads(CliRunner().invoke(main, ["validate", "s.toml", "--json"]).stdout))
    found = hs.sweep(path)
    assert str(found.failure.values[0]).startswith(place)
    assert [bool(text) for text in found.failure.values] == [True, False, False]


def test_a_fit_needs_a_record(folder):
    loading = f"waypoints = [{PRESSED}, {PUSHED}]"
    path = scenario(folder, loading, '[fit]\nparameters = ["friction"]')
    for ask in (hs.validate, hs.fit):
        with raises(
            hs.InputError,
            match=r"^s\.toml: loading: has no measured record; expected loading\.file",
        ):
            ask(path)
