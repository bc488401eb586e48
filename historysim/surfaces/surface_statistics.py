"""Statistics of a height map: heights, slopes and curvatures, autocorrelation.

The functions take what a `Surface` has checked; its methods say what they return. A profile, (n, 1) or (1, n), has
statistics along its long axis only.
"""

import math
from typing import Literal, NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Floats, checked
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
    #: Rz: highest minus lowest point of the whole map [m]: Sz of ISO 25178-2, not the mean over sampling lengths.
    height_range: float
    skewness: float  #: third moment of the heights over Rq³ [1], 0 for a Gaussian surface; NaN where all are equal
    kurtosis: float  #: fourth moment of the heights over Rq⁴ [1], 3 for a Gaussian surface; NaN where all are equal
    #: σ_s [1]: root mean square of s = (s_x + s_y)/2 with s_x = |z(x) - z(x+1)|/p_x; s = s_x on a profile. NaN where
    #: there are no neighbours.
    rms_slope: float
    #: σ_κ [1/m]: root mean square of κ = (κ_x + κ_y)/2 with κ_x = |z(x-1) - 2z + z(x+1)|/p_x², likewise κ_y; κ = κ_x on
    #: a profile. NaN where there are no neighbours on both sides.
    rms_curvature: float
    #: m0 = Rq², and m2 and m4 from the same differences with their sign: the mean of x and y of their mean squares.
    #: Differences over a pixel miss what is shorter than a few pixels, so that they are lower limits.
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

    lags_x: Floats  #: (lag) Along x [m], from minus to plus half the length of the surface; 0 alone across a profile.
    lags_y: Floats  #: (lag) Likewise along y.
    #: (lag_x, lag_y) ρ [1], 1 at lag 0; NaN at lags that no two present points have.
    values: Floats = attrs.field(repr=False)

    def length(self, axis: Axis, level: float = 0.1) -> float:
        """Return the autocorrelation length along an axis [m]: the first lag at which ρ falls to a level, -1 to 1.

        Linear between the lags; NaN where ρ stays above the level. Another axis or level is an InputError.
        """
        if axis not in ("x", "y"):
            raise InputError(f"axis is {axis!r}; expected 'x' or 'y'")
        target = float(checked("level", level, least=-1))
        if target >= 1:
            raise InputError(f"level is {target:g}; expected less than 1, where every surface starts at lag 0")
        zero_x, zero_y = self.lags_x.size // 2, self.lags_y.size // 2
        lags = (self.lags_x if axis == "x" else self.lags_y)[zero_x if axis == "x" else zero_y :]
        values = self.values[zero_x:, zero_y] if axis == "x" else self.values[zero_x, zero_y:]
        known = ~np.isnan(values)
        lags, values = lags[known], values[known]
        fallen = np.flatnonzero(values <= target)
        if fallen.size == 0:
            return math.nan
        ends = slice(fallen[0] - 1, fallen[0] + 1)
        return float(np.interp(-target, -values[ends], lags[ends]))

    @property
    def lay(self) -> float:
        """γ [1]: autocorrelation length along x over that along y, at 0.1; NaN where there is none."""
        return self.length("x") / self.length("y")


def height_statistics(z: Floats, pixel_size: Pixel, *, periodic: bool) -> HeightStatistics:
    """Return the statistics of heights, slopes and curvatures; see `Surface.statistics`."""
    present = z[~np.isnan(z)]
    mean, deviation = _centred(present)
    rms = math.sqrt(_mean_square(deviation))
    standard = deviation / rms if rms else np.full(1, np.nan)
    square = standard * standard
    rms_slope, m2 = _differences(z, pixel_size, 1, periodic)
    rms_curvature, m4 = _differences(z, pixel_size, 2, periodic)
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
    deviation[present] = _centred(z[present])[1]
    greatest = np.abs(deviation).max()
    if greatest == 0:
        raise InputError("all heights are equal; expected a rough surface, since a flat one has no autocorrelation")
    # squares of nanometres keep their digits
    deviation /= greatest
    # half the length of zeros behind the map keeps the lags up to half the length apart from their mirror images
    shape = z.shape if periodic else tuple(fft.next_fast_len(n + n // 2, real=True) for n in z.shape)
    steps = [np.arange(-(n // 2), n // 2 + 1) for n in z.shape]
    # negative lags stand at the end of the transform, where negative indices point
    pairs = np.rint(_products(present, shape)[np.ix_(*steps)])
    values = _products(deviation, shape)[np.ix_(*steps)]
    values /= np.where(pairs > 0, pairs, np.nan)
    values /= values[z.shape[0] // 2, z.shape[1] // 2]
    return Autocorrelation(steps[0] * pixel_size[0], steps[1] * pixel_size[1], values)


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan


def _centred(values: Floats) -> tuple[float, Floats]:
    """Return the mean, and the values less the mean: exactly 0 where all are equal, which rounding might prevent."""
    first = values.flat[0]
    deviation: Floats = values - first
    above = float(np.mean(deviation))
    deviation -= above
    return float(first + above), deviation


def _mean_square(values: Floats) -> float:
    present = values[~np.isnan(values)]
    return float(np.mean(np.square(present))) if present.size else math.nan


def _differences(z: Floats, pixel: Pixel, order: int, periodic: bool) -> tuple[float, float]:
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


def _products(values: npt.NDArray[np.generic], shape: tuple[int, ...]) -> Floats:
    """Return the sum over the products of values one lag apart, for all lags on a periodic grid of this shape."""
    from scipy import fft

    waves = fft.rfft2(values, shape)
    products: Floats = fft.irfft2(waves.real**2 + waves.imag**2, shape)
    return products
