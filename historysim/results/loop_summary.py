"""Friction loops that were written to a file, or a table of them, in a few lines."""

from collections.abc import Hashable

import numpy as np
import xarray as xr

from historysim.basics.array_types import Booleans, Floats
from historysim.basics.units import quantity_text
from historysim.measured.loop_values import OF_SLIP
from historysim.measured.statistics import LoopStatistics
from historysim.results.netcdf_table import FOR_CATALOGUES


def summary(loops: xr.Dataset) -> list[tuple[str, str]]:
    """Return in a few lines what friction loops are like.

    Parameters
    ----------
    loops : xarray.Dataset
        From `Loops.to_dataset`, or `LoopTable.to_dataset`.

    Returns
    -------
    list of (label, text)
        Mean ± standard deviation over the loops of each quantity, and how the loops were found; of a table that of each
        load or amplitude, of both directions.
    """
    if "loop" not in loops.dims:
        return [*_table(loops), ("", ""), *_told(loops)]
    count = int(_large(loops).sum())
    some = "" if count == loops.sizes["loop"] else f", of which {count:,} are large enough for the means below"
    return [
        ("loops", f"{loops.sizes['loop']:,}{some}"),
        ("values", "mean ± standard deviation of one loop"),
        *((str(values.attrs["long_name"]), _text(loops, name, count)) for name, values in loops.data_vars.items()),
        ("", ""),
        *_told(loops),
    ]


def of_mean(loops: xr.Dataset, quantity: Hashable) -> Floats:
    """Return what a mean of a quantity is of (loop, …): large loops, and NaN where it is a lower bound."""
    values = loops[quantity]
    if quantity in OF_SLIP and "lower_bound" in loops:
        values = values.where(loops["lower_bound"] == 0)
    kept: Floats = values.values[_large(loops)]
    return kept


def _text(loops: xr.Dataset, quantity: Hashable, count: int) -> str:
    """Return a mean as a text: where no branch came to slide, a lower bound."""
    unit = loops[quantity].attrs["units"]
    found = LoopStatistics.of(of_mean(loops, quantity))
    if found.count or quantity not in OF_SLIP:
        return found.text(unit, count)
    bound = LoopStatistics.of(loops[quantity].values[_large(loops)])
    return f"≥ {bound.text(unit, count)}" if bound.count else bound.text(unit, count)


def _large(loops: xr.Dataset) -> Booleans:
    """Return which loops count in means, as `Loops.large` does; all of a file of a version that had no amplitudes."""
    if "amplitude" not in loops:
        return np.ones(loops.sizes["loop"], dtype=np.bool_)
    amplitude = loops["amplitude"].values
    return np.asarray(amplitude >= loops.attrs["amplitude_share"] * amplitude.max())


def _told(loops: xr.Dataset) -> list[tuple[str, str]]:
    return [(str(name), str(value)) for name, value in loops.attrs.items() if name not in FOR_CATALOGUES]


def _table(table: xr.Dataset) -> list[tuple[str, str]]:
    both = table.sel(direction="both")
    (along,) = both["loops"].dims
    lines = []
    for place, value in enumerate(both[along].values):
        at = both.isel({along: place})
        lines.append((quantity_text(float(value), both[along].attrs["units"]), f"{int(at['loops']):,} loops"))
        for name, mean in at.data_vars.items():
            if f"{name}_count" in at:
                found = LoopStatistics(float(mean), float(at[f"{name}_standard_deviation"]), int(at[f"{name}_count"]))
                text = found.text(mean.attrs["units"], int(at["loops"]))
                lines.append((f"  {mean.attrs['long_name']}", text))
    return lines
