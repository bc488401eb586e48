"""Design studies: what a texture, a contact or a finish does to the preliminary displacement.

Each is one call that makes a scenario and sweeps over it; the attribute ``scenario`` of the Dataset holds it, so that
``historysim sweep`` makes the same again. Quantities are in SI, or strings with a unit (``"50 mN"``): ``normal_load`` F
of all asperities together [N], ``radius`` R of one [m], ``pitch`` from one to the next [m], ``friction`` μ.
*Quantities* may be several, an array or a range as in ``[sweep.over]``, which become a dimension. ``**options`` are
``workers``, ``executor``, ``store``, ``progress`` and ``notify`` of `historysim.sweep`. A value that cannot be used is
an InputError with its key.

Along ``surface_seed`` each number also has ``NAME_mean``, ``NAME_standard_deviation`` and ``NAME_quantile``, as by
`historysim.spread`. Figures and sections are those of Winogrodzka's thesis.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import attrs
import xarray as xr

from historysim.contact.materials import Material, MaterialPair
from historysim.errors import InputError, at
from historysim.scenario.grid import expand, place_of, plain, with_values
from historysim.scenario.scenario import scenario_of
from historysim.scenario.schema import reported
from historysim.studies.sweep import sweep
from historysim.studies.sweep_table import spread

__all__ = ["equal_asperities", "radius_load_friction", "roughness", "texture_tolerances"]


def __dir__() -> list[str]:
    return __all__


Quantity = float | str  # A value in SI, or a string with a unit
# A value, or several: an array, or a range as in ``[sweep.over]``.
Quantities = Quantity | Iterable[Quantity] | Mapping[str, Any]
Seeds = Iterable[int] | Mapping[str, Any]
WAYPOINTS = [{"time": 0.0}, {"time": 1.0}]
LOAD, LATER_LOAD = (f"loading.waypoints[{number}].normal_load" for number in range(len(WAYPOINTS)))
FRICTION = "friction.coefficient"
NOT_IN_A_SCENARIO = ("roughness", "ball_radius", "source")  # of a material: what changes no contact


def equal_asperities(
    pair: MaterialPair,
    *,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    pitch: Quantity,
    count: Iterable[tuple[int, int]] | tuple[int, int] = ((1, 1), (2, 2), (4, 4), (8, 8)),
    scaling: str | Iterable[str] = ("self-similar", "curvature-invariant"),
    **options: Any,
) -> xr.Dataset:
    """Return what n equal asperities in place of one do, which carry F/n each.

    By ``"self-similar"`` scaling each has the radius R/√n, and the preliminary displacement falls as n^(-1/2); by
    ``"curvature-invariant"`` scaling each keeps R, and it falls as n^(-2/3), while the contact area grows as n^(1/3).

    The radius is that of the one asperity that they replace. ``count`` is (nx, ny), or several of them, and becomes the
    dimension ``asperity_count``, n; the pitch changes warnings alone. The Dataset has ``preliminary_displacement``,
    ``peak_approach`` [m] and ``peak_contact_area`` [m²]: section 6.2.1, Fig. 6.4, with the load per contact F/n.
    """
    surface = {"kind": "textured", "pitch": pitch}
    values = {"surface.scaling": scaling, "surface.radius": radius, FRICTION: friction, LOAD: normal_load}
    outputs = ("preliminary_displacement", "peak_contact_area", "peak_approach")
    title = "equal_asperities: n equal asperities in place of one"
    table = _swept(title, pair, surface, values | {"surface.count": count}, outputs=outputs, **options)
    if "surface_count" not in table.dims:
        return table
    numbers = [math.prod(json.loads(pair)) for pair in table["surface_count"].values]
    along = ("surface_count", numbers, {"long_name": "number of asperities", "units": "1"})
    return table.assign_coords(asperity_count=along).swap_dims(surface_count="asperity_count")


def texture_tolerances(  # noqa: PLR0913 - the keys of a scenario
    pair: MaterialPair,
    *,
    count: tuple[int, int],
    pitch: Quantity,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    height_scatter: Quantities,
    radius_scatter: float | Iterable[float] = 0.0,
    seeds: Seeds = range(1, 11),
    **options: Any,
) -> xr.Dataset:
    """Return what scatter of heights and radii does to a texture of ``count`` (nx, ny) asperities, over seeds.

    Scatters are the standard deviation of the Gaussian heights [m], and that of the log-normal radii over their mean.
    The Dataset has ``preliminary_displacement`` [m] and ``peak_contact_count`` along ``surface_seed``. Sections 6.2 and
    7.3: equal radii and heights are asked for.
    """
    surface = {"kind": "textured", "count": count, "pitch": pitch}
    scatter = {"surface.height_scatter": height_scatter, "surface.radius_scatter": radius_scatter}
    values = {**scatter, "surface.radius": radius, FRICTION: friction, LOAD: normal_load, "surface.seed": seeds}
    title = "texture_tolerances: scatter of heights and radii of a texture"
    return _swept(title, pair, surface, values, outputs=("preliminary_displacement", "peak_contact_count"), **options)


def radius_load_friction(
    pair: MaterialPair,
    *,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    later_load: Quantities | None = None,
    **options: Any,
) -> xr.Dataset:
    """Return the preliminary displacement of one contact, which goes as R^(-1/3) N^(2/3) μ, and how it drifts.

    The Dataset has ``preliminary_displacement`` [m] at the greater of the two loads; with a ``later_load``, to which
    the load changes [N], also ``drift``, |δ2 - δ1| [m], and ``branch_drift`` [m], by how much the backward branch is
    off the 2 δ1 that it should take. Section 6.2.1, Figs. 6.5 (radius), 6.6 (load) and 6.7 (friction).
    """
    values = {"surface.radius": radius, FRICTION: friction, LOAD: normal_load}
    outputs = ["preliminary_displacement"]
    if later_load is not None:
        values, outputs = {**values, LATER_LOAD: later_load}, [*outputs, "drift", "branch_drift"]
    title = "radius_load_friction: one contact of other radius, load and friction"
    return _swept(title, pair, {"kind": "sphere"}, values, outputs=outputs, **options)


def roughness(
    pair: MaterialPair,
    *,
    rms_height: Quantities,
    autocorrelation_length: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    shape: tuple[int, int] = (256, 256),
    pixel_size: Quantity = "1 µm",
    seeds: Seeds = range(1, 21),
    **options: Any,
) -> xr.Dataset:
    """Return what random surfaces of other roughness and autocorrelation length do, over random seeds.

    The maps have ``shape`` points (nx, ny), ``pixel_size`` apart [m], Gaussian heights of ``rms_height`` Rq [m], and an
    exponential autocorrelation that falls to 0.1 at ``autocorrelation_length`` [m]; summits are those of the 9-point
    rule. The Dataset has ``preliminary_displacement`` [m], ``presliding_work`` [J], ``peak_contact_count`` and
    ``peak_contact_area`` [m²] along ``surface_seed``. Figs. 5.9 to 5.13, 6.9 and 6.10.
    """
    surface = {"kind": "random", "shape": shape, "pixel_size": pixel_size}
    finish = {"surface.rms_height": rms_height, "surface.autocorrelation_length": autocorrelation_length}
    values = {**finish, FRICTION: friction, LOAD: normal_load, "surface.seed": seeds}
    outputs = ("preliminary_displacement", "presliding_work", "peak_contact_count", "peak_contact_area")
    return _swept("roughness: random surfaces of other roughness", pair, surface, values, outputs=outputs, **options)


def _swept(
    title: str,
    pair: MaterialPair,
    surface: Mapping[str, Any],
    values: Mapping[str, Any],
    *,
    outputs: Sequence[str],
    **options: Any,
) -> xr.Dataset:
    """Return the sweep of a study (``NAME: what it is``) over those values of which there are several.

    Its numbers have their spread over seeds beside them.
    """
    name, _, what = title.partition(": ")
    if not isinstance(pair, MaterialPair):
        raise InputError(f"{name}: pair is {pair!r}; expected a MaterialPair of two materials, or from_moduli")
    first, several = dict(values), dict[str, list[Any]]()
    for key, value in values.items():
        if _is_several(value, of_pairs=key == "surface.count"):
            with reported(name), at(*place_of(key)):
                several[key] = expand(value)
            first[key] = several[key][0]
    # a sweep has a dimension at least; where one value of each is given it goes again
    over = several or {key: [value] for key, value in list(values.items())[:1]}
    head, materials = _materials(pair)
    tables = {
        "title": f"{head}: {what}",
        "materials": materials,
        "surface": surface,
        "friction": {},
        "loading": {"waypoints": WAYPOINTS if LATER_LOAD in values else WAYPOINTS[:1]},
        "sweep": {"outputs": outputs, "over": over},
    }
    with reported(name):
        document = with_values(plain(tables), first)
    table = sweep(scenario_of(document, name), **options)
    if "surface_seed" in table.dims:
        table = table.assign(spread(table).data_vars)
    return table if several else table.squeeze()


def _materials(pair: MaterialPair) -> tuple[str, dict[str, Any]]:
    """Return what a pair is called, and its table; a work of adhesion, which changes nothing, is not in it."""

    def given(of: object, keys: Iterable[str]) -> dict[str, Any]:
        return {key: value for key in keys if (value := getattr(of, key)) is not None}

    if pair.first is None or pair.second is None:
        return "Given moduli", given(pair, ("contact_modulus", "shear_modulus", "hardness", "yield_stress"))
    fields = [field.name for field in attrs.fields(Material) if field.name not in NOT_IN_A_SCENARIO]
    both = {"first": given(pair.first, fields), "second": given(pair.second, fields)}
    return f"{pair.first.name} on {pair.second.name}", both


def _is_several(value: Any, *, of_pairs: bool = False) -> bool:
    """Return whether a value is an array or a range; of pairs (nx, ny), whether there are several."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if not isinstance(value, Iterable) or isinstance(value, str):
        return False
    return not of_pairs or isinstance(value, Mapping) or all(_is_several(one) for one in value)
