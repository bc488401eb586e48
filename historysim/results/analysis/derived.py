"""Arrays that are computed from variables of a history, which may be larger than memory, when they are asked for.

Where the variables are dask arrays, they are read as those are cut.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from historysim.basics.array_types import Floats


class _Derived(BackendArray):
    """An array that is computed from variables of its own dimensions where it is indexed, and nowhere else."""

    def __init__(self, compute: Callable[..., Floats], sources: Sequence[xr.Variable]) -> None:
        self.dims, self.shape = sources[0].dims, sources[0].shape
        self.dtype = np.dtype(np.float64)
        self._compute, self._sources = compute, sources

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._at)

    def _at(self, key: tuple[Any, ...]) -> Floats:
        where = dict(zip(self.dims, key, strict=True))
        return self._compute(*(source.isel(where).values for source in self._sources))


def derived(
    history: xr.Dataset, name: str, compute: Callable[..., Floats], sources: Sequence[str], **attributes: str
) -> xr.DataArray:
    """Return an array that is computed from variables of a history, element by element, where it is asked for.

    Parameters
    ----------
    history : xarray.Dataset
    name : str
        Of the array.
    compute : callable
        Takes the same part of each of the variables as arrays, and returns that of the array.
    sources : sequence of str
        The names of the variables, all of the same dimensions.
    **attributes
        Units and long name.

    Returns
    -------
    xarray.DataArray
        A dask array where one of the variables is; else one that is read and computed where it is indexed.
    """
    arrays = [history[source] for source in sources]
    if any(array.chunks for array in arrays):
        # of dask arrays another one, which goes on as they are cut
        answer: xr.DataArray = xr.apply_ufunc(
            compute, *arrays, dask="parallelized", output_dtypes=[np.float64], keep_attrs=True
        ).rename(name)
        answer.attrs = dict(attributes)
        return answer
    array = _Derived(compute, [each.variable for each in arrays])
    coordinates = {key: value for key, value in history.coords.items() if set(value.dims) <= set(array.dims)}
    lazy = xr.Variable(array.dims, indexing.LazilyIndexedArray(array), attributes)
    return xr.DataArray(lazy, coordinates, name=name)
