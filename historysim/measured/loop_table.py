"""Groups of loops at one normal load or of one amplitude: statistics, and laws over the load."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, Self

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import choose_unit, quantity_text
from historysim.basics.wording import columns, count_text, html_table
from historysim.measured.intervals import student_factor

if TYPE_CHECKING:
    import xarray as xr

Along = Literal["normal_load", "amplitude"]

CONFIDENCE = 0.95  # of all intervals of fitted numbers
ONE_AMPLITUDE = 0.05  # difference over the greater of two amplitudes up to which they are one
BOTH = "both"
UNITS = {"normal_load": "N", "amplitude": "m"}
DIMENSIONS = {"normal_load": "level", "amplitude": "amplitude_class"}
HEADINGS = {"normal_load": "normal load", "amplitude": "amplitude"}
# the quantities that go with a power of the load, with the label and the words of their lines
_POWERS = {
    "friction_coefficient": ("", "coefficient"),
    "preliminary_displacement": ("displacement over load", "preliminary displacement"),
    "virgin_displacement": ("", "virgin displacement"),
}
# value of the attribute ``content`` of a file of such a table
CONTENT_OF_TABLE = "statistics of friction loops"


@attrs.frozen
class LoopStatistics:
    """Mean and scatter of one quantity over the loops."""

    mean: float  #: NaN where no loop has a value
    #: of one loop, with count - 1 in the denominator; NaN for fewer than two
    standard_deviation: float
    count: int  #: the loops that have a value

    @classmethod
    def from_values(cls, values: Floats) -> Self:
        """Compute the statistics of values (loop), or of the means of values (loop, direction)."""
        values = values.reshape(len(values), -1).mean(axis=1)
        values = values[np.isfinite(values)]
        return cls(
            mean=float(values.mean()) if values.size else math.nan,
            standard_deviation=float(values.std(ddof=1)) if values.size > 1 else math.nan,
            count=values.size,
        )

    def text(self, unit: str, loops: int) -> str:
        """Return mean ± standard deviation as a string, and of how many loops where that is not all of them."""
        if self.count == 0:
            return "–"
        factor, symbol = choose_unit(self.mean, unit)
        # a scatter at the level of rounding is none
        spread = (
            self.standard_deviation if self.standard_deviation > 1e-12 * abs(self.mean) else 0.0
        )
        scatter = f" ± {spread * factor:.2g}" if self.count > 1 else ""
        some = f" (of {self.count})" if self.count < loops else ""
        return f"{self.mean * factor:.4g}{scatter}{symbol}{some}"


def mean_or_bound_text(
    sliding: LoopStatistics, every: LoopStatistics, quantity: "LoopQuantity", loops: int
) -> str:
    """Return the mean over branches that slid as a string, or where none did the lower bound by all branches."""
    if sliding.count or not quantity.needs_slip:
        return sliding.text(quantity.unit, loops)
    text = every.text(quantity.unit, loops)
    return f"≥ {text}" if every.count else text


def interval_text(mean: float, low: float, high: float, unit: str) -> str:
    """Return the 95 % confidence interval of a mean as a string in parentheses; empty if it is rounding."""
    if not high - low > 2e-12 * abs(mean):
        return ""
    factor, symbol = choose_unit(mean, unit)
    return f" (95 %: {factor * low:.4g} to {factor * high:.4g}{symbol})"


# -- laws over the load ----------------------------------------------------------------------------


@attrs.frozen
class StraightLine:
    """y = slope x + intercept by least squares; intervals of 95 % by scatter and Student's t, NaN for two points."""

    slope: float
    slope_low: float
    slope_high: float
    intercept: float
    intercept_low: float
    intercept_high: float
    count: int  #: the points that it was fitted to


@attrs.frozen
class PowerLawFit:
    """A quantity that is factor x^exponent of a load or an amplitude, with an interval of 95 %; NaN for two points."""

    #: Of the friction coefficient -1/3 for a smooth ball with a constant interfacial shear
    #: strength, 0 for a rough surface; of the preliminary displacement 2/3 for a ball with a
    #: constant friction coefficient [1].
    exponent: float
    exponent_low: float
    exponent_high: float
    factor: float  #: the quantity at 1 N, or at 1 m, in its own unit


def straight_line(x: Floats, y: Floats) -> StraightLine:
    """Return the line through points (point), two or more, of which not all have one x."""
    from scipy import stats

    line = stats.linregress(x, y)
    reach = [math.nan, math.nan]
    if x.size > 2:
        # scipy has no standard errors for the same y throughout, where nothing scatters
        errors = [
            0.0 if math.isnan(error) else float(error)
            for error in (line.stderr, line.intercept_stderr)
        ]
        reach = [student_factor(x.size - 2, CONFIDENCE) * error for error in errors]
    slope = float(line.slope)
    intercept = float(line.intercept)
    return StraightLine(
        slope,
        slope - reach[0],
        slope + reach[0],
        intercept,
        intercept - reach[1],
        intercept + reach[1],
        int(x.size),
    )


