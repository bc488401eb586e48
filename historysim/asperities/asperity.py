"""`Asperity`: one contact of the ensemble in one state, and what can be asked of it."""

import enum
import math
from typing import Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.contact.hertz import half_chord
from historysim.contact.materials import MaterialPair
from historysim.memory.rows import FULL_STICK, GROSS_SLIP, PARTIAL_SLIP, SEPARATED
from historysim.memory.traction import TractionMemory


class SlipState(enum.IntEnum):
    """What the springs of a contact do at its edge and inside; the flag values of ``slip_state``."""

    SEPARATED = SEPARATED
    FULL_STICK = FULL_STICK
    PARTIAL_SLIP = PARTIAL_SLIP
    GROSS_SLIP = GROSS_SLIP


@attrs.frozen(eq=False)
class Asperity:
    """One asperity, holding its traction memory in one state of its ensemble.

    Attributes
    ----------
    index : int
        Position in the ensemble.
    pair : MaterialPair
    summit_height, summit_radius : float
        [m].
    friction : float
        Coulomb coefficient in this state.
    approach : float
        Own approach δ [m]; negative where it does not touch.
    normal_load, tangential_load : float
        [N]; the tangential load has the sign of the displacement that raised it.
    contact_radius, stick_radius : float
        a and c [m]; c = a in full stick, 0 in gross slip.
    slip_state : SlipState
    dissipated_energy, stored_energy : float
        Frictional energy lost so far, and tangential elastic energy held [J].
    memory : TractionMemory
        View of the friction group's polyline.
    """

    index: int
    pair: MaterialPair = attrs.field(repr=False)
    summit_height: float
    summit_radius: float
    friction: float
    approach: float
    normal_load: float
    tangential_load: float
    contact_radius: float
    stick_radius: float
    slip_state: SlipState
    dissipated_energy: float
    stored_energy: float
    memory: TractionMemory = attrs.field(repr=False)

    @property
    def preliminary_displacement(self) -> float:
        """Displacement at which the virgin contact slides, θ μ δ [m] (Mindlin)."""
        return self.pair.displacement_ratio * self.friction * max(self.approach, 0.0)

    @property
    def tangential_stiffness(self) -> float:
        """dT/dU of the stick zone, 8 G* c [N/m]; a reversal starts with 8 G* a instead."""
        return 8.0 * self.pair.shear_modulus * self.stick_radius

    @property
    def reversal_points(self) -> "np.recarray[Any, np.dtype[np.record]]":
        """Vertices of the memory inside the contact, from the edge inward.

        Returns
        -------
        record array with fields ``radius`` [m], the stick or counter-slip radius of the vertex, and
        ``displacement`` [m], the tangential displacement at which it was made.
        """
        points = np.recarray(max(self.memory.radius.size - 1, 0), dtype=[("radius", float), ("displacement", float)])
        points.radius, points.displacement = self.memory.radius[1:], self.memory.made_at[1:]
        return points

    def traction(self, radius: npt.ArrayLike) -> npt.NDArray[np.float64]:
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

    def pressure(self, radius: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the normal pressure p(r) [Pa] (Hertz); shapes as in `traction`."""
        return self._pressure(np.abs(checked("radius", radius)), self.contact_radius)

    def _pressure(self, distance: npt.NDArray[np.float64], contact_radius: float) -> npt.NDArray[np.float64]:
        peak = 2.0 * self.pair.contact_modulus / (math.pi * self.summit_radius)
        return peak * half_chord(distance, contact_radius)
