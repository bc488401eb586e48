"""Facets: the asperities of one slope, a level ensemble in turned axes; and a body on them that carries a load."""

import math
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple, Self

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import EnsembleState
from historysim.basics.arguments import Array, Integers
from historysim.basics.library import lib
from historysim.memory.binding import DISPLACED, Memory, advanced
from historysim.memory.rows import Rows

SETTLED = 1e-13  # relative difference of a load from the one that is asked for
# Trials of an approach, of which so many may be Newton's, and how often a path is halved.
MOST_TRIALS, MOST_NEWTON, MOST_HALVINGS = 200, 30, 20
FIRST_DEPTH = 1e-6  # first trial of an approach from first touch, over the smallest radius
LEAST_LOSS = 1e-3  # energy of a chord that has to settle, over that of sliding
LOSSES = 10  # tolerance of energies over that of loads and approaches
_SUMMED = ("contact_count", "real_contact_area", "dissipated_energy")


def towards(start: Any, end: Any, share: Any) -> Any:
    """Return what lies at a share of the way, to the bit at its end."""
    return np.where(share == 1.0, end, start + (end - start) * share)[()]


class Facet(Ensemble):
    """Asperities of one slope: a level ensemble in axes that are turned by it.

    Only + - × ÷ √ make its axes, so that its bits are the same everywhere.
    """

    members: Integers  #: (asperity) Their indices in the whole ensemble
    slope: float  # type: ignore[assignment] # that of all of them
    cosine: float
    sine: float
    gap: float  #: approach at which its highest asperity touches where U = 0 [m]

    @classmethod
    def of(cls, whole: Ensemble, slope: float, members: Integers) -> Self:
        """Return the facet of some asperities, with the slope that they have."""
        cosine = 1.0 / math.sqrt(1.0 + slope * slope)
        height, radius = whole.summit_height[members], whole.summit_radius[members]
        facet = cls(whole.pair, height * cosine, radius, whole.friction[members], tolerance=whole.tolerance)
        gap = whole.highest_summit - float(height.max())
        facet.__dict__.update(members=members, slope=slope, cosine=cosine, sine=slope * cosine, gap=gap)
        return facet

    @property
    def _more(self) -> bytes:
        # heights know the slope, but not its sign
        return struct.pack("<d", self.slope) if self.slope else b""

    @property
    def units(self) -> Any:
        """What numbers of its memory are multiplied by."""
        return self._contact.units

    def turned(self, approach: Any, displacement: Any) -> tuple[Any, Any]:
        """Return how far it is pressed along its normal, and moved along its slope [m], from touch at U = 0."""
        depth = approach - self.gap
        return depth * self.cosine + displacement * self.sine, displacement * self.cosine - depth * self.sine

    def carried(self, memory: Memory, approach: float, displacement: float) -> Memory:
        """Return a memory after a straight path of the body."""
        normal, tangential = self.turned(approach, displacement)
        after: Memory = advanced(memory, DISPLACED, normal, DISPLACED, tangential, self._drive)
        return after

    def beginning(self) -> EnsembleState:
        """Return the unloaded state where the body is at d = U = 0."""
        start = self.initial_state()
        return EnsembleState(self.carried(start.memory, 0.0, 0.0), start.memory) if self.gap else start

    def add_to(self, totals: Array, rows: Rows) -> None:
        """Add its rows to those of the whole body."""
        own, c, s = rows.totals, self.cosine, self.sine
        for name in _SUMMED:
            totals[name] += own[name]
        totals["normal_load"] += c * own["normal_load"] - s * own["tangential_load"]
        totals["tangential_load"] += c * own["tangential_load"] + s * own["normal_load"]
        totals["friction_limit"] += c * own["friction_limit"]
        normal = 2.0 * self.pair.contact_modulus * rows.each["contact_radius"].sum(axis=1)
        totals["tangential_stiffness"] += c * c * own["tangential_stiffness"] + s * s * normal
        totals["traction_ratio"] = np.maximum(totals["traction_ratio"], own["traction_ratio"])


class Way(NamedTuple):
    """A straight way in normal load [N] and displacement [m]."""

    first_load: float
    last_load: float
    first_displacement: float
    last_displacement: float

    def at(self, share: float) -> tuple[float, float]:
        """Return load and displacement at a share of the way."""
        load = towards(self.first_load, self.last_load, share)
        return float(load), float(towards(self.first_displacement, self.last_displacement, share))


