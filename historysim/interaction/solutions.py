"""`NormalSolutions`: pressures of a rough contact at a row of loads, point by point, the patches, and their cache."""

import hashlib
import math
import os
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Self

import attrs
import numpy as np

from historysim.basics.arguments import Booleans, Floats, Integers, scalar
from historysim.basics.files import replacing
from historysim.basics.limits import check_archive
from historysim.basics.wording import Notify, count_text, progress_bar, silent
from historysim.errors import InputError
from historysim.interaction.half_space import EACH_TOUCH, FewPoints, HalfSpace
from historysim.surfaces.heights import Surface

FORM = b"5"  # changes whenever the same arguments are to be computed anew
DAMAGE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    tokenize.TokenError,
)


def cache_folder() -> Path | None:
    """Folder of the cache: historysim in the system's cache folder, which may be emptied; None without a home."""
    if folder := os.environ.get("HISTORYSIM_CACHE"):
        return Path(folder)
    variable, in_home = (
        ("LOCALAPPDATA", "") if sys.platform == "win32" else ("XDG_CACHE_HOME", ".cache")
    )
    try:
        return Path(os.environ.get(variable) or Path.home() / in_home) / "historysim"
    except RuntimeError:
        # a container may run as a user who is not in its list of users
        return None


def load_or_compute(
    name: str, arguments: Sequence[Floats], compute: Callable[[], dict[str, Floats]]
) -> dict[str, Floats]:
    """Return the cached arrays of a computation, identified by its arguments; compute and store them if there are none.

    A damaged file is computed again. If there is no folder, or it cannot be written to, nothing is
    cached.
    """
    folder = cache_folder()
    if folder is None:
        return compute()
    digest = hashlib.sha256(FORM)
    for item in enumerate(arguments):
        digest.update(
            repr((item[0], item[1].shape, item[1].dtype.str)).encode() + item[1].tobytes()
        )
    path = folder / f"{name}_{digest.hexdigest()[:32]}.npz"
    try:
        check_archive(path)
        # the archive has a checksum of each array
        with np.load(path, allow_pickle=False) as arrays:
            return {key: arrays[key] for key in arrays.files}
    except DAMAGE:
        result = compute()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as unfinished, unfinished.open("wb") as stream:
            np.savez_compressed(stream, allow_pickle=False, **result)
    except (OSError, InputError):
        # also a link, a device or a file in place of a folder
        pass
    return result


LIGHTEST = 1e-3  # lightest load over the largest if more than a few points touch simultaneously
STEP = 1.12  # loads that are solved by conjugate gradients, one over the one before
# mean pressure, over E* and the rms slope, to begin from where an approach is to be reached
FIRST_PRESSURE = 1e-4
ABOVE = 1.001  # largest solved load over the requested load
MOST_DOUBLINGS = 40
ITERATIONS = (
    20  # iterations of the conjugate gradients for a load, from the solution for the previous one
)
LONG = 30.0  # expected time above which the user is notified [s]
MUCH = 2**30  # expected memory above which the user is notified [bytes]
BYTES = 118 * 2**20  # memory of the program, and of a contact of few points
# bytes in memory for each point of a periodic map, and of any other
POINT_BYTES = {True: 96, False: 216}
PRESSURE_BYTES = 24  # bytes of the pressure of a point in contact under a load
# A/A0 over p/(E* h'), with the rms slope h' of the map, for small contact areas
AREA_PER_PRESSURE = 2.2
# Change of the contact area without every second point, from which areas and patches are those of
# the grid.
MOST_CHANGE = 0.1


