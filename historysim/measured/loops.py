"""Friction loops of a record, measured or simulated, and what each of them says; `splitting` finds them.

The tangential displacement U and the load T that drives it
count positive in one direction, so that friction takes energy: ∮ T dU > 0. A *branch* leads from one reversal to the
next; on the forward one U rises, and T tends to +μN; on the backward one U falls, and T tends to -μN. Below, u and f
are displacement and load of a branch in its own direction, u = ±(U - U_reversal) and f = ±T, with + on the forward
branch, so that both branches look alike.

What is read off a branch, with the choices that `Definitions` has:

- **friction force** F: the mean of f over the displacement of the sliding part, ∫ f du / ∫ du. An offset of T moves it
  up on one branch and down on the other; the mean of both is free of it.
- **normal load** and **friction coefficient**: the mean of N over the same displacement, and F over it.
- **preliminary displacement**: u where f has first come a given share p of the way from the reversal to F. One asperity
  at constant normal load that slid before the reversal has 2 θμδ (1 - (1 - p)^(2/3)), which tends to 2 θμδ, twice the
  preliminary displacement of virgin loading (Masing).
- **stiffness** at the reversal: the slope of the least-squares line through the first part of the branch, of U over T
  where that part is told by the load, and of T over U where it is told by the displacement, so that noise of the other
  channel does not tilt it. It is less than k_t = 8 G* Σa by what the curve bends there.

and off a whole loop:

- **energy**: ∮ T dU by the trapezoidal rule through all samples, exact for a polyline, closed by a straight line from
  the end back to the start; **gaps** say how far those two are apart.
"""

import math
from typing import TYPE_CHECKING, Literal, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.display import html_table
from historysim.basics.units import prefixed, quantity_text
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.measured.definitions import Definitions
from historysim.measured.power_law import power_law
from historysim.measured.range_pairs import range_pairs

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Direction = Literal["forward", "backward", "both"]

DIRECTIONS: tuple[Direction, Direction] = ("forward", "backward")

# what each quantity is called, and its unit
BRANCH_QUANTITIES = {
    "friction_force": ("friction force", "N"),
    "normal_load": ("normal load", "N"),
    "friction_coefficient": ("friction coefficient", "1"),
    "preliminary_displacement": ("preliminary displacement", "m"),
    "tangential_stiffness": ("stiffness at reversal", "N m-1"),
}
LOOP_QUANTITIES = {
    "dissipated_energy": ("energy per loop", "J"),
    "displacement_gap": ("gap in displacement", "m"),
    "tangential_load_gap": ("gap in tangential load", "N"),
}

CONTENT = "friction loops"
"""What the attribute ``content`` of a file of loops says, by which such a file is known."""
SEVERAL_LOADS = 0.05
"""Range of the normal load over the greatest one from which on friction can be told to go with the load."""


@attrs.frozen
class LoopStatistics:
    """Mean and scatter of one quantity over the loops.

    Attributes
    ----------
    mean : float
        NaN where no loop has a value.
    standard_deviation : float
        Of one loop, with count - 1 in the denominator; NaN for fewer than two.
    count : int
        The loops that have a value.
    """

    mean: float
    standard_deviation: float
    count: int

    @classmethod
    def of(cls, values: Floats) -> Self:
        """Return those of values (loop), or of (loop, direction), of which each loop counts with its mean."""
        values = values.reshape(len(values), -1).mean(axis=1)
        values = values[np.isfinite(values)]
        return cls(
            mean=float(values.mean()) if values.size else math.nan,
            standard_deviation=float(values.std(ddof=1)) if values.size > 1 else math.nan,
            count=values.size,
        )

    def text(self, unit: str, loops: int) -> str:
        """Return mean ± standard deviation as a text, and of how many loops where that is not all of them."""
        if self.count == 0:
            return "–"
        factor, prefix = prefixed(self.mean) if unit != "1" else (1.0, "")
        # a scatter at the level of rounding is none
        spread = self.standard_deviation if self.standard_deviation > 1e-12 * abs(self.mean) else 0.0
        scatter = f" ± {spread * factor:.2g}" if self.count > 1 else ""
        symbol = {"1": "", "N m-1": f" {prefix}N/m"}.get(unit, f" {prefix}{unit}")
        some = f" (of {self.count})" if self.count < loops else ""
        return f"{self.mean * factor:.4g}{scatter}{symbol}{some}"


