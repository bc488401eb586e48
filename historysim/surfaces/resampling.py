"""A height map on the points of another grid, by cubic splines or by its Fourier series."""

import math
from typing import Literal, get_args

import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, checked, scalar
from historysim.basics.wording import nearest
from historysim.errors import InputError

Interpolation = Literal["spline", "fourier", "none"]
Pixel = tuple[float, float]

COINCIDENT = 1e-9  # distance in pixels within which two points are taken as one
# Points that a map is continued by beyond its border: a spline forgets by √3 - 2 = -0.27 a point, here to rounding.
MARGIN = 28


def centred(points: int, pixel: float) -> Floats:
    """Return the positions of points along an axis [m], counted from the middle."""
    return np.asarray((np.arange(points) - (points - 1) / 2) * pixel)


def resampled(
    heights: Floats,
    pixel_size: Pixel,
    *,
    periodic: bool,
    shape: tuple[int, int],
    onto: Pixel,
    shift: ArrayLike = (0.0, 0.0),
    rotation: float = 0.0,
    interpolation: Interpolation = "spline",
) -> Floats:
    """Return the heights at the points of another grid, with the map laid on its centre, shifted and turned.

    The map (nx, ny) is moved by ``shift`` [m] along x and y, and turned by ``rotation`` [rad] from x towards y. The
    other grid has ``shape`` points, ``onto`` [m] apart. The heights are exact where points coincide, NaN outside the
    map and where splines would need a missing point. What each interpolation takes: README.md, "Sum". One that cannot
    be had for this map, or a map and a profile, are an InputError.
    """
    offset, angle = _checked(heights.shape, shape, shift, rotation)
    _check_interpolation(interpolation, heights, pixel_size, onto, periodic=periodic, angle=angle)
    indices = _indices(heights.shape, pixel_size, shape, onto, shift=offset, angle=angle)
    if interpolation == "none":
        # all by one whole number, where each point on its own might be rounded to either side
        indices = [np.rint(index.flat[0]) + np.rint(index - index.flat[0]) for index in indices]
    x, y = (_place(index, size, periodic) for index, size in zip(indices, heights.shape, strict=True))
    if all(np.all((place == np.rint(place)) | np.isnan(place)) for place in (x, y)):
        return _picked(heights, x, y)
    if interpolation == "fourier":
        return _by_waves(heights, x.ravel(), y.ravel())
    return _by_splines(heights, x, y, periodic=periodic)


def _checked(
    have: tuple[int, ...], want: tuple[int, int], shift: ArrayLike, rotation: float
) -> tuple[tuple[float, float], float]:
    """Return the shift along x and y [m] and the rotation [rad]."""
    offset = checked("shift", shift)
    if offset.shape != (2,):
        raise InputError(f"shift has shape {offset.shape}; expected one length along x and one along y")
    angle = scalar("rotation", rotation)
    if any((here == 1) != (there == 1) for here, there in zip(have, want, strict=True)):
        raise InputError(
            f"surfaces of {have} and {want} points; expected two maps, or two profiles along the same axis"
        )
    narrow = [axis for axis in (0, 1) if have[axis] == 1]
    if narrow and (angle != 0 or any(offset[axis] != 0 for axis in narrow)):
        raise InputError("a profile was to be turned or moved aside; expected a shift along it")
    return (float(offset[0]), float(offset[1])), angle


def _check_interpolation(
    interpolation: str, heights: Floats, pixel_size: Pixel, onto: Pixel, *, periodic: bool, angle: float
) -> None:
    known = get_args(Interpolation)
    if interpolation not in known:
        raise InputError(f"interpolation is {interpolation!r}; {nearest(str(interpolation), known)}")
    steps = zip(heights.shape, pixel_size, onto, strict=True)
    if interpolation == "spline":
        problem = ""
    elif angle != 0:
        problem = "a surface that is turned; expected no rotation"
    elif interpolation == "none":
        alike = all(size == 1 or math.isclose(own, step, rel_tol=COINCIDENT / size) for size, own, step in steps)
        problem = "" if alike else f"pixels of {pixel_size} m and {onto} m; expected one pixel size"
    else:
        whole = periodic and not np.isnan(heights).any()
        problem = "" if whole else "a surface with a border or missing points; expected a periodic one without"
    if problem:
        raise InputError(f"interpolation is {interpolation!r} for {problem}, or 'spline'")


def _indices(
    have: tuple[int, ...], pixel_size: Pixel, want: tuple[int, int], onto: Pixel, *, shift: Pixel, angle: float
) -> list[Floats]:
    """Return where the points of the grid lie on the map along x and y, in pixels of the map from its first point."""
    x, y = (centred(size, pixel) - move for size, pixel, move in zip(want, onto, shift, strict=True))
    if angle == 0:
        positions = [x[:, None], y[None, :]]
    else:
        cosine, sine = np.cos(angle), np.sin(angle)
        positions = [cosine * x[:, None] + sine * y[None, :], cosine * y[None, :] - sine * x[:, None]]
    steps = zip(positions, pixel_size, have, strict=True)
    return [np.asarray(position / pixel + (size - 1) / 2, dtype=np.float64) for position, pixel, size in steps]


