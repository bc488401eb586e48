"""Least squares of a fit: unknowns, residuals, their derivatives, and the search for the minimum.

README.md of this folder, "What a fit minimises", defines the objective and the steps of the search.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.asperities.body import Body
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import Booleans, Floats, Integers, scalar
from historysim.errors import InputError
from historysim.measured.observation import Observation
from historysim.measured.reduction import MEDIAN_OF_NORMAL
from historysim.measured.residuals import assign_position_bins
from historysim.measured.response import LEAST_NOISE, ModelResponse, compute_response

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult
    from scipy.sparse import csr_array

Model = Callable[[Mapping[str, float]], tuple[Body, Instrument]]

# Parameter added to the measured displacement [m], of either sign. The others are positive: their
# unknowns are logarithms. The unknown of the offset is scaled so that the search covers the range
# of the displacement.
OFFSET = "displacement_offset"
MOST_NODES = 1000  # turning points and steps of load up to which their displacements are unknowns
# factors of ten by which a start may be off: the range of the scan on either side of it
DECADES = 4
FARTHEST = (DECADES + 1) * math.log(10)  # largest distance from the start, as a logarithm
_LARGEST = 700.0  # logarithm of the largest value of a parameter: the largest float
_SCANNED_OFFSETS = (-0.5, 0.0, 0.5)  # offsets in the scan, over the range of the displacement
# bound of a node in standard deviations; a model that does not fit would move it farther
FARTHEST_NODE = 5.0
ENOUGH_SAMPLES = 5_000  # samples above which a record is thinned for the first part of the search
# standard deviations from a node within which a sample may belong to the branch on its other side
_AMBIGUOUS = 3.0
_MOST_BESIDE = 8  # one over the largest fraction of a branch excluded for that reason at either end
_STEP, _NODE_STEP = 1e-5, 1e-3  # steps of finite differences, by parameters and by nodes
_TOGETHER = 4  # every n-th node moves in one evaluation: the samples they affect do not overlap
# norm of a derivative, over the root of the number of samples, that counts as zero
_ROUNDING = 1e-4
# The scan: samples of the record and of each branch, largest number of starts, and steps per
# decade; quantiles of tangential over normal load that are tried for friction as well.
_SCANNED, _SCANNED_BRANCH, MOST_SCANNED = 200, 8, 500
_STEPS_A_DECADE, _LEVELS = (8, 4, 2, 1, 0.5, 0.25), (0.5, 0.9, 0.99)
# Valleys of a scan that are followed, their least distance, and their largest depth over that of
# the deepest.
_VALLEYS, _APART, _WORST_VALLEY = 4, 0.4 * math.log(10), 1.5
# Relative difference of sums up to which nearby minima are one, and up to which any two minima are.
_ALIKE, _THE_SAME = 1e-3, 1e-6
_LIKELY, _CHANCE = 11.0, 0.05  # difference of χ² by chance, and its largest value over the sum
_AS_DEEP = 1e-3  # excess over the deepest minimum, over the sum, up to which another is as deep
_MOST_EXACT = 8  # nodes up to which the exact solver is used
# rounds of weights, and change of an estimate in deviations below which they converged
_MOST_ROUNDS, _NEAR = 8, 0.03
_ROOM = 100.0  # more than the noise bias of a sample: a sum of squares has no negative terms
# distance of a node from its bound, over the bound, within which it is at the bound
_AT_BOUND = 1e-3
# Deviations from the median of so many neighbours, over the usual ones, above which a sample is an
# outlier: Gaussian noise has one in 10⁸ samples.
_OUTLIER, _NEIGHBOURS = 6.0, 5
_REMEMBERED = 2  # responses that a search keeps
_STATIONARY = 0.1  # gradient, in standard errors of an estimate, up to which a result is stationary
# The pattern search: steps in standard errors of estimates and nodes; decrease of the objective,
# over the number of samples, that is negligible; largest number of restarts from a lower point; and
# singular values of the slopes, over the largest, that are rounding.
_PATTERN, _LEAST_DROP, _MOST_DESCENTS, _NO_EFFECT = (1.0, 0.3, 0.1, 0.03), 1e-4, 12, 1e-9


@attrs.frozen(eq=False)
class ResidualSlopes:
    """Derivatives of the residuals: rows of the samples, then rows of the node displacements."""

    by_parameter: Floats  #: (residual, parameter)
    by_node: "csr_array"  #: (residual, node)
    #: (sample, parameter) Derivatives of half the noise bias of the square of a residual.
    bias: Floats
    bias_by_node: "csr_array"  #: (sample, node) Likewise by the nodes

    def project_out_nodes(self, moves: Booleans) -> tuple[Floats, Floats]:
        """Project the moving nodes out of the derivatives by parameters; also out of `bias`."""
        if not moves.any():
            return self.by_parameter, self.bias
        follow = self.follow(moves)
        return self.by_parameter - self.by_node @ follow, self.bias - self.bias_by_node @ follow

    def follow(self, moves: Booleans) -> Floats:
        """Return the negative response of nodes to each parameter, 0 for fixed ones (node, parameter)."""
        from scipy.sparse.linalg import splu

        result = np.zeros((moves.size, self.by_parameter.shape[1]))
        if moves.any():
            free = self.by_node[:, np.flatnonzero(moves)]
            transposed = free.T.tocsr()
            result[moves] = splu((transposed @ free).tocsc()).solve(transposed @ self.by_parameter)
        return result


@attrs.frozen(eq=False)
class SearchResult:
    """Result of a search."""

    unknowns: Floats  #: (parameter and node)
    response: ModelResponse  #: response of the model with these unknowns
    #: (residual) Residuals of the load over their scale, and node shifts over their standard
    #: deviation.
    residual: Floats
    #: (residual, parameter) Derivatives by the parameters; nodes within their bounds follow
    slopes: Floats
    #: (residual, parameter) Contribution of each residual to the gradient of the objective; their
    #: sum is 0.
    pull: Floats
    at_bounds: int  #: number of nodes at their bounds
    scale: Floats
    noise: Floats  #: scale and noise: (sample) Weight and noise of the load residuals [N]
    converged: bool  #: whether a minimum was found, smooth or at a kink, with converged weights
    #: (parameter) Distance of other minima that are as deep but for chance, as a logarithm
    spread: Floats

    @property
    def is_stationary(self) -> bool:
        """True if the gradient is zero to within a fraction of the standard errors of the estimates."""
        size = np.linalg.norm(self.slopes, axis=0)
        return bool((np.abs(self.pull.sum(axis=0)) <= _STATIONARY * np.maximum(size, 1e-300)).all())

    def at_limit(self, start: Floats) -> Booleans:
        """Return which parameters are at the limit of the search (parameter)."""
        limit: Booleans = np.abs(self.unknowns[: start.size] - start) > 0.99 * FARTHEST
        return limit


@attrs.frozen(eq=False)
class Search:
    """Least squares problem of a model and an observation."""

    model: Model
    names: tuple[str, ...]
    #: (parameter) Unknowns to start from: logarithms of the parameters, 0 for an offset
    start: Floats
    observation: Observation
    free: int  #: number of nodes whose displacements are unknowns
    compared: Integers  #: the samples that are compared
    load_noise: float  #: [N], > 0
    #: (sample) Fraction of the displacement noise that nodes do not follow: 1 less their leverage.
    noise_fraction: Floats
    offset_start: float  #: offset of the displacement to start from [m]
    offset_unit: float  #: offset of the displacement for an unknown of 1 [m]
    #: the last responses by their unknowns: residuals, slopes and weights are found at the same ones
    _responses: dict[bytes, ModelResponse] = attrs.field(factory=dict, init=False)

    @classmethod
    def from_start(
        cls, model: Model, start: Mapping[str, float], observation: Observation
    ) -> "Search":
        """Build the search from a start."""
        names = tuple(start)
        unknowns = np.array(
            [
                0.0 if name == OFFSET else math.log(scalar(name, start[name], above=0))
                for name in names
            ]
        )
        inner = observation.nodes.size - 2
        free = inner if observation.node_deviation[1:-1].any() and inner <= MOST_NODES else 0
        compared = _select_samples(observation)
        if compared.size <= len(names):
            raise InputError(
                f"{compared.size} samples for {len(names)} parameters; expected more samples than parameters"
            )
        # without noise all samples have equal weights
        load_noise = max(
            observation.load_noise, LEAST_NOISE * float(np.abs(observation.tangential_load).max())
        )
        if load_noise == 0:
            raise InputError(
                "the tangential load is 0 N throughout; expected a measured load to fit to"
            )
        return cls(
            model,
            names,
            unknowns,
            observation,
            free,
            compared,
            load_noise,
            noise_fraction=np.ones(compared.size),
            offset_start=start.get(OFFSET, 0.0),
            offset_unit=float(np.ptp(observation.displacement)) / FARTHEST,
        )

    def to_values(self, unknowns: Floats) -> Floats:
        """Convert unknowns to the values of the parameters, (…, parameter)."""
        values: Floats = np.exp(np.minimum(unknowns, _LARGEST))
        if OFFSET in self.names:
            index = self.names.index(OFFSET)
            values[..., index] = self.offset_start + self.offset_unit * unknowns[..., index]
        return values

    def solve(self, notify: Callable[[int], object] = lambda _: None) -> SearchResult:
        """Find the minimum; `notify` is called at each replay of the observation, with their estimated number."""
        # the steps after the scan need about as many replays
        walks = itertools.count(1)
        scanned = 2 * len(self._scan_grid())

        def reporting_model(values: Mapping[str, float]) -> tuple[Body, Instrument]:
            notify(max(scanned, next(walks)))
            return self.model(values)

        reporting = attrs.evolve(self, model=reporting_model)
        find_starts = reporting.thin(
            max(_SCANNED, _SCANNED_BRANCH * self.observation.nodes.size), free=0
        ).find_starts()
        thin = reporting.thin(max(ENOUGH_SAMPLES, 20 * self.free))
        # first with the measured nodes: far from the minimum they would compensate for wrong
        # parameters
        fixed = attrs.evolve(thin, free=0)
        results = []
        for start in find_starts:
            unknowns = np.append(
                fixed.minimise(start, fixed.scales(start), rough=True).x, np.zeros(self.free)
            )
            if thin.observation is not self.observation:
                unknowns = thin.minimise(unknowns, thin.scales(unknowns), rough=True).x
            results.append(reporting.verify_minimum(reporting.minimise_reweighted(unknowns)))
        return reporting.select_best(results)

    def verify_minimum(self, result: SearchResult) -> SearchResult:
        """Return a result with its convergence verified, or a lower one nearby.

        Where the gradient is not zero, the objective has a kink, and slopes do not show whether it
        is a minimum. A pattern search does. Nodes may continue to move at estimates that do not.
        """
        for _ in range(_MOST_DESCENTS):
            if bool(result.at_limit(self.start).any()) or (
                result.converged and result.is_stationary
            ):
                return result
            lower, drop = self._pattern_search(result)
            if drop <= _LEAST_DROP * self.compared.size:
                return attrs.evolve(result, converged=True)
            before = result.unknowns[: len(self.names)]
            result = self.minimise_reweighted(lower)
            moved = np.abs(result.unknowns[: len(self.names)] - before) * np.linalg.norm(
                result.slopes, axis=0
            )
            if (moved <= _STATIONARY).all():
                return attrs.evolve(result, converged=True)
        return attrs.evolve(result, converged=result.converged and result.is_stationary)

    def _pattern_search(self, result: SearchResult) -> tuple[Floats, float]:
        """Return the lowest unknowns of a pattern search around a result, and the decrease of the objective."""
        count = len(self.names)
        scale = result.scale
        x = result.unknowns
        search = attrs.evolve(self, noise_fraction=self._noise_fraction(x, scale))
        # parameters move along the axes of their covariance, and nodes within their bounds follow
        _, values, axes = np.linalg.svd(result.slopes, full_matrices=False)
        significant = values > _NO_EFFECT * values[0]
        moves = np.abs(x[count:]) < FARTHEST_NODE * (1 - _AT_BOUND)
        axes = axes[significant] / values[significant, None]
        axes = np.hstack([axes, -axes @ search.slopes(x, scale).follow(moves).T])
        reach = np.append(np.full(count, FARTHEST), np.full(self.free, FARTHEST_NODE))
        origin = np.append(self.start, np.zeros(self.free))
        terms = search.terms(x, scale)
        initial_sum = float(terms.sum())
        node = np.arange(self.free)
        branch = np.append(np.searchsorted(self.observation.nodes, self.compared) - 1, node + 1)
        for step, sign in itertools.product(_PATTERN, (1.0, -1.0)):
            for axis in axes:
                tried = np.clip(x + sign * step * axis, origin - reach, origin + reach)
                if (trial_terms := search.terms(tried, scale)).sum() < terms.sum():
                    x, terms = tried, trial_terms
            for group in range(min(_TOGETHER, self.free)):
                # move distant nodes simultaneously; each is accepted by its effect on the samples
                # it affects
                moved = (node % _TOGETHER == group) * sign * step
                tried = np.clip(
                    x + np.append(np.zeros(count), moved), origin - reach, origin + reach
                )
                owner = (branch - group) // _TOGETHER
                gain = terms - search.terms(tried, scale)
                gains = np.bincount(owner[owner >= 0], gain[owner >= 0], self.free)
                better = np.append(np.ones(count, dtype=np.bool_), gains[node // _TOGETHER] > 0)
                tried = np.where(better, tried, x)
                if (trial_terms := search.terms(tried, scale)).sum() < terms.sum():
                    x, terms = tried, trial_terms
        return x, initial_sum - float(terms.sum())

    def find_outliers(self, result: SearchResult) -> Booleans:
        """Return the samples whose residual differs from its neighbours (sample).

        A residual that recurs at one position of the branches is not an outlier: deviations are
        relative to those of all branches at that position.
        """
        from scipy.ndimage import median_filter

        residual = result.residual[: self.compared.size] * result.scale / result.noise
        local = np.abs(residual - median_filter(residual, _NEIGHBOURS, mode="mirror"))
        position_bin = assign_position_bins(self.observation, self.compared)
        order = np.argsort(position_bin, kind="stable")
        usual = np.zeros(position_bin.max() + 1)
        for members in np.split(order, np.flatnonzero(np.diff(position_bin[order])) + 1):
            usual[position_bin[members[0]]] = np.median(local[members])
        usual = np.maximum(usual, np.median(local)) / MEDIAN_OF_NORMAL
        outliers: Booleans = local > _OUTLIER * np.maximum(usual, 1.0)[position_bin]
        return outliers

    def without(self, outliers: Booleans) -> "Search":
        """Return the search without the given samples."""
        compared = self.compared[~outliers]
        return attrs.evolve(self, compared=compared, noise_fraction=np.ones(compared.size))

    def select_best(self, results: list[SearchResult]) -> SearchResult:
        """Return the first of the deepest minima: a parameter without effect keeps its start.

        A result at the limit of the search is discarded if another is as deep but for chance.
        """
        sums = np.array([self.objective(result.unknowns, results[0].scale) for result in results])
        within = np.array([not result.at_limit(self.start).any() for result in results]) & (
            sums - sums.min() < _LIKELY
        )
        lowest = sums[within].min() if within.any() else sums.min()
        best = results[
            int(np.argmax((within | ~within.any()) & (sums - lowest <= _AS_DEEP * abs(lowest))))
        ]
        likely = [
            result
            for result, excess in zip(results, sums - sums.min(), strict=True)
            if excess < _LIKELY
        ]
        distance = np.abs(
            [(result.unknowns - best.unknowns)[: len(self.names)] for result in likely]
        )
        return attrs.evolve(best, spread=distance.max(axis=0))

    def thin(self, sample_count: int, free: int | None = None) -> "Search":
        """Return the search on about `sample_count` samples, and with `free` free nodes if given."""
        observation = self.observation.thin(sample_count)
        compared = _select_samples(observation)
        thinner = attrs.evolve(
            self, observation=observation, compared=compared, noise_fraction=np.ones(compared.size)
        )
        return thinner if free is None else attrs.evolve(thinner, free=free)

    def find_starts(self) -> list[Floats]:
        """Return the minima that a scan of the whole range leads to, the best first.

        Far from the solution the sum of squares is flat or has other valleys: a contact that is
        much too stiff acts as rigid, and one that hardly slides does not show friction. So every
        parameter is scanned, and friction also at ratios of the measured loads.
        """
        tried = np.array(self._scan_grid())
        sums = np.array([self._sum_squares(x) for x in tried]) + 1e-300
        # among starts that are as good but for chance prefer the nearest: a parameter without
        # effect keeps its start
        chance = 1 + max(_ALIKE, min(_LIKELY / self.compared.size, _CHANCE))
        far = np.linalg.norm(tried - self.start, axis=1)
        order = np.lexsort((far, np.maximum(sums, chance * sums.min())))
        ranked = tried[order]
        chosen = [
            x
            for rank, x in enumerate(ranked)
            if (np.abs(ranked[:rank] - x).max(axis=1, initial=0.0) > _APART).all()
        ][:_VALLEYS]
        minima = [np.asarray(self.minimise(x, self.scales(x), rough=True).x) for x in chosen]
        depth = np.array([self._sum_squares(minimum) for minimum in minima]) + 1e-300
        depth /= depth.min()
        best = int(np.argmax(depth <= chance))
        followed = [best]
        for i in np.argsort(depth):
            # the same valley, or a parameter without effect
            near = [
                np.abs(minima[i] - minima[j]).max() < _APART and abs(depth[i] - depth[j]) < _ALIKE
                for j in followed
            ]
            same = np.abs(depth[i] - depth[followed]) < _THE_SAME
            if depth[i] < _WORST_VALLEY and not np.any(near) and not same.any():
                followed.append(int(i))
        return [minima[i] for i in followed]

    def _scan_grid(self) -> list[Floats]:
        """Return the unknowns that a scan tries."""
        levels = {0.0}
        other_count = len(self.names) - (OFFSET in self.names)
        if "friction" in self.names:
            other_count -= 1
            index = self.names.index("friction")
            pressed = self.compared[self.observation.normal_load[self.compared] > 0]
            ratios = (
                np.abs(self.observation.tangential_load[pressed])
                / self.observation.normal_load[pressed]
            )
            ratios = np.quantile(ratios, _LEVELS) if pressed.size else ratios
            levels |= set(
                (np.log(ratios[ratios > 0]) - self.start[index]).clip(-FARTHEST, FARTHEST).tolist()
            )
        counts = [int(2 * DECADES * dense) + 1 for dense in _STEPS_A_DECADE]
        offsets = [fraction * FARTHEST for fraction in _SCANNED_OFFSETS]
        fixed_count = len(levels) * (len(offsets) if OFFSET in self.names else 1)
        count = next(
            (count for count in counts if fixed_count * count**other_count <= MOST_SCANNED),
            counts[-1],
        )
        steps = (np.linspace(-DECADES, DECADES, count) * math.log(10)).tolist()
        grid = {"friction": sorted(levels), OFFSET: offsets}
        return [
            self.start + step
            for step in itertools.product(*(grid.get(name, steps) for name in self.names))
        ]

    def _sum_squares(self, x: Floats) -> float:
        """Compute the sum of squares at some parameters with equal weights."""
        return float(np.sum(self._compare(self._compute_response(x), x, self.load_noise) ** 2))

    def minimise(self, unknowns: Floats, scale: Floats, *, rough: bool = False) -> "OptimizeResult":
        """Minimise from some unknowns at fixed weights of the samples [N], with a loose tolerance if `rough`."""
        from scipy.optimize import least_squares
        from scipy.sparse import csr_array, hstack, vstack

        # the exact solver does not move unknowns without effect, even if only one unknown has an
        # effect
        exact = self.free <= _MOST_EXACT

        def residuals(x: Floats) -> Floats:
            response = self._compute_response(x)
            return np.append(
                self._compare(response, x, scale), self._positivity_shift(response, scale)
            )

        def jacobian(x: Floats) -> "Floats | csr_array":
            slopes = self.slopes(x, scale)
            shift = self._positivity_shift(self._compute_response(x), scale)
            shift_slopes = (
                -np.append(slopes.bias.sum(axis=0), slopes.bias_by_node.sum(axis=0)) / shift
            )
            samples_and_nodes = hstack(
                [csr_array(slopes.by_parameter), slopes.by_node], format="csr"
            )
            matrix = vstack([samples_and_nodes, csr_array(shift_slopes[None, :])], format="csr")
            return matrix.toarray() if exact else matrix

        centre = np.append(self.start, np.zeros(self.free))
        reach = np.append(np.full(len(self.names), FARTHEST), np.full(self.free, FARTHEST_NODE))
        tolerance = 1e-6 if rough else 1e-10
        return least_squares(
            residuals,
            unknowns,
            jacobian,
            (centre - reach, centre + reach),
            max_nfev=100,
            xtol=tolerance,
            ftol=tolerance,
            # without any effect the gradient is zero
            gtol=1e-15,
            x_scale="jac",
            tr_solver="exact" if exact else "lsmr",
        )

    def minimise_reweighted(self, unknowns: Floats) -> SearchResult:
        """Find the minimum near some unknowns, with the weights that apply there."""
        count = len(self.names)
        for _ in range(_MOST_ROUNDS):
            scale = self.scales(unknowns)
            search = attrs.evolve(self, noise_fraction=self._noise_fraction(unknowns, scale))
            minimum = search.minimise(unknowns, scale)
            changes = np.abs(minimum.x - unknowns)[:count]
            unknowns = minimum.x
            slopes = search.slopes(unknowns, scale)
            moves = np.abs(unknowns[count:]) < FARTHEST_NODE * (1 - _AT_BOUND)
            projected, bias = slopes.project_out_nodes(moves)
            response = self._compute_response(unknowns)
            residual = self._compare(response, unknowns, scale)
            excess = math.sqrt(max(float(residual @ residual) / (self.compared.size - count), 1.0))
            converged = bool((np.linalg.norm(projected, axis=0) * changes < _NEAR * excess).all())
            if converged:
                break
        pull = projected * residual[:, None]
        pull[: self.compared.size] -= bias
        return SearchResult(
            unknowns,
            response,
            residual,
            projected,
            pull,
            int((~moves).sum()),
            scale,
            self.noises(response),
            converged and minimum.status > 0,
            np.zeros(count),
        )

    def noise_change(self, result: SearchResult, random: np.random.Generator) -> Floats:
        """Compute how residuals change by as much noise again on all channels, nodes as read (sample)."""
        noisy = self.observation.add_noise(random)
        residual, noisy_residual = (
            self._replay(
                result.unknowns, observation, observation.node_offset[1:-1]
            ).tangential_load
            - observation.tangential_load
            for observation in (self.observation, noisy)
        )
        change = (noisy_residual - residual)[self.compared] / result.scale
        # samples that are now beside a turning point may be on the other branch
        change[~np.isin(self.compared, _select_samples(noisy))] = 0.0
        return change

    def noises(self, response: ModelResponse) -> Floats:
        """Compute the noise of each residual [N]: of the load, and of the displacement times the stiffness."""
        by_displacement = response.stiffness[self.compared] * self.observation.displacement_noise
        noise: Floats = np.hypot(self.load_noise, by_displacement)
        return noise

    def scales(self, unknowns: Floats) -> Floats:
        """Compute the weight of each residual [N]: its noise, and the error of the model beyond noise.

        The error of the model is equal for all samples, such that the weighted squares add up to
        the number of samples. Without it, friction that scatters would have a thousand times the
        weight in sliding, where noise is least, and would distort the stiffnesses.
        """
        from scipy.optimize import brentq

        response = self._compute_response(unknowns)
        noise = self.noises(response)
        residual = self._compare(response, unknowns, 1.0)[: self.compared.size]
        freedom = self.compared.size - len(self.names)

        def excess(model_error: float) -> float:
            return float(np.sum(residual**2 / (noise**2 + model_error**2))) / freedom - 1

        if not excess(0.0) > 0:
            return noise
        # without noise the upper bound is the root, but for rounding
        upper = (1 + 1e-6) * float(np.linalg.norm(residual)) / math.sqrt(freedom)
        return np.hypot(noise, float(brentq(excess, 0.0, upper, xtol=1e-9 * upper)))

    def objective(self, unknowns: Floats, scale: Floats) -> float:
        """Compute the objective: the sum of squares, less the part due to noise of the displacement."""
        return float(self.terms(unknowns, scale).sum())

    def terms(self, unknowns: Floats, scale: Floats) -> Floats:
        """Compute the contribution of each residual to the objective (residual)."""
        response = self._compute_response(unknowns)
        terms: Floats = self._compare(response, unknowns, scale) ** 2
        terms[: self.compared.size] -= self._noise_bias(response, scale)
        return terms

    def _compute_response(self, x: Floats) -> ModelResponse:
        if (known := self._responses.get(x.tobytes())) is not None:
            return known
        shifts = self.observation.node_offset[1:-1].copy()
        shifts[: self.free] += (
            x[len(self.names) :] * self.observation.node_deviation[1 : 1 + self.free]
        )
        while len(self._responses) >= _REMEMBERED:
            del self._responses[next(iter(self._responses))]
        response = self._replay(x, self.observation, shifts)
        return self._responses.setdefault(x.tobytes(), response)

    def _replay(self, x: Floats, observation: Observation, shifts: Floats) -> ModelResponse:
        values = self.to_values(x[: len(self.names)]).tolist()
        parameters = dict(zip(self.names, values, strict=True))
        offset = parameters.get(OFFSET, self.offset_start) - self.offset_start
        return compute_response(*self.model(parameters), observation, shifts, offset)

    def _compare(self, response: ModelResponse, x: Floats, scale: Floats | float) -> Floats:
        residual = (response.tangential_load - self.observation.tangential_load)[self.compared]
        return np.concatenate([residual / scale, x[len(self.names) :]])

    def _noise_bias(self, response: ModelResponse, scale: Floats) -> Floats:
        """Compute the contribution of displacement noise to the square of each sample (sample)."""
        noise = response.slope[self.compared] * self.observation.displacement_noise / scale
        squares: Floats = noise**2 * self.noise_fraction
        return squares

    def _noise_fraction(self, x: Floats, scale: Floats) -> Floats:
        """Return the fraction of each sample's noise that the preceding node does not follow (sample)."""
        noise = self.observation.displacement_noise
        fraction = np.ones(self.compared.size)
        if noise == 0:
            return fraction
        squares = (self._compute_response(x).slope[self.compared] * noise / scale) ** 2
        node = np.searchsorted(self.observation.nodes, self.compared) - 1
        prior = (noise / self.observation.node_deviation[node]) ** 2
        moves = (node >= 1) & (node <= self.free)
        fraction[moves] -= (squares / (np.bincount(node, squares)[node] + prior))[moves]
        return fraction

    def _positivity_shift(self, response: ModelResponse, scale: Floats) -> float:
        """Return a residual whose square is a constant less the noise bias, so that all terms are positive."""
        return math.sqrt(
            max(_ROOM * self.compared.size - float(self._noise_bias(response, scale).sum()), 1.0)
        )

    def slopes(self, x: Floats, scale: Floats) -> ResidualSlopes:
        """Compute the derivatives of the residuals by finite differences."""
        from scipy.sparse import csr_array, eye_array, vstack

        count = len(self.names)
        compared = self.compared
        base = self._compute_response(x)
        weight = (
            base.slope[compared]
            * (self.observation.displacement_noise / scale) ** 2
            * self.noise_fraction
        )

        def differences(change: Floats, step: float) -> tuple[Floats, Floats]:
            response = self._compute_response(x + step * change)
            load = response.tangential_load - base.tangential_load
            slope = response.slope - base.slope
            return load[compared] / (step * scale), weight * slope[compared] / step

        by_parameter = np.zeros((compared.size + self.free, count))
        bias = np.zeros((compared.size, count))
        for index in range(count):
            load, bias_change = differences(np.eye(x.size)[index], _STEP)
            # smaller derivatives are rounding
            if np.linalg.norm(load) > _ROUNDING * math.sqrt(compared.size):
                by_parameter[: compared.size, index], bias[:, index] = load, bias_change
        group_count = min(_TOGETHER, self.free)
        loads, bias_change, owner = np.zeros((3, compared.size, group_count))
        branch = np.searchsorted(self.observation.nodes, compared) - 1
        for group in range(group_count):
            nodes = np.arange(group, self.free, _TOGETHER)
            change = np.zeros(x.size)
            change[count + nodes] = 1.0
            # samples affected by a node: from the node before it to the next one that moves with it
            number = (branch - group) // _TOGETHER
            owned = (number >= 0) & (number < nodes.size)
            owner[:, group] = np.where(owned, group + _TOGETHER * number, group)
            loads[:, group], bias_change[:, group] = np.where(
                owned, differences(change, _NODE_STEP), 0.0
            )
        indices = np.repeat(np.arange(compared.size), group_count), owner.ravel().astype(np.int64)
        of_samples, bias_by_node = (
            csr_array((values.ravel(), indices), shape=(compared.size, self.free))
            for values in (loads, bias_change)
        )
        by_node = vstack([of_samples, eye_array(self.free)], format="csr")
        return ResidualSlopes(by_parameter, by_node, bias, bias_by_node)


def _select_samples(observation: Observation) -> Integers:
    """Select the samples that surely belong to one branch: all but the nodes and samples close to them.

    The number of samples excluded near a node is derived from the mean step of the branch, not from
    the readings: a selection by noisy values would bias the stiffness upwards.
    """
    nodes = observation.nodes
    reach = _AMBIGUOUS * observation.reading_noise
    selected = np.ones(observation.time.size, dtype=np.bool_)
    selected[: observation.start_sample] = False
    selected[nodes] = False
    for start, stop in itertools.pairwise(nodes.tolist()):
        stroke = abs(observation.displacement[stop] - observation.displacement[start])
        count = stop - start
        margin = min(math.ceil(reach * count / stroke) if stroke > 0 else 0, count // _MOST_BESIDE)
        selected[start : start + margin + 1] = False
        selected[stop - margin : stop + 1] = False
    return np.flatnonzero(selected)
