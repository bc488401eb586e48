"""`AttractingEnsemble`: an ensemble whose asperities attract, with its state and its jumps."""

import math
import struct
from typing import Any, ClassVar, NamedTuple, Self

import attrs
import numpy as np

from historysim.asperities.body import Feature
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID
from historysim.asperities.law import Attraction, FrictionGoal, Law
from historysim.asperities.state import State
from historysim.asperities.stepper import channel, make_path
from historysim.basics.arguments import ArrayLike, Floats, scalar
from historysim.basics.library import lib
from historysim.errors import CurveEndError, FrictionLimitError, InputError, PullOffError
from historysim.memory.binding import DISPLACED, LOAD, Memory, tangential_control
from historysim.memory.paths import Paths, Rows, drop_rows

AT_PULL_OFF = 1e-9  # relative distance from pull-off at which a load counts as carried
_TAIL = struct.Struct("<qqd8s")
_MARK = b"hspulled"


class Jump(NamedTuple):
    """A jump of the approach at a load, on its path."""

    normal_load: float  #: from outside, at which it jumps [N]
    approach: float  #: where it ends [m]
    energy: float  #: lost in it [J]


class Pulls(NamedTuple):
    """Attraction of an ensemble as a function of the approach."""

    touch: Floats  #: approaches at which asperities touch, ascending [m]
    force: Floats  #: sum of the forces of the first k of them (k from 0) [N]

    def compute_sum(self, approach: Any) -> Any:
        """Return the attraction at approaches [N]."""
        return self.force[np.searchsorted(self.touch, approach, side="left")]


_NO_PULLS = Pulls(np.empty(0), np.zeros(1))


class AttractedState(State):
    """State of an ensemble whose asperities attract; see `State`."""

    __slots__ = ("jump_energy", "jumps", "pulls")

    pulls: Pulls
    jumps: int  #: jumps of the approach under load control since the start
    jump_energy: float  #: energy lost in them [J]

    @classmethod
    def wrap(cls, state: State, pulls: Pulls, jumps: int, jump_energy: float) -> Self:
        """Make it of a state of the contact."""
        made = cls(state.memory, state._like)
        for name, value in (("pulls", pulls), ("jumps", jumps), ("jump_energy", jump_energy)):
            object.__setattr__(made, name, value)
        return made

    @property
    def contact_load(self) -> float:
        """Normal load of the contact Σ P, to which friction and tractions belong [N]."""
        return float(super().normal_load)

    @property
    def attraction(self) -> float:
        """Sum of the forces on touching asperities [N]."""
        return float(self.pulls.compute_sum(self.approach))

    @property
    def normal_load(self) -> float:  # type: ignore[override] # of a state without attraction it is the contact load
        """Normal load from outside, Σ (P - F) [N]."""
        return self.contact_load - self.attraction

    def to_bytes(self) -> bytes:
        """Serialise the state."""
        tail = _TAIL.pack(self.pulls.touch.size, self.jumps, self.jump_energy, _MARK)
        return super().to_bytes() + self.pulls.touch.tobytes() + self.pulls.force.tobytes() + tail

    def _bits(self) -> bytes:
        return super()._bits() + _TAIL.pack(
            self.pulls.touch.size, self.jumps, self.jump_energy, _MARK
        )

    @classmethod
    def from_bytes(cls, content: bytes, like: Any = None) -> Self:
        """Read the state from the result of `to_bytes`; see `SavedState`."""
        try:
            count, jumps, energy, mark = _TAIL.unpack_from(content, len(content) - _TAIL.size)
        except struct.error:
            mark = b""
        start = len(content) - _TAIL.size - 8 * (2 * count + 1) if mark == _MARK else -1
        if not (start >= 0 and count >= 0 and jumps >= 0 and energy >= 0.0):
            raise InputError(
                "the bytes are of no contact with attraction; expected a state that was saved whole"
            )
        numbers = np.frombuffer(content, np.float64, 2 * count + 1, start)
        pulls = Pulls(numbers[:count], numbers[count:])
        if like is not None and not all(map(np.array_equal, pulls, like.pulls)):
            raise InputError("the state is of another attraction; expected one of this ensemble")
        return cls.wrap(State.from_bytes(content[:start], like), pulls, jumps, energy)


def _refusal(what: str) -> str:
    return (
        f"{what} with attraction is not modelled, whose forces are constant; expected one of them"
    )


