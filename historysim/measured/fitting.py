"""From measured loops to parameters: nonlinear least squares on the exact model.

The model passes the measured displacements as in `observation`. The true place of each turning point, and of each step
of the normal load, is an unknown as well, held by what was measured there: the contact remembers it, noise and all. A
sample's misfit of the load is weighed by the noise of the load and that of the displacement times the stiffness there
(effective variance: Orear, *Am. J. Phys.* 50 (1982) 912-916).
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import scalar
from historysim.errors import InputError
from historysim.measured.observation import Observation, Passage, passed
from historysim.measured.power_law import CONFIDENCE

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Model = Callable[[Mapping[str, float]], tuple[Ensemble, Instrument]]

MOST_NODES = 120
"""Turning points and steps of load up to which their places are unknowns; beyond, they are taken as measured."""
TOLD_APART = 0.99
"""Correlation of two parameters above which the data do not tell them apart."""
UNDETERMINED = 1e6
"""Ratio of the ends of an interval from which on nothing is known."""
MUCH_WORSE = 3.0
"""Misfit over noise from which on the noise does not explain what is left."""
_WEIGHINGS = 4
# how far from the start the search may go, and what a float can hold, as logarithms
_FARTHEST, _LARGEST = math.log(1e4), 700.0
# noise moves no node farther, in standard deviations; a model that does not fit would, to look better
_FARTHEST_NODE = 5.0
_STEP = 1e-5
_NODE_STEP = 1e-3


@attrs.frozen(eq=False)
class Parameter:
    """A fitted parameter.

    Attributes
    ----------
    name : str
    value : float
        Its estimate, in SI.
    low, high : float
        Its confidence interval of 95 %, from the logarithm of the parameter.
    """

    name: str
    value: float
    low: float
    high: float

    def interval(self, unit: float = 1.0) -> str:
        """Return the confidence interval as a text, in a unit of that many SI units."""
        if not self.high < UNDETERMINED * self.low:
            return "95 %: not determined"
        return f"95 %: {self.low / unit:.6g} to {self.high / unit:.6g}"


@attrs.frozen(eq=False)
class ParameterFit:
    """Parameters, and what the model makes of the samples with them.

    Attributes
    ----------
    parameters : tuple of Parameter
    correlation : array (parameter, parameter)
        Of their estimates [1].
    passage : Passage
        What the model does at each sample, with these parameters.
    residual : array (sample)
        Measured less model load at the samples compared [N].
    misfit : float
        Root of the reduced χ² [1]: about 1 where noise explains what is left.
    degrees_of_freedom : int
    notes : tuple of str
        What the data cannot tell: parameters that can stand for one another, or that hardly matter; and whether the
        model misses the data by much more than their noise, or the search did not settle.
    """

    parameters: tuple[Parameter, ...]
    correlation: Floats
    passage: Passage
    residual: Floats
    misfit: float
    degrees_of_freedom: int
    notes: tuple[str, ...]

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): what was found, how sure it is, and what the data cannot tell."""
        lines = [(parameter.name, f"{parameter.value:.6g}  ({parameter.interval()})") for parameter in self.parameters]
        names = [parameter.name for parameter in self.parameters]
        lines += [
            (f"correlation of {names[j]} and {names[i]}", f"{self.correlation[i, j]:+.3f}")
            for i in range(len(names))
            for j in range(i)
        ]
        lines.append(("misfit over noise", f"{self.misfit:.3g}"))
        return [*lines, *(("note", text) for text in self.notes)]

    @property
    def values(self) -> dict[str, float]:
        """The estimates by name."""
        return {parameter.name: parameter.value for parameter in self.parameters}


def fit_parameters(model: Model, start: Mapping[str, float], observation: Observation) -> ParameterFit:
    """Return the parameters with which a model comes closest to measured loops.

    Parameters
    ----------
    model : callable
        Takes the parameters by name and makes an ensemble and an instrument with them.
    start : mapping of str to float
        What each parameter is thought to be, > 0. The search is in logarithms, and sets out from the best of the start
        and its neighbours a factor of ten away.
    observation : Observation

    Raises
    ------
    InputError
        A start that is not > 0 and finite, samples that are not more than the parameters, or no load to fit to.
    """
    search = _Search.of(model, start, observation)
    return search.read_off(search.settled(search.best_start()))


