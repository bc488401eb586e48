"""`InclinedEnsemble`: asperities that meet on slopes, as facets that are level in rotated axes."""

import math
import struct
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar, Self, Unpack

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.asperity import Asperities, Asperity
from historysim.asperities.asperity_set import AsperitySet, per_asperity, summit_fields
from historysim.asperities.body import Feature, PathOptions
from historysim.asperities.facets import BodyPosition, Facet, interpolate
from historysim.asperities.instrument import RIGID, Instrument, as_instrument
from historysim.asperities.law import FrictionLaw
from historysim.asperities.readout import Readout
from historysim.asperities.state import SavedState, State
from historysim.asperities.stepper import channel, make_path
from historysim.basics.arguments import Booleans, Floats, scalar
from historysim.basics.limits import is_workable
from historysim.contact.materials import MaterialPair
from historysim.errors import FrictionLimitError, InputError
from historysim.memory.binding import DISPLACED, LOAD, PATH, are_in_plane
from historysim.memory.paths import Goals, Paths, blank_rows, drop_rows, straight_paths

# Most of friction times slope. At 1 a sliding asperity locks: pressed down, it carries no more of
# the load.
STEEPEST_SLIDING = 0.9
_HEAD = struct.Struct("<8sqqqddd")
_MARK = b"hsinclin"
UNIT_ROUNDING = 1e-12  # of the length of the axes of a slope


def _facet_sum(quantity: Callable[[State, float, float], float], text: str) -> float:
    """Return a property that sums a quantity over facet states, given their cosine and sine."""

    def total(state: Any) -> float:
        return math.fsum(
            quantity(facet, *axis)
            for axis, facet in zip(state.axes.tolist(), state.facets, strict=True)
        )

    return property(total, doc=text)  # type: ignore[return-value] # its value is a float


@attrs.frozen(eq=False, repr=False)
class InclinedState(SavedState):
    """State of an `InclinedEnsemble`: a value that can be pickled, and compared bit for bit."""

    facets: tuple[State, ...]  #: one for each slope, ascending, in axes turned by it
    axes: Floats  #: cosine and sine of each (facet, 2)
    approach: float  #: of the whole body, d [m]
    tangential_displacement: float  #: of the whole body, U [m]
    normal_control: int = LOAD
    #: `LOAD` once a tangential load is given; before U is held
    tangential_control: int = DISPLACED
    #: part of a requested tangential load beyond the friction limit that holds it [N]
    excess: float = 0.0

    normal_load = _facet_sum(
        lambda facet, c, s: facet.normal_load * c - facet.tangential_load * s,
        "Total normal load Σ (N cos α - T sin α) [N].",
    )
    tangential_load = _facet_sum(
        lambda facet, c, s: facet.tangential_load * c + facet.normal_load * s,
        "Total tangential load Σ (T cos α + N sin α) [N].",
    )
    slope_load = _facet_sum(
        lambda facet, _, s: facet.normal_load * s,
        "Part of the tangential load that needs no friction, Σ N sin α [N].",
    )
    tangential_stiffness = _facet_sum(
        lambda facet, c, s: facet.tangential_stiffness * (c * c) + facet.normal_stiffness * (s * s),
        "∂T/∂U at a held approach, of the springs that stick now [N/m].",
    )
    dissipated_energy = _facet_sum(
        lambda facet, _c, _s: facet.dissipated_energy,
        "Energy that friction has taken since the start [J].",
    )
    stored_energy = _facet_sum(
        lambda facet, _c, _s: facet.stored_energy,
        "Elastic energy of all asperities along their slopes [J].",
    )

    @property
    def _excess(self) -> float:
        return self.excess

    @property
    def contact_count(self) -> int:
        """Number of asperities that touch."""
        return sum(facet.contact_count for facet in self.facets)

    def to_bytes(self) -> bytes:
        """Serialise the state."""
        controls = self.normal_control, self.tangential_control
        position = self.approach, self.tangential_displacement, self.excess
        head = _HEAD.pack(_MARK, len(self.facets), *controls, *position)
        contents = [facet.to_bytes() for facet in self.facets]
        sizes = struct.pack(f"<{len(contents)}q", *map(len, contents))
        return b"".join([head, self.axes.tobytes(), sizes, *contents])

    @classmethod
    def from_bytes(cls, content: bytes, like: Any = None) -> Self:
        """Read the state from the result of `to_bytes`; see `SavedState`."""
        try:
            mark, count, normal, tangential, approach, displacement, excess = _HEAD.unpack_from(
                content
            )
            # a forged number may be larger than NumPy accepts
            count = max(-1, min(count, len(content)))
            axes = np.frombuffer(content, np.float64, 2 * count, _HEAD.size).reshape(count, 2)
            offset = _HEAD.size + axes.nbytes
            sizes = np.frombuffer(content, np.int64, count, offset)
        except (struct.error, ValueError) as error:
            raise InputError(
                f"the state is cut off ({error}); expected a state that was saved whole"
            ) from None
        ends = offset + sizes.nbytes + np.cumsum(sizes)
        is_complete = mark == _MARK and count > 0 and (sizes > 0).all() and ends[-1] == len(content)
        if not (is_complete and {normal, tangential} <= {LOAD, DISPLACED}):
            raise InputError(
                "the bytes are of no inclined asperities; expected a state that was saved whole"
            )
        are_unit_vectors = (np.abs(np.hypot(*axes.T) - 1.0) <= UNIT_ROUNDING) & (axes[:, 0] > 0.0)
        if not (are_unit_vectors.all() and all(map(is_workable, (approach, displacement, excess)))):
            raise InputError(
                "a slope, the approach, the displacement or the excess load of the state is not a "
                "number, or beyond the largest that is computed with; expected a state that was saved whole"
            )
        if like is not None and not np.array_equal(like.axes, axes):
            raise InputError("the state is of other slopes; expected one of this ensemble's")
        starts = (None,) * count if like is None else like.facets
        facet_contents = [
            content[stop - size : stop]
            for size, stop in zip(sizes.tolist(), ends.tolist(), strict=True)
        ]
        facets = [
            State.from_bytes(content_of_facet, start)
            for content_of_facet, start in zip(facet_contents, starts, strict=True)
        ]
        return cls(tuple(facets), axes, approach, displacement, normal, tangential, excess)


