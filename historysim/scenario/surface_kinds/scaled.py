"""``surface.height_scale``: any surface, stretched in height."""

from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from historysim.basics.places import misfit
from historysim.scenario.surface_kinds.surface_kind import BuiltSurface, SurfaceKind

if TYPE_CHECKING:
    from historysim.surfaces.heights import Surface


def _positive(_: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    if not value > 0:
        raise misfit(f"{value:g}; expected a number greater than 0", attribute.name)


@attrs.frozen
class Scaled(SurfaceKind):
    """Any surface, with its heights stretched about the mean of its summits; the radii of the summits stay.

    Attributes
    ----------
    height_scale
        Stretches the heights of the summits, and of their map, about the mean of the summits; their radii stay.
    """

    of: SurfaceKind
    height_scale: float = attrs.field(validator=_positive)

    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits, and the map that they lie on."""
        built = self.of.build(folder)
        if built.summits is None:
            raise misfit("given for a normal curve, which has no heights; expected none", "height_scale")
        mean = built.summits.height.mean()
        summits = built.summits.at_heights(mean + self.height_scale * (built.summits.height - mean))
        surface = None if built.surface is None else self._stretched(built.surface, mean)
        return attrs.evolve(built, summits=summits, surface=surface)

    def _stretched(self, surface: "Surface", mean: float) -> "Surface":
        heights = mean + self.height_scale * (surface.heights - mean)
        return type(surface)(heights, surface.pixel_size, surface.periodic)
