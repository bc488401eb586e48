"""From a record to its friction loops: split at the reversals of the tangential displacement, and read off.

One way leads from any record, measured or simulated, to its loops, so that the two can be compared.
"""

import math
from typing import TYPE_CHECKING, TypedDict, Unpack

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Booleans, Floats, Integers
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.measured.definitions import DEFAULT, Definitions, FirstLoad, LastPart
from historysim.measured.load_steps import at_one_load
from historysim.measured.loop_values import BRANCH_QUANTITIES, OF_SLIDING, NoLoopError, Trace
from historysim.measured.loops import Loops
from historysim.measured.noise import FEWEST_SAMPLES
from historysim.measured.preliminary_readings import virgin_displacement
from historysim.measured.reduction import (
    channel,
    check_moves,
    check_order,
    estimated_noise,
    loop_dead_band,
    turning_points,
)

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.measurement import Measurement


STEEPLY, BENDING = 2.4, 0.4
"""Rises over the least one that no sliding has; and the share of a rise in its second half below which it bends."""
CLEARLY = 3.0
"""Standard errors beyond which a slope is no scatter."""
WRONG_WAY = -0.05
"""Energy of loops over the area of the boxes around them from which on they run the wrong way round."""


class Options(TypedDict, total=False):
    """How loops are found, as for `loops_of_channels`."""

    dead_band: float | None
    skip: int
    skip_per_level: int
    definitions: Definitions


def loops_of_history(history: "xr.Dataset", **options: Unpack[Options]) -> Loops:
    """Return the friction loops of a simulated history, with or without asperities.

    How finely the history is recorded matters: between steps it is taken as straight (see ``substeps``). Errors as for
    `loops_of_channels`; a Dataset without the channels of a history is an InputError, too.
    """
    names = ("time", "tangential_displacement", "total_tangential_load", "total_normal_load")
    missing = [name for name in names if name not in history.variables]
    if missing:
        raise InputError(f"the Dataset has no {', '.join(missing)}; expected a history, as replay and run return it")
    return loops_of_channels(*(history[name].values for name in names), **options, displacement_noise=0.0)


def loops_of_measurement(
    measurement: "Measurement", *, lateral_stiffness: float = math.inf, **options: Unpack[Options]
) -> Loops:
    """Return the friction loops of a measurement of tangential displacement and tangential load.

    With the normal load, friction coefficients are known too. By default, the dead band is what the measurement says of
    its tangential displacement. Errors as for `loops_of_channels`; a channel that was not measured, or a displacement
    that rests, is an InputError, too.
    """
    check_order(measurement.time, measurement.place)
    if options.get("dead_band") is None:
        options["dead_band"] = measurement.dead_band.get("tangential_displacement")
    check_moves(measurement["tangential_displacement"], options["dead_band"])
    loops = loops_of_channels(
        measurement.time,
        measurement["tangential_displacement"],
        measurement["tangential_load"],
        measurement.get("normal_load"),
        lateral_stiffness=lateral_stiffness,
        **options,
    )
    return attrs.evolve(loops, remarks=measurement.remarks)


