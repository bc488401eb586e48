"""From measured loops to parameters: nonlinear least squares on the exact model, and how sure the estimates are.

The model passes the measured displacements as in `observation`. The true place of each turning point, and of each step
of the normal load, is an unknown as well, held by what was measured there: the contact remembers it, noise and all. A
sample's misfit of the load is weighed by the noise of the load and that of the displacement times the stiffness there
(effective variance: Orear, *Am. J. Phys.* 50 (1982) 912-916). `search` has the least squares.

Two intervals come with each estimate. One takes what is left, noise and misfit, for independent from sample to sample.
Loops of an instrument differ by more than that, and what is left of them is correlated; so the other one, which holds
then too, goes by how the estimate wanders from loop to loop (`scatter`), and tells a drift along the record.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.basics.units import UNIT_OF, quantity_text
from historysim.basics.wording import counted
from historysim.measured import scatter
from historysim.measured.misfit import what_is_left
from historysim.measured.observation import ModelResponse, Observation
from historysim.measured.power_law import CONFIDENCE
from historysim.measured.search import FARTHEST, FARTHEST_NODE, Model, Search, SearchResult

TOLD_APART = 0.99
"""Correlation of two parameters above which the data do not tell them apart."""
UNDETERMINED = 1e6
"""Ratio of the ends of an interval from which on nothing is known."""
MUCH_WORSE = 3.0
"""Misfit over noise from which on the noise does not explain what is left."""
# what a float can hold, as a logarithm
_LARGEST = 700.0


@attrs.frozen(eq=False)
class Parameter:
    """A fitted parameter.

    Attributes
    ----------
    name : str
    value : float
        Its estimate, in SI.
    low, high : float
        Its confidence interval of 95 %, from the logarithm of the parameter: by how the estimate wanders from loop to
        loop, where there are enough of them, else the other one.
    noise_low, noise_high : float
        What the interval would be if what is left, noise and misfit, were independent from sample to sample.
    start, end : float
        Where the record drifts, beyond what scatter makes of it, the values at its start and its end on a straight
        line; `value` is then that in its middle. Else NaN.
    slope_low, slope_high : float
        The interval of the rise from start to end, over the value [1].
    """

    name: str
    value: float
    low: float
    high: float
    noise_low: float = math.nan
    noise_high: float = math.nan
    start: float = math.nan
    end: float = math.nan
    slope_low: float = math.nan
    slope_high: float = math.nan

    @property
    def drifts(self) -> bool:
        """Whether it drifts along the record."""
        return math.isfinite(self.start)

    def interval(self, unit: float = 1.0) -> str:
        """Return the confidence interval as a text, in a unit of that many SI units."""
        known = self.high < UNDETERMINED * self.low
        return f"95 %: {self.low / unit:.6g} to {self.high / unit:.6g}" if known else "95 %: not determined"

    def text(self, told: str = "") -> str:
        """Return estimate and interval with their unit, and behind the interval what else is told of it."""
        return f"{self.text_of(self.value, 6)} (95 %: {self._range(self.low, self.high)}{told})"

    def noise_text(self) -> str:
        """Return what the interval would be if what is left were independent from sample to sample, with its unit."""
        return self._range(self.noise_low, self.noise_high)

    def text_of(self, value: float, digits: int = 4) -> str:
        """Return a value that it might have as a text with its unit."""
        return quantity_text(value, UNIT_OF.get(self.name, "1"), digits)

    def _range(self, low: float, high: float) -> str:
        return f"{self.text_of(low, 6)} to {self.text_of(high, 6)}" if high < UNDETERMINED * low else "not determined"


@attrs.frozen(eq=False)
class ParameterFit:
    """Parameters, and what the model makes of the samples with them.

    Attributes
    ----------
    parameters : tuple of Parameter
    correlation : array (parameter, parameter)
        Of their estimates [1].
    response : ModelResponse
        What the model does at each sample, with these parameters.
    residual : array (sample)
        Measured less model load at the samples compared [N].
    misfit : float
        Root of the reduced χ² [1]: about 1 where noise explains what is left.
    degrees_of_freedom : int
    notes : tuple of str
        Whether the model misses the data by much more than their noise, and where; whether the search did not settle,
        or places are at their bounds; what the data cannot tell: parameters that can stand for one another, or that
        hardly matter; and what drifts along the record.
    loops_compared : int or None
        The loops, or pieces of a few loops each, that the intervals go by; None where there are too few, and the
        intervals are those of independent samples.
    """

    parameters: tuple[Parameter, ...]
    correlation: Floats
    response: ModelResponse
    residual: Floats
    misfit: float
    degrees_of_freedom: int
    notes: tuple[str, ...]
    loops_compared: int | None = None

    @property
    def fits(self) -> bool:
        """Whether the model misses the data by no more than a few times their noise."""
        return self.misfit <= MUCH_WORSE

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): whether the model fits, what was found, how sure that is, what is open."""
        first = int(not self.fits)
        lines = [("the model does not fit", text) for text in self.notes[:first]]
        for parameter in self.parameters:
            samples = "" if self.loops_compared is None else f"; were samples independent {parameter.noise_text()}"
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
        if self.loops_compared is None:
            kept = "noise" if self.misfit <= 1 else "what is left"
            return f"{kept}, as if independent: there are too few loops to tell how they scatter and drift"
        return f"how the estimates wander over {self.loops_compared} pieces of the record, of whole loops"

    @property
    def values(self) -> dict[str, float]:
        """The estimates by name."""
        return {parameter.name: parameter.value for parameter in self.parameters}


