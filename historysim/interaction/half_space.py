"""A rigid flat on a rough elastic half-space without friction: by active sets where few points touch, else by CG."""

import math
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from historysim.basics.arguments import Array, Booleans, Floats, Integers
from historysim.errors import InputError
from historysim.surfaces.heights import Surface

# Mean gap over rms height, weighted by pressure, at which a solution is used: values between two
# rows are known to some 1e-4.
ACCURACY = 1e-7
MOST_ITERATIONS = 2000  # iterations after which a load counts as one that is not solved
# Pressure that a point which the flat overlaps gets at first, over that which would close its
# overlap alone.
TOUCH_STEP = 0.3

MOST_POINTS = 200  # points in contact beyond which there are too many for active sets
MOST_CANDIDATES = 1600  # highest points that may touch
# Points in contact up to which there is a row at each touch; beyond, at each approach larger by
# `APPROACH_STEP`.
EACH_TOUCH = 16
APPROACH_STEP = 1.06
MOST_TURNS = 100
ROUNDING = 1e-11  # gap over the approach that is taken for rounding


class HalfSpace:
    """A height map on an elastic half-space, dimensionless: lengths over the rms height, pressures over E*.

    A periodic surface has approaches relative to the mean displacement of the half-space; any other
    surface is isolated, with approaches relative to points far away. Solved by constrained
    conjugate gradients (Polonsky and Keer, *Wear* 231 (1999) 206-219),
    preconditioned by the wave number.
    """

    def __init__(self, surface: Surface) -> None:
        if 1 in surface.shape:
            raise InputError(
                "the surface is a profile; expected a height map for asperities that press on one another"
            )
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
        self._padded = (
            surface.shape if surface.periodic else tuple(2 * points for points in surface.shape)
        )
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
        offsets = [
            np.minimum(at, at.size - at) * side
            for at, side in zip(points, self._pixel, strict=True)
        ]
        return np.asarray(fft.rfft2(_love(offsets[0][:, None], offsets[1], *self._pixel)))

    @property
    def influence(self) -> Floats:
        """Displacement of points under a unit pressure at the first one (nx, ny)."""
        pressure = np.zeros_like(self.heights)
        pressure[0, 0] = 1.0
        return self._displacement_under(pressure)

    @property
    def flattening(self) -> float:
        """Mean pressure from which a surface that repeats touches everywhere; infinite of any other."""
        if not self._periodic:
            return np.inf
        return -0.5 * float(self._multiply_by_wave_number(self.heights).min())

    @property
    def slope(self) -> float:
        """Rms slope of the map, by differences of neighbouring points."""
        squares = (np.diff(self.heights, axis=axis) / side for axis, side in enumerate(self._pixel))
        return math.sqrt(sum(float((difference**2).mean()) for difference in squares))

    def measure_iteration_time(self) -> float:
        """Return how long a step of the conjugate gradients takes [s]: one displacement, and as much again."""
        start_time = time.perf_counter()
        self._displacement_under(np.zeros_like(self.heights))
        return 2 * (time.perf_counter() - start_time)

    def _displacement_under(self, pressure: Floats) -> Floats:
        """Return the displacements under pressures."""
        from scipy import fft

        nx, ny = self.heights.shape
        moved = fft.irfft2(fft.rfft2(pressure, s=self._padded) * self._response, s=self._padded)
        return np.ascontiguousarray(moved[:nx, :ny])

    def _multiply_by_wave_number(self, values: Floats) -> Floats:
        """Return values with each wave multiplied by its wave number."""
        from scipy import fft

        return np.asarray(fft.irfft2(fft.rfft2(values) * self._wave_number, s=values.shape))

    def solve(self, mean_pressure: float) -> tuple[float, Floats] | None:
        """Return approach and pressures under a mean pressure, beginning from the solution before; None without one."""
        pressure, displacement = self._start(mean_pressure)
        direction = response = np.zeros_like(pressure)
        previous_size = 0.0
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
            gradient = self._precondition(residual, touching)
            # of a contact that has not changed the directions are conjugate, and their responses
            # are known by sums
            size = float((residual * gradient).sum())
            share = size / previous_size if previous_size > 0 else 0.0
            direction = gradient + share * direction
            response = self._displacement_under(gradient) + share * response
            previous_size = size
            step = float((residual * direction).sum()) / float(
                (response * direction)[touching].sum()
            )
            changed = pressure - step * direction
            leaving = changed < 0
            if leaving.any() or overlapping.any():
                changed[leaving] = 0.0
                changed[overlapping] = -self._touch_step * gap[overlapping]
                pressure = changed * (mean_pressure / changed.mean())
                displacement = self._displacement_under(pressure)
                previous_size = 0.0
            else:
                pressure, displacement = changed, displacement - step * response
        return None

    def _start(self, mean_pressure: float) -> tuple[Floats, Floats]:
        """Return the pressures of the solution before at another mean, or even ones, and their displacements."""
        if not self._pressure.any():
            self._pressure = np.ones_like(self.heights)
            self._displacement = self._displacement_under(self._pressure)
        scale = mean_pressure / float(self._pressure.mean())
        return self._pressure * scale, self._displacement * scale

    def _precondition(self, residual: Floats, touching: Booleans) -> Floats:
        """Return a direction of pressures in the contact, with a sum of 0."""
        gradient = np.where(touching, self._multiply_by_wave_number(residual), 0.0)
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
            total += (
                i
                * j
                * (
                    across * np.arcsinh(along / np.abs(across))
                    + along * np.arcsinh(across / np.abs(along))
                )
            )
    total /= np.pi
    return total


