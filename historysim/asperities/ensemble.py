"""`Ensemble`: asperities between two rigid bodies, with one approach and one tangential displacement."""

import inspect
import json
from contextlib import AbstractContextManager
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self, Unpack

import attrs
import numpy as np

from historysim.asperities.asperity_set import AsperitySet, per_asperity, summit_fields
from historysim.asperities.body import Drive, PathOptions, check_pair
from historysim.asperities.instrument import RIGID, RINGS, Instrument, Rings, as_instrument
from historysim.asperities.integration import IntegratedBody, return_path
from historysim.asperities.law import FrictionGoal, FrictionLaw, Law, coulomb, make_evolution
from historysim.asperities.state import State
from historysim.basics.arguments import ArrayLike, Booleans, Floats, Integers, scalar, workable
from historysim.basics.library import lib, pointer
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory import binding
from historysim.memory.binding import Memory, check, copy_state, view
from historysim.memory.paths import Paths

if TYPE_CHECKING:
    from historysim.asperities.asperity import Asperities, Asperity
    from historysim.asperities.patches import Patches
    from historysim.asperities.wear import WearLaw
    from historysim.asperities.yielding import YieldingLaw
    from historysim.interaction.solutions import NormalSolutions


# no slots: cached properties need an instance dictionary
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class Ensemble(AsperitySet, IntegratedBody):
    """Hertzian asperities under one rigid flat: shared approach, shared tangential displacement, no other interaction.

    Parameters
    ----------
    pair : MaterialPair
    summit_height : array_like
        Heights z of the summits over any datum [m], scalar or one per asperity.
    summit_radius : array_like
        Radii R [m], > 0, one for all or one per asperity.
    friction : array_like or FrictionLaw
        Coulomb coefficients μ ≥ 0, one for all or one per asperity, or a law (see
        `historysim.asperities.laws`).
    x, y : array_like, optional
        Positions of the summits [m]; stored, without influence.
    nominal_area : float, optional
        Nominal contact area [m²], > 0; stored, without influence.
    tolerance : float
        Error that a straight ramp of both loads may have: of displacements relative to full slip;
        energies may have 10 times as much, relative to the ramp.
    wear : WearLaw, optional
        Wear of the asperities as they slide (see `historysim.asperities.wear`).
    follow_sliding : bool
        Track the distance that each asperity slides; wear, and friction that depends on it, always
        do.
    yielding : YieldingLaw or str, optional
        Yielding of summits on first loading (see `historysim.asperities.yielding`), or the name of
        a law, with the hardness of the pair.
    rings : Rings, optional
        Resolution of asperities that move in two tangential directions.
    attraction : Attraction, optional
        Constant force on each touching asperity (see `historysim.asperities.attraction`).

    Raises
    ------
    InputError
        A number that is not finite or out of range, arrays of different lengths, both wear and
        yielding, or a yielding law without a known hardness.

    Warns
    -----
    UnlikelyValueWarning
        A coefficient above 2, or no radius below 0.5 m, unless the pair is made by
        `MaterialPair.from_moduli`.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ensemble = hs.Ensemble(pair, summit_height=[0.0, -30e-9], summit_radius=10e-6, friction=0.2)
    >>> state = ensemble.advance(ensemble.initial_state(), normal_load=4e-3)
    >>> state = ensemble.advance(state, tangential_displacement=5e-9)
    >>> print(f"{state.tangential_load * 1e3:.4f} mN on {state.contact_count} asperities")
    0.4414 mN on 2 asperities
    """

    pair: MaterialPair
    summit_height: Floats
    summit_radius: Floats
    friction: Floats
    x: Floats | None
    y: Floats | None
    tolerance: float
    nominal_area: float | None
    law: FrictionLaw | None
    wear: "WearLaw | None"
    follow_sliding: bool
    yielding: "YieldingLaw | None"
    rings: Rings

    #: Class of ensembles with attraction, once its module is imported.
    attracting_type: ClassVar[Any] = None

    def __new__(cls, *_: Any, attraction: Any = None, **__: Any) -> Self:
        """Make an `AttractingEnsemble` where there is an attraction."""
        if attraction is not None and cls is Ensemble:
            if cls.attracting_type is None:
                raise InputError(
                    f"attraction is {attraction!r}; expected hs.attraction.DMT(…) or hs.attraction.Meniscus(…)"
                )
            made: Any = super().__new__(cls.attracting_type)
            return made  # type: ignore[no-any-return] # its __init__ follows
        return super().__new__(cls)

    def __init__(
        self,
        pair: MaterialPair,
        summit_height: "ArrayLike",
        summit_radius: "ArrayLike",
        friction: "ArrayLike | FrictionLaw",
        *,
        x: "ArrayLike | None" = None,
        y: "ArrayLike | None" = None,
        nominal_area: float | None = None,
        tolerance: float = 1e-6,
        wear: "WearLaw | None" = None,
        follow_sliding: bool = False,
        yielding: "YieldingLaw | str | None" = None,
        rings: Rings = RINGS,
        attraction: Law | None = None,
    ) -> None:
        # of another class, which `__new__` makes
        del attraction
        options: dict[str, Any] = {
            "x": x,
            "y": y,
            "nominal_area": nominal_area,
            "tolerance": tolerance,
        }
        fields = summit_fields(pair, summit_height, summit_radius, friction, **options)
        if wear is not None:
            from historysim.asperities.wear import check_wear

            check_wear(wear)
        yielding_of_pair = None
        if yielding is not None:
            from historysim.asperities.yielding import law_on_summits

            yielding_of_pair = law_on_summits(yielding, pair, fields["summit_radius"])
        self.__attrs_init__(
            **fields,
            law=friction if isinstance(friction, FrictionLaw) else None,
            wear=wear,
            follow_sliding=bool(follow_sliding),
            yielding=yielding_of_pair,
            rings=rings,
        )
        if self.yielding is not None and wear is not None:
            raise InputError(
                "wear and yielding cannot be combined, since a summit that wears is not the one that yielded; give one "
                "of them, or passes of a map, which have both"
            )

    @classmethod
    def from_summits(
        cls, pair: MaterialPair, summits: Any, friction: ArrayLike | FrictionLaw, **options: Any
    ) -> Self:
        """Make an ensemble from summits, which have ``height``, ``radius``, ``x`` and ``y`` [m]; options of `Ensemble`.

        Summits with a ``slope`` need `InclinedEnsemble`; InputError otherwise.
        """
        if getattr(summits, "slope", None) is not None:
            raise InputError("the summits meet on slopes; expected InclinedEnsemble.from_summits")
        return super().from_summits(pair, summits, friction, **options)

    @staticmethod
    def from_normal_curves(
        pair: MaterialPair,
        approach: ArrayLike,
        load: ArrayLike,
        area: ArrayLike | None = None,
        friction: float = 0.2,
        **options: Any,
    ) -> "Patches":
        """Make patches from normal curves: an earlier name of `Patches.from_normal_curves`."""
        from historysim.asperities.patches import Patches

        return Patches.from_normal_curves(pair, approach, load, area, friction, **options)

    @staticmethod
    def from_solutions(
        pair: MaterialPair, solutions: "NormalSolutions", friction: float = 0.2, **options: Any
    ) -> "Patches":
        """Make an ensemble of the patches of a rough contact; options and errors of `from_normal_curves`."""
        from historysim.asperities.curves import NormalCurves
        from historysim.asperities.patches import Patches

        x, y = solutions.position
        load, stiffness = (
            values * check_pair(pair).contact_modulus
            for values in (solutions.load, solutions.stiffness)
        )
        curves = NormalCurves.from_exact(
            solutions.approach, load, solutions.area, stiffness, x=x, y=y
        )
        return Patches(pair, curves, friction, highest_summit=solutions.highest_summit, **options)

    @property
    def elements(self) -> int:
        """Number of elements of the traction memory: asperities."""
        return self.summit_height.size

    @property
    def evolves(self) -> bool:
        """True if friction depends on loads, summits wear or yield, or slid distances are tracked."""
        return self.slides or self.yielding is not None

    @property
    def slides(self) -> bool:
        """True if the distance that each asperity slides is tracked."""
        changing = self.law is not None and self.law.depends_on != "nothing"
        return changing or self.wear is not None or self.follow_sliding

    @property
    def laws(self) -> dict[str, Law]:
        """Laws of ``friction``, ``wear`` and ``yielding`` that it has, by these names."""
        laws = {"friction": self.law, "wear": self.wear, "yielding": self.yielding}
        return {name: law for name, law in laws.items() if law is not None}

    @property
    def settings(self) -> dict[str, Any]:
        """Numbers that define it in addition to its arrays and laws, as a log stores them."""
        options = {
            "follow_sliding": self.follow_sliding or None,
            "rings": None if self.rings == RINGS else attrs.asdict(self.rings),
        }
        return super().settings | {
            name: value for name, value in options.items() if value is not None
        }

    @property
    def direction_limit(self) -> str:
        """Feature that restricts it to one tangential direction, such as "wear"; empty if it may move in two."""
        features = (
            ("wear", self.wear),
            ("yielding", self.yielding),
            ("a friction law", self.law if self.slides else None),
        )
        return next(
            (name for name, feature in features if feature is not None),
            "sliding that is followed" * self.slides,
        )

    def approach_at(self, normal_load: float) -> float:
        """Solve for the approach [m] at which the virgin contact first carries a normal load ≥ 0 [N], at U = 0."""
        load = scalar("normal_load", normal_load, least=0.0)
        if self.yielding is not None and load > 0:
            return self.advance(self.initial_state(), normal_load=load).approach
        return super().approach_at(load)

    def _may_touch(self, normal_load: float, approach: float, displacement: float) -> Booleans:
        """Select asperities that may touch up to a normal load [N] or an approach [m]; all if they wear."""
        if self.wear is not None:
            return np.ones(len(self), dtype=bool)
        return super()._may_touch(normal_load, approach, displacement)

    def with_friction(
        self,
        state: State,
        friction: ArrayLike,
        *,
        asperities: ArrayLike | None = None,
        instrument: Instrument = RIGID,
    ) -> State:
        """Return the state with new friction coefficients, which override a friction law from now on.

        One coefficient, or one per asperity, 0 or more, applies to the asperities with these
        indices, by default to all; InputError for other numbers or indices. Where a coefficient
        falls, springs beyond the new limit slip immediately. A controlled tangential load is held,
        and so is the displacement of an instrument's drive: U follows, as it would if the
        coefficients fell in many small steps. A load that friction can no longer support stays in
        the state: the contact slides at the displacement at which sliding began, and the next path
        raises an error unless it unloads, or holds the load at the limit.
        """
        memory, chosen = copy_state(self._checked_memory(state)), self._selected_indices(asperities)
        coefficients = state.friction
        coefficients[chosen] = coulomb(friction, chosen.size)
        if memory.line.evolved:
            view(memory.line.evolved.friction_overridden, self.elements)[chosen] = 1
        return self._set_friction(memory, coefficients, instrument)

    def with_geometry(
        self,
        state: State,
        *,
        summit_height: ArrayLike | None = None,
        summit_radius: ArrayLike | None = None,
        asperities: ArrayLike | None = None,
        **drive: Unpack[Drive],
    ) -> State:
        """Return the state with new summits, each of which is a new contact.

        The memory of a changed summit is erased, its springs are unstrained; summits that keep
        their height and radius keep their memory. Then each channel returns to its controlled
        value: a controlled load is restored, two loads along a joint straight path.

        New heights, over the same datum, and radii [m] apply to the asperities with these indices,
        by default to all; an omitted quantity is unchanged. ``saturate`` and ``instrument`` are as
        for `advance`. InputError: numbers out of range, or indices that the ensemble does not have.
        FrictionLimitError: the new contact cannot support the tangential load.
        """
        binding.check_one_direction(self._checked_memory(state))
        memory, chosen = copy_state(state.memory), self._selected_indices(asperities)
        self._track_evolution(memory)
        count, evolved = self.elements, memory.line.evolved
        old = view(evolved.summit_height, count), view(evolved.summit_radius, count)
        height, radius = old[0].copy(), old[1].copy()
        if summit_height is not None:
            height[chosen] = workable(
                "summit_height", per_asperity("summit_height", summit_height, chosen.size)
            )
        if summit_radius is not None:
            radius[chosen] = workable(
                "summit_radius", per_asperity("summit_radius", summit_radius, chosen.size, above=0)
            )
        fresh = ((height != old[0]) | (radius != old[1])).astype(np.uint8)
        if self.wear is not None:
            # a replaced asperity is unworn, even if its height and radius are unchanged
            fresh[chosen] = 1
        if not fresh.any():
            return state
        virgin = np.where(fresh, radius, self._virgin_radius(memory))
        with self._make_evolution(virgin) as evolution:
            check(
                lib.hs_set_summits(
                    memory, pointer(height), pointer(radius), pointer(fresh), evolution
                )
            )
        back = return_path(state.memory, as_instrument(drive.get("instrument", RIGID)))
        return self.advance_along(self._wrap_memory(memory), back, **drive)

    def advance_along(
        self,
        state: State,
        paths: Paths,
        **options: Unpack[PathOptions],
    ) -> State:
        """Advance a state along load paths and record rows; see `PathOptions`.

        Pairs of tangential targets convert any state to two directions. Errors are as for
        `advance`, with the index of the path.
        """
        return self._integrate(state, paths, **options)

    def asperity(self, index: int, state: State) -> "Asperity":
        """Return one asperity with its memory in a state; InputError if the index is out of range.

        In two tangential directions the last axis of its tangential quantities is x and y.
        """
        if not isinstance(index, int | np.integer) or not 0 <= index < len(self):
            raise InputError(
                f"asperity {index!r} does not exist; expected an index from 0 to {len(self) - 1}"
            )
        self._checked_memory(state)
        from historysim.asperities.asperity import Asperity
        from historysim.asperities.readout import Readout

        return Asperity.from_readout(Readout(self, state, [int(index)]), 0, int(index))

    def asperities(self, state: State) -> "Asperities":
        """Return all asperities with their memories in a state, as a sequence: ``len``, index, slice, iteration.

        Their loads, radii and slip states are read in one batch.
        """
        self._checked_memory(state)
        from historysim.asperities.asperity import Asperities, Asperity
        from historysim.asperities.readout import Readout

        readout = Readout(self, state, range(len(self)))
        return Asperities(
            lambda index: Asperity.from_readout(readout, index, index), range(len(self))
        )

    @cached_property
    def _contact(self) -> Any:
        """Initial contact, as a structure of the library."""
        keys = [self.friction]
        if self.wear is not None or (
            self.law is not None and self.law.depends_on in {"own", "slid"}
        ):
            # asperities share a memory only if everything that their friction depends on is equal
            keys += [self.summit_height, self.summit_radius]
        moduli = self.pair.contact_modulus, self.pair.displacement_ratio
        return binding.new_contact(
            self.summit_height, self.summit_radius, None, _group_numbers(*keys), *moduli
        )

    @property
    def _element_friction(self) -> Floats:
        return self.friction

    @property
    def _identity_bytes(self) -> bytes:
        """Settings of the laws, added to the digest of contact and friction that identifies states."""
        if not self.laws and not self.follow_sliding:
            return b""
        numbers = [law.numbers for law in self.laws.values()]
        # a field of a user-defined law is identified by its type, since its address differs between
        # processes
        text = json.dumps(
            [numbers, self.follow_sliding],
            sort_keys=True,
            default=lambda law: type(law).__qualname__,
        )
        return text.encode()

    def _track_evolution(self, memory: Memory) -> None:
        """Make a memory track the evolution of its asperities from now on."""
        line = memory.line
        if not line.evolved:
            check(lib.hs_state_evolve(memory))
            # copied exactly: gaps would not reproduce heights to the bit
            view(line.evolved.summit_height, self.elements)[:] = self.summit_height
            view(line.evolved.summit_radius, self.elements)[:] = self.summit_radius
        if self.yielding is not None:
            check(lib.hs_state_yield(memory))

    def _virgin_radius(self, memory: Memory) -> Floats:
        """Return the summit radii before yielding [m] (asperity)."""
        evolved = memory.line.evolved
        return view(evolved.virgin_radius or evolved.summit_radius, self.elements).copy()

    def _evolution(self, memory: Memory, goal: FrictionGoal | None) -> AbstractContextManager[Any]:
        """Return a context of the ``hs_evolution`` of one call, which is NULL if nothing evolves."""
        evolved = memory.line.evolved
        if not evolved:
            return super()._evolution(memory, goal)
        if goal is not None:
            view(evolved.friction_overridden, self.elements)[:] = 1
        return self._make_evolution(self._virgin_radius(memory), goal)

    def _make_evolution(
        self, virgin_radius: Floats, goal: FrictionGoal | None = None
    ) -> AbstractContextManager[Any]:
        # the library knows no attraction
        laws, follow = tuple(law for law in self.laws.values() if law.struct), self.follow_sliding
        return make_evolution(
            self.pair, laws, follow_sliding=follow, virgin_radius=virgin_radius, goal=goal
        )

    def _selected_indices(self, asperities: ArrayLike | None) -> Integers:
        if asperities is None:
            return np.arange(self.elements)
        chosen = np.atleast_1d(np.asarray(asperities))
        if (
            chosen.dtype.kind not in "iu"
            or chosen.ndim != 1
            or np.unique(chosen).size != chosen.size
        ):
            raise InputError(
                f"asperities is {asperities!r}; expected a list of indices without repetition"
            )
        outside = chosen[(chosen < 0) | (chosen >= self.elements)]
        if outside.size:
            raise InputError(
                f"asperity {outside[0]} does not exist; expected an index from 0 to {self.elements - 1}"
            )
        return chosen.astype(np.int64)


# that of `__new__` has no names
_made: Any = Ensemble
_made.__signature__ = inspect.Signature(
    [*inspect.signature(Ensemble.__init__).parameters.values()][1:]
)


def _group_numbers(*keys: Floats) -> Integers | None:
    """Return the group number of each asperity, equal if all keys are; None if there is one group."""
    numbers = np.zeros(keys[0].size, dtype=np.int64)
    for key in keys:
        if (key == key[0]).all():
            continue
        _, rank = np.unique(key, return_inverse=True)
        _, numbers = np.unique(numbers * (rank.max() + 1) + rank, return_inverse=True)
    return numbers.astype(np.int64) if numbers.any() else None
