"""Random surfaces: what their roughness does, what their size does, and how far it is chance."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Unpack

from historysim.basics.places import at
from historysim.basics.units import quantity
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.studies.design_studies.study import (
    Quantities,
    Quantity,
    Seeds,
    StoredSweepOptions,
    is_several,
    over_numbers,
    swept,
    with_spread,
)

if TYPE_CHECKING:
    import xarray as xr

OUTPUTS = ("preliminary_displacement", "presliding_work", "peak_contact_count", "peak_contact_area")


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
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return what random surfaces of other roughness and autocorrelation length do, and how far that is chance.

    Parameters
    ----------
    pair : MaterialPair
    rms_height : float, str or several
        Rq [m] of the Gaussian heights.
    autocorrelation_length : float, str or several
        β [m], at which the exponential autocorrelation falls to 0.1.
    normal_load, friction
        N [N], μ; each one or several.
    shape : (nx, ny)
        Points of the map.
    pixel_size : float or str
        Distance of its points [m].
    seeds : several int, or a range
        A surface is made with each.
    **options
        ``workers``, ``executor``, ``store``, ``progress``, ``tell``, as for `historysim.sweep`.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m], ``presliding_work`` [J], ``peak_contact_count`` [1] and ``peak_contact_area``
        [m²] over what there are several of, and ``surface_seed``; of each over the seeds ``NAME_mean``,
        ``NAME_standard_deviation``, ``NAME_quantile``, as by `historysim.spread`.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; all cells have failed.

    Notes
    -----
    Winogrodzka, Figs. 5.9 to 5.13, 6.9 and 6.10. Summits are found by the 9-point rule.
    """
    values = {
        "surface.rms_height": rms_height,
        "surface.autocorrelation_length": autocorrelation_length,
        "friction.coefficient": friction,
        "loading.waypoints[0].normal_load": normal_load,
        "surface.seed": seeds,
    }
    tables = random_tables(pixel_size, list(shape))
    title = "random surfaces of other roughness"
    return with_spread(swept("roughness", title, pair, tables, values, outputs=OUTPUTS, **options))


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
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return what one finish does on larger and larger faces under one load.

    Parameters
    ----------
    shape : several (nx, ny)
        Points of the maps.
    pair, rms_height, autocorrelation_length, normal_load, friction, pixel_size, seeds, **options
        As for `roughness`.

    Returns
    -------
    xarray.Dataset
        As `roughness`; the dimension of ``shape`` is ``nominal_area``, nx ny times the area of a pixel [m²].

    Raises
    ------
    InputError
        A value that cannot be used, with its key; all cells have failed.
    """
    shapes: list[Any] = [list(each) if is_several(each) else each for each in shape] if is_several(shape) else []
    if not shapes or not all(isinstance(each, list) for each in shapes):
        raise InputError(f"nominal_area: shape is {shape!r}; expected several (nx, ny)")
    with at("nominal_area", "pixel_size"):
        pixel = quantity(pixel_size, "m")
    values = {
        "surface.shape": shapes,
        "surface.rms_height": rms_height,
        "surface.autocorrelation_length": autocorrelation_length,
        "friction.coefficient": friction,
        "loading.waypoints[0].normal_load": normal_load,
        "surface.seed": seeds,
    }
    title = "one finish on larger and larger faces"
    tables = random_tables(pixel_size, shapes[0])
    table = with_spread(swept("nominal_area", title, pair, tables, values, outputs=OUTPUTS, **options))
    areas = [math.prod(each) * pixel**2 for each in shapes]
    return over_numbers(table, "surface_shape", "nominal_area", areas, long_name="nominal area", units="m2")


def random_tables(pixel_size: Quantity, shape: list[int]) -> dict[str, Any]:
    """Return the tables of a random surface that is loaded once, but for what is swept."""
    return {
        "surface": {"kind": "random", "shape": shape, "pixel_size": pixel_size},
        "friction": {},
        "loading": {"waypoints": [{"time": 0.0}]},
    }
