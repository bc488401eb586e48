"""Time and error of the replay over sizes and kinds, beside floors in the same run; a table and JSON.

    python tests/benchmarks/suite.py [--longest 20] [--gigabytes 3] [--json FILE]

Each history is a loop of 40 steps at a constant approach, over and over: between reversals the closed form of Cattaneo
and Mindlin holds for each asperity, twice as large after the first (Masing), whoever controls the displacement. The
error is the largest difference of the total tangential load from it, in parts of the friction limit μN. The least of
several times counts, on the wall and of the processors; only the latter compare where other programs run. A case is
left out, and told, where it would record more gigabytes than asked for, or take the processors longer than so many
seconds, by the next smaller one of its kind. Two threads are timed beside one where they are of use: where many
asperities are recorded. `--json` keeps all numbers.

Floors: a copy of the recorded arrays in memory; a plain write of as many bytes, with fsync; a netCDF file of the same
arrays, written in one go. Other programs are timed by ``compared.py``.
"""

import argparse
import ctypes
import itertools
import json
import math
import os
import tempfile
import time
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import attrs
import netCDF4
import numpy as np
from replay_speed import FRICTION, as_stiff_as, ensemble, history

import historysim as hs
from historysim.recording.provenance import made_with

LOOP = 40
SIZES, EVENTS = (1, 100, 10_000, 100_000), (100, 10_000, 100_000)
BYTES_OF_EACH = 41  # that a step records of an asperity: five numbers of 8 bytes, and the slip state


def once(action):
    """The time of an action [s], on the wall and of the processors."""
    start = time.perf_counter(), time.process_time()
    action()
    return time.perf_counter() - start[0], time.process_time() - start[1]


def least_times(action, seconds=1.0, most=7):
    """The least of several times of an action [s], on the wall and of the processors; of two where it takes long."""
    times = [once(action), once(action)]
    while len(times) < most and sum(processor for _, processor in times) < seconds:
        times.append(once(action))
    return tuple(map(min, zip(*times, strict=True)))


def contact_of(count, coefficients):
    """So many asperities, with one coefficient of friction, ten, or one each."""
    contact = ensemble(count, one_coefficient=True)
    if coefficients == "one":
        return contact
    number = count if coefficients == "one each" else min(count, 10)
    steps = FRICTION * np.linspace(0.75, 1.25, number)
    friction = steps[np.random.default_rng(2).permutation(count) % number]
    return hs.Ensemble(contact.pair, contact.summit_height, contact.summit_radius, friction)


# -- the closed form -------------------------------------------------------------------------------


def closed_form(contact, approach, displacement):
    """Total tangential load [N] at an approach along displacements that turn round at equal amplitudes, and μN [N]."""
    depth = np.maximum(approach - (contact.summit_height.max() - contact.summit_height), 0.0)
    depth, size = depth[depth > 0], contact.summit_radius[depth > 0]
    friction = np.broadcast_to(contact.friction, contact.summit_height.shape)[contact.first_touch < approach]
    radius = np.sqrt(size * depth)
    limit = friction * 4 / 3 * contact.pair.contact_modulus * radius * depth
    full = 3 * limit / (16 * radius * contact.pair.shear_modulus)

    def virgin(shift):
        return np.sum(limit * (1 - np.clip(1 - shift / full, 0, None) ** 1.5))

    turns = np.flatnonzero(np.diff(np.sign(np.diff(displacement)))) + 1
    loads, turned, reached, scale = np.zeros(displacement.size), 0.0, 0.0, 1
    for step in range(1, displacement.size):
        moved = displacement[step] - turned
        loads[step] = reached + math.copysign(scale * virgin(abs(moved) / scale), moved)
        if step in turns:
            turned, reached, scale = displacement[step], loads[step], 2
    return loads, limit.sum()


def error_of(contact, dataset):
    """Largest error of the total tangential load of a history, in parts of the limit, along its first loops."""
    shown = dataset.isel(step=slice(0, 4 * LOOP))
    approach = float(contact.summit_height.max() - shown.separation[0])
    loads, limit = closed_form(contact, approach, shown.tangential_displacement.values)
    return float(np.abs(shown.total_tangential_load.values - loads).max() / limit)