def loops_of_channels(  # noqa: PLR0913 - four channels, and what is known of them
    time: npt.ArrayLike,
    displacement: npt.ArrayLike,
    tangential_load: npt.ArrayLike,
    normal_load: npt.ArrayLike | None = None,
    *,
    dead_band: float | None = None,
    skip: int = 0,
    skip_per_level: int = 0,
    definitions: Definitions = DEFAULT,
    lateral_stiffness: float = math.inf,
    displacement_noise: float | None = None,
) -> Loops:
    """Return the friction loops of the channels of a record.

    A loop is two branches, one forward and one backward, that follow each other between three reversals; loops do not
    overlap. The branch from the start of the record to its first reversal, often that of virgin loading, and the one
    from its last reversal to the end of the record belong to a loop only if that loop closes: if the displacements at
    its two ends differ by no more than the dead band. Branches on which the normal load moves have no values, and loops
    of such branches are left out (`load_steps`).

    Parameters
    ----------
    time : array_like (sample)
        Times that do not decrease [s].
    displacement : array_like (sample)
        Tangential displacement U [m].
    tangential_load : array_like (sample)
        T [N], positive in the direction of U.
    normal_load : array_like (sample) or float, optional
        N [N].
    dead_band : float, optional
        The smallest swing of U that counts as a reversal [m], 0 or more: a few times its noise, and well below its
        amplitude; by default 5 % of the range of U, or six deviations of its noise. See `turning_points`.
    skip : int
        How many loops at the start are left out.
    skip_per_level : int
        How many loops are left out at the start of each series at one normal load.
    definitions : Definitions
    lateral_stiffness : float
        Of an instrument, in series with the contact, whose drive the displacement is that of [N/m]. It is taken off for
        the virgin displacement alone.
    displacement_noise : float, optional
        Standard deviation of the noise of U [m], 0 for a simulated record; estimated by default.

    Raises
    ------
    NoLoopError
        No whole loop, or none that is not skipped; an InputError.
    InputError
        Missing or infinite samples, times that decrease, channels of different lengths, or loops that run the wrong
        way round.
    """
    trace = _trace(time, displacement, tangential_load, normal_load)
    if not isinstance(definitions, Definitions):
        raise InputError(f"definitions is {definitions!r}; expected Definitions(...)")
    moved, load = trace.displacement, trace.tangential_load
    noise = estimated_noise(moved, displacement_noise)
    band = loop_dead_band(moved, dead_band, noise)
    ends, lone = _loop_ends(moved, band)
    pieces = _left_out(ends, moved.size)
    number = _kept_loops(len(ends), skip, band)
    along = [_along(moved, *loop) for loop in ends[number].tolist()]
    energy = np.array([_enclosed(moved[each], load[each]) for each in along])
    _check_sense(energy, moved[ends[number]], load[ends[number]])
    steady = at_one_load(
        moved, trace.normal_load, number, ends[number], lone, dead_band=band, share=definitions.load_share
    )
    # a loop that lost a branch, or that a step goes through, encloses nothing
    whole = ~(steady.left_out | steady.stepped).any(axis=1)
    energy = np.where(whole, np.append(energy, math.nan)[steady.number - number[0]], math.nan)
    ends, backward = steady.ends, moved[steady.ends[:, 1]] < moved[steady.ends[:, 0]]
    left_out, stepped = (np.where(backward[:, None], each[:, ::-1], each) for each in (steady.left_out, steady.stepped))
    values, rising = _branches(trace, ends, definitions, lateral_stiffness, between=noise > 0)
    values[left_out] = math.nan
    for place, name in enumerate(BRANCH_QUANTITIES):
        if name not in OF_SLIDING:
            values[stepped, place] = math.nan
    lengths = np.abs(np.diff(moved[ends], axis=1))
    loops = Loops(
        trace,
        definitions,
        band,
        steady.number,
        ends,
        pieces,
        **dict(zip(BRANCH_QUANTITIES, np.moveaxis(values, -1, 0), strict=True)),
        dissipated_energy=energy,
        displacement_gap=np.where(whole, moved[ends[:, 2]] - moved[ends[:, 0]], math.nan),
        tangential_load_gap=np.where(whole, load[ends[:, 2]] - load[ends[:, 0]], math.nan),
        amplitude=np.average(lengths, weights=~steady.left_out, axis=1) / 2,
        left_out_branches=left_out,
        stepped_branches=stepped,
        rising_branches=rising & ~left_out,
        told=steady.told,
        lateral_stiffness=lateral_stiffness,
        displacement_noise=noise,
    )
    return loops.without_first(check_skip(skip_per_level, "skip_per_level"))


def _trace(
    time: npt.ArrayLike, displacement: npt.ArrayLike, tangential_load: npt.ArrayLike, normal_load: npt.ArrayLike | None
) -> Trace:
    """Return the channels, checked."""
    moved = channel("displacement", displacement)
    load = channel("tangential_load", tangential_load, moved.size)
    times = channel("time", time, moved.size)
    check_order(times, lambda sample: f"time[{sample}]")
    if normal_load is None:
        return Trace(times, moved, load, None)
    given = np.full(moved.size, normal_load) if np.ndim(normal_load) == 0 else normal_load
    return Trace(times, moved, load, channel("normal_load", given, moved.size))


def check_skip(skip: float, name: str = "skip") -> int:
    """Return how many loops are left out at the start; what is no whole number of 0 or more is an InputError."""
    count = scalar(name, skip)
    if count % 1 or count < 0:
        raise InputError(f"{name} is {count:g}; expected a whole number of loops to leave out, 0 or more")
    return int(count)


def _kept_loops(count: int, skip: float, dead_band: float) -> Integers:
    """Return the numbers of the loops that are not skipped."""
    first = check_skip(skip)
    if first >= count:
        skipped = f", of which {first:,} are to be skipped" if first else ""
        raise NoLoopError(
            f"the record has {counted(count, 'whole loop', 'whole loops')} at a dead band of {dead_band:g} m"
            f"{skipped}; expected one or more to be left: lower dead_band or skip, or take a longer record"
        )
    return np.arange(first, count)


