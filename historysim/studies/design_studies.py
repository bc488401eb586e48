"""Design studies: what a texture, a contact or a finish does to the preliminary displacement, and which one is wanted.

Each is one call that makes a scenario and sweeps over it; the attribute ``scenario`` of the Dataset holds it, so that
``historysim sweep`` or ``historysim design`` makes the same again. Quantities are in SI, or strings with a unit
(``"50 mN"``). A *Quantities* parameter also takes several values, an array or a range as in ``[sweep.over]``, which
become a dimension. ``**options`` are ``workers``, ``executor``, ``store``, ``progress`` and ``notify`` of
`historysim.sweep`. A value that cannot be used is an InputError with its key.

Along ``surface_seed`` each number also has ``NAME_mean``, ``NAME_standard_deviation`` and ``NAME_quantile``, as by
`historysim.spread`. Figures and sections are those of Winogrodzka's thesis.
"""

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import attrs

from historysim.basics.notices import Notify
from historysim.basics.places import at
from historysim.basics.units import quantity
from historysim.basics.wording import nearest
from historysim.contact.materials import Material, MaterialPair
from historysim.errors import InputError
from historysim.scenario.grid import expand, place_of, plain, with_values
from historysim.scenario.scenario import Scenario, scenario_of
from historysim.scenario.schema import reported
from historysim.studies.design import design
from historysim.studies.sweep import sweep
from historysim.studies.sweep_table import spread

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "equal_asperities",
    "finish_for_a_drift",
    "nominal_area",
    "one_large_asperity",
    "radius_load_friction",
    "roughness",
    "texture_for_a_drift",
    "texture_tolerances",
]


def __dir__() -> list[str]:
    return sorted(__all__)


Quantity = float | str
"""A value in SI, or a string with a unit."""
Quantities = Quantity | Iterable[Quantity] | Mapping[str, Any]
"""A value, or several: an array, or a range as in ``[sweep.over]``."""
Seeds = Iterable[int] | Mapping[str, Any]
Pair = tuple[Quantity, Quantity]
ONCE, TWICE = ({"friction": {}, "loading": {"waypoints": [{"time": float(time)} for time in range(n)]}} for n in (1, 2))
"""Loads that are reached once, or one after the other."""
LOAD, LATER_LOAD = (f"loading.waypoints[{number}].normal_load" for number in (0, 1))
OF_PAIRS = ("surface.count", "surface.shape")
FRICTION = "friction.coefficient"
STANDING = ("ground", "level")
NOT_IN_A_SCENARIO = ("roughness", "ball_radius", "source")
"""Of a material: what changes no contact."""
OF_ROUGHNESS = ("preliminary_displacement", "presliding_work", "peak_contact_count", "peak_contact_area")


class DesignOptions(TypedDict, total=False):
    """How a search is carried out, as for `historysim.design`."""

    workers: int
    executor: Any
    progress: bool
    notify: Notify


class SweepOptions(DesignOptions, total=False):
    """How a sweep is carried out, as for `historysim.sweep`."""

    store: str | os.PathLike[str] | None


