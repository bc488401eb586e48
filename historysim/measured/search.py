"""The least squares behind a fit: its unknowns, its residuals and their derivatives, and where the search ends.

The unknowns are the logarithms of the parameters, and how far each node is away from where it was measured, in standard
deviations of what is known of its place. A node moves the load along the branches beside it alone, for what a contact
remembers of it is wiped out soon; so that one walk tells the derivatives by every `_TOGETHER`-th node at once.

The search has two parts. On a thinned record a trust region finds its way from the start. On the whole record a few
steps of Gauss and Newton lead to the end. There each sample's derivatives are taken at that point of the model which is
the likeliest for what was measured, and not at the displacement that was read, noise and all: with the latter the
estimates of stiffnesses would be too small by the noise over the range (regression dilution: W. A. Fuller, *Measurement
Error Models* (1987)).
"""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import scalar
from historysim.errors import InputError
from historysim.measured.observation import Observation, Passage, passed

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Model = Callable[[Mapping[str, float]], tuple[Ensemble, Instrument]]

MOST_NODES = 1000
"""Turning points and steps of load up to which their places are unknowns; beyond, they are taken as measured."""
FARTHEST = math.log(1e4)
"""How far from the start the search may go, as a logarithm."""
ENOUGH_SAMPLES = 5_000
"""Samples from which on a record is thinned while the search finds its way."""
# noise moves neither node nor sample farther, in standard deviations; a model that does not fit would, to look better
_FARTHEST_NODE, _FARTHEST_SAMPLE = 5.0, 3.0
# how far from a node a sample may have been read, in standard deviations, that is on the other side of it
_AMBIGUOUS = 3.0
# the share of a branch, one over this, that may be left out for it at either end
_MOST_BESIDE = 8
_STEP, _NODE_STEP = 1e-5, 1e-3
_TOGETHER = 4
_MOST_EXACT = 150
_MOST_ROUNDS, _STEPS_OF_ROUND = 6, 4
# the last step over the standard deviation of an estimate; moves of a logarithm that leave the derivatives as they are
_NEAR, _SAME_SLOPES = 0.03, 0.01


@attrs.frozen(eq=False)
class Slopes:
    """Derivatives of the residuals, those of the samples and behind them those of the nodes' own places.

    Attributes
    ----------
    by_parameter : array (residual, parameter)
    by_node : sparse array (residual, node)
    """

    by_parameter: Floats
    by_node: "csr_array"

    def freed(self) -> tuple[Floats, Callable[[Floats], Floats]]:
        """Return what is left of the derivatives by the parameters when the nodes follow, and how these do.

        The second one gives the nodes' least squares for some residuals.
        """
        from scipy.sparse.linalg import splu

        if not self.by_node.shape[1]:
            return self.by_parameter, lambda residual: np.zeros((0, *residual.shape[1:]))
        transposed = self.by_node.T.tocsr()
        solved = splu((transposed @ self.by_node).tocsc()).solve

        def follow(residual: Floats) -> Floats:
            nodes: Floats = solved(transposed @ residual)
            return nodes

        return self.by_parameter - self.by_node @ follow(self.by_parameter), follow


@attrs.frozen(eq=False)
class End:
    """Where a search ends.

    Attributes
    ----------
    unknowns : array (parameter and node)
    passage : Passage
        What the model does there.
    residual : array (residual)
        Misfits over their noise, and nodes over what is known of their places.
    slopes : array (residual, parameter)
        Derivatives of the residuals by the parameters, the nodes following.
    settled : bool
        Whether the last step was much smaller than the intervals.
    """

    unknowns: Floats
    passage: Passage
    residual: Floats
    slopes: Floats
    settled: bool


