"""Reduction of a record to the points that the contact remembers, and the common clock of its channels.

A record of thousands of samples holds few reversals, and a contact whose memory does not know the time remembers
nothing else. `turning_points` finds them and passes over those that are smaller than a dead band: noise, and the steps
of the digitiser. `kept_points` does so for two channels at once, the tangential one and the normal load. The kept
samples are the waypoints of a replay.

What the reduction changes
--------------------------
Let the normal load be constant and the displacement U be reduced with the dead band ε, and let M be the reduced
displacement in step with the record (`in_step`). At constant normal load a contact is a row of springs k with
deflections σ = U - P, where P, the play of U with a half width r, holds all that is remembered. It gives the load
``T = Σ k σ``, the initial stiffness ``k_t = Σ k`` (8 G* Σa) and the virgin curve ``T_v(u) = Σ k min(u, r)``. Then

1. **Where a swing of ε or more ends, and wherever U is at a new extreme of such a swing, the state is exactly that of
   the whole record**, and so is T. In a branch that rises from e, U stays above U(e) and falls back by less than ε from
   its running maximum M. Such a dip ends when U is at M again, and then P is what M alone has made of it, the greater
   of P(e) and M - r: dips are loops that close and wipe out. A wander in front of the first such swing is wiped out in
   the same way when the swing leaves its window.
2. **At any time ``|ΔT| ≤ 2 T_v(ε/2) ≤ k_t ε``.** In a rising branch U ≤ M < U + ε, and the play keeps the order and is
   1-Lipschitz, so P_U ≤ P_M < P_U + ε: σ_M - σ_U is the difference of two numbers between 0 and ε, and no spring can
   differ by more than 2r. In front of the first swing and behind the last, both displacements stay in one window
   narrower than ε, and two that start there together differ by no more. One dip of ε from a branch that slides
   attains the bound.
3. **From the end of one such swing to that of another the record dissipates what the reduced one does, and the closed
   loops that were left out.** A spring gives 2 k r (D - 2r) ≤ k D²/4 to a loop of range D, hence
   ``0 ≤ W - W_reduced ≤ k_t Σ D²/4 ≤ k_t ε (v - v_reduced)/8`` with the total variations v of U.

Under a controlled tangential load the same holds with T and U exchanged, as long as no slide comes in between: exact
where a swing ends, and ``|ΔU| ≤ 2 U_v(ε/2)`` on the way, U_v being the virgin curve read the other way. In front of
the first swing, where the contact may still follow the virgin curve, which becomes ever softer, the bound is
``|ΔU| ≤ U_v(m) - U_v(m - ε)`` instead, m being the largest load there, or ε/2 where that is more.

With ``ε = 0`` only samples within monotone stretches are left out, and nothing changes at all. All this holds for any
number of asperities and any friction coefficients. With a normal load that varies, memory depends on the joint path of
both channels, and `kept_points` says how far that path is kept; what that does to the loads has no such bound here.

M. Brokate and J. Sprekels, *Hysteresis and Phase Transitions* (1996), chapter 2: play, stop, wipe-out.
"""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked, scalar
from historysim.basics.array_types import Booleans, Floats, Integers
from historysim.basics.library import lib, pointer
from historysim.errors import InputError
from historysim.measured.noise import FEWEST_SAMPLES, REVERSAL, noise_of

DEAD_BAND_SHARE = 0.05
"""Dead band of loops over the range of the displacement, where nothing else is said, and noise is less."""


