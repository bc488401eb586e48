"""From measured loops to parameters: nonlinear least squares on the exact model, and how sure the estimates are.

The model passes the measured displacements as in `observation`. The true place of each turning point, and of each step
of the normal load, is an unknown as well, held by what was measured there: the contact remembers it, noise and all. A
sample's misfit of the load is weighed by the noise of the load and that of the displacement times the stiffness there
(effective variance: Orear, *Am. J. Phys.* 50 (1982) 912-916). `search` has the least squares.

Two intervals come with each estimate. One takes what is left for independent noise of each sample. Loops of an
instrument differ by more than that, and what is left of them is correlated; so the other one, which holds then too,
goes by how the estimate wanders from loop to loop (`scatter`).
"""

import math
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np
import numpy.typing as npt

from historysim.measured import scatter
from historysim.measured.observation import Observation, Passage
from historysim.measured.power_law import CONFIDENCE
from historysim.measured.search import FARTHEST, End, Model, Search

Floats = npt.NDArray[np.float64]

TOLD_APART = 0.99
"""Correlation of two parameters above which the data do not tell them apart."""
UNDETERMINED = 1e6
"""Ratio of the ends of an interval from which on nothing is known."""
MUCH_WORSE = 3.0
"""Misfit over noise from which on the noise does not explain what is left."""
MUCH_WIDER = 3.0
"""Scatter of loops over what noise explains of it from which on a note tells it."""
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
        loop, where there are enough of them, else that of the noise alone.
    noise_low, noise_high : float
        What the interval would be if each sample had independent noise of its own, and loops did not differ.
    """

    name: str
    value: float
    low: float
    high: float
    noise_low: float = math.nan
    noise_high: float = math.nan

    def interval(self, unit: float = 1.0) -> str:
        """Return the confidence interval as a text, in a unit of that many SI units."""
        return f"95 %: {_range(self.low / unit, self.high / unit)}"

    def noise_interval(self) -> str:
        """Return what the interval would be by noise alone, as a text."""
        return _range(self.noise_low, self.noise_high)


def _range(low: float, high: float) -> str:
    return f"{low:.6g} to {high:.6g}" if high < UNDETERMINED * low else "not determined"


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
        Whether the model misses the data by much more than their noise, or the search did not settle; what the data
        cannot tell: parameters that can stand for one another, or that hardly matter; and how loops differ.
    loops_compared : int or None
        The loops, or pieces of a few loops each, that the intervals go by; None where there are too few, and the
        intervals are those of noise alone.
    """

    parameters: tuple[Parameter, ...]
    correlation: Floats
    passage: Passage
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
            noise = "" if self.loops_compared is None else f"; by noise alone {parameter.noise_interval()}"
            lines.append((parameter.name, f"{parameter.value:.6g}  ({parameter.interval()}{noise})"))
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
            return "noise alone: there are too few loops to tell how they scatter and drift, which noise does not tell"
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


def _read_off(search: Search, end: End) -> ParameterFit:
    """Return what the end of a search says: estimates, their intervals, and what the data cannot tell."""
    from scipy import stats

    names, count, observation = search.names, len(search.names), search.observation
    freedom = search.compared.size - count
    variance = float(end.residual @ end.residual) / freedom
    misfit = math.sqrt(variance)
    covariance = _covariance(end.slopes)
    deviation = np.sqrt(np.diag(covariance))
    # a model that does not fit makes the estimates less sure, one that fits by luck does not make them surer
    by_noise = stats.t.ppf((1 + CONFIDENCE) / 2, freedom) * deviation * math.sqrt(max(variance, 1.0))
    loops = _Loops.of(search, end, covariance)
    reach = by_noise if loops is None else loops.reach
    correlation = covariance / np.outer(deviation, deviation)
    middle = end.unknowns[:count]
    off = (observation.tangential_load - end.passage.tangential_load)[search.compared]
    return ParameterFit(
        parameters=tuple(
            Parameter(name, math.exp(at), *_around(at, width), *_around(at, noise))
            for name, at, width, noise in zip(names, middle, reach, by_noise, strict=True)
        ),
        correlation=correlation,
        passage=end.passage,
        residual=off,
        misfit=misfit,
        degrees_of_freedom=freedom,
        loops_compared=loops.count if loops else None,
        notes=(
            *_notes_on_search(end, misfit, off, float(np.abs(observation.tangential_load).max())),
            *_indistinct(names, correlation, reach, np.abs(middle - search.start)),
            *(loops.notes(names) if loops else ()),
        ),
    )


