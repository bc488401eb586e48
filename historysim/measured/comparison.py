"""A model beside a measurement: the same displacements, both loads, and what their loops say."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.measured.loops import BRANCH_QUANTITIES, LOOP_QUANTITIES, Loops, find_loops
from historysim.measured.observation import Observation, Passage

Floats = npt.NDArray[np.float64]


@attrs.frozen(eq=False)
class Comparison:
    """A model beside a measurement.

    Attributes
    ----------
    observation : Observation
        What was measured.
    passage : Passage
        What the model does along it.
    measured, model : Loops or None
        Loops of both, None where the record has none.
    instrument : Instrument
        What the displacement was measured by.
    """

    observation: Observation
    passage: Passage
    measured: Loops | None
    model: Loops | None
    instrument: Instrument = RIGID

    @property
    def difference(self) -> Floats:
        """Measured less model tangential load (sample) [N], from the first sample that is compared on."""
        off: Floats = self.observation.tangential_load - self.passage.tangential_load
        return off[self.observation.first :]

    def summary(self) -> list[tuple[str, str]]:
        """Say in a few lines how far the two are apart."""
        off = self.difference
        largest = float(np.abs(self.observation.tangential_load[self.observation.first :]).max(initial=0.0))
        rms = float(np.sqrt(np.mean(off**2)))
        share = f", {100 * rms / largest:.3g} % of the largest tangential load" if largest > 0 else ""
        return [
            ("samples compared", f"{off.size:,}"),
            ("loops", "none" if self.measured is None else f"{len(self.measured):,}"),
            ("rms difference", f"{quantity_text(rms, 'N')}{share}"),
        ]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return a table of texts: quantity, measured, model; means over the loops ± their standard deviations."""
        if self.measured is None or self.model is None:
            return []
        table = [("quantity", "measured", "model")]
        for name, (label, unit) in {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}.items():
            if not name.endswith("_gap"):
                table.append((label, self.measured.text(name, unit), self.model.text(name, unit)))
        return table


def compare(
    observation: Observation,
    passage: Passage,
    *,
    dead_band: float = 0.0,
    skip: int = 0,
    instrument: Instrument = RIGID,
) -> Comparison:
    """Set a model beside a measurement.

    Parameters
    ----------
    observation : Observation
    passage : Passage
        From `observation.passed`.
    dead_band : float
        The smallest swing of the displacement that counts as a reversal [m].
    skip : int
        Loops at the start that are left out.
    instrument : Instrument
        What the displacement was measured by.
    """
    found: list[Loops | None] = []
    for moved, load in (
        (observation.displacement, observation.tangential_load),
        (passage.displacement, passage.tangential_load),
    ):
        try:
            found.append(
                find_loops(observation.time, moved, load, observation.normal_load, dead_band=dead_band, skip=skip)
            )
        except InputError:
            # a record need not have a whole loop to be compared
            found.append(None)
    return Comparison(observation, passage, found[0], found[1], instrument)