def channel(name: str, values: npt.ArrayLike, size: int | None = None) -> Floats:
    """Return the samples of one channel as floats.

    Parameters
    ----------
    name : str
        The name of the channel, for the message.
    values : array_like (sample)
    size : int, optional
        How many samples there have to be.

    Raises
    ------
    InputError
        Not a row of one or more finite numbers, or another number of them.
    """
    samples = np.asarray(values)
    if samples.dtype.kind == "f" and np.isnan(samples).any():
        raise InputError(
            f"{name} misses {np.isnan(samples).sum()} of {samples.size} samples (NaN); expected all of them: take the "
            "missing ones out of all channels first (see whole_samples)"
        )
    samples = np.ascontiguousarray(checked(name, samples))
    if samples.ndim != 1 or samples.size == 0:
        raise InputError(f"{name} is of shape {samples.shape}; expected the samples of one channel in a row")
    if size is not None and samples.size != size:
        raise InputError(f"{name} has {samples.size} samples; expected {size}, as many as the other channels")
    return samples


def clock(time: npt.ArrayLike, size: int | None = None) -> Floats:
    """Return the times of samples, which rise from each to the next. Parameters and errors as in `channel`."""
    samples = channel("time", time, size)
    check_order(samples, lambda sample: f"time[{sample}]", rising=True)
    return samples


def check_order(time: Floats, place: Callable[[int], str], *, rising: bool = False) -> None:
    """Check that times [s] do not decrease, or that they rise from sample to sample.

    The InputError names the place where a sample stood in its file, as `place` says it.
    """
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0 if rising else steps < 0)
    if back.size:
        after = int(back[0]) + 1
        expected = "times that rise from sample to sample" if rising else "times that do not decrease"
        raise InputError(
            f"{place(after)}: the time {time[after]:.9g} s comes after {time[after - 1]:.9g} s; expected {expected}"
        )


def turning_points(values: npt.ArrayLike, dead_band: float = 0.0) -> Integers:
    """Return the samples at which a channel truly reverses, with the first and the last sample.

    A sample is a turning point if it is the extreme since the turning point before it, and the channel then comes back
    from it by the dead band or more. Of equal extremes the first one counts. In detail, sample by sample:

    - While the direction is not yet known, the maximum and the minimum since the first sample are kept in mind. It
      becomes known at the first sample that is the dead band or more away from one of them; that one is the first
      turning point, unless it is the first sample itself.
    - From then on the extreme since the last turning point, in the present direction, is kept in mind. It becomes
      a turning point as soon as a sample is back from it by the dead band or more, and the direction changes.
    - At the end the extreme that is still in mind is kept as well, so that no amplitude is cut off.

    It follows that the kept points are, in turn, maxima and minima, with swings of the dead band or more between them
    (only the first and the last swing may be smaller); that each sample is less than the dead band away from the
    monotone branch that it lies on (`in_step`), and outside the kept points' own range by less than it; and that
    reducing the kept points again keeps them all.

    Parameters
    ----------
    values : array_like (sample)
        A displacement [m] or a load [N], in any unit.
    dead_band : float
        The smallest swing, peak to valley, that counts as a reversal, in the unit of the channel. With 0 every
        reversal counts.

    Returns
    -------
    array of int (kept)
        Indices of the kept samples, ascending.

    Raises
    ------
    InputError
        Missing or infinite samples, or a dead band below 0.
    """
    samples = channel("values", values)
    kept = np.empty(samples.size, dtype=np.int64)
    count = lib.hs_turning_points(
        samples.size, pointer(samples), scalar("dead_band", dead_band, least=0), pointer(kept)
    )
    return kept[:count].copy()


def loop_dead_band(displacement: npt.ArrayLike, said: float | None = None, noise: float | None = None) -> float:
    """Return the dead band of loops [m]: what is said, else 5 % of the range, or six deviations of the noise.

    The noise [m] is 0 for a simulated displacement; by default it is estimated, as by `noise.noise_of`. A channel that
    misses samples, or a dead band below 0, is an InputError.
    """
    if said is not None:
        return scalar("dead_band", said, least=0)
    samples = channel("displacement", displacement)
    return max(DEAD_BAND_SHARE * float(np.ptp(samples)), REVERSAL * estimated_noise(samples, noise))


def estimated_noise(displacement: Floats, noise: float | None = None) -> float:
    """Return the noise of a displacement [m] where it is known, or there are samples enough to tell it; else 0."""
    if noise is not None:
        return noise
    return noise_of(displacement) if displacement.size >= FEWEST_SAMPLES else 0.0


