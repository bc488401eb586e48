"""A rigid flat on a rough elastic half-space without friction, solved by Tamaas (Polonsky–Keer conjugate gradients)."""

import math
import time
from typing import Any

import numpy as np

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.surfaces.heights import Surface

ACCURACY = 1e-6
"""Relative error of complementarity at which a solution is taken: what lies between two rows is known to some 1e-4."""


class HalfSpace:
    """A height map on an elastic half-space, dimensionless: lengths over the rms height, pressures over E*.

    A surface that repeats is solved as repeating: approaches then are measured against the mean displacement of
    the half-space. Any other is solved as alone on the half-space, approaches against what is far away.

    Parameters
    ----------
    surface : Surface

    Raises
    ------
    InputError
        A profile, a flat or incomplete map, or Tamaas is not installed.
    """

    def __init__(self, surface: Surface) -> None:
        try:
            import tamaas
        except ImportError as error:
            raise InputError(
                'asperities that press on one another need an extra; expected pip install "historysim[interaction]", '
                "or a surface without interaction"
            ) from error
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
        # one thread or many add up the same numbers in another order
        tamaas.set_log_level(tamaas.LogLevel.error)
        self._failed = tamaas.FloatingPointError
        self.heights = np.ascontiguousarray(surface.heights / self.unit)
        sides = [side / self.unit for side in surface.size]
        self._model: Any = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, sides, list(surface.shape))
        self._model.E, self._model.nu = 1.0, 0.0
        self._pixel = [side / self.unit for side in surface.pixel_size]
        self._operator: Any = None
        kind = tamaas.PolonskyKeerRey
        self._solver: Any = kind(self._model, self.heights, ACCURACY, kind.pressure, kind.pressure)
        if not surface.periodic:
            tamaas.ModelFactory.registerNonPeriodic(self._model, "dcfft")
            self._solver.setIntegralOperator("dcfft")
            self._operator = self._model.operators["dcfft"]

    @property
    def influence(self) -> Floats:
        """Displacement of points under a unit pressure at the first one (nx, ny)."""
        pressure = np.zeros_like(self.heights)
        pressure[0, 0] = 1.0
        return self._moved(pressure)

    @property
    def flattening(self) -> float:
        """Mean pressure from which a surface that repeats touches everywhere; infinite of any other."""
        if self._operator is not None:
            return np.inf
        stiffness = np.fft.fft2(self.influence).real
        stiffness[0, 0] = np.inf
        needed = np.fft.ifft2(np.fft.fft2(self.heights - self.heights.mean()) / stiffness).real
        return -float(needed.min())

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
        if self._operator is None:
            self._model.traction[...] = pressure
            self._model.solveNeumann()
            return np.array(self._model.displacement)
        displacement = np.zeros_like(pressure)
        self._operator(pressure, displacement)
        return displacement

    def solve(self, mean_pressure: float) -> tuple[float, Floats] | None:
        """Return approach and pressures under a mean pressure, beginning from the solution before.

        None where the load is so small that a single point would carry it and the solver finds no pressure.
        """
        try:
            error = self._solver.solve(mean_pressure)
        except self._failed:
            self._model.traction[...] = 0.0
            return None
        if not error <= ACCURACY:
            self._model.traction[...] = 0.0
            return None
        pressure = self._model.traction.copy()
        displacement = self._moved(pressure)
        touching = pressure > 0
        separation = float((self.heights - displacement)[touching].mean())
        return float(self.heights.max()) - separation, pressure
