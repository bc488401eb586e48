"""Checks that a history holds the variables of a query, and its reading in blocks of steps."""

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from historysim.basics.arguments import DIRECTION, Floats
from historysim.basics.wording import brief
from historysim.errors import InputError
from historysim.results.history_view import History

SEPARATED, FULL_STICK, PARTIAL_SLIP, GROSS_SLIP = range(4)  # flag values of slip_state
LINE = "line_length"  # attribute of the history of a line contact
STATES = ("full_stick", "partial_slip", "gross_slip")  # those of asperities in contact, from 1 on


def describe(dims: Any, values: Any, text: str, unit: str = "") -> tuple[Any, Any, dict[str, Any]]:
    """Return a variable of a result, with long name and unit."""
    return dims, values, {**({"units": unit} if unit else {}), "long_name": text}


def has_patches(history: History) -> bool:
    """Return whether the recorded asperities are patches, of normal curves or of full interaction."""
    return (
        bool(history.sizes.get("asperity"))
        and not {"summit_radius", "contact_radius"} & history.variables.keys()
    )


def check_recorded(history: History, *names: str) -> None:
    """Check that a history holds variables of its asperities; InputError with the reason otherwise."""
    if not hasattr(history, "sizes"):
        raise InputError(
            f"{brief(history)} is not a history; expected a Dataset from historysim, as hs.open gives"
        )
    if "total_normal_load" not in history:
        raise InputError(
            "this Dataset is not a history; expected one from historysim, with all its variables"
        )
    missing = [name for name in names if name not in history]
    if not missing:
        return
    if LINE in history.attrs:
        raise InputError(
            f"the history is of a line contact, which has no {missing[0]}; expected one of asperities, each with a "
            "radius"
        )
    if has_patches(history):
        raise InputError(
            f"the history is of patches of an interacting contact, which have no {missing[0]}; expected one of "
            "asperities, each with a radius"
        )
    raise InputError(
        f'the history has no {missing[0]}; expected one recorded with asperities (record = "touching", "all" or a '
        "list), not of totals alone"
    )


def check_any(history: History) -> None:
    """Check that there is an asperity to show; InputError if none ever touches."""
    if not history.sizes.get("asperity"):
        raise InputError(
            'no asperity ever touches, so there is none to show; press harder, or record = "all"'
        )


def check_all_recorded(history: History) -> None:
    """Check that all asperities that touch are recorded, and level; InputError otherwise."""
    if SLOPE in history:
        raise InputError(
            "the asperities are inclined, of which no closed form says when the last one slides; expected level ones, "
            "or see slide_time of the history"
        )
    if not is_complete(history):
        raise InputError(
            "the history does not hold all asperities that touch, so the preliminary displacement is not available; "
            'expected one recorded with record = "touching" or "all"'
        )


def is_complete(history: History) -> bool:
    """Return whether all asperities that touch are recorded."""
    if SLOPE in history:
        count = history["contact_count"].values
        states = (
            (rows, history["slip_state"].isel(step=rows).values) for rows in step_blocks(history)
        )
        return all(
            ((state != SEPARATED).sum(axis=1) == count[rows]).all() for rows, state in states
        )
    if "summit_height" not in history or "friction" not in history:
        return False
    largest_count = int(history["contact_count"].values.max())
    if largest_count == 0:
        return True
    # a separation that was rounded must not make an asperity at the verge of contact look left out
    scale = np.abs(history["summit_height"].values).max(initial=0.0)
    separation = history["separation"].values
    rounding = max(1e-12, 4 * float(np.finfo(separation.dtype).eps))
    if CHANGING_HEIGHT in history:
        room = max(1e-9, rounding) * max(scale, np.abs(separation).max())
        count = history["contact_count"].values
        lowest = separation[:, np.newaxis] - room
        heights = (
            (rows, history[CHANGING_HEIGHT].isel(step=rows).values) for rows in step_blocks(history)
        )
        return all(
            ((height > lowest[rows]).sum(axis=1) >= count[rows]).all() for rows, height in heights
        )
    room = rounding * max(scale, abs(float(separation.min())))
    return (
        int((history["summit_height"].values > float(separation.min()) - room).sum())
        >= largest_count
    )


SLOPE = "slope"  # coordinate of a history of inclined asperities
# variable of a history in which the geometry of asperities changes
CHANGING_HEIGHT = "present_summit_height"


def shape_in_step(history: History, name: str, steps: object) -> Floats:
    """Return ``summit_height`` or ``summit_radius`` [m] at a step (asperity), or where they change at steps, too."""
    changing = f"present_{name}"
    values: Floats = (
        history[changing].isel(step=steps) if changing in history else history[name]
    ).values
    return values


def sizes(history: History, name: str, steps: object = ...) -> Floats:
    """Return the sizes of a load or displacement at steps, of numbers or of vectors in two directions."""
    variable = history[name]
    values = (variable if steps is ... else variable.isel(step=steps)).values
    size: Floats = np.linalg.norm(values, axis=-1) if DIRECTION in variable.dims else np.abs(values)
    return size


def find_column(asperity: int, history: History) -> int:
    """Return the position of an asperity among the recorded ones; InputError if it is not recorded."""
    matches = np.flatnonzero(history["asperity"].values == asperity)
    if isinstance(asperity, bool) or matches.size != 1:
        labels = history["asperity"].values
        expected = (
            f"one of {', '.join(map(str, labels))}"
            if labels.size <= 8
            else f"one of the {labels.size:,} recorded"
        )
        raise InputError(
            f"asperity {asperity}: is not recorded in the history; expected {expected}"
        )
    return int(matches[0])


def displacement_ratio(history: History) -> float:
    """Return θ = E*/(4 G*) of the pair of a history; 1 of a line contact."""
    if LINE in history.attrs:
        return 1.0  # plane strain
    return float(history.attrs["contact_modulus"] / (4 * history.attrs["shear_modulus"]))


@attrs.frozen
class Friction:
    """The friction coefficients of a history, also where they change."""

    changes: bool  #: whether they change from step to step
    source: Any  #: variable along ``asperity``, ``step`` or both

    def at(self, steps: object) -> Floats:
        """Return the friction of a step (asperity) or of steps (step, asperity); size 1 if all are equal."""
        coefficients: Floats = (
            self.source.isel(step=steps) if self.changes else self.source
        ).values
        return coefficients[..., np.newaxis] if self.source.dims == ("step",) else coefficients


def present_friction(history: History) -> Friction:
    """Return the friction coefficients of the recorded asperities at each step."""
    if "present_friction" in history:
        return Friction(changes=True, source=history["present_friction"])
    return Friction(changes=False, source=history["friction"])


def sliding_reach(history: History, step: int) -> Floats:
    """Return the preliminary displacement θ μ_i δ_i of each asperity at a step [m], 0 where it does not touch."""
    approach = shape_in_step(history, "summit_height", step) - float(
        history["separation"].values[step]
    )
    return (
        displacement_ratio(history) * present_friction(history).at(step) * np.maximum(approach, 0.0)
    )


CELLS_AT_ONCE = 1 << 19  # steps times asperities of one variable that are held in memory at a time


def step_blocks(history: History, asperities: int | None = None) -> Iterator[slice]:
    """Yield the steps of a history in blocks, so that memory holds a variable of all asperities, or of some."""
    steps = history.sizes["step"]
    block_size = max(1, CELLS_AT_ONCE // max(asperities or history.sizes.get("asperity", 1), 1))
    for start in range(0, steps, block_size):
        yield slice(start, min(start + block_size, steps))
