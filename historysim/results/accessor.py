"""Questions to a history as methods of it: ``history.contact.first_slips()``.

The accessor is there as soon as a name of historysim that gives or takes histories has been used, or this module is
imported: ``import historysim.results.accessor``.
"""

import functools
import inspect
from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeVar, cast

import xarray as xr

from historysim.errors import InputError
from historysim.results import analysis, history_drift, point_maps, rebuilt, sliding_order

OF_ONE_STEP = {
    "asperity_at",
    "critical_asperity",
    "mean_pressure",
    "nominal_pressure",
    "peak_pressure",
    "preliminary_displacement",
    "preliminary_displacements",
    "presliding_work",
    "profiles",
    "reversal_points",
    "slip_shares",
    "stick_ratio",
    "time_series",
    "total_mean_pressure",
    "validity",
}
"""Questions that one step of a history answers: ``history.isel(step=-1).contact.slip_shares()``."""

Given = ParamSpec("Given")
Answer = TypeVar("Answer")


def _is_one_step(history: xr.Dataset) -> bool:
    return "step" not in history.dims and "time" in history.coords and history["time"].ndim == 0


def _with_steps(history: xr.Dataset) -> xr.Dataset:
    """Return one step of a history as a history of one step, which comes from where it does."""
    found = history.drop_vars("time").expand_dims("step").assign_coords(time=("step", [history["time"].item()]))
    found["time"].attrs = history["time"].attrs
    found.encoding = history.encoding
    return found


def _asked(
    question: Callable[Concatenate[xr.Dataset, Given], Answer],
) -> Callable[Concatenate["Questions", Given], Answer]:
    """Return a question as a method, with the documentation of the function."""

    @functools.wraps(question)
    def method(self: "Questions", /, *args: Given.args, **kwargs: Given.kwargs) -> Answer:
        if not _is_one_step(self.history):
            return question(self.history, *args, **kwargs)
        if question.__name__ not in OF_ONE_STEP:
            raise InputError(
                f"{question.__name__}: the history has one step, which does not tell the way of the contact there; "
                "expected a history with its steps: ask that one, and choose the step of the answer"
            )
        answer = question(_with_steps(self.history), *args, **kwargs)
        # what was asked of one step has no steps, either
        chosen = (
            answer.isel(step=0) if isinstance(answer, xr.Dataset | xr.DataArray) and "step" in answer.dims else answer
        )
        return cast("Answer", chosen)

    parameters = list(inspect.signature(question).parameters.values())
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = inspect.Signature([own, *parameters[1:]])  # type: ignore[attr-defined]
    return method


@xr.register_dataset_accessor("contact")  # type: ignore[no-untyped-call]
class Questions:
    """Questions to a history; each is the function of the same name in `results`.

    Parameters
    ----------
    history : xarray.Dataset
        From `historysim.replay` or `historysim.run`, or opened with xarray.
    """

    def __init__(self, history: xr.Dataset) -> None:
        self.history = history

    asperity = _asked(rebuilt.asperity_at)
    branch_drift = _asked(history_drift.branch_drift)
    critical_asperity = _asked(analysis.critical_asperity)
    cycle_drift = _asked(history_drift.cycle_drift)
    drift = _asked(analysis.drift)
    energy_per_cycle = _asked(analysis.energy_per_cycle)
    first_slips = _asked(sliding_order.first_slips)
    friction_loops = _asked(analysis.friction_loops)
    mean_pressure = _asked(analysis.mean_pressure)
    nominal_pressure = _asked(analysis.nominal_pressure)
    peak_pressure = _asked(analysis.peak_pressure)
    point_maps = _asked(point_maps.point_maps)
    positioning_error = _asked(history_drift.positioning_error)
    preliminary_displacement = _asked(analysis.preliminary_displacement)
    preliminary_displacements = _asked(analysis.preliminary_displacements)
    presliding_work = _asked(analysis.presliding_work)
    profiles = _asked(rebuilt.profiles)
    reversal_points = _asked(rebuilt.reversal_points)
    run_drift = _asked(history_drift.run_drift)
    seen_at_rest = _asked(history_drift.seen_at_rest)
    slides_first = _asked(sliding_order.slides_first)
    slip_shares = _asked(analysis.slip_shares)
    stick_ratio = _asked(analysis.stick_ratio)
    summary = _asked(sliding_order.summary)
    tangential_stiffness = _asked(analysis.tangential_stiffness)
    telling_step = _asked(analysis.telling_step)
    time_series = _asked(analysis.time_series)
    total_mean_pressure = _asked(analysis.total_mean_pressure)
    validity = _asked(analysis.validity)
