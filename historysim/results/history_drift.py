"""Drift and positioning: changes of the preliminary displacement and of the position along histories."""

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.body import Body
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.state import State
from historysim.basics.arguments import Floats
from historysim.contact import drift as one_contact
from historysim.errors import InputError
from historysim.measured.branches import DEFAULT, Definitions
from historysim.results.analysis.along_time import friction_loops
from historysim.results.analysis.recorded import (
    check_all_recorded,
    describe,
    sliding_reach,
)
from historysim.results.queries import query
from historysim.results.steps import resolve_step

__all__ = [
    "apparent_shift",
    "branch_drift",
    "cycle_drift",
    "disturbance_at_rest",
    "one_contact",
    "positioning_error",
    "run_drift",
]


def __dir__() -> list[str]:
    return sorted(__all__)


REST_TOLERANCE = 1e-9  # part of its range by which a channel may move and count as at rest


@query(unit="m")
def branch_drift(history: xr.Dataset, first: int | str, second: int | str) -> float:
    """Return the branch drift between two steps [m]: the backward branch minus 2 δ1, without sign.

    The surface slides forward at the first step, load or friction change to those of the second at
    a fixed displacement, and it comes back until all of it slides: asperity i then takes min(δ_i1,
    δ_i2) + δ_i2, and the surface the most of them. The states at the steps are taken as virgin
    ones, as in `preliminary_displacement`; where of load and friction one rises and the other
    falls, the rise comes first.

    Steps are positions, where negative ones count from the end, or names of states. InputError: a
    step that the history does not have, or as for `preliminary_displacement`.
    """
    first_branches, second_branches = (_displacements(history, step) for step in (first, second))
    branch = one_contact.backward_branch(first_branches, second_branches).max(initial=0.0)
    return float(abs(branch - 2 * first_branches.max(initial=0.0)))


@query(table="direction,cycle_drift")
def cycle_drift(
    history: xr.Dataset, first: int = 0, second: int = -1, *, definitions: Definitions = DEFAULT
) -> xr.DataArray:
    """Return the change of the preliminary displacement between two friction loops of a history [m].

    It is that of the recorded loops, from a reversal until they slide (see `friction_loops`), and
    not of virgin states. Along ``direction``, the forward and the backward branch, with its sign:
    positive where the second is longer.

    Loops are positions; negative ones count from the end. InputError: a history without these
    loops.
    """
    displacements = friction_loops(history, definitions=definitions).to_dataset()[
        "preliminary_displacement"
    ]
    loops = displacements.sizes["loop"]
    for loop in (first, second):
        if not -loops <= loop < loops:
            raise InputError(
                f"loop {loop}: the history has {loops} loops; expected {-loops} to {loops - 1}"
            )
    change = displacements.isel(loop=second, drop=True) - displacements.isel(loop=first, drop=True)
    change.attrs = {
        "units": "m",
        "long_name": "change of the preliminary displacement between loops",
    }
    return change.rename("cycle_drift").reset_coords(drop=True)


@query(unit="m")
def run_drift(first: xr.Dataset, second: xr.Dataset, step: int | str = -1) -> float:
    """Return the change of the preliminary displacement between two runs at one step, |δ_t,max,2 - δ_t,max,1| [m].

    The step is its position in each of them, where negative ones count from the end, or the name of
    a state. InputError: a step that one of them does not have, or as for
    `preliminary_displacement`.
    """
    first_displacement, second_displacement = (
        _displacements(history, step).max(initial=0.0) for history in (first, second)
    )
    return float(abs(second_displacement - first_displacement))


