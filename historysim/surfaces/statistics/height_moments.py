"""Moments of the heights, slopes and curvatures of a height map."""

import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats
from historysim.surfaces.statistics.centred_map import centred, checked_map
from historysim.surfaces.statistics.spectral_moments import SpectralMoments, ratio


@attrs.frozen
class HeightStatistics:
    """Heights, slopes and curvatures of a surface, from `height_statistics`.

    Attributes
    ----------
    mean : float
        Mean height over the datum [m].
    rms_height : float
        Rq, or σ_z: root mean square height about the mean [m].
    mean_deviation : float
        Ra: mean absolute height about the mean [m].
    height_range : float
        Rz: highest minus lowest point of the whole map [m]. This is Sz of ISO 25178-2, not the mean over sampling
        lengths of ISO 21920-2.
    skewness, kurtosis : float
        Third and fourth moment of the heights over Rq³ and Rq⁴ [1]: 0 and 3 for a Gaussian surface. NaN where all
        heights are equal.
    rms_slope : float
        σ_s [1]: root mean square of s = (s_x + s_y)/2 with s_x = |z(x) - z(x+1)|/p_x, likewise s_y; s = s_x on a
        profile. NaN where there are no neighbours.
    rms_curvature : float
        σ_κ [1/m]: root mean square of κ = (κ_x + κ_y)/2 with κ_x = |z(x-1) - 2z + z(x+1)|/p_x², likewise κ_y;
        κ = κ_x on a profile. NaN where there are no neighbours on both sides.
    moments : SpectralMoments
        m0 = Rq², and m2 and m4 from the same differences with their sign: the mean of x and y of their mean squares.
        Differences over a pixel miss what is shorter than a few pixels, so that they are lower limits.
    missing_fraction : float
        Missing points over all points [1].
    """

    mean: float
    rms_height: float
    mean_deviation: float
    height_range: float
    skewness: float
    kurtosis: float
    rms_slope: float
    rms_curvature: float
    moments: SpectralMoments
    missing_fraction: float

    @property
    def bandwidth(self) -> float:
        """ψ = (σ_z σ_κ / σ_s²)² [1]; NaN without slopes.

        Since s and κ average absolute values of x and y, ψ differs from Nayak's α even where x and y do not: for an
        isotropic Gaussian surface ψ/α = 2 (1 + (2/π) (√8 + asin(1/3))/3) / (1 + 2/π)² = 1.2487. On a profile ψ = α.
        """
        root = ratio(self.rms_height * self.rms_curvature, self.rms_slope * self.rms_slope)
        return root * root


def height_statistics(heights: npt.ArrayLike, pixel_size: npt.ArrayLike, *, periodic: bool = False) -> HeightStatistics:
    """Return the statistics of heights, slopes and curvatures.

    A difference counts where all its points are present, also across the border of a periodic surface; s and κ where
    their differences along x and y are both there.

    Parameters
    ----------
    heights : array_like (nx, ny)
        Heights [m]; NaN where missing.
    pixel_size : float or (float, float)
        Distance between the points along x and y [m], > 0.
    periodic : bool
        Whether the surface repeats.

    Raises
    ------
    InputError
        Heights that are not a map or all missing, or a pixel size out of range.
    """
    z, pixel = checked_map(heights, pixel_size)
    present = z[~np.isnan(z)]
    mean, deviation = centred(present)
    rms = math.sqrt(_mean_square(deviation))
    standard = deviation / rms if rms else np.full(1, np.nan)
    square = standard * standard
    rms_slope, m2 = _differences(z, pixel, 1, periodic)
    rms_curvature, m4 = _differences(z, pixel, 2, periodic)
    return HeightStatistics(
        mean=mean,
        rms_height=rms,
        mean_deviation=float(np.mean(np.abs(deviation))),
        height_range=float(np.ptp(present)),
        skewness=float(np.mean(square * standard)),
        kurtosis=float(np.mean(square * square)),
        rms_slope=rms_slope,
        rms_curvature=rms_curvature,
        moments=SpectralMoments(rms**2, m2, m4),
        missing_fraction=1 - present.size / z.size,
    )


def _mean_square(values: Floats) -> float:
    present = values[~np.isnan(values)]
    return float(np.mean(np.square(present))) if present.size else math.nan


def _differences(z: Floats, pixel: tuple[float, float], order: int, periodic: bool) -> tuple[float, float]:
    """Return σ_s and m2 from the first differences of neighbours, or σ_κ and m4 from the second ones."""
    axes = [axis for axis in (0, 1) if z.shape[axis] > 1]
    if not axes:
        return math.nan, math.nan
    found = []
    for axis in axes:
        border = [(order - 1, 1) if along == axis else (0, 0) for along in (0, 1)]
        around = np.pad(z, border, mode="wrap") if periodic else z
        found.append(np.diff(around, n=order, axis=axis) / pixel[axis] ** order)
    moment = sum(map(_mean_square, found)) / len(found)
    if len(axes) == 2 and not periodic:
        # only where there is a difference along the other axis at the same point
        found = [found[0][:, order - 1 : -1], found[1][order - 1 : -1, :]]
    average = np.abs(found[0]) if len(found) == 1 else (np.abs(found[0]) + np.abs(found[1])) / 2
    return math.sqrt(_mean_square(average)), moment
