"""`Loops`: the friction loops of a record, as lines, tables and Datasets; and how they are found at its reversals.

One way leads from any record, measured or simulated, to its loops, so that the two can be compared.
"""

import math
from typing import TYPE_CHECKING, TypedDict, Unpack

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, Integers, scalar
from historysim.basics.units import quantity_text, scaled
from historysim.basics.wording import counted, html_table
from historysim.errors import InputError
from historysim.measured.branches import (
    DEFAULT,
    Definitions,
    Trace,
    area,
    at_one_load,
    read_branch,
    reversal_factor,
    zero_load_factor,
)
from historysim.measured.loop_values import (
    BRANCH_QUANTITIES,
    CONTENT,
    DIRECTIONS,
    LOOP_QUANTITIES,
    OF_SLIDING,
    ROUNDING,
    LoopValues,
    NoLoopError,
)
from historysim.measured.notes import drift_notes, instrument_faults, loop_notes
from historysim.measured.reduction import (
    channel,
    check_moves,
    check_order,
    estimated_noise,
    history_channels,
    loop_dead_band,
    turning_points,
)

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.reduction import Measurement

WRONG_WAY = -0.05  # energy of loops over the area of the boxes around them from which on they run the wrong way round


@attrs.frozen(eq=False, repr=False)
class Loops(LoopValues):
    """The loops of a record; their values are those of `LoopValues`."""

    def __repr__(self) -> str:
        shown = ("friction_force", "friction_coefficient", "preliminary_displacement", "dissipated_energy")
        table = {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}
        texts = [f"{table[name][0]} {self.text(name, table[name][1])}" for name in shown]
        return f"<Loops: {', '.join([counted(len(self), 'loop', 'loops'), *texts])}>"

    def _repr_html_(self) -> str:
        heading, *rows = self.rows()
        return html_table(rows, heading)

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): remarks, dead band, what means are, laws over the load, notes."""
        return [
            *self.remarks,
            ("dead band", self._dead_band_text()),
            ("values", self._values_text()),
            *self._preliminary_texts(),
            *(self.by_load().laws()),
            *(("note", text) for text in self.notes),
        ]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, and what the samples are too few to show, with the remedy."""
        return loop_notes(self)

    @property
    def faults(self) -> tuple[str, ...]:
        """Faults of the instrument, and a drift of friction, with the remedy."""
        return (*instrument_faults(self), *drift_notes(self))

    def _interval(self, quantity: str, unit: str) -> str:
        """Return the interval of a mean, as a string."""
        wander, mean = self.wander(quantity), self.statistics(quantity).mean
        if (
            self.text(quantity, unit) == "–"
            or wander is None
            or wander.reach <= 1e-12 * abs(mean)
            or len(self.by_load()) > 1
        ):
            return ""
        factor, symbol = scaled(mean, unit)
        low, high = (factor * (mean + sign * wander.reach) for sign in (-1, 1))
        return f" (95 %: {low:.4g} to {high:.4g}{symbol})"

    def _preliminary_texts(self) -> list[tuple[str, str]]:
        """Return what each reading of the preliminary displacement is."""
        if not np.isfinite(self.preliminary_displacement).any():
            return []
        reached = self.definitions.reached
        drive = ""
        if math.isfinite(self.lateral_stiffness):
            drive = (
                f", plus the load over the stiffness of the instrument, {quantity_text(self.lateral_stiffness, 'N/m')}"
            )
        place = f"to where {reached:.3g} of the way from the reversal to the friction force is first reached"
        first, second = (f"{of(reached):.3g} θμδ on a sphere{drive}" for of in (reversal_factor, zero_load_factor))
        return [
            ("preliminary displacement", f"from the reversal {place}: {first}"),
            ("displacement from zero load", f"to the same place: {second}; to slip itself it would be 1.26 θμδ"),
            ("virgin displacement θμδ", "by Mindlin's curve through the branch up to there; that of one sphere"),
        ]

    def _values_text(self) -> str:
        large, share = int(self.large.sum()), self.definitions.amplitude_share
        of = f"{large:,} of {counted(len(self), 'loop', 'loops')}"
        small = "" if large == len(self) else f", those of {share:.3g} of the largest amplitude or more: {of}"
        return f"mean ± standard deviation of one loop{small}"

    def _dead_band_text(self) -> str:
        length = float(np.ptp(self.trace.displacement))
        share = f", {100 * self.dead_band / length:.3g} % of the range of the displacement" if length > 0 else ""
        return f"{quantity_text(self.dead_band, 'm')}{share}"

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return the summary as a table of strings: quantity, forward, backward, both; the first row is the heading.

        Values are mean ± standard deviation of one loop, with the interval of the mean where there are three loops or
        more at one load, and the largest of the gaps without its sign.
        """
        table: list[tuple[str, str, str, str]] = [("quantity", *DIRECTIONS, "both")]
        for name, (label, unit) in BRANCH_QUANTITIES.items():
            forward, backward = (self.text(name, unit, direction) for direction in DIRECTIONS)
            table.append((label, forward, backward, self.text(name, unit, "both") + self._interval(name, unit)))
        for name, (label, unit) in LOOP_QUANTITIES.items():
            if name.endswith("_gap"):
                gaps = np.abs(getattr(self, name))
                text = quantity_text(float(np.nanmax(gaps)), unit) if np.isfinite(gaps).any() else "–"
                table.append((f"largest {label}", "", "", text))
            else:
                table.append((label, "", "", self.text(name, unit, "both") + self._interval(name, unit)))
        skipped = f", {self.number[0]} before them skipped" if self.number[0] else ""
        table.append(("loops", "", "", f"{len(self)}{skipped}"))
        return table

    def to_dataset(self) -> "xr.Dataset":
        """Return all quantities as a Dataset with the dimensions loop and direction, and the definitions in words.

        What a mean has to leave out, branches that did not come to slide and small loops, is a coordinate.
        """
        import xarray as xr

        time = self.trace.time
        variables = {
            name: (dims, getattr(self, name), {"long_name": label, "units": unit})
            for dims, table in ((("loop", "direction"), BRANCH_QUANTITIES), (("loop",), LOOP_QUANTITIES))
            for name, (label, unit) in table.items()
        }
        return xr.Dataset(
            variables,
            coords={
                "loop": ("loop", self.number, {"long_name": "loop of the record, from 0"}),
                "direction": ("direction", list(DIRECTIONS)),
                "start_time": ("loop", time[self.ends[:, 0]], {"long_name": "start of the loop", "units": "s"}),
                "end_time": ("loop", time[self.ends[:, 2]], {"long_name": "end of the loop", "units": "s"}),
                "amplitude": ("loop", self.amplitude, {"long_name": "amplitude", "units": "m"}),
                "load_level": ("loop", self.load_level, {"long_name": "load of the loop, from 0 for the least"}),
                "lower_bound": (
                    ("loop", "direction"),
                    self.rising_branches.astype(np.int8),
                    {"long_name": "1 where the branch did not come to slide, and friction is a lower bound"},
                ),
            },
            attrs={
                "title": counted(len(self), "friction loop", "friction loops"),
                "content": CONTENT,
                **self._attributes(),
            },
        )


# -- how they are found ----------------------------------------------------------------------------


class Options(TypedDict, total=False):
    """How loops are found, as for `hs.loops`."""

    dead_band: float | None
    skip: int
    skip_per_level: int
    definitions: Definitions


def loops_of_history(history: "xr.Dataset", **options: Unpack[Options]) -> Loops:
    """Return the friction loops of a simulated history, which is taken as straight between its steps."""
    return loops_of_channels(*history_channels(history), **options, displacement_noise=0.0)


def loops_of_measurement(
    measurement: "Measurement", *, lateral_stiffness: float = math.inf, **options: Unpack[Options]
) -> Loops:
    """Return the friction loops of a measurement, at its own dead band by default."""
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
    time: ArrayLike,
    displacement: ArrayLike,
    tangential_load: ArrayLike,
    normal_load: ArrayLike | None = None,
    *,
    dead_band: float | None = None,
    skip: int = 0,
    skip_per_level: int = 0,
    definitions: Definitions = DEFAULT,
    lateral_stiffness: float = math.inf,
    displacement_noise: float | None = None,
) -> Loops:
    """Return the friction loops of the channels of a record, time [s], U [m], T [N] and N [N].

    The lateral stiffness [N/m] of an instrument is taken off for the virgin displacement alone. The noise of the
    displacement [m] is 0 for a simulated record, and estimated by default.
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
    steady = at_one_load(trace, number, ends[number], lone, dead_band=band, share=definitions.load_share)
    # a loop that lost a branch, or that a step goes through, encloses nothing
    whole = ~(steady.left_out | steady.stepped).any(axis=1)
    energy = np.where(whole, np.append(energy, math.nan)[steady.number - number[0]], math.nan)
    ends, backward = steady.ends, moved[steady.ends[:, 1]] < moved[steady.ends[:, 0]]
    left_out, stepped = (np.where(backward[:, None], each[:, ::-1], each) for each in (steady.left_out, steady.stepped))
    values, rising = _branches(trace, ends, definitions, lateral_stiffness, noisy=noise > 0)
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
        exclusions=steady.notes,
        lateral_stiffness=lateral_stiffness,
        displacement_noise=noise,
    )
    return loops.without_first(check_skip(skip_per_level, "skip_per_level"))