@attrs.frozen(eq=False)
class NormalSolutions:
    """Frictionless solutions of one height map under a flat, from the first point that touches to the heaviest load.

    Up to the first row one point carries all, a flat punch. Between the rows pressures are taken to
    grow together.
    """

    approach: Floats  #: (row) Of the flat, from first touch [m]
    #: (point) Flat indices of the points of the map that touch under the largest load.
    point: Integers = attrs.field(repr=False)
    pressure: Floats = attrs.field(repr=False)  #: (row, point) Pressures there, over E*
    #: (row) dP/da of the whole contact over E*, just before the row [m]; NaN where it was not
    #: solved.
    stiffness: Floats = attrs.field(repr=False)
    #: (point) The patch of each point: connected parts of the contact under the largest load, the
    #: largest first.
    patch: Integers = attrs.field(repr=False)
    shape: tuple[int, int]  #: of the map
    pixel_size: tuple[float, float]  #: [m]
    highest_summit: float  #: height of the flat at first touch [m]
    #: Relative change of the approach and of the contact area under the largest load without every
    #: second point of the map: how much the map's resolution matters.
    coarse: tuple[float, float]

    @classmethod
    def solve(
        cls,
        surface: Surface,
        *,
        largest_load: float = 0.0,
        largest_approach: float = 0.0,
        progress: bool = False,
        notify: Notify = silent,
    ) -> Self:
        """Solve a map up to a load and an approach, or take the solutions from the cache of an earlier run.

        A surface that repeats is solved as repeating, any other as alone on its half-space. The
        load is over E* [m²], the approach from first touch [m]; `notify` takes the notice of how
        long it will take, where that is long. A map that cannot be solved, or not in the machine's
        memory, and neither a load nor an approach, are an InputError.
        """
        load, approach = (
            scalar("largest_load", largest_load, least=0),
            scalar("largest_approach", largest_approach),
        )
        if load <= 0 and approach <= 0:
            raise InputError(
                "nothing touches; expected a normal load or an approach of more than 0"
            )
        _check_memory(_held(surface), surface.shape)
        space = HalfSpace(surface)
        target = (load / (surface.nominal_area), approach / space.unit)
        key = (
            np.ascontiguousarray(surface.heights),
            np.array([*surface.pixel_size, surface.periodic, *target]),
        )

        def compute() -> dict[str, Floats]:
            return _solve(space, surface, target, progress=progress, notify=notify)

        arrays = load_or_compute("normal_solutions", key, compute)
        point = arrays["point"].astype(np.int64)
        touching = np.zeros(surface.shape, dtype=bool)
        touching.flat[point] = True
        return cls(
            arrays["approach"] * space.unit,
            point,
            arrays["pressure"],
            arrays["stiffness"] * space.unit,
            label_patches(touching, periodic=surface.periodic).ravel()[point],
            surface.shape,
            surface.pixel_size,
            float(surface.heights.max()),
            (float(arrays["coarse"][0]), float(arrays["coarse"][1])),
        )

    @property
    def count(self) -> int:
        """Number of patches."""
        return int(self.patch.max()) + 1

    @property
    def load(self) -> Floats:
        """Load of each patch over E* (row, patch) [m²]."""
        return self._sum_by_patch(self.pressure) * math.prod(self.pixel_size)

    @property
    def area(self) -> Floats:
        """Contact area of each patch (row, patch) [m²]."""
        return self._sum_by_patch((self.pressure > 0).astype(np.float64)) * math.prod(
            self.pixel_size
        )

    @property
    def notices(self) -> tuple[str, ...]:
        """Warnings about the resolution of the map."""
        change = self.coarse[1]
        if abs(change) <= MOST_CHANGE:
            return ()
        becomes = f"changes by {change:+.0%}" if np.isfinite(change) else "is lost"
        patches = count_text(self.count, "patch", "patches")
        notice = (
            f"{self.point.size:,} points of the map touch, in {patches}, and the contact area {becomes} without every "
            "second point of the map: areas, patches and pressures are those of the grid, not of the surface; take a "
            "finer map, or filter it (s_filter)"
        )
        return (notice,)

    @property
    def position(self) -> tuple[Floats, Floats]:
        """Position of the most loaded point of each patch [m]: x and y (patch)."""
        order = np.lexsort((-self.pressure[-1], self.patch))
        peak_point = order[np.searchsorted(self.patch[order], np.arange(self.count))]
        x, y = (
            np.asarray(index, dtype=np.float64)
            for index in np.unravel_index(self.point[peak_point], self.shape)
        )
        return x * self.pixel_size[0], y * self.pixel_size[1]

    @property
    def first_touch(self) -> Floats:
        """Approach at which each point first touches (point) [m].

        Points that come in between two rows are taken in the order of their pressures, so that the
        area grows evenly.
        """
        row = (self.pressure > 0).argmax(axis=0)
        edges = np.append(0.0, self.approach)
        touch_approach = np.empty(self.point.size)
        for index in np.unique(row):
            new = np.flatnonzero(row == index)
            order = new[np.argsort(-self.pressure[index, new], kind="stable")]
            fraction = (np.arange(order.size) + 1.0) / order.size
            touch_approach[order] = edges[index] + fraction * (edges[index + 1] - edges[index])
        return touch_approach

    def _sum_by_patch(self, values: Floats) -> Floats:
        sums = np.zeros((values.shape[0], self.count))
        np.add.at(sums.T, self.patch, values.T)
        return sums


