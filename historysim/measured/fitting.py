"""Fit of model parameters to measured loops by nonlinear least squares, with confidence intervals.

README.md of this folder, "Fit", defines the objective and the two intervals of each estimate.
"""

import math
import warnings
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.units import UNIT_OF, quantity_text
from historysim.basics.wording import count_text
from historysim.errors import UnlikelyValueWarning
from historysim.measured import intervals
from historysim.measured.intervals import student_factor
from historysim.measured.loop_table import CONFIDENCE
from historysim.measured.observation import Observation
from historysim.measured.residuals import compute_residuals
from historysim.measured.response import ModelResponse
from historysim.measured.search import FARTHEST, FARTHEST_NODE, OFFSET, Model, Search, SearchResult

MOST_CORRELATED = 0.99  # correlation of two parameters above which the data do not distinguish them
UNDETERMINED = 1e6  # ratio of the ends of an interval above which the parameter is not determined
MUCH_WORSE = 3.0  # misfit over noise above which noise does not explain the residuals
SURE_OF_NOISE = 5.0  # standard deviations of the noise of the load beyond which a load is not noise
LEAST_NOISE = 0.9  # least fraction of the estimated noise that is used, however small the residuals
# Contribution of scatter from branch to branch to the half width of an interval, over the square of
# its fraction of the load: a single coefficient for all branches is off by some 1.1 to 1.5 of these
# squares (tests/README.md).
SECOND_ORDER = 1.8
NOISE_REPEATS = 16  # times that noise is added to a record of few loops
# Distance of the first load from the middle of the loops, over half their height, up to which a
# record begins unloaded; and of the middle of the strokes from zero, over half the stroke, up to
# which they are centred.
AT_REST, CENTRED = 0.1, 0.05
_MEANING = (
    ". The intervals say by how much the values of another such record would differ. They do not say how far the "
    "values are from those of the contact"
)


@attrs.frozen(eq=False)
class Parameter:
    """A fitted parameter."""

    name: str
    value: float  #: its estimate, in SI
    #: low and high: 95 % confidence interval, from the variation of the estimate between branches
    #: if these are enough, else the interval of independent samples. NaN if the search did not end
    #: at a minimum.
    low: float
    high: float
    #: noise_low and noise_high: the interval for residuals independent from sample to sample.
    noise_low: float = math.nan
    noise_high: float = math.nan
    #: start and end: if the record drifts beyond scatter, the values at its ends on a straight
    #: line; `value` is then the value in its middle. Else NaN.
    start: float = math.nan
    end: float = math.nan
    #: slope_low and slope_high: the interval of the rise from start to end, over the value [1].
    slope_low: float = math.nan
    slope_high: float = math.nan

    @property
    def drifts(self) -> bool:
        """True if the parameter drifts along the record."""
        return math.isfinite(self.start)

    def interval(self, unit: float = 1.0) -> str:
        """Return the confidence interval as a string, in a unit of that many SI units."""
        determined = self._is_determined(self.low, self.high)
        digits = self._digits
        low, high = (f"{bound / unit:.{digits}g}" for bound in (self.low, self.high))
        return f"95 %: {low} to {high}" if determined else "95 %: not determined"

    def text(self, remark: str = "") -> str:
        """Return estimate and interval with their unit, and a remark after the interval."""
        return f"{self.value_text(self.value, self._digits)} (95 %: {self._range(self.low, self.high)}{remark})"

    def noise_text(self) -> str:
        """Return the interval for residuals independent from sample to sample, with its unit."""
        return self._range(self.noise_low, self.noise_high)

    def drift_text(self) -> str:
        """Describe the drift of the parameter along the record."""
        return (
            f"{self.name} drifts along the record, from {self.value_text(self.start)} at its start to "
            f"{self.value_text(self.end)} at its end, by {100 * self.slope_low:+.2g} to {100 * self.slope_high:+.2g} % "
            "(95 %); the estimate is that of its middle"
        )

    def value_text(self, value: float, digits: int = 4) -> str:
        """Return a value of the parameter with its unit."""
        return quantity_text(value, UNIT_OF.get(self.name, "1"), digits)

    def _is_determined(self, low: float, high: float) -> bool:
        return math.isfinite(high - low) if self.name == OFFSET else high < UNDETERMINED * low

    @property
    def _digits(self) -> int:
        """Significant digits of value and interval: an offset may be much larger than its interval."""
        width = self.high - self.low
        size = max(abs(self.low), abs(self.high))
        if self.name != OFFSET or not 0 < width < math.inf:
            return 6
        return min(max(6, 3 + math.ceil(math.log10(size / width))), 15)

    def _range(self, low: float, high: float) -> str:
        determined = self._is_determined(low, high)
        digits = self._digits
        return (
            f"{self.value_text(low, digits)} to {self.value_text(high, digits)}"
            if determined
            else "not determined"
        )


