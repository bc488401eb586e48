"""Stepping by hand: paths to targets, totals of many paths, and in-place steps in tight loops (`Stepper`)."""

import math
import warnings
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from historysim.asperities.instrument import as_instrument
from historysim.asperities.state import State, WholeContact
from historysim.basics.arguments import Floats, Integers, as_floats, workable
from historysim.basics.library import OneAtATime, lib
from historysim.basics.limits import LARGEST
from historysim.errors import InputError
from historysim.memory import binding
from historysim.memory.binding import DISPLACED, LOAD, Slopes, check, copy_state
from historysim.memory.paths import STILL, Goals, Paths, straight_paths

TURNS = 4  # reversals of the displacement in as many successive steps that look like trials
_step = lib.hs_stepper_step
# goals and results among the doubles of ``hs_stepper``
X, Y, START, HAS_MOVED, TURN_COUNT = 2, 4, 6, 7, 8
HELD = math.nan  # target of a channel that is held as it was controlled last
SteppedBody = Any  # an `IntegratedBody`, whose module imports this one
HELD_CHANNEL: Any = LOAD, HELD  # the library ignores the control of a held channel
Target = float | tuple[float, float] | Floats
Control = int | tuple[int, int]


def channel(  # noqa: PLR0911, PLR0917 - a tight loop passes them by place, and returns early
    name: str,
    load: Any,
    displacement: Any,
    control: Control,
    minimum: float = -math.inf,
    is_sequence: bool = False,
) -> tuple[Any, Any]:
    """Return the control of one channel of a path, and its target in N or m; a load is at least `minimum`.

    The target of the tangential channel may be a pair, in x and y, and the control is one for both
    components or one for each; that of several paths is an array, or one number.
    """
    if load is None:
        if displacement is None:
            return control, HELD
        kind, value, minimum = DISPLACED, displacement, -math.inf
    elif displacement is None:
        kind, value = LOAD, load
    elif name == "tangential" and not is_sequence:
        return _each_component(control, load, displacement)
    else:
        raise InputError(
            f"both {name}_load and {name}_displacement are given; expected one of them"
        )
    # each comparison with NaN is false, and `workable` reports it
    if isinstance(value, float) and minimum <= value <= LARGEST and value >= -LARGEST:
        return kind, value
    if (
        name == "tangential"
        and not is_sequence
        and isinstance(value, (tuple, list))  # without a union, which takes longer than the rest
        and len(value) == 2
    ):
        x, y = value
        if x is None or y is None:
            return _each_component(control, load, displacement)
        if (
            isinstance(x, float)
            and isinstance(y, float)
            and -LARGEST <= x <= LARGEST
            and -LARGEST <= y <= LARGEST
        ):
            return kind, (x, y)
    label = f"{name}_{'load' if kind == LOAD else 'displacement'}"
    target = workable(label, as_floats(label, value, least=minimum))
    if target.ndim <= is_sequence:
        return kind, target if is_sequence else float(target)
    if target.shape == (2,) and name == "tangential":
        return kind, (float(target[0]), float(target[1]))
    expected = (
        "one number, or a list"
        if is_sequence
        else "one number" + ", or a pair in x and y" * (name == "tangential")
    )
    raise InputError(f"{label} is {value!r}; expected {expected}")


def _each_component(
    control: Control, load: Any, displacement: Any
) -> tuple[tuple[int, int], tuple[float, float]]:
    """Return control and target of the components x and y, if a load or displacement leaves one open (None)."""
    # a state of one direction has moved along x
    kinds = list(control if isinstance(control, tuple) else (control, LOAD))
    targets = [HELD, HELD]
    for kind, label, values in (
        (LOAD, "tangential_load", load),
        (DISPLACED, "tangential_displacement", displacement),
    ):
        if values is None:
            continue
        if not isinstance(values, tuple | list) or len(values) != 2:
            raise InputError(
                f"tangential_load and tangential_displacement are given together, and {label} is {values!r}; expected "
                "one of them, or pairs in x and y with None for the component that the other one controls, such as "
                "tangential_displacement=(1e-8, None), tangential_load=(None, 5e-3)"
            )
        if values[0] is values[1] is None:
            raise InputError(f"{label} is (None, None); expected a number in x or in y")
        for axis, value in enumerate(values):
            if value is None:
                continue
            if not math.isnan(targets[axis]):
                raise InputError(
                    f"tangential_load and tangential_displacement both give {'xy'[axis]}; expected None in one of them"
                )
            target = workable(label, as_floats(label, value))
            if target.ndim:
                raise InputError(
                    f"{label} is {values!r}; expected one number, or None, in x and in y"
                )
            kinds[axis], targets[axis] = kind, float(target)
    return (kinds[0], kinds[1]), (targets[0], targets[1])


def make_path(*channels: tuple[Control, Target]) -> Paths:
    """Build the paths to the targets of the normal and the tangential channel, as returned by `channel`."""
    normal, tangential = (_make_goals(*target) for target in channels)
    return straight_paths(normal, tangential)