def _solve(
    space: HalfSpace,
    surface: Surface,
    target: tuple[float, float],
    *,
    progress: bool,
    notify: Notify,
) -> dict[str, Floats]:
    """Solve all loads, from the first touch, and the heaviest on the map with every second point left out."""
    _check_flattening(space, *target)
    count, cell = space.heights.size, math.prod(surface.size) / space.unit**2 / surface.heights.size
    rows: list[tuple[float, Integers, Floats, float]] = []
    mean = 0.0
    for row in FewPoints(space.heights, space.influence, periodic=surface.periodic).rows():
        rows.append((row.approach, row.point, row.pressure, float(row.growth.sum()) * cell))
        mean = float(row.pressure.sum()) / count
        if mean >= target[0] * ABOVE and row.approach >= target[1] * ABOVE:
            break
    else:
        for approach, pressure in _solve_heavier_loads(
            space, surface, mean, target, progress=progress, notify=notify
        ):
            # a light load may come out before the last row of few points
            if not rows or approach > rows[-1][0]:
                touching = np.flatnonzero(pressure)
                rows.append((approach, touching, pressure[touching], math.nan))
                mean = float(pressure.mean())
    point = np.sort(rows[-1][1][rows[-1][2] > 0])
    return {
        "approach": np.array([row[0] for row in rows]),
        "point": point,
        "pressure": np.array([_select_points(point, *row[1:3]) for row in rows]),
        "stiffness": np.array([row[3] for row in rows]),
        "coarse": _change_at_half_resolution(space, surface, mean, rows[-1][0], point.size / count),
    }


def _select_points(point: Integers, source_point: Integers, pressure: Floats) -> Floats:
    """Return pressures at sorted points, 0 at points that are not among the source points."""
    values = np.zeros(point.size)
    is_source = np.isin(source_point, point)
    values[np.searchsorted(point, source_point[is_source])] = pressure[is_source]
    return values


def _check_flattening(space: HalfSpace, pressure: float, approach: float) -> None:
    """Raise InputError if the requested load or approach presses a periodic map flat."""
    flat = float(space.heights.max() - space.heights.mean())
    if pressure * ABOVE >= (limit := space.flattening):
        raise InputError(
            f"the load presses the map flat, all of it touches from {limit / pressure:.1%} of that on; expected less"
        )
    if approach * ABOVE >= flat and limit < math.inf:
        raise InputError(
            f"the approach presses the map flat: at {flat * space.unit:.6g} m all of it touches; expected less"
        )


def _solve_heavier_loads(
    space: HalfSpace,
    surface: Surface,
    lowest: float,
    target: tuple[float, float],
    *,
    progress: bool,
    notify: Notify,
) -> Iterator[tuple[float, Floats]]:
    """Yield approach and pressures for increasing loads, from a mean pressure up to the requested one."""
    top = _top(space, *target)
    lowest = lowest or top * LIGHTEST
    loads = np.geomspace(
        lowest, top, max(math.ceil(math.log(top / lowest) / math.log(STEP)), 1) + 1
    )[1:]
    seconds = loads.size * ITERATIONS * space.measure_iteration_time()
    touching = space.heights.size * min(AREA_PER_PRESSURE * top / space.slope, 1.0)
    memory = _held(surface) + PRESSURE_BYTES * (loads.size + EACH_TOUCH) * touching
    _check_memory(memory, surface.shape)
    if seconds > LONG or memory > MUCH:
        and_memory = f" and {memory / 2**30:.1f} GiB of memory" if memory > MUCH else ""
        notify(
            f"the normal contact of {_sides(surface.shape)} points takes some {seconds / 60:.0f} min{and_memory} for "
            f"{loads.size} loads, once"
        )
    with progress_bar(progress, "load", loads.size, desc="normal contact", delay=2) as count:
        for load in loads:
            solution = space.solve(float(load))
            count()
            if solution is not None:
                yield solution[0], solution[1].ravel()


