"""Run with the k-th write, fsync or rename failing (`faults.c`), for every k, and demand what `promises.py` says.

PYTHONPATH=tests/support python tests/scripts/fault_runs.py FOLDER [every so many-th k]
"""

import ctypes
import os
import shutil
import signal
import sys
from pathlib import Path

from preloaded import preloaded
from promises import SHORT, WORKLOADS, demand_of_a_run, sample

import historysim as hs

MODES = {"EIO": 1, "ENOSPC": 2, "short write": 3}
RUN = WORKLOADS["run"]


def attempt(library, place, made, at, mode, sticky):
    """Run in a forked process with a fault; return how many calls could have failed, and how it ended."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    RUN.prepare(place, made)
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        library.faults_arm(str(place).encode(), at, mode, sticky)
        outcome = "done"
        try:
            RUN.act(place, made, lambda _: None)
        except (OSError, hs.InputError) as error:
            outcome = f"ended: {type(error).__name__}: {error}"
        except BaseException as error:  # noqa: BLE001 - any other end is what is looked for
            outcome = f"failed: {error!r}"
        seen = library.faults_seen()
        library.faults_arm(b"/nowhere", -1, 0, 0)
        os.write(writing, f"{seen} {outcome}".encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        answer = stream.read().decode()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGSEGV:
        # HDF5 cannot always close a file that it could not write: no message then, but the promise
        # holds
        return 0, "crashed: HDF5"
    assert status == 0, status
    seen, _, outcome = answer.partition(" ")
    return int(seen), outcome


def main():
    library = preloaded("faults.c")
    library.faults_seen.restype = ctypes.c_long
    library.faults_arm.argtypes = [ctypes.c_char_p, ctypes.c_long, ctypes.c_int, ctypes.c_int]
    folder, stride = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    made, place = sample(folder / "whole", SHORT, ("0.0005", "0.0007"), 2), folder / "here"
    total, _ = attempt(library, place, made, -1, 0, 0)
    assert total > 40, "the faults do not reach SQLite and HDF5"
    ends = {"done": 0, "ended": 0, "crashed": 0}
    for (name, mode), sticky in ((each, sticky) for each in MODES.items() for sticky in (0, 1)):
        for at in range(0, total, stride):
            _, outcome = attempt(library, place, made, at, mode, sticky)
            where = (
                f"call {at} of {total}, {name}, {'from then on' if sticky else 'once'}: {outcome}"
            )
            kind = outcome.partition(":")[0]
            assert kind in ends, where
            ends[kind] += 1
            try:
                # rows that could not be written may be damaged
                demand_of_a_run(place, made, ["done"] if kind == "done" else [], exactly=False)
            except AssertionError as error:
                raise AssertionError(f"{where}: {error}") from error
    print(
        f"{total} calls; {ends['done']} runs went through, {ends['ended']} ended with a message, {ends['crashed']} in "
        "a crash of HDF5; all were resumed"
    )


if __name__ == "__main__":
    main()
