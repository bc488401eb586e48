"""What systems do differently: that nothing else asks for it, and that the program works without it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import hostile
from pytest import mark

import historysim
from historysim.basics import system

# Calls and flags of ``os`` that Windows does not have, or means otherwise.
POSIX = {
    "O_CLOEXEC",
    "O_DIRECTORY",
    "O_NOFOLLOW",
    "O_NONBLOCK",
    "fork",
    "geteuid",
    "getuid",
    "kill",
    "lockf",
    "mkfifo",
    "pread",
    "sched_getaffinity",
    "sendfile",
}
ONLY_THERE = {"fcntl", "grp", "posix", "pwd", "resource", "termios"}
SUPPORT = Path(__file__).parents[1] / "support"
SCENARIO = (
    hostile.SCENARIO
    + """
[sweep]
outputs = ["preliminary_displacement"]
[sweep.over]
friction.coefficient = [0.4, 0.5]
"""
)


def test_no_other_module_asks_for_what_only_some_systems_have():
    home = Path(historysim.__file__).parent
    for path in home.rglob("*.py"):
        if path == home / "basics" / "system.py":
            continue
        text = path.read_text(encoding="utf-8")
        imported = re.findall(r"^\s*(?:import|from) (\w+)", text, re.MULTILINE)
        assert not {*imported} & ONLY_THERE, path
        assert not {*re.findall(r"\bos\.(\w+)", text)} & POSIX, path


@mark.ci
@mark.skipif(sys.platform != "linux", reason="the stand-in for Windows' locks needs those of Linux")
def test_the_commands_work_where_nothing_of_posix_is_there(tmp_path):
    (tmp_path / "s.toml").write_text(SCENARIO, encoding="utf-8")
    for arguments in (
        ["run", "s.toml", "-o", "r.nc", "-o", "r.png"],
        ["run", "s.toml", "-o", "r.nc", "--resume"],
        ["run", "r.history", "-o", "r.nc", "--compression", "zlib"],
        ["verify", "r.nc"],
        ["sweep", "s.toml", "-o", "sweep.csv", "--workers", "1"],
        ["report", "r.nc"],
        ["show", "r.nc"],
    ):
        program = "import hidden; from historysim.cli import main; main()"
        done = subprocess.run(
            [sys.executable, "-c", program, *arguments],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(SUPPORT), "PYTHONIOENCODING": "cp1252"},
            capture_output=True,
            text=True,
            encoding="cp1252",
            timeout=300,
            check=False,
        )
        assert done.returncode == 0, (arguments, done.stderr)
    assert not [path.name for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_process_is_running_until_it_has_ended():
    assert system.is_running(os.getpid())
    with subprocess.Popen([sys.executable, "-c", ""]) as child:
        child.wait()
    assert not system.is_running(child.pid)
    assert not system.is_running(1 << 40)


def test_a_byte_is_locked_once(tmp_path):
    handle = os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT)
    assert system.lock_byte(handle, 7, wait=False)
    program = f"import os, sys; sys.path[:0] = {sys.path!r}; from historysim.basics.system import lock_byte\n"
    program += f"handle = os.open({str(tmp_path / 'lock')!r}, os.O_RDWR)\n"
    program += "print(lock_byte(handle, 7, wait=False), lock_byte(handle, 8, wait=False))"
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert told.split() == ["False", "True"]
    os.close(handle)


@mark.parametrize("there, expected", [(1, 1), (3, 3), (64, system.MOST_THREADS)])
def test_by_default_there_is_a_thread_for_each_processor_up_to_a_few(monkeypatch, there, expected):
    monkeypatch.setattr(system, "processors", lambda: there)
    assert system.resolve_threads(None) == expected
    assert system.resolve_threads(7) == 7
