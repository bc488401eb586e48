"""Statistics of a height map: heights, slopes and curvatures, autocorrelation.

The functions expect the validated heights of a `Surface`, whose methods document the results. A
profile, (n, 1) or (1, n), has statistics along its long axis only.
"""

import math
from typing import Literal, NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Floats, as_floats
from historysim.errors import InputError

Axis = Literal["x", "y"]
Pixel = tuple[float, float]


class SpectralMoments(NamedTuple):
    """Spectral moments of the profiles of a surface (Longuet-Higgins 1957; Nayak 1971)."""

    m0: float  #: variance of the height [m²]
    m2: float  #: mean square slope [1]
    m4: float  #: mean square curvature [1/m²]

    @property
    def alpha(self) -> float:
        """Nayak's bandwidth parameter α = m0 m4 / m2² [1]: 3/2 or more for an isotropic surface; NaN without slopes."""
        return _ratio(self.m0 * self.m4, self.m2 * self.m2)


@attrs.frozen
class HeightStatistics:
    """Heights, slopes and curvatures of a surface, from `Surface.statistics`."""

    mean: float  #: mean height over the datum [m]
    rms_height: float  #: Rq, or σ_z: root mean square height about the mean [m]
    mean_deviation: float  #: Ra: mean absolute height about the mean [m]
    #: Rz: highest minus lowest point of the whole map [m]: Sz of ISO 25178-2, not the mean over
    #: sampling lengths.
    height_range: float
    #: third moment of the heights over Rq³ [1], 0 for a Gaussian surface; NaN where all are equal
    skewness: float
    #: fourth moment of the heights over Rq⁴ [1], 3 for a Gaussian surface; NaN where all are equal
    kurtosis: float
    #: σ_s [1]: root mean square of s = (s_x + s_y)/2 with s_x = |z(x) - z(x+1)|/p_x; s = s_x on a
    #: profile. NaN if no point has a neighbour.
    rms_slope: float
    #: σ_κ [1/m]: root mean square of κ = (κ_x + κ_y)/2 with κ_x = |z(x-1) - 2z + z(x+1)|/p_x²,
    #: likewise κ_y; κ = κ_x on a profile. NaN if no point has neighbours on both sides.
    rms_curvature: float
    #: m0 = Rq², and m2 and m4 from the same differences with their sign: the mean of x and y of their mean squares.
    #: Differences over a pixel miss waves shorter than a few pixels, so that they are lower limits.
    moments: SpectralMoments
    missing_fraction: float  #: missing points over all points [1]

    @property
    def bandwidth(self) -> float:
        """ψ = (σ_z σ_κ / σ_s²)² [1]: α of a profile, 1.2487 α of an isotropic Gaussian map; NaN without slopes."""
        # s and κ average absolute values of x and y, so that ψ is not Nayak's α:
        # ψ/α = 2 (1 + (2/π) (√8 + asin(1/3))/3) / (1 + 2/π)²
        root = _ratio(self.rms_height * self.rms_curvature, self.rms_slope * self.rms_slope)
        return root * root


@attrs.frozen(eq=False)
class Autocorrelation:
    """Autocorrelation function ρ of a surface, from `Surface.autocorrelation`."""

    #: (lag) Along x [m], from minus to plus half the length of the surface; 0 alone across a
    #: profile.
    lags_x: Floats
    lags_y: Floats  #: (lag) Likewise along y.
    #: (lag_x, lag_y) ρ [1], 1 at lag 0; NaN at lags that no two present points have.
    values: Floats = attrs.field(repr=False)

    def length(self, axis: Axis, level: float = 0.1) -> float:
        """Return the autocorrelation length along an axis [m]: the first lag at which ρ falls to a level, -1 to 1.

        Linear between the lags; NaN if ρ stays above the level. InputError for another axis or
        level.
        """
        if axis not in ("x", "y"):
            raise InputError(f"axis is {axis!r}; expected 'x' or 'y'")
        target = float(as_floats("level", level, least=-1))
        if target >= 1:
            raise InputError(f"level is {target:g}; expected less than 1, the value at lag 0")
        zero_x, zero_y = self.lags_x.size // 2, self.lags_y.size // 2
        lags = (self.lags_x if axis == "x" else self.lags_y)[zero_x if axis == "x" else zero_y :]
        values = self.values[zero_x:, zero_y] if axis == "x" else self.values[zero_x, zero_y:]
        present = ~np.isnan(values)
        lags, values = lags[present], values[present]
        fallen = np.flatnonzero(values <= target)
        if fallen.size == 0:
            return math.nan
        ends = slice(fallen[0] - 1, fallen[0] + 1)
        return float(np.interp(-target, -values[ends], lags[ends]))

    @property
    def lay(self) -> float:
        """Lay γ [1]: ratio of the autocorrelation lengths along x and y, at 0.1; NaN if one is not reached."""
        return self.length("x") / self.length("y")


