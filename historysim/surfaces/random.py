"""Random surfaces of prescribed rms height, autocorrelation, skewness and kurtosis.

Heights of prescribed skewness and kurtosis are translated Gaussian heights. With y = z/δ of a standard normal z, up to
a scale and an origin, a translation is

    bounded (SB):     (e^y - 1)/(1 + κ e^y)
    log-normal (SL):  e^y - 1, the limit of both others at κ = 0
    unbounded (SU):   (e^y - 1) - κ (e^-y - 1)

with 0 ≤ κ ≤ 1: κ is e^(-γ/δ) for SB and e^(2γ/δ) for SU, in terms of Johnson's γ. These skew to the right, mirrored
translations to the left. Every pair with kurtosis > skewness² + 1 belongs to exactly one translation.

Johnson, *Biometrika* 36 (1949) 149-176.
"""

import math
from collections.abc import Callable
from typing import SupportsIndex

import attrs
import numpy as np
import scipy.fft

from historysim.basics.arguments import ArrayLike, Floats, per_axis, scalar
from historysim.basics.units import quantity_text, warn_unlikely
from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.surfaces.distribution import generator
from historysim.surfaces.heights import MOST_POINTS, Surface

MOST_KURTOSIS = 100.0
MOST_SHARPNESS = 10.0  # of bounded heights: a larger 1/δ gives two levels with hardly a slope between them
HEAVIEST_SHARPNESS = 1.5  # 1/δ at which unbounded heights exceed `MOST_KURTOSIS`, at any skewness
LEAST_SHARPNESS = 1e-5  # below it the kurtosis differs from 3 by less than 4/δ² = 4e-10
MOST_SHIFT = 40.0  # of -ln κ, beyond which κ is negligible

# The trapezoidal rule converges as exp(-2π²/(s h)) with s = 1/δ, since the poles of SB are π/s off the axis; the range
# covers the fourth powers of SU; their weight z² /2 - 4 s z is least at z = 4 s ≤ 6.
NODES = np.linspace(-16, 16, 1601)
WEIGHTS = np.exp(-(NODES**2) / 2) / np.exp(-(NODES**2) / 2).sum()

# The powers of SB decrease as exp(-2 √n π/s), to 1e-14 within these terms; the powers of SU faster than exponentially.
HERMITE_REST, MOST_HERMITE_TERMS = 1e-14, 2600
KNOTS = 8193  # of the splines of `Translation.correlations`, from a correlation of 0 to 1


@attrs.frozen
class Translation:
    """Increasing function of standard normal numbers, up to a scale and an origin; see above for 1/δ and κ."""

    bounded: bool  #: SB, otherwise SU
    sharpness: float  #: 1/δ [1], > 0
    kappa: float  #: κ [1], from 0 (log-normal) to 1 (symmetric)
    mirrored: bool = False  #: skews to the left

    def __call__(self, normal: Floats) -> Floats:
        """Translate standard normal numbers."""
        y = (-self.sharpness if self.mirrored else self.sharpness) * normal
        right = np.expm1(y)
        if self.bounded:
            right /= 1 + self.kappa * (1 + right)
        elif self.kappa:
            right -= self.kappa * np.expm1(-y)
        return -right if self.mirrored else right

    def moments(self) -> tuple[float, float]:
        """Return the skewness and the kurtosis of the translated numbers."""
        translated = self._standard()
        return float(np.sum(WEIGHTS * translated**3)), float(np.sum(WEIGHTS * translated**4))

    def correlations(self) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
        """Return the correlation of translated numbers as a function of the normal correlation ρ, and its inverse.

        R(ρ) = Σ b_n² ρ^n from -1 to 1, with the coefficients b_n of the translation in normalised Hermite
        polynomials (Mehler's formula; Grigoriu, *Applied Non-Gaussian Processes*, 1995); the inverse is from 0 to 1.
        """
        from scipy.interpolate import CubicSpline

        powers = self._hermite_powers()

        def series(correlation: Floats) -> Floats:
            total = np.zeros_like(correlation)
            for power in powers[::-1]:
                total = (total + power) * correlation
            return total

        # knots at a sine, since R approaches R(1) = 1 as a square root if the translation is steep
        normal = np.sin(np.linspace(-math.pi / 2, math.pi / 2, 2 * KNOTS - 1))
        translated = series(normal)
        return CubicSpline(normal, translated), CubicSpline(translated[KNOTS - 1 :], normal[KNOTS - 1 :])

    def _hermite_powers(self) -> Floats:
        """Return b_n² for n = 1, 2, …, with the sum 1."""
        root = np.sqrt(WEIGHTS)
        translated = self._standard()
        powers: list[float] = []
        previous, current, remaining_power = np.zeros_like(root), root, 1.0
        while remaining_power > HERMITE_REST and len(powers) < MOST_HERMITE_TERMS:
            n = len(powers) + 1
            previous, current = current, (NODES * current - math.sqrt(n - 1) * previous) / math.sqrt(n)
            powers.append(float(np.sum(translated * root * current)) ** 2)
            remaining_power -= powers[-1]
        return np.array(powers) / sum(powers)

    def _standard(self) -> Floats:
        """Return the translated nodes, with mean 0 and rms 1."""
        translated = self(NODES)
        translated -= np.sum(WEIGHTS * translated)
        translated /= math.sqrt(np.sum(WEIGHTS * translated**2))
        return translated


