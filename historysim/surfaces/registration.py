"""Two height maps of one place, before and after: how the second lies on the first, and what was lost."""

import math
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from scipy import ndimage, spatial

from historysim.basics.arguments import Booleans, Floats, Integers, scalar
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.reading import read_surface
from historysim.surfaces.resampling import COINCIDENT, centred, resampled

LEAST_OVERLAP = 0.25  # share of the first map that the second has to cover
LEAST_CORRELATION = 0.5  # of the slopes of both maps where they overlap, below which they do not show one place
MOST_ROUNDS = 60  # Gauss-Newton steps; ten are common
SETTLED = 1e-4  # step, in pixels, at which the search ends
BLOCK = 8  # points along either side of squares: how far the noise of neighbours is alike shows in the means of squares
TUKEY = 4.685  # residuals beyond this many deviations have no weight: 95 % efficiency on Gaussian noise (Huber 2009)
NORMAL = 1.4826  # deviation of Gaussian numbers over their median deviation
DETECTED = 5.0  # deviations of the noise by which the mean of 3 × 3 points has to be lower to count as worn
RIM = 1.5  # deviations by which points beside worn ones have to be lower to count with them
PASSES = 3  # fits without the points that the fit before has found worn
MARGIN = 2  # points around worn ones that are counted with them, since a worn cap is thin at its rim
NEAR = 1.5  # pixels within which a summit of the second map is the same as one of the first
KEPT, LOWERED, LOST = range(3)  # what became of a summit


@attrs.frozen(eq=False)
class Registration:
    """What `registered` found."""

    shift: tuple[float, float]  #: how far the second map has to be moved along x and y to lie on the first [m]
    shift_error: float  #: standard error of either [m]
    rotation: float  #: by how much it has to be turned about its centre first, from x towards y [rad]
    offset: float  #: mean height of the second map over the first where nothing is worn [m], which is taken off
    tilt: tuple[float, float]  #: slope of the second map over the first along x and y, which is taken off
    correlation: float  #: of the slopes of the two maps where they overlap
    #: The second map on the points of the first, without offset and tilt; missing where they do not overlap.
    after: Surface = attrs.field(repr=False)
    difference: Surface = attrs.field(repr=False)  #: first less second map [m]: positive where material was lost
    worn: Booleans = attrs.field(repr=False)  #: (nx, ny) points that lost material
    noise: float  #: standard deviation of the difference where nothing is worn [m], interpolation included
    worn_volume: float  #: volume lost in `worn` [m³]; what is thinner than the noise is not found
    worn_volume_error: float  #: its standard error from the noise, the datum and the rim of what is worn [m³]
    #: (summit, 2) x and y of the summits of the first map within the overlap, by the 9-point rule [m].
    summit_place: Floats = attrs.field(repr=False)
    #: (summit) `KEPT`; `LOST` without a summit of the second map within 1.5 pixels; `LOWERED` with one that is lower by
    #: more than five deviations of the noise.
    fate: Integers = attrs.field(repr=False)

    @property
    def worn_area(self) -> float:
        """Nominal area of the points that lost material [m²]."""
        return int(self.worn.sum()) * math.prod(self.difference.pixel_size)

    def summary(self) -> list[tuple[str, str]]:
        """Return what was found, in a few lines (label, text)."""
        x, y = (quantity_text(value, "m") for value in self.shift)
        flattened = int((self.fate == LOWERED).sum())
        share = 100 * float(self.worn.mean())
        volume = f"{self.worn_volume * 1e18:.4g} ± {self.worn_volume_error * 1e18:.2g} µm³"
        doubt = "; not significant" if abs(self.worn_volume) < 2 * self.worn_volume_error else ""
        return [
            ("shift", f"{x} along x, {y} along y, each ± {quantity_text(self.shift_error, 'm')}"),
            ("rotation", f"{math.degrees(self.rotation):.3f}°"),
            ("correlation of slopes", f"{self.correlation:.3f}"),
            ("noise of the difference", quantity_text(self.noise, "m")),
            ("worn area", f"{self.worn_area * 1e12:.4g} µm², {share:.3g} % of the first map"),
            ("worn volume", volume + doubt),
            ("summits", f"{self.fate.size:,}; {(self.fate == LOST).sum():,} lost, {flattened:,} flattened"),
        ]


