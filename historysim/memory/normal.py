"""The normal curve of asperities: the load P(a) at an approach, and the approach at a load."""

import math

from historysim.memory.compiled import inlined, reordered, short
from historysim.memory.layout import Floats
from historysim.memory.lean import lean


@short
def touching(gap: Floats, approach: float) -> int:
    """Count asperities, in ascending gap, whose gap is below the approach."""
    low, high = 0, gap.size
    if gap[high - 1] < approach:
        return high
    while low < high:
        middle = (low + high) // 2
        if gap[middle] < approach:
            low = middle + 1
        else:
            high = middle
    return low


@reordered
def load_and_slope(gap: Floats, weight: Floats, count: int, approach: float) -> tuple[float, float]:
    """P(a) and P'(a) of the first asperities, all of which touch."""
    load = 0.0
    slope = 0.0
    for i in range(count):
        depth = approach - gap[i]
        half_chord = weight[i] * math.sqrt(depth)
        load += half_chord * depth
        slope += half_chord
    return load, 1.5 * slope


@inlined
def load_at(gap: Floats, weight: Floats, approach: float) -> tuple[float, float]:
    """P(a) and P'(a) of asperities in ascending gap."""
    if gap.size == 1:
        # many groups are of one asperity, for which handing on the arrays would cost more than the physics
        depth = max(approach - gap[0], 0.0)
        half_chord = weight[0] * math.sqrt(depth)
        return half_chord * depth, 1.5 * half_chord
    return load_and_slope(gap, weight, touching(gap, approach), approach)


@short
def label_at(gap: Floats, weight: Floats, total: float, guess: float, rigid: float, compliance: float) -> float:
    """Label a at which rigid·(a - h) + compliance·P(a), with the smallest gap h, is a total.

    Asperities stand in ascending gap. Newton on the power 2/3, bracketed. Weights may be negative where their sum
    still rises with the approach (see `historysim.asperities.curve_fitting`).
    """
    low = gap[0]
    if total <= 0.0:
        return low
    # the deepest asperity alone would carry it here
    high = low + (total / (compliance * weight[0])) ** (2.0 / 3.0)
    if rigid > 0.0:
        high = min(high, low + total / rigid)
    elif gap.size == 1:
        return high
    approach = guess if low < guess <= high else high
    for _ in range(100):
        load, stiffness = load_at(gap, weight, approach)
        present, slope = rigid * (approach - gap[0]) + compliance * load, rigid + compliance * stiffness
        if present == total:
            return approach
        if present < total:
            low = approach
            if low == high and present < 0.999 * total:
                # elements of negative weight have taken from what the deepest alone would carry
                high += high - gap[0]
        else:
            high = approach
        step = 1.5 * present / slope * math.expm1(math.log1p((total - present) / present) * (2.0 / 3.0))
        following = approach + step
        if not low <= following <= high:
            following = 0.5 * (low + high)
            if following in (low, high):
                return following
        elif abs(step) <= 1e-10 * (following - gap[0]):
            # Newton squares the error, so this step was the last that matters
            return following
        approach = following
    return approach


@short
def approach_at(gap: Floats, weight: Floats, load: float, guess: float) -> float:
    """Approach at which asperities, in ascending gap, carry a load."""
    gap, weight = lean(gap), lean(weight)
    return label_at(gap, weight, load, guess, 0.0, 1.0)
