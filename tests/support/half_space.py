"""A brute force of contact with friction on a half-space of ν = 0, point by point: shares no code with the program.

Normal and tangential displacements of a surface that repeats, of E* = 1, are K p and K q with K =
2/|k| in Fourier space; with ν = 0 neither acts on the other, and θ = 1. Pressures minimise ½ p·K p
- p·(z + a), p ≥ 0. A step in friction minimises ½ Δq·K Δq - ΔU Σ Δq with |q| ≤ μ p: slip is against
  the traction, and at the limit alone.
"""

import numpy as np


class HalfSpace:
    def __init__(self, heights, size):
        self.z = heights - heights.max()
        nx, ny = heights.shape
        kx = 2 * np.pi * np.fft.fftfreq(nx, size / nx)[:, None]
        ky = 2 * np.pi * np.fft.rfftfreq(ny, size / ny)[None, :]
        length = np.hypot(kx, ky)
        length[0, 0] = np.inf
        self.kernel = 2 / length
        self.cell = (size / nx) * (size / ny)
        self.shape = heights.shape

    def moved(self, load):
        return np.fft.irfft2(np.fft.rfft2(load) * self.kernel, s=self.shape)

    def minimum(self, start, pull, low, high, accuracy):
        """Minimum of ½ x·K x - x·pull between bounds: accelerated projected gradients, restarted."""
        step = 1 / self.kernel.max()
        x = np.clip(start, low, high)
        y, momentum = x, 1.0
        for _ in range(20000):
            gradient = self.moved(y) - pull
            following = np.clip(y - step * gradient, low, high)
            if np.abs(following - y).max() <= accuracy * step * np.abs(pull).max():
                return following
            if ((y - following) * (following - x)).sum() > 0:
                y, momentum = x, 1.0
                continue
            grown = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
            y = following + (momentum - 1) / grown * (following - x)
            x, momentum = following, grown
        raise AssertionError("no convergence")

    def pressure(self, approach, start, accuracy=1e-8):
        return self.minimum(start, self.z + approach, 0.0, np.inf, accuracy)

    def history(self, moves, friction, parts, accuracy=1e-8):
        """Pressures and tractions after each of straight moves in (a, U), walked in equal parts from (0, 0)."""
        p, q, a0, u0 = np.zeros(self.shape), np.zeros(self.shape), 0.0, 0.0
        for a1, u1 in moves:
            for part in range(1, parts + 1):
                p = self.pressure(a0 + (a1 - a0) * part / parts, p, accuracy)
                # points that have left the contact carry nothing: they take no part
                pull = self.moved(q) + (u1 - u0) / parts
                q = self.minimum(q, pull, -friction * p, friction * p, accuracy)
            a0, u0 = a1, u1
            yield p, q
