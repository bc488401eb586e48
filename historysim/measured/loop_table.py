"""Loops in groups, those at one normal load or of one amplitude: a table with a row for each group.

Loops at one load are those whose normal loads differ by no more than a share. Loops of one amplitude are those within a
factor of two, counted down from the largest. What the source prints of its measurements is the first kind of table:
quantities over the normal load, with their scatter (Winogrodzka, Appendix C).
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import attrs
import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.basics.display import columns, html_table
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.measured.power_law import PowerLawFit, StraightLine, straight_line, through_logarithms
from historysim.measured.statistics import LoopStatistics

if TYPE_CHECKING:
    import xarray as xr

Along = Literal["normal_load", "amplitude"]

BOTH = "both"
UNITS = {"normal_load": "N", "amplitude": "m"}
DIMENSIONS = {"normal_load": "level", "amplitude": "amplitude_class"}
HEADINGS = {"normal_load": "normal load", "amplitude": "amplitude"}
CONTENT_OF_TABLE = "statistics of friction loops"
"""What the attribute ``content`` of a file of such a table says."""


@attrs.frozen
class LoopQuantity:
    """What one quantity is called, its unit, and its values."""

    label: str
    unit: str
    """SI."""
    values: Floats = attrs.field(eq=False)
    """(loop) NaN where there is none."""


@attrs.frozen(eq=False)
class LoopTable:
    """Statistics of loops in groups.

    Attributes
    ----------
    along : {"normal_load", "amplitude"}
        What the loops of a group have in common.
    value : array (group)
        Its mean over the loops of each group, ascending [N or m].
    members : tuple of arrays of int (group)
        Which of the loops, by position, are in each group.
    quantities : mapping of str to LoopQuantity
    directions : tuple of str
        The names of the directions of branches.
    attributes : mapping of str to (str, float or int)
        How the loops were found, for files.
    """

    along: Along
    value: Floats
    members: tuple[Integers, ...]
    quantities: Mapping[str, LoopQuantity]
    directions: tuple[str, ...]
    attributes: Mapping[str, str | float | int] = attrs.field(factory=dict)

    def __len__(self) -> int:
        """Return the number of groups."""
        return len(self.members)

    def __repr__(self) -> str:
        return columns(self.rows())

    def _repr_html_(self) -> str:
        heading, *rows = self.rows()
        return html_table(rows, heading)

    def statistics(self, quantity: str, direction: str = BOTH) -> tuple[LoopStatistics, ...]:
        """Return mean and scatter of a quantity in each group.

        Parameters
        ----------
        quantity : str
            One of `quantities`.
        direction : str
            One of `directions`, or ``"both"``: the mean of the two branches of each loop that has both.
        """
        values = self.quantities[quantity].values
        if direction != BOTH and values.ndim == 2:
            values = values[:, self.directions.index(direction)]
        return tuple(LoopStatistics.of(values[members]) for members in self.members)

    def means(self, quantity: str) -> Floats:
        """Return the mean of a quantity in each group (group); of what there is where no loop has both branches."""
        means = np.array([each.mean for each in self.statistics(quantity)])
        for group in np.flatnonzero(np.isnan(means)):
            values = self.quantities[quantity].values[self.members[group]]
            known = values[np.isfinite(values)]
            means[group] = known.mean() if known.size else np.nan
        return means

    def friction_line(self) -> StraightLine | None:
        """Return F = μ N + F0 through the means at the loads; None for fewer than two loads."""
        known, load, force = self._known("friction_force")
        return straight_line(load, force) if known > 1 else None

    def power_law(self, quantity: str) -> PowerLawFit | None:
        """Return quantity ∝ N^n through its positive means at the loads; None for fewer than two loads."""
        known, load, values = self._known(quantity)
        return through_logarithms(load, values) if known > 1 else None

    def _known(self, quantity: str) -> tuple[int, Floats, Floats]:
        means = self.means(quantity)
        known = (means > 0) & (self.value > 0)
        if self.along != "normal_load":
            known[:] = False
        return int(known.sum()), self.value[known], means[known]

    def laws(self) -> list[tuple[str, str]]:
        """Return lines of (label, text) that say how friction and displacement go with the load."""
        line = self.friction_line()
        if line is None:
            return []
        interval = f" (95 %: {line.slope_low:.4g} to {line.slope_high:.4g}; {_range(line)})" if line.count > 2 else ""
        offset = f"{'-' if line.intercept < 0 else '+'} {quantity_text(abs(line.intercept), 'N', 3)}"
        over = counted(line.count, "load", "loads") + ("" if interval else ", which give no interval")
        lines = [("friction over load", f"F = {line.slope:.4g} N {offset}{interval}, through the means at {over}")]
        for label, quantity, text in (
            ("", "friction_coefficient", "coefficient"),
            ("displacement over load", "preliminary_displacement", "preliminary displacement"),
            ("", "virgin_displacement", "virgin displacement"),
        ):
            law = self.power_law(quantity)
            if law is not None:
                interval = f" (95 %: {law.exponent_low:+.3f} to {law.exponent_high:+.3f})" if line.count > 2 else ""
                lines.append((label, f"{text} goes with the power {law.exponent:+.3f} of N{interval}"))
        return lines

    def rows(self) -> list[tuple[str, ...]]:
        """Return the table as texts: for each quantity its name, and below it a row for each group.

        Values are mean ± standard deviation of one loop; where not all loops of the group have a value, how many.
        """
        table = [(HEADINGS[self.along], "loops", *self.directions, BOTH)]
        for name, each in self.quantities.items():
            if name == self.along:
                continue
            table.append((each.label, "", *("" for _ in self.directions), ""))
            directions = (*self.directions, BOTH) if each.values.ndim == 2 else (BOTH,)
            by_direction = [self.statistics(name, direction) for direction in directions]
            for group, (value, members) in enumerate(zip(self.value, self.members, strict=True)):
                texts = [of[group].text(each.unit, members.size) for of in by_direction]
                blank = [""] * (len(self.directions) + 1 - len(texts))
                head = f"  {quantity_text(float(value), UNITS[self.along])}", f"{members.size:,}"
                table.append((*head, *blank, *texts))
        return table

    def to_dataset(self) -> "xr.Dataset":
        """Return all statistics as a Dataset with the dimensions level, or amplitude_class, and direction.

        Each quantity has its mean under its own name, ``…_standard_deviation`` of one loop, and ``…_count``. The laws
        over the load stand in the attributes.
        """
        import xarray as xr

        dimension = DIMENSIONS[self.along]
        variables = {}
        for name, each in self.quantities.items():
            directions = (*self.directions, BOTH) if each.values.ndim == 2 else (BOTH,)
            by_direction = [self.statistics(name, direction) for direction in directions]
            for field, unit in (("mean", each.unit), ("standard_deviation", each.unit), ("count", "1")):
                suffix = "" if field == "mean" else f"_{field}"
                values = np.array([[getattr(one, field) for one in of] for of in by_direction]).T
                dims = (dimension, "direction") if each.values.ndim == 2 else (dimension,)
                attributes = {"long_name": f"{each.label}{suffix.replace('_', ' ')}", "units": unit}
                variables[f"{name}{suffix}"] = (dims, values if len(dims) == 2 else values[:, 0], attributes)
        heading = HEADINGS[self.along]
        return xr.Dataset(
            variables,
            coords={
                dimension: (dimension, self.value, {"long_name": heading, "units": UNITS[self.along]}),
                "loops": (dimension, [members.size for members in self.members], {"long_name": "number of loops"}),
                "direction": ("direction", [*self.directions, BOTH]),
            },
            attrs={
                "title": f"friction loops by {heading}",
                "content": CONTENT_OF_TABLE,
                **self.attributes,
                **self._law_attributes(),
            },
        )

    def _law_attributes(self) -> dict[str, float]:
        line = self.friction_line()
        attributes: dict[str, float] = {}
        if line is not None:
            attributes = {f"friction_line_{name}": value for name, value in attrs.asdict(line).items()}
        for quantity in ("friction_coefficient", "preliminary_displacement", "virgin_displacement"):
            law = self.power_law(quantity)
            if law is not None:
                attributes.update({f"{quantity}_{name}": value for name, value in attrs.asdict(law).items()})
        return attributes


def same_load(normal_load: Floats, share: float) -> Integers:
    """Return which load each loop is at (loop): a number that rises with the load, and -1 where it is not known.

    From the least load on, loads that exceed the least one of their group by no more than the share are one.
    """
    group = np.full(normal_load.size, -1)
    known = np.flatnonzero(np.isfinite(normal_load))
    number, least = -1, -np.inf
    for loop in known[np.argsort(normal_load[known], kind="stable")]:
        if number < 0 or normal_load[loop] - least > share * abs(normal_load[loop]):
            number, least = number + 1, normal_load[loop]
        group[loop] = number
    return group


def same_amplitude(amplitude: Floats) -> Integers:
    """Return which class of amplitudes each loop is in (loop): each spans a factor of two, its ends included.

    Numbers rise with the amplitude and leave none out.
    """
    halvings = np.maximum(np.ceil(-np.log2(amplitude / amplitude.max()) - 1e-9) - 1, 0)
    classes: Integers = np.unique(-halvings, return_inverse=True)[1].astype(np.int64)
    return classes


def _range(line: StraightLine) -> str:
    return f"{quantity_text(line.intercept_low, 'N', 3)} to {quantity_text(line.intercept_high, 'N', 3)}"
