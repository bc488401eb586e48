"""The kinds of ``[surface]`` in a scenario: the keys of each, and the summits that it gives. A kind is a file here."""

import abc
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import attrs

from historysim.basics.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from historysim.asperities.yielding import YieldingLaw
    from historysim.interaction.solutions import NormalSolutions
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

SURFACES: Registry[type["SurfaceKind"]] = Registry(
    "historysim.surfaces", f"{__name__}:SurfaceKind", "kind of surface", __name__
)
"""The kinds of ``[surface]`` by their names."""


@attrs.frozen(eq=False)
class BuiltSurface:
    """What a ``[surface]`` gives."""

    summits: "Summits | None"
    """The summits that become asperities; None where a normal curve is given."""
    surface: "Surface | None" = None
    """The height map that they were found on."""
    friction: Any = None
    """Their friction coefficients, where the surface has its own."""
    notices: tuple[str, ...] = ()
    """What the user should know about how it was made."""
    interacts: bool = False
    """Whether the parts of the map press on one another, in place of its summits."""
    solutions: "NormalSolutions | None" = None
    """Those of the map, once they are there."""
    curve: tuple[Any, Any, Any] | None = None
    """A normal curve in place of summits: approaches from first touch [m], loads [N] and areas [m²] or None."""
    ball_radius: float | None = None
    """Radius of the ball that the map lies on [m]: the nominal area is then that of its contact."""
    yielding: "YieldingLaw | None" = None
    """How the summits yield."""
    passes: Any = None
    """By which the map is still to be run in."""
    find: "Callable[[Surface], Summits] | None" = None
    """Finds the summits of a map as those here were found."""


class SurfaceKind(abc.ABC):
    """A kind of ``[surface]``: an attrs class with its keys as fields, registered under its name."""

    registry: ClassVar[Registry[Any]] = SURFACES
    kind: ClassVar[str]
    also_called: ClassVar[tuple[str, ...]] = ()
    """Other words for it, which a message takes for a slip of the pen."""

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> "type[SurfaceKind]":
        """Return the class that the keys of a section belong to, where a kind has several."""
        del entry
        return cls

    @abc.abstractmethod
    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits, with the map that they were found on; paths are relative to the folder."""

    def unprepared(self) -> "SurfaceKind | None":
        """Return the same with its map as it comes, and all its summits; None where nothing prepares it."""
        return None
