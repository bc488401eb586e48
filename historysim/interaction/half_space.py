"""A rigid flat on a rough elastic half-space without friction, by conjugate gradients on Fourier transforms."""

import math
import time

import numpy as np

from historysim.basics.array_types import Array, Booleans, Floats
from historysim.errors import InputError
from historysim.surfaces.heights import Surface

ACCURACY = 1e-7
"""Mean gap over rms height, weighted by pressure, at which a solution is taken: what lies between two rows is known to
some 1e-4."""
MOST_ITERATIONS = 2000
"""Iterations after which a load counts as one that is not solved."""
TOUCH_STEP = 0.3
"""Pressure that a point which the flat overlaps gets at first, over that which would close its overlap alone."""


class HalfSpace:
    """A height map on an elastic half-space, dimensionless: lengths over the rms height, pressures over E*.

    A surface that repeats is solved as repeating: approaches then are measured against the mean displacement of
    the half-space. Any other is solved as alone on the half-space, approaches against what is far away.

    Constrained conjugate gradients (Polonsky and Keer, *Wear* 231 (1999) 206-219), with one displacement an iteration
    while no point comes or leaves, and preconditioned by the wave number, to which the stiffness is in proportion.

    Parameters
    ----------
    surface : Surface

    Raises
    ------
    InputError
        A profile, or a flat or incomplete map.
    """

    def __init__(self, surface: Surface) -> None:
        if 1 in surface.shape:
            raise InputError("the surface is a profile; expected a height map for asperities that press on one another")
        if missing := int(surface.missing.sum()):
            raise InputError(
                f"{missing:,} heights are missing; expected none where asperities press on one another: cut them off, "
                "or fill them"
            )
        self.unit = float(surface.heights.std())
        if self.unit == 0.0:
            raise InputError("the surface is flat; expected heights that differ")
        self.heights = np.ascontiguousarray(surface.heights / self.unit)
        self._periodic = surface.periodic
        self._pixel = [side / self.unit for side in surface.pixel_size]
        self._wave_number = _wave_number(surface.shape, self._pixel)
        self._padded = surface.shape if surface.periodic else tuple(2 * points for points in surface.shape)
        self._response = self._responses()
        self._pressure = self._displacement = np.zeros_like(self.heights)
        self._touch_step = TOUCH_STEP / float(self.influence[0, 0])

    def _responses(self) -> Array:
        """Return the Fourier transform of the displacements under a unit pressure at one point."""
        from scipy import fft

        if self._periodic:
            # the mean displacement of a half-space is not known, and counts as 0
            rest = np.where(self._wave_number > 0, self._wave_number, np.inf)
            return np.where(self._wave_number > 0, 2.0 / rest, 0.0)
        points = (np.arange(count) for count in self._padded)
        offsets = [np.minimum(at, at.size - at) * side for at, side in zip(points, self._pixel, strict=True)]
        return np.asarray(fft.rfft2(_love(offsets[0][:, None], offsets[1], *self._pixel)))

    @property
    def influence(self) -> Floats:
        """Displacement of points under a unit pressure at the first one (nx, ny)."""
        pressure = np.zeros_like(self.heights)
        pressure[0, 0] = 1.0
        return self._moved(pressure)

    @property
    def flattening(self) -> float:
        """Mean pressure from which a surface that repeats touches everywhere; infinite of any other."""
        if not self._periodic:
            return np.inf
        return -0.5 * float(self._steepened(self.heights).min())

    @property
    def slope(self) -> float:
        """Rms slope of the map, by differences of neighbouring points."""
        squares = (np.diff(self.heights, axis=axis) / side for axis, side in enumerate(self._pixel))
        return math.sqrt(sum(float((each**2).mean()) for each in squares))

    def time_of_iteration(self) -> float:
        """Return how long a step of the conjugate gradients takes [s]: one displacement, and as much again."""
        begin = time.perf_counter()
        self._moved(np.zeros_like(self.heights))
        return 2 * (time.perf_counter() - begin)

    def _moved(self, pressure: Floats) -> Floats:
        """Return the displacements under pressures."""
        from scipy import fft

        nx, ny = self.heights.shape
        moved = fft.irfft2(fft.rfft2(pressure, s=self._padded) * self._response, s=self._padded)
        return np.ascontiguousarray(moved[:nx, :ny])

    def _steepened(self, values: Floats) -> Floats:
        """Return values with each wave multiplied by its wave number."""
        from scipy import fft

        return np.asarray(fft.irfft2(fft.rfft2(values) * self._wave_number, s=values.shape))

    def solve(self, mean_pressure: float) -> tuple[float, Floats] | None:
        """Return approach and pressures under a mean pressure, beginning from the solution before; None without one."""
        pressure, displacement = self._start(mean_pressure)
        direction = response = np.zeros_like(pressure)
        before = 0.0
        for _ in range(MOST_ITERATIONS):
            gap = displacement - self.heights
            touching = pressure > 0
            gap -= gap[touching].mean()
            overlapping = ~touching & (gap < 0)
            if (
                float(np.abs(pressure * gap).sum()) <= ACCURACY * float(pressure.sum())
                and not (overlapping & (gap < -ACCURACY)).any()
            ):
                self._pressure, self._displacement = pressure, displacement
                separation = float((self.heights - displacement)[touching].mean())
                return float(self.heights.max()) - separation, pressure
            residual = np.where(touching, gap, 0.0)
            gradient = self._preconditioned(residual, touching)
            # of a contact that has not changed the directions are conjugate, and their responses are known by sums
            size = float((residual * gradient).sum())
            share = size / before if before > 0 else 0.0
            direction = gradient + share * direction
            response = self._moved(gradient) + share * response
            before = size
            step = float((residual * direction).sum()) / float((response * direction)[touching].sum())
            changed = pressure - step * direction
            leaving = changed < 0
            if leaving.any() or overlapping.any():
                changed[leaving] = 0.0
                changed[overlapping] = -self._touch_step * gap[overlapping]
                pressure = changed * (mean_pressure / changed.mean())
                displacement = self._moved(pressure)
                before = 0.0
            else:
                pressure, displacement = changed, displacement - step * response
        return None

    def _start(self, mean_pressure: float) -> tuple[Floats, Floats]:
        """Return the pressures of the solution before at another mean, or even ones, and their displacements."""
        if not self._pressure.any():
            self._pressure = np.ones_like(self.heights)
            self._displacement = self._moved(self._pressure)
        scale = mean_pressure / float(self._pressure.mean())
        return self._pressure * scale, self._displacement * scale

    def _preconditioned(self, residual: Floats, touching: Booleans) -> Floats:
        """Return a direction of pressures in the contact, with a sum of 0."""
        gradient = np.where(touching, self._steepened(residual), 0.0)
        gradient[touching] -= gradient[touching].mean()
        return gradient


def _wave_number(shape: tuple[int, ...], pixel: list[float]) -> Floats:
    """Return the wave numbers of a real Fourier transform."""
    x = 2 * np.pi * np.fft.fftfreq(shape[0], pixel[0])
    y = 2 * np.pi * np.fft.rfftfreq(shape[1], pixel[1])
    return np.asarray(np.hypot(x[:, None], y))


def _love(x: Floats, y: Floats, width: float, depth: float) -> Floats:
    """Return the displacement at offsets from the middle of a rectangle under a unit pressure over E* (Love 1929)."""
    total: Floats = np.zeros(np.broadcast(x, y).shape)
    for i in (-1, 1):
        for j in (-1, 1):
            across, along = x + i * width / 2, y + j * depth / 2
            total += i * j * (across * np.arcsinh(along / np.abs(across)) + along * np.arcsinh(across / np.abs(along)))
    total /= np.pi
    return total
