"""When each asperity first slips and first slides, and which of them does so first."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats, Integers
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


NEVER = -1
BEGINNINGS = {"slip": ("first slips", PARTIAL_SLIP), "slide": ("first slides", GROSS_SLIP)}


def first_slips(history: "xr.Dataset", slide_times: Floats | None = None) -> "xr.Dataset":
    """Return when each asperity first slips, in part or whole, when it first slides, and its rank among the others.

    A *slip* is any, also of a thin annulus at the edge of the contact, which begins with the first tangential load; a
    contact *slides* when nothing of it sticks. What happens between two recorded steps counts at the second one:
    asperities that begin at the same step share a rank. ``history.contact.first_slips()`` knows the instants between.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities or patches.
    slide_times : array (asperity), optional
        The instants at which asperities first slide [s], not a number for never, where they are known.

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

    steps = first_steps(history, slide_times)
    time = history["time"].values
    variables: dict[str, tuple[str, npt.NDArray[np.generic], dict[str, str]]] = {}
    for name, (label, _) in BEGINNINGS.items():
        step = steps[name]
        moment = np.where(step == NEVER, np.nan, time[step])
        known = {"instants": "recorded step"}
        if name == "slide" and slide_times is not None:
            moment, known = slide_times, {"instants": "exact"}
        variables[f"{name}_step"] = ("asperity", step, {"long_name": f"step at which the asperity {label}; -1: never"})
        variables[f"{name}_time"] = (
            "asperity",
            moment,
            {"units": "s", "long_name": f"when the asperity {label}"} | known,
        )
        text = f"how many asperities have begun before the asperity {label}; -1: never"
        variables[f"{name}_rank"] = ("asperity", _ranks(moment), {"long_name": text})
    beside = {key: value for key, value in history.coords.items() if value.dims == ("asperity",)}
    return xr.Dataset(variables, beside)


def first_steps(history: Recorded, slide_times: Floats | None = None) -> dict[str, Integers]:
    """Return the positions of the steps at which asperities first slip, and first slide (asperity); -1 for never.

    Parameters
    ----------
    history : xarray.Dataset
    slide_times : array (asperity), optional
        The instants at which they first slide [s], where they are known; the step is the first one then or later.

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
    if slide_times is not None:
        after = np.searchsorted(history["time"].values, slide_times)
        steps["slide"] = np.where(np.isnan(slide_times), NEVER, after)
    return steps


def slides_first(history: "xr.Dataset", slide_times: Floats | None = None) -> Integers:
    """Return the labels of the asperities that slide, in the order in which they begin to.

    Of those that begin between the same two recorded steps, the one of the smallest μ_i δ_i at the second step stands
    before, which is the order in which they do so under one friction coefficient, or at a constant normal load.
    ``history.contact.slides_first()`` knows the instants between.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities.
    slide_times : array (asperity), optional
        The instants at which asperities first slide [s], not a number for never, where they are known.

    Returns
    -------
    array (asperity that slides) of int
        Labels; the first is that of the asperity that slides first. Empty where none slides.

    Raises
    ------
    InputError
        A history without asperities, or of a version that did not record changes of friction.
    """
    return order_of_sliding(history, first_steps(history, slide_times)["slide"], slide_times)


def order_of_sliding(history: Recorded, step: Integers, slide_times: Floats | None) -> Integers:
    """Return what `slides_first` does, where the steps at which asperities first slide are known (asperity)."""
    labels: Integers
    sliding = np.flatnonzero(step != NEVER)
    if slide_times is not None:
        labels = history["asperity"].values[sliding[np.argsort(slide_times[sliding], kind="stable")]]
        return labels
    separation, friction = history["separation"].values, present_friction(history)
    reserve = np.empty(sliding.size)
    for moment in np.unique(step[sliding]):
        here = step[sliding] == moment
        own = np.broadcast_to(friction.of(moment), step.shape)[sliding[here]]
        height = shape_of(history, "summit_height", int(moment))
        reserve[here] = own * (height[sliding[here]] - separation[moment])
    labels = history["asperity"].values[sliding[np.lexsort((reserve, step[sliding]))]]
    return labels


def _ranks(moment: Floats) -> Integers:
    """Return how many begin before each does; NEVER for those that do not begin, whose moment is not a number."""
    never = np.isnan(moment)
    return np.where(never, NEVER, np.searchsorted(np.sort(moment[~never]), moment))
