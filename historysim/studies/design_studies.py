"""Design studies: what a texture, a contact or a finish does to the preliminary displacement, and which one is wanted.

Each is one call that makes a scenario and sweeps over it; the attribute ``scenario`` of the Dataset holds it, so that
``historysim sweep`` or ``historysim design`` makes the same again. Quantities are in SI, or strings with a unit
(``"50 mN"``). A *Quantities* parameter also takes several values, an array or a range as in ``[sweep.over]``, which
become a dimension. ``**options`` are ``workers``, ``executor``, ``store``, ``progress`` and ``notify`` of
`historysim.sweep`. A value that cannot be used is an InputError with its key.
"""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from historysim.basics.notices import Notify
from historysim.basics.places import at
from historysim.basics.units import quantity
from historysim.basics.wording import nearest
from historysim.contact.materials import MaterialPair
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
SCALINGS = ("self-similar", "curvature-invariant")
STANDING = ("ground", "level")
OF_ROUGHNESS = ("preliminary_displacement", "presliding_work", "peak_contact_count", "peak_contact_area")
OF_A_MATERIAL = (
    *("name", "youngs_modulus", "poissons_ratio", "shear_modulus", "surface_energy"),
    *("hardness", "yield_stress", "fracture_toughness"),
)
LOADED_ONCE = {"friction": {}, "loading": {"waypoints": [{"time": 0.0}]}}
LOAD, LATER_LOAD = (f"loading.waypoints[{number}].normal_load" for number in (0, 1))
FRICTION = "friction.coefficient"


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
    scaling: str | Iterable[str] = SCALINGS,
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
        ``preliminary_displacement``, ``peak_approach`` [m] and ``peak_contact_area`` [m²]. Winogrodzka, section 6.2.1,
        Fig. 6.4, with the load per contact F/n.
    """
    counts = _shapes("equal_asperities", "count", count)
    several = all(isinstance(each, list) for each in counts)
    values = {
        "surface.scaling": scaling,
        "surface.radius": radius,
        FRICTION: friction,
        LOAD: normal_load,
        **({"surface.count": counts} if several else {}),
    }
    tables = _texture(pitch, counts[0] if several else counts)
    outputs = ("preliminary_displacement", "peak_contact_area", "peak_approach")
    title = "n equal asperities in place of one"
    table = _swept("equal_asperities", title, pair, tables, values, outputs=outputs, **options)
    numbers = [nx * ny for nx, ny in counts] if several else []
    return _over_numbers(table, "surface_count", "asperity_count", numbers, long_name="number of asperities", units="1")


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
        ``preliminary_displacement`` [m] and ``peak_contact_count`` along ``surface_seed``, and of each over the seeds
        ``NAME_mean``, ``NAME_standard_deviation``, ``NAME_quantile``, as by `historysim.spread`. Winogrodzka, sections
        6.2 and 7.3: equal radii and heights are asked for.
    """
    values = {
        "surface.height_scatter": height_scatter,
        "surface.radius_scatter": radius_scatter,
        "surface.radius": radius,
        FRICTION: friction,
        LOAD: normal_load,
        "surface.seed": seeds,
    }
    outputs = ("preliminary_displacement", "peak_contact_count")
    title = "scatter of heights and radii of a texture"
    tables = _texture(pitch, list(count))
    return _with_spread(_swept("texture_tolerances", title, pair, tables, values, outputs=outputs, **options))


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
        with ``surface_height_0`` beside it on the ground. Winogrodzka, section 6.2.1, Fig. 6.2 b.
    """
    name = "one_large_asperity"
    if standing not in STANDING:
        raise InputError(f"{name}: standing is {standing!r}; {nearest(str(standing), STANDING)}")
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError(f"{name}: count is {count!r}; expected a whole number of 1 or more")
    values: dict[str, Any] = {"surface.radius[0]": large_radius, FRICTION: friction, LOAD: normal_load}
    several = _is_several(large_radius)
    together = []
    if standing == "ground":
        with at(name, "radius"):
            others = quantity(radius, "m")
        with at(name, "large_radius"):
            each: list[Any] = expand(large_radius) if several else [large_radius]
            own = [quantity(one, "m") - others for one in each]
        values["surface.height[0]"] = own if several else own[0]
        together = [["surface.radius[0]", "surface.height[0]"]] if several else []
    surface = {"kind": "summits", "height": [0.0] * count, "radius": [radius] * count}
    outputs = ("preliminary_displacement", "critical_asperity", "peak_contact_count")
    title = f"one asperity of another radius among {count}"
    tables = {"surface": surface, **LOADED_ONCE}
    return _swept(name, title, pair, tables, values, outputs=outputs, together=together, **options)


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
        [m], and ``branch_drift`` [m], by how much the backward branch is off the 2 δ1 that it should take. Winogrodzka,
        section 6.2.1, Figs. 6.5 (radius), 6.6 (load) and 6.7 (friction).
    """
    values = {"surface.radius": radius, FRICTION: friction, LOAD: normal_load}
    waypoints = [{"time": 0.0}]
    outputs = ["preliminary_displacement"]
    if later_load is not None:
        values[LATER_LOAD] = later_load
        waypoints.append({"time": 1.0})
        outputs += ["drift", "branch_drift"]
    tables = {"surface": {"kind": "sphere"}, "friction": {}, "loading": {"waypoints": waypoints}}
    title = "one contact of other radius, load and friction"
    return _swept("radius_load_friction", title, pair, tables, values, outputs=outputs, **options)


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
        along ``surface_seed``, and of each over the seeds ``NAME_mean``, ``NAME_standard_deviation``,
        ``NAME_quantile``, as by `historysim.spread`. Winogrodzka, Figs. 5.9 to 5.13, 6.9 and 6.10.
    """
    values = {
        "surface.rms_height": rms_height,
        "surface.autocorrelation_length": autocorrelation_length,
        FRICTION: friction,
        LOAD: normal_load,
        "surface.seed": seeds,
    }
    title, tables = "random surfaces of other roughness", _random(pixel_size, list(shape))
    return _with_spread(_swept("roughness", title, pair, tables, values, outputs=OF_ROUGHNESS, **options))


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
    shapes = _shapes("nominal_area", "shape", shape)
    if not all(isinstance(each, list) for each in shapes):
        raise InputError(f"nominal_area: shape is {shape!r}; expected several (nx, ny)")
    with at("nominal_area", "pixel_size"):
        pixel = quantity(pixel_size, "m")
    values = {
        "surface.shape": shapes,
        "surface.rms_height": rms_height,
        "surface.autocorrelation_length": autocorrelation_length,
        FRICTION: friction,
        LOAD: normal_load,
        "surface.seed": seeds,
    }
    title, tables = "one finish on larger and larger faces", _random(pixel_size, shapes[0])
    table = _with_spread(_swept("nominal_area", title, pair, tables, values, outputs=OF_ROUGHNESS, **options))
    areas = [math.prod(each) * pixel**2 for each in shapes]
    return _over_numbers(table, "surface_shape", "nominal_area", areas, long_name="nominal area", units="m2")


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
    surface = {
        "kind": "random",
        "shape": list(shape),
        "pixel_size": pixel_size,
        "autocorrelation_length": autocorrelation_length,
    }
    asked = ("rms_height", between, drift)
    return _searched("finish", pair, surface, asked, normal_load=normal_load, friction=friction, seeds=seeds, **options)


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
    surface = {
        "kind": "textured",
        "count": list(count),
        "pitch": pitch,
        "height_scatter": height_scatter,
        "radius_scatter": radius_scatter,
    }
    asked = ("radius", between, drift)
    return _searched(
        "texture", pair, surface, asked, normal_load=normal_load, friction=friction, seeds=seeds, **options
    )


def _searched(
    what: str,
    pair: MaterialPair,
    surface: dict[str, Any],
    asked: tuple[str, Pair, Quantity],
    *,
    normal_load: Pair,
    friction: float,
    seeds: Seeds,
    **options: Unpack[DesignOptions],
) -> "xr.Dataset":
    """Return the value of a key of the surface at which the drift from one load to the other is what is wanted."""
    key, between, wanted = asked
    name, title = f"{what}_for_a_drift", f"the {what} for a drift"
    both: dict[str, Any] = {"normal_load": normal_load, "between": between}
    for argument, ends in both.items():
        if not isinstance(ends, tuple | list) or len(ends) != 2:
            raise InputError(f"{name}: {argument}: {ends!r}; expected two values")
    with at(name, "seeds"):
        drawn = plain(expand(seeds))
    tables = {
        "surface": {**surface, key: between[0]},
        "friction": {"coefficient": friction},
        "loading": {"waypoints": [{"time": float(time), "normal_load": load} for time, load in enumerate(normal_load)]},
        "design": {
            "key": f"surface.{key}",
            "between": list(between),
            "target": wanted,
            "over": {"surface.seed": drawn},
        },
    }
    return design(_scenario(name, title, pair, tables, {"surface.seed": drawn[0]}), **options)


def _swept(
    name: str,
    title: str,
    pair: MaterialPair,
    tables: Mapping[str, Any],
    values: Mapping[str, Any],
    *,
    outputs: Sequence[str],
    together: Sequence[Sequence[str]] = (),
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return the sweep of a study over those values of which there are several."""
    several: dict[str, list[Any]] = {}
    for key, value in values.items():
        if _is_several(value):
            with reported(name), at(*place_of(key)):
                several[key] = expand(value)
    # a sweep has a dimension at least; where one value of each is given it goes again
    over = several or {key: [value] for key, value in list(values.items())[:1]}
    section = {"outputs": list(outputs), "together": [list(keys) for keys in together], "over": plain(over)}
    first = {**values, **{key: own[0] for key, own in several.items()}}
    table = sweep(_scenario(name, title, pair, {**tables, "sweep": section}, first), **options)
    return table if several else table.squeeze()


