"""Kill runs (SIGKILL) at random instants, resumes among them, and check what they leave.

    python tests/kill_runs.py --kills 300

After each kill the log opens and is sound, or is not there yet, and an older result is untouched. The next run resumes
after the last snapshot, and what it ends with is the result of a run that nobody ended, bit for bit.
"""

import argparse
import os
import re
import shutil
import signal
import tempfile
import time
from pathlib import Path

import netCDF4
import numpy as np

import historysim as hs
from historysim.log.file import LogFile

SCENARIO = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "summits"
height = [-0.03, 0.0, -0.5, -0.01, -0.04]
radius = [1.0, 2.0, 1.0, 0.5, 1.5]
[friction]
coefficient = [0.5, 0.4, 0.5, 0.6, 0.45]
[record]
asperities = "all"
[loading]
substeps = 3
[[loading.blocks]]
waypoints = [{ after = 1, normal_load = 0.03 }]
[[loading.blocks]]
repeat = 60
waypoints = [
    { after = 0.5, normal_load = 0.025 },
    { after = 0.5, tangential_displacement = 0.012 },
    { after = 1, friction = 0.5 },
    { after = 1, tangential_load = -0.004, normal_load = 0.03 },
    { after = 1, friction = [0.5, 0.4, 0.5, 0.6, 0.45] },
]
"""
EVERY = 40
"""Rows between snapshots."""


def variables(path):
    """Every bit of every variable of a result."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        return {name: np.ascontiguousarray(values[...]).tobytes() for name, values in file.variables.items()}


def scenario_in(folder):
    path = folder / "killed.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def start(scenario, output):
    """Run in a process of its own, forked, so that it need not import and compile again."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        with (output.with_suffix(".told")).open("w", encoding="utf-8", buffering=1) as told:
            hs.run(
                scenario, output, resume=True, snapshot_every=EVERY, tell=lambda text: print(text, file=told)
            ).close()
        code = 0
    finally:
        os._exit(code)


def last_snapshot(log):
    """Rows at the last snapshot of a sound log."""
    if not log.exists():
        return 0
    with LogFile(log) as file:
        content = file.sound()
        rows = [snapshot.standing.rows for snapshot in file.snapshots(content) if not isinstance(snapshot, str)]
    return max(rows, default=0)


def check_start(told, rows):
    """A run goes on after the last snapshot, so at most one interval is computed again."""
    text = told.read_text(encoding="utf-8")
    found = re.search(r"after ([\d,]+) rows", text)
    begun = int(found[1].replace(",", "")) if found else 0
    assert begun == rows or not text, (text, rows)


def kill_runs(kills, folder, seed=0):
    """Kill so many runs; return how many were completed meanwhile, and in how many stages the longest."""
    generator = np.random.default_rng(seed)
    scenario, output = scenario_in(folder), folder / "killed.nc"
    log, told = output.with_suffix(".history"), output.with_suffix(".told")
    hs.run(scenario, folder / "whole.nc").close()
    expected = variables(folder / "whole.nc")
    began = time.perf_counter()
    hs.run(scenario, output, snapshot_every=EVERY).close()
    duration = time.perf_counter() - began
    assert variables(output) == expected
    assert last_snapshot(log) > 0
    done = completed = stages = most = 0
    other = folder / "other.toml"
    other.write_text(SCENARIO.replace("repeat = 60", "repeat = 1"), encoding="utf-8")
    hs.run(other, folder / "older.nc").close()
    older = (folder / "older.nc").read_bytes()
    output.write_bytes(older)
    log.unlink()
    while done < kills:
        rows = last_snapshot(log)
        child = start(scenario, output)
        time.sleep(generator.uniform(0.0, 1.1 * duration))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if told.exists():
            check_start(told, rows)
            told.unlink()
        assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
        stages += 1
        if os.WIFSIGNALED(status):
            done += 1
            last_snapshot(log)
            if output.read_bytes() != older:
                # killed after the result had its name
                assert variables(output) == expected
            continue
        assert variables(output) == expected
        assert not (folder / ".killed.nc.parts").exists()
        completed, most, stages = completed + 1, max(most, stages), 0
        log.unlink()
        output.write_bytes(older)
    hs.run(scenario, output, resume=True).close()
    assert variables(output) == expected
    return completed + 1, most


def main():
    """Read the arguments, and say what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="kill_runs."))
    began = time.perf_counter()
    completed, most = kill_runs(arguments.kills, folder, arguments.seed)
    shutil.rmtree(folder)
    print(
        f"{arguments.kills} runs killed in {time.perf_counter() - began:.0f} s; {completed} completed, in up to {most} "
        "stages: bit for bit those of a run that nobody ended"
    )


if __name__ == "__main__":
    main()
