"""``surface.interaction``: any height map, whose asperities press on one another."""

from pathlib import Path

import attrs

from historysim.basics.places import misfit
from historysim.basics.wording import nearest, shown
from historysim.scenario.surface_kinds.surface_kind import BuiltSurface, SurfaceKind

INTERACTIONS = ("none", "full")


def _known(_: object, attribute: "attrs.Attribute[str]", value: object) -> None:
    if not isinstance(value, str) or value not in INTERACTIONS:
        raise misfit(f"{shown(value)}; {nearest(str(value), INTERACTIONS)}", attribute.name)


@attrs.frozen
class Interacting(SurfaceKind):
    """Any surface with a height map, and whether its asperities press on one another.

    Attributes
    ----------
    interaction
        ``"full"``: the contact of a map is solved whole.
    """

    of: SurfaceKind
    interaction: str = attrs.field(validator=_known)

    def build(self, folder: Path) -> BuiltSurface:
        """Make the surface."""
        built = self.of.build(folder)
        if self.interaction == "none":
            return built
        if built.surface is None:
            raise misfit("full, of a surface without a height map; expected a random, measured or sum", "interaction")
        return attrs.evolve(built, interacts=True)
