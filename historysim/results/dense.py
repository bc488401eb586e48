"""Rows between those of a history, for smooth pictures: its events replayed with more substeps."""

import attrs
import numpy as np
import xarray as xr

from historysim.results.origin import Origin, ask_origin

FEW, WANTED = 240, 480
"""Steps below which a history is replayed for a picture, and how many there are to be then."""


def dense(history: xr.Dataset) -> xr.Dataset:
    """Return the totals of a history at so many steps that curves look smooth.

    Parameters
    ----------
    history : xarray.Dataset
        A history, or the rows of a cell of a sweep.

    Returns
    -------
    xarray.Dataset
        Totals along ``step``, with the attributes of the history, where that has few steps and comes from a file that
        holds its events; the history itself otherwise. Substeps change no result.
    """
    steps = history.sizes["step"]
    if steps >= FEW or steps < 2:
        return history
    again = ask_origin(history, lambda origin: _again(origin, steps))
    # a part of a history is drawn as it is
    if again is None or not np.isclose(again["time"][[0, -1]], history["time"][[0, -1]], rtol=1e-12, atol=0).all():
        return history
    return again.assign_attrs(history.attrs)


def _again(origin: Origin, steps: int) -> xr.Dataset:
    job = origin.replay()
    return attrs.evolve(job, substeps=job.substeps * -(-WANTED // steps), record="totals").dataset()
