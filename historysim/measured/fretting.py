"""Fretting report of friction loops: slip amplitude, energy friction coefficient, regime, and compliances.

Terms and criteria: S. Fouvry, P. Kapsa, L. Vincent, Wear 185 (1995) 35-46 and Wear 200 (1996)
186-205. README.md of this folder, "Fretting", has the formulas and the transition values.
"""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Self

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.wording import TERMINAL, columns, html_table
from historysim.measured.branches import read_aperture, split_compliance
from historysim.measured.correction import running_median
from historysim.measured.intervals import FEWEST_LOOPS, compute_mean_wander, student_factor
from historysim.measured.loop_table import (
    CONFIDENCE,
    LoopQuantity,
    LoopStatistics,
    LoopTable,
    interval_text,
)
from historysim.measured.loop_values import LoopValues

if TYPE_CHECKING:
    import xarray as xr

# The closed loop of Cattaneo and Mindlin at the transition: E = 4 δ* Q*/5, and aperture (2^(1/3) -
# 1) δ*.
TRANSITION_A = 0.2
TRANSITION_D = 2 ** (1 / 3) - 1
TRANSITION_B = TRANSITION_A / TRANSITION_D
STICK = 0.01  # energy ratio A below which a loop counts as closed; a sphere has it at T* = 0.16 μP
# samples of the running median that keeps noise out of the extremes of a measured load
MEDIAN_OF_LOAD = 5
REGIMES = ("stick", "partial slip", "gross slip")
GROSS_SLIP = REGIMES.index("gross slip")
UNKNOWN = -1  # regime of a loop without energy or without load
# value of the attribute ``content`` of a file of a fretting report
CONTENT_OF_FRETTING = "fretting report"

REGIME_ATTRIBUTES = {
    "long_name": "fretting regime",
    "flag_values": np.array([UNKNOWN, *range(len(REGIMES))], dtype=np.int8),
    "flag_meanings": " ".join(["unknown", *(name.replace(" ", "_") for name in REGIMES)]),
}


@attrs.frozen(eq=False)
class Cycles:
    """Primary values of loops (loop); NaN if a loop is incomplete or is not friction."""

    energy: Floats  #: E = ∮ T dU [J]
    load: Floats  #: load amplitude Q* [N]
    #: displacement amplitude δ* of the contact, without the stated instrument [m]
    displacement: Floats
    slip: Floats  #: half the aperture of the loop at the middle of the load [m]
    pressing: Floats  #: mean normal load P [N]
    total: Floats  #: compliance at reversal [m/N]
    contact: Floats  #: its part that follows Mindlin's curve [m/N]
    system: Floats  #: its part that is linear in the load [m/N]

    @classmethod
    def from_loops(cls, loops: LoopValues) -> Self:
        """Evaluate loops."""
        trace = loops.trace
        load = trace.tangential_load
        if loops.displacement_noise > 0 and load.size > MEDIAN_OF_LOAD:
            load = running_median(load, MEDIAN_OF_LOAD)
        apertures = np.array([read_aperture(trace, load, *ends) for ends in loops.ends.tolist()])
        complete = (
            np.isfinite(loops.dissipated_energy)
            & loops.is_friction
            & ~(loops.parallel_stiffness > 0)
        )
        amplitude, slip = np.where(complete, apertures.T, math.nan)
        compliances = np.full((len(loops), 2, 2), math.nan)
        for loop, (start, turn, end) in enumerate(loops.ends.tolist()):
            for start_sample, end_sample in ((start, turn), (turn, end)):
                side = int(trace.displacement[end_sample] < trace.displacement[start_sample])
                at_stop = loops.hooked_branches[loop, 1 - side]
                if complete[loop] and not (loops.rising_branches[loop, side] or at_stop):
                    force = float(loops.friction_force[loop, side])
                    compliances[loop, side] = split_compliance(
                        trace, start_sample, end_sample, force, loops.definitions.reached
                    )
        contact, system = compliances.mean(axis=1).T
        return cls(
            energy=np.where(complete, loops.dissipated_energy, math.nan),
            load=amplitude,
            displacement=loops.amplitude - amplitude / loops.lateral_stiffness,
            slip=slip,
            pressing=loops.normal_load.mean(axis=1),
            total=np.where(complete, (1 / loops.tangential_stiffness).mean(axis=1), math.nan),
            contact=contact,
            system=system,
        )


@attrs.frozen
class FrettingQuantity(LoopQuantity):
    """Declaration of a quantity of a fretting cycle, with its formula."""

    compute: Callable[[Cycles], Floats] = attrs.field(kw_only=True)


