"""A brute force of one sphere that moves in two tangential directions: a half-space, point by point.

Pressures are Hertz's. Tractions on square cells displace the surface by C q (Cerruti, integrated
over a cell as Love did; with ν > 0 either component moves the surface along the other, too). A
stage of a step is the minimum of ½ q·C q - q·(C q₀ + ΔU) under |q| ≤ μ p in every cell, and two of
them make a step of second order (SDIRK2). It knows no rings and no springs. E* = R = θ = 1.
"""

import numpy as np
from scipy import fft

GAMMA = 1 - 1 / np.sqrt(2)


class PlanarHalfSpace:
    """A sphere pressed by an approach on a grid of ``cells`` × ``cells`` cells, which the largest contact fills.

    Two bodies of Poisson's ratio ν have the shear modulus 1 - ν/2 each, so that G* = 1/4.
    """

    def __init__(self, cells, poisson_ratio=0.0, friction=1.0, largest_approach=1.0):
        self.friction, self.cells = friction, cells
        edge = np.sqrt(largest_approach)
        self.cell = 2 * edge / cells
        middle = (np.arange(cells) + 0.5) * self.cell - edge
        # pressures are means over the cells, by points in them
        fine = (np.arange(4) - 1.5) / 4 * self.cell
        at = (middle[:, None] + fine).ravel()
        self.square = at[:, None] ** 2 + at**2
        offset = np.arange(-cells, cells) * self.cell
        x, y, nu = offset[:, None], offset, poisson_ratio
        along_x, along_y = (_over_cell(_square, *at, self.cell) for at in ((x, y), (y, x)))
        moved = (along_x + along_y) * (1 - nu) + nu * np.array([along_x, along_y])
        across = nu * _over_cell(_product, x, y, self.cell)
        self.along, self.across = (
            fft.rfft2(np.fft.ifftshift(each, axes=(-2, -1))) / (np.pi * (1 - nu / 2))
            for each in (moved, across)
        )
        self.step = 1 / (np.abs(self.along).max() + np.abs(self.across).max())
        self.traction = np.zeros((2, cells, cells))
        self.displacement = np.zeros(2)
        self.approach = self.dissipated = 0.0

    def pressure(self, approach):
        fine = 2 / np.pi * np.sqrt(np.maximum(approach - self.square, 0.0))
        p = fine.reshape(self.cells, 4, self.cells, 4).mean(axis=(1, 3))
        return p * (4 / 3 * approach**1.5 / (p.sum() * self.cell**2))

    @property
    def tangential_load(self):
        return self.traction.sum(axis=(1, 2)) * self.cell**2

    def moved(self, traction):
        """Displacements under tractions (direction, x, y)."""
        n = self.cells
        waves = fft.rfft2(traction, s=(2 * n, 2 * n))
        return fft.irfft2(self.along * waves + self.across * waves[::-1], s=(2 * n, 2 * n))[
            :, :n, :n
        ]

    def _settled(self, start, pull, limit):
        """Minimum under the limit: accelerated projected gradients, restarted."""
        x = _within(start, limit)
        y, momentum = x, 1.0
        for _ in range(5000):
            following = _within(y - self.step * (self.moved(y) - pull), limit)
            if np.abs(following - y).max() < 1e-6 * limit.max():
                return following
            if ((y - following) * (following - x)).sum() > 0:
                y, momentum = x, 1.0
                continue
            grown = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
            y = following + (momentum - 1) / grown * (following - x)
            x, momentum = following, grown
        raise AssertionError("no convergence")

    def to(self, displacement, approach):
        """Go straight to a displacement and an approach, in one step."""
        way, rise = np.asarray(displacement) - self.displacement, approach - self.approach
        before, slip = self.moved(self.traction), 0.0
        for share in (GAMMA, 1.0):
            limit = self.friction * self.pressure(self.approach + share * rise)
            pull = before + share * way[:, None, None] - slip
            q = self._settled(self.traction, pull, limit)
            y = pull - self.moved(q)
            weight = 1.0 if share == 1.0 else (1 - GAMMA) / GAMMA
            self.dissipated += weight * (q * y).sum() * self.cell**2
            slip = (1 - GAMMA) / GAMMA * np.where(limit > 0, y, 0.0)
        self.traction, self.displacement, self.approach = q, np.asarray(displacement), approach
        return self

    def to_friction(self, friction, parts=16):
        """Change the coefficient in equal parts at the held displacement: one problem each, without a second stage."""
        for coefficient in np.linspace(self.friction, friction, parts + 1)[1:]:
            before, held = self.moved(self.traction), self.traction
            self.traction = self._settled(held, before, coefficient * self.pressure(self.approach))
            after = self.moved(self.traction)
            self.dissipated += (
                0.5 * ((held * before).sum() - (self.traction * after).sum()) * self.cell**2
            )
        self.friction = friction
        return self


def _within(traction, limit):
    size = np.hypot(*traction)
    return traction * np.where(size > limit, limit / np.where(size > 0, size, 1.0), 1.0)


def _square(x, y):
    """Integral of x²/r³ over x and y."""
    return y * np.log(x + np.hypot(x, y))


def _product(x, y):
    """Integral of xy/r³ over x and y."""
    return -np.hypot(x, y)


def _over_cell(integral, x, y, cell):
    return sum(
        4 * a * b * integral(x + a * cell, y + b * cell) for a in (-0.5, 0.5) for b in (-0.5, 0.5)
    )
