"""Notes on the loops of a record: left-out loops, and likely faults with their remedies.

Each fault of an instrument is found from the samples alone, and only where it is clear of the
noise.
"""

from collections.abc import Iterator
from itertools import chain, pairwise

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.measured import intervals
from historysim.measured.branch_shape import are_level, average_branches
from historysim.measured.branches import Branch, Trace
from historysim.measured.loop_table import CONFIDENCE
from historysim.measured.loop_values import DAMPER, QUANTITIES, LoopValues
from historysim.measured.reduction import (
    FEWEST_SAMPLES,
    FEWEST_SPIKES,
    REVERSAL,
    SPIKE,
    USUAL_STEPS,
    count_of_spikes,
    estimate_white_noise,
    noise_of_curve,
)

LEAST_DRIFT = 1e-3  # rise along a record over the mean up to which a drift has no note
# stroke over the noise of the displacement up to which a note says that noise decides
STROKE_OVER_NOISE = 40.0
MEDIAN_SHARE = 1 / 20  # samples of a running median over those of a branch: it cuts reversals
# Energy of a loop over the rectangle around it, 4TU, below which it is a spring's: .2 where a
# sphere just slides, by Cattaneo and Mindlin (8 times the area under 1 - (1 - u)^(3/2), less 4),
# and more beyond.
NARROW = 0.05
# Samples in a row, and share of all, that are the very extreme of a channel with noise, where it is
# clipped.
CLIPPED_RUN, CLIPPED_SHARE = 5, 5e-3
# noise by fourth differences over that by second ones, between which it is white
WHITE = (0.6, 1.5)
# over the range of a channel, up to which it is no noise but few samples of a steep curve
MOST_NOISE = 0.01
ROUNDING = 1e-9  # difference of two samples over the range that is none
CLOSES = 5.0  # deviations of the noise of the load within which a clearance is not taken as closed
FOLLOWS = 0.7  # correlation of load and displacement above which the load follows the displacement
OFFSET = 0.02  # offset or drift of the load over the friction force, from which on it has a note
# Lost motion over the stroke, and over the elastic displacement for the same load, above which it
# is reported.
LOST_OVER_STROKE, LOST_OVER_ELASTIC = 0.03, 3.0
# Drop of the load from one sample to the next, over the friction force, and drops on a branch, that
# are stick-slip.
LEAST_DROP, FEWEST_DROPS = 0.1, 2


def loop_notes(loops: LoopValues) -> tuple[str, ...]:
    """Return notes on left-out loops, likely faults, and quantities that need more samples."""
    return (
        *_noise(loops),
        *_no_friction(loops),
        *_parallel_spring(loops),
        *hook_notes(loops),
        *instrument_faults(loops),
        *drift_notes(loops),
        *loops.exclusions,
        *_still_rising(loops),
        *_narrow(loops),
        *_unknown_stiffness(loops),
    )


def _no_friction(loops: LoopValues) -> Iterator[str]:
    classes = loops.no_friction
    mend = "longer strokes slide"
    if any(loops.large[members].any() for members, _ in classes):
        mend = (
            loops.columns
            or "is the column of the tangential load right? historysim columns FILE shows what there is"
        )
    for members, text in classes:
        if DAMPER in text:
            yield f"{text}: dry friction is level where it slides, whatever the speed, and the model has no damper"
            continue
        sticks = bool(loops.large[members].any()) and _is_elastic(loops, members)
        yield f"{text}; {'longer strokes slide where a contact still sticks; ' * sticks}{mend}"


def _is_elastic(loops: LoopValues, members: Integers) -> bool:
    """Return True if the load of some loops correlates with the displacement, as in a sticking contact."""
    samples = slice(loops.ends[members[0], 0], loops.ends[members[-1], 2] + 1)
    with np.errstate(invalid="ignore"):
        correlation = np.corrcoef(
            loops.trace.displacement[samples], loops.trace.tangential_load[samples]
        )[0, 1]
    return bool(correlation > FOLLOWS)


