"""How far each summit rises above the saddle to a higher one: its prominence, by which minor ones are pruned."""

from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.basics.compiled import compiled

Floats = npt.NDArray[np.float64]


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
    flat = heights.ravel()
    order = np.argsort(-flat, kind="stable")[: int(np.isfinite(flat).sum())]
    steps = np.array(offsets, dtype=np.int64)
    flooded: Any = _flooded
    found: Floats = flooded(flat, order, heights.shape[0], heights.shape[1], steps, periodic)
    return found.reshape(heights.shape)


@compiled
def _flooded(heights, order, nx, ny, steps, periodic):  # type: ignore[no-untyped-def] # numba knows the types
    parent = np.full(heights.size, -1)
    prominence = np.zeros(heights.size)
    for point in order:
        parent[point] = point
        top = -1
        for step in range(steps.shape[0]):
            i, j = point // ny + steps[step, 0], point % ny + steps[step, 1]
            if periodic:
                i, j = i % nx, j % ny
            elif i < 0 or j < 0 or i >= nx or j >= ny:
                continue
            other = i * ny + j
            if parent[other] < 0 or other == point:
                continue
            root = other
            while parent[root] != root:
                parent[root] = parent[parent[root]]
                root = parent[root]
            if top < 0:
                top = root
                parent[point] = top
            elif root != top:
                # the lower top ends here; of two at one height, that which comes later
                higher, lower = top, root
                if heights[root] > heights[top] or (heights[root] == heights[top] and root < top):
                    higher, lower = root, top
                prominence[lower] = heights[lower] - heights[point]
                parent[lower] = higher
                top = higher
        if top < 0:
            prominence[point] = np.inf
    return prominence
