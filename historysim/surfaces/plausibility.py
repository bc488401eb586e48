"""Plausibility of a height map: codes of missing points, and its lateral scale."""

import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.limits import SMALLEST
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.surfaces.heights import Surface

# Numbers that programs write for missing points. Such a number, or any other, is reported if its
# distance from all other heights, over the range of the middle 80 % of the levels, exceeds one of
# these two limits. Spikes of a measurement, which `spikes` removes, are closer.
MISSING_CODES = (999.0, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0, 65535.0)
FAR_IF_CODE, FAR = 5.0, 1e3
FEWEST_LEVELS, MOST_CODES = 20, 3

# side of a map [m], and height range over it below which the side is implausible
LARGEST_SIZE, FLATTEST = 1.0, 1e-4
SMOOTHEST = 1e-6  # height range over the distance of the points below which that is implausible
# median step between neighbours over their distance above which that is implausible
STEEPEST = 20.0


def missing_code_notice(heights: Floats) -> str | None:
    """Return a notice if a few values, such as -9999, are far from all others and may be missing; otherwise None.

    Heights are in the unit of the file, in which such codes are round numbers.
    """
    values = heights[np.isfinite(heights)]
    levels = np.unique(values)
    if levels.size < FEWEST_LEVELS:
        return None
    low, high = np.quantile(levels, [0.1, 0.9])
    distance = np.maximum(low - levels, levels - high)
    is_code = np.isclose(np.abs(levels)[:, np.newaxis], MISSING_CODES, rtol=1e-6, atol=0).any(
        axis=1
    )
    far = levels[distance > np.where(is_code, FAR_IF_CODE, FAR) * (high - low)]
    # the flanks of a particle or a scratch have many levels
    if not 0 < far.size <= MOST_CODES:
        return None
    count = int(np.isin(values, far).sum())
    rest = levels[~np.isin(levels, far)]
    listed = ", ".join(f"{value:.10g}" for value in far)
    argument = listed if far.size == 1 else f"[{listed}]"
    return (
        f"{count_text(count, 'height is', 'heights are')} {listed}, all others are between {rest[0]:.4g} and "
        f"{rest[-1]:.4g}; for missing points give missing = {argument}, in the shell "
        f"{' '.join(f'--missing {value:.10g}' for value in far)}"
    )


def scale_notice(surface: Surface) -> str | None:
    """Return a notice if the spacing of the points is implausible compared with the heights; otherwise None."""
    heights = surface.heights
    height_range = float(np.nanmax(heights) - np.nanmin(heights))
    # a profile has no size along y
    axes = [axis for axis in (0, 1) if surface.shape[axis] > 1]
    if not height_range or not axes:
        return None
    side = max(surface.size[axis] for axis in axes)
    pixel = min(surface.pixel_size[axis] for axis in axes)
    if pixel < SMALLEST:
        # a separate error
        return None
    steps = np.abs(np.diff(heights, axis=axes[0]))
    steep = (
        float(np.nanmedian(steps)) / surface.pixel_size[axes[0]]
        if np.isfinite(steps).any()
        else 0.0
    )
    too_large = (
        side > LARGEST_SIZE and height_range < FLATTEST * side
    ) or height_range < SMOOTHEST * pixel
    if not too_large and steep <= STEEPEST:
        return None
    size = " × ".join(quantity_text(surface.size[axis], "m", 3) for axis in axes)
    return (
        f"the map is {size} large and {quantity_text(height_range, 'm', 3)} high, which is implausible; check the "
        "units of its lengths, also those that the file states"
    )
