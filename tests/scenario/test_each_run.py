"""Records that are several: runs in one table, by where the clock starts again or by a column, and each by itself."""

import numpy as np
import pytest
import synthetic
from click.testing import CliRunner
from records import write_columns

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError
from historysim.scenario.record_search import each_run

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.26
[loading]
file = "m.csv"
RUN
[loading.columns]
time = "t"
normal_load = { column = "N", unit = "mN" }
tangential_displacement = { column = "u", unit = "nm" }
[loading.response]
tangential_load = { column = "T", unit = "mN" }
[instrument]
lateral_stiffness = "334 mN/µm"
[fit]
parameters = ["friction"]
"""
FRICTION = (0.2, 0.15, 0.1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three runs of one table, whose clock begins again, each with less friction; the last one rests."""
    folder = tmp_path_factory.mktemp("runs")
    records = [synthetic.measured("ball", seed, loads=(0.05,), loops=3) for seed in range(3)]
    shares = np.repeat(np.array(FRICTION) / 0.2, [record.time.size for record in records])
    shares[-records[2].time.size :] = 0
    whole = {
        "t": np.concatenate([record.time for record in records]),
        "N": 1e3 * np.concatenate([record["normal_load"] for record in records]),
        "u": 1e9 * np.concatenate([record["tangential_displacement"] for record in records]),
        "T": 1e3 * shares * np.concatenate([record["tangential_load"] for record in records]),
        "Step": np.repeat([10, 20, 30], [record.time.size for record in records]),
    }
    whole["u"][-records[2].time.size :] = 0
    write_columns(folder / "m.csv", **whole)
    return folder


def loaded(folder, run, name="s.toml"):
    (folder / name).write_text(SCENARIO.replace("RUN", run), encoding="utf-8")
    return hs.load(folder / name)


def test_a_clock_that_starts_again_is_reported(folder):
    with pytest.raises(InputError, match=r"comes after .* if these are 3 runs, run = 1 to 3 in \[loading\]"):
        loaded(folder, "").measurement()


@pytest.mark.parametrize(
    ("run", "friction"), [("run = 1", 0.2), ("run = 2", 0.15), ('run = 20\nruns_by = "Step"', 0.15)]
)
def test_one_run_is_taken(folder, run, friction):
    loops = hs.loops(loaded(folder, run))
    assert loops.statistics("friction_coefficient").mean == pytest.approx(friction, rel=0.01)
    assert any(label == "run" and text.endswith("one of 3 runs, 961 samples") for label, text in loops.remarks)


@pytest.mark.parametrize("by", ["", '\nruns_by = "Step"'])
def test_each_run_by_itself(folder, by):
    scenario = loaded(folder, f'run = "each"{by}')
    runs = each_run(scenario, hs.loops)
    assert [run.number for run in runs] == ([10, 20, 30] if by else [1, 2, 3])
    found = [run.result.statistics("friction_coefficient").mean for run in runs[:2]]
    assert found == pytest.approx(FRICTION[:2], rel=0.01)
    assert runs[2].result is None
    assert "the tangential displacement rests" in runs[2].problem


def call(*arguments):
    return CliRunner().invoke(main, list(arguments))


def test_commands_have_a_row_for_each_run(folder, monkeypatch):
    monkeypatch.chdir(folder)
    loaded(folder, 'run = "each"', "e.toml")
    done = call("loops", "e.toml")
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert [line.split()[:2] for line in lines[:4]] == [["run", "loops"], ["1", "2"], ["2", "2"], ["3", "–"]]
    assert "the tangential displacement rests" in lines[4]
    done = call("loops", "e.toml", "-o", "l.nc")
    assert done.exit_code == 2
    assert "can only be written for one run; expected its number" in done.output
    done = call("sliding", "e.toml")
    assert done.exit_code == 2
    assert "none of 3 runs can be used" in done.output
    assert call("loops", "e.toml", "--set", "loading.run=2").exit_code == 0


def test_columns_show_the_runs(folder, monkeypatch):
    monkeypatch.chdir(folder)
    done = call("columns", "m.csv")
    # the name t alone does not say its unit
    assert 'time = { column = "t", unit = "s" }' in done.output
    assert "run = 1  # of 3, the clock starts again" in done.output
