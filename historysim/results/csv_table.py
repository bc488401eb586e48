"""Tables of questions and of loops as CSV files: one row for each member of the first dimension."""

import csv
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import xarray as xr

from historysim.basics.files import replacing
from historysim.errors import InputError

CELLS_AT_ONCE = 1 << 20
"""Values that are read and written at a time."""


def plain_text(value: Any) -> Any:
    """Return a value of a table so that a spreadsheet takes no text for a formula: in front of one stands ``'``.

    As in OWASP, "CSV Injection": texts that begin with ``=``, ``+``, ``-``, ``@``, a tab or a line break.
    """
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def write_csv(table: xr.Dataset | xr.DataArray, path: str | Path) -> None:
    """Write a table to a CSV file, which appears under its name when it is complete.

    Rows are the members of the first dimension. The header has names, the members of further dimensions, and units:
    ``energy 17 [J]`` is the energy of asperity 17. What has another first dimension is left out. A table that is larger
    than memory is read in blocks.

    Parameters
    ----------
    table : xarray.Dataset or xarray.DataArray
    path : path
        An existing file is replaced.

    Raises
    ------
    InputError
        A table without a dimension.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> history = hs.run("scenarios/04_normal_up_tangential_up.toml")
    >>> hs.write_csv(history.contact.stick_ratio(), "stick_ratio.csv")
    """
    dataset = table.to_dataset(name=table.name or "value") if isinstance(table, xr.DataArray) else table
    with replacing(Path(path)) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(_rows(dataset))


def _rows(dataset: xr.Dataset) -> Iterator[list[Any]]:
    dims = next((variable.dims for variable in dataset.data_vars.values() if variable.dims), None)
    if dims is None:
        raise InputError("the table has no dimension; expected one with a row for each member of its first dimension")
    along = dims[0]
    columns = [name for name, each in dataset.variables.items() if each.dims[:1] == (along,)]
    # what tells the rows apart comes first
    columns.sort(key=lambda name: name not in dataset.coords)
    header = []
    for name in columns:
        variable = dataset[name]
        unit = variable.attrs.get("units", "")
        suffix = f" [{unit}]" if unit and unit != "1" else ""
        members = (
            dataset[dim].values if dim in dataset.coords else range(size)
            for dim, size in list(variable.sizes.items())[1:]
        )
        header += [" ".join(map(str, (name, *each))) + suffix for each in itertools.product(*members)]
    yield header
    size, at_once = dataset.sizes[along], max(1, CELLS_AT_ONCE // max(len(header), 1))
    for first in range(0, size, at_once):
        block = dataset[columns].isel({along: slice(first, first + at_once)})
        values = [part for name in columns for part in block[name].values.reshape(block.sizes[along], -1).T]
        yield from map(list, zip(*(map(plain_text, part.tolist()) for part in values), strict=True))
