"""Running in: in each pass summits of a height map yield and wear, and are then detected again."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.wear import WearLaw
from historysim.asperities.yielding import YieldingLaw
from historysim.basics.arguments import Floats, Integers
from historysim.basics.fields import Force, Length, at_least
from historysim.basics.units import metres, newtons
from historysim.basics.wording import nearest
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits

VOLUMES = ("lost", "conserved")


@attrs.frozen
class Pass:
    """One pass of a flat over a map, under a load > 0 [N], and how far it slides, 0 or more [m]."""

    normal_load: Force = attrs.field(converter=newtons, validator=at_least(0.0, above=True))
    sliding_distance: Length = attrs.field(default=0.0, converter=metres, validator=at_least(0.0))


class PassRecord(NamedTuple):
    """Contact of a map with the flat before a pass."""

    normal_load: float  #: [N]
    preliminary_displacement: float  #: θμδ of the highest summit under it [m]
    contact_count: int
    real_contact_area: float  #: of the summits that touch [m²]
    rms_height: float  #: Rq of the map [m]
    summits: Summits
    touching: Integers  #: indices of those that touch
    removed_volume: float  #: that the pass has cut off [m³], whether it was lost or put back


def run_in(
    surface: Surface,
    pair: MaterialPair,
    passes: Sequence[Pass],
    *,
    friction: float,
    yielding: YieldingLaw | str | None = None,
    wear: WearLaw | None = None,
    volume: str = "lost",
    find: Callable[[Surface], Summits] | None = None,
) -> tuple[Surface, list[PassRecord]]:
    """Run in a map by passes of a flat; return the final map, and the contact with the flat before each pass.

    In each pass the summits of the map are found (by ``find``, or the 9-point rule), pressed on,
    and those that yield are flattened: within the circle of contact the map is cut down to the
    paraboloid that is left. Then the flat slides, all summits in contact wear and share the load,
    and the cap that each loses is cut off the map. Hardness does not change. A contact smaller than
    a pixel changes only the point of its summit: radii then follow from that point and its
    neighbours. The removed volume is "lost", or "conserved": it raises all other points by one
    height, as displaced material does (Pullen and Williamson 1972).

    Raises InputError: numbers out of range, another word, a map without summits, or neither
    yielding nor wear.
    """
    if volume not in VOLUMES:
        raise InputError(f"volume is {volume!r}; {nearest(str(volume), VOLUMES)}")
    if yielding is None and wear is None:
        raise InputError(
            "passes change nothing without yielding or wear; expected one of them, or both"
        )
    records = []
    for step in passes:
        summits = (find or Surface.summits)(surface)
        if not len(summits) or summits.x is None or summits.y is None:
            raise InputError(
                "the map has no summit left to press on; expected fewer passes, or less wear"
            )
        ensemble = Ensemble.from_summits(pair, summits, friction, yielding=yielding)
        state = ensemble.advance(ensemble.initial_state(), normal_load=step.normal_load)
        yielded = state.yielded
        height, radius = (
            (yielded.summit_height, yielded.summit_radius)
            if yielded
            else (summits.height, summits.radius)
        )
        depth = np.maximum(state.approach - (ensemble.highest_summit - height), 0.0)
        worn = height
        if wear is not None and step.sliding_distance > 0:
            worn = _wear_heights(ensemble, height, radius, wear, step)
        heights = _flatten_heights(
            surface, summits, height, radius=radius, contact_depth=depth, worn=worn
        )
        cut = heights < surface.heights
        pixel = surface.pixel_size[0] * surface.pixel_size[1]
        removed = float((surface.heights[cut] - heights[cut]).sum() * pixel)
        touching = np.flatnonzero(depth > 0)
        records.append(
            PassRecord(
                normal_load=step.normal_load,
                preliminary_displacement=float(pair.displacement_ratio * friction * depth.max()),
                contact_count=touching.size,
                real_contact_area=float(np.pi * (radius * depth).sum()),
                rms_height=float(np.nanstd(surface.heights)),
                summits=summits,
                touching=touching,
                removed_volume=removed,
            )
        )
        uncut = ~cut & ~surface.missing
        if volume == "conserved" and cut.any() and uncut.any():
            heights[uncut] += removed / (pixel * uncut.sum())
        surface = Surface(heights, surface.pixel_size, surface.periodic)
    return surface, records


def _flatten_heights(
    surface: Surface,
    summits: Summits,
    height: Floats,
    *,
    radius: Floats,
    contact_depth: Floats,
    worn: Floats,
) -> Floats:
    """Return the map heights after summits have yielded, to contact depths ``own``, and worn."""
    heights = surface.heights.copy()
    positions = list(zip(summits.x, summits.y, strict=True))  # type: ignore[arg-type] # those of a map have both
    for i in np.flatnonzero(height < summits.height):
        reach = np.sqrt(radius[i] * contact_depth[i])
        _cut(heights, surface, positions[i], height=height[i], radius=radius[i], reach=reach)
    for i in np.flatnonzero(worn < height):
        reach = np.sqrt(2 * radius[i] * (height[i] - worn[i]))
        _cut(heights, surface, positions[i], height=worn[i], radius=np.inf, reach=reach)
    return heights


def _cut(
    heights: Floats,
    surface: Surface,
    position: tuple[float, float],
    *,
    height: float,
    radius: float,
    reach: float,
) -> None:
    """Cut heights down to a paraboloid within a distance of its top, at least at the point of the top."""
    index, offset = [], []
    for axis in (0, 1):
        pixel, count = surface.pixel_size[axis], surface.shape[axis]
        middle, far = round(position[axis] / pixel), int(reach / pixel) + 1
        points = np.arange(middle - far, middle + far + 1)
        points = points[:count] if surface.periodic else points[(points >= 0) & (points < count)]
        index.append(points % count)
        offset.append(points * pixel - position[axis])
    square = offset[0][:, None] ** 2 + offset[1][None, :] ** 2
    inside = square <= max(reach, 0.75 * min(surface.pixel_size)) ** 2
    window = np.ix_(*index)
    heights[window] = np.where(
        inside, np.minimum(heights[window], height - square / (2 * radius)), heights[window]
    )


def _wear_heights(
    ensemble: Ensemble, height: Floats, radius: Floats, wear: WearLaw, step: Pass
) -> Floats:
    """Return the heights of summits after sliding under a load [m]."""
    friction = float(ensemble.friction[0])
    sliding = Ensemble(ensemble.pair, height, radius, friction, wear=wear)
    state = sliding.advance(sliding.initial_state(), normal_load=step.normal_load)
    state = sliding.advance(state, tangential_displacement=step.sliding_distance)
    evolved = state.evolved
    return height if evolved is None else evolved.summit_height
