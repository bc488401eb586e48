"""Drift and positioning: how far the preliminary displacement, and the position, move along histories."""

import numpy as np
import xarray as xr

from historysim.asperities.positioning import disturbance_at_rest
from historysim.basics.array_types import Floats
from historysim.contact import drift as one_contact
from historysim.errors import InputError
from historysim.measured.definitions import DEFAULT, Definitions
from historysim.results import analysis
from historysim.results.analysis.recorded import check_all_recorded, displacement_ratio, present_friction, shape_of

__all__ = [
    "branch_drift",
    "cycle_drift",
    "disturbance_at_rest",
    "one_contact",
    "positioning_error",
    "run_drift",
    "seen_at_rest",
]


def __dir__() -> list[str]:
    return sorted(__all__)


STILL = 1e-9
"""Part of its range by which a channel may move and be taken to be at rest."""


def branch_drift(history: xr.Dataset, first: int, second: int) -> float:
    """Return the branch drift between two steps [m]: the backward branch less the 2 δ1 it should take, without sign.

    The surface slides forward at the first step, load or friction change to those of the second at a fixed
    displacement, and it comes back until all of it slides: asperity i then takes min(δ_i1, δ_i2) + δ_i2, and the
    surface the most of them. The states at the steps are taken as virgin ones, as in `preliminary_displacement`; where
    of load and friction one rises and the other falls, the rise comes first.

    Parameters
    ----------
    history : xarray.Dataset
        One in which all asperities that touch are recorded.
    first, second : int
        Positions of the steps; negative ones count from the end.

    Raises
    ------
    InputError
        A step that the history does not have, or as for `preliminary_displacement`.
    """
    before, after = (_displacements(history, step) for step in (first, second))
    branch = one_contact.backward_branch(before, after).max(initial=0.0)
    return float(abs(branch - 2 * before.max(initial=0.0)))


def cycle_drift(
    history: xr.Dataset, first: int = 0, second: int = -1, *, definitions: Definitions = DEFAULT
) -> xr.DataArray:
    """Return the change of the preliminary displacement between two friction loops of a history [m].

    It is that of the recorded loops, from a reversal until they slide (see `friction_loops`), and not of virgin states.

    Parameters
    ----------
    history : xarray.Dataset
        A history with two loops or more, with or without asperities.
    first, second : int
        Which loops; negative ones count from the end.
    definitions : Definitions

    Returns
    -------
    xarray.DataArray (direction)
        Of the forward and the backward branch, with its sign: positive where the second is longer.

    Raises
    ------
    InputError
        A history without these loops.
    """
    found = analysis.friction_loops(history, definitions=definitions).to_dataset()["preliminary_displacement"]
    loops = found.sizes["loop"]
    for loop in (first, second):
        if not -loops <= loop < loops:
            raise InputError(f"loop {loop}: the history has {loops} loops; expected {-loops} to {loops - 1}")
    change = found.isel(loop=second, drop=True) - found.isel(loop=first, drop=True)
    change.attrs = {"units": "m", "long_name": "change of the preliminary displacement between loops"}
    return change.rename("cycle_drift").reset_coords(drop=True)


def run_drift(first: xr.Dataset, second: xr.Dataset, step: int = -1) -> float:
    """Return the change of the preliminary displacement between two runs at one step, |δ_t,max,2 - δ_t,max,1| [m].

    Parameters
    ----------
    first, second : xarray.Dataset
        Histories in which all asperities that touch are recorded.
    step : int
        Position of the step in each of them; negative ones count from the end.

    Raises
    ------
    InputError
        A step that one of them does not have, or as for `preliminary_displacement`.
    """
    before, after = (_displacements(history, step).max(initial=0.0) for history in (first, second))
    return float(abs(after - before))


def positioning_error(history: xr.Dataset, start: int = 0, end: int = -1) -> float:
    """Return how far a there-and-back move ends from where it began [m]: U at its end less U at its start.

    There and back is what is asked for: the tangential load, or behind an instrument the displacement of the drive, is
    at the end what it was at the start. Normal load and friction may be others.

    Parameters
    ----------
    history : xarray.Dataset
    start, end : int
        Positions of the steps; negative ones count from the end.

    Raises
    ------
    InputError
        A step that the history does not have, or neither load nor drive has come back.
    """
    _check_steps(history, start, end)
    asked = [name for name in ("total_tangential_load", "drive_displacement") if name in history]
    back = {name: history[name].values[[start, end]] for name in asked}
    room = {name: STILL * float(np.abs(history[name].values).max()) for name in asked}
    if not any(abs(values[1] - values[0]) <= room[name] for name, values in back.items()):
        load = back["total_tangential_load"]
        raise InputError(
            f"the tangential load is {load[0]:.6g} N at step {start} and {load[1]:.6g} N at step {end}; expected steps "
            "between which it, or the drive, goes there and back"
        )
    displacement = history["tangential_displacement"].values
    return float(displacement[end] - displacement[start])


def seen_at_rest(history: xr.Dataset) -> xr.Dataset:
    """Return what a controller saw where the normal load changed at rest.

    At rest is a step to which the tangential load stays, or the displacement that is driven.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    xarray.Dataset (step)
        For each such step its time, and the changes since the step before of ``normal_load`` [N], ``tangential_load``
        [N] and ``tangential_displacement`` of the contact [m].
    """
    driven = "drive_displacement" if "drive_displacement" in history else "tangential_displacement"
    changed = {
        "normal_load": _changes(history["total_normal_load"].values),
        "tangential_load": _changes(history["total_tangential_load"].values),
        "tangential_displacement": _changes(history["tangential_displacement"].values),
    }
    still = (changed["tangential_load"] == 0) | (_changes(history[driven].values) == 0)
    where = np.flatnonzero(still & (changed["normal_load"] != 0))
    units = {"normal_load": "N", "tangential_load": "N", "tangential_displacement": "m"}
    return xr.Dataset(
        {
            name: (
                "step",
                values[where],
                {"units": units[name], "long_name": f"change of the {name.replace('_', ' ')}"},
            )
            for name, values in changed.items()
        },
        coords={"step": where + 1, "time": ("step", history["time"].values[where + 1], {"units": "s"})},
    )


def _changes(values: Floats) -> Floats:
    """Return changes from step to step, 0 where they are rounding."""
    found = np.diff(values)
    found[np.abs(found) <= STILL * np.abs(values).max(initial=0.0)] = 0.0
    return found


def _displacements(history: xr.Dataset, step: int) -> Floats:
    """Preliminary displacement θ μ_i δ_i of each asperity at a step [m]."""
    _check_steps(history, step)
    check_all_recorded(history.isel(step=[step]))
    friction = present_friction(history).of(step % history.sizes["step"])
    own = shape_of(history, "summit_height", step) - float(history["separation"].values[step])
    found: Floats = displacement_ratio(history) * friction * np.maximum(own, 0.0)
    return found


def _check_steps(history: xr.Dataset, *steps: int) -> None:
    count = history.sizes["step"]
    for step in steps:
        if not -count <= step < count:
            raise InputError(f"step {step}: the history has {count} steps; expected {-count} to {count - 1}")