# no slots: cached properties need an instance dictionary
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class AttractingEnsemble(Ensemble):
    """The ensemble that `Ensemble` creates for an ``attraction``.

    A touching asperity is pulled with a constant force F. Loads from outside are N = Σ (P - F);
    tractions, stick radii and the friction limit belong to the loads P of the contact, so that the
    tangential memory as a function of the approach is the same as without attraction. Under load
    control the approach continues in the direction of the path to the first position with that
    load; states have the number of jumps and the energy lost in them.
    """

    attraction: Attraction = attrs.field(init=False)

    attracts = True
    unsupported: ClassVar[dict[Feature, str]] = {
        "wear": _refusal("wear"),
        "yielding": _refusal("yielding"),
        "geometry change": _refusal("a change of summits"),
        "friction ramp": _refusal("friction that changes along a path"),
        "step in place": "steppers, and with them reduced models and units of co-simulation, have no attraction; "
        "expected advance or hs.replay, or a contact without attraction",
        "fit": "a fit has no attraction; expected an ensemble without it",
    }

    def __init__(self, *arguments: Any, attraction: Attraction, **options: Any) -> None:
        if not isinstance(attraction, Attraction):
            raise InputError(
                f"attraction is {attraction!r}; expected hs.attraction.DMT(…) or hs.attraction.Meniscus(…)"
            )
        super().__init__(*arguments, **options)
        for feature in ("wear", "yielding"):
            if getattr(self, feature) is not None:
                raise InputError(self.unsupported[feature])
        self.__dict__["attraction"] = attraction

    @property
    def laws(self) -> dict[str, Law]:
        """Laws of ``friction`` and ``attraction``."""
        return super().laws | {"attraction": self.attraction}

    @property
    def pulls(self) -> Pulls:
        """Attraction as a function of the approach."""
        if "_pulls" not in self.__dict__:
            order = np.argsort(self.first_touch, kind="stable")
            force = np.append(0.0, np.cumsum(self.attraction.forces(self.summit_radius)[order]))
            self.__dict__["_pulls"] = Pulls(self.first_touch[order], force)
        pulls: Pulls = self.__dict__["_pulls"]
        return pulls

    def initial_state(self) -> State:
        """Return the unloaded virgin state, which nothing attracts yet: the highest summit just does not touch."""
        return AttractedState.wrap(super().initial_state(), self.pulls, 0, 0.0)

    def _wrap_memory(self, memory: Memory) -> State:
        """Wrap a memory of this ensemble in a state that has not jumped."""
        return AttractedState.wrap(super()._wrap_memory(memory), self.pulls, 0, 0.0)

    def with_friction(self, state: State, friction: ArrayLike, **options: Any) -> State:
        """Return the state with new friction coefficients; see `Ensemble.with_friction`."""
        return self._continue(super().with_friction(state, friction, **options), state)

    def enter_plane(self, state: State) -> State:
        """Return a state in two tangential directions; see `IntegratedBody.enter_plane`."""
        return self._continue(super().enter_plane(state), state)

    def stepper(self, *_: Any, **__: Any) -> Any:
        """Refuse a stepper."""
        raise InputError(self.unsupported["step in place"])

    def with_geometry(self, *_: Any, **__: Any) -> State:
        """Refuse a change of summits."""
        raise InputError(self.unsupported["geometry change"])

    def approach_at(self, normal_load: float) -> float:
        """Solve for the approach [m] to which the virgin contact snaps in under a load from outside ≥ 0 [N]."""
        load = scalar("normal_load", normal_load, least=0.0)
        return self.resolve(0.0, load)[1]

    def contact_load(self, approach: float) -> float:
        """Return the normal load of the contact at an approach [N]."""
        depth = np.maximum(approach - self.first_touch, 0.0)
        return float(
            4.0 / 3.0 * self.pair.contact_modulus * (np.sqrt(self.summit_radius) * depth**1.5).sum()
        )

    def pull_off(self, approach: float) -> tuple[float, float]:
        """Return the least load from outside [N], and its approach [m], on the way back from an approach [m]."""
        touches = np.unique(self.pulls.touch[self.pulls.touch < approach])
        if not touches.size:
            return 0.0, 0.0
        sums = self.pulls.force[np.searchsorted(self.pulls.touch, touches, side="right")]
        loads = np.array([self.contact_load(float(touch)) for touch in touches]) - sums
        least = int(loads.argmin())
        return float(loads[least]), float(touches[least])

    def resolve(self, approach: float, load: float) -> tuple[list[Jump], float, float]:
        """Return the jumps on a path from an approach to a load from outside, and approach and contact load at its end.

        PullOffError if the contact separates before.
        """
        touch, force, count = (
            *self.pulls,
            int(np.searchsorted(self.pulls.touch, approach, side="left")),
        )
        jumps: list[Jump] = []
        present = self.contact_load(approach) - force[count]
        if count and load == present:
            return jumps, approach, load + float(force[count])
        rises = load >= present
        if not count and not rises:
            raise PullOffError(load, 0.0)
        # the load at which it jumps, and where it does
        jump: tuple[float, float] | None = None
        if not count:
            jump, count = (
                (0.0, float(touch[0])),
                int(np.searchsorted(touch, touch[0], side="right")),
            )
        while True:
            target = load if jump is None else jump[0]
            if rises:
                following = float(touch[count]) if count < touch.size else math.inf
                edge = (
                    self.contact_load(following) - force[count]
                    if following < math.inf
                    else math.inf
                )
                met = edge >= target
            elif count:
                following = float(touch[count - 1])
                edge = self.contact_load(following) - force[count]
                met = edge <= target + AT_PULL_OFF * force[count]
            else:
                raise PullOffError(load, target)
            if met:
                pressed = target + force[count]
                if not rises:
                    pressed = max(
                        pressed, self.contact_load(following) + AT_PULL_OFF * force[count]
                    )
                approach = float(lib.hs_approach_at(self._contact, pressed))
                if jump is None:
                    return jumps, approach, float(pressed)
                jumps.append(Jump(jump[0], approach, self._jump_energy(jump[1], approach, jump[0])))
                jump = None
                if load == target:
                    return jumps, approach, float(pressed)
                continue
            jump = jump or (edge, following)
            count = int(np.searchsorted(touch, following, side="right" if rises else "left"))

    def _jump_energy(self, start: float, end: float, load: float) -> float:
        """Return the energy lost in a jump between approaches at a load from outside [J]: ∫ (N - Σ (P - F)) dd."""
        root, forces = np.sqrt(self.summit_radius), self.attraction.forces(self.summit_radius)
        depths = [np.maximum(approach - self.first_touch, 0.0) for approach in (start, end)]
        elastic = (
            8.0
            / 15.0
            * self.pair.contact_modulus
            * float((root * (depths[1] ** 2.5 - depths[0] ** 2.5)).sum())
        )
        return max(
            load * (end - start) - elastic + float((forces * (depths[1] - depths[0])).sum()), 0.0
        )

    def advance(self, state: State, **targets: Any) -> State:
        """Return the state after one joint straight path; see `Ensemble.advance`. Normal loads may be negative."""
        memory, goals = self._checked_memory(state), []
        controls = memory.line.normal_control, tangential_control(memory)
        for name, control in zip(("normal", "tangential"), controls, strict=True):
            load, place = (targets.pop(f"{name}_{kind}", None) for kind in ("load", "displacement"))
            goals.append(channel(name, load, place, control))
        friction = targets.pop("friction", None)
        moved = self.advance_along(state, make_path(*goals), **targets)
        if friction is None:
            return moved
        return self.advance(
            self.with_friction(moved, friction, instrument=targets.get("instrument", RIGID)),
            **targets,
        )

    def advance_along(
        self,
        state: State,
        paths: Paths,
        *,
        rows: Rows | None = None,
        friction: FrictionGoal | None = None,
        until: float = 1.0,
        **options: Any,
    ) -> State:
        """Advance a state along load paths and record rows; see `Ensemble.advance_along`.

        The recorded total normal load is that from outside.
        """
        self._checked_memory(state)
        if friction is not None:
            raise InputError(self.unsupported["friction ramp"])
        legs = _Legs(self, state.approach, paths if rows is not None else drop_rows(paths), until)
        try:
            moved = super().advance_along(state, legs.paths, rows=rows, **options)
        except (FrictionLimitError, CurveEndError) as error:
            error.path = legs.origin[error.path]
            raise
        before: Any = state
        jumps, energy = (
            before.jumps + np.cumsum(legs.jumps),
            before.jump_energy + np.cumsum(legs.energy),
        )
        if rows is not None and legs.paths.size:
            leg = np.repeat(
                np.arange(legs.paths.size), legs.paths["parts"] - 1 + legs.paths["recorded"]
            )
            # a jump on a path in several parts is at its end
            last = np.append(leg[1:] != leg[:-1], True) & (legs.paths["recorded"][leg] == 1)
            row = np.where(last, leg + 1, leg)
            rows.totals["normal_load"] -= self.pulls.compute_sum(rows.totals["approach"])
            rows.totals["yielded_share"] = np.append(before.jumps, jumps)[row]
            rows.totals["yielding_energy"] = np.append(before.jump_energy, energy)[row]
        counts = (
            (int(jumps[-1]), float(energy[-1]))
            if legs.paths.size
            else (before.jumps, before.jump_energy)
        )
        return AttractedState.wrap(moved, self.pulls, *counts)

    def _continue(self, state: State, before: Any) -> State:
        """Return a state with the jumps of the one before."""
        return AttractedState.wrap(state, self.pulls, before.jumps, before.jump_energy)


