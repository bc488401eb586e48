"""The least squares behind a fit: its unknowns, its residuals and their derivatives, and where the search ends.

The unknowns are the logarithms of the parameters, and how far each node is away from where it was measured, in standard
deviations of what is known of its place. A node moves the load along the branches beside it alone, for what a contact
remembers of it is wiped out soon; so that one walk tells the derivatives by every `_TOGETHER`-th node at once.

What is minimised is the sum of squares over the samples, each misfit over its scale s, and over the nodes, less what
noise of the displacement adds to it: σ_u² Σ k²/s², with the model's stiffness k. The scale is the noise of the misfit,
and what the model misses beyond noise (`Search.scales`). With neither, the estimates of stiffnesses would be too small
by the noise over the range (regression dilution); with what is left of each sample in place of the known noise, as in
an orthogonal distance regression, scatter of friction would be taken for noise of the displacement, and they would be
too great (the corrected score of T. Nakamura, *Biometrika* 77 (1990) 127-137; W. A. Fuller, *Measurement Error Models*
(1987), section 2.2).

`scipy.optimize.least_squares` does the search, within bounds: on a thinned record from the start, first with the nodes
as they were measured, and then on the whole record, at weights that are those at its end.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import scalar
from historysim.basics.array_types import Booleans, Floats, Integers
from historysim.errors import InputError
from historysim.measured.observation import ModelResponse, Observation, passed

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult
    from scipy.sparse import csr_array

Model = Callable[[Mapping[str, float]], tuple[Ensemble, Instrument]]

MOST_NODES = 1000
"""Turning points and steps of load up to which their places are unknowns; beyond, they are where they are expected."""
FARTHEST = math.log(1e4)
"""How far from the start the search may go, as a logarithm."""
ENOUGH_SAMPLES = 5_000
"""Samples from which on a record is thinned while the search finds its way."""
FARTHEST_NODE = 5.0
"""Noise moves a node no farther, in standard deviations; a model that does not fit would, to look better."""
# how far from a node a sample may have been read, in standard deviations, that is on the other side of it
_AMBIGUOUS = 3.0
# the share of a branch, one over this, that may be left out for it at either end
_MOST_BESIDE = 8
_STEP, _NODE_STEP = 1e-5, 1e-3
_TOGETHER = 4
_ROUNDING = 1e-4
_MOST_EXACT = 8
_MOST_ROUNDS = 8
# what noise of the displacement adds is less than so much, for each sample; a sum of squares has no negative terms
_ROOM = 100.0
# how far the weights of the samples still move an estimate where the search ends, over its standard deviation
_NEAR = 0.03
_AT_BOUND = 1e-3


@attrs.frozen(eq=False)
class ResidualSlopes:
    """Derivatives of the residuals, those of the samples and behind them those of the nodes' own places."""

    by_parameter: Floats
    """(residual, parameter)"""
    by_node: "csr_array"
    """(residual, node)"""
    added: Floats
    """(sample, parameter) Derivatives of half of what noise of the displacement adds to the square of each sample's
    residual."""
    added_by_node: "csr_array"
    """(sample, node) The same by the nodes."""

    def freed(self, moves: Booleans) -> tuple[Floats, Floats]:
        """Return what is left of those by the parameters when nodes follow, those that still move; of `added`, too."""
        from scipy.sparse.linalg import splu

        if not moves.any():
            return self.by_parameter, self.added
        those = np.flatnonzero(moves)
        free = self.by_node[:, those]
        transposed = free.T.tocsr()
        follow = splu((transposed @ free).tocsc()).solve(transposed @ self.by_parameter)
        return self.by_parameter - free @ follow, self.added - self.added_by_node[:, those] @ follow


@attrs.frozen(eq=False)
class SearchResult:
    """Where a search ends."""

    unknowns: Floats
    """(parameter and node)"""
    response: ModelResponse
    """What the model does there."""
    residual: Floats
    """(residual) Misfits over their scales, and nodes over what is known of their places."""
    slopes: Floats
    """(residual, parameter) Derivatives of the residuals by the parameters, the nodes following that are not at their
    bounds."""
    pull: Floats
    """(residual, parameter) What each residual adds to the gradient of what is minimised; over all of them this is
    0."""
    at_bounds: int
    """Nodes that are as far from where they were measured as they may be."""
    scale: Floats
    noise: Floats
    """scale and noise: (sample) What each misfit was weighed by, and its noise [N]."""
    settled: bool
    """Whether a minimum was found, and the weights are those at this minimum."""