def height_statistics(z: Floats, pixel_size: Pixel, *, periodic: bool) -> HeightStatistics:
    """Return the statistics of heights, slopes and curvatures; see `Surface.statistics`."""
    present = z[~np.isnan(z)]
    mean, deviation = _split_mean(present)
    rms = math.sqrt(_mean_square(deviation))
    standard = deviation / rms if rms else np.full(1, np.nan)
    square = standard * standard
    rms_slope, m2 = _difference_moments(z, pixel_size, 1, periodic)
    rms_curvature, m4 = _difference_moments(z, pixel_size, 2, periodic)
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


def autocorrelation(z: Floats, pixel_size: Pixel, *, periodic: bool) -> Autocorrelation:
    """Return the autocorrelation function of the heights about their mean; see `Surface.autocorrelation`."""
    from scipy import fft

    present = ~np.isnan(z)
    deviation = np.zeros(z.shape)
    deviation[present] = _split_mean(z[present])[1]
    greatest = np.abs(deviation).max()
    if greatest == 0:
        raise InputError(
            "all heights are equal; expected a rough surface, since a flat one has no autocorrelation"
        )
    # scaled by the maximum, so that squares keep their digits
    deviation /= greatest
    # zero padding by half the length separates lags up to half the length from their periodic
    # images
    shape = (
        z.shape if periodic else tuple(fft.next_fast_len(n + n // 2, real=True) for n in z.shape)
    )
    steps = [np.arange(-(n // 2), n // 2 + 1) for n in z.shape]
    # negative lags are at the end of the transform, as negative indices
    pairs = np.rint(_sum_products(present, shape)[np.ix_(*steps)])
    values = _sum_products(deviation, shape)[np.ix_(*steps)]
    values /= np.where(pairs > 0, pairs, np.nan)
    values /= values[z.shape[0] // 2, z.shape[1] // 2]
    return Autocorrelation(steps[0] * pixel_size[0], steps[1] * pixel_size[1], values)


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else math.nan


def _split_mean(values: Floats) -> tuple[float, Floats]:
    """Return the mean and the deviations from it, which are exactly 0 if all values are equal."""
    reference = values.flat[0]
    deviation: Floats = values - reference
    above = float(np.mean(deviation))
    deviation -= above
    return float(reference + above), deviation


def _mean_square(values: Floats) -> float:
    present = values[~np.isnan(values)]
    return float(np.mean(np.square(present))) if present.size else math.nan


def _difference_moments(z: Floats, pixel: Pixel, order: int, periodic: bool) -> tuple[float, float]:
    """Return σ_s and m2 from first differences of neighbours (order 1), or σ_κ and m4 from second differences."""
    axes = [axis for axis in (0, 1) if z.shape[axis] > 1]
    if not axes:
        return math.nan, math.nan
    differences = []
    for axis in axes:
        border = [(order - 1, 1) if along == axis else (0, 0) for along in (0, 1)]
        around = np.pad(z, border, mode="wrap") if periodic else z
        differences.append(np.diff(around, n=order, axis=axis) / pixel[axis] ** order)
    moment = sum(map(_mean_square, differences)) / len(differences)
    if len(axes) == 2 and not periodic:
        # only points that have a difference along both axes
        differences = [differences[0][:, order - 1 : -1], differences[1][order - 1 : -1, :]]
    average = (
        np.abs(differences[0])
        if len(differences) == 1
        else (np.abs(differences[0]) + np.abs(differences[1])) / 2
    )
    return math.sqrt(_mean_square(average)), moment


def _sum_products(values: npt.NDArray[np.generic], shape: tuple[int, ...]) -> Floats:
    """Return the sum of products of values at each lag, on a periodic grid of this shape."""
    from scipy import fft

    waves = fft.rfft2(values, shape)
    products: Floats = fft.irfft2(waves.real**2 + waves.imag**2, shape)
    return products
