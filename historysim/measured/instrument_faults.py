"""What a record looks like: faults of an instrument that change what is read off its loops, each with its mend.

Each is told from the samples alone, and only where it stands clear of the noise; what looks alike is said to.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.measured import scatter
from historysim.measured.loop_values import LoopValues, Trace
from historysim.measured.noise import FEWEST_SAMPLES, noise_of
from historysim.measured.power_law import CONFIDENCE

CLIPPED_RUN, CLIPPED_SHARE = 5, 5e-3
"""Samples in a row, and share of all, that are the very extreme of a channel with noise, where it is clipped."""
SPIKE = 10.0
"""Deviations of the noise, and three times its usual steps, by which a spike stands out to both sides."""
FEWEST_SPIKES = 3
OFFSET = 0.02
"""Offset or drift of the load over the friction force, from which on it is told."""
LOST, TIMES = 0.03, 3.0
"""Lost motion over the stroke, and over what the stiffness beside it takes for the same load, where it is told."""
DROP = 0.1
"""A drop of the load from one sample to the next few, over the friction force, that makes stick-slip."""
DROPS = 2


def instrument_faults(loops: LoopValues) -> list[str]:
    """Return what the record of some loops looks like, a text for each fault.

    None for a record of few samples, or one whose displacement has no noise that is known.
    """
    trace, noise = loops.trace, loops.displacement_noise
    if not noise or trace.time.size < FEWEST_SAMPLES:
        return []
    whole = loops.large & ~loops.left_out_branches.any(axis=1)
    ends = loops.ends[whole]
    return [
        *_clipped(trace.tangential_load),
        *_spikes(trace),
        *_of_the_zero(loops.friction_force[whole]),
        *_lost_motion(trace, ends, noise),
        *_stick_slip(trace, ends),
    ]


def _clipped(load: Floats) -> Iterator[str]:
    for name, extreme in (("greatest", load.max()), ("least", load.min())):
        at = load == extreme
        edges = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(np.int8), [0]])))
        longest = int(np.max(edges[1::2] - edges[::2]))
        few = np.count_nonzero(~at) < FEWEST_SAMPLES
        if few or longest < CLIPPED_RUN or at.mean() < CLIPPED_SHARE or noise_of(load[~at]) == 0:
            continue
        yield (
            f"{int(at.sum()):,} samples of the tangential load are its {name} value, {quantity_text(extreme, 'N')}, "
            f"up to {longest:,} in a row: it looks clipped, and friction and energy are too small; take a wider range"
        )


def _spikes(trace: Trace) -> Iterator[str]:
    channels = {"tangential load": trace.tangential_load, "displacement": trace.displacement}
    for name, values in channels.items():
        steps = np.diff(values)
        up, down = steps[:-1], -steps[1:]
        alone = np.where(up * down > 0, np.minimum(np.abs(up), np.abs(down)), 0.0)
        least = max(SPIKE * noise_of(values), 3 * float(np.quantile(np.abs(steps), 0.98)))
        count = int(np.count_nonzero(alone > least)) if least > 0 else 0
        if count >= FEWEST_SPIKES:
            yield (
                f"{counted(count, 'sample', 'samples')} of the {name}, {100 * count / values.size:.2g} %, stand out "
                "from both neighbours: they look like spikes, which change what is read off; median = 5 at this "
                "channel removes them"
            )


def _of_the_zero(friction_force: Floats) -> Iterator[str]:
    forward, backward = friction_force.T
    known = np.isfinite(forward) & np.isfinite(backward)
    if np.count_nonzero(known) < scatter.FEWEST_LOOPS:
        return
    middle, force = (forward - backward)[known] / 2, float((forward + backward)[known].mean()) / 2
    wander = scatter.of_values(middle, CONFIDENCE)
    if wander is None or not force > 0:
        return
    offset = float(middle.mean())
    if wander.drifts and abs(wander.rise) > OFFSET * force:
        yield (
            f"the zero of the tangential load drifts by {quantity_text(wander.rise, 'N', 3)} along the record, "
            f"{100 * abs(wander.rise) / force:.2g} % of the friction force: drift_free = true at this channel "
            "removes it"
        )
    elif abs(offset) > max(OFFSET * force, wander.reach):
        yield (
            f"the tangential load has an offset of {quantity_text(offset, 'N', 3)}, {100 * abs(offset) / force:.2g} "
            "% of the friction force, or friction differs between the directions: means over both directions are "
            "free of it, a fit is not; centred = true at this channel removes it"
        )


def _branches(trace: Trace, all_ends: Integers) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield time, displacement from the reversal and load of each branch, in its own direction."""
    moved, load = trace.displacement, trace.tangential_load
    for first, last in [branch for ends in all_ends for branch in pairwise(ends)]:
        sign, part = (1.0 if moved[last] > moved[first] else -1.0), slice(first, last + 1)
        yield trace.time[part], sign * (moved[part] - moved[first]), sign * load[part]


