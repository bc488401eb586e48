"""`InclinedEnsemble`: asperities that meet on slopes, as facets that are level in rotated axes."""

import math
import struct
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.asperity import Asperities, Asperity, Readout
from historysim.asperities.ensemble import Ensemble, unsupported_method
from historysim.asperities.instrument import RIGID, as_instrument
from historysim.asperities.state import SavedState, State
from historysim.basics.arguments import Array, Booleans, Floats, Integers, one_per
from historysim.basics.library import lib
from historysim.basics.limits import is_workable
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import DISPLACED, LOAD, PATH, Memory, advanced, are_in_plane
from historysim.memory.paths import Goals, Paths, Rows, blank_rows, paths_to, unrecorded

# Most of friction times slope. At 1 a sliding asperity locks: pressed down, it carries no more of the load.
STEEPEST_SLIDING = 0.9
_HEAD = struct.Struct("<8sqqqdd")
_MARK = b"hsinclin"
UNIT_ROUNDING = 1e-12  # of the length of the axes of a slope
SETTLED = 1e-13  # relative difference of a load from the one that is asked for
# Trials of an approach, of which so many may be Newton's, and how often a path is halved.
MOST_TRIALS, MOST_NEWTON, MOST_HALVINGS = 200, 30, 20
FIRST_DEPTH = 1e-6  # first trial of an approach from first touch, over the smallest radius
LEAST_LOSS = 1e-3  # energy of a chord that has to settle, over that of sliding
LOSSES = 10  # tolerance of energies over that of loads and approaches
_SUMMED = ("contact_count", "real_contact_area", "dissipated_energy")


def towards(start: Any, end: Any, share: Any) -> Any:
    """Interpolate linearly from start to stop; exact to the bit at fraction 1."""
    return np.where(share == 1.0, end, start + (end - start) * share)[()]


class Facet(Ensemble):
    """Asperities with the same slope: a level ensemble in axes rotated by it.

    Only + - × ÷ √ make its axes, so that its bits are the same everywhere.
    """

    members: Integers  #: (asperity) Their indices in the whole ensemble
    slope: float  # type: ignore[assignment] # that of all of them
    cosine: float
    sine: float
    gap: float  #: approach at which its highest asperity touches where U = 0 [m]

    @classmethod
    def of(cls, whole: Ensemble, slope: float, members: Integers) -> Self:
        """Return the facet of the asperities with a slope."""
        cosine = 1.0 / math.sqrt(1.0 + slope * slope)
        height, radius = whole.summit_height[members], whole.summit_radius[members]
        facet = cls(whole.pair, height * cosine, radius, whole.friction[members], tolerance=whole.tolerance)
        gap = whole.highest_summit - float(height.max())
        facet.__dict__.update(members=members, slope=slope, cosine=cosine, sine=slope * cosine, gap=gap)
        return facet

    @property
    def _settings_bytes(self) -> bytes:
        # heights know the slope, but not its sign
        return struct.pack("<d", self.slope) if self.slope else b""

    def turned(self, approach: Any, displacement: Any) -> tuple[Any, Any]:
        """Transform approach and displacement of the body to the axes of the facet [m], from touch at U = 0."""
        depth = approach - self.gap
        return depth * self.cosine + displacement * self.sine, displacement * self.cosine - depth * self.sine

    def carried(self, memory: Memory, approach: float, displacement: float) -> Memory:
        """Advance a memory along a straight path of the body."""
        normal, tangential = self.turned(approach, displacement)
        advanced_memory: Memory = advanced(memory, DISPLACED, normal, DISPLACED, tangential, self._drive)
        return advanced_memory

    def beginning(self) -> State:
        """Return the unloaded state at d = U = 0 of the body."""
        start = self.initial_state()
        return State(self.carried(start.memory, 0.0, 0.0), start.memory) if self.gap else start

    def add_to(self, totals: Array, rows: Rows) -> None:
        """Add the facet's rows to the totals of the body."""
        facet_totals, c, s = rows.totals, self.cosine, self.sine
        for name in _SUMMED:
            totals[name] += facet_totals[name]
        totals["normal_load"] += c * facet_totals["normal_load"] - s * facet_totals["tangential_load"]
        totals["tangential_load"] += c * facet_totals["tangential_load"] + s * facet_totals["normal_load"]
        totals["friction_limit"] += c * facet_totals["friction_limit"]
        normal = 2.0 * self.pair.contact_modulus * rows.each["contact_radius"].sum(axis=1)
        totals["tangential_stiffness"] += c * c * facet_totals["tangential_stiffness"] + s * s * normal
        totals["traction_ratio"] = np.maximum(totals["traction_ratio"], facet_totals["traction_ratio"])


