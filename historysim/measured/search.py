"""The least squares behind a fit: its unknowns, its residuals and their derivatives, and where the search ends.

README.md of this folder, "What a fit minimises", has the sum, its correction and the order of the search.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import Booleans, Floats, Integers, scalar
from historysim.errors import InputError
from historysim.measured.comparison import ModelResponse, Observation, assign_position_bins, compute_response
from historysim.measured.reduction import MEDIAN_OF_NORMAL

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult
    from scipy.sparse import csr_array

Model = Callable[[Mapping[str, float]], tuple[Ensemble, Instrument]]

# The parameter that is added to the measured displacement [m], of either sign. The others are positive: their unknowns
# are logarithms. The unknown of the offset is such that the search goes as far as the range of the displacement.
OFFSET = "displacement_offset"
MOST_NODES = 1000  # turning points and steps of load up to which their places are unknowns
DECADES = 4  # factors of ten that a start may be off; the search scans so far on either side of it
FARTHEST = (DECADES + 1) * math.log(10)  # how far from the start the search may go, as a logarithm
_LARGEST = 700.0  # logarithm of the largest value of a parameter: that of a float
_SCANNED_OFFSETS = (-0.5, 0.0, 0.5)  # offsets that the scan tries, over the range of the displacement
FARTHEST_NODE = 5.0  # standard deviations that noise moves a node; a model that does not fit would move it farther
ENOUGH_SAMPLES = 5_000  # samples from which on a record is thinned while the search finds its way
_AMBIGUOUS = 3.0  # standard deviations from a node within which a sample may be of its other side
_MOST_BESIDE = 8  # one over the share of a branch that may be left out for it at either end
_STEP, _NODE_STEP = 1e-5, 1e-3  # of differences, by parameters and by nodes
_TOGETHER = 4  # every how many-th node is moved at once: its samples end where the next of them begin
_ROUNDING = 1e-4  # norm of a derivative, over the root of the number of samples, that is none
# The scan: samples of the record and of each branch, starts that are tried, and how far these are apart; shares of
# the samples at the loads over the normal load where friction is tried besides.
_SCANNED, _SCANNED_BRANCH, MOST_SCANNED = 200, 8, 500
_STEPS_A_DECADE, _LEVELS = (8, 4, 2, 1, 0.5, 0.25), (0.5, 0.9, 0.99)
# Valleys of a scan that are followed, how far they are apart, and how much worse they may be than the deepest.
_VALLEYS, _APART, _WORST_VALLEY = 4, 0.4 * math.log(10), 1.5
_ALIKE, _THE_SAME = 1e-3, 1e-6  # sums that are alike where their unknowns are near, and the same wherever these are
_LIKELY, _CHANCE = 11.0, 0.05  # of χ², by which two sums differ by chance, and at most over the sum
_AS_DEEP = 1e-3  # more than the deepest that an end may have, over the sum
_MOST_EXACT = 8  # nodes up to which the exact solver is taken
_MOST_ROUNDS, _NEAR = 8, 0.03  # rounds of weights, and deviations of an estimate within which they have settled
_ROOM = 100.0  # more than noise of the displacement adds for each sample: a sum of squares has no negative terms
_AT_BOUND = 1e-3  # share of the way to its bound within which a node is there
# Deviations from the median of so many neighbours, over the usual ones, from which on a sample is an outlier: Gaussian
# noise has one in 10⁸ samples.
_OUTLIER, _NEIGHBOURS = 6.0, 5
_STATIONARY = 0.1  # deviations that residuals pull a stationary estimate by
# The check of an end without derivatives: steps in deviations of estimates and nodes; the drop of the sum, over the
# number of samples, that is none; how often the search goes on from a lower place; and singular values of the slopes,
# over the largest, that are rounding.
_PATTERN, _LEAST_DROP, _MOST_DESCENTS, _NO_EFFECT = (1.0, 0.3, 0.1, 0.03), 1e-4, 4, 1e-9


@attrs.frozen(eq=False)
class ResidualSlopes:
    """Derivatives of the residuals, those of the samples and behind them those of the nodes' own places."""

    by_parameter: Floats  #: (residual, parameter)
    by_node: "csr_array"  #: (residual, node)
    #: (sample, parameter) The same of half of what noise of the displacement adds to the square of a residual.
    added: Floats
    added_by_node: "csr_array"  #: (sample, node) The same by the nodes

    def freed(self, moves: Booleans) -> tuple[Floats, Floats]:
        """Return what is left of those by the parameters when nodes follow, those that still move; of `added`, too."""
        if not moves.any():
            return self.by_parameter, self.added
        follow = self.follow(moves)
        return self.by_parameter - self.by_node @ follow, self.added - self.added_by_node @ follow

    def follow(self, moves: Booleans) -> Floats:
        """Return by how much nodes follow a parameter the other way, 0 for those that do not move (node, parameter)."""
        from scipy.sparse.linalg import splu

        result = np.zeros((moves.size, self.by_parameter.shape[1]))
        if moves.any():
            free = self.by_node[:, np.flatnonzero(moves)]
            transposed = free.T.tocsr()
            result[moves] = splu((transposed @ free).tocsc()).solve(transposed @ self.by_parameter)
        return result


