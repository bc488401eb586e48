"""Friction loops that were written to a file, in a few lines."""

import xarray as xr

from historysim.measured.loops import LoopStatistics


def summary(loops: xr.Dataset) -> list[tuple[str, str]]:
    """Return in a few lines what friction loops are like.

    Parameters
    ----------
    loops : xarray.Dataset
        From `Loops.to_dataset`.

    Returns
    -------
    list of (label, text)
        Mean ± standard deviation over the loops of each quantity, and how the loops were found.
    """
    count = loops.sizes["loop"]
    return [
        ("loops", f"{count:,}"),
        *(
            (str(values.attrs["long_name"]), LoopStatistics.of(values.values).text(values.attrs["units"], count))
            for values in loops.data_vars.values()
        ),
        ("", ""),
        *((str(name), str(value)) for name, value in loops.attrs.items()),
    ]
