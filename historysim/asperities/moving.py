"""How the state of an ensemble moves: along paths, by other friction, by other summits."""

import math
from functools import partial

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.course import Present
from historysim.asperities.evolution import Evolution
from historysim.asperities.evolved import Evolved
from historysim.asperities.friction import FrictionGoal, coulomb
from historysim.asperities.grouping import groups, leaders, ordered, regrouped
from historysim.asperities.instrument import RIGID, Instrument, as_instrument
from historysim.asperities.parameters import Parameters
from historysim.asperities.projectors import Projectors
from historysim.asperities.state import EnsembleState
from historysim.asperities.stepper import HELD, Stepper, Totals, channel, goals, stepped
from historysim.basics.arguments import checked, one_per, scalar
from historysim.errors import FrictionLimitError, InputError
from historysim.memory.friction import change_friction
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    EXCESS,
    NORMAL_LOAD,
    TANGENTIAL,
    TANGENTIAL_LOAD,
    Memory,
    Units,
)
from historysim.memory.normal import approach_at
from historysim.memory.paths import DISPLACED, LEAST_APPROACH, LEAST_LOAD, LOAD, STILL, Goals, Paths, paths_to
from historysim.memory.polyline import Aim
from historysim.memory.rows import Rows, blank_rows, columns_of
from historysim.memory.stacks import copied

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@attrs.frozen(eq=False)
class Moving:
    """How states of an ensemble move; what its methods take and return `Ensemble` says.

    Parameters
    ----------
    parameters : Parameters
        Of the ensemble.
    """

    parameters: Parameters

    @property
    def evolution(self) -> Evolution:
        """What makes the asperities evolve."""
        of = self.parameters
        return Evolution(of.pair, of.law, of.wear, of.units(), of.highest_summit, of.tolerance)

    def initial_state(self) -> EnsembleState:
        """Return the unloaded state."""
        # asperities whose friction depends on themselves share what they remember where they are alike
        alone = self.parameters.wear is not None or (
            self.parameters.law is not None and self.parameters.law.depends_on in {"own", "slid"}
        )
        own = (self.parameters.summit_height, self.parameters.summit_radius) if alone else ()
        contact, order = ordered(
            groups(self.parameters.friction, *own),
            self.parameters.friction,
            *self.parameters.shape(),
            by_gap=self.parameters.by_gap,
        )
        count = contact.friction.size
        memory = Memory(
            vertices=np.zeros((count, 1, TANGENTIAL + 1)),
            depth=np.zeros(count, dtype=np.int64),
            steep=np.zeros(count, dtype=np.bool_),
            dissipated=np.zeros(self.parameters.elements),
            now=np.zeros(6),
        )
        evolved = (
            Evolved.start(self.parameters.summit_height, self.parameters.summit_radius)
            if self.parameters.evolves
            else None
        )
        return EnsembleState(contact, order, memory, self.parameters.units(), evolved=evolved)

    def advance(
        self,
        state: EnsembleState,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | None = None,
        tangential_displacement: float | None = None,
        friction: "npt.ArrayLike | None" = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> EnsembleState:
        """Return the state after one joint straight path."""
        normal = channel("normal", normal_load, normal_displacement, state.normal_control, 0.0)
        tangential = channel("tangential", tangential_load, tangential_displacement, state.tangential_control)
        if self.parameters.curves is not None:
            self.parameters.curves.check_reach(paths_to(goals(normal), goals(tangential)))
        if state.evolved is not None:
            return self._advanced(state, (normal, tangential), friction, saturate, instrument)
        compliance = 0.0 if instrument is RIGID else _compliance(instrument, state.units)
        options = (saturate, self.parameters.tolerance, compliance)
        state = stepped(state, normal, tangential, *options)
        if friction is not None:
            state = self.with_friction(state, friction, instrument=instrument)
            state = stepped(state, (state.normal_control, HELD), (state.tangential_control, HELD), *options)
        return state

    def _advanced(
        self,
        state: EnsembleState,
        targets: tuple[tuple[int, float], tuple[int, float]],
        friction: "npt.ArrayLike | None",
        saturate: bool,
        instrument: Instrument,
    ) -> EnsembleState:
        """`advance` where asperities evolve, to targets in N and m."""
        state = self.walk(state, paths_to(*map(goals, targets)), saturate=saturate, instrument=instrument)
        if friction is None:
            return state
        state = self.with_friction(state, friction, instrument=instrument)
        still = (state.normal_control, HELD), (state.tangential_control, HELD)
        return self.walk(state, paths_to(*map(goals, still)), saturate=saturate, instrument=instrument)

    def advance_many(
        self,
        state: EnsembleState,
        *,
        normal_load: "npt.ArrayLike | None" = None,
        normal_displacement: "npt.ArrayLike | None" = None,
        tangential_load: "npt.ArrayLike | None" = None,
        tangential_displacement: "npt.ArrayLike | None" = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> tuple[EnsembleState, Totals]:
        """Return the state after straight paths, and the totals at the end of each."""
        normal = _goals_of("normal", normal_load, normal_displacement, state.normal_control, least=0.0)
        tangential = _goals_of("tangential", tangential_load, tangential_displacement, state.tangential_control)
        counts = {np.size(goals.target) for goals in (normal, tangential)} - {1}
        if len(counts) > 1:
            raise InputError(
                f"the channels have {min(counts)} and {max(counts)} values; expected as many, or one number"
            )
        if 0 in counts:
            raise InputError("there is no value; expected one for each path")
        paths = paths_to(normal, tangential)
        rows = blank_rows(paths.parts.size, 0)
        state = self.walk(state, paths, rows=rows, saturate=saturate, instrument=instrument)
        return state, Totals.of(rows.totals)

    def stepper(
        self, state: EnsembleState | None = None, *, saturate: bool = False, instrument: Instrument = RIGID
    ) -> Stepper:
        """Return what steps a state in place."""
        state = state or self.initial_state()
        if state.evolved is not None:
            raise InputError("asperities that evolve are not stepped in place; expected advance, path by path")
        compliance = _compliance(instrument, state.units)
        return Stepper(
            state,
            saturate=saturate,
            tolerance=self.parameters.tolerance,
            compliance=compliance,
            curves=self.parameters.curves,
        )

    def with_friction(
        self,
        state: EnsembleState,
        friction: "npt.ArrayLike",
        *,
        asperities: "npt.ArrayLike | None" = None,
        instrument: Instrument = RIGID,
    ) -> EnsembleState:
        """Return the state with other friction coefficients from now on."""
        coefficients = self._given_coefficients(state, friction, asperities)
        evolved = state.evolved
        if evolved is not None:
            given = evolved.given.copy()
            given[slice(None) if asperities is None else np.asarray(asperities)] = True
            evolved = attrs.evolve(evolved, given=given)
        compliance = _compliance(instrument, state.units)
        state = regrouped(state, coefficients)
        now, leading = state.memory.now, coefficients[leaders(state)]
        if state.tangential_control == LOAD:
            held = Aim(now[TANGENTIAL_LOAD], 0.0, 1.0)
        else:
            held = Aim(now[DISPLACEMENT] + compliance * now[TANGENTIAL_LOAD], 1.0, compliance)
        memory = change_friction(state.contact, copied(state.memory), leading, held, self.parameters.tolerance)
        contact = state.contact._replace(friction=leading)
        controls = (state.normal_control, state.tangential_control)
        return EnsembleState(contact, state.order, memory, state.units, *controls, evolved=evolved)

    def with_geometry(
        self,
        state: EnsembleState,
        *,
        summit_height: "npt.ArrayLike | None" = None,
        summit_radius: "npt.ArrayLike | None" = None,
        asperities: "npt.ArrayLike | None" = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> EnsembleState:
        """Return the state with other summits from now on."""
        if self.parameters.curves is not None:
            raise InputError("patches have no height and radius to change; expected an ensemble of summits")
        chosen = self._chosen(asperities)
        present = self._present(state)
        height, radius = present.evolved.summit_height.copy(), present.evolved.summit_radius.copy()
        each = partial(one_per, "asperity", "asperities")
        if summit_height is not None:
            height[chosen] = each("summit_height", summit_height, chosen.size)
        if summit_radius is not None:
            radius[chosen] = each("summit_radius", summit_radius, chosen.size, above=0)
        fresh = (height != present.evolved.summit_height) | (radius != present.evolved.summit_radius)
        if self.parameters.wear is not None:
            # a worn asperity that is replaced, if by its like, is whole again
            fresh[chosen] = True
        if not fresh.any():
            return state
        evolved = attrs.evolve(
            present.evolved,
            summit_height=height,
            summit_radius=radius,
            shaped_volume=np.where(fresh, 0.0, present.evolved.shaped_volume),
            waiting_volume=np.where(fresh, 0.0, present.evolved.waiting_volume),
        )
        reshaped = self.evolution.reshaped(attrs.evolve(present, evolved=evolved), fresh)
        now, units = state.memory.now, state.units
        request = now[TANGENTIAL_LOAD] + now[EXCESS]
        changed = self._put(state, self.evolution.ruled(reshaped))
        drive = now[DISPLACEMENT] + _compliance(instrument, units) * now[TANGENTIAL_LOAD]
        back = paths_to(
            Goals(LOAD, now[NORMAL_LOAD] * units.load)
            if state.normal_control == LOAD
            else Goals(DISPLACED, now[APPROACH] * units.length),
            Goals(LOAD, request * units.load)
            if state.tangential_control == LOAD
            else Goals(DISPLACED, drive * units.displacement),
        )
        return self.walk(changed, back, saturate=saturate, instrument=instrument)

    def walk(
        self,
        state: EnsembleState,
        paths: Paths,
        *,
        rows: Rows | None = None,
        asperities: npt.ArrayLike = (),
        saturate: bool = False,
        instrument: Instrument = RIGID,
        until: float = 1.0,
        friction: FrictionGoal | None = None,
        projectors: Projectors | None = None,
    ) -> EnsembleState:
        """Return the state after straight paths, and record rows on the way."""
        units = state.units
        chosen = np.asarray(asperities, dtype=np.int64)
        if state.evolved is not None or friction is not None or (rows is not None and rows.evolved.size):
            return self._evolved(state, paths, rows, chosen, saturate, instrument, until, friction)
        if rows is None:
            rows = blank_rows(0, 0)
            paths = paths._replace(parts=np.ones_like(paths.parts), recorded=np.zeros_like(paths.recorded))
        walked = rows
        if self.parameters.curves is not None:
            self.parameters.curves.check_reach(paths)
            # the first element alone tells where the slip front is
            patches, chosen = chosen, np.arange(self.parameters.elements if chosen.size else 1)
            walked = blank_rows(len(rows.totals), chosen.size)
        position = np.empty(self.parameters.elements, dtype=np.int64)
        position[state.order] = np.arange(self.parameters.elements)
        memory, path, request, limit = (projectors or Projectors()).walk(
            state.contact,
            copied(state.memory),
            _scaled(paths, units),
            walked,
            columns_of(state.contact, position[chosen]),
            units,
            saturate,
            self.parameters.tolerance,
            _compliance(instrument, units),
            until,
        )
        if path >= 0:
            raise FrictionLimitError(request * units.load, limit * units.load, path)
        if self.parameters.curves is not None:
            self.parameters.curves.project(walked, float(state.contact.friction[0]), patches, rows)
        if rows.friction.size:
            coefficients = state.friction
            rows.friction[...] = coefficients[chosen if rows.friction.shape[1] == chosen.size else [0]]
        return attrs.evolve(
            state,
            memory=memory,
            deeper=None,
            normal_control=int(paths.normal_control[-1]),
            tangential_control=int(paths.tangential_control[-1]),
        )

    def approach_at(self, normal_load: float) -> float:
        """Return the approach of the highest summit [m] at which the asperities carry a total normal load [N]."""
        units, (gap, weight), by_gap = self.parameters.units(), self.parameters.shape(), self.parameters.by_gap
        load = scalar("normal_load", normal_load, least=0.0) / units.load
        return approach_at(gap[by_gap], weight[by_gap], load, 0.0) * units.length

    def _coefficients(self, friction: npt.ArrayLike) -> Floats:
        """Friction coefficients of all elements, of which patches of one contact have one alone."""
        if self.parameters.curves is not None:
            friction = scalar("friction of patches that share a contact", friction)
        return coulomb(friction, self.parameters.elements)

    def _given_coefficients(
        self, state: EnsembleState, friction: npt.ArrayLike, asperities: npt.ArrayLike | None
    ) -> Floats:
        """Friction coefficients of all elements, of which some have been given."""
        if asperities is None:
            return self._coefficients(friction)
        chosen = self._chosen(asperities)
        if self.parameters.curves is not None:
            raise InputError("patches of one contact share one coefficient; expected a change for all of them")
        coefficients = state.friction
        coefficients[chosen] = coulomb(friction, chosen.size)
        return coefficients

    def _chosen(self, asperities: npt.ArrayLike | None) -> Integers:
        """Return the indices of asperities that are chosen, or of all."""
        if asperities is None:
            return np.arange(self.parameters.elements)
        chosen = np.atleast_1d(np.asarray(asperities))
        if chosen.dtype.kind not in "iu" or chosen.ndim != 1 or np.unique(chosen).size != chosen.size:
            raise InputError(f"asperities is {asperities!r}; expected a list of indices, each of them once")
        outside = chosen[(chosen < 0) | (chosen >= self.parameters.elements)]
        if outside.size:
            raise InputError(
                f"asperity {outside[0]} does not exist; expected an index from 0 to {self.parameters.elements - 1}"
            )
        return chosen.astype(np.int64)

    def _present(self, state: EnsembleState) -> Present:
        evolved = state.evolved or Evolved.start(self.parameters.summit_height, self.parameters.summit_radius)
        return Present(state.contact, state.order, state.memory, evolved)

    @staticmethod
    def _put(state: EnsembleState, present: Present) -> EnsembleState:
        controls = (state.normal_control, state.tangential_control)
        return EnsembleState(
            present.contact, present.order, present.memory, state.units, *controls, evolved=present.evolved
        )

    def _evolved(
        self,
        state: EnsembleState,
        paths: Paths,
        rows: Rows | None,
        chosen: Integers,
        saturate: bool,
        instrument: Instrument,
        until: float,
        friction: FrictionGoal | None,
    ) -> EnsembleState:
        """`walk` where asperities evolve."""
        if self.parameters.curves is not None:
            raise InputError("patches of one contact keep their friction along a path; expected a change at a time")
        if rows is None:
            rows = blank_rows(0, 0)
            paths = paths._replace(parts=np.ones_like(paths.parts), recorded=np.zeros_like(paths.recorded))
        if friction is not None:
            # those that part ways no longer share what they remember
            told = state.evolved
            state = regrouped(state, state.friction, friction.coefficients)
            given = np.ones(self.parameters.elements, dtype=bool)
            state = attrs.evolve(state, evolved=attrs.evolve(told or self._present(state).evolved, given=given))
        present = self.evolution.walk(
            self._present(state),
            _scaled(paths, state.units),
            rows,
            chosen,
            saturate=saturate,
            compliance=_compliance(instrument, state.units),
            until=until,
            goal=friction,
        )
        return attrs.evolve(
            self._put(state, present),
            normal_control=int(paths.normal_control[-1]),
            tangential_control=int(paths.tangential_control[-1]),
        )


def _compliance(instrument: Instrument, units: Units) -> float:
    """Compliance of an instrument, dimensionless."""
    return units.stiffness / as_instrument(instrument).lateral_stiffness


def _goals_of(
    name: str,
    load: "npt.ArrayLike | None",
    displacement: "npt.ArrayLike | None",
    control: int,
    least: float = -math.inf,
) -> Goals:
    """Where one channel of several paths goes."""
    if load is not None and displacement is not None:
        raise InputError(f"both {name}_load and {name}_displacement came; expected one of them")
    kind, values, least = (LOAD, load, least) if load is not None else (DISPLACED, displacement, -math.inf)
    if values is None:
        return Goals(control, *STILL)
    kind_name = "load" if kind == LOAD else "displacement"
    targets = checked(f"{name}_{kind_name}", values, least=least)
    if targets.ndim > 1:
        raise InputError(f"{name}_{kind_name} has shape {targets.shape}; expected one number, or a list")
    return Goals(kind, targets)


def _scaled(paths: Paths, units: Units) -> Paths:
    load = paths.normal_control == LOAD
    normal = paths.normal_target / np.where(load, units.load, units.length)
    # a load that is too small for a float would press on springs without any stiffness
    normal[np.abs(normal) < np.where(load, LEAST_LOAD, LEAST_APPROACH)] = 0.0
    tangential = np.where(paths.tangential_control == LOAD, units.load, units.displacement)
    return paths._replace(normal_target=normal, tangential_target=paths.tangential_target / tangential)