def _scenario(
    name: str, title: str, pair: MaterialPair, tables: Mapping[str, Any], values: Mapping[str, Any]
) -> Scenario:
    """Return the scenario of a study, from its tables but ``[materials]``, and further values by key."""
    if not isinstance(pair, MaterialPair):
        raise InputError(f"{name}: pair is {pair!r}; expected a MaterialPair of two materials, or from_moduli")
    head = f"{pair.first.name} on {pair.second.name}" if pair.first and pair.second else "Given moduli"
    document = {"title": f"{head}: {title}", "materials": _materials(pair), **tables}
    with reported(name):
        document = with_values(document, values)
    return scenario_of(document, name)


def _materials(pair: MaterialPair) -> dict[str, Any]:
    """Return the table of a pair; a work of adhesion, which changes nothing, is not in it."""
    if pair.first is not None and pair.second is not None:
        return {"first": _known(pair.first, OF_A_MATERIAL), "second": _known(pair.second, OF_A_MATERIAL)}
    return _known(pair, ("contact_modulus", "shear_modulus", "hardness", "yield_stress"))


def _known(of: object, keys: Iterable[str]) -> dict[str, Any]:
    return {key: getattr(of, key) for key in keys if getattr(of, key) is not None}


def _texture(pitch: Quantity, count: object) -> dict[str, Any]:
    return {"surface": {"kind": "textured", "count": count, "pitch": pitch}, **LOADED_ONCE}


