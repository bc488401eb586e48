"""What the statistics of height maps have in common: the map that came, its heights about their mean, and rings."""

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import per_axis
from historysim.basics.array_types import Floats
from historysim.errors import InputError

Curve = tuple[Floats, Floats]


def checked_map(heights: npt.ArrayLike, pixel_size: npt.ArrayLike) -> tuple[Floats, tuple[float, float]]:
    """Return the heights (nx, ny) and the pixel size along x and y, both [m], as floats.

    Raises
    ------
    InputError
        Heights that are not a map of numbers, infinite or all missing; a pixel size that is not positive.
    """
    try:
        z = np.asarray(heights, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("heights are not numbers; expected an array (nx, ny) of heights in m") from error
    if z.ndim != 2 or z.size == 0:
        raise InputError(f"heights have shape {z.shape}; expected (nx, ny), or (n, 1) for a profile along x")
    if np.isinf(z).any():
        raise InputError("some heights are infinite; expected finite ones, and NaN where they are missing")
    if np.isnan(z).all():
        raise InputError("all heights are missing; expected some that are numbers")
    return z, per_axis("pixel_size", pixel_size)


def centred(values: Floats) -> tuple[float, Floats]:
    """Return the mean, and the values less the mean: exactly 0 where all are equal, which rounding might prevent."""
    first = values.flat[0]
    deviation: Floats = values - first
    above = float(np.mean(deviation))
    deviation -= above
    return float(first + above), deviation


def ring_means(radius: Floats, values: Floats, edges: Floats) -> Curve:
    """Return the mean radius and the mean of the values in each ring that is not empty."""
    ring = np.searchsorted(edges, radius)
    inside = (ring > 0) & (ring < edges.size) & ~np.isnan(values)
    ring = ring[inside] - 1
    count, radii, sums = (np.bincount(ring, weights) for weights in (None, radius[inside], values[inside]))
    filled = count > 0
    return radii[filled] / count[filled], sums[filled] / count[filled]


def frozen(values: Floats) -> Floats:
    """Return the same array, which can no longer be written to."""
    values.flags.writeable = False
    return values


def square(values: npt.NDArray[np.complex128]) -> Floats:
    """Return |values|²."""
    square: Floats = values.real**2 + values.imag**2
    return square
