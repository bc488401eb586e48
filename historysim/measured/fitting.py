"""From measured loops to parameters: nonlinear least squares on the exact model, and how sure the estimates are.

README.md of this folder, "Fit", says what is minimised and what the two intervals of each estimate mean.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.units import UNIT_OF, quantity_text
from historysim.basics.wording import counted
from historysim.measured import intervals
from historysim.measured.comparison import ModelResponse, Observation, compute_residuals
from historysim.measured.loop_table import CONFIDENCE
from historysim.measured.search import FARTHEST, FARTHEST_NODE, OFFSET, Model, Search, SearchResult

MOST_CORRELATED = 0.99  # correlation of two parameters above which the data do not distinguish them
UNDETERMINED = 1e6  # ratio of the ends of an interval from which on nothing is known
MUCH_WORSE = 3.0  # misfit over noise from which on the noise does not explain what is left
SURE_OF_NOISE = 5.0  # standard deviations of the noise of the load beyond which a load is not noise
LEAST_NOISE = 0.9  # share of the estimated noise that is taken at least, however little the model leaves
# What scatter from branch to branch adds to the half width of an interval, over the square of its share of the load:
# one coefficient for all branches is off by some 1.1 to 1.5 of these squares, to either side (tests/README.md).
SECOND_ORDER = 1.8
# Load of the first sample from the middle of the loops, over half their height, up to which a record begins at rest;
# and of the middle of the strokes from zero, over half the stroke, up to which they are centred.
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
    #: low and high: its confidence interval of 95 %, by how the estimate wanders from branch to branch, where there are
    #: enough of them, else the other one. NaN where the search did not end at a minimum.
    low: float
    high: float
    #: noise_low and noise_high: what the interval would be if what is left were independent from sample to sample.
    noise_low: float = math.nan
    noise_high: float = math.nan
    #: start and end: where the record drifts beyond scatter, the values at its ends on a straight line; `value` is then
    #: that in its middle. Else NaN.
    start: float = math.nan
    end: float = math.nan
    #: slope_low and slope_high: the interval of the rise from start to end, over the value [1].
    slope_low: float = math.nan
    slope_high: float = math.nan

    @property
    def drifts(self) -> bool:
        """Whether it drifts along the record."""
        return math.isfinite(self.start)

    def interval(self, unit: float = 1.0) -> str:
        """Return the confidence interval as a string, in a unit of that many SI units."""
        known, digits = self._is_determined(self.low, self.high), self._digits
        low, high = (f"{end / unit:.{digits}g}" for end in (self.low, self.high))
        return f"95 %: {low} to {high}" if known else "95 %: not determined"

    def text(self, remark: str = "") -> str:
        """Return estimate and interval with their unit, and a remark behind the interval."""
        return f"{self.text_of(self.value, self._digits)} (95 %: {self._range(self.low, self.high)}{remark})"

    def noise_text(self) -> str:
        """Return what the interval would be if what is left were independent from sample to sample, with its unit."""
        return self._range(self.noise_low, self.noise_high)

    def drift_text(self) -> str:
        """Return how it drifts along the record."""
        return (
            f"{self.name} drifts along the record, from {self.text_of(self.start)} at its start to "
            f"{self.text_of(self.end)} at its end, by {100 * self.slope_low:+.2g} to {100 * self.slope_high:+.2g} % "
            "(95 %); the estimate is that of its middle"
        )

    def text_of(self, value: float, digits: int = 4) -> str:
        """Return a value that it might have, with its unit."""
        return quantity_text(value, UNIT_OF.get(self.name, "1"), digits)

    def _is_determined(self, low: float, high: float) -> bool:
        return math.isfinite(high - low) if self.name == OFFSET else high < UNDETERMINED * low

    @property
    def _digits(self) -> int:
        """Significant digits of value and interval: an offset may be much larger than its interval."""
        width, size = self.high - self.low, max(abs(self.low), abs(self.high))
        if self.name != OFFSET or not 0 < width < math.inf:
            return 6
        return min(max(6, 3 + math.ceil(math.log10(size / width))), 15)

    def _range(self, low: float, high: float) -> str:
        known, digits = self._is_determined(low, high), self._digits
        return f"{self.text_of(low, digits)} to {self.text_of(high, digits)}" if known else "not determined"


@attrs.frozen(eq=False)
class ParameterFit:
    """Parameters, and what the model makes of the samples with them."""

    parameters: tuple[Parameter, ...]
    correlation: Floats  #: (parameter, parameter) Of their estimates [1]
    response: ModelResponse  #: what the model does at each sample, with these parameters
    residual: Floats  #: (sample) Measured less model load at the samples compared [N]
    misfit: float  #: root of the reduced χ² [1]: about 1 where noise explains what is left
    degrees_of_freedom: int
    #: What the model misses, whether the search settled, which parameters are hardly determined, and what drifts.
    notes: tuple[str, ...]
    #: The loops, or pieces of a few loops each, that the intervals go by; None where there are too few, and the
    #: intervals are those of independent samples.
    loops_compared: int | None = None

    @property
    def fits(self) -> bool:
        """Whether the model misses the data by no more than a few times their noise."""
        return self.misfit <= MUCH_WORSE

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): whether the model fits, the estimates, their intervals, and notes."""
        first = int(not self.fits)
        lines = [("the model does not fit", text) for text in self.notes[:first]]
        for parameter in self.parameters:
            by_loops = self.loops_compared is not None and not math.isnan(parameter.low)
            samples = f"; were samples independent {parameter.noise_text()}" if by_loops else ""
            lines.append((parameter.name, parameter.text(samples)))
        lines.append(("intervals by", self._basis()))
        names = [parameter.name for parameter in self.parameters]
        lines += [
            (f"correlation of {names[j]} and {names[i]}", f"{self.correlation[i, j]:+.3f}")
            for i in range(len(names))
            for j in range(i)
        ]
        lines.append(("misfit over noise", f"{self.misfit:.3g}"))
        return [*lines, *(("note", text) for text in self.notes[first:])]

    def _basis(self) -> str:
        if math.isnan(self.parameters[0].low):
            return "none: the search did not end at a minimum; start it again from these values"
        if self.loops_compared is None:
            kept = "noise" if self.misfit <= 1 else "what is left"
            return f"{kept}, as if independent: there are too few loops to show how they scatter and drift"
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
    """Return the parameters with which a model comes closest to measured loops.

    The model makes an ensemble and an instrument of the parameters by name; the start, > 0, may be off by 10⁴. `notify`
    is called at each walk of the model along the observation, with how many there will be, by an estimate.
    """
    search = Search.of(model, start, observation)
    end = search.ended(notify)
    outliers = search.outliers(end)
    if outliers.any():
        search = search.without(outliers)
        end = attrs.evolve(search.checked(search.settled(end.unknowns)), spread=end.spread)
    return _read_off(search, end, int(outliers.sum()))


