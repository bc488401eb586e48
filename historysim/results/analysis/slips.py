"""When each asperity first slips and first slides, and which of them does so first."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from historysim.results.analysis.recorded import (
    GROSS_SLIP,
    PARTIAL_SLIP,
    Recorded,
    check_recorded,
    present_friction,
    shape_of,
)
from historysim.results.analysis.step_blocks import parts

if TYPE_CHECKING:
    import xarray as xr

Integers = npt.NDArray[np.int64]

NEVER = -1
BEGINNINGS = {"slip": ("first slips", PARTIAL_SLIP), "slide": ("first slides", GROSS_SLIP)}


def first_slips(history: "xr.Dataset") -> "xr.Dataset":
    """Return when each asperity first slips, in part or whole, when it first slides, and its rank among the others.

    A *slip* is any, also of a thin annulus at the edge of the contact, which begins with the first tangential load; a
    contact *slides* when nothing of it sticks. What happens between two recorded steps counts at the second one:
    asperities that begin at the same step share a rank, so record more often to tell them apart (``substeps``).

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities or patches.

    Returns
    -------
    xarray.Dataset
        Along ``asperity``: ``slip_step`` and ``slide_step``, the positions of the steps, -1 for never; ``slip_time``
        and ``slide_time`` [s], NaN for never; ``slip_rank`` and ``slide_rank``, 0 for those that come first, 1 more
        for every asperity before, -1 for never.

    Raises
    ------
    InputError
        A history without asperities.
    """
    import xarray as xr

    steps = first_steps(history)
    time = history["time"].values
    found: dict[str, tuple[str, npt.NDArray[np.generic], dict[str, str]]] = {}
    for name, (label, _) in BEGINNINGS.items():
        step = steps[name]
        moment = np.where(step == NEVER, np.nan, time[step])
        found[f"{name}_step"] = ("asperity", step, {"long_name": f"step at which the asperity {label}; -1: never"})
        found[f"{name}_time"] = ("asperity", moment, {"units": "s", "long_name": f"when the asperity {label}"})
        text = f"how many asperities have begun before the asperity {label}; -1: never"
        found[f"{name}_rank"] = ("asperity", _ranks(step), {"long_name": text})
    beside = {key: value for key, value in history.coords.items() if value.dims == ("asperity",)}
    return xr.Dataset(found, beside)


def first_steps(history: Recorded) -> dict[str, Integers]:
    """Return the positions of the steps at which asperities first slip, and first slide (asperity); -1 for never.

    Raises
    ------
    InputError
        A history without asperities.
    """
    check_recorded(history, "slip_state")
    steps = {name: np.full(history.sizes["asperity"], NEVER) for name in BEGINNINGS}
    for rows in parts(history):
        states = history["slip_state"].isel(step=rows).values
        for name, (_, least) in BEGINNINGS.items():
            waiting = np.flatnonzero(steps[name] == NEVER)
            reached = states[:, waiting] >= least
            there = reached.any(axis=0)
            steps[name][waiting[there]] = rows.start + reached[:, there].argmax(axis=0)
        if (steps["slide"] != NEVER).all():
            break
    return steps


def slides_first(history: "xr.Dataset") -> Integers:
    """Return the labels of the asperities that slide, in the order in which they begin to.

    Of those that begin between the same two recorded steps, the one of the smallest μ_i δ_i at the second step stands
    before, which is the order in which they do so under one friction coefficient, or at a constant normal load.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities.

    Returns
    -------
    array (asperity that slides) of int
        Labels; the first is that of the asperity that slides first. Empty where none slides.

    Raises
    ------
    InputError
        A history without asperities, or of a version that did not record changes of friction.
    """
    return order_of_sliding(history, first_steps(history)["slide"])


def order_of_sliding(history: Recorded, step: Integers) -> Integers:
    """Return what `slides_first` does, where the steps at which asperities first slide are known (asperity)."""
    sliding = np.flatnonzero(step != NEVER)
    separation, friction = history["separation"].values, present_friction(history)
    reserve = np.empty(sliding.size)
    for moment in np.unique(step[sliding]):
        here = step[sliding] == moment
        own = np.broadcast_to(friction.of(moment), step.shape)[sliding[here]]
        height = shape_of(history, "summit_height", int(moment))
        reserve[here] = own * (height[sliding[here]] - separation[moment])
    labels: Integers = history["asperity"].values[sliding[np.lexsort((reserve, step[sliding]))]]
    return labels


def _ranks(step: Integers) -> Integers:
    """Return how many begin at an earlier step than each does; NEVER for those that do not begin."""
    began = np.sort(step[step != NEVER])
    return np.where(step == NEVER, NEVER, np.searchsorted(began, step))
