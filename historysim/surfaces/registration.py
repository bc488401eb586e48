"""Registration of two height maps of one area, before and after wear: shift, rotation and lost material."""

import math
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from scipy import ndimage, spatial

from historysim.basics.arguments import Booleans, Floats, Integers, scalar
from historysim.basics.units import quantity_text, uncertain_text
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.reading import read_surface
from historysim.surfaces.resampling import COINCIDENT, centred_positions, resample

LEAST_OVERLAP = 0.25  # fraction of the first map that the second has to cover
LEAST_CORRELATION = 0.5  # lowest correlation of the slopes in the overlap of two maps of one area
MOST_ROUNDS = 60  # Gauss-Newton steps; ten are typical
SETTLED = 1e-4  # step in pixels at which the fit has converged
# side of square blocks in points; the variance of their means gives the correlation of the noise
BLOCK = 8
# deviations beyond which residuals have no weight: 95 % efficiency on Gaussian noise (Huber 2009)
TUKEY = 4.685
NORMAL = 1.4826  # standard deviation over median absolute deviation of Gaussian numbers
# standard deviations of the noise by which the mean of 3 × 3 points is lower where it is worn
DETECTED = 5.0
RIM = 1.5  # standard deviations by which neighbours of worn points are lower if they are worn
PASSES = 3  # number of fits that exclude the worn points of the previous fit
MARGIN = 2  # margin in points around worn points, since a worn cap is thin at its rim
NEAR = 1.5  # distance in pixels within which summits of the two maps are identified
KEPT, LOWERED, LOST = range(3)  # fate of a summit


@attrs.frozen(eq=False)
class Registration:
    """Result of `register_maps`."""

    shift: tuple[float, float]  #: shift of the second map along x and y onto the first [m]
    shift_error: float  #: standard error of each component of the shift [m]
    rotation: float  #: rotation of the second map about its centre, from x towards y [rad]
    #: mean height of the second map over the first outside worn areas [m], which is subtracted
    offset: float
    #: slope of the second map over the first along x and y, which is subtracted
    tilt: tuple[float, float]
    correlation: float  #: correlation of the slopes of the two maps in their overlap
    #: Second map on the points of the first, without offset and tilt; missing outside the overlap.
    after: Surface = attrs.field(repr=False)
    #: first minus second map [m]: positive where material was lost
    difference: Surface = attrs.field(repr=False)
    worn: Booleans = attrs.field(repr=False)  #: (nx, ny) points that lost material
    #: standard deviation of the difference outside worn areas [m], interpolation included
    noise: float
    worn_volume: float  #: volume lost in `worn` [m³]; wear thinner than the noise is missed
    worn_volume_error: (
        #: standard error of the worn volume from the noise, the datum and the rim of worn areas
        #: [m³]
        float
    )
    #: (summit, 2) x and y of the summits of the first map within the overlap, by the 9-point rule
    #: [m].
    summit_place: Floats = attrs.field(repr=False)
    #: (summit) `KEPT`; `LOST` without a summit of the second map within 1.5 pixels; `LOWERED` with
    #: one that is lower by more than five deviations of the noise.
    fate: Integers = attrs.field(repr=False)

    @property
    def worn_area(self) -> float:
        """Nominal area of the points that lost material [m²]."""
        return int(self.worn.sum()) * math.prod(self.difference.pixel_size)

    def summary(self) -> list[tuple[str, str]]:
        """Summarise the result in a few lines (label, text)."""
        x, y = (uncertain_text(value, self.shift_error, "m") for value in self.shift)
        flattened = int((self.fate == LOWERED).sum())
        worn_percentage = 100 * float(self.worn.mean())
        volume = f"{self.worn_volume * 1e18:.4g} ± {self.worn_volume_error * 1e18:.2g} µm³"
        doubt = "; not significant" if abs(self.worn_volume) < 2 * self.worn_volume_error else ""
        return [
            ("shift", f"{x} along x, {y} along y"),
            ("rotation", f"{math.degrees(self.rotation):.3f}°"),
            ("correlation of slopes", f"{self.correlation:.3f}"),
            ("noise of the difference", quantity_text(self.noise, "m")),
            (
                "worn area",
                f"{self.worn_area * 1e12:.4g} µm², {worn_percentage:.3g} % of the first map",
            ),
            ("worn volume", volume + doubt),
            (
                "summits",
                f"{self.fate.size:,}; {(self.fate == LOST).sum():,} lost, {flattened:,} flattened",
            ),
        ]