def _around(middle: float, width: float) -> tuple[float, float]:
    return math.exp(middle - width), math.exp(min(middle + width, _LARGEST))


def _notes_on_search(end: End, misfit: float, off: Floats, largest: float) -> list[str]:
    notes = []
    if misfit > MUCH_WORSE:
        share = 100 * math.sqrt(float(np.mean(off**2))) / largest
        notes.append(
            f"the model misses the data by {misfit:.3g} times their noise: it lacks something, or needs another start; "
            f"what is left is {share:.2g} % of the largest load. The intervals tell how far another such record would "
            "give other values, and not how far these are from those of the contact"
        )
    if not end.settled:
        notes.append("the search did not settle; start it again from the values found")
    return notes


@attrs.frozen(eq=False)
class _Loops:
    """How the loops of a record, or pieces of some of them, differ in what they say of the parameters.

    Attributes
    ----------
    reach : array (parameter)
        Half widths of the intervals, in logarithms.
    scatter, drift : array (parameter)
        Standard deviation of one piece's value, and how much of the way from the first to the last one is a straight
        line, in logarithms.
    explained : array (parameter)
        The scatter that noise explains.
    count : int
    """

    reach: Floats
    scatter: Floats
    drift: Floats
    explained: Floats
    count: int

    @classmethod
    def of(cls, search: Search, end: End, covariance: Floats) -> "_Loops | None":
        """Return how they differ; None where they are too few."""
        observation, size = search.observation, search.compared.size
        turns = observation.turns[observation.turns >= observation.first]
        bounds = np.searchsorted(search.compared, scatter.pieces(turns, observation.time.size))
        count = bounds.size - 1
        if count < scatter.FEWEST_LOOPS:
            return None
        # what each sample moves the estimates by, and what it knows of them
        influence = end.slopes[:size] @ covariance
        moves = np.add.reduceat(-influence * end.residual[:size, None], bounds[:-1])
        shares = np.add.reduceat(influence**2, bounds[:-1])
        shares = shares / shares.sum(axis=0)
        columns = list(zip(moves.T, shares.T, strict=True))
        reach = [
            scatter.critical_value(share, CONFIDENCE) * math.sqrt(scatter.wandering(move, share))
            for move, share in columns
        ]
        spread = [math.sqrt(float(np.sum(move**2 / share)) * count / (count - 1)) for move, share in columns]
        drift = [_drift(move, share) for move, share in columns]
        explained = np.sqrt(np.diag(covariance) * count)
        return cls(np.array(reach), np.array(spread), np.array(drift), explained, count)

    def notes(self, names: Sequence[str]) -> list[str]:
        told = []
        for name, spread, drift, explained in zip(names, self.scatter, self.drift, self.explained, strict=True):
            if MUCH_WIDER * explained < spread < 1:
                drifts = f", and it drifts by {100 * drift:+.2g} % along the record" if abs(drift) > 2 * spread else ""
                told.append(
                    f"{name} differs by {100 * spread:.2g} % from piece to piece, where noise alone would make "
                    f"{100 * explained:.2g} %{drifts}"
                )
        return told


def _drift(moves: Floats, share: Floats) -> float:
    """Return the rise of the straight line through the values of all pieces, from end to end."""
    middle = np.cumsum(share) - share / 2 - 0.5
    return float(middle @ moves) / float(share @ middle**2)


def _indistinct(names: Sequence[str], correlation: Floats, reach: Floats, moved: Floats) -> list[str]:
    told = []
    for i, first in enumerate(names):
        if moved[i] > 0.99 * FARTHEST:
            told.append(f"{first} ran {math.exp(FARTHEST):g} times away from its start, as far as the search goes")
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