@attrs.frozen(eq=False)
class Body:
    """A body on facets: where it is, and what each of them remembers there."""

    facets: tuple[Facet, ...]
    memories: tuple[Memory, ...]
    approach: float
    displacement: float

    def _each(self) -> Iterator[tuple[Facet, Memory]]:
        return zip(self.facets, self.memories, strict=True)

    def moved(self, approach: float, displacement: float) -> "Body":
        """Return the body after a straight path."""
        memories = tuple(facet.carried(memory, approach, displacement) for facet, memory in self._each())
        return Body(self.facets, memories, approach, displacement)

    @property
    def loads(self) -> tuple[float, float]:
        """The normal and the tangential load of the body [N]."""
        normal = tangential = 0.0
        for facet, memory in self._each():
            pressed, held = memory.normal_load * facet.units.load, memory.tangential_load * facet.units.load
            normal += facet.cosine * pressed - facet.sine * held
            tangential += facet.cosine * held + facet.sine * pressed
        return normal, tangential

    @property
    def dissipated(self) -> float:
        """Energy that friction has taken since the start [J]."""
        return math.fsum(memory.dissipated * facet.units.energy for facet, memory in self._each())

    def touch(self, displacement: float) -> float:
        """Return the approach of first touch at a displacement [m]."""
        return min(facet.gap - displacement * facet.slope for facet in self.facets)

    def under(self, load: float, displacement: float) -> "Body":
        """Return the body at the end of a straight path to a displacement at which the body carries a load.

        The load rises with the approach, since friction times slope is below 1. Newton's trials stay in a bracket.
        """
        touch = low = self.touch(displacement)
        high = math.inf
        if load <= 0.0:
            return self.moved(touch, displacement)
        trial = self.approach
        if trial <= touch:
            trial = touch + FIRST_DEPTH * min(float(facet.summit_radius.min()) for facet in self.facets)
        for count in range(MOST_TRIALS):
            there = self.moved(trial, displacement)
            excess = there.loads[0] - load
            low, high = (trial, high) if excess < 0.0 else (low, trial)
            middle = 0.5 * (low + high) if high < math.inf else trial + 2.0 * (trial - touch)
            rate = there.normal_stiffness(self) if count < MOST_NEWTON else 0.0
            following = trial - excess / rate if rate > 0.0 else middle
            following = following if low < following < high else middle
            if abs(excess) <= SETTLED * load or following in {trial, low, high}:
                break
            trial = following
        return there

    def normal_stiffness(self, start: "Body") -> float:
        """Return ∂N/∂d at the end of a straight path, its start being what it is [N/m]."""
        found = 0.0
        for facet, memory in self._each():
            slopes = lib.hs_slopes_of(memory, facet.turned(start.approach, start.displacement)[0])
            c, s = facet.cosine, facet.sine
            found += c * c * slopes.normal - c * s * slopes.coupling + s * s * slopes.tangential
        return found

    def chords(self, way: Way, low: float, high: float, tolerance: float) -> "list[tuple[float, Body]]":
        """Return the ends of chords along a part of a way, each with its share of the way.

        Chords end where the body carries the load there. They are halved until approach, tangential load and energy
        are settled.
        """
        if way.first_load == way.last_load and way.first_displacement == way.last_displacement:
            return [(high, self)]
        whole = self.under(*way.at(high))
        depth = max(each.approach - each.touch(each.displacement) for each in (self, whole))
        steepest = max(abs(facet.slope) + float(facet.friction.max()) for facet in self.facets)
        load = max(way.first_load, way.last_load) * steepest
        ratio = self.facets[0].pair.displacement_ratio
        loss = LEAST_LOSS * load * (ratio * depth + abs(way.last_displacement - way.first_displacement))

        def settled(start: Body, one: Body, other: Body) -> bool:
            taken = one.dissipated - start.dissipated, other.dissipated - start.dissipated
            return (
                abs(one.approach - other.approach) <= tolerance * depth
                and abs(one.loads[1] - other.loads[1]) <= tolerance * load
                and abs(taken[0] - taken[1]) <= LOSSES * tolerance * max(*taken, loss)
            )

        def halved(start: Body, low: float, high: float, whole: Body, left: int) -> list[tuple[float, Body]]:
            middle = 0.5 * (low + high)
            half = start.under(*way.at(middle))
            end = half.under(*way.at(high))
            if left == 0 or settled(start, whole, end):
                return [(middle, half), (high, end)]
            first = halved(start, low, middle, half, left - 1)
            there = first[-1][1]
            return first + halved(there, middle, high, there.under(*way.at(high)), left - 1)

        return halved(self, low, high, whole, MOST_HALVINGS)
