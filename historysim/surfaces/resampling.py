"""A height map on the points of another grid."""

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked, scalar
from historysim.errors import InputError

Floats = npt.NDArray[np.float64]

COINCIDENT = 1e-9
"""Distance in pixels within which two points are taken as one."""
MARGIN = 28
"""Points that a map is continued by beyond its border: a spline forgets by √3 - 2 = -0.27 a point, here to rounding."""


def resampled(
    heights: Floats,
    pixel_size: tuple[float, float],
    *,
    periodic: bool,
    shape: tuple[int, int],
    onto: tuple[float, float],
    shift: npt.ArrayLike = (0.0, 0.0),
    rotation: float = 0.0,
) -> Floats:
    """Return the heights at the points of another grid, on whose centre the map is laid, shifted and turned.

    Parameters
    ----------
    heights : array (nx, ny)
        The map [m]; NaN where missing.
    pixel_size : (float, float)
        Its pixel size [m].
    periodic : bool
        Whether it repeats.
    shape, onto : (int, int), (float, float)
        Number of points and pixel size [m] of the other grid.
    shift : (float, float)
        How far the map is moved along x and y [m].
    rotation : float
        By how much the map is turned about its centre, from x towards y [rad].

    Returns
    -------
    array (shape)
        Cubic splines between the points [m]; exact where points coincide; NaN outside the map, and where one of the
        points around is missing.

    Raises
    ------
    InputError
        A shift or rotation that is not finite, or one of the two a profile and the other not along the same axis.
    """
    offset = checked("shift", shift)
    if offset.shape != (2,):
        raise InputError(f"shift has shape {offset.shape}; expected one length along x and one along y")
    angle = scalar("rotation", rotation)
    if any((have == 1) != (want == 1) for have, want in zip(heights.shape, shape, strict=True)):
        raise InputError(
            f"surfaces of {heights.shape} and {shape} points; expected two maps, or two profiles along the same axis"
        )
    narrow = [axis for axis in (0, 1) if heights.shape[axis] == 1]
    if narrow and (angle != 0 or any(offset[axis] != 0 for axis in narrow)):
        raise InputError("a profile was to be turned or moved aside; expected a shift along it")
    x, y = (
        (np.arange(size) - (size - 1) / 2) * pixel - move for size, pixel, move in zip(shape, onto, offset, strict=True)
    )
    if angle == 0:
        positions = [x[:, None], y[None, :]]
    else:
        cosine, sine = np.cos(angle), np.sin(angle)
        positions = [
            cosine * x[:, None] + sine * y[None, :],
            cosine * y[None, :] - sine * x[:, None],
        ]
    places = [
        _place(position / pixel + (size - 1) / 2, size, periodic)
        for position, pixel, size in zip(positions, pixel_size, heights.shape, strict=True)
    ]
    if all(np.all((place == np.rint(place)) | np.isnan(place)) for place in places):
        return _picked(heights, places)
    return _interpolated(heights, places, periodic)


def _place(index: Floats, size: int, periodic: bool) -> Floats:
    """Give the fractional index on the map, NaN outside."""
    nearest = np.rint(index)
    index = np.where(np.abs(index - nearest) < COINCIDENT, nearest, index)
    return index % size if periodic else np.where((index >= 0) & (index <= size - 1), index, np.nan)


def _picked(heights: Floats, places: list[Floats]) -> Floats:
    inside = np.isfinite(places[0]) & np.isfinite(places[1])
    columns = tuple(np.nan_to_num(place).astype(np.int64) for place in places)
    return np.where(inside, heights[columns], np.nan)


def _interpolated(heights: Floats, places: list[Floats], periodic: bool) -> Floats:
    from scipy import ndimage

    missing = np.isnan(heights)
    inside = np.isfinite(places[0]) & np.isfinite(places[1])
    points = np.stack(np.broadcast_arrays(*map(np.nan_to_num, places)))
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


def _filled(heights: Floats, missing: npt.NDArray[np.bool_], periodic: bool) -> Floats:
    """Give the map with each missing point at the mean of its neighbours, so that a slope goes on beside a gap."""
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