@attrs.frozen(eq=False)
class SearchResult:
    """Where a search ends."""

    unknowns: Floats  #: (parameter and node)
    response: ModelResponse  #: what the model does there
    #: (residual) What is left of the load over its scale, and nodes over what is known of their places.
    residual: Floats
    slopes: Floats  #: (residual, parameter) Derivatives by the parameters; nodes follow that are not at their bounds
    #: (residual, parameter) What each residual adds to the gradient of what is minimised; over all of them this is 0.
    pull: Floats
    at_bounds: int  #: nodes that are as far from where they were measured as they may be
    scale: Floats
    noise: Floats  #: scale and noise: (sample) Weight and noise of what is left of the load [N]
    settled: bool  #: whether a minimum was found, smooth or at a kink, and the weights are those there
    spread: Floats  #: (parameter) How far other ends are from here that are as deep but for chance, as a logarithm

    @property
    def is_stationary(self) -> bool:
        """Whether the pulls of all residuals add up to nothing, in standard deviations of the estimates."""
        size = np.linalg.norm(self.slopes, axis=0)
        return bool((np.abs(self.pull.sum(axis=0)) <= _STATIONARY * np.maximum(size, 1e-300)).all())

    def at_limit(self, start: Floats) -> Booleans:
        """Return which parameters are as far from the start as a search may go."""
        limit: Booleans = np.abs(self.unknowns[: start.size] - start) > 0.99 * FARTHEST
        return limit


