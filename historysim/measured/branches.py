"""Branches of friction loops, from reversal to reversal: their ends, normal load and quantities.

README.md of this folder, "How loops are read", has the definitions and their theory.
"""

import functools
import math
from typing import Self

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Floats, Integers, scalar
from historysim.errors import InputError
from historysim.measured.reduction import (
    FEWEST_SAMPLES,
    REVERSAL,
    channel,
    check_order,
    estimate_white_noise,
    noise_of_curve,
    turning_points,
)

# Rises over the least one that no sliding has; share of a rise in its second half below which it
# bends.
STEEPEST_SLIDING, LEAST_BENDING = 2.4, 0.4
CLEAR_SLOPE = 3.0  # standard errors beyond which a slope is no scatter
FEWEST_OF_CURVE = 4  # samples of a branch from which on Mindlin's curve is fitted to it
FEWEST_OF_SPLIT = 6  # samples of a branch from which on its compliance is split in two parts
# standard error of the contact compliance over the total, up to which it is reported
MOST_ERROR_OF_SPLIT = 0.05
FEWEST_OF_PERIOD = 8  # samples of the shortest record that counts as one closed period
# Largest difference of the load between the ends of a closed period, over the mean height of its
# loop: half of the half by which a first cycle from rest misses where it slides; and the standard
# errors of the difference that fit into it.
CLOSED, CLOSED_ERRORS = 0.25, 2.0
END_SAMPLES = 40  # samples of a record over those of a line through one of its ends