def equal_asperities(
    pair: MaterialPair,
    *,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    pitch: Quantity,
    count: Iterable[tuple[int, int]] | tuple[int, int] = ((1, 1), (2, 2), (4, 4), (8, 8)),
    scaling: str | Iterable[str] = ("self-similar", "curvature-invariant"),
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return what n equal asperities in place of one do, which carry F/n each.

    By ``"self-similar"`` scaling each has the radius R/√n, and the preliminary displacement falls as n^(-1/2); by
    ``"curvature-invariant"`` scaling each keeps R, and it falls as n^(-2/3), while the contact area grows as n^(1/3).

    Parameters
    ----------
    radius, normal_load
        R of the one asperity that they replace [m], F of all together [N].
    pitch
        Distance from one to the next [m], which changes warnings alone.
    count : (nx, ny) or several of them
        Their numbers along x and y, with the dimension ``asperity_count``, n.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement``, ``peak_approach`` [m] and ``peak_contact_area`` [m²]. Section 6.2.1, Fig. 6.4,
        with the load per contact F/n.
    """
    tables = {"surface": {"kind": "textured", "pitch": pitch}, **ONCE}
    values = {"surface.scaling": scaling, "surface.radius": radius, FRICTION: friction, LOAD: normal_load}
    outputs = ("preliminary_displacement", "peak_contact_area", "peak_approach")
    title = "equal_asperities: n equal asperities in place of one"
    table = _swept(title, pair, tables, values | {"surface.count": count}, outputs=outputs, **options)
    return _over_products(table, "surface_count", "asperity_count", long_name="number of asperities", units="1")


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
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return what scatter of heights and radii does to a texture of ``count`` (nx, ny) asperities, over seeds.

    Parameters
    ----------
    pitch, radius, normal_load
        Distance from one to the next [m], R of each [m], F of all together [N].
    height_scatter
        Standard deviation of the Gaussian heights [m].
    radius_scatter
        Standard deviation of the log-normal radii over their mean.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m] and ``peak_contact_count`` along ``surface_seed``. Sections 6.2 and 7.3: equal
        radii and heights are asked for.
    """
    tables = {"surface": {"kind": "textured", "count": count, "pitch": pitch}, **ONCE}
    scatter = {"surface.height_scatter": height_scatter, "surface.radius_scatter": radius_scatter}
    values = {**scatter, "surface.radius": radius, FRICTION: friction, LOAD: normal_load, "surface.seed": seeds}
    title = "texture_tolerances: scatter of heights and radii of a texture"
    return _swept(title, pair, tables, values, outputs=("preliminary_displacement", "peak_contact_count"), **options)


def one_large_asperity(
    pair: MaterialPair,
    *,
    count: int,
    radius: Quantity,
    large_radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    standing: str = "ground",
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return what one asperity of another radius does among ``count`` asperities.

    At the level of the others it hardly counts; standing out it decides: alone, its preliminary displacement is
    θμ (9 F²/(16 E*² R))^(1/3).

    Parameters
    ----------
    radius, large_radius, normal_load
        R of the others [m], that of the first [m], F of all together [N].
    standing : {"ground", "level"}
        All are half balls on one plane, so that each is as high as its radius; or all summits are equally high.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m], ``critical_asperity`` and ``peak_contact_count`` along ``surface_radius_0``,
        with ``surface_height_0`` beside it on the ground. Section 6.2.1, Fig. 6.2 b.
    """
    name = "one_large_asperity"
    if standing not in STANDING:
        raise InputError(f"{name}: standing is {standing!r}; {nearest(str(standing), STANDING)}")
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError(f"{name}: count is {count!r}; expected a whole number of 1 or more")
    values: dict[str, Any] = {"surface.radius[0]": large_radius, FRICTION: friction, LOAD: normal_load}
    several, together = _is_several(large_radius), []
    if standing == "ground":
        with at(name, "radius"):
            others = quantity(radius, "m")
        with at(name, "large_radius"):
            each: list[Any] = expand(large_radius) if several else [large_radius]
            heights = [quantity(one, "m") - others for one in each]
        values["surface.height[0]"] = heights if several else heights[0]
        together = [["surface.radius[0]", "surface.height[0]"]] if several else []
    tables = {"surface": {"kind": "summits", "height": [0.0] * count, "radius": [radius] * count}, **ONCE}
    outputs = ("preliminary_displacement", "critical_asperity", "peak_contact_count")
    title = f"{name}: one asperity of another radius among {count}"
    return _swept(title, pair, tables, values, outputs=outputs, together=together, **options)


def radius_load_friction(
    pair: MaterialPair,
    *,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    later_load: Quantities | None = None,
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return the preliminary displacement of one contact, which goes as R^(-1/3) N^(2/3) μ, and how it drifts.

    Parameters
    ----------
    radius, normal_load, later_load
        R [m], N [N], and the load to which it changes [N].

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m] at the greater of the two loads; with a later load also ``drift``, |δ2 - δ1|
        [m], and ``branch_drift`` [m], by how much the backward branch is off the 2 δ1 that it should take. Section
        6.2.1, Figs. 6.5 (radius), 6.6 (load) and 6.7 (friction).
    """
    values = {"surface.radius": radius, FRICTION: friction, LOAD: normal_load}
    loading, outputs = ONCE, ["preliminary_displacement"]
    if later_load is not None:
        loading, values = TWICE, {**values, LATER_LOAD: later_load}
        outputs += ["drift", "branch_drift"]
    title = "radius_load_friction: one contact of other radius, load and friction"
    return _swept(title, pair, {"surface": {"kind": "sphere"}, **loading}, values, outputs=outputs, **options)


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
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return what random surfaces of other roughness and autocorrelation length do, over random seeds.

    Parameters
    ----------
    rms_height, autocorrelation_length, normal_load
        Rq of the Gaussian heights [m], β, at which the exponential autocorrelation falls to 0.1 [m], N [N].
    shape, pixel_size
        Points (nx, ny) of the map, and their distance in m. Summits are found by the 9-point rule.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m], ``presliding_work`` [J], ``peak_contact_count`` and ``peak_contact_area`` [m²]
        along ``surface_seed``. Figs. 5.9 to 5.13, 6.9 and 6.10.
    """
    tables = {"surface": {"kind": "random", "shape": shape, "pixel_size": pixel_size}, **ONCE}
    finish = {"surface.rms_height": rms_height, "surface.autocorrelation_length": autocorrelation_length}
    values = {**finish, FRICTION: friction, LOAD: normal_load, "surface.seed": seeds}
    title = "roughness: random surfaces of other roughness"
    return _swept(title, pair, tables, values, outputs=OF_ROUGHNESS, **options)


def nominal_area(
    pair: MaterialPair,
    *,
    shape: Iterable[tuple[int, int]],
    rms_height: Quantities,
    autocorrelation_length: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    pixel_size: Quantity = "1 µm",
    seeds: Seeds = range(1, 21),
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return what one finish does on larger and larger faces under one load.

    ``shape`` are several (nx, ny), with the dimension ``nominal_area`` [m²]; all else is as for `roughness`.
    """
    with at("nominal_area", "pixel_size"):
        pixel = quantity(pixel_size, "m")
    tables = {"surface": {"kind": "random", "pixel_size": pixel_size}, **ONCE}
    finish = {"surface.rms_height": rms_height, "surface.autocorrelation_length": autocorrelation_length}
    values = {"surface.shape": shape, **finish, FRICTION: friction, LOAD: normal_load, "surface.seed": seeds}
    table = _swept(
        "nominal_area: one finish on larger and larger faces", pair, tables, values, outputs=OF_ROUGHNESS, **options
    )
    return _over_products(table, "surface_shape", "nominal_area", pixel**2, long_name="nominal area", units="m2")


