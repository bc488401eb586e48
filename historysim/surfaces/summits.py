"""Summits: the peaks of a height map that become asperities, and what they have in common with other surfaces."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.contact.hertz import checked
from historysim.errors import InputError

Floats = npt.NDArray[np.float64]


def _row(name: str, values: npt.ArrayLike, count: int | None = None, *, above: float = -np.inf) -> Floats:
    array = np.atleast_1d(checked(name, values, above=above))
    if array.ndim > 1:
        raise InputError(f"{name} has shape {array.shape}; expected a list with one value per summit")
    if count is not None and array.size not in {1, count}:
        raise InputError(f"{name} has {array.size} values for {count} summits; expected one, or one per summit")
    array = np.array(array if count is None else np.broadcast_to(array, count))
    array.flags.writeable = False
    return array


@attrs.frozen(eq=False, init=False)
class Summits:
    """Summits of a surface, in a fixed order; there may be none.

    Parameters
    ----------
    height : array_like (summit)
        Height z over the datum of the surface [m].
    radius : array_like (summit)
        Radius R of the sphere that touches the summit [m], > 0; one number stands for all.
    x, y : array_like (summit), optional
        Position [m].
    nominal_area : float, optional
        Area of the surface that they were found on [m²], > 0; None where it is not known or it is a profile.

    Raises
    ------
    InputError
        A number that is not finite or out of range, or arrays of different lengths.
    """

    height: Floats
    radius: Floats
    x: Floats | None
    y: Floats | None
    nominal_area: float | None

    def __init__(
        self,
        height: npt.ArrayLike,
        radius: npt.ArrayLike,
        x: npt.ArrayLike | None = None,
        y: npt.ArrayLike | None = None,
        *,
        nominal_area: float | None = None,
    ) -> None:
        heights = _row("height", height)
        self.__attrs_init__(
            height=heights,
            radius=_row("radius", radius, heights.size, above=0),
            x=None if x is None else _row("x", x, heights.size),
            y=None if y is None else _row("y", y, heights.size),
            nominal_area=None if nominal_area is None else float(checked("nominal_area", nominal_area, above=0)),
        )

    def __len__(self) -> int:
        """Return the number of summits."""
        return self.height.size

    @property
    def density(self) -> float | None:
        """Summits per nominal area [1/m²], or None where the area is not known."""
        return None if self.nominal_area is None else len(self) / self.nominal_area
