"""Notes on the loops of a record: what decides what is read off them, and what mends it."""

from collections.abc import Iterator

import numpy as np

from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.measured.instrument_faults import instrument_faults
from historysim.measured.loop_values import LoopValues
from historysim.measured.noise import REVERSAL

LEAST_DRIFT = 1e-3
"""Rise along a record over the mean up to which a drift is not worth a line."""
STROKE_OVER_NOISE = 40.0
"""Stroke over the noise of the displacement up to which a note tells that noise decides."""
NARROW = 0.05
"""Energy of a loop over the rectangle around it, 4TU, below which it is a spring's: .2 where a sphere just slides, by
Cattaneo and Mindlin (8 times the area under 1 - (1 - u)^(3/2), less 4), and more beyond."""


def loop_notes(loops: LoopValues) -> tuple[str, ...]:
    """Return what was left out of loops, and what the samples are too few to tell, with the mend."""
    return (
        *_noise(loops),
        *instrument_faults(loops),
        *_drift(loops),
        *loops.told,
        *_still_rising(loops),
        *_narrow(loops),
        *_unknown_stiffness(loops),
    )


def _noise(loops: LoopValues) -> Iterator[str]:
    noise = loops.displacement_noise
    if not noise:
        return
    of, stroke = quantity_text(noise, "m", 2), 2 * float(np.median(loops.amplitude[loops.large]))
    if loops.dead_band < REVERSAL * noise:
        yield (
            f"the dead band is {loops.dead_band / noise:.2g} deviations of the noise of the displacement, {of}: noise "
            f"may be taken for reversals; use six deviations, {quantity_text(REVERSAL * noise, 'm', 2)}, or more"
        )
    elif stroke <= STROKE_OVER_NOISE * noise:
        yield (
            f"strokes of {quantity_text(stroke, 'm', 3)} are {stroke / noise:.2g} deviations of the noise of the "
            f"displacement, {of}: noise decides where branches begin and end, and what is read off near reversals; "
            "low_pass or median at this channel remove noise, and longer strokes stand out from it"
        )


def _drift(loops: LoopValues) -> Iterator[str]:
    """Yield what drifts from loop to loop, where all of them are at one load."""
    if len(loops.by_load()) > 1:
        return
    known = np.isfinite(loops.friction_coefficient).any()
    quantity, label, unit = (
        ("friction_coefficient", "friction coefficient", "1") if known else ("friction_force", "friction force", "N")
    )
    wander, mean = loops.wander(quantity), loops.statistics(quantity).mean
    if wander is None or not wander.drifts or abs(wander.rise) < LEAST_DRIFT * abs(mean):
        return
    start, end = (quantity_text(mean + sign * wander.rise / 2, unit) for sign in (-1, 1))
    low, high = (quantity_text(wander.rise + sign * wander.rise_reach, unit) for sign in (-1, 1))
    yield (
        f"the {label} drifts, from {start} at the start to {end} at the end of the record, by {low} to {high} (95 %); "
        "its mean and the interval of it are those of the middle"
    )


def _still_rising(loops: LoopValues) -> Iterator[str]:
    rising = loops.rising_branches & loops.large[:, None]
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
    yield (
        f"{int(rising.sum()):,} of {counted(many, 'branch', 'branches')} do not reach sliding: the load still rises by "
        f"more than {share:.3g} % where it should be level. Their {bound}, are lower bounds and are left out of the "
        "means; use longer strokes"
    )


def _narrow(loops: LoopValues) -> Iterator[str]:
    force = loops.friction_force.mean(axis=1)
    around = 4 * force * (loops.amplitude - force / loops.lateral_stiffness)
    slid = loops.large & (around > 0) & ~loops.rising_branches.any(axis=1)
    narrow = slid & (loops.dissipated_energy < NARROW * around)
    if not narrow.any():
        return
    share = max(float((loops.dissipated_energy / around)[narrow].max()), 0.0)
    yield (
        f"{int(narrow.sum()):,} of {counted(int(slid.sum()), 'loop', 'loops')} are almost lines: they enclose "
        f"{100 * share:.2g} % or less of the rectangle 4TU around them. A spring does so; a sphere that just slides "
        "encloses 20 %. Check that the displacement is not that of a soft drive (give its stiffness in [instrument]), "
        "and that the load was measured and not computed"
    )


def _unknown_stiffness(loops: LoopValues) -> Iterator[str]:
    unknown = np.isnan(loops.tangential_stiffness) & ~loops.left_out_branches & ~loops.stepped_branches
    if not unknown.any():
        return
    yield (
        f"{int(unknown.any(axis=1).sum()):,} of {counted(len(loops), 'loop', 'loops')} without a stiffness at "
        f"reversal: the first part of a branch, {loops.definitions.initial}, needs two samples or more that rise; "
        "record more often (substeps of a simulation), or take a longer first part"
    )
