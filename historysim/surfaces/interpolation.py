"""Heights between the points of a map: by cubic splines, or by its Fourier series."""

import numpy as np

from historysim.basics.array_types import Booleans, Floats

MARGIN = 28
"""Points that a map is continued by beyond its border: a spline forgets by √3 - 2 = -0.27 a point, here to rounding."""


def by_splines(heights: Floats, x: Floats, y: Floats, *, periodic: bool) -> Floats:
    """Return the heights at fractional indices, by cubic splines.

    Parameters
    ----------
    heights : array (nx, ny)
        The map [m]; NaN where missing.
    x, y : array
        The indices, which broadcast; NaN outside the map.
    periodic : bool
        Whether the map repeats.

    Returns
    -------
    array
        In the common shape of the indices [m]; NaN outside, and where one of the four points around is missing.
    """
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


def by_waves(heights: Floats, x: Floats, y: Floats) -> Floats:
    """Return the heights at the fractional indices x (m,) by y (n,) of a periodic map, by its Fourier series.

    Parameters
    ----------
    heights : array (nx, ny)
        The map [m], without missing points.
    x, y : array (m,), (n,)
        The indices along x and y.

    Returns
    -------
    array (m, n)
        [m].
    """
    result: Floats = _waves(x, heights.shape[0]) @ heights @ _waves(y, heights.shape[1]).T
    return result


def _waves(index: Floats, count: int) -> Floats:
    """Return what each of count points that repeat adds at each index: the sum of all their waves, of weight 1/count.

    That is sin(πt)/(n sin(πt/n)) at a distance of t points for odd n, and sin(πt)/(n tan(πt/n)) for even n, where the
    shortest wave is a cosine (the Dirichlet kernels).
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
