"""`Facet`: asperities with one slope, level in rotated axes; `BodyPosition`: a body on facets, and its chords."""

import math
import struct
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from historysim.asperities.asperity_set import AsperitySet
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import State
from historysim.basics.arguments import Array, Integers
from historysim.basics.library import lib
from historysim.errors import FrictionLimitError
from historysim.memory.binding import DISPLACED, Memory, advance_state
from historysim.memory.paths import Rows

# Relative error of a load that counts as met: also that of normal loads among which a tangential
# load is met.
SETTLED, FINELY_SETTLED = 1e-13, 5e-15
# Largest number of trials of an approach, of Newton steps among them, and of halvings of a path.
MOST_TRIALS, MOST_NEWTON, MOST_HALVINGS = 200, 30, 20
HALVINGS_AT_LIMIT = 4  # most where a tangential load is held at the friction limit
FIRST_DEPTH = 1e-6  # first trial of an approach from first touch, relative to the smallest radius
LEAST_LOSS = 1e-3  # energy loss of a chord that has to converge, relative to the loss in gross slip
LOSSES = 10  # tolerance of energies relative to the tolerance of loads and approaches
# First trial of a motion to a tangential load: the least and the greatest one, relative to the
# largest motion.
LEAST_STEP, FIRST_STEP = 2.0**-40, 2.0**-10
MARGIN = 4.0  # of a load held at the friction limit, in errors of a load that counts as met
TINY, ROUNDING = (
    1e-9,
    8.0 * 2.0**-52,
)  # of a depth and of a far displacement, relative to the radius
GOLDEN, PEAK_TRIALS = 0.5 * (math.sqrt(5.0) - 1.0), 40  # search for the largest tangential load
_SUMMED = ("contact_count", "real_contact_area", "dissipated_energy")


def interpolate(start: Any, stop: Any, fraction: Any) -> Any:
    """Interpolate linearly from start to stop; exact to the bit at fraction 1."""
    return np.where(fraction == 1.0, stop, start + (stop - start) * fraction)[()]


