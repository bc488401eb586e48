"""Whether slip begins and ends between recorded steps, and how many substeps would show it."""

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from historysim.basics.array_types import Floats
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.measured.reduction import turning_points
from historysim.results.analysis.preliminary import capacity
from historysim.results.analysis.recorded import Recorded

if TYPE_CHECKING:
    from historysim.results.origin import Traceable

FEWEST, SHOWN = 3, 10  # steps between a reversal and sliding from which on slip is seen, and those that show it
SLIDES = 0.99  # tangential load over the friction limit from which on a contact is as good as sliding
SWING = 0.1  # part of the range of the displacement by which it turns round


def slip_note(history: "Traceable") -> str:
    """Return that slip begins and ends between recorded steps, with the substeps that show it; see `unseen_slip`."""
    # the log is opened only where there is something to say
    if not unseen_slip(history):
        return ""
    from historysim.results.origin import ask_origin

    return unseen_slip(history, ask_origin(history, lambda origin: origin.replay().substeps))


def unseen_slip(history: Recorded, substeps: int | None = None) -> str:
    """Return that a contact goes from a reversal to sliding in fewer than three recorded steps; nothing where not.

    With the substeps that it was recorded with the text says how many would show it, else how many times as many.
    """
    names = ("tangential_displacement", "total_tangential_load", "friction_limit")
    if not all(name in history for name in names):
        return ""
    moved, load, limit = (history[name].values for name in names)
    coarse = _coarse(moved, load, limit)
    if not coarse:
        return ""
    try:
        displacement, _ = capacity(history)
    except InputError:
        return ""
    # what a swing takes to slide: twice the displacement of virgin loading from the other limit on
    each = [
        (spacing, float(displacement[step]) * (1 - begins))
        for step, spacing, begins in coarse
        if displacement[step] > 0
    ]
    if not each:
        return ""
    spacing, reach = max(each, key=lambda pair: pair[0] / pair[1])
    finer = SHOWN * spacing / reach
    needed = f"{_rounded_up(finer)} times as many substeps"
    if substeps is not None:
        needed = f"substeps = {_rounded_up(finer * substeps)} (they are {substeps})"
    apart, length = quantity_text(spacing, "m", 3), quantity_text(reach, "m", 3)
    return (
        f"recorded steps are {apart} apart, from a reversal to sliding it is {length}: too few to show how "
        f"slip spreads. What shows it: {needed}"
    )


def _coarse(moved: Floats, load: Floats, limit: Floats) -> list[tuple[int, float, float]]:
    """Return, of swings that slide after few steps, where, the displacement per step, and T over the limit before."""
    if not np.ptp(moved) > 0:
        return []
    found = []
    for first, last in pairwise(turning_points(moved, SWING * float(np.ptp(moved))).tolist()):
        sense = math.copysign(1.0, moved[last] - moved[first])
        start = first + int(np.argmax(moved[first : last + 1] != moved[first])) - 1
        share = sense * load[start : last + 1] / np.where(limit[start : last + 1] > 0, limit[start : last + 1], np.inf)
        slid = int(np.argmax(share >= SLIDES))
        if limit[start] > 0 and 0 < slid <= FEWEST:
            spacing = abs(float(moved[start + slid] - moved[start])) / slid
            found.append((start + slid, spacing, max(float(share[0]), -1.0)))
    return found


def _rounded_up(number: float) -> int:
    """Return a whole number with two digits that is no less."""
    unit = 10 ** max(math.floor(math.log10(number)) - 1, 0)
    return int(math.ceil(number / unit) * unit)
