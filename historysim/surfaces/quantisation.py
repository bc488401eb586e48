"""Heights that come in steps: whether they are fine enough for the radii of summits."""

import numpy as np
import numpy.typing as npt

from historysim.basics.units import quantity_text
from historysim.surfaces.heights import Surface

LEAST_STEPS = 5
"""Steps that the median summit should rise over its neighbours, so that its radius is told to some 10 %."""


def height_step(heights: npt.ArrayLike) -> float:
    """Return the step in which heights come [m]: the median one between neighbouring levels; 0 where all are one."""
    values = np.asarray(heights, dtype=np.float64)
    levels = np.unique(values[np.isfinite(values)])
    steps = np.diff(levels)
    # the same level with other last digits is no step
    steps = steps[steps > 1e-9 * (levels[-1] - levels[0])] if steps.size else steps
    return float(np.median(steps)) if steps.size else 0.0


def quantisation_notice(surface: Surface) -> str | None:
    """Return that the heights, as they were measured, are too coarse for the radii of summits; None where they are not.

    Parameters
    ----------
    surface : Surface
        As it was read, before any filter or form.
    """
    step = height_step(surface.heights)
    summits = surface.summits(3 if 1 in surface.shape else 9)
    if step == 0 or not len(summits):
        return None
    pixel = max(surface.pixel_size)
    # drop to the neighbours on average: p²/(2R)
    steps = float(np.median(pixel**2 / (2 * summits.radius))) / step
    if steps >= LEAST_STEPS:
        return None
    return (
        f"heights come in steps of {quantity_text(step, 'm', 2)}, and the median summit rises {steps:.2g} steps over "
        "its neighbours: unfiltered, radii of summits come in bands that are noise of the instrument; filter with "
        "s_filter"
    )