def register_maps(
    before: Surface | str | Path, after: Surface | str | Path, *, most_rotation: float = 1.0
) -> Registration:
    """Register a second height map of an area with the first, and measure the material lost between them.

    Up to about a third of the area may be worn: shift, rotation, offset and tilt minimise the
    squared height difference with Tukey's weights.

    Parameters
    ----------
    before, after : Surface, or the path of a height map
        Both of the same side of one body, not mirrored. A second map of another pixel size is
        resampled.
    most_rotation : float
        Largest rotation in either direction [degrees], from 0 to 10.

    Raises
    ------
    InputError
        If a map is a profile, the maps do not overlap by a quarter of the first or do not
        correlate, or scikit-image is not installed.
    """
    reference, moving = (
        surface if isinstance(surface, Surface) else read_surface(surface)
        for surface in (before, after)
    )
    if 1 in reference.shape or 1 in moving.shape:
        raise InputError("a profile cannot be registered; expected two height maps")
    limit = scalar("most_rotation", most_rotation, least=0)
    if limit > 10:
        raise InputError(
            f"most_rotation is {limit:g}°; expected at most 10°: turn one of the maps before"
        )
    if not np.allclose(reference.pixel_size, moving.pixel_size, rtol=COINCIDENT, atol=0):
        moving = moving.at_resolution(reference.pixel_size)
    fit = _fit_parameters(
        reference,
        moving,
        _initial_parameters(reference, moving, math.radians(limit)),
        np.zeros(reference.shape, dtype=bool),
    )
    for _ in range(PASSES):
        # the thin rims of worn areas would lower the datum
        fit = _fit_parameters(
            reference, moving, fit.parameters, _find_worn(reference.heights - fit.laid)
        )
    return _compare(reference, fit)


@attrs.frozen(eq=False)
class _Fit:
    """Fit of the second map to the first; parameters are shift x, y [m], rotation [rad], offset [m] and tilt x, y."""

    laid: Floats
    parameters: Floats
    jacobian: Floats
    weights: Floats


def _resample_onto(moving: Surface, onto: Surface, shift: Floats, rotation: float) -> Floats:
    """Resample the second map on the points of the first (nx, ny) [m]."""
    return resample(
        moving.heights,
        moving.pixel_size,
        periodic=False,
        shape=onto.shape,
        onto=onto.pixel_size,
        shift=shift,
        rotation=rotation,
    )


def _initial_parameters(reference: Surface, moving: Surface, most_rotation: float) -> Floats:
    """Return the parameters from which the fit starts: the shift by phase correlation at the best of some rotations."""
    correlate_phases = _import_phase_correlation()
    # from one rotation to the next, the ends of the map move by two pixels
    count = math.ceil(most_rotation * max(moving.shape) / 4)
    # a tilt would correlate with itself at any shift
    level_reference, level_moving = reference.detrended("plane"), moving.detrended("plane")
    best, start = -math.inf, np.zeros(6)
    for rotation in np.linspace(-most_rotation, most_rotation, 2 * count + 1):
        turned = _resample_onto(level_moving, level_moving, np.zeros(2), float(rotation))
        pixels = correlate_phases(
            level_reference.heights,
            turned,
            reference_mask=~level_reference.missing,
            moving_mask=np.isfinite(turned),
            overlap_ratio=LEAST_OVERLAP,
        )[0]
        shift = pixels * reference.pixel_size
        correlation = _slope_correlation(
            level_reference.heights,
            _resample_onto(level_moving, level_reference, shift, float(rotation)),
        )
        if correlation > best:
            best, start = correlation, np.array([*shift, rotation, 0, 0, 0])
    return start


def _import_phase_correlation() -> Any:
    try:
        from skimage.registration import phase_cross_correlation
    except ImportError as error:
        raise InputError(
            f'registration needs scikit-image, which cannot be imported ({error}): pip install "historysim[surfaces]"'
        ) from error
    return phase_cross_correlation