# -- cases -----------------------------------------------------------------------------------------


def kinds(count):
    """Yield the contacts of a size, and how they are driven and recorded, as replays without events."""
    for coefficients in ("one", "ten", "one each")[: 1 if count == 1 else 3]:
        contact = contact_of(count, coefficients)
        stiffness = as_stiff_as(contact)
        for control, record in itertools.product(("displacement", "load", "drive"), ("totals", "all")):
            # with one coefficient each, rows are projected as they are walked
            helped = record == "all" and count >= 10_000 and coefficients != "one each"
            for threads in (1, 2) if helped else (1,):
                told = {"coefficients": coefficients, "control": control, "recorded": record, "threads": threads}
                instrument = hs.Instrument(stiffness if control == "drive" else np.inf)
                yield told, hs.Replay(contact, [], record=record, instrument=instrument, threads=threads)


def replays(count, longest, gigabytes):
    """Time every combination that takes no more seconds and gigabytes than so many; tell of those that take more."""
    for kind, empty in kinds(count):
        of_each_event = 0.0
        for steps in EVENTS:
            case = {"asperities": count, "events": steps, **kind}
            size = BYTES_OF_EACH * count * steps / 1e9 if kind["recorded"] == "all" else 0.0
            if size > gigabytes or of_each_event * steps > longest:
                yield case | {"left_out": f"{size:.3g} GB" if size > gigabytes else f"{of_each_event * steps:.2g} s"}
                continue
            control = "load" if kind["control"] == "load" else "displacement"
            job = attrs.evolve(empty, events=history(empty.ensemble, steps, control, 0.0))
            made = []
            first = once(lambda: made.append(job.dataset()))  # noqa: B023
            error = error_of(job.ensemble, made.pop())
            seconds, processor = first if first[1] > 2.0 else least_times(job.dataset)
            of_each_event = processor / steps
            yield case | {
                "seconds": seconds,
                "processor_seconds": processor,
                "processor_ns_per_asperity_and_step": processor / steps / count * 1e9,
                "error": error,
            }


def floors(folder, count, steps):
    """Time what nobody can do without, for the arrays of one history, and the same written by this program."""
    contact = contact_of(count, "one")
    job = hs.Replay(contact, history(contact, steps, "displacement", 0.0), record="all")
    arrays = {str(name): variable.values for name, variable in job.dataset().data_vars.items()}
    targets = {name: np.zeros_like(array) for name, array in arrays.items()}
    size = sum(array.nbytes for array in arrays.values())

    def copy():
        for name, array in arrays.items():
            np.copyto(targets[name], array)

    def plain():
        with (folder / "plain").open("wb", buffering=0) as stream:
            for array in arrays.values():
                view = memoryview(np.ascontiguousarray(array)).cast("B")
                while view:
                    view = view[stream.write(view) :]
            os.fsync(stream.fileno())

    def in_one_go():
        with netCDF4.Dataset(folder / "plain.nc", "w") as file:
            file.createDimension("step", steps)
            file.createDimension("asperity", count)
            for name, array in arrays.items():
                file.createVariable(name, array.dtype, ("step", "asperity")[: array.ndim], fill_value=False)[:] = array
        with (folder / "plain.nc").open("rb") as stream:
            os.fsync(stream.fileno())

    found = {
        "copy in memory": copy,
        "plain write, fsync": plain,
        "netCDF in one go, fsync": in_one_go,
    } | {
        f"replay {where}, {counted}": partial(action, attrs.evolve(job, threads=threads))
        for where, action in (
            ("in memory", hs.Replay.dataset),
            ("to netCDF", lambda job: job.write(folder / "own.nc")),
        )
        for threads, counted in ((1, "one thread"), (2, "two threads"))
    }
    rows = []
    for name, action in found.items():
        seconds, processor = least_times(action)
        rows.append({"what": name, "MB": size / 1e6, "seconds": seconds, "processor_seconds": processor})
    return rows


# -- growth ----------------------------------------------------------------------------------------


def exponent(sizes, seconds):
    """The power with which a time grows from the second largest size to the largest."""
    return math.log(seconds[-1] / seconds[-2]) / math.log(sizes[-1] / sizes[-2])


