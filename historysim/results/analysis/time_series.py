"""A history over time: for tables with a row for each time, and for tools that know no other axis."""

from typing import TYPE_CHECKING

from historysim.results.analysis.recorded import check_any, check_recorded, column_of

if TYPE_CHECKING:
    import xarray as xr

CONTENT = "history over time"
"""What the attribute ``content`` of a history over time says."""
OF_THE_RESULT = ("complete", "id", "log_digest")
"""Attributes that hold of the result alone."""


def time_series(history: "xr.Dataset", asperity: int | None = None) -> "xr.Dataset":
    """Return a history with its time for a dimension, in place of ``step``: all of it, or of one asperity.

    The variables of a result go along ``step``, and ``time`` stands beside them; CDO and other tools take for the axis
    of time what is a dimension. That is called ``elapsed_time`` here, since what CF calls ``time`` counts from a date.

    Parameters
    ----------
    history : xarray.Dataset
    asperity : int, optional
        Its label: what is recorded of it stands beside the totals.

    Returns
    -------
    xarray.Dataset
        The variables of the history along ``elapsed_time`` [s], and ``asperity`` where none is chosen. Nothing is read
        yet.

    Raises
    ------
    InputError
        An asperity that is not recorded, or a Dataset that is no history.
    """
    check_recorded(history)
    chosen = history
    if asperity is not None:
        check_recorded(history, "slip_state")
        check_any(history)
        chosen = history.isel(asperity=column_of(asperity, history))
    series = chosen.swap_dims(step="time").rename(time="elapsed_time")
    attributes = {name: value for name, value in history.attrs.items() if name not in OF_THE_RESULT}
    whose = "" if asperity is None else f": asperity {asperity}"
    series.attrs = attributes | {"content": CONTENT, "title": f"{history.attrs.get('title', 'Load history')}{whose}"}
    return series