def _held(surface: Surface) -> float:
    """Memory of a map during its solution, without the pressures of the loads [bytes]."""
    return BYTES + POINT_BYTES[surface.periodic] * surface.heights.size


def _check_memory(needed: float, shape: tuple[int, int]) -> None:
    """Check that this machine, where it is known, has as much memory as is needed [bytes]."""
    if not hasattr(os, "sysconf"):
        return
    available = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > available:
        raise InputError(
            f"the normal contact of {_sides(shape)} points takes some {needed / 2**30:.1f} GiB of memory, and this "
            f"machine has {available / 2**30:.1f} GiB; expected a smaller map: cut it, or leave points out"
        )


def _sides(shape: tuple[int, int]) -> str:
    return " × ".join(f"{side:,}" for side in shape)


def _change_at_half_resolution(
    space: HalfSpace, surface: Surface, top: float, approach: float, area: float
) -> Floats:
    """Relative change of approach and area under the largest load if every second point is left out."""
    heights = surface.heights[::2, ::2]
    x, y = surface.pixel_size
    half = HalfSpace(Surface(heights, (2 * x, 2 * y), periodic=surface.periodic))
    # the mean pressure over an area that is a point larger where their number is odd
    solution = half.solve(top * surface.heights.size / (4 * heights.size))
    if solution is None:
        return np.array([np.inf, np.inf])
    # the highest point may be one of those left out
    reached = (solution[0] * half.unit + float(surface.heights.max() - heights.max())) / space.unit
    touches = float((solution[1] > 0).mean()) * 4 * heights.size / surface.heights.size
    return np.array([reached / approach, touches / area]) - 1.0


def _top(space: HalfSpace, mean_pressure: float, approach: float) -> float:
    """Mean pressure of the heaviest load: at least the given one, and enough to reach an approach."""
    top = mean_pressure * ABOVE
    if approach <= 0:
        return top
    trial = max(top, FIRST_PRESSURE * float(np.abs(np.diff(space.heights, axis=0)).max()))
    low, high = 0.0, math.inf
    for _ in range(MOST_DOUBLINGS):
        solution = space.solve(trial)
        reached = 0.0 if solution is None else solution[0]
        if reached >= approach * ABOVE:
            high = trial
            if reached <= approach * ABOVE**20:
                break
        else:
            low = trial
        trial = (
            math.sqrt(low * high)
            if low > 0 and high < math.inf
            else 2 * trial
            if high == math.inf
            else trial / 2
        )
    return max(top, high)


def label_patches(touching: Booleans, *, periodic: bool = False) -> Integers:
    """Label each point (nx, ny) with the number of its patch: -1 out of contact, 0 in the largest patch.

    Points that share a side or a corner belong to one patch, also across the border of a periodic
    map.
    """
    from scipy import ndimage
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not touching.any():
        return np.full(touching.shape, -1)
    labels, count = ndimage.label(touching, structure=np.ones((3, 3)))
    if periodic:
        meeting = []
        for edge, opposite in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1])):
            for shift in (-1, 0, 1):
                both = np.stack([edge, np.roll(opposite, shift)])
                meeting.append(both[:, (both > 0).all(axis=0)])
        pairs = np.concatenate(meeting, axis=1)
        graph = coo_array(
            (np.ones(pairs.shape[1]), (pairs[0], pairs[1])), shape=(count + 1, count + 1)
        )
        labels = connected_components(graph, directed=False)[1][labels]
    _, label_rank = np.unique(np.where(touching, labels, -1), return_inverse=True)
    numbers = label_rank.reshape(touching.shape) - (0 if touching.all() else 1)
    sizes = np.bincount(numbers[numbers >= 0])
    rank = np.empty(sizes.size, dtype=np.int64)
    rank[np.argsort(-sizes, kind="stable")] = np.arange(sizes.size)
    return np.where(numbers >= 0, rank[numbers], -1)
