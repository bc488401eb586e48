"""How friction and displacement go with the load: F = μ N + F0 and quantity = factor N^exponent, with intervals."""

import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.errors import InputError

CONFIDENCE = 0.95
"""Of all intervals of fitted numbers."""


@attrs.frozen
class StraightLine:
    """y = slope x + intercept by least squares, with intervals of 95 % confidence.

    The intervals come from the scatter about the line and Student's t; NaN for two points, which have no scatter.

    Attributes
    ----------
    slope, slope_low, slope_high : float
    intercept, intercept_low, intercept_high : float
    count : int
        The points that it was fitted to.
    """

    slope: float
    slope_low: float
    slope_high: float
    intercept: float
    intercept_low: float
    intercept_high: float
    count: int


@attrs.frozen
class PowerLawFit:
    """A quantity that goes as factor N^exponent, with an interval of 95 % confidence.

    Attributes
    ----------
    exponent, exponent_low, exponent_high : float
        n [1]. Of the friction coefficient -1/3 for a smooth ball with a constant interfacial shear strength, 0 for a
        rough surface; of the preliminary displacement 2/3 for a ball with a constant friction coefficient. The interval
        is NaN for two loads.
    factor : float
        The quantity at 1 N, in its own unit.
    """

    exponent: float
    exponent_low: float
    exponent_high: float
    factor: float


def straight_line(x: Floats, y: Floats) -> StraightLine:
    """Return the line through points (point), two or more, of which not all have one x."""
    from scipy import stats

    line = stats.linregress(x, y)
    if x.size > 2:
        # scipy has no standard errors for the same y throughout, where nothing scatters
        errors = [0.0 if math.isnan(error) else float(error) for error in (line.stderr, line.intercept_stderr)]
        reach = [float(stats.t.ppf((1 + CONFIDENCE) / 2, x.size - 2)) * error for error in errors]
    else:
        reach = [math.nan, math.nan]
    slope, intercept = float(line.slope), float(line.intercept)
    return StraightLine(
        slope, slope - reach[0], slope + reach[0], intercept, intercept - reach[1], intercept + reach[1], int(x.size)
    )


def power_law(normal_load: npt.ArrayLike, friction: npt.ArrayLike) -> PowerLawFit:
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
    load, coefficient = checked("normal_load", normal_load, above=0), checked("friction", friction, above=0)
    if load.ndim != 1 or load.shape != coefficient.shape or load.size < 3:
        raise InputError(
            f"normal_load has shape {load.shape} and friction {coefficient.shape}; expected two lists of one length ≥ 3"
        )
    if np.ptp(load) == 0:
        raise InputError(f"normal_load is {load[0]:g} N throughout; expected several loads")
    return through_logarithms(load, coefficient)


def through_logarithms(normal_load: Floats, values: Floats) -> PowerLawFit:
    """Return the power law through positive values (load) at two or more loads [N], of which not all are equal."""
    line = straight_line(np.log(normal_load), np.log(values))
    return PowerLawFit(line.slope, line.slope_low, line.slope_high, math.exp(line.intercept))