def _check_fraction(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    name = f"{attribute.name} of {type(owner).__name__}"
    above_minimum = scalar(name, value) >= 0 if attribute.name == "amplitude_share" else value > 0
    # a whole stroke, and its end, are 1
    below_maximum = value <= 1 if attribute.name.startswith("sliding") else value < 1
    if not (above_minimum and below_maximum):
        raise InputError(f"{name} is {value:g}; expected a share, between 0 and 1")


@attrs.frozen(kw_only=True)
class Definitions:
    """Definitions of sliding, preliminary displacement and initial stiffness: fractions between 0 and 1."""

    #: Sliding is this last part of a branch, by displacement; the friction force is its mean.
    sliding_part: float = attrs.field(default=0.25, validator=_check_fraction)
    #: Where that part ends, over the stroke: less than 1 leaves out what the drive does at its
    #: turn.
    sliding_end: float = attrs.field(default=1.0, validator=_check_fraction)
    #: Of the way from the load at the reversal to the friction force: where the preliminary
    #: displacement ends.
    reached: float = attrs.field(default=0.95, validator=_check_fraction)
    #: Of the same way: up to where the slope of a branch is its stiffness.
    initial_part: float = attrs.field(default=0.2, validator=_check_fraction)
    #: How much the normal load may move on a branch, over its greatest value there and beyond what
    #: it moves on most branches; a branch on which it moves more is left out. Loads that differ by
    #: no more are one.
    load_share: float = attrs.field(default=0.1, validator=_check_fraction)
    #: Loops of less than this share of the largest amplitude are kept out of means; 0 keeps all.
    amplitude_share: float = attrs.field(default=0.5, validator=_check_fraction)
    #: How much the line through the sliding part may rise beyond scatter, over the friction force.
    #: Where it rises more, less and less, the branch has not come to slide; friction that rises
    #: evenly does so up to 2.4 times this share.
    still_rising: float = attrs.field(default=0.05, validator=_check_fraction)

    def __attrs_post_init__(self) -> None:
        """Check that something is left to average over."""
        start = 1 - self.sliding_part
        if self.sliding_end <= start:
            raise InputError(
                f"the sliding part of a stroke is from {start:.3g} to {self.sliding_end:.3g}; expected its end after "
                "its start"
            )

    @property
    def is_default_sliding(self) -> bool:
        """True if no other part was chosen over which friction is averaged."""
        return (self.sliding_part, self.sliding_end) == (DEFAULT.sliding_part, DEFAULT.sliding_end)

    @property
    def sliding_text(self) -> str:
        """The sliding part in words."""
        if self.sliding_end < 1:
            return f"from {1 - self.sliding_part:.3g} to {self.sliding_end:.3g} of the displacement of a branch"
        return f"the last {self.sliding_part:.3g} of the displacement of a branch"

    @property
    def initial_text(self) -> str:
        """The first part in words."""
        return f"until {self.initial_part:.3g} of the way between the load at the reversal and the friction force"


DEFAULT = Definitions()


@attrs.frozen(eq=False)
class Trace:
    """Channels in which loops are found, over time; the normal load is None if unknown."""

    time: Floats  #: (sample) Times that do not decrease [s]
    displacement: Floats  #: (sample) Tangential displacement U [m]
    tangential_load: Floats  #: (sample) T [N], positive in the direction of U
    normal_load: Floats | None  #: (sample) N [N]

    @classmethod
    def from_channels(
        cls,
        time: ArrayLike,
        displacement: ArrayLike,
        tangential_load: ArrayLike,
        normal_load: ArrayLike | None,
    ) -> Self:
        """Check the channels."""
        moved = channel("displacement", displacement)
        load = channel("tangential_load", tangential_load, moved.size)
        times = channel("time", time, moved.size)
        check_order(times)
        if normal_load is None:
            return cls(times, moved, load, None)
        samples = np.full(moved.size, normal_load) if np.ndim(normal_load) == 0 else normal_load
        return cls(times, moved, load, channel("normal_load", samples, moved.size))


@attrs.frozen(eq=False)
class Branch:
    """Channels of a branch in its direction, from its reversal on."""

    sign: float  #: 1 forward, -1 backward
    time: Floats  #: (sample) [s]
    moved: Floats  #: (sample) Displacement from the reversal [m]
    load: Floats  #: (sample) Tangential load [N]
    normal_load: Floats | None  #: (sample) [N]

    @classmethod
    def from_trace(cls, trace: Trace, start: int, stop: int) -> Self:
        """Return the branch from one sample to another."""
        samples = slice(start, stop + 1)
        displacement = trace.displacement[samples]
        sign = -1.0 if displacement[-1] < displacement[0] else 1.0
        return cls(
            sign,
            trace.time[samples],
            sign * (displacement - displacement[0]),
            sign * trace.tangential_load[samples],
            None if trace.normal_load is None else trace.normal_load[samples],
        )


def loop_ends(displacement: Floats, dead_band: float) -> tuple[Integers, tuple[int, int] | None]:
    """Find the first, middle and last sample of each loop (loop, 3), and the ends of a whole branch after them."""
    # a loop is two branches between three reversals; loops do not overlap
    turning = turning_points(displacement, dead_band)
    swings = np.abs(np.diff(displacement[turning]))
    branches = np.flatnonzero((swings > 0) & (swings >= dead_band))
    if branches.size < 2:
        return np.empty((0, 3), dtype=np.int64), None
    # only the first and the last swing may be too small to be a branch
    turns = turning[branches[0] : branches[-1] + 2]
    triples = np.column_stack([turns[:-2], turns[1:-1], turns[2:]])
    # at either end of the record a branch without a reversal belongs to a loop that closes within
    # the dead band
    closed = np.abs(displacement[triples[:, 2]] - displacement[triples[:, 0]]) <= dead_band
    loops = triples[0 if closed[0] else 1 :: 2]
    if loops.size and loops[-1, 2] == turns[-1] and not closed[-1]:
        loops = loops[:-1]
    rest = turns[turns >= loops[-1, 2]] if len(loops) else turns[:0]
    # a last branch that no reversal ends is whole where it closes a loop with the one before
    complete = rest.size > 2 or (rest.size == 2 and bool(closed[-1]))
    return loops, (int(rest[0]), int(rest[1])) if complete else None


def closed_period(trace: Trace, dead_band: float) -> Trace | None:
    """Rotate a record of one period so that it starts and ends at its maximum; None if the record does not close.

    A record closes if it ends where it started: the displacement to within the dead band or two of
    the steps at the ends, but not half of its range, and the load to within `CLOSED` of the mean
    height of the loop, which has to be clear of noise. Both ends are extrapolated to the
    displacement between them. At a turn they are not, and noise and two steps of the load are
    allowed.
    """
    moved = trace.displacement
    load = trace.tangential_load
    if moved.size < FEWEST_OF_PERIOD:
        return None
    moved_steps, load_steps = (
        np.abs([values[1] - values[0], values[-1] - values[-2]]) for values in (moved, load)
    )
    # a jump at an end of a pull in one direction may be as large as half of the whole range
    if abs(moved[-1] - moved[0]) > min(
        max(dead_band, 2 * float(moved_steps.max())), 0.5 * float(np.ptp(moved))
    ):
        return None
    height = abs(
        _area(moved, load) + float((moved[0] - moved[-1]) * (load[0] + load[-1])) / 2
    ) / float(np.ptp(moved))
    gap, error = _gap_between_ends(moved, load)
    if math.isnan(gap):
        gap = load[-1] - load[0]
        height = (
            height + (REVERSAL * estimate_white_noise(load) + 2 * float(load_steps.min())) / CLOSED
        )
    if max(abs(gap), CLOSED_ERRORS * error) > CLOSED * height:
        return None
    top = int(moved.argmax())
    order = np.arange(top, top + moved.size + 1) % moved.size
    steps = np.diff(trace.time)
    period = float(np.ptp(trace.time)) + (float(np.median(steps)) if steps.size else 0.0)
    later = np.arange(order.size) >= moved.size - top
    normal_load = None if trace.normal_load is None else trace.normal_load[order]
    return Trace(trace.time[order] + period * later, moved[order], load[order], normal_load)


def _gap_between_ends(moved: Floats, load: Floats) -> tuple[float, float]:
    """Return the load at the end less that at the start, at one displacement, and its standard error; NaN at a turn."""
    count = max(moved.size // END_SAMPLES, 2)
    position = np.arange(count) - (count - 1) / 2
    ends = [np.stack([values[:count], values[-count:]]) for values in (moved, load)]
    centres, steps = (
        np.array(values)
        for values in (
            [samples.mean(1) for samples in ends],
            [samples @ position for samples in ends],
        )
    )
    moved_noise = noise_of_curve(moved)
    load_noise = noise_of_curve(load)
    still = np.abs(steps[0]) <= CLOSED_ERRORS * moved_noise * math.sqrt(position @ position)
    if steps[0, 0] * steps[0, 1] < 0 and not still.any():
        return math.nan, 0.0
    slopes = np.divide(steps[1], steps[0], out=np.zeros(2), where=~still)
    loads = centres[1] + slopes * ((moved[0] + moved[-1]) / 2 - centres[0])
    # at half a step beyond the end the line has four times the variance of its centre
    errors = 2 * np.hypot(load_noise, slopes * moved_noise) / math.sqrt(count)
    return float(loads[1] - loads[0]), float(np.hypot(*errors))


def enclosed_energy(trace: Trace, start: int, turn: int, stop: int) -> float:
    """Return the energy of a loop, closed by a straight line."""
    moved = trace.displacement
    sign = 1 if trace.displacement[turn] >= trace.displacement[start] else -1
    forth = np.arange(start, turn)
    back = np.arange(turn, stop + 1)
    # hum that displacement and load have in common encloses nothing in the order of the
    # displacements
    legs = (forth, sign * moved[forth]), (back, -sign * moved[back])
    samples = np.concatenate([branch[np.argsort(along, kind="stable")] for branch, along in legs])
    u = moved[samples]
    f = trace.tangential_load[samples]
    return _area(u, f) + float((u[0] - u[-1]) * (f[0] + f[-1])) / 2


def read_branch(
    trace: Trace,
    start_sample: int,
    end_sample: int,
    *,
    definitions: Definitions,
    lateral_stiffness: float,
    noisy: bool,
) -> tuple[tuple[float, ...], bool]:
    """Compute the values of a branch in the order of BRANCH_QUANTITIES, and whether it still rises."""
    branch = Branch.from_trace(trace, start_sample, end_sample)
    u = branch.moved
    f = branch.load
    start = (1 - definitions.sliding_part) * u[-1]
    # means are over the displacement, whatever noise and hum made of the order of the samples
    order = np.argsort(u, kind="stable")
    window = functools.partial(
        _until, definitions.sliding_end * u[-1] if definitions.sliding_end < 1 else math.inf, u
    )
    slides_from = _crossing(u[order], start)
    force = _tail_average(slides_from, *window(f, order))
    rises = _still_rises(slides_from, *window(f, order), definitions.still_rising * force)
    # channels turn between samples: the outermost one may be behind the turn, and its load is none
    # of sliding
    if noisy and not rises and u.size > FEWEST_SAMPLES // 2 and u[:-1].max() > start:
        order = np.argsort(u[:-1], kind="stable")
        slides_from = _crossing(u[order], start)
        force = _tail_average(slides_from, *window(f, order))
    load = math.nan
    if branch.normal_load is not None:
        load = _tail_average(slides_from, *window(branch.normal_load, order))
    rise = force - f[0]
    preliminary = from_zero = virgin = stiffness = math.nan
    if rise > 0:
        preliminary = _interpolate(_crossing(f, f[0] + definitions.reached * rise), u)
        # a branch that begins beyond zero load has no such place
        from_zero = preliminary - _interpolate(_crossing(f, 0.0), u) if f[0] < 0 else math.nan
        reversal_load = _reversal_load(trace, start_sample, branch.sign)
        share = (f - reversal_load) / (force - reversal_load)
        virgin = _virgin_displacement(
            u - (f - reversal_load) / lateral_stiffness, share, definitions.reached
        )
        compliance = _slope(*_head(_crossing(f, f[0] + definitions.initial_part * rise), f, u))
        stiffness = 1 / compliance if compliance > 0 else math.nan
    friction = force / load if load > 0 else math.nan
    return (force, load, friction, preliminary, from_zero, virgin, stiffness), rises


def _reversal_load(trace: Trace, start_sample: int, sign: float) -> float:
    """Return the load at the reversal in the direction of the branch: the reversal is between samples."""
    return float((sign * trace.tangential_load[max(start_sample - 1, 0) : start_sample + 1]).min())


def read_aperture(
    trace: Trace, load: Floats, start: int, turn: int, stop: int
) -> tuple[float, float]:
    """Compute half the range of the load of a loop, and half its width at mid-load; NaN without one."""
    loads = load[start : stop + 1]
    direction = 1.0 if trace.displacement[turn] >= trace.displacement[start] else -1.0
    middle = float(loads.max() + loads.min()) / 2
    forth, back = (
        _interpolate(
            _crossing(sign * load[branch_start : branch_stop + 1], sign * middle),
            trace.displacement[branch_start : branch_stop + 1],
        )
        for branch_start, branch_stop, sign in ((start, turn, direction), (turn, stop, -direction))
    )
    return float(np.ptp(loads)) / 2, direction * (back - forth) / 2


def split_compliance(
    trace: Trace, start_sample: int, end_sample: int, force: float, reached: float
) -> tuple[float, float]:
    """Split the initial compliance of a branch into the parts of Mindlin's curve and of a spring [m/N].

    u = 2 θμδ z(q) + C (T - T_reversal) by least squares, q from 1 - reached to reached. NaN if samples are too few, or
    their noise leaves a standard error of more than `MOST_ERROR_OF_SPLIT` of the sum.
    """
    branch = Branch.from_trace(trace, start_sample, end_sample)
    f = branch.load
    reversal_load = _reversal_load(trace, start_sample, branch.sign)
    if not force > reversal_load:
        return math.nan, math.nan
    share = (f - reversal_load) / (force - reversal_load)
    curve = _curve_part(share, reached)
    if curve.size < FEWEST_OF_SPLIT:
        return math.nan, math.nan
    along = share[curve]
    moved = branch.moved[curve]
    terms = np.column_stack([np.ones(along.size), path_fraction(along), along])
    _, bent, straight = estimates = np.linalg.lstsq(terms, moved, rcond=None)[0]
    residuals = moved - terms @ estimates
    covariance = (
        np.linalg.pinv(terms.T @ terms)
        * float(residuals @ residuals)
        / (moved.size - len(estimates))
    )
    # z'(0) = 2/3
    contact = 2 / 3 * bent
    error = 2 / 3 * math.sqrt(covariance[1, 1])
    if error > MOST_ERROR_OF_SPLIT * (contact + straight):
        return math.nan, math.nan
    return float(contact / (force - reversal_load)), float(straight / (force - reversal_load))


def _until(limit: float, u: Floats, values: Floats, order: Integers) -> tuple[Floats, Floats]:
    """Return ordered displacements and values up to a displacement."""
    along = u[order]
    heights = values[order]
    if limit >= along[-1]:
        return along, heights
    inside = int(np.searchsorted(along, limit))
    return np.append(along[:inside], limit), np.append(
        heights[:inside], np.interp(limit, along, heights)
    )


def _still_rises(position: float, u: Floats, f: Floats, threshold: float) -> bool:
    """Return True if the load rises from a position as before sliding: steeply, or with decreasing slope."""
    rise = _rise(position, u, f)
    if not rise > threshold > 0:
        return False
    # friction may rise with the distance that was slid, but not less and less as where a contact
    # comes to slide
    start = _interpolate(position, u)
    middle = _crossing(u, (start + u[-1]) / 2)
    # scatter may hide the bending of so short a part: before it, such a contact rises more
    before = slice(None, math.ceil(position))
    earlier = _crossing(u, max(2 * start - u[-1], u[0]))
    rose_more = _rise(earlier, u[before], f[before]) >= rise
    bends = rose_more and _rise(middle, u, f) < LEAST_BENDING * rise
    return rise > STEEPEST_SLIDING * threshold or bends


def _rise(position: float, u: Floats, f: Floats) -> float:
    """Return the rise of the line through the samples from a position, 0 if scatter explains it."""
    along = u[math.ceil(position) :]
    loads = f[math.ceil(position) :]
    if along.size < 2 or np.ptp(along) == 0:
        return 0.0
    slope = _slope(along, loads)
    across = along - along.mean()
    residuals = loads - loads.mean() - slope * across
    error = (
        math.sqrt(float(residuals @ residuals) / (along.size - 2) / float(across @ across))
        if along.size > 2
        else 0.0
    )
    return slope * float(np.ptp(along)) if slope > CLEAR_SLOPE * error else 0.0


def path_fraction(share: ArrayLike) -> Floats:
    """Return z(q), the displacement from the reversal over that to slip, for a sphere at load fractions q."""
    distance: Floats = 1 - (1 - np.asarray(share, dtype=np.float64)) ** (2 / 3)
    return distance


def reversal_factor(reached: float) -> float:
    """Return the displacement from the reversal to a fraction of the friction force, over θμδ, for a sphere."""
    return float(2 * path_fraction(reached))


def zero_load_factor(reached: float) -> float:
    """Return the displacement from zero load to a fraction of the friction force, over θμδ, for a sphere."""
    return float(2 * (path_fraction(reached) - path_fraction(0.5)))


def _virgin_displacement(moved: Floats, share: Floats, reached: float) -> float:
    """Fit θμδ [m] of Mindlin's curve to displacements from the reversal at load fractions."""
    curve = _curve_part(share, reached)
    if curve.size < FEWEST_OF_CURVE:
        return math.nan
    slope = _slope(path_fraction(share[curve]), moved[curve])
    return slope / 2 if slope > 0 else math.nan


def _curve_part(share: Floats, reached: float) -> Integers:
    """Select the samples on Mindlin's curve: beyond the reversal, and before sliding."""
    beyond = share >= reached
    stop = int(beyond.argmax()) if beyond.any() else 0
    return np.flatnonzero(share[:stop] >= 1 - reached)


def _crossing(values: Floats, level: float) -> float:
    """Return the fractional sample number where values first reach a level; NaN if never."""
    above = values >= level
    index = int(above.argmax())
    if not above[index]:
        return math.nan
    if index == 0:
        return 0.0
    low = values[index - 1]
    high = values[index]
    return index - 1 + float((level - low) / (high - low))


def _interpolate(position: float, values: Floats) -> float:
    if math.isnan(position):
        return math.nan
    index = min(int(position), values.size - 2)
    return float(values[index] + (position - index) * (values[index + 1] - values[index]))


def _tail_average(position: float, u: Floats, values: Floats) -> float:
    """Average values over the displacement from a position to the end."""
    index = math.ceil(position)
    along = np.concatenate([[_interpolate(position, u)], u[index:]])
    heights = np.concatenate([[_interpolate(position, values)], values[index:]])
    length = along[-1] - along[0]
    return float(_area(along, heights) / length) if length > 0 else float(heights[-1])


def _head(position: float, *channels: Floats) -> list[Floats]:
    """Return the samples of channels up to a position; none if it is NaN."""
    count = 0 if math.isnan(position) else int(position) + 1
    return [values[:count] for values in channels]


def _slope(x: Floats, y: Floats) -> float:
    """Return the least-squares slope of y over x; NaN where x does not vary."""
    across = x - x.mean() if x.size else x
    return float(across @ y) / float(across @ across) if across.any() else math.nan


def _area(u: Floats, f: Floats) -> float:
    """Return ∫ f du along samples, by the trapezoidal rule."""
    return float((u[1:] - u[:-1]) @ (f[1:] + f[:-1])) / 2
