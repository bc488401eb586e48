"""Summits under one flat, each by Hertz' law: what they approach, and how far the surface moves before it slides."""

import numpy as np
from scipy import optimize

# Table B.1 of the source: alumina on zirconia, silicon on float glass
HARD = (
    1 / ((1 - 0.309**2) / 462.6e9 + (1 - 0.312**2) / 205e9),
    1 / ((2 - 0.309) / 144.3e9 + (2 - 0.312) / 81e9),
)
SOFT = (
    1 / ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9),
    1 / ((2 - 0.28) / 44e9 + (2 - 0.2) / 26e9),
)


def approaches(load, height, radius, modulus):
    """Approach of each summit under a total load: a root of Hertz's law."""
    height, radius = np.broadcast_arrays(np.asarray(height, float), radius)

    def missing(depth):
        return (
            4 / 3 * modulus * np.sqrt(radius) * np.maximum(height - height.max() + depth, 0) ** 1.5
        ).sum() - load

    one = (9 * load**2 / (16 * modulus**2 * radius.min())) ** (1 / 3)
    depth = optimize.brentq(missing, 0, 2 * one, xtol=1e-22, rtol=1e-14)
    return np.maximum(height - height.max() + depth, 0)


def displacement(load, height, radius, friction, moduli):
    """Preliminary displacement of the highest summit (Mindlin)."""
    return (
        moduli[0] / (4 * moduli[1]) * friction * approaches(load, height, radius, moduli[0]).max()
    )
