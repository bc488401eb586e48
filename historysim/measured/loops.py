"""`Loops`: the friction loops of a record, as lines, tables and Datasets; and how they are found at its reversals."""

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, Integers, scalar
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text, html_table
from historysim.errors import InputError
from historysim.measured import branch_shape
from historysim.measured.branches import (
    DEFAULT,
    Definitions,
    Trace,
    closed_period,
    enclosed_energy,
    loop_ends,
    read_branch,
    reversal_factor,
    zero_load_factor,
)
from historysim.measured.constant_load import at_one_load
from historysim.measured.fretting import Fretting
from historysim.measured.loop_table import interval_text, mean_or_bound_text
from historysim.measured.loop_values import (
    BRANCH_QUANTITIES,
    CONTENT,
    DIRECTIONS,
    QUANTITIES,
    ROUNDING,
    Direction,
    LoopValues,
    NoLoopError,
)
from historysim.measured.notes import drift_notes, hook_notes, instrument_faults, loop_notes
from historysim.measured.reduction import (
    check_moves,
    check_order,
    estimated_noise,
    history_channels,
    jumps_of_counter,
    loop_dead_band,
    sign_lost,
)

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.reduction import Measurement

# energy of loops over the area of the boxes around them from which on they run the wrong way round
WRONG_WAY = -0.05


