"""What every kind of ``[surface]`` gives, and has to do."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import attrs

if TYPE_CHECKING:
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits


@attrs.frozen(eq=False)
class Ground:
    """What a ``[surface]`` gives.

    Attributes
    ----------
    summits : Summits
        The summits that become asperities.
    surface : Surface, optional
        The height map that they were found on.
    friction : array (summit), optional
        Their friction coefficients, where the surface has its own.
    notices : tuple of str
        What the user should know about how it was made.
    """

    summits: "Summits"
    surface: "Surface | None" = None
    friction: Any = None
    notices: tuple[str, ...] = ()


class SurfaceKind(Protocol):
    """``[surface]``: one class for each kind; a new kind is a new class in ``KINDS``."""

    def ground(self, folder: Path) -> Ground:
        """Return the summits, with the map that they were found on; paths are relative to the folder."""
