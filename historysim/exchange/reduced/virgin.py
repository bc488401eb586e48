"""The virgin curve of a contact at a held normal load: what a displacement from the unstrained state takes."""

from functools import cached_property

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.state import EnsembleState
from historysim.basics.array_types import Floats
from historysim.errors import InputError

STEEPER = 1e-9
"""By how much, relatively, rounding may have a slope rise."""


# slots would leave no place for what is computed once
@attrs.frozen(eq=False, slots=False)
class VirginCurve:
    """T(U) and dT/dU of a contact that is moved from rest at a normal load, by single exact steps.

    Parameters
    ----------
    ensemble : Ensemble
        With constant coefficients and summits.
    normal_load : float
        [N], > 0.
    """

    ensemble: Ensemble
    normal_load: float

    @cached_property
    def rest(self) -> EnsembleState:
        """The unstrained state."""
        loaded = self.ensemble.advance(self.ensemble.initial_state(), normal_load=self.normal_load)
        # the approach is held: at a constant load it does not change
        return self.ensemble.advance(loaded, normal_displacement=loaded.approach, tangential_displacement=0.0)

    @cached_property
    def end(self) -> float:
        """Displacement from which on everything slides [m]: max θ μ_i (d - h_i)."""
        gap = self.ensemble.highest_summit - self.ensemble.summit_height
        reach = self.ensemble.friction * np.maximum(self.rest.approach - gap, 0.0)
        return float(self.ensemble.pair.displacement_ratio * reach.max())

    def at(self, displacement: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return tangential loads [N] and stiffnesses [N/m] at displacements ≥ 0 [m], of one shape."""
        asked = np.asarray(displacement, dtype=np.float64)
        load, slope = np.empty(asked.size), np.empty(asked.size)
        stepper = self.ensemble.stepper(self.rest)
        for place in np.argsort(asked, axis=None, kind="stable"):
            # one way without a reversal is the virgin curve, in however many steps
            stepper.step(tangential_displacement=float(asked.flat[place]))
            load[place] = stepper.tangential_load
            slope[place] = stepper.save().stiffness(1)
        return load.reshape(asked.shape), slope.reshape(asked.shape)

    def check(self) -> None:
        """Check that it is a curve that springs in parallel can follow.

        Raises
        ------
        InputError
            Nothing slides, or the curve stiffens on the way.
        """
        if not self.end > 0.0:
            raise InputError("friction is 0 everywhere; expected a contact that carries a tangential load")
        _, slope = self.at(np.linspace(0.0, self.end, 257))
        if (np.diff(slope) > STEEPER * slope[0]).any():
            raise InputError(
                "the virgin curve stiffens on the way, as no springs in parallel do; expected a normal curve that is "
                "convex throughout"
            )
