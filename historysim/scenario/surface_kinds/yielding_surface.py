"""``surface.yielding``: any summits, which yield on first loading."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from historysim.basics.fields import Number, Pressure
from historysim.basics.places import misfit
from historysim.basics.wording import nearest
from historysim.scenario.schema import given
from historysim.scenario.surface_kinds.surface_kind import BuiltSurface, SurfaceKind

if TYPE_CHECKING:
    from historysim.asperities.yielding import YieldingLaw

YIELDING_KEYS: Mapping[str, tuple[str, ...]] = {
    "kogut-etsion": ("hardness", "poissons_ratio"),
    "thornton": ("hardness", "poissons_ratio"),
    "jackson-green": ("hardness", "poissons_ratio"),
}
"""By law: the keys that it may have."""


@attrs.frozen
class YieldingSection:
    """How the summits of a surface yield on first loading; the name of a law alone is enough.

    Attributes
    ----------
    law
        ``"kogut-etsion"`` (2002), ``"jackson-green"`` (2005) or ``"thornton"`` (1997).
    hardness
        By default that of the softer material, or 2.8 times its yield stress.
    poissons_ratio
        By default that of the softer material.

    Examples
    --------
    [surface]
    kind = "random"
    shape = [256, 256]
    pixel_size = "1 µm"
    rms_height = "300 nm"
    autocorrelation_length = "20 µm"
    seed = 1
    yielding = { law = "kogut-etsion", hardness = "5.5 GPa" }
    """

    law: str
    hardness: Pressure | None = None
    poissons_ratio: Number | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it is a law."""
        if self.law not in YIELDING_KEYS:
            raise misfit(f"{self.law!r}; {nearest(self.law, YIELDING_KEYS)}", "law")
        for key in given(self):
            if key not in {"law", *YIELDING_KEYS[self.law]}:
                raise misfit(f"is no key of the law {self.law!r}; expected {', '.join(YIELDING_KEYS[self.law])}", key)
        self.yielding()

    def yielding(self) -> "YieldingLaw":
        """Return the law.

        Raises
        ------
        InputError
            Numbers that it cannot have.
        """
        from historysim.asperities.yielding import YieldingLaw

        return YieldingLaw.from_settings(given(self))


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
        return attrs.evolve(built, yielding=self.yielding.yielding())
