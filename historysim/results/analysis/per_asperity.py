"""Pressures, stick ratio, stiffness and power of each asperity, computed when they are read, and of the surface.

A history may be larger than memory, and so may these arrays.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from historysim.basics.arguments import Floats, scalar
from historysim.errors import InputError
from historysim.results.analysis.recorded import SLOPE, check_recorded, is_complete
from historysim.results.queries import query

PEAK_OVER_MEAN = 1.5  # greatest over mean pressure of a Hertz contact
# radius of the stiffness while the displacement continues, and at a reversal
RADIUS = {"onward": "stick_radius", "reversed": "contact_radius"}


@query(per_step=True, planar=True)
def stick_ratio(history: xr.Dataset) -> xr.DataArray:
    """Return c/a of each asperity at each step: 1 in full stick, 0 in gross slip, NaN where it does not touch.

    Along ``step`` and ``asperity``, computed when it is read. InputError: no asperities, or
    patches.
    """
    check_recorded(history, "stick_radius", "contact_radius")

    def ratio(stick: Floats, contact: Floats) -> Floats:
        return _ratio(stick, contact, math.nan)

    text = "stick radius over contact radius"
    return _derive(
        history, "stick_ratio", ratio, ["stick_radius", "contact_radius"], units="1", long_name=text
    )


@query(per_step=True)
def slope_load(history: xr.Dataset) -> xr.DataArray:
    """Return the part of the tangential load that needs no friction [N]: Σ N sin α of inclined asperities.

    Along ``step``. InputError: level asperities, or not all of them are recorded.
    """
    check_recorded(history, "normal_load")
    if SLOPE not in history or not is_complete(history):
        raise InputError(
            'the history is not of all asperities of an inclined contact; expected slopes, record = "all"'
        )
    sine = history[SLOPE] / np.hypot(1.0, history[SLOPE])
    load = (history["normal_load"] * sine).sum("asperity").rename("slope_load")
    return load.assign_attrs(units="N", long_name="tangential load that needs no friction")


@query(per_step=True, planar=True)
def mean_pressure(history: xr.Dataset) -> xr.DataArray:
    """Return the mean pressure of each asperity or patch [Pa], N over its contact area; 0 where it does not touch.

    Along ``step`` and ``asperity``, computed when it is read. InputError: no asperities, or patches
    without areas.
    """
    return _pressure(history, "mean_pressure", "mean pressure of the asperity")


@query(per_step=True, planar=True)
def peak_pressure(history: xr.Dataset) -> xr.DataArray:
    """Return the greatest pressure of each asperity [Pa], 3N/(2πa²) in its middle (Hertz); 0 where it does not touch.

    Along ``step`` and ``asperity``, computed when it is read. InputError: no asperities, or
    patches.
    """
    check_recorded(history, "contact_radius")
    return _pressure(history, "peak_pressure", "greatest pressure of the asperity", PEAK_OVER_MEAN)


@query(per_step=True, planar=True)
def total_mean_pressure(history: xr.Dataset) -> xr.DataArray:
    """Return the mean pressure of the whole contact [Pa], N over the real contact area; 0 where nothing touches.

    Along ``step``. InputError: a history without areas.
    """
    check_recorded(history, "real_contact_area")
    area = history["real_contact_area"]
    pressure = (
        (history["total_normal_load"] / area.where(area > 0))
        .fillna(0.0)
        .rename("total_mean_pressure")
    )
    return pressure.assign_attrs(units="Pa", long_name="mean pressure of the real contact area")


@query(per_step=True, planar=True)
def nominal_pressure(history: xr.Dataset, nominal_area: float | None = None) -> xr.DataArray:
    """Return the normal load over the nominal area [Pa]; the area [m²] defaults to the area of the surface.

    Along ``step``. InputError: an area that is not positive, or none where the history has none.
    """
    check_recorded(history)
    if nominal_area is None and "nominal_area" not in history.attrs:
        raise InputError("the history has no nominal area; expected nominal_area = … [m²]")
    total_area = history.attrs["nominal_area"] if nominal_area is None else nominal_area
    area = scalar("nominal_area", total_area, above=0)
    pressure = (history["total_normal_load"] / area).rename("nominal_pressure")
    return pressure.assign_attrs(units="Pa", long_name="normal load over the nominal area")


@query()
def tangential_stiffness(history: xr.Dataset, direction: str = "onward") -> xr.DataArray:
    """Return the tangential stiffness of each asperity at each step, dT/dU at a fixed approach [N/m].

    An asperity with the stick radius c has 8 G* c while the displacement continues, which is 0
    where it slides; at a reversal all of the contact sticks again and it has 8 G* a (Mindlin 1949).
    The sum over all asperities that touch is the recorded ``tangential_stiffness`` (onward), except
    where a fall of friction lets discs inside a stick zone slide.

    ``direction`` is "onward" or "reversed". Along ``step`` and ``asperity``, computed when it is
    read; 0 where an asperity does not touch. InputError: another direction, or a history without
    asperities or of patches.
    """
    if direction not in RADIUS:
        raise InputError(f"direction is {direction!r}; expected 'onward' or 'reversed'")
    check_recorded(history, RADIUS[direction])
    factor = 8 * float(history.attrs["shear_modulus"])

    def stiffness(radius: Floats) -> Floats:
        return factor * radius

    text = f"tangential stiffness of the asperity, displacement {direction}"
    return _derive(
        history,
        "tangential_stiffness",
        stiffness,
        [RADIUS[direction]],
        units="N m-1",
        long_name=text,
    )


@query(planar=True)
def dissipated_power(history: xr.Dataset) -> xr.DataArray:
    """Return the mean power that each asperity dissipates over the time up to each step [W].

    The energy dissipated since the step before over the time since then; 0 at the first step. Times
    the lengths of the steps, the powers add up to the dissipated energy. Along ``step`` and
    ``asperity``, computed when it is read. InputError: no asperities.
    """
    check_recorded(history, "dissipated_energy")
    energy = history["dissipated_energy"]
    previous = energy.isel(step=np.maximum(np.arange(energy.sizes["step"]) - 1, 0))
    duration = np.diff(history["time"].values, prepend=history["time"].values[:1])
    # broadcast, not copied: one duration for all asperities of a step
    durations = xr.DataArray(duration, dims="step").broadcast_like(energy)

    def power(energy: Floats, previous: Floats, duration: Floats) -> Floats:
        return _ratio(np.asarray(energy) - np.asarray(previous), duration, 0.0)

    text = "power that the asperity dissipates, mean since the step before"
    return _derive(
        history, "dissipated_power", power, [energy, previous, durations], units="W", long_name=text
    )


def _pressure(history: xr.Dataset, name: str, text: str, factor: float = 1.0) -> xr.DataArray:
    of_radius = "contact_area" not in history
    size = "contact_radius" if of_radius else "contact_area"
    check_recorded(history, "normal_load", size)

    def pressure(load: Floats, size: Floats) -> Floats:
        return factor * _ratio(load, math.pi * size**2 if of_radius else size, 0.0)

    return _derive(history, name, pressure, ["normal_load", size], units="Pa", long_name=text)


def _ratio(values: Floats, sizes: Floats, without: float) -> Floats:
    """Return values over the sizes of contacts, and another number where there is no contact."""
    values = np.asarray(values)
    return np.divide(values, sizes, out=np.full_like(values, without), where=np.asarray(sizes) > 0)


class _Derived(BackendArray):
    """An array computed from variables of the same dimensions when it is indexed."""

    def __init__(self, compute: Callable[..., Floats], sources: Sequence[xr.Variable]) -> None:
        self.dims = sources[0].dims
        self.shape = sources[0].shape
        self.dtype = np.dtype(np.float64)
        self._compute, self._sources = compute, sources

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._compute_part
        )

    def _compute_part(self, key: tuple[Any, ...]) -> Floats:
        where = dict(zip(self.dims, key, strict=True))
        return self._compute(*(source.isel(where).values for source in self._sources))


def _derive(
    history: xr.Dataset,
    name: str,
    compute: Callable[..., Floats],
    sources: Sequence[str | xr.DataArray],
    **attributes: str,
) -> xr.DataArray:
    """Return an array that is computed from arrays, or variables of a history, element by element, where it is read."""
    arrays = [history[source] if isinstance(source, str) else source for source in sources]
    if any(array.chunks for array in arrays):
        # from dask arrays another one, with their chunks
        answer: xr.DataArray = xr.apply_ufunc(
            compute,
            arrays[0],
            *(array.chunk(arrays[0].chunksizes).variable for array in arrays[1:]),
            dask="parallelized",
            output_dtypes=[np.float64],
            keep_attrs=True,
        ).rename(name)
        answer.attrs = dict(attributes)
        return answer
    array = _Derived(compute, [array_source.variable for array_source in arrays])
    coordinates = {
        key: value for key, value in history.coords.items() if set(value.dims) <= set(array.dims)
    }
    lazy = xr.Variable(array.dims, indexing.LazilyIndexedArray(array), attributes)
    return xr.DataArray(lazy, coordinates, name=name)
