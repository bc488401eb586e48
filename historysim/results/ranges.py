"""The ranges of the variables of a table, in a line each."""

import numpy as np
import xarray as xr

from historysim.basics.units import range_text
from historysim.basics.wording import counted

MOST_SHOWN = 40
"""Variables that are listed."""


def ranges(table: xr.Dataset) -> list[tuple[str, str]]:
    """Return lines of (label, text): each variable with its range, and what it is where it says so."""
    lines = []
    for name, values in list(table.data_vars.items())[:MOST_SHOWN]:
        meaning = str(values.attrs.get("long_name", ""))
        lines.append((str(name), f"{range_of(values)}{f'; {meaning}' if meaning else ''}"))
    if len(table.data_vars) > MOST_SHOWN:
        lines.append(("and", f"{len(table.data_vars) - MOST_SHOWN:,} more"))
    return lines


def range_of(values: xr.DataArray) -> str:
    """Return the range of a variable, with its unit and how many values are missing; of texts how many there are."""
    if values.dtype.kind not in "iuf":
        return counted(len(set(values.values.ravel().tolist())), "text", "different texts")
    known = values.values[np.isfinite(values.values)]
    if not known.size:
        return "no value"
    text = range_text(float(known.min()), float(known.max()), str(values.attrs.get("units", "1")))
    return text if known.size == values.size else f"{text}, {values.size - known.size:,} missing"
