"""Kill a sweep again and again: no finished cell is computed again, and what comes out is the same, bit for bit.

python tests/scripts/kill_sweeps.py --cells 1000 --kills 100
"""

import argparse
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import xarray as xr

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [{size}, {size}]
pixel_size = "1 µm"
rms_height = "24 nm"
autocorrelation_length = "{length} µm"
seed = 1
[friction]
coefficient = 0.2
[loading]
substeps = 20
waypoints = [
    {{ time = 0, normal_load = "50 mN" }},
    {{ time = 1, tangential_displacement = "20 nm" }},
    {{ time = 3, tangential_displacement = "-20 nm" }},
    {{ time = 5, tangential_displacement = "20 nm" }},
]
[sweep.over]
surface.seed = {{ from = 1, count = {cells} }}
"""


def write_scenario(folder, cells, size):
    """Write a scenario of one loop on random surfaces, one for each cell."""
    path = folder / "sweep.toml"
    path.write_text(SCENARIO.format(size=size, length=max(4, size // 13), cells=cells), encoding="utf-8")
    return path


def command(scenario, output, store, workers):
    """The command that carries a sweep out."""
    return [
        *(sys.executable, "-m", "historysim", "sweep", str(scenario)),
        *("-o", str(output), "--store", str(store), "--workers", str(workers)),
    ]


def kept(store):
    """When each cell was written, and its file: both change where a cell is computed again."""
    return {path.name: (path.stat().st_mtime_ns, path.stat().st_ino) for path in store.glob("*.cell")}


def kill_once(arguments, store, chance, patience=300.0):
    """Start a sweep, kill it some cells later, and return whether it was still running."""
    before = len(kept(store))
    aim = before + chance.randint(1, 12)
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as running:
        end = time.monotonic() + patience
        while running.poll() is None and len(kept(store)) < aim and time.monotonic() < end:
            time.sleep(0.002)
        time.sleep(chance.uniform(0, 0.02))
        alive = running.poll() is None
        running.kill()
    return alive


def killed_sweep(folder, *, cells, kills, size, workers=2, seed=0):
    """Kill a sweep some times, let it end, and return its store, its output and how often it was killed.

    A cell that is written twice is an AssertionError.
    """
    chance = random.Random(seed)  # noqa: S311 - it says only when to kill
    scenario, store, output = write_scenario(folder, cells, size), folder / "killed.cells", folder / "killed.nc"
    arguments = command(scenario, output, store, workers)
    seen, count = {}, 0
    for _ in range(kills):
        count += kill_once(arguments, store, chance)
        now = kept(store)
        assert {name: now[name] for name in seen} == seen, "a finished cell was written again"
        seen = now
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    now = kept(store)
    assert {name: now[name] for name in seen} == seen, "a finished cell was written again"
    assert len(now) == cells
    leftovers = [path.name for path in store.iterdir() if path.suffix == ".part"]
    assert not leftovers, leftovers
    return store, output, count


def check_same(first, second):
    """Check that two sweeps are the same, bit for bit, but for the date."""
    with xr.open_dataset(first, decode_times=False) as one, xr.open_dataset(second, decode_times=False) as other:
        for sweep in (one, other):
            del sweep.attrs["date_created"]
        assert one.identical(other), f"{first} and {second} differ"


def main():
    """Compare a sweep that was killed with one that was not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=1000)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--size", type=int, default=256, help="points of a side of each surface")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = folder / "whole.nc"
        scenario = write_scenario(folder, given.cells, given.size)
        subprocess.run(command(scenario, whole, folder / "whole.cells", 1), check=True)
        _, killed, count = killed_sweep(folder, cells=given.cells, kills=given.kills, size=given.size)
        check_same(whole, killed)
        print(f"killed {count} times: no cell was computed again, the same bits")


if __name__ == "__main__":
    main()
