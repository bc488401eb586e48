"""`NormalSolutions`: pressures of a rough contact at a row of loads, point by point, and the patches."""

import math
from collections.abc import Iterator
from typing import Self

import attrs
import numpy as np

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats, Integers
from historysim.basics.notices import Teller, silent
from historysim.basics.progress import progress_bar
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.interaction.cache import kept
from historysim.interaction.few_points import FewPoints
from historysim.interaction.half_space import HalfSpace
from historysim.interaction.patches import patches_of
from historysim.surfaces.heights import Surface

LIGHTEST = 1e-3
"""Lightest load over the largest where more points than a few touch at once."""
STEP = 1.12
"""Loads that are solved by conjugate gradients, one over the one before."""
FIRST_PRESSURE = 1e-4
"""Mean pressure, over E* and the rms slope, to begin from where an approach is to be reached."""
ABOVE = 1.001
"""By how much the largest load that is solved lies above what is asked for."""
MOST_DOUBLINGS = 40
ITERATIONS = 60
"""Steps of the conjugate gradients that a load takes, after the one before it."""
LONG = 30.0
"""Time that is announced before it begins [s]."""
MOST_CHANGE = 0.1
"""Change of the contact area without every second point, from which areas and patches are those of the grid."""


@attrs.frozen(eq=False)
class NormalSolutions:
    """Frictionless solutions of one height map under a flat, from the first point that touches to the heaviest load.

    Up to the first row one point carries all, a flat punch. Between the rows pressures are taken to grow together.

    Attributes
    ----------
    approach : array (row)
        Of the flat, from first touch [m].
    point : array (point)
        Flat indices of the points of the map that touch under the largest load.
    pressure : array (row, point)
        Pressures there, over E*.
    stiffness : array (row)
        dP/da of the whole contact over E*, just before the row; not a number where it was not solved [m].
    patch : array (point)
        The patch that a point belongs to: connected parts of the contact under the largest load, the largest first.
    shape : (int, int)
        Of the map.
    pixel_size : (float, float)
        [m].
    highest_summit : float
        Height of the flat at first touch [m].
    coarse : (float, float)
        Change of the approach and of the contact area under the largest load, relatively, if every second point of
        the map is left out: how much the map's resolution matters.
    """

    approach: Floats
    point: Integers = attrs.field(repr=False)
    pressure: Floats = attrs.field(repr=False)
    stiffness: Floats = attrs.field(repr=False)
    patch: Integers = attrs.field(repr=False)
    shape: tuple[int, int]
    pixel_size: tuple[float, float]
    highest_summit: float
    coarse: tuple[float, float]

    @classmethod
    def of(
        cls,
        surface: Surface,
        *,
        largest_load: float = 0.0,
        largest_approach: float = 0.0,
        progress: bool = False,
        tell: Teller = silent,
    ) -> Self:
        """Solve a map up to a load and an approach, or take the solutions from the cache of an earlier run.

        Parameters
        ----------
        surface : Surface
            One that repeats is solved as repeating, any other as alone on its half-space.
        largest_load : float
            Over E* [m²].
        largest_approach : float
            From first touch [m].
        progress : bool
            Show a progress bar on standard error where that is a terminal and it takes long.
        tell : callable, optional
            Takes the notice of how long it will take, where that is long.

        Raises
        ------
        InputError
            A map that cannot be solved, neither a load nor an approach, or the extra is not installed.
        """
        load, approach = scalar("largest_load", largest_load, least=0), scalar("largest_approach", largest_approach)
        if load <= 0 and approach <= 0:
            raise InputError("nothing touches; expected a normal load or an approach of more than 0")
        space = HalfSpace(surface)
        target = (load / (surface.nominal_area), approach / space.unit)
        key = (np.ascontiguousarray(surface.heights), np.array([*surface.pixel_size, surface.periodic, *target]))

        def solved() -> dict[str, Floats]:
            return _solve(space, surface, target, progress=progress, tell=tell)

        found = kept("normal_solutions", key, solved)
        touching = (found["pressure"][-1] > 0).reshape(surface.shape)
        return cls(
            found["approach"] * space.unit,
            (point := np.flatnonzero(touching)),
            found["pressure"][:, point],
            found["stiffness"] * space.unit,
            patches_of(touching, periodic=surface.periodic).ravel()[point],
            surface.shape,
            surface.pixel_size,
            float(surface.heights.max()),
            (float(found["coarse"][0]), float(found["coarse"][1])),
        )

    @property
    def count(self) -> int:
        """Number of patches."""
        return int(self.patch.max()) + 1

    @property
    def load(self) -> Floats:
        """Load of each patch over E* (row, patch) [m²]."""
        return self._summed(self.pressure) * math.prod(self.pixel_size)

    @property
    def area(self) -> Floats:
        """Contact area of each patch (row, patch) [m²]."""
        return self._summed((self.pressure > 0).astype(np.float64)) * math.prod(self.pixel_size)

    @property
    def notices(self) -> tuple[str, ...]:
        """What has to be known of the solutions."""
        change = self.coarse[1]
        if abs(change) <= MOST_CHANGE:
            return ()
        patches = counted(self.count, "patch", "patches")
        told = f"changes by {change:+.0%}" if np.isfinite(change) else "is lost"
        notice = (
            f"{self.point.size:,} points of the map touch, in {patches}, and the contact area {told} without every "
            "second point of the map: areas, patches and pressures are those of the grid, not of the surface; take a "
            "finer map, or filter it (s_filter)"
        )
        return (notice,)

    @property
    def position(self) -> tuple[Floats, Floats]:
        """Where each patch carries most [m]: x and y (patch)."""
        order = np.lexsort((-self.pressure[-1], self.patch))
        first = order[np.searchsorted(self.patch[order], np.arange(self.count))]
        x, y = (np.asarray(index, dtype=np.float64) for index in np.unravel_index(self.point[first], self.shape))
        return x * self.pixel_size[0], y * self.pixel_size[1]

    @property
    def first_touch(self) -> Floats:
        """Approach at which each point first touches (point) [m].

        Points that come in between two rows are taken in the order of their pressures, so that the area grows evenly.
        """
        row = (self.pressure > 0).argmax(axis=0)
        edges = np.append(0.0, self.approach)
        found = np.empty(self.point.size)
        for index in np.unique(row):
            new = np.flatnonzero(row == index)
            order = new[np.argsort(-self.pressure[index, new], kind="stable")]
            part = (np.arange(order.size) + 1.0) / order.size
            found[order] = edges[index] + part * (edges[index + 1] - edges[index])
        return found

    def _summed(self, values: Floats) -> Floats:
        sums = np.zeros((values.shape[0], self.count))
        np.add.at(sums.T, self.patch, values.T)
        return sums


