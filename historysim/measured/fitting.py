"""From measured loops to parameters: nonlinear least squares on the exact model.

The model passes the measured displacements as in `observation`. The true place of each turning point, and of each step
of the normal load, is an unknown as well, held by what was measured there: the contact remembers it, noise and all. A
sample's misfit of the load is weighed by the noise of the load and that of the displacement times the stiffness there
(effective variance: Orear, *Am. J. Phys.* 50 (1982) 912-916).
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import checked, scalar
from historysim.errors import InputError
from historysim.measured.observation import Observation, Passage, passed

Floats = npt.NDArray[np.float64]
Model = Callable[[Mapping[str, float]], tuple[Ensemble, Instrument]]

MOST_NODES = 120
"""Turning points and steps of load up to which their places are unknowns; beyond, they are taken as measured."""
TOLD_APART = 0.99
"""Correlation of two parameters above which the data do not tell them apart."""
CONFIDENCE = 0.95
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
        """Say in a few words what the confidence interval is, in a unit of that many SI units."""
        if not self.high < UNDETERMINED * self.low:
            return "95 %: not determined"
        return f"95 %: {self.low / unit:.6g} to {self.high / unit:.6g}"


@attrs.frozen(eq=False)
class Fit:
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
        """Say in a few lines what was found, how sure it is, and what the data cannot tell."""
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


def fit(model: Model, start: Mapping[str, float], observation: Observation) -> Fit:
    """Fit parameters to measured loops.

    Parameters
    ----------
    model : callable
        Takes the parameters by name and makes an ensemble and an instrument with them.
    start : mapping of str to float
        What each parameter is thought to be, > 0. The search is in logarithms, and sets out from the best of the start
        and its neighbours a factor of ten away.
    observation : Observation

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        A start that is not > 0 and finite, samples that are not more than the parameters, or no load to fit to.
    """
    from scipy import stats
    from scipy.optimize import least_squares

    names = tuple(start)
    logarithms = np.log([scalar(name, start[name], above=0) for name in names])
    inner = observation.nodes.size - 2
    free = inner if observation.displacement_noise > 0 and inner <= MOST_NODES else 0
    # a node stands for itself: a sample too early or too late, it is on another branch than it is taken for
    compared = np.setdiff1d(np.arange(observation.first, observation.time.size), observation.nodes)
    freedom = compared.size - len(names)
    if freedom < 1:
        raise InputError(f"{compared.size} samples for {len(names)} parameters; expected more samples than parameters")
    unknowns = np.concatenate([logarithms, np.zeros(free)])
    range_of = np.concatenate([np.full(len(names), _FARTHEST), np.full(free, _FARTHEST_NODE)])
    bounds = unknowns - range_of, unknowns + range_of
    # without any noise all samples weigh alike
    load_noise = max(observation.load_noise, 1e-9 * float(np.abs(observation.tangential_load).max()))
    if load_noise == 0:
        raise InputError("the tangential load is 0 N throughout; expected a measured load to fit to")

    def walked(x: Floats) -> Passage:
        contact = model(dict(zip(names, np.exp(x[: len(names)]).tolist(), strict=True)))
        return passed(*contact, observation, x[len(names) :])

    def residuals(x: Floats, scale: Floats | float) -> Floats:
        off = (observation.tangential_load - walked(x).tangential_load)[compared]
        return np.concatenate([off / scale, x[len(names) :]])

    def jacobian(x: Floats, scale: Floats) -> Floats:
        here = residuals(x, scale)
        steps = np.where(np.arange(x.size) < len(names), _STEP, _NODE_STEP)
        columns = [
            (residuals(x + step * unit, scale) - here) / step for step, unit in zip(steps, np.eye(x.size), strict=True)
        ]
        return np.stack(columns, axis=1)

    # far from the truth a parameter may hide behind another one, in a valley of its own
    tried = [
        np.concatenate([logarithms + step, np.zeros(free)])
        for step in itertools.product((0.0, -math.log(10), math.log(10)), repeat=len(names))
    ]
    unknowns = min(tried, key=lambda x: float(np.sum(residuals(x, load_noise) ** 2)))
    for _ in range(_WEIGHINGS):
        stiffness = walked(unknowns).stiffness[compared]
        scale = np.hypot(load_noise, stiffness * observation.displacement_noise)
        found = least_squares(residuals, unknowns, jacobian, bounds, args=(scale,), max_nfev=60, xtol=1e-10, ftol=1e-12)
        moved = np.abs(found.x - unknowns)[: len(names)].max()
        unknowns = found.x
        if moved < 1e-6:
            break
    best = walked(unknowns)
    variance = 2 * found.cost / freedom
    covariance = _covariance(found.jac)[: len(names), : len(names)]
    deviation = np.sqrt(np.diag(covariance))
    # a model that does not fit makes the estimates less sure, one that fits by luck does not make them surer
    reach = stats.t.ppf((1 + CONFIDENCE) / 2, freedom) * deviation * math.sqrt(max(variance, 1.0))
    correlation = covariance / np.outer(deviation, deviation)
    middle = unknowns[: len(names)]
    return Fit(
        parameters=tuple(
            Parameter(name, math.exp(at), math.exp(at - width), math.exp(min(at + width, _LARGEST)))
            for name, at, width in zip(names, middle, reach, strict=True)
        ),
        correlation=correlation,
        passage=best,
        residual=(observation.tangential_load - best.tangential_load)[compared],
        misfit=math.sqrt(variance),
        degrees_of_freedom=freedom,
        notes=(
            *_notes_on_search(found.status > 0, math.sqrt(variance)),
            *_indistinct(names, correlation, reach, np.abs(middle - logarithms)),
        ),
    )


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
    """Give (JᵀJ)⁻¹, with very large variances where the residuals do not depend on an unknown."""
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, 1.0)
    _, values, directions = np.linalg.svd(jacobian / size, full_matrices=False)
    inverse = 1 / np.maximum(values, values[0] * 1e-9 + 1e-300)
    half = directions.T * inverse
    covariance: Floats = half @ half.T / np.outer(size, size)
    return covariance


@attrs.frozen
class PowerLaw:
    """μ = factor N^exponent, with intervals of 95 % confidence.

    Attributes
    ----------
    exponent, exponent_low, exponent_high : float
        n [1]: -1/3 for a smooth ball with a constant interfacial shear strength, 0 for a rough surface.
    factor : float
        μ at 1 N [1].
    """

    exponent: float
    exponent_low: float
    exponent_high: float
    factor: float


def power_law(normal_load: npt.ArrayLike, friction: npt.ArrayLike) -> PowerLaw:
    """Fit μ = factor N^n to friction coefficients at several loads, by a straight line through the logarithms.

    Parameters
    ----------
    normal_load : array_like (load)
        N [N], > 0, three or more, not all equal.
    friction : array_like (load)
        μ [1], > 0.

    Raises
    ------
    InputError
        Numbers out of range, arrays of different lengths, too few loads, or the same load throughout.
    """
    from scipy import stats

    load, coefficient = checked("normal_load", normal_load, above=0), checked("friction", friction, above=0)
    if load.ndim != 1 or load.shape != coefficient.shape or load.size < 3:
        raise InputError(
            f"normal_load has shape {load.shape} and friction {coefficient.shape}; expected two lists of one length ≥ 3"
        )
    if np.ptp(load) == 0:
        raise InputError(f"normal_load is {load[0]:g} N throughout; expected several loads")
    line = stats.linregress(np.log(load), np.log(coefficient))
    # scipy has no standard error for the same coefficient throughout, where nothing scatters
    error = 0.0 if math.isnan(line.stderr) else float(line.stderr)
    slope, reach = float(line.slope), float(stats.t.ppf((1 + CONFIDENCE) / 2, load.size - 2)) * error
    return PowerLaw(slope, slope - reach, slope + reach, math.exp(line.intercept))
