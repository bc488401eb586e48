"""What a sweep says of chance, and of change: spread over seeds, and drift along a swept quantity."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from historysim.basics.wording import nearest
from historysim.errors import InputError

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
LABELS = ("critical_asperity",)
"""Numbers of a sweep that only name something, so that a mean of them says nothing."""


def spread(found: xr.Dataset, along: str = "surface_seed", quantiles: Sequence[float] = QUANTILES) -> xr.Dataset:
    """Return how the numbers of a sweep spread over one of its dimensions, mostly seeds.

    Parameters
    ----------
    found : xarray.Dataset
        From `historysim.sweep`.
    along : str
        The dimension.
    quantiles : sequence of float
        Each from 0 to 1; those between two cells are interpolated linearly.

    Returns
    -------
    xarray.Dataset
        For each variable with the dimension, in its own unit: ``NAME_mean``, ``NAME_standard_deviation`` (of the
        population, from n - 1), ``NAME_quantile`` along ``quantile``, and ``NAME_count``, the number of cells n. Cells
        that have failed are left out; where none is left all are NaN, and with one the standard deviation.

    Raises
    ------
    InputError
        The sweep has no such dimension, or a quantile is none.

    Examples
    --------
    >>> over = {"surface.seed": range(3)}
    >>> found = hs.sweep("scenarios/18_texture_tolerances.toml", {**over, "surface.height_scatter": ["10 nm"]})
    >>> "preliminary_displacement_mean" in hs.spread(found, "surface_seed")
    True
    """
    _check_dimension(found, along)
    share = np.array(quantiles, dtype=float)
    if share.ndim != 1 or not ((share >= 0) & (share <= 1)).all():
        raise InputError(f"quantiles are {quantiles!r}; expected numbers from 0 to 1")
    result: dict[str, xr.DataArray] = {}
    for name, values in found.data_vars.items():
        if along not in values.dims or values.dtype.kind not in "fi" or name in LABELS:
            continue
        numbers, text = values.astype(float), str(values.attrs.get("long_name", name))
        count: xr.DataArray = numbers.notnull().sum(along)
        middle = numbers.sum(along) / count.where(count > 0)
        variance = ((numbers - middle) ** 2).sum(along) / (count - 1).where(count > 1)
        statistics: dict[str, tuple[xr.DataArray, str]] = {
            "mean": (middle, "mean"),
            "standard_deviation": (variance**0.5, "standard deviation"),
            "quantile": (_quantiles(numbers, along, share), "quantiles"),
        }
        for suffix, (made, word) in statistics.items():
            made.attrs = {"long_name": f"{word} of: {text}", "units": values.attrs.get("units", "1")}
            result[f"{name}_{suffix}"] = made
        count.attrs = {"long_name": f"number of cells with: {text}", "units": "1"}
        result[f"{name}_count"] = count
    return xr.Dataset(result, attrs={**found.attrs, "spread_along": along})


def _quantiles(
    numbers: xr.DataArray, along: str, share: "np.ndarray[tuple[int], np.dtype[np.float64]]"
) -> xr.DataArray:
    """Return quantiles along a dimension, of what is there."""
    ordered = np.sort(numbers.transpose(..., along).values, axis=-1)
    count = np.isfinite(ordered).sum(axis=-1, keepdims=True)
    place = share * np.maximum(count - 1, 0)
    low = np.floor(place).astype(int)
    high = np.minimum(low + 1, np.maximum(count - 1, 0))
    below, above = (np.take_along_axis(ordered, index, axis=-1) for index in (low, high))
    rest = [dim for dim in numbers.dims if dim != along]
    coordinates = {name: value for name, value in numbers.coords.items() if along not in value.dims}
    values = below + (place - low) * (above - below)
    return xr.DataArray(values, coordinates | {"quantile": share}, [*rest, "quantile"])


def drift_along(found: xr.Dataset, along: str, name: str = "preliminary_displacement") -> xr.DataArray:
    """Return how far a number drifts along a swept quantity: its change from the first value on, without sign.

    Parameters
    ----------
    found : xarray.Dataset
        From `historysim.sweep`.
    along : str
        The dimension: of a load, a friction coefficient, a radius.
    name : str
        The number.

    Raises
    ------
    InputError
        The sweep has no such dimension or number.
    """
    _check_dimension(found, along)
    if name not in found or along not in found[name].dims:
        known = [str(key) for key, values in found.data_vars.items() if along in values.dims]
        raise InputError(f"{name!r} is no number of this sweep along {along}; {nearest(name, known)}")
    changed = abs(found[name] - found[name].isel({along: 0}, drop=True))
    text = found[name].attrs.get("long_name", name)
    changed.attrs = {"long_name": f"drift along {along} of: {text}", "units": found[name].attrs.get("units", "1")}
    return changed.rename(f"{name}_drift")


def _check_dimension(table: xr.Dataset, along: str) -> None:
    if along not in table.dims:
        dims = [str(dim) for dim in table.dims]
        raise InputError(f"{along!r} is no dimension of this sweep; {nearest(along, dims)}")
