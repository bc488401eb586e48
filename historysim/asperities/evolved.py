"""What has become of asperities beside what their tractions remember: geometry, slid distance, wear."""

from collections.abc import Mapping
from typing import Any, Self

import attrs
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

EVOLVED = "evolved."
"""What the names of its parts begin with among those of a state."""


@attrs.frozen(eq=False)
class Evolved:
    """What has become of asperities since the start: a value, never changed once made.

    Attributes
    ----------
    summit_height, summit_radius : array (asperity)
        Present ones [m].
    slid_distance : array (asperity)
        ∫|dU| while the asperity slid [m].
    worn_volume : array (asperity)
        Volume lost since the start [m³].
    waiting_volume : array (asperity)
        What of it has not yet shaped the summit [m³].
    shaped_volume : array (asperity)
        What has, since the summit was last a whole paraboloid [m³].
    given : array of bool (asperity)
        Whose friction an event has given, in place of the law.
    slid_together : float
        ∫|dU| while all asperities in contact slid [m].
    erased_memories : int
        Contacts whose memory a change of their geometry has erased.
    erased_energy : float
        Tangential elastic energy that went with it, or with what was worn [J].
    """

    summit_height: Floats
    summit_radius: Floats
    slid_distance: Floats
    worn_volume: Floats
    waiting_volume: Floats
    shaped_volume: Floats
    given: Flags
    slid_together: float = 0.0
    erased_memories: int = 0
    erased_energy: float = 0.0

    @property
    def content(self) -> dict[str, npt.NDArray[Any]]:
        """All of it, by name."""
        return {f"{EVOLVED}{name}": np.asarray(value) for name, value in attrs.asdict(self, recurse=False).items()}

    @classmethod
    def of(cls, content: Mapping[str, npt.NDArray[Any]]) -> Self | None:
        """Take what `content` told, from what may hold more; None where it does not hold it."""
        told = {name.removeprefix(EVOLVED): value for name, value in content.items() if name.startswith(EVOLVED)}
        values: dict[str, Any] = {name: value if value.ndim else value.item() for name, value in told.items()}
        return cls(**values) if told else None

    @classmethod
    def start(cls, summit_height: Floats, summit_radius: Floats) -> Self:
        """Return what has become of asperities to which nothing has happened."""
        nothing = np.zeros(summit_height.size)
        return cls(summit_height, summit_radius, nothing, nothing, nothing, nothing, nothing.astype(bool))