def finish_for_a_drift(  # noqa: PLR0913 - the keys of a scenario
    pair: MaterialPair,
    *,
    drift: Quantity,
    normal_load: Pair,
    friction: float,
    autocorrelation_length: Quantity,
    between: Pair = ("1 nm", "1 µm"),
    shape: tuple[int, int] = (256, 256),
    pixel_size: Quantity = "1 µm",
    seeds: Seeds = range(1, 21),
    **options: Unpack[DesignOptions],
) -> "xr.Dataset":
    """Return the rms height at which the preliminary displacement of random surfaces drifts by so much.

    Parameters
    ----------
    drift, normal_load
        |δ2 - δ1| that is wanted [m], the first and the second load [N].
    between : (least, greatest)
        The rms heights among which it is sought, for each seed [m]; all else is as for `roughness`.

    Returns
    -------
    xarray.Dataset
        ``surface_rms_height`` [m] along ``surface_seed``, ``drift`` there, and ``drift_at_median``, as from
        `historysim.design`.
    """
    map_keys = {"shape": shape, "pixel_size": pixel_size, "autocorrelation_length": autocorrelation_length}
    surface = {"kind": "random", **map_keys, "seed": seeds}
    wanted = {"key": "surface.rms_height", "between": between, "target": drift}
    title = "finish_for_a_drift: the finish for a drift"
    return _designed(title, pair, surface, friction=friction, normal_load=normal_load, wanted=wanted, **options)


def texture_for_a_drift(  # noqa: PLR0913 - the keys of a scenario
    pair: MaterialPair,
    *,
    drift: Quantity,
    normal_load: Pair,
    friction: float,
    count: tuple[int, int],
    pitch: Quantity,
    between: Pair,
    height_scatter: Quantity = 0.0,
    radius_scatter: float = 0.0,
    seeds: Seeds = (1,),
    **options: Unpack[DesignOptions],
) -> "xr.Dataset":
    """Return the radius of the asperities of a texture at which its preliminary displacement drifts by so much.

    Parameters
    ----------
    drift, normal_load, between
        As for `finish_for_a_drift` [m], [N], with radii [m]; the texture is as for `texture_tolerances`.

    Returns
    -------
    xarray.Dataset
        ``surface_radius`` [m] along ``surface_seed``, ``drift`` there, and ``drift_at_median``, as from
        `historysim.design`.
    """
    scatter = {"height_scatter": height_scatter, "radius_scatter": radius_scatter}
    surface = {"kind": "textured", "count": count, "pitch": pitch, **scatter, "seed": seeds}
    wanted = {"key": "surface.radius", "between": between, "target": drift}
    title = "texture_for_a_drift: the texture for a drift"
    return _designed(title, pair, surface, friction=friction, normal_load=normal_load, wanted=wanted, **options)


