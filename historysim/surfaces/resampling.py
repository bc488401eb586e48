"""A height map on the points of another grid."""

import math
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked, scalar
from historysim.basics.array_types import Floats
from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.surfaces.interpolation import by_splines, by_waves

Interpolation = Literal["spline", "fourier", "none"]

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
    interpolation: Interpolation = "spline",
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
    interpolation : {"spline", "fourier", "none"}
        What stands between the points of the map. ``"spline"``: cubic splines. ``"fourier"``: the Fourier series of a
        periodic map, which has to be without missing points and is not turned. ``"none"``: nothing; the map is moved
        by the nearest whole number of pixels, which has to have one pixel size with the other grid and is not turned.

    Returns
    -------
    array (shape)
        Heights [m]; exact where points coincide; NaN outside the map, and where splines would need a missing point.

    Raises
    ------
    InputError
        A shift or rotation that is not finite; one of the two a profile and the other not along the same axis;
        another interpolation, or one that cannot be had for this map.

    Notes
    -----
    **Splines smooth** waves shorter than some four pixels, most of all halfway between the points. What that does to
    the summits by the 9-point rule, on random maps of 256 × 256 points with autocorrelation lengths of 5 to 40 pixels:

    ===============  ==============================  =====================  ================
    autocorrelation  the map is                      summits per area       mean radius
    ===============  ==============================  =====================  ================
    exponential      moved by ½ pixel along x and y  24 to 27 % fewer       39 to 40 % more
    exponential      moved by ½ pixel along x        12 to 15 % fewer       18 to 19 % more
    exponential      turned by 0.3 rad               9 to 11 % fewer        17 to 18 % more
    gaussian         moved by ½ pixel                the same within 1 %    the same
    ===============  ==============================  =====================  ================

    The Fourier series and whole pixels leave all of them as they are, within the statistical error.

    **The Fourier series** moves each wave of the map and keeps its amplitude, except for the shortest wave, of two
    pixels, which exists where the number of points along an axis is even (the Nyquist component). The points tell its
    cosine alone, since its sine is 0 at each of them, and this cosine stands between them. Moved by a fraction s of
    a pixel it has cos(πs) of its amplitude left at the points: nothing for half a pixel. With an odd number of points
    no wave is lost. On pixels larger than its own the series is sampled there, not averaged.
    """
    offset, angle = _checked(heights.shape, shape, shift, rotation)
    _check_interpolation(interpolation, heights, pixel_size, onto, periodic=periodic, angle=angle)
    indices = _indices(heights.shape, pixel_size, shape, onto, offset, angle)
    if interpolation == "none":
        # all by one whole number, where each point on its own might be rounded to either side
        indices = [np.rint(index.flat[0]) + np.rint(index - index.flat[0]) for index in indices]
    x, y = (_place(index, size, periodic) for index, size in zip(indices, heights.shape, strict=True))
    if all(np.all((place == np.rint(place)) | np.isnan(place)) for place in (x, y)):
        return _picked(heights, x, y)
    if interpolation == "fourier":
        return by_waves(heights, x.ravel(), y.ravel())
    return by_splines(heights, x, y, periodic=periodic)


def _checked(
    have: tuple[int, ...], want: tuple[int, int], shift: npt.ArrayLike, rotation: float
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
    interpolation: str,
    heights: Floats,
    pixel_size: tuple[float, float],
    onto: tuple[float, float],
    *,
    periodic: bool,
    angle: float,
) -> None:
    """Check that an interpolation is one, and can be had for a map."""
    known = get_args(Interpolation)
    if interpolation not in known:
        raise InputError(f"interpolation is {interpolation!r}; {nearest(str(interpolation), known)}")
    if interpolation == "spline":
        return
    if angle != 0:
        raise InputError(
            f"interpolation is {interpolation!r} for a surface that is turned; expected no rotation, or 'spline'"
        )
    if interpolation == "none":
        steps = zip(heights.shape, pixel_size, onto, strict=True)
        if not all(size == 1 or math.isclose(own, step, rel_tol=COINCIDENT / size) for size, own, step in steps):
            raise InputError(
                f"interpolation is 'none' between pixels of {pixel_size} m and {onto} m; expected one pixel size, or "
                "'fourier' or 'spline'"
            )
    elif not periodic or np.isnan(heights).any():
        what = "has missing points" if periodic else "is not periodic"
        raise InputError(
            f"interpolation is 'fourier' for a surface that {what}; expected a periodic one with all its points, or "
            "'spline'"
        )


def _indices(
    have: tuple[int, ...],
    pixel_size: tuple[float, float],
    want: tuple[int, int],
    onto: tuple[float, float],
    shift: tuple[float, float],
    angle: float,
) -> list[Floats]:
    """Return where the points of the grid lie on the map along x and y, in pixels of the map from its first point."""
    x, y = (
        (np.arange(size) - (size - 1) / 2) * pixel - move for size, pixel, move in zip(want, onto, shift, strict=True)
    )
    if angle == 0:
        positions = [x[:, None], y[None, :]]
    else:
        cosine, sine = np.cos(angle), np.sin(angle)
        positions = [
            cosine * x[:, None] + sine * y[None, :],
            cosine * y[None, :] - sine * x[:, None],
        ]
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
