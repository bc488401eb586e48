"""Summits: peaks of a height map, which become asperities."""

from collections.abc import Mapping
from typing import Self

import attrs
import numpy as np

from historysim.basics.arguments import (
    Array,
    ArrayLike,
    Booleans,
    Floats,
    FrozenArrays,
    Integers,
    as_item_array,
    scalar,
    workable,
)
from historysim.basics.library import lib, pointer
from historysim.basics.limits import SMALLEST
from historysim.basics.units import metres, range_text
from historysim.basics.wording import count_text
from historysim.errors import InputError


@attrs.frozen(eq=False, init=False, getstate_setstate=False)
class Summits(FrozenArrays):
    """Summits of a surface, in a fixed order; there may be none.

    Parameters
    ----------
    height : array_like (summit)
        Height z over the datum of the surface [m].
    radius : array_like (summit)
        Radius R of the sphere that touches the summit [m], > 0; one number applies to all.
    x, y : array_like (summit), optional
        Position [m].
    nominal_area : float, optional
        Area of the surface [m²], > 0; None if it is unknown or the surface is a profile.
    slope : array_like (summit), optional
        Of summits from `meeting`: tan α of the contact plane along x; one number applies to all.
    """

    height: Floats
    radius: Floats
    x: Floats | None
    y: Floats | None
    nominal_area: float | None
    slope: Floats | None

    def __init__(
        self,
        height: "ArrayLike",
        radius: "ArrayLike",
        x: "ArrayLike | None" = None,
        y: "ArrayLike | None" = None,
        *,
        nominal_area: float | None = None,
        slope: "ArrayLike | None" = None,
    ) -> None:
        heights = workable("height", as_item_array("summit", "summits", "height", height))
        radii = as_item_array("summit", "summits", "radius", radius, heights.size, above=0)
        self.__attrs_init__(
            height=heights,
            radius=workable("radius", radii, smallest=SMALLEST),
            x=None if x is None else as_item_array("summit", "summits", "x", x, heights.size),
            y=None if y is None else as_item_array("summit", "summits", "y", y, heights.size),
            nominal_area=None
            if nominal_area is None
            else scalar("nominal_area", nominal_area, above=0),
            slope=None
            if slope is None
            else as_item_array("summit", "summits", "slope", slope, heights.size),
        )

    def at_heights(self, height: ArrayLike) -> Self:
        """Return the same summits at other heights [m]."""
        return type(self)(
            height, self.radius, self.x, self.y, nominal_area=self.nominal_area, slope=self.slope
        )

    def with_area(self, nominal_area: float) -> Self:
        """Return the same summits on another nominal area [m²]."""
        return type(self)(
            self.height, self.radius, self.x, self.y, nominal_area=nominal_area, slope=self.slope
        )

    def meeting(self, other: "Summits", *, shift: tuple[float, float] = (0.0, 0.0)) -> Self:
        """Pair these summits with the summits of an opposite body, and return the contacts as summits with slopes.

        Summits are the spheres of their radii; README.md of `historysim.contact`, "Inclined
        asperities", has the equations. Each summit selects the one that it touches first as the
        bodies approach; two that select each other meet. The heights of the other body count from
        its own datum towards these summits; it is shifted by ``shift`` along x and y [m].
        InputError if summits have no positions or none meet.
        """
        if self.x is None or self.y is None or other.x is None or other.y is None:
            raise InputError(
                "summits without positions cannot meet others; expected x and y of both"
            )
        along, across = (scalar("shift", metres(component)) for component in shift)
        x, y = other.x + along, other.y + across
        chosen, highest_touch = np.zeros(len(self), dtype=np.int64), np.full(len(other), -np.inf)
        choosing = np.full(len(other), -1)
        for index in range(len(self) if len(other) else 0):
            reach = self.radius[index] + other.radius
            square = reach**2 - (x - self.x[index]) ** 2 - (y - self.y[index]) ** 2
            upright = np.sqrt(np.maximum(square, 0.0))
            touch = np.where(
                square > 0.0, self.height[index] + other.height - (reach - upright), -np.inf
            )
            chosen[index] = np.argmax(touch)
            own_index = touch > highest_touch
            highest_touch[own_index], choosing[own_index] = touch[own_index], index
        other_index = np.flatnonzero(choosing >= 0)
        other_index = other_index[chosen[choosing[other_index]] == other_index]
        if not other_index.size:
            raise InputError("no summits of the two bodies meet; expected maps that overlap")
        own_index = choosing[other_index]
        reach = self.radius[own_index] + other.radius[other_index]
        along, across = x[other_index] - self.x[own_index], y[other_index] - self.y[own_index]
        fraction = self.radius[own_index] / reach
        return type(self)(
            highest_touch[other_index],
            fraction * other.radius[other_index],
            self.x[own_index] + fraction * along,
            self.y[own_index] + fraction * across,
            nominal_area=self.nominal_area,
            slope=-along / np.sqrt(reach**2 - along**2 - across**2),
        )

    def __len__(self) -> int:
        """Return the number of summits."""
        return self.height.size

    def __repr__(self) -> str:
        ranges = [
            f"{name} {range_text(float(values.min()), float(values.max()), 'm')}"
            for name, values in (
                ("heights", self.height),
                ("radii", self.radius),
                ("x", self.x),
                ("y", self.y),
            )
            if values is not None and len(self)
        ]
        density = [] if self.density is None else [f"{self.density * 1e-12:.4g} per µm²"]
        return f"<Summits: {', '.join([count_text(len(self), 'summit', 'summits'), *ranges, *density])}>"

    @property
    def density(self) -> float | None:
        """Summits per nominal area [1/m²]; None if the area is unknown."""
        return None if self.nominal_area is None else len(self) / self.nominal_area


