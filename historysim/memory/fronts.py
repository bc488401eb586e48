"""Slip fronts that were found before: a search asks for the tangential load again and again, at nearly the same place.

While the slip front of a group stays on one segment of its polyline, it is straight in the end (d, V) of the path:
between label a_j, where the anchor is w_j, and the next vertex the slope is m, on the side s of slip it is sμ, so that

    a = a_j + ((V - w_j) - sμ (d - a_j)) / (m - sμ),    T = T_j - m P(a_j) + sμ P(d) + (m - sμ) P(a)

which also holds while the whole group slides, where a is below its gap and P(a) is 0. For groups of one asperity P is
known at once, and several groups are summed at a time, without a walk along each polyline.
"""

import math

import numpy as np

from historysim.memory.compiled import reordered, short
from historysim.memory.layout import ANCHOR, LABEL, NORMAL, SLOPE, TANGENTIAL, Floats, Group
from historysim.memory.lean import empty

# rows of the table of fronts, which has a column for each group: sμ, label and anchor of the vertex below the front,
# m - sμ and its reciprocal, tangential load less m P of that vertex, the labels between which this holds, gap and
# weight of the one asperity, and whether the front was found to be off the segment
ROWS_OF_FRONTS = 11
CONE, BELOW, ANCHORED, JUMP, RATE, FORCE, LEAST, MOST, GAP, WEIGHT, OFF = range(ROWS_OF_FRONTS)

# what stands for 1/0 where several groups at a time leave no room for cases, and is added to what may be 0
STEEPEST, SMALL = 1e100, 1e-30


@short
def forget_front(fronts: Floats, index: int) -> None:
    """Leave a group without a front: nothing is between its least and most label, and it adds nothing to a sum."""
    for row in range(ROWS_OF_FRONTS):
        fronts[row, index] = 0.0
    fronts[LEAST, index] = np.inf


@short
def no_fronts(groups: int) -> Floats:
    """Return the table before any front is found."""
    fronts = empty((ROWS_OF_FRONTS, groups), np.float64)
    for index in range(groups):
        fronts[LEAST, index] = np.inf
    return fronts


@short
def note_front(fronts: Floats, index: int, group: Group, depth: int, kept: int, sign: float) -> bool:
    """Note on which segment of its polyline a group slips; return whether that is of use.

    It is where there are several groups, and this is of one asperity. That many vertices were kept by
    `polyline.slip_front`, which are none where all springs slide.
    """
    stack, segment = group.stack, max(kept, 1)
    if group.gap.size > 1 or fronts.shape[1] == 1 or segment >= depth:
        return False
    slope = stack[segment, SLOPE]
    jump = -sign * max(group.friction - sign * slope, 0.0)
    if jump == 0.0 and kept > 0:
        return False
    fronts[CONE, index] = sign * group.friction
    fronts[BELOW, index] = stack[segment - 1, LABEL]
    fronts[ANCHORED, index] = stack[segment - 1, ANCHOR]
    fronts[JUMP, index] = jump
    fronts[RATE, index] = 1.0 / jump if jump != 0.0 else -sign * STEEPEST
    fronts[FORCE, index] = stack[segment - 1, TANGENTIAL] - slope * stack[segment - 1, NORMAL]
    fronts[LEAST, index] = stack[segment - 1, LABEL] if segment > 1 else -np.inf
    fronts[MOST, index] = stack[segment, LABEL]
    fronts[GAP, index] = group.gap[0]
    fronts[WEIGHT, index] = group.weight[0]
    return True


@reordered
def force_on_fronts(
    fronts: Floats, off: Floats, shares: Floats, d: float, v: float
) -> tuple[float, float, float, bool]:
    """Tangential load of the groups with fronts at the end of a path to (d, v), with its derivatives in v.

    Tells of each group in ``off`` whether its front is not on the segment noted; returns also whether that is so of
    any, and the load to be found once more.
    """
    force, stiffness, curvature, count = 0.0, 0.0, 0.0, 0.0
    for index in range(shares.size):
        cone, below, rate = fronts[CONE, index], fronts[BELOW, index], fronts[RATE, index]
        # the label of the front on the segment, or beyond its ends
        front = below + ((v - fronts[ANCHORED, index]) - cone * (d - below)) * rate
        off[index] = 0.0 if fronts[LEAST, index] <= front <= min(fronts[MOST, index], d) else 1.0
        count += off[index]
        depth = max(front - fronts[GAP, index], 0.0)
        half_chord = fronts[WEIGHT, index] * math.sqrt(depth)
        force += fronts[FORCE, index] + cone * shares[index] + fronts[JUMP, index] * half_chord * depth
        stiffness += half_chord
        curvature += half_chord * rate / (depth + SMALL)
    return force, 1.5 * stiffness, 0.75 * curvature, count > 0.0
