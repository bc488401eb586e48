"""Oracle where friction falls: one contact as rings of uniform traction, Coulomb's law at every ring.

A circle of elastically similar half-spaces carries the tractions τ of concentric rings, which
displace the surface by C τ. With the present slip s, a step to other limits, another displacement U
or another load is the minimum of complementary energy ½ τ·C τ + τ·s - U τ over all |τ| ≤ μ p: rings
inside the limit keep their slip, the others slip in the direction of their traction. It knows no
springs and no polylines, and slip may be annular anywhere.

Units: E* = R = 1 and G* = 1/4, so that θ = 1 and the tangential compliance is the normal one. The
approach is fixed.
"""

import numpy as np
from scipy.special import ellipe, ellipk


class Rings:
    """A pressed sphere, its rings, their tractions and slip; `to` moves it on.

    Parameters
    ----------
    friction : float
    approach : float
    count : int
        Rings of equal width.

    Attributes
    ----------
    traction, slip : array (ring)
        Tractions as means over the rings; slip of the surface below them.
    displacement : float
    """

    def __init__(self, friction, approach=1.0, count=300):
        edge = np.sqrt(approach) * np.linspace(0, 1, count + 1)
        self.area = np.pi * np.diff(edge**2)
        load = 4 / 3 * approach**1.5 * (1 - (1 - edge**2 / approach) ** 1.5)
        self.pressure = np.diff(load) / self.area
        middle = (edge[1:] + edge[:-1]) / 2
        compliance = _disc(middle[:, None], edge[None, 1:]) - _disc(
            middle[:, None], edge[None, :-1]
        )
        weighted = self.area[:, None] * compliance
        self._quadratic = (weighted + weighted.T) / 2
        self.friction = friction
        self.traction, self.slip = np.zeros(count), np.zeros(count)
        self.displacement = 0.0

    @property
    def normal_load(self):
        return self.area @ self.pressure

    @property
    def tangential_load(self):
        return self.area @ self.traction

    def to(self, *, load=None, friction=None):
        """Go to a tangential load, or to other friction at the present displacement."""
        self.friction = friction or self.friction
        bound = self.friction * self.pressure
        pushed = self.area * self.slip
        side = np.zeros(self.area.size, dtype=int)
        held = self.displacement
        for _ in range(200):
            free = side == 0
            traction = side * bound
            matrix = self._quadratic[np.ix_(free, free)]
            right = -pushed[free] - self._quadratic[np.ix_(free, ~free)] @ traction[~free]
            by_slip, by_shift = np.linalg.solve(matrix, np.column_stack([right, self.area[free]])).T
            if load is not None:
                rest = load - self.area[~free] @ traction[~free]
                held = (rest - self.area[free] @ by_slip) / (self.area[free] @ by_shift)
            traction[free] = by_slip + held * by_shift
            more = held - (self._quadratic @ traction + pushed) / self.area
            weight = bound.max() / np.abs(held or 1.0)
            trial = traction + weight * more
            following = np.where(trial > bound, 1, np.where(trial < -bound, -1, 0))
            if np.array_equal(following, side):
                break
            side = following
        else:
            raise ValueError("the rings did not settle")
        self.traction = traction
        self.displacement = held
        self.slip = self.slip + np.where(side == 0, 0.0, more)
        return self


def _disc(radius, edge):
    """Displacement at a radius under unit traction over a disc, for E* = 1."""
    inner = np.minimum(radius / np.maximum(edge, 1e-300), 1.0)
    outer = np.minimum(edge / radius, 1.0)
    inside = edge * ellipe(inner**2)
    outside = radius * (ellipe(outer**2) - (1 - outer**2) * ellipk(np.minimum(outer**2, 1 - 1e-16)))
    return np.where(radius < edge, inside, outside) * 4 / np.pi * np.where(edge > 0, 1.0, 0.0)
