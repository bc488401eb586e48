"""Every command with every wrong kind of file: what was given, what was expected, exit code 2."""

import errno
import os
import shutil

import numpy as np
from click.testing import CliRunner
from pytest import fixture, mark

import historysim as hs
from historysim.cli import main

SCENARIO = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "sphere"
radius = 1.0
[friction]
coefficient = 0.5
[loading]
substeps = 8
waypoints = [
    { time = 0, normal_load = 0.01 },
    { time = 1, tangential_load = 0.003 },
    { time = 2, tangential_load = -0.003 },
    { time = 3, tangential_load = 0.003 },
    { time = 4, tangential_load = -0.003 },
]
"""
SQLITE, NETCDF, PICTURE = "is the log of a run", "is a netCDF or HDF5 file", "is a picture"
FOLDER, NONE, CIRCLE = "is a folder", "there is no such file", ""
# Files, and what a command has to call them where it expects others.
KINDS = {
    "a.toml": "is a scenario",
    "a.history": SQLITE,
    "a.nc": NETCDF,
    "loops.nc": NETCDF,
    "map.txt": "",
    "loads.csv": "",
    "picture.png": PICTURE,
    "book.xlsx": "is a ZIP archive",
    "folder": FOLDER,
    "empty": "",
    "none": NONE,
    "circle": CIRCLE,
}

LOG = "expected the log of a run"
TOML = "expected a scenario file (TOML)"
# One command for each function that opens files: its arguments, the files that it accepts, and what
# it expects.
COMMANDS = {
    "run": (["run", "FILE", "-o", "out.nc"], {"a.toml", "a.history", "a.nc"}, TOML),
    "verify": (
        ["verify", "FILE"],
        {"a.nc", "a.history"},
        "expected a result of historysim run, or a log",
    ),
    "verify --log": (["verify", "a.nc", "--log", "FILE"], {"a.history"}, LOG),
    "state": (["state", "FILE"], {"a.history"}, LOG),
    "compare": (["compare", "FILE"], set(), TOML),
    "show": (["show", "FILE"], {"a.toml", "a.history", "a.nc", "loops.nc"}, "expected"),
    "plot": (["plot", "FILE", "-o", "out.png"], {"a.toml", "a.nc", "loops.nc"}, "expected"),
    "loops": (["loops", "FILE"], {"a.nc"}, "expected"),
    "columns": (["columns", "FILE"], {"a.nc", "loops.nc", "map.txt", "loads.csv"}, "expected"),
}


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "a.toml").write_text(SCENARIO, encoding="utf-8")
    hs.run(folder / "a.toml", folder / "a.nc").close()
    for arguments in (
        ("loops", folder / "a.nc", "-o", folder / "loops.nc"),
        ("plot", folder / "a.nc"),
    ):
        assert call(*arguments).exit_code == 0
    (folder / "a.png").rename(folder / "picture.png")
    np.savetxt(folder / "map.txt", np.arange(64.0).reshape(8, 8))
    np.savez(folder / "book.npz", np.arange(3))
    (folder / "book.npz").rename(folder / "book.xlsx")
    (folder / "loads.csv").write_text("time,normal_load\n10,0.01\n", encoding="utf-8")
    (folder / "folder").mkdir()
    (folder / "empty").touch()
    (folder / "circle").symlink_to("circle")
    return folder


@fixture
def folder(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, symlinks=True, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@mark.parametrize("command", COMMANDS)
def test_a_wrong_file_is_named_with_its_type(folder, command):
    arguments, taken, expected = COMMANDS[command]
    for name in KINDS.keys() - taken:
        before = {path.name: path.is_file() and path.read_bytes() for path in folder.iterdir()}
        done = call(*(name if argument == "FILE" else argument for argument in arguments))
        said = f"{command} {name}: {done.output}"
        assert done.exit_code == 2, said
        assert isinstance(done.exception, SystemExit), said
        assert name in done.stderr, said
        # the first bytes of a result and of friction loops are alike
        told = not (command == "verify" and name == "loops.nc")
        if (
            expected != "expected"
            and told
            and name not in {"a.toml", "map.txt", "loads.csv", "empty", "circle"}
        ):
            assert KINDS[name] in done.stderr, said
            assert expected in done.stderr, said
        assert {
            path.name: path.is_file() and path.read_bytes() for path in folder.iterdir()
        } == before, said


@mark.parametrize(
    "arguments, asked_for",
    [
        (["run", "a.toml", "-o", "new.nc"], "new.history"),
        (["plot", "a.nc", "-o", "new.png"], "new.png"),
        (["state", "a.history", "-o", "new.nc"], "new.nc"),
    ],
)
def test_an_unwritable_output_is_named_by_its_given_path(folder, monkeypatch, arguments, asked_for):
    opened = os.open

    def refuse(path, flags, *arguments, **options):
        if flags & os.O_CREAT and not str(path).endswith("a.history"):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return opened(path, flags, *arguments, **options)

    before = sorted(path.name for path in folder.iterdir())
    monkeypatch.setattr(os, "open", refuse)
    done = call(*arguments)
    monkeypatch.undo()
    assert done.stderr.splitlines()[-1] == f"Error: {asked_for}: Permission denied"
    assert done.exit_code == 1
    assert sorted(path.name for path in folder.iterdir()) in (
        [*before],
        sorted([*before, ".new.nc.unfinished"]),
    )