def registered(
    before: Surface | str | Path, after: Surface | str | Path, *, most_rotation: float = 1.0
) -> Registration:
    """Lay a second height map of one place on the first, and return what was lost between them.

    Up to about a third of the area may be worn: shift, rotation, offset and tilt are found by least squares of the
    height difference with Tukey's weights.

    Parameters
    ----------
    before, after : Surface, or the path of a height map
        Both of one side of one body, not mirrored. A second map of another pixel size is resampled.
    most_rotation : float
        Largest rotation that is looked for, either way [degrees], from 0 to 10.

    Raises
    ------
    InputError
        If a map is a profile, the maps do not overlap by a quarter of the first or do not correlate, or scikit-image
        is not installed.
    """
    first, second = (one if isinstance(one, Surface) else read_surface(one) for one in (before, after))
    if 1 in first.shape or 1 in second.shape:
        raise InputError("a profile cannot be registered; expected two height maps")
    most = scalar("most_rotation", most_rotation, least=0)
    if most > 10:
        raise InputError(f"most_rotation is {most:g}°; expected at most 10°: turn one of the maps before")
    if not np.allclose(first.pixel_size, second.pixel_size, rtol=COINCIDENT, atol=0):
        second = second.at_resolution(first.pixel_size)
    fit = _fitted(
        first, second, _initial_parameters(first, second, math.radians(most)), np.zeros(first.shape, dtype=bool)
    )
    for _ in range(PASSES):
        # the thin rims of what is worn would lower the datum
        fit = _fitted(first, second, fit.parameters, _worn(first.heights - fit.laid))
    return _compared(first, fit)


@attrs.frozen(eq=False)
class _Fit:
    """The second map laid on the first: parameters (shift x, y [m], rotation, offset [m], tilt x, y) and their use."""

    laid: Floats
    parameters: Floats
    jacobian: Floats
    weights: Floats


def _laid(second: Surface, onto: Surface, shift: Floats, rotation: float) -> Floats:
    """Return the heights of the second map on the points of the first (nx, ny) [m]."""
    return resampled(
        second.heights,
        second.pixel_size,
        periodic=False,
        shape=onto.shape,
        onto=onto.pixel_size,
        shift=shift,
        rotation=rotation,
    )


def _initial_parameters(first: Surface, second: Surface, most_rotation: float) -> Floats:
    """Return the parameters from which the fit starts: the shift by phase correlation at the best of some rotations."""
    correlate_phases = _import_phase_correlation()
    # from one rotation to the next, the ends of the map move by two pixels
    count = math.ceil(most_rotation * max(second.shape) / 4)
    # a tilt would correlate with itself at any shift
    reference, level = first.detrended("plane"), second.detrended("plane")
    best, start = -math.inf, np.zeros(6)
    for rotation in np.linspace(-most_rotation, most_rotation, 2 * count + 1):
        turned = _laid(level, level, np.zeros(2), float(rotation))
        pixels = correlate_phases(
            reference.heights,
            turned,
            reference_mask=~reference.missing,
            moving_mask=np.isfinite(turned),
            overlap_ratio=LEAST_OVERLAP,
        )[0]
        shift = pixels * first.pixel_size
        correlation = _correlation(reference.heights, _laid(level, reference, shift, float(rotation)))
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


