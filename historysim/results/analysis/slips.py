"""Onset of slip and sliding of each asperity, their order, and slipping fractions at each step."""

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.measured.reduction import turning_points
from historysim.results.analysis.preliminary import capacity
from historysim.results.analysis.recorded import (
    PARTIAL_SLIP,
    STATES,
    check_recorded,
    describe,
    sizes,
    step_blocks,
)
from historysim.results.history_view import History
from historysim.results.queries import query

if TYPE_CHECKING:
    import xarray as xr

NEVER = -1
BEGINNINGS = {"slip": "first slips", "slide": "first slides"}
SHARES = {
    "share_of_contacts": "share of the contacts in each slip state",
    "share_of_area": "share of the contact area that asperities in each slip state have",
    "share_of_normal_load": "share of the normal load that asperities in each slip state carry",
    "share_of_tangential_load": "share of the tangential load that asperities in each slip state carry",
}


@query(table="asperity,summit_height", planar=True, earlier="first_slips")
def slip_onset(history: "xr.Dataset") -> "xr.Dataset":
    """Return the times of the first slip and of the first sliding of each asperity, and its rank among the others.

    A *slip* includes that of a thin annulus at the edge of the contact, which begins with the first
    tangential load; slip between two recorded steps counts at the second one. A contact *slides*
    when no part of it sticks: the instant is exact, also between steps, and if the contact is lost
    before the next step.

    Along ``asperity``: ``slip_step`` and ``slide_step``, the positions of the first steps at or
    after that, -1 for never; ``slip_time`` and ``slide_time`` [s], NaN for never; ``slip_rank`` and
    ``slide_rank``, 0 for the first, 1 more for every asperity before, -1 for never. InputError: a
    history without asperities.
    """
    import xarray as xr

    time = history["time"].values
    moments = {"slide": slide_times(history), "slip": _first_rows(history)}
    if (moments["slide"] < time[0]).any():
        raise InputError(
            f"asperities slid before the first step of the history, at {time[0]:.6g} s, and their first slips are not "
            "known; expected the history from its beginning: query it as a whole, and select from the result"
        )
    variables = {}
    for name, label in BEGINNINGS.items():
        moment = moments[name]
        step = np.where(np.isnan(moment), NEVER, np.searchsorted(time, moment))
        variables[f"{name}_step"] = describe(
            "asperity", step, f"step at which the asperity {label}; -1: never"
        )
        variables[f"{name}_time"] = describe("asperity", moment, f"when the asperity {label}", "s")
        text = f"how many asperities have begun before the asperity {label}; -1: never"
        variables[f"{name}_rank"] = describe("asperity", _ranks(moment), text)
    coordinates = {
        key: value for key, value in history.coords.items() if value.dims == ("asperity",)
    }
    return xr.Dataset(variables, coordinates)


def slide_times(history: History) -> Floats:
    """Return the times at which asperities first slide, up to the last step (asperity) [s]; NaN for never."""
    check_recorded(history, "slip_state", "slide_time")
    times = history["slide_time"].values
    end_time = history["time"].values[-1]
    return np.where(times <= end_time, times, np.nan)


@query(table="rank,asperity", planar=True)
def slides_first(history: "xr.Dataset") -> Integers:
    """Return the labels of the asperities that slide, in the order in which they begin to slide.

    Empty if none slides. InputError: as for `slip_onset`.
    """
    return order_of_sliding(history, slide_times(history))


def order_of_sliding(history: History, times: Floats) -> Integers:
    """Return the labels of asperities in the order of their instants (asperity) [s]."""
    sliding = np.flatnonzero(~np.isnan(times))
    labels: Integers = history["asperity"].values[sliding]
    # simultaneous ones in the order of their labels, not of storage
    return labels[np.lexsort((labels, times[sliding]))]


def _first_rows(history: History) -> Floats:
    """Return the times of the steps at which asperities first slip (asperity) [s]; NaN for never."""
    onset_rows = np.full(history.sizes["asperity"], np.nan)
    for rows in step_blocks(history):
        # only asperities that have not slipped yet matter
        waiting = np.flatnonzero(np.isnan(onset_rows))
        if not waiting.size:
            break
        slips = history["slip_state"].isel(step=rows).values[:, waiting] >= PARTIAL_SLIP
        any_slip = slips.any(axis=0)
        onset_rows[waiting[any_slip]] = history["time"].values[rows][
            slips[:, any_slip].argmax(axis=0)
        ]
    return onset_rows


def _ranks(moment: Floats) -> Integers:
    """Return the number of earlier instants for each; NEVER for an instant of NaN."""
    never = np.isnan(moment)
    return np.where(never, NEVER, np.searchsorted(np.sort(moment[~never]), moment))


