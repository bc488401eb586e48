"""Histories, and tables of questions, loops and sweeps, as netCDF files that any tool reads."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from historysim._version import __version__
from historysim.basics.files import replacing
from historysim.recording.compression import chunk_shape
from historysim.recording.provenance import CONVENTIONS, KEYWORDS
from historysim.results.ranges import ranges

CELLS_AT_ONCE = 1 << 20
"""Values of a variable that are read and written at a time."""
ALONG_THE_HISTORY = ("step", "elapsed_time")
"""Dimensions that may be too long for memory."""
CONTENT = "table"
"""What the attribute ``content`` says of a table that does not say it by itself."""
FOR_CATALOGUES = ("Conventions", "summary", "keywords", "source", "history")
"""Attributes that say nothing of the numbers."""
CALCULATED, MEASURED = "modelResult", "physicalMeasurement"
"""Where numbers come from, in the words of ACDD."""


def write_netcdf(table: xr.Dataset | xr.DataArray, path: str | Path, *, origin: str = CALCULATED) -> None:
    """Write a history or a table to a netCDF file, which appears under its name when it is complete.

    Texts are written as characters, since many tools know no others, and what a catalogue asks for (CF-1.11, ACDD-1.3)
    is added where the table does not say it. What goes along the steps of a history is written in blocks. `hs.open`,
    `hs.show` and `hs.plot` read what is written.

    Parameters
    ----------
    table : xarray.Dataset or xarray.DataArray
    path : path
        An existing file is replaced.
    origin : {"modelResult", "physicalMeasurement"}
        Where its numbers come from.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    dataset = table.to_dataset(name=table.name or "value") if isinstance(table, xr.DataArray) else table
    along = next((name for name in ALONG_THE_HISTORY if _is_first(name, dataset)), None)
    written = _described(dataset, origin)
    with replacing(Path(path)) as unfinished:
        if along is None:
            written.to_netcdf(unfinished, engine="netcdf4", encoding=_encoding(written))
            return
        encoding = _encoding(written, along)
        first = written.isel({along: slice(0, 0)})
        first.to_netcdf(unfinished, engine="netcdf4", encoding=encoding, unlimited_dims=[along])
        _fill(unfinished, written, along)


def summary(table: xr.Dataset) -> list[tuple[str, str]]:
    """Return in a few lines what a table holds: its dimensions, and the range of each variable.

    Parameters
    ----------
    table : xarray.Dataset
        As `write_netcdf` has written it.

    Returns
    -------
    list of (label, text)
    """
    sizes = ", ".join(f"{size:,} along {name}" for name, size in table.sizes.items())
    return [
        ("title", str(table.attrs.get("title", ""))),
        ("size", sizes or "one value each"),
        *ranges(table),
    ]


def _is_first(dimension: str, dataset: xr.Dataset) -> bool:
    """Return whether a table has a dimension, in front of all others."""
    places = [each.dims.index(dimension) for each in dataset.variables.values() if dimension in each.dims]
    return bool(places) and not any(places)


def _fill(path: Path, dataset: xr.Dataset, along: str) -> None:
    """Write the rows of all variables along a dimension, block by block."""
    with netCDF4.Dataset(path, "a") as file:
        for name, variable in dataset.variables.items():
            if along not in variable.dims:
                continue
            size = variable.sizes[along]
            at_once = max(1, CELLS_AT_ONCE * size // max(variable.size, 1))
            for start in range(0, size, at_once):
                rows = slice(start, min(start + at_once, size))
                file[str(name)][rows] = variable.isel({along: rows}).values


def _encoding(dataset: xr.Dataset, along: str = "") -> dict[Any, dict[str, Any]]:
    """Return how variables are stored: texts as characters, and nothing missing unless it is said so."""
    found: dict[Any, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        own = found[name] = {}
        if variable.dtype.kind in "UO":
            own["dtype"] = "S1"
        elif name in dataset.coords and variable.dtype == np.int64 and _is_small(variable):
            # ncview knows no labels of 8 bytes
            own.update({"_FillValue": None, "dtype": "int32"})
        elif name in dataset.coords or variable.dtype.kind in "iub":
            own["_FillValue"] = None
        if along in variable.dims and variable.ndim <= 2 and variable.size:
            rows, columns = chunk_shape(variable.sizes[along], variable.size // variable.sizes[along])
            own["chunksizes"] = (rows, columns)[: variable.ndim]
    return found


def _is_small(variable: xr.Variable) -> bool:
    return not variable.size or bool(np.abs(variable.values).max() <= np.iinfo(np.int32).max)


def _described(dataset: xr.Dataset, origin: str) -> xr.Dataset:
    """Return a table with what is said of it: attributes as characters and as integers that every tool knows."""
    made = dataset.copy()
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    title = dataset.attrs.get("title") or " and ".join(map(str, list(dataset.data_vars)[:2])).replace("_", " ")
    usual = {
        "Conventions": CONVENTIONS,
        "title": title,
        "summary": f"{title[:1].upper()}{title[1:]}, of a frictional contact.",
        "keywords": KEYWORDS,
        "source": f"historysim {__version__}",
        "history": f"written by historysim {__version__}",
    }
    # a history is a result, and says so by itself
    if not {"complete", "historysim_version"} <= dataset.attrs.keys():
        usual["content"] = CONTENT
    made.attrs = usual | dataset.attrs | {"date_created": now}
    for name, variable in made.variables.items():
        # what was read from a file brings along how it was stored there
        variable.encoding = {key: value for key, value in variable.encoding.items() if key == "_FillValue"}
        if name in made.data_vars:
            variable.attrs = {"coverage_content_type": origin} | variable.attrs
        variable.attrs = _attributes(variable.attrs)
    made.attrs = _attributes(made.attrs)
    return made


def _attributes(told: dict[Any, Any]) -> dict[Any, Any]:
    return {name: _stored(value) for name, value in told.items()}


def _stored(value: Any) -> Any:
    if isinstance(value, str) and value:
        # as UTF-8, where it is not ASCII
        return value.encode()
    return np.int32(value) if isinstance(value, int) and abs(value) <= np.iinfo(np.int32).max else value
