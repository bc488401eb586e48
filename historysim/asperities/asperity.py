"""`Asperity`: one contact of the ensemble in one state, and what can be asked of it."""

import enum
import math
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.contact.hertz import half_chord
from historysim.contact.materials import MaterialPair
from historysim.memory.binding import FULL_STICK, GROSS_SLIP, PARTIAL_SLIP, SEPARATED

if TYPE_CHECKING:
    from historysim.memory.traction import TractionMemory


class SlipState(enum.IntEnum):
    """What the springs of a contact do at its edge and inside; the flag values of ``slip_state``."""

    SEPARATED = SEPARATED
    FULL_STICK = FULL_STICK
    PARTIAL_SLIP = PARTIAL_SLIP
    GROSS_SLIP = GROSS_SLIP


@attrs.frozen(eq=False, repr=False)
class Asperity:
    """One asperity, holding its traction memory in one state of its ensemble.

    What it answers follows from its geometry, its friction and its memory.

    Attributes
    ----------
    index : int
        Position in the ensemble.
    pair : MaterialPair
    summit_height, summit_radius : float
        [m].
    memory : TractionMemory
        View of the friction group's polyline.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> ensemble = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
    >>> state = ensemble.advance(ensemble.initial_state(), normal_load=50e-3)
    >>> asperity = ensemble.asperity(0, ensemble.advance(state, tangential_load=5e-3))
    >>> print(f"{asperity.stick_radius / asperity.contact_radius:.4f}")  # (1 - T/(μN))^(1/3)
    0.7937
    """

    index: int
    pair: MaterialPair
    summit_height: float
    summit_radius: float
    memory: "TractionMemory"

    def __repr__(self) -> str:
        parts = [
            f"normal load {quantity_text(self.normal_load, 'N')}",
            f"tangential load {quantity_text(self.tangential_load, 'N')}",
            f"contact radius {quantity_text(self.contact_radius, 'm')}",
            f"stick radius {quantity_text(self.stick_radius, 'm')}",
            counted(self.reversal_points.size, "reversal point", "reversal points"),
        ]
        state = self.slip_state.name.lower().replace("_", " ")
        return f"<Asperity {self.index}: {state}{''.join(f', {text}' for text in parts)}>"

    @property
    def friction(self) -> float:
        """Coulomb coefficient μ in this state."""
        return self.memory.friction

    @property
    def approach(self) -> float:
        """Own approach δ [m]; negative where it does not touch."""
        return self.memory.approach

    @property
    def normal_load(self) -> float:
        """Normal load N [N]."""
        return float(self.memory.recorded.normal_load[0, 0])

    @property
    def tangential_load(self) -> float:
        """Tangential load T [N], with the sign of the displacement that raised it."""
        return float(self.memory.recorded.tangential_load[0, 0])

    @property
    def contact_radius(self) -> float:
        """Contact radius a [m]; 0 where it does not touch."""
        return float(self.memory.recorded.contact_radius[0, 0])

    @property
    def stick_radius(self) -> float:
        """Stick radius c [m]: a in full stick, 0 in gross slip."""
        return float(self.memory.recorded.stick_radius[0, 0])

    @property
    def slip_state(self) -> SlipState:
        """What the contact does at its edge and inside."""
        return SlipState(self.memory.recorded.slip_state[0, 0])

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start [J]."""
        return self.memory.dissipated_energy

    @property
    def stored_energy(self) -> float:
        """Tangential elastic energy [J]."""
        return self.memory.stored_energy

    @property
    def preliminary_displacement(self) -> float:
        """Displacement at which the virgin contact slides, θ μ δ [m] (Mindlin)."""
        return self.pair.displacement_ratio * self.friction * max(self.approach, 0.0)

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of the stick zone [N/m]: 8 G* c, or 8 G* a where the displacement turns round.

        Less, where a fall of friction lets a disc slide inside the stick zone.
        """
        return self.memory.tangential_stiffness

    @property
    def reversal_points(self) -> "np.recarray[Any, np.dtype[np.record]]":
        """Reversals of the displacement that the contact remembers, from the edge inward.

        A reversal is remembered by the slip front that it leaves behind, at the stick radius of its moment. The front
        of the slip that goes on now is none yet, and virgin loading has none. A reversal is forgotten (wiped out)
        when slip from the edge passes its front, such as when a loop closes, or when the contact edge comes back
        as far. A rising normal load and a change of friction leave it where it is, unless the springs there slip.
        A reversal out of full stick leaves no front, one out of gross slip has the radius 0.

        Returns
        -------
        record array with fields ``radius`` [m], the stick radius at the reversal, and ``displacement`` [m], the
        tangential displacement U of the reversal.
        """
        radius, displacement = self.memory.reversals
        points = np.recarray(radius.size, dtype=[("radius", float), ("displacement", float)])
        points.radius, points.displacement = radius, displacement
        return points

    def traction(self, radius: npt.ArrayLike) -> Floats:
        """Return the tangential traction τ(r) [Pa].

        The superposition of Hertz pressures that belongs to the polyline: Σ_j Δm_j p(r; c_j) (Jäger;
        Ciavarella).

        Parameters
        ----------
        radius : array_like
            Distances from the contact's centre [m], any shape; 0 outside the contact.

        Raises
        ------
        InputError
            A distance that is not a finite number.
        """
        distance = np.abs(checked("radius", radius))
        total = np.zeros(distance.shape)
        for weight, vertex_radius in zip(self.memory.jump, self.memory.radius, strict=True):
            total += weight * self._pressure(distance, vertex_radius)
        return total

    def pressure(self, radius: npt.ArrayLike) -> Floats:
        """Return the normal pressure p(r) [Pa] (Hertz); shapes as in `traction`."""
        return self._pressure(np.abs(checked("radius", radius)), self.contact_radius)

    def _pressure(self, distance: Floats, contact_radius: float) -> Floats:
        peak = 2.0 * self.pair.contact_modulus / (math.pi * self.summit_radius)
        return peak * half_chord(distance, contact_radius)


def summary(asperity: Asperity) -> list[tuple[str, str]]:
    """Return the state of an asperity in a few lines."""
    return [
        ("asperity", str(asperity.index)),
        ("slip state", asperity.slip_state.name.lower().replace("_", " ")),
        ("normal load", quantity_text(asperity.normal_load, "N")),
        ("tangential load", quantity_text(asperity.tangential_load, "N")),
        ("contact radius", quantity_text(asperity.contact_radius, "m")),
        ("stick radius", quantity_text(asperity.stick_radius, "m")),
        ("dissipated energy", quantity_text(asperity.dissipated_energy, "J")),
    ]


def reversal_table(asperity: Asperity) -> list[tuple[str, str, str]]:
    """Return the reversal points that are remembered, from the edge inward, as strings under a heading."""
    rows = [("reversal point", "radius", "turned at displacement")]
    for number, point in enumerate(asperity.reversal_points):
        rows.append((str(number), quantity_text(point.radius, "m"), quantity_text(point.displacement, "m")))
    return rows
