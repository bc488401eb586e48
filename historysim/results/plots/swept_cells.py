"""Lines of a picture: histories, or the cells of a sweep that have rows, each with what it is called."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.units import quantity
from historysim.basics.wording import counted, nearest
from historysim.errors import InputError
from historysim.results import analysis
from historysim.results.analysis.recorded import is_complete
from historysim.results.plots.line_styles import MOST_LINES
from historysim.results.plots.words import OF_A_SCENARIO, member_text, name_of, symbol_of


@attrs.frozen(eq=False)
class Cell:
    """One line: its rows along ``step``, what it is called, and δ [m] and W [J] where they are known."""

    rows: xr.Dataset
    label: str = ""
    reach: float | None = None
    work: float | None = None


def cells_of(
    what: xr.Dataset | Sequence[xr.Dataset],
    names: Sequence[str],
    labels: Sequence[str] = (),
    where: Mapping[str, Any] | None = None,
) -> list[Cell]:
    """Return histories, or the cells of a sweep, as lines.

    Parameters
    ----------
    what : xarray.Dataset or sequence of them
    names : sequence of str
        Variables along ``step`` that each has to have.
    labels : sequence of str, optional
        One for each line.
    where : dict, optional
        Of a sweep, values of swept keys.

    Raises
    ------
    InputError
        Variables that are not there, labels or values that do not fit, no lines, or more than can be told apart.
    """
    several = [what] if isinstance(what, xr.Dataset) else list(what)
    found: list[Cell] = []
    for each in several:
        missing = [name for name in names if name not in each or "step" not in each[name].dims]
        if missing:
            raise InputError(
                f"there is no {missing[0]} along step; expected histories, or a sweep with {' and '.join(names)} among "
                "its outputs"
            )
        found += _of_sweep(selected(each, where), names[0]) if len(each[names[0]].dims) > 1 else [_of_history(each)]
    if len(several) > 1 and len({cell.label for cell in found}) < len(found):
        # results of one title are told apart by their files
        sources = [Path(str(each.encoding.get("source", ""))).name for each in several]
        names_of = [source or f"result {number + 1}" for number, source in enumerate(sources)]
        found = [attrs.evolve(cell, label=name) for cell, name in zip(found, names_of, strict=False)]
    if labels and len(labels) != len(found):
        raise InputError(f"labels has {len(labels)}; expected one for each of {counted(len(found), 'line', 'lines')}")
    if len(several) == len(found) == 1:
        # one line alone needs no name
        found = [attrs.evolve(found[0], label="")]
    if labels:
        found = [attrs.evolve(cell, label=label) for cell, label in zip(found, labels, strict=True)]
    if not 1 <= len(found) <= MOST_LINES:
        raise InputError(
            f"{len(found)} lines in one picture; expected 1 to {MOST_LINES}: choose some (where), or sweep fewer"
        )
    return found


def selected(sweep: xr.Dataset, where: Mapping[str, Any] | None) -> xr.Dataset:
    """Return the cells of a sweep that have these values of swept keys, or of its coordinates.

    Raises
    ------
    InputError
        A key that was not swept, or a value that it does not have.
    """
    for key, value in (where or {}).items():
        known = {
            str(values.attrs.get("long_name", name)).removesuffix(OF_A_SCENARIO): str(name)
            for name, values in sweep.coords.items()
            if values.ndim == 1 and name not in {"time", "asperity"}
        }
        if key not in known and key not in sweep.coords:
            raise InputError(f"where: {key!r} was not swept; {nearest(key, known)}")
        values = sweep[known.get(key, key)]
        (dimension,) = values.dims
        wanted = np.atleast_1d(np.asarray(value, dtype=object)).tolist()
        unit = str(values.attrs.get("units", "1"))
        numbers = values.dtype.kind in "fiu"
        places = [_place(values, key, quantity(one, unit) if numbers else str(one)) for one in wanted]
        sweep = sweep.isel({dimension: places if isinstance(value, list | tuple) else places[0]})
    return sweep


def _place(values: xr.DataArray, key: str, value: float | str) -> int:
    own = values.values
    same = np.isclose(own, value, rtol=1e-9, atol=0) if values.dtype.kind in "fiu" else own == value
    there = np.flatnonzero(same)
    if not there.size:
        raise InputError(f"where: {key} has no value {value}; expected one of {', '.join(map(str, own))}")
    return int(there[0])


def _of_history(history: xr.Dataset) -> Cell:
    label = str(history.attrs.get("title", ""))
    if not is_complete(history):
        return Cell(history, label)
    peak = history.isel(step=[int(history["total_normal_load"].values.argmax())])
    reach, work = analysis.preliminary_displacement(peak), analysis.presliding_work(peak)
    return Cell(history, label, float(reach[0]), float(work[0]))


def _of_sweep(sweep: xr.Dataset, name: str) -> list[Cell]:
    dims = [str(dim) for dim in sweep[name].dims if dim != "step"]
    several = [dim for dim in dims if sweep.sizes[dim] > 1]
    found = []
    for place in itertools.product(*(range(sweep.sizes[dim]) for dim in dims)):
        at = dict(zip(dims, place, strict=True))
        rows = sweep.isel(at)
        own = rows[[each for each in rows.data_vars if rows[each].dims == ("step",)]]
        # cells of fewer steps end with NaN, and those that have failed are nothing else
        there = np.isfinite(own[name].values)
        if not there.any():
            continue
        own = own.isel(step=there)
        reach, work = (
            float(rows[each]) if each in rows else None for each in ("preliminary_displacement", "presliding_work")
        )
        found.append(Cell(own, ", ".join(cell_label(sweep, dim, at[dim]) for dim in several), reach, work))
    return found


def cell_label(sweep: xr.Dataset, dimension: str, member: int) -> str:
    """Return what a member of a swept dimension is called: ``"silica"``, ``"β = 20 µm"``, ``"surface 3"``."""
    text = member_text(sweep, dimension, member)
    if dimension not in sweep.coords or sweep[dimension].dtype.kind not in "fiu":
        return text
    sign = symbol_of(sweep, dimension)
    return f"{sign} = {text}" if sign.startswith("$") else f"{name_of(sweep, dimension)} {text}"