@attrs.frozen(eq=False)
class Trace:
    """The channels that loops are found in, over time; the normal load is None where it is not known.

    Attributes
    ----------
    time : array (sample)
        Times that do not decrease [s].
    displacement : array (sample)
        Tangential displacement U [m].
    tangential_load : array (sample)
        T [N], positive in the direction of U.
    normal_load : array (sample) or None
        N [N].
    """

    time: Floats
    displacement: Floats
    tangential_load: Floats
    normal_load: Floats | None


@attrs.frozen(eq=False)
class Loops:
    """The loops of a record.

    Quantities of branches are arrays (loop, direction) with the forward branch first; NaN where a branch has no value.

    Attributes
    ----------
    trace : Trace
        The record that they were found in.
    definitions : Definitions
    dead_band : float
        The smallest swing of the displacement that was taken for a reversal [m].
    number : array of int (loop)
        Which loop of the record each one is, from 0.
    ends : array of int (loop, 3)
        The samples at which each loop begins, turns back, and ends.
    left_out : tuple of (int, int)
        Pieces of the record at its beginning and its end, from sample to sample, that are no part of a loop.
    friction_force : array (loop, direction)
        [N], positive.
    normal_load : array (loop, direction)
        Mean over the sliding part [N].
    friction_coefficient : array (loop, direction)
        [1].
    preliminary_displacement : array (loop, direction)
        From the reversal [m].
    tangential_stiffness : array (loop, direction)
        At the reversal [N/m].
    dissipated_energy : array (loop)
        ∮ T dU [J].
    displacement_gap, tangential_load_gap : array (loop)
        U [m] and T [N] at the end of the loop less those at its start.
    remarks : tuple of (label, text)
        What was done to the record before.
    """

    trace: Trace = attrs.field(repr=False)
    definitions: Definitions
    dead_band: float
    number: Integers
    ends: Integers
    left_out: tuple[tuple[int, int], ...]
    friction_force: Floats
    normal_load: Floats
    friction_coefficient: Floats
    preliminary_displacement: Floats
    tangential_stiffness: Floats
    dissipated_energy: Floats
    displacement_gap: Floats
    tangential_load_gap: Floats
    remarks: tuple[tuple[str, str], ...] = ()

    def __len__(self) -> int:
        """Return the number of loops."""
        return self.number.size

    def __repr__(self) -> str:
        shown = ("friction_force", "friction_coefficient", "preliminary_displacement", "dissipated_energy")
        table = {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}
        texts = [f"{table[name][0]} {self.text(name, table[name][1])}" for name in shown]
        return f"<Loops: {', '.join([counted(len(self), 'loop', 'loops'), *texts])}>"

    def _repr_html_(self) -> str:
        heading, *rows = self.rows()
        return html_table(rows, heading)

    def statistics(self, quantity: str, direction: Direction = "both") -> LoopStatistics:
        """Return mean and scatter of a quantity over the loops.

        Parameters
        ----------
        quantity : str
            The name of one of the arrays.
        direction : {"forward", "backward", "both"}
            For quantities of branches. "both" takes the mean of the two branches of each loop first.

        Raises
        ------
        InputError
            Another name.
        """
        if direction not in {*DIRECTIONS, "both"}:
            raise InputError(f"direction is {direction!r}; expected 'forward', 'backward' or 'both'")
        if quantity not in {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}:
            raise InputError(
                f"quantity is {quantity!r}; expected one of {', '.join([*BRANCH_QUANTITIES, *LOOP_QUANTITIES])}"
            )
        values: Floats = getattr(self, quantity)
        if direction != "both" and values.ndim == 2:
            values = values[:, DIRECTIONS.index(direction)]
        return LoopStatistics.of(values)

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): remarks, dead band, range pairs, friction over the load, what is missing."""
        return [
            *self.remarks,
            ("dead band", self._dead_band_text()),
            ("range pairs", self._range_pairs_text()),
            *self._friction_over_load(),
            *(("note", text) for text in self.notes),
        ]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the samples are too few to tell, and the mend."""
        unknown = int(np.isnan(self.tangential_stiffness).any(axis=1).sum())
        if not unknown:
            return ()
        missing = f"{unknown:,} of {counted(len(self), 'loop', 'loops')} without a stiffness at reversal"
        needed = f"the first part of a branch, {self.definitions.initial}, needs two samples or more that rise"
        mend = "record more often (substeps of a simulation), or take a longer first part"
        return (f"{missing}: {needed}; {mend}",)

    def _dead_band_text(self) -> str:
        length = float(np.ptp(self.trace.displacement))
        share = f", {100 * self.dead_band / length:.3g} % of the range of the displacement" if length > 0 else ""
        return f"{quantity_text(self.dead_band, 'm')}{share}"

    def _range_pairs_text(self) -> str:
        pairs = range_pairs(self.trace.displacement, dead_band=self.dead_band)
        closed = pairs.range[pairs.count == 1]
        largest = f", up to {quantity_text(float(closed.max()), 'm')}" if closed.size else ""
        return (
            f"{closed.size:,} closed{largest}; {counted(pairs.range.size - closed.size, 'half cycle', 'half cycles')}"
        )

    def _friction_over_load(self) -> list[tuple[str, str]]:
        load, friction = self.normal_load.mean(axis=1), self.friction_coefficient.mean(axis=1)
        known = (load > 0) & (friction > 0)
        load, friction = load[known], friction[known]
        if load.size < 3 or np.ptp(load) <= SEVERAL_LOADS * load.max():
            return []
        law = power_law(load, friction)
        interval = f"95 %: {law.exponent_low:+.3f} to {law.exponent_high:+.3f}"
        return [("friction over load", f"coefficient goes with the power {law.exponent:+.3f} of N ({interval})")]

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return the summary as a table of texts: quantity, forward, backward, both; the first row is the heading.

        Values are mean ± standard deviation over the loops, and the largest of the gaps without its sign.
        """
        table: list[tuple[str, str, str, str]] = [("quantity", *DIRECTIONS, "both")]
        for name, (label, unit) in BRANCH_QUANTITIES.items():
            forward, backward = (self.text(name, unit, direction) for direction in DIRECTIONS)
            table.append((label, forward, backward, self.text(name, unit, "both")))
        for name, (label, unit) in LOOP_QUANTITIES.items():
            if name.endswith("_gap"):
                text = quantity_text(float(np.abs(getattr(self, name)).max()), unit)
                table.append((f"largest {label}", "", "", text))
            else:
                table.append((label, "", "", self.text(name, unit, "both")))
        skipped = f", {self.number[0]} before them skipped" if self.number[0] else ""
        table.append(("loops", "", "", f"{len(self)}{skipped}"))
        return table

    def to_dataset(self) -> "xr.Dataset":
        """Return all quantities as a Dataset with the dimensions loop and direction, and the definitions in words."""
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
            },
            attrs={
                "title": counted(len(self), "friction loop", "friction loops"),
                "content": CONTENT,
                "dead_band": self.dead_band,
                "sliding_part": str(self.definitions.sliding),
                "preliminary_displacement_reached_at": self.definitions.reached,
                "initial_part": str(self.definitions.initial),
            },
        )

    def text(self, quantity: str, unit: str, direction: Direction = "both") -> str:
        """Return mean ± standard deviation of a quantity as a text; parameters and errors as in `statistics`."""
        return self.statistics(quantity, direction).text(unit, len(self))
