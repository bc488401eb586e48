"""A rough contact from the first point that touches on, as long as few do: exact, by active sets.

With p the pressures of the points that touch, G the displacement of one point under the pressure of another, and z how
deep a point lies below the highest, p = G⁻¹ (a - z) on those points, and z + G p > a on all others. So p is straight
in the approach a from one touch to the next; the first point is a flat punch of one pixel.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from historysim.basics.array_types import Booleans, Floats, Integers

MOST_POINTS = 200
"""Points in contact beyond which there are too many."""
MOST_CANDIDATES = 1600
"""Highest points that may touch."""
EACH_TOUCH = 16
"""Points in contact up to which there is a row at each touch; beyond, at each approach larger by `STEP`."""
STEP = 1.06
MOST_TURNS = 100
TOLERANCE = 1e-11
"""Gap over the approach that is taken for rounding."""


class Row(NamedTuple):
    """A solution: approach, the points that touch (flat indices), their pressures, and how fast those grow with it."""

    approach: float
    point: Integers
    pressure: Floats
    growth: Floats


class FewPoints:
    """Contact of the highest points of a map.

    Parameters
    ----------
    heights : array (nx, ny)
    influence : array (nx, ny)
        Displacement at each offset of points, under a unit pressure at one of them.
    periodic : bool
        Whether offsets go around the map.
    """

    def __init__(self, heights: Floats, influence: Floats, *, periodic: bool) -> None:
        depth = heights.max() - heights.ravel()
        # of points that are alike the first one in the map
        self.candidate = np.argsort(depth, kind="stable")[:MOST_CANDIDATES]
        self._depth = depth[self.candidate]
        self._matrix = _matrix(self.candidate, influence, periodic=periodic)
        # beyond the candidates others may touch; where displacements have a mean of 0 they may even do so before
        self._reach = np.inf if self.candidate.size == depth.size else 0.5 * float(depth[self.candidate[-1]])

    def rows(self) -> Iterator[Row]:
        """Yield solutions at rising approaches, as long as few points touch."""
        touching = np.zeros(self._depth.size, dtype=bool)
        touching[0] = True
        # two points of one height touch at once
        approach, (_, _, following) = 0.0, self._solved(0.0, touching)
        while True:
            count = int(touching.sum())
            target = following if count < EACH_TOUCH else max(following, approach * STEP)
            if not target < self._reach or count > MOST_POINTS:
                return
            # at a touch the point that comes in carries nothing yet
            settled = self._settled(target, touching)
            if settled is None:
                return
            row, touching, following = settled
            if row.approach > approach:
                yield row
            approach = target

    def _solved(self, approach: float, touching: Booleans) -> tuple[Floats, Floats, float]:
        """Return the pressures at an approach if these points touch, how they grow, and where the next one touches."""
        from scipy.linalg import cho_factor, cho_solve

        matrix = self._matrix[np.ix_(touching, touching)]
        wanted = np.stack([approach - self._depth[touching], np.ones(int(touching.sum()))], axis=1)
        pressure, growth = cho_solve(cho_factor(matrix), wanted).T
        across = self._matrix[np.ix_(~touching, touching)]
        gap, closing = self._depth[~touching] - approach + across @ pressure, 1.0 - across @ growth
        with np.errstate(divide="ignore"):
            ahead = np.where(closing > 0, gap / closing, np.inf)
        return pressure, growth, approach + max(float(ahead.min(initial=np.inf)), 0.0)

    def _settled(self, approach: float, touching: Booleans) -> tuple[Row, Booleans, float] | None:
        """Return the solution at an approach, the points that touch just beyond it, and where the next one touches.

        None where points come and leave in turn, which conjugate gradients do not mind.
        """
        touching = touching.copy()
        first = None
        for _ in range(MOST_TURNS):
            pressure, growth, following = self._solved(approach, touching)
            inside = np.flatnonzero(touching)
            gap = self._depth - approach + self._matrix[:, inside] @ pressure
            leaves = inside[pressure < -TOLERANCE * np.abs(pressure).max()]
            comes = np.flatnonzero(~touching & (gap <= TOLERANCE * approach))
            # those that come at this approach itself carry nothing before it
            if first is None and not leaves.size and not (gap[comes] < -TOLERANCE * approach).any():
                first = Row(approach, self.candidate[inside], np.clip(pressure, 0.0, None), growth)
            if not leaves.size and not comes.size:
                settled = Row(approach, self.candidate[inside], np.clip(pressure, 0.0, None), growth)
                return first or settled, touching, following
            touching[leaves] = False
            touching[comes] = True
        return None


def _matrix(point: Integers, influence: Floats, *, periodic: bool) -> Floats:
    """Return the displacement of each point under a unit pressure at each."""
    x, y = np.unravel_index(point, influence.shape)
    dx, dy = x[:, None] - x, y[:, None] - y
    if not periodic:
        dx, dy = np.abs(dx), np.abs(dy)
    found: Floats = influence[dx, dy]
    return found
