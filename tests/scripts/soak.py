"""Long runs with their log: time, size and memory, which has to stay flat.

    python tests/soak.py [events | square | spiral | log] ...

events: 10⁶ events × 100 asperities. square: 10⁴ steps × 10⁴ asperities. spiral: 10⁶ ever smaller reversals, totals
only. log: append 10⁶ events and read them back. Without a name, all. --share 0.01 makes each that much shorter.
"""

import argparse
import os
import resource
import shutil
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

import historysim as hs
from historysim.log.file import LogFile
from historysim.log.result import snapshots

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


def summits(count):
    generator = np.random.default_rng(1)
    return hs.Ensemble(PAIR, generator.normal(0.0, 0.01, count), generator.uniform(0.5, 2.0, count), 0.5)


def swings(count):
    """Displacement of the contact to and fro, the normal load swinging slowly."""
    time_ = np.arange(count, dtype=float)
    displacement = 1e-3 * np.sin(1.7 * time_)
    events = [hs.NormalDisplacement(0.0, 0.1)]
    events += [hs.TangentialDisplacement(*pair) for pair in zip(time_.tolist(), displacement.tolist(), strict=True)]
    return events


def spiral(count):
    """Reversals, each a little smaller than the one before: nothing is ever wiped out."""
    load = 0.004 * (1.0 - np.arange(count) / (count + 1.0)) * (-1.0) ** np.arange(count)
    return [hs.NormalLoad(0.0, 0.01), *(hs.TangentialLoad(*pair) for pair in enumerate(load.tolist(), start=1))]


class Memory:
    """Resident memory while something runs, sampled."""

    def __enter__(self):
        self.samples, self.done = [], threading.Event()
        self.thread = threading.Thread(target=self.watch)
        self.thread.start()
        return self

    def watch(self):
        page = resource.getpagesize()
        while not self.done.wait(0.2):
            self.samples.append(int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * page)

    def __exit__(self, *_):
        self.done.set()
        self.thread.join()

    @property
    def text(self):
        """Peaks of the quarters of the run, in MB."""
        quarters = np.array_split(np.array(self.samples or [0]), 4)
        return ", ".join(f"{quarter.max(initial=0) / 1e6:.0f}" for quarter in quarters)


def soak(name, folder, ensemble, events, record):
    log = folder / f"{name}.history"
    hs.EventLog.create(log, ensemble, events, record=record).close()
    count = len(events)
    del events
    began = time.perf_counter()
    with Memory() as memory:
        hs.run(log, folder / f"{name}.nc").close()
    elapsed = time.perf_counter() - began
    with LogFile(log) as file:
        kept = len(list(snapshots(file, file.sound())))
    sizes = [os.path.getsize(folder / f"{name}.{ending}") / 1e6 for ending in ("history", "nc")]  # noqa: PTH202
    print(
        f"{name}: {count:,} events × {len(ensemble):,} asperities in {elapsed:.0f} s, {kept} snapshots, log "
        f"{sizes[0]:.0f} MB, result {sizes[1]:.0f} MB; peak memory by quarter [MB]: {memory.text}",
        flush=True,
    )


def appending(folder, count):
    events = swings(count)
    began = time.perf_counter()
    with hs.EventLog.create(folder / "log.history", summits(100)) as log:
        log.append(events)
    appended = time.perf_counter() - began
    began = time.perf_counter()
    with hs.EventLog(folder / "log.history") as log:
        read = len(log.events())
    print(f"log: {read:,} events appended in {appended:.1f} s, read back in {time.perf_counter() - began:.1f} s")


def main():
    """Read the arguments, and run what they name."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("which", nargs="*", choices=["events", "square", "spiral", "log", []])
    parser.add_argument("--share", type=float, default=1.0)
    parser.add_argument("--folder", help="where to write; some GB are needed")
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="soak.", dir=arguments.folder))
    which = arguments.which or ["log", "events", "square", "spiral"]
    many, some = int(1e6 * arguments.share), int(1e4 * arguments.share)
    try:
        if "log" in which:
            appending(folder, many)
        if "events" in which:
            soak("events", folder, summits(100), swings(many), "all")
        if "square" in which:
            soak("square", folder, summits(10_000), swings(some), "all")
        if "spiral" in which:
            soak("spiral", folder, summits(1), spiral(many), "totals")
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