def _left_out(ends: Integers, size: int) -> tuple[tuple[int, int], ...]:
    """Return the pieces before the first and after the last loop, from sample to sample."""
    if not len(ends):
        return ()
    pieces = (0, int(ends[0, 0])), (int(ends[-1, 2]), size - 1)
    return tuple(piece for piece in pieces if piece[0] < piece[1])


def _branches(
    trace: Trace, ends: Integers, definitions: Definitions, lateral_stiffness: float, *, between: bool
) -> tuple[Floats, Booleans]:
    """Return the quantities of all branches, (loop, direction, quantity), and which still rise where they slide."""
    branches = np.full((len(ends), 2, len(BRANCH_QUANTITIES)), math.nan)
    rising = np.zeros((len(ends), 2), dtype=np.bool_)
    moved = trace.displacement
    for loop, (start, turn, end) in enumerate(ends):
        for first, last in ((start, turn), (turn, end)):
            backward = moved[last] < moved[first]
            sign = -1.0 if backward else 1.0
            part = slice(first, last + 1)
            branches[loop, int(backward)], rising[loop, int(backward)] = _branch(
                sign * (moved[part] - moved[first]),
                sign * trace.tangential_load[part],
                sign * float(trace.tangential_load[max(first - 1, 0)]),
                None if trace.normal_load is None else trace.normal_load[part],
                definitions=definitions,
                lateral_stiffness=lateral_stiffness,
                between=between,
            )
    return branches, rising


def _loop_ends(displacement: Floats, dead_band: float) -> tuple[Integers, tuple[int, int] | None]:
    """Return the first, middle and last sample of each loop, (loop, 3), and the ends of a whole branch behind them."""
    kept = turning_points(displacement, dead_band)
    swings = np.abs(np.diff(displacement[kept]))
    branches = np.flatnonzero((swings > 0) & (swings >= dead_band))
    if branches.size < 2:
        return np.empty((0, 3), dtype=np.int64), None
    # only the first and the last swing may be too small to be a branch
    turns = kept[branches[0] : branches[-1] + 2]
    triples = np.column_stack([turns[:-2], turns[1:-1], turns[2:]])
    closed = np.abs(displacement[triples[:, 2]] - displacement[triples[:, 0]]) <= dead_band
    loops = triples[0 if closed[0] else 1 :: 2]
    if loops.size and loops[-1, 2] == turns[-1] and not closed[-1]:
        loops = loops[:-1]
    behind = turns[turns >= loops[-1, 2]] if len(loops) else turns[:0]
    # a last branch that no reversal ends is whole where it closes a loop with the one before
    whole = behind.size > 2 or (behind.size == 2 and bool(closed[-1]))
    return loops, (int(behind[0]), int(behind[1])) if whole else None


def _check_sense(energy: Floats, displacement: Floats, load: Floats) -> None:
    """Refuse loops, given by U and T at their ends, that give energy instead of taking it."""
    box = np.ptp(displacement, axis=1) * np.ptp(load, axis=1)
    if energy.sum() < WRONG_WAY * box.sum():
        raise InputError(
            f"the loops run the wrong way round: friction would give {-energy.mean():.4g} J per loop instead of taking "
            "it; expected displacement and tangential_load positive in one direction: reverse one of the two, with a "
            "scale of -1"
        )


