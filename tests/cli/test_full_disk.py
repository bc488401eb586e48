"""Commands that write on a disk without room: one message with the user's file name, and no partial output."""

import multiprocessing
import os
import re
import shutil
import subprocess
import sys

from click.testing import CliRunner
from command_table import COMMANDS, with_target, write_inputs
from pytest import fixture, mark, param, skip

from historysim.cli import main

SIZE = 4 << 20  # bytes of the small file system
FILLER = "filler"
SOME = 8192  # free bytes in which a file is created and begun
# The log is the record of a run, kept on purpose; cells of a sweep that are complete are kept for
# the next attempt.
KEPT = re.compile(r"\w+\.history|\w+\.cells")
# One command for each library that writes: SQLite and HDF5, xarray, matplotlib, plain text, ZIP
# archives.
WRITERS = ("run", "table to netCDF", "plot", "fit", "fmu")


@fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    write_inputs(folder)
    return folder


@fixture(scope="module")
def small_disk(tmp_path_factory):
    """Mount an empty file system of `SIZE` bytes; only root may do so."""
    folder = tmp_path_factory.mktemp("disk")
    command = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "historysim-test", str(folder)]
    if (
        not shutil.which("mount")
        or subprocess.run(command, capture_output=True, check=False).returncode
    ):
        skip("a small file system can only be mounted by root on Linux")
    yield folder
    subprocess.run([shutil.which("umount"), str(folder)], check=True)


@fixture
def disk(small_disk, inputs):
    """Inputs on the small file system, which has nothing else on it."""
    for path in small_disk.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    shutil.copytree(inputs, small_disk, dirs_exist_ok=True)
    return small_disk


def fill(folder, room):
    """Write a file that leaves `room` bytes, to the page, on the disk of a folder."""
    with (folder / FILLER).open("wb") as stream:
        stream.write(bytes(shutil.disk_usage(folder).free - room))
    assert shutil.disk_usage(folder).free == room


def carry_out(folder, arguments, limit, answer):
    """Run a command in this process, with a limit of the size of files, and send its exit code and both streams."""
    import resource

    os.chdir(folder)
    os.environ["CFLAGS"] = "-O0"
    if limit is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    done = CliRunner().invoke(main, arguments)
    answer.send((done.exit_code, done.stdout, done.stderr))


def run_command(folder, arguments, limit=None):
    """Return exit code and both streams of a command in a forked process, which need not import anything again."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=carry_out, args=(folder, arguments, limit, theirs))
    process.start()
    theirs.close()
    assert ours.poll(120), "no answer"
    answer = ours.recv()
    process.join()
    return answer


def snapshot(folder):
    """Content of all files in a folder except the filler and what is kept on purpose."""
    return {
        path.name: path.read_bytes()
        for path in folder.iterdir()
        if path.is_file() and path.name != FILLER and not KEPT.fullmatch(path.name)
    }


def check_failure(done, name, reason, before, folder):
    __tracebackhide__ = True
    code, out, err = done
    shown = out + err
    assert code == 1, shown
    errors = [line for line in err.splitlines() if not line.startswith(("Note:", "replaying"))]
    assert len(errors) == 1, shown
    assert errors[0].startswith("Error: "), shown
    assert name in errors[0], shown
    assert reason in errors[0], shown
    assert ".part" not in errors[0], shown
    assert ".unfinished" not in errors[0], shown
    assert snapshot(folder) == before, shown


@mark.ci
@mark.parametrize("command", WRITERS)
def test_a_full_disk_is_reported_with_the_name_of_the_output(disk, command):
    arguments, suffix = COMMANDS[command]
    before = snapshot(disk)
    # larger outputs fail in the middle, small ones immediately
    fill(disk, SOME if command in {"run", "fmu"} else 0)
    done = run_command(disk, with_target(arguments, f"out{suffix}"))
    check_failure(done, "out", "disk is full", before, disk)


@mark.skipif(sys.platform == "win32", reason="needs RLIMIT_FSIZE")
@mark.parametrize("command", ["run", *(param(name, marks=mark.ci) for name in WRITERS[1:])])
def test_a_limit_of_the_size_of_files_is_reported_with_the_name_of_the_output(
    inputs, tmp_path, command
):
    arguments, suffix = COMMANDS[command]
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    before, limit = snapshot(tmp_path), 100
    done = run_command(tmp_path, with_target(arguments, f"out{suffix}"), limit)
    check_failure(done, "out", "file is too large", before, tmp_path)
