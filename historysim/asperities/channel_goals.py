"""Where one channel of a path goes, or of many: a load, a displacement, or held as it was controlled last."""

import math

import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.errors import InputError
from historysim.memory.binding import DISPLACED, LOAD
from historysim.memory.paths import STILL, Goals

HELD = math.nan
"""Target of a channel that is held as it was controlled last."""


def channel(
    name: str, load: float | None, displacement: float | None, control: int, least: float = -math.inf
) -> tuple[int, float]:
    """Return how one channel of a path is controlled, and its target in N or m.

    Raises
    ------
    InputError
        A value that is not finite or too small, or both a load and a displacement.
    """
    if load is None:
        if displacement is None:
            return control, HELD
        kind, value, least = DISPLACED, displacement, -math.inf
    elif displacement is None:
        kind, value = LOAD, load
    else:
        raise InputError(f"both {name}_load and {name}_displacement came; expected one of them")
    # comparisons with what is no number are false
    if isinstance(value, float) and least <= value < math.inf and value > -math.inf:
        return kind, value
    kind_name = "load" if kind == LOAD else "displacement"
    return kind, float(checked(f"{name}_{kind_name}", value, least=least))


def goals(target: tuple[int, float]) -> Goals:
    """Return where a channel goes that `channel` has told of."""
    return Goals(target[0], *STILL) if math.isnan(target[1]) else Goals(*target)


def goals_of(
    name: str,
    load: npt.ArrayLike | None,
    displacement: npt.ArrayLike | None,
    control: int,
    least: float = -math.inf,
) -> Goals:
    """Return where one channel of several paths goes.

    Raises
    ------
    InputError
        As for `channel`, or more than a list.
    """
    if load is not None and displacement is not None:
        raise InputError(f"both {name}_load and {name}_displacement came; expected one of them")
    kind, values, least = (LOAD, load, least) if load is not None else (DISPLACED, displacement, -math.inf)
    if values is None:
        return Goals(control, *STILL)
    kind_name = "load" if kind == LOAD else "displacement"
    targets = checked(f"{name}_{kind_name}", values, least=least)
    if targets.ndim > 1:
        raise InputError(f"{name}_{kind_name} has shape {targets.shape}; expected one number, or a list")
    return Goals(kind, targets)
