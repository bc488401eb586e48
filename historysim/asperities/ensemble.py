"""`Ensemble`: bodies that share one approach and one tangential displacement; `Patches`: those of normal curves."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, Self, TypeVar, overload

import attrs
import numpy as np

from historysim.asperities.asperity import Asperities, Asperity, Readout
from historysim.asperities.curves import NormalCurves, Superposition
from historysim.asperities.instrument import RIGID, RINGS, Instrument, Rings, as_instrument
from historysim.asperities.law import FrictionGoal, FrictionLaw, Law, coulomb, evolution_of
from historysim.asperities.state import EnsembleState, PlanarState
from historysim.asperities.stepper import PlanarStepper, Stepper, Totals, channel, path_to
from historysim.asperities.wear import WearLaw, check_wear
from historysim.asperities.yielding import YieldingLaw, law_on_summits
from historysim.basics.arguments import ArrayLike, Booleans, Floats, Integers, checked, one_per, scalar, workable
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.limits import SMALLEST
from historysim.basics.units import quantity_text, range_text
from historysim.basics.wording import brief, counted, html_table
from historysim.contact.materials import MaterialPair
from historysim.errors import CurveEndError, FrictionLimitError, InputError
from historysim.memory import binding
from historysim.memory.binding import DISPLACED, LOAD, PLANAR_PATH, Memory, advanced, check, copied, owned, view
from historysim.memory.paths import PROJECTED, Goals, Paths, Rows, blank_rows, in_plane, paths_to, unrecorded

if TYPE_CHECKING:
    from historysim.interaction.solutions import NormalSolutions

AnyState = TypeVar("AnyState", EnsembleState, PlanarState, EnsembleState | PlanarState)
_ALWAYS = {"columns", "asperity", "totals", *PROJECTED, "dissipated_energy", "friction"}
# What is recorded of asperities that evolve, beside what always is.
EVOLVED = {name for name, _ in ffi.typeof("hs_rows").fields} - _ALWAYS


def check_pair(pair: MaterialPair) -> MaterialPair:
    """Return the argument, which has to be a pair of materials."""
    if not isinstance(pair, MaterialPair):
        raise InputError(f"pair is {pair!r}; expected a MaterialPair")
    return pair


def refused(text: str) -> Any:
    """Return a method that a kind of ensemble does not have: it raises an InputError."""

    def method(*_: Any, **__: Any) -> NoReturn:
        raise InputError(text)

    return method


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class Ensemble:
    """Hertzian asperities under one rigid flat: shared approach, shared tangential displacement, no other interaction.

    Parameters
    ----------
    pair : MaterialPair
    summit_height : array_like
        Heights z of the summits over any datum [m], scalar or one per asperity.
    summit_radius : array_like
        Radii R [m], > 0, one for all or one per asperity.
    friction : array_like or FrictionLaw
        Coulomb coefficients μ ≥ 0, one for all or one per asperity, or a law (see `historysim.asperities.laws`).
    x, y : array_like, optional
        Positions of the summits [m]; carried along, without influence.
    nominal_area : float, optional
        Area that the asperities stand on [m²], > 0; carried along, without influence.
    tolerance : float
        Relative change of displacement and energy at which a ramp of both loads that has to be refined is settled.
    wear : WearLaw, optional
        What sliding takes from the asperities (see `historysim.asperities.wear`).
    follow_sliding : bool
        Follow how far each asperity slides, which wear and friction that depends on it do in any case.
    yielding : YieldingLaw or str, optional
        How summits yield on first loading (see `historysim.asperities.yielding`), or the name of a law, with the
        hardness of the pair.
    rings : Rings, optional
        How finely asperities are resolved that move in two tangential directions.

    Raises
    ------
    InputError
        A number that is not finite or out of range, arrays of different lengths, both wear and yielding, or a law of
        yielding without a known hardness.

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
    curves: NormalCurves | None
    slope: Floats | None
    nominal_area: float | None
    law: FrictionLaw | None
    wear: WearLaw | None
    follow_sliding: bool
    yielding: YieldingLaw | None
    rings: Rings

    nouns: ClassVar[tuple[str, str]] = "asperity", "asperities"  #: what one of its bodies is called, and several
    shown: ClassVar[dict[str, str]] = {"summit_height": "m", "summit_radius": "m", "friction": ""}

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
        wear: WearLaw | None = None,
        follow_sliding: bool = False,
        yielding: YieldingLaw | str | None = None,
        rings: Rings = RINGS,
    ) -> None:
        check_pair(pair)
        if wear is not None:
            check_wear(wear)
        each = partial(one_per, "asperity", "asperities")
        height = each("summit_height", summit_height)
        if not height.size:
            raise InputError("summit_height is empty; expected one number, or a list with one per asperity")
        count = max(height.size, np.size(summit_radius))
        height = each("summit_height", height, count)
        radius = each("summit_radius", summit_radius, count, above=0)
        law = friction if isinstance(friction, FrictionLaw) else None
        coefficients: Any = friction if law is None else law.at_start(count)
        # the unit of length is the largest radius, beside which others may be ever so small
        workable("summit_radius", radius.max(), smallest=SMALLEST)
        workable("summit_radius", radius)
        workable("summit_height", height)
        self.__attrs_init__(
            pair=pair,
            summit_height=height,
            summit_radius=radius,
            friction=each("friction", coulomb(coefficients, count), count),
            x=None if x is None else each("x", x, count),
            y=None if y is None else each("y", y, count),
            tolerance=float(checked("tolerance", tolerance, above=0)),
            curves=None,
            slope=None,
            nominal_area=None if nominal_area is None else scalar("nominal_area", nominal_area, above=0),
            law=law,
            wear=wear,
            follow_sliding=bool(follow_sliding),
            yielding=law_on_summits(yielding, pair, radius),
            rings=rings,
        )
        if self.yielding is not None and wear is not None:
            raise InputError(
                "wear and yielding cannot be combined, since a summit that wears is not the one that yielded; give one "
                "of them, or passes of a map, which have both"
            )

    @classmethod
    def from_summits(cls, pair: MaterialPair, summits: Any, friction: ArrayLike | FrictionLaw, **options: Any) -> Self:
        """Make an ensemble of summits, which have ``height``, ``radius``, ``x`` and ``y`` [m]; options as above.

        Those with a ``slope`` are for `InclinedEnsemble`, else an InputError.
        """
        if not all(hasattr(summits, name) for name in ("height", "radius", "x", "y")):
            raise InputError(f"summits is {brief(summits)}; expected Summits, such as Surface.summits() gives")
        options = {"x": summits.x, "y": summits.y, "nominal_area": getattr(summits, "nominal_area", None)} | options
        if getattr(summits, "slope", None) is not None:
            if cls is Ensemble:
                raise InputError("the summits meet on slopes; expected InclinedEnsemble.from_summits")
            options["slope"] = summits.slope
        return cls(pair, summits.height, summits.radius, friction, **options)

    @staticmethod
    def from_normal_curves(
        pair: MaterialPair,
        approach: ArrayLike,
        load: ArrayLike,
        area: ArrayLike | None = None,
        friction: float = 0.2,
        *,
        noise: ArrayLike | None = None,
        highest_summit: float = 0.0,
        x: ArrayLike | None = None,
        y: ArrayLike | None = None,
        tolerance: float = 1e-6,
        rings: Rings = RINGS,
    ) -> "Ensemble":
        """Make an ensemble of patches of one contact, which may press on one another, of their normal curves.

        Tangential loads are superpositions of normal ones, whatever the shape of the contact and however its
        patches interact (Jäger 1998; Ciavarella 1998): exact for similar materials (Dundurs' β = 0), one direction
        of the tangential load, and ν = 0; for other ν a small transverse slip is neglected. In two directions all
        patches share one class of rings of traction, which is within 1.1 % of μN at ν = 0, and 3 % at ν = 0.45.

        Parameters
        ----------
        pair : MaterialPair
            Its E*/(4 G*) turns approaches into tangential displacements.
        approach : array_like (row)
            Of the whole contact, from first touch at 0, ascending [m].
        load : array_like (row) or (row, patch)
            Normal load of each patch at that approach [N]; one column alone is the whole contact. Their sum has to
            rise ever faster, or in proportion: then it is met exactly, else the nearest that does is taken (see
            `NormalCurves.residual` and `NormalCurves.error`).
        area : array_like, of the shape of ``load``, optional
            Contact areas [m²]; without them there are no areas in the history.
        friction : float
            Coulomb coefficient μ ≥ 0 of the whole contact.
        noise : array_like, optional
            Standard deviation of the noise of the total load [N], one number or one for each row with a load; by
            default none where the total is convex, otherwise what differences of neighbouring rows show.
        highest_summit : float
            Height of the flat at first touch [m].
        x, y : array_like (patch), optional
            Positions of the patches [m].
        tolerance, rings
            As for `Ensemble`.

        Raises
        ------
        InputError
            A table that no elastic contact has: the message names the row.
        """
        curves = NormalCurves.from_table(approach, load, area, noise=noise, x=x, y=y)
        return Patches(pair, curves, friction, highest_summit=highest_summit, tolerance=tolerance, rings=rings)

    @staticmethod
    def from_solutions(
        pair: MaterialPair, solutions: "NormalSolutions", friction: float = 0.2, **options: Any
    ) -> "Ensemble":
        """Make an ensemble of the patches of a rough contact; options and errors as of `from_normal_curves`."""
        x, y = solutions.position
        load, stiffness = (each * check_pair(pair).contact_modulus for each in (solutions.load, solutions.stiffness))
        curves = NormalCurves.from_exact(solutions.approach, load, solutions.area, stiffness, x=x, y=y)
        return Patches(pair, curves, friction, highest_summit=solutions.highest_summit, **options)

    def __repr__(self) -> str:
        texts = [" ".join(line) for line in self._lines]
        return f"<Ensemble: {', '.join([counted(len(self), *self.nouns), *texts])}>"

    def _repr_html_(self) -> str:
        moduli = ("contact modulus E*", self.pair.contact_modulus), ("shear modulus G*", self.pair.shear_modulus)
        texts = [(name, quantity_text(value, "Pa")) for name, value in moduli]
        return html_table([(self.nouns[1], f"{len(self):,}"), *self._lines, *texts])

    @property
    def _lines(self) -> list[tuple[str, str]]:
        """Its summits, friction, wear and yielding, each in a line."""
        texts = {name.replace("_", " "): _span(getattr(self, name), unit) for name, unit in self.shown.items()}
        laws = {"friction": self.law, "wear": self.wear, "yielding": self.yielding}
        return list((texts | {name: law.text for name, law in laws.items() if law is not None}).items())

    def __len__(self) -> int:
        """Return the number of asperities, or of patches."""
        return self.elements

    @property
    def elements(self) -> int:
        """Number of Hertzian contacts that the memory is replayed on: of asperities, or of what carries all patches."""
        return self.summit_height.size

    @property
    def evolves(self) -> bool:
        """Whether friction depends on how asperities are loaded, they wear or yield, or what they slide is followed."""
        return self.slides or self.yielding is not None

    @property
    def slides(self) -> bool:
        """Whether it is followed how far asperities slide."""
        changing = self.law is not None and self.law.depends_on != "nothing"
        return changing or self.wear is not None or self.follow_sliding

    @property
    def laws(self) -> tuple[Law, ...]:
        """Its laws of friction, wear and yielding, those that it has."""
        return tuple(law for law in (self.law, self.wear, self.yielding) if law is not None)

    @property
    def packages(self) -> tuple[str, ...]:
        """Packages of others that its laws come from, each with its version."""
        origins = [law.registry.provider(type(law)) for law in self.laws]
        return tuple(dict.fromkeys(str(origin) for origin in origins if origin is not None))

    @property
    def highest_summit(self) -> float:
        """Height of the highest summit [m]: the separation at first touch."""
        return float(self.summit_height.max())

    @property
    def first_touch(self) -> Floats:
        """Approach at which each asperity or patch first touches [m]."""
        return self.highest_summit - self.summit_height

    @property
    def coordinates(self) -> dict[str, Floats]:
        """What is known of each asperity or patch: heights, radii, friction at the start, positions, slopes."""
        names = ("summit_height", "summit_radius", "friction", "x", "y", "slope")
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    def initial_state(self) -> EnsembleState:
        """Return the unloaded state: the highest summit just touches, nothing is remembered."""
        return EnsembleState(self._beginning, self._beginning)

    @overload
    def advance(  # type: ignore[overload-overlap] # a path of one direction, unless a pair is given
        self,
        state: EnsembleState,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | None = None,
        tangential_displacement: float | None = None,
        friction: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> EnsembleState: ...

    @overload
    def advance(self, state: EnsembleState | PlanarState, **targets: Any) -> PlanarState: ...

    def advance(  # type: ignore[misc] # other names than these are a TypeError
        self,
        state: EnsembleState | PlanarState,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | tuple[float | None, float | None] | None = None,
        tangential_displacement: float | tuple[float | None, float | None] | None = None,
        friction: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> EnsembleState | PlanarState:
        """Return the state after one joint straight path; ``state`` itself is not changed.

        With both loads given, the path is straight in (N, T); with a displacement, straight in the approach and U. A
        channel that is not named is held as it was controlled last: a load stays, or a displacement does.

        In two tangential directions loads and displacements are pairs, in x and y; a state of one direction moved along
        x. Along one line the path is exact; where it turns, it is of the accuracy that ``rings`` says. Each component
        is a channel by itself: None in a pair leaves it to the other argument, or holds it. So
        ``tangential_displacement=(u, None), tangential_load=(None, t)`` drives x under a constant load in y. With a
        displacement in either, the path is straight in the approach and in what each component is controlled by.

        Parameters
        ----------
        state : EnsembleState or PlanarState
        normal_load, tangential_load : float, optional
            Total loads to reach [N]; N ≥ 0. The tangential load may be a pair, with None in one component.
        normal_displacement : float, optional
            Approach of the highest summit from first touch to reach [m]; negative is a gap.
        tangential_displacement : float, optional
            U to reach [m], or a pair, likewise; with an instrument that of its drive, U + T/k_s.
            Beside a spring in parallel the tangential load is that of both, T + k_p (U + T/k_s), and a joint path to it
            is straight in the approach and that load.
        friction : array_like, optional
            New coefficients that act at the end of the path (see `FrictionChange`).
        saturate : bool
            Hold a tangential load beyond the limit at the limit; where one component is a displacement, the other one.
        instrument : Instrument, optional
            In series with the contact. It is no part of the state: give it with each path that it drives.

        Raises
        ------
        FrictionLimitError
            |T| > Σ μ N, of the components that are controlled by load.
        InputError
            A value that is not finite, a negative normal load, or both a load and a displacement of one channel; in two
            directions a single number for a tangential channel, or an ensemble that evolves.
        """
        # a tight loop gets by with one comparison: what is like the start is of one direction
        start = self._beginning
        known = getattr(state, "like", None) is start
        memory = state.memory if known else self._memory_of(state, planar=True)
        moved: EnsembleState | PlanarState
        normal = channel("normal", normal_load, normal_displacement, memory.normal_control, 0.0)
        control = memory.tangential_control
        if not known and isinstance(state, PlanarState):
            control = state.tangential_control
        tangential = channel("tangential", tangential_load, tangential_displacement, control)
        planar = control.__class__ is tuple or tangential[1].__class__ is tuple
        if planar or memory.evolved or (instrument is not RIGID and as_instrument(instrument).parallel_stiffness):
            moved = self.walk(state, path_to(normal, tangential), saturate=saturate, instrument=instrument)
        else:
            if self.curves is not None:
                self.curves.check_reach(path_to(normal, tangential))
            driven = self._drive if instrument is RIGID and not saturate else self.driven(saturate, instrument)
            moved = EnsembleState(advanced(memory, *normal, *tangential, driven), start)
        if friction is None:
            return moved
        moved = self.with_friction(moved, friction, instrument=instrument)
        return self.advance(moved, saturate=saturate, instrument=instrument)

    @property
    def confined(self) -> str:
        """What confines it to one tangential direction: "wear", for one; empty where it may move in two."""
        kinds = ("wear", self.wear), ("yielding", self.yielding), ("a friction law", self.law if self.slides else None)
        if self.slope is not None:
            return "summits that meet on slopes"
        return next((name for name, there in kinds if there is not None), "sliding that is followed" * self.slides)

    def in_plane(self, state: EnsembleState | PlanarState) -> PlanarState:
        """Return a state in two tangential directions; one of one direction moved along x.

        Raises InputError: a state of another ensemble, or of one that moves in one direction alone.
        """
        if self.confined:
            raise InputError(f"one tangential direction goes with {self.confined}; expected one number, not a pair")
        memory = self._memory_of(state, planar=True)
        if isinstance(state, PlanarState):
            return state
        rings = self.rings
        made = lib.hs_planar_new(memory, rings.height_classes, rings.rings, rings.tolerance)
        return PlanarState(binding.owned_planar(made))

    def advance_many(
        self,
        state: EnsembleState,
        *,
        normal_load: ArrayLike | None = None,
        normal_displacement: ArrayLike | None = None,
        tangential_load: ArrayLike | None = None,
        tangential_displacement: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> tuple[EnsembleState, Totals]:
        """Return the state after straight paths, one after the other, and the totals at the end of each.

        It is what as many calls of `advance` would do, bit for bit. Arguments and errors are as there, with one value
        for each path, or one number for all of them; an error has the position of its path.
        """
        memory = self._memory_of(state)
        normal = channel("normal", normal_load, normal_displacement, memory.normal_control, 0.0, several=True)
        tangential = channel(
            "tangential", tangential_load, tangential_displacement, memory.tangential_control, several=True
        )
        counts = {np.size(target) for _, target in (normal, tangential)} - {1}
        if len(counts) > 1 or 0 in counts:
            numbers = " and ".join(map(str, sorted(counts)))
            raise InputError(f"the channels have {numbers} values; expected as many, one or more, or one number")
        paths = path_to(normal, tangential)
        rows = blank_rows(paths.size, None)
        state = self.walk(state, paths, rows=rows, saturate=saturate, instrument=instrument)
        return state, Totals.of(rows.totals)

    @overload
    def stepper(self, state: EnsembleState | None = None, **how: Any) -> Stepper: ...

    @overload
    def stepper(self, state: PlanarState, **how: Any) -> PlanarStepper: ...

    def stepper(  # type: ignore[misc] # other names than these are a TypeError
        self,
        state: EnsembleState | PlanarState | None = None,
        *,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> Stepper | PlanarStepper:
        """Return what steps a state in place, for tight loops; it starts unloaded by default.

        Of a `PlanarState`, such as ``in_plane(initial_state())``, it moves in two tangential directions.
        """
        state = self.initial_state() if state is None else state
        self._memory_of(state, planar=True)
        if isinstance(state, PlanarState):
            return PlanarStepper(state, partial(self.advance, saturate=saturate, instrument=instrument))
        return Stepper(self, state, {"saturate": saturate, "instrument": instrument})

    def load_state(self, path: str | Path) -> Any:
        """Return a state of this ensemble from a file of `save` of either kind; any other one is an InputError."""
        try:
            return self.state_from(Path(path).read_bytes())
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def state_from(self, content: bytes) -> Any:
        """Return the `EnsembleState` or `PlanarState` of its bytes; those of another ensemble are an InputError."""
        start = self.initial_state()
        if content.startswith(b"hsplanar"):
            return PlanarState.from_bytes(content, self.in_plane(start))
        return type(start).from_bytes(content, start)

    def with_friction(
        self,
        state: AnyState,
        friction: ArrayLike,
        *,
        asperities: ArrayLike | None = None,
        instrument: Instrument = RIGID,
    ) -> AnyState:
        """Return the state with other friction coefficients from now on, which override a friction law.

        One coefficient, or one per asperity, 0 or more, is for the asperities with these indices, by default for all;
        other numbers or indices are an InputError. Where a coefficient falls, springs beyond the new limit slip at
        once. A controlled tangential load stays, and so does the displacement of an instrument's drive: U follows, as
        it would if the coefficients fell in many small steps. A load that friction no longer holds stays in the state:
        the contact slides at the displacement at which it began to, and the next path is refused unless it unloads, or
        holds the load at the limit.
        """
        line, chosen = self._memory_of(state, planar=True), self._chosen(asperities)
        coefficients = state.friction
        coefficients[chosen] = self._coefficients(friction, chosen.size)
        if isinstance(state, PlanarState):
            planar = binding.owned_planar(lib.hs_planar_copy(state.planar))
            driven = self.driven(False, RIGID)
            controls = state.tangential_control
            with _driven_by_load(planar.line, instrument) as through:
                if through is not instrument:
                    planar.tangential_control = [DISPLACED, DISPLACED]
                status = lib.hs_planar_set_friction(planar, pointer(coefficients), _compliances(through), driven)
            planar.tangential_control = controls
            if status == lib.HS_FOREIGN:
                raise InputError(
                    "friction differs between asperities that share rings of traction; expected one coefficient for "
                    "those that had one at the start"
                )
            check(status)
            return PlanarState(planar)
        memory = copied(line)
        if memory.evolved:
            view(memory.evolved.friction_overridden, self.elements)[chosen] = 1
        with _driven_by_load(memory, instrument) as through:
            check(lib.hs_set_friction(memory, pointer(coefficients), self.driven(False, through)))
        return EnsembleState(memory, self._beginning)

    def with_geometry(
        self,
        state: EnsembleState,
        *,
        summit_height: ArrayLike | None = None,
        summit_radius: ArrayLike | None = None,
        asperities: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> EnsembleState:
        """Return the state with other summits from now on, each of which is a new contact.

        What the old contact of a changed summit remembered is erased, its springs are no longer strained; those that
        keep their height and radius remember. Then each channel goes back to where it was: a controlled load is
        restored, straight with the other one where both are.

        New heights, over the same datum, and radii [m] are for the asperities with these indices, by default for all;
        what is not given stays. ``saturate`` and ``instrument`` are as for `advance`. InputError: numbers out of range,
        indices that the ensemble does not have, or patches. FrictionLimitError: the new contact does not hold the
        tangential load.
        """
        memory, chosen = copied(self._memory_of(state)), self._chosen(asperities)
        self._follow(memory)
        count, evolved = self.elements, memory.evolved
        old = view(evolved.summit_height, count), view(evolved.summit_radius, count)
        height, radius = old[0].copy(), old[1].copy()
        each = partial(one_per, "asperity", "asperities")
        if summit_height is not None:
            height[chosen] = workable("summit_height", each("summit_height", summit_height, chosen.size))
        if summit_radius is not None:
            radius[chosen] = workable("summit_radius", each("summit_radius", summit_radius, chosen.size, above=0))
        fresh = ((height != old[0]) | (radius != old[1])).astype(np.uint8)
        if self.wear is not None:
            # a worn asperity that is replaced, if by its like, is whole again
            fresh[chosen] = 1
        if not fresh.any():
            return state
        virgin = np.where(fresh, radius, self._virgin_radius(memory))
        with self._evolution(virgin) as evolution:
            check(lib.hs_set_summits(memory, pointer(height), pointer(radius), pointer(fresh), evolution))
        back = _back_to(state.memory, as_instrument(instrument))
        fresh_state = EnsembleState(memory, self._beginning)
        restored: EnsembleState = self.walk(fresh_state, back, saturate=saturate, instrument=instrument)
        return restored

    def walk(
        self,
        state: EnsembleState | PlanarState,
        paths: Paths,
        *,
        rows: Rows | None = None,
        asperities: ArrayLike = (),
        saturate: bool = False,
        instrument: Instrument = RIGID,
        until: float = 1.0,
        friction: FrictionGoal | None = None,
        threads: int = 1,
    ) -> Any:
        """Return the state after straight paths, one after the other, and record rows on the way.

        Tangential pairs, in two directions, make any state a `PlanarState`. Rows of asperities, by index in the order
        of their columns, are written to ``rows`` in SI (see `blank_rows`). A share ``until`` of each path is walked;
        ``friction`` goes straight with the channels. Threads share the work on many asperities; the bits do not depend
        on them. `saturate`, `instrument` and errors as for `advance`, which have the position of the path here.
        """
        pushed = paths["tangential_control"] == LOAD
        if as_instrument(instrument).parallel_stiffness and pushed.any():
            if pushed.ndim > 1:
                if (pushed[:, 0] != pushed[:, 1]).any():
                    raise InputError(
                        "one tangential component is a load and the other one a displacement, beside a spring in "
                        "parallel; expected two loads or two displacements, or an instrument without parallel_stiffness"
                    )
                pushed = pushed[:, 0]
            how: dict[str, Any] = {"rows": rows, "asperities": asperities, "saturate": saturate, "until": until}
            how |= {"friction": friction, "threads": threads}
            return self._walk_beside_spring(state, paths, pushed, instrument, how)
        planar = isinstance(state, PlanarState) or paths.dtype == PLANAR_PATH or bool(rows and rows.vectors)
        if planar and friction is not None:
            raise InputError("friction that runs along goes with one tangential direction; expected a change at a time")
        start = self.in_plane(state).planar if planar else self._memory_of(state)
        paths = in_plane(paths, start.tangential_control) if planar else paths
        memory = binding.owned_planar(lib.hs_planar_copy(start)) if planar else copied(start)
        if not planar and (friction is not None or (rows is not None and EVOLVED & rows.each.keys())):
            self._follow(memory)
        if rows is None:
            rows, paths = blank_rows(0, None, planar=planar), unrecorded(paths)
        path = ffi.cast("hs_planar_path *" if planar else "hs_path *", ffi.from_buffer(paths))
        way = memory, path, paths.size, rows.as_struct(np.asarray(asperities, dtype=np.int64))
        refusal = ffi.new("hs_refusal *")
        driven = self.driven(saturate, RIGID if planar else instrument, threads)
        if planar:
            status = lib.hs_planar_integrate(*way, _compliances(instrument), driven, until, refusal)
        elif memory.evolved:
            if friction is not None:
                view(memory.evolved.friction_overridden, self.elements)[:] = 1
            with self._evolution(self._virgin_radius(memory), friction) as evolution:
                status = lib.hs_integrate_evolving(*way, driven, until, evolution, refusal)
        else:
            status = lib.hs_integrate(*way, driven, until, refusal)
        check(status, refusal)
        return PlanarState(memory) if planar else EnsembleState(memory, self._beginning)

    def _walk_beside_spring(
        self, state: Any, paths: Paths, pushed: Booleans, instrument: Instrument, how: dict[str, Any]
    ) -> Any:
        """Walk paths of which some control the load of contact and parallel spring: see `Instrument.pushed`."""
        for part in np.split(np.arange(paths.size), np.flatnonzero(np.diff(pushed)) + 1):
            legs, by_load = paths[part], bool(pushed[part[0]])
            if by_load:
                legs["tangential_control"] = DISPLACED
                legs["tangential_target"] /= instrument.parallel_stiffness
            try:
                through = instrument.pushed if by_load else instrument
                state = Ensemble.walk(self, state, legs, instrument=through, **how)
            except (FrictionLimitError, CurveEndError) as error:
                error.path += int(part[0])
                raise
            if by_load:
                # it goes on as a load
                self._memory_of(state, planar=True).tangential_control = LOAD
                if isinstance(state, PlanarState):
                    state.planar.tangential_control = [LOAD, LOAD]
        return state

    def slide_time(self, state: EnsembleState | PlanarState) -> Floats:
        """Return when each asperity or patch first slid as a whole in a replay [s]; NaN where it has not."""
        memory = self._memory_of(state, planar=True)
        found = np.empty(memory.contact.query_count or memory.contact.count)
        lib.hs_slide_times(memory, pointer(found))
        return found

    def approach_at(self, normal_load: float) -> float:
        """Return the approach of the highest summit [m] at which it first carries a normal load ≥ 0 [N], at U = 0."""
        load = scalar("normal_load", normal_load, least=0.0)
        workable("normal_load", load)
        if load > 0 and (self.yielding is not None or self.slope is not None):
            return self.advance(self.initial_state(), normal_load=load).approach
        return float(lib.hs_approach_at(self._contact, load))

    #: Pressures and tractions of `Patches`.
    superposition: ClassVar[Any] = refused(
        "the ensemble has no normal curves; expected one from normal curves: see asperity"
    )

    def asperity(self, index: int, state: EnsembleState | PlanarState) -> Asperity:
        """Return one asperity, holding its memory in a state; an index that is not there raises InputError.

        In two tangential directions the last axis of its tangential quantities is x and y.
        """
        if not isinstance(index, int | np.integer) or not 0 <= index < len(self):
            raise InputError(f"asperity {index!r} does not exist; expected an index from 0 to {len(self) - 1}")
        self._memory_of(state, planar=True)
        return Asperity.of(Readout(self, state, [int(index)]), 0, int(index))

    def asperities(self, state: EnsembleState | PlanarState) -> Asperities:
        """Return all asperities, holding their memories in a state, as a sequence: ``len``, index, slice, iteration.

        Their loads, radii and slip states are read in one batch.
        """
        self._memory_of(state, planar=True)
        readout = Readout(self, state, range(len(self)))
        return Asperities(lambda index: Asperity.of(readout, index, index), range(len(self)))

    _coefficients = staticmethod(coulomb)

    def _evolution(self, virgin_radius: Floats, goal: FrictionGoal | None = None) -> Any:
        follow = self.follow_sliding
        return evolution_of(self.pair, self.laws, follow_sliding=follow, virgin_radius=virgin_radius, goal=goal)

    @cached_property
    def _contact(self) -> Any:
        """The contact at the start, as the library has it."""
        keys = [self.friction]
        if self.wear is not None or (self.law is not None and self.law.depends_on in {"own", "slid"}):
            # where friction depends on each asperity itself, those that are alike share what they remember
            keys += [self.summit_height, self.summit_radius]
        moduli = self.pair.contact_modulus, self.pair.displacement_ratio
        return binding.new_contact(self.summit_height, self.summit_radius, None, _alike(*keys), *moduli)

    @cached_property
    def _beginning(self) -> Memory:
        """The memory at the start, which is never changed."""
        memory: Memory = owned(lib.hs_memory_new(self._contact, pointer(self.friction)))
        memory.identity = lib.hs_digest(memory.identity, ffi.from_buffer(self._more), len(self._more))
        if self.evolves:
            self._follow(memory)
        return memory

    @property
    def _more(self) -> bytes:
        """What states belong to beside the contact and its friction: what asperities evolve by."""
        if not self.laws and not self.follow_sliding:
            return b""
        numbers = [law.numbers for law in self.laws]
        # an object of a law of one's own is known by its type: its address is another one elsewhere
        text = json.dumps([numbers, self.follow_sliding], sort_keys=True, default=lambda each: type(each).__qualname__)
        return text.encode()

    def _memory_of(self, state: Any, *, planar: bool = False) -> Memory:
        """Return the memory of a state, which has to be of this ensemble, and of one direction unless it may not be."""
        if isinstance(state, PlanarState) and not planar:
            raise InputError("the state is of two tangential directions; expected one of one direction, or `advance`")
        if not isinstance(state, EnsembleState | PlanarState):
            raise InputError(f"state is {state!r}; expected an EnsembleState, such as initial_state() returns")
        if state.like is not self._beginning:
            binding.check_belongs(state.memory, self._beginning)
        if isinstance(state, PlanarState) and state.rings != self.rings:
            raise InputError(
                f"the state was made with {state.rings}; expected one of this ensemble, with {self.rings}. Advance it "
                "with an ensemble of its rings, or replay its events with this one"
            )
        return state.memory

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what is computed once, such as what the library holds."""
        return {field.name: getattr(self, field.name) for field in attrs.fields(type(self))}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        self.__dict__.update(state)

    def _follow(self, memory: Memory) -> None:
        """Make a memory follow from now on what asperities become."""
        if not memory.evolved:
            check(lib.hs_memory_evolve(memory))
            # to the bit, which gaps are not
            view(memory.evolved.summit_height, self.elements)[:] = self.summit_height
            view(memory.evolved.summit_radius, self.elements)[:] = self.summit_radius
        if self.yielding is not None:
            check(lib.hs_memory_yield(memory))

    def _virgin_radius(self, memory: Memory) -> Floats:
        """Return the radii of the summits before they yielded [m] (asperity)."""
        evolved = memory.evolved
        return view(evolved.virgin_radius or evolved.summit_radius, self.elements).copy()

    @cached_property
    def _drive(self) -> Any:
        return self.driven(False, RIGID)

    def driven(self, saturate: bool, instrument: Instrument, threads: int = 1, *, heeds: bool = True) -> Any:
        """Return how its contact is driven, for the library; see ``hs_drive``."""
        compliance = 1.0 / as_instrument(instrument).stiffness
        return binding.drive(self.tolerance, compliance, saturate, threads, heeds=heeds)

    def _chosen(self, asperities: ArrayLike | None) -> Integers:
        if asperities is None:
            return np.arange(self.elements)
        chosen = np.atleast_1d(np.asarray(asperities))
        if chosen.dtype.kind not in "iu" or chosen.ndim != 1 or np.unique(chosen).size != chosen.size:
            raise InputError(f"asperities is {asperities!r}; expected a list of indices, each of them once")
        outside = chosen[(chosen < 0) | (chosen >= self.elements)]
        if outside.size:
            raise InputError(f"asperity {outside[0]} does not exist; expected an index from 0 to {self.elements - 1}")
        return chosen.astype(np.int64)


# an asperity by itself is the ensemble of one
Asperity.ensemble_type = Ensemble


def _span(values: Floats, unit: str) -> str:
    least, most = values.min(), values.max()
    if unit:
        return range_text(least, most, unit)
    return f"{least:.4g}" + (f" to {most:.4g}" if most > least else "")


def _compliances(instrument: Instrument) -> Any:
    """Return by how much an instrument yields in x and y [m/N], for the library."""
    return ffi.new("double[2]", as_instrument(instrument).compliances)


@contextmanager
def _driven_by_load(memory: Memory, instrument: Instrument) -> Iterator[Instrument]:
    """Give the instrument that acts on a contact in series: of a controlled load the parallel spring, too."""
    if not as_instrument(instrument).parallel_stiffness or memory.tangential_control != LOAD:
        yield instrument
        return
    memory.tangential_control = DISPLACED
    yield instrument.pushed
    memory.tangential_control = LOAD


def _alike(*keys: Floats) -> Integers | None:
    """Return the group of each asperity, a number from 0: those that are alike in every key; None where all are."""
    numbers = np.zeros(keys[0].size, dtype=np.int64)
    for key in keys:
        if (key == key[0]).all():
            continue
        _, rank = np.unique(key, return_inverse=True)
        _, numbers = np.unique(numbers * (rank.max() + 1) + rank, return_inverse=True)
    return numbers.astype(np.int64) if numbers.any() else None


def _back_to(before: Memory, instrument: Instrument) -> Paths:
    """Return the path on which each channel goes back to where it was controlled to be."""
    units = before.contact.units
    compliance = units.stiffness / instrument.stiffness
    normal = {LOAD: before.normal_load * units.load, DISPLACED: before.approach * units.length}
    load, moved = (before.tangential_load + before.excess) * units.load, before.displacement * units.displacement
    tangential = {
        LOAD: instrument.drive_load(moved, load),
        DISPLACED: (before.displacement + compliance * before.tangential_load) * units.displacement,
    }
    return paths_to(
        Goals(before.normal_control, normal[before.normal_control]),
        Goals(before.tangential_control, tangential[before.tangential_control]),
        times=(before.clock.end, before.clock.end),
    )


class Patches(Ensemble):
    """Patches of one contact, given by their normal curves; `Ensemble.from_normal_curves` makes them, and says more.

    The memory is replayed on the elements of the curve of their sum: ``summit_height`` and ``summit_radius`` are those
    of the elements. Patches share one coefficient, keep their curves, and have no radii of their own.
    """

    curves: NormalCurves

    nouns = "patch", "patches"
    shown = {"friction": ""}  # noqa: RUF012 - as of every ensemble
    with_geometry = refused("patches have no height and radius to change; expected an ensemble of summits")
    asperity = asperities = refused(
        "a patch of a normal curve is not an asperity with a radius; expected an ensemble of summits. A replay records "
        "the loads and areas of the patches"
    )

    def __init__(
        self,
        pair: MaterialPair,
        curves: NormalCurves,
        friction: float = 0.2,
        *,
        highest_summit: float = 0.0,
        tolerance: float = 1e-6,
        rings: Rings = RINGS,
    ) -> None:
        top = scalar("highest_summit", highest_summit)
        if curves.weight is None:
            # knots have none; their unit of length is the range of the table
            radius = np.full(curves.label.size, curves.approach[-1])
        else:
            radius = (0.75 * curves.weight / check_pair(pair).contact_modulus) ** 2
        coefficient = scalar("friction of patches that share a contact", friction, least=0)
        super().__init__(pair, top - curves.label, radius, coefficient, tolerance=tolerance, rings=rings)
        object.__setattr__(self, "curves", curves)

    def __len__(self) -> int:
        """Return the number of patches."""
        return len(self.curves)

    @property
    def first_touch(self) -> Floats:
        """Approach at which each patch first touches [m]."""
        return self.curves.first_touch

    @property
    def coordinates(self) -> dict[str, Floats]:
        """What is known of each patch: height, friction at the start, position."""
        known = {
            "summit_height": self.highest_summit - self.curves.first_touch,
            "friction": np.full(len(self), self.friction[0]),
            "x": self.curves.x,
            "y": self.curves.y,
        }
        return {name: values for name, values in known.items() if values is not None}

    def _chosen(self, asperities: ArrayLike | None) -> Integers:
        if asperities is not None:
            raise InputError("patches of one contact share one coefficient; expected a change for all of them")
        return super()._chosen(asperities)

    @staticmethod
    def _coefficients(friction: ArrayLike, count: int) -> Floats:
        return coulomb(scalar("friction of patches that share a contact", friction), count)

    def walk(
        self,
        state: EnsembleState | PlanarState,
        paths: Paths,
        *,
        rows: Rows | None = None,
        asperities: ArrayLike = (),
        friction: FrictionGoal | None = None,
        **how: Any,
    ) -> Any:
        """Return the state after straight paths, and record patches on the way; see `Ensemble.walk`."""
        if friction is not None or (rows is not None and EVOLVED & rows.each.keys()):
            raise InputError("patches of one contact keep their friction along a path; expected a change at a time")
        self.curves.check_reach(paths)
        if rows is None:
            return super().walk(state, paths, **how)
        chosen = np.asarray(asperities, dtype=np.int64)
        # the first element alone shows where the slip front is
        columns = np.arange(self.elements if chosen.size else 1)
        elements = blank_rows(len(rows.totals), columns.size, planar=bool(rows.vectors))
        after = super().walk(state, paths, rows=elements, asperities=columns, **how)
        self.curves.project(elements, float(after.friction[0]), chosen, rows)
        return after

    def superposition(self, state: EnsembleState) -> Superposition:
        """Return pressures and tractions of patches as sums of those in the table of their normal curves."""
        memory, rows = self._memory_of(state), blank_rows(1, 1)
        check(lib.hs_read(memory, rows.as_struct(np.zeros(1, dtype=np.int64)), 0))
        stick = float(self.curves.stick_approach(rows)[0])
        return self.curves.superposed(binding.stack(memory), memory.contact.units, stick)

    def slide_time(self, state: EnsembleState | PlanarState) -> Floats:
        """Return when each patch first slid as a whole in a replay [s] (patch); NaN where it has not."""
        found: Floats = super().slide_time(state)[np.unique(self.first_touch, return_inverse=True)[1]]
        return found

    @cached_property
    def _contact(self) -> Any:
        """The contact of the elements of the curve, which watches when patches first slide."""
        moduli = self.pair.contact_modulus, self.pair.displacement_ratio
        watched = np.unique(self.first_touch)
        return binding.new_contact(
            self.summit_height, self.summit_radius, self.curves.stiffness, None, *moduli, watched
        )

    @property
    def _more(self) -> bytes:
        tables = self.curves.arrays
        return b"".join(tables[name].tobytes() for name in sorted(tables) if name not in {"x", "y"})


def check_ensemble(_: object, __: object, value: Any) -> None:
    """Check a field that is to be an Ensemble; anything else is an InputError."""
    if not isinstance(value, Ensemble):
        run = f"; a scenario is run by hs.run({value!r})" if isinstance(value, str | Path) else ""
        raise InputError(f"ensemble is {brief(value)}; expected an Ensemble{run}")
