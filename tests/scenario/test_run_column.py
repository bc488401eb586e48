"""The column that numbers the runs of a file: found by its name and values, proposed, and noted where runs join."""

import numpy as np
from click.testing import CliRunner
from pytest import approx, fixture, mark

import historysim as hs
from historysim.cli import main
from historysim.studies.record_search import each_run
from historysim.tables import Format
from historysim.tables.run_column import find_run_column

CYCLES, FRICTION = (1, 10, 100, 1000, 10_000), (0.2, 0.3, 0.5, 0.7, 0.8)


def fretting_log(path, name="Cycle", cycles=CYCLES, samples=200, spring=5.0):
    """One closed period per stored cycle: a spring of 5 N/µm and a slider under 50 N, without a clock."""
    rows = []
    for cycle, friction in zip(cycles, FRICTION, strict=False):
        moved = 50 * np.sin(2 * np.pi * np.arange(2 * samples) / samples)
        load = np.zeros(2 * samples)
        for i in range(1, load.size):
            limit = friction * 50
            load[i] = np.clip(load[i - 1] + spring * (moved[i] - moved[i - 1]), -limit, limit)
        rows += [
            f"{cycle},{u:.4f},{t:.4f},50\n"
            for u, t in zip(moved[samples:], load[samples:], strict=True)
        ]
    header = f"{name},Displacement (µm),Tangential force (N),Normal force (N)\n"
    path.write_text(header + "".join(rows), encoding="utf-8")
    return path


@fixture
def proposed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fretting_log(tmp_path / "log.csv")
    result = CliRunner().invoke(main, ["columns", "log.csv", "-o", "s.toml"])
    assert result.exit_code == 0, result.output
    text = (tmp_path / "s.toml").read_text(encoding="utf-8")
    for key in ("first", "second", "radius"):
        text = text.replace(f"# {key} =", f"{key} =", 1)
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    return tmp_path / "s.toml"


def test_the_runs_of_a_fretting_log_are_proposed_and_each_closed_period_is_a_loop(proposed):
    assert 'runs_by = "Cycle"' in proposed.read_text(encoding="utf-8")
    assert hs.run(proposed).sizes["step"] == 200
    runs = each_run(hs.load(proposed, {"loading.run": "each"}), hs.loops)
    assert [run.number for run in runs] == list(CYCLES)
    measured = [run.result.statistics("friction_coefficient").mean for run in runs]
    assert measured == approx(FRICTION, abs=2e-4)
    # a rectangle less the two corners that the spring cuts off: 4 F (A - F/k)
    energy = [4 * 50 * mu * (50e-6 - 50 * mu / 5e6) for mu in FRICTION]
    assert [float(run.result.dissipated_energy[0]) for run in runs] == approx(energy, rel=5e-3)


def test_joined_runs_are_noted_and_the_note_names_the_key(proposed):
    text = proposed.read_text(encoding="utf-8")
    joined = "\n".join(line for line in text.splitlines() if not line.startswith("run"))
    proposed.write_text(joined, encoding="utf-8")
    remark = dict(hs.loops(proposed).remarks)["file"]
    assert "1, 10, 100, 1000, 10000" in remark
    assert 'add runs_by = "Cycle"' in remark
    result = CliRunner().invoke(main, ["run", str(proposed), "-o", "s.nc"])
    assert remark in result.stderr


@mark.parametrize(
    "name, cycles, expected",
    [
        ("Cycle No.", (1, 10, 100), (1, 10, 100)),
        ("Cycle", (1, 2, 3), None),  # these follow each other without a gap
        ("Cycle", (1, 10, 1), None),
        ("Recycling", (1, 10, 100), None),
    ],
)
def test_a_run_column_is_known_by_its_name_and_its_blocks(tmp_path, name, cycles, expected):
    found = find_run_column(fretting_log(tmp_path / "m.csv", name, cycles), Format())
    assert (found and found.numbers) == expected