HANDFUL = 10  # the most summits that are reported as outliers
TAIL = 100  # summits below them that define the tail of the heights
CHANCE = 1e-6  # probability of such a gap in an exponential tail, below which summits are detached
# default least prominence over the height range Rz for pruning (Wolf pruning, ISO 25178-2)
WOLF = 0.05

_AROUND: Mapping[int, tuple[tuple[int, int], ...]] = {
    3: ((1, 0), (-1, 0)),
    5: ((1, 0), (-1, 0), (0, 1), (0, -1)),
    9: ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)),
}


def find_summits(
    heights: Floats,
    pixel_size: tuple[float, float],
    rule: int = 9,
    *,
    periodic: bool = False,
    prominence: float = 0.0,
) -> Summits:
    """Find the summits of a height map (nx, ny) [m]: points that are higher than all their neighbours.

    The ``rule`` is 9 with the diagonal neighbours, 5 without, and 3 for profiles: the peaks of each
    along x, or along y where the map has only one point along x. R = 1/κ with κ = (κ_x + κ_y)/2 of
    the central differences κ_x = |z(x-1) - 2z + z(x+1)|/p_x² (Greenwood 1984; by the rule 3 κ =
    κ_x). A plateau with only lower points around it is one summit, in the middle of its points and
    with the mean of their curvatures. A point next to the border or a missing point (NaN) is not a
    summit; nor is a ridge around a periodic surface. ``prominence`` is the least height [m] over
    the highest saddle on a path to a higher point; see `prominences`.
    """
    prominence = scalar("prominence", prominence, least=0)
    if not isinstance(rule, int) or rule not in _AROUND:
        raise InputError(f"rule is {rule!r}; expected 3 (for profiles), 5 or 9 points")
    if rule != 3 and 1 in heights.shape:
        raise InputError(
            f"rule is {rule} for a profile of {heights.size} points; expected 3, the rule for profiles"
        )
    if rule == 3 and heights.shape[0] == 1 < heights.shape[1]:
        turned = find_summits(
            heights.T, pixel_size[::-1], rule, periodic=periodic, prominence=prominence
        )
        return Summits(turned.height, turned.radius, turned.y, turned.x)
    points, owner, indices = _find_tops(heights, rule, periodic)
    first_point = np.full(owner.max(initial=-1) + 1, heights.size)
    np.minimum.at(first_point, owner, points)
    curvature = np.stack(
        [
            _mean(owner, _sum_drops(heights, points, axis, periodic) / pixel_size[axis] ** 2)
            for axis in ((0,) if rule == 3 else (0, 1))
        ]
    )
    order = np.argsort(first_point)
    # a plateau has the prominence of its first point
    if prominence > 0:
        order = order[
            prominences(heights, _AROUND[rule], periodic=periodic).flat[first_point[order]]
            >= prominence
        ]
    x, y = (
        (_mean(owner, index) % size)[order] * pixel
        for index, size, pixel in zip(indices, heights.shape, pixel_size, strict=True)
    )
    area = heights.size * pixel_size[0] * pixel_size[1]
    return Summits(
        heights.flat[first_point[order]],
        1 / curvature.mean(axis=0)[order],
        x,
        y,
        nominal_area=None if 1 in heights.shape else area,
    )