def _unsupported_text(feature: str) -> str:
    return (
        f"inclined asperities have no {feature}; expected constant coefficients, and motion along x"
    )


# no slots: cached properties need an instance dictionary
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class InclinedEnsemble(AsperitySet):
    """Asperities of two rough bodies that meet on slopes, so that tangential motion lifts the body and needs a load.

    The contact plane of an asperity rises with its slope in the direction of motion. The body moves
    by its approach d and displacement U; the asperity is pressed along the normal of its plane by d
    cos α + U sin α, and moved along it by U cos α - d sin α, and remembers that path exactly
    (theory page, `contact/README.md`, "Inclined asperities"). A slope of 0 everywhere gives the
    bits of `Ensemble`.

    Slopes do not change with U and asperities keep their partners: U has to be small compared with
    the radii. Paths are exact where displacements are given. Under a normal load they are followed
    in chords, until approach and loads have converged to ``tolerance``, and so are paths under both
    loads, until U has. A path to an approach and a tangential load is straight in d and U. U is
    held until a displacement or a tangential load is given.

    A tangential load is met at the nearest U in the direction in which load is missing. The
    friction limit is the largest load that any U carries, up to a further motion by the smallest
    radius: more than where all asperities slide at first, since the body then climbs its steepest
    slopes. With ``saturate`` a load beyond it is held just below it, at the nearest U that carries
    that.

    Parameters
    ----------
    pair, summit_height, summit_radius, friction, x, y, nominal_area, tolerance
        As for `Ensemble`. The height is the separation at which the asperity touches where U = 0,
        the radius 1/R = 1/R1 + 1/R2.
    slope : array_like
        tan α of the contact plane, > 0 where a positive U climbs, one for all or one per asperity.

    Raises
    ------
    InputError
        As for `Ensemble`; a law of friction; friction times slope of 0.9 or more, at which
        asperities lock.
    """

    pair: MaterialPair
    summit_height: Floats
    summit_radius: Floats
    friction: Floats
    x: Floats | None
    y: Floats | None
    tolerance: float
    nominal_area: float | None
    slope: Floats

    summary_units: ClassVar[Mapping[str, str]] = {**AsperitySet.summary_units, "slope": ""}
    unsupported: ClassVar[Mapping[Feature, str]] = {
        "wear": _unsupported_text("wear"),
        "yielding": _unsupported_text("yielding"),
        "attraction": _unsupported_text("attraction"),
        "sliding": _unsupported_text("record of sliding"),
        "friction law": _unsupported_text("law of friction"),
        "friction change": _unsupported_text("change of friction"),
        "friction change of some": _unsupported_text("change of friction"),
        "friction ramp": _unsupported_text("change of friction"),
        "geometry change": _unsupported_text("change of geometry"),
        "step in place": _unsupported_text("stepper"),
        "fit": "the asperities are inclined; expected level ones for a fit",
    }

    def __init__(  # noqa: PLR0913 - the parameters of asperities, with slopes
        self,
        pair: MaterialPair,
        summit_height: npt.ArrayLike,
        summit_radius: npt.ArrayLike,
        friction: npt.ArrayLike,
        *,
        slope: npt.ArrayLike,
        x: npt.ArrayLike | None = None,
        y: npt.ArrayLike | None = None,
        nominal_area: float | None = None,
        tolerance: float = 1e-6,
    ) -> None:
        if isinstance(friction, FrictionLaw):
            raise InputError(self.unsupported["friction law"])
        options: dict[str, Any] = {
            "x": x,
            "y": y,
            "nominal_area": nominal_area,
            "tolerance": tolerance,
        }
        fields = summit_fields(
            pair, summit_height, summit_radius, friction, count=np.size(slope), **options
        )
        slopes = per_asperity("slope", slope, fields["summit_height"].size)
        self.__attrs_init__(**fields, slope=slopes)
        locked = np.flatnonzero(~(np.abs(slopes) * self.friction < STEEPEST_SLIDING))
        if locked.size:
            index = locked[0]
            raise InputError(
                f"slope[{index}] is {slopes[index]:g} with friction {self.friction[index]:g}; expected less than "
                f"{STEEPEST_SLIDING} as their product, at which a sliding asperity locks"
            )

    @property
    def direction_limit(self) -> str:
        """Feature that restricts it to one tangential direction."""
        return "summits that meet on slopes"

    @property
    def coordinates(self) -> dict[str, Floats]:
        """Properties of each asperity: height, radius, friction, slope; if known its position."""
        return super().coordinates | {"slope": self.slope}

    @cached_property
    def facets(self) -> tuple[Facet, ...]:
        """Level ensembles in rotated axes, one for each slope, ascending."""
        slopes, which = np.unique(self.slope, return_inverse=True)
        return tuple(
            Facet(self, slope, np.flatnonzero(which == i))
            for i, slope in enumerate(slopes.tolist())
        )

    @cached_property
    def _axes(self) -> Floats:
        return np.array([(facet.cosine, facet.sine) for facet in self.facets])

    def initial_state(self) -> InclinedState:
        """Return the unloaded virgin state, with the body at d = U = 0."""
        facets = tuple(facet.unloaded_state() for facet in self.facets)
        control = DISPLACED if self.slope.any() else LOAD
        return InclinedState(facets, self._axes, 0.0, 0.0, tangential_control=control)

    def check_state(self, state: Any) -> None:
        """Raise an InputError if a state does not belong to this ensemble."""
        if not isinstance(state, InclinedState) or len(state.facets) != len(self.facets):
            raise InputError(
                f"state is {state!r}; expected one of this ensemble's, such as initial_state() returns"
            )

    def read_controls(self, state: Any) -> tuple[int, int]:
        """Return how the normal and tangential channels were controlled last."""
        self.check_state(state)
        return state.normal_control, state.tangential_control

    def advance(
        self,
        state: InclinedState,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | tuple[float | None, float | None] | None = None,
        tangential_displacement: float | tuple[float | None, float | None] | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> InclinedState:
        """Return the state after one joint straight path; parameters and errors as for `Ensemble.advance`.

        An instrument or a pair of targets is an InputError, unless all slopes are 0.
        """
        normal_control, tangential_control = self.read_controls(state)
        normal = channel("normal", normal_load, normal_displacement, normal_control, 0.0)
        tangential = channel(
            "tangential", tangential_load, tangential_displacement, tangential_control
        )
        return self.advance_along(
            state, make_path(normal, tangential), saturate=saturate, instrument=instrument
        )

    def approach_at(self, normal_load: float) -> float:
        """Solve for the approach [m] at which the virgin contact first carries a normal load ≥ 0 [N], at U = 0."""
        load = scalar("normal_load", normal_load, least=0.0)
        return self.advance(self.initial_state(), normal_load=load).approach if load > 0 else 0.0

    def advance_along(
        self,
        state: InclinedState,
        paths: Paths,
        **options: Unpack[PathOptions],
    ) -> InclinedState:
        """Advance a state along load paths and record rows; see `PathOptions` and `advance`."""
        rows, instrument = options.get("rows"), options.get("instrument", RIGID)
        self.check_state(state)
        if are_in_plane(paths):
            raise InputError(_unsupported_text("second tangential direction"))
        if not self.slope.any():
            level = self.facets[0].advance_along(state.facets[0], paths, **options)
            controls = level.memory.line.normal_control, level.memory.line.tangential_control
            position = level.approach, level.tangential_displacement
            return InclinedState((level,), self._axes, *position, *controls, level._excess)
        if not as_instrument(instrument).rigid or instrument.parallel_stiffness:
            raise InputError(_unsupported_text("instrument in series or in parallel"))
        legs, held, end = self._body_legs(
            state, paths, options.get("until", 1.0), options.get("saturate", False)
        )
        if rows is None:
            rows, legs = blank_rows(0, None), drop_rows(legs)
        ends = np.stack([legs["normal_target"], legs["tangential_target"][:, 0]])
        columns, facets = np.asarray(options.get("asperities", ()), dtype=np.int64), []
        threads = options.get("threads", 1)
        rows.totals[:] = np.zeros((), rows.totals.dtype)
        along = np.zeros(len(rows.totals))
        for facet, start in zip(self.facets, state.facets, strict=True):
            facet_rows, facet_legs, members = (
                blank_rows(len(rows.totals), len(facet)),
                legs.copy(),
                np.arange(len(facet)),
            )
            facet_legs["normal_target"], facet_legs["tangential_target"][:, 0] = (
                facet.to_facet_axes(*ends)
            )
            facets.append(
                facet.advance_along(
                    start, facet_legs, rows=facet_rows, asperities=members, threads=threads
                )
            )
            facet.accumulate_rows(rows.totals, facet_rows)
            along += facet.sine * facet_rows.totals["normal_load"]
            _, facet_columns, row_columns = np.intersect1d(
                facet.members, columns, return_indices=True
            )
            for name, values in rows.each.items():
                values[:, row_columns] = facet_rows.each[name][:, facet_columns]
        rows.totals["friction_limit"] += np.abs(along)
        row = (legs["first_row"] + legs["parts"] - 1)[held]
        rows.totals["saturated"][row[row < along.size]] = 1.0
        positions = np.column_stack([(state.approach, state.tangential_displacement), ends])
        rows.totals["approach"], rows.totals["displacement"] = _interpolate_rows(positions, legs)
        return InclinedState(
            tuple(facets),
            self._axes,
            float(positions[0, -1]),
            float(positions[1, -1]),
            int(paths[-1]["normal_control"]),
            *end,
        )

    def slide_time(self, state: InclinedState) -> Floats:
        """Return the time at which each asperity first slid as a whole in a replay [s]; NaN if never."""
        times = np.empty(len(self))
        for facet, facet_state in zip(self.facets, state.facets, strict=True):
            times[facet.members] = facet.slide_time(facet_state)
        return times

    def _may_touch(self, normal_load: float, approach: float, displacement: float) -> Booleans:
        """Select asperities that may touch up to a normal load [N], an approach [m] and a displacement either way [m].

        At least the share 1 - μ |tan α| of what presses an asperity carries the body, and at most 1
        + μ |tan α|.
        """
        if not self.slope.any():
            return super()._may_touch(normal_load, approach, displacement)
        product, steep = float((self.friction * np.abs(self.slope)).max()), np.abs(self.slope)
        deepest = max(approach, self.approach_at(normal_load * (1 + product) / (1 - product)))
        touching: Booleans = self.first_touch < deepest + displacement * (steep.max() + steep)
        return touching

    def asperity(self, index: int, state: InclinedState) -> Asperity:
        """Return one asperity in the axes of its slope; InputError if the index is out of range."""
        self.check_state(state)
        for facet, facet_state in zip(self.facets, state.facets, strict=True):
            if index in facet.members:
                return Asperity.from_readout(
                    Readout(facet, facet_state, [int(np.searchsorted(facet.members, index))]),
                    0,
                    int(index),
                )
        raise InputError(
            f"asperity {index} does not exist; expected an index from 0 to {len(self) - 1}"
        )

    def asperities(self, state: InclinedState) -> Asperities:
        """Return all asperities in the axes of their slopes, as a sequence; see `Ensemble.asperities`."""
        self.check_state(state)
        columns: dict[int, tuple[Readout, int]] = {}
        for facet, facet_state in zip(self.facets, state.facets, strict=True):
            readout = Readout(facet, facet_state, range(len(facet)))
            columns |= {int(index): (readout, column) for column, index in enumerate(facet.members)}
        return Asperities(
            lambda index: Asperity.from_readout(*columns[index], index), range(len(self))
        )

    def _body_legs(
        self, state: InclinedState, paths: Paths, until: float, saturate: bool
    ) -> tuple[Paths, Booleans, tuple[int, float]]:
        """Convert paths to straight legs in d and U; a path under normal load becomes chords.

        Return the legs, those at whose end a tangential load is held at the limit, and the
        tangential control and the excess of the state at the end.
        """
        position = state.approach, state.tangential_displacement, state.excess
        body = BodyPosition(self.facets, tuple(facet.memory for facet in state.facets), *position)
        control = state.tangential_control
        given = paths["tangential_control"][:, 0] == LOAD
        # a load that was never given is none to hold
        given &= (paths["tangential_fraction"][:, 0] > 0) | (control == LOAD)
        loaded = bool((given | (paths["normal_control"] == LOAD)).any())
        legs: list[tuple[float, ...]] = []
        for index, path in enumerate(paths):
            fields = dict(zip(PATH.names or (), path.item(), strict=True))
            start_time, substeps, duration = (
                fields["begin"],
                fields["parts"],
                fields["end"] - fields["begin"],
            )
            fraction_end, normal_target = until * fields["normal_fraction"], fields["normal_target"]
            (goal, _), (fraction, _) = fields["tangential_target"], fields["tangential_fraction"]
            by_load = fields["tangential_control"][0] == LOAD and (fraction > 0 or control == LOAD)
            control = LOAD if by_load else DISPLACED
            if not (by_load and saturate):
                body = attrs.evolve(body, excess=0.0)
            begin = body.loads[1] + body.excess if by_load else body.displacement
            try:
                if fields["normal_control"] == DISPLACED:
                    if by_load:
                        body = self._move_straight(
                            body,
                            interpolate(body.approach, normal_target, fields["normal_fraction"]),
                            interpolate(begin, goal, fraction),
                            until,
                            saturate,
                        )
                    else:
                        approach = float(interpolate(body.approach, normal_target, fraction_end))
                        displacement = float(interpolate(begin, goal, until * fraction))
                        # the memory is needed only for later paths under load control
                        body = (
                            body.move_to(approach, displacement)
                            if loaded
                            else BodyPosition((), (), approach, displacement)
                        )
                    end = substeps, fields["recorded"], start_time, fields["end"]
                    legs.append((body.approach, body.displacement, *end, body.excess != 0.0))
                    continue
                origin = np.array([body.loads[0], begin])
                target = np.array(
                    [
                        interpolate(origin[0], normal_target, fraction_end),
                        interpolate(begin, goal, until * fraction),
                    ]
                )

                def targets_at(
                    substep: float, origin: Any = origin, target: Any = target
                ) -> tuple[float, float]:
                    load, tangential = interpolate(origin, target, substep).tolist()
                    return load, tangential

                low, how = 0.0, {"by_loads": by_load, "saturate": saturate}
                for substep in range(1, substeps + 1):
                    part = low, substep / substeps
                    for high, body in body.chords(targets_at, *part, self.tolerance, **how):  # noqa: B020
                        recorded = high == part[1] and (substep < substeps or fields["recorded"])
                        times = start_time + duration * low, start_time + duration * high
                        place = body.approach, body.displacement
                        legs.append((*place, 1, recorded, *times, body.excess != 0.0))
                        low = high
            except FrictionLimitError as error:
                error.path = index
                raise
        columns = np.array(legs).reshape(-1, 7).T
        goals = Goals(DISPLACED, columns[0]), Goals(DISPLACED, columns[1])
        straight = straight_paths(
            *goals, parts=columns[2], recorded=columns[3], times=(columns[4], columns[5])
        )
        return straight, columns[6] > 0.0, (control, body.excess)

    @staticmethod
    def _move_straight(
        body: BodyPosition, approach: float, load: float, until: float, saturate: bool
    ) -> BodyPosition:
        """Move a body along a part of the straight path in d and U to an approach and a tangential load."""
        end = body.solve_at_tangential_load(float(load), saturate, approach=float(approach))
        if until == 1.0:
            return end
        start = np.array([body.approach, body.displacement])
        there = interpolate(start, np.array([end.approach, end.displacement]), until)
        return body.move_to(*there.tolist())


def _interpolate_rows(positions: Floats, legs: Paths) -> Floats:
    """Interpolate d and U at each recorded row (2, row) between the ends of each leg (2, leg + 1)."""
    leg = np.repeat(np.arange(legs.size), legs["parts"] - 1 + legs["recorded"])
    share = (np.arange(leg.size) - legs["first_row"][leg] + 1) / legs["parts"][leg]
    values: Floats = interpolate(positions[:, leg], positions[:, leg + 1], share)
    return values