def _parallel_spring(loops: LoopValues) -> Iterator[str]:
    stiffness = loops.parallel_stiffness
    if not stiffness > 0:
        return
    trace = loops.trace
    ends = loops.ends[loops.large & ~loops.left_out_branches.any(axis=1)]
    contact = attrs.evolve(
        trace, tangential_load=trace.tangential_load - stiffness * trace.displacement
    )
    # over both directions the zero of the spring cancels
    force = float(np.mean([shape.force for shape in average_branches(contact, ends) or ()]))
    load = (
        float(np.median(loops.normal_load[np.isfinite(loops.normal_load)]))
        if trace.normal_load is not None
        else 0.0
    )
    coefficient = f", a coefficient of {force / load:.4g}" if load > 0 else ""
    text = quantity_text(stiffness, "N/m", 3)
    yield (
        f"the load rises by {text} along each stroke behind its beginning, forward and backward alike: a spring in "
        f"parallel with the contact, such as a flexure or a guide; friction without it is "
        f'{quantity_text(force, "N", 4)}{coefficient}; parallel_stiffness = "{text}" in [instrument] takes it off'
    )


def hook_notes(loops: LoopValues) -> Iterator[str]:
    """Yield a note on loads that rise again at the ends of the stroke, and on strokes without."""
    hooked = loops.hooked_branches & loops.large[:, None]
    if not hooked.any():
        return
    trace = loops.trace
    large = loops.ends[loops.large]
    forces = loops.friction_force[loops.large].mean(axis=1)
    rise = max(
        float(np.abs(trace.tangential_load[start : stop + 1]).max() - force)
        for (start, _, stop), force in zip(large.tolist(), forces, strict=True)
    )
    within = []
    for side, extreme in enumerate((np.max, np.min)):
        ends = loops.level_end[hooked[:, side], side]
        within.append(
            float(np.median(ends if ends.size else extreme(trace.displacement[large], axis=1)))
        )
    high, low = (quantity_text(end, "m", 3) for end in within)
    count = int((np.isfinite(loops.friction_force) & loops.large[:, None]).sum())
    forward, backward = (bool(side.any()) for side in hooked.T)
    where = "" if forward and backward else ", forward alone" if forward else ", backward alone"
    energy = float(np.nanmean(loops.dissipated_energy[loops.large]))
    yield (
        f"the load rises again at the ends of the stroke: a stop or interlocking{where}, on {int(hooked.sum()):,} of "
        f"{count_text(count, 'branch', 'branches')}, by up to {quantity_text(rise, 'N', 3)}. Friction is that of the "
        f"level part before it; the energy of {quantity_text(energy, 'J', 4)} per loop is that of the whole loop, and "
        f"the stiffness at a reversal that of contact and stop. The model has no stop: strokes within {low} to {high} "
        "do not reach it"
    )


def _noise(loops: LoopValues) -> Iterator[str]:
    noise = loops.displacement_noise
    if not noise:
        return
    of = quantity_text(noise, "m", 2)
    stroke = 2 * float(np.median(loops.amplitude[loops.large]))
    if loops.dead_band < REVERSAL * noise:
        # two digits of it are six deviations or more
        band = quantity_text(1.05 * REVERSAL * noise, "m", 2)
        yield (
            f"the dead band is {loops.dead_band / noise:.2g} deviations of the noise of the displacement, {of}: noise "
            f"may be taken for reversals; use six deviations, {band}, or more"
        )
    elif stroke <= STROKE_OVER_NOISE * noise:
        per_branch = float(np.median(np.diff(loops.ends[loops.large], axis=1)))
        window = 2 * int(MEDIAN_SHARE * per_branch / 2) + 1
        median = f"median = {window} at the displacement, or " if window > 1 else ""
        yield (
            f"the stroke of {quantity_text(stroke, 'm', 3)} is only {stroke / noise:.2g} σ of the displacement noise, "
            f"{of}: reversal points are unreliable; use {median}longer strokes"
        )


