"""How hard asperities are pressed, and how much of their contact sticks: element by element, where it is read."""

import math
from typing import TYPE_CHECKING

import numpy as np

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.results.analysis.recorded import check_recorded

if TYPE_CHECKING:
    import xarray as xr


PEAK_OVER_MEAN = 1.5
"""Of the pressure of a Hertz contact."""
SURFACE_GROUP = "surface"
"""The group of a result that says what surface it is of."""


def stick_ratio(history: "xr.Dataset") -> "xr.DataArray":
    """Return c/a of each asperity at each step: 1 in full stick, 0 in gross slip, NaN where it does not touch.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities.

    Returns
    -------
    xarray.DataArray
        [1] along ``step`` and ``asperity``, computed where it is read.

    Raises
    ------
    InputError
        A history without asperities, or of patches.
    """
    from historysim.results.analysis.derived import derived

    check_recorded(history, "stick_radius", "contact_radius")
    return derived(
        history,
        "stick_ratio",
        lambda stick, contact: _ratio(stick, contact, math.nan),
        ["stick_radius", "contact_radius"],
        units="1",
        long_name="stick radius over contact radius",
    )


def mean_pressure(history: "xr.Dataset") -> "xr.DataArray":
    """Return the mean pressure of each asperity or patch, N over its contact area; 0 where it does not touch.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities or patches.

    Returns
    -------
    xarray.DataArray
        [Pa] along ``step`` and ``asperity``, computed where it is read.

    Raises
    ------
    InputError
        A history without asperities, or of patches without areas.
    """
    return _pressure(history, "mean_pressure", "mean pressure of the asperity")


def peak_pressure(history: "xr.Dataset") -> "xr.DataArray":
    """Return the greatest pressure of each asperity, 3N/(2πa²) in its middle (Hertz); 0 where it does not touch.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities.

    Returns
    -------
    xarray.DataArray
        [Pa] along ``step`` and ``asperity``, computed where it is read.

    Raises
    ------
    InputError
        A history without asperities, or of patches.
    """
    check_recorded(history, "contact_radius")
    return _pressure(history, "peak_pressure", "greatest pressure of the asperity", PEAK_OVER_MEAN)


def total_mean_pressure(history: "xr.Dataset") -> "xr.DataArray":
    """Return the mean pressure of the whole contact, all of N over the real contact area; 0 where nothing touches.

    Parameters
    ----------
    history : xarray.Dataset

    Returns
    -------
    xarray.DataArray
        [Pa] along ``step``.

    Raises
    ------
    InputError
        A history without areas.
    """
    check_recorded(history, "real_contact_area")
    area = history["real_contact_area"]
    pressure = (history["total_normal_load"] / area.where(area > 0)).fillna(0.0).rename("total_mean_pressure")
    return pressure.assign_attrs(units="Pa", long_name="mean pressure of the real contact area")


def nominal_pressure(history: "xr.Dataset", nominal_area: float | None = None) -> "xr.DataArray":
    """Return the normal load over the nominal area.

    Parameters
    ----------
    history : xarray.Dataset
    nominal_area : float, optional
        [m²]; by default what the history says of its surface.

    Returns
    -------
    xarray.DataArray
        [Pa] along ``step``.

    Raises
    ------
    InputError
        An area that is not positive, or none where the history does not say it.
    """
    check_recorded(history)
    area = _nominal_area(history) if nominal_area is None else scalar("nominal_area", nominal_area, above=0)
    pressure = (history["total_normal_load"] / area).rename("nominal_pressure")
    return pressure.assign_attrs(units="Pa", long_name="normal load over the nominal area")


def _nominal_area(history: "xr.Dataset") -> float:
    import xarray as xr

    if "nominal_area" in history.attrs:
        return float(history.attrs["nominal_area"])
    source = history.encoding.get("source")
    if source:
        # results of earlier versions tell it with the surface
        try:
            with xr.open_dataset(source, engine="netcdf4", group=SURFACE_GROUP) as surface:
                if "nominal_area" in surface.attrs:
                    return float(surface.attrs["nominal_area"])
        except (OSError, KeyError):
            # a file without a surface
            pass
    raise InputError("the history does not say its nominal area; expected nominal_area = … [m²]")


def _pressure(history: "xr.Dataset", name: str, label: str, factor: float = 1.0) -> "xr.DataArray":
    from historysim.results.analysis.derived import derived

    square = "contact_area" not in history
    size = "contact_radius" if square else "contact_area"
    check_recorded(history, "normal_load", size)

    def pressure(load: Floats, size: Floats) -> Floats:
        return factor * _ratio(load, math.pi * size**2 if square else size, 0.0)

    return derived(history, name, pressure, ["normal_load", size], units="Pa", long_name=label)


def _ratio(values: Floats, sizes: Floats, without: float) -> Floats:
    """Return values over the sizes of contacts, and another number where there is no contact."""
    values = np.asarray(values)
    return np.divide(values, sizes, out=np.full_like(values, without), where=np.asarray(sizes) > 0)
