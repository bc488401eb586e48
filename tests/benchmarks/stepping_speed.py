"""Time of one step by hand: `Ensemble.advance`, `Stepper.step`, its derivatives, and `ContactBatch.step`.

Run on one thread, after the package is installed::

    python tests/benchmarks/stepping_speed.py [--reversals 10000]

Times are of the processor, in µs: other programs hardly change them. The least of seven means of
200 steps counts; all asperities touch, totals alone are asked for.
"""

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import historysim as hs


def least_time(action, count=200):
    """Return the time of an action [µs of the processor]."""
    action()
    times = []
    for _ in range(7):
        start = time.process_time()
        for _ in range(count):
            action()
        times.append((time.process_time() - start) / count)
    return 1e6 * min(times)


def deep(ensemble, state, reversals):
    """Return a state that remembers ever smaller reversals, and one that it turns to."""
    largest = 8e-9
    way = largest * (-1.0) ** np.arange(reversals) * (1 - np.arange(reversals) / (reversals + 200))
    return ensemble.advance_many(state, tangential_displacement=way)[0]


def batch_time(contacts, steps=40):
    """Return the time of `ContactBatch.step` per contact and step [ns]: loops of 20 steps at a held approach."""
    rng = np.random.default_rng(1)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    batch = hs.ContactBatch(pair, rng.uniform(1e-3, 2e-3, contacts), 0.3, contacts)
    approach = rng.uniform(0.5e-6, 1.5e-6, contacts)
    amplitude, phase = rng.uniform(0.05e-6, 0.6e-6, contacts), rng.uniform(0, 2 * np.pi, contacts)
    times = []
    for step in range(steps):
        displacement = amplitude * np.sin(2 * np.pi * step / 20 + phase)
        start = time.process_time()
        batch.step(approach, displacement)
        times.append(time.process_time() - start)
    return 1e9 / contacts * float(np.median(times[steps // 2 :]))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--reversals", type=int, default=10_000)
    options = parser.parse_args()
    print(
        f"{'asperities':>10}{'vertices':>10}{'advance to U':>14}{'advance to T':>14}{'Stepper.step':>14}{'slopes':>8}"
    )
    for count in (1, 200, 10_000):
        rng = np.random.default_rng(1)
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ensemble = hs.Ensemble(
            pair, rng.normal(0, 40e-9, count), rng.uniform(10e-6, 30e-6, count), 0.2
        )
        state = ensemble.advance(
            ensemble.initial_state(),
            normal_displacement=float(np.ptp(ensemble.summit_height)) + 30e-9,
        )
        state = ensemble.advance(state, normal_load=state.normal_load)
        for reversals in (2, options.reversals):
            start = deep(ensemble, state, reversals)
            stepper = ensemble.stepper(start)
            displacement, load = start.tangential_displacement, start.tangential_load
            shares = iter(1.0 - 1e-8 * np.arange(1_000_000))
            times = [
                least_time(
                    lambda: ensemble.advance(
                        start, tangential_displacement=displacement * (1 - 1e-7)
                    )
                ),
                least_time(lambda: ensemble.advance(start, tangential_load=load * (1 - 1e-7))),
                least_time(
                    lambda: stepper.step(tangential_displacement=displacement * next(shares))
                ),
                least_time(stepper.slopes),
            ]
            advance_u, advance_t, step, slopes = times
            print(
                f"{count:>10}{len(start.vertices()):>10}{advance_u:>14.2f}{advance_t:>14.2f}{step:>14.2f}{slopes:>8.2f}"
            )
    for contacts in (1000, 1_000_000):
        print(
            f"ContactBatch of {contacts} contacts: {batch_time(contacts):.0f} ns per contact and step"
        )


if __name__ == "__main__":
    main()
