"""Rough maps that press on one another, moved in two tangential directions: shared rings beside every point.

    PYTHONPATH=tests/support python tests/scripts/planar_maps.py [--points 64] [--steps 8]

A Gaussian map that repeats is pressed and moved along a circle and a zigzag at several amplitudes, of the preliminary
displacement, under a constant and a waving approach. The brute force solves the normal contact at every stage and
Coulomb's law as a disc at every point, in steps of second order (as `planar_half_space.py` does for a sphere). It
prints the largest error of T over the largest μN, and that of the energy.
"""

import argparse
import itertools

import numpy as np
from half_space import HalfSpace
from planar_half_space import PlanarHalfSpace

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)  # ν = 0: θ = 1
MU = 0.2


class PlanarMap(PlanarHalfSpace):
    """A map that repeats: pressures at an approach from the normal contact, displacements by Fourier's transform."""

    def __init__(self, heights, side):
        self.space, self.friction = HalfSpace(heights, side), MU
        self.cell = side / heights.shape[0]
        self.step = 1 / self.space.kernel.max()
        self.traction = np.zeros((2, *heights.shape))
        self.displacement = np.zeros(2)
        self.approach = self.dissipated = 0.0
        self.known = {}

    def pressure(self, approach):
        if approach not in self.known:
            nearest = min(self.known, key=lambda a: abs(a - approach), default=None)
            start = np.zeros(self.space.shape) if nearest is None else self.known[nearest]
            self.known[approach] = self.space.pressure(approach, start, 1e-7)
        return self.known[approach]

    def moved(self, traction):
        waves = np.fft.rfft2(traction)
        return np.fft.irfft2(waves * self.space.kernel, s=self.space.shape)


def paths(amplitude, steps):
    """Displacements along a circle and a zigzag."""
    angle = np.arange(1, 5 * steps + 1) / steps * np.pi / 2
    ramp = np.outer(np.arange(1, steps + 1) / steps, (amplitude, 0))
    circle = np.vstack([ramp, amplitude * np.column_stack([np.cos(angle), np.sin(angle)])])
    corners = amplitude * np.array([(0, 0), (1, 0.1), (0.2, 0.5), (0.9, 0.8), (-0.5, 0.9), (-0.6, -0.5), (0.3, -0.2)])
    share = np.arange(1, steps + 1)[:, None] / steps
    zigzag = np.vstack([a + share * (b - a) for a, b in itertools.pairwise(corners)])
    return {"circle": circle, "zigzag": zigzag}


def compared(surface, solutions, path, approaches):
    """Largest error of T over the largest μN, error of the energy over it, and patches at the end."""
    rough = hs.Ensemble.from_solutions(PAIR, solutions, MU)
    brute = PlanarMap(surface.heights, surface.size[0])
    brute.to((0.0, 0.0), approaches[0])
    state = rough.advance(rough.initial_state(), normal_displacement=float(approaches[0]))
    off, limit = 0.0, 0.0
    for place, approach in zip(path, approaches, strict=True):
        state = rough.advance(state, normal_displacement=float(approach), tangential_displacement=tuple(place))
        brute.to(place, approach)
        off = max(off, np.abs(state.tangential_load - brute.tangential_load).max())
        limit = max(limit, MU * brute.pressure(approach).sum() * brute.cell**2)
    return off / limit, state.dissipated_energy / brute.dissipated - 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=64, help="of the map along each side")
    parser.add_argument("--steps", type=int, default=8, help="in a quarter of the circle, and on a side")
    options = parser.parse_args()
    n = options.points
    print("map, path, approach: amplitude of full slip, error of T over the largest μN, of the energy")
    for seed in (1, 2):
        surface = hs.random_surface((n, n), 64 / n, 0.3, 14.0, seed=seed, autocorrelation="gaussian")
        reach = 0.5 * surface.heights.max()
        solutions = hs.NormalSolutions.solve(surface, largest_approach=reach)
        for amplitude in (0.1, 0.3, 0.6):
            for name, path in paths(amplitude * MU * 0.8 * reach, options.steps).items():
                for kind in ("constant", "waving"):
                    wave = np.cos(np.linspace(0, 5 * np.pi, len(path))) if kind == "waving" else 1.0
                    approaches = reach * (0.8 + 0.2 * wave * np.ones(len(path)))
                    load, energy = compared(surface, solutions, path, approaches)
                    print(f"{seed}, {name}, {kind}: {amplitude}  {load:.4f}  {energy:+.2%}", flush=True)


if __name__ == "__main__":
    main()
