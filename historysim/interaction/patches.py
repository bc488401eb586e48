"""Patches: the connected parts of a contact."""

import numpy as np

from historysim.basics.array_types import Booleans, Integers


def patches_of(touching: Booleans, *, periodic: bool = False) -> Integers:
    """Return the number of the patch of each point (nx, ny), -1 where nothing touches; the largest patch is 0.

    Parameters
    ----------
    touching : array (nx, ny)
        Points in contact; those that meet at a side or a corner are of one patch.
    periodic : bool
        Whether the point after the last one is the first.
    """
    from scipy import ndimage
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not touching.any():
        return np.full(touching.shape, -1)
    labels, count = ndimage.label(touching, structure=np.ones((3, 3)))
    if periodic:
        meeting = []
        for edge, other in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1])):
            for shift in (-1, 0, 1):
                both = np.stack([edge, np.roll(other, shift)])
                meeting.append(both[:, (both > 0).all(axis=0)])
        pairs = np.concatenate(meeting, axis=1)
        graph = coo_array((np.ones(pairs.shape[1]), (pairs[0], pairs[1])), shape=(count + 1, count + 1))
        labels = connected_components(graph, directed=False)[1][labels]
    _, found = np.unique(np.where(touching, labels, -1), return_inverse=True)
    numbers = found.reshape(touching.shape) - (0 if touching.all() else 1)
    sizes = np.bincount(numbers[numbers >= 0])
    rank = np.empty(sizes.size, dtype=np.int64)
    rank[np.argsort(-sizes, kind="stable")] = np.arange(sizes.size)
    return np.where(numbers >= 0, rank[numbers], -1)
