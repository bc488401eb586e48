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

# The kinds of ``[surface]`` by their names.
SURFACES: Registry[type["SurfaceKind"]] = Registry(
    "historysim.surfaces", f"{__name__}:SurfaceKind", "kind of surface", __name__
)


@attrs.frozen(eq=False)
class BuiltSurface:
    """What a ``[surface]`` gives."""

    summits: "Summits | None"  #: the summits that become asperities; None where a normal curve is given
    surface: "Surface | None" = None  #: the height map that they were found on
    friction: Any = None  #: their friction coefficients, where the surface has its own
    notices: tuple[str, ...] = ()  #: what the user should know about how it was made
    interacts: bool = False  #: whether the parts of the map press on one another, in place of its summits
    solutions: "NormalSolutions | None" = None  #: those of the map, once they are there
    #: A normal curve in place of summits: approaches from first touch [m], loads [N] and areas [m²] or None.
    curve: tuple[Any, Any, Any] | None = None
    #: Radius of the ball that the map lies on [m]: the nominal area is then that of its contact.
    ball_radius: float | None = None
    yielding: "YieldingLaw | None" = None  #: how the summits yield
    passes: Any = None  #: by which the map is still to be run in
    find: "Callable[[Surface], Summits] | None" = None  #: finds the summits of a map as those here were found


class SurfaceKind(abc.ABC):
    """A kind of ``[surface]``: an attrs class with its keys as fields, registered under its name."""

    registry: ClassVar[Registry[Any]] = SURFACES
    kind: ClassVar[str]
    also_called: ClassVar[tuple[str, ...]] = ()  #: other words for it, which a message takes for a slip of the pen

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
