"""Speed of the replay per asperity and step, on one thread, against the time that numpy takes to copy the same output.

Run it after the package is installed::

    python tests/benchmarks/replay_speed.py [--asperities 10000] [--steps 200] [--repeats 5]

Each case is replayed once to warm up with the same size, then ``--repeats`` times; the median of
processor times counts, which other programs change less than those on the wall.
numpy copies the recorded arrays twice: into arrays that have been touched before, and into new
ones, which the system has to provide as it does those of a replay.
"""

import argparse
import os
import statistics
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import historysim as hs

FRICTION = 0.2


def ensemble(count, one_coefficient):
    rng = np.random.default_rng(1)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    friction = FRICTION if one_coefficient else rng.uniform(0.75 * FRICTION, 1.25 * FRICTION, count)
    return hs.Ensemble(
        pair, rng.normal(0.0, 40e-9, count), rng.uniform(10e-6, 30e-6, count), friction
    )


def history(contact, steps, tangential, normal_swing):
    """Loops of 40 steps at a load that keeps all asperities in contact, with a normal load that swings or does not."""
    spread = np.ptp(contact.summit_height)
    state = contact.advance(contact.initial_state(), normal_displacement=spread + 30e-9)
    load = state.normal_load
    phase = 2 * np.pi * np.arange(steps) / 40
    normal = load * (1.0 + normal_swing * np.sin(0.3 * np.arange(steps)))
    events = []
    for step in range(steps):
        if step == 0 or normal_swing:
            events.append(hs.NormalLoad(step, normal[step]))
        if tangential == "load":
            events.append(hs.TangentialLoad(step, 0.4 * FRICTION * load * np.sin(phase[step])))
        else:
            events.append(hs.TangentialDisplacement(step, 150e-9 * np.sin(phase[step])))
    return events


def as_stiff_as(contact):
    """Lateral stiffness of the pressed contact before anything slips [N/m]."""
    pressed = contact.advance(
        contact.initial_state(), normal_displacement=np.ptp(contact.summit_height) + 30e-9
    )
    moved = contact.advance(pressed, tangential_displacement=1e-15)
    return moved.tangential_load / 1e-15


def median_time(action, repeats):
    action()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return statistics.median(times)


def copy_times(dataset, repeats):
    """Times of a copy into arrays that have been touched before, and into new ones."""
    arrays = [variable.values for variable in dataset.data_vars.values() if variable.ndim == 2]
    targets = [np.zeros_like(array) for array in arrays]

    def copy():
        for array, target in zip(arrays, targets, strict=True):
            np.copyto(target, array)

    touched = median_time(copy, repeats)
    targets.clear()
    return touched, median_time(lambda: [array.copy() for array in arrays], repeats)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--asperities", type=int, default=10_000)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    count, steps, repeats = options.asperities, options.steps, options.repeats

    print(f"{count} touching asperities, {steps} steps, median of {repeats}\n")
    print(f"{'coefficients':<14}{'controlled':<14}{'normal load':<14}{'recorded':<10}", end="")
    print(f"{'ns/(asperity·step)':>20}{'ms/step':>9}")
    for one_coefficient in (True, False):
        contact = ensemble(count, one_coefficient)
        for tangential in ("displacement", "load", "drive"):
            instrument = hs.Instrument(as_stiff_as(contact) if tangential == "drive" else np.inf)
            for normal_swing in (0.0, 1e-3) if tangential == "load" else (0.0, 0.1):
                events = history(contact, steps, tangential, normal_swing)
                for record in ("all", "totals"):
                    seconds = median_time(
                        lambda: hs.replay(
                            contact, events, record=record, instrument=instrument, threads=1
                        ),
                        repeats,
                    )
                    print(
                        f"{'one' if one_coefficient else 'one each':<14}{tangential:<14}"
                        f"{f'±{normal_swing:.1%}' if normal_swing else 'constant':<14}{record:<10}"
                        f"{seconds / steps / count * 1e9:>20.1f}{seconds / steps * 1e3:>9.3f}"
                    )
    touched, new = (
        each / steps / count * 1e9
        for each in copy_times(hs.replay(contact, events, record="all"), repeats)
    )
    print(
        f"\nnumpy copies the same arrays in {touched:.1f} ns per asperity and step, into new ones in {new:.1f}"
    )


if __name__ == "__main__":
    main()