@query(per_step=True, table="time,share_of_contacts", planar=True)
def slip_shares(history: "xr.Dataset") -> "xr.Dataset":
    """Return the fractions of contacts, area and load in each slip state, and the fraction of the area that slips.

    Along ``step`` and ``slip_state`` (full_stick, partial_slip, gross_slip), each row with a sum of
    1, or of 0 where nothing touches: ``share_of_contacts``, ``share_of_area``,
    ``share_of_normal_load`` and ``share_of_tangential_load``, the last by magnitude. Along ``step``
    alone: ``slipping_area``, the fraction of the contact area outside the stick radii, also inside
    contacts in partial slip. Where only some asperities are recorded, the fractions are of those.
    InputError: no asperities, or patches without areas.
    """
    import xarray as xr

    patches = "contact_area" in history
    names = (
        "slip_state",
        "contact_area" if patches else "contact_radius",
        "normal_load",
        "tangential_load",
    )
    slipping = slipping_area(history)
    check_recorded(history, *names)
    steps = history.sizes["step"]
    shares = np.zeros((len(SHARES), steps, len(STATES)))
    for rows in step_blocks(history):
        state, area, normal = (history[name].isel(step=rows).values for name in names[:-1])
        if not patches:
            # π cancels in a fraction
            area = area**2
        for number, weight in enumerate((state > 0, area, normal, sizes(history, names[-1], rows))):
            by_state = np.stack(
                [np.where(state == value, weight, 0.0).sum(axis=1) for value in (1, 2, 3)], axis=1
            )
            total = by_state.sum(axis=1, keepdims=True)
            np.divide(by_state, total, out=shares[number, rows], where=total > 0)
    variables = {
        name: describe(("step", "slip_state"), values, text, "1")
        for (name, text), values in zip(SHARES.items(), shares, strict=True)
    }
    text = "share of the contact area outside the stick radii"
    variables["slipping_area"] = describe("step", slipping, text, "1")
    return xr.Dataset(variables, {"time": history["time"], "slip_state": list(STATES)})


def slipping_area(history: History) -> Floats:
    """Return the fraction of the contact area outside the stick radii (step), as in `slip_shares`."""
    patches = "contact_area" in history
    names = ("contact_area", "stick_area") if patches else ("contact_radius", "stick_radius")
    check_recorded(history, "slip_state", *names)
    slipping = np.zeros(history.sizes["step"])
    for rows in step_blocks(history):
        area, stick = (history[name].isel(step=rows).values for name in names)
        if not patches:
            # π cancels in a fraction
            area = area**2
            stick = stick**2
        total = area.sum(axis=1)
        np.divide(total - stick.sum(axis=1), total, out=slipping[rows], where=total > 0)
    return slipping


@query(planar=True)
def representative_step(history: "xr.Dataset") -> int:
    """Return the first step at which the slipping fraction of the contact area is nearest to half, for a picture.

    Without partial slip it is the step of the greatest normal load. InputError: as for
    `slip_shares`.
    """
    slipping = slipping_area(history)
    if ((slipping > 0) & (slipping < 1)).any():
        return int(np.abs(slipping - 0.5).argmin())
    return int(history["total_normal_load"].values.argmax())


# least steps between a reversal and sliding that reveal slip, and enough to show it
FEWEST, SHOWN = 3, 10
SLIDES = 0.99  # tangential load over the friction limit of a contact that nearly slides
SWING = 0.1  # fraction of the displacement range that counts as a reversal


def slip_note(history: History) -> str:
    """Warn that a contact moves from a reversal to sliding within three recorded steps; empty otherwise."""
    names = ("tangential_displacement", "total_tangential_load", "friction_limit")
    if not all(name in history for name in names) or history[names[0]].ndim > 1:
        # a path in the plane has no reversals
        return ""
    coarse = _coarse(*(history[name].values for name in names))
    try:
        displacement = capacity(history).displacement if coarse else np.zeros(0)
    except InputError:
        return ""
    # displacement of a swing until sliding: twice that of virgin loading if it starts from the
    # other limit
    swings = [
        (spacing, float(displacement[step]) * (1 - begins)) for step, spacing, begins in coarse
    ]
    swings = [(spacing, reach) for spacing, reach in swings if reach > 0]
    if not swings:
        return ""
    spacing, reach = max(swings, key=lambda pair: pair[0] / pair[1])
    apart = quantity_text(spacing, "m", 3)
    length = quantity_text(reach, "m", 3)
    return (
        f"recorded steps are {apart} apart, from a reversal to sliding it is {length}: too few to show how "
        f"slip spreads. What shows it: {math.ceil(SHOWN * spacing / reach)} times as many substeps"
    )


def _coarse(moved: Floats, load: Floats, limit: Floats) -> list[tuple[int, float, float]]:
    """Return step, displacement per step and initial T over the limit of swings that slide after few steps."""
    if not np.ptp(moved) > 0:
        return []
    points = []
    for begin_row, stop in pairwise(turning_points(moved, SWING * float(np.ptp(moved))).tolist()):
        sense = math.copysign(1.0, moved[stop] - moved[begin_row])
        start = begin_row + int(np.argmax(moved[begin_row : stop + 1] != moved[begin_row])) - 1
        share = (
            sense
            * load[start : stop + 1]
            / np.where(limit[start : stop + 1] > 0, limit[start : stop + 1], np.inf)
        )
        slid = int(np.argmax(share >= SLIDES))
        if limit[start] > 0 and 0 < slid <= FEWEST:
            spacing = abs(float(moved[start + slid] - moved[start])) / slid
            points.append((start + slid, spacing, max(float(share[0]), -1.0)))
    return points
