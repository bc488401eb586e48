"""Records that are several: runs in one table, by where the clock starts again or by a column, and each by itself."""

import numpy as np
import synthetic
from click.testing import CliRunner
from golden import refused
from pytest import approx, fixture, mark
from records import write_columns

import historysim as hs
from historysim.cli import main
from historysim.measured.loops import Loops
from historysim.scenario import schema
from historysim.studies.record_search import each_run
from historysim.tables import read_table

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


@fixture(scope="module")
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
    with refused(r"comes after .* if these are 3 runs, run = 1 to 3 in \[loading\]"):
        loaded(folder, "").measurement()


@mark.parametrize(
    "run, friction", [("run = 1", 0.2), ("run = 2", 0.15), ('run = 20\nruns_by = "Step"', 0.15)]
)
def test_one_run_is_taken(folder, run, friction):
    loops = hs.loops(loaded(folder, run))
    assert loops.statistics("friction_coefficient").mean == approx(friction, rel=0.01)
    assert any(
        label == "run" and text.endswith("one of 3 runs, 961 samples")
        for label, text in loops.remarks
    )


@mark.parametrize("by", ["", '\nruns_by = "Step"'])
def test_each_run_by_itself(folder, by):
    scenario = loaded(folder, f'run = "each"{by}')
    runs = each_run(scenario, hs.loops)
    assert [run.number for run in runs] == ([10, 20, 30] if by else [1, 2, 3])
    found = [run.result.statistics("friction_coefficient").mean for run in runs[:2]]
    assert found == approx(FRICTION[:2], rel=0.01)
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
    assert [line.split()[:2] for line in lines[:4]] == [
        ["run", "loops"],
        ["1", "2"],
        ["2", "2"],
        ["3", "–"],
    ]
    assert "the tangential displacement rests" in lines[4]
    done = call("loops", "e.toml", "-o", "l.nc")
    assert done.exit_code == 2
    assert "can only be written for one run; expected its number" in done.output
    done = call("sliding", "e.toml")
    assert done.exit_code == 2
    assert "none of 3 runs can be used" in done.output
    assert call("loops", "e.toml", "--set", "loading.run=2").exit_code == 0


# -- one file for each run
# ---------------------------------------------------------------------------

CYCLES = {"c10.csv": 40.0, "c2.csv": 30.0, "c1.csv": 1.0}  # amplitudes [µm]; 3 µm is full slip


def cycle(amplitude, count=200):
    """Displacement [µm] and load [N] of Mindlin's closed cycle from its upper end, with a limit of 14 N."""
    phase = np.linspace(0, 2 * np.pi, count, endpoint=False)
    moved = amplitude * np.cos(phase)
    top = 14 * (1 - (1 - min(amplitude / 3, 1)) ** 1.5)
    falls = phase < np.pi
    way = np.where(falls, amplitude - moved, moved + amplitude)
    load = top - 28 * (1 - np.clip(1 - way / 6, 0, 1) ** 1.5)
    return moved, np.clip(np.where(falls, load, -load), -14, 14)


@fixture(scope="module")
def cycles(tmp_path_factory):
    """Write a file for each cycle, with a clock that continues, and a picture; return the folder and the areas [J]."""
    folder, areas = tmp_path_factory.mktemp("cycles"), {}
    (folder / "c").mkdir()
    (folder / "c" / "notes.md").write_text("not a record", encoding="utf-8")
    for start, (name, amplitude) in enumerate(CYCLES.items()):
        moved, load = cycle(amplitude)
        time = start + np.arange(moved.size) / moved.size
        write_columns(folder / "c" / name, t=time, N=20e3 + 0 * time, u=1e3 * moved, T=1e3 * load)
        u, t = np.append(moved, moved[0]), np.append(load, load[0])
        areas[name] = 0.5e-6 * abs(np.sum(np.diff(u) * (t[1:] + t[:-1])))
    return folder, areas


LISTED = '["c/c10.csv", "c/c2.csv", "c/c1.csv"]\nrun = "each"'


