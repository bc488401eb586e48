"""Friction that changes with the distance slid, from a table."""

from collections.abc import Iterable
from typing import Annotated, Any

import attrs
import numpy as np

from historysim.asperities.laws.friction_law import LAWS, FrictionLaw
from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.fields import Quantity
from historysim.errors import InputError


def _numbers(given: Any, name: str = "coefficient") -> tuple[float, ...]:
    if not isinstance(given, Iterable) or isinstance(given, str):
        raise InputError(f"{given!r} is no column of a table; expected a list of numbers")
    return tuple(checked(name, list(given)).tolist())


def _lengths(given: Any) -> tuple[float, ...]:
    return _numbers(given, "distance")


@LAWS.register
@attrs.frozen
class SlidFriction(FrictionLaw):
    """Friction that changes with the distance slid by each asperity, straight between a table's rows from 0 on.

    Parameters
    ----------
    distance : sequence of float (row)
        Slid distances [m], ascending, the first 0.
    coefficient : sequence of float (row)
        μ ≥ 0 there; beyond the last row it stays.

    Raises
    ------
    InputError
        A table with fewer than two rows, or of other numbers.

    Examples
    --------
    [friction]
    law = "slid distance"
    distance = ["0 m", "1 µm"]
    coefficient = [0.2, 0.1]
    """

    distance: Annotated[tuple[float, ...], Quantity("m")] = attrs.field(converter=_lengths)
    coefficient: Annotated[tuple[float, ...], Quantity("1")] = attrs.field(converter=_numbers)

    kind = "slid distance"
    same_bits = True
    depends_on = "slid"

    def __attrs_post_init__(self) -> None:
        """Check the table."""
        rows = len(self.distance)
        if rows != len(self.coefficient) or rows < 2:
            raise InputError(
                f"SlidFriction: {rows} distances, {len(self.coefficient)} coefficients; expected as many, two or more"
            )
        if self.distance[0] != 0 or min(np.diff(self.distance)) <= 0:
            raise InputError("SlidFriction: distance does not rise from 0; expected ascending distances, the first 0")
        if min(self.coefficient) < 0:
            raise InputError(f"SlidFriction: coefficient is {min(self.coefficient):g}; expected 0 or more")

    def at_start(self, count: int) -> Floats:
        """Return the coefficients before anything has slid (asperity)."""
        return np.full(count, self.coefficient[0])

    def steepest_rise(self) -> float:
        """Return by how much friction rises with the distance slid where it rises most [1/m]."""
        return float((np.diff(self.coefficient) / np.diff(self.distance)).max())

    def core(self) -> dict[str, Any]:
        """Return the fields of ``hs_law`` that say what it is."""
        return super().core() | {
            "kind": "HS_SLID_TABLE",
            "rows": len(self.distance),
            "distance": self.distance,
            "coefficients": self.coefficient,
        }

    @property
    def text(self) -> str:
        """Say in a line what it is."""
        first, last = self.coefficient[0], self.coefficient[-1]
        return f"Coulomb from {first:g} to {last:g} over the distance slid by each asperity, from a table"
