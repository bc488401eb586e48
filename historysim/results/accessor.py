"""Queries of a history as its methods: ``history.contact.slip_onset()``.

The accessor exists once a name of historysim that returns or accepts histories has been used; see
`historysim.results.register_accessor`.
"""

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

import numpy as np
import xarray as xr

from historysim.basics.wording import Finding, join_words, nearest
from historysim.errors import InputError
from historysim.results.queries import Query, all_queries, earlier_names

if TYPE_CHECKING:
    from historysim.results import history_drift, recompute
    from historysim.results.analysis import (
        along_time,
        cycle_counting,
        history_summary,
        peak_stresses,
        per_asperity,
        preliminary,
        separation_load,
        slips,
    )

    P = ParamSpec("P")
    R = TypeVar("R")

    def _type(
        function: Callable[Concatenate[Any, P], R],
    ) -> "Callable[Concatenate[Queries, P], R]": ...


def _method(query: Query) -> Callable[..., Any]:
    """Return a query as a method, with the documentation of the function."""

    @functools.wraps(query.function)
    def method(self: "Queries", /, *args: Any, **kwargs: Any) -> Any:
        return query.function(self.history, *args, **kwargs)

    parameters = list(inspect.signature(query.function).parameters.values())
    self_parameter = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = inspect.Signature([self_parameter, *parameters[1:]])  # type: ignore[attr-defined] # a function has one
    return method


class Queries:
    """Queries of a history; each is the function of the same name in `hs.analysis`.

    Parameters
    ----------
    history : xarray.Dataset
        From `historysim.replay` or `historysim.run`, or opened with xarray.
    """

    if TYPE_CHECKING:
        # the types of the methods that are set below
        apparent_shift = _type(history_drift.apparent_shift)
        asperity = _type(recompute.asperity)
        branch_displacements = _type(preliminary.branch_displacements)
        branch_drift = _type(history_drift.branch_drift)
        critical_asperity = _type(preliminary.critical_asperity)
        cycle_drift = _type(history_drift.cycle_drift)
        cycles = _type(cycle_counting.cycles)
        dissipated_power = _type(per_asperity.dissipated_power)
        drift = _type(preliminary.drift)
        energy_per_cycle = _type(along_time.energy_per_cycle)
        friction_loops = _type(along_time.friction_loops)
        load_curve = _type(recompute.load_curve)
        mean_pressure = _type(per_asperity.mean_pressure)
        nominal_pressure = _type(per_asperity.nominal_pressure)
        peak_pressure = _type(per_asperity.peak_pressure)
        peak_stress = _type(peak_stresses.peak_stress)
        point_maps = _type(recompute.point_maps)
        positioning_error = _type(history_drift.positioning_error)
        preliminary_displacement = _type(preliminary.preliminary_displacement)
        presliding_work = _type(preliminary.presliding_work)
        profiles = _type(recompute.profiles)
        pull_off = _type(separation_load.pull_off)
        representative_step = _type(slips.representative_step)
        reversal_points = _type(recompute.reversal_points)
        run_drift = _type(history_drift.run_drift)
        slides_first = _type(slips.slides_first)
        slip_onset = _type(slips.slip_onset)
        slip_shares = _type(slips.slip_shares)
        slope_load = _type(per_asperity.slope_load)
        stick_ratio = _type(per_asperity.stick_ratio)
        summary = _type(history_summary.summary)
        tangential_stiffness = _type(per_asperity.tangential_stiffness)
        time_series = _type(along_time.time_series)
        total_mean_pressure = _type(per_asperity.total_mean_pressure)
        validity = _type(history_summary.validity)

    def __init__(self, history: xr.Dataset) -> None:
        self.history = history

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return a query that was declared after this class, as in a script."""
        if name not in (queries := all_queries()):
            raise AttributeError(
                f"{type(self).__name__} has no query {name}; {nearest(name, queries)}"
            )
        return functools.partial(queries[name].function, self.history)


for _name, _query in all_queries().items():
    setattr(Queries, _name, _method(_query))
for _earlier, _name in earlier_names().items():
    setattr(Queries, _earlier, getattr(Queries, _name))


def evaluate_query(history: xr.Dataset, name: str, arguments: Mapping[str, Any]) -> xr.Dataset:
    """Return the result of a query, with arguments by name, as a table.

    Raises
    ------
    InputError
        An argument that the query does not accept, a missing one, or an error of the query itself.
    """
    selected_query = all_queries()[name]
    parameters = selected_query.parameters
    cli_name = name.replace("_", "-")
    for option in arguments:
        if option not in parameters:
            fix = nearest(option, parameters) if parameters else "it has none"
            raise InputError(f"{cli_name}: has no parameter {option!r}; {fix}")
    needed = [
        option
        for option, parameter in parameters.items()
        if parameter.default is inspect.Parameter.empty
    ]
    if missing := [option for option in needed if option not in arguments]:
        raise InputError(
            f"{cli_name}: needs {join_words(missing)}; expected --with {missing[0]}=VALUE"
        )
    result = getattr(Queries(history), name)(**arguments)
    return result if isinstance(result, xr.Dataset) else _table(selected_query, result)


def _table(selected_query: Query, result: Any) -> xr.Dataset:
    if isinstance(result, xr.DataArray):
        return result.to_dataset(name=selected_query.name)
    if hasattr(result, "to_dataset"):
        table: xr.Dataset = result.to_dataset()
        return table
    if isinstance(result, int | float | np.number):
        attributes = {"units": selected_query.unit} if selected_query.unit else {}
        return xr.Dataset({selected_query.name: ("row", [result], attributes)})
    if isinstance(result, tuple | list) and all(isinstance(item, Finding) for item in result):
        fields = ("name", "value", "limit", "text")
        return xr.Dataset(
            {field: ("row", [getattr(item, field) for item in result]) for field in fields}
        )
    if isinstance(result, list):
        labels, texts = ([str(line[column]) for line in result] for column in range(2))
        return xr.Dataset({"label": ("row", labels), "text": ("row", texts)})
    order = np.asarray(result)
    return xr.Dataset({"rank": ("row", np.arange(1, order.size + 1)), "asperity": ("row", order)})
