"""`Patches`: the patches of one contact that is given by its normal curves."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar, Self, Unpack

import attrs
import numpy as np

from historysim.asperities.body import Feature, PathOptions, check_pair, warn_if_unlikely
from historysim.asperities.curves import NormalCurves, Superposition
from historysim.asperities.instrument import RIGID, RINGS, Instrument, Rings
from historysim.asperities.integration import EVOLVED, IntegratedBody
from historysim.asperities.law import coulomb
from historysim.asperities.state import State
from historysim.basics.arguments import ArrayLike, Floats, Integers, as_floats, scalar
from historysim.basics.library import lib
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory import binding
from historysim.memory.binding import check, copy_state
from historysim.memory.paths import Paths, Rows, blank_rows

_STEADY = "patches of one contact keep their shape and share one coefficient; expected independent summits"


# no slots: cached properties need an instance dictionary
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class Patches(IntegratedBody):
    """Patches of one contact with normal curves; made by `Patches.from_normal_curves`.

    The memory is replayed on the elements of the total curve. Patches share one coefficient of
    friction, keep their curves, and have areas instead of radii.
    """

    pair: MaterialPair
    curves: NormalCurves
    friction: Floats
    _highest_summit: float
    tolerance: float
    rings: Rings

    _nouns = "patch", "patches"
    summary_units: ClassVar[Mapping[str, str]] = {"friction": ""}
    unsupported: ClassVar[Mapping[Feature, str]] = {
        "wear": _STEADY,
        "yielding": _STEADY,
        "attraction": "attraction is of asperities with a radius; expected an ensemble of summits",
        "sliding": _STEADY,
        "friction law": _STEADY,
        "friction change of some": "patches of one contact share one coefficient; expected a change for all of them",
        "friction ramp": "patches of one contact keep their friction along a path; expected a change at a time",
        "geometry change": "patches have no height and radius to change; expected an ensemble of summits",
        "asperities": "a patch of a normal curve is not an asperity with a radius; expected an ensemble of summits. A "
        "replay records the loads and areas of the patches",
    }
    has_radii = False
    is_bounded = True

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
        self.__attrs_init__(
            pair=check_pair(pair),
            curves=curves,
            friction=_shared_coefficient(friction, len(curves)),
            highest_summit=scalar("highest_summit", highest_summit),
            tolerance=float(as_floats("tolerance", tolerance, above=0)),
            rings=rings,
        )
        warn_if_unlikely(pair, self.friction, stacklevel=3)

    @classmethod
    def from_normal_curves(
        cls,
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
    ) -> Self:
        """Make the patches of one contact, which may interact, from their normal curves.

        Tangential loads are superpositions of normal ones for any shape of the contact and any
        interaction of its patches (Jäger 1998; Ciavarella 1998): exact for similar materials
        (Dundurs' β = 0), one direction of the tangential load, and ν = 0; for other ν a small
        transverse slip is neglected. In two directions all patches share one class of rings of
        traction, which is within 1.1 % of μN at ν = 0, and 3 % at ν = 0.45.

        Parameters
        ----------
        pair : MaterialPair
            Its E*/(4 G*) turns approaches into tangential displacements.
        approach : array_like (row)
            Of the whole contact, from first touch at 0, ascending [m].
        load : array_like (row) or (row, patch)
            Normal load of each patch at that approach [N]; a single column is the whole contact. If
            the total load is convex, it is met exactly; otherwise the nearest convex curve is used
            (see `NormalCurves.residual` and `NormalCurves.error`).
        area : array_like, of the shape of ``load``, optional
            Contact areas [m²]; without them there are no areas in the history.
        friction : float
            Coulomb coefficient μ ≥ 0 of the whole contact.
        noise : array_like, optional
            Standard deviation of the noise of the total load [N], one number or one for each row
            with a load. Default: none if the total is convex, otherwise an estimate from
            differences of neighbouring rows.
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
        return cls(
            pair, curves, friction, highest_summit=highest_summit, tolerance=tolerance, rings=rings
        )

    def __len__(self) -> int:
        """Return the number of patches."""
        return len(self.curves)

    @property
    def elements(self) -> int:
        """Number of elements of the total curve, on which the memory is replayed."""
        return self.curves.label.size

    @property
    def highest_summit(self) -> float:
        """Height of the flat at first touch [m]."""
        return self._highest_summit

    @property
    def first_touch(self) -> Floats:
        """Approach at which each patch first touches [m]."""
        return self.curves.first_touch

    @property
    def has_areas(self) -> bool:
        """True if the normal curves have contact areas."""
        return self.curves.area is not None

    @property
    def coordinates(self) -> dict[str, Floats]:
        """Properties of each patch: height, friction at the start; if known its position."""
        properties = {
            "summit_height": self.highest_summit - self.curves.first_touch,
            "friction": self.friction,
            "x": self.curves.x,
            "y": self.curves.y,
        }
        return {name: values for name, values in properties.items() if values is not None}

    @property
    def arrays(self) -> dict[str, Floats]:
        """Arrays that define it, by the names under which a log stores them."""
        elements = {
            "summit_height": self._element_height,
            "summit_radius": self._element_radius,
            "friction": self._element_friction,
        }
        return elements | {f"curves.{name}": values for name, values in self.curves.arrays.items()}

    @property
    def settings(self) -> dict[str, Any]:
        """Numbers that define it in addition to its arrays, as a log stores them."""
        return super().settings | (
            {} if self.rings == RINGS else {"rings": attrs.asdict(self.rings)}
        )

    def check_reach(self, paths: Paths) -> None:
        """Raise a CurveEndError for a path beyond the table of the normal curves."""
        self.curves.check_reach(paths)

    def advance_along(
        self,
        state: State,
        paths: Paths,
        **options: Unpack[PathOptions],
    ) -> State:
        """Advance a state along load paths and record patches; see `PathOptions`."""
        rows = options.get("rows")
        chosen = np.asarray(options.get("asperities", ()), dtype=np.int64)
        if rows is not None and EVOLVED & rows.each.keys():
            raise InputError(_STEADY)
        self.check_reach(paths)
        if rows is None:
            return self._integrate(state, paths, **options)
        # the first element is sufficient to locate the slip front
        columns = np.arange(self._column_count if chosen.size else 1)
        elements = blank_rows(len(rows.totals), columns.size, planar=bool(rows.vectors))
        options["rows"], options["asperities"] = elements, columns
        advanced_state = self._integrate(state, paths, **options)
        self._project(elements, float(advanced_state.friction[0]), chosen, rows)
        return advanced_state

    def with_parameters(self, pair: MaterialPair, friction: float) -> "Patches":
        """Return the same patches with another pair and coefficient at the start, as a fit varies them."""
        options: dict[str, Any] = {"tolerance": self.tolerance, "rings": self.rings}
        return Patches(pair, self.curves, friction, highest_summit=self.highest_summit, **options)

    def with_friction(
        self, state: State, friction: ArrayLike, *, instrument: Instrument = RIGID
    ) -> State:
        """Return the state with a new friction coefficient, which all patches share; see `Ensemble.with_friction`."""
        memory = copy_state(self._checked_memory(state))
        return self._set_friction(memory, _shared_coefficient(friction, self.elements), instrument)

    def superposition(self, state: State) -> Superposition:
        """Return pressures and tractions of patches as sums over the table of their normal curves."""
        memory, rows = self._checked_memory(state), blank_rows(1, 1)
        binding.check_one_direction(memory)
        check(lib.hs_read(memory, rows.as_struct(np.zeros(1, dtype=np.int64)), 0))
        stick = float(self.curves.stick_approach(rows)[0])
        return self.curves.superpose(binding.stack(memory), memory.line.contact.units, stick)

    def slide_time(self, state: State) -> Floats:
        """Return the time at which each patch first slid as a whole in a replay [s] (patch); NaN if never."""
        times: Floats = super().slide_time(state)[
            np.unique(self.first_touch, return_inverse=True)[1]
        ]
        return times

    @cached_property
    def _contact(self) -> Any:
        """Contact of the elements of the total curve, which records when patches first slide."""
        moduli = self.pair.contact_modulus, self.displacement_ratio
        touches = np.unique(self.first_touch)
        height, radius = self._element_height, self._element_radius
        return binding.new_contact(height, radius, self.curves.stiffness, None, *moduli, touches)

    @property
    def _column_count(self) -> int:
        """Number of elements whose rows give the rows of patches."""
        return self.elements

    def _project(self, elements: Rows, friction: float, chosen: Integers, rows: Rows) -> None:
        """Fill rows of chosen patches from rows of elements."""
        self.curves.project(elements, friction, chosen, rows)

    @property
    def _element_height(self) -> Floats:
        """Heights of the elements [m]."""
        return self.highest_summit - self.curves.label

    @property
    def _element_radius(self) -> Floats:
        """Radii of the elements [m]: of a Hertzian contact its radius; knots have none, and the range of the table."""
        if self.curves.weight is None:
            return np.full(self.elements, self.curves.approach[-1])
        radius: Floats = (0.75 * self.curves.weight / self.pair.contact_modulus) ** 2
        return radius

    @property
    def _element_friction(self) -> Floats:
        return np.full(self.elements, self.friction[0])

    @property
    def _identity_bytes(self) -> bytes:
        tables = self.curves.arrays
        return b"".join(tables[name].tobytes() for name in sorted(tables) if name not in {"x", "y"})


def _shared_coefficient(friction: ArrayLike, count: int) -> Floats:
    """Return a coefficient that all patches share, once for each of them or of their elements."""
    return coulomb(scalar("friction of patches that share a contact", friction, least=0), count)