@attrs.frozen(eq=False, repr=False)
class Loops(LoopValues):
    """Friction loops of a record, with the values of `LoopValues`."""

    def __repr__(self) -> str:
        names = (
            "friction_force",
            "friction_coefficient",
            "preliminary_displacement",
            "dissipated_energy",
        )
        texts = [f"{QUANTITIES[name].label} {self.text(name)}" for name in names]
        return f"<Loops: {', '.join([count_text(len(self), 'loop', 'loops'), *texts])}>"

    def _repr_html_(self) -> str:
        heading, *rows = self.rows()
        return html_table(rows, heading)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on left-out loops and on quantities that the samples are too few for, with the remedy."""
        return loop_notes(self)

    @property
    def faults(self) -> tuple[str, ...]:
        """Stops, faults of the instrument, and a drift of friction, with the remedy."""
        return (*hook_notes(self), *instrument_faults(self), *drift_notes(self))

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): remarks, dead band, basis of means, laws over the load, notes."""
        length = float(np.ptp(self.trace.displacement))
        share = (
            f", {100 * self.dead_band / length:.3g} % of the range of the displacement"
            if length > 0
            else ""
        )
        large = int(self.large.sum())
        threshold = self.definitions.amplitude_share
        of = f"{large:,} of {count_text(len(self), 'loop', 'loops')}"
        small = (
            ""
            if large == len(self)
            else f", those of {threshold:.3g} of the largest amplitude or more: {of}"
        )
        return [
            *self.remarks,
            ("dead band", f"{quantity_text(self.dead_band, 'm')}{share}"),
            ("values", f"mean ± standard deviation of one loop{small}"),
            *self._preliminary_texts(),
            *self.by_load().laws(),
            *self._energy_text(),
            *(("note", text) for text in self.notes),
        ]

    def _energy_text(self) -> list[tuple[str, str]]:
        """Return how the energy per loop varies with the amplitude."""
        if (result := self.energy_law()) is None:
            return []
        law, count = result
        interval = f"(95 %: {law.exponent_low:.3f} to {law.exponent_high:.3f})"
        text = f"proportional to the power {law.exponent:.3f} of the amplitude {interval}, through the means at"
        return [("energy over amplitude", f"{text} {count:,} amplitudes")]

    def _preliminary_texts(self) -> list[tuple[str, str]]:
        """Describe each definition of the preliminary displacement."""
        if not np.isfinite(self.preliminary_displacement).any():
            return []
        reached = self.definitions.reached
        drive = ""
        if math.isfinite(self.lateral_stiffness):
            stiffness = quantity_text(self.lateral_stiffness, "N/m")
            drive = f", plus the load over the stiffness of the instrument, {stiffness}"
        end_text = f"to where {reached:.3g} of the way from the reversal to the friction force is first reached"
        reversal_text, zero_load_text = (
            f"{of(reached):.3g} θμδ on a sphere{drive}"
            for of in (reversal_factor, zero_load_factor)
        )
        return [
            ("preliminary displacement", f"from the reversal {end_text}: {reversal_text}"),
            (
                "displacement from zero load",
                f"to the same place: {zero_load_text}; to slip itself it would be 1.26 θμδ",
            ),
            (
                "virgin displacement θμδ",
                "by Mindlin's curve through the branch up to there; that of one sphere",
            ),
        ]

    def text(self, quantity: str, direction: Direction = "both") -> str:
        """Return mean ± standard deviation of a quantity as a string, "–" if it is not friction; see `statistics`."""
        sliding, every = (
            self._statistics(self._friction_values(quantity, values), direction)
            for values in (self._sliding_values(quantity), getattr(self, quantity))
        )
        return mean_or_bound_text(sliding, every, QUANTITIES[quantity], int(self.large.sum()))

    def _text_with_interval(self, quantity: str) -> str:
        """Return the text of a quantity over both directions, with the interval of its mean where it has one."""
        text = self.text(quantity)
        wander = self.wander(quantity)
        if text == "–" or wander is None or len(self.by_load()) > 1:
            return text
        mean = self.statistics(quantity).mean
        ends = mean - wander.reach, mean + wander.reach
        return text + interval_text(mean, *ends, QUANTITIES[quantity].unit)

    @functools.cached_property
    def fretting(self) -> Fretting:
        """Fretting report: slip amplitude, energy friction coefficient, regime and compliances of the loops."""
        return Fretting.from_loops(self)

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return the summary as a table of strings: quantity, forward, backward, both; the first row is the heading.

        Values are mean ± standard deviation of one loop, with the interval of the mean where there
        are three loops or more at one load, and the largest of the gaps without its sign.
        """
        table: list[tuple[str, str, str, str]] = [("quantity", *DIRECTIONS, "both")]
        for name, quantity in QUANTITIES.items():
            if quantity.is_gap:
                table.append((f"largest {quantity.label}", "", "", self._largest_text(name)))
                continue
            forward = backward = ""
            if name in BRANCH_QUANTITIES:
                forward, backward = (self.text(name, direction) for direction in DIRECTIONS)
            table.append((quantity.label, forward, backward, self._text_with_interval(name)))
        skipped = f", {self.number[0]} before them skipped" if self.number[0] else ""
        table.append(("loops", "", "", f"{len(self)}{skipped}"))
        return table

    def _largest_text(self, quantity: str) -> str:
        sizes = np.abs(getattr(self, quantity))
        if not np.isfinite(sizes).any():
            return "–"
        return quantity_text(float(np.nanmax(sizes)), QUANTITIES[quantity].unit)

    def to_dataset(self) -> "xr.Dataset":
        """Return all quantities as a Dataset with the dimensions loop and direction, and the definitions in words.

        What a mean has to leave out, branches that did not come to slide and small loops, is a
        coordinate.
        """
        import xarray as xr

        time = self.trace.time
        fretting = self.fretting.to_dataset()
        dims = "loop", "direction"
        variables = {}
        for name, quantity in QUANTITIES.items():
            values = getattr(self, name)
            variables[name] = dims[: values.ndim], values, quantity.attributes
        return xr.Dataset(
            variables
            | {str(name): fretting[name].variable for name in (*fretting.data_vars, "regime")},
            coords={
                "loop": ("loop", self.number, {"long_name": "loop of the record, from 0"}),
                "direction": ("direction", list(DIRECTIONS)),
                "start_time": (
                    "loop",
                    time[self.ends[:, 0]],
                    {"long_name": "start of the loop", "units": "s"},
                ),
                "end_time": (
                    "loop",
                    time[self.ends[:, 2]],
                    {"long_name": "end of the loop", "units": "s"},
                ),
                "amplitude": ("loop", self.amplitude, {"long_name": "amplitude", "units": "m"}),
                "load_level": (
                    "loop",
                    self.load_level,
                    {"long_name": "load of the loop, from 0 for the least"},
                ),
                "lower_bound": (
                    ("loop", "direction"),
                    self.rising_branches.astype(np.int8),
                    {
                        "long_name": "1 where the branch did not come to slide, and friction is a lower bound"
                    },
                ),
                "hooked": (
                    ("loop", "direction"),
                    self.hooked_branches.astype(np.int8),
                    {
                        "long_name": "1 where the load rises again at the end, and friction is that of the level part"
                    },
                ),
            },
            attrs={
                "title": count_text(len(self), "friction loop", "friction loops"),
                "content": CONTENT,
                "fretting_regime": self.fretting.regime_text(),
                **self._attributes(),
            },
        )


# -- how they are found ----------------------------------------------------------------------------


class Options(TypedDict, total=False):
    """Options of the search for loops, as of `hs.loops`."""

    dead_band: float | None
    skip: int
    skip_per_level: int
    definitions: Definitions


def loops_of_history(history: "xr.Dataset", **options: Unpack[Options]) -> Loops:
    """Return the friction loops of a simulated history, which is taken as straight between its steps."""
    loops = loops_of_channels(*history_channels(history), **options, displacement_noise=0.0)
    if "total_attraction" not in history:
        return loops
    pull = quantity_text(float(history["total_attraction"].values.max()), "N")
    text = f"is over the load from outside alone; the asperities attract, with up to {pull}"
    return attrs.evolve(loops, remarks=(("friction coefficient", text),))


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

    The lateral stiffness [N/m] of an instrument is taken off for the virgin displacement alone. The
    noise of the displacement [m] is 0 for a simulated record, and estimated by default.
    """
    trace = Trace.from_channels(time, displacement, tangential_load, normal_load)
    if not isinstance(definitions, Definitions):
        raise InputError(f"definitions is {definitions!r}; expected Definitions(...)")
    moved = trace.displacement
    load = trace.tangential_load
    noise = estimated_noise(moved, displacement_noise)
    band = loop_dead_band(moved, dead_band, noise)
    all_ends, lone = loop_ends(moved, band)
    whole_period: tuple[str, ...] = ()
    if not len(all_ends) and (period := closed_period(trace, band)) is not None:
        trace, (moved, load) = period, (period.displacement, period.tangential_load)
        all_ends, lone = loop_ends(moved, band)
        whole_period = (
            "the record is one closed period: it is one loop, which starts at the greatest displacement",
        )
    first_loop = check_skip(skip)
    if first_loop >= len(all_ends):
        skipped = f", of which {first_loop:,} are to be skipped" if first_loop else ""
        raise NoLoopError(
            f"the record has {count_text(len(all_ends), 'whole loop', 'whole loops')} at a dead band of {band:g} m"
            f"{skipped}; expected one or more to be left: lower dead_band or skip, or take a longer record"
        )
    pieces = (0, int(all_ends[0, 0])), (int(all_ends[-1, 2]), moved.size - 1)
    number = np.arange(first_loop, len(all_ends))
    ends = all_ends[first_loop:]
    energy = np.array([enclosed_energy(trace, *loop) for loop in ends.tolist()])
    _check_sense(trace, energy, ends)
    steady = at_one_load(trace, number, ends, lone, dead_band=band, share=definitions.load_share)
    # a loop that lost a branch, or that contains a load step, has no energy
    complete = ~(steady.left_out | steady.stepped).any(axis=1)
    energy = np.where(complete, np.append(energy, math.nan)[steady.number - first_loop], math.nan)
    ends, backward = steady.ends, moved[steady.ends[:, 1]] < moved[steady.ends[:, 0]]
    left_out, stepped = (
        np.where(backward[:, None], branches[:, ::-1], branches)
        for branches in (steady.left_out, steady.stepped)
    )
    read = functools.partial(read_branch, lateral_stiffness=lateral_stiffness, noisy=noise > 0)
    values = np.full((len(ends), 2, len(BRANCH_QUANTITIES)), math.nan)
    rising = np.zeros((len(ends), 2), dtype=np.bool_)
    for loop, turns in enumerate(ends):
        for start, stop in (turns[:2], turns[1:]):
            side = int(moved[stop] < moved[start])
            values[loop, side], rising[loop, side] = read(
                trace, start, stop, definitions=definitions
            )
    values[left_out] = math.nan
    branch_values: dict[str, Any] = dict(
        zip(BRANCH_QUANTITIES, np.moveaxis(values, -1, 0), strict=True)
    )
    for name, quantity in BRANCH_QUANTITIES.items():
        if quantity.needs_reversal:
            branch_values[name][stepped] = math.nan
    lengths = np.abs(np.diff(moved[ends], axis=1))
    amplitude = np.average(lengths, weights=~steady.left_out, axis=1) / 2
    sound = ~(steady.left_out | steady.stepped).any(axis=1) & (
        amplitude >= definitions.amplitude_share * amplitude.max()
    )
    spring = branch_shape.find_parallel_stiffness(trace, ends[sound])
    if spring > 0:
        # friction and the load of the spring are one there, and no bound of either
        rising[:] = False
        for name, quantity in BRANCH_QUANTITIES.items():
            if quantity.needs_slip:
                branch_values[name][:] = math.nan
    level_end = np.full(rising.shape, math.nan)
    if not spring > 0 and definitions.is_default_sliding:
        level_end = _read_level_parts(
            trace, ends, branch_values, left_out, definitions=definitions, read=read
        )
    rising[np.isfinite(level_end)] = False
    loops = Loops(
        trace,
        definitions,
        band,
        steady.number,
        ends,
        tuple(piece for piece in pieces if piece[0] < piece[1]),
        **branch_values,
        dissipated_energy=energy,
        displacement_gap=np.where(complete, moved[ends[:, 2]] - moved[ends[:, 0]], math.nan),
        tangential_load_gap=np.where(complete, load[ends[:, 2]] - load[ends[:, 0]], math.nan),
        amplitude=amplitude,
        left_out_branches=left_out,
        stepped_branches=stepped,
        rising_branches=rising & ~left_out,
        level_end=level_end,
        exclusions=(*whole_period, *steady.notes),
        lateral_stiffness=lateral_stiffness,
        displacement_noise=noise,
        parallel_stiffness=spring,
    )
    return loops.without_first(check_skip(skip_per_level, "skip_per_level"))