def make_paths(
    controls: tuple[int, int],
    *,
    normal: tuple[Any, Any],
    tangential: tuple[Any, Any],
    least: float = 0.0,
) -> Paths:
    """Build paths from arrays of loads and displacements of each channel, with the controls that hold a channel."""
    targets = (
        channel("normal", *normal, controls[0], least, is_sequence=True),
        channel("tangential", *tangential, controls[1], is_sequence=True),
    )
    counts = {np.size(target) for _, target in targets} - {1}
    if len(counts) > 1 or 0 in counts:
        numbers = " and ".join(map(str, sorted(counts)))
        raise InputError(
            f"the channels have {numbers} values; expected equal numbers of values, or one number"
        )
    return make_path(*targets)


def _make_goals(kind: Control, target: Any) -> Goals:
    if isinstance(kind, tuple) and not isinstance(target, tuple):
        target = (target, target)
    if isinstance(target, tuple):
        held = [math.isnan(component) for component in target]
        kinds = kind if isinstance(kind, tuple) else (kind, kind)
        return Goals(
            [kinds],
            [
                [
                    0.0 if is_held else component
                    for component, is_held in zip(target, held, strict=True)
                ]
            ],
            [~np.array(held)],
        )
    return (
        Goals(kind, *STILL)
        if isinstance(target, float) and math.isnan(target)
        else Goals(kind, target)
    )


class Totals(NamedTuple):
    """Totals of the contact at the end of each path; all arrays are (path), in SI."""

    normal_load: Floats
    tangential_load: Floats
    approach: Floats
    tangential_displacement: Floats
    contact_count: Integers
    tangential_stiffness: Floats
    dissipated_energy: Floats

    @classmethod
    def from_row(cls, rows: npt.NDArray[Any]) -> Self:
        """Read the totals from recorded rows, with the fields of ``hs_totals``."""
        names = [
            "displacement" if name == "tangential_displacement" else name for name in cls._fields
        ]
        columns: dict[str, Any] = {
            field: rows[name].copy() for field, name in zip(cls._fields, names, strict=True)
        }
        return cls(**columns | {"contact_count": columns["contact_count"].astype(np.int64)})