def translation(skewness: float, kurtosis: float) -> Translation | None:
    """Return Johnson's translation to a skewness and a kurtosis, within 1e-9; None for Gaussian heights.

    InputError if no distribution has this pair, or only one close to two levels, or the kurtosis is > `MOST_KURTOSIS`.
    """
    if skewness == 0 and kurtosis == 3:
        return None
    # imported here, since most surfaces are Gaussian
    from scipy.optimize import brentq

    limit = skewness * skewness + 1
    if kurtosis < limit:
        raise InputError(
            f"kurtosis is {kurtosis:g} with a skewness of {skewness:g}; no heights have a kurtosis below "
            f"skewness² + 1 = {limit:g}: raise the kurtosis or bring the skewness closer to 0"
        )
    if kurtosis > MOST_KURTOSIS:
        raise InputError(
            f"kurtosis is {kurtosis:g}; expected at most {MOST_KURTOSIS:g}, beyond which a few single points hold all "
            "of it: lower it"
        )
    target = abs(skewness)
    lowest, log_normal_kurtosis = _log_normal(target)
    bounded = kurtosis < log_normal_kurtosis
    highest = MOST_SHARPNESS if bounded else HEAVIEST_SHARPNESS

    def surplus(sharpness: float) -> float:
        return _translation_to_skewness(target, bounded, sharpness).moments()[1] - kurtosis

    lowest = max(lowest, LEAST_SHARPNESS)
    if bounded and (over := surplus(highest)) > 0:
        raise InputError(
            f"kurtosis is {kurtosis:g} with a skewness of {skewness:g}, which leaves the heights next to two-level; "
            f"expected at least {kurtosis + over:.4g}: raise the kurtosis or bring the skewness closer to 0"
        )
    # on the log-normal line, rounding may leave both ends on the same side
    is_bracketed = surplus(lowest) * surplus(highest) < 0
    sharpness = brentq(surplus, lowest, highest, xtol=1e-14, rtol=1e-14) if is_bracketed else lowest
    return attrs.evolve(_translation_to_skewness(target, bounded, sharpness), mirrored=skewness < 0)


def _log_normal(skewness: float) -> tuple[float, float]:
    """Return the sharpness and the kurtosis of the log-normal distribution of a skewness ≥ 0."""
    # skewness² = (w - 1)(w + 2)², kurtosis = w⁴ + 2w³ + 3w² - 3, with w = 1 + u = exp(1/δ²)
    u = 4 * math.sinh(math.asinh(skewness / 2) / 3) ** 2
    return math.sqrt(math.log1p(u)), 3 + u * (16 + u * (15 + u * (6 + u)))