def _read_off(search: Search, end: SearchResult, outliers: int = 0) -> ParameterFit:
    """Return the estimates at the end of a search, their intervals, and notes; outliers are left out already."""
    from scipy import stats

    names, count, observation = search.names, len(search.names), search.observation
    freedom = search.compared.size - count
    variance = float(end.residual @ end.residual) / freedom
    nodes = end.residual[search.compared.size :]
    over_noise = end.residual[: search.compared.size] * end.scale / end.noise
    misfit = math.sqrt(float(over_noise @ over_noise + nodes @ nodes) / freedom)
    covariance = _covariance(end.slopes)
    deviation = np.sqrt(np.diag(covariance))
    # a model that does not fit makes the estimates less sure, one that fits by luck does not make them surer
    by_noise = stats.t.ppf((1 + CONFIDENCE) / 2, freedom) * deviation * math.sqrt(max(variance, 1.0))
    wanders = _wanders(search, end, covariance, misfit)
    reach = by_noise if wanders is None else np.array([each.reach for each in wanders])
    # pieces say nothing of a parameter that has no effect
    reach = np.where(np.any(end.slopes, axis=0), reach, by_noise)
    # other minima that are as deep but for chance are as likely
    reach, by_noise = np.maximum(reach, end.spread), np.maximum(by_noise, end.spread)
    # an offset of the whole displacement range or more is unknown
    unknown = (np.array(names) == OFFSET) & (reach > FARTHEST)
    reach, by_noise = np.where(unknown, math.inf, reach), np.where(unknown, math.inf, by_noise)
    correlation = covariance / np.outer(deviation, deviation)
    middle = end.unknowns[:count]
    ends = [middle + sign * width for width in (reach, by_noise) for sign in (-1, 1)]
    limit = end.at_limit(search.start)
    minimum = end.settled and not limit.any()
    if not minimum:
        # an interval around what is no minimum would be a wrong one
        reach, ends = np.zeros_like(reach), [np.full(count, math.nan)] * 4
    columns = search.values_at(np.array([middle, *ends])).T.tolist()
    parameters = tuple(Parameter(name, *numbers) for name, numbers in zip(names, columns, strict=True))
    if minimum and wanders is not None:
        parameters = tuple(map(_drifting, parameters, wanders))
    pieces = None if wanders is None else _pieces(search).size - 1
    return ParameterFit(
        parameters=parameters,
        correlation=correlation,
        response=end.response,
        residual=(observation.tangential_load - end.response.tangential_load)[search.compared],
        misfit=misfit,
        degrees_of_freedom=freedom,
        loops_compared=pieces,
        notes=(
            *_notes_on_search(search, end, misfit, minimum=minimum),
            *_note_on_outliers(outliers, search.compared.size),
            *(() if OFFSET in names else check_start(observation)),
            *_indistinct(names, correlation, reach, limit),
            *(each.drift_text() for each in parameters if each.drifts),
        ),
    )


