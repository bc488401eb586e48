"""`Asperity`: one contact of the ensemble in one state, and what can be asked of it."""

import enum
import math
from functools import cached_property
from typing import Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Array, Floats, checked
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.contact.hertz import half_chord
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import TIE, Memory, check, view
from historysim.memory.paths import blank_rows


class SlipState(enum.IntEnum):
    """What the springs of a contact do at its edge and inside; the flag values of ``slip_state``."""

    SEPARATED = lib.HS_SEPARATED
    FULL_STICK = lib.HS_FULL_STICK
    PARTIAL_SLIP = lib.HS_PARTIAL_SLIP
    GROSS_SLIP = lib.HS_GROSS_SLIP


def _recorded(name: str, text: str) -> Any:
    """Return a property that reads what a recorder writes of an asperity, in SI: a number, or a vector."""

    def read(asperity: Any) -> Any:
        value = asperity.recorded[name]
        return value.copy() if np.ndim(value) else float(value)

    return property(read, doc=text)


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, repr=False, slots=False)
class Asperity:
    """One asperity in one state of its ensemble: what it answers follows from its geometry, friction and memory.

    Its memory is the polyline of its friction group, the anchor of the springs over the approach of the highest summit
    at which a spring first touched, as far as that is beyond the asperity's own gap.
    """

    index: int  #: position in the ensemble
    pair: MaterialPair
    summit_height: float  #: [m]
    summit_radius: float  #: [m]
    memory: "Memory"  #: hs_memory of this asperity alone, with what its group remembers
    planar: "Memory" = None  #: hs_planar of the whole ensemble, where the state is of two directions

    normal_load = _recorded("normal_load", "Normal load N [N].")
    tangential_load = _recorded(
        "tangential_load", "Tangential load T [N], with the sign of the displacement that raised it."
    )
    contact_radius = _recorded("contact_radius", "Contact radius a [m]; 0 where it does not touch.")
    stick_radius = _recorded("stick_radius", "Stick radius c [m]: a in full stick, 0 in gross slip.")

    def __repr__(self) -> str:
        texts = [f"{name} {value}" for name, value in summary(self)[2:6]]
        if self.planar is None:
            texts.append(counted(self.reversal_points.size, "reversal point", "reversal points"))
        return f"<{type(self).__name__} {self.index}: {', '.join([self.state_text, *texts])}>"

    @cached_property
    def recorded(self) -> dict[str, Any]:
        """What a recorder writes of this asperity, by name, in SI."""
        rows = blank_rows(1, 1, planar=self.planar is not None)
        if self.planar is None:
            check(lib.hs_read(self.memory, rows.as_struct(np.zeros(1, dtype=np.int64)), 0))
        else:
            check(lib.hs_planar_read(self.planar, rows.as_struct(np.array([self.index])), 0))
        return {name: values[0, 0] for name, values in rows.each.items()}

    @property
    def state_text(self) -> str:
        """Its slip state in words."""
        return self.slip_state.name.lower().replace("_", " ")

    @property
    def slip_state(self) -> SlipState:
        """What the contact does at its edge and inside."""
        return SlipState(self.recorded["slip_state"])

    @property
    def friction(self) -> float:
        """Coulomb coefficient μ in this state."""
        return float(self.memory.friction[0])

    @property
    def approach(self) -> float:
        """Own approach δ [m]; negative where it does not touch."""
        return float((self.memory.approach - self._gap) * self.memory.contact.units.length)

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start [J]."""
        return float(self.memory.each[0] * self.memory.contact.units.energy)

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy [J]."""
        return float(lib.hs_stored_energy(self.memory))

    @property
    def preliminary_displacement(self) -> float:
        """Displacement at which the virgin contact slides, θ μ δ [m] (Mindlin)."""
        return self.pair.displacement_ratio * self.friction * max(self.approach, 0.0)

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of the stick zone [N/m]: 8 G* c, or 8 G* a where the displacement turns round.

        Less, where a fall of friction lets a disc slide inside the stick zone.
        """
        return float(lib.hs_stiffness(self.memory, 0))

    @property
    def superposition(self) -> tuple[Floats, Floats]:
        """Radii [m] and weights of the Hertz pressures of which the traction is the sum, the edge first.

        The weight is the slope of the anchors inside the radius, ±μ where springs slip, less the slope outside.
        """
        seen = self._seen
        return self._radius(seen["label"][::-1]), np.diff(seen["slope"][::-1], prepend=0.0)

    @property
    def reversal_points(self) -> "np.recarray[Any, np.dtype[np.record]]":
        """Reversals of the displacement that the contact remembers: records of ``radius`` and ``displacement`` [m].

        From the edge inward; the radius is that of the slip front that a reversal has left behind, the stick radius of
        its moment, and the displacement U that of the reversal. The front of the slip that goes on now is none yet, and
        virgin loading has none. A reversal is forgotten (wiped out) when slip from the edge passes its front, such as
        when a loop closes, or when the contact edge comes back as far. A reversal out of full stick leaves no front,
        one out of gross slip has the radius 0.
        """
        # with the vertex inside of those that are seen, which strain is measured against
        stack = self._vertices[-len(self._seen) - 1 :] if len(self._seen) else self._seen
        made_at = stack["made_at"]
        tie = TIE * np.abs(made_at).max(initial=0.0)
        steps = np.diff(made_at, append=made_at[-1:])
        turns = np.flatnonzero(np.abs(steps) > tie)
        # of each vertex, the first step outside it that is more than rounding
        onward = np.append(steps[turns], 0.0)[np.searchsorted(turns, np.arange(len(stack)))]
        # springs were at the limit at a slip front when it was made, at a former edge they were not strained; the front
        # is left behind when the displacement then went the other way
        strain = made_at - stack["anchor"]
        left = stack[(np.abs(strain) > tie) & (onward * strain < 0.0)]
        points = np.recarray(left.size, dtype=[("radius", float), ("displacement", float)])
        points.radius = self._radius(left["label"][::-1])
        points.displacement = left["made_at"][::-1] * self.memory.contact.units.displacement
        return points

    def traction(self, radius: npt.ArrayLike) -> Floats:
        """Return the tangential traction τ(r) [Pa], the sum of `superposition`: Σ_j Δm_j p(r; c_j) (Jäger; Ciavarella).

        The radii are distances from the contact's centre [m], any shape; outside the contact it is 0. A distance that
        is not a finite number is an InputError.
        """
        distance = np.abs(checked("radius", radius))
        radii, weights = self.superposition
        total = np.zeros((*distance.shape, *weights.shape[1:]))
        for vertex_radius, weight in zip(radii, weights, strict=True):
            total += np.multiply.outer(self._pressure(distance, vertex_radius), weight)
        return total

    def pressure(self, radius: npt.ArrayLike) -> Floats:
        """Return the normal pressure p(r) [Pa] (Hertz); shapes as in `traction`."""
        return self._pressure(np.abs(checked("radius", radius)), self.contact_radius)

    def _pressure(self, distance: Floats, contact_radius: float) -> Floats:
        peak = 2.0 * self.pair.contact_modulus / (math.pi * self.summit_radius)
        return peak * half_chord(distance, contact_radius)

    @property
    def _gap(self) -> float:
        return float(self.memory.contact.gap[0])

    @property
    def _vertices(self) -> Array:
        return view(self.memory.vertices, self.memory.depth[0])

    @property
    def _seen(self) -> Array:
        """The vertices beyond the asperity's gap, the deepest first."""
        return self._vertices[self._vertices["label"] > self._gap]

    def _radius(self, label: Floats) -> Floats:
        """Return the radii at labels [m]: √(R (label - gap))."""
        depth = np.maximum(label - self._gap, 0.0)
        radius: Floats = self.memory.contact.weight[0] * np.sqrt(depth) * self.memory.contact.units.radius
        return radius


