"""The command line: what it prints, what it writes, how it ends."""

import os
import subprocess
import sys

import h5py
import netCDF4
import numpy as np
import xarray as xr
from broken import (
    DOCUMENTS,
    FILES,
    LOADS_CSV,
    MEASURED,
    SUMMITS_CSV,
    broken_bytes,
    broken_documents,
    keep_small,
)
from click.testing import CliRunner, Result
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pytest import approx, fixture, mark

import historysim as hs
from historysim.cli import main

SCENARIO = """
title = "a ball"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
substeps = 10
waypoints = [{ time = 0, normal_load = "50 mN" }, { after = 1, tangential_load = "8 mN" }]
"""


@fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "ball.toml").write_text(SCENARIO, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def process(folder, *arguments, **options):
    command = [sys.executable, "-m", "historysim", *map(str, arguments)]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, **options
    )


def check_refusal(done, code, said):
    assert (done.exit_code if isinstance(done, Result) else done.returncode) == code
    assert done.stdout == ""
    assert done.stderr.count("Error: ") == 1
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def files(folder):
    return sorted(path.name for path in folder.iterdir())


# -- what it does ----------------------------------------------------------------------------------


def test_run_writes_the_result_here_and_prints_a_summary(folder):
    done = process(folder, "run", "ball.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert call("--version").output.endswith(f"version {hs.__version__}\n")
    lines = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert lines["steps"] == "11 over 1 s"
    assert lines["result"] == "ball.nc"
    assert "peak normal load          50 mN\n" in done.stdout
    assert "peak tangential load      8 mN\n" in done.stdout
    assert files(folder) == ["ball.history", "ball.nc", "ball.toml"]
    with netCDF4.Dataset(folder / "ball.nc") as result:
        assert result.title == "a ball"
        assert result["total_tangential_load"][-1] == approx(8e-3)


def test_run_draws_next_to_its_output_and_can_be_quiet(folder):
    (folder / "results").mkdir()
    done = call("run", "ball.toml", "-o", "results/out.nc", "--plot", "-o", "other.pdf")
    assert done.exit_code == 0
    assert files(folder / "results") == ["out.history", "out.nc", "out.png"]
    assert (folder / "results/out.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "other.pdf").read_bytes().startswith(b"%PDF")
    written = [
        ["result", "results/out.nc"],
        ["picture", "results/out.png"],
        ["picture", "other.pdf"],
    ]
    assert [line.split() for line in done.output.splitlines()[-3:]] == written
    done = call("run", "ball.toml", "--quiet")
    assert (done.exit_code, done.output) == (0, "")


def test_validate_reads_and_writes_nothing(folder):
    done = call("validate", "ball.toml")
    assert done.exit_code == 0
    assert "loads  2 events over 1 s, which can be carried out\n" in done.output
    assert done.output.endswith("valid\n")
    shown = call("show", "ball.toml").output
    assert "asperities           1\n" in shown
    assert "events               2 over 1 s\n" in shown
    assert files(folder) == ["ball.toml"]


@mark.usefixtures("folder")
@mark.filterwarnings("default::historysim.errors.UnlikelyValueWarning")
def test_moduli_that_are_hardly_meant_are_noted():
    glass = 'materials.second={ name = "glass", youngs_modulus = 64, poissons_ratio = 0.2 }'
    done = call("validate", "ball.toml", "--set", glass)
    assert done.exit_code == 0
    assert done.stderr.startswith("Note: Material: youngs_modulus is 64 Pa, which is implausible: ")
    assert "Warning" not in done.output


@mark.parametrize("command", ["validate", "show", "run", "plot", "compare", "loops", "fit"])
def test_every_command_accepts_other_values_for_a_scenario(folder, command):
    before = files(folder)
    said = "ball.toml: friction.coefficent: unknown key; did you mean 'coefficient'?"
    check_refusal(call(command, "ball.toml", "--set", "friction.coefficent=0.3"), 2, said)
    check_refusal(call(command, "ball.toml", "--set", "0.3"), 2, "--set '0.3': expected KEY=VALUE")
    assert files(folder) == before


def test_other_values_change_the_result(folder):
    values = (
        "--set",
        "friction.coefficient=0.3",
        "--set",
        "loading.waypoints[0].normal_load=60 mN",
    )
    assert call("run", "ball.toml", "-q", *values).exit_code == 0
    with xr.open_dataset("ball.nc", decode_times=False) as history:
        assert history.friction.values == [0.3]
        assert history.total_normal_load.values[-1] == approx(60e-3, rel=1e-12)
        (folder / "told.toml").write_text(history.attrs["scenario"], encoding="utf-8")
        assert history.drop_attrs().identical(hs.run("told.toml").drop_attrs())
    said = "ball.nc: is not a scenario (.toml), so --set does not apply"
    check_refusal(call("show", "ball.nc", "--set", "friction.coefficient=0.3"), 2, said)


def test_a_sweep_runs_and_continues(folder):
    check_refusal(call("sweep", "ball.toml"), 2, "ball.toml: has no [sweep]; expected one")
    over = '[sweep]\noutputs = ["preliminary_displacement"]\n[sweep.over]\nfriction.coefficient = [0.2, -0.3, 0.4]\n'
    (folder / "ball.toml").write_text(SCENARIO + over, encoding="utf-8")
    radii = ("--set", 'sweep.over."surface.radius"=["1 mm", "2 mm"]')
    assert (
        "6 cells: 3 of friction.coefficient × 2 of surface.radius"
        in call("validate", "ball.toml", *radii).output
    )
    unclosed = ("--set", 'sweep.over."surface.radius=[1]')
    check_refusal(call("validate", "ball.toml", *unclosed), 2, "expected KEY=VALUE")
    done = call("sweep", "ball.toml", "--workers", 1)
    assert done.exit_code == 0
    assert (
        "cell 1 (friction.coefficient = -0.3) failed: ball.toml: friction.coefficient: -0.3; expected"
        in done.output
    )
    assert files(folder) == ["ball.cells", "ball.nc", "ball.toml"]
    cells = {path: path.stat().st_mtime_ns for path in (folder / "ball.cells").glob("*.cell")}
    assert (
        call(
            "sweep", "ball.toml", "-o", "t.csv", "--store", "ball.cells", "-q", "--workers", 1
        ).exit_code
        == 0
    )
    assert {
        path: path.stat().st_mtime_ns for path in (folder / "ball.cells").glob("*.cell")
    } == cells
    assert "friction.coefficient of the scenario" in call("show", "ball.nc").output
    wrong = over.replace("preliminary_displacement", "prelim")
    (folder / "ball.toml").write_text(SCENARIO + wrong, encoding="utf-8")
    for command in ("validate", "sweep"):
        check_refusal(call(command, "ball.toml"), 2, "ball.toml: sweep.outputs[0]: 'prelim'; ")


def test_a_design_is_sought_and_checked_beforehand(folder):
    section = '[design]\nkey = "surface.radius"\nbetween = ["0.1 mm", "10 mm"]\ntarget = "20 nm"\n'
    (folder / "ball.toml").write_text(
        SCENARIO + section + 'output = "preliminary_displacement"\n', encoding="utf-8"
    )
    assert call("validate", "ball.toml").exit_code == 0
    for command in ("validate", "design"):
        wrong = ("--set", "design.key=surface.radios")
        check_refusal(call(command, "ball.toml", *wrong), 2, "radios: unknown key")
    done = call("design", "ball.toml", "--workers", 1, "-o", "found.csv")
    assert done.exit_code == 0
    assert "preliminary_displacement of 20 nm" in done.output
    assert (folder / "found.csv").read_text(encoding="utf-8").count("\n") == 2


@mark.usefixtures("folder")
def test_show_tells_a_scenario_from_a_result():
    assert call("run", "ball.toml").exit_code == 0
    scenario, result = call("show", "ball.toml"), call("show", "ball.nc")
    assert (scenario.exit_code, result.exit_code) == (0, 0)
    assert "substeps             10\n" in scenario.output
    assert "peak normal load          50 mN\n" in result.output
    assert len(result.output.splitlines()) <= 10
    assert "event_digest" in call("show", "ball.nc", "--attributes").output
    assert "[loading]" not in result.output


def test_plot_draws_next_to_the_result_or_to_a_given_path(folder):
    assert call("run", "ball.toml", "-q").exit_code == 0
    assert call("plot", "ball.nc").output == "ball.png\n"
    assert call("plot", "ball.nc", "-o", "loop.PDF").exit_code == 0
    assert (folder / "loop.PDF").read_bytes().startswith(b"%PDF")
    assert files(folder) == ["ball.history", "ball.nc", "ball.png", "ball.toml", "loop.PDF"]


def test_a_height_map_is_shown_and_drawn(folder):
    np.savetxt(folder / "map.txt", np.pad([[4.0]], 2))
    units = ("--pixel-size", "2 µm", "--height-unit", "nm", "--form", "mean")
    lines = dict(
        line.split("  ", 1) for line in call("show", "map.txt", *units).output.splitlines()
    )
    found = {key: value.strip() for key, value in lines.items()}
    assert found["points"] == "5 × 5, 2 µm apart"
    assert found["height range Rz"] == "4 nm"
    drawn = call("plot", "map.txt", *units)
    assert drawn.stdout == "map_surface.png\n"
    assert drawn.stderr == "Note: map_surface.png: no asperity distribution: 1 summit\n"


def test_how_adhesive_a_scenario_is(folder):
    check_refusal(
        call("plot", "ball.toml", "--picture", "adhesion-map"), 2, "ball.toml: has no [adhesion]"
    )
    text = SCENARIO.replace("[loading]", '[adhesion]\nequilibrium_separation = "0.2 nm"\n[loading]')
    (folder / "ball.toml").write_text(text, encoding="utf-8")
    assert (
        "adhesion regimes     1 JKR, where the asperities are pressed most\n"
        in call("show", "ball.toml").output
    )
    assert (
        call("plot", "ball.toml", "--picture", "adhesion-map").output == "ball_adhesion-map.png\n"
    )


@mark.usefixtures("folder")
@mark.parametrize(
    "command, option, replacement",
    [
        *(
            ("plot", f"--{name}", f"--with {name}=")
            for name in ("steps", "across", "labels", "panels")
        ),
        ("plot", "--adhesion", "--picture adhesion-map"),
        *((name, "--picture", "-o NAME.png") for name in ("run", "loops", "fit", "reduce")),
        ("loops", "--plot", "-o NAME.png"),
        ("show", "-v", "--attributes"),
    ],
)
def test_a_removed_option_names_its_replacement(command, option, replacement):
    said = f"No such option: {option}. Expected {replacement}"
    check_refusal(call(command, "ball.toml", option, "x"), 2, said)


def test_loops_are_written_drawn_and_read_again(folder):
    swings = ", ".join(
        f'{{ after = 1, tangential_displacement = "{(-1) ** turn * 100} nm" }}' for turn in range(5)
    )
    text = SCENARIO.replace('{ after = 1, tangential_load = "8 mN" }', swings)
    (folder / "ball.toml").write_text(text, encoding="utf-8")
    assert call("run", "ball.toml", "-q").exit_code == 0
    done = call("loops", "ball.nc", "-o", "l.nc", "--levels", "n.nc", "-o", "p.png")
    assert done.output.splitlines()[-3:] == ["l.nc", "p.png", "n.nc"]
    assert call("loops", "ball.nc", "-o", "l.csv", "-o", "p.svg").output.splitlines()[-2:] == [
        "l.csv",
        "p.svg",
    ]
    header, *rows = (folder / "l.csv").read_text(encoding="utf-8").splitlines()
    column = header.split(",").index("friction_force forward [N]")
    with xr.open_dataset(folder / "l.nc") as written:
        forces = [float(row.split(",")[column]) for row in rows]
        assert written.friction_force.values[:, 0].tolist() == forces
    assert "friction force" in call("show", "l.nc").output
    assert "50 mN" in call("show", "n.nc").output
    said = "l.xlsx: .xlsx ending; expected .nc or .csv or .png or .pdf or .svg"
    check_refusal(call("loops", "ball.nc", "-o", "l.xlsx"), 2, said)
    check_refusal(
        call("loops", "l.nc"),
        2,
        "l.nc: is neither a scenario (.toml) nor a result of historysim run",
    )


@mark.skipif(os.geteuid() == 0, reason="a folder keeps nothing from the superuser")
def test_a_picture_that_may_not_be_written_is_named_as_it_was_asked_for(folder):
    (folder / "locked").mkdir(mode=0o500)
    check_refusal(
        call("plot", "ball.toml", "-o", "locked/p.png"), 1, "Error: locked/p.png: Permission denied"
    )


def test_the_columns_of_a_file_are_listed(folder):
    (folder / "loads.csv").write_text("t (s);F (kN)\n0,0;1,5\n0,5;2,5\n", encoding="utf-8")
    done = call("columns", "loads.csv", "--decimal", ",")
    assert done.exit_code == 0
    assert '"F (kN)"  kN    2       1,5' in done.output.splitlines()
    assert 'tangential_load = "F (kN)"' in done.output.splitlines()
    check_refusal(call("columns", "nothing.csv"), 2, "nothing.csv: there is no such file")
    check_refusal(call("columns", "loads.csv", "--decimal", "x"), 2, "decimal")


SLOW_IMPORTS = {"xarray", "pandas", "pint", "scipy", "dask", "matplotlib", "h5py"}


@mark.ci
@mark.parametrize(
    "command, heavy",
    [
        (["--help"], {"numpy", "xarray", "matplotlib"}),
        # it is asked often, of files that are being written; the compiler alone takes longer than
        # the check
        (["validate", "ball.toml"], {"scipy", "xarray", "matplotlib", "netCDF4"}),
        # importing them would take as long as a small run
        (["run", "ball.toml"], SLOW_IMPORTS),
        (["show", "--attributes", "result.nc"], SLOW_IMPORTS),
        (["show", "result.history"], SLOW_IMPORTS),
    ],
)
def test_a_command_imports_nothing_heavy_that_it_does_not_use(folder, command, heavy):
    if command[-1].startswith("result"):
        call("run", "ball.toml", "-q", "-o", "result.nc")
    code = (
        "import sys\n"
        "from historysim.cli import main\n"
        f"try:\n    main({command}, standalone_mode=False)\n"
        f"finally:\n    print({heavy} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "set()\n")
    assert bool(done.stdout) is ("-q" not in command)
    assert (folder / "ball.nc").exists() is (command[0] == "run")


# -- the log ---------------------------------------------------------------------------------------


@fixture
def ran(folder):
    assert call("run", "ball.toml", "-q", "--snapshot-every", "3").exit_code == 0
    return folder


@mark.usefixtures("ran")
def test_a_result_and_its_log_are_verified():
    done = call("verify", "ball.nc")
    assert (done.exit_code, done.output) == (
        0,
        "ball.nc  is bit-identical to the replay of its log\n",
    )
    done = call("verify", "ball.history")
    assert done.exit_code == 0
    assert "events     2, sound\n" in done.output
    assert "ball.history" not in call("verify", "ball.nc", "-q").output
    assert "events               " not in call("show", "ball.history").output
    assert "digest" in call("show", "ball.history").output


def test_a_changed_result_is_reported_where(ran):
    with netCDF4.Dataset(ran / "ball.nc", "a") as result:
        result["total_tangential_load"][4] = 1.0
    done = call("verify", "ball.nc")
    check_refusal(
        done,
        1,
        "ball.nc: differs from the replay of its log:\n  total_tangential_load: 1 values differ, first at step 4",
    )
    (ran / "ball.history").unlink()
    check_refusal(call("verify", "ball.nc"), 2, "ball.nc: its log ball.history is not there")


def test_the_state_is_reported_at_any_time(ran):
    done = call("state", "ball.history", "--at", "0.5 s")
    assert done.exit_code == 0
    assert "normal load              50 mN\n" in done.output
    assert "tangential load          4 mN\n" in done.output
    assert "tangential load          8 mN\n" in call("state", "ball.history").output
    assert "Note" not in done.output
    after = call("state", "ball.history", "--at", "200 s").output
    assert "ball.history: its last event is at 1 s; this is the state after it" in after
    assert call("state", "ball.history", "--at", "0.5", "-o", "all.nc").output.endswith("all.nc\n")
    with netCDF4.Dataset(ran / "all.nc") as all_asperities:
        assert all_asperities["tangential_load"][0, 0] == approx(4e-3)
        assert all_asperities["time"][0] == 0.5
    done = call("state", "ball.history", "--asperity", "0", "-o", "traction.png")
    assert "slip state         partial slip\n" in done.output
    assert "reversal point  radius" in done.output
    assert (ran / "traction.png").read_bytes().startswith(b"\x89PNG")


def test_a_log_is_listed_and_a_fork_of_it_is_run(ran):
    with hs.EventLog("ball.history") as log, log.fork(0.5, "fork.history") as fork:
        fork.append(hs.TangentialLoad(2.0, -6e-3))
    listed = call("log", "fork.history").output.splitlines()
    assert listed[0].split() == ["event", "time", "kind", "value"]
    assert listed[1].split() == ["0", "0", "s", "normal_load", "0.05", "N"]
    assert listed[4].split() == ["3", "2", "s", "tangential_load", "-0.006", "N"]
    assert call("run", "fork.history", "-q").exit_code == 0
    assert call("verify", "fork.nc").exit_code == 0
    with netCDF4.Dataset(ran / "fork.nc") as result:
        assert result["total_tangential_load"][-1] == approx(-6e-3)
    assert call("log", "fork.history", "--from", "0.4 s", "--to", "1").output.count("\n") == 3
    assert call("log", "fork.history", "--last", "1").output.splitlines()[1].startswith("3 ")


def test_a_run_is_resumed_from_its_log(ran):
    (ran / "ball.nc").unlink()
    done = call("run", "ball.toml", "--resume", "--compression", "zlib")
    assert done.exit_code == 0
    assert "Note: ball.history: has no snapshot with its rows" in done.stderr
    assert call("verify", "ball.nc").exit_code == 0


@mark.parametrize(
    "arguments, said",
    [
        (["state", "good.history", "--at", "noon"], "--at: 'noon'"),
        (["log", "good.history", "--kind", "load"], "--kind load: expected one of normal_load"),
        (["run", "ball.toml", "-o", "x.history"], "x.history: is the name of a log"),
        (["run", "ball.toml", "--snapshot-every", "0"], "snapshot_every is"),
        (["plot", "good.history"], "good.history: is a log; expected its result"),
    ],
)
def test_invalid_queries_of_a_log_get_code_2(with_results, monkeypatch, arguments, said):
    monkeypatch.chdir(with_results)
    before = files(with_results)
    check_refusal(call(*arguments), 2, said)
    assert files(with_results) == before


def test_a_log_that_is_being_written_is_reported(ran):
    from historysim.log.file import LogFile

    with LogFile(ran / "ball.history", write=True):
        said = "ball.history: another process is writing it; wait until it is done"
        check_refusal(process(ran, "run", "ball.toml"), 1, said)
        assert call("log", "ball.history").exit_code == 0


# -- how it ends when it cannot --------------------------------------------------------------------


def test_a_run_that_fails_keeps_the_older_result(folder):
    (folder / "ball.toml").write_text(SCENARIO.replace("8 mN", "12 mN"), encoding="utf-8")
    with h5py.File(folder / "ball.nc", "w") as file:
        file.attrs["historysim_version"] = "an older one"
    older = (folder / "ball.nc").read_bytes()
    check_refusal(
        call("run", "ball.toml", "--plot"),
        1,
        "Error: ball.toml: loading.waypoints[1]: event 1 at t = 1 s: ",
    )
    # the log of loads beyond the limit can be queried
    assert files(folder) == ["ball.history", "ball.nc", "ball.toml"]
    assert (folder / "ball.nc").read_bytes() == older


@fixture(scope="module")
def with_results(tmp_path_factory):
    """A folder with a scenario, a result, and files that are none."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "ball.toml").write_text(SCENARIO, encoding="utf-8")
    (folder / "map.txt").write_text("0 1 0\n1 5 1\n0 1 0\n", encoding="utf-8")
    hs.run(folder / "ball.toml", folder / "good.nc").close()
    return folder


PIXEL = ("--pixel-size", "1 µm", "--height-unit", "nm")


@mark.parametrize(
    "arguments, said",
    [
        (
            ["run", "ball.toml", "-o", "./../{name}/ball.toml"],
            "would overwrite an input of the command",
        ),
        (
            ["plot", "good.nc", "--step", "two"],
            "step 'two' is not a named state of the history; expected a number",
        ),
        (["show", "map.txt"], "map.txt: does not name the unit of its heights; give height_unit"),
        (["show", "map.txt", *PIXEL, *PIXEL, *PIXEL], "--pixel-size given 3 times"),
        (
            ["show", "ball.toml", *PIXEL],
            "pixel_size, height_unit: ball.toml is a scenario; expected a height map",
        ),
        (["plot", "good.nc", "--with", "what=1"], "is not an option of a picture"),
    ],
)
def test_bad_input_gets_code_2_and_one_message(with_results, monkeypatch, arguments, said):
    monkeypatch.chdir(with_results)
    before = files(with_results)
    check_refusal(
        call(*[argument.format(name=with_results.name) for argument in arguments]), 2, said
    )
    assert files(with_results) == before


@mark.parametrize(
    "raised, code, said",
    [
        (
            OSError(28, "No space left on device", "ball.nc"),
            1,
            "Error: ball.nc: the disk is full (No space left",
        ),
        (PermissionError(13, "Permission denied"), 1, "Error: Permission denied\n"),
        (MemoryError(), 1, "Error: not enough memory; record fewer asperities"),
        (KeyboardInterrupt(), 130, "Error: interrupted; unfinished output is discarded\n"),
        (
            KeyboardInterrupt("interrupted; a.history keeps"),
            130,
            "Error: interrupted; a.history keeps\n",
        ),
    ],
)
def test_errors_of_the_system_end_with_a_message(folder, monkeypatch, raised, code, said):
    def fail(*_, **__):
        raise raised

    monkeypatch.setattr("historysim.scenario.run.write", fail)
    done = call("run", "ball.toml")
    assert done.exit_code == code
    assert said in done.stderr
    assert files(folder) == ["ball.toml"]


def test_a_picture_that_fails_leaves_nothing_behind(folder, monkeypatch):
    from matplotlib.figure import Figure

    def fail(_, name, **__):
        name.write_bytes(b"half a picture")
        raise OSError(28, "No space left on device", str(name))

    monkeypatch.setattr(Figure, "savefig", fail)
    assert call("run", "ball.toml", "--plot").exit_code == 1
    assert files(folder) == ["ball.history", "ball.nc", "ball.toml"]


fuzz = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@fixture
def short_runs(folder, monkeypatch):
    keep_small(monkeypatch)
    return folder


def check_that_it_ends_well(folder, files_to_write):
    for path in folder.iterdir():
        path.unlink()
    for name, content in files_to_write.items():
        (folder / name).write_bytes(content)
    done = call("run", "s.toml")
    assert done.exit_code in {0, 1, 2}
    if done.exit_code:
        # a note on the surface may come before
        first = next(line for line in done.stderr.splitlines() if not line.startswith("Note: "))
        assert first.startswith("Error: ")
        assert "Traceback" not in done.stderr
    written = {0: ["s.history", "s.nc"], 1: ["s.history"], 2: []}
    assert files(folder) == sorted([*files_to_write, *written[done.exit_code]])


@fuzz
@given(document=st.one_of(broken_documents(), broken_bytes(DOCUMENTS)))
def test_broken_scenarios_end_with_a_message_and_no_file(short_runs, document):
    tables = {name: content.encode() for name, content in FILES.items()}
    check_that_it_ends_well(short_runs, {"s.toml": document, **tables})


@fuzz
@given(summits=broken_bytes([SUMMITS_CSV]), loads=broken_bytes([LOADS_CSV]))
def test_broken_tables_end_with_a_message_and_no_file(short_runs, summits, loads):
    files_to_write = {"s.toml": MEASURED.encode(), "summits.csv": summits, "loads.csv": loads}
    check_that_it_ends_well(short_runs, files_to_write)