def _notes_on_search(search: Search, end: SearchResult, misfit: float, *, minimum: bool) -> list[str]:
    notes = []
    if misfit > MUCH_WORSE:
        left = compute_residuals(search.observation, end.response, search.compared)
        noise = math.sqrt(float(np.mean(end.noise**2))) / left.largest
        notes.append(
            f"{left.text()}, where noise leaves {100 * noise:.2g} %: the model lacks something, or the fit needs "
            "another start" + _MEANING * minimum
        )
    if not end.settled:
        notes.append("the search did not converge; start it again from these values")
    if end.at_bounds:
        nodes = counted(search.free, "turning point or step of load", "turning points and steps of load")
        notes.append(
            f"{end.at_bounds:,} of {nodes} would be more than {FARTHEST_NODE:g} deviations of the noise away from "
            "where they were measured: noise alone does not explain what the model misses"
        )
    return notes


def _note_on_outliers(outliers: int, rest: int) -> list[str]:
    if not outliers:
        return []
    many = f"{outliers:,} of {rest + outliers:,} samples"
    return [f"{many} stand out from what the model leaves of their neighbours, as spikes do: the fit leaves them out"]


def check_start(observation: Observation) -> list[str]:
    """Return a note if a record begins in the middle of a stroke: the model begins without a load."""
    turns = observation.turns[1:-1]
    if turns.size < 2:
        return []
    channels = observation.tangential_load, observation.displacement
    ends = [[float(np.median(channel[turns[start::2]])) for start in (0, 1)] for channel in channels]
    (load, half_load), (place, half_stroke) = (((one + other) / 2, abs(one - other) / 2) for one, other in ends)
    first = float(observation.tangential_load[0])
    # at rest the load is zero, or where an offset of the load has its zero; loops to one side have another middle
    begins = min(abs(first), abs(first - load))
    centred = observation.start_sample > 0 and abs(place) <= CENTRED * half_stroke
    if not half_load or centred or begins <= max(AT_REST * half_load, SURE_OF_NOISE * observation.load_noise):
        return []
    text = (
        f"the record does not begin at rest: its first load is {100 * begins / half_load:.3g} % of half the height of "
        "the loops away from zero, and the model begins without a load; displacement_offset among the "
        "parameters of [fit] finds the displacement without a load; where the contact slides, centred = true at the "
        "displacement and skip = 1 in [fit] leave the start to the loops"
    )
    return [text]


def _pieces(search: Search) -> Integers:
    """Return the first sample of each piece of the record that intervals go by, and the number of samples."""
    observation = search.observation
    return intervals.split_into_pieces(
        observation.turns[observation.turns >= observation.start_sample], observation.time.size
    )