def _translation_to_skewness(skewness: float, bounded: bool, sharpness: float) -> Translation:
    """Solve for κ, the translation of a family and sharpness to a skewness ≥ 0, which rises as κ falls from 1 to 0."""
    from scipy.optimize import brentq

    def translation_at(shift: float) -> Translation:
        return Translation(bounded, sharpness, math.exp(-shift))

    def lack(shift: float) -> float:
        return translation_at(shift).moments()[0] - skewness

    if lack(0.0) >= 0:
        return translation_at(0.0)
    if lack(MOST_SHIFT) <= 0:
        return translation_at(MOST_SHIFT)
    return translation_at(brentq(lack, 0.0, MOST_SHIFT, xtol=1e-13, rtol=1e-14))


AUTOCORRELATIONS = ("exponential", "gaussian")
LEAST_PIXELS = 4
MOST_DEVIATION = 0.01  # of a non-Gaussian surface's autocorrelation from the prescribed one
STEEPEST = 10  # rms height over autocorrelation length, beyond that of any surface
DECAY = 2.3  # ρ falls to 0.1 at the autocorrelation length
# Images are summed up to this distance in autocorrelation lengths: an image beyond adds less than exp(-2.3 × 14) =
# 1e-14. The shortest side, two lengths, has 7 images within this distance on either side.
REACH, MOST_IMAGES = 14.0, 7
BLOCK = 2**16  # numbers per block, so that a block fits into the cache


def random_surface(
    shape: SupportsIndex | tuple[SupportsIndex, SupportsIndex],
    pixel_size: "ArrayLike",
    rms_height: float,
    autocorrelation_length: "ArrayLike",
    *,
    seed: SupportsIndex,
    autocorrelation: str = "exponential",
    skewness: float = 0.0,
    kurtosis: float = 3.0,
) -> Surface:
    """Generate a periodic random rough surface with mean height 0 and a prescribed rms height.

    Autocorrelation, skewness and kurtosis hold for the ensemble of all seeds; a single surface deviates from them, the
    more the fewer autocorrelation lengths it spans. ``historysim/contact/README.md``, "Surfaces and statistics",
    describes the method.

    Parameters
    ----------
    shape : int or (int, int)
        Number of points along x and y, 4 to 2²⁸ in all; one number gives a square, (n, 1) or (1, n) a profile.
    pixel_size : float or (float, float)
        Distance between neighbouring points along x and y [m], > 0.
    rms_height : float
        Rq [m], > 0.
    autocorrelation_length : float or (float, float)
        β along x and y [m], where ρ has fallen to 0.1; from one pixel to half the side.
    seed : int
        ≥ 0. A seed gives the same surface, bit for bit, with one version of numpy and scipy on one type of processor.
    autocorrelation : str
        ``"exponential"``: ρ = exp(-2.3 √((x/β_x)² + (y/β_y)²)), or ``"gaussian"``:
        ρ = exp(-2.3 ((x/β_x)² + (y/β_y)²)). The surface has ρ summed over all periodic images.
    skewness : float
        Third moment of the heights over Rq³ [1]; negative where valleys are deeper than peaks are high.
    kurtosis : float
        Fourth moment of the heights over Rq⁴ [1], 3 for Gaussian heights; more than skewness² + 1, and at most 100.

    Raises
    ------
    InputError
        If an argument is out of range, or no heights have this skewness and kurtosis, or not with this autocorrelation.

    Warns
    -----
    UnlikelyValueWarning
        If the rms height exceeds ten autocorrelation lengths, as if nanometres were meant.

    Examples
    --------
    >>> surface = hs.random_surface((64, 64), 1e-6, rms_height=50e-9, autocorrelation_length=10e-6, seed=1)
    >>> print(f"{surface.statistics().rms_height * 1e9:.1f} nm, {len(surface.summits(rule=9))} summits")
    50.0 nm, 282 summits
    """
    points = _check_shape(shape)
    pixel = per_axis("pixel_size", pixel_size)
    lengths = _lengths_as_pixels(points, pixel, autocorrelation_length)
    rms = scalar("rms_height", rms_height, above=0)
    width = min(length * side for length, side, n in zip(lengths, pixel, points, strict=True) if n > 1)
    if rms > STEEPEST * width:
        warn_unlikely(
            f"rms_height is {quantity_text(rms, 'm')} on an autocorrelation length of {quantity_text(width, 'm')}",
            "m",
            stacklevel=2,
        )
    noise = generator(seed)
    if autocorrelation not in AUTOCORRELATIONS:
        raise InputError(f"autocorrelation is {autocorrelation!r}; {nearest(str(autocorrelation), AUTOCORRELATIONS)}")
    translate = translation(scalar("skewness", skewness), scalar("kurtosis", kurtosis))
    spectrum = _spectrum(_periodic_autocorrelation(points, lengths, autocorrelation), points, translate)
    heights = _apply_filter(noise.standard_normal(points), np.sqrt(spectrum))
    _standardise(heights)
    if translate is not None:
        row = heights.reshape(-1)
        for start in range(0, row.size, BLOCK):
            row[start : start + BLOCK] = translate(row[start : start + BLOCK])
        _standardise(heights)
    heights *= rms
    return Surface(heights, pixel, periodic=True)


