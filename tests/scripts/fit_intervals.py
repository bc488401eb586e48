"""Count how often intervals of 95 % hold the truth, of fits and of loops, and how often those of halves overlap.

Run as ``PYTHONPATH=tests/support python tests/scripts/fit_intervals.py [COUNT [PART …]]`` with the
parts of ``synthetic.RECORDS`` and halves; all of them, 100 times each, take some ten minutes on one
core.
"""

import sys

import numpy as np
import synthetic


def held(part, count):
    """Count for fits of friction and of a stiffness in series, and for the mean friction of loops."""
    by_fit, by_loops, off, reach = synthetic.held(part, range(count))
    friction, stiffness = np.mean(by_fit, axis=0)
    bias = 100 * np.mean(off, axis=0)
    error = 100 * np.std(off, axis=0, ddof=1) / np.sqrt(count)
    told = ", ".join(f"{value:+.3f} ± {of:.3f} %" for value, of in zip(bias, error, strict=True))
    print(
        f"{part}: fits {friction:.0%} friction, {stiffness:.0%} stiffness; loops {np.mean(by_loops):.0%} of {count}; "
        f"off by {told}; {' and '.join(f'{wide:.2f}' for wide in synthetic.too_wide(off, reach))} times as wide as due",
        flush=True,
    )


def halves(count, loops=48, rows=9_600):
    """Count overlapping pairs of intervals of one record that runs in: random halves of its loops, and cut ones."""
    shape = {"scatter": 0.01, "correlation": 0.5, "run_in": 0.05, "hum": 5e-5}
    record = synthetic.reciprocating(0, loops, rows, **shape)
    print(
        f"random halves: {_overlapping(synthetic.random_half(record, seed) for seed in range(count))}",
        flush=True,
    )
    records = (synthetic.reciprocating(1000 + seed, loops, rows, **shape) for seed in range(count))
    cut = (
        [synthetic.part(each, half) for half in np.array_split(np.arange(each.time.size), 2)]
        for each in records
    )
    print(f"first and second halves: {_overlapping(cut)}", flush=True)


def _overlapping(pairs):
    found = [[synthetic.fitted_friction(half).parameters[0] for half in pair] for pair in pairs]
    agree = np.mean(
        [first.low <= second.high and second.low <= first.high for first, second in found]
    )
    drifts = np.mean([first.drifts or second.drifts for first, second in found])
    return f"{agree:.0%} overlap, a drift is told in {drifts:.0%}"


if __name__ == "__main__":
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    for name in sys.argv[2:] or [*synthetic.RECORDS, "halves"]:
        if name == "halves":
            halves(many)
        else:
            held(name, many)
