"""What design studies share: from tables with several values under some keys to a sweep, its dimensions as numbers."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import attrs
import numpy as np

from historysim.basics.notices import Teller
from historysim.basics.places import at
from historysim.contact.materials import Material, MaterialPair
from historysim.errors import InputError
from historysim.scenario.grid import expand
from historysim.scenario.overriding import place_of, plain, with_values
from historysim.scenario.scenario import Scenario, scenario_of
from historysim.scenario.schema import reported
from historysim.studies.spread import spread
from historysim.studies.sweep import sweep

if TYPE_CHECKING:
    import xarray as xr

Quantity = float | str
"""A value in SI, or a text with a unit."""
Quantities = Quantity | Iterable[Quantity] | Mapping[str, Any]
"""A value, or several: an array, or a range as in ``[sweep.over]``; several become a dimension."""
Seeds = Iterable[int] | Mapping[str, Any]


class SweepOptions(TypedDict, total=False):
    """How a study is carried out, as for `historysim.sweep`."""

    workers: int
    executor: Any
    progress: bool
    tell: Teller


class StoredSweepOptions(SweepOptions, total=False):
    """The same, with a place where cells are kept."""

    store: str | os.PathLike[str] | None


def scenario_for(
    name: str, title: str, pair: MaterialPair, tables: Mapping[str, Any], values: Mapping[str, Any]
) -> Scenario:
    """Return the scenario of a study, from its tables but ``[materials]``, and further values by key.

    `name` is that of the function, which messages begin with. No pair, or a value that the scenario does not take, is
    an InputError.
    """
    if not isinstance(pair, MaterialPair):
        raise InputError(f"{name}: pair is {pair!r}; expected a MaterialPair of two materials, or from_moduli")
    head = f"{pair.first.name} on {pair.second.name}" if pair.first and pair.second else "Given moduli"
    document = {"title": f"{head}: {title}", "materials": _materials(pair), **tables}
    with reported(name):
        document = with_values(document, values)
    return scenario_of(document, name)


def swept(
    name: str,
    title: str,
    pair: MaterialPair,
    tables: Mapping[str, Any],
    values: Mapping[str, Any],
    *,
    outputs: Sequence[str],
    together: Sequence[Sequence[str]] = (),
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return the sweep of a study over those values of which there are several; parameters as above, and of a sweep."""
    several: dict[str, list[Any]] = {}
    for key, value in values.items():
        if is_several(value):
            with reported(name), at(*place_of(key)):
                several[key] = expand(value)
    # a sweep has a dimension at least; where one value of each is given it goes again
    over = several or {key: [value] for key, value in list(values.items())[:1]}
    section: dict[str, Any] = {"outputs": list(outputs)}
    if together:
        section["together"] = [list(keys) for keys in together]
    section["over"] = plain(over)
    first = {**values, **{key: own[0] for key, own in several.items()}}
    table = sweep(scenario_for(name, title, pair, {**tables, "sweep": section}, first), **options)
    return table if several else table.squeeze()


def is_several(value: object) -> bool:
    """Return whether a value is an array or a range."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return isinstance(value, Iterable) and not isinstance(value, str)


def with_spread(table: "xr.Dataset", along: str = "surface_seed") -> "xr.Dataset":
    """Return a sweep with mean, standard deviation and quantiles over a dimension, where it has it."""
    return table.assign(spread(table, along).data_vars) if along in table.dims else table


def over_numbers(
    table: "xr.Dataset", along: str, name: str, values: Sequence[float], *, long_name: str, units: str
) -> "xr.Dataset":
    """Return a sweep over arrays, such as ``[4, 4]``, whose dimension is a number that they stand for."""
    if along not in table.dims:
        return table
    number = (along, np.asarray(values), {"long_name": long_name, "units": units})
    return table.assign_coords({name: number}).swap_dims({along: name})


def _materials(pair: MaterialPair) -> dict[str, Any]:
    """Return the table of a pair; a work of adhesion, which changes nothing, is not in it."""
    if pair.first is not None and pair.second is not None:
        return {"first": _material(pair.first), "second": _material(pair.second)}
    limits = {"hardness": pair.hardness, "yield_stress": pair.yield_stress}
    known = {key: value for key, value in limits.items() if value is not None}
    return {"contact_modulus": pair.contact_modulus, "shear_modulus": pair.shear_modulus, **known}


def _material(material: Material) -> dict[str, Any]:
    elastic = ("name", "youngs_modulus", "poissons_ratio", "shear_modulus", "surface_energy")
    keys = (*elastic, "hardness", "yield_stress", "fracture_toughness")
    own = attrs.asdict(material)
    return {key: own[key] for key in keys if own[key] is not None}