def check_moves(displacement: npt.ArrayLike, said: float | None = None) -> None:
    """Check that a displacement has strokes, and is not all noise: one that rests is an InputError.

    With a dead band that is said any stroke will do, and so will few samples.
    """
    samples = channel("displacement", displacement)
    noise, length = estimated_noise(samples), float(np.ptp(samples))
    if samples.size < FEWEST_SAMPLES or (length > 0 and (said is not None or length > 2 * REVERSAL * noise)):
        return
    of_noise = f", {length / noise:.2g} deviations of its noise of {noise:.3g} m" if noise else ""
    raise InputError(
        f"the tangential displacement rests: it moves by {length:.3g} m{of_noise}; expected strokes, which friction "
        "loops and fits need: `historysim sliding` reads a record that slides one way, with --over time where the "
        "displacement is not known, and dead_band says what is a stroke after all"
    )


def reversals(values: npt.ArrayLike, dead_band: float = 0.0) -> Integers:
    """Return the turning points that the record shows to be ones: with a swing of the dead band or more on both sides.

    The first and the last sample are none, nor is an extreme near either end of the record. Parameters and errors as
    in `turning_points`.
    """
    kept = turning_points(values, dead_band)
    swings = np.abs(np.diff(np.asarray(values, dtype=np.float64)[kept]))
    wide = (swings > 0) & (swings >= dead_band)
    return kept[1:-1][wide[1:] & wide[:-1]]


def kept_points(
    tangential: npt.ArrayLike,
    normal_load: npt.ArrayLike | None = None,
    *,
    dead_band: float = 0.0,
    normal_dead_band: float = 0.0,
) -> Integers:
    """Return the samples that the joint path of the tangential channel and the normal load needs.

    Without a normal load, or with a constant one, these are the turning points. With one that varies they are

    - the turning points of both channels, each with its own dead band, and
    - between them, the sample farthest from the straight path between its kept neighbours, as long as the path passes
      it by more than the dead bands (Douglas and Peucker, 1973).

    The distance is that of the paths in the plane of both channels, since the contact does not know the time: a sample
    that the path reaches earlier or later is not off the path. It is the largest over the channels, each over its dead
    band; so every sample lies within both dead bands, at once, of a point of the straight path between its kept
    neighbours. Reducing the kept points again keeps them all.

    Parameters
    ----------
    tangential : array_like (sample)
        Tangential displacement [m] or load [N].
    normal_load : array_like (sample), optional
        Normal load [N], or the approach [m].
    dead_band, normal_dead_band : float
        The smallest swing that counts, and the largest distance from the path, in the unit of each channel. With 0 for
        both, samples are left out on straight paths alone, and rounding decides which ones those are.

    Returns
    -------
    array of int (kept)
        Indices of the kept samples, ascending.

    Raises
    ------
    InputError
        Missing or infinite samples, channels of different lengths, or a dead band below 0.

    Notes
    -----
    Douglas and Peucker, *Cartographica* 10 (1973) 112-122.
    """
    kept = turning_points(tangential, dead_band)
    if normal_load is None:
        return kept
    samples = channel("tangential", tangential)
    normal = channel("normal_load", normal_load, samples.size)
    kept = np.union1d(kept, turning_points(normal, normal_dead_band))
    needed = np.zeros(samples.size, dtype=np.bool_)
    needed[kept] = True
    waiting = np.empty(2 * samples.size + 2, dtype=np.int64)
    lib.hs_keep_path(
        pointer(samples),
        pointer(normal),
        float(dead_band),
        float(normal_dead_band),
        kept.size,
        pointer(kept),
        pointer(needed),
        pointer(waiting),
    )
    return np.flatnonzero(needed)


