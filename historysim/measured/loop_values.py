"""Values of the friction loops of a record, measured or simulated, and which loops are none of friction.

README.md of this folder, "How loops are read", says how each value is found.
"""

import functools
import math
from typing import Literal, Self

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.measured import branch_shape
from historysim.measured.branches import Definitions, Trace
from historysim.measured.intervals import Wander, compute_mean_wander
from historysim.measured.loop_table import (
    CONFIDENCE,
    Along,
    LoopQuantity,
    LoopStatistics,
    LoopTable,
    PowerLawFit,
    energy_law,
    same_amplitude,
    same_load,
)
from historysim.measured.reduction import sign_lost

Direction = Literal["forward", "backward", "both"]

DIRECTIONS: tuple[Direction, Direction] = ("forward", "backward")

BRANCH_QUANTITIES = {
    "friction_force": LoopQuantity("friction force", "N", needs_slip=True),
    "normal_load": LoopQuantity("normal load", "N"),
    "friction_coefficient": LoopQuantity("friction coefficient", "1", needs_slip=True),
    "preliminary_displacement": LoopQuantity(
        "preliminary displacement", "m", needs_slip=True, needs_reversal=True
    ),
    "displacement_from_zero_load": LoopQuantity(
        "displacement from zero load", "m", needs_slip=True, needs_reversal=True
    ),
    "virgin_displacement": LoopQuantity(
        "virgin displacement θμδ", "m", needs_slip=True, needs_reversal=True
    ),
    "tangential_stiffness": LoopQuantity("stiffness at reversal", "N m-1", needs_reversal=True),
}
LOOP_QUANTITIES = {
    "dissipated_energy": LoopQuantity("energy per loop", "J"),
    "displacement_gap": LoopQuantity("gap in displacement", "m", is_gap=True),
    "tangential_load_gap": LoopQuantity("gap in tangential load", "N", is_gap=True),
}
QUANTITIES = {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}
# quantities with a mean
MEAN_QUANTITIES = {name: quantity for name, quantity in QUANTITIES.items() if not quantity.is_gap}

CONTENT = "friction loops"  # value of the attribute ``content`` of a file of loops
CLEARLY_ABOVE = 3.0  # standard errors by which height and energy of friction loops are above 0
# height and energy, over the largest load and the box around the loop, that are none
ROUNDING = 1e-9
FEWEST_AMPLITUDES = 3  # classes of amplitudes from which on powers of it show
DAMPER = "as those of a spring with a damper or a lag"
OPEN = 2.0  # gap of the load over the half height from which on a loop does not close


class NoLoopError(InputError):
    """A record has no whole loop, or none is left after those that are skipped."""


