"""What a recorded history says about its contact: functions of a Dataset."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics import findings
from historysim.basics.findings import Finding
from historysim.basics.units import duration_text, quantity_text
from historysim.errors import InputError
from historysim.measured.definitions import DEFAULT, Definitions
from historysim.measured.loops import Loops
from historysim.measured.splitting import loops_of_history

Floats = npt.NDArray[np.float64]

CELLS_AT_ONCE = 1 << 20
"""Steps times asperities that are looked at together."""


def preliminary_displacement(history: xr.Dataset) -> xr.DataArray:
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
    capacity, _ = _capacity(history)
    return xr.DataArray(
        capacity,
        dims="step",
        coords={"time": history["time"]},
        name="preliminary_displacement",
        attrs={"units": "m", "long_name": "preliminary displacement of the surface"},
    )


def critical_asperity(history: xr.Dataset) -> xr.DataArray:
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
    capacity, label = _capacity(history)
    return xr.DataArray(
        np.where(capacity > 0, label, -1),
        dims="step",
        coords={"time": history["time"]},
        name="critical_asperity",
        attrs={"long_name": "asperity that is the last to slide"},
    )


def drift(history: xr.Dataset, first: int, second: int) -> float:
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
    steps = history.sizes["step"]
    for step in (first, second):
        if not -steps <= step < steps:
            raise InputError(f"step {step}: the history has {steps} steps; expected {-steps} to {steps - 1}")
    capacity, _ = _capacity(history)
    return float(abs(capacity[second] - capacity[first]))


def validity(history: xr.Dataset) -> tuple[Finding, ...]:
    """Return which assumptions of the model did not hold where the asperities were pressed most.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    tuple of Finding
        Name, value, limit and text of each; see `historysim.asperities.validity.findings`. None of a history of a
        version that did not check them.
    """
    return findings.read(history.attrs.get("validity", "[]"))


def friction_loops(
    history: xr.Dataset, *, dead_band: float | None = None, skip: int = 0, definitions: Definitions = DEFAULT
) -> Loops:
    """Return the friction loops of a history, with what each of them says.

    Those of a measured record are found in the same way: the two can be compared.
    How finely the history is recorded matters: between steps it is taken as straight (see ``substeps``).

    Parameters
    ----------
    history : xarray.Dataset
        A history, with or without asperities.
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts [m]; by default 5 % of its range.
    skip : int
        How many loops at the start are left out.
    definitions : Definitions
        What is taken for sliding, for reached, and for the beginning of a branch.

    Returns
    -------
    Loops

    Raises
    ------
    InputError
        A history without a whole loop.
    """
    return loops_of_history(history, dead_band=dead_band, skip=skip, definitions=definitions)


WORTH_TELLING = 1.05
"""Ratio of traction to friction limit from which a summary tells it."""


def summary(history: xr.Dataset) -> list[tuple[str, str]]:
    """Return in a few lines what happened.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    list of (label, text)
        Steps and duration, asperities touched, peak loads, preliminary displacement and critical asperity at
        the peak normal load, dissipated energy, steps at which the tangential load was held at the limit, and a warning
        for each assumption of the model that does not hold.
    """
    normal, tangential = history["total_normal_load"].values, history["total_tangential_load"].values
    peak = int(normal.argmax())
    time = history["time"].values
    lines = [
        ("steps", f"{time.size:,} over {duration_text(time[-1] - time[0])}"),
        ("asperities touched", _touched(history)),
        ("peak normal load", quantity_text(normal[peak], "N")),
        ("peak tangential load", quantity_text(np.abs(tangential).max(), "N")),
    ]
    try:
        displacement, asperity = preliminary_displacement(history), critical_asperity(history)
    except InputError:
        reason = "its version did not record changes of friction: run it again"
        if not is_complete(history):
            reason = "not all asperities that touch are recorded"
        lines.append(("preliminary displacement", f"not available: {reason}"))
    else:
        lines += [
            ("preliminary displacement", f"{quantity_text(displacement[peak].item(), 'm')} at the peak normal load"),
            ("critical asperity", str(asperity[peak].item()) if normal[peak] > 0 else "none"),
        ]
    lines.append(("dissipated energy", quantity_text(history["total_dissipated_energy"].values[-1], "J")))
    if held := int(history["saturated"].sum()):
        lines.append(("held at the limit", f"{held:,} steps"))
    if (
        "largest_traction_ratio" in history
        and (largest := history["largest_traction_ratio"].values.max()) > WORTH_TELLING
    ):
        lines.append(
            ("traction", f"up to {largest:.2f} μp where friction fell: the model is that far from Coulomb's law")
        )
    return [*lines, *(("warning", finding.text) for finding in validity(history))]


def is_complete(history: xr.Dataset) -> bool:
    """Return whether all asperities that touch are recorded."""
    if "summit_height" not in history or "friction" not in history:
        return False
    height = history["summit_height"].values
    most = int(history["contact_count"].max())
    if most == 0:
        return True
    # a separation that was rounded must not make an asperity at the verge of contact look left out
    room = 1e-12 * max(np.abs(height).max(initial=0.0), abs(float(history["separation"].min())))
    return int((height > float(history["separation"].min()) - room).sum()) >= most


def _touched(history: xr.Dataset) -> str:
    most = int(history["contact_count"].max())
    total = f" of {history.attrs['number_of_asperities']:,}" if "number_of_asperities" in history.attrs else ""
    if not is_complete(history):
        return f"{most:,}{total} at one time"
    touched = int((history["summit_height"].values > float(history["separation"].min())).sum())
    return f"{touched:,}{total}" + (f", {most:,} at one time" if most < touched else "")


def _capacity(history: xr.Dataset) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return the greatest θ μ_i δ_i of each step, and the asperity that has it."""
    if not is_complete(history):
        raise InputError(
            "the history does not hold all asperities that touch, so the preliminary displacement is not available; "
            'expected one recorded with record = "touching" or "all"'
        )
    if "present_friction" in history:
        return _changing_capacity(history)
    if "largest_traction_ratio" in history:
        raise InputError(
            "friction changes in the history, and the version that made it did not record how; run it again with this "
            "one"
        )
    separation = history["separation"].values
    height, friction = history["summit_height"].values, history["friction"].values
    # no asperity is the last to slide where another one is as high or higher and has more friction; few are left
    order = np.lexsort((-friction, -height))
    leading = np.flatnonzero(friction[order] > np.maximum.accumulate(np.append(-1.0, friction[order]))[:-1])
    order = order[leading]
    ratio = history.attrs["contact_modulus"] / (4 * history.attrs["shear_modulus"])
    capacity = np.zeros(separation.size)
    label = np.full(separation.size, -1)
    for index in order:
        own = ratio * friction[index] * (height[index] - separation)
        label = np.where(own > capacity, history["asperity"].values[index], label)
        capacity = np.maximum(own, capacity)
    return capacity, label


def _changing_capacity(history: xr.Dataset) -> tuple[Floats, npt.NDArray[np.int64]]:
    """`_capacity` where friction changes from step to step."""
    separation, height = history["separation"].values, history["summit_height"].values
    friction = history["present_friction"].values.reshape(separation.size, -1)
    capacity, label = np.zeros(separation.size), np.full(separation.size, -1)
    if not height.size:
        return capacity, label
    ratio = history.attrs["contact_modulus"] / (4 * history.attrs["shear_modulus"])
    at_once = max(1, CELLS_AT_ONCE // height.size)
    for first in range(0, separation.size, at_once):
        rows = slice(first, first + at_once)
        own = ratio * friction[rows] * (height - separation[rows, np.newaxis])
        label[rows] = history["asperity"].values[own.argmax(axis=1)]
        capacity[rows] = np.maximum(own.max(axis=1), 0.0)
    return capacity, label