def fit_parameters(
    model: Model, start: Mapping[str, float], observation: Observation, *, walked: Callable[[], object] = lambda: None
) -> ParameterFit:
    """Return the parameters with which a model comes closest to measured loops.

    Parameters
    ----------
    model : callable
        Takes the parameters by name and makes an ensemble and an instrument with them.
    start : mapping of str to float
        What each parameter is thought to be, > 0. The search is in logarithms, and sets out from the best of the start
        and its neighbours a factor of ten away.
    observation : Observation
    walked : callable
        Called each time that the model has walked along the observation, to show progress.

    Raises
    ------
    InputError
        A start that is not > 0 and finite, samples that are not more than the parameters, or no load to fit to.
    """
    search = Search.of(model, start, observation)
    return _read_off(search, search.ended(walked))


def _read_off(search: Search, end: SearchResult) -> ParameterFit:
    """Return what the end of a search says: estimates, their intervals, and what the data cannot tell."""
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
    wanders = _wanders(search, end, covariance)
    reach = by_noise if wanders is None else np.array([each.reach for each in wanders])
    correlation = covariance / np.outer(deviation, deviation)
    middle = end.unknowns[:count]
    off = (observation.tangential_load - end.response.tangential_load)[search.compared]
    parameters = tuple(
        Parameter(name, math.exp(at), *_around(at, width), *_around(at, noise))
        for name, at, width, noise in zip(names, middle, reach, by_noise, strict=True)
    )
    if wanders is not None:
        parameters = tuple(map(_drifting, parameters, wanders))
    pieces = None if wanders is None else _pieces(search).size - 1
    return ParameterFit(
        parameters=parameters,
        correlation=correlation,
        response=end.response,
        residual=off,
        misfit=misfit,
        degrees_of_freedom=freedom,
        loops_compared=pieces,
        notes=(
            *_notes_on_search(search, end, misfit),
            *_indistinct(names, correlation, reach, np.abs(middle - search.start)),
            *_drifts(parameters),
        ),
    )


def _around(middle: float, width: float) -> tuple[float, float]:
    return math.exp(middle - width), math.exp(min(middle + width, _LARGEST))


def _notes_on_search(search: Search, end: SearchResult, misfit: float) -> list[str]:
    notes = []
    if misfit > MUCH_WORSE:
        left = what_is_left(search.observation, end.response, search.compared)
        noise = math.sqrt(float(np.mean(end.noise**2))) / left.largest
        notes.append(
            f"{left.text()}, where noise leaves {100 * noise:.2g} %: the model lacks something, or the fit needs "
            "another start. The intervals say by how much the values of another such record would differ. They do not "
            "say how far the values are from those of the contact"
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


def _pieces(search: Search) -> Integers:
    """Return the first sample of each piece of the record that intervals go by, and the number of samples."""
    observation = search.observation
    return scatter.pieces(observation.turns[observation.turns >= observation.first], observation.time.size)


def _wanders(search: Search, end: SearchResult, covariance: Floats) -> list[scatter.Wander] | None:
    """Return how the estimates wander over the pieces of the record; None where they are too few."""
    bounds = _pieces(search)
    count = bounds.size - 1
    if count < scatter.FEWEST_LOOPS:
        return None
    nodes = search.observation.nodes[1 : 1 + search.free]
    piece = np.clip(np.searchsorted(bounds, np.append(search.compared, nodes), side="right") - 1, 0, count - 1)
    # what each residual moves the estimates by, and what it knows of them
    moves, shares = np.zeros((2, count, len(search.names)))
    np.add.at(moves, piece, -end.pull @ covariance)
    np.add.at(shares, piece, (end.slopes @ covariance) ** 2)
    # of a parameter without effect all pieces know as little, and none knows nothing
    shares = np.maximum(shares, 1e-6 * shares.max(axis=0) + 1e-300)
    shares /= shares.sum(axis=0)
    return [scatter.wander(move, share, CONFIDENCE) for move, share in zip(moves.T, shares.T, strict=True)]


def _drifting(parameter: Parameter, wander: scatter.Wander) -> Parameter:
    """Return a parameter with its drift along the record, where there is one."""
    # where one piece tells little, a line of logarithms is none
    if not wander.drifts or abs(wander.rise) + wander.rise_reach > 1:
        return parameter
    return attrs.evolve(
        parameter,
        start=parameter.value * math.exp(-wander.rise / 2),
        end=parameter.value * math.exp(wander.rise / 2),
        slope_low=wander.rise - wander.rise_reach,
        slope_high=wander.rise + wander.rise_reach,
    )


def _drifts(parameters: Sequence[Parameter]) -> list[str]:
    return [
        f"{each.name} drifts along the record, from {each.text_of(each.start)} at its start to "
        f"{each.text_of(each.end)} at its end, by "
        f"{100 * each.slope_low:+.2g} to {100 * each.slope_high:+.2g} % (95 %); the estimate is that of its middle"
        for each in parameters
        if each.drifts
    ]


def _indistinct(names: Sequence[str], correlation: Floats, reach: Floats, moved: Floats) -> list[str]:
    notes = []
    for i, first in enumerate(names):
        if moved[i] > 0.99 * FARTHEST:
            notes.append(
                f"{first} moved by a factor of {math.exp(FARTHEST):g} from its start, which is the limit of the search"
            )
        notes += [
            f"these data do not tell {second} from {first} (correlation {correlation[i, j]:+.4f}); fix one of them by "
            "another measurement"
            for j, second in enumerate(names[:i])
            if abs(correlation[i, j]) > TOLD_APART
        ]
        if reach[i] > math.log(2):
            span = math.exp(2 * min(reach[i], _LARGEST / 2))
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
    inverse = 1 / np.maximum(values, values[0] * 1e-9 + 1e-300)
    half = directions.T * inverse
    covariance: Floats = half @ half.T / np.outer(size, size)
    return covariance