def _random(pixel_size: Quantity, shape: list[int]) -> dict[str, Any]:
    return {"surface": {"kind": "random", "shape": shape, "pixel_size": pixel_size}, **LOADED_ONCE}


def _is_several(value: object) -> bool:
    """Return whether a value is an array or a range."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return isinstance(value, Iterable) and not isinstance(value, str)


def _shapes(name: str, key: str, given: Iterable[Any]) -> list[Any]:
    """Return (nx, ny), or several of them, as lists."""
    if not _is_several(given) or not list(given):
        raise InputError(f"{name}: {key} is {given!r}; expected (nx, ny), or several of them")
    return [list(each) if _is_several(each) else each for each in given]


def _with_spread(table: "xr.Dataset", along: str = "surface_seed") -> "xr.Dataset":
    """Return a sweep with mean, standard deviation and quantiles over a dimension, where it has it."""
    return table.assign(spread(table, along).data_vars) if along in table.dims else table


def _over_numbers(
    table: "xr.Dataset", along: str, name: str, values: Sequence[float], *, long_name: str, units: str
) -> "xr.Dataset":
    """Return a sweep over arrays, such as ``[4, 4]``, with a number in place of each."""
    if along not in table.dims:
        return table
    number = (along, np.asarray(values), {"long_name": long_name, "units": units})
    return table.assign_coords({name: number}).swap_dims({along: name})