QUANTITIES = {
    "displacement_amplitude": FrettingQuantity(
        "displacement amplitude δ*",
        "m",
        "half the stroke of the contact",
        compute=lambda c: c.displacement,
    ),
    "load_amplitude": FrettingQuantity(
        "load amplitude Q*", "N", "half the range of T", compute=lambda c: c.load
    ),
    "slip_amplitude": FrettingQuantity(
        "slip amplitude δ_s",
        "m",
        "δ* less the displacement recovered from Q* to Q = 0",
        compute=lambda c: c.slip,
    ),
    "energy_friction_coefficient": FrettingQuantity(
        "energy friction coefficient μ_e",
        "1",
        "E/(4 δ* P)",
        compute=lambda c: c.energy / (4 * c.displacement * c.pressing),
    ),
    "slip_friction_coefficient": FrettingQuantity(
        "energy friction coefficient over slip",
        "1",
        "E/(4 δ_s P)",
        compute=lambda c: c.energy / (4 * c.slip * c.pressing),
    ),
    "sliding_ratio": FrettingQuantity(
        "sliding ratio D",
        "1",
        f"δ_s/δ*, {TRANSITION_D:.2f} at the transition",
        compute=lambda c: c.slip / c.displacement,
    ),
    "energy_ratio": FrettingQuantity(
        "energy ratio A",
        "1",
        f"E/(4 Q* δ*), {TRANSITION_A:.2f} at the transition",
        compute=lambda c: c.energy / (4 * c.load * c.displacement),
    ),
    "system_free_ratio": FrettingQuantity(
        "system-free energy ratio B",
        "1",
        f"E/(4 Q* δ_s), {TRANSITION_B:.2f} at the transition",
        compute=lambda c: c.energy / (4 * c.load * c.slip),
    ),
    "total_compliance": FrettingQuantity(
        "compliance at reversal", "m N-1", "contact and system in series", compute=lambda c: c.total
    ),
    "contact_compliance": FrettingQuantity(
        "contact compliance",
        "m N-1",
        "of the part of a branch that follows Mindlin's curve",
        compute=lambda c: c.contact,
    ),
    "system_compliance": FrettingQuantity(
        "system compliance",
        "m N-1",
        "of the part of a branch that is linear in T",
        compute=lambda c: c.system,
    ),
}


def _classify(values: Mapping[str, Floats]) -> Integers:
    """Return the fretting regime of each loop: its index in `REGIMES`, or -1."""
    a = values["energy_ratio"]
    b = values["system_free_ratio"]
    with np.errstate(invalid="ignore"):
        regimes = np.select([a < STICK, b > TRANSITION_B, b <= TRANSITION_B], [0, 2, 1], UNKNOWN)
    return regimes.astype(np.int64)


