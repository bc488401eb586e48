"""Processor time of the commands for long measured records, of a small run, and of a large file, with goals.

    python tests/benchmarks/record_speed.py [SAMPLES]

The record, of a million samples by default, has a loop of 2,000 samples each, with noise. A fit is
of a tenth of it.
"""

import os
import subprocess
import sys
import tempfile
import time
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
[fit]
parameters = ["friction"]
"""
SMALL = Path(__file__).parents[2] / "scenarios" / "01_load_steps_up.toml"
#: commands, with the fraction of the samples, and the goal of each for a million of them [s]
COMMANDS = {
    "run": (["run", "scenario.toml", "-o", "out.nc"], 1, 4.0),
    "compare": (["compare", "scenario.toml"], 1, 8.0),
    "report": (["report", "out.nc", "-o", "out.html"], 1, 10.0),
    "fit": (["fit", "scenario.toml"], 10, 6.0),
}


def write_record(folder, count):
    """Write a record of a sphere, in loops of ±200 nm at 30 mN with noise, and its scenario."""
    rng = np.random.default_rng(0)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ball = hs.Ensemble(pair, 0.0, 2.5e-3, 0.12)
    at = 1.0 + 1e-3 * np.arange(count)
    displacement = 200e-9 * np.sin(2 * np.pi * np.arange(count) / 2000)
    moves = map(hs.TangentialDisplacement, at.tolist(), displacement.tolist())
    history = hs.replay(ball, [hs.NormalLoad(0.0, 30e-3), *moves], record="totals")
    load = history.total_tangential_load.values[1:] + 6e-6 * rng.standard_normal(count)
    displacement += 1e-9 * rng.standard_normal(count)
    np.savetxt(
        folder / "record.csv",
        np.column_stack([at, np.full(count, 30.0), 1e9 * displacement, 1e3 * load]),
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


def write_ratios(folder, steps):
    """Processor and elapsed time of a result of 1,000 asperities, over those of a plain write of its bytes."""
    heights = np.random.default_rng(0).normal(0, 1e-8, 1_000)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    moves = (2e-8 * np.sin(0.05 * np.arange(steps))).tolist()
    events = [hs.NormalDisplacement(0.0, 8e-8)]
    events += [hs.TangentialDisplacement(1.0 + step, move) for step, move in enumerate(moves)]
    job = hs.Replay(hs.Ensemble(pair, heights, 1e-5, 0.3), events, record="all")
    result, plain, piece = folder / "large.nc", folder / "large.raw", os.urandom(1 << 20)

    def write_plain():
        with plain.open("wb") as stream:
            for _ in range(result.stat().st_size >> 20):
                stream.write(piece)
            stream.flush()
            os.fsync(stream.fileno())

    times = []
    for write in (lambda: job.write(result), write_plain):
        started = time.process_time(), time.perf_counter()
        write()
        times.append([time.process_time() - started[0], time.perf_counter() - started[1]])
    return np.divide(*times)


def main():
    """Measure, and print a table."""
    count = int(sys.argv[1]) if sys.argv[1:] else 1_000_000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for label, (command, part, goal) in COMMANDS.items():
            if not (of_part := folder / f"{part}").exists():
                of_part.mkdir()
                write_record(of_part, count // part)
            seconds = processor_time(of_part, "-m", "historysim", *command)
            print(
                f"{label}, {count // part:,} samples: {seconds:.1f} s "
                f"(goal of {1_000_000 // part:,}: {goal:g} s)"
            )
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
        processor, elapsed = write_ratios(folder, count // 50)
        print(
            f"large result over a plain write: {elapsed:.1f}, processor {processor:.1f} (goal: 1.5)"
        )


if __name__ == "__main__":
    main()
