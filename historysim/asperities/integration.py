"""`IntegratedBody`: bodies with one traction memory, which the core integrates over straight load paths."""

import abc
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from historysim.asperities.body import Body
from historysim.asperities.instrument import RIGID, Instrument, Rings, as_instrument
from historysim.asperities.law import FrictionGoal
from historysim.asperities.state import State
from historysim.asperities.stepper import Stepper, channel, make_path
from historysim.basics.arguments import ArrayLike, Booleans, Floats, scalar, workable
from historysim.basics.library import ffi, lib, pointer
from historysim.errors import CurveEndError, FrictionLimitError, InputError
from historysim.memory import binding
from historysim.memory.binding import (
    DISPLACED,
    LOAD,
    Memory,
    advance_state,
    check,
    copy_state,
    take_ownership,
)
from historysim.memory.paths import (
    PROJECTED,
    Goals,
    Paths,
    Rows,
    blank_rows,
    drop_rows,
    straight_paths,
)

_ALWAYS = {"columns", "asperity", "totals", *PROJECTED, "dissipated_energy", "friction"}
# Row variables that are recorded only for asperities that evolve.
EVOLVED = {name for name, _ in ffi.typeof("hs_rows").fields} - _ALWAYS


class IntegratedBody(Body):
    """Base class of bodies with one traction memory: `Ensemble` and `Patches`."""

    rings: Rings
    _contact: Any  #: initial contact, as a structure of the library
    is_bounded: ClassVar[bool] = False  #: True if `check_reach` limits normal loads and approaches

    @property
    @abc.abstractmethod
    def elements(self) -> int:
        """Number of elements of the traction memory: asperities, or elements of the total curve of all patches."""

    @property
    @abc.abstractmethod
    def _element_friction(self) -> Floats:
        """Coefficients at the start (element)."""

    @property
    @abc.abstractmethod
    def _identity_bytes(self) -> bytes:
        """Settings that identify its states, in addition to contact and friction."""

    @cached_property
    def _initial_memory(self) -> Memory:
        """Memory at the start, which is never changed."""
        memory: Memory = take_ownership(
            lib.hs_state_new(self._contact, pointer(self._element_friction))
        )
        identity = self._identity_bytes
        memory.line.identity = lib.hs_digest(
            memory.line.identity, ffi.from_buffer(identity), len(identity)
        )
        if self.evolves:
            self._track_evolution(memory)
        return memory

    @cached_property
    def _initial_planar_memory(self) -> Memory:
        """Memory at the start in two tangential directions."""
        return self._planar_copy(self._initial_memory)

    @cached_property
    def _evolves(self) -> bool:
        return self.evolves

    @cached_property
    def _drive(self) -> Any:
        return self._make_drive(False, RIGID)

    @cached_property
    def _drive_in_plane(self) -> Any:
        return self._make_drive(False, RIGID, directions=2)

    def _make_drive(
        self,
        saturate: bool,
        instrument: Instrument,
        threads: int = 1,
        *,
        directions: int = 1,
        heeds: bool = True,
    ) -> Any:
        """Build the ``hs_drive`` of the library: tolerance, instrument compliance, saturation and threads."""
        compliances = as_instrument(instrument).directional_compliances(directions)
        return binding.drive(self.tolerance, compliances, saturate, threads, heeds=heeds)

    def initial_state(self) -> State:
        """Return the unloaded virgin state: the highest summit just touches."""
        return State(self._initial_memory, self._initial_memory)

    def check_state(self, state: Any) -> None:
        """Raise an InputError if a state does not belong to this body."""
        self._checked_memory(state)

    def read_controls(self, state: Any) -> tuple[int, int]:
        """Return how the normal and tangential channels were controlled last; InputError in two directions."""
        memory = self._checked_memory(state)
        binding.check_one_direction(memory)
        return memory.line.normal_control, memory.line.tangential_control

    def check_reach(self, paths: Paths) -> None:
        """Raise a CurveEndError for a path beyond the table of a body with `is_bounded`."""

    def advance(
        self,
        state: State,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | tuple[float | None, float | None] | None = None,
        tangential_displacement: float | tuple[float | None, float | None] | None = None,
        friction: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> State:
        """Return the state after one joint straight path; ``state`` itself is not changed.

        If both loads are given, the path is straight in (N, T); with a displacement, it is straight
        in the approach and U. A channel without a target is held at its last controlled value, a
        load or a displacement.

        In two tangential directions loads and displacements are pairs, in x and y; a state of one
        direction has moved along x. The path is exact along one line; after a turn, ``rings`` sets
        its accuracy. Each component is a separate channel: None in a pair leaves the component to
        the other argument, or holds it. So ``tangential_displacement=(u, None),
        tangential_load=(None, t)`` drives x under a constant load in y. If either component is a
        displacement, the path is straight in the approach and in the controlled variable of each
        component.

        Parameters
        ----------
        state : State
        normal_load, tangential_load : float, optional
            Total loads to reach [N]; N ≥ 0. The tangential load may be a pair, with None in one
            component.
        normal_displacement : float, optional
            Approach of the highest summit from first touch to reach [m]; negative is a gap.
        tangential_displacement : float, optional
            U to reach [m], or a pair, likewise; with an instrument the displacement of its drive, U
            + T/k_s. With a spring in parallel, the tangential load is the sum of both, T + k_p (U +
            T/k_s), and a joint path to it is straight in the approach and that load.
        friction : array_like, optional
            New coefficients, applied at the end of the path (see `FrictionChange`).
        saturate : bool
            Hold a tangential load beyond the limit at the limit; if one component is a
            displacement, the other one.
        instrument : Instrument, optional
            In series with the contact. The state does not contain it: give it with each path that
            it drives.

        Raises
        ------
        FrictionLimitError
            |T| > Σ μ N, of the components that are controlled by load.
        InputError
            A value that is not finite, a negative normal load, or both a load and a displacement
            for one channel; in two directions a single number for a tangential channel, or an
            ensemble that evolves.
        """
        # fast path, one comparison in tight loops: a state with this `like` has one direction and
        # the same evolution
        start = self._initial_memory
        is_recognised = getattr(state, "_like", None) is start
        memory = state.memory if is_recognised else self._checked_memory(state)
        line = memory.line
        normal, normal_target = channel(
            "normal", normal_load, normal_displacement, line.normal_control, 0.0
        )
        target = tangential_load if tangential_displacement is None else tangential_displacement
        # a scalar target does not depend on the previous control
        control = (
            LOAD
            if is_recognised and target.__class__ is float
            else binding.tangential_control(memory)
        )
        tangential, tangential_target = channel(
            "tangential", tangential_load, tangential_displacement, control
        )
        evolves = self._evolves if is_recognised else line.evolved
        if evolves or (instrument is not RIGID and as_instrument(instrument).parallel_stiffness):
            path = make_path((normal, normal_target), (tangential, tangential_target))
            moved: State = self.advance_along(state, path, saturate=saturate, instrument=instrument)
        else:
            if self.is_bounded:
                self.check_reach(
                    make_path((normal, normal_target), (tangential, tangential_target))
                )
            if control.__class__ is tuple or tangential_target.__class__ is tuple:
                memory = memory if control.__class__ is tuple else self._planar_copy(memory)
                drive = self._drive_in_plane if instrument is RIGID and not saturate else None
                drive = drive or self._make_drive(saturate, instrument, directions=2)
                advanced_memory = binding.advanced_in_plane(
                    memory, normal, normal_target, tangential, tangential_target, drive
                )
                moved = State(advanced_memory, self._initial_planar_memory)
            else:
                drive = (
                    self._drive
                    if instrument is RIGID and not saturate
                    else self._make_drive(saturate, instrument)
                )
                moved = State(
                    advance_state(
                        memory, normal, normal_target, tangential, tangential_target, drive
                    ),
                    start,
                )
        if friction is None:
            return moved
        moved = self.with_friction(moved, friction, instrument=instrument)
        return self.advance(moved, saturate=saturate, instrument=instrument)

    @abc.abstractmethod
    def with_friction(
        self, state: State, friction: ArrayLike, *, instrument: Instrument = RIGID
    ) -> State:
        """Return the state with new friction coefficients."""

    def stepper(
        self, state: State | None = None, *, saturate: bool = False, instrument: Instrument = RIGID
    ) -> Stepper:
        """Return a `Stepper`, which steps a state in place in tight loops; it starts unloaded by default."""
        state = self.initial_state() if state is None else state
        self._checked_memory(state)
        return Stepper(self, state, {"saturate": saturate, "instrument": instrument})

    def enter_plane(self, state: State) -> State:
        """Return a state in two tangential directions; one of one direction moved along x.

        InputError if the state belongs to another ensemble, or the ensemble supports one direction
        only.
        """
        memory = self._checked_memory(state)
        return state if memory.plane else self._wrap_memory(self._planar_copy(memory))

    def _wrap_memory(self, memory: Memory) -> State:
        """Wrap a memory of this ensemble in a state."""
        if memory.plane:
            return State(memory, self._initial_planar_memory)
        return State(
            memory, self._initial_memory if bool(memory.line.evolved) == self._evolves else None
        )

    def slide_time(self, state: State) -> Floats:
        """Return the time at which each asperity first slid as a whole in a replay [s]; NaN if never."""
        memory = self._checked_memory(state)
        contact = memory.line.contact
        times = np.empty(contact.query_count or contact.count)
        lib.hs_slide_times(memory, pointer(times))
        return times

    def approach_at(self, normal_load: float) -> float:
        """Solve for the approach [m] at which the virgin contact first carries a normal load ≥ 0 [N], at U = 0."""
        load = scalar("normal_load", normal_load, least=0.0)
        workable("normal_load", load)
        return float(lib.hs_approach_at(self._contact, load))

    def _checked_memory(self, state: Any) -> Memory:
        """Return the memory of a state; InputError if it belongs to another ensemble."""
        if not isinstance(state, State):
            raise InputError(
                f"state is {state!r}; expected a State, such as initial_state() returns"
            )
        # no state refers to a memory that has not been computed
        if state._like is not None and state._like is self.__dict__.get("_initial_planar_memory"):
            return state.memory
        if state._like is not self._initial_memory:
            binding.check_belongs(state.memory, self._initial_memory)
        rings = state.rings
        if rings is not None and rings != self.rings:
            raise InputError(
                f"the state was made with {rings}; expected a state of this ensemble, with {self.rings}. Advance it "
                "with an ensemble that has its rings, or replay its events with this one"
            )
        return state.memory

    def _planar_copy(self, memory: Memory) -> Memory:
        """Return a copy of a memory of one direction, converted to two."""
        if self.direction_limit:
            raise InputError(
                f"{self.direction_limit} supports one tangential direction only; expected a number, not a pair"
            )
        rings = self.rings
        planar: Memory = binding.enter_plane(
            memory, rings.height_classes, rings.rings, rings.tolerance
        )
        return planar

    def _track_evolution(self, memory: Memory) -> None:
        """Make a memory track the evolution of its asperities from now on; asperities alone evolve."""

    def _evolution(self, memory: Memory, goal: FrictionGoal | None) -> AbstractContextManager[Any]:
        """Return a context of the ``hs_evolution`` of one call, which is NULL if nothing evolves."""
        del memory, goal
        return nullcontext(ffi.NULL)

    def _integrate(  # noqa: PLR0913 - the options of `Ensemble.advance_along`
        self,
        state: State,
        paths: Paths,
        *,
        rows: Rows | None = None,
        asperities: ArrayLike = (),
        saturate: bool = False,
        instrument: Instrument = RIGID,
        until: float = 1.0,
        friction: FrictionGoal | None = None,
        threads: int = 1,
    ) -> State:
        """Integrate load paths and record rows of elements; see `Ensemble.advance_along`."""
        if (
            as_instrument(instrument).parallel_stiffness
            and (load_controlled := binding.by_load(paths)).any()
        ):
            if (load_controlled[:, 0] != load_controlled[:, 1]).any():
                raise InputError(
                    "one tangential component is a load and the other one a displacement, with a spring in parallel; "
                    "expected two loads or two displacements, or an instrument without parallel_stiffness"
                )
            options: dict[str, Any] = {
                "rows": rows,
                "asperities": asperities,
                "saturate": saturate,
                "until": until,
            }
            options |= {"friction": friction, "threads": threads}
            return self._integrate_with_parallel_spring(
                state, paths, load_controlled[:, 0], instrument, options
            )
        memory = self._checked_memory(state)
        planar = bool(memory.plane) or binding.are_in_plane(paths) or bool(rows and rows.vectors)
        if planar and friction is not None:
            raise InputError(
                "friction that varies along a path supports one tangential direction only; expected a change at a time"
            )
        memory = copy_state(memory) if memory.plane or not planar else self._planar_copy(memory)
        paths = binding.check_in_plane(paths) if planar else paths
        if friction is not None or (not planar and rows is not None and EVOLVED & rows.each.keys()):
            self._track_evolution(memory)
        if rows is None:
            rows, paths = blank_rows(0, None, planar=planar), drop_rows(paths)
        path, refusal = ffi.cast("hs_path *", ffi.from_buffer(paths)), ffi.new("hs_refusal *")
        drive = self._make_drive(saturate, instrument, threads, directions=2 if planar else 1)
        arguments = memory, path, paths.size, rows.as_struct(asperities), drive, until
        with self._evolution(memory, friction) as evolution:
            status = lib.hs_integrate(*arguments, evolution, refusal)
        check(status, refusal)
        return self._wrap_memory(memory)

    def _integrate_with_parallel_spring(
        self,
        state: State,
        paths: Paths,
        load_controlled: Booleans,
        instrument: Instrument,
        options: dict[str, Any],
    ) -> State:
        """Integrate paths of which some control the load of contact plus parallel spring."""
        for run in np.split(np.arange(paths.size), np.flatnonzero(np.diff(load_controlled)) + 1):
            legs, by_load = paths[run], bool(load_controlled[run[0]])
            if by_load:
                legs["tangential_control"][legs["tangential_control"] == LOAD] = DISPLACED
                legs["tangential_target"] /= instrument.parallel_stiffness
            try:
                series = instrument.load_control_equivalent if by_load else instrument
                state = self._integrate(state, legs, instrument=series, **options)
            except (FrictionLimitError, CurveEndError) as error:
                error.path += int(run[0])
                raise
            if by_load:
                # the channel remains under load control
                binding.set_tangential_control(self._checked_memory(state), LOAD)
        return state

    def _set_friction(self, memory: Memory, coefficients: Floats, instrument: Instrument) -> State:
        """Set the coefficients (element) of a memory, and wrap it in a state."""
        with _series_instrument(memory, instrument) as series:
            drive = self._make_drive(False, series, directions=binding.count_directions(memory))
            status = lib.hs_set_friction(memory, pointer(coefficients), drive)
        if status == lib.HS_FOREIGN:
            raise InputError(
                "friction differs between asperities that share rings of traction; expected one coefficient for "
                "asperities that had the same one at the start"
            )
        check(status)
        return self._wrap_memory(memory)


@contextmanager
def _series_instrument(memory: Memory, instrument: Instrument) -> Iterator[Instrument]:
    """Yield the instrument in series with a contact; under load control it includes the parallel spring."""
    if not as_instrument(instrument).parallel_stiffness or memory.line.tangential_control != LOAD:
        yield instrument
        return
    with binding.temporary_control(memory, DISPLACED):
        yield instrument.load_control_equivalent


def return_path(memory: Memory, instrument: Instrument) -> Paths:
    """Return the path on which each channel returns to its controlled value."""
    line, units = memory.line, memory.line.contact.units
    compliance = units.stiffness / instrument.stiffness
    normal = {LOAD: line.normal_load * units.load, DISPLACED: line.approach * units.length}
    load, displacement = (
        (line.tangential_load + line.excess) * units.load,
        line.displacement * units.displacement,
    )
    tangential = {
        LOAD: instrument.drive_load(displacement, load),
        DISPLACED: (line.displacement + compliance * line.tangential_load) * units.displacement,
    }
    return straight_paths(
        Goals(line.normal_control, normal[line.normal_control]),
        Goals(line.tangential_control, tangential[line.tangential_control]),
        times=(line.clock.end, line.clock.end),
    )