At = Callable[[float], tuple[float, float]]  #: normal load [N] and displacement [m] at a share of a straight way


@attrs.frozen(eq=False)
class Body:
    """Position of a body on facets, with the memory of each facet."""

    facets: tuple[Facet, ...]
    memories: tuple[Memory, ...]
    approach: float
    displacement: float

    def _each(self) -> Iterator[tuple[Facet, Memory]]:
        return zip(self.facets, self.memories, strict=True)

    def moved(self, approach: float, displacement: float) -> "Body":
        """Move the body along a straight path."""
        memories = tuple(facet.carried(memory, approach, displacement) for facet, memory in self._each())
        return Body(self.facets, memories, approach, displacement)

    @property
    def loads(self) -> tuple[float, float]:
        """Normal and tangential load of the body [N]."""
        normal = tangential = 0.0
        for facet, memory in self._each():
            line, unit = memory.line, memory.line.contact.units.load
            pressed, held = line.normal_load * unit, line.tangential_load * unit
            normal += facet.cosine * pressed - facet.sine * held
            tangential += facet.cosine * held + facet.sine * pressed
        return normal, tangential

    @property
    def dissipated(self) -> float:
        """Energy dissipated by friction since the start [J]."""
        return math.fsum(memory.line.dissipated * memory.line.contact.units.energy for memory in self.memories)

    def touch(self, displacement: float) -> float:
        """Return the approach of first touch at a displacement [m]."""
        return min(facet.gap - displacement * facet.slope for facet in self.facets)

    def under(self, load: float, displacement: float) -> "Body":
        """Solve for the body at a displacement under a normal load, at the end of a straight path.

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
            body = self.moved(trial, displacement)
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

    def normal_stiffness(self, start: "Body") -> float:
        """Return ∂N/∂d at the end of a straight path from ``start`` [N/m]."""
        stiffness = 0.0
        for facet, memory in self._each():
            slopes = lib.hs_slopes_of(memory, facet.turned(start.approach, start.displacement)[0])
            c, s = facet.cosine, facet.sine
            stiffness += c * c * slopes.normal - c * s * slopes.coupling + s * s * slopes.tangential
        return stiffness

    def chords(self, at: At, low: float, high: float, tolerance: float) -> "list[tuple[float, Body]]":
        """Split a part of a path into chords; return the path fraction and the body at the end of each.

        Chords end where the body carries the load there. They are halved until approach, tangential load and energy
        are settled.
        """
        (first_load, first_displacement), (last_load, last_displacement) = at(0.0), at(1.0)
        if first_load == last_load and first_displacement == last_displacement:
            return [(high, self)]
        single_chord = self.under(*at(high))
        depth = max(body.approach - body.touch(body.displacement) for body in (self, single_chord))
        steepest = max(abs(facet.slope) + float(facet.friction.max()) for facet in self.facets)
        load = max(first_load, last_load) * steepest
        ratio = self.facets[0].pair.displacement_ratio
        loss = LEAST_LOSS * load * (ratio * depth + abs(last_displacement - first_displacement))

        def settled(start: Body, one: Body, other: Body) -> bool:
            losses = one.dissipated - start.dissipated, other.dissipated - start.dissipated
            return (
                abs(one.approach - other.approach) <= tolerance * depth
                and abs(one.loads[1] - other.loads[1]) <= tolerance * load
                and abs(losses[0] - losses[1]) <= LOSSES * tolerance * max(*losses, loss)
            )

        def halved(start: Body, low: float, high: float, single_chord: Body, left: int) -> list[tuple[float, Body]]:
            middle = 0.5 * (low + high)
            middle_body = start.under(*at(middle))
            fine_end = middle_body.under(*at(high))
            if left == 0 or settled(start, single_chord, fine_end):
                return [(middle, middle_body), (high, fine_end)]
            lower_chords = halved(start, low, middle, middle_body, left - 1)
            reached = lower_chords[-1][1]
            return lower_chords + halved(reached, middle, high, reached.under(*at(high)), left - 1)

        return halved(self, low, high, single_chord, MOST_HALVINGS)


def _over_facets(part: Callable[[State, float, float], float], text: str) -> float:
    """Return a property that sums a quantity over facet states, given their cosine and sine."""

    def total(state: Any) -> float:
        return math.fsum(part(facet, *axis) for axis, facet in zip(state.axes.tolist(), state.facets, strict=True))

    return property(total, doc=text)  # type: ignore[return-value] # what it gives is a float


@attrs.frozen(eq=False, repr=False)
class InclinedState(SavedState):
    """State of an `InclinedEnsemble`: a value that can be pickled, and compared bit for bit."""

    facets: tuple[State, ...]  #: one for each slope, ascending, in axes turned by it
    axes: Floats  #: cosine and sine of each (facet, 2)
    approach: float  #: of the whole body, d [m]
    tangential_displacement: float  #: of the whole body, U [m]
    normal_control: int = LOAD
    tangential_control: int = LOAD

    normal_load = _over_facets(
        lambda each, c, s: each.normal_load * c - each.tangential_load * s,
        "Total normal load Σ (N cos α - T sin α) [N].",
    )
    tangential_load = _over_facets(
        lambda each, c, s: each.tangential_load * c + each.normal_load * s,
        "Total tangential load Σ (T cos α + N sin α) [N].",
    )
    slope_load = _over_facets(
        lambda each, _, s: each.normal_load * s, "Part of the tangential load that needs no friction, Σ N sin α [N]."
    )
    tangential_stiffness = _over_facets(
        lambda each, c, s: each.tangential_stiffness * (c * c) + each.normal_stiffness * (s * s),
        "∂T/∂U at a held approach, of the springs that stick now [N/m].",
    )
    dissipated_energy = _over_facets(
        lambda each, _c, _s: each.dissipated_energy, "Energy that friction has taken since the start [J]."
    )
    stored_energy = _over_facets(
        lambda each, _c, _s: each.stored_energy, "Elastic energy of all asperities along their slopes [J]."
    )

    @property
    def contact_count(self) -> int:
        """Number of asperities that touch."""
        return sum(facet.contact_count for facet in self.facets)

    def to_bytes(self) -> bytes:
        """Serialise the state."""
        controls = self.normal_control, self.tangential_control
        head = _HEAD.pack(_MARK, len(self.facets), *controls, self.approach, self.tangential_displacement)
        contents = [facet.to_bytes() for facet in self.facets]
        sizes = struct.pack(f"<{len(contents)}q", *map(len, contents))
        return b"".join([head, self.axes.tobytes(), sizes, *contents])

    @classmethod
    def from_bytes(cls, content: bytes, like: Any = None) -> Self:
        """Read the state from the result of `to_bytes`; see `SavedState`."""
        try:
            mark, count, *controls, approach, displacement = _HEAD.unpack_from(content)
            # a forged number may be larger than NumPy accepts
            count = max(-1, min(count, len(content)))
            axes = np.frombuffer(content, np.float64, 2 * count, _HEAD.size).reshape(count, 2)
            offset = _HEAD.size + axes.nbytes
            sizes = np.frombuffer(content, np.int64, count, offset)
        except (struct.error, ValueError) as error:
            raise InputError(f"the state is cut off ({error}); expected a state that was saved whole") from None
        ends = offset + sizes.nbytes + np.cumsum(sizes)
        is_complete = mark == _MARK and count > 0 and (sizes > 0).all() and ends[-1] == len(content)
        if not (is_complete and set(controls) <= {LOAD, DISPLACED}):
            raise InputError("the bytes are of no inclined asperities; expected a state that was saved whole")
        are_unit_vectors = (np.abs(np.hypot(*axes.T) - 1.0) <= UNIT_ROUNDING) & (axes[:, 0] > 0.0)
        if not (are_unit_vectors.all() and is_workable(approach) and is_workable(displacement)):
            raise InputError(
                "a slope, the approach or the displacement of the state is not a number, or beyond the largest that is "
                "computed with; expected a state that was saved whole"
            )
        if like is not None and not np.array_equal(like.axes, axes):
            raise InputError("the state is of other slopes; expected one of this ensemble's")
        starts = (None,) * count if like is None else like.facets
        facet_contents = [content[stop - size : stop] for size, stop in zip(sizes.tolist(), ends.tolist(), strict=True)]
        facets = [
            State.from_bytes(content_of_facet, start)
            for content_of_facet, start in zip(facet_contents, starts, strict=True)
        ]
        return cls(tuple(facets), axes, approach, displacement, *controls)


class _Controls(NamedTuple):
    """Stand-in for a memory in `Ensemble.advance`: the control of each channel."""

    normal_control: int
    tangential_control: int
    evolved: bool = True  #: it is walked, as what evolves is
    plane: None = None

    @property
    def line(self) -> Self:
        """Itself: it moves along one line."""
        return self


def _no(what: str) -> str:
    return f"inclined asperities have no {what}; expected constant coefficients, and displacements along x"


def _refused(what: str) -> InputError:
    return InputError(_no(what))


class InclinedEnsemble(Ensemble):
    """Asperities of two rough bodies that meet on slopes, so that tangential motion lifts the body and needs a load.

    The contact plane of an asperity rises with its slope in the direction of motion. The body moves by its approach d
    and displacement U; the asperity is pressed along the normal of its plane by d cos α + U sin α, and moved along it
    by U cos α - d sin α, and remembers that path exactly (theory page, `contact/README.md`, "Inclined asperities").
    A slope of 0 everywhere gives the bits of `Ensemble`.

    Slopes do not change with U and asperities keep their partners: U has to be small beside the radii. Paths are
    exact where displacements are given. Under a normal load they are followed in chords, until approach and loads are
    settled to ``tolerance``. The tangential channel is held until a displacement moves it.

    Parameters
    ----------
    pair, summit_height, summit_radius, friction, x, y, nominal_area, tolerance
        As for `Ensemble`. The height is the separation at which the asperity touches where U = 0, the radius
        1/R = 1/R1 + 1/R2.
    slope : array_like
        tan α of the contact plane, > 0 where a positive U climbs, one for all or one per asperity.

    Raises
    ------
    InputError
        As for `Ensemble`; friction times slope of 0.9 or more, at which asperities lock; a law of friction, wear or
        yielding, which do not go with slopes.
    """

    slope: Floats

    summary_units: ClassVar[dict[str, str]] = {**Ensemble.summary_units, "slope": ""}
    stepper = unsupported_method(_no("stepper"))
    with_friction = unsupported_method(_no("change of friction"))
    with_geometry = unsupported_method(_no("change of geometry"))

    def __init__(
        self,
        pair: MaterialPair,
        summit_height: npt.ArrayLike,
        summit_radius: npt.ArrayLike,
        friction: npt.ArrayLike,
        *,
        slope: npt.ArrayLike,
        **options: Any,
    ) -> None:
        for name in ("wear", "yielding", "follow_sliding"):
            if options.pop(name, None):
                raise _refused(name.replace("_", " "))
        nouns, count = ("asperity", "asperities"), max(map(np.size, (summit_height, summit_radius, slope)))
        height = one_per(*nouns, "summit_height", summit_height, count)
        super().__init__(pair, height, summit_radius, friction, **options)
        if self.law is not None:
            raise _refused("law of friction")
        slopes = one_per(*nouns, "slope", slope, count)
        object.__setattr__(self, "slope", slopes)
        locked = np.flatnonzero(~(np.abs(slopes) * self.friction < STEEPEST_SLIDING))
        if locked.size:
            index = locked[0]
            raise InputError(
                f"slope[{index}] is {slopes[index]:g} with friction {self.friction[index]:g}; expected less than "
                f"{STEEPEST_SLIDING} as their product, at which a sliding asperity locks"
            )

    @cached_property
    def facets(self) -> tuple[Facet, ...]:
        """Level ensembles in rotated axes, one for each slope, ascending."""
        slopes, which = np.unique(self.slope, return_inverse=True)
        return tuple(Facet.of(self, slope, np.flatnonzero(which == i)) for i, slope in enumerate(slopes.tolist()))

    @cached_property
    def _axes(self) -> Floats:
        return np.array([(facet.cosine, facet.sine) for facet in self.facets])

    def initial_state(self) -> InclinedState:  # type: ignore[override] # a state of its own kind
        """Return the unloaded virgin state, with the body at d = U = 0."""
        return InclinedState(tuple(facet.beginning() for facet in self.facets), self._axes, 0.0, 0.0)

    def advance(self, state: InclinedState, **targets: Any) -> InclinedState:  # type: ignore[override]
        """Return the state after one joint straight path; parameters and errors as for `Ensemble.advance`.

        A tangential load, an instrument, a pair of targets or another friction is an InputError, unless nothing slopes.
        """
        advanced_state: Any = super().advance(state, **targets)  # type: ignore[arg-type] # a state of its own kind
        moved: InclinedState = advanced_state
        return moved

    def walk(  # type: ignore[override] # a state of its own kind
        self,
        state: InclinedState,
        paths: Paths,
        *,
        rows: Rows | None = None,
        asperities: npt.ArrayLike = (),
        until: float = 1.0,
        **how: Any,
    ) -> InclinedState:
        """Advance a state along load paths and record rows; see `Ensemble.walk`, `advance`."""
        self._checked_memory(state)
        if how.pop("friction", None) is not None:
            raise _refused("change of friction")
        if are_in_plane(paths):
            raise _refused("second tangential direction")
        if not self.slope.any():
            level = self.facets[0].walk(state.facets[0], paths, rows=rows, asperities=asperities, until=until, **how)
            controls = level.memory.line.normal_control, level.memory.line.tangential_control
            return InclinedState((level,), self._axes, level.approach, level.tangential_displacement, *controls)
        instrument = as_instrument(how.get("instrument", RIGID))
        if not instrument.rigid or instrument.parallel_stiffness:
            raise _refused("instrument in series or in parallel")
        pushed = np.flatnonzero((paths["tangential_control"][:, 0] == LOAD) & (paths["tangential_fraction"][:, 0] > 0))
        if pushed.size:
            refusal = _refused("given tangential load")
            refusal.path = int(pushed[0])
            raise refusal
        legs = self._legs(state, paths, until)
        if rows is None:
            rows, legs = blank_rows(0, None), unrecorded(legs)
        ends = np.stack([legs["normal_target"], legs["tangential_target"][:, 0]])
        columns, facets = np.asarray(asperities, dtype=np.int64), []
        rows.totals[:] = np.zeros((), rows.totals.dtype)
        along = np.zeros(len(rows.totals))
        for facet, start in zip(self.facets, state.facets, strict=True):
            facet_rows, facet_legs, members = (
                blank_rows(len(rows.totals), len(facet)),
                legs.copy(),
                np.arange(len(facet)),
            )
            facet_legs["normal_target"], facet_legs["tangential_target"][:, 0] = facet.turned(*ends)
            facets.append(
                facet.walk(start, facet_legs, rows=facet_rows, asperities=members, threads=how.get("threads", 1))
            )
            facet.add_to(rows.totals, facet_rows)
            along += facet.sine * facet_rows.totals["normal_load"]
            _, facet_columns, row_columns = np.intersect1d(facet.members, columns, return_indices=True)
            for name, values in rows.each.items():
                values[:, row_columns] = facet_rows.each[name][:, facet_columns]
        rows.totals["friction_limit"] += np.abs(along)
        positions = np.column_stack([(state.approach, state.tangential_displacement), ends])
        rows.totals["approach"], rows.totals["displacement"] = _of_rows(positions, legs)
        controls = int(paths[-1]["normal_control"]), int(paths[-1]["tangential_control"][0])
        return InclinedState(tuple(facets), self._axes, float(positions[0, -1]), float(positions[1, -1]), *controls)

    def slide_time(self, state: InclinedState) -> Floats:  # type: ignore[override] # a state of its own kind
        """Return the time at which each asperity first slid as a whole in a replay [s]; NaN if never."""
        times = np.empty(len(self))
        for facet, facet_state in zip(self.facets, state.facets, strict=True):
            times[facet.members] = facet.slide_time(facet_state)
        return times

    def may_touch(self, normal_load: float, approach: float, displacement: float) -> Booleans:
        """Select asperities that may touch up to a normal load [N], an approach [m] and a displacement either way [m].

        At least the share 1 - μ |tan α| of what presses an asperity carries the body, and at most 1 + μ |tan α|.
        """
        product, steep = float((self.friction * np.abs(self.slope)).max()), np.abs(self.slope)
        deepest = max(approach, self.approach_at(normal_load * (1 + product) / (1 - product)))
        touching: Booleans = self.first_touch < deepest + displacement * (steep.max() + steep)
        return touching

    def asperity(self, index: int, state: InclinedState) -> Asperity:  # type: ignore[override] # a state of its kind
        """Return one asperity in the axes of its slope; InputError if the index is out of range."""
        self._checked_memory(state)
        for facet, facet_state in zip(self.facets, state.facets, strict=True):
            if index in facet.members:
                return Asperity.from_readout(
                    Readout(facet, facet_state, [int(np.searchsorted(facet.members, index))]), 0, int(index)
                )
        raise InputError(f"asperity {index} does not exist; expected an index from 0 to {len(self) - 1}")

    def asperities(self, state: InclinedState) -> Asperities:  # type: ignore[override] # a state of its kind
        """Return all asperities in the axes of their slopes, as a sequence; see `Ensemble.asperities`."""
        self._checked_memory(state)
        columns: dict[int, tuple[Readout, int]] = {}
        for facet, facet_state in zip(self.facets, state.facets, strict=True):
            readout = Readout(facet, facet_state, range(len(facet)))
            columns |= {int(index): (readout, column) for column, index in enumerate(facet.members)}
        return Asperities(lambda index: Asperity.from_readout(*columns[index], index), range(len(self)))

    def _checked_memory(self, state: Any) -> Any:
        """Return the channel controls of a state; InputError if it belongs to another ensemble."""
        if not isinstance(state, InclinedState) or len(state.facets) != len(self.facets):
            raise InputError(f"state is {state!r}; expected one of this ensemble's, such as initial_state() returns")
        return _Controls(state.normal_control, state.tangential_control)

    def _legs(self, state: InclinedState, paths: Paths, until: float) -> Paths:
        """Convert paths to straight legs in d and U; a path under normal load becomes chords."""
        position = state.approach, state.tangential_displacement
        body = Body(self.facets, tuple(facet.memory for facet in state.facets), *position)
        loaded = bool((paths["normal_control"] == LOAD).any())
        legs: list[tuple[float, ...]] = []
        for path in paths:
            fields = dict(zip(PATH.names or (), path.item(), strict=True))
            start_time, substeps, duration = fields["begin"], fields["parts"], fields["end"] - fields["begin"]
            share, normal_target = until * fields["normal_fraction"], fields["normal_target"]
            (goal, _), (fraction, _) = fields["tangential_target"], fields["tangential_fraction"]
            displacement = float(towards(body.displacement, goal, until * fraction))
            if fields["normal_control"] == DISPLACED:
                approach = float(towards(body.approach, normal_target, share))
                legs.append((approach, displacement, substeps, fields["recorded"], start_time, fields["end"]))
                # loads alone ask what is remembered on the way
                body = body.moved(approach, displacement) if loaded else Body((), (), approach, displacement)
                continue
            first = body.loads[0], body.displacement
            last = float(towards(first[0], normal_target, share)), displacement

            def at(substep: float, first: Any = first, last: Any = last) -> tuple[float, float]:
                return float(towards(first[0], last[0], substep)), float(towards(first[1], last[1], substep))

            low = 0.0
            for substep in range(1, substeps + 1):
                for high, body in body.chords(at, low, substep / substeps, self.tolerance):  # noqa: B020
                    recorded = high == substep / substeps and (substep < substeps or fields["recorded"])
                    times = start_time + duration * low, start_time + duration * high
                    legs.append((body.approach, body.displacement, 1, recorded, *times))
                    low = high
        columns = np.array(legs).reshape(-1, 6).T
        goals = Goals(DISPLACED, columns[0]), Goals(DISPLACED, columns[1])
        return paths_to(*goals, parts=columns[2], recorded=columns[3], times=(columns[4], columns[5]))


def _of_rows(ways: Floats, legs: Paths) -> Floats:
    """Interpolate d and U at each recorded row (2, row) between the ends of each leg (2, leg + 1)."""
    leg = np.repeat(np.arange(legs.size), legs["parts"] - 1 + legs["recorded"])
    share = (np.arange(leg.size) - legs["first_row"][leg] + 1) / legs["parts"][leg]
    values: Floats = towards(ways[:, leg], ways[:, leg + 1], share)
    return values
