"""Every command that writes, with every kind of target: nothing is replaced that is not an older output of its own."""

import os
import shutil
import socket
import stat

import numpy as np
import pytest
from click.testing import CliRunner

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError

SCENARIO = """
[materials]
contact_modulus = 1e10
shear_modulus = 2.5e9
[surface]
kind = "sphere"
radius = "1 mm"
[friction]
coefficient = 0.5
[loading]
file = "m.csv"
[loading.columns]
time = "t"
normal_load = { column = "Fn", unit = "mN" }
tangential_displacement = { column = "x", unit = "nm" }
[loading.response]
tangential_load = { column = "Ft", unit = "mN" }
[fit]
parameters = ["friction"]
[sweep.over]
friction.coefficient = [0.4, 0.5]
[design]
key = "friction.coefficient"
between = [0.1, 1.0]
target = "10 nm"
output = "preliminary_displacement"
"""
# Arguments of each command that writes, and an ending that it knows.
COMMANDS = {
    "run": (["run", "s.toml", "-o", "TARGET"], ".nc"),
    "run --picture": (["run", "s.toml", "-o", "new.nc", "--picture", "TARGET"], ".png"),
    "sweep": (["sweep", "s.toml", "-o", "TARGET", "--workers", "1"], ".nc"),
    "sweep to CSV": (["sweep", "s.toml", "-o", "TARGET", "--workers", "1"], ".csv"),
    "design": (["design", "s.toml", "-o", "TARGET", "--workers", "1"], ".csv"),
    "state": (["state", "r.history", "-o", "TARGET"], ".nc"),
    "state of one": (["state", "r.history", "--asperity", "0", "-o", "TARGET"], ".png"),
    "fork": (["fork", "r.history", "--at", "10", "-o", "TARGET"], ".history"),
    "log": (["log", "r.history", "--csv", "TARGET"], ".csv"),
    "table": (["table", "r.nc", "first-slips", "-o", "TARGET"], ".csv"),
    "table to netCDF": (["table", "r.nc", "time-series", "-o", "TARGET"], ".nc"),
    "loops": (["loops", "s.toml", "-o", "TARGET"], ".csv"),
    "loops --levels": (["loops", "s.toml", "--levels", "TARGET"], ".nc"),
    "loops --picture": (["loops", "s.toml", "--picture", "TARGET"], ".svg"),
    "compare": (["compare", "s.toml", "-o", "TARGET"], ".png"),
    "fit": (["fit", "s.toml", "-o", "TARGET"], ".toml"),
    "fit --picture": (["fit", "s.toml", "-o", "new.toml", "--picture", "TARGET"], ".pdf"),
    "sliding": (["sliding", "s.toml", "-o", "TARGET"], ".csv"),
    "creep": (["creep", "h.toml", "-o", "TARGET"], ".png"),
    "plot": (["plot", "r.nc", "-o", "TARGET"], ".pdf"),
    "plot moving": (["plot", "r.nc", "-o", "TARGET"], ".gif"),
    "report": (["report", "r.nc", "-o", "TARGET"], ".html"),
    "gallery": (["gallery", ".", "-o", "TARGET", "--workers", "1"], ".html"),
    "fmu": (["fmu", "s.toml", "-o", "TARGET"], ".fmu"),
    "reduce": (["reduce", "s.toml", "--elements", "4", "-o", "TARGET"], ".json"),
    "reduce --picture": (["reduce", "s.toml", "--elements", "4", "-o", "new.json", "--picture", "TARGET"], ".png"),
}
WRITES_NO_OTHER = {"validate", "show", "columns", "verify", "append", "kinds"}


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    turns = np.array([0, 60, -60, 60, -60, 60, -60, 60])
    x = np.interp(np.arange(0, 70, 1.0), np.arange(0, 80, 10.0), turns)
    load = np.clip(np.cumsum(np.diff(x, prepend=0)) * 0.05, -5, 5)
    rows = [f"{t},10,{xi},{force}" for t, (xi, force) in enumerate(zip(x, load, strict=True))]
    (folder / "m.csv").write_text("\n".join(["t,Fn,x,Ft", *rows]) + "\n", encoding="utf-8")
    (folder / "s.toml").write_text(SCENARIO, encoding="utf-8")
    # strokes with holds at their ends
    strokes = [np.append(np.linspace(-end, end, 10), np.full(40, end)) for end in np.tile([60.0, -60.0], 4)]
    x = np.concatenate([[0.0], *strokes])
    rows = [f"{t},10,{xi},{np.clip(xi * 0.05, -3, 3)}" for t, xi in enumerate(x)]
    (folder / "h.csv").write_text("\n".join(["t,Fn,x,Ft", *rows]) + "\n", encoding="utf-8")
    held = SCENARIO.partition("[sweep.over]")[0].replace("m.csv", "h.csv")
    (folder / "h.toml").write_text(held, encoding="utf-8")
    hs.run(folder / "s.toml", folder / "r.nc").close()
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def content(folder):
    """What stands in a folder: of files their bytes, and of the rest its kind."""
    return {
        path.name: path.read_bytes() if path.is_file() and not path.is_symlink() else stat.S_IFMT(path.lstat().st_mode)
        for path in folder.iterdir()
    }