def _branch(
    u: Floats,
    f: Floats,
    before: float,
    normal: Floats | None,
    *,
    definitions: Definitions,
    lateral_stiffness: float,
    between: bool,
) -> tuple[tuple[float, ...], bool]:
    """Return the quantities of one branch, in its own direction, in the order of BRANCH_QUANTITIES; whether it rises.

    `before` is the load one sample before the branch. Where channels turn between samples, the outermost sample may be
    behind the turn, and its load is none of sliding.
    """
    sliding, initial = definitions.sliding, definitions.initial
    if isinstance(sliding, LastPart):
        start = (1 - sliding.share) * u[-1]
    else:
        start = _at(_crossing(f, f[0] + sliding.share * (f.max() - f[0])), u)
    # means are over the displacement, whatever noise and hum made of the order of the samples
    order = np.argsort(u, kind="stable")
    slides_from = _crossing(u[order], start)
    force = _mean_from(slides_from, u[order], f[order])
    rises = _still_rises(slides_from, u[order], f[order], definitions.still_rising * force)
    if between and not rises and u.size > FEWEST_SAMPLES // 2 and u[:-1].max() > start:
        order = np.argsort(u[:-1], kind="stable")
        slides_from = _crossing(u[order], start)
        force = _mean_from(slides_from, u[order], f[order])
    load = math.nan if normal is None else _mean_from(slides_from, u[order], normal[order])
    rise = force - f[0]
    preliminary = from_zero = virgin = stiffness = math.nan
    if rise > 0:
        preliminary = _at(_crossing(f, f[0] + definitions.reached * rise), u)
        # a branch that begins beyond zero load has no such place
        from_zero = preliminary - _at(_crossing(f, 0.0), u) if f[0] < 0 else math.nan
        virgin = virgin_displacement(
            u,
            f,
            force,
            # the reversal lies between samples
            reversal_load=min(before, float(f[0])),
            reached=definitions.reached,
            lateral_stiffness=lateral_stiffness,
        )
        if isinstance(initial, FirstLoad):
            stiffness = 1 / _slope(_crossing(f, f[0] + initial.share * rise), f, u)
        else:
            stiffness = _slope(_crossing(u, initial.length), u, f)
    friction = force / load if load > 0 else math.nan
    return (force, load, friction, preliminary, from_zero, virgin, stiffness), rises


def _still_rises(place: float, u: Floats, f: Floats, least: float) -> bool:
    """Return whether the load still rises as on the way to sliding, from a place on: steeply, or less and less."""
    rise = _rise(place, u, f)
    if not rise > least > 0:
        return False
    # friction may rise with the way that was slid, but not less and less as where a contact comes to slide
    middle = _crossing(u, (_at(place, u) + u[-1]) / 2)
    return rise > STEEPLY * least or _rise(middle, u, f) < BENDING * rise


def _rise(place: float, u: Floats, f: Floats) -> float:
    """Return how much the line through the samples from a place on rises, 0 where that may be their scatter alone."""
    along, loads = u[math.ceil(place) :], f[math.ceil(place) :]
    if along.size < 2 or np.ptp(along) == 0:
        return 0.0
    across = along - along.mean()
    squares = float(across @ across)
    slope = float(across @ loads) / squares
    left = loads - loads.mean() - slope * across
    error = math.sqrt(float(left @ left) / (along.size - 2) / squares) if along.size > 2 else 0.0
    return slope * float(np.ptp(along)) if slope > CLEARLY * error else 0.0


def _crossing(values: Floats, level: float) -> float:
    """Return where values first reach a level, as a sample number with a fraction; NaN where they never do."""
    above = values >= level
    first = int(above.argmax())
    if not above[first]:
        return math.nan
    if first == 0:
        return 0.0
    low, high = values[first - 1], values[first]
    return first - 1 + float((level - low) / (high - low))


def _at(place: float, values: Floats) -> float:
    if math.isnan(place):
        return math.nan
    before = min(int(place), values.size - 2)
    return float(values[before] + (place - before) * (values[before + 1] - values[before]))


def _mean_from(place: float, u: Floats, values: Floats) -> float:
    """Return the mean of values over the displacement from a place on to the end."""
    after = math.ceil(place)
    along = np.append(_at(place, u), u[after:])
    heights = np.append(_at(place, values), values[after:])
    length = along[-1] - along[0]
    return float(_area(along, heights) / length) if length > 0 else float(heights[-1])


def _slope(place: float, x: Floats, y: Floats) -> float:
    """Return the least-squares slope of y over x in the samples up to a place; NaN where it is not positive."""
    count = 0 if math.isnan(place) else int(place) + 1
    across = x[:count] - x[:count].mean() if count else x[:0]
    slope = float(across @ y[:count])
    return slope / float(across @ across) if slope > 0 else math.nan


def _area(u: Floats, f: Floats) -> float:
    return float(np.diff(u) @ (f[1:] + f[:-1])) / 2


def _along(displacement: Floats, start: int, turn: int, end: int) -> Integers:
    """Return the samples of a loop, those of each branch in the order of their displacements."""
    rises = displacement[turn] >= displacement[start]
    there, back = np.arange(start, turn), np.arange(turn, end + 1)
    ways = (there, displacement[there] * (1 if rises else -1)), (back, displacement[back] * (-1 if rises else 1))
    return np.concatenate([branch[np.argsort(along, kind="stable")] for branch, along in ways])


def _enclosed(u: Floats, f: Floats) -> float:
    """Return the area of a loop, closed by a straight line."""
    return _area(u, f) + float((u[0] - u[-1]) * (f[0] + f[-1])) / 2
