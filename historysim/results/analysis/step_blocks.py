"""A history may be larger than memory: it is read in blocks of steps."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

    from historysim.results.analysis.recorded import Recorded

CELLS_AT_ONCE = 1 << 19
"""Steps times asperities of one variable that are held in memory at a time."""


def blocks(history: "xr.Dataset", names: Sequence[str]) -> Iterator["tuple[int, xr.Dataset]"]:
    """Yield variables of a history, loaded, a block of steps at a time.

    Parameters
    ----------
    history : xarray.Dataset
    names : sequence of str
        Variables along ``step``.

    Yields
    ------
    (int, xarray.Dataset)
        The position of the first step, and the variables from there on.
    """
    chosen = history[list(names)]
    for rows in parts(history):
        yield rows.start, chosen.isel(step=rows).load()


def parts(history: "Recorded") -> Iterator[slice]:
    """Yield the steps of a history in blocks, of all of whose asperities one variable can be held in memory."""
    steps, asperities = history.sizes["step"], history.sizes.get("asperity", 1)
    at_once = max(1, CELLS_AT_ONCE // max(asperities, 1))
    for first in range(0, steps, at_once):
        yield slice(first, min(first + at_once, steps))
