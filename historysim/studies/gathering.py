"""Cells, put together into one Dataset with the swept quantities as its dimensions."""

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim._version import __version__
from historysim.basics import findings
from historysim.basics.fields import unit_in
from historysim.basics.places import at
from historysim.basics.units import quantity
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.recording.provenance import CONVENTIONS, KEYWORDS, made_with
from historysim.recording.recorded_validity import ATTRIBUTE
from historysim.results.sweeps import CONTENT
from historysim.scenario.grid import Grid, variable_name
from historysim.scenario.overriding import place_of
from historysim.scenario.scenario import Scenario
from historysim.scenario.schema import reported
from historysim.scenario.sections import Sections

if TYPE_CHECKING:
    import xarray as xr

FAILURE = "failure"


def gathered(
    scenario: Scenario, grid: Grid, cells: Sequence["xr.Dataset | None"], reasons: Mapping[int, str]
) -> "xr.Dataset":
    """Return the cells of a grid as one Dataset.

    The cells are in the order of its points, None where one has failed, for which there is a reason by its position.
    What differs in length is filled up with NaN; the rows of an asperity stand under its index. Where all cells have
    failed, that is an InputError with the reason of the first.
    """
    import xarray as xr

    there = [cell for cell in cells if cell is not None]
    if not there:
        first = min(reasons)
        raise InputError(f"all of {counted(len(cells), 'cell', 'cells')} failed; the first: {reasons[first]}")
    swept = swept_coordinates(scenario, grid)
    labels = _labels(there)
    # positions, say, are told of some surfaces only
    names = dict.fromkeys(str(name) for cell in there for name in cell.variables if name not in labels)
    variables = {name: _stacked(name, grid, cells, labels) for name in names}
    own = [name for name in names if any(name in cell.coords for cell in there)]
    steps = {"asperity": xr.Variable("asperity", labels["asperity"], there[0]["asperity"].attrs)} if labels else {}
    data = {name: variable for name, variable in variables.items() if name not in own}
    if reasons:
        texts = np.array([reasons.get(index, "") for index in range(len(cells))]).reshape(grid.shape)
        data[FAILURE] = xr.Variable(
            _dimensions(grid), texts, {"long_name": "why the cell has failed, empty where it has not"}, {"dtype": "S1"}
        )
    coordinates = swept | steps | {name: variables[name] for name in own}
    return xr.Dataset(data, coordinates, _attributes(scenario, grid, there))


def unlike(cells: "Mapping[int, xr.Dataset]") -> dict[int, str]:
    """Return why cells cannot stand beside the first, by position: one of their quantities goes over something else."""
    if not cells:
        return {}
    over = {name: variable.dims for name, variable in cells[min(cells)].variables.items()}
    return {
        index: (
            f"{name} has the dimensions {_words(own)}, and in cells before {_words(over[name])}; sweep them separately"
        )
        for index, cell in sorted(cells.items())
        for name, variable in cell.variables.items()
        if (own := variable.dims) != over.get(name, own)
    }


def _words(dims: Sequence[Hashable]) -> str:
    return " and ".join(map(str, dims)) or "nothing"


def _dimensions(grid: Grid) -> tuple[str, ...]:
    return tuple(axis.name for axis in grid.axes)


def _labels(there: Sequence["xr.Dataset"]) -> dict[Any, Any]:
    """Return the indices of all asperities of which there are rows, none where there are none."""
    own = [cell["asperity"].values for cell in there if "asperity" in cell.coords]
    return {"asperity": np.unique(np.concatenate(own))} if own else {}


def _stacked(name: str, grid: Grid, cells: Sequence["xr.Dataset | None"], labels: Mapping[Any, Any]) -> "xr.Variable":
    """Return a variable of all cells; a coordinate that is the same in all stands there once."""
    import xarray as xr

    there = {index: cell for index, cell in enumerate(cells) if cell is not None}
    own = {index: cell.variables[name] for index, cell in there.items() if name in cell.variables}
    first = min(own)
    model = own[first]
    longest = map(max, zip(*(variable.shape for variable in own.values()), strict=True))
    shape = tuple(
        labels[dim].size if dim in labels else length for dim, length in zip(model.dims, longest, strict=True)
    )
    everywhere = len(own) == len(there)
    if name in there[first].coords and everywhere and _same(list(own.values())):
        return model
    whole = len(own) == len(cells) and all(variable.shape == shape for variable in own.values())
    # what is filled up needs a NaN
    values = np.full((len(cells), *shape), 0 if whole else np.nan, dtype=model.dtype if whole else np.float64)
    for index, variable in own.items():
        where = (
            np.searchsorted(labels[dim], there[index][dim].values) if dim in labels else np.arange(length)
            for dim, length in zip(variable.dims, variable.shape, strict=True)
        )
        values[index, ...][np.ix_(*where)] = variable.values
    dims = (*_dimensions(grid), *map(str, model.dims))
    # flags have the type of what they are flags of
    flags = {key: value.astype(values.dtype) for key, value in model.attrs.items() if key == "flag_values"}
    return xr.Variable(
        dims, values.reshape((*grid.shape, *shape)), model.attrs | flags, {"_FillValue": None} if whole else {}
    )