@attrs.frozen(eq=False, repr=False)
class Fretting:
    """Fretting quantities of loops, or of the runs of a record."""

    values: Mapping[str, Floats]  #: (cycle) of each of the `QUANTITIES`, in SI
    regime: Integers  #: (cycle) index in `REGIMES`, -1 if it is unknown
    number: Integers  #: (cycle) number of the loop, or of the run
    along: str = "loop"  #: "loop", or "run"
    large: Booleans | None = None  #: (cycle) whether a loop counts in means; all by default
    one_load: bool = True  #: whether all loops are at one normal load; else means have no interval

    @classmethod
    def from_loops(cls, loops: LoopValues) -> Self:
        """Evaluate loops one by one."""
        cycles = Cycles.from_loops(loops)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = {name: quantity.compute(cycles) for name, quantity in QUANTITIES.items()}
        one_load = np.unique(loops.load_level[loops.large]).size == 1
        # what is level before a stop slides; the ratios hold the load of the stop
        regime = np.where(loops.hooked_branches.any(axis=1), GROSS_SLIP, _classify(values))
        return cls(values, regime, loops.number, large=loops.large, one_load=one_load)

    @classmethod
    def from_runs(cls, runs: Mapping[int, LoopValues]) -> Self:
        """Evaluate runs, such as stored cycles of a fretting log, each by the means of its loops."""
        reports = [cls.from_loops(loops) for loops in runs.values()]
        values = {
            name: np.array([report.statistics(name).mean for report in reports])
            for name in QUANTITIES
        }
        hooked = np.array([loops.hooked_branches.any() for loops in runs.values()], dtype=np.bool_)
        regime = np.where(hooked, GROSS_SLIP, _classify(values))
        return cls(values, regime, np.array(list(runs), dtype=np.int64), "run")

    def __len__(self) -> int:
        """Return the number of loops, or runs."""
        return self.number.size

    def __repr__(self) -> str:
        return columns(self.rows(), TERMINAL)

    def _repr_html_(self) -> str:
        heading, *rows = self.rows()
        return html_table(rows, heading)

    def _mean_values(self, quantity: str) -> Floats:
        values = self.values[quantity]
        return values if self.large is None else values[self.large]

    def statistics(self, quantity: str) -> LoopStatistics:
        """Return mean and scatter of a quantity over the large loops, or over the runs."""
        return LoopStatistics.from_values(self._mean_values(quantity))

    def interval(self, quantity: str) -> tuple[float, float] | None:
        """Return the 95 % confidence interval of a mean; None for fewer than three cycles, or several loads.

        Loops may be correlated, and drift; runs, which need not follow one another, count as
        independent.
        """
        values = self._mean_values(quantity)
        values = values[np.isfinite(values)]
        if values.size < FEWEST_LOOPS or not self.one_load:
            return None
        if self.along == "loop":
            wander = compute_mean_wander(values, CONFIDENCE)
            reach = math.nan if wander is None else wander.reach
        else:
            error = float(values.std(ddof=1)) / math.sqrt(values.size)
            reach = student_factor(values.size - 1, CONFIDENCE) * error
        return float(values.mean()) - reach, float(values.mean()) + reach

    def text(self, quantity: str) -> str:
        """Return mean ± standard deviation of a cycle, with the interval of the mean."""
        unit = QUANTITIES[quantity].unit
        interval = self.interval(quantity)
        statistics = self.statistics(quantity)
        text = statistics.text(unit, self._mean_values(quantity).size)
        return text if interval is None else text + interval_text(statistics.mean, *interval, unit)

    def regime_text(self) -> str:
        """Return the fretting regime, or how many cycles are in each."""
        regime = self.regime if self.large is None else self.regime[self.large]
        counts = {name: int((regime == number).sum()) for number, name in enumerate(REGIMES)}
        occupied = {name: count for name, count in counts.items() if count}
        if not occupied:
            return "–"
        text = ", ".join(
            f"{name} in {count:,} of {regime.size:,}" for name, count in occupied.items()
        )
        interval = self.interval("system_free_ratio")
        if len(occupied) == 1:
            (text,) = occupied
            if interval is not None and interval[0] < TRANSITION_B < interval[1]:
                text += "; the interval of B includes the transition"
        return text

    def rows(self) -> list[tuple[str, ...]]:
        """Return the report as a table of strings; the first row is the heading."""
        regime = (
            f"gross slip for B > {TRANSITION_B:.2f}, stick for A < {STICK:g}, else partial slip"
        )
        return [
            ("fretting", "mean", "definition"),
            ("fretting regime", self.regime_text(), regime),
            *(
                (description.label, self.text(name), description.definition)
                for name, description in QUANTITIES.items()
            ),
        ]

    def to_dataset(self) -> "xr.Dataset":
        """Return all quantities as a Dataset with the dimension loop, or run."""
        import xarray as xr

        variables = {
            name: (self.along, self.values[name], quantity.attributes)
            for name, quantity in QUANTITIES.items()
        }
        intervals = {name: self.interval(name) for name in QUANTITIES}
        return xr.Dataset(
            variables,
            coords={
                self.along: (self.along, self.number, {"long_name": f"{self.along} of the record"}),
                "regime": (self.along, self.regime.astype(np.int8), REGIME_ATTRIBUTES),
            },
            attrs={
                "title": "fretting report",
                "content": CONTENT_OF_FRETTING,
                "fretting_regime": self.regime_text(),
                **{
                    f"{name}_interval": list(ends)
                    for name, ends in intervals.items()
                    if ends is not None
                },
            },
        )


def by_load(loops: LoopValues) -> LoopTable:
    """Return statistics of the fretting quantities of large loops, a row for each normal load."""
    values = Fretting.from_loops(loops).values
    return attrs.evolve(loops.by_load(), quantities=QUANTITIES, values=values)


def run_rows(runs: Mapping[int, LoopValues]) -> list[tuple[str, ...]]:
    """Return a table with a row for each run and one for their mean; the first row is the heading."""
    table: list[tuple[str, ...]] = [
        ("run", "loops", "regime", *(description.label for description in QUANTITIES.values()))
    ]
    rows = {
        str(number): (f"{len(loops):,}", Fretting.from_loops(loops))
        for number, loops in runs.items()
    }
    for name, (count, report) in {**rows, "mean": ("", Fretting.from_runs(runs))}.items():
        table.append(
            (name, count, report.regime_text(), *(report.text(quantity) for quantity in QUANTITIES))
        )
    return table