def power_law(x: Floats, values: Floats) -> PowerLawFit:
    """Return the power law through positive values (point) at two or more positive x, of which not all are equal."""
    # a line of logarithms weighs all points alike
    line = straight_line(np.log(x), np.log(values))
    return PowerLawFit(line.slope, line.slope_low, line.slope_high, math.exp(line.intercept))


# -- the table -------------------------------------------------------------------------------------


@attrs.frozen
class LoopQuantity:
    """Declaration of a quantity of loops, from which texts, rows of tables and variables follow."""

    label: str
    unit: str  #: SI
    definition: str = ""
    needs_slip: bool = False  #: whether it is a lower bound where a branch does not come to slide
    #: whether it is read off the beginning of a branch, and not off sliding
    needs_reversal: bool = False
    is_gap: bool = False  #: whether it shows that a loop does not close, and has no mean

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of its variable in a Dataset."""
        attributes = {"long_name": self.label, "units": self.unit}
        return attributes | ({"comment": self.definition} if self.definition else {})


@attrs.frozen(eq=False)
class LoopTable:
    """Statistics of loops in groups."""

    along: Along  #: what the loops of a group have in common
    value: Floats  #: (group) Its mean over the loops of each group, ascending [N or m]
    members: tuple[Integers, ...]  #: (group) Which of the loops, by position, are in each group
    quantities: Mapping[str, LoopQuantity]
    values: Mapping[str, Floats]  #: (loop) or (loop, direction) of each quantity; NaN without one
    directions: tuple[str, ...]  #: the names of the directions of branches
    #: how the loops were found, for files
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
        """Return mean and scatter of a quantity in each group; "both" is the mean of the two branches of each loop."""
        values = self.values[quantity]
        if direction != BOTH and values.ndim == 2:
            values = values[:, self.directions.index(direction)]
        return tuple(LoopStatistics.from_values(values[members]) for members in self.members)

    def _by_direction(self, quantity: str) -> list[tuple[LoopStatistics, ...]]:
        of_branch = self.values[quantity].ndim == 2
        directions = (*self.directions, BOTH) if of_branch else (BOTH,)
        return [self.statistics(quantity, direction) for direction in directions]

    def means(self, quantity: str) -> Floats:
        """Return the mean of a quantity in each group (group), of single branches if no loop has both."""
        means = np.array([statistics.mean for statistics in self.statistics(quantity)])
        for group in np.flatnonzero(np.isnan(means)):
            values = self.values[quantity][self.members[group]]
            finite = values[np.isfinite(values)]
            means[group] = finite.mean() if finite.size else np.nan
        return means

    def friction_line(self) -> StraightLine | None:
        """Return F = μ N + F0 through the means at the loads; None for fewer than two loads."""
        load, force = self._positive_means("friction_force")
        return straight_line(load, force) if load.size > 1 else None

    def power_law(self, quantity: str) -> PowerLawFit | None:
        """Return quantity ∝ N^n through its positive means at the loads; None for fewer than two loads."""
        load, values = self._positive_means(quantity)
        return power_law(load, values) if load.size > 1 else None

    def _positive_means(self, quantity: str) -> tuple[Floats, Floats]:
        means = self.means(quantity)
        positive = (means > 0) & (self.value > 0) & (self.along == "normal_load")
        return self.value[positive], means[positive]

    def laws(self) -> list[tuple[str, str]]:
        """Return lines of (label, text) on friction and displacement as functions of the load."""
        line = self.friction_line()
        if line is None:
            return []
        low, high = (
            quantity_text(bound, "N", 3) for bound in (line.intercept_low, line.intercept_high)
        )
        interval = (
            f" (95 %: {line.slope_low:.4g} to {line.slope_high:.4g}; {low} to {high})"
            if line.count > 2
            else ""
        )
        offset = (
            f"{'-' if line.intercept < 0 else '+'} {quantity_text(abs(line.intercept), 'N', 3)}"
        )
        over = count_text(line.count, "load", "loads") + (
            "" if interval else ", which give no interval"
        )
        lines = [
            (
                "friction over load",
                f"F = {line.slope:.4g} × load {offset}{interval}, through the means at {over}",
            )
        ]
        for quantity, (label, text) in _POWERS.items():
            law = self.power_law(quantity)
            if law is not None:
                interval = (
                    f" (95 %: {law.exponent_low:+.3f} to {law.exponent_high:+.3f})"
                    if line.count > 2
                    else ""
                )
                lines.append(
                    (label, f"{text} varies as the power {law.exponent:+.3f} of N{interval}")
                )
        return lines

    def rows(self) -> list[tuple[str, ...]]:
        """Return the table as strings: for each quantity its name, and below it a row for each group.

        Values are mean ± standard deviation of one loop; where not all loops of the group have a
        value, how many.
        """
        table = [(HEADINGS[self.along], "loops", *self.directions, BOTH)]
        for name, description in self.quantities.items():
            if name == self.along:
                continue
            table.append((description.label, "", *("" for _ in self.directions), ""))
            by_direction = self._by_direction(name)
            for group, (value, members) in enumerate(zip(self.value, self.members, strict=True)):
                texts = [
                    statistics[group].text(description.unit, members.size)
                    for statistics in by_direction
                ]
                blank = [""] * (len(self.directions) + 1 - len(texts))
                head = f"  {quantity_text(float(value), UNITS[self.along])}", f"{members.size:,}"
                table.append((*head, *blank, *texts))
        return table

    def to_dataset(self) -> "xr.Dataset":
        """Return all statistics as a Dataset with the dimensions level, or amplitude_class, and direction.

        Each quantity has its mean under its own name, ``…_standard_deviation`` of one loop, and
        ``…_count``. The laws over the load stand in the attributes.
        """
        import xarray as xr

        dimension = DIMENSIONS[self.along]
        heading = HEADINGS[self.along]
        laws = {
            "friction_line": self.friction_line(),
            **{name: self.power_law(name) for name in _POWERS},
        }
        variables = {}
        for name, quantity in self.quantities.items():
            by_direction = self._by_direction(name)
            dims = (dimension, "direction") if len(by_direction) > 1 else (dimension,)
            for field in attrs.fields_dict(LoopStatistics):
                suffix = "" if field == "mean" else f"_{field}"
                values = [
                    [getattr(statistics, field) for statistics in groups] for groups in by_direction
                ]
                attributes = {
                    "long_name": f"{quantity.label}{suffix.replace('_', ' ')}",
                    "units": "1" if field == "count" else quantity.unit,
                }
                column = np.array(values).T if len(dims) == 2 else np.array(values[0])
                variables[f"{name}{suffix}"] = dims, column, attributes
        return xr.Dataset(
            variables,
            coords={
                dimension: (
                    dimension,
                    self.value,
                    {"long_name": heading, "units": UNITS[self.along]},
                ),
                "loops": (
                    dimension,
                    [members.size for members in self.members],
                    {"long_name": "number of loops"},
                ),
                "direction": ("direction", [*self.directions, BOTH]),
            },
            attrs={
                "title": f"friction loops by {heading}",
                "content": CONTENT_OF_TABLE,
                **self.attributes,
                **{
                    f"{name}_{field}": value
                    for name, law in laws.items()
                    if law is not None
                    for field, value in attrs.asdict(law).items()
                },
            },
        )


def energy_law(amplitude: Floats, energy: Floats) -> tuple[PowerLawFit, int] | None:
    """Return the power law of energy [J] over amplitude [m] of loops, and its number of amplitudes.

    It is fitted to the means of loops of one amplitude. None for fewer than three amplitudes over a
    factor of two.
    """
    positive = (energy > 0) & (amplitude > 0)
    amplitude = amplitude[positive]
    energy = energy[positive]
    group = same_load(amplitude, ONE_AMPLITUDE)
    if group.size == 0 or group.max() < 2 or amplitude.max() < 2 * amplitude.min():
        return None
    means = [
        np.array([values[group == number].mean() for number in range(group.max() + 1)])
        for values in (amplitude, energy)
    ]
    return power_law(*means), int(group.max()) + 1


def same_load(normal_load: Floats, share: float) -> Integers:
    """Return which load each loop is at (loop): a number that rises with the load, and -1 where it is not known.

    From the least load on, loads that exceed the least one of their group by no more than the share
    are one.
    """
    group = np.full(normal_load.size, -1)
    finite = np.flatnonzero(np.isfinite(normal_load))
    number, lowest = -1, -np.inf
    for loop in finite[np.argsort(normal_load[finite], kind="stable")]:
        if number < 0 or normal_load[loop] - lowest > share * abs(normal_load[loop]):
            number = number + 1
            lowest = normal_load[loop]
        group[loop] = number
    return group


def same_amplitude(amplitude: Floats) -> Integers:
    """Return which class of amplitudes each loop is in (loop): each spans a factor of two, its ends included.

    Numbers rise with the amplitude and leave none out.
    """
    halvings = np.maximum(np.ceil(-np.log2(amplitude / amplitude.max()) - 1e-9) - 1, 0)
    classes: Integers = np.unique(-halvings, return_inverse=True)[1].astype(np.int64)
    return classes
