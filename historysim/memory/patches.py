"""From the rows of all elements of normal curves to those of their patches, row by row without copies."""

import math

from historysim.memory.compiled import compiled, reordered
from historysim.memory.layout import Floats
from historysim.memory.normal import touching
from historysim.memory.rows import FULL_STICK, GROSS_SLIP, PARTIAL_SLIP, SEPARATED, Rows


@reordered
def weighted(loads: Floats, weights: Floats, target: Floats) -> None:
    """Fill in the sums over elements of their loads times their weights (element, patch)."""
    for i in range(target.size):
        target[i] = 0.0
    for k in range(loads.size):
        load, weight = loads[k], weights[k]
        if load != 0.0:
            for i in range(target.size):
                target[i] += load * weight[i]


@reordered
def equal_radii(approaches: Floats, areas: Floats, approach: float, target: Floats) -> None:
    """Fill in the radii of the circles that have the areas of patches, straight between the rows of their table."""
    above = min(max(touching(approaches, approach), 1), approaches.size - 1)
    low, high = areas[above - 1], areas[above]
    part = min((approach - approaches[above - 1]) / (approaches[above] - approaches[above - 1]), 1.0)
    for i in range(target.size):
        target[i] = math.sqrt(((1.0 - part) * low[i] + part * high[i]) / math.pi)


@compiled
def record_patches(
    elements: Rows,
    weights: Floats,
    approaches: Floats,
    areas: Floats,
    first_touch: Floats,
    approach: Floats,
    stick: Floats,
    friction: float,
    rows: Rows,
) -> None:
    """Fill in the rows of patches.

    ``weights`` (element, patch) turn loads of elements into those of patches; ``approaches`` and ``areas`` (row,
    patch) are the table, from first touch on. The contact is at ``approach``, and sticks inside ``stick``.
    """
    for r in range(approach.size):
        normal, tangential = rows.normal_load[r], rows.tangential_load[r]
        weighted(elements.normal_load[r], weights, normal)
        weighted(elements.tangential_load[r], weights, tangential)
        equal_radii(approaches, areas, approach[r], rows.contact_radius[r])
        equal_radii(approaches, areas, stick[r], rows.stick_radius[r])
        whole = elements.slip_state[r, 0] == FULL_STICK
        for i in range(first_touch.size):
            rows.dissipated[r, i] = 0.0
            if approach[r] <= first_touch[i]:
                normal[i] = tangential[i] = rows.contact_radius[r, i] = rows.stick_radius[r, i] = 0.0
                rows.slip_state[r, i] = SEPARATED
                continue
            normal[i] = max(normal[i], 0.0)
            limit = friction * normal[i]
            tangential[i] = min(max(tangential[i], -limit), limit)
            inside = PARTIAL_SLIP if stick[r] > first_touch[i] else GROSS_SLIP
            rows.slip_state[r, i] = FULL_STICK if whole else inside