def _read_level_parts(
    trace: Trace,
    ends: Integers,
    values: dict[str, Floats],
    left_out: Booleans,
    *,
    definitions: Definitions,
    read: Callable[..., tuple[tuple[float, ...], bool]],
) -> Floats:
    """Read branches that end at a stop over their level part; return the displacement at its end (loop, direction)."""
    moved = trace.displacement
    level_end = np.full(left_out.shape, math.nan)
    parts = branch_shape.find_level_parts(trace, ends)
    for loop, branch in np.argwhere(np.isfinite(parts[..., 0])).tolist():
        start, stop = ends[loop, branch : branch + 2].tolist()
        side, (begin, end) = int(moved[stop] < moved[start]), parts[loop, branch].tolist()
        if left_out[loop, side]:
            continue
        level = attrs.evolve(definitions, sliding_part=1 - begin, sliding_end=end)
        numbers, _ = read(trace, start, stop, definitions=level)
        for name, number in zip(BRANCH_QUANTITIES, numbers, strict=True):
            if np.isfinite(values[name][loop, side]):
                values[name][loop, side] = number
        level_end[loop, side] = moved[start] + end * (moved[stop] - moved[start])
    begins_at_stop = np.isfinite(level_end[:, ::-1])
    for name, quantity in BRANCH_QUANTITIES.items():
        if quantity.needs_slip and quantity.needs_reversal:
            values[name][begins_at_stop] = math.nan
    return level_end


