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
from historysim.memory.binding import DISPLACED, Memory, advance_state
from historysim.memory.paths import Rows

SETTLED = 1e-13  # relative error of a load that counts as met
# Largest number of trials of an approach, of Newton steps among them, and of halvings of a path.
MOST_TRIALS, MOST_NEWTON, MOST_HALVINGS = 200, 30, 20
FIRST_DEPTH = 1e-6  # first trial of an approach from first touch, relative to the smallest radius
LEAST_LOSS = 1e-3  # energy loss of a chord that has to converge, relative to the loss in gross slip
LOSSES = 10  # tolerance of energies relative to the tolerance of loads and approaches
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


#: normal load [N] and displacement [m] at a share of a straight way
At = Callable[[float], tuple[float, float]]


@attrs.frozen(eq=False)
class BodyPosition:
    """Position of a body on facets, with the memory of each facet."""

    facets: tuple[Facet, ...]
    memories: tuple[Memory, ...]
    approach: float
    displacement: float

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

    def solve_at_load(self, load: float, displacement: float) -> "BodyPosition":
        """Solve for the body at a displacement under a normal load, at the end of a straight path.

        The load rises with the approach, since friction times slope is below 1. Newton's trials
        stay in a bracket.
        """
        touch = low = self.touch(displacement)
        high = math.inf
        if load <= 0.0:
            return self.move_to(touch, displacement)
        trial = self.approach
        if trial <= touch:
            trial = touch + FIRST_DEPTH * min(
                float(facet.summit_radius.min()) for facet in self.facets
            )
        for count in range(MOST_TRIALS):
            body = self.move_to(trial, displacement)
            excess = body.loads[0] - load
            low, high = (trial, high) if excess < 0.0 else (low, trial)
            middle = 0.5 * (low + high) if high < math.inf else trial + 2.0 * (trial - touch)
            rate = body.normal_stiffness(self) if count < MOST_NEWTON else 0.0
            following = trial - excess / rate if rate > 0.0 else middle
            following = following if low < following < high else middle
            if abs(excess) <= SETTLED * load or following in {trial, low, high}:
                break
            trial = following
        return body

    def normal_stiffness(self, start: "BodyPosition") -> float:
        """Return ∂N/∂d at the end of a straight path from ``start`` [N/m]."""
        stiffness = 0.0
        for facet, memory in self._facet_memories():
            slopes = lib.hs_slopes_of(
                memory, facet.to_facet_axes(start.approach, start.displacement)[0]
            )
            c, s = facet.cosine, facet.sine
            stiffness += c * c * slopes.normal - c * s * slopes.coupling + s * s * slopes.tangential
        return stiffness

    def chords(
        self, targets_at: At, low: float, high: float, tolerance: float
    ) -> "list[tuple[float, BodyPosition]]":
        """Split a part of a path into chords; return the path fraction and the body at the end of each.

        Chords end where the body carries the load there. They are halved until approach, tangential
        load and energy have converged.
        """
        (first_load, first_displacement), (last_load, last_displacement) = (
            targets_at(0.0),
            targets_at(1.0),
        )
        if first_load == last_load and first_displacement == last_displacement:
            return [(high, self)]
        single_chord = self.solve_at_load(*targets_at(high))
        depth = max(body.approach - body.touch(body.displacement) for body in (self, single_chord))
        steepest = max(abs(facet.slope) + float(facet.friction.max()) for facet in self.facets)
        load = max(first_load, last_load) * steepest
        ratio = self.facets[0].pair.displacement_ratio
        loss = LEAST_LOSS * load * (ratio * depth + abs(last_displacement - first_displacement))

        def has_converged(start: BodyPosition, coarse: BodyPosition, fine: BodyPosition) -> bool:
            losses = (
                coarse.dissipated_energy - start.dissipated_energy,
                fine.dissipated_energy - start.dissipated_energy,
            )
            return (
                abs(coarse.approach - fine.approach) <= tolerance * depth
                and abs(coarse.loads[1] - fine.loads[1]) <= tolerance * load
                and abs(losses[0] - losses[1]) <= LOSSES * tolerance * max(*losses, loss)
            )

        def halve(
            start: BodyPosition, low: float, high: float, single_chord: BodyPosition, halvings: int
        ) -> list[tuple[float, BodyPosition]]:
            middle = 0.5 * (low + high)
            middle_body = start.solve_at_load(*targets_at(middle))
            fine_end = middle_body.solve_at_load(*targets_at(high))
            if halvings == 0 or has_converged(start, single_chord, fine_end):
                return [(middle, middle_body), (high, fine_end)]
            lower_chords = halve(start, low, middle, middle_body, halvings - 1)
            reached = lower_chords[-1][1]
            return lower_chords + halve(
                reached, middle, high, reached.solve_at_load(*targets_at(high)), halvings - 1
            )

        return halve(self, low, high, single_chord, MOST_HALVINGS)
