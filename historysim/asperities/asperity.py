"""`Asperity`: one contact with its traction memory; `Asperities`: the asperities of one state as a sequence."""

import enum
import importlib
import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypedDict, TypeVar, Unpack, overload

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.instrument import Rings
from historysim.asperities.law import FrictionLaw
from historysim.asperities.readout import Readout, Step
from historysim.asperities.state import State
from historysim.asperities.traction_picture import traction_svg
from historysim.basics.arguments import Array, Floats, as_floats, scalar
from historysim.basics.library import lib
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text, html_table
from historysim.contact.hertz import half_chord
from historysim.contact.materials import MaterialPair
from historysim.contact.subsurface import normal_stress, tangential_stress
from historysim.errors import InputError
from historysim.memory.binding import TIE, Memory, nodes, take_ownership, view

if TYPE_CHECKING:
    from historysim.asperities.wear import WearLaw
    from historysim.asperities.yielding import YieldingLaw

T = TypeVar("T")
SWAPPED_AXES = [1, 0, 2]
# exact for polynomials of degree 5
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


class SlipState(enum.IntEnum):
    """Slip state of a contact; the flag values of ``slip_state``."""

    SEPARATED = lib.HS_SEPARATED
    FULL_STICK = lib.HS_FULL_STICK
    PARTIAL_SLIP = lib.HS_PARTIAL_SLIP
    GROSS_SLIP = lib.HS_GROSS_SLIP


class _Quantity(property, Generic[T]):
    """A property of this type for type checkers."""

    if TYPE_CHECKING:

        def __get__(self, instance: object, owner: type | None = None) -> T: ...  # type: ignore[override]


def _recorded_value(name: str, text: str) -> _Quantity[Any]:
    """Return a property that reads a recorded value in SI: a number, or a vector in two directions."""

    def read(self: Any) -> Any:
        value = self._readout.recorded_values[name][self._column]
        return np.array(value) if isinstance(value, list) else value

    return _Quantity(read, doc=text)


def _recorded_number(name: str, text: str) -> _Quantity[float]:
    """Return a property that reads a recorded number in SI."""
    return _recorded_value(name, text)


def _present_parameter(name: str, text: str) -> _Quantity[float]:
    return _Quantity(lambda self: self._readout.parameters[name][self._column], doc=text)


class AsperityOptions(TypedDict, total=False):
    """Options of `Ensemble` that `Asperity` accepts."""

    tolerance: float
    wear: "WearLaw | None"
    follow_sliding: bool
    yielding: "YieldingLaw | str | None"
    rings: Rings


