"""Small maps to test the statistics of surfaces with, and the same statistics by loops over their points."""

import math
from fractions import Fraction

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from historysim.surfaces.heights import Surface

EPS = np.finfo(float).eps
NAN = math.nan
PIXEL = (2e-6, 3e-6)
shapes = st.tuples(st.integers(1, 5), st.integers(1, 5))
pixels = st.tuples(st.integers(1, 9), st.integers(1, 9)).map(
    lambda pair: (pair[0] * 1e-7, pair[1] * 1e-7)
)


@st.composite
def maps(draw, holes=True, shape=shapes):
    # whole nanometres on a step of up to a metre, so that no difference of two heights underflows
    nx, ny = draw(shape)
    steps = st.integers(-1000, 1000) | st.just(NAN) if holes else st.integers(-1000, 1000)
    values = draw(st.lists(steps, min_size=nx * ny, max_size=nx * ny))
    z = np.array(values, dtype=float).reshape(nx, ny) * 1e-9 + draw(
        st.sampled_from([0.0, -1e-6, 1.0])
    )
    assume(not np.isnan(z).all())
    return z


def rough(shape, seed=0, holes=0.0):
    rng = np.random.default_rng(seed)
    z = 1e-7 * rng.normal(size=shape) + 3e-7
    z[rng.random(shape) < holes] = NAN
    return z


class Points:
    """Heights as fractions by (i, j), with the neighbours of a periodic surface; absent points are None."""

    def __init__(self, z, periodic):
        self.shape, self.periodic = z.shape, periodic
        self.z = {
            index: None if np.isnan(value) else Fraction(float(value))
            for index, value in np.ndenumerate(z)
        }
        present = [value for value in self.z.values() if value is not None]
        self.mean = sum(present) / len(present)
        self.deviations = [value - self.mean for value in present]

    def at(self, i, j):
        if self.periodic:
            return self.z[i % self.shape[0], j % self.shape[1]]
        return self.z.get((i, j))

    def difference(self, i, j, axis, order):
        steps = {1: (0, 1), 2: (-1, 0, 1)}[order]
        values = [self.at(i + step, j) if axis == 0 else self.at(i, j + step) for step in steps]
        if None in values:
            return None
        return values[0] - values[1] if order == 1 else values[0] - 2 * values[1] + values[2]

    def differences(self, axis, order):
        return [self.difference(i, j, axis, order) for i, j in self.z]


WAVES = {(1, 0): 3e-8, (2, 3): 5e-8, (3, -2): 2e-8, (0, 5): 4e-8}


def sum_of_waves(shape, seed=5):
    i, j = np.indices(shape)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(WAVES))
    return sum(
        height * np.cos(2 * np.pi * (k * i / shape[0] + m * j / shape[1]) + phase)
        for ((k, m), height), phase in zip(WAVES.items(), phases, strict=True)
    )


def height_statistics(z, pixel, *, periodic=False):
    return Surface(z, pixel, periodic).statistics()


def autocorrelation(z, pixel, *, periodic=False):
    return Surface(z, pixel, periodic).autocorrelation()