def _fit_parameters(reference: Surface, moving: Surface, start: Floats, worn: Booleans) -> _Fit:
    """Fit the second map to the first outside `worn`: least squares with Tukey's weights, by Gauss-Newton steps."""
    parameters = start.copy()
    x, y = np.meshgrid(
        *map(centred_positions, reference.shape, reference.pixel_size), indexing="ij"
    )
    for _ in range(MOST_ROUNDS):
        laid = _resample_onto(moving, reference, parameters[:2], parameters[2])
        slope_x, slope_y = np.gradient(laid, *reference.pixel_size)
        turned = (y - parameters[1]) * slope_x - (x - parameters[0]) * slope_y
        columns = [-slope_x, -slope_y, turned, -np.ones_like(x), -x, -y]
        residual = laid - reference.heights - parameters[3] - parameters[4] * x - parameters[5] * y
        overlap = np.isfinite(residual + turned)
        used = overlap & ~worn
        if (
            overlap.sum() < LEAST_OVERLAP * np.count_nonzero(~reference.missing)
            or used.sum() < 3 * parameters.size
        ):
            raise InputError(
                f"the two maps overlap by less than {LEAST_OVERLAP:.0%} of the first, do not show one area, or are "
                "worn all over; expected maps of one area"
            )
        jacobian = np.stack([column[used] for column in columns], axis=-1)
        weights, scale = _tukey_weights(residual[used]), _column_scale(jacobian)
        root = np.sqrt(weights)
        step = (
            np.linalg.lstsq(
                jacobian / scale * root[:, np.newaxis], -residual[used] * root, rcond=None
            )[0]
            / scale
        )
        parameters += step
        # shift in pixels, rotation by the displacement of the ends of the map
        if (
            np.abs(step[:2] / reference.pixel_size).max() < SETTLED
            and abs(step[2]) * max(reference.shape) < SETTLED
        ):
            break
    weight_map = np.full(reference.shape, 0.0)
    weight_map[used] = weights
    design = np.full((*reference.shape, len(columns)), np.nan)
    design[used] = jacobian
    laid = _resample_onto(moving, reference, parameters[:2], parameters[2])
    level = laid - parameters[3] - parameters[4] * x - parameters[5] * y
    return _Fit(level, parameters, design, weight_map)


def _column_scale(jacobian: Floats) -> Floats:
    """Return the largest magnitude of each column, 1 for a column of zeros."""
    scale = np.abs(jacobian).max(axis=0)
    return np.where(scale == 0, 1.0, scale)


def _tukey_weights(residual: Floats) -> Floats:
    away = np.abs(residual - np.median(residual))
    scale = TUKEY * max(NORMAL * float(np.median(away)), np.finfo(float).tiny)
    # maps without noise have a scale close to 0
    return (1 - (np.minimum(away, scale) / scale) ** 2) ** 2


def _compare(reference: Surface, fit: _Fit) -> Registration:
    difference = reference.heights - fit.laid
    overlap = np.isfinite(difference)
    correlation = _slope_correlation(reference.heights, fit.laid)
    if not correlation > LEAST_CORRELATION:
        raise InputError(
            f"the slopes of the two maps correlate by {correlation:.2f} at best, so that they do not show one area; "
            "expected the same side of one body, rotated by no more than most_rotation, neither mirrored nor inverted"
        )
    worn = _find_worn(difference)
    sound = overlap & ~worn
    noise = NORMAL * float(np.median(np.abs(difference[sound] - np.median(difference[sound]))))
    noise_gain = _noise_gain(np.where(sound, difference, np.nan), noise)
    area = math.prod(reference.pixel_size)
    covariance = _covariance(fit, sound) * noise**2 * noise_gain
    # an error of the datum below the worn points is an error of their volume
    datum = np.nansum(fit.jacobian[worn], axis=0)
    # at the rim of worn areas, a thickness up to the detection limit may be missing or included
    rim = int((ndimage.binary_dilation(worn) & sound).sum()) * RIM * noise / (3 * math.sqrt(12))
    variance = worn.sum() * noise**2 * noise_gain + datum @ covariance @ datum + rim**2
    registered_map = Surface(fit.laid, reference.pixel_size)
    summit_position, fate = _classify_summits(reference, registered_map, worn, noise)
    return Registration(
        shift=(float(fit.parameters[0]), float(fit.parameters[1])),
        shift_error=math.sqrt(covariance[:2, :2].diagonal().mean()),
        rotation=float(fit.parameters[2]),
        offset=float(fit.parameters[3]),
        tilt=(float(fit.parameters[4]), float(fit.parameters[5])),
        correlation=correlation,
        after=registered_map,
        difference=Surface(difference, reference.pixel_size),
        worn=worn,
        noise=noise,
        worn_volume=float(difference[worn].sum()) * area,
        worn_volume_error=math.sqrt(variance) * area,
        summit_place=summit_position,
        fate=fate,
    )


