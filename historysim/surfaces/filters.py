"""Components removed from height maps: waves (Gaussian filters), form, spikes and outliers.

The filters are linear (ISO 16610-21 and -61) or robust (-71). A form is a plane, a polynomial or a
sphere.
"""

import math
import warnings
from collections.abc import Iterator, Mapping

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, scalar
from historysim.errors import InputError

# α of the weight exp(-π (x/(α λ))²), with which a wave as long as the cut-off λ passes with half
# its amplitude.
ALPHA = math.sqrt(math.log(2) / math.pi)
# distance over the cut-off beyond which the weight is neglected: 7e-7 of the central weight
REACH = 1.0
# Limit of Tukey's weights over the median absolute residual: three standard deviations of Gaussian
# residuals.
TUKEY = 4.4478
MOST_PASSES = 50
SETTLED = 1e-4  # relative change of that median at which the robust filter has converged
LEAST_PIXELS = 2  # shortest cut-off over the pixel size: a map has no waves shorter than two pixels
SPIKE_REACH = 2  # half width of the neighbourhood of a spike in points: 24 neighbours
ROWS_AT_ONCE = 64
GAUSSIAN = 1.4826  # standard deviation over median absolute deviation, of Gaussian values


def gaussian_mean(
    heights: Floats,
    pixel_size: tuple[float, float],
    cutoff: float,
    *,
    periodic: bool = False,
    robust: bool = False,
) -> Floats:
    """Return the mean surface (nx, ny) [m] of a Gaussian filter: the waves longer than a cut-off λ [m].

    At each point it is the height of the plane of least squares through the heights around it, with
    the weights exp(-π (x² + y²)/(α λ)²), α = √(ln 2/π). At borders and next to missing points
    (NaN), where the weighted mean alone would bend, a plane stays a plane (regression of first
    order). The robust filter repeats the fit with Tukey's biweight of the residuals, (1 - (r/c)²)²
    within c = 4.4478 times their median absolute value, until that median converges. InputError if
    the cut-off is shorter than two pixels or longer than the surface.
    """
    cutoff = scalar("cutoff", cutoff, above=0)
    lengths = [
        points * pixel
        for points, pixel in zip(heights.shape, pixel_size, strict=True)
        if points > 1
    ]
    pixels = [pixel for points, pixel in zip(heights.shape, pixel_size, strict=True) if points > 1]
    shortest, longest = LEAST_PIXELS * max(pixels, default=0.0), min(lengths, default=0.0)
    if not shortest * (1 - 1e-9) <= cutoff <= longest:
        raise InputError(
            f"a cut-off of {cutoff:g} m; expected {shortest:g} m, two pixels, or more, and at most the shorter side, "
            f"{longest:g} m"
        )
    present = np.isfinite(heights)
    # without the mean height, the sums keep their digits
    level = float(heights[present].mean())
    z = np.where(present, heights - level, 0.0)
    weights = present.astype(np.float64)
    kernels = [
        list(_kernels(points, pixel / cutoff, periodic))
        for points, pixel in zip(heights.shape, pixel_size, strict=True)
    ]
    mean = _fit_local_planes(z, weights, kernels, periodic)
    scale = math.inf
    for _ in range(MOST_PASSES if robust else 0):
        residual = np.where(present, z - mean, 0.0)
        median = float(np.median(np.abs(residual[present])))
        if median == 0 or abs(scale - median) <= SETTLED * median:
            break
        scale = median
        bound = TUKEY * scale
        tukey = (1 - (np.minimum(np.abs(residual), bound) / bound) ** 2) ** 2
        mean = np.where(
            present, _fit_local_planes(z, weights * tukey, kernels, periodic, fallback=mean), mean
        )
    return np.where(present, mean + level, np.nan)


def _kernels(points: int, pixel: float, periodic: bool) -> Iterator[Floats]:
    """Yield the weights along one axis times the distance to the powers 0, 1, 2; ``pixel`` is over the cut-off."""
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