@attrs.frozen(eq=False, repr=False)
class ParameterFit:
    """Fitted parameters, and the response of the model with them."""

    parameters: tuple[Parameter, ...]
    correlation: Floats  #: (parameter, parameter) Of their estimates [1]
    response: ModelResponse  #: response of the model at each sample with these parameters
    residual: Floats  #: (sample) Measured less model load at the samples compared [N]
    misfit: float  #: root of the reduced χ² [1]: about 1 where noise explains the residuals
    degrees_of_freedom: int
    #: Notes on residuals, convergence, parameters that are hardly determined, and drift.
    notes: tuple[str, ...]
    #: Number of loops, or pieces of a few loops each, behind the intervals; None if there are too
    #: few, and the intervals are those of independent samples.
    loops_compared: int | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    @property
    def fits(self) -> bool:
        """True if the misfit is at most a few times the noise."""
        return self.misfit <= MUCH_WORSE

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): whether the model fits, the estimates, their intervals, and notes."""
        has_verdict = int(not self.fits)
        lines = [("the model does not fit", text) for text in self.notes[:has_verdict]]
        for parameter in self.parameters:
            wider = self.loops_compared is not None or parameter.low < parameter.noise_low
            has_both = wider and not math.isnan(parameter.low)
            samples = f"; were samples independent {parameter.noise_text()}" if has_both else ""
            lines.append((parameter.name, parameter.text(samples)))
        lines.append(("intervals by", self._basis()))
        names = [parameter.name for parameter in self.parameters]
        lines += [
            (f"correlation of {names[j]} and {names[i]}", f"{self.correlation[i, j]:+.3f}")
            for i in range(len(names))
            for j in range(i)
        ]
        lines.append(("misfit over noise", f"{self.misfit:.3g}"))
        return [*lines, *(("note", text) for text in self.notes[has_verdict:])]

    def _basis(self) -> str:
        if math.isnan(self.parameters[0].low):
            return "none: the search did not end at a minimum"
        if self.loops_compared is None:
            few = "there are too few loops to show how they scatter and drift"
            if any(parameter.low < parameter.noise_low for parameter in self.parameters):
                return f"noise added once more, since the contact remembers it: {few}"
            basis = "noise" if self.misfit <= 1 else "the residuals"
            return f"{basis}, as if independent: {few}, so that the true interval may be wider"
        return f"how the estimates wander over {self.loops_compared} pieces of the record, of whole loops"

    @property
    def values(self) -> dict[str, float]:
        """The estimates by name."""
        return {parameter.name: parameter.value for parameter in self.parameters}


def fit_parameters(
    model: Model,
    start: Mapping[str, float],
    observation: Observation,
    *,
    notify: Callable[[int], object] = lambda _: None,
) -> ParameterFit:
    """Fit the parameters of a model to measured loops.

    The model builds an ensemble and an instrument from the parameters by name; the start, > 0, may
    be off by 10⁴. `notify` is called at each replay of the observation, with their estimated
    number.
    """
    with warnings.catch_warnings():
        # trials of the search may be implausible; the estimates are printed
        warnings.simplefilter("ignore", UnlikelyValueWarning)
        search = Search.from_start(model, start, observation)
        result = search.solve(notify)
        outliers = search.find_outliers(result)
        if outliers.any():
            search = search.without(outliers)
            minimum = search.verify_minimum(search.minimise_reweighted(result.unknowns))
            result = attrs.evolve(minimum, spread=result.spread)
        return _evaluate(search, result, int(outliers.sum()))


def _evaluate(search: Search, result: SearchResult, outliers: int = 0) -> ParameterFit:
    """Compute estimates, intervals and notes from the result of a search; `outliers` were excluded from it."""
    names, count, observation = search.names, len(search.names), search.observation
    freedom = search.compared.size - count
    variance = float(result.residual @ result.residual) / freedom
    nodes = result.residual[search.compared.size :]
    over_noise = result.residual[: search.compared.size] * result.scale / result.noise
    misfit = math.sqrt(float(over_noise @ over_noise + nodes @ nodes) / freedom)
    covariance = _covariance(result.slopes)
    deviation = np.sqrt(np.diag(covariance))
    # a model that does not fit widens the intervals; one that fits by luck does not narrow them
    by_noise = student_factor(freedom, CONFIDENCE) * deviation * math.sqrt(max(variance, 1.0))
    wanders = _measure_wander(search, result, covariance, misfit)
    if wanders is None:
        reach = _measure_noise_effect(search, result, covariance)
    else:
        reach = np.array([variation.reach for variation in wanders])
    # residuals of few pieces may be alike by chance, and pieces have no information on a parameter
    # without effect
    reach = np.where(np.any(result.slopes, axis=0), np.maximum(reach, by_noise), by_noise)
    # other minima that are as deep but for chance are as likely
    reach = np.maximum(reach, result.spread)
    by_noise = np.maximum(by_noise, result.spread)
    # an offset of the whole displacement range or more is unknown
    undetermined = (np.array(names) == OFFSET) & (reach > FARTHEST)
    reach = np.where(undetermined, math.inf, reach)
    by_noise = np.where(undetermined, math.inf, by_noise)
    correlation = covariance / np.outer(deviation, deviation)
    centre = result.unknowns[:count]
    ends = [centre + sign * width for width in (reach, by_noise) for sign in (-1, 1)]
    limit = result.at_limit(search.start)
    minimum = result.converged and not limit.any()
    if not minimum:
        # an interval around a point that is not a minimum would be wrong
        reach = np.zeros_like(reach)
        ends = [np.full(count, math.nan)] * 4
    columns = search.to_values(np.array([centre, *ends])).T.tolist()
    parameters = tuple(
        Parameter(name, *numbers) for name, numbers in zip(names, columns, strict=True)
    )
    if minimum and wanders is not None:
        parameters = tuple(map(_with_drift, parameters, wanders))
    pieces = None if wanders is None else _pieces(search).size - 1
    return ParameterFit(
        parameters=parameters,
        correlation=correlation,
        response=result.response,
        residual=(observation.tangential_load - result.response.tangential_load)[search.compared],
        misfit=misfit,
        degrees_of_freedom=freedom,
        loops_compared=pieces,
        notes=(
            *_notes_on_search(search, result, misfit, minimum=minimum),
            *_note_on_outliers(outliers, search.compared.size),
            *(() if OFFSET in names else check_start(observation)),
            *_note_on_identifiability(names, correlation, reach, limit),
            *(variation.drift_text() for variation in parameters if variation.drifts),
        ),
    )


def _notes_on_search(
    search: Search, result: SearchResult, misfit: float, *, minimum: bool
) -> list[str]:
    notes = []
    if misfit > MUCH_WORSE:
        residuals = compute_residuals(search.observation, result.response, search.compared)
        noise = math.sqrt(float(np.mean(result.noise**2))) / residuals.largest
        notes.append(
            f"{residuals.text()}; noise alone gives {100 * noise:.2g} %: the model is incomplete"
            + _MEANING * minimum
        )
    if not result.converged:
        notes.append(
            "the search did not converge: the sum of squares has no single minimum, and the values "
            "are no estimates"
        )
    if result.at_bounds:
        nodes = count_text(
            search.free, "turning point or step of load", "turning points and steps of load"
        )
        notes.append(
            f"{result.at_bounds:,} of {nodes} would be more than {FARTHEST_NODE:g} deviations of the noise away from "
            "where they were measured: noise alone does not explain the residuals"
        )
    return notes


def _note_on_outliers(outliers: int, rest: int) -> list[str]:
    if not outliers:
        return []
    many = f"{outliers:,} of {rest + outliers:,} samples"
    return [
        f"{many} have residuals that stand out from their neighbours', as spikes do: the fit leaves them out"
    ]


@attrs.frozen
class LoopRange:
    """Range of a channel between its turning points."""

    middle: float
    half_range: float

    @classmethod
    def from_turns(cls, channel: Floats, turns: Integers) -> "LoopRange":
        """Return the range between the medians of the turning points on either side."""
        first, second = (float(np.median(channel[turns[side::2]])) for side in (0, 1))
        return cls((first + second) / 2, abs(first - second) / 2)


def check_start(observation: Observation) -> list[str]:
    """Return a note if a record begins in the middle of a stroke: the model begins unloaded."""
    turns = observation.turns[1:-1]
    if turns.size < 2 or observation.forgets:
        return []
    load = LoopRange.from_turns(observation.tangential_load, turns)
    displacement = LoopRange.from_turns(observation.displacement, turns)
    if load.half_range == 0.0:
        return []

    # an unloaded contact has zero load, or the offset of the load; one-sided loops have another
    # middle
    first_load = float(observation.tangential_load[0])
    initial_load = min(abs(first_load), abs(first_load - load.middle))
    negligible_load = max(AT_REST * load.half_range, SURE_OF_NOISE * observation.load_noise)
    starts_centred = (
        observation.start_sample > 0
        and abs(displacement.middle) <= CENTRED * displacement.half_range
    )
    if initial_load <= negligible_load or starts_centred:
        return []
    text = (
        f"the record does not begin at rest: its first load is {100 * initial_load / load.half_range:.3g} % of half "
        "the height of the loops away from zero, and the model begins without a load; displacement_offset among the "
        'parameters of [fit] finds the displacement without a load; where the contact slides, past = "unknown" in '
        "[loading] compares the samples that do not depend on what was before the record"
    )
    return [text]


def _pieces(search: Search) -> Integers:
    """Return the first sample of each piece of the record used for intervals, and the number of samples."""
    observation = search.observation
    return intervals.split_into_pieces(
        observation.turns[observation.turns >= observation.start_sample], observation.time.size
    )


def _measure_wander(
    search: Search, result: SearchResult, covariance: Floats, misfit: float
) -> list[intervals.Wander] | None:
    """Measure the variation of the estimates over the pieces of the record; None if there are too few."""
    bounds = _pieces(search)
    count = bounds.size - 1
    if count < intervals.FEWEST_LOOPS:
        return None
    moves, shares = _compute_influence(search, result, covariance, bounds)
    few = count <= intervals.FEW_PIECES
    least = [
        intervals.compute_student_half_width(move, share, CONFIDENCE) if few else 0.0
        for move, share in zip(moves.T, shares.T, strict=True)
    ]
    by_loop = [
        intervals.compute_wander(move, share, CONFIDENCE)
        for move, share in zip(moves.T, shares.T, strict=True)
    ]
    # the branches of few loops are twice as many pieces
    branches = count <= intervals.MOST_PIECES // 2
    if branches:
        moves, shares = _compute_influence(search, result, covariance, _branches(search))
    weighed = np.ones(result.residual.size)
    weighed[: search.compared.size] = result.noise / result.scale
    # the estimate of the noise is on the large side: smaller residuals reduce it a little
    noise = float(np.clip(misfit, LEAST_NOISE, 1.0)) * np.linalg.norm(
        result.slopes @ covariance * weighed[:, None], axis=0
    )
    residuals = compute_residuals(search.observation, result.response, search.compared)
    second_order = (
        SECOND_ORDER * residuals.between_branches * (residuals.rms / residuals.largest) ** 2
    )
    reaches = [
        intervals.compute_half_width(
            move, share, error, CONFIDENCE, sides=branches, line=variation.drifts
        )
        for variation, move, share, error in zip(
            by_loop, moves.T, shares.T, noise.tolist(), strict=True
        )
    ]
    return [
        attrs.evolve(
            variation,
            reach=math.hypot(
                reach if variation.drifts else max(reach, student), second_order * (name != OFFSET)
            ),
        )
        for name, variation, reach, student in zip(
            search.names, by_loop, reaches, least, strict=True
        )
    ]


def _measure_noise_effect(search: Search, result: SearchResult, covariance: Floats) -> Floats:
    """Return half the interval of the estimates by the effect of as much noise again on all channels (parameter).

    A contact remembers the noise of single samples: the turns of the displacement, its zero, and each fall of the
    normal load. The error in one such place moves all residuals after it, which are not independent.
    """
    random = np.random.default_rng(0)
    changes = [search.noise_change(result, random) for _ in range(NOISE_REPEATS)]
    moves = np.array(changes) @ result.slopes[: search.compared.size] @ covariance
    student = student_factor(NOISE_REPEATS - 1, CONFIDENCE)
    # noise that is there has had its mean effect as well
    effect: Floats = student * moves.std(axis=0, ddof=1) + np.abs(moves.mean(axis=0))
    return effect


def _branches(search: Search) -> Integers:
    """Return the first sample of each branch that is compared, and the number of samples."""
    observation = search.observation
    starts = observation.turns[observation.turns >= observation.start_sample][:-1]
    # the first quarter of a record belongs to the branch after it
    starts = starts if observation.start_sample else np.delete(starts, 1)
    return np.append(starts, observation.time.size)


def _compute_influence(
    search: Search, result: SearchResult, covariance: Floats, bounds: Integers
) -> tuple[Floats, Floats]:
    """Compute the influence of each piece on the estimates, and its fraction of the information (piece, parameter)."""
    count = bounds.size - 1
    nodes = search.observation.nodes[1 : 1 + search.free]
    piece = np.clip(
        np.searchsorted(bounds, np.append(search.compared, nodes), side="right") - 1, 0, count - 1
    )
    # influence of each residual on the estimates, and its information on them
    moves, shares = np.zeros((2, count, len(search.names)))
    np.add.at(moves, piece, -result.pull @ covariance)
    np.add.at(shares, piece, (result.slopes @ covariance) ** 2)
    # all pieces have the same, positive information on a parameter without effect
    shares = np.maximum(shares, 1e-6 * shares.max(axis=0) + 1e-300)
    return moves, shares / shares.sum(axis=0)


def _with_drift(parameter: Parameter, wander: intervals.Wander) -> Parameter:
    """Return a parameter with its drift along the record, if it drifts."""
    # if single pieces determine little, a line through logarithms is meaningless
    if parameter.name == OFFSET or not wander.drifts or abs(wander.rise) + wander.rise_reach > 1:
        return parameter
    return attrs.evolve(
        parameter,
        start=parameter.value * math.exp(-wander.rise / 2),
        end=parameter.value * math.exp(wander.rise / 2),
        slope_low=wander.rise - wander.rise_reach,
        slope_high=wander.rise + wander.rise_reach,
    )


def _note_on_identifiability(
    names: Sequence[str], correlation: Floats, reach: Floats, limit: Booleans
) -> list[str]:
    notes = []
    for i, name in enumerate(names):
        if limit[i]:
            move = (
                "the range of the displacement"
                if name == OFFSET
                else f"a factor of {math.exp(FARTHEST):g}"
            )
            notes.append(
                f"{name} moved by {move} from its start, which is the limit of the search: start it again from these "
                "values"
            )
        notes += [
            f"these data do not distinguish {second} from {name} (correlation {correlation[i, j]:+.4f}): "
            "leave one of them, with a value from another measurement, out of [fit]"
            for j, second in enumerate(names[:i])
            if abs(correlation[i, j]) > MOST_CORRELATED
        ]
        if name == OFFSET:
            if math.isinf(reach[i]):
                notes.append(
                    f"{name} is not determined by these data: once the contact has slid, it does not remember where "
                    "it began; leave it out of the parameters"
                )
        elif reach[i] > math.log(2):
            span = math.exp(2 * min(reach[i], math.log(UNDETERMINED)))
            notes.append(
                f"{name} is hardly determined by these data: its interval spans a factor of {span:.3g}"
                if span < UNDETERMINED
                else f"{name} is not determined by these data"
            )
    return notes


def _covariance(jacobian: Floats) -> Floats:
    """Return (JᵀJ)⁻¹, with very large variances where the residuals do not depend on an unknown."""
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, 1.0)
    _, values, directions = np.linalg.svd(jacobian / size, full_matrices=False)
    inverse = 1 / np.maximum(values, values[0] * 1e-9 + 1e-150)
    half = directions.T * inverse
    covariance: Floats = half @ half.T / np.outer(size, size)
    return covariance