@query(unit="m")
def positioning_error(history: xr.Dataset, start: int | str = 0, end: int | str = -1) -> float:
    """Return the positioning error of a there-and-back move [m]: U at its end minus U at its start.

    At the end the tangential load, or behind an instrument the displacement of the drive, is what
    it was at the start; normal load and friction may differ. Steps are positions, where negative
    ones count from the end, or names of states.

    InputError: a step that the history does not have, or neither load nor drive has come back.
    """
    start_step, end_step = (resolve_step(step, history) for step in (start, end))
    driven = [name for name in ("total_tangential_load", "drive_displacement") if name in history]
    ends = {name: history[name].values[[start_step, end_step]] for name in driven}
    tolerance = {
        name: REST_TOLERANCE * float(np.abs(history[name].values).max()) for name in driven
    }
    if not any(abs(values[1] - values[0]) <= tolerance[name] for name, values in ends.items()):
        load = ends["total_tangential_load"]
        raise InputError(
            f"the tangential load is {load[0]:.6g} N at step {start_step} and {load[1]:.6g} N at step {end_step}; "
            "expected steps between which it, or the drive, moves there and back"
        )
    displacement = history["tangential_displacement"].values
    return float(displacement[end_step] - displacement[start_step])


@query(table="step,time")
def apparent_shift(history: xr.Dataset) -> xr.Dataset:
    """Return the changes of loads and displacement that a controller sees when the normal load changes at rest.

    At rest is a step to which the tangential load stays, or the displacement that is driven. For
    each such ``step``: its time, and the changes since the step before of ``normal_load`` [N],
    ``tangential_load`` [N] and ``tangential_displacement`` of the contact [m].
    """
    driven = "drive_displacement" if "drive_displacement" in history else "tangential_displacement"
    sources = {
        "normal_load": ("total_normal_load", "N"),
        "tangential_load": ("total_tangential_load", "N"),
        "tangential_displacement": ("tangential_displacement", "m"),
    }
    changed = {name: _changes(history[source].values) for name, (source, _) in sources.items()}
    still = (changed["tangential_load"] == 0) | (_changes(history[driven].values) == 0)
    where = np.flatnonzero(still & (changed["normal_load"] != 0))
    variables = {
        name: describe(
            "step", changed[name][where], f"change of the {name.replace('_', ' ')}", unit
        )
        for name, (_, unit) in sources.items()
    }
    time = ("step", history["time"].values[where + 1], {"units": "s"})
    return xr.Dataset(variables, {"step": where + 1, "time": time})


@attrs.frozen
class Disturbance:
    """Changes by another normal load: of the tangential load while the drive is held [N], and of its displacement [m].

    The displacement is that while the tangential load is held, of the contact and of the drive
    alike.
    """

    tangential_load: float
    tangential_displacement: float


def disturbance_at_rest(
    ensemble: Body, state: State, normal_load: float, *, instrument: Instrument = RIGID
) -> Disturbance:
    """Return the changes of load and displacement at rest for a new normal load; ``state`` is unaffected.

    A rise has no effect, since new contacts are not strained. Where the load falls, the strain of
    the lost contacts is released: a held position needs less force, a held force moves the contact
    on.

    Parameters
    ----------
    normal_load : float
        The new total [N], 0 or more.

    Raises
    ------
    FrictionLimitError
        The contact no longer holds its tangential load there.
    """
    load = state.tangential_load
    displacement = state.tangential_displacement
    drive = instrument.drive_displacement(displacement, load)
    held = ensemble.advance(
        state, normal_load=normal_load, tangential_displacement=drive, instrument=instrument
    )
    pushed = ensemble.advance(state, normal_load=normal_load, tangential_load=load)
    return Disturbance(held.tangential_load - load, pushed.tangential_displacement - displacement)


def _changes(values: Floats) -> Floats:
    """Return changes from step to step, 0 where they are rounding."""
    differences = np.diff(values)
    differences[np.abs(differences) <= REST_TOLERANCE * np.abs(values).max(initial=0.0)] = 0.0
    return differences


def _displacements(history: xr.Dataset, step: int | str) -> Floats:
    """Return the preliminary displacement θ μ_i δ_i of each asperity at a step [m]."""
    at = resolve_step(step, history)
    check_all_recorded(history.isel(step=[at]))
    return sliding_reach(history, at)
