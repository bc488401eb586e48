"""`LineContact`: a cylinder on a flat, in plane strain."""

import math
from typing import Any, ClassVar, NoReturn

import attrs
import numpy as np

from historysim.asperities.body import Feature, check_pair
from historysim.asperities.curves import NormalCurves
from historysim.asperities.instrument import RINGS
from historysim.asperities.patches import Patches
from historysim.asperities.state import State
from historysim.basics.arguments import ArrayLike, Floats, Integers, as_floats, scalar, workable
from historysim.basics.library import lib
from historysim.contact.materials import MaterialPair
from historysim.errors import CurveEndError, InputError
from historysim.memory import binding
from historysim.memory.binding import check
from historysim.memory.paths import Paths, Rows, blank_rows

WIDEST = 0.5  # largest half-width, relative to the radius and to the reference depth
DECADES, ROWS = 6, 256  # decades of half-widths in the table, and its rows in each of them
_ONE_COEFFICIENT = (
    "a line contact keeps its shape and one coefficient; expected a sphere or summits"
)
_END = f"a half-width of {WIDEST:g} of the radius or of the reference depth, which is reached"
_WIDER = "load less, or give a larger radius or reference_depth"


# no slots: cached properties need an instance dictionary
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class LineContact(Patches):
    """A cylinder on a flat that moves across its axis, in plane strain: exact for any history of both loads.

    Half-width c of the contact, and loads P per unit length (Johnson 1985, 4.2 and 5.6):

        c² = 4 P R/(π E*),  d = 2/(π E*) [P ln(2 L/c) + P/2],  p(x) = E*/(2 R) √(c² - x²)

    In plane strain of similar materials (Dundurs' β = 0) the tangential compliance is the normal
    one for every ν (Jäger, Ciavarella), so that the stick zone has the half-width of the contact
    under N - |ΔT|/μ: √(1 - T/(μN)) of the contact on first loading. Displacements of a
    half-plane need a reference: here points at the depth L below the surface. Only displacements
    depend on L, by terms proportional to the loads; energies, tractions and widths do not.

    The memory is replayed on knots of that curve. At given loads, half-widths, pressures and
    tractions follow the closed forms, displacements within 1e-7 of theirs, and energies of a
    cycle of ±T within 1e-6 from 0.2 μN on, 2e-5 from 0.1 μN on, and 1e-4 from 0.04 μN on. A bulk
    stress in the bodies, which shifts the stick zone, is not modelled.

    Parameters
    ----------
    pair : MaterialPair
    radius : float
        R, of the cylinder, or 1/R = 1/R1 + 1/R2 of two parallel ones [m].
    length : float
        Length of the contact along the axis [m].
    friction : float
        Coulomb coefficient μ ≥ 0.
    reference_depth : float
        L, such as the thickness of the body [m].
    tolerance : float
        As for `Ensemble`.

    Raises
    ------
    InputError
        A number that is not finite or out of range.

    Examples
    --------
    >>> pair = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2.5e10)
    >>> rig = hs.LineContact(pair, radius=0.01, length=0.005, friction=0.5, reference_depth=0.01)
    >>> state = rig.advance(rig.initial_state(), normal_load=500.0)
    >>> state = rig.advance(state, tangential_load=150.0)
    >>> print(f"{rig.stick_half_width(state) / rig.contact_half_width(state):.4f}")
    0.6325
    """

    radius: float = attrs.field(init=False)
    length: float = attrs.field(init=False)
    reference_depth: float = attrs.field(init=False)

    _nouns = "line contact", "line contacts"
    summary_units: ClassVar[dict[str, str]] = {
        "radius": "m",
        "length": "m",
        "reference_depth": "m",
        "friction": "",
    }
    unsupported: ClassVar[dict[Feature, str]] = {
        **Patches.unsupported,
        **dict.fromkeys(("wear", "sliding", "friction law"), _ONE_COEFFICIENT),
        "yielding": "no law of first loading is known here for a cylinder; expected a sphere or summits",
        "friction change of some": "a line contact has one coefficient; expected a change without asperities",
        "friction ramp": "a line contact keeps its friction along a path; expected a change at a time",
        "geometry change": "a line contact keeps its radius; expected a sphere or summits",
        "asperities": "a line contact is not an asperity with a contact radius; expected a sphere or summits. Its "
        "half-widths are in contact_half_width and stick_half_width",
    }

    def __init__(
        self,
        pair: MaterialPair,
        radius: float,
        length: float,
        friction: float,
        reference_depth: float,
        *,
        tolerance: float = 1e-6,
        curves: NormalCurves | None = None,
    ) -> None:
        numbers = {"radius": radius, "length": length, "reference_depth": reference_depth}
        sizes = {
            name: float(workable(name, scalar(name, value, above=0)))
            for name, value in numbers.items()
        }
        super().__init__(
            pair,
            # a log has the table: logarithms differ in their last bit between machines
            tabulate(check_pair(pair), **sizes) if curves is None else curves,
            friction,
            tolerance=tolerance,
            rings=RINGS,
        )
        self.__dict__.update(sizes)

    @classmethod
    def from_normal_curves(cls, *_: Any, **__: Any) -> NoReturn:
        """Raise InputError: the normal curve of a cylinder follows from its radius."""
        raise InputError(
            "the normal curve of a line contact follows from its radius and length; expected "
            "hs.Patches.from_normal_curves for a curve of your own"
        )

    @property
    def line_length(self) -> float:  # type: ignore[override] # of a body it is a class variable
        """Length of the contact along its axis [m]."""
        return self.length

    @property
    def displacement_ratio(self) -> float:
        """θ: 1, for every ν."""
        return 1.0

    @property
    def direction_limit(self) -> str:
        """Feature that restricts it to one tangential direction."""
        return "a line contact, which is softer across its axis than along it,"

    @property
    def settings(self) -> dict[str, Any]:
        """Numbers that define it in addition to its arrays, as a log stores them."""
        return super().settings | {"line": {name: getattr(self, name) for name in _SIZES}}

    def check_reach(self, paths: Paths) -> None:
        """Raise a CurveEndError for a path to a half-width of more than `WIDEST`."""
        try:
            super().check_reach(paths)
        except CurveEndError as error:
            raise CurveEndError(error.request, error.end, error.path, _END, _WIDER) from None

    def with_parameters(self, pair: MaterialPair, friction: float) -> "LineContact":
        """Return the same contact with another pair and coefficient at the start."""
        sizes: dict[str, Any] = {name: getattr(self, name) for name in _SIZES}
        return LineContact(pair, friction=friction, tolerance=self.tolerance, **sizes)

    def half_width(self, normal_load: ArrayLike) -> Floats:
        """Return the half-width of the contact under normal loads [m], in their shape."""
        load = np.maximum(as_floats("normal_load", normal_load), 0.0)
        width: Floats = np.sqrt(
            4.0 * load * self.radius / (math.pi * self.pair.contact_modulus * self.length)
        )
        return width

    def contact_half_width(self, state: State) -> float:
        """Return the half-width of the contact in a state [m]."""
        self._checked_memory(state)
        return float(self.half_width(state.normal_load))

    def stick_half_width(self, state: State) -> float:
        """Return the half-width of the stick zone in a state [m]; 0 in gross slip."""
        memory, rows = self._checked_memory(state), blank_rows(1, 1)
        check(lib.hs_read(memory, rows.as_struct(np.zeros(1, dtype=np.int64)), 0))
        return float(self._stick_half_width(rows)[0])

    def pressure(self, x: ArrayLike, state: State) -> Floats:
        """Return contact pressures at distances from the axis of the contact [m], in their shape [Pa]."""
        return self._pressure(as_floats("x", x), self.contact_half_width(state))

    def traction(self, x: ArrayLike, state: State) -> Floats:
        """Return tangential tractions at distances from the axis of the contact [m], in their shape [Pa].

        It is the sum of the pressures at the half-widths of the vertices of the memory, scaled by
        jumps of slope.
        """
        memory, distance = self._checked_memory(state), as_floats("x", x)
        vertices, length = binding.stack(memory), memory.line.contact.units.length
        widths = self.half_width(self.curves.total(vertices["label"] * length))
        pressures = self._pressure(distance[..., None], widths)
        traction: Floats = np.diff(pressures, axis=-1) @ vertices["slope"][1:]
        return traction

    def _pressure(self, distance: Floats, half_width: Any) -> Floats:
        root = np.sqrt(np.maximum(half_width**2 - distance**2, 0.0))
        pressure: Floats = self.pair.contact_modulus / (2.0 * self.radius) * root
        return pressure

    def _stick_half_width(self, elements: Rows) -> Floats:
        return self.half_width(self.curves.total(self.curves.stick_approach(elements)))

    @property
    def _column_count(self) -> int:
        """Number of elements whose rows give those of the contact: the one that touches first."""
        return 1

    def _project(self, elements: Rows, friction: float, chosen: Integers, rows: Rows) -> None:
        """Fill the rows of the contact, by closed forms; its radii belong to circles of equal area."""
        del friction
        totals = elements.totals
        rows.totals[...] = totals
        widths = {"contact_radius": self.half_width(totals["normal_load"])}
        rows.totals["contact_count"] = totals["normal_load"] > 0
        rows.totals["real_contact_area"] = 2.0 * self.length * widths["contact_radius"]
        if not chosen.size:
            return
        widths["stick_radius"] = self._stick_half_width(elements)
        values = {
            name: np.sqrt(2.0 * self.length / math.pi * width) for name, width in widths.items()
        }
        values |= {
            name: totals[name] for name in ("normal_load", "tangential_load", "dissipated_energy")
        }
        for name, column in values.items():
            rows.each[name][...] = column[:, None]
        rows.each["slip_state"][...] = elements.slip_state

    @property
    def _identity_bytes(self) -> bytes:
        sizes = np.array([getattr(self, name) for name in _SIZES])
        return super()._identity_bytes + sizes.tobytes()


_SIZES = "radius", "length", "reference_depth"


def tabulate(
    pair: MaterialPair, radius: float, length: float, reference_depth: float
) -> NormalCurves:
    """Tabulate the normal curve of a cylinder, with its stiffnesses, evenly in the logarithm of the half-width."""
    widest = WIDEST * min(radius, reference_depth)
    width = widest * 10.0 ** np.linspace(-DECADES, 0.0, DECADES * ROWS + 1)
    ratio, modulus = np.log(2.0 * reference_depth / width), math.pi * pair.contact_modulus * length
    approach, load = width**2 * (ratio + 0.5) / (2.0 * radius), modulus * width**2 / (4.0 * radius)
    return NormalCurves.from_exact(
        approach, load[:, None], 2.0 * length * width[:, None], modulus / (2.0 * ratio)
    )