def _solve(
    space: HalfSpace, surface: Surface, target: tuple[float, float], *, progress: bool, tell: Teller
) -> dict[str, Floats]:
    """Solve all loads, from the first touch, and the heaviest on the map with every second point left out."""
    _check_flattening(space, *target)
    count, cell = space.heights.size, math.prod(surface.size) / space.unit**2 / surface.heights.size
    approaches, pressures, stiffnesses = [], [], []
    for row in FewPoints(space.heights, space.influence, periodic=surface.periodic).rows():
        pressure = np.zeros(count)
        pressure[row.point] = row.pressure
        approaches.append(row.approach)
        pressures.append(pressure)
        stiffnesses.append(float(row.growth.sum()) * cell)
        if pressure.mean() >= target[0] * ABOVE and row.approach >= target[1] * ABOVE:
            break
    else:
        first = float(pressures[-1].mean()) if pressures else 0.0
        for approach, pressure in _heavier(space, first, target, progress=progress, tell=tell):
            if not approaches or approach > approaches[-1]:
                approaches.append(approach)
                pressures.append(pressure)
                stiffnesses.append(math.nan)
    return {
        "approach": np.array(approaches),
        "pressure": np.array(pressures),
        "stiffness": np.array(stiffnesses),
        "coarse": _change_at_half(
            space, surface, float(pressures[-1].mean()), approaches[-1], float((pressures[-1] > 0).mean())
        ),
    }


def _check_flattening(space: HalfSpace, pressure: float, approach: float) -> None:
    """Check that what is asked for does not press a map flat that repeats."""
    flat = float(space.heights.max() - space.heights.mean())
    if pressure * ABOVE >= (limit := space.flattening):
        raise InputError(
            f"the load presses the map flat, all of it touches from {limit / pressure:.1%} of that on; expected less"
        )
    if approach * ABOVE >= flat and limit < math.inf:
        raise InputError(
            f"the approach presses the map flat: at {flat * space.unit:.6g} m all of it touches; expected less"
        )


def _heavier(
    space: HalfSpace, first: float, target: tuple[float, float], *, progress: bool, tell: Teller
) -> Iterator[tuple[float, Floats]]:
    """Yield approaches and pressures of loads from above a mean pressure to what is asked for."""
    top = _top(space, *target)
    first = first or top * LIGHTEST
    loads = np.geomspace(first, top, max(math.ceil(math.log(top / first) / math.log(STEP)), 1) + 1)[1:]
    seconds = loads.size * ITERATIONS * space.time_of_iteration()
    if seconds > LONG:
        sides = " × ".join(f"{side:,}" for side in space.heights.shape)
        tell(f"the normal contact of {sides} points takes some {seconds / 60:.0f} min for {loads.size} loads, once")
    with progress_bar(progress, "load", loads.size, desc="normal contact", delay=2) as count:
        for load in loads:
            found = space.solve(float(load))
            count()
            if found is not None:
                yield found[0], found[1].ravel()


def _change_at_half(space: HalfSpace, surface: Surface, top: float, approach: float, area: float) -> Floats:
    """Change of approach and area, relatively, under the largest load if every second point is left out."""
    heights = surface.heights[::2, ::2]
    x, y = surface.pixel_size
    half = HalfSpace(Surface(heights, (2 * x, 2 * y), periodic=surface.periodic))
    # the mean pressure over an area that is a point larger where their number is odd
    found = half.solve(top * surface.heights.size / (4 * heights.size))
    if found is None:
        return np.array([np.inf, np.inf])
    # the highest point may be one of those left out
    reached = (found[0] * half.unit + float(surface.heights.max() - heights.max())) / space.unit
    touches = float((found[1] > 0).mean()) * 4 * heights.size / surface.heights.size
    return np.array([reached / approach, touches / area]) - 1.0


def _top(space: HalfSpace, mean_pressure: float, approach: float) -> float:
    """Mean pressure of the heaviest load: at least one given, and as much as an approach needs."""
    top = mean_pressure * ABOVE
    if approach <= 0:
        return top
    trial = max(top, FIRST_PRESSURE * float(np.abs(np.diff(space.heights, axis=0)).max()))
    low, high = 0.0, math.inf
    for _ in range(MOST_DOUBLINGS):
        found = space.solve(trial)
        reached = 0.0 if found is None else found[0]
        if reached >= approach * ABOVE:
            high = trial
            if reached <= approach * ABOVE**20:
                break
        else:
            low = trial
        trial = math.sqrt(low * high) if low > 0 and high < math.inf else 2 * trial if high == math.inf else trial / 2
    return max(top, high)