# no slots: cached properties need an instance dictionary
@attrs.frozen(eq=False, init=False, repr=False, slots=False)
class Asperity:
    """One Hertzian contact with its traction memory: an immutable object; `advance` returns the next one.

    ``hs.Asperity(pair, radius, friction)`` is a single new asperity, unloaded, at first touch: an
    `Ensemble` of one, with the same results. `Ensemble.asperity`, `Ensemble.asperities` and
    ``history.contact.asperity`` return asperities of larger contacts, which have the same
    properties but are advanced by their ensemble.

    In two tangential directions, tangential loads, displacements and tractions are vectors in x and
    y. An asperity has two directions after its first pair of targets.

    Parameters
    ----------
    pair : MaterialPair
    radius : float
        Radius R of the summit [m], > 0.
    friction : float or FrictionLaw
        Coulomb coefficient μ ≥ 0, or a law (see `historysim.asperities.laws`).
    **options
        ``tolerance``, ``wear``, ``follow_sliding``, ``yielding`` and ``rings`` of `Ensemble`.

    Raises
    ------
    InputError
        A number that is not finite or out of range, or a list of numbers.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ball = hs.Asperity(pair, radius=2.5e-3, friction=0.2).advance(normal_load=50e-3)
    >>> ball = ball.advance(tangential_load=8e-3).advance(tangential_load=-2e-3)
    >>> ball.slip_state.name, f"{ball.stick_radius / ball.contact_radius:.3f}"
    ('PARTIAL_SLIP', '0.794')
    >>> [f"{point.radius / ball.contact_radius:.3f}" for point in ball.reversal_points]
    ['0.585']
    >>> ball.traction([0.0, 2e-6]).shape
    (2,)
    """

    ensemble: Any  #: the ensemble that contains it; an ensemble of one for a single asperity
    state: State  #: state of that ensemble
    #: position in the ensemble, or label in the history; None for a single asperity
    index: int | None
    _readout: Readout
    _column: int
    _steps: tuple[Step, ...] | None

    def __init__(
        self,
        pair: MaterialPair,
        radius: float | str,
        friction: float | FrictionLaw,
        **options: Unpack[AsperityOptions],
    ) -> None:
        coefficient = (
            friction if isinstance(friction, FrictionLaw) else scalar("friction", friction, least=0)
        )
        summit_radius = scalar("radius", radius, above=0)
        # an ensemble of one; its module imports this one
        ensembles = importlib.import_module("historysim.asperities.ensemble")
        ensemble = ensembles.Ensemble(pair, 0.0, summit_radius, coefficient, **options)
        state = ensemble.initial_state()
        self.__attrs_init__(ensemble, state, None, Readout(ensemble, state, [0]), 0, ())

    @classmethod
    def from_readout(
        cls, readout: Readout, column: int, index: int | None, steps: tuple[Step, ...] | None = None
    ) -> Self:
        """Return an asperity of an ensemble in a state, from a column of a readout."""
        asperity = cls.__new__(cls)
        asperity.__attrs_init__(readout.ensemble, readout.state, index, readout, column, steps)
        return asperity

    def _identity(self) -> tuple[Any, ...]:
        return self.state, self._position, self.index

    def __eq__(self, other: object) -> bool:
        return (
            self._identity() == other._identity() if isinstance(other, Asperity) else NotImplemented
        )

    def __hash__(self) -> int:
        return hash(self._identity())

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild_asperity, (
            self.ensemble,
            self.state,
            self._position,
            self.index,
            self._steps,
        )

    def advance(
        self,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | tuple[float, float] | None = None,
        tangential_displacement: float | tuple[float, float] | None = None,
        friction: float | None = None,
        saturate: bool = False,
    ) -> Self:
        """Return a new asperity after one joint straight path; this one is not changed.

        A channel without a target is held at its last controlled value, a load or a displacement.

        Parameters
        ----------
        normal_load, tangential_load : float, optional
            Loads to reach [N]; N ≥ 0. The tangential load may be a pair, in x and y.
        normal_displacement : float, optional
            Approach from first touch to reach [m]; negative is a gap.
        tangential_displacement : float, optional
            Displacement U to reach [m], or a pair in x and y.
        friction : float, optional
            New coefficient, applied at the end of the path.
        saturate : bool
            Hold a tangential load beyond the friction limit at the limit.

        Raises
        ------
        FrictionLimitError
            |T| > μ N.
        InputError
            As for `Ensemble.advance`, or if the asperity belongs to an ensemble of several, which
            move together.
        """
        if len(self.ensemble) > 1:
            raise InputError(
                f"asperity {self.index} is one of {len(self.ensemble):,} that move together; expected the ensemble to "
                f"advance: ensemble.asperity({self.index}, ensemble.advance(state, …)), or hs.Asperity(pair, radius, "
                "friction) for a single asperity"
            )
        targets = {
            "normal_load": normal_load,
            "normal_displacement": normal_displacement,
            "tangential_load": tangential_load,
            "tangential_displacement": tangential_displacement,
        }
        state = self.ensemble.advance(self.state, **targets, friction=friction, saturate=saturate)
        readout = Readout(self.ensemble, state, [self._position])
        successor = self.from_readout(readout, 0, self.index)
        if self._steps is None:
            return successor
        steps = (*_select_remembered(self._steps, successor), Step.between(self.state, state))
        return self.from_readout(readout, 0, self.index, steps)

    def __repr__(self) -> str:
        texts = [f"{name} {value}" for name, value in summary(self)[-5:-1]]
        if self.has_moved_straight:
            texts.append(count_text(self.reversal_points.size, "reversal point", "reversal points"))
        name = type(self).__name__ if self.index is None else f"{type(self).__name__} {self.index}"
        return f"<{name}: {', '.join([self.state_text, *texts])}>"

    def _repr_html_(self) -> str:
        return traction_svg(self) + html_table(summary(self))

    normal_load = _recorded_number("normal_load", "Normal load N [N].")
    tangential_load: ClassVar[_Quantity["float | Floats"]] = _recorded_value(
        "tangential_load",
        "Tangential load T [N], with the sign of the displacement that raised it; a vector in two directions.",
    )
    contact_radius = _recorded_number("contact_radius", "Contact radius a [m]; 0 if separated.")
    stick_radius = _recorded_number(
        "stick_radius", "Stick radius c [m]: a in full stick, 0 in gross slip."
    )
    dissipated_energy = _recorded_number(
        "dissipated_energy", "Energy dissipated by friction since the start [J]."
    )
    summit_height = _present_parameter("summit_height", "Present height of the summit [m].")
    summit_radius = _present_parameter("summit_radius", "Present radius R of the summit [m].")
    friction = _present_parameter("friction", "Coulomb coefficient μ in this state.")

    @property
    def pair(self) -> MaterialPair:
        """Materials of the two bodies."""
        pair: MaterialPair = self.ensemble.pair
        return pair

    @property
    def slip_state(self) -> SlipState:
        """Slip state: separated, full stick, partial slip or gross slip."""
        return SlipState(self._readout.recorded_values["slip_state"][self._column])

    @property
    def state_text(self) -> str:
        """Slip state in words."""
        return self.slip_state.name.lower().replace("_", " ")

    @property
    def slip_annulus(self) -> tuple[float, float]:
        """Inner and outer radius of the annulus that slips [m]: the stick radius and the contact radius.

        The radii are equal in full stick, and (0, a) in gross slip.
        """
        return self.stick_radius, self.contact_radius

    @property
    def approach(self) -> float:
        """Approach δ of this asperity [m]; negative if separated."""
        line = self.memory.line
        return float((line.approach - self._gap) * line.contact.units.length)

    @cached_property
    def memory(self) -> Memory:
        """Traction memory of this asperity alone, held by the library; in two directions the memory along its line."""
        return take_ownership(lib.hs_state_of_one(self.state.memory, self._position))

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy [J]."""
        if self._nodes is None:
            return float(lib.hs_stored_energy(self.memory))
        if not self.contact_radius:
            return 0.0
        # E = 4 G* ∫ |v(x)|² dx over the radius x, with the deflection v, which is linear in x² between nodes
        nodes, contact = self._nodes[::-1], self.memory.line.contact
        edges = np.unique(self._radius(nodes[:, 0]))
        half = 0.5 * np.diff(edges)[:, np.newaxis]
        radius = edges[:-1, np.newaxis] + half * (1.0 + GAUSS_POINTS)
        label = self._gap + (radius / (contact.weight[0] * contact.units.radius)) ** 2
        squares = sum(np.interp(label, nodes[:, 0], nodes[:, axis]) ** 2 for axis in (1, 2))
        scale = 4.0 * self.pair.shear_modulus * contact.units.displacement**2
        return float(scale * (half * GAUSS_WEIGHTS * squares).sum())

    @property
    def preliminary_displacement(self) -> float:
        """Displacement at which the virgin contact slides, θ μ δ [m] (Mindlin)."""
        return float(self.pair.displacement_ratio * self.friction * max(self.approach, 0.0))

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of the stick zone [N/m]: 8 G* c, or 8 G* a at a reversal; in two directions 8 G* c in all of them.

        Less if a fall of friction lets a disc slide inside the stick zone.
        """
        if self._nodes is not None:
            return float(
                self.pair.contact_modulus * 2.0 / self.pair.displacement_ratio * self.stick_radius
            )
        return float(lib.hs_stiffness(self.memory, 0))

    @property
    def superposition(self) -> tuple[Floats, Floats]:
        """Radii [m] and weights of the Hertz pressures whose sum is the traction, from the edge inward.

        The weight is the slope of the anchors inside the radius (±μ in slip zones) minus the slope
        outside; in two directions it is a vector (radius, direction).
        """
        nodes = self._nodes
        if nodes is None:
            seen = self._visible_vertices
            return self._radius(seen["label"][::-1]), np.diff(seen["slope"][::-1], prepend=0.0)
        slopes = np.diff(nodes[:, 1:], axis=0) / -np.diff(nodes[:, :1], axis=0)
        return self._radius(nodes[: len(slopes), 0]), np.diff(slopes, prepend=0.0, axis=0)

    @property
    def reversal_points(self) -> "np.recarray[Any, np.dtype[np.record]]":
        """Reversals of the displacement that the contact remembers: records of ``radius`` and ``displacement`` [m].

        The radius is the radius of the slip front at the reversal: the stick radius at that moment,
        0 for a reversal out of gross slip. The displacement is U at that moment, with its sign. The
        order is from the edge inward, from the latest reversal to the earliest.

        Virgin loading has no reversal point: a slip front that still advances is not counted. A
        reversal out of full stick leaves no front. A reversal is wiped out when slip from the edge
        passes its front, such as when a loop closes, or when unloading moves the contact edge
        inside it.

        In two directions displacements are vectors (point, direction), along one line. InputError
        if the asperity has left its line, since its reversals then have no fronts; see
        `superposition`.
        """
        if not self.has_moved_straight:
            raise InputError(
                "reversal_points need motion along one line, and the asperity has turned off its line; expected "
                "`superposition` or `traction(r)`"
            )
        # includes the next vertex inward, the reference of the strain
        stack = (
            self._vertices[-len(self._visible_vertices) - 1 :]
            if len(self._visible_vertices)
            else self._visible_vertices
        )
        made_at = stack["made_at"]
        tie = TIE * np.abs(made_at).max(initial=0.0)
        steps = np.diff(made_at, append=made_at[-1:])
        turns = np.flatnonzero(np.abs(steps) > tie)
        # for each vertex, the first step outward of it that exceeds rounding
        onward = np.append(steps[turns], 0.0)[np.searchsorted(turns, np.arange(len(stack)))]
        # springs were at the friction limit at a slip front when it formed, and unstrained at a
        # former contact edge; a front becomes a reversal point when the displacement then changes
        # direction
        strain = made_at - stack["anchor"]
        fronts = stack[(np.abs(strain) > tie) & (onward * strain < 0.0)]
        displacement = self.state.on_line(fronts["made_at"][::-1])
        points = np.recarray(
            fronts.size, dtype=[("radius", float), ("displacement", float, displacement.shape[1:])]
        )
        points.radius = self._radius(fronts["label"][::-1])
        points.displacement = displacement
        return points

    @property
    def history(self) -> "np.recarray[Any, np.dtype[np.record]]":
        """Ends of the steps that an asperity by itself still remembers, the latest one last.

        Records of ``normal_load`` and ``tangential_load`` [N], ``approach`` and
        ``tangential_displacement`` [m] at the end of a call of `advance`; in two directions the
        tangential ones are vectors. A step is remembered as long as its end is a vertex of the
        memory: a reversal whose slip front, or a normal load whose contact edge, is still inside
        the contact. Wiped out steps are missing. After the asperity has left its line, all steps
        since the last gross slip are remembered.

        InputError for an asperity of an ensemble or a history: its steps are the events of the
        replay.
        """
        if self._steps is None:
            raise InputError(
                "the asperity was taken from an ensemble or a history, whose events are its steps; expected "
                "hs.Asperity(pair, radius, friction).advance(…), or `reversal_points`"
            )
        names = Step._fields[:4]
        shapes = [np.shape(getattr(self.state, name)) for name in names]
        records = np.recarray(
            len(self._steps),
            dtype=[(name, float, shape) for name, shape in zip(names, shapes, strict=True)],
        )
        for row, step in enumerate(self._steps):
            for name, shape in zip(names, shapes, strict=True):
                # steps before the first pair were along x
                value = getattr(step, name)
                records[name][row] = (value, 0.0) if shape and not np.ndim(value) else value
        return records

    def traction(self, radius: npt.ArrayLike) -> Floats:
        """Return the tangential traction τ(r) [Pa], the sum of `superposition`: Σ_j Δm_j p(r; c_j) (Jäger; Ciavarella).

        The radii are distances from the centre of the contact [m], an array of any shape; the
        traction outside the contact is 0. In two directions the last axis is x and y. InputError if
        a distance is not finite.
        """
        distance = np.abs(as_floats("radius", radius))
        radii, weights = self.superposition
        total = np.zeros((*distance.shape, *weights.shape[1:]))
        for vertex_radius, weight in zip(radii, weights, strict=True):
            total += np.multiply.outer(self._pressure(distance, vertex_radius), weight)
        return total

    def pressure(self, radius: npt.ArrayLike) -> Floats:
        """Return the normal pressure p(r) [Pa] (Hertz); radii as for `traction`."""
        return self._pressure(np.abs(as_floats("radius", radius)), self.contact_radius)

    def anchor(self, radius: npt.ArrayLike) -> Floats:
        """Return the displacements U at which the springs at radii in the contact are anchored [m] (radius).

        A spring that sticks keeps its anchor, one that slips drags it. InputError in two
        directions.
        """
        if self._nodes is not None:
            raise InputError(
                "anchors need one tangential direction; expected `traction(r)` in two directions"
            )
        vertices = self._vertices[::-1]
        depth = np.square(as_floats("radius", radius, least=0)) / self.summit_radius
        label = self._gap + depth / self.memory.line.contact.units.length
        anchors = np.interp(label, vertices["label"][::-1], vertices["anchor"][::-1])
        return np.asarray(anchors * self.memory.line.contact.units.displacement)

    def stress(
        self,
        x: npt.ArrayLike,
        y: npt.ArrayLike,
        z: npt.ArrayLike,
        *,
        poissons_ratio: float | str | None = None,
    ) -> Floats:
        """Return the stress tensor below the contact [Pa] (…, 3, 3), tension positive.

        The sum of Hertz's normal pressure and of the tangential distributions of `superposition`,
        each in closed form (Hamilton 1983); see `historysim.contact.subsurface`, which also has
        `von_mises` and `largest_principal`. The traction is that of the model: for ν ≠ 0 its small
        transverse part is neglected.

        Parameters
        ----------
        x, y, z : array_like
            Distances from the middle of the contact [m], which broadcast; z ≥ 0 into the body. The
            body is the one on which a positive tangential load acts towards positive x; in the
            other body x and y are reversed.
        poissons_ratio : float or {"first", "second"}, optional
            Of the body, or the body of the pair of materials; by default the second.

        Raises
        ------
        InputError
            If a point is above the surface, or Poisson's ratio is unknown.
        """
        ratio = self._poissons_ratio(poissons_ratio)
        points = np.broadcast_arrays(
            *(as_floats(name, values) for name, values in zip("xyz", (x, y, z), strict=True))
        )
        if not self.contact_radius:
            return np.zeros((*points[0].shape, 3, 3))
        radius = self.contact_radius
        total = normal_stress(
            *points, radius=radius, peak=self._peak_pressure(radius), poissons_ratio=ratio
        )
        radii, weights = self.superposition
        for vertex_radius, weight in zip(radii, np.atleast_2d(weights.T).T, strict=True):
            if vertex_radius == 0.0:
                continue
            peak = self._peak_pressure(vertex_radius)
            hertz: dict[str, float] = {
                "radius": vertex_radius,
                "peak": peak,
                "poissons_ratio": ratio,
            }
            total += weight[0] * tangential_stress(*points, **hertz)
            if weight.size == 2:
                # along y: the axes are exchanged
                across = tangential_stress(points[1], points[0], points[2], **hertz)
                total += weight[1] * across[..., SWAPPED_AXES, :][..., SWAPPED_AXES]
        return total

    def _poissons_ratio(self, poissons_ratio: float | str | None) -> float:
        """Resolve Poisson's ratio of a body; InputError if it is unknown."""
        bodies = {"first": self.pair.first, "second": self.pair.second}
        if poissons_ratio is not None and poissons_ratio not in bodies:
            return scalar("poissons_ratio", poissons_ratio)
        body = bodies[str(poissons_ratio or "second")]
        if body is None:
            raise InputError(
                "poissons_ratio is unknown, since the pair has moduli only; expected a number, as poissons_ratio=0.3"
            )
        return body.poissons_ratio

    def _peak_pressure(self, contact_radius: float) -> float:
        return (
            float(2.0 * self.pair.contact_modulus / (math.pi * self.summit_radius)) * contact_radius
        )

    def _pressure(self, distance: Floats, contact_radius: float) -> Floats:
        return self._peak_pressure(1.0) * half_chord(distance, contact_radius)

    @property
    def has_moved_straight(self) -> bool:
        """True if it has moved along one line only, so that its memory is exact."""
        return not self.state._turned

    @property
    def _position(self) -> int:
        return int(self._readout.positions[self._column])

    @property
    def _gap(self) -> float:
        return float(self.memory.line.contact.gap[0])

    @property
    def _vertices(self) -> Array:
        line = self.memory.line
        return view(line.vertices, line.depth[0])

    @property
    def _visible_vertices(self) -> Array:
        """Vertices beyond the asperity's gap, the deepest first."""
        return self._vertices[self._vertices["label"] > self._gap]

    @cached_property
    def _nodes(self) -> Floats | None:
        """Nodes of its rings, see `binding.nodes`; None in one tangential direction."""
        return nodes(self.state.memory, self._position)

    def _radius(self, label: Floats) -> Floats:
        """Return the radii at labels [m]: √(R (label - gap))."""
        depth = np.maximum(label - self._gap, 0.0)
        contact = self.memory.line.contact
        radius: Floats = contact.weight[0] * np.sqrt(depth) * contact.units.radius
        return radius


