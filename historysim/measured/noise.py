"""The noise of a channel, as its samples show it."""

import math

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked

FEWEST_SAMPLES = 32
"""Samples below which what looks like noise may be the strokes themselves."""
REVERSAL = 6.0
"""Deviations of the noise that a swing has at least, to be a reversal where nothing else is said."""


def noise_of(values: npt.ArrayLike) -> float:
    """Return the standard deviation of white noise on a smooth record, by its second differences.

    The median of their sizes is taken, so that turning points do not count. Of a channel that mostly stands still,
    since its last digit does, it is that of rounding, the least step over √12. 0 for fewer than three samples.
    """
    samples = checked("values", values)
    if samples.size < 3:
        return 0.0
    # the median of |x| is 0.674 σ, and a second difference adds up the variances 1 + 4 + 1
    white = float(np.median(np.abs(np.diff(samples, 2)))) / (0.6744897501960817 * math.sqrt(6))
    steps = np.abs(np.diff(samples))
    if white == 0 and np.median(steps) == 0 and steps.any():
        return float(steps[steps > 0].min()) / math.sqrt(12)
    return white
