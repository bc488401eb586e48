"""Every command that writes, with every kind of target: nothing is replaced except an older output of the command."""

import os
import shutil
import socket
import stat

from click.testing import CliRunner
from command_table import COMMANDS, READING, with_target, write_inputs
from pytest import fixture, mark, raises

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError
from historysim.exchange.fmu import unit_file

pytestmark = mark.ci


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    write_inputs(folder)
    return folder


@fixture
def folder(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def content(folder):
    """Contents of a folder: of files their bytes, and of the rest its kind."""
    return {
        path.name: path.read_bytes()
        if path.is_file() and not path.is_symlink()
        else stat.S_IFMT(path.lstat().st_mode)
        for path in folder.iterdir()
    }


def refused(folder, command, target, *words):
    arguments = with_target(COMMANDS[command][0], target)
    before = content(folder)
    done = call(*arguments, *words)
    said = f"{command} {target}: {done.output}"
    assert done.exit_code == 2, said
    assert isinstance(done.exception, SystemExit), said
    assert target in done.stderr, said
    assert content(folder) == before, said
    return done.stderr


def test_all_commands_are_here():
    assert {arguments[0] for arguments, _ in COMMANDS.values()} | set(READING) == set(main.sources)


@mark.parametrize("command", ["run", "plot", "fmu"])
def test_targets_other_than_regular_files_are_refused(folder, command):
    ending = COMMANDS[command][1]
    os.mkfifo(folder / f"fifo{ending}")
    (folder / f"folder{ending}").mkdir()
    (folder / f"link{ending}").symlink_to("victim")
    (folder / "victim").write_text("whose", encoding="utf-8")
    (folder / f"dangling{ending}").symlink_to("nowhere")
    with socket.socket(socket.AF_UNIX) as there:
        there.bind(f"socket{ending}")
        for name, told in {
            "fifo": "FIFO",
            "folder": "folder",
            "link": "link",
            "dangling": "link",
        }.items():
            assert f"is a {told}" in refused(folder, command, f"{name}{ending}")
        assert "is a socket" in refused(folder, command, f"socket{ending}")
    assert "is a device" in refused(folder, command, "/dev/null")
    assert "none does not exist" in refused(folder, command, f"none/out{ending}")


@mark.parametrize("command", COMMANDS)
def test_inputs_and_foreign_files_are_not_replaced(folder, command):
    arguments, ending = COMMANDS[command]
    source = arguments[1] if arguments[1] != "." else "s.toml"
    # what scenarios of a gallery read is no page
    for name in {source, "m.csv"} if source == "s.toml" and arguments[0] != "gallery" else {source}:
        target = f"other_{name}{ending}"
        os.link(name, target)
        for forced in ([], ["--force"]):
            assert "would overwrite an input of the command" in refused(
                folder, command, target, *forced
            )
    (folder / f"link{ending}").symlink_to("victim")
    assert "is a link" in refused(folder, command, f"link{ending}")
    (folder / f"photo{ending}").write_bytes(b"\x89PNG, or whatever else somebody keeps here\r\n")
    assert "--force" in refused(folder, command, f"photo{ending}")
    assert "ending; expected" in refused(folder, command, "out.xyz")


# one command for each library or format that writes
@mark.parametrize("command", ["run", "table", "fit", "plot", "report", "fmu", "reduce"])
def test_an_older_output_of_the_same_command_is_replaced(folder, command, monkeypatch):
    monkeypatch.setattr(unit_file, "compile_unit", lambda *_: b"")
    arguments, ending = COMMANDS[command]
    target = folder / f"again{ending}"
    target.write_bytes(b"a photo")
    # what insists replaces anything
    for insists in (["--force"], []):
        done = call(*with_target(arguments, target), *insists)
        assert done.exit_code == 0, done.output
        assert target.read_bytes() != b"a photo"
    for path in folder.iterdir():
        assert not path.name.startswith("."), "nothing is left behind"


def test_python_keeps_the_same_rules(folder):
    before = content(folder)
    for output, told in (
        ("m.csv", "would overwrite"),
        ("s.toml", "would overwrite"),
        ("out.csv", "expected .nc"),
    ):
        with raises(InputError, match=told):
            hs.run("s.toml", output)
    (folder / "m.nc").write_bytes(b"measured")
    with raises(InputError, match="force=True"):
        hs.run("s.toml", "m.nc")
    (folder / "m.nc").unlink()
    assert content(folder) == before
    with raises(InputError, match="would overwrite"):
        hs.report("s.toml", "s.toml")


@mark.parametrize(
    "name, kind",
    [
        (".r.nc.unfinished", "symlink"),
        (".r.nc.unfinished", "hard link"),
        (".r.history.part", "symlink"),
    ],
)
def test_links_that_are_planted_are_not_followed(folder, name, kind):
    victim = folder / "victim"
    victim.write_text("whose", encoding="utf-8")
    (folder / name).symlink_to(victim) if kind == "symlink" else (folder / name).hardlink_to(victim)
    done = call("run", "s.toml", "-o", "r.nc")
    assert done.exit_code == 1, done.output
    assert f"{name} is" in done.stderr
    assert "remove it" in done.stderr
    assert victim.read_text(encoding="utf-8") == "whose"