def _select_remembered(steps: tuple[Step, ...], asperity: Asperity) -> tuple[Step, ...]:
    """Select the earlier steps whose ends an asperity still remembers."""
    sliding = asperity.slip_state == SlipState.GROSS_SLIP
    if not asperity.has_moved_straight and not sliding:
        return steps
    line = asperity.memory.line
    stack = view(line.vertices, line.depth[0])
    # if all springs slide in one direction, only the contact edge is remembered
    vertices = stack[-1:] if sliding else stack
    label, anchor, made_at = (vertices[name].tolist() for name in ("label", "anchor", "made_at"))
    fronts = {mark for mark, start in zip(made_at, anchor, strict=True) if mark != start}
    kinks, edges = {*zip(label, anchor, strict=True)}, {*label}
    # the latest step of each vertex, matched by the label, mark or edge that the two share
    latest: dict[object, int] = {}
    for number, step in enumerate(steps):
        latest |= {("front", step.mark): number} if step.mark in fronts else {}
        latest |= {(step.label, step.mark): number} if (step.label, step.mark) in kinks else {}
        latest |= {("edge", step.label): number} if step.pressed and step.label in edges else {}
    return tuple(steps[number] for number in sorted({*latest.values()}))


def _rebuild_asperity(
    ensemble: Any, state: State, position: int, index: int | None, steps: tuple[Step, ...] | None
) -> Asperity:
    """Rebuild an asperity from its pickle."""
    return Asperity.from_readout(Readout(ensemble, state, [position]), 0, index, steps)