def _pad(values: Array, periodic: bool, nothing: float = np.nan) -> Array:
    """Pad values by one point on all sides: periodic images, or else the value `nothing`."""
    return (
        np.pad(values, 1, mode="wrap") if periodic else np.pad(values, 1, constant_values=nothing)
    )


def _neighbour_values(padded: Array, offset: tuple[int, int]) -> Array:
    """Return the neighbour of each unpadded point at an offset."""
    nx, ny = padded.shape
    return padded[1 + offset[0] : nx - 1 + offset[0], 1 + offset[1] : ny - 1 + offset[1]]


def _sum_drops(heights: Floats, points: Integers, axis: int, periodic: bool) -> Floats:
    """Return the sum of the drops from points to both neighbours along an axis."""
    padded = _pad(heights, periodic)
    offsets = (_AROUND[5][2 * axis], _AROUND[5][2 * axis + 1])
    height, ahead, behind = (
        heights.flat[points],
        *(_neighbour_values(padded, offset).flat[points] for offset in offsets),
    )
    fall: Floats = (height - ahead) + (height - behind)
    return fall


def _mean(owner: Integers, values: Array) -> Floats:
    mean: Floats = np.bincount(owner, values) / np.bincount(owner)
    return mean


def _find_tops(heights: Floats, rule: int, periodic: bool) -> tuple[Integers, Integers, Array]:
    """Return the points of tops, the summit of each point, and their indices (2, points) along x and y.

    Indices of a plateau across the border of a periodic surface continue beyond it.
    """
    padded = _pad(heights, periodic)
    top, tied = np.ones(heights.shape, dtype=bool), np.zeros(heights.shape, dtype=bool)
    for offset in _AROUND[rule]:
        # a comparison with a missing neighbour, NaN, is false
        top &= heights >= _neighbour_values(padded, offset)
        tied |= heights == _neighbour_values(padded, offset)
    single = np.flatnonzero(top & ~tied)
    indices = np.stack(np.unravel_index(single, heights.shape))
    tied &= top
    if not tied.any():
        return single, np.arange(single.size), indices
    # a plateau next to a point of equal height that is not a top continues uphill from there
    open_ended, tops = np.zeros_like(tied), _pad(top, periodic, nothing=False)
    for offset in _AROUND[rule]:
        open_ended |= (
            tied & (heights == _neighbour_values(padded, offset)) & ~_neighbour_values(tops, offset)
        )
    shared, plateau = _find_plateaus(tied, open_ended, rule, periodic)
    points = np.ravel_multi_index(tuple(shared), heights.shape, mode="wrap")
    owner = np.concatenate([np.arange(single.size), single.size + plateau])
    return np.concatenate([single, points]), owner, np.concatenate([indices, shared], axis=1)


