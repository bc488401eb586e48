"""From the rows of all elements of normal curves to those of their patches, row by row without copies."""

import math

import numpy as np

from historysim.memory.compiled import compiled, entry, reordered
from historysim.memory.layout import Floats
from historysim.memory.lean import empty, lean
from historysim.memory.normal import touching
from historysim.memory.rows import FULL_STICK, GROSS_SLIP, PARTIAL_SLIP, SEPARATED, Rows
from historysim.memory.stacks import copy_items


@compiled
def superpose(elements: Floats, share: Floats, target: Floats) -> None:
    """Fill in the weights of the rows of the table (row) in the loads of elements; ``share`` is (element, row)."""
    for r in range(target.size):
        target[r] = 0.0
    for k in range(elements.size):
        if elements[k] != 0.0:
            for r in range(target.size):
                target[r] += elements[k] * share[k, r]


@reordered
def weighted(loads: Floats, normal_weight: Floats, tangential_weight: Floats) -> tuple[float, float]:
    """Return the sums over the rows of the table of a patch's loads (row), by either weights."""
    normal, tangential = 0.0, 0.0
    for r in range(loads.size):
        normal += loads[r] * normal_weight[r]
        tangential += loads[r] * tangential_weight[r]
    return normal, tangential


@reordered
def equal_radii(approaches: Floats, areas: Floats, approach: float, target: Floats) -> None:
    """Fill in the radii of the circles that have the areas of patches, straight between the rows of their table."""
    above = min(max(touching(approaches, approach), 1), approaches.size - 1)
    low, high = areas[above - 1], areas[above]
    part = min((approach - approaches[above - 1]) / (approaches[above] - approaches[above - 1]), 1.0)
    for i in range(target.size):
        target[i] = math.sqrt(((1.0 - part) * low[i] + part * high[i]) / math.pi)


@entry
def record_patches(
    elements: Rows,
    share: Floats,
    loads: Floats,
    approaches: Floats,
    areas: Floats,
    first_touch: Floats,
    approach: Floats,
    stick: Floats,
    friction: float,
    rows: Rows,
) -> None:
    """Fill in the rows of patches.

    ``share`` (element, row of the table) turns loads of elements into weights of the rows of the table ``loads``
    (patch, row); ``approaches`` and ``areas`` (row, patch) are the table, from first touch on. The contact is at
    ``approach``, and sticks inside ``stick``.
    """
    elements, rows, share, loads, stick = lean(elements), lean(rows), lean(share), lean(loads), lean(stick)
    approaches, areas, first_touch, approach = lean(approaches), lean(areas), lean(first_touch), lean(approach)
    normal_weight = empty(share.shape[1], np.float64)
    tangential_weight = empty(share.shape[1], np.float64)
    for r in range(approach.size):
        superpose(elements.normal_load[r], share, normal_weight)
        superpose(elements.tangential_load[r], share, tangential_weight)
        if r > 0 and approach[r] == approach[r - 1]:
            copy_items(rows.contact_radius[r - 1], rows.contact_radius[r])
        else:
            equal_radii(approaches, areas, approach[r], rows.contact_radius[r])
        equal_radii(approaches, areas, stick[r], rows.stick_radius[r])
        whole = elements.slip_state[r, 0] == FULL_STICK
        for i in range(first_touch.size):
            rows.dissipated[r, i] = 0.0
            if approach[r] <= first_touch[i]:
                rows.normal_load[r, i] = rows.tangential_load[r, i] = 0.0
                rows.contact_radius[r, i] = rows.stick_radius[r, i] = 0.0
                rows.slip_state[r, i] = SEPARATED
                continue
            normal, tangential = weighted(loads[i], normal_weight, tangential_weight)
            normal = max(normal, 0.0)
            limit = friction * normal
            rows.normal_load[r, i] = normal
            rows.tangential_load[r, i] = min(max(tangential, -limit), limit)
            inside = PARTIAL_SLIP if stick[r] > first_touch[i] else GROSS_SLIP
            rows.slip_state[r, i] = FULL_STICK if whole else inside