# -- few points ------------------------------------------------------------------------------------


class Row(NamedTuple):
    """A solution: approach, the points that touch (flat indices), their pressures, and how fast those grow with it."""

    approach: float
    point: Integers
    pressure: Floats
    growth: Floats


class FewPoints:
    """Contact of the highest points of a map (nx, ny), with the displacement at each offset under a unit pressure.

    It is exact. With p the pressures of the points that touch, G the displacement of one point
    under the pressure of another, and z the depth of a point below the highest, p = G⁻¹ (a - z) on
    those points, and z + G p > a on all others. So p is straight in the approach a from one touch
    to the next; the first point is a flat punch of one pixel.
    """

    def __init__(self, heights: Floats, influence: Floats, *, periodic: bool) -> None:
        depth = heights.max() - heights.ravel()
        # of points that are alike the first one in the map
        self.candidate = np.argsort(depth, kind="stable")[:MOST_CANDIDATES]
        self._depth = depth[self.candidate]
        self._matrix = _matrix(self.candidate, influence, periodic=periodic)
        # beyond the candidates others may touch; where displacements have a mean of 0 they may even
        # do so before
        self._reach = (
            np.inf if self.candidate.size == depth.size else 0.5 * float(depth[self.candidate[-1]])
        )

    def rows(self) -> Iterator[Row]:
        """Yield solutions at rising approaches, as long as few points touch."""
        touching = np.zeros(self._depth.size, dtype=bool)
        touching[0] = True
        # two points of equal height touch simultaneously
        approach, (_, _, following) = 0.0, self._solve_active_set(0.0, touching)
        while True:
            count = int(touching.sum())
            target = following if count < EACH_TOUCH else max(following, approach * APPROACH_STEP)
            if not target < self._reach or count > MOST_POINTS:
                return
            # at a touch the point that comes in carries nothing yet
            settled = self._find_active_set(target, touching)
            if settled is None:
                return
            row, touching, following = settled
            if row.approach > approach:
                yield row
            approach = target

    def _solve_active_set(
        self, approach: float, touching: Booleans
    ) -> tuple[Floats, Floats, float]:
        """Return the pressures at an approach if these points touch, how they grow, and where the next one touches."""
        from scipy.linalg import cho_factor, cho_solve

        matrix = self._matrix[np.ix_(touching, touching)]
        right_sides = np.stack(
            [approach - self._depth[touching], np.ones(int(touching.sum()))], axis=1
        )
        pressure, growth = cho_solve(cho_factor(matrix), right_sides).T
        across = self._matrix[np.ix_(~touching, touching)]
        gap, closing = self._depth[~touching] - approach + across @ pressure, 1.0 - across @ growth
        with np.errstate(divide="ignore"):
            ahead = np.where(closing > 0, gap / closing, np.inf)
        return pressure, growth, approach + max(float(ahead.min(initial=np.inf)), 0.0)

    def _find_active_set(
        self, approach: float, touching: Booleans
    ) -> tuple[Row, Booleans, float] | None:
        """Return the solution at an approach, the points that touch just beyond it, and where the next one touches.

        None where points come and leave in turn, which conjugate gradients do not mind.
        """
        touching = touching.copy()
        row = None
        for _ in range(MOST_TURNS):
            pressure, growth, following = self._solve_active_set(approach, touching)
            inside = np.flatnonzero(touching)
            gap = self._depth - approach + self._matrix[:, inside] @ pressure
            leaves = inside[pressure < -ROUNDING * np.abs(pressure).max()]
            comes = np.flatnonzero(~touching & (gap <= ROUNDING * approach))
            settled = not leaves.size and not comes.size
            # those that come at this approach itself carry nothing before it
            at_once = not leaves.size and not (gap[comes] < -ROUNDING * approach).any()
            if row is None and (at_once or settled):
                row = Row(approach, self.candidate[inside], np.clip(pressure, 0.0, None), growth)
            if settled and row is not None:
                return row, touching, following
            touching[leaves] = False
            touching[comes] = True
        return None


def _matrix(point: Integers, influence: Floats, *, periodic: bool) -> Floats:
    """Return the displacement of each point under a unit pressure at each."""
    x, y = np.unravel_index(point, influence.shape)
    dx, dy = x[:, None] - x, y[:, None] - y
    if not periodic:
        dx, dy = np.abs(dx), np.abs(dy)
    displacement: Floats = influence[dx, dy]
    return displacement
