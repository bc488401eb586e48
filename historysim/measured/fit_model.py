"""Model of a fit: a contact and its instrument as a function of the fitted parameters, and their starting values."""

import warnings
from collections.abc import Callable, Mapping

import attrs
import numpy as np

from historysim.asperities.asperity_set import require_asperities
from historysim.asperities.body import Body, require
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.asperities.patches import Patches
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError, UnlikelyValueWarning

Model = Callable[[Mapping[str, float]], tuple[Body, Instrument]]


def build_model(ensemble: Body, instrument: Instrument) -> Model:
    """Return contact and instrument as a function of fitted parameters; InputError if they cannot be fitted."""
    require(ensemble, "fit")
    if ensemble.evolves or ensemble.laws:
        raise InputError(
            "friction or geometry evolves in this scenario; expected constant ones for a fit"
        )

    def model(values: Mapping[str, float]) -> tuple[Body, Instrument]:
        springs = {
            name: values[name]
            for name in ("lateral_stiffness", "parallel_stiffness")
            if name in values
        }
        with warnings.catch_warnings():
            # a search passes values that nobody gave
            warnings.simplefilter("ignore", UnlikelyValueWarning)
            changed = _with_parameters(ensemble, values)
        return changed, attrs.evolve(instrument, **springs)

    return model


def _with_parameters(ensemble: Body, values: Mapping[str, float]) -> Body:
    """Return an ensemble with these values of the fitted parameters."""
    pair = ensemble.pair
    if "shear_modulus" in values:
        moduli = {"contact_modulus": pair.contact_modulus, "shear_modulus": values["shear_modulus"]}
        pair = MaterialPair.from_moduli(**moduli, **pair.limits)
    friction = values.get("friction", ensemble.friction)
    if isinstance(ensemble, Patches):
        coefficient = float(np.ravel(friction)[0])
        return ensemble.with_parameters(pair, coefficient)
    summits = require_asperities(ensemble)
    height = summits.summit_height
    mean = summits.summit_height.mean()
    stretched = mean + values.get("height_scale", 1.0) * (height - mean)
    return Ensemble(pair, stretched, summits.summit_radius, friction, tolerance=ensemble.tolerance)


def starting_value(name: str, ensemble: Body, instrument: Instrument) -> float:
    """Return the starting value of a parameter: its present value in contact or instrument."""
    if name == "friction":
        coefficients = np.unique(ensemble.friction)
        if coefficients.size > 1 or coefficients[0] == 0:
            raise InputError(
                "friction: expected one coefficient for all asperities, greater than 0, to start from"
            )
        return float(coefficients[0])
    if name == "lateral_stiffness":
        if instrument.rigid:
            raise InputError(
                "lateral_stiffness: expected [instrument] with a lateral_stiffness to start from"
            )
        return instrument.stiffness
    if name == "parallel_stiffness":
        if not instrument.parallel_stiffness:
            raise InputError(
                "parallel_stiffness: expected [instrument] with a parallel_stiffness to start from"
            )
        return instrument.parallel_stiffness
    if name == "height_scale":
        if not ensemble.has_radii:
            raise InputError(
                "height_scale: is part of the normal curve already; expected a surface of summits"
            )
        if np.ptp(ensemble.coordinates["summit_height"]) == 0:
            raise InputError("height_scale: all summits are equally high; expected a rough surface")
        return 1.0
    if ensemble.line_length is not None:
        raise InputError(
            "shear_modulus: a cylinder yields by E* alone, in either direction; expected it not to be fitted"
        )
    return ensemble.pair.shear_modulus
