"""Keys that any ``[surface]`` may have beside those of its kind: stretched, interacting, yielding, run in."""

from pathlib import Path

import attrs

from historysim.basics.fields import Key
from historysim.basics.places import misfit
from historysim.basics.wording import nearest, shown
from historysim.scenario.law_sections import YieldingSection
from historysim.scenario.surface_kinds.map_kinds import HeightMap
from historysim.scenario.surface_kinds.run_in_surface import PassesSection
from historysim.scenario.surface_kinds.surface_kind import BuiltSurface, SurfaceKind

INTERACTIONS = ("none", "full")


def _check_interaction(_: object, attribute: "attrs.Attribute[str | None]", value: str | None) -> None:
    if value is not None and value not in INTERACTIONS:
        raise misfit(f"{shown(value)}; {nearest(value, INTERACTIONS)}", attribute.name)


@attrs.frozen(kw_only=True)
class SurfaceKeys:
    """Keys that a surface of any kind may have.

    Attributes
    ----------
    height_scale
        Of a surface with summits: stretches their heights, and those of their map, about the mean of the summits. The
        radii of the summits stay.
    interaction
        Of a height map: with ``"full"`` its asperities press on one another, and the contact of the map is solved
        whole; ``"none"`` is the default.
    yielding
        Of a surface with summits: how they yield, as below.
    passes
        Of a height map: how it is run in, as below.
    """

    height_scale: float | None = attrs.field(
        default=None, validator=Key(lambda scale: scale > 0, "a number greater than 0")
    )
    interaction: str | None = attrs.field(default=None, validator=_check_interaction)
    yielding: YieldingSection | None = None
    passes: PassesSection | None = None


@attrs.frozen(kw_only=True)
class ChangedSurface(SurfaceKeys, SurfaceKind):
    """A surface of any kind, and the keys that change it."""

    of: SurfaceKind

    def build(self, folder: Path) -> BuiltSurface:
        """Return the surface as the keys change it, in their order; passes need materials and friction, too."""
        built = self.of.build(folder)
        if self.height_scale is not None:
            built = _stretched(built, self.height_scale)
        if self.interaction == "full":
            if built.surface is None:
                problem = "full, of a surface without a height map; expected a random, measured or sum"
                raise misfit(problem, "interaction")
            built = attrs.evolve(built, interacts=True)
        if self.yielding is not None:
            if built.interacts:
                raise misfit(
                    'given with interaction = "full", and the normal contact of a whole map is solved as elastic; '
                    "expected one of them",
                    "yielding",
                )
            if built.summits is None:
                raise misfit("given for a normal curve, which is the contact itself; expected none", "yielding")
            built = attrs.evolve(built, yielding=self.yielding.of)
        if self.passes is not None:
            # summits that are found anew would not have the radii that stay where heights are stretched
            find = self.of.found_summits if isinstance(self.of, HeightMap) and self.height_scale is None else None
            built = attrs.evolve(built, passes=self.passes, find=find)
        return built


def _stretched(built: BuiltSurface, scale: float) -> BuiltSurface:
    summits, surface = built.summits, built.surface
    if summits is None:
        raise misfit("given for a normal curve, which has no heights; expected none", "height_scale")
    mean = summits.height.mean()
    if surface is not None:
        heights = mean + scale * (surface.heights - mean)
        surface = type(surface)(heights, surface.pixel_size, surface.periodic)
    return attrs.evolve(built, summits=summits.at_heights(mean + scale * (summits.height - mean)), surface=surface)
