"""A height map on the points of another grid."""

import numpy as np
import numpy.typing as npt

from historysim.contact.hertz import checked
from historysim.errors import InputError

Floats = npt.NDArray[np.float64]

COINCIDENT = 1e-9
"""Distance in pixels within which two points are taken as one."""


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
    angle = float(checked("rotation", rotation))
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
    mode = "grid-wrap" if periodic else "mirror"
    inside = np.isfinite(places[0]) & np.isfinite(places[1])
    points = np.stack(np.broadcast_arrays(*map(np.nan_to_num, places)))
    if missing.any():
        # the spline needs a value everywhere; what it makes of these is taken out again
        nearest = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
        heights = heights[tuple(nearest)]
        inside &= ndimage.map_coordinates(missing.astype(np.float64), points, order=1, mode=mode) == 0
    smooth: Floats = ndimage.map_coordinates(heights, points, order=3, mode=mode)
    return np.where(inside, smooth, np.nan)