@attrs.frozen(eq=False, repr=False, slots=False)
class PlanarAsperity(Asperity):
    """One asperity in a state of two tangential directions.

    The tangential load is a vector (direction) [N], in x and y, and so is the traction at each radius. Rings from the
    stick radius to the edge slip in the direction of their traction, which is μ p there.
    """

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of what sticks [N/m], 8 G* c, which is that of all directions."""
        return float(self.pair.contact_modulus * 2.0 / self.pair.displacement_ratio * self.stick_radius)

    @cached_property
    def superposition(self) -> tuple[Floats, Floats]:
        """Radii [m] and vectors (radius, direction) of Hertz pressures that add up to the traction, the edge first."""
        # (node, 3): label and deflection in x and y, the edge first
        nodes = np.zeros((max(lib.hs_planar_nodes(self.planar, self.index, 0, ffi.NULL), 0), 3))
        if lib.hs_planar_nodes(self.planar, self.index, len(nodes), pointer(nodes)) != len(nodes):
            raise MemoryError("there is not enough memory for the nodes of an asperity")
        slopes = np.diff(nodes[:, 1:], axis=0) / -np.diff(nodes[:, :1], axis=0)
        return self._radius(nodes[: len(slopes), 0]), np.diff(slopes, prepend=0.0, axis=0)

    @property
    def stored_energy(self) -> float:
        """Of one asperity it is not worked out in two directions: InputError; `PlanarState.stored_energy` is of all."""
        raise InputError("stored_energy of one asperity goes with one direction; expected that of the whole state")

    @property
    def reversal_points(self) -> "np.recarray[Any, np.dtype[np.record]]":
        """There are none of vectors: InputError."""
        raise InputError("reversal_points go with one tangential direction; expected `superposition` in two")


def summary(asperity: Asperity) -> list[tuple[str, str]]:
    """Return the state of an asperity in a few lines."""
    units = {"normal_load": "N", "tangential_load": "N", "contact_radius": "m", "stick_radius": "m"}
    units |= {"dissipated_energy": "J"}
    values = [(name.replace("_", " "), quantity_text(getattr(asperity, name), unit)) for name, unit in units.items()]
    return [("asperity", str(asperity.index)), ("slip state", asperity.state_text), *values]


def reversal_table(asperity: Asperity) -> list[tuple[str, str, str]]:
    """Return the reversal points that are remembered, from the edge inward, as strings under a heading."""
    rows = [("reversal point", "radius", "turned at displacement")]
    if isinstance(asperity, PlanarAsperity):
        return rows
    for number, point in enumerate(asperity.reversal_points):
        rows.append((str(number), quantity_text(point.radius, "m"), quantity_text(point.displacement, "m")))
    return rows
