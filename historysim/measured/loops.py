"""`Loops`: the friction loops of a record, told in lines, tables and Datasets."""

import math
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.basics.display import html_table
from historysim.basics.units import quantity_text, scaled
from historysim.basics.wording import counted
from historysim.measured.instrument_faults import instrument_faults
from historysim.measured.loop_notes import loop_notes
from historysim.measured.loop_values import BRANCH_QUANTITIES, CONTENT, DIRECTIONS, LOOP_QUANTITIES, LoopValues
from historysim.measured.preliminary_readings import reversal_factor, zero_load_factor
from historysim.measured.range_pairs import range_pairs

if TYPE_CHECKING:
    import xarray as xr


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
        """Return lines of (label, text): remarks, dead band, range pairs, what means are, laws over the load, notes."""
        return [
            *self.remarks,
            ("dead band", self._dead_band_text()),
            ("range pairs", self._range_pairs_text()),
            ("values", self._values_text()),
            *self._preliminary_texts(),
            *(self.by_load().laws()),
            *(("note", text) for text in self.notes),
        ]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, and what the samples are too few to tell, with the mend."""
        return loop_notes(self)

    @property
    def faults(self) -> tuple[str, ...]:
        """What the record looks like, where something of the instrument changes what is read off; with the mend."""
        return tuple(instrument_faults(self))

    def _interval(self, quantity: str, unit: str) -> str:
        """Return the interval of a mean, as a text."""
        wander, mean = self.wander(quantity), self.statistics(quantity).mean
        if wander is None or wander.reach <= 1e-12 * abs(mean) or len(self.by_load()) > 1:
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
            drive = f", and what the load bends the instrument of {quantity_text(self.lateral_stiffness, 'N/m')} by"
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

    def _range_pairs_text(self) -> str:
        pairs = range_pairs(self.trace.displacement, dead_band=self.dead_band)
        closed = pairs.range[pairs.count == 1]
        largest = f", up to {quantity_text(float(closed.max()), 'm')}" if closed.size else ""
        return (
            f"{closed.size:,} closed{largest}; {counted(pairs.range.size - closed.size, 'half cycle', 'half cycles')}"
        )

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return the summary as a table of texts: quantity, forward, backward, both; the first row is the heading.

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
