"""Friction loops that were written to a file, or a table of them, in a few lines."""

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
    count = loops.sizes["loop"]
    return [
        ("loops", f"{count:,}"),
        *(
            (str(values.attrs["long_name"]), LoopStatistics.of(values.values).text(values.attrs["units"], count))
            for values in loops.data_vars.values()
        ),
        ("", ""),
        *_told(loops),
    ]


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
