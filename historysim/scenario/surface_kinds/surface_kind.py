"""What every kind of ``[surface]`` gives, and has to do."""

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
    "historysim.surfaces",
    "historysim.scenario.surface_kinds.surface_kind:SurfaceKind",
    "kind of surface",
    "historysim.scenario.surface_kinds",
)
"""The kinds of ``[surface]`` by their names."""


@attrs.frozen(eq=False)
class Curve:
    """A normal curve: approaches from first touch [m], loads [N] and, where they are known, contact areas [m²]."""

    approach: Any
    load: Any
    area: Any = None


@attrs.frozen(eq=False)
class BuiltSurface:
    """What a ``[surface]`` gives.

    Attributes
    ----------
    summits : Summits, optional
        The summits that become asperities; None where a normal curve is given.
    surface : Surface, optional
        The height map that they were found on.
    friction : array (summit), optional
        Their friction coefficients, where the surface has its own.
    notices : tuple of str
        What the user should know about how it was made.
    interacts : bool
        Whether the contact is that of the whole map, whose parts press on one another, and not of its summits.
    solutions : NormalSolutions, optional
        Those of the map, once they are there.
    curve : Curve, optional
        The contact itself, where it is known already.
    ball_radius : float, optional
        Radius of the ball that the map lies on [m]: the nominal area is then that of its contact.
    yielding : YieldingLaw, optional
        How the summits yield.
    passes : PassesSection of `run_in_surface`, optional
        By which the map is still to be run in.
    find : callable, optional
        Finds the summits of a map as those here were found.
    """

    summits: "Summits | None"
    surface: "Surface | None" = None
    friction: Any = None
    notices: tuple[str, ...] = ()
    interacts: bool = False
    solutions: "NormalSolutions | None" = None
    curve: Curve | None = None
    ball_radius: float | None = None
    yielding: "YieldingLaw | None" = None
    passes: Any = None
    find: "Callable[[Surface], Summits] | None" = None


class SurfaceKind(abc.ABC):
    """A kind of ``[surface]``: an attrs class, whose fields are its keys, registered under its name."""

    registry: ClassVar[Registry[Any]] = SURFACES
    kind: ClassVar[str]

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> "type[SurfaceKind]":
        """Return the class that the keys of a section belong to, where a kind has several."""
        del entry
        return cls

    @abc.abstractmethod
    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits, with the map that they were found on; paths are relative to the folder."""
