"""A dense brute force of friction on a half-space alone, of ν = 0 and E* = 1: shares no code with the program.

Displacements follow from pressures and tractions, uniform on the square of each point, by Love's
formula (Johnson 1985, eq. 3.25); with ν = 0 it is the same one for both, neither acts on the other,
and θ = 1. Loads are walked in small steps. In each, pressures solve the contact problem, and then
tractions minimise ½ Δq·G Δq - ΔU Σ Δq with |q| ≤ μ p: points stick unless they are at the limit,
and slip against their traction.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve


def influence(x, y, side):
    """Displacement at each point under a unit pressure on a square around each."""
    dx, dy, half = x[:, None] - x, y[:, None] - y, side / 2
    found = np.zeros_like(dx)
    for a, b in ((dx, dy), (-dx, dy), (dx, -dy), (-dx, -dy)):
        right, top = a + half, b + half
        # ∫∫ 1/r over the quadrants of the square around the point
        found += _corner(right, top)
    return found / np.pi


def _corner(a, b):
    """∫₀ᵃ∫₀ᵇ 1/r."""
    r = np.hypot(a, b)
    return (
        a * np.arcsinh(b / np.maximum(np.abs(a), 1e-300))
        + b * np.arcsinh(a / np.maximum(np.abs(b), 1e-300))
    ) * (r > 0)


def bounded(matrix, wanted, low, high, start):
    """Solve matrix x = wanted between bounds, with the residual against the bound where one is met."""
    x, free = np.clip(start, low, high), (start > low) & (start < high)
    scale = np.abs(wanted).max() + 1e-300
    for turn in range(400):
        held = ~free
        if free.any():
            rest = wanted[free] - matrix[np.ix_(free, held)] @ x[held]
            x[free] = cho_solve(cho_factor(matrix[np.ix_(free, free)]), rest)
        slack = 1e-12 * (np.abs(x).max() + 1e-300)
        out = free & ((x < low - slack) | (x > high + slack))
        x = np.clip(x, low, high)
        pull = wanted - matrix @ x
        back = (
            held
            & (((x <= low) & (pull > 1e-11 * scale)) | ((x >= high) & (pull < -1e-11 * scale)))
            & (high > low)
        )
        if not out.any() and not back.any():
            return x
        if turn > 60:
            # one at a time cannot go round in circles
            both = np.flatnonzero(out | back)
            only = both[turn % both.size]
            out, back = (np.arange(x.size) == only) & out, (np.arange(x.size) == only) & back
        free = (free & ~out) | back
    raise AssertionError("no convergence")


class DenseContact:
    """Points of a map that may touch, up to an approach."""

    def __init__(self, heights, pixel, approach):
        depth = heights.max() - heights
        self.point = np.flatnonzero(depth.ravel() < approach)
        self.depth = depth.ravel()[self.point]
        x, y = np.unravel_index(self.point, heights.shape)
        self.matrix, self.cell = influence(x * pixel, y * pixel, pixel), pixel**2

    def history(self, moves, friction, parts):
        """Yield pressures, tractions and energy lost so far, after straight moves in (approach, U) from (0, 0)."""
        count = self.depth.size
        p, q, energy, at, moved = np.zeros(count), np.zeros(count), 0.0, 0.0, 0.0
        for approach, displacement in moves:
            for part in np.arange(1, parts + 1) / parts:
                step = (displacement - moved) / parts
                present = at + (approach - at) * part
                p = bounded(
                    self.matrix, present - self.depth, np.zeros(count), np.full(count, np.inf), p
                )
                before = q
                q = bounded(self.matrix, self.matrix @ q + step, -friction * p, friction * p, q)
                slip = step - self.matrix @ (q - before)
                energy += 0.5 * ((q + before) * slip).sum() * self.cell
            at, moved = approach, displacement
            yield p, q, energy
