"""Gaussian filters of height maps, linear (ISO 16610-21 and -61) and robust (-71), and points that are no heights."""

import math
import warnings
from collections.abc import Iterator

import numpy as np

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Booleans, Floats
from historysim.errors import InputError

ALPHA = math.sqrt(math.log(2) / math.pi)
"""α of the weight exp(-π (x/(α λ))²), with which a wave as long as the cut-off λ passes with half its amplitude."""
REACH = 1.0
"""Distance, over the cut-off, beyond which there is no weight: it would be 7e-7 of that in the middle."""
TUKEY = 4.4478
"""Where Tukey's weights end, over the median of the absolute residuals: three standard deviations of Gaussian ones."""
MOST_PASSES = 50
SETTLED = 1e-4
"""Change of that median, relative to it, at which the robust filter has settled."""
LEAST_PIXELS = 2
"""The shortest cut-off, over the pixel size: what is shorter than two pixels is not in the map."""
SPIKE_REACH = 2
"""How many points far the neighbours of a spike reach: 24 of them."""
ROWS_AT_ONCE = 64
GAUSSIAN = 1.4826
"""Standard deviation over median absolute deviation, of Gaussian values."""


def gaussian_mean(
    heights: Floats, pixel_size: tuple[float, float], cutoff: float, *, periodic: bool = False, robust: bool = False
) -> Floats:
    """Return the mean surface of a Gaussian filter: the waves that are longer than the cut-off.

    At each point it is the height there of the plane that fits the heights around it best, each with the weight
    exp(-π (x² + y²)/(α λ)²), α = √(ln 2/π). Far from borders and missing points that is the weighted mean, and
    passes a wave of length λ_w with exp(-π (α λ/λ_w)²) of its amplitude: half at the cut-off. At borders and
    beside missing points, where the weighted mean alone would bend, a plane stays a plane (regression of first order).

    The robust filter fits again with Tukey's biweight of the residuals, (1 - (r/c)²)² within c = 4.4478 times the
    median of their absolute values, until that settles: narrow pits and spikes do not draw the mean surface.

    Heights (nx, ny), pixel size and cut-off λ in m; NaN where heights are missing. Raises InputError: a cut-off shorter
    than two pixels, or longer than the surface.
    """
    cutoff = scalar("cutoff", cutoff, above=0)
    lengths = [points * pixel for points, pixel in zip(heights.shape, pixel_size, strict=True) if points > 1]
    pixels = [pixel for points, pixel in zip(heights.shape, pixel_size, strict=True) if points > 1]
    least, most = LEAST_PIXELS * max(pixels, default=0.0), min(lengths, default=0.0)
    if not least * (1 - 1e-9) <= cutoff <= most:
        raise InputError(
            f"a cut-off of {cutoff:g} m; expected {least:g} m, two pixels, or more, and at most the shorter side, "
            f"{most:g} m"
        )
    present = np.isfinite(heights)
    # numbers of the size of the roughness keep their digits in the sums
    level = float(heights[present].mean())
    z = np.where(present, heights - level, 0.0)
    weights = present.astype(np.float64)
    kernels = [
        list(_kernels(points, pixel / cutoff, periodic))
        for points, pixel in zip(heights.shape, pixel_size, strict=True)
    ]
    mean = _fitted(z, weights, kernels, periodic)
    scale = math.inf
    for _ in range(MOST_PASSES if robust else 0):
        residual = np.where(present, z - mean, 0.0)
        median = float(np.median(np.abs(residual[present])))
        if median == 0 or abs(scale - median) <= SETTLED * median:
            break
        scale = median
        bound = TUKEY * scale
        tukey = (1 - (np.minimum(np.abs(residual), bound) / bound) ** 2) ** 2
        mean = np.where(present, _fitted(z, weights * tukey, kernels, periodic, fallback=mean), mean)
    return np.where(present, mean + level, np.nan)


def _kernels(points: int, pixel: float, periodic: bool) -> Iterator[Floats]:
    """Give the weights along one axis, times the distance to the powers 0, 1, 2; the pixel is over the cut-off."""
    reach = min(math.ceil(REACH / pixel), points - 1) if points > 1 else 0
    distance = np.arange(-reach, reach + 1) * pixel
    weight = np.exp(-math.pi * (distance / ALPHA) ** 2)
    weight /= weight.sum()
    for power in range(3):
        kernel = weight * distance**power
        if periodic:
            around = np.zeros(points)
            np.add.at(around, np.arange(-reach, reach + 1) % points, kernel)
            kernel = around
        yield kernel