def drift_notes(loops: LoopValues) -> Iterator[str]:
    """Yield a note on drift from loop to loop, if all of them are at one load."""
    if len(loops.by_load()) > 1 or loops.no_friction or loops.parallel_stiffness > 0:
        return
    has_coefficient = np.isfinite(loops.friction_coefficient).any()
    name = "friction_coefficient" if has_coefficient else "friction_force"
    wander = loops.wander(name)
    mean = loops.statistics(name).mean
    if wander is None or not wander.drifts or abs(wander.rise) < LEAST_DRIFT * abs(mean):
        return
    course = ""
    if has_coefficient:
        ends = loops.trace.time[loops.ends[[0, -1], [0, 2]]].tolist()
        times = ", ".join(f'"{quantity_text(time, "s", 4)}"' for time in ends)
        course = f"; [friction.course] with time = [{times}] and these coefficients models it"
    quantity = QUANTITIES[name]
    unit = quantity.unit
    start, end = (quantity_text(mean + sign * wander.rise / 2, unit) for sign in (-1, 1))
    low, high = (quantity_text(wander.rise + sign * wander.rise_reach, unit) for sign in (-1, 1))
    yield (
        f"the {quantity.label} drifts, from {start} at the start to {end} at the end of the record, by {low} to {high} "
        f"(95 %); its mean and the interval of it are those of the middle{course}"
    )


def _still_rising(loops: LoopValues) -> Iterator[str]:
    rising = loops.rising_branches & (loops.large & loops.is_friction)[:, None]
    if not rising.any():
        return
    many = int((np.isfinite(loops.friction_force) & loops.large[:, None]).sum())
    coefficient = loops.friction_coefficient[rising]
    bound = (
        f"coefficients, {coefficient.min():.4g} to {coefficient.max():.4g}"
        if np.isfinite(coefficient).all()
        else f"forces, {quantity_text(float(loops.friction_force[rising].min()), 'N')} and more"
    )
    share = 100 * loops.definitions.still_rising
    longer = "" if loops.hooked_branches.any() else "; use longer strokes"
    yield (
        f"{int(rising.sum()):,} of {count_text(many, 'branch', 'branches')} do not reach sliding: the load still rises "
        f"by more than {share:.3g} % where it should be level. Their {bound}, are lower bounds and are left out of the "
        f"means{longer}"
    )


def _narrow(loops: LoopValues) -> Iterator[str]:
    force = loops.friction_force.mean(axis=1)
    around = 4 * force * (loops.amplitude - force / loops.lateral_stiffness)
    slid = loops.large & loops.is_friction & (around > 0) & ~loops.rising_branches.any(axis=1)
    narrow = slid & (loops.dissipated_energy < NARROW * around)
    if not narrow.any():
        return
    share = max(float((loops.dissipated_energy[narrow] / around[narrow]).max()), 0.0)
    yield (
        f"{int(narrow.sum()):,} of {count_text(int(slid.sum()), 'loop', 'loops')} are almost lines: they enclose "
        f"{100 * share:.2g} % or less of the rectangle 4TU around them. A spring does so; a sphere that just slides "
        "encloses 20 %. Check that the displacement is not that of a soft drive (give its stiffness in [instrument]), "
        "and that the load was measured and not computed"
    )


def _unknown_stiffness(loops: LoopValues) -> Iterator[str]:
    unknown = (
        np.isnan(loops.tangential_stiffness) & ~loops.left_out_branches & ~loops.stepped_branches
    )
    if not unknown.any():
        return
    yield (
        f"{int(unknown.any(axis=1).sum()):,} of {count_text(len(loops), 'loop', 'loops')} without a stiffness at "
        f"reversal: the first part of a branch, {loops.definitions.initial_text}, needs two samples or more that rise; "
        "record more often (substeps of a simulation), or take a longer first part"
    )


# -- faults of an instrument -----------------------------------------------------------------------


