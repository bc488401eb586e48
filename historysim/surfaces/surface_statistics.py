"""Statistics of a height map: heights, slopes and curvatures, autocorrelation, power spectral density.

Axis 0 of a map runs along x, axis 1 along y; NaN marks missing points. A profile, (n, 1) or (1, n), has statistics
along its long axis only. The functions take what a `Surface` has checked; its methods say what they return.
"""

import math
from typing import Literal

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.frozen_arrays import FrozenArrays
from historysim.errors import InputError
from historysim.surfaces.form import fit_form

Axis = Literal["x", "y"]
Curve = tuple[Floats, Floats]
Pixel = tuple[float, float]

RINGS_PER_DECADE = 10


@attrs.frozen
class SpectralMoments:
    """Spectral moments of the profiles of a surface, and the summits of a Gaussian surface that has them.

    The surface of the closed forms is isotropic, Gaussian and continuous (Longuet-Higgins, *Phil. Trans. R. Soc. A* 249
    (1957) 321-387; Nayak, *J. Lubr. Technol.* 93 (1971) 398-407). NaN stands for what has no value.

    Attributes
    ----------
    m0, m2, m4 : float
        Variance of the height [m²], mean square slope [1] and curvature [1/m²] of a profile.
    """

    m0: float
    m2: float
    m4: float

    @property
    def alpha(self) -> float:
        """Nayak's bandwidth parameter α = m0 m4 / m2² [1]: 3/2 or more for an isotropic surface."""
        return _ratio(self.m0 * self.m4, self.m2 * self.m2)

    @property
    def summit_density(self) -> float:
        """Summits per area [1/m²]: m4 / (6 π √3 m2)."""
        return _ratio(self.m4, 6 * math.pi * math.sqrt(3) * self.m2)

    @property
    def mean_summit_height(self) -> float:
        """Mean height of the summits over the mean plane [m]: 4 √m0 / √(π α)."""
        return _ratio(4 * math.sqrt(self.m0), math.sqrt(math.pi * self.alpha))

    @property
    def mean_summit_curvature(self) -> float:
        """Mean over the summits of their mean curvature [1/m], positive: 8 √m4 / (3 √π)."""
        return 8 * math.sqrt(self.m4) / (3 * math.sqrt(math.pi))