def _wanders(search: Search, end: SearchResult, covariance: Floats, misfit: float) -> list[intervals.Wander] | None:
    """Return how the estimates wander over the pieces of the record; None where they are too few."""
    bounds = _pieces(search)
    count = bounds.size - 1
    if count < intervals.FEWEST_LOOPS:
        return None
    moves, shares = _moved(search, end, covariance, bounds)
    by_loop = [intervals.compute_wander(move, share, CONFIDENCE) for move, share in zip(moves.T, shares.T, strict=True)]
    # of few loops, their branches show twice as much
    branches = count <= intervals.MOST_PIECES // 2
    if branches:
        moves, shares = _moved(search, end, covariance, _branches(search))
    weighed = np.ones(end.residual.size)
    weighed[: search.compared.size] = end.noise / end.scale
    # noise is estimated on the large side: where the model leaves less, it is a little less
    noise = float(np.clip(misfit, LEAST_NOISE, 1.0)) * np.linalg.norm(
        end.slopes @ covariance * weighed[:, None], axis=0
    )
    left = compute_residuals(search.observation, end.response, search.compared)
    second_order = SECOND_ORDER * left.between_branches * (left.rms / left.largest) ** 2
    reaches = [
        intervals.compute_half_width(move, share, error, CONFIDENCE, sides=branches, line=each.drifts)
        for each, move, share, error in zip(by_loop, moves.T, shares.T, noise.tolist(), strict=True)
    ]
    return [
        attrs.evolve(each, reach=math.hypot(reach, second_order * (name != OFFSET)))
        for name, each, reach in zip(search.names, by_loop, reaches, strict=True)
    ]


def _branches(search: Search) -> Integers:
    """Return the first sample of each branch that is compared, and the number of samples."""
    observation = search.observation
    starts = observation.turns[observation.turns >= observation.start_sample][:-1]
    # the first quarter of a record belongs to the branch behind it
    starts = starts if observation.skip else np.delete(starts, 1)
    return np.append(starts, observation.time.size)


def _moved(search: Search, end: SearchResult, covariance: Floats, bounds: Integers) -> tuple[Floats, Floats]:
    """Return what each piece moves the estimates by, and its share of what is known of them, (piece, parameter)."""
    count = bounds.size - 1
    nodes = search.observation.nodes[1 : 1 + search.free]
    piece = np.clip(np.searchsorted(bounds, np.append(search.compared, nodes), side="right") - 1, 0, count - 1)
    # what each residual moves the estimates by, and what it knows of them
    moves, shares = np.zeros((2, count, len(search.names)))
    np.add.at(moves, piece, -end.pull @ covariance)
    np.add.at(shares, piece, (end.slopes @ covariance) ** 2)
    # of a parameter without effect all pieces know as little, and none knows nothing
    shares = np.maximum(shares, 1e-6 * shares.max(axis=0) + 1e-300)
    return moves, shares / shares.sum(axis=0)


def _drifting(parameter: Parameter, wander: intervals.Wander) -> Parameter:
    """Return a parameter with its drift along the record, where there is one."""
    # where one piece shows little, a line of logarithms is none
    if parameter.name == OFFSET or not wander.drifts or abs(wander.rise) + wander.rise_reach > 1:
        return parameter
    return attrs.evolve(
        parameter,
        start=parameter.value * math.exp(-wander.rise / 2),
        end=parameter.value * math.exp(wander.rise / 2),
        slope_low=wander.rise - wander.rise_reach,
        slope_high=wander.rise + wander.rise_reach,
    )


def _indistinct(names: Sequence[str], correlation: Floats, reach: Floats, limit: Booleans) -> list[str]:
    notes = []
    for i, first in enumerate(names):
        if limit[i]:
            move = "the range of the displacement" if first == OFFSET else f"a factor of {math.exp(FARTHEST):g}"
            notes.append(
                f"{first} moved by {move} from its start, which is the limit of the search: start it again from these "
                "values"
            )
        notes += [
            f"these data do not distinguish {second} from {first} (correlation {correlation[i, j]:+.4f}); fix one of "
            "them by another measurement"
            for j, second in enumerate(names[:i])
            if abs(correlation[i, j]) > MOST_CORRELATED
        ]
        if first == OFFSET:
            if math.isinf(reach[i]):
                notes.append(
                    f"{first} is not determined by these data: once the contact has slid, it does not remember where "
                    "it began; leave it out of the parameters"
                )
        elif reach[i] > math.log(2):
            span = math.exp(2 * min(reach[i], math.log(UNDETERMINED)))
            notes.append(
                f"{first} is hardly determined by these data: its interval spans a factor of {span:.3g}"
                if span < UNDETERMINED
                else f"{first} is not determined by these data"
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