class Facet(Ensemble):
    """Asperities with the same slope: a level ensemble in axes rotated by it.

    Only + - × ÷ √ make its axes, so that its bits are the same everywhere.
    """

    members: Integers  #: (asperity) indices in the whole ensemble
    slope: float  #: tan α of all of them
    cosine: float
    sine: float
    gap: float  #: approach at which its highest asperity touches where U = 0 [m]

    def __init__(self, ensemble: AsperitySet, slope: float, members: Integers) -> None:
        cosine = 1.0 / math.sqrt(1.0 + slope * slope)
        height, radius, friction = (
            values[members]
            for values in (ensemble.summit_height, ensemble.summit_radius, ensemble.friction)
        )
        super().__init__(
            ensemble.pair, height * cosine, radius, friction, tolerance=ensemble.tolerance
        )
        gap = ensemble.highest_summit - float(height.max())
        self.__dict__.update(
            members=members, slope=slope, cosine=cosine, sine=slope * cosine, gap=gap
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without cached values."""
        axes = ("members", "slope", "cosine", "sine", "gap")
        return super().__getstate__() | {name: getattr(self, name) for name in axes}

    @property
    def _identity_bytes(self) -> bytes:
        # heights depend on the magnitude of the slope, but not on its sign
        return struct.pack("<d", self.slope) if self.slope else b""

    def to_facet_axes(self, approach: Any, displacement: Any) -> tuple[Any, Any]:
        """Transform approach and displacement of the body to the axes of the facet [m], from touch at U = 0."""
        depth = approach - self.gap
        return (
            depth * self.cosine + displacement * self.sine,
            displacement * self.cosine - depth * self.sine,
        )

    def advance_memory(self, memory: Memory, approach: float, displacement: float) -> Memory:
        """Advance a memory along a straight path of the body."""
        normal, tangential = self.to_facet_axes(approach, displacement)
        advanced_memory: Memory = advance_state(
            memory, DISPLACED, normal, DISPLACED, tangential, self._drive
        )
        return advanced_memory

    def unloaded_state(self) -> State:
        """Return the unloaded state at d = U = 0 of the body."""
        start = self.initial_state()
        return (
            State(self.advance_memory(start.memory, 0.0, 0.0), start.memory) if self.gap else start
        )

    def accumulate_rows(self, totals: Array, rows: Rows) -> None:
        """Add the facet's rows to the totals of the body."""
        facet_totals, c, s = rows.totals, self.cosine, self.sine
        for name in _SUMMED:
            totals[name] += facet_totals[name]
        totals["normal_load"] += (
            c * facet_totals["normal_load"] - s * facet_totals["tangential_load"]
        )
        totals["tangential_load"] += (
            c * facet_totals["tangential_load"] + s * facet_totals["normal_load"]
        )
        totals["friction_limit"] += c * facet_totals["friction_limit"]
        normal = 2.0 * self.pair.contact_modulus * rows.each["contact_radius"].sum(axis=1)
        totals["tangential_stiffness"] += (
            c * c * facet_totals["tangential_stiffness"] + s * s * normal
        )
        totals["traction_ratio"] = np.maximum(
            totals["traction_ratio"], facet_totals["traction_ratio"]
        )


#: normal load [N], and displacement [m] or tangential load [N], at a share of a straight path
At = Callable[[float], tuple[float, float]]


@attrs.frozen(eq=False)
class BodyPosition:
    """Position of a body on facets, with the memory of each facet."""

    facets: tuple[Facet, ...]
    memories: tuple[Memory, ...]
    approach: float
    displacement: float
    excess: float = 0.0  #: part of a requested tangential load beyond the limit that holds it [N]

    def _facet_memories(self) -> Iterator[tuple[Facet, Memory]]:
        return zip(self.facets, self.memories, strict=True)

    def move_to(self, approach: float, displacement: float) -> "BodyPosition":
        """Move the body along a straight path."""
        memories = tuple(
            facet.advance_memory(memory, approach, displacement)
            for facet, memory in self._facet_memories()
        )
        return BodyPosition(self.facets, memories, approach, displacement)

    @property
    def loads(self) -> tuple[float, float]:
        """Normal and tangential load of the body [N]."""
        normal = tangential = 0.0
        for facet, memory in self._facet_memories():
            line, unit = memory.line, memory.line.contact.units.load
            pressed, held = line.normal_load * unit, line.tangential_load * unit
            normal += facet.cosine * pressed - facet.sine * held
            tangential += facet.cosine * held + facet.sine * pressed
        return normal, tangential

    @property
    def dissipated_energy(self) -> float:
        """Energy dissipated by friction since the start [J]."""
        return math.fsum(
            memory.line.dissipated * memory.line.contact.units.energy for memory in self.memories
        )

    def touch(self, displacement: float) -> float:
        """Return the approach of first touch at a displacement [m]."""
        return min(facet.gap - displacement * facet.slope for facet in self.facets)

    def solve_at_load(
        self,
        load: float,
        displacement: float,
        trial: float | None = None,
        settled: float = SETTLED,
    ) -> "BodyPosition":
        """Solve for the body at a displacement under a normal load, at the end of a straight path.

        The load rises with the approach, since friction times slope is below 1. Newton's trials
        stay in a bracket; the first one is the present approach by default.
        """
        touch = low = self.touch(displacement)
        high = math.inf
        if load <= 0.0:
            return self.move_to(touch, displacement)
        trial = self.approach if trial is None else trial
        if trial <= touch:
            trial = touch + FIRST_DEPTH * self.smallest_radius
        for count in range(MOST_TRIALS):
            body = self.move_to(trial, displacement)
            excess = body.loads[0] - load
            low, high = (trial, high) if excess < 0.0 else (low, trial)
            middle = 0.5 * (low + high) if high < math.inf else trial + 2.0 * (trial - touch)
            rate = body.stiffness(self)[0] if count < MOST_NEWTON else 0.0
            following = trial - excess / rate if rate > 0.0 else middle
            following = following if low < following < high else middle
            if abs(excess) <= settled * load or following in {trial, low, high}:
                break
            trial = following
        return body

    def stiffness(self, start: "BodyPosition") -> tuple[float, float, float, float]:
        """Return ∂N/∂d, ∂N/∂U, ∂T/∂d and ∂T/∂U at the end of a straight path from ``start`` [N/m]."""
        normal = lift = coupling = tangential = 0.0
        for facet, memory in self._facet_memories():
            slopes = lib.hs_slopes_of(
                memory, facet.to_facet_axes(start.approach, start.displacement)[0]
            )
            c, s = facet.cosine, facet.sine
            difference = c * s * (slopes.normal - slopes.tangential)
            normal += c * c * slopes.normal - c * s * slopes.coupling + s * s * slopes.tangential
            lift += difference - s * s * slopes.coupling
            coupling += difference + c * c * slopes.coupling
            tangential += (
                s * s * slopes.normal + c * s * slopes.coupling + c * c * slopes.tangential
            )
        return normal, lift, coupling, tangential

    @property
    def smallest_radius(self) -> float:
        """Radius of the sharpest summit [m]."""
        return min(float(facet.summit_radius.min()) for facet in self.facets)

    @property
    def steepest(self) -> float:
        """Bound of tangential over normal loads."""
        return max(abs(facet.slope) + float(facet.friction.max()) for facet in self.facets)

    def solve_at_tangential_load(
        self,
        request: float,
        saturate: bool,
        *,
        load: float | None = None,
        approach: float | None = None,
    ) -> "BodyPosition":
        """Solve for the body under a tangential load, at a normal load or an approach, at the end of a straight path.

        The displacement is the nearest one in the direction of the missing load. The friction limit
        is the largest load up to a further motion by the smallest radius. ``saturate`` holds a load
        beyond it at the limit; FrictionLimitError otherwise.
        """
        motion = _Motion(self, load, approach)
        body = motion.to(self.displacement, self)
        if load is not None and load <= 0.0:
            if request and not saturate:
                raise FrictionLimitError(request, 0.0, formula="with slopes")
            return attrs.evolve(body, excess=request)
        normal, tangential = body.loads
        settled = SETTLED * (normal * self.steepest or abs(request))
        if abs(request - tangential) <= settled:
            return body
        side = math.copysign(1.0, request - tangential)
        trials = motion.trials(body, request, settled)
        loads = [side * trial.loads[1] for trial in trials]
        # far away the depth is a small difference of large numbers
        depth = max(body.approach - body.touch(body.displacement), TINY * self.smallest_radius)
        rounding = ROUNDING * self.smallest_radius * max(abs(facet.slope) for facet in self.facets)
        noise = MARGIN * settled + normal * self.steepest * rounding / depth
        at = next(i for i, load in enumerate(loads) if load >= max(loads) - noise)
        limit = loads[at]
        beyond = side * request - limit
        if beyond > noise and not saturate:
            raise FrictionLimitError(request, side * limit, formula="with slopes")
        goal = side * (limit - MARGIN * settled)
        if beyond < -noise:
            goal = request
            at = next(i for i, load in enumerate(loads) if load >= side * request)
        body = motion.settle(trials[at - 1], trials[at], goal, settled) if at else body
        return attrs.evolve(body, excess=request - body.loads[1]) if beyond > noise else body

    def chords(
        self,
        targets_at: At,
        low: float,
        high: float,
        tolerance: float,
        *,
        by_loads: bool = False,
        saturate: bool = False,
    ) -> "list[tuple[float, BodyPosition]]":
        """Split a part of a path into chords; return the path fraction and the body at the end of each.

        Chords end where the body carries the load there, or both loads. They are halved until
        approach, tangential load or displacement, and energy have converged.
        """

        def move(start: BodyPosition, fraction: float) -> BodyPosition:
            load, tangential = targets_at(fraction)
            if by_loads:
                return start.solve_at_tangential_load(tangential, saturate, load=load)
            return start.solve_at_load(load, tangential)

        (first_load, first), (last_load, last) = targets_at(0.0), targets_at(1.0)
        if first_load == last_load and first == last:
            return [(high, self)]
        single_chord = move(self, high)
        depth = max(body.approach - body.touch(body.displacement) for body in (self, single_chord))
        load = max(first_load, last_load) * self.steepest
        reach = self.facets[0].pair.displacement_ratio * depth
        moved = single_chord.displacement - self.displacement if by_loads else last - first
        loss = LEAST_LOSS * load * (reach + abs(moved))

        def has_converged(start: BodyPosition, coarse: BodyPosition, fine: BodyPosition) -> bool:
            losses = (
                coarse.dissipated_energy - start.dissipated_energy,
                fine.dissipated_energy - start.dissipated_energy,
            )
            return (
                abs(coarse.approach - fine.approach) <= tolerance * depth
                and abs(coarse.loads[1] - fine.loads[1]) <= tolerance * load
                and abs(coarse.displacement - fine.displacement)
                <= tolerance * self.steepest * reach
                and abs(losses[0] - losses[1]) <= LOSSES * tolerance * max(*losses, loss)
            )

        def halve(
            start: BodyPosition, low: float, high: float, single_chord: BodyPosition, halvings: int
        ) -> list[tuple[float, BodyPosition]]:
            middle = 0.5 * (low + high)
            middle_body = move(start, middle)
            fine_end = move(middle_body, high)
            # at a peak of the load rounding moves U by more than the tolerance
            at_limit = single_chord.excess and fine_end.excess
            least = MOST_HALVINGS - HALVINGS_AT_LIMIT if at_limit else 0
            if halvings <= least or has_converged(start, single_chord, fine_end):
                return [(middle, middle_body), (high, fine_end)]
            lower_chords = halve(start, low, middle, middle_body, halvings - 1)
            reached = lower_chords[-1][1]
            return lower_chords + halve(reached, middle, high, move(reached, high), halvings - 1)

        return halve(self, low, high, single_chord, MOST_HALVINGS)


@attrs.frozen
class _Motion:
    """Straight paths of a body to displacements, all under one normal load, or to one approach."""

    start: BodyPosition
    load: float | None
    approach: float | None

    def to(self, displacement: float, near: BodyPosition) -> BodyPosition:
        """Return the body at a displacement; ``near`` is one nearby."""
        if self.load is not None:
            return self.start.solve_at_load(self.load, displacement, near.approach, FINELY_SETTLED)
        return self.start.move_to(
            self.start.approach if self.approach is None else self.approach, displacement
        )

    def rate(self, body: BodyPosition) -> float:
        """Return dT/dU of the body [N/m]."""
        normal, lift, coupling, tangential = body.stiffness(self.start)
        if self.load is None:
            return tangential
        return tangential - coupling * lift / normal if normal > 0.0 else 0.0

    def trials(self, begin: BodyPosition, request: float, settled: float) -> list[BodyPosition]:
        """Return bodies that are moved ever further, up to one that carries more than a request [N].

        If none does, the one that carries most is among them.
        """
        missing, furthest = request - begin.loads[1], begin.smallest_radius
        side, rate = math.copysign(1.0, missing), self.rate(begin)
        share = abs(missing) / (rate * furthest) if rate > 0.0 else FIRST_STEP
        share = min(max(share, LEAST_STEP), FIRST_STEP)
        trials, loads = [begin], [side * begin.loads[1]]

        def attempt(displacement: float, index: int) -> bool:
            body = self.to(displacement, trials[index - 1])
            trials.insert(index, body)
            loads.insert(index, side * body.loads[1])
            return loads[index] - side * request > settled

        while trials[-1].displacement != begin.displacement + side * furthest:
            if attempt(begin.displacement + side * furthest * min(share, 1.0), len(trials)):
                return trials
            share *= 2.0
        # steep asperities of little friction may relieve others, so that the load falls again
        for _ in range(PEAK_TRIALS):
            most = max(loads)
            peak = loads.index(most)
            if most - loads[-1] <= settled or peak == len(loads) - 1:
                break
            ahead, here = trials[peak + 1].displacement, trials[peak].displacement
            behind = trials[max(peak - 1, 0)].displacement
            goes_ahead = abs(ahead - here) >= abs(here - behind)
            other = ahead if goes_ahead else behind
            middle = here + (1.0 - GOLDEN) * (other - here)
            if middle in {here, other} or attempt(middle, peak + goes_ahead):
                break
        return trials

    def settle(
        self, low: BodyPosition, high: BodyPosition, goal: float, settled: float
    ) -> BodyPosition:
        """Return the body between two that carries a tangential load [N]; Newton's trials stay in a bracket."""
        body, side = low, math.copysign(1.0, high.displacement - low.displacement)
        for count in range(MOST_TRIALS):
            missing = goal - body.loads[1]
            rate = self.rate(body) if count < MOST_NEWTON else 0.0
            middle = 0.5 * (low.displacement + high.displacement)
            following = body.displacement + missing / rate if rate > 0.0 else middle
            if not side * low.displacement < side * following < side * high.displacement:
                following = middle
            if abs(missing) <= settled or following in {low.displacement, high.displacement}:
                break
            body = self.to(following, body)
            low, high = (body, high) if side * (body.loads[1] - goal) < 0.0 else (low, body)
        return body