@attrs.frozen(eq=False)
class Search:
    """The least squares of a model and an observation."""

    model: Model
    names: tuple[str, ...]
    start: Floats  #: (parameter) Unknowns to start from: logarithms of the parameters, 0 for an offset
    observation: Observation
    free: int  #: nodes with unknown places
    compared: Integers  #: the samples that are compared
    load_noise: float  #: [N], > 0
    #: (sample) The share of the noise of the displacement that nodes do not follow: 1 less their leverage.
    left_over: Floats
    offset_start: float  #: offset of the displacement to start from [m]
    offset_unit: float  #: offset of the displacement for an unknown of 1 [m]

    @classmethod
    def of(cls, model: Model, start: Mapping[str, float], observation: Observation) -> "Search":
        """Return the search from a start."""
        names = tuple(start)
        unknowns = np.array([0.0 if name == OFFSET else math.log(scalar(name, start[name], above=0)) for name in names])
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
        return cls(
            model,
            names,
            unknowns,
            observation,
            free,
            compared,
            load_noise,
            left_over=np.ones(compared.size),
            offset_start=start.get(OFFSET, 0.0),
            offset_unit=float(np.ptp(observation.displacement)) / FARTHEST,
        )

    def values_at(self, unknowns: Floats) -> Floats:
        """Convert unknowns to the values of the parameters, (…, parameter)."""
        values: Floats = np.exp(np.minimum(unknowns, _LARGEST))
        if OFFSET in self.names:
            index = self.names.index(OFFSET)
            values[..., index] = self.offset_start + self.offset_unit * unknowns[..., index]
        return values

    def ended(self, notify: Callable[[int], object] = lambda _: None) -> SearchResult:
        """Return where the search ends; `notify` is called at each walk along the observation, with their number."""
        # what follows the scan takes about as many walks
        walks, scanned = itertools.count(1), 2 * len(self._scanned())

        def reporting_model(values: Mapping[str, float]) -> tuple[Ensemble, Instrument]:
            notify(max(scanned, next(walks)))
            return self.model(values)

        reporting = attrs.evolve(self, model=reporting_model)
        starts = reporting.thin(max(_SCANNED, _SCANNED_BRANCH * self.observation.nodes.size), free=0).starts()
        thin = reporting.thin(max(ENOUGH_SAMPLES, 20 * self.free))
        # first with the nodes as they were measured: far from the end they would stand in for the parameters
        fixed = attrs.evolve(thin, free=0)
        ends = []
        for start in starts:
            unknowns = np.append(fixed.least(start, fixed.scales(start), rough=True).x, np.zeros(self.free))
            if thin.observation is not self.observation:
                unknowns = thin.least(unknowns, thin.scales(unknowns), rough=True).x
            ends.append(reporting.checked(reporting.settled(unknowns)))
        return reporting.deepest(ends)

    def checked(self, end: SearchResult) -> SearchResult:
        """Return an end that is known to be a minimum, or not to be one: that, or a lower one nearby.

        Where the pulls of the residuals do not add up to nothing, the sum has a kink, and slopes cannot tell whether it
        is a minimum. A pattern search can.
        """
        for _ in range(_MOST_DESCENTS):
            if bool(end.at_limit(self.start).any()) or (end.settled and end.is_stationary):
                return end
            lower, drop = self._descended(end)
            if drop <= _LEAST_DROP * self.compared.size:
                return attrs.evolve(end, settled=True)
            end = self.settled(lower)
        return attrs.evolve(end, settled=end.settled and end.is_stationary)

    def _descended(self, end: SearchResult) -> tuple[Floats, float]:
        """Return the lowest unknowns that a pattern search finds around an end, and how much lower the sum is there."""
        count, scale, x = len(self.names), end.scale, end.unknowns
        search = attrs.evolve(self, left_over=self._left_over(x, scale))
        # parameters move along the axes of their covariance, and nodes that are not at their bounds follow
        _, values, axes = np.linalg.svd(end.slopes, full_matrices=False)
        known = values > _NO_EFFECT * values[0]
        moves = np.abs(x[count:]) < FARTHEST_NODE * (1 - _AT_BOUND)
        axes = axes[known] / values[known, None]
        axes = np.hstack([axes, -axes @ search.slopes(x, scale).follow(moves).T])
        reach = np.append(np.full(count, FARTHEST), np.full(self.free, FARTHEST_NODE))
        origin = np.append(self.start, np.zeros(self.free))
        terms = search.terms(x, scale)
        first = float(terms.sum())
        node = np.arange(self.free)
        branch = np.append(np.searchsorted(self.observation.nodes, self.compared) - 1, node + 1)
        for step, sign in itertools.product(_PATTERN, (1.0, -1.0)):
            for axis in axes:
                tried = np.clip(x + sign * step * axis, origin - reach, origin + reach)
                if (found := search.terms(tried, scale)).sum() < terms.sum():
                    x, terms = tried, found
            for group in range(min(_TOGETHER, self.free)):
                # nodes far from each other at once, each by what it does to its own samples
                moved = (node % _TOGETHER == group) * sign * step
                tried = np.clip(x + np.append(np.zeros(count), moved), origin - reach, origin + reach)
                owner, gain = (branch - group) // _TOGETHER, terms - search.terms(tried, scale)
                gains = np.bincount(owner[owner >= 0], gain[owner >= 0], self.free)
                better = np.append(np.ones(count, dtype=np.bool_), gains[node // _TOGETHER] > 0)
                tried = np.where(better, tried, x)
                if (found := search.terms(tried, scale)).sum() < terms.sum():
                    x, terms = tried, found
        return x, first - float(terms.sum())

    def outliers(self, end: SearchResult) -> Booleans:
        """Return which of the samples compared stand out from what an end leaves of their neighbours (sample).

        A misfit that recurs at one place of the branches is not an outlier: deviations count against those of all
        branches at that place.
        """
        from scipy.ndimage import median_filter

        residual = end.residual[: self.compared.size] * end.scale / end.noise
        local = np.abs(residual - median_filter(residual, _NEIGHBOURS, mode="mirror"))
        place = assign_position_bins(self.observation, self.compared)
        order = np.argsort(place, kind="stable")
        usual = np.zeros(place.max() + 1)
        for those in np.split(order, np.flatnonzero(np.diff(place[order])) + 1):
            usual[place[those[0]]] = np.median(local[those])
        usual = np.maximum(usual, np.median(local)) / MEDIAN_OF_NORMAL
        found: Booleans = local > _OUTLIER * np.maximum(usual, 1.0)[place]
        return found

    def without(self, outliers: Booleans) -> "Search":
        """Return the search that does not compare some of the samples."""
        compared = self.compared[~outliers]
        return attrs.evolve(self, compared=compared, left_over=np.ones(compared.size))

    def deepest(self, ends: list[SearchResult]) -> SearchResult:
        """Return the first of the deepest ends: what has no effect stays where it was.

        An end at the limit of the search is none where another is as deep but for chance.
        """
        sums = np.array([self.minimised(end.unknowns, ends[0].scale) for end in ends])
        within = np.array([not end.at_limit(self.start).any() for end in ends]) & (sums - sums.min() < _LIKELY)
        least = sums[within].min() if within.any() else sums.min()
        deepest = ends[int(np.argmax((within | ~within.any()) & (sums - least <= _AS_DEEP * abs(least))))]
        likely = [end for end, more in zip(ends, sums - sums.min(), strict=True) if more < _LIKELY]
        away = np.abs([(end.unknowns - deepest.unknowns)[: len(self.names)] for end in likely])
        return attrs.evolve(deepest, spread=away.max(axis=0))

    def thin(self, most: int, free: int | None = None) -> "Search":
        """Return the search on about so many samples, and with so many free nodes."""
        observation = self.observation.thin(most)
        compared = _compared(observation)
        thinner = attrs.evolve(self, observation=observation, compared=compared, left_over=np.ones(compared.size))
        return thinner if free is None else attrs.evolve(thinner, free=free)

    def starts(self) -> list[Floats]:
        """Return the minima that a scan of the whole range leads to, the best first.

        Far from the truth a sum of squares is flat, or has valleys of its own: what is far too stiff is rigid, and what
        hardly slides has no friction. So every parameter is scanned, and friction is besides where the loads are.
        """
        tried = np.array(self._scanned())
        sums = np.array([self._squares(x) for x in tried]) + 1e-300
        # of those that are as good but for chance the nearest: what has no effect stays where it was
        chance = 1 + max(_ALIKE, min(_LIKELY / self.compared.size, _CHANCE))
        far = np.linalg.norm(tried - self.start, axis=1)
        order = np.lexsort((far, np.maximum(sums, chance * sums.min())))
        ranked = tried[order]
        chosen = [
            x for rank, x in enumerate(ranked) if (np.abs(ranked[:rank] - x).max(axis=1, initial=0.0) > _APART).all()
        ][:_VALLEYS]
        ends = [np.asarray(self.least(x, self.scales(x), rough=True).x) for x in chosen]
        depth = np.array([self._squares(end) for end in ends]) + 1e-300
        depth /= depth.min()
        first = int(np.argmax(depth <= chance))
        followed = [first]
        for i in np.argsort(depth):
            # the same valley, or a parameter without effect
            near = [np.abs(ends[i] - ends[j]).max() < _APART and abs(depth[i] - depth[j]) < _ALIKE for j in followed]
            same = np.abs(depth[i] - depth[followed]) < _THE_SAME
            if depth[i] < _WORST_VALLEY and not np.any(near) and not same.any():
                followed.append(int(i))
        return [ends[i] for i in followed]

    def _scanned(self) -> list[Floats]:
        """Return the logarithms of the parameters that a scan tries."""
        levels, others = {0.0}, len(self.names) - (OFFSET in self.names)
        if "friction" in self.names:
            others -= 1
            at, those = self.names.index("friction"), self.compared[self.observation.normal_load[self.compared] > 0]
            shares = np.abs(self.observation.tangential_load[those]) / self.observation.normal_load[those]
            shares = np.quantile(shares, _LEVELS) if those.size else shares
            levels |= set((np.log(shares[shares > 0]) - self.start[at]).clip(-FARTHEST, FARTHEST).tolist())
        counts = [int(2 * DECADES * dense) + 1 for dense in _STEPS_A_DECADE]
        offsets = [part * FARTHEST for part in _SCANNED_OFFSETS]
        known = len(levels) * (len(offsets) if OFFSET in self.names else 1)
        count = next((count for count in counts if known * count**others <= MOST_SCANNED), counts[-1])
        steps = (np.linspace(-DECADES, DECADES, count) * math.log(10)).tolist()
        grid = {"friction": sorted(levels), OFFSET: offsets}
        return [self.start + step for step in itertools.product(*(grid.get(name, steps) for name in self.names))]

    def _squares(self, x: Floats) -> float:
        """Return the sum of squares at some parameters, all samples alike."""
        return float(np.sum(self._compare(self._walked(x), x, self.load_noise) ** 2))

    def least(self, unknowns: Floats, scale: Floats, *, rough: bool = False) -> "OptimizeResult":
        """Return the minimum near some unknowns, at some weights of the samples [N]; roughly, where near is enough."""
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

        first = np.append(self.start, np.zeros(self.free))
        reach = np.append(np.full(len(self.names), FARTHEST), np.full(self.free, FARTHEST_NODE))
        tolerance = 1e-6 if rough else 1e-10
        return least_squares(
            residuals,
            unknowns,
            jacobian,
            (first - reach, first + reach),
            max_nfev=100,
            xtol=tolerance,
            ftol=tolerance,
            # where nothing has an effect, there is no way to go
            gtol=1e-15,
            x_scale="jac",
            tr_solver="exact" if exact else "lsmr",
        )

    def settled(self, unknowns: Floats) -> SearchResult:
        """Return the minimum near some unknowns, at the weights that hold there."""
        count = len(self.names)
        for _ in range(_MOST_ROUNDS):
            scale = self.scales(unknowns)
            search = attrs.evolve(self, left_over=self._left_over(unknowns, scale))
            minimum = search.least(unknowns, scale)
            moved, unknowns = np.abs(minimum.x - unknowns)[:count], minimum.x
            slopes = search.slopes(unknowns, scale)
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
            self.noises(response),
            near and minimum.status > 0,
            np.zeros(count),
        )

    def noises(self, response: ModelResponse) -> Floats:
        """Return the noise of each residual [N]: of the load, and of the displacement times the stiffness there."""
        by_displacement = response.stiffness[self.compared] * self.observation.displacement_noise
        noise: Floats = np.hypot(self.load_noise, by_displacement)
        return noise

    def scales(self, unknowns: Floats) -> Floats:
        """Return the weight of each residual [N]: its noise, and what the model misses beyond noise.

        The latter is alike for all samples, and such that the squares add up to as many as there are samples. Without
        it, friction that scatters would count a thousand times along sliding, where noise is least, and stiffnesses
        follow it.
        """
        from scipy.optimize import brentq

        response = self._walked(unknowns)
        noise, off = self.noises(response), self._compare(response, unknowns, 1.0)[: self.compared.size]
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
        return float(self.terms(unknowns, scale).sum())

    def terms(self, unknowns: Floats, scale: Floats) -> Floats:
        """Return what each residual adds to what is minimised (residual)."""
        response = self._walked(unknowns)
        terms: Floats = self._compare(response, unknowns, scale) ** 2
        terms[: self.compared.size] -= self._added(response, scale)
        return terms

    def _walked(self, x: Floats) -> ModelResponse:
        parameters = dict(zip(self.names, self.values_at(x[: len(self.names)]).tolist(), strict=True))
        offset = parameters.get(OFFSET, self.offset_start) - self.offset_start
        shifts = self.observation.node_offset[1:-1].copy()
        shifts[: self.free] += x[len(self.names) :] * self.observation.node_deviation[1 : 1 + self.free]
        return compute_response(*self.model(parameters), self.observation, shifts, offset)

    def _compare(self, response: ModelResponse, x: Floats, scale: Floats | float) -> Floats:
        off = (response.tangential_load - self.observation.tangential_load)[self.compared]
        return np.concatenate([off / scale, x[len(self.names) :]])

    def _added(self, response: ModelResponse, scale: Floats) -> Floats:
        """Return what noise of the displacement adds to the square of each sample (sample)."""
        added = response.slope[self.compared] * self.observation.displacement_noise / scale
        squares: Floats = added**2 * self.left_over
        return squares

    def _left_over(self, x: Floats, scale: Floats) -> Floats:
        """Return the share of each sample's noise that the node before it does not follow, in moving its branch."""
        noise, left = self.observation.displacement_noise, np.ones(self.compared.size)
        if noise == 0:
            return left
        added = (self._walked(x).slope[self.compared] * noise / scale) ** 2
        node = np.searchsorted(self.observation.nodes, self.compared) - 1
        held = (noise / self.observation.node_deviation[node]) ** 2
        moves = (node >= 1) & (node <= self.free)
        left[moves] -= (added / (np.bincount(node, added)[node] + held))[moves]
        return left

    def _room(self, response: ModelResponse, scale: Floats) -> float:
        """Return the residual that takes that off: a constant, less it, is its square."""
        return math.sqrt(max(_ROOM * self.compared.size - float(self._added(response, scale).sum()), 1.0))

    def slopes(self, x: Floats, scale: Floats) -> ResidualSlopes:
        """Return the derivatives of the residuals, by differences."""
        from scipy.sparse import csr_array, eye_array, vstack

        count, compared = len(self.names), self.compared
        here = self._walked(x)
        weight = here.slope[compared] * (self.observation.displacement_noise / scale) ** 2 * self.left_over

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
    nodes, reach = observation.nodes, _AMBIGUOUS * observation.reading_noise
    kept = np.ones(observation.time.size, dtype=np.bool_)
    kept[: observation.start_sample] = False
    kept[nodes] = False
    for start, end in itertools.pairwise(nodes.tolist()):
        way, count = abs(observation.displacement[end] - observation.displacement[start]), end - start
        beside = min(math.ceil(reach * count / way) if way > 0 else 0, count // _MOST_BESIDE)
        kept[start : start + beside + 1] = False
        kept[end - beside : end + 1] = False
    return np.flatnonzero(kept)
