"""`Ensemble`: asperities between two rigid bodies, with one approach and one displacement; `Patches`: normal curves."""

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
from historysim.asperities.stepper import Stepper, Totals, channel, make_path
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
# Row variables that are recorded only for asperities that evolve.
EVOLVED = {name for name, _ in ffi.typeof("hs_rows").fields} - _ALWAYS


def check_pair(pair: MaterialPair) -> MaterialPair:
    """Return the argument if it is a pair of materials, else raise InputError."""
    if not isinstance(pair, MaterialPair):
        raise InputError(f"pair is {pair!r}; expected a MaterialPair")
    return pair


def unsupported_method(text: str) -> Any:
    """Return a method that raises an InputError, for an operation that a type of ensemble does not support."""

    def method(*_: Any, **__: Any) -> NoReturn:
        raise InputError(text)

    return method


# no slots: cached properties need an instance dictionary
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
        Positions of the summits [m]; stored, without influence.
    nominal_area : float, optional
        Nominal contact area [m²], > 0; stored, without influence.
    tolerance : float
        Relative change of displacement and energy below which the refinement of a ramp of both loads has converged.
    wear : WearLaw, optional
        Wear of the asperities as they slide (see `historysim.asperities.wear`).
    follow_sliding : bool
        Track the distance that each asperity slides; wear, and friction that depends on it, always do.
    yielding : YieldingLaw or str, optional
        Yielding of summits on first loading (see `historysim.asperities.yielding`), or the name of a law, with the
        hardness of the pair.
    rings : Rings, optional
        Resolution of asperities that move in two tangential directions.

    Raises
    ------
    InputError
        A number that is not finite or out of range, arrays of different lengths, both wear and yielding, or a yielding
        law without a known hardness.

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

    nouns: ClassVar[tuple[str, str]] = "asperity", "asperities"  #: singular and plural name of its bodies
    summary_units: ClassVar[dict[str, str]] = {"summit_height": "m", "summit_radius": "m", "friction": ""}

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
        per_asperity = partial(one_per, "asperity", "asperities")
        height = per_asperity("summit_height", summit_height)
        if not height.size:
            raise InputError("summit_height is empty; expected one number, or a list with one per asperity")
        count = max(height.size, np.size(summit_radius))
        height = per_asperity("summit_height", height, count)
        radius = per_asperity("summit_radius", summit_radius, count, above=0)
        law = friction if isinstance(friction, FrictionLaw) else None
        coefficients: Any = friction if law is None else law.at_start(count)
        # the unit of length is the largest radius; other radii may be arbitrarily small
        workable("summit_radius", radius.max(), smallest=SMALLEST)
        workable("summit_radius", radius)
        workable("summit_height", height)
        self.__attrs_init__(
            pair=pair,
            summit_height=height,
            summit_radius=radius,
            friction=per_asperity("friction", coulomb(coefficients, count), count),
            x=None if x is None else per_asperity("x", x, count),
            y=None if y is None else per_asperity("y", y, count),
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
        """Make an ensemble from summits, which have ``height``, ``radius``, ``x`` and ``y`` [m]; options of `Ensemble`.

        Summits with a ``slope`` need `InclinedEnsemble`; InputError otherwise.
        """
        if not all(hasattr(summits, name) for name in ("height", "radius", "x", "y")):
            raise InputError(f"summits is {brief(summits)}; expected Summits, such as Surface.summits() returns")
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
        """Make an ensemble of the patches of one contact, which may interact, from their normal curves.

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
            Normal load of each patch at that approach [N]; a single column is the whole contact. If the total load is
            convex, it is met exactly; otherwise the nearest convex curve is used (see `NormalCurves.residual` and
            `NormalCurves.error`).
        area : array_like, of the shape of ``load``, optional
            Contact areas [m²]; without them there are no areas in the history.
        friction : float
            Coulomb coefficient μ ≥ 0 of the whole contact.
        noise : array_like, optional
            Standard deviation of the noise of the total load [N], one number or one for each row with a load. Default:
            none if the total is convex, otherwise an estimate from differences of neighbouring rows.
        highest_summit : float
            Height of the flat at first touch [m].
        x, y : array_like (patch), optional
            Positions of the patches [m].
        tolerance, rings
            As for `Ensemble`.

        Raises
        ------
        InputError
            A table that an elastic contact cannot have: the message names the row.
        """
        curves = NormalCurves.from_table(approach, load, area, noise=noise, x=x, y=y)
        return Patches(pair, curves, friction, highest_summit=highest_summit, tolerance=tolerance, rings=rings)

    @staticmethod
    def from_solutions(
        pair: MaterialPair, solutions: "NormalSolutions", friction: float = 0.2, **options: Any
    ) -> "Ensemble":
        """Make an ensemble of the patches of a rough contact; options and errors of `from_normal_curves`."""
        x, y = solutions.position
        load, stiffness = (
            values * check_pair(pair).contact_modulus for values in (solutions.load, solutions.stiffness)
        )
        curves = NormalCurves.from_exact(solutions.approach, load, solutions.area, stiffness, x=x, y=y)
        return Patches(pair, curves, friction, highest_summit=solutions.highest_summit, **options)

    def __repr__(self) -> str:
        texts = [" ".join(line) for line in self._summary_lines]
        return f"<Ensemble: {', '.join([counted(len(self), *self.nouns), *texts])}>"

    def _repr_html_(self) -> str:
        moduli = ("contact modulus E*", self.pair.contact_modulus), ("shear modulus G*", self.pair.shear_modulus)
        texts = [(name, quantity_text(value, "Pa")) for name, value in moduli]
        return html_table([(self.nouns[1], f"{len(self):,}"), *self._summary_lines, *texts])

    @property
    def _summary_lines(self) -> list[tuple[str, str]]:
        """Labelled lines on its summits, friction, wear and yielding."""
        texts = {
            name.replace("_", " "): _range_line(getattr(self, name), unit) for name, unit in self.summary_units.items()
        }
        laws = {"friction": self.law, "wear": self.wear, "yielding": self.yielding}
        return list((texts | {name: law.text for name, law in laws.items() if law is not None}).items())

    def __len__(self) -> int:
        """Return the number of asperities, or of patches."""
        return self.elements

    @property
    def elements(self) -> int:
        """Number of elements of the traction memory: asperities, or elements of the total curve of all patches."""
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
    def laws(self) -> tuple[Law, ...]:
        """Its laws of friction, wear and yielding."""
        return tuple(law for law in (self.law, self.wear, self.yielding) if law is not None)

    @property
    def packages(self) -> tuple[str, ...]:
        """Third-party packages that provide its laws, each with its version."""
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
        """Properties of each asperity or patch: heights, radii, friction at the start, positions, slopes."""
        names = ("summit_height", "summit_radius", "friction", "x", "y", "slope")
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    def initial_state(self) -> State:
        """Return the unloaded virgin state: the highest summit just touches."""
        return State(self._initial_memory, self._initial_memory)

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

        If both loads are given, the path is straight in (N, T); with a displacement, it is straight in the approach and
        U. A channel without a target is held at its last controlled value, a load or a displacement.

        In two tangential directions loads and displacements are pairs, in x and y; a state of one direction has moved
        along x. The path is exact along one line; after a turn, ``rings`` sets its accuracy. Each component is a
        separate channel: None in a pair leaves the component to the other argument, or holds it. So
        ``tangential_displacement=(u, None), tangential_load=(None, t)`` drives x under a constant load in y. If either
        component is a displacement, the path is straight in the approach and in the controlled variable of each
        component.

        Parameters
        ----------
        state : State
        normal_load, tangential_load : float, optional
            Total loads to reach [N]; N ≥ 0. The tangential load may be a pair, with None in one component.
        normal_displacement : float, optional
            Approach of the highest summit from first touch to reach [m]; negative is a gap.
        tangential_displacement : float, optional
            U to reach [m], or a pair, likewise; with an instrument the displacement of its drive, U + T/k_s.
            With a spring in parallel, the tangential load is the sum of both, T + k_p (U + T/k_s), and a joint path to
            it is straight in the approach and that load.
        friction : array_like, optional
            New coefficients, applied at the end of the path (see `FrictionChange`).
        saturate : bool
            Hold a tangential load beyond the limit at the limit; if one component is a displacement, the other one.
        instrument : Instrument, optional
            In series with the contact. The state does not contain it: give it with each path that it drives.

        Raises
        ------
        FrictionLimitError
            |T| > Σ μ N, of the components that are controlled by load.
        InputError
            A value that is not finite, a negative normal load, or both a load and a displacement for one channel; in
            two directions a single number for a tangential channel, or an ensemble that evolves.
        """
        # fast path, one comparison in tight loops: a state with this `like` has one direction and the same evolution
        start = self._initial_memory
        is_recognised = getattr(state, "like", None) is start
        memory = state.memory if is_recognised else self._checked_memory(state)
        line = memory.line
        normal, normal_target = channel("normal", normal_load, normal_displacement, line.normal_control, 0.0)
        target = tangential_load if tangential_displacement is None else tangential_displacement
        # a scalar target does not depend on the previous control
        control = LOAD if is_recognised and target.__class__ is float else binding.tangential_control(memory)
        tangential, tangential_target = channel("tangential", tangential_load, tangential_displacement, control)
        evolves = self._evolves if is_recognised else line.evolved
        if evolves or (instrument is not RIGID and as_instrument(instrument).parallel_stiffness):
            path = make_path((normal, normal_target), (tangential, tangential_target))
            moved: State = self.walk(state, path, saturate=saturate, instrument=instrument)
        else:
            if self.curves is not None:
                self.curves.check_reach(make_path((normal, normal_target), (tangential, tangential_target)))
            if control.__class__ is tuple or tangential_target.__class__ is tuple:
                memory = memory if control.__class__ is tuple else self._planar_copy(memory)
                drive = self._drive_in_plane if instrument is RIGID and not saturate else None
                drive = drive or self.make_drive(saturate, instrument, directions=2)
                advanced_memory = binding.advanced_in_plane(
                    memory, normal, normal_target, tangential, tangential_target, drive
                )
                moved = State(advanced_memory, self._initial_planar_memory)
            else:
                drive = self._drive if instrument is RIGID and not saturate else self.make_drive(saturate, instrument)
                moved = State(advanced(memory, normal, normal_target, tangential, tangential_target, drive), start)
        if friction is None:
            return moved
        moved = self.with_friction(moved, friction, instrument=instrument)
        return self.advance(moved, saturate=saturate, instrument=instrument)

    @property
    def direction_limit(self) -> str:
        """Feature that restricts it to one tangential direction, such as "wear"; empty if it may move in two."""
        features = (
            ("wear", self.wear),
            ("yielding", self.yielding),
            ("a friction law", self.law if self.slides else None),
        )
        if self.slope is not None:
            return "summits that meet on slopes"
        return next(
            (name for name, feature in features if feature is not None), "sliding that is followed" * self.slides
        )

    def enter_plane(self, state: State) -> State:
        """Return a state in two tangential directions; one of one direction moved along x.

        InputError if the state belongs to another ensemble, or the ensemble supports one direction only.
        """
        memory = self._checked_memory(state)
        return state if memory.plane else self.wrap_memory(self._planar_copy(memory))

    def _planar_copy(self, memory: Memory) -> Memory:
        """Return a copy of a memory of one direction, converted to two."""
        if self.direction_limit:
            raise InputError(
                f"{self.direction_limit} supports one tangential direction only; expected a number, not a pair"
            )
        rings = self.rings
        planar: Memory = binding.enter_plane(memory, rings.height_classes, rings.rings, rings.tolerance)
        return planar

    def wrap_memory(self, memory: Memory) -> State:
        """Wrap a memory of this ensemble in a state."""
        if memory.plane:
            return State(memory, self._initial_planar_memory)
        return State(memory, self._initial_memory if bool(memory.line.evolved) == self._evolves else None)

    def check_state(self, state: State) -> None:
        """Raise an InputError if a state does not belong to this ensemble."""
        self._checked_memory(state)

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
        """Advance a state along straight paths in sequence; return it with the totals at the end of each path.

        The result is bit-identical to as many calls of `advance`. Arguments and errors are those of `advance`, with one
        value for each path, or one number for all paths; an error has the index of its path.
        """
        memory = self._checked_memory(state)
        binding.check_one_direction(memory)
        line = memory.line
        normal = channel("normal", normal_load, normal_displacement, line.normal_control, 0.0, several=True)
        tangential = channel(
            "tangential", tangential_load, tangential_displacement, line.tangential_control, several=True
        )
        counts = {np.size(target) for _, target in (normal, tangential)} - {1}
        if len(counts) > 1 or 0 in counts:
            numbers = " and ".join(map(str, sorted(counts)))
            raise InputError(f"the channels have {numbers} values; expected equal numbers of values, or one number")
        paths = make_path(normal, tangential)
        rows = blank_rows(paths.size, None)
        state = self.walk(state, paths, rows=rows, saturate=saturate, instrument=instrument)
        return state, Totals.of(rows.totals)

    def stepper(self, state: State | None = None, *, saturate: bool = False, instrument: Instrument = RIGID) -> Stepper:
        """Return a `Stepper`, which steps a state in place in tight loops; it starts unloaded by default."""
        state = self.initial_state() if state is None else state
        self._checked_memory(state)
        return Stepper(self, state, {"saturate": saturate, "instrument": instrument})

    def load_state(self, path: str | Path) -> Any:
        """Read a state of this ensemble from a file of `save`; InputError for a state of another ensemble."""
        try:
            return self.state_from_bytes(Path(path).read_bytes())
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def state_from_bytes(self, content: bytes) -> Any:
        """Read a state from its bytes; InputError for a state of another ensemble."""
        start = self.initial_state()
        state = type(start).from_bytes(content, start)
        self._checked_memory(state)
        return state

    def with_friction(
        self,
        state: State,
        friction: ArrayLike,
        *,
        asperities: ArrayLike | None = None,
        instrument: Instrument = RIGID,
    ) -> State:
        """Return the state with new friction coefficients, which override a friction law from now on.

        One coefficient, or one per asperity, 0 or more, applies to the asperities with these indices, by default to
        all; InputError for other numbers or indices. Where a coefficient falls, springs beyond the new limit slip
        immediately. A controlled tangential load is held, and so is the displacement of an instrument's drive: U
        follows, as it would if the coefficients fell in many small steps. A load that friction can no longer support
        stays in the state: the contact slides at the displacement at which sliding began, and the next path raises an
        error unless it unloads, or holds the load at the limit.
        """
        memory, chosen = copied(self._checked_memory(state)), self._selected_indices(asperities)
        coefficients = state.friction
        coefficients[chosen] = self._coefficients(friction, chosen.size)
        if memory.line.evolved:
            view(memory.line.evolved.friction_overridden, self.elements)[chosen] = 1
        with _series_instrument(memory, instrument) as series:
            drive = self.make_drive(False, series, directions=binding.directions_of(memory))
            status = lib.hs_set_friction(memory, pointer(coefficients), drive)
        if status == lib.HS_FOREIGN:
            raise InputError(
                "friction differs between asperities that share rings of traction; expected one coefficient for "
                "asperities that had the same one at the start"
            )
        check(status)
        return self.wrap_memory(memory)

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
        """Return the state with new summits, each of which is a new contact.

        The memory of a changed summit is erased, its springs are unstrained; summits that keep their height and radius
        keep their memory. Then each channel returns to its controlled value: a controlled load is restored, two loads
        along a joint straight path.

        New heights, over the same datum, and radii [m] apply to the asperities with these indices, by default to all;
        an omitted quantity is unchanged. ``saturate`` and ``instrument`` are as for `advance`. InputError: numbers out
        of range, indices that the ensemble does not have, or patches. FrictionLimitError: the new contact cannot
        support the tangential load.
        """
        binding.check_one_direction(self._checked_memory(state))
        memory, chosen = copied(state.memory), self._selected_indices(asperities)
        self._track_evolution(memory)
        count, evolved = self.elements, memory.line.evolved
        old = view(evolved.summit_height, count), view(evolved.summit_radius, count)
        height, radius = old[0].copy(), old[1].copy()
        per_asperity = partial(one_per, "asperity", "asperities")
        if summit_height is not None:
            height[chosen] = workable("summit_height", per_asperity("summit_height", summit_height, chosen.size))
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
        with self._evolution(virgin) as evolution:
            check(lib.hs_set_summits(memory, pointer(height), pointer(radius), pointer(fresh), evolution))
        back = _return_path(state.memory, as_instrument(instrument))
        restored: State = self.walk(self.wrap_memory(memory), back, saturate=saturate, instrument=instrument)
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
        """Advance a state along load paths and record rows.

        Pairs of tangential targets convert any state to two directions. Rows of asperities, by index in the order of
        their columns, are written to ``rows`` in SI (see `blank_rows`). A fraction ``until`` of each path is followed;
        ``friction`` varies linearly along it. Threads share the work on many asperities; results are bit-identical for
        any number. `saturate`, `instrument` and errors are as for `advance`; errors have the index of the path.
        """
        if as_instrument(instrument).parallel_stiffness and (load_controlled := binding.by_load(paths)).any():
            if (load_controlled[:, 0] != load_controlled[:, 1]).any():
                raise InputError(
                    "one tangential component is a load and the other one a displacement, with a spring in parallel; "
                    "expected two loads or two displacements, or an instrument without parallel_stiffness"
                )
            options: dict[str, Any] = {"rows": rows, "asperities": asperities, "saturate": saturate, "until": until}
            options |= {"friction": friction, "threads": threads}
            return self._walk_with_parallel_spring(state, paths, load_controlled[:, 0], instrument, options)
        memory = self._checked_memory(state)
        planar = bool(memory.plane) or binding.are_in_plane(paths) or bool(rows and rows.vectors)
        if planar and friction is not None:
            raise InputError(
                "friction that varies along a path supports one tangential direction only; expected a change at a time"
            )
        memory = copied(memory) if memory.plane or not planar else self._planar_copy(memory)
        paths = binding.check_in_plane(paths) if planar else paths
        if friction is not None or (not planar and rows is not None and EVOLVED & rows.each.keys()):
            self._track_evolution(memory)
        if rows is None:
            rows, paths = blank_rows(0, None, planar=planar), unrecorded(paths)
        path, refusal = ffi.cast("hs_path *", ffi.from_buffer(paths)), ffi.new("hs_refusal *")
        drive = self.make_drive(saturate, instrument, threads, directions=2 if planar else 1)
        arguments = memory, path, paths.size, rows.as_struct(asperities), drive, until
        if evolved := memory.line.evolved:
            if friction is not None:
                view(evolved.friction_overridden, self.elements)[:] = 1
            with self._evolution(self._virgin_radius(memory), friction) as evolution:
                status = lib.hs_integrate(*arguments, evolution, refusal)
        else:
            status = lib.hs_integrate(*arguments, ffi.NULL, refusal)
        check(status, refusal)
        return self.wrap_memory(memory)

    def _walk_with_parallel_spring(
        self, state: Any, paths: Paths, load_controlled: Booleans, instrument: Instrument, options: dict[str, Any]
    ) -> Any:
        """Advance along paths of which some control the load of contact plus parallel spring."""
        for run in np.split(np.arange(paths.size), np.flatnonzero(np.diff(load_controlled)) + 1):
            legs, by_load = paths[run], bool(load_controlled[run[0]])
            if by_load:
                legs["tangential_control"][legs["tangential_control"] == LOAD] = DISPLACED
                legs["tangential_target"] /= instrument.parallel_stiffness
            try:
                series = instrument.load_control_equivalent if by_load else instrument
                state = Ensemble.walk(self, state, legs, instrument=series, **options)
            except (FrictionLimitError, CurveEndError) as error:
                error.path += int(run[0])
                raise
            if by_load:
                # the channel remains under load control
                binding.set_tangential_control(self._checked_memory(state), LOAD)
        return state

    def slide_time(self, state: State) -> Floats:
        """Return the time at which each asperity or patch first slid as a whole in a replay [s]; NaN if never."""
        memory = self._checked_memory(state)
        contact = memory.line.contact
        times = np.empty(contact.query_count or contact.count)
        lib.hs_slide_times(memory, pointer(times))
        return times

    def approach_at(self, normal_load: float) -> float:
        """Solve for the approach [m] at which the virgin contact first carries a normal load ≥ 0 [N], at U = 0."""
        load = scalar("normal_load", normal_load, least=0.0)
        workable("normal_load", load)
        if load > 0 and (self.yielding is not None or self.slope is not None):
            return self.advance(self.initial_state(), normal_load=load).approach
        return float(lib.hs_approach_at(self._contact, load))

    #: Pressures and tractions of `Patches`.
    superposition: ClassVar[Any] = unsupported_method(
        "the ensemble has no normal curves; expected one from normal curves: see asperity"
    )

    def asperity(self, index: int, state: State) -> Asperity:
        """Return one asperity with its memory in a state; InputError if the index is out of range.

        In two tangential directions the last axis of its tangential quantities is x and y.
        """
        if not isinstance(index, int | np.integer) or not 0 <= index < len(self):
            raise InputError(f"asperity {index!r} does not exist; expected an index from 0 to {len(self) - 1}")
        self._checked_memory(state)
        return Asperity.from_readout(Readout(self, state, [int(index)]), 0, int(index))

    def asperities(self, state: State) -> Asperities:
        """Return all asperities with their memories in a state, as a sequence: ``len``, index, slice, iteration.

        Their loads, radii and slip states are read in one batch.
        """
        self._checked_memory(state)
        readout = Readout(self, state, range(len(self)))
        return Asperities(lambda index: Asperity.from_readout(readout, index, index), range(len(self)))

    _coefficients = staticmethod(coulomb)

    def _evolution(self, virgin_radius: Floats, goal: FrictionGoal | None = None) -> Any:
        follow = self.follow_sliding
        return evolution_of(self.pair, self.laws, follow_sliding=follow, virgin_radius=virgin_radius, goal=goal)

    @cached_property
    def _contact(self) -> Any:
        """Initial contact, as a structure of the library."""
        keys = [self.friction]
        if self.wear is not None or (self.law is not None and self.law.depends_on in {"own", "slid"}):
            # asperities share a memory only if everything that their friction depends on is equal
            keys += [self.summit_height, self.summit_radius]
        moduli = self.pair.contact_modulus, self.pair.displacement_ratio
        return binding.new_contact(self.summit_height, self.summit_radius, None, _group_numbers(*keys), *moduli)

    @cached_property
    def _initial_memory(self) -> Memory:
        """Memory at the start, which is never changed."""
        memory: Memory = owned(lib.hs_state_new(self._contact, pointer(self.friction)))
        memory.line.identity = lib.hs_digest(
            memory.line.identity, ffi.from_buffer(self._settings_bytes), len(self._settings_bytes)
        )
        if self.evolves:
            self._track_evolution(memory)
        return memory

    @cached_property
    def _initial_planar_memory(self) -> Memory:
        """Memory at the start in two tangential directions."""
        return self._planar_copy(self._initial_memory)

    @property
    def _settings_bytes(self) -> bytes:
        """Settings of the laws, added to the digest of contact and friction that identifies states."""
        if not self.laws and not self.follow_sliding:
            return b""
        numbers = [law.numbers for law in self.laws]
        # a field of a user-defined law is identified by its type, since its address differs between processes
        text = json.dumps([numbers, self.follow_sliding], sort_keys=True, default=lambda law: type(law).__qualname__)
        return text.encode()

    def _checked_memory(self, state: Any) -> Memory:
        """Return the memory of a state; InputError if it belongs to another ensemble."""
        if not isinstance(state, State):
            raise InputError(f"state is {state!r}; expected a State, such as initial_state() returns")
        # no state refers to a memory that has not been computed
        if state.like is not None and state.like is self.__dict__.get("_initial_planar_memory"):
            return state.memory
        if state.like is not self._initial_memory:
            binding.check_belongs(state.memory, self._initial_memory)
        rings = state.rings
        if rings is not None and rings != self.rings:
            raise InputError(
                f"the state was made with {rings}; expected a state of this ensemble, with {self.rings}. Advance it "
                "with an ensemble that has its rings, or replay its events with this one"
            )
        return state.memory

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without cached values, such as structures of the library."""
        return {field.name: getattr(self, field.name) for field in attrs.fields(type(self))}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        self.__dict__.update(state)

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

    @cached_property
    def _evolves(self) -> bool:
        return self.evolves

    @cached_property
    def _drive(self) -> Any:
        return self.make_drive(False, RIGID)

    @cached_property
    def _drive_in_plane(self) -> Any:
        return self.make_drive(False, RIGID, directions=2)

    def make_drive(
        self, saturate: bool, instrument: Instrument, threads: int = 1, *, directions: int = 1, heeds: bool = True
    ) -> Any:
        """Build the ``hs_drive`` of the library: tolerance, instrument compliance, saturation and threads."""
        compliances = as_instrument(instrument).directional_compliances(directions)
        return binding.drive(self.tolerance, compliances, saturate, threads, heeds=heeds)

    def _selected_indices(self, asperities: ArrayLike | None) -> Integers:
        if asperities is None:
            return np.arange(self.elements)
        chosen = np.atleast_1d(np.asarray(asperities))
        if chosen.dtype.kind not in "iu" or chosen.ndim != 1 or np.unique(chosen).size != chosen.size:
            raise InputError(f"asperities is {asperities!r}; expected a list of indices without repetition")
        outside = chosen[(chosen < 0) | (chosen >= self.elements)]
        if outside.size:
            raise InputError(f"asperity {outside[0]} does not exist; expected an index from 0 to {self.elements - 1}")
        return chosen.astype(np.int64)


# a single asperity is an ensemble of one
Asperity.ensemble_type = Ensemble


def _range_line(values: Floats, unit: str) -> str:
    low, high = values.min(), values.max()
    if unit:
        return range_text(low, high, unit)
    return f"{low:.4g}" + (f" to {high:.4g}" if high > low else "")


@contextmanager
def _series_instrument(memory: Memory, instrument: Instrument) -> Iterator[Instrument]:
    """Yield the instrument in series with a contact; under load control it includes the parallel spring."""
    if not as_instrument(instrument).parallel_stiffness or memory.line.tangential_control != LOAD:
        yield instrument
        return
    with binding.controlled(memory, DISPLACED):
        yield instrument.load_control_equivalent


def _group_numbers(*keys: Floats) -> Integers | None:
    """Return the group number of each asperity, equal if all keys are; None if there is one group."""
    numbers = np.zeros(keys[0].size, dtype=np.int64)
    for key in keys:
        if (key == key[0]).all():
            continue
        _, rank = np.unique(key, return_inverse=True)
        _, numbers = np.unique(numbers * (rank.max() + 1) + rank, return_inverse=True)
    return numbers.astype(np.int64) if numbers.any() else None


def _return_path(memory: Memory, instrument: Instrument) -> Paths:
    """Return the path on which each channel returns to its controlled value."""
    line, units = memory.line, memory.line.contact.units
    compliance = units.stiffness / instrument.stiffness
    normal = {LOAD: line.normal_load * units.load, DISPLACED: line.approach * units.length}
    load, displacement = (line.tangential_load + line.excess) * units.load, line.displacement * units.displacement
    tangential = {
        LOAD: instrument.drive_load(displacement, load),
        DISPLACED: (line.displacement + compliance * line.tangential_load) * units.displacement,
    }
    return paths_to(
        Goals(line.normal_control, normal[line.normal_control]),
        Goals(line.tangential_control, tangential[line.tangential_control]),
        times=(line.clock.end, line.clock.end),
    )


class Patches(Ensemble):
    """Patches of one contact with normal curves; made by `Ensemble.from_normal_curves`, which documents them.

    The memory is replayed on the elements of the total curve: ``summit_height`` and ``summit_radius`` belong to the
    elements. Patches share one coefficient, keep their curves, and have no individual radii.
    """

    curves: NormalCurves

    nouns = "patch", "patches"
    summary_units = {"friction": ""}  # noqa: RUF012 - as of every ensemble
    with_geometry = unsupported_method("patches have no height and radius to change; expected an ensemble of summits")
    asperity = asperities = unsupported_method(
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
            # knots have no radius; their unit of length is the range of the table
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
        """Properties of each patch: height, friction at the start, position."""
        properties = {
            "summit_height": self.highest_summit - self.curves.first_touch,
            "friction": np.full(len(self), self.friction[0]),
            "x": self.curves.x,
            "y": self.curves.y,
        }
        return {name: values for name, values in properties.items() if values is not None}

    def _selected_indices(self, asperities: ArrayLike | None) -> Integers:
        if asperities is not None:
            raise InputError("patches of one contact share one coefficient; expected a change for all of them")
        return super()._selected_indices(asperities)

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
        **options: Any,
    ) -> Any:
        """Advance a state along load paths and record patches; see `Ensemble.walk`."""
        if friction is not None or (rows is not None and EVOLVED & rows.each.keys()):
            raise InputError("patches of one contact keep their friction along a path; expected a change at a time")
        self.curves.check_reach(paths)
        if rows is None:
            return super().walk(state, paths, **options)
        chosen = np.asarray(asperities, dtype=np.int64)
        # the first element is sufficient to locate the slip front
        columns = np.arange(self.elements if chosen.size else 1)
        elements = blank_rows(len(rows.totals), columns.size, planar=bool(rows.vectors))
        advanced_state = super().walk(state, paths, rows=elements, asperities=columns, **options)
        self.curves.project(elements, float(advanced_state.friction[0]), chosen, rows)
        return advanced_state

    def superposition(self, state: State) -> Superposition:
        """Return pressures and tractions of patches as sums over the table of their normal curves."""
        memory, rows = self._checked_memory(state), blank_rows(1, 1)
        binding.check_one_direction(memory)
        check(lib.hs_read(memory, rows.as_struct(np.zeros(1, dtype=np.int64)), 0))
        stick = float(self.curves.stick_approach(rows)[0])
        return self.curves.superpose(binding.stack(memory), memory.line.contact.units, stick)

    def slide_time(self, state: State) -> Floats:
        """Return the time at which each patch first slid as a whole in a replay [s] (patch); NaN if never."""
        times: Floats = super().slide_time(state)[np.unique(self.first_touch, return_inverse=True)[1]]
        return times

    @cached_property
    def _contact(self) -> Any:
        """Contact of the elements of the total curve, which records when patches first slide."""
        moduli = self.pair.contact_modulus, self.pair.displacement_ratio
        touches = np.unique(self.first_touch)
        return binding.new_contact(
            self.summit_height, self.summit_radius, self.curves.stiffness, None, *moduli, touches
        )

    @property
    def _settings_bytes(self) -> bytes:
        tables = self.curves.arrays
        return b"".join(tables[name].tobytes() for name in sorted(tables) if name not in {"x", "y"})


def check_ensemble(_: object, __: object, value: Any) -> None:
    """Raise an InputError if the value of a field is not an `Ensemble`."""
    if not isinstance(value, Ensemble):
        run = f"; a scenario is run by hs.run({value!r})" if isinstance(value, str | Path) else ""
        raise InputError(f"ensemble is {brief(value)}; expected an Ensemble{run}")
