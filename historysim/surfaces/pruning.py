"""How far each summit rises above the saddle to a higher one: its prominence, by which minor ones are pruned."""

import numpy as np

from historysim.basics.array_types import Floats
from historysim.basics.library import lib, pointer


def prominences(heights: Floats, offsets: tuple[tuple[int, int], ...], *, periodic: bool = False) -> Floats:
    """Return the prominence of each local maximum: its height over the highest saddle on the way to a higher point.

    Points are flooded from the highest down. Where two hills meet, the lower one ends, with the height of its
    top over the meeting point: what Wolf pruning takes away in turn, the lowest hill first, is the same.

    Parameters
    ----------
    heights : array (nx, ny)
        Heights [m]; NaN where missing, which no way crosses.
    offsets : tuple of (int, int)
        Which points are neighbours.
    periodic : bool
        Whether the surface repeats.

    Returns
    -------
    array (nx, ny)
        Prominence [m] at the first point of each top; infinite where no way leads higher; 0 at all other points.
    """
    flat = np.ascontiguousarray(heights, dtype=np.float64).ravel()
    order = np.argsort(-flat, kind="stable")[: int(np.isfinite(flat).sum())]
    steps = np.array(offsets, dtype=np.int64)
    found, parent = np.empty(flat.size), np.empty(flat.size, dtype=np.int64)
    lib.hs_prominences(
        *heights.shape,
        pointer(flat),
        order.size,
        pointer(order),
        len(offsets),
        pointer(steps),
        periodic,
        pointer(found),
        pointer(parent),
    )
    return found.reshape(heights.shape)