@attrs.frozen
class HeightStatistics:
    """Heights, slopes and curvatures of a surface, from `Surface.statistics`.

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
        root = _ratio(self.rms_height * self.rms_curvature, self.rms_slope * self.rms_slope)
        return root * root


@attrs.frozen(eq=False, getstate_setstate=False)
class Autocorrelation(FrozenArrays):
    """Autocorrelation function ρ of a surface, from `Surface.autocorrelation`.

    Attributes
    ----------
    lags_x, lags_y : array (lag)
        Lags along x and y [m], from minus to plus half the length of the surface; 0 alone across a profile.
    values : array (lag_x, lag_y)
        ρ [1]: 1 at lag 0, and ρ(-lag) = ρ(lag). NaN at lags that no two present points have.
    """

    lags_x: Floats
    lags_y: Floats
    values: Floats = attrs.field(repr=False)

    def along_x(self) -> Curve:
        """Return the lags along x from 0 up [m], and ρ at them."""
        return self._along("x")

    def along_y(self) -> Curve:
        """Return the lags along y from 0 up [m], and ρ at them."""
        return self._along("y")

    def length(self, axis: Axis, level: float = 0.1) -> float:
        """Return the autocorrelation length along an axis [m]: the first lag at which ρ falls to a level.

        Parameters
        ----------
        axis : {"x", "y"}
            The axis.
        level : float
            The level [1], from -1 to below 1; 0.1 and 1/e are usual.

        Returns
        -------
        float
            Interpolated linearly between the lags that have a value; NaN where ρ stays above the level at all lags.

        Raises
        ------
        InputError
            Another axis, or a level out of range.
        """
        if axis not in ("x", "y"):
            raise InputError(f"axis is {axis!r}; expected 'x' or 'y'")
        target = float(checked("level", level, least=-1))
        if target >= 1:
            raise InputError(f"level is {target:g}; expected less than 1, where every surface starts at lag 0")
        lags, values = self._along(axis)
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

    def radial(self) -> Curve:
        """Return ρ averaged over all directions: the mean lag of each ring [m], and the mean of ρ in it.

        Rings are as wide as the shorter pixel, and reach to half the shorter length of the surface. Lags without a
        value are left out.
        """
        axes = [lags for lags in (self.lags_x, self.lags_y) if lags.size > 1]
        width = min(lags[1] - lags[0] for lags in axes)
        count = round(min(lags[-1] for lags in axes) / width)
        lag = np.hypot(self.lags_x[:, None], self.lags_y[None, :])
        return _ring_means(lag, self.values, (np.arange(count + 2) - 0.5) * width)

    def _along(self, axis: Axis) -> Curve:
        zero_x, zero_y = self.lags_x.size // 2, self.lags_y.size // 2
        if axis == "x":
            return self.lags_x[zero_x:], self.values[zero_x:, zero_y]
        return self.lags_y[zero_y:], self.values[zero_x, zero_y:]


@attrs.frozen(eq=False, getstate_setstate=False)
class PowerSpectralDensity(FrozenArrays):
    """Power spectral density C of a surface, from `Surface.power_spectral_density`.

    C = |∫∫ z exp(-i (q_x x + q_y y)) dx dy|² / area, so that ∫∫ C dq_x dq_y / (2π)² = Rq²: the convention of Jacobs,
    Junge & Pastewka, *Surf. Topogr. Metrol. Prop.* 5 (2017) 013001.

    Attributes
    ----------
    q_x, q_y : array (wavevector)
        Wavevectors along x and y [rad/m], rising, of both signs, 2π over the length of the surface apart; 0 alone
        across a profile. The shortest wave, of two pixels, stands once, as -π over the pixel size.
    values : array (q_x, q_y)
        C [m⁴], and C(-q) = C(q). Across a profile it holds the pixel size as width: see `along_x` for [m³].
    size : (float, float)
        Length of the surface along x and y [m].
    """

    q_x: Floats
    q_y: Floats
    values: Floats = attrs.field(repr=False)
    size: tuple[float, float]

    def along_x(self) -> Curve:
        """Return the wavevectors q_x from 0 up [rad/m], and the density of the profiles along x [m³].

        This is C1 = ∫ C dq_y / (2π), of a periodic map the mean over its profiles, with ∫ C1 dq_x / (2π) = Rq² over
        both signs of q_x.
        """
        return _half(self.q_x, self.values.sum(axis=1) / self.size[1])

    def along_y(self) -> Curve:
        """Return the wavevectors q_y from 0 up [rad/m], and the density of the profiles along y [m³]; see `along_x`."""
        return _half(self.q_y, self.values.sum(axis=0) / self.size[0])

    def radial(self) -> Curve:
        """Return C averaged over all directions: the mean |q| of each ring [rad/m], and the mean of C in it [m⁴].

        The rings, ten a decade, reach from the longest wave of the map to two of the larger pixels. Where the lengths
        of the surface differ, the innermost hold few directions.

        Raises
        ------
        InputError
            A profile.
        """
        if 1 in self.values.shape:
            raise InputError("a profile has no directions to average over; expected a map, or use along_x or along_y")
        first = 2 * math.pi / max(self.size)
        last = math.pi * min(q.size / length for q, length in zip((self.q_x, self.q_y), self.size, strict=True))
        edges = np.geomspace(first, last, max(1, round(RINGS_PER_DECADE * math.log10(last / first))) + 1)
        # a wave at an edge belongs to the ring that begins there, and the last one to the last, whatever the rounding
        edges *= 1 - 1e-9
        edges[-1] = last * (1 + 1e-9)
        return _ring_means(np.hypot(self.q_x[:, None], self.q_y[None, :]), self.values, edges)


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
    deviation /= greatest
    # half the length of zeros behind the map keeps the lags up to half the length apart from their mirror images
    shape = z.shape if periodic else tuple(fft.next_fast_len(n + n // 2, real=True) for n in z.shape)
    steps = [np.arange(-(n // 2), n // 2 + 1) for n in z.shape]
    # negative lags stand at the end of the transform, where negative indices point
    pairs = np.rint(_products(present, shape)[np.ix_(*steps)])
    values = _products(deviation, shape)[np.ix_(*steps)]
    values /= np.where(pairs > 0, pairs, np.nan)
    values /= values[z.shape[0] // 2, z.shape[1] // 2]
    return Autocorrelation(*(_frozen(array) for array in (steps[0] * pixel_size[0], steps[1] * pixel_size[1], values)))


def power_spectral_density(z: Floats, pixel_size: Pixel, *, periodic: bool) -> PowerSpectralDensity:
    """Return the power spectral density of the heights; see `Surface.power_spectral_density`."""
    from scipy import fft

    if missing := int(np.isnan(z).sum()):
        raise InputError(
            f"{missing:,} of {z.size:,} heights are missing; a power spectral density needs them all: fill them, or "
            "crop the map to a part without gaps, before"
        )
    deviation = _centred(z)[1]
    if not periodic:
        deviation -= fit_form(deviation, pixel_size, "plane").heights
        deviation *= np.outer(_hann(z.shape[0]), _hann(z.shape[1]))
    power = _square(fft.rfft2(deviation)) * (pixel_size[0] * pixel_size[1] / z.size)
    waves_x, waves_y = (np.arange(n) - n // 2 for n in z.shape)
    # the transform of real heights comes with q_y ≥ 0 only; the other half is that of -q
    negative, positive = np.ix_(-waves_x, -waves_y[waves_y < 0]), np.ix_(waves_x, waves_y[waves_y >= 0])
    size = z.shape[0] * pixel_size[0], z.shape[1] * pixel_size[1]
    return PowerSpectralDensity(
        _frozen(waves_x * (2 * math.pi / size[0])),
        _frozen(waves_y * (2 * math.pi / size[1])),
        _frozen(np.concatenate([power[negative], power[positive]], axis=1)),
        size,
    )


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

    result: Floats = fft.irfft2(_square(fft.rfft2(values, shape)), shape)
    return result


def _square(values: npt.NDArray[np.complex128]) -> Floats:
    """Return |values|²."""
    square: Floats = values.real**2 + values.imag**2
    return square


def _hann(count: int) -> Floats:
    """Return the Hann window over the square root of its mean square; 1 for the single point across a profile."""
    window = np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2
    result: Floats = window / np.sqrt(np.mean(window**2))
    return result


def _half(q: Floats, density: Floats) -> Curve:
    """Return both from wavevector 0 up, read from the negative side, which alone has the shortest wave."""
    zero = q.size // 2
    return np.abs(q[zero::-1]), density[zero::-1]


def _ring_means(radius: Floats, values: Floats, edges: Floats) -> Curve:
    """Return the mean radius and the mean of the values in each ring that is not empty."""
    ring = np.searchsorted(edges, radius)
    inside = (ring > 0) & (ring < edges.size) & ~np.isnan(values)
    ring = ring[inside] - 1
    count, radii, sums = (np.bincount(ring, weights) for weights in (None, radius[inside], values[inside]))
    filled = count > 0
    return radii[filled] / count[filled], sums[filled] / count[filled]


def _frozen(values: Floats) -> Floats:
    values.flags.writeable = False
    return values