def instrument_faults(loops: LoopValues) -> list[str]:
    """Return a note for each instrument fault in a record; none if it has few samples or no noise.

    What is read off sliding needs branches that are level at their ends: a contact that sticks in
    part has an offset and another stiffness.
    """
    trace = loops.trace
    noise = loops.displacement_noise
    if not noise or trace.time.size < FEWEST_SAMPLES:
        return []
    complete = loops.large & ~loops.left_out_branches.any(axis=1)
    slid = complete & loops.is_friction & ~loops.rising_branches.any(axis=1)
    slides = not loops.parallel_stiffness > 0 and are_level(trace, loops.ends[slid])
    return [
        *_clipping(trace.tangential_load),
        *_spikes(trace),
        *(
            _zero_error(loops.friction_force[slid])
            if slides or loops.hooked_branches[slid].any()
            else ()
        ),
        *(_lost_motion(trace, loops.ends[slid], noise) if slides else ()),
        *_stick_slip(trace, loops.ends[complete]),
    ]


def _clipping(load: Floats) -> Iterator[str]:
    for name, extreme in (("greatest", load.max()), ("least", load.min())):
        extremes = load == extreme
        inside = (load > load.min()) & (load < load.max())
        edges = np.flatnonzero(np.diff(np.concatenate([[0], extremes.astype(np.int8), [0]])))
        longest = int(np.max(edges[1::2] - edges[::2]))
        few = np.count_nonzero(inside) < FEWEST_SAMPLES
        if (
            few
            or longest < CLIPPED_RUN
            or extremes.mean() < CLIPPED_SHARE
            or not _scatters(load[inside])
        ):
            continue
        yield (
            f"{int(extremes.sum()):,} samples of the tangential load are its {name} value, "
            f"{quantity_text(extreme, 'N')}, up to {longest:,} in a row: it looks clipped, and "
            "friction and energy are too small; take a wider range"
        )


def _scatters(values: Floats) -> bool:
    """Return True if samples have independent noise of a digit or more: else a level is not clipping.

    Of white noise differences of any order show as much; a smooth curve hardly has fourth
    differences.
    """
    noise = estimate_white_noise(values)
    fourth = noise_of_curve(values)
    steps = np.diff(np.unique(values))
    digit = float(steps[steps > ROUNDING * np.ptp(values)].min(initial=np.inf))
    white = WHITE[0] * noise <= fourth <= WHITE[1] * noise
    return white and digit <= noise <= MOST_NOISE * float(np.ptp(values))


def _spikes(trace: Trace) -> Iterator[str]:
    channels = {"tangential load": trace.tangential_load, "displacement": trace.displacement}
    for name, values in channels.items():
        count = count_of_spikes(values, USUAL_STEPS)
        if count >= FEWEST_SPIKES:
            yield (
                f"{count_text(count, 'sample', 'samples')} of the {name}, {100 * count / values.size:.2g} %, stand out "
                "from both neighbours: they look like spikes, which change what is read off; median = 5 at this "
                "channel removes them"
            )


def _zero_error(friction_force: Floats) -> Iterator[str]:
    forward, backward = friction_force.T
    complete = np.isfinite(forward) & np.isfinite(backward)
    if np.count_nonzero(complete) < intervals.FEWEST_LOOPS:
        return
    middle = (forward - backward)[complete] / 2
    force = float((forward + backward)[complete].mean()) / 2
    wander = intervals.compute_mean_wander(middle, CONFIDENCE)
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


def _branches(trace: Trace, all_ends: Integers) -> Iterator[Branch]:
    """Yield the branches of loops."""
    for start, stop in chain.from_iterable(map(pairwise, all_ends.tolist())):
        yield Branch.from_trace(trace, start, stop)


