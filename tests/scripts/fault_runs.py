"""Run with the k-th write, fsync or rename failing (`faults.c`), for every k.

PYTHONPATH=tests/support python tests/scripts/fault_runs.py FOLDER [every so many-th k]
"""

import ctypes
import os
import shutil
import signal
import sys
from pathlib import Path

from kill_runs import variables
from preloaded import preloaded

import historysim as hs
from historysim.log.file import LogFile

MODES = {"EIO": 1, "ENOSPC": 2, "short write": 3}
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
waypoints = [
    { time = 0, normal_load = 0.01 },
    { time = 1, tangential_load = 0.003 },
    { time = 2, tangential_load = -0.003 },
    { time = 3, tangential_load = 0.002 },
]
"""


def run(scenario, output, *, resume):
    hs.run(scenario, output, resume=resume, snapshot_every=2).close()


def attempt(library, scenario, output, at, mode, sticky):
    """Run in a forked process with a fault; return how it ended, and how many calls could have failed."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        library.faults_arm(str(output.parent).encode(), at, mode, sticky)
        told = "done"
        try:
            run(scenario, output, resume=True)
        except (OSError, hs.InputError) as error:
            told = f"told: {type(error).__name__}: {error}"
        except BaseException as error:  # noqa: BLE001 - any other end is what is looked for
            told = f"failed: {error!r}"
        seen = library.faults_seen()
        library.faults_arm(b"/nowhere", -1, 0, 0)
        os.write(writing, f"{seen} {told}".encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        answer = stream.read().decode()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGSEGV:
        # HDF5 cannot always close a file that it could not write: no message then, but the promise holds
        return 0, "crashed: HDF5"
    assert status == 0, status
    seen, _, told = answer.partition(" ")
    return int(seen), told


def main():
    library = preloaded("faults.c")
    library.faults_seen.restype = ctypes.c_long
    library.faults_arm.argtypes = [ctypes.c_char_p, ctypes.c_long, ctypes.c_int, ctypes.c_int]
    folder, stride = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    scenario = folder / "small.toml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    run(scenario, folder / "whole.nc", resume=False)
    expected = variables(folder / "whole.nc")
    other = folder / "other.toml"
    other.write_text(SCENARIO.replace("0.002", "0.001"), encoding="utf-8")
    run(other, folder / "older.nc", resume=False)
    older = (folder / "older.nc").read_bytes()
    place = folder / "here"
    total, _ = counted(library, scenario, place, older)
    assert total > 40, "the faults do not reach SQLite and HDF5"
    ends = {"done": 0, "told": 0, "crashed": 0}
    for name, mode in MODES.items():
        for sticky in (0, 1):
            for at in range(0, total, stride):
                output = fresh(place, older)
                _, told = attempt(library, scenario, output, at, mode, sticky)
                where = f"call {at} of {total}, {name}, {'from then on' if sticky else 'once'}: {told}"
                kind = told.partition(":")[0]
                assert kind in ends, where
                ends[kind] += 1
                check(scenario, output, told, older, expected, where)
    print(
        f"{total} calls; {ends['done']} runs went through, {ends['told']} ended with a message, {ends['crashed']} in a "
        "crash of HDF5; all were resumed"
    )


def counted(library, scenario, place, older):
    return attempt(library, scenario, fresh(place, older), -1, 0, 0)


def fresh(place, older):
    """A folder with an older result in it."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    (place / "out.nc").write_bytes(older)
    return place / "out.nc"


def check(scenario, output, told, older, expected, where):
    """The older result or the new one, a log that opens or none, and a resume that completes."""
    log = output.with_suffix(".history")
    if log.exists():
        with LogFile(log) as file:
            file.sound()
    if told != "done" and output.read_bytes() != older:
        assert variables(output) == expected, where
    run(scenario, output, resume=True)
    assert variables(output) == expected, where
    left = sorted(path.name for path in output.parent.iterdir())
    assert left == ["out.history", "out.nc"], (where, left)


if __name__ == "__main__":
    main()