def _slope_correlation(reference: Floats, moving: Floats) -> float:
    """Return the correlation of the slopes of two maps; heights of long waves would correlate by chance."""
    overlap = np.isfinite(reference + moving)
    slopes = [
        np.stack(np.gradient(ndimage.uniform_filter(np.where(overlap, heights, 0.0), 3)))
        for heights in (reference, moving)
    ]
    # points whose slopes depend on known heights only
    used = ndimage.binary_erosion(overlap, np.ones((5, 5)))
    reference_slopes, moving_slopes = (slope[:, used].ravel() for slope in slopes)
    return float(np.corrcoef(reference_slopes, moving_slopes)[0, 1]) if used.any() else 0.0


def _find_worn(difference: Floats) -> Booleans:
    """Return the points where the mean of 3 × 3 points is lower than its noise explains, with a margin."""
    overlap = np.isfinite(difference)
    weight = ndimage.uniform_filter(overlap.astype(float), 3, mode="constant")
    mean = ndimage.uniform_filter(
        np.where(overlap, difference, 0.0), 3, mode="constant"
    ) / np.maximum(weight, 1e-9)
    middle = np.median(mean[overlap])
    spread = NORMAL * np.median(np.abs(mean[overlap] - middle))
    low = (
        ndimage.binary_propagation(
            mean > middle + DETECTED * spread, mask=mean > middle + RIM * spread
        )
        & overlap
    )
    return np.asarray(
        ndimage.binary_dilation(low, iterations=MARGIN) & overlap if low.any() else low
    )


def _noise_gain(difference: Floats, noise: float) -> float:
    """Return the variance of a sum of neighbouring points relative to independent points, at least 1."""
    nx, ny = (n // BLOCK * BLOCK for n in difference.shape)
    blocks = difference[:nx, :ny].reshape(nx // BLOCK, BLOCK, ny // BLOCK, BLOCK).mean(axis=(1, 3))
    means = blocks[np.isfinite(blocks)]
    return max(1.0, float(means.var()) * BLOCK**2 / noise**2) if means.size > 1 and noise else 1.0


def _covariance(fit: _Fit, sound: Booleans) -> Floats:
    """Return the covariance of the parameters for a noise of 1."""
    rows = sound & (fit.weights > 0)
    scale = _column_scale(fit.jacobian[rows])
    jacobian = fit.jacobian[rows] / scale
    return np.asarray(
        np.linalg.pinv(jacobian.T @ (jacobian * fit.weights[rows, np.newaxis]))
        / np.outer(scale, scale)
    )


def _classify_summits(
    reference: Surface, registered_map: Surface, worn: Booleans, noise: float
) -> tuple[Floats, Integers]:
    """Return positions and fates of the summits of the first map; only worn summits can be lost or lowered."""
    reference_summits, moving_summits = reference.summits(), registered_map.summits()
    if (
        reference_summits.x is None
        or reference_summits.y is None
        or moving_summits.x is None
        or moving_summits.y is None
        or not len(reference_summits)
    ):
        return np.empty((0, 2)), np.empty(0, dtype=np.int64)
    positions = np.stack([reference_summits.x, reference_summits.y], axis=-1) / reference.pixel_size
    indices = tuple(np.clip(np.rint(positions).astype(int), 0, np.array(reference.shape) - 1).T)
    is_lost, drop = np.ones(len(reference_summits), dtype=bool), np.zeros(len(reference_summits))
    if len(moving_summits):
        distance, nearest = spatial.cKDTree(
            np.stack([moving_summits.x, moving_summits.y], axis=-1) / reference.pixel_size
        ).query(positions)
        is_lost = distance > NEAR
        drop = reference_summits.height - moving_summits.height[nearest]
    fate = np.where(
        worn[indices],
        np.where(is_lost, LOST, np.where(drop > DETECTED * noise, LOWERED, KEPT)),
        KEPT,
    )
    has_height = np.isfinite(registered_map.heights[indices])
    return (positions * reference.pixel_size)[has_height], fate[has_height]
