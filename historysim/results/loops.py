"""Friction loops that were written to a file, or a table of them, in a few lines."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.units import quantity_text
from historysim.measured.statistics import LoopStatistics


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
    large = loops.isel(loop=_large(loops))
    count = large.sizes["loop"]
    some = "" if count == loops.sizes["loop"] else f", of which {count:,} are large enough for the means below"
    return [
        ("loops", f"{loops.sizes['loop']:,}{some}"),
        ("values", "mean ± standard deviation of one loop"),
        *(
            (str(values.attrs["long_name"]), LoopStatistics.of(values.values).text(values.attrs["units"], count))
            for values in large.data_vars.values()
        ),
        ("", ""),
        *_told(loops),
    ]


def _large(loops: xr.Dataset) -> npt.NDArray[np.bool_]:
    """Return which loops count in means, as `Loops.large` does; all of a file of a version that had no amplitudes."""
    if "amplitude" not in loops:
        return np.ones(loops.sizes["loop"], dtype=np.bool_)
    amplitude = loops["amplitude"].values
    return np.asarray(amplitude >= loops.attrs["amplitude_share"] * amplitude.max())


def _told(loops: xr.Dataset) -> list[tuple[str, str]]:
    return [(str(name), str(value)) for name, value in loops.attrs.items()]


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
