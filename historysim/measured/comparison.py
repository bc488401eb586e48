"""Comparison of a model with a measurement: loops of both, differences, and findings."""

import functools
import itertools
import math
from collections.abc import Callable, Iterator

import attrs
import numpy as np

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import Floats
from historysim.basics.units import quantity_text
from historysim.basics.wording import html_table
from historysim.measured.loop_values import MEAN_QUANTITIES, NoLoopError
from historysim.measured.loops import Loops, loops_of_channels
from historysim.measured.observation import Observation
from historysim.measured.residual_diagnosis import (
    FEWEST_OF_BRANCH,
    BranchSamples,
    diagnose_residuals,
)
from historysim.measured.residuals import Residuals, compute_residuals
from historysim.measured.response import ModelResponse

# range of the normal load on a branch, over its largest value there, up to which the load is
# constant
ONE_LOAD = 0.1
# A compliance in series is reported if the measured stiffness at reversals is below this fraction
# of the model's, by this number of standard errors.
SOFTER, CLEARLY = 0.5, 3.0
# Rms difference with it, over that without, up to which it is advised; and the range of it that is
# searched.
MOST_LEFT, SERIES_RANGE = 0.5, 10.0


@attrs.frozen(eq=False)
class Comparison:
    """Comparison of a model with a measurement."""

    observation: Observation  #: the measurement
    response: ModelResponse  #: response of the model along the measurement
    instrument: Instrument = RIGID  #: instrument in series with the contact
    #: (sample) Displacement of the drive of the model with the measured tangential load [m], if the
    #: load is replayed.
    model_displacement: Floats | None = None
    #: response of the contact behind another instrument
    respond: Callable[[Instrument], ModelResponse] | None = None
    model: Loops | None = attrs.field(init=False)  #: loops of the model, None without a whole one

    @model.default
    def _model(self) -> Loops | None:
        observation = self.observation
        try:
            return loops_of_channels(
                observation.time,
                self.response.displacement,
                self.response.contact_load,
                observation.normal_load,
                dead_band=observation.dead_band,
                skip=observation.skip,
            )
        except NoLoopError:
            # without a whole loop the samples can still be compared
            return None

    def __repr__(self) -> str:
        return f"<Comparison: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    def _repr_html_(self) -> str:
        table = self.rows()
        return html_table(self.summary()) + (html_table(table[1:], table[0]) if table else "")

    @property
    def measured(self) -> Loops | None:
        """The measured loops, None without a whole one."""
        return self.observation.loops

    @property
    def difference(self) -> Floats:
        """Measured less model tangential load (sample) [N], from the first sample compared."""
        residual: Floats = self.observation.tangential_load - self.response.tangential_load
        return residual[self.observation.start_sample :]

    @property
    def displacement_difference(self) -> Floats | None:
        """Measured less model displacement (sample) [m], from the first sample compared; None unless T is replayed."""
        if self.model_displacement is None:
            return None
        residual: Floats = self.observation.displacement - self.model_displacement
        return residual[self.observation.start_sample :]

    def _rms_lines(self) -> list[tuple[str, str]]:
        """Return lines on the rms difference: of the displacement if the load is replayed, and of the load."""
        residuals = self.residuals
        moved = self.displacement_difference
        share = f"{100 * residuals.rms / residuals.largest:.3g} % of the largest tangential load"
        text = f"{quantity_text(residuals.rms, 'N')}, {share}"
        if moved is None:
            return [("rms difference", text)]
        rms = float(np.sqrt(np.mean(moved**2)))
        stroke = (
            float(np.ptp(self.observation.displacement[self.observation.start_sample :])) or 1.0
        )
        of_displacement = f"{quantity_text(rms, 'm')}, {100 * rms / stroke:.3g} % of the range of the displacement"
        return [("rms difference", of_displacement), ("of the load, displacement replayed", text)]

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text) on the difference of model and measurement."""
        loads = [] if self.measured is None else self.measured.by_load().value.tolist()
        lines = [
            *self.observation.remarks,
            ("samples compared", f"{self.difference.size:,}"),
            ("dead band", quantity_text(self.observation.dead_band, "m")),
            ("loops", "none" if self.measured is None else f"{len(self.measured):,}"),
        ]
        if len(loads) > 1:
            load_list = ", ".join(quantity_text(load, "N", 3) for load in loads)
            over = "means below are over all loads; historysim loops has means at each load"
            lines.append(("normal loads", f"{load_list}; {over}"))
        return [*lines, *self._rms_lines(), *(("note", text) for text in self.notes)]

    @property
    def residuals(self) -> Residuals:
        """Residuals of the model, and their distribution."""
        return compute_residuals(self.observation, self.response)

    @functools.cached_property
    def notes(self) -> tuple[str, ...]:
        """Findings of the comparison: faults, drift, a compliance in series, or the form of the residuals."""
        findings = (*(self.measured.faults if self.measured else ()), *self._compliance())
        # these change the load along a branch, so they are corrected first
        if any(word in note for note in findings for word in ("look", "drift", "rises again")):
            return findings
        return (
            *findings,
            *diagnose_residuals(
                list(self._branches()), float(np.median(self.observation.node_deviation))
            ),
        )

    def _branches(self) -> Iterator[BranchSamples]:
        """Yield the whole branches at one load that are compared, except the first and the last."""
        observation = self.observation
        response = self.response
        channels = (
            observation.time,
            response.displacement,
            observation.tangential_load,
            response.tangential_load,
            response.slope,
        )
        for start, stop in itertools.pairwise(observation.turns[1:-1].tolist()):
            normal = observation.normal_load[start : stop + 1]
            if (
                start >= observation.start_sample
                and stop - start >= FEWEST_OF_BRANCH
                and np.ptp(normal) <= ONE_LOAD * normal.max()
            ):
                yield BranchSamples.from_channels(
                    *(values[start : stop + 1] for values in channels)
                )

    def _compliance(self) -> list[str]:
        """Return a note on a record that is much softer than the model."""
        if self.measured is None or self.model is None or not self.measured.is_friction.all():
            return []
        # both by the same method: few samples on a steep branch make both look soft
        of_measured, of_model = (
            loops.statistics("tangential_stiffness") for loops in (self.measured, self.model)
        )
        measured_stiffness = of_measured.mean
        model_stiffness = of_model.mean
        scatter = of_measured.standard_deviation if of_measured.count > 1 else 0.0
        error = CLEARLY * scatter / math.sqrt(of_measured.count or 1)
        if not 0 < measured_stiffness + error < SOFTER * model_stiffness:
            return []
        softer = (
            f"the record is softer at reversals than the model, {quantity_text(measured_stiffness, 'N/m', 3)} against "
            f"{quantity_text(model_stiffness, 'N/m', 3)}"
        )
        stiffness = 1 / (
            1 / measured_stiffness - 1 / model_stiffness + 1 / self.instrument.stiffness
        )
        if self.respond is not None:
            stiffness, left = self._best_in_series(stiffness)
            before = self.residuals.rms
            if left > MOST_LEFT * before:
                before_text, left_text = (quantity_text(rms, "N", 3) for rms in (before, left))
                note = (
                    f"{softer}: a compliance in series alone does not explain it, as the rms difference of "
                    f"{before_text} stays above {left_text} with any; friction, surface or materials differ as well"
                )
                return [note]
        series = quantity_text(stiffness, "N/m", 3)
        start = (
            f', with [instrument] lateral_stiffness = "{series}" to start from'
            if self.instrument.rigid
            else ""
        )
        return [
            f"{softer}: looks like a compliance in series of {series}; fit lateral_stiffness{start}"
        ]

    def _best_in_series(self, start: float) -> tuple[float, float]:
        """Return the stiffness in series that leaves the least rms difference [N/m], and that difference [N]."""
        from scipy.optimize import minimize_scalar

        assert self.respond is not None  # noqa: S101 - its caller has looked
        respond = self.respond
        observation = self.observation

        def difference(logarithm: float) -> float:
            instrument = attrs.evolve(self.instrument, lateral_stiffness=math.exp(logarithm))
            return compute_residuals(observation, respond(instrument)).rms

        bounds = [math.log(start * factor) for factor in (1 / SERIES_RANGE, SERIES_RANGE)]
        best = minimize_scalar(difference, bounds=bounds, options={"xatol": 0.02, "maxiter": 16})
        return math.exp(float(best.x)), float(best.fun)

    def rows(self) -> list[tuple[str, str, str]]:
        """Return a table of strings: quantity, measured, model; means over the loops ± their standard deviations."""
        if self.measured is None or self.model is None:
            return []
        table = [("quantity", "measured", "model")]
        for name, quantity in MEAN_QUANTITIES.items():
            # other definitions of the preliminary displacement
            if name not in {"displacement_from_zero_load", "virgin_displacement"}:
                table.append((quantity.label, self.measured.text(name), self.model.text(name)))
        return table