def _same(variables: "Sequence[xr.Variable]") -> bool:
    return all(np.array_equal(variables[0].values, other.values) for other in variables[1:])


def swept_coordinates(scenario: Scenario, grid: Grid) -> dict[str, "xr.Variable"]:
    """Return the swept quantities, with their units, along the dimensions of a grid.

    A key or a value that the scenario does not take is an InputError that names the key.
    """
    import xarray as xr

    sections = scenario.at(next(grid.points())).sections
    coordinates: dict[str, xr.Variable] = {}
    for axis in grid.axes:
        for key, *written in zip(axis.keys, *axis.values, strict=True):
            unit = unit_of(sections, key)
            with reported(scenario.path.name), at(*place_of(key)):
                values = [quantity(value, unit) if unit and not isinstance(value, list) else value for value in written]
            attributes = {"long_name": f"{key} of the scenario", **({"units": unit} if unit else {})}
            coordinates[variable_name(key)] = xr.Variable(axis.name, _column(values), attributes, {"_FillValue": None})
    return coordinates


def _column(values: list[Any]) -> npt.NDArray[Any]:
    """Return the values of a coordinate: numbers, or else texts."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array(values)
    return np.array([value if isinstance(value, str) else _text(value) for value in values])


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_text(item)}' for key, item in value.items())} }}"
    return f"[{', '.join(map(_text, value))}]" if isinstance(value, list | tuple) else str(value)


def unit_of(sections: Sections, key: str) -> str:
    """Return the unit in SI of what a key holds, empty where it has none."""
    here: Any = sections
    unit = ""
    for step in place_of(key):
        if isinstance(step, int):
            here = here[step]
            continue
        # a surface may have keys that change it, and friction may be a law
        while step not in _fields(here) and "of" in _fields(here):
            here = here.of
        if step not in _fields(here):
            return ""
        unit = unit_in(_fields(here)[step].type)
        here = getattr(here, step)
    return unit


def _fields(section: Any) -> Mapping[str, "attrs.Attribute[Any]"]:  # noqa: ANN401 - a section, or a value
    return attrs.fields_dict(type(section)) if attrs.has(type(section)) else {}


def _attributes(scenario: Scenario, grid: Grid, there: Sequence["xr.Dataset"]) -> dict[str, Any]:
    return {
        "Conventions": CONVENTIONS,
        "title": scenario.title or f"Sweep of {scenario.path.name}",
        "summary": f"What {counted(len(grid), 'load history', 'load histories')} of a frictional contact led to.",
        "keywords": KEYWORDS,
        **scenario.metadata,
        "content": CONTENT,
        "source": f"historysim {__version__}: exact traction memory of Hertz-Mindlin asperities",
        "history": f"{counted(len(grid), 'cell', 'cells')} computed by historysim {__version__}",
        "historysim_version": __version__,
        "made_with": made_with(),
        "scenario": scenario.text,
        "swept_keys": " ".join(key for axis in grid.axes for key in axis.keys),
        ATTRIBUTE: findings.written(warnings(there)),
        "complete": np.int8(1),
    }


def warnings(cells: Sequence["xr.Dataset"]) -> tuple[findings.Finding, ...]:
    """Return which assumptions of the model do not hold in some cells: each at its worst, with the number of cells."""
    by_name: dict[str, list[findings.Finding]] = {}
    for cell in cells:
        for finding in findings.read(cell.attrs.get(ATTRIBUTE, "[]")):
            by_name.setdefault(finding.name, []).append(finding)
    worst = [(max(own, key=_excess), len(own)) for own in by_name.values()]
    return tuple(
        attrs.evolve(finding, text=f"in {count:,} of {counted(len(cells), 'cell', 'cells')}; at worst: {finding.text}")
        for finding, count in worst
    )


def _excess(finding: findings.Finding) -> float:
    """Return how far beyond its limit, above or below, a finding is."""
    low, high = sorted((abs(finding.value), abs(finding.limit)))
    return high / low if low else np.inf
