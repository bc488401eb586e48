"""Points that are no heights of the surface: spikes of the instrument, dirt, and the edges of scratches."""

import numpy as np

from historysim.basics.array_types import Booleans, Floats

AROUND = 2
"""How many points far the neighbours of a point reach: 24 of them."""
ROWS_AT_ONCE = 64
GAUSSIAN = 1.4826
"""Standard deviation over median absolute deviation, of Gaussian values."""


def spikes(heights: Floats, threshold: float) -> Booleans:
    """Return which points are spikes: those that stand off the median of the points around them.

    Parameters
    ----------
    heights : array (nx, ny)
        Heights [m]; NaN where missing.
    threshold : float
        How many robust standard deviations of all such differences a spike stands off, up or down.

    Returns
    -------
    array (nx, ny) of bool
    """
    off = heights - _median_around(heights)
    present = np.isfinite(off)
    scale = _robust_deviation(off[present])
    result: Booleans = present & (np.abs(off) > threshold * scale)
    return result


def outliers(heights: Floats, threshold: float) -> Booleans:
    """Return which points are farther from the median height than so many robust standard deviations.

    Parameters
    ----------
    heights : array (nx, ny)
        Heights [m], without their form; NaN where missing.
    threshold : float

    Returns
    -------
    array (nx, ny) of bool
    """
    off = heights - np.nanmedian(heights)
    present = np.isfinite(off)
    result: Booleans = present & (np.abs(off) > threshold * _robust_deviation(off[present]))
    return result


def _robust_deviation(values: Floats) -> float:
    """Return the standard deviation by the median of |values|, or their mean where half of them are 0."""
    sizes = np.abs(values)
    median = float(np.median(sizes)) if sizes.size else 0.0
    return GAUSSIAN * median if median > 0 else float(np.sqrt(np.pi / 2) * sizes.mean()) if sizes.size else 0.0


def _median_around(heights: Floats) -> Floats:
    """Return the median of the points around each point, itself left out; NaN where all are missing."""
    from numpy.lib.stride_tricks import sliding_window_view

    wide = 2 * AROUND + 1
    # mirrored through its edges, so that a slope goes on and its border is no spike
    padded = np.pad(heights, AROUND, mode="reflect", reflect_type="odd")
    middle = wide * wide // 2
    result = np.empty(heights.shape)
    for first in range(0, heights.shape[0], ROWS_AT_ONCE):
        rows = padded[first : first + ROWS_AT_ONCE + 2 * AROUND]
        around = sliding_window_view(rows, (wide, wide)).reshape(rows.shape[0] - 2 * AROUND, heights.shape[1], -1)
        around = np.sort(np.delete(around, middle, axis=-1), axis=-1)
        # missing ones are sorted last
        count = np.isfinite(around).sum(axis=-1)
        lower, upper = (np.clip(index, 0, None)[..., None] for index in ((count - 1) // 2, count // 2))
        pair = [
            np.take_along_axis(around, np.minimum(index, middle * 2 - 1), axis=-1)[..., 0] for index in (lower, upper)
        ]
        result[first : first + ROWS_AT_ONCE] = np.where(count > 0, (pair[0] + pair[1]) / 2, np.nan)
    return result
