"""Resampling of a height map on another grid, by cubic splines or by its Fourier series."""

import math
from typing import Literal, get_args

import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, as_floats, scalar
from historysim.basics.wording import nearest
from historysim.errors import InputError

Interpolation = Literal["spline", "fourier", "none"]
Pixel = tuple[float, float]

COINCIDENT = 1e-9  # distance in pixels within which two points coincide
# Points by which a map is extended beyond its border: a spline decays by √3 - 2 = -0.27 per point,
# here to rounding.
MARGIN = 28


def centred_positions(points: int, pixel: float) -> Floats:
    """Return the positions of points along an axis [m], counted from the middle."""
    return np.asarray((np.arange(points) - (points - 1) / 2) * pixel)


def resample(
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
    """Return the heights of a map, centred on another grid, shifted and rotated, at the points of that grid.

    The map (nx, ny) is shifted by ``shift`` [m] along x and y, and rotated by ``rotation`` [rad]
    from x towards y. The other grid has ``shape`` points, ``onto`` [m] apart. The heights are exact
    where points coincide, NaN outside the map and where splines would need a missing point.
    README.md, "Sum", describes the interpolations. InputError if the interpolation is not possible
    for this map, or one of map and grid is a profile.
    """
    offset, angle = _check_transform(heights.shape, shape, shift, rotation)
    _check_interpolation(interpolation, heights, pixel_size, onto, periodic=periodic, angle=angle)
    indices = _indices(heights.shape, pixel_size, shape, onto, shift=offset, angle=angle)
    if interpolation == "none":
        # one common shift, since single points might be rounded in different directions
        indices = [
            np.rint(position.flat[0]) + np.rint(position - position.flat[0]) for position in indices
        ]
    x, y = (
        _index_on_map(position, size, periodic)
        for position, size in zip(indices, heights.shape, strict=True)
    )
    if all(
        np.all((coordinate == np.rint(coordinate)) | np.isnan(coordinate)) for coordinate in (x, y)
    ):
        return _pick(heights, x, y)
    if interpolation == "fourier":
        return _interpolate_by_waves(heights, x.ravel(), y.ravel())
    return _interpolate_by_splines(heights, x, y, periodic=periodic)


def _check_transform(
    map_shape: tuple[int, ...], grid_shape: tuple[int, int], shift: ArrayLike, rotation: float
) -> tuple[tuple[float, float], float]:
    """Return the shift along x and y [m] and the rotation [rad]."""
    offset = as_floats("shift", shift)
    if offset.shape != (2,):
        raise InputError(
            f"shift has shape {offset.shape}; expected one length along x and one along y"
        )
    angle = scalar("rotation", rotation)
    if any(
        (map_points == 1) != (grid_points == 1)
        for map_points, grid_points in zip(map_shape, grid_shape, strict=True)
    ):
        raise InputError(
            f"surfaces of {map_shape} and {grid_shape} points; expected two maps, or two profiles along the same axis"
        )
    narrow = [axis for axis in (0, 1) if map_shape[axis] == 1]
    if narrow and (angle != 0 or any(offset[axis] != 0 for axis in narrow)):
        raise InputError(
            "a profile cannot be rotated or shifted sideways; expected a shift along it"
        )
    return (float(offset[0]), float(offset[1])), angle


def _check_interpolation(
    interpolation: str,
    heights: Floats,
    pixel_size: Pixel,
    onto: Pixel,
    *,
    periodic: bool,
    angle: float,
) -> None:
    methods = get_args(Interpolation)
    if interpolation not in methods:
        raise InputError(
            f"interpolation is {interpolation!r}; {nearest(str(interpolation), methods)}"
        )
    steps = zip(heights.shape, pixel_size, onto, strict=True)
    if interpolation == "spline":
        problem = ""
    elif angle != 0:
        problem = "a rotated surface; expected no rotation"
    elif interpolation == "none":
        alike = all(
            size == 1 or math.isclose(pixel, step, rel_tol=COINCIDENT / size)
            for size, pixel, step in steps
        )
        problem = "" if alike else f"pixels of {pixel_size} m and {onto} m; expected one pixel size"
    else:
        is_series = periodic and not np.isnan(heights).any()
        problem = (
            ""
            if is_series
            else "a surface with a border or missing points; expected a periodic one without"
        )
    if problem:
        raise InputError(f"interpolation is {interpolation!r} for {problem}, or 'spline'")


def _indices(
    map_shape: tuple[int, ...],
    pixel_size: Pixel,
    grid_shape: tuple[int, int],
    onto: Pixel,
    *,
    shift: Pixel,
    angle: float,
) -> list[Floats]:
    """Return the positions of the grid points on the map along x and y, in pixels from its first point."""
    x, y = (
        centred_positions(size, pixel) - move
        for size, pixel, move in zip(grid_shape, onto, shift, strict=True)
    )
    if angle == 0:
        positions = [x[:, None], y[None, :]]
    else:
        cosine, sine = np.cos(angle), np.sin(angle)
        positions = [
            cosine * x[:, None] + sine * y[None, :],
            cosine * y[None, :] - sine * x[:, None],
        ]
    steps = zip(positions, pixel_size, map_shape, strict=True)
    return [
        np.asarray(position / pixel + (size - 1) / 2, dtype=np.float64)
        for position, pixel, size in steps
    ]


def _index_on_map(index: Floats, size: int, periodic: bool) -> Floats:
    """Return the fractional index on the map, NaN outside."""
    nearest_point = np.rint(index)
    index = np.where(np.abs(index - nearest_point) < COINCIDENT, nearest_point, index)
    return index % size if periodic else np.where((index >= 0) & (index <= size - 1), index, np.nan)


def _pick(heights: Floats, x: Floats, y: Floats) -> Floats:
    """Return the heights at whole indices, NaN outside the map."""
    inside = np.isfinite(x) & np.isfinite(y)
    points = tuple(np.nan_to_num(index).astype(np.int64) for index in (x, y))
    return np.where(inside, heights[points], np.nan)


def _interpolate_by_splines(heights: Floats, x: Floats, y: Floats, *, periodic: bool) -> Floats:
    """Return the heights at fractional indices, which broadcast; NaN outside the map and next to a missing point."""
    from scipy import ndimage

    missing = np.isnan(heights)
    inside = np.isfinite(x) & np.isfinite(y)
    points = np.stack(np.broadcast_arrays(np.nan_to_num(x), np.nan_to_num(y)))
    if missing.any():
        # the spline needs a value everywhere; heights that depend on filled points are removed
        # below
        heights = _fill_missing(heights, missing, periodic)
        mode = "grid-wrap" if periodic else "nearest"
        inside &= (
            ndimage.map_coordinates(missing.astype(np.float64), points, order=1, mode=mode) == 0
        )
    if periodic:
        smooth: Floats = ndimage.map_coordinates(heights, points, order=3, mode="grid-wrap")
    else:
        # odd reflection continues a slope beyond the border, where the spline would otherwise be
        # level
        margins = [MARGIN if size > 1 else 0 for size in heights.shape]
        heights = np.pad(
            heights, [(margin, margin) for margin in margins], mode="reflect", reflect_type="odd"
        )
        points += np.reshape(margins, (2, 1, 1))
        smooth = ndimage.map_coordinates(heights, points, order=3, mode="mirror")
    return np.where(inside, smooth, np.nan)


def _interpolate_by_waves(heights: Floats, x: Floats, y: Floats) -> Floats:
    """Return the heights (m, n) at the fractional indices x (m,) by y (n,) of a periodic map without missing points."""
    result: Floats = (
        _wave_weights(x, heights.shape[0]) @ heights @ _wave_weights(y, heights.shape[1]).T
    )
    return result


def _wave_weights(index: Floats, count: int) -> Floats:
    """Return the weight of each of `count` periodic points at each index: the mean of all their Fourier modes.

    At a distance of t points sin(πt)/(n sin(πt/n)) for odd n, else sin(πt)/(n tan(πt/n)) (the
    Dirichlet kernels).
    """
    distance = index[:, None] - np.arange(count)
    # from the nearest periodic image, since sines lose digits near their zeros
    distance -= count * np.rint(distance / count)
    nearest_point = np.rint(distance)
    # the sine of a difference is exactly 0 at whole distances and keeps its digits near them
    sine = np.where(nearest_point % 2 == 0, 1.0, -1.0) * np.sin(np.pi * (distance - nearest_point))
    angle = np.pi * distance / count
    with np.errstate(divide="ignore", invalid="ignore"):
        kernel = sine / (count * (np.sin(angle) if count % 2 else np.tan(angle)))
    result: Floats = np.where(distance == nearest_point, nearest_point % count == 0, kernel)
    return result


def _fill_missing(heights: Floats, missing: Booleans, periodic: bool) -> Floats:
    """Fill each missing point by the mean of its neighbours (Laplace equation), which continues slopes into gaps."""
    from scipy import sparse

    points = np.argwhere(missing)
    number = np.zeros(heights.shape, dtype=np.int64)
    number[missing] = np.arange(len(points))
    neighbours, known_sum = np.zeros(len(points)), np.zeros(len(points))
    pairs = []
    for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        neighbour = points + step
        wrapped = neighbour % heights.shape
        on_map = (
            np.flatnonzero((wrapped == neighbour).all(axis=1))
            if not periodic
            else np.arange(len(points))
        )
        at = tuple(wrapped[on_map].T)
        neighbours[on_map] += 1
        known_sum[on_map] += np.where(missing[at], 0.0, heights[at])
        pairs.append(np.stack([on_map, number[at]])[:, missing[at]])
    both = np.concatenate(pairs, axis=1)
    matrix = sparse.diags_array(neighbours) - sparse.coo_array(
        (np.ones(both.shape[1]), both), shape=(len(points),) * 2
    )
    filled = heights.copy()
    # points not converged after 1000 steps are deep in a large gap, where no height is interpolated
    filled[missing] = sparse.linalg.cg(matrix.tocsr(), known_sum, rtol=1e-13, maxiter=1000)[0]
    return filled
