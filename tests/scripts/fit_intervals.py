"""Count how often intervals of fits hold the truth, and how often those of the halves of a record overlap.

Run as ``PYTHONPATH=tests/support python tests/scripts/fit_intervals.py [COUNT [PART …]]`` with the parts random_halves,
cut_halves, scattering_loops and white_noise; all of them, 200 times each, take some hours on one core.
"""

import sys

import numpy as np
import synthetic

# per sample: 2.5, 6 and 12 nm
RATES = (10.03, 4.18, 2.09)
SCATTERS = {
    "independent": {"scatter": 0.01},
    "correlated": {"scatter": 0.01, "correlation": 0.8, "hum": 5e-5},
}
RUN_IN = {"scatter": 0.01, "correlation": 0.5, "run_in": 0.05, "hum": 5e-5}


def white_noise(count):
    """Count for records of four loops with noise alone."""
    for kind, truth in synthetic.TRUTHS.items():
        for rate in RATES:
            fits = [synthetic.fitted(kind, seed, rate=rate) for seed in range(count)]
            for ends in (("low", "high"), ("noise_low", "noise_high")):
                held = [[synthetic.holds(each, *ends, kind) for each in fit.parameters] for fit in fits]
                shares = ", ".join(
                    f"{name} {share:.1%}" for name, share in zip(truth, np.mean(held, axis=0), strict=True)
                )
                print(f"{kind}, {rate:g} Hz, {ends[0]}: {shares} of {count}", flush=True)


def scattering_loops(count, loops=16, rows=1600):
    """Count for records whose friction scatters from branch to branch."""
    for name, shape in SCATTERS.items():
        fits = [synthetic.fitted_friction(synthetic.reciprocating(seed, loops, rows, **shape)) for seed in range(count)]
        wandering = np.mean([synthetic.holds(fit.parameters[0]) for fit in fits])
        noise = np.mean([synthetic.holds(fit.parameters[0], "noise_low", "noise_high") for fit in fits])
        print(f"{name} scatter, {loops} loops: {wandering:.1%} of {count}; by noise alone {noise:.1%}", flush=True)


def random_halves(count, loops=48, rows=42_579):
    """Count overlapping pairs of intervals: a random half of a record's loops, and the other half."""
    record = synthetic.reciprocating(0, loops, rows, **RUN_IN)
    pairs = (synthetic.random_half(record, seed) for seed in range(count))
    print(f"random halves: {_overlapping(pairs):.1%} of {count} overlap", flush=True)


def cut_halves(count, loops=48, rows=4_800):
    """Count overlapping pairs of intervals: the first half of a record that runs in, and the second."""
    records = (synthetic.reciprocating(1000 + seed, loops, rows, **RUN_IN) for seed in range(count))
    pairs = (
        [synthetic.part(record, half) for half in np.array_split(np.arange(record.time.size), 2)] for record in records
    )
    print(f"first and second halves: {_overlapping(pairs):.1%} of {count} overlap", flush=True)


def _overlapping(pairs):
    found = [[synthetic.fitted_friction(half).parameters[0] for half in pair] for pair in pairs]
    return np.mean([first.low <= second.high and second.low <= first.high for first, second in found])


PARTS = {part.__name__: part for part in (random_halves, cut_halves, scattering_loops, white_noise)}

if __name__ == "__main__":
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for name in sys.argv[2:] or PARTS:
        PARTS[name](many)
