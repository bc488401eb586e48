"""Kill runs, resumes, appends and forks (SIGKILL) at random instants, and check what they leave.

    python tests/scripts/kill_runs.py --kills 1000

After each kill the log opens and is sound, or is not there yet; events that were appended are there; and an older
result is untouched. The next run resumes after the last snapshot, and what it ends with is the result of a run that
nobody ended, bit for bit.
"""

import argparse
import functools
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
from historysim.log.result import snapshots

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
EVERY = 40  # rows between snapshots


def variables(path):
    """Every bit of every variable of a result."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        return {name: np.ascontiguousarray(values[...]).tobytes() for name, values in file.variables.items()}


def scenario_in(folder):
    path = folder / "killed.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def in_a_process(action):
    """Do something in a process of its own, forked, so that it need not import and compile again."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        action()
        code = 0
    finally:
        os._exit(code)


def end(child):
    """Kill a process; return whether it was still alive."""
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, status
    return os.WIFSIGNALED(status)


def duration_of(action):
    began = time.perf_counter()
    action()
    return time.perf_counter() - began


# -- runs and resumes -------------------------------------------------------------------------------


def last_snapshot(log):
    """Rows at the last snapshot of a sound log."""
    if not log.exists():
        return 0
    with LogFile(log) as file:
        content = file.sound()
        rows = [start.rows for start in snapshots(file, content)]
    return max(rows, default=0)


def check_start(told, rows):
    """A run goes on after the last snapshot, so at most one interval is computed again."""
    text = told.read_text(encoding="utf-8")
    found = re.search(r"after ([\d,]+) rows", text)
    begun = int(found[1].replace(",", "")) if found else 0
    assert begun == rows or not text, (text, rows)


class Runs:
    """Runs over an older result, each killed and resumed until it is complete."""

    def __init__(self, folder):
        self.scenario, self.output = scenario_in(folder), folder / "killed.nc"
        self.log, self.told = self.output.with_suffix(".history"), self.output.with_suffix(".told")
        hs.run(self.scenario, folder / "whole.nc").close()
        self.expected = variables(folder / "whole.nc")
        self.duration = duration_of(lambda: hs.run(self.scenario, self.output, snapshot_every=EVERY).close())
        assert variables(self.output) == self.expected
        assert last_snapshot(self.log) > 0
        other = folder / "other.toml"
        other.write_text(SCENARIO.replace("repeat = 60", "repeat = 1"), encoding="utf-8")
        hs.run(other, folder / "older.nc").close()
        self.older = (folder / "older.nc").read_bytes()
        self.completed = 0
        self._begin()

    def _begin(self):
        self.log.unlink()
        self.output.write_bytes(self.older)

    def act(self):
        with self.told.open("w", encoding="utf-8", buffering=1) as told:
            notify = functools.partial(print, file=told)
            hs.run(self.scenario, self.output, resume=True, snapshot_every=EVERY, notify=notify).close()

    def before(self):
        self.rows = last_snapshot(self.log)

    def check(self, *, killed):
        if self.told.exists():
            check_start(self.told, self.rows)
            self.told.unlink()
        if killed:
            last_snapshot(self.log)
            if self.output.read_bytes() != self.older:
                # killed after the result had its name
                assert variables(self.output) == self.expected
            return
        assert variables(self.output) == self.expected
        assert not (self.output.parent / ".killed.nc.unfinished").exists()
        self.completed += 1
        self._begin()

    def finish(self):
        self.before()
        self.act()
        self.check(killed=False)


# -- appends ----------------------------------------------------------------------------------------


class Appends:
    """Appends to a log, in batches of many sizes; each that has returned is told."""

    MOST = 3000

    def __init__(self, folder):
        self.log, self.told = folder / "grown.history", folder / "grown.told"
        self.events = [hs.NormalLoad(float(number), 0.01 + 1e-5 * (number % 7)) for number in range(self.MOST)]
        self.completed = 0
        self._begin()
        self.duration = duration_of(self.act)
        self.check(killed=False)

    def _begin(self):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        hs.EventLog.create(self.log, hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=0.2)).close()

    def before(self):
        self.told.unlink(missing_ok=True)

    def act(self):
        with hs.EventLog(self.log) as log, self.told.open("a", encoding="utf-8", buffering=1) as told:
            begun = len(log)
            while begun < self.MOST:
                end = min(begun + 1 + begun * 7 % 300, self.MOST)
                log.append(self.events[begun:end])
                begun = end
                print(begun, file=told)

    def check(self, *, killed):
        told = self.told.read_text(encoding="utf-8").split() if self.told.exists() else []
        with hs.EventLog(self.log) as log:
            assert len(log) >= int(told[-1] if told else 0), "events that were appended are lost"
            assert log.events() == self.events[: len(log)]
            assert killed or len(log) == self.MOST
        if not killed:
            self.completed += 1
            self._begin()

    def finish(self):
        self.before()
        self.act()
        self.check(killed=False)


# -- forks ------------------------------------------------------------------------------------------


class Forks:
    """Forks of a log at two times in turn, each in place of the one before."""

    TIMES = (20.25, 100.5)

    def __init__(self, folder):
        self.log, self.fork = folder / "source.history", folder / "fork.history"
        hs.run(scenario_in(folder), folder / "source.nc").close()
        self.content = self.log.read_bytes()
        self.digests, self.completed = [], 0
        for _ in self.TIMES:
            self.before()
            self.duration = duration_of(self.act)
            with hs.EventLog(self.fork) as log:
                self.digests.append(log.digest)
            self.completed += 1

    def before(self):
        self.time = self.TIMES[self.completed % 2]

    def act(self):
        with hs.EventLog(self.log) as log:
            log.fork(self.time, self.fork).close()

    def check(self, *, killed):
        assert self.log.read_bytes() == self.content
        with hs.EventLog(self.fork) as log:
            found = self.digests.index(log.digest)
        if not killed:
            assert self.TIMES[found] == self.time
            self.completed += 1

    def finish(self):
        self.before()
        self.act()
        self.check(killed=False)


def kill_runs(kills, folder, seed=0):
    """Kill so many processes; return how many of each kind were killed, and how many completed meanwhile."""
    generator = np.random.default_rng(seed)
    works = {}
    for kind in (Runs, Appends, Forks):
        place = folder / kind.__name__
        place.mkdir()
        works[kind.__name__.lower()] = kind(place)
    killed = dict.fromkeys(works, 0)
    while sum(killed.values()) < kills:
        # runs have the most states to be killed in
        name = str(generator.choice(list(works), p=(0.6, 0.3, 0.1)))
        work = works[name]
        work.before()
        child = in_a_process(work.act)
        time.sleep(generator.uniform(0.0, 1.1 * work.duration))
        ended = end(child)
        killed[name] += ended
        work.check(killed=ended)
    for work in works.values():
        work.finish()
    completed = {name: work.completed for name, work in works.items()}
    return killed, completed


def main():
    """Read the arguments, and say what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="kill_runs."))
    began = time.perf_counter()
    killed, completed = kill_runs(arguments.kills, folder, arguments.seed)
    shutil.rmtree(folder)
    for name, count in killed.items():
        print(f"{name}: {count} killed" + (f", {completed[name]} completed meanwhile" if name in completed else ""))
    print(f"{time.perf_counter() - began:.0f} s; nothing was lost, and every result is that of a run that nobody ended")


if __name__ == "__main__":
    main()