def _lost_motion(trace: Trace, ends: Integers, noise: float) -> Iterator[str]:
    """Find displacement without load, at zero load or after a reversal, beyond the elastic part."""
    # of each branch: both widths, the elastic parts, and the speed
    branches = []
    for branch in _branches(trace, ends):
        time = branch.time
        order = np.argsort(branch.moved, kind="stable")
        moved = branch.moved[order]
        load = branch.load[order]
        force = float(np.mean(load[moved >= 0.75 * moved[-1]]))
        if not (force > 0 and load[0] < -0.5 * force) or moved.size < FEWEST_SAMPLES:
            continue
        levels = force * np.array([-0.9, -0.8, -0.5, -0.1, 0.1, 0.5])
        reached = np.maximum.accumulate(load)
        index = np.clip(np.searchsorted(reached, levels), 1, moved.size - 1)
        # between two samples the load rises straight
        rise = reached[index] - reached[index - 1]
        share = np.clip((levels - reached[index - 1]) / np.where(rise > 0, rise, 1.0), 0.0, 1.0)
        at_turn, after_turn, low, left_edge, right_edge, high = moved[index - 1] + share * (
            moved[index] - moved[index - 1]
        )
        elastic_width = min(left_edge - low, high - right_edge) / 2
        elastic_at_turn = (low - after_turn) / 3
        speed = moved[-1] / (time[-1] - time[0]) if time[-1] > time[0] else np.nan
        width = right_edge - left_edge - elastic_width
        # the loads between which nine tenths of it are crossed
        opens, closes = np.interp(
            (left_edge + right_edge) / 2 + width * np.array([-0.45, 0.45]), moved, reached
        )
        closing = (closes - opens) / 1.8
        branches.append(
            (width, elastic_width, at_turn - elastic_at_turn, elastic_at_turn, speed, closing)
        )
    if len(branches) < intervals.FEWEST_LOOPS:
        return
    width, elastic_width, width_behind, elastic_at_turn, speed, closing = np.median(
        np.array(branches), axis=0
    ).tolist()
    stroke = float(np.median(np.abs(np.diff(trace.displacement[ends], axis=1))))
    threshold = max(LOST_OVER_STROKE * stroke, SPIKE * noise)
    if width >= max(threshold, LOST_OVER_ELASTIC * elastic_width):
        of = quantity_text(width, "m", 2)
        # within its noise a load does not say on which side the clearance is
        closes_at = quantity_text(
            max(closing, CLOSES * estimate_white_noise(trace.tangential_load)), "N", 3
        )
        yield (
            f"the displacement continues by {of} at zero load: it looks like a free play in the path of the load, "
            f'which displacements and stiffness hold; free_play = "{of}" and closing_load = "{closes_at}" at the '
            "displacement remove it"
        )
    if width_behind >= max(threshold, LOST_OVER_ELASTIC * elastic_at_turn):
        late = quantity_text(width_behind / speed, "s", 3)
        lag = (
            f', or the load lags by {late}, which shift = "-{late}" at the tangential load removes'
        )
        yield (
            f"the load stays for {quantity_text(width_behind, 'm', 2)} behind a reversal: it looks like play of the "
            f"drive{lag if speed > 0 else ''}; energies and displacements hold it"
        )


def _stick_slip(trace: Trace, ends: Integers) -> Iterator[str]:
    drops, branches, largest = 0, 0, 0.0
    noise = estimate_white_noise(trace.tangential_load)
    for branch in _branches(trace, ends):
        slides = branch.load[branch.moved >= 0.5 * branch.moved[-1]]
        if slides.size < FEWEST_SAMPLES:
            continue
        branches += 1
        steps = np.diff(slides)
        threshold = max(LEAST_DROP * float(slides.mean()), SPIKE * noise)
        # abrupt fall and slow rise
        falls = int((steps < -threshold).sum())
        rises = int((steps > threshold).sum())
        if falls >= FEWEST_DROPS and falls > 3 * rises:
            drops = drops + falls
            largest = max(largest, float(-steps.min()))
    if branches and drops >= FEWEST_DROPS * branches:
        yield (
            f"the load drops by up to {quantity_text(largest, 'N', 2)} some {drops / branches:.2g} times on a "
            "branch, and rises slowly again: it looks like stick-slip, which the model does not have; friction is "
            "the mean over it"
        )
