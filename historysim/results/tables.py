"""Tables of queries, loops, sliding and sweeps: written as CSV and netCDF, and summarised."""

import csv
import itertools
import math
from collections.abc import Hashable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import netCDF4
import numpy as np

from historysim._version import __version__
from historysim.basics.arguments import Booleans, Floats
from historysim.basics.files import path_to_write, replacing
from historysim.basics.units import quantity_text, range_text
from historysim.basics.wording import brief, count_text, read_findings
from historysim.errors import InputError
from historysim.measured.loop_table import LoopQuantity, LoopStatistics, mean_or_bound_text
from historysim.measured.loop_values import QUANTITIES
from historysim.recording.netcdf import chunk_shape
from historysim.recording.provenance import CONVENTIONS, KEYWORDS

if TYPE_CHECKING:
    import xarray as xr

TABLE, SWEEP = "table", "sweep"  # default of the attribute content of a table, and that of a sweep
CELLS_AT_ONCE = 1 << 20  # values that are read and written in one block
LINE_END = "\r\n"  # of a table in CSV (RFC 4180)
ALONG_THE_HISTORY = ("step", "elapsed_time")  # dimensions that may be too long for memory
# attributes that do not describe the numbers
FOR_CATALOGUES = ("Conventions", "summary", "keywords", "source", "history")
# source of numbers, in the terms of ACDD
CALCULATED, MEASURED = "modelResult", "physicalMeasurement"
# beginnings of strings that a spreadsheet reads as a formula (OWASP, "CSV Injection")
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
MOST_VARIABLES_LISTED = 40


def write_csv(table: "xr.Dataset | xr.DataArray", path: str | Path) -> None:
    """Write a table to a CSV file, which appears under its name when it is complete.

    Rows are the members of the first dimension. The header has names, the members of further
    dimensions, and units: ``energy 17 [J]`` is the energy of asperity 17. Variables with another
    first dimension are left out. A table that is larger than memory is read in blocks.

    Parameters
    ----------
    table : xarray.Dataset or xarray.DataArray
    path : path
        An existing file is replaced.

    Raises
    ------
    InputError
        A table without a dimension, or a path with the ending of another format.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> history = hs.run("scenarios/04_normal_up_tangential_up.toml")
    >>> hs.write_csv(history.contact.stick_ratio(), "stick_ratio.csv")
    """
    with (
        replacing(path_to_write(path, ".csv")) as unfinished,
        unfinished.open("w", encoding="utf-8", newline="") as stream,
    ):
        csv.writer(stream, lineterminator=LINE_END).writerows(_rows(_dataset(table)))


def _dataset(table: "xr.Dataset | xr.DataArray") -> "xr.Dataset":
    import xarray as xr

    if not isinstance(table, xr.Dataset | xr.DataArray):
        raise InputError(f"table is {brief(table)}; expected a Dataset or DataArray of xarray")
    return (
        table.to_dataset(name=table.name or "value") if isinstance(table, xr.DataArray) else table
    )


