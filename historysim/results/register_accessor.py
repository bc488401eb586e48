"""Accessor `contact` of Datasets; the modules of all queries are imported on its first use."""

from typing import TYPE_CHECKING

import xarray as xr

if TYPE_CHECKING:
    from historysim.results.accessor import Queries


@xr.register_dataset_accessor("contact")  # type: ignore[no-untyped-call] # xarray gives no types
def make_queries(history: xr.Dataset) -> "Queries":
    """Return the queries of a history."""
    from historysim.results.accessor import Queries

    return Queries(history)