@attrs.frozen(eq=False)
class _Search:
    """The least squares: its unknowns are the logarithms of the parameters, and how far the nodes are off.

    Attributes
    ----------
    start : array (parameter)
        Logarithms of the parameters to start from.
    free : int
        Nodes whose places are unknowns.
    compared : array of int
        The samples that are compared.
    load_noise : float
        [N], > 0.
    """

    model: Model
    names: tuple[str, ...]
    start: Floats
    observation: Observation
    free: int
    compared: Integers
    load_noise: float

    @classmethod
    def of(cls, model: Model, start: Mapping[str, float], observation: Observation) -> "_Search":
        names = tuple(start)
        logarithms = np.log([scalar(name, start[name], above=0) for name in names])
        inner = observation.nodes.size - 2
        free = inner if observation.displacement_noise > 0 and inner <= MOST_NODES else 0
        # a node stands for itself: a sample too early or too late, it is on another branch than it is taken for
        compared = np.setdiff1d(np.arange(observation.first, observation.time.size), observation.nodes)
        if compared.size <= len(names):
            raise InputError(
                f"{compared.size} samples for {len(names)} parameters; expected more samples than parameters"
            )
        # without any noise all samples weigh alike
        load_noise = max(observation.load_noise, 1e-9 * float(np.abs(observation.tangential_load).max()))
        if load_noise == 0:
            raise InputError("the tangential load is 0 N throughout; expected a measured load to fit to")
        return cls(model, names, logarithms, observation, free, compared, load_noise)

    def best_start(self) -> Floats:
        """Return the best of the start and its neighbours a factor of ten away."""
        # far from the truth a parameter may hide behind another one, in a valley of its own
        tried = [
            np.concatenate([self.start + step, np.zeros(self.free)])
            for step in itertools.product((0.0, -math.log(10), math.log(10)), repeat=len(self.names))
        ]
        return min(tried, key=lambda x: float(np.sum(self._residuals(x, self.load_noise) ** 2)))

    def settled(self, unknowns: Floats) -> "OptimizeResult":
        """Return where the search ends, with the samples weighed as that end has it."""
        from scipy.optimize import least_squares

        first = np.concatenate([self.start, np.zeros(self.free)])
        reach = np.concatenate([np.full(len(self.names), _FARTHEST), np.full(self.free, _FARTHEST_NODE)])
        bounds = first - reach, first + reach
        for _ in range(_WEIGHINGS):
            stiffness = self._walked(unknowns).stiffness[self.compared]
            scale = np.hypot(self.load_noise, stiffness * self.observation.displacement_noise)
            found = least_squares(
                self._residuals, unknowns, self._jacobian, bounds, args=(scale,), max_nfev=60, xtol=1e-10, ftol=1e-12
            )
            moved = np.abs(found.x - unknowns)[: len(self.names)].max()
            unknowns = found.x
            if moved < 1e-6:
                break
        return found

    def read_off(self, found: "OptimizeResult") -> ParameterFit:
        """Return what the end of a search says: estimates, their intervals, and what the data cannot tell."""
        from scipy import stats

        count = len(self.names)
        freedom = self.compared.size - count
        variance = 2 * found.cost / freedom
        covariance = _covariance(found.jac)[:count, :count]
        deviation = np.sqrt(np.diag(covariance))
        # a model that does not fit makes the estimates less sure, one that fits by luck does not make them surer
        reach = stats.t.ppf((1 + CONFIDENCE) / 2, freedom) * deviation * math.sqrt(max(variance, 1.0))
        correlation = covariance / np.outer(deviation, deviation)
        middle = found.x[:count]
        passage = self._walked(found.x)
        return ParameterFit(
            parameters=tuple(
                Parameter(name, math.exp(at), math.exp(at - width), math.exp(min(at + width, _LARGEST)))
                for name, at, width in zip(self.names, middle, reach, strict=True)
            ),
            correlation=correlation,
            passage=passage,
            residual=(self.observation.tangential_load - passage.tangential_load)[self.compared],
            misfit=math.sqrt(variance),
            degrees_of_freedom=freedom,
            notes=(
                *_notes_on_search(found.status > 0, math.sqrt(variance)),
                *_indistinct(self.names, correlation, reach, np.abs(middle - self.start)),
            ),
        )

    def _walked(self, x: Floats) -> Passage:
        parameters = dict(zip(self.names, np.exp(x[: len(self.names)]).tolist(), strict=True))
        return passed(*self.model(parameters), self.observation, x[len(self.names) :])

    def _residuals(self, x: Floats, scale: Floats | float) -> Floats:
        off = (self.observation.tangential_load - self._walked(x).tangential_load)[self.compared]
        return np.concatenate([off / scale, x[len(self.names) :]])

    def _jacobian(self, x: Floats, scale: Floats) -> Floats:
        here = self._residuals(x, scale)
        steps = np.where(np.arange(x.size) < len(self.names), _STEP, _NODE_STEP)
        columns = [
            (self._residuals(x + step * unit, scale) - here) / step
            for step, unit in zip(steps, np.eye(x.size), strict=True)
        ]
        return np.stack(columns, axis=1)


def _notes_on_search(settled: bool, misfit: float) -> list[str]:
    notes = [] if settled else ["the search did not settle; start it again from the values found"]
    if misfit > MUCH_WORSE:
        notes.append(
            f"the model misses the data by {misfit:.3g} times their noise: it lacks something, or needs another start"
        )
    return notes


def _indistinct(names: Sequence[str], correlation: Floats, reach: Floats, moved: Floats) -> list[str]:
    told = []
    for i, first in enumerate(names):
        if moved[i] > 0.99 * _FARTHEST:
            told.append(f"{first} ran {math.exp(_FARTHEST):g} times away from its start, as far as the search goes")
        told += [
            f"these data do not tell {second} from {first} (correlation {correlation[i, j]:+.4f}); fix one of them by "
            "another measurement"
            for j, second in enumerate(names[:i])
            if abs(correlation[i, j]) > TOLD_APART
        ]
        if reach[i] > math.log(2):
            span = math.exp(2 * min(reach[i], _LARGEST / 2))
            told.append(
                f"{first} is hardly determined by these data: its interval spans a factor of {span:.3g}"
                if span < UNDETERMINED
                else f"{first} is not determined by these data"
            )
    return told


def _covariance(jacobian: Floats) -> Floats:
    """Return (JᵀJ)⁻¹, with very large variances where the residuals do not depend on an unknown."""
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, 1.0)
    _, values, directions = np.linalg.svd(jacobian / size, full_matrices=False)
    inverse = 1 / np.maximum(values, values[0] * 1e-9 + 1e-300)
    half = directions.T * inverse
    covariance: Floats = half @ half.T / np.outer(size, size)
    return covariance
