"""The Dataset of a sweep: cells along the swept quantities, the spread over one of them, and the drift along one."""

import warnings
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim._version import __version__
from historysim.basics.fields import field_unit
from historysim.basics.units import quantity
from historysim.basics.wording import (
    Finding,
    brief,
    count_text,
    nearest,
    read_findings,
    written_findings,
)
from historysim.errors import InputError, error_path
from historysim.recording.provenance import CONVENTIONS, KEYWORDS, VALIDITY, made_with
from historysim.results.tables import SWEEP
from historysim.scenario.grid import Grid, path_of_key, variable_name
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import located_errors, single_value_type
from historysim.scenario.sections import Sections

FAILURE = "failure"
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
# numbers of a sweep that only name something, so that a mean of them says nothing
LABELS = ("critical_asperity",)


def gather(
    scenario: Scenario, grid: Grid, cells: Sequence[xr.Dataset | None], reasons: Mapping[int, str]
) -> xr.Dataset:
    """Combine the cells of a grid, in the order of its points, into a Dataset; InputError if all have failed.

    A cell that has failed is None, with its reason by position. Steps that a cell does not have are
    filled with NaN; the rows of an asperity are stored under its label.
    """
    computed = [cell for cell in cells if cell is not None]
    if not computed:
        first_failed = min(reasons)
        raise InputError(
            f"all of {count_text(len(cells), 'cell', 'cells')} failed; the first: {reasons[first_failed]}"
        )
    swept = swept_coordinates(scenario, grid)
    asperities = [cell["asperity"].values for cell in computed if "asperity" in cell.coords]
    labels: dict[Any, Any] = (
        {"asperity": np.unique(np.concatenate(asperities))} if asperities else {}
    )
    # some surfaces alone have positions, say
    names = dict.fromkeys(
        str(name) for cell in computed for name in cell.variables if name not in labels
    )
    variables = {name: _stack_variable(name, grid, cells, labels) for name in names}
    coordinate_names = [name for name in names if any(name in cell.coords for cell in computed)]
    steps = (
        {"asperity": xr.Variable("asperity", labels["asperity"], computed[0]["asperity"].attrs)}
        if labels
        else {}
    )
    data = {name: variable for name, variable in variables.items() if name not in coordinate_names}
    if reasons:
        texts = [reasons.get(index, "") for index in range(len(cells))]
        data[FAILURE] = failures(grid, texts, "why the cell has failed, empty where it has not")
    coordinates = swept | steps | {name: variables[name] for name in coordinate_names}
    histories = count_text(len(grid), "load history", "load histories")
    attributes = table_attributes(
        scenario, grid, "Sweep", f"What {histories} of a frictional contact led to."
    )
    history = f"{count_text(len(grid), 'cell', 'cells')} computed by historysim {__version__}"
    validity = written_findings(_worst_findings(computed))
    return xr.Dataset(data, coordinates, attributes | {"history": history, VALIDITY: validity})


def find_mismatches(cells: Mapping[int, xr.Dataset]) -> dict[int, str]:
    """Return, by index, why cells do not fit the first one: a quantity has other dimensions."""
    if not cells:
        return {}
    over = {name: variable.dims for name, variable in cells[min(cells)].variables.items()}
    return {
        index: (
            f"{name} has the dimensions {_words(dims)}, and in cells before {_words(over[name])}; sweep them separately"
        )
        for index, cell in sorted(cells.items())
        for name, variable in cell.variables.items()
        if (dims := variable.dims) != over.get(name, dims)
    }


def _words(dims: Sequence[Hashable]) -> str:
    return " and ".join(map(str, dims)) or "nothing"


def failures(grid: Grid, reasons: Sequence[str], long_name: str) -> xr.Variable:
    """Return the reasons of missing values at the points of a grid, empty at the others."""
    return xr.Variable(
        grid.dims, np.reshape(reasons, grid.shape), {"long_name": long_name}, {"dtype": "S1"}
    )


