"""`Ensemble`: bodies that share one approach and one tangential displacement; `Patches`: those of normal curves."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, Self

import attrs
import numpy as np

from historysim.asperities.asperity import Asperities, Asperity, Readout
from historysim.asperities.curves import NormalCurves, Superposition
from historysim.asperities.instrument import RIGID, RINGS, Instrument, Rings, as_instrument
from historysim.asperities.law import FrictionGoal, FrictionLaw, Law, coulomb, evolution_of
from historysim.asperities.state import State
from historysim.asperities.stepper import Stepper, Totals, channel, path_to
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
from historysim.memory.binding import DISPLACED, LOAD, Memory, advanced, check, copied, owned, view
from historysim.memory.paths import PROJECTED, Goals, Paths, Rows, blank_rows, paths_to, unrecorded

if TYPE_CHECKING:
    from historysim.interaction.solutions import NormalSolutions

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

    def initial_state(self) -> State:
        """Return the unloaded state: the highest summit just touches, nothing is remembered."""
        return State(self._beginning, self._beginning)

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

        With both loads given, the path is straight in (N, T); with a displacement, straight in the approach and U. A
        channel that is not named is held as it was controlled last: a load stays, or a displacement does.

        In two tangential directions loads and displacements are pairs, in x and y; a state of one direction moved along
        x. Along one line the path is exact; where it turns, it is of the accuracy that ``rings`` says. Each component
        is a channel by itself: None in a pair leaves it to the other argument, or holds it. So
        ``tangential_displacement=(u, None), tangential_load=(None, t)`` drives x under a constant load in y. With a
        displacement in either, the path is straight in the approach and in what each component is controlled by.

        Parameters
        ----------
        state : State
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
        # a tight loop gets by with one comparison: a state like the start moves in one direction, and evolves alike
        start = self._beginning
        known = getattr(state, "like", None) is start
        memory = state.memory if known else self._memory_of(state)
        line = memory.line
        normal, end = channel("normal", normal_load, normal_displacement, line.normal_control, 0.0)
        target = tangential_load if tangential_displacement is None else tangential_displacement
        # a number does not depend on how the channel was controlled
        control = LOAD if known and target.__class__ is float else binding.tangential_control(memory)
        tangential, goal = channel("tangential", tangential_load, tangential_displacement, control)
        evolves = self._evolves if known else line.evolved
        if evolves or (instrument is not RIGID and as_instrument(instrument).parallel_stiffness):
            path = path_to((normal, end), (tangential, goal))
            moved: State = self.walk(state, path, saturate=saturate, instrument=instrument)
        else:
            if self.curves is not None:
                self.curves.check_reach(path_to((normal, end), (tangential, goal)))
            if control.__class__ is tuple or goal.__class__ is tuple:
                memory = memory if control.__class__ is tuple else self._entered(memory)
                driven = self._drive_in_plane if instrument is RIGID and not saturate else None
                driven = driven or self.driven(saturate, instrument, directions=2)
                after = binding.advanced_in_plane(memory, normal, end, tangential, goal, driven)
                moved = State(after, self._start_in_plane)
            else:
                driven = self._drive if instrument is RIGID and not saturate else self.driven(saturate, instrument)
                moved = State(advanced(memory, normal, end, tangential, goal, driven), start)
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

    def in_plane(self, state: State) -> State:
        """Return a state in two tangential directions; one of one direction moved along x.

        Raises InputError: a state of another ensemble, or of one that moves in one direction alone.
        """
        memory = self._memory_of(state)
        return state if memory.plane else self.state_of(self._entered(memory))

    def _entered(self, memory: Memory) -> Memory:
        """Return a copy of a memory of one direction that moves in two from now on."""
        if self.confined:
            raise InputError(f"one tangential direction goes with {self.confined}; expected one number, not a pair")
        rings = self.rings
        entered: Memory = binding.enter_plane(memory, rings.height_classes, rings.rings, rings.tolerance)
        return entered

    def state_of(self, memory: Memory) -> State:
        """Return the state of a memory of this ensemble."""
        if memory.plane:
            return State(memory, self._start_in_plane)
        return State(memory, self._beginning if bool(memory.line.evolved) == self._evolves else None)

    def check_state(self, state: State) -> None:
        """Check that a state is one of this ensemble; any other is an InputError."""
        self._memory_of(state)

    def advance_many(
        self,
        state: State,
        *,
        normal_load: ArrayLike | None = None,
        normal_displacement: ArrayLike | None = None,
        tangential_load: ArrayLike | None = None,
        tangential_displacement: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> tuple[State, Totals]:
        """Return the state after straight paths, one after the other, and the totals at the end of each.

        It is what as many calls of `advance` would do, bit for bit. Arguments and errors are as there, with one value
        for each path, or one number for all of them; an error has the position of its path.
        """
        memory = self._memory_of(state)
        binding.check_one_direction(memory)
        line = memory.line
        normal = channel("normal", normal_load, normal_displacement, line.normal_control, 0.0, several=True)
        tangential = channel(
            "tangential", tangential_load, tangential_displacement, line.tangential_control, several=True
        )
        counts = {np.size(target) for _, target in (normal, tangential)} - {1}
        if len(counts) > 1 or 0 in counts:
            numbers = " and ".join(map(str, sorted(counts)))
            raise InputError(f"the channels have {numbers} values; expected as many, one or more, or one number")
        paths = path_to(normal, tangential)
        rows = blank_rows(paths.size, None)
        state = self.walk(state, paths, rows=rows, saturate=saturate, instrument=instrument)
        return state, Totals.of(rows.totals)

    def stepper(self, state: State | None = None, *, saturate: bool = False, instrument: Instrument = RIGID) -> Stepper:
        """Return what steps a state in place, for tight loops; it starts unloaded by default."""
        state = self.initial_state() if state is None else state
        self._memory_of(state)
        return Stepper(self, state, {"saturate": saturate, "instrument": instrument})

    def load_state(self, path: str | Path) -> Any:
        """Read a state of this ensemble from a file of `save`; any other one is an InputError."""
        try:
            return self.state_from(Path(path).read_bytes())
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def state_from(self, content: bytes) -> Any:
        """Return the state of its bytes; those of another ensemble are an InputError."""
        start = self.initial_state()
        state = type(start).from_bytes(content, start)
        self._memory_of(state)
        return state

    def with_friction(
        self,
        state: State,
        friction: ArrayLike,
        *,
        asperities: ArrayLike | None = None,
        instrument: Instrument = RIGID,
    ) -> State:
        """Return the state with other friction coefficients from now on, which override a friction law.

        One coefficient, or one per asperity, 0 or more, is for the asperities with these indices, by default for all;
        other numbers or indices are an InputError. Where a coefficient falls, springs beyond the new limit slip at
        once. A controlled tangential load stays, and so does the displacement of an instrument's drive: U follows, as
        it would if the coefficients fell in many small steps. A load that friction no longer holds stays in the state:
        the contact slides at the displacement at which it began to, and the next path is refused unless it unloads, or
        holds the load at the limit.
        """
        memory, chosen = copied(self._memory_of(state)), self._chosen(asperities)
        coefficients = state.friction
        coefficients[chosen] = self._coefficients(friction, chosen.size)
        if memory.line.evolved:
            view(memory.line.evolved.friction_overridden, self.elements)[chosen] = 1
        with _driven_by_load(memory, instrument) as through:
            driven = self.driven(False, through, directions=binding.directions_of(memory))
            status = lib.hs_set_friction(memory, pointer(coefficients), driven)
        if status == lib.HS_FOREIGN:
            raise InputError(
                "friction differs between asperities that share rings of traction; expected one coefficient for "
                "those that had one at the start"
            )
        check(status)
        return self.state_of(memory)

    def with_geometry(
        self,
        state: State,
        *,
        summit_height: ArrayLike | None = None,
        summit_radius: ArrayLike | None = None,
        asperities: ArrayLike | None = None,
        saturate: bool = False,
        instrument: Instrument = RIGID,
    ) -> State:
        """Return the state with other summits from now on, each of which is a new contact.

        What the old contact of a changed summit remembered is erased, its springs are no longer strained; those that
        keep their height and radius remember. Then each channel goes back to where it was: a controlled load is
        restored, straight with the other one where both are.

        New heights, over the same datum, and radii [m] are for the asperities with these indices, by default for all;
        what is not given stays. ``saturate`` and ``instrument`` are as for `advance`. InputError: numbers out of range,
        indices that the ensemble does not have, or patches. FrictionLimitError: the new contact does not hold the
        tangential load.
        """
        binding.check_one_direction(self._memory_of(state))
        memory, chosen = copied(state.memory), self._chosen(asperities)
        self._follow(memory)
        count, evolved = self.elements, memory.line.evolved
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
        restored: State = self.walk(self.state_of(memory), back, saturate=saturate, instrument=instrument)
        return restored

    def walk(
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
    ) -> Any:
        """Return the state after straight paths, one after the other, and record rows on the way.

        Tangential pairs make any state one of two directions. Rows of asperities, by index in the order
        of their columns, are written to ``rows`` in SI (see `blank_rows`). A share ``until`` of each path is walked;
        ``friction`` goes straight with the channels. Threads share the work on many asperities; the bits do not depend
        on them. `saturate`, `instrument` and errors as for `advance`, which have the position of the path here.
        """
        if as_instrument(instrument).parallel_stiffness and (pushed := binding.by_load(paths)).any():
            if (pushed[:, 0] != pushed[:, 1]).any():
                raise InputError(
                    "one tangential component is a load and the other one a displacement, beside a spring in "
                    "parallel; expected two loads or two displacements, or an instrument without parallel_stiffness"
                )
            how: dict[str, Any] = {"rows": rows, "asperities": asperities, "saturate": saturate, "until": until}
            how |= {"friction": friction, "threads": threads}
            return self._walk_beside_spring(state, paths, pushed[:, 0], instrument, how)
        memory = self._memory_of(state)
        planar = bool(memory.plane) or binding.are_in_plane(paths) or bool(rows and rows.vectors)
        if planar and friction is not None:
            raise InputError("friction that runs along goes with one tangential direction; expected a change at a time")
        memory = copied(memory) if memory.plane or not planar else self._entered(memory)
        paths = binding.check_in_plane(paths) if planar else paths
        if friction is not None or (not planar and rows is not None and EVOLVED & rows.each.keys()):
            self._follow(memory)
        if rows is None:
            rows, paths = blank_rows(0, None, planar=planar), unrecorded(paths)
        path, refusal = ffi.cast("hs_path *", ffi.from_buffer(paths)), ffi.new("hs_refusal *")
        driven = self.driven(saturate, instrument, threads, directions=2 if planar else 1)
        way = memory, path, paths.size, rows.as_struct(asperities), driven, until
        if evolved := memory.line.evolved:
            if friction is not None:
                view(evolved.friction_overridden, self.elements)[:] = 1
            with self._evolution(self._virgin_radius(memory), friction) as evolution:
                status = lib.hs_integrate(*way, evolution, refusal)
        else:
            status = lib.hs_integrate(*way, ffi.NULL, refusal)
        check(status, refusal)
        return self.state_of(memory)

    def _walk_beside_spring(
        self, state: Any, paths: Paths, pushed: Booleans, instrument: Instrument, how: dict[str, Any]
    ) -> Any:
        """Walk paths of which some control the load of contact and parallel spring: see `Instrument.pushed`."""
        for part in np.split(np.arange(paths.size), np.flatnonzero(np.diff(pushed)) + 1):
            legs, by_load = paths[part], bool(pushed[part[0]])
            if by_load:
                legs["tangential_control"][legs["tangential_control"] == LOAD] = DISPLACED
                legs["tangential_target"] /= instrument.parallel_stiffness
            try:
                through = instrument.pushed if by_load else instrument
                state = Ensemble.walk(self, state, legs, instrument=through, **how)
            except (FrictionLimitError, CurveEndError) as error:
                error.path += int(part[0])
                raise
            if by_load:
                # it goes on as a load
                binding.set_tangential_control(self._memory_of(state), LOAD)
        return state

    def slide_time(self, state: State) -> Floats:
        """Return when each asperity or patch first slid as a whole in a replay [s]; NaN where it has not."""
        memory = self._memory_of(state)
        contact = memory.line.contact
        found = np.empty(contact.query_count or contact.count)
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

    def asperity(self, index: int, state: State) -> Asperity:
        """Return one asperity, holding its memory in a state; an index that is not there raises InputError.

        In two tangential directions the last axis of its tangential quantities is x and y.
        """
        if not isinstance(index, int | np.integer) or not 0 <= index < len(self):
            raise InputError(f"asperity {index!r} does not exist; expected an index from 0 to {len(self) - 1}")
        self._memory_of(state)
        return Asperity.of(Readout(self, state, [int(index)]), 0, int(index))

    def asperities(self, state: State) -> Asperities:
        """Return all asperities, holding their memories in a state, as a sequence: ``len``, index, slice, iteration.

        Their loads, radii and slip states are read in one batch.
        """
        self._memory_of(state)
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
        memory: Memory = owned(lib.hs_state_new(self._contact, pointer(self.friction)))
        memory.line.identity = lib.hs_digest(memory.line.identity, ffi.from_buffer(self._more), len(self._more))
        if self.evolves:
            self._follow(memory)
        return memory

    @cached_property
    def _start_in_plane(self) -> Memory:
        """The memory at the start in two tangential directions."""
        return self._entered(self._beginning)

    @property
    def _more(self) -> bytes:
        """What states belong to beside the contact and its friction: what asperities evolve by."""
        if not self.laws and not self.follow_sliding:
            return b""
        numbers = [law.numbers for law in self.laws]
        # an object of a law of one's own is known by its type: its address is another one elsewhere
        text = json.dumps([numbers, self.follow_sliding], sort_keys=True, default=lambda each: type(each).__qualname__)
        return text.encode()

    def _memory_of(self, state: Any) -> Memory:
        """Return the memory of a state, which has to be of this ensemble."""
        if not isinstance(state, State):
            raise InputError(f"state is {state!r}; expected a State, such as initial_state() returns")
        # what is not computed yet, no state is like
        if state.like is not None and state.like is self.__dict__.get("_start_in_plane"):
            return state.memory
        if state.like is not self._beginning:
            binding.check_belongs(state.memory, self._beginning)
        rings = state.rings
        if rings is not None and rings != self.rings:
            raise InputError(
                f"the state was made with {rings}; expected one of this ensemble, with {self.rings}. Advance it "
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
        line = memory.line
        if not line.evolved:
            check(lib.hs_state_evolve(memory))
            # to the bit, which gaps are not
            view(line.evolved.summit_height, self.elements)[:] = self.summit_height
            view(line.evolved.summit_radius, self.elements)[:] = self.summit_radius
        if self.yielding is not None:
            check(lib.hs_state_yield(memory))

    def _virgin_radius(self, memory: Memory) -> Floats:
        """Return the radii of the summits before they yielded [m] (asperity)."""
        evolved = memory.line.evolved
        return view(evolved.virgin_radius or evolved.summit_radius, self.elements).copy()

    @cached_property
    def _evolves(self) -> bool:
        return self.evolves

    @cached_property
    def _drive(self) -> Any:
        return self.driven(False, RIGID)

    @cached_property
    def _drive_in_plane(self) -> Any:
        return self.driven(False, RIGID, directions=2)

    def driven(
        self, saturate: bool, instrument: Instrument, threads: int = 1, *, directions: int = 1, heeds: bool = True
    ) -> Any:
        """Return how its contact is driven, for the library; see ``hs_drive``."""
        compliances = as_instrument(instrument).compliances_in(directions)
        return binding.drive(self.tolerance, compliances, saturate, threads, heeds=heeds)

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


@contextmanager
def _driven_by_load(memory: Memory, instrument: Instrument) -> Iterator[Instrument]:
    """Give the instrument that acts on a contact in series: of a controlled load the parallel spring, too."""
    if not as_instrument(instrument).parallel_stiffness or memory.line.tangential_control != LOAD:
        yield instrument
        return
    with binding.controlled(memory, DISPLACED):
        yield instrument.pushed


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
    line, units = before.line, before.line.contact.units
    compliance = units.stiffness / instrument.stiffness
    normal = {LOAD: line.normal_load * units.load, DISPLACED: line.approach * units.length}
    load, moved = (line.tangential_load + line.excess) * units.load, line.displacement * units.displacement
    tangential = {
        LOAD: instrument.drive_load(moved, load),
        DISPLACED: (line.displacement + compliance * line.tangential_load) * units.displacement,
    }
    return paths_to(
        Goals(line.normal_control, normal[line.normal_control]),
        Goals(line.tangential_control, tangential[line.tangential_control]),
        times=(line.clock.end, line.clock.end),
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
        state: State,
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

    def superposition(self, state: State) -> Superposition:
        """Return pressures and tractions of patches as sums of those in the table of their normal curves."""
        memory, rows = self._memory_of(state), blank_rows(1, 1)
        binding.check_one_direction(memory)
        check(lib.hs_read(memory, rows.as_struct(np.zeros(1, dtype=np.int64)), 0))
        stick = float(self.curves.stick_approach(rows)[0])
        return self.curves.superposed(binding.stack(memory), memory.line.contact.units, stick)

    def slide_time(self, state: State) -> Floats:
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
