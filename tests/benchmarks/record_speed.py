"""Processor time of the commands for long measured records, and of a small run, with goals.

    python tests/benchmarks/record_speed.py [SAMPLES]

The record, of a million samples by default, has a loop of 2,000 samples each, with noise.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import historysim as hs

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.12
[loading]
file = "record.csv"
[loading.columns]
time = "time_s"
normal_load = { column = "normal_load_mN", unit = "mN" }
tangential_displacement = { column = "displacement_nm", unit = "nm" }
[loading.response]
tangential_load = { column = "tangential_load_mN", unit = "mN" }
[loading.dead_band]
tangential_displacement = "20 nm"
[record]
asperities = "totals"
"""
SMALL = Path(__file__).parents[2] / "scenarios" / "01_load_steps_up.toml"
#: commands, with the goal of each for a million samples [s]
COMMANDS = {
    "run": (["run", "scenario.toml", "-o", "out.nc"], 4.0),
    "compare": (["compare", "scenario.toml"], 8.0),
    "report": (["report", "out.nc", "-o", "out.html"], 10.0),
}


def write_record(folder, count):
    """Write a record of a sphere, in loops of ±200 nm at 30 mN with noise, and its scenario."""
    rng = np.random.default_rng(0)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ball = hs.Ensemble(pair, 0.0, 2.5e-3, 0.12)
    time = 1.0 + 1e-3 * np.arange(count)
    displacement = 200e-9 * np.sin(2 * np.pi * np.arange(count) / 2000)
    moves = map(hs.TangentialDisplacement, time.tolist(), displacement.tolist())
    history = hs.replay(ball, [hs.NormalLoad(0.0, 30e-3), *moves], record="totals")
    load = history.total_tangential_load.values[1:] + 6e-6 * rng.standard_normal(count)
    displacement += 1e-9 * rng.standard_normal(count)
    np.savetxt(
        folder / "record.csv",
        np.column_stack([time, np.full(count, 30.0), 1e9 * displacement, 1e3 * load]),
        fmt="%.9g",
        delimiter=",",
        header="time_s,normal_load_mN,displacement_nm,tangential_load_mN",
        comments="",
    )
    (folder / "scenario.toml").write_text(SCENARIO, encoding="utf-8")


def processor_time(folder, *command):
    """Processor time of a Python command in a folder [s]."""
    before = os.times()
    subprocess.run([sys.executable, *command], cwd=folder, check=True, capture_output=True)
    after = os.times()
    return sum(after[2:4]) - sum(before[2:4])


CALLS = """
import sys
calls = set()

def note(frame, event, _):
    code = frame.f_code
    is_own = "historysim" in code.co_filename and "<" not in code.co_filename + code.co_name
    if event == "call" and is_own:
        calls.add((code.co_filename, code.co_name, code.co_firstlineno, code.co_flags & 1))

sys.setprofile(note)
import historysim as hs
hs.run(sys.argv[1], "small.nc", force=True)
sys.setprofile(None)
functions = [call for call in calls if call[-1]]
print(len(functions), len({file for file, *_ in functions}), len(calls) - len(functions))
"""


def main():
    """Measure, and print a table."""
    count = int(sys.argv[1]) if sys.argv[1:] else 1_000_000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_record(folder, count)
        for label, (command, goal) in COMMANDS.items():
            seconds = processor_time(folder, "-m", "historysim", *command)
            print(f"{label}, {count:,} samples: {seconds:.1f} s (goal of 10⁶: {goal:g} s)")
        numpy = min(processor_time(folder, "-c", "import numpy") for _ in range(3))
        small = ["-m", "historysim", "run", str(SMALL), "-o", "small.nc", "--force"]
        run = min(processor_time(folder, *small) for _ in range(3))
        print(f"run of {SMALL.name} over import of numpy: {run / numpy:.1f} (goal: 3.5)")
        counted = subprocess.run(
            [sys.executable, "-c", CALLS, str(SMALL)],
            cwd=folder,
            check=True,
            capture_output=True,
            text=True,
        )
        functions, files, classes = counted.stdout.split()
        print(
            f"hs.run of {SMALL.name}: {functions} functions (goal: 500) in {files} files (goal: 60)"
        )
        print(f"and {classes} bodies of classes")


if __name__ == "__main__":
    main()