def check_skip(skip: float, name: str = "skip") -> int:
    """Return the number of loops left out at the start; InputError if it is not a whole number of 0 or more."""
    count = scalar(name, skip)
    if count % 1 or count < 0:
        raise InputError(
            f"{name} is {count:g}; expected a whole number of loops to leave out, 0 or more"
        )
    return int(count)


def _spoilt_channel(trace: Trace) -> str:
    """Describe a channel that cannot give loops, with the remedy; empty if it is sound."""
    for name, values in (
        ("displacement", trace.displacement),
        ("tangential load", trace.tangential_load),
    ):
        if jumps := jumps_of_counter(values):
            return f"the {name} {jumps}"
    return sign_lost(trace.tangential_load)


def _check_sense(trace: Trace, energy: Floats, ends: Integers) -> None:
    """Refuse loops, given by the samples at their ends, that give energy instead of taking it."""
    displacement = trace.displacement[ends]
    load = trace.tangential_load[ends]
    box = np.ptp(displacement, axis=1) * np.ptp(load, axis=1)
    # rounding makes energy of a load that does not change
    rounding = float(np.abs(displacement).max() * np.abs(load).max()) * ROUNDING
    if energy.sum() < WRONG_WAY * box.sum() - rounding:
        given = f"friction would give {-energy.mean():.4g} J per loop instead of taking it"
        if cause := _spoilt_channel(trace):
            raise InputError(f"{cause}: {given}")
        raise InputError(
            f"the loops run the wrong way round: {given}; expected displacement and tangential_load positive "
            "in one direction: reverse one of the two, with a scale of -1, or mend their columns where they are swapped"
        )
