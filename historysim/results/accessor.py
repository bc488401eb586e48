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


def _method(asked: Question) -> Callable[..., Any]:
    """Return a question as a method, with the documentation of the function."""

    @functools.wraps(asked.function)
    def method(self: "Questions", /, *args: Any, **kwargs: Any) -> Any:
        return asked.function(self.history, *args, **kwargs)

    parameters = list(inspect.signature(asked.function).parameters.values())
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = inspect.Signature([own, *parameters[1:]])  # type: ignore[attr-defined] # a function has one
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


def answer(history: xr.Dataset, name: str, given: Mapping[str, Any]) -> xr.Dataset:
    """Return the answer to a question, with arguments by name, as a table.

    Raises
    ------
    InputError
        An argument that the question does not take, one that is missing, or what the question itself refuses.
    """
    asked_for = questions()[name]
    parameters, shown = asked_for.parameters, name.replace("_", "-")
    for each in given:
        if each not in parameters:
            raise InputError(
                f"{shown}: has no parameter {each!r}; {nearest(each, parameters) if parameters else 'it takes none'}"
            )
    needed = [each for each, one in parameters.items() if one.default is inspect.Parameter.empty]
    if missing := [each for each in needed if each not in given]:
        raise InputError(f"{shown}: needs {listed(missing)}; expected --with {missing[0]}=VALUE")
    found = getattr(Questions(history), name)(**given)
    return found if isinstance(found, xr.Dataset) else _table(asked_for, found)


def _table(asked_for: Question, found: Any) -> xr.Dataset:
    if isinstance(found, xr.DataArray):
        return found.to_dataset(name=asked_for.name)
    if hasattr(found, "to_dataset"):
        table: xr.Dataset = found.to_dataset()
        return table
    if isinstance(found, int | float | np.number):
        attributes = {"units": asked_for.unit} if asked_for.unit else {}
        return xr.Dataset({asked_for.name: ("row", [found], attributes)})
    if isinstance(found, tuple | list) and all(isinstance(each, Finding) for each in found):
        fields = ("name", "value", "limit", "text")
        return xr.Dataset({field: ("row", [getattr(each, field) for each in found]) for field in fields})
    if isinstance(found, list):
        labels, texts = ([str(line[column]) for line in found] for column in range(2))
        return xr.Dataset({"label": ("row", labels), "text": ("row", texts)})
    order = np.asarray(found)
    return xr.Dataset({"rank": ("row", np.arange(1, order.size + 1)), "asperity": ("row", order)})
