"""Summary of a history in a few lines, and model assumptions that it violates."""

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import duration_text, quantity_text
from historysim.basics.wording import Finding, count_text, read_findings
from historysim.errors import InputError
from historysim.loads.event_sequence import time_text
from historysim.recording.recorder import FORGOTTEN
from historysim.results.analysis.preliminary import Capacity, capacity
from historysim.results.analysis.recorded import (
    CHANGING_HEIGHT,
    SLOPE,
    has_patches,
    is_complete,
    present_friction,
    sizes,
    step_blocks,
)
from historysim.results.analysis.slips import order_of_sliding, slide_times, slip_note
from historysim.results.history_view import History
from historysim.results.queries import query

if TYPE_CHECKING:
    import xarray as xr

MOST_COEFFICIENTS = 4  # friction coefficients that a summary names
NOTABLE_TRACTION_RATIO = 1.05  # ratio of traction to friction limit from which a summary has it


@query(per_step=True, table="name,value", planar=True)
def validity(history: "xr.Dataset") -> tuple[Finding, ...]:
    """Return the assumptions of the model that did not hold under the greatest loads of the asperities.

    Each has name, value, limit and text; see `historysim.asperities.validity.findings`.
    """
    return _findings(history)


def _findings(history: History) -> tuple[Finding, ...]:
    return read_findings(history.attrs.get("validity", "[]"))


@query(table="label,text", planar=True)
def summary(history: "xr.Dataset") -> list[tuple[str, str]]:
    """Return a summary of the history in a few lines.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    list of (label, text)
        Steps and duration, asperities touched, peak loads, preliminary displacement and critical
        asperity at the peak normal load, which asperity slides first and which last, dissipated
        energy, what has evolved, steps at which the tangential load was held at the limit, a
        warning for each assumption of the model that does not hold, and a note where recorded steps
        are too far apart to show how slip spreads.
    """
    return summary_lines(history)


def summary_lines(history: History) -> list[tuple[str, str]]:
    """Return the lines of `summary`, also of an open file of a result."""
    normal = history["total_normal_load"].values
    peak = int(normal.argmax())
    time = history["time"].values
    lines = [
        ("steps", f"{time.size:,} over {duration_text(time[-1] - time[0])}"),
        ("asperities touched", _contact_text(history)),
        ("peak normal load", quantity_text(normal[peak], "N")),
        ("peak tangential load", quantity_text(sizes(history, "total_tangential_load").max(), "N")),
    ]
    try:
        limit = capacity(history)
    except InputError:
        reason = (
            "the asperities are inclined"
            if SLOPE in history
            else "not all asperities that touch are recorded"
        )
        lines.append(("preliminary displacement", f"not available: {reason}"))
    else:
        lines += [
            (
                "preliminary displacement",
                _preliminary(normal, limit, changes=present_friction(history).changes),
            ),
            (
                "critical asperity",
                f"{limit.asperity[peak]}, the last to slide"
                if limit.displacement[peak]
                else "none",
            ),
        ]
    with suppress(InputError):
        lines.append(("first to slide", _first_to_slide(history)))
    lines.append(
        ("dissipated energy", quantity_text(history["total_dissipated_energy"].values[-1], "J"))
    )
    lines += [*_forgotten_lines(history.attrs), *_evolution_lines(history)]
    if held := int(history["saturated"].values.sum()):
        lines.append(("held at the limit", f"{held:,} steps"))
    if "largest_traction_ratio" in history:
        largest = history["largest_traction_ratio"].values.max()
        condition = ", if the contact were round" if has_patches(history) else ""
        far = f"up to {largest:.2f} μp where friction fell: the model is that far from Coulomb's law{condition}"
        lines += [("traction", far)] if largest > NOTABLE_TRACTION_RATIO else []
    lines += [("warning", finding.text) for finding in _findings(history)]
    note = slip_note(history)
    return [*lines, ("note", note)] if note else lines


def _preliminary(normal: Floats, limit: Capacity, *, changes: bool) -> str:
    """Return the displacement at which a virgin contact slides as a whole, for each friction coefficient."""
    touches = limit.displacement > 0
    if not touches.any():
        return "none, nothing touches"
    normal = normal[touches]
    displacement = limit.displacement[touches]
    friction = np.round(limit.friction[touches], 6) if changes else np.zeros(normal.size)
    _, indices = np.unique(friction, return_index=True)
    coefficients = friction[np.sort(indices)]
    if coefficients.size > MOST_COEFFICIENTS:
        coefficients = coefficients[[0, -1]]
    lines = []
    for coefficient in coefficients:
        of_it = np.flatnonzero(friction == coefficient)
        at = of_it[normal[of_it].argmax()]
        where = f" at μ = {coefficient:.4g}" if coefficients.size > 1 else ""
        reach = quantity_text(float(displacement[at]), "m")
        load = quantity_text(float(normal[at]), "N")
        lines.append(f"{reach}{where} under {load}")
    return f"{', '.join(lines)}, loaded from rest"