def _designed(
    title: str,
    pair: MaterialPair,
    surface: dict[str, Any],
    *,
    friction: float,
    normal_load: Pair,
    wanted: dict[str, Any],
    **options: Unpack[DesignOptions],
) -> "xr.Dataset":
    """Return the value of a key of the surface at which the drift from one load to the other is the wanted one."""
    name, _, _ = title.partition(":")
    for argument, ends in {"normal_load": normal_load, "between": wanted["between"]}.items():
        if not isinstance(ends, tuple | list) or len(ends) != 2:
            raise InputError(f"{name}: {argument}: {ends!r}; expected two values")
    with at(name, "seeds"):
        seeds = expand(surface["seed"])
    tables = {"surface": surface, **TWICE, "design": {**wanted, "over": {"surface.seed": seeds}}}
    values = {"surface.seed": seeds[0], wanted["key"]: wanted["between"][0], FRICTION: friction}
    return design(
        _scenario(title, pair, tables, {**values, LOAD: normal_load[0], LATER_LOAD: normal_load[1]}), **options
    )


def _swept(
    title: str,
    pair: MaterialPair,
    tables: Mapping[str, Any],
    values: Mapping[str, Any],
    *,
    outputs: Sequence[str],
    together: Sequence[Sequence[str]] = (),
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return the sweep of a study over those values of which there are several, with their spread over seeds."""
    name, _, _ = title.partition(":")
    several: dict[str, list[Any]] = {}
    for key, value in values.items():
        if _is_several(value, of_pairs=key in OF_PAIRS):
            with reported(name), at(*place_of(key)):
                several[key] = expand(value)
    # a sweep has a dimension at least; where one value of each is given it goes again
    over = several or {key: [value] for key, value in list(values.items())[:1]}
    section = {"outputs": list(outputs), "together": list(together), "over": over}
    first = {**values, **{key: own[0] for key, own in several.items()}}
    table = sweep(_scenario(title, pair, {**tables, "sweep": section}, first), **options)
    if "surface_seed" in table.dims:
        table = table.assign(spread(table).data_vars)
    return table if several else table.squeeze()


def _scenario(title: str, pair: MaterialPair, tables: Mapping[str, Any], values: Mapping[str, Any]) -> Scenario:
    """Return the scenario of a study (``NAME: what it is``) from its tables but ``[materials]``, and values by key."""
    name, _, what = title.partition(": ")
    if not isinstance(pair, MaterialPair):
        raise InputError(f"{name}: pair is {pair!r}; expected a MaterialPair of two materials, or from_moduli")
    materials: dict[str, Any] = _given(pair, ("contact_modulus", "shear_modulus", "hardness", "yield_stress"))
    head = "Given moduli"
    if pair.first is not None and pair.second is not None:
        fields = [field.name for field in attrs.fields(Material) if field.name not in NOT_IN_A_SCENARIO]
        materials = {"first": _given(pair.first, fields), "second": _given(pair.second, fields)}
        head = f"{pair.first.name} on {pair.second.name}"
    with reported(name):
        document = with_values(plain({"title": f"{head}: {what}", "materials": materials, **tables}), values)
    return scenario_of(document, name)


def _given(of: object, keys: Iterable[str]) -> dict[str, Any]:
    return {key: getattr(of, key) for key in keys if getattr(of, key) is not None}


def _is_several(value: object, *, of_pairs: bool = False) -> bool:
    """Return whether a value is an array or a range; of pairs (nx, ny), whether there are several."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if not isinstance(value, Iterable) or isinstance(value, str):
        return False
    return not of_pairs or isinstance(value, Mapping) or all(_is_several(one) for one in value)


def _over_products(
    table: "xr.Dataset", along: str, name: str, factor: float = 1, *, long_name: str, units: str
) -> "xr.Dataset":
    """Return a sweep over pairs, such as ``[4, 4]``, along their products times a factor in place of them."""
    if along not in table.dims:
        return table
    products = [math.prod(json.loads(pair)) * factor for pair in table[along].values]
    return table.assign_coords({name: (along, products, {"long_name": long_name, "units": units})}).swap_dims(
        {along: name}
    )