@attrs.frozen(eq=False)
class Search:
    """The least squares of a model and an observation."""

    model: Model
    names: tuple[str, ...]
    start: Floats
    """(parameter) Logarithms of the parameters to start from."""
    observation: Observation
    free: int
    """Nodes whose places are unknowns."""
    compared: Integers
    """The samples that are compared."""
    load_noise: float
    """[N], > 0."""

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

    def ended(self, walked: Callable[[], object] = lambda: None) -> SearchResult:
        """Return where the search ends; `walked` is called after each walk along the observation."""
        reporting = attrs.evolve(self, model=_telling(self.model, walked))
        observation = reporting.observation.thinned(max(ENOUGH_SAMPLES, 20 * self.free))
        thin = attrs.evolve(reporting, observation=observation, compared=_compared(observation))
        # first with the nodes as they were measured: far from the end they would stand in for the parameters
        fixed = attrs.evolve(thin, free=0)
        start = fixed.best_start()
        unknowns = np.append(fixed.least(start, fixed.scales(start), rough=True).x, np.zeros(self.free))
        if observation is not self.observation:
            unknowns = thin.least(unknowns, thin.scales(unknowns), rough=True).x
        return reporting.settled(unknowns)

    def best_start(self) -> Floats:
        """Return the best of the start and its neighbours a factor of ten away."""
        # far from the truth a parameter may hide behind another one, in a valley of its own
        tried = [
            self.start + step for step in itertools.product((0.0, -math.log(10), math.log(10)), repeat=len(self.names))
        ]
        return min(tried, key=lambda x: float(np.sum(self._compare(self._walked(x), x, self.load_noise) ** 2)))

    def least(self, unknowns: Floats, scale: Floats, *, rough: bool = False) -> "OptimizeResult":
        """Return the minimum that is near some unknowns, at some weights of the samples.

        Parameters
        ----------
        unknowns : array (parameter and node)
        scale : array (sample)
            [N].
        rough : bool
            Whether to be near it is enough.
        """
        from scipy.optimize import least_squares
        from scipy.sparse import csr_array, hstack, vstack

        # the exact solver leaves what has no effect where it is, though one unknown alone has an effect
        exact = self.free <= _MOST_EXACT

        def residuals(x: Floats) -> Floats:
            response = self._walked(x)
            return np.append(self._compare(response, x, scale), self._room(response, scale))

        def jacobian(x: Floats) -> "Floats | csr_array":
            slopes, room = self.slopes(x, scale), self._room(self._walked(x), scale)
            of_room = -np.append(slopes.added.sum(axis=0), slopes.added_by_node.sum(axis=0)) / room
            both = hstack([csr_array(slopes.by_parameter), slopes.by_node], format="csr")
            whole = vstack([both, csr_array(of_room[None, :])], format="csr")
            return whole.toarray() if exact else whole

        first = np.concatenate([self.start, np.zeros(self.free)])
        reach = np.concatenate([np.full(len(self.names), FARTHEST), np.full(self.free, FARTHEST_NODE)])
        tolerance = 1e-6 if rough else 1e-10
        return least_squares(
            residuals,
            unknowns,
            jacobian,
            (first - reach, first + reach),
            max_nfev=100,
            xtol=tolerance,
            ftol=tolerance,
            gtol=None,
            x_scale="jac",
            tr_solver="exact" if exact else "lsmr",
        )

    def settled(self, unknowns: Floats) -> SearchResult:
        """Return the minimum that is near some unknowns, at the weights that hold there."""
        count = len(self.names)
        for _ in range(_MOST_ROUNDS):
            scale = self.scales(unknowns)
            minimum = self.least(unknowns, scale)
            moved, unknowns = np.abs(minimum.x - unknowns)[:count], minimum.x
            slopes = self.slopes(unknowns, scale)
            moves = np.abs(unknowns[count:]) < FARTHEST_NODE * (1 - _AT_BOUND)
            freed, added = slopes.freed(moves)
            response = self._walked(unknowns)
            residual = self._compare(response, unknowns, scale)
            excess = math.sqrt(max(float(residual @ residual) / (self.compared.size - count), 1.0))
            near = bool((np.linalg.norm(freed, axis=0) * moved < _NEAR * excess).all())
            if near:
                break
        pull = freed * residual[:, None]
        pull[: self.compared.size] -= added
        return SearchResult(
            unknowns,
            response,
            residual,
            freed,
            pull,
            int((~moves).sum()),
            scale,
            self.noises(unknowns),
            near and minimum.status > 0,
        )

    def noises(self, unknowns: Floats) -> Floats:
        """Return the noise of each misfit [N]: that of the load, and of the displacement by the stiffness there."""
        by_displacement = self._walked(unknowns).stiffness[self.compared] * self.observation.displacement_noise
        noise: Floats = np.hypot(self.load_noise, by_displacement)
        return noise

    def scales(self, unknowns: Floats) -> Floats:
        """Return what each misfit is weighed by [N]: its noise, and what the model misses beyond noise.

        The latter is alike for all samples, and such that the squares add up to as many as there are samples. Without
        it, friction that scatters would count a thousand times along sliding, where noise is least, and stiffnesses
        follow it.
        """
        from scipy.optimize import brentq

        noise = self.noises(unknowns)
        off = self._compare(self._walked(unknowns), unknowns, 1.0)[: self.compared.size]
        freedom = self.compared.size - len(self.names)

        def excess(missed: float) -> float:
            return float(np.sum(off**2 / (noise**2 + missed**2))) / freedom - 1

        if not excess(0.0) > 0:
            return noise
        # without noise it is the root itself, but for rounding
        most = (1 + 1e-6) * float(np.linalg.norm(off)) / math.sqrt(freedom)
        return np.hypot(noise, float(brentq(excess, 0.0, most, xtol=1e-9 * most)))

    def minimised(self, unknowns: Floats, scale: Floats) -> float:
        """Return what is minimised: the sum of squares, less what noise of the displacement adds to it."""
        response = self._walked(unknowns)
        residual = self._compare(response, unknowns, scale)
        return float(residual @ residual) - self._added(response, scale)

    def _walked(self, x: Floats) -> ModelResponse:
        parameters = dict(zip(self.names, np.exp(x[: len(self.names)]).tolist(), strict=True))
        shifts = self.observation.node_offset[1:-1].copy()
        shifts[: self.free] += x[len(self.names) :] * self.observation.node_deviation[1 : 1 + self.free]
        return passed(*self.model(parameters), self.observation, shifts)

    def _compare(self, response: ModelResponse, x: Floats, scale: Floats | float) -> Floats:
        off = (response.tangential_load - self.observation.tangential_load)[self.compared]
        return np.concatenate([off / scale, x[len(self.names) :]])

    def _added(self, response: ModelResponse, scale: Floats) -> float:
        """Return what noise of the displacement adds to the sum of squares."""
        added = response.slope[self.compared] * self.observation.displacement_noise / scale
        return float(added @ added)

    def _room(self, response: ModelResponse, scale: Floats) -> float:
        """Return the residual that takes that off: a constant, less it, is its square."""
        return math.sqrt(max(_ROOM * self.compared.size - self._added(response, scale), 1.0))

    def slopes(self, x: Floats, scale: Floats) -> ResidualSlopes:
        """Return the derivatives of the residuals, by differences."""
        from scipy.sparse import csr_array, eye_array, vstack

        count, compared = len(self.names), self.compared
        here = self._walked(x)
        weight = here.slope[compared] * (self.observation.displacement_noise / scale) ** 2

        def differences(change: Floats, step: float) -> tuple[Floats, Floats]:
            there = self._walked(x + step * change)
            load, slope = there.tangential_load - here.tangential_load, there.slope - here.slope
            return load[compared] / (step * scale), weight * slope[compared] / step

        by_parameter = np.zeros((compared.size + self.free, count))
        added = np.zeros((compared.size, count))
        for index in range(count):
            load, more = differences(np.eye(x.size)[index], _STEP)
            # rounding is no effect
            if np.linalg.norm(load) > _ROUNDING * math.sqrt(compared.size):
                by_parameter[: compared.size, index], added[:, index] = load, more
        together = min(_TOGETHER, self.free)
        loads, more, owner = np.zeros((3, compared.size, together))
        branch = np.searchsorted(self.observation.nodes, compared) - 1
        for first in range(together):
            nodes = np.arange(first, self.free, _TOGETHER)
            change = np.zeros(x.size)
            change[count + nodes] = 1.0
            # a node's own samples: from the node before it until the next one that moves with it
            number = (branch - first) // _TOGETHER
            owned = (number >= 0) & (number < nodes.size)
            owner[:, first] = np.where(owned, first + _TOGETHER * number, first)
            loads[:, first], more[:, first] = np.where(owned, differences(change, _NODE_STEP), 0.0)
        places = np.repeat(np.arange(compared.size), together), owner.ravel().astype(np.int64)
        of_samples, added_by_node = (
            csr_array((values.ravel(), places), shape=(compared.size, self.free)) for values in (loads, more)
        )
        by_node = vstack([of_samples, eye_array(self.free)], format="csr")
        return ResidualSlopes(by_parameter, by_node, added, added_by_node)


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
    def reporting(values: Mapping[str, float]) -> tuple[Ensemble, Instrument]:
        walked()
        return model(values)

    return reporting
