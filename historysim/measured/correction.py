"""Corrections of measured channels: zero offset, drift, scale, backlash, free play, an instrument in series.

Nothing here is done by itself. A correction takes a number that somebody has given; `offset_of_cycles` and
`drift_of_cycles` only estimate one. Every correction returns what it took away beside the corrected channel.
"""

import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.measured.reduction import channel, clock, in_step, reversals, turning_points


@attrs.frozen(eq=False)
class Correction:
    """A corrected channel."""

    values: Floats
    """(sample) The channel after the correction."""
    removed: Floats
    """(sample) What was taken away: the channel before it is ``values + removed``, to rounding."""

    @property
    def largest(self) -> float:
        """The largest amount that was taken away, without its sign."""
        return float(np.abs(self.removed).max())


@attrs.frozen
class Estimate:
    """A number that was estimated from a record."""

    value: float
    standard_error: float
    """NaN where there are too few cycles to tell."""
    count: int
    """The cycles that it stands on."""


def rescale(values: npt.ArrayLike, scale: float, offset: float = 0.0) -> Correction:
    """Return a channel as ``scale × values + offset``: a calibration, or with a scale of -1 the other sign.

    Parameters
    ----------
    values : array_like (sample)
    scale : float
        In the new unit per old unit; not 0.
    offset : float
        In the new unit.

    Raises
    ------
    InputError
        Missing or infinite samples, a scale of 0.
    """
    samples = channel("values", values)
    factor = scalar("scale", scale)
    if factor == 0:
        raise InputError("scale is 0; expected another number, since nothing would be left of the channel")
    scaled = factor * samples + scalar("offset", offset)
    return Correction(scaled, samples - scaled)


def remove_offset(values: npt.ArrayLike, offset: float) -> Correction:
    """Return a channel less a constant.

    Parameters
    ----------
    values : array_like (sample)
    offset : float
        What the channel says when it should say 0, in its unit; see `offset_of_cycles`.

    Raises
    ------
    InputError
        Missing or infinite samples.
    """
    samples = channel("values", values)
    return _without(samples, np.full(samples.size, scalar("offset", offset)))


def remove_drift(
    time: npt.ArrayLike, values: npt.ArrayLike, rate: float, *, reference: float | None = None
) -> Correction:
    """Return a channel less a drift that is linear in time, ``rate × (time - reference)``.

    Parameters
    ----------
    time : array_like (sample)
        Rising [s].
    values : array_like (sample)
    rate : float
        In the unit of the channel per second; see `drift_of_cycles`.
    reference : float, optional
        The time at which nothing is taken away [s]; that of the first sample by default.

    Raises
    ------
    InputError
        Missing or infinite samples, times that do not rise, channels of different lengths.
    """
    samples = channel("values", values)
    times = clock(time, samples.size)
    start = times[0] if reference is None else scalar("reference", reference)
    return _without(samples, scalar("rate", rate) * (times - start))


def offset_of_cycles(values: npt.ArrayLike, *, dead_band: float, skip: int = 0) -> Estimate:
    """Return the zero offset of a channel that swings evenly about zero: the mean of the midpoints of its cycles.

    The midpoint of a cycle is half way between its maximum and its minimum, two successive reversals; each reversal
    belongs to one cycle. A friction force with stick-slip or overshoot has uneven extremes: take its zero from
    `Loops.friction_force` instead, half the difference of the two directions.

    Parameters
    ----------
    values : array_like (sample)
    dead_band : float
        The smallest swing that counts, in the unit of the channel; see `reversals`.
    skip : int
        How many cycles at the start are left out.

    Returns
    -------
    Estimate
        In the unit of the channel; the standard error is that of the mean.

    Raises
    ------
    InputError
        Missing or infinite samples, or no cycle left.
    """
    samples = channel("values", values)
    _, middle = _midpoints(np.arange(float(samples.size)), samples, dead_band, skip, least=1)
    error = middle.std(ddof=1) / math.sqrt(middle.size) if middle.size > 1 else math.nan
    return Estimate(float(middle.mean()), float(error), middle.size)


def drift_of_cycles(time: npt.ArrayLike, values: npt.ArrayLike, *, dead_band: float, skip: int = 0) -> Estimate:
    """Return the linear drift of a channel that swings with a constant amplitude.

    It is the slope of the least-squares line through the midpoints of its cycles, as in `offset_of_cycles`, over the
    mean times of their two reversals.

    Parameters
    ----------
    time : array_like (sample)
        Rising [s].
    values, dead_band, skip
        As in `offset_of_cycles`.

    Returns
    -------
    Estimate
        In the unit of the channel per second. The standard error is that of the slope: it takes the scatter of the
        midpoints about the line as independent errors of one size.

    Raises
    ------
    InputError
        Missing or infinite samples, times that do not rise, channels of different lengths, fewer than three cycles.
    """
    from scipy.stats import linregress

    samples = channel("values", values)
    at, middle = _midpoints(clock(time, samples.size), samples, dead_band, skip, least=3)
    line = linregress(at, middle)
    return Estimate(float(line.slope), float(line.stderr), middle.size)