def _stack_variable(
    name: str, grid: Grid, cells: Sequence[xr.Dataset | None], labels: Mapping[Any, Any]
) -> xr.Variable:
    """Stack a variable of all cells; a coordinate equal in all cells has no dimension of the grid."""
    computed = {index: cell for index, cell in enumerate(cells) if cell is not None}
    variables = {
        index: cell.variables[name] for index, cell in computed.items() if name in cell.variables
    }
    index_of_model = min(variables)
    model = variables[index_of_model]
    longest = map(max, zip(*(variable.shape for variable in variables.values()), strict=True))
    shape = tuple(
        labels[dim].size if dim in labels else length
        for dim, length in zip(model.dims, longest, strict=True)
    )
    everywhere = len(variables) == len(computed)
    if (
        name in computed[index_of_model].coords
        and everywhere
        and all(np.array_equal(model, candidate) for candidate in variables.values())
    ):
        return model
    is_complete = len(variables) == len(cells) and all(
        variable.shape == shape for variable in variables.values()
    )
    # missing rows are NaN
    values = np.full(
        (len(cells), *shape),
        0 if is_complete else np.nan,
        dtype=model.dtype if is_complete else np.float64,
    )
    for index, variable in variables.items():
        where = (
            np.searchsorted(labels[dim], computed[index][dim].values)
            if dim in labels
            else np.arange(length)
            for dim, length in zip(variable.dims, variable.shape, strict=True)
        )
        values[index, ...][np.ix_(*where)] = variable.values
    dims = (*grid.dims, *map(str, model.dims))
    # flags have the type of their variable
    flags = {
        key: np.asarray(value, values.dtype)
        for key, value in model.attrs.items()
        if key == "flag_values"
    }
    return xr.Variable(
        dims,
        values.reshape((*grid.shape, *shape)),
        model.attrs | flags,
        {"_FillValue": None} if is_complete else {},
    )


def swept_coordinates(scenario: Scenario, grid: Grid) -> dict[str, xr.Variable]:
    """Return the swept quantities, with units, along the dimensions of a grid; InputError names a key that is wrong."""
    sections = scenario.at(next(grid.points())).sections
    coordinates: dict[str, xr.Variable] = {}
    for axis in grid.axes:
        for key, *written in zip(axis.keys, *axis.values, strict=True):
            unit = find_unit(sections, key)
            with located_errors(scenario.path.name), error_path(*path_of_key(key)):
                values = [
                    quantity(value, unit) if unit and not isinstance(value, list) else value
                    for value in written
                ]
            attributes = {
                "long_name": f"{key} of the scenario",
                **({"units": unit} if unit else {}),
            }
            plain = all(
                isinstance(value, int | float) and not isinstance(value, bool) for value in values
            )
            column = np.array(values if plain else [_text(value) for value in values])
            coordinates[variable_name(key)] = xr.Variable(
                axis.name, column, attributes, {"_FillValue": None}
            )
    return coordinates


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_text(item)}' for key, item in value.items())} }}"
    return f"[{', '.join(map(_text, value))}]" if isinstance(value, list | tuple) else str(value)


def find_unit(sections: Sections, key: str) -> str:
    """Return the SI unit of a key, empty if it has none."""
    section: Any = sections
    unit = ""
    for step in path_of_key(key):
        if isinstance(step, int):
            section = section[step]
            continue
        # a surface may have keys that change it, and friction may be a law
        while step not in _fields(section) and "of" in _fields(section):
            section = section.of
        if step not in _fields(section) and step in getattr(section, "event_keys", ("", ()))[1]:
            # of a waypoint: the field of an event other than its time
            held, kinds = section.event_keys
            unit, section = (
                field_unit(single_value_type(kinds[step])[0]),
                getattr(section, held).get(step),
            )
            continue
        if step not in _fields(section):
            return ""
        unit = field_unit(_fields(section)[step].type)
        section = getattr(section, step)
    return unit


def _fields(section: Any) -> Mapping[str, "attrs.Attribute[Any]"]:
    return attrs.fields_dict(type(section)) if attrs.has(type(section)) else {}


def table_attributes(scenario: Scenario, grid: Grid, title: str, summary: str) -> dict[str, Any]:
    """Return the attributes of a sweep, or of another table along a grid."""
    return {
        "Conventions": CONVENTIONS,
        "title": scenario.title or f"{title} of {scenario.path.name}",
        "summary": summary,
        "keywords": KEYWORDS,
        **scenario.metadata,
        "content": SWEEP,
        "source": f"historysim {__version__}: exact traction memory of Hertz-Mindlin asperities",
        "historysim_version": __version__,
        "made_with": made_with(),
        "scenario": scenario.text,
        "swept_keys": " ".join(key for axis in grid.axes for key in axis.keys),
        "complete": np.int8(1),
    }