def _fitted(first: Surface, second: Surface, start: Floats, worn: Booleans) -> _Fit:
    """Return the least squares of the height difference with Tukey's weights, by Gauss-Newton steps, without `worn`."""
    parameters = start.copy()
    x, y = np.meshgrid(*map(centred, first.shape, first.pixel_size), indexing="ij")
    for _ in range(MOST_ROUNDS):
        laid = _laid(second, first, parameters[:2], parameters[2])
        slope_x, slope_y = np.gradient(laid, *first.pixel_size)
        turned = (y - parameters[1]) * slope_x - (x - parameters[0]) * slope_y
        columns = [-slope_x, -slope_y, turned, -np.ones_like(x), -x, -y]
        residual = laid - first.heights - parameters[3] - parameters[4] * x - parameters[5] * y
        there = np.isfinite(residual + turned)
        used = there & ~worn
        if there.sum() < LEAST_OVERLAP * np.count_nonzero(~first.missing) or used.sum() < 3 * parameters.size:
            raise InputError(
                f"the two maps overlap by less than {LEAST_OVERLAP:.0%} of the first, do not show one place, or are "
                "worn all over; expected maps of one place"
            )
        jacobian = np.stack([column[used] for column in columns], axis=-1)
        weights, scale = _tukey(residual[used]), _greatest(jacobian)
        root = np.sqrt(weights)
        step = np.linalg.lstsq(jacobian / scale * root[:, np.newaxis], -residual[used] * root, rcond=None)[0] / scale
        parameters += step
        # shift in pixels, rotation by what it moves the ends of the map
        if np.abs(step[:2] / first.pixel_size).max() < SETTLED and abs(step[2]) * max(first.shape) < SETTLED:
            break
    everywhere = np.full(first.shape, 0.0)
    everywhere[used] = weights
    design = np.full((*first.shape, len(columns)), np.nan)
    design[used] = jacobian
    laid = _laid(second, first, parameters[:2], parameters[2])
    level = laid - parameters[3] - parameters[4] * x - parameters[5] * y
    return _Fit(level, parameters, design, everywhere)


def _greatest(jacobian: Floats) -> Floats:
    """Return the greatest size of each column, 1 for one of zeros."""
    scale = np.abs(jacobian).max(axis=0)
    return np.where(scale == 0, 1.0, scale)


def _tukey(residual: Floats) -> Floats:
    away = np.abs(residual - np.median(residual))
    scale = TUKEY * max(NORMAL * float(np.median(away)), np.finfo(float).tiny)
    # maps without noise have a scale next to 0
    return (1 - (np.minimum(away, scale) / scale) ** 2) ** 2


def _compared(first: Surface, fit: _Fit) -> Registration:
    difference = first.heights - fit.laid
    there = np.isfinite(difference)
    correlation = _correlation(first.heights, fit.laid)
    if not correlation > LEAST_CORRELATION:
        raise InputError(
            f"the slopes of the two maps correlate by {correlation:.2f} at best, so that they do not show one place; "
            "expected the same side of one body, rotated by no more than most_rotation, neither mirrored nor inverted"
        )
    worn = _worn(difference)
    sound = there & ~worn
    noise = NORMAL * float(np.median(np.abs(difference[sound] - np.median(difference[sound]))))
    alike = _alike(np.where(sound, difference, np.nan), noise)
    area = math.prod(first.pixel_size)
    covariance = _covariance(fit, sound) * noise**2 * alike
    # an error of the datum under the worn points is an error of their volume
    datum = np.nansum(fit.jacobian[worn], axis=0)
    # around what is worn any thickness up to that which is seen may be missing, or counted
    rim = int((ndimage.binary_dilation(worn) & sound).sum()) * RIM * noise / (3 * math.sqrt(12))
    variance = worn.sum() * noise**2 * alike + datum @ covariance @ datum + rim**2
    after = Surface(fit.laid, first.pixel_size)
    place, fate = _fates(first, after, worn, noise)
    return Registration(
        shift=(float(fit.parameters[0]), float(fit.parameters[1])),
        shift_error=math.sqrt(covariance[:2, :2].diagonal().mean()),
        rotation=float(fit.parameters[2]),
        offset=float(fit.parameters[3]),
        tilt=(float(fit.parameters[4]), float(fit.parameters[5])),
        correlation=correlation,
        after=after,
        difference=Surface(difference, first.pixel_size),
        worn=worn,
        noise=noise,
        worn_volume=float(difference[worn].sum()) * area,
        worn_volume_error=math.sqrt(variance) * area,
        summit_place=place,
        fate=fate,
    )