def _find_plateaus(
    tied: Booleans, open_ended: Booleans, rule: int, periodic: bool
) -> tuple[Array, Integers]:
    """Return the indices (2, points) of points on plateaus with only lower neighbours, and the plateau of each."""
    from scipy import ndimage

    structure = np.zeros((3, 3), dtype=bool)
    structure[tuple(np.transpose([(0, 0), *_AROUND[rule]]) + 1)] = True
    # two periods contain a complete copy of each plateau; an endless ridge always meets the border
    periods = [2 if periodic and size > 1 else 1 for size in tied.shape]
    labels, count = ndimage.label(np.tile(tied, periods), structure)
    wrong = np.zeros(count + 1, dtype=bool)
    wrong[labels[np.tile(open_ended, periods)]] = True
    if periodic:
        edges = [labels[[0, -1]]] * (periods[0] > 1) + [labels[:, [0, -1]]] * (periods[1] > 1)
        wrong[np.concatenate([edge.ravel() for edge in edges])] = True
    wrong[0] = True
    indices = np.stack(np.nonzero(~wrong[labels]))
    label = labels[tuple(indices)]
    # of the copies of a plateau, which share a first point, only the first is used
    first_point = np.full(count + 1, tied.size)
    np.minimum.at(first_point, label, np.ravel_multi_index(tuple(indices), tied.shape, mode="wrap"))
    chosen = np.unique(first_point[label], return_index=True)[1]
    selected = np.flatnonzero(np.isin(label, label[chosen]))
    # in the order of the points on the map, so that means do not depend on the copy
    selected = selected[
        np.argsort(np.ravel_multi_index(tuple(indices[:, selected]), tied.shape, mode="wrap"))
    ]
    indices, plateau = indices[:, selected], np.unique(label[selected], return_inverse=True)[1]
    # counted from the period in which a plateau begins
    for axis, size in enumerate(tied.shape):
        first_period = np.full(chosen.size, 1)
        np.minimum.at(first_period, plateau, indices[axis] // size)
        indices[axis] -= first_period[plateau] * size
    return indices, plateau


def prominences(
    heights: Floats, offsets: tuple[tuple[int, int], ...], *, periodic: bool = False
) -> Floats:
    """Return the prominence of each local maximum (nx, ny) [m], at its first point; 0 at all other points.

    It is the height over the highest saddle on a path to a higher point, infinite if no path leads
    to a higher point. Points are flooded from the highest down; where two hills meet, the lower
    hill ends. The result equals Wolf pruning, which removes the lowest hill first.
    """
    flat = np.ascontiguousarray(heights, dtype=np.float64).ravel()
    order = np.argsort(-flat, kind="stable")[: int(np.isfinite(flat).sum())]
    steps = np.array(offsets, dtype=np.int64)
    prominence, parent = np.empty(flat.size), np.empty(flat.size, dtype=np.int64)
    lib.hs_prominences(
        *heights.shape,
        pointer(flat),
        order.size,
        pointer(order),
        len(offsets),
        pointer(steps),
        periodic,
        pointer(prominence),
        pointer(parent),
    )
    return prominence.reshape(heights.shape)


def detached_summits(height: ArrayLike) -> int:
    """Return the number of highest summits that are detached from all others, 0 if there are none.

    The heights of the `TAIL` summits below a gap are modelled as an exponential tail with the mean
    excess s; Gaussian tails decrease faster. The gap between the k-th and the next highest of such
    heights is exponential with mean s/k (Rényi), so that a gap of g or more has the probability
    exp(-k g/s). At most `HANDFUL` are reported.
    """
    heights = np.asarray(height, dtype=np.float64)
    if heights.size <= TAIL + HANDFUL:
        return 0
    tail = np.sort(np.partition(heights, heights.size - TAIL - HANDFUL - 1)[-TAIL - HANDFUL - 1 :])[
        ::-1
    ]
    for count in range(HANDFUL, 0, -1):
        gap = tail[count - 1] - tail[count]
        scale = tail[count : count + TAIL].mean() - tail[count + TAIL]
        if count * gap > -np.log(CHANCE) * scale:
            return count
    return 0
