"""Sliding in one call, of whatever has some, and by the command."""

import numpy as np
import pytest
from click.testing import CliRunner
from records import scenario_text, write_columns

import historysim as hs
from historysim.cli import main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Ten micrometres of sliding under 1 N, along which friction falls."""
    u = np.linspace(0, 10_000, 201)
    friction = np.where(u < 100, 0.3 * u / 100, 0.2 + 0.1 * np.exp(-(u - 100) / 2000))
    write_columns(tmp_path / "m.csv", t=np.arange(u.size), N=np.ones(u.size), u=u, T=friction)
    (tmp_path / "s.toml").write_text(scenario_text(response={"tangential_load": '"T"'}), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments):
    return CliRunner().invoke(main, arguments)


def test_all_ways_lead_to_the_same_friction(folder):
    found = hs.sliding(folder / "s.toml")
    assert found.approach.steady == pytest.approx(0.2, abs=1e-3)
    assert found.approach.length == pytest.approx(2e-6, rel=1e-2)
    for record in (hs.load("s.toml"), hs.load("s.toml").measurement()):
        assert hs.sliding(record, windows=50).window_mean.tolist() == found.window_mean.tolist()
    history = hs.run("s.toml", "s.nc")
    simulated = hs.sliding(history)
    history.close()
    assert simulated.window_mean[5:] == pytest.approx(0.2)
    assert hs.sliding("s.nc").window_mean.tolist() == simulated.window_mean.tolist()


def test_the_command_says_writes_and_draws(folder):
    done = call("sliding", "s.toml", "--windows", "20", "-o", "mu.csv")
    assert done.exit_code == 0, done.output
    assert done.output.startswith("slides                  10 µm, in 20 windows of 500 nm\n")
    assert "\nsteady value            0.2 (95 %: 0.2 to 0.2" in done.output
    header, *rows = (folder / "mu.csv").read_text(encoding="utf-8").splitlines()
    assert header == "distance [m],coefficient,standard_deviation,count"
    assert len(rows) == 20
    assert call("sliding", "s.toml", "--over", "time", "-o", "mu.pdf").exit_code == 0
    assert (folder / "mu.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("m.csv",), "m.csv: is no scenario (.toml) and no result of historysim run"),
        (("s.toml", "-o", "mu.xlsx"), "mu.xlsx: .xlsx ending; expected .nc or .csv or .png or .pdf or .svg"),
        (("s.toml", "-o", "m.csv"), "m.csv: would overwrite what it is made from"),
        (("s.toml", "--windows", "0"), "s.toml: loading: windows is 0"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_bad_input_is_explained(arguments, said):
    done = call("sliding", *arguments)
    assert done.exit_code == 2
    assert said in done.output