def _convolve(values: Floats, along_x: Floats, along_y: Floats, periodic: bool) -> Floats:
    """Return the sums Σ w(x' - x) w(y' - y) z(x', y') over the points around each point."""
    if periodic:
        # a correlation: the conjugate of the kernel
        spectrum = (
            np.fft.rfft2(values)
            * np.conj(np.fft.fft(along_x))[:, None]
            * np.conj(np.fft.rfft(along_y))[None, :]
        )
        return np.fft.irfft2(spectrum, values.shape)
    from scipy.signal import oaconvolve

    result = oaconvolve(values, along_x[::-1, None], mode="full", axes=0)
    result = result[along_x.size // 2 :][: values.shape[0]]
    result = oaconvolve(result, along_y[None, ::-1], mode="full", axes=1)
    cropped: Floats = result[:, along_y.size // 2 :][:, : values.shape[1]]
    return cropped


def _fit_local_planes(
    z: Floats,
    weights: Floats,
    kernels: list[list[Floats]],
    periodic: bool,
    fallback: Floats | None = None,
) -> Floats:
    """Return the height of the best plane at each point, by Cramer's rule; the weighted mean if there is no plane."""

    def moment(values: Floats, along_x: int, along_y: int) -> Floats:
        return _convolve(values, kernels[0][along_x], kernels[1][along_y], periodic)

    total, x, y = moment(weights, 0, 0), moment(weights, 1, 0), moment(weights, 0, 1)
    xx, xy, yy = moment(weights, 2, 0), moment(weights, 1, 1), moment(weights, 0, 2)
    weighted = weights * z
    z0, zx, zy = moment(weighted, 0, 0), moment(weighted, 1, 0), moment(weighted, 0, 1)
    narrow_x, narrow_y = kernels[0][0].size == 1, kernels[1][0].size == 1
    if narrow_x:
        xx = np.ones_like(xx) * total
    if narrow_y:
        yy = np.ones_like(yy) * total
    minor = xx * yy - xy**2
    cofactor_x, cofactor_y = xy * y - x * yy, x * xy - xx * y
    determinant = total * minor + x * cofactor_x + y * cofactor_y
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = (z0 * minor + zx * cofactor_x + zy * cofactor_y) / determinant
        mean = z0 / total
    # points on a line, or a single point, define no plane
    regular = determinant > 1e-9 * total * xx * yy
    result = np.where(regular, plane, mean)
    if fallback is not None:
        result = np.where(total > 1e-9, result, fallback)
    return result


def spikes(heights: Floats, threshold: float) -> Booleans:
    """Return the points (nx, ny) more than `threshold` robust standard deviations off the median of 24 neighbours."""
    return _exceeds(heights - _neighbour_median(heights), threshold)


def outliers(heights: Floats, threshold: float) -> Booleans:
    """Return the points (nx, ny) more than `threshold` robust standard deviations off the median height."""
    return _exceeds(heights - np.nanmedian(heights), threshold)


def _exceeds(deviations: Floats, threshold: float) -> Booleans:
    sizes = np.abs(deviations[np.isfinite(deviations)])
    median = float(np.median(sizes))
    # the mean replaces a median of 0, if half of the points are level
    deviation = GAUSSIAN * median if median > 0 else math.sqrt(math.pi / 2) * float(sizes.mean())
    result: Booleans = np.abs(deviations) > threshold * deviation  # NaN is not
    return result


def _neighbour_median(heights: Floats) -> Floats:
    """Return the median of the neighbours of each point, without the point; NaN where all are missing."""
    from numpy.lib.stride_tricks import sliding_window_view

    wide = 2 * SPIKE_REACH + 1
    # odd reflection continues a slope, so that its border is not a spike
    padded = np.pad(heights, SPIKE_REACH, mode="reflect", reflect_type="odd")
    result = np.empty(heights.shape)
    for start in range(0, heights.shape[0], ROWS_AT_ONCE):
        rows = padded[start : start + ROWS_AT_ONCE + 2 * SPIKE_REACH]
        around = sliding_window_view(rows, (wide, wide))
        around = np.delete(
            around.reshape(*around.shape[:2], wide * wide), wide * wide // 2, axis=-1
        )
        with warnings.catch_warnings():
            # numpy warns if all neighbours are missing
            warnings.simplefilter("ignore", RuntimeWarning)
            result[start : start + ROWS_AT_ONCE] = np.nanmedian(around, axis=-1)
    return result


_DEGREE: Mapping[str, int] = {"mean": 0, "plane": 1, "quadratic": 2}
FORMS = (*_DEGREE, "sphere", "polynomial")

HIGHEST_DEGREE = 12  # of a polynomial; higher ones follow the roughness

# Curvature over height, both in half diagonals, below which the curvature is a rounding error of
# the heights.
NO_CURVATURE = 1e-12
# Largest distance from the axis over the radius of the initial sphere; 1 is the equator.
STEEPEST = 0.9


@attrs.frozen(eq=False)
class Form:
    """The least-squares form of a surface."""

    kind: str  #: one of `FORMS`
    heights: Floats = attrs.field(repr=False)  #: (nx, ny) At all points, missing ones too [m]
    #: Radius of a sphere [m]: positive for a ball, which is highest in the middle, negative for a
    #: hollow.
    radius: float | None = None


def fit_form(
    heights: Floats, pixel_size: tuple[float, float], kind: str, degree: int | None = None
) -> Form:
    """Return the form of a surface: least squares of the height over the points that are not missing.

    "quadratic" has all six terms up to second order, "polynomial" all up to its degree, 0 to 12;
    "sphere" has a free centre and radius, so that a tilted ball needs no levelling first.
    InputError for another form or degree, too few points, or a surface that no sphere fits.
    """
    if kind not in FORMS:
        raise InputError(f"form is {kind!r}; expected one of {', '.join(FORMS)}")
    if (kind == "polynomial") != (degree is not None):
        stated = "no degree" if degree is None else f"degree {degree!r}"
        raise InputError(
            f"{stated} for the form {kind}; expected a degree for a polynomial and for no other form"
        )
    if degree is None:
        degree = _DEGREE.get(kind, 0)
    elif (
        isinstance(degree, bool) or not isinstance(degree, int) or not 0 <= degree <= HIGHEST_DEGREE
    ):
        raise InputError(
            f"degree is {degree!r}; expected a whole number from 0 to {HIGHEST_DEGREE}"
        )
    narrow = 1 in heights.shape
    terms = degree + 1 if narrow else (degree + 1) * (degree + 2) // 2
    unknowns = (3 if narrow else 4) if kind == "sphere" else terms
    present = int(np.count_nonzero(np.isfinite(heights)))
    if present < unknowns:
        raise InputError(
            f"{present} points for a form, {kind}, of {unknowns} unknowns; expected more points"
        )
    if kind == "sphere":
        return _sphere(heights, pixel_size)
    return Form(kind, _polynomial(heights, degree))


def _polynomial(heights: Floats, degree: int) -> Floats:
    """Return the least-squares polynomial of this total degree in x and y; Legendre terms avoid cancellation."""
    from numpy.polynomial import legendre

    present = np.isfinite(heights)
    terms = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    (x, half_x), (y, half_y) = (_indices_from_centre(present.any(axis=across)) for across in (1, 0))
    columns_x = legendre.legvander(x / (half_x or 1), degree)[:, [i for i, _ in terms]]
    columns_y = legendre.legvander(y / (half_y or 1), degree)[:, [j for _, j in terms]]
    # normal matrix, without storing one column of all points per term
    products = [
        (
            (columns_x * columns_x[:, [k]]).T
            @ present.astype(np.float64)
            * (columns_y * columns_y[:, [k]]).T
        ).sum(axis=1)
        for k in range(len(terms))
    ]
    # Legendre terms are nearly orthogonal, so that the normal equations are well conditioned
    form = np.zeros(heights.shape)
    # a second pass on the remainder, so that only rounding remains of a surface that equals its
    # form
    for _ in range(2):
        remainder = np.where(present, heights - form, 0.0)
        projections = ((columns_x.T @ remainder) * columns_y.T).sum(axis=1)
        coefficients = np.linalg.lstsq(np.stack(products), projections, rcond=None)[0]
        form += (columns_x * coefficients) @ columns_y.T
    return form


def _indices_from_centre(present: ArrayLike) -> tuple[Floats, float]:
    """Return the indices counted from the middle of the present points, and half the range of these points."""
    lowest, highest = np.flatnonzero(present)[[0, -1]]
    return np.arange(np.size(present)) - (lowest + highest) / 2, float(highest - lowest) / 2


def _sphere(heights: Floats, pixel_size: tuple[float, float]) -> Form:
    """Return the sphere z = z0 - (1 - √(1 - κ²ρ²))/κ, ρ² = (x-x0)² + (y-y0)², of least squares.

    The unit of length is half the diagonal of the present points. The search starts from the
    least-squares paraboloid; y0 is 0 for a profile along x.
    """
    from scipy.optimize import least_squares

    present = np.isfinite(heights)
    indices, half = zip(
        *(_indices_from_centre(present.any(axis=across)) for across in (1, 0)), strict=True
    )
    length = math.hypot(half[0] * pixel_size[0], half[1] * pixel_size[1])
    x_all = indices[0][:, None] * (pixel_size[0] / length)
    y_all = indices[1][None, :] * (pixel_size[1] / length)
    x, y = (np.broadcast_to(axis, heights.shape)[present] for axis in (x_all, y_all))
    mean = heights[present].mean()
    z = (heights[present] - mean) / length
    terms = np.stack([np.ones_like(x), x, y, -(x**2 + y**2) / 2])
    (level, slope_x, slope_y, curvature), _, rank, _ = np.linalg.lstsq(
        terms @ terms.T, terms @ z, rcond=NO_CURVATURE
    )
    if rank < (3 if 1 in heights.shape else 4):
        raise InputError(
            "points on a line or a circle do not determine a sphere; expected points all over the map"
        )
    rounding = (
        NO_CURVATURE * np.abs(z).max(initial=0) + 8 * np.finfo(float).eps * abs(mean) / length
    )
    if not abs(curvature) > rounding:
        raise InputError(
            "no sphere fits a flat surface; expected a ball or a hollow, or the form plane"
        )
    start = [
        slope_x / curvature,
        slope_y / curvature,
        level + (slope_x**2 + slope_y**2) / (2 * curvature),
    ]
    steepest = STEEPEST / np.hypot(x - start[0], y - start[1]).max()
    start.append(np.clip(curvature, -steepest, steepest))
    free = [index for index in range(4) if not (index < 2 and heights.shape[index] == 1)]

    def unknowns(free_values: Floats) -> Floats:
        values = np.array(start)
        values[free] = free_values
        return values

    solution = least_squares(
        lambda free_values: _cap(unknowns(free_values), x, y)[0] - z,
        np.array(start)[free],
        lambda free_values: _cap(unknowns(free_values), x, y)[1][free].T,
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    best = unknowns(solution.x)
    if (
        not np.isfinite(best).all()
        or abs(best[3]) * np.hypot(x - best[0], y - best[1]).max() >= 1
        or best[3] == 0
    ):
        raise InputError(
            "no sphere fits: the best one does not cover all points; expected a ball or a hollow"
        )
    return Form("sphere", _cap(best, x_all, y_all)[0] * length + mean, float(length / best[3]))


def _cap(unknowns: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the heights of a sphere, and their derivatives by x0, y0, z0 and κ."""
    x0, y0, z0, curvature = unknowns
    square = (x - x0) ** 2 + (y - y0) ** 2
    # a step of the search may pass the equator, where no height is defined; the solution may not
    root = np.sqrt(np.maximum(1 - curvature**2 * square, 1e-12))
    slope = curvature / root
    gradient = np.stack(
        [slope * (x - x0), slope * (y - y0), np.ones_like(square), -square / (root * (1 + root))]
    )
    return z0 - curvature * square / (1 + root), gradient
