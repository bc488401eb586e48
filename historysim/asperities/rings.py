"""How finely asperities are resolved in two tangential directions: what a scenario names, without what computes."""

from typing import Any

import attrs

from historysim.basics.units import is_number
from historysim.errors import InputError

MOST_RINGS = 1000  # of the library: ``HS_MOST_RINGS``


def _from_1(_: Any, field: "attrs.Attribute[int]", value: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MOST_RINGS:
        raise InputError(f"{field.name} is {value!r}; expected a whole number from 1 to {MOST_RINGS}")


def _below_1(_: Any, field: "attrs.Attribute[float]", value: float) -> None:
    if not (is_number(value) and 0 < value < 1):
        raise InputError(f"{field.name} is {value!r}; expected a number between 0 and 1, such as 1e-3")


@attrs.frozen
class Rings:
    """How finely asperities are resolved that move in two tangential directions.

    Along one line the memory is exact whatever they say. From the first turn on, asperities share rings of traction
    (theory page, `contact/README.md`, "Two tangential directions").

    Parameters
    ----------
    height_classes : int
        Classes of asperities by height, each with rings of its own: 1 is quick, 8 are within 1e-3 of μN.
    rings : int
        Rings of a class, from the edge of contact to the middle of its highest summit.
    tolerance : float
        Of the tangential load over the friction limit, and of the energy of a step, which is halved until it is
        settled.

    Raises
    ------
    InputError
        A number that is not a whole one from 1 to 1000, or a tolerance that is not between 0 and 1.
    """

    height_classes: int = attrs.field(default=8, validator=_from_1)
    rings: int = attrs.field(default=30, validator=_from_1)
    tolerance: float = attrs.field(default=1e-3, validator=_below_1)


RINGS = Rings()