@attrs.frozen(eq=False)
class LoopValues:
    """Quantities of the loops of a record.

    Quantities of branches are arrays (loop, direction) with the forward branch first; NaN where a
    branch has no value. Means over the loops (`statistics`, `Loops.rows`) are those of the `large`
    ones.
    """

    trace: Trace  #: the record that they were found in
    definitions: Definitions
    dead_band: float  #: the smallest swing of the displacement that was taken for a reversal [m]
    number: Integers  #: (loop) Which loop of the record each one is, from 0
    ends: Integers  #: (loop, 3) The samples at which each loop begins, turns back, and ends
    #: Pieces of the record at its beginning and its end, from sample to sample, that are no part of
    #: a loop.
    left_out: tuple[tuple[int, int], ...]
    friction_force: Floats  #: [N], positive
    normal_load: Floats  #: mean over the sliding part [N]
    friction_coefficient: Floats  #: [1]
    preliminary_displacement: Floats  #: from the reversal to a share of the limit [m]
    displacement_from_zero_load: Floats  #: from zero load to the same share [m]
    virgin_displacement: Floats  #: θμδ of the sphere that is nearest, without the instrument [m]
    tangential_stiffness: Floats  #: at the reversal [N/m]
    dissipated_energy: Floats  #: (loop) ∮ T dU [J]
    displacement_gap: Floats  #: (loop) U at the end of the loop less that at its start [m]
    tangential_load_gap: Floats  #: (loop) Likewise T [N]
    amplitude: Floats  #: (loop) Half the mean length of the branches that are not left out [m]
    #: Branches that have no values: the normal load moves on them, or the record ends on them.
    left_out_branches: Booleans
    #: Branches without preliminary displacement and stiffness, since they begin with a step of the
    #: normal load.
    stepped_branches: Booleans
    #: Branches on which the load still rises where they should slide (`Definitions.still_rising`):
    #: their friction and their displacements are lower bounds, and stay out of means.
    rising_branches: Booleans
    #: (loop, direction) Displacement from which on the load of a branch rises again, as at a stop;
    #: its friction is that of the level part before. NaN for other branches [m].
    level_end: Floats
    exclusions: tuple[str, ...] = ()  #: what was left out, and why
    #: Of an instrument in series, of the drive of which the displacement is [N/m]; inf for that of
    #: the contact.
    lateral_stiffness: float = math.inf
    #: lines of (label, text): what was done to the record before
    remarks: tuple[tuple[str, str], ...] = ()
    #: standard deviation of the noise of the displacement, 0 where it is not known [m]
    displacement_noise: float = 0.0
    #: Stiffness of a spring in parallel with the contact [N/m], which hides slip; NaN if branches
    #: show none.
    parallel_stiffness: float = math.nan
    columns: str = ""  #: the question whether the right columns were read, which names them

    def __len__(self) -> int:
        """Return the number of loops."""
        return self.number.size

    # -- which loops -------------------------------------------------------------------------------

    @property
    def large(self) -> Booleans:
        """Which loops count in means (loop): see `Definitions.amplitude_share`."""
        large: Booleans = self.amplitude >= self.definitions.amplitude_share * self.amplitude.max()
        return large

    @property
    def hooked_branches(self) -> Booleans:
        """Branches whose load rises again at their end (loop, direction)."""
        return np.asarray(np.isfinite(self.level_end))

    @property
    def load_level(self) -> Integers:
        """Which normal load each loop is at (loop): a number from 0 that rises with it, or -1 where it is not known."""
        with np.errstate(invalid="ignore"):
            load = np.nansum(self.normal_load, axis=1) / np.isfinite(self.normal_load).sum(axis=1)
        return same_load(load, self.definitions.load_share)

    def without_first(self, count: int) -> Self:
        """Drop the first loops of each series at one load; NoLoopError if none remains."""
        if not count:
            return self
        starts = np.flatnonzero(np.diff(self.load_level, prepend=-2))
        position = np.arange(len(self)) - np.repeat(starts, np.diff(starts, append=len(self)))
        selected = position >= count
        if not selected.any():
            raise NoLoopError(
                f"no series of loops at one normal load has more than the {count:,} that are to be left out; expected "
                "one with more: lower skip_per_level"
            )
        branches = "left_out_branches", "stepped_branches", "rising_branches", "level_end"
        names = "number", "ends", "amplitude", *branches
        note = (
            f"the first {count_text(count, 'loop is', 'loops are')} left out at each load, "
            f"{(~selected).sum():,} in all"
        )
        values = {name: getattr(self, name)[selected] for name in (*QUANTITIES, *names)}
        return attrs.evolve(self, **values, exclusions=(*self.exclusions, note))

    def amplitude_classes(self) -> tuple[Integers, ...]:
        """Return which loops, by position, are in each class of amplitudes that spans a factor of two."""
        classes = same_amplitude(self.amplitude)
        return tuple(np.flatnonzero(classes == number) for number in range(classes.max() + 1))

    @functools.cached_property
    def no_friction(self) -> tuple[tuple[Integers, str], ...]:
        """Classes of loops that are no friction loops: their positions, and a note that gives the reason."""
        levels = self.load_level[self.large]
        classes = []
        if self._has_damper:
            everyone = np.arange(len(self))
            reason = "their energy is proportional to the square of the amplitude, and their load to the amplitude"
            return (
                (
                    everyone,
                    f"{count_text(len(self), 'loop', 'loops')} are no friction: {reason}, {DAMPER}",
                ),
            )
        large = [np.flatnonzero(self.large)[levels == level] for level in np.unique(levels)]
        small = [members[~self.large[members]] for members in self.amplitude_classes()]
        for number, members in enumerate(large + small):
            if not members.size or not (reason := self._why_no_friction(members)):
                continue
            where = (
                f"of an amplitude of {quantity_text(float(self.amplitude[members].mean()), 'm')} "
            )
            if number < len(large):
                load = (
                    quantity_text(float(np.nanmean(self.normal_load[members])), "N")
                    if len(large) > 1
                    else ""
                )
                where = f"at {load} " if load else ""
            many = count_text(members.size, "loop", "loops")
            are = "is no" if members.size == 1 else "are no"
            classes.append((members, f"{many} {where}{are} friction: {reason}"))
        return tuple(classes)

    @property
    def is_friction(self) -> Booleans:
        """Which loops are friction loops (loop)."""
        friction = np.ones(len(self), dtype=np.bool_)
        for members, _ in self.no_friction:
            friction[members] = False
        return friction

    def _why_no_friction(self, members: Integers) -> str:
        """Return the reason why loops of one class are not friction loops; empty if they are.

        Forward, the load is clearly above that backward; the load comes back; and the loops take
        energy.
        """
        forces = self.friction_force[members]
        if self.hooked_branches.any():
            # a bound that holds the load of a stop
            forces = np.where(self.rising_branches[members], math.nan, forces)
        height, gap, energy = (
            values[np.isfinite(values)]
            for values in (
                forces.mean(axis=1),
                self.tangential_load_gap[members],
                self.dissipated_energy[members],
            )
        )
        if not height.size:
            return ""
        largest = float(np.nanmax(np.abs(self.friction_force[members])))
        if not _above(height, ROUNDING * largest):
            of = quantity_text(float(height.mean()), "N", 3)
            lost = sign_lost(self.trace.tangential_load)
            return (
                lost
                or f"forward, the load is {of} more than the mean of both directions, which is not clear of 0"
            )
        if gap.size and abs(float(np.median(gap))) > OPEN * height.mean():
            moved = quantity_text(float(np.median(gap)), "N", 3)
            return f"the load does not come back: it moves on by {moved} per loop"
        if energy.size and not _above(
            energy, 4 * ROUNDING * largest * float(self.amplitude[members].max())
        ):
            enclosed = quantity_text(float(energy.mean()), "J", 3)
            return f"they enclose {enclosed} on average, no energy that is clear of 0"
        if branch_shape.is_ellipse(self.trace, self.ends[members]):
            return f"they are ellipses, no branch is level, {DAMPER}"
        return ""

    @property
    def _has_damper(self) -> bool:
        """True if energy and load scale with the amplitude at one load as in a spring with a damper."""
        classes = self.amplitude_classes()
        if len(classes) < FEWEST_AMPLITUDES or self.load_level.max() > 0:
            return False
        load = np.array(
            [
                np.ptp(self.trace.tangential_load[start : stop + 1])
                for start, _, stop in self.ends.tolist()
            ]
        )
        quantities = self.amplitude, load, self.dissipated_energy
        means = [np.array([values[members].mean() for members in classes]) for values in quantities]
        return branch_shape.has_quadratic_energy(*means)

    # -- statistics --------------------------------------------------------------------------------

    def statistics(self, quantity: str, direction: Direction = "both") -> LoopStatistics:
        """Return mean and scatter of a quantity over the large loops, where it needs sliding over those that slid.

        Of quantities of branches, "both" takes the mean of the two branches of each loop first.
        """
        if direction not in {*DIRECTIONS, "both"}:
            raise InputError(
                f"direction is {direction!r}; expected 'forward', 'backward' or 'both'"
            )
        return self._statistics(self._sliding_values(quantity), direction)

    def _statistics(self, values: Floats, direction: Direction) -> LoopStatistics:
        if direction != "both" and values.ndim == 2:
            values = values[:, DIRECTIONS.index(direction)]
        return LoopStatistics.from_values(values[self.large])

    def _sliding_values(self, quantity: str) -> Floats:
        """Return a quantity, NaN for branches without sliding, where it would be a lower bound."""
        if quantity not in QUANTITIES:
            raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(QUANTITIES)}")
        values: Floats = getattr(self, quantity)
        if not QUANTITIES[quantity].needs_slip:
            return values
        return np.where(self.rising_branches, math.nan, values)

    def _friction_values(self, quantity: str, values: Floats) -> Floats:
        """Return values of a quantity, NaN for loops that are not friction."""
        declared = QUANTITIES[quantity]
        if not (declared.needs_slip or declared.needs_reversal):
            return values
        return np.where(self.is_friction[:, None], values, math.nan)

    def wander(self, quantity: str) -> Wander | None:
        """Measure the variation of the mean of a quantity over the large loops; None for fewer than three values."""
        values = self._sliding_values(quantity)[self.large]
        values = values.reshape(len(values), -1).mean(axis=1)
        return compute_mean_wander(values[np.isfinite(values)], CONFIDENCE)

    def energy_law(self) -> tuple[PowerLawFit, int] | None:
        """Return energy per loop as a power of the amplitude, and its number of amplitudes.

        Of all friction loops; None for several normal loads, or fewer than three amplitudes over a
        factor of two.
        """
        if self.load_level.max() > 0:
            return None
        return energy_law(
            self.amplitude[self.is_friction], self.dissipated_energy[self.is_friction]
        )

    def by_load(self) -> LoopTable:
        """Return statistics of the large loops, a row for each normal load; empty where that was not measured."""
        level = self.load_level
        members = [
            np.flatnonzero((level == group) & self.large) for group in range(level.max() + 1)
        ]
        groups = tuple(group for group in members if group.size)
        return self._table(
            "normal_load",
            np.array([np.nanmean(self.normal_load[group]) for group in groups]),
            groups,
        )

    def by_amplitude(self) -> LoopTable:
        """Return statistics of all loops, a row for each class of amplitudes that spans a factor of two."""
        members = self.amplitude_classes()
        return self._table(
            "amplitude", np.array([self.amplitude[loops].mean() for loops in members]), members
        )

    def _table(self, along: Along, value: Floats, members: tuple[Integers, ...]) -> LoopTable:
        values = {
            name: self._friction_values(name, self._sliding_values(name))
            for name in MEAN_QUANTITIES
        }
        attributes = self._attributes()
        return LoopTable(along, value, members, MEAN_QUANTITIES, values, DIRECTIONS, attributes)

    def _attributes(self) -> dict[str, str | float | int]:
        """Return the definitions of the loops as attributes for files."""
        shares = self.definitions
        without = "; ".join(text for _, text in self.no_friction)
        attributes: dict[str, str | float | int] = {
            "no_friction": without,
            "dead_band": self.dead_band,
            "sliding_part": shares.sliding_text,
            "preliminary_displacement_reached_at": shares.reached,
            "initial_part": shares.initial_text,
            "load_share": shares.load_share,
            "amplitude_share": shares.amplitude_share,
            "still_rising": shares.still_rising,
            "left_out": "; ".join(self.exclusions),
        }
        if (law := self.energy_law()) is not None:
            attributes |= {
                f"energy_over_amplitude_{name}": value
                for name, value in attrs.asdict(law[0]).items()
            }
        return {name: value for name, value in attributes.items() if value != ""}


def _above(values: Floats, rounding: float) -> bool:
    """Return whether the mean of values is above 0, clear of their scatter, which three or more show."""
    scatter = (
        CLEARLY_ABOVE * float(values.std(ddof=1)) / np.sqrt(values.size) if values.size > 2 else 0.0
    )
    return bool(values.mean() > max(scatter, rounding))
