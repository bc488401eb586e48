"""A model beside a measurement: the same displacements, both loads, and what their loops say."""

import math

import attrs
import numpy as np

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.array_types import Floats
from historysim.basics.display import html_table
from historysim.basics.units import quantity_text
from historysim.measured.loop_values import BRANCH_QUANTITIES, LOOP_QUANTITIES, NoLoopError
from historysim.measured.loops import Loops
from historysim.measured.misfit import Residuals, what_is_left
from historysim.measured.observation import ModelResponse, Observation
from historysim.measured.splitting import loops_of_channels

SOFTER = 0.5
"""Stiffness at reversals over that of the model below which a compliance in series is told."""


@attrs.frozen(eq=False)
class Comparison:
    """A model beside a measurement.

    Attributes
    ----------
    observation : Observation
        What was measured.
    response : ModelResponse
        What the model does along it.
    model : Loops or None
        Loops of the model, None where it has no whole one.
    instrument : Instrument
        What the displacement was measured by.
    contact_stiffness : float
        Of the contact of the model where all of it sticks, at the greatest normal load [N/m]; NaN where it is not
        known.
    """

    observation: Observation
    response: ModelResponse
    model: Loops | None
    instrument: Instrument = RIGID
    contact_stiffness: float = math.nan

    @classmethod
    def of(
        cls,
        observation: Observation,
        response: ModelResponse,
        instrument: Instrument = RIGID,
        contact_stiffness: float = math.nan,
    ) -> "Comparison":
        """Return a model beside a measurement.

        Parameters
        ----------
        observation : Observation
        response : ModelResponse
            From `observation.passed`.
        instrument : Instrument
            What the displacement was measured by.
        contact_stiffness : float
            Of the contact where all of it sticks, at the greatest normal load [N/m].
        """
        try:
            model = loops_of_channels(
                observation.time,
                response.displacement,
                response.tangential_load,
                observation.normal_load,
                dead_band=observation.dead_band,
                skip=observation.skip,
            )
        except NoLoopError:
            # without a whole loop the samples can still be compared
            model = None
        return cls(observation, response, model, instrument, contact_stiffness)

    def __repr__(self) -> str:
        return f"<Comparison: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    def _repr_html_(self) -> str:
        table = self.rows()
        return html_table(self.summary()) + (html_table(table[1:], table[0]) if table else "")

    @property
    def measured(self) -> Loops | None:
        """The measured loops, None where there is no whole one."""
        return self.observation.loops

    @property
    def difference(self) -> Floats:
        """Measured less model tangential load (sample) [N], from the first sample that is compared on."""
        off: Floats = self.observation.tangential_load - self.response.tangential_load
        return off[self.observation.first :]

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text) that say how far the two are apart."""
        off = self.difference
        largest = float(np.abs(self.observation.tangential_load[self.observation.first :]).max(initial=0.0))
        rms = float(np.sqrt(np.mean(off**2)))
        share = f", {100 * rms / largest:.3g} % of the largest tangential load" if largest > 0 else ""
        return [
            *self.observation.remarks,
            ("samples compared", f"{off.size:,}"),
            ("dead band", quantity_text(self.observation.dead_band, "m")),
            ("loops", "none" if self.measured is None else f"{len(self.measured):,}"),
            *self._loads(),
            ("rms difference", f"{quantity_text(rms, 'N')}{share}"),
            *(("note", text) for text in self.notes),
        ]

    @property
    def left(self) -> Residuals:
        """What the model leaves, and where."""
        return what_is_left(self.observation, self.response)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the record looks like, beside the model: faults of the instrument, and a compliance in series."""
        return (*(self.measured.faults if self.measured else ()), *self._compliance())

    def _compliance(self) -> list[str]:
        """Tell a record that is much softer than the model."""
        if self.measured is None or not self.contact_stiffness > 0:
            return []
        measured, in_series = self.measured.statistics("tangential_stiffness").mean, self.instrument.lateral_stiffness
        whole = self.contact_stiffness if self.instrument.rigid else 1 / (1 / self.contact_stiffness + 1 / in_series)
        if not 0 < measured < SOFTER * whole:
            return []
        series = quantity_text(1 / (1 / measured - 1 / self.contact_stiffness), "N/m", 3)
        mend = "fit lateral_stiffness" + (
            f', with [instrument] lateral_stiffness = "{series}" to start from' if self.instrument.rigid else ""
        )
        note = (
            f"the record is softer at reversals than the model, {quantity_text(measured, 'N/m', 3)} against "
            f"{quantity_text(whole, 'N/m', 3)}: looks like a compliance in series of {series}; {mend}"
        )
        return [note]

    def _loads(self) -> list[tuple[str, str]]:
        """Return a line on the normal loads, where there are several."""
        loads = [] if self.measured is None else self.measured.by_load().value.tolist()
        if len(loads) < 2:
            return []
        each = ", ".join(quantity_text(load, "N", 3) for load in loads)
        meant = "means and deviations below are over all of them; historysim loops tells them apart"
        return [("normal loads", f"{each}; {meant}")]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return a table of texts: quantity, measured, model; means over the loops ± their standard deviations."""
        if self.measured is None or self.model is None:
            return []
        table = [("quantity", "measured", "model")]
        for name, (label, unit) in {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}.items():
            # what is left out here is the displacement read in another way
            if not name.endswith("_gap") and name not in {"displacement_from_zero_load", "virgin_displacement"}:
                table.append((label, self.measured.text(name, unit), self.model.text(name, unit)))
        return table