def _worst_findings(cells: Sequence[xr.Dataset]) -> tuple[Finding, ...]:
    """Return the assumptions that do not hold in some cells: each at its worst, with the number of cells."""
    by_name: dict[str, list[Finding]] = {}
    for cell in cells:
        for finding in read_findings(cell.attrs.get(VALIDITY, "[]")):
            by_name.setdefault(finding.name, []).append(finding)

    def excess(finding: Finding) -> float:
        low, high = sorted((abs(finding.value), abs(finding.limit)))
        return high / low if low else np.inf

    worst = [(max(findings, key=excess), len(findings)) for findings in by_name.values()]
    return tuple(
        attrs.evolve(
            finding,
            text=f"in {count:,} of {count_text(len(cells), 'cell', 'cells')}; at worst: {finding.text}",
        )
        for finding, count in worst
    )


def sweep_statistics(
    table: xr.Dataset, along: str = "surface_seed", quantiles: Sequence[float] = QUANTILES
) -> xr.Dataset:
    """Return mean, deviation and quantiles of the numbers of a sweep over one dimension, mostly seeds.

    Parameters
    ----------
    found : xarray.Dataset
        From `historysim.sweep`.
    along : str
        The dimension.
    quantiles : sequence of float
        Each from 0 to 1; between two cells they are interpolated linearly.

    Returns
    -------
    xarray.Dataset
        For each variable with the dimension, in its own unit: ``NAME_mean``,
        ``NAME_standard_deviation`` (of the population, from n - 1), ``NAME_quantile`` along
        ``quantile``, and ``NAME_count``, the number of cells n. Cells that have failed are left
        out; where none is left all are NaN, and with one the standard deviation.

    Raises
    ------
    InputError
        The sweep has no such dimension, or a quantile is none.

    Examples
    --------
    >>> over = {"surface.seed": range(3)}
    >>> found = hs.sweep("scenarios/18_texture_tolerances.toml", {**over, "surface.height_scatter": ["10 nm"]})
    >>> "preliminary_displacement_mean" in hs.sweep_statistics(found, "surface_seed")
    True
    """
    _check_dimension(table, along)
    fractions = np.array(quantiles, dtype=float)
    if fractions.ndim != 1 or not ((fractions >= 0) & (fractions <= 1)).all():
        raise InputError(f"quantiles are {quantiles!r}; expected numbers from 0 to 1")
    result: dict[str, xr.DataArray] = {}
    for name, values in table.data_vars.items():
        if along not in values.dims or values.dtype.kind not in "fi" or name in LABELS:
            continue
        numbers, text = values.astype(float), str(values.attrs.get("long_name", name))
        with warnings.catch_warnings():
            # where no cell is left, or one for a deviation, the answer is NaN
            warnings.simplefilter("ignore", RuntimeWarning)
            statistics = {
                "mean": (numbers.mean(along), "mean"),
                "standard_deviation": (numbers.std(along, ddof=1), "standard deviation"),
                "quantile": (
                    numbers.quantile(fractions, along).transpose(..., "quantile"),
                    "quantiles",
                ),
            }
        for suffix, (values_of_statistic, word) in statistics.items():
            values_of_statistic.attrs = {
                "long_name": f"{word} of: {text}",
                "units": values.attrs.get("units", "1"),
            }
            result[f"{name}_{suffix}"] = values_of_statistic
        count = numbers.notnull().sum(along)
        count.attrs = {"long_name": f"number of cells with: {text}", "units": "1"}
        result[f"{name}_count"] = count
    return xr.Dataset(result, attrs={**table.attrs, "spread_along": along})


def drift_along(
    table: xr.Dataset, along: str, name: str = "preliminary_displacement"
) -> xr.DataArray:
    """Return the drift of a number along a swept quantity: the magnitude of its change from the first value.

    The dimension is that of a load, a friction coefficient, a radius, …; InputError: the sweep has
    no such dimension or number.
    """
    _check_dimension(table, along)
    if name not in table or along not in table[name].dims:
        numbers = [str(key) for key, values in table.data_vars.items() if along in values.dims]
        raise InputError(
            f"{name!r} is not a number of this sweep along {along}; {nearest(name, numbers)}"
        )
    changed = abs(table[name] - table[name].isel({along: 0}, drop=True))
    text = table[name].attrs.get("long_name", name)
    changed.attrs = {
        "long_name": f"drift along {along} of: {text}",
        "units": table[name].attrs.get("units", "1"),
    }
    return changed.rename(f"{name}_drift")


def _check_dimension(table: xr.Dataset, along: str) -> None:
    if not isinstance(table, xr.Dataset):
        raise InputError(f"{brief(table)} is not a sweep; expected the Dataset of hs.sweep")
    if along not in table.dims:
        dims = [str(dim) for dim in table.dims]
        raise InputError(f"{along!r} is not a dimension of this sweep; {nearest(along, dims)}")
