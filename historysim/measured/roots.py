"""Roots and minima of functions of one number, without the second that scipy.optimize takes to import."""

import math
from collections.abc import Callable

ROUNDING = 4 * 2.0**-52  # relative accuracy of a root at any tolerance
GOLDEN = (math.sqrt(5) - 1) / 2
MOST_STEPS = 100


def find_root(
    function: Callable[[float], float], low: float, high: float, tolerance: float
) -> float:
    """Find the root between two numbers at which a function has opposite signs.

    Brent's method: inverse interpolation, and bisection where that is not faster (R. P. Brent,
    *Algorithms for Minimization without Derivatives*, 1973, chapter 4).
    """
    previous, current = low, high
    f_previous, f_current = function(previous), function(current)
    if f_previous == 0:
        return previous
    opposite, f_opposite, step, step_before = previous, f_previous, 0.0, 0.0
    for _ in range(MOST_STEPS):
        if f_previous * f_current < 0:
            opposite, f_opposite = previous, f_previous
            step = step_before = current - previous
        if abs(f_opposite) < abs(f_current):
            previous, current, opposite = current, opposite, current
            f_previous, f_current, f_opposite = f_current, f_opposite, f_current
        least = (tolerance + ROUNDING * abs(current)) / 2
        half = (opposite - current) / 2
        if f_current == 0 or abs(half) < least:
            break
        interpolated = math.inf
        if abs(step_before) > least and abs(f_current) < abs(f_previous):
            slope = (f_previous - f_current) / (previous - current)
            rise, divisor = 1.0, slope
            if previous != opposite:
                far_slope = (f_opposite - f_current) / (opposite - current)
                rise = f_opposite * far_slope - f_previous * slope
                divisor = far_slope * slope * (f_opposite - f_previous)
            if divisor != 0:
                interpolated = -f_current * rise / divisor
        if 2 * abs(interpolated) < min(abs(step_before), 3 * abs(half) - least):
            step_before, step = step, interpolated
        else:
            step_before = step = half
        previous, f_previous = current, f_current
        current += step if abs(step) > least else math.copysign(least, half)
        f_current = function(current)
    return current


def find_minimum(
    function: Callable[[float], float], low: float, high: float, tolerance: float
) -> tuple[float, float]:
    """Find the minimum of a function with one valley between two numbers, by golden sections: where, and its value."""
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    values = [function(inner[0]), function(inner[1])]
    while high - low > tolerance:
        if values[0] < values[1]:
            high = inner[1]
            inner = [high - GOLDEN * (high - low), inner[0]]
            values = [function(inner[0]), values[0]]
        else:
            low = inner[0]
            inner = [inner[1], low + GOLDEN * (high - low)]
            values = [values[1], function(inner[1])]
    best = values.index(min(values))
    return inner[best], values[best]
