"""Answers of questions to a history as tables, whatever a question gives: numbers, labels, lines, loops, arrays."""

import inspect
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from historysim.basics.findings import Finding
from historysim.basics.wording import listed, nearest
from historysim.errors import InputError
from historysim.results.accessor import Questions

LENGTHS = ("branch_drift", "cycle_drift", "drift", "positioning_error", "run_drift")
"""Questions whose answer is a length [m]."""


def answer(history: xr.Dataset, question: str, given: Mapping[str, Any]) -> xr.Dataset:
    """Return the answer to a question as a table.

    Parameters
    ----------
    history : xarray.Dataset
    question : str
        The name of a method of ``history.contact``.
    given : mapping
        Its arguments.

    Raises
    ------
    InputError
        An argument that the question does not take, one that is missing, or what the question itself refuses.
    """
    method = getattr(Questions(history), question)
    parameters = {
        name: one for name, one in inspect.signature(method).parameters.items() if name not in {"self", "definitions"}
    }
    said = question.replace("_", "-")
    for name in given:
        if name not in parameters:
            hint = nearest(name, parameters) if parameters else "it takes none"
            raise InputError(f"{said}: has no parameter {name!r}; {hint}")
    needed = [name for name, one in parameters.items() if one.default is inspect.Parameter.empty]
    if missing := [name for name in needed if name not in given]:
        raise InputError(f"{said}: needs {listed(missing)}; expected --with {missing[0]}=VALUE")
    found = method(**given)
    return found if isinstance(found, xr.Dataset) else _table(question, found)


def _table(name: str, found: Any) -> xr.Dataset:
    if isinstance(found, xr.DataArray):
        return found.to_dataset(name=name)
    if hasattr(found, "to_dataset"):
        table: xr.Dataset = found.to_dataset()
        return table
    if isinstance(found, int | float | np.number):
        attributes = {"units": "m"} if name in LENGTHS else {}
        return xr.Dataset({name: ("row", [found], attributes)})
    if isinstance(found, tuple | list) and all(isinstance(each, Finding) for each in found):
        fields = ("name", "value", "limit", "text")
        return xr.Dataset({field: ("row", [getattr(each, field) for each in found]) for field in fields})
    if isinstance(found, list):
        lines = [[str(row[place]) for row in found] for place in range(2)]
        return xr.Dataset({"label": ("row", lines[0]), "text": ("row", lines[1])})
    order = np.asarray(found)
    return xr.Dataset({"rank": ("row", np.arange(1, order.size + 1)), "asperity": ("row", order)})
