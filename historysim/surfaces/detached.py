"""Summits that stand apart above all others: spikes and dirt more often than roughness."""

import numpy as np
import numpy.typing as npt

HANDFUL = 10
"""The most summits that are taken for outliers."""
TAIL = 100
"""Summits below them that tell how the heights go on."""
CHANCE = 1e-6
"""The chance of such a gap in heights that go on as the others do, below which summits stand apart."""


def detached_summits(height: npt.ArrayLike) -> int:
    """Return how many of the highest summits stand apart from all others, 0 where none do.

    The heights of the `TAIL` summits below a gap are taken as the tail of a distribution that falls exponentially with
    the mean excess s; Gaussian tails fall faster. The gap between the k-th and the next highest of such heights is
    exponential with mean s/k (Rényi), so that one of g or more has the chance exp(-k g/s).

    Parameters
    ----------
    height : array_like (summit)
        Heights of the summits over any datum [m].

    Returns
    -------
    int
        From 0 to `HANDFUL`; 0 where there are fewer summits than `TAIL` and a handful.
    """
    heights = np.asarray(height, dtype=np.float64)
    if heights.size <= TAIL + HANDFUL:
        return 0
    tail = np.sort(np.partition(heights, heights.size - TAIL - HANDFUL - 1)[-TAIL - HANDFUL - 1 :])[::-1]
    for count in range(HANDFUL, 0, -1):
        gap = tail[count - 1] - tail[count]
        scale = tail[count : count + TAIL].mean() - tail[count + TAIL]
        if count * gap > -np.log(CHANCE) * scale:
            return count
    return 0