def spiral(count):
    """Reversals, each a little smaller than the one before: the memory grows with each."""
    load = 0.004 * (1.0 - np.arange(count) / (count + 1.0)) * (-1.0) ** np.arange(count)
    return [hs.NormalLoad(0.0, 0.01), *(hs.TangentialLoad(*pair) for pair in enumerate(load.tolist(), start=1))]


def growths():
    """Yield how time grows with events, asperities, coefficients and depth of the memory."""
    few = contact_of(100, "one")
    pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
    one = hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=0.5)

    def with_coefficients(number):
        contact = contact_of(10_000, "one")
        friction = FRICTION * np.linspace(0.75, 1.25, number)[np.arange(10_000) % number]
        return hs.Ensemble(contact.pair, contact.summit_height, contact.summit_radius, friction)

    def loops(contact, steps, record="totals"):
        return hs.Replay(contact, history(contact, steps, "displacement", 0.0), record=record)

    ways = {
        "events (100 asperities, totals)": ((1000, 10_000, 100_000), lambda size: loops(few, size)),
        "asperities (100 events, all)": (
            (100, 10_000, 100_000),
            lambda size: loops(contact_of(size, "one"), 100, "all"),
        ),
        "coefficients (10⁴ asperities, totals)": ((10, 1000, 10_000), lambda size: loops(with_coefficients(size), 100)),
        "depth (reversals of a spiral)": (
            (1000, 10_000, 100_000),
            lambda size: hs.Replay(one, spiral(size), record="totals"),
        ),
    }
    for name, (sizes, job) in ways.items():
        seconds = [least_times(job(size).dataset, most=3)[1] for size in sizes]
        yield {"with": name, "sizes": sizes, "processor_seconds": seconds, "exponent": exponent(sizes, seconds)}


# -- what is told ----------------------------------------------------------------------------------


def table(title, rows):
    """Print rows, numbers to three digits."""
    print(f"\n{title}\n")
    columns = list(rows[0])
    texts = [columns, *([_text(row[name]) for name in columns] for row in rows)]
    widths = [max(len(line[place]) for line in texts) for place in range(len(columns))]
    for line in texts:
        print("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)), flush=True)


def _text(value):
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.3g}"
    return ", ".join(map(_text, value)) if isinstance(value, list | tuple) else str(value)


def main():
    """Read the arguments, time everything, and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--longest", type=float, default=20.0, help="the most seconds of processors for a replay")
    parser.add_argument("--gigabytes", type=float, default=3.0, help="the most that a replay may record")
    parser.add_argument("--steps", type=int, default=1000, help="steps of the history that is written, 10⁴ asperities")
    parser.add_argument("--json", type=Path, help="write all numbers to this file")
    options = parser.parse_args()
    # the C library of a file that is written may keep the other processor busy
    ctypes.CDLL(None).sync()
    found = {"made_with": made_with(), "processors": os.cpu_count(), "load_before": os.getloadavg()}
    sizes = ((10_000, options.steps), (100_000, max(options.steps // 10, 1)))
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as folder:
        found["floors"] = {f"{count} × {steps}": floors(Path(folder), count, steps) for count, steps in sizes}
    for what, rows in found["floors"].items():
        table(f"{what} steps, all variables", rows)
    found["growth"] = list(growths())
    table("Growth", found["growth"])
    found["replays"], found["left_out"] = [], []
    for count in SIZES:
        cases = list(replays(count, options.longest, options.gigabytes))
        timed = [case for case in cases if "seconds" in case]
        table(f"Replays in memory: {count} asperities", timed)
        found["replays"] += timed
        found["left_out"] += [case for case in cases if "left_out" in case]
    print(f"\nThe largest error of all is {max(case['error'] for case in found['replays']):.1g} of μN.")
    if found["left_out"]:
        table("Left out: what they would record, or about how long they would take", found["left_out"])
    found["load_after"] = os.getloadavg()
    print(f"\n{found['made_with']}; load {found['load_before'][0]:.1f} to {found['load_after'][0]:.1f}")
    if options.json:
        text = json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False)
        options.json.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