def _place(index: Floats, size: int, periodic: bool) -> Floats:
    """Return the fractional index on the map, NaN outside."""
    nearest_point = np.rint(index)
    index = np.where(np.abs(index - nearest_point) < COINCIDENT, nearest_point, index)
    return index % size if periodic else np.where((index >= 0) & (index <= size - 1), index, np.nan)


def _picked(heights: Floats, x: Floats, y: Floats) -> Floats:
    """Return the heights at whole indices, NaN outside the map."""
    inside = np.isfinite(x) & np.isfinite(y)
    points = tuple(np.nan_to_num(place).astype(np.int64) for place in (x, y))
    return np.where(inside, heights[points], np.nan)


def _by_splines(heights: Floats, x: Floats, y: Floats, *, periodic: bool) -> Floats:
    """Return the heights at fractional indices that broadcast; NaN outside, and beside a missing point."""
    from scipy import ndimage

    missing = np.isnan(heights)
    inside = np.isfinite(x) & np.isfinite(y)
    points = np.stack(np.broadcast_arrays(np.nan_to_num(x), np.nan_to_num(y)))
    if missing.any():
        # the spline needs a value everywhere; what it makes of these is taken out again
        heights = _filled(heights, missing, periodic)
        mode = "grid-wrap" if periodic else "nearest"
        inside &= ndimage.map_coordinates(missing.astype(np.float64), points, order=1, mode=mode) == 0
    if periodic:
        smooth: Floats = ndimage.map_coordinates(heights, points, order=3, mode="grid-wrap")
    else:
        # a slope goes on beyond the border, else the spline would be level there
        margins = [MARGIN if size > 1 else 0 for size in heights.shape]
        heights = np.pad(heights, [(margin, margin) for margin in margins], mode="reflect", reflect_type="odd")
        points += np.reshape(margins, (2, 1, 1))
        smooth = ndimage.map_coordinates(heights, points, order=3, mode="mirror")
    return np.where(inside, smooth, np.nan)


def _by_waves(heights: Floats, x: Floats, y: Floats) -> Floats:
    """Return the heights (m, n) at the fractional indices x (m,) by y (n,) of a periodic map without missing points."""
    result: Floats = _wave_weights(x, heights.shape[0]) @ heights @ _wave_weights(y, heights.shape[1]).T
    return result


def _wave_weights(index: Floats, count: int) -> Floats:
    """Return what each of count points that repeat adds at each index: the sum of all their waves, of weight 1/count.

    At a distance of t points sin(πt)/(n sin(πt/n)) for odd n, else sin(πt)/(n tan(πt/n)) (the Dirichlet kernels).
    """
    distance = index[:, None] - np.arange(count)
    # to the nearest copy of each point: one period on, sines beside their zeros would lose digits
    distance -= count * np.rint(distance / count)
    whole = np.rint(distance)
    # the sine of a difference, so that it is 0 at whole distances and keeps its digits beside them
    sine = np.where(whole % 2 == 0, 1.0, -1.0) * np.sin(np.pi * (distance - whole))
    angle = np.pi * distance / count
    with np.errstate(divide="ignore", invalid="ignore"):
        kernel = sine / (count * (np.sin(angle) if count % 2 else np.tan(angle)))
    result: Floats = np.where(distance == whole, whole % count == 0, kernel)
    return result


def _filled(heights: Floats, missing: Booleans, periodic: bool) -> Floats:
    """Return the map with each missing point at the mean of its neighbours, so that a slope goes on beside a gap."""
    from scipy import sparse

    points = np.argwhere(missing)
    number = np.zeros(heights.shape, dtype=np.int64)
    number[missing] = np.arange(len(points))
    neighbours, known = np.zeros(len(points)), np.zeros(len(points))
    pairs = []
    for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        beside = points + step
        wrapped = beside % heights.shape
        there = np.flatnonzero((wrapped == beside).all(axis=1)) if not periodic else np.arange(len(points))
        at = tuple(wrapped[there].T)
        neighbours[there] += 1
        known[there] += np.where(missing[at], 0.0, heights[at])
        pairs.append(np.stack([there, number[at]])[:, missing[at]])
    both = np.concatenate(pairs, axis=1)
    matrix = sparse.diags_array(neighbours) - sparse.coo_array((np.ones(both.shape[1]), both), shape=(len(points),) * 2)
    filled = heights.copy()
    # what is left after so many steps stands deep in a large gap, where nothing is interpolated
    filled[missing] = sparse.linalg.cg(matrix.tocsr(), known, rtol=1e-13, maxiter=1000)[0]
    return filled