def remove_backlash(
    time: npt.ArrayLike, displacement: npt.ArrayLike, width: float, *, dead_band: float = 0.0
) -> Correction:
    """Return a displacement less the backlash of what measures it.

    After a reversal the reading rests until the backlash is taken up: it is the play, of half the width to either
    side, of the displacement. The inverse of that play is taken under these assumptions:

    - while the reading moves, the displacement is half the width ahead of it;
    - while the reading rests at a reversal, the displacement moves evenly in time;
    - at the start the backlash is taken up in the direction of the first swing, and at the end in that of the last one.

    A clearance in the path of the load is another thing: `remove_free_play`.

    Parameters
    ----------
    time : array_like (sample)
        Rising [s].
    displacement : array_like (sample)
        The reading [m].
    width : float
        By how much the displacement comes back before the reading follows [m], 0 or more.
    dead_band : float
        The smallest swing of the reading that is a reversal [m]. The reading rests as long as it is within half the
        dead band of the extreme.

    Raises
    ------
    InputError
        Missing or infinite samples, times that do not rise, channels of different lengths, a negative width.
    """
    reading = channel("displacement", displacement)
    times = clock(time, reading.size)
    half = scalar("width", width, least=0) / 2
    kept = turning_points(reading, dead_band)
    swings = np.diff(reading[kept])
    near = in_step(reading, kept)
    ahead = [(times[0], half * float(np.sign(swings[:1]).sum()))]
    for before, turn, after, swing in zip(kept[:-2], kept[1:-1], kept[2:], swings[1:], strict=True):
        if abs(swing) < dead_band or swing == 0:
            continue
        resting = before + np.flatnonzero(np.abs(near[before : after + 1] - reading[turn]) <= dead_band / 2)
        direction = math.copysign(half, swing)
        ahead += [(max(times[resting[0]], ahead[-1][0]), -direction), (times[resting[-1]], direction)]
    at, amount = np.array(ahead).T
    return _without(reading, -np.interp(times, at, amount))


def remove_free_play(
    displacement: npt.ArrayLike, tangential_load: npt.ArrayLike, width: float, *, closing_load: float = 0.0
) -> Correction:
    """Return a displacement less a clearance in the path of the load, between what is moved and the contact.

    The clearance has no mass and is in series with the contact: it is open by half its width to the side to which it
    is loaded, and crossed where the load changes its sign, however the displacement goes. The displacement of the
    contact is ``displacement - (width/2) clip(tangential_load / closing_load, -1, 1)``. A loop with a clearance shows a
    step of that width at zero load.

    Parameters
    ----------
    displacement : array_like (sample)
        [m].
    tangential_load : array_like (sample)
        [N], positive in the direction in which the displacement is, and without offset.
    width : float
        The width of the clearance [m], 0 or more.
    closing_load : float
        The load at which the clearance is closed [N]: it closes in proportion to the load up to there. With 0 it is
        crossed at once, which noise about zero load makes a jump to and fro.

    Raises
    ------
    InputError
        Missing or infinite samples, channels of different lengths, a negative width or closing load.
    """
    measured = channel("displacement", displacement)
    load = channel("tangential_load", tangential_load, measured.size)
    half = scalar("width", width, least=0) / 2
    limit = scalar("closing_load", closing_load, least=0)
    side = np.clip(load / limit, -1.0, 1.0) if limit > 0 else np.sign(load)
    return _without(measured, half * side)


def contact_displacement(displacement: npt.ArrayLike, tangential_load: npt.ArrayLike, stiffness: float) -> Correction:
    """Return the displacement of the contact, U - T/k_s, from one that was measured with an instrument in series.

    Parameters
    ----------
    displacement : array_like (sample)
        Measured U [m].
    tangential_load : array_like (sample)
        T [N], positive in the direction in which U is.
    stiffness : float
        Stiffness k_s of the instrument, or of the bulk, in series [N/m], greater than 0; infinite where it is rigid.

    Raises
    ------
    InputError
        Missing or infinite samples, channels of different lengths, a stiffness of 0 or less.
    """
    measured = channel("displacement", displacement)
    load = channel("tangential_load", tangential_load, measured.size)
    if stiffness == math.inf:
        return _without(measured, np.zeros_like(load))
    return _without(measured, load / scalar("stiffness", stiffness, above=0))


def _without(samples: Floats, removed: Floats) -> Correction:
    return Correction(samples - removed, removed)


def _midpoints(time: Floats, samples: Floats, dead_band: float, skip: int, least: int) -> tuple[Floats, Floats]:
    """Return the mean times and the midpoints of successive cycles."""
    turns = reversals(samples, dead_band)
    cycles = turns[: turns.size // 2 * 2].reshape(-1, 2)
    if scalar("skip", skip) % 1 or not 0 <= skip <= len(cycles) - least:
        raise InputError(
            f"the channel has {len(cycles)} cycles at a dead band of {dead_band:g}, of which {skip} are left out; "
            f"expected {least} or more to be left: lower dead_band or skip"
        )
    cycles = cycles[int(skip) :]
    return time[cycles].mean(axis=1), samples[cycles].mean(axis=1)
