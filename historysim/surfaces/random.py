"""Random Gaussian surfaces of prescribed rms height and autocorrelation."""

import math
from typing import SupportsIndex

import numpy as np
import scipy.fft

from historysim.basics.arguments import ArrayLike, Floats, per_axis, scalar
from historysim.basics.units import quantity_text, warn_unlikely
from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.surfaces.distribution import generator
from historysim.surfaces.heights import MOST_POINTS, Surface

AUTOCORRELATIONS = ("exponential", "gaussian")
LEAST_PIXELS = 4
STEEPEST = 10  # rms height over autocorrelation length, beyond that of any surface
DECAY = 2.3  # ρ falls to 0.1 at the autocorrelation length
# Images are summed up to this distance in autocorrelation lengths: an image beyond adds less than
# exp(-2.3 × 14) = 1e-14. The shortest side, two lengths, has 7 images within this distance on
# either side.
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
) -> Surface:
    """Generate a periodic random rough surface with mean height 0 and a prescribed rms height.

    The autocorrelation holds for the ensemble of all seeds; a single surface deviates from it, the
    more the fewer autocorrelation lengths it spans. ``historysim/contact/README.md``, "Surfaces and
    statistics", describes the method.

    Parameters
    ----------
    shape : int or (int, int)
        Number of points along x and y, 4 to 2²⁸ in all; one number gives a square, (n, 1) or (1, n)
        a profile.
    pixel_size : float or (float, float)
        Distance between neighbouring points along x and y [m], > 0.
    rms_height : float
        Rq [m], > 0.
    autocorrelation_length : float or (float, float)
        β along x and y [m], where ρ has fallen to 0.1; from one pixel to half the side.
    seed : int
        ≥ 0. A seed gives the same surface, bit for bit, with one version of numpy and scipy on one
        type of processor.
    autocorrelation : str
        ``"exponential"``: ρ = exp(-2.3 √((x/β_x)² + (y/β_y)²)), or ``"gaussian"``:
        ρ = exp(-2.3 ((x/β_x)² + (y/β_y)²)). The surface has ρ summed over all periodic images.

    Raises
    ------
    InputError
        If an argument is out of range.

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
    width = min(
        length * side for length, side, n in zip(lengths, pixel, points, strict=True) if n > 1
    )
    if rms > STEEPEST * width:
        warn_unlikely(
            f"rms_height is {quantity_text(rms, 'm')} on an autocorrelation length of {quantity_text(width, 'm')}",
            "m",
            stacklevel=2,
        )
    noise = generator(seed)
    if autocorrelation not in AUTOCORRELATIONS:
        raise InputError(
            f"autocorrelation is {autocorrelation!r}; {nearest(str(autocorrelation), AUTOCORRELATIONS)}"
        )
    spectrum = _spectrum(_periodic_autocorrelation(points, lengths, autocorrelation), points)
    heights = _apply_filter(noise.standard_normal(points), np.sqrt(spectrum))
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


# The autocorrelation and the spectrum are even along x and y, so the quadrant x ≥ 0, y ≥ 0
# determines them.


def _periodic_autocorrelation(
    points: tuple[int, int], lengths: tuple[float, float], kind: str
) -> Floats:
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
        np.maximum(0, np.maximum(images - along[-1], -images))
        for along, images in ((x, images_x), (y, images_y))
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


def _spectrum(autocorrelation: Floats, points: tuple[int, int]) -> Floats:
    """Return a quadrant of the power spectrum of heights with this autocorrelation."""
    return _without_rounding(_cosine_sums(autocorrelation, points))


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