def _lost_motion(trace: Trace, ends: Integers, noise: float) -> Iterator[str]:
    """Tell displacement without load, at zero load or behind a reversal, from what the stiffness beside it takes."""
    ratios: dict[str, list[tuple[float, float, float]]] = {"zero": [], "reversal": []}
    for time, unsorted, loads in _branches(trace, ends):
        order = np.argsort(unsorted, kind="stable")
        moved, load = unsorted[order], loads[order]
        force = float(np.mean(load[moved >= 0.75 * moved[-1]]))
        if not (force > 0 and load[0] < -0.5 * force) or moved.size < FEWEST_SAMPLES:
            continue
        rising = np.maximum.accumulate(load)
        speed = moved[-1] / (time[-1] - time[0]) if time[-1] > time[0] else np.nan

        def at(share: float, rising: Floats = rising, moved: Floats = moved, force: float = force) -> float:
            return float(moved[min(int(np.searchsorted(rising, share * force)), moved.size - 1)])

        low, high = at(-0.1), at(0.1)
        beside = min(at(-0.1) - at(-0.5), at(0.5) - at(0.1)) / 2
        ratios["zero"].append(((high - low - beside), beside, speed))
        behind = (at(-0.5) - at(-0.8)) / 3
        ratios["reversal"].append((at(-0.9) - behind, behind, speed))
    for place, branches in ratios.items():
        if len(branches) < scatter.FEWEST_LOOPS:
            continue
        width, beside, speed = np.median(np.array(branches), axis=0)
        stroke = float(np.median(np.abs(np.diff(trace.displacement[ends], axis=1))))
        if width < max(LOST * stroke, TIMES * beside, SPIKE * noise):
            continue
        of = quantity_text(float(width), "m", 2)
        if place == "zero":
            yield (
                f"the displacement goes on by {of} at zero load: it looks like a free play in the path of the load, "
                f'which displacements and stiffness hold; free_play = "{of}" at the displacement removes it'
            )
        else:
            lag = f", or the load lags by {quantity_text(float(width / speed), 's', 2)}" if speed > 0 else ""
            yield (
                f"the load stays for {of} behind a reversal: it looks like backlash of the drive{lag}; "
                "energies and displacements hold it (shift at a channel removes a lag)"
            )


def _stick_slip(trace: Trace, ends: Integers) -> Iterator[str]:
    drops, branches, largest = 0, 0, 0.0
    noise = noise_of(trace.tangential_load)
    for _, moved, load in _branches(trace, ends):
        slides = load[moved >= 0.5 * moved[-1]]
        if slides.size < FEWEST_SAMPLES:
            continue
        force = float(slides.mean())
        steps = np.diff(slides)
        # down at once, and slowly up again
        falls = (steps < -max(DROP * force, SPIKE * noise)).sum()
        rises = (steps > max(DROP * force, SPIKE * noise)).sum()
        branches += 1
        if falls >= DROPS and falls > 3 * rises:
            drops += int(falls)
            largest = max(largest, float(-steps.min()))
    if branches and drops >= DROPS * branches:
        yield (
            f"the load drops by up to {quantity_text(largest, 'N', 2)} some {drops / branches:.2g} times on a "
            "branch, and rises slowly again: it looks like stick-slip, which the model does not have; friction is "
            "the mean over it"
        )
