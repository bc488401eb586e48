"""What friction loops are read off by: sliding, reached, the beginning of a branch, one load, and large enough."""

from collections.abc import Callable
from typing import Any

import attrs

from historysim.basics.arguments import scalar
from historysim.errors import InputError


def _share(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    name = f"{attribute.name} of {type(owner).__name__}"
    if not 0 < scalar(name, value) < 1:
        raise InputError(f"{name} is {value:g}; expected a share, between 0 and 1")


def _share_or_none(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    name = f"{attribute.name} of {type(owner).__name__}"
    if not 0 <= scalar(name, value) < 1:
        raise InputError(f"{name} is {value:g}; expected a share, from 0 to below 1")


def _length(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    scalar(f"{attribute.name} of {type(owner).__name__}", value, above=0)


def _one_of(*kinds: type) -> Callable[[object, "attrs.Attribute[Any]", object], None]:
    names = " or ".join(kind.__name__ for kind in kinds)

    def check(owner: object, attribute: "attrs.Attribute[Any]", value: object) -> None:
        if not isinstance(value, kinds):
            raise InputError(f"{attribute.name} of {type(owner).__name__} is {value!r}; expected {names}")

    return check


@attrs.frozen
class LastPart:
    """Sliding part of a branch: its last part, by displacement.

    Parameters
    ----------
    share : float
        Of the displacement of the branch, between 0 and 1.
    """

    share: float = attrs.field(default=0.25, validator=_share)

    def __str__(self) -> str:
        return f"the last {self.share:.3g} of the displacement of a branch"


@attrs.frozen
class Plateau:
    """Sliding part of a branch: from where the load has first come near its greatest value, on to the end.

    Parameters
    ----------
    share : float
        How much of the way from the reversal to the greatest load has been covered there, between 0 and 1.
    """

    share: float = attrs.field(default=0.95, validator=_share)

    def __str__(self) -> str:
        return f"from {self.share:.3g} of the way between the load at the reversal and the greatest load of a branch"


@attrs.frozen
class FirstLoad:
    """First part of a branch: until the load has covered a share of the way from the reversal to the friction force.

    Parameters
    ----------
    share : float
        Between 0 and 1.
    """

    share: float = attrs.field(default=0.2, validator=_share)

    def __str__(self) -> str:
        return f"until {self.share:.3g} of the way between the load at the reversal and the friction force"


@attrs.frozen
class FirstDisplacement:
    """First part of a branch: until it is a length away from the reversal.

    Parameters
    ----------
    length : float
        [m].
    """

    length: float = attrs.field(validator=_length)

    def __str__(self) -> str:
        return f"the first {self.length:.3g} m of a branch"


@attrs.frozen
class Definitions:
    """What is taken for sliding, for reached, and for the beginning of a branch.

    Parameters
    ----------
    sliding : LastPart or Plateau
        The part of a branch that the friction force is the mean of.
    reached : float
        The share of the way between the load at the reversal and the friction force that ends the preliminary
        displacement, between 0 and 1.
    initial : FirstLoad or FirstDisplacement
        The part of a branch that the stiffness is the slope of.
    load_share : float
        How much the normal load may move on a branch, over its greatest value there and beyond what it moves on most
        branches; a branch on which it moves more is left out. Loops whose loads differ by no more than this share are
        loops at one load. Between 0 and 1.
    amplitude_share : float
        Loops of less than this share of the largest amplitude are kept out of means. Between 0, with which all of them
        count, and 1.
    still_rising : float
        How much the load may rise along the sliding part of a branch that slides, over the friction force: by the
        least-squares line through it, and beyond what scatter makes of that. Where it rises more, less and less, the
        branch has not come to slide; friction that rises evenly does so up to 2.4 times this share. Between 0 and 1.
    """

    sliding: LastPart | Plateau = attrs.field(factory=LastPart, validator=_one_of(LastPart, Plateau))
    reached: float = attrs.field(default=0.95, validator=_share)
    initial: FirstLoad | FirstDisplacement = attrs.field(
        factory=FirstLoad, validator=_one_of(FirstLoad, FirstDisplacement)
    )
    load_share: float = attrs.field(default=0.1, validator=_share)
    amplitude_share: float = attrs.field(default=0.5, validator=_share_or_none)
    still_rising: float = attrs.field(default=0.05, validator=_share)


DEFAULT = Definitions()