def _evolution_lines(history: History) -> list[tuple[str, str]]:
    """Return lines on slid distance, wear, yielding and forgotten reversals."""
    lines = []
    if "total_slid_distance" in history:
        lines.append(
            (
                "summed sliding distance",
                quantity_text(history["total_slid_distance"].values[-1], "m"),
            )
        )
    if "total_attraction" in history:
        peak = int(history["total_normal_load"].values.argmax())
        pull = quantity_text(float(history["total_attraction"].values[peak]), "N")
        lost = quantity_text(float(history["jump_energy"].values[-1]), "J")
        jumps = count_text(int(history["jumps"].values[-1]), "jump", "jumps")
        text = f"{pull} at the peak normal load, which is that from outside; {jumps} lost {lost}"
        lines.append(("attraction", text))
    if "worn_volume" in history:
        worn = history["worn_volume"].isel(step=-1).values
        lines.append(("worn volume", f"{worn.sum():.4g} m³ of the recorded asperities"))
    if "total_yielding_energy" in history:
        share = float(
            history["yielded_load_share"].values[int(history["total_normal_load"].values.argmax())]
        )
        text = f"{100 * share:.0f} % of the peak normal load on asperities that have yielded"
        if "yielded_depth" in history:
            depth = float(history["yielded_depth"].isel(step=-1).values.max())
            text += f", flattened by up to {quantity_text(depth, 'm', 3)}"
        energy = quantity_text(float(history["total_yielding_energy"].values[-1]), "J")
        lines.append(("yielding", f"{text}; took {energy}"))
    if "erased_memories" in history and (erased := int(history["erased_memories"].values[-1])):
        energy = quantity_text(history["erased_energy"].values[-1], "J")
        lines.append(("erased memories", f"{erased:,}, with an elastic energy of {energy}"))
    return lines


def _contact_text(history: History) -> str:
    count = int(history["contact_count"].values.max())
    total = (
        f" of {history.attrs['number_of_asperities']:,}"
        if "number_of_asperities" in history.attrs
        else ""
    )
    if not is_complete(history) or SLOPE in history:
        return f"{count:,}{total} at one time"
    separation = history["separation"].values
    if CHANGING_HEIGHT in history:
        touches = np.zeros(history.sizes["asperity"], dtype=bool)
        for rows in step_blocks(history):
            heights = history[CHANGING_HEIGHT].isel(step=rows).values
            touches |= (heights > separation[rows, np.newaxis]).any(axis=0)
    else:
        touches = history["summit_height"].values > separation.min()
    touched = int(touches.sum())
    return f"{touched:,}{total}" + (f", {count:,} at one time" if count < touched else "")


def _first_to_slide(history: History) -> str:
    times = slide_times(history)
    order = order_of_sliding(history, times)
    if not order.size:
        return "none" if is_complete(history) else "none of those recorded"
    start = np.nanmin(times)
    stop = np.nanmax(times)
    last_text = f"; asperity {order[-1]} last at {stop:.6g} s" if order.size > 1 else ""
    some = f"; {order.size:,} of {times.size:,} slide" if order.size < times.size else ""
    of_recorded = "" if is_complete(history) else " (of those recorded)"
    return f"asperity {order[0]} at {start:.6g} s{last_text}{some}{of_recorded}"


# Of the attributes that are quantities.
UNITS = {
    "contact_modulus": "Pa",
    "shear_modulus": "Pa",
    "hardness": "Pa",
    "yield_stress": "Pa",
    "work_of_adhesion": "J/m²",
    "nominal_area": "m²",
    "lateral_stiffness": "N/m",
    "parallel_stiffness": "N/m",
    "displacement_resolution": "m",
    "load_resolution": "N",
}


def readable_attributes(history: History) -> dict[str, str]:
    """Return the attributes of a history as strings, quantities with their units."""
    return {
        str(name): quantity_text(value, UNITS[name]) if name in UNITS else str(value)
        for name, value in history.attrs.items()
    }


def _forgotten_lines(attributes: Mapping[Any, Any]) -> list[tuple[str, str]]:
    """Return the line of a summary on the unknown past of a history with attributes; none without."""
    if FORGOTTEN not in attributes:
        return []
    forgotten = float(attributes[FORGOTTEN])
    when = f"forgotten at t = {time_text(forgotten)}"
    text = "still remembered at the end" if math.isnan(forgotten) else when
    return [("past", f"unknown, within bounds; {text}")]