def in_step(values: npt.ArrayLike, kept: npt.ArrayLike) -> Floats:
    """Return, for each sample, how far the reduced channel is when it walks in step with the record.

    Between two turning points it is the extreme that the channel has reached since the first one, and thus monotone:
    what a reduced replay has reached there is what it has reached at this time. Behind the last turning point it does
    not go beyond the last sample.

    Parameters
    ----------
    values : array_like (sample)
    kept : array_like of int (kept)
        From `turning_points` of these samples; its dead band exceeds the largest distance of the two.

    Raises
    ------
    InputError
        Missing or infinite samples, or points that do not lead from the first to the last one.
    """
    samples = channel("values", values)
    points = np.ascontiguousarray(kept, dtype=np.int64)
    if points.size == 0 or points[0] != 0 or points[-1] != samples.size - 1 or (np.diff(points) <= 0).any():
        raise InputError(
            f"kept does not lead from sample 0 to sample {samples.size - 1} in ascending order; expected the turning "
            "points of these values"
        )
    result = np.empty(samples.size)
    lib.hs_in_step(pointer(samples), points.size, pointer(points), pointer(result))
    return result


def whole_samples(*channels: npt.ArrayLike) -> Booleans:
    """Return which samples miss no channel (sample).

    To take the others out, index all channels with it. What goes straight between samples then goes straight across
    the gaps; `resample` can refuse that.

    Parameters
    ----------
    *channels : array_like (sample)
        Time and channels, in any units; NaN where one is missing.

    Raises
    ------
    InputError
        Channels of different lengths, or values that are infinite or no numbers.
    """
    rows = [_with_gaps(f"channels[{index}]", values) for index, values in enumerate(channels)]
    shapes = dict.fromkeys(row.shape for row in rows)
    if len(shapes) != 1 or rows[0].ndim != 1:
        came = ", ".join(map(str, shapes)) or "none"
        raise InputError(f"channels of shape {came}; expected one or more, each a row of as many samples")
    whole = np.ones(rows[0].shape, dtype=np.bool_)
    for row in rows:
        whole &= ~np.isnan(row)
    return whole


def resample(
    time: npt.ArrayLike,
    values: npt.ArrayLike,
    onto: npt.ArrayLike,
    *,
    shift: float = 0.0,
    max_gap: float = math.inf,
) -> Floats:
    """Return a channel at other times, straight between its samples.

    It brings channels that were recorded with clocks of their own onto one clock: one call for each of them.

    Parameters
    ----------
    time : array_like (sample)
        The channel's own times [s], rising.
    values : array_like (sample)
        The channel, in any unit; NaN where a sample is missing.
    onto : array_like (time)
        The times asked for [s], in any order.
    shift : float
        How much the channel's own clock is behind [s]: its sample at t was taken at t + shift.
    max_gap : float
        The longest time between samples [s] that is still bridged.

    Returns
    -------
    array (time)
        NaN where nothing is known: before the first and after the last sample, beside a missing one, and within gaps.

    Raises
    ------
    InputError
        Times that are missing or do not rise, channels of different lengths, infinite values, a `max_gap` of 0 or less.
    """
    times = clock(time)
    samples = _with_gaps("values", values)
    if samples.shape != times.shape:
        raise InputError(f"values is of shape {samples.shape}; expected {times.shape}, one for each time")
    longest = math.inf if max_gap == math.inf else scalar("max_gap", max_gap, above=0)
    wanted = checked("onto", onto)
    own = times + scalar("shift", shift)
    result = np.interp(wanted, own, samples, left=math.nan, right=math.nan)
    before = np.clip(np.searchsorted(own, wanted, side="right") - 1, 0, own.size - 1)
    after = np.minimum(before + 1, own.size - 1)
    bridged = (own[after] - own[before] <= longest) | (wanted == own[before])
    return np.where(bridged, result, math.nan)


def _with_gaps(name: str, values: npt.ArrayLike) -> Floats:
    """Return an argument as floats, of which some may be missing."""
    try:
        result = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is {values!r}; expected numbers, or NaN where they are missing") from error
    checked(name, np.where(np.isnan(result), 0.0, result))
    return result
