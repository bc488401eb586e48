"""The preliminary displacement of a surface in virgin loading, the asperity that decides it, and its drift."""

from typing import TYPE_CHECKING

import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.results.analysis.recorded import (
    CHANGING_HEIGHT,
    Friction,
    Recorded,
    check_all_recorded,
    displacement_ratio,
    position_of,
    present_friction,
    shape_of,
)
from historysim.results.analysis.step_blocks import parts

if TYPE_CHECKING:
    import xarray as xr


def preliminary_displacement(history: "xr.Dataset") -> "xr.DataArray":
    """Return the preliminary displacement: the tangential displacement at which the last asperity of all slides.

    δ_t,max = max_i θ μ_i δ_i with θ = E*/(4 G*) and the approach δ_i = z_i - d, for one-way loading from
    the virgin state at the present normal load (Mindlin 1949).

    Parameters
    ----------
    history : xarray.Dataset
        A history in which all asperities that touch are recorded. The friction coefficients are those of each step.

    Returns
    -------
    xarray.DataArray
        δ_t,max [m] at each step; 0 where nothing touches.

    Raises
    ------
    InputError
        A history without some or all of the asperities, or of a version that did not record changes of friction.
    """
    import xarray as xr

    greatest, _ = capacity(history)
    return xr.DataArray(
        greatest,
        dims="step",
        coords={"time": history["time"]},
        name="preliminary_displacement",
        attrs={"units": "m", "long_name": "preliminary displacement of the surface"},
    )


def critical_asperity(history: "xr.Dataset") -> "xr.DataArray":
    """Return the asperity that is the last to slide: the one with the greatest μ_i δ_i.

    Parameters
    ----------
    history : xarray.Dataset
        As for `preliminary_displacement`.

    Returns
    -------
    xarray.DataArray
        Its label at each step; -1 where nothing touches.

    Raises
    ------
    InputError
        As for `preliminary_displacement`.
    """
    import xarray as xr

    greatest, label = capacity(history)
    return xr.DataArray(
        np.where(greatest > 0, label, -1),
        dims="step",
        coords={"time": history["time"]},
        name="critical_asperity",
        attrs={"long_name": "asperity that is the last to slide"},
    )


def drift(history: "xr.Dataset", first: int, second: int) -> float:
    """Return the change of the preliminary displacement between two steps, |δ_t,max,2 - δ_t,max,1|.

    Parameters
    ----------
    history : xarray.Dataset
        As for `preliminary_displacement`.
    first, second : int
        Positions of the steps; negative ones count from the end.

    Returns
    -------
    float
        The drift [m].

    Raises
    ------
    InputError
        A step that the history does not have, or as for `preliminary_displacement`.
    """
    first, second = (position_of(step, history) for step in (first, second))
    greatest, _ = capacity(history)
    return float(abs(greatest[second] - greatest[first]))


def capacity(history: Recorded) -> tuple[Floats, Integers]:
    """Return the greatest θ μ_i δ_i of each step, and the asperity that has it."""
    check_all_recorded(history)
    friction = present_friction(history)
    changes = friction.changes or CHANGING_HEIGHT in history
    return _changing_capacity(history, friction) if changes else _steady_capacity(history, friction.of(0))


def friction_of(history: Recorded, label: Integers) -> Floats:
    """Return the friction coefficient of one asperity at each step [1], of which there is a label each."""
    friction = present_friction(history)
    position = {int(name): place for place, name in enumerate(history["asperity"].values)}
    places = np.array([position.get(int(name), 0) for name in label])
    coefficients = np.empty(label.size)
    for rows in parts(history):
        values = np.broadcast_to(friction.of(rows), (places[rows].size, len(position)))
        coefficients[rows] = values[np.arange(len(values)), places[rows]]
    return coefficients


def _steady_capacity(history: Recorded, friction: Floats) -> tuple[Floats, Integers]:
    separation, height = history["separation"].values, history["summit_height"].values
    # no asperity is the last to slide that never touches, or where another one is as high or higher and has more
    # friction; few are left
    touching = np.flatnonzero(height > separation.min(initial=np.inf))
    order = touching[np.lexsort((-friction[touching], -height[touching]))]
    leading = np.flatnonzero(friction[order] > np.maximum.accumulate(np.append(-1.0, friction[order]))[:-1])
    order = order[leading]
    ratio = displacement_ratio(history)
    greatest = np.zeros(separation.size)
    label = np.full(separation.size, -1)
    for index in order:
        own = ratio * friction[index] * (height[index] - separation)
        label = np.where(own > greatest, history["asperity"].values[index], label)
        greatest = np.maximum(own, greatest)
    return greatest, label


def _changing_capacity(history: Recorded, friction: Friction) -> tuple[Floats, Integers]:
    separation = history["separation"].values
    greatest, label = np.zeros(separation.size), np.full(separation.size, -1)
    if not history.sizes["asperity"]:
        return greatest, label
    ratio = displacement_ratio(history)
    for rows in parts(history):
        height = shape_of(history, "summit_height", rows)
        own = ratio * friction.of(rows) * (height - separation[rows, np.newaxis])
        label[rows] = history["asperity"].values[own.argmax(axis=1)]
        greatest[rows] = np.maximum(own.max(axis=1), 0.0)
    return greatest, label