class Stepper(WholeContact):
    """A state that is stepped in place, for tight loops of a controller or an integrator.

    `Ensemble.stepper` creates it. Its bits are those of `Ensemble.advance` and of a replay, at a cost
    that does not grow with the depth of the memory; a step of evolving asperities costs as much as
    there. It moves in two tangential directions from the first pair of targets on, or from the
    start with an instrument of two stiffnesses. It can be pickled. Each step overwrites the state:
    `save` it first if a step may be undone, such as a trial inside an integrator's stages. Only one
    thread may use it at a time; a second one gets an error.

    C code steps its ``memory``, unless asperities evolve or a spring is in parallel:
    ``hs_step(memory, …, drive, …)``; the address is ``int(ffi.cast("intptr_t", memory))``. Where
    asperities evolve each step makes another one.
    """

    def __init__(self, ensemble: "SteppedBody", state: State, how: dict[str, Any]) -> None:
        self._ensemble, self._how, self._is_bounded = ensemble, how, ensemble.is_bounded
        self.memory: Any = None
        self._in_plane = False
        self._call, self._numbers = binding.new_stepper()
        self._guard = OneAtATime(
            "the stepper: a stepper for each thread, such as ensemble.stepper(stepper.save())"
        )
        self._continue_from(state)

    def __getstate__(self) -> tuple[Any, ...]:
        return self._ensemble, self.save(), self._how, self._numbers[START]

    def __setstate__(self, fields: tuple[Any, ...]) -> None:
        *arguments, start = fields
        self.__init__(*arguments)  # type: ignore[misc] # unpickling does not call it
        self._numbers[START] = start

    def restore(self, state: State) -> None:
        """Return to a state of the same ensemble, such as `save` returns; InputError for any other state."""
        if not isinstance(state, State):
            raise InputError(f"state is {state!r}; expected what save() returns")
        self._ensemble.check_state(state)
        with self._guard:
            self._continue_from(state)

    def _continue_from(self, state: State) -> None:
        # a stiffness in x and in y is for loads in both
        is_pair = isinstance(as_instrument(self._how["instrument"]).lateral_stiffness, tuple)
        self._hold(copy_state((self._ensemble.enter_plane(state) if is_pair else state).memory))
        lib.hs_stepper_observe(self._call, self.memory.line.approach)
        self._call.move = (0.0, 0.0)
        self._numbers[START], self._numbers[TURN_COUNT], self._time = state.approach, 0.0, -math.inf

    def _hold(self, memory: Any) -> None:
        """Replace the memory that is stepped."""
        is_planar = binding.count_directions(memory) == 2
        if self.memory is None or is_planar != self._in_plane:
            # a step in one direction is in place: after an interruption its state would be lost
            self.drive = self._ensemble._make_drive(
                **self._how, directions=1 + is_planar, heeds=is_planar
            )
        self.memory, self._in_plane = memory, is_planar
        self._call.state, self._call.drive = memory, self.drive
        self._is_walked = bool(memory.line.evolved or self._how["instrument"].parallel_stiffness)

    def save(self) -> State:
        """Return the present state, which later steps do not change."""
        with self._guard:
            state: State = self._ensemble._wrap_memory(copy_state(self.memory))
            return state

    def step(
        self,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | tuple[float | None, float | None] | None = None,
        tangential_displacement: float | tuple[float | None, float | None] | None = None,
        time: float | None = None,
    ) -> None:
        """Move along one joint straight path; parameters and errors as in `Ensemble.advance`; no change on an error.

        ``time`` is the end time of the path [s], if a solver knows it. A UserWarning is issued if the
        contact moves like the trials of a solver: to a time not after the previous step, or back
        and forth in several successive steps. All motion is remembered; `restore` undoes a trial.
        InputError if another thread steps it at the same time.
        """
        numbers, free = self._numbers, self._guard.free
        # not `with self._guard`, which costs a fifth of a step
        try:
            del free[0]
        except IndexError:
            raise self._guard.lock_error() from None
        try:
            if self._is_walked:
                self._walk(
                    normal_load, normal_displacement, tangential_load, tangential_displacement
                )
            else:
                target: Any
                normal, normal_target = HELD_CHANNEL
                if normal_load is not None or normal_displacement is not None:
                    normal, normal_target = channel(
                        "normal", normal_load, normal_displacement, LOAD, 0.0
                    )
                # without a call for the most frequent target
                if (
                    tangential_load is None
                    and isinstance(tangential_displacement, float)
                    and -LARGEST <= tangential_displacement <= LARGEST
                ):
                    tangential, target = DISPLACED, tangential_displacement
                else:
                    tangential, target = channel(
                        "tangential", tangential_load, tangential_displacement, LOAD
                    )
                if self._is_bounded:
                    self._ensemble.check_reach(
                        make_path((normal, normal_target), (tangential, target))
                    )
                if self._in_plane or target.__class__ is tuple:
                    self._step_in_plane(normal, normal_target, tangential, target)
                else:
                    numbers[normal], numbers[X + tangential] = normal_target, target
                    status = _step(self._call)
                    if status:
                        check(status, self._call.refusal)
        finally:
            free.append(None)
        if time is not None or numbers[TURN_COUNT] == TURNS:
            self._warn_of_trials(time)

    def _step_in_plane(self, normal: int, normal_target: Any, tangential: Any, target: Any) -> None:
        if target.__class__ is not tuple:
            if not math.isnan(target):
                raise InputError(binding.NEEDS_PAIR)
            target = HELD, HELD
        memory, numbers = self.memory, self._numbers
        if not self._in_plane:
            self._hold(self._ensemble.enter_plane(self._ensemble._wrap_memory(memory)).memory)
        x, y = tangential if tangential.__class__ is tuple else (tangential, tangential)
        numbers[normal] = normal_target
        numbers[X + x], numbers[Y + y] = target
        if status := _step(self._call):
            # of one direction still where the first pair is refused
            self._hold(memory)
            check(status, self._call.refusal)

    def _walk(
        self, normal_load: Any, normal_displacement: Any, load: Any, displacement: Any
    ) -> None:
        """Step where asperities evolve, or a spring is in parallel."""
        line = self.memory.line
        normal = channel("normal", normal_load, normal_displacement, line.normal_control, 0.0)
        path = make_path(
            normal,
            channel("tangential", load, displacement, binding.tangential_control(self.memory)),
        )
        if self._is_bounded:
            self._ensemble.check_reach(path)
        start = line.approach
        self._hold(
            self._ensemble.advance_along(
                self._ensemble._wrap_memory(self.memory), path, **self._how
            ).memory
        )
        lib.hs_stepper_observe(self._call, start)

    def _warn_of_trials(self, time: float | None) -> None:
        """Warn if the last step looks like a trial of a solver."""
        has_moved, problem = self._numbers[HAS_MOVED], ""
        if time is not None:
            if time <= self._time and has_moved:
                problem = f"was moved to t = {time:.9g} s when it had been at {self._time:.9g} s"
            self._time = time
        if self._numbers[TURN_COUNT] == TURNS and has_moved:
            problem = problem or f"went back and forth in each of the last {TURNS} steps"
        if problem:
            warnings.warn(
                f"the stepper {problem}: where these are trials of a solver, save before them and restore after each, "
                "or they are remembered as reversals (hs.coupling does so); where the contact moves so, take shorter "
                "steps",
                stacklevel=3,
            )

    def slopes(self) -> Slopes:
        """Return the derivatives of the loads at the end of the last step, on its side.

        They are exact where there is one friction coefficient or a displacement is controlled; of
        several coefficients under two controlled loads, they are those of the straight path in (d,
        U) to the same end. InputError in two directions, where the saved state has a `stiffness`.
        Of asperities that evolve they are those at held friction and shapes: a summit that is
        yielding is softer than that.
        """
        with self._guard:
            binding.check_one_direction(self.memory)
            slopes = lib.hs_slopes_of(self.memory, self._numbers[START])
        return Slopes(slopes.tangential, slopes.coupling, slopes.normal)