def refused(folder, command, target, *words):
    arguments = [target if argument == "TARGET" else argument for argument in COMMANDS[command][0]]
    before = content(folder)
    done = call(*arguments, *words)
    said = f"{command} {target}: {done.output}"
    assert done.exit_code == 2, said
    assert isinstance(done.exception, SystemExit), said
    assert target in done.stderr, said
    assert content(folder) == before, said
    return done.stderr


def test_all_commands_are_here():
    assert {arguments[0] for arguments, _ in COMMANDS.values()} | WRITES_NO_OTHER == set(main.found)


@pytest.mark.parametrize("command", ["run", "state of one", "fork", "table", "plot", "fmu", "reduce"])
def test_what_is_no_regular_file_is_refused(folder, command):
    ending = COMMANDS[command][1]
    os.mkfifo(folder / f"fifo{ending}")
    (folder / f"folder{ending}").mkdir()
    (folder / f"link{ending}").symlink_to("victim")
    (folder / "victim").write_text("whose", encoding="utf-8")
    (folder / f"dangling{ending}").symlink_to("nowhere")
    with socket.socket(socket.AF_UNIX) as there:
        there.bind(f"socket{ending}")
        for name, told in {"fifo": "FIFO", "folder": "folder", "link": "link", "dangling": "link"}.items():
            assert f"is a {told}" in refused(folder, command, f"{name}{ending}")
        assert "is a socket" in refused(folder, command, f"socket{ending}")
    assert "is a device" in refused(folder, command, "/dev/null")
    assert "there is no folder" in refused(folder, command, f"none/out{ending}")


@pytest.mark.parametrize("command", COMMANDS)
def test_neither_what_is_read_nor_what_somebody_else_wrote_is_replaced(folder, command):
    arguments, ending = COMMANDS[command]
    source = arguments[1] if arguments[1] != "." else "s.toml"
    # what scenarios of a gallery read is no page
    for name in {source, "m.csv"} if source == "s.toml" and arguments[0] != "gallery" else {source}:
        target = f"other_{name}{ending}"
        os.link(name, target)
        for forced in ([], ["--force"]):
            assert "would overwrite what it is made from" in refused(folder, command, target, *forced)
    (folder / f"link{ending}").symlink_to("victim")
    assert "is a link" in refused(folder, command, f"link{ending}")
    (folder / f"photo{ending}").write_bytes(b"\x89PNG, or whatever else somebody keeps here\r\n")
    assert "--force" in refused(folder, command, f"photo{ending}")
    assert "ending; expected" in refused(folder, command, "out.xyz")


# each kind of file once in every run of the tests, and other ways to the same kind in the slow one
OTHERS = {"run --picture", "sweep to CSV", "state of one", "loops --picture", "fit --picture", "reduce --picture"}
OTHERS |= {"loops --levels", "table to netCDF", "gallery", "creep"}
ALSO = [
    pytest.param(each, marks=[pytest.mark.slow] if each in OTHERS else [])
    for each in COMMANDS
    if each not in {"sliding", "plot moving", "log"}
]


@pytest.mark.parametrize("command", ALSO)
def test_an_older_output_of_its_own_is_replaced(folder, command, monkeypatch):
    monkeypatch.setenv("CFLAGS", "-O0")
    arguments, ending = COMMANDS[command]
    target = folder / f"again{ending}"
    target.write_bytes(b"a photo")
    # what insists replaces anything
    for insists in (["--force"], []):
        done = call(*(target if each == "TARGET" else each for each in arguments), *insists)
        assert done.exit_code == 0, done.output
        assert target.read_bytes() != b"a photo"
    for path in folder.iterdir():
        assert not path.name.startswith("."), "nothing is left behind"


def test_python_keeps_the_same_rules(folder):
    before = content(folder)
    for output, told in (("m.csv", "would overwrite"), ("s.toml", "would overwrite"), ("out.csv", "expected .nc")):
        with pytest.raises(InputError, match=told):
            hs.run("s.toml", output)
    (folder / "m.nc").write_bytes(b"measured")
    with pytest.raises(InputError, match="force=True"):
        hs.run("s.toml", "m.nc")
    (folder / "m.nc").unlink()
    assert content(folder) == before
    with pytest.raises(InputError, match="would overwrite"):
        hs.report("s.toml", "s.toml")


@pytest.mark.parametrize("name", [".r.nc.unfinished", ".r.history.part", ".r.nc.lock"])
@pytest.mark.parametrize("kind", ["symlink", "hard link"])
def test_links_that_are_planted_are_not_followed(folder, name, kind):
    victim = folder / "victim"
    victim.write_text("whose", encoding="utf-8")
    (folder / name).symlink_to(victim) if kind == "symlink" else (folder / name).hardlink_to(victim)
    done = call("run", "s.toml", "-o", "r.nc")
    assert done.exit_code == 1, done.output
    assert f"{name} is" in done.stderr
    assert "remove it" in done.stderr
    assert victim.read_text(encoding="utf-8") == "whose"
