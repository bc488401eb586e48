"""Loops, and sliding, in one call: each way leads to the same ones."""

from itertools import pairwise

import numpy as np
from pytest import approx, fixture, raises
from records import scenario_text, write_columns

import historysim as hs
from historysim.results import analysis

COLUMNS = {"tangential_displacement": '{ column = "u", unit = "nm" }'}
RESPONSE = {"tangential_load": '"T"'}


@fixture
def folder(tmp_path):
    """Three loops of 100 nm, with swings of 3 nm, 1.5 % of their range, in them, under 1 N."""
    turns = [0, 100, -20, -17, -100, 100, -20, -17, -100, 100, -20, -17, -100, 100]
    moved = np.concatenate([[0.0], *(np.linspace(a, b, 21)[1:] for a, b in pairwise(turns))])
    load = 0.2 * np.sign(np.gradient(moved))
    write_columns(
        tmp_path / "m.csv", t=np.arange(moved.size), N=np.ones(moved.size), u=moved, T=load
    )
    write(tmp_path)
    return tmp_path


def write(folder, **options):
    (folder / "s.toml").write_text(scenario_text(COLUMNS, RESPONSE, **options), encoding="utf-8")


def test_a_result_its_history_and_the_analysis_have_the_same_loops(folder):
    hs.run(folder / "s.toml", folder / "s.nc").close()
    history = hs.run(folder / "s.toml")
    ends = analysis.friction_loops(history).ends.tolist()
    assert len(ends) == 3
    for record in (history, folder / "s.nc"):
        assert hs.loops(record).ends.tolist() == ends


def test_the_scenario_sets_the_dead_band(folder):
    write(folder, dead_band={"tangential_displacement": '"2 nm"'})
    found = hs.loops(folder / "s.toml")
    assert (len(found), found.dead_band) == (5, 2e-9)
    assert len(hs.loops(folder / "s.toml", dead_band=20e-9, skip=1)) == 2


def test_a_log_is_refused_as_a_log(folder):
    hs.run(folder / "s.toml", folder / "s.nc").close()
    with raises(
        hs.InputError, match=r"s\.history: is neither a scenario .* recomputes the result of a log"
    ):
        hs.loops(folder / "s.history")


# -- sliding ---------------------------------------------------------------------------------------


@fixture
def slider(tmp_path, monkeypatch):
    """Ten micrometres of sliding under 1 N, along which friction falls."""
    u = np.linspace(0, 10_000, 201)
    friction = np.where(u < 100, 0.3 * u / 100, 0.2 + 0.1 * np.exp(-(u - 100) / 2000))
    write_columns(tmp_path / "m.csv", t=np.arange(u.size), N=np.ones(u.size), u=u, T=friction)
    (tmp_path / "s.toml").write_text(
        scenario_text(response={"tangential_load": '"T"'}), encoding="utf-8"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_all_ways_lead_to_the_same_friction(slider):
    found = hs.sliding(slider / "s.toml")
    assert found.approach.steady == approx(0.2, abs=1e-3)
    assert found.approach.length == approx(2e-6, rel=1e-2)
    for record in (hs.load("s.toml"), hs.load("s.toml").measurement()):
        assert hs.sliding(record, windows=50).window_mean.tolist() == found.window_mean.tolist()
    history = hs.run("s.toml", "s.nc")
    simulated = hs.sliding(history)
    history.close()
    assert simulated.window_mean[5:] == approx(0.2)
    assert hs.sliding("s.nc").window_mean.tolist() == simulated.window_mean.tolist()