def _trace(
    time: ArrayLike, displacement: ArrayLike, tangential_load: ArrayLike, normal_load: ArrayLike | None
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
    trace: Trace, ends: Integers, definitions: Definitions, lateral_stiffness: float, *, noisy: bool
) -> tuple[Floats, Booleans]:
    """Return the quantities of all branches, (loop, direction, quantity), and which still rise where they slide."""
    values = np.full((len(ends), 2, len(BRANCH_QUANTITIES)), math.nan)
    rising = np.zeros((len(ends), 2), dtype=np.bool_)
    for loop, (start, turn, end) in enumerate(ends):
        for first, last in ((start, turn), (turn, end)):
            side = int(trace.displacement[last] < trace.displacement[first])
            values[loop, side], rising[loop, side] = read_branch(
                trace, first, last, definitions=definitions, lateral_stiffness=lateral_stiffness, noisy=noisy
            )
    return values, rising


def _loop_ends(displacement: Floats, dead_band: float) -> tuple[Integers, tuple[int, int] | None]:
    """Return the first, middle and last sample of each loop, (loop, 3), and the ends of a whole branch behind them."""
    # a loop is two branches between three reversals; loops do not overlap
    kept = turning_points(displacement, dead_band)
    swings = np.abs(np.diff(displacement[kept]))
    branches = np.flatnonzero((swings > 0) & (swings >= dead_band))
    if branches.size < 2:
        return np.empty((0, 3), dtype=np.int64), None
    # only the first and the last swing may be too small to be a branch
    turns = kept[branches[0] : branches[-1] + 2]
    triples = np.column_stack([turns[:-2], turns[1:-1], turns[2:]])
    # at either end of the record a branch without a reversal belongs to a loop that closes within the dead band
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
    # rounding makes energy of a load that does not change
    rounding = float(np.abs(displacement).max() * np.abs(load).max()) * ROUNDING
    if energy.sum() < WRONG_WAY * box.sum() - rounding:
        raise InputError(
            f"the loops run the wrong way round: friction would give {-energy.mean():.4g} J per loop instead of taking "
            "it; expected displacement and tangential_load positive in one direction: reverse one of the two, with a "
            "scale of -1, or mend their columns where they are swapped"
        )


def _along(displacement: Floats, start: int, turn: int, end: int) -> Integers:
    """Return the samples of a loop, those of each branch in the order of their displacements."""
    rises = displacement[turn] >= displacement[start]
    there, back = np.arange(start, turn), np.arange(turn, end + 1)
    ways = (there, displacement[there] * (1 if rises else -1)), (back, displacement[back] * (-1 if rises else 1))
    return np.concatenate([branch[np.argsort(along, kind="stable")] for branch, along in ways])


def _enclosed(u: Floats, f: Floats) -> float:
    """Return the area of a loop, closed by a straight line."""
    return area(u, f) + float((u[0] - u[-1]) * (f[0] + f[-1])) / 2