def _smeared(values: Floats, along_x: Floats, along_y: Floats, periodic: bool) -> Floats:
    """Return the sums Σ w(x' - x) w(y' - y) z(x', y') over the points around each point."""
    if periodic:
        # a correlation: the conjugate of the kernel
        spectrum = np.fft.rfft2(values) * np.conj(np.fft.fft(along_x))[:, None] * np.conj(np.fft.rfft(along_y))[None, :]
        return np.fft.irfft2(spectrum, values.shape)
    from scipy.signal import oaconvolve

    result = oaconvolve(values, along_x[::-1, None], mode="full", axes=0)
    result = result[along_x.size // 2 :][: values.shape[0]]
    result = oaconvolve(result, along_y[None, ::-1], mode="full", axes=1)
    smeared: Floats = result[:, along_y.size // 2 :][:, : values.shape[1]]
    return smeared


def _fitted(
    z: Floats, weights: Floats, kernels: list[list[Floats]], periodic: bool, fallback: Floats | None = None
) -> Floats:
    """Return at each point the height of the best plane, by Cramer's rule; the weighted mean where there is none."""

    def moment(values: Floats, along_x: int, along_y: int) -> Floats:
        return _smeared(values, kernels[0][along_x], kernels[1][along_y], periodic)

    one, x, y = moment(weights, 0, 0), moment(weights, 1, 0), moment(weights, 0, 1)
    xx, xy, yy = moment(weights, 2, 0), moment(weights, 1, 1), moment(weights, 0, 2)
    weighted = weights * z
    z0, zx, zy = moment(weighted, 0, 0), moment(weighted, 1, 0), moment(weighted, 0, 1)
    narrow_x, narrow_y = kernels[0][0].size == 1, kernels[1][0].size == 1
    if narrow_x:
        xx = np.ones_like(xx) * one
    if narrow_y:
        yy = np.ones_like(yy) * one
    minor = xx * yy - xy**2
    cofactor_x, cofactor_y = xy * y - x * yy, x * xy - xx * y
    determinant = one * minor + x * cofactor_x + y * cofactor_y
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = (z0 * minor + zx * cofactor_x + zy * cofactor_y) / determinant
        mean = z0 / one
    # of points on a line, or of one point alone, there is no plane
    regular = determinant > 1e-9 * one * xx * yy
    result = np.where(regular, plane, mean)
    if fallback is not None:
        result = np.where(one > 1e-9, result, fallback)
    return result


def spikes(heights: Floats, threshold: float) -> Booleans:
    """Return which points (nx, ny) stand off the median of the 24 around them by so many robust standard deviations."""
    return _far_off(heights - _median_around(heights), threshold)


def outliers(heights: Floats, threshold: float) -> Booleans:
    """Return which points (nx, ny) are farther from the median height than so many robust standard deviations."""
    return _far_off(heights - np.nanmedian(heights), threshold)


def _far_off(off: Floats, threshold: float) -> Booleans:
    sizes = np.abs(off[np.isfinite(off)])
    median = float(np.median(sizes))
    # the mean in place of a median of 0, where half of the points are level
    deviation = GAUSSIAN * median if median > 0 else math.sqrt(math.pi / 2) * float(sizes.mean())
    result: Booleans = np.abs(off) > threshold * deviation  # NaN is not
    return result


def _median_around(heights: Floats) -> Floats:
    """Return the median of the points around each point, itself left out; NaN where all are missing."""
    from numpy.lib.stride_tricks import sliding_window_view

    wide = 2 * SPIKE_REACH + 1
    # mirrored through its edges, so that a slope goes on and its border is no spike
    padded = np.pad(heights, SPIKE_REACH, mode="reflect", reflect_type="odd")
    result = np.empty(heights.shape)
    for first in range(0, heights.shape[0], ROWS_AT_ONCE):
        rows = padded[first : first + ROWS_AT_ONCE + 2 * SPIKE_REACH]
        around = sliding_window_view(rows, (wide, wide))
        around = np.delete(around.reshape(*around.shape[:2], wide * wide), wide * wide // 2, axis=-1)
        with warnings.catch_warnings():
            # numpy warns where all of them are missing
            warnings.simplefilter("ignore", RuntimeWarning)
            result[first : first + ROWS_AT_ONCE] = np.nanmedian(around, axis=-1)
    return result
