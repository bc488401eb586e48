"""Paths in the plane, and what another program finds along them."""

import itertools

import numpy as np

# Tangential loads and dissipated energies over the normal load where the ramp ends, then each
# quarter of a circle, or each side of a square (A, A), (0, A), (-A, A), (-A, 0), (-A, -A). A is 0.7
# at approach 1, and 0.35 where the approach rises from 0.5 to 1 in proportion to the way. From
# another program, with many rings and steps. fmt: off
TABLES = {
    "circle": [
        (0.8357, 0, 0.05446),
        (-0.1418, 0.7687, 0.1605),
        (-0.7568, -0.1895, 0.3431),
        (0.2085, -0.7585, 0.5593),
        (0.7619, 0.2153, 0.7901),
    ],
    "square": [
        (0.8357, 0, 0.05446),
        (0.6302, 0.7531, 0.2275),
        (-0.2603, 0.6828, 0.2711),
        (-0.8142, 0.5098, 0.5308),
        (-0.7048, -0.3502, 0.6040),
        (-0.4843, -0.8400, 0.9325),
    ],
    "rising circle": [
        (0.2955, 0, 0.00963),
        (-0.0668, 0.3202, 0.0215),
        (-0.3824, -0.0864, 0.0489),
        (0.0706, -0.4432, 0.0785),
        (0.4740, 0.0467, 0.1051),
    ],
    "rising square": [
        (0.2955, 0, 0.00963),
        (0.2683, 0.3248, 0.0244),
        (-0.1130, 0.3145, 0.0301),
        (-0.4539, 0.2943, 0.0600),
        (-0.4396, -0.1472, 0.0678),
        (-0.4098, -0.5429, 0.1066),
    ],
}
# fmt: on


def way(shape, amplitude, parts):
    """Displacements along a path, and how many of them lead to each of its corners."""
    if "circle" in shape:
        angle = np.arange(1, 4 * parts + 1) / parts * np.pi / 2
        turn = amplitude * np.column_stack([np.cos(angle), np.sin(angle)])
        ramp = np.outer(np.arange(1, parts + 1) / parts, (amplitude, 0))
        return np.vstack([ramp, turn])
    corners = amplitude * np.array([(0, 0), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1)])
    share = np.arange(1, parts + 1)[:, None] / parts
    return np.vstack([a + share * (b - a) for a, b in itertools.pairwise(corners)])