def _is_count(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and bool(value >= 1)


def _check_shape(shape: SupportsIndex | tuple[SupportsIndex, SupportsIndex]) -> tuple[int, int]:
    sides = tuple(shape) if isinstance(shape, tuple | list) else (shape, shape)
    if len(sides) != 2 or not all(_is_count(side) for side in sides):
        raise InputError(
            f"shape is {shape!r}; expected the number of points along x and y, integers of 1 or more, such as "
            "(256, 256)"
        )
    points = int(sides[0]), int(sides[1])
    if not LEAST_PIXELS <= math.prod(points) <= MOST_POINTS:
        raise InputError(
            f"shape is {points[0]} x {points[1]}; expected {LEAST_PIXELS} to {MOST_POINTS:,} points in all"
        )
    return points


def _lengths_as_pixels(
    points: tuple[int, int], pixel_size: tuple[float, float], autocorrelation_length: ArrayLike
) -> tuple[float, float]:
    """Return β in pixels; 1 on a side of one pixel, where it has no effect."""
    lengths = per_axis("autocorrelation_length", autocorrelation_length)
    result = [1.0, 1.0]
    for i, (axis, n) in enumerate(zip("xy", points, strict=True)):
        if n == 1:
            continue
        result[i] = lengths[i] / pixel_size[i]
        # tolerates rounding of the quotient of two decimal numbers
        if not 1 - 1e-12 <= result[i] <= n / 2 * (1 + 1e-12):
            remedy = "make the pixels smaller" if result[i] < 1 else "take more or larger pixels"
            raise InputError(
                f"autocorrelation_length along {axis} is {lengths[i]:g} m on {n} pixels of {pixel_size[i]:g} m; "
                f"expected from one pixel, {pixel_size[i]:g} m, to half the side, {n * pixel_size[i] / 2:g} m, on "
                f"this periodic surface: change it or {remedy}"
            )
    return result[0], result[1]


# The autocorrelation and the spectrum are even along x and y, so the quadrant x ≥ 0, y ≥ 0 determines them.


def _periodic_autocorrelation(points: tuple[int, int], lengths: tuple[float, float], kind: str) -> Floats:
    """Return a quadrant of the autocorrelation, summed over all images and 1 at the origin."""
    (x, images_x), (y, images_y) = map(_axis_points_and_images, points, lengths)
    if kind == "gaussian":
        along, across = (
            np.exp(-DECAY * np.subtract.outer(at, images) ** 2).sum(axis=1)
            for at, images in ((x, images_x), (y, images_y))
        )
        total = np.outer(along, across)
    else:
        total = _sum_of_cones(x, y, images_x, images_y)
    return np.asarray(total / total[0, 0])


def _axis_points_and_images(n: int, length: float) -> tuple[Floats, Floats]:
    """Return the points of a quadrant and the images of the origin along an axis [β]."""
    # no images along a side of one pixel, along which the surface is constant
    images = np.arange(-MOST_IMAGES, MOST_IMAGES + 1) * n if n > 1 else np.zeros(1)
    return np.arange(n // 2 + 1) / length, images / length


def _sum_of_cones(x: Floats, y: Floats, images_x: Floats, images_y: Floats) -> Floats:
    """Return Σ exp(-2.3 r) over the distances r from all images with a contribution in the quadrant."""
    gap_x, gap_y = (
        np.maximum(0, np.maximum(images - along[-1], -images)) for along, images in ((x, images_x), (y, images_y))
    )
    i, j = np.nonzero(np.hypot.outer(gap_x, gap_y) < REACH)
    across = np.subtract.outer(images_y[j], y) ** 2
    total = np.empty((x.size, y.size))
    rows = max(1, BLOCK // across.size)
    for start in range(0, x.size, rows):
        along = np.subtract.outer(x[start : start + rows], images_x[i]) ** 2
        distance = np.sqrt(along[:, :, None] + across)
        total[start : start + rows] = np.exp(-DECAY * distance).sum(axis=1)
    return total


def _cosine_sums(quadrant: Floats, points: tuple[int, int]) -> Floats:
    """Return one quadrant of the discrete Fourier transform of an even array, given by one quadrant."""
    for axis in (1, 0):
        n = points[axis]
        full_axis = quadrant.take(np.minimum(np.arange(n), n - np.arange(n)), axis)
        # the transform of an even array is real
        quadrant = scipy.fft.rfft(full_axis, axis=axis).real
    return quadrant


def _spectrum(autocorrelation: Floats, points: tuple[int, int], translate: Translation | None) -> Floats:
    """Return a quadrant of the power spectrum of Gaussian heights whose translation has this autocorrelation."""
    if translate is None:
        return _without_rounding(_cosine_sums(autocorrelation, points))
    translated, normal = translate.correlations()
    spectrum = _cosine_sums(normal(autocorrelation), points)
    possible = _without_rounding(spectrum)
    if spectrum.min() < 0:
        realised = _cosine_sums(possible, points)
        deviation = float(np.abs(translated(realised / realised[0, 0]) - autocorrelation).max())
        if deviation > MOST_DEVIATION:
            raise InputError(
                f"heights of this skewness and kurtosis cannot have this autocorrelation: it would be off by "
                f"{deviation:.2g} where {MOST_DEVIATION:g} is tolerated; bring the skewness closer to 0 and the "
                "kurtosis closer to 3, or choose the exponential autocorrelation"
            )
    return possible


def _without_rounding(spectrum: Floats) -> Floats:
    """Set the spectrum to 0 where it is negative or a rounding error of the transform."""
    # white noise at the level of rounding would hide the curvature of smooth surfaces
    floor = 100 * np.finfo(float).eps * math.sqrt(np.mean(np.square(spectrum)))
    return np.where(spectrum > floor, spectrum, 0.0)


def _apply_filter(noise: Floats, amplitude: Floats) -> Floats:
    """Filter noise with an amplitude response, given by one quadrant."""
    points = noise.shape
    rows = amplitude.shape[0]
    transform = scipy.fft.rfft2(noise)
    transform[:rows] *= amplitude
    # negative wavevectors follow the positive ones, in reverse order
    transform[rows:] *= amplitude[1 : points[0] - rows + 1][::-1]
    filtered: Floats = scipy.fft.irfft2(transform, s=points, overwrite_x=True)
    return filtered


def _standardise(heights: Floats) -> None:
    """Scale heights to mean 0 and rms 1, in place."""
    heights -= heights.mean()
    heights /= math.sqrt(np.mean(np.square(heights)))