@attrs.frozen(eq=False)
class Search:
    """The least squares of a model and an observation.

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
    def of(cls, model: Model, start: Mapping[str, float], observation: Observation) -> "Search":
        """Return the search from a start; parameters and errors as for `fitting.fit_parameters`."""
        names = tuple(start)
        logarithms = np.log([scalar(name, start[name], above=0) for name in names])
        inner = observation.nodes.size - 2
        free = inner if observation.node_deviation[1:-1].any() and inner <= MOST_NODES else 0
        compared = _compared(observation)
        if compared.size <= len(names):
            raise InputError(
                f"{compared.size} samples for {len(names)} parameters; expected more samples than parameters"
            )
        # without any noise all samples weigh alike
        load_noise = max(observation.load_noise, 1e-9 * float(np.abs(observation.tangential_load).max()))
        if load_noise == 0:
            raise InputError("the tangential load is 0 N throughout; expected a measured load to fit to")
        return cls(model, names, logarithms, observation, free, compared, load_noise)

    def ended(self, walked: Callable[[], object] = lambda: None) -> End:
        """Return where the search ends; `walked` is called after each walk along the observation."""
        told = attrs.evolve(self, model=_telling(self.model, walked))
        observation = told.observation.thinned(max(ENOUGH_SAMPLES, 20 * self.free))
        thin = attrs.evolve(told, observation=observation, compared=_compared(observation))
        # first with the nodes as they were measured: far from the end they would stand in for the parameters
        fixed = attrs.evolve(thin, free=0)
        unknowns = thin.found(np.append(fixed.found(fixed.best_start()), np.zeros(self.free)))
        if observation is not self.observation:
            unknowns = thin.last_steps(unknowns).unknowns
        return told.last_steps(unknowns)

    def best_start(self) -> Floats:
        """Return the best of the start and its neighbours a factor of ten away."""
        # far from the truth a parameter may hide behind another one, in a valley of its own
        tried = [
            self.start + step for step in itertools.product((0.0, -math.log(10), math.log(10)), repeat=len(self.names))
        ]
        return min(tried, key=lambda x: float(np.sum(self._residuals(x, self.load_noise) ** 2)))

    def found(self, unknowns: Floats) -> Floats:
        """Return where a trust region comes to."""
        from scipy.optimize import least_squares
        from scipy.sparse import csr_array, hstack

        # the exact solver leaves what has no effect where it is; the other one is for more unknowns than it can take
        exact = self.free <= _MOST_EXACT

        def jacobian(x: Floats, scale: Floats) -> "Floats | csr_array":
            slopes = self.slopes(x, scale)
            both = hstack([csr_array(slopes.by_parameter), slopes.by_node], format="csr")
            return both.toarray() if exact else both

        first = np.concatenate([self.start, np.zeros(self.free)])
        reach = np.concatenate([np.full(len(self.names), FARTHEST), np.full(self.free, _FARTHEST_NODE)])
        found: Floats = least_squares(
            self._residuals,
            unknowns,
            jacobian,
            (first - reach, first + reach),
            args=(self._scale(self._walked(unknowns)),),
            max_nfev=60,
            xtol=1e-6,
            ftol=1e-5,
            tr_solver="exact" if exact else "lsmr",
        ).x
        return found

    def last_steps(self, unknowns: Floats) -> End:
        """Return where steps of Gauss and Newton lead to from nearby, with derivatives that serve several of them."""
        count, rounds, near = len(self.names), 0, False
        while True:
            started, rounds = unknowns, rounds + 1
            passage = self._walked(unknowns)
            scale = self._scale(passage)
            residual = self._compare(passage, unknowns, scale)
            slopes = self._at_likeliest(residual, passage, scale).slopes(unknowns, scale)
            freed, follow = slopes.freed()
            # what the data do not determine stays where it is
            inverse = np.linalg.pinv(freed, rcond=1e-8)
            size = np.linalg.norm(freed, axis=0)
            step = -inverse @ residual
            for _ in range(_STEPS_OF_ROUND):
                unknowns = self._stepped(unknowns, step, follow(residual + slopes.by_parameter @ step))
                passage = self._walked(unknowns)
                residual = self._compare(passage, unknowns, scale)
                excess = math.sqrt(max(float(residual @ residual) / (self.compared.size - count), 1.0))
                # what goes to and fro is halved
                following = -inverse @ residual
                step = np.where(step * following < 0, following / 2, following)
                near = bool((size * np.abs(step) < _NEAR * excess).all())
                if near:
                    break
            settled = near and bool((np.abs(unknowns - started)[:count] < _SAME_SLOPES).all())
            if settled or rounds == _MOST_ROUNDS:
                return End(unknowns, passage, residual, freed, settled)

    def _stepped(self, x: Floats, step: Floats, nodes: Floats) -> Floats:
        """Return the unknowns after a step of the parameters, and one back of the nodes, within their bounds."""
        count = len(self.names)
        parameters = np.clip(x[:count] + np.clip(step, -1.0, 1.0), self.start - FARTHEST, self.start + FARTHEST)
        return np.concatenate([parameters, np.clip(x[count:] - nodes, -_FARTHEST_NODE, _FARTHEST_NODE)])

    def _walked(self, x: Floats) -> Passage:
        parameters = dict(zip(self.names, np.exp(x[: len(self.names)]).tolist(), strict=True))
        moved = x[len(self.names) :]
        return passed(
            *self.model(parameters), self.observation, moved * self.observation.node_deviation[1 : 1 + moved.size]
        )

    def _scale(self, passage: Passage) -> Floats:
        """Return the noise of each misfit [N]: that of the load, and of the displacement by the stiffness."""
        by_displacement = passage.stiffness[self.compared] * self.observation.displacement_noise
        noise: Floats = np.hypot(self.load_noise, by_displacement)
        return noise

    def _compare(self, passage: Passage, x: Floats, scale: Floats | float) -> Floats:
        off = (passage.tangential_load - self.observation.tangential_load)[self.compared]
        return np.concatenate([off / scale, x[len(self.names) :]])

    def _residuals(self, x: Floats, scale: Floats | float) -> Floats:
        return self._compare(self._walked(x), x, scale)

    def _at_likeliest(self, residual: Floats, passage: Passage, scale: Floats) -> "Search":
        """Return the search with its displacements where, for the model, they are the likeliest."""
        noise = self.observation.displacement_noise
        stiffness = passage.stiffness[self.compared]
        off = -residual[: self.compared.size] * stiffness * noise / scale
        displacement = self.observation.displacement.copy()
        displacement[self.compared] += noise * np.clip(off, -_FARTHEST_SAMPLE, _FARTHEST_SAMPLE)
        return attrs.evolve(self, observation=attrs.evolve(self.observation, displacement=displacement))

    def slopes(self, x: Floats, scale: Floats) -> Slopes:
        """Return the derivatives of the residuals, by differences."""
        from scipy.sparse import csr_array, eye_array, vstack

        count, here = len(self.names), self._walked(x).tangential_load[self.compared]

        def slope(change: Floats, step: float) -> Floats:
            return (self._walked(x + step * change).tangential_load[self.compared] - here) / (step * scale)

        by_parameter = np.zeros((self.compared.size + self.free, count))
        for index in range(count):
            by_parameter[: self.compared.size, index] = slope(np.eye(x.size)[index], _STEP)
        together = min(_TOGETHER, self.free)
        values, owner = np.zeros((2, self.compared.size, together))
        branch = np.searchsorted(self.observation.nodes, self.compared) - 1
        for first in range(together):
            nodes = np.arange(first, self.free, _TOGETHER)
            change = np.zeros(x.size)
            change[count + nodes] = 1.0
            # a node's own samples: from the node before it until the next one that moves with it
            number = (branch - first) // _TOGETHER
            owned = (number >= 0) & (number < nodes.size)
            owner[:, first] = np.where(owned, first + _TOGETHER * number, first)
            values[:, first] = np.where(owned, slope(change, _NODE_STEP), 0.0)
        rows = np.repeat(np.arange(self.compared.size), together)
        shape = self.compared.size, self.free
        of_samples = csr_array((values.ravel(), (rows, owner.ravel().astype(np.int64))), shape=shape)
        return Slopes(by_parameter, vstack([of_samples, eye_array(self.free)], format="csr"))


def _compared(observation: Observation) -> Integers:
    """Return the samples of which it is known on which branch they are, all but the nodes and what is beside them.

    How many samples noise may have put on the wrong side of a node goes by the mean step of the branch, and not by
    what was read: a choice by noisy numbers would make the stiffness too great.
    """
    nodes, reach = observation.nodes, _AMBIGUOUS * observation.displacement_noise
    kept = np.ones(observation.time.size, dtype=np.bool_)
    kept[: observation.first] = False
    kept[nodes] = False
    for start, end in itertools.pairwise(nodes.tolist()):
        way, count = abs(observation.displacement[end] - observation.displacement[start]), end - start
        beside = min(math.ceil(reach * count / way) if way > 0 else 0, count // _MOST_BESIDE)
        kept[start : start + beside + 1] = False
        kept[end - beside : end + 1] = False
    return np.flatnonzero(kept)


def _telling(model: Model, walked: Callable[[], object]) -> Model:
    def told(values: Mapping[str, float]) -> tuple[Ensemble, Instrument]:
        walked()
        return model(values)

    return told