# an ensemble with attraction is of this class
Ensemble.attracting_type = AttractingEnsemble


class _Legs:
    """Paths of loads from outside, as paths of the contact: cut where the approach jumps."""

    def __init__(
        self, ensemble: AttractingEnsemble, approach: float, paths: Paths, until: float
    ) -> None:
        self._ensemble, self._approach, self._until = ensemble, approach, until
        self._legs: list[Any] = []
        self.origin: list[int] = []
        self.jumps: list[int] = []
        self.energy: list[float] = []
        for index, path in enumerate(paths):
            self._add(index, path)
        self.paths = np.array(self._legs, paths.dtype)
        rows = self.paths["parts"] - 1 + self.paths["recorded"]
        self.paths["first_row"] = np.cumsum(rows) - rows

    def _add(self, index: int, path: Any) -> None:
        """Add the legs of a path."""
        leg = path.copy()
        leg["tangential_fraction"] = path["tangential_fraction"] * self._until
        fraction = float(path["normal_fraction"]) * self._until
        leg["normal_fraction"] = fraction
        if path["normal_control"] == DISPLACED or not fraction:
            if path["normal_control"] == DISPLACED:
                target = float(path["normal_target"])
                self._approach = (
                    target
                    if fraction == 1.0
                    else self._approach + fraction * (target - self._approach)
                )
            else:
                # a load that is held holds the approach
                leg["normal_control"], leg["normal_target"], leg["normal_fraction"] = (
                    DISPLACED,
                    self._approach,
                    1.0,
                )
            self._append(index, leg)
            return
        ensemble, start = self._ensemble, self._approach
        present = ensemble.contact_load(start) - float(ensemble.pulls.compute_sum(start))
        load = present + fraction * (float(path["normal_target"]) - present)
        load = float(path["normal_target"]) if fraction == 1.0 else load
        try:
            jumps, self._approach, pressed = ensemble.resolve(start, load)
        except PullOffError as error:
            error.path = index
            raise
        leg["normal_fraction"] = 1.0
        if DISPLACED in path["tangential_control"].tolist():
            # straight in approach and displacement
            leg["normal_control"], leg["normal_target"] = DISPLACED, self._approach
            self._append(index, leg, len(jumps), sum(jump.energy for jump in jumps))
        elif not jumps:
            leg["normal_control"], leg["normal_target"] = LOAD, pressed
            self._append(index, leg)
        else:
            self._cut(index, leg, jumps, (start, present, load, pressed))

    def _cut(self, index: int, path: Any, jumps: list[Jump], ends: tuple[float, ...]) -> None:
        """Add legs between rows and jumps of a path in loads."""
        (start, present, load, pressed), parts = ends, int(path["parts"])
        width, done, pulled = load - present, 0.0, float(self._ensemble.pulls.compute_sum(start))
        points: list[tuple[float, int, Jump | None]] = [
            (part / parts, 1, None) for part in range(1, parts + 1)
        ]
        points += [
            ((jump.normal_load - present) / width if width else 0.0, 0, jump) for jump in jumps
        ]
        # a row at the load of a jump is after it
        for share, _, jump in sorted(points, key=lambda point: point[:2]):
            if share > done or jump is None:
                leg = _part(path, done, share)
                is_end = share == 1.0 and jump is None
                target = pressed if is_end else present + share * width + pulled
                leg["normal_control"], leg["normal_target"] = LOAD, max(target, 0.0)
                leg["recorded"] = jump is None and (share < 1.0 or bool(path["recorded"]))
                self._append(index, leg)
                done = share
            if jump is not None:
                leg = _part(path, done, done)
                leg["normal_control"], leg["normal_target"], leg["recorded"] = (
                    DISPLACED,
                    jump.approach,
                    False,
                )
                self._append(index, leg, 1, jump.energy)
                pulled = float(self._ensemble.pulls.compute_sum(jump.approach))

    def _append(self, index: int, leg: Any, jumps: int = 0, energy: float = 0.0) -> None:
        self._legs.append(leg)
        self.origin.append(index)
        self.jumps.append(jumps)
        self.energy.append(energy)


def _part(path: Any, start: float, end: float) -> Any:
    """Return the part of a path between two shares of it, without inner rows."""
    leg = path.copy()
    fraction, left = path["tangential_fraction"], 1.0 - path["tangential_fraction"] * start
    covered = np.divide(fraction * (end - start), left, out=np.zeros(2), where=left > 0.0)
    leg["tangential_fraction"] = np.where(
        (end == 1.0) & (start < 1.0) & (fraction == 1.0), 1.0, covered
    )
    leg["parts"] = 1
    duration = path["end"] - path["begin"]
    leg["begin"], leg["end"] = path["begin"] + start * duration, path["begin"] + end * duration
    return leg
