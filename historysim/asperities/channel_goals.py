"""Where one channel of a path goes, or of many: a load, a displacement, or held as it was controlled last."""

import math

import numpy.typing as npt

from historysim.basics.arguments import checked, workable
from historysim.basics.limits import LARGEST
from historysim.errors import InputError
from historysim.memory.binding import DISPLACED, LOAD
from historysim.memory.paths import STILL, Goals

HELD = math.nan
"""Target of a channel that is held as it was controlled last."""


def channel(
    name: str, load: float | None, displacement: float | None, control: int, least: float = -math.inf
) -> tuple[int, float]:
    """Return how one channel of a path is controlled, and its target in N or m."""
    if load is None:
        if displacement is None:
            return control, HELD
        kind, value, least = DISPLACED, displacement, -math.inf
    elif displacement is None:
        kind, value = LOAD, load
    else:
        raise InputError(f"both {name}_load and {name}_displacement are given; expected one of them")
    # comparisons with what is no number are false
    if isinstance(value, float) and least <= value <= LARGEST and value >= -LARGEST:
        return kind, value
    kind_name = "load" if kind == LOAD else "displacement"
    asked = f"{name}_{kind_name}"
    return kind, float(workable(asked, checked(asked, value, least=least)))


def goals(target: tuple[int, float]) -> Goals:
    """Return where a channel goes, of what `channel` returns."""
    return Goals(target[0], *STILL) if math.isnan(target[1]) else Goals(*target)


def goals_of(
    name: str,
    load: npt.ArrayLike | None,
    displacement: npt.ArrayLike | None,
    control: int,
    least: float = -math.inf,
) -> Goals:
    """Return where one channel of several paths goes; errors as for `channel`, or arrays of more dimensions."""
    if load is not None and displacement is not None:
        raise InputError(f"both {name}_load and {name}_displacement are given; expected one of them")
    kind, values, least = (LOAD, load, least) if load is not None else (DISPLACED, displacement, -math.inf)
    if values is None:
        return Goals(control, *STILL)
    kind_name = "load" if kind == LOAD else "displacement"
    targets = workable(f"{name}_{kind_name}", checked(f"{name}_{kind_name}", values, least=least))
    if targets.ndim > 1:
        raise InputError(f"{name}_{kind_name} has shape {targets.shape}; expected one number, or a list")
    return Goals(kind, targets)
