"""Questions to a history as methods of it: ``history.contact.slip_onset()``.

The accessor exists as soon as a name of historysim that returns or takes histories has been used.
"""

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from historysim.basics.wording import Finding, listed, nearest
from historysim.errors import InputError
from historysim.results.asking import Question, earlier_names, questions


def _method(query: Question) -> Callable[..., Any]:
    """Return a question as a method, with the documentation of the function."""

    @functools.wraps(query.function)
    def method(self: "Questions", /, *args: Any, **kwargs: Any) -> Any:
        return query.function(self.history, *args, **kwargs)

    parameters = list(inspect.signature(query.function).parameters.values())
    self_parameter = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = inspect.Signature([self_parameter, *parameters[1:]])  # type: ignore[attr-defined] # a function has one
    return method


@xr.register_dataset_accessor("contact")  # type: ignore[no-untyped-call] # xarray gives no types
class Questions:
    """Questions to a history; each is the function of the same name in `hs.analysis`.

    Parameters
    ----------
    history : xarray.Dataset
        From `historysim.replay` or `historysim.run`, or opened with xarray.
    """

    def __init__(self, history: xr.Dataset) -> None:
        self.history = history


for _name, _question in questions().items():
    setattr(Questions, _name, _method(_question))
for _earlier, _name in earlier_names().items():
    setattr(Questions, _earlier, getattr(Questions, _name))


def answer(history: xr.Dataset, name: str, arguments: Mapping[str, Any]) -> xr.Dataset:
    """Return the answer to a question, with arguments by name, as a table.

    Raises
    ------
    InputError
        An argument that the question does not take, one that is missing, or what the question itself refuses.
    """
    asked_for = questions()[name]
    parameters, cli_name = asked_for.parameters, name.replace("_", "-")
    for option in arguments:
        if option not in parameters:
            fix = nearest(option, parameters) if parameters else "it takes none"
            raise InputError(f"{cli_name}: has no parameter {option!r}; {fix}")
    needed = [option for option, parameter in parameters.items() if parameter.default is inspect.Parameter.empty]
    if missing := [option for option in needed if option not in arguments]:
        raise InputError(f"{cli_name}: needs {listed(missing)}; expected --with {missing[0]}=VALUE")
    result = getattr(Questions(history), name)(**arguments)
    return result if isinstance(result, xr.Dataset) else _table(asked_for, result)


def _table(asked_for: Question, result: Any) -> xr.Dataset:
    if isinstance(result, xr.DataArray):
        return result.to_dataset(name=asked_for.name)
    if hasattr(result, "to_dataset"):
        table: xr.Dataset = result.to_dataset()
        return table
    if isinstance(result, int | float | np.number):
        attributes = {"units": asked_for.unit} if asked_for.unit else {}
        return xr.Dataset({asked_for.name: ("row", [result], attributes)})
    if isinstance(result, tuple | list) and all(isinstance(item, Finding) for item in result):
        fields = ("name", "value", "limit", "text")
        return xr.Dataset({field: ("row", [getattr(item, field) for item in result]) for field in fields})
    if isinstance(result, list):
        labels, texts = ([str(line[column]) for line in result] for column in range(2))
        return xr.Dataset({"label": ("row", labels), "text": ("row", texts)})
    order = np.asarray(result)
    return xr.Dataset({"rank": ("row", np.arange(1, order.size + 1)), "asperity": ("row", order)})
