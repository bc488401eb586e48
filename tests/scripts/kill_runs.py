"""Kill runs, resumes, appends and forks (SIGKILL) at random instants, and demand what `promises.py` says.

PYTHONPATH=tests/support python tests/scripts/kill_runs.py --kills 1000
"""

import argparse
import os
import shutil
import signal
import tempfile
import time
from pathlib import Path

import numpy as np
from promises import LONG, WORKLOADS, in_a_process, nothing, sample

EVERY = 40  # rows between snapshots
# of the workloads
SHARES = {"run": 0.3, "resume": 0.3, "append": 0.2, "fork": 0.1, "run of a log": 0.1}


def killed_act(act, duration, generator):
    """Kill something within its duration; return whether it was still under way, and its marks."""
    reading, writing = os.pipe()
    child = in_a_process(lambda: act(lambda text: os.write(writing, f"{text}\n".encode())))
    os.close(writing)
    time.sleep(generator.uniform(0.0, 1.1 * duration))
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, status
    with os.fdopen(reading, encoding="utf-8") as stream:
        return os.WIFSIGNALED(status), stream.read().split()


def duration_of(workload, place, made):
    workload.prepare(place, made)
    start = time.perf_counter()
    workload.act(place, made, nothing)
    return time.perf_counter() - start


def kill_runs(kills, folder, seed=0):
    """Kill so many processes; return how many of each workload were killed."""
    generator = np.random.default_rng(seed)
    made = sample(folder / "whole", LONG, ("repeat = 20", "repeat = 1"), EVERY)
    durations, killed = {}, dict.fromkeys(SHARES, 0)
    while sum(killed.values()) < kills:
        name = str(generator.choice(list(SHARES), p=list(SHARES.values())))
        workload = WORKLOADS[name]
        if name not in durations:
            durations[name] = duration_of(workload, emptied(folder / "here"), made)
        place, marks = emptied(folder / "here"), []
        workload.prepare(place, made)
        # a run is killed, and so are resumes of it, as chance has it
        resumes = (
            [WORKLOADS["resume"].act] * int(generator.integers(4))
            if name in {"run", "resume"}
            else []
        )
        for act in [workload.act, *resumes]:
            ended, more = killed_act(
                lambda mark, act=act: act(folder / "here", made, mark), durations[name], generator
            )
            marks += more
            killed[name] += ended
            if not ended:
                break
        workload.demand(place, made, marks)
    return killed


def emptied(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def main():
    """Read the arguments, and say what came out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="kill_runs.") as folder:
        killed = kill_runs(arguments.kills, Path(folder), arguments.seed)
    print(", ".join(f"{count} times {name}" for name, count in killed.items()), "killed")
    print(
        f"{time.perf_counter() - start:.0f} s; nothing was lost, and every result is that of a run that nobody ended"
    )


if __name__ == "__main__":
    main()
