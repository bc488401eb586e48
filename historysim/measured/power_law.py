"""How friction goes with the load: μ = factor N^exponent."""

import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.errors import InputError

CONFIDENCE = 0.95
"""Of all intervals of fitted numbers."""


@attrs.frozen
class PowerLaw:
    """μ = factor N^exponent, with intervals of 95 % confidence.

    Attributes
    ----------
    exponent, exponent_low, exponent_high : float
        n [1]: -1/3 for a smooth ball with a constant interfacial shear strength, 0 for a rough surface.
    factor : float
        μ at 1 N [1].
    """

    exponent: float
    exponent_low: float
    exponent_high: float
    factor: float


def power_law(normal_load: npt.ArrayLike, friction: npt.ArrayLike) -> PowerLaw:
    """Return μ = factor N^n fitted to friction coefficients at several loads, by a line through the logarithms.

    Parameters
    ----------
    normal_load : array_like (load)
        N [N], > 0, three or more, not all equal.
    friction : array_like (load)
        μ [1], > 0.

    Raises
    ------
    InputError
        Numbers out of range, arrays of different lengths, too few loads, or the same load throughout.
    """
    from scipy import stats

    load, coefficient = checked("normal_load", normal_load, above=0), checked("friction", friction, above=0)
    if load.ndim != 1 or load.shape != coefficient.shape or load.size < 3:
        raise InputError(
            f"normal_load has shape {load.shape} and friction {coefficient.shape}; expected two lists of one length ≥ 3"
        )
    if np.ptp(load) == 0:
        raise InputError(f"normal_load is {load[0]:g} N throughout; expected several loads")
    line = stats.linregress(np.log(load), np.log(coefficient))
    # scipy has no standard error for the same coefficient throughout, where nothing scatters
    error = 0.0 if math.isnan(line.stderr) else float(line.stderr)
    slope, reach = float(line.slope), float(stats.t.ppf((1 + CONFIDENCE) / 2, load.size - 2)) * error
    return PowerLaw(slope, slope - reach, slope + reach, math.exp(line.intercept))