def _correlation(first: Floats, second: Floats) -> float:
    """Return the correlation of the slopes of two maps; heights of long waves would be alike by chance."""
    known = np.isfinite(first + second)
    slopes = [
        np.stack(np.gradient(ndimage.uniform_filter(np.where(known, heights, 0.0), 3))) for heights in (first, second)
    ]
    # where all that went into a slope is known
    used = ndimage.binary_erosion(known, np.ones((5, 5)))
    ours, theirs = (slope[:, used].ravel() for slope in slopes)
    return float(np.corrcoef(ours, theirs)[0, 1]) if used.any() else 0.0


def _worn(difference: Floats) -> Booleans:
    """Return where the mean of 3 × 3 points is lower than the noise of such means explains, with a margin."""
    there = np.isfinite(difference)
    weight = ndimage.uniform_filter(there.astype(float), 3, mode="constant")
    mean = ndimage.uniform_filter(np.where(there, difference, 0.0), 3, mode="constant") / np.maximum(weight, 1e-9)
    middle = np.median(mean[there])
    spread = NORMAL * np.median(np.abs(mean[there] - middle))
    low = ndimage.binary_propagation(mean > middle + DETECTED * spread, mask=mean > middle + RIM * spread) & there
    return np.asarray(ndimage.binary_dilation(low, iterations=MARGIN) & there if low.any() else low)


def _alike(difference: Floats, noise: float) -> float:
    """Return the variance of a sum over neighbouring points over that of independent ones, at least 1."""
    nx, ny = (n // BLOCK * BLOCK for n in difference.shape)
    blocks = difference[:nx, :ny].reshape(nx // BLOCK, BLOCK, ny // BLOCK, BLOCK).mean(axis=(1, 3))
    means = blocks[np.isfinite(blocks)]
    return max(1.0, float(means.var()) * BLOCK**2 / noise**2) if means.size > 1 and noise else 1.0


def _covariance(fit: _Fit, sound: Booleans) -> Floats:
    """Return the covariance of the parameters for a noise of 1."""
    rows = sound & (fit.weights > 0)
    scale = _greatest(fit.jacobian[rows])
    jacobian = fit.jacobian[rows] / scale
    return np.asarray(np.linalg.pinv(jacobian.T @ (jacobian * fit.weights[rows, np.newaxis])) / np.outer(scale, scale))


def _fates(first: Surface, after: Surface, worn: Booleans, noise: float) -> tuple[Floats, Integers]:
    """Return the places of the summits of the first map, and what became of them; only worn ones can be lost."""
    ours, theirs = first.summits(), after.summits()
    if ours.x is None or ours.y is None or theirs.x is None or theirs.y is None or not len(ours):
        return np.empty((0, 2)), np.empty(0, dtype=np.int64)
    places = np.stack([ours.x, ours.y], axis=-1) / first.pixel_size
    at = tuple(np.clip(np.rint(places).astype(int), 0, np.array(first.shape) - 1).T)
    gone, drop = np.ones(len(ours), dtype=bool), np.zeros(len(ours))
    if len(theirs):
        far, nearest = spatial.cKDTree(np.stack([theirs.x, theirs.y], axis=-1) / first.pixel_size).query(places)
        gone = far > NEAR
        drop = ours.height - theirs.height[nearest]
    fate = np.where(worn[at], np.where(gone, LOST, np.where(drop > DETECTED * noise, LOWERED, KEPT)), KEPT)
    known = np.isfinite(after.heights[at])
    return (places * first.pixel_size)[known], fate[known]