@mark.parametrize(
    "files, names",
    [
        (LISTED, [*CYCLES]),
        ('"c/*.csv"', ["c1.csv", "c2.csv", "c10.csv"]),
        ('"c"', ["c1.csv", "c2.csv", "c10.csv"]),
        ('"c/c?.csv"', ["c1.csv", "c2.csv"]),
        ('"c/c10.csv"\nrun = "each"', ["c10.csv"]),
        ('"c/*.csv"\nrun = 3', ["c10.csv"]),
    ],
)
def test_each_file_is_a_run(files, names, cycles):
    folder, areas = cycles
    scenario = hs.load(write_files_scenario(folder, files))
    found = hs.loops(scenario)
    loops = [found] if isinstance(found, Loops) else [run.result for run in found]
    energy = [float(evaluated.dissipated_energy.sum()) for evaluated in loops]
    assert energy == approx([areas[name] for name in names], rel=1e-9)
    assert all(len(evaluated) == 1 for evaluated in loops)


def write_files_scenario(folder, files, name="s.toml"):
    text = (
        SCENARIO.replace('"m.csv"\nRUN', files)
        .replace("0.26", "0.7")
        .replace("334 mN/µm", "1 GN/m")
    )
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@mark.ci
@mark.filterwarnings("ignore:.*is its zero")
def test_all_verbs_accept_several_files(cycles, monkeypatch, tmp_path):
    folder, _ = cycles
    path = write_files_scenario(folder, '"c/*.csv"')
    monkeypatch.chdir(tmp_path)
    assert dict(hs.validate(path))["runs"].startswith("3;")
    ran, compared, fitted = (function(path) for function in (hs.run, hs.compare, hs.fit))
    assert {tuple(run.number for run in runs) for runs in (ran, compared, fitted)} == {(1, 2, 3)}
    assert [run.result.sizes["step"] for run in ran] == [200] * 3
    for command, files in (
        (("validate",), ()),
        (("run",), ("s_1.nc", "s_1.history", "s_3.nc")),
        (("loops", "--fretting"), ()),
        (("compare",), ("s_comparison_1.png", "s_comparison_3.png")),
        (("fit", "-q"), ("s_fitted_2.toml",)),
        (("report", "-o", "s_report.html"), ("s_report.html",)),
    ):
        done = call(command[0], str(path), *command[1:])
        assert done.exit_code == 0, done.output
        assert all((tmp_path / name).is_file() for name in files)
    report = (tmp_path / "s_report.html").read_text(encoding="utf-8")
    assert report.count("<h2>Run ") == 3
    again = hs.compare("s_fitted_2.toml")
    assert again.residuals.rms == approx(fitted[1].result.comparison.residuals.rms)


def test_a_set_of_files_is_checked(cycles, monkeypatch):
    folder, _ = cycles
    monkeypatch.chdir(folder)
    for files, problem in (
        ('"c/*.txt"', "no file has such a name"),
        ('"c/*.csv"\nrun = 4', "there is no run 4; expected one of 1, 2, 3"),
    ):
        with refused(rf"s.toml: loading\..*{problem}"):
            hs.loops(write_files_scenario(folder, files))
    scenario = hs.load(write_files_scenario(folder, '"c/*.csv"'))
    with refused('"each"; expected one of the runs 1, 2, 3'):
        scenario.measurement()
    assert set(scenario.files) == {folder / "s.toml", *(folder / "c" / name for name in CYCLES)}
    for arguments, written in (
        (["c/*.csv"], '"c/*.csv"'),
        (["c"], '"c"'),
        (["c/c1.csv", "c/c2.csv"], '["c/c1.csv", '),
    ):
        done = call("columns", *arguments)
        assert f"file = {written}" in done.output
        assert 'run = "each"' in done.output


def test_files_are_read_once(cycles, monkeypatch):
    folder, _ = cycles
    read = []

    def read_counted(path, *rest, **keys):
        read.append(path)
        return read_table(path, *rest, **keys)

    monkeypatch.setattr(schema, "read_table", read_counted)
    hs.fit(write_files_scenario(folder, LISTED))
    assert sorted(path.name for path in read) == sorted(CYCLES)


def test_columns_show_the_runs(folder, monkeypatch):
    monkeypatch.chdir(folder)
    done = call("columns", "m.csv")
    # the name t alone does not say its unit
    assert 'time = { column = "t", unit = "s" }' in done.output
    assert "run = 1  # of 3, the clock starts again" in done.output
