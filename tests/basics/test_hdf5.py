import errno
import os
import signal
import subprocess
import sys
import time

import h5py
import hostile
import numpy as np
from golden import refused
from pytest import mark

from historysim.basics import system
from historysim.basics.hdf5 import check_contained, check_named

pytestmark = mark.usefixtures("alone")


def made(folder, fill):
    (folder / "secret").write_bytes(bytes(80))
    with h5py.File(folder / "m.h5", "w") as file:
        fill(file, folder)
    return folder / "m.h5"


@mark.parametrize(
    "fill, by_h5py, message",
    [
        (hostile._external, True, "'/F' is stored in other files"),
        (hostile._nested, False, "HISTORYSIM_MOST_HDF5_DEPTH"),
        (hostile._circle, False, "a process that reads it ends by a signal, or not within"),
        (hostile._claims, False, "'F' claims 8,000,000,000,000 bytes in a file of"),
        (
            lambda file, _: file.create_group(b"\xff"),
            True,
            "expected names in UTF-8: it is damaged",
        ),
    ],
)
def test_an_unsafe_file_is_refused(tmp_path, monkeypatch, fill, by_h5py, message):
    monkeypatch.setenv("HISTORYSIM_MOST_HDF5_SECONDS", "1")
    with refused(message):
        check_contained(made(tmp_path, fill), by_h5py=by_h5py)
    if not by_h5py:
        with refused(r"m\.h5: "):
            check_named(tmp_path / "m.h5")


def test_h5py_bears_more(tmp_path):
    check_contained(made(tmp_path, hostile._circle), by_h5py=True)


def test_self_contained_files_are_accepted(tmp_path):
    def fill(file, _):
        file["a/b/x"] = np.zeros(10)
        file["a/again"] = file["a/b"]
        file["soft"] = h5py.SoftLink("/nowhere")
        file.create_dataset("small and empty", (1000,), "<f8", chunks=(10,))
        file.create_dataset("packed", data=np.zeros(10**7), compression="gzip", chunks=(10**6,))

    check_contained(made(tmp_path, fill))
    (tmp_path / "text").write_text("no HDF5", encoding="utf-8")
    check_contained(tmp_path / "text")
    check_contained(tmp_path / "none")


def test_what_the_library_reads_without_end_is_refused_in_time(tmp_path, monkeypatch):
    by_h5py = True
    monkeypatch.setenv("HISTORYSIM_MOST_HDF5_SECONDS", "1")
    path = made(
        tmp_path,
        lambda file, _: (
            file.create_dataset("x", data=np.zeros(3)).dims[0].attach_scale(scale(file))
        ),
    )
    check_contained(path, by_h5py=by_h5py)
    hostile.zeroed(path, b"GCOL", 16)
    before = time.monotonic()
    with refused(r"not within 1 s .*HISTORYSIM_MOST_HDF5_SECONDS"):
        check_contained(path, by_h5py=by_h5py)
    assert time.monotonic() - before < 20


def scale(file):
    file["t"] = np.arange(3.0)
    file["t"].make_scale()
    return file["t"]


copies = mark.skipif(not system.COPIES_PROCESSES, reason="copies no processes")


@copies
@mark.parametrize(
    "task, well",
    [(bool, True), (lambda: 1 / 0, True), (lambda: time.sleep(60), False), (os.abort, False)],
)
@mark.parametrize("action", [signal.SIG_DFL, signal.SIG_IGN])
def test_a_copy_reports_how_it_ends_whatever_happens_to_the_signal_of_ended_children(
    task, well, action
):
    before = signal.signal(signal.SIGCHLD, action)
    try:
        assert system.copy_ends_well(task, 0.5) == well
    finally:
        signal.signal(signal.SIGCHLD, before)


def refuse(*_, **__):
    raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))


@copies
def test_where_no_copy_can_be_made_a_fresh_process_reads(tmp_path, monkeypatch):
    monkeypatch.setenv("HISTORYSIM_MOST_HDF5_SECONDS", "1")
    monkeypatch.setattr(os, "fork", refuse)
    path = made(tmp_path, hostile._circle)
    with refused("a process that reads it ends by a signal"):
        check_contained(path)
    path.unlink()
    check_contained(made(tmp_path, lambda file, _: file.create_dataset("x", data=np.zeros(3))))


@mark.parametrize("program", ["/bin/false", ""])
def test_where_no_process_can_be_started_the_file_is_read_here(tmp_path, monkeypatch, program):
    monkeypatch.setattr(system, "COPIES_PROCESSES", False)
    monkeypatch.setattr(sys, "executable", program)
    check_contained(made(tmp_path, lambda file, _: file.create_dataset("x", data=np.zeros(3))))


@mark.skipif(sys.platform == "win32", reason="needs the limits and signals of POSIX")
@mark.parametrize(
    "shell",
    [
        "trap '' CHLD; ulimit -v 4000000; ulimit -t 100; ulimit -c 0; export TMPDIR=/nowhere",
        "exec <&- >&- 2>&-",
    ],
)
def test_a_result_is_read_in_unusual_surroundings(tmp_path, shell):
    path = tmp_path / "m.nc"
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(3.0)
    command = f'{shell}; exec "$0" -m historysim columns m.nc'
    done = subprocess.run(
        ["/bin/sh", "-c", command, sys.executable], cwd=tmp_path, capture_output=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert (b"time" in done.stdout) != (">&-" in shell.replace("2>&-", ""))


@mark.skipif(sys.platform != "linux", reason="needs the limit of memory of Linux")
def test_a_limit_of_memory_is_lowered_and_never_raised():
    program = (
        "import resource\n"
        "from historysim.basics.system import limit_memory\n"
        "limit_memory(1 << 40)\n"
        "limit_memory(1 << 30)\n"
        "limit_memory(1 << 40)\n"
        "print(*resource.getrlimit(resource.RLIMIT_AS))"
    )
    command = f"ulimit -Sv 3000000; ulimit -Hv 4000000; exec \"$0\" -c '{program}'"
    done = subprocess.run(
        ["/bin/sh", "-c", command, sys.executable], capture_output=True, text=True, check=True
    )
    soft, hard = map(int, done.stdout.split())
    assert hard == 4_000_000 * 1024
    assert 1 << 30 < soft < 3_000_000 * 1024
