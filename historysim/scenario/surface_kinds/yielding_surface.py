"""``surface.yielding``: any summits, which yield on first loading."""

from pathlib import Path

import attrs

from historysim.basics.places import misfit
from historysim.scenario.law_sections import YieldingSection
from historysim.scenario.surface_kinds.surface_kind import BuiltSurface, SurfaceKind


@attrs.frozen
class Yielding:
    """Any surface of summits, which yield."""

    kind: SurfaceKind
    yielding: YieldingSection

    def build(self, folder: Path) -> BuiltSurface:
        """Make the surface."""
        built = self.kind.build(folder)
        if built.interacts:
            raise misfit(
                'given with interaction = "full", and the normal contact of a whole map is solved as elastic; expected '
                "one of them",
                "yielding",
            )
        if built.summits is None:
            raise misfit("given for a normal curve, which is the contact itself; expected none", "yielding")
        return attrs.evolve(built, yielding=self.yielding.of)