class Asperities(Sequence[Asperity]):
    """Asperities of one state as a sequence: ``len``, index, slice and iteration.

    Loads, radii and slip states of all asperities are read in one batch on first access. `make`
    returns the asperity at an index of the ensemble.
    """

    def __init__(self, make: Callable[[int], Asperity], indices: range) -> None:
        self._make, self._indices = make, indices

    def __len__(self) -> int:
        return len(self._indices)

    @overload
    def __getitem__(self, index: int) -> Asperity: ...

    @overload
    def __getitem__(self, index: slice) -> "Asperities": ...

    def __getitem__(self, index: int | slice) -> "Asperity | Asperities":
        if isinstance(index, slice):
            return Asperities(self._make, self._indices[index])
        try:
            return self._make(self._indices[index])
        except IndexError:
            count = len(self)
            raise IndexError(
                f"asperity {index} of {count}; expected {-count} to {count - 1}"
            ) from None

    def __iter__(self) -> Iterator[Asperity]:
        return map(self._make, self._indices)

    def __repr__(self) -> str:
        return f"<Asperities: {count_text(len(self), 'asperity', 'asperities')} of one state>"


def summary(asperity: Asperity) -> list[tuple[str, str]]:
    """Summarise the state of an asperity as labelled lines."""
    units = {"normal_load": "N", "tangential_load": "N", "contact_radius": "m", "stick_radius": "m"}
    units |= {"dissipated_energy": "J"}
    values = [
        (name.replace("_", " "), _text(getattr(asperity, name), unit))
        for name, unit in units.items()
    ]
    label = [] if asperity.index is None else [("asperity", str(asperity.index))]
    return [*label, ("slip state", asperity.state_text), *values]


def _text(value: Any, unit: str) -> str:
    """Format a number or a vector with its unit."""
    return (
        quantity_text(value, unit)
        if np.ndim(value) == 0
        else f"({', '.join(quantity_text(component, unit) for component in value)})"
    )


def reversal_table(asperity: Asperity) -> list[tuple[str, str, str]]:
    """Tabulate the remembered reversal points, from the edge inward, as strings under a heading."""
    rows = [("reversal point", "radius", "turned at displacement")]
    if not asperity.has_moved_straight:
        return rows
    for number, point in enumerate(asperity.reversal_points):
        rows.append((str(number), quantity_text(point.radius, "m"), _text(point.displacement, "m")))
    return rows