def _rows(dataset: "xr.Dataset") -> Iterator[Sequence[Any]]:
    along = next(
        (variable.dims[0] for variable in dataset.data_vars.values() if variable.dims), None
    )
    if along is None:
        raise InputError(
            "the table has no dimension; expected one with a row for each member of its first dimension"
        )
    header = [
        with_unit(label, attributes)
        for label, _, attributes in _columns(dataset.isel({along: slice(0)}), along)
    ]
    yield header
    at_once = max(1, CELLS_AT_ONCE // len(header))
    for start in range(0, dataset.sizes[along], at_once):
        block = dataset.isel({along: slice(start, start + at_once)})
        yield from zip(
            *(map(_plain, values.tolist()) for _, values, _ in _columns(block, along)), strict=True
        )


def _columns(
    dataset: "xr.Dataset", along: Hashable
) -> Iterator[tuple[str, np.ndarray, dict[Any, Any]]]:
    """Yield label, values and attributes of each column of a table with a row for each member of a dimension."""
    names = [name for name, variable in dataset.variables.items() if variable.dims[:1] == (along,)]
    # labels of the rows come first
    for name in sorted(names, key=lambda name: name not in dataset.coords):
        further = dict(list(dataset[name].sizes.items())[1:])
        members = (
            dataset[dim].values if dim in dataset.coords else range(size)
            for dim, size in further.items()
        )
        values = dataset[name].values.reshape(-1, math.prod(further.values()))
        if name in dataset.coords and "flag_meanings" in dataset[name].attrs:
            values = _flag_words(values, dataset[name].attrs)
        for column, variable in enumerate(itertools.product(*members)):
            yield " ".join(map(str, (name, *variable))), values[:, column], dataset[name].attrs


def _flag_words(values: np.ndarray, attributes: "dict[Any, Any]") -> np.ndarray:
    """Return the words of flags that label rows, such as the regime of a loop."""
    words = dict(
        zip(
            np.ravel(attributes["flag_values"]).tolist(),
            attributes["flag_meanings"].split(),
            strict=True,
        )
    )
    return np.array([words[value] for value in values.ravel().tolist()], dtype=object).reshape(
        values.shape
    )


def with_unit(name: object, attributes: "dict[Any, Any]") -> str:
    """Return the heading of a column."""
    unit = attributes.get("units", "")
    return f"{name} [{unit}]" if unit and unit != "1" else str(name)


def _plain(value: Any) -> Any:
    """Return a value, with ``'`` in front if a spreadsheet would read the string as a formula."""
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def flat_columns(table: "xr.Dataset") -> "xr.Dataset":
    """Return the columns that `write_csv` writes of a table, as variables along ``row`` with their units."""
    dimensions = [dim for variable in table.data_vars.values() for dim in variable.dims]
    columns = {
        label: ("row", values, attributes)
        for label, values, attributes in _columns(table, dimensions[0])
    }
    return type(table)(columns, attrs={"title": table.attrs.get("title", "Table")})


def write_netcdf(
    table: "xr.Dataset | xr.DataArray", path: str | Path, *, origin: str = CALCULATED
) -> None:
    """Write a history or a table to a netCDF file, which appears under its name when it is complete.

    Strings are written as characters, since many tools support no others, and missing catalogue
    attributes (CF-1.11, ACDD-1.3) are added. Variables along the steps of a history are written in
    blocks. `hs.open`, `hs.show` and `hs.plot` read what is written.

    Parameters
    ----------
    table : xarray.Dataset or xarray.DataArray
    path : path
        An existing file is replaced.
    origin : {"modelResult", "physicalMeasurement"}
        Source of its numbers.

    Raises
    ------
    InputError
        A path with the ending of another format, such as .zarr.
    OSError
        The file cannot be written.
    """
    dataset = _dataset(table)
    along = next((name for name in ALONG_THE_HISTORY if _is_first(name, dataset)), None)
    written = _with_metadata(dataset, origin)
    with replacing(path_to_write(path, ".nc")) as unfinished:
        if along is None:
            written.to_netcdf(unfinished, engine="netcdf4", encoding=_encoding(written))
            return
        encoding = _encoding(written, along)
        header = written.isel({along: slice(0, 0)})
        header.to_netcdf(unfinished, engine="netcdf4", encoding=encoding, unlimited_dims=[along])
        _append_rows(unfinished, written, along)


def _is_first(dimension: str, dataset: "xr.Dataset") -> bool:
    """Return whether a dimension of a table precedes all others."""
    positions = [
        variable.dims.index(dimension)
        for variable in dataset.variables.values()
        if dimension in variable.dims
    ]
    return bool(positions) and not any(positions)


def _append_rows(path: Path, dataset: "xr.Dataset", along: str) -> None:
    """Write the rows of all variables along a dimension, block by block."""
    # xarray would hold each variable in memory as a whole
    with netCDF4.Dataset(path, "a") as file:
        for name, variable in dataset.variables.items():
            if along not in variable.dims:
                continue
            size = variable.sizes[along]
            at_once = max(1, CELLS_AT_ONCE * size // max(variable.size, 1))
            for start in range(0, size, at_once):
                rows = slice(start, min(start + at_once, size))
                file[str(name)][rows] = variable.isel({along: rows}).values


def _encoding(dataset: "xr.Dataset", along: str = "") -> dict[Any, dict[str, Any]]:
    """Return the encoding of variables: strings as characters, fill values only if they are declared."""
    encodings: dict[Any, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        encoding = encodings[name] = {}
        if variable.dtype.kind in "UO":
            encoding["dtype"] = "S1"
        elif name in dataset.coords and variable.dtype == np.int64 and _is_small(variable):
            # ncview cannot read labels of 8 bytes
            encoding.update({"_FillValue": None, "dtype": "int32"})
        elif name in dataset.coords or variable.dtype.kind in "iub":
            encoding["_FillValue"] = None
        if along in variable.dims and variable.ndim <= 2 and variable.size:
            rows, columns = chunk_shape(
                variable.sizes[along], variable.size // variable.sizes[along]
            )
            encoding["chunksizes"] = (rows, columns)[: variable.ndim]
    return encodings


def _is_small(variable: "xr.Variable") -> bool:
    return not variable.size or bool(np.abs(variable.values).max() <= np.iinfo(np.int32).max)


def _with_metadata(dataset: "xr.Dataset", origin: str) -> "xr.Dataset":
    """Return a table with the attributes of a catalogue, in types that every tool knows."""
    result = dataset.copy()
    title = dataset.attrs.get("title") or " and ".join(
        map(str, list(dataset.data_vars)[:2])
    ).replace("_", " ")
    usual = {
        "Conventions": CONVENTIONS,
        "title": title,
        "summary": f"{title[:1].upper()}{title[1:]}, of a frictional contact.",
        "keywords": KEYWORDS,
        "source": f"historysim {__version__}",
        "history": f"written by historysim {__version__}",
    }
    # a history is a result
    if not {"complete", "historysim_version"} <= dataset.attrs.keys():
        usual["content"] = TABLE
    timestamp = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    result.attrs = _encode_attributes(usual | dataset.attrs | {"date_created": timestamp})
    for name, variable in result.variables.items():
        # a variable that was read from a file keeps its encoding
        variable.encoding = {
            key: value for key, value in variable.encoding.items() if key == "_FillValue"
        }
        content = {"coverage_content_type": origin} if name in result.data_vars else {}
        variable.attrs = _encode_attributes(content | variable.attrs)
    return result


def _encode_attributes(attributes: dict[Any, Any]) -> dict[Any, Any]:
    """Return attributes as they are stored: strings as characters in UTF-8, whole numbers with 4 bytes."""

    def encode(value: Any) -> Any:
        if isinstance(value, str) and value:
            return value.encode()
        return (
            np.int32(value)
            if isinstance(value, int) and abs(value) <= np.iinfo(np.int32).max
            else value
        )

    return {name: encode(value) for name, value in attributes.items()}


def table_summary(table: "xr.Dataset") -> list[tuple[str, str]]:
    """Return lines of (label, text) of a table that `write_netcdf` wrote: its size, and the range of each variable."""
    sizes = ", ".join(f"{size:,} along {name}" for name, size in table.sizes.items())
    return [
        ("title", str(table.attrs.get("title", ""))),
        ("size", sizes or "one value each"),
        *_ranges(table),
    ]


def _ranges(table: "xr.Dataset") -> list[tuple[str, str]]:
    """Return lines of (label, text): each variable with its range, and its long name."""
    lines = []
    for name, values in list(table.data_vars.items())[:MOST_VARIABLES_LISTED]:
        meaning = str(values.attrs.get("long_name", ""))
        lines.append((str(name), f"{_range(values)}{f'; {meaning}' if meaning else ''}"))
    if len(table.data_vars) > MOST_VARIABLES_LISTED:
        lines.append(("and", f"{len(table.data_vars) - MOST_VARIABLES_LISTED:,} more"))
    return lines


def _range(values: "xr.DataArray") -> str:
    """Return the range of a variable with its unit and missing values; the number of strings, or of true values."""
    if values.dtype.kind == "b":
        return f"{int(values.sum()):,} of {values.size:,}"
    if values.dtype.kind not in "iuf":
        return count_text(len(set(values.values.ravel().tolist())), "string", "different strings")
    finite = values.values[np.isfinite(values.values)]
    if not finite.size:
        return "no value"
    text = range_text(float(finite.min()), float(finite.max()), str(values.attrs.get("units", "1")))
    return text if finite.size == values.size else f"{text}, {values.size - finite.size:,} missing"


def sweep_summary(sweep: "xr.Dataset") -> list[tuple[str, str]]:
    """Return lines of (label, text) of a sweep.

    They state the number of cells, the swept quantities, the range of each number over all cells,
    failed cells, and a warning for each assumption of the model that does not hold in some cells.
    """
    swept = _swept(sweep)
    dims = {dim for name in swept for dim in sweep[name].dims}
    lines = [("cells", f"{int(np.prod([sweep.sizes[dim] for dim in dims])):,}")]
    for name in swept:
        values = sweep[name]
        text = ", ".join(dict.fromkeys(map(str, values.values.ravel())))
        lines.append(
            (str(values.attrs["long_name"]), _range(values) if values.dtype.kind in "fiu" else text)
        )
    lines += [
        (str(name), _range(values))
        for name, values in sweep.data_vars.items()
        if set(values.dims) <= dims and values.dtype.kind == "f"
    ]
    if "failure" in sweep:
        reasons = [str(reason) for reason in sweep["failure"].values.ravel() if reason]
        lines.append(
            ("failed", f"{count_text(len(reasons), 'cell', 'cells')}; the first: {reasons[0]}")
        )
    warnings = read_findings(str(sweep.attrs.get("validity", "[]")))
    return [*lines, *(("warning", finding.text) for finding in warnings)]


def sweep_rows(sweep: "xr.Dataset", *, steps: bool = True) -> Iterator[Sequence[Any]]:
    """Yield a sweep as a heading with units and one row per cell: swept values and results.

    Outputs along ``step`` and ``asperity`` have a row for each of these, with columns of their
    labels; steps that a cell does not have are left out, without ``steps`` all of these.
    """
    along = {"step", "asperity"}
    if not steps:
        sweep = sweep.drop_vars(
            [name for name, values in sweep.variables.items() if along & {*values.dims}]
        )
    swept = _swept(sweep)
    dims = tuple(dict.fromkeys(str(dim) for name in swept for dim in sweep[name].dims))
    row_dims = [
        dim
        for dim in ("step", "asperity")
        if any(dim in values.dims for values in sweep.data_vars.values())
    ]
    labels = [
        name
        for name in ("time", "summit_height", "summit_radius")
        if name in sweep.variables and row_dims
    ]
    names = list(dict.fromkeys([*labels, *map(str, sweep.data_vars)]))
    if not dims and not row_dims:
        # a design at one point has no dimension to make rows of
        sweep = sweep.expand_dims("point")
        dims = ("point",)
    frame = sweep.to_dataframe(dim_order=[*dims, *row_dims]).reset_index()
    # variables along steps are NaN where a cell has fewer steps
    padded = [
        name
        for name in (str(name) for name in sweep.data_vars)
        if {*row_dims} & {*sweep[name].dims}
        and sweep[name].dtype.kind == "f"
        and not {*sweep[name].dims} <= {*row_dims}
    ]
    # a copy: pandas lends its own arrays read-only
    valid = (
        frame[padded].notna().any(axis=1).to_numpy(copy=True)
        if padded
        else np.ones(len(frame), dtype=np.bool_)
    )
    # a cell without any number, which has failed, keeps a row
    per_cell = valid.reshape(*(sweep.sizes[dim] for dim in dims), -1)
    per_cell[..., 0] |= ~per_cell.any(axis=-1)
    units = {name: sweep[name].attrs for name in [*swept, *names]}
    columns = [*swept, *row_dims, *names]
    yield [with_unit(name, units.get(name, {})) for name in columns]
    yield from frame.loc[valid, columns].itertuples(index=False, name=None)


def write_sweep(sweep: "xr.Dataset", path: Path) -> None:
    """Write a sweep as netCDF or, where the ending is .csv, as a table (`sweep_rows`)."""
    if path.suffix.lower() != ".csv":
        write_netcdf(sweep, path)
        return
    with (
        replacing(path) as unfinished,
        unfinished.open("w", encoding="utf-8", newline="") as stream,
    ):
        csv.writer(stream, lineterminator=LINE_END).writerows(
            map(_plain, row) for row in sweep_rows(sweep)
        )


def _swept(sweep: "xr.Dataset") -> list[str]:
    """Return the names of the swept quantities, in their order."""
    keys = str(sweep.attrs["swept_keys"]).split()
    by_key = {
        str(values.attrs.get("long_name")): str(name) for name, values in sweep.coords.items()
    }
    return [by_key[f"{key} of the scenario"] for key in keys]


def loop_summary(loops: "xr.Dataset") -> list[tuple[str, str]]:
    """Return lines of (label, text) of friction loops, as `Loops.to_dataset` or `LoopTable.to_dataset` gives them.

    Mean ± standard deviation of each quantity over the loops, or for each load or amplitude of a
    table, in both directions, and the criteria by which the loops were found.
    """
    criteria = [
        ("", ""),
        *(
            (str(name), str(value))
            for name, value in loops.attrs.items()
            if name not in FOR_CATALOGUES
        ),
    ]
    if "loop" not in loops.dims:
        return [*_levels(loops), *criteria]
    count = int(_large(loops).sum())
    some = (
        ""
        if count == loops.sizes["loop"]
        else f", of which {count:,} are large enough for the means below"
    )
    means = [
        (str(values.attrs["long_name"]), _mean_text(loops, name, count))
        for name, values in loops.data_vars.items()
        # flags have no mean
        if "units" in values.attrs
    ]
    values = ("values", "mean ± standard deviation of one loop")
    return [("loops", f"{loops.sizes['loop']:,}{some}"), values, *means, *criteria]


def values_in_mean(loops: "xr.Dataset", quantity: Hashable) -> Floats:
    """Return the values that a mean of a loop quantity includes (loop, …): large loops; NaN for a lower bound."""
    values = loops[quantity]
    if _declaration(loops, quantity).needs_slip and "lower_bound" in loops:
        values = values.where(loops["lower_bound"] == 0)
    values_of_large: Floats = values.values[_large(loops)]
    return values_of_large


def _mean_text(loops: "xr.Dataset", quantity: Hashable, count: int) -> str:
    """Return a mean, or a lower bound if no branch reached sliding."""
    sliding, every = map(
        LoopStatistics.from_values,
        (values_in_mean(loops, quantity), loops[quantity].values[_large(loops)]),
    )
    return mean_or_bound_text(sliding, every, _declaration(loops, quantity), count)


def _declaration(loops: "xr.Dataset", quantity: Hashable) -> LoopQuantity:
    """Return the declaration of a quantity in its unit in the file; none of fretting needs slip."""
    needs_slip = quantity in QUANTITIES and QUANTITIES[str(quantity)].needs_slip
    return LoopQuantity("", loops[quantity].attrs.get("units", "1"), needs_slip=needs_slip)


def _large(loops: "xr.Dataset") -> Booleans:
    """Return a mask of the loops that count in means, as in `Loops.large`."""
    amplitude = loops["amplitude"].values
    return np.asarray(amplitude >= loops.attrs["amplitude_share"] * amplitude.max())


def _levels(table: "xr.Dataset") -> list[tuple[str, str]]:
    both = table.sel(direction="both")
    (along,) = both["loops"].dims
    lines = []
    for level, value in enumerate(both[along].values):
        at = both.isel({along: level})
        lines.append(
            (quantity_text(float(value), both[along].attrs["units"]), f"{int(at['loops']):,} loops")
        )
        for name, mean in at.data_vars.items():
            if f"{name}_count" in at:
                statistics = LoopStatistics(
                    float(mean), float(at[f"{name}_standard_deviation"]), int(at[f"{name}_count"])
                )
                lines.append(
                    (
                        f"  {mean.attrs['long_name']}",
                        statistics.text(mean.attrs["units"], int(at["loops"])),
                    )
                )
    return lines
