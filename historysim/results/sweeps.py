"""A sweep in a few lines, and as a table."""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from historysim.basics import findings
from historysim.basics.files import replacing
from historysim.basics.wording import counted
from historysim.results.csv_table import plain_text
from historysim.results.netcdf_table import write_netcdf
from historysim.results.ranges import range_of

CONTENT = "sweep"
"""What the attribute ``content`` of a sweep says."""


def summary(found: xr.Dataset) -> list[tuple[str, str]]:
    """Return in a few lines what came out of a sweep.

    Parameters
    ----------
    found : xarray.Dataset
        From `historysim.sweep`.

    Returns
    -------
    list of (label, text)
        The cells, what was swept, the range of each number over all cells, cells that have failed, and a warning for
        each assumption of the model that does not hold in some.
    """
    swept = _swept(found)
    dims = {dim for name in swept for dim in found[name].dims}
    count = int(np.prod([found.sizes[dim] for dim in dims]))
    lines = [("cells", f"{count:,}")]
    lines += [(str(found[name].attrs["long_name"]), _range(found[name])) for name in swept]
    lines += [
        (str(name), _range(variable))
        for name, variable in found.data_vars.items()
        if set(variable.dims) <= dims and variable.dtype.kind == "f"
    ]
    if "failure" in found:
        reasons = [str(reason) for reason in found["failure"].values.ravel() if reason]
        lines.append(("failed", f"{counted(len(reasons), 'cell', 'cells')}; the first: {reasons[0]}"))
    told = findings.read(str(found.attrs.get("validity", "[]")))
    return [*lines, *(("warning", finding.text) for finding in told)]


def rows(found: xr.Dataset, *, steps: bool = True) -> Iterator[list[object]]:
    """Yield a sweep as the rows of a table, a header first, with what was swept, and the numbers of each cell.

    A row for each cell; where outputs go along ``step``, and ``asperity``, one for each of these, too, with what they
    are called in columns of their own. Steps that a cell does not have are left out, without ``steps`` all of these.
    """
    if not steps:
        found = found.drop_vars([name for name, own in found.variables.items() if {"step", "asperity"} & {*own.dims}])
    swept = _swept(found)
    dims = tuple(dict.fromkeys(str(dim) for name in swept for dim in found[name].dims))
    own = tuple(dim for dim in ("step", "asperity") if any(dim in values.dims for values in found.data_vars.values()))
    told = [name for name in ("time", "summit_height", "summit_radius") if name in found.variables and own]
    names = list(dict.fromkeys([*swept, *told, *(str(name) for name in found.data_vars)]))
    units = [found[name].attrs.get("units", "") for name in names]
    headings = [f"{name} [{unit}]" if unit not in {"", "1"} else name for name, unit in zip(names, units, strict=True)]
    yield [*headings[: len(swept)], *own, *headings[len(swept) :]]
    along = list(own)
    cells = xr.DataArray(np.zeros([found.sizes[dim] for dim in (*dims, *along)]), dims=(*dims, *along))
    numbers = {dim: xr.DataArray(np.arange(found.sizes[dim]), dims=dim) for dim in along}
    labels = [found[dim] if dim in found.coords else numbers[dim] for dim in along]
    values = [*(found[name] for name in swept), *labels, *(found[name] for name in names[len(swept) :])]
    full = [each.reset_coords(drop=True).broadcast_like(cells).transpose(*dims, *along) for each in values]
    columns = [each.values.ravel() for each in full]
    # what goes along steps is NaN where a cell has fewer of them
    rowwise = [
        column
        for column, each in zip(columns, values, strict=True)
        if set(along) & set(each.dims) and each.dtype.kind == "f" and not set(each.dims) <= set(along)
    ]
    there = ~np.all([np.isnan(column) for column in rowwise], axis=0) if rowwise else np.ones(cells.size, dtype=bool)
    # a cell without any, which has failed, says so
    each = there.reshape([*(found.sizes[dim] for dim in dims), -1])
    each[..., 0] |= ~each.any(axis=-1)
    for row in zip(*(column[there] for column in columns), strict=True):
        yield [value.item() if hasattr(value, "item") else value for value in row]


def write(found: xr.Dataset, path: Path) -> None:
    """Write a sweep as netCDF, or, where the ending is .csv, as a table; see `rows`.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    if path.suffix.lower() != ".csv":
        write_netcdf(found, path)
        return
    with replacing(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(map(plain_text, row) for row in rows(found))


def _swept(found: xr.Dataset) -> list[str]:
    """Return the names of the swept quantities, in their order."""
    keys = str(found.attrs["swept_keys"]).split()
    by_key = {str(values.attrs.get("long_name")): str(name) for name, values in found.coords.items()}
    return [by_key[f"{key} of the scenario"] for key in keys]


def _range(values: xr.DataArray) -> str:
    if values.dtype.kind not in "fiu":
        return ", ".join(dict.fromkeys(map(str, values.values.ravel())))
    return range_of(values)
